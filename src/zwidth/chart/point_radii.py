"""Spectral radii of walls at many operating points together, from their loops."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.table_radii import radii_and_leverages, spectral_radii
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_loops import pieces_of_points, table_of_points
from zwidth.model.coupled_pairs import AGREEMENT

ERROR: Final = 1e-9  # largest error of a radius, relative to 1


def radii_at_points(point: OperatingPoint, wall_stiffness: Floats, wall_damping: Floats) -> Floats:
    """Largest |z| (...) of a wall K, B (...) at each point.

    Returns  nan where a point is to be looked at alone, as `verdict.spectral_radius` of its loop: its loop is not
             of the form that kernels take, or dampers couple its modes, which a batch knows to AGREEMENT only, and
             the largest root moves too much with them
    """
    K, B = wall_stiffness.ravel(), wall_damping.ravel()
    radii = np.full(K.size, np.nan)
    for at, piece in pieces_of_points(point):
        radii[at] = _radii_of_loops(piece, K[at], B[at])
    return radii.reshape(wall_stiffness.shape)


def _radii_of_loops(point: OperatingPoint, K: Floats, B: Floats) -> Floats:
    """`radii_at_points` for flat walls (N,): first of loops that are known to rounding, then of coupled ones."""
    radii = np.full(len(K), np.nan)
    exact = table_of_points(point, coupled=False)
    if exact is not None:
        radii = spectral_radii(exact, np.arange(len(K)), K, B)
    rest = np.flatnonzero(np.isnan(radii))
    table = table_of_points(point) if len(rest) else None
    if table is not None:
        found, leverage = radii_and_leverages(table, rest, K[rest], B[rest])
        radii[rest] = np.where(leverage * AGREEMENT <= ERROR, found, np.nan)
    return radii
