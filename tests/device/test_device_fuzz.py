"""Whatever is put into a device file or set in it, nothing but a DeviceError comes out."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from zwidth.device import address, bundled_names, from_document
from zwidth.device.faults import one_line
from zwidth.device.load import load
from zwidth.device.read import read
from zwidth.errors import DeviceError

junk = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**30), 10**400)
    | st.floats()
    | st.text(max_size=8)
    | st.dates()
    | st.sampled_from(["base", "revolute", "fixed", "upper-left"]),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
).filter(lambda value: value is not None)


def paths_of(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [p for key, inner in items for p in [(*path, key), *paths_of(inner, (*path, key))]]


def device_error(attempt: Callable[[], object]) -> list[DeviceError]:
    """The DeviceError that comes of an attempt, if one does; any other error goes through."""
    try:
        attempt()
    except DeviceError as error:
        return [error]
    return []


@settings(max_examples=150)
@given(name=st.sampled_from(bundled_names()), data=st.data())
def test_whatever_stands_in_a_file(name, data):
    document = deepcopy(read(name)[0])
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from(paths_of(document)))
        table: Any = document
        for step in path[:-1]:
            table = table[step]
        if data.draw(st.booleans()):
            del table[path[-1]]
        else:
            table[path[-1]] = data.draw(junk)
    errors = device_error(lambda: from_document(document, "my.toml"))
    assert all(len(str(error).splitlines()) == len(error.faults) > 0 for error in errors)


@settings(max_examples=150)
@given(
    path=st.text(max_size=12) | st.sampled_from(list(address.numeric_addresses(read("five-bar")[0]))),
    value=junk,
)
def test_whatever_is_set(path, value):
    errors = device_error(lambda: load("five-bar", [(path, value)]))
    errors += device_error(lambda: load("five-bar", [f"{path}={value}"]))
    assert all(error.faults for error in errors)


@given(st.text())
def test_a_fault_stays_on_its_line(text):
    assert len(one_line(text).splitlines()) <= 1
