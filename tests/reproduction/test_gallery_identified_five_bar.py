"""The thesis's way from deflections and a boundary to the chart finds again what was put into its records."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from gallery import identified_five_bar as gallery


def holds(estimate, truth, room=0.5):
    """Within the interval, widened by half of its width: one of several intervals may just miss."""
    extra = room * (estimate.high - estimate.low)
    return estimate.low - extra <= truth <= estimate.high + extra


@pytest.mark.parametrize("drive", range(2))
def test_table_3_3_comes_back(drive):
    found = gallery.stiffnesses()[drive]
    assert holds(found["largest stiffness"], gallery.LARGEST[drive])
    assert holds(found["average stiffness"], gallery.AVERAGE[drive])
    assert holds(found["dry friction"], gallery.FRICTION)


def test_table_3_4_follows():
    masses = gallery.effective_parameters()
    assert masses.effective.link_side_mass == pytest.approx(0.2616, abs=5e-5)
    assert masses.effective.motor_side_mass == pytest.approx(0.02537, abs=5e-6)
    flexible = [f for f in masses.natural_frequencies if f > 1.0]
    np.testing.assert_allclose(flexible, [101.31, 130.80], rtol=1e-3)


def test_the_damping_comes_back_from_the_boundary():
    found = gallery.damping()
    ratio = found[gallery.PATH]
    assert holds(ratio, gallery.DAMPING)
    assert ratio.high - ratio.low < 0.1 * gallery.DAMPING
    assert found.validation > 0.99
    assert gallery.chart().stiffness_max == pytest.approx(7849.4, rel=0.01)


def test_the_picture_holds_both_steps():
    figure = Figure(figsize=(4.6, 7.0))
    gallery.draw(figure)
    labels = [ax.get_xlabel() for ax in figure.axes]
    assert labels[0].startswith("Angle")
    assert labels[1].startswith("Virtual stiffness")
