"""Axes of a study, the numbers tied to them, and the designs they span.

Catalogues: tables of parts, such as motors or tubes, from which an axis of a study chooses one for each design. A
CSV file with a line of headings: one column holds the names of the parts, the others their numbers.

Latin hypercubes whose designs are computed one by one, by their number: no design needs another's.

Each axis is cut into n equal parts, and each part has one design, at a random place in it (McKay, Beckman and
Conover 1979, known at second hand). Which part a design has is a permutation of the numbers below n that is
computed for any of them: the number is written as two digits of mixed base, which change each other in turn by the
hash of a key (a generalised Feistel network), until the result lies below n (Black and Rogaway 2002, "Ciphers with
arbitrary finite domains", known at second hand). The hash is the output function of SplitMix64 (Steele, Lea and
Flood 2014, known at second hand); the place in the part is its hash of the design's number. Of few designs the
parts are in the order of hashes, which is simply random: a network of two small digits is not quite.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import exp, isnan, isqrt, log, prod
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.device.faults import comma_list
from zwidth.device.read import LARGEST_TABLE, read_text
from zwidth.errors import FileError
from zwidth.questions import WANTED_BY_KEY

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
    """A number, or each number of nested lists, times a factor."""
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
            # all parts set the same paths, in the same order
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
    random, the same for the same seed. Of paired axes the n-th design has the n-th value of
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
        """The sampling's name in a study file."""
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
        """For each axis, of designs first to last - 1: the axis, values along it, and the place (last - first,)
        among these at which each design is.

        >>> Sampling((Axis("a", (1, 2)), Axis("b", ("x", "y", "z")))).columns(2, 5)[0][1:]
        ((1, 2), array([0, 1, 1]))
        """
        designs = np.arange(first, last)
        if self.paired:
            return [(axis, axis.values[first:last], designs - first) for axis in self.axes]
        if self.size is None:
            places = np.unravel_index(designs, self.shape) if self.axes else ()
            return [(axis, axis.values, place) for axis, place in zip(self.axes, places, strict=True)]
        each, size = designs - first, self.size  # every design has a value of its own
        return [
            (axis, axis.values_at(shares(self.seed, n, size, first, last)), each)
            for n, axis in enumerate(self.axes)
        ]


def settings(axes: tuple[Axis, ...], values: tuple[Any, ...]) -> Iterator[tuple[str, Any]]:
    """Path and value of each number that a design changes, tied numbers after those they are tied to."""
    for axis, value in zip(axes, values, strict=True):
        yield from ((key, one) for key, (one,) in axis.columns([value]))


NAMES: Final = "name"  # heading of the column of names
Part: TypeAlias = tuple[tuple[str, float], ...]  # path of the device file -> number


def read_catalogue(path: Path, columns: Mapping[str, str]) -> dict[str, Part]:
    """The parts of a catalogue by name, each with the numbers that it sets.

    columns  path of the device file -> heading of the column that holds its number
    Raises   FileError  with all that is wrong, a line for each
    """
    try:
        text = read_text(path, LARGEST_TABLE)
    except FileError as error:
        raise FileError(str(error)) from None
    rows = [row for row in csv.reader(io.StringIO(text)) if any(cell.strip() for cell in row)]
    if not rows:
        raise FileError("is empty; write a line of headings, one of them 'name', and a line for each part")
    headings = [heading.strip() for heading in rows[0]]
    if len(headings) == 1 and ";" in headings[0]:
        raise FileError("separates its columns by ';'; save it with commas, and numbers with decimal points")
    absent = [heading for heading in dict.fromkeys([NAMES, *columns.values()]) if heading not in headings]
    if absent:
        has = comma_list([repr(heading) for heading in headings])
        raise FileError("\n".join(f"has no column {heading!r}; it has {has}" for heading in absent))
    twice = [heading for heading in dict.fromkeys(headings) if headings.count(heading) > 1]
    if twice:
        raise FileError(f"has several columns {twice[0]!r}; give each a name of its own")
    return _parts(headings, rows[1:], columns)


