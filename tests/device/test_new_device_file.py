"""Device files to start from: complete, commented, plausible, also with all that is optional in them."""

from __future__ import annotations

import re
import tomllib

import numpy as np
import pytest

from zwidth.device import bundled_names, from_document, implausible, new_device
from zwidth.device.read import KINDS

OPTIONAL = re.compile(r"^#(?=[a-z\[])", re.MULTILINE)
UNIT = re.compile(r"\w+?_(kg_m2|kg|m|s|N|rad|samples|Nm|N_per_m|Ns_per_m|Nm_per_rad|Nm_per_A) =")
UNITS = {
    "kg_m2": "kg m²",
    "kg": "kg",
    "m": "m",
    "s": "s",
    "N": "N",
    "rad": "rad",
    "samples": "samples",
    "Nm": "N m",
    "N_per_m": "N/m",
    "Ns_per_m": "N s/m",
    "Nm_per_rad": "N m/rad",
    "Nm_per_A": "N m/A",
}
NAMES = ["My paddle", 'with "quotes"', r"a\b", "it's", "Stäbe 2", "x = 1 # no", "[loop]"]


def blocks(text: str) -> list[str]:
    """The parts of a file, each with its comment."""
    return text.strip().split("\n\n")


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_is_a_plausible_device_of_its_kind(kind):
    device = from_document(tomllib.loads(new_device("mine", kind)))
    assert device.name == "mine"
    assert implausible(device) == []
    assert (device.mechanism is None) == (kind == "plant")
    chart = device.chart()
    assert 500.0 < chart.stiffness_max < 20_000.0, "a haptic device of this size"
    assert len(chart.regions) == 1
    if device.mechanism is not None:
        posture = device.at().posture
        assert posture is not None
        assert float(posture.projected) < 1e-9
        assert len(device.mechanism.drives.names) == {"paddle": 1, "delta": 3, "wrist": 3, "stewart": 6}.get(
            kind, 2
        )


@pytest.mark.parametrize("kind", KINDS)
def test_all_that_is_optional_may_be_freed(kind):
    text = new_device("mine", kind)
    device = from_document(tomllib.loads(OPTIONAL.sub("", text)))
    assert implausible(device) == []
    assert (device.operator is None) == (kind == "wrist")  # an arm is described by newtons and metres
    assert device.controller.velocity_filter is not None
    assert device.controller.actuator_time_constant > 0.0
    assert set(device.linear_omissions) == {"dry friction", "encoder steps", "the force limit"}
    assert device.chart().stiffness_max > 0.0
    if kind != "wrist":
        assert device.with_({"operator": "unset"}).chart().stiffness_max > 0.0
    if kind in ("serial-2r", "five-bar"):
        assert device.mechanism is not None
        assert np.isfinite(device.mechanism.workspace[:2]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_each_optional_part_stands_by_itself(kind):
    parts = blocks(new_device("mine", kind))
    freed = 0
    for n, part in enumerate(parts):
        if OPTIONAL.search(part):
            from_document(tomllib.loads("\n\n".join([*parts[:n], OPTIONAL.sub("", part), *parts[n + 1 :]])))
            freed += 1
    assert freed >= 5


@pytest.mark.parametrize("kind", KINDS)
def test_every_section_and_every_number_has_its_comment(kind):
    text = OPTIONAL.sub("", new_device("mine", kind))
    for part in blocks(text):
        lines = part.splitlines()
        assert lines[0].startswith("# "), part
        assert all(len(line) <= 115 for line in lines)
        for line in lines:
            if not line.startswith(("#", "[")):
                assert re.search(r"\S +# \S.{5,}", line), line
            if (unit := UNIT.match(line)) and " = { " not in line:
                assert f"[{UNITS[unit[1]]}" in line.partition("#")[2], line


@pytest.mark.parametrize("name", NAMES)
def test_any_name_is_kept(name):
    text = new_device(name, "plant")
    assert tomllib.loads(text)["name"] == name
    assert from_document(tomllib.loads(text)).name == name


@pytest.mark.parametrize("name", ["", "  ", "two\nlines", "\x7f", "\udc80"])
def test_what_is_no_line_of_text_is_no_name(name):
    with pytest.raises(ValueError, match=r"^name must "):
        new_device(name, "plant")


def test_another_kind_is_refused_with_those_there_are():
    with pytest.raises(ValueError, match=r"^kind must .*'scara'"):
        new_device("mine", "scara")


def test_they_are_no_bundled_devices():
    """Somebody's own device is to be made of them; answers about their numbers are of no use to anybody."""
    files = {file.removesuffix(".toml") for file in KINDS.values()}
    assert len(files) == len(KINDS)
    assert not files & set(bundled_names())
