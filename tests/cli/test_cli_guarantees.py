"""`zwidth guarantees`: the promised keys, couplings, figures, and no answer."""

from __future__ import annotations

import pytest

from tests.cli.command_runner import ONE_MASS, document_of, refusal_lines, run_command

KEYS = {
    "name",
    "meaning",
    "regions",
    "stiffness_max_N_per_m",
    "damping_at_stiffness_max_Ns_per_m",
    "source",
}


def test_a_paddle_has_its_guarantees_and_couplings(tmp_path):
    path = tmp_path / "guarantees.png"
    document = document_of("guarantees", ONE_MASS, "--coupling", "--stiffness", "5000", "--output", path)
    entries = {entry["name"]: entry for entry in document["guarantees"]}
    assert list(entries) == ["passive", "spring-stable", "nyquist-spring", "stable"]
    assert all(set(entry) == KEYS for entry in entries.values())
    peaks = [entries[name]["stiffness_max_N_per_m"] for name in ("passive", "spring-stable", "stable")]
    assert peaks == sorted(peaks)
    assert peaks[0] == pytest.approx(2000.0, rel=1e-9)
    coupling = document["coupling"]
    assert coupling["raisbeck"]["stiffness_max_N_per_m"] == pytest.approx(8000.0, rel=1e-6)
    assert coupling["limit"]["felt_stiffness_N_per_m"] == pytest.approx(2000.0, rel=1e-6)
    assert path.stat().st_size > 1000


def test_a_device_that_dissipates_nothing_has_only_its_chart():
    ran = run_command("guarantees", ONE_MASS, "--set", "plant.damping_Ns_per_m=0", "--json")
    assert ran.code == 0  # some wall is stable with a free hand
    passive = ran.document["guarantees"][0]
    assert passive["stiffness_max_N_per_m"] is None
    assert "no wall" in passive["reason"]


def test_a_wall_needs_the_coupling_it_is_for():
    assert "--coupling" in refusal_lines("guarantees", ONE_MASS, "--stiffness", "100")[0]
    assert "--stiffness" in refusal_lines("guarantees", ONE_MASS, "--coupling", "--damping", "1")[0]
