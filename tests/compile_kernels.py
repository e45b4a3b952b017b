"""Compile the kernels that most tests want, before the tests: each once, on all cores.

The workers of a test run share what is compiled only once it is on disk; started on nothing, each compiles nearly
everything by itself. Whatever is not compiled here is compiled by the test that wants it, as ever.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

# A whole workspace at once: the flood of postures, their batch, the batch of exact largest stiffness.
WORKSPACE = """
import numpy as np
from zwidth.device.load import load
from zwidth.measures.catalogue import find_measure
from zwidth.measures.evaluate import evaluate

x, y = np.meshgrid(np.linspace(-0.04, 0.04, 9), np.linspace(0.2, 0.28, 9))
evaluate(find_measure("stiffness_max"), load("five-bar").at(np.stack([x, y], axis=-1), (0.0, 1.0, 0.0)))
"""
ZWIDTH = str(Path(sys.executable).with_name("zwidth"))
MOVE = "move five-bar --plane 0,0.28,0,-1 --stiffness 2000 --damping 5 --push 0,2 --duration 0.3"
SIMULATE = "simulate published-two-mass --stiffness 4000 --damping 10"
CYCLES = "limit-cycles hapkit-course --stiffness 2600 --damping 0 --set loop.saturation.force_N=5 --no-simulation"
# What takes longest comes first.
COMMANDS = (
    (ZWIDTH, *shlex.split(MOVE)),
    (sys.executable, "-c", WORKSPACE),
    (ZWIDTH, *shlex.split(SIMULATE)),
    (ZWIDTH, *shlex.split(CYCLES)),
    (ZWIDTH, "sensitivity", "hapkit-course"),
    (ZWIDTH, "guarantees", "hapkit-course"),
)


def run(command: tuple[str, ...]) -> str:
    """What the command complained of; the tests say more of what is broken."""
    done = subprocess.run(command, capture_output=True, text=True)
    return done.stderr if done.returncode else ""


def main() -> None:
    print("compiling kernels ...", flush=True)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        sys.stderr.writelines(pool.map(run, COMMANDS))


if __name__ == "__main__":
    main()
