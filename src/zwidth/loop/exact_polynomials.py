"""Characteristic polynomials of small matrices of doubles in decimal arithmetic, and their roots to all digits.

Where a force reaches the reading through several springs, the response c (d - E)^-1 g is smaller by many orders
than the terms that it is summed from, and poles and zeros to rounding of E leave nothing of it. As numbers of many
digits they are exact for the matrix as its doubles have it:

    det(d - E)                                          by Hessenberg's form (Cohen 1993, algorithm 2.2.9)
    c adj(d - E) g = det(d - E + g c) - det(d - E)      (matrix determinant lemma)
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Context, Decimal, localcontext
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats

Polynomial = list[Decimal]  # ascending coefficients

# Digits that are kept. What cancels between the two determinants is some 15 digits for each spring on the way, and
# elimination loses as many as its pivots are small; fewer would leave a numerator of rounding.
ARITHMETIC: Final = Context(prec=150)
# Share of the largest coefficient below which one is rounding of this arithmetic, and stands for 0.
NOTHING: Final = Decimal("1e-100")
MOST_STATES: Final = 48  # of a matrix: its polynomial takes about a second then, as the cube of its size
SWEEPS: Final = 300  # of Aberth's iteration, which takes some ten once each root is near its place
SETTLED: Final = 2e-16  # share of a root by which its last step moves it


def characteristic_polynomial(E: Floats) -> Polynomial:
    """det(d - E), monic, of a matrix (n, n)."""
    with localcontext(ARITHMETIC):
        return _determinant(_decimal_rows(E))


def numerator(E: Floats, g: Floats, c: Floats, below: Polynomial) -> Polynomial:
    """c adj(d - E) g, numerator of c (d - E)^-1 g, without leading coefficients that are 0.

    E      (n, n);   g, c   (n,)
    below  its denominator, `characteristic_polynomial` of E
    """
    with localcontext(ARITHMETIC):
        force, reading = (list(map(Decimal, each.tolist())) for each in (g, c))
        rows = [
            [value - push * read for value, read in zip(row, reading, strict=True)]
            for row, push in zip(_decimal_rows(E), force, strict=True)
        ]
        # of E - g c: det(d - E + g c) = det(d - E) + c adj(d - E) g
        top = [a - b for a, b in zip(_determinant(rows), below, strict=True)]
        least = NOTHING * max(map(abs, below))
        while top and abs(top[-1]) <= least:
            top.pop()
        return top


def without_roots(p: Polynomial, root: int) -> tuple[Polynomial, int]:
    """A polynomial divided by (d - root) as often as that leaves no remainder, and how often that is."""
    with localcontext(ARITHMETIC):
        count = 0
        while len(p) > 1:
            quotient, remainder = [Decimal(0)] * (len(p) - 1), p[-1]
            for k in range(len(p) - 2, -1, -1):  # Horner's rule
                quotient[k], remainder = remainder, p[k] + root * remainder
            if abs(remainder) > NOTHING * max(map(abs, p)):
                break
            p, count = quotient, count + 1
        return p, count


def roots_near(p: Polynomial, starts: Complexes) -> Complexes | None:
    """All roots of a polynomial, to rounding, by Aberth's iteration on values of many digits; None where it does
    not settle, as for equal roots.

    starts  as many as there are roots, no two of them equal
    """
    at, moving = starts.astype(np.complex128), np.ones(len(starts), dtype=np.bool_)
    with localcontext(ARITHMETIC), np.errstate(all="ignore"):
        for _ in range(SWEEPS):
            for k in np.flatnonzero(moving):
                newton = _newton_step(p, complex(at[k]))
                apart = np.delete(at[k] - at, k)  # the other roots are divided out of p by these distances
                step = newton / (1.0 - newton * np.sum(1.0 / apart))
                if not np.isfinite(step):
                    return None
                at[k] -= step
                moving[k] = abs(step) > SETTLED * abs(at[k])
            if not moving.any():
                return at
    return None


def refined_root(p: Polynomial, start: complex) -> tuple[Decimal, Decimal] | None:
    """Real and imaginary part of the simple root of p next to `start`, to many digits, by Newton's method; None
    where it does not settle there."""
    with localcontext(ARITHMETIC):
        x, y = Decimal(start.real), Decimal(start.imag)
        for _ in range(12):
            (re, im), (slope_re, slope_im) = _value_and_slope(p, x, y)
            size = slope_re * slope_re + slope_im * slope_im
            if not size:
                return None
            step_x, step_y = (re * slope_re + im * slope_im) / size, (im * slope_re - re * slope_im) / size
            x, y = x - step_x, y - step_y
            length, place = max(abs(step_x), abs(step_y)), max(abs(x), abs(y))
            if length <= Decimal("1e-60") * place:  # the next step would be its square
                return x, y
            if length > place:  # it leaves for another root
                return None
    return None


def decimals(values: Floats) -> list[Decimal]:
    """Doubles (k,) as decimal numbers of the same value."""
    return list(map(Decimal, values.tolist()))


def exact_dot(first: Sequence[Decimal], second: Sequence[Decimal]) -> Decimal:
    """Sum of products, in the digits of the context that is in force."""
    return sum((a * b for a, b in zip(first, second, strict=True)), Decimal(0))


def _decimal_rows(E: Floats) -> list[list[Decimal]]:
    """Rows of a matrix as `decimals`."""
    return [decimals(row) for row in E]


def _newton_step(p: Polynomial, z: complex) -> complex:
    """Newton's step p(z) / p'(z) of a polynomial at z; nan where p' is 0."""
    (re, im), (slope_re, slope_im) = _value_and_slope(p, Decimal(z.real), Decimal(z.imag))
    size = slope_re * slope_re + slope_im * slope_im
    if not size:
        return complex(np.nan, np.nan)
    return complex(float((re * slope_re + im * slope_im) / size), float((im * slope_re - re * slope_im) / size))


