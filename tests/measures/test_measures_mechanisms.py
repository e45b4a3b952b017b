"""The catalogue's measures of mechanisms: in other frames, orders and units; where they have no value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.device.device_cases import ARM_FILE, PLANT_FILE, with_changes
from tests.measures.dexterity_cases import (
    SHIFT,
    TURN,
    on_moved_base,
    operating_points,
    permuted,
    scaled,
    with_drive_data,
)
from tests.model.model_cases import KINDS, five_bar, some_postures
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.errors import MeasureError
from zwidth.measures import MEASURES, NO_VALUE, OK, OUT_OF_REACH, dexterity, evaluate, find_measure
from zwidth.model import GivenDamping, effective_parameters, reduce_directions

# Those that are about a wanted wall or force have tests of their own.
TESTED_MEASURES = [
    name
    for name, m in MEASURES.items()
    if str(m.function).split(":")[0].endswith(("dexterity", "forces")) and not m.of_wall
]
# Exponents of lengths and masses in each measure, r being the number of drives; all others have none of either.
UNITS = {
    "manipulability": (1, 0, True),
    "dynamic_manipulability": (-1, -1, True),
    "link_side_mass": (0, 1, False),
    "motor_side_mass": (0, 1, False),
    "rigid_mass": (0, 1, False),
    "stiffness": (0, 1, False),  # with springs that grow as moments do: per second squared
    "peak_force": (1, 1, False),
    "continuous_force": (1, 1, False),
    "friction_force": (1, 1, False),
    "acceleration_max": (1, 0, False),
    "position_resolution": (1, 0, False),
}
NAMES = ["five-bar", "spatial arm", "spatial loop"]


def case(name, seed=2):
    """A mechanism with all data, four positions and a direction for each that its handle can move along."""
    rng = np.random.default_rng(seed)
    mechanism = with_drive_data(KINDS[name](rng), rng)
    posture = some_postures(mechanism, rng)
    d = posture.jacobian.shape[-1]
    u = np.einsum("kij,kj->ki", posture.jacobian, rng.uniform(0.2, 1.0, (4, d)) * rng.choice([-1.0, 1.0], (4, d)))
    return mechanism, posture.position, u


def values(name, place):
    found = evaluate(find_measure(name), place)
    assert np.all(found.status == OK), found.notes
    return found.values


@pytest.mark.parametrize("kind", NAMES)
@pytest.mark.parametrize("name", TESTED_MEASURES)
def test_the_base_frame_and_the_order_of_the_drives_change_nothing(name, kind):
    mechanism, positions, u = case(kind)
    here = values(name, operating_points(mechanism, positions, u))
    there = operating_points(on_moved_base(mechanism), SHIFT + positions @ TURN.T, u @ TURN.T)
    assert_allclose(values(name, there), here, rtol=1e-7)
    order = np.roll(np.arange(len(mechanism.drives.names)), 1)
    other = operating_points(permuted(mechanism, order), positions, u)
    assert not np.allclose(other.jacobian, operating_points(mechanism, positions, u).jacobian)
    assert_allclose(values(name, other), here, rtol=1e-7)


@pytest.mark.parametrize("kind", NAMES)
@pytest.mark.parametrize("name", TESTED_MEASURES)
def test_units_and_scale(name, kind):
    """In millimetres and grams, and as a device of other size: times the powers that the measure's unit has."""
    mechanism, positions, u = case(kind)
    here = values(name, operating_points(mechanism, positions, u))
    lengths, masses, per_freedom = UNITS.get(name, (0, 0, False))
    r = len(mechanism.drives.names) if per_freedom else 1
    for length, mass in ((1000.0, 1000.0), (1.7, 1.0), (1.0, 3.0)):
        there = values(name, operating_points(scaled(mechanism, length, mass), length * positions, u))
        assert_allclose(there, here * (length**lengths * mass**masses) ** r, rtol=1e-7)


@pytest.mark.parametrize("name", TESTED_MEASURES)
def test_units_of_the_catalogue_have_those_powers(name):
    """Metres and kilograms in the unit, seconds and radians aside."""
    lengths, masses, per_freedom = UNITS.get(name, (0, 0, False))
    known = {
        "": (0, 0),
        "m^r/rad^r": (1, 0),
        "1/(kg m)^r": (-1, -1),
        "kg": (0, 1),
        "N": (1, 1),
        "N/m": (0, 1),
        "m/s^2": (1, 0),
        "m": (1, 0),
    }
    assert known[find_measure(name).unit] == (lengths, masses)
    assert per_freedom == find_measure(name).unit.endswith("^r")


