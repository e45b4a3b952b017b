"""A stability boundary measured on the virtual device, the way it is measured on a real one (thesis, 3.2.2, 3.3).

For each stiffness the device is disturbed and watched, and the damping is bisected between a wall that was stable
and one that was not: a lower and an upper edge. Near the tip it is the stiffness that is bisected, for chosen
dampings.

Where to look is found in the same way. Walls on a raster of powers of ten are tried, coarsely, on what is linear
of the device under a two-sided wall; the largest connected patch of stable ones is the place. From inside it the
trial itself marches outwards in growing steps until something is unstable. So only the cell of stable walls that
begins at small stiffness is measured, and islands in it and tongues of it narrower than a step are missed.

Along lines through the plane of walls: outwards until the verdict changes, and to where it does.

One verdict beyond a nonlinear device's edge may be stable by chance, so a march from it ends anywhere. The way to
what was found is therefore looked at again, and the change nearest to the line's start counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats
from zwidth.chart.edge_crossings import EdgeKind
from zwidth.contact.stability_trial import LEVELS, Observation, StabilityTrial, observe
from zwidth.errors import ArgumentError, NoAnswerError
from zwidth.model.modes import least_deforming_motion
from zwidth.model.operator import attach
from zwidth.model.plant import Plant

Progress = Callable[[int, int], None]  # done, of how many

PER_DECADE: Final = 3  # of the raster
SOFTEST, LEAST_DAMPED = 1e-6, 1e-6  # of the raster, relative to its largest
COARSE: Final = 2  # looks at a wall while only the place is sought
COLUMNS: Final = 12  # dampings at which the raster's stiffness is measured
WORTH: Final = 0.2  # columns that reach less of the largest stiffness are left alone, but for those beside others
ZOOMS, ZOOMED = 4, 7  # rounds that close in on the tip, and dampings in each
FIRST_ZOOM: Final = 3e-4  # share of the stiffness to which the first round measures it
TIP_SHARE: Final = 0.93  # share of the largest stiffness from which on the tip is measured
HALVED: Final = 5  # times the start of a tip is lowered
ACCURACY: Final = 1e-4  # of the range of stable dampings, or of the stiffness


class SearchWindow(NamedTuple):
    """Walls to be searched: least and largest stiffness [N/m], and least and largest damping [N s/m]."""

    stiffness: tuple[float, float]
    damping: tuple[float, float]


@dataclass(frozen=True)
class StableExtent:
    """Where the stable walls are, as found by trying.

    stiffness, damping  of the tip, the stiffest wall found stable [N/m], [N s/m]
    largest_damping     the largest damping found stable [N s/m]
    bounded             False where no unstable stiffness was found above the tip
    """

    stiffness: float
    damping: float
    largest_damping: float
    bounded: bool


@dataclass(frozen=True)
class EdgePoint:
    """One point of the boundary, half way between the last stable wall and the first unstable one.

    edge                lower and upper: damping was bisected at this stiffness; tip: stiffness at this damping
    unstable_behaviour  what the device does at that first unstable wall; None: no unstable wall was found, and the
                        point has nan for what was bisected
    amplitude, frequency   of that [m], [Hz]
    unsure              of a nonlinear device: the verdict changes more than once along the line; this is the
                        change nearest to its start
    """

    stiffness: float
    damping: float
    edge: EdgeKind
    unstable_behaviour: str | None
    amplitude: float
    frequency: float
    unsure: bool = False


def find_stable_walls(
    trial: StabilityTrial, box: SearchWindow | None = None, progress: Progress | None = None
) -> StableExtent:
    """Find the range of stable walls.

    progress  called with the number of steps done, and of all six
    box     look here only; None: everywhere between millionths and all of what the device's mass allows
    Raises  NoAnswerError  where no stable wall with K > 0 is found
    """
    _check_window(box)
    tell = progress or (lambda done, of: None)
    tell(0, ZOOMS + 2)
    patch = _stable_patch(trial, box)
    tell(1, ZOOMS + 2)
    # a column: a damping, and the largest stable stiffness at it
    columns = _largest_stiffnesses_of_patch(trial, patch, box)
    tell(2, ZOOMS + 2)
    if not columns:
        raise NoAnswerError(_no_wall_message(box))
    reach = max(column.damping for column in columns)
    best = max(columns, key=lambda column: column.stiffness)
    within = _stiffness_range(box)
    # a raster of powers of ten may miss a peak between two of its dampings
    # 1.3: a little beyond the largest damping found; marches begin at half of what is found between the columns
    between = np.linspace(0.0, 1.3 * reach, COLUMNS + 1)[1:] if box is None else np.empty(0)
    tops = np.interp(between, [column.damping for column in columns], [column.stiffness for column in columns])
    more = _largest_stiffnesses(trial, between, 0.5 * tops, FIRST_ZOOM, within, levels=COARSE)
    columns = sorted({*columns, *(column for column in more if column.stiffness > 0.0)})
    reach = max(column.damping for column in columns)
    best = max(columns, key=lambda column: column.stiffness)
    best = _close_in_on_tip(trial, box, columns, best, tell)
    return StableExtent(best.stiffness, best.damping, reach, best.bounded)


def _close_in_on_tip(
    trial: StabilityTrial, box: SearchWindow | None, columns: list[_Column], best: _Column, tell: Progress
) -> _Column:
    """Close in on the tip, from the best of some columns, by rounds of dampings ever closer together.

    columns  by damping, best one of them; the list is changed
    tell     called with the number of steps done, and of all six
    Returns  the column of the tip; a best one above which nothing is unstable is taken for it at once
    Raises   NoAnswerError  where, seen for longer, none of the columns is stable
    """
    within = _stiffness_range(box)
    zoom = 0
    while zoom < ZOOMS and best.bounded:
        index = columns.index(best)
        low, high = columns[max(index - 1, 0)], columns[min(index + 1, len(columns) - 1)]
        between = np.linspace(low.damping, high.damping, ZOOMED + 2)[1:-1]  # both ends are known
        B = np.unique(np.append(between, best.damping))
        # from a little below all three; the first step of the march is to the best
        start = np.full(len(B), 0.9 * min(column.stiffness for column in (low, best, high)))
        # at a smooth peak, dampings four times as close differ by a sixteenth in stiffness
        tolerance = max(FIRST_ZOOM / 16.0**zoom, 0.01 * ACCURACY)
        fresh = [
            column
            for column in _largest_stiffnesses(trial, B, start, tolerance, within, best.stiffness - start)
            if column.stiffness > 0.0
        ]
        if not fresh:  # observed for longer than in the coarse search, nothing there is stable
            columns.remove(best)
            if not columns:
                raise NoAnswerError(_no_wall_message(box))
            best = max(columns, key=lambda column: column.stiffness)
            continue
        best = max(fresh, key=lambda column: column.stiffness)
        columns = sorted({low, *fresh, high})
        zoom += 1
        tell(zoom + 2, ZOOMS + 2)
    return best


class _Column(NamedTuple):
    """A damping [N s/m], the largest stable stiffness at it [N/m] (0: none), and whether an unstable was found."""

    damping: float
    stiffness: float
    bounded: bool


def _check_window(box: SearchWindow | None) -> None:
    """Raise ArgumentError for a search window with an empty or infinite range, or without a stiffness above 0."""
    if box is None:
        return
    for name, unit, span in zip(("stiffness", "damping"), ("N/m", "N s/m"), box, strict=True):
        if not all(map(isfinite, span)) or not span[0] < span[1]:
            raise ArgumentError(name, f"must be a range LOW < HIGH [{unit}], got {span[0]:g} to {span[1]:g}")
    if not box.stiffness[1] > 0.0:
        got = f"got {box.stiffness[0]:g} to {box.stiffness[1]:g}"
        raise ArgumentError("stiffness", f"must reach above 0 [N/m], {got}")


def _stiffness_range(box: SearchWindow | None) -> tuple[float, float]:
    """The softest and the stiffest wall to be tried [N/m]; 0 and inf for None."""
    return (0.0, np.inf) if box is None else (max(box.stiffness[0], 0.0), box.stiffness[1])


def _no_wall_message(box: SearchWindow | None) -> str:
    """Message: no stable wall was found in this search window, or anywhere for None."""
    where = (
        ""
        if box is None
        else (
            f" with stiffness from {box.stiffness[0]:g} to {box.stiffness[1]:g} N/m and damping from "
            f"{box.damping[0]:g} to {box.damping[1]:g} N s/m"
        )
    )
    return f"no stable wall was found{where}: the disturbed device did not come to rest inside any of those tried"


def _stable_patch(trial: StabilityTrial, box: SearchWindow | None) -> tuple[Floats, Floats, Flags]:
    """Try walls on a raster, on the linearised device, and find the largest connected patch of stable ones.

    Returns  stiffnesses (k,) [N/m] and dampings (b,) [N s/m] of the raster; which walls (k, b) are in the patch
    Raises   NoAnswerError  where none is stable
    """
    from scipy.ndimage import label

    if box is None:
        plant = trial.loop.plant if trial.hand.operator is None else attach(trial.loop.plant, trial.hand.operator)
        light, heavy = _sudden_and_steady_mass(plant)
        T = trial.loop.period
        # up to 4 m/T^2 and 4 m/T, where even a free mass m is unstable; down to a share of the lighter mass's
        K = _logarithmic_raster(4.0 * heavy / T**2, SOFTEST * light / heavy)
        B = _logarithmic_raster(4.0 * heavy / T, LEAST_DAMPED * light / heavy)
    else:
        # a raster even in the logarithm cannot begin at 0
        low = max(box.stiffness[0], 1e-3 * box.stiffness[1])
        K = np.geomspace(low, box.stiffness[1], 20)
        B = np.linspace(*box.damping, 24)
    walls = np.stack(np.meshgrid(K, B, indexing="ij"), axis=-1).reshape(-1, 2)
    # watched for longer as long as none of them comes to rest
    for levels in range(1, LEVELS + 1):
        stable = np.array([observation.stable for observation in observe(trial.linearised(), walls, levels)])
        if stable.any():
            break
    else:
        raise NoAnswerError(_no_wall_message(box))
    patch_numbers, _ = label(stable.reshape(len(K), len(B)))  # 0: unstable
    sizes = np.bincount(patch_numbers.ravel())[1:]
    return K, B, np.asarray(patch_numbers == 1 + int(np.argmax(sizes)))


def _logarithmic_raster(largest: float, least: float) -> Floats:
    """Values up to `largest`, evenly in the logarithm, PER_DECADE a decade, from its share `least` on."""
    count = int(np.ceil(-PER_DECADE * np.log10(least)))
    return np.asarray(largest * 10.0 ** (np.arange(-count, 1) / PER_DECADE))


def _sudden_and_steady_mass(plant: Plant) -> tuple[float, float]:
    """Mass that a sudden force at the wall accelerates, and the one that a steady force does [kg]."""
    inverse = np.linalg.inv(plant.mass)
    actuator, sensor, shape = plant.actuator, plant.sensor, least_deforming_motion(plant)
    # geometric mean of the masses felt at the actuator and at the sensor
    light = 1.0 / float(np.sqrt((actuator @ inverse @ actuator) * (sensor @ inverse @ sensor)))
    return light, max(float(shape @ plant.mass @ shape), light)


def _largest_stiffnesses_of_patch(
    trial: StabilityTrial, patch: tuple[Floats, Floats, Flags], box: SearchWindow | None
) -> list[_Column]:
    """The largest stable stiffness at up to COLUMNS of the patch's dampings, on the trial itself, coarsely.

    patch    as `_stable_patch` returns it
    Returns  columns by damping; a damping at which no start within the patch is stable has none
    """
    K, B, inside = patch
    # tops: stiffest wall of the patch at each damping
    tops = np.array([K[column].max(initial=0.0) for column in inside.T])
    worth = np.flatnonzero(tops > WORTH * tops.max())  # near enough to the tip; one more is taken on either side
    filled = np.flatnonzero(tops > 0.0)
    filled = filled[(filled >= worth[0] - 1) & (filled <= worth[-1] + 1)]
    some = filled[np.unique(np.linspace(0, len(filled) - 1, min(COLUMNS, len(filled))).astype(int))]
    top = np.array([K[np.flatnonzero(inside[:, b])[-1]] for b in some])
    least = np.array([K[np.flatnonzero(inside[:, b])[0]] for b in some])
    within = _stiffness_range(box)
    columns_by_number = dict[int, _Column]()
    # dampings whose first start was unstable are tried again from softer ones
    for start in (0.5 * top, 0.1 * top, least):
        lanes = [i for i in range(len(some)) if i not in columns_by_number]
        columns = _largest_stiffnesses(trial, B[some[lanes]], start[lanes], 0.05, within, levels=COARSE)
        for i, column in zip(lanes, columns, strict=True):
            if column.stiffness > 0.0:
                columns_by_number[i] = column
    return sorted(columns_by_number.values())


def _largest_stiffnesses(
    trial: StabilityTrial,
    B: Floats,
    start: Floats,
    tolerance: float,
    within: tuple[float, float],
    step: Floats | None = None,
    levels: int | None = None,
) -> list[_Column]:
    """The largest stable stiffness at dampings B (m,) [N s/m], from stiffnesses that should be stable.

    For a nonlinear device the lowest change of the verdict counts, whatever `levels` (see `observe`) says.

    start      (m,)  stiffnesses [N/m] where the march upwards begins
    tolerance  of the result, as a share of the start;   within  softest and stiffest wall to be tried [N/m]
    step       (m,)  the first of the march [N/m]; None: half the start
    Returns    a column for each damping; stiffness 0 where the start is unstable, or, of a nonlinear device, no
               stable wall is met on the way
    """
    least, most = within
    m = len(B)
    begins = np.array(
        [observation.stable for observation in observe(trial, np.column_stack([start, B]), levels)], dtype=bool
    )
    lines = SearchLines(np.column_stack([start, B]), np.tile([1.0, 0.0], (m, 1)))
    farthest = np.where(begins, np.minimum(most, 1e6 * start) - start, 0.0)
    brackets = march(trial, lines, 0.5 * start if step is None else step, np.maximum(farthest, 0.0), levels)
    brackets = bisect(trial, lines, brackets, tolerance * start, levels)
    brackets = Brackets(
        np.where(begins, start + brackets.stable, 0.0), start + brackets.unstable, brackets.observations
    )
    if not trial.linear:
        brackets, _ = _lowest_changes(trial, B, brackets, least, tolerance * np.minimum(start, brackets.stable))
    columns = zip(B.tolist(), brackets.stable.tolist(), np.isfinite(brackets.unstable).tolist(), strict=True)
    return [_Column(*column) for column in columns]


def _lowest_changes(
    trial: StabilityTrial, damping: Floats, brackets: Brackets, least: float, tolerance: Floats
) -> tuple[Brackets, Flags]:
    """Replace the stiffnesses found at dampings (m,) by lower ones, where the verdict changes below them already.

    brackets  along stiffness [N/m];   least  softest wall to be tried [N/m];   tolerance  (m,) [N/m]
    Returns  as `brackets` [N/m], stable 0 where no stable wall was met; and (m,) at which dampings the verdict
             changes below already
    """
    lines = stiffness_lines(damping, least)
    # as distances from the lines' start
    first = Brackets(brackets.stable - least, brackets.unstable - least, brackets.observations)
    lower = nearest_change(trial, lines, first, tolerance, start_stable=False)
    stable = np.where(lower.stable > 0.0, least + lower.stable, 0.0)
    unsure = lower.stable < first.stable
    return Brackets(stable, least + lower.unstable, lower.observations), unsure


def measure_edges(
    trial: StabilityTrial, stiffness: Floats, place: StableExtent, box: SearchWindow | None = None
) -> list[EdgePoint]:
    """Lower and upper edge at each stiffness (k,), from the damping of the tip outwards.

    Of a nonlinear device: the change of the verdict nearest to that damping.
    place    extent of the stable walls;   box  as in `find_stable_walls`
    Returns  lower edges first; a stiffness at which the tip's damping is not stable has none
    """
    k = len(stiffness)
    inside = np.full(k, place.damping)
    begins = np.array(
        [observation.stable for observation in observe(trial, np.column_stack([stiffness, inside]))], dtype=bool
    )
    stiffness, inside, k = stiffness[begins], inside[begins], int(begins.sum())
    if not k:
        return []
    starts = np.column_stack([np.tile(stiffness, 2), np.tile(inside, 2)])
    sign = np.repeat([-1.0, 1.0], k)
    lines = SearchLines(starts, np.column_stack([np.zeros(2 * k), sign]))
    # of steps: the damping of the tip or, where that is near 0, a share of the largest
    scale = max(abs(place.damping), 0.1 * abs(place.largest_damping))
    low, high = (-np.inf, np.inf) if box is None else box.damping
    farthest = np.where(sign < 0.0, starts[:, 1] - low, high - starts[:, 1])
    farthest = np.minimum(np.maximum(farthest, 0.0), 1e3 * scale)
    brackets = march(trial, lines, np.full(2 * k, 0.25 * scale), farthest)
    # roughly from edge to edge; `scale` for an edge that was not found
    width = np.nan_to_num(brackets.unstable, nan=scale).reshape(2, k).sum(axis=0)
    tolerance = np.tile(ACCURACY * width, 2)
    brackets = bisect(trial, lines, brackets, tolerance)
    unsure = np.zeros(2 * k, dtype=bool)
    if not trial.linear:
        nearer = nearest_change(trial, lines, brackets, tolerance, start_stable=True)
        unsure = (nearer.stable < brackets.stable) | stable_beyond(trial, lines, nearer.unstable)
        brackets = nearer
    middle = lines.at(0.5 * (brackets.stable + brackets.unstable))[:, 1]
    kinds: tuple[EdgeKind, EdgeKind] = ("lower", "upper")
    edges = [kind for kind in kinds for _ in range(k)]
    return [
        _edge_point(float(K), float(B), edge, observation, bool(doubt))
        for (K, _), B, edge, observation, doubt in zip(
            starts, middle, edges, brackets.observations, unsure, strict=True
        )
    ]


def measure_tips(
    trial: StabilityTrial, damping: Floats, place: StableExtent, box: SearchWindow | None = None
) -> list[EdgePoint]:
    """The largest stable stiffness at each damping (k,), from a stiffness somewhat below the tip's upwards.

    Of a nonlinear device: from a lower one where that is not stable, and the lowest change of the verdict.

    place  extent of the stable walls, by `find_stable_walls`;   box  as there
    Returns  a point for each damping at which the start is stable, its stiffness nan where no edge is found
    """
    least, most = _stiffness_range(box)
    # somewhat below the least stiffness that is measured; the first step of the march is to the tip's
    start = np.full(len(damping), (TIP_SHARE - 0.03) * place.stiffness)
    start = _stable_starts(trial, damping, start, least)
    B, start = damping[start > 0.0], start[start > 0.0]
    lines = SearchLines(np.column_stack([start, B]), np.tile([1.0, 0.0], (len(B), 1)))
    most = min(most, 1e3 * place.stiffness)
    brackets = march(trial, lines, (1.0 / (TIP_SHARE - 0.03) - 1.0) * start, np.maximum(most - start, 0.0))
    # 0.1: near the tip the edge in damping moves much more than the stiffness
    tolerance = np.full(len(B), 0.1 * ACCURACY * place.stiffness)
    brackets = bisect(trial, lines, brackets, tolerance)
    brackets = Brackets(start + brackets.stable, start + brackets.unstable, brackets.observations)
    unsure = np.zeros(len(B), dtype=bool)
    if not trial.linear:
        brackets, unsure = _lowest_changes(trial, B, brackets, least, tolerance)
        unsure |= stable_beyond(trial, stiffness_lines(B, least), brackets.unstable - least)
    middle = np.where(brackets.stable > 0.0, 0.5 * (brackets.stable + brackets.unstable), np.nan)
    ends = zip(middle.tolist(), B.tolist(), brackets.observations, unsure.tolist(), strict=True)
    return [
        _edge_point(K, b, "tip", observation if isfinite(K) else None, doubt) for K, b, observation, doubt in ends
    ]


def _stable_starts(trial: StabilityTrial, damping: Floats, start: Floats, least: float) -> Floats:
    """Stiffnesses (m,) from which to march at dampings (m,): those of `start`, or 0 where the wall is unstable.

    For a nonlinear device, unstable ones are first halved towards `least` [N/m], HALVED walls being tried in all.
    """
    start = start.copy()
    lanes = np.arange(len(damping))
    for _ in range(1 if trial.linear else HALVED):
        looks = observe(trial, np.column_stack([start[lanes], damping[lanes]]))
        lanes = lanes[[not observation.stable for observation in looks]]
        if not len(lanes):
            break
        start[lanes] = least + 0.5 * (start[lanes] - least)
    start[lanes] = 0.0
    return start


def _edge_point(
    K: float, B: float, edge: EdgeKind, observation: Observation | None, unsure: bool = False
) -> EdgePoint:
    """Point of the boundary at K [N/m], B [N s/m], with what its first unstable wall showed; None: it has none."""
    if observation is None:
        return EdgePoint(K, B, edge, None, float("nan"), float("nan"), unsure)
    return EdgePoint(K, B, edge, observation.behaviour, observation.amplitude, observation.frequency, unsure)


def tip_dampings(edges: list[EdgePoint], place: StableExtent, count: int) -> Floats:
    """Dampings at which to measure the tip: the tip's own, and others between the two edges just below it.

    edges  lower and upper ones, by `measure_edges`
    count  of dampings; only the tip's where one of the edges has no points
    """
    at = TIP_SHARE * place.stiffness
    ends = []
    for edge in ("lower", "upper"):
        points = [p for p in edges if p.edge == edge and isfinite(p.damping)]
        if not points:
            return np.array([place.damping])[:count]
        K, B = (np.array(values) for values in zip(*sorted((p.stiffness, p.damping) for p in points), strict=True))
        ends.append(float(np.interp(at, K, B)))
    spread = np.linspace(ends[0], ends[1], count + 1)[1:-1]  # none for a count of 1
    return np.asarray(np.sort(np.append(spread, place.damping)))


MARCHES: Final = 12  # steps outwards, each twice as long as the one before
# of the way to what was found: where it is looked at again
SHARES: Final = np.array([1 / 16, 1 / 8, 1 / 4, 3 / 8, 1 / 2, 5 / 8, 3 / 4, 7 / 8, 0.94, 0.98, 1.0])
LOWERED: Final = 4  # times a way without a stable wall is looked at again, further down
AFTER: Final = np.array([1.05, 1.2, 1.5])  # times the way to the first unstable wall: looked at beyond it


class SearchLines(NamedTuple):
    """m lines through the plane of walls: starts (m, 2) and directions outwards (m, 2), columns K and B.

    Directions have length 1 along K [N/m] or B [N s/m], the unit of distances along the line.
    """

    start: Floats
    outwards: Floats

    def at(self, distances: Floats) -> Floats:
        """Walls (m, 2), columns K [N/m] and B [N s/m], on the lines at distances (m,) from their starts."""
        return np.asarray(self.start + distances[:, None] * self.outwards)

    def only(self, lanes: Flags | NDArray[np.intp]) -> SearchLines:
        """Those of the lines that flags (m,) or indices choose."""
        return SearchLines(self.start[lanes], self.outwards[lanes])


class Brackets(NamedTuple):
    """Distances (m,) from each line's start: the outermost found stable, and the first found unstable (nan: none);
    and what was observed at the unstable one (None: there is none)."""

    stable: Floats
    unstable: Floats
    observations: list[Observation | None]


def march(
    trial: StabilityTrial, lines: SearchLines, step: Floats, farthest: Floats, levels: int | None = None
) -> Brackets:
    """Step outwards, twice as far each time, until a wall is unstable, or MARCHES steps are done; starts count as
    stable.

    step      (m,)  the first distance;   farthest (m,)  the largest;   levels  see `observe`
    """
    m = len(step)
    stable, unstable = np.zeros(m), np.full(m, np.nan)
    beyond: list[Observation | None] = [None] * m
    at = np.minimum(step, farthest)
    for _ in range(MARCHES):
        lanes = np.isnan(unstable) & (stable < farthest)
        if not lanes.any():
            break
        looks = observe(trial, lines.only(lanes).at(at[lanes]), levels)
        for i, observation in zip(np.flatnonzero(lanes), looks, strict=True):
            if observation.stable:
                stable[i] = at[i]
            else:
                unstable[i], beyond[i] = at[i], observation
        step = 2.0 * step
        at = np.minimum(stable + step, farthest)
    return Brackets(stable, unstable, beyond)


def bisect(
    trial: StabilityTrial, lines: SearchLines, brackets: Brackets, tolerance: Floats, levels: int | None = None
) -> Brackets:
    """Halve gaps, stable to unstable, to the tolerance (m,); lines without one stay. levels: as in `observe`."""
    stable, unstable, beyond = brackets.stable.copy(), brackets.unstable.copy(), list(brackets.observations)
    while True:
        # 1e-12: nearer than that there is hardly a number between
        lanes = unstable - stable > np.maximum(tolerance, 1e-12 * np.abs(unstable))
        if not lanes.any():
            return Brackets(stable, unstable, beyond)
        middle = 0.5 * (stable + unstable)
        looks = observe(trial, lines.only(lanes).at(middle[lanes]), levels)
        for i, observation in zip(np.flatnonzero(lanes), looks, strict=True):
            if observation.stable:
                stable[i] = middle[i]
            else:
                unstable[i], beyond[i] = middle[i], observation


def stiffness_lines(damping: Floats, least: float) -> SearchLines:
    """The lines of growing stiffness, from the softest wall that is looked at [N/m], at dampings (m,)."""
    m = len(damping)
    return SearchLines(np.column_stack([np.full(m, least), damping]), np.tile([1.0, 0.0], (m, 1)))


def nearest_change(
    trial: StabilityTrial, lines: SearchLines, brackets: Brackets, tolerance: Floats, *, start_stable: bool
) -> Brackets:
    """Move each bracket back to the first change of the verdict along its line, if there is one before it.

    Walls at SHARES of the distance to the bracket are tried; where none of them is stable, those at SHARES of the
    distance to the first of them, and so on, LOWERED times in all.

    brackets      along the lines, as `march` and `bisect` leave it;   tolerance  (m,)  of a change
    start_stable  True: each line's start is known to be stable; False: the first stable wall tried counts as start
    Returns       as `brackets`; stable 0 where no stable wall was met
    """
    stable, unstable, beyond = brackets.stable.copy(), brackets.unstable.copy(), list(brackets.observations)
    top, changed = brackets.stable.copy(), np.zeros(len(stable), dtype=bool)  # top: SHARES are of this
    lanes = np.flatnonzero(stable > 0.0)
    for _ in range(LOWERED):
        if not len(lanes):
            break
        distances = SHARES * top[lanes, None]
        again = lanes.repeat(len(SHARES))
        looks = observe(trial, lines.only(again).at(distances.ravel()))
        without_stable = []
        for n, i in enumerate(lanes):
            line_looks = looks[n * len(SHARES) : (n + 1) * len(SHARES)]
            stable_flags = [start_stable, *(observation.stable for observation in line_looks)]
            places = [0.0, *distances[n]]
            if not any(stable_flags):
                without_stable.append(i)
                top[i], stable[i] = distances[n, 0], 0.0
                continue
            # last place of the first unbroken run of stable ones
            first = stable_flags.index(True)
            onwards = stable_flags[first:]
            last = first + (onwards.index(False) if False in onwards else len(onwards)) - 1
            stable[i] = places[last]
            if last < len(line_looks):
                # places has the start in front, so that place last + 1 is observation `last`
                unstable[i], beyond[i], changed[i] = places[last + 1], line_looks[last], True
        lanes = np.array(without_stable, dtype=int)
    halved = bisect(trial, lines, Brackets(stable, np.where(changed, unstable, np.nan), beyond), tolerance)
    return Brackets(halved.stable, np.where(changed, halved.unstable, unstable), halved.observations)


def stable_beyond(trial: StabilityTrial, lines: SearchLines, unstable: Floats) -> Flags:
    """Which lines (m,) are stable again at AFTER times the distance (m,) to the first unstable wall.

    unstable  (m,)  that distance; nan, where no wall is unstable, gives False
    """
    known = np.flatnonzero(np.isfinite(unstable))
    again = np.zeros(len(unstable), dtype=bool)
    distances = np.outer(unstable[known], AFTER)
    looks = observe(trial, lines.only(known.repeat(len(AFTER))).at(distances.ravel()))
    again[known] = (
        np.array([observation.stable for observation in looks], dtype=bool).reshape(distances.shape).any(axis=1)
    )
    return again
