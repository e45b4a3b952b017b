"""Robust charts: exact where the answer is known, right by eigenvalues, and blind to the order of members."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from study_sizes import study_size

from tests.systems import mass, random_loop, reference_transition_matrix, two_mass
from zwidth.chart import Tracer, judge, robust_chart, softening, spectral_radius, stability_chart, unstable
from zwidth.errors import ChartError
from zwidth.loop import Butterworth, Controller, Loop
from zwidth.model import Operator, Plant, attach

# Random members: of every kind, with one to five of them on the edge, and two that exclude each other.
WALL_SEEDS = (2, 17, 20, 33, 40, 47, 51, 57)
# the sixth has many arcs and takes longer than the others together
ORDER_SEEDS, LATER_ORDER_SEEDS = (0, 4, 9, 10), (1, 2, 3, 5, 6, 7, 8, 11)


def free_mass_loop(kilograms, period=0.001, **controller):
    return Loop(mass(kilograms), Controller(period, **controller))


def union(chart):
    return shapely.union_all([shapely.Polygon(ring) for ring in chart.regions])


def similar_loops(rng, count=None):
    """A random loop and some like it: masses, damping, stiffness, period and delay off by some tenths."""
    base = random_loop(rng, kind=str(rng.choice(["chain", "dense", "coupled", "apart"])))
    loops = []
    for _ in range(count or int(rng.integers(2, 7))):
        p, c, f = base.plant, base.controller, np.exp(rng.normal(0.0, 0.3, 5))
        if rng.random() < 0.3:
            period, low_pass = c.sampling_period * f[3], c.velocity_filter
            if isinstance(low_pass, Butterworth):  # below half of a slower rate, too
                low_pass = replace(low_pass, cutoff_Hz=min(low_pass.cutoff_Hz, 0.45 / period))
            c = replace(c, sampling_period=period, velocity_filter=low_pass)
        if rng.random() < 0.5:
            c = replace(c, delay=c.delay * f[4])
        plant = replace(p, mass=p.mass * f[0], damping=p.damping * f[1], stiffness=p.stiffness * f[2])
        loops.append(Loop(plant, c))
    return loops


def largest_radius(loops, K, B):
    return max(float(np.abs(np.linalg.eigvals(reference_transition_matrix(loop, K, B))).max()) for loop in loops)


def test_of_free_masses_the_lightest_is_the_limit():
    chart = robust_chart([free_mass_loop(m) for m in (0.3, 0.1, 0.2, 1.7)])
    alone = stability_chart(free_mass_loop(0.1))
    assert chart.binding == (1,)
    # thesis (4.14): K = (12 - 8 sqrt 2) m / T^2; B = 2 m / T
    assert chart.stiffness_max == pytest.approx((12.0 - 8.0 * np.sqrt(2.0)) * 0.1e6, rel=1e-10)
    assert chart.damping_max == pytest.approx(200.0, rel=1e-10)
    assert chart.stable_area == pytest.approx(alone.stable_area, rel=1e-11)
    assert chart.members_at_stiffness_max == (1,)
    assert chart.frequencies_at_stiffness_max == pytest.approx(alone.frequencies_at_stiffness_max)
    assert (chart.best_by_area, chart.best_by_stiffness) == (3, 3)
    assert chart.lost_stiffness_share == pytest.approx(1.0 - 1.0 / 17.0, rel=1e-9)
    assert chart.lost_share == pytest.approx(1.0 - 1.0 / 17.0**2, rel=1e-9)
    assert chart.corner_blur == 0.0


def test_of_sampling_periods_the_longest_is_the_limit():
    chart = robust_chart([free_mass_loop(0.1, period) for period in (0.0005, 0.002, 0.001)])
    assert chart.binding == (1,)
    assert chart.stiffness_max == pytest.approx((12.0 - 8.0 * np.sqrt(2.0)) * 0.1 / 0.002**2, rel=1e-10)


def test_one_member_alone_is_its_own_robust_chart():
    loop = Loop(two_mass(0.2616, 0.0254, 15620.0, 1.8744), Controller(0.00125, 0.4))
    chart, alone = robust_chart([loop]), stability_chart(loop)
    assert chart.stiffness_max == pytest.approx(alone.stiffness_max, rel=1e-12)
    assert chart.damping_max == pytest.approx(alone.damping_max, rel=1e-12)
    assert chart.stable_area == pytest.approx(alone.stable_area, rel=1e-12)
    assert chart.lost_share == pytest.approx(0.0, abs=1e-12)
    assert len(chart.boundary) == len(alone.boundary)
    assert chart.unobserved_modes == alone.unobserved_modes


def test_the_same_member_twice_changes_nothing():
    loop = Loop(mass(0.1, 0.5), Controller(0.001, 1.0))
    once, twice = robust_chart([loop]), robust_chart([loop, loop, Loop(mass(0.1, 0.5), Controller(0.001, 1.0))])
    assert twice.binding == (0,)
    assert twice.stiffness_max == once.stiffness_max
    assert twice.stable_area == pytest.approx(once.stable_area, rel=1e-13)


def crossing_pair():
    """A heavy mass with a delay and a light one without: their curves cross."""
    return free_mass_loop(0.3, delay=1.0), free_mass_loop(0.1)


def test_a_corner_between_two_members_is_solved_for():
    # one curve of walls each, by its own formula: z = exp(i theta), 1/P = (z - 1)^2 / (T^2/2m (z + 1)) z^l
    def wall(theta, m, delay, T=0.001):
        z = np.exp(1j * theta)
        h = -((z - 1.0) ** 2) * z**delay * 2.0 * m / (T * T * (z + 1.0))
        w = (1.0 - 1.0 / z) / T
        B = h.imag / w.imag
        return np.array([(h.real - B * w.real) * T, B])

    from scipy.optimize import fsolve

    late, light = crossing_pair()
    chart = robust_chart([late, light])
    assert chart.binding == (0, 1)
    arcs = {arc.member: arc for arc in chart.boundary if 0.0 < arc.frequency[1] < 499.0}
    # the heavy one bounds the damping from above, the light one from the right or the other way round
    ends = [np.array([arc.stiffness[k], arc.damping[k]]) for arc in arcs.values() for k in (0, -1)]
    shared = next(
        a for i, a in enumerate(ends) for b in ends[i + 1 :] if np.allclose(a, b, rtol=1e-12) and a[0] > 1.0
    )
    guess = [
        2.0 * np.pi * 0.001 * arc.frequency[np.argmin(np.abs(arc.stiffness - shared[0]))] for arc in arcs.values()
    ]
    members = [(0.3, 1) if member == 0 else (0.1, 0) for member in arcs]
    angles = fsolve(lambda t: wall(t[0], *members[0]) - wall(t[1], *members[1]), guess, xtol=1e-14)
    K, B = wall(angles[0], *members[0]) / (0.001, 1.0)
    assert shared == pytest.approx([K, B], rel=1e-9)
    for loop in (late, light):
        assert judge(loop, K, B).spectral_radius == pytest.approx(1.0, abs=1e-9)


def test_a_peak_at_a_corner_names_both_members_and_both_frequencies():
    arm = two_mass(0.2616, 0.0254, 15620.0, 1.8744)
    operators = [Operator(2.8, 150.0, 3.0, 1500.0, 2.0), Operator(0.4, 1500.0, 15.0, 20000.0, 40.0)]
    loops = [Loop(attach(arm, operator), Controller(0.00125, 0.3)) for operator in operators]
    found = []
    for share in np.linspace(0.0, 1.0, 9):
        other = Loop(attach(arm, operators[1]), Controller(0.00125, 0.3 + share))
        chart = robust_chart([loops[0], other])
        assert len(chart.members_at_stiffness_max) <= len(chart.frequencies_at_stiffness_max)
        K, B = chart.stiffness_max, chart.damping_at_stiffness_max
        for member, hertz in zip(chart.members_at_stiffness_max, chart.frequencies_at_stiffness_max, strict=False):
            assert judge((loops[0], other)[member], K, B).spectral_radius == pytest.approx(1.0, abs=1e-9), hertz
        found.append(chart.members_at_stiffness_max)
    assert {(0,), (1,)} <= set(found) | {(0, 1)}


@pytest.mark.parametrize("seed", WALL_SEEDS)
def test_walls_inside_are_stable_for_all_and_walls_outside_are_not(seed):
    assert walls_are_as_the_region_says(seed)


@pytest.mark.slow
def test_walls_inside_many_charts_are_stable_for_all_and_walls_outside_are_not():
    assert sum(map(walls_are_as_the_region_says, range(study_size(continuous=60, full=400)))) > 50


def walls_are_as_the_region_says(seed):
    """Whether there is a chart to ask: not where a member's edge is hidden by rounding."""
    rng = np.random.default_rng(1000 + seed)
    loops = similar_loops(rng)
    try:
        chart = robust_chart(loops)
    except ChartError:
        return False
    loops = list(chart.members.values())
    if not chart.regions:
        assert chart.excluding
        return True
    region = union(chart)
    low, high = np.array(region.bounds[:2]), np.array(region.bounds[2:])
    walls = low + (rng.random((12, 2)) * 1.2 - 0.1) * (high - low)
    for arc in chart.boundary:
        k = rng.integers(0, len(arc.stiffness), 2)
        walls = np.vstack(
            [
                walls,
                np.column_stack([arc.stiffness[k], arc.damping[k]]) + rng.normal(0, 1e-3, (2, 2)) * (high - low),
            ]
        )
    edge = shapely.transform(region.boundary, lambda x: (x - low) / (high - low))
    far = shapely.distance(edge, shapely.points((walls - low) / (high - low))) > 1e-4
    for K, B in walls[far]:
        radius = largest_radius(loops, K, B)
        assert radius < 1.0 + 1e-7 if shapely.contains_xy(region, K, B) else radius > 1.0 - 1e-7
    return True


