"""Members of a family that are built together are the members built alone, and so is all that is said of them."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest

from zwidth.chart import spectral_radii, spectral_radius
from zwidth.device import from_document, new_device
from zwidth.device.load import load
from zwidth.loop import CHAINED
from zwidth.study import Family, FamilyMember, Range, robust_study
from zwidth.study.robust import family as robust_family
from zwidth.study.robust import unseen_members
from zwidth.study.robust.family import build_together

LENGTHS = ("links.upper-left.length_m", "links.distal-right.length_m")
FIVE_BAR = (
    *LENGTHS,
    "links.upper-right.mass_kg",
    "links.upper-right.center_of_mass_m.1",
    "links.upper-left.origin_m.0",
    "links.distal-left.inertia_kg_m2",
    "drives.motor-left.stiffness_Nm_per_rad",
    "drives.motor-right.motor_inertia_kg_m2",
    "drives.motor-right.torque_constant_Nm_per_A",
    "mechanism.damping.mode_ratio",
    "mechanism.reference.position_m.1",
    "loop.sampling_period_s",
    "loop.delay_samples",
)
TWO_MASS = (
    "plant.mass_kg.0.0",
    "plant.mass_kg.0.1",
    "plant.mass_kg.1.1",
    "plant.stiffness_N_per_m.0.1",
    "plant.sensor.0",
    "plant.actuator.1",
    "loop.sampling_period_s",
    "loop.delay_samples",
)
SPREAD = {"loop.delay_samples": (0.4, 2.6), "links.upper-left.origin_m.0": (-0.02, 0.02)}
SPREAD |= {"plant.mass_kg.0.1": (-0.005, 0.005), "plant.sensor.0": (-0.1, 0.2)}


def random_family(name, paths, rng, spread, operators=()):
    """A device with two to four of these numbers in ranges, the delay across whole samples."""
    device = load(name)
    chosen = rng.choice(paths, size=int(rng.integers(2, 5)), replace=False)
    ranges = []
    for path in map(str, chosen):
        value = robust_family.address.get(device.document, path) if path not in SPREAD else 0.0
        low, high = SPREAD.get(path, sorted((value * (1.0 - spread), value * (1.0 + spread))))
        ranges.append(Range(path, low, high))
    return Family(device, tuple(ranges), operators, device.at())


def random_members(family, rng, count):
    """Random ones, some of them at ends of their ranges."""
    shares = np.clip(rng.uniform(-0.2, 1.2, (count, len(family.ranges))), 0.0, 1.0)
    operators = rng.integers(max(len(family.operators), 1), size=count)
    return [FamilyMember(int(n), tuple(row)) for n, row in zip(operators, shares.tolist(), strict=True)]


def alone(family, member):
    """The loop of a member built by itself, as a family does that was never asked for many; None if it fails."""
    try:
        return replace(family).loop(member)
    except (ValueError, np.linalg.LinAlgError):
        return None


def reason(family, member):
    """Why a member cannot be built."""
    try:
        family.loop(member)
    except ValueError as error:
        return str(error)
    return ""


def coupled(loop):
    """Whether damping couples the modes, so that the sampled plant is a chain."""
    return bool(np.any(loop.sections.rows[:, CHAINED]))


def walls_of(loop, rng, count=3):
    """Stiff and soft walls of a loop, in units of its inertia."""
    K = 10.0 ** rng.uniform(1.0, 4.5, count)
    return K, K * loop.period * rng.uniform(0.0, 3.0, count)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
@pytest.mark.parametrize("spread", [0.05, 0.5, 1.1])
@pytest.mark.parametrize(("name", "paths"), [("five-bar", FIVE_BAR), ("published-two-mass", TWO_MASS)])
def test_members_built_together_are_the_members_alone(name, paths, spread, seed):
    rng = np.random.default_rng([seed, int(100 * spread)])
    family = random_family(name, paths, rng, spread)
    members = random_members(family, rng, 24)
    seen = set()
    for built in build_together(family, members):
        assert built.table is not None
        for n, row in enumerate(built.rows.tolist()):
            seen.add(row)
            single = alone(family, members[row])
            assert single is not None, members[row]
            K, B = walls_of(single, rng)
            expected = spectral_radius(single, K, B)
            assert spectral_radius(family.loop(members[row]), K, B) == pytest.approx(expected, abs=1e-9)
            together = spectral_radii(built.table, np.full(3, n), K, B)
            assert coupled(single) or not np.isnan(together).any()
            assert together == pytest.approx(np.where(np.isnan(together), np.nan, expected), abs=1e-9, nan_ok=True)
    if spread == 0.05:
        assert seen == set(range(24))


def test_members_that_cannot_be_built_are_left_out_and_say_why():
    """A mass matrix that loses its definiteness, and a length with which the handle is out of reach."""
    masses = load("published-two-mass")
    coupled = Family(masses, (Range("plant.mass_kg.0.1", 0.0, 0.2),), (), masses.at())
    linkage = load("five-bar")
    short = Family(linkage, (Range("links.distal-left.length_m", 0.02, 0.25),), (), linkage.at())
    for family in (coupled, short):
        members = [FamilyMember(0, (share,)) for share in np.linspace(0.0, 1.0, 11).tolist()]
        rows = {row for built in build_together(family, members) for row in built.rows.tolist()}
        assert rows == {n for n, member in enumerate(members) if alone(family, member) is not None}
        assert 0 < len(rows) < 11
        for n in set(range(11)) - rows:
            assert reason(family, members[n]) == reason(replace(family), members[n])


def test_operators_are_groups_of_their_own():
    device = load("published-two-mass")
    ranges = (Range("plant.mass_kg.1.1", 0.02, 0.03), Range("loop.delay_samples", 0.5, 1.5))
    family = Family(device, ranges, ("none", "thesis-arm"), device.at())
    rng = np.random.default_rng(3)
    members = random_members(family, rng, 20)
    groups = build_together(family, members)
    assert sorted(row for built in groups for row in built.rows.tolist()) == list(range(20))
    for built in groups:
        assert len({members[row].operator for row in built.rows.tolist()}) == 1
    for member in members:
        single = alone(family, member)
        K, B = walls_of(single, rng)
        expected = spectral_radius(single, K, B)
        assert spectral_radius(family.loop(member), K, B) == pytest.approx(expected, abs=1e-9)


def test_a_posture_keeps_its_position_while_lengths_change_and_joint_angles_are_left_to_each():
    device = load("five-bar")
    ranges = tuple(Range(path, 0.14, 0.2) for path in LENGTHS)
    members = [FamilyMember(0, (0.1, 0.9)), FamilyMember(0, (0.9, 0.8))]
    by_position = Family(device, ranges, (), device.at((0.03, 0.24)))
    (built,) = build_together(by_position, members)
    np.testing.assert_allclose(built.point.posture.position, [[0.03, 0.24, 0.0]] * 2, atol=1e-12)
    angles = {"upper-right": 0.65, "upper-left": 2.491}
    assert build_together(Family(device, ranges, (), device.at(angles)), members) == []


def test_what_may_turn_an_axis_is_checked_one_by_one():
    """A single moment of inertia serves a link only as long as it turns about no other direction."""
    device = from_document(tomllib.loads(new_device("arm", "serial-2r")))
    device = device.with_({"links.lower.orientation_rad": [0.0, 0.0, 0.0]})
    family = Family(device, (Range("links.lower.orientation_rad.0", 0.0, np.pi),), (), device.at())
    assert build_together(family, [FamilyMember(0, (0.0,)), FamilyMember(0, (0.5,))]) == []
    with pytest.raises(ValueError, match="one number"):
        family.loop(FamilyMember(0, (0.5,)))


def studied(family, monkeypatch=None, **arguments):
    """A study, and its numbers; with `monkeypatch` each member is built alone."""
    if monkeypatch is not None:
        monkeypatch.setattr(robust_family, "build_at_point", lambda groups, point: iter(()))
    study = robust_study(family, **arguments)
    document = study.document()
    return study, {key: document[key] for key in ("members", "failed", "binding", "search", "violation")}


def assert_same(one, other):
    """Documents are the same but for rounding."""
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for key in one:
            assert_same(one[key], other[key])
    elif isinstance(one, list):
        assert len(one) == len(other)
        for first, second in zip(one, other, strict=True):
            assert_same(first, second)
    elif isinstance(one, float):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9)
    else:
        assert one == other


def one_mass(**loop):
    return from_document(
        {
            "name": "m",
            "plant": {"mass_kg": 0.1},
            "loop": {"sampling_period_s": 0.001, "delay_samples": 0.5, **loop},
        }
    )


STUDIES = {
    "too few members": (
        load("published-two-mass"),
        (
            Range("plant.mass_kg.0.0", 0.05, 0.5),
            Range("plant.mass_kg.1.1", 0.01, 0.05),
            Range("plant.stiffness_N_per_m.1.1", 15620.0, 40000.0),
        ),
        {"members": 3, "unseen": 120},
    ),
    "delays across a sample": (
        one_mass(),
        (Range("loop.delay_samples", 0.6, 1.4), Range("plant.mass_kg", 0.1, 0.3)),
        {"members": 6, "unseen": 60},
    ),
    "lengths": (
        load("five-bar"),
        (Range("links.distal-left.length_m", 0.08, 0.25), Range("loop.sampling_period_s", 0.001, 0.0015)),
        {"members": 5, "unseen": 12},
    ),
}


@pytest.mark.parametrize("kind", STUDIES)
def test_a_study_says_the_same_of_members_built_together_and_alone(kind, monkeypatch):
    device, ranges, arguments = STUDIES[kind]
    together, numbers = studied(Family(device, ranges, (), device.at()), **arguments)
    by_itself, expected = studied(Family(device, ranges, (), device.at()), monkeypatch, **arguments)
    assert_same(numbers, expected)
    assert together.chart.stiffness_max == pytest.approx(by_itself.chart.stiffness_max, rel=1e-9)
    assert together.chart.stable_area == pytest.approx(by_itself.chart.stable_area, rel=1e-9)
    if kind == "too few members":
        assert numbers["violation"]["violating"] > 0
        assert numbers["violation"]["worst_stiffness_share"] > 0.0
        assert numbers["search"]["sampled"] < len(numbers["members"])
    if kind == "lengths":
        assert numbers["failed"]
        assert numbers["violation"]["unseen"] < 12


def test_how_unseen_members_are_split_changes_no_bit(monkeypatch):
    device, ranges, arguments = STUDIES["too few members"]
    whole, _ = studied(Family(device, ranges, (), device.at()), **arguments)
    monkeypatch.setattr(unseen_members, "AT_ONCE", 7)
    split, _ = studied(Family(device, ranges, (), device.at()), **arguments)
    assert split.violation == whole.violation


def test_valid_members_are_not_built_alone(monkeypatch):
    device = load("five-bar")
    ranges = (Range(LENGTHS[0], 0.14, 0.155), Range("loop.delay_samples", 0.5, 1.5))
    family = Family(device, ranges, (), device.at())
    assert not family.faults()  # builds each end of each range
    monkeypatch.setattr(Family, "faults", lambda self: [])
    monkeypatch.setattr(robust_family, "from_document", lambda *_, **__: pytest.fail("built alone"))
    study = robust_study(family, 16, 50)
    assert study.violation.unseen == 50
    assert not study.chart.failed
