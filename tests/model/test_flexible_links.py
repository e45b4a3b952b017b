"""Mechanisms whose links bend: against frames of finite elements and the rigid mechanism."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import mpmath
import numpy as np
import pytest

from tests.model.beam_devices import (
    DEVICES,
    METHODS,
    device,
    drive,
    five_bar,
    light_five_bar,
    link,
    numbers,
    planar_arm,
    with_beams,
    without_beams,
)
from tests.model.bent_chains import with_bodies
from tests.model.framed_devices import framed
from zwidth.device import from_document
from zwidth.model import assumed_modes, effective_parameters, finite_elements, natural_frequencies, undamped_modes

CONVERGING = ("assumed-modes", "finite-elements")


@cache
def judge(name):
    document = DEVICES[name]()
    return framed(from_document(document), document)


@cache
def point(name, method):
    return from_document(with_beams(DEVICES[name](), **METHODS[method])).at()


def frequencies_of(document, **keys):
    return natural_frequencies(from_document(with_beams(document, **keys)).at().plant)


# --- against frames ---------------------------------------------------------------------------------


@pytest.mark.parametrize("method", CONVERGING)
@pytest.mark.parametrize("name", DEVICES)
def test_natural_frequencies(name, method):
    found, expected = natural_frequencies(point(name, method).plant), judge(name).frequencies(12)
    free = int(np.count_nonzero(expected == 0.0))
    assert np.all(found[:free] == 0.0)
    assert found[free : free + 3] == pytest.approx(expected[free : free + 3], rel=1e-6)
    assert found[free : free + 5] == pytest.approx(expected[free : free + 5], rel=1e-5)
    assert found[free:12] == pytest.approx(expected[free:12], rel=2e-4)


@pytest.mark.parametrize("name", ["planar arm", "spatial arm", "five-bar, hinge", "five-bar, point", "slides"])
def test_a_lump_at_the_tip_has_about_the_first_frequency(name):
    """It has neither the moment that its own inertia makes, nor what its tip turns by under a moment."""
    found, expected = natural_frequencies(point(name, "lumped").plant), judge(name).frequencies(12)
    assert found[found > 0.0][0] == pytest.approx(expected[expected > 0.0][0], rel=0.1)


@pytest.mark.parametrize("method", CONVERGING)
@pytest.mark.parametrize("name", DEVICES)
def test_stiffness_and_rigid_mass_at_the_handle(name, method):
    """In the direction asked about and in others in which the handle moves; whichever way it is written."""
    at, frame, rng = point(name, method), judge(name), np.random.default_rng(5)
    reach = np.linalg.svd(at.posture.jacobian)
    moves = reach[0][:, : np.count_nonzero(reach[1] > 1e-9)]
    directions = [at.direction, *((moves @ rng.normal(size=moves.shape[1])) for _ in range(2))]
    for u in [u / np.linalg.norm(u) for u in directions]:
        found = at.towards(u).effective
        assert 1.0 / float(found.stiffness) == pytest.approx(u @ frame.deflection(u), rel=1e-8)
        if np.allclose(moves @ (moves.T @ u), u):
            assert float(found.rigid_mass) == pytest.approx(frame.rigid_mass(u), rel=1e-7)


def test_all_postures_of_a_batch_have_their_own_stiffness():
    single = from_document(five_bar())
    batch = single.at(np.array([[0.0, 0.25], [0.03, 0.22], [0.0, 0.9]]))
    found = effective_parameters(batch.mechanism, batch.posture, batch.direction)
    one = single.at((0.03, 0.22)).effective
    assert float(found.stiffness[1]) == float(one.stiffness)
    assert float(batch.effective.link_side_mass[1]) == float(one.link_side_mass)
    assert np.isnan(found.stiffness[2])


# --- convergence ------------------------------------------------------------------------------------

LEAST = {"planar arm": 5, "spatial arm": 5, "light five-bar": 8, "spatial loop": 6}


@pytest.mark.parametrize("name", LEAST)
def test_frequencies_fall_with_modes_and_elements(name):
    """From above, as those of all coordinates that another one is added to, to the same numbers."""
    document, few = DEVICES[name](), slice(LEAST[name], LEAST[name] + 3)
    best = frequencies_of(document, method="assumed-modes", modes=8)
    best = best[best > 0.0][few]

    def errors(**keys):
        found = frequencies_of(document, **keys)
        return found[found > 0.0][few] / best - 1.0

    modes = np.array([errors(method="assumed-modes", modes=n) for n in (0, 1, 2, 4)])
    assert np.all(np.diff(modes, axis=0) < 1e-9)
    assert np.all(modes > -1e-8)
    assert np.max(modes[-1]) < 1e-4
    assert np.max(modes[-1]) < 0.05 * np.max(modes[0])
    at = from_document(document).at()
    elements = []
    for n in (2, 4, 8):
        bodies = [finite_elements(each.beam, each.body.stations, n) for each in at.mechanism.flexible]
        own = natural_frequencies(replace(at, mechanism=with_bodies(at.mechanism, bodies)).plant)
        elements.append(own[own > 0.0][few] / best - 1.0)
    elements = np.array(elements)
    assert np.all(np.diff(elements, axis=0) < 1e-9)
    assert np.all(elements > -1e-6)
    # with the 4th power of the element's length, once it is below the distance of the stations
    assert np.max(elements[2]) < min(np.max(elements[1]) / 10.0, np.max(elements[0]) / 25.0)


@pytest.mark.parametrize("make", [planar_arm, light_five_bar])
def test_the_modes_that_are_assumed_do_not_matter(make):
    at = from_document(make()).at()
    found = []
    for boundary in ("clamped", "pinned", "clamped-pinned"):
        bodies = [assumed_modes(each.beam, each.body.stations, 8, boundary) for each in at.mechanism.flexible]
        plant = replace(at, mechanism=with_bodies(at.mechanism, bodies)).plant
        found.append(natural_frequencies(plant)[2:10])
    assert found[1] == pytest.approx(found[0], rel=2e-6)
    assert found[2] == pytest.approx(found[0], rel=2e-6)


STIFF = {"youngs_modulus_Pa": 68.9e9, "shear_modulus_Pa": 26e9, "density_kg_per_m3": 2700.0}


def stiffened(document, factor):
    """The document with so many times stiffer aluminium."""
    material = {key: value * (1.0 if "density" in key else factor) for key, value in STIFF.items()}
    return with_beams(document, material=material)


@pytest.mark.parametrize("closes", ["point", "axis"])
def test_stiff_beams_are_rigid_links(closes):
    """The stiffer they are the more so, for as long as numbers have digits."""
    document = five_bar(closes)
    rigid = from_document(without_beams(document)).at()
    chart = rigid.chart(decay=False)
    off = []
    for factor in (1e3, 1e5, 1e7, 1e10):
        found = from_document(stiffened(document, factor)).at()
        own = found.chart(decay=False)
        off.append(abs(own.stiffness_max / chart.stiffness_max - 1.0))
        assert own.damping_max == pytest.approx(chart.damping_max, rel=1e-6 + 1.0 / factor)
        assert own.stable_area == pytest.approx(chart.stable_area, rel=1e-6 + 1.0 / factor)
        assert float(found.effective.stiffness) == pytest.approx(
            float(rigid.effective.stiffness), rel=4.0 / factor
        )
    assert off[1] == pytest.approx(off[0] / 100.0, rel=0.05)
    assert off[2] < 1e-6
    assert off[3] < 2e-9
    for model in ("two-mass", "motor-mass", "rigid"):
        own = found.in_model(model).chart(decay=False).stiffness_max
        assert own == pytest.approx(rigid.in_model(model).chart(decay=False).stiffness_max, rel=1e-8)


@pytest.mark.parametrize("spread", [1e7, 1e10, 1e14, 1e20])
def test_slow_modes_keep_their_digits_beside_fast_ones(spread):
    """Three masses on springs, coupled by inertia with five motions that are up to so many times stiffer."""
    rng = np.random.default_rng(6)
    root = rng.normal(size=(8, 8))
    M, K = root @ root.T + 8.0 * np.eye(8), np.zeros((8, 8))
    K[:3, :3] = 1e6 * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    K[3:, 3:] = np.diag(1e7 * np.geomspace(1.0, spread, 5))
    squared, shapes = undamped_modes(M, K)
    with mpmath.workdps(60):
        left = mpmath.inverse(mpmath.cholesky(mpmath.matrix(M)))
        exact = mpmath.eigsy(left * mpmath.matrix(K) * left.T, eigvals_only=True)
        expected = np.array([float(value) for value in exact])
    assert squared[0] == 0.0
    assert squared[1:] == pytest.approx(expected[1:], rel=2e-8)
    assert shapes.T @ M @ shapes == pytest.approx(np.eye(8), abs=1e-13)
    apart = shapes.T @ K @ shapes / np.sqrt(np.outer(squared + 1e3, squared + 1e3))
    assert apart[1:, 1:] == pytest.approx(np.diag(squared[1:] / (squared[1:] + 1e3)), abs=2e-8)


def test_a_free_chain_of_very_unlike_springs_is_free():
    """Whatever rounding leaves of the stiffest spring in the sums of its matrix."""
    difference = np.diff(np.eye(6), axis=0)
    spring = np.diag([1.0, 1e5, 1e9, 1e13, 1e18])
    squared, _ = undamped_modes(np.eye(6), difference.T @ spring @ difference)
    assert squared[0] == 0.0
    assert np.all(squared >= 0.0)


# --- reduced models ---------------------------------------------------------------------------------


def test_two_masses_have_the_links_whole_and_all_springs_in_series():
    document = five_bar(diameter_mm=6)
    found, rigid = from_document(document).at(), from_document(without_beams(document)).at()
    e, own = found.effective, found.in_model("two-mass").plant
    for name in ("link_side_mass", "motor_side_mass", "rigid_mass"):
        assert float(getattr(e, name)) == pytest.approx(float(getattr(rigid.effective, name)), rel=1e-12)
    k = float(e.stiffness)
    assert 1.0 / k > 1.0 / float(rigid.effective.stiffness)
    assert own.stiffness == pytest.approx(k * np.array([[1.0, -1.0], [-1.0, 1.0]]))
    b = 2.0 * 0.05 * np.sqrt(k / (1.0 / float(e.link_side_mass) + 1.0 / float(e.motor_side_mass)))
    assert own.damping == pytest.approx(b * np.array([[1.0, -1.0], [-1.0, 1.0]]))
    assert found.in_model("motor-mass").plant.stiffness == pytest.approx(k)
    assert found.in_model("rigid").plant.mass == pytest.approx(float(e.rigid_mass))


@pytest.mark.parametrize("stiffness", [(None, None), (0.45, None), (0.45, 0.75)])
def test_how_many_modes_changes_no_two_masses(stiffness):
    """The mass at the handle of all elastic coordinates is less with each further mode."""
    document = five_bar(stiffness=stiffness)
    few, many = (from_document(with_beams(document, modes=n)).at() for n in (0, 4))
    for one, other in zip(vars(few.effective).values(), vars(many.effective).values(), strict=True):
        assert float(one) == pytest.approx(float(other), rel=1e-9)
    charts = [each.in_model("two-mass").chart(decay=False).stiffness_max for each in (few, many)]
    assert charts[0] == pytest.approx(charts[1], rel=1e-9)


def test_dampers_of_drives_and_beams_act_between_two_masses():
    """On one link b of the drive and t k of the beam damp the deflections that a force makes."""
    L, EI, ratio, k, b, time = 0.2, 6.0, 15.0, 0.6, 0.01, 2e-4
    document = device(
        [link("arm", "base", length_m=L, beam=numbers([EI, EI], 0.1, damping_time_s=time))],
        [drive("arm", k, damping_Nms_per_rad=b)],
        {"arm": 0.0},
        (0.0, 1.0),
        damping={"given": True},
        spatial=False,
    )
    drive_, beam = L**2 / (ratio**2 * k), L**3 / (3.0 * EI)
    spring = 1.0 / (drive_ + beam)
    expected = spring**2 * (b / k * drive_ + time * beam)
    found = from_document(document).at(model="two-mass").plant
    assert found.stiffness[0, 0] == pytest.approx(spring, rel=1e-9)
    assert found.damping[0, 0] == pytest.approx(expected, rel=1e-6)
