"""The boundary of a measured loop as directed segments, and one wall's roots counted by Nyquist's criterion.

How many roots of the loop lie outside the unit circle, counted by crossings of the boundary curve.

As a wall (K, B) moves through the plane, a root passes the circle only where the wall crosses the boundary. There

    1 + P(z)(K + B w(z)) = 0   and   d|z|/|z| = -Im w (K' dB - B' dK) / |K' + B' w|^2

(primes are derivatives with respect to theta): left of the curve in the sense of rising theta a pair has gone
inside where Im w > 0, and outside where Im w < 0 (Neimark's rule). On the lines of real roots one root passes.
So the number of roots outside is that of one reference wall and the jumps met on the straight way from it.
No polynomial and no eigenvalue is needed: only the curve, measured or computed, however long the delay.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Complexes, Floats, Ints
from zwidth.chart.arcs import Window
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.compiled import compiled
from zwidth.errors import ResponseError

NEAREST = 1e-5  # to an end of the curve or an asymptote, of the spacing there
FAR = 1e9  # how far lines are drawn, in `large_wall_scale`
COARSE = 0.02  # distance of a coarse chord from the curve, in shares of the curve's distance from K = B = 0
CLEAR = 0.2  # least |1 + L| / (1 + |L|) of a wall that is clear of the boundary
LIKELY, SURE = 28, 7  # numbers of walls: counted at every angle; the clearest, whose counts must agree
SOME_ANGLES = 1500  # at which all walls are counted, before the likely ones at every angle
AT_ONCE = 30_000  # walls times angles: 0.5 MB, which a cache holds; in one piece they take twice as long
MOST = 200_000  # angles on the curve


@dataclass(frozen=True)
class Boundary:
    """Every wall with a root on the circle, as far as it was measured.

    angles       (n,) theta along the curve, ascending;  walls (n, 2) K, B;  orientation (n,) sign of Im w
    segments     (k, 4) and jumps (k,): curve, real-root lines and what closes an open end, for `roots_outside`
    angle_index  (k,) index of the angle where a segment begins; -1, -2: lines of z = 1, z = -1; -3: beyond the
                 data
    reference, reference_count  a wall far from the boundary and the number of its roots outside the circle
    """

    angles: Floats
    walls: Floats
    orientation: Floats
    segments: Floats
    jumps: Ints
    angle_index: Ints
    reference: Floats
    reference_count: int

    def outside(self, walls: Floats) -> Ints:
        """How many roots each of walls (n, 2) [K, B] has outside the unit circle: (n,)."""
        return roots_outside(
            self.segments, self.jumps, self.reference, self.reference_count, np.ascontiguousarray(walls)
        )


def first_measured_angles(loop: MeasuredLoop) -> Floats:
    """The measured angles, three between each two, and angles that close in on 0, asymptotes and, where the
    response is taken on to it, pi."""
    measured = loop.angles_below_pi
    shares = np.arange(4) / 4.0
    inner = (measured[:-1, None] + np.diff(measured)[:, None] * shares).ravel()
    closing = np.geomspace(NEAREST, 0.9, 30)
    parts = [closing * measured[0], inner, measured[-1:]]
    if loop.interpolation.closed:
        parts.append(np.pi - closing[::-1] * (np.pi - measured[-1]))
    angles = np.unique(np.concatenate(parts))
    # among these it is seen where Im w changes sign
    dense = np.union1d(angles, np.linspace(angles[0], loop.largest_angle, 4097)[:-1])
    for low, high in _brackets_of_real_estimate(loop, dense):
        # up to a thousandth of the asymptote's angle away from it on both sides
        steps = closing * (high - low + 1e-3 * high)
        angles = np.concatenate([angles, low - steps, high + steps])
    angles = np.unique(angles)
    return angles[(angles > 0.0) & (angles < np.pi) & (angles <= loop.largest_angle)]


def _brackets_of_real_estimate(loop: MeasuredLoop, angles: Floats) -> list[tuple[float, float]]:
    """Brackets, closed to rounding, of the angles where Im w = 0: there the curve passes through infinity."""
    positive = loop.w(angles).imag > 0.0
    at = np.flatnonzero(positive[1:] != positive[:-1])
    low, high = angles[at], angles[at + 1]
    for _ in range(50):
        middle = 0.5 * (low + high)
        same = (loop.w(middle).imag > 0.0) == positive[at]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return list(zip(low.tolist(), high.tolist(), strict=True))


def refine_angles(loop: MeasuredLoop, angles: Floats, box: Window, tolerance: float) -> Floats:
    """Angles at which chords within the box follow the curve to a tolerance, in shares of the box."""
    K0, K1, B0, B1 = box
    scale, low = np.array([K1 - K0, B1 - B0]), np.array([K0, B0])

    def scales(theta: Floats) -> Floats:
        """Width and height of the box (n, 2), the unit of K and of B at every angle (n,)."""
        return np.broadcast_to(scale, (len(theta), 2))

    def tolerances(a: Floats, b: Floats, middle: Floats) -> Floats:
        """Allowed distances (n,) of chords from a to b (n, 2): inf where a chord misses the box, here [0, 1]^2."""
        touches = np.all((np.maximum(a, b) >= 0.0) & (np.minimum(a, b) <= 1.0), axis=1)
        return np.where(touches, tolerance, np.inf)

    return _bisect_chords(loop, angles, low, scales, tolerances)


def coarse_angles(loop: MeasuredLoop) -> Floats:
    """Angles at which chords follow the whole curve, within a share COARSE of its distance from K = B = 0."""

    def scales(theta: Floats) -> Floats:
        """Sizes of K and of B that count at each angle: (n, 2) at angles (n,)."""
        return wall_scales(loop, theta)

    def tolerances(a: Floats, b: Floats, middle: Floats) -> Floats:
        """Allowed distances (n,) of chords: a share of their middles' distance from K = B = 0."""
        return np.asarray(COARSE * np.hypot(*middle.T))

    return _bisect_chords(loop, first_measured_angles(loop), np.zeros(2), scales, tolerances)


