"""What the hand feels of many devices at once and at many frequencies (see `handle_impedance`).

With a wall C = K + B w(z) and the modes' responses between actuator a, sensor s and handle h, at s = jw,

    G_xy = sum_k x_k y_k / (s^2 + 2 a_k s + w_k^2)      x_h/f = G_hh - H C G_ha G_sh/(1 + P C)

which is `handle_impedance.felt_impedance` with the inverse of D + H C/(1 + S C) a s^T written out (Sherman and
Morrison). P and w are those of the loops' kernels.

Functions `..._at` are the catalogue's measures of an operating point. Stability is that of the device with its
operator; the felt impedance is that of the device without.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats, Ints
from zwidth.chart.chart import largest_stiffness
from zwidth.chart.chart_batch import STIFFEST
from zwidth.chart.edge_memory import DOUBTFUL, FOUND, NO_WALL
from zwidth.chart.point_chart import modes_of_points, numbers_of_points, table_of_points
from zwidth.chart.table_radii import radii_at_points, slowest_roots
from zwidth.chart.verdict import NAMES, NEAR, STABLE, UNSTABLE, eigenvalues, judge
from zwidth.compiled import compiled
from zwidth.errors import FeedbackError, MeasureError, NoValueError
from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import (
    COMPUTER,
    CircleFactors,
    LoopTable,
    factor_memory,
    fill_computer,
    fill_plant,
    force_filter,
    half_angle,
    minus_inverse_plant,
    velocity_on_circle,
)
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import OK, MeasureValues, WantedWall, WantedWalls
from zwidth.measures.evaluation import complete_charts, complete_pointwise
from zwidth.measures.handle_impedance import check_no_local_loop, felt_impedance, free_impedance
from zwidth.measures.preconditions import numbers_of, plant_with_handle
from zwidth.measures.rate_hardness import rate_hardness
from zwidth.model.plant_modes import plant_modes
from zwidth.model.rendered_modes import RenderedModes

AT_ONCE: Final = 2048  # devices whose responses are in memory at once


@dataclass(frozen=True)
class HandleMotion:
    """N devices whose handles are moved, without operator.

    table    their loops
    modes    their modes
    known    (N,)  which devices have a table and modes in this form; the others must be computed one by one
    period   (N,)  T [s]
    controller  of all of them, numbers of several designs (N,)
    """

    table: LoopTable
    modes: RenderedModes
    known: Flags
    period: Floats
    controller: Controller

    @classmethod
    def of(cls, point: OperatingPoint) -> HandleMotion | None:
        """The devices at all N points; None where each must be computed by itself."""
        free = point.without_operator
        if not point.shape or free.controller.fixed_feedback:
            return None
        flat = free.flat
        table, modes = table_of_points(flat), modes_of_points(flat)
        if table is None or modes is None:
            return None
        known = (table.section_count > 0) & np.isfinite(modes.handle).all(axis=1)
        known &= np.isfinite(modes.decay).all(axis=1) & np.isfinite(modes.input).all(axis=1)
        period = np.array(np.broadcast_to(np.ravel(flat.controller.sampling_period), known.shape), dtype=float)
        return cls(table, modes, known, period, flat.controller)

    def compliances(self, rows: Ints, frequency: Floats, K: Floats, B: Floats) -> tuple[Complexes, ...]:
        """Motion of the handle per force of the hand on it, without a wall and with one.

        rows       (n,)    which devices, of those known
        frequency  (n, f)  above 0 and below half the sampling frequency [Hz]
        K, B       (n,)    of the wall [N/m], [N s/m]
        Returns    (n, f) twice  without a wall, with it [m/N]
        """
        parts = [
            self._wall_loop_parts(rows[first : first + AT_ONCE], frequency[first : first + AT_ONCE])
            for first in range(0, max(len(rows), 1), AT_ONCE)
        ]
        G, through, P, w, H = (np.concatenate(each) for each in zip(*parts, strict=True))
        C = K[:, None] + B[:, None] * w
        return G, G - H * C * through / (1.0 + P * C)

    def _wall_loop_parts(self, rows: Ints, frequency: Floats) -> tuple[Complexes, ...]:
        """G_hh, G_ha G_sh, P, w and H (see above), each (n, f), of devices (n,) at frequencies (n, f) [Hz]."""
        T = self.period[rows][:, None]
        s: Complexes = np.asarray(2j * np.pi * frequency, dtype=np.complex128)
        G_hh, G_ha, G_sh = self._responses(rows, s)
        P, w = (np.empty(frequency.shape, dtype=complex) for _ in range(2))
        _sampled_responses(self.table, rows, 2.0 * np.pi * frequency * T, factor_memory(self.table), P, w)
        return G_hh, G_ha * G_sh, P, w, self._hold(rows, s)

    def _responses(self, rows: Ints, s: Complexes) -> tuple[Complexes, ...]:
        """Responses G_hh, G_ha and G_sh (n, f) [m/N] of devices (n,) at s = jw (n, f), by their modes."""
        modes = self.modes.rows(rows)
        h, a, y = modes.handle, modes.input, modes.output
        stiffness = (
            s[..., None] ** 2 + 2.0 * modes.decay[:, None] * s[..., None] + modes.frequency_squared[:, None]
        )
        # a mode that is filled up with 0, of a device that has fewer than others, adds 0
        G = [np.sum((one * other)[:, None] / stiffness, axis=-1) for one, other in ((h, h), (h, a), (y, h))]
        if modes.coupled is None or modes.drag is None or not modes.coupled.any():
            return tuple(G)
        # devices whose damping couples modes: with all of D, excited at the handle (column 0) and the actuator (1)
        some = np.flatnonzero(modes.coupled)
        m = h.shape[1]
        D = s[some][..., None, None] * modes.drag[some][:, None]
        D[..., range(m), range(m)] += s[some][..., None] ** 2 + modes.frequency_squared[some][:, None]
        right = np.stack([h[some], a[some]], axis=-1)[:, None].astype(complex)
        moved = np.linalg.solve(D, np.broadcast_to(right, (*D.shape[:-1], 2)))
        for response, left, column in zip(G, (h, h, y), (0, 1, 0), strict=True):
            response[some] = np.einsum("nk,nfk->nf", left[some], moved[..., column])
        return tuple(G)

    def _hold(self, rows: Ints, s: Complexes) -> Complexes:
        """Response H (n, f) of devices (n,) from commands to the part of the held force at s (n, f) itself."""
        T = self.period[rows][:, None]
        delay, lag = self.delay[rows][:, None], self.lag[rows][:, None]
        low_pass, d = force_filter(self.controller), np.expm1(s * T)
        filtered = np.ones_like(d)
        for k in range(low_pass.numerator.shape[-2]):
            top, bottom = (
                self._quadratic(each[..., k, :], rows, d) for each in (low_pass.numerator, low_pass.denominator)
            )
            filtered *= top / bottom
        stairs = -np.expm1(-s * T) / (s * T) * np.exp(-s * T * delay)
        return np.asarray(filtered * stairs / (1.0 + s * lag))

    @property
    def delay(self) -> Floats:
        """Delay of the force (N,) [samples]."""
        return self._of_each(self.controller.delay)

    @property
    def lag(self) -> Floats:
        """Time constant of the actuator (N,) [s]."""
        return self._of_each(self.controller.actuator_time_constant)

    def _of_each(self, number: float | Floats) -> Floats:
        """A number of all devices, or that of each, as an array (N,)."""
        return np.array(np.broadcast_to(np.ravel(np.asarray(number, dtype=np.float64)), self.period.shape))

    def _quadratic(self, c: Floats, rows: Ints, d: Complexes) -> Complexes:
        """c2 d^2 + c1 d + c0 for coefficients (3,) or those of each device (N, 3)."""
        c = c.reshape(-1, 3)
        c2, c1, c0 = (c[rows] if len(c) > 1 else c).T[..., None]
        return np.asarray((c2 * d + c1) * d + c0)


@compiled
def _sampled_responses(
    loops: LoopTable, rows: Ints, theta: Floats, circle: CircleFactors, P: Complexes, w: Complexes
) -> None:
    """Fill P and w (n, f) with the responses of sampled plants, delay and force path included, and of velocity
    estimates, at z = exp(i theta), theta (n, f) [rad].

    rows  (n,)  which loops;   circle  working memory
    """
    circle.sizes[COMPUTER] = -1
    for n in range(len(rows)):
        i = rows[n]
        if circle.sizes[COMPUTER] != loops.computer[i]:
            fill_computer(loops, loops.computer[i], 1.0, circle)
        fill_plant(loops, i, circle)
        for k in range(theta.shape[1]):
            # squares and product of cosine and sine of half the angle
            cc, ss, sc = half_angle(np.tan(0.5 * theta[n, k]))
            # numerators and denominators of -1/P and w
            X, _, N, _ = minus_inverse_plant(circle, cc, ss, sc)
            Y, _, Q, _ = velocity_on_circle(circle, cc, ss, sc)
            P[n, k] = -N / X
            w[n, k] = Y / Q


SPREAD: Final = 40  # frequencies spread over the band
HALVINGS: Final = 40
WITHIN: Final = 7  # frequencies between the neighbours of the least
ROUNDS: Final = 6  # how often these are tried, each time closer
DEEPEST: Final = 2  # lowest minima that are looked at so


def frequencies_in_band(
    low: Floats, high: Floats, modes: RenderedModes, roots: Complexes, period: Floats
) -> Floats:
    """Frequencies at which a response at the handle is looked at, ascending.

    Spread over the band; and where it changes fast, at the undamped resonances of the handle and at the
    antiresonances between them (the zeros of sum h_k^2/(w_k^2 - w^2), one between any two resonances), beside them
    by a half and by two half-widths, the largest decay of the modes. And at the roots z of the loop on its wall,
    of half-width -ln|z|/T. What lies outside the band is moved to its ends.

    low, high  (n,)    of the band [Hz]
    roots      (n, k)  z; 0 for none
    period     (n,)    T [s]
    Returns    (n, f)
    """
    share = np.linspace(0.0, 1.0, SPREAD)
    grid = low[:, None] * (high / low)[:, None] ** share
    w2 = np.sort(modes.frequency_squared, axis=1)
    order = np.argsort(modes.frequency_squared, axis=1, kind="stable")
    h2 = np.take_along_axis(modes.handle**2, order, axis=1)
    wide = np.max(np.abs(modes.decay), axis=1, keepdims=True)
    # resonances and antiresonances [rad/s], and with those of the loop all centres and their half widths
    places = np.concatenate([np.sqrt(np.maximum(w2, 0.0)), *_antiresonances(w2, h2)], axis=1)
    # 1e-3: whose logarithm is finite, for roots of 0
    size = np.clip(np.abs(roots), 1e-3, 1.0)
    centres = np.concatenate([places, np.abs(np.angle(roots)) / period[:, None]], axis=1)
    wide = np.concatenate([wide + 0.0 * places, -np.log(size) / period[:, None]], axis=1)
    # 0.3: two widths below a centre are still above 0
    beside = [centres + side * np.minimum(wide, 0.3 * centres) for side in (-2.0, -0.5, 0.0, 0.5, 2.0)]
    extra = np.concatenate(beside, axis=1) / (2.0 * np.pi)
    every = np.concatenate([grid, np.clip(extra, low[:, None], high[:, None])], axis=1)
    return np.sort(every, axis=1)


def _antiresonances(w2: Floats, h2: Floats) -> list[Floats]:
    """Antiresonances (n, 1) between neighbouring resonances [rad/s], by halving: the sum rises between them.

    w2, h2  (n, m)  squared resonances, ascending, and squared shares of the handle in these modes
    """
    found = []
    for k in range(w2.shape[1] - 1):
        low, high = w2[:, k].copy(), w2[:, k + 1].copy()
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            with np.errstate(divide="ignore", invalid="ignore"):
                value = np.sum(h2 / (w2 - middle[:, None]), axis=1)
            low, high = np.where(value < 0.0, middle, low), np.where(value < 0.0, high, middle)
        found.append(np.sqrt(np.maximum(0.5 * (low + high), 0.0))[:, None])
    return found


def least_in_band(response: Callable[[Floats], Floats], frequency: Floats) -> Floats:
    """Least value of a response over a band.

    Between the frequencies beside each of the lowest minima it is tried at more of them, closer each time.

    response   of frequencies (n, k) of any number k, returning (n, k)
    frequency  (n, f)  ascending; the first and the last are the ends of the band
    Returns    (n,)
    """
    values = response(frequency)
    least = values.min(axis=1)
    ends = np.full((len(values), 1), np.inf)
    before, after = np.hstack([ends, values[:, :-1]]), np.hstack([values[:, 1:], ends])
    # a minimum is no larger than its neighbours; the deepest DEEPEST of them are refined
    minima = np.where((values <= before) & (values <= after), values, np.inf)
    chosen = np.argsort(minima, axis=1, kind="stable")[:, :DEEPEST]
    last, row = frequency.shape[1] - 1, np.arange(len(values))
    for n in range(chosen.shape[1]):
        at = chosen[:, n]
        low, high = frequency[row, np.maximum(at - 1, 0)], frequency[row, np.minimum(at + 1, last)]
        for _ in range(ROUNDS):
            closer = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, WITHIN)
            found = response(closer)
            best = found.argmin(axis=1)
            least = np.minimum(least, found.min(axis=1))
            low, high = closer[row, np.maximum(best - 1, 0)], closer[row, np.minimum(best + 1, WITHIN - 1)]
    return np.asarray(least)


Index = tuple[int, ...]

HAND: Final = "a frequency at which the hand moves"
HIGHEST: Final = 0.4999  # of the sampling frequency, up to which an impedance is taken
TIED: Final = "a spring ties the device to the ground, so that it does not move freely before the contact"
ROOTS: Final = 4  # of the loop on its wall, the slowest, at whose resonances the impedance is looked at
NO_WALL_DECAYS: Final = "no wall with K > 0 and B >= 0 has a spectral radius below the wanted one"


def felt_stiffness_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Real part of force per displacement at the handle, at the wanted wall and frequency [N/m]."""
    K, B = numbers_of(wanted, point.shape, "a wanted wall", "stiffness", "damping")
    (frequency,) = numbers_of(wanted, point.shape, HAND, "frequency")
    refuse = _check_frequencies(point, frequency)

    def alone(at: Index) -> float:
        """Felt stiffness at the point of an index [N/m]. Raises NoValueError where the wall is not stable."""
        refuse(at)
        loop, verdicts = _free_loop(point[at]), judge(point[at].loop, [K[at]], [B[at]])
        if verdicts.verdict[0] != STABLE:
            raise NoValueError(_not_felt(int(verdicts.verdict[0])))
        f = float(frequency[at])
        Z = felt_impedance(loop, float(K[at]), float(B[at]), f)
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
    states[motion.known & (radii > 1.0 + NEAR) & below] = NO_WALL  # here: the wanted wall is unstable
    return complete_charts(point, values, states, alone, _not_felt(UNSTABLE))


