"""Robust charts of devices known in ranges: what is sampled, found, claimed and refused."""

from __future__ import annotations

import re
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from zwidth.chart import judge
from zwidth.device import address, from_document
from zwidth.device.load import load
from zwidth.errors import NoAnswerError
from zwidth.study import Family, FamilyMember, Range, robust_study
from zwidth.study.robust.robust_study import sample_walls

PAGE = Path(__file__).parents[2] / "docs" / "robust.md"


def one_mass_device(**plant):
    return from_document(
        {
            "name": "m",
            "plant": {"mass_kg": 0.1} | plant,
            "loop": {"sampling_period_s": 0.001, "delay_samples": 0.5},
        }
    )


def family(device, *ranges, operators=()):
    return Family(device, ranges, operators, device.at())


def device_with_operator():
    return load("published-two-mass", (), "thesis-arm")


ARM = (
    Range("operator.arm_mass_kg", 0.3, 3.0),
    Range("operator.grasp_stiffness_N_per_m", 1e3, 3e4, True),
    Range("loop.delay_samples", 0.0, 0.3),
)


@pytest.fixture(scope="module")
def arm_study():
    return robust_study(family(device_with_operator(), *ARM), 30, 10)


def test_of_a_range_of_masses_and_delays_the_worst_ends_bind():
    study = robust_study(
        family(one_mass_device(), Range("plant.mass_kg", 0.1, 0.3), Range("loop.delay_samples", 0.2, 1.0)), 40, 200
    )
    worst = {"plant.mass_kg": 0.1, "loop.delay_samples": 1.0}
    (at_peak,) = study.chart.members_at_stiffness_max
    assert study.members[at_peak] == worst
    alone = robust_study(
        family(one_mass_device(), Range("plant.mass_kg", 0.1, 0.1), Range("loop.delay_samples", 1.0, 1.0))
    )
    assert study.chart.stiffness_max == pytest.approx(alone.chart.stiffness_max, rel=1e-12)
    assert alone.violation is None
    assert study.violation.unseen == 200
    assert study.violation.violating == 0
    assert study.violation.worst_spectral_radius <= 1.0 + 1e-9
    assert study.violation.worst_stiffness_share == 0.0
    assert study.settled


def test_corners_come_first_and_the_rest_lies_within(arm_study):
    study = arm_study
    corners = {(m, k, d) for m in (0.3, 3.0) for k in (1e3, 3e4) for d in (0.0, 0.3)}
    seen = [tuple(member.values()) for member in study.members]
    rounded = {tuple(round(value, 9) for value in values) for values in seen[: study.sampled]}
    assert corners <= rounded
    for values in seen:
        for one, value in zip(ARM, values, strict=True):
            assert one.low * (1 - 1e-12) <= value <= one.high * (1 + 1e-12)
    assert len(study.members) <= 30


def test_a_seed_gives_the_same_answer_again_and_another_seed_others():
    one, two, three = (
        robust_study(family(device_with_operator(), *ARM[:2]), 8, 12, seed=seed) for seed in (3, 3, 4)
    )
    assert one.members == two.members
    assert one.violation == two.violation
    assert one.chart.stiffness_max == two.chart.stiffness_max
    assert one.members != three.members


def test_the_search_finds_what_the_sample_missed(arm_study):
    from zwidth.study.robust import robust_study as module

    study = arm_study
    # the same members without any that the search found
    few = module.robust_chart_of_members(
        {k: module.chart_member(k, loop) for k, loop in study.chart.members.items() if k < study.sampled}, {}
    )
    assert len(study.members) > study.sampled
    assert study.chart.stable_area <= few.stable_area
    missed = sum(study.chart.spectral_radius(*sample_walls(few).T) > 1.0 + 1e-9)
    assert missed > 0


def test_promised_walls_are_stable_for_every_member_by_eigenvalues(arm_study):
    walls = sample_walls(arm_study.chart)
    assert len(walls) > 200
    assert np.all(arm_study.chart.spectral_radius(*walls.T) < 1.0 + 1e-9)


def test_an_honest_violation_is_stated_where_members_are_too_few():
    """With corners left out of a box, unseen members must find walls unstable, and say by how much."""
    ranges = tuple(Range(f"operator.{key}", *ends) for key, ends in {
        "arm_mass_kg": (0.3, 3.0),
        "arm_stiffness_N_per_m": (50.0, 2000.0),
        "arm_damping_Ns_per_m": (0.0, 20.0),
        "grasp_stiffness_N_per_m": (1e3, 3e4),
        "grasp_damping_Ns_per_m": (0.0, 50.0),
    }.items())  # fmt: skip
    study = robust_study(family(device_with_operator(), *ranges), 2, 200)
    violation = study.violation
    assert 0 < violation.violating < 200
    assert violation.worst_spectral_radius > 1.0 + 1e-6
    assert 0.0 < violation.worst_stiffness_share < 1.0
    assert set(violation.worst_member) == {one.path for one in ranges}
    # softening every wall by that share of the largest stiffness makes them stable for the member that is worst
    fam = family(device_with_operator(), *ranges)
    shares = tuple((violation.worst_member[r.path] - r.low) / (r.high - r.low) for r in ranges)
    loop = fam.loop(FamilyMember(0, shares))
    walls = sample_walls(study.chart)
    walls = walls[(walls[:, 0] > 0.0) & (walls[:, 1] >= 0.0)]
    bad = walls[judge(loop, *walls.T).spectral_radius > 1.0 + 1e-9]
    assert len(bad)
    softer = np.maximum(bad[:, 0] - (violation.worst_stiffness_share + 1e-9) * study.chart.stiffness_max, 0.0)
    assert np.all(judge(loop, softer, bad[:, 1]).spectral_radius < 1.0 + 1e-9)


