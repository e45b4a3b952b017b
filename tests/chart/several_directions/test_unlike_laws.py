"""Charts of walls that differ along their directions: against eigenvalues, single charts and formulas."""

from functools import cache

import numpy as np
import pytest
import shapely

from tests.multi_loops import random_multi, random_unlike, reference_matrix, reference_radius, side_by_side
from tests.systems import mass
from zwidth.chart import multi_chart, stability_chart
from zwidth.errors import ArgumentError
from zwidth.loop import Controller, Loop, MultiLoop, WallMatrices
from zwidth.model import MultiPlant

# Walls closer to the edge than this share of the chart lie within the chords that draw it, and radii closer to 1
# than this one are 1 but for rounding, most of all about the double root of a free motion.
CHORDS, ROUNDING = 1e-5, 1e-7


def set_of(regions, scale=(1.0, 1.0)):
    """Rings of walls as one set, its axes divided by `scale`."""
    return shapely.union_all([shapely.Polygon(ring / np.asarray(scale)) for ring in regions])


def single_set(plant, controller, scale=(1.0, 1.0)):
    return set_of(stability_chart(Loop(plant, controller), decay=False).regions, scale)


def same_to(share, one, other):
    """Whether two sets differ by no more than a share of their area."""
    return shapely.symmetric_difference(one, other).area < share * max(one.area, other.area)


def assert_that_its_pieces_hold(chart):
    """Nothing speaks against what was found; it is confirmed only where it is shown that no cell is missing."""
    assert chart.doubtful.tolist() == []
    assert chart.off_circle.tolist() == []
    assert chart.missed.tolist() == []
    assert chart.decided is chart.complete is (chart.status == "confirmed")
    assert chart.cells_may_be_missing is not chart.complete
    assert chart.stiffness_max_is == ("exact" if chart.complete else "at least")


# --- against eigenvalues -------------------------------------------------------------------------------


def tried_walls(chart, stable, scale, rng):
    """Walls in shares of the chart: over a little more than its box, and on both sides of its edge."""
    K0, K1, B0, B1 = np.array(chart.box) / np.repeat(scale, 2)
    low, size = np.array([K0, B0]), np.array([K1 - K0, B1 - B0])
    over = low + rng.uniform(-0.1, 1.1, (100, 2)) * size
    if stable.is_empty:  # at every scale, there being no chart that has one
        magnitude = 10.0 ** rng.uniform(-6.0, 9.0, (400, 2))
        return np.vstack([over, magnitude * rng.choice([-1.0, 1.0], (400, 2))])
    along = shapely.line_interpolate_point(stable.boundary, rng.uniform(size=150), normalized=True)
    away = 10.0 ** rng.uniform(-4.0, -2.0, (150, 1)) * rng.normal(size=(150, 2))
    return np.vstack([over, shapely.get_coordinates(along) + away])


def walls_that_differ(chart, seed):
    """Walls (n, 2) on which the regions say otherwise than eigenvalues of the matrix built apart."""
    K0, K1, B0, B1 = chart.box
    scale = np.array([K1 - K0, B1 - B0])
    stable = set_of(chart.regions, scale)
    walls = tried_walls(chart, stable, scale, np.random.default_rng(seed))
    points = shapely.points(walls)
    radius = reference_radius(chart.loop, walls * scale)
    clear = np.abs(radius - 1.0) > ROUNDING
    if not stable.is_empty:
        clear &= shapely.distance(stable.boundary, points) > CHORDS
    return (walls * scale)[clear & (shapely.contains(stable, points) != (radius < 1.0))]


# Two and three directions with and without a filter, delays of no, whole and broken numbers of samples; without a
# stable wall, with two sets of them, confirmed and in doubt.
EVERYDAY = (6, 10, 13, 19, 20, 35, 53, 64)
FURTHER = (8, 12, 22, 25, 26, 32, 34, 36, 38, 42, 48, 49, 51, 52, 58, 60, 62)


@pytest.mark.parametrize("seed", [*EVERYDAY, *(pytest.param(seed, marks=pytest.mark.slow) for seed in FURTHER)])
def test_charts_of_random_laws_agree_with_eigenvalues(seed):
    """By a transition matrix that shares nothing with the package, on walls over the chart and about its edge."""
    chart = multi_chart(random_unlike(seed))
    assert_that_its_pieces_hold(chart)
    assert walls_that_differ(chart, seed).tolist() == []


