"""Each number of a chart against a second route, over random loops."""

import numpy as np
import pytest
import shapely

from tests.systems import mass, published, random_loop, two_mass
from zwidth.chart import boundary_points, judge, largest_stiffness, spectral_radius, stability_chart
from zwidth.loop import Butterworth, Controller, Loop
from zwidth.model import Plant

DAMPED = (0.01, 0.05, 0.3, 1.0)


def random_charts(seed, count, **options):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        loop = random_loop(rng, DAMPED)
        yield rng, loop, stability_chart(loop, **options)


def quadrant(chart):
    """The part of the regions with K >= 0, B >= 0."""
    first = shapely.box(0.0, 0.0, 1e12, 1e12)
    return [shapely.intersection(shapely.Polygon(ring), first) for ring in chart.regions]


def test_largest_stiffness_is_the_rightmost_point_of_the_quadrant():
    for _, loop, chart in random_charts(20, 60, decay=False):
        reach = [part.bounds[2] for part in quadrant(chart) if not part.is_empty and part.area > 0.0]
        if not reach:
            assert np.isnan(chart.stiffness_max)
            continue
        assert chart.stiffness_max == pytest.approx(max(reach), rel=3e-6)
        peak = largest_stiffness(loop)
        assert (peak.stiffness, peak.damping) == (chart.stiffness_max, chart.damping_at_stiffness_max)


def test_the_stiffest_wall_has_the_stated_frequencies_on_the_circle():
    corners = 0
    for _, loop, chart in random_charts(21, 60, decay=False):
        if np.isnan(chart.stiffness_max):
            continue
        L = loop.transition_matrix(chart.stiffness_max, chart.damping_at_stiffness_max)
        roots = np.linalg.eigvals(L)
        assert np.max(np.abs(roots)) <= 1.0 + 1e-7
        for frequency in chart.frequencies_at_stiffness_max:
            z = np.exp(2j * np.pi * frequency * loop.period)
            assert np.min(np.abs(roots - z)) <= 1e-7
        corners += len(chart.frequencies_at_stiffness_max) == 2
    assert corners >= 3


def test_area_is_that_of_the_polygons():
    for _, _, chart in random_charts(22, 60, decay=False):
        area = sum(part.area for part in quadrant(chart))
        assert chart.stable_area == pytest.approx(area, rel=1e-5, abs=1e-12)


def test_largest_damping_ends_the_stable_interval_at_vanishing_stiffness():
    found = 0
    for _, loop, chart in random_charts(23, 60, decay=False):
        B = chart.damping_max
        if B == 0.0:
            continue
        found += 1
        # walls just right of the axis; the root near z = 1 moves by about K times the sampled compliance
        K = 1e-4 * max(np.max(np.abs(ring[:, 0])) for ring in chart.regions)
        inside, outside = spectral_radius(loop, K, np.array([B * (1.0 - 0.01), B * (1.0 + 0.01)]))
        assert inside < 1.0
        assert outside > 1.0
    assert found > 20


def test_no_wall_decays_faster_than_the_fastest():
    for rng, loop, chart in random_charts(24, 15):
        best = chart.fastest_decay
        if best is None:
            continue
        # at a double or triple root the eigenvalues of the rounded wall miss by a root of the rounding
        assert spectral_radius(loop, best.stiffness, best.damping) == pytest.approx(best.spectral_radius, abs=3e-5)
        for ring in chart.regions:
            low, high = ring.min(axis=0), ring.max(axis=0)
            K, B = (low + (high - low) * rng.random((1500, 2))).T
            assert np.min(spectral_radius(loop, K, B)) >= best.spectral_radius - 1e-6


def test_fastest_decay_of_a_free_mass_is_a_triple_root():
    # z^3 - (2 - (p + d)/2) z^2 + (1 + p/2) z - d/2 with its three roots at rho:
    # 3 rho = 2 - (p + d)/2,  3 rho^2 = 1 + p/2,  rho^3 = d/2   =>   (1 + rho)^3 = 4
    found = stability_chart(Loop(mass(2.0), Controller(0.001))).fastest_decay
    rho = 4.0 ** (1.0 / 3.0) - 1.0
    assert found.spectral_radius == pytest.approx(rho, abs=1e-7)
    assert found.stiffness == pytest.approx(2.0 * (3.0 * rho**2 - 1.0) * 2.0 / 1e-6, rel=1e-6)
    assert found.damping == pytest.approx(2.0 * rho**3 * 2.0 / 1e-3, rel=1e-6)