def rate_hardness_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Steepest mean rate of the force felt on contact with the wanted wall, over the velocity [N/m]."""
    K, B = numbers_of(wanted, point.shape, "a wanted wall", "stiffness", "damping")

    def alone(at: Index) -> float:
        """Rate-hardness at the point of an index [N/m]. Raises NoValueError where it has none."""
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
        value = rate_hardness(loop.table, modes, np.zeros(1, dtype=np.int64), *timing, *wall)
        if np.isnan(value[0]):
            raise NoValueError(TIED)
        return float(value[0])

    motion = HandleMotion.of(point)
    if motion is None:
        return complete_pointwise(np.full(point.shape, np.nan), alone, point)
    radii = radii_at_points(point, K, B).ravel()
    rows = np.flatnonzero(motion.known & (radii < 1.0 - NEAR) & (point.status.ravel() == OK))
    values, states = np.full(radii.size, np.nan), np.full(radii.size, DOUBTFUL, dtype=np.uint8)
    values[rows] = rate_hardness(
        motion.table, motion.modes, rows, motion.delay, motion.lag, K.ravel()[rows], B.ravel()[rows]
    )
    states[np.isfinite(values)] = FOUND  # nan: `alone` says why
    states[motion.known & (radii > 1.0 + NEAR)] = NO_WALL  # here: the wanted wall is unstable
    return complete_charts(point, values, states, alone, _not_felt(UNSTABLE))


def free_motion_force_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Size of force per velocity at the handle without any wall, at the wanted frequency [N s/m]."""
    (frequency,) = numbers_of(wanted, point.shape, HAND, "frequency")

    def alone(at: Index) -> float:
        """Size of the free impedance at the point of an index [N s/m]."""
        return float(np.abs(free_impedance(_free_loop(point[at]), frequency[at])))

    known, motion = np.full(point.shape, np.nan), HandleMotion.of(point)
    if motion is not None:
        rows = np.flatnonzero(motion.known & (point.status.ravel() == OK))
        f = frequency.ravel()[rows][:, None]
        G, _ = motion.compliances(rows, f, np.zeros(len(rows)), np.zeros(len(rows)))
        known.ravel()[rows] = np.abs(1.0 / (2j * np.pi * f * G))[:, 0]
    return complete_pointwise(known, alone, point)