def test_only_the_mass_at_the_handle_knows_no_coordinates():
    """Absolute angles of a serial arm in place of those between its links: p = S a with whole numbers."""
    S = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
    place = operating_points(*case("spatial arm"))
    J, M = place.jacobian, place.whole_mass_matrix
    other_J, other_M = J @ S, S.T @ M @ S
    assert_allclose(dexterity.handle_mass_isotropy(other_J, other_M), dexterity.handle_mass_isotropy(J, M))
    assert not np.allclose(dexterity.dynamic_isotropy(other_M), dexterity.dynamic_isotropy(M), rtol=0.01)
    for measure in (dexterity.isotropy, dexterity.isotropy_frobenius):
        assert not np.allclose(measure(other_J), measure(J), rtol=0.01)


@pytest.mark.parametrize("kind", NAMES)
def test_the_masses_felt_at_the_handle_lie_within_what_its_isotropy_says(kind):
    """Effective masses over all directions, by another way through the mechanism; the mass matrix of (2.16)."""
    mechanism, positions, u = case(kind)
    place = operating_points(mechanism, positions, u)
    said = values("handle_mass_isotropy", place)
    rng = np.random.default_rng(0)
    for k in range(4):
        one = place[k]
        span = np.linalg.qr(one.jacobian)[0]
        directions = rng.normal(size=(20000, span.shape[1])) @ span.T
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        masses = effective_parameters(mechanism, one.posture, directions).rigid_mass
        assert masses.max() / masses.min() <= said[k] * (1.0 + 1e-9)
        assert masses.max() / masses.min() > 0.95 * said[k]
        W = reduce_directions(mechanism, one.posture, span.T, "rigid", GivenDamping()).mass
        assert_allclose(said[k], np.linalg.cond(W), rtol=1e-8)


def test_without_rotors_and_links_alone():
    mechanism, positions, u = case("five-bar")
    still = replace(mechanism, drives=replace(mechanism.drives, motor_inertia=np.zeros(2)))
    place = operating_points(still, positions, u)
    assert_allclose(values("dynamic_isotropy", place), np.linalg.cond(place.mass_matrix))
    assert_allclose(values("rigid_mass", place), values("link_side_mass", place))


def test_where_there_is_no_posture_there_is_no_value():
    rng = np.random.default_rng(4)
    mechanism = with_drive_data(five_bar(), rng)
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 7), np.linspace(0.05, 0.35, 4))
    place = operating_points(mechanism, np.stack([x, y, np.zeros_like(x)], axis=-1), [0.3, 1.0, 0.0])
    assert (place.status == OUT_OF_REACH).any()
    for name in TESTED_MEASURES:
        found = evaluate(find_measure(name), place)
        assert found.values.shape == (4, 7)
        assert np.array_equal(np.isnan(found.values), found.status != OK)
        assert np.array_equal(found.status, place.status)
        index = tuple(np.argwhere(place.status == OK)[0])
        assert_allclose(find_measure(name).compute(place[index]), found.values[index])


def test_across_the_plane_friction_has_no_value_and_the_handle_no_acceleration():
    rng = np.random.default_rng(4)
    place = operating_points(with_drive_data(five_bar(), rng), [[0.0, 0.25, 0.0]], [0.0, 0.0, 1.0])
    assert evaluate(find_measure("friction_force"), place).status.tolist() == [NO_VALUE]
    assert values("acceleration_max", place) == [0.0]
    assert values("peak_force", place) == [np.inf]


def test_a_batch_of_designs_is_its_designs_side_by_side():
    rng = np.random.default_rng(6)
    one = with_drive_data(five_bar(), rng)
    drives = one.drives
    n = drives.transmission * np.array([[0.5], [1.0], [2.0]])
    many = replace(
        one, drives=replace(drives, transmission=n, torque_limit=drives.torque_limit + np.zeros((3, 1)))
    )
    batch = operating_points(many, [0.05, 0.22, 0.0], [1.0, 1.0, 0.0])
    for name in TESTED_MEASURES:
        each = [
            find_measure(name).compute(
                operating_points(
                    replace(one, drives=replace(drives, transmission=row)), [0.05, 0.22, 0.0], [1.0, 1.0, 0.0]
                )
            )
            for row in n
        ]
        assert_allclose(find_measure(name).compute(batch), each)


# --- what a device file tells -----------------------------------------------------------------------

FULL = {
    "torque_limit_Nm": 0.2,
    "continuous_torque_Nm": 0.05,
    "encoder_counts_per_rev": 2000.0,
    "coulomb_Nm": 0.001,
}


def arm(**keys):
    """The two-link arm of the device tests, elbow at a right angle, with more keys in both drives."""
    return from_document(
        with_changes(
            ARM_FILE.replace("upper = 0.5, lower = 1.0", "upper = 0.0, lower = 1.57"),
            **{f"mechanism__drives__{i}__{key}": value for i in (0, 1) for key, value in keys.items()},
        )
    )


