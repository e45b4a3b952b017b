"""The five-bar by the thesis's Appendix B, written out here, against the general engine.

The appendix puts every centre of mass on its link's axis. Here each has a lateral offset eta: with
c = xi + i eta as a complex number, a link-1 angle q1 and a relative angle q2, the centre of link 2 is at
L1 e^{i q1} + c2 e^{i (q1+q2)}, so that L_c2 cos q2 of (B.15) becomes Re(c2 e^{i q2}) = xi cos q2 - eta sin q2, its
derivative -L_c2 sin q2 becomes -(xi sin q2 + eta cos q2), and L_c^2 becomes |c|^2. The central inertia is the
measured one, in place of m L^2 / 12.
"""

import numpy as np
import pytest
from model_cases import five_bar, random_five_bar, two_bar_angles

from zwidth.model.posture import OK, inertia_terms, solve_posture

RELATIVE = 1e-9
SIDES = {"outward": (1, -1), "inward": (-1, 1), "right": (1, 1), "left": (-1, -1)}


class AppendixB:
    """One posture: q = [q1, q2, q3, q4] relative angles, p = [q1, q3]."""

    def __init__(self, mechanism, q):
        links = mechanism.links
        self.q, self.L = q, links.tip[:, 0]
        self.m, self.I = links.mass, links.inertia[:, 2, 2]
        self.c = links.center_of_mass[:, 0] + 1j * links.center_of_mass[:, 1]

    def chain_mass(self, i):
        """(B.15)-(B.16): the block of chain i, i + 1 with its absolute position in `q`."""
        j, L = i + 1, self.L[i]
        arm = (self.c[j] * np.exp(1j * self.q[j])).real
        corner = self.m[j] * abs(self.c[j]) ** 2 + self.I[j]
        first = self.I[i] + self.m[i] * abs(self.c[i]) ** 2 + self.m[j] * (L**2 + 2 * L * arm) + corner
        mixed = corner + self.m[j] * L * arm
        return np.array([[first, mixed], [mixed, corner]])

    def mass(self):
        M = np.zeros((4, 4))
        M[:2, :2], M[2:, 2:] = self.chain_mass(0), self.chain_mass(2)
        return M

    def transformation(self):
        """B of (B.18), by eliminating q2' and q4' from the velocity of (B.5)."""
        (L1, L2, L3, L4), (q1, q2, q3, q4) = self.L, self.q
        s = np.sin(q3 + q4 - q1 - q2)
        return np.array(
            [
                [1, 0],
                [-L1 * np.sin(q3 + q4 - q1) / (L2 * s) - 1, L3 * np.sin(q4) / (L2 * s)],
                [0, 1],
                [-L1 * np.sin(q2) / (L4 * s), L3 * np.sin(q1 + q2 - q3) / (L4 * s) - 1],
            ]
        )

    def chain_jacobian(self, i):
        """(B.3), (B.4)"""
        a, b = self.L[i], self.L[i + 1]
        one, both = self.q[i], self.q[i] + self.q[i + 1]
        return np.array(
            [
                [-a * np.sin(one) - b * np.sin(both), -b * np.sin(both)],
                [a * np.cos(one) + b * np.cos(both), b * np.cos(both)],
            ]
        )

    def gyration(self, rates):
        """c = M' q' - dT/dq of (B.17), both links of each chain."""
        c = np.zeros(4)
        for i in (0, 2):
            j = i + 1
            slope = -(self.c[j] * np.exp(1j * self.q[j])).imag * self.m[j] * self.L[i]
            c[i] = slope * rates[j] * (2 * rates[i] + rates[j])
            c[j] = -slope * rates[i] ** 2
        return c

    def nonlinear(self, driven_rates):
        """B^T (c + M B' p') of (B.19); B' p' from the second derivative of (B.5) at p'' = 0."""
        B = self.transformation()
        rates = B @ driven_rates
        angles = np.array([self.q[0], self.q[0] + self.q[1], self.q[2], self.q[2] + self.q[3]])
        spins = np.array([rates[0], rates[0] + rates[1], rates[2], rates[2] + rates[3]])
        centripetal = np.sum([1, 1, -1, -1] * self.L * np.exp(1j * angles) * spins**2)
        direction = self.L * 1j * np.exp(1j * angles)
        columns = np.array([direction[1], -direction[3]])
        turning = np.zeros(4)
        turning[[1, 3]] = np.linalg.solve(
            np.array([columns.real, columns.imag]), [centripetal.real, centripetal.imag]
        )
        return B.T @ (self.gyration(rates) + self.mass() @ turning)


def close(ours, theirs):
    return np.max(np.abs(ours - theirs)) <= RELATIVE * np.max(np.abs(theirs))


@pytest.mark.parametrize("seed", range(25))
def test_appendix_b(seed):
    rng = np.random.default_rng(seed)
    mechanism = random_five_bar(rng)
    assembly = ("outward", "inward")[seed % 2]
    posture = solve_posture(
        mechanism, mechanism.reference_position[:2] + rng.uniform(-0.015, 0.015, (8, 2)), assembly
    )
    assert (posture.status == OK).all()
    assert np.max(posture.closure_residual) < 1e-14
    rates = rng.uniform(-5, 5, (8, 2))
    terms = inertia_terms(mechanism, posture, rates)
    L1, L2, L3, L4 = mechanism.links.tip[:, 0]
    half = mechanism.links.origin[0, 0]
    for k in range(8):
        one, two = SIDES[assembly]
        at = posture.position[k]
        q = np.concatenate([two_bar_angles(L1, L2, half, at, one), two_bar_angles(L3, L4, -half, at, two)])
        assert posture.angles[k] == pytest.approx(q, abs=1e-11)
        judge = AppendixB(mechanism, q)
        B = judge.transformation()
        assert close(posture.mass_matrix[k], B.T @ judge.mass() @ B)
        assert close(posture.jacobian[k][:2], judge.chain_jacobian(0) @ B[:2])
        assert close(posture.jacobian[k][:2], judge.chain_jacobian(2) @ B[2:])
        assert np.all(posture.jacobian[k][2] == 0)
        assert close(terms[k], judge.nonlinear(rates[k]))


def test_minimum_set_jacobian_as_printed():
    """(B.7), the closed form of dx/dp; its factor is 1 / sin(q1 + q2 - q3 - q4), whose signs the scan lost."""
    mechanism = five_bar()
    posture = solve_posture(mechanism, (0.03, 0.21))
    (L1, _, L3, _), (q1, q2, q3, q4) = mechanism.links.tip[:, 0], posture.angles
    s = np.sin(q1 + q2 - q3 - q4)
    printed = np.array(
        [
            [-L1 * np.sin(q2) * np.sin(q3 + q4), L3 * np.sin(q1 + q2) * np.sin(q4)],
            [L1 * np.cos(q3 + q4) * np.sin(q2), -L3 * np.cos(q1 + q2) * np.sin(q4)],
        ]
    )
    assert close(posture.jacobian[:2], printed / s)
