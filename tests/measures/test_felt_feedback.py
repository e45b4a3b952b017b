"""What the hand feels with force feedback and feedforward: at rest, in slow motion, over frequency."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.systems import mass, two_mass
from zwidth.contact import Hand, Tremor, simulate, wall
from zwidth.errors import FeedbackError, MeasureError
from zwidth.loop import (
    Butterworth,
    Controller,
    Feedforward,
    FirstOrder,
    ForceSensor,
    LocalLoop,
    Loop,
    OperatingPoint,
)
from zwidth.measures import felt_chart, felt_impedance, free_motion_mass, static_stiffness
from zwidth.measures.handle_impedance import free_impedance

T = 0.001
DEVICE = two_mass(0.26, 0.04, 15620.0, 3.0)
SENSOR = ForceSensor(1.0, FirstOrder(0.001), 1, mass_beyond=0.06)
AHEAD = Feedforward(0.06, acceleration_filter=Butterworth(2, 12.0))
CASES = {
    "sensor": {"force_sensor": SENSOR},
    "error": {"force_sensor": replace(SENSOR, gain=0.6, law="force-error")},
    "feedforward": {"feedforward": AHEAD},
    "both": {"force_sensor": SENSOR, "feedforward": AHEAD, "delay": 0.3, "force_filter": FirstOrder(0.0004)},
    "lag": {"force_sensor": SENSOR, "actuator_time_constant": 0.0005},
}


@pytest.mark.parametrize("name", CASES)
def test_the_felt_impedance_is_that_of_a_simulated_hand(name):
    """A hand that trembles: its force over the handle's velocity at that frequency, in the engine."""
    loop = Loop(DEVICE, Controller(T, **CASES[name]))
    chart = loop.chart(decay=False)
    K, B, f, size = 0.4 * chart.stiffness_max, chart.damping_at_stiffness_max, 7.0, 1.0
    assert loop.check([K], [B]).names == ["stable"]
    seconds, settled = 6.0, 4.0
    response = simulate(
        loop,
        wall,
        wall.values(stiffness=K, damping=B),
        hand=Hand(tremor=Tremor(size, f)),
        duration=seconds,
        trail=True,
        substeps=10,
    )
    late = response.trail_time > settled
    t, x = response.trail_time[late], response.trail[late]
    w = 2.0 * np.pi * f
    columns = np.stack([np.sin(w * t), np.cos(w * t), np.ones_like(t)], axis=1)
    (a, b, _), *_ = np.linalg.lstsq(columns, x, rcond=None)
    motion = complex(a, b)  # of size sin(w t)
    Z = size / (1j * w * motion)
    assert pytest.approx(complex(felt_impedance(loop, K, B, f)), rel=2e-3) == Z


def test_without_feedback_worth_naming_nothing_changes():
    plain = Loop(DEVICE, Controller(T, 0.4))
    f = np.array([0.5, 5.0, 50.0, 300.0])
    for feedback in ({"force_sensor": ForceSensor(1e-13)}, {"feedforward": Feedforward(damping=1e-13)}):
        loop = Loop(DEVICE, Controller(T, 0.4, **feedback))
        wanted = felt_impedance(plain, 900.0, 5.0, f)
        assert felt_impedance(loop, 900.0, 5.0, f) == pytest.approx(wanted, rel=1e-9)


def test_slow_free_motion_feels_of_less_mass():
    """(m - m_b - inertia)/(1 + g) + m_b."""
    m, beyond, gain, inertia = 0.3, 0.06, 1.0, 0.06
    for sensor, ahead, wanted in (
        (SENSOR, None, (m - beyond) / (1.0 + gain) + beyond),
        (None, AHEAD, m - inertia),
        (SENSOR, AHEAD, (m - beyond - inertia) / (1.0 + gain) + beyond),
    ):
        controller = Controller(T, force_sensor=sensor, feedforward=ahead)
        assert free_motion_mass(DEVICE, controller) == pytest.approx(wanted, rel=1e-12)
        Z = free_impedance(Loop(DEVICE, controller), 0.1)
        assert (Z / (2j * np.pi * 0.1)).real == pytest.approx(wanted, rel=1e-3)
    assert free_motion_mass(DEVICE) == pytest.approx(m)


def test_a_wall_feels_softer_where_the_motors_help_and_as_commanded_under_force_control():
    rigid = mass(0.3)
    helped = Controller(T, force_sensor=ForceSensor(0.5))
    assert float(static_stiffness(rigid, 1000.0, helped)) == pytest.approx(1000.0 / 1.5)
    controlled = Controller(T, force_sensor=ForceSensor(0.5, law="force-error"))
    assert float(static_stiffness(rigid, 1000.0, controlled)) == pytest.approx(1000.0)
    sprung = Controller(T, local_loop=LocalLoop(4, 250.0))
    assert float(static_stiffness(rigid, 1000.0, sprung)) == pytest.approx(1250.0)
    chart = Loop(mass(0.3, 1.0), helped).chart(decay=False)
    assert felt_chart(chart).stiffness_max == pytest.approx(chart.stiffness_max / 1.5)


def test_two_rates_are_refused():
    controller = Controller(T, local_loop=LocalLoop(10, damping=1.0))
    with pytest.raises(FeedbackError, match=r"loop .*10 times"):
        felt_impedance(Loop(DEVICE, controller), 900.0, 5.0, 5.0)
    point = OperatingPoint(controller, given_plant=DEVICE)
    with pytest.raises(FeedbackError, match="leave local_loop out"):
        point.felt(900.0, 5.0)
    with pytest.raises(MeasureError, match="not known"):
        point.measure("free_motion_force", frequency=3.0)


def test_closed_forms_are_refused_with_feedback():
    point = OperatingPoint(Controller(T, feedforward=AHEAD), given_plant=DEVICE)
    with pytest.raises(MeasureError, match="nothing else"):
        point.measure("optimal_spectral_radius", stiffness=900.0, damping=5.0)
    bounds = point.bounds().bounds
    assert all(any("nothing else" in sentence for sentence in each.violated) for each in bounds)
    plain = OperatingPoint(Controller(T), given_plant=DEVICE).bounds().bounds
    assert not any("nothing else" in sentence for each in plain for sentence in each.assumptions)
