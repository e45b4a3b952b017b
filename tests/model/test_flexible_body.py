"""Flexible bodies against a nonlinear rod, and what follows from their second order: buckling."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq
from scipy.special import jv

from tests.model.rods import assert_moves_as_a_rod, middles
from zwidth.model import (
    BeamProperties,
    FlexibleBody,
    assumed_modes,
    beam_bodies,
    clamped_frequencies,
    finite_elements,
    highest_frequency,
    lumped_tip,
)
from zwidth.model.beam_integrals import Shapes, body_of_shapes, gauss_panels

L = 0.4
STATIONS = np.array([0.1, 0.25, 0.4])
MIDDLES = middles(L)


def random_beam(rng):
    numbers = np.array([10.0, 20.0, 5.0, 1e5, 0.2, 1e-4])
    return BeamProperties(L, *(numbers * np.exp(rng.uniform(-0.4, 0.4, 6))))


# --- the rod ----------------------------------------------------------------------------------------


def polynomial_shapes(coefficients):
    """Strains that are cubics of s/L: coefficients (4 strains, 4 powers, e), stretch last; integrated exactly."""
    p = np.arange(4)

    def shapes(places):
        x = places[:, None] / L
        powers = x**p, L * x ** (p + 1) / (p + 1), L**2 * x ** (p + 2) / ((p + 1) * (p + 2))
        strain, once, twice = (np.einsum("qp,kpe->qke", power, coefficients) for power in powers)
        displacement = np.stack([once[:, 3], twice[:, 2], -twice[:, 1]], axis=1)
        return Shapes(displacement, once[:, :3], strain[:, :3], strain[:, 3])

    return shapes


@pytest.mark.parametrize("seed", range(4))
def test_random_strains(seed):
    rng = np.random.default_rng([21, seed])
    shapes, beam = polynomial_shapes(rng.normal(size=(4, 4, 5))), random_beam(rng)
    body = body_of_shapes(beam, shapes, gauss_panels(np.array([0.0, *STATIONS]), 8), STATIONS)
    amid, eps = shapes(MIDDLES), rng.normal(size=5)
    assert_moves_as_a_rod(body, beam, eps, amid.curvature @ eps, amid.stretch @ eps, 2e-6)
    for field in (body.displacement_2, body.rotation_2, body.first_moment_2, body.mass, body.stiffness):
        assert np.array_equal(field, np.swapaxes(field, -1, -2))


NODES = np.array([0.0, 0.1, 0.175, 0.25, 0.325, 0.4])  # of elements at most a quarter of the length
STATIONS_FIRST = [1, 3, 5, 2, 4]


def element_strains(eps):
    """Of the coordinates as the docstring has them: motions of nodes, then of elements' middles."""
    of_nodes = np.zeros((6, 6))
    of_nodes[STATIONS_FIRST] = eps[:30].reshape(5, 6)
    along, y, z, twist, turn_y, turn_z = of_nodes.T
    element = np.searchsorted(NODES, MIDDLES) - 1
    h = np.diff(NODES)[element]
    x = (MIDDLES - NODES[element]) / h
    stretch, turning = (
        (np.diff(ends)[element] + middle[element] * (4.0 - 8.0 * x)) / h
        for ends, middle in zip((along, twist), eps[30:].reshape(5, 2).T, strict=True)
    )
    bent_y, bent_z = CubicHermiteSpline(NODES, y, turn_z), CubicHermiteSpline(NODES, z, -turn_y)
    return np.stack([turning, -bent_z(MIDDLES, 2), bent_y(MIDDLES, 2)], axis=1), stretch


def test_coordinates_of_elements():
    rng = np.random.default_rng(24)
    body = finite_elements(beam := random_beam(rng), STATIONS, 4)
    at_stations = np.concatenate([body.displacement, body.rotation], axis=1)
    assert at_stations.reshape(18, -1) == pytest.approx(np.eye(18, 40), abs=1e-14)
    eps = rng.normal(size=40) * np.r_[np.tile([0.1, 0.1, 0.1, 1.0, 1.0, 1.0], 5), np.tile([0.1, 1.0], 5)]
    assert_moves_as_a_rod(body, beam, eps, *element_strains(eps), 5e-5)