@pytest.mark.parametrize("seed", [pytest.param(2095, marks=pytest.mark.slow), 2290])
def test_a_velocity_estimate_of_0_in_rounding_leaves_the_chart_as_it_is(seed):
    """Beside z = -1 behind a low pass of second order or more."""
    chart = multi_chart(random_unlike(seed))
    assert_that_its_pieces_hold(chart)
    assert walls_that_differ(chart, seed).tolist() == []


@pytest.mark.slow
@pytest.mark.parametrize("first", range(2000, 2500, 20))
def test_charts_of_500_random_laws_agree_with_eigenvalues_or_say_that_they_are_in_doubt(first):
    """Three in 500 miss a piece of a curve, two of them within one batch, and say at which walls."""
    charts = {seed: multi_chart(random_unlike(seed)) for seed in range(first, first + 20)}
    assert sum(len(chart.doubtful) > 0 for chart in charts.values()) <= 2
    differing = {
        seed: walls_that_differ(chart, seed).tolist() for seed, chart in charts.items() if not len(chart.doubtful)
    }
    assert {seed: walls for seed, walls in differing.items() if walls} == {}


# --- directions that know nothing of each other ----------------------------------------------------------

SLANTED = np.array([[1.0, 0.4], [-0.3, 1.2]])


@pytest.mark.parametrize("turn", [None, SLANTED], ids=["along", "slanted"])
@pytest.mark.parametrize(
    ("stiffness", "damping"),
    [((1.0, 0.2), (1.0, 0.5)), ((0.3, 1.0), (1.0, 0.05)), ((1.0, 0.0), (0.4, 1.0)), ((1.0, 1.0), (1.0, 0.0))],
)
def test_uncoupled_directions_give_the_intersection_of_their_charts_on_scaled_axes(stiffness, damping, turn):
    """k, b is stable where s1 k, v1 b is on the first chart and s2 k, v2 b on the second.

    With readings T y instead of y the same forces are those of T^-T K0 T^-1 and T^-T B0 T^-1.
    """
    controller = Controller(0.001, 0.3)
    plants = [mass(0.3, 2.0), mass(0.1, 4.0)]
    inverse = np.eye(2) if turn is None else np.linalg.inv(turn)
    K0, B0 = (inverse.T @ np.diag(ratios) @ inverse for ratios in (stiffness, damping))
    loop = MultiLoop(side_by_side(*plants, turn=turn), controller, WallMatrices.of(K0, B0))
    found = multi_chart(loop)
    ours = set_of(found.regions, (K0.max(), B0.max()))
    both = shapely.box(*np.array([-1.0, -1.0, 1.0, 1.0]) * 1e6)
    for plant, s, v in zip(plants, stiffness, damping, strict=True):
        both = shapely.intersection(both, scaled_set(stability_chart(Loop(plant, controller), decay=False), s, v))
    assert not both.is_empty
    assert same_to(1e-4, ours, both)  # both are drawn by chords
    edge = shapely.get_coordinates(both)
    highest = K0.max() * edge[edge[:, 1] >= 0.0, 0].max()
    assert found.stiffness_max == pytest.approx(highest, rel=1e-4)


def scaled_set(chart, s, v):
    """Walls k, b with s k, v b on the chart of a direction that is free to move."""
    if s > 0.0 and v > 0.0:
        return set_of(chart.regions, (s, v))
    least, most = stable_along_axis(chart, 0 if v == 0.0 else 1)
    across = 1e6
    if v == 0.0:
        return shapely.box(least / s, -across, most / s, across)
    return shapely.box(-across, least / v, across, most / v)


def stable_along_axis(chart, axis):
    """Least and most of the stable walls along an axis of the chart, just inside the edge K = 0 of a free mass."""
    far = 1e6
    line = shapely.LineString([(-far, 0.0), (far, 0.0)] if axis == 0 else [(1e-3, -far), (1e-3, far)])
    reached = shapely.get_coordinates(shapely.intersection(set_of(chart.regions), line))[:, axis]
    return reached.min(), reached.max()


# --- the same law, said otherwise --------------------------------------------------------------------------


def numbers(chart, scale=(1.0, 1.0)):
    """What a chart answers, its axes divided by `scale`."""
    k, b = scale
    return [
        chart.stiffness_max / k,
        chart.damping_at_stiffness_max / b,
        chart.damping_max / b,
        chart.stable_area / (k * b),
    ]


