"""The base of all charts: the stable walls, their edge, and the numbers read off them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.chart.arcs import Window, window_of
from zwidth.chart.decay import FastestDecay
from zwidth.chart.verdict import WallVerdicts
from zwidth.result import Result, documented, entry


@dataclass(frozen=True, repr=False)
class BoundaryArc:
    """A piece of the stable set's edge: its walls, and the frequency of the vibration at which each fails.

    stiffness, damping, frequency  (k,)  [N/m], [N s/m], [Hz]; 0 or 1/(2T) for a real root
    member                         index of the loop that binds there; 0 where there is one only
    stiffness_low, stiffness_high  (k,)  [N/m] extent of a measured point's band; None where no error is known
    """

    stiffness: Floats
    damping: Floats
    frequency: Floats
    member: int = 0
    stiffness_low: Floats | None = None
    stiffness_high: Floats | None = None

    def __repr__(self) -> str:
        low, high = np.min(self.frequency), np.max(self.frequency)
        return f"{type(self).__name__}({len(self.frequency)} walls, {low:.6g} to {high:.6g} Hz)"


@dataclass(frozen=True, kw_only=True, repr=False)
class Chart(Result, ABC):
    """A set of stable walls, both signs of K and B, never clipped.

    stiffness_max   supremum of K over its walls with K > 0, B >= 0 [N/m]; nan if there is none
    damping_at_stiffness_max     [N s/m]; nan if there is none
    frequencies_at_stiffness_max [Hz] one, or two at a corner, ascending; () if there is none
    damping_max     supremum of B >= 0 stable for all sufficiently small K > 0 [N s/m]; 0 if there is none
    stable_area     of the set within K >= 0, B >= 0 [N² s/m²]
    fastest_decay   the wall of smallest spectral radius over the whole set; None if nothing is stable, or if it
                    was not searched for: only charts of one direction of one modelled loop have it
    fastest_decay_in_first_quadrant   the same over K >= 0, B >= 0
    """

    stiffness_max: float = field(metadata=entry("N/m"))
    damping_at_stiffness_max: float = field(metadata=entry("N s/m"))
    frequencies_at_stiffness_max: tuple[float, ...] = field(metadata=entry("Hz", empty="null"))
    damping_max: float = field(metadata=entry("N s/m"))
    stable_area: float = field(metadata=entry("N^2 s/m^2"))
    fastest_decay: FastestDecay | None = field(default=None, metadata=entry())
    fastest_decay_in_first_quadrant: FastestDecay | None = field(default=None, metadata=entry())

    # Numbers of each wall on the edge: key -> attribute of `BoundaryArc`.
    _edge_columns: ClassVar[dict[str, str]] = {
        "stiffness_N_per_m": "stiffness",
        "damping_Ns_per_m": "damping",
        "frequency_Hz": "frequency",
    }

    @property
    @abstractmethod
    @documented(lists=True, before="stiffness_max")
    def regions(self) -> tuple[Floats, ...]:
        """Closed rings (k, 2) of [stiffness, damping], counter-clockwise; their union is the set."""

    @property
    @abstractmethod
    @documented(before="stiffness_max")
    def boundary(self) -> tuple[BoundaryArc, ...]:
        """Arcs of the stable set's edge, each with its walls and the frequencies at which they fail."""

    def drawn(self) -> Self:
        """Draw the regions now, and return this same chart: a later look at `regions` raises no error then.

        Raises  ChartError  where walls on the edge are not at the limit of stability
        """
        _ = self.regions
        return self

    @property
    @documented("Hz", before="frequencies_at_stiffness_max")
    def frequency_at_stiffness_max(self) -> float | None:
        """The lower of `frequencies_at_stiffness_max` [Hz]; None if there is none."""
        return min(self.frequencies_at_stiffness_max, default=None)

    @property
    @documented()
    def unobserved_modes(self) -> tuple[str, ...]:
        """Motions that no wall moves, by name; they were left out and do not count."""
        return ()

    @property
    def box(self) -> Window:
        """KMIN, KMAX, BMIN, BMAX of the regions with a margin of 5 %; (0, 1, 0, 1) where nothing is stable."""
        return window_of(self.regions)

    @abstractmethod
    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> WallVerdicts:
        """Verdicts on walls K [N/m], B [N s/m] of any shape (...) that broadcast, whatever the regions say."""

    def document(self) -> dict[str, Any]:
        """The chart as numbers and lists, under the keys of `zwidth chart --json`; nan where there is none."""
        return super().document() | {
            "boundary": [
                {key: _plain(getattr(arc, name)) for key, name in self._edge_columns.items()}
                for arc in self.boundary
            ]
        }

    def table(self) -> dict[str, list[Any]]:
        """The edge's walls as columns, its arcs one after another and counted from 0; None where not known."""
        columns: dict[str, list[Any]] = {"arc": []}
        columns |= {key: [] for key in self._edge_columns}
        for number, arc in enumerate(self.boundary):
            count = len(arc.frequency)
            columns["arc"] += [number] * count
            for key, name in self._edge_columns.items():
                values = _plain(getattr(arc, name))
                columns[key] += values if isinstance(values, list) else [values] * count
        return columns

    def __repr__(self) -> str:
        return "\n  ".join([f"{type(self).__name__}: {self._summary()}", *self._numbers()])

    def _summary(self) -> str:
        """What the chart is of, in a few words."""
        return f"{len(self.regions)} stable region{'' if len(self.regions) == 1 else 's'}"

    def _numbers(self) -> list[str]:
        """Largest stiffness, largest damping and area as lines of text; subclasses may add one."""
        stiffest = "none: no stable wall has K > 0 and B >= 0"
        if self.frequencies_at_stiffness_max:
            frequencies = " and ".join(f"{frequency:.6g}" for frequency in self.frequencies_at_stiffness_max)
            damping = self.damping_at_stiffness_max
            stiffest = f"{self.stiffness_max:.6g} N/m at {damping:.6g} N s/m, {frequencies} Hz"
        return [
            f"largest stiffness  {stiffest}",
            f"largest damping    {self.damping_max:.6g} N s/m",
            f"stable area        {self.stable_area:.6g} N² s/m²",
        ]


@dataclass(frozen=True, kw_only=True, repr=False)
class DrawnChart(Chart, ABC):
    """A chart that is drawn when it is made.

    drawn_regions, drawn_boundary  `regions` and `boundary`
    """

    drawn_regions: tuple[Floats, ...]
    drawn_boundary: tuple[BoundaryArc, ...]

    @property
    def regions(self) -> tuple[Floats, ...]:
        return self.drawn_regions

    @property
    def boundary(self) -> tuple[BoundaryArc, ...]:
        return self.drawn_boundary


def _plain(value: Floats | float | None) -> Any:
    """An array as nested lists, for documents and tables; anything else as it is."""
    return value.tolist() if isinstance(value, np.ndarray) else value
