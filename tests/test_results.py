"""The unit of a number's key is the one that its docstring states."""

from __future__ import annotations

import importlib
import pkgutil
import re

import pytest

import zwidth
from zwidth.result import Documented, entries_of

# Units as docstrings write them, and how a key ends that has them.
ENDINGS = {
    "N/m": "_N_per_m",
    "N s/m": "_Ns_per_m",
    "N^2 s/m^2": "_N2s_per_m2",
    "Hz": "_Hz",
    "kg": "_kg",
    "m": "_m",
    "m/s": "_m_per_s",
    "1/s": "_per_s",
    "s": "_s",
    "N": "_N",
    "J": "_J",
    "rad": "_rad",
    "deg": "_deg",
}
UNIT = re.compile(rf"\[({'|'.join(map(re.escape, ENDINGS))})\]")


def documented_classes() -> list[type]:
    """All classes with numbers that documents hold."""
    for module in pkgutil.walk_packages(zwidth.__path__, "zwidth."):
        if not re.search(r"\.show|__main__|_cuda", module.name):
            importlib.import_module(module.name)
    waiting, found = [Documented], set()
    while waiting:
        waiting += (own := waiting.pop().__subclasses__())
        found |= {kind for kind in own if "__dataclass_fields__" in vars(kind)}
    return sorted(found, key=lambda kind: (kind.__module__, kind.__name__))


def units_in_words(kind: type) -> dict[str, str]:
    """Unit of each attribute of its own by the docstrings, of fields and of properties, where they state one.

    A line of a field begins with its name, or with those of several, each with its unit or all with one.
    """
    own, stated = vars(kind), {}
    names = "|".join(own.get("__annotations__", ()))
    starts = re.compile(rf"(?:^|\n| ;   |;   )\s*((?:{names})(?:, (?:{names}))*)(?=\s)")
    parts = starts.split(kind.__doc__ or "")[1:] if names else []
    for line, text in zip(parts[::2], parts[1::2], strict=True):
        units, fields = UNIT.findall(text), line.split(", ")
        if len(units) == 1:
            units *= len(fields)
        stated |= dict(zip(fields, units, strict=True)) if len(units) == len(fields) else {}
    for name, member in own.items():
        function = getattr(member, "fget", None) or getattr(member, "func", None)
        units = UNIT.findall(getattr(function, "__doc__", None) or "")
        stated |= {name: units[0]} if len(units) == 1 else {}
    return stated


CLASSES = documented_classes()


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_a_key_ends_in_the_unit_that_the_docstring_states(kind):
    entries, stated = entries_of(kind), units_in_words(kind)
    keys = {name: key for name, (key, one) in entries.items() if name in stated and not one.spread}
    assert {name: key for name, key in keys.items() if not key.endswith(ENDINGS[stated[name]])} == {}


def test_most_units_are_stated_in_words():
    entries = [(kind, name) for kind in CLASSES for name, (_, one) in entries_of(kind).items() if one.unit]
    stated = [(kind, name) for kind, name in entries if any(name in units_in_words(base) for base in kind.__mro__)]
    assert len(stated) > 0.8 * len(entries)
