"""Command-line options of every question about a device: posture, direction, model, operator, settings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.processors import PROCESSORS
from zwidth.show.circumstances import AS_GIVEN
from zwidth.show.cli.errors import BadInput
from zwidth.study.boundary.points_file import wall_number

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint


if TYPE_CHECKING:
    from zwidth.arrays import Floats
    from zwidth.device.device import Device
    from zwidth.loop.operating_point import OperatingPoint

    ParamType = click.ParamType[Any]
else:
    ParamType = click.ParamType  # generic in newer releases only

MODELS: Final = ("full", "two-mass", "motor-mass", "rigid")
EXTREMES: Final = ("worst", "best", "lowest", "highest")  # as in study.extreme_direction

Callback = Callable[..., int]


@dataclass(frozen=True)
class Question:
    """A device and the circumstances of a question about it, as typed; None where left out."""

    name: str
    settings: tuple[str, ...] = ()
    at: tuple[float, ...] | dict[str, float] | None = None
    direction: tuple[float, ...] | None = None
    axis: tuple[float, ...] | None = None
    characteristic_length: float | None = None
    orientation: tuple[float, ...] | None = None
    assembly: str | None = None
    model: str | None = None
    operator: str | None = None
    load: tuple[float, ...] | None = None
    gravity: tuple[float, ...] | None = None

    def device(self) -> Device:
        """The device, loaded and checked, under its load. Raises DeviceError."""
        from zwidth.device.load import load

        device = load(self.name, self.settings, self.operator)
        if self.load is None and self.gravity is None:
            return device
        moment = device.renders_moments(self.direction, self.axis, self.characteristic_length)
        return device.under(self.load, self.gravity, moment=moment)

    def point(self, device: Device) -> OperatingPoint:
        """The device's operating point. Raises what `Device.at` raises."""
        return device.at(
            self.at,
            self.direction,
            axis=self.axis,
            characteristic_length=self.characteristic_length,
            orientation=self.orientation,
            assembly=self.assembly,
            model=self.model,
        )

    def screw(self, device: Device) -> Floats:
        """The rendered direction, (3,), or with an axis a screw (6,), of a device with a mechanism."""
        return device.direction(self.direction, self.axis, self.characteristic_length)

    def is_about_moments(self, device: Device) -> bool:
        """Whether moments about an axis are rendered, so that the answer is in N m/rad."""
        return device.renders_moments(self.direction, self.axis, self.characteristic_length)

    def refuse_unsupported(self, device: Device) -> None:
        """Raises BadInput for what directions computed together leave out."""
        from zwidth.errors import SeveralDirectionsError
        from zwidth.loop.posed_device import check_several_directions

        instead = {
            "an operator": "use --operator none",
            "a load": "leave out --load and --gravity, and [load]",
            "an encoder on the link": "use --set loop.encoder.at=motor",
            "electrical damping": "unset damping_resistance_ohm",
        }
        try:
            check_several_directions(device.mechanism, device.operator, device.encoders, device.load)
        except SeveralDirectionsError as error:
            several = "is not supported over several directions"
            lines = [
                f"{self.name}: {what} {several}; {instead[what]}, or ask for one direction"
                for what in error.obstacles
            ]
            raise BadInput(*lines) from None

    def model_of(self, device: Device) -> str:
        """The model's name, also where none was typed."""
        return self.model or ("full" if device.mechanism else AS_GIVEN)

    def operator_of(self, device: Device) -> str | None:
        """What the operator at the handle is called; None where nobody holds it, or the model holds it fixed."""
        return None if self.model == "motor-mass" else device.operator_name

    def linear_circumstances(self, device: Device) -> dict[str, Any]:
        """What a linear result states first: its circumstances, and what of the device it leaves out."""
        return self.circumstances(device) | {"left_out": list(device.omissions(self.model))}

    def _where(self, device: Device) -> tuple[Floats | None, float | None]:
        """Position of the handle [m], and how far it was projected; as typed, and None, if out of reach."""
        from zwidth.errors import LoadError, PostureError

        try:
            posture = self.point(device).posture
        except (PostureError, LoadError):
            return (None if isinstance(self.at, dict) else device.position(self.at)), None
        assert posture is not None
        return posture.position, float(posture.projected)

    def circumstances(self, device: Device) -> dict[str, Any]:
        """Name, place and sampling as a result states them; null where inapplicable."""
        from zwidth.loop.linear_omissions import load_omissions

        mechanism = device.mechanism is not None
        of_load = load_omissions(device.mechanism, device.load, self.model)
        position, projected = self._where(device) if mechanism else (None, None)
        return {
            "name": device.name,
            "device": self.name,
            "position_m": position,
            "projected_m": projected,
            **self._rendered(device),
            "assembly": self.assembly or device.reference_assembly,
            "model": self.model_of(device),
            "operator": self.operator_of(device),
            **({} if device.load is None else {"load": device.document["load"]}),
            "sampling_period_s": device.controller.sampling_period,
            "delay_samples": device.controller.delay,
            **({"left_out": list(of_load)} if of_load else {}),
        }

    def _rendered(self, device: Device) -> dict[str, Any]:
        """Direction and axis as a result states them; null where there is none."""
        if device.mechanism is None:
            return {"direction": None}
        rendered = self.screw(device)
        if rendered.shape[-1] == 3:
            return {"direction": rendered}
        return {"direction": rendered[:3] if rendered[:3].any() else None, "axis": rendered[3:]}


