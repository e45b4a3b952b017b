"""Walls in and about the charts of loops of every kind, judged by eigenvalues of matrices built apart.

The full size, ten million walls, is run by hand, some ten minutes on one core:

    ZWIDTH_FULL_STUDY=1 python -m pytest -m slow -s tests/chart/test_millions_of_walls.py
"""

from __future__ import annotations

import os
from collections import Counter

import numpy as np
import pytest
import shapely

from tests.apart import ApartLoop, ExactLoop, loop_of_every_kind
from zwidth.chart import stability_chart
from zwidth.chart.verdict import STABLE, UNDECIDED
from zwidth.errors import ChartError, UnmovedError

SEED = 20260
WALLS = 500  # of a loop, half as many where its matrix has more than 16 rows
# Half-width of the band round the unit circle in which a wall is left out: that in which `Chart.check` says
# "undecided", since undamped modes that the wall hardly moves stay in it.
BAND = 1e-9
# Distance from the outline, as a share of the cell's extent, within which its chords may be off: twice `CHORD`.
CHORDS = 2e-6
# How far a wall may move a root of a motion that the chart names as unobserved, and leaves out.
UNMOVED = 1e-6
CHECKED = 4  # walls of each loop for `Chart.check`
NEAR = 1e-3  # distance from the circle within which a root is refined


def walls_about(rng, chart, apart, count):
    """Walls (count, 2): a third in and about a cell's box, a third beside its edge, the others all over."""
    plant, T = apart.loop.plant, apart.loop.period
    inertia = 1.0 / (plant.actuator @ np.linalg.solve(plant.mass, plant.actuator))
    size = 10.0 ** rng.uniform(-5.0, 0.3, count)
    walls = (
        inertia
        / T
        * size[:, None]
        * np.column_stack([rng.choice([-0.2, 0.2, 1.0], count) / T, rng.uniform(-1.0, 3.0, count)])
    )
    rings = chart.regions
    for i, ring in enumerate(rings):
        low, high = ring.min(axis=0), ring.max(axis=0)
        share = count // (6 * len(rings))
        about = slice(4 * share * i, 4 * share * i + 2 * share)
        beside = slice(about.stop, about.stop + 2 * share)
        walls[about] = low - 0.2 * (high - low) + 1.4 * (high - low) * rng.random((2 * share, 2))
        distance = 10.0 ** rng.uniform(-6.0, -2.0, (2 * share, 1)) * rng.uniform(-1.0, 1.0, (2 * share, 2))
        walls[beside] = ring[rng.integers(len(ring), size=2 * share)] + distance * (high - low)
    if rings:  # softest walls, down to K = 0+
        soft = slice(count - count // 12, count)
        high = max(float(np.abs(ring[:, 0]).max()) for ring in rings)
        most = max(float(np.abs(ring[:, 1]).max()) for ring in rings)
        walls[soft, 0] = high * 10.0 ** rng.uniform(-6.0, -2.0, count // 12)
        walls[soft, 1] = most * rng.uniform(-0.1, 1.2, count // 12)
    return walls


def is_inside(rings, walls):
    """Which walls (k, 2) the chart's regions hold."""
    inside = np.zeros(len(walls), dtype=bool)
    for ring in rings:
        cell = shapely.Polygon(ring)
        shapely.prepare(cell)
        inside |= shapely.contains_xy(cell, *walls.T)
    return inside


def distance_to_outlines(rings, wall):
    """How far a wall is from the nearest outline, as a share of its extent."""
    distances = [np.inf]
    for ring in rings:
        extent = np.ptp(ring, axis=0)
        distances.append(shapely.distance(shapely.LinearRing(ring / extent), shapely.Point(wall / extent)))
    return min(distances)


def judge_loop(seed, number, counts, wrong):
    """Judge the walls of one loop; what is found is counted, and what is wrong listed."""
    loop, rng = loop_of_every_kind(seed, number), np.random.default_rng([seed, number, 1])
    try:
        chart = stability_chart(loop, decay=False)
        rings = chart.regions
    except UnmovedError:
        counts["loops that no wall moves"] += 1
        return
    except ChartError:
        counts["loops given up"] += 1
        return
    apart = ApartLoop(loop)
    size = len(apart.matrices[0])
    walls = walls_about(rng, chart, apart, WALLS if size <= 16 else WALLS // 2)
    inside, roots = is_inside(rings, walls), apart.roots(*walls.T)
    radius = np.abs(roots).max(axis=1)
    hidden = np.abs(radius - 1.0) <= BAND
    counts["loops"] += 1
    counts["walls"] += len(walls)
    counts["inside"] += int(inside.sum())
    counts["left out: in the band"] += int(hidden.sum())
    exact = ExactLoop(loop)

    def excess_of(i, moved=0.0):
        """The largest |z| - 1 of wall i, to many digits."""
        return exact.radius(*walls[i], roots[i][np.abs(roots[i]) > 1.0 - NEAR], moved)

    def settle(i, stable, what):
        """Judge a wall on which eigenvalues differ from a verdict, to many digits."""
        excess = excess_of(i)
        if abs(excess) <= BAND:
            counts["left out: in the band"] += 1
        elif (excess < 0.0) == stable:
            counts["right, eigenvalues were rounded"] += 1
        elif chart.unobserved_modes and (excess_of(i, UNMOVED) < 0.0) == stable:
            counts["left out: an unobserved motion"] += 1
        else:
            wrong.append((what, seed, number, *walls[i].tolist(), stable, float(excess)))

    for i in np.flatnonzero(((radius < 1.0) != inside) & ~hidden).tolist():
        distance = distance_to_outlines(rings, walls[i])
        if distance < CHORDS:
            counts["left out: on a chord"] += 1
        elif distance < 10.0 * chart.corner_blur and chart.corner_blur > 1e-7:
            counts["left out: at a blurred corner"] += 1
        else:
            settle(i, bool(inside[i]), "regions")
    checked = rng.integers(len(walls), size=CHECKED)
    verdict = chart.check(*walls[checked].T).verdict
    for i, said in zip(checked.tolist(), verdict.tolist(), strict=True):
        counts["checked, " + ("undecided" if said == UNDECIDED else "decided")] += 1
        if said != UNDECIDED and (said == STABLE) != (radius[i] < 1.0) and not hidden[i]:
            settle(i, said == STABLE, "check")


def judge_walls(seed, count):
    """Loops one after the other until so many walls are judged."""
    counts, wrong, number = Counter(), [], 0
    while counts["walls"] < count:
        judge_loop(seed, number, counts, wrong)
        number += 1
    return counts, wrong


def left_out(counts):
    """How many walls were left out, for whatever reason."""
    return sum(count for name, count in counts.items() if name.startswith("left out"))


def test_no_wall_of_thousands_is_wrong():
    counts, wrong = judge_walls(SEED + 1, 20_000)
    assert wrong == []
    assert counts["inside"] > 0.2 * counts["walls"]
    assert left_out(counts) < 0.05 * counts["walls"]


@pytest.mark.slow
def test_no_wall_of_millions_is_wrong():
    full = os.environ.get("ZWIDTH_FULL_STUDY") == "1"
    counts, wrong = judge_walls(SEED, 10_000_000 if full else 1_000_000)
    print(dict(counts), *wrong, sep="\n")
    assert wrong == []
    assert counts["loops given up"] <= 0.002 * counts["loops"]
    assert left_out(counts) < 0.02 * counts["walls"]
