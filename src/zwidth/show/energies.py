"""Text of an energy balance: the entries by name, and rows of a table, the stored energy last."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from zwidth.show.units import amount

HEADINGS: Final = ("energy", "put in", "taken out")
# Entries of the ledger whose names say too little beside others.
LABELS: Final = {"hold": "sample and hold", "quantiser": "encoder steps"}
NEGLIGIBLE: Final = 1e-9  # share of the largest energy that is not worth a line


def energy_label(name: str) -> str:
    """An entry of the energy ledger as people read it."""
    return LABELS.get(name, name)


def energy_rows(entries: Mapping[str, float], stored: float) -> Iterator[tuple[str, str, str]]:
    """Rows of a table: what each has put in, by its name, and how much more is stored than at the start [J]."""
    largest = max([abs(stored), *map(abs, entries.values())])
    for name, energy in entries.items():
        if abs(energy) > NEGLIGIBLE * largest:
            label, size = energy_label(name), amount(abs(energy), "J")
            yield (label, size, "") if energy > 0.0 else (label, "", size)
    if abs(stored) <= NEGLIGIBLE * largest:
        yield "stored since the start", "0 J", ""
    elif stored > 0.0:
        yield "stored since the start", amount(stored, "J"), ""
    else:
        yield "released since the start", "", amount(-stored, "J")
