"""The kinds of measurement that a device is identified from, by their names."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final

from zwidth.device.device import Device
from zwidth.device.faults import fail, quote, suggestion
from zwidth.identify.identification import Identification
from zwidth.identify.records.record import Columns, Record, read_record, record_of
from zwidth.loop.operating_point import OperatingPoint
from zwidth.progress import Progress


@dataclass(frozen=True)
class Kind:
    """One kind of measurement.

    name         as users write it
    module       in this package, with COLUMNS and `identify_<name>`
    takes_point  whether the numbers are of the device at an operating point
    """

    name: str
    module: str
    takes_point: bool = False

    @property
    def columns(self) -> Columns:
        """Columns that its records have."""
        columns: Columns = import_module(f"zwidth.identify.{self.module}").COLUMNS
        return columns

    @property
    def function(self) -> Callable[..., Identification]:
        """Function that identifies a device from such records: `identify_<name>`."""
        found: Callable[..., Identification] = getattr(
            import_module(f"zwidth.identify.{self.module}"), f"identify_{self.name}"
        )
        return found


KINDS: Final[dict[str, Kind]] = {
    kind.name: kind
    for kind in (
        Kind("stiffness", "stiffness.identify"),
        Kind("friction", "joint.friction"),
        Kind("mass", "joint.friction"),
        Kind("response", "response.identify"),
        Kind("modes", "modes.identify", takes_point=True),
        Kind("impedance", "impedance.identify", takes_point=True),
        Kind("boundary", "boundary.identify", takes_point=True),
        Kind("arm", "arm", takes_point=True),
    )
}


def identify(
    device: Device,
    kind: str,
    records: Any,
    *,
    point: OperatingPoint | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Identification:
    """Numbers of a device from measurements of it, each with the interval that holds it with 95 %.

        identify(device, "stiffness", "strokes.csv", joint="upper-right")["stiffness"].value

    kind      of measurement, see `KINDS`
    records   a file (.csv, .mat), columns as a mapping, a pandas table or an xarray dataset; or a list of such,
              each a run
    point     where the device was measured; left out: its reference
    options   of the kind: see `identify_stiffness` and its like
    Returns   the checks alone, and the reason, where they refuse the data
    Raises    DeviceError  for another kind, for records that cannot be read, and for what the device does not have
    """
    if kind not in KINDS:
        raise fail(
            device.label, "kind", f"{quote(kind)} is no kind of measurement; {suggestion(kind, KINDS, 'kinds')}"
        )
    chosen = KINDS[kind]
    if chosen.takes_point:
        options["point"] = point
    elif point is not None:
        raise fail(
            device.label, "point", f"does not apply to {kind}, which is the same in every posture; leave it out"
        )
    tables = [_record(one, chosen.columns, number) for number, one in enumerate(_listed(records))]
    if not tables:
        raise fail(device.label, "records", "holds none; give at least one file or table")
    return chosen.function(device, tables, progress=progress, **options)


def _listed(records: Any) -> Iterable[Any]:
    """A list of records as it is, and a single record as a list."""
    return records if isinstance(records, list | tuple) else [records]


def _record(given: Any, columns: Columns, number: int) -> Record:
    """The record of a file or table, with these columns; `number` names a table. Raises DeviceError."""
    if isinstance(given, Record):
        return given
    if isinstance(given, str | os.PathLike):
        return read_record(given, columns)
    if isinstance(given, Mapping) or hasattr(given, "columns"):
        return record_of(given, columns, f"record {number}")
    raise fail("records", str(number), f"must be a file or a table of columns, got {type(given).__name__}")
