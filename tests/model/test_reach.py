"""What no chain of links can span is told at once, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
from model_cases import KINDS, five_bar

from zwidth.model import posture_batch
from zwidth.model.mechanism_arrays import pack
from zwidth.model.posture import OK, OUT_OF_REACH, solve_posture
from zwidth.model.reach_shells import outside_shells, shells
from zwidth.model.roadmap import roadmap


@pytest.mark.parametrize("kind", KINDS)
def test_no_position_that_the_handle_takes_is_beyond(kind):
    rng = np.random.default_rng(11)
    mechanism = KINDS[kind](rng)
    reference = solve_posture(mechanism, mechanism.reference_position)
    road = roadmap(pack(mechanism), 0, reference.angles)
    assert len(road.position) > 10
    assert not outside_shells(pack(mechanism), 0, road.position).any()


def test_a_five_bar_has_a_shell_for_each_of_its_arms():
    lengths = (0.146, 0.199, 0.12, 0.21)
    found = shells(pack(five_bar(lengths=lengths)), 0)
    spans = sorted((round(shell.least, 6), round(shell.most, 6)) for shell in found)
    assert len(spans) == 2
    assert pytest.approx(spans[0]) == (0.199 - 0.146, 0.146 + 0.199)


def test_the_short_cut_changes_no_answer(monkeypatch):
    """A grid over more than the workspace, with and without it."""
    mechanism = five_bar()
    grid = np.stack(np.meshgrid(np.linspace(-0.4, 0.4, 33), np.linspace(-0.4, 0.4, 31)), axis=-1)
    quick = solve_posture(mechanism, grid)
    nothing_outside = lambda mech, design, goals: np.zeros(len(goals), dtype=bool)  # noqa: E731
    monkeypatch.setattr(posture_batch, "outside_shells", nothing_outside)
    full = solve_posture(mechanism, grid)
    assert (quick.status == full.status).all()
    assert {OK, OUT_OF_REACH} <= set(np.unique(quick.status).tolist())
    assert np.nanmax(np.abs(quick.jacobian - full.jacobian)) < 1e-9