def _bisect_chords(
    loop: MeasuredLoop,
    angles: Floats,
    low: Floats,
    scales: Callable[[Floats], Floats],
    tolerances: Callable[[Floats, Floats, Floats], Floats],
) -> Floats:
    """The angles, and middles between them added until each chord passes its middle on the curve closely enough,
    or MOST are reached. No chord leads past an asymptote or to a wall beyond FAR.

    scales      function of angles (n,): what counts as one unit of K and of B there (n, 2)
    tolerances  function of both ends and the middle of chords, (n, 2) each, in (walls - low) / scale: the
                distances allowed (n,)
    """
    for _ in range(40):
        K, B, orientation = loop.walls(angles)
        points = np.column_stack([K, B]) - low
        near = np.all(np.abs(points) < FAR * scales(angles), axis=1)
        joined = (orientation[:-1] == orientation[1:]) & near[:-1] & near[1:]
        at = np.flatnonzero(joined & (np.diff(angles) > 1e-13 * angles[1:]))
        middle = 0.5 * (angles[at] + angles[at + 1])
        Km, Bm, _ = loop.walls(middle)
        scale = scales(middle)
        # middle m on the curve and ends a, b of each chord, scaled; off: distance of m from the chord; reach: its
        # foot's share of the chord
        m = (np.column_stack([Km, Bm]) - low) / scale
        a, b = points[at] / scale, points[at + 1] / scale
        along, to = b - a, m - a
        length = np.maximum(np.hypot(*along.T), 1e-150)
        off = np.abs(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]) / length
        reach = np.einsum("ij,ij->i", to, along) / length**2
        allowed = tolerances(a, b, m)
        # too far from the chord; or beside its line, but more than a tenth of its length beyond its ends, if the
        # chord is not so short that this does not matter
        bent = (off > allowed) | ((np.abs(reach - 0.5) > 0.6) & np.isfinite(allowed) & (length > 1e-3 * allowed))
        if not np.any(bent) or len(angles) > MOST:
            break
        angles = np.sort(np.concatenate([angles, middle[bent]]))
    return angles


def wall_scales(loop: MeasuredLoop, theta: Floats) -> Floats:
    """|h| and |h / w| (n, 2) at angles (n,): the sizes of K and of B that count there, since K + B w = h.

    Inf where the velocity estimate is blind: no damping matters there.
    """
    h, w = np.abs(loop.h(theta)), np.abs(loop.w(theta))
    with np.errstate(divide="ignore"):
        return np.column_stack([h, h / w])


def large_wall_scale(loop: MeasuredLoop) -> Floats:
    """Sizes (2,) of a large K and B: |h| and |h / w| that only a tenth of the measured frequencies exceed."""
    return np.asarray(np.quantile(wall_scales(loop, loop.angles_below_pi), 0.9, axis=0))


