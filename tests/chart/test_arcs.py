"""Rings of arcs: their record, and the largest stiffness, largest damping and area read off it."""

from itertools import pairwise

import numpy as np
import pytest
import shapely
from scipy.optimize import brentq

from tests.systems import published, random_loop
from zwidth.chart import TracedEdge, Tracer, WallBox, trace_curves
from zwidth.chart.arcs import CHORD, DAMPING, MINUS, PAIR, PLUS, SLOPE, STIFFNESS, Arc, Arcs, cut_at_holes
from zwidth.chart.area import find_peak, largest_damping, quadrant_area, stiffest_index
from zwidth.chart.loop_edge import trace_edge
from zwidth.chart.several_directions.polygon_arcs import Branch
from zwidth.loop import MultiLoop
from zwidth.model import MultiPlant


def star(rng, corners=12):
    """A random polygon round a random centre, counter-clockwise, first corner repeated."""
    angles = 2.0 * np.pi * (np.arange(corners) + rng.uniform(0.0, 0.9, corners)) / corners
    reach = rng.uniform(0.5, 2.0, corners)
    ring = rng.uniform(-2.0, 1.0, 2) + np.column_stack([reach * np.cos(angles), reach * np.sin(angles)])
    return np.vstack([ring, ring[:1]])


def in_quadrant(polygon):
    return shapely.intersection(polygon, shapely.box(0.0, 0.0, 10.0, 10.0))


def small_rings():
    """A ring of three arcs of which one is curved, and a ring of one."""
    a, b, c = (0.0, 0.0), (2.0, 0.0), (1.0, 3.0)
    bent = Arc(PAIR, b, c, 0.5, 1.5, np.array([0.7, 1.0]), 4)
    return (Arc(PLUS, a, b, 0.0, 0.0, np.empty(0)), bent, Arc(MINUS, c, a, np.pi, np.pi, np.empty(0))), (
        Arc(CHORD, c, c, 0.2, 0.3, np.empty(0), 1),
    )


# --- the record ------------------------------------------------------------------------------------------


def test_arcs_come_out_as_they_went_in():
    rings = small_rings()
    arcs = Arcs.of(rings)
    given = [arc for ring in rings for arc in ring]
    for arc, own in zip(arcs, given, strict=True):
        np.testing.assert_array_equal(arc.thetas, own.thetas)
        assert arc._replace(thetas=0) == own._replace(thetas=0)
    assert arcs.next_arc.tolist() == [1, 2, 0, 3]
    assert [list(ring) for ring in arcs.rings] == [[0, 1, 2], [3]]
    assert arcs.curved == [1]


def test_no_arcs_are_no_rings():
    for arcs in (Arcs.of(()), Arcs.chords(())):
        assert (len(arcs), arcs.rings, arcs.curved) == (0, (), [])
        assert find_peak(arcs, (), 1.0) is None
        assert (largest_damping(arcs, (), 1.0, lambda K, B: True), quadrant_area(arcs, ())) == (0.0, 0.0)


def test_chords_are_the_arcs_of_a_polygon():
    ring = star(np.random.default_rng(1), 5)
    arcs = Arcs.chords([ring, ring[::-1]])
    np.testing.assert_array_equal(np.vstack([arcs.first[:5], arcs.last[4]]), ring)
    np.testing.assert_array_equal(arcs.first[arcs.next_arc], arcs.last)
    assert [list(part) for part in arcs.rings] == [[0, 1, 2, 3, 4], [5, 6, 7, 8, 9]]


@pytest.mark.parametrize("component", [STIFFNESS, DAMPING])
def test_straight_arcs_cross_a_level_where_polygons_do(component):
    ring = star(np.random.default_rng(2))
    numbers, walls = Arcs.chords([ring]).crossings(component, 0.3)
    assert walls[:, component] == pytest.approx(0.3)
    ends = [(0.3, -9.0), (0.3, 9.0)] if component == STIFFNESS else [(-9.0, 0.3), (9.0, 0.3)]
    met = shapely.get_coordinates(shapely.intersection(shapely.LinearRing(ring), shapely.LineString(ends)))
    assert len(numbers) == len(met) > 0
    assert np.sort(walls[:, 1 - component]) == pytest.approx(np.sort(met[:, 1 - component]))


# --- area, largest stiffness, largest damping ------------------------------------------------------------


def test_the_area_is_that_of_the_polygon_in_the_quadrant():
    rng = np.random.default_rng(3)
    for _ in range(200):
        rings = [star(rng, int(rng.integers(5, 12))), star(rng)[::-1] + 20.0]  # and a hole far off
        areas = [in_quadrant(shapely.Polygon(rings[0])).area, shapely.Polygon(rings[1]).area]
        assert quadrant_area(Arcs.chords(rings[:1]), ()) == pytest.approx(areas[0], abs=1e-12)
        assert quadrant_area(Arcs.chords([5.0 * rings[0] + 40.0, rings[1]]), ()) == pytest.approx(
            25.0 * shapely.Polygon(rings[0]).area - areas[1], abs=1e-9
        )