class PostureType(ParamType):
    """A handle's position, or the angles of driven joints by name."""

    name = "posture"

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        return "X,Y[,Z]|JOINT=RAD,..."

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str) or "=" not in value:
            return Numbers("", (2, 3), "0.1,0.25").convert(value, param, ctx)
        angles: dict[str, float] = {}
        for part in value.split(","):
            joint, _, text = part.partition("=")
            try:
                angle = float(text)
            except ValueError:
                angle = math.nan
            if not joint.strip() or not math.isfinite(angle):
                self.fail(
                    f"must be joints with angles in rad such as upper=0.6,lower=1.2, got {value!r}", param, ctx
                )
            if joint.strip() in angles:
                self.fail(f"names {joint.strip()} twice, got {value!r}", param, ctx)
            angles[joint.strip()] = angle
        return angles


class Numbers(ParamType):
    """Numbers with commas between them: 0.1,-0.25."""

    name = "numbers"

    def __init__(self, shape: str, lengths: tuple[int, ...], example: str) -> None:
        self.shape, self.lengths, self.example = shape, lengths, example

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        return self.shape

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(part) for part in value.split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in self.lengths or not all(map(math.isfinite, numbers)):
            count = " or ".join(map(str, self.lengths))
            self.fail(f"must be {count} finite numbers such as {self.example}, got {value!r}", param, ctx)
        return numbers


class Finite(ParamType):
    """One number of a wall."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number, fault = wall_number(str(value))
        if fault:
            self.fail(fault, param, ctx)
        return number


def check_not_empty(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """A callback that refuses an empty name."""
    if value == "":
        raise click.BadParameter("is empty; give a name (is a variable of the shell not set?)")
    return value


class DirectionType(Numbers):
    """A direction, or which of all of them."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return value if value in EXTREMES else super().convert(value, param, ctx)


with_settings_option: Final = click.option(
    "--set",
    "settings",
    metavar="PATH=VALUE",
    multiple=True,
    help="Change a number of the device file; repeatable. PATH=unset removes it.",
)

LOAD_OPTIONS: Final = (
    click.option(
        "--load",
        type=Numbers("FX,FY[,FZ]", (2, 3), "0,-5"),
        help="Force of the hand on the handle [N], about an axis its moment [N m], under which the device is "
        "linearised. Default: the [load] of DEVICE.",
    ),
    click.option(
        "--gravity",
        type=Numbers("GX,GY[,GZ]", (2, 3), "0,0,-9.81"),
        help="Gravity [m/s²]. Default: the [load] of DEVICE.",
    ),
)


DEVICE: Final = click.argument("device", metavar="DEVICE", callback=check_not_empty)


