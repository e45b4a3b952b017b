"""What a rule of a device file is: about the keys of a table, about numbers, or a function of the document.

A rule about numbers is stated by a function of arrays, elementwise, so that it judges one document and the designs
of a sweep alike. Every rule skips what is itself faulty, so that no fault hides another.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.address import is_number, table, written
from zwidth.device.faults import KeyMessages, KeyPath
from zwidth.loop.controller import MOST_FAST_SAMPLES
from zwidth.model.design_axes import join_designs

Document = dict[str, Any]
PERIOD: Final[KeyPath] = ("loop", "sampling_period_s")


class Numbers(NamedTuple):
    """The numbers of a document, or of many designs of it, seen from one of its tables.

    document  plain tables and lists
    path      of the table
    values    path -> numbers (P,) of the designs, where they differ; of one document none
    """

    document: Document
    path: KeyPath = ()
    values: Mapping[KeyPath, Floats] = MappingProxyType({})

    def held(self, key: str) -> Any:
        """The value in the document at a dotted path below the table; None where there is none."""
        return _held(self.document, (*self.path, *steps_of(key)))

    def number(self, key: str) -> Any:
        """The number at a dotted path below the table, of designs that differ there an array (P,); None where the
        document has none."""
        return self._number((*self.path, *steps_of(key)))

    def numbers(self, key: str) -> Any:
        """The list of numbers at a dotted path below the table, of designs an array ([P,] n); None where the
        document has none."""
        steps = (*self.path, *steps_of(key))
        held = _held(self.document, steps)
        own = [self._number((*steps, i)) for i in range(len(held) if isinstance(held, list) else 0)]
        if not own or any(one is None for one in own):
            return None
        return join_designs([np.asarray(one, dtype=float) for one in own], 0) if self.values else own

    def _number(self, steps: KeyPath) -> Any:
        """The number at a path of the document, of designs their array; None where there is no number."""
        if steps in self.values:
            return self.values[steps]
        held = _held(self.document, steps)
        return held if is_number(held) else None

    def period(self) -> Any:
        """The sampling period [s]; None where the document has none in (0, 1] s."""
        T = self._number(PERIOD)
        return T if self.values or (T is not None and 0 < T <= 1) else None

    def local_period(self) -> Any:
        """The sampling period of [loop.local] [s]; None where the document gives no valid one."""
        T, times = self.period(), _held(self.document, ("loop", "local", "rate_multiple"))
        return T / times if T is not None and type(times) is int and 1 <= times <= MOST_FAST_SAMPLES else None


def _held(place: Any, steps: KeyPath) -> Any:
    """The value that keys and indices lead to from `place`; None where there is none."""
    for step in steps:
        if isinstance(step, int):
            place = place[step] if isinstance(place, list) and step < len(place) else None
        else:
            place = place.get(step) if isinstance(place, dict) else None
    return place


@cache
def steps_of(key: str) -> KeyPath:
    """A dotted path as a tuple of keys and, of digits, list indices."""
    return tuple(int(step) if step.isdigit() else step for step in key.split(".") if step)


Read: TypeAlias = str | Callable[[Numbers], Any]
Place: TypeAlias = tuple[KeyPath, dict[str, Any]]


@dataclass(frozen=True)
class KeyRule:
    """Keys of a table that need others, or exclude them.

    place     dotted path of the table, * for each of a list, those of legs too; "" for the file
    at        the key where the fault stands; "" for the table
    given     the rule is broken where all of these hold, separated by spaces: "key", the table has it;
              "key=value", has it with this value; "/path", the file has it
    without   and none of these
    sentence  what is wrong
    """

    place: str
    at: str
    given: str
    without: str
    sentence: str

    def faults(self, document: Document, where: Iterable[Place]) -> KeyMessages:
        """Path and sentence of each table that breaks the rule, of those that it is about."""
        for path, own in where:
            if self._broken(document, own):
                yield (*path, *steps_of(self.at)), self.sentence

    def _broken(self, document: Document, own: dict[str, Any]) -> bool:
        """Whether a table breaks the rule: all conditions of `given` hold and none of `without`."""
        for condition in _conditions(self.given):
            if not _holds(document, own, *condition):
                return False
        return not any(_holds(document, own, *condition) for condition in _conditions(self.without))


@cache
def _conditions(words: str) -> tuple[tuple[bool, KeyPath, str], ...]:
    """Of each condition of a `KeyRule` whether its path is one of the file, the path, the value, "" for any."""
    parts = [word.partition("=") for word in words.split()]
    return tuple((path[0] == "/", steps_of(path.removeprefix("/")), value) for path, _, value in parts)


def _holds(document: Document, own: dict[str, Any], in_file: bool, steps: KeyPath, value: str) -> bool:
    """Whether a condition holds: the file, or the table `own`, has a value at a path: any, or the one given."""
    held = _held(document if in_file else own, steps)
    wanted = True if value == "true" else value
    return held is not None and (not value or (type(held) is type(wanted) and held == wanted))


@dataclass(frozen=True)
class NumberRule:
    """Numbers that must fit each other; where one of them is not given, they do.

    place, at  as of a `KeyRule`
    reads      the numbers: dotted paths below the table, or functions of its `Numbers`
    broken     of these numbers, arrays (...) or (..., n): whether they break the rule (...)
    sentence   what they must be and what they are, of the same numbers of one document as they are written: a
               function, or a text that is formatted
    """

    place: str
    at: str
    reads: tuple[Read, ...]
    broken: Callable[..., Any]
    sentence: str | Callable[..., str]

    def faults(self, document: Document, where: Iterable[Place]) -> KeyMessages:
        """Path and sentence of each table whose numbers break the rule, of those that it is about."""
        say = self.sentence.format if isinstance(self.sentence, str) else self.sentence
        for path, numbers, broken in self.judged(Numbers(document), where):
            if broken:
                yield (*path, *steps_of(self.at)), say(*numbers)

    def judged(self, whole: Numbers, where: Iterable[Place]) -> Iterator[tuple[KeyPath, list[Any], Any]]:
        """Path and numbers of each table that has all of them, and whether they break the rule: of designs (P,),
        or () where they do not differ."""
        first = self.reads[0]
        for path, entry in where:
            if isinstance(first, str) and _held(entry, steps_of(first)) is None:
                continue  # as most of what may be given is not
            own, numbers = Numbers(whole.document, path, whole.values), list[Any]()
            for read in self.reads:
                numbers.append(own.number(read) if isinstance(read, str) else read(own))
                if numbers[-1] is None:
                    break
            else:
                with np.errstate(all="ignore"):  # what is faulty by itself may overflow
                    yield path, numbers, self.broken(*(np.asarray(number, dtype=float) for number in numbers))


def places(document: Document, pattern: str) -> list[Place]:
    """Path and table of each place that a dotted pattern means, whose last step may be * for each element of a
    list; what is no table is left out."""
    steps = steps_of(pattern)
    if steps[:1] == ("mechanism",) and steps[2:] == ("*",):
        entries = written(table(document, "mechanism"), str(steps[1]))
        return [(("mechanism", *path), entry) for path, entry in entries]
    place: Any = document
    for step in steps:
        if step == "*":
            elements = enumerate(place if isinstance(place, list) else [])
            return [((*steps[:-1], i), entry) for i, entry in elements if isinstance(entry, dict)]
        place = place.get(step) if isinstance(place, dict) else None
    return [(steps, place)] if isinstance(place, dict) else []


Rule: TypeAlias = KeyRule | NumberRule | Callable[[Document], KeyMessages]


def rule_faults(rules: Iterable[Rule], document: Document) -> KeyMessages:
    """Path and sentence of every fault that rules find in a document, rule by rule."""
    found: dict[str, list[Place]] = {}
    for rule in rules:
        if isinstance(rule, KeyRule) or isinstance(rule, NumberRule):  # noqa: SIM101  a union takes ten times as long
            if rule.place not in found:
                found[rule.place] = places(document, rule.place)
            if where := found[rule.place]:
                yield from rule.faults(document, where)
        else:
            yield from rule(document)