def sample_boundary(loop: MeasuredLoop, angles: Floats, reference_boundary: Boundary | None = None) -> Boundary:
    """The boundary sampled at these angles.

    Reference wall and count are those of `reference_boundary`, where it is given.
    """
    K, B, orientation = loop.walls(angles)
    segments, jumps = curve_segments(K, B, orientation)
    whole = np.isfinite(K) & np.isfinite(B)
    # `angle_index` of the curve, joined as in `curve_segments`; then what ends it on both sides
    at = np.flatnonzero(whole[:-1] & whole[1:] & (orientation[:-1] == orientation[1:]))
    far = FAR * float(large_wall_scale(loop)[1])
    more = [_real_line(loop, angles[0], -1, far)]
    more.append(
        _real_line(loop, angles[-1], -2, far) if loop.interpolation.closed else _open_end(segments, jumps, far)
    )
    segments = np.vstack([segments, *(s for s, _, _ in more)])
    jumps = np.concatenate([jumps, *(j for _, j, _ in more)])
    at = np.concatenate([at, *(k for _, _, k in more)])
    walls = np.column_stack([K, B])
    if reference_boundary is not None:
        return Boundary(
            angles,
            walls,
            orientation,
            segments,
            jumps,
            at,
            reference_boundary.reference,
            reference_boundary.reference_count,
        )
    return _with_reference(loop, Boundary(angles, walls, orientation, segments, jumps, at, np.zeros(2), 0))


def measured_real_root(loop: MeasuredLoop, kind: int) -> tuple[float, float]:
    """h and w of the line K + B w = h of real roots at z = 1 (kind -1) or -1 (kind -2); h is inf without one."""
    if kind == -1:
        near = np.array([NEAREST * loop.angles[0]])
        h = 0.0 if loop.integrators else float(loop.h(near)[0].real)
        # w of an estimate that is 0 at z = 1 is about i theta / T beside it
        return h, 0.0 if abs(loop.w(near)[0]) * loop.period < 2.0 * near[0] else float(loop.w(near)[0].real)
    end = np.array([np.pi])
    at_end = complex(loop.h(end)[0])
    return at_end.real if np.isfinite(at_end) else np.inf, float(loop.w(end)[0].real)


def _real_line(loop: MeasuredLoop, near: float, kind: int, far: float) -> tuple[Floats, Ints, Ints]:
    """The line of real roots, as segments, jumps and angle indices of `Boundary`, cut where the curve ends on it:
    there the count's jump changes its sign.

    On it D = K + B w - h = 0. The root moves by -dK / D', and D' (z = +-1) has the sign of -+(B Im w - Im h)
    at an angle just beside.

    near  that angle, the curve's first or last;  far  how far the line is drawn in B
    kind  as for `measured_real_root`; nothing is returned (of length 0) where there is no such line
    """
    h, w = measured_real_root(loop, kind)
    if not np.isfinite(h):
        return np.empty((0, 4)), np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    theta = np.array([near])
    Im_h, Im_w = float(loop.h(theta)[0].imag), float(loop.w(theta)[0].imag)
    # a velocity estimate may be blind there, to the last digit on some processors
    cut = float(np.clip(Im_h / Im_w, -far, far)) if Im_w else float(np.copysign(far, Im_h))
    # both from the cut outwards: seen from the far end, rounding would hide on which side a wall lies
    ends = np.unique([-far, far])
    ends = ends[ends != cut]
    rising = np.sign((0.5 * (cut + ends)) * Im_w - Im_h) * np.sign(ends - cut)
    jumps = (rising if kind == -1 else -rising).astype(np.int64)
    start = np.full(len(ends), cut)
    segments = np.column_stack([h - start * w, start, h - ends * w, ends])
    return segments, jumps, np.full(len(jumps), kind)


def _open_end(segments: Floats, jumps: Ints, far: float) -> tuple[Floats, Ints, Ints]:
    """The curve continued straight to infinity where the data end, as segments, jumps and angle indices of
    `Boundary`: higher frequencies are not seen."""
    Ka, Ba, Kb, Bb = segments[-1]
    reach = far / max(abs(Kb - Ka), abs(Bb - Ba))
    onward = [[Kb, Bb, Kb + reach * (Kb - Ka), Bb + reach * (Bb - Ba)]]
    return np.array(onward), jumps[-1:], np.array([-3])


