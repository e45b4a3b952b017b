"""What measures must be told: options, keys of study files and axes, one table of numbers for all of them."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from tests.cli.command_runner import MECHANISM, document_of, run_command
from zwidth.measures import WantedWall
from zwidth.measures.definition import WantedWalls
from zwidth.questions import WANTED
from zwidth.study import StudyFile

FEW = ("--cells", "3,2", "--x", "-0.05,0.05", "--y", "0.2,0.25")
MARGINS = ("--stiffness-margin", "0.1", "--damping-margin", "0.2", "--delay-margin", "0.5")
ASKED = (
    ("stiffness_max_decaying", ("--spectral-radius", "0.99"), {"spectral_radius": 0.99}),
    (
        "stiffness_max_with_margins",
        MARGINS,
        {"stiffness_margin": 0.1, "damping_margin": 0.2, "delay_margin": 0.5},
    ),
    ("rate_hardness", ("--stiffness", "900", "--damping", "4"), {"stiffness": 900.0, "damping": 4.0}),
    (
        "impedance_ratio",
        ("--lowest-frequency", "1", "--highest-frequency", "9", "--spectral-radius", "0.99"),
        {"lowest_frequency": 1.0, "highest_frequency": 9.0, "spectral_radius": 0.99},
    ),
    ("link_clearance", ("--link-radius", "0.004"), {"link_radius": 0.004}),
    ("first_mode", (), {}),
    ("reach", (), {}),
)


@pytest.mark.parametrize(("name", "words", "wanted"), ASKED, ids=[row[0] for row in ASKED])
def test_a_map_has_the_measures_of_its_places(name, words, wanted):
    document = document_of("map", MECHANISM, "--measure", name, *words, *FEW)
    place = zwidth.load(MECHANISM).at((document["x_m"][1], document["y_m"][1], 0.0))
    assert document["values"][1][1] == pytest.approx(float(place.measure(name, **wanted).values), rel=1e-9)


def test_the_worst_direction_is_no_better_than_the_file_s():
    asked = ("map", MECHANISM, "--measure", "stiffness_max_with_margins", *MARGINS, *FEW)
    worst, given = (np.array(document_of(*asked, *more)["values"]) for more in (("--direction", "worst"), ()))
    assert np.all(worst <= given * (1.0 + 1e-9))


def test_only_the_named_links_are_checked_in_a_map():
    pairs = ("--colliding-links", "upper-left:distal-right", "--colliding-links", "upper-right:distal-left")
    words = ("map", MECHANISM, "--measure", "link_clearance", "--link-radius", "0", *FEW)
    named, every = document_of(*words, *pairs), document_of(*words)
    assert named["values"] == every["values"]


def test_every_number_is_a_key_of_study_files_a_field_and_an_option():
    text = run_command("map", "--help").out
    fields = StudyFile.model_fields
    for one in WANTED.values():
        assert one.key in fields
        assert hasattr(WantedWall(), one.name)
        assert hasattr(WantedWalls(), one.name)
        assert f"--{one.name.replace('_', '-')}" in text
        extra = fields[one.key].json_schema_extra
        assert (extra or {}).get("unit", "") == one.unit or not one.unit
    assert "stiffness_max_with_margins" in text


STUDY = """
device = "five-bar"
measures = ["stiffness_max_with_margins", "worst(link_clearance)", "motor_heat"]
stiffness_margin = 0.1
damping_margin = 0.1
link_radius_m = 0.003
colliding_links = ["upper-left:distal-right"]
set = ["drives.motor-left.winding_resistance_ohm=2", "drives.motor-right.winding_resistance_ohm=2"]
[[axis]]
key = "delay_margin_samples"
values = [0.0, 0.5]
[[axis]]
key = "force_N"
range = [1.0, 2.0]
count = 2
[workspace]
x_m = [-0.05, 0.05]
y_m = [0.2, 0.25]
count = 3
"""


def test_a_study_varies_what_measures_are_told(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    values = document_of("sweep", tmp_path / "study.toml")["values"]
    stiffness, heat = ([one[name] for one in values] for name in ("stiffness_max_with_margins", "motor_heat"))
    assert stiffness[0] == stiffness[1] > stiffness[2] == stiffness[3]
    assert heat[1] == pytest.approx(4.0 * heat[0])
    assert heat[2:] == heat[:2]
    device = zwidth.load("five-bar")
    alone = device.at().measure(
        "stiffness_max_with_margins", stiffness_margin=0.1, damping_margin=0.1, delay_margin=0.5
    )
    assert stiffness[2] == pytest.approx(float(alone.values), rel=1e-9)
