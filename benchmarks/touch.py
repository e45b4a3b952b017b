"""One sampling period of contact: the kernel as Python calls it, and its WebAssembly in Node.

Run `python benchmarks/touch.py`.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, print_table
from benchmarks._touch_node import run_in_node
from zwidth.contact import OUTPUTS, TouchNumbers, touch_periods
from zwidth.contact.touch_step import TWO_SIDED, touch_numbers
from zwidth.device.load import load

STIFFNESS, DAMPING, START, PUSH = 2000.0, 5.0, -1e-3, 1.0
PERIODS, SUBSTEPS, REPEATS = 5000, 20, 7


def device_and_ports(name: str) -> tuple[TouchNumbers, np.ndarray]:
    """A device of the zoo before a wall, pushed against it."""
    device = touch_numbers(load(name).at().loop, start_position=START, substeps=SUBSTEPS)
    ports = device.empty_ports
    ports[:6] = TWO_SIDED, STIFFNESS, DAMPING, 0.0, PUSH, PUSH
    return device, ports


def run_natively(device: TouchNumbers, ports: np.ndarray) -> np.ndarray:
    """Outputs of all periods, in one call."""
    outputs = np.zeros(PERIODS * OUTPUTS)
    touch_periods(
        device.counts,
        device.numbers,
        device.memory.copy(),
        ports,
        np.zeros(PERIODS * len(device.noise)),
        outputs,
        PERIODS,
    )
    return outputs.reshape(PERIODS, OUTPUTS)


def cases() -> Cases:
    """A call of many periods, and several such in Node."""
    device, ports = device_and_ports("five-bar")
    name = f"{PERIODS} periods of {SUBSTEPS} substeps"

    def in_node() -> float:
        noise = np.zeros(PERIODS * len(device.noise))
        outputs, _, _ = run_in_node(device, ports, noise, PERIODS, repeats=REPEATS)
        return float(outputs[-1, 0])

    return {
        name: TimedCase(lambda: float(run_natively(device, ports)[-1, 0])),
        f"{name}, {REPEATS} times in Node": TimedCase(in_node, tool="node"),
    }


def main() -> None:
    print(machine("numpy", "numba"))
    device, ports = device_and_ports("five-bar")
    native = run_natively(device, ports)
    times = []
    for _ in range(REPEATS):
        begun = perf_counter()
        run_natively(device, ports)
        times.append(perf_counter() - begun)
    rows = [("native", f"{1e9 * min(times) / PERIODS:.0f}", f"{PERIODS * device.period / min(times):.0f}", "")]
    if shutil.which("node"):
        noise = np.zeros(PERIODS * len(device.noise))
        outputs, _, told = run_in_node(device, ports, noise, PERIODS, repeats=REPEATS)
        same = "yes" if np.array_equal(outputs.view(np.int64), native.view(np.int64)) else "no"
        took = told["nanoseconds"]
        rows.append(("WebAssembly in Node", f"{took:.0f}", f"{1e9 * device.period / took:.0f}", same))
    print_table(("kernel", "ns per period", "times real time", "the same bits"), rows)


if __name__ == "__main__":
    sys.exit(run(main, cases))
