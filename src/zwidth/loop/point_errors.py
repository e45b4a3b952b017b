"""Errors of operating points, and what several directions rendered together leave out."""

from __future__ import annotations

from collections.abc import Sequence

from zwidth.model.mechanism import Mechanism
from zwidth.model.operator import Operator
from zwidth.model.reduction import Encoders


class OperatingPointError(ValueError):
    """An operating point does not have this for its device; the text says what it has."""


class NoMechanismError(OperatingPointError):
    """The question is about a mechanism, and the device is given by its plant or a measured response."""

    def __init__(self) -> None:
        super().__init__("the device has no mechanism, and so neither postures nor directions")


class SeveralDirectionsError(OperatingPointError):
    """Several directions rendered together leave out something that the device has.

    obstacles  what: "an operator", "an encoder on the link", "electrical damping"
    """

    def __init__(self, obstacles: Sequence[str]) -> None:
        self.obstacles = tuple(obstacles)
        super().__init__(f"{' and '.join(obstacles)} cannot be rendered over several directions; ask for one")


def check_several_directions(mechanism: Mechanism | None, operator: Operator | None, encoders: Encoders) -> None:
    """Raise SeveralDirectionsError for all that a device has and several directions together leave out."""
    windings = None if mechanism is None else mechanism.drives.winding_damping
    present = {
        "an operator": operator is not None,
        "an encoder on the link": encoders != "motor",
        "electrical damping": windings is not None and bool(windings.any()),
    }
    if any(present.values()):
        raise SeveralDirectionsError([what for what, there in present.items() if there])