def test_a_two_link_arm_by_hand():
    """Shoulder at the origin, elbow at (0.2, 0), handle at (0.2, 0.2), both drives geared 10 to 1.

    x moves by -0.2 per radian of either, y by 0.2 per radian of the shoulder. So along x torques are 0.2 f; a
    motion along x alone turns the elbow by -5 rad/m, one along y the shoulder by 5 and the elbow by -5.
    """
    device = arm(**FULL)
    along = {axis: device.at([0.2, 0.2, 0.0], axis) for axis in ((1.0, 0.0), (0.0, 1.0))}
    step = 2.0 * np.pi / (2000.0 * 10.0)
    by_hand = {
        "peak_force": (10 * 0.2 / 0.2, 10 * 0.2 / 0.2),
        "continuous_force": (10 * 0.05 / 0.2, 10 * 0.05 / 0.2),
        "position_resolution": (0.4 * step, 0.2 * step),
        "friction_force": (5.0 * 0.01, 10.0 * 0.01),
    }
    for name, expected in by_hand.items():
        assert_allclose([values(name, place) for place in along.values()], expected, rtol=1e-9)
    # moments about the elbow and the shoulder: M = [[a + 2 b cos q2 ..., ...], [..., c]] with cos q2 = 0
    c = 4e-4 + 0.1 * 0.1**2 + 1e-4
    coupling = 4e-4 + 0.1 * 0.1**2  # + m2 l1 c2 cos q2
    total = 2 * 4e-4 + 0.1 * 0.1**2 + 0.1 * (0.2**2 + 0.1**2) + 1e-4
    torques = np.array([[total, coupling], [coupling, c]]) @ np.array([[0.0, 5.0], [-5.0, -5.0]])
    expected = (2.0 / np.abs(torques)).min(axis=0)
    assert_allclose([values("acceleration_max", place) for place in along.values()], expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("peak_force", "torque_limit_Nm"),
        ("acceleration_max", "torque_limit_Nm"),
        ("continuous_force", "continuous_torque_Nm"),
        ("position_resolution", "encoder_counts_per_rev"),
        ("friction_force", "coulomb_Nm"),
    ],
)
def test_what_the_file_does_not_tell_is_asked_for_by_its_key(name, key):
    measure = find_measure(name)
    with pytest.raises(MeasureError, match=rf"^needs .*give mechanism\.drives\.shoulder\.{key}"):
        evaluate(measure, arm().at())
    half = from_document(
        with_changes(ARM_FILE, **{f"mechanism__drives__0__{key}": 0.01 if "Nm" in key else 100.0})
    )
    if name == "friction_force":  # a drive without the key has none
        assert values(name, half.at()) > 0.0
    else:
        with pytest.raises(MeasureError, match=rf"give mechanism\.drives\.elbow\.{key}"):
            evaluate(measure, half.at())


def test_a_limit_of_inf_is_none():
    with pytest.raises(MeasureError, match="finite torque_limit_Nm"):
        evaluate(find_measure("peak_force"), arm(torque_limit_Nm=float("inf")).at())


def test_a_plant_has_no_drives_and_reads_and_rubs_where_the_wall_acts():
    given = from_document(with_changes(PLANT_FILE)).at()
    for name in set(TESTED_MEASURES) - {"link_side_mass", "motor_side_mass", "rigid_mass", "stiffness"}:
        with pytest.raises(MeasureError):
            evaluate(find_measure(name), given)
    told = {"friction__coulomb_N": [0.0, 0.1], "loop__encoder": {"resolution_m": 2e-5}}
    place = from_document(with_changes(PLANT_FILE, **told)).at()
    assert_allclose(values("position_resolution", place), 2e-5)
    assert_allclose(values("friction_force", place), 0.1)
    assert_allclose(values("rigid_mass", place), 0.32)


def test_the_bundled_devices_continuous_force_is_what_its_source_gives():
    """Nominal current times torque constant, geared, along y where the handle's lever is in closed form."""
    place = load("five-bar").at()
    lever = np.abs(place.lever_arms)
    torque = 0.659 * 0.0502 * 18.6
    assert_allclose(values("continuous_force", place), torque / lever.max(), rtol=1e-3)
    with pytest.raises(MeasureError, match=r"give mechanism\.drives\.motor-right\.torque_limit_Nm"):
        evaluate(find_measure("peak_force"), place)


def test_drives_that_leave_joints_free_have_no_largest_force():
    place = load("da-vinci-mtm").at()
    assert place.drive_side.motion.shape[-1] > place.drive_side.driven
    with pytest.raises(MeasureError):
        place.measure("peak_force")
