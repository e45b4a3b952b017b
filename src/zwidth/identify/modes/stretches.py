"""The stretches of records of which modes are identified, and what their columns are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.device import Device
from zwidth.identify.records.record import Record
from zwidth.identify.records.sampling import SampleTimes, joined
from zwidth.loop.operating_point import OperatingPoint

BLOCK: Final = 1 << 20  # samples that are transformed at once
KEPT: Final = 1 << 21  # samples of all records that are kept in memory; longer ones are read again
SHORTEST: Final = 256  # samples of a stretch that is used


class Stretch(NamedTuple):
    """Samples without a gap: command, position, reference and measured force (n,), None where there is none."""

    force: Floats
    position: Floats
    reference: Floats | None
    measured: Floats | None


@dataclass(frozen=True)
class Channels:
    """Names of the columns: what was commanded, what was read, and what stands beside them; "" for none."""

    force: str
    position: str
    reference: str
    measured: str

    @property
    def turns(self) -> bool:
        """Whether force and position are a torque and an angle."""
        return self.force.endswith("_Nm")

    @property
    def names(self) -> dict[str, str]:
        """Field of a `Stretch` -> column, of those that are there."""
        every = {"force": self.force, "position": self.position}
        every |= {"reference": self.reference, "measured": self.measured}
        return {field_: name for field_, name in every.items() if name}


def channels_of(device: Device, point: OperatingPoint, record: Record) -> Channels:
    """The columns of a record. Raises DeviceError where they do not go together, or with the device."""
    force = "force_N" if "force_N" in record else "torque_Nm"
    position = "position_m" if "position_m" in record else "angle_rad"
    if (force == "torque_Nm") != (position == "angle_rad"):
        raise record.fault(f"has {force} and {position}; force_N goes with position_m, torque_Nm with angle_rad")
    unit = force.partition("_")[2]
    for name in ("reference_N", "reference_Nm", "command_N", "command_Nm"):
        if name in record and name.partition("_")[2] != unit:
            raise record.fault(f"has {name} beside {force}; give both in {unit}")
    if point.given_plant is None and (force == "torque_Nm") != point.turns:
        rendered = "a moment about an axis" if point.turns else "a force along a direction"
        fits = "torque_Nm and angle_rad" if point.turns else "force_N and position_m"
        raise record.fault(f"has {force}, but the device renders {rendered}; give {fits} of the rendered motion")
    command = f"command_{unit}"
    measured = force if command in record else ""
    reference = f"reference_{unit}" if f"reference_{unit}" in record else ""
    # where there is a command it is what drives, and the force is what was measured of it
    return Channels(command if measured else force, position, reference, measured)


@dataclass
class Source:
    """A record whose stretches are gone through several times: from memory after `keep`, else from the file."""

    record: Record
    sampling: SampleTimes
    channels: Channels
    kept: list[Stretch] | None = field(default=None, repr=False)

    def stretches(self) -> Iterator[Stretch]:
        """Stretches of at most `BLOCK` samples, none across a gap, the shortest left out."""
        yield from self._read() if self.kept is None else self.kept

    def keep(self) -> None:
        """Hold the stretches in memory."""
        self.kept = list(self._read())

    def first(self) -> Stretch | None:
        """The first stretch; None where all are too short."""
        return next(self.stretches(), None)

    def _read(self) -> Iterator[Stretch]:
        """Read the stretches from the record, as `stretches` gives them."""
        held = dict[str, Floats]()
        for piece, goes_on in joined(self.sampling.stretches(self.record)):
            part = {field_: piece[name] for field_, name in self.channels.names.items()}
            if held and goes_on:
                part = {name: np.concatenate([held[name], values]) for name, values in part.items()}
            elif held:
                yield from _stretch_if_long_enough(held)
            while len(part["force"]) >= BLOCK:
                yield from _stretch_if_long_enough({name: values[:BLOCK] for name, values in part.items()})
                part = {name: values[BLOCK:] for name, values in part.items()}
            held = part
        if held:
            yield from _stretch_if_long_enough(held)


def _stretch_if_long_enough(columns: dict[str, Floats]) -> Iterator[Stretch]:
    """Yield the stretch of these columns (n,) by field; nothing where it has fewer than `SHORTEST` samples."""
    force, position = columns["force"], columns["position"]
    if len(force) >= SHORTEST:
        yield Stretch(force, position, columns.get("reference"), columns.get("measured"))


@dataclass
class Levels:
    """Running sums of the values in a record's columns, (2,) of force and position.

    count            samples
    low, high        (2,) least and largest
    origin           (2,) first sample;   total, square  (2,) sums of the differences to it, and of their squares
    at_limit         samples at the largest or the least force
    longest          stretch [samples]
    drift            largest change of position along the straight line through a stretch
    """

    count: int = 0
    low: Floats = field(default_factory=lambda: np.full(2, np.inf))
    high: Floats = field(default_factory=lambda: np.full(2, -np.inf))
    origin: Floats | None = None
    total: Floats = field(default_factory=lambda: np.zeros(2))
    square: Floats = field(default_factory=lambda: np.zeros(2))
    at_limit: int = 0
    longest: int = 0
    drift: float = 0.0

    def add(self, stretch: Stretch) -> None:
        """Add the samples of a stretch."""
        both = np.array([stretch.force, stretch.position])
        if self.origin is None:
            self.origin = both[:, 0].copy()
        low, high = both.min(axis=1), both.max(axis=1)
        if low[0] < self.low[0] or high[0] > self.high[0]:  # a new extreme: counted anew, also at the other
            self.at_limit = 0
        self.low, self.high = np.minimum(self.low, low), np.maximum(self.high, high)
        self.at_limit += int(np.count_nonzero((both[0] == self.low[0]) | (both[0] == self.high[0])))
        differences = both - self.origin[:, None]
        self.total += differences.sum(axis=1)
        self.square += (differences**2).sum(axis=1)
        self.count += both.shape[1]
        self.longest = max(self.longest, both.shape[1])
        t = np.linspace(-1.0, 1.0, both.shape[1])
        # half the change along the line of least squares: the mean of t^2 from -1 to 1 is 1/3
        slope = 3.0 * float(np.mean(t * (stretch.position - stretch.position[0])))
        self.drift = max(self.drift, 2.0 * abs(slope))

    @property
    def deviation(self) -> Floats:
        """Standard deviation of force and position (2,)."""
        mean = self.total / max(self.count, 1)
        return np.sqrt(np.maximum(self.square / max(self.count, 1) - mean**2, 0.0))

    @property
    def span(self) -> Floats:
        """Largest less least force and position (2,)."""
        return self.high - self.low
