"""Charts of one wall law over several directions: against single charts, and against matrices built apart."""

import re
from pathlib import Path

import numpy as np
import pytest
import shapely

from tests.multi_loops import as_multi, random_multi, reference_radius, side_by_side
from tests.systems import random_loop, two_mass
from zwidth.chart import circle, largest_stiffness, largest_stiffness_by_direction, multi_chart, stability_chart
from zwidth.device.load import load
from zwidth.loop import Controller, Loop, MultiLoop
from zwidth.model import MultiPlant, reduce_directions, reduce_mechanism

# --- one direction -------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 1, 2, 4, 6, 12, 13, 16, 17, 18])
def test_one_direction_is_the_single_chart(seed):
    loop = random_loop(np.random.default_rng(seed), kind=("chain", "dense", "coupled", "apart")[seed % 4])
    single = stability_chart(loop, decay=False)
    several = multi_chart(MultiLoop(as_multi(loop.plant), loop.controller))
    # a billionth of the set's width is rounding, and may as well be no wall at all
    widest = max((np.ptp(ring[:, 0]) for ring in single.regions), default=0.0)
    reached = np.nan_to_num([several.stiffness_max, single.stiffness_max])
    assert reached[0] == pytest.approx(reached[1], rel=1e-9, abs=1e-9 * widest)
    assert several.damping_max == pytest.approx(single.damping_max, rel=1e-7)
    assert several.stable_area == pytest.approx(single.stable_area, rel=1e-6)


# --- directions that know nothing of each other ----------------------------------------------------------


@pytest.mark.parametrize("turned", [False, True])
def test_uncoupled_directions_give_the_intersection_of_their_charts(turned):
    """Turning the basis of the directions changes nothing: one law for all commutes with it."""
    controller = Controller(0.001, 0.3)
    plants = [two_mass(0.3, 0.03, 2e4, 1.0), two_mass(0.1, 0.08, 5e3, 0.2)]
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]]) if turned else None
    found = multi_chart(MultiLoop(side_by_side(*plants, turn=turn), controller))
    charts = [stability_chart(Loop(plant, controller), decay=False) for plant in plants]
    both = shapely.intersection(*(shapely.union_all([shapely.Polygon(r) for r in c.regions]) for c in charts))
    ours = shapely.union_all([shapely.Polygon(r) for r in found.regions])
    assert shapely.symmetric_difference(ours, both).area < 1e-5 * both.area
    edge = shapely.get_coordinates(both)
    assert found.stiffness_max == pytest.approx(edge[edge[:, 1] >= 0.0, 0].max(), rel=1e-6)


def test_equal_directions_are_as_stiff_as_one():
    """All eigenloci in one: every root of the edge is there three times."""
    controller = Controller(0.00125)
    plant = two_mass(0.2616, 0.0254, 15620.0, 0.00012 * 15620.0)
    found = multi_chart(MultiLoop(side_by_side(plant, plant, plant), controller))
    assert found.stiffness_max == pytest.approx(7133.86929380, rel=1e-9)
    assert found.damping_max == pytest.approx(28.4474336, rel=1e-8)
    assert found.stable_area == pytest.approx(138570.0695, rel=1e-8)


# --- directions that couple ----------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow), 2, 3, 4, 51])
def test_several_directions_agree_with_eigenvalues(seed):
    """Walls all over the chart, by a transition matrix that shares nothing with the package."""
    loop = random_multi(seed)
    chart = multi_chart(loop)
    K0, K1, B0, B1 = chart.box
    scale = np.array([K1 - K0, B1 - B0])
    cells = shapely.union_all([shapely.Polygon(ring / scale) for ring in chart.regions])
    walls = np.random.default_rng(seed).uniform(size=(150, 2)) * scale + (K0, B0)
    points = shapely.points(walls / scale)
    clear = shapely.distance(cells.boundary, points) > 1e-5
    inside = shapely.contains(cells, points)
    radius = reference_radius(loop, walls)
    undecided = np.abs(radius - 1.0) < 1e-7
    free = bool(loop.unobserved_modes)  # roots that no wall moves are in the brute matrix still
    wrong = clear & ~undecided & (inside != (radius < 1.0)) & ~(free & inside)
    assert not wrong.any()


@pytest.mark.parametrize("model", ["full", "two-mass", "motor-mass", "rigid"])
def test_the_stiffest_wall_is_on_the_edge_to_1e_9(model):
    device = load("five-bar")
    plant = reduce_directions(device.mechanism, device.at().posture, np.eye(3)[:2], model, device.damping)
    loop = MultiLoop(plant, device.controller)
    chart = multi_chart(loop)
    K, B = chart.stiffness_max, chart.damping_at_stiffness_max
    assert chart.spectral_radius(K, B) == pytest.approx(1.0, abs=1e-8)
    assert np.all(chart.spectral_radius(K * (1.0 + 1e-7), B * np.linspace(0.5, 1.5, 41)) > 1.0)
    around = B * (1.0 + np.linspace(-1e-3, 1e-3, 201))
    assert np.min(chart.spectral_radius(K * (1.0 - 1e-5), around)) < 1.0


