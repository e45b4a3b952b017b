"""From mechanisms and plants to the rendered direction: against formulas written out with other means."""

from dataclasses import replace

import numpy as np
import pytest
import sympy
from scipy.linalg import eigh, null_space

from tests.model.model_cases import KINDS, Y, five_bar, some_postures
from zwidth.errors import ModelError
from zwidth.model import (
    GivenDamping,
    ModalDamping,
    Plant,
    ProportionalDamping,
    effective_parameters,
    natural_frequencies,
    plant_effective_parameters,
    reduce_mechanism,
    reduce_plant,
    solve_posture,
)

FIVE_PERCENT = ModalDamping(0.05)
AVERAGE = (0.40, 0.65)


def at_reference(**changes):
    mechanism = five_bar(**changes)
    return mechanism, solve_posture(mechanism, (0.0, 0.25))


def random_case(kind, seed):
    """A mechanism with random drives, one of its postures, and a direction its handle can move in."""
    rng = np.random.default_rng(seed)
    mechanism = KINDS[kind](rng)
    d = len(mechanism.drives.joint)
    drives = replace(
        mechanism.drives,
        motor_inertia=rng.uniform(1e-7, 1e-5, d),
        transmission=rng.uniform(5, 30, d),
        stiffness=rng.uniform(0.1, 5, d),
        damping=rng.uniform(1e-5, 1e-3, d),
    )
    mechanism = replace(mechanism, drives=drives)
    posture = solve_posture(mechanism, some_postures(mechanism, rng, 1).position[0])
    direction = posture.jacobian @ rng.normal(size=d)
    return mechanism, posture, direction / np.linalg.norm(direction)


# --- the thesis's numbers -----------------------------------------------------------------------------


def test_effective_masses_of_table_3_4():
    """Printed 0.2616 and 0.0254 kg; the digits are those of an independent computation."""
    mechanism, posture = at_reference()
    found = effective_parameters(mechanism, posture, Y)
    assert found.link_side_mass == pytest.approx(0.261599, abs=5e-7)
    assert found.motor_side_mass == pytest.approx(0.025367, abs=5e-7)
    assert found.rigid_mass == pytest.approx(0.286967, abs=5e-7)
    assert found.stiffness == pytest.approx(11793, abs=0.5)


@pytest.mark.parametrize(
    ("stiffness", "first", "second"), [((0.45, 0.75), 101.31, 130.80), (AVERAGE, 95.51, 121.77)]
)
def test_flexible_frequencies(stiffness, first, second):
    """Printed 101 and 131 Hz with the largest stiffnesses, 95 and 120 Hz with the average ones."""
    mechanism, posture = at_reference(stiffness=stiffness)
    frequencies = natural_frequencies(reduce_mechanism(mechanism, posture, Y, "full", FIVE_PERCENT))
    assert frequencies[:2].tolist() == [0.0, 0.0]
    assert frequencies[2:] == pytest.approx([first, second], abs=0.005)


def test_masses_without_lateral_offsets():
    """With the centres of mass on the links' axes the link side is 0.2656 kg, not what the thesis prints."""
    mechanism, posture = at_reference(eta=(0, 0, 0, 0))
    assert effective_parameters(mechanism, posture, Y).link_side_mass == pytest.approx(0.2656, abs=5e-5)


def test_the_side_of_the_offsets_matters_and_the_side_of_the_stiffnesses_does_not():
    """Distal links bulge away from the device's middle. Mirrored offsets give another mass; a mirrored pair of
    stiffnesses gives the same frequencies along y, since the device is its own mirror image."""
    mechanism, posture = at_reference(eta=(0.0001, 0.0075, -0.0001, -0.0075))
    assert abs(effective_parameters(mechanism, posture, Y).link_side_mass - 0.261599) > 1e-3
    one, two = (
        natural_frequencies(reduce_mechanism(*at_reference(stiffness=s), Y, "full", FIVE_PERCENT))
        for s in ((0.45, 0.75), (0.75, 0.45))
    )
    assert one == pytest.approx(two, rel=1e-12)


