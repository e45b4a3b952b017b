"""The common area of a map: where several requirements are met at once (thesis Fig. 5.4).

Between the cells of a map each margin is interpolated linearly, and its zero line cuts the workspace: an error of
the second order in the step. Where the links' lengths alone bound what is reached (`reach_outline`), regions
end at that exact edge. Elsewhere, and beside cells without a value, the squares of the grid that touch such a cell
are left out of the region, an error of the first order in the step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.result import Result
from zwidth.study.designs.column import Requirement
from zwidth.study.workspace.map import continued, measures_of, reach_outline, reachable

if TYPE_CHECKING:
    import xarray as xr


ROUNDING: Final = (
    1e-9  # share of the largest margin; a smaller margin counts as 0, so that a bound met exactly is met
)


@dataclass(frozen=True, repr=False)
class PlaneArea:
    """A part of a plane.

    shape  a shapely polygon or several, in the plane's coordinates [m]
    area   its area [m²]
    share  of the area that can be reached; nan where nothing can
    """

    shape: Any
    area: float
    share: float

    def __repr__(self) -> str:
        return f"PlaneArea: {self.area:.4g} m², {100.0 * self.share:.4g} % of the reachable area"


@dataclass(frozen=True, repr=False)
class CommonArea(Result):
    """The regions in which requirements of one map are met, and their intersection.

    units    of the requirements' values, in their order
    axes     names of the plane's axes
    reach    the reachable part of the plane
    regions  where each requirement is met, in their order
    common   where all requirements are met
    circumstances  device, plane and computer of the map, by the keys of its document
    """

    requirements: tuple[Requirement, ...]
    units: tuple[str, ...]
    axes: tuple[str, str]
    reach: PlaneArea
    regions: tuple[PlaneArea, ...]
    common: PlaneArea
    circumstances: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        required = ", ".join(one.text for one in self.requirements)
        common = self.common
        if not self.reach.area > 0.0:
            return f"CommonArea: the map reaches nothing, with {required}"
        share = f"{100.0 * common.share:.4g} % of the reachable area"
        return f"CommonArea: {common.area:.4g} m², {share}, with {required}"

    def document(self) -> dict[str, Any]:
        """The areas by key and unit."""
        return {
            "requirements": [
                {"requirement": one.text, "area_m2": region.area, "share": region.share}
                for one, region in zip(self.requirements, self.regions, strict=True)
            ],
            "common_area_m2": self.common.area,
            "common_share": self.common.share,
            "reachable_area_m2": self.reach.area,
        }

    def table(self) -> dict[str, list[Any]]:
        """A row for each requirement, and one for all of them together."""
        areas = [*self.regions, self.common]
        return {
            "requirement": [*(one.text for one in self.requirements), "all"],
            "area_m2": [region.area for region in areas],
            "share": [region.share for region in areas],
        }

    def attributes(self) -> dict[str, Any]:
        """The areas as attributes of a map's dataset: text, numbers and lists of numbers."""
        areas = self.document()
        del areas["requirements"]
        return areas | {
            "requirements": "\n".join(one.text for one in self.requirements),
            "required_area_m2": [region.area for region in self.regions],
        }


def common_area(dataset: xr.Dataset, requirements: Sequence[Requirement]) -> CommonArea:
    """The regions of a map in which requirements are met, and the region that they have in common.

    dataset  a map (`study.workspace.map`) that holds the measure of each requirement
    Raises   ValueError  for no requirement, or one of a measure that the map does not hold
    """
    if not requirements:
        raise ValueError("a common area needs at least one requirement, such as 'stiffness_max>=5000'")
    missing = [r.measure.name for r in requirements if r.measure.name not in dataset]
    if missing:
        raise ValueError(f"the map does not hold {missing[0]}; it holds {', '.join(measures_of(dataset))}")
    x, y = dataset["x_m"].values, dataset["y_m"].values
    first = requirements[0].measure.name
    outline = reach_outline(dataset, first)
    if outline is None:  # regions end at the last cells that are reached
        reachable_shape = nonnegative_region(x, y, np.where(reachable(dataset, first), 1.0, np.nan))
        shapes = [nonnegative_region(x, y, r.margin(dataset[r.measure.name].values)) for r in requirements]
    else:  # regions end at the true edge of reach
        reachable_shape = outline
        shapes = [nonnegative_region(x, y, _continued_margin(dataset, r)) & outline for r in requirements]
    common = shapes[0]
    for shape in shapes[1:]:
        common = common.intersection(shape)
    reachable_area = float(reachable_shape.area)

    def region(shape: Any) -> PlaneArea:
        """A shapely geometry with its area and its share of what is reached."""
        area = float(shape.area)
        return PlaneArea(shape, area, area / reachable_area if reachable_area > 0.0 else np.nan)

    return CommonArea(
        requirements=tuple(requirements),
        units=tuple(str(dataset[r.measure.name].attrs.get("unit", "")) for r in requirements),
        axes=(str(dataset["x_m"].attrs["long_name"]), str(dataset["y_m"].attrs["long_name"])),
        reach=region(reachable_shape),
        regions=tuple(map(region, shapes)),
        common=region(common),
        circumstances=_circumstances(dataset),
    )


def _circumstances(dataset: xr.Dataset) -> dict[str, Any]:
    """What the map states of its device, plane and computer, for figures to repeat."""
    keys = ("name", "assembly", "model", "operator", "direction", "plane", "plane_through_m")
    return {key: dataset.attrs[key] for key in keys if key in dataset.attrs}


def _continued_margin(dataset: xr.Dataset, requirement: Requirement) -> Floats:
    """A requirement's margin (ny, nx), continued beyond the edge of reach."""
    name = requirement.measure.name
    return continued(requirement.margin(dataset[name].values), dataset[f"{name}_status"].values)


def nonnegative_region(x: Floats, y: Floats, margin: Floats) -> Any:
    """Where an interpolated margin is 0 or more, as a shapely geometry.

    x, y    (nx,), (ny,)  ascending
    margin  (ny, nx)      nan: no value, left out of the region; an infinity counts as a large margin of its sign

    >>> grid = np.linspace(-1.0, 1.0, 41)
    >>> round(nonnegative_region(grid, grid, 0.25 - grid**2 - grid[:, None] ** 2).area, 2)      # pi/4
    0.78
    """
    import contourpy
    import shapely

    finite = np.abs(margin[np.isfinite(margin)])
    # infinities count as twice the largest finite margin; as 1 where none is finite, or all are 0
    most = 2.0 * float(finite.max(initial=0.0)) or 1.0
    clipped = np.ma.masked_invalid(np.clip(margin, -most, most))  # masks nan, which clip keeps
    generator = contourpy.contour_generator(
        x, y, clipped, name="serial", corner_mask=True, fill_type=contourpy.FillType.OuterOffset
    )
    filled: Any = generator.filled(-ROUNDING * most, 2.0 * most)
    rings, offsets = filled  # of each polygon the points of all its rings, and where each ring begins and ends
    parts = []
    for points, ends in zip(rings, offsets, strict=True):
        outer, *holes = (points[a:b] for a, b in pairwise(ends))
        parts.append(shapely.make_valid(shapely.Polygon(outer, holes)))
    return shapely.union_all(parts) if parts else shapely.Polygon()
