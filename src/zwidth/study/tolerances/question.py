"""`ToleranceQuestion`: a device, its tolerances, and what is asked of the devices that are produced.

`wall_is_stable`: whether the wanted wall is stable, as a measure of many devices at once.

`question_over`: a question from the arguments of `tolerance`, by the same checks as of a study file.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from zwidth.chart.point_chart import check_at
from zwidth.chart.table_radii import radii_at_points
from zwidth.chart.verdict import NEAR, STABLE, UNDECIDED
from zwidth.device.address import is_number, table
from zwidth.device.device import Device
from zwidth.device.faults import Fault, KeyPath
from zwidth.errors import ChartError, DeviceError, as_argument
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import Measure, MeasureValues, WantedWall, WantedWalls
from zwidth.measures.evaluation import complete_pointwise
from zwidth.measures.preconditions import walls_of
from zwidth.model.argument_checks import check_kind, wrong_type
from zwidth.resources import check_memory
from zwidth.study.designs.axis_tables import TableFaults
from zwidth.study.designs.column import Column, column_named
from zwidth.study.designs.sampling import Axis, Sampling
from zwidth.study.designs.study import Study, check_study
from zwidth.study.designs.study_file import measures_in_file, plain_value, read_document, study_of
from zwidth.study.designs.sweep import PER_VALUE
from zwidth.study.tolerances.distribution import Tolerance
from zwidth.study.tolerances.intervals import draws_needed
from zwidth.study.tolerances.tolerance_tables import tolerances_of

SAMPLES: Final = 1000
INDEX_SAMPLES: Final = 512
# Of a wall that three devices in a hundred lose by one tolerance, 92 % of the intervals of a total index hold the
# truth with 32 base samples, 59 % with 16, 20 % with 4; all resamples of a single one are alike, and its interval
# is a point (tests/study/test_tolerance_coverage.py).
LEAST_INDEX_SAMPLES: Final = 32
QUANTILES: Final = (5.0, 50.0, 95.0)
SEED: Final = 1
PER_NUMBER: Final = 12  # numbers of memory for each number of a device that differs
PER_CHART: Final = 16000  # numbers of memory for the edge of each drawn device on some 600 lines of the bands
STIFFEST: Final = "stiffness_max"  # is asked of every device, whether the study names it or not
OF_A_SWEEP: Final = ("axis", "sampling", "count", "optimise")  # what a study of tolerances leaves aside
WALL: Final = ("stiffness_N_per_m", "damping_Ns_per_m")


@dataclass(frozen=True, repr=False)
class ToleranceQuestion:
    """What is asked of devices as they are produced.

    study          the device, and where and what is measured of each
    tolerances     how its numbers differ from one produced device to the next
    samples        devices drawn
    index_samples  base samples of the sensitivity indices, a power of 2 from LEAST_INDEX_SAMPLES on; 0: no indices
    quantiles      shares 0..1, ascending, of the quantiles of measures and the bands of the chart
    seed           of the random numbers
    aside          keys of the study file that are for other commands
    """

    study: Study
    tolerances: tuple[Tolerance, ...]
    samples: int = SAMPLES
    index_samples: int = INDEX_SAMPLES
    quantiles: tuple[float, ...] = tuple(one / 100.0 for one in QUANTILES)
    seed: int = SEED
    aside: tuple[str, ...] = ()

    def __repr__(self) -> str:
        keys = ", ".join(one.key for one in self.tolerances)
        return (
            f"ToleranceQuestion: {self.samples} devices like {self.study.device.label!r}, which differ in {keys}"
        )

    @property
    def has_wall(self) -> bool:
        """Whether a wall is wanted, whose probability is asked for."""
        return self.study.wall.stiffness is not None

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns to compute of each device: the largest stiffness, the study's measures, and `WALL_IS_STABLE`."""
        asked = self.study.columns
        stiffest = column_named(STIFFEST)
        if self.study.turns:
            stiffest = replace(stiffest, measure=stiffest.measure.about_moments())  # in N m/rad
        missing = () if STIFFEST in [one.name for one in asked] else (stiffest,)
        return (*missing, *asked, *((WALL_IS_STABLE,) if self.has_wall else ()))

    def study_of(self, axes: Sequence[Axis], columns: Sequence[Column]) -> Study:
        """The study of devices of which the n-th has the n-th value of every axis."""
        return replace(self.study, sampling=Sampling(tuple(axes), paired=True), columns=tuple(columns))


def read_question(
    path: str | os.PathLike[str], samples: int | None = None, seed: int | None = None
) -> ToleranceQuestion:
    """What a study file asks of produced devices.

    samples, seed  in place of those in the file
    Raises DeviceError  with all faults of the file, those of the device file it names among them
           TooLarge     where the devices would not fit into memory
    """
    label = os.fspath(path)
    return question_of(read_document(label), label, samples, seed)


