"""Integrals along a beam, from the displacements, rotations and strains that its shape functions have.

They are summed at Gauss points of panels, between which strains may jump; each station is an edge of panels, so
that the integrals up to it are as exact as the others.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats
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
        """Those of the coordinates eta of eps = T eta; basis (e, n)."""
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
    """Mass (e, e) with the base at rest, and stiffness (e, e), of shapes at Gauss points."""
    (ux, uy, uz), (ax, _, _), (kx, ky, kz) = (np.moveaxis(field, 1, 0) for field in shapes[:3])
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
    """D2 (3, e, e) and O2 (3, e, e) of a station s: derivatives of 2 r2 and w by eps.

    once, twice  (q,)  weights of the integral up to s, and of the integral up to s of the integral up to there,
                       which is that of (s - place) times the integrand
    """
    (ax, ay, az), (kx, ky, kz) = (np.moveaxis(field, 1, 0) for field in (shapes.rotation, shapes.curvature))
    c = shapes.stretch

    def turned(weights: Floats) -> tuple[Floats, Floats, Floats]:
        """Integral of a x k."""
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
    """Sum over points of weight times one_i times other_j, (e, e)."""
    return np.asarray((one * weights[:, None]).T @ (one if other is None else other))
