"""The edge with a loss factor that fits compare points with, against the whole chart with cells counted."""

from dataclasses import replace

import numpy as np
import pytest

from tests.systems import random_controller, random_plant
from zwidth.chart import EdgeChords, hysteretic_chart
from zwidth.chart.hysteretic_response import hysteretic_edge
from zwidth.errors import HysteresisError
from zwidth.loop import Loop

CLOSE = 1e-4  # share of the chart's dampings; the sides of the chart's cells lie within 1e-5 of its window


def lossy_loop(seed):
    """Two to four masses with a loss factor of 1 to 50 %, and a random computer."""
    rng = np.random.default_rng([51, seed])
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0))
    plant = random_plant(rng, rate, (0.0,), str(rng.choice(["chain", "dense", "apart"])))
    lossy = replace(
        plant, damping=0.0 * plant.damping, hysteresis=10.0 ** rng.uniform(-2.0, -0.3) * plant.stiffness
    )
    return Loop(lossy, random_controller(rng, rate))


def largest_difference(loop):
    """Between edge and chart, lower and upper, at 49 stiffnesses, over the chart's dampings; nan where the edge
    crosses a stiffness that the chart crosses nowhere, or the other way; None where nothing is stable."""
    rings = [np.asarray(ring) for ring in hysteretic_chart(loop).regions]
    if not rings:
        return None
    first, last = np.vstack([ring[:-1] for ring in rings]), np.vstack([ring[1:] for ring in rings])
    sides, edge = EdgeChords(first, last, np.full(first.shape, np.nan)), hysteretic_edge(loop)
    _, K1, B0, B1 = sides.box
    K = np.linspace(0.02, 0.98, 49) * K1
    largest = 0.0
    for kind, near in (("lower", B0), ("upper", B1)):
        B = sides.crossings(K, np.full(49, near), kind)[0]
        on = np.isfinite(B)
        difference = np.abs(edge.crossings(K[on], B[on], kind)[0] - B[on]) / (B1 - B0)
        largest = float(np.max(difference, initial=largest))
    return largest


@pytest.mark.parametrize("seed", [49, 58])  # another arc than the viscous edge has; ends on both lines
def test_the_edge_of_a_loss_factor_is_that_of_its_chart_up_to_the_corners(seed):
    assert largest_difference(lossy_loop(seed)) < CLOSE


@pytest.mark.slow
def test_edges_of_a_hundred_random_loops_are_those_of_their_charts():
    wrong, compared = [], 0
    for seed in range(100):
        try:
            difference = largest_difference(lossy_loop(seed))
        except HysteresisError:
            continue
        compared += difference is not None
        if difference is not None and not difference < CLOSE:
            wrong.append((seed, difference))
    assert wrong == []
    assert compared > 30