@pytest.mark.parametrize(
    "seed", [*ORDER_SEEDS, *(pytest.param(seed, marks=pytest.mark.slow) for seed in LATER_ORDER_SEEDS)]
)
def test_order_does_not_matter_and_more_members_never_help(seed):
    rng = np.random.default_rng(2000 + seed)
    base = random_loop(rng, ratios=(0.05, 0.3, 1.0), kind="chain")
    factors = np.exp(rng.normal(0.0, 0.3, 5))
    loops = [Loop(replace(base.plant, mass=base.plant.mass * f), base.controller) for f in factors]
    order = rng.permutation(len(loops))
    one, other = robust_chart(loops), robust_chart([loops[k] for k in order])
    assert other.stiffness_max == pytest.approx(one.stiffness_max, rel=1e-9, nan_ok=True)
    assert other.stable_area == pytest.approx(one.stable_area, rel=1e-8)
    assert tuple(sorted(int(order[k]) for k in other.binding)) == one.binding
    fewer = robust_chart(loops[:3])
    if one.regions:
        assert union(one).difference(union(fewer).buffer(0.0)).area <= 1e-5 * union(one).area
    assert not fewer.stiffness_max < one.stiffness_max * (1.0 - 1e-12)


def test_members_that_cannot_be_charted_are_named_and_not_fatal():
    apart = replace(two_mass(1.0, 0.1, 100.0), sensor=np.array([0.0, 0.0]))
    chart = robust_chart([free_mass_loop(0.2), Loop(apart, Controller(0.001))])
    assert list(chart.members) == [0]
    assert list(chart.failed) == [1]
    assert "moves nothing" in chart.failed[1]
    with pytest.raises(ChartError, match="no member"):
        robust_chart([Loop(apart, Controller(0.001))])
    with pytest.raises(ValueError, match="one member"):
        robust_chart([])


