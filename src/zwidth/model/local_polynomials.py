"""A frequency response from the spectra of one record, by polynomials over windows as wide as the response allows.

The transform of what was read is, up to noise, Y = G U + C: the response G to the transform U of what was sent,
and C, what the state at both ends of the record adds. Both G and C change slowly from one frequency of the
transform to the next, so that over a window of neighbours each is a polynomial, fitted by least squares (local
polynomial method: Pintelon and Schoukens, System Identification, 2nd ed., ch. 7, known at second hand). Unlike a
tapered spectrum it has no leakage, and what the fit leaves tells the noise.

A wide window averages more noise, a narrow one follows a sharper resonance. The narrowest windows tile the whole
spectrum; two neighbours are merged into one twice as wide as long as it predicts what both of them see, within
their own error. A difference that only chance may have made does not keep windows from being merged further: what
is a bias grows, and the error falls.

Polynomials over the transforms of many blocks of one long record, in a memory that does not grow with it.

Over a window, the transform of what was read in a block is Y = G U + C (see `local_polynomials`). The response G
is the same in all blocks; C, what the state adds at a block's ends, is each block's own. So the equations of a
block are reduced by QR in narrow pieces, with the columns of C first: the rows below them hold G alone. These rows
are stacked block after block and reduced again, which is least squares over all blocks. Windows stack their
pieces, whose polynomials are written about the window's middle.

C is thus a polynomial of its own in each piece and block, however wide G's window is. That costs four values of a
piece, which has 32 or more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import comb
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Floats, Ints

ORDER = 2  # of the polynomials
TERMS = 2 * (ORDER + 1)  # coefficients of both
NARROWEST = 6  # half a window, in spacings of the transform: 13 values, 7 more than coefficients
MOST_TILES = 8000  # at the narrowest
FEWEST_TILES = 6  # that a spectrum is divided into, however smooth the response
WIDEST_SHARE = 0.5  # half a window over its middle frequency, at most
AGREED = 4.0  # squared difference between a wide and a narrow window that is taken, over the narrow one's variance
APART = 12.0  # the same from which a wide window, and every wider one, is given up
UNSEEN = 2.0  # variance of a merged window, over that of its noise, for what this does not tell apart
TOLERANCE = 1e-3  # relative difference that is always allowed
CHUNK = 2_000_000  # numbers of the equations that are solved at once


@dataclass(frozen=True)
class Fits:
    """Polynomials over the windows of one width: tile number i covers `width` spacings from 1 + i width.

    With r = (k - middle) / width, -1/2 to 1/2 within a tile (the window is twice as wide as the tile):

    coefficients  (n, 3) of G in r
    factor        (n, 3, 3) covariance of these for noise of variance 1
    cubic         (n, 4) coefficients of G in r where both polynomials have one more term
    noise         (n,) variance of the noise at one frequency of the transform
    excited       (n,) mean squared |U| in the window
    freedom       (n,) values of a window beyond the coefficients, from which the noise is known
    """

    width: int
    coefficients: Complexes
    factor: Complexes
    cubic: Complexes
    noise: Floats
    excited: Floats
    freedom: Floats

    def at(self, tile: Ints, r: Floats) -> tuple[Complexes, Floats]:
        """G (n,) and its variance (n,) for noise of variance 1, at places r (n,) of tiles (n,), given by
        numbers."""
        powers = r[:, None] ** np.arange(ORDER + 1)
        value = np.sum(self.coefficients[tile] * powers, axis=1)
        spread = np.einsum("ni,nij,nj->n", powers, self.factor[tile], powers).real
        return value, np.maximum(spread, 0.0)

    def curvature(self, tile: Ints, r: Floats) -> Floats:
        """Squared difference (n,) that one more term makes to G at places r (n,) of tiles (n,), given by
        numbers."""
        value, _ = self.at(tile, r)
        longer = np.sum(self.cubic[tile] * r[:, None] ** np.arange(self.cubic.shape[1]), axis=1)
        return np.asarray(np.abs(longer - value) ** 2)


def fit_tiles(U: Complexes, Y: Complexes, width: int) -> Fits:
    """Polynomials over all tiles of `width` spacings of transforms (k,) of what was sent and read, U and Y, from
    their second value on."""
    middles = np.arange(1 + width // 2, len(U) - 1 + width // 2, width)
    size = 2 * width + 1
    chunk = max(1, CHUNK // (size * TERMS))
    parts = [_fit_windows(U, Y, middles[i : i + chunk], width) for i in range(0, len(middles), chunk)]
    coefficients, factor, cubic, noise, excited = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Fits(width, coefficients, factor, cubic, noise, excited, np.full(len(middles), float(size - TERMS)))


def _fit_windows(
    U: Complexes, Y: Complexes, middles: Ints, width: int
) -> tuple[Complexes, Complexes, Complexes, Floats, Floats]:
    """The first five arrays of `Fits` after its width, of windows of `width` spacings to either side of middles
    (n,): coefficients, factor, cubic, noise and excited. U, Y: as of `fit_tiles`."""
    # windows that would begin before the second value, or end beyond the last, are moved inwards
    starts = np.clip(middles - width, 1, len(U) - 1 - 2 * width)
    index = starts[:, None] + np.arange(2 * width + 1)
    r = (index - middles[:, None]) / width
    u, y = U[index], Y[index]
    excited = np.mean(np.abs(u) ** 2, axis=1)
    scale = np.sqrt(np.where(excited > 0.0, excited, 1.0))[:, None]
    R = _triangle(u / scale, y, r)
    coefficients, rows = _solution(R, ORDER)
    cubic, _ = _solution(R, ORDER + 1)
    rows = rows / scale[:, :, None]
    residual = np.sum(np.abs(R[:, TERMS:, -1]) ** 2, axis=1)
    return (
        coefficients / scale,
        rows @ np.conj(np.swapaxes(rows, 1, 2)),
        cubic / scale,
        residual / (2 * width + 1 - TERMS),
        excited,
    )


def _triangle(u: Complexes, y: Complexes, r: Floats) -> Complexes:
    """R (n, 9, 9) of the QR decomposition of the columns u r^p, r^p for p = 0 to 3, and y, in this order.

    Least squares with fewer terms are those of its leading block, and what they leave are the last column's rows
    below that.
    """
    columns = np.empty((*u.shape, 2 * ORDER + 5), dtype=complex)
    power = np.ones_like(r)
    for order in range(ORDER + 2):
        columns[..., 2 * order], columns[..., 2 * order + 1] = u * power, power
        power = power * r
    columns[..., -1] = y
    return np.asarray(np.linalg.qr(columns, mode="r"))


def _solution(R: Complexes, order: int) -> tuple[Complexes, Complexes]:
    """Coefficients (n, order + 1) of G by polynomials of an order, from the R of `_triangle`; and their rows
    (n, order + 1, 2 order + 2) of the inverse of R, whose products with each other are their covariance."""
    count = 2 * (order + 1)
    block, at = R[:, :count, :count].copy(), np.arange(count)
    # a window without force, or with one that cannot be told from the record's ends, has a vast error
    least = 1e-9 * np.max(np.abs(block[:, at, at]), axis=1)[:, None] + 1e-300
    block[:, at, at] = np.where(np.abs(block[:, at, at]) < least, least, block[:, at, at])
    # G's coefficients are every other one, beginning with the first
    rows: Complexes = np.asarray(np.linalg.inv(block)[:, ::2], dtype=np.complex128)
    return np.asarray(np.einsum("nij,nj->ni", rows, R[:, :count, -1])), rows


@dataclass(frozen=True)
class LocalResponse:
    """A response at some frequencies of a transform.

    value     (n,) G;  variance (n,) of its complex error
    freedom   (n,) values from which the variance is known, beyond the coefficients
    noise     (n,) variance of the noise in Y there, and excited (n,) mean squared |U|, in the narrowest window
    """

    value: Complexes
    variance: Floats
    freedom: Floats
    noise: Floats
    excited: Floats


def local_response(U: Complexes, Y: Complexes, places: Floats, floor: Floats, narrowest: int) -> LocalResponse:
    """The response Y / U at places (n,), in spacings of the transforms, and its error.

    U, Y       (k,) transforms of what was sent and what was read, at 0 and whole spacings
    floor      (k,) least variance of the noise in Y
    narrowest  half the narrowest window, in spacings; even
    """
    widths = window_widths(len(U) - 1, narrowest)
    return merged_windows([fit_tiles(U, Y, width) for width in widths], places, floor)


def window_widths(last: int, narrowest: int) -> list[int]:
    """Half of each window's width, from the narrowest to what still divides `last` spacings into some tiles."""
    widths = [narrowest]
    # the next width must leave FEWEST_TILES tiles, and its window, twice as wide, must fit
    while last / (2 * widths[-1]) >= FEWEST_TILES and 4 * widths[-1] <= last:
        widths.append(2 * widths[-1])
    return widths


