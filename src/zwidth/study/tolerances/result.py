"""`ToleranceStudy`: what is certain of devices as they are produced.

Which tolerance to tighten first: the same devices once more, one tolerance after the other half as wide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.chart.point_chart import chart_at
from zwidth.device.faults import plural
from zwidth.errors import ChartError
from zwidth.measures.definition import NO_VALUE, OK, STATUS, UNDECIDED
from zwidth.result import Documented, Result, documented, entry
from zwidth.study.designs.sampling import Axis
from zwidth.study.designs.study import Study
from zwidth.study.designs.sweep import Sweep
from zwidth.study.designs.sweep_job import SweepJob
from zwidth.study.jobs.job import CellValues
from zwidth.study.tolerances.band import Band
from zwidth.study.tolerances.distribution import Tolerance
from zwidth.study.tolerances.intervals import Interval, difference_interval, share_interval, under
from zwidth.study.tolerances.outcomes import (
    STABLE,
    STIFFNESS,
    UNSTABLE,
    WITH_WALL,
    WITHOUT_WALL,
    Indices,
    MeasureQuantiles,
    measure_quantiles,
    outcome_counts,
)
from zwidth.study.tolerances.question import ToleranceQuestion

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.chart.chart_base import Chart


ASKED: Final = (
    STABLE,
    UNSTABLE,
    WITH_WALL,
    WITHOUT_WALL,
    STATUS[UNDECIDED],
)  # outcomes of devices that could be asked
# why no tolerance is named that is to be tightened first
NO_WALL_WANTED: Final = "no wall is wanted"
ALL_STABLE: Final = "every drawn device renders the wall"
MIDDLE_NOT_STABLE: Final = "the wall is not known to be stable in the middle of the tolerances"
NOT_TOLD_APART: Final = "the drawn devices do not tell that half of any tolerance would help"


@dataclass(frozen=True, repr=False)
class ToleranceStudy(Result):
    """A device as it is produced, with everything that is certain of it.

    question   what was asked
    job        the drawn devices
    cells      measures and status (devices, columns) of each
    indices    of each outcome; () where none were asked for
    bands      of the chart, the likeliest walls first
    uncharted  number of drawn devices without a chart; in the bands they count as not stable
    tightened  what half of each tolerance does for the wanted wall, the largest gain first; () where there is no
               wall, or every device renders it
    middle     outcome of the device in the middle of all tolerances, as in `outcomes`; None: not computed
    """

    question: ToleranceQuestion
    job: SweepJob
    cells: CellValues
    indices: tuple[Indices, ...] = field(default=(), metadata=entry())
    bands: tuple[Band, ...] = field(default=(), metadata=entry(before="indices"))
    uncharted: int = field(default=0, metadata=entry(before="bands"))
    tightened: tuple[Tightened, ...] = field(default=(), metadata=entry(name="narrower"))
    middle: str | None = field(default=None, metadata=entry())

    def __repr__(self) -> str:
        question = self.question
        devices = plural(question.samples, "device")
        lines = [f"ToleranceStudy: {devices} like {question.study.device.label!r}"]
        if (share := self.probability) is not None:
            wall = question.study.wall
            lines.append(
                f"the wall {wall.stiffness:.6g} N/m, {wall.damping:.6g} N s/m is stable in {share.value:.1%} "
                f"({share.low:.1%} to {share.high:.1%})"
                f"{f', undecided in {self.undecided} devices' if self.undecided else ''}"
            )
        for band in self.bands[:1]:
            if band.stiffest is not None:
                wall_text = f"{band.stiffest.stiffness:.6g} N/m, {band.stiffest.damping:.6g} N s/m"
                lines.append(f"the stiffest wall of {band.probability:.4g} of them is {wall_text}")
        return "\n  ".join(lines)

    @cached_property
    @documented(before="uncharted")
    def outcomes(self) -> dict[str, int]:
        """Outcome -> number of drawn devices."""
        return outcome_counts(self.question.columns, self.cells)

    @property
    @documented(value=under("probability"), spread=True, before="uncharted")
    def probability(self) -> Interval | None:
        """Probability that a produced device renders the wanted wall stably; None where no wall is wanted.

        Devices that cannot be built, or do not get to the handle's position, do not. Undecided verdicts widen the
        interval on its high side.
        """
        if not self.question.has_wall:
            return None
        return share_interval(self.outcomes.get(STABLE, 0), self.question.samples, self.undecided)

    @property
    def undecided(self) -> int:
        """Number of devices of which rounding leaves open whether the wanted wall, or any wall, is stable."""
        return self.outcomes.get(STATUS[UNDECIDED], 0)

    @property
    def without_answer(self) -> dict[str, int]:
        """Outcome -> number of the devices that could not be asked: not built, out of reach, ..."""
        return {name: count for name, count in self.outcomes.items() if name not in ASKED}

    @property
    @documented(before="uncharted")
    def without_stable_wall(self) -> int:
        """Number of drawn devices of which no wall with K > 0 and B >= 0 is stable."""
        column = [one.name for one in self.question.columns].index(STIFFNESS)
        return int((self.cells.status[:, column] == NO_VALUE).sum())

    @cached_property
    @documented(before="uncharted")
    def quantiles(self) -> tuple[MeasureQuantiles, ...]:
        """Quantiles of every measure."""
        return tuple(measure_quantiles(self.question.columns, self.cells, self.question.quantiles))

    @cached_property
    def nominal(self) -> Chart | None:
        """The chart of the device as its file describes it; None where it has none."""
        study = self.question.study
        try:
            point = study.device.at(study.at, study.direction, assembly=study.assembly, model=study.model)
            return chart_at(point, decay=False).drawn()
        except (ChartError, ValueError):
            return None

    @property
    def reason(self) -> str | None:
        """Why there are no results: no drawn device has an answer; with the first reason. None where one has."""
        if any(name in ASKED for name in self.outcomes):
            return None
        status = ", ".join(f"{count} {name}" for name, count in self.outcomes.items())
        why = next(iter(self.reasons), "")
        return f"no drawn device has an answer: {status}{f'; the first: {why}' if why else ''}"

    @property
    @documented(name="notes")
    def reasons(self) -> list[str]:
        """Why devices have no value, each reason once: "failed: ..."."""
        texts = [
            f"{STATUS[note.status]}: {note.reason}"
            for notes in self.cells.notes
            for note in notes
            if note.status != OK and note.reason
        ]
        return list(dict.fromkeys(texts))

    @property
    @documented(name="tighten_first", value=lambda found: [one.key for one in found], before="reasons")
    def best_to_tighten(self) -> tuple[Tightened, ...]:
        """The tolerances of which half the width would gain most: several that cannot be told apart, or ().

        A narrower tolerance that does not raise the share for certain is not among them. Where the wall is not
        known to be stable in the middle there are none: whatever is tightened leads there.
        """
        if not self.middle_is_stable:
            return ()
        return tuple(one for one in self.tightened if one.gain.low > 0.0 and one.may_be_best)

    @property
    def middle_is_stable(self) -> bool:
        """Whether the device in the middle of the tolerances renders the wanted wall, or any if none is wanted."""
        return self.middle in (STABLE, WITH_WALL)

    @property
    @documented(name="tighten_first_reason", before="reasons")
    def no_advice(self) -> str | None:
        """Why no tolerance is named that is to be tightened first; None where one is."""
        if self.best_to_tighten:
            return None
        if not self.question.has_wall:
            return NO_WALL_WANTED
        if self.outcomes.get(STABLE, 0) == self.question.samples:
            return ALL_STABLE
        return NOT_TOLD_APART if self.middle_is_stable else MIDDLE_NOT_STABLE

    def dataset(self) -> xr.Dataset:
        """The drawn devices: their numbers, measures and status along the dimension `design`."""
        return self._sweep.dataset()

    def document(self) -> dict[str, Any]:
        """Everything by key and unit."""
        question = self.question
        wall = question.study.wall
        return {
            "stiffness_N_per_m": wall.stiffness,
            "damping_Ns_per_m": wall.damping,
            "samples": question.samples,
            "index_samples": question.index_samples,
            "seed": question.seed,
            "tolerances": [one.document() for one in question.tolerances],
        } | super().document()

    def table(self) -> Mapping[str, list[Any]]:
        """The drawn devices as columns, one device a row."""
        return self._sweep.table()

    @property
    def study(self) -> Study:
        """The study of the drawn devices."""
        return replace(self.question.study, sampling=self.job.sampling, columns=self.job.columns)

    @property
    def _sweep(self) -> Sweep:
        """The drawn devices and their measures as the result of a sweep."""
        return Sweep(self.study, self.job, self.cells)


NARROWER: Final = 0.5  # width that a tolerance is tried with, of its own


def _key_and_width(key: str) -> dict[str, Any]:
    """What a document says of the tolerance: its path, and the share of its width that was tried."""
    return {"key": key, "width": NARROWER}


@dataclass(frozen=True)
class Tightened(Documented):
    """What a tolerance of half the width would do to the share of devices that render the wanted wall stably.

    key    of the tolerance
    share  of the same devices with the narrower tolerance
    gain   its difference from the share as it is
    rival  difference from the best of all narrower tolerances, 0 of the best itself; with it two are told apart
    """

    key: str = field(metadata=entry(value=_key_and_width, spread=True))
    share: Interval = field(metadata=entry(value=under("probability"), spread=True))
    gain: Interval = field(metadata=entry(value=under("gain"), spread=True))
    rival: Interval

    @property
    @documented(name="gain_differs_from_0")
    def is_certain(self) -> bool:
        """Whether the gain can be told from 0."""
        return self.gain.low > 0.0 or self.gain.high < 0.0

    @property
    @documented()
    def may_be_best(self) -> bool:
        """Whether it cannot be told from the best."""
        return self.rival.high >= 0.0


def tightened_axes(tolerances: Sequence[Tolerance], values: Sequence[Floats]) -> list[Axis]:
    """Axes of the n drawn devices, repeated for each tolerance with this one half as wide: the same draws.

    values  (n,) of each tolerance, of the drawn devices
    """
    axes = []
    for n, (one, drawn) in enumerate(zip(tolerances, values, strict=True)):
        narrow = one.distribution.narrowed(drawn, NARROWER)
        axes.append(one.axis(np.concatenate([narrow if n == k else drawn for k in range(len(tolerances))])))
    return axes


def tightened(keys: Sequence[str], before: Flags, after: Flags) -> tuple[Tightened, ...]:
    """What each narrower tolerance does, the largest gain first.

    before  (n,)  whether each drawn device renders the wall stably
    after   (tolerances, n)  the same with each tolerance narrower
    """
    count = len(before)
    best = after[int(np.argmax(after.sum(axis=1)))]
    found = [
        Tightened(
            key,
            share_interval(int(stable.sum()), count),
            difference_interval(int((stable & ~before).sum()), int((before & ~stable).sum()), count),
            difference_interval(int((stable & ~best).sum()), int((best & ~stable).sum()), count),
        )
        for key, stable in zip(keys, after, strict=True)
    ]
    return tuple(sorted(found, key=lambda one: -one.gain.value))
