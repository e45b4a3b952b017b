"""Errors of operating points, and what several directions rendered together leave out."""

from __future__ import annotations

from collections.abc import Sequence

from zwidth.model.load import Load
from zwidth.model.mechanism import Mechanism
from zwidth.model.operator import Operator
from zwidth.model.reduction import Encoders


class OperatingPointError(ValueError):
    """An operating point does not have the requested quantity; the message names what to use instead."""


class NoMechanismError(OperatingPointError):
    """The question is about a mechanism, and the device is given by its plant or a measured response."""

    def __init__(self) -> None:
        super().__init__("the device has no mechanism, and so neither postures nor directions")


class MissingNumbersError(OperatingPointError):
    """The answer needs numbers that the device file leaves out as not known.

    keys  their dotted paths
    """

    def __init__(self, keys: Sequence[str]) -> None:
        self.keys = tuple(keys)
        shown = ", ".join(keys[:4]) + (f" and {len(keys) - 4} more" if len(keys) > 4 else "")
        super().__init__(f"needs {shown}, which the device file does not give")


class SeveralDirectionsError(OperatingPointError):
    """The device has something that several directions rendered together cannot include.

    obstacles  its names: "an operator", "an encoder on the link", "electrical damping"
    """

    def __init__(self, obstacles: Sequence[str]) -> None:
        self.obstacles = tuple(obstacles)
        super().__init__(
            f"not supported over several directions: {' and '.join(obstacles)}; render one direction instead"
        )


def check_several_directions(
    mechanism: Mechanism | None, operator: Operator | None, encoders: Encoders, load: Load | None
) -> None:
    """Raise SeveralDirectionsError if the device has something that several directions together cannot include."""
    windings = None if mechanism is None else mechanism.drives.winding_damping
    present = {
        "an operator": operator is not None,
        "an encoder on the link": encoders != "motor",
        "a load": load is not None,
        "electrical damping": windings is not None and bool(windings.any()),
    }
    if any(present.values()):
        raise SeveralDirectionsError([name for name, is_present in present.items() if is_present])
