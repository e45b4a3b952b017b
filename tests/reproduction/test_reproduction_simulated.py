"""The gallery's simulations: what they show of Figs. 3.10 and 5.12 to 5.14."""

from __future__ import annotations

import numpy as np
import pytest
from later import Later

regions = Later("gallery.fig_3_10_points")
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
