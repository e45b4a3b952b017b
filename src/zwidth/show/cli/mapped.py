"""What `zwidth map` says of a map, and the files it writes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.measures.measure import OK, STATUS
from zwidth.show.cli.answer import Answer, sheet
from zwidth.show.cli.heading import computer, omission
from zwidth.show.output import ARRAYS, DATA, replacing, shown, write_data
from zwidth.show.units import amount, area_text, percent, typed, vector

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.device.device import Device
    from zwidth.show.cli.options import Question
    from zwidth.study.common_area import CommonArea

KEYS: Final = (
    "plane",
    "plane_axes",
    "plane_through_m",
    "x_m",
    "y_m",
    "values",
    "status",
    "overall",
    "notes",
)
NAMES: Final = np.array([STATUS.get(k, "") for k in range(256)], dtype=object)


def facts(question: Question, device: Device, extreme: str | None, *, linear: bool) -> dict[str, Any]:
    """The circumstances of a map: no single posture; a direction, or which of all of them.

    linear  is a measure among those asked that leaves out what is not linear?
    """
    found = question.facts(device) | ({} if linear else {"left_out": []})
    del found["position_m"]
    return found if extreme is None else found | {"direction": extreme}


def answered(
    question: Question,
    device: Device,
    dataset: xr.Dataset,
    names: Sequence[str],
    area: CommonArea | None,
    path: Path | None,
) -> Answer:
    """The answer of a map of these measures, the first of which stands at the top level of the document."""
    extreme = dataset.attrs["direction"]
    linear = _any(dataset, names, "linear")
    document = facts(question, device, extreme if isinstance(extreme, str) else None, linear=linear)
    each = {name: _measure(dataset, name, device) for name in names}
    plane = {
        "plane": dataset.attrs["plane"],
        "plane_axes": [dataset.attrs["plane_axes"][:3], dataset.attrs["plane_axes"][3:]],
        "plane_through_m": dataset.attrs["plane_through_m"],
        "x_m": dataset["x_m"].values,
        "y_m": dataset["y_m"].values,
    }
    document |= {"measure": names[0]} | plane | each[names[0]]
    document["notes"] = [f"{name}: {note}" for name in names for note in _notes(dataset, name)]
    if len(names) > 1:
        document["measures"] = each
    if area is not None:
        document |= _areas(area)
    if path is not None:
        document["file"] = str(path)
    reason = (
        None if any((dataset[f"{name}_status"].values == OK).any() for name in names) else _why(dataset, names)
    )

    def pages() -> Iterator[Any]:
        yield _heading(device, dataset, along=_any(dataset, names, "along"), linear=linear)
        for name in names:
            yield f"\n{dataset[name].attrs['title']} ({name})"
            yield sheet(list(_rows(dataset, name, each[name]["overall"])))
        if area is not None:
            yield "\nRequirements"
            yield sheet(list(_area_rows(area)))
        for note in document["notes"]:
            yield shown(note)
        if path is not None:
            yield f"written: {path}"

    return Answer(document, lambda: list(pages()), reason)


def _measure(dataset: xr.Dataset, name: str, device: Device) -> dict[str, Any]:
    from zwidth.study.workspace_summary import over_the_workspace

    about = dataset[name].attrs
    found = {
        "title": about["title"],
        "unit": about["unit"],
        "better": about["better"] or None,
        "source": about["source"],
        "values": dataset[name].values,
        "status": NAMES[dataset[f"{name}_status"].values],
        "overall": over_the_workspace(dataset, name, device),
        "notes": _notes(dataset, name),
    }
    directed = f"{name}_direction"
    return found | ({"directions": dataset[directed].values} if directed in dataset else {})


def _notes(dataset: xr.Dataset, name: str) -> list[str]:
    return str(dataset[name].attrs["notes"]).splitlines()


def _areas(area: CommonArea) -> dict[str, Any]:
    required = [
        {"requirement": r.text, "area_m2": region.area, "share": region.share}
        for r, region in zip(area.requirements, area.regions, strict=True)
    ]
    return {
        "requirements": required,
        "common_area_m2": area.common.area,
        "common_share": area.common.share,
        "reachable_area_m2": area.reach.area,
    }


def _why(dataset: xr.Dataset, names: Sequence[str]) -> str:
    notes = [note for name in names for note in _notes(dataset, name)]
    return "no cell has a value" + (f": {notes[0]}" if notes else "")


def _any(dataset: xr.Dataset, names: Sequence[str], what: str) -> bool:
    return any(dataset[name].attrs[what] for name in names)


def _heading(device: Device, dataset: xr.Dataset, *, along: bool, linear: bool) -> str:
    """Three lines at most: the map and the device; the computer; what is left out.

    along, linear  is a measure among those asked that depends on the direction, that leaves something out?
    """
    about = dataset.attrs
    towards = about["direction"]
    way = f"along the {towards} direction of each cell" if isinstance(towards, str) else f"along {vector(towards)}"
    nx, ny = dataset.sizes["x_m"], dataset.sizes["y_m"]
    plane = f"{nx} x {ny} cells of the plane {about['plane']}"
    if about["plane"] not in ("xy", "xz", "yz"):
        plane += f" along {vector(about['plane_axes'][:3])} and {vector(about['plane_axes'][3:])}"
    plane += f" through {vector(about['plane_through_m'], 'm')}"
    held = f", held by {shown(about['operator'])}" if about["operator"] != "none" else ""
    which = f"{way + ', ' if along else ''}assembly {about['assembly']}, model {about['model']}{held}"
    lines = [f"{shown(device.name)}: {plane}, {which}", computer(device.controller)]
    return "\n".join(lines + ([omission(device)] if linear and device.left_out else []))


def _rows(dataset: xr.Dataset, name: str, found: dict[str, float]) -> Iterator[tuple[str, str]]:
    values, status = dataset[name].values, dataset[f"{name}_status"].values
    unit, better = str(dataset[name].attrs["unit"]), dataset[name].attrs["better"]
    if (status == OK).any():
        yield "average", _amount(found["average"], unit)
        low, high = (
            ("worst", "best") if better == "higher" else ("best", "worst") if better else ("lowest", "highest")
        )
        for label, at in ((low, np.nanargmin(values)), (high, np.nanargmax(values))):
            row, column = np.unravel_index(at, values.shape)
            where = vector((dataset["x_m"].values[column], dataset["y_m"].values[row]), "m")
            yield label, f"{_amount(values[row, column], unit)} at {where}"
        yield "uniformity", f"{amount(found['uniformity'])} (least over largest)"
        for key, title in (("conditioning_index", "conditioning index"), ("isotropy_index", "isotropy index")):
            if key in found:
                yield title, amount(found[key])
    counts = np.bincount(status.ravel(), minlength=256)
    yield "cells", ", ".join(f"{counts[k]} {text}" for k, text in STATUS.items() if counts[k])


def _amount(value: float, unit: str) -> str:
    return "infinite" if value == np.inf else amount(value, unit.replace("N s", "Ns"))


def _area_rows(area: CommonArea) -> Iterator[tuple[str, str]]:
    for requirement, region in zip(area.requirements, area.regions, strict=True):
        yield requirement.text, _area(region.area, region.share)
    yield "common area", _area(area.common.area, area.common.share)


def _area(area: float, share: float) -> str:
    return f"{area_text(area).replace('²', '^2')}, {typed(percent(share))} of what is reached"


def write(
    path: Path, device: Device, dataset: xr.Dataset, first: str, area: CommonArea | None, answer: Answer
) -> None:
    """The map as a figure of its first measure, a table with a row for each cell, a document, labelled arrays."""
    kind = path.suffix.lower()
    if kind in ARRAYS:
        from zwidth.show.dataset import write_dataset

        areas = {} if area is None else _areas(area)
        told = {key: value for key, value in areas.items() if key != "requirements"}
        if area is not None:
            told["requirements"] = "\n".join(r.text for r in area.requirements)
            told["required_area_m2"] = [region.area for region in area.regions]
        write_dataset(path, dataset.assign_attrs(told))
        return
    if kind in DATA:
        reason = {} if answer.reason is None else {"reason": answer.reason}
        write_data(path, answer.document | reason, _table(dataset))
        return
    from zwidth.show.figures.map import map_figure
    from zwidth.show.figures.style import save

    drawing = map_figure(dataset, first, device, area)
    with replacing(path) as draft:
        save(drawing, draft)


def _table(dataset: xr.Dataset) -> dict[str, Any]:
    """A row for each cell, x fastest: its place in the plane and in the base frame, values and their status."""
    from zwidth.study.workspace_summary import positions

    x, y = np.meshgrid(dataset["x_m"].values, dataset["y_m"].values)
    table: dict[str, Any] = {"x_m": x.ravel(), "y_m": y.ravel()}
    if dataset.attrs["plane"] != "xy":
        where = positions(dataset).reshape(-1, 3)
        table |= {f"position_{axis}_m": where[:, k] for k, axis in enumerate("xyz")}
    for name in (str(key) for key in dataset.data_vars if f"{key}_status" in dataset):
        table[str(dataset[name].attrs["key"])] = dataset[name].values.ravel()
        table[f"{name}_status"] = NAMES[dataset[f"{name}_status"].values.ravel()]
        if f"{name}_direction" in dataset:
            u = dataset[f"{name}_direction"].values.reshape(-1, 3)
            table |= {f"{name}_direction_{axis}": u[:, k] for k, axis in enumerate("xyz")}
    return table
