"""The numbers that a measured boundary is fitted with, as a vector that an optimiser varies: those of the device
file that the user names (`DeviceNumbers`), and those of a damping model.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats
from zwidth.chart.edge_crossings import EdgeChords
from zwidth.device import address
from zwidth.device.device import Device
from zwidth.device.faults import dotted, fail, quote
from zwidth.device.plausibility import ImplausibleNumber
from zwidth.device.schema.device_file import key_unit, may_be_zero
from zwidth.errors import DeviceError
from zwidth.identify.boundary.damping_models import DampingModel
from zwidth.loop.operating_point import OperatingPoint

if TYPE_CHECKING:
    from zwidth.chart.chart_base import Chart
    from zwidth.loop.loop import Loop
    from zwidth.model.operator import Operator


WIDEST: Final = np.log(1e6)  # factor either way within which a positive number is looked for, as logarithm
HALVINGS: Final = 12  # of the way to where a number is no longer allowed
SMALL: Final = 1e-3  # relative change by which it is tried whether a number can be varied alone
THINNED: Final = 4  # chords that make one; crossings are moved onto the edge itself in any case
NEAR: Final = (0.65, 0.8, 0.9, 1.1, 1.25, 1.5)  # at which it looks besides, as minima may be narrow
FACTORS: Final = (0.003, 0.03, 0.3, 3.0, 30.0, 300.0)  # at which a fit looks for a start


@dataclass(frozen=True)
class BoundaryParameters:
    """Numbers (p,) that a boundary is fitted with, as a vector; positive ones by their logarithm.

    device, point  whose numbers, and where
    numbers        those of the device file
    damping        its numbers follow; None: the damping of the file stays
    lower, upper   (p,) bounds of the vector, where the file's are
    """

    device: Device
    point: OperatingPoint
    numbers: DeviceNumbers
    damping: DampingModel | None
    lower: Floats
    upper: Floats

    @classmethod
    def of(
        cls, device: Device, point: OperatingPoint, paths: Sequence[str], damping: DampingModel | None = None
    ) -> BoundaryParameters:
        """The numbers at these paths, and those of a damping model.

        Raises  DeviceError  for a path that leads to no number, and for a number that cannot be varied alone
        """
        numbers = DeviceNumbers.of(device, paths)
        ends = [_bounds(numbers, i) for i in range(len(numbers.paths))]
        if damping is not None:
            ends += [(start - WIDEST, start + WIDEST) for start in np.log(damping.start).tolist()]
        return cls(device, point, numbers, damping, *np.array(ends).reshape(-1, 2).T)

    @property
    def start(self) -> Floats:
        """The vector of the file's numbers, and of those that a damping model begins with."""
        of_file = self.numbers.vector(self.numbers.start)
        return of_file if self.damping is None else np.append(of_file, np.log(self.damping.start))

    @property
    def positive(self) -> Flags:
        """Which numbers (p,) vary by their logarithm."""
        more = 0 if self.damping is None else len(self.damping.start)
        return np.append(self.numbers.positive, np.ones(more, dtype=bool))

    @property
    def named(self) -> list[tuple[str, str, str]]:
        """What each number is, its unit, and its path in the device file."""
        document = self.device.document
        of_file = [(path, key_unit(address.resolve(document, path)), path) for path in self.numbers.paths]
        return of_file if self.damping is None else of_file + self.damping.numbers

    def values(self, vector: Floats) -> Floats:
        """The numbers (..., p) of vectors (..., p); inf where a logarithm, as of an open end, is too large."""
        given = np.asarray(vector, dtype=float)
        with np.errstate(over="ignore"):
            return np.where(self.positive, np.exp(np.where(self.positive, given, 0.0)), given)

    def device_with(self, vector: Floats) -> Device:
        """The device with the numbers of its file; those of a damping model are not in it."""
        count = len(self.numbers.paths)
        if not count:
            return self.device
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ImplausibleNumber)  # a search tries numbers that nobody means
            return self.numbers.device_with(vector[:count])

    def chart(self, vector: Floats) -> Chart:
        """Exact chart of the device with these numbers. Raises ValueError where there is none."""
        return self._chart_of(self.device_with(vector), vector)

    def edge(self, vector: Floats) -> EdgeChords:
        """The edge of `chart`. Raises ValueError where there is none."""
        from zwidth.chart.hysteretic_response import hysteretic_edge

        device = self.device_with(vector)
        if self.damping is not None:
            return self.damping.edge(device, self._damping_numbers(vector), THINNED)
        if device.given_plant is not None and device.given_plant.hysteresis is not None:
            return hysteretic_edge(device.at_point(self.point).loop)
        return EdgeChords.of(self._chart_of(device, vector)).thinned(THINNED)

    def _chart_of(self, device: Device, vector: Floats) -> Chart:
        """Exact chart of a device, with the numbers of the damping model in the vector (p,) where there is one."""
        from zwidth.chart.point_chart import chart_at

        if self.damping is not None:
            return self.damping.chart(device, self._damping_numbers(vector))
        return chart_at(device.at_point(self.point), decay=False)

    def contact_loop(self, vector: Floats) -> Loop:
        """The loop of a simulated contact with these numbers, without an operator. Raises ValueError."""
        device = self.device_with(vector)
        if self.damping is not None:
            return self.damping.contact_loop(device, self._damping_numbers(vector))
        return device.at_point(self.point).contact_loop

    def operator(self, vector: Floats) -> Operator | None:
        """The operator who holds the device with these numbers; None: nobody."""
        return self.device_with(vector).operator

    def _damping_numbers(self, vector: Floats) -> Floats:
        """The numbers (k,) of the damping model, which stand behind those of the file."""
        return self.values(vector)[len(self.numbers.paths) :]

    def other_starts(self, i: int) -> Floats:
        """Values of the vector's i-th number from which a fit may begin, besides the file's."""
        if self.positive[i]:
            tried = self.start[i] + np.log(FACTORS)
        else:
            size = self._usual_change(i)
            tried = self.start[i] + size * np.array([-10.0, -3.0, -1.0, 1.0, 3.0, 10.0, 30.0])
        return np.asarray(tried[(tried > self.lower[i]) & (tried < self.upper[i])])

    def near_starts(self, i: int) -> Floats:
        """Values of the vector's i-th number, a positive one, close to the file's from which a fit may begin."""
        tried = self.start[i] + np.log(NEAR if self.positive[i] else ())
        return np.asarray(tried[(tried > self.lower[i]) & (tried < self.upper[i])])

    def _usual_change(self, i: int) -> float:
        """A usual change of the i-th number: 0.3 of it; where it is 0, the power of ten by which it must change
        for the largest stiffness of the chart to change by a hundredth, or a tenth of that which leaves no chart;
        1 where none does either, or there is no chart to begin with."""
        if self.start[i] != 0.0:
            return 0.3 * abs(float(self.start[i]))
        try:
            before = self.edge(self.start).box[1]  # largest stiffness [N/m]
        except ValueError:
            return 1.0
        for size in 10.0 ** np.arange(-9.0, 10.0):
            moved = self.start.copy()
            moved[i] += size
            try:
                if not abs(self.edge(moved).box[1] / before - 1.0) < 0.01:
                    return float(size)
            except ValueError:
                return 0.1 * float(size)
        return 1.0


