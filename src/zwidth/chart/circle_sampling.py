"""Where the curve of walls is sampled on a circle: the nearer a singularity, the denser.

K(theta) and B(theta) are analytic except at zeros of P (where -1/P has a pole), poles of the velocity estimate and
points where the estimate is in phase with the position. A function varies on the scale of its distance to the
nearest singularity, so that a step of a fixed share of that distance follows every loop, however lightly damped
the mode that makes it. Poles of P are added: near them the curve passes the origin, where branches meet.

Samples are t = tan(theta/2). A step of theta by a is t -> (t + h)/(1 - t h), h = tan(a/2), and the distance of
z = rho exp(i theta) to a point z_k = rho (1 + s_k)/(1 - s_k) is

    |z - z_k| = 2 rho |i t - s_k| / (|1 - s_k| sqrt(1 + t^2))
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Complexes, Floats, Ints
from zwidth.chart.curve import NO_LINE, OF_B, OF_K, zero_between
from zwidth.chart.loop_polynomials import SPARE, ZEROS, LoopPolynomials
from zwidth.chart.roots import divide, find_roots, real_root, spread_roots
from zwidth.compiled import compiled, compiled_apart, compiled_lean
from zwidth.loop.loop_table import (
    FORCE,
    SECTIONS,
    VELOCITY,
    WINDOW,
    CircleFactors,
    half_angle,
    velocity_on_circle,
    wall_on_circle,
)

# A point on the circle itself would ask for infinitely many samples. Nearer than this share of its distance to the
# next point the curve is at infinity or at the origin.
NEAREST: Final = 1e-3
LEAST_STEP: Final = 1e-11
# Where samples of a whole chart begin and end, in shares of the distance of the nearest point there.
NEAR_END: Final = 1e-3
MOST_SAMPLES: Final = 20000
# Crossings of an axis about which samples are added, and how many on each side.
MOST_CROSSINGS, CROSSING_SAMPLES = 64, 10
# Angles at which a velocity estimate is searched for places where it is in phase with the position.
PHASES, PHASES_PER_SAMPLE = 200, 20


class Features(NamedTuple):
    """Singular points of a curve; memory for so many.

    points  (p,)    s, Im s >= 0
    z       (p,)    the same as z/rho
    scales  (2, p)  4 rho^2/|1 - s|^2, and the square of the least distance that counts
    active  (4, p)  Re s, Im s and both scales of the points near the circle; working memory
    roots   (N,)    working memory for zeros
    counts  (2,)    points in use; of them those of the computer, which come first
    """

    points: Complexes
    z: Complexes
    scales: Floats
    active: Floats
    roots: Complexes
    counts: Ints


def feature_memory(most: int, window: int) -> Features:
    """Memory for loops of at most this degree, and estimates of at most so many past samples."""
    size = 3 * most + 8 + PHASES + PHASES_PER_SAMPLE * window
    points = np.zeros(size, dtype=np.complex128)
    return Features(
        points, points.copy(), np.zeros((2, size)), np.zeros((4, size)), points.copy(), np.zeros(2, dtype=np.int64)
    )


@compiled_lean
def _add_point(out: Features, re: float, im: float) -> None:
    """Add the singular point s = re + i im unless it lies below the real axis, is z = infinity, or is too many."""
    n = out.counts[0]
    if im < -1e-12 or n >= len(out.points) or not np.isfinite(re + im):
        return
    if abs(re - 1.0) + abs(im) < 1e-6:
        return
    out.points[n] = complex(re, im)
    out.counts[0] = n + 1


@compiled_lean
def _add_roots_of_quadratic(out: Features, a0: float, a1: float, a2: float) -> None:
    """Add the roots of a0 + a1 s + a2 s^2, which may be of lower degree."""
    if abs(a2) <= 1e-300:
        if a1 != 0.0:
            _add_point(out, -a0 / a1, 0.0)
        return
    mean = -0.5 * a1 / a2
    gap = mean * mean - a0 / a2
    if gap < 0.0:
        _add_point(out, mean, np.sqrt(-gap))
        return
    # the root without cancellation, and the other from the product a0 / a2
    large = mean - np.sqrt(gap) if mean <= 0.0 else mean + np.sqrt(gap)
    _add_point(out, large, 0.0)
    _add_point(out, a0 / (a2 * large) if large != 0.0 else 0.0, 0.0)


@compiled_lean
def _add_roots_of_polynomial(out: Features, p: Floats) -> None:
    """Add the roots of a polynomial in ascending powers of s; more than three to a thousandth of their size."""
    n = len(p) - 1
    if n > 3:
        spread_roots(out.roots[:n])
        find_roots(p, out.roots[:n], 1e-3)
        for k in range(n):
            _add_point(out, out.roots[k].real, out.roots[k].imag)
        return
    a0, a1, a2 = p[0], p[1] if n > 0 else 0.0, p[2] if n > 1 else 0.0
    if n == 3:
        root = real_root(p)
        _add_point(out, root, 0.0)
        # the other two: p divided by s - root, from the end at which no digits are lost
        if abs(root) < 1.0:
            a2, a1 = p[3], p[2] + p[3] * root
            a0 = p[1] + a1 * root
        else:
            a0 = -p[0] / root
            a1, a2 = (a0 - p[1]) / root, p[3]
    _add_roots_of_quadratic(out, a0, a1, a2)


@compiled_apart
def fill_computer_features(f: CircleFactors, out: Features) -> None:
    """Put into `out` the singular points that come from filters and velocity estimate, whatever the plant."""
    out.counts[0] = 0
    # rows of factors: order, numerator (3), denominator (3)
    for k in range(f.sizes[FORCE]):
        _add_roots_of_quadratic(out, f.force[k, 1], f.force[k, 2], f.force[k, 3])
        _add_roots_of_quadratic(out, f.force[k, 4], f.force[k, 5], f.force[k, 6])
    for k in range(f.sizes[VELOCITY]):
        _add_roots_of_quadratic(out, f.velocity[k, 4], f.velocity[k, 5], f.velocity[k, 6])
    # a single factor of first order is nowhere in phase: Im w is a multiple of sin theta
    if f.sizes[WINDOW] > 1 or f.sizes[VELOCITY] > 1 or (f.sizes[VELOCITY] == 1 and f.velocity[0, 0] != 1.0):
        count = PHASES + PHASES_PER_SAMPLE * f.sizes[WINDOW]
        before, before_t = 0.0, 0.0
        for k in range(1, count - 1):
            t = np.tan(0.5 * np.pi * k / (count - 1))
            cc, ss, sc = half_angle(t)
            across = velocity_on_circle(f, cc, ss, sc)[0].imag  # of the sign of Im w: w is real where it changes
            if before * across < 0.0:
                _add_point(out, 0.0, before_t + before / (before - across) * (t - before_t))
            before, before_t = across, t
    out.counts[1] = out.counts[0]


@compiled_apart
def fill_features(f: CircleFactors, polynomials: LoopPolynomials, out: Features) -> None:
    """Add to `out`, which has the computer's singular points, the plant's: poles and zeros of P."""
    out.counts[0] = out.counts[1]
    for k in range(f.sizes[SECTIONS]):  # the sections' denominators
        _add_roots_of_quadratic(out, f.plant[k, 0], f.plant[k, 1], f.plant[k, 2])
    top, bottom, zeros = polynomials.degrees[ZEROS], 0, polynomials.parts[ZEROS]
    while top > 0 and abs(zeros[top]) <= 1e-300:
        top -= 1
    while bottom < top and abs(zeros[bottom]) <= 1e-300:
        bottom += 1
    if bottom > 0:
        _add_point(out, 0.0, 0.0)
    # P's numerator divided by its power of s, and by s - 1: one root is s = 1 (z infinite), where a sampled plant
    # has no direct passage
    rest = polynomials.parts[SPARE]
    rest[top] = zeros[top]
    for k in range(top - 1, bottom, -1):
        rest[k] = rest[k + 1] + zeros[k]
    _add_roots_of_polynomial(out, rest[bottom + 1 : top + 1])
    _fill_distances(f.radius[0], out)


@compiled_lean
def _fill_distances(radius: float, out: Features) -> None:
    """Fill in z / rho of each singular point, and `scales`: of squared distances on the circle to the points, and
    the square of the least that counts, NEAREST of a point's distance to the nearest other one, z = rho
    (theta = 0) among these."""
    n = out.counts[0]
    for k in range(n):
        s = out.points[k]
        over = 1.0 / ((1.0 - s.real) ** 2 + s.imag * s.imag)
        out.scales[0, k] = 4.0 * radius * radius * over
        # z = (1 + s)/(1 - s), the quotient written out
        out.z[k] = complex((1.0 - s.real * s.real - s.imag * s.imag) * over, 2.0 * s.imag * over)
    for k in range(n):
        z = out.z[k]
        apart = (z.real - 1.0) ** 2 + z.imag * z.imag
        if apart <= 1e-24:  # the point is z = rho itself
            apart = 1.0
        for j in range(n):
            dx, dy = z.real - out.z[j].real, z.imag - out.z[j].imag
            near = dx * dx + dy * dy
            if near > 1e-24:
                apart = min(apart, near)
        out.scales[1, k] = (NEAREST * radius) ** 2 * apart


@compiled_apart
def fill_samples(
    features: Features, radius: float, share: float, longest: float, near_end: float, out: Floats
) -> int:
    """Samples t whose steps of theta are `share` of the distance to the nearest point, and at most `longest`.

    radius    rho of the circle
    near_end  how near to the ends 0 and pi to begin and end, in shares of the distance of the nearest point there
    Returns   their number; the length of `out` where that is too short
    """
    first, last, n, m = 1.0, 1.0, features.counts[0], 0
    active = features.active
    for k in range(n):
        z = features.z[k]
        from_one = radius * np.sqrt((z.real - 1.0) ** 2 + z.imag * z.imag)
        from_minus_one = radius * np.sqrt((z.real + 1.0) ** 2 + z.imag * z.imag)
        # a point at z = +-rho itself is no feature: the curve is even about its ends
        if from_one > 1e-9:
            first = min(first, from_one)
        if from_minus_one > 1e-9:
            last = min(last, from_minus_one)
        # a point farther from the circle than the longest step asks for is felt nowhere on it
        from_circle = radius * abs(np.sqrt(z.real * z.real + z.imag * z.imag) - 1.0)
        if from_circle * share < longest and from_one > 1e-9 and from_minus_one > 1e-9:
            active[0, m], active[1, m] = features.points[k].real, features.points[k].imag
            active[2, m], active[3, m] = features.scales[0, k], features.scales[1, k]
            m += 1
    # an angle theta near 0 is t = theta/2, one near pi is t = 2/(pi - theta)
    t, end, count = 0.5 * near_end * first, 2.0 / (near_end * last), 0
    while t < end and count < len(out):
        out[count] = t
        count += 1
        cc = 1.0 / (1.0 + t * t)
        near = 4.0 * cc * min(1.0, t * t)  # square of the distance to the nearer of z = rho and z = -rho, rho 1
        for k in range(m):
            x, y = active[0, k], active[1, k] - t
            away = max((x * x + y * y) * active[2, k] * cc, active[3, k])
            near = away if away < near else near
        h = 0.5 * min(share * max(np.sqrt(near), LEAST_STEP), longest)
        t = (t + h) / (1.0 - t * h)
        if t < 0.0:  # past theta = pi
            break
        # the next step as if all of this one led towards the point: half as many distances are computed
        if t < end and count < len(out):
            out[count] = t
            count += 1
            h *= 1.0 - share
            t = (t + h) / (1.0 - t * h)
            if t < 0.0:
                break
    return count


@compiled
def samples_of_loop(
    circle: CircleFactors, polynomials: LoopPolynomials, found: Features, share: float, longest: float, out: Floats
) -> int:
    """`fill_samples` of a single loop; its singular points go into `found`."""
    fill_computer_features(circle, found)
    fill_features(circle, polynomials, found)
    return fill_samples(found, circle.radius[0], share, longest, NEAR_END, out)


def sample_angles(points: Complexes, share: float, longest: float) -> Floats:
    """Angles in (0, pi) of samples of the unit circle for a curve whose singular points z (p,) are given."""
    t = np.empty(MOST_SAMPLES)
    count = _samples_beside_points(points, feature_memory(len(points), 0), share, longest, t)
    return np.asarray(2.0 * np.arctan(t[:count]))


@compiled
def _samples_beside_points(points: Complexes, found: Features, share: float, longest: float, out: Floats) -> int:
    """`fill_samples` on the unit circle for given points z, which go into `found`."""
    for z in points:
        s = divide(z - 1.0, z + 1.0)
        _add_point(found, s.real, s.imag)
    _fill_distances(1.0, found)
    return fill_samples(found, 1.0, share, longest, NEAR_END, out)


@compiled_lean
def add_samples_around_crossings(circle: CircleFactors, count: int, t: Floats) -> int:
    """Add samples to the first `count` of t where a branch crosses an axis (K = 0 or B = 0) between two of them,
    geometrically about the crossing, in their order, for MOST_CROSSINGS at most. Returns the new number, or len(t)
    where that is too short.

    Where the velocity estimate is all but blind (far above a filter's cutoff), B runs from one end of the plane to
    the other within a sliver of angle. Every such branch crosses an axis.
    """
    n, added = count, 0
    K0, B0 = wall_on_circle(circle, t[0])
    for i in range(count - 1):
        K1, B1 = wall_on_circle(circle, t[i + 1])
        for of, before, after in ((OF_K, K0, K1), (OF_B, B0, B1)):
            if before * after < 0.0 and added < MOST_CROSSINGS:
                if n + 2 * CROSSING_SAMPLES > len(t):
                    return len(t)
                added += 1
                centre = zero_between(circle, of, NO_LINE, t[i], t[i + 1])
                offset = t[i + 1] - t[i]
                for _ in range(CROSSING_SAMPLES):
                    offset *= 0.1
                    for beside in (centre - offset, centre + offset):
                        if t[i] < beside < t[i + 1]:
                            t[n] = beside
                            n += 1
        K0, B0 = K1, B1
    for k in range(count, n):  # few, and nearly in order
        sample, i = t[k], k
        while i > 0 and t[i - 1] > sample:
            t[i] = t[i - 1]
            i -= 1
        t[i] = sample
    return n
