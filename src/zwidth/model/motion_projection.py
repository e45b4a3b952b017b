"""Projection of a part that acts on one motion of the full model onto the motions of a reduced one."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats

ROUNDING = 1e-12  # share of a motion that is none


def project_onto_motions(vector: Floats, motions: Floats) -> Floats:
    """vector . motion for each motion (m,), a column each of (n, m); rounding set to 0."""
    products = vector @ motions
    inside = np.abs(vector) @ np.abs(motions)
    return np.asarray(np.where(np.abs(products) > ROUNDING * inside, products, 0.0))
