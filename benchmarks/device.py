"""A device with another number, and one operating point: beside what was written before there were either.

Run `python benchmarks/device.py`. Each call has a number or a position of its own, so that nothing is answered
from before. The other way is that of a script which loads the file again with the setting, or solves the posture
and reduces the mechanism by hand; both give the same numbers, which is compared first.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import zwidth
from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, median_time, print_table, seconds
from zwidth.loop import Loop
from zwidth.model import reduce_mechanism, solve_posture

NAME, TARGET = "five-bar", 2e-3  # s
DEVICE = zwidth.load(NAME)
# key -> value of the n-th call
NUMBERS: dict[str, Callable[[int], float]] = {
    "loop.sampling_period_s": lambda n: 1e-3 + 1e-9 * n,
    "drives.motor-left.stiffness_Nm_per_rad": lambda n: 50.0 + 1e-6 * n,
    "links.upper-left.length_m": lambda n: 0.15 + 1e-9 * n,
}


def handle_position(n: int) -> tuple[float, float]:
    """A handle position of the n-th call [m]."""
    return 0.02 + 1e-9 * n, 0.24


def loop_by_hand(position: tuple[float, float]) -> Loop:
    """The loop at a posture, along y, from the device's parts."""
    mechanism = DEVICE.mechanism
    assert mechanism is not None
    posture = solve_posture(mechanism, position)
    plant = reduce_mechanism(
        mechanism, posture, np.array([0.0, 1.0, 0.0]), "full", DEVICE.damping, DEVICE.encoders
    )
    return Loop(plant, DEVICE.controller)


def row(what: str, ours: Callable[[int], Any], other: Callable[[int], Any]) -> tuple[str, ...]:
    """Both timed, each call with the next number."""
    numbers = count(1)
    here, there = (median_time(lambda call=call: call(next(numbers)), repeats=200) for call in (ours, other))
    verdict = "reached" if here <= TARGET else "missed"
    return what, seconds(here), seconds(there), f"{there / here:.1f}", seconds(TARGET), verdict


def cases() -> Cases:
    """The same, each call with a number or a position of its own."""
    numbers = count(1)

    def change(key: str, value: Callable[[int], float]) -> TimedCase:
        return TimedCase(lambda n: DEVICE.with_({key: value(n)}).controller.delay, numbers.__next__)

    changes = {f"with_ {key}": change(key, value) for key, value in NUMBERS.items()}
    there = TimedCase(lambda n: len(DEVICE.at(handle_position(n), (0.0, 1.0)).loop.plant.mass), numbers.__next__)
    alone = TimedCase(lambda n: len(DEVICE.at(handle_position(n), (0.0, 1.0)).shape), numbers.__next__)
    return changes | {"an operating point": alone, "an operating point and its loop": there}


def main() -> None:
    """Compare, time and print."""
    print(f"{NAME}: {machine('numpy', 'numba', 'pydantic')}")
    rows = []
    for key, value in NUMBERS.items():

        def changed(n: int, key: str = key, value: Callable[[int], float] = value) -> zwidth.Device:
            return DEVICE.with_({key: value(n)})

        def loaded(n: int, key: str = key, value: Callable[[int], float] = value) -> zwidth.Device:
            return zwidth.load(NAME, {key: value(n)})

        charts = [device.chart().stiffness_max for device in (changed(0), loaded(0))]
        assert charts[0] == charts[1]
        rows.append(row(f"with_ {key}", changed, loaded))
    point = DEVICE.at(handle_position(0), (0.0, 1.0))
    assert point.chart().stiffness_max == loop_by_hand(handle_position(0)).chart().stiffness_max
    rows.append(
        row(
            "at(position, direction)",
            lambda n: DEVICE.at(handle_position(n), (0.0, 1.0)),
            lambda n: loop_by_hand(handle_position(n)),
        )
    )
    rows.append(
        row(
            "at(position, direction).loop",
            lambda n: DEVICE.at(handle_position(n), (0.0, 1.0)).loop,
            lambda n: loop_by_hand(handle_position(n)),
        )
    )
    print_table(("what", "ours", "by hand", "ratio", "target", "verdict"), rows)


if __name__ == "__main__":
    sys.exit(run(main, cases))