def unstable_plant(spring):
    """A mass on a spring that pushes away needs a wall at least as stiff."""
    one = np.ones(1)
    return Loop(Plant(np.array([[0.1]]), np.zeros((1, 1)), np.array([[-spring]]), one, one), Controller(0.001))


def test_members_that_exclude_each_other_are_named():
    stiff = unstable_plant(80_000.0)  # needs K > 80 kN/m, of which the lightest free mass stands 69
    chart = robust_chart([free_mass_loop(1.0), free_mass_loop(0.05), unstable_plant(40_000.0), stiff])
    assert np.isnan(chart.stiffness_max)
    assert chart.members_at_stiffness_max == ()
    assert chart.stable_area == 0.0
    assert len(chart.excluding) in (1, 2)
    alone = robust_chart([chart.members[k] for k in chart.excluding])
    assert np.isnan(alone.stiffness_max)
    for k in chart.excluding if len(chart.excluding) == 2 else ():
        assert stability_chart(chart.members[k], decay=False).stiffness_max > 0.0


def test_near_twins_are_told_apart_where_chords_are_not():
    """Members whose curves lie closer than the polygons follow them, and cross."""
    arm = two_mass(0.2616, 0.0254, 15620.0, 1.8744)
    loops = []
    for k in range(5):
        operator = Operator(0.8 + 1e-7 * k, 580.0, 5.5 - 3e-7 * k * k, 9000.0 + 3e-3 * k, 10.0)
        loops.append(Loop(attach(arm, operator), Controller(0.00125)))
    chart = robust_chart(loops)
    stiffest = min(stability_chart(loop, decay=False).stiffness_max for loop in loops)
    assert chart.stiffness_max <= stiffest * (1.0 + 1e-12)
    assert chart.stiffness_max == pytest.approx(stiffest, rel=1e-6)
    radius = [judge(loop, chart.stiffness_max, chart.damping_at_stiffness_max).spectral_radius for loop in loops]
    assert max(radius) < 1.0 + 1e-6


