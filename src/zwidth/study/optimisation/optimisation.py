"""`Optimisation`: the best designs found, beside the device as it is, and how they were found.

They form a front: designs of which none is better in every objective. Its designs are looked at again: on a finer
grid of the task, as produced within tolerances, and in nonlinear simulation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.chart.chart import largest_stiffness
from zwidth.device.faults import plural
from zwidth.device.load import from_document, with_operator
from zwidth.errors import DeviceError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import FAILED, OK, OUT_OF_TIME, STATUS, Note, WantedWall
from zwidth.result import Documented, Result, entry
from zwidth.study.designs.sampling import CIRCUMSTANCES, Axis
from zwidth.study.designs.study import Study
from zwidth.study.designs.task import Task, task_of
from zwidth.study.optimisation.evaluation import DesignJudgement, margins
from zwidth.study.optimisation.problem import Demand, Problem
from zwidth.study.optimisation.search import pieces, value_at, values_at
from zwidth.unit_text import unit_text

BEST_FOUND: Final = "best found"
NO_BETTER: Final = "no better design lies within the bounds"
NOT_PROVEN: Final = (
    "whether a better design than those tried lies within the bounds is not known; another seed or a larger "
    "budget may find one"
)
AT_BOUND: Final = 1e-6  # share of a range, or of a bound's size, within which a design lies at it
SHOWN: Final = 3  # designs of a repr
GIVEN_UP: Final = (FAILED, OUT_OF_TIME)


@dataclass(frozen=True)
class DemandRecord:
    """How a demand was kept.

    kept   share of all designs judged that keep it
    best   the value closest to keeping it, or that keeps it by most; nan where no design has one
    """

    demand: Demand
    kept: float
    best: float


@dataclass(frozen=True)
class NotJudged:
    """Designs tried that have no values for a reason that is none of their merits.

    status   FAILED or OUT_OF_TIME
    designs  their number
    reason   the commonest
    """

    status: int
    designs: int
    reason: str


@dataclass(frozen=True, repr=False)
class Optimisation(Result):
    """The best designs found of a study.

    The best of those that were tried: whether a better one lies within the bounds is not known, see `premises`.

    problem    what was optimised
    shares     (n, v)  of all designs judged, in their order
    judgement  of them
    front      (k,)  those that keep all demands and that no other design dominates, spread over the front, in the
               order of the first objective, best first
    baseline   the device as it is; None where it lacks a number that varies
    searched, polished  numbers of designs judged by each
    notes      column -> why designs have no value in it
    finer      the front on a finer grid of the task; None where there is none
    bars       what tolerances make of the front; None without any
    contacts   a wall of each design of the front in nonlinear simulation
    """

    problem: Problem
    shares: Floats
    judgement: DesignJudgement
    front: Ints
    baseline: DesignJudgement | None
    searched: int
    polished: int
    notes: Mapping[str, tuple[Note, ...]]
    finer: DesignJudgement | None = None
    bars: Bars | None = None
    contacts: tuple[Contact, ...] = ()

    def __repr__(self) -> str:
        label, tried = self.problem.study.device.label, plural(len(self.shares), "design")
        if not len(self.front):
            return f"Optimisation of {label!r}: {self.reason}"
        lines = [f"Optimisation of {label!r}: {plural(len(self.front), 'design')} on the front of {tried} tried"]
        for place in [] if self.knee is None else [self.knee]:
            said = ", ".join(
                f"{self.problem.columns[one.column].name} {self.values[place, one.column]:.6g}"
                for one in self.problem.objectives
            )
            lines.append(f"{self.word}: {said}")
        return "\n  ".join(lines)

    @property
    def study(self) -> Study:
        """Device, variables, task and circumstances."""
        return self.problem.study

    @cached_property
    def values(self) -> Floats:
        """Columns of the front's designs (k, c)."""
        return self.judgement.values[self.front]

    @property
    def word(self) -> str:
        """Name of the design at `knee` in texts: "best found" or "knee"."""
        return BEST_FOUND if len(self.problem.objectives) == 1 else "knee"

    @property
    def premises(self) -> tuple[Mapping[str, Any], ...]:
        """What the front rests on: `what`, `holds` (None: not known), `how` it was seen, `reason`. () where there
        is no front."""
        if not len(self.front):
            return ()
        return ({"what": NO_BETTER, "holds": None, "how": "not checked", "reason": NOT_PROVEN},)

    @cached_property
    def knee(self) -> int | None:
        """Place in the front of the design from which either objective gains little and the other loses much; with
        one objective the best found. None where no design keeps the demands."""
        if not len(self.front):
            return None
        return knee(self.judgement.costs(self.problem)[self.front])

    @property
    def reason(self) -> str | None:
        """Why there is no front: an objective without a value, or the demands that designs fail; or why the front
        tells nothing: an objective that is infinite in all of it. Else None."""
        for objective in self.problem.objectives:
            column = self.problem.columns[objective.column]
            if len(self.front) and np.isinf(self.values[:, objective.column]).all():
                return f"{column.name} is infinite, so that there is nothing to optimise; leave it out"
        if len(self.front):
            return None
        for objective in self.problem.objectives:
            column = self.problem.columns[objective.column]
            if not (self.judgement.status[:, objective.column] == OK).any():
                return self._with_cause(objective.column, f"{column.name} has no value in any design tried")
        records = sorted(self.demands, key=lambda one: one.kept)
        if not records:
            return "no design tried has a value in every objective"
        first = records[0]  # the demand that the fewest designs keep
        column = self.problem.columns[first.demand.column]
        if np.isnan(first.best):
            return self._with_cause(
                first.demand.column, f"no design tried keeps {first.demand.full_text}: it has no value"
            )
        if not first.kept:
            best = f"{first.best:.6g} {unit_text(column.unit)}".rstrip()
            return f"no design tried keeps {first.demand.full_text}, the best of {len(self.shares)} has {best}"
        each = "; ".join(f"{one.demand.full_text} is kept by {one.kept:.1%}" for one in records)
        return f"no design tried keeps all demands together: {each}"

    def _with_cause(self, column: int, sentence: str) -> str:
        """The sentence, with how many designs have which status in the column, and the first reason."""
        kinds, counts = np.unique(self.judgement.status[:, column], return_counts=True)
        why = "; ".join(f"{n} {STATUS[int(kind)]}" for kind, n in zip(kinds, counts, strict=True))
        notes = self.notes.get(self.problem.columns[column].name, ())
        said = f": {notes[0].reason}" if notes else ""
        return f"{sentence} ({why}{said})"

    @cached_property
    def demands(self) -> tuple[DemandRecord, ...]:
        """How each demand was kept, in the study's order."""
        records = []
        for demand in self.problem.demands:
            values = self.judgement.values[:, demand.column]
            with np.errstate(invalid="ignore"):
                kept = float((margins(values, demand.bound, demand.at_least) >= 0.0).mean())
            known = values[~np.isnan(values)]
            extreme = np.max if demand.at_least else np.min
            records.append(DemandRecord(demand, kept, float(extreme(known)) if len(known) else float("nan")))
        return tuple(records)

    @cached_property
    def not_judged(self) -> tuple[NotJudged, ...]:
        """Designs without a value in some column because they failed, and those because they ran out of time; they
        keep no demand on that column."""
        lost = []
        for status in GIVEN_UP:
            count = int((self.judgement.status == status).any(axis=1).sum())
            notes = [
                note for each in self.notes.values() for note in each if note.status == status and note.reason
            ]
            reason = max(notes, key=lambda note: note.count).reason if notes else ""
            lost += [NotJudged(status, count, reason)] if count else []
        return tuple(lost)

    def settings(self, place: int) -> dict[str, Any]:
        """Path -> value of each number and circumstance that a design of the front sets."""
        (values,) = values_at(self.problem.variables, self.shares[self.front[place], None])
        pairs = zip(self.problem.variables, values, strict=True)
        return {key: one for axis, value in pairs for key, (one,) in axis.columns([value])}

    def design(self, place: int) -> dict[str, Any]:
        """The `settings` of a design of the front, and the part that it takes of each catalogue."""
        (values,) = values_at(self.problem.variables, self.shares[self.front[place], None])
        pairs = zip(self.problem.variables, values, strict=True)
        return {axis.key: value for axis, value in pairs if axis.parts} | self.settings(place)

    def active(self, place: int) -> list[str]:
        """Which variables of a design of the front lie at a bound, or at an end of their list of numbers, and
        which demands it just keeps. Of a better design that was not found this says nothing."""
        held = []
        for axis, share in zip(self.problem.variables, self.shares[self.front[place]].tolist(), strict=True):
            held += _end_reached(axis, share)
        for demand in self.problem.demands:
            if margins(self.values[place, demand.column], demand.bound, demand.at_least) <= AT_BOUND:
                held.append(demand.text)
        return held

    def hypervolume(self, reference: Floats) -> float:
        """Volume that all designs dominate together up to a reference point of costs (m,)."""
        costs = self.judgement.costs(self.problem)
        kept = ~self.judgement.violations(self.problem).any(axis=1)
        return hypervolume(costs[kept], reference)

    def document(self) -> dict[str, Any]:
        """The front's designs by key, and how they were found."""
        names = [column.name for column in self.problem.columns]
        places = range(len(self.front))
        return {
            "objectives": {names[one.column]: one.goal for one in self.problem.objectives},
            "units": {column.name: column.unit or None for column in self.problem.columns},
            "variables": [
                {"key": axis.key, "unit": axis.unit or None}
                | ({"range": list(axis.span)} if axis.span is not None else {"values": list(axis.values)})
                for axis in self.problem.variables
            ],
            "designs": [self.design(place) for place in places],
            "values": [dict(zip(names, row, strict=True)) for row in self.values.tolist()],
            "status": [
                {name: STATUS[int(one)] for name, one in zip(names, row, strict=True)}
                for row in self.judgement.status[self.front]
            ],
            "knee": self.knee,
            "active": [self.active(place) for place in places],
            "premises": [dict(one) for one in self.premises],
            "baseline": None if self.baseline is None else self._baseline_document(names),
            "demands": self._demands_document(names),
            "not_judged": [
                {"status": STATUS[one.status], "designs": one.designs, "reason": one.reason or None}
                for one in self.not_judged
            ],
            "finer": None
            if self.finer is None
            else [dict(zip(names, row, strict=True)) for row in self.finer.values.tolist()],
            "produced": None if self.bars is None else self._bars_document(self.bars, names),
            "contacts": [one.document() for one in self.contacts],
            "searched": self.searched,
            "polished": self.polished,
            "budget": self.problem.budget,
            "seed": self.problem.seed,
        }

    def _baseline_document(self, names: list[str]) -> dict[str, Any]:
        """Values and status of the device as it is; `names` are those of the columns."""
        assert self.baseline is not None
        values, status = self.baseline.values[0].tolist(), self.baseline.status[0].tolist()
        return {
            "values": dict(zip(names, values, strict=True)),
            "status": {name: STATUS[one] for name, one in zip(names, status, strict=True)},
        }

    def _demands_document(self, names: list[str]) -> list[dict[str, Any]]:
        """Return by key each demand, the share of designs that keep it and the best value; `names` are those of
        the columns."""
        return [
            {
                "key": one.demand.key,
                "measure": names[one.demand.column],
                "at_least": one.demand.at_least,
                "bound": one.demand.bound,
                "kept_share": one.kept,
                "best": one.best,
            }
            for one in self.demands
        ]

    def _bars_document(self, bars: Bars, names: list[str]) -> list[dict[str, Any]]:
        """The bars of each design of the front by key; `names` are those of the columns."""
        return [
            {
                "devices": bars.devices,
                "kept_share": kept,
                "low": dict(zip(names, low, strict=True)),
                "high": dict(zip(names, high, strict=True)),
            }
            for kept, low, high in zip(bars.kept.tolist(), bars.low.tolist(), bars.high.tolist(), strict=True)
        ]

    def table(self) -> dict[str, list[Any]]:
        """The front's designs as columns, one design a row."""
        places = range(len(self.front))
        designs = [self.design(place) for place in places]
        settings = {path: [design[path] for design in designs] for path in (designs[0] if designs else {})}
        columns = {one.key: self.values[:, n].tolist() for n, one in enumerate(self.problem.columns)}
        held = ["; ".join(self.active(place)) for place in places]
        knee = [place == self.knee for place in places]
        return settings | columns | {"knee": knee, "active": held}


