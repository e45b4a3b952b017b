"""Other faces of one wall: impedance over frequency, Nyquist plot with passivity disks, eigenvalues."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from zwidth.chart.nyquist import terms_along
from zwidth.chart.verdict import eigenvalues
from zwidth.guarantees.disks import response_disks
from zwidth.guarantees.port import port
from zwidth.guarantees.stable_alone import stable_alone
from zwidth.loop.circle_factors import circle_factors
from zwidth.loop.loop_table import table_of_loops
from zwidth.loop.operating_point import OperatingPoint
from zwidth.show.app.request import Wall

Contents = tuple[dict[str, Any], dict[str, Any]]

LOWEST: Final = 1e-3  # rad, of the angles at which the Nyquist plot is computed
ANGLES: Final = 1200
DISKS: Final = 25  # of the angles, at which a disk is drawn


def impedance(point: OperatingPoint, wall: Wall) -> Contents:
    """What the hand feels of the wall over frequency, beside the commanded impedance and that of free motion."""
    felt = point.felt(wall.stiffness, wall.damping)
    arrays = {
        "frequency": felt.frequency,
        "commanded": np.abs(felt.commanded_impedance),
        "free": np.abs(felt.free_motion_impedance),
    }
    if felt.felt_impedance is not None:
        arrays["felt"] = np.abs(felt.felt_impedance)
    return {"static_stiffness": felt.static_stiffness, "free_motion_mass": felt.free_motion_mass}, arrays


def nyquist(point: OperatingPoint, wall: Wall) -> Contents:
    """The open loop L = P (K + B w) over the upper half of the unit circle, (k, 3) with angles; the wall is stable
    where it goes round -1 as often as it must. With every passive operator P fills a disk at each frequency, and
    so does L: rows (real, imaginary, radius, frequency). In any passive hand it is stable if no disk holds -1.
    """
    loop = point.loop
    angles = np.geomspace(LOWEST, np.pi - LOWEST, ANGLES)
    A, AP, APw = terms_along(circle_factors(table_of_loops(loop)), angles).T
    L = (wall.stiffness * AP + wall.damping * APw) / A
    arrays: dict[str, Any] = {"open_loop": np.column_stack([L.real, L.imag, angles / (2.0 * np.pi * loop.period)])}
    head: dict[str, Any] = {}
    free = point.without_operator.loop
    handle = free.plant.handle
    if handle is None:
        return {"no_disks": "the plant has no handle, at which an operator could hold it"}, arrays
    alone = stable_alone(free)
    if alone.fails or point.load_omissions:
        return {"no_disks": alone.reason or point.load_omissions[0]}, arrays
    every = angles[:: max(1, ANGLES // DISKS)]
    disks = response_disks(free, port(free.plant, handle), every)
    A, AP, APw = terms_along(circle_factors(table_of_loops(free)), every).T
    law = (wall.stiffness * AP + wall.damping * APw) / AP
    centre, radius = disks.centre * law, disks.radius * np.abs(law)
    arrays["disks"] = np.column_stack([centre.real, centre.imag, radius, every / (2.0 * np.pi * loop.period)])
    return head, arrays


def eigenvalues_of(point: OperatingPoint, wall: Wall) -> Contents:
    """The eigenvalues of the loop with the wall, rows (real, imaginary)."""
    z = np.sort_complex(eigenvalues(point.loop, wall.stiffness, wall.damping).ravel())
    return {}, {"z": np.column_stack([z.real, z.imag])}
