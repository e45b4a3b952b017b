"""Why no mass with friction explains a motion: a sense reversed, all along or in between, or columns swapped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.device.faults import comma_list
from zwidth.identify.friction_fit import Numbers, Windows, explained, squares_of
from zwidth.identify.friction_record import Motion
from zwidth.identify.friction_start import search_guess
from zwidth.identify.record import Record

Floats = NDArray[np.float64]

GROUPS: Final = 6  # parts of a single record
FEWEST: Final = 3  # windows of a part
CLEARLY: Final = 0.9  # share of the motion that is explained where the cause is right
HARDLY: Final = 0.7  # share that is explained at most where it is not


def reason_of_misfit(windows: Windows, motion: Motion, numbers: Numbers, records: Sequence[Record]) -> str:
    """A sentence with the cause, and what to do; "" where none of them explains the motion."""
    if not motion.driven:
        return ""
    reversed_ = replace(windows, force=-windows.force)
    name = motion.force_name
    if _explained(reversed_, motion, numbers) > CLEARLY:
        return f"a positive {name} accelerates backward: change the sign of one of the two columns"
    swapped = replace(windows, position=windows.force, force=windows.position + motion.reference)
    if _explained(swapped, motion, numbers) > CLEARLY:
        return f"the columns of position and {name} are swapped: exchange their names"
    backward = list[str]()
    for group, which in _groups(windows, motion, records).items():
        along, against = windows.chosen(which), reversed_.chosen(which)
        if _explained(along, motion, numbers) < HARDLY and _explained(against, motion, numbers) > CLEARLY:
            backward.append(group)
    if backward:
        return f"a positive {name} accelerates backward in {comma_list(backward)}: a sign has flipped, change it there"
    return ""


def _explained(windows: Windows, motion: Motion, numbers: Numbers) -> float:
    """Share of the motion in windows that is explained by the numbers that explain it best."""
    found, starts = search_guess(windows, numbers, motion.resolution, motion.deviation)
    return explained(windows, squares_of(windows, found, starts))


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
    return {name: which for name, which in groups.items() if np.sum(which) >= FEWEST}
