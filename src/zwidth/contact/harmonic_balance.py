"""Limit cycles of the sampled loop by harmonic balance: which vibrations are sustained, and which are stable?

Dry friction, encoder steps and saturation are replaced by their effect on a sine of amplitude A
(`contact.describing_functions`). Where the linear loop so made (`contact.quasi_linear`) has its root on the unit
circle, a vibration of that amplitude neither grows nor dies. It is stable, and so seen, where smaller ones grow
and larger ones die; an unstable one is the edge of what the loop recovers from.

This is an approximation, of vibrations that are nearly sinusoidal and not locked to the samples. What it is worth
is measured in docs/limit-cycles.md.

A limit cycle of a limited force with its harmonics: a single sine is inaccurate deep in saturation.

The limit acts on the samples of the commanded force, so that with theta = omega T j + a phase

    w(theta) = sum over odd n of Re(W_n exp(i n theta)),     W_n = G(exp(i n omega T)) U_n

where U_n are the harmonics of the limited w(theta) and G is the loop cut at the limit, from the force that acts to
the commanded one. One equation for each harmonic, solved by Newton's method from the first one, which is the
describing function's answer. With all harmonics this is exact for vibrations that are not locked to the samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import pi

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Floats
from zwidth.contact.loop_simulation import LARGEST_MOTION
from zwidth.contact.quasi_linear import (
    EquivalentLoop,
    SizeFunction,
    Vibration,
    amplitude_of,
    equivalent_loop,
    friction_velocity_of,
)
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import check_kind
from zwidth.model.plant import Counter, Friction, Nonlinear
from zwidth.progress import Progress
from zwidth.result import Documented, documented, entry

STAGE = "vibrations by amplitude"
PER_DECADE = 24
STEPS_RESOLVED = 12  # encoder steps up to which each hump of the quantiser's gain gets points of its own
# The amplitudes looked at, in units of the smallest and largest of the loop's own; between counts an encoder is
# a relay, which sees the smallest motions.
BELOW, BELOW_RELAY, ABOVE = 1e-3, 1e-6, 1e4
ON_CIRCLE = 1e-7
ROUGHLY = 1e-6  # agreement of shape and gains while only signs of growth are looked for
SEEDED, ANGLES = 12, (0.05, 0.3, 0.9)  # every so many amplitudes vibrations are looked for anew, at parts of pi
FOLDED = 40  # steps by a fifth in velocity


@dataclass(frozen=True)
class LimitCycle(Documented):
    """A limit cycle: a vibration whose amplitude stays the same.

    amplitude            of the sensor's motion, before rounding [m]
    frequency_Hz         of the vibration
    stable               whether smaller vibrations grow into it, and larger ones shrink
    force_amplitude      of the commanded force before saturation [N]
    velocity_amplitudes  (f,)  at each dry friction [m/s]
    largest_motion       as far as the device can move to either side [m]
    """

    amplitude: float = field(metadata=entry("m"))
    frequency_Hz: float = field(metadata=entry("Hz", name="frequency"))
    stable: bool = field(metadata=entry())
    force_amplitude: float = field(metadata=entry("N", name="force"))
    velocity_amplitudes: Floats
    largest_motion: float = LARGEST_MOTION

    @property
    @documented(before="force_amplitude")
    def within_range(self) -> bool:
        """Whether the device can move so far; a cycle beyond its range cannot happen."""
        return self.amplitude <= self.largest_motion

    @property
    @documented("m/s", name="velocity")
    def speed(self) -> float:
        """Velocity amplitude at the sensor, of the sine [m/s]."""
        return 2.0 * pi * self.frequency_Hz * self.amplitude


@dataclass(frozen=True)
class HarmonicBalance(Documented):
    """Growth of vibrations over their amplitude.

    amplitude     (p,)  of the sensor's motion [m], ascending
    growth        (p,)  rate at which the fastest growing vibration of that amplitude grows [1/s]; -inf where
                        nothing swings
    frequency_Hz  (p,)  its frequency; nan where nothing swings
    cycles        limit cycles by amplitude
    largest_motion  as far as the device can move to either side [m]; larger vibrations are those of no device
    """

    amplitude: Floats = field(metadata=entry("m"))
    growth: Floats = field(metadata=entry(name="growth_per_s"))
    frequency_Hz: Floats = field(metadata=entry("Hz", name="frequency"))
    cycles: tuple[LimitCycle, ...]
    largest_motion: float = LARGEST_MOTION

    @property
    def leaves_range(self) -> bool:
        """Whether the largest vibrations within the range grow, so that nothing in the model limits them."""
        within = self.growth[self.amplitude <= self.largest_motion]
        return bool(len(within) and within[-1] > 0.0)


def limit_cycles(
    loop: Loop,
    wall_stiffness: float,
    wall_damping: float,
    *,
    coulomb_friction: ArrayLike | None = None,
    resolution: float | None = None,
    force_limit: float | None = None,
    offset: float = 0.0,
    largest_motion: float = LARGEST_MOTION,
) -> list[LimitCycle]:
    """Limit cycles on a two-sided wall, by amplitude; see `harmonic_balance` for the arguments.

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> free_mass = Plant(0.1 * one[:, None], 0.1 * one[:, None], np.zeros((1, 1)), one, one)
    >>> loop = Loop(free_mass, Controller(0.001))
    >>> limit_cycles(loop, 150.0, 0.0)
    []
    >>> [grows] = limit_cycles(loop, 400.0, 0.0, coulomb_friction=0.01)
    >>> f"{grows.amplitude * 1e3:.2f} mm at {grows.frequency_Hz:.2f} Hz, stable: {grows.stable}"
    '2.02 mm at 10.06 Hz, stable: False'
    """
    check_kind("loop", loop, Loop)
    balance = harmonic_balance(
        loop,
        wall_stiffness,
        wall_damping,
        coulomb_friction=coulomb_friction,
        resolution=resolution,
        force_limit=force_limit,
        offset=offset,
        largest_motion=largest_motion,
    )
    return list(balance.cycles)


def harmonic_balance(
    loop: Loop,
    wall_stiffness: float,
    wall_damping: float,
    *,
    coulomb_friction: ArrayLike | None = None,
    resolution: float | None = None,
    force_limit: float | None = None,
    offset: float = 0.0,
    amplitudes: tuple[float, float] | None = None,
    largest_motion: float = LARGEST_MOTION,
    progress: Progress | None = None,
) -> HarmonicBalance:
    """Growth of vibrations over their amplitude, and where it changes sign: the limit cycles.

    What is not linear is that of the loop's plant and controller; three arguments replace parts of it. Dahl's and
    LuGre's frictions count as Coulomb's, brakes are left out.

    wall_stiffness, wall_damping  K [N/m] and B [N s/m]
    coulomb_friction  C [N], along the sensor's motion, or (n,), of each coordinate; None: the plant's frictions
    resolution        step of the sensor's reading [m]; None: the plant's encoders
    force_limit        largest force [N]; None: the smaller of the controller's and the actuator's limits
    offset            middle of the vibration as a share of each encoder's step: 0 on a count, 0.5 between two, the
                      worst that a constant push can do
    amplitudes        lowest and highest to look at [m]; None: well beyond what the nonlinear parts suggest
    largest_motion    as far as the device can move to either side [m], by `model.posture.handle_range` for one; it
                      bounds what holds of the answer, and not what is looked at
    progress          called with a stage's name, steps done, steps of all
    Raises            ValueError   for a wall that is not finite, negative friction or resolution, a saturation
                                   or a largest motion that is not positive, an empty range of amplitudes
    """
    parts, limit = _parts(loop, coulomb_friction, resolution, force_limit)
    if not (np.isfinite(wall_stiffness) and np.isfinite(wall_damping)):
        raise ValueError(f"the wall must be finite, got K = {wall_stiffness} N/m, B = {wall_damping} N s/m")
    if not largest_motion > 0.0:
        raise ValueError(f"largest_motion must be positive, got {largest_motion} m")
    equivalent = equivalent_loop(loop, wall_stiffness, wall_damping, parts, force_limit=limit, offset=offset)
    left = equivalent.parts
    if not (left.friction or left.counters or left.springs or np.isfinite(limit)):
        return _empty_balance(largest_motion)
    at = _amplitudes(equivalent, amplitudes)
    if not len(at):
        return _empty_balance(largest_motion)
    tell, steps = progress or (lambda stage, done, of: None), 2 * len(at) + 1
    swings = _fastest_by_amplitude(equivalent, at, lambda done: tell(STAGE, done, steps))
    balance = HarmonicBalance(
        at,
        np.array([_growth(equivalent, swing) for swing in swings]),
        np.array([_frequency(equivalent, swing) if swing else np.nan for swing in swings]),
        tuple(replace(cycle, largest_motion=largest_motion) for cycle in _crossings(equivalent, at, swings)),
        largest_motion,
    )
    tell(STAGE, steps, steps)
    return balance


def _empty_balance(largest_motion: float) -> HarmonicBalance:
    """Empty balance, of a loop in which nothing depends on the amplitude."""
    return HarmonicBalance(np.zeros(0), np.zeros(0), np.zeros(0), (), largest_motion)


def _parts(
    loop: Loop, coulomb_friction: ArrayLike | None, resolution: float | None, force_limit: float | None
) -> tuple[Nonlinear, float]:
    """The plant's nonlinear parts, with friction and encoder steps given here, and the force limit [N].

    coulomb_friction, resolution, force_limit  [N], [m], [N], as in `harmonic_balance`; None: the loop's own
    Raises  ValueError  for one of them that is negative, a limit of 0, or frictions of a wrong shape
    """
    plant, parts = loop.plant, loop.plant.nonlinear
    if coulomb_friction is not None:
        C = np.asarray(coulomb_friction, dtype=float)
        if C.ndim and C.shape != (plant.size,):
            raise ValueError(f"coulomb_friction must be one number or {plant.size}, one per coordinate, got {C}")
        if not np.all(C >= 0.0):
            raise ValueError(f"coulomb_friction must not be negative, got {coulomb_friction} N")
        rows = np.eye(plant.size) if C.ndim else plant.sensor[None]
        friction = tuple(Friction(row, float(c)) for row, c in zip(rows, np.atleast_1d(C), strict=True))
        parts = replace(parts, friction=friction)
    if resolution is not None:
        if not resolution >= 0.0:
            raise ValueError(f"resolution must not be negative, got {resolution} m")
        parts = replace(parts, counters=(Counter(plant.sensor, resolution),))
    limit = loop.nonlinear.force_limit if force_limit is None else force_limit
    if not limit > 0.0:
        raise ValueError(f"force_limit must be positive, got {limit} N; inf means none")
    return parts, limit


def _amplitudes(loop: EquivalentLoop, bounds: tuple[float, float] | None) -> Floats:
    """Amplitudes (p,) to look at [m]: even in the logarithm, and denser where the quantiser's gain has its humps.

    bounds  lowest and highest [m]; None: by what the nonlinear parts suggest, none where they suggest nothing
    Raises  ValueError  for bounds that are not positive and finite, the lower first
    """
    T, parts = loop.loop.period, loop.parts
    stiffness = abs(loop.wall_stiffness) + abs(loop.wall_damping) / T
    steps = [abs(part.weight) * part.step for part in parts.counters if part.step > 0.0]
    # an encoder step, and amplitudes at which friction, limit and bent springs are as strong as the wall
    scales = list(steps)
    if stiffness > 0.0:
        scales += [part.coulomb / stiffness for part in parts.friction]
        scales += [loop.limit / stiffness] if np.isfinite(loop.limit) else []
    scales += [np.sqrt(stiffness / abs(part.cubic)) for part in parts.springs if part.cubic and stiffness]
    if not scales and bounds is None:
        return np.zeros(0)
    middle = abs(loop.offset - round(loop.offset))  # distance from the nearest count, in steps
    below = BELOW_RELAY if steps and middle > 0.0 else BELOW
    low, high = bounds if bounds else (below * min(scales), ABOVE * max(scales))
    if not 0.0 < low < high < np.inf:
        raise ValueError(f"amplitudes must be two positive numbers, the lower first, got {low}, {high} m")
    grid = np.geomspace(low, high, max(2, int(PER_DECADE * np.log10(high / low)) + 1))
    for step in steps:
        for k in range(STEPS_RESOLVED):
            # amplitudes at which the sine reaches another threshold to either side, and the gain jumps
            for edge in (k + 0.5 - middle, k + 0.5 + middle):
                # in steps above the edge: close to it, where the gain is steep, then evenly to the next
                inside = np.concatenate([[1e-9, 1e-4, 1e-2], np.linspace(0.04, 0.98, 12)])
                grid = np.append(grid, step * (edge + inside))
    grid = np.unique(grid)
    return grid[(grid >= low) & (grid <= high)]


def _fastest_by_amplitude(
    loop: EquivalentLoop, amplitudes: Floats, tell: Callable[[int], None]
) -> list[Vibration | None]:
    """The fastest growing vibration at each amplitude (p,) [m], followed down and up; None where nothing swings.

    More than one kind of vibration may agree with the gains that it makes itself, so both ways count, and on the
    way up every SEEDED amplitudes others are looked for.

    tell  called with how many amplitudes are done, of both ways
    """
    last = loop.first_guess(float(amplitudes[-1]))
    down: list[Vibration | None] = []
    for k, amplitude in enumerate(amplitudes[::-1]):
        tell(k)
        down.append(loop.fastest_vibration(float(amplitude), last, same=ROUGHLY))
        last = down[-1] or last
    swings: list[Vibration | None] = []
    for k, (amplitude, other) in enumerate(zip(amplitudes, down[::-1], strict=True)):
        tell(len(amplitudes) + k)
        # from the vibration that was found on the way down there is nothing else to find
        starts = [] if other is not None and abs(other.root - last.root) < ROUGHLY else [last]
        if k % SEEDED == 0:
            starts += [loop.seed(float(amplitude), angle * np.pi) for angle in ANGLES]
        for start in starts:
            other = _faster(other, loop.fastest_vibration(float(amplitude), start, same=ROUGHLY))
        swings.append(other)
        last = other or last
    return swings


def _faster(one: Vibration | None, other: Vibration | None) -> Vibration | None:
    """The one of two vibrations that grows faster; None where neither is one."""
    known = [swing for swing in (one, other) if swing is not None]
    return max(known, key=lambda swing: abs(swing.root), default=None)


def _growth(loop: EquivalentLoop, swing: Vibration | None) -> float:
    """Rate at which a vibration grows [1/s]; -inf for None."""
    return float(np.log(abs(swing.root)) / loop.loop.period) if swing else -np.inf


def _frequency(loop: EquivalentLoop, swing: Vibration) -> float:
    """Frequency of a vibration [Hz]."""
    return float(np.angle(swing.root) / (2.0 * np.pi * loop.loop.period))


def _crossings(loop: EquivalentLoop, at: Floats, swings: list[Vibration | None]) -> list[LimitCycle]:
    """Limit cycles where growth changes sign between amplitudes `at` (p,) [m], stable where larger ones die.

    swings  vibration at each; None: nothing swings, which counts as dying
    Returns by amplitude; none where the growth jumps from one sign to the other
    """
    crossings = []
    for smaller, larger in pairwise(swings):
        if larger is None or (smaller is None and abs(larger.root) <= 1.0):
            continue
        if smaller is not None and (abs(smaller.root) > 1.0) == (abs(larger.root) > 1.0):
            continue
        cycle = _bisect(loop, smaller, larger, amplitude_of) if smaller is not None else None
        if cycle is None and abs(larger.root) > 1.0 and loop.parts.friction:
            cycle = _cycle_below_fold(loop, larger)
        if cycle is not None:
            stable = smaller is not None and abs(smaller.root) > 1.0
            crossings.append(
                LimitCycle(cycle.amplitude, _frequency(loop, cycle), stable, cycle.force, cycle.velocities)
            )
    return sorted(crossings, key=lambda cycle: cycle.amplitude)


def _bisect(loop: EquivalentLoop, low: Vibration, high: Vibration, measure: SizeFunction) -> Vibration | None:
    """The vibration of growth 0 between one that dies and one that grows; None where growth jumps over it.

    low, high  the two, by size;   measure  their size
    """
    from scipy.optimize import brentq

    known = [low, high]

    def fastest(logarithm: float) -> Vibration | None:
        """Fastest growing vibration of a size, given by its logarithm; None where nothing swings."""
        size = float(np.exp(logarithm))
        below = max((swing for swing in known if measure(swing) <= size), key=measure, default=low)
        above = min((swing for swing in known if measure(swing) > size), key=measure, default=high)
        vibration = _faster(
            loop.fastest_vibration(size, below, measure), loop.fastest_vibration(size, above, measure)
        )
        known.extend([vibration] if vibration else [])
        return vibration

    ends = np.log([measure(low), measure(high)])
    # at its ends a search started from both could find another kind of vibration, and growth would keep its sign
    at_ends = {float(end): float(np.log(abs(swing.root))) for end, swing in zip(ends, known, strict=True)}

    def growth(logarithm: float) -> float:
        """Growth per sample, ln |z|, of the vibration of a size given by its logarithm; -1 where none swings."""
        if logarithm in at_ends:
            return at_ends[logarithm]
        vibration = fastest(logarithm)
        return float(np.log(abs(vibration.root))) if vibration else -1.0

    where = brentq(growth, *ends, xtol=1e-13, rtol=1e-13)
    vibration = fastest(where)
    return vibration if vibration is not None and abs(abs(vibration.root) - 1.0) < ON_CIRCLE else None


def _cycle_below_fold(loop: EquivalentLoop, start: Vibration) -> Vibration | None:
    """The limit cycle below a vibration that grows, where dry friction lets no smaller amplitude at the sensor be.

    The more a vibration shrinks the more friction holds it, until less velocity goes with more amplitude; there
    the velocity says how large it is.

    Returns  None where nothing swings on the way, or everything still grows after FOLDED steps
    """
    high = start
    for _ in range(FOLDED):
        low = loop.fastest_vibration(friction_velocity_of(high) * 0.8, high, friction_velocity_of)
        if low is None:
            return None
        if abs(low.root) <= 1.0:
            return _bisect(loop, low, high, friction_velocity_of)
        high = low
    return None


COUNTS = (1, 2, 4, 8, 16)  # of odd harmonics, each solution the start of the next
PHASES = 512
SOLVED = 1e-8  # what is left of the equations, relative to the first harmonic
FAR = 4.0  # times: a step to another cycle is none


def with_harmonics(
    loop: Loop, wall_stiffness: float, wall_damping: float, cycle: LimitCycle, force_limit: float | None = None
) -> LimitCycle:
    """Refine a limit cycle with up to 16 odd harmonics: amplitude and force are then half of peak to peak.

    Only the limit of the force is taken for nonlinear. Where Newton's method fails, the cycle of as many harmonics
    as it could solve for is returned; the given one where it fails for the first already.

    wall_stiffness, wall_damping  as in `harmonic_balance`
    cycle       by `limit_cycles` of a loop without dry friction, counters and bent springs that act
    force_limit  largest force [N]; None: the smaller of the controller's and the actuator's limits
    Raises      ValueError   where nothing limits the force

    >>> from zwidth.contact.harmonic_balance import limit_cycles
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> plant = Plant(0.1 * one[:, None], 0.1 * one[:, None], np.zeros((1, 1)), one, one)
    >>> loop = Loop(plant, Controller(0.001))
    >>> [first] = limit_cycles(loop, 400.0, 0.05, force_limit=1.0)
    >>> full = with_harmonics(loop, 400.0, 0.05, first, force_limit=1.0)
    >>> round(full.amplitude / first.amplitude, 3), round(full.frequency_Hz / first.frequency_Hz, 3)
    (1.04, 0.975)
    """
    limit = loop.nonlinear.force_limit if force_limit is None else force_limit
    if not 0.0 < limit < np.inf:
        raise ValueError(f"harmonics are those of a limited force, and its limit is {limit} N")
    # forces in units of the limit: positions come out in metres per such unit
    transition, gain, command = equivalent_loop(loop, wall_stiffness, wall_damping, Nonlinear()).open_at_limit()
    sensor = np.zeros(len(gain))
    sensor[: loop.plant.size] = loop.plant.sensor
    cut = _OpenLoop(transition, gain, np.stack([command, sensor]))
    T, refined = loop.period, cycle
    start = np.array([np.log(cycle.force_amplitude / limit), np.log(2.0 * np.pi * cycle.frequency_Hz * T)])
    for count in COUNTS:
        solution = cut.solve(_longer(start, count), count)
        if solution is None or np.max(np.abs(solution[:2] - start[:2])) > np.log(FAR):
            break
        start = solution
        force, position, angle = cut.vibration(solution, count)
        refined = replace(
            cycle,
            amplitude=position * limit,
            force_amplitude=force * limit,
            frequency_Hz=angle / (2.0 * np.pi * T),
        )
    return refined


def _longer(start: Floats, count: int) -> Floats:
    """A solution (2 count,) with more harmonics, which are 0, from one with fewer.

    Its elements: logarithm of the first harmonic, in units of the limit, and of the angle per sample [rad]; then
    real and imaginary parts of the other harmonics over the first one.
    """
    known = len(start) // 2  # harmonics
    more = np.zeros(count - known)
    return np.concatenate([start[: known + 1], more, start[known + 1 :], more])


class _OpenLoop:
    """The loop cut at its limit, forces in units of it."""

    def __init__(self, transition: Floats, force: Floats, rows: Floats) -> None:
        """Keep transition (M, M), what a force adds (M,), and rows (2, M) that read force and position."""
        self.transition, self.force, self.rows = transition, force, rows
        self.phases = 2.0 * np.pi * np.arange(PHASES) / PHASES

    def solve(self, start: Floats, count: int) -> Floats | None:
        """Solution (2 count,) with so many harmonics (see `_longer`), by Newton's method; None where it fails."""
        from scipy.optimize import root

        def residuals(unknown: Floats) -> Floats:
            """Residuals over the size of the first harmonic: real parts (count,), then imaginary ones."""
            W, angle = _harmonic_parts(unknown, count)
            residual = (self._loop_response(angle, count)[0] * self._limited(W) - W) / abs(W[0])
            return np.concatenate([residual.real, residual.imag])

        with np.errstate(all="ignore"):
            solution = root(residuals, start, tol=1e-12)
            good = np.all(np.isfinite(solution.x)) and np.max(np.abs(residuals(solution.x))) < SOLVED
        return np.asarray(solution.x) if good else None

    def vibration(self, solution: Floats, count: int) -> tuple[float, float, float]:
        """Half of peak to peak of the commanded force and of the sensor's position, both over the limit, and the
        angle per sample [rad]."""
        W, angle = _harmonic_parts(solution, count)
        position = self._loop_response(angle, count)[1] * self._limited(W)
        force, place = (0.5 * float(np.ptp(self._over_phases(part))) for part in (W, position))
        return force, place, angle

    def _loop_response(self, angle: float, count: int) -> Complexes:
        """Responses (2, count), of commanded force and sensor's motion, to the acting force at odd harmonics.

        angle  of the first harmonic, per sample [rad]
        """
        size, orders = len(self.transition), np.arange(1, 2 * count, 2)
        z = np.exp(1j * angle * orders)[:, None, None]
        inner = np.linalg.solve(z * np.eye(size) - self.transition, self.force[:, None].astype(complex))[..., 0]
        return np.asarray(self.rows @ inner.T)

    def _over_phases(self, W: Complexes) -> Floats:
        """Signal over one period (PHASES,) from its odd harmonics W (h,)."""
        orders = np.arange(1, 2 * len(W), 2)
        return np.asarray((W @ np.exp(1j * np.outer(orders, self.phases))).real)

    def _limited(self, W: Complexes) -> Complexes:
        """Harmonics (h,) of what the limit lets pass of a force with harmonics W (h,), in units of the limit."""
        passed = np.clip(self._over_phases(W), -1.0, 1.0)
        orders = np.arange(1, 2 * len(W), 2)
        return np.asarray(2.0 / PHASES * np.exp(-1j * np.outer(orders, self.phases)) @ passed)


def _harmonic_parts(unknown: Floats, count: int) -> tuple[Complexes, float]:
    """The harmonics (count,), the first one real, and the angle per sample [rad], of a solution."""
    first = np.exp(unknown[0])
    others = unknown[2 : count + 1] + 1j * unknown[count + 1 :]
    return first * np.concatenate([[1.0 + 0.0j], others]), float(np.exp(unknown[1]))
