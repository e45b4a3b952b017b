"""Which measured frequencies are used, and which stretches of frequency cannot be relied on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.measured.response_interpolation import ResponseInterpolation, around_one
from zwidth.model.response import LEAST_COHERENCE, UNSURE, Response

LARGEST_PHASE: Final = np.radians(30.0)  # at the lowest frequency, beyond that of the integrators
COARSEST: Final = 0.02  # relative error of P that interpolation may be expected to leave
WIDEST_GAP: Final = 4.0  # times the spacing around it, and
WIDEST_RATIO: Final = 1.25  # of the frequencies on both sides
SAME_STRETCH: Final = 10  # most frequencies from one uncertain frequency to the next in one stretch
SHORT_OF_END: Final = 2.0  # times the last spacing: near enough to half the sampling rate
CONTINUED: Final = 0.8  # of half the sampling rate: from here on the response is continued to it


@dataclass(frozen=True)
class UnusableRange:
    """Frequencies low to high [Hz] whose part of the boundary cannot be relied on, and why.

    on_edge  whether the edge of the stable set runs through it; None where it is not known
    """

    low: float
    high: float
    reason: str
    on_edge: bool | None = None

    def document(self) -> dict[str, Any]:
        """The stretch as numbers and words."""
        return {"low_Hz": self.low, "high_Hz": self.high, "reason": self.reason, "on_edge": self.on_edge}


def reaches_half_rate(theta: Floats) -> tuple[bool, bool]:
    """Whether the response goes on to theta = pi, and whether that is measured and not continued."""
    spacing = np.max(np.diff(theta[-4:]))
    measured = bool(np.pi - theta[-1] <= SHORT_OF_END * spacing)
    return measured or bool(theta[-1] >= CONTINUED * np.pi), measured


def unusable_ranges(
    response: Response, good: Flags, period: float, interpolation: ResponseInterpolation
) -> Iterator[UnusableRange]:
    """The unusable stretches from low to high frequency."""
    f = response.frequency[good]
    theta = 2.0 * np.pi * f * period
    half = 0.5 / period
    m = interpolation.integrators
    phase = float(np.angle(response.value[good][0] * around_one(theta[0]) ** m))
    errors = interpolation.relative_error(0.5 * (np.append(0.0, theta[:-1]) + theta))
    if abs(phase) > LARGEST_PHASE or errors[0] > COARSEST:
        yield UnusableRange(
            0.0,
            float(f[0]),
            f"below the data, whose phase is {np.degrees(phase):.0f} degrees from that of {m} integrators at "
            f"{f[0]:.6g} Hz; the response is continued to 0: measure lower",
        )
    yield from sorted([*_incoherent(response, good), *_gaps(f, errors[1:])], key=lambda s: s.low)
    goes_on, measured = reaches_half_rate(theta)
    if not measured:
        consequence = (
            "the response is continued to half the sampling rate"
            if goes_on
            else "walls that fail at a higher frequency are not seen"
        )
        yield UnusableRange(float(f[-1]), half, f"beyond the data, which end at {f[-1]:.6g} Hz; {consequence}")


def _incoherent(response: Response, good: Flags) -> Iterator[UnusableRange]:
    """Runs of dropped frequencies between the used ones on both sides."""
    for run in _runs(~good, SAME_STRETCH):
        low = response.frequency[run[0] - 1] if run[0] > 0 else 0.0
        high = response.frequency[min(run[-1] + 1, len(good) - 1)]
        if response.coherence is None:
            yield UnusableRange(float(low), float(high), "no response is given")
        else:
            least = float(np.min(response.coherence[run]))
            known = f"coherence down to {least:.2g}"
            reason = (
                f"{known}, less than {LEAST_COHERENCE:g}"
                if least < LEAST_COHERENCE
                else f"{known} of {response.averages:.3g} averages leaves an error of more than {100 * UNSURE:g} %"
            )
            yield UnusableRange(float(low), float(high), reason)


def _gaps(f: Floats, errors: Floats) -> Iterator[UnusableRange]:
    """Neighbours between which nothing was measured or P cannot be interpolated; adjoining ones as one."""
    spacing = np.diff(f)
    around = np.array([np.median(spacing[max(0, i - 5) : i + 6]) for i in range(len(spacing))])
    empty = (spacing > WIDEST_GAP * around) & (f[1:] > WIDEST_RATIO * f[:-1])
    coarse = (errors > COARSEST) & ~empty
    for run in _runs(coarse, SAME_STRETCH):
        yield UnusableRange(
            float(f[run[0]]),
            float(f[run[-1] + 1]),
            "the response changes so fast from one frequency to the next that what lies between is uncertain by "
            f"up to {100.0 * float(np.max(errors[run])):.2g} %; measure closer",
        )
    for run in _runs(empty):
        yield UnusableRange(
            float(f[run[0]]), float(f[run[-1] + 1]), "nothing measured; the response is interpolated"
        )


def _runs(flags: Flags, reach: int = 1) -> list[Ints]:
    """Indices of the true, those together that are no farther apart than `reach`."""
    at = np.flatnonzero(flags)
    return np.split(at, np.flatnonzero(np.diff(at) > reach) + 1) if len(at) else []
