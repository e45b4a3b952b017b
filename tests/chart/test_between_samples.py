"""What a curve of walls does between two of its samples: small loops, other branches, cells without a sample."""

from __future__ import annotations

import numpy as np
import pytest

from tests.systems import FEATURES, random_loop, reference_transition_matrix, two_mass
from zwidth.chart import ALL_NUMBERS, numbers_of_points
from zwidth.chart.chart_batch import STIFFEST, ChartNumbers, chart_numbers
from zwidth.chart.edge_memory import DOUBTFUL, FOUND
from zwidth.chart.roots import real_root
from zwidth.compiled import compiled
from zwidth.errors import UnmovedError
from zwidth.loop import Controller, Loop, OperatingPoint, table_of_loops
from zwidth.model import Plant

# Link-side and motor-side mass, spring, damper, sampling period, delay in samples, and the largest stiffness: by
# samples twenty times denser.
HIDDEN = {
    "the peak is a small loop of the curve, outside the set": (
        0.04023285675340597,
        0.4129068264642191,
        4251.220308373786,
        3.906285319103747,
        0.002736769530160504,
        0.0,
        47513.14732449874,
    ),
    "the same, with a fractional delay": (
        0.012787149872792645,
        0.043421570187559246,
        16504.872222307433,
        6.800903861741345,
        0.00019687493750727018,
        2.3440716969217616,
        79190.20077006648,
    ),
    "a straight line cuts off the peak": (
        0.6349060403852957,
        0.013422300065119604,
        327525.82940165186,
        32.29353075384507,
        0.0016934797967619885,
        0.0,
        322656.7700311287,
    ),
    "the peak is a thin tongue between the curve and a straight line": (
        0.3138294359755297,
        0.8285003577472144,
        285723.02405728534,
        150.51314595123657,
        0.0025514166020630513,
        0.0,
        170978.68547722907,
    ),
    "a maximum and a minimum in one step": (
        0.012209458351727279,
        0.04425311468859595,
        6453.351135702871,
        1.7709860043564158,
        0.0025659893719691715,
        0.0,
        7421.596686057824,
    ),
    "a second cell with all its arcs between samples": (
        0.8990182180182097,
        0.011768077116878465,
        87287.3505965981,
        0.2469898056254554,
        0.002214596333694222,
        2.260785365894316,
        17445.956358345888,
    ),
    "a second cell on a straight line": (
        0.1393664027275871,
        0.02587265559206743,
        853715.6441938536,
        51.38195765685822,
        0.0015588442586333918,
        0.0,
        63241.06883704639,
    ),
    "a straight line ends at B = 0 beyond a corner": (
        0.18738475159601065,
        0.04761912475281885,
        312554.5836388813,
        41.794660178730524,
        0.0015426672115056736,
        0.0,
        441979.9911915531,
    ),
    "the peak lies beyond the last sample": (
        0.038671263672318164,
        0.032635759599151284,
        85099.88572979599,
        22.033234055557614,
        0.001964086364463085,
        0.0,
        50942.79268273295,
    ),
    "two maxima in one step": (
        0.023813655563181553,
        0.14572579579263023,
        326464.89551191096,
        37.932483275282834,
        0.0001702692944319961,
        1.7111519170795706,
        546587.899080816,
    ),
}


@pytest.mark.parametrize("numbers", HIDDEN.values(), ids=HIDDEN)
def test_the_largest_stiffness_is_found_between_samples(numbers):
    *masses, period, delay, expected = numbers
    loop = Loop(two_mass(*masses), Controller(period, delay=delay))
    table = table_of_loops(loop)
    for what in (STIFFEST, ALL_NUMBERS):
        found = chart_numbers(table, what)
        assert found.status[0] == FOUND
        assert found.stiffness[0] == pytest.approx(expected, rel=1e-10)
    damping, largest = found.damping[0], max(found.damping[0], found.largest_damping[0])
    beside = np.logspace(-8.0, -2.0, 300)
    near = damping + largest * np.concatenate([-beside, [0.0], beside])
    near = near[near >= 0.0]

    def stable(stiffness: float, dampings: np.ndarray) -> bool:
        matrices = [reference_transition_matrix(loop, stiffness, B) for B in dampings]
        return bool((np.abs(np.linalg.eigvals(matrices)).max(axis=-1) < 1.0 + 1e-12).any())

    assert stable(expected * (1.0 - 1e-5), near)
    assert not stable(expected * (1.0 + 1e-5), np.concatenate([near, np.linspace(0.0, 1.2 * largest, 1001)]))


