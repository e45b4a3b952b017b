"""Command-line options of a contact: environment, start, and hand."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.errors import NoAnswerError
from zwidth.show.cli.errors import BadInput, as_option
from zwidth.show.cli.options import Finite, Numbers, ParamType, check_not_empty

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from zwidth.contact.environments import Environment

AS_TYPED: Final = (
    "stiffness",
    "damping",
    "environment",
    "no_pull",
    "wall_position",
    "start_position",
    "start_velocity",
    "push",
    "ramp",
)
# Arguments whose options are called otherwise, or want a word for their value where they are missing.
OPTIONS: Final = {"parameters": "--parameter", "operator": "--operator NAME", "push": "--push F"}
FARTHEST: Final = 1e3  # m
LARGEST_FORCE: Final = 1e6  # N
LARGEST_SEED: Final = 2**63 - 1


class BoundedNumber(ParamType):
    """One number within bounds, with its unit for the message."""

    name = "number"

    def __init__(self, unit: str, low: float, high: float, *, above: bool = False) -> None:
        self.unit, self.low, self.high, self.above = unit, low, high, above

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        low = number > self.low if self.above else number >= self.low
        if not (low and number <= self.high):
            first = "above" if self.above else "from"
            self.fail(
                f"must be a number {first} {self.low:g} up to {self.high:g} [{self.unit}], "
                f"got {str(value)[:60]!r}",
                param,
                ctx,
            )
        return number


class ParameterType(ParamType):
    """NAME=VALUE, a parameter of an environment."""

    name = "setting"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, float]:
        if isinstance(value, tuple):
            return value
        name, _, text = value.partition("=")
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not name.strip() or math.isnan(number):
            self.fail(f"must be NAME=NUMBER such as stiffness=2000, got {value[:60]!r}", param, ctx)
        return name.strip(), number


def check_contact(options: Mapping[str, Any]) -> None:
    """Raise click.UsageError for options that cannot stand together, as far as the device does not decide."""
    wall, environment = options["wall"], options["environment"]
    if wall is not None and environment is not None:
        raise usage_error("--wall and --environment exclude each other; leave one out")
    if environment is not None:
        return
    missing = [f"--{name}" for name in ("stiffness", "damping") if options[name] is None]
    if missing:
        raise usage_error(f"a wall needs --stiffness and --damping; missing: {' and '.join(missing)}")
    if options["parameters"]:
        raise usage_error("--parameter belongs to --environment; a wall has --stiffness and --damping")
    if options["no_pull"] and wall != "one-sided":
        raise usage_error("a two-sided wall always pulls; --no-pull needs --wall one-sided")


def contact_arguments(options: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a contact as arguments of `simulate_contact`. Raises BadInput for numbers that cannot be."""
    from zwidth.contact.hand import Reach, Reflex, Tremor

    parameters = _by_name(options["parameters"])
    tremor, reach, reflex = options["tremor"], options["reach"], options["reflex"]
    with _name_option("tremor"):
        tremor = tremor and Tremor(*tremor)
    with _name_option("reach"):
        reach = reach and Reach(*reach)
    with _name_option("reflex"):
        reflex = reflex and Reflex(
            reflex[0],
            arm_stiffness=reflex[1],
            arm_damping=reflex[2],
            **dict(zip(("latency", "rise"), reflex[3:], strict=False)),
        )
    return {name: options[name] for name in AS_TYPED} | {
        "wall": options["wall"] or "two-sided",
        "parameters": parameters,
        "tremor": tremor,
        "reach": reach,
        "reflex": reflex,
    }


def environment_from_options(
    name: str,
    parameters: Sequence[tuple[str, float]],
    *,
    stiffness: float | None,
    damping: float | None,
    no_pull: bool,
) -> tuple[Environment, NDArray[Any]]:
    """The environment of --environment, and its parameters as it takes them.

    parameters  of --parameter; the others are those that have an option of their own
    Raises      BadInput  for an unknown environment, a file that does not serve, or parameters that do not
    """
    from zwidth.contact.point_contact import environment_with_values

    with translate_contact_errors():
        return environment_with_values(
            name, _by_name(parameters), stiffness=stiffness, damping=damping, no_pull=no_pull
        )


def _by_name(parameters: Sequence[tuple[str, float]]) -> dict[str, float]:
    """Values of --parameter by name. Raises BadInput for those given twice."""
    names = [name for name, _ in parameters]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadInput(*(f"--parameter: {name} is given twice" for name in twice))
    return dict(parameters)


@contextmanager
def _name_option(option: str) -> Iterator[None]:
    """Turn errors in an option's numbers into messages that name the option."""
    try:
        yield
    except ValueError as error:
        raise BadInput(f"--{option}: {error}") from None


