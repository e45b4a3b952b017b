"""The bundled devices, and what a loaded device gives: arrays, postures, plants."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.device.device_cases import ARM_FILE, PLANT_FILE, with_changes
from zwidth.device import address, build_mechanism, bundled, bundled_names, from_document
from zwidth.device.load import load
from zwidth.device.read import read
from zwidth.errors import DeviceError
from zwidth.model import GivenDamping, ModalDamping, ProportionalDamping, pack
from zwidth.model.handle_position import joint_mass_matrix


@pytest.mark.parametrize("name", bundled_names())
def test_every_group_of_numbers_has_its_source(name):
    """A number's source stands at its own path or at one that it lies in, * being any step."""
    document, _ = read(name)
    sources = load(name).sources
    covered = {path for source in sources for path in _matching_addresses(document, source)}
    bare = [path for path in address.numeric_addresses(document) if path not in covered]
    assert bare == []


def _matching_addresses(document, source):
    """Dotted paths of the numbers that a source speaks of."""
    wanted = source.split(".")
    for path in address.numeric_addresses(document):
        parts = path.split(".")
        if len(parts) >= len(wanted) and all(w in ("*", p) for w, p in zip(wanted, parts, strict=False)):
            yield path


@pytest.mark.parametrize(("name", "description", "source"), bundled())
def test_the_listing_is_what_loading_says(name, description, source):
    device = load(name)
    assert (device.description, device.source) == (description, source)
    assert description
    assert source
    assert "\n" not in description + source


def test_the_published_plant():
    device = load("published-two-mass")
    plant = device.at().plant
    assert plant is device.given_plant
    assert plant.mass.tolist() == [[0.2616, 0.0], [0.0, 0.0254]]
    assert plant.damping == pytest.approx(0.00012 * plant.stiffness)
    assert math.sqrt(15620 * (1 / 0.2616 + 1 / 0.0254)) / (2 * math.pi) == pytest.approx(131, abs=0.5)
    assert plant.actuator.tolist() == plant.sensor.tolist() == [0.0, 1.0]
    assert device.controller.sampling_period == 0.00125


def test_one_coordinate_is_driven_read_and_held():
    plant = load("hapkit-course").at().plant
    assert (plant.mass.item(), plant.damping.item(), plant.stiffness.item()) == (0.03, 1.0, 0.0)
    assert plant.actuator.tolist() == plant.sensor.tolist() == plant.handle.tolist() == [1.0]


def test_no_handle_is_made_up_for_several_coordinates():
    assert from_document(with_changes(PLANT_FILE)).at().plant.handle is None


def test_effective_masses_of_the_device_of_the_thesis():
    """Link side 0.261599 kg, motor side 0.025367 kg, both 0.286967 kg at (0, 0.25) m along y.

    m = 1/(u^T J M^-1 J^T u) with M of the links, of the rotors, of both (thesis eq. 2.18-2.20, 2.28).
    """
    device = load("five-bar")
    posture = device.at().posture
    u, J = device.direction(), posture.jacobian
    drives = device.mechanism.drives
    rotors = np.diag(drives.motor_inertia * drives.transmission**2)

    def felt(M):
        return 1 / (u @ J @ np.linalg.solve(M, J.T @ u))

    assert felt(posture.mass_matrix) == pytest.approx(0.261599, abs=5e-7)
    assert felt(rotors) == pytest.approx(0.025367, abs=5e-7)
    assert felt(posture.mass_matrix + rotors) == pytest.approx(0.286967, abs=5e-7)
    # the printed 101 and 131 Hz, from the largest stiffnesses
    K = np.diag(drives.stiffness * drives.transmission**2)
    flexible = np.linalg.eigvals(np.linalg.solve(posture.mass_matrix, K) + np.linalg.solve(rotors, K))
    assert np.sort(np.sqrt(flexible)) / (2 * np.pi) == pytest.approx([101.31, 130.80], abs=0.005)


@pytest.mark.parametrize("assembly", ["elbows-out", "elbows-in", "elbows-right", "elbows-left"])
def test_the_elbows_are_where_the_assembly_says(assembly):
    """With the base joints apart every assembly exists; a right elbow lies right of its arm's chord."""
    apart = ["links.upper-right.origin_m=[0.02, 0, 0]", "links.upper-left.origin_m=[-0.02, 0, 0]"]
    device = load("five-bar", apart)
    posture = device.at(assembly=assembly).posture
    passive = dict(zip(device.mechanism.links.names, posture.angles, strict=True))
    right, left = passive["distal-right"] > 0, passive["distal-left"] > 0  # turning left: the elbow is right
    wanted = {"elbows-out": (True, False), "elbows-in": (False, True)}
    wanted |= {"elbows-right": (True, True), "elbows-left": (False, False)}
    assert (right, left) == wanted[assembly]


@pytest.mark.parametrize("seed", range(5))
def test_what_a_file_is_checked_by_agrees_with_the_solver(seed):
    """The mass matrix of all joints, loops cut, moved as the closed loops let it, is that of the drives."""
    rng = np.random.default_rng(seed)
    device = load("five-bar")
    mechanism = device.mechanism
    place = [rng.uniform(-0.1, 0.1), rng.uniform(0.15, 0.3)]
    posture = device.at(place).posture
    joint, step = pack(mechanism).joint, 1e-5
    columns = []
    for move in posture.jacobian[:2].T * step:
        ahead, behind = (device.at(place + sign * move).posture.angles[joint] for sign in (1, -1))
        columns.append((ahead - behind) / (2 * step))
    motions = np.array(columns).T
    M = motions.T @ joint_mass_matrix(mechanism, posture.angles) @ motions
    assert pytest.approx(posture.mass_matrix, rel=1e-6) == M


