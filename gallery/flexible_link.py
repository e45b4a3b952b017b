"""A flexible link as a beam lumped at its tip, (2.22) and (2.23): one link on a motor, and a wall before its tip.

The device file has a beam and a motor, the thesis two inertias on either side of a spring:

    k_e = 3 E I / L^3,  m_e = 33/140 m,     k_phi = k_e L^2,  J_phi = m_e L^2,  J_theta = hub + m L^2/3 - J_phi

with the rest of the link's inertia at its hub. Second route: these numbers, damped alike, in the judge of
`brute_force`. Beside it stand the same beam by assumed modes and by finite elements, and its exact first vibration
on the hub, the root x = beta L of

    sin x cosh x - cos x sinh x + gamma x^3 (1 + cos x cosh x) = 0,     gamma = hub / (m L^2)

Run `python -m gallery.flexible_link` to see all of them.
"""

from __future__ import annotations

from math import cos, cosh, pi, sin, sinh

import numpy as np
from scipy.optimize import brentq

from gallery.brute_force import BruteForceLoop
from zwidth.device import from_document

LENGTH, OUTER, WALL = 0.2, 8e-3, 0.5e-3  # of an aluminium tube [m]
YOUNGS_MODULUS, DENSITY = 68.9e9, 2700.0
MOTOR_INERTIA, TRANSMISSION_RATIO = 4e-6, 10.0  # [kg m^2]
DAMPING_RATIO, PERIOD = 0.03, 1e-3
METHODS = {"lumped": {}, "assumed-modes": {"modes": 4}, "finite-elements": {"elements": 16, "modes": 12}}


def device(method):
    """The link and its motor, by one of the methods."""
    section = {"shape": "tube", "outer_diameter_m": OUTER, "wall_m": WALL}
    beam = {"section": section, "material": "aluminium-6061", "method": method, **METHODS[method]}
    motor = {"motor_inertia_kg_m2": MOTOR_INERTIA, "transmission_ratio": TRANSMISSION_RATIO}
    return from_document(
        {
            "name": "a link that bends",
            "mechanism": {
                "links": [{"name": "link", "joint": "revolute", "length_m": LENGTH, "beam": beam}],
                "drives": [{"name": "motor", "joint": "link", **motor}],
                "handle": {"link": "link"},
                "assemblies": {"out": {"joints_rad": {"link": 0.0}}},
                "reference": {"position_m": [LENGTH, 0.0], "direction": [0.0, 1.0], "assembly": "out"},
                "damping": {"mode_ratio": DAMPING_RATIO},
            },
            "loop": {"sampling_period_s": PERIOD},
        }
    )


found = {method: device(method).bending().bent for method in METHODS}
largest = {method: numbers.stiffness_max for method, numbers in found.items()}
first = {method: numbers.first_mode for method, numbers in found.items()}  # of those that the wall moves
felt = found["lumped"].static_stiffness  # at the tip, the motor held


# --- the second route -------------------------------------------------------------------------------

_inner = OUTER - 2.0 * WALL
EI = YOUNGS_MODULUS * pi * (OUTER**4 - _inner**4) / 64.0
mass = DENSITY * pi * (OUTER**2 - _inner**2) / 4.0 * LENGTH
hub = TRANSMISSION_RATIO**2 * MOTOR_INERTIA
k_e, m_e = 3.0 * EI / LENGTH**3, 33.0 / 140.0 * mass
k_phi, J_phi = k_e * LENGTH**2, m_e * LENGTH**2
J_theta = hub + mass * LENGTH**2 / 3.0 - J_phi
_squared = k_phi * (1.0 / J_phi + 1.0 / J_theta)
first_by_hand = np.sqrt(_squared) / (2.0 * pi)


_M = np.diag([J_phi, J_theta])
_momentum = np.array([1.0, -1.0])  # of the mode: M times its shape
_drag = 2.0 * DAMPING_RATIO * np.sqrt(_squared) / (1.0 / J_phi + 1.0 / J_theta) * np.outer(_momentum, _momentum)
_spring = k_phi * np.outer(_momentum, _momentum)

# The wall reads L theta and acts as the torque L f.
judge = BruteForceLoop(_M, _drag, _spring, [0.0, LENGTH], PERIOD)
largest_by_hand = judge.largest_stiffness(1.5 * largest["lumped"], 200.0)[0]

gamma = hub / (mass * LENGTH**2)


def _left_over(x):
    return sin(x) * cosh(x) - cos(x) * sinh(x) + gamma * x**3 * (1.0 + cos(x) * cosh(x))


x = brentq(_left_over, 1.0, 3.9)  # between the cantilever's 1.875 and the pinned beam's 3.927
first_exact = x**2 / (2.0 * pi) * np.sqrt(EI / (mass * LENGTH**3))
too_high = np.sqrt(3.0 * 140.0 / 33.0) / brentq(lambda z: 1.0 + cos(z) * cosh(z), 1.0, 3.0) ** 2 - 1.0


def main() -> None:
    """Both routes, and the other methods."""
    print(f"m_e {1e3 * m_e:.6g} g, k_e {k_e:.6g} N/m, felt {felt:.12g} N/m")
    print(f"first mode {first['lumped']:.12g} and {first_by_hand:.12g} Hz; of the beam {first_exact:.12g} Hz")
    print(f"largest stiffness {largest['lumped']:.12g} and {largest_by_hand:.12g} N/m")
    for method in METHODS:
        print(f"{method}: first mode {first[method]:.12g} Hz, largest stiffness {largest[method]:.9g} N/m")


if __name__ == "__main__":
    main()