def _end_reached(axis: Axis, share: float) -> list[str]:
    """A sentence in a list: which end of its range, or of its listed numbers, a variable has at a share; []
    between them, or for what has no order or a single value.

    >>> _end_reached(Axis("a", (3.0, 1.0, 2.0)), 0.1), _end_reached(Axis("a", (), (0.0, 1.0)), 0.5)
    (['a at the largest of its values'], [])
    """
    many = pieces(axis)
    if axis.span is not None:
        # of whole numbers the share is in the middle of its piece
        if min(share, 1.0 - share) > (0.5 / many if many else 0.0) + AT_BOUND:
            return []
        return [f"{axis.key} at its {'upper' if share > 0.5 else 'lower'} bound"]
    if not axis.numeric or many < 2:
        return []
    value = value_at(axis, share)
    ends = {max(axis.values): "largest", min(axis.values): "smallest"}
    return [f"{axis.key} at the {ends[value]} of its values"] if value in ends else []


def undominated(costs: Floats) -> Ints:
    """Indices (k,) of the designs of which no other is as good in every objective and better in one, ascending; of
    equal ones the first.

    costs  (k, m)  less is better; a row with nan is left out

    >>> undominated(np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 3.0], [1.0, 3.0], [3.0, 1.0]])).tolist()
    [0, 1, 4]
    """
    known = np.flatnonzero(~np.isnan(costs).any(axis=1))
    if not len(known):
        return known
    _, first = np.unique(costs[known], axis=0, return_index=True)
    rows = known[np.sort(first)]
    # in order of a rising sum nothing later can dominate what is kept
    order = rows[np.argsort(costs[rows].sum(axis=1), kind="stable")]
    kept: list[int] = []
    for row in order.tolist():
        best = costs[kept]
        if not (best <= costs[row]).all(axis=1).any():
            kept.append(row)
    return np.array(sorted(kept), dtype=np.int64)


