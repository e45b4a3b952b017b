"""The roots of many neighbouring polynomials, each search starting from the last one's roots."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.compiled import compiled, compiled_apart, compiled_inline, compiled_lean


@compiled_inline
def divide(a: complex, b: complex) -> complex:
    """a / b, inf or nan where b is 0: plain arithmetic, several times faster than guarded complex division."""
    scale = 1.0 / (b.real * b.real + b.imag * b.imag)
    return complex((a.real * b.real + a.imag * b.imag) * scale, (a.imag * b.real - a.real * b.imag) * scale)


@compiled
def spread_roots(roots: Complexes) -> None:
    """Starting values spread over the disk |z| < 1, in the s plane."""
    N = len(roots)
    for k in range(N):
        angle = 2.0 * np.pi * (k + 0.37) / N  # none real, no two conjugate: the iteration would keep them so
        z = 0.8 * complex(np.cos(angle), np.sin(angle))
        roots[k] = (z - 1.0) / (z + 1.0)


@compiled_apart
def find_roots(p: Floats, roots: Complexes, tolerance: float) -> None:
    """The roots of p(s), ascending coefficients, by Aberth's iteration until no root moves by more than
    the share `tolerance` of its size, at most 30 times.

    roots  (N,) starting values in the s plane, replaced by the roots; warm starts take a few rounds
    """
    N = len(p) - 1
    one = complex(1.0, 0.0)
    for _ in range(30):
        largest = 0.0
        for i in range(N):
            s = roots[i]
            value, slope = complex(0.0, 0.0), complex(0.0, 0.0)
            if abs(s.real) + abs(s.imag) <= 1.0:
                for k in range(N, -1, -1):
                    slope = slope * s + value
                    value = value * s + p[k]
                newton = divide(value, slope)
            else:  # the reversed polynomial q(1/s) = p(s)/s^N, so that no power overflows: p/p' = s q/(N q - q'/s)
                t = divide(one, s)
                for k in range(N + 1):
                    slope = slope * t + value
                    value = value * t + p[k]
                newton = s * divide(value, N * value - t * slope)
            # Aberth's correction of Newton's step for the other roots
            pull = complex(0.0, 0.0)
            for j in range(N):
                gap = s - roots[j]
                if j != i and gap != 0.0:
                    pull += divide(one, gap)
            step = divide(newton, one - newton * pull)
            if not (abs(step.real) + abs(step.imag) < 1e300):  # no number: this root stays for now
                step = complex(0.0, 0.0)
            roots[i] = s - step
            largest = max(largest, (abs(step.real) + abs(step.imag)) / (abs(s.real) + abs(s.imag) + 1e-300))
        if largest < tolerance:
            break


@compiled_lean
def real_root(p: Floats) -> float:
    """A real root of p0 + p1 s + p2 s^2 + p3 s^3, by Cardano's formula and one step of Newton's method.

    p  (4,) ascending coefficients, the last one not 0
    """
    a, b, c = p[2] / p[3], p[1] / p[3], p[0] / p[3]
    third = a / 3.0
    # s = y - a/3:  y^3 + 3 q y + 2 r = 0
    q, r = b / 3.0 - third * third, 0.5 * c + third * (third * third - 0.5 * b)
    under = q * q * q + r * r
    if under > 0.0:  # one real root; else three
        u = np.cbrt(abs(r) + np.sqrt(under))
        y = q / u - u if r > 0.0 else u - q / u
    else:
        size = np.sqrt(-q)
        y = 2.0 * size * np.cos(np.arccos(min(abs(r) / (size * size * size), 1.0)) / 3.0) if size > 0.0 else 0.0
        y = -y if r > 0.0 else y
    s = y - third
    slope = (3.0 * s + 2.0 * a) * s + b
    nearer = s - (((s + a) * s + b) * s + c) / slope  # no use where that is long, as at a double root
    return float(nearer if abs(nearer - s) < 0.1 * abs(s) else s)


@compiled
def polynomial_radius(p: Floats, radius: float, roots: Complexes) -> float:
    """Largest |z| over the roots of p(s), z = radius (1 + s)/(1 - s), see `find_roots`; 1e300 where it is no
    number."""
    find_roots(p, roots, 1e-9)
    one, out = complex(1.0, 0.0), 0.0
    for i in range(len(p) - 1):
        out = max(out, abs(divide(radius * (one + roots[i]), one - roots[i])))
    return out if out == out else 1e300
