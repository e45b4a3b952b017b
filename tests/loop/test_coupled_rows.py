"""Rows of plants whose dampers couple motions of very unlike frequencies, held against matrices built apart."""

from __future__ import annotations

import numpy as np
import pytest

from tests.apart import ApartLoop, loop_of_every_kind
from zwidth.chart import boundary_points
from zwidth.errors import UnresolvedError
from zwidth.loop import sections
from zwidth.loop.pole_zero_form import rows_error, sample_form, separate_rows
from zwidth.model.first_order_form import first_order_form, without_hidden_poles

# Seeds and numbers of loops: with a fast pole that the wall does not move, of which rounding leaves something
# beside slow motions; and with a chain that loses digits, by 1e-5 to 0.15 of the response.
HIDDEN = ((20262, 4917), (20262, 5081), (20262, 6912), (20262, 15146))
LONG = ((20260, 11479), (20260, 15192), (20262, 6577), (20262, 7231))


@pytest.mark.parametrize(("seed", "number"), HIDDEN + LONG)
def test_walls_of_the_edge_have_a_root_on_the_circle(seed, number):
    loop = loop_of_every_kind(seed, number)
    K, B, _, edge = boundary_points(loop, 200)
    assert edge.any()
    roots = ApartLoop(loop).roots(K[edge], B[edge])
    assert np.abs(np.abs(roots) - 1.0).min(axis=1).max() < 1e-7


@pytest.mark.parametrize(("seed", "number"), LONG)
def test_decimals_keep_digits_that_a_chain_loses_and_rows_apart_some(seed, number, monkeypatch):
    """What a chain of doubles misses of the response, and what is taken in its place; without decimals, too."""
    loop = loop_of_every_kind(seed, number)
    form, states = form_and_states(loop)
    count = len(separate_rows(form, loop.period, loop.fractional_delay, loop.controller.actuator_time_constant))

    def taken_rows():
        return loop_of_every_kind(seed, number).sections.rows[-count:]

    exact = taken_rows()
    assert rows_error(exact, states) < 1e-10
    monkeypatch.setattr(sections, "exact_rows", lambda form, sampled, period: np.zeros((0, 8)))
    apart = taken_rows()
    assert not apart[:, 8].any()
    monkeypatch.setattr(sections, "FEW_DIGITS", np.inf)
    monkeypatch.setattr(sections, "LOST_DIGITS", np.inf)
    chain = taken_rows()
    assert chain[1:, 8].all()
    assert rows_error(exact, states) < rows_error(apart, states) < 0.1 * rows_error(chain, states)


def form_and_states(loop):
    form = without_hidden_poles(first_order_form(loop.plant, loop.period))
    lag = loop.controller.actuator_time_constant
    return form, sample_form(form, loop.period, loop.fractional_delay, lag)


def test_what_rounding_hides_is_answered_in_decimals_and_refused_without(monkeypatch):
    """Force and sensor at two masses that share a hundred-millionth of their motion."""
    K, B, _, edge = boundary_points(loop_of_every_kind(20260, 9795), 200)
    roots = ApartLoop(loop_of_every_kind(20260, 9795)).roots(K[edge], B[edge])
    assert edge.any()
    assert np.abs(np.abs(roots) - 1.0).min(axis=1).max() < 1e-9
    monkeypatch.setattr(sections, "exact_rows", lambda form, sampled, period: np.zeros((0, 8)))
    with pytest.raises(UnresolvedError, match=r"differ by \d"):
        _ = loop_of_every_kind(20260, 9795).sections
