"""Fig. 3.10: what the two masses do in five regions of the stability chart.

The figure marks points A to E; the scan does not hold where. The walls below are ours, placed as the text says: at
K = 4 kN/m, A and B beside the upper edge (21.66 Ns/m), outside and inside, D and C beside the lower one (2.42
Ns/m), and E the wall of fastest decay. Both masses start 1 mm inside the wall, at rest.

- from B to A "the smaller mass oscillates relative to the larger mass with an increasing amplitude": at about
  200 Hz, of which the link side has 7 % at B, 4 % at A, of what the motor side has;
- at C and D "both x1 and x2 show oscillatory motion at the same frequency": 17.1 Hz, the link side with 1.24 times
  the motor side's amplitude, by the spring between them. "The behaviour of the system can be described by a
  rigid-body model": one rigid mass is stable at C and unstable at D too; it would vibrate at 18.9 Hz;
- E "represents the fastest decaying oscillation": all other walls take longer, by definition of the chart.

What the simulated motion grows or decays by in each sample is the logarithm of the spectral radius.

Run `python -m gallery.fig_3_10_chart_regions` to draw it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gallery.shared_loops import published, write_page
from zwidth.chart import eigenvalues, spectral_radius, stability_chart
from zwidth.contact import Judgement, TimeResponse, judge_response, simulate, wall
from zwidth.loop import Loop

loop = published()
chart = stability_chart(loop)
fastest = chart.fastest_decay

WALLS = {
    "A": (4000.0, 23.0),
    "B": (4000.0, 20.0),
    "C": (4000.0, 3.5),
    "D": (4000.0, 1.5),
    "E": (fastest.stiffness, fastest.damping),
}
START = 1e-3  # m
LONG = 0.6  # s, until one vibration is left; E has died away by then
LENGTHS = dict.fromkeys(WALLS, LONG) | {"E": 0.3}
SHOWN = {"A": 0.06, "B": 0.06, "C": 0.3, "D": 0.3, "E": 0.2}  # s


@dataclass(frozen=True)
class SimulatedWall:
    """A wall and what the masses do: link side and motor side between the samples, and what is said of it."""

    stiffness: float
    damping: float
    radius: float
    link: TimeResponse
    motor: TimeResponse
    judgement: Judgement

    @property
    def amplitude_ratio(self) -> float:
        """Link side's amplitude over the motor side's, in the last quarter."""
        last = slice(len(self.link.trail) * 3 // 4, None)
        return float(np.ptp(self.link.trail[last]) / np.ptp(self.motor.trail[last]))


def simulate_wall(K: float, B: float, duration: float) -> SimulatedWall:
    """Simulate one wall, once with an eye on each mass."""
    at_motor = Loop(replace(loop.plant, handle=loop.plant.sensor), loop.controller)
    link, motor = (
        simulate(each, wall, wall.values(stiffness=K, damping=B), duration=duration, start_position=START)
        for each in (loop, at_motor)
    )
    return SimulatedWall(K, B, float(spectral_radius(loop, K, B)), link, motor, judge_response(link))


points = {name: simulate_wall(*where, LENGTHS[name]) for name, where in WALLS.items()}
rigid_radius = {name: float(spectral_radius(published("rigid"), *WALLS[name])) for name in "CD"}
rigid_frequency = float(
    np.max(np.abs(np.angle(eigenvalues(published("rigid"), *WALLS["C"])))[:2]) / (2.0 * np.pi * loop.period)
)


def draw(figure) -> None:
    """The chart with the walls on it, and the two masses' motion at each."""
    from zwidth.show import BLUE, VERMILION, draw_chart, label

    places = [["chart", "A", "B"], ["chart", "D", "C"], ["chart", "none", "E"]]
    axes = figure.subplot_mosaic(places, width_ratios=(1.4, 1, 1))
    axes["none"].axis("off")
    draw_chart(axes["chart"], chart)
    for name, found in points.items():
        place = (found.stiffness, found.damping)
        axes["chart"].annotate(name, place, xytext=(5, -3), textcoords="offset points", weight="bold")
        axes["chart"].plot(*place, "o", color="black", markersize=3)
        ax, end = axes[name], SHOWN[name]
        for response, text, colour, dashes in (
            (found.link, "link side", BLUE, "-"),
            (found.motor, "motor side", VERMILION, (0, (4, 1))),
        ):
            shown = response.trail_time <= end
            time, place = response.trail_time[shown], response.trail[shown]
            ax.plot(time, place, color=colour, linestyle=dashes, label=text, linewidth=1.0)
        ax.set_title(f"{name}: {found.stiffness:.0f} N/m, {found.damping:.3g} Ns/m, {found.judgement.behaviour}")
        label(ax.xaxis, "Time", "s")
        label(ax.yaxis, "Position", "m")
    axes["none"].legend(*axes["A"].get_legend_handles_labels(), loc="center", frameon=False)


if __name__ == "__main__":
    write_page(draw, "fig-3-10-points", 10.0, 6.0)