def test_a_list_of_operators_is_complete():
    study = robust_study(family(load("published-two-mass"), operators=("none", "thesis-arm", "course-hand")))
    assert study.violation is None
    assert [member["operator"] for member in study.members] == ["none", "thesis-arm", "course-hand"]
    ones = [
        robust_study(family(load("published-two-mass"), operators=(name,))).chart
        for name in ("none", "thesis-arm", "course-hand")
    ]
    assert study.chart.stiffness_max <= min(one.stiffness_max for one in ones) * (1 + 1e-12)
    assert study.chart.lost_stiffness_share == pytest.approx(
        1.0 - study.chart.stiffness_max / max(one.stiffness_max for one in ones), rel=1e-9
    )


def test_operators_and_ranges_go_together():
    fam = family(
        load("published-two-mass"), Range("loop.delay_samples", 0.0, 0.4), operators=("none", "thesis-arm")
    )
    study = robust_study(fam, 20, 30)
    assert {member["operator"] for member in study.members} == {"none", "thesis-arm"}
    assert study.violation.unseen == 30


def test_members_in_which_only_the_operator_differs_are_built_the_same_both_ways():
    quick = family(device_with_operator(), *ARM[:2])
    slow = family(device_with_operator(), *ARM)
    for shares in ((0.0, 0.0), (0.3, 0.8), (1.0, 0.5)):
        one, two = quick.loop(FamilyMember(0, shares)), slow.loop(FamilyMember(0, (*shares, 0.0)))
        assert np.array_equal(one.transition_matrix(500.0, 2.0), two.transition_matrix(500.0, 2.0))


def test_a_number_off_the_diagonal_moves_with_its_mirror_image():
    one = Range("plant.stiffness_N_per_m.0.1", -16000.0, -15620.0)
    document = family(load("published-two-mass"), one).document(FamilyMember(0, (0.5,)))
    assert document["plant"]["stiffness_N_per_m"][0][1] == document["plant"]["stiffness_N_per_m"][1][0] == -15810.0


def test_a_coordinate_of_a_loops_point_moves_alone():
    device = load("novint-falcon")
    path = "mechanism.legs.leg.loops.parallelogram.points_m.0.1"
    value = address.get(device.document, path)
    document = family(device, Range(path, value, value + 1e-4)).document(FamilyMember(0, (1.0,)))
    assert document == address.assign(device.document, path, value + 1e-4)


def test_members_that_cannot_be_built_are_counted_and_named():
    """A mass matrix that loses its definiteness in one corner of the box only."""
    device = from_document(
        {
            "name": "m",
            "plant": {
                "mass_kg": [[0.3, 0.0], [0.0, 0.3]],
                "actuator": [1.0, 0.0],
                "sensor": [1.0, 0.0],
                "damping_Ns_per_m": [[1.0, 0.0], [0.0, 1.0]],
                "stiffness_N_per_m": [[0.0, 0.0], [0.0, 100.0]],
            },
            "loop": {"sampling_period_s": 0.001},
        }
    )
    ranges = (Range("plant.mass_kg.0.0", 0.1, 0.3), Range("plant.mass_kg.0.1", 0.0, 0.24))
    study = robust_study(family(device, *ranges), 20, 200)
    assert study.chart.failed
    assert all(study.members[k]["plant.mass_kg.0.1"] > 0.1 for k in study.chart.failed)
    assert set(study.chart.failed) | set(study.chart.members) == set(range(len(study.members)))
    assert study.violation.unseen < 200
    assert study.violation.unseen + study.violation.unknown == 200
    assert study.unknown_members >= len(study.chart.failed) + study.violation.unknown
    document = study.document()
    assert study.decided is document["decided"] is False
    assert document["unknown_members"] == study.unknown_members
    assert document["numbers_hold_for"] == "charted members"
    assert document["stiffness_max_is"] == "at most"
    assert document["violation"]["unknown"] == study.violation.unknown
    assert document["search"]["unknown"] == study.unknown_searched
    assert ": in doubt" in repr(study).splitlines()[0]


def test_nobody_to_chart_is_an_error(monkeypatch):
    fam = family(one_mass_device(), Range("plant.mass_kg", 0.1, 0.2))
    monkeypatch.setattr(Family, "loop", lambda self, point: (_ for _ in ()).throw(ValueError("no such thing")))
    with pytest.raises(NoAnswerError, match=r"none .*such thing"):
        robust_study(fam, 4, 4)


def test_the_page_runs_and_prints_what_it_says():
    pairs = re.findall(r"```python\n(.*?)```\n\n```\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(pairs) == 2
    for code, printed in pairs:
        out = StringIO()
        with redirect_stdout(out):
            exec(compile(code, str(PAGE), "exec"), {})
        assert out.getvalue() == printed
