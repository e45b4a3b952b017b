"""Polynomials over the transforms of many blocks of one long record, in a memory that does not grow with it.

Over a window, the transform of what was read in a block is Y = G U + C (see `local_polynomials`). The response G
is the same in all blocks; C, what the state adds at a block's ends, is each block's own. So the equations of a
block are reduced by QR in narrow pieces, with the columns of C first: the rows below them hold G alone. These rows
are stacked block after block and reduced again, which is least squares over all blocks. Windows stack their
pieces, whose polynomials are written about the window's middle.

C is thus a polynomial of its own in each piece and block, however wide G's window is. That costs four values of a
piece, which has 32 or more.
"""

from __future__ import annotations

from math import comb
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Floats
from zwidth.model.local_polynomials import CHUNK, ORDER, Fits

SUMMED_TERMS: Final = ORDER + 2  # coefficients of a cubic
PIECES: Final = 4  # in a window
NARROWEST_WINDOW: Final = 64  # half of it, in spacings: C takes four values of thirty-two
BINOMIALS: Final = np.array([[comb(p, q) for p in range(SUMMED_TERMS)] for q in range(SUMMED_TERMS)], dtype=np.float64)
UNEXCITED: Final = 1e-9  # of the largest force at any frequency, below which a window tells nothing


class PieceSums:
    """Running sums over blocks, in pieces that lie beside each other from the second value of the transforms on.

    values  of a block's transforms;   narrowest  half the narrowest window, in spacings: two pieces; even
    """

    def __init__(self, values: int, narrowest: int) -> None:
        self._width = narrowest // 2
        self._count = (values - 1) // self._width // 2 * 2
        self._blocks = 0
        # columns u R^p for p = 0 to 3, and y; R is -1 to 1 from the piece's beginning to its end
        self._triangles: Complexes = np.zeros((self._count, SUMMED_TERMS + 1, SUMMED_TERMS + 1), dtype=np.complex128)
        self._power = np.zeros(self._count)
        R = (np.arange(self._width) + 0.5) * 2.0 / self._width - 1.0
        self._powers = R[:, None] ** np.arange(SUMMED_TERMS)

    def add(self, U: Complexes, Y: Complexes) -> None:
        """Add the transforms (values,) of what was sent and read in a block."""
        used = slice(1, 1 + self._count * self._width)
        u, y = (values[used].reshape(self._count, self._width) for values in (U, Y))
        self._power += np.sum(np.abs(u) ** 2, axis=1)
        chunk = max(1, CHUNK // (self._width * (2 * SUMMED_TERMS + 1)))
        for first in range(0, self._count, chunk):
            some = slice(first, first + chunk)
            columns = np.empty((*u[some].shape, 2 * SUMMED_TERMS + 1), dtype=np.complex128)
            columns[..., :SUMMED_TERMS] = self._powers
            columns[..., SUMMED_TERMS:-1] = u[some][..., None] * self._powers
            columns[..., -1] = y[some]
            below = np.asarray(np.linalg.qr(columns, mode="r"))[:, SUMMED_TERMS:, SUMMED_TERMS:]
            self._triangles[some] = _reduced([self._triangles[some], below])
        self._blocks += 1

    def fits(self, widths: list[int]) -> list[Fits]:
        """The polynomials over all windows of these widths, each twice the one before, as by `fit_tiles`."""
        triangles, power, most = self._triangles, self._power, float(np.max(self._power))
        filled = np.ones(self._count)  # narrowest pieces in each
        found = list[Fits]()
        for n, width in enumerate(widths):
            if n:
                if len(triangles) % 2:  # the last one is joined to an empty one
                    triangles, power, filled = (
                        np.concatenate([one, np.zeros_like(one[:1])]) for one in (triangles, power, filled)
                    )
                triangles = _reduced([triangles[k::2] @ _moved(0.5 * (2 * k - 1), 0.5) for k in range(2)])
                power, filled = (one.reshape(-1, 2).sum(axis=1) for one in (power, filled))
            found.append(self._windows(triangles, power, filled, width, most))
        return found

    def _windows(self, pieces: Complexes, power: Floats, filled: Floats, width: int, most: float) -> Fits:
        """Windows of four pieces each.

        power  (n,) of u;   filled (n,) narrowest pieces in each;   most  power in any of the narrowest pieces
        """
        tile = np.arange((len(pieces) + 1) // 2)
        first = np.clip(2 * tile - 1, 0, len(pieces) - PIECES)
        about = [0.5 * (first + j) - tile - 0.25 - 0.5 / width for j in range(PIECES)]
        R = _reduced([pieces[first + j] @ _moved(middle, 0.25) for j, middle in enumerate(about)])
        least = UNEXCITED * np.sqrt(most)
        coefficients, rows = _summed_solution(R, ORDER + 1, least)
        cubic, _ = _summed_solution(R, ORDER + 2, least)
        together, powers = (np.sum([one[first + j] for j in range(PIECES)], axis=0) for one in (filled, power))
        blocks = self._blocks * together
        freedom = blocks * (self._width - SUMMED_TERMS) - (ORDER + 1)
        left = np.sum(np.abs(R[:, ORDER + 1 :, -1]) ** 2, axis=1)
        factor: Complexes = rows @ np.conj(np.swapaxes(rows, 1, 2))
        return Fits(width, coefficients, factor, cubic, left / freedom, powers / (blocks * self._width), freedom)


def _reduced(stacked: list[Complexes]) -> Complexes:
    """The triangles (n, 5, 5) of equations that stand under each other."""
    return np.asarray(np.linalg.qr(np.concatenate(stacked, axis=1), mode="r"), dtype=np.complex128)


def _moved(middle: ArrayLike, half: float) -> Floats:
    """What turns columns u R^p of a piece into u r^p of a window, (n, 5, 5), where r = middle + half R:
    r^p = sum over q of (p over q) middle^(p - q) half^q R^q."""
    q, p = np.arange(SUMMED_TERMS)[:, None], np.arange(SUMMED_TERMS)
    about = np.atleast_1d(np.asarray(middle, dtype=np.float64))[:, None, None]
    matrix = np.zeros((len(about), SUMMED_TERMS + 1, SUMMED_TERMS + 1))
    matrix[:, -1, -1] = 1.0
    matrix[:, :-1, :-1] = BINOMIALS * about ** np.maximum(p - q, 0) * half**q
    return matrix


def _summed_solution(R: Complexes, count: int, least: float) -> tuple[Complexes, Complexes]:
    """So many coefficients of G (n, count), and the inverse (n, count, count) of their equations; where the force
    tells nothing its size is taken as `least`, which leaves a vast error."""
    block, at = R[:, :count, :count].copy(), np.arange(count)
    floor = np.maximum(1e-9 * np.max(np.abs(block[:, at, at]), axis=1), least)[:, None]
    block[:, at, at] = np.where(np.abs(block[:, at, at]) < floor, floor, block[:, at, at])
    rows: Complexes = np.asarray(np.linalg.inv(block), dtype=np.complex128)
    return np.asarray(np.einsum("nij,nj->ni", rows, R[:, :count, -1])), rows
