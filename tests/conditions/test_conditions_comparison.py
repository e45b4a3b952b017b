"""Conditions beside the exact limit of a device: the damping compared, what the file tells, keys, columns."""

from __future__ import annotations

from math import isnan

import pytest

from zwidth.chart import stability_chart
from zwidth.conditions import compare, compare_bounds
from zwidth.conditions.comparison import bounds_of
from zwidth.device import from_document
from zwidth.errors import ChartError

FRICTION = {"coulomb_N": 0.2}
ENCODER = {"encoder": {"resolution_m": 1e-5}}


def point(friction=None, loop=None, **plant):
    """A mass of 50 g under 1 kHz, with what is told of friction and encoder."""
    document = {
        "name": "paddle",
        "plant": {"mass_kg": 0.05, "damping_Ns_per_m": 0.5} | plant,
        "loop": {"sampling_period_s": 0.001} | (loop or {}),
    }
    return from_document(document | ({} if friction is None else {"friction": friction})).at()


@pytest.fixture(scope="module")
def bounds_comparison():
    return compare_bounds(point(FRICTION, ENCODER))


def by_name(comparison):
    return {bound.name: bound for bound in comparison.bounds}


def test_left_out_the_damping_is_that_of_the_stiffest_wall(bounds_comparison):
    chart = stability_chart(point().loop, decay=False)
    assert bounds_comparison.damping == bounds_comparison.damping_at_largest == chart.damping_at_stiffness_max
    assert bounds_comparison.exact == bounds_comparison.largest == chart.stiffness_max


def test_a_condition_that_holds_exactly_has_the_ratio_one(bounds_comparison):
    held = by_name(bounds_comparison)["rigid mass with friction"]
    assert held.holds
    assert bounds_comparison.ratio(held) == pytest.approx(1.0, rel=1e-9)
    softer = compare_bounds(point(), damping=5.0)
    assert softer.stiffness_max(held) == pytest.approx(softer.exact, rel=1e-9)
    assert softer.exact < softer.largest


def test_beyond_the_stable_walls_there_is_no_ratio():
    beyond = compare_bounds(point(), damping=500.0)
    assert beyond.exact == 0.0
    assert all(isnan(beyond.ratio(bound)) for bound in beyond.bounds)


@pytest.mark.parametrize(
    ("told", "lacking"),
    [
        ((None, None), ("coulomb_friction_N", "resolution_m")),
        ((FRICTION, None), ("resolution_m",)),
        ((None, ENCODER), ("coulomb_friction_N",)),
        ((FRICTION, ENCODER), ()),
    ],
)
def test_what_the_device_does_not_tell_is_lacking(told, lacking):
    encoder = by_name(compare_bounds(point(*told)))["passive spring under an encoder"]
    assert encoder.lacking == lacking


def test_the_conditions_are_those_of_the_loop_with_friction_and_step():
    device = point(FRICTION, ENCODER)
    there, plain = (
        bounds_of(device, 2.0),
        compare(device.loop, wall_damping=2.0, coulomb_friction=0.2, resolution=1e-5),
    )
    assert [bound.stiffness_max for bound in there] == pytest.approx(
        [bound.stiffness_max for bound in plain], rel=1e-15, nan_ok=True
    )
    assert [bound.violated for bound in there] == [bound.violated for bound in plain]


def test_a_chart_that_is_undecided_leaves_the_conditions(monkeypatch):
    def undecided(*_, **__):
        raise ChartError("open edge")

    monkeypatch.setattr("zwidth.conditions.comparison.stability_chart", undecided)
    found = compare_bounds(point())
    assert (found.chart, found.undecided, found.damping) == (None, "open edge", 0.0)
    assert isnan(found.exact)
    assert isnan(found.largest)
    assert found.document()["decided"] is False
    assert found.document()["undecided"] == "open edge"
    assert "undecided" in repr(found)


def test_keys_and_columns(bounds_comparison):
    document, table = bounds_comparison.document(), bounds_comparison.table()
    assert document.keys() == {
        "bounds",
        "damping_Ns_per_m",
        "exact_N_per_m",
        "exact_largest_N_per_m",
        "exact_damping_at_largest_Ns_per_m",
        "decided",
    }
    assert len(document["bounds"]) == len(bounds_comparison.bounds)
    assert {len(column) for column in table.values()} == {len(bounds_comparison.bounds)}
    assert table.keys() == document["bounds"][0].keys() - {"assumptions", "taken"}
    broken = next(n for n, bound in enumerate(bounds_comparison.bounds) if len(bound.violated) > 1)
    assert table["violated"][broken] == " ".join(bounds_comparison.bounds[broken].violated)
    there = [bounds_comparison.stiffness_max(bound) for bound in bounds_comparison.bounds]
    assert table["stiffness_max_N_per_m"] == pytest.approx(there, rel=0.0, abs=0.0, nan_ok=True)


def test_the_repr_has_the_main_numbers_in_few_lines(bounds_comparison):
    lines = repr(bounds_comparison).splitlines()
    assert len(lines) <= 5
    assert max(map(len, lines)) < 100
    assert f"{bounds_comparison.largest:.6g} N/m" in lines[0]
    assert f"{len(bounds_comparison.bounds)} conditions" in lines[1]


@pytest.mark.parametrize("damping", [float("nan"), float("inf"), "2"])
def test_a_damping_that_is_none_is_refused(damping):
    with pytest.raises(ValueError, match=r"^damping must"):
        compare_bounds(point(), damping)


def test_a_device_is_no_operating_point():
    device = from_document({"name": "m", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001}})
    with pytest.raises(TypeError, match=r"^point must .*OperatingPoint"):
        compare_bounds(device)
