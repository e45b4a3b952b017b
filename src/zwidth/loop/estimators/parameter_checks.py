"""Checks of the parameters of velocity estimators."""

from __future__ import annotations

from math import isfinite, sqrt
from operator import index

# Longest memory in samples. A window of n samples makes the estimate about n/2 samples late and adds n states to
# the loop: at 1 kHz a thousand samples are half a second late, and no wall is felt through that.
LONGEST = 1000


def check_whole(name: str, value: object, least: int, most: int, reason: str) -> None:
    """Raise ValueError unless value is a whole number from least to most; the reason says why not more or less."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise ValueError(f"{name} must be a whole number, got {value!r}")
    if not least <= index(value) <= most:
        raise ValueError(f"{name} must be from {least} to {most}, got {value}: {reason}")


def check_positive(name: str, value: float, unit: str) -> None:
    """Raise ValueError unless value, or each of an array of several designs, is positive and finite."""
    if getattr(value, "ndim", 0):
        for extreme in (value.min(), value.max()):  # type: ignore[attr-defined]
            check_positive(name, float(extreme), unit)
        return
    if not (value > 0.0 and isfinite(value)):
        raise ValueError(f"{name} must be positive and finite, got {value!r} {unit}".rstrip())


def check_period(period: float) -> None:
    """Raise ValueError unless the sampling period [s] is positive and finite."""
    check_positive("the sampling period", period, "s")


def quantisation_noise(resolution: float) -> float:
    """Standard deviation of the error of an encoder that rounds to a step [m]: step / sqrt(12).

    That of an error spread evenly over one step: right for motions over many steps, too much at rest.

    Raises  ValueError  unless the step is positive and finite

    >>> round(quantisation_noise(1e-5) * 1e6, 4)
    2.8868
    """
    check_positive("the encoder's resolution", resolution, "m")
    return resolution / sqrt(12.0)
