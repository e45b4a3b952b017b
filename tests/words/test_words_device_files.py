"""Every way a device file can be wrong: the right key, the value, what is allowed."""

from __future__ import annotations

import copy
import re
import tomllib
from datetime import date

import pytest

from tests.device.device_cases import ARM_FILE, PLANT_FILE, REMOVED, faults, with_changes
from zwidth.chart import largest_stiffness
from zwidth.device import Device, from_document
from zwidth.device.load import load
from zwidth.device.schema.value_types import HEAVIEST, LIGHTEST
from zwidth.errors import DeviceError

# --- every way a device file's [plant] and [loop] can be wrong: the right key, the value, what -------


NAN, INF = float("nan"), float("inf")
CASES = [
    # the file, what is changed in it, the key found at fault, words of the message
    (PLANT_FILE, {"name": REMOVED}, "name", "is missing"),
    (PLANT_FILE, {"name": 3}, "name", "must be text, got 3"),
    (PLANT_FILE, {"name": ""}, "name", "must not be empty"),
    (PLANT_FILE, {"loop": REMOVED}, "loop", "is missing"),
    (PLANT_FILE, {"plant": REMOVED}, "", "neither [mechanism] nor [plant]"),
    (PLANT_FILE, {"plant": 3}, "plant", "must be a table, got 3"),
    (PLANT_FILE, {"sampling_period_s": 0.001}, "sampling_period_s", "belongs into [loop]"),
    (PLANT_FILE, {"colour": "red"}, "colour", "is not a key of a device file; allowed: "),
    (PLANT_FILE, {"lop": {}}, "lop", "did you mean 'loop'?"),
    # not supported yet
    (PLANT_FILE, {"plant": REMOVED, "response": {}, "loop__delay_samples": REMOVED}, "response", "names no file"),
    (
        PLANT_FILE,
        {"loop__velocity__method": "measured"},
        "loop.velocity.method",
        "is not supported yet",
    ),
    (PLANT_FILE, {"loop__velocity__method": "backward"}, "loop.velocity.method", "must be 'backward-difference'"),
    (
        ARM_FILE,
        {"mechanism__links__0__joint": "screw"},
        "mechanism.links.upper.joint",
        "'screw' is not sup",
    ),
    # the plant
    (PLANT_FILE, {"plant__mass_kg": REMOVED}, "plant.mass_kg", "is missing"),
    (PLANT_FILE, {"plant__mass_kg": REMOVED, "plant__mas_kg": 1.0}, "plant.mas_kg", "did you mean 'mass_kg'?"),
    (PLANT_FILE, {"plant__mass_kg__0__0": "0.3"}, "plant.mass_kg.0.0", "must be a number, got the text '0.3'"),
    (PLANT_FILE, {"plant__mass_kg__0__0": True}, "plant.mass_kg.0.0", "must be a number, got true"),
    (PLANT_FILE, {"plant__mass_kg__0__0": NAN}, "plant.mass_kg.0.0", "must be finite, got nan"),
    (PLANT_FILE, {"plant__mass_kg__0__0": INF}, "plant.mass_kg.0.0", "must be finite, got inf"),
    (PLANT_FILE, {"plant__mass_kg__0__0": 10**400}, "plant.mass_kg.0.0", "must be a finite number, got a whole"),
    (PLANT_FILE, {"plant__mass_kg__0__1": 0.01}, "plant.mass_kg", "symmetric, but row 0 column 1 holds 0.01"),
    (PLANT_FILE, {"plant__mass_kg__1__1": 0.0}, "plant.mass_kg", "must be positive definite"),
    (PLANT_FILE, {"plant__mass_kg": [[1.0, 2.0], [2.0, 1.0]]}, "plant.mass_kg", "least eigenvalue is -1"),
    (PLANT_FILE, {"plant__mass_kg": [[1.0, 0.0], [0.0]]}, "plant.mass_kg", "must be a square matrix"),
    (PLANT_FILE, {"plant__mass_kg": []}, "plant.mass_kg", "must be a square matrix, got an empty list"),
    (
        PLANT_FILE,
        {"plant__mass_kg": [0.3, 0.02]},
        "plant.mass_kg",
        "must be a list of rows, got the list [0.3, 0.02]",
    ),
    (
        PLANT_FILE,
        {"plant__mass_kg": {"a": 1}},
        "plant.mass_kg",
        "a number or a matrix (a list of rows), got a table",
    ),
    (PLANT_FILE, {"plant__mass_kg": "0.1"}, "plant.mass_kg", "a matrix (a list of rows), got the text '0.1'"),
    (PLANT_FILE, {"plant__mass_kg": True}, "plant.mass_kg", "a matrix (a list of rows), got true"),
    (PLANT_FILE, {"plant__mass_kg": date(2024, 5, 1)}, "plant.mass_kg", "(a list of rows), got 2024-05-01"),
    (PLANT_FILE, {"plant__stiffness_N_per_m": "5"}, "plant.stiffness_N_per_m", "a number or a matrix (a list"),
    (
        PLANT_FILE,
        {"plant__sensor": "1"},
        "plant.sensor",
        "must be a number or a list of numbers, got the text '1'",
    ),
    (PLANT_FILE, {"plant__handle": False}, "plant.handle", "must be a number or a list of numbers, got false"),
    (
        ARM_FILE,
        {"mechanism__links__0__inertia_kg_m2": "small"},
        "mechanism.links.upper.inertia_kg_m2",
        "must be one number, three moments [Ixx, Iyy, Izz] or 3 rows of 3 numbers, got the text 'small'",
    ),
    (PLANT_FILE, {"plant__stiffness_N_per_m__0__1": 1.0}, "plant.stiffness_N_per_m", "must be symmetric"),
    (PLANT_FILE, {"plant__damping_Ns_per_m__0__1": 1.0}, "plant.damping_Ns_per_m", "must be symmetric"),
    (PLANT_FILE, {"plant__stiffness_N_per_m": 5.0}, "plant.stiffness_N_per_m", "has 1 rows, but mass_kg has 2"),
    (PLANT_FILE, {"plant__actuator": [1.0]}, "plant.actuator", "has 1 number, but mass_kg has 2 rows"),
    (PLANT_FILE, {"plant__sensor": [0.0, 1.0, 0.0]}, "plant.sensor", "has 3 numbers, but mass_kg has 2 rows"),
    (PLANT_FILE, {"plant__handle": 1.0}, "plant.handle", "has 1 number, but mass_kg has 2 rows"),
    (PLANT_FILE, {"plant__actuator": REMOVED}, "plant.actuator", "is missing; with 2 coordinates"),
    (PLANT_FILE, {"plant__sensor": REMOVED}, "plant.sensor", "is missing; with 2 coordinates"),
    (PLANT_FILE, {"plant__actuator": [0.0, 0.0]}, "plant.actuator", "must not be all zeros"),
    # beyond any device
    (
        PLANT_FILE,
        {"plant__mass_kg__1__1": 1e-14},
        "plant.mass_kg",
        "for every motion, got masses from 1e-14 to 0.3",
    ),
    (PLANT_FILE, {"plant__mass_kg": [[1e13, 0.0], [0.0, 1e13]]}, "plant.mass_kg", "between 1e-12 and 1e+12 kg"),
    (PLANT_FILE, {"plant__stiffness_N_per_m": [[2e15, 0.0], [0.0, 0.0]]}, "plant.stiffness_N_per_m", "1e+15 N/m"),
    (PLANT_FILE, {"plant__damping_Ns_per_m": [[-2e15, 0.0], [0.0, 0.0]]}, "plant.damping_Ns_per_m", "got -2e+15"),
    (PLANT_FILE, {"plant__actuator": [0.0, 1e-200]}, "plant.actuator", "of size 1e-09 to 1e+09, got 1e-200"),
    (
        ARM_FILE,
        {"mechanism__links__0__mass_kg": 1e-200},
        "mechanism.links.upper.mass_kg",
        "must be 0 (massless) or between 1e-12 and 1e+12 kg, got 1e-200; is the unit right?",
    ),
    (
        ARM_FILE,
        {"mechanism__links__0__inertia_kg_m2": 1e13},
        "mechanism.links.upper.inertia_kg_m2",
        "must be 0 (no inertia) or between 1e-18 and 1e+12 kg m², got 1e+13; is the unit right?",
    ),
    (
        ARM_FILE,
        {"mechanism__links__0__inertia_kg_m2": [1e-20, 1e-20, 1e-20]},
        "mechanism.links.upper.inertia_kg_m2",
        "between 1e-18 and 1e+12 kg m², got 1e-20",
    ),
    (
        ARM_FILE,
        {"mechanism__drives__0__motor_inertia_kg_m2": 1e-200},
        "mechanism.drives.shoulder.motor_inertia_kg_m2",
        "must be 0 (no inertia) or between 1e-18 and 1e+12 kg m², got 1e-200",
    ),
    (
        ARM_FILE,
        {"mechanism__drives__0__stiffness_Nm_per_rad": 1e16},
        "mechanism.drives.shoulder.stiffness_Nm_per_rad",
        "must be inf (rigid) or between 1e-12 and 1e+15 N m/rad, got 1e+16",
    ),
    (
        ARM_FILE,
        {"mechanism__drives__0__transmission_ratio": 1e-200},
        "mechanism.drives.shoulder.transmission_ratio",
        "must be between 1e-06 and 1e+06 motor turns per joint turn, got 1e-200",
    ),
    # the loop
    (PLANT_FILE, {"loop__sampling_period_s": REMOVED}, "loop.sampling_period_s", "is missing"),
    (
        PLANT_FILE,
        {"loop__sampling_period_s": 1000},
        "loop.sampling_period_s",
        "is 1000 a frequency in Hz? then T = 0.001",
    ),
    (PLANT_FILE, {"loop__sampling_period_s": 0}, "loop.sampling_period_s", "must be at least 1e-07, got 0"),
    (
        PLANT_FILE,
        {"loop__sampling_period_s": -0.001},
        "loop.sampling_period_s",
        "must be at least 1e-07, got -0.001",
    ),
    (
        PLANT_FILE,
        {"loop__sampling_period_s": 1e-300},
        "loop.sampling_period_s",
        "must be 1e-07 <= T <= 1 s, got 1e-300",
    ),
    (PLANT_FILE, {"loop__sampling_period_s": 9.9e-8}, "loop.sampling_period_s", "faster than 10 MHz"),
    (PLANT_FILE, {"loop__sampling_period_s": NAN}, "loop.sampling_period_s", "must be finite, got nan"),
    (PLANT_FILE, {"loop__sampling_period_s": INF}, "loop.sampling_period_s", "must be finite, got inf"),
    (PLANT_FILE, {"loop__sampling_period_s": "1 ms"}, "loop.sampling_period_s", "got the text '1 ms'"),
    (PLANT_FILE, {"loop__sampling_period_s": [0.001]}, "loop.sampling_period_s", "must be a number, got the list"),
    (PLANT_FILE, {"loop__delay_samples": -1}, "loop.delay_samples", "must be at least 0, got -1"),
    (
        PLANT_FILE,
        {"loop__delay_samples": 101},
        "loop.delay_samples",
        "more than 100 samples, which is not supported",
    ),
    (PLANT_FILE, {"loop__delay_samples": REMOVED, "loop__delay_s": -1e-3}, "loop.delay_s", "must be at least 0"),
    (PLANT_FILE, {"loop__delay_samples": REMOVED, "loop__delay_s": 0.2}, "loop.delay_s", "more than 100 samples"),
    (PLANT_FILE, {"loop__delay_s": 0.001}, "loop.delay_s", "stands beside delay_samples"),
    (
        PLANT_FILE,
        {"loop__velocity__filter__cutoff_Hz": 500},
        "loop.velocity.filter.cutoff_Hz",
        "frequency, 500 Hz, got 500",
    ),
    (
        PLANT_FILE,
        {"loop__velocity__filter__cutoff_Hz": 0},
        "loop.velocity.filter.cutoff_Hz",
        "greater than 0, got 0",
    ),
    (PLANT_FILE, {"loop__velocity__filter__order": 0}, "loop.velocity.filter.order", "must be at least 1, got 0"),
    (
        PLANT_FILE,
        {"loop__velocity__filter__order": 21},
        "loop.velocity.filter.order",
        "must be at most 20, got 21",
    ),
    (
        PLANT_FILE,
        {"loop__velocity__filter__order": 2.0},
        "loop.velocity.filter.order",
        "must be a whole number, got 2",
    ),
    (PLANT_FILE, {"loop__velocity__filter__order": True}, "loop.velocity.filter.order", "whole number, got true"),
    (
        PLANT_FILE,
        {"loop__velocity__filter__type": "bessel"},
        "loop.velocity.filter.type",
        "or 'butterworth', got 'bessel'",
    ),
    (PLANT_FILE, {"loop__velocity__filter__type": REMOVED}, "loop.velocity.filter.type", "is missing"),
    (PLANT_FILE, {"loop__velocity__filter": 20.0}, "loop.velocity.filter", "must be a table, got 20"),
    (
        PLANT_FILE,
        {"loop__velocity__filter__cutof_Hz": 2.0},
        "loop.velocity.filter.cutof_Hz",
        "did you mean 'cutoff_Hz'?",
    ),
    (
        PLANT_FILE,
        {"loop__velocity__filter__time_constant_s": 0.01},
        "loop.velocity.filter.time_constant_s",
        'is not read with type = "butterworth"; remove it, or set type = "first-order"',
    ),
    (
        PLANT_FILE,
        {"loop__velocity__filter": {"type": "first-order", "time_constant_s": 0.01, "order": 2}},
        "loop.velocity.filter.order",
        'is not read with type = "first-order"; remove it, or set type = "butterworth"',
    ),
    (
        PLANT_FILE,
        {"loop__velocity__filter": {"type": "first-order", "time_constant_s": 0.01, "cutof_Hz": 2}},
        "loop.velocity.filter.cutof_Hz",
        "is not a key of a device file; allowed: time_constant_s, type",
    ),
    (
        PLANT_FILE,
        {"loop__velocity__filter": {"type": "first-order", "time_constant_s": -1}},
        "loop.velocity.filter.time_constant_s",
        "must be at least 0",
    ),
]


