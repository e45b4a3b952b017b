"""`Optimisation`: the best designs found, beside the device as it is, and how they were found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.device.faults import plural
from zwidth.measures.definition import FAILED, OK, OUT_OF_TIME, STATUS, Note
from zwidth.measures.unit_text import unit_text
from zwidth.result import Result
from zwidth.study.designs.sampling import Axis
from zwidth.study.designs.study import Study
from zwidth.study.optimise.evaluation import Judgement, margins
from zwidth.study.optimise.front import hypervolume, knee
from zwidth.study.optimise.problem import Demand, Problem
from zwidth.study.optimise.recheck import Bars, Contact
from zwidth.study.optimise.variables import pieces, value_at, values_at

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
    judgement: Judgement
    front: Ints
    baseline: Judgement | None
    searched: int
    polished: int
    notes: Mapping[str, tuple[Note, ...]]
    finer: Judgement | None = None
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
        """What the design at `knee` is called."""
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
        """Why there is no front: an objective without a value, or the demands that designs fail; None where there
        is one."""
        for objective in self.problem.objectives:
            column = self.problem.columns[objective.column]
            if len(self.front) and np.isinf(self.values[:, objective.column]).all():
                return f"{column.name} is infinite, so that there is nothing to optimise; leave it out"
        if len(self.front):
            return None
        for objective in self.problem.objectives:
            column = self.problem.columns[objective.column]
            if not (self.judgement.status[:, objective.column] == OK).any():
                return self._nowhere(objective.column, f"{column.name} has no value in any design tried")
        records = sorted(self.demands, key=lambda one: one.kept)
        if not records:
            return "no design tried has a value in every objective"
        first = records[0]
        column = self.problem.columns[first.demand.column]
        if np.isnan(first.best):
            return self._nowhere(
                first.demand.column, f"no design tried keeps {first.demand.full_text}: it has no value"
            )
        if not first.kept:
            best = f"{first.best:.6g} {unit_text(column.unit)}".rstrip()
            return f"no design tried keeps {first.demand.full_text}, the best of {len(self.shares)} has {best}"
        each = "; ".join(f"{one.demand.full_text} is kept by {one.kept:.1%}" for one in records)
        return f"no design tried keeps all demands together: {each}"

    def _nowhere(self, column: int, sentence: str) -> str:
        """A sentence with the commonest cause."""
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
        """Designs that failed or ran out of time, by which; they keep no demand."""
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
        """The same, and the part that it takes of each catalogue."""
        (values,) = values_at(self.problem.variables, self.shares[self.front[place], None])
        pairs = zip(self.problem.variables, values, strict=True)
        return {axis.key: value for axis, value in pairs if axis.parts} | self.settings(place)

    def active(self, place: int) -> list[str]:
        """Which variables of a design of the front lie at a bound, or at an end of their list of numbers, and
        which demands it just keeps. Of a better design that was not found this says nothing."""
        held = []
        for axis, share in zip(self.problem.variables, self.shares[self.front[place]].tolist(), strict=True):
            held += _end_of(axis, share)
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
            "demands": [
                {
                    "key": one.demand.key,
                    "measure": names[one.demand.column],
                    "at_least": one.demand.at_least,
                    "bound": one.demand.bound,
                    "kept_share": one.kept,
                    "best": one.best,
                }
                for one in self.demands
            ],
            "not_judged": [
                {"status": STATUS[one.status], "designs": one.designs, "reason": one.reason or None}
                for one in self.not_judged
            ],
            "finer": None
            if self.finer is None
            else [dict(zip(names, row, strict=True)) for row in self.finer.values.tolist()],
            "produced": None if self.bars is None else self._bars_document(self.bars, names),
            "contacts": [
                {
                    "stiffness_N_per_m": one.stiffness,
                    "damping_Ns_per_m": one.damping,
                    "stable": one.stable,
                    "amplitude_m": one.amplitude,
                    "reason": one.reason or None,
                }
                for one in self.contacts
            ],
            "searched": self.searched,
            "polished": self.polished,
            "budget": self.problem.budget,
            "seed": self.problem.seed,
        }

    def _baseline_document(self, names: list[str]) -> dict[str, Any]:
        assert self.baseline is not None
        values, status = self.baseline.values[0].tolist(), self.baseline.status[0].tolist()
        return {
            "values": dict(zip(names, values, strict=True)),
            "status": {name: STATUS[one] for name, one in zip(names, status, strict=True)},
        }

    def _bars_document(self, bars: Bars, names: list[str]) -> list[dict[str, Any]]:
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


def _end_of(axis: Axis, share: float) -> list[str]:
    """Which end of its range, or of its listed numbers, a variable has; [] between them, or for what has no order.

    >>> _end_of(Axis("a", (3.0, 1.0, 2.0)), 0.1), _end_of(Axis("a", (), (0.0, 1.0)), 0.5)
    (['a at the largest of its values'], [])
    """
    many = pieces(axis)
    if axis.span is not None:
        if min(share, 1.0 - share) > (0.5 / many if many else 0.0) + AT_BOUND:
            return []
        return [f"{axis.key} at its {'upper' if share > 0.5 else 'lower'} bound"]
    if not axis.numeric or many < 2:
        return []
    value = value_at(axis, share)
    ends = {max(axis.values): "largest", min(axis.values): "smallest"}
    return [f"{axis.key} at the {ends[value]} of its values"] if value in ends else []
