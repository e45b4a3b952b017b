"""How far a number of the device file can go before the device can no longer be built.

The device format says of some numbers alone how large they may be; others must agree with what stands beside
them: a mass matrix is positive definite, a filter cuts off below half the sampling frequency. So devices are built
with the least and the largest value that is drawn, before any is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from zwidth.device import address
from zwidth.device.faults import DeviceError, Fault
from zwidth.device.load import from_document
from zwidth.study.designs.sampling import Axis, Tie

HALVINGS: Final = 64  # of the way from a value that a device can have to one that it cannot

FaultsOf = Callable[[float], Sequence[Fault]]  # of the device with a value of the number


@dataclass(frozen=True)
class Obstacle:
    """Why no device can be built with an end of a distribution.

    end     the value that no device can have
    last    the value farthest towards it that one can have
    faults  of the device with the end
    """

    end: float
    last: float
    faults: tuple[Fault, ...]

    def is_of(self, path: str) -> bool:
        """Whether it is the number at this path alone that may not have the value, whatever the others are."""
        return all(fault.key == path for fault in self.faults)


def faults_with(document: Mapping[str, Any], key: str, ties: tuple[Tie, ...]) -> FaultsOf:
    """The faults that a device has with a value of one number, and of those tied to it, all others as they are."""
    axis = Axis(key, (), ties=ties)

    def faults(value: float) -> Sequence[Fault]:
        changes = [(path, values[0]) for path, values in axis.columns([value])]
        try:
            # whether the mechanism reaches the handle's position is an outcome of each device
            from_document(address.assign_all(dict(document), changes), skip_assembly_check=True)
        except DeviceError as error:
            return error.faults
        return ()

    return faults


def obstacle(faults: FaultsOf, start: float, end: float) -> Obstacle | None:
    """What is in the way from a value that a device can have to an end of a distribution; None where nothing is.

    Halves the way between a value that a device can have and one that it cannot. Where 0 lies between the two it
    is tried first: halving comes near to 0 without end.
    """
    at_end = tuple(faults(end))
    if not at_end:
        return None
    good, bad = start, end
    wanted = 0.0 if min(start, end) < 0.0 < max(start, end) else 0.5 * (good + bad)
    for _ in range(HALVINGS):
        if wanted in (good, bad):
            break
        good, bad = (good, wanted) if faults(wanted) else (wanted, bad)
        wanted = 0.5 * (good + bad)
    return Obstacle(end, good, at_end)
