"""Text of an energy balance: one entry per column, the stored energy last."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from zwidth.show.units import amount

HEADINGS: Final = ("energy", "put in", "taken out")
NEGLIGIBLE: Final = 1e-9  # share of the largest energy that is not worth a line


def energy_rows(entries: Mapping[str, float], stored: float) -> Iterator[tuple[str, str, str]]:
    """Rows of a table: what each has put in, by its name, and how much more is stored than at the start [J]."""
    largest = max([abs(stored), *map(abs, entries.values())])
    for name, energy in entries.items():
        if abs(energy) > NEGLIGIBLE * largest:
            told = amount(abs(energy), "J")
            yield (name, told, "") if energy > 0.0 else (name, "", told)
    if abs(stored) <= NEGLIGIBLE * largest:
        yield "stored since the start", "0 J", ""
    elif stored > 0.0:
        yield "stored since the start", amount(stored, "J"), ""
    else:
        yield "released since the start", "", amount(-stored, "J")
