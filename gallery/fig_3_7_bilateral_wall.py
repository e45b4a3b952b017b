"""Fig. 3.7: the walls that the device renders with nobody holding it.

Two masses and the spring of the drives between them (thesis eq. 3.2), damped in proportion to the stiffness:

    [m_e1   0 ] x'' + r_k K x' + K x = [ 0 ]          K = k_e [ 1 -1]
    [ 0   m_e2]                        [ 1 ] f                [-1  1]

    f_j = -(k_p x2_j + k_d (x2_j - x2_{j-1})/T)

The text prints r_k = 0.0012 s and a damping ratio of 0.5; chapter 5 says 5 %. The mode's ratio is
r_k w/2 with w^2 = k_e (m_e1 + m_e2)/(m_e1 m_e2): r_k = 0.00012 s gives 4.9 % and a tip where the measured chart
has its own, a little above 7000 N/m; 0.0012 s gives a wall beyond even the limit that quantisation sets.

Run `python -m gallery.fig_3_7_bilateral_wall` to draw it.
"""

from __future__ import annotations

import numpy as np

from gallery.shared_loops import published, write_figure
from zwidth.chart import StabilityChart, judge, stability_chart
from zwidth.model import natural_frequencies

R_K = 0.00012
R_K_PRINTED = 0.0012
QUANTISATION_LIMIT = 26700.0  # 2 C/Delta, section 3.2.5 [N/m]

loop = published()
chart = stability_chart(loop)
chart_as_printed = stability_chart(published(stiffness_damping=R_K_PRINTED), decay=False)

mode = 2.0 * np.pi * float(natural_frequencies(loop.plant)[-1])
damping_ratio = R_K * mode / 2.0
damping_ratio_as_printed = R_K_PRINTED * mode / 2.0


def edges_at(stability: StabilityChart, K: float) -> tuple[float, float]:
    """Lowest and highest damping of the stable walls of stiffness K, by bisection of eigenvalues' verdicts."""
    inside = np.interp(
        K, [0.0, stability.stiffness_max], [stability.damping_max / 2, stability.damping_at_stiffness_max]
    )
    found = []
    for outside in (0.0, 2.0 * stability.damping_max):
        stable, unstable = inside, outside
        for _ in range(60):
            middle = 0.5 * (stable + unstable)
            good = float(judge(stability.loop, K, middle).spectral_radius) < 1.0
            stable, unstable = (middle, unstable) if good else (stable, middle)
        found.append(float(stable))
    return found[0], found[1]


def crossings_at(stability: StabilityChart, K: float) -> list[float]:
    """Dampings at which the chart's edge crosses a stiffness, ascending; linear between the edge's points."""
    found = set()
    for arc in stability.boundary:
        side = arc.stiffness - K
        for i in np.flatnonzero(side[1:] * side[:-1] < 0.0):
            share = side[i] / (side[i] - side[i + 1])
            found.add(float(arc.damping[i] + share * (arc.damping[i + 1] - arc.damping[i])))
    return sorted(found)


edges_at_4000 = edges_at(chart, 4000.0)
crossings_at_4000 = crossings_at(chart, 4000.0)


def draw(ax) -> None:
    """The chart."""
    from zwidth.show import draw_chart

    draw_chart(ax, chart)


if __name__ == "__main__":
    write_figure(draw, "fig-3-7-bilateral-wall")
