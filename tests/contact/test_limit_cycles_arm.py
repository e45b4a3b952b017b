"""Limit cycles of a planar arm with two flexible drives: many small matrices, and motors that friction holds."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from tests.systems import mass
from zwidth.chart import eigenvalues
from zwidth.contact.describing_functions import damper_gain
from zwidth.contact.harmonic_balance import harmonic_balance
from zwidth.device.load import load
from zwidth.loop import Controller, Loop

ARM = """
name = "Arm on a bench"

[[mechanism.links]]
name = "first"
joint = "revolute"
length_m = 0.21
mass_kg = 0.16
center_of_mass_m = [0.1]
inertia_kg_m2 = 7e-4

[[mechanism.links]]
name = "second"
parent = "first"
joint = "revolute"
length_m = 0.17
mass_kg = 0.08
center_of_mass_m = [0.07]
inertia_kg_m2 = 3e-4

[mechanism.handle]
link = "second"

[mechanism.assemblies.right]
joints_rad = { first = 0.6, second = 1.6 }

[mechanism.reference]
position_m = [0.08, 0.24]
direction = [0.0, 1.0]

[[mechanism.drives]]
name = "shoulder"
joint = "first"
motor_inertia_kg_m2 = 3.4e-6
transmission_ratio = 12.0
stiffness_Nm_per_rad = 0.8
encoder_counts_per_rev = 4096
coulomb_Nm = 0.002
torque_limit_Nm = 0.15

[[mechanism.drives]]
name = "elbow"
joint = "second"
motor_inertia_kg_m2 = 1.6e-6
transmission_ratio = 10.0
stiffness_Nm_per_rad = 0.5
encoder_counts_per_rev = 4096
coulomb_Nm = 0.002
torque_limit_Nm = 0.1

[mechanism.damping]
mode_ratio = 0.04

[loop]
sampling_period_s = 0.001
delay_s = 0.0005
"""
WALL = (2000.0, 1.0)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """The loop of the arm at its reference."""
    file = tmp_path_factory.mktemp("arm") / "arm.toml"
    file.write_text(ARM)
    device = load(str(file))
    return device.at().loop


@pytest.fixture(scope="module")
def balance(arm):
    """Its vibrations with encoders as fine as you like."""
    return harmonic_balance(arm, *WALL, resolution=0.0, amplitudes=(1e-5, 1e-3))


def test_a_search_makes_its_matrices_itself(monkeypatch):
    """A library shares even a matrix of five rows among threads, which then wait for each other."""
    calls = []
    whole = scipy.linalg.expm
    monkeypatch.setattr(scipy.linalg, "expm", lambda matrix: calls.append(1) or whole(matrix))
    harmonic_balance(Loop(mass(0.1, 0.1), Controller(0.001)), 400.0, 0.0, coulomb_friction=0.01, force_limit=1.0)
    assert len(calls) < 10


def test_a_vibration_is_found_where_friction_holds_a_motor(balance):
    """The smaller it is the more motors stand, at velocities that tend to 0; its growth goes on without a gap."""
    assert np.isfinite(balance.growth).all()
    steps = np.abs(np.diff(balance.growth))
    assert np.max(steps) < 15.0


def test_the_edge_of_what_is_recovered_from_has_a_root_on_the_circle(arm, balance):
    """Against the eigenvalues of the linear loop with dampers in place of both frictions."""
    (cycle,) = balance.cycles
    damping = arm.plant.damping.copy()
    for friction, velocity in zip(arm.plant.nonlinear.friction, cycle.velocity_amplitudes, strict=True):
        b = float(damper_gain(friction.coulomb, velocity))
        damping += b * np.outer(friction.along, friction.along)
    roots = eigenvalues(Loop(replace(arm.plant, damping=damping), arm.controller), *WALL)
    on_circle = np.exp(2j * np.pi * cycle.frequency_Hz * arm.period)
    assert not cycle.stable
    assert np.min(np.abs(roots - on_circle)) < 5e-7


def test_a_search_says_how_far_it_is(arm):
    told = []
    harmonic_balance(
        arm, *WALL, resolution=0.0, amplitudes=(1e-4, 1e-3), progress=lambda *so_far: told.append(so_far)
    )
    stages, done, of = zip(*told, strict=True)
    (stage,) = set(stages)
    assert stage.endswith(" amplitude")
    assert list(done) == sorted(done)
    assert done[0] == 0
    assert done[-1] == of[-1] == of[0] > 20