def impedance_ratio_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Least ratio over a band of the impedance felt at the stiffest wall of a wanted spectral radius to that felt
    in free motion; the band ends at HIGHEST of the sampling frequency at most."""
    what = "a band of frequencies and the spectral radius that the wall must not exceed"
    names = "lowest_frequency", "highest_frequency", "spectral_radius"
    low, high, radius = numbers_of(wanted, point.shape, what, *names)
    _check_band(point, low, high)

    def alone(at: Index) -> float:
        """Least impedance ratio at the point of an index. Raises NoValueError where no wall decays so fast."""
        loop, peak = _free_loop(point[at]), largest_stiffness(point[at].loop, float(radius[at]))
        if peak is None:
            raise NoValueError(NO_WALL_DECAYS)
        band = float(low[at]), _below_half(float(high[at]), float(loop.period))
        return _least_ratio_of_loop(loop, peak.stiffness, peak.damping, *band)

    motion, numbers = HandleMotion.of(point), numbers_of_points(point, STIFFEST, radius)
    if motion is None or numbers is None:
        return complete_pointwise(np.full(point.shape, np.nan), alone, point)
    # a wall that is found needs the handle's motion, too
    states = np.where(motion.known | (numbers.status == NO_WALL), numbers.status, DOUBTFUL).astype(np.uint8)
    rows = np.flatnonzero((states == FOUND) & (point.status.ravel() == OK))
    K, B = numbers.stiffness[rows], numbers.damping[rows]
    top = np.minimum(high.ravel()[rows], HIGHEST / motion.period[rows])

    def ratio(frequency: Floats) -> Floats:
        """Impedance felt at the wall over that in free motion (n, k), at frequencies (n, k) [Hz]."""
        free, held = motion.compliances(rows, frequency, K, B)  # motion per force: the ratio is the inverse
        return np.asarray(np.abs(free / held))

    values = np.full(states.size, np.nan)
    if len(rows):
        roots = slowest_roots(motion.table, rows, K, B, ROOTS)
        modes, period = motion.modes.rows(rows), motion.period[rows]
        tried = frequencies_in_band(low.ravel()[rows], top, modes, roots, period)
        values[rows] = least_in_band(ratio, tried)
    return complete_charts(point, values, states, alone, NO_WALL_DECAYS)


def _below_half(frequency: float, period: float) -> float:
    """A frequency, cut to the highest that is looked at below half the sampling frequency [Hz]."""
    return min(frequency, HIGHEST / period)


def _least_ratio_of_loop(loop: Loop, K: float, B: float, low: float, high: float) -> float:
    """Least impedance ratio of one loop on a wall K [N/m], B [N s/m] over a band [Hz], tried at many frequencies:
    its modes may have no real form."""
    roots = eigenvalues(loop, K, B).ravel()
    # resonances and their half widths per sample, as in `frequencies_in_band`
    centres, wide = np.abs(np.angle(roots)), -np.log(np.clip(np.abs(roots), 1e-3, 1.0))
    beside = [centres + side * np.minimum(wide, 0.3 * centres) for side in (-2.0, -0.5, 0.0, 0.5, 2.0)]
    extra = np.clip(np.concatenate(beside) / (2.0 * np.pi * loop.period), low, high)
    frequency = np.sort(np.concatenate([np.geomspace(low, high, 2000), extra]))[None]

    def ratio(f: Floats) -> Floats:
        """Impedance felt at the wall over that in free motion (1, k), at frequencies (1, k) [Hz]."""
        held, free = felt_impedance(loop, K, B, f), free_impedance(loop, f)
        return np.asarray(np.abs(held / free))

    return float(least_in_band(ratio, frequency)[0])


def _check_frequencies(point: OperatingPoint, frequency: Floats) -> Callable[[Index], None]:
    """A function of an index that raises NoValueError where the frequency (...) [Hz] there is too high.

    Too high is at or above half the sampling frequency.
    Raises  MeasureError  where that is so at all points
    """
    half = np.broadcast_to(0.5 / np.asarray(point.controller.sampling_period, dtype=np.float64), point.shape)

    def text(at: Index) -> str:
        """Message: the frequency at this index is too high."""
        return f"needs a frequency below half the sampling frequency, {half[at]:g} Hz, got {frequency[at]:g} Hz"

    if np.all(frequency >= half):
        raise MeasureError(text(tuple(0 for _ in point.shape)))

    def refuse(at: Index) -> None:
        """Raise NoValueError where the frequency at this index is too high."""
        if frequency[at] >= half[at]:
            raise NoValueError(text(at))

    return refuse


def _check_band(point: OperatingPoint, low: Floats, high: Floats) -> None:
    """Raise MeasureError for a band [Hz] whose ends are in the wrong order at any point, or that begins at HIGHEST
    of the sampling frequency or beyond."""
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
    """Reason why a wall of this verdict has no felt impedance."""
    return f"the wanted wall is {NAMES[verdict]} here, so that there is no steady motion to feel"


def _free_loop(point: OperatingPoint) -> Loop:
    """The loop without operator. Raises MeasureError where it has no handle, or a local loop."""
    loop = Loop(plant_with_handle(point), point.computer)
    try:
        check_no_local_loop(loop.controller)
    except FeedbackError as error:
        raise MeasureError(f"is not known here: {error}") from None
    return loop
