"""`Region`: a set of walls as polygons, with its largest stiffness."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry.polygon import orient

from zwidth.arrays import Flags, Floats
from zwidth.chart.arcs import Arcs
from zwidth.chart.area import find_peak
from zwidth.result import Result, entry


@dataclass(frozen=True, repr=False)
class Region(Result):
    """The set of walls that have one guarantee.

    rings          closed rings (k, 2) of [K, B], counter-clockwise; their union is the set, () if it is empty
    stiffness_max  supremum of K over its walls with K > 0, B >= 0 [N/m]; nan if there is none
    damping_at_stiffness_max  [N s/m]; nan if there is none
    reason         why there is no wall with K > 0, B >= 0; None if there is one
    warning        limitation of the result; None if there is none
    """

    rings: tuple[Floats, ...] = field(metadata=entry(name="regions"))
    stiffness_max: float = field(metadata=entry("N/m"))
    damping_at_stiffness_max: float = field(metadata=entry("N s/m"))
    reason: str | None = field(default=None, metadata=entry(empty="left out"))
    warning: str | None = field(default=None, metadata=entry(empty="left out"))

    @property
    def polygon(self) -> Any:
        """The set as a shapely geometry."""
        return shapely.union_all([shapely.Polygon(ring) for ring in self.rings])

    def with_warning(self, warning: str) -> Region:
        """The same set with one more limitation; itself where that is "", or where the set is empty."""
        if not warning or not self.rings:
            return self
        return replace(self, warning=warning if self.warning is None else f"{self.warning}; {warning}")

    def contains(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Flags:
        """Whether walls K, B of any shape (...) lie inside, to the accuracy of the rings."""
        K, B = np.broadcast_arrays(np.asarray(wall_stiffness, float), np.asarray(wall_damping, float))
        inside = np.zeros(K.shape, dtype=bool)
        for ring in self.rings:
            inside |= shapely.contains_xy(shapely.Polygon(ring), K, B)
        return inside

    def table(self) -> dict[str, list[Any]]:
        """The corners of its rings as columns, ring after ring and counted from 0."""
        columns = outline_columns({"": self}, "name")
        del columns["name"]
        return columns

    def __repr__(self) -> str:
        return f"Region({len(self.rings)} rings, largest stiffness {stiffness_text(self)})"


def stiffness_text(region: Region) -> str:
    """A region's largest stiffness as text.

    >>> stiffness_text(Region((), 2000.0, 0.5)), stiffness_text(empty_region("nothing dissipates"))
    ('2000 N/m', 'none')
    """
    return "none" if region.reason is not None else f"{region.stiffness_max:.6g} N/m"


def outline_columns(regions: Mapping[str, Region], name_column: str) -> dict[str, list[Any]]:
    """The rings of several regions as columns, one corner a row, region after region.

    name_column  heading of the column with their names; the column `region` counts the rings of each from 0
    """
    rows = [
        (name, n, float(K), float(B))
        for name, region in regions.items()
        for n, ring in enumerate(region.rings)
        for K, B in ring
    ]
    columns = (name_column, "region", "stiffness_N_per_m", "damping_Ns_per_m")
    return {column: [row[i] for row in rows] for i, column in enumerate(columns)}


def empty_region(reason: str) -> Region:
    """A region without walls; `reason` says why."""
    return Region((), float("nan"), float("nan"), reason)


def polygon_rings(shape: Any) -> tuple[Floats, ...]:
    """Closed counter-clockwise rings (k, 2) of a polygon without holes, or of several, the largest first."""
    parts: Iterable[Any] = getattr(shape, "geoms", [shape])
    solid = [part for part in parts if part.geom_type == "Polygon" and part.area > 0.0]
    return tuple(np.asarray(orient(part).exterior.coords) for part in sorted(solid, key=lambda p: -p.area))


def stiffest_corner(rings: Iterable[Floats]) -> tuple[float, float]:
    """Largest K over rings (k, 2) of [K, B] within K > 0, B >= 0, and its B; nan where there is none."""
    peak = find_peak(Arcs.chords(list(rings)), (), 0.0)
    return (peak.stiffness, peak.damping) if peak else (float("nan"), float("nan"))