def _parts(headings: list[str], rows: list[list[str]], columns: Mapping[str, str]) -> dict[str, Part]:
    """The parts of the rows below the headings, as `read_catalogue`. Raises FileError with all that is wrong."""
    parts: dict[str, Part] = {}
    wrong: list[str] = []
    for number, row in enumerate(rows, 1):
        if len(row) != len(headings):
            wrong.append(f"part {number} has {len(row)} cells, the line of headings {len(headings)}")
            continue
        cells = {heading: cell.strip() for heading, cell in zip(headings, row, strict=True)}
        name = cells[NAMES]
        if not name or name in parts:
            what = f"is called {name!r}, as one before it" if name else "has no name"
            wrong.append(f"part {number} {what}; give it a name of its own")
            continue
        numbers: list[tuple[str, float]] = []
        for path, heading in columns.items():
            value = _number(cells[heading])
            if value is None:
                wrong.append(f"part {name!r}: {heading} must be a number, got {cells[heading]!r}")
            else:
                numbers.append((path, value))
        parts[name] = tuple(numbers)
    if wrong:
        raise FileError("\n".join(wrong))
    if not parts:
        raise FileError("holds no part; write a line for each below the headings")
    return parts


def _number(text: str) -> float | None:
    """The number in a cell of the table; None where it holds none, or nan."""
    try:
        value = float(text)
    except ValueError:
        return None
    return None if isnan(value) else value


ROUNDS: Final = 10  # of the network; four make it random for large n, small n need more
FEW: Final = 4096  # designs that are put in order
BLOCK: Final = 1024  # designs that are computed at once where one is asked for
_GAMMA: Final = np.uint64(0x9E3779B97F4A7C15)  # step between the numbers that SplitMix64 hashes
_BELOW_ONE: Final = float(np.nextafter(1.0, 0.0))

Words = NDArray[np.uint64]


def shares(seed: int, axis: int, size: int, first: int, last: int) -> Floats:
    """How far along an axis designs first to last - 1 lie, from 0 to below 1, (last - first,).

    seed  of the random numbers;   axis  number of the axis;   size  number of all designs

    >>> sorted(int(5 * share) for share in shares(1, 0, 5, 0, 5))
    [0, 1, 2, 3, 4]
    """
    keys = _keys(seed, axis)
    designs = np.arange(first, last, dtype=np.uint64)
    places = (_hash(designs * _GAMMA + keys[ROUNDS]) >> np.uint64(11)).astype(np.float64) * 2.0**-53  # 53 bits
    order = _ordered(seed, axis, size)[first:last] if size <= FEW else _permuted(designs, size, keys)
    parts = order.astype(np.float64)
    # the division may round up to 1
    return np.minimum((parts + places) / size, _BELOW_ONE)


def share(seed: int, axis: int, size: int, design: int) -> float:
    """How far along an axis one design lies; see `shares`."""
    return float(_block(seed, axis, size, design // BLOCK)[design % BLOCK])


@lru_cache(maxsize=64)
def _block(seed: int, axis: int, size: int, number: int) -> Floats:
    """The `shares` (BLOCK,), of the last block fewer, of one block of designs, kept for the next design of it."""
    return shares(seed, axis, size, number * BLOCK, min((number + 1) * BLOCK, size))


@lru_cache(maxsize=64)
def _keys(seed: int, axis: int) -> Words:
    """Keys of the hashes (ROUNDS + 1,): of each round of the network, and of the places in the parts."""
    return np.random.SeedSequence((seed, axis)).generate_state(ROUNDS + 1, np.uint64).astype(np.uint64)


@lru_cache(maxsize=64)
def _ordered(seed: int, axis: int, size: int) -> Ints:
    """A permutation (size,) of the numbers below `size`: the order of their hashes."""
    hashes = _hash(np.arange(size, dtype=np.uint64) * _GAMMA + _keys(seed, axis)[0])
    return np.argsort(hashes, kind="stable")


def _permuted(numbers: Words, size: int, keys: Words) -> Words:
    """Images of numbers below `size` under a permutation of them; keys (ROUNDS + 1,) of its hashes. The network
    permutes a few numbers more: an image beyond the size is sent through it again, until it lies below."""
    low = isqrt(size - 1) + 1  # bases of the two digits; their product is hardly above the size
    high = -(-size // low)
    images = _network(numbers, np.uint64(low), np.uint64(high), keys)
    while len(outside := np.flatnonzero(images >= size)):
        images[outside] = _network(images[outside], np.uint64(low), np.uint64(high), keys)
    return images


def _network(numbers: Words, low: np.uint64, high: np.uint64, keys: Words) -> Words:
    """Images of numbers below low * high under a permutation of them: the Feistel network (see the file)."""
    left, right = numbers // low, numbers % low  # the two digits, below `high` and below `low`
    for n in range(0, ROUNDS, 2):
        left = (left + _hash(right + keys[n]) % high) % high
        right = (right + _hash(left + keys[n + 1]) % low) % low
    return left * low + right


def _hash(words: Words) -> Words:
    """The output function of SplitMix64: each bit of a word changes about half of the others."""
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))
