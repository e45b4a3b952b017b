"""Angles at which the curve of walls is sampled: the nearer a singularity, the denser.

K(theta) and B(theta) are analytic except at zeros of P (where -1/P has a pole), poles of the velocity estimate
and points where the estimate is in phase with the position. A function varies on the scale of its distance to
the nearest singularity, so a step of a fixed fraction of that distance follows every loop, however lightly
damped the mode that makes it. Poles of P are added: near them the curve passes the origin, where branches meet.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.curve import OF_B, OF_K, on_circle, wall_at, zero_between
from zwidth.compiled import compiled, compiled_lean
from zwidth.loop.factor_kernels import Factors, plant_numerator, velocity_response

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# A point on the circle itself would ask for infinitely many samples. Nearer than this share of its distance to
# the next point the curve is at infinity or at the origin, and below this share of the lowest feature's angle it
# is the smooth end at theta = 0.
NEAREST = 1e-3
FIRST = 1e-3
LONGEST_STEP = 0.05
MOST_ANGLES = 20000


def singular_points(factors: Factors, radius: float) -> Complexes:
    """Points z, Im z >= 0: poles and zeros of P without its delay, poles of w, real w on the circle."""
    s = _roots(plant_numerator(factors, radius))
    with np.errstate(divide="ignore", invalid="ignore"):
        zeros = radius * (1.0 + s) / (1.0 - s)
    points = np.concatenate([1.0 + _pairs(factors.rows[:, 0], factors.rows[:, 1]), zeros[np.isfinite(zeros)]])
    return np.concatenate([points[points.imag >= -1e-12], computer_points(factors, radius)])


def computer_points(factors: Factors, radius: float) -> Complexes:
    """Those of the singular points that come from filters and velocity estimate, whatever the plant."""
    points = np.concatenate(
        [
            _factor_roots(factors.force_denominator),
            _factor_roots(factors.force_numerator),
            _factor_roots(factors.velocity_denominator),
            _in_phase(factors, radius),
        ]
    )
    return np.asarray(points[points.imag >= -1e-12], dtype=complex)


def _factor_roots(factors: Floats) -> Complexes:
    """Roots z of factors c2 d^2 + c1 d + c0; a constant has none."""
    quadratic = factors[factors[:, 0] != 0.0]
    linear = factors[(factors[:, 0] == 0.0) & (factors[:, 1] != 0.0)]
    pairs = _pairs(quadratic[:, 1] / quadratic[:, 0], quadratic[:, 2] / quadratic[:, 0])
    return np.asarray(1.0 + np.concatenate([pairs, -linear[:, 2] / linear[:, 1]]), dtype=complex)


def _in_phase(factors: Factors, radius: float) -> Complexes:
    """Where w is real on the circle, by linear interpolation: B is infinite there."""
    thetas = np.linspace(0.0, np.pi, 200 + 20 * len(factors.window))[1:-1]
    imaginary = velocity_on_circle(factors, radius, thetas).imag
    turns = np.flatnonzero(imaginary[1:] * imaginary[:-1] < 0.0)
    share = imaginary[turns] / (imaginary[turns] - imaginary[turns + 1])
    return np.asarray(radius * np.exp(1j * (thetas[turns] + share * (thetas[1] - thetas[0]))), dtype=complex)


@compiled
def velocity_on_circle(factors: Factors, radius: float, thetas: Floats) -> Complexes:
    """w at angles on the circle."""
    out = np.empty(len(thetas), dtype=np.complex128)
    for i in range(len(thetas)):
        z, d = on_circle(thetas[i], radius)
        out[i] = velocity_response(factors, z, d)[0]
    return out


def _pairs(d1: Floats, d0: Floats) -> Complexes:
    """Roots of d^2 + d1 d + d0."""
    mean = -d1 / 2.0
    root = np.sqrt((mean * mean - d0).astype(complex))
    return np.concatenate([mean + root, mean - root])


def _roots(ascending: Floats) -> Complexes:
    """Roots of a polynomial whose outermost coefficients may vanish."""
    used = np.flatnonzero(np.abs(ascending) > 1e-300 * np.max(np.abs(ascending)))
    return np.roots(ascending[used[0] : used[-1] + 1][::-1]).astype(complex)


@compiled
def sample_angles(points: Complexes, radius: float, share: float, longest: float) -> Floats:
    """Angles in (0, pi) whose steps are `share` of the distance to the nearest point, and at most `longest`."""
    out = np.empty(MOST_ANGLES)
    return out[: fill_sample_angles(points, radius, share, longest, FIRST, np.empty(len(points)), out)].copy()


@compiled_lean
def fill_sample_angles(
    points: Complexes, radius: float, share: float, longest: float, near_end: float, floors: Floats, out: Floats
) -> int:
    """`sample_angles` into `out`, as many as it holds; returns their number.

    near_end  how near to the ends 0 and pi to begin and end, in shares of the distance of the nearest point there
    floors    working memory (len(points),)
    """
    first, last = 1.0, 1.0
    for k in range(len(points)):
        from_one, from_minus_one = abs(points[k] - radius), abs(points[k] + radius)
        apart = from_one if from_one > 1e-12 else 1.0
        for j in range(len(points)):
            distance = abs(points[k] - points[j])
            if distance > 1e-12:
                apart = min(apart, distance)
        floors[k] = (NEAREST * apart) ** 2
        # a point at z = +-rho itself is no feature: the curve is even about its ends
        if from_one > 1e-9:
            first = min(first, from_one)
        if from_minus_one > 1e-9:
            last = min(last, from_minus_one)
    theta, n = near_end * first, 0
    while theta < np.pi - near_end * last and n < len(out):
        out[n] = theta
        n += 1
        x, y = radius * np.cos(theta), radius * np.sin(theta)
        near = min(theta, np.pi - theta) ** 2
        for k in range(len(points)):
            dx, dy = x - points[k].real, y - points[k].imag
            near = min(near, max(dx * dx + dy * dy, floors[k]))
        theta += min(share * max(np.sqrt(near), 1e-11), longest)
    return n


@compiled
def angles_around_crossings(factors: Factors, radius: float, thetas: Floats) -> Floats:
    """Angles added where a branch crosses an axis (K = 0 or B = 0) between samples, geometrically about it.

    Where the velocity estimate is all but blind (far above a filter's cutoff), B runs from one end of the plane to
    the other within a sliver of angle. Every such branch crosses an axis.
    """
    out, n = np.empty(64 * 20), 0
    before = wall_at(factors, radius, thetas[0])
    for i in range(len(thetas) - 1):
        after = wall_at(factors, radius, thetas[i + 1])
        for axis in range(2):
            if before[axis] * after[axis] < 0.0 and n + 20 <= len(out):
                weights = OF_K if axis == 0 else OF_B
                centre = zero_between(factors, radius, weights, thetas[i], thetas[i + 1])
                offset = thetas[i + 1] - thetas[i]
                for _ in range(10):
                    offset *= 0.1
                    for theta in (centre - offset, centre + offset):
                        if thetas[i] < theta < thetas[i + 1]:
                            out[n] = theta
                            n += 1
        before = after
    return out[:n].copy()
