"""How far an unstable wall must be softened, held against eigenvalues."""

from __future__ import annotations

import numpy as np
import pytest

from tests.systems import random_loop
from zwidth.chart.chart import stability_chart
from zwidth.chart.robust.instability import softening, unstable
from zwidth.chart.tracer import Tracer
from zwidth.chart.verdict import spectral_radius


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 5, 7])
def test_softened_by_less_a_wall_is_unstable_and_by_more_stable(seed):
    loop = random_loop(np.random.default_rng(seed))
    chart = stability_chart(loop, decay=False)
    K, B = (1.0 + 0.5 / (seed + 1)) * chart.stiffness_max, chart.damping_at_stiffness_max
    polynomials = Tracer.of(loop).polynomials
    assert unstable(polynomials, np.array([K]), np.array([B])).all()
    by = softening(polynomials, K, B)
    assert 0.0 < by < K
    assert spectral_radius(loop, K - by * (1.0 - 1e-4), B) > 1.0
    assert spectral_radius(loop, K - by * (1.0 + 1e-4), B) < 1.0


def test_a_wall_that_no_softening_helps_is_given_up():
    loop = random_loop(np.random.default_rng(0))
    polynomials = Tracer.of(loop).polynomials
    beyond = 1.5 * stability_chart(loop, decay=False).damping_max
    assert softening(polynomials, 10.0, beyond) == 10.0
