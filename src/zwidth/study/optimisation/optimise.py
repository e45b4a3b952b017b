"""Look for the best designs of a study: search, polish, and judge the front again.

found = optimise("study.toml")
found.values, found.knee

`device_files`: the front's designs as device files, ready to use.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.device import address
from zwidth.device.address import UNSET, edited_text
from zwidth.device.read import LARGEST_FILE, read_text
from zwidth.errors import DeviceError, FileError
from zwidth.measures.definition import Note, merge_notes
from zwidth.progress import Progress
from zwidth.study.designs.sampling import CIRCUMSTANCES, WANTED
from zwidth.study.designs.study import Study
from zwidth.study.jobs.job import CellValues
from zwidth.study.jobs.journal import fingerprint
from zwidth.study.jobs.series import JobSeries
from zwidth.study.optimisation.evaluation import LARGEST, DesignJudgement, EvaluationJob, Judge
from zwidth.study.optimisation.optimisation import (
    PRODUCED,
    Bars,
    Contact,
    Optimisation,
    bars_of,
    finer_problem,
    ranges,
    simulate_front_contact,
    spread_out,
    undominated,
)
from zwidth.study.optimisation.polish import polish
from zwidth.study.optimisation.problem import Problem, problem_of, read_study_to_optimise
from zwidth.study.optimisation.search import generations, share_of, values_at

POLISHED: Final = 0.25  # share of the budget that the polish of a front may take
POLISHED_ALONE: Final = 0.5  # the same with one objective: there it counts most
STARTS: Final = 4  # designs that are polished with one objective
APART: Final = 0.1  # of the bounds, by which these differ in some variable
HOPELESS: Final = 5  # generations without a value at any point of any design, after which the search ends


def optimise(
    study: Study | str | os.PathLike[str],
    store: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    time_limit: float | None = None,
) -> Optimisation:
    """Look for the designs of a study that are best in its objectives and keep its demands.

    study     a study file, or a `Study` read with bounds
    store     a folder that keeps what is done, so that the same call goes on from there after it was stopped
    progress  is called with the stage, the number of designs done, and of all designs
    workers   largest number of processes; left out: one for each core
    cluster   address of a dask scheduler, or "local"
    time_limit  time after which a design or cell is given up [s]: it has no values
    Returns   the front, the baseline and how they were found; equal for equal studies, however it was divided
    Raises    DeviceError  with all faults of the study, measures that do not exist for this device among them
              what `executor.run` and `Store` raise
    """
    read = study if isinstance(study, Study) else read_study_to_optimise(study)
    with JobSeries(store, progress, workers, cluster, time_limit) as series:
        return optimise_by(read, series)


def optimise_by(study: Study, series: JobSeries) -> Optimisation:
    """Look for the best designs of a study, see `optimise`, by a series of jobs."""
    problem = problem_of(study)
    archive = _Archive(problem, series)
    series.begin(archive.question)
    baseline = archive.baseline()
    start = _baseline_shares(problem)
    single = len(problem.objectives) == 1
    searching, spent = problem.budget - int((POLISHED_ALONE if single else POLISHED) * problem.budget), 0
    for number, (shares, tell) in enumerate(generations(problem, searching, start), 1):
        if spent >= searching and len(archive.front()):
            break  # else there is nothing to polish, and the search goes on with what is left
        judged = archive.judge(shares, "searching", problem.budget)
        spent += len(shares)
        tell(judged.costs(problem), judged.violations(problem).sum(axis=1))
        if number == HOPELESS and archive.hopeless:
            break
    searched = spent
    best = archive.front()
    # infinite costs, held as LARGEST, cannot be polished
    if len(best) and (np.abs(archive.judgement.costs(problem)[best]) < LARGEST).all():
        costs = archive.judgement.costs(problem)[best]
        chosen = archive.best_apart() if single else best[spread_out(costs, problem.front)]
        # ranges over the front; of a single design the sizes of its costs
        weights = ranges(costs)[1] if len(best) > 1 else np.maximum(np.abs(costs[0]), 1e-300)
        spent += polish(
            problem,
            archive.shares[chosen],
            archive.judgement[chosen],
            weights,
            lambda shares: archive.judge(shares, "polishing", problem.budget),
            problem.budget - spent,
        )
        best = archive.front()
    if len(best):
        best = best[spread_out(archive.judgement.costs(problem)[best], problem.front)]
    return archive.result(best, baseline, searched, spent - searched)


class _Archive:
    """All designs judged, in their order.

    shares     (n, v)
    judgement  of them, from the first that is judged on
    notes      column -> why designs have no value in it
    """

    judgement: DesignJudgement

    def __init__(self, problem: Problem, series: JobSeries) -> None:
        self.problem, self.series, self.progress = problem, series, series.progress
        self.judging = Judge(problem)
        self.shares = np.zeros((0, len(problem.variables)))
        self._places: dict[bytes, int] = {}  # of a design's shares
        self._jobs = 0
        self.notes: dict[str, list[Note]] = {column.name: [] for column in problem.columns}

    @property
    def question(self) -> str:
        """Fingerprint of all that the jobs follow from: the variables with their bounds, what the designs are
        judged by, and how they are searched. Device, task and circumstances are in that of any design's job; the
        design in the middle of the bounds stands for all."""
        problem = self.problem
        (middle,) = values_at(problem.variables, np.full((1, len(problem.variables)), 0.5))
        return fingerprint(
            "optimisation",
            self.judging.job([middle]).question,
            problem.variables,
            problem.objectives,
            problem.demands,
            problem.members,
            problem.tolerances,
            problem.budget,
            problem.seed,
            problem.front,
        )

    @property
    def hopeless(self) -> bool:
        """Whether some objective has no value at any point of any design."""
        absent = self.judgement.absent[:, [one.column for one in self.problem.objectives]]
        return bool((absent == 1.0).all(axis=0).any())

    def judge(self, shares: Floats, stage: str, of: int) -> DesignJudgement:
        """The judgement of designs, by shares (n, v), of which those that are new are computed and kept.

        stage, of  what progress is reported under, and the number of designs at its end
        """
        places, new = [], list[int]()
        for n, row in enumerate(shares):
            if (key := row.tobytes()) not in self._places:
                self._places[key] = len(self._places)
                new.append(n)
            places.append(self._places[key])
        if new:
            found = self._compute_designs(
                values_at(self.problem.variables, shares[new]), stage, len(self.shares), of
            )
            for name, notes in self.judging.reasons(found).items():
                self.notes[name] += notes
            judged = self.judging.judge(found)
            self.judgement = self.judgement.followed_by(judged) if len(self.shares) else judged
            self.shares = np.concatenate([self.shares, shares[new]])
        return self.judgement[places]

    def _compute_designs(self, designs: list[tuple[Any, ...]], stage: str, done: int, of: int) -> CellValues:
        """Compute designs, each given by the values of its variables; returns the cells of their job."""
        return self._compute(self.judging.job(designs), stage, done, of)

    def _compute(self, job: EvaluationJob, stage: str, done: int, of: int) -> CellValues:
        """Compute a job; progress is told in designs of the whole."""
        self._jobs += 1
        return self.series.compute(f"{self._jobs:05d}", job, stage, done, of)

    def baseline(self) -> DesignJudgement | None:
        """The device as it is; None where it has not all of the numbers that vary."""
        values = own_values(self.problem)
        if any(value is None for value in values):
            return None
        return self.judging.judge(self._compute_designs([tuple(values)], "judging the device as it is", 0, 1))

    def front(self) -> Ints:
        """Places (k,) of the designs that keep all demands and that no other dominates."""
        if not len(self.shares):
            return np.zeros(0, dtype=np.int64)
        costs = self.judgement.costs(self.problem)
        costs[self.judgement.violations(self.problem).any(axis=1)] = np.nan
        return undominated(costs)

    def best_apart(self) -> Ints:
        """Places (k,) of up to STARTS designs, best first, that keep all demands and lie APART; for a single
        objective."""
        kept = np.asarray(~self.judgement.violations(self.problem).any(axis=1))
        costs, shares = self.judgement.costs(self.problem)[:, 0], self.shares
        chosen: list[int] = []
        for row in np.argsort(np.where(kept, costs, np.inf), kind="stable").tolist():
            if len(chosen) == STARTS or not kept[row]:
                break
            if all(np.abs(shares[row] - shares[other]).max() > APART for other in chosen):
                chosen.append(row)
        return np.array(chosen, dtype=np.int64)

    def result(self, best: Ints, baseline: DesignJudgement | None, searched: int, polished: int) -> Optimisation:
        """The result of the search, `best` (k,) being the places of the front's designs; others as in
        `Optimisation`."""
        notes = {name: merge_notes(each) for name, each in self.notes.items()}
        found = Optimisation(self.problem, self.shares, self.judgement, best, baseline, searched, polished, notes)
        return replace(found, finer=self._finer(best), bars=self._bars(best), contacts=self._contacts(found))

    def _bars(self, best: Ints) -> Bars | None:
        """Spread of the front's designs, `best` (k,) their places, as produced within tolerances; None without
        any."""
        if not self.problem.tolerances or not len(best):
            return None
        judging = Judge(self.problem, PRODUCED)
        job = judging.job(values_at(self.problem.variables, self.shares[best]))
        cells = self._compute(job, "judging the front as it is produced", 0, len(best))
        return bars_of(self.problem, judging.judge_produced(cells))

    def _finer(self, best: Ints) -> DesignJudgement | None:
        """The judgement of the front's designs, `best` (k,) their places, on a finer grid of the task; None where
        there is none."""
        problem = finer_problem(self.problem)
        if problem is None or not len(best):
            return None
        judging, designs = Judge(problem), values_at(problem.variables, self.shares[best])
        return judging.judge(
            self._compute(judging.job(designs), "judging the front on a finer grid", 0, len(best))
        )

    def _contacts(self, found: Optimisation) -> tuple[Contact, ...]:
        """A wall of each design of the front, simulated: see `simulate_front_contact`."""
        contacts, count = list[Contact](), len(found.front)
        for place in range(count):
            self._tell("simulating walls of the front", place, count)
            cells = found.judgement.cells[found.front[place]]
            contacts.append(simulate_front_contact(self.problem, found.settings(place), cells))
        self._tell("simulating walls of the front", count, count)
        return tuple(contacts)

    def _tell(self, stage: str, done: int, of: int) -> None:
        """Report progress, where it is wanted."""
        if self.progress is not None:
            self.progress(stage, done, of)


def own_values(problem: Problem) -> list[Any]:
    """The variables' values in the device file; None for one that it does not have, and for a catalogue."""
    document = problem.study.device.document
    return [
        address.get(document, axis.key) if not axis.parts and _is_in_file(document, axis.key) else None
        for axis in problem.variables
    ]


