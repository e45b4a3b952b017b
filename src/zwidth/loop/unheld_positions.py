"""Positions that nobody holds, of a device on a wall without stiffness.

A damper resists motion and holds no place: where a motion of the device has no spring to the ground either, the
device rests wherever it was left. Its characteristic function has the plant's pole z = 1 and the zero z = 1 of the
velocity estimate, so that z - 1 divides the characteristic polynomial for every B: the root is the position, which
neither comes back nor runs away. A second root there is a velocity that nothing brakes, and counts.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Complexes
from zwidth.loop.loop import Loop
from zwidth.loop.multi_loop import MultiLoop
from zwidth.model.modes import undamped_modes

# Share of the sizes of force and reading along the free motions that rounding leaves of 0: with less, a motion
# that no wall moves would count as one that the wall leaves unheld; with more, one that hardly moves would not.
MOVED: Final = 1e-12
# Distance from z = 1 within which an unheld position's root is computed, where a few others are beside it: with
# less, it is mistaken for a vibration; with more, nothing is set aside that was not there, but a wrong count would
# hide a root.
AT_ONE: Final = 1e-5


def unheld_positions(loop: Loop | MultiLoop) -> int:
    """How many roots z = 1 of walls without stiffness belong to positions that nobody holds; 0 with a spring to
    the ground, of the device, its operator, or a local loop."""
    if isinstance(loop, MultiLoop):
        return _directions_unheld(loop)
    if "unheld" not in loop.results:
        loop.results["unheld"] = _unheld(loop)
    return int(loop.results["unheld"])


def set_aside(roots: Complexes, count: int) -> Complexes:
    """Roots (..., N), of which so many, those nearest to z = 1, are replaced by 0."""
    rest = np.array(roots, dtype=np.complex128)
    for _ in range(count):
        away = np.abs(rest - 1.0)
        at = np.argmin(away, axis=-1)[..., None]
        own = np.take_along_axis(rest, at, axis=-1)
        np.put_along_axis(rest, at, np.where(np.abs(own - 1.0) < AT_ONE, 0.0, own), axis=-1)
    return rest


def _unheld(loop: Loop) -> int:
    plant, local = loop.plant, loop.controller.local_loop
    if plant.is_loaded or (local is not None and local.stiffness):
        return 0
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    free = shapes[:, squared == 0.0].T
    pushed, read = free @ plant.actuator, free @ plant.sensor
    if not abs(float(pushed @ read)) > MOVED * float(np.linalg.norm(pushed) * np.linalg.norm(read)):
        return 0
    if loop.closed is not None or loop.sections.sampled_form is not None:
        return 1
    # motions of different damping have a row each
    return max(1, int(np.count_nonzero(loop.sections.rows[:, 1] == 0.0)))


def _directions_unheld(loop: MultiLoop) -> int:
    plant = loop.plant
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    free = shapes[:, squared == 0.0]
    pushed, read = plant.actuators @ free, plant.sensors @ free
    size = float(np.linalg.norm(pushed) * np.linalg.norm(read))
    if not size > 0.0:
        return 0
    return int(np.sum(np.linalg.svd(read @ pushed.T, compute_uv=False) > MOVED * size))
