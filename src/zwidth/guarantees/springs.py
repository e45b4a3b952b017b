"""Walls that are stable with every spring at the handle, from a free hand to one that holds it fixed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from zwidth.chart.chart import stability_chart
from zwidth.guarantees.port import Floats, fixed, reached
from zwidth.guarantees.region import Region, empty, rings_of, stiffest_corner
from zwidth.loop.loop import Loop
from zwidth.loop.sections import UnmovedError
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import Plant

# Springs looked at first, by the frequency of the mode they make: so many, up to so many times Nyquist's.
SPRINGS, BEYOND = 32, 6.0
# Springs that walls on the edge are tried with, walls taken from the edge, and rounds of adding the worst springs.
TRIED, WALLS, ROUNDS = 160, 30, 5
# Springs whose mode looks, sampled, like an edge wall's own vibration are tried too: to so many times the sampling
# rate, and this far beside it.
ALIASES, BESIDE = 2, np.array([-0.01, -0.002, 0.0, 0.002, 0.01])
# An edge wall is unstable with a spring if a motion grows by more than this per sample.
OUTSIDE = 1e-8
NOTHING = "no wall at all is stable with every spring at the handle"
NO_SPRING = "no wall with K > 0 and B >= 0 is stable with every spring at the handle"
NO_NYQUIST = "no wall with K > 0 and B >= 0 is stable with the Nyquist spring"


def with_spring(plant: Plant, stiffness: float) -> Plant:
    """The plant with a spring from its handle to the ground [N/m]; inf holds the handle fixed.

    >>> one = np.ones(1)
    >>> free = Plant(np.array([[0.1]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one, one)
    >>> with_spring(free, 500.0).stiffness.tolist()
    [[500.0]]
    """
    handle = _handle(plant)
    if np.isinf(stiffness):
        return fixed(plant, handle)
    return replace(plant, stiffness=plant.stiffness + stiffness * np.outer(handle, handle))


def nyquist_spring(loop: Loop) -> float:
    """The operator's spring that puts a mode at the Nyquist frequency [N/m]; nan where no spring does.

        k = -1/G_hh(j pi/T),      G_hh the undamped compliance at the handle

    For a free mass m it is m (pi/T)^2. Colgate and Schenkel 1997 took it as the worst spring in their simulations
    (known at second hand, from the thesis's 1.1.3).
    """
    k = float(_spring_of(loop.plant, np.array([np.pi / loop.period]))[0])
    return k if k >= 0.0 else float("nan")


def spring_stable_region(loop: Loop) -> Region:
    """The walls that are stable with every spring 0 <= k <= inf at the handle.

    The intersection of the charts of many springs. Walls on its edge are then tried with more springs, by
    eigenvalues, and the worst of these join until none makes an edge wall unstable. Among them are springs whose
    mode looks, sampled, like the vibration at the edge: they are the worst, and the sharper the stiffer. Edges are
    known to about 0.1 % of the set's size so, on the unsafe side.
    """
    loop = Loop(reached(loop.plant), loop.controller)
    tried = _springs(loop, TRIED)
    new = _springs(loop, SPRINGS)
    shape: Any = None
    for _ in range(ROUNDS):
        for k in new:
            chart = _stable_set(loop, k)
            if chart is not None:
                shape = chart if shape is None else shape.intersection(chart)
            if shape is not None and not rings_of(shape):
                return empty(NOTHING)
        if shape is None:
            return empty(NOTHING)
        new = _worst(loop, rings_of(shape), tried)
        if not len(new):
            break
        tried = np.union1d(tried, new)
    rings = rings_of(shape)
    K, B = stiffest_corner(rings)
    if not K > 0.0:
        return Region(rings, float("nan"), float("nan"), NO_SPRING)
    return Region(rings, K, B)


def _handle(plant: Plant) -> Floats:
    if plant.handle is None:
        raise ValueError("the plant has no handle for a spring to act at")
    return plant.handle


def _spring_of(plant: Plant, frequency: Floats) -> Floats:
    """The spring at the handle that puts an undamped mode at frequencies (k,) [rad/s]; negative: none does."""
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    share = (shapes.T @ _handle(plant)) ** 2
    with np.errstate(divide="ignore"):
        compliance = np.sum(share / (squared - np.asarray(frequency)[:, None] ** 2), axis=-1)
        return np.asarray(-1.0 / compliance)


def _springs(loop: Loop, count: int) -> Floats:
    """Ascending springs from 0 to inf, spread by the frequency of the mode that each makes."""
    nyquist = np.pi / loop.period
    frequency = np.concatenate([np.geomspace(1e-3, 0.5, count // 3), np.linspace(0.5, BEYOND, count)]) * nyquist
    k = _spring_of(loop.plant, np.concatenate([frequency, nyquist * np.arange(1.0, BEYOND + 1.0)]))
    return np.unique(np.concatenate([[0.0], k[np.isfinite(k) & (k > 0.0)], [np.inf]]))


def _sprung(loop: Loop, stiffness: float) -> Loop | None:
    """The loop with a spring at the handle; None where the wall then moves nothing, which is stable."""
    plant = with_spring(loop.plant, stiffness)
    if plant.size == 0:
        return None
    found = Loop(plant, loop.controller)
    try:
        return found if len(found.sections.rows) else None
    except UnmovedError:
        return None


def _stable_set(loop: Loop, stiffness: float) -> Any:
    """The stable walls with one spring as a shapely geometry; None where every wall is stable."""
    found = _sprung(loop, stiffness)
    if found is None:
        return None
    regions = stability_chart(found, decay=False).regions
    return shapely.make_valid(shapely.union_all([shapely.Polygon(ring) for ring in regions]))


def _worst(loop: Loop, rings: tuple[Floats, ...], tried: Floats) -> Floats:
    """Springs that make edge walls most unstable, also between those tried (by a parabola); () if none does."""
    walls = np.vstack([_spread(ring) for ring in rings])
    growth, springs, vibration = _growth(loop, tried, walls)
    theta = vibration[np.argmax(growth, axis=0), np.arange(len(walls))][:: max(len(walls) // 8, 1)]
    like = _alike(loop, theta)
    more, others, _ = _growth(loop, like, walls)
    order = np.argsort(np.concatenate([springs, others]))
    growth, springs = np.vstack([growth, more])[order], np.concatenate([springs, others])[order]
    found = set()
    for wall, i in enumerate(np.argmax(growth, axis=0)):
        if growth[i, wall] > OUTSIDE:
            near = slice(max(i - 1, 0), i + 2)
            found |= {float(springs[i]), _between(springs[near], growth[near, wall])}
    return np.array(sorted(found))


def _growth(loop: Loop, stiffness: Floats, walls: Floats) -> tuple[Floats, Floats, Floats]:
    """Spectral radius minus 1 (springs, walls), the springs that leave something to move, and the angles of the
    dominant roots (springs, walls)."""
    loops = {float(k): found for k in stiffness if (found := _sprung(loop, k)) is not None}
    radius, angle = np.zeros((2, len(loops), len(walls)))
    for i, one in enumerate(loops.values()):
        z = np.linalg.eigvals(one.transition_matrix(*walls.T))
        top = np.take_along_axis(z, np.abs(z).argmax(axis=-1)[:, None], axis=-1)[:, 0]
        radius[i], angle[i] = np.abs(top) - 1.0, np.abs(np.angle(top))
    return radius, np.array(list(loops)), angle


def _alike(loop: Loop, theta: Floats) -> Floats:
    """Springs whose mode has an alias at, or just beside, the angles theta (k,)."""
    turns = 2.0 * np.pi * np.arange(ALIASES + 1)
    w = np.concatenate([(turns[:, None] + theta).ravel(), (turns[1:, None] - theta).ravel()])
    k = _spring_of(loop.plant, (w[:, None] * (1.0 + BESIDE)).ravel() / loop.period)
    return np.unique(k[np.isfinite(k) & (k > 0.0)])


def _spread(ring: Floats) -> Floats:
    """Corners of a ring spread evenly along it, the stiffest among them (k, 2)."""
    size = np.maximum(np.ptp(ring, axis=0), 1e-300)
    along = np.append(0.0, np.cumsum(np.hypot(*(np.diff(ring, axis=0) / size).T)))
    picked = np.searchsorted(along, np.linspace(0.0, along[-1], WALLS, endpoint=False))
    return np.asarray(ring[np.union1d(picked, [np.argmax(ring[:, 0])])])


def _between(springs: Floats, growth: Floats) -> float:
    """Where the parabola through three springs is highest; the best of them where there is none."""
    best = float(springs[np.argmax(growth)])
    if len(springs) < 3 or not np.isfinite(springs).all():
        return best
    bend, slope, _ = np.polyfit((springs - springs[1]) / np.ptp(springs), growth, 2)
    at = springs[1] - slope / (2.0 * bend) * np.ptp(springs) if bend < 0.0 else np.nan
    return float(at) if springs[0] < at < springs[2] else best


def nyquist_region(loop: Loop) -> Region:
    """The walls that are stable with the Nyquist spring alone; empty, with a reason, where there is none."""
    k = nyquist_spring(loop)
    if not np.isfinite(k):
        return empty("no spring at the handle puts a mode at the Nyquist frequency")
    shape = _stable_set(Loop(reached(loop.plant), loop.controller), k)
    rings = () if shape is None else rings_of(shape)
    if not rings:
        return empty(f"nothing is stable with the Nyquist spring of {k:.6g} N/m")
    K, B = stiffest_corner(rings)
    return Region(rings, K, B, None if K > 0.0 else NO_NYQUIST)
