"""The figure of a simulated contact: four panels, nothing lost of a long run."""

from __future__ import annotations

import numpy as np
import pytest

from tests.show.show_cases import check_legends_lie_beside
from tests.systems import published
from zwidth.contact.environments import ENVIRONMENTS
from zwidth.contact.response import SOURCES
from zwidth.contact.simulate import simulate
from zwidth.show.figures.motion import DRAWN, draw_motion, motion_figure, swept
from zwidth.show.figures.style import save

WALL = ENVIRONMENTS["wall"]


def drawn(duration, *, trail=True, damping=10.0):
    values = WALL.values(stiffness=4000.0, damping=damping)
    response = simulate(published(), WALL, values, duration=duration, start_position=1e-3, trail=trail)
    made, axes = motion_figure()
    draw_motion(axes, response)
    return response, made, axes


def test_four_panels_share_their_time_and_name_their_units(tmp_path):
    response, made, axes = drawn(0.3)
    made.canvas.draw()
    assert [ax.get_ylabel() for ax in axes] == [
        "Position [mm]",
        "Penetration [mm]",
        "Force [N]",
        "Energy since start [mJ]",
    ]
    assert axes[-1].get_xlabel() == "Time [ms]"
    assert len({ax.get_xlim() for ax in axes}) == 1
    position, depth, force, energy = axes
    assert position.lines[0].get_ydata()[-1] == response.trail[-1]
    assert position.lines[1].get_ydata() == pytest.approx(response.reading)
    assert depth.lines[0].get_ydata() == pytest.approx(response.penetration)
    assert force.lines[0].get_ydata() == pytest.approx(response.force)
    assert force.lines[0].get_drawstyle() == "steps-post"
    assert energy.lines[0].get_ydata() == pytest.approx(response.stored)
    save(made, tmp_path / "motion.png")


def test_the_largest_entries_of_the_ledger_are_drawn():
    response, _, axes = drawn(0.3)
    size = dict(zip(SOURCES, np.abs(response.energies).max(axis=0), strict=True))
    names = [text.get_text() for text in axes[-1].get_legend().get_texts()]
    assert names == ["stored", *sorted(size, key=size.get, reverse=True)[:3]]


def test_legends_do_not_lie_on_other_panels():
    _, made, axes = drawn(0.3)
    check_legends_lie_beside(made, axes)


def test_a_long_run_is_drawn_as_what_it_sweeps_over():
    response, made, axes = drawn(20.0, damping=0.0)
    assert len(response.time) > DRAWN
    made.canvas.draw()
    band = axes[2].collections[0].get_paths()[0].vertices[:, 1]
    assert band.min() == response.force.min()
    assert band.max() == response.force.max()


def test_nothing_is_lost_between_bins():
    rng = np.random.default_rng(3)
    for count in (600, 601, 7919):
        time, values = np.arange(count) * 0.1, rng.normal(size=count)
        edges, low, high = swept(time, values)
        assert (low.min(), high.max()) == (values.min(), values.max())
        assert np.all(np.diff(edges) >= 0.0)
        at = np.searchsorted(edges, time, side="right") - 1
        assert np.all((low[at] <= values) & (values <= high[at]))


def test_a_run_without_its_trail_is_drawn_by_its_samples():
    response, _, axes = drawn(0.3, trail=False)
    assert axes[0].lines[0].get_ydata() == pytest.approx(response.handle)
