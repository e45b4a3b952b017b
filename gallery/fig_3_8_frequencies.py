"""Fig. 3.8: the vibration with which each wall of the edge fails.

On the edge a pair of roots is exp(+-i theta) and the handle vibrates at theta/(2 pi T). Where virtual damping is
low it swings as a rigid body, at a few hertz; where it is high the motor's side shakes on its drives, near their
natural frequency. Between the two lies a corner, at which both vibrations are on the edge at once. One sample of
delay moves the tip itself into such a corner.

Run `python -m gallery.fig_3_8_frequencies` to draw it.
"""

from __future__ import annotations

from gallery.fig_3_7_bilateral_wall import chart
from gallery.shared_loops import published, write_figure
from zwidth.chart import BoundaryArc, stability_chart

NYQUIST = 0.5 / chart.loop.period

# Arcs of pairs, by their frequency; the third edge is the line K = 0, a real root at z = 1.
arcs = sorted((arc for arc in chart.boundary if arc.frequency.max() > 0.0), key=lambda arc: arc.frequency.max())
low, high = arcs


def _corner(one: BoundaryArc, other: BoundaryArc) -> tuple[float, float, float, float]:
    """K, B and both frequencies where two arcs meet."""
    ends = [
        (float(a.stiffness[i]), float(a.damping[i]), float(a.frequency[i])) for a in (one, other) for i in (0, -1)
    ]

    def apart(pair) -> float:
        (K, B, _), (other_K, other_B, _) = pair
        return abs(K - other_K) / chart.stiffness_max + abs(B - other_B) / chart.damping_max

    first, second = min(((p, q) for p in ends[:2] for q in ends[2:]), key=apart)
    return first[0], first[1], first[2], second[2]


corner_stiffness, corner_damping, corner_low_Hz, corner_high_Hz = _corner(low, high)
highest_Hz = float(high.frequency.max())

delayed = stability_chart(published(delay=1.0), decay=False)
delayed_corner_Hz = delayed.frequencies_at_stiffness_max


def draw(ax) -> None:
    """Frequency along the edge."""
    from zwidth.show import draw_frequency

    draw_frequency(ax, chart)


if __name__ == "__main__":
    write_figure(draw, "fig-3-8-frequencies")
