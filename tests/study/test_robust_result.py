"""What a robust study knows of itself: keys, columns, who binds how much of the edge, and a repr."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.study import Family, Range, robust_study

KEYS = {
    "regions",
    "boundary",
    "stiffness_max_N_per_m",
    "damping_at_stiffness_max_Ns_per_m",
    "frequency_at_stiffness_max_Hz",
    "frequencies_at_stiffness_max_Hz",
    "members_at_stiffness_max",
    "damping_max_Ns_per_m",
    "stable_area_N2s_per_m2",
    "fastest_decay",
    "fastest_decay_in_first_quadrant",
    "unobserved_modes",
    "members",
    "failed",
    "binding",
    "best_by_area",
    "best_by_stiffness",
    "lost_share",
    "lost_stiffness_share",
    "corner_blur",
    "search",
    "violation",
    "excluding",
    "decided",
    "edge_walls_in_doubt",
    "numbers_hold_for",
    "stiffness_max_is",
    "unknown_members",
}


@pytest.fixture(scope="module")
def robust_result():
    """A device held by arms of unknown mass and grasp, several of which bind."""
    device = load("published-two-mass", (), "thesis-arm")
    mass, grasp = ("operator.arm_mass_kg", 0.3, 3.0), ("operator.grasp_stiffness_N_per_m", 1e3, 3e4, True)
    return robust_study(Family(device, (Range(*mass), Range(*grasp)), (), device.at()), 12, 20)


@pytest.fixture(scope="module")
def empty_result():
    """K must outdo a spring that pushes away, which is more than another member stands."""
    device = from_document({"name": "m", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001}})
    spring = Range("plant.stiffness_N_per_m", -1e5, 5e4)
    return robust_study(Family(device, (spring,), (), device.at()), 12, 20)


def test_keys(robust_result):
    document = robust_result.document()
    assert document.keys() == KEYS
    assert document["violation"] == {
        "unseen": 20,
        "unknown": 0,
        "violating": 0,
        "worst_spectral_radius": robust_result.violation.worst_spectral_radius,
        "worst_stiffness_share": 0.0,
        "worst_member": None,
    }
    assert document["search"]["settled"] is robust_result.settled
    assert document["frequency_at_stiffness_max_Hz"] == min(robust_result.chart.frequencies_at_stiffness_max)
    assert document["excluding"] is None
    assert document["fastest_decay"] is document["fastest_decay_in_first_quadrant"] is None  # not searched for


def test_columns_are_the_arcs_of_the_edge(robust_result):
    table = robust_result.table()
    for index, arc in enumerate(robust_result.chart.boundary):
        rows = [n for n, one in enumerate(table["arc"]) if one == index]
        assert {table["member"][n] for n in rows} == {arc.member}
        np.testing.assert_array_equal([table["stiffness_N_per_m"][n] for n in rows], arc.stiffness)
        np.testing.assert_array_equal([table["damping_Ns_per_m"][n] for n in rows], arc.damping)
        np.testing.assert_array_equal([table["frequency_Hz"][n] for n in rows], arc.frequency)


def test_shares_of_the_edge_are_of_those_who_bind_and_add_up_to_one(robust_result):
    shares = robust_result.edge_shares
    assert set(shares) == set(robust_result.chart.binding)
    assert len(shares) > 1
    assert sum(shares.values()) == pytest.approx(1.0, abs=1e-12)
    assert list(shares.values()) == sorted(shares.values(), reverse=True)


def test_where_the_members_have_no_wall_in_common(empty_result):
    document = empty_result.document()
    assert document["frequency_at_stiffness_max_Hz"] is None
    assert document["frequencies_at_stiffness_max_Hz"] is None
    assert len(document["excluding"]) == 2
    assert "stable for" in repr(empty_result)
    assert set(empty_result.edge_shares) == {arc.member for arc in empty_result.chart.boundary}


def test_the_repr_has_the_main_numbers_in_few_lines(robust_result):
    lines = repr(robust_result).splitlines()
    assert len(lines) <= 5
    assert max(map(len, lines)) < 100
    assert f"{robust_result.chart.stiffness_max:.6g} N/m" in lines[1]
    assert "0 of 20 unseen" in lines[-1]
