"""The exact edge of the reachable set on a map's plane, where the links' lengths alone decide it.

Every chain of links from the base to the handle allows a shell about its base (`model.reach_shells`). For many
mechanisms whose joints all turn freely, the handle reaches every point that lies in all shells. That is checked
against every cell of the map; where it holds, the edge consists of exact arcs of circles.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats
from zwidth.measures.definition import BEYOND_LIMIT, NO_POSTURE, OUT_OF_REACH, SINGULAR
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import pack
from zwidth.model.reach_shells import shells
from zwidth.study.workspace.workspace_summary import positions

if TYPE_CHECKING:
    import xarray as xr


KEY: Final = "reach_shells_m"  # attribute of a map: centre x, y, z, least and most distance of each shell
QUARTER: Final = 256  # chords of a quarter of a circle; its area is too small by a share of 6e-6
NEAR: Final = 1e-6  # share of a shell's size within which a cell may be judged either way
LAYERS: Final = 2  # cells beyond the last with a value to which values are continued


def shells_attribute(mechanism: Mechanism) -> list[float]:
    """The shells of a mechanism's chains as a list of numbers, five for each shell."""
    return [
        float(value) for shell in shells(pack(mechanism), 0) for value in (*shell.centre, shell.least, shell.most)
    ]


def reach_outline(dataset: xr.Dataset, name: str) -> Any:
    """The reachable set within a map's grid, as a shapely geometry in the plane's coordinates.

    dataset  a map (`study.workspace.map`);   name  one of its measures
    Returns  None where the shells do not decide reach, or the map does not hold them
    """
    import shapely

    table = np.reshape(np.asarray(dataset.attrs.get(KEY, ()), dtype=np.float64), (-1, 5))
    if not len(table) or not _decided_by(table, dataset, name):
        return None
    axes = np.asarray(dataset.attrs["plane_axes"], dtype=np.float64).reshape(2, 3)
    through = np.asarray(dataset.attrs["plane_through_m"], dtype=np.float64)
    x, y = dataset["x_m"].values, dataset["y_m"].values
    outline: Any = shapely.box(x[0], y[0], x[-1], y[-1])
    for *centre, least, most in table:
        offset = np.array(centre) - through
        middle, height = shapely.Point(axes @ offset), abs(float(np.cross(*axes) @ offset))
        if height >= most:
            return shapely.Polygon()
        outline &= middle.buffer(np.sqrt(most**2 - height**2), quad_segs=QUARTER)
        if least > height:
            outline -= middle.buffer(np.sqrt(least**2 - height**2), quad_segs=QUARTER)
    return outline


def _decided_by(table: Floats, dataset: xr.Dataset, name: str) -> bool:
    """Whether the reached cells are exactly those that lie in all shells."""
    at, status = positions(dataset), dataset[f"{name}_status"].values
    inside = np.ones(status.shape, dtype=np.bool_)
    unsure = status == SINGULAR
    for *centre, least, most in table:
        distance = np.linalg.norm(at - np.array(centre), axis=-1)
        inside &= (distance >= least) & (distance <= most)
        unsure |= np.minimum(np.abs(distance - least), np.abs(distance - most)) < NEAR * most
    return bool(np.all(unsure | (inside == ~np.isin(status, (OUT_OF_REACH, BEYOND_LIMIT)))))


def continued(values: Floats, status: NDArray[np.uint8]) -> Floats:
    """The values (ny, nx) of a map, continued beyond the edge of reach within the range of the others.

    The value of such a cell is extrapolated linearly from the next two cells along each row, column and diagonal
    that has them, and averaged; without two such cells it is the mean of its neighbours. A figure can then be cut
    at the true edge, not at the last cell.
    """
    known = np.array(values, dtype=np.float64)
    beyond = np.isin(status, NO_POSTURE)
    finite = known[np.isfinite(known)]
    if not len(finite):
        return known
    low, high = float(finite.min()), float(finite.max())
    for _ in range(LAYERS):
        next_to, behind = _along(known, 1), _along(known, 2)
        with np.errstate(invalid="ignore"):
            straight = _mean(2.0 * next_to - behind)
        estimate = np.where(np.isnan(straight), _mean(next_to), straight)
        known = np.where(beyond & np.isnan(known), np.clip(estimate, low, high), known)
    return known


def _along(values: Floats, steps: int) -> Floats:
    """The values (8, ny, nx) a number of cells away along rows, columns and diagonals; nan outside the grid."""
    padded = np.pad(values, steps, constant_values=np.nan)
    rows, columns = values.shape
    ways = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    starts = [(steps * (1 + i), steps * (1 + j)) for i, j in ways]
    return np.stack([padded[i : i + rows, j : j + columns] for i, j in starts])


def _mean(values: Floats) -> Floats:
    """Mean of the finite values over the first axis; nan where there is none."""
    there = np.isfinite(values)
    total = np.where(there, values, 0.0).sum(axis=0)
    return np.where(there.any(axis=0), total / np.maximum(there.sum(axis=0), 1), np.nan)