def nyquist_count(loop: MeasuredLoop, angles: Floats, walls: Floats) -> tuple[Ints, Floats]:
    """Roots outside the circle at walls (n, 2) by the turning of 1 + L, L = P (K + B w), and how clear each is.

    From z = 1 + 0 round the integrators (a turn of L by -pi/2 each) and along the upper half circle, 1 + L turns
    by -pi times the number of roots outside. Assumed: no open-loop pole outside, none on the circle but the
    integrators.

    Returns  (n,) counts, and the least |1 + L| / (1 + |L|) along the way (n,): near 0 the count is not sure
    """
    h, w = measured_real_root(loop, -1)
    # sign of 1 + L at z = 1, but for the integrators, and `start`, its phase
    static = np.sign(walls[:, 0]) if loop.integrators else np.sign(1.0 - (walls[:, 0] + walls[:, 1] * w) / h)
    start = np.where(static > 0.0, 0.0, np.pi)
    turn, clear, last = np.empty(len(walls)), np.empty(len(walls)), np.empty(len(walls), dtype=np.complex128)
    for some, L in _open_loops(loop, angles, walls):
        F = 1.0 + L
        clear[some] = np.min(np.abs(F) / (1.0 + np.abs(L)), axis=1)
        first = np.angle(F[:, 0] * np.exp(-1j * (start[some] - 0.5 * np.pi * loop.integrators)))
        turn[some] = first - 0.5 * np.pi * loop.integrators + np.sum(np.angle(F[:, 1:] / F[:, :-1]), axis=1)
        last[some] = F[:, -1]
    if loop.interpolation.closed:
        h, w = measured_real_root(loop, -2)
        end = 1.0 - (walls[:, 0] + walls[:, 1] * w) / h
        turn += np.angle(end / last)
    else:
        turn -= np.angle(last)  # beyond the data |L| < 1 is assumed
    return -np.round(turn / np.pi).astype(np.int64), clear


def clearness(loop: MeasuredLoop, angles: Floats, walls: Floats) -> Floats:
    """The least |1 + L| / (1 + |L|) at these angles of walls (n, 2), as in `nyquist_count`."""
    clear = np.empty(len(walls))
    for some, L in _open_loops(loop, angles, walls):
        clear[some] = np.min(np.abs(1.0 + L) / (1.0 + np.abs(L)), axis=1)
    return clear


