"""What is said of loads: those that cannot be meant or borne, and what they change."""

from __future__ import annotations

import copy
import re
from dataclasses import replace

import numpy as np
import pytest

import zwidth
import zwidth as package
from tests.cli.command_runner import MECHANISM, TWO_MASS, document_of, refusal_lines, run_command
from tests.cli.test_cli_load import FEW
from tests.show import test_show_load
from tests.show.test_show_load import BENT, WEAK, template
from zwidth.device import from_document
from zwidth.device.load import load as load_device
from zwidth.errors import (
    DeviceError,
    EquilibriumError,
    LoadError,
    ModelError,
    OperatingPointError,
    SeveralDirectionsError,
)
from zwidth.loop import OperatingPoint
from zwidth.model import Load
from zwidth.show import gather, load_text, typed
from zwidth.show.load_text import balance_text, pushes_text
from zwidth.show.report import load as section
from zwidth.study import LoadPath
from zwidth.study.loaded_charts import PushedChart

# --- loads that cannot be meant, or that a device cannot bear; and those of files beside those -------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"force": [0.0, 0.0]}, "a load of 0 N leaves a one-sided wall at the edge of contact"),
        ({"moment": [0.0, 0.0, 0.0]}, "a load of 0 N"),
        ({"push": 0.0}, "a load of 0 N"),
        ({"force": [1.0]}, r"force must be two or three finite numbers \[N\], got \[1.0\]"),
        ({"force": [1.0, 2.0, 3.0, 4.0]}, "force must be two or three finite numbers"),
        ({"force": 5.0}, r"force must be two or three finite numbers \[N\], got 5.0"),
        ({"force": "down"}, "force must be two or three finite numbers"),
        ({"force": [0.0, np.nan]}, "force must be two or three finite numbers"),
        ({"moment": [0.0, np.inf]}, r"moment must be two or three finite numbers \[N m\]"),
        ({"gravity": 9.81}, r"gravity must be two or three finite numbers \[m/s²\], got 9.81"),
        ({"push": np.inf}, r"push must be a finite number \[N\], got inf"),
        ({"push": True}, r"push must be a finite number \[N\], got True"),
        ({"surface_radius": True}, "surface_radius must be a number but 0.*got True"),
        ({"push": "5"}, r"push must be a finite number \[N\], got '5'"),
        ({"force": [1.0, 0.0], "push": 1.0}, "push is given beside force; give one of them"),
        ({"force": [1.0, 0.0], "moment": [0.0, 1.0]}, "moment is given beside force"),
        ({"surface_radius": 0.0}, "surface_radius must be a number but 0, or inf"),
        ({"surface_radius": np.nan}, "surface_radius must be a number but 0"),
        ({"surface_radius": "flat"}, "surface_radius must be a number but 0.*got 'flat'"),
        ({"settle": True}, "settle needs a force"),
        ({"settle": True, "push": 1.0}, "settle needs a force"),
        (
            {"force": [0.0, -5.0], "settle": True, "surface_radius": 0.05},
            "surface_radius of 0.05 m is given beside settle, which slides the handle along a plane; leave one",
        ),
        ({"hand": "soft"}, "hand must be 'dead' or 'follower' or 'neglected', got the text 'soft'"),
        ({"posture_of": "links"}, "posture_of must be 'handle' or 'motors'"),
        ({"branch": "up"}, "branch must be 'forward' or 'backward'"),
    ],
)
def test_a_load_that_cannot_be_meant_is_one_clear_error(arguments, words):
    with pytest.raises(ValueError, match=words):
        Load(**arguments)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"load": (0.0, 0.0)}, DeviceError, "five-bar: load: a load of 0 N"),
        ({"load": "down"}, DeviceError, "five-bar: load: force must be two or three finite numbers"),
        ({"gravity": (0.0, np.nan)}, DeviceError, "five-bar: load: gravity must be two or three finite numbers"),
        (
            {"load": Load(push=1.0), "gravity": "down"},
            DeviceError,
            "five-bar: load: gravity must be two or three finite numbers .* got 'down'",
        ),
        ({"load": (5.0, 0.0)}, LoadError, r"the load \(5, 0, 0\) N does not push along the rendered direction"),
        ({"load": (1.0, -5.0)}, LoadError, r"part \(1, 0, 0\) N across .* needs \(-0.00291587, 0, 0\) N; give"),
        (
            {"load": Load(moment=[0.0, 0.0, 1.0])},
            LoadError,
            "rendered along a direction; give the load as a force",
        ),
        ({"load": (0.0, 0.0, 1.0), "axis": (0.0, 0.0, 1.0)}, LoadError, "cannot push about an axis"),
        (
            {"load": Load(force=[0.0, -5.0], settle=True), "axis": (0.0, 0.0, 1.0)},
            LoadError,
            "settle is for loads on a handle whose position the drives control; leave it out",
        ),
        ({"load": Load(push=5e9)}, EquilibriumError, r"no equilibrium was found under a push of 5e\+09 N"),
        (
            {"load": (0.0, -5.0), "directions": [(1.0, 0.0), (0.0, 1.0)]},
            SeveralDirectionsError,
            "over several directions: a load",
        ),
        ({"load": (0.0, -5.0), "model": "two-mass"}, ModelError, "'two-mass' has no form under load"),
        ({"load": (0.0, -5.0), "model": "motor-mass"}, ModelError, "use 'full' or 'rigid'"),
    ],
)
def test_a_load_that_a_device_cannot_bear_is_one_clear_error(arguments, error, words):
    with pytest.raises(error, match=words):
        ask_all(load_device("five-bar").at(**arguments))


