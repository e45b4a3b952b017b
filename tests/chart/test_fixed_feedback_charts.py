"""Charts of loops with force sensor, feedforward or local loop, against eigenvalues of a period played through.

Random loops of each kind, and all three together: 0.2-20 kHz, modes 1 Hz to beyond Nyquist, damping 0-150 %,
delays, lags, filters, estimators, operators.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import shapely
from scipy.linalg import matrix_balance

from tests.control_apart import random_controlled_loop
from tests.study_sizes import study_size
from zwidth.chart import stability_chart
from zwidth.errors import ChartError, UnmovedError

KINDS = {
    "force-sensor": ("force-sensor",),
    "feedforward": ("feedforward",),
    "local": ("local",),
    "all": ("force-sensor", "feedforward", "local"),
}
BAND = 1e-9  # round the unit circle, where double precision does not tell
EDGES, WALLS = 6, 40  # walls tried: on each arc, and about the chart
LOST = 1e-5  # by how much roots of two matrices may differ by rounding
DOUBLE = 1e-5  # a pair of roots nearer to the real axis counts as a double root
HIDDEN = 1e-6  # how far a motion may move that is named as unobserved
CHORD = 1e-6  # shares of the chart's size by which the chords of a drawn outline miss the edge


class Judge:
    """Eigenvalues of a loop, of a matrix that shares nothing with the package."""

    def __init__(self, case):
        self.case = case
        self.L0, self.LK, self.LB = case.matrices()

    def matrices(self, K, B):
        return self.L0 + np.multiply.outer(K, self.LK) + np.multiply.outer(B, self.LB)

    def radii(self, K, B):
        """Spectral radii (k,) without the roots on or outside the circle that no wall moves; and how many these
        are."""
        roots = list(np.linalg.eigvals(self.matrices(K, B)))
        still = [
            z for z in roots[0] if abs(z) > 1.0 - BAND and all(np.min(np.abs(w - z)) < 1e-8 for w in roots[1:6])
        ]
        for k, own in enumerate(roots):
            for z in still:
                own = np.delete(own, np.argmin(np.abs(own - z)))
            roots[k] = own
        return np.array([np.abs(own).max() for own in roots]), len(still)

    def distance(self, K, B, z):
        """How far the nearest root is from z. Where this matrix has lost digits, as beside very unlike masses, the
        loop's own states tell, which are not what charts are made of; less what rounding leaves open of a root."""
        roots = np.linalg.eigvals(self.matrices(K, B))
        apart = roots[np.argmin(np.abs(roots - z))]
        if abs(apart - z) <= BAND:
            return float(abs(apart - z))
        own = matrix_balance(self.case.loop.transition_matrix(K, B), permute=False)[0]
        roots, right = np.linalg.eig(own)
        left, nearest = np.linalg.pinv(right), int(np.argmin(np.abs(roots - z)))
        assert abs(roots[nearest] - apart) < LOST, (K, B, z)
        condition = np.linalg.norm(left[nearest]) * np.linalg.norm(right[:, nearest]) * np.linalg.norm(own)
        return float(abs(roots[nearest] - z)) - 2e-15 * condition


def on_edges(chart, judge, seen):
    """Points of the edge have a root on the unit circle, at the angle that the chart gives."""
    for arc in chart.boundary:
        inner = np.arange(len(arc.stiffness))[1:-1]
        some = inner[np.linspace(0, len(inner) - 1, EDGES).astype(int)] if len(inner) > EDGES else inner
        for k in some:
            z = np.exp(2j * np.pi * arc.frequency[k] * chart.loop.period)
            if abs(z.imag) < DOUBLE:
                continue  # all but a double root, which eigenvalues know to the root of rounding
            seen["edges"] += 1
            seen["edges off"] += judge.distance(arc.stiffness[k], arc.damping[k], z) > BAND


