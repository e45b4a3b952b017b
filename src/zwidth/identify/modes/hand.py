"""Whether a response tells anything of the hand that holds the device."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.identify.identification import Check
from zwidth.identify.modes.local_response import LocalResponse
from zwidth.identify.modes.model import SampledModel, sampled_response, without_hand
from zwidth.loop.operating_point import OperatingPoint

SEEN: Final = 25.0  # sum of squares, in the noise's variances, by which the hand must change the response


def hand_check(data: LocalResponse, model: SampledModel, point: OperatingPoint) -> Check:
    """Whether the hand changes the response by more than the noise: what a hand as in the file does to it."""
    alone = sampled_response(without_hand(point), data.theta)
    held = model.response(model.vector(model.start), data.theta)
    seen = float(np.sum(data.apply(held - alone) ** 2))
    reason = f"a hand as in the file changes the response by {np.sqrt(seen):.3g} standard deviations of its noise"
    if seen < SEEN:
        reason += ": the device hides the hand; drive it harder, or at frequencies at which the handle moves"
    return Check("hand", seen >= SEEN, reason)
