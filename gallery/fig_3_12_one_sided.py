"""Fig. 3.12 as an experiment: a hand pushes on a one-sided wall, and the damping is lowered until contact is lost.

The measured points are not in the scan. Of them the text says that "the lower bound is located in the negative
virtual damping domain", and of the operator that his passive damping "cannot explain the stable operation at high
negative virtual damping values. The operator must compensate actively in that range". So here two hands push with
5 N against the device with 7.5 % damping, and the lower edge is measured as on a bench (`zwidth experiment`):

- passive: the five numbers of `gallery.fig_3_12_operator`. His edge is that of the two-sided chart, within a tenth
  of a newton second per metre: that the wall has one side changes nothing as long as he keeps it pressed;
- reflex: 30 ms after the wall's force exceeds 1 N his arm and grasp stiffen (the amounts are placeholders). The
  lower edge moves down by another 0.5 to 1.2 Ns/m.

A passive hand of these numbers holds walls down to -6 Ns/m, and from 6 kN/m on none below zero. What is measured
below that needs a hand that changes.

Run `python -m gallery.fig_3_12_one_sided` to draw it.
"""

from __future__ import annotations

import numpy as np

from gallery.fig_3_12_operator import ARM, ASSUMED, GRASP, chart, damper, edge
from gallery.shared_loops import PUBLISHED, write_figure
from zwidth.contact import Hand, Reflex, StabilityTrial, StableExtent, measure_edges
from zwidth.device.load import load
from zwidth.loop import Loop
from zwidth.model import Operator

PUSH = 5.0  # N
STIFFNESS = np.array([500.0, 1000.0, 3000.0, 6000.0])
# What the hand adds when it stiffens: placeholders.
REFLEX = Reflex(threshold=1.0, latency=0.03, rise=0.05, arm_stiffness=1500.0, arm_damping=40.0, grasp_damping=30.0)


def loop_without_hand() -> Loop:
    """The two masses with 7.5 % damping."""
    b = damper(ASSUMED)
    device = load(PUBLISHED, [("plant.damping_Ns_per_m", [[b, -b], [-b, b]])])
    return device.at().loop


def lower_edge(hand: Hand) -> np.ndarray:
    """Damping at the lower edge for each stiffness, found by touching the one-sided wall."""
    bench = StabilityTrial(loop_without_hand(), hand, one_sided=True, speed=0.05)
    inside = StableExtent(chart.stiffness_max, chart.damping_at_stiffness_max, chart.damping_max, True)
    points = [point for point in measure_edges(bench, STIFFNESS, inside) if point.edge == "lower"]
    return np.array([point.damping for point in points])


def exact_lower_edge() -> np.ndarray:
    """The same of the two-sided chart with the passive operator."""
    K, B = edge(chart)
    low = chart.damping_at_stiffness_max > B
    order = np.argsort(K[low])
    return np.interp(STIFFNESS, K[low][order], B[low][order])


operator = Operator(*ARM, *GRASP)
passive = lower_edge(Hand(operator, push=PUSH))
reflex = lower_edge(Hand(operator, push=PUSH, reflex=REFLEX))
two_sided = exact_lower_edge()


def draw(ax) -> None:
    """Chart and measured lower edges."""
    from zwidth.show import BLUE, VERMILION, draw_chart, legend_above

    draw_chart(ax, chart)
    for found, text, colour, marker in (
        (passive, "one-sided, passive hand", BLUE, "s"),
        (reflex, "one-sided, reflex hand", VERMILION, "v"),
    ):
        ax.plot(STIFFNESS, found, marker, color=colour, markersize=5, label=text, zorder=4)
    ax.set_ylim(-15.0, 35.0)
    ax.set_xlim(-800.0, 9500.0)
    legend_above(ax)


if __name__ == "__main__":
    write_figure(draw, "fig-3-12-one-sided")