def _is_in_file(document: dict[str, Any], key: str) -> bool:
    """Whether a device file has something at a path; False for a circumstance, and a path that no file can
    have."""
    try:
        return address.exists(document, key)
    except DeviceError:
        return False


def _baseline_shares(problem: Problem) -> Floats:
    """The device as it is, as shares (1, v), if it lies within the bounds; else none (0, v)."""
    values = own_values(problem)
    shares = [
        None if value is None else share_of(axis, value)
        for axis, value in zip(problem.variables, values, strict=True)
    ]
    inside = all(share is not None for share in shares)
    return np.array([shares], dtype=np.float64) if inside else np.zeros((0, len(shares)))


# Circumstance -> where a device file has it.
PLACES: Final = {
    "at": "mechanism.reference.position_m",
    "direction": "mechanism.reference.direction",
    "assembly": "mechanism.reference.assembly",
}
NO_PLACE: Final = ("model", *WANTED)  # circumstances that no device file has


def device_files(found: Optimisation) -> Iterator[tuple[str, str]]:
    """Name and text of a file for each design of the front, in its order: the study's device file with its
    comments, the changes of `set`, and the design's numbers, whose sources say where they come from.

    Position, direction, assembly and operator, of the study or of the design, go into the file too. What has no
    place there, such as a model, is said in a comment at its beginning; and so is where a design without numbers
    comes from.
    """
    study = found.problem.study
    stem = _file_stem(study)
    width = len(str(len(found.front)))
    for place in range(len(found.front)):
        settings = found.settings(place)
        numbers = {key: value for key, value in settings.items() if key not in CIRCUMSTANCES}
        source = f"{_source_text(study)}, seed {found.problem.seed}, design {place + 1}"
        given = {key: study.document[key] for key in CIRCUMSTANCES if key in study.document} | settings
        changes: list[str | tuple[str, Any]] = [*study.document.get("set", ())]
        changes += [(path, _tuple_as_list(given[key])) for key, path in PLACES.items() if key in given]
        changes += _operator_changes(found, settings)
        text = edited_text(study.device.label, [*changes, *numbers.items()], dict.fromkeys(numbers, source))
        missing = [f"{key} = {given[key]}" for key in NO_PLACE if key in given]
        head = (
            f"# The design was judged with {', '.join(missing)}, which no device file holds.\n" if missing else ""
        )
        head += "" if numbers else f"# {source}\n"
        yield f"{stem}-{place + 1:0{width}d}.toml", head + text


