"""The part of the records that is fitted, and the part that the fit is validated on, in bands about the poles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zwidth.arrays import Complexes
from zwidth.identify.modes.local_response import (
    Band,
    BandedRecord,
    Lines,
    LocalResponse,
    NoiseCurve,
    bands,
    local_response,
    transformed,
)
from zwidth.identify.modes.modal_fit import MOST_MODES, ModalFit, fit_modes
from zwidth.identify.modes.overview import UNSEEN, Survey, peaks
from zwidth.identify.modes.stretches import Source, Stretch
from zwidth.progress import Progress

UNKNOWN: Final = 1024  # lines that are kept one by one as long as no poles are known
SETTLED: Final = 1e-3  # of the distance of two lines, by which a pole may move between two rounds
ALMOST: Final = 0.9995  # of half the sampling rate, up to which is fitted


@dataclass
class FittedData:
    """The records as lines of transforms, a part of them for the fit, the rest for the validation."""

    sources: Sequence[Source]
    survey: Survey
    top: float
    progress: Progress | None
    noise: NoiseCurve | None = None
    dropped: frozenset[int] = frozenset()

    @property
    def period(self) -> float:
        return self.sources[0].sampling.period

    @property
    def closed(self) -> bool:
        return bool(self.sources[0].channels.reference)

    @property
    def line(self) -> float:
        """Distance of two lines of the longest stretch [Hz]."""
        share = 1.0 - (1.0 / UNSEEN if self._cut else 0.0)
        return 1.0 / (self.survey.longest * share * self.period)

    @property
    def _whole(self) -> bool:
        """Whether whole stretches are for the validation."""
        return self.survey.covered and self.survey.stretches >= 2 * UNSEEN

    @property
    def _cut(self) -> bool:
        """Whether the last part of each stretch is."""
        return self.survey.covered and not self._whole

    @property
    def unseen(self) -> str:
        """What the validation is made on, in words."""
        if self._whole:
            return "the last fourth of the stretches"
        if self._cut:
            return "the last fourth of each stretch"
        return "every fourth line of the transform, as the record excites each frequency only once"

    def parts(self, only: tuple[int, int] | None = None) -> Iterator[tuple[int, str, Lines, Lines | None]]:
        """Record, name, and lines for the fit and for the validation, of each stretch; None: all of it is for the
        other.

        only  record and number of a single stretch; None: all
        """
        n, last = 0, self.survey.stretches - self.survey.stretches // UNSEEN
        for k, source in enumerate(self.sources):
            if k in self.dropped:
                continue
            for i, stretch in enumerate(source.stretches()):
                if only is not None and (k, i) != only:
                    n += 1
                    continue
                label = source.record.label + (f", stretch {i + 1}" if i or self.survey.stretches > 1 else "")
                cut = len(stretch.force) - len(stretch.force) // UNSEEN
                if self._whole:
                    lines = self._lines(stretch)
                    yield (k, label, lines, None) if n < last else (k, label, lines.nothing, lines)
                elif self._cut:
                    yield k, label, self._lines(stretch, 0, cut), self._lines(stretch, cut, None)
                else:
                    lines = self._lines(stretch)
                    yield k, label, lines.without(UNSEEN - 1, UNSEEN), lines.only(UNSEEN - 1, UNSEEN)
                n += 1
                if self.progress is not None:
                    self.progress("transforming records", n, self.survey.stretches)

    def _lines(self, stretch: Stretch, first: int = 0, last: int | None = None) -> Lines:
        part = slice(first, last)
        reference = None if stretch.reference is None else stretch.reference[part]
        return transformed(stretch.force[part], stretch.position[part], reference, self.period)

    def where(self, poles: Complexes, singles: int = 0, unseen: bool = False) -> list[Band]:
        """Bands about these poles; the first `singles` lines, at most half of all, one by one.

        unseen  for the validation, whose lines lie farther apart
        """
        high = min(ALMOST * 0.5 / self.period, self.top)
        apart = 1.0 if self._whole else UNSEEN if unseen else 1.0 if self._cut else UNSEEN / (UNSEEN - 1.0)
        line = self.line * apart
        return bands(self.line, high, line, poles, self.period, min(singles * line, 0.5 * high))

    def sums(
        self, where: Sequence[Band], only: tuple[int, int] | None = None, unseen_where: Sequence[Band] = ()
    ) -> tuple[BandedRecord, BandedRecord]:
        """The sums of what is fitted and of what is not.

        only          record and number of a single stretch; None: all
        unseen_where  bands of the latter
        """
        fitted = BandedRecord(where, self.period, self.closed, self.noise)
        unseen = BandedRecord(unseen_where, self.period, self.closed, self.noise)
        for _, _, lines, rest in self.parts(only):
            fitted.add(lines)
            if rest is not None:
                unseen.add(rest)
            if only is not None:
                break
        return fitted, unseen

    def pilot(self) -> ModalFit | None:
        """The modes of the stretch with the largest force, from which the bands are chosen; None where it is too
        short."""
        poles = peaks(self.survey.spectra)
        loudest = None if self._whole and self.survey.loudest[1] else self.survey.loudest
        fit = None
        for most in (1, 3, MOST_MODES):
            where = self.where(poles, UNKNOWN)
            if len([band for band in where if not band.single]) < 4:
                return None
            try:
                for _ in range(2 if fit is None else 1):
                    data = local_response(self.sums(where, loudest)[0])
                    self.noise = data.noise
            except ValueError:
                return None
            fit = fit_modes(data, self.period, fit, most)
            if len(fit.poles) and self.settled(poles, fit.poles):
                break
            poles = fit.poles
        return fit

    def settled(self, before: Complexes, after: Complexes) -> bool:
        """Whether poles have moved so little that the bands about them are right; and always where reading the
        records again takes long."""
        if self.sources[0].kept is None:
            return True
        moved = np.min(np.abs(after[:, None] - before), axis=1, initial=np.inf)
        return bool(np.all(moved < SETTLED * 2.0 * np.pi * self.line))

    def by_record(self, pilot: ModalFit) -> list[LocalResponse]:
        """The response of each record by itself, where there are several."""
        if len(self.sources) < 2:
            return []
        where = self.where(pilot.poles)
        found = []
        for k in range(len(self.sources)):
            alone = replace(self, dropped=frozenset(range(len(self.sources))) - {k})
            found.append(local_response(alone.sums(where)[0]))
        return found
