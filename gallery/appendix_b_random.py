"""Appendix B on random five-bars, and its Lagrange equations (B.13) from the kinetic energy (B.14), (B.15).

Lengths, masses, centres of mass on the axes, the inertia of the driven links, the handle's position, rates and
accelerations are drawn; the distal links have a slender rod's inertia, as (B.15) has it. (B.8) holds for equal
arms only, so that every second device has them.

(B.13) is evaluated without any matrix of the appendix. L = T1 + T2 is a function of p = [q1, q3] and p' alone: the
passive joints follow from where the circles about the elbows meet, their rates from the velocity of (B.5). L is
quadratic in p', so that dL/dp' is an exact difference; d/dt along (p', p'') and dL/dp are taken by complex steps,
which lose no digits.

Run `python -m gallery.appendix_b_random` to see how far formulas and engine are apart.
"""

from __future__ import annotations

import numpy as np

from gallery.appendix_b import POSITIONS, RATES, distances, relative_difference
from gallery.appendix_b import device as thesis_device
from zwidth.device.load import load
from zwidth.model import inertia_terms

COUNT = 20
NAMES = ("upper-right", "distal-right", "upper-left", "distal-left")
ACCELERATIONS = np.array([20.0, 35.0])  # rad/s^2
STEP = 1e-30


def random_five_bar(rng, *, equal_arms):
    """A five-bar with the bundled one's topology, every number within 25 % of its, or drawn anew."""
    settings = []
    L, m = np.array([0.147, 0.199, 0.147, 0.199]), np.array([0.282, 0.054, 0.282, 0.054])
    L, m = (values * rng.uniform(0.85, 1.15, 4) for values in (L, m))
    if equal_arms:
        L[2:] = L[:2]
    for i, name in enumerate(NAMES):
        distal = i % 2
        inertia = m[i] * L[i] ** 2 / 12.0 if distal else rng.uniform(0.001, 0.004)
        center = rng.uniform(0.2, 0.8) * L[i] if distal else rng.uniform(-0.05, 0.05)
        settings += [
            (f"mechanism.links.{name}.length_m", L[i]),
            (f"mechanism.links.{name}.mass_kg", m[i]),
            (f"mechanism.links.{name}.inertia_kg_m2", inertia),
            (f"mechanism.links.{name}.center_of_mass_m", [center, 0.0]),
        ]
    return load("five-bar", settings)


