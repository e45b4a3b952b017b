"""Checks of a measured boundary before numbers are fitted to it: enough points, plausible, of one kind.

After the fit: whether another sampling period than the device file's explains it better (`check_file_period`), and
whether the fitted boundary explains it, or only comes as near to it as it can (`check_explained`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats
from zwidth.chart.edge_crossings import EdgeChords
from zwidth.device.faults import comma_list, plural
from zwidth.errors import DeviceError
from zwidth.identify.boundary.fit import BoundaryFit, fit_boundary, log_likelihood, measured_ranges
from zwidth.identify.boundary.model import BoundaryModel, Scatter
from zwidth.identify.boundary.parameters import BoundaryParameters
from zwidth.identify.boundary.points import EDGE, LOWER, STABLE, TIP, UNSTABLE, UPPER, BoundaryPoints
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
    """The points that have a stiffness and a damping, each once, and warnings of those left out."""
    whole = np.isfinite(points.stiffness) & np.isfinite(points.damping)
    checks = list[Check]()
    if not whole.all():
        rows = [records[points.record[i]].place(int(points.row[i])) for i in np.flatnonzero(~whole)]
        listed = comma_list(rows, MOST_NAMED)
        text = f"{plural(len(rows), 'row')} without a stiffness or a damping left out: {listed}"
        checks.append(Check("rows", False, text, warning=True))
    kept = points[whole]
    copies = _repeats_earlier(kept)
    if copies.any():
        rows = [records[kept.record[i]].place(int(kept.row[i])) for i in np.flatnonzero(copies)]
        text = (
            f"{plural(len(rows), 'row repeats', 'rows repeat')} another to the last digit and count once: "
            f"{comma_list(rows, MOST_NAMED)}; record each trial as it was measured"
        )
        checks.append(Check("copies", False, text, warning=True))
    return kept[~copies], checks


def _repeats_earlier(points: BoundaryPoints) -> Flags:
    """Which points (n,) are an earlier one again, in all numbers and words."""
    seen, repeats = set[tuple[object, ...]](), np.zeros(len(points), dtype=bool)
    for i in range(len(points)):
        numbers = (points.stiffness, points.damping, points.frequency, points.low, points.high, points.trials)
        numbers_and_words = (
            *(float(one[i]) for one in numbers),
            *(str(v[i]) for v in points.circumstances.values()),
        )
        key = (str(points.kind[i]), *(None if x != x else x for x in numbers_and_words))
        repeats[i] = key in seen
        seen.add(key)
    return repeats


def check_points(points: BoundaryPoints, count: int) -> list[Check]:
    """Check that there are enough points for `count` numbers, spread over the boundary."""
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
    """Check that stiffness and damping are of the size that the device's own chart, its edge, has."""
    edges = points[points.on_edge]
    if not len(edge):
        return Check("units", True, "the device as the file has it renders no stable wall to compare with")
    _, K, _, B = edge.box  # the largest of the edge
    sizes = [float(np.max(np.abs(values))) for values in (edges.stiffness, edges.damping)]
    own = [max(abs(K), 1e-300), max(abs(B), 1e-300)]
    # powers of ten between points and chart, as the columns are named, and if they are swapped
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
    """Whether all points were measured in the same way: a check of each circumstance that any of them says, a
    warning where it differs and is not simulated.

    simulated  the points are compared with trials, and each with one of its own force, time and amplitude
    """
    checks = list[Check]()
    circumstances = points.circumstances | {"amplitude_m": points.visible}
    circumstances.pop("beyond", None)  # what happened beyond the edge is no circumstance
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


PERIOD: Final = "loop.sampling_period_s"
BY_CHANCE: Final = 1e-4  # probability below which a better fit is not by scatter
SAME_PERIOD: Final = 0.01  # relative difference of the periods below which nothing is said
OFF: Final = 0.1  # relative difference of the periods that is a fault of the file in any case


