"""`tolerance`: what is certain of a device as it is produced, with every number somewhere within its tolerance.

1. Devices are drawn at random and measured: the share that renders the wanted wall, quantiles of the measures.
2. Devices laid for Sobol's indices: which tolerance makes how much of the spread.
3. The drawn devices once more, with one tolerance after the other half as wide: what that is worth.
4. The edges of the drawn devices on lines of equal damping: bands of the chart.
5. The stiffest wall of each band, on devices drawn anew, since it was chosen to suit the first ones.

Random numbers of produced devices: each tolerance has a stream of its own, by its path and the seed.

Devices are independent draws, as intervals of probabilities need them. The n-th device has the same numbers
whatever the count of devices, and another tolerance beside it changes none of them: designs, and narrower
tolerances, are compared on the same devices.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.device import Device
from zwidth.errors import MissingMeasures
from zwidth.measures.definition import NO_VALUE, OK, STATUS, Measure
from zwidth.progress import Progress
from zwidth.study.designs.sampling import Axis
from zwidth.study.designs.sweep_job import SweepJob, sweep_job
from zwidth.study.jobs.job import CellValues, Job
from zwidth.study.jobs.series import JobSeries
from zwidth.study.tolerances.band import MOST_INTERVALS, Band, Coverage, EdgeJob, highest_damping, refined_dampings
from zwidth.study.tolerances.distribution import Tolerance
from zwidth.study.tolerances.intervals import count_bounds, share_interval
from zwidth.study.tolerances.outcomes import (
    STIFFNESS,
    Indices,
    all_indices,
    outcome_counts,
    sampled_shares,
    stable_marks,
)
from zwidth.study.tolerances.question import WALL_IS_STABLE, ToleranceQuestion, question_over, read_question
from zwidth.study.tolerances.result import Tightened, ToleranceStudy, tightened, tightened_axes

if TYPE_CHECKING:
    from zwidth.loop.posed_device import Position


LINES: Final = 128  # steps of damping in which bands are laid over the chart
PIECES: Final = 24  # into which a step is divided where a band ends or is stiffest
TRIED: Final = 64  # devices whose edges say how far the lines reach
ABOVE: Final = 1.1  # how much further they reach than those devices
ROUNDS: Final = 1  # of finer lines
MOST_ROUNDS: Final = 10  # in all

# Computes a job: its name (of its store), the job, and the stage that progress is reported under.
Compute: TypeAlias = Callable[[str, Job, str], CellValues]


def tolerance(
    device: Device,
    tolerances: Mapping[str, Mapping[str, Any]],
    measures: str | Measure | Sequence[str | Measure] = (),
    *,
    stiffness: float | None = None,
    damping: float | None = None,
    frequency: float | None = None,
    position: Position | None = None,
    direction: Sequence[float] | None = None,
    assembly: str | None = None,
    model: str | None = None,
    samples: int | None = None,
    index_samples: int | None = None,
    quantiles_percent: Sequence[float] | None = None,
    seed: int | None = None,
    user_measures: Mapping[str, Measure] | None = None,
    store: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    time_limit: float | None = None,
) -> ToleranceStudy:
    """What is certain of a device whose numbers differ from one produced device to the next.

        found = tolerance(device, {"loop.delay_samples": {"distribution": "uniform", "low": 0.3, "high": 0.6}},
                          stiffness=4000.0, damping=10.0)
        found.probability.value, found.probability.low, found.probability.high

    tolerances     path -> how the number differs: the keys of a [[tolerance]] without `key`
    measures       one or several, by name or as measures, besides the largest stiffness
    stiffness, damping   of the wanted wall [N/m], [N s/m], whose probability is asked for; both or none
    frequency      of the hand's motion [Hz], for measures about it
    position, direction, assembly, model   of all devices, as for `Device.at`
    samples        devices drawn; left out: 1000
    index_samples  base samples of the sensitivity indices, a power of 2 from 32 on, 0 for none; left out: 512
    quantiles_percent  of measures and of charts; left out: 5, 50 and 95
    seed           seed of the random numbers; left out: 1
    store          a folder that keeps what is done, so that the same call goes on from there after it was stopped
    progress       is called with the stage, the number of devices done, and of all of them
    workers        largest number of processes; left out: one for each core
    cluster        address of a dask scheduler, or "local"
    user_measures  a user's measures by the name that `measures` has them by
    time_limit     time after which a design or cell is given up [s]: it is out of time
    Raises         DeviceError   with all faults of the arguments
                   MeasureError  for measures that do not exist for this device
                   TooLarge      where the devices would not fit into memory
                   what `executor.run` and `Store` raise
    """
    question = question_over(
        device,
        tolerances,
        measures,
        user_measures,
        {"at": position, "direction": direction, "assembly": assembly, "model": model}
        | {"stiffness_N_per_m": stiffness, "damping_Ns_per_m": damping, "frequency_Hz": frequency},
        {"samples": samples, "index_samples": index_samples, "quantiles_percent": quantiles_percent, "seed": seed},
    )
    with JobSeries(store, progress, workers, cluster, time_limit) as series:
        return answer(question, series.compute)


def run_tolerances(
    question: ToleranceQuestion | str | os.PathLike[str],
    store: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    time_limit: float | None = None,
) -> ToleranceStudy:
    """Answer what a study file asks of produced devices; see `tolerance` for the rest.

    question  read by `read_question`, or the path of its file
    """
    asked = question if isinstance(question, ToleranceQuestion) else read_question(question)
    with JobSeries(store, progress, workers, cluster, time_limit) as series:
        return answer(asked, series.compute)


def answer(question: ToleranceQuestion, compute: Compute) -> ToleranceStudy:
    """Answer a question with a function that computes jobs. Where no drawn device has an answer nothing
    is computed beyond measures and indices. Raises what `sweep_job` and that function raise."""
    values = drawn_values(question.tolerances, question.seed, question.samples)
    job, cells, indices = _measure_drawn(question, values, compute)
    found = ToleranceStudy(question=question, job=job, cells=cells, indices=tuple(indices))
    if found.reason is not None:
        return found
    bands, uncharted = _bands(question, values, compute)
    narrower = _tightened(question, values, cells, compute)
    middle = _outcome_in_middle(question, compute)
    return replace(found, bands=bands, uncharted=uncharted, tightened=narrower, middle=middle)


def _device_axes(question: ToleranceQuestion, values: Sequence[np.ndarray[Any, Any]]) -> list[Axis]:
    """The axes of devices, from the values (devices,) of the number of each tolerance."""
    return [one.axis(its_values) for one, its_values in zip(question.tolerances, values, strict=True)]


def _measure_drawn(
    question: ToleranceQuestion, values: Sequence[np.ndarray[Any, Any]], compute: Compute
) -> tuple[SweepJob, CellValues, list[Indices]]:
    """The job of the drawn devices, their measures, and the indices, [] where none are asked for. The indices have
    devices of their own, computed in the same job behind the drawn ones.

    values  (samples,) of each tolerance, of the drawn devices
    """
    count, keys = question.samples, [one.key for one in question.tolerances]
    laid = np.empty((0, len(keys)))  # shares of the devices for the indices
    if question.index_samples:
        laid = sampled_shares(len(keys), question.index_samples, question.seed)
    all_values = [
        np.concatenate([drawn_ones, one.distribution.values(laid[:, n])])
        for n, (one, drawn_ones) in enumerate(zip(question.tolerances, values, strict=True))
    ]
    whole = sweep_job(question.study_of(_device_axes(question, all_values), question.columns))
    cells = compute("devices", whole, "computing devices")
    notes = tuple(tuple(note for note in each if note.first[0] < count) for each in cells.notes)
    drawn = CellValues(cells.values[:count], cells.status[:count], notes)
    for_indices = CellValues(cells.values[count:], cells.status[count:], cells.notes)
    indices = all_indices(question.columns, for_indices, keys, question.seed) if len(laid) else []
    return replace(whole, sampling=question.study_of(_device_axes(question, values), ()).sampling), drawn, indices


def _tightened(
    question: ToleranceQuestion, values: Sequence[np.ndarray[Any, Any]], cells: CellValues, compute: Compute
) -> tuple[Tightened, ...]:
    """What half the width of each tolerance does for the wanted wall; () for no wall, or one that all render."""
    before = stable_marks(question.columns, cells) if question.has_wall else np.ones(1, dtype=bool)
    if before.all():
        return ()
    axes = tightened_axes(question.tolerances, values)
    job = sweep_job(question.study_of(axes, [WALL_IS_STABLE]))
    found = compute("narrower", job, "computing devices of narrower tolerances")
    after = stable_marks([WALL_IS_STABLE], found).reshape(len(values), question.samples)
    return tightened([one.key for one in question.tolerances], before, after)


def _outcome_in_middle(question: ToleranceQuestion, compute: Compute) -> str:
    """The outcome of the device in the middle of all tolerances, to which they lead as they are tightened."""
    axes = _device_axes(question, [np.array([one.distribution.middle]) for one in question.tolerances])
    columns = [one for one in question.columns if one.name in (STIFFNESS, WALL_IS_STABLE.name)]
    try:
        job = sweep_job(question.study_of(axes, columns))
    except MissingMeasures:
        return STATUS[NO_VALUE]
    (outcome,) = outcome_counts(columns, compute("middle", job, "computing the device in the middle"))
    return outcome


def _bands(
    question: ToleranceQuestion, values: Sequence[np.ndarray[Any, Any]], compute: Compute
) -> tuple[tuple[Band, ...], int]:
    """Bands of the chart, one for each quantile, the likeliest walls first; and how many drawn devices have no
    chart. `values` as for `_measure_drawn`."""
    shares = question.quantiles[::-1]
    counts = [count_bounds(share, question.samples) for share in shares]
    wanted = [count for each in counts for count in each if count]
    coverage, uncharted = _coverage(question, values, wanted, compute)
    bands = []
    for share, (certain, members, possible) in zip(shares, counts, strict=True):
        bands.append(
            Band(
                probability=share,
                members=members,
                dampings=coverage.dampings,
                pieces=tuple(coverage.pieces(d, members) for d in range(len(coverage.dampings))),
                stiffest=coverage.stiffest(members),
                certain=coverage.stiffest(certain) if certain else None,
                high=coverage.largest(possible)[0],
            )
        )
    return _with_tried_walls(question, bands, compute), uncharted


def _coverage(
    question: ToleranceQuestion,
    values: Sequence[np.ndarray[Any, Any]],
    counts: Sequence[int],
    compute: Compute,
) -> tuple[Coverage, int]:
    """How many drawn devices are stable along lines of damping: even ones, then finer ones (`refined_dampings`).

    values   (samples,) of each tolerance, of the drawn devices
    counts   numbers of devices whose bands are wanted
    Returns  the count of stable devices, and how many have no chart and count as not stable
    """
    job = sweep_job(
        question.study_of(_device_axes(question, values), [WALL_IS_STABLE] if question.has_wall else [])
    )
    first = EdgeJob(job, np.empty(0))
    # 1 N s/m where none of them has a stable wall with B > 0
    top = ABOVE * highest_damping(first, TRIED) or 1.0
    dampings, intervals = np.empty(0), np.empty((question.samples, 0, MOST_INTERVALS, 2))  # as of `Coverage`
    # lines to compute next, number of rounds of finer lines, and of all rounds
    wanted, rounds, n = np.linspace(0.0, top, LINES + 1), 0, 0
    while True:
        edges = compute(f"edges-{n}", replace(first, dampings=wanted), "computing charts of devices")
        found = np.where(edges.status == OK, edges.values, 0.0)
        intervals = np.concatenate([intervals, found.reshape(len(found), len(wanted), MOST_INTERVALS, 2)], axis=1)
        dampings = np.concatenate([dampings, wanted])
        order = np.argsort(dampings, kind="stable")
        dampings, intervals = dampings[order], intervals[:, order]
        coverage, n = Coverage(dampings, intervals), n + 1
        if n < MOST_ROUNDS and coverage.topmost(min(counts)) == len(dampings) - 1:  # bands go on above all lines
            wanted, top = top + top * np.arange(1, LINES + 1) / LINES, 2.0 * top
            continue
        wanted, rounds = refined_dampings(coverage, counts, PIECES), rounds + 1
        if rounds > ROUNDS or not len(wanted):
            return coverage, int((edges.status[:, 0] != OK).sum())


def _with_tried_walls(question: ToleranceQuestion, bands: Sequence[Band], compute: Compute) -> tuple[Band, ...]:
    """The bands, the stiffest and the certain wall of each with the share of devices drawn anew that render it."""
    walls = [wall for band in bands for wall in (band.stiffest, band.certain) if wall is not None]
    if not walls:
        return tuple(bands)
    count, values = question.samples, drawn_values(question.tolerances, question.seed, question.samples, UNSEEN)
    axes = _device_axes(question, [np.tile(its_values, len(walls)) for its_values in values])
    axes += [
        Axis("stiffness_N_per_m", tuple(wall.stiffness for wall in walls for _ in range(count))),
        Axis("damping_Ns_per_m", tuple(wall.damping for wall in walls for _ in range(count))),
    ]
    job = sweep_job(question.study_of(axes, [WALL_IS_STABLE]))
    found = compute("unseen", job, "trying walls on further devices")
    good = (found.values[:, 0] == 1.0).reshape(len(walls), count).sum(axis=1)
    tried = iter(
        [
            replace(wall, share=share_interval(int(one), count), unseen=count)
            for wall, one in zip(walls, good, strict=True)
        ]
    )
    return tuple(
        replace(
            band,
            stiffest=next(tried) if band.stiffest is not None else None,
            certain=next(tried) if band.certain is not None else None,
        )
        for band in bands
    )


DRAWN, UNSEEN = range(2)  # devices that answers are found with, and those that try the answers afterwards
WORDS: Final = 8  # of 32 bits, of a path's fingerprint


def shares_of(path: str, seed: int, count: int, purpose: int = DRAWN) -> Floats:
    """Independent uniform random numbers (count,) of one tolerance; more of them begin with the same ones.

    path     of the number that differs
    purpose  DRAWN, UNSEEN: independent of each other

    >>> bool((shares_of("loop.delay_samples", 1, 5)[:3] == shares_of("loop.delay_samples", 1, 3)).all())
    True
    """
    fingerprint = np.frombuffer(hashlib.sha256(path.encode()).digest(), dtype=">u4")[:WORDS]
    return np.random.default_rng([seed, purpose, *fingerprint.tolist()]).random(count)


def drawn_values(tolerances: Sequence[Tolerance], seed: int, count: int, purpose: int = DRAWN) -> list[Floats]:
    """Values (count,) of each tolerance's number, one for each produced device."""
    return [one.distribution.values(shares_of(one.path, seed, count, purpose)) for one in tolerances]


