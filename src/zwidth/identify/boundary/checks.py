"""What a measured boundary must be before numbers are fitted to it: enough points, plausible, of one kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from zwidth.arrays import Flags
from zwidth.chart.edge_crossings import EdgeChords
from zwidth.device.faults import comma_list, plural
from zwidth.identify.boundary.points import (
    EDGE,
    LOWER,
    STABLE,
    TIP,
    UNSTABLE,
    UPPER,
    BoundaryPoints,
)
from zwidth.identify.identification import Check
from zwidth.identify.records.record import Record

SPARE: Final = 2  # points on the boundary beyond the numbers that are fitted
THOUSAND: Final = (2.3, 3.7)  # powers of ten that a forgotten thousand may look like
FAR_OFF: Final = 2.0  # powers of ten from the chart, from which on columns may be swapped
NEAR: Final = 1.0  # powers of ten from the chart, if they are swapped back
SAME: Final = 1e-9  # relative difference of numbers that are copies
MOST_NAMED: Final = 3
UNITS: Final = {"bias_force_N": " N", "perturbation_N": " N", "watch_time_s": " s", "amplitude_m": " m"}


def complete_points(points: BoundaryPoints, records: Sequence[Record]) -> tuple[BoundaryPoints, list[Check]]:
    """The points that have a stiffness and a damping, each once, and the checks of it."""
    whole = np.isfinite(points.stiffness) & np.isfinite(points.damping)
    checks = list[Check]()
    if not whole.all():
        rows = [records[points.record[i]].place(int(points.row[i])) for i in np.flatnonzero(~whole)]
        listed = comma_list(rows, MOST_NAMED)
        text = f"{plural(len(rows), 'row')} without a stiffness or a damping left out: {listed}"
        checks.append(Check("rows", False, text, warning=True))
    kept = points[whole]
    copies = _copies(kept)
    if copies.any():
        rows = [records[kept.record[i]].place(int(kept.row[i])) for i in np.flatnonzero(copies)]
        text = (
            f"{plural(len(rows), 'row repeats', 'rows repeat')} another to the last digit and count once: "
            f"{comma_list(rows, MOST_NAMED)}; record each trial as it was measured"
        )
        checks.append(Check("copies", False, text, warning=True))
    return kept[~copies], checks


def _copies(points: BoundaryPoints) -> Flags:
    """Which points (n,) are an earlier one again, in all numbers and words."""
    seen, again = set[tuple[object, ...]](), np.zeros(len(points), dtype=bool)
    for i in range(len(points)):
        numbers = (points.stiffness, points.damping, points.frequency, points.low, points.high, points.trials)
        own = (*(float(one[i]) for one in numbers), *(str(v[i]) for v in points.circumstances.values()))
        key = (str(points.kind[i]), *(None if x != x else x for x in own))
        again[i] = key in seen
        seen.add(key)
    return again


def check_points(points: BoundaryPoints, count: int) -> list[Check]:
    """Whether there are enough points for so many numbers, spread over the boundary."""
    edges = points[points.on_edge]
    tried = int(points.of(STABLE, UNSTABLE).sum())
    kinds = [kind for kind in (LOWER, UPPER, TIP, EDGE) if edges.of(kind).any()]
    seen = comma_list([f"{int(edges.of(kind).sum())} {kind}" for kind in kinds])
    listed = f"{plural(len(edges), 'point')} on the boundary ({seen or 'none'})"
    if tried:
        listed += f", {plural(tried, 'wall')} tried beside it"
    needed = count + SPARE
    if len(edges) < needed:
        text = f"{listed}; {plural(count, 'number')} and the scatter need {needed} on the boundary, measure more"
        if tried and not len(edges):
            text += ": bisect between a stable and an unstable wall"
        return [Check("points", False, text)]
    checks = [Check("points", True, listed)]
    for values, name, unit in ((edges.stiffness, "stiffness", "N/m"), (edges.damping, "damping", "N s/m")):
        if np.ptp(values) <= SAME * np.max(np.abs(values)):
            text = (
                f"{name} is {values[0]:g} {unit} in every point on the boundary; choose several stiffnesses and "
                "bisect the damping at each, then chart and points can be compared"
            )
            return [*checks, Check("spread", False, text)]
    if len(kinds) == 1 and kinds[0] in (LOWER, UPPER):
        text = (
            f"all points lie on the {kinds[0]} edge; points on the other one and at the tip tell delay, damping "
            "and masses apart better"
        )
        checks.append(Check("edges", False, text, warning=True))
    return checks


def check_magnitudes(points: BoundaryPoints, edge: EdgeChords) -> Check:
    """Whether stiffness and damping are of the size that the device's own chart has."""
    edges = points[points.on_edge]
    if not len(edge):
        return Check("units", True, "the device as the file has it renders no stable wall to compare with")
    _, K, _, B = edge.box
    sizes = [float(np.max(np.abs(values))) for values in (edges.stiffness, edges.damping)]
    own = [max(abs(K), 1e-300), max(abs(B), 1e-300)]
    off = [float(np.log10(max(size, 1e-300) / one)) for size, one in zip(sizes, own, strict=True)]
    swapped = [float(np.log10(max(size, 1e-300) / one)) for size, one in zip(sizes, own[::-1], strict=True)]
    seen = (
        f"points up to {sizes[0]:.4g} N/m and {sizes[1]:.4g} N s/m, the file's own chart up to {own[0]:.4g} N/m "
        f"and {own[1]:.4g} N s/m"
    )
    if max(map(abs, off)) > FAR_OFF and max(map(abs, swapped)) < NEAR:
        return Check("columns", False, f"{seen}: the columns seem swapped; name them the other way")
    for name, unit, power in zip(("stiffness", "damping"), ("N", "N s"), off, strict=True):
        if THOUSAND[0] < -power < THOUSAND[1]:
            text = f"{seen}: the {name} looks like {unit}/mm; multiply it by 1000"
            return Check("units", False, text)
        if THOUSAND[0] < power < THOUSAND[1]:
            text = f"{seen}: the {name} looks a thousand times too large; give it in {unit}/m"
            return Check("units", False, text)
    return Check("units", True, seen)


def check_circumstances(points: BoundaryPoints, simulated: bool) -> list[Check]:
    """Whether all points were measured in the same way: a warning for each circumstance that was not.

    simulated  the points are compared with trials, and each with one of its own force, time and amplitude
    """
    checks = list[Check]()
    circumstances = points.circumstances | {"amplitude_m": points.visible}
    circumstances.pop("beyond", None)
    for name, values in circumstances.items():
        if values.dtype.kind == "U":
            kinds = sorted({str(value) for value in values if value})
        else:
            kinds = [f"{value:g}{UNITS.get(name, '')}" for value in np.unique(values[np.isfinite(values)])]
        if len(kinds) > 1 and simulated and name in UNITS:
            text = f"differs between the points, and each is simulated with its own: {comma_list(kinds, 6)}"
            checks.append(Check(name, True, text))
        elif len(kinds) > 1:
            text = (
                f"differs between the points: {comma_list(kinds, 6)}; one boundary is fitted to all of them, so "
                "give the points of each in a file of their own"
            )
            checks.append(Check(name, False, text, warning=True))
        elif kinds:
            checks.append(Check(name, True, f"{kinds[0]} in all points that say it"))
    return checks