def test_a_blurred_corner_is_closed_by_its_chord():
    ring = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    sides = [Arc(CHORD, tuple(a), tuple(b), 0.0, 0.0, np.empty(0)) for a, b in pairwise(ring)]
    del sides[1]
    assert quadrant_area(Arcs.of([sides]), ()) == pytest.approx(2.0)


def test_the_stiffest_wall_is_the_polygons_rightmost_point_in_the_quadrant():
    rng = np.random.default_rng(4)
    none = 0
    for _ in range(200):
        ring = star(rng, int(rng.integers(5, 12)))
        found = find_peak(Arcs.chords([ring]), (), 1.0)
        corners = shapely.get_coordinates(in_quadrant(shapely.Polygon(ring)))
        if not len(corners):
            none += 1
            assert found is None
            continue
        assert (found.stiffness, found.damping) == pytest.approx(tuple(corners[np.argmax(corners[:, 0])]))
    assert 0 < none < 100


def test_the_largest_damping_is_where_the_polygon_ends_beside_the_axis():
    rng = np.random.default_rng(5)
    seen = 0
    for _ in range(200):
        ring = star(rng, int(rng.integers(5, 12)))
        polygon = shapely.Polygon(ring)
        found = largest_damping(
            Arcs.chords([ring]), (), 3.0, lambda K, B, p=polygon: bool(shapely.contains_xy(p, K, B))
        )
        beside = shapely.intersection(polygon, shapely.LineString([(1e-9, 0.0), (1e-9, 9.0)]))
        assert found == pytest.approx(np.nan_to_num(beside.bounds[3]), abs=1e-6)
        seen += found > 0.0
    assert seen > 50


def test_stops_that_rounding_parted_are_one():
    ring = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0 + 1e-12], [0.0, 1.0], [-1.0, 0.5], [0.0, 0.0]])
    assert largest_damping(Arcs.chords([ring]), (), 1.0, lambda K, B: True) == 1.0


def test_what_is_stiff_by_rounding_alone_has_no_area():
    ring = np.array([[-1.0, 0.0], [1e-12, 0.0], [1e-12, 1.0], [-1.0, 1.0], [-1.0, 0.0]])
    edge = TracedEdge(Arcs.chords([ring]), ())
    assert (edge.stiffness_scale, edge.peak, edge.area) == (1.0, None, 0.0)
    assert quadrant_area(edge.arcs, ()) == pytest.approx(1e-12)


def test_an_outline_has_each_corner_once_unless_it_is_blurred():
    """The third side begins 1e-7 of the size beside the second's end, the fourth 1e-2 beside the third's."""
    ends = (
        [(0.0, 0.0), (2.0, 0.0)],
        [(2.0, 0.0), (2.0, 1.0)],
        [(2.0 - 2e-7, 1.0), (0.0, 1.0)],
        [(0.0, 0.98), (0.0, 0.0)],
    )
    arcs = Arcs.of([[Arc(CHORD, first, last, 0.0, 0.0, np.empty(0)) for first, last in ends]])
    (outline,) = TracedEdge(arcs, ()).outlines
    corners = [(0.0, 0.0), (2.0, 0.0), (2.0 - 2e-7, 1.0), (0.0, 1.0), (0.0, 0.98), (0.0, 0.0)]
    assert list(map(tuple, outline.tolist())) == corners


def test_of_walls_as_stiff_as_each_other_the_most_damped_prevails():
    rng = np.random.default_rng(6)
    K = np.array([1.0, 1.0 - 3e-14, 1.0 + 3e-14, 1.0 - 1e-12, 2.0, 1e-12])
    B = np.array([0.1, 0.5, 0.2, 0.9, -0.1, 1.0])
    for _ in range(20):
        order = rng.permutation(6)
        assert order[stiffest_index(K[order], B[order], 1e-10)] == 1
    assert stiffest_index(K, B, 3.0) == -1


# --- curves ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(6))
def test_zeros_and_integrals_along_a_curve_are_those_of_its_points(seed):
    tracer = Tracer(published() if seed == 0 else random_loop(np.random.default_rng(seed)))
    edge = trace_edge(tracer)
    for arc, (thetas, K, B) in zip(edge.arcs, edge.arc_points, strict=True):
        if not arc.curved:
            continue
        for component, values in ((STIFFNESS, K), (DAMPING, B)):
            inner = values[1:-1]
            turns = np.flatnonzero(inner[1:] * inner[:-1] < 0.0)
            found = tracer.zeros(arc, component)
            assert len(found) >= len(turns)
            bounds = np.sort(np.column_stack([thetas[1:-1][turns], thetas[1:-1][turns + 1]]), axis=1)
            assert all(np.any((low <= found) & (found <= high)) for low, high in bounds)
        inside = (K > 0.0) & (B > 0.0)
        if inside.all():
            trapezoids = float(np.sum(0.5 * (K[1:] + K[:-1]) * np.diff(B)))
            assert tracer.integral(arc) == pytest.approx(trapezoids, abs=1e-5 * np.ptp(B) * np.ptp(K))


