"""Chapter 4's closed forms where the thesis leaves them: (4.9) with the root it omits, (4.26) for any whole delay.

One mass with friction, beta = b T/m: (4.9) is the pair of roots alone, and z = -1 bounds the stable walls too,

    p + 2 d < flip(beta) = 2 beta/(1 - tanh(beta/2)/(beta/2))

which binds on the axis d = 0 where (n1 + n0) beta/n0 exceeds it. One mass without friction, l samples late:
(4.26) is solved on the circle, its tip is where (l + 1) sin t tan((l + 1) t) = 2.

Every closed form stands beside the exact chart of the same loop.
"""

from __future__ import annotations

from scipy.optimize import brentq

from gallery.brute_force import BruteForceLoop
from gallery.shared_loops import unit_mass
from zwidth.chart import stability_chart
from zwidth.conditions import thesis_damped, thesis_whole_delay

# Below the printed tip's end, between it and the axis, and beyond: tip, corner with z = -1, d = 0.
FRICTIONS = (0.2, 2.0, 3.0, 3.7, 5.0)
DELAYS = range(6)


def _relative_difference(loop, closed) -> float:
    """Largest relative distance of a chart's tip from a closed form's."""
    chart = stability_chart(loop, decay=False)
    p, d = (float(value) for value in closed)
    # a tip on the axis has no damping to compare with, but that of the order 1
    return max(abs(chart.stiffness_max / p - 1.0), abs(chart.damping_at_stiffness_max - d) / max(d, 1.0))


completed = {beta: tuple(float(v) for v in thesis_damped.largest(beta, 1.0, 1.0)) for beta in FRICTIONS}
printed = {beta: tuple(float(v) for v in thesis_damped.printed_tip(beta, 1.0, 1.0)) for beta in FRICTIONS}
error_of_completed = max(_relative_difference(unit_mass(beta), completed[beta]) for beta in FRICTIONS)


def _room_on_the_axis(beta: float) -> float:
    n1, n0, _, flip = thesis_damped.held_force_response(beta)
    return float(flip - (n1 + n0) * beta / n0)


# From here on z = -1 comes first at d = 0, and the stiffest wall has no damping.
beta_on_the_axis = float(brentq(_room_on_the_axis, 3.0, 4.5))
on_the_axis = tuple(float(thesis_damped.largest(x * beta_on_the_axis, 1.0, 1.0)[1]) for x in (0.999, 1.001))

BESIDE = 0.98

delayed = {l: tuple(float(v) for v in thesis_whole_delay.largest(1.0, 1.0, l)) for l in DELAYS}
delayed_damping = {l: float(thesis_whole_delay.largest_damping(1.0, 1.0, l)) for l in DELAYS}
error_of_delayed = max(_relative_difference(unit_mass(delay=float(l)), delayed[l]) for l in DELAYS)


def tip_by_brute_force(beta: float) -> tuple[float, float]:
    """p and d of the stiffest wall of a damped mass by brute force."""
    p, d, _ = BruteForceLoop(1.0, beta, 0.0, 1.0, 1.0).largest_stiffness(1.5 * completed[beta][0], 2.0)
    return p, d


def delayed_tip_by_brute_force(samples: int) -> tuple[float, float]:
    """The same of a mass without friction, so many samples late."""
    p, d, _ = BruteForceLoop(1.0, 0.0, 0.0, 1.0, 1.0, delay=samples).largest_stiffness(1.0, 2.0)
    return p, d


tips_by_brute_force = {beta: tip_by_brute_force(beta) for beta in FRICTIONS}
# d of the stiffest wall by brute force, a little less and more friction than `beta_on_the_axis`
judged_beside_the_axis = tuple(
    BruteForceLoop(1.0, x * beta_on_the_axis, 0.0, 1.0, 1.0).largest_stiffness(30.0, 2.0)[1]
    for x in (BESIDE, 2.0 - BESIDE)
)
