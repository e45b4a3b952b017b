"""The gallery's simulations: what they show of Figs. 3.10, 3.12 and 5.12 to 5.14."""

from __future__ import annotations

import numpy as np
import pytest
from later import Later

regions = Later("gallery.fig_3_10_points")
touched = Later("gallery.fig_3_12_one_sided")
optimised = Later("gallery.fig_5_12_before_and_after")


@pytest.mark.parametrize("name", "ABCD")
def test_a_point_of_figure_3_10_grows_as_its_spectral_radius_says(name):
    point = regions.points[name]
    assert point.judged.growth == pytest.approx(np.log(point.radius), abs=1e-5)
    assert point.judged.stable == (point.radius < 1.0)


def test_in_figure_3_10_the_drives_vibrate_above_and_both_masses_together_below():
    assert regions.points["A"].judged.frequency == pytest.approx(203.6, abs=0.1)
    assert regions.points["A"].share == pytest.approx(0.038, abs=0.002)
    assert regions.points["D"].judged.frequency == pytest.approx(17.05, abs=0.02)
    assert regions.points["D"].share == pytest.approx(1.238, abs=0.003)
    assert regions.rigid_frequency == pytest.approx(18.90, abs=0.01)


def test_figures_5_12_to_5_14():
    before, after = (
        [1e3 * each[name].to_a_tenth for name in "BCD"] for each in (optimised.before, optimised.after)
    )
    assert before == pytest.approx([46.25, 228.7, -70.1], abs=0.1)
    assert after == pytest.approx([22.54, 19.56, 17.52], abs=0.01)
    assert optimised.before["D"].judged.behaviour == "growing"
    assert all(optimised.after[name].judged.stable for name in "BCD")


def test_a_pressed_one_sided_wall_has_the_passive_hands_two_sided_edge():
    assert touched.passive == pytest.approx(touched.two_sided, abs=0.06)


def test_a_reflex_lowers_the_edge():
    assert np.all(touched.reflex < touched.passive - 0.3)
    assert touched.passive.min() == pytest.approx(-5.83, abs=0.05)
    assert touched.reflex.min() == pytest.approx(-6.94, abs=0.05)
