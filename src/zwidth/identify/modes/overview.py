"""What one reading of the records shows: averaged spectra, levels, and where they are excited."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.identify.modes.periodic_force import period_of
from zwidth.identify.modes.spectra import Spectra, averaged_spectra, merged, segment_length
from zwidth.identify.modes.stretches import BLOCK, Levels, Source
from zwidth.progress import Progress

UNSEEN: Final = 4  # a fourth of the data is for the validation
COVERED: Final = 0.3  # share of a band's power that the fitted part must have
LONGEST_SEGMENT: Final = 1 << 16  # samples, where nothing is said


@dataclass(frozen=True)
class Survey:
    """What one reading of all records shows.

    spectra   averaged over all of them;   levels  of each
    loudest   record and number of the stretch with the largest force;   longest  stretch of all [samples]
    covered   whether the first three fourths of each stretch, or of the stretches, are excited wherever the rest
              is
    agreement  what each stretch is, and how many times as far it moves as the first one's response says
    period    of the force [samples]; 0 where it is not periodic
    """

    spectra: Spectra
    levels: list[Levels]
    loudest: tuple[int, int]
    longest: int
    stretches: int
    covered: bool
    agreement: list[tuple[str, float]]
    period: int


def survey_of(sources: Sequence[Source], segment: int | None, progress: Progress | None) -> Survey:
    """Read all records once.

    segment  samples in a segment of the averaged spectra; None: 15 in the longest stretch, or the force's period
    """
    longest = max((min(one.sampling.longest, BLOCK) for one in sources), default=0)
    first = next((one.first() for one in sources if one.first() is not None), None)
    period = 0 if first is None else period_of(first.force)
    length = segment_length(longest, segment or (period if 64 <= period <= longest // 4 else None))
    length = min(length, LONGEST_SEGMENT) if segment is None else length
    differences = {"force": 0, "position": 2} | ({"reference": 0} if sources[0].channels.reference else {})
    levels, loudest, done = [Levels() for _ in sources], (-1.0, 0, 0), 0
    powers, agreement = list[Floats](), list[tuple[str, float]]()
    first_spectra = total = averaged_spectra([], sources[0].sampling.period, length, differences)
    for k, source in enumerate(sources):
        for i, stretch in enumerate(source.stretches()):
            levels[k].add(stretch)
            size = float(np.std(stretch.force)) * np.sqrt(len(stretch.force))
            loudest = max(loudest, (size, k, i))
            powers.append(_band_powers(stretch.force, longest))
            columns = {name: value for name, value in stretch._asdict().items() if value is not None}
            own = averaged_spectra([columns], source.sampling.period, length, differences)
            if own.segments:
                first_spectra = first_spectra if first_spectra.segments else own
                total = merged([total, own])
                agreement.append((f"stretch {i + 1} of {source.record.label}", _times_as_far(first_spectra, own)))
            done += len(stretch.force)
            if progress is not None:
                progress("reading records", done, sum(one.sampling.rows for one in sources))
    covered = _covers(powers)
    return Survey(total, levels, loudest[1:], longest, len(powers), covered, agreement, period)


def _times_as_far(first: Spectra, other: Spectra) -> float:
    """How many times as far a stretch moves as another one's response says, where both have force."""
    into = "reference" if "reference" in first.channels else "force"
    response = first.response(into, "position") * (first.z - 1.0) ** 2
    known = first.coherence(into, "position") > 0.3
    weight = known * other.power(into)
    moved = np.sum(np.real(np.conj(response) * other.of("position", into)) * known)
    return float(moved / max(float(np.sum(np.abs(response) ** 2 * weight)), 1e-300)) if known.any() else 1.0


def _band_powers(force: Floats, longest: int) -> Floats:
    """Power of the force in bands of equal width in logarithms (2, 12): of the first three fourths, and the last.

    longest  stretch of all [samples]: the lowest band has sixteen lines of its last fourth
    """
    cut = len(force) - len(force) // UNSEEN
    edges = np.geomspace(min(16.0 * UNSEEN / longest, 0.1), 0.5, 13)
    rows = []
    for part in (force[:cut], force[cut:]):
        power = np.abs(np.fft.rfft(part - part.mean())) ** 2 / len(part)
        f = np.fft.rfftfreq(len(part))
        rows.append(np.histogram(f, edges, weights=power)[0])
    return np.array(rows)


def _covers(powers: Sequence[Floats]) -> bool:
    """Whether what is fitted is excited wherever what is for validation is, and wherever all of it is."""
    if not powers:
        return False
    if len(powers) >= 2 * UNSEEN:
        cut = len(powers) - len(powers) // UNSEEN
        fitted = np.sum([p.sum(axis=0) for p in powers[:cut]], axis=0)
        total = np.sum([p.sum(axis=0) for p in powers], axis=0)
    else:
        fitted = np.sum([p[0] for p in powers], axis=0)
        total = np.sum([p.sum(axis=0) for p in powers], axis=0)
    counted = total > 1e-4 * np.max(total)
    return bool(np.all(fitted[counted] >= COVERED * total[counted]))


def peaks(spectra: Spectra) -> Complexes:
    """Poles that the peaks of the averaged response show, each as wide as its peak, or as a segment's line."""
    from scipy.signal import find_peaks

    value = spectra.response("force", "position") * (spectra.z - 1.0) ** 2
    coherence = spectra.coherence("force", "position")
    size = np.log(np.maximum(np.abs(value), 1e-300))
    size = np.where(coherence > 0.3, size, size[coherence > 0.3].min(initial=0.0))
    at, about = find_peaks(size, prominence=0.7, width=1, rel_height=0.5)
    order = np.argsort(about["prominences"])[::-1][:8]
    step = 1.0 / (spectra.length * spectra.period)
    f, width = spectra.frequency[at[order]], np.maximum(about["widths"][order], 1.0) * step
    return np.asarray(-np.pi * np.minimum(width, 0.2 * f) * 0.5 + 2j * np.pi * f)