def files_there(folder: Path, study: Study) -> tuple[list[Path], list[Path]]:
    """Files in a folder that are called as the designs of a study are: those that it has written earlier, whose
    place its next designs take, and others. None where there is no folder.

    Raises  OSError  where it cannot be read
    """
    if not folder.is_dir():
        return [], []
    name = re.compile(rf"{re.escape(_file_stem(study))}-\d+\.toml")
    named = [path for path in sorted(folder.iterdir()) if name.fullmatch(path.name)]
    written = [path for path in named if _was_written_for(path, study)]
    return written, [path for path in named if path not in written]


def _was_written_for(path: Path, study: Study) -> bool:
    """Whether a file was written for a design of this study: its text names the study as its source."""
    try:
        return f"{_source_text(study)}, seed " in read_text(path, LARGEST_FILE)
    except FileError:
        return False


def _file_stem(study: Study) -> str:
    """Beginning of the names of the designs' files: the name of the device's file without its ending."""
    return Path(study.device.label).name.removesuffix(".toml")


def _source_text(study: Study) -> str:
    """How files name the study that their design was found in."""
    return f"optimised, study {Path(study.label).name}"


def _operator_changes(found: Optimisation, settings: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield path and value of the changes that give a device file the operator of the design or of the study; the
    operators of a task are in no file. The file's own operator is taken out first. Nothing is yielded where
    neither design nor study names one.

    settings  of the design
    """
    study = found.problem.study
    if "operator" in settings:
        table = study.operators[settings["operator"]]
    elif "operator" in study.document:
        table = study.device.document.get("operator")
    else:
        return
    yield "operator", UNSET
    for key, value in (table or {}).items():
        yield f"operator.{key}", value


def _tuple_as_list(value: Any) -> Any:
    """A tuple as a list, which a device file can hold; anything else as it is."""
    return list(value) if isinstance(value, tuple) else value
