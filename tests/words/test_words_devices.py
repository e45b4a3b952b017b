"""What is said of a device's numbers that cannot be meant, file by file and key by key."""

from __future__ import annotations

import pytest

from tests.device import test_device_plausible
from tests.device.device_cases import ARM_FILE, PLANT_FILE, faults, with_changes
from tests.device.test_device_address import error_message
from tests.device.test_device_loop import MOTOR, arm, with_velocity
from tests.device.test_device_nonlinear import arm as nonlinear_arm
from tests.device.test_device_ratio_table import LIMITS, RATIO
from tests.device.test_device_ratio_table import arm as ratio_table_arm
from zwidth.device.load import load
from zwidth.device.plausibility import ImplausibleNumber

# --- dotted paths: what `--set` reaches, what it says when it reaches nothing ------------------------


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("links.uper.length_m=1", "did you mean 'mechanism.links.upper.length_m'?"),
        ("linkz.upper.length_m=1", "did you mean 'mechanism.links.upper.length_m'?"),
        ("links.upper.lenght_m=1", "did you mean 'mechanism.links.upper.length_m'?"),
        ("links.upper.length=1", "did you mean 'mechanism.links.upper.length_m'?"),
        ("links.2.length_m=1", "mechanism.links has: upper, lower"),
        ("links.-1.length_m=1", "mechanism.links has: upper, lower"),
        ("sampling_period_s=1", "did you mean 'loop.sampling_period_s'?"),
        ("lop.delay_s=1", "did you mean 'loop.delay_s'?"),
        ("links.upper.length_m.0=1", "mechanism.links.upper.length_m holds 0.2, nothing is inside it"),
        ("loop.saturation.force=1", "did you mean 'loop.saturation.force_N'?"),
        ("friction.colomb_N=1", "did you mean 'friction.coulomb_N'?"),
        ("operator.arm_mas_kg=1", "did you mean 'operator.arm_mass_kg'?"),
        ("loop.velocity.sample=1", "did you mean 'loop.velocity.samples'?"),
        ("drives.elbow.coulomb_N=1", "did you mean 'mechanism.drives.elbow.coulomb_Nm'?"),
        ("links.upper.xyzzy=1", "mechanism.links.upper has: axis, beam, center_of_mass_m,"),
        ("links.upper.length_m", "must be PATH=VALUE"),
        ("=3", "must be PATH=VALUE"),
        ("", "must be PATH=VALUE"),
        (".=3", "is not a key"),
        ("links..length_m=1", "is not a key"),
        (f"links.upper.length_m={'[' * 3000}", "nested too deeply"),
        (f"name={'[' * 30}{']' * 30}", "nested too deeply"),
    ],
)
def test_a_path_that_leads_nowhere_names_the_nearest_right_one(setting, words):
    assert words in error_message(setting)


# --- what the computer, its amplifier and its encoder do, from the file to the loop ------------------


