"""The lowest measured frequencies as a device's stiffness, damping and mass to the ground.

However many modes and whatever delay a device has, near frequency 0

    1 / P = k + b s + m s^2 + j s^3 + ...,   s = 2 pi i f,   all of them real,

as long as P has no zero near there: k is the stiffness to the ground, b the damping with what a delay adds to it,
m the mass with the same. A free device has k = b = 0, and P has two poles at z = 1; one with a dashpot to the
ground k = 0, and one pole; one on a spring none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Complexes, Floats

TERMS = 4
FEWEST = 5  # frequencies that are fitted
REACHES = (
    50.0,
    25.0,
    12.0,
    6.0,
    4.0,
    2.5,
    1.7,
    1.4,
)  # of the fit, over the lowest frequency: the farthest that fits
MISFIT = 0.02  # relative error of the fit that is always allowed
MISFIT_IN_DEVIATIONS = 4.0
ROUGHEST = 0.3  # relative error with which the fit to the lowest frequencies still tells something
MOST_OF_LAST = 0.3  # what the last term is at most, of the largest: more of it fits whatever there is
NEIGHBOURS = 2.0  # times the variance by independent errors that is taken where no error is known
SEEN_SHARE, SEEN_DEVIATIONS = 0.1, 3.0  # what a term is at the lowest frequency, of the largest, if it counts


@dataclass(frozen=True)
class LowFrequencies:
    """1 / P = sum of terms[i] (2 pi i f)^i below and around the lowest measured frequency.

    lowest      that frequency [Hz]
    terms       (4,) k [N/m], b [N s/m], m [kg], j [kg s]
    covariance  (4, 4) of these
    fits        whether P is so at least roughly; how roughly is in the covariance
    closely     whether to within its error
    """

    lowest: float
    terms: Floats
    covariance: Floats
    fits: bool
    closely: bool

    def inverse(self, frequency: Floats, integrators: int) -> Complexes:
        """1 / P (...) at frequencies [Hz] with this number of poles at z = 1: terms below are none."""
        s = 2j * np.pi * np.asarray(frequency)[..., None]
        order = np.arange(TERMS)
        return np.asarray(np.sum(np.where(order < integrators, 0.0, self.terms) * s**order, axis=-1))

    def deviation(self, frequency: Floats) -> Floats:
        """Standard deviation (...) of 1 / P at frequencies [Hz], of its real and imaginary part together [N/m]."""
        s = (2.0 * np.pi * np.asarray(frequency))[..., None] ** np.arange(TERMS)
        sign = np.array([1.0, 1.0, -1.0, -1.0])
        even, odd = s * sign * [1.0, 0.0, 1.0, 0.0], s * sign * [0.0, 1.0, 0.0, 1.0]
        squares = [np.einsum("...i,ij,...j->...", part, self.covariance, part) for part in (even, odd)]
        return np.asarray(np.sqrt(np.maximum(squares[0] + squares[1], 0.0)))

    @property
    def first_seen(self) -> tuple[int, float] | None:
        """Number of the first term that is seen at the lowest frequency, and its sign; None: nothing fits."""
        scale = (2.0 * np.pi * self.lowest) ** np.arange(TERMS)
        size, error = self.terms * scale, np.sqrt(np.diag(self.covariance)) * scale
        seen = np.abs(size) > np.maximum(SEEN_SHARE * np.max(np.abs(size[:3])), SEEN_DEVIATIONS * error)
        first = np.flatnonzero(seen[:3])
        return (int(first[0]), float(np.sign(size[first[0]]))) if self.fits and len(first) else None

    @property
    def integrators(self) -> int | None:
        """Poles of P at z = 1: the number of the first term that is seen, if it is positive; None: unclear."""
        return self.first_seen[0] if self.first_seen and self.first_seen[1] > 0.0 else None


def fit_low_frequencies(frequency: Floats, value: Complexes, deviation: Floats | None) -> LowFrequencies:
    """Stiffness, damping and mass by linear least squares on P (k + b s + ...) = 1 at the lowest frequencies.

    frequency  (n,) [Hz], ascending;  value (n,) P
    deviation  (n,) standard deviation of the complex error of P over |P|; None: unknown

    >>> f = np.linspace(1.0, 50.0, 50)
    >>> s = 2j * np.pi * f
    >>> found = fit_low_frequencies(f, 1.0 / (0.1 * s**2 + 3.0 * s), None)
    >>> found.terms.round(9).tolist(), found.integrators
    ([0.0, 3.0, 0.1, 0.0], 1)
    """
    error = np.full(len(frequency), MISFIT / MISFIT_IN_DEVIATIONS) if deviation is None else deviation
    error = np.maximum(error, 1e-9)
    for reach in REACHES:
        count = max(FEWEST, int(np.searchsorted(frequency, reach * frequency[0], side="right")))
        terms, covariance, misfit = _fit(frequency[:count], value[:count], error[:count])
        allowed = np.maximum(MISFIT, MISFIT_IN_DEVIATIONS * error[:count])
        closely = bool(np.all(misfit <= allowed))
        if closely:
            break
    # errors of neighbours may all be one: no number of them makes the fit surer
    together = NEIGHBOURS if deviation is None else float(count)
    size = np.abs(terms) * (2.0 * np.pi * frequency[0]) ** np.arange(TERMS)
    fits = np.max(misfit) < ROUGHEST and size[3] < MOST_OF_LAST * np.max(size[:3])
    return LowFrequencies(float(frequency[0]), terms, together * covariance, bool(fits), closely)


def _fit(f: Floats, P: Complexes, error: Floats) -> tuple[Floats, Floats, Floats]:
    """Terms, their covariance, and how far P times the fit is from 1 at each frequency."""
    scale = (2.0 * np.pi * f[-1]) ** np.arange(TERMS)
    equations = P[:, None] * (2j * np.pi * f[:, None]) ** np.arange(TERMS) / scale
    weighted = np.concatenate([equations.real, equations.imag]) / np.tile(error, 2)[:, None]
    size = np.maximum(np.linalg.norm(weighted, axis=0), 1e-300)
    wanted = np.concatenate([1.0 / error, np.zeros(len(f))])
    inverse = np.linalg.pinv(weighted / size, rcond=1e-12) / size[:, None]
    terms = inverse @ wanted
    misfit = np.abs(equations @ terms - 1.0)
    spread = max(1.0, float(np.sum((misfit / error) ** 2)) / max(2 * len(f) - TERMS, 1))
    # errors are complex, of this deviation: half of its square in each part
    covariance = spread * 0.5 * (inverse @ inverse.T)
    return terms / scale, covariance / np.outer(scale, scale), misfit
