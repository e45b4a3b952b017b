"""The catalogue's measures of what the hand feels, at operating points: see `measures.handle_impedance`.

Stability is that of the device with its operator; the felt impedance is that of the device without.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart import largest_stiffness
from zwidth.chart.chart_batch import STIFFEST
from zwidth.chart.edge_memory import DOUBTFUL, FOUND, NO_WALL
from zwidth.chart.point_numbers import numbers_of_points
from zwidth.chart.point_radii import radii_at_points
from zwidth.chart.table_radii import slowest_roots
from zwidth.chart.verdict import NAMES, NEAR, STABLE, UNSTABLE, eigenvalues, judge
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.unsupported_feedback import FeedbackError
from zwidth.measures import handle_impedance
from zwidth.measures import rate_hardness as hardness
from zwidth.measures.band import frequencies_in_band, least_in_band
from zwidth.measures.bindings.preconditions import numbers_of, plant_with_handle
from zwidth.measures.definition import OK, MeasureError, MeasureValues, NoValueError, WantedWall, WantedWalls
from zwidth.measures.evaluate import complete_charts, complete_pointwise
from zwidth.measures.handle_motion import HandleMotion
from zwidth.model.plant_modes import plant_modes

Index = tuple[int, ...]

HAND: Final = "a frequency at which the hand moves"
HIGHEST: Final = 0.4999  # of the sampling frequency, up to which an impedance is taken
TIED: Final = "a spring ties the device to the ground, so that it does not move freely before the contact"
ROOTS: Final = 4  # of the loop on its wall, the slowest, at whose resonances the impedance is looked at
NO_WALL_DECAYS: Final = "no wall with K > 0 and B >= 0 has a spectral radius below the wanted one"


def felt_stiffness(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Real part of force per displacement at the handle, at the wanted wall and frequency [N/m]."""
    K, B = numbers_of(wanted, point.shape, "a wanted wall", "stiffness", "damping")
    (frequency,) = numbers_of(wanted, point.shape, HAND, "frequency")
    refuse = _check_frequencies(point, frequency)

    def alone(at: Index) -> float:
        refuse(at)
        loop, verdicts = _free_loop(point[at]), judge(point[at].loop, [K[at]], [B[at]])
        if verdicts.verdict[0] != STABLE:
            raise NoValueError(_not_felt(int(verdicts.verdict[0])))
        f = float(frequency[at])
        Z = handle_impedance.felt_impedance(loop, float(K[at]), float(B[at]), f)
        return float((2j * np.pi * f * Z).real)

    motion = HandleMotion.of(point)
    if motion is None:
        return complete_pointwise(np.full(point.shape, np.nan), alone, point)
    radii = radii_at_points(point, K, B).ravel()
    below = frequency.ravel() < 0.5 / motion.period
    rows = np.flatnonzero(motion.known & (radii < 1.0 - NEAR) & below & (point.status.ravel() == OK))
    _, x = motion.compliances(rows, frequency.ravel()[rows][:, None], K.ravel()[rows], B.ravel()[rows])
    values, states = np.full(radii.size, np.nan), np.full(radii.size, DOUBTFUL, dtype=np.uint8)
    values[rows], states[rows] = (1.0 / x[:, 0]).real, FOUND
    states[motion.known & (radii > 1.0 + NEAR) & below] = NO_WALL
    return complete_charts(point, values, states, alone, _not_felt(UNSTABLE))


