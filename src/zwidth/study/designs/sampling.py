"""Axes of a study, the numbers tied to them, and the designs they span."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import exp, log, prod
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.measures.wanted import WANTED_BY_KEY
from zwidth.study.designs.catalogue import Part
from zwidth.study.designs.latin_hypercube import share, shares

WANTED: Final = tuple(WANTED_BY_KEY)
CIRCUMSTANCES: Final = ("at", "direction", "assembly", "model", "operator", *WANTED)


@dataclass(frozen=True)
class Tie:
    """A number, or a list of numbers, of the device file that changes with the value v of an axis.

        factor * v                          without a power
        file_value * (v / v0)^power         with one; v0 is the axis's value in the device file

    A link of constant cross-section has a mass in proportion to its length (power 1), and a moment of inertia to
    its cube (power 3).

    key              path of the tied number
    file_value       its value in the device file; None without a power
    axis_file_value  v0
    """

    key: str
    factor: float = 1.0
    power: float | None = None
    file_value: Any = None
    axis_file_value: float = 1.0

    def value(self, axis_value: Any) -> Any:
        """The tied number where the axis has a value.

        >>> Tie("links.arm.inertia_kg_m2", power=3.0, file_value=[1.0, 2.0], axis_file_value=0.1).value(0.2)
        [8.0, 16.0]
        """
        if self.power is not None:
            return _times(self.file_value, float((axis_value / self.axis_file_value) ** self.power))
        return axis_value if self.factor == 1.0 else self.factor * axis_value


def _times(value: Any, factor: float) -> Any:
    return [_times(inner, factor) for inner in value] if isinstance(value, list) else factor * value


@dataclass(frozen=True)
class Axis:
    """A number or a circumstance that a study varies.

    key     a path of the device file, one of CIRCUMSTANCES, or what a catalogue is of
    values  values of a grid; of a Latin hypercube those it chooses from, () where it has a range
    span    lowest and highest value; None: only the listed values
    log     whether the range is divided evenly in the logarithm
    ties    numbers that change with this one
    unit    "" for none
    whole   whether the values are whole numbers
    parts   of a catalogue: the numbers that each of the values, the name of a part, stands for
    """

    key: str
    values: tuple[Any, ...]
    span: tuple[float, float] | None = None
    log: bool = False
    ties: tuple[Tie, ...] = ()
    unit: str = ""
    whole: bool = False
    parts: tuple[Part, ...] = ()

    @property
    def numeric(self) -> bool:
        """Whether its values are numbers."""
        return all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.values)

    def columns(self, values: Sequence[Any]) -> Iterator[tuple[str, Sequence[Any]]]:
        """Each path, or the circumstance, that the axis sets, with what it is at each of its values; tied numbers
        last.

        >>> list(Axis("a", (1.0,), ties=(Tie("b", 2.0),)).columns([3.0, 4.0]))
        [('a', [3.0, 4.0]), ('b', [6.0, 8.0])]
        """
        if self.parts:
            chosen = [self.parts[self.values.index(value)] for value in values]
            yield from ((path, [part[n][1] for part in chosen]) for n, (path, _) in enumerate(self.parts[0]))
            return
        yield self.key, values
        for tie in self.ties:
            yield tie.key, [tie.value(value) for value in values]

    @property
    def keys(self) -> tuple[str, ...]:
        """Each path, or the circumstance, that the axis sets."""
        return tuple(key for key, _ in self.columns(()))

    def at(self, share: float) -> Any:
        """The value at a share 0 <= share < 1 of the way along the axis."""
        if self.span is None:
            return self.values[int(share * len(self.values))]
        low, high = self.span
        if self.log:
            return float(min(max(exp(log(low) + share * (log(high) - log(low))), low), high))
        return float(min(low + share * (high - low), high))

    def values_at(self, shares: Floats) -> list[Any]:
        """The values at many shares, the same as of `at`.

        >>> Axis("a", (), (1.0, 3.0)).values_at(np.array([0.0, 0.5]))
        [1.0, 2.0]
        """
        if self.span is None or self.log:
            return [self.at(share) for share in shares.tolist()]
        low, high = self.span
        along: list[Any] = np.minimum(low + shares * (high - low), high).tolist()
        return along


def spread(span: tuple[float, float], count: int, *, logarithmic: bool = False) -> tuple[float, ...]:
    """Divide a range into `count` values, its ends exactly among them; one value is the lower end.

    >>> spread((1.0, 100.0), 3, logarithmic=True)
    (1.0, 10.0, 100.0)
    """
    values = np.geomspace(*span, count) if logarithmic else np.linspace(*span, count)
    return tuple(float(value) for value in values)


@dataclass(frozen=True)
class Sampling:
    """The designs of a study, numbered from 0.

    A grid has every combination; the last axis changes fastest. A Latin hypercube of n designs divides each axis
    into n equal parts and has one design in each, at a random place in it: the parts of the axes are paired at
    random, the same for the same seed (`latin_hypercube`). Of paired axes the n-th design has the n-th value of
    each. Nothing grows with the number of designs of a grid or a hypercube.

    size    number of designs of the Latin hypercube; None: a grid, or paired axes
    seed    of its random numbers
    paired  whether the axes, which then have equally many values, are paired
    """

    axes: tuple[Axis, ...]
    size: int | None = None
    seed: int = 1
    paired: bool = False

    @property
    def kind(self) -> str:
        """What it is called in a study file."""
        return "paired" if self.paired else "grid" if self.size is None else "latin-hypercube"

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values along each axis of a grid; else (n,) of the n designs."""
        if self.paired:
            return (len(self.axes[0].values),)
        return tuple(len(axis.values) for axis in self.axes) if self.size is None else (self.size,)

    @property
    def count(self) -> int:
        """Number of designs."""
        return prod(self.shape)

    def values(self, design: int) -> tuple[Any, ...]:
        """A design's value along each axis.

        >>> Sampling((Axis("a", (1, 2)), Axis("b", ("x", "y", "z")))).values(4)
        (2, 'y')
        """
        if self.size is not None:
            places = (share(self.seed, n, self.size, design) for n in range(len(self.axes)))
            return tuple(axis.at(place) for axis, place in zip(self.axes, places, strict=True))
        if self.paired:
            return tuple(axis.values[design] for axis in self.axes)
        steps = np.unravel_index(design, self.shape)
        return tuple(axis.values[int(step)] for axis, step in zip(self.axes, steps, strict=True))

    def columns(self, first: int, last: int) -> list[tuple[Axis, Sequence[Any], Ints]]:
        """Of designs first to last - 1: each axis, values along it, and at which of them each design is.

        >>> Sampling((Axis("a", (1, 2)), Axis("b", ("x", "y", "z")))).columns(2, 5)[0][1:]
        ((1, 2), array([0, 1, 1]))
        """
        designs = np.arange(first, last)
        if self.paired:
            return [(axis, axis.values[first:last], designs - first) for axis in self.axes]
        if self.size is None:
            places = np.unravel_index(designs, self.shape) if self.axes else ()
            return [(axis, axis.values, place) for axis, place in zip(self.axes, places, strict=True)]
        own, size = designs - first, self.size
        return [
            (axis, axis.values_at(shares(self.seed, n, size, first, last)), own)
            for n, axis in enumerate(self.axes)
        ]


def settings(axes: tuple[Axis, ...], values: tuple[Any, ...]) -> Iterator[tuple[str, Any]]:
    """Path and value of each number that a design changes, tied numbers after those they are tied to."""
    for axis, value in zip(axes, values, strict=True):
        yield from ((key, one) for key, (one,) in axis.columns([value]))