def ask_all(point):
    """What a load has to be in balance for."""
    return point.plant_of_directions if point.direction_count > 1 else point.plant


def test_limits_of_motors_and_computer_bound_the_load():
    device = load_device("five-bar")
    weak = device.with_({"drives.motor-right.torque_limit_Nm": 0.034})
    assert weak.at(load=(0.0, -6.0)).plant.size == 3
    with pytest.raises(
        EquilibriumError, match=r"drive 'motor-right' needs 0\.03415 N m at its motor, more than its"
    ):
        weak.at(load=(0.0, -7.0))
    limited = device.with_({"loop.saturation.force_N": 4.0})
    assert limited.at(load=(0.0, -3.9)).plant.size == 3
    with pytest.raises(EquilibriumError, match=r"takes 5\.00512 N of the wall, more than the force limit of 4 N"):
        limited.at(load=(0.0, -5.0)).plant  # noqa: B018


def test_about_an_axis_a_push_is_a_moment():
    wrist = load_device("openwrist").with_({"loop.saturation.force_N": 0.01})
    with pytest.raises(
        EquilibriumError, match=r"takes 0\.05 N m of the wall, more than the force limit of 0\.01 N m"
    ):
        wrist.at(axis=(0.0, 0.0, 1.0), load=Load(push=0.05)).plant  # noqa: B018


def test_a_moment_that_is_none_is_named_as_one():
    with pytest.raises(DeviceError, match=r"five-bar: load: moment must be two or three finite numbers \[N m\]"):
        load_device("five-bar").under((1.0, 2.0, 3.0, 4.0), moment=True)


@pytest.mark.parametrize("name", ["published-two-mass", "hapkit-course"])
@pytest.mark.parametrize("arguments", [{"load": (0.0, -5.0)}, {"gravity": (0.0, -9.81)}, {"load": Load(push=1.0)}])
def test_a_device_without_a_mechanism_bears_no_load(name, arguments):
    with pytest.raises(DeviceError, match=r"load: needs a \[mechanism\], whose forces turn as it moves"):
        load_device(name).at(**arguments)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"force_N": [0.0, 0.0]}, "load.force_N: is 0, which leaves a one-sided wall at the edge of contact"),
        ({"moment_Nm": [0.0, 0.0, 0.0]}, "load.moment_Nm: is 0, which leaves"),
        ({"force_N": [1.0]}, "load.force_N: must have at least 2 elements"),
        ({"force_N": [0.0, float("nan")]}, r"load.force_N.1: must be finite"),
        (
            {"force_N": [0.0, -5.0], "push_N": 1.0},
            "load.push_N: stands beside force_N; only one of them is allowed",
        ),
        ({"push_N": 0.0}, "load.push_N: is 0, which leaves a one-sided wall at the edge of contact"),
        ({"push_N": "5"}, "load.push_N: must be a number"),
        ({"settle": True}, "load.settle: needs force_N"),
        ({"settle": True, "push_N": 1.0}, "load.settle: needs force_N"),
        ({"surface_radius_m": 0.0}, "load.surface_radius_m: must not be 0; remove it for a plane"),
        ({"surface_radius_m": -float("inf")}, "load.surface_radius_m: must not be -inf; remove it for a plane"),
        (
            {"force_N": [0.0, -5.0], "settle": True, "surface_radius_m": 0.05},
            "load.surface_radius_m: stands beside settle, which slides the handle along a plane; remove one",
        ),
        ({"hand": "soft"}, "load.hand: must be 'dead', 'follower' or 'neglected'"),
        ({"force": [0.0, 5.0]}, "load.force: is not a key of a device file; did you mean 'force_N'"),
        ({"gravity_m_per_s2": -9.81}, "load.gravity_m_per_s2: must be a list"),
        ({"spring_branch": "back"}, "did you mean 'backward'"),
    ],
)
def test_a_file_s_load_that_cannot_be_meant_is_one_fault(table, words):
    document = copy.deepcopy(load_device("five-bar").document) | {"load": table}
    with pytest.raises(DeviceError, match=words) as caught:
        from_document(document)
    assert len(caught.value.faults) == 1


