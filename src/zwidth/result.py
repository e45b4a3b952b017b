"""`Result`: the methods of every result: a document, a table, a short repr and a figure.

A number's key is stated once, where the number is: by `entry` in a field, by `documented` on a property. It is the
name with the unit at its end. `document` and the columns of `table` follow; a class overrides only what differs.

>>> from dataclasses import dataclass, field
>>> @dataclass(frozen=True)
... class Spring(Documented):
...     stiffness: float = field(metadata=entry("N/m"))
...     mass: float = field(metadata=entry("kg", name="moving_mass"))
...     reason: str = field(default="", metadata=entry(empty="left out"))
...
...     @property
...     @documented("N", before="mass")
...     def weight(self) -> float:
...         return 10.0 * self.mass
>>> Spring(100.0, 0.5).document()
{'stiffness_N_per_m': 100.0, 'weight_N': 5.0, 'moving_mass_kg': 0.5}
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from math import isfinite
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar

from zwidth import _verbs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from zwidth.loop.operating_point import OperatingPoint

Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Entry:
    """How a field or a property stands in the document.

    unit    "N s/m", as people write it; "" for none
    name    in the document; "": that of the attribute
    empty   what becomes of None and of an empty text, tuple or array: kept as it is, null, or left out
    value   function of the value, whose result stands in its place; None: the value itself
    lists   whether arrays become nested lists
    spread  whether the entries of the value stand in its place, without a key of their own
    before  attribute before which it stands; "": fields in the order of declaration, then properties
    """

    unit: str = ""
    name: str = ""
    empty: Literal["kept", "null", "left out"] = "kept"
    value: Callable[[Any], Any] | None = None
    lists: bool = False
    spread: bool = False
    before: str = ""

    def key(self, attribute: str) -> str:
        """Key in the document: name and unit, such as "damping_Ns_per_m"."""
        apart = self.unit.replace("kg m", "kg_m")  # the blank is kept in a key, "_kg_m2"
        unit = apart.replace(" ", "").replace("^", "").replace("/", "_per_")
        return "_".join(filter(None, (self.name or attribute, unit)))


def entry(unit: str = "", **how: Any) -> dict[str, Entry]:
    """Metadata of a field that stands in the document; the arguments are those of `Entry`."""
    return {"entry": Entry(unit, **how)}


def documented(unit: str = "", **how: Any) -> Callable[[Function], Function]:
    """Decorate the function of a property that stands in the document; the arguments are those of `Entry`."""

    def declare(function: Function) -> Function:
        vars(function).update(entry(unit, **how))
        return function

    return declare


@cache
def entries_of(kind: type) -> dict[str, tuple[str, Entry]]:
    """Key and entry of each attribute of a dataclass that its document has, in order.

    Those of its bases first, of each class fields before properties; but one with `before` stands where that says.
    """
    of_fields: dict[str, Mapping[Any, Any]] = {one.name: one.metadata for one in fields(kind)}
    found: dict[str, Entry] = {}
    for base in reversed(kind.__mro__):
        members = vars(base)
        stated = [(name, of_fields[name]) for name in members.get("__annotations__", ()) if name in of_fields]
        for name, member in members.items():
            function = getattr(member, "fget", None) or getattr(member, "func", None)  # of a cached property
            stated.append((name, getattr(function, "__dict__", {})))
        found |= {name: metadata["entry"] for name, metadata in stated if "entry" in metadata}
    order = [name for name, one in found.items() if not one.before]
    for name, one in found.items():
        if one.before:
            order.insert(order.index(one.before), name)
    return {name: (found[name].key(name), found[name]) for name in order}


def keys_of(kind: type) -> list[str]:
    """Keys of a class's document in their order, with those that are left out where they are empty."""
    return [key for key, _ in entries_of(kind).values()]


def finite(value: float) -> float | None:
    """The number; None where it is not finite."""
    return value if isfinite(value) else None


class Documented:
    """A dataclass whose numbers can be read by their keys."""

    def document(self) -> dict[str, Any]:
        """Every number by its key, the unit in the name; parts by their own documents, tuples as lists.

        Empty ones are kept, null or left out, as their entries declare.
        """
        entries: dict[str, Any] = {}
        kind: Any = type(self)  # a class is hashable, which mypy denies of a variable one
        for attribute, (key, declared) in entries_of(kind).items():
            value = getattr(self, attribute)
            value = declared.value(value) if declared.value else value
            if declared.empty != "kept" and (value is None or (hasattr(value, "__len__") and not len(value))):
                if declared.empty == "left out":
                    continue
                value = None
            if declared.spread:
                entries |= _plain(value, declared.lists)
            else:
                entries[key] = _plain(value, declared.lists)
        return entries


def _plain(value: Any, lists: bool) -> Any:
    """The value as plain data: a part as its document, a tuple as a list; with `lists` also an array as a list."""
    if isinstance(value, Documented):
        return value.document()
    if isinstance(value, tuple | list):
        return [_plain(one, lists) for one in value]
    return value.tolist() if lists and hasattr(value, "tolist") else value


class Result(Documented):
    """A result: numbers that can be read as a document, a table, a figure or in a notebook.

    `document()` holds every number under its key, the unit in the name, as `--json` prints it; `table()` holds
    columns of equal length, as a .csv file has them. `repr` is a few lines without arrays. The code that draws
    figures is imported only when `plot` is called or a notebook shows the result.

    operating_point  operating point of the result, which its figure states; None: a result without a device
    """

    operating_point: OperatingPoint | None = None

    def about(self, point: OperatingPoint) -> Self:
        """Remember the operating point that this result, just computed, is about; returns the result itself."""
        object.__setattr__(self, "operating_point", point)
        return self

    def table(self) -> Mapping[str, Any]:
        """Columns of equal length by their keys: the document's arrays of one axis."""
        return {key: value for key, value in self.document().items() if getattr(value, "ndim", 0) == 1}

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the result; returns the axes, in which more can be drawn.

        ax  axes to draw into; left out: those of a new figure of pyplot's, with a caption below that says which
            device it shows, where, and how it is sampled
        """
        return _verbs.plot(self, ax)

    def _repr_html_(self) -> str:
        """The result as notebooks show it, in HTML: its `repr` and its figure."""
        return _verbs.notebook(self)
