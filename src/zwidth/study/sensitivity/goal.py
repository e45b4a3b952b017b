"""What each number of a device would have to be for its largest stiffness to reach a goal.

    K_max(p) = goal,     p alone changed, the value nearest to its own in |ln(p / p0)|

No derivative is followed: the largest stiffness bends and jumps where another part of the edge takes over. It is
computed for values spread evenly in ln p to both sides, for all numbers at once; the nearest interval in which it
passes the goal is then divided until its ends agree.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from zwidth.device.device import Device
from zwidth.device.faults import KeyPath, dotted
from zwidth.device.load import device_of_point
from zwidth.device.schema.device_file import mirror_image
from zwidth.loop.operating_point import OperatingPoint
from zwidth.progress import Progress
from zwidth.result import Result
from zwidth.study.designs.built_designs import build_at_point
from zwidth.study.designs.design_groups import DesignColumn, DesignGrouping
from zwidth.study.sensitivity.number_text import number_obstacle, number_unit
from zwidth.study.sensitivity.sensitivities import varied_numbers

Floats = NDArray[np.float64]
Status = Literal["reached", "jumps over it", "out of range", "no influence", "cannot be varied"]

FACTOR: Final = 10.0  # by which a number is changed at most, up and down
NEAR: Final = 2.0  # factor within which all numbers are tried first
STEPS: Final = 24  # values on each side
PARTS: Final = 9  # into which an interval is divided in each round
ROUNDS: Final = 10  # of dividing: 10^(1/24) shrinks to 3e-11
AGREES: Final = 1e-6  # relative, by which the stiffness found may miss the goal; beyond, it jumps there
UNMOVED: Final = 1e-9  # relative change of the largest stiffness that is none


@dataclass(frozen=True)
class GoalNumber:
    """One number, and what it would have to be.

    path, unit    as in `Sensitivity`;   value  what it is
    wanted        the value that reaches the goal, or comes nearest to it within the range; nan where none is known
    stiffness_max  of the device with it [N/m]
    status, reason  whether the goal is reached, and in words why not
    """

    path: str
    value: float
    unit: str
    wanted: float
    stiffness_max: float
    status: Status
    reason: str = ""


@dataclass(frozen=True, repr=False)
class Goal(Result):
    """What each number would have to be, those that reach the goal by the smallest change first.

    stiffness  the goal [N/m];   now  the largest stiffness as it is [N/m]
    """

    stiffness: float
    now: float
    numbers: tuple[GoalNumber, ...]

    def document(self) -> dict[str, Any]:
        """The numbers by key and unit."""
        columns = self.table()
        rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        return {"goal_N_per_m": self.stiffness, "stiffness_max_N_per_m": self.now, "goal": rows}

    def table(self) -> dict[str, list[Any]]:
        """One number a row."""
        return {
            "path": [one.path for one in self.numbers],
            "value": [one.wanted for one in self.numbers],
            "factor": [one.wanted / one.value if one.value else nan for one in self.numbers],
            "unit": [one.unit or None for one in self.numbers],
            "stiffness_max_N_per_m": [one.stiffness_max for one in self.numbers],
            "status": [one.status for one in self.numbers],
            "reason": [one.reason or None for one in self.numbers],
        }

    def __repr__(self) -> str:
        reached = [one for one in self.numbers if one.status == "reached"]
        lines = [f"Goal: {self.stiffness:.6g} N/m, from {self.now:.6g} N/m; {len(reached)} numbers reach it alone"]
        return "\n".join(
            [*lines, *(f"  {one.path} = {one.wanted:.6g} {one.unit}".rstrip() for one in reached[:3])]
        )


def numbers_for_goal(
    device: Device, point: OperatingPoint | None, goal: float, progress: Progress | None = None
) -> Goal:
    """The value of each number, alone changed, at which the largest stiffness is the goal.

    point     as of `sensitivities`
    goal      [N/m], positive; below the present largest stiffness it says how far a number may go
    progress  called with "goal", rounds done, and rounds of all
    Raises    ValueError  for a goal that is not positive and finite, and for a measured response, whose numbers
                          are not varied; what `Device.at` raises
    """
    if not (isfinite(goal) and goal > 0.0):
        raise ValueError(f"goal must be a stiffness above 0 N/m, got {goal:g}")
    where = point or device.at()
    if where.response is not None:
        raise ValueError("what each number would have to be is computed for a device's model, not for a response")
    device = device_of_point(device, where)
    search = _Search(device, where, goal, {})
    search.add([(None, 0.0)])
    now = search.known[None, 0.0]
    numbers = [(path, steps, value) for path, steps, value in varied_numbers(device.document)]
    free = {steps: value for _, steps, value in numbers if value != 0.0 and not number_obstacle(steps, value)}
    grid = np.log(FACTOR) * np.arange(-STEPS, STEPS + 1) / STEPS
    near = grid[np.abs(grid) <= np.log(NEAR)]
    search.add((steps, value * np.exp(x)) for steps, value in free.items() for x in near if x != 0.0)
    intervals = {steps: _nearest(search, steps, value, near, now) for steps, value in free.items()}
    far = {steps: free[steps] for steps, ends in intervals.items() if ends is None}
    search.add((steps, value * np.exp(x)) for steps, value in far.items() for x in grid if x != 0.0)
    intervals |= {steps: _nearest(search, steps, value, grid, now) for steps, value in far.items()}
    for done in range(ROUNDS):
        if progress is not None:
            progress("goal", done, ROUNDS)
        inner = {steps: np.linspace(*ends, PARTS + 1) for steps, ends in intervals.items() if ends is not None}
        search.add((steps, free[steps] * np.exp(x)) for steps, xs in inner.items() for x in xs[1:-1])
        for steps, xs in inner.items():
            intervals[steps] = _nearest(search, steps, free[steps], xs, now)
    found = [
        _number(search, path, steps, value, intervals.get(steps), now, grid) for path, steps, value in numbers
    ]
    return Goal(goal, now, tuple(sorted(found, key=_rank)))


def _nearest(
    search: _Search, steps: KeyPath, value: float, grid: Floats, now: float
) -> tuple[float, float] | None:
    """The interval of ln p / p0 nearest to 0 at whose ends the stiffness is on both sides of the goal."""
    K = np.array([now if x == 0.0 else search.known[steps, value * np.exp(x)] for x in grid])
    with np.errstate(invalid="ignore"):
        passed = np.flatnonzero((K[:-1] - search.goal) * (K[1:] - search.goal) <= 0.0)
    if not len(passed):
        return None
    nearest = min(passed, key=lambda k: min(abs(grid[k]), abs(grid[k + 1])))
    return float(grid[nearest]), float(grid[nearest + 1])


def _number(
    search: _Search,
    path: str,
    steps: KeyPath,
    value: float,
    ends: tuple[float, float] | None,
    now: float,
    grid: Floats,
) -> GoalNumber:
    """What was found for one number."""
    unit, obstacle = number_unit(steps), number_obstacle(steps, value)
    if obstacle or value == 0.0:
        return GoalNumber(path, value, unit, nan, nan, "cannot be varied", obstacle or "0 has no multiples")
    if ends is None:
        known = {x: now if x == 0.0 else search.known[steps, value * np.exp(x)] for x in grid}
        tried = {x: K for x, K in known.items() if isfinite(K)}
        if max(abs(K - now) for K in tried.values()) <= UNMOVED * abs(now):
            return GoalNumber(path, value, unit, nan, nan, "no influence", "it has no influence")
        best = min(tried, key=lambda x: (abs(tried[x] - search.goal), abs(x)))
        reason = f"not from a tenth to ten times its value; at best {tried[best]:.4g} N/m"
        return GoalNumber(path, value, unit, value * float(np.exp(best)), tried[best], "out of range", reason)
    at = {x: now if x == 0.0 else search.known[steps, value * np.exp(x)] for x in ends}
    x = min(at, key=lambda end: abs(at[end] - search.goal))
    if abs(at[x] - search.goal) <= AGREES * search.goal:
        return GoalNumber(path, value, unit, value * float(np.exp(x)), at[x], "reached")
    low, high = sorted(at.values())
    reason = f"the largest stiffness jumps there, from {low:.4g} to {high:.4g} N/m"
    return GoalNumber(path, value, unit, value * float(np.exp(x)), at[x], "jumps over it", reason)


def _rank(one: GoalNumber) -> tuple[int, float]:
    order = ("reached", "jumps over it", "out of range", "no influence", "cannot be varied")
    change = abs(np.log(one.wanted / one.value)) if isfinite(one.wanted) and one.value else np.inf
    return order.index(one.status), float(change)


@dataclass(frozen=True)
class _Search:
    """Largest stiffness of the device with one number changed, kept by path and value; nan where there is none.

    known  (steps, value) -> K_max [N/m]; (None, 0.0) for the device as it is
    """

    device: Device
    point: OperatingPoint
    goal: float
    known: dict[tuple[KeyPath | None, float], float]

    def add(self, wanted: Iterable[tuple[KeyPath | None, float]]) -> None:
        """Compute devices together, those that cannot be built so alone."""
        new = [key for key in dict.fromkeys(wanted) if key not in self.known]
        grouping = DesignGrouping(
            {key: part for key, part in self.device.document.items() if key != "sources"}, self.device.label, {}
        )
        for built in build_at_point(grouping.groups(list(self._columns(new))), self.point):
            stiffness = np.asarray(built.point.measure("stiffness_max").values, dtype=float)
            for row, K in zip(built.rows.tolist(), stiffness.tolist(), strict=True):
                self.known[new[row]] = K
        for key in new:
            if key not in self.known:
                self.known[key] = self._alone(*key)

    def _columns(self, keys: list[tuple[KeyPath | None, float]]) -> Iterable[DesignColumn]:
        """Each number that one of these changes, as it is but in the rows that change it."""
        values: dict[KeyPath, list[float]] = {}
        places: dict[KeyPath, NDArray[np.int64]] = {}
        for row, (steps, value) in enumerate(keys):
            for each in () if steps is None else (steps, mirror_image(steps)):
                if each is not None:
                    own = values.setdefault(each, [self._at(each)])
                    places.setdefault(each, np.zeros(len(keys), dtype=np.int64))[row] = len(own)
                    own.append(value)
        for each, own in values.items():
            yield DesignColumn(dotted(each, self.device.document), own, places[each])

    def _at(self, steps: KeyPath) -> float:
        place: Any = self.device.document
        for step in steps:
            place = place[step]
        return float(place)

    def _alone(self, steps: KeyPath | None, value: float) -> float:
        if steps is None:
            return self.point.chart(decay=False).stiffness_max
        changed: Mapping[str, float] = {
            dotted(each, self.device.document): value for each in (steps, mirror_image(steps)) if each is not None
        }
        try:
            return self.device.with_(changed).at_point(self.point).chart(decay=False).stiffness_max
        except (ValueError, ArithmeticError, np.linalg.LinAlgError):
            return nan
