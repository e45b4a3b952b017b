"""Every way a device file's [plant] and [loop] can be wrong: the right key, the value, what is allowed."""

from __future__ import annotations

import tomllib
from datetime import date

import pytest

from tests.device.device_cases import ARM_FILE, PLANT_FILE, REMOVED, faults, with_changes
from zwidth.chart import largest_stiffness
from zwidth.device import Device, from_document
from zwidth.device.schema.magnitudes import HEAVIEST, LIGHTEST

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