def ranges(costs: Floats) -> tuple[Floats, Floats]:
    """Best cost (m,) of each objective in a front of costs (k, m), and its range (m,) over it; 1 where that is
    0."""
    best, worst = costs.min(axis=0), costs.max(axis=0)
    return best, np.where(worst > best, worst - best, 1.0)


def knee(costs: Floats) -> int:
    """The design of a front that lies farthest below the plane through the front's ends.

    With each objective scaled from 0, its best in the front, to 1, its worst, the ends lie on the plane on which
    the scaled costs add up to 1, and the knee has the least sum (Das 1999, known at second hand).

    costs  (k, m)  of a front

    >>> knee(np.array([[0.0, 1.0], [0.2, 0.3], [1.0, 0.0]]))
    1
    """
    best, size = ranges(costs)
    return int(np.argmin(((costs - best) / size).sum(axis=1)))


def spread_out(costs: Floats, most: int) -> Ints:
    """Indices of at most so many designs of a front, spread over it: the best in each objective, the knee, then
    always the one farthest from those taken; in the order of the first objective. Fewer where all others equal
    some that are taken.

    costs  (k, m)  of a front
    """
    best, size = ranges(costs)
    scaled = (costs - best) / size
    taken = list(dict.fromkeys([*np.argmin(costs, axis=0).tolist(), knee(costs)]))[:most]
    distance = np.full(len(costs), np.inf)
    for row in taken:
        distance = np.minimum(distance, np.linalg.norm(scaled - scaled[row], axis=1))
    while len(taken) < min(most, len(costs)):
        row = int(np.argmax(distance))
        if not distance[row] > 0.0:
            break
        taken.append(row)
        distance = np.minimum(distance, np.linalg.norm(scaled - scaled[row], axis=1))
    rows = np.array(taken, dtype=np.int64)
    return rows[np.argsort(costs[rows, 0], kind="stable")]