def test_a_point_without_a_load_has_no_equilibrium_and_no_device_file_needs_one():
    with pytest.raises(OperatingPointError, match="no load is given, about which there would be an equilibrium"):
        load_device("five-bar").at().equilibrium  # noqa: B018
    point = load_device("five-bar").at([(0.0, 0.25), (0.6, 0.6)], load=(0.0, -5.0))
    with pytest.raises(OperatingPointError, match="out of reach, singular or without equilibrium"):
        point[1].equilibrium  # noqa: B018
    with pytest.raises(ValueError, match="a load needs a mechanism"):
        OperatingPoint(point.controller, given_plant=point[0].plant, load=Load(push=1.0))


# --- `zwidth load`: charts under pushes of the hand; and what `zwidth show` and maps say of a --------


def test_an_arm_that_does_not_reach_is_refused(tmp_path):
    own = tmp_path / "arm.toml"
    own.write_text(
        '[arm]\ngrasp = "rigid"\nshoulder_m = [2.0, 0.0, 0.0]\nhand.link = "arm"\n'
        "posture.joints_rad = { arm = 0.3 }\n"
        '[[arm.links]]\nname = "arm"\njoint = "revolute"\nlength_m = 0.1\nmass_kg = 1.0\ninertia_kg_m2 = 1e-3\n'
    )
    (line,) = refusal_lines("chart", MECHANISM, "--operator", str(own))
    assert line.startswith(f"{MECHANISM}: the arm does not reach the handle from its shoulder")


def test_people_read_the_changes_and_the_sentences():
    told = run_command("load", MECHANISM, *FEW)
    assert (told.code, told.err) == (0, "")
    rows = re.findall(r"^ (-?\d) N +(\S+ kN/m)", told.out, re.MULTILINE)
    assert [push for push, _ in rows] == ["-4", "0", "4"]
    assert rows[1][1] == "7.849 kN/m"
    assert "The largest stiffness goes from" in told.out
    assert "of the 7.849 kN/m without a push" in told.out
    assert "under -4 N and 4 N" in told.out


def test_a_map_s_load_is_judged_by_the_map_s_direction():
    mapped = ("map", MECHANISM, "--measure", "rigid_mass", "--cells", "3,3", "--load", "3,0")
    status = document_of(*mapped, "--direction", "1,0")["status"]
    assert "ok" in [word for row in status for word in row]
    (line,) = refusal_lines(*mapped)
    assert "the load (3, 0, 0) N does not push along the rendered direction (0, 1, 0)" in line
    (line,) = refusal_lines("map", MECHANISM, "--measure", "rigid_mass", "--cells", "3,3", "--load", "3,-4")
    assert "has a part (3, 0, 0) N across the rendered direction" in line


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((TWO_MASS,), "has no [mechanism]"),
        ((MECHANISM, "--load", "0,-5"), "--load: does not apply"),
        ((MECHANISM, "--push", "0"), "above 0"),
        ((MECHANISM, "--push", "five"), "--push"),
        ((MECHANISM, "--count", "4"), "must be odd"),
        ((MECHANISM, "--count", "1"), "--count"),
        ((MECHANISM, "--model", "two-mass"), "has no form under load"),
        ((MECHANISM, "--output", "load.nc"), "load.nc"),
    ],
)
def test_bad_input_is_one_line_and_nothing_on_standard_output(words, said):
    (line,) = refusal_lines("load", *words)
    assert said in line


