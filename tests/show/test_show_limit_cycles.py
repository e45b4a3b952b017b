"""Figures of limit cycles and of the friction-quantisation plane: what stands on the axes is what was computed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.show.test_show_felt import texts
from tests.systems import mass
from zwidth.contact import device_plane
from zwidth.contact.harmonic_balance import harmonic_balance
from zwidth.loop import Controller, Loop
from zwidth.model import Counter, Friction, Nonlinear
from zwidth.show import figure
from zwidth.show.figures.limit_cycles import draw_balance, draw_plane

LOOP = Loop(mass(0.1, 0.1), Controller(0.001))
ROUGH = Nonlinear((Friction(np.ones(1), 0.02),), (Counter(np.ones(1), 2e-5),))


def test_growth_is_seen_on_both_sides_of_zero_and_cycles_are_named():
    found = harmonic_balance(LOOP, 400.0, 0.0, coulomb_friction=0.01, force_limit=1.0)
    made, ax = figure()
    draw_balance(ax, found)
    swings = np.isfinite(found.growth)
    assert ax.lines[0].get_ydata()[swings] == pytest.approx(found.growth[swings])
    small, large = (cycle.amplitude for cycle in found.cycles)
    assert texts(ax)[1].startswith("unstable limit cycle: 2.015 mm, 10.06 Hz")
    assert texts(ax)[2].startswith("stable limit cycle: ")
    left, right = ax.get_xlim()
    assert left <= small / 5.0
    assert 2.0 * large <= right <= 2.0 * found.largest_motion
    low, high = ax.get_ylim()
    assert low < 0.0 < np.max(found.growth) < high
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Amplitude", "Growth rate [1/s]")
    made.draw_without_rendering()
    ticks = [tick.get_text().replace("\u00a0", " ") for tick in ax.get_xticklabels()]
    assert {"100 µm", "1 mm", "10 mm"} <= set(ticks)


def test_without_a_cycle_all_amplitudes_are_drawn():
    found = harmonic_balance(LOOP, 100.0, 0.0, force_limit=1.0)
    assert found.cycles == ()
    made, ax = figure()
    draw_balance(ax, found)
    swings = found.amplitude[np.isfinite(found.growth)]
    assert ax.get_xlim() == (swings[0], min(swings[-1], 2.0 * found.largest_motion))
    assert texts(ax)[-1] == "no limit cycle"
    assert ax.get_ylim()[0] < np.nanmin(found.growth[np.isfinite(found.growth)]) < 0.0 < ax.get_ylim()[1]
    made.draw_without_rendering()


@pytest.mark.parametrize(
    ("damping", "said"), [(0.1, "the device, by wall stiffness"), (0.0, "the device has no viscous friction")]
)
def test_the_device_stands_in_the_plane_where_it_is(damping, said):
    loop = Loop(replace(mass(0.1, damping), nonlinear=ROUGH), Controller(0.001))
    found = device_plane(loop, [100.0, 200.0, 1000.0])
    made, ax = figure()
    draw_plane(ax, found)
    assert texts(ax)[0].startswith(said)
    device = ax.lines[-1]
    assert device.get_ydata() == pytest.approx(found.sigma)
    assert device.get_xdata() == pytest.approx(np.maximum(found.beta, ax.get_xlim()[0]))
    named = [text.get_text().replace("\u00a0", " ") for text in ax.texts]
    assert named[-3:] == ["100.0 N/m", "200.0 N/m", "1.000 kN/m"]
    assert {"passive", "small vibrations", "large vibrations"} < set(named)
    made.draw_without_rendering()


def test_what_is_farther_than_the_device_moves_is_grey():
    found = harmonic_balance(LOOP, 400.0, 0.0, coulomb_friction=0.01, force_limit=1.0, largest_motion=2.5e-3)
    small, large = found.cycles
    assert (small.within_range, large.within_range) == (True, False)
    made, ax = figure()
    draw_balance(ax, found)
    assert ax.get_xlim()[1] == pytest.approx(2.0 * 2.5e-3)
    said = texts(ax)
    assert any(line.startswith("unstable limit cycle: 2.015 mm") for line in said)
    assert any(line.startswith("predicted beyond the range: ") for line in said)
    assert "farther than the device moves, 2.500 mm" in said
    made.draw_without_rendering()
