"""Options of a contact as arguments of its simulation, and what is wrong with them by the options' names."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.errors import NoAnswerError
from zwidth.questions import SIMULATE
from zwidth.show.cli.errors import BadInput, as_option
from zwidth.show.cli.options import ParamType, option_name

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
# What to add where an argument is missing.
MISSING: Final = {"operator": "--operator NAME", "push": "--push F"}


class ParameterType(ParamType):
    """NAME=VALUE, a parameter of an environment."""

    name = "setting"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, float]:
        """Name and value, taken apart from NAME=VALUE; fails for what is no number."""
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
    """Raise click.UsageError for options that are missing or exclude each other, whatever the device is."""
    wall, environment = options["wall"], options["environment"]
    if wall is not None and environment is not None:
        raise usage_error("--wall and --environment exclude each other; leave one out")
    if environment is not None:
        return  # what it takes is checked where it is made
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

    parameters = _values_by_name(options["parameters"])
    tremor, reach, reflex = options["tremor"], options["reach"], options["reflex"]
    with _errors_naming("tremor"):
        tremor = tremor and Tremor(*tremor)
    with _errors_naming("reach"):
        reach = reach and Reach(*reach)
    # threshold of force, stiffness and damping of the stiffened arm, and perhaps latency and rise time
    with _errors_naming("reflex"):
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
            name, _values_by_name(parameters), stiffness=stiffness, damping=damping, no_pull=no_pull
        )


def _values_by_name(parameters: Sequence[tuple[str, float]]) -> dict[str, float]:
    """Values of --parameter by name. Raises BadInput for those given twice."""
    names = [name for name, _ in parameters]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadInput(*(f"--parameter: {name} is given twice" for name in twice))
    return dict(parameters)


@contextmanager
def _errors_naming(option: str) -> Iterator[None]:
    """Turn errors in an option's numbers into messages that name the option."""
    try:
        yield
    except ValueError as error:
        raise BadInput(f"--{option}: {error}") from None


@contextmanager
def translate_contact_errors() -> Iterator[None]:
    """Turn errors of a contact's simulation inside this block into messages about the options as they were typed.

    Raises  BadInput  for what `simulate_contact` does not take, under the options' names
            NoAnswerError  where the environment gives no force
    """
    from zwidth.errors import ArgumentError, TooLarge

    try:
        yield
    except ArgumentError as error:
        option = option_name(SIMULATE[error.argument]) if error.argument in SIMULATE else as_option(error.argument)
        advice = f"; add {MISSING[error.missing]}" if error.missing else ""
        raise BadInput(*(f"{option}: {reason}{advice}" for reason in error.reasons)) from None
    except NoAnswerError as error:
        raise NoAnswerError(str(error)) from None
    except TooLarge as error:
        raise BadInput(f"--duration: {error}") from None


def usage_error(text: str) -> click.UsageError:
    """Usage error about options of the running command."""
    return click.UsageError(text, click.get_current_context())