METHODS = {
    "elements": lambda beam: finite_elements(beam, STATIONS, 7),
    "condensed": lambda beam: finite_elements(beam, STATIONS, 1, 0),
    "some modes": lambda beam: finite_elements(beam, STATIONS, 9, 5),
    "static deflections": lambda beam: assumed_modes(beam, STATIONS, 0),
    "clamped modes": lambda beam: assumed_modes(beam, STATIONS, 9),
    "clamped-pinned modes": lambda beam: assumed_modes(beam, STATIONS, 4, "clamped-pinned"),
    "pinned modes": lambda beam: assumed_modes(beam, STATIONS, 4, "pinned"),
}


def static_strains(beam, forces, torques):
    """Of the clamped beam under forces (S, 3) and torques (S, 3) at the stations."""
    lever = STATIONS - MIDDLES[:, None]
    beyond = np.where(lever > 0.0, 1.0, 0.0)
    carried = beyond @ torques
    carried[:, 1] -= (beyond * lever) @ forces[:, 2]
    carried[:, 2] += (beyond * lever) @ forces[:, 1]
    return carried / [beam.GJ, beam.EI_y, beam.EI_z], beyond @ forces[:, 0] / beam.EA


def deflection(body, forces, torques):
    """Coordinates under the same loads, to first order."""
    load = np.einsum("sxi,sx->i", body.displacement, forces) + np.einsum("sxi,sx->i", body.rotation, torques)
    return np.linalg.solve(body.stiffness, load)


@pytest.mark.parametrize("method", METHODS)
def test_loads_at_stations_deflect_every_body_as_they_do_the_rod(method):
    rng = np.random.default_rng(24)
    beam = random_beam(rng)
    loads = rng.normal(size=(3, 3)) * [1e4, 1.0, 1.0], 0.2 * rng.normal(size=(3, 3))
    body = METHODS[method](beam)
    assert_moves_as_a_rod(body, beam, deflection(body, *loads), *static_strains(beam, *loads), 2e-6)


def test_a_lump_deflects_as_the_rod_does_under_a_load_at_the_tip():
    rng = np.random.default_rng(25)
    beam = random_beam(rng)
    body = lumped_tip(beam, STATIONS)
    forces, torques = np.zeros((3, 3)), np.zeros((3, 3))
    forces[2], torques[2, 0] = rng.normal(size=3) * [1e4, 1.0, 1.0], 0.2
    eps = deflection(body, forces, torques)
    assert_moves_as_a_rod(body, beam, eps, *static_strains(beam, forces, torques), 2e-6, mass=False)
    springs = [beam.EA / L, 3.0 * beam.EI_z / L**3, 3.0 * beam.EI_y / L**3, beam.GJ / L]
    assert body.stiffness == pytest.approx(np.diag(springs), rel=1e-12)
    assert body.displacement[-1] == pytest.approx(np.eye(3, 4), abs=1e-12)
    turns = [[0, 0, 0, 1], [0, 0, -1.5 / L, 0], [0, 1.5 / L, 0, 0]]
    assert body.rotation[-1] == pytest.approx(np.array(turns), abs=1e-12)
    # what moves with the lump is at the tip
    m, I = beam.mass_per_length * L, beam.torsional_inertia_per_length * L
    lump = np.array([m / 3.0, 33.0 / 140.0 * m, 33.0 / 140.0 * m, I / 3.0])
    assert body.mass[6:, 6:] == pytest.approx(np.diag(lump), rel=1e-12)
    assert body.mass[:4, 6:] == pytest.approx(np.diag(lump), rel=1e-12)
    assert body.mass[4:6, 6:] == pytest.approx(
        np.array([[0, 0, -L * lump[2], 0], [0, L * lump[1], 0, 0]]), rel=1e-12
    )
    assert body.first_moment_2 == pytest.approx(lump[:3, None, None] * body.displacement_2[-1], rel=1e-12)


@pytest.mark.parametrize("method", [*METHODS, "lump"])
def test_the_straight_beam_has_the_inertia_of_a_rod(method):
    beam = random_beam(np.random.default_rng(26))
    M = {**METHODS, "lump": lambda beam: lumped_tip(beam, STATIONS)}[method](beam).mass
    m, I = beam.mass_per_length * L, beam.torsional_inertia_per_length * L
    centre = np.array([[0, 0, 0], [0, 0, -L / 2], [0, L / 2, 0]])  # [L/2 e_x]x
    assert M[:3, :3] == pytest.approx(m * np.eye(3), rel=1e-14)
    assert M[:3, 3:6] == pytest.approx(-m * centre, rel=1e-14)
    assert M[3:6, 3:6] == pytest.approx(np.diag([I, m * L**2 / 3.0, m * L**2 / 3.0]), rel=1e-14)
    assert np.array_equal(M, M.T)
    assert np.all(np.linalg.eigvalsh(M) > 0.0)