def test_show_says_who_carries_what():
    words = ("show", MECHANISM, "--load", "0,-5")
    found = package.load(MECHANISM).at(load=(0.0, -5.0))
    told = run_command(*words).out
    assert re.search(r"balance +wall 5.005 N, hand \(-0.002916, -5\) N, of which \(-0.002916, 0\) N across", told)
    torque = found.equilibrium.torques[0] / found.equilibrium.ratio[0]
    assert re.search(rf"motor motor-right +{torque:.4g}\d* N m, its drive bent by", told)
    document = document_of(*words)
    assert document["equilibrium"]["hand_force_N"] == found.equilibrium.hand_force.tolist()
    assert "equilibrium" not in document_of("show", MECHANISM)


def test_a_measure_of_a_load_needs_one():
    (line,) = refusal_lines("map", MECHANISM, "--measure", "load_change", "--cells", "4,3")
    assert line.endswith("load_change needs a load, about which the device is linearised; give --load")


# --- what is said and drawn of a load: each sentence follows from the numbers, and figures -----------


device = test_show_load.device
path = test_show_load.path


def changed(path, **columns):
    """The path with other numbers of some steps: name=[...], None to keep one."""
    steps = list(path.steps)
    for name, values in columns.items():
        for k, value in enumerate(values):
            if value is not None:
                steps[k] = replace(steps[k], **{name: value})
    return replace(path, steps=tuple(steps))


def path_sentences(path):
    """The sentences, with blanks and signs that can be typed."""
    return [typed(sentence) for sentence in load_text.path_sentences(path)]


def said(path, begin):
    (sentence,) = [sentence for sentence in path_sentences(path) if sentence.startswith(begin)]
    return sentence


def test_the_stiffness_is_told_with_both_ends(path):
    low, high = path.stiffness_max.min(), path.stiffness_max.max()
    free = path.unpushed.stiffness_max
    expected = f"{low / 1e3:.3f} kN/m under 4 N to {high / 1e3:.3f} kN/m under -4 N"
    assert expected in said(path, "The largest stiffness")
    assert f"{100 * (low - free) / free:.3g}"[:5] in said(path, "The largest stiffness")


def test_a_stiffness_that_does_not_change_is_told_once():
    flat = zwidth.load("phantom-premium-1.5").load_path(2.0, 3)
    assert said(flat, "The largest stiffness") == "The largest stiffness is 25.20 kN/m under every push."


def test_a_chart_without_a_push_may_be_missing(path):
    none = PushedChart(0.0, "no wall with K > 0 and B >= 0 is stable")
    steps = (*path.steps[:2], none, *path.steps[3:])
    assert said(LoadPath(steps), "The largest").endswith("; without a push no wall is stable.")
    alone = LoadPath((none, path.steps[1], none))
    assert "A wall is stable under -2 N alone, up to 7.850 kN/m." in path_sentences(alone)


def test_what_is_neglected_is_told_with_where_it_is_worth_most(path):
    share = np.abs(path.hand_neglected / path.stiffness_max - 1.0)
    worst = path.pushes[share.argmax()]
    assert said(path, "Neglecting").endswith(f"% at most, under {worst:g} N.")
    same = changed(path, hand_neglected=path.stiffness_max.tolist())
    assert "makes no difference" in said(same, "Whether the change of the hand's force is neglected")
    own = replace(path, hand="neglected")
    assert not [one for one in path_sentences(own) if "eglect" in one]


def test_a_fixed_surface_is_told_with_its_largest_difference_or_why_there_is_none(path):
    doubled = changed(path, fixed_surface=[2.0 * path.steps[0].stiffness_max])
    assert "by 100.0 % at most, under -4 N" in said(doubled, "On a fixed surface")
    same = changed(path, fixed_surface=path.stiffness_max.tolist())
    assert said(same, "On a fixed surface").endswith("the largest stiffness is the same.")
    none = changed(path, fixed_surface=[np.nan] * 5, fixed_surface_status=["none: too far"] * 5)
    assert said(none, "On a fixed surface").endswith("there is no answer: none: too far.")


