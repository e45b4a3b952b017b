"""The gauge mu of a wall: scaled by more than 1/mu, some passive operator makes it vibrate.

At each angle the sampled response fills a disk |P - C| <= R (see `disks`). A wall with H = K + B w(z) keeps clear
of vibration with every passive operator if and only if no P of the disk makes 1 + P H vanish,

    1 + 2 a + b > 0,      a = Re(H C),  b = |H|^2 (|C|^2 - R^2),        0 < theta <= pi

Along a ray lambda H the smallest lambda that fails is 1/mu, with the larger root of mu^2 + 2 a mu + b = 0,

    mu = -a + sqrt(D),      D = a^2 - b = |H|^2 R^2 - Im(H C)^2

and the largest mu over all angles says how far the ray may go. A small disk is met by a ray at angles much closer
together than any grid's, so that the largest mu is found by branch and bound: the walls that (a, b) leave passive,
mu^2 + 2 a mu + b > 0 for all mu > m, are an intersection of half planes in (a, b); hence on a straight path of
(a, b) the largest mu stands at an end, and a path that bends by e_a and e_b at most has none above

    max over both ends of mu(a - e_a, b - e_b)

Stretches of angles whose bound exceeds the best mu found are halved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.compiled import compiled
from zwidth.guarantees.conics import A_B, A_K, B_KK, C_B, C_K, QUARTIC, R_KK, Conics, conics
from zwidth.guarantees.port import static_compliances
from zwidth.loop.loop import Loop

# Relative accuracy of mu, and largest number of halvings of a stretch.
SHARE, DEPTH = 1e-10, 48
# A part of H C below this share of |H C| is rounding.
ROUNDING = 1e-13


@dataclass(frozen=True)
class Gauge:
    """Conditions of all passive operators on the walls of one loop.

    conics   condition of each angle; None where the device dissipates nothing
    static   ends of the range of static compliances of the reading with springs at the port, at z = 1 [m/N]
    """

    conics: Conics | None
    static: tuple[float, float]

    def largest(self, K: Floats, B: Floats) -> tuple[Floats, Floats]:
        """mu (k,) of walls (k,), and the angle that it comes from, 0 for the limit there.

        Never negative; inf where a wall fails at once, as all but 0 do without conics. A wall is passive if and
        only if its mu is below 1.
        """
        if self.conics is None:
            return np.where((K == 0.0) & (B == 0.0), 0.0, np.inf), np.zeros(len(K))
        mu, at = _largest_mu(K, B, self.conics.angles, self.conics.pieces, self.conics.wide)
        with np.errstate(invalid="ignore"):
            # at z = 1 a spring K with a compliance g, 1 + g K, fails from 1/mu = -1/(g K) on
            drift = np.max([np.where(K == 0.0, 0.0, -g * K) for g in self.static], axis=0)
        slow = np.maximum(_at_zero(K, B, self.conics.limit), drift)
        return np.maximum(mu, slow), np.where(slow > mu, 0.0, at)


def gauge(loop: Loop, held: Floats) -> Gauge:
    """The gauge of a loop that an operator holds along the coordinate `held` (n,)."""
    return Gauge(conics(loop, held), static_compliances(loop.plant, held))


def _at_zero(K: Floats, B: Floats, limit: Floats) -> Floats:
    """mu (k,) of walls (k,) in the limit of the angle to zero: the larger root of q mu^2 + 2 a mu + b."""
    q, aK, aB, bKK, bKB, bBB = limit
    a, b = aK * K + aB * B, bKK * K * K + bKB * K * B + bBB * B * B
    a = np.where(np.abs(a) < ROUNDING * (np.abs(aK * K) + np.abs(aB * B)), 0.0, a)
    D = a * a - q * b
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(D)
        mu = np.where(a > 0.0, -b / (a + root), (root - a) / q)
    return np.where((D >= 0.0) & (mu > 0.0), mu, 0.0)


@compiled
def _mu(a: float, b: float, D: float) -> float:
    """The larger root of mu^2 + 2 a mu + b, D = a^2 - b, without cancellation; 0 where no root is positive."""
    if not D >= 0.0 or (a >= 0.0 and b >= 0.0):
        return 0.0
    root: float = np.sqrt(D)
    return -b / (a + root) if a > 0.0 else root - a


@compiled
def _conic_at(K: float, B: float, piece: Floats, wide: bool, s: float) -> tuple[float, float, float, float]:
    """a, b, D and the size |Re H C| + |Im H C| of a wall at the share s of the way through a piece (10, 5) of
    `Conics`, whose disks are `wide` or not. For narrow disks D is computed as |H|^2 R^2 - Im(H C)^2, since a^2 - b
    cancels."""
    KK, KB, BB = K * K, K * B, B * B
    a = across = square = 0.0
    first = B_KK if wide else R_KK  # `square` is b of wide disks, |H|^2 R^2 of narrow ones
    for q in range(QUARTIC - 1, -1, -1):
        a = a * s + (K * piece[A_K, q] + B * piece[A_B, q])
        across = across * s + (K * piece[C_K, q] + B * piece[C_B, q])
        square = square * s + (KK * piece[first, q] + KB * piece[first + 1, q] + BB * piece[first + 2, q])
    if abs(a) < ROUNDING * abs(across):
        a = 0.0
    size = abs(a) + abs(across)
    if wide:
        return a, square, a * a - square, size
    D = square - across * across
    return a, a * a - D, D, size


@compiled
def _sag(x2: float, x3: float, x4: float, s: float, h: float) -> float:
    """Largest distance of a quartic below its chord from s - h/2 to s + h/2, by coefficients x2, x3, x4 of s^2 to
    s^4: h^2/8 of its largest second derivative there."""
    # in the middle; within h/2 it changes by h/2 times the third derivative, at most 6 |x3| + 24 |x4| as s <= 1
    bend = 2.0 * x2 + 6.0 * x3 * s + 12.0 * x4 * s * s
    sag: float = max(bend + 0.5 * h * (abs(6.0 * x3) + abs(24.0 * x4)), 0.0) * h * h / 8.0
    return sag


@compiled
def _sags(K: float, B: float, piece: Floats, s: float, h: float) -> tuple[float, float]:
    """How far a and b of a wall can lie below their chords from s - h/2 to s + h/2."""
    KK, KB, BB = K * K, K * B, B * B
    of_K, of_B, i = piece[A_K], piece[A_B], B_KK
    ea = _sag(K * of_K[2] + B * of_B[2], K * of_K[3] + B * of_B[3], K * of_K[4] + B * of_B[4], s, h)
    # coefficients of s^2, s^3 and s^4 in b
    b2 = KK * piece[i, 2] + KB * piece[i + 1, 2] + BB * piece[i + 2, 2]
    b3 = KK * piece[i, 3] + KB * piece[i + 1, 3] + BB * piece[i + 2, 3]
    b4 = KK * piece[i, 4] + KB * piece[i + 1, 4] + BB * piece[i + 2, 4]
    return ea, _sag(b2, b3, b4, s, h)


@compiled
def _mu_below(a: float, b: float, D: float, ea: float, eb: float) -> float:
    """mu of a - ea and b - eb, with D of these from that of a and b."""
    return _mu(a - ea, b - eb, D + ea * (ea - 2.0 * a) + eb)


@compiled
def _largest_within(K: float, B: float, piece: Floats, wide: bool, best: float) -> float:
    """The largest mu of a wall within a piece, or the best known if that is larger, by halving stretches of it.

    piece, wide  as for `_conic_at`
    """
    starts, widths = np.empty(DEPTH + 1), np.empty(DEPTH + 1)
    starts[0], widths[0], waiting = 0.0, 1.0, 1  # a stack of stretches, and how many of it are to be looked at
    while waiting > 0:
        waiting -= 1
        s, h = starts[waiting], widths[waiting]
        a0, b0, D0, size = _conic_at(K, B, piece, wide, s)
        a1, b1, D1, _ = _conic_at(K, B, piece, wide, s + h)
        best = max(best, _mu(a0, b0, D0), _mu(a1, b1, D1))
        ea, eb = _sags(K, B, piece, s + 0.5 * h, h)
        above = max(_mu_below(a0, b0, D0, ea, eb), _mu_below(a1, b1, D1, ea, eb))
        # no better one within, or as narrow as the stack allows
        if above <= best + SHARE * best + ROUNDING * size or waiting + 2 > DEPTH:
            continue
        h *= 0.5
        starts[waiting], widths[waiting] = s, h
        starts[waiting + 1], widths[waiting + 1] = s + h, h
        waiting += 2
    return best


@compiled
def _largest_mu(K: Floats, B: Floats, angles: Floats, pieces: Floats, wide: Flags) -> tuple[Floats, Floats]:
    """Largest mu (k,) of walls (k,) over all angles, and the angle (k,) at the start of the piece it comes from.

    angles, pieces, wide  of `Conics`
    """
    count, n = len(K), len(pieces)
    out, at = np.zeros(count), np.zeros(count)
    a, b, D, size = np.empty(n + 1), np.empty(n + 1), np.empty(n + 1), np.empty(n + 1)  # at all ends of pieces
    for k in range(count):
        best, worst_piece = 0.0, 0
        for i in range(n + 1):
            j = min(i, n - 1)
            a[i], b[i], D[i], size[i] = _conic_at(K[k], B[k], pieces[j], wide[j], float(i - j))
            mu = _mu(a[i], b[i], D[i])
            if mu > best:
                best, worst_piece = mu, j
        for i in range(n):
            ea, eb = _sags(K[k], B[k], pieces[i], 0.5, 1.0)
            above = max(_mu_below(a[i], b[i], D[i], ea, eb), _mu_below(a[i + 1], b[i + 1], D[i + 1], ea, eb))
            if above > best + SHARE * best + ROUNDING * size[i]:
                inner = _largest_within(K[k], B[k], pieces[i], wide[i], best)
                if inner > best:
                    best, worst_piece = inner, i
        out[k], at[k] = best, angles[worst_piece]
    return out, at
