"""The fastest-decaying wall that a spring and a damper can be: K >= 0 and B >= 0."""

from __future__ import annotations

import pytest

from tests.systems import mass
from zwidth.chart.chart import stability_chart
from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop


@pytest.mark.xfail(strict=True, reason="only the fastest of all walls is known")
def test_a_grounded_mass_is_fastest_without_a_spring():
    """Its own spring is too stiff: the fastest of all walls softens it, which none with K >= 0 does."""
    chart = stability_chart(Loop(mass(0.1, damping=0.5, stiffness=2e4), Controller(0.001)))
    assert chart.fastest_decay.stiffness < 0.0
    best = chart.fastest_decay_in_first_quadrant
    assert best.stiffness == 0.0
    assert best.damping > 0.0
