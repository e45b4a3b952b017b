"""Whether the response hangs on the amplitude, as that of a device with friction does.

Coulomb friction f_c on a motion of amplitude X at w takes the energy of a damper 4 f_c/(pi w X), and at motions so
small that it sticks it is a spring. Both fall as the amplitude rises, which tells them from a damper and a spring.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from zwidth.arrays import Flags
from zwidth.identify.identification import Check
from zwidth.identify.modes.local_response import LocalResponse
from zwidth.identify.modes.stretches import Levels, Source

UNLIKE: Final = 1.4  # ratio of the forces of two records that tell of the amplitude
SURE: Final = 4.0  # standard deviations of the sum of squares by which responses differ
SINE: Final = 0.05  # by which a sweep's crest factor may differ from the square root of 2


def amplitude_check(
    by_record: Sequence[LocalResponse], sources: Sequence[Source], levels: Sequence[Levels]
) -> tuple[Check, frozenset[int]]:
    """Compare the responses of records of unlike amplitude; a warning where there are none, or they differ.

    Returns  also the records that are not to be fitted: those of less force, where the response hangs on it
    """
    size = np.array([one.deviation[0] for one in levels])
    if len(by_record) < 2 or size.max() < UNLIKE * size.min():
        reason = (
            "one amplitude only: Coulomb friction f_c looks like damping 4 f_c/(pi w X) at amplitude X, and at "
            "small motion like a spring; record a second time with twice the force, and give both files"
        )
        return Check("amplitude", False, reason, warning=True), frozenset()
    small, large = int(np.argmin(size)), int(np.argmax(size))
    a, b = by_record[small], by_record[large]
    known = np.isfinite(a.deviation) & np.isfinite(b.deviation)
    variance = a.deviation[known] ** 2 + b.deviation[known] ** 2
    off = float(np.sum(np.abs(a.value[known] - b.value[known]) ** 2 / variance))
    count = 2 * int(np.count_nonzero(known))
    relative = float(np.median(np.abs(a.value[known] / b.value[known] - 1.0))) if count else 0.0
    forces = f"{size[small]:.3g} and {size[large]:.3g} {sources[0].channels.force.partition('_')[2]}"
    if count == 0 or off < count + SURE * np.sqrt(2.0 * count):
        return Check(
            "amplitude", True, f"the response is the same at {forces} (standard deviations of the force)"
        ), frozenset()
    reason = f"the response differs by {100.0 * relative:.2g} % in the middle between {forces}: "
    crest = np.array([np.max(np.abs([one.low[0], one.high[0]])) for one in levels]) / np.maximum(size, 1e-300)
    friction = ""
    if np.all(np.abs(crest[[small, large]] / np.sqrt(2.0) - 1.0) < SINE):
        f_c = _friction(a, b, known, np.sqrt(2.0) * size[small], np.sqrt(2.0) * size[large])
        friction = f" of about {f_c:.2g} {sources[0].channels.force.partition('_')[2]}" if f_c > 0.0 else ""
    reason += (
        f"friction{friction}, or backlash; only the records of the largest force are fitted, in which it weighs "
        "least; identify friction by itself"
    )
    smaller = frozenset(k for k in range(len(size)) if size[k] * UNLIKE < size[large])
    return Check("amplitude", False, reason, warning=True), smaller


def _friction(a: LocalResponse, b: LocalResponse, known: Flags, force_a: float, force_b: float) -> float:
    """Coulomb friction [N] by which two sine sweeps of unlike force differ, by least squares.

    |1/P_a| - |1/P_b| along the direction of i z^d:   Im (1/P_a - 1/P_b) = 4 f_c/pi (1/X_a - 1/X_b),  X = |P| F
    """
    Pa, Pb = a.value[known], b.value[known]
    wanted = 4.0 / np.pi * (1.0 / (np.abs(Pa) * force_a) - 1.0 / (np.abs(Pb) * force_b))
    found = np.imag(1.0 / Pa - 1.0 / Pb)
    weight = 1.0 / (a.deviation[known] / np.abs(Pa) ** 2) ** 2
    return float(np.sum(weight * wanted * found) / max(float(np.sum(weight * wanted**2)), 1e-300))
