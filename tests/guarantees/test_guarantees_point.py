"""Guarantees of a device at an operating point: who is left out, couplings, keys, columns and repr."""

from __future__ import annotations

from math import inf, isinf, isnan

import pytest

from zwidth.device import from_document
from zwidth.guarantees import guarantees_of
from zwidth.guarantees.region import empty_region

WITH_HANDLE = {"mass_kg": 0.03, "damping_Ns_per_m": 1.0, "handle": 1.0}
WITHOUT_HANDLE = {
    "mass_kg": [[0.03, 0.0], [0.0, 0.02]],
    "damping_Ns_per_m": [[2.0, -1.0], [-1.0, 1.0]],
    "stiffness_N_per_m": [[1e4, -1e4], [-1e4, 1e4]],
    "actuator": [0.0, 1.0],
    "sensor": [0.0, 1.0],
}
ARM = {
    "arm_mass_kg": 0.8,
    "arm_stiffness_N_per_m": 580.0,
    "arm_damping_Ns_per_m": 5.5,
    "grasp_stiffness_N_per_m": 1e4,
    "grasp_damping_Ns_per_m": 5.0,
}


def point(plant=WITH_HANDLE, **more):
    return from_document({"name": "p", "plant": plant, "loop": {"sampling_period_s": 0.001}} | more).at()


@pytest.fixture(scope="module")
def coupled():
    return guarantees_of(point(), wall=(5000.0, 0.0))


def test_the_bare_device_is_asked_about_whoever_holds_it(coupled):
    held = guarantees_of(point(operator=ARM))
    assert held.loop.plant.mass.shape == (1, 1)
    for name in ("passive", "stable"):
        assert held[name].region.stiffness_max == coupled[name].region.stiffness_max
    assert held["passive"].region.stiffness_max == pytest.approx(2000.0, rel=1e-9)


def test_couplings_are_there_if_they_are_asked_for(coupled):
    assert guarantees_of(point()).couplings is None
    plain = guarantees_of(point(), coupling=True)
    assert plain.couplings.limit is None
    assert plain.couplings.sampled.stiffness_max == pytest.approx(2000.0, rel=1e-6)
    assert coupled.couplings.limit.felt_stiffness == pytest.approx(2000.0, rel=1e-6)
    assert coupled.couplings.limit.needed
    soft = guarantees_of(point(), wall=(1500.0, 0.0)).couplings
    assert isinf(soft.limit.stiffness)
    assert not soft.limit.needed
    assert soft.document()["limit"] == {
        "stiffness_N_per_m": inf,
        "damping_Ns_per_m": 0.0,
        "felt_stiffness_N_per_m": 1500.0,
        "needed": False,
    }
    assert "no coupling" in repr(soft)


def test_without_a_handle_no_coupling_is_judged():
    found = guarantees_of(point(WITHOUT_HANDLE), coupling=True)
    assert "has none" in found.couplings.reason
    assert found.document()["coupling"] == {"reason": found.couplings.reason}
    assert found.couplings.table()["coupling"] == []
    assert found["passive-at-actuator"].region.stiffness_max > 0.0
    assert found["passive"].region.reason is not None


def test_keys_and_columns(coupled):
    document = coupled.document()
    assert document.keys() == {"guarantees", "coupling", "premises"}
    assert [entry["name"] for entry in document["guarantees"]] == [one.name for one in coupled.guarantees]
    assert document["guarantees"][0].keys() == {
        "name",
        "meaning",
        "regions",
        "stiffness_max_N_per_m",
        "damping_at_stiffness_max_Ns_per_m",
        "source",
    }
    assert document["coupling"].keys() == {"llewellyn", "raisbeck", "sampled", "limit"}
    for table, first, regions in (
        (coupled.table(), "guarantee", {one.name: one.region for one in coupled.guarantees}),
        (coupled.couplings.table(), "coupling", coupled.couplings.regions),
    ):
        assert list(table) == [first, "region", "stiffness_N_per_m", "damping_Ns_per_m"]
        assert table[first] == [name for name, region in regions.items() for ring in region.rings for _ in ring]
        corners = zip(table["stiffness_N_per_m"], table["damping_Ns_per_m"], strict=True)
        assert list(corners) == [
            tuple(corner) for one in regions.values() for ring in one.rings for corner in ring
        ]


def test_a_set_that_is_empty_says_why_under_its_keys():
    region = empty_region("no friction")
    document = region.document()
    assert document["reason"] == "no friction"
    assert isnan(document["stiffness_max_N_per_m"])
    assert repr(region).startswith("Region(0 rings, ")
    undamped = guarantees_of(point({"mass_kg": 0.03, "handle": 1.0}))
    assert undamped["passive"].region.reason is not None
    assert not undamped.is_empty
    assert "passive none" in repr(undamped)


def test_the_repr_has_the_stiffest_walls_in_few_lines(coupled):
    lines = repr(coupled).splitlines()
    assert len(lines) <= 5
    assert max(map(len, lines)) < 140
    assert "passive 2000 N/m" in lines[0]
    assert "felt 2000 N/m" in lines[-1]


def test_a_loop_is_no_operating_point():
    with pytest.raises(TypeError, match=r"^point must .*a Loop"):
        guarantees_of(point().loop)
