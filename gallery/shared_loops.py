"""The loops that the scripts of this folder share, and how their figures are saved."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from zwidth.device.load import load
from zwidth.loop import Controller, Loop
from zwidth.model import Plant

PUBLISHED = "published-two-mass"


def published(model: str | None = None, stiffness_damping: float | None = None, **controller: object) -> Loop:
    """The plant of Table 3.4 in a loop.

    model              as in `Device.plant`; None: the two masses
    stiffness_damping  r_k of (3.2) [s]; None: as bundled, 0.00012 s
    controller         delay, velocity_filter
    """
    settings = []
    if stiffness_damping is not None:
        b = stiffness_damping * load(PUBLISHED).document["plant"]["stiffness_N_per_m"][0][0]
        settings.append(("plant.damping_Ns_per_m", [[b, -b], [-b, b]]))
    device = load(PUBLISHED, settings)
    return Loop(device.at(model=model).plant, Controller(device.controller.sampling_period, **controller))


def unit_mass(damping: float = 0.0, stiffness: float = 0.0, delay: float = 0.0) -> Loop:
    """One mass of 1 kg sampled every second: its K and B are the dimensionless p = K T^2/m and d = B T/m.

    damping    beta = b T/m
    stiffness  W^2 = k T^2/m
    delay      l, in samples
    """
    one = np.ones(1)
    plant = Plant(one[:, None], damping * one[:, None], stiffness * one[:, None], one, one.copy())
    return Loop(plant, Controller(1.0, delay))


def write_figure(draw: Callable[..., None], name: str) -> None:
    """Save what `draw(ax)` draws into the folder named on the command line (left out: out/)."""
    from zwidth.show import context, figure, save

    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    made, ax = figure()
    with context():
        draw(ax)
    print(save(made, folder / f"{name}.png"))


def write_page(draw: Callable[..., None], name: str, width: float, height: float) -> None:
    """The same for `draw(figure)`, which places its own axes; width and height in inches."""
    from zwidth.show import context, figure, save

    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    made, ax = figure(width, height)
    ax.remove()
    with context():
        draw(made)
    print(save(made, folder / f"{name}.png"))


def label_dimensionless(ax) -> None:
    """p and d on the axes instead of N/m and N s/m."""
    from matplotlib.ticker import ScalarFormatter

    for axis, text in (
        (ax.xaxis, "Dimensionless virtual stiffness p"),
        (ax.yaxis, "Dimensionless virtual damping d"),
    ):
        axis.set_major_formatter(ScalarFormatter())
        axis.set_label_text(text)