def _open_loops(loop: MeasuredLoop, angles: Floats, walls: Floats) -> Iterator[tuple[slice, Complexes]]:
    """L = P (K + B w) at n angles of m walls at a time, (m, n), and which walls these are."""
    w, h = loop.w(angles), loop.h(angles)
    at_once = max(1, AT_ONCE // len(angles))
    for first in range(0, len(walls), at_once):
        some = slice(first, first + at_once)
        yield some, -(walls[some, :1] + walls[some, 1:] * w) / h


def _clear_walls(loop: MeasuredLoop, angles: Floats, walls: Floats) -> tuple[Floats, Floats, Ints, Floats]:
    """The clearest of walls (n, 2), and the smallest clear ones, counted at every angle.

    All are counted at some angles first. Between those a sharp resonance may turn 1 + L, so that a wall is at most
    as clear as it seems there: smaller walls than those chosen are not clear for certain.

    Returns  the walls (k, 2), their sizes (k,) relative to the smallest, their counts and how clear each is
    """
    size = np.max(walls / np.min(walls, axis=0), axis=1)
    seeming = clearness(loop, angles[:: max(1, len(angles) // SOME_ANGLES)], walls)
    # from the clearest on; and of those that seem clear from the smallest on
    order = np.argsort(-seeming)
    smallest = np.argsort(np.where(seeming > CLEAR, size, np.inf), kind="stable")[: np.sum(seeming > CLEAR)]
    chosen = np.union1d(order[:LIKELY], smallest[:SURE])
    counts, clear = nyquist_count(loop, angles, walls[chosen])
    # more of the smallest, until enough of them are clear at every angle
    tried = SURE
    while tried < len(smallest) and np.sum(clear[np.isin(chosen, smallest[:tried])] > CLEAR) < SURE:
        more = np.setdiff1d(smallest[tried : 2 * tried], chosen)
        more_counts, more_clear = nyquist_count(loop, angles, walls[more])
        chosen, tried = np.concatenate([chosen, more]), 2 * tried
        counts, clear = np.concatenate([counts, more_counts]), np.concatenate([clear, more_clear])
    return walls[chosen], size[chosen], counts, clear


def _with_reference(loop: MeasuredLoop, curve: Boundary) -> Boundary:
    """The boundary with a reference wall: the smallest of many walls that are clear of the boundary.

    A small one, since on the way from a wall many powers of ten beyond the stable ones their digits are lost; the
    clearest one where the data end early. The counts of the clearest walls must agree with it.

    Raises  ResponseError  where most of them do not, or where its own count is below 0
    """
    h, w = np.abs(loop.h(loop.angles_below_pi)), np.abs(loop.w(loop.angles_below_pi))
    # walls of all sizes that the response has, but where the data end early of the larger ones
    sizes = np.geomspace(1e-3, 3.0, 9)
    shares = [0.0, 0.05, 0.25, 0.5, 0.75] if loop.interpolation.closed else [0.25, 0.5, 0.75]
    K = np.quantile(h, shares)[:, None] * sizes
    B = np.quantile(h / w, shares)[:, None] * sizes
    walls = np.array([(k, b) for k in K.ravel() for b in B.ravel()])
    walls, size, counts, clear = _clear_walls(loop, curve.angles, walls)
    order = np.argsort(-clear)[:SURE]
    least = min(CLEAR, clear[order[0]]) if loop.interpolation.closed else clear[order[0]]
    enough = np.flatnonzero(clear >= least)
    best = enough[np.argmin(size[enough])]
    result = Boundary(
        curve.angles,
        curve.walls,
        curve.orientation,
        curve.segments,
        curve.jumps,
        curve.angle_index,
        walls[best],
        int(counts[best]),
    )
    sure = order[clear[order] > CLEAR]
    if counts[best] < 0 or 2 * np.count_nonzero(result.outside(walls[sure]) != counts[sure]) > len(sure):
        raise ResponseError(
            "does not turn as that of a device would: counts of unstable roots disagree; is it a response from "
            "force to position with all its frequencies, closely enough spaced, and is `integrators` right?"
        )
    return result


def curve_segments(K: Floats, B: Floats, orientation: Floats) -> tuple[Floats, Ints]:
    """A sampled boundary curve as directed segments (k, 4) of K, B, K, B and their jumps (k,).

    K, B         (n,) walls at ascending angles
    orientation  (n,) sign of Im w there; the curve is cut between samples where it differs, or where a wall is not
                 finite: there the curve passes through infinity
    Returns      a jump is the number of roots outside left of a segment less that on its right

    >>> K, B = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.5])
    >>> segments, jumps = curve_segments(K, B, np.array([1, 1, -1]))
    >>> segments.tolist(), jumps.tolist()
    ([[0.0, 0.0, 1.0, 1.0]], [-2])
    """
    whole = np.isfinite(K) & np.isfinite(B)
    joined = whole[:-1] & whole[1:] & (orientation[:-1] == orientation[1:])
    segments = np.column_stack([K[:-1], B[:-1], K[1:], B[1:]])[joined]
    return segments, np.where(orientation[:-1][joined] > 0, -2, 2).astype(np.int64)


@compiled
def roots_outside(segments: Floats, jumps: Ints, reference: Floats, count: int, walls: Floats) -> Ints:
    """Numbers (n,) of roots outside the circle of walls (n, 2).

    segments   (k, 4) the boundary as directed segments: the curve (`curve_segments`) and the lines of real roots
    jumps      (k,) roots outside on the left of each segment less those on its right
    reference  (2,) a wall off the boundary with `count` roots outside

    >>> square = np.array([[0.0, 0, 1, 0], [1, 0, 1, 1], [1, 1, 0, 1], [0, 1, 0, 0]])
    >>> jumps = np.full(4, -2)
    >>> roots_outside(square, jumps, np.array([2.0, 2.0]), 2, np.array([[0.5, 0.4], [0.5, -1.0]])).tolist()
    [0, 2]
    """
    out = np.empty(len(walls), dtype=np.int64)
    x0, y0 = reference[0], reference[1]
    for n in range(len(walls)):
        dx, dy = walls[n, 0] - x0, walls[n, 1] - y0
        total = count
        for k in range(len(segments)):
            ax, ay = segments[k, 0] - x0, segments[k, 1] - y0
            bx, by = segments[k, 2] - x0, segments[k, 3] - y0
            first, last = dx * ay - dy * ax, dx * by - dy * bx
            if (first > 0.0) == (last > 0.0):  # both ends on one side of the way from the reference to the wall
                continue
            sx, sy = bx - ax, by - ay
            # where the way meets the segment, along / whole is its share
            along, whole = ax * sy - ay * sx, dx * sy - dy * sx
            if whole < 0.0:
                along, whole = -along, -whole
            if 0.0 <= along < whole:
                # a segment that runs from right to left of the way is crossed from its left to its right
                total += -jumps[k] if last > 0.0 else jumps[k]
        out[n] = total
    return out
