"""Hysteretic damping: the sampled response on the unit circle to rounding, the chart, and its edge for fits.

    P(e^{iwT}) = sum_k G(i w_k) H(i w_k) / T,    w_k = w + 2 pi k/T

    G(iw) = sensor . (K + i sign(w) L - w^2 M + i w B)^-1 actuator
    H(s) = e^{-f s T} (1 - e^{-sT}) / (s (tau s + 1))

with a delay of f samples and an actuator lag tau. The sum is taken as the exact response of a plant with viscous
damping instead, plus the difference of the two, which falls off like k^-4. Aliases whose frequencies lie near a
natural frequency are summed at each angle. The sum of all others is analytic in theta to two lengths beyond either
end of [0, pi], and so a polynomial in theta. G is taken in modal coordinates, where a rigid motion is exactly
free: in the plant's own, rounding of the stiffest spring would hold it.

The chart of a plant with hysteretic damping, K (1 + i eta): exact where the loop vibrates steadily.

A loss factor has no motion in time (it would begin before its cause), so there is no transition matrix. But the
boundary of the stable set needs only the steady response to the held force at one frequency, which
`chart.hysteretic_response` gives. It is sampled until what is interpolated between its angles is right too. From
there on it is treated as a measured response, and cells are counted by Nyquist's criterion.

As the loss tends to 0 the chart tends to that of the undamped plant, in proportion to it. How small it must be for
that is another matter: a wall that drives a mode by less than its loss brakes it is stable, and is not without the
loss, so that a mode that the wall hardly moves can limit the undamped chart alone.

The edge of a plant with a loss factor, where that of its viscous equivalent is known: for fits.

The chart with a loss factor takes seconds, most of them to count the cells. The viscous plant that loses as much
in each mode at its own frequency has nearly the same chart, with the same arcs at nearly the same angles; there
the walls of the hysteretic plant are computed exactly, from its sampled response. Arcs meet at other angles than
the viscous ones do: these are computed, too. Where that does not succeed the two edges are
not made of the same arcs, and the edge is that of the whole chart.

Where the arcs of an edge meet when its curve of walls is replaced by a slightly different one.

Two pieces of one curve meet where it passes itself, at the angles a and b of two pairs of roots with

    K(a) = K(b),   B(a) = B(b)

and a piece meets a line of real roots, K + B w = h at z = 1 or z = -1, where K(a) + B(a) w = h. Both are found by
Newton's method from the angles of the curve that was replaced.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import shapely
from numpy.polynomial import Chebyshev

from zwidth.arrays import Complexes, Flags, Floats, Ints
from zwidth.chart.arcs import MINUS, PAIR, PLUS, ArcPoints, Arcs
from zwidth.chart.chart import stability_chart
from zwidth.chart.edge_crossings import EdgeChords, EdgeCurve
from zwidth.chart.loop_edge import TracedEdge
from zwidth.chart.measured.chart import MeasuredChart, measured_chart
from zwidth.chart.measured.response_interpolation import interpolate_response
from zwidth.chart.nyquist import terms_along
from zwidth.chart.tracer import Tracer
from zwidth.errors import HysteresisError, ResponseError
from zwidth.loop.factor_response import factor_response
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import circle_factors, force_filter, table_of_loops
from zwidth.model.argument_checks import check_kind
from zwidth.model.modes import RIGID, undamped_modes
from zwidth.model.plant import Plant
from zwidth.model.response import Response, integrators_of

# Pairs of aliases summed, and how many for each that the highest natural frequency lies above: what is left out
# falls off with the third power.
FEWEST, PER_FOLD = 400, 20
# An alias is smooth if all natural frequencies are farther than this from the middle of its frequencies, in
# sampling rates: 2.5 pi are five half-lengths of [0, pi], by which Chebyshev's coefficients fall by 5 + sqrt 24
# each.
SMOOTH, DEGREE = 1.25, 18
UNIT = 1e-14  # a few roundings
CHUNK = 2000  # angles at a time, for memory's sake


def viscous_equivalent(plant: Plant) -> Plant:
    """The plant with dampers in place of its hysteresis, with the same loss in each mode at its own frequency.

    M V diag(l_i / |w_i|) V^T M, with mass-normalised modes V and l_i = v_i^T L v_i; rigid modes lose nothing.
    """
    assert plant.hysteresis is not None
    squared, V = undamped_modes(plant.mass, plant.stiffness)
    loss = np.einsum("ki,kl,li->i", V, plant.hysteresis, V)
    rate = np.sqrt(np.abs(squared))
    dampers = np.where(rate > 0.0, loss, 0.0) / np.where(rate > 0.0, rate, 1.0)
    shapes = plant.mass @ V
    return replace(plant, damping=plant.damping + (shapes * dampers) @ shapes.T, hysteresis=None)


@dataclass(frozen=True)
class ModalPlant:
    """A plant in the modal coordinates of its undamped self, for G(iw).

    squared                       (n,)    natural frequencies squared [1/s²]
    loss, damping                 (n, n)  V^T L V [1/s²] and V^T B V [1/s]
    dampers                       (k, n)  directions of the lagged dampers, each times the square root of its
                                  damping [s^-1/2]
    lags                          (k,)    their time constants [s]
    modal_actuator, modal_sensor  (n,)    V^T actuator and V^T sensor [kg^-1/2]
    """

    squared: Floats
    loss: Floats
    damping: Floats
    dampers: Floats
    lags: Floats
    modal_actuator: Floats
    modal_sensor: Floats

    @classmethod
    def of(cls, plant: Plant) -> ModalPlant:
        """The modal form of a plant, with hysteresis or without."""
        squared, V = undamped_modes(plant.mass, plant.stiffness)
        loss = np.zeros_like(plant.mass) if plant.hysteresis is None else V.T @ plant.hysteresis @ V
        loss[np.abs(loss) <= RIGID * np.max(np.abs(loss))] = 0.0  # what rounding leaves of lossless modes
        dampers = [np.sqrt(damper.damping) * (damper.along @ V) for damper in plant.lagged_dampers]
        lags = np.array([damper.time_constant for damper in plant.lagged_dampers])
        damping = V.T @ plant.damping @ V
        modal_actuator, modal_sensor = plant.actuator @ V, plant.sensor @ V
        directions = np.array(dampers).reshape(-1, len(V))
        return cls(squared, loss, damping, directions, lags, modal_actuator, modal_sensor)

    def response(self, w: Floats) -> Complexes:
        """G(iw) (...) from force to reading at angular frequencies w (...) [1/s], of either sign [m/N]."""
        return np.asarray(self.modes(w) @ self.modal_sensor)

    def modes(self, w: Floats) -> Complexes:
        """Amplitudes (..., n) of the modal coordinates for a force of 1 N at angular frequencies w (...) [1/s]."""
        w = w[..., None, None]
        dynamic = 1j * (np.sign(w) * self.loss + w * self.damping)
        for direction, lag in zip(self.dampers, self.lags, strict=True):
            dynamic = dynamic + 1j * w / (1.0 + 1j * w * lag) * np.outer(direction, direction)
        n = np.arange(len(self.squared))
        dynamic[..., n, n] += self.squared - w[..., 0] ** 2
        return np.asarray(np.linalg.solve(dynamic, self.modal_actuator[:, None])[..., 0])

    def natural_rates(self) -> Floats:
        """|Im s| [1/s] of the poles, at which the response to steady vibration turns sharply."""
        # states: the modes' amplitudes, their rates, and the dampers' lagged velocities times sqrt(damping)
        n, k = len(self.squared), len(self.lags)
        A = np.zeros((2 * n + k, 2 * n + k), dtype=complex)
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n] = -np.diag(self.squared) - 1j * self.loss
        A[n : 2 * n, n : 2 * n] = -self.damping
        A[n : 2 * n, 2 * n :] = -self.dampers.T
        A[2 * n :, n : 2 * n] = self.dampers / self.lags[:, None]
        A[2 * n :, 2 * n :] = -np.diag(1.0 / self.lags)
        return np.abs(np.linalg.eigvals(A).imag)


@dataclass(frozen=True)
class SampledResponse:
    """P(e^{i theta}) [m/N] of a loop whose plant has hysteresis.

    hysteretic, viscous  the plant with hysteresis, and with dampers instead (`viscous_equivalent`)
    reference            the loop with the latter, whose response is known in closed form
    near                 numbers k of the aliases that are summed at each angle
    far                  sum of all other aliases, by theta in [0, pi]
    """

    loop: Loop
    hysteretic: ModalPlant
    viscous: ModalPlant
    reference: Loop
    near: Ints
    far: Chebyshev

    @classmethod
    def of(cls, loop: Loop) -> SampledResponse:
        """The sampled response of a loop, its far aliases summed beforehand."""
        reference = replace(loop, plant=viscous_equivalent(loop.plant))
        hysteretic, viscous = ModalPlant.of(loop.plant), ModalPlant.of(reference.plant)
        rates = np.concatenate([hysteretic.natural_rates(), viscous.natural_rates(), [0.0]])  # and at rest
        folds = rates * loop.period / (2.0 * np.pi)  # natural frequencies in sampling rates
        most = FEWEST + int(PER_FOLD * np.max(folds))
        k = np.arange(-most, most + 1)
        # alias k has the frequencies from k to k + 1/2 sampling rates, as theta goes from 0 to pi
        near = np.any(np.abs(np.abs(k + 0.25)[:, None] - folds) < SMOOTH, axis=1)
        others = k[~near]
        far = Chebyshev.interpolate(
            lambda theta: _difference(loop, hysteretic, viscous, theta, others), DEGREE, domain=[0.0, np.pi]
        )
        return cls(loop, hysteretic, viscous, reference, k[near], far)

    def __call__(self, thetas: Floats) -> Complexes:
        """Sampled response P (n,) [m/N], force to reading with hold and delay, at angles (n,) in (0, pi]."""
        parts = np.array_split(thetas, 1 + len(thetas) // CHUNK)
        near = [_difference(self.loop, self.hysteretic, self.viscous, part, self.near) for part in parts]
        low_pass, z = force_filter(self.loop.controller), np.exp(1j * thetas)
        # the force filter and the whole samples of delay, which the differences leave out
        passed = factor_response(low_pass.numerator, low_pass.denominator, z - 1.0) / z**self.loop.whole_delay
        # the reference loop's response is P = AP / A
        A, AP, _ = terms_along(circle_factors(table_of_loops(self.reference)), thetas).T
        return np.asarray(AP / A + passed * (np.concatenate(near) + self.far(thetas)))

    def rounding(self, thetas: Floats) -> Floats:
        """Rounding error of P (n,) to be expected [m/N]: a sum of modes smaller than each of them loses digits."""
        w = thetas / self.loop.period  # alias 0, the largest; its hold has the size |1 - 1/z| / theta
        sizes = np.abs(self.hysteretic.modes(w)) @ np.abs(self.hysteretic.modal_sensor)
        return np.asarray(UNIT * sizes * np.abs(np.expm1(-1j * thetas)) / thetas)


def _difference(loop: Loop, hysteretic: ModalPlant, viscous: ModalPlant, thetas: Floats, k: Ints) -> Complexes:
    """Sampled response of the hysteretic plant less the viscous one's (n,) [m/N], summed over the aliases numbered
    k; with hold, actuator lag and the fraction of a sample of delay, without force filter and whole samples."""
    w = (thetas[:, None] + 2.0 * np.pi * k) / loop.period
    s = 1j * w
    lag = loop.controller.actuator_time_constant * s + 1.0
    late = np.exp(-s * loop.fractional_delay * loop.period)
    hold = late * -np.expm1(-1j * thetas)[:, None] / (s * lag)
    return np.asarray(np.sum((hysteretic.response(w) - viscous.response(w)) * hold, axis=1) / loop.period)


STEP = 0.1  # first angles, in shares of the distance to the nearest singularity of the viscous plant
INTERPOLATION_ERROR = 1e-9  # relative error of P that interpolation may leave
FINEST = 1e-7  # least step between two angles, as a share of the angle; least distance of an angle from pi, in pi
TOO_SMALL = "too small for this loop to be charted; set it to 0, give a larger one, or give damping instead"
MOST_SAMPLES = 100_000  # angles
LEAST_LOSS_FACTOR = 1e-5  # of the stiffness: with less the response turns too fast to be followed along the circle


def hysteretic_chart(loop: Loop) -> MeasuredChart:
    """The stable walls of a loop whose plant has a loss factor (`Plant.hysteresis`).

    Returns  MeasuredChart; what it calls measured is computed here, to 1e-9, at as many frequencies as it takes
    Raises   HysteresisError  for no loss factor, one below 1e-5 or too small for this loop, or a fixed feedback

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> spring = np.array([[4000.0]])
    >>> plant = Plant(one[None], 0.0 * spring, spring, one, one, hysteresis=0.05 * spring)
    >>> hysteretic_chart(Loop(plant, Controller(0.001))).stiffness_max > 0.0
    True
    """
    check_kind("loop", loop, Loop)
    if loop.plant.hysteresis is None:
        raise HysteresisError("the plant has no loss factor; stability_chart charts it")
    if loop.has_fixed_feedback:
        raise HysteresisError(
            f"a loss factor cannot be charted with {loop.controller.feedback_names[0]}; describe the damping by "
            "damping_Ns_per_m instead"
        )
    if np.max(np.abs(loop.plant.hysteresis)) < LEAST_LOSS_FACTOR * (1.0 - 1e-9) * np.max(
        np.abs(loop.plant.stiffness)
    ):
        raise HysteresisError(f"the loss factor is below {LEAST_LOSS_FACTOR:.0e}, {TOO_SMALL}")
    # delay, lag and filter are in the response already, and must not be applied twice
    remaining_controller = replace(loop.controller, delay=0.0, actuator_time_constant=0.0, force_filter=None)
    try:
        chart = measured_chart(_response(loop), remaining_controller)
    except ResponseError:
        raise HysteresisError(f"the loss factor is {TOO_SMALL}") from None
    if chart.open:
        raise HysteresisError(f"the loss factor is {TOO_SMALL}")
    return chart


def _response(loop: Loop) -> Response:
    """P on the unit circle as a response [m/N], at angles so close that it can be interpolated."""
    sampled = SampledResponse.of(loop)
    squared, _ = undamped_modes(loop.plant.mass, loop.plant.stiffness)
    braked = loop.plant.damping.any() or loop.plant.lagged_dampers
    thetas = Tracer(sampled.reference).sample_angles(STEP)
    thetas = np.append(thetas[thetas < np.pi * (1.0 - FINEST)], np.pi)
    response = Response(
        frequency=thetas / (2.0 * np.pi * loop.period),
        value=sampled(thetas),
        integrators=2 if np.any(squared == 0.0) and not braked else None,  # of a free rigid motion
        note="computed from the loss factor",
    )
    thetas, P = _refine_angles(sampled, thetas, response.value, integrators_of(response, loop.period))
    return replace(response, frequency=thetas / (2.0 * np.pi * loop.period), value=P)


def _refine_angles(
    sampled: SampledResponse, thetas: Floats, P: Complexes, integrators: int
) -> tuple[Floats, Complexes]:
    """The angles and P (n,) there, refined until P is interpolated to INTERPOLATION_ERROR and its rounding in each
    middle, steps are FINEST, or there are MOST_SAMPLES. integrators: of `interpolate_response`."""
    # steps between two angles whose middle is not yet known to be interpolated well
    unsure = np.ones(len(thetas) - 1, dtype=bool)
    while unsure.any() and len(thetas) < MOST_SAMPLES:
        middle = 0.5 * (thetas[:-1] + thetas[1:])[unsure]
        exact = sampled(middle)
        curve = interpolate_response(thetas, P, integrators, closed=True)
        allowed = INTERPOLATION_ERROR + sampled.rounding(middle) / np.abs(exact)
        missed = np.abs(exact * curve.inverse(middle) - 1.0) > allowed
        wide = np.diff(thetas)[unsure] > FINEST * middle
        new = np.flatnonzero(unsure)[missed & wide] + 1
        thetas = np.insert(thetas, new, middle[missed & wide])
        P = np.insert(P, new, exact[missed & wide])
        # the halves of each step that was too wide
        unsure = np.zeros(len(thetas) - 1, dtype=bool)
        at = new + np.arange(len(new))
        unsure[at - 1] = unsure[at] = True
    return thetas, P


THINNED: Final = 8  # chords of the viscous edge that make one here
LENGTHENED: Final = 6  # chords on the piece by which an arc is longer than the viscous one
TURN_ROUNDS: Final = 2  # in which the angles of turns are improved
NEAR_ONE: Final = 1e-9  # angle at which the steady force is taken


@dataclass(frozen=True)
class HystereticCurve:
    """Walls of a loop with a loss factor that have a pair of roots on the circle."""

    loop: Loop
    sampled: SampledResponse

    def walls(self, thetas: Floats) -> tuple[Floats, Floats]:
        """K and B (k,) at angles (k,) in (0, pi): B = Im h / Im w, K = Re h - B Re w with h = -1/P."""
        h = -1.0 / self.sampled(thetas)
        w = self.loop.velocity_response(np.exp(1j * thetas))  # of the velocity estimate
        B = h.imag / w.imag
        return np.asarray(h.real - B * w.real), np.asarray(B)

    def real_root_lines(self) -> dict[int, tuple[float, float]]:
        """h [N/m] and w [1/s] of the lines K + B w = h of walls with a root at z = 1 and at z = -1."""
        h = (-1.0 / self.sampled(np.array([NEAR_ONE, np.pi]))).real
        w = self.loop.velocity_response(np.array([1.0, -1.0])).real
        return {PLUS: (float(h[0]), float(w[0])), MINUS: (float(h[1]), float(w[1]))}


def hysteretic_edge(loop: Loop) -> EdgeChords:
    """The edge of a loop whose plant has a loss factor, by the arcs of its viscous equivalent.

    Raises  ChartError       where the viscous edge cannot be closed
            HysteresisError  where the arcs differ from those, and the loop cannot be charted
    """
    sampled = SampledResponse.of(loop)
    curve = HystereticCurve(loop, sampled)
    viscous = stability_chart(sampled.reference, decay=False).edge.traced
    if not len(viscous.arcs):
        return _edge_of_chart(loop)
    size = np.maximum(np.ptp(np.vstack(viscous.outlines), axis=0), 1e-300)
    moved = moved_arcs(viscous.arcs, curve, curve.real_root_lines(), size)
    edge = None if moved is None else _edge_of_arcs(curve, viscous, moved)
    return _edge_of_chart(loop) if edge is None else edge


def _edge_of_chart(loop: Loop) -> EdgeChords:
    """The edge of the whole chart: the sides of its cells, which lie on it to a share of 1e-5 of its size."""
    from scipy.spatial import cKDTree

    chart = hysteretic_chart(loop)
    # a side's ends get the frequencies of the nearest walls of the chart's edge
    sides = Arcs.chords(chart.regions)
    if not len(sides):
        return EdgeChords(np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)))
    K0, K1, B0, B1 = chart.box
    size = np.array([K1 - K0, B1 - B0])
    known = np.isfinite(chart.edge.walls).all(axis=1)
    tree = cKDTree(chart.edge.walls[known] / size)
    frequencies = chart.edge.angles[known] / (2.0 * np.pi * loop.period)
    ends = [frequencies[tree.query(walls / size)[1]] for walls in (sides.first, sides.last)]
    return EdgeChords(sides.first, sides.last, np.column_stack(ends))


def _edge_of_arcs(curve: HystereticCurve, viscous: TracedEdge, moved: MovedArcs) -> EdgeChords | None:
    """Chords along the arcs between their moved ends on the curve; None where a ring of them crosses itself."""
    arcs = viscous.arcs
    inner = [
        _angles_between(points, moved.start[k], moved.end[k]) if arcs.kind[k] == PAIR else np.empty(0)
        for k, points in enumerate(viscous.arc_points)
    ]
    for _ in range(TURN_ROUNDS):
        walks = _arc_walls(curve, inner, moved)
        inner = [_with_turns(*walk) if len(walk[0]) > 2 else walk[0][1:-1] for walk in walks]
    walks = _arc_walls(curve, inner, moved)
    for ring in arcs.rings:
        outline = np.vstack([walks[k][1][:-1] for k in ring])
        if len(outline) > 3 and not shapely.Polygon(outline).is_valid:
            return None
    first = np.vstack([walls[:-1] for _, walls in walks])
    last = np.vstack([walls[1:] for _, walls in walks])
    pairs = np.vstack([np.column_stack([thetas[:-1], thetas[1:]]) for thetas, _ in walks])
    return EdgeChords(first, last, pairs / (2.0 * np.pi * curve.loop.period), curve)


def _angles_between(points: ArcPoints, start: float, end: float) -> Floats:
    """Angles strictly between the ends `start` and `end` of an arc of the hysteretic plant, from start to end.

    They are those of the viscous plant's arc, every THINNED-th and all at which K or B turns, and further ones on
    the pieces by which the hysteretic arc is longer.
    """
    thetas, K, B = points
    way = np.sign(np.diff([K, B], axis=1))
    kept = np.arange(len(thetas)) % THINNED == 0
    kept[1:-1] |= np.any(way[:, 1:] != way[:, :-1], axis=0)
    kept[[0, -1]] = False
    shares = np.arange(LENGTHENED) / LENGTHENED
    longer = [old + (new - old) * shares for old, new in ((thetas[0], start), (thetas[-1], end))]
    low, high = min(start, end), max(start, end)
    angles = np.unique(np.concatenate([thetas[kept], *longer]))
    margin = 1e-9 * (high - low)
    angles = angles[(angles > low + margin) & (angles < high - margin)]
    return angles if end > start else angles[::-1]


def _arc_walls(curve: HystereticCurve, inner: list[Floats], moved: MovedArcs) -> list[tuple[Floats, Floats]]:
    """Angles (k,) and walls (k, 2) [N/m, N s/m] along each arc: at its inner angles, and at its moved ends."""
    K, B = curve.walls(np.concatenate(inner)) if sum(map(len, inner)) else (np.empty(0), np.empty(0))
    parts = np.split(np.column_stack([K, B]), np.cumsum([len(thetas) for thetas in inner])[:-1])
    return [
        (
            np.concatenate([[moved.start[k]], thetas, [moved.end[k]]]),
            np.vstack([moved.first[k], walls, moved.last[k]]),
        )
        for k, (thetas, walls) in enumerate(zip(inner, parts, strict=True))
    ]


def _with_turns(thetas: Floats, walls: Floats) -> Floats:
    """The angles of an arc, given to its ends with its walls (k, 2), without the ends and with those at which K or
    B turns by the parabola through three neighbours."""
    turns = []
    for values in walls.T:
        step = np.diff(values)
        at = np.flatnonzero(step[1:] * step[:-1] < 0.0) + 1
        before, after = thetas[at] - thetas[at - 1], thetas[at + 1] - thetas[at]
        slope_before, slope_after = step[at - 1] / before, step[at] / after
        # half way between the neighbours' middles the slope of the parabola falls from one to the other
        share = slope_before / (slope_before - slope_after)
        turns.append(thetas[at] - 0.5 * before + share * 0.5 * (before + after))
    rising = thetas[-1] > thetas[0]
    angles = np.unique(np.concatenate([thetas[1:-1], *turns]))
    gaps = np.append(True, np.diff(angles) > 1e-9 * np.ptp(thetas))
    angles = angles[gaps]
    return np.asarray(angles if rising else angles[::-1])


MOST_STEPS: Final = 40  # of Newton's method
SLOPE_STEP: Final = 1e-6  # of an angle for derivatives, as a share of its distance to the nearer end of (0, pi)
LONGEST_STEP: Final = 0.2  # the same of one step of Newton's method
SAME_WALL: Final = 1e-10  # distance of two walls that are one, as a share of the edge's size
SAME_ANGLE: Final = 1e-9  # angles of two arcs between which the curve goes on
FARTHEST: Final = 0.1  # by which a corner may move, of the edge's size: farther off there is another crossing
NEAREST: Final = 1e-6  # angles nearer than this to 0 or pi are those ends themselves


@dataclass(frozen=True)
class MovedArcs:
    """Arcs with their ends on another curve.

    first, last  (n, 2)  walls [N/m, N s/m]
    start, end   (n,)    angles
    """

    first: Floats
    last: Floats
    start: Floats
    end: Floats


def moved_arcs(
    arcs: Arcs, curve: EdgeCurve, lines: dict[int, tuple[float, float]], size: Floats
) -> MovedArcs | None:
    """Arcs of pairs of roots and of real roots with their corners on a curve near the one they were traced on.

    lines    h and w of the lines of real roots K + B w = h, by `arcs.PLUS` and `arcs.MINUS`
    size     (2,) of the edge [N/m, N s/m]
    Returns  None where a corner is not found near the former one, or an arc would run backwards or is of another
             kind: the edges differ in their arcs then
    """
    if not np.isin(arcs.kind, (PAIR, PLUS, MINUS)).all():
        return None
    following = arcs.next_arc
    start, end, corner = arcs.start.copy(), arcs.end.copy(), arcs.last.copy()
    # at the corner behind each arc: are the arcs before and after it of the curve; do they meet it inside (0, pi)
    before, after = arcs.kind == PAIR, arcs.kind[following] == PAIR
    inside = _are_inside(end), _are_inside(arcs.start[following])
    smooth = before & after & (np.abs(end - arcs.start[following]) < SAME_ANGLE)

    # the curve crosses itself
    both = np.flatnonzero(before & after & inside[0] & inside[1] & ~smooth)
    a, b, found = _self_crossings(curve, end[both], arcs.start[following[both]], size)
    end[both], start[following[both]] = a, b
    corner[both] = np.column_stack(curve.walls(a)) if len(both) else corner[both]

    # the curve meets a line: the arc before the corner is of the curve and that after it a line, or the other way
    for ahead, ends, kind_of_other in ((True, end, arcs.kind[following]), (False, start, arcs.kind)):
        of_curve = before if ahead else after
        arc_of_curve = np.arange(len(arcs)) if ahead else following
        for kind, (h, w) in lines.items():
            some = np.flatnonzero(of_curve & inside[0 if ahead else 1] & (kind_of_other == kind))
            angle, met = _line_crossings(curve, ends[arc_of_curve[some]], h, w, size)
            ends[arc_of_curve[some]], found = angle, found & met
            corner[some] = np.column_stack(curve.walls(angle)) if len(some) else corner[some]

    on = np.flatnonzero(smooth & inside[0])
    corner[on] = np.column_stack(curve.walls(end[on])) if len(on) else corner[on]
    # at z = 1 the curve ends where it did, as steady forces are the same; at z = -1 it ends on the moved line
    last = np.flatnonzero((before & (end > np.pi - NEAREST)) | (after & (arcs.start[following] > np.pi - NEAREST)))
    corner[last] = np.column_stack(curve.walls(np.full(len(last), np.pi - NEAREST))) if len(last) else corner[last]
    _move_line_corners(corner, arcs, lines)

    if not found or _differ_from(arcs, start, end, corner, size):
        return None
    first = np.empty_like(corner)
    first[following] = corner
    return MovedArcs(first, corner, start, end)


def _move_line_corners(corner: Floats, arcs: Arcs, lines: dict[int, tuple[float, float]]) -> None:
    """Move, in place, those of the arcs' last walls (n, 2) [N/m, N s/m] at which the lines of real roots cross.

    lines  as in `moved_arcs`
    """
    before, after = arcs.kind == PAIR, arcs.kind[arcs.next_arc] == PAIR
    crossed = np.flatnonzero(~before & ~after & (arcs.kind != arcs.kind[arcs.next_arc]))
    if len(crossed):
        (h0, w0), (h1, w1) = lines[PLUS], lines[MINUS]
        B = (h1 - h0) / (w1 - w0)
        corner[crossed] = h0 - B * w0, B


def _differ_from(arcs: Arcs, start: Floats, end: Floats, corner: Floats, size: Floats) -> bool:
    """Return whether moved arcs differ from the former ones: a corner is far from its former place or is nan, or
    an arc of a pair of roots runs backwards.

    start, end  (n,) moved angles [rad];   corner  (n, 2) moved last walls, size (2,) of the edge [N/m, N s/m]
    """
    ahead = np.sign(arcs.end - arcs.start) == np.sign(end - start)
    far = not np.all(np.abs(corner - arcs.last) < FARTHEST * size)  # true of nan, too
    return far or not np.all(ahead[arcs.kind == PAIR])


def _are_inside(angles: Floats) -> Flags:
    """Which angles lie within (0, pi), farther than NEAREST from its ends."""
    return (angles > NEAREST) & (angles < np.pi - NEAREST)


def _room(angles: Floats) -> Floats:
    """Distance of each angle from the nearer of 0 and pi [rad]."""
    return np.minimum(angles, np.pi - angles)


def _walls_with_slopes(curve: EdgeCurve, angles: Floats) -> tuple[Floats, Floats]:
    """Walls K, B (k, 2) at angles (k,), and their derivatives by the angle (k, 2), by central differences."""
    step = SLOPE_STEP * _room(angles)
    K, B = curve.walls(np.concatenate([angles, angles + step, angles - step]))
    walls = np.column_stack([K, B]).reshape(3, -1, 2)
    return walls[0], (walls[1] - walls[2]) / (2.0 * step[:, None])


def _self_crossings(curve: EdgeCurve, a: Floats, b: Floats, size: Floats) -> tuple[Floats, Floats, bool]:
    """Angles (k,), (k,) near a and b at which a curve has the same wall, and whether all are found.

    size  (2,) of the edge [N/m, N s/m]
    """
    k = len(a)
    if not k:
        return a, b, True
    for _ in range(MOST_STEPS):
        walls, slopes = _walls_with_slopes(curve, np.concatenate([a, b]))
        gap = (walls[:k] - walls[k:]) / size
        if np.max(np.abs(gap)) < SAME_WALL:
            return a, b, True
        (dK_a, dB_a), (dK_b, dB_b) = (slopes[:k] / size).T, (slopes[k:] / size).T
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            # to first order the walls at a + step_a and at b + step_b are the same
            det = dK_b * dB_a - dK_a * dB_b
            step_a = (dB_b * gap[:, 0] - dK_b * gap[:, 1]) / det
            step_b = (dB_a * gap[:, 0] - dK_a * gap[:, 1]) / det
            longest = np.maximum(np.abs(step_a) / _room(a), np.abs(step_b) / _room(b))
            share = np.minimum(1.0, LONGEST_STEP / longest)
        if not np.isfinite(longest).all():
            break
        a, b = a + share * step_a, b + share * step_b
    return a, b, False


def _line_crossings(curve: EdgeCurve, a: Floats, h: float, w: float, size: Floats) -> tuple[Floats, bool]:
    """Angles (k,) near a at which a curve crosses the line K + B w = h, and whether all are found.

    size  (2,) of the edge [N/m, N s/m]
    """
    if not len(a):
        return a, True
    scale = size[0] + size[1] * abs(w)
    for _ in range(MOST_STEPS):
        walls, slopes = _walls_with_slopes(curve, a)
        gap = (walls[:, 0] + walls[:, 1] * w - h) / scale
        if np.max(np.abs(gap)) < SAME_WALL:
            return a, True
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -gap * scale / (slopes[:, 0] + slopes[:, 1] * w)
        if not np.isfinite(step).all():
            break
        a = a + np.clip(step, -LONGEST_STEP * _room(a), LONGEST_STEP * _room(a))
    return a, False