class LagrangeFunction:
    """L(p, p') of (B.13): T1 + T2 by (B.14), each by (B.15); p and p' may be complex.

    links      of the mechanism
    elbow_out  +1 or -1: on which side of the line between the elbows the handle is
    """

    def __init__(self, links, elbow_out):
        self.L, self.m, self.I = links.tip[:, 0], links.mass, links.inertia[:, 2, 2]
        self.c, self.elbow_out = links.center_of_mass[:, 0], elbow_out

    def distal_directions(self, p):
        """Unit vectors along links 2 and 4, (2, 2), from the elbows' distance."""
        _, L2, _, L4 = self.L
        elbows = self.L[[0, 2], None] * np.array([[np.cos(q), np.sin(q)] for q in p])
        x, y = elbows[1] - elbows[0]
        r = np.sqrt(x**2 + y**2)
        c = (L2**2 + r**2 - L4**2) / (2.0 * L2 * r)
        s = self.elbow_out * np.sqrt(1.0 - c**2)
        second = np.array([c * x - s * y, c * y + s * x]) / r
        return second, (elbows[0] + L2 * second - elbows[1]) / L4

    def __call__(self, p, rates):
        """(B.14)"""
        (q1, q3), (d1, d3) = p, rates
        L1, L2, L3, L4 = self.L
        (x2, y2), (x4, y4) = self.distal_directions(p)
        # d/dt of (B.5): L2 (q1' + q2') n2 - L4 (q3' + q4') n4 = L3 q3' n3 - L1 q1' n1, n turned a quarter on
        right = np.array(
            [-L3 * d3 * np.sin(q3) + L1 * d1 * np.sin(q1), L3 * d3 * np.cos(q3) - L1 * d1 * np.cos(q1)]
        )
        spin2, spin4 = np.linalg.solve(np.array([[-L2 * y2, L4 * y4], [L2 * x2, -L4 * x4]]), right)
        cos2, cos4 = np.cos(q1) * x2 + np.sin(q1) * y2, np.cos(q3) * x4 + np.sin(q3) * y4
        return self.chain_energy(0, cos2, d1, spin2 - d1) + self.chain_energy(2, cos4, d3, spin4 - d3)

    def chain_energy(self, i, cosine, driven, passive):
        """(B.15), with the cosine of the passive joint's angle and both joints' rates."""
        m1, m2 = self.m[i : i + 2]
        L1, L2 = self.L[i : i + 2]
        c1, c2 = self.c[i : i + 2]
        rod = m2 * L2**2 / 12.0
        first = self.I[i] + m1 * c1**2 + m2 * L1**2 + m2 * c2**2 + 2.0 * m2 * L1 * c2 * cosine + rod
        mixed = m2 * c2**2 + m2 * L1 * c2 * cosine + rod
        return 0.5 * first * driven**2 + 0.5 * (m2 * c2**2 + rod) * passive**2 + mixed * driven * passive

    def momentum(self, p, rates):
        """dL/dp', exact because L is quadratic in p'."""
        unit = np.eye(2)
        return np.array([(self(p, rates + e) - self(p, rates - e)) / 2.0 for e in unit])

    def torques(self, p, rates, accelerations):
        """(B.13): d/dt dL/dp' - dL/dp."""
        turning = self.momentum(p + 1j * STEP * rates, rates + 1j * STEP * accelerations).imag / STEP
        slope = np.array([self(p + 1j * STEP * e, rates).imag / STEP for e in np.eye(2)])
        return turning - slope


def lagrange_function(links, q):
    """The links' L on that side of the elbows on which the joint angles q have the handle."""
    second = [np.cos(q[0] + q[1]), np.sin(q[0] + q[1])]
    either = [LagrangeFunction(links, side) for side in (1.0, -1.0)]
    return min(either, key=lambda L: np.abs(L.distal_directions(q[[0, 2]])[0] - second).max())


def error_of_lagrange(device, position, rates, accelerations) -> float:
    """(B.13) against the engine's M p'' + inertia terms."""
    at, mechanism = device.at(position).posture, device.mechanism
    L = lagrange_function(mechanism.links, at.angles)
    engine = at.mass_matrix @ accelerations + inertia_terms(mechanism, at, rates)
    return relative_difference(L.torques(at.angles[[0, 2]], rates, accelerations), engine)


def random_cases():
    """Device, position, rates of p and accelerations."""
    rng = np.random.default_rng(19)
    for k in range(COUNT):
        device = random_five_bar(rng, equal_arms=k % 2 == 0)
        position = rng.uniform([-0.08, 0.2], [0.08, 0.26])
        yield device, position, rng.uniform(-2.0, 2.0, 2), rng.uniform(-50.0, 50.0, 2)


_cases = list(random_cases())
_found = [distances(*case[:3]) for case in _cases]
errors = {name: max(one[name] for one in _found) for name in _found[0] if name != "B_8"}
errors["B_8"] = max(one["B_8"] for one in _found[::2])
least_error_of_B_8_with_unequal_arms, largest_error_of_B_8_with_unequal_arms = (
    select(one["B_8"] for one in _found[1::2]) for select in (min, max)
)
least_error_of_B_17 = min(one["B_17"] for one in _found)
errors["B_13"] = max(error_of_lagrange(*case) for case in _cases)
error_of_B_13 = max(error_of_lagrange(thesis_device, at, RATES, ACCELERATIONS) for at in POSITIONS)


if __name__ == "__main__":
    for name, value in sorted(errors.items()):
        print(f"{name}: {value:.0e}")
    print(f"(B.13) of the thesis's device: {error_of_B_13:.0e}")
    print(f"(B.8) of unequal arms: from {least_error_of_B_8_with_unequal_arms:.0e}")
    print(f"(B.17): from {least_error_of_B_17:.0e}")