def branch_of_one_direction(loop, edge):
    """The loop's curve of walls as that of a loop of several directions, in a box about its edge."""
    p = loop.plant
    plant = MultiPlant(p.mass, p.damping, p.stiffness, p.actuator[None], p.sensor[None])
    walls = np.vstack(edge.outlines)
    box = WallBox(walls.min(axis=0) * (loop.period, 1.0), walls.max(axis=0) * (loop.period, 1.0))
    with np.errstate(all="ignore"):  # walls at infinity are data
        _, curves = trace_curves(MultiLoop(plant, loop.controller)).within(box.with_margin(0.1), 1e-5)
    return [Branch(curve, np.ptp(walls, axis=0)) for curve in curves if curve.kind == PAIR]


def along(branches, arc):
    """The branch on which an arc lies, and the same arc by the branch's own parameter."""
    for branch in branches:
        angles, places = branch.curve.traced.points[:, 0], branch.curve.parameters
        ends = np.sort([arc.start, arc.end])
        if (np.diff(angles) > 0.0).all() and angles[0] <= ends[0] and ends[1] <= angles[-1]:
            break

    def place(theta):
        k = int(np.clip(np.searchsorted(angles, theta), 1, len(angles) - 1))
        if theta in angles[k - 1 : k + 1]:
            return float(places[k - 1 : k + 1][angles[k - 1 : k + 1] == theta][0])
        return brentq(lambda p: branch.angles(np.array([p]))[0] - theta, places[k - 1], places[k], xtol=1e-13)

    start, end = place(arc.start), place(arc.end)
    inner = places[(places > min(start, end)) & (places < max(start, end))]
    return branch, arc._replace(start=start, end=end, thetas=inner if start < end else inner[::-1])


@pytest.mark.parametrize("seed", [0, 3, 9, 12])
def test_a_branch_of_one_direction_is_the_curve_of_the_single_loop(seed):
    loop = published() if seed == 0 else random_loop(np.random.default_rng(seed))
    tracer = Tracer(loop)
    edge = trace_edge(tracer)
    size = np.ptp(np.vstack(edge.outlines), axis=0)
    branches = branch_of_one_direction(loop, edge)
    curved = [edge.arcs[k] for k in edge.arcs.curved]
    assert curved
    for arc in curved:
        branch, own = along(branches, arc)
        K, B, _, _, angles = branch.curve.at(own.thetas[:-1] + 0.5 * np.diff(own.thetas))
        assert np.column_stack([K, B]) == pytest.approx(
            np.column_stack(tracer.walls(angles)), rel=1e-6, abs=1e-7 * size.max()
        )
        for component in (STIFFNESS, DAMPING, SLOPE):
            # a corner can lie on an axis: whether K is 0 just before it is rounding
            zeros = [np.sort(branch.angles(branch.zeros(own, component))), np.sort(tracer.zeros(arc, component))]
            inner, wanted = (
                each[(np.abs(each - arc.end) > 1e-9) & (np.abs(each - arc.start) > 1e-9)] for each in zeros
            )
            assert inner == pytest.approx(wanted, rel=1e-7)
        assert branch.integral(own) == pytest.approx(tracer.integral(arc), rel=1e-6, abs=1e-9 * size.prod())


def test_a_branch_is_straight_beside_its_end():
    """There its evaluation is all rounding; the first step, 1e-12 of the area, is added all the same."""
    tracer = Tracer(published())
    edge = trace_edge(tracer)
    size = np.ptp(np.vstack(edge.outlines), axis=0)
    (arc,) = (edge.arcs[k] for k in edge.arcs.curved if edge.arcs[k].start == 0.0)
    branch, own = along(branch_of_one_direction(published(), edge), arc)
    assert branch.integral(own) == pytest.approx(tracer.integral(arc), rel=0.0, abs=1e-12 * size.prod())


def test_holes_that_rounding_left_are_no_holes():
    """Of a corner of many branches `make_valid` may leave holes as small as digits, which no cut takes apart."""
    x, y, e = -119633.04780942366, -40.12418191206121, 2e-11
    specks = [[(x + k * e, y), (x + k * e, y + e), (x + (k + 0.5) * e, y + 0.5 * e)] for k in range(3)]
    cell = shapely.Polygon([(-2e5, -50.0), (6e5, -50.0), (6e5, 1300.0), (-2e5, 1300.0)], specks)
    (whole,) = cut_at_holes(cell)
    assert whole.equals(shapely.Polygon(cell.exterior))
    ring = cut_at_holes(shapely.box(0.0, 0.0, 3.0, 3.0) - shapely.box(1.0, 1.0, 2.0, 2.0))
    assert len(ring) == 2
    assert sum(piece.area for piece in ring) == pytest.approx(8.0)
