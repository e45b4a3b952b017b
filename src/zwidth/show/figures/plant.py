"""A plant as masses, springs and dampers in a row, where it is such a row."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from zwidth.model.plant import Plant
from zwidth.show.figures.style import BLACK, GREY, VERMILION
from zwidth.show.mass_chain import MassChain
from zwidth.show.units import as_written

WIDTH, GAP, HALF = 1.2, 1.6, 0.55  # of a mass, between masses, half the height of a mass


def draw_chain(ax: Axes, plant: Plant, chain: MassChain) -> None:
    """Masses as boxes with their numbers, springs over dampers, and where the wall acts, reads and is held."""
    n = len(chain.mass)
    left = GAP * (np.arange(n) + 1.0) + WIDTH * np.arange(n)
    for i, x in enumerate(left):
        ax.add_patch(Rectangle((x, -HALF), WIDTH, 2 * HALF, facecolor="#EEEEEE", edgecolor=BLACK))
        ax.text(x + WIDTH / 2, 0.0, as_written(float(chain.mass[i]), "kg"), ha="center", va="center", fontsize=8.0)
        ax.text(x + WIDTH / 2, -HALF - 0.12, "\n".join(_roles(plant, i)), ha="center", va="top", fontsize=8.0)
    for i in range(n + 1):
        start = left[i] - GAP if i < n else left[-1] + WIDTH
        if chain.stiffness[i] > 0.0 or chain.damping[i] > 0.0:
            _spring_and_damper(ax, start, start + GAP, float(chain.stiffness[i]), float(chain.damping[i]))
            if i in (0, n):
                _ground(ax, start if i == 0 else start + GAP)
    ends = chain.stiffness[[0, n]] + chain.damping[[0, n]] > 0.0
    ax.set_xlim(left[0] - GAP * ends[0] - 0.3, left[-1] + WIDTH + GAP * ends[1] + 0.3)
    ax.set_ylim(-HALF - 1.0, HALF + 0.7)
    ax.set_aspect("equal")
    ax.set_axis_off()


def _roles(plant: Plant, i: int) -> list[str]:
    handle = plant.handle if plant.handle is not None else np.zeros(plant.size)
    names = (("wall acts", plant.actuator), ("encoder", plant.sensor), ("handle", handle))
    return [name for name, vector in names if vector[i] != 0.0]


def _spring_and_damper(ax: Axes, start: float, end: float, stiffness: float, damping: float) -> None:
    both = stiffness > 0.0 and damping > 0.0
    if stiffness > 0.0:
        y = 0.3 if both else 0.0
        x = start + (end - start) * np.array([0.0, 0.2, *np.linspace(0.235, 0.765, 9), 0.8, 1.0])
        zigzag = [0.0, 0.0, *(0.13 * (-1.0) ** k for k in range(9)), 0.0, 0.0]
        ax.plot(x, y + np.array(zigzag), color=VERMILION, linewidth=1.2)
        ax.text((start + end) / 2, y + 0.18, as_written(stiffness, "N/m"), ha="center", va="bottom", fontsize=8.0)
    if damping > 0.0:
        y = -0.3 if both else 0.0
        middle = (start + end) / 2
        ax.plot([start, middle], [y, y], color=GREY, linewidth=1.2)
        ax.plot([middle] * 2, [y - 0.13, y + 0.13], color=GREY, linewidth=1.2)
        sides = [middle - 0.22, middle + 0.22, middle + 0.22, middle - 0.22]
        cup = [y + 0.18, y + 0.18, y - 0.18, y - 0.18]
        ax.plot(sides, cup, color=GREY, linewidth=1.2)
        ax.plot([middle + 0.22, end], [y, y], color=GREY, linewidth=1.2)
        ax.text(middle, y - 0.27, as_written(damping, "Ns/m"), ha="center", va="top", fontsize=8.0)


def _ground(ax: Axes, x: float) -> None:
    ax.plot([x, x], [-HALF, HALF], color=BLACK, linewidth=2.0)