FAULTS = [
    (
        with_velocity("savitzky-golay", samples=4, order=4),
        "loop.velocity.order",
        "must be below samples = 4, got 4",
    ),
    (with_velocity("savitzky-golay", samples=4), "loop.velocity.order", "is missing"),
    (with_velocity("savitzky-golay", samples=4.5, order=2), "loop.velocity.samples", "must be a whole number"),
    (
        with_velocity("savitzky-golay", samples=5, order=2, centred=1),
        "loop.velocity.centred",
        "true or false, got 1",
    ),
    (with_velocity("windowed-difference", samples=5000), "loop.velocity.samples", "must be at most 100, got 5000"),
    (with_velocity("windowed-difference", samples=0), "loop.velocity.samples", "must be at least 1"),
    (with_velocity("windowed-difference"), "loop.velocity.samples", "is missing"),
    (
        with_velocity("central-difference", samples=4),
        "loop.velocity.samples",
        'is not read with method = "central-difference"; remove it, or set method = "windowed-difference" or',
    ),
    (
        with_changes(PLANT_FILE, loop__velocity={"alpha": 0.5}),
        "loop.velocity.alpha",
        'is not read with method = "backward-difference"; remove it, or set method = "alpha-beta"',
    ),
    (with_velocity("kallman", samples=4), "loop.velocity.method", "did you mean 'kalman'?"),
    (with_velocity(3), "loop.velocity.method", "give 'alpha-beta' or"),
    (with_velocity([3]), "loop.velocity.method", "give 'alpha-beta' or"),
    (with_velocity("measured", samples=5, window=3), "loop.velocity.method", "is not supported yet"),
    (with_velocity("foaw", position_noise_m=1e-6), "loop.velocity.samples", "is missing"),
    (with_velocity("foaw", samples=101, position_noise_m=1e-6), "loop.velocity.samples", "at most 100, got 101"),
    (with_velocity("foaw", samples=9), "loop.velocity.position_noise_m", "give the encoder's largest error, or"),
    (
        with_velocity("foaw", samples=9, position_noise_m=1e-6, fit="mid-fit"),
        "loop.velocity.fit",
        "must be 'end-fit' or 'best-fit'",
    ),
    (with_velocity("levant"), "loop.velocity.acceleration_max_m_per_s2", "is missing"),
    (
        with_velocity("levant", acceleration_max_m_per_s2=0.0),
        "loop.velocity.acceleration_max_m_per_s2",
        "must be greater than 0",
    ),
    (
        with_velocity("levant", acceleration_max_m_per_s2=1.0, samples=3),
        "loop.velocity.samples",
        'is not read with method = "levant"',
    ),
    (with_velocity("alpha-beta", alpha=1.5, beta=1.5), "loop.velocity", "2 alpha + beta must be below 4"),
    (with_velocity("alpha-beta", alpha=1e-9, beta=1.5), "loop.velocity", "would remember for too long"),
    (with_velocity("alpha-beta", alpha=0.0, beta=1.5), "loop.velocity.alpha", "must be greater than 0"),
    (
        with_velocity("kalman", acceleration_noise_m_per_s2=10.0),
        "loop.velocity.position_noise_m",
        "or for a [plant] loop.encoder.resolution_m",
    ),
    (
        with_velocity("kalman", acceleration_noise_m_per_s2=1e-9, position_noise_m=1.0),
        "loop.velocity",
        "too little motion",
    ),
    (
        with_velocity("kalman", acceleration_noise_m_per_s2=1e30, position_noise_m=1e-30),
        "loop.velocity",
        "too much motion",
    ),
    (with_changes(PLANT_FILE, loop__encoder={"at": "link"}), "loop.encoder.at", "give plant.sensor"),
    (
        with_changes(ARM_FILE, loop__encoder={"at": "tip"}),
        "loop.encoder.at",
        "must be 'motor', 'link' or 'handle'",
    ),
    (
        with_changes(ARM_FILE, loop__encoder={"resolution_m": 1e-6}),
        "loop.encoder.resolution_m",
        "is for a [plant]",
    ),
    (
        with_changes(PLANT_FILE, loop__actuator={"time_constant_s": -1.0}),
        "loop.actuator.time_constant_s",
        "at least 0",
    ),
    (
        with_changes(PLANT_FILE, loop__actuator={"time_constant_s": 1e-13}),
        "loop.actuator.time_constant_s",
        "1e-06 to 1e+06",
    ),
    (
        with_changes(PLANT_FILE, loop__actuator={"time_constant_s": 1e9}),
        "loop.actuator.time_constant_s",
        "1e-06 to 1e+06",
    ),
    (with_changes(PLANT_FILE, loop__actuator={}), "loop.actuator.time_constant_s", "is missing"),
    (
        with_changes(PLANT_FILE, loop__force={"filter": {"type": "butterworth", "order": 2, "cutoff_Hz": 600.0}}),
        "loop.force.filter.cutoff_Hz",
        "below half the sampling frequency, 500 Hz",
    ),
    (
        with_changes(PLANT_FILE, plant__electrical_damping=[{"resistance_ohm": 2.0}]),
        "plant.electrical_damping.0.force_constant_N_per_A",
        "is missing",
    ),
    (
        with_changes(PLANT_FILE, plant__electrical_damping=[MOTOR | {"along": [1.0]}]),
        "plant.electrical_damping.0.along",
        "has 1 number, but mass_kg has 2 rows",
    ),
    (
        with_changes(PLANT_FILE, plant__electrical_damping=[MOTOR | {"inductance_H": 1e-12}]),
        "plant.electrical_damping.0.inductance_H",
        "time constant L/R from 1e-06",
    ),
    (
        with_changes(PLANT_FILE, plant__electrical_damping=[MOTOR | {"force_constant_N_per_A": 1e12}]),
        "plant.electrical_damping.0",
        "more than any device",
    ),
    (arm(winding_inductance_H=2e-3), "mechanism.drives.shoulder.winding_inductance_H", "current amplifier"),
    (
        arm(damping_resistance_ohm=2.0, torque_constant_Nm_per_A=0.1),
        "mechanism.drives.shoulder.winding_resi",
        "missing",
    ),
    (
        arm(damping_resistance_ohm=2.0, winding_resistance_ohm=1.0),
        "mechanism.drives.shoulder.torque_constant_Nm_per_A",
        "is missing; damping_resistance_ohm needs it",
    ),
]


