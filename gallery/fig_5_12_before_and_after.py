"""Figs. 5.12 to 5.14: what the vibrations of the drives do before and after the motor's mass is optimised.

At the walls B, C and D of Fig. 5.11 the two masses are simulated with the motor-side mass that the device has,
0.0254 kg, and with the one of fastest decay (`gallery.optimal_mass`). Shown is x1 - x2, "the superimposed
vibrations, which can have important influence on the fidelity". Both start 1 mm inside the wall, at rest; the
start is ours.

- B and C: "the vibrations due to structural flexibility decay much faster": to a tenth in 23 and 20 ms where they
  took 46 and 229 ms;
- D, "previously unstable", is "now moved to well inside the stable domain": to a tenth in 18 ms.

The structural vibration is the pair of roots above 50 Hz. The slowest motion of the whole is another one, which
both masses make together: (5.15), derived for the motor's mass on its spring, says nothing of it, and at B it even
decays a little more slowly than before.

Run `python -m gallery.fig_5_12_before_and_after` to draw them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gallery import optimal_mass
from gallery.shared_loops import published, write_page
from zwidth.chart import eigenvalues, judge
from zwidth.contact import Judgement, TimeResponse, judge_response, simulate, wall
from zwidth.loop import Loop

WALLS = {name: optimal_mass.WALLS[name] for name in "BCD"}
START = 1e-3  # m
DURATION = 0.5  # s
STRUCTURAL = 50.0  # Hz, above it


@dataclass(frozen=True)
class Vibration:
    """x1 - x2 with one motor-side mass.

    radius               spectral radius of the loop;   structural  the same of its roots above 50 Hz
    decay_time_to_tenth  time in which the structural vibration falls to a tenth [s]; negative: it grows tenfold
    stretch              the run, whose handle is x1 - x2
    """

    mass: float
    verdict: str
    radius: float
    structural: float
    decay_time_to_tenth: float
    stretch: TimeResponse
    judged: Judgement


def vibration(motor_mass: float, K: float, B: float) -> Vibration:
    """One wall with a motor-side mass [kg]."""
    plant = published().plant
    seen = replace(plant, mass=np.diag([plant.mass[0, 0], motor_mass]), handle=np.array([1.0, -1.0]))
    loop = Loop(seen, published().controller)
    values = wall.values(stiffness=K, damping=B)
    response = simulate(loop, wall, values, duration=DURATION, start_position=START)
    found, roots = judge(loop, [K], [B]), eigenvalues(loop, K, B)
    fast = np.abs(np.angle(roots)) > 2.0 * np.pi * STRUCTURAL * loop.period
    structural = float(np.max(np.abs(roots[fast])))
    return Vibration(
        motor_mass,
        found.names[0],
        float(found.spectral_radius[0]),
        structural,
        float(-loop.period * np.log(10.0) / np.log(structural)),
        response,
        judge_response(response),
    )


PUBLISHED_MASS = float(published().plant.mass[1, 1])
before = {name: vibration(PUBLISHED_MASS, *where) for name, where in WALLS.items()}
after = {name: vibration(optimal_mass.optimum[name][0], *where) for name, where in WALLS.items()}


def draw(figure) -> None:
    """One panel for each wall."""
    from zwidth.show import BLUE, VERMILION, label, legend_above

    axes = figure.subplots(3, 1, sharex=True)
    for ax, (name, (K, B)) in zip(axes, WALLS.items(), strict=True):
        for found, colour, dashes in ((before[name], VERMILION, (0, (4, 1))), (after[name], BLUE, "-")):
            shown = found.stretch.trail_time <= 0.1
            text = f"motor-side mass {1e3 * found.mass:.1f} g, {found.verdict}"
            time, size = found.stretch.trail_time[shown], found.stretch.trail[shown]
            ax.plot(time, size, color=colour, linestyle=dashes, linewidth=1.0, label=text)
        legend_above(ax, columns=2, title=f"{name}: {K:.0f} N/m, {B:.0f} Ns/m")
        ax.set_ylim(-0.5e-3, 0.5e-3)
        label(ax.yaxis, "x1 − x2", "m")
    label(axes[-1].xaxis, "Time", "s")


if __name__ == "__main__":
    write_page(draw, "fig-5-12-before-and-after", 6.5, 7.0)
