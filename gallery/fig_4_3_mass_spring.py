"""Fig. 4.3: the motor's mass on the drives' spring, the link side held still, no damping.

With W^2 = k_e T^2/m and c = cos W,

    -W^2 < p < (-2 d^2 (1 - c) + 2 d W^2 c)/(d (1 - c) + W^2)                            (thesis eq. 4.43)

The largest p over d is (4.44), its d (4.45). (4.46), W^2/(1 - c), is where the region ends at p = -W^2: the
largest damping of a wall with p > 0 is W^2 c/(1 - c), as (5.7) has it. All of it vanishes at W = pi/2, and returns
beyond 3 pi/2: there the samples see the vibration at 2 pi - W, slower than it is.

Run `python -m gallery.fig_4_3_mass_spring` to draw it.
"""

from __future__ import annotations

import numpy as np

from gallery.shared_loops import label_dimensionless, unit_mass, write_figure
from zwidth.chart import stability_chart
from zwidth.conditions import thesis_flexible as closed

RATES = (0.2, 0.5, 0.8, 1.1, 1.4, np.pi / 2 - 0.01)

charts = {W: stability_chart(unit_mass(stiffness=W**2), decay=False) for W in RATES}


def _largest_error(name: str, formula) -> float:
    """Largest relative distance of the charts from a closed form over W."""
    return max(abs(getattr(charts[W], name) / float(formula(1.0, W**2, 1.0)) - 1.0) for W in RATES)


error_of_4_44 = _largest_error("stiffness_max", closed.largest_stiffness)
error_of_4_45 = _largest_error("damping_at_stiffness_max", closed.damping_at_largest_stiffness)
error_of_5_7 = _largest_error("damping_max", closed.largest_damping)
error_of_area = _largest_error("stable_area", closed.stable_area)

# One W in numbers.
W = 0.8
largest_p = charts[W].stiffness_max
d_at_largest_p = charts[W].damping_at_stiffness_max
largest_d = charts[W].damping_max
d_of_4_46 = float(closed.largest_damping_of_all(1.0, W**2, 1.0))
d_of_5_7 = float(closed.largest_damping(1.0, W**2, 1.0))
highest_d_of_region = max(float(ring[:, 1].max()) for ring in charts[W].regions)
p_at_highest_d = min(float(ring[np.argmax(ring[:, 1]), 0]) for ring in charts[W].regions)
area = charts[W].stable_area
area_right = float(closed.stable_area(1.0, W**2, 1.0))


def area_of_5_8(rate: float, logarithm_of: float) -> float:
    """(5.8) in m^2/T^3: W^4/(8 sin^4(W/2)) [1 + 4 cos W + cos 2W - 4 (1 + cos W) ln(...)]."""
    bracket = 1.0 + 4.0 * np.cos(rate) + np.cos(2.0 * rate) - 4.0 * (1.0 + np.cos(rate)) * np.log(logarithm_of)
    return float(rate**4 / (8.0 * np.sin(rate / 2.0) ** 4) * bracket)


# The scan has ln(1 - cos "2,"), and "2," elsewhere is Omega_n; integrating (4.43) gives ln(1 + cos W).
area_with_a_minus = area_of_5_8(W, 1.0 - np.cos(W))
area_with_a_plus = area_of_5_8(W, 1.0 + np.cos(W))


def stable_at(rate: float) -> bool:
    """Whether any wall with p > 0, d >= 0 is stable at W."""
    return not np.isnan(stability_chart(unit_mass(stiffness=rate**2), decay=False).stiffness_max)


BEYOND = (np.pi / 2 - 0.02, np.pi / 2 + 0.02, 3.0, 3 * np.pi / 2 - 0.02, 3 * np.pi / 2 + 0.02, 5.5)
stable_beyond = tuple(stable_at(rate) for rate in BEYOND)


def taylor_edge(d: float, rate: float) -> float:
    """(4.47): (4.43) with cos W = 1 - W^2/2."""
    return 2.0 * d / (d + 2.0) * (2.0 - d - rate**2)


def _error_of_4_47(rate: float) -> float:
    return abs(float(closed.stiffness_edge(0.4, 1.0, rate**2, 1.0)) - taylor_edge(0.4, rate))


def _error_of_4_48(rate: float) -> float:
    """Relative error of the slope of d over p at small d, 1/(2 - W^2) for 1/(2 c)."""
    return abs(2.0 * np.cos(rate) / (2.0 - rate**2) - 1.0)


order_of_4_47 = float(np.log2(_error_of_4_47(0.2) / _error_of_4_47(0.1)))
order_of_4_48 = float(np.log2(_error_of_4_48(0.2) / _error_of_4_48(0.1)))


def draw(ax) -> None:
    """Edges for several W, with the maxima of (4.44), (4.45) across them."""
    from zwidth.show import draw_models

    shown = {f"W = {rate:.2f}": charts[rate] for rate in RATES[:5]}
    draw_models(ax, shown, (-0.8, 0.8, -0.5, 2.2))
    rates = np.linspace(0.05, np.pi / 2 - 1e-6, 100)
    K = closed.largest_stiffness(1.0, rates**2, 1.0)
    B = closed.damping_at_largest_stiffness(1.0, rates**2, 1.0)
    ax.plot(K, B, color="black", linewidth=0.8)
    label_dimensionless(ax)


if __name__ == "__main__":
    write_figure(draw, "fig-4-3-mass-spring")
