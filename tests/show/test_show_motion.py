"""The figure of a simulated contact: three panels, the part with the contact, nothing lost of a long run."""

from __future__ import annotations

import numpy as np
import pytest

from tests.show.show_cases import check_legends_lie_beside
from tests.systems import published
from zwidth.contact import ENVIRONMENTS, SOURCES, simulate
from zwidth.show import LONGEST_LINE, save
from zwidth.show.figures.contact_response import binned_extremes, contact_figure, draw_contact, time_window
from zwidth.show.units import energy_label

WALL = ENVIRONMENTS["wall"]


def simulate_and_draw(duration, *, trail=True, damping=10.0):
    values = WALL.values(stiffness=4000.0, damping=damping)
    response = simulate(published(), WALL, values, duration=duration, start_position=1e-3, trail=trail)
    made, axes = contact_figure()
    draw_contact(axes, response)
    return response, made, axes


def test_three_panels_share_their_time_and_name_their_units(tmp_path):
    response, made, axes = simulate_and_draw(0.3)
    made.canvas.draw()
    assert [ax.get_ylabel() for ax in axes] == [
        "Position [mm]",
        "Force [N]",
        "Energy since start [mJ]",
    ]
    assert axes[-1].get_xlabel() == "Time [ms]"
    assert len({ax.get_xlim() for ax in axes}) == 1
    position, force, energy = axes
    assert position.lines[0].get_ydata()[-1] == response.trail[-1]
    assert position.lines[1].get_ydata() == pytest.approx(response.reading)
    assert force.lines[0].get_ydata() == pytest.approx(response.force)
    assert force.lines[0].get_drawstyle() == "steps-post"
    assert energy.lines[0].get_ydata() == pytest.approx(response.stored)
    save(made, tmp_path / "motion.png")


def test_the_largest_entries_of_the_ledger_are_drawn():
    response, _, axes = simulate_and_draw(0.3)
    size = dict(zip(SOURCES, np.abs(response.energies).max(axis=0), strict=True))
    names = [text.get_text() for text in axes[-1].get_legend().get_texts()]
    assert names == ["stored", *map(energy_label, sorted(size, key=size.get, reverse=True)[:3])]
    assert energy_label("hold") == "sample and hold"


def test_legends_do_not_lie_on_other_panels():
    _, made, axes = simulate_and_draw(0.3)
    check_legends_lie_beside(made, axes)


def test_a_long_run_is_drawn_as_what_it_sweeps_over():
    response, made, axes = simulate_and_draw(20.0, damping=0.0)
    assert len(response.time) > LONGEST_LINE
    made.canvas.draw()
    band = axes[1].collections[0].get_paths()[0].vertices[:, 1]
    assert band.min() == response.force.min()
    assert band.max() == response.force.max()


def test_nothing_is_lost_between_bins():
    rng = np.random.default_rng(3)
    for count in (600, 601, 7919):
        time, values = np.arange(count) * 0.1, rng.normal(size=count)
        edges, low, high = binned_extremes(time, values)
        assert (low.min(), high.max()) == (values.min(), values.max())
        assert np.all(np.diff(edges) >= 0.0)
        at = np.searchsorted(edges, time, side="right") - 1
        assert np.all((low[at] <= values) & (values <= high[at]))


def test_of_a_run_that_soon_rests_the_part_with_the_contact_is_drawn():
    wall = ENVIRONMENTS["one_sided_wall"]
    values = wall.values(stiffness=4000.0, damping=10.0)
    response = simulate(published(), wall, values, duration=20.0, start_position=-1e-3, start_velocity=0.05)
    touching = response.time[response.force != 0.0]
    start, end = time_window(response)
    assert end < 0.1 * response.time[-1]
    assert start <= touching[0] < touching[-1] <= end
    made, axes = contact_figure()
    draw_contact(axes, response)
    made.canvas.draw()
    assert axes[0].get_xlim() == (start, end)
    assert axes[-1].get_xlabel() == "Time, of a run of 20.00\u00a0s [ms]"
    # what the handle does long after it left the wall does not press the contact into a line
    low, high = axes[0].get_ylim()
    assert high - low < 0.05 * np.ptp(response.reading)
    assert "in the wall" in [text.get_text() for text in axes[0].get_legend().get_texts()]


def test_a_run_that_goes_on_is_drawn_whole():
    response, _, axes = simulate_and_draw(0.3)
    assert time_window(response) == (0.0, response.time[-1])
    # the trail goes beyond the last sample, the panels do not
    assert {ax.get_xlim() for ax in axes} == {time_window(response)}


def test_a_run_without_its_trail_is_drawn_by_its_samples():
    response, _, axes = simulate_and_draw(0.3, trail=False)
    assert axes[0].lines[0].get_ydata() == pytest.approx(response.handle)
