"""Fig. 4.2: one mass without friction, its wall acting late by whole samples.

    z^3 - 2 z^2 + z + ((p + d)/2) z^(1-l) + (p/2) z^-l - (d/2) z^(-1-l) = 0               (thesis eq. 4.26)

The chart solves it for any l. One sample costs four fifths of the largest stiffness: 0.144 instead of 0.686. Below
(4.32) the thesis repeats the numbers of l = 0 for l = 1; (5.6) has the right ones.

Run `python -m gallery.fig_4_2_delay` to draw it.
"""

from __future__ import annotations

from gallery.shared_loops import label_dimensionless, unit_mass, write_figure
from zwidth.chart import stability_chart
from zwidth.conditions import thesis_unit_delay

DELAYS = (0, 1, 2, 3, 5)

charts = {l: stability_chart(unit_mass(delay=l), decay=False) for l in DELAYS}
largest_p = {l: chart.stiffness_max for l, chart in charts.items()}
d_at_largest_p = {l: chart.damping_at_stiffness_max for l, chart in charts.items()}
largest_d = {l: chart.damping_max for l, chart in charts.items()}

# (4.32), for l = 1
closed_largest_p = float(thesis_unit_delay.largest_stiffness(1.0, 1.0))
closed_d_at_largest_p = float(thesis_unit_delay.damping_at_largest_stiffness(1.0, 1.0))
closed_largest_d = float(thesis_unit_delay.largest_damping(1.0, 1.0))


def draw(ax) -> None:
    """No delay and one sample."""
    from zwidth.show import draw_models

    draw_models(ax, {"no delay (l = 0)": charts[0], "one sample (l = 1)": charts[1]})
    label_dimensionless(ax)


if __name__ == "__main__":
    write_figure(draw, "fig-4-2-delay")
