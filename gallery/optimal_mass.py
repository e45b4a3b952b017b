"""(5.15): the motor's mass at which the fastest possible decay is reached, for a given wall.

The motor's mass m on the drives' spring k_e, not damped, wall (K, B). The mass of smallest spectral radius is
where two vibrations decay alike: with x = cos W the condition (5.13) is a parabola in x, and rho is least where
its discriminant vanishes. With P = K/k_e and D = B/(k_e T),

    rho^2 = 8 D (1 + P) / (4 D^2 + 4 D P + 8 D + P^2)

Printed it is

    rho = 2 sqrt 2 sqrt(k_e k_d T + k_d k_p T)/sqrt(4 k_d^2 + 8 k_e k_d T + 4 k_d k_p T + k_p^2 T^2)

whose last term, (k_p T)^2, the scan damages to "KZAL". The formula holds where B > K T/2 and the remaining real
root is at most rho; `measures.vibration_decay` has it, and why no mass does better. Beside it the minimum is found
by eigenvalues alone.

Run `python -m gallery.optimal_mass` to see the numbers.
"""

from __future__ import annotations

import numpy as np

from gallery.shared_loops import published
from zwidth.loop import Controller, Loop
from zwidth.measures import fastest_mass, optimal_mass
from zwidth.model import Plant

T = published().period
K_E = float(published().plant.stiffness[0, 0])

# K, B of the points of Fig. 5.11, and of the wall whose numbers are printed for D.
WALLS = {"B": (3000.0, 15.0), "C": (4000.0, 20.0), "D": (5000.0, 25.0), "printed for D": (5000.0, 55.0)}


def fastest(wall: tuple[float, float]) -> tuple[float, float]:
    """Mass [kg] and spectral radius of the motor's mass on its spring, by eigenvalues."""
    one = np.ones(1)
    plant = Plant(one[:, None], 0.0 * one[:, None], K_E * one[:, None], one, one.copy())
    return fastest_mass(Loop(plant, Controller(T)), *wall, 0.01, 0.5)


def printed_5_15(wall: tuple[float, float], period: float = T) -> float:
    """(5.15) as printed, its last term read as k_p^2 T^2."""
    (K, B), k = wall, K_E
    below = 4.0 * B**2 + 8.0 * k * B * period + 4.0 * B * K * period + (K * period) ** 2
    return float(2.0 * np.sqrt(2.0) * np.sqrt(k * B * period + B * K * period) / np.sqrt(below))


optimum = {name: fastest(wall) for name, wall in WALLS.items()}
by_5_15 = {name: printed_5_15(wall) for name, wall in WALLS.items()}
by_zwidth = {name: float(optimal_mass(*wall, K_E, T).spectral_radius) for name, wall in WALLS.items()}
# Table 3.4 prints twice the sampling period.
with_the_printed_period = printed_5_15(WALLS["B"], 2.0 * T)


if __name__ == "__main__":
    for name, (mass, rho) in optimum.items():
        print(f"{name}: {mass:.7f} kg, spectral radius {rho:.6f}; (5.15): {by_5_15[name]:.6f}")
