"""Fig. 4.1: one mass, free and with friction, under a sampled wall.

In units of the mass and the sampling period (p = K T^2/m, d = B T/m, beta = b T/m, eps = (1 - exp(-beta))/beta)
the characteristic polynomial of (3.16), mapped by z = (s + 1)/(s - 1), is mu3 s^3 + mu2 s^2 + mu1 s + mu0, and
Hurwitz's conditions are p > 0, mu0 > 0 and

    mu1 mu2 > mu0 mu3:   p < beta eps (d + beta) (beta - g d) / ((beta + (1 - eps) d) g),   g = eps + eps beta - 1

The last is (4.9), its largest p (4.10) and (4.11). The second, p + 2 d < (4 beta - 2 beta^2 eps)/(2 - 2 eps -
beta eps), is the real root z = -1, which (4.9) leaves out: it cuts into the region once beta exceeds 2.31, and
cuts off its tip above 3.66. For beta -> 0 all of it becomes p < 2 d (2 - d)/(2 + d) (4.14).

Run `python -m gallery.fig_4_1_rigid` to draw it.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from gallery.shared_loops import label_dimensionless, unit_mass, write_figure
from zwidth.chart import judge, stability_chart
from zwidth.conditions import thesis_rigid

BETA = 0.2

free = stability_chart(unit_mass(), decay=False)
damped = stability_chart(unit_mass(BETA), decay=False)


def eps(beta: float) -> float:
    """(1 - exp(-beta))/beta"""
    return float(-np.expm1(-beta) / beta)


def edge(d, beta: float):
    """(4.9): p at which a pair of roots reaches the circle."""
    e = eps(beta)
    g = e + e * beta - 1.0
    return beta * e * (d + beta) * (beta - g * d) / ((beta + (1.0 - e) * d) * g)


def tip(beta: float) -> tuple[float, float]:
    """(4.10), (4.11): the largest p of (4.9), and its d."""
    e = eps(beta)
    g = e + e * beta - 1.0
    d = beta * (1.0 - e * beta) / (g + e * np.sqrt(beta * g))
    return float(edge(d, beta)), float(d)


def real_root_line(beta: float) -> float:
    """p + 2 d at which a root is z = -1."""
    e = eps(beta)
    return float((4.0 * beta - 2.0 * beta**2 * e) / (2.0 - 2.0 * e - beta * e))


tip_of_4_10 = tip(BETA)

# The edge without damping: the closed forms against the chart.
largest_p = float(thesis_rigid.largest_stiffness(1.0, 1.0))
d_at_largest_p = float(thesis_rigid.damping_at_largest_stiffness(1.0, 1.0))
area_of_5_5 = float(thesis_rigid.stable_area(1.0, 1.0))

# The stiffest passive wall has no damping, (4.15): p = 2 beta. There the edge of stability is close behind it.
passive_p = 2.0 * BETA
stable_p_without_damping = max(
    float(np.interp(0.0, arc.damping[order], arc.stiffness[order]))
    for arc in damped.boundary
    for order in [np.argsort(arc.damping)]
    if arc.damping.min() < 0.0 < arc.damping.max()
)


def _clearance(beta: float) -> float:
    """How far the real root's line stays clear of (4.9), at the nearest, over p > 0."""
    e = eps(beta)
    top = beta / (e + e * beta - 1.0)
    found = minimize_scalar(lambda d: -(edge(d, beta) + 2.0 * d), bounds=(-beta, top), method="bounded")
    return float(real_root_line(beta) + found.fun)


# (4.9) is incomplete above the first, its tip (4.10) unstable above the second.
beta_where_incomplete = float(brentq(_clearance, 1.0, 3.5))
beta_where_tip_unstable = float(brentq(lambda b: real_root_line(b) - tip(b)[0] - 2.0 * tip(b)[1], 2.5, 6.0))
above = 1.02 * beta_where_tip_unstable
radius_inside_the_tip_above = float(judge(unit_mass(above), 0.999 * tip(above)[0], tip(above)[1]).spectral_radius)
below = 0.98 * beta_where_tip_unstable
radius_inside_the_tip_below = float(judge(unit_mass(below), 0.999 * tip(below)[0], tip(below)[1]).spectral_radius)


def _edge_damping(p: float, beta: float) -> float:
    """Lower edge of (4.9) in d at a stiffness."""
    return float(brentq(lambda d: edge(d, beta) - p, -beta, tip(beta)[1]))


def tangent(p: float, beta: float) -> float:
    """(4.12): the lowest stable d at small p, by the slope of (4.9) where it meets p = 0, d = -beta."""
    e = eps(beta)
    return float((e + e * beta - 1.0) * p / (e * beta * (1.0 + beta)) - beta)


def _order(error, small: float) -> float:
    """Order of an error in its argument, observed from a halving."""
    return float(np.log2(error(small) / error(small / 2.0)))


# (4.12) and (4.17) are tangents: their error is of second order in p.
order_of_4_12 = _order(lambda p: _edge_damping(p, BETA) - tangent(p, BETA), 1e-3)
order_of_4_17 = _order(lambda p: float(brentq(lambda d: 2 * d * (2 - d) / (2 + d) - p, 0, 0.8)) - p / 2.0, 1e-3)

# (4.17) is called conservative. Without friction it is not: this wall meets it, and is unstable.
OPTIMISTIC = (0.5, 0.3)
radius_of_optimistic_wall = float(judge(unit_mass(), *OPTIMISTIC).spectral_radius)

# With friction its line is steeper than the tangent: where (4.9) bends back to it.
conservative_up_to = float(
    brentq(lambda p: p / 2.0 - BETA - _edge_damping(p, BETA), 1e-2 * passive_p, 0.99 * tip(BETA)[0])
)


def draw(ax) -> None:
    """Both charts; p and d on the axes."""
    from zwidth.show import draw_models

    draw_models(ax, {"beta = 0.2": damped, "beta = 0": free})
    label_dimensionless(ax)


if __name__ == "__main__":
    write_figure(draw, "fig-4-1-rigid")