def about_a_device(command: Callback, loads: bool = True, device: Any = DEVICE) -> Callback:
    """Give a command DEVICE and the options of posture, direction, load, model and operator, as one `Question`.

    loads   whether it has the options of a load
    device  the argument, or the option, that names the device
    """
    return _with_device_options(
        command,
        device,
        click.option(
            "--at",
            type=PostureType(),
            help="Posture: the handle's position [m], or the driven joints' angles [rad].",
        ),
        click.option(
            "--direction",
            type=Numbers("DX,DY[,DZ]", (2, 3), "0,1"),
            help="Rendered direction, a vector of any length.",
        ),
        click.option(
            "--axis",
            type=Numbers("AX,AY,AZ", (3,), "0,0,1"),
            help="Axis about which moments are rendered, of any length; walls then are in N m/rad. With "
            "--direction: a screw.",
        ),
        click.option(
            "--characteristic-length",
            type=float,
            metavar="METRES",
            help="Length by which angles count as ways on a screw [m].",
        ),
        click.option(
            "--orientation",
            type=Numbers("ROLL,PITCH,YAW", (3,), "0,0,1.57"),
            help="Orientation of the handle [rad], where the drives control it.",
        ),
        *(LOAD_OPTIONS if loads else ()),
    )


processor_option: Final = click.option(
    "--processor",
    type=click.Choice(PROCESSORS),
    default="cpu",
    show_default=True,
    help="Where charts are computed; cuda: on an NVIDIA GPU.",
)


def about_a_workspace(command: Callback) -> Callback:
    """The same for a command about all postures, along one direction or the extreme ones; `extreme` is which."""

    @wraps(command)
    def with_extreme(question: Question, **more: Any) -> int:
        direction: Any = question.direction
        extreme = direction if isinstance(direction, str) else None
        return command(replace(question, direction=None if extreme else direction), extreme=extreme, **more)

    choice = "|".join(EXTREMES)
    return _with_device_options(
        with_extreme,
        DEVICE,
        click.option(
            "--direction",
            type=DirectionType(f"DX,DY[,DZ]|{choice}", (2, 3), f"0,1, or one of {', '.join(EXTREMES)}"),
            help="Rendered direction, a vector of any length; worst: in each cell the direction in which the "
            "measure is worst.",
        ),
        *LOAD_OPTIONS,
    )


def about_every_posture(command: Callback) -> Callback:
    """The same for a command about all postures and all directions."""
    return _with_device_options(command, DEVICE)


def _with_device_options(command: Callback, device: Any, *where: Any) -> Callback:
    """The device, the options `where`, and those that every question about a device has."""
    takes_loads = LOAD_OPTIONS[0] in where

    @wraps(command)
    def with_arguments(
        device: str,
        assembly: Any,
        model: Any,
        operator: Any,
        settings: Any,
        direction: Any = None,
        at: Any = None,
        axis: Any = None,
        characteristic_length: Any = None,
        orientation: Any = None,
        load: Any = None,
        gravity: Any = None,
        **more: Any,
    ) -> int:
        screw = axis, characteristic_length, orientation
        question = Question(device, settings, at, direction, *screw, assembly, model, operator)
        if takes_loads:
            question = replace(question, load=load, gravity=gravity)
        else:
            more["gravity"] = gravity  # the command's own
        return command(question, **more)

    for decorate in reversed(_device_decorators(device, where)):
        with_arguments = decorate(with_arguments)
    return with_arguments


def _device_decorators(device: Any, where: tuple[Any, ...]) -> list[Any]:
    """Return the decorators of the device, of the options `where`, and of those that every question about a device
    has, in the order of the help."""
    return [
        device,
        *where,
        click.option("--assembly", metavar="NAME", help="Way of assembling the mechanism."),
        click.option(
            "--model",
            type=click.Choice(MODELS),
            help="How much of the device is modelled. Default: full; a [plant] as it is given.",
        ),
        click.option(
            "--operator",
            metavar="NAME|FILE|none",
            callback=check_not_empty,
            help="Who holds the handle: a bundled operator, a file with an [operator], or nobody. Default: the "
            "[operator] of DEVICE.",
        ),
        with_settings_option,
    ]


def output_option(what: str) -> Callable[[Callback], Callback]:
    """`--output FILE`, with what its ending may be."""
    return click.option("--output", metavar="FILE", callback=check_not_empty, help=what)


as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")


def example(*lines: str) -> str:
    """An epilog with example command lines, kept as they are."""
    return "\b\nExample:\n" + "\n".join(f"  {line}" for line in lines)
