"""1.1.3: spring stability, the walls of a mass that stay stable when any spring holds it.

Colgate and Schenkel chose the spring on which the mass vibrates at the Nyquist frequency, k = m (pi/T)^2. One mass
with friction beta = b T/m = 0.2, in units of the mass and the sampling period: the walls that are stable both free
and on that spring, by the exact regions of one mode, beside the passive ones (4.15) and all stable ones (4.9).
"""

from __future__ import annotations

import numpy as np

from gallery import fig_4_1_rigid as rigid
from gallery.brute_force import BruteForceLoop
from zwidth.conditions import spring_stable

BETA = rigid.BETA
NYQUIST_SPRING = np.pi**2

region = spring_stable(1.0, BETA, 1.0)
largest_p, its_d = region.largest()
largest_p_on_the_spring = float(region.on_nyquist_spring.stiffness_limit(0.0))
frequency_on_the_spring = float(np.sqrt(NYQUIST_SPRING) / (2.0 * np.pi))  # in sampling frequencies


def _largest_stable_p(spring: float, d: float) -> float:
    """Largest stable p at a damping, by eigenvalues."""
    judge = BruteForceLoop(1.0, BETA, spring, 1.0, 1.0)
    low, high = 0.0, 4.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if judge.radius(middle, d) < 1.0 else (low, middle)
    return low


judged_on_the_spring = _largest_stable_p(NYQUIST_SPRING, 0.0)
judged_at_its_d = min(_largest_stable_p(0.0, its_d), _largest_stable_p(NYQUIST_SPRING, its_d))

# Springs of all frequencies to four times Nyquist's, on a wall just inside.
SPRINGS = np.linspace(0.0, 4.0 * np.pi, 400) ** 2
_inside = [BruteForceLoop(1.0, BETA, k, 1.0, 1.0).radius(0.999 * largest_p, its_d) for k in SPRINGS]
worst_radius_inside = float(np.max(_inside))
passive_p, stable_p = rigid.passive_p, rigid.damped.stiffness_max
