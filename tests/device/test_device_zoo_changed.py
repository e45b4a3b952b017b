"""Bundled devices with legs and couplings, one thing of their files changed: what is refused, and in which
words."""

from __future__ import annotations

from copy import deepcopy

import pytest

from zwidth.device import address, from_document
from zwidth.device.read import read
from zwidth.errors import DeviceError


def faults(name, path, value):
    """The sentences about a bundled file with one number, name or list changed; None leaves a key out."""
    document = deepcopy(read(name)[0])
    table = document
    for step in path[:-1]:
        table = table[step]
    if value is None:
        del table[path[-1]]
    else:
        table[path[-1]] = value
    with pytest.raises(DeviceError) as refused:
        from_document(document, "my.toml")
    return str(refused.value)


def test_a_coupled_drive_needs_its_ratio():
    said = faults("woodenhaptics", ("mechanism", "drives", 2, "transmission_ratio"), None)
    assert "mechanism.drives.motor-c.transmission_ratio: is missing" in said


def test_hinges_that_hold_everything_leave_no_freedom():
    said = faults("stamper-delta", ("mechanism", "legs", 0, "loops", 1, "axes", 1, 2), -1.0)
    assert said.startswith("my.toml: mechanism.loops: leave ")
    assert "of its 21" in said


@pytest.mark.parametrize(
    ("name", "path"), [("novint-falcon", ("legs", 0, "links", 1)), ("touch-omni", ("links", 7))]
)
def test_what_is_no_name_is_one_sentence(name, path):
    """Wherever else names are compared it is passed over."""
    for wrong in ([], {}):
        assert "name" in faults(name, ("mechanism", *path, "name"), wrong).splitlines()[0]


def test_links_with_masses_and_rotors_unknown_is_a_device():
    document = deepcopy(read("stamper-delta")[0])
    del document["mechanism"]["legs"][0]["drives"][0]["motor_inertia_kg_m2"]
    device = from_document(document, "my.toml")
    assert device.missing["dynamics"] == ("mechanism.legs.leg.drives.motor.motor_inertia_kg_m2",)
    assert address.get(document, "mechanism.legs.leg.drives.motor.transmission_ratio") == 1.0