@pytest.mark.parametrize("seed", range(5))
def test_orientation_is_roll_then_pitch_then_yaw_about_fixed_axes(seed):
    angles = np.random.default_rng(seed).uniform(-3, 3, 3)
    assert build_mechanism.roll_pitch_yaw(angles) == pytest.approx(
        Rotation.from_euler("xyz", angles).as_matrix(), abs=1e-12
    )


def test_defaults_of_a_mechanism():
    mechanism = from_document(with_changes(ARM_FILE)).mechanism
    links, drives = mechanism.links, mechanism.drives
    assert links.origin.tolist() == [[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]  # the parent's tip
    assert mechanism.handle_point.tolist() == [0.2, 0.0, 0.0]
    assert links.inertia[0].tolist() == np.diag([0.0, 0.0, 0.0004]).tolist()
    assert drives.stiffness.tolist() == [0.5, math.inf]
    assert np.isnan(drives.torque_constant).all()
    assert np.isnan(mechanism.workspace).all()
    assert mechanism.closures.point_a.shape == (0, 3)


def test_links_may_stand_in_any_order():
    document = with_changes(ARM_FILE)
    document["mechanism"]["links"].reverse()
    assert from_document(document).mechanism.links.names == ("upper", "lower")


def test_an_axis_of_any_length_is_made_a_unit_vector():
    axis = from_document(with_changes(ARM_FILE, mechanism__links__0__axis=[0, 0, -1e-300])).mechanism.links.axis[0]
    assert axis.tolist() == [0.0, 0.0, -1.0]


@pytest.mark.parametrize(
    ("section", "kind", "numbers"),
    [
        ({"mode_ratio": 0.05}, ModalDamping, (0.05,)),
        ({"stiffness_coefficient_s": 1e-4}, ProportionalDamping, (0.0, 1e-4)),
        ({"given": True}, GivenDamping, ()),
    ],
)
def test_ways_of_damping(section, kind, numbers):
    device = from_document(with_changes(ARM_FILE, mechanism__damping=section))
    assert device.damping == kind(*numbers)


# --- postures and directions asked for ----------------------------------------------------------------


def test_a_given_plant_has_no_posture_or_direction():
    device = load("published-two-mass")
    with pytest.raises(DeviceError) as caught:
        device.at([0, 1], direction=[0, 1], assembly="a")
    assert [fault.key for fault in caught.value.faults] == ["at", "direction", "assembly"]
    with pytest.raises(DeviceError, match=r"\[plant\] .*\[mechanism\]"):
        device.position()


def test_two_coordinates_lie_at_the_height_of_the_reference():
    """A device whose plane is z = 0.3 m is asked for by x and y as one whose plane is z = 0."""
    raised = [f"links.upper-{side}.origin_m=[0.0, 0.0, 0.3]" for side in ("left", "right")]
    low, high = load("five-bar"), load("five-bar", [*raised, "reference.position_m=[0.0, 0.25, 0.3]"])
    assert high.position([0.05, 0.2]).tolist() == [0.05, 0.2, 0.3]
    assert high.position([0.05, 0.2, 0.1]).tolist() == [0.05, 0.2, 0.1]
    assert high.position().tolist() == [0.0, 0.25, 0.3]
    posture = high.at([0.05, 0.2]).posture
    assert posture.position.tolist() == [0.05, 0.2, 0.3]
    assert posture.angles == pytest.approx(low.at([0.05, 0.2]).posture.angles, abs=1e-12)
    assert high.direction([1, 0]).tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize(("direction", "unit"), [([0, 3], [0, 1, 0]), ([1e-200, 1e-200, 0], [0.5**0.5] * 2 + [0])])
def test_a_direction_may_have_any_length(direction, unit):
    assert load("five-bar").direction(direction) == pytest.approx(np.array(unit, dtype=float))


@pytest.mark.parametrize("settings", [["reference.position_m=[0.34, 0.34]", "workspace=unset"], []])
def test_a_posture_out_of_reach_is_no_fault_of_the_file(settings):
    """It loads: other postures may be asked for. The posture asked for has no answer."""
    from zwidth.errors import OutOfReach

    device = load("five-bar", settings)
    with pytest.raises(OutOfReach):
        device.at(None if settings else [0.5, 0.5])


def test_arms_that_lie_on_each_other_are_not_driven():
    """With the base joints in one place and both elbows on one side the drives turn the arms as one."""
    from zwidth.errors import Singular

    with pytest.raises(Singular, match="other joints"):
        load("five-bar").at(assembly="elbows-left")


@pytest.mark.parametrize("model", [None, "full", "two-mass", "motor-mass", "rigid"])
def test_every_model_of_the_bundled_devices(model):
    for name in ("five-bar", "published-two-mass"):
        plant = load(name).at(model=model).plant
        n = plant.size
        assert plant.mass.shape == plant.damping.shape == plant.stiffness.shape == (n, n)
        assert n == {None: n, "full": n, "two-mass": 2}.get(model, 1)
