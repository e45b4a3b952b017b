"""Small motions of the whole mechanism are those of its linear full model at a wall."""

import numpy as np
import pytest
from scipy.linalg import expm

from tests.contact.mechanism_cases import motion_of, sampled_controller, uncoupled_five_bar, with_drives
from tests.model.model_cases import KINDS
from zwidth.contact import Plane, SurfaceWall
from zwidth.loop import Butterworth, FirstOrder, Loop
from zwidth.model import GivenDamping, ModalDamping, ProportionalDamping, reduce_mechanism, solve_posture

SPEED = 1e-6  # m/s


def linear_readings(plant, controller, wall, velocity, samples, share):
    """Readings of the linear plant, by exponentials of the augmented matrix; the velocity by differences."""
    n, T, f = plant.size, controller.sampling_period, controller.fractional_delay
    lags, tau = len(plant.lagged_dampers), controller.actuator_time_constant
    size = 2 * n + lags + 1
    A = np.zeros((size + 1, size + 1))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n] = -np.linalg.solve(plant.mass, plant.stiffness)
    A[n : 2 * n, n : 2 * n] = -np.linalg.solve(plant.mass, plant.damping)
    A[n : 2 * n, -2 if tau else -1] = np.linalg.solve(plant.mass, plant.actuator)
    for k, damper in enumerate(plant.lagged_dampers):
        A[n : 2 * n, 2 * n + k] = -np.linalg.solve(plant.mass, damper.along)
        A[2 * n + k, n : 2 * n] = damper.damping * damper.along / damper.time_constant
        A[2 * n + k, 2 * n + k] = -1.0 / damper.time_constant
    if tau:
        A[-2, -2], A[-2, -1] = -1.0 / tau, 1.0 / tau
    parts = [expm(A * f * T), expm(A * (1.0 - f) * T)]
    x, readings, forces = np.zeros(size + 1), [], [0.0] * (controller.whole_delay + 2)
    x[n : 2 * n] = velocity
    filtered = before = 0.0
    for j in range(samples + 1):
        y = plant.sensor @ x[:n]
        v = 0.0 if j == 0 else (y - before) / T
        filtered, before = share * filtered + (1.0 - share) * v, y
        forces.insert(0, -(wall.stiffness * y + wall.damping * filtered))
        readings.append(y)
        for part, late in zip(parts, (controller.whole_delay + 1, controller.whole_delay), strict=True):
            x[-1] = forces[late]
            x = part @ x
    return np.array(readings)


def nonlinear_and_linear_readings(
    mechanism, damping, controller, wall, speed, samples=400, share=0.0, at=None, direction=None
):
    """What the handle's reading is, nonlinear and linear, per speed of the start."""
    posture = solve_posture(mechanism, mechanism.reference_position if at is None else at)
    u = posture.jacobian @ np.array([1.0, 0.4, -0.3])[: posture.jacobian.shape[1]]
    u = u / np.linalg.norm(u) if direction is None else np.asarray(direction)
    motion = motion_of(
        mechanism,
        damping,
        controller,
        wall,
        Plane(posture.position, u, two_sided=True),
        at=posture.position,
        duration=samples * controller.sampling_period,
        start_velocity=speed * u,
        substeps=1,
    )
    assert motion.status == "done"
    plant = reduce_mechanism(mechanism, posture, u, "full", damping)
    rates = np.linalg.lstsq(posture.jacobian, u, rcond=None)[0]
    flexible = np.isfinite(mechanism.drives.stiffness)
    linear = linear_readings(plant, controller, wall, np.concatenate([rates, rates[flexible]]), samples, share)
    ours = (motion.counted_position - posture.position) @ u / speed
    return ours, linear


@pytest.mark.parametrize("damping", [ModalDamping(0.05), ProportionalDamping(2.0, 1e-4), GivenDamping()], ids=repr)
@pytest.mark.parametrize("delay", [0.0, 0.3, 2.0, 3.7])
def test_small_motions_are_the_linear_models(damping, delay):
    mechanism = uncoupled_five_bar(damping=2e-4)
    controller = sampled_controller(1.25e-3, delay=delay)
    ours, linear = nonlinear_and_linear_readings(
        mechanism, damping, controller, SurfaceWall(300.0, 2.0), SPEED, at=(0.03, 0.24), direction=(0, 1, 0)
    )
    assert np.max(np.abs(ours - linear)) < 1e-6 * np.max(np.abs(linear))


