"""A nonlinear rod by many small rotations, and its derivatives at rest: a judge of flexible beams."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import simpson
from scipy.spatial.transform import Rotation

STEPS = 1600
# Of places and turns where curvature times length is of this size, differences err by its 4th power
SIZE = 0.02


class Rod:
    """A rod of L, from its strains (curvature (n, 3) and stretch (n,)) amid n equal steps.

    places (n+1, 3) and turns (n+1, 3, 3) of the ends of the steps
    """

    def __init__(self, L, curvature, stretch):
        n = len(stretch)
        halves = Rotation.from_rotvec(0.5 * L / n * curvature).as_matrix()
        self.turns, self.places, tangents = np.empty((n + 1, 3, 3)), np.zeros((n + 1, 3)), np.empty((n, 3))
        self.turns[0] = np.eye(3)
        for i, half in enumerate(halves):
            middle = self.turns[i] @ half
            tangents[i] = middle[:, 0]
            self.turns[i + 1] = middle @ half
        np.cumsum(L / n * (1.0 + stretch)[:, None] * tangents, axis=0, out=self.places[1:])


def middles(L):
    """Places amid the steps (n,)."""
    return (np.arange(STEPS) + 0.5) * L / STEPS


def ends(L):
    """Places of the steps' ends (n+1,)."""
    return np.linspace(0.0, L, STEPS + 1)


def derivatives(L, curvature, stretch):
    """Of a rod whose strains are t times these, at t = 0 and the steps' ends (n+1, 3): the rates of place and
    rotation, the second derivative of the place, and the angular acceleration."""

    def differences(h):
        up, down = (Rod(L, sign * h * curvature, sign * h * stretch) for sign in (1.0, -1.0))
        straight = ends(L)[:, None] * [1.0, 0.0, 0.0]
        R1, R2 = (up.turns - down.turns) / (2.0 * h), (up.turns - 2.0 * np.eye(3) + down.turns) / h**2
        return np.stack(
            [
                (up.places - down.places) / (2.0 * h),
                axial(R1),
                (up.places - 2.0 * straight + down.places) / h**2,
                axial(R2 - R1 @ R1),  # [alpha]x = R'' R^T + R' R'^T, and R' is skew
            ]
        )

    h = SIZE / (L * max(np.max(np.abs(curvature)), np.max(np.abs(stretch)) / L))
    return (4.0 * differences(h) - differences(2.0 * h)) / 3.0  # their errors, by the square of h, cancel


def axial(A):
    """a (..., 3) of [a]x."""
    return (
        np.stack([A[..., 2, 1] - A[..., 1, 2], A[..., 0, 2] - A[..., 2, 0], A[..., 1, 0] - A[..., 0, 1]], -1) / 2.0
    )


def assert_moves_as_a_rod(body, beam, eps, curvature, stretch, tolerance, *, mass=True):
    """That along eps a body has the kinematics and energy of these strains, and if asked for the inertia.

    tolerance  relative to the largest number of each kind
    """
    L, m, I = beam.length, beam.mass_per_length, beam.torsional_inertia_per_length
    at = np.round(body.stations / L * STEPS).astype(int)
    assert body.stations == pytest.approx(at * L / STEPS), "stations are at whole steps"
    place, turn, place_2, spin_2 = derivatives(L, curvature, stretch)

    def same(found, expected):
        assert found == pytest.approx(expected, rel=tolerance, abs=tolerance * np.max(np.abs(expected)))

    def along(integrand):
        return simpson(integrand, dx=L / STEPS, axis=0)

    same(body.displacement @ eps, place[at])
    same(body.rotation @ eps, turn[at])
    same(np.einsum("...ij,i,j->...", body.displacement_2, eps, eps), place_2[at])
    same(np.einsum("...ij,i,j->...", body.rotation_2, eps, eps), spin_2[at])
    k_x, k_y, k_z = curvature.T
    energy = beam.EA * stretch**2 + beam.GJ * k_x**2 + beam.EI_y * k_y**2 + beam.EI_z * k_z**2
    same(eps @ body.stiffness @ eps, energy.mean() * L)
    if mass:
        same(np.einsum("xij,i,j->x", body.first_moment_2, eps, eps), m * along(place_2))
        same(body.mass[:3, 6:] @ eps, m * along(place))
        spun = m * along(np.cross(ends(L)[:, None] * [1.0, 0.0, 0.0], place)) + [I * along(turn[:, 0]), 0.0, 0.0]
        same(body.mass[3:6, 6:] @ eps, spun)
        same(eps @ body.mass[6:, 6:] @ eps, along(m * np.sum(place**2, axis=1) + I * turn[:, 0] ** 2))
