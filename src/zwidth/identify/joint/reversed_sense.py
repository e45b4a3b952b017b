"""Why no mass with friction explains a motion: a sense reversed, all along or in between, or columns swapped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.device.faults import comma_list
from zwidth.identify.joint.fit import Numbers, Windows, explained, squares_of
from zwidth.identify.joint.record import Motion
from zwidth.identify.joint.start import search_guess
from zwidth.identify.records.record import Record

GROUPS: Final = 6  # parts of a single record
FEWEST: Final = 3  # windows of a part
CLEARLY: Final = 0.9  # share of the motion that is explained where the cause is right
SWAPPED: Final = 0.995  # the same of swapped columns, for two smooth ones explain each other in part
BETTER: Final = 0.1  # share of what remains that may remain with the right cause
GUESSES: Final = 3  # that are followed
MOST: Final = 6  # windows that are looked at of each part


def reason_of_misfit(windows: Windows, motion: Motion, numbers: Numbers, records: Sequence[Record]) -> str:
    """A sentence with the cause, and what to do; "" where none explains the motion."""
    if not motion.driven:
        return ""
    name, reversed_ = motion.force_name, replace(windows, force=-windows.force)
    along, against = list[str](), list[str]()
    for group, which in _groups(windows, motion, records).items():
        left = 1.0 - _explained(windows.chosen(which), motion, numbers)
        left_reversed = 1.0 - _explained(reversed_.chosen(which), motion, numbers)
        if min(left, left_reversed) > 1.0 - CLEARLY:
            continue
        if left_reversed < BETTER * left:
            against.append(group)
        elif left < BETTER * left_reversed:
            along.append(group)
    if against and along:
        return (
            f"a positive {name} accelerates backward in {comma_list(against)}: a sign has flipped, change it there"
        )
    swapped = replace(windows, position=windows.force, force=windows.position + motion.reference)
    if _explained(swapped.chosen(_some(np.ones(len(windows.first), dtype=bool))), motion, numbers) > SWAPPED:
        return f"the columns of position and {name} are swapped: exchange their names"
    return f"a positive {name} accelerates backward: change the sign of one of the two columns" if against else ""


def _explained(windows: Windows, motion: Motion, numbers: Numbers) -> float:
    """Share of the motion in windows that is explained by the numbers that explain it best."""
    found, starts = search_guess(windows, numbers, motion.resolution, motion.deviation, GUESSES)
    return explained(windows, squares_of(windows, found, starts))


def _some(which: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Of these windows at most six, evenly spread."""
    places = np.flatnonzero(which)
    kept = places[np.unique(np.linspace(0, len(places) - 1, min(MOST, len(places))).astype(int))]
    return np.isin(np.arange(len(which)), kept)


def _groups(windows: Windows, motion: Motion, records: Sequence[Record]) -> dict[str, NDArray[np.bool_]]:
    """Windows of each record, or of parts of a single one, by their names."""
    record_of_run = {one.run: one.record for one in motion.sections}
    owner = np.array([record_of_run[int(run)] for run in windows.run])
    if len(records) > 1:
        groups = {record.label: owner == n for n, record in enumerate(records)}
    else:
        groups = {}
        for part in np.array_split(np.arange(len(owner)), max(min(GROUPS, len(owner) // FEWEST), 1)):
            end = windows.time[part[-1]] + windows.length[part[-1]] * windows.period[part[-1]]
            groups[f"{windows.time[part[0]]:.4g} to {end:.4g} s"] = np.isin(np.arange(len(owner)), part)
    return {name: _some(which) for name, which in groups.items() if np.sum(which) >= FEWEST}