def test_leaving_out_the_inertial_coupling_of_the_rotors_costs_little_here():
    """(2.21) leaves it out. The motors ride on the driven arms: a rotor turns by phi + n theta in space.

        T = I (phi' + n theta')^2 / 2:   I on the links, n I between, n^2 I on the motors

    A device with rigid drives turns its rotors by (1 + n) phi: 11 % more rotor, a tenth of the whole. The pulley
    rolls on the outside of the base's sector, so that both turns have one sense.
    """
    mechanism, posture = at_reference()
    drives = mechanism.drives
    plant = reduce_mechanism(mechanism, posture, Y, "full", FIVE_PERCENT)
    inertia, ratio = drives.motor_inertia, drives.transmission
    coupled = plant.mass.copy()
    coupled[:2, :2] += np.diag(inertia)
    coupled[:2, 2:] += np.diag(ratio * inertia)
    coupled[2:, :2] += np.diag(ratio * inertia)
    with_coupling = replace(plant, mass=coupled)
    change = natural_frequencies(with_coupling)[2:] / natural_frequencies(plant)[2:] - 1
    assert change == pytest.approx([0.00451, 0.00453], abs=1e-5)
    before, after = plant_effective_parameters(plant), plant_effective_parameters(with_coupling)
    assert after.rigid_mass / before.rigid_mass - 1 == pytest.approx(0.00976, abs=1e-5)
    assert after.link_side_mass == pytest.approx(before.link_side_mass, rel=1e-12)
    assert after.motor_side_mass / before.motor_side_mass - 1 == pytest.approx(-0.00028, abs=1e-5)


# --- mechanisms ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_effective_parameters_by_constraining_the_motion(kind, seed):
    """A mass along u is twice the least kinetic energy of a unit speed along u; a stiffness, of a deflection."""
    mechanism, posture, u = random_case(kind, seed)
    drives = mechanism.drives
    h, n2 = posture.jacobian.T @ u, drives.transmission**2

    def least(form):
        free, fixed = null_space(h[None]), h / (h @ h)
        inside = np.linalg.solve(free.T @ form @ free, -free.T @ form @ fixed) if free.size else np.zeros(0)
        motion = fixed + free @ inside
        return motion @ form @ motion

    found = effective_parameters(mechanism, posture, u)
    rotors, springs = np.diag(n2 * drives.motor_inertia), np.diag(n2 * drives.stiffness)
    assert found.link_side_mass == pytest.approx(least(posture.mass_matrix), rel=1e-10)
    assert found.motor_side_mass == pytest.approx(least(rotors), rel=1e-10)
    assert found.rigid_mass == pytest.approx(least(posture.mass_matrix + rotors), rel=1e-10)
    assert found.stiffness == pytest.approx(least(springs), rel=1e-10)


def test_effective_parameters_of_a_batch():
    mechanism = five_bar()
    batch = solve_posture(mechanism, [[(0, 0.25), (0.05, 0.2)], [(0.4, 0.4), (-0.1, 0.2)]])
    found = effective_parameters(mechanism, batch, Y)
    assert found.rigid_mass.shape == (2, 2)
    assert np.isnan(found.stiffness[1, 0])
    alone = effective_parameters(mechanism, solve_posture(mechanism, (0.05, 0.2)), Y)
    assert found.link_side_mass[0, 1] == pytest.approx(alone.link_side_mass, rel=1e-12)
    across = effective_parameters(mechanism, batch, [0, 0, 1])
    assert np.isinf(across.link_side_mass[0, 0])


