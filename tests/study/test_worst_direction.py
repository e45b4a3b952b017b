"""The worst direction of each place, and the share of directions, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from tests.model.model_cases import random_five_bar, spatial_arm, spatial_loop
from zwidth.device.load import load
from zwidth.errors import MeasureError, NoValueError
from zwidth.loop import OperatingPoint
from zwidth.measures import MEASURES, NO_VALUE, OK, Measure
from zwidth.model import solve_posture
from zwidth.study import extreme_over_directions, parse_requirement, share_of_directions
from zwidth.study.designs.column import Requirement
from zwidth.study.workspace.extreme_direction import share_measure, sphere

KINDS = {"planar": random_five_bar, "arm": spatial_arm, "loop": spatial_loop}


def random_points(kind, seed, count=12):
    rng = np.random.default_rng(seed)
    mechanism = KINDS[kind](rng)
    spread = 0.02 * rng.normal(size=(count, 3)) * ([1, 1, 0] if kind == "planar" else [1, 1, 1])
    posture = solve_posture(mechanism, mechanism.reference_position + spread)
    controller = load("five-bar").controller
    along = np.broadcast_to([0.0, 1.0, 0.0], (count, 1, 3))
    return OperatingPoint(controller, mechanism, posture, along, model="full")


def quadratic_forms(place, name):
    """A with measure = 1/(u^T A u), over the directions that the handle can move in: (n, r, r)."""
    J = place.jacobian[place.status == OK]
    if J.shape[-1] == 2:
        J = J[:, :2]
    if name == "rigid_mass":
        return J @ np.linalg.solve(place.whole_mass_matrix[place.status == OK], np.swapaxes(J, -1, -2))
    drives = place.drives
    return J @ np.diag(1.0 / (drives.transmission**2 * drives.stiffness)) @ np.swapaxes(J, -1, -2)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ["rigid_mass", "stiffness"])
def test_extremes_are_the_eigenvalues(kind, seed, name):
    place = random_points(kind, seed)
    ok = place.status == OK
    assert ok.sum() >= 4
    values, vectors = np.linalg.eigh(quadratic_forms(place, name))
    for extreme, k in (("lowest", -1), ("highest", 0)):
        found = extreme_over_directions(MEASURES[name], place, extreme)
        np.testing.assert_allclose(found.extreme.values[ok], 1.0 / values[:, k], rtol=1e-8)
        assert np.isnan(found.extreme.values[~ok]).all()
        np.testing.assert_array_equal(found.extreme.status, place.status)
        u = found.direction[ok][:, : vectors.shape[-1]]
        cosine = np.abs(np.einsum("ni,ni->n", u, vectors[..., k]))
        gap = np.abs(values - values[:, [k]])
        clear = np.where(gap > 0, gap, np.inf).min(axis=1) > 1e-2 * values[:, -1]
        np.testing.assert_allclose(cosine[clear], 1.0, atol=1e-6)
        # the value is that of the direction which is told
        np.testing.assert_allclose(
            MEASURES[name].compute(place.towards(np.where(ok[:, None], found.direction, [0.0, 1.0, 0.0])))[ok],
            found.extreme.values[ok],
            rtol=1e-12,
        )


def test_worst_and_best_follow_what_a_designer_wants():
    place = random_points("planar", 7)
    stiffness, lower = MEASURES["stiffness"], MEASURES["position_resolution"]
    ok = place.status == OK
    worst, best = (extreme_over_directions(stiffness, place, e).extreme.values[ok] for e in ("worst", "best"))
    assert (worst < best).all()
    worst, best = (extreme_over_directions(lower, place, e).extreme.values[ok] for e in ("worst", "best"))
    assert (worst > best).all()
    with pytest.raises(MeasureError, match="better side"):
        extreme_over_directions(MEASURES["rigid_mass"], place, "worst")


def test_the_exact_stiffness_is_lowest_where_no_direction_is_lower():
    device = load("five-bar")
    place = device.at([[0.05, 0.2], [-0.1, 0.15]])
    found = extreme_over_directions(MEASURES["stiffness_max"], place, "worst")
    around = np.deg2rad(np.arange(0.0, 180.0, 3.0))
    for k in range(2):
        u = np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=-1)
        one = device.at(np.broadcast_to(place.posture.position[k], (60, 3))).towards(u)
        sampled = MEASURES["stiffness_max"].compute(one).values
        assert found.extreme.values[k] <= sampled.min() * (1.0 + 1e-9)
        assert found.extreme.values[k] > 0.99 * sampled.min()


def test_of_two_near_extremes_the_true_one_is_found():
    """A function with two minima, of which the samples often take the higher one for the lower."""

    def two(place):
        angle = np.arctan2(place.direction[..., 1], place.direction[..., 0])
        first, second = np.deg2rad(33.75), np.deg2rad(112.5)
        return np.minimum(0.01 + np.sin(angle - second) ** 2, 30.0 * np.sin(angle - first) ** 2 + 0.005)

    place = random_points("planar", 1)
    found = extreme_over_directions(Measure("two", "", "", "higher", "", two), place, "lowest")
    np.testing.assert_allclose(found.extreme.values[place.status == OK], 0.005, atol=1e-8)


def test_a_measure_that_tells_a_direction_from_its_opposite_is_asked_both_ways():
    along_x = Measure("x", "", "", "higher", "", lambda place: place.direction[..., 0])
    for kind in KINDS:
        place = random_points(kind, 2)
        ok = place.status == OK
        for extreme, value in (("lowest", -1.0), ("highest", 1.0)):
            found = extreme_over_directions(along_x, place, extreme)
            np.testing.assert_allclose(found.extreme.values[ok], value, atol=1e-9)
    half = share_of_directions(Requirement(along_x, True, 0.0), random_points("planar", 2))
    np.testing.assert_allclose(half[np.isfinite(half)], 0.5, atol=1e-6)


def test_a_direction_without_a_value_spoils_the_worst_and_is_left_out_of_the_best():
    def some(place):
        if place.direction[0] ** 2 > 0.8:
            raise NoValueError("not along x")
        return place.direction[1] ** 2

    place = random_points("planar", 3, count=3)
    measure = Measure("some", "", "", "higher", "", some, each=True)
    worst = extreme_over_directions(measure, place, "worst").extreme
    assert (worst.status == NO_VALUE).all()
    assert np.isnan(worst.values).all()
    assert worst.notes[0].reason.endswith(": not along x")
    best = extreme_over_directions(measure, place, "best").extreme
    assert (best.status == OK).all()
    np.testing.assert_allclose(best.values, 1.0, atol=1e-8)
    assert "left out: " in best.notes[0].reason
    assert best.notes[0].count == 3


def test_what_does_not_depend_on_the_direction_is_asked_once():
    asked = []

    def count(place):
        asked.append(place.shape)
        return np.ones(place.shape)

    place = random_points("planar", 4)
    found = extreme_over_directions(Measure("one", "", "", "higher", "", count, along=False), place, "worst")
    assert asked == [place.shape]
    assert np.isnan(found.direction).all()


def test_a_plant_has_one_direction_only():
    with pytest.raises(MeasureError, match=r"needs a \[mechanism\]"):
        extreme_over_directions(MEASURES["stiffness"], load("published-two-mass").at(), "worst")


# --- share of directions ---------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("part", [1e-4, 1e-3, 0.05, 0.3, 0.7, 0.999])
def test_the_share_in_a_plane_is_the_arc(seed, part):
    """u^T A u <= c over a share 2/pi asin(sqrt((c - l1)/(l2 - l1))) of the circle."""
    place = random_points("planar", seed)
    ok = np.flatnonzero(place.status == OK)[:3]
    values = np.linalg.eigvalsh(quadratic_forms(place, "rigid_mass"))[:3]
    for i, (low, high) in zip(ok, values, strict=True):
        bound = 1.0 / (low + part * (high - low))
        share = share_of_directions(Requirement(MEASURES["rigid_mass"], True, bound), place[i])
        assert share == pytest.approx(2.0 / np.pi * np.arcsin(np.sqrt(part)), abs=1e-6)


def test_the_share_of_the_sphere():
    """Against a million random directions."""
    place = random_points("arm", 5, count=4)
    u = np.random.default_rng(1).normal(size=(300_000, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    forms_ = quadratic_forms(place, "rigid_mass")
    bound = float(np.median(1.0 / np.linalg.eigvalsh(forms_)[:, 1]))
    share = share_of_directions(Requirement(MEASURES["rigid_mass"], True, bound), place)
    sampled = [np.mean(1.0 / np.einsum("ki,ij,kj->k", u, A, u) >= bound) for A in forms_]
    assert min(sampled) > 0.02
    np.testing.assert_allclose(share[place.status == OK], sampled, atol=0.01)


def test_a_share_is_a_measure_like_others():
    place = random_points("planar", 0)
    measure = share_measure(parse_requirement("rigid_mass>=0"))
    assert (measure.name, measure.better, measure.along) == ("share_of_directions", "higher", False)
    found = measure.compute(place)
    np.testing.assert_array_equal(found[place.status == OK], 1.0)
    assert np.isnan(found[place.status != OK]).all()
    none = share_measure(parse_requirement("rigid_mass<=0")).compute(place)
    np.testing.assert_array_equal(none[place.status == OK], 0.0)


def test_points_of_a_sphere_are_spread_evenly():
    points = sphere(256)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1.0)
    assert (points[:128, 2] > 0).all()
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=5e-3)
    angles = np.arccos(np.clip(points @ points.T - 2 * np.eye(256), -1, 1))
    nearest = angles.min(axis=1)
    assert nearest.min() > 0.5 * nearest.max()
