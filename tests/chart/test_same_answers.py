"""The numbers of charts of loops of every kind: in a table, alone, and computed apart by plain NumPy.

Motions that no wall moves are left out of charts but not of eigenvalues: of loops with them regions and decays are
not compared.

A loop of which the table says DOUBTFUL is answered alone; its numbers are known to its corners' blur. Where double
precision does not give the second route 1e-9, it is repeated with numbers of ninety digits (`apart.ExactLoop`).

The full size, 20 000 loops, is run by hand, some 12 minutes on one core; regions and decay of every tenth:

    ZWIDTH_FULL_STUDY=1 python -m pytest -m slow -s tests/chart/test_same_answers.py
"""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import replace

import mpmath
import numpy as np
import pytest
import shapely

from tests.apart import ApartLoop, ExactLoop, curve_area, loop_of_every_kind, straight_area
from zwidth.chart import ALL_NUMBERS, Tracer, stability_chart
from zwidth.chart.arcs import MINUS, PAIR, PLUS
from zwidth.chart.chart_batch import DECAY, chart_numbers
from zwidth.chart.decay import fastest_decay
from zwidth.chart.edge_memory import DOUBTFUL, FOUND
from zwidth.errors import ChartError, UnmovedError
from zwidth.loop import table_of_loops

SEED = 20262
TOLERANCE = 1e-9  # relative, of largest stiffness, largest damping and area
BLURRED = 1e-5  # the same of a loop in doubt, whose corners are known to 1e-7 of the set's size and more
# Area of the difference of regions over the length of their outlines, in shares of the extent: what chords are off
REGIONS = 1e-6
OVER = 1e-8  # how far a curve is drawn on across the line on which it ends, as a share of the window
# Of the spectral radius at the fastest wall, by how many roots meet there: the wall's rounding to that power
MULTIPLE = {1: 1e-9, 2: 1e-6, 3: 1e-4}
MOST_MULTIPLE = 3e-3
# Loops of SEED that are beyond their tolerance, by the reason.
# A motion named as unobserved moves the numbers by more than UNMOVED.
UNOBSERVED = {
    630,
    1131,
    1896,
    2197,
    2287,
    4917,
    6133,
    6934,
    7198,
    7299,
    10835,
    12113,
    14492,
    15656,
    18715,
    19847,
}
# Answered alone: beyond the corners' blur, or slivers of 1e-8 of the region's size.
IN_DOUBT = {
    39,
    2744,
    3265,
    3652,
    4020,
    7501,
    7819,
    7966,
    8156,
    8883,
    12185,
    13085,
    13717,
    15818,
}
# A region whose stiffness or area is rounding of nothing beside the plant's own.
NOTHING = {
    11664,
    12987,
    16036,
    19443,
}
# The fastest decay, by 1e-6 to 1e-5 of the radius.
DECAY_DIGITS = {
    850,
    2240,
    9360,
    13470,
}
# Dampers couple the modes: numbers are off by up to 1e-7, 18072 by 1e-3 at a thin tip.
DIGITS_OF_ROWS = {
    1644,
    1660,
    2196,
    2235,
    3307,
    4454,
    5533,
    6013,
    6675,
    6820,
    7244,
    9093,
    9430,
    9890,
    10479,
    12581,
    12617,
    13665,
    14332,
    15512,
    16473,
    16676,
    16710,
    18072,
    19440,
    19874,
}
KNOWN = frozenset(UNOBSERVED | IN_DOUBT | NOTHING | DECAY_DIGITS | DIGITS_OF_ROWS)
PANELS = 4
EVERY = 10  # of how many loops one has its regions and its decay compared
DIGITS = (
    4.0  # how many last digits of the plant's numbers a chart may be off, where they move it by more than that
)
MOST_SPREAD = 1e-3  # more is another wall
UNMOVED = 1e-8  # tolerance of charts that leave out motions which the wall hardly moves


def table_chunks(seed, first, last, size=500):
    """Numbers of loops, the loops themselves and their table, in chunks; those that no wall moves left out."""
    for start in range(first, last, size):
        numbers, loops = [], []
        for number in range(start, min(start + size, last)):
            loop = loop_of_every_kind(seed, number)
            try:
                loop.table  # noqa: B018
            except UnmovedError:
                continue
            numbers.append(number)
            loops.append(loop)
        yield numbers, loops, table_of_loops(*loops)


