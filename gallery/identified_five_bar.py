"""The thesis's procedure from end to end: torque and deflection, Table 3.3, masses, boundary, damping, chart.

Section 3.1.3 blocks the driven links and loads the motors, both ways; section 3.2 measures the stability boundary
and compares it with a model whose damping it estimates. The thesis prints neither the measured deflections (Fig.
3.5) nor the points of the boundary (Fig. 3.7): **both are made here**, the deflections by springs with the average
and the largest values of Table 3.3 behind dry friction, the boundary by the virtual experiment on a device with
5 % of damping, read with a scatter of 1 %. What is shown is that the procedure finds again what was put in.

Run `python -m gallery.identified_five_bar` for the numbers, `python docs/make_images.py` for the picture.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

import zwidth
from zwidth.chart import StabilityChart
from zwidth.device import Device
from zwidth.identify import Identification
from zwidth.measures import Description

DRIVES = ("motor-right", "motor-left")
LARGEST, AVERAGE = (0.45, 0.75), (0.40, 0.65)  # N m/rad, Table 3.3
FRICTION, TORQUE = 0.003, 0.045  # N m: the first is chosen, the second is read off Fig. 3.5
COUNT = 2.0 * np.pi / 8192  # rad, chosen
DAMPING, SCATTER = 0.05, 0.01  # of every flexible mode, chapter 5; of the points, chosen
GUESS = 0.02  # of damping, from which the fit begins
PATH = "mechanism.damping.mode_ratio"


@cache
def deflections(drive: int) -> dict[str, np.ndarray]:
    """Torque of a motor and deflection of its shaft behind a blocked link, made up: columns of a record."""
    rng = np.random.default_rng([3, 5, drive])
    forward, backward = LARGEST[drive], 2.0 * AVERAGE[drive] - LARGEST[drive]
    t = np.linspace(0.0, 6.0, 6000)
    torque = TORQUE * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * t))
    held, elastic = 0.0, np.empty_like(torque)
    for row, now in enumerate(torque):  # dry friction lets the spring's torque lag
        held = min(max(held, now - FRICTION), now + FRICTION)
        elastic[row] = held
    angle = np.where(elastic > 0.0, elastic / forward, elastic / backward) + 2e-4 * rng.normal(size=len(t))
    return {"torque_Nm": torque + 2e-4 * rng.normal(size=len(t)), "angle_rad": COUNT * np.round(angle / COUNT)}


@cache
def stiffnesses() -> tuple[Identification, ...]:
    """Both drives' springs from their deflections: Table 3.3 as an identification."""
    device = zwidth.load("five-bar")
    return tuple(device.identify("stiffness", deflections(n), joint=name) for n, name in enumerate(DRIVES))


@cache
def identified_device() -> Device:
    """The five-bar with the largest stiffnesses, which the thesis takes as the safe choice."""
    largest = {
        f"mechanism.drives.{name}.stiffness_Nm_per_rad": found["largest stiffness"].value
        for name, found in zip(DRIVES, stiffnesses(), strict=True)
    }
    return zwidth.load("five-bar", largest)


def effective_parameters() -> Description:
    """Effective masses, stiffness and frequencies of the identified device, as Table 3.4 has them."""
    return identified_device().describe()


@cache
def boundary() -> dict[str, Any]:
    """The boundary of the virtual experiment on a device with 5 % damping, read with scatter: made up."""
    measured = zwidth.load("five-bar").at().measure_boundary(zwidth.study.Plan(stiffnesses=10, tips=0))
    rng = np.random.default_rng(337)
    points = [one for one in measured.points if one.edge != "tip"]
    damping = np.array([one.damping for one in points])
    return {
        "stiffness_N_per_m": [one.stiffness for one in points],
        "damping_Ns_per_m": damping + SCATTER * damping.max() * rng.normal(size=len(damping)),
        "edge": [one.edge for one in points],
    }


@cache
def damping() -> Identification:
    """The damping ratio of all flexible modes, fitted to the boundary through the exact chart."""
    return identified_device().with_({PATH: GUESS}).identify("boundary", boundary(), paths=[PATH])


def chart() -> StabilityChart:
    """The chart of the identified device."""
    made = identified_device().with_(damping().settings).chart()
    assert isinstance(made, StabilityChart)
    return made


def draw(figure: Any) -> None:
    """Deflections of both drives, and the boundary with the fitted chart."""
    from zwidth.show.figures.identify import draw_boundary, draw_identified_stiffness

    upper, lower = figure.subplots(2, 1, height_ratios=(1.0, 1.1))
    both = stiffnesses()
    curves = {name: np.concatenate([one.curves[name] for one in both]) for name in both[0].curves}
    draw_identified_stiffness(upper, replace(both[0], curves=curves))
    draw_boundary(lower, damping())


def main() -> None:
    for name, found in zip(DRIVES, stiffnesses(), strict=True):
        largest, average = found["largest stiffness"], found["average stiffness"]
        print(f"{name}: largest {largest.value:.4f} N m/rad, {largest.low:.4f} to {largest.high:.4f}")
        print(f"{name}: average {average.value:.4f} N m/rad, {average.low:.4f} to {average.high:.4f}")
    masses = effective_parameters()
    at, frequencies = masses.effective, masses.natural_frequencies
    print(f"masses {at.link_side_mass:.4f} and {at.motor_side_mass:.5f} kg, {at.stiffness:.0f} N/m between them")
    print("flexible modes at", ", ".join(f"{f:.2f} Hz" for f in frequencies if f > 1.0))
    found = damping()
    ratio = found[PATH]
    print(
        f"damping ratio {ratio.value:.4f}, {ratio.low:.4f} to {ratio.high:.4f}; {len(boundary()['edge'])} points"
    )
    print(f"largest stiffness {chart().stiffness_max:.1f} N/m")


if __name__ == "__main__":
    main()
