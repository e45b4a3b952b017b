"""The least value of a response in a band of frequencies, of many devices at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.model.rendered_modes import RenderedModes

SPREAD: Final = 40  # frequencies spread over the band
HALVINGS: Final = 40
WITHIN: Final = 7  # frequencies between the neighbours of the least
ROUNDS: Final = 6  # how often these are tried, each time closer
DEEPEST: Final = 2  # lowest minima that are looked at so


def frequencies_in_band(
    low: Floats, high: Floats, modes: RenderedModes, roots: Complexes, period: Floats
) -> Floats:
    """Frequencies at which a response at the handle is looked at, ascending.

    Spread over the band; and where it changes fast, at the undamped resonances of the handle and at the
    antiresonances between them (the zeros of sum h_k^2/(w_k^2 - w^2), one between any two resonances), beside them
    by a half and by two widths of the damped peak. And at the roots z of the loop on its wall, whose resonances
    are -ln|z|/T wide.

    low, high  (n,)    of the band [Hz]
    roots      (n, k)  z; 0 for none
    period     (n,)    T [s]
    Returns    (n, f)
    """
    share = np.linspace(0.0, 1.0, SPREAD)
    grid = low[:, None] * (high / low)[:, None] ** share
    w2 = np.sort(modes.frequency_squared, axis=1)
    order = np.argsort(modes.frequency_squared, axis=1, kind="stable")
    h2 = np.take_along_axis(modes.handle**2, order, axis=1)
    wide = np.max(np.abs(modes.decay), axis=1, keepdims=True)
    places = np.concatenate([np.sqrt(np.maximum(w2, 0.0)), *_zeros(w2, h2)], axis=1)
    size = np.clip(np.abs(roots), 1e-3, 1.0)
    centres = np.concatenate([places, np.abs(np.angle(roots)) / period[:, None]], axis=1)
    wide = np.concatenate([wide + 0.0 * places, -np.log(size) / period[:, None]], axis=1)
    beside = [centres + side * np.minimum(wide, 0.3 * centres) for side in (-2.0, -0.5, 0.0, 0.5, 2.0)]
    extra = np.concatenate(beside, axis=1) / (2.0 * np.pi)
    every = np.concatenate([grid, np.clip(extra, low[:, None], high[:, None])], axis=1)
    return np.sort(every, axis=1)


def _zeros(w2: Floats, h2: Floats) -> list[Floats]:
    """Antiresonances (n, 1) between neighbouring resonances [rad/s], by halving: the sum rises between them."""
    found = []
    for k in range(w2.shape[1] - 1):
        low, high = w2[:, k].copy(), w2[:, k + 1].copy()
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            with np.errstate(divide="ignore", invalid="ignore"):
                value = np.sum(h2 / (w2 - middle[:, None]), axis=1)
            low, high = np.where(value < 0.0, middle, low), np.where(value < 0.0, high, middle)
        found.append(np.sqrt(np.maximum(0.5 * (low + high), 0.0))[:, None])
    return found


def least_in_band(response: Callable[[Floats], Floats], frequency: Floats) -> Floats:
    """Least value of a response over a band.

    Between the frequencies beside each of the lowest minima it is tried at more of them, closer each time.

    response   of frequencies (n, k) of any number k, returning (n, k)
    frequency  (n, f)  ascending; the first and the last are the ends of the band
    Returns    (n,)
    """
    values = response(frequency)
    least = values.min(axis=1)
    ends = np.full((len(values), 1), np.inf)
    before, after = np.hstack([ends, values[:, :-1]]), np.hstack([values[:, 1:], ends])
    minima = np.where((values <= before) & (values <= after), values, np.inf)
    chosen = np.argsort(minima, axis=1, kind="stable")[:, :DEEPEST]
    last, row = frequency.shape[1] - 1, np.arange(len(values))
    for n in range(chosen.shape[1]):
        at = chosen[:, n]
        low, high = frequency[row, np.maximum(at - 1, 0)], frequency[row, np.minimum(at + 1, last)]
        for _ in range(ROUNDS):
            closer = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, WITHIN)
            found = response(closer)
            best = found.argmin(axis=1)
            least = np.minimum(least, found.min(axis=1))
            low, high = closer[row, np.maximum(best - 1, 0)], closer[row, np.minimum(best + 1, WITHIN - 1)]
    return np.asarray(least)