@cache
def one_law():
    """A loop under one law, and its chart."""
    loop = random_multi(8)
    return loop, multi_chart(loop)


@pytest.mark.parametrize(
    ("stiffness", "damping"),
    [([1.0, 1.0], None), ([7.0, 7.0], [0.3, 0.3]), (None, [2.0, 2.0]), (5.0 * np.eye(2), [1.0, 1.0])],
)
def test_a_law_alike_along_all_directions_is_one_law(stiffness, damping):
    loop, one = one_law()
    alike = multi_chart(MultiLoop(loop.plant, loop.controller, WallMatrices.of(stiffness, damping, 2)))
    assert numbers(alike) == numbers(one)


@pytest.mark.parametrize("unlike", [1e-7, 1e-12])
def test_a_law_almost_alike_is_almost_one_law(unlike):
    loop, one = one_law()
    law = WallMatrices.of([1.0, 1.0 - unlike], [1.0 - unlike, 1.0])
    chart = multi_chart(MultiLoop(loop.plant, loop.controller, law))
    assert one.decided
    assert not chart.decided
    assert_that_its_pieces_hold(chart)
    assert numbers(chart) == pytest.approx(numbers(one), rel=10.0 * unlike + 1e-12)


@pytest.mark.parametrize("seed", [34, 35, pytest.param(29, marks=pytest.mark.slow)])
def test_turned_directions_with_their_law_turned_give_the_same_chart(seed):
    """Readings T y under T K0 T^T: only the entries by which the matrices are scaled are others."""
    loop = random_unlike(seed)
    m = loop.plant.count
    T = np.linalg.qr(np.random.default_rng(seed).normal(size=(m, m)))[0]
    plant, law = loop.plant, loop.matrices
    K0, B0 = T @ law.stiffness @ T.T, T @ law.damping @ T.T
    turned = MultiPlant(plant.mass, plant.damping, plant.stiffness, T @ plant.actuators, T @ plant.sensors)
    one, other = multi_chart(loop), multi_chart(MultiLoop(turned, loop.controller, WallMatrices.of(K0, B0)))
    assert_that_its_pieces_hold(one)
    assert_that_its_pieces_hold(other)
    assert numbers(other, (K0.max(), B0.max())) == pytest.approx(numbers(one), rel=1e-7, nan_ok=True)


# --- damping only ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [1.0, 0.5, 0.2])
def test_damping_only_along_a_free_direction(ratio):
    """Masses 1 and m, T = 1, a spring along the first alone.

    A damper b2 on a free mass has the roots of z^2 - (1 - c) z + c, c = b2/2m, and z = 1: stable for b2 < 2m.
    With spring and damper, z^3 + (K + B - 2) z^2 + (1 + K) z - B, K = k/2, B = b/2: stable, by Jury's test,
    for 0 < K < 2 B (1 - B)/(1 + B), which is largest at B = sqrt(2) - 1.
    """
    m = 0.2
    plant = MultiPlant(np.diag([1.0, m]), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))
    chart = multi_chart(MultiLoop(plant, Controller(1.0), WallMatrices.of([1.0, 0.0], [1.0, ratio])))
    largest = min(2.0 * m / ratio, 2.0)
    B = min(largest / 2.0, np.sqrt(2.0) - 1.0)
    assert chart.unobserved_modes == ("rigid motion (0 Hz)",)
    assert chart.damping_max == pytest.approx(largest, rel=1e-9)
    assert chart.damping_at_stiffness_max == pytest.approx(2.0 * B, rel=1e-7)
    assert chart.stiffness_max == pytest.approx(4.0 * B * (1.0 - B) / (1.0 + B), rel=1e-9)
    assert chart.check(0.9 * chart.stiffness_max, 2.0 * B * 0.99).names == ["stable"]
    assert chart.check(0.9 * chart.stiffness_max, 1.01 * largest).names == ["unstable"]


