"""What each number of a device would have to be, the others as they are, for a wanted largest stiffness.

    K_max(p) = goal,   the p nearest to the device's own, by |ln(p / own)|

K_max need not grow or fall with a number all the way: a stiffer drive may help and then harm. So a number is tried
outwards to both sides on a grid, to where there is no such device; the charts of all numbers together.
The crossing of the goal next to the device's own value is refined. Every value that is returned has been charted
exactly; a sensitivity, the slope at the device's own value, would only tell where to look.

`Goal` is the result; `ChangedStiffness` charts a device with one number changed, for many values at once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf, isfinite, isnan, log, nan
from typing import Any, Final, Literal

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart import largest_stiffness
from zwidth.chart.chart_batch import STIFFEST, chart_numbers
from zwidth.chart.edge_memory import DOUBTFUL
from zwidth.device import address
from zwidth.device.design_batch import takes_arrays
from zwidth.device.device import Device
from zwidth.device.faults import KeyPath, dotted, fail
from zwidth.device.load import device_of_point, from_document
from zwidth.device.numbers import number_limits, typical_size
from zwidth.device.schema.device_file import key_unit
from zwidth.errors import ChartError, DeviceError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind
from zwidth.progress import Progress
from zwidth.result import Documented, Result, entry, keys_of
from zwidth.study.designs.design_groups import DesignColumn, DesignGroup, DesignGrouping, build_at_point
from zwidth.study.sensitivity.result import number_obstacle
from zwidth.study.sensitivity.sensitivities import moved_places, property_numbers

WIDEST: Final = 10.0  # factor up and down within which a number is searched
STEPS: Final = 24  # values on each side
AT_A_TIME: Final = 8  # of them; most numbers cross the goal in the first, or never
EXACT: Final = 1e-8  # relative distance from the goal at which a value is taken
NARROW: Final = 1e-8  # of a bracket, in the variable below
JUMP: Final = 1e-3  # relative difference over a narrow bracket above which the largest stiffness jumps there
NARROWEST: Final = 1e-13  # of any bracket
NEAR_JUMP: Final = 1e-3  # distance from a jump within which rounding may decide on which side of it a value lies
STRAIGHT: Final = 20  # charts of a bracket after which it is halved only
ALIKE: Final = 1e-9  # relative differences of largest stiffnesses that are rounding
JUMPS: Final = "the largest stiffness jumps over the goal near this value"
NOWHERE: Final = "it does not change the largest stiffness"


@dataclass
class _Search:
    """The search along one number.

    value = own exp(t), or typical size times t where it is 0; t = 0 is the device itself.

    path, steps      of the number in the device file, as text and step by step
    own, size        its value in the device; |own|, or a typical size where that is 0
    lowest, highest  values that the schema allows
    samples  t -> ln(K_max / goal), -inf where no wall is stable, nan where there is no device
    jumps    brackets in which the goal is jumped over
    """

    path: str
    steps: KeyPath
    own: float
    size: float
    lowest: float
    highest: float
    samples: dict[float, float]
    jumps: set[tuple[float, float]] = field(default_factory=set)

    def value(self, t: float) -> float:
        """Value of the number at t."""
        return self.size * t if self.own == 0.0 else self.own * float(np.exp(t))

    def grid(self, first: int) -> Iterator[float]:
        """Yield the t of the next AT_A_TIME values outwards, to both sides, that the schema allows; none on a side
        on which there was no device farther in.

        first  number of values of each side that were tried before
        """
        for k in range(first + 1, first + AT_A_TIME + 1):
            away = log(WIDEST) * (k / STEPS) ** 2  # closer together near the device, where the nearest is sought
            if self.own == 0.0:
                away = WIDEST ** (3.0 * k / STEPS - 2.0)  # a hundredth to ten times the typical size
            for t in (away, -away):
                farthest = max((known for known in self.samples if known * t >= 0.0), key=abs)
                if isnan(self.samples[farthest]):
                    continue
                if self.lowest < self.value(t) < self.highest or self.value(t) in (self.lowest, self.highest):
                    yield t

    def brackets(self) -> list[tuple[float, float]]:
        """Neighbouring t (nearer, farther) between which the goal is crossed nearer than where it is reached
        already, the nearest first; none that are narrowed down to a jump."""
        reached, found = self.reached, []
        for side in (1.0, -1.0):
            known = sorted((t for t in self.samples if t * side >= 0.0), key=abs)
            for a, b in pairwise(known):
                crossed = self.samples[a] * self.samples[b] < 0.0 and min(map(self._error, (a, b))) > EXACT
                if crossed and (a, b) not in self.jumps and (reached is None or abs(a) < abs(reached)):
                    found.append((a, b))
        return sorted(found, key=lambda ends: (abs(ends[0]), abs(ends[1])))

    @property
    def reached(self) -> float | None:
        """The nearest t at which the goal is reached; None where none is known, or the number has no influence."""
        if self.alike:
            return None
        return min((t for t in self.samples if self._error(t) <= EXACT), key=abs, default=None)

    @property
    def alike(self) -> bool:
        """Whether the largest stiffness is the same at all t that are known."""
        known = [level for level in self.samples.values() if not isnan(level)]
        return all(level == known[0] or abs(level - known[0]) <= ALIKE for level in known)

    def jumps_between(self, a: float, b: float) -> bool:
        """Whether a bracket holds a jump, and no place at which the goal is reached."""
        width = abs(b - a) / max(1.0, abs(a))
        return width <= NARROWEST or (width <= NARROW and not abs(self.samples[a] - self.samples[b]) < JUMP)

    def inside(self, a: float, b: float, tries: int) -> float:
        """The t to try next in a bracket a, b: where a straight line through its ends crosses 0, or in the middle,
        which is certain to narrow it: at every third of `tries`, and after STRAIGHT."""
        at_a, at_b = self.samples[a], self.samples[b]
        if not isfinite(at_a * at_b) or tries % 3 == 2 or tries > STRAIGHT:
            return 0.5 * (a + b)
        t = a - at_a * (b - a) / (at_b - at_a)
        inner = 1e-3 * abs(b - a)  # not at an end, which is known
        return min(max(t, min(a, b) + inner), max(a, b) - inner)

    def _error(self, t: float) -> float:
        """Relative distance of the largest stiffness at t from the goal, |ln(K_max / goal)|."""
        return abs(self.samples[t])


def numbers_for_goal(
    device: Device, point: OperatingPoint | None, goal_stiffness: float, progress: Progress | None = None
) -> Goal:
    """What each number that `sensitivities` knows would have to be for a largest stiffness.

    point           one posture and one direction; None: the device's reference. The handle stays there
    goal_stiffness  [N/m], above what the device has or below: then a number tells what it could be relaxed to
    progress        called with "numbers", those that are decided, and all of them

    A number is searched from a tenth of its value to ten times that, within the schema's limits; one that is 0 up
    to ten times a typical size. Beyond a value with which there is no such device nothing is tried. The crossing
    nearest to the device's own value is found unless two lie between neighbours of a grid of 24 values to each
    side. The largest stiffness with the value is the goal to 1e-8.

    Raises  TypeError    for a goal that is no number
            ValueError   for a goal that is not a positive finite number
            DeviceError  for a measured device, whose numbers are in its response
            what `sensitivities` raises for the device itself
    """
    check_kind("device", device, Device)
    if isinstance(goal_stiffness, bool) or not isinstance(goal_stiffness, int | float | np.number):
        raise TypeError(f"goal_stiffness must be a number [N/m], got {goal_stiffness!r}")
    goal = float(goal_stiffness)
    if not 0.0 < goal < inf:
        raise ValueError(f"goal_stiffness must be a positive, finite stiffness in N/m, got {goal:g}")
    at = point or device.at()
    device = device_of_point(device, at)
    if at.response is not None:
        raise fail(device.label, "response", "has no numbers to change; a goal is for a device given by a model")
    peak = largest_stiffness(at.loop)
    stiffness_now = 0.0 if peak is None else peak.stiffness
    searches, fixed = [], []
    for path, steps, value in property_numbers(device.document):
        if obstacle := number_obstacle(steps, value):
            reason = f"not varied: {obstacle}"
            fixed.append(GoalNumber(path, value, key_unit(steps), nan, nan, nan, OUT_OF_RANGE, reason))
        else:
            searches.append(_search(device, path, steps, value, stiffness_now, goal))
    charts = ChangedStiffness(
        device, at, {one.path: tuple(steps for steps, _ in moved_places(one.steps, 1.0)) for one in searches}
    )
    found = _search_all(searches, charts, goal, progress)
    numbers = sorted([*found, *fixed], key=lambda one: _rank(one, goal))
    return Goal(goal, stiffness_now, tuple(numbers)).about(at)


def _rank(number: GoalNumber, goal: float) -> tuple[int, float]:
    """Sorting key: status, then of numbers that reach the goal the smallest change, of others the nearest miss."""
    K = number.stiffness_max
    missed = abs(log(K / goal)) if K > 0.0 else inf
    return ORDER.index(number.status), number.distance if number.status == REACHED else missed


def _search(device: Device, path: str, steps: KeyPath, value: float, stiffness_now: float, goal: float) -> _Search:
    """The search for one number, within the limits that its schema allows; its only sample is the device as it is.

    path, steps, value   of the number in the device file
    stiffness_now, goal  largest stiffness of the device, and the one that is wanted [N/m]
    """
    (lowest, highest, excluded), _ = number_limits(device.document, steps)
    lowest = np.nextafter(lowest, inf) if "lowest" in excluded else lowest
    highest = np.nextafter(highest, -inf) if "highest" in excluded else highest
    size = abs(value) or typical_size(device.document, steps)
    return _Search(path, steps, value, size, float(lowest), float(highest), {0.0: _level(stiffness_now, goal)})


def _level(stiffness: float, goal: float) -> float:
    """ln(K / goal); -inf where no wall is stable (K = 0), nan where there is no device (K is nan)."""
    return log(stiffness / goal) if stiffness > 0.0 else -inf if stiffness == 0.0 else nan


def _search_all(
    searches: list[_Search], charts: ChangedStiffness, goal: float, progress: Progress | None
) -> list[GoalNumber]:
    """For each number the value with which the goal is reached, or why none is: values are tried outwards, a few
    at a time, and each bracket is narrowed before going on. A number that has reached the goal is not tried
    further out."""
    unfinished = searches
    for first in range(0, STEPS, AT_A_TIME):
        _chart_places([(one, t) for one in unfinished for t in one.grid(first)], charts, goal)
        tries = 0
        while crossed := [(one, ends[0]) for one in unfinished if (ends := one.brackets())]:
            for one, (a, b) in crossed:
                if one.jumps_between(a, b):
                    one.jumps.add((a, b))
            _chart_places(
                [(one, one.inside(*ends, tries)) for one, ends in crossed if ends not in one.jumps], charts, goal
            )
            tries += 1
        unfinished = [one for one in unfinished if one.reached is None]
        if progress is not None:
            done = len(searches) if first + AT_A_TIME >= STEPS else len(searches) - len(unfinished)
            progress("numbers", done, len(searches))
    return [_goal_number(one, charts, goal) for one in searches]


def _chart_places(places: list[tuple[_Search, float]], charts: ChangedStiffness, goal: float) -> None:
    """Chart the device at each place, a search and the t of its number, and keep ln(K_max / goal) as its
    sample."""
    K = charts.stiffnesses([(one.path, one.value(t)) for one, t in places])
    for (one, t), stiffness in zip(places, K.tolist(), strict=True):
        one.samples[t] = _level(stiffness, goal)


def _goal_number(one: _Search, charts: ChangedStiffness, goal: float) -> GoalNumber:
    """The result of a search: the value that reaches the goal; else the value that comes nearest to the goal, nan
    for a number without influence, and why none reaches it.

    charts  whose `refusals` say why there is no device with values further out
    """
    known = {t: level for t, level in one.samples.items() if isfinite(level)}
    best = one.reached
    status: Status = REACHED if best is not None else OUT_OF_RANGE
    reason = ""
    if best is None:
        if known and one.alike and len(one.samples) > 1:
            return GoalNumber(
                one.path,
                one.own,
                key_unit(one.steps),
                nan,
                nan,
                goal * float(np.exp(known[0.0])),
                NO_INFLUENCE,
                NOWHERE,
            )
        # not where rounding decides on which side of a jump a value lies
        edges = [end for bracket in one.jumps for end in bracket]
        clear = [t for t in known if t == 0.0 or all(abs(t - end) > NEAR_JUMP for end in edges)]
        best = min(clear, key=lambda t: (abs(known[t]), abs(t)), default=0.0)
        ends = sorted(one.value(t) for t, level in one.samples.items() if not isnan(level))
        refused = charts.refusals.get(one.path, "")
        reason = JUMPS if one.jumps else f"from {ends[0]:.4g} to {ends[-1]:.4g} it is not reached"
        reason += f"; beyond, {refused}" if refused and not one.jumps else ""
    value = one.value(best)
    factor = value / one.own if one.own else nan
    stiffness = goal * float(np.exp(one.samples[best]))
    return GoalNumber(one.path, one.own, key_unit(one.steps), value, factor, stiffness, status, reason)


Status = Literal["reached", "out of range", "no influence"]
REACHED: Final = "reached"
OUT_OF_RANGE: Final = "out of range"
NO_INFLUENCE: Final = "no influence"
ORDER: Final = (REACHED, OUT_OF_RANGE, NO_INFLUENCE)


@dataclass(frozen=True)
class GoalNumber(Documented):
    """What one number would have to be.

    path           of the number in the device file; an element of a symmetric matrix moves with its mirror image
    now            its value in the device
    unit           as the schema names it; "" if it has none
    value          the value nearest to that with which the goal is reached; where it is out of range the one that
                   comes nearest to the goal; nan where the number has no influence, or cannot be varied
    factor         value over now; nan where that is 0, or where there is no value
    stiffness_max  largest stiffness with this value [N/m]
    status         "reached", "out of range" or "no influence"
    reason         what keeps the goal from being reached; "" where it is
    """

    path: str = field(metadata=entry())
    now: float = field(metadata=entry(name="value_now"))
    unit: str = field(metadata=entry(empty="null"))
    value: float = field(metadata=entry())
    factor: float = field(metadata=entry())
    stiffness_max: float = field(metadata=entry("N/m"))
    status: Status = field(metadata=entry())
    reason: str = field(default="", metadata=entry(empty="null"))

    @property
    def distance(self) -> float:
        """Size of the change, |ln factor|; inf where there is none."""
        return abs(log(self.factor)) if isfinite(self.factor) and self.factor > 0.0 else float("inf")


@dataclass(frozen=True, repr=False)
class Goal(Result):
    """What each number of a device would have to be, the others as they are, for a wanted largest stiffness.

    goal           the wanted largest stiffness [N/m]
    stiffness_max  that of the device as it is [N/m]; 0 where no wall with K > 0 and B >= 0 is stable
    numbers        those that reach it first, the smallest change before the others
    """

    goal: float = field(metadata=entry("N/m"))
    stiffness_max: float = field(metadata=entry("N/m"))
    numbers: tuple[GoalNumber, ...] = field(metadata=entry(name="goal"))

    @property
    def reached(self) -> tuple[GoalNumber, ...]:
        """The numbers with which alone the goal can be reached."""
        return tuple(one for one in self.numbers if one.status == REACHED)

    def table(self) -> dict[str, list[Any]]:
        """The numbers as columns, one number a row."""
        rows = [one.document() for one in self.numbers]
        return {column: [row[column] for row in rows] for column in keys_of(GoalNumber)}

    def __repr__(self) -> str:
        first = ", ".join(f"{one.path} = {one.value:.4g}" for one in self.reached[:3])
        heading = f"Goal: a largest stiffness of {self.goal:.6g} N/m, now {self.stiffness_max:.6g} N/m"
        return f"{heading}\n  {first or 'no number reaches it alone'}"


Change = tuple[str, float]  # a number by its path, and the value that it gets


class ChangedStiffness:
    """Largest stiffnesses of a device at an operating point, with one number or another changed.

    places    the steps of each number that may be changed, by its path, and of those that move with it
    refusals  path -> why the device cannot be built, or not charted, with the value that was tried last
    """

    def __init__(self, device: Device, point: OperatingPoint, places: Mapping[str, tuple[KeyPath, ...]]) -> None:
        self.device, self.point, self.places = device, point, places
        self.refusals: dict[str, str] = {}
        document = {key: part for key, part in device.document.items() if key != "sources"}
        self._grouping = DesignGrouping(document, device.label, {})

    def stiffnesses(self, changes: Sequence[Change]) -> Floats:
        """Largest stiffness (n,) [N/m] with each of n changes alone; 0 where no wall with K > 0, B >= 0 is stable,
        nan where there is no such device, or no chart of it. Of those that cannot be built together with others a
        number's are built in the order given, to either side of its own value up to the first that is none: to
        learn that a place is out of reach takes longest of all.
        """
        K = np.full(len(changes), np.nan)
        charted = np.zeros(len(changes), dtype=bool)
        together = [n for n, (path, _) in enumerate(changes) if all(map(takes_arrays, self.places[path]))]
        for built in build_at_point(self._groups([changes[n] for n in together]), self.point):
            if built.table is None:
                continue
            numbers = chart_numbers(built.table, STIFFEST)
            certain = numbers.status != DOUBTFUL
            rows = np.array(together, dtype=np.int64)[built.rows[certain]]
            K[rows] = np.nan_to_num(numbers.stiffness[certain])  # nan: no wall is stable
            charted[rows] = True
        ended = set[tuple[str, bool]]()  # numbers, and to which side of the device's own value there is none left
        for n in np.flatnonzero(~charted).tolist():
            path, value = changes[n]
            side = path, value > self._value_now(path)
            if side not in ended:
                K[n] = self._stiffness_alone(path, value)
                ended |= {side} if np.isnan(K[n]) else set()
        return K

    def _stiffness_alone(self, path: str, value: float) -> float:
        """The largest stiffness with one change [N/m], as `stiffnesses`; where it is nan, `refusals` say why."""
        document = self.device.document
        settings = [(dotted(steps, document), value) for steps in self.places[path]]
        try:
            changed = from_document(address.assign_all(document, settings), skip_assembly_check=True)
            peak = largest_stiffness(changed.at_point(self.point).loop)
        except DeviceError as error:
            self.refusals[path] = error.faults[0].message
        except (ValueError, ChartError, np.linalg.LinAlgError) as error:
            self.refusals[path] = str(error)
        else:
            return 0.0 if peak is None else peak.stiffness
        return np.nan

    def _groups(self, changes: Sequence[Change]) -> Iterator[DesignGroup]:
        """The changes as groups of designs that are charted together."""
        return self._grouping.groups(list(self._columns(changes))) if changes else iter(())

    def _columns(self, changes: Sequence[Change]) -> Iterator[DesignColumn]:
        """Each number that is changed, by its value in each row: the device's own unless the row changes it."""
        document = self.device.document
        for path in dict.fromkeys(path for path, _ in changes):
            rows = [n for n, (other, _) in enumerate(changes) if other == path]
            at = np.zeros(len(changes), dtype=np.int64)  # 0: the device's own value, the first of the column
            at[rows] = np.arange(1, len(rows) + 1)
            now = self._value_now(path)
            for steps in self.places[path]:
                yield DesignColumn(dotted(steps, document), [now, *(changes[n][1] for n in rows)], at)

    def _value_now(self, path: str) -> float:
        """The number's value in the device; 0 where the file leaves it out."""
        document = self.device.document
        return float(address.get(document, path)) if address.exists(document, path) else 0.0