@pytest.mark.parametrize("kind", KINDS)
def test_the_full_model_is_lagranges(kind):
    """M, K, B and the participation by differentiating energies and virtual work symbolically."""
    mechanism, posture, u = random_case(kind, 5)
    drives, d = mechanism.drives, len(mechanism.drives.joint)
    phi, theta = sympy.symbols(f"phi:{d}"), sympy.symbols(f"theta:{d}")
    x = [*phi, *theta]
    n = [sympy.Float(v, 30) for v in drives.transmission]
    M = sympy.Matrix(posture.mass_matrix)
    kinetic = (sympy.Matrix(phi).T * M * sympy.Matrix(phi))[0] / 2
    kinetic += sum(drives.motor_inertia[i] * (n[i] * theta[i]) ** 2 / 2 for i in range(d))
    potential = sum(drives.stiffness[i] * (n[i] * (phi[i] - theta[i])) ** 2 / 2 for i in range(d))
    lost = sum(drives.damping[i] * (n[i] * (phi[i] - theta[i])) ** 2 / 2 for i in range(d))

    def hessian(energy):
        return np.array(sympy.hessian(energy, x)).astype(float)

    plant = reduce_mechanism(mechanism, posture, u, "full", GivenDamping())
    assert plant.mass == pytest.approx(hessian(kinetic), rel=1e-12)
    assert plant.stiffness == pytest.approx(hessian(potential), rel=1e-12)
    assert plant.damping == pytest.approx(hessian(lost), rel=1e-12)
    h = posture.jacobian.T @ u
    assert plant.handle == pytest.approx(np.concatenate([h, 0 * h]))
    assert plant.actuator == pytest.approx(np.concatenate([0 * h, h]))
    assert plant.sensor == pytest.approx(plant.actuator)
    assert len(plant.names) == 2 * d


@pytest.mark.parametrize("kind", KINDS)
def test_modal_damping_is_on_every_flexible_mode_and_on_no_rigid_one(kind):
    mechanism, posture, u = random_case(kind, 6)
    plant = reduce_mechanism(mechanism, posture, u, "full", ModalDamping(0.07))
    squares, V = eigh(plant.stiffness, plant.mass)
    modal = V.T @ plant.damping @ V
    d = len(mechanism.drives.joint)
    expected = np.concatenate([np.zeros(d), 2 * 0.07 * np.sqrt(squares[d:])])
    assert modal == pytest.approx(np.diag(expected), abs=1e-7 * expected.max())


def test_proportional_damping():
    mechanism, posture, u = random_case("five-bar", 8)
    damping = ProportionalDamping(0.3, 1.2e-4)
    for model in ("full", "two-mass"):
        plant = reduce_mechanism(mechanism, posture, u, model, damping)
        assert plant.damping == pytest.approx(0.3 * plant.mass + 1.2e-4 * plant.stiffness, rel=1e-12)
    motor = reduce_mechanism(mechanism, posture, u, "motor-mass", damping)
    assert motor.damping == pytest.approx(0.3 * motor.mass + 1.2e-4 * motor.stiffness, rel=1e-12)
    rigid = reduce_mechanism(mechanism, posture, u, "rigid", damping)
    assert rigid.damping == pytest.approx(0.3 * rigid.mass, rel=1e-12)


def test_reduced_models_of_the_five_bar():
    """b = 2 zeta sqrt(k mu): the mode of the pair has the ratio, and the motor-mass model the same damper."""
    mechanism, posture = at_reference()
    two, motor, rigid = (
        reduce_mechanism(mechanism, posture, Y, m, FIVE_PERCENT) for m in ("two-mass", "motor-mass", "rigid")
    )
    squares, V = eigh(two.stiffness, two.mass)
    assert (V.T @ two.damping @ V)[1, 1] == pytest.approx(2 * 0.05 * np.sqrt(squares[1]), rel=1e-10)
    assert two.actuator.tolist() == two.sensor.tolist() == [0.0, 1.0]
    assert two.handle.tolist() == [1.0, 0.0]
    assert motor.size == rigid.size == 1
    assert motor.damping[0, 0] == two.damping[0, 0]
    assert motor.stiffness[0, 0] == two.stiffness[0, 0]
    assert motor.mass[0, 0] == two.mass[1, 1]
    assert motor.handle is None
    assert rigid.damping[0, 0] == rigid.stiffness[0, 0] == 0.0
    assert rigid.mass[0, 0] == pytest.approx(0.286967, abs=5e-7)