def question_of(
    document: dict[str, Any], label: str = "study", samples: int | None = None, seed: int | None = None
) -> ToleranceQuestion:
    """What a document asks of produced devices; see `read_question`. `samples` and `seed` take the place of those
    of its [draw]."""
    found: list[Tolerance] = []
    given = table(document, "draw")
    draw = given | {key: value for key, value in (("samples", samples), ("seed", seed)) if value is not None}
    of_tolerances = {key: value for key, value in document.items() if key not in OF_A_SWEEP} | (
        {"draw": draw} if draw else {}
    )
    if document.get("sampling") == "latin-hypercube":
        of_tolerances.pop("seed", None)  # it is the hypercube's
    if "draw" in document and not isinstance(document["draw"], dict):
        of_tolerances["draw"] = document["draw"]  # the schema reports it

    def further(device: Device | None, faults: TableFaults) -> None:
        """Note the tolerances, and add the faults of tolerances, wall and [draw]."""
        found.extend(tolerances_of(document, device, faults))
        faults += wall_faults(document)
        faults += draw_faults(draw)

    study = study_of(of_tolerances, label, needs=("tolerance",), further=further)
    aside = tuple(key for key in document if key in OF_A_SWEEP)
    return replace(question_with(study, tuple(found), draw), aside=aside)


def question_with(study: Study, tolerances: tuple[Tolerance, ...], draw: Mapping[str, Any]) -> ToleranceQuestion:
    """The question of a study without faults; `draw` is its table of this name. Raises TooLarge."""
    question = ToleranceQuestion(
        study=study,
        tolerances=tolerances,
        samples=draw.get("samples", SAMPLES),
        index_samples=draw.get("index_samples", INDEX_SAMPLES),
        quantiles=tuple(sorted({float(one) / 100.0 for one in draw.get("quantiles_percent", QUANTILES)})),
        seed=draw.get("seed", SEED),
    )
    check_size(question)
    return question


def wall_faults(document: Mapping[str, Any], names: Mapping[str, str] | None = None) -> TableFaults:
    """The fault of a wall of which one number is missing.

    names  what keys are called where they come from arguments
    """
    there = [key for key in WALL if key in document]
    if len(there) != 1:
        return []
    missing = next(key for key in WALL if key not in document)
    shown = (names or {}).get(missing, missing)
    return [((there[0],), f"needs {shown} beside it: the probability that this wall is stable")]


def draw_faults(draw: Mapping[str, Any]) -> TableFaults:
    """Faults of numbers of [draw] that the schema does not see."""
    faults: TableFaults = []
    size = draw.get("index_samples")
    if isinstance(size, int) and 0 < size < LEAST_INDEX_SAMPLES:
        message = f"must be at least {LEAST_INDEX_SAMPLES}, or 0 for no indices, got {size}: intervals of so few"
        faults.append((("draw", "index_samples"), f"{message} do not hold the truth"))
    elif isinstance(size, int) and size > 0 and size & (size - 1):
        near = 1 << (size.bit_length() - 1)
        faults.append((("draw", "index_samples"), f"must be a power of 2, got {size}; give {near} or {2 * near}"))
    quantiles = draw.get("quantiles_percent")
    given = quantiles if isinstance(quantiles, list) else []
    for n, one in enumerate(given):
        if is_number(one) and not 0.0 < one < 100.0:
            faults.append((("draw", "quantiles_percent", n), f"must be between 0 and 100, got {one:g}"))
    samples = draw.get("samples", SAMPLES)
    inside = [one for one in given or QUANTILES if is_number(one) and 0.0 < one < 100.0]
    if isinstance(samples, int) and samples > 0 and inside:
        extreme = max(inside, key=lambda one: draws_needed(one / 100.0))
        needed = draws_needed(extreme / 100.0)
        if samples < needed:
            message = f"{samples} devices bound no quantile of {extreme:g} %; give {needed} or more"
            faults.append((("draw", "samples"), message))
    return faults


def check_size(question: ToleranceQuestion) -> None:
    """Raises TooLarge where the devices would not fit into memory, before any of them is drawn."""
    count = len(question.tolerances)
    numbers = sum(1 + len(one.ties) for one in question.tolerances)
    # drawn, once more with each tolerance narrower; Sobol's two matrices, and one for each tolerance
    devices = question.samples * (1.0 + count) + question.index_samples * (count + 2.0)
    check_memory(
        devices * (PER_VALUE * len(question.columns) + PER_NUMBER * numbers) + PER_CHART * question.samples,
        f"{devices:.0f} devices, {question.samples} drawn and the others for indices and narrower tolerances,",
        "lower samples or index_samples",
    )


