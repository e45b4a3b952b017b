"""Walls that are stable with every passive operator: Colgate and Schenkel's theorem for any device and estimator.

The device by itself is stable (`stable_alone`), and with a passive operator, too. Along a ray of walls lambda H,
lambda from 0, no root crosses the circle before lambda = 1/mu, the gauge's answer (see `gauge`); nor does a root
at z = 1 while no spring makes the reading give way by more than the wall pushes back. So the rays, cut off there,
are the passive walls.

A mass m with viscous friction b has C = -(T/4b)(1 - e^(-i theta))/(1 - cos theta) e^(-i l theta), R = |C|: half
planes, and the theorem of Colgate and Schenkel 1997 (read in Weir and Colgate's chapter of 2008) to the letter,

    b > (T/2)/(1 - cos wT) Re{ (1 - e^(-jwT)) e^(-jlwT) H }.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.guarantees.gauge import Gauge, gauge
from zwidth.guarantees.region import Region, empty_region
from zwidth.guarantees.stable_alone import stable_alone
from zwidth.loop.controller import Feedforward, feedback_name
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import check_kind

# Largest deviation of chords from the outline, in shares of the wall, inwards and outwards; and largest number of
# bisections of a direction.
CHORD, OUTSIDE, BISECTIONS = 1e-6, 1e-7, 26
# Rounds in which directions of narrow notches are added, and the least distance to a known direction.
ROUNDS, NARROW = 6, 1e-7
# Rays with a smaller mu count as unlimited.
UNLIMITED = 1e-100
# Relative difference below which two stiffnesses count as equal.
LEVEL = 1e-12
# A stiffness below this share of the largest counts as 0.
SHORT = 1e-9
NOTHING = "no wall at all is stable with every passive operator"
ACTIVE = "some passive operator vibrates with the feedforward even without a wall"
NO_SPRING = "no wall with K > 0 and B >= 0 is stable with every passive operator"


def passive_region(loop: Loop, held: Floats | None = None) -> Region:
    """The walls that are stable whatever passive linear operator holds the device; empty, with a reason, where
    there are none, the device alone is unstable, or they are not known with its feedback.

    loop  the device without operator; an operator attached to the plant counts as a part of the device
    held  (n,) coordinate held . x at which the operator holds it; left out: the plant's handle
    Raises  ValueError  where `held` is left out and the plant has no handle

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> paddle = Plant(np.array([[0.03]]), np.array([[1.0]]), np.zeros((1, 1)), one, one)
    >>> round(passive_region(Loop(paddle, Controller(sampling_period=0.001)), one).stiffness_max, 4)   # 2 b/T
    2000.0
    """
    check_kind("loop", loop, Loop)
    held = loop.plant.handle if held is None else held
    if held is None:
        raise ValueError("the plant has no handle; give `held`, the coordinate at which the operator holds it")
    obstacle = feedback_obstacle(loop)
    if obstacle:
        return empty_region(obstacle)
    if (alone := stable_alone(loop)).fails:
        return empty_region(alone.reason)
    loop_gauge = gauge(loop, held)
    if loop_gauge.conics is None and loop.has_fixed_feedback:
        return empty_region(ACTIVE)
    return passive_region_of(loop_gauge, loop.period)


def passive_region_of(passive_gauge: Gauge, period: float) -> Region:
    """The walls whose mu by a gauge is below 1: stable with every passive operator. period: sampling [s]."""
    directions, ends = _outline(passive_gauge, period)
    if not np.any(ends):
        return empty_region(NOTHING)
    corners = np.append(ends[:1], ends[1:][ends[1:] != ends[:-1]])
    ring = np.column_stack([corners.real / period, corners.imag])
    ring = np.vstack([ring, ring[:1]])
    K = ends.real / period
    usable = (directions >= 0.0) & (directions < np.pi / 2.0) & (SHORT * np.max(np.abs(K)) < K)
    if not usable.any():
        return Region((ring,), float("nan"), float("nan"), NO_SPRING)
    best = int(np.argmax(np.where(usable, K, -np.inf)))
    low, high = max(directions[best - 1], 0.0), min(directions[best + 1], np.pi / 2.0)
    return Region((ring,), *_stiffest(passive_gauge, period, low, high))


def feedback_obstacle(loop: Loop) -> str:
    """Why nothing is known of all passive operators with a computer's feedback; "" where it is known.

    What a force sensor reads depends on the operator itself, and a local loop samples at another rate: then the
    response of all operators together fills no disk.
    """
    if loop.plant.is_loaded:
        return "this is not known under load, where the computer's own force turns with what the operator moves"
    unlike = [part for part in loop.controller.fixed_feedback if not isinstance(part, Feedforward)]
    return f"this is not known with {feedback_name(unlike[0])}" if unlike else ""


def _walls_along(directions: Floats, reach: Floats, period: float) -> tuple[Floats, Floats]:
    """K and B of walls at a reach along directions (k,) in the plane of K T and B [N s/m]."""
    return reach * np.cos(directions) / period, reach * np.sin(directions)


def _mu_along(loop_gauge: Gauge, directions: Floats, period: float) -> Floats:
    """mu of walls at reach 1 along directions (k,): 1 over the length of each ray [1/(N s/m)]."""
    return loop_gauge.largest(*_walls_along(directions, np.ones(len(directions)), period))[0]


def _ray_ends(loop_gauge: Gauge, directions: Floats, period: float) -> Complexes:
    """Ends of the rays of passive walls along directions (k,): K T + j B [N s/m]; 0 where no wall is passive."""
    return np.asarray(np.exp(1j * directions) / np.maximum(_mu_along(loop_gauge, directions, period), UNLIMITED))


def _outline(loop_gauge: Gauge, period: float) -> tuple[Floats, Complexes]:
    """Directions (k,) all around and the ends of their rays, K T + j B (k,), bisected until chords follow the
    outline.

    Lightly damped modes cut narrow notches: directions in which an angle forbids walls of a chord are added.
    """
    directions = np.linspace(-np.pi, np.pi, 241)
    ends = _ray_ends(loop_gauge, directions, period)
    left = np.arange(len(directions) - 1)  # numbers of the directions whose chord to the next is to be checked
    for _ in range(ROUNDS):
        for _ in range(BISECTIONS):
            if not len(left):
                break
            middle = (directions[left] + directions[left + 1]) / 2.0
            between = _ray_ends(loop_gauge, middle, period)
            off = _off_chord(between, ends[left], ends[left + 1])
            directions, ends = np.insert(directions, left + 1, middle), np.insert(ends, left + 1, between)
            left = (left + np.arange(len(left)))[off]
            left = np.sort(np.concatenate([left, left + 1]))
        missed = _missed_directions(loop_gauge, directions, ends, period)
        if not len(missed):
            break
        at = np.searchsorted(directions, missed)
        directions = np.insert(directions, at, missed)
        ends = np.insert(ends, at, _ray_ends(loop_gauge, missed, period))
        at += np.arange(len(missed))
        left = np.unique(np.concatenate([at - 1, at]))
    return directions, ends


def _missed_directions(loop_gauge: Gauge, directions: Floats, ends: Complexes, period: float) -> Floats:
    """Directions in which an angle forbids walls inside the outline's chords, where they lie deepest inside.

    directions, ends  (k,) of the outline so far, as of `_outline`
    """
    if loop_gauge.conics is None:
        return np.zeros(0)
    tip = loop_gauge.conics.tips(period)
    right = np.clip(np.searchsorted(directions, np.angle(tip)), 1, len(directions) - 1)
    first, last = ends[right - 1], ends[right]
    along = last - first
    depth = np.imag(along.conj() * (tip - first)) / np.maximum(np.abs(along), 1e-300) / np.abs(tip)
    deep = (depth > OUTSIDE) & (directions[right] - directions[right - 1] > NARROW)
    depth = np.where(deep, depth, 0.0)
    # of a run of tips, the deepest
    farthest = deep & (depth >= np.append(0.0, depth[:-1])) & (depth > np.append(depth[1:], 0.0))
    return np.unique(np.angle(tip[farthest]))


def _off_chord(between: Complexes, first: Complexes, last: Complexes) -> Flags:
    """Whether walls between two others, all (k,), lie off their chord, or between a wall and none."""
    along = last - first
    length = np.maximum(np.abs(along), 1e-300)
    inwards = np.imag(along.conj() * (between - first)) / length
    allowed = np.where(inwards > 0.0, OUTSIDE, CHORD) * np.abs(between)
    return np.asarray((np.abs(inwards) > allowed) | ((first == 0.0) != (last == 0.0)))


def _stiffest(loop_gauge: Gauge, period: float, low: float, high: float) -> tuple[float, float]:
    """The largest K [N/m] among ray ends between two directions, and its B [N s/m]."""
    top = np.array([_stiffest_direction(loop_gauge, period, low, high)])
    K, B = _walls_along(top, 1.0 / _mu_along(loop_gauge, top, period), period)
    return float(K[0]), float(B[0])


def _stiffest_direction(loop_gauge: Gauge, period: float, low: float, high: float) -> float:
    """The direction, an angle from K T to B, of the largest K from low to high, between which it has one maximum;
    of equal ones that of the least B."""
    ratio = (np.sqrt(5.0) - 1.0) / 2.0
    ends = (low, high)

    def stiffness(direction: float) -> float:
        return float(np.cos(direction) / _mu_along(loop_gauge, np.array([direction]), period)[0])

    a, b = high - ratio * (high - low), low + ratio * (high - low)
    at_a, at_b = stiffness(a), stiffness(b)
    for _ in range(60):
        if at_b > at_a:
            low, a, at_a = a, b, at_b
            b = low + ratio * (high - low)
            at_b = stiffness(b)
        else:
            high, b, at_b = b, a, at_a
            a = high - ratio * (high - low)
            at_a = stiffness(a)
    top = max(((low + high) / 2.0, *ends), key=stiffness)
    return ends[0] if stiffness(ends[0]) >= (1.0 - LEVEL) * stiffness(top) else top
