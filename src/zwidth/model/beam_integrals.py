"""Integrals along a beam, from the displacements, rotations and strains that its shape functions have.

They are summed at Gauss points of panels, between which strains may jump; each station is an edge of panels, so
that the integrals up to it are as exact as the others.

Shape functions along a beam: vibration modes, static deflections and finite elements.

A family of n functions at q places is an array (d, q, n) of their values and first derivatives by s: d = 3 for
bending (deflection, slope, curvature), d = 2 for stretch and twist (displacement or angle, strain). All functions
and the slopes of bending are 0 at the base, s = 0, where the beam's frame sits.

eps, a, k, c, w, r2, D2 and O2 are those of `flexible_body`; e is the number of elastic coordinates eps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.model.beam_section import BeamProperties
from zwidth.model.flexible_body import FlexibleBody, symmetric


class Shapes(NamedTuple):
    """At q places along a beam, per unit of each of e elastic coordinates, to first order.

    displacement  (q, 3, e)  integral of (c, a_z, -a_y) [m]
    rotation      (q, 3, e)  a [rad]
    curvature     (q, 3, e)  k, the derivative of a [rad/m]
    stretch       (q, e)     c [1]
    """

    displacement: Floats
    rotation: Floats
    curvature: Floats
    stretch: Floats

    def reduced(self, basis: Floats) -> Shapes:
        """Shapes of the coordinates eta of eps = T eta; basis (e, n) is T."""
        return Shapes(*(field @ basis for field in self))


ShapeFunctions = Callable[[Floats], Shapes]  # of places (q,) [m]


class Panels(NamedTuple):
    """Gauss points: their places (q,) and weights (q,) [m]."""

    places: Floats
    weights: Floats


def gauss_panels(edges: Floats, order: int) -> Panels:
    """`order` Gauss points in each panel between ascending edges: exact for polynomials of degree 2 order - 1."""
    points, weights = np.polynomial.legendre.leggauss(order)
    start, half = edges[:-1, None], 0.5 * np.diff(edges)[:, None]
    return Panels((start + half * (1.0 + points)).ravel(), (half * weights).ravel())


def elastic_matrices(beam: BeamProperties, shapes: Shapes, weights: Floats) -> tuple[Floats, Floats]:
    """Mass (e, e) with the base at rest, and stiffness (e, e), of shapes at Gauss points of weights (q,) [m]."""
    (ux, uy, uz), (ax, _, _), (kx, ky, kz) = (np.moveaxis(field, 1, 0) for field in shapes[:3])
    # displacement u, rotation a and curvature k, each (q, e) about or along x, y and z
    M = beam.mass_per_length * (_gram(ux, weights) + _gram(uy, weights) + _gram(uz, weights))
    M = M + beam.torsional_inertia_per_length * _gram(ax, weights)
    K = beam.EA * _gram(shapes.stretch, weights) + beam.GJ * _gram(kx, weights)
    K = K + beam.EI_y * _gram(ky, weights) + beam.EI_z * _gram(kz, weights)
    return symmetric(M), symmetric(K)


def body_of_shapes(
    beam: BeamProperties, functions: ShapeFunctions, panels: Panels, stations: Floats
) -> FlexibleBody:
    """The body with the consistent mass matrix of the shape functions; no inertia of cross sections that tilt.

    functions  shapes whose displacement and rotation are 0 at s = 0
    panels     with an edge wherever a strain jumps, and at each station
    stations   (S,) [m]
    """
    places, weights = panels
    shapes, at_stations = functions(places), functions(stations)
    M, K = elastic_matrices(beam, shapes, weights)
    e, L = len(K), beam.length
    mass = np.zeros((6 + e, 6 + e))
    mass[:6, :6] = rod_inertia(beam)
    # momentum and moment of momentum of the moving line of centres, at each Gauss point
    line = beam.mass_per_length * weights[:, None, None] * shapes.displacement
    _, uy, uz = np.moveaxis(places[:, None, None] * line, 1, 0).sum(axis=1)
    mass[:3, 6:] = line.sum(axis=0)
    # angular momentum about the base, s e_x times the velocity; about x it is that of the cross sections alone
    mass[3, 6:] = beam.torsional_inertia_per_length * (weights @ shapes.rotation[:, 0])
    mass[4, 6:], mass[5, 6:] = -uz, uy
    mass[6:, :6], mass[6:, 6:] = mass[:6, 6:].T, M
    before = weights * (places < stations[:, None])
    seconds = [second_order(shapes, w, w * (s - places)) for s, w in zip(stations, before, strict=True)]
    D2, O2 = (np.reshape([pair[i] for pair in seconds], (len(stations), 3, e, e)) for i in (0, 1))
    to_tip = beam.mass_per_length * weights * (L - places)
    first_moment_2, _ = second_order(shapes, to_tip, 0.5 * to_tip * (L - places))
    moving = (stations > 0.0)[:, None, None]  # exact zeros at the base, where modes leave rounding
    displacement, rotation = moving * at_stations.displacement, moving * at_stations.rotation
    return FlexibleBody(mass, K, stations, displacement, rotation, D2, O2, first_moment_2)


def second_order(shapes: Shapes, once: Floats, twice: Floats) -> tuple[Floats, Floats]:
    """D2 (3, e, e) and O2 (3, e, e) of a station s: second derivatives of r2 and of w/2 by eps.

    once, twice  (q,)  weights of the integral up to s, and of the integral up to s of the integral up to there,
                       which is that of (s - place) times the integrand
    """
    (ax, ay, az), (kx, ky, kz) = (np.moveaxis(field, 1, 0) for field in (shapes.rotation, shapes.curvature))
    c = shapes.stretch

    def turned(weights: Floats) -> tuple[Floats, Floats, Floats]:
        """Components x, y and z of the integral of a x k, (e, e) each."""
        return (
            _gram(ay, weights, kz) - _gram(az, weights, ky),
            _gram(az, weights, kx) - _gram(ax, weights, kz),
            _gram(ax, weights, ky) - _gram(ay, weights, kx),
        )

    _, wy, wz = turned(twice)
    D2 = (
        -_gram(ay, once) - _gram(az, once),
        _gram(ax, once, ay) + wz + 2.0 * _gram(c, once, az),
        _gram(ax, once, az) - wy - 2.0 * _gram(c, once, ay),
    )
    return symmetric(np.stack(D2)), symmetric(np.stack(turned(once)))


def rod_inertia(beam: BeamProperties) -> Floats:
    """Mass matrix (6, 6) of the straight rigid beam about its base: velocity, then angular velocity."""
    m, L = beam.mass_per_length * beam.length, beam.length
    M = np.diag([m, m, m, beam.torsional_inertia_per_length * L, m * L**2 / 3.0, m * L**2 / 3.0])
    M[1, 5] = M[5, 1] = 0.5 * m * L
    M[2, 4] = M[4, 2] = -0.5 * m * L
    return M


def _gram(one: Floats, weights: Floats, other: Floats | None = None) -> Floats:
    """Sum over points of weight (q,) times one_i times other_j, (e, e), of functions (q, e); other None: one
    again."""
    return np.asarray((one * weights[:, None]).T @ (one if other is None else other))


BOUNDARIES: Final = ("clamped", "clamped-pinned", "pinned")


def assembled(in_y: Floats, in_z: Floats, along: Floats, twist: Floats) -> Shapes:
    """Shapes of four families: bending in the x-y and in the x-z plane, stretch and twist, in this order.

    in_y, in_z, along, twist  (3, q, .) or (2, q, .)  values and derivatives, see the head of this file
    A deflection to z turns the beam about -y.
    """
    q = in_y.shape[1]
    sizes = [family.shape[2] for family in (in_y, in_z, along, twist)]
    at_y, at_z, at_x, at_twist = (
        slice(end - size, end) for end, size in zip(np.cumsum(sizes).tolist(), sizes, strict=True)
    )
    displacement, rotation, curvature = (np.zeros((q, 3, sum(sizes))) for _ in range(3))
    stretch = np.zeros((q, sum(sizes)))
    displacement[:, 1, at_y], rotation[:, 2, at_y], curvature[:, 2, at_y] = in_y
    displacement[:, 2, at_z], rotation[:, 1, at_z], curvature[:, 1, at_z] = in_z[0], -in_z[1], -in_z[2]
    displacement[:, 0, at_x], stretch[:, at_x] = along
    rotation[:, 0, at_twist], curvature[:, 0, at_twist] = twist
    return Shapes(displacement, rotation, curvature, stretch)


# --- vibration modes --------------------------------------------------------------------------------


def bending_modes(places: Floats, length: float, count: int, boundary: str) -> Floats:
    """The first modes of bending (3, q, count), clamped or turned to be level at the base.

    boundary  "clamped": free at the tip; "clamped-pinned": held in place at the tip, free to turn; "pinned": held
              in place at both ends and free to turn, sin(n pi s/L) over the chord, from which the straight line
              along the tangent at the base is subtracted
    """
    x = places[:, None] / length
    if boundary == "pinned":
        k = np.pi * np.arange(1, count + 1)
        family = np.stack([np.sin(k * x) - k * x, k * (np.cos(k * x) - 1.0), -(k**2) * np.sin(k * x)])
    else:
        family = _clamped_modes(x, bending_numbers(count, boundary), 1.0 if boundary == "clamped" else -1.0)
    return np.asarray(family / np.array([1.0, length, length**2])[:, None, None])


def bending_numbers(count: int, boundary: str) -> Floats:
    """b = beta L (count,) of the clamped beam's modes, ascending.

        "clamped"         cos b + 1/cosh b = 0          (1.875104, 4.694091, 7.854757, ...)
        "clamped-pinned"  sin b - tanh b cos b = 0      (3.926602, 7.068583, ...)

    >>> bending_numbers(3, "clamped").round(6).tolist()
    [1.875104, 4.694091, 7.854757]
    """
    n = np.arange(1, count + 1)
    b = (n - 0.5) * np.pi if boundary == "clamped" else (n + 0.25) * np.pi
    for _ in range(8):  # Newton's method from roots that are within 0.3 of the first and exp(-b) of the others
        tanh, sech = np.tanh(b), 2.0 * np.exp(-b) / (1.0 + np.exp(-2.0 * b))
        if boundary == "clamped":
            b = b - (np.cos(b) + sech) / (-np.sin(b) - tanh * sech)
        else:
            b = b - (np.sin(b) - tanh * np.cos(b)) / (np.cos(b) * (1.0 - sech**2) + tanh * np.sin(b))
    return np.asarray(b)


def _clamped_modes(x: Floats, b: Floats, sign: float) -> Floats:
    """cosh - cos - g (sinh - sin) of b x and its first two derivatives by x, (3, q, count).

    x     (q, 1)    places in shares of the length;   b (count,)  `bending_numbers`
    sign  1 for the tip that is free, -1 for the one that is pinned, in

        g = (cosh b + sign cos b) / (sinh b + sign sin b)

    The two growing functions are written as one that decays from the base and one that decays from the tip,

        cosh - g sinh = exp(-b x) (1 + g)/2 + exp(-b (1 - x)) h,     h = exp(b) (1 - g)/2

    so that nothing large is subtracted: as written above, digits are lost by exp(b), all of them from the twelfth
    mode on.
    """
    small = np.exp(-b)
    share = 1.0 - small**2 + 2.0 * sign * small * np.sin(b)  # 2 exp(-b) (sinh b + sign sin b)
    h = (sign * (np.sin(b) - np.cos(b)) - small) / share
    g = 1.0 - 2.0 * small * h
    base, tip = 0.5 * (1.0 + g) * np.exp(-b * x), h * np.exp(-b * (1.0 - x))
    cos, sin = np.cos(b * x), np.sin(b * x)
    return np.stack(
        [base + tip - cos + g * sin, b * (tip - base + sin + g * cos), b**2 * (base + tip + cos - g * sin)]
    )


def bar_modes(places: Floats, length: float, count: int, boundary: str) -> Floats:
    """The first modes of stretch or twist (2, q, count), held at the base: sin((n - 1/2) pi s/L) with the tip free
    for "clamped", else sin(n pi s/L) with the tip held."""
    n = np.arange(1, count + 1)
    k = np.pi / length * (n - 0.5 if boundary == "clamped" else n)
    return np.stack([np.sin(places[:, None] * k), k * np.cos(places[:, None] * k)])


# --- static deflections -----------------------------------------------------------------------------


def bending_deflections(places: Floats, loaded: Floats) -> Floats:
    """Deflection of the clamped beam of unit stiffness under a force, then under a moment, at each of the loaded
    places (k,) > 0: (3, q, 2 k)."""
    s, c = places[:, None], loaded
    # deflection, slope and curvature of each; up to the load the force's curvature is c - s, the moment's is 1
    t = np.minimum(s, c)  # beyond the load the beam is straight
    force = np.stack([t**2 * (3.0 * c - t) / 6.0 + c**2 / 2.0 * (s - t), t * (2.0 * c - t) / 2.0, c - t])
    moment = np.stack([t**2 / 2.0 + c * (s - t), t, np.where(s < c, 1.0, 0.0)])
    return np.concatenate([force, moment], axis=2)


def bar_deflections(places: Floats, loaded: Floats) -> Floats:
    """Stretch of the clamped bar of unit stiffness under a force, or its twist under a torque, at each of the
    loaded places (k,) > 0, and its derivative: (2, q, k)."""
    s = places[:, None]
    return np.stack([np.minimum(s, loaded), np.where(s < loaded, 1.0, 0.0)])


# --- finite elements --------------------------------------------------------------------------------


def hermite_bending(places: Floats, nodes: Floats) -> Floats:
    """Cubic elements between ascending nodes (n+1,), the first of them clamped: deflections of the others, then
    their slopes, (3, q, 2 n)."""
    element, x, h = _place_in_element(places, nodes)
    # Hermite's cubics of a unit deflection or slope at either end of an element, with both derivatives by s
    start = np.stack([(1.0 - x) ** 2 * (1.0 + 2.0 * x), -6.0 * x * (1.0 - x) / h, (12.0 * x - 6.0) / h**2])
    end = np.stack([x**2 * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) / h, (6.0 - 12.0 * x) / h**2])
    slope_start = np.stack([h * x * (1.0 - x) ** 2, (1.0 - x) * (1.0 - 3.0 * x), (6.0 * x - 4.0) / h])
    slope_end = np.stack([h * x**2 * (x - 1.0), x * (3.0 * x - 2.0), (6.0 * x - 2.0) / h])
    # node 0 is clamped and has no columns, so that those of an element's end have its number
    n, q, inner = len(nodes) - 1, np.arange(len(places)), np.flatnonzero(element > 0)
    family = np.zeros((3, len(places), 2 * n))
    family[:, q, element], family[:, q, n + element] = end, slope_end
    family[:, inner, element[inner] - 1] = start[:, inner]
    family[:, inner, n + element[inner] - 1] = slope_start[:, inner]
    return family


def quadratic_bar(places: Floats, nodes: Floats) -> Floats:
    """Quadratic elements, the first node held: values at the other nodes, then the height of a bubble 4 x (1 - x)
    within each element, which is 0 at the nodes, (2, q, 2 n)."""
    element, x, h = _place_in_element(places, nodes)
    n, q, inner = len(nodes) - 1, np.arange(len(places)), np.flatnonzero(element > 0)
    family = np.zeros((2, len(places), 2 * n))
    family[:, q, element] = np.stack([x, 1.0 / h])
    family[:, q, n + element] = np.stack([4.0 * x * (1.0 - x), (4.0 - 8.0 * x) / h])
    family[:, inner, element[inner] - 1] = np.stack([1.0 - x, -1.0 / h])[:, inner]
    return family


def _place_in_element(places: Floats, nodes: Floats) -> tuple[Ints, Floats, Floats]:
    """Of each place (q,): index of its element, share of the element's length that lies before it, and that
    length."""
    element = np.clip(np.searchsorted(nodes, places, side="right") - 1, 0, len(nodes) - 2)
    h = np.diff(nodes)[element]
    return element, (places - nodes[element]) / h, h