def hypervolume(costs: Floats, reference: Floats) -> float:
    """Volume of what a front dominates, up to a reference point (m,) [product of the objectives' units].

    costs  (k, m)  less is better; designs beyond the reference add nothing

    >>> hypervolume(np.array([[1.0, 3.0], [2.0, 2.0]]), np.array([4.0, 4.0]))
    5.0
    """
    from pymoo.indicators.hv import HV

    inside = costs[(costs < reference).all(axis=1)]
    return float(HV(ref_point=reference)(inside)) if len(inside) else 0.0


FINER: Final = 2  # times as many steps between points, and directions
PRODUCED: Final = 64  # devices within the tolerances for the bars of each design
QUANTILES: Final = (0.05, 0.95)
SHARE: Final = 0.9  # of the largest stiffness: of the wall that is simulated


@dataclass(frozen=True)
class Contact(Documented):
    """A wall of a design, simulated with all its nonlinear parts where the design is worst.

    stiffness, damping  of the wall [N/m], [N s/m]
    stable     True, False, or None where the motion does not tell
    amplitude  of the vibration at the end [m]
    reason     why nothing was simulated; "" where it was
    """

    stiffness: float = field(default=float("nan"), metadata=entry("N/m"))
    damping: float = field(default=float("nan"), metadata=entry("N s/m"))
    stable: bool | None = field(default=None, metadata=entry())
    amplitude: float = field(default=float("nan"), metadata=entry("m"))
    reason: str = field(default="", metadata=entry(empty="null"))