def designs(count: int, seed: int) -> OperatingPoint:
    """Random pairs of masses, modes from soft to beyond half the sampling rate, each with its own computer."""
    rng = np.random.default_rng(seed)
    link, motor = 10.0 ** rng.uniform(-2.0, 0.0, (2, count))
    period = 10.0 ** rng.uniform(-4.3, -2.3, count)
    frequency = 10.0 ** rng.uniform(0.5, np.log10(1.5 / period))
    reduced = link * motor / (link + motor)
    stiffness = reduced * (2.0 * np.pi * frequency) ** 2
    damping = 2.0 * rng.choice([0.001, 0.01, 0.1, 0.5, 1.5], count) * np.sqrt(stiffness * reduced)
    delay = rng.uniform(0.0, 3.0, count) * rng.integers(0, 2, count)
    return OperatingPoint(
        Controller(period, delay=delay), given_plant=Plant.two_masses(link, motor, stiffness, damping)
    )


def test_the_stiffest_wall_is_that_of_the_whole_edge():
    """The search that joins no rings, against the chart's."""
    point = designs(4_000, 1)
    compare(numbers_of_points(point, STIFFEST), numbers_of_points(point, ALL_NUMBERS))
    rng, loops = np.random.default_rng(7), []
    while len(loops) < 120:
        kind = str(rng.choice(["chain", "dense", "coupled", "apart"]))
        loop = random_loop(rng, kind=kind, features=[name for name in FEATURES if rng.random() < 0.3])
        try:
            _ = loop.sections
        except UnmovedError:
            continue
        loops.append(loop)
    table = table_of_loops(*loops)
    compare(chart_numbers(table, STIFFEST), chart_numbers(table, ALL_NUMBERS))


# Two masses whose stiffest wall is the tip of another region, thinner than samples are apart: both masses [kg],
# spring [N/m], damper [N s/m], sampling period [s].
THIN_TIPS = (
    (0.01623192823647311, 0.04762463958315099, 35470.497881770236, 9.76329948789438, 0.0015294219887945707),
    (0.0491474138593875, 0.015961523430560738, 977218.0026366629, 17.20298008273422, 0.000996095990629463),
    (0.20997772810539228, 0.03998806885521413, 518764.1443221464, 50.34392388532686, 0.0024655835990060205),
    (0.017851799521672766, 0.02700265484085537, 71011.04929947219, 14.286896065771305, 0.0015115847337645978),
)


def test_a_thin_tip_of_another_region_is_found():
    """One in a million of such designs; eigenvalues just below the tip, just above it, and over the region."""

    def radii(K, B):
        return np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max(axis=-1)

    for link, motor, stiffness, damping, period in THIN_TIPS:
        loop = Loop(Plant.two_masses(link, motor, stiffness, damping), Controller(period))
        found = chart_numbers(table_of_loops(loop), STIFFEST)
        (K,), (B,) = found.stiffness, found.damping
        row = B * (1.0 + np.linspace(-1e-5, 1e-5, 4001))
        assert np.any(radii((1.0 - 1e-6) * K, row) < 1.0)
        assert np.all(radii((1.0 + 1e-6) * K, row) > 1.0)
        # hardly one wall of a raster lies in a region so thin
        raster = radii(K * np.linspace(0.98, 0.999, 30)[:, None], B * np.linspace(0.5, 2.0, 401))
        assert np.mean(raster < 1.0) < 0.02


def compare(one: ChartNumbers, other: ChartNumbers) -> None:
    """Both have the same largest stiffness, wherever neither is in doubt; of the softest to 10 uN/m."""
    certain = (one.status != DOUBTFUL) & (other.status != DOUBTFUL)
    assert certain.sum() > 0.8 * len(certain)
    assert np.array_equal(one.status[certain], other.status[certain])
    np.testing.assert_allclose(one.stiffness[certain], other.stiffness[certain], rtol=1e-9, atol=1e-5)


@compiled
def _real_root(p: np.ndarray) -> float:
    return real_root(p)


def test_a_real_root_of_a_cubic():
    rng = np.random.default_rng(3)
    for _ in range(2000):
        one, other, third = 10.0 ** rng.uniform(-3.0, 3.0, 3) * rng.choice([-1.0, 1.0], 3)
        roots = [one + 1j * other, one - 1j * other, third] if rng.random() < 0.5 else [one, other, third]
        root = _real_root(np.real(np.poly(roots))[::-1] * 10.0 ** rng.uniform(-3.0, 3.0))
        assert min(abs(root - x) / abs(x) for x in roots if np.imag(x) == 0.0) < 1e-8
