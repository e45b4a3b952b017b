"""Velocity filters against scipy.signal and the thesis's coefficients."""

import numpy as np
import pytest
import scipy.signal

from tests.systems import velocity_filter
from zwidth.loop import Butterworth, Controller, FirstOrder
from zwidth.loop.loop_table import velocity_estimator


def response(controller, z):
    estimator = velocity_estimator(controller)
    d = (z - 1.0)[:, None]
    top = (estimator.numerator[:, 0] * d + estimator.numerator[:, 1]) * d + estimator.numerator[:, 2]
    bottom = (estimator.denominator[:, 0] * d + estimator.denominator[:, 1]) * d + estimator.denominator[:, 2]
    return np.prod(top / bottom, axis=1)


@pytest.mark.parametrize("rule", ["tustin", "tustin-prewarped"])
@pytest.mark.parametrize("order", [1, 2, 3, 4, 7])
@pytest.mark.parametrize("share", [0.02, 0.3, 0.95])
def test_butterworth_is_scipys_bilinear_transform(order, share, rule):
    controller = Controller(0.001, 0.0, Butterworth(order, share * 500.0, rule))
    z = np.exp(1j * np.linspace(0.01, 3.0, 40))
    _, want = scipy.signal.sosfreqz(velocity_filter(controller), np.angle(z))
    assert response(controller, z) == pytest.approx(want * (1.0 - 1.0 / z) / 0.001, rel=1e-9, abs=1e-12)


def test_second_order_coefficients_are_the_thesiss():
    # (3.18)-(3.19) with zeta = 1/sqrt 2, W = w_c T
    T, W = 0.00125, 2.0 * np.pi * 20.0 * 0.00125
    lead = W**2 + 2.0 * np.sqrt(2.0) * W + 4.0
    d1, d2 = 2.0 * (W**2 - 4.0) / lead, (W**2 - 2.0 * np.sqrt(2.0) * W + 4.0) / lead
    z = np.exp(1j * np.array([0.1, 1.0, 3.0]))
    G = W**2 / lead * (z**2 + 2.0 * z + 1.0) / (z**2 + d1 * z + d2)
    got = response(Controller(T, 0.0, Butterworth(2, 20.0)), z)
    assert got == pytest.approx(G * (1.0 - 1.0 / z) / T, rel=1e-12)


def test_first_order_is_backward_euler():
    T, tau = 0.001, 0.004
    a = tau / (tau + T)
    z = np.exp(1j * np.array([0.1, 1.0, 3.0]))
    got = response(Controller(T, 0.0, FirstOrder(tau)), z)
    assert got == pytest.approx((1.0 - a) * z / (z - a) * (1.0 - 1.0 / z) / T, rel=1e-13)


def test_prewarping_puts_the_half_power_point_at_the_cutoff():
    controller = Controller(0.001, 0.0, Butterworth(3, 400.0, "tustin-prewarped"))
    z = np.exp(1j * np.array([2.0 * np.pi * 0.4]))
    gain = abs(response(controller, z) / ((1.0 - 1.0 / z) / 0.001))
    assert gain == pytest.approx(np.sqrt(0.5), rel=1e-12)
