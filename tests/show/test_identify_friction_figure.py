"""The figure of an identified joint: what was measured, what was fitted, and the unseen motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import zwidth
from tests.identify.test_friction_joint import JOINT, record
from tests.identify.virtual_joint import records_of
from zwidth.identify import identify_friction
from zwidth.show import figure
from zwidth.show.figures.identify import draw_friction


@pytest.fixture(scope="module")
def identified():
    columns = records_of([replace(JOINT, samples=1500)])[0]
    return identify_friction(zwidth.load("hapkit-course"), [record(columns)])


def test_the_lines_are_the_fitted_friction_and_the_points_lie_about_them(identified):
    made, ax = figure()
    draw_friction(ax, identified)
    lines = {line.get_label(): line.get_xydata() for line in ax.get_lines()}
    forward, backward = lines["fitted forward"], lines["fitted backward"]
    assert forward[0] == pytest.approx([0.0, identified["level forward"].value])
    assert backward[0] == pytest.approx([0.0, -identified["level backward"].value])
    slope = (forward[1, 1] - forward[0, 1]) / forward[1, 0]
    assert slope == pytest.approx(identified["viscous friction forward"].value)
    v, f = lines["measured: force less inertia"].T
    fitted = np.where(v > 0.0, forward[0, 1], backward[0, 1]) + slope * v
    assert np.median(np.abs(f - fitted)) < 0.15 * identified["level forward"].value
    (inset,) = ax.child_axes
    measured, predicted = (line.get_ydata() for line in inset.get_lines())
    assert np.max(np.abs(measured - predicted)) < 5.0 * JOINT.step
    made.canvas.draw()


def test_plot_draws_friction_and_mass_alike(identified):
    for result in (identified, replace(identified, kind="mass")):
        _, ax = figure()
        assert "fitted forward" in [line.get_label() for line in result.plot(ax).get_lines()]
