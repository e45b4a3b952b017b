"""What a response from raw sweeps must be before its chart is believed: columns, units, runs that agree."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.device.device import Device
from zwidth.identify.identification import Check
from zwidth.identify.modes.checks import FACTORS_LINEAR, NEAR, flip_check, order_check
from zwidth.identify.modes.model import sampled_response
from zwidth.model.response import LEAST_COHERENCE, Response

FEWEST: Final = 8  # coherent frequencies
ALIKE: Final = 0.8  # share of them at which the response must be off by the same factor
PREDICTED: Final = 0.5  # share of the unseen acceleration, below which a reader is warned


def check_responses(
    device: Device, responses: Sequence[Response], labels: Sequence[str], names: tuple[str, str]
) -> list[Check]:
    """Whether force and position are in their columns, in their units, and turned alike in all sweeps.

    responses  of each sweep;   labels  of their records;   names  of the columns of force and position
    """
    first = responses[0]
    good = _coherent(first)
    f, size = first.frequency[good], np.abs(first.value[good])
    if len(f) < FEWEST:
        return []
    slope = float(np.polyfit(np.log(f), np.log(size), 1, w=1.0 / np.sqrt(f))[0])
    checks = [order_check(slope, float(f[-1] / f[0]), names), *_units(device, f, size)]
    if len(responses) > 1:
        checks += _copies(responses, labels)
        checks.append(flip_check([(label, _gain(first, r)) for r, label in zip(responses, labels, strict=True)]))
    return checks


def _copies(responses: Sequence[Response], labels: Sequence[str]) -> list[Check]:
    """Whether a sweep is another one again, to the last digit; [] where none is."""
    seen = dict[bytes, int]()
    for number, response in enumerate(responses):
        before = seen.setdefault(response.value.tobytes(), number)
        if before != number:
            text = (
                f"sweep {number + 1} ({labels[number]}) is sweep {before + 1} again; a copy does not show how far "
                "sweeps differ: measure again, or give it once"
            )
            return [Check("copies", False, text)]
    return []


def _coherent(response: Response) -> Flags:
    assert response.coherence is not None
    return (response.coherence >= LEAST_COHERENCE) & (np.abs(response.value) > 0.0) & (response.frequency > 0.0)


def _gain(first: Response, other: Response) -> float:
    """How many times as far as by the first response a sweep moves, all coherent frequencies alike."""
    grid, known = other.frequency, _coherent(first)
    P = np.interp(grid, first.frequency[known], first.value[known])
    good = _coherent(other) & (np.abs(P) > 0.0)
    return float(np.median(np.real(other.value[good] / P[good]))) if good.any() else 1.0


def _units(device: Device, f: Floats, size: Floats) -> list[Check]:
    """Whether the response (n,) is off by the factor of a unit from that of the file's model."""
    if device.response is not None or device.missing:
        return []
    loop = device.at().loop
    theta = np.minimum(2.0 * np.pi * f * loop.period, np.pi)
    times = size / np.abs(sampled_response(loop, theta))
    for factor, unit in FACTORS_LINEAR.items():
        if np.mean(np.maximum(times / factor, factor / times) < NEAR**2) > ALIKE:
            what = f"is the position in {unit}" if unit.endswith("s") else f"is {unit}"
            reason = f"the response is {np.median(times):.4g} times that of the device file: {what}?"
            return [Check("units", False, f"{reason} Columns are in N and m.")]
    return []


def check_prediction(share: float) -> list[Check]:
    """Whether the response holds for the part of the record that it is not made of; [] where it does.

    share  of the acceleration there that it predicts; nan: there is none
    """
    if np.isnan(share):
        text = (
            "the first two thirds of the record have other frequencies than the last, as in a single sweep: all "
            "of it is fitted, and nothing is left to be predicted; record the sweep twice, in one file or in two"
        )
        return [Check("validation", False, text, warning=True)]
    if share > PREDICTED:
        return []
    if share > 0.0:
        text = (
            f"only {100.0 * share:.3g} % of the unseen acceleration is predicted: noise, friction, or a device "
            "that changes; record longer, with more force"
        )
        return [Check("validation", False, text, warning=True)]
    text = (
        "nothing of the unseen acceleration is predicted: the last third of the record is not of the device that "
        "the first two are of; has a sign flipped, a column stood still, or something been moved in between?"
    )
    return [Check("validation", False, text)]