@pytest.mark.parametrize("seed", [0, 1, 2, pytest.param(5, marks=pytest.mark.slow), 9])
def test_every_sliding_motion_is_set_aside_and_no_other(seed):
    """Free, coupled masses under fewer springs than dampers: a root at z = 1 for each missing spring."""
    rng = np.random.default_rng(seed)
    m = 2 + seed % 2
    missing = 1 + (seed in (5, 9))
    X, A, Y = rng.normal(size=(m, m)), rng.normal(size=(m, m)), rng.normal(size=(m, m - missing))
    plant = MultiPlant(np.eye(m) + 0.5 * X @ X.T, *np.zeros((2, m, m)), A, A.copy())
    law = WallMatrices.of(Y @ Y.T, rng.uniform(0.3, 1.0, m))
    loop = MultiLoop(plant, Controller(1.0, (0.0, 0.5, 1.0)[seed % 3]), law)
    chart = multi_chart(loop)
    assert_that_its_pieces_hold(chart)
    assert chart.unobserved_modes == missing * ("rigid motion (0 Hz)",)
    K0, K1, B0, B1 = chart.box
    walls = rng.uniform(size=(200, 2)) * (K1 - K0, B1 - B0) + (K0, B0)
    roots = np.linalg.eigvals(np.array([reference_matrix(loop, *wall) for wall in walls]))
    away = np.sort(np.abs(roots - 1.0), axis=1)
    assert np.all(away[:, :missing] < 1e-9)
    moved = np.take_along_axis(roots, np.argsort(np.abs(roots - 1.0), axis=1)[:, missing:], axis=1)
    radius = np.abs(moved).max(axis=1)
    clear = np.abs(radius - 1.0) > 1e-5
    inside = shapely.contains_xy(set_of(chart.regions), *walls.T)
    assert 0 < np.sum(inside[clear]) < np.sum(clear)
    assert (inside == (radius < 1.0))[clear].all()


def test_a_direction_without_spring_and_damper_is_not_part_of_the_wall():
    """The first direction alone, and the free second one named."""
    plant = MultiPlant(np.diag([1.0, 0.2]), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))
    chart = multi_chart(MultiLoop(plant, Controller(1.0), WallMatrices.of([1.0, 0.0])))
    assert chart.stiffness_max == pytest.approx(12.0 - 8.0 * np.sqrt(2.0), rel=1e-9)
    assert chart.unobserved_modes == ("rigid motion (0 Hz)",)


# --- the matrices ----------------------------------------------------------------------------------------


def test_matrices_are_scaled_to_a_largest_entry_of_1():
    law = WallMatrices.of([10.0, 2.0], [[3.0, -0.6], [-0.6, 1.5]])
    assert law.stiffness.tolist() == [[1.0, 0.0], [0.0, 0.2]]
    assert law.damping == pytest.approx(np.array([[1.0, -0.2], [-0.2, 0.5]]), rel=1e-15)
    assert str(law) == "stiffness 1 : 0.2, damping (1, -0.2; -0.2, 0.5)"
    assert WallMatrices.of([1.0, 0.2]).damping.tolist() == law.stiffness.tolist()
    assert WallMatrices.of(None, [1.0, 0.2]).stiffness.tolist() == [[1.0, 0.0], [0.0, 1.0]]


@pytest.mark.parametrize("size", [1e-320, 1e-300, 1e300, 1.7e308])
def test_matrices_of_any_size_are_the_same(size):
    assert WallMatrices.of([size, size]).stiffness.tolist() == [[1.0, 0.0], [0.0, 1.0]]
    assert WallMatrices.of(np.full((2, 2), size)).stiffness.tolist() == [[1.0, 1.0], [1.0, 1.0]]


@pytest.mark.parametrize("seed", range(8))
def test_both_matrices_are_diagonal_in_the_principal_directions(seed):
    law = random_unlike(seed).matrices
    found = law.principal
    S = found.combinations
    assert S.T * found.stiffness @ S == pytest.approx(law.stiffness, abs=1e-12)
    assert S.T * found.damping @ S == pytest.approx(law.damping, abs=1e-12)
    assert np.maximum(found.stiffness, found.damping) == pytest.approx(1.0, rel=1e-15)
    assert min(found.stiffness.min(), found.damping.min()) >= 0.0


@pytest.mark.parametrize(
    ("stiffness", "damping", "name"),
    [([1.0, 1e-10], [1.0, 1.0], "relative_stiffness"), ([1.0, 1.0], [1e-11, 1.0], "relative_damping")],
)
def test_a_share_too_small_to_tell_from_none_is_refused(stiffness, damping, name):
    with pytest.raises(ArgumentError, match=rf"^{name} must .*1e-09 "):
        WallMatrices.of(stiffness, damping)
    given = {"relative_stiffness": stiffness, "relative_damping": damping}
    least = {key: np.maximum(numbers, 1e-9) for key, numbers in given.items()}
    assert WallMatrices.of(least["relative_stiffness"], least["relative_damping"]).count == 2
