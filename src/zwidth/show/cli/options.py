"""Command-line options of every question about a device: posture, direction, model, operator, settings."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import wraps
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.argument import Argument, Arguments
from zwidth.errors import ArgumentError
from zwidth.questions import DEVICE, LOADS, PLACE, SETTINGS
from zwidth.show.circumstances import AS_GIVEN
from zwidth.show.cli.errors import BadInput, as_option

if TYPE_CHECKING:
    from zwidth.arrays import Floats
    from zwidth.device.device import Device
    from zwidth.loop.operating_point import OperatingPoint

    ParamType = click.ParamType[Any]
else:
    ParamType = click.ParamType  # generic in newer releases only

EXTREMES: Final = ("worst", "best", "lowest", "highest")  # as in study.extreme_direction

Callback = Callable[..., int]
Decorator = Callable[[Any], Any]


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
        """Raise BadInput for parts of the device that directions computed together cannot include."""
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

    def _position_and_projection(self, device: Device) -> tuple[Floats | None, float | None]:
        """Return the handle's position (3,) and how far it was projected [m]; as typed, and None, if out of reach.

        Of angles as typed that are out of reach the position is None, too.
        """
        from zwidth.errors import LoadError, PostureError

        try:
            posture = self.point(device).posture
        except (PostureError, LoadError):
            return (None if isinstance(self.at, dict) else device.position(self.at)), None
        assert posture is not None
        return posture.position, float(posture.projected)

    def circumstances(self, device: Device) -> dict[str, Any]:
        """Name, place and sampling as a result states them; null where inapplicable.

        Only `load` and `left_out` are no keys where there is nothing to state.
        """
        from zwidth.loop.linear_omissions import load_omissions

        mechanism = device.mechanism is not None
        of_load = load_omissions(device.mechanism, device.load, self.model)
        position, projected = self._position_and_projection(device) if mechanism else (None, None)
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


class Numbers(ParamType):
    """Numbers with commas between them, 0.1,-0.25, of a vector; whole ones of counts."""

    name = "numbers"

    def __init__(self, argument: Argument) -> None:
        self.argument = argument

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        return str(self.argument.value)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The numbers as a tuple; fails for a wrong count, or for one that is not finite."""
        if isinstance(value, tuple):
            return value
        argument = self.argument
        whole = argument.kind == "counts"
        try:
            numbers = tuple(int(part) if whole else float(part) for part in value.split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in argument.lengths or not all(map(math.isfinite, numbers)):
            count, kind = " or ".join(map(str, argument.lengths)), "whole" if whole else "finite"
            self.fail(f"must be {count} {kind} numbers such as {argument.example}, got {value!r}", param, ctx)
        return numbers


class PostureType(Numbers):
    """A handle's position, or the angles of driven joints by name."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Coordinates as a tuple, or angles [rad] by joint, of JOINT=RAD,...; fails for others."""
        if not isinstance(value, str) or "=" not in value:
            return super().convert(value, param, ctx)
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


class Ranges(Numbers):
    """Pairs of numbers, of each the lower one first."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The numbers as a tuple; fails where the lower end of a pair is not below the upper one."""
        numbers = super().convert(value, param, ctx)
        if not all(low < high for low, high in zip(numbers[::2], numbers[1::2], strict=True)):
            ends = str(self.argument.value).split(",")
            wanted = " and ".join(f"{low} < {high}" for low, high in zip(ends[::2], ends[1::2], strict=True))
            self.fail(f"needs {wanted}, such as {self.argument.example}; got {value}", param, ctx)
        return numbers


class Number(ParamType):
    """One number, whole or not, within an argument's limits."""

    name = "number"

    def __init__(self, argument: Argument) -> None:
        self.argument = argument

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number; fails where the argument does not allow it."""
        number = value
        with suppress(ValueError):
            number = int(value) if self.argument.kind == "whole" else float(value)
        try:
            self.argument.check(number)
        except ArgumentError as error:
            self.fail(error.reasons[0], param, ctx)
        return number


class Text(ParamType):
    """A name or a file, which is not empty."""

    name = "text"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value == "":
            self.fail("is empty; give a name (is a variable of the shell not set?)", param, ctx)
        return value


class DirectionType(Numbers):
    """A direction, or which of all of them."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return value if value in EXTREMES else super().convert(value, param, ctx)


def option(argument: Argument, kind: ParamType | None = None, **more: Any) -> Decorator:
    """The option of the command line that gives an argument.

    kind  how its value is read; None: by the argument's own kind. A flag has no value
    more  arguments of `click.option` besides
    """
    one = argument
    if one.kind == "flag":
        kind, more = None, {"is_flag": True, "default": one.default, **more}
    elif one.default is not None:
        more["default"] = one.default
    if kind is None and one.kind != "flag":
        kind = {
            "choice": lambda: click.Choice(one.choices),
            "vector": lambda: Numbers(one),
            "counts": lambda: Numbers(one),
            "text": Text,
        }.get(one.kind, lambda: Number(one))()
    return click.option(
        option_name(one),
        one.name,
        type=kind,
        metavar=one.value,
        multiple=one.repeated,
        required=one.required,
        help=one.help,
        **more,
    )


def option_name(argument: Argument) -> str:
    """An argument as the command line spells it.

    >>> option_name(SETTINGS), option_name(PLACE["characteristic_length"])
    ('--set', '--characteristic-length')
    """
    return "/".join(map(as_option, (argument.option or argument.name).split("/")))


def options_of(arguments: Arguments, **kinds: ParamType) -> tuple[Decorator, ...]:
    """The options of a question's arguments, in their order.

    kinds  by the argument's name: how its value is read, where not by its own kind
    """
    return tuple(option(one, kinds.get(name)) for name, one in arguments.items())


def decorated(command: Callback, decorators: Iterable[Decorator]) -> Callback:
    """A command with arguments and options, in the order of its help."""
    for decorate in reversed(list(decorators)):
        command = decorate(command)
    return command


with_settings_option: Final = option(SETTINGS)
DEVICE_NAME: Final = click.argument("device", metavar="DEVICE", type=Text())


def about_a_device(command: Callback, loads: bool = True, device: Decorator = DEVICE_NAME) -> Callback:
    """Give a command DEVICE and the options of posture, direction, load, model and operator, as one `Question`.

    loads   whether it has the options of a load
    device  the argument, or the option, that names the device
    """
    return _with_device_options(command, device, *options_of(PLACE, at=PostureType(PLACE["at"])), loads=loads)


def about_a_workspace(command: Callback) -> Callback:
    """The same as `about_a_device` for a command about all postures.

    The command's argument `extreme` is the word for the direction chosen in each cell, such as "worst"; None: one
    is given.
    """

    @wraps(command)
    def with_extreme(question: Question, **more: Any) -> int:
        """Call the command, with a direction given by a word moved to `extreme`."""
        direction: Any = question.direction
        extreme = direction if isinstance(direction, str) else None
        return command(replace(question, direction=None if extreme else direction), extreme=extreme, **more)

    argument = PLACE["direction"]
    argument = replace(
        argument,
        sentence=f"{argument.sentence}; worst: in each cell the direction in which the measure is worst",
        value=f"{argument.value}|{'|'.join(EXTREMES)}",
        example=f"{argument.example}, or one of {', '.join(EXTREMES)}",
    )
    return _with_device_options(with_extreme, DEVICE_NAME, option(argument, DirectionType(argument)))


def about_every_posture(command: Callback) -> Callback:
    """The same as `about_a_device` for a command about all postures and all directions, and without a load."""
    return _with_device_options(command, DEVICE_NAME, loads=False)


def _with_device_options(command: Callback, device: Decorator, *where: Decorator, loads: bool = True) -> Callback:
    """Give a command the device and its options, and make a `Question` of them.

    where  options of posture and direction;   loads  whether the command has those of a load
    """

    @wraps(command)
    def with_arguments(device: str, **options: Any) -> int:
        """Call the command with the options of the device as a `Question`, and the others as they are."""
        of_device = {name: options.pop(name) for name in (*PLACE, *DEVICE) if name in options}
        if loads:
            of_device |= {name: options.pop(name) for name in LOADS}
        return command(Question(device, **of_device), **options)

    return decorated(with_arguments, [device, *where, *(options_of(LOADS) if loads else ()), *options_of(DEVICE)])


def output_option(what: str) -> Callable[[Callback], Callback]:
    """`--output FILE`, with what its ending may be."""
    return click.option("--output", metavar="FILE", type=Text(), help=what)


as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")


def example(*lines: str) -> str:
    """An epilog with example command lines, kept as they are."""
    return "\b\nExample:\n" + "\n".join(f"  {line}" for line in lines)
