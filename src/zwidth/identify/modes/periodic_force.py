"""Force that repeats: its period, and what the lines that it does not excite say of friction and backlash."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.identify.modes.stretches import Source

SAME: Final = 1e-4  # power of the difference to a period before, over that of the force, that is none
FEWEST_PERIODS: Final = 3
SEARCHED: Final = 1 << 18  # samples in which a period is looked for
LINE: Final = 1e-4  # power of a line, over the largest, that is excited
CLEAR: Final = 3.0  # times its noise, that a line's mean is there


def period_of(force: Floats) -> int:
    """The period of a force [samples]; 0 where it does not repeat.

    The first lag at which the autocorrelation is that of an equal signal, and the difference to one period before
    is almost nothing.
    """
    u = force[:SEARCHED] - np.mean(force[:SEARCHED])
    n = len(u)
    power = float(np.mean(u**2))
    if power == 0.0:
        return 0
    spectrum = np.abs(np.fft.rfft(u, 2 * n)) ** 2
    correlation = np.fft.irfft(spectrum)[: n // 2] / (n - np.arange(n // 2)) / power
    rises = (
        np.flatnonzero(
            (correlation[1:-1] > 0.95)
            & (correlation[1:-1] >= correlation[:-2])
            & (correlation[1:-1] >= correlation[2:])
        )
        + 1
    )
    for lag in rises[:50]:
        if lag >= 16 and np.mean((u[lag:] - u[:-lag]) ** 2) < SAME * power:
            return int(lag) if n >= FEWEST_PERIODS * lag else 0
    return 0


def periodic_lines(period: int, source: Source, details: dict[str, Any]) -> list[str]:
    """What the periods say beside the response: remarks, and numbers in `details`.

    Coherence compares periods with each other, so that what repeats in each of them, a nonlinearity's answer,
    looks like the device. A multisine of odd harmonics shows it: at even lines the position has what an even
    nonlinearity makes, at odd lines that were left out what an odd one makes, friction or saturation.
    """
    first = source.first()
    if not period or first is None:
        return []
    count = len(first.force) // period
    if count < FEWEST_PERIODS:
        return []
    kept = count - 1  # the first period is that of the transient
    U, Y = (
        _lines(values, period, kept) for values in (first.force, np.diff(first.position - first.position[0], n=2))
    )
    power = np.abs(U.mean(axis=0)) ** 2
    excited = power > LINE * np.max(power[1:])
    excited[0] = False
    h = np.flatnonzero(excited)
    details["period_samples"] = period
    if len(h) < 4:
        return [f"the force repeats every {period} samples, with {len(h)} lines"]
    mean, scatter = Y.mean(axis=0), Y.std(axis=0, ddof=1) / np.sqrt(len(Y))
    inside = np.arange(len(power)) <= h[-1]
    inside &= np.arange(len(power)) >= h[0]
    odd = np.arange(len(power)) % 2 == 1
    if len(h) == np.count_nonzero(inside):
        text = (
            f"the force repeats every {period} samples and excites each line: what a nonlinearity makes is not "
            "told from the device; leave out even lines, and one odd line in four, to see it"
        )
        return [text]
    remarks = [f"the force repeats every {period} samples and excites {len(h)} lines"]
    names = {
        "even": "a stiffness or friction that differs with the sign",
        "odd": "friction, backlash or saturation",
    }
    for name, parity in (("even", ~odd), ("odd", odd)):
        left = inside & ~excited & parity
        if not left.any():
            continue
        level, own = (
            float(np.sqrt(np.mean(np.abs(mean[left]) ** 2))),
            float(np.sqrt(np.mean(np.abs(scatter[left]) ** 2))),
        )
        whole = float(np.sqrt(np.mean(np.abs(mean[excited]) ** 2)))
        details[f"{name}_distortion"] = float(np.sqrt(max(level**2 - own**2, 0.0))) / whole
        if level > CLEAR * own:
            remarks.append(
                f"{name} lines that were not excited move {100.0 * details[f'{name}_distortion']:.2g} % as "
                f"much as the excited ones, {level / own:.2g} times their noise: {names[name]}, which the "
                "coherence does not show"
            )
        else:
            remarks.append(f"{name} lines that were not excited hold noise alone")
    return remarks


def _lines(values: Floats, period: int, count: int) -> Complexes:
    """Transforms (k, n) of the last k whole periods of a signal."""
    last = values[len(values) - count * period :] if len(values) >= count * period else values
    whole = len(last) // period
    return np.asarray(np.fft.rfft(last[len(last) - whole * period :].reshape(whole, period), axis=1))