# --- buckling ---------------------------------------------------------------------------------------

BUCKLING = {
    "elements": lambda beam: finite_elements(beam, STATIONS, 24),
    "elements and modes": lambda beam: finite_elements(beam, STATIONS, 24, 60),
    "clamped modes": lambda beam: assumed_modes(beam, STATIONS, 16),
    "pinned modes": lambda beam: assumed_modes(beam, STATIONS, 16, "pinned"),
}
SLENDER = BeamProperties(L, 4e4, 2.0, 3.0, 1e6, 0.2, 1e-5)  # soft in the x-y plane, and in twist


def buckling_load(stiffness, per_load):
    """The least load, of either sign, under which K - load * per_load is singular."""
    return 1.0 / np.max(np.abs(np.linalg.eigvals(np.linalg.solve(stiffness, per_load))))


@pytest.mark.parametrize("method", BUCKLING)
def test_euler_buckling(method):
    """A dead load N along the beam does the work -N times what the tip has come nearer: with the base clamped, and
    with it turned so far back that the tip is on the line of the load."""
    body = BUCKLING[method](SLENDER)
    euler = np.pi**2 * SLENDER.EI_z / L**2
    nearer, across = -body.displacement_2[-1, 0], body.displacement[-1, 1]
    assert buckling_load(body.stiffness, nearer) == pytest.approx(euler / 4.0, rel=1e-6)
    # the line from base to tip is level: the base turns by t = -across eps / L, and -L t^2/2 - t across eps is
    # across^2/(2 L)
    between_pins = nearer - np.outer(across, across) / L
    assert buckling_load(body.stiffness, between_pins) == pytest.approx(euler, rel=5e-6)


def test_a_lump_buckles_nearly_as_the_beam_does():
    """One cubic: 5/2 EI/L^2 for pi^2/4 EI/L^2."""
    body = lumped_tip(SLENDER, [L])
    assert buckling_load(body.stiffness, body.displacement_2[-1, 0]) == pytest.approx(
        2.5 * SLENDER.EI_z / L**2, rel=1e-10
    )


@pytest.mark.parametrize("method", BUCKLING)
def test_lateral_buckling(method):
    """Of a narrow beam under a force across its tip, along its stiff side (Prandtl 1899): the twist t obeys
    t'' + (F (L - s))^2 / (EI GJ) t = 0, which Bessel's function of the order -1/4 solves."""
    constant = 2.0 * brentq(lambda x: jv(-0.25, x), 1.5, 2.5, xtol=1e-14)
    assert constant == pytest.approx(4.0126, abs=5e-5)
    body = BUCKLING[method](SLENDER)
    load = buckling_load(body.stiffness, body.displacement_2[-1, 2])
    assert load == pytest.approx(constant * np.sqrt(SLENDER.EI_z * SLENDER.GJ) / L**2, rel=1e-5)


@pytest.mark.parametrize("method", BUCKLING)
def test_a_pole_buckles_under_its_own_weight(method):
    """Greenhill 1881: m g L^3 / EI = 9/4 j^2 with j the first root of Bessel's function of the order -1/3."""
    constant = 2.25 * brentq(lambda x: jv(-1.0 / 3.0, x), 1.5, 2.2, xtol=1e-14) ** 2
    assert constant == pytest.approx(7.8373, abs=5e-5)
    body = BUCKLING[method](SLENDER)
    gravity = buckling_load(body.stiffness, body.first_moment_2[0])
    assert gravity == pytest.approx(constant * SLENDER.EI_z / (SLENDER.mass_per_length * L**3), rel=1e-5)


# --- other coordinates ------------------------------------------------------------------------------


