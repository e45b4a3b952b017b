"""Timing, and the table it is printed in."""

from __future__ import annotations

import os
import platform
import statistics
from collections.abc import Callable
from importlib.metadata import version
from time import perf_counter


def median_time(call: Callable[[], object], repeats: int = 50, warm: int = 3) -> float:
    """Median seconds of a call in steady state."""
    for _ in range(warm):
        call()
    times = []
    for _ in range(repeats):
        start = perf_counter()
        call()
        times.append(perf_counter() - start)
    return statistics.median(times)


def seconds(value: float) -> str:
    """A time in the unit that suits it."""
    for unit, scale in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if value * scale >= 1.0 or unit == "µs":
            return f"{value * scale:.3g} {unit}"
    raise AssertionError


def verdict(value: float, limit: float) -> str:
    """Whether a target is reached."""
    return "reached" if value <= limit else "missed"


def machine(*packages: str) -> str:
    """Number of CPUs, their load, and versions of Python and these packages, in one line."""
    busy = f" (load {os.getloadavg()[0]:.1f})" if hasattr(os, "getloadavg") else ""
    versions = ", ".join(f"{name} {version(name)}" for name in packages)
    return f"{os.cpu_count()} CPUs{busy}, Python {platform.python_version()}, {versions}"


def print_table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """Columns of equal width."""
    widths = [max(len(row[i]) for row in [header, *rows]) for i in range(len(header))]
    for row in [header, tuple("-" * width for width in widths), *rows]:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