@dataclass(frozen=True)
class Bars:
    """What tolerances make of k designs.

    low, high  (k, c)  of each column: 5 and 95 % of the produced devices that have a value lie below
    kept       (k,)    share of the produced devices that keep all demands, and have a value in every column
    devices    number of produced devices of each design
    """

    low: Floats
    high: Floats
    kept: Floats
    devices: int


def bars_of(problem: Problem, produced: Floats) -> Bars:
    """Bars of k designs from their columns (1 + devices, k, c), of which the first, the designs as they are, is
    left out."""
    drawn = produced[1:]
    kept = ~np.isnan(drawn).any(axis=-1)
    for demand in problem.demands:
        with np.errstate(invalid="ignore"):
            kept &= margins(drawn[..., demand.column], demand.bound, demand.at_least) >= 0.0
    low, high = np.full(drawn.shape[1:], np.nan), np.full(drawn.shape[1:], np.nan)
    known = ~np.isnan(drawn).all(axis=0)
    if known.any():
        low[known], high[known] = np.nanquantile(drawn[:, known], QUANTILES, axis=0)
    return Bars(low, high, kept.mean(axis=0), len(drawn))


def finer_problem(problem: Problem) -> Problem | None:
    """The problem on a finer grid of the task, which holds the points of the coarser; None without a task, or
    where its points and directions are all listed."""
    task = problem.study.task
    if task is None:
        return None
    finer = task_of(problem.study.document, problem.study.device, [], finer=FINER)
    if finer is None or _point_count(finer) == _point_count(task):
        return None
    return replace(problem, study=replace(problem.study, task=finer))


def _point_count(task: Task) -> int:
    """Number of points times directions of a task."""
    return (0 if task.positions is None else len(task.positions)) * (
        1 if task.directions is None else len(task.directions)
    )


def simulate_front_contact(problem: Problem, design: dict[str, Any], cells: Sequence[Any]) -> Contact:
    """Simulate a wall of a design where the first objective is worst.

    The wall is the study's wanted one, or, where it names none, one of 90 % of the largest stiffness there, at
    that wall's damping. Where nothing can be simulated the reason is returned.

    design  path -> value of each number and circumstance
    cells   (columns, w)  values at all points, member by member
    """
    try:
        point = worst_point(problem, design, cells)
        wall = _wall_to_simulate(problem.study.wall, point)
        if wall is None:
            return Contact(reason="no wall with K > 0 and B >= 0 is stable where it is worst")
        motion = point.simulate(stiffness=wall[0], damping=wall[1])
    except (DeviceError, ValueError) as error:
        return Contact(reason=str(error))
    return Contact(*wall, motion.stable, float(motion.amplitude))


def _wall_to_simulate(wanted: WantedWall, point: OperatingPoint) -> tuple[float, float] | None:
    """The wall to simulate, K [N/m] and B [N s/m]: see `simulate_front_contact`; None where none is stable."""
    if wanted.stiffness is not None and wanted.damping is not None:
        return wanted.stiffness, wanted.damping
    peak = largest_stiffness(point.loop)
    return None if peak is None else (SHARE * peak.stiffness, peak.damping)


def worst_point(problem: Problem, design: dict[str, Any], cells: Sequence[Any]) -> OperatingPoint:
    """The operating point at which the first objective is worst, held by whom it is worst with; arguments as for
    `simulate_front_contact`."""
    study, task, column = problem.study, problem.study.task, problem.objectives[0].column
    # (members, points) of the devices as they are, the first of each, not as they are produced
    values = np.asarray(cells[column]).reshape(len(problem.members), 1 + problem.drawn, -1)[:, 0]
    worst = np.nanargmin if problem.columns[column].measure.better == "higher" else np.nanargmax
    member, place = (int(n) for n in np.unravel_index(int(worst(values)), values.shape))
    chosen: dict[str, Any] = {key: getattr(study, key) for key in ("at", "direction", "assembly", "model")}
    chosen |= {key: value for key, value in (problem.members[member] | design).items() if key in CIRCUMSTANCES}
    if task is not None and task.positions is not None:
        directions = task.directions
        many = 1 if directions is None else len(directions)
        chosen["at"] = task.positions[place // many]  # all directions of a position lie side by side
        if directions is not None:
            chosen["direction"] = directions[place % many]
    device = study.device.with_({key: value for key, value in design.items() if key not in CIRCUMSTANCES})
    if "operator" in chosen:
        held = with_operator(device.document, study.operators[chosen["operator"]])
        device = from_document(held, device.label)
    return device.at(chosen["at"], chosen["direction"], assembly=chosen["assembly"], model=chosen["model"])
