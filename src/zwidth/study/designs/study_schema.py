"""The keys of a study file with their types and limits; `study.check_study` checks how they go together."""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, Field

from zwidth.argument import LARGEST, Argument
from zwidth.device.address import is_number
from zwidth.device.faults import KeyPath, quote, suggestion
from zwidth.device.schema.value_types import (
    VERSION,
    Bounds,
    Direction,
    Number,
    Position,
    Section,
    Text,
    WholeNumber,
    documented_key,
)
from zwidth.model.reduction import Model
from zwidth.questions import DEVICE, MAP, TOLERANCE, WANTED

MOST: Final = 10**9  # designs along one axis, and in all; a larger number is a typing error
LEAST_SEED: Final = 0


def key_of(argument: Argument) -> Any:
    """The documented key of an argument, with its limits."""
    limits: dict[str, float] = {}
    if argument.kind in ("number", "whole"):
        low, high = ("ge", argument.least), ("le", argument.most)
        low = ("gt", argument.above) if isfinite(argument.above) else low
        limits = {name: value for name, value in (low, high) if abs(value) < LARGEST}
    text = argument.sentence[0].lower() + argument.sentence[1:]
    text += f"; left out: {argument.left_out}" if argument.left_out else ""
    return documented_key(text, argument.unit or None, default=None, **limits)


def _tie_as_table(value: Any) -> Any:
    """A tie as a table: one that is written as its key alone becomes a table with that key. Raises ValueError."""
    if not isinstance(value, str | dict):
        raise ValueError(f"must be a path, or a table with a key, got {quote(value)}")
    return {"key": value} if isinstance(value, str) else value


def _count_of_both_axes(value: Any) -> Any:
    """A single count as a list of it for both axes of the grid; anything else as given."""
    return [value, value] if is_number(value) else value


def _plane(value: Any) -> Any:
    """The name of a plane or the six numbers of its axes, as given. Raises ValueError for anything else."""
    if isinstance(value, str) or (isinstance(value, list) and len(value) == 6 and all(map(is_number, value))):
        return value
    raise ValueError(f"must be 'xy', 'xz', 'yz' or six numbers, got {quote(value)}")


class TieSection(Section):
    """A number that changes together with the number of an axis."""

    key: Text = documented_key("the number that changes with the axis: a dotted path of the device file")
    factor: Number | None = documented_key("this number is factor times the axis's value", default=None)
    power: Number | None = documented_key(
        "this number is its value in the file, times (the axis's value over that in the file) to this power",
        default=None,
    )


TieEntry = Annotated[TieSection, BeforeValidator(_tie_as_table)]


class AxisSection(Section):
    """What is varied: a number of the device file, or a circumstance."""

    key: Text = documented_key(
        "what is varied: a dotted path of the device file, a circumstance such as assembly, or with a catalogue a "
        "name for what it holds"
    )
    range: Bounds | None = documented_key("lowest and highest value", default=None)
    count: WholeNumber | None = documented_key(
        "number of values in the range, both ends included", ge=1, le=MOST, default=None
    )
    values: tuple[Any, ...] | None = documented_key("the values", min_length=1, default=None)
    scale: Literal["linear", "log"] = documented_key("how the range is divided", default="linear")
    integer: bool = documented_key("whether an optimiser takes whole numbers of the range alone", default=False)
    catalogue: Text | None = documented_key(
        "a CSV file beside this one, of parts to choose from: a column 'name', and columns of numbers",
        default=None,
    )
    set: dict[Text, Text] = documented_key(
        "for a catalogue: path of the device file -> the column that holds its number", default={}
    )
    tie: tuple[TieEntry, ...] = documented_key("a list of numbers that change with this one", default=())


class ToleranceSection(Section):
    """How a number of the device file differs from one produced device to the next."""

    key: Text = documented_key("the number that differs: a dotted path of the device file")
    distribution: Literal["normal", "uniform", "triangular", "lognormal"] = documented_key(
        "how its values are distributed"
    )
    standard_deviation: Number | None = documented_key("of a normal one, in the number's unit", gt=0, default=None)
    standard_deviation_percent: Number | None = documented_key(
        "of a normal or lognormal one, in percent of the number", gt=0, default=None
    )
    plus_minus: Number | None = documented_key(
        "largest difference, of a uniform or triangular one, in the number's unit", gt=0, default=None
    )
    plus_minus_percent: Number | None = documented_key(
        "largest difference, of a uniform or triangular one, in percent of the number", gt=0, default=None
    )
    low: Number | None = documented_key(
        "least value of a uniform or triangular one; of a normal or lognormal one the lower end of the interval "
        "that holds 95 % of its values",
        default=None,
    )
    high: Number | None = documented_key("the upper one, see low", default=None)
    cut_at_deviations: Number | None = documented_key(
        "standard deviations from the middle at which a normal or lognormal one is cut off; left out: 4",
        gt=0,
        default=None,
    )
    tie: tuple[TieEntry, ...] = documented_key("a list of numbers that change with this one", default=())