@contextmanager
def translate_contact_errors() -> Iterator[None]:
    """Simulate a contact inside this block.

    Raises  BadInput  for what `simulate_contact` does not take, under the options' names
            NoAnswerError  where the environment gives no force
    """
    from zwidth.errors import ArgumentError, TooLarge

    try:
        yield
    except ArgumentError as error:
        option = OPTIONS.get(error.argument, as_option(error.argument))
        advice = f"; add {OPTIONS[error.missing]}" if error.missing else ""
        raise BadInput(*(f"{option}: {reason}{advice}" for reason in error.reasons)) from None
    except NoAnswerError as error:
        raise NoAnswerError(str(error)) from None
    except TooLarge as error:
        raise BadInput(f"--duration: {error}") from None


def wall_options() -> tuple[Callable[..., Any], ...]:
    """The wall of a command that is about one two-sided wall, as options."""
    return (
        click.option(
            "--stiffness", metavar="K", type=Finite(), required=True, help="Stiffness of the wall [N/m]."
        ),
        click.option("--damping", metavar="B", type=Finite(), required=True, help="Damping of the wall [N s/m]."),
    )


def contact_options() -> tuple[Callable[..., Any], ...]:
    """Options for environment, start and hand."""
    return (*_wall_and_environment_options(), *_start_options(), *_hand_options())


def _wall_and_environment_options() -> list[Callable[..., Any]]:
    return [
        click.option("--stiffness", metavar="K", type=Finite(), help="Stiffness of the wall [N/m]."),
        click.option("--damping", metavar="B", type=Finite(), help="Damping of the wall [N s/m]."),
        click.option(
            "--wall",
            type=click.Choice(("two-sided", "one-sided")),
            help="Whether the wall acts on both sides of its position. Default: two-sided.",
        ),
        *environment_options(),
        click.option("--no-pull", is_flag=True, help="The wall never pulls the device inwards."),
    ]


def environment_options() -> list[Callable[..., Any]]:
    """Options that name an environment and its parameters."""
    return [
        click.option(
            "--environment",
            metavar="NAME|FILE.py:NAME",
            callback=check_not_empty,
            help="An environment instead of a wall: a bundled one, or one from a file of your own.",
        ),
        click.option(
            "--parameter",
            "parameters",
            metavar="NAME=VALUE",
            type=ParameterType(),
            multiple=True,
            help="A parameter of the environment; repeatable.",
        ),
    ]


def _start_options() -> list[Callable[..., Any]]:
    place = BoundedNumber("m", -FARTHEST, FARTHEST)
    return [
        click.option(
            "--wall-position",
            metavar="M",
            type=place,
            default=0.0,
            help="Position of the wall's surface [m]. Default: 0.",
        ),
        click.option(
            "--start-position",
            metavar="M",
            type=place,
            help="Position at the start [m]. Default: 1 mm outside an environment with a surface, 1 mm inside "
            "any other.",
        ),
        click.option(
            "--start-velocity",
            metavar="V",
            type=BoundedNumber("m/s", -FARTHEST, FARTHEST),
            default=0.0,
            help="Velocity at the start [m/s]. Default: 0.",
        ),
    ]


def _hand_options() -> list[Callable[..., Any]]:
    return [
        click.option(
            "--push",
            metavar="F",
            type=BoundedNumber("N", -LARGEST_FORCE, LARGEST_FORCE),
            help="Constant force of the hand towards the wall [N]. Default: 2 against a surface, unless "
            "--reach is given; else 0.",
        ),
        click.option(
            "--ramp",
            metavar="S",
            type=BoundedNumber("s", 0.0, 1e6),
            default=0.0,
            help="Time in which the push rises to its full value [s]. Default: 0.",
        ),
        click.option(
            "--tremor",
            type=Numbers("N,HZ", (2,), "0.1,10"),
            help="Amplitude and frequency of a tremor, as a force [N, Hz].",
        ),
        click.option(
            "--reach",
            type=Numbers("M[,START,DURATION]", (1, 3), "0.01 or 0.01,0,0.5"),
            help="Displacement of the arm's rest position [m], and start and duration of this motion [s]. "
            "Default: 0,0.5. Needs an operator.",
        ),
        click.option(
            "--reflex",
            type=Numbers("N,K,B[,LATENCY,RISE]", (3, 5), "3,500,5 or 3,500,5,0.05,0.05"),
            help="Stiffen the arm by K and B once the force exceeds N, after a latency and within a rise time "
            "[s]. Needs an operator.",
        ),
    ]


def usage_error(text: str) -> click.UsageError:
    """Usage error about options of the running command."""
    return click.UsageError(text, click.get_current_context())
