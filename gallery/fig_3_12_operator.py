"""Fig. 3.12: the walls that the device renders in an operator's hand, as far as five numbers describe him.

Arm and grasp, fastened to the link side of the two masses (thesis eq. 3.23-3.24):

    [m_e1          ] x'' + [b + b_c  -b  -b_c    ] x' + [k_e + k_c  -k_e  -k_c    ] x = [0]
    [     m_e2     ]       [-b        b   0      ]      [-k_e        k_e   0      ]     [1] f
    [          m_h ]       [-b_c      0   b_c+b_h]      [-k_c        0     k_c+k_h]     [0]

with m_h = 0.8 kg, k_h = 580 N/m, b_h = 5.5 Ns/m of the arm and k_c = 10 kN/m, b_c = 5 Ns/m of a firm grasp, and
7.5 % of structural damping, b = 2 zeta sqrt(k_e mu) with 1/mu = 1/m_e1 + 1/m_e2. The scan holds neither the curve
nor the measured points; what the text says about them can be asked of the model:

- the passive operator has "a relatively small effect": with the same 7.5 % he adds 0.4 % of stiffness and 9 % of
  area, most of that where the damping is low;
- the larger stable domain "is mainly the consequence of the assumed increased structural dissipation": 7.5 % in
  place of 5 % adds 23 % of stiffness and 32 % of area;
- "for low virtual damping values the difference is significant": alone no wall of B <= 0 is stable, in his hand
  those down to -6 Ns/m, and without damping those up to 6 kN/m;
- his stiffness "slightly reduces the physically meaningful (positive) domain, as it will be shown later": shown in
  4.2, where a mass stands on the operator's spring; there 580 N/m lower the largest stiffness by 0.2 % (rigid) and
  3 % (motor's mass alone), by (4.44). Not so of these three masses: it moves their static edge to
  K = -1/(1/k_e + 1/k_c + 1/k_h) and leaves the area of positive walls as it is, to 1e-7.

Run `python -m gallery.fig_3_12_operator` to draw it.
"""

from __future__ import annotations

import numpy as np

from gallery.brute_force import BruteForceLoop
from gallery.shared_loops import PUBLISHED, write_figure
from zwidth.chart import StabilityChart, stability_chart
from zwidth.conditions import thesis_flexible
from zwidth.device.load import load
from zwidth.loop import Loop
from zwidth.model import natural_frequencies

OPERATOR = "thesis-arm"
LINK, MOTOR, SPRING = 0.2616, 0.0254, 15620.0  # m_e1, m_e2 [kg], k_e [N/m]
ARM = (0.8, 580.0, 5.5)  # m_h [kg], k_h [N/m], b_h [Ns/m]
GRASP = (10000.0, 5.0)  # k_c [N/m], b_c [Ns/m]
ASSUMED, USUAL = 0.075, 0.05  # damping ratios of section 3.3.1 and of chapter 5


def damper(ratio: float) -> float:
    """b of the damper between the masses that gives their mode a damping ratio [Ns/m]."""
    return 2.0 * ratio * float(np.sqrt(SPRING * LINK * MOTOR / (LINK + MOTOR)))


def loop_with_operator(ratio: float, operator: str = OPERATOR, **changes: float) -> Loop:
    """The published two masses with a damping ratio, in an operator's hands; changes: of his numbers."""
    b = damper(ratio)
    settings = [("plant.damping_Ns_per_m", [[b, -b], [-b, b]])]
    settings += [(f"operator.{key}", value) for key, value in changes.items()]
    device = load(PUBLISHED, settings, operator)
    return device.at().loop


def judge_of(ratio: float) -> BruteForceLoop:
    """(3.24) typed in, for an independent computation."""
    b, (m_h, k_h, b_h), (k_c, b_c) = damper(ratio), ARM, GRASP
    return BruteForceLoop(
        np.diag([LINK, MOTOR, m_h]),
        [[b + b_c, -b, -b_c], [-b, b, 0.0], [-b_c, 0.0, b_c + b_h]],
        [[SPRING + k_c, -SPRING, -k_c], [-SPRING, SPRING, 0.0], [-k_c, 0.0, k_c + k_h]],
        [0.0, 1.0, 0.0],
        chart.loop.period,
    )