def _value_and_slope(p: Polynomial, x: Decimal, y: Decimal) -> tuple[tuple[Decimal, Decimal], ...]:
    """p and p' at x + i y: (real, imaginary) part of p, then of p'."""
    re = im = slope_re = slope_im = Decimal(0)
    for coefficient in reversed(p):
        slope_re, slope_im = slope_re * x - slope_im * y + re, slope_re * y + slope_im * x + im
        re, im = re * x - im * y + coefficient, re * y + im * x
    return (re, im), (slope_re, slope_im)


def _determinant(H: list[list[Decimal]]) -> Polynomial:
    """det(d - H) of a matrix given by its rows, which is overwritten."""
    n = len(H)
    _to_hessenberg(H)
    # minors[k]: det(d - H) of the first k rows and columns, by expansion along the last of them
    minors: list[Polynomial] = [[Decimal(1)]]
    for k in range(1, n + 1):
        before = minors[k - 1]
        p = [Decimal(0), *before]
        for j, value in enumerate(before):
            p[j] -= H[k - 1][k - 1] * value
        below = Decimal(1)  # product of the subdiagonal entries on the way
        for i in range(1, k):
            below *= H[k - i][k - i - 1]
            factor = below * H[k - i - 1][k - 1]
            if factor:
                for j, value in enumerate(minors[k - i - 1]):
                    p[j] -= factor * value
        minors.append(p)
    return minors[n]


def _to_hessenberg(H: list[list[Decimal]]) -> None:
    """Make all entries of a matrix H below the first subdiagonal 0, in place, by elimination with pivots, a
    similarity that keeps det(d - H)."""
    n = len(H)
    for m in range(1, n - 1):
        # column m - 1 is cleared below row m: rows are subtracted, the inverse step adds columns
        pivot = max(range(m, n), key=lambda i: abs(H[i][m - 1]))
        if not H[pivot][m - 1]:
            continue
        if pivot != m:
            H[pivot], H[m] = H[m], H[pivot]
            for row in H:
                row[pivot], row[m] = row[m], row[pivot]
        for i in range(m + 1, n):
            if not H[i][m - 1]:
                continue
            share = H[i][m - 1] / H[m][m - 1]
            cleared, pivot_row = H[i], H[m]
            cleared[m - 1] = Decimal(0)
            for j in range(m, n):
                cleared[j] -= share * pivot_row[j]
            for row in H:
                row[m] += share * row[i]