@dataclass(frozen=True)
class MemberChanges:
    """How the numbers of produced devices differ from those of a design, whatever the design.

        changed = factor * value + offset                       of a number with a tolerance
        changed = value * (changed_v / v)^power                 of one tied to it by a power
        changed = tie_factor * changed_v                        of one tied to it by a factor

    where v is the design's own value of the number with the tolerance. A relative tolerance (in percent, or
    lognormal) has factors, an absolute one offsets.

    tolerances  whose numbers these are
    factors     (members, tolerances)
    offsets     (members, tolerances)
    """

    tolerances: tuple[Tolerance, ...]
    factors: Floats
    offsets: Floats

    @property
    def keys(self) -> tuple[str, ...]:
        """Paths of all numbers that change, those tied to a tolerance after it."""
        return tuple(key for one in self.tolerances for key in (one.key, *(tie.key for tie in one.ties)))

    def of(self, design: Mapping[str, float]) -> Floats:
        """The numbers of each member (members, keys) of a design.

        design  path -> the design's own value of each of `keys`; those tied by a factor may be left out

        >>> from zwidth.study.tolerances.distribution import Distribution
        >>> spring = Tolerance("k", "k", Distribution("uniform", 2.0, 1.8, 2.2), relative=True)
        >>> members = member_changes([spring], 1000, seed=1).of({"k": 300.0})
        >>> members.shape, bool(members.min() > 270.0), bool(members.max() < 330.0)
        ((1000, 1), True, True)
        """
        columns = []
        for n, one in enumerate(self.tolerances):
            value = float(design[one.key])
            changed = self.factors[:, n] * value + self.offsets[:, n]
            columns.append(changed)
            for tie in one.ties:
                if tie.power is None:
                    columns.append(tie.factor * changed)
                else:
                    columns.append(float(design[tie.key]) * (changed / value) ** tie.power)
        return np.stack(columns, axis=1) if columns else np.empty((len(self.factors), 0))


def member_changes(
    tolerances: Sequence[Tolerance], members: int, seed: int = 1, purpose: int = DRAWN
) -> MemberChanges:
    """The same random members for all designs that are compared: common random numbers.

    members  number of produced devices of each design
    seed, purpose  as for `drawn_values`
    Returns  factors and offsets (members, tolerances) that any design's own numbers are changed by
    """
    count = len(tolerances)
    factors, offsets = np.ones((members, count)), np.zeros((members, count))
    for n, (one, values) in enumerate(
        zip(tolerances, drawn_values(tolerances, seed, members, purpose), strict=True)
    ):
        if one.relative:
            factors[:, n] = values / one.distribution.middle
        else:
            offsets[:, n] = values - one.distribution.middle
    return MemberChanges(tuple(tolerances), factors, offsets)
