"""What is asked of a contact on the command line: what is touched, from where, and by which hand."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import wraps
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Finite, Numbers, ParamType, named
from zwidth.show.output import shown

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from zwidth.contact.environments import Environment
    from zwidth.contact.hand import Hand
    from zwidth.model.operator import Operator
    from zwidth.show.cli.options import Question

Command = Callable[..., int]

DEPTH: Final = 1e-3  # m, at the start: inside what acts everywhere, outside what has a surface
PUSH: Final = 2.0  # N, against what has a surface
FARTHEST: Final = 1e3  # m
LARGEST_FORCE: Final = 1e6  # N
LARGEST_SEED: Final = 2**63 - 1


class Bounded(ParamType):
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


class Setting(ParamType):
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


@dataclass(frozen=True)
class Contact:
    """A contact as typed; None where left out. Positions in metres, on the axis of the reading."""

    stiffness: float | None
    damping: float | None
    wall: str | None
    environment: str | None
    parameters: tuple[tuple[str, float], ...]
    no_pull: bool
    wall_position: float
    start_position: float | None
    start_velocity: float
    push: float | None
    ramp: float
    tremor: tuple[float, ...] | None
    reach: tuple[float, ...] | None
    reflex: tuple[float, ...] | None

    def check(self) -> None:
        """Raises click.UsageError for options that cannot stand together, as far as the device does not decide."""
        if self.wall is not None and self.environment is not None:
            raise usage("--wall and --environment exclude each other; leave one out")
        if self.environment is None:
            missing = [f"--{name}" for name in ("stiffness", "damping") if getattr(self, name) is None]
            if missing:
                raise usage(f"a wall needs --stiffness and --damping; missing: {' and '.join(missing)}")
            if self.parameters:
                raise usage("--parameter belongs to --environment; a wall has --stiffness and --damping")
        if self.environment is None and self.no_pull and self.wall != "one-sided":
            raise usage("a two-sided wall pulls by its nature; --no-pull goes with --wall one-sided")

    def touched(self) -> tuple[Environment, NDArray[Any]]:
        """The environment, and its parameters as it takes them. Raises BadInput."""
        wall = "one_sided_wall" if self.wall == "one-sided" else "wall"
        return named_environment(
            self.environment or wall,
            self.parameters,
            stiffness=self.stiffness,
            damping=self.damping,
            no_pull=self.no_pull,
        )

    def start(self, environment: Environment) -> float:
        """Where the reading starts [m]."""
        if self.start_position is not None:
            return self.start_position
        return self.wall_position + (-DEPTH if environment.surface else DEPTH)

    def hand(self, environment: Environment, operator: Operator | None) -> Hand:
        """Who holds the handle and what he does. Raises BadInput for what cannot be."""
        from zwidth.contact.hand import Hand, Reach, Reflex, Tremor

        for name in ("reach", "reflex"):
            if getattr(self, name) is not None and operator is None:
                raise BadInput(f"--{name}: needs an arm, and nobody holds the device; add --operator NAME")
        push = self.push
        if push is None:
            push = PUSH if environment.surface and self.reach is None else 0.0
        if self.ramp and not push:
            raise BadInput("--ramp: is the time in which the push grows, and nobody pushes; add --push F")
        with _named("tremor"):
            tremor = self.tremor and Tremor(*self.tremor)
        with _named("reach"):
            reach = self.reach and Reach(*self.reach)
        with _named("reflex"):
            reflex = self.reflex and Reflex(
                self.reflex[0],
                arm_stiffness=self.reflex[1],
                arm_damping=self.reflex[2],
                **dict(zip(("latency", "rise"), self.reflex[3:], strict=False)),
            )
        return Hand(operator, push, self.ramp, reach or None, tremor or None, reflex or None)


def named_environment(
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
    from zwidth.contact.environments import load_environment

    try:
        found = load_environment(name)
    except ValueError as error:
        raise BadInput(*(f"--environment: {line}" for line in str(error).splitlines())) from None
    options = {"stiffness": stiffness, "damping": damping, "no_pull": 1.0 if no_pull else None}
    given = _given(found, parameters, options)
    try:
        return found, found.values(**given)
    except ValueError as error:
        raise BadInput(*(f"--parameter: {line}" for line in str(error).splitlines())) from None


def _given(
    found: Environment, parameters: Sequence[tuple[str, float]], options: Mapping[str, float | None]
) -> dict[str, float]:
    """Values by name, the options among them."""
    pairs = list(parameters)
    for name, value in options.items():
        if value is None:
            continue
        if name not in found.names:
            has = ", ".join(found.names) or "none"
            raise BadInput(f"--{name.replace('_', '-')}: {found.name} has no such parameter; it has {has}")
        pairs.append((name, value))
    names = [name for name, _ in pairs]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadInput(*(f"--parameter: {shown(name)} is given twice" for name in twice))
    return dict(pairs)


@contextmanager
def _named(option: str) -> Iterator[None]:
    """What is wrong with an option's numbers is said under its name."""
    try:
        yield
    except ValueError as error:
        raise BadInput(f"--{option}: {error}") from None