def test_the_basis_of_a_plane_does_not_matter():
    device = load("five-bar")
    posture, loops = device.at((0.03, 0.22)).posture, []
    for angle in (0.0, 0.7):
        c, s = np.cos(angle), np.sin(angle)
        basis = [[c, s, 0.0], [-s, c, 0.0]]
        plant = reduce_directions(device.mechanism, posture, basis, "full", device.damping)
        loops.append(multi_chart(MultiLoop(plant, device.controller)))
    one, other = loops
    assert one.stiffness_max == pytest.approx(other.stiffness_max, rel=1e-9)
    assert one.damping_at_stiffness_max == pytest.approx(other.damping_at_stiffness_max, rel=1e-6)
    assert one.stable_area == pytest.approx(other.stable_area, rel=1e-9)


def test_a_plane_is_no_stiffer_than_any_of_its_directions_with_uncoupled_loops():
    device = load("five-bar")
    plant = reduce_directions(device.mechanism, device.at().posture, np.eye(3)[:2], "full", device.damping)
    chart = multi_chart(MultiLoop(plant, device.controller))
    assert chart.stiffness_max == pytest.approx(4148.658573678898, rel=1e-9)


def test_motions_that_no_wall_moves_are_set_aside():
    """A third mass that neither direction touches, free to drift."""
    plant = MultiPlant(np.diag([1.0, 2.0, 3.0]), *np.zeros((2, 3, 3)), np.eye(3)[:2], np.eye(3)[:2])
    chart = multi_chart(MultiLoop(plant, Controller(1.0)))
    assert chart.unobserved_modes == ("rigid motion (0 Hz)",)
    assert chart.stiffness_max == pytest.approx(12.0 - 8.0 * np.sqrt(2.0), rel=1e-9)


def test_lag_and_force_filter_are_those_of_the_single_loop():
    from zwidth.loop import Butterworth, FirstOrder

    plant = two_mass(0.3, 0.03, 2e4, 1.0)
    for controller in (
        Controller(0.001, 0.4, actuator_time_constant=0.0007),
        Controller(0.001, 1.2, FirstOrder(0.001), force_filter=Butterworth(2, 150.0)),
    ):
        single = stability_chart(Loop(plant, controller), decay=False)
        several = multi_chart(MultiLoop(as_multi(plant), controller))
        assert several.stiffness_max == pytest.approx(single.stiffness_max, rel=1e-9)


# --- many directions, each on its own --------------------------------------------------------------------


def test_each_direction_of_a_polar_is_its_own_largest_stiffness():
    device = load("five-bar")
    posture, directions = device.at().posture, circle(10)
    found = largest_stiffness_by_direction(device.at(), directions)
    for k, u in enumerate(directions):
        plant = reduce_mechanism(device.mechanism, posture, u, "full", device.damping)
        peak = largest_stiffness(Loop(plant, device.controller))
        assert found.stiffness[k] == pytest.approx(peak.stiffness, rel=1e-12)
        assert found.damping[k] == pytest.approx(peak.damping, rel=1e-9)
    assert found.stiffness[:5] == pytest.approx(found.stiffness[5:], rel=0.0, abs=0.0)


def test_a_direction_without_an_answer_is_data():
    device = load("five-bar")
    found = largest_stiffness_by_direction(device.at(), np.eye(3))
    assert [one.partition(":")[0] for one in found.status] == ["ok", "ok", "out of motion"]
    assert np.isnan(found.stiffness[2])
    assert np.isfinite(found.stiffness[:2]).all()


# --- the page --------------------------------------------------------------------------------------------


def test_the_page_says_what_its_examples_give():
    page = (Path(__file__).parents[3] / "docs" / "directions.md").read_text(encoding="utf-8")
    names: dict = {}
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(compile(block, "directions.md", "exec"), names)
    assert f"# {names['found'].stiffness.min():.0f} and {names['found'].stiffness.max():.0f} N/m" in page
    chart = names["chart"]
    assert f"# {chart.stiffness_max:.2f} N/m at {chart.damping_at_stiffness_max:.3f} N s/m" in page
    along_x = largest_stiffness(names["device"].at(direction=(1.0, 0.0)).loop)
    assert f"({along_x.stiffness:.2f} N/m along x)" in page
