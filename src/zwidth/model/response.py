"""A measured frequency response of a device: from the commanded force to the encoder's reading.

Errors of a measured response that hold at all its frequencies together.

The lowest measured frequencies as a device's stiffness, damping and mass to the ground.

However many modes and whatever delay a device has, near frequency 0

    1 / P = k + b s + m s^2 + j s^3 + ...,   s = 2 pi i f,   all of them real,

as long as P has no zero near there: k is the stiffness to the ground, b the damping with what a delay adds to it,
m the mass with the same. A free device has k = b = 0, and P has two poles at z = 1; one with a dashpot to the
ground k = 0, and one pole; one on a spring none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.errors import ResponseError

LEAST_COHERENCE: Final = 0.5  # below it more of the reading is noise than is answer to the force
SAME_FREQUENCY: Final = 1e-9  # relative difference of two frequencies that are one
UNSURE: Final = 0.5  # relative error of the response, up to which the lowest frequencies are left out

# Phase of P (z - 1)^m at the lowest frequency, beyond which m is not believed [rad]
CLEAR, CONTRADICTED = np.radians(44.0), np.radians(75.0)
SETTLED = np.radians(5.0)  # the same phase, below which nothing else is asked
UNLIKE = 0.75  # by which the exponent of |P| may differ from the one that its phase tells


@dataclass(frozen=True)
class MeasuredPath:
    """One path of a measured device, at the frequencies of its `Response`.

    value      (n,) complex [m/N]; the mean where there are several sweeps
    coherence  (n,) magnitude squared, 0 to 1; None: not known
    sweeps     (k, n) complex, the repetitions; None: one measurement
    """

    value: Complexes
    coherence: Floats | None = None
    sweeps: Complexes | None = None


def mean_path(paths: Sequence[MeasuredPath]) -> MeasuredPath:
    """Repetitions of one path as one, with their mean; a frequency is as coherent as in the worst of them."""
    sweeps = np.array([path.value for path in paths])
    known = [path.coherence for path in paths if path.coherence is not None]
    return MeasuredPath(sweeps.mean(axis=0), np.min(known, axis=0) if known else None, sweeps)


@dataclass(frozen=True)
class MeasuredHandle:
    """What is known of a measured device at the handle, so that somebody can hold it there.

    force_to_encoder    from the hand's force, continuous in time, to the encoder's reading; None: not measured
    command_to_handle   from the force command sample to the handle's position at the samples, hold and hardware
                        delay included; None: not measured
    force_to_handle     from the hand's force to the handle's position; None: not measured
    at_sensor           whether the hand holds what the encoder reads
    actuator_at_sensor  whether the command acts on what the encoder reads
    """

    force_to_encoder: MeasuredPath | None = None
    command_to_handle: MeasuredPath | None = None
    force_to_handle: MeasuredPath | None = None
    at_sensor: bool = False
    actuator_at_sensor: bool = False

    @property
    def missing(self) -> tuple[str, ...]:
        """Paths that are neither measured nor follow from others, in words; () where the handle can be held."""
        absent = []
        if self.force_to_encoder is None and not (self.at_sensor and self.actuator_at_sensor):
            absent.append("from the handle's force to the encoder")
        if self.command_to_handle is None and not (self.at_sensor or self.actuator_at_sensor):
            absent.append("from the command to the handle")
        if self.force_to_handle is None and not self.at_sensor:
            absent.append("from the handle's force to the handle")
        return tuple(absent)


@dataclass(frozen=True)
class Response:
    """P(exp(2 pi i f T)) at measured frequencies: force command sample -> encoder sample, hold and hardware delay
    included.

    frequency    (n,) [Hz], ascending, 0 < f <= 1/(2T)
    value        (n,) complex [m/N]; the mean where there are several sweeps
    integrators  poles at z = 1 (0, 1 or 2); None: to be read off the phase, see `integrators_of`
    coherence    (n,) magnitude squared, 0 to 1; None: not known
    averages     independent averages behind the coherence; 1: not known how many
    freedom      (n,) complex values from which the coherence is known, beyond those fitted; None: averages - 1
    sweeps       (k, n) complex, the repetitions of which `value` is the mean; None: one measurement
    note         how the response was made, a sentence for people; "" where it was read unchanged
    handle       what is known at the handle; None: nothing
    delay        known delay of the hardware that the response holds [samples]; None: not known
    """

    frequency: Floats
    value: Complexes
    integrators: int | None = None
    coherence: Floats | None = None
    averages: float = 1.0
    freedom: Floats | None = None
    sweeps: Complexes | None = None
    note: str = ""
    handle: MeasuredHandle | None = None
    delay: float | None = None

    def __post_init__(self) -> None:
        """Raise ValueError unless frequencies and values have one shape."""
        f, P = np.shape(self.frequency), np.shape(self.value)
        if f != P:
            raise ValueError(f"value has the shape {P} and frequency {f}; they must be alike")


def handle_obstacle(response: Response) -> str:
    """Message: why nobody can hold the handle of a measured device, and what to do; "" where somebody can."""
    missing = (response.handle or MeasuredHandle()).missing
    if not missing:
        return ""
    paths = ", ".join(missing[:-1]) + " and " * (len(missing) > 1) + missing[-1]
    return (
        f'has no path {paths}; measure {"it" if len(missing) == 1 else "them"}, or state handle_at = "sensor" '
        'where the hand holds what the encoder reads, and actuator_at = "sensor" where the command acts there'
    )


def relative_error(coherence: Floats, averages: float) -> Floats:
    """Standard error of |P| over |P|, and of its phase in radians:  sqrt((1 - g^2) / (2 n g^2)).

    Bendat and Piersol, Random Data, 2nd ed., p. 317, known at second hand. The error of P is then a circular
    complex one with this deviation in its real and in its imaginary part.

    coherence  (...) magnitude squared g^2
    averages   n, independent averages
    Returns    (...); inf where the coherence is 0

    >>> round(float(relative_error(np.array(0.98), 10.0)), 4)
    0.0319
    """
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt((1.0 - coherence) / (2.0 * averages * coherence)))


def usable_frequencies(response: Response) -> Flags:
    """Which frequencies (n,) a chart is made of: the response finite, not zero, and coherent enough.

    Of the lowest, those before the first whose error is small are left out: there a device is as simple as what is
    fitted to it (`low_frequencies`), and that is surer. Of frequencies that differ by rounding alone, as where
    grids are joined, the first counts: nothing can be interpolated between them.
    """
    good = np.isfinite(response.value) & (response.value != 0.0)
    if response.coherence is not None:
        good &= response.coherence >= LEAST_COHERENCE
    kept = np.flatnonzero(good)
    f = response.frequency[kept]
    good[kept[1:][np.diff(f) <= SAME_FREQUENCY * f[1:]]] = False
    radius = joint_radius(response)
    if radius is not None and np.any(sure := good & (radius <= UNSURE)):
        good[: np.flatnonzero(sure)[0]] = False
    return np.asarray(good)


def low_frequencies(response: Response) -> LowFrequencies:
    """Stiffness, damping and mass to the ground that the lowest usable frequencies show."""
    good = usable_frequencies(response)
    error = None
    if response.coherence is not None:
        # of the complex error, both its parts together
        error = np.sqrt(2.0) * relative_error(response.coherence[good], response.averages)
    return fit_low_frequencies(response.frequency[good], response.value[good], error)


def integrators_of(response: Response, period: float) -> int:
    """Poles of P at z = 1: as stated, or read off the lowest frequencies.

    P (z - 1)^m is real and positive at z = 1, so that its phase falls to 0 with the frequency for the right m, and
    to a multiple of 90 degrees for any other. Where it has not yet done so at the lowest frequency, stiffness,
    damping and mass to the ground are fitted (`low_frequencies`), and the first of them that is seen decides.

    Raises ResponseError  where the phase contradicts what is stated, leaves the number open, or does not belong to
                          the magnitude, which falls like f^-m
    """
    good = usable_frequencies(response)
    f, P = response.frequency[good], response.value[good]
    # the first octave, in which the slope of |P| is fitted, and at least three frequencies; the phase is of three
    lowest = slice(0, max(3, int(np.searchsorted(f, 2.0 * f[0], side="right"))))
    z_less_1 = np.exp(2j * np.pi * f[:3] * period) - 1.0
    P_times_power = P[:3] * z_less_1 ** np.arange(3)[:, None]
    phases = np.angle(np.sum(P_times_power / np.abs(P_times_power), axis=1))
    exponent = -float(np.polyfit(np.log(f[lowest]), np.log(np.abs(P[lowest])), 1)[0])
    measured = np.degrees(np.angle(P[0]))
    where = f"the phase is {measured:.0f} degrees at {f[0]:.6g} Hz, the lowest frequency"
    nearest = int(np.argmin(np.abs(phases)))
    clear, settled = abs(phases[nearest]) < CLEAR, abs(phases[nearest]) < SETTLED
    # an exponent outside of 0 to 2.5 is that of a resonance or of noise, and contradicts nothing
    unlike = abs(exponent - nearest) > UNLIKE and 0.0 <= exponent <= 2.5
    fit = low_frequencies(response) if unlike or not settled else None
    if fit is not None and fit.first_seen and fit.first_seen[1] < 0.0 and fit.terms[2] < 0.0:
        raise ResponseError(
            f"{where}: the position moves against the force; is the sign of one of them turned? If not, the data "
            "begin above a resonance: measure lower"
        )
    if clear and unlike and not (fit and fit.closely and fit.integrators is not None):
        raise ResponseError(
            f"{where}, but the magnitude falls like f^-{exponent:.1f} there, which goes with "
            f"{-90 * min(round(exponent), 2)} degrees; are columns swapped, or is this no force to position?"
        )
    if response.integrators is not None:
        _check_stated(response.integrators, phases, nearest, clear, where)
        return response.integrators
    if fit is not None and fit.integrators is not None:
        return fit.integrators
    if not clear:
        raise ResponseError(
            f"the number of integrators cannot be read off: {where}, and no stiffness, damping and mass to the "
            "ground explain what is measured there; are the sign, the columns and the units right? If so, state "
            "integrators = 0, 1 or 2 in [response], or measure lower"
        )
    return nearest


def _check_stated(m: int, phases: Floats, nearest: int, clear: bool, where: str) -> None:
    """Raise ResponseError where the phase contradicts the stated number m of integrators.

    phases          (3,) of P (z - 1)^m at the lowest frequencies, for each number [rad]
    nearest, clear  the number whose phase is nearest to 0, and whether it is near enough
    where           the phase measured at the lowest frequency, in words
    """
    # the corner of a mass and a dashpot may lie below the data: there it lags as a free mass does
    free = m == 1 and nearest == 2 and clear
    if abs(phases[m]) > CONTRADICTED and not free:
        raise ResponseError(
            f"integrators = {m} does not fit: {where}, where {-90 * m} is expected; give 0 for a device on a "
            "spring, 1 for one with a dashpot to the ground, 2 for a free one, or measure lower"
        )


CONFIDENCE: Final = 0.95
POOLED: Final = 7  # neighbouring frequencies whose scatter is taken together


def joint_radius(response: Response) -> Floats | None:
    """Radius (n,) of the disk round each P, over |P|; with 95 % all disks together hold the true response.

    With n disks each has to hold its own with 1 - 0.05 / n (Bonferroni). A complex Gaussian error of variance v,
    estimated with nu complex degrees of freedom, is less than r with probability 1 - (1 + r^2 / (nu v))^-nu
    (Fisher's F with 2 and 2 nu degrees), so that

        r^2 = nu v ((n / 0.05)^(1 / nu) - 1),      for known v:  v ln(n / 0.05)

    From coherence v = (1 - g^2) / (a g^2) of a averages, a - 1 degrees unless they are given; known, if a is 1.
    From the scatter of k sweeps, v = u, their squared distance from their mean summed over k (k - 1), with that of
    their neighbours: 7 (k - 1) degrees. Of both, where there are both, the larger; but of what coherence tells,
    only the part k u that differs from sweep to sweep is averaged, v - (k - 1) u, at least v / k: an error that
    repeats itself, as that of an encoder's steps under the same force, is in the mean as well.

    Returns  None where neither coherence nor repetitions are known; inf where the coherence is 0

    >>> from zwidth.model.response import Response
    >>> exact = Response(np.arange(1.0, 11.0), np.ones(10, complex), coherence=np.full(10, 0.99), averages=16.0)
    >>> joint_radius(exact).round(4).tolist()[:2]
    [0.0633, 0.0633]
    """
    count = len(response.frequency)
    radii = []
    scatter = None if response.sweeps is None else _scatter(response.sweeps, response.value)
    repeated = 1 if response.sweeps is None else len(response.sweeps)
    with np.errstate(divide="ignore", invalid="ignore"):
        if scatter is not None:
            radii.append(_radius(scatter, np.full(count, POOLED * (repeated - 1.0)), count))
        if response.coherence is not None:
            averages, freedom = response.averages, response.freedom
            if freedom is None:
                freedom = np.full(count, averages - 1.0 if averages > 1.0 else np.inf)
            variance = (1.0 - response.coherence) / (averages * response.coherence)
            if scatter is not None:
                variance = np.maximum(variance - (repeated - 1.0) * scatter, variance / repeated)
            radii.append(_radius(variance, freedom, count))
    return np.asarray(np.max(radii, axis=0)) if radii else None


def _scatter(sweeps: Complexes, mean: Complexes) -> Floats:
    """Variance (n,) of the mean of sweeps (k, n), over |mean|^2, by their scatter and that of their neighbours."""
    repeated = len(sweeps)
    with np.errstate(divide="ignore", invalid="ignore"):
        single = np.sum(np.abs(sweeps / mean - 1.0) ** 2, axis=0) / ((repeated - 1) * repeated)
    padded = np.pad(np.where(np.isfinite(single), single, 0.0), POOLED // 2, mode="reflect")
    # the larger of its own scatter, if that is a number, and the mean with its neighbours
    return np.asarray(np.fmax(single, np.convolve(padded, np.full(POOLED, 1.0 / POOLED), mode="valid")))


def _radius(variance: Floats, freedom: Floats, count: int) -> Floats:
    """Radius (n,) that any of `count` errors of these variances (n,) exceeds with a probability of 5 %.

    freedom  (n,)  complex values from which each variance is known; inf: exactly
    """
    exponent = np.log(count / (1.0 - CONFIDENCE))
    known = np.isinf(freedom)
    with np.errstate(over="ignore", invalid="ignore"):
        estimated = np.where(known, 1.0, freedom) * np.expm1(exponent / np.where(known, np.inf, freedom))
        return np.asarray(np.sqrt(variance * np.where(known, exponent, estimated)))


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
        """1 / P (...) [N/m] at frequencies (...) [Hz] with this number of poles at z = 1: that many first terms
        are 0."""
        s = 2j * np.pi * np.asarray(frequency)[..., None]
        order = np.arange(TERMS)
        return np.asarray(np.sum(np.where(order < integrators, 0.0, self.terms) * s**order, axis=-1))

    def deviation(self, frequency: Floats) -> Floats:
        """Standard deviation (...) of 1 / P at frequencies [Hz], of its real and imaginary part together [N/m]."""
        s = (2.0 * np.pi * np.asarray(frequency))[..., None] ** np.arange(TERMS)
        sign = np.array([1.0, 1.0, -1.0, -1.0])  # i^n is 1, i, -1, -i: even terms are real, odd ones imaginary
        even, odd = s * sign * [1.0, 0.0, 1.0, 0.0], s * sign * [0.0, 1.0, 0.0, 1.0]
        squares = [np.einsum("...i,ij,...j->...", part, self.covariance, part) for part in (even, odd)]
        return np.asarray(np.sqrt(np.maximum(squares[0] + squares[1], 0.0)))

    @property
    def first_seen(self) -> tuple[int, float] | None:
        """Which term is the first that is seen at the lowest frequency, 0 for k, 1 for b, 2 for m, and its sign;
        None: nothing fits."""
        scale = (2.0 * np.pi * self.lowest) ** np.arange(TERMS)
        size, error = self.terms * scale, np.sqrt(np.diag(self.covariance)) * scale
        seen = np.abs(size) > np.maximum(SEEN_SHARE * np.max(np.abs(size[:3])), SEEN_DEVIATIONS * error)
        first = np.flatnonzero(seen[:3])
        return (int(first[0]), float(np.sign(size[first[0]]))) if self.fits and len(first) else None

    @property
    def integrators(self) -> int | None:
        """Poles of P at z = 1: as many as terms are not seen before the first one, if that is positive; None:
        unclear."""
        return self.first_seen[0] if self.first_seen and self.first_seen[1] > 0.0 else None


def fit_low_frequencies(frequency: Floats, value: Complexes, deviation: Floats | None) -> LowFrequencies:
    """Stiffness, damping and mass by linear least squares on P (k + b s + ...) = 1 at the lowest frequencies:
    those of the widest of REACHES that fits, or of the narrowest.

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
    """Terms (4,) of the fit, their covariance (4, 4), and how far P times the fit is from 1 (n,) at frequencies f
    (n,) [Hz]; error (n,) is the deviation of P over |P|."""
    scale = (2.0 * np.pi * f[-1]) ** np.arange(TERMS)
    equations = P[:, None] * (2j * np.pi * f[:, None]) ** np.arange(TERMS) / scale
    weighted = np.concatenate([equations.real, equations.imag]) / np.tile(error, 2)[:, None]
    # columns are solved for in units in which they have length 1
    size = np.maximum(np.linalg.norm(weighted, axis=0), 1e-300)
    wanted = np.concatenate([1.0 / error, np.zeros(len(f))])
    inverse = np.linalg.pinv(weighted / size, rcond=1e-12) / size[:, None]
    terms = inverse @ wanted
    misfit = np.abs(equations @ terms - 1.0)
    spread = max(1.0, float(np.sum((misfit / error) ** 2)) / max(2 * len(f) - TERMS, 1))
    # errors are complex, of this deviation: half of its square in each part
    covariance = spread * 0.5 * (inverse @ inverse.T)
    return terms / scale, covariance / np.outer(scale, scale), misfit
