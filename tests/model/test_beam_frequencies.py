"""Natural frequencies of flexible bodies against characteristic equations, and how fast they converge."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy import cos, cosh, sin, sinh
from scipy.linalg import block_diag, eigh
from scipy.optimize import brentq

from tests.model.frame_elements import GROUND, Frame, natural_frequencies
from zwidth.model import (
    BeamProperties,
    assumed_modes,
    clamped_frequencies,
    finite_elements,
    highest_frequency,
    lumped_tip,
)

L, MASS_PER_LENGTH, EI = 0.35, 0.2, 12.0
MASS = MASS_PER_LENGTH * L
# So stiff in all but one bending plane that the lowest frequencies are all in it
SOFT = {
    plane: BeamProperties(
        L, EI if plane == "z" else 1e5, EI if plane == "y" else 1e5, 1e4, 1e8, MASS_PER_LENGTH, 1e-4
    )
    for plane in "yz"
}


class Case(NamedTuple):
    """A uniform beam that bends in one plane: its characteristic equation and printed roots x = beta L.

    free    what the base can do: "shift" across the beam, "turn"
    hub     inertia of what turns with the base, over m L^2
    tip     mass at the tip, over the beam's
    """

    equation: object
    printed: tuple[float, ...]
    free: tuple[str, ...] = ()
    hub: float = 0.0
    tip: float = 0.0


def on_hub(inertia):
    return lambda x: sin(x) * cosh(x) - cos(x) * sinh(x) + inertia * x**3 * (1.0 + cos(x) * cosh(x))


def with_tip(mass):
    return lambda x: 1.0 + cos(x) * cosh(x) + mass * x * (cos(x) * sinh(x) - sin(x) * cosh(x))


CASES = {
    "cantilever": Case(with_tip(0.0), (1.875104, 4.694091, 7.854757)),
    "tip mass": Case(with_tip(1.0), (1.247917, 4.031139, 7.134132), tip=1.0),
    "pinned and free": Case(on_hub(0.0), (3.926602, 7.068583), free=("turn",)),
    "free": Case(lambda x: cos(x) * cosh(x) - 1.0, (4.730041, 7.853205), free=("shift", "turn")),
    "light hub": Case(on_hub(0.1), (2.638925, 4.793771), free=("turn",), hub=0.1),
    "heavy hub": Case(on_hub(1.0), (2.010003, 4.703794), free=("turn",), hub=1.0),
}


def roots(case):
    """The roots that are printed, from the characteristic equation."""
    return np.array([brentq(case.equation, x - 1e-3, x + 1e-3, xtol=1e-14) for x in case.printed])


def computed_roots(case, body, plane="y"):
    """x = beta L of the body's lowest elastic frequencies."""
    M, K = body.mass.copy(), block_diag(np.zeros((6, 6)), body.stiffness)
    shift, turn = (1, 5) if plane == "y" else (2, 4)
    M[turn, turn] += case.hub * MASS * L**2
    s = body.stations[-1]
    tip = np.hstack([np.eye(3), -s * np.array([[0, 0, 0], [0, 0, -1], [0, 1, 0]]), body.displacement[-1]])
    M += case.tip * MASS * tip.T @ tip
    at = [{"shift": shift, "turn": turn}[name] for name in case.free] + list(range(6, len(M)))
    M, K = M[np.ix_(at, at)], K[np.ix_(at, at)]
    scale = EI / (MASS_PER_LENGTH * L**4)
    inverse = eigh(M, K + scale * M, eigvals_only=True)[::-1]  # of w^2 + scale; the low ones are exact so
    return (1.0 / inverse[len(case.free) :][: len(case.printed)] / scale - 1.0) ** 0.25


@pytest.mark.parametrize("name", CASES)
def test_printed_roots(name):
    assert roots(CASES[name]) == pytest.approx(CASES[name].printed, abs=5.1e-7)


METHODS = {
    "elements": lambda beam: finite_elements(beam, [L], 24),
    "elements, a station between": lambda beam: finite_elements(beam, [0.1, L], 24),
    "elements, the lowest modes": lambda beam: finite_elements(beam, [0.1, L], 24, 48),
    "clamped modes": lambda beam: assumed_modes(beam, [L], 12),
    "clamped modes, a station between": lambda beam: assumed_modes(beam, [0.5 * L, L], 12),
    "clamped-pinned modes": lambda beam: assumed_modes(beam, [L], 12, "clamped-pinned"),
    "pinned modes": lambda beam: assumed_modes(beam, [L], 12, "pinned"),
}


