"""Every way a device file's [mechanism] can be wrong."""

from __future__ import annotations

import copy
import re

import pytest

from tests.device.device_cases import ARM_FILE, REMOVED, faults, with_changes
from zwidth.device import Device, from_document
from zwidth.device.load import load
from zwidth.errors import DeviceError

NAN = float("nan")

CASES = [
    # the file, what is changed in it, the key found at fault, words of the message
    (ARM_FILE, {"plant": {"mass_kg": 1.0}}, "", "has [mechanism] and [plant]; only one"),
    (ARM_FILE, {"mechanism__links": []}, "mechanism.links", "must have at least 1 element"),
    (
        ARM_FILE,
        {"mechanism__links__0__mass_kg": -0.1},
        "mechanism.links.upper.mass_kg",
        "must be at least 0, got -0.1",
    ),
    (ARM_FILE, {"mechanism__links__0__mass": 0.1}, "mechanism.links.upper.mass", "did you mean 'mass_kg'?"),
    (ARM_FILE, {"mechanism__links__0__mass_kg": REMOVED}, "mechanism.links.upper.mass_kg", "is missing"),
    (ARM_FILE, {"mechanism__links__0__length_m": -0.1}, "mechanism.links.upper.length_m", "must be at least 0"),
    (ARM_FILE, {"mechanism__links__0__axis": [0, 0, 0]}, "mechanism.links.upper.axis", "has zero length"),
    (
        ARM_FILE,
        {"mechanism__links__0__axis": [0, 1]},
        "mechanism.links.upper.axis",
        "must have at least 3 elements, got 2",
    ),
    (ARM_FILE, {"mechanism__links__0__inertia_kg_m2": -1e-4}, "mechanism.links.upper.inertia_kg_m2", "at least 0"),
    (
        ARM_FILE,
        {"mechanism__links__0__inertia_kg_m2": [1.0, 1.0, 3.0]},
        "mechanism.links.upper.inertia_kg_m2",
        "above the sum of the other two, got 1, 1, 3",
    ),
    (
        ARM_FILE,
        {"mechanism__links__0__inertia_kg_m2": [[1.0, 0.1, 0], [0, 1.0, 0], [0, 0, 1.0]]},
        "mechanism.links.upper.inertia_kg_m2",
        "must be symmetric",
    ),
    (
        ARM_FILE,
        {"mechanism__links__0__inertia_kg_m2": [1.0, 1.0, "x"]},
        "mechanism.links.upper.inertia_kg_m2.2",
        "must be a number, got the text 'x'",
    ),
    (
        ARM_FILE,
        {"mechanism__links__0__inertia_kg_m2": [1.0, 2.0]},
        "mechanism.links.upper.inertia_kg_m2",
        "three moments",
    ),
    (ARM_FILE, {"mechanism__links__1__parent": "uper"}, "mechanism.links.lower.parent", "did you mean 'upper'?"),
    (ARM_FILE, {"mechanism__links__0__parent": "lower"}, "mechanism.links.upper.parent", "goes round in a circle"),
    (ARM_FILE, {"mechanism__links__0__parent": "upper"}, "mechanism.links.upper.parent", "goes round in a circle"),
    (ARM_FILE, {"mechanism__handle__link": "lowr"}, "mechanism.handle.link", "did you mean 'lower'?"),
    (ARM_FILE, {"mechanism__drives__1__name": "shoulder"}, "mechanism.drives.shoulder.name", "is given twice"),
    (ARM_FILE, {"mechanism__drives__1__joint": "upper"}, "mechanism.drives.elbow.joint", "has a drive already"),
    (ARM_FILE, {"mechanism__drives__1__joint": "elbow"}, "mechanism.drives.elbow.joint", "'elbow' is not a link"),
    (
        ARM_FILE,
        {"mechanism__drives__1": REMOVED},
        "mechanism.drives",
        "are 1, but the mechanism has 2 degrees of freedom",
    ),
    (
        ARM_FILE,
        {"mechanism__drives__0__transmission_ratio": 0},
        "mechanism.drives.shoulder.transmission_ratio",
        "than 0",
    ),
    (
        ARM_FILE,
        {"mechanism__drives__0__stiffness_Nm_per_rad": NAN},
        "mechanism.drives.shoulder.stiffness_Nm_per_rad",
        "nan",
    ),
    (
        ARM_FILE,
        {"mechanism__drives__0__motor_inertia_kg_m2": 0},
        "mechanism.drives.shoulder.motor_inertia_kg_m2",
        "behind",
    ),
    (
        ARM_FILE,
        {"mechanism__drives__0__damping_Nms_per_rad": 1.0},
        "mechanism.drives.shoulder.damping_Nms_per_rad",
        "given",
    ),
    (ARM_FILE, {"mechanism__reference__direction": [0, 0]}, "mechanism.reference.direction", "has zero length"),
    (ARM_FILE, {"mechanism__reference__direction": [NAN, 0]}, "mechanism.reference.direction.0", "must be finite"),
    (
        ARM_FILE,
        {"mechanism__reference__position_m": [0.2]},
        "mechanism.reference.position_m",
        "at least 2 elements",
    ),
    (ARM_FILE, {"mechanism__reference__assembly": "elbow-don"}, "mechanism.reference.assembly", "'elbow-down'?"),
    (ARM_FILE, {"mechanism__assemblies": {}}, "mechanism.assemblies", "at least 1 element"),
    (
        ARM_FILE,
        {"mechanism__assemblies__elbow-down__joints_rad": {"upper": 0.5}},
        "mechanism.assemblies.elbow-down.joints_rad.lower",
        "is missing",
    ),
    (
        ARM_FILE,
        {"mechanism__assemblies__elbow-up": {"joints_rad": {"upper": 0.5, "lower": -1.0}}},
        "mechanism.reference.assembly",
        "is missing; choose one of elbow-down, elbow-up",
    ),
    (ARM_FILE, {"mechanism__workspace": {"x_m": [0.3, 0.1]}}, "mechanism.workspace.x_m", "lower < upper"),
    (
        ARM_FILE,
        {"mechanism__workspace": {"x_m": [0.3, 0.4]}},
        "mechanism.workspace.x_m",
        "leaves out the reference",
    ),
    (ARM_FILE, {"mechanism__damping": {}}, "mechanism.damping", "is empty"),
    (ARM_FILE, {"mechanism__damping__given": True}, "mechanism.damping", "exactly one way"),
    (ARM_FILE, {"mechanism__damping": {"given": False}}, "mechanism.damping.given", "must be true, got false"),
    (ARM_FILE, {"mechanism__damping": {"mode_ratio": 5}}, "mechanism.damping.mode_ratio", "at most 2, got 5"),
    (ARM_FILE, {"sources": {"mechanism.linkz": "a book"}}, "sources.mechanism.linkz", "names no key of this file"),
    (ARM_FILE, {"sources": {"loop": 3}}, "sources.loop", "must be text, got 3"),
]


