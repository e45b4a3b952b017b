"""Numbers of a device file as a vector that an optimiser varies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats
from zwidth.device import address
from zwidth.device.device import Device
from zwidth.device.faults import dotted, fail, quote
from zwidth.device.schema.device_file import may_be_zero


@dataclass(frozen=True)
class DeviceNumbers:
    """Some numbers of a device as a vector; positive ones by their logarithm, so that they stay positive.

    device    whose numbers they are
    paths     of each number, as `--set` takes it
    start     (p,) their values in the file
    positive  (p,) whether a number varies by its logarithm: one that is above 0 in the file
    """

    device: Device
    paths: tuple[str, ...]
    start: Floats
    positive: Flags

    @classmethod
    def of(cls, device: Device, paths: Sequence[str]) -> DeviceNumbers:
        """The numbers at these paths; one that the file leaves out and that may be 0 begins there.

        Raises DeviceError  for a path that leads nowhere, or to what is no number, and for one named twice
        """
        full = list[str]()
        values = list[float]()
        for path in paths:
            steps = address.resolve(device.document, path)
            name = dotted(steps, device.document)
            if address.exists(device.document, path) or not may_be_zero(steps):
                value = address.get(device.document, path)
            else:  # a delay, a friction, a damping that the file leaves out is none
                value = 0.0
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise fail(device.label, path, f"must be a number to be identified, got {quote(value)}")
            if name in full:
                raise fail(device.label, path, "is named twice; name it once")
            full.append(name)
            values.append(float(value))
        start = np.array(values)
        return cls(device, tuple(full), start, start > 0.0)

    def vector(self, values: ArrayLike) -> Floats:
        """Values (..., p) as the optimiser has them."""
        given = np.asarray(values, dtype=float)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.positive, np.log(given), given)

    def values(self, vector: ArrayLike) -> Floats:
        """Values (..., p) of what the optimiser has."""
        given = np.asarray(vector, dtype=float)
        return np.where(self.positive, np.exp(np.where(self.positive, given, 0.0)), given)

    def device_with(self, vector: ArrayLike) -> Device:
        """The device with these numbers. Raises DeviceError where there is no such device."""
        return self.device.with_(dict(zip(self.paths, self.values(vector).tolist(), strict=True)))