@pytest.mark.parametrize("radius", [0.995, 0.97, 0.95])
def test_contours_of_equal_decay(radius):
    loop = published()
    chart = stability_chart(loop, radius, decay=False)
    for arc in chart.boundary:
        pick = np.linspace(0, len(arc.stiffness) - 1, 9).astype(int)[1:-1]
        got = spectral_radius(loop, arc.stiffness[pick], arc.damping[pick])
        assert got == pytest.approx(np.full(7, radius), abs=1e-6)
    inner = shapely.Polygon(chart.regions[0])
    assert shapely.Polygon(stability_chart(loop, decay=False).regions[0]).buffer(1e-6).contains(inner)


def test_no_wall_decays_faster_than_possible():
    assert stability_chart(published(), 0.94, decay=False).regions == ()


def test_a_sliding_mechanism_is_judged_on_what_the_wall_moves():
    # two equal drives side by side: the difference of their motions slides along the wall
    one, pair = two_mass(0.13, 0.0127, 7810.0, 0.9372), np.zeros((4, 4))
    M, B, K = (np.kron(np.eye(2), matrix) for matrix in (one.mass, one.damping, one.stiffness))
    wall = np.array([0.0, 0.5, 0.0, 0.5])
    chart = stability_chart(Loop(Plant(M, B, K + pair, wall, wall), Controller(0.00125)), decay=False)
    # u = (x2 + x4)/2 under half the force on each: the pair is one plant of twice the masses
    single = stability_chart(Loop(two_mass(0.26, 0.0254, 15620.0, 1.8744), Controller(0.00125)), decay=False)
    assert chart.stiffness_max == pytest.approx(single.stiffness_max, rel=1e-9)
    assert chart.unobserved_modes[0] == "rigid motion (0 Hz)"
    assert chart.unobserved_modes[1].startswith("mode at ")


def test_an_unstable_open_loop_can_have_stable_walls_and_not_the_origin():
    # a mass on a negative spring: the wall must hold it
    chart = stability_chart(Loop(mass(0.1, 0.0, -500.0), Controller(0.001)), decay=False)
    assert chart.stiffness_max > 500.0
    assert not any(shapely.contains_xy(shapely.Polygon(ring), 0.0, 0.0) for ring in chart.regions)
    assert chart.damping_max == 0.0


def test_a_grounded_overdamped_plant_allows_negative_stiffness():
    chart = stability_chart(Loop(mass(0.1, 40.0, 1000.0), Controller(0.001)), decay=False)
    assert min(ring[:, 0].min() for ring in chart.regions) == pytest.approx(-1000.0, rel=1e-6)


def test_boundary_points_are_flagged_as_eigenvalues_say():
    loop = published(delay=1.0, velocity_filter=Butterworth(2, 100.0))
    K, B, frequency, edge = boundary_points(loop, 200)
    roots = np.linalg.eigvals(loop.transition_matrix(K, B))
    z = np.exp(2j * np.pi * frequency * loop.period)
    for i in range(len(K)):
        own = np.argsort(np.abs(roots[i] - z[i]))[0], np.argsort(np.abs(roots[i] - z[i].conjugate()))[0]
        others = np.max(np.abs(np.delete(roots[i], own)))
        assert edge[i] == (others < 1.0)


def test_verdicts_are_three_valued():
    loop = published()
    chart = stability_chart(loop, decay=False)
    tip = chart.stiffness_max, chart.damping_at_stiffness_max
    verdicts = judge(loop, [tip[0] * 0.99, tip[0], tip[0] * 1.01, np.nan], tip[1])
    assert verdicts.names == ["stable", "undecided", "unstable", "undecided"]
    assert np.isnan(verdicts.spectral_radius[3])
    assert verdicts.frequency[1] == pytest.approx(chart.frequencies_at_stiffness_max[0], rel=1e-6)


def test_an_undecided_band_covers_a_double_root_on_the_circle():
    # K = B = 0 leaves the free mass: a double root at z = 1, which no eigenvalue solver places to 1e-9
    verdicts = judge(Loop(mass(0.3), Controller(0.001)), 0.0, 0.0)
    assert verdicts.names == ["undecided"]