@pytest.mark.parametrize("plane", "yz")
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", CASES)
def test_roots(name, method, plane):
    """From above, as Rayleigh and Ritz say, and near."""
    too_high = computed_roots(CASES[name], METHODS[method](SOFT[plane]), plane) / roots(CASES[name]) - 1.0
    assert np.all(too_high > -1e-12)
    assert np.all(too_high < [1.5e-6, 1e-5, 1e-5][: len(too_high)])


@pytest.mark.parametrize("elements", [12, 24])
@pytest.mark.parametrize("name", ["cantilever", "pinned and free", "free"])
def test_error_of_elements(name, elements):
    """w^2 of a uniform beam is too high by (beta h)^4 / 720 of elements h long, beta by a quarter of that."""
    case = CASES[name]
    too_high = computed_roots(case, finite_elements(SOFT["y"], [L], elements)) / roots(case) - 1.0
    assert too_high == pytest.approx((roots(case) / elements) ** 4 / 2880.0, rel=0.06)


# modes and case -> the power of their number with which errors fall at least; None: they are gone from the start
CONVERGENCE = {
    ("clamped", "cantilever"): None,
    ("clamped", "tip mass"): 10.0,
    ("clamped", "light hub"): 6.0,
    ("clamped", "free"): 4.0,
    ("clamped-pinned", "tip mass"): 4.0,
    ("pinned", "heavy hub"): 4.0,
    ("pinned", "free"): 5.0,
}


@pytest.mark.parametrize(("boundary", "name"), CONVERGENCE)
def test_convergence_of_assumed_modes(boundary, name):
    case, power = CASES[name], CONVERGENCE[boundary, name]
    few, many = (
        np.max(computed_roots(case, assumed_modes(SOFT["y"], [L], n, boundary)) / roots(case)) - 1.0
        for n in (5, 10)
    )
    if power is None:
        assert max(abs(few), abs(many)) < 1e-13
    else:
        assert power < np.log2(few / many) < power + 2.0


@pytest.mark.parametrize(
    "make", [METHODS["elements"], METHODS["elements, the lowest modes"], METHODS["clamped modes"]]
)
def test_stretch_and_twist(make):
    """A free tip: quarter waves and odd multiples of them."""
    soft = replace(SOFT["y"], EI_z=1e9, EI_y=1e9, EA=7e3, GJ=2.5)
    speeds = np.sqrt([soft.EA / soft.mass_per_length, soft.GJ / soft.torsional_inertia_per_length])
    expected = np.sort(np.outer(speeds, [1.0, 3.0, 5.0]).ravel())[:4] / (4.0 * L)
    found = clamped_frequencies(make(soft))[:4]
    assert np.all(found / expected > 1.0 - 1e-12)
    assert found == pytest.approx(expected, rel=3e-5)


@pytest.mark.parametrize(("elements", "places"), [(4, 1), (8, 2)])
def test_error_of_elements_in_stretch(elements, places):
    """w of a bar is too high by (k h)^4 / 1440 of quadratic elements h long."""
    soft = replace(SOFT["y"], EI_z=1e9, EI_y=1e9, EA=10.0)
    k = (np.arange(1, places + 1) - 0.5) * np.pi / L
    found = clamped_frequencies(finite_elements(soft, [L], elements))[:places]
    too_high = found / (k * np.sqrt(soft.EA / soft.mass_per_length) / (2.0 * np.pi)) - 1.0
    assert too_high == pytest.approx((k * L / elements) ** 4 / 1440.0, rel=0.02)


