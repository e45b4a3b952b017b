"""Arguments of a contact: which environment with which parameters, which hand, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Environment
from zwidth.contact.environments.load import load_environment
from zwidth.contact.hand import Hand, Reach, Reflex, Tremor
from zwidth.model.argument_checks import require
from zwidth.model.operator import Operator
from zwidth.model.posture import PostureError

PUSH: Final = 2.0  # N, against what has a surface
PLACES: Final = {"wall_position": "the wall", "start_position": "the start"}


class ContactArgumentError(ValueError):
    """An argument of a contact that cannot be meant.

    argument  its name
    reasons   what is wrong with it, each a fault of its own
    missing   the argument that is to be given with it; None: none
    """

    def __init__(self, argument: str, *reasons: str, missing: str | None = None) -> None:
        self.argument, self.reasons, self.missing = argument, reasons, missing
        advice = "" if missing is None else f"; give {missing}"
        super().__init__("\n".join(f"{argument}: {reason}{advice}" for reason in reasons))


class OutOfWorkspaceError(ContactArgumentError):
    """The handle of a mechanism cannot be moved to the start, or to the wall.

    argument  "start_position" or "wall_position";   position  along the direction [m]
    """

    def __init__(self, argument: str, position: float, why: PostureError) -> None:
        self.position = position
        place = f"{PLACES[argument]} lies {position:g} m along the direction"
        super().__init__(argument, f"{place}, out of the workspace: {why}")


def environment_with_values(
    environment: str | Environment,
    parameters: Mapping[str, float],
    *,
    stiffness: float | None = None,
    damping: float | None = None,
    no_pull: bool = False,
) -> tuple[Environment, Floats]:
    """An environment, and its parameters as it takes them.

    environment  or what `load_environment` finds it by
    parameters   by name; those left out have the environment's defaults
    stiffness, damping, no_pull  three of them; None and False: not given here
    Raises       ContactArgumentError  for an unknown environment, a file that does not serve, parameters that it
                                       does not take or that are given twice

    >>> environment_with_values("slot", {"width": 0.01}, stiffness=500.0)[1].tolist()
    [0.01, 500.0, 0.0, 0.0]
    """
    chosen = _environment(environment)
    given = dict(parameters)
    for name, value in {"stiffness": stiffness, "damping": damping, "no_pull": float(no_pull) or None}.items():
        if value is None:
            continue
        if name not in chosen.names:
            has = ", ".join(chosen.names) or "none"
            raise ContactArgumentError(name, f"{chosen.name} has no such parameter; it has {has}")
        if name in given:
            raise ContactArgumentError("parameters", f"{name} is given twice")
        given[name] = value
    try:
        return chosen, chosen.values(**given)
    except ValueError as error:
        raise ContactArgumentError("parameters", *str(error).splitlines()) from None


def _environment(environment: str | Environment) -> Environment:
    if isinstance(environment, Environment):
        return environment
    require("environment", environment, str)
    try:
        return load_environment(environment)
    except ValueError as error:
        raise ContactArgumentError("environment", *str(error).splitlines()) from None


def active_hand(
    operator: Operator | None,
    surface: bool,
    push: float | None,
    ramp: float,
    tremor: Tremor | None,
    reach: Reach | None,
    reflex: Reflex | None,
) -> Hand:
    """The operator with what he does; `surface` says whether there is one to push against.

    Raises  ContactArgumentError  for what needs an arm, or a push
    """
    for name, movement in (("reach", reach), ("reflex", reflex)):
        if movement is not None and operator is None:
            raise ContactArgumentError(name, "needs an arm, and nobody holds the device", missing="operator")
    if push is None:
        push = PUSH if surface and reach is None else 0.0
    if ramp and not push:
        why = "is the time in which a push grows, and no push is given"
        raise ContactArgumentError("ramp", why, missing="push")
    return Hand(operator, push, ramp, reach, tremor, reflex)
