"""Check in compiled code whether a checked device can still be assembled with other numbers."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Flags
from zwidth.model.mechanism import Mechanism
from zwidth.model.posture import OK, Posture, solve_posture


def assembles(mechanism: Mechanism, assembly: str | None) -> bool:
    """Whether there is a posture at the reference, with a mass for every motion.

    What holds is what `mechanism_check.mechanism_faults` checks of any mechanism, in a tenth of its time. Where it
    does not hold nothing is said: the mechanism may still be put together with its handle elsewhere.
    """
    try:
        posture = solve_posture(mechanism, mechanism.reference_position, assembly)
    except ValueError:
        return False
    return bool(masses_moved(posture).all())


def masses_moved(posture: Posture) -> Flags:
    """Marks (...) of the postures in which every motion has a mass, and of those that are not OK."""
    known = (posture.status == OK) & ~np.isnan(posture.mass_matrix).any(axis=(-2, -1))
    M = np.where(known[..., None, None], posture.mass_matrix, np.eye(posture.mass_matrix.shape[-1]))
    eigenvalues = np.linalg.eigvalsh(M)
    least = M.shape[-1] * np.finfo(float).eps * eigenvalues[..., -1]
    return np.asarray(eigenvalues[..., 0] > least)