def test_the_difference_shrinks_with_the_amplitude():
    mechanism, controller = uncoupled_five_bar(), sampled_controller(1.25e-3)
    errors = []
    for speed in (1e-2, 1e-3, 1e-4):
        ours, linear = nonlinear_and_linear_readings(
            mechanism, ModalDamping(0.05), controller, SurfaceWall(800.0, 2.0), speed
        )
        errors.append(np.max(np.abs(ours - linear)) / np.max(np.abs(linear)))
    ratios = np.array(errors[:-1]) / errors[1:]
    assert np.allclose(ratios, 10.0, rtol=0.1)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(2))
def test_random_mechanisms_in_space(kind, seed):
    rng = np.random.default_rng(seed)
    mechanism = with_drives(KINDS[kind](rng), encoder_counts=np.nan)
    if seed:  # one rigid drive
        stiffness = mechanism.drives.stiffness.copy()
        stiffness[0] = np.inf
        mechanism = with_drives(mechanism, stiffness=stiffness)
    controller = sampled_controller(5e-4, delay=0.6)
    ours, linear = nonlinear_and_linear_readings(
        mechanism, ModalDamping(0.1), controller, SurfaceWall(300.0, 1.0), SPEED
    )
    assert np.max(np.abs(ours - linear)) < 1e-6 * np.max(np.abs(linear))


def test_windings_and_a_lagging_actuator():
    winding = {"winding_damping": 3e-5, "winding_time_constant": 2e-3}
    mechanism = with_drives(uncoupled_five_bar(), **winding)
    controller = sampled_controller(1e-3, delay=0.25, actuator_time_constant=8e-4)
    ours, linear = nonlinear_and_linear_readings(
        mechanism, ModalDamping(0.05), controller, SurfaceWall(300.0, 1.0), SPEED
    )
    assert np.max(np.abs(ours - linear)) < 1e-6 * np.max(np.abs(linear))


def test_a_first_order_filter_of_the_velocity():
    controller = sampled_controller(1e-3, velocity_filter=FirstOrder(4e-3))
    ours, linear = nonlinear_and_linear_readings(
        uncoupled_five_bar(), ModalDamping(0.05), controller, SurfaceWall(500.0, 4.0), SPEED, share=0.8
    )
    assert np.max(np.abs(ours - linear)) < 1e-6 * np.max(np.abs(linear))


@pytest.mark.parametrize("order", [1, 2, 3])
def test_growth_follows_the_spectral_radius_through_filters(order):
    """Filters of velocity and force: an unstable wall's motion grows as the loop's largest eigenvalue says."""
    mechanism = uncoupled_five_bar()
    controller = sampled_controller(
        1.25e-3, velocity_filter=Butterworth(order, 60.0), force_filter=Butterworth(order, 150.0), delay=1.0
    )
    posture = solve_posture(mechanism, (0.0, 0.25))
    plant = reduce_mechanism(mechanism, posture, [0.0, 1.0, 0.0], "full", ModalDamping(0.05))
    wall = SurfaceWall(1500.0, 1.0)
    values = np.linalg.eigvals(Loop(plant, controller).transition_matrix(wall.stiffness, wall.damping))
    rho = np.max(np.abs(values))
    assert rho > 1.005
    samples = int(np.log(1e6) / np.log(rho))
    motion = motion_of(
        mechanism,
        ModalDamping(0.05),
        controller,
        wall,
        Plane((0.0, 0.25), (0.0, 1.0), two_sided=True),
        duration=samples * 1.25e-3,
        start_velocity=(0.0, 1e-10),
        substeps=1,
    )
    # a pair's envelope by its own recurrence: y_{j+2} = 2 rho cos(t) y_{j+1} - rho^2 y_j at the end
    y = motion.counted_position[:, 1] - 0.25
    rows = np.stack([y[-60:-1], y[-61:-2]], axis=-1)
    _, minus_squared = np.linalg.lstsq(rows, y[-59:], rcond=None)[0]
    assert np.sqrt(-minus_squared) == pytest.approx(rho, abs=2e-5)