def test_a_lump_on_a_massless_spring():
    """1.47 % above the cantilever, and thesis eq. 2.23 with a hub: inertias on either side of the spring k L^2."""
    beam = SOFT["y"]
    body = lumped_tip(beam, [L])
    frequency = np.sqrt(EI / (MASS_PER_LENGTH * L**4)) * roots(CASES["cantilever"])[0] ** 2 / (2.0 * np.pi)
    assert clamped_frequencies(body)[0] / frequency == pytest.approx(1.0147, abs=5e-5)
    whole, lump = MASS * L**2 / 3.0, 33.0 / 140.0 * MASS * L**2
    for hub in (0.0, 0.1, 1.0):
        near = hub * MASS * L**2 + whole - lump
        squared = 3.0 * EI / L * (1.0 / near + 1.0 / lump)
        x = (squared * MASS_PER_LENGTH * L**4 / EI) ** 0.25
        case = CASES["heavy hub"]._replace(hub=hub, printed=(0.0,))
        assert computed_roots(case, body) == pytest.approx([x], rel=1e-10)


@pytest.mark.parametrize("seed", range(4))
def test_bodies_at_stations_of_a_hinged_beam(seed):
    """A beam on a spring about any axis, with bodies beside it at two stations, against a frame."""
    rng = np.random.default_rng([17, seed])
    beam = random_beam(rng)
    stations = beam.length * np.array([0.25 * rng.integers(1, 4), 1.0])
    axis, spring = rng.normal(size=3), rng.uniform(1.0, 20.0)
    masses, offsets = rng.uniform(0.02, 0.2, 2), rng.normal(size=(2, 3)) * 0.02
    inertias = [np.diag(rng.uniform(1e-5, 3e-5, 3)) for _ in range(2)]

    frame = Frame()
    along = frame.member(
        frame.point((0.0, 0.0, 0.0)), frame.point((beam.length, 0.0, 0.0)), beam, y_axis=(0, 1, 0), elements=40
    )
    frame.hinge(along[0], GROUND, axis, stiffness=spring)
    for s, *of_body in zip(stations, masses, inertias, offsets, strict=True):
        frame.body(along[round(40 * s / beam.length)], *of_body)
    expected = natural_frequencies(frame, 8)

    for body in (finite_elements(beam, stations, 20), assumed_modes(beam, stations, 8)):
        M = body.mass.copy()
        for i, s in enumerate(stations):
            J = np.vstack(
                [
                    np.hstack([np.eye(3), -cross([s, 0.0, 0.0]), body.displacement[i]]),
                    np.hstack([np.zeros((3, 3)), np.eye(3), body.rotation[i]]),
                ]
            )
            of_centre = J.copy()
            of_centre[:3] -= cross(offsets[i]) @ J[3:]
            M += of_centre.T @ block_diag(masses[i] * np.eye(3), inertias[i]) @ of_centre
        turn = np.r_[0.0, 0.0, 0.0, axis / np.linalg.norm(axis)][:, None]
        T = block_diag(turn, np.eye(len(body.stiffness)))
        inverse = eigh(T.T @ M @ T, block_diag(spring, body.stiffness), eigvals_only=True)[::-1]
        assert inverse[:8] ** -0.5 / (2.0 * np.pi) == pytest.approx(expected, rel=2e-4)


def random_beam(rng):
    return BeamProperties(*(np.array([0.3, 10.0, 20.0, 5.0, 1e5, 0.2, 1e-5]) * np.exp(rng.uniform(-0.4, 0.4, 7))))


def cross(v):
    """[v]x."""
    return np.cross(np.eye(3), v)


@pytest.mark.parametrize("seed", range(3))
def test_elements_and_modes_agree(seed):
    """Frequencies of free random beams, whichever way they are computed; and with one mode more nothing sinks."""
    rng = np.random.default_rng([18, seed])
    beam = random_beam(rng)
    stations = np.sort(rng.uniform(0.1, 0.9, 2)) * beam.length
    bodies = [
        finite_elements(beam, stations, 40),
        finite_elements(beam, stations, 40, 80),
        assumed_modes(beam, stations, 14),
        assumed_modes(beam, stations, 14, "pinned"),
        assumed_modes(beam, [*stations, beam.length], 14, "clamped-pinned"),
    ]
    first = clamped_frequencies(bodies[0])[:8]
    for body in bodies[1:]:
        assert clamped_frequencies(body)[:8] == pytest.approx(first, rel=2e-5)
    for body in bodies:
        assert highest_frequency(body) == pytest.approx(clamped_frequencies(body)[-1], rel=1e-6)
