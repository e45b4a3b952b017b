"""Whether both parts of a sweep excite the same frequencies."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.identify.excitation import shared_power
from zwidth.identify.response.sweep_blocks import SweepBlocks

SEGMENTS: Final = 8  # in the shorter part, whose spectra are averaged


def shared_excitation(sweep: SweepBlocks, cut: int) -> float:
    """`shared_power` of the force in both parts of a sweep, by averaged Hann-windowed segments.

    Of noise about 0.8; of one chirp that goes up, nearly 0.

    cut  first sample of the second part
    """
    length = max(min(cut, len(sweep) - cut) // SEGMENTS, 1)
    parts = [_spectrum(part, length) for part in (sweep.part(0, cut), sweep.part(cut, len(sweep)))]
    return shared_power(*parts)


def _spectrum(sweep: SweepBlocks, length: int) -> Floats:
    """Summed spectra (k,) of the force without its mean."""
    window, total = np.hanning(length + 2)[1:-1], np.zeros(length // 2 + 1)
    for force, _ in sweep.blocks(length):
        total += np.abs(np.fft.rfft(window * (force - np.mean(force)))) ** 2
    return total