def merged_windows(fits: Sequence[Fits], places: Floats, floor: Floats) -> LocalResponse:
    """The response at places (n,) by the widest windows that agree with the narrower ones within them.

    fits   of windows of rising widths, each twice the one before;   floor  as in `local_response`
    """
    narrowest = fits[0].width
    levels = [_with_floor(one, floor) for one in fits]
    count = len(levels[0].noise)
    level = np.zeros(count, dtype=np.int64)  # number in `fits` of the width that each of the narrowest tiles takes
    whole = np.ones(count, dtype=bool)  # whether a window of the level, and all within it, has not been given up
    for n in range(1, len(levels)):
        apart = _fit_difference(levels[n - 1], levels[n])
        halves = np.append(whole, True)[: 2 * len(apart)]  # the last may have one half only
        whole = (apart < APART) & halves[::2] & np.resize(halves[1::2], len(apart))
        level[np.repeat(whole & (apart < AGREED), 2**n)[:count]] = n
    tile = np.clip(((places - 1.0) / narrowest).astype(int), 0, count - 1)
    result = LocalResponse(np.empty(len(places), complex), *np.empty((4, len(places))))
    for n, one in enumerate(levels):
        at = np.flatnonzero(level[tile] == n)
        # of the windows of this level that hold these tiles
        numbers = np.minimum(tile[at] // 2**n, len(one.noise) - 1)
        r = (places[at] - (1 + one.width * numbers + one.width // 2)) / one.width
        value, spread = one.at(numbers, r)
        # a merged window may be off by what would just not have kept its halves apart
        noise = spread * one.noise[numbers]
        error = (UNSEEN if n else 1.0) * noise + one.curvature(numbers, r)
        result.value[at], result.variance[at] = value, error + (TOLERANCE * np.abs(value)) ** 2
        result.freedom[at] = one.freedom[numbers]
        result.noise[at], result.excited[at] = levels[0].noise[tile[at]], levels[0].excited[tile[at]]
    return result


def _with_floor(fits: Fits, floor: Floats) -> Fits:
    """The fits with a noise of at least `floor` (k,), which is given for each spacing of the transforms."""
    middles = np.minimum(1 + fits.width * np.arange(len(fits.noise)) + fits.width // 2, len(floor) - 1)
    return replace(fits, noise=np.maximum(fits.noise, floor[middles]))


def _fit_difference(narrow: Fits, wide: Fits) -> Floats:
    """How far (n,) wide tiles are from the two narrow ones within each: the largest squared difference over the
    latter's variance; inf where a window is wide against its frequency."""
    count = len(wide.noise)
    middles = 1 + wide.width * np.arange(count) + wide.width // 2
    apart = np.where(wide.width <= WIDEST_SHARE * middles, 0.0, np.inf)
    halves = np.minimum(2 * np.arange(count)[:, None] + [0, 1], len(narrow.noise) - 1)
    noise = np.mean(narrow.noise[halves], axis=1)
    for half in halves.T:
        # two places within the half, at which both windows are evaluated
        for r in (-0.25, 0.25):
            value, spread = narrow.at(half, np.full(count, r))
            # the same place, in spacings of the transform
            k = 1 + narrow.width * half + narrow.width // 2 + r * narrow.width
            predicted, _ = wide.at(np.arange(count), (k - middles) / wide.width)
            # / AGREED: a difference of TOLERANCE alone then counts as just AGREED
            allowed = spread * noise + (TOLERANCE * np.abs(value)) ** 2 / AGREED
            apart = np.maximum(apart, np.abs(predicted - value) ** 2 / np.maximum(allowed, 1e-300))
    return np.asarray(apart)


SUMMED_TERMS: Final = ORDER + 2  # coefficients of a cubic
PIECES: Final = 4  # in a window
NARROWEST_WINDOW: Final = 64  # half of it, in spacings: C takes four values of thirty-two
BINOMIALS: Final = np.array(
    [[comb(p, q) for p in range(SUMMED_TERMS)] for q in range(SUMMED_TERMS)], dtype=np.float64
)
UNEXCITED: Final = 1e-9  # of the largest force at any frequency, below which a window tells nothing


class PieceSums:
    """Running sums over blocks, in pieces that lie beside each other from the second value of the transforms on.

    values  of a block's transforms;   narrowest  half the narrowest window, in spacings: two pieces; even
    """

    def __init__(self, values: int, narrowest: int) -> None:
        """Begin with sums of no block; arguments as of the class."""
        self._width = narrowest // 2
        # of whole pieces, an even number
        self._count = (values - 1) // self._width // 2 * 2
        self._blocks = 0
        # columns u R^p for p = 0 to 3, and y; R is -1 to 1 from the piece's beginning to its end
        self._triangles: Complexes = np.zeros(
            (self._count, SUMMED_TERMS + 1, SUMMED_TERMS + 1), dtype=np.complex128
        )
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
            # the rows below those of C hold G alone
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
                triangles = _reduced([triangles[k::2] @ _to_window(0.5 * (2 * k - 1), 0.5) for k in range(2)])
                power, filled = (one.reshape(-1, 2).sum(axis=1) for one in (power, filled))
            found.append(self._windows(triangles, power, filled, width, most))
        return found

    def _windows(self, pieces: Complexes, power: Floats, filled: Floats, width: int, most: float) -> Fits:
        """The fits over windows of four pieces each, two pieces apart.

        pieces (n, 5, 5)  triangles of the equations of each piece
        power  (n,) of u;   filled (n,) narrowest pieces in each;   most  power in any of the narrowest pieces
        """
        tile = np.arange((len(pieces) + 1) // 2)
        first_piece = np.clip(2 * tile - 1, 0, len(pieces) - PIECES)
        # of the four pieces, as r in the window. A piece's last value is a spacing before the next's first: the
        # middle of its values is half a spacing before that of its stretch, hence 0.5 / width
        middles = [0.5 * (first_piece + j) - tile - 0.25 - 0.5 / width for j in range(PIECES)]
        R = _reduced([pieces[first_piece + j] @ _to_window(middle, 0.25) for j, middle in enumerate(middles)])
        least = UNEXCITED * np.sqrt(most)
        coefficients, rows = _summed_solution(R, ORDER + 1, least)
        cubic, _ = _summed_solution(R, ORDER + 2, least)
        together, powers = (
            np.sum([one[first_piece + j] for j in range(PIECES)], axis=0) for one in (filled, power)
        )
        blocks = self._blocks * together
        # values less the four of C in each piece and block, and less those of G
        freedom = blocks * (self._width - SUMMED_TERMS) - (ORDER + 1)
        residual = np.sum(np.abs(R[:, ORDER + 1 :, -1]) ** 2, axis=1)
        factor: Complexes = rows @ np.conj(np.swapaxes(rows, 1, 2))
        return Fits(
            width, coefficients, factor, cubic, residual / freedom, powers / (blocks * self._width), freedom
        )


def _reduced(stacked: list[Complexes]) -> Complexes:
    """The triangles (n, 5, 5) of n sets of equations, each stacked from arrays (n, r, 5) whose rows stand below
    each other."""
    return np.asarray(np.linalg.qr(np.concatenate(stacked, axis=1), mode="r"), dtype=np.complex128)


def _to_window(middle: ArrayLike, half: float) -> Floats:
    """Matrix (n, 5, 5) that turns columns u R^p of a piece into u r^p of a window, where r = middle + half R:
    r^p = sum over q of (p over q) middle^(p - q) half^q R^q."""
    q, p = np.arange(SUMMED_TERMS)[:, None], np.arange(SUMMED_TERMS)
    about = np.atleast_1d(np.asarray(middle, dtype=np.float64))[:, None, None]
    matrix = np.zeros((len(about), SUMMED_TERMS + 1, SUMMED_TERMS + 1))
    matrix[:, -1, -1] = 1.0
    matrix[:, :-1, :-1] = BINOMIALS * about ** np.maximum(p - q, 0) * half**q
    return matrix


def _summed_solution(R: Complexes, count: int, least: float) -> tuple[Complexes, Complexes]:
    """The first `count` coefficients of G (n, count), from triangles R (n, 5, 5), and the inverse (n, count,
    count) of their equations; where the force tells nothing its size is taken as `least`, which leaves a vast
    error."""
    block, at = R[:, :count, :count].copy(), np.arange(count)
    floor = np.maximum(1e-9 * np.max(np.abs(block[:, at, at]), axis=1), least)[:, None]
    block[:, at, at] = np.where(np.abs(block[:, at, at]) < floor, floor, block[:, at, at])
    rows: Complexes = np.asarray(np.linalg.inv(block), dtype=np.complex128)
    return np.asarray(np.einsum("nij,nj->ni", rows, R[:, :count, -1])), rows
