"""Walls that are stable with every spring at the handle, from a free hand to one that holds it fixed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from scipy.optimize import minimize_scalar

from zwidth.arrays import Floats
from zwidth.chart.arcs import Arc
from zwidth.chart.robust.common_edge import common_edge
from zwidth.chart.robust.members import Member, intersect_members, member_polygons
from zwidth.guarantees.envelope import EnvelopeCuts
from zwidth.guarantees.port import without_idle_motions
from zwidth.guarantees.region import Region, empty_region, polygon_rings, stiffest_corner
from zwidth.guarantees.spring_family import SpringFamily, polygons_of, spring_for, spring_handle
from zwidth.guarantees.stable_alone import stable_alone
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import check_kind
from zwidth.progress import Progress

# Number of springs charted first, spread by the frequency of the mode that each makes; and the highest of these
# frequencies over the Nyquist frequency.
SPRINGS, BEYOND = 27, 6.0
# Number of springs with which walls at the edge are tried; number of these walls; largest number of rounds in
# which springs that make such a wall unstable are charted, too.
TRIED, WALLS, ROUNDS = 90, 600, 10
# Springs whose mode has an alias at a vibration of the edge are tried, too: aliases up to so many times the
# sampling rate, modes this share of their frequency beside them, and vibrations of so many arcs at most.
ALIASES, BESIDE, VIBRATIONS = 2, np.array([-0.003, -0.0003, 0.0003, 0.003]), 12
# Number of springs whose modes are computed to find two modes of one alias; and the frequency of the stiffest
# one's mode over the Nyquist frequency.
MODES_AT, FARTHEST = 6000, 16.0
# Springs between a binding one and its neighbours are tried, too, at these shares of the way.
BETWEEN = np.arange(1, 6) / 6.0
# Each round takes the vibrations at other places of the arcs, by the golden section; the search ends after so many
# rounds in a row in which no spring fails.
GOLDEN, CLEAN = 0.6180339887, 2
# The spring that brings a root to -1 most easily is searched for between these shares of each multiple of the
# Nyquist frequency. A distance below DOUBLE times the lesser one at the ends means a mode without damping; FAR
# [N/m] stands for no root at -1 at all.
AROUND, DOUBLE, FAR = np.array([0.95, 1.05]), 1e-5, 1e200
# Distance inside the edge at which walls are tried, in shares of the set's size; and the largest number of springs
# that are added in a round.
INSIDE, JOINING = 1e-5, 12
# A cell smaller than this share of the whole is a remnant between two cut-off strips, and is dropped.
CRUMB = 1e-6
# Number of rounds after which a cell is dropped if none of its walls that were tried is stable with every spring.
LATE = 4
NOTHING = "no wall at all is stable with every spring at the handle"
NO_SPRING = "no wall with K > 0 and B >= 0 is stable with every spring at the handle"
UNSETTLED = "{} springs of those tried make walls just inside the edge unstable: modes are damped too lightly"
UNDAMPED = "this is undecided: nothing damps the mode that the Nyquist spring makes"
NO_NYQUIST = "no wall with K > 0 and B >= 0 is stable with the Nyquist spring"
Edge = list[tuple[float, Arc]]


def nyquist_spring(loop: Loop) -> float:
    """The operator's spring that puts a mode at the Nyquist frequency [N/m]; nan where no spring does.

        k = -1/G_hh(j pi/T),      G_hh the undamped compliance at the handle

    For a free mass m it is m (pi/T)^2. Colgate and Schenkel 1997 took it as the worst spring in their simulations
    (known at second hand, from the thesis's 1.1.3).
    """
    k = float(spring_for(loop.plant, np.array([np.pi / loop.period]))[0])
    return k if k >= 0.0 else float("nan")


def nyquist_region(loop: Loop) -> Region:
    """The walls that are stable with the Nyquist spring alone; empty, with a reason, where there is no such spring
    or wall, where the device by itself is unstable, or where nothing damps the mode."""
    if (alone := stable_alone(loop)).fails:
        return empty_region(alone.reason)
    k = nyquist_spring(loop)
    if not np.isfinite(k):
        return empty_region("no spring at the handle puts a mode at the Nyquist frequency")
    springs = SpringFamily.of(Loop(without_idle_motions(loop.plant), loop.controller))
    share, *beside = springs.shares(k * np.array([1.0, 0.9, 1.1])).tolist()
    # size of the open loop's characteristic polynomial at z = -1, with the Nyquist spring and one to either side
    sizes = [abs(float(t.line("minus")[0])) for one in (share, *beside) if (t := springs.tracer(one)) is not None]
    # a double root at -1 that takes long to chart: the polynomial there is as the square of the root's distance
    if sizes and sizes[0] < DOUBLE**2 * max(sizes):
        return empty_region(UNDAMPED)
    member = springs.member(share)
    rings = () if member is None else polygon_rings(member_polygons(member, springs.unit))
    if not rings:
        return empty_region(f"nothing is stable with the Nyquist spring of {k:.6g} N/m")
    return _region(rings, springs.unit, NO_NYQUIST)


def spring_stable_region(loop: Loop, progress: Progress | None = None) -> Region:
    """The walls that are stable with every spring 0 <= k <= inf at the handle.

    The charts of some springs are intersected, and what the springs between them sweep over is cut off along its
    envelope (see `envelope`). Walls 1e-5 of the set's size inside the edge are then tried with more springs, those
    among them whose mode looks, sampled, like the vibration at the edge; springs that fail are charted too, and
    their neighbours' sweep is cut off, until none fails CLEAN rounds in a row. The edge is known to about 1e-5 of
    the set's size, with light modes to 5e-5; where springs fail in the last of ROUNDS the region has a warning. It
    is empty, with a reason, where no wall is left or the device by itself is unstable.

    progress  called with "springs at the handle", the rounds that are done, and the most that there can be; fewer
              are usual
    Raises    ValueError  if the plant has no handle
              ChartError  if the chart of one of the springs cannot be closed

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> paddle = Plant(np.array([[0.03]]), np.array([[1.0]]), np.zeros((1, 1)), one, one, one)
    >>> region = spring_stable_region(Loop(paddle, Controller(sampling_period=0.001)))
    >>> 2000.0 < region.stiffness_max < 2400.0           # every passive operator: 2000 (2 b/T)
    True
    """
    check_kind("loop", loop, Loop)
    if (alone := stable_alone(loop)).fails:
        return empty_region(alone.reason)
    springs = SpringFamily.of(Loop(without_idle_motions(loop.plant), loop.controller))
    # springs to be charted, and those with which walls at the edge are tried
    new = _coarse_first(
        np.union1d(springs.shares(_spring_grid(springs.loop, SPRINGS)), _springs_of_alternating_root(springs))
    )
    tried = np.union1d(springs.shares(_spring_grid(springs.loop, TRIED)), _springs_of_one_alias(springs))
    members: dict[float, Member] = {}
    sweep = EnvelopeCuts(springs)
    clean = 0  # rounds in a row in which no spring failed
    for turn in range(ROUNDS):
        if progress is not None:
            progress("springs at the handle", turn, ROUNDS)
        left = _common_shape(springs, new, members)
        if left.is_empty:
            return empty_region(NOTHING)
        edge = _edge_of_common_set(springs, members)
        left = sweep.cut(left, edge, np.array(sorted(members)))
        tried = np.unique(
            np.concatenate(
                [
                    tried,
                    _springs_alike_at_edge(springs, edge, turn),
                    _springs_between(members, edge),
                    sweep.lost_shares,
                ]
            )
        )
        left, new = _cells_and_failing(springs, left, tried, late=turn >= LATE)
        if left.is_empty:
            return empty_region(NOTHING)
        clean = 0 if len(new) else clean + 1
        if clean == CLEAN:
            break
    region = _region(polygon_rings(left), springs.unit, NO_SPRING)
    return replace(region, warning=UNSETTLED.format(len(new))) if len(new) else region


def _region(rings: tuple[Floats, ...], unit: float, reason: str) -> Region:
    """Rings of walls [K unit, B] as a region; `reason` is why it is empty if it is."""
    walls = tuple(ring / (unit, 1.0) for ring in rings)
    K, B = stiffest_corner(walls)
    return Region(walls, K, B, None if K > 0.0 else reason)


def _spring_grid(loop: Loop, count: int) -> Floats:
    """Ascending springs (n,) [N/m] from 0 to inf, spread by the frequency of the mode that each makes: about
    `count` up to the frequency BEYOND, and more for slow modes."""
    nyquist = np.pi / loop.period
    frequency = np.concatenate([np.geomspace(1e-3, 0.5, count // 3), np.linspace(0.5, BEYOND, count)]) * nyquist
    # not at the multiples of Nyquist's: an undamped mode there is a double root at -1, whose chart takes long
    k = spring_for(loop.plant, np.concatenate([frequency * 0.9997, nyquist * np.arange(0.9999, BEYOND + 1.0)]))
    return np.unique(np.concatenate([[0.0], k[np.isfinite(k) & (k > 0.0)], [np.inf]]))


def _springs_of_alternating_root(springs: SpringFamily) -> Floats:
    """Shares of the springs with which the line of walls with a root at z = -1 is nearest to the wall K = B = 0.

    A root there is vibration that alternates from sample to sample, at the Nyquist frequency or a multiple. These
    lines, K + B w(-1) = -1/P(-1), are parallel: they have no envelope, but one of them binds, by
    `_stiffness_of_alternating_root`. It belongs to a mode near such a frequency; there is a share for each that
    has one.
    """
    nyquist = np.pi / springs.loop.period
    multiples = nyquist * np.arange(1.0, ALIASES + 2.0)
    shares = []
    around = springs.shares(spring_for(springs.loop.plant, np.outer(multiples, AROUND).ravel())).reshape(-1, 2)
    for ends in np.sort(around):
        if 0.0 < ends[0] < ends[1] < 1.0:
            best = minimize_scalar(
                lambda share: _stiffness_of_alternating_root(springs, float(share)),
                bounds=(ends[0], ends[1]),
                method="bounded",
                options={"xatol": 1e-9},
            )
            # the double root that an undamped mode has there takes long to chart, and its neighbours tell as much
            if best.fun > DOUBLE * min(_stiffness_of_alternating_root(springs, float(end)) for end in ends):
                shares.append(float(best.x))
    return np.array(shares)


def _stiffness_of_alternating_root(springs: SpringFamily, share: float) -> float:
    """Stiffness |1/P(-1)| of the undamped wall with a root at z = -1 [N/m], with the spring of a share; FAR where
    no wall has one."""
    tracer = springs.tracer(share)
    # a + s K + v B = 0 are the walls with that root
    a, s, _ = (1.0, 0.0, 0.0) if tracer is None else tracer.line("minus")
    return abs(float(a / s)) if s else FAR


def _coarse_first(shares: Floats) -> Floats:
    """The same shares, coarsely spread ones first, so that springs that leave no wall are charted early."""
    order: list[int] = []
    for step in 2 ** np.arange(6)[::-1]:
        order += [i for i in range(0, len(shares), int(step)) if i not in order]
    return np.asarray(shares[order])


def _common_shape(springs: SpringFamily, new: Floats, members: dict[float, Member]) -> shapely.Geometry:
    """The walls [K unit, B] inside the charts of all `members`, by share, and of springs of `new` shares (n,),
    which join the members until no wall is left; a spring with which every wall is stable does not join, nor one
    whose chart is lost in rounding."""
    unit = springs.unit
    left = None if not members else shapely.intersection_all([member_polygons(m, unit) for m in members.values()])
    for share in new.tolist():
        member = springs.member(share)
        if member is None:
            continue
        shape = member_polygons(member, unit)
        if shape.is_empty and left is not None:  # lost in rounding if no wall is certainly unstable: a double root
            middles = np.array([cell.representative_point().coords[0] for cell in polygons_of(left)])
            if not springs.unstable(middles, np.array([share])).any():
                continue
        members[share] = member
        left = shape if left is None else shapely.MultiPolygon(polygons_of(shapely.intersection(left, shape)))
        if left.is_empty:
            break
    return shapely.MultiPolygon() if left is None else left


def _edge_of_common_set(springs: SpringFamily, members: dict[float, Member]) -> Edge:
    """The edge of the common set, each arc with the share of its spring."""
    unit = springs.unit
    shares = {member.index: share for share, member in members.items()}
    shapes = {member.index: member_polygons(member, unit) for member in members.values()}
    left, cutters = intersect_members(list(members.values()), shapes, unit)
    arcs, _ = common_edge(left, cutters, unit)
    return [(shares[arc.member], arc) for arc in arcs]


def _cells_and_failing(
    springs: SpringFamily, left: shapely.Geometry, tried: Floats, late: bool
) -> tuple[shapely.MultiPolygon, Floats]:
    """Cells of a shape, without crumbs, and shares (n,) of the springs `tried` that make walls of theirs unstable:
    the worst of each run of neighbours, at most JOINING, none if all are stable.

    Walls just inside the edge of a cell and one in its middle stand for it. If it is late, cells of which none is
    stable with every spring tried are left out; before, all of the edge may be what a few springs cut off.
    """
    low, bottom, right, top = left.bounds
    depth = INSIDE * max(right - low, top - bottom)
    cells = [cell for cell in polygons_of(left) if cell.area > CRUMB * left.area]
    if not cells:
        return shapely.MultiPolygon(), np.zeros(0)
    walls = [_walls_to_try(cell, depth) for cell in cells]
    bad = np.split(
        springs.unstable(np.vstack(walls), tried), np.cumsum([len(some) for some in walls])[:-1], axis=1
    )
    # bad[k] (springs, walls of cell k); a cell is dropped where each of its walls fails with some spring
    stable_cells = [k for k in range(len(cells)) if not (late and bad[k].any(axis=0).all())]
    count = sum((bad[k].sum(axis=1) for k in stable_cells), np.zeros(len(tried), dtype=int))
    worst = [i for i in range(len(tried)) if count[i] and count[i] == count[max(i - 1, 0) : i + 2].max()]
    worst = sorted(worst, key=lambda i: -count[i])[:JOINING]
    return shapely.MultiPolygon([cells[k] for k in stable_cells]), np.asarray(tried[np.array(worst, dtype=int)])


def _walls_to_try(cell: shapely.Polygon, depth: float) -> Floats:
    """Walls (k, 2) of a cell [K unit, B]: one in its middle, then corners at a depth inside its edge."""
    inner = polygons_of(cell.buffer(-depth, join_style="mitre"))
    middle = np.array(cell.representative_point().coords)
    return np.vstack([middle, *(_spread_corners(np.asarray(part.exterior.coords)) for part in inner)])


def _spread_corners(ring: Floats) -> Floats:
    """Corners of a ring spread evenly along it, the stiffest among them (k, 2)."""
    size = np.maximum(np.ptp(ring, axis=0), 1e-300)
    along = np.append(0.0, np.cumsum(np.hypot(*(np.diff(ring, axis=0) / size).T)))
    corners = np.searchsorted(along, np.linspace(0.0, along[-1], WALLS, endpoint=False))
    return np.asarray(ring[np.union1d(corners, [np.argmax(ring[:, 0])])])


def _springs_between(members: dict[float, Member], edge: Edge) -> Floats:
    """Shares (n,) of springs between those whose arcs are the edge and their neighbours among the members."""
    shares = np.array(sorted(members))
    at = np.unique(np.searchsorted(shares, sorted({share for share, _ in edge})))
    first = np.unique(np.clip(np.concatenate([at - 1, at]), 0, len(shares) - 2))
    gaps = shares[first + 1] - shares[first]
    return np.asarray((shares[first, None] + gaps[:, None] * BETWEEN).ravel())


def _springs_alike_at_edge(springs: SpringFamily, edge: Edge, turn: int) -> Floats:
    """Shares (n,) of springs whose mode has an alias just beside vibrations at the edge, at other places of its
    arcs in each round, `turn`."""
    ends = np.array([(arc.start, arc.end) for _, arc in edge if arc.curved]).reshape(-1, 2)
    ends = ends[np.unique(np.linspace(0, len(ends) - 1, VIBRATIONS).astype(int))] if len(ends) else ends
    theta = ends[:, 0] + (0.5 + GOLDEN * turn) % 1.0 * (ends[:, 1] - ends[:, 0])
    turns = 2.0 * np.pi * np.arange(ALIASES + 1)
    w = np.concatenate([(turns[:, None] + theta).ravel(), (turns[1:, None] - theta).ravel()])
    k = spring_for(springs.loop.plant, (w[:, None] * (1.0 + BESIDE)).ravel() / springs.loop.period)
    return springs.shares(np.unique(k[np.isfinite(k) & (k > 0.0)]))


def _springs_of_one_alias(springs: SpringFamily) -> Floats:
    """Shares of springs with which two modes have all but one alias.

    Such modes, though far apart, exchange their damping: within a narrow band of springs one of them may lose it.
    """
    plant, T = springs.loop.plant, springs.loop.period
    # of two frequencies, since one may be of a mode of the free device, which takes no spring
    top = np.max(np.abs(spring_for(plant, np.pi / T * np.array([FARTHEST, FARTHEST + 0.1]))))
    if not 0.0 < top < np.inf:
        return np.zeros(0)
    k = np.geomspace(1e-9 * top, top, MODES_AT)
    root = np.linalg.inv(np.linalg.cholesky(plant.mass))
    handle = root @ spring_handle(plant)
    squared = np.linalg.eigvalsh(root @ plant.stiffness @ root.T + k[:, None, None] * np.outer(handle, handle))
    # angles w T of the modes (springs, modes), folded into [0, pi]; two meet where their difference changes sign
    alias = np.abs((np.sqrt(np.maximum(squared, 0.0)) * T + np.pi) % (2.0 * np.pi) - np.pi)
    first, second = np.triu_indices(alias.shape[1], 1)
    apart = alias[:, first] - alias[:, second]
    at, _ = np.nonzero(apart[1:] * apart[:-1] < 0.0)
    # a spring is as the square of its mode's frequency, of which BESIDE are shares
    return springs.shares(np.unique(k[at, None] * (1.0 + 2.0 * BESIDE)))
