"""Whether both parts of a sweep excite the same frequencies, so that one can be predicted from the other."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.identify.response.sweep_blocks import SweepBlocks

Floats = NDArray[np.float64]

LEAST_SHARED: Final = 0.2  # of the power, from which on one part tells of the other
SEGMENTS: Final = 8  # in the shorter part, whose spectra are averaged


def shared_excitation(sweep: SweepBlocks, cut: int) -> float:
    """Share of the force's power at frequencies that both parts of a sweep excite: the sum of the smaller of both
    spectra, each of sum 1, over averaged Hann-windowed segments.

    Of noise about 0.8; of one chirp that goes up, nearly 0.

    cut  first sample of the second part
    """
    length = max(min(cut, len(sweep) - cut) // SEGMENTS, 1)
    parts = [_spectrum(part, length) for part in (sweep.part(0, cut), sweep.part(cut, len(sweep)))]
    return float(np.sum(np.minimum(*parts)))


def _spectrum(sweep: SweepBlocks, length: int) -> Floats:
    """Averaged spectrum (k,) of the force without its mean, of sum 1; zeros of a constant force."""
    window, total = np.hanning(length + 2)[1:-1], np.zeros(length // 2 + 1)
    for force, _ in sweep.blocks(length):
        total += np.abs(np.fft.rfft(window * (force - np.mean(force)))) ** 2
    whole = float(np.sum(total))
    return total / whole if whole > 0.0 else total