@pytest.mark.parametrize(
    ("text", "changes", "key", "words"), CASES, ids=[f"{i}-{case[2]}" for i, case in enumerate(CASES)]
)
def test_a_fault_names_its_key_and_says_what_is_wrong(text, changes, key, words):
    (fault,) = faults(with_changes(text, **changes))
    assert fault.file == "my.toml"
    assert fault.key == key
    assert words in fault.message
    assert "\n" not in str(fault)


@pytest.mark.parametrize("text", [PLANT_FILE, ARM_FILE], ids=["plant", "mechanism"])
def test_the_unchanged_files_are_right(text):
    assert isinstance(from_document(tomllib.loads(text)), Device)


ONE_MASS = 'name = "one"\n[plant]\nmass_kg = 0.1\n[loop]\nsampling_period_s = 0.001'


@pytest.mark.parametrize("mass", [1e-200, 1e-13, 1e13, 1e29])
def test_a_mass_that_no_device_has_is_refused(mass):
    (fault,) = faults(with_changes(ONE_MASS, plant__mass_kg=mass))
    expected = f"must be between 1e-12 and 1e+12 kg, got {mass:.6g}; is the unit right?"
    assert (fault.key, fault.message) == ("plant.mass_kg", expected)


@pytest.mark.parametrize("mass", [LIGHTEST, 1e-6, 1e6, HEAVIEST])
def test_at_the_bounds_the_chart_is_still_the_one_of_a_mass(mass):
    """A mass scales the walls and nothing else: the largest stiffness is 0.686292 m / T^2 (thesis)."""
    device = from_document(with_changes(ONE_MASS, plant__mass_kg=mass))
    stiffest = largest_stiffness(device.at().loop).stiffness
    assert stiffest * 0.001**2 / mass == pytest.approx(0.686292, abs=5e-7)


def test_all_faults_are_reported_together_in_the_order_of_the_file():
    document = with_changes(
        PLANT_FILE,
        colour="red",
        plant__mass_kg__0__1=0.01,
        plant__stifness_N_per_m=1.0,
        plant__actuator=[1.0, 2.0, 3.0],
        loop__sampling_period_s=800,
        loop__delay_samples=-1,
        loop__saturation={"force_N": -3.0},
        loop__velocity__filter__order="two",
    )
    assert [fault.key for fault in faults(document)] == [
        "plant.mass_kg",
        "plant.actuator",
        "plant.stifness_N_per_m",
        "loop.sampling_period_s",
        "loop.delay_samples",
        "loop.velocity.filter.order",
        "loop.saturation.force_N",
        "colour",
    ]


# --- every way a device file's [mechanism] can be wrong ----------------------------------------------


MECHANISM_FAULTS_CASES = [
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
    (
        ARM_FILE,
        {"mechanism__reference__direction": [NAN, 0]},
        "mechanism.reference.direction.0",
        "must be finite",
    ),
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
    ("text", "changes", "key", "words"),
    MECHANISM_FAULTS_CASES,
    ids=[f"{i}-{case[2]}" for i, case in enumerate(MECHANISM_FAULTS_CASES)],
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
