"""Under what load a device is: the [load] of its file, or another."""

from __future__ import annotations

from typing import Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike

from zwidth.device.faults import fail
from zwidth.model.load import Load, LoadError

Tables = dict[str, Any]


def document_under(
    document: Tables, load: Load | ArrayLike | None, gravity: ArrayLike | None, moment: bool, label: str
) -> Tables:
    """The device's document with another [load].

    load     a `Load`; the hand's force (2,) or (3,), or about an axis its moment, in place of that of the
             document; None: as the document says
    gravity  (2,) or (3,) in place of the document's; None: as the document says
    Raises   DeviceError  for what is no load
    """
    if isinstance(load, Load):
        try:
            whole = load if gravity is None else load.with_gravity(gravity)
        except LoadError as error:
            raise fail(label, "load", str(error)) from None
        return {**document, "load": table_of_load(whole)}
    changes: Tables = {}
    try:
        if load is not None:
            own = Load(moment=cast(Any, load)) if moment else Load(force=cast(Any, load))
            changes |= table_of_load(own)
        if gravity is not None:
            changes |= table_of_load(Load(gravity=cast(Any, gravity)))
    except LoadError as error:
        raise fail(label, "load", str(error)) from None
    if not changes:
        return document
    kept = dict(document.get("load", {}))
    if load is not None:
        for key in ("force_N", "push_N", "moment_Nm"):
            kept.pop(key, None)
    return {**document, "load": kept | changes}


NAMES: Final = {
    "force_N": "force",
    "moment_Nm": "moment",
    "push_N": "push",
    "gravity_m_per_s2": "gravity",
    "hand": "hand",
    "posture_of": "posture_of",
    "settle": "settle",
    "surface_radius_m": "surface_radius",
    "count_sideways": "count_sideways",
    "spring_branch": "branch",
}
"""Keys of [load], and the fields of `Load` that they fill."""


def load_of_table(table: Tables) -> Load:
    """A [load] as `Load`. Raises LoadError."""
    return Load(**{NAMES[key]: value for key, value in table.items()})


def table_of_load(load: Load) -> Tables:
    """A load as the [load] of a device file, without what is as by default."""
    plain, table = Load(), Tables()
    for key, name in NAMES.items():
        value = getattr(load, name)
        if isinstance(value, np.ndarray):
            table[key] = value.tolist()
        elif value != getattr(plain, name):
            table[key] = value
    return table
