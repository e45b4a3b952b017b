"""Under what load a device is: the [load] of its file, or another."""

from __future__ import annotations

from math import isfinite
from typing import Any

from numpy.typing import ArrayLike

from zwidth.device.faults import fail
from zwidth.model.load import Load, LoadError

Tables = dict[str, Any]


def document_under(
    document: Tables, load: Load | ArrayLike | None, gravity: ArrayLike | None, moment: bool, label: str
) -> Tables:
    """The device's document with another [load].

    load     a `Load`; the hand's force (2,) or (3,), or about an axis its moment, in place of that of the document;
             None: as the document says
    gravity  (2,) or (3,) in place of the document's; None: as the document says
    Raises   DeviceError  for what is no load
    """
    if isinstance(load, Load):
        try:
            own = load if gravity is None else load.with_gravity(gravity)
        except LoadError as error:
            raise fail(label, "load", str(error)) from None
        return {**document, "load": table_of_load(own)}
    changes: Tables = {}
    try:
        if load is not None:
            force = Load(force=load).force
            assert force is not None
            changes["moment_Nm" if moment else "force_N"] = force.tolist()
        if gravity is not None:
            changes["gravity_m_per_s2"] = Load(gravity=gravity).weight.tolist()
    except LoadError as error:
        raise fail(label, "load", str(error)) from None
    if not changes:
        return document
    kept = dict(document.get("load", {}))
    if load is not None:
        for key in ("force_N", "push_N", "moment_Nm"):
            kept.pop(key, None)
    return {**document, "load": kept | changes}


def table_of_load(load: Load) -> Tables:
    """A load as the [load] of a device file, without what is as by default."""
    plain, own = Load(), Tables()
    for key, name in (("force_N", "force"), ("moment_Nm", "moment"), ("gravity_m_per_s2", "gravity")):
        vector = getattr(load, name)
        if vector is not None:
            own[key] = vector.tolist()
    if load.push is not None:
        own["push_N"] = load.push
    for key, name in (
        ("hand", "hand"),
        ("posture_of", "posture_of"),
        ("settle", "settle"),
        ("count_sideways", "count_sideways"),
        ("spring_branch", "branch"),
    ):
        if getattr(load, name) != getattr(plain, name):
            own[key] = getattr(load, name)
    if isfinite(load.surface_radius):
        own["surface_radius_m"] = load.surface_radius
    return own