def test_a_straight_edge_alone_can_cut():
    """The line of a root at z = 1 of a heavy, well damped member; its curves run far outside what is left."""
    light, heavy = Loop(mass(0.01, 0.0, 1000.0), Controller(0.001)), Loop(mass(10.0, 50.0, 1.0), Controller(0.001))
    assert min(ring[:, 0].min() for ring in robust_chart([light]).regions) < -500.0
    chart = robust_chart([light, heavy])
    assert min(ring[:, 0].min() for ring in chart.regions) == pytest.approx(-1.0, rel=1e-9)
    assert chart.binding == (0, 1)


def test_curves_nearer_than_chords_cross_once():
    arm = two_mass(0.2616, 0.0254, 15620.0, 1.8744)
    rng = np.random.default_rng(0)
    loops = []
    for _ in range(1000):
        numbers = (rng.uniform(0.3, 3.0), 10 ** rng.uniform(2, 3.3), rng.uniform(2, 20), 10 ** rng.uniform(3, 4.5))
        loops.append(Operator(*numbers, rng.uniform(1, 50)))
    chosen = [Loop(attach(arm, loops[k]), Controller(0.00125)) for k in (53, 254, 827, 883)]
    chart = robust_chart(chosen)
    assert [arc.member for arc in chart.boundary].count(2) == 1
    assert len(chart.boundary) == 5
    assert chart.corner_blur == 0.0


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 5, 7])
def test_softened_by_less_a_wall_is_unstable_and_by_more_stable(seed):
    loop = random_loop(np.random.default_rng(seed))
    chart = stability_chart(loop, decay=False)
    K, B = (1.0 + 0.5 / (seed + 1)) * chart.stiffness_max, chart.damping_at_stiffness_max
    polynomials = Tracer(loop).polynomials
    assert unstable(polynomials, np.array([K]), np.array([B])).all()
    by = softening(polynomials, K, B)
    assert 0.0 < by < K
    assert spectral_radius(loop, K - by * (1.0 - 1e-4), B) > 1.0
    assert spectral_radius(loop, K - by * (1.0 + 1e-4), B) < 1.0


def test_a_wall_that_no_softening_helps_is_given_up():
    loop = random_loop(np.random.default_rng(0))
    polynomials = Tracer(loop).polynomials
    beyond = 1.5 * stability_chart(loop, decay=False).damping_max
    assert softening(polynomials, 10.0, beyond) == 10.0