class DrawSection(Section):
    """How `zwidth tolerance` draws devices, and what it says of them."""

    samples: WholeNumber | None = key_of(TOLERANCE["samples"])
    index_samples: WholeNumber | None = key_of(TOLERANCE["index_samples"])
    quantiles_percent: tuple[Number, ...] | None = documented_key(
        "of measures and of charts; left out: 5, 50 and 95", "%", min_length=1, default=None
    )
    seed: WholeNumber | None = key_of(TOLERANCE["seed"])


class StudyWorkspaceSection(Section):
    """The grid in a plane on which measures over a workspace are computed."""

    plane: Annotated[Any, BeforeValidator(_plane)] = documented_key("xy, xz, yz or six numbers", default=None)
    through_m: Position | None = key_of(MAP["through"])
    x_m: Bounds | None = key_of(MAP["x_range"])
    y_m: Bounds | None = key_of(MAP["y_range"])
    count: Annotated[
        tuple[Annotated[WholeNumber, Field(ge=2, le=MOST)], ...],
        Field(min_length=2, max_length=2),
        BeforeValidator(_count_of_both_axes),
    ] = documented_key("points along both axes, or along each", default=(15, 15))


def _as_list(value: Any) -> Any:
    """A single number as a list of it; anything else as given."""
    return [value] if is_number(value) else value


Counts = Annotated[
    tuple[Annotated[WholeNumber, Field(ge=1, le=MOST)], ...],
    Field(min_length=1, max_length=3),
    BeforeValidator(_as_list),
]
Span = Annotated[tuple[Number, ...], Field(min_length=2, max_length=2)]


class TaskSection(Section):
    """What the device is for: where it must reach, along which directions, held by whom, and what is demanded
    everywhere there."""

    box_m: Annotated[tuple[Span, ...], Field(min_length=2, max_length=3)] | None = documented_key(
        "a box that must be reached: [lower, upper] along x, y and in space z", "m", default=None
    )
    center_m: Position | None = documented_key("centre of a disk, or in space of a ball", "m", default=None)
    radius_m: Number | None = documented_key("radius of the disk or ball", "m", gt=0, default=None)
    points_m: Annotated[tuple[Position, ...], Field(min_length=1)] | None = documented_key(
        "points that must be reached", "m", default=None
    )
    count: Counts | None = documented_key(
        "points of a box along all axes, or along each; rings of a disk, shells of a ball", default=None
    )
    directions: (
        Annotated[WholeNumber, Field(ge=1, le=MOST)] | Annotated[tuple[Direction, ...], Field(min_length=1)] | None
    ) = documented_key("how many directions, spread evenly, or a list of them", default=None)
    operators: tuple[Text, ...] = documented_key(
        "who holds the device: bundled names, files beside this one, none", min_length=1, default=()
    )
    peak_force_N: Number | None = documented_key("least peak force", "N", gt=0, default=None)
    continuous_force_N: Number | None = documented_key("least continuous force", "N", gt=0, default=None)
    friction_N: Number | None = documented_key("largest dry friction felt", "N", gt=0, default=None)
    apparent_mass_kg: Number | None = documented_key("largest mass felt", "kg", gt=0, default=None)
    resolution_m: Number | None = documented_key("largest step of the position", "m", gt=0, default=None)
    motor_heat_W: Number | None = documented_key(
        "largest heat of all windings while force_N, or else continuous_force_N, is held", "W", gt=0, default=None
    )
    first_mode_Hz: Number | None = documented_key("least first flexible mode", "Hz", gt=0, default=None)
    distance_to_singularity: Number | None = documented_key(
        "least reciprocal condition number of the homogeneous Jacobian", gt=0, le=1, default=None
    )
    joint_margin: Number | None = documented_key(
        "least distance of the joints from their limits, in half ranges", gt=0, le=1, default=None
    )
    clearance_m: Number | None = documented_key(
        "least clearance between links, see link_radius_m and colliding_links", "m", ge=0, default=None
    )
    footprint_radius_m: Number | None = documented_key(
        "radius about the middle of the base that no link leaves", "m", gt=0, default=None
    )


class OptimiseSection(Section):
    """What `zwidth optimise` reads besides; `zwidth sweep` does not read it."""

    objectives: dict[Text, Literal["max", "min"]] = documented_key(
        'measure -> "max" or "min"', default={}, min_length=1
    )
    constraints: dict[Text, Text] = documented_key('measure -> such as "<= 0.3"', default={})
    budget: WholeNumber | None = documented_key("designs to try", ge=1, le=MOST, default=None)
    seed: WholeNumber | None = documented_key("seed of the random numbers", ge=LEAST_SEED, default=None)
    front: WholeNumber | None = documented_key(
        "designs of the front to keep, at most", ge=1, le=1000, default=None
    )
    tolerance_members: WholeNumber | None = documented_key(
        "devices within the [[tolerance]]s by which each design is judged besides as it is, by the worst; left "
        "out: none, tolerances are bars of the front alone",
        ge=1,
        le=1000,
        default=None,
    )