def on_the_operators_spring(mass: float, stiffness: float) -> tuple[float, float]:
    """Largest stiffness of a mass on a spring of the operator, by (4.44) and by brute force [N/m]."""
    period = chart.loop.period
    closed = float(thesis_flexible.largest_stiffness(mass, stiffness, period))
    judge = BruteForceLoop(mass, 0.0, stiffness, 1.0, period)
    return closed, judge.largest_stiffness(1.3 * closed, 2.0 * mass / period)[0]


def edge(stability: StabilityChart) -> np.ndarray:
    """All points of the edge, (2, n): stiffness [N/m], damping [Ns/m]."""
    return np.concatenate([np.stack([arc.stiffness, arc.damping]) for arc in stability.boundary], axis=1)


def crossings_at(stability: StabilityChart, B: float) -> list[float]:
    """Stiffnesses at which the chart's edge crosses a damping; linear between the edge's points."""
    found = []
    for arc in stability.boundary:
        side = arc.damping - B
        for i in np.flatnonzero(side[1:] * side[:-1] < 0.0):
            share = side[i] / (side[i] - side[i + 1])
            found.append(float(arc.stiffness[i] + share * (arc.stiffness[i + 1] - arc.stiffness[i])))
    return found


chart = stability_chart(loop_with_operator(ASSUMED), decay=False)
chart_without_operator = stability_chart(loop_with_operator(ASSUMED, "none"), decay=False)
chart_at_5_percent = stability_chart(loop_with_operator(USUAL), decay=False)
alone_at_5_percent = stability_chart(loop_with_operator(USUAL, "none"), decay=False)
without_arm_stiffness = stability_chart(loop_with_operator(ASSUMED, arm_stiffness_N_per_m=0.0), decay=False)

# 4.2's models: the device's mass, or the motor's alone, free and on the arm's spring.
MASSES = {"rigid": 0.287, "motor": MOTOR}  # kg
tips_on_operator_spring = {
    (name, k): on_the_operators_spring(mass, k) for name, mass in MASSES.items() for k in (0.0, ARM[1])
}

# Highest natural frequency, free and in his hand [Hz].
frequency_alone, frequency_held = (
    float(natural_frequencies(each.loop.plant)[-1]) for each in (chart_without_operator, chart)
)

gain_by_operator = chart.stiffness_max / chart_without_operator.stiffness_max - 1.0
gain_by_damping = chart.stiffness_max / chart_at_5_percent.stiffness_max - 1.0
area_by_operator = chart.stable_area / chart_without_operator.stable_area - 1.0
area_by_damping = chart.stable_area / chart_at_5_percent.stable_area - 1.0
area_by_arm_stiffness = chart.stable_area / without_arm_stiffness.stable_area - 1.0

lowest_damping = float(np.min(edge(chart)[1]))
stiffest_undamped = max(crossings_at(chart, 0.0))
static_edge = float(np.min(edge(chart)[0]))
static_edge_by_hand = -1.0 / (1.0 / SPRING + 1.0 / GRASP[0] + 1.0 / ARM[1])


def draw(ax) -> None:
    """With and without the operator, and without him at 5 %."""
    from zwidth.show import draw_models

    charts = {
        "in the operator's hand, 7.5 % damping": chart,
        "alone, 7.5 % damping": chart_without_operator,
        "alone, 5 % damping": alone_at_5_percent,
    }
    K0, K1, B0, B1 = chart.box
    draw_models(ax, charts, (max(K0, -0.25 * K1), K1, B0, B1))


if __name__ == "__main__":
    write_figure(draw, "fig-3-12-operator")