def test_a_rigid_drive_carries_its_rotor_on_the_link():
    """As the limit of an ever stiffer drive: the slow dynamics from motors to handle are the same."""
    mechanism, posture, u = random_case("five-bar", 9)
    stiff, rigid = (
        replace(mechanism, drives=replace(mechanism.drives, stiffness=np.array([0.5, k]))) for k in (1e7, np.inf)
    )
    limit = reduce_mechanism(stiff, posture, u, "full", GivenDamping())
    plant = reduce_mechanism(rigid, posture, u, "full", GivenDamping())
    assert plant.size == 3
    for frequency in (3.0, 80.0, 250.0):
        s = 2j * np.pi * frequency
        one, two = (
            p.sensor @ np.linalg.solve(p.mass * s**2 + p.damping * s + p.stiffness, p.actuator)
            for p in (limit, plant)
        )
        assert one == pytest.approx(two, rel=1e-4)
    both = replace(mechanism, drives=replace(mechanism.drives, stiffness=np.full(2, np.inf)))
    plant = reduce_mechanism(both, posture, u, "full", FIVE_PERCENT)
    assert plant.size == 2
    assert np.all(plant.damping == 0)
    assert 1 / (plant.actuator @ np.linalg.solve(plant.mass, plant.actuator)) == pytest.approx(
        effective_parameters(both, posture, u).rigid_mass
    )


@pytest.mark.parametrize("model", ["two-mass", "motor-mass"])
def test_rigid_drives_have_no_two_mass_model(model):
    mechanism, posture = at_reference(stiffness=(np.inf, np.inf))
    with pytest.raises(ModelError, match=f"'{model}' needs"):
        reduce_mechanism(mechanism, posture, Y, model, FIVE_PERCENT)


@pytest.mark.parametrize(
    ("direction", "words"), [((0, 0, 0), "no length"), ((0, 2, 0), "has length 2"), ((0, 1), "three components")]
)
def test_a_direction_is_a_unit_vector(direction, words):
    mechanism, posture = at_reference()
    with pytest.raises(ValueError, match=words):
        reduce_mechanism(mechanism, posture, direction, "full", FIVE_PERCENT)


def test_questions_that_have_no_model():
    mechanism, posture = at_reference()
    with pytest.raises(ModelError, match="cannot move"):
        reduce_mechanism(mechanism, posture, (0, 0, 1), "full", FIVE_PERCENT)
    with pytest.raises(ValueError, match="'stiff'"):
        reduce_mechanism(mechanism, posture, Y, "stiff", FIVE_PERCENT)
    batch = solve_posture(mechanism, [(0, 0.25), (1, 1)])
    with pytest.raises(ValueError, match="one posture"):
        reduce_mechanism(mechanism, batch, Y, "full", FIVE_PERCENT)


@pytest.mark.parametrize("bad", [-0.1, np.nan, np.inf])
def test_damping_is_at_least_nothing(bad):
    with pytest.raises(ValueError, match="at least 0"):
        ModalDamping(bad)
    with pytest.raises(ValueError, match="at least 0"):
        ProportionalDamping(0.0, bad)


# --- plants -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("damping", [GivenDamping(), ProportionalDamping(0.0, 1e-4)])
@pytest.mark.parametrize("model", ["two-mass", "motor-mass", "rigid"])
def test_a_full_plant_reduces_as_its_mechanism_does(kind, damping, model):
    mechanism, posture, u = random_case(kind, 12)
    full = reduce_mechanism(mechanism, posture, u, "full", damping)
    ours, theirs = reduce_plant(full, model), reduce_mechanism(mechanism, posture, u, model, damping)
    assert ours.mass == pytest.approx(theirs.mass, rel=1e-9)
    assert ours.stiffness == pytest.approx(theirs.stiffness, rel=1e-9)
    assert ours.damping == pytest.approx(theirs.damping, rel=1e-9)
    found, expected = plant_effective_parameters(full), effective_parameters(mechanism, posture, u)
    for name, value in vars(expected).items():
        assert getattr(found, name) == pytest.approx(value, rel=1e-9)


