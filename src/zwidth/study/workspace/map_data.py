"""A map's results as a document, and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.device.device import Device
from zwidth.measures.definition import NO_EQUILIBRIUM, OK, STATUS
from zwidth.study.workspace.map import measures_of
from zwidth.study.workspace.workspace_summary import over_the_workspace, positions

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.study.workspace.common_area import CommonArea

NAMES: Final = np.array([STATUS.get(k, "") for k in range(256)], dtype=object)


def map_document(
    dataset: xr.Dataset, device: Device | None = None, area: CommonArea | None = None
) -> dict[str, Any]:
    """A map by key and unit: its grid, its first measure, and with several all of them under `measures`.

    dataset  as `study.workspace.map.workspace_map` returns it
    device   None: numbers for which postures must be solved again are left out, as in `over_the_workspace`
    area     common area of requirements; None: no requirements
    """
    names = measures_of(dataset)
    axes = dataset.attrs["plane_axes"]
    each = {name: _measure(dataset, name, device) for name in names}
    document = {
        "measure": names[0],
        "plane": dataset.attrs["plane"],
        "plane_axes": [axes[:3], axes[3:]],
        "plane_through_m": dataset.attrs["plane_through_m"],
        "x_m": dataset["x_m"].values,
        "y_m": dataset["y_m"].values,
        **each[names[0]],
        "notes": [f"{name}: {note}" for name in names for note in _notes(dataset, name)],
    }
    document |= {"measures": each} if len(names) > 1 else {}
    return document | ({} if area is None else area.document())


def map_table(dataset: xr.Dataset) -> dict[str, Any]:
    """A map as columns, a row for each cell, x fastest: position in the plane and, unless that is xy, in the base
    frame; values and their status, and directions."""
    x, y = np.meshgrid(dataset["x_m"].values, dataset["y_m"].values)
    table: dict[str, Any] = {"x_m": x.ravel(), "y_m": y.ravel()}
    if dataset.attrs["plane"] != "xy":
        table |= _components("position", positions(dataset), "_m")
    for name in measures_of(dataset):
        table[str(dataset[name].attrs["key"])] = dataset[name].values.ravel()
        table[f"{name}_status"] = NAMES[dataset[f"{name}_status"].values.ravel()]
        if f"{name}_direction" in dataset:
            table |= _components(f"{name}_direction", dataset[f"{name}_direction"].values)
    return table


def why_no_cell(dataset: xr.Dataset) -> str | None:
    """Why no cell has a value of any measure; None where one has."""
    names = measures_of(dataset)
    if any((dataset[f"{name}_status"].values == OK).any() for name in names):
        return None
    notes = [note for name in names for note in _notes(dataset, name)]
    if not notes and any((dataset[f"{name}_status"].values == NO_EQUILIBRIUM).any() for name in names):
        return (
            f"no cell has a value: in none that is reached is there an equilibrium under {dataset.attrs['load']}"
        )
    return "no cell has a value" + (f": {notes[0]}" if notes else "")


def _measure(dataset: xr.Dataset, name: str, device: Device | None) -> dict[str, Any]:
    """One measure of the document."""
    attributes = dataset[name].attrs
    document = {
        "title": attributes["title"],
        "unit": attributes.get("unit", ""),
        "better": attributes["better"] or None,
        "source": attributes["source"],
        "values": dataset[name].values,
        "status": NAMES[dataset[f"{name}_status"].values],
        "overall": over_the_workspace(dataset, name, device),
        "notes": _notes(dataset, name),
    }
    directed = f"{name}_direction"
    return document | ({"directions": dataset[directed].values} if directed in dataset else {})


def _notes(dataset: xr.Dataset, name: str) -> list[str]:
    return str(dataset[name].attrs["notes"]).splitlines()


def _components(name: str, vectors: Sequence[Any] | np.ndarray, unit: str = "") -> dict[str, Any]:
    """Columns of vectors (..., 3)."""
    rows = np.reshape(vectors, (-1, 3))
    return {f"{name}_{axis}{unit}": rows[:, k] for k, axis in enumerate("xyz")}