def about_the_chart(chart, judge, rng, seen):
    """Walls inside are stable, walls outside unstable."""
    T, plant = chart.loop.period, chart.loop.plant
    m = 1.0 / float(plant.actuator @ np.linalg.solve(plant.mass, plant.actuator))
    polygons = [shapely.Polygon(ring) for ring in chart.regions]
    if polygons:
        left, low, right, high = shapely.union_all(polygons).bounds
        wide, tall = 0.3 * (right - left), 0.3 * (high - low)
        K, B = rng.uniform(left - wide, right + wide, WALLS), rng.uniform(low - tall, high + tall, WALLS)
    else:
        sizes = 10.0 ** rng.uniform(-4.0, 0.0, (2, WALLS))
        K = rng.uniform(-1.0, 4.0, WALLS) * sizes[0] * m / T**2
        B = rng.uniform(-1.0, 2.0, WALLS) * sizes[1] * m / T
    inside = np.zeros(WALLS, dtype=bool)
    for polygon in polygons:
        inside |= shapely.contains_xy(polygon, K, B)
    radii, still = judge.radii(K, B)
    hidden = still > 2 * len(chart.loop.unobserved_modes)
    seen["still"] += hidden
    seen["empty"] += not polygons
    if hidden:
        return  # an undamped motion that the wall hardly moves: then all walls are within the band
    clear = np.abs(radii - 1.0) > (HIDDEN if chart.loop.unobserved_modes else BAND)
    wrong = clear & (inside != (radii < 1.0))
    for k in np.flatnonzero(wrong):
        wrong[k] = not polygons or beside(polygons, K[k], B[k]) > CHORD
    seen["walls"] += WALLS
    seen["walls clear"] += int(np.count_nonzero(clear))
    seen["walls wrong"] += int(np.count_nonzero(wrong))


def beside(polygons, K, B):
    """Distance of a wall from the outlines, in shares of their size: they are drawn with chords."""
    left, low, right, high = shapely.union_all(polygons).bounds
    size = (right - left, high - low)
    outlines = [shapely.LineString(np.array(polygon.exterior.coords) / size) for polygon in polygons]
    return min(shapely.distance(outline, shapely.Point(K / size[0], B / size[1])) for outline in outlines)


def look_at(kind, numbers):
    seen = Counter()
    for number in numbers:
        rng = np.random.default_rng([2024, number])
        case = random_controlled_loop(rng, *KINDS[kind])
        try:
            chart = stability_chart(case.loop, decay=False)
        except ChartError:
            seen["undecided"] += 1
            continue
        except UnmovedError:
            seen["unmoved"] += 1
            continue
        judge = Judge(case)
        on_edges(chart, judge, seen)
        about_the_chart(chart, judge, rng, seen)
    return seen


def assert_right(seen, loops):
    assert seen["edges off"] == 0, seen
    assert seen["walls wrong"] == 0, seen
    assert seen["still"] <= max(2, 0.004 * loops), seen
    # what is left out is little: it is counted, so that nothing hides in it
    assert seen["undecided"] <= max(2, 0.004 * loops), seen
    assert seen["unmoved"] <= max(2, 0.004 * loops), seen
    assert seen["empty"] <= 0.15 * loops, seen
    assert seen["walls clear"] >= 0.95 * seen["walls"], seen
    assert seen["edges"] >= 7 * loops, seen


@pytest.mark.parametrize("kind", ["force-sensor", "feedforward", "local"])
def test_charts_agree_with_eigenvalues(kind):
    assert_right(look_at(kind, range(10)), 10)


def test_charts_of_all_three_together_agree_with_eigenvalues():
    assert_right(look_at("all", range(10)), 10)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_thousands_of_charts_agree_with_eigenvalues(kind):
    count = study_size(continuous=250, full=5000)
    assert_right(look_at(kind, range(1000, 1000 + count)), count)


@pytest.mark.parametrize("kind", KINDS)
def test_no_wall_decays_faster_than_the_fastest(kind):
    """The wall that the chart names has the radius it says, and none of many others about it has a smaller one."""
    tried = 0
    for number in range(5):
        rng = np.random.default_rng([77, number])
        case = random_controlled_loop(rng, *KINDS[kind])
        try:
            chart = stability_chart(case.loop)
        except (ChartError, UnmovedError):
            continue
        fastest = chart.fastest_decay
        if fastest is None or case.loop.unobserved_modes:
            continue
        K, B, radius = fastest.stiffness, fastest.damping, fastest.spectral_radius
        tried += 1
        # what the chart leaves out are filters that no feedback uses, with roots of their own
        roots = np.linalg.eigvals(case.loop.transition_matrix(K, B))
        leading = roots[np.argmax(np.abs(roots))]
        # roots that coalesce are known to the cube root of rounding each, and their mean to rounding
        own = np.abs(roots[np.abs(roots - leading) < 1e-3].mean())
        assert own == pytest.approx(radius, abs=2e-6), number
        sizes = 10.0 ** rng.uniform(-6.0, -0.5, (2, 200)) * rng.choice([-1.0, 1.0], (2, 200))
        scale = np.array([max(abs(K), chart.stiffness_max), max(abs(B), chart.damping_max)])
        around = np.nan_to_num(scale)[:, None] * sizes + np.array([[K], [B]])
        L = case.loop.transition_matrix(*around)
        assert np.abs(np.linalg.eigvals(L)).max(axis=-1).min() > radius - 2e-6, number
    assert tried >= 3
