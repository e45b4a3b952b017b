"""The chart's numbers for plants whose answers are known."""

import numpy as np
import pytest

from tests.systems import mass, published, two_mass
from zwidth.chart import stability_chart
from zwidth.loop import Butterworth, Controller, Loop

RIGID = mass(0.287)
T = 0.00125

# loop, largest stiffness, at damping, frequencies, damping at K -> 0, area (independent brute force)
PUBLISHED = {
    "no structural damping": (
        published(0.0),
        (4033.83825717, 10.7414444, (169.834082,), 23.9047385, 64089.3003),
    ),
    "structural damping": (
        published(),
        (7133.86929380, 9.97478812, (174.547436,), 28.4474336, 138570.0695),
    ),
    "one sample of delay: a corner": (
        published(delay=1.0),
        (1101.30206608, 2.07670521, (9.628, 135.28), 4.17250259, 2346.02122),
    ),
    "rigid": (
        Loop(RIGID, Controller(T)),
        (126058.022906, 190.206868, (145.622666,), 459.2, 38362397.77),
    ),
}


@pytest.mark.parametrize("case", PUBLISHED)
def test_numbers_to_the_digits_known(case):
    loop, (stiffness, damping, frequencies, damping_max, area) = PUBLISHED[case]
    chart = stability_chart(loop, decay=False)
    assert chart.stiffness_max == pytest.approx(stiffness, rel=1e-11)
    assert chart.damping_at_stiffness_max == pytest.approx(damping, rel=3e-9)
    assert chart.frequencies_at_stiffness_max == pytest.approx(frequencies, rel=5e-5)
    assert chart.damping_max == pytest.approx(damping_max, rel=3e-9)
    assert chart.stable_area == pytest.approx(area, rel=1e-9)


@pytest.mark.parametrize(
    ("rule", "stiffness", "damping", "frequency", "damping_max"),
    [
        ("tustin", 2167.38666443, 8.14533155, 15.813584, 42.1176801),
        ("tustin-prewarped", 2174.58486623, 8.16440765, 15.841482, 42.1900705),
    ],
)
def test_filtered_velocity(rule, stiffness, damping, frequency, damping_max):
    chart = stability_chart(Loop(RIGID, Controller(T, 0.0, Butterworth(2, 20.0, rule))), decay=False)
    assert chart.stiffness_max == pytest.approx(stiffness, rel=1e-11)
    assert chart.damping_at_stiffness_max == pytest.approx(damping, rel=1e-8)
    assert chart.frequencies_at_stiffness_max == pytest.approx([frequency], rel=1e-7)
    assert chart.damping_max == pytest.approx(damping_max, rel=1e-8)
    # a second cell, at negative damping: the filter turns the phase of the damping round
    assert len(chart.regions) == 2
    assert chart.regions[1][:, 1].max() < 0.0 or chart.regions[0][:, 1].max() < 0.0


def test_a_sample_of_delay_leaves_the_undamped_flexible_plant_no_wall():
    chart = stability_chart(published(0.0, delay=1.0))
    assert chart.regions == ()
    assert np.isnan(chart.stiffness_max)
    assert chart.frequencies_at_stiffness_max == ()
    assert chart.damping_max == 0.0
    assert chart.stable_area == 0.0
    assert chart.fastest_decay is None


@pytest.mark.parametrize(
    ("delay", "stiffness", "damping"),
    [
        (0, 12.0 - 8.0 * np.sqrt(2.0), 2.0 * (np.sqrt(2.0) - 1.0)),
        (1, 0.144469, 0.424694),
        (2, 0.062430, 0.29139),
        (3, 0.034782, 0.22238),
        (5, 0.01535, 0.15116),
    ],
)
def test_normalised_delayed_mass(delay, stiffness, damping):
    chart = stability_chart(Loop(mass(1.0), Controller(1.0, float(delay))), decay=False)
    assert chart.stiffness_max == pytest.approx(stiffness, rel=4e-4 if delay == 5 else 2e-5)
    assert chart.damping_at_stiffness_max == pytest.approx(damping, rel=1e-4)


@pytest.mark.parametrize(("m", "b", "period", "exact"), [(0.1, 0.1, 0.001, 200.033), (0.1, 5.0, 0.01, 1090.498)])
def test_damped_mass_without_virtual_damping(m, b, period, exact):
    # the lower edge crosses B = 0 at K = b (1 - E)/((m/b)(1 - E) - T E), E = exp(-b T/m)
    chart = stability_chart(Loop(mass(m, b), Controller(period)), decay=False)
    E = np.exp(-b * period / m)
    K = b * (1.0 - E) / (m / b * (1.0 - E) - period * E)
    assert exact == pytest.approx(K, rel=3e-6)
    inside, outside = chart.check([K * (1 - 1e-4), K * (1 + 1e-4)], 0.0).names
    assert (inside, outside) == ("stable", "unstable")


def test_units_do_not_matter():
    # kilograms and seconds scaled: K by m/T^2, B by m/T
    plain = stability_chart(published())
    scaled = stability_chart(
        Loop(two_mass(261.6, 25.4, 15620e3 * 1e-6, 1874.4e-3 * 1.0), Controller(1.25)), decay=False
    )
    assert scaled.stiffness_max == pytest.approx(plain.stiffness_max * 1e-3, rel=1e-10)
    assert scaled.damping_at_stiffness_max == pytest.approx(plain.damping_at_stiffness_max, rel=1e-7)


def test_fastest_decay_of_the_published_plant():
    found = stability_chart(published()).fastest_decay
    assert (found.stiffness, found.damping) == pytest.approx((467.90, 21.9465), rel=3e-5)
    assert found.spectral_radius == pytest.approx(0.9454836, abs=5e-7)


def test_edges_at_4000_newtons_per_metre():
    chart = stability_chart(published(), decay=False)
    at = {2.42: "lower", 21.66: "upper"}
    for damping in at:
        names = chart.check(4000.0, [damping - 0.01, damping + 0.01]).names
        assert set(names) == {"stable", "unstable"}