def area_apart(apart, arcs, panels=1):
    """Area within K > 0, B > 0 of rings of arcs, by Gauss's rule along curves computed apart.

    panels  into how many each interval of an arc is divided
    """
    total = 0.0
    for ring in arcs.rings:
        each = [arcs[k] for k in ring]
        walk = []  # pieces: their first and last wall, and the integral along them
        for arc in each:
            if arc.kind == PAIR:
                angles = arc.angles
                at = np.arange((len(angles) - 1) * panels + 1) / panels
                fine = np.interp(at, np.arange(len(angles)), angles)
                ends = [apart.end_wall(angles[i], abs(angles[j] - angles[i])) for i, j in ((0, 1), (-1, -2))]
                walk.append((*ends, curve_area(apart, fine)))
                continue
            ends = [arc.first, arc.last]
            if arc.kind == PLUS:
                ends = [(apart.plus, B) for _, B in ends]
            elif arc.kind == MINUS:
                w, h = apart.minus
                ends = [(h - w * B, B) for _, B in ends]
            walk.append((*ends, straight_area(*ends[0], *ends[1])))
        for (_, last, integral), (first, _, _) in zip(walk, walk[1:] + walk[:1], strict=True):
            total += integral + straight_area(*last, *first)
    return total


def find(equations, start, exact):
    """Zero of one or two functions of as many angles, by secants or Newton's method."""
    digits = 40 if exact else 16
    with mpmath.workdps(digits + (10 if exact else 0)):
        if len(start) == 1:
            one, step = mpmath.mpf(start[0]), mpmath.mpf(10) ** -(digits // 2)
            x, last = one * (1 + 1e-7), one
            f, f_last = equations(x)[0], equations(last)[0]
            for _ in range(60):
                if f == f_last or abs(x - last) <= mpmath.mpf(10) ** (1 - digits) * abs(x):
                    break
                last, x, f_last = x, x - f * (x - last) / (f - f_last), f
                f = equations(x)[0]
            return [x]
        x = [mpmath.mpf(s) for s in start]
        step = mpmath.mpf(10) ** -(digits // 2 - 1)
        best, least = x, None
        for _ in range(12):
            f = equations(*x)
            size = sum(abs(v) for v in f)
            if least is not None and size >= least:
                break
            best, least = x, size
            columns = []
            for k in range(2):
                h = x[k] * step
                moved = list(x)
                moved[k] += h
                columns.append([(a - b) / h for a, b in zip(equations(*moved), f, strict=True)])
            (a, c), (b, d) = columns
            det = a * d - b * c
            if det == 0:
                break
            x = [x[0] - (f[0] * d - f[1] * b) / det, x[1] - (a * f[1] - c * f[0]) / det]
        return best


def wall_function(apart):
    """K and B at one angle, and K, w and h of the lines of real roots."""
    if not isinstance(apart, ExactLoop):
        w, h = apart.minus
        return lambda theta: tuple(x[0] for x in apart.walls(float(theta))), apart.plus, w, h
    with mpmath.workdps(50):
        P, w = apart.exact_terms(mpmath.mpf(-2))
        h = -1 / P if P else mpmath.inf
        return apart.exact_wall, apart.exact_plus, mpmath.re(w), mpmath.re(h)


def stiffest_apart(apart, angles, damping):
    """K and B of the stiffest wall near those angles: a corner, a crossing of B = 0, or a smooth maximum of K."""
    wall, plus, w, h = wall_function(apart)
    exact = isinstance(apart, ExactLoop)
    inner = [float(t) for t in angles if 1e-12 < t < np.pi - 1e-12]
    ends = [float(t) for t in angles if not 1e-12 < t < np.pi - 1e-12]
    with mpmath.workdps(50 if exact else 16):
        if len(inner) == 2:
            scale = [abs(x) for x in wall(inner[0])]

            def corner(one, other):
                return [(a - b) / s for a, b, s in zip(wall(one), wall(other), scale, strict=True)]

            return tuple(float(x) for x in wall(find(corner, inner, exact)[0]))
        if inner and ends and ends[0] > 1.0:
            at = find(lambda t: [wall(t)[0] + wall(t)[1] * w - h], inner, exact)[0]
        elif inner and ends:
            at = find(lambda t: [wall(t)[0] - plus], inner, exact)[0]
        elif inner and damping == 0.0:
            at = find(lambda t: [wall(t)[1]], inner, exact)[0]
        elif inner:
            at = inner[0]
        elif len(set(ends)) == 1 and damping > 0.0:  # a double root: the curve ends there
            return apart.end_wall(ends[0], 0.01)
        else:
            K = plus if 0.0 in [round(t) for t in ends] else h
            return float(K), float((h - K) / w if len(set(ends)) == 2 else damping)
        return tuple(float(x) for x in wall(at))


def dampings_apart(apart, arcs, scale):
    """Dampings at which the edge meets K = 0, near what its arcs say.

    scale  largest |K| on the edge
    """
    wall, _, w, h = wall_function(apart)
    exact = isinstance(apart, ExactLoop)
    near = []
    for k in arcs.curved:
        arc = arcs[k]
        angles, K = arc.angles, np.concatenate([[arc.first[0]], apart_stiffness(apart, arc), [arc.last[0]]])
        cuts = np.flatnonzero(K[:-1] * K[1:] < 0.0)
        share = K[cuts] / (K[cuts] - K[cuts + 1])
        near += (angles[cuts] + share * (angles[cuts + 1] - angles[cuts])).tolist()
        near += [t for t, (x, _) in ((arc.start, arc.first), (arc.end, arc.last)) if abs(x) <= 1e-8 * scale]
    found = [0.0]
    with mpmath.workdps(50 if exact else 16):
        if w:
            found.append(float(h / w))
        for t in near:
            if 1e-9 < t < np.pi - 1e-9:
                try:
                    found.append(float(wall(find(lambda x: [wall(x)[0]], [t], exact)[0])[1]))
                except (ZeroDivisionError, ValueError):
                    continue
            else:
                arc = min((arcs[k] for k in arcs.curved), key=lambda a: min(abs(a.start - t), abs(a.end - t)))
                step = abs(arc.angles[1] - arc.angles[0] if arc.start == t else arc.angles[-1] - arc.angles[-2])
                found.append(apart.end_wall(t, step)[1])
    return np.array(found)


def apart_stiffness(apart, arc):
    """K at the angles that found an arc."""
    return apart.guide.walls(arc.thetas)[0] if len(arc.thetas) else np.empty(0)


def relative(one, other):
    """Difference of two numbers as a share of the second."""
    return abs(one - other) / abs(other) if other else abs(one)


def best_of(attempts, reference, tolerance):
    """The smallest relative difference of attempts, up to the first good one, and which that was."""
    least, used = np.inf, 0
    for number, attempt in enumerate(attempts):
        used = number
        try:
            least = min(least, relative(attempt(), reference))
        except (ZeroDivisionError, ValueError, RuntimeError, OverflowError):
            continue
        if least <= 0.5 * tolerance:
            break
    return least, used


def compare_numbers(chart, loop, record, tolerance_of):
    """The numbers of a chart against those computed apart, as relative differences."""
    arcs, apart, exact = chart.edge.arcs, ApartLoop(loop), ExactLoop(loop)
    out = {}
    peak = chart.edge.peak
    if peak is not None:
        routes = [lambda one=one: stiffest_apart(one, peak.angles, peak.damping)[0] for one in (apart, exact)]
        out["stiffness"], again = best_of(routes, peak.stiffness, tolerance_of("stiffness"))
        record["stiffness: many digits"] += again
    if chart.stable_area > 0.0:
        found = []

        def area(one, panels):
            found.append(area_apart(one, arcs, panels))
            return found[-1]

        routes = [
            lambda: area(apart, 1),
            lambda: area(apart, PANELS),
            lambda: area(exact, 1 if relative(*found[:2]) < 0.1 * TOLERANCE else 2),
        ]
        out["area"], again = best_of(routes, chart.stable_area, tolerance_of("area"))
        record["area: many digits"] += again > 1
    scale = max((float(np.abs(ring[:, 0]).max()) for ring in chart.edge.traced.outlines), default=0.0)
    if chart.damping_max > TOLERANCE * scale * loop.period:  # less is rounding of nothing
        D = chart.damping_max

        def nearest(one):
            return min(dampings_apart(one, arcs, scale), key=lambda B: abs(B - D))

        routes = [lambda one=one: nearest(one) for one in (apart, exact)]
        out["damping"], again = best_of(routes, D, tolerance_of("damping"))
        record["damping: many digits"] += again
    return out


def stiffer_walls(chart, loop):
    """How far inside the circle the roots of a wall stiffer by 1e-6 than the stiffest are: 0 for none such."""
    K, B, apart = chart.stiffness_max * (1.0 + 1e-6), chart.damping_at_stiffness_max, ApartLoop(loop)
    most = max(float(np.abs(ring[:, 1]).max()) for ring in chart.edge.traced.outlines)
    beside = most * np.geomspace(1e-8, 1.2, 30)
    row = np.concatenate([[B], B - beside, B + beside])
    row = row[row >= 0.0]
    roots = apart.roots(np.full(len(row), K), row)
    radii = np.abs(roots).max(axis=1)
    best = int(np.argmin(radii))
    if radii[best] >= 1.0 - TOLERANCE:
        return 0.0
    near = roots[best][np.abs(roots[best]) > 1.0 - 1e-3]
    return max(0.0, -ExactLoop(loop).radius(K, row[best], near))


def across_ends(walls, lines):
    """A curve (k, 2) drawn on a little across the lines on which it ends at 0 and pi.

    lines  two walls (2, 2) of each
    """
    ends = []
    for beside, (one, other) in ((walls[0], lines[0]), (walls[-1], lines[-1])):
        normal = np.array([-1.0, 1.0]) * (other - one)[::-1] / np.hypot(*(other - one))
        away = float(normal @ (beside - one))
        over = beside - (away + np.copysign(OVER, away)) * normal
        ends.append(over[None] if abs(away) < 1e-3 else np.empty((0, 2)))
    return np.vstack([ends[0], walls, ends[1]])


def regions_apart(apart, window, angles):
    """The stable faces between all pieces of the curve and both lines of real roots within a window, as shares of
    its sides, and the faces of which eigenvalues cannot tell.

    window  K and B of its lower corner and its sides
    angles  in (0, pi), ascending, besides those round the poles of the plant
    """
    low, side = window
    poles = np.abs(np.angle(1.0 + np.diag(apart.sampled[0])))
    around = np.concatenate([[0.0], np.geomspace(1e-12, 0.3, 120)])
    grid = [np.geomspace(1e-6, np.pi, 1500)[:-1], np.linspace(0.0, np.pi, 1500)[1:-1], angles]
    grid += [(poles[:, None] + sign * around * np.maximum(poles[:, None], 1e-3)).ravel() for sign in (-1.0, 1.0)]
    thetas = np.unique(np.concatenate(grid))
    K, B = apart.walls(thetas[(thetas > 1e-6) & (thetas < np.pi - 1e-6)])
    walls = (np.column_stack([K, B]) - low) / side
    lines = [((apart.plus, low[1] - side[1]), (apart.plus, low[1] + 2.0 * side[1]))]
    (w, h), minus = apart.minus, []
    if np.isfinite(w) and np.isfinite(h):
        steep = abs(w) * side[1] <= side[0]
        for start in (low - side, low + 2.0 * side):
            minus.append((h - w * start[1], start[1]) if steep else (start[0], (h - start[0]) / w))
        lines.append(tuple(minus))
    straight = (np.array(lines) - low) / side
    walls = across_ends(walls[np.isfinite(walls).all(axis=1)], straight)
    beyond = (np.abs(walls - 0.5) > 0.5).any(axis=1)
    kept = ~(beyond[:-1] & beyond[1:])
    pieces = np.stack([walls[:-1], walls[1:]], axis=1)[kept]
    # ends far outside would blur the crossings
    pieces = np.where(beyond[:-1][kept][:, None, None], pieces[:, ::-1], pieces)
    step = pieces[:, 1] - pieces[:, 0]
    pieces[:, 1] = pieces[:, 0] + step * np.minimum(1.0, 3.0 / np.maximum(np.hypot(*step.T), 1e-300))[:, None]
    straight = straight[(np.abs(straight) < 10.0).all(axis=(1, 2))]
    frame = shapely.box(0.0, 0.0, 1.0, 1.0)
    every = shapely.MultiLineString([*pieces, *straight])
    cut = shapely.unary_union([shapely.intersection(every, frame), frame.exterior])
    faces = np.array(shapely.get_parts(shapely.polygonize([cut])))
    faces = faces[shapely.area(faces) > 1e-10]
    inside = shapely.get_coordinates(shapely.point_on_surface(faces)) * side + low
    radius = apart.radii(*inside.T)
    sure = np.abs(radius - 1.0) > 1e-8
    return shapely.unary_union(faces[(radius < 1.0) & sure]), shapely.unary_union(faces[~sure])


def blurred_share(what, chart):
    """The tolerance of a number of a loop in doubt: what a corner's blur, a share of the set's size, is of it."""
    every = np.abs(np.vstack([np.zeros((1, 2)), *chart.edge.traced.outlines])).max(axis=0)
    size, value = {
        "stiffness": (every[0], chart.stiffness_max),
        "damping": (every[1], chart.damping_max),
        "area": (every[0] * every[1], chart.stable_area),
    }[what]
    return max(BLURRED, 4.0 * chart.corner_blur * float(size) / value)


def last_digits(loop, rng):
    """The loop with its plant's numbers changed by one in their last digit."""
    changed = {}
    for name in ("mass", "damping", "stiffness"):
        signs = np.triu(rng.choice([-1.0, 1.0], (loop.plant.size, loop.plant.size)))
        changed[name] = getattr(loop.plant, name) * (1.0 + 2.0**-52 * (signs + np.triu(signs, 1).T))
    return replace(loop, plant=replace(loop.plant, **changed))


def spread_by_last_digits(what, chart, loop):
    """How far a number computed apart moves, as a share, with the last digits of the plant's numbers."""
    rng, arcs, peak, values = np.random.default_rng(0), chart.edge.arcs, chart.edge.peak, []
    scale = max(float(np.abs(ring[:, 0]).max()) for ring in chart.edge.traced.outlines)
    for _ in range(6):
        apart = ApartLoop(last_digits(loop, rng))
        if what == "stiffness":
            values.append(stiffest_apart(apart, peak.angles, peak.damping)[0])
        elif what == "area":
            values.append(area_apart(apart, arcs, PANELS))
        else:
            values.append(min(dampings_apart(apart, arcs, scale), key=lambda B: abs(B - chart.damping_max)))
    middle = abs(float(np.median(values)))
    spread = float(np.ptp(values)) / middle if middle > 0.0 else np.inf
    return spread if spread < MOST_SPREAD else 0.0


def compare_regions(chart, loop):
    """Area of the difference of a chart's regions and those computed apart over the length of their outlines, both
    in shares of the regions' extent."""
    if not chart.regions:
        return 0.0
    apart = ApartLoop(loop)
    every = np.vstack(chart.regions)
    low, high = every.min(axis=0), every.max(axis=0)
    side = 2.0 * (high - low)
    low = low - 0.25 * side
    angles = np.concatenate([arc.frequency * 2.0 * np.pi * loop.period for arc in chart.boundary])
    found, hidden = regions_apart(apart, (low, side), angles)
    cells = [shapely.Polygon((ring - low) / side) for ring in chart.regions]
    ours = shapely.unary_union([shapely.make_valid(cell) for cell in cells])
    parts = shapely.get_parts(shapely.difference(shapely.symmetric_difference(found, ours), hidden))
    parts = parts[shapely.area(parts) > 0.0]
    if not len(parts):
        return 0.0
    # a face of the second route that has leaked through its outline is noticed by eigenvalues
    middle = shapely.point_on_surface(parts)
    radius = apart.radii(*(shapely.get_coordinates(middle) * side + low).T)
    ours_right = ((radius < 1.0) == shapely.contains(ours, middle)) & (np.abs(radius - 1.0) > 1e-8)
    return 2.0 * float(np.sum(shapely.area(parts[~ours_right]))) / ours.length


def compare_decay(numbers, i, loop, alone):
    """The fastest decay of loop i against that of the loop alone and eigenvalues.

    Returns  [(what, difference, tolerance)] and how many roots meet there
    """
    K, B, radius = numbers.fastest[i].tolist()
    apart = ApartLoop(loop)
    roots = apart.roots(np.array([K]), np.array([B]))[0]
    largest = np.abs(roots).max()
    near = roots[np.abs(roots) > largest - 1e-2 * (1.0 - largest) - 1e-6]
    # as many as meet in one place, or its conjugate
    together = max(int(np.sum(np.abs(near - z) < 0.05 * (1.0 - largest) + 1e-3)) for z in near)
    beside = 1.0 + 2.0**-52 * np.array([[2, 0], [-2, 0], [0, 2], [0, -2], [2, 2], [-2, -2], [2, -2], [-2, 2]])
    spread = float(np.ptp(apart.radii(*(beside * [K, B]).T)))
    tolerance = max(MULTIPLE.get(together, MOST_MULTIPLE), DIGITS * spread)
    faults = [("decay: eigenvalues", abs(largest - radius), tolerance)]
    if alone is not None:
        faults.append(("decay: alone", abs(alone.spectral_radius - radius), tolerance))
    return faults, together


def compare_loops(seed, first, last, regions_every=1, decay_every=1):
    """Loops from first to last - 1: what is found, the largest differences and what is beyond its tolerance."""
    record, worst, wrong = Counter(), Counter(), []

    def keep(number, what, difference, tolerance):
        record[what] += 1
        worst[what] = max(worst[what], float(difference))
        if not difference <= tolerance:
            wrong.append((seed, number, what, float(difference)))

    for chunk, loops, table in table_chunks(seed, first, last):
        numbers = chart_numbers(table, ALL_NUMBERS)
        for i, (number, loop) in enumerate(zip(chunk, loops, strict=True)):
            record["loops"] += 1
            in_doubt = numbers.status[i] == DOUBTFUL
            try:
                chart = stability_chart(loop, decay=False)
            except ChartError:
                record["given up"] += 1
                if not in_doubt:
                    wrong.append((seed, number, "given up alone, not in the table", np.nan))
                continue
            name = "doubtful, " if in_doubt else "unobserved motions, " if chart.unobserved_modes else ""
            record[name + "charts"] += 1
            if not in_doubt:
                if (numbers.status[i] == FOUND) != (chart.edge.peak is not None):
                    wrong.append((seed, number, "status", np.nan))
                elif numbers.status[i] == FOUND:
                    keep(
                        number, "alone: stiffness", relative(numbers.stiffness[i], chart.stiffness_max), TOLERANCE
                    )
                keep(number, "alone: damping", relative(numbers.largest_damping[i], chart.damping_max), TOLERANCE)
                keep(number, "alone: area", relative(numbers.area[i], chart.stable_area), TOLERANCE)

            def tolerance_of(what, chart=chart, in_doubt=in_doubt):
                if in_doubt:
                    return blurred_share(what, chart)
                return UNMOVED if chart.unobserved_modes else TOLERANCE

            for what, difference in compare_numbers(chart, loop, record, tolerance_of).items():
                tolerance = tolerance_of(what)
                if difference > tolerance:
                    spread = DIGITS * spread_by_last_digits(what, chart, loop)
                    if difference <= spread:
                        keep(number, f"{name}apart: {what}, as the plant's last digits allow", difference, spread)
                        continue
                keep(number, f"{name}apart: {what}", difference, tolerance)
            if chart.edge.peak is not None and not in_doubt:
                keep(number, "apart: stiffer walls", stiffer_walls(chart, loop), TOLERANCE)
            if chart.unobserved_modes:
                record["with unobserved motions"] += 1
            elif number % regions_every == 0:
                keep(number, f"{name}apart: regions", compare_regions(chart, loop), REGIONS)
        if decay_every:
            some = [
                i for i, number in enumerate(chunk) if number % decay_every == 0 and not loops[i].unobserved_modes
            ]
            if not some:
                continue
            numbers = chart_numbers(table_of_loops(*(loops[i] for i in some)), DECAY)
            for k, i in enumerate(some):
                record["decays"] += 1
                if numbers.decay_status[k] != FOUND:
                    record["decays, doubtful or none"] += 1
                    continue
                alone = fastest_decay(Tracer(loops[i]), list) if k % 10 == 0 else None
                faults, together = compare_decay(numbers, k, loops[i], alone)
                for what, difference, tolerance in faults:
                    keep(chunk[i], f"{what}, {together} roots", difference, tolerance)
    return record, worst, wrong


def test_numbers_in_a_table_alone_and_apart_are_the_same():
    record, _, wrong = compare_loops(SEED + 1, 0, 24, regions_every=3, decay_every=3)
    assert wrong == []
    assert record["charts"] > 20


@pytest.mark.slow
def test_numbers_of_thousands_of_loops_in_a_table_alone_and_apart_are_the_same():
    full = os.environ.get("ZWIDTH_FULL_STUDY") == "1"
    record, worst, wrong = compare_loops(SEED, 0, 20_000 if full else 1000, EVERY, EVERY)
    print(dict(record), dict(worst), *wrong, sep="\n")
    assert [one for one in wrong if one[1] not in KNOWN] == []
