"""Appendix B: the five-bar's kinematics and inertia as printed there, against the general engine.

q = [q1, q2, q3, q4] are relative angles, p = [q1, q3] the driven ones. The appendix puts every centre of mass on
its link's axis and gives the distal links a slender rod's inertia, m L^2/12. `AppendixB` takes any: with
c = xi + i eta as a complex number the centre of link 2 is at L1 e^{i q1} + c2 e^{i (q1 + q2)}, so that L_c2 cos q2
of (B.15) becomes Re(c2 e^{i q2}), its derivative -Im(c2 e^{i q2}), and L_c^2 becomes |c|^2.

What the scan has lost: L1 before sin q1 in (B.10), the names of two coefficients in (B.11)-(B.12), the factor
1/sin(q1 + q2 - q3 - q4) of (B.7), and a -1 in (B.18). (B.17) is another matter: as printed it is -2 times
-dT/dq, and (B.19) needs M' q' as well; no number of the thesis depends on it.

Run `python -m gallery.appendix_b` to see how far formulas and engine are apart.
"""

from __future__ import annotations

import numpy as np

from gallery.table_3_4 import on_the_axes, rods
from zwidth.device.load import load
from zwidth.model import inertia_terms


class AppendixB:
    """One posture: q = [q1, q2, q3, q4] relative angles [rad] of a mechanism's four links."""

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
        """(B.16)"""
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

    def handle(self, i):
        """(B.1), (B.2): position by chain i, i + 1, from its base joint."""
        one, both = self.q[i], self.q[i] + self.q[i + 1]
        return self.L[i] * np.array([np.cos(one), np.sin(one)]) + self.L[i + 1] * np.array(
            [np.cos(both), np.sin(both)]
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

    def jacobian(self):
        """(B.7), with the factor 1/sin(q1 + q2 - q3 - q4)."""
        (L1, _, L3, _), (q1, q2, q3, q4) = self.L, self.q
        rows = [
            [-L1 * np.sin(q2) * np.sin(q3 + q4), L3 * np.sin(q1 + q2) * np.sin(q4)],
            [L1 * np.cos(q3 + q4) * np.sin(q2), -L3 * np.cos(q1 + q2) * np.sin(q4)],
        ]
        return np.array(rows) / np.sin(q1 + q2 - q3 - q4)

    def gyration(self, rates):
        """c = M' q' - dT/dq of (B.19), both links of each chain."""
        c = np.zeros(4)
        for i in (0, 2):
            j = i + 1
            slope = -(self.c[j] * np.exp(1j * self.q[j])).imag * self.m[j] * self.L[i]
            c[i] = slope * rates[j] * (2 * rates[i] + rates[j])
            c[j] = -slope * rates[i] ** 2
        return c

    def printed_gyration(self, rates):
        """(B.17) as the scan reads: -2 m2 L1 L_c2 sin q2 q1' (q1' + q2') for q2, and alike for q4."""
        c = np.zeros(4)
        for i in (0, 2):
            j = i + 1
            slope = -(self.c[j] * np.exp(1j * self.q[j])).imag * self.m[j] * self.L[i]
            c[j] = 2.0 * slope * rates[i] * (rates[i] + rates[j])
        return c

    def nonlinear(self, driven_rates, gyration=None):
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
        return B.T @ ((gyration or self.gyration)(rates) + self.mass() @ turning)


def relative_difference(found, expected) -> float:
    """Largest distance, relative to the largest entry."""
    return float(np.max(np.abs(np.subtract(found, expected))) / np.max(np.abs(expected)))


def passive_angles(one: AppendixB) -> tuple[float, float]:
    """(B.8): q2 and q4 from q1 and q3, for both base joints in one place and equal arms."""
    (L1, L2, L3, L4), half = one.L, (one.q[2] - one.q[0]) / 2.0
    return np.arcsin(L1 / L2 * np.sin(half)) + half, 2.0 * np.pi - (np.arcsin(L3 / L4 * np.sin(half)) + half)


def half_angle(one: AppendixB, x: float, y: float) -> float:
    """What tan(q1/2) leaves of (B.11), a1 t^2 + a2 t + a3, over its largest term; with (B.12)."""
    L1, L2 = one.L[:2]
    square = x**2 + y**2 + L1**2 - L2**2
    t = np.tan(one.q[0] / 2.0)
    terms = np.array([(square + 2.0 * x * L1) * t**2, -4.0 * y * L1 * t, square - 2.0 * x * L1])
    return float(abs(terms.sum()) / np.abs(terms).max())


def distances(device, position, rates) -> dict[str, float]:
    """How far each formula and the engine are apart, the handle at a position and the drives at their rates."""
    at = device.at(position).posture
    one = AppendixB(device.mechanism, at.angles)
    B, J = one.transformation(), at.jacobian[:2]
    chains = [one.chain_jacobian(i) for i in (0, 2)]
    # (B.6): the constraints' Jacobian leaves the columns of (B.18) alone
    constraint = np.hstack([chains[0], -chains[1]])
    engine = inertia_terms(device.mechanism, at, rates)
    turns = np.exp(1j * np.array(passive_angles(one))) - np.exp(1j * one.q[[1, 3]])
    return {
        "position": max(relative_difference(one.handle(i), at.position[:2]) for i in (0, 2)),
        "jacobian": max(relative_difference(chains[i // 2] @ B[i : i + 2], J) for i in (0, 2)),
        "B_6": float(np.abs(constraint @ B).max() / np.abs(constraint).max()),
        "B_7": relative_difference(one.jacobian(), J),
        "B_8": float(np.abs(turns).max()),
        "inverse": half_angle(one, *at.position[:2]),
        "mass": relative_difference(B.T @ one.mass() @ B, at.mass_matrix),
        "terms": relative_difference(one.nonlinear(rates), engine),
        "B_17": relative_difference(one.nonlinear(rates, one.printed_gyration), engine),
        # -dT/dq itself, without M' q'
        "slope_alone": relative_difference(one.nonlinear(rates, lambda r: -one.printed_gyration(r) / 2.0), engine),
    }


# The device as the appendix has it, at the reference position and beside it.
device = load("five-bar", [*rods, *on_the_axes])
mechanism = device.mechanism
POSITIONS = ((0.0, 0.25), (0.05, 0.2), (-0.08, 0.27))
RATES = np.array([1.3, -0.7])  # rad/s
_found = [distances(device, position, RATES) for position in POSITIONS]
(
    error_of_position,
    error_of_jacobian,
    error_of_B_6,
    error_of_B_7,
    error_of_B_8,
    error_of_inverse,
    error_of_mass,
    error_of_terms,
    error_of_B_17,
    error_of_slope_alone,
) = (max(one[name] for one in _found) for name in _found[0])
least_error_of_B_17 = min(one["B_17"] for one in _found)


if __name__ == "__main__":
    for name, value in sorted(vars().items()):
        if name.startswith("error_of"):
            print(f"{name[6:]}: {value:.0e}")
    print("More, of random five-bars: python -m gallery.appendix_b_random")
