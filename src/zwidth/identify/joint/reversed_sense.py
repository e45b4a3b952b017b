"""Why no mass with friction explains a motion: a sense reversed, records that differ, perhaps columns swapped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from zwidth.arrays import Flags
from zwidth.device.faults import comma_list
from zwidth.identify.joint.fit import MASS, ONE, Numbers, Windows, explained, squares_of
from zwidth.identify.joint.force_balance import ForceBalance, force_balance
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
    """What was seen where no mass with friction explains the motion, and what may cause it; "" where nothing was.

    A sign is called turned only where the force falls with the acceleration beyond its noise, and the motion is
    explained once it is turned. Everything else that is better so than as recorded is a question.
    """
    if not motion.driven:
        return ""
    name, reversed_ = motion.force_name, replace(windows, force=-windows.force)
    groups = groups_of(windows, motion, records)
    seen = {group: force_balance(windows.chosen(which), motion.resolution) for group, which in groups.items()}
    along, against, own = list[str](), list[str](), list[str]()
    for group, which in groups.items():
        left = 1.0 - _explained(windows.chosen(_some(which)), motion, numbers)
        left_reversed = 1.0 - _explained(reversed_.chosen(_some(which)), motion, numbers)
        if left <= 1.0 - CLEARLY:
            own.append(group)
        if min(left, left_reversed) > 1.0 - CLEARLY:
            continue
        if left_reversed < BETTER * left and seen[group].against_mass:
            against.append(group)
        elif left < BETTER * left_reversed and seen[group].tells_mass:
            along.append(group)
    if against and along:
        return (
            f"a positive {name} accelerates backward in {comma_list(against)}, and forward in "
            f"{comma_list(along)}: a sign has flipped, change it there"
        )
    everywhere = np.ones(len(windows.first), dtype=bool)
    if against or (not along and _turned(windows, reversed_, motion, numbers)):
        return f"a positive {name} accelerates backward: change the sign of one of the two columns"
    if len(records) > 1 and len(own) == len(groups):
        return f"each record by itself is explained, all together are not: {_differences(seen)}"
    swapped = replace(windows, position=windows.force, force=windows.position + motion.reference)
    share = _explained(swapped.chosen(_some(everywhere)), motion, numbers)
    if share > SWAPPED:
        return (
            f"were the columns of position and {name} swapped, {100.0 * share:.4g} % would be explained: are "
            "they, or did another force act too, or something change while it was recorded? The record does not "
            "tell"
        )
    return ""


def _turned(windows: Windows, reversed_: Windows, motion: Motion, numbers: Numbers) -> bool:
    """Whether the force of the whole record falls with the acceleration, and explains the motion with its sign
    turned."""
    if not force_balance(windows, motion.resolution).against_mass:
        return False
    some = _some(np.ones(len(windows.first), dtype=bool))
    left, left_reversed = (1.0 - _explained(one.chosen(some), motion, numbers) for one in (windows, reversed_))
    return left_reversed <= 1.0 - CLEARLY and left_reversed < BETTER * left


def _differences(seen: Mapping[str, ForceBalance]) -> str:
    """The mass by each record, and what may be the reason where they differ."""
    masses = list[str]()
    for group, one in seen.items():
        low, high = one.interval(ONE[MASS])
        masses.append(f"{low:.3g} to {high:.3g} by {group}" if one.tells_mass else f"not told by {group}")
    return (
        f"the mass or inertia is {comma_list(masses)}; another device or load, another friction, or another unit "
        "or sign in one of them? Give them one by one"
    )


def _explained(windows: Windows, motion: Motion, numbers: Numbers) -> float:
    """Share of the motion in windows that is explained by the numbers that explain it best."""
    found, starts = search_guess(windows, numbers, motion.resolution, motion.deviation, GUESSES)
    return explained(windows, squares_of(windows, found, starts))


def _some(which: Flags) -> Flags:
    """Of these windows at most six, evenly spread."""
    places = np.flatnonzero(which)
    kept = places[np.unique(np.linspace(0, len(places) - 1, min(MOST, len(places))).astype(int))]
    return np.isin(np.arange(len(which)), kept)


def groups_of(windows: Windows, motion: Motion, records: Sequence[Record]) -> dict[str, Flags]:
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