def test_other_coordinates():
    """The same motion in both has the same everything."""
    rng = np.random.default_rng(27)
    body = assumed_modes(random_beam(rng), STATIONS, 2)
    e = len(body.stiffness)
    T, eta, base = rng.normal(size=(e, 7)), rng.normal(size=7), rng.normal(size=6)
    scale = rng.uniform(0.1, 10.0, e)
    for other, z, eps in (
        (body.reduced(T), eta, T @ eta),
        (body.scaled(scale), eps_ := rng.normal(size=e), scale * eps_),
        (body.scaled(), eps_, eps_ / np.sqrt(np.diag(body.mass)[6:])),
    ):
        energies = [x @ M @ x for M, x in ((other.mass, np.r_[base, z]), (body.mass, np.r_[base, eps]))]
        assert energies[0] == pytest.approx(energies[1], rel=1e-12)
        assert z @ other.stiffness @ z == pytest.approx(eps @ body.stiffness @ eps, rel=1e-12)
        for name in ("displacement", "rotation"):
            assert getattr(other, name) @ z == pytest.approx(getattr(body, name) @ eps, rel=1e-10, abs=1e-12)
        for name in ("displacement_2", "rotation_2", "first_moment_2"):
            one, same = (np.einsum("...ij,i,j", getattr(b, name), x, x) for b, x in ((other, z), (body, eps)))
            assert one == pytest.approx(same, rel=1e-10, abs=1e-10 * np.max(np.abs(same)))
    assert np.diag(body.scaled().mass)[6:] == pytest.approx(np.ones(e), rel=1e-14)


def test_a_beam_that_does_not_bend():
    """Without elements' coordinates there is a rigid rod."""
    beam = random_beam(np.random.default_rng(28))
    for body in (assumed_modes(beam, [], 0), assumed_modes(beam, [0.0], 0), finite_elements(beam, [0.0], 1, 0)):
        assert body.mass.shape == (6, 6)
        assert body.displacement_2.shape == (len(body.stations), 3, 0, 0)
        assert len(clamped_frequencies(body)) == 0
        assert highest_frequency(body) == 0.0


def test_stations_at_one_place_and_at_the_base():
    beam = random_beam(np.random.default_rng(29))
    stations = np.array([L, 0.0, 0.1, L * (1.0 + 1e-12), 0.1 + 1e-12])
    for make in (lambda s: finite_elements(beam, s, 4), lambda s: assumed_modes(beam, s, 3)):
        body, once = make(stations), make([0.1, L])
        assert len(body.stiffness) == len(once.stiffness)
        for field in fields(FlexibleBody):
            if field.name not in ("mass", "stiffness", "first_moment_2", "stations"):
                found, expected = getattr(body, field.name), getattr(once, field.name)
                assert not np.any(found[1])  # at the base
                assert found[[2, 0, 4, 3]] == pytest.approx(expected[[0, 1, 0, 1]], rel=1e-9, abs=1e-12)
        assert body.stations == pytest.approx(stations, abs=1e-10)


def test_modes_of_a_high_number_keep_their_digits():
    """Cosh and sinh of the 40th mode are 1e53: written out, nothing would be left of it."""
    beam = random_beam(np.random.default_rng(30))
    body = assumed_modes(replace(beam, EI_y=1e10, GJ=1e9, EA=1e12), [], 40)
    roots = (np.arange(1, 41) - 0.5) * np.pi
    found = clamped_frequencies(body)[:40]
    assert found[9:] == pytest.approx(
        roots[9:] ** 2 * np.sqrt(beam.EI_z / beam.mass_per_length) / (2 * np.pi * L**2), rel=1e-9
    )


@pytest.mark.parametrize("boundary", beam_bodies.BOUNDARIES)
def test_more_points_change_no_integral(boundary, monkeypatch):
    beam = random_beam(np.random.default_rng(31))
    bodies = []
    for order in (beam_bodies.MODE_ORDER, 20):
        monkeypatch.setattr(beam_bodies, "MODE_ORDER", order)
        bodies.append(assumed_modes(beam, STATIONS, 6, boundary))
    for field in fields(FlexibleBody):
        one, other = (getattr(body, field.name) for body in bodies)
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9 * np.max(np.abs(other))), field.name


@pytest.mark.parametrize("softer", [1.0 - 3e-16, 1.0, 1.0 + 3e-16])
def test_where_the_modes_end_between_two_planes_rounding_does_not_choose(softer):
    """Of the same modes of a round section in both planes the one in the x-y plane is kept."""
    beam = BeamProperties(L, 1.0, softer, 0.3, 1e5, 0.1, 1e-6)
    body = finite_elements(beam, [L], 8, 1)
    moved = np.max(np.abs(body.mass[:6, 6 + 6 :]), axis=1)
    assert moved[1] > 1e-3 > 1e-9 > moved[2]
