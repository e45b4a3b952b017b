"""One group of kernels, compiled in a process of its own by running commands that want them."""

from __future__ import annotations

import cmath
import os
import shlex
import sys
import tempfile
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from typing import Final

from zwidth.compile_events import listening
from zwidth.device.read import new_device
from zwidth.show.cli.first_use import GROUPS
from zwidth.show.cli.group import invoke

# File names, and kinds of `zwidth new`.
DEVICES: Final = {"linkage": "five-bar", "arm": "serial-2r", "masses": "plant"}
MEASURED: Final = """
name = "measured"
loop = { sampling_period_s = 0.001 }
[response]
file = "response.csv"
integrators = 2
"""
# Together with RARE these want every kernel. Those of a group run one after the other, and what their kernels have
# in common is translated only once; the groups have little in common.
COMMANDS: Final = (
    (
        "move linkage.toml --plane 0,0.26,0,-1 --stiffness 2000 --damping 5 --push 0,2 --duration 0.05",
        "map linkage.toml --measure stiffness_max --cells 9,9 --output map.svg",
        "map linkage.toml --measure stiffness_max_with_margins --measure felt_stiffness --measure rate_hardness "
        "--cells 5,5 --stiffness 500 --damping 2 --frequency 5 --stiffness-margin 0.1 --damping-margin 0.1 "
        "--delay-margin 0.5 --output margins.csv",
        "show linkage.toml",
        "chart linkage.toml --with-direction 1,0",
        "chart linkage.toml --model two-mass --operator thesis-arm",
        "export linkage.toml --x -0.01,0.01 --y 0.17,0.19 --cells 1,1 --levels 2 --workers 1 --output walls.h",
        "show arm.toml --at upper=0.7,lower=1.4",
        "load linkage.toml --count 3",
        "chart arm.toml --set load.force_N=[0,-2] --set load.settle=true",
        "simulate masses.toml --stiffness 4000 --damping 10 --duration 0.05",
    ),
    (
        "report masses.toml --output report.html",
        "guarantees masses.toml",
        "robust masses.toml --range loop.delay_samples=0,1 --unseen 3 --members 3",
        "limit-cycles masses.toml --stiffness 2600 --damping 0 --set loop.saturation.force_N=5 --no-simulation",
        "felt masses.toml --stiffness 1000 --damping 5",
        "chart masses.toml --set loop.delay_samples=40",
        "check measured.toml --stiffness 1000 --damping 5",
    ),
)
assert len(COMMANDS) == GROUPS


def write_devices(folder: Path) -> None:
    """Write the device files that the commands name."""
    for name, kind in DEVICES.items():
        (folder / f"{name}.toml").write_text(new_device(name, kind), encoding="utf-8")
    (folder / "measured.toml").write_text(MEASURED, encoding="utf-8")
    (folder / "response.csv").write_text(measured_response(), encoding="utf-8")


def measured_response(period: float = 0.001, mass: float = 0.1, friction: float = 0.5) -> str:
    """A response file: a mass with friction, from force command to encoder sample through a zero-order hold.

    Of P(s) = 1/(s (m s + b)) with the period T [s], mass m [kg] and friction b [N s/m], at 1 to 499 Hz:

        H(z) = (1/b) [T/(z - 1) - (m/b) (1 - p)/(z - p)],  p = exp(-b T/m)
    """
    pole = cmath.exp(-friction * period / mass).real
    lines = ["frequency_Hz,real_m_per_N,imag_m_per_N"]
    for k in range(1, 500):
        z = cmath.exp(2j * cmath.pi * k * period)
        value = (period / (z - 1.0) - mass / friction * (1.0 - pole) / (z - pole)) / friction
        lines.append(f"{k},{value.real!r},{value.imag!r}")
    return "\n".join(lines) + "\n"


def compile_environments() -> None:
    """Compile the function of every virtual environment, which simulations reach by its address."""
    from zwidth.contact.environments import ENVIRONMENTS

    for environment in ENVIRONMENTS.values():
        _ = environment.force


def run_estimators() -> None:
    """Run kernels that only Python calls: velocity estimates of recorded positions, and single modes."""
    from zwidth.loop.estimators import BackwardDifference, Foaw, Levant
    from zwidth.loop.estimators.kernels import velocity_of
    from zwidth.loop.hold import modal_row, mode_growth

    for method in (BackwardDifference(), Foaw(4, 1e-6), Levant(10.0)):
        velocity_of(method, [0.0, 1e-3, 3e-3], 0.001)
    modal_row(1.0, 1e4, 0.001)
    mode_growth(1.0, 1e4, 100.0, 0.001, 0.0)


def identify_friction_of_a_step() -> None:
    """Fit a short record as identification of friction does: a mass that a square wave moves to and fro."""
    import numpy as np

    from zwidth.identify.joint.fit import JointNumbers, Windows, predict

    force, row_count = np.repeat([1.0, -1.0], 20), np.array([40])
    # position, force, first row, number of rows, period, time, run, whether a force was recorded, clock
    windows = Windows(
        force,
        force,
        np.array([0]),
        row_count,
        np.array([0.001]),
        np.zeros(1),
        np.zeros(1, int),
        True,
        np.zeros(40),
    )
    # mass, viscous and dry friction both ways, stiffness, delay, and three numbers of drift; from rest at 0
    predict(
        windows,
        JointNumbers(np.array([0.1, 0.2, 0.2, 0.3, 0.3, 4.0, 0.001, 0.1, 0.0, 0.0]), ()).values,
        np.zeros((1, 2)),
    )


def find_margins_by_chords() -> None:
    """Find the stiffest wall with margins by the stage for edges that compiled stages left in doubt."""
    import numpy as np

    from zwidth.chart.wall_margins import stiffness_with_chords
    from zwidth.loop.controller import Controller
    from zwidth.loop.loop import Loop
    from zwidth.model.plant import Plant

    one, zero = np.ones(1), np.zeros((1, 1))
    stiffness_with_chords([Loop(Plant(0.1 * one[:, None], zero, zero, one, one), Controller(0.001))], 1.1, 1.1)


# What no short command line reaches, by group.
RARE: Final[tuple[tuple[Callable[[], None], ...], ...]] = (
    (compile_environments, run_estimators, identify_friction_of_a_step, find_margins_by_chords),
    (),
)


def run_group(group: int) -> None:
    """Run what one group wants, and print the name of each kernel that was compiled for it."""
    names = sys.stdout  # kept, for what the commands print goes nowhere

    def listen(name: str, ended: bool) -> None:
        if ended:
            print(name, file=names, flush=True)

    with tempfile.TemporaryDirectory() as folder:
        write_devices(Path(folder))
        os.chdir(folder)
        with listening(listen), open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
            for line in COMMANDS[group]:
                invoke(shlex.split(line))
            for work in RARE[group]:
                work()
        os.chdir("/")  # out of the folder, which is removed now


if __name__ == "__main__":
    run_group(int(sys.argv[1]))