def check_file_period(model: BoundaryModel, fit: BoundaryFit) -> list[Check]:
    """Whether the points are explained much better by a sampling period other than the file's; [] where they are
    not, where the period is fitted already, and where it cannot be freed.

    The fit is repeated with the period as a further number. With n points, p numbers before, and D the drop of
    minus twice the log-likelihood, (exp(D / n) - 1) (n - p - 1) has Fisher's distribution with 1 and n - p - 1
    degrees of freedom if the file is right.

    How often, with up to 24 points on random devices of two masses, scatter of 0.1-2 %, and the delay fitted: of
    60 periods 30 % too long 51 were refused (D 21 to 180), 9 not even warned of (D 1.9 to 17); of 110 right ones
    none.
    """
    from scipy.stats import f

    given = fit.parameters
    paths = given.numbers.paths
    if PERIOD in paths or given.point.response is not None:
        return []
    before, count, _ = log_likelihood(model, fit)
    freedom = count - len(fit.vector) - 1
    if freedom < 1:
        return []
    try:
        wider = BoundaryParameters.of(given.device, given.point, [*paths, PERIOD], given.damping)
        start = np.insert(fit.vector, len(paths), wider.start[len(paths)])
        freed = BoundaryModel(model.points, wider.edge)
        found = fit_boundary(freed, wider, start=start, profiled=False)
    except (DeviceError, ValueError, ArithmeticError, np.linalg.LinAlgError):
        return []  # no chart, or no period but the file's is allowed
    drop = before - log_likelihood(freed, found)[0]
    chance = float(f.sf(np.expm1(max(drop, 0.0) / count) * freedom, 1, freedom))
    own, better = (float(wider.values(vector)[len(paths)]) for vector in (start, found.vector))
    if chance > BY_CHANCE or abs(better / own - 1.0) < SAME_PERIOD:
        return []
    text = (
        f"{better:.4g} s explains the points better than the {own:.4g} s of the file, by {drop:.3g} in twice the "
        "log-likelihood"
    )
    if abs(better / own - 1.0) > OFF:
        text += (
            f": correct {PERIOD}; if it is right, another number that is held fixed is not (delay, filter, "
            "masses, posture)"
        )
        return [Check("sampling period", False, text)]
    text += f": is {PERIOD} right? Else another number that is held fixed is a little wrong"
    return [Check("sampling period", False, text, warning=True)]


SYSTEMATIC: Final = 1e-3  # probability of scatter below which what remains is called systematic
PERMUTATIONS: Final = 4000  # orders of the points that it is compared with
LEAST_POINTS: Final = 8  # from which an order can be seen
LEAST_REPEATED: Final = 3  # degrees of freedom of repeated points, from which their own scatter counts
HALF: Final = 0.5  # share of the spread below which nothing is explained
MOST: Final = 0.9  # the same where what remains is systematic
EXACT: Final = 1e-6  # of the largest value: what remains below it is the rounding of charts and no pattern
GROSS: Final = 0.05  # of the largest value: what remains is small in any case if it is below
LOST: Final = 0.25  # share of points beyond any stable set, or of tried walls on the wrong side, that is too many
WRONG: Final = 3.0  # standard deviations on the wrong side of the edge, from which on a tried wall contradicts it


def explained_share_of_points(values: Floats, kinds: NDArray[np.str_], deviations: Floats, units: Floats) -> float:
    """Share of the points' spread that is explained: 1 - sum (deviation / unit)^2 / sum (value - mean)^2 / unit^2,
    the mean over the points of a kind; nan where they have no spread.

    values, kinds      (n,) of the points: what was bisected, and `BoundaryPoints.kind`
    deviations, units  (n,) from the fitted edge, and what they are measured in, such as the scatter
    """
    own = [((values - values[kinds == kind].mean()) / units)[kinds == kind] for kind in np.unique(kinds)]
    spread = sum(float(np.sum(one**2)) for one in own)
    return 1.0 - float(np.sum((deviations / units) ** 2)) / spread if spread > 0.0 else float("nan")


def share_of_points(points: BoundaryPoints, fit_deviations: Floats, scatter: Scatter) -> float:
    """`explained_share_of_points` of the points on the boundary, by what was bisected; by the damping where the
    edge is not known.

    fit_deviations  (n,) `Deviations.value`
    """
    edges = points[points.on_edge]
    units = np.where(edges.kind == TIP, scatter.stiffness, scatter.damping)
    deviations = np.where(edges.kind == EDGE, fit_deviations * scatter.damping, fit_deviations)
    return explained_share_of_points(edges.bisected, edges.kind, deviations, units)


