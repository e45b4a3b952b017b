"""Walls that are stable with every passive operator: Colgate and Schenkel's theorem for any device and estimator.

The device with a passive operator is stable without a wall. Along a ray of walls lambda H, lambda from 0, no root
crosses the circle before lambda = 1/mu, the gauge's answer (see `gauge`); nor does a root at z = 1 while no spring
makes the reading give way by more than the wall pushes back. So the rays, cut off there, are the passive walls.

A mass m with viscous friction b has C = -(T/4b)(1 - e^(-i theta))/(1 - cos theta) e^(-i l theta), R = |C|: half
planes, and the theorem of Colgate and Schenkel 1997 (read in Weir and Colgate's chapter of 2008) to the letter,

    b > (T/2)/(1 - cos wT) Re{ (1 - e^(-jwT)) e^(-jlwT) H }.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.guarantees.gauge import Gauge, gauge
from zwidth.guarantees.grid import angle_grid
from zwidth.guarantees.port import Floats
from zwidth.guarantees.region import Region, empty
from zwidth.loop.loop import Loop
from zwidth.model.arguments import require

Complexes = NDArray[np.complex128]

# Chords of the outline deviate from it by this share, if bisecting directions at most so often gets there.
CHORD, BISECTIONS = 1e-6, 24
# Angles are made denser where they limit a ray: so often, and so.
REFINEMENTS, SPLIT = 2, np.arange(1, 8) / 8.0
# Stiffnesses closer than this are equal.
LEVEL = 1e-12
# A stiffness this small, beside the largest, is none.
SHORT = 1e-9
NOTHING = "no wall at all is stable with every passive operator"
NO_SPRING = "no wall with K > 0 and B >= 0 is stable with every passive operator"


def passive_region(loop: Loop, held: Floats | None = None) -> Region:
    """The walls that are stable whatever passive linear operator holds the device.

    loop  the bare device; an operator attached to the plant counts as a part of it
    held  (n,) where the operator holds it; left out: the plant's handle

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> paddle = Plant(np.array([[0.03]]), np.array([[1.0]]), np.zeros((1, 1)), one, one)
    >>> round(passive_region(Loop(paddle, Controller(sampling_period=0.001)), one).stiffness_max, 4)   # 2 b/T
    2000.0
    """
    require("loop", loop, Loop)
    held = loop.plant.handle if held is None else held
    if held is None:
        raise ValueError("the plant has no handle: say with `held` where the operator holds it")
    found = gauge(loop, held, angle_grid(loop, held))
    for _ in range(REFINEMENTS):
        found = _denser(loop, held, found, np.linspace(-np.pi, np.pi, 241))
    directions, reach = _outline(found, loop.period)
    if not np.max(reach) > 0.0:
        return empty(NOTHING)
    K, B = _walls(directions, reach, loop.period)
    ring = np.column_stack([np.append(K, K[:1]), np.append(B, B[:1])])
    usable = (directions >= 0.0) & (directions < np.pi / 2.0) & (SHORT * np.max(np.abs(K)) < K)
    if not usable.any():
        return Region((ring,), float("nan"), float("nan"), NO_SPRING)
    best = int(np.argmax(np.where(usable, K, -np.inf)))
    low, high = max(directions[best - 1], 0.0), min(directions[best + 1], np.pi / 2.0)
    return Region((ring,), *_stiffest(loop, held, found, low, high))


def _walls(directions: Floats, reach: Floats, period: float) -> tuple[Floats, Floats]:
    """Walls at some reach along directions (k,), in which K T and B are of one size."""
    return reach * np.cos(directions) / period, reach * np.sin(directions)


def _reach(found: Gauge, directions: Floats, period: float) -> Floats:
    """How far rays go (k,) [N s/m]; 0 where they fail at once."""
    mu, _ = found.largest(*_walls(directions, np.ones(len(directions)), period))
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / mu)


def _outline(found: Gauge, period: float) -> tuple[Floats, Floats]:
    """Directions (k,) once round and the reach along each, bisected until chords follow the outline."""
    directions = np.linspace(-np.pi, np.pi, 241)
    reach = _reach(found, directions, period)
    coarse = np.ones(len(directions) - 1, dtype=bool)
    for _ in range(BISECTIONS):
        left = np.flatnonzero(coarse)
        if not len(left):
            break
        middle = (directions[left] + directions[left + 1]) / 2.0
        between = _reach(found, middle, period)
        ends = reach * np.exp(1j * directions)
        off = _distance(between * np.exp(1j * middle), ends[left], ends[left + 1])
        keep = off > CHORD * np.max(reach)
        after = np.zeros(len(coarse) + len(left), dtype=bool)
        at = left + np.arange(len(left))
        after[at], after[at + 1] = keep, keep
        directions, reach = np.insert(directions, left + 1, middle), np.insert(reach, left + 1, between)
        coarse = after
    return directions, reach


def _distance(point: Complexes, first: Complexes, last: Complexes) -> Floats:
    """Of points from the chords between two others, all (k,)."""
    along = last - first
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.real((point - first) * along.conj()) / np.abs(along) ** 2
    return np.asarray(np.abs(point - first - np.clip(np.nan_to_num(share), 0.0, 1.0) * along))


def _denser(loop: Loop, held: Floats, found: Gauge, directions: Floats) -> Gauge:
    """The gauge with more angles in the intervals that limit rays in these directions, and beside them."""
    _, worst = found.largest(*_walls(directions, np.ones(len(directions)), loop.period))
    angles = found.disks.angles
    first = np.unique(np.clip(worst[:, None] + np.arange(-1, 2), 0, len(angles) - 2))
    inner = angles[first, None] + (angles[first + 1] - angles[first])[:, None] * SPLIT
    return gauge(loop, held, np.unique(np.concatenate([angles, inner.ravel()])))


def _stiffest(loop: Loop, held: Floats, found: Gauge, low: float, high: float) -> tuple[float, float]:
    """The largest K between two directions and its B, by golden section, on angles made denser where it fails."""
    for _ in range(REFINEMENTS):
        best = _golden(found, loop.period, low, high)
        found = _denser(loop, held, found, best + np.linspace(-1e-6, 1e-6, 5))
    top = np.array([_golden(found, loop.period, low, high)])
    K, B = _walls(top, _reach(found, top, loop.period), loop.period)
    return float(K[0]), float(B[0])


def _golden(found: Gauge, period: float, low: float, high: float) -> float:
    """The direction of the largest K in an interval in which it has one maximum; the least B of equal ones."""
    ratio = (np.sqrt(5.0) - 1.0) / 2.0
    ends = (low, high)

    def stiffness(direction: float) -> float:
        return float(_reach(found, np.array([direction]), period)[0] * np.cos(direction))

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
