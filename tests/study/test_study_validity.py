"""Which model where: distances between edges, and the frequencies up to which a model may be trusted."""

from __future__ import annotations

import numpy as np
import pytest

from tests.systems import mass, published
from zwidth.chart import BoundaryArc, stability_chart
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.loop import Controller, Loop
from zwidth.study import validity
from zwidth.study.model_validity import edge_distance

K_E, M1, M2 = 15620.0, 0.2616, 0.0254


class ChartOfArcs:
    def __init__(self, *arcs):
        self.boundary = [BoundaryArc(*np.array(arc, dtype=float)) for arc in arcs]


def fits(found):
    return {fit.key: fit for fit in found.fits}


@pytest.mark.parametrize("seed", range(5))
def test_the_distance_to_random_walks_is_that_of_ten_thousand_points(seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(0.5, 5.0, (3, 6))
    walls = rng.uniform(0.5, 5.0, (4, 3))
    share = np.linspace(0.0, 5.0, 50001)
    dense = np.array([np.interp(share, np.arange(6.0), row) for row in corners])
    for wall, distance in zip(walls, edge_distance(walls, ChartOfArcs(corners)), strict=True):
        brute = np.abs(dense / wall[:, None] - 1.0).max(axis=0).min()
        assert distance <= brute + 1e-12
        assert distance == pytest.approx(brute, abs=2e-3)


def test_edges_that_merely_cross_are_not_alike():
    crossing = ChartOfArcs(([90.0, 110.0], [10.0, 10.0], [300.0, 300.0]))
    assert edge_distance(np.array([[100.0, 10.0, 20.0]]), crossing)[0] == pytest.approx(14.0)
    assert edge_distance(np.array([[100.0, 10.0, 290.0]]), crossing)[0] == pytest.approx(300.0 / 290.0 - 1.0)


def test_a_chart_is_no_distance_from_itself():
    chart = stability_chart(published(), decay=False)
    arc = chart.boundary[np.argmax([np.ptp(arc.frequency) for arc in chart.boundary])]
    walls = np.column_stack([arc.stiffness, arc.damping, arc.frequency])
    assert edge_distance(walls[(walls > 0.0).all(axis=1)], chart).max() < 1e-12


def test_a_scaled_mass_is_off_by_its_scale():
    """K and B of the free mass are proportional to it, at the same frequencies: e is exactly the share."""
    chart = stability_chart(Loop(mass(0.1), Controller(0.001)), decay=False)
    other = stability_chart(Loop(mass(0.103), Controller(0.001)), decay=False)
    arc = max(chart.boundary, key=lambda arc: np.ptp(arc.frequency))
    walls = np.column_stack([arc.stiffness, arc.damping, arc.frequency])[5:-5]
    distance = edge_distance(walls, other)
    assert np.all(distance <= 0.03 + 1e-6)
    assert np.median(distance) > 0.005


def test_slow_vibrations_see_one_mass_and_fast_ones_the_motor_on_its_spring():
    """Fig. 4.4 of the thesis: the two ends of the edge."""
    found = validity(load("published-two-mass").at())
    of = fits(found)
    assert found.first_natural == pytest.approx(130.727, abs=1e-3)
    ((low, high),) = of["rigid"].valid_ranges
    assert (low, high) == (found.frequency[0], pytest.approx(20.2922, abs=0.01))
    ((low, high),) = of["motor-mass"].valid_ranges
    assert (low, high) == (pytest.approx(144.943, abs=0.01), found.frequency[-1])
    assert "two-mass" not in of  # the plant is this model already
    assert of["motor-mass-undamped"].valid_ranges == ()


def test_the_rigid_model_leaves_the_tolerance_where_its_impedance_does():
    """At low frequency h = -1/P is m w^2 (1 + m1 w^2/k + ...): the same frequency bounds the error from above."""
    found = validity(load("published-two-mass").at(), tolerance=0.02)
    limit = fits(found)["rigid"].valid_ranges[0][1]
    error = (M1**2 / (M1 + M2)) * (2 * np.pi * limit) ** 2 / K_E
    assert 0.02 < error < 0.08  # e may trade stiffness, damping and frequency against each other
    wider = fits(validity(load("published-two-mass").at(), tolerance=0.1))["rigid"].valid_ranges[0][1]
    assert wider > limit


def test_a_stiffer_drive_keeps_the_rigid_model_valid_further():
    ends = []
    for factor in (1.0, 4.0):
        k = factor * K_E
        changed = load("published-two-mass", [("plant.stiffness_N_per_m", [[k, -k], [-k, k]])])
        found = validity(changed.at())
        ends.append(fits(found)["rigid"].valid_ranges[0][1] / found.first_natural)
    assert ends[1] == pytest.approx(ends[0], rel=0.1)  # the same share of twice the natural frequency


def test_the_five_bar_has_all_models_and_says_where():
    found = validity(load("five-bar").at())
    of = fits(found)
    assert list(of) == ["rigid", "motor-mass", "motor-mass-undamped", "two-mass", "two-mass-undamped"]
    assert of["two-mass"].error.max() == pytest.approx(0.113, abs=0.006)  # largest beside an axis
    assert not of["two-mass"].everywhere
    assert fits(validity(load("five-bar").at(), tolerance=0.2))["two-mass"].everywhere
    assert np.all(np.diff(found.frequency) >= 0.0)


def test_a_rigid_device_has_no_simpler_models():
    found = validity(load("hapkit-course").at())
    assert np.isnan(found.first_natural)
    assert "rigid" not in fits(found)
    assert all(fit.reason and fit.valid_ranges == () and not fit.everywhere for fit in found.fits)


def test_a_device_that_renders_nothing_is_nowhere_like_its_models():
    found = validity(load("published-two-mass", ["plant.damping_Ns_per_m=unset", "loop.delay_samples=1"]).at())
    assert len(found.frequency) == 0
    assert all(fit.valid_ranges == () and not fit.everywhere for fit in found.fits)


def test_without_a_handle_the_sided_models_say_why():
    plant = {
        "mass_kg": [[0.3, 0.0], [0.0, 0.1]], "damping_Ns_per_m": [[5.0, -5.0], [-5.0, 5.0]],
        "stiffness_N_per_m": [[9e3, -9e3], [-9e3, 9e3]], "actuator": [0.0, 1.0], "sensor": [0.0, 1.0],
    }  # fmt: skip
    of = fits(validity(from_document({"name": "n", "plant": plant, "loop": {"sampling_period_s": 0.001}}).at()))
    assert "no handle" in of["two-mass"].reason
    assert of["rigid"].valid_ranges