def _bounds(numbers: DeviceNumbers, i: int) -> tuple[float, float]:
    """Bounds of the i-th number as the vector has it, by which values the file allows: the start itself to a side
    on which a small step is refused; else, of a positive number, WIDEST away or the file's limit if nearer;
    else -inf or inf. Raises DeviceError for a number that cannot be varied alone."""
    vector = numbers.vector(numbers.start)
    start = float(vector[i])

    def allowed(value: float) -> bool:
        """Whether there is a device with this value of the number."""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ImplausibleNumber)
                numbers.device_with(np.where(np.arange(len(vector)) == i, value, vector))
        except (DeviceError, OverflowError):
            return False
        return True

    step = SMALL if numbers.positive[i] or start == 0.0 else SMALL * abs(start)
    sides = [allowed(start + side * step) for side in (-1.0, 1.0)]
    if not any(sides):
        raise fail(
            numbers.device.label,
            numbers.paths[i],
            "cannot be varied alone; name another number, or for the damping of a [plant] a damping model",
        )
    farthest = WIDEST if numbers.positive[i] else np.inf
    ends = []
    for side, near in zip((-1.0, 1.0), sides, strict=True):
        if not near:
            ends.append(start)
        elif not np.isfinite(farthest) or allowed(start + side * farthest):
            ends.append(start + side * farthest)
        else:
            inner, outer = step, farthest
            for _ in range(HALVINGS):
                middle = 0.5 * (inner + outer)
                inner, outer = (middle, outer) if allowed(start + side * middle) else (inner, middle)
            ends.append(start + side * inner)
    return ends[0], ends[1]


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
        """What an optimiser varies (..., p) for values (..., p): logarithms of the positive ones."""
        given = np.asarray(values, dtype=float)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.positive, np.log(given), given)

    def values(self, vector: ArrayLike) -> Floats:
        """Values (..., p) of what an optimiser varies (..., p)."""
        given = np.asarray(vector, dtype=float)
        return np.where(self.positive, np.exp(np.where(self.positive, given, 0.0)), given)

    def device_with(self, vector: ArrayLike) -> Device:
        """The device with the numbers of a vector (p,). Raises DeviceError where there is no such device."""
        return self.device.with_(dict(zip(self.paths, self.values(vector).tolist(), strict=True)))
