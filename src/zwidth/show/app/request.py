"""What a page may ask for, checked before anything is computed."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, TypeAdapter

from zwidth.argument import LARGEST, Argument
from zwidth.model.reduction import Model
from zwidth.questions import SENSITIVITY, SIMULATE

MOST_SETTINGS: Final = 500
LONGEST: Final = 60.0  # s, of a contact that a page waits for

Name = Annotated[str, StringConstraints(min_length=1, max_length=120)]
FileName = Annotated[str, StringConstraints(pattern=r"^[^/\\\x00-\x1f]{1,120}$")]
Number = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-LARGEST, le=LARGEST)]
Point = tuple[Number, Number, Number]
# What a view may show beside the chart's own numbers.
Layer = Literal[
    "chart",
    "decay",
    "frequency",
    "scene",
    "models",
    "guarantees",
    "hands",
    "bounds",
    "impedance",
    "nyquist",
    "eigenvalues",
    "touch",
]


def limits(argument: Argument) -> Any:
    """The limits of an argument, for a field of a request."""
    return Field(gt=argument.above, ge=argument.least, le=argument.most)


class Asked(BaseModel):
    """A part of a request: frozen, and no key beyond those declared."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Wall(Asked):
    """A wall: stiffness K [N/m] and damping B [N s/m], or K [N m/rad] and B [N m s/rad]."""

    stiffness: Number
    damping: Number


class HandRequest(Asked):
    """Who holds the handle, in numbers: an arm of mass, spring and damper to where he wants it, and his grasp.

    grasp_stiffness  None: rigid
    """

    arm_mass: Annotated[Number, Field(ge=0.0)]
    arm_stiffness: Annotated[Number, Field(ge=0.0)]
    arm_damping: Annotated[Number, Field(ge=0.0)]
    grasp_stiffness: Annotated[Number, Field(gt=0.0)] | None = None
    grasp_damping: Annotated[Number, Field(ge=0.0)] = 0.0


class State(Asked):
    """What the page shows: a device with its changed numbers, where it stands, who holds it, and the wall.

    device     name of a bundled device, or of a file that the page has sent
    from_file  whether it is such a file
    settings   dotted path -> value as in --set; None removes the key
    """

    device: FileName
    from_file: bool = False
    settings: Annotated[dict[Name, Any], Field(max_length=MOST_SETTINGS)] = {}
    position: Point | None = None
    direction: Point | None = None
    axis: Point | None = None
    assembly: Name | None = None
    model: Model | None = None
    operator: Name | None = None
    hand: HandRequest | None = None
    wall: Wall | None = None


class Request(Asked):
    """The base of all requests: `id` comes back with the answer."""

    id: Annotated[int, Field(strict=True, ge=0)]


class FileRequest(Request):
    """A file that the page has been given: a device file, a measured response or measured points."""

    kind: Literal["file"]
    name: FileName
    text: str


class OpenRequest(Request):
    """What is known of a device: its numbers for sliders, its words, what can be chosen."""

    kind: Literal["open"]
    state: State


class ViewRequest(Request):
    """What is drawn while a number is dragged.

    nearest  take an answered position where the handle cannot be at that of the state
    """

    kind: Literal["view"]
    state: State
    layers: tuple[Layer, ...] = ("chart",)
    nearest: bool = False


class MoreRequest(Request):
    """The same of layers that take longer, answered beside the views."""

    kind: Literal["more"]
    state: State
    layers: tuple[Layer, ...]


class MapRequest(Request):
    """A measure over the workspace."""

    kind: Literal["map"]
    state: State
    measure: Name
    count: Annotated[int, Field(ge=2, le=120)] = 31


class SensitivityRequest(Request):
    """What to change first; with a goal [N/m], what each number would have to be."""

    kind: Literal["sensitivity"]
    state: State
    goal: Annotated[Number, limits(SENSITIVITY["goal"])] | None = None


class ContactRequest(Request):
    """One contact with the state's wall, simulated."""

    kind: Literal["contact"]
    state: State
    one_sided: bool = False
    velocity: Annotated[Number, limits(SIMULATE["start_velocity"])] = SIMULATE["start_velocity"].default
    depth: Annotated[Number, limits(SIMULATE["start_position"])] = 1e-3
    push: Annotated[Number, limits(SIMULATE["push"])] = 0.0
    duration: Annotated[Number, limits(SIMULATE["duration"]), Field(le=LONGEST)] | None = None


class PointsRequest(Request):
    """Measured points of a file that the page has sent, with the verdict of the state's device on each."""

    kind: Literal["points"]
    state: State
    file: FileName


class ExportRequest(Request):
    """A file to be kept: a figure, data, the device, the report, or lines of Python."""

    kind: Literal["export"]
    state: State
    what: Literal["figure", "data", "device", "report", "python"]
    format: Literal["svg", "png", "pdf", "csv", "json", "toml", "html", "py"]


Computed = (
    OpenRequest
    | ViewRequest
    | MoreRequest
    | MapRequest
    | SensitivityRequest
    | ContactRequest
    | PointsRequest
    | ExportRequest
)
REQUEST: Final[TypeAdapter[Computed | FileRequest]] = TypeAdapter(
    Annotated[Computed | FileRequest, Field(discriminator="kind")]
)
# Requests that are answered beside the view, so that a drag does not wait for them.
BESIDE: Final = frozenset({"more", "map", "sensitivity", "contact", "export", "points"})
