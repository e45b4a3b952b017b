"""Words for a number of a device file: its key without the unit, and where the file says that it comes from."""

from __future__ import annotations

from collections.abc import Mapping

from zwidth.device.faults import KeyPath, dotted
from zwidth.device.schema.device_file import key_unit


def number_name(steps: KeyPath) -> str:
    """A key in words without its unit, and the indices of an element of a list, from 0.

    >>> number_name(("loop", "sampling_period_s")), number_name(("plant", "mass_kg", 0, 1))
    ('sampling period', 'mass [0, 1]')
    >>> number_name(("mechanism", "links", 0, "inertia_kg_m2"))
    'inertia'
    """
    end = len(steps)
    while isinstance(steps[end - 1], int):
        end -= 1
    key, unit = str(steps[end - 1]), key_unit(steps).replace("^", "").replace("/", "_per_")
    for spelled in (unit.replace(" ", ""), unit.replace(" ", "_")):
        if unit:
            key = key.removesuffix(f"_{spelled}")
    indices = ", ".join(map(str, steps[end:]))
    return key.replace("_", " ") + (f" [{indices}]" if indices else "")


def source_of(steps: KeyPath, document: object, sources: Mapping[str, str]) -> str:
    """What [sources] says of a number: under the longest path that it lies at or below, of those the one with the
    fewest *; "" if there is none.

    >>> source_of(("plant", "mass_kg"), {}, {"plant": "drawings", "plant.mass_kg": "scales", "loop": "code"})
    'scales'
    """
    own = dotted(steps, document).split(".")
    best, found = (0, 0), ""
    for path, text in sources.items():
        parts = path.split(".")
        if parts[0] != own[0] and own[0] == "mechanism":  # as --set takes it, without its first step
            parts = ["mechanism", *parts]
        if len(parts) > len(own) or any(
            part not in ("*", name, str(step)) for part, name, step in zip(parts, own, steps, strict=False)
        ):
            continue
        rank = (len(parts), -parts.count("*"))
        if rank > best:
            best, found = rank, text
    return found
