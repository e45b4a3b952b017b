"""Text page of `zwidth map`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from zwidth.measures.definition import OK, STATUS
from zwidth.show.circumstances import computer_text, load_text
from zwidth.show.cli.answer import two_columns
from zwidth.show.cli.heading import omissions
from zwidth.show.output import printable
from zwidth.show.units import amount, area_text, percent, typed, vector

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.device.device import Device
    from zwidth.study.workspace.common_area import CommonArea


def map_page(
    dataset: xr.Dataset, device: Device, area: CommonArea | None, document: Mapping[str, Any]
) -> Iterator[Any]:
    """The map in a few numbers: what and where, each measure over the workspace, requirements, notes.

    document  of the map, as `study.workspace.map_data.map_document` makes it
    """
    measures = document.get("measures") or {document["measure"]: document}
    yield _heading(dataset, device, list(measures))
    for name, one in measures.items():
        yield f"\n{one['title']} ({name})"
        yield two_columns(list(_rows(dataset, name, one["overall"])))
    if area is not None:
        yield "\nRequirements"
        yield two_columns(list(_area_rows(area)))
    yield from map(printable, document["notes"])


def _heading(dataset: xr.Dataset, device: Device, names: list[str]) -> str:
    """Three lines at most: the map and the device; the computer; what is left out. Of what matters to no measure,
    the direction or the linearity, nothing is said."""
    about = dataset.attrs
    towards = about["direction"]
    way = f"along the {towards} direction of each cell" if isinstance(towards, str) else f"along {vector(towards)}"
    along = any(dataset[name].attrs["along"] for name in names)
    nx, ny = dataset.sizes["x_m"], dataset.sizes["y_m"]
    plane = f"{nx} x {ny} cells of the plane {about['plane']}"
    if about["plane"] not in ("xy", "xz", "yz"):
        plane += f" along {vector(about['plane_axes'][:3])} and {vector(about['plane_axes'][3:])}"
    plane += f" through {vector(about['plane_through_m'], 'm')}"
    held = f", held by {printable(about['operator'])}" if about["operator"] != "none" else ""
    if device.load is not None:
        load = device.load.along_every_direction if isinstance(towards, str) else device.load
        held += f", under {load_text(load)}"
    which = f"{way + ', ' if along else ''}assembly {about['assembly']}, model {about['model']}{held}"
    lines = [f"{printable(device.name)}: {plane}, {which}", computer_text(device.controller)]
    linear = any(dataset[name].attrs["linear"] for name in names)
    return "\n".join([*lines, *omissions(device, str(about["model"]), linear=linear)])


def _rows(dataset: xr.Dataset, name: str, overall: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    values, status = dataset[name].values, dataset[f"{name}_status"].values
    unit, better = str(dataset[name].attrs.get("unit", "")), dataset[name].attrs["better"]
    if (status == OK).any():
        yield "average", _amount(overall["average"], unit)
        low, high = (
            ("worst", "best") if better == "higher" else ("best", "worst") if better else ("lowest", "highest")
        )
        for label, at in ((low, np.nanargmin(values)), (high, np.nanargmax(values))):
            row, column = np.unravel_index(at, values.shape)
            where = vector((dataset["x_m"].values[column], dataset["y_m"].values[row]), "m")
            yield label, f"{_amount(values[row, column], unit)} at {where}"
        yield "uniformity", f"{amount(overall['uniformity'])} (smallest over largest)"
        for key, title in (("conditioning_index", "conditioning index"), ("isotropy_index", "isotropy index")):
            if key in overall:
                yield title, amount(overall[key])
    counts = np.bincount(status.ravel(), minlength=256)
    yield "cells", ", ".join(f"{counts[k]} {text}" for k, text in STATUS.items() if counts[k])


def _amount(value: float, unit: str) -> str:
    return "infinite" if value == np.inf else amount(value, unit.replace("N s", "Ns"))


def _area_rows(area: CommonArea) -> Iterator[tuple[str, str]]:
    for requirement, region in zip(area.requirements, area.regions, strict=True):
        yield requirement.text, _area(region.area, region.share)
    yield "common area", _area(area.common.area, area.common.share)


def _area(area: float, share: float) -> str:
    return f"{area_text(area).replace('²', '^2')}, {typed(percent(share))} of the reachable area"