@pytest.mark.parametrize(("document", "key", "words"), FAULTS, ids=[f"{i}-{f[1]}" for i, f in enumerate(FAULTS)])
def test_a_fault_is_one_line_at_its_key(document, key, words):
    (fault,) = faults(document)
    assert fault.key.startswith(key)
    assert words in fault.message
    assert "\n" not in str(fault)


# --- dry friction, encoder steps, bent springs, brakes and force limits: from a file, and by ---------


LUGRE = {"coulomb_N": [0.0, 0.1], "model": "lugre", "bristle_stiffness_N_per_m": 1e4}
NONLINEAR_FAULTS = [
    (
        with_changes(PLANT_FILE, friction={"coulomb_N": [0.0, -0.1]}),
        "friction.coulomb_N.1",
        "must be at least 0, got -0.1",
    ),
    (
        with_changes(PLANT_FILE, friction={"coulomb_N": 0.1}),
        "friction.coulomb_N",
        "has 1 number, but mass_kg has 2 rows",
    ),
    (
        with_changes(PLANT_FILE, friction={"coulomb_N": "0.1"}),
        "friction.coulomb_N",
        "must be a number or a list of numbers",
    ),
    (with_changes(PLANT_FILE, friction={"coulomb_N": [0, 1e-14]}), "friction.coulomb_N.1", "is the unit right?"),
    (with_changes(PLANT_FILE, friction={}), "friction.coulomb_N", "is missing"),
    (
        with_changes(PLANT_FILE, friction=LUGRE | {"model": "stick"}),
        "friction.model",
        "must be 'coulomb', 'dahl' or 'lugre'",
    ),
    (
        with_changes(PLANT_FILE, friction=LUGRE | {"model": "coulomb"}),
        "friction.bristle_stiffness_N_per_m",
        "is not read with",
    ),
    (
        with_changes(PLANT_FILE, friction={"coulomb_N": [0, 1], "model": "dahl"}),
        "friction.bristle_stiffness_N_per_m",
        'is missing; model = "dahl" needs it',
    ),
    (
        with_changes(PLANT_FILE, friction=LUGRE | {"breakaway_N": [0.0, 0.05]}),
        "friction.breakaway_N.1",
        "at least coulomb_N = 0",
    ),
    (
        with_changes(PLANT_FILE, friction=LUGRE | {"breakaway_N": [0.2, 0.1]}),
        "friction.breakaway_N.0",
        "must be 0 where coulomb_N is 0",
    ),
    (
        with_changes(PLANT_FILE, friction=LUGRE | {"breakaway_N": [0.0, 0.2]}),
        "friction.stribeck_velocity_m_per_s",
        "a breakaway above the level of sliding needs it",
    ),
    (
        with_changes(PLANT_FILE, friction=LUGRE | {"stribeck_velocity_m_per_s": 0.1}),
        "friction.stribeck_velocity_m_per_s",
        "is read only with a breakaway",
    ),
    (
        with_changes(ARM_FILE, friction={"coulomb_N": [0, 1]}),
        "friction",
        "the drives of a mechanism give coulomb_Nm",
    ),
    (
        with_changes(PLANT_FILE, loop__saturation={"force_N": 0.0}),
        "loop.saturation.force_N",
        "must be greater than 0",
    ),
    (with_changes(PLANT_FILE, loop__saturation={}), "loop.saturation.force_N", "is missing"),
    (
        with_changes(PLANT_FILE, loop__encoder={"resolution_m": -1e-6}),
        "loop.encoder.resolution_m",
        "must be at least 0",
    ),
    (with_changes(ARM_FILE, loop__encoder={"noise_m": 1e-6}), "loop.encoder.noise_m", "give encoder_noise_rad"),
    (
        with_changes(PLANT_FILE, plant__spring=[{"hardening_N_per_m3": 1.0}]),
        "plant.spring.0.along",
        "is missing; with 2",
    ),
    (with_changes(PLANT_FILE, plant__spring=[{"along": [1, -1]}]), "plant.spring.0", "is an ordinary spring"),
    (
        with_changes(PLANT_FILE, plant__spring=[{"along": [1], "hardening_N_per_m3": 1.0}]),
        "plant.spring.0.along",
        "has 1 number",
    ),
    (with_changes(PLANT_FILE, plant__brake=[{}]), "plant.brake.0.damping_max_Ns_per_m", "is missing"),
    (
        with_changes(PLANT_FILE, plant__brake=[{"damping_max_Ns_per_m": 1.0, "time_constant_s": 1e-12}]),
        "plant.brake.0.time_constant_s",
        "must be 0 (no lag) or from 1e-06",
    ),
    (
        with_changes(ARM_FILE, **nonlinear_arm(coulomb_Nm=-0.1)),
        "mechanism.drives.shoulder.coulomb_Nm",
        "must be at least 0, got -0.1",
    ),
    (
        with_changes(ARM_FILE, **nonlinear_arm(breakaway_Nm=0.1)),
        "mechanism.drives.shoulder.breakaway_Nm",
        "is not read with",
    ),
    (
        with_changes(ARM_FILE, mechanism__friction={"model": "dahl"}),
        "mechanism.friction",
        "no drive has coulomb_Nm",
    ),
    (
        with_changes(ARM_FILE, mechanism__drives__1__hardening_Nm_per_rad3=1.0),
        "mechanism.drives.elbow.hardening_Nm_per_rad3",
        "needs a flexible transmission",
    ),
    (
        with_changes(ARM_FILE, **nonlinear_arm(backward_stiffness_Nm_per_rad=0.0)),
        "mechanism.drives.shoulder.backward_stiffness_Nm_per_rad",
        "must be greater than 0",
    ),
    (
        with_changes(ARM_FILE, **nonlinear_arm(brake_time_constant_s=0.1)),
        "mechanism.drives.shoulder.brake_time_constant_s",
        "give brake_damping_max_Nms_per_rad",
    ),
    (
        with_changes(ARM_FILE, **nonlinear_arm(continuous_torque_Nm=0.0)),
        "mechanism.drives.shoulder.continuous_torque_Nm",
        "must be greater than 0",
    ),
    (
        with_changes(ARM_FILE, **nonlinear_arm(continuous_torque_Nm=float("inf"))),
        "mechanism.drives.shoulder.continuous_torque_Nm",
        "must be finite, got inf",
    ),
    (
        with_changes(ARM_FILE, **nonlinear_arm(continuous_torque_Nm=1e-13)),
        "mechanism.drives.shoulder.continuous_torque_Nm",
        "is the unit right?",
    ),
    (
        with_changes(ARM_FILE, **nonlinear_arm(continuous_torque_Nm=0.2, torque_limit_Nm=0.1)),
        "mechanism.drives.shoulder.continuous_torque_Nm",
        "must be at most torque_limit_Nm = 0.1, got 0.2",
    ),
    (
        with_changes(ARM_FILE, **nonlinear_arm(encoder_counts_per_rev=0)),
        "mechanism.drives.shoulder.encoder_counts_per_rev",
        "must be greater than 0",
    ),
]