def check_explained(model: BoundaryModel, fit: BoundaryFit) -> Check:
    """Whether what remains is scatter. It is not where it follows a pattern along the edges, where it is larger
    than repeated points scatter, or where points lie beyond any stable wall or on the wrong side.

    How often, with up to 24 points on random devices of two masses, scatter of 0.1-2 %, and the delay fitted:
    of 113 right models none was refused or warned of (below 2.7 % with 95 % confidence); of 22 with both masses
    wrong by factors of 1.3 to 2 all were refused, of 22 that were other devices 21, and one was warned of. A wrong
    sampling period, which a different delay makes up for in part, is looked for by `check_file_period`.
    """
    points, deviations = model.points, fit.deviations
    edges = points[points.on_edge]
    units = model.units(fit.scatter)
    share = share_of_points(points, deviations.value, fit.scatter)
    reach = measured_ranges(points)
    largest = np.where(edges.kind == TIP, np.max(edges.stiffness), np.max(np.abs(edges.damping)))
    sizes = np.where(edges.kind == EDGE, deviations.value * fit.scatter.damping, deviations.value)  # N/m, N s/m
    remains = float(np.sqrt(np.mean((sizes / np.maximum(largest, 1e-300)) ** 2)))
    # of an exact fit rounding remains, whose pattern means nothing
    faults, chance = list[str](), 1.0 if remains < EXACT else _chance_of_pattern(edges, deviations.value / units)
    if chance < SYSTEMATIC:
        faults.append("what remains follows a pattern along the edges instead of scattering")
    if (repeated := _chance_of_repeats(edges, deviations.value / units)) is not None and repeated < SYSTEMATIC:
        chance = min(chance, repeated)
        faults.append("what remains is larger than repeated points scatter")
    lost = int(np.sum(deviations.missing))
    if lost:
        faults.append(f"{lost} of {len(edges)} points lie beyond any stable wall")
    depths = model.depths(fit.vector, fit.scatter)
    wrong = int(np.sum(depths < -WRONG))
    if wrong:
        faults.append(f"{wrong} of {len(depths)} tried walls lie on the wrong side of the edge")
    seen = (
        f"{100.0 * share:.3g} % of the spread is explained; {fit.scatter.damping:.3g} N s/m "
        f"({100.0 * fit.scatter.damping / reach.damping:.2g} % of the measured range) remain along damping"
    )
    if faults:
        seen += f"; {comma_list(faults)}"
    gross = remains > GROSS and (share < HALF or (chance < SYSTEMATIC and share < MOST))
    # a single tried wall on the wrong side refuses nothing
    if gross or lost > LOST * len(edges) or wrong > max(LOST * len(depths), 1.0):
        text = (
            f"{seen}: no value of the numbers that were named explains this boundary; look at what is held fixed "
            "(sampling period, delay, filter, posture, operator), or name further numbers"
        )
        return Check("explained", False, text)
    if chance < SYSTEMATIC or lost or wrong:
        text = f"{seen}: the model lacks something, which the numbers take up; their intervals are too narrow"
        return Check("explained", False, text, warning=True)
    return Check("explained", True, seen)


def _chance_of_pattern(edges: BoundaryPoints, normalised: Floats) -> float:
    """Probability that scatter alone is as smooth along the edges, or as far off on a whole edge, as what remains;
    1 where there are too few points.

    normalised  (n,) deviations of the points over their scatter

    Compared is the sum of the squared steps between neighbours on an edge (von Neumann's ratio), over random
    orders of the points of each edge. The orders are the same in every run.
    """
    if len(edges) < LEAST_POINTS:
        return 1.0
    order = np.lexsort((edges.chosen, edges.kind))
    kinds, r = edges.kind[order], normalised[order]
    same = kinds[1:] == kinds[:-1]
    random = np.random.default_rng(0)
    shuffled = np.tile(r, (PERMUTATIONS, 1))
    for kind in np.unique(kinds):
        shuffled[:, kinds == kind] = random.permuted(shuffled[:, kinds == kind], axis=1)
    steps = np.sum(np.where(same, np.diff(shuffled, axis=1), 0.0) ** 2, axis=1)
    own_steps = float(np.sum(np.where(same, np.diff(r), 0.0) ** 2))
    # an offset of a whole edge is a pattern, too, and no order shows it
    offsets = [_chance_of_mean(r[kinds == kind]) for kind in np.unique(kinds)]
    smooth = (1.0 + float(np.sum(steps <= own_steps * (1.0 + 1e-12)))) / (1.0 + PERMUTATIONS)
    return min(smooth, *[one * len(offsets) for one in offsets])  # times their number, as the least is taken


def _chance_of_mean(values: Floats) -> float:
    """Probability that scatter alone gives `values` (n,) so large a mean (Student's test); 1 for fewer than
    five."""
    from scipy.stats import t

    if len(values) < 5:
        return 1.0
    deviation = float(np.std(values, ddof=1))
    if deviation == 0.0:
        return 1.0
    return float(2.0 * t.sf(abs(float(np.mean(values))) / deviation * np.sqrt(len(values)), len(values) - 1))


def _chance_of_repeats(edges: BoundaryPoints, normalised: Floats) -> float | None:
    """Probability that the means of repeated points deviate as much by the scatter of the repetitions alone
    (Fisher's test); None where too few were repeated, or the repetitions are all equal.

    normalised  (n,) deviations of the points over their scatter
    """
    from scipy.stats import f

    keys = [(str(kind), float(at)) for kind, at in zip(edges.kind, edges.chosen, strict=True) if kind != EDGE]
    groups: dict[tuple[str, float], list[float]] = {}
    known_edges = normalised[edges.kind != EDGE]
    for key, r in zip(keys, known_edges.tolist(), strict=True):
        groups.setdefault(key, []).append(r)
    within = sum(float(np.sum((np.array(g) - np.mean(g)) ** 2)) for g in groups.values())
    freedom = len(known_edges) - len(groups)
    between = sum(len(g) * float(np.mean(g)) ** 2 for g in groups.values())
    if freedom < LEAST_REPEATED or within == 0.0:
        return None
    ratio = (between / len(groups)) / (within / freedom)
    return float(f.sf(ratio, len(groups), freedom))
