"""What no chain of links can span is told at once, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest

from tests.model.model_cases import KINDS, five_bar
from zwidth.errors import OutOfReach
from zwidth.model import OK, OUT_OF_REACH, pack, posture_batch, solve_posture
from zwidth.model.posture import UNSOLVED
from zwidth.model.posture_batch import outside_shells, shells
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


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_certain_to_be_out_of_reach_is_so_alone(kind):
    """Positions all over, and a little beyond each shell: within the tolerance they may be projected."""
    rng = np.random.default_rng(12)
    mechanism, tolerance = KINDS[kind](rng), 0.01
    found = shells(pack(mechanism), 0)
    reach = max(float(shell.most) for shell in found)
    goals = [mechanism.reference_position + reach * rng.uniform(-1.0, 1.0, (12, 3)) * [1, 1, 0.1]]
    for shell in found:
        ways = rng.normal(size=(6, 3)) * [1, 1, 0.1]
        ways *= float(shell.most) / np.linalg.norm(ways, axis=1)[:, None]
        goals.append(shell.centre + ways * rng.uniform(1.0, 1.0 + 3.0 * tolerance, (6, 1)))
    goals = np.concatenate(goals)
    together = solve_posture(mechanism, goals, tolerance=tolerance, straight=True).status
    assert (together == OUT_OF_REACH).any()
    for goal, status in zip(goals, together, strict=True):
        if status == OUT_OF_REACH:
            with pytest.raises(OutOfReach):
                solve_posture(mechanism, goal, tolerance=tolerance)


def test_a_position_that_would_be_projected_is_left_to_be_decided_alone():
    mechanism = five_bar(lengths=(0.146, 0.199, 0.146, 0.199))
    goals = [[0.0, 0.345 * (1.0 + share), 0.0] for share in (0.005, 0.0099, 0.0101, 0.5)]
    status = solve_posture(mechanism, goals, tolerance=0.01, straight=True).status
    assert status.tolist() == [UNSOLVED, UNSOLVED, OUT_OF_REACH, OUT_OF_REACH]