@pytest.mark.parametrize(
    ("document", "key", "words"), NONLINEAR_FAULTS, ids=[f"{i}-{f[1]}" for i, f in enumerate(NONLINEAR_FAULTS)]
)
def test_a_fault_of_what_is_not_linear_is_one_line_at_its_key(document, key, words):
    (fault,) = faults(document)
    assert fault.key == key
    assert words in fault.message
    assert "\n" not in str(fault)


# --- numbers that are allowed and look wrong are warned of, with what to type; plausible -------------


paddle = test_device_plausible.paddle
LINK, DRIVE, LOOP = "mechanism.links.paddle.", "mechanism.drives.motor.", "loop."
WRONG_UNITS = [
    (LINK + "inertia_kg_m2", 600, "a radius of gyration of 115 m on a device of 75 mm", "g cm², write 6e-05"),
    (LINK + "inertia_kg_m2", 0.6, "a radius of gyration of 3.65 m", "kg cm², write 6e-05"),
    (LINK + "inertia_kg_m2", [1e4, 6e4, 6e4], "a radius of gyration of", "g mm², write 6e-05"),
    (LINK + "mass_kg", 45, "no metal is so dense", "g, write 0.045"),
    ("mechanism.assemblies.only.joints_rad.paddle", 70, "more than a full turn", "degrees, write 1.222"),
    ("mechanism.assemblies.only.joints_rad.paddle", -160, "more than a full turn", "degrees, write -2.793"),
    (LINK + "orientation_rad", [0, 0, 90], "more than a full turn", "degrees, write 1.571"),
    (LINK + "center_of_mass_m", [20], "looks wrong for a device", "mm, write 0.02"),
    (DRIVE + "motor_inertia_kg_m2", 11, "looks wrong for a rotor", "g cm², write 1.1e-06"),
    (DRIVE + "transmission_ratio", 0.087, "motor turns per joint turn", "per motor turn, write 11.49"),
    (DRIVE + "torque_constant_Nm_per_A", 23.4, "looks wrong for a motor", "mN m/A, write 0.0234"),
    (DRIVE + "torque_limit_Nm", 80, "1.2e+04 N at the handle", "mN m, write 0.08"),
    (DRIVE + "continuous_torque_Nm", 45, "6.9e+03 N at the handle", "mN m, write 0.045"),
    (DRIVE + "coulomb_Nm", 12, "1.8e+03 N at the handle", "mN m, write 0.012"),
    (DRIVE + "encoder_counts_per_rev", 0.18, "counts per revolution", "2000 (of degrees)"),
    (LOOP + "sampling_period_s", 0.5, "2 samples a second", "ms, write 0.0005"),
]


