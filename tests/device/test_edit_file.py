"""Numbers written into a device file: comments and order stay."""

from __future__ import annotations

import difflib

import pytest

import zwidth
from zwidth.device import edited_text
from zwidth.errors import DeviceError

TEXT = """\
# A device of mine.
name = "Mine"   # for short

[plant]
mass_kg = [[0.2, 0.0],   # link
           [0.0, 0.03]]  # motor
stiffness_N_per_m = [[1.5e4, -1.5e4], [-1.5e4, 1.5e4]]
actuator = [0.0, 1.0]
sensor = [0.0, 1.0]

[loop]
sampling_period_s = 0.001  # [s]
delay_samples = 1

[loop.velocity]
filter = { type = "butterworth", order = 2, cutoff_Hz = 100.0 }
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


def changed(before, after):
    marks = difflib.ndiff(before.splitlines(), after.splitlines())
    return [line for line in marks if line[0] in "+-"]


def test_only_the_number_changes(file):
    after = edited_text(file, {"loop.sampling_period_s": 0.002})
    assert changed(TEXT, after) == ["- sampling_period_s = 0.001  # [s]", "+ sampling_period_s = 0.002  # [s]"]


def test_an_element_of_a_list_changes_and_its_comment_stays(file):
    after = edited_text(file, {"plant.mass_kg.1.1": 0.031})
    assert changed(TEXT, after) == [
        "-            [0.0, 0.03]]  # motor",
        "+            [0.0, 0.031]]  # motor",
    ]


def test_the_edited_file_is_the_device_with_these_settings(file):
    settings = {
        "loop.delay_s": 2e-4,  # drops delay_samples
        "plant.damping_Ns_per_m": [[1.0, -1.0], [-1.0, 1.0]],
        "loop.velocity.filter.time_constant_s": 0.01,  # makes it a filter of the other kind
        "friction.coulomb_N": [0.0, 0.1],
    }
    after = edited_text(file, settings, {"loop.delay_s": "measured"})
    again = file.with_name("again.toml")
    again.write_text(after, encoding="utf-8")
    made, wanted = zwidth.load(again), zwidth.load(file, settings)
    assert {k: v for k, v in made.document.items() if k != "sources"} == wanted.document
    assert made.sources == {"loop.delay_s": "measured"}
    assert after.startswith(TEXT.splitlines()[0])
    assert "# for short" in after
    assert "# link" in after


def test_a_source_is_noted_beside_those_that_are_there(file):
    file.write_text(TEXT + '\n[sources]\n"plant.*" = "weighed"\n', encoding="utf-8")
    after = edited_text(file, {"loop.delay_samples": 2}, {"loop.delay_samples": "measured"})
    assert '"plant.*" = "weighed"\n"loop.delay_samples" = "measured"' in after


def test_what_cannot_be_edited_is_refused(file):
    with pytest.raises(DeviceError, match=r"loop\.delay_sample"):
        edited_text(file, {"loop.delay_sample": 1.0})
    with pytest.raises(DeviceError, match="bundled device"):
        edited_text(file.with_name("none.toml"), {})
    file.write_text("name = ", encoding="utf-8")
    with pytest.raises(DeviceError, match="no TOML"):
        edited_text(file, {})