def about_a_contact(command: Command) -> Command:
    """Give a command the options that say what is touched, from where and by whom, as one `Contact`."""
    options = [*_of_what_is_touched(), *_of_the_start(), *_of_the_hand()]
    return gathered(command, "contact", Contact, options, lambda contact, _: contact.check())


def gathered(
    command: Command,
    name: str,
    kind: type[Any],
    options: Sequence[Callable[..., Any]],
    check: Callable[[Any, Question], None],
) -> Command:
    """Give a command these options as one argument: a dataclass of this kind, checked with the question."""
    own = [field.name for field in fields(kind)]

    @wraps(command)
    def asked(question: Any, **given: Any) -> int:
        found = kind(**{key: given.pop(key) for key in own})
        check(found, question)
        return command(question, **{name: found}, **given)

    for decorate in reversed(options):
        asked = decorate(asked)
    return asked


def _of_what_is_touched() -> list[Callable[..., Any]]:
    return [
        click.option("--stiffness", metavar="K", type=Finite(), help="Stiffness of the wall [N/m]."),
        click.option("--damping", metavar="B", type=Finite(), help="Damping of the wall [Ns/m]."),
        click.option(
            "--wall",
            type=click.Choice(("two-sided", "one-sided")),
            help="Does it act on both sides of its position? Default: two-sided.",
        ),
        *of_environments(),
        click.option("--no-pull", is_flag=True, help="The wall never pulls the device inwards."),
    ]


def of_environments() -> list[Callable[..., Any]]:
    """Options that name an environment and its parameters."""
    return [
        click.option(
            "--environment",
            metavar="NAME|FILE.py:NAME",
            callback=named,
            help="Something else to touch: a bundled environment, or one of a file of your own.",
        ),
        click.option(
            "--parameter",
            "parameters",
            metavar="NAME=VALUE",
            type=Setting(),
            multiple=True,
            help="A parameter of the environment; repeatable.",
        ),
    ]


def _of_the_start() -> list[Callable[..., Any]]:
    place = Bounded("m", -FARTHEST, FARTHEST)
    return [
        click.option(
            "--wall-position", metavar="M", type=place, default=0.0, help="Where the wall begins [m]. Default: 0."
        ),
        click.option(
            "--start-position",
            metavar="M",
            type=place,
            help="Where the device starts [m]. Default: 1 mm inside what acts everywhere, 1 mm outside a surface.",
        ),
        click.option(
            "--start-velocity",
            metavar="V",
            type=Bounded("m/s", -FARTHEST, FARTHEST),
            default=0.0,
            help="How fast it starts [m/s]. Default: 0.",
        ),
    ]


def _of_the_hand() -> list[Callable[..., Any]]:
    return [
        click.option(
            "--push",
            metavar="F",
            type=Bounded("N", -LARGEST_FORCE, LARGEST_FORCE),
            help="The hand's force towards the wall [N]. Default: 2 against a surface, if the hand does not "
            "reach; else 0.",
        ),
        click.option(
            "--ramp",
            metavar="S",
            type=Bounded("s", 0.0, 1e6),
            default=0.0,
            help="Time in which the push grows to it [s]. Default: 0.",
        ),
        click.option(
            "--tremor", type=Numbers("N,HZ", (2,), "0.1,10"), help="A trembling force, and its frequency."
        ),
        click.option(
            "--reach",
            type=Numbers("M[,START,DURATION]", (1, 3), "0.01 or 0.01,0,0.5"),
            help="The arm's rest position moves by so much; when, and how long it takes [s]. Default: 0,0.5. "
            "Needs an operator.",
        ),
        click.option(
            "--reflex",
            type=Numbers("N,K,B[,LATENCY,RISE]", (3, 5), "3,500,5 or 3,500,5,0.05,0.05"),
            help="Above a force the arm stiffens by K and B, after a latency, within a rise [s]. "
            "Needs an operator.",
        ),
    ]


def usage(text: str) -> click.UsageError:
    """What is wrong with options of the command that runs."""
    return click.UsageError(text, click.get_current_context())
