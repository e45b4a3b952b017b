"""Motions that nothing couples to the wall, and responses of modes one by one and together."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.guarantees import passive_region, without_idle_motions
from zwidth.guarantees.port import _coupled_response, _modal_response, port
from zwidth.loop import Controller, Loop
from zwidth.model import Plant

T = 1e-3


def masses(link=0.1, motor=0.02, stiffness=2e4, ratio=0.04):
    """A motor, read and pushed, a spring that is damped in its mode, and a link that is held."""
    tension = np.outer([1.0, -1.0], [1.0, -1.0])
    damper = 2.0 * ratio * np.sqrt(stiffness * link * motor / (link + motor))
    motor_side, link_side = np.eye(2)
    K, B = stiffness * tension, damper * tension + np.diag([0.3, 0.0])
    return Plant(np.diag([motor, link]), B, K, motor_side, motor_side, link_side)


def beside(plant, frequency, drag, coupling=0.0):
    """The plant with one more vibration, which a damper may couple to the first mass; turned, so that no
    coordinate is a mode."""
    n = plant.size

    def grown(matrix, corner):
        out = np.zeros((n + 1, n + 1))
        out[:n, :n], out[n, n] = matrix, corner
        return out

    B = grown(plant.damping, drag)
    way = np.zeros(n + 1)
    way[[0, n]] = 1.0, -1.0
    Q = np.linalg.qr(np.random.default_rng(3).normal(size=(n + 1, n + 1)))[0]
    ends = {name: np.append(getattr(plant, name), 0.0) for name in ("actuator", "sensor", "handle")}
    large = Plant(
        grown(plant.mass, 0.01),
        B + coupling * np.outer(way, way),
        grown(plant.stiffness, 0.01 * (2.0 * np.pi * frequency) ** 2),
        **ends,
    )
    return large.on_motions(Q)


def passive(plant):
    """Largest stiffness that is stable whatever passive operator holds the handle [N/m]."""
    return passive_region(Loop(without_idle_motions(plant), Controller(T))).stiffness_max


@pytest.mark.parametrize(("frequency", "drag"), [(40.0, 0.02), (3e3, 0.0), (4e4, 1.0)])
def test_a_vibration_that_nothing_couples_changes_nothing(frequency, drag):
    small = masses()
    large = beside(small, frequency, drag)
    assert without_idle_motions(large).size == 2
    assert passive(large) == pytest.approx(passive(small), rel=1e-7)


def test_a_vibration_that_a_damper_couples_counts():
    small = masses()
    large = beside(small, 40.0, 0.02, coupling=0.1)
    assert without_idle_motions(large).size == 3
    assert abs(passive(large) / passive(small) - 1.0) > 1e-3


def test_modes_one_by_one_respond_as_they_do_together():
    rng = np.random.default_rng(8)
    for n in (1, 3, 9):
        w0, ratios = 2.0 * np.pi * np.geomspace(1.0, 2e4, n), rng.uniform(0.0, 1.5, n)
        a, s, h = rng.normal(size=(3, n))
        plant = Plant(np.eye(n), np.diag(2.0 * ratios * w0), np.diag(w0**2), a, s, h)
        held = port(plant, h)
        w = np.sort(rng.uniform(0.5, 2e5, 200))
        for one, other in zip(_modal_response(held, w), _coupled_response(held, w), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-12 * np.max(np.abs(other)))