PUBLISHED = Plant(
    mass=np.diag([0.2616, 0.0254]),
    damping=1.8744 * np.array([[1, -1], [-1, 1]]),
    stiffness=15620.0 * np.array([[1, -1], [-1, 1]]),
    actuator=np.array([0.0, 1.0]),
    sensor=np.array([0.0, 1.0]),
    handle=np.array([1.0, 0.0]),
)


def test_a_two_mass_plant_is_its_own_two_mass_model():
    assert reduce_plant(PUBLISHED, "two-mass") is PUBLISHED
    assert reduce_plant(PUBLISHED, "full") is PUBLISHED
    motor, rigid = reduce_plant(PUBLISHED, "motor-mass"), reduce_plant(PUBLISHED, "rigid")
    assert motor.mass.ravel() == pytest.approx([0.0254], rel=1e-14)
    assert motor.stiffness.ravel() == pytest.approx([15620], rel=1e-12)
    assert motor.damping.ravel() == pytest.approx([1.8744], rel=1e-12)
    assert rigid.mass.ravel() == pytest.approx([0.287], rel=1e-12)
    assert rigid.damping[0, 0] == 0.0
    found = plant_effective_parameters(PUBLISHED)
    assert [float(v) for v in vars(found).values()] == pytest.approx([0.2616, 0.0254, 0.287, 15620], rel=1e-12)


def test_a_two_mass_plant_with_drag_and_its_link_side_held_fixed():
    """Rows and columns of the motor side are what is left: b + c of the motor, whatever drags the link."""
    dragged = replace(PUBLISHED, damping=PUBLISHED.damping + np.diag([0.7, 0.2]))
    motor = reduce_plant(dragged, "motor-mass")
    assert motor.damping.ravel() == pytest.approx([1.8744 + 0.2], rel=1e-12)
    assert reduce_plant(dragged, "two-mass") is dragged


def test_other_coordinates_of_the_same_plant_give_the_same_numbers():
    """x = T z with any regular T: handle and motor in mixed coordinates, drag to the ground included."""
    T = np.random.default_rng(4).normal(size=(2, 2))
    drag = np.diag([0.3, 0.2])
    mixed = Plant(
        T.T @ PUBLISHED.mass @ T,
        T.T @ (PUBLISHED.damping + drag) @ T,
        T.T @ PUBLISHED.stiffness @ T,
        T.T @ PUBLISHED.actuator,
        T.T @ PUBLISHED.sensor,
        T.T @ PUBLISHED.handle,
    )
    two = reduce_plant(mixed, "two-mass")
    assert two.mass == pytest.approx(PUBLISHED.mass, rel=1e-9)
    assert two.stiffness == pytest.approx(PUBLISHED.stiffness, rel=1e-9)
    assert two.damping == pytest.approx(PUBLISHED.damping + drag, rel=1e-9)
    motor = reduce_plant(mixed, "motor-mass")
    assert motor.damping == pytest.approx(two.damping[1:, 1:], rel=1e-12)  # the link side held fixed
    assert reduce_plant(mixed, "rigid").damping[0, 0] == pytest.approx(0.5, rel=1e-9)


def single(stiffness=0.0):
    one = np.ones(1)
    return Plant(np.array([[0.05]]), np.zeros((1, 1)), np.array([[stiffness]]), one, one)


def test_a_single_mass_is_its_own_rigid_model_and_has_no_sides():
    plant = single()
    assert reduce_plant(plant, "rigid") is plant
    found = plant_effective_parameters(plant)
    assert found.rigid_mass == pytest.approx(0.05)
    assert np.isnan([found.link_side_mass, found.motor_side_mass, found.stiffness]).all()


@pytest.mark.parametrize("model", ["two-mass", "motor-mass", "rigid"])
def test_a_loss_factor_is_left_out_of_no_model(model):
    plain = single(15.0)
    lossy = replace(plain, hysteresis=0.1 * plain.stiffness)
    assert reduce_plant(lossy, "full") is lossy
    with pytest.raises(ModelError, match="loss factor"):
        reduce_plant(lossy, model)