@pytest.mark.parametrize(("key", "value", "why", "instead"), WRONG_UNITS)
def test_a_slipped_unit_is_warned_of_with_what_to_type(paddle, key, value, why, instead):
    with pytest.warns(ImplausibleNumber) as warned:
        load(paddle, [*([DRIVE + "torque_limit_Nm=unset"] if "continuous" in key else []), (key, value)])
    (text,) = [str(warning.message) for warning in warned]
    assert text.startswith(f"{paddle}: {key}: ")
    assert why in text
    assert text.endswith(instead)
    assert "\n" not in text


# --- ratios that change with the joint, in device files: what is right, what is refused, what --------


SHOULDER = "mechanism.drives.shoulder.ratio_table"
CASES = [
    # the table, other changes, the key found at fault, words of the message
    ({"joint_rad": [0, 1, 1], "ratio": [1.0, 2, 3]}, {}, ".joint_rad", "number 2 (counted from 0) is 1, after 1"),
    (
        {"joint_rad": [0, 1, 0.5], "ratio": [1.0, 2, 3]},
        {},
        ".joint_rad",
        "must increase from each number to the next",
    ),
    ({"joint_rad": [-1, 1], "ratio": [1.0, -2]}, {}, ".ratio.1", "must be greater than 0, got -2"),
    ({"joint_rad": [-1, 1], "ratio": [1.0, 0]}, {}, ".ratio.1", "must be greater than 0, got 0"),
    ({"joint_rad": [-1, 1], "ratio": [1.0, 1e9]}, {}, ".ratio.1", "between 1e-06 and 1e+06"),
    ({"joint_rad": [0], "ratio": [1.0]}, {}, ".ratio", "must have at least 2 elements, got 1"),
    ({"joint_rad": [], "ratio": []}, {}, ".ratio", "must have at least 2 elements, got 0"),
    ({"joint_rad": [-1, 0, 1], "ratio": [1.0, 2]}, {}, ".ratio", "has 2 numbers, but joint_rad has 3"),
    ({"joint_rad": [-1, 1]}, {}, ".ratio", "is missing"),
    ({"ratio": [1.0, 2]}, {}, ".joint_rad", "is missing; give the coordinates of the drive's joint"),
    ({"joint_deg": [-60, 60], "ratio": [1.0, 2]}, {}, ".joint_deg", "give joint_rad"),
    ({"joint_m": [-1, 1], "ratio": [1.0, 2]}, {}, ".joint_m", "which is revolute; give joint_rad"),
    ({"joint_rad": [-4, 4], "ratio": [1.0, 2]}, {}, ".joint_rad", "from -4 to 4 rad, more than a full turn"),
    (None, {RATIO: 10.0}, "", "stands beside transmission_ratio; only one of the two"),
    (None, {"mechanism__drives__0__coupling": {"lower": 3.0}}, "", "cannot be had together with coupling"),
    (None, {LIMITS: [-2.0, 1.0]}, ".joint_rad", "from -1 to 1.2 rad, but limits_rad of the joint are [-2, 1]"),
    (5.0, {}, "", "must be a table, got 5"),
]


@pytest.mark.parametrize(("table", "changes", "key", "words"), CASES)
def test_a_wrong_table_has_one_line(table, changes, key, words):
    document = ratio_table_arm(table, **{name: value for name, value in changes.items() if name != RATIO})
    if RATIO in changes:
        document["mechanism"]["drives"][0]["transmission_ratio"] = changes[RATIO]
    (fault,) = faults(document)
    assert fault.key == SHOULDER + key
    assert words in fault.message