def rate_hardness(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Steepest mean rate of the force felt on contact with the wanted wall, over the velocity [N/m]."""
    K, B = numbers_of(wanted, point.shape, "a wanted wall", "stiffness", "damping")

    def alone(at: Index) -> float:
        loop, verdicts = _free_loop(point[at]), judge(point[at].loop, [K[at]], [B[at]])
        if verdicts.verdict[0] != STABLE:
            raise NoValueError(_not_felt(int(verdicts.verdict[0])))
        if loop.has_fixed_feedback:
            raise NoValueError("is not known with feedback beside the wall law")
        modes, computer = plant_modes(loop.plant, (1,)), loop.controller
        if not np.isfinite(modes.input).all():
            raise NoValueError("is not known with electrical damping or a loss factor")
        timing = np.array([[computer.delay], [computer.actuator_time_constant]], dtype=np.float64)
        wall = np.array([[K[at]], [B[at]]])
        value = hardness.rate_hardness(loop.table, modes, np.zeros(1, dtype=np.int64), *timing, *wall)
        if np.isnan(value[0]):
            raise NoValueError(TIED)
        return float(value[0])

    motion = HandleMotion.of(point)
    if motion is None:
        return complete_pointwise(np.full(point.shape, np.nan), alone, point)
    radii = radii_at_points(point, K, B).ravel()
    rows = np.flatnonzero(motion.known & (radii < 1.0 - NEAR) & (point.status.ravel() == OK))
    values, states = np.full(radii.size, np.nan), np.full(radii.size, DOUBTFUL, dtype=np.uint8)
    values[rows] = hardness.rate_hardness(
        motion.table, motion.modes, rows, motion.delay, motion.lag, K.ravel()[rows], B.ravel()[rows]
    )
    states[np.isfinite(values)] = FOUND
    states[motion.known & (radii > 1.0 + NEAR)] = NO_WALL
    return complete_charts(point, values, states, alone, _not_felt(UNSTABLE))


def free_motion_force(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Size of force per velocity at the handle without any wall, at the wanted frequency [N s/m]."""
    (frequency,) = numbers_of(wanted, point.shape, HAND, "frequency")

    def alone(at: Index) -> float:
        return float(np.abs(handle_impedance.free_impedance(_free_loop(point[at]), frequency[at])))

    known, motion = np.full(point.shape, np.nan), HandleMotion.of(point)
    if motion is not None:
        rows = np.flatnonzero(motion.known & (point.status.ravel() == OK))
        f = frequency.ravel()[rows][:, None]
        G, _ = motion.compliances(rows, f, np.zeros(len(rows)), np.zeros(len(rows)))
        known.ravel()[rows] = np.abs(1.0 / (2j * np.pi * f * G))[:, 0]
    return complete_pointwise(known, alone, point)


def impedance_ratio(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Least ratio over a band of the impedance felt at the stiffest wall of a wanted spectral radius to that felt
    in free motion."""
    what = "a band of frequencies and the spectral radius that the wall must not exceed"
    names = "lowest_frequency", "highest_frequency", "spectral_radius"
    low, high, radius = numbers_of(wanted, point.shape, what, *names)
    _check_band(point, low, high)

    def alone(at: Index) -> float:
        loop, peak = _free_loop(point[at]), largest_stiffness(point[at].loop, float(radius[at]))
        if peak is None:
            raise NoValueError(NO_WALL_DECAYS)
        band = float(low[at]), _below_half(float(high[at]), float(loop.period))
        return _ratio_alone(loop, peak.stiffness, peak.damping, *band)

    motion, numbers = HandleMotion.of(point), numbers_of_points(point, STIFFEST, radius)
    if motion is None or numbers is None:
        return complete_pointwise(np.full(point.shape, np.nan), alone, point)
    states = np.where(motion.known | (numbers.status == NO_WALL), numbers.status, DOUBTFUL).astype(np.uint8)
    rows = np.flatnonzero((states == FOUND) & (point.status.ravel() == OK))
    K, B = numbers.stiffness[rows], numbers.damping[rows]
    top = np.minimum(high.ravel()[rows], HIGHEST / motion.period[rows])

    def ratio(frequency: Floats) -> Floats:
        free, held = motion.compliances(rows, frequency, K, B)
        return np.asarray(np.abs(free / held))

    values = np.full(states.size, np.nan)
    if len(rows):
        roots = slowest_roots(motion.table, rows, K, B, ROOTS)
        modes, period = motion.modes.rows(rows), motion.period[rows]
        tried = frequencies_in_band(low.ravel()[rows], top, modes, roots, period)
        values[rows] = least_in_band(ratio, tried)
    return complete_charts(point, values, states, alone, NO_WALL_DECAYS)


def _below_half(frequency: float, period: float) -> float:
    return min(frequency, HIGHEST / period)


def _ratio_alone(loop: Loop, K: float, B: float, low: float, high: float) -> float:
    """Of one loop, tried at many frequencies: its modes may have no real form."""
    roots = eigenvalues(loop, K, B).ravel()
    centres, wide = np.abs(np.angle(roots)), -np.log(np.clip(np.abs(roots), 1e-3, 1.0))
    beside = [centres + side * np.minimum(wide, 0.3 * centres) for side in (-2.0, -0.5, 0.0, 0.5, 2.0)]
    extra = np.clip(np.concatenate(beside) / (2.0 * np.pi * loop.period), low, high)
    frequency = np.sort(np.concatenate([np.geomspace(low, high, 2000), extra]))[None]

    def ratio(f: Floats) -> Floats:
        held, free = handle_impedance.felt_impedance(loop, K, B, f), handle_impedance.free_impedance(loop, f)
        return np.asarray(np.abs(held / free))

    return float(least_in_band(ratio, frequency)[0])


def _check_frequencies(point: OperatingPoint, frequency: Floats) -> Callable[[Index], None]:
    """A function that refuses a frequency at or above half the sampling frequency at an index.

    Raises  MeasureError  where that is so at all points
    """
    half = np.broadcast_to(0.5 / np.asarray(point.controller.sampling_period, dtype=np.float64), point.shape)

    def text(at: Index) -> str:
        return f"needs a frequency below half the sampling frequency, {half[at]:g} Hz, got {frequency[at]:g} Hz"

    if np.all(frequency >= half):
        raise MeasureError(text(tuple(0 for _ in point.shape)))

    def refuse(at: Index) -> None:
        if frequency[at] >= half[at]:
            raise NoValueError(text(at))

    return refuse


def _check_band(point: OperatingPoint, low: Floats, high: Floats) -> None:
    """Raises MeasureError for a band whose ends are in the wrong order, or that begins beyond half the sampling
    frequency."""
    half = HIGHEST / np.asarray(point.controller.sampling_period, dtype=np.float64)
    if np.any(high <= low):
        raise MeasureError(
            f"needs a highest_frequency above the lowest_frequency, got {float(np.min(high)):g} Hz and "
            f"{float(np.max(low)):g} Hz"
        )
    if np.any(low >= half):
        raise MeasureError(
            f"needs a lowest_frequency below half the sampling frequency, got {float(np.max(low)):g} Hz"
        )


def _not_felt(verdict: int) -> str:
    return f"the wanted wall is {NAMES[verdict]} here, so that there is no steady motion to feel"


def _free_loop(point: OperatingPoint) -> Loop:
    """The loop without operator. Raises MeasureError where it has no handle, or a local loop."""
    loop = Loop(plant_with_handle(point), point.computer)
    try:
        handle_impedance.refuse_local_loop(loop.controller)
    except FeedbackError as error:
        raise MeasureError(f"is not known here: {error}") from None
    return loop