def test_growth_is_told_of_the_pushes_under_which_there_is_any(device, path):
    fastest = path.steps[0].sideways
    doubles = f"fastest under -4 N, where it doubles in {fastest.time_to_double:.3f} s."
    assert said(path, "Along the surface").endswith(f"under -4 N to -2 N and 2 N to 4 N: {doubles}")
    rigid = device.load_path(4.0, 5, point=device.at(model="rigid"))
    assert "a motion grows under -4 N to -2 N: fastest" in said(rigid, "Along the surface")
    quiet = zwidth.load("stamper-delta").load_path(2.0, 3)
    assert "No motion along the surface grows." in path_sentences(quiet)
    paddle = template("paddle").load_path(1.0, 3)
    assert "No free motion stands apart from the walls: the charts count every one." in path_sentences(paddle)


def test_a_growing_vibration_has_its_frequency():
    swings = template("five-bar").load_path(2.0, 3)
    frequency = swings.steps[0].sideways.frequency
    assert frequency > 0.0
    assert said(swings, "Along the surface").endswith(f"as a vibration of {1e3 * frequency:.2f} mHz.")


def test_pushes_without_an_answer_are_told_with_the_reason_of_the_weakest(device):
    weak = device.with_(WEAK).load_path(24.0, 7)
    told = said(weak, "Without an answer")
    assert told.startswith("Without an answer, -24 N to -16 N and 16 N to 24 N: no equilibrium: under this load")
    needed = weak.steps[1].status.split(" needs ")[1].split()[0]
    assert f"needs {needed} N m" in told


def test_neighbouring_pushes_are_named_together():
    pushes = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    named = typed(pushes_text(pushes, np.array([True, True, False, True, False])))
    assert named == "-2 N to -1 N and 1 N"


def test_the_balance_names_a_force_across_only_where_there_is_one(device):
    assert "across the direction" in balance_text(device.at(load=(0.0, -5.0)).equilibrium)
    straight = balance_text(zwidth.load("stamper-delta").at(load=Load(push=-5.0)).equilibrium)
    assert straight == "wall 5.000 N, hand (0, 0, -5) N"


GRAVITY = {"load.gravity_m_per_s2": [0.0, -9.81]}


def facts(name, settings):
    return gather(zwidth.load(name, settings))


def told(of):
    return typed(" ".join(section.sentences(of)))


def test_the_section_says_who_carries_what_and_what_it_changes():
    text = told(facts("five-bar", {"load.push_N": -5.0}))
    assert "in balance under a push of -5 N along the direction: the hand gives (-0.002916, -5) N" in text
    assert (
        "the wall 5.005 N along the direction, and the motors motor-right 0.02440 N m, motor-left -0.02444 N m"
        in text
    )
    assert "Of the hand's force (-0.002916, 0) N is across the direction" in text
    assert "changes the largest stiffness by +0.02079 %, from 7.849 kN/m without it" in text
    assert "below F/K, which at the largest stiffness is 637.5 µm" in text
    assert "a motion stands apart from the chart: it grows by 0.2759 1/s and doubles in 2.512 s" in text


def test_gravity_alone_has_no_one_sided_wall():
    text = told(facts("five-bar", GRAVITY))
    assert "under gravity (0, -9.81, 0) m/s²: the hand gives" in text
    assert "the wall 0 N" in text
    assert "F/K" not in text


def test_several_motions_are_told_each():
    text = told(facts("stamper-delta", {"load.push_N": -5.0, "load.gravity_m_per_s2": [0.0, 0.0, -9.81]}))
    assert "2 motions stand apart from the chart: one vibrates at 611.1 mHz, decays by" in text
    assert "across the direction" not in text


def test_springs_with_two_stiffnesses_have_both():
    text = told(facts("five-bar", {**BENT, **GRAVITY}))
    assert ("The stiffness of motor-" in text) == bool(
        zwidth.load("five-bar", {**BENT, **GRAVITY}).at().other_branch
    )


def test_a_load_that_leaves_no_wall_has_no_number():
    of = facts("five-bar", {"load.push_N": -5.0, "loop.delay_samples": 3.0, "mechanism.damping.mode_ratio": 0.0})
    assert "has no number: no wall with K > 0 and B >= 0 is stable without load." in told(of)


def test_nothing_is_said_without_a_load():
    of = facts("five-bar", {})
    assert section.sentences(of) == section.path(of) == []
    assert of.load_path is None