@pytest.mark.parametrize(
    ("text", "changes", "key", "words"), CASES, ids=[f"{i}-{case[2]}" for i, case in enumerate(CASES)]
)
def test_a_fault_of_a_mechanism_names_its_key(text, changes, key, words):
    (fault,) = faults(with_changes(text, **changes))
    assert fault.file == "my.toml"
    assert fault.key == key
    assert words in fault.message
    assert "\n" not in str(fault)


def test_faults_of_a_mechanism_do_not_hide_each_other():
    document = with_changes(
        ARM_FILE,
        mechanism__links__0__mass_kg=-1,
        mechanism__links__1__parent="uppr",
        mechanism__handle__link="hand",
        mechanism__drives__0__joint="uppr",
        mechanism__damping={},
        loop__sampling_period_s=0,
    )
    assert [fault.key for fault in faults(document)] == [
        "mechanism.links.upper.mass_kg",
        "mechanism.links.lower.parent",
        "mechanism.handle.link",
        "mechanism.drives.shoulder.joint",
        "mechanism.damping",
        "loop.sampling_period_s",
    ]


def test_a_fixed_joint_takes_no_drive():
    document = with_changes(ARM_FILE, mechanism__links__1__joint="fixed")
    document["mechanism"]["assemblies"]["elbow-down"]["joints_rad"] = {"upper": 0.5}
    (fault,) = faults(document)
    assert fault.key == "mechanism.drives.elbow.joint"
    assert "is fixed to its parent" in fault.message


def test_a_link_that_moves_no_mass_is_refused():
    weightless = {"mass_kg": 0.0, "inertia_kg_m2": 0.0}
    document = with_changes(
        ARM_FILE, **{f"mechanism__links__1__{key}": value for key, value in weightless.items()}
    )
    assert isinstance(from_document(document), Device)  # behind a rigid drive the rotor is enough
    document["mechanism"]["drives"][1]["stiffness_Nm_per_rad"] = 1.0
    (fault,) = faults(document)
    assert "not positive definite" in fault.message


def test_one_moment_of_inertia_is_not_enough_out_of_the_plane():
    document = with_changes(ARM_FILE, mechanism__links__1__orientation_rad=[1.0, 0.0, 0.0])
    (fault,) = faults(document)
    assert fault.key == "mechanism.links.lower.inertia_kg_m2"
    assert "'upper' turns the link about another" in fault.message
    document["mechanism"]["links"][1]["inertia_kg_m2"] = [1e-5, 4e-4, 4e-4]
    assert isinstance(from_document(document), Device)


def test_no_link_may_be_called_base():
    document = with_changes(ARM_FILE)
    document["mechanism"]["links"].append({"name": "base", "joint": "fixed", "mass_kg": 0.1, "inertia_kg_m2": 0.0})
    (fault,) = faults(document)
    assert fault.key == "mechanism.links.base.name"
    assert "stands for the ground" in fault.message


@pytest.mark.parametrize("length", [0.6, 5.0])
def test_a_loop_that_cannot_close_says_by_how_much(length):
    """One side longer than the other three together: the gap is the difference."""
    with pytest.raises(DeviceError) as caught:
        load("five-bar", [("links.upper-left.length_m", length)])
    (fault,) = caught.value.faults
    assert fault.key == "mechanism.loops.end-point"
    said = re.search(r"at least (\S+) m apart", fault.message)
    assert said
    assert float(said[1]) == pytest.approx(length - 0.147 - 0.199 - 0.199, rel=5e-3)


@pytest.mark.parametrize("place", [0, 2])
def test_a_drive_beyond_the_freedom_that_loops_leave_is_a_surplus_one(place):
    """Of three drives of a five-bar the third; of its own two none."""
    device = load("five-bar")
    document = copy.deepcopy(device.document)
    more = {"name": "more", "joint": "distal-right", "motor_inertia_kg_m2": 1e-6, "transmission_ratio": 4.0}
    document["mechanism"]["drives"].insert(place, more | {"stiffness_Nm_per_rad": 0.5})
    assert from_document(document, "three drives").mechanism.drives.surplus == (2,)
    assert device.mechanism.drives.surplus == ()