class StudyFile(Section):
    """Many designs of one device, and the measures to compute for each."""

    file_version: WholeNumber = VERSION
    device: Text = documented_key("a bundled name, or a file beside this one")
    measures: tuple[Text, ...] = documented_key(
        "the measures to compute for each design; an optimiser computes those of [optimise]",
        min_length=1,
        default=(),
    )
    measures_file: Text | None = documented_key("a file of your own measures, beside this one", default=None)
    sampling: Literal["grid", "latin-hypercube", "paired"] = documented_key(
        "how designs are spread over the axes", default="grid"
    )
    count: WholeNumber | None = documented_key("designs of a Latin hypercube", ge=1, le=MOST, default=None)
    seed: WholeNumber | None = documented_key(
        "seed of the random numbers of a Latin hypercube", ge=LEAST_SEED, default=None
    )
    axis: tuple[AxisSection, ...] = documented_key("what is varied, one [[axis]] each", min_length=1, default=())
    tolerance: tuple[ToleranceSection, ...] = documented_key(
        "how numbers differ from one produced device to the next, one [[tolerance]] each", min_length=1, default=()
    )
    at: Position | None = documented_key("the handle's position", "m", default=None)
    direction: Direction | None = documented_key("the rendered direction", default=None)
    assembly: Text | None = key_of(DEVICE["assembly"])
    model: Model | None = key_of(DEVICE["model"])
    operator: Text | None = documented_key("a bundled operator, a file beside this one, or none", default=None)
    set: tuple[Text, ...] = documented_key('changes of the device file, each "PATH=VALUE"', default=())
    stiffness_N_per_m: Number | None = key_of(WANTED["stiffness"])
    damping_Ns_per_m: Number | None = key_of(WANTED["damping"])
    frequency_Hz: Number | None = key_of(WANTED["frequency"])
    spectral_radius: Number | None = key_of(WANTED["spectral_radius"])
    stiffness_margin: Number | None = key_of(WANTED["stiffness_margin"])
    damping_margin: Number | None = key_of(WANTED["damping_margin"])
    delay_margin_samples: Number | None = key_of(WANTED["delay_margin"])
    lowest_frequency_Hz: Number | None = key_of(WANTED["lowest_frequency"])
    highest_frequency_Hz: Number | None = key_of(WANTED["highest_frequency"])
    force_N: Number | None = key_of(WANTED["force"])
    link_radius_m: Number | None = key_of(WANTED["link_radius"])
    colliding_links: tuple[Text, ...] | None = documented_key(
        'pairs of links that can collide, each "A:B"; all that are no neighbours where left out', default=None
    )
    workspace: StudyWorkspaceSection | None = documented_key("for measures over a workspace", default=None)
    task: TaskSection | None = documented_key("what the device is for", default=None)
    optimise: OptimiseSection | None = documented_key("for an optimiser", default=None)
    draw: DrawSection | None = documented_key("for a study of tolerances", default=None)


_TABLES: Final[dict[str, Any]] = {
    "axis": AxisSection,
    "tolerance": ToleranceSection,
    "tie": TieSection,
    "draw": DrawSection,
    "workspace": StudyWorkspaceSection,
    "task": TaskSection,
    "optimise": OptimiseSection,
}


def _section_of(path: KeyPath) -> Any:
    """The class of the section that the last key of a path stands in."""
    names = [part for part in path[:-1] if isinstance(part, str) and part in _TABLES]
    return _TABLES[names[-1]] if names else StudyFile


def description(path: KeyPath) -> str:
    """What a key of the study file means, with its unit; "" for a value inside a key, such as a list's element.

    >>> description(("workspace", "plane"))
    'xy, xz, yz or six numbers'
    """
    field = _section_of(path).model_fields.get(str(path[-1]))
    if field is None or not field.description:
        return ""
    extra = field.json_schema_extra
    unit = extra.get("unit") if isinstance(extra, dict) else None
    return f"{field.description} [{unit}]" if unit else str(field.description)


def unknown_key_sentence(path: KeyPath) -> str:
    """The sentence on a key that a study file does not have.

    >>> unknown_key_sentence(("axis", 0, "ranges"))
    "is not a key of an [[axis]]; did you mean 'range'?"
    """
    section, key = _section_of(path), str(path[-1])
    here = {
        AxisSection: "an [[axis]]",
        ToleranceSection: "a [[tolerance]]",
        DrawSection: "[draw]",
        TieSection: "a tie",
        StudyWorkspaceSection: "[workspace]",
        TaskSection: "[task]",
        OptimiseSection: "[optimise]",
    }
    place = here.get(section, "a study file")
    return f"is not a key of {place}; {suggestion(key, list(section.model_fields))}"
