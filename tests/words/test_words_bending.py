"""What a report says of links that bend."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache
from math import inf, nan

import pytest

import zwidth
from tests.model.beam_devices import device, drive, five_bar, light_five_bar, link, planar_arm, spatial_arm, tube
from zwidth.device import from_document, new_device
from zwidth.show import gather, json_value, keys_of_moments, speaking_of_moments, typed
from zwidth.show.report import bending as section
from zwidth.show.report import report

DOCUMENTS = {
    "planar arm": planar_arm,
    "spatial arm": spatial_arm,
    "five-bar of tubes": five_bar,
    "light five-bar": light_five_bar,
    "one beam": lambda: device(
        [link("arm", "base", length_m=0.3, beam=tube(12, 1))], [drive("arm", 40.0)], {"arm": 0.0}, (0.0, 1.0),
        spatial=False,
    ),
    "thick beam": lambda: device(
        [link("arm", "base", length_m=0.1, beam=tube(40, 4))], [drive("arm", 0.1)], {"arm": 0.0}, (0.0, 1.0),
        spatial=False,
    ),
}  # fmt: skip


@cache
def device_of(name):
    if name in DOCUMENTS:
        return from_document(DOCUMENTS[name]())
    if name in ("paddle", "serial-2r", "delta"):
        return from_document(tomllib.loads(new_device("a template", name)))
    return zwidth.load(name)


@cache
def facts(name, **question):
    asked = device_of(name)
    return gather(asked, asked.at(**question))


@cache
def found(name):
    return device_of(name).bending()


def changed(name, bent=None, rigid=None):
    """The result with other numbers of either device: name=value."""
    own = found(name)
    return replace(own, bent=replace(own.bent, **bent or {}), rigid=replace(own.rigid, **rigid or {}))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "one beam",
            "The link arm bends, by what the file gives. This compares the device with the same where this link "
            "is rigid, of the same mass and inertia.",
        ),
        (
            "planar arm",
            "The links upper and lower bend, by what the file gives. This compares the device with the same where "
            "these links are rigid, of the same mass and inertia.",
        ),
    ],
)
def test_beams_of_the_file_are_named(name, text):
    assert typed(section.beginning(found(name))) == text


def test_tubes_are_said_to_be_assumed():
    one, two = (typed(section.beginning(found(name))) for name in ("paddle", "serial-2r"))
    assert one.startswith(
        "The file takes its links as rigid. To see what bending could change, the link paddle is "
    )
    assert "is taken as a round tube of aluminium 6061, as long as the link, with a wall of a tenth of" in one
    assert "the links upper and lower are taken as round tubes of aluminium 6061, each as long as its link" in two
    for text in (one, two):
        assert "half of its link's mass, or less where" in text
        assert text.endswith("A real link may be softer or stiffer.")


def test_what_damps_the_tubes_is_said_where_the_file_does_not():
    sentence = (
        "The file gives bending no damping: here each tube has a damping ratio of 1 % in its own first "
        "vibration, clamped at its base. "
    )
    assert typed(section.damping(found("phantom-premium-1.5"))) == sentence
    assert sentence in typed(section.beginning(found("phantom-premium-1.5")))
    assert section.damping(found("five-bar")) == section.damping(found("planar arm")) == ""


def test_links_that_stay_rigid_are_named():
    why = "joint, mass or inertia is not that of such a tube. "
    assert section.kept(found("phantom-premium-1.5")) == f"The link crank stays rigid: its {why}"
    several = section.kept(found("stamper-delta"))
    assert several == f"The links near-bar, rod-left, rod-right and far-bar stay rigid: their {why}"
    assert several in section.beginning(found("stamper-delta"))
    assert section.kept(found("five-bar")) == ""


STIFFNESS = [
    ("five-bar", "raises the largest stiffness from 7.849 kN/m with rigid links to 7.857 kN/m, 0.09535 % more."),
    ("planar arm", "raises the largest stiffness from 3.022 kN/m with rigid links to 3.224 kN/m, 6.673 % more."),
    ("paddle", "lowers the largest stiffness from 5.218 kN/m with rigid links to 5.163 kN/m, 1.056 % less."),
    ("spatial arm", "lowers the largest stiffness from 6.498 kN/m with rigid links to 2.382 kN/m, 63.33 % less."),
]


@pytest.mark.parametrize(("name", "text"), STIFFNESS)
def test_which_way_the_largest_stiffness_moves(name, text):
    assert typed(section.stiffness(found(name))) == f"Bending {text}"


def test_a_stiffness_that_hardly_moves():
    assert typed(section.stiffness(found("thick beam"))).startswith(
        "Bending hardly changes the largest stiffness, "
    )


def test_a_stiffness_that_does_not_exist():
    """With rigid links alone of a late undamped device: its tubes are damped; and the other cases."""
    late = zwidth.load("five-bar", {"loop.delay_samples": 1.0, "mechanism.damping.mode_ratio": 0.0}).bending()
    none = "there is no largest stiffness: no wall with K > 0 and B >= 0 is stable"
    text = typed(section.stiffness(late))
    assert text.startswith("With bending links it renders walls of up to 0.177")
    assert text.endswith(f"; with rigid ones {none}.")
    other = replace(late, bent=late.rigid, rigid=found("five-bar").rigid)
    assert typed(section.stiffness(other)) == f"With bending links {none}; with rigid ones it is 7.849 kN/m."
    both = replace(late, bent=late.rigid)
    assert typed(section.stiffness(both)) == f"With bending links and with rigid ones {none}."
    unlike = replace(late, bent=replace(late.rigid, chart=None, reason="too slow"))
    assert section.stiffness(unlike) == (
        "With bending links there is no largest stiffness: too slow; nor with rigid ones: "
        "no wall with K > 0 and B >= 0 is stable."
    )


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("five-bar", "11.65 kN/m, 1.246 % less than the 11.79 kN/m with rigid links."),
        ("planar arm", "2.500 kN/m, 15.53 % less than the 2.960 kN/m with rigid links."),
        ("light five-bar", "11.70 kN/m; with rigid links nothing would give."),
    ],
)
def test_what_is_felt_at_most(name, text):
    assert typed(section.felt(found(name))) == f"At rest no wall is felt stiffer than {text}"


def test_what_is_felt_at_most_otherwise():
    same = section.felt(found("thick beam"))
    assert typed(same).startswith("At rest no wall is felt stiffer than ")
    assert same.endswith("; with rigid links that is hardly any different.")
    stiffer = changed("five-bar", bent={"static_stiffness": 2.0 * found("five-bar").rigid.static_stiffness})
    assert "100.0 % more than the 11.79 kN/m" in typed(section.felt(stiffer))
    rigid = changed("five-bar", {"static_stiffness": inf}, {"static_stiffness": inf})
    assert section.felt(rigid) == "At rest nothing between wall and handle gives, whether the links bend or not."
    assert section.felt(changed("five-bar", bent={"static_stiffness": nan})) == ""


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("five-bar", "falls from 101.3 Hz with rigid links to 101.2 Hz, 0.1241 % lower."),
        ("planar arm", "falls from 114.9 Hz with rigid links to 104.4 Hz, 9.121 % lower."),
        ("light five-bar", "is at 161.9 Hz; with rigid links there is none."),
    ],
)
def test_where_the_first_mode_goes(name, text):
    assert typed(section.first_mode(found(name))) == f"The first mode that a wall moves {text}"


def test_where_the_first_mode_goes_otherwise():
    first = found("five-bar").rigid.first_mode
    assert "rises from 101.3 Hz with rigid links to 202.6 Hz, 100.0 % higher" in typed(
        section.first_mode(changed("five-bar", bent={"first_mode": 2.0 * first}))
    )
    stays = section.first_mode(changed("five-bar", bent={"first_mode": 1.0001 * first}))
    assert typed(stays) == "The first mode that a wall moves stays at 101.3 Hz."
    gone = section.first_mode(changed("five-bar", bent={"first_mode": nan}))
    assert typed(gone) == "With bending links a wall moves no mode; with rigid ones the first is at 101.3 Hz."
    none = changed("five-bar", {"first_mode": nan}, {"first_mode": nan})
    assert section.first_mode(none) == "A wall moves no mode in which anything gives."
    buckled = changed("five-bar", {"first_mode": nan, "chart": None}, {"first_mode": nan})
    assert section.first_mode(buckled) == ""


def test_hand_and_load_are_said_to_be_left_out():
    plain, held, pushed = (
        typed(" ".join(section.sentences(facts("serial-2r", **question))))
        for question in ({}, {"operator": "thesis-arm"}, {"load": (0.0, -3.0)})
    )
    assert "The first mode that a wall moves falls" in plain
    assert "The first mode of the ungripped device that a wall moves falls" in held
    assert "At rest no wall is felt" in held
    assert "At rest, the load left out, no wall is felt" in pushed


def test_a_device_whose_links_cannot_bend_has_nothing_to_say():
    for of in (facts("published-two-mass"), facts("serial-2r", model="rigid")):
        assert of.bending is None
        assert section.sentences(of) == section.numbers(of) == section.tubes(of) == []


def test_the_tables_have_the_same_numbers():
    assert [tuple(map(typed, row)) for row in section.numbers(facts("serial-2r"))] == [
        ("rigid links", "2.176 kN/m", "3.986 kN/m", "79.43 Hz"),
        ("bending links", "2.191 kN/m", "3.925 kN/m", "78.86 Hz"),
    ]
    assert typed(section.tubes(facts("serial-2r"))[0][1]) == "200.0 mm"
    stiff = section.numbers(facts("light five-bar"))[0]
    assert (typed(stiff[2]), stiff[3]) == ("no limit", "none")
    assert section.tubes(facts("light five-bar")) == []


def test_a_wall_of_moments_has_its_units_and_tubes_keep_theirs():
    of = facts("paddle", axis=(0.0, 0.0, 1.0))
    with speaking_of_moments(True):
        said = typed(" ".join(section.sentences(of)))
        (row,) = section.tubes(of)
    assert "from 29.35 N m/rad with rigid links to 29.04 N m/rad" in said
    assert "felt stiffer than 117.2 N m/rad" in said
    assert typed(row[1]) == "75.00 mm"
    document = keys_of_moments({"bending": json_value(of.bending.document())})["bending"]
    assert document["bent"]["stiffness_max_Nm_per_rad"] == of.bending.bent.stiffness_max
    assert document["tubes"][0].keys() >= {"length_m", "outer_diameter_m", "wall_m"}


def test_the_comparison_is_a_step_of_its_own(tmp_path, monkeypatch):
    steps = []
    monkeypatch.setattr(report, "page", lambda facts: f"{steps[-1]} {'bending' in vars(facts)}")
    report.write_report(
        device_of("published-two-mass"),
        tmp_path / "plain.html",
        progress=lambda stage, done, of: steps.append(f"{done} of {of}"),
    )
    assert steps == ["1 of 5", "2 of 5", "3 of 5", "4 of 5"]
    assert (tmp_path / "plain.html").read_text() == "4 of 5 True"