def wall_is_stable(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """1 where the wanted wall is stable, 0 where it is unstable; undecided within rounding, as `zwidth check`.

    Far from the unit circle the spectral radius decides, of all points together; near it each point is judged
    alone, with the rounding error of its own eigenvalue.
    """
    K, B = walls_of(wanted, point.shape)
    # a single point has the digits that `Loop.check` has
    radii = radii_at_points(point, K, B) if point.shape else np.full((), np.nan)
    known = np.where(radii < 1.0 - NEAR, 1.0, np.where(radii > 1.0 + NEAR, 0.0, np.nan))

    def verdict_alone(at: tuple[int, ...]) -> float:
        """1 or 0 by the verdict on the wall of one point, given by its index. Raises ChartError if undecided."""
        verdict = int(check_at(point[at], [K[at]], [B[at]]).verdict[0])
        if verdict == UNDECIDED:
            raise ChartError("the wall lies on the stability limit, as far as rounding tells")
        return float(verdict == STABLE)

    return complete_pointwise(known, verdict_alone, point)


WALL_IS_STABLE: Final = Column(
    "wall_is_stable",
    Measure(
        name="wall_is_stable",
        title="Whether the wanted wall is stable",
        unit="",
        better="higher",
        source="eigenvalues",
        function=f"{__name__}:wall_is_stable",
        of_wall=True,
        of_designs=True,
    ),
)


LABEL: Final = "tolerance"
ARGUMENTS: Final = {
    "at": "position",
    "stiffness_N_per_m": "stiffness",
    "damping_Ns_per_m": "damping",
    "frequency_Hz": "frequency",
    "tolerance": "tolerances",
}


def question_over(
    device: Device,
    tolerances: Mapping[str, Mapping[str, Any]],
    measures: str | Measure | Sequence[str | Measure],
    user_measures: Mapping[str, Measure] | None,
    circumstances: Mapping[str, Any],
    draw: Mapping[str, Any],
) -> ToleranceQuestion:
    """The question of the arguments of `tolerance`.

    circumstances, draw  values by key of a study file and of its [draw]; None where they are not given
    Raises  DeviceError  with all faults found
            TooLarge     where the devices would not fit into memory
            TypeError    for arguments of another kind
    """
    check_kind("device", device, Device)
    names, by_name = measures_in_file(measures, user_measures)
    # joint angles by name are no position that the study's check reads: the device looks at them below
    angles = circumstances.get("at") if isinstance(circumstances.get("at"), Mapping) else None
    given = {
        key: plain_value(value)
        for key, value in circumstances.items()
        if value is not None and value is not angles
    }
    drawn = {key: plain_value(value) for key, value in draw.items() if value is not None}
    document: dict[str, Any] = {
        "device": device.label,
        **({"measures": names} if names else {}),
        "tolerance": _tolerance_tables(tolerances),
        **given,
        **({"draw": drawn} if drawn else {}),
    }
    faults: TableFaults = []
    study = check_study(document, LABEL, device, {}, by_name, faults, spelling=as_argument, needs=("tolerance",))
    found = tolerances_of(document, device, faults)
    faults += wall_faults(document, ARGUMENTS) + draw_faults(drawn)
    if angles is not None:
        try:
            device.position(angles)
        except DeviceError as error:
            faults.append((("at",), error.faults[0].message))
    if faults or study is None:
        raise DeviceError([_fault_of_argument(path, message, list(tolerances)) for path, message in faults])
    return question_with(study if angles is None else replace(study, at=angles), found, drawn)


def _tolerance_tables(tolerances: Any) -> list[dict[str, Any]]:
    """The argument `tolerances` as the [[tolerance]] tables of a study file. Raises TypeError for another kind of
    argument, and ValueError for an empty one."""
    if not isinstance(tolerances, Mapping):
        raise wrong_type("tolerances", "a dictionary of paths and distributions", tolerances)
    if not tolerances:
        raise ValueError(
            "tolerances has no path; write such as {'loop.delay_samples': {'distribution': 'uniform', 'low': 0.3, "
            "'high': 0.6}}"
        )
    for key, given in tolerances.items():
        if not isinstance(key, str):
            raise wrong_type("tolerances", "a dictionary whose keys are paths", key)
        if not isinstance(given, Mapping):
            raise wrong_type(f"tolerances[{key!r}]", "a dictionary such as {'distribution': 'normal', ...}", given)
    return [
        {"key": key, **{name: plain_value(value) for name, value in table.items()}}
        for key, table in tolerances.items()
    ]


def _fault_of_argument(path: KeyPath, message: str, keys: list[str]) -> Fault:
    """The fault at a path of the document that `question_over` makes, under the argument that it came from; `keys`
    are the paths of the tolerances, in order."""
    first, *rest = path
    if first == "draw" and rest:
        first, *rest = rest
    if first == "tolerance" and rest and isinstance(rest[0], int):
        rest = [keys[rest[0]], *rest[1:]] if rest[1:] != ["key"] else []  # the message names the key
    argument = ARGUMENTS.get(str(first), str(first))
    return Fault(argument, ".".join(map(str, rest)), message)
