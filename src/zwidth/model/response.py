"""A measured frequency response of a device: from the commanded force to the encoder's reading."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.model.joint_confidence import joint_radius
from zwidth.model.low_frequencies import LowFrequencies, fit_low_frequencies

LEAST_COHERENCE: Final = 0.5  # below it more of the reading is noise than is answer to the force
SAME_FREQUENCY: Final = 1e-9  # relative difference of two frequencies that are one
UNSURE: Final = 0.5  # relative error of the response, up to which the lowest frequencies are left out

# Phase of P (z - 1)^m at the lowest frequency, beyond which m is not believed [rad]
CLEAR, CONTRADICTED = np.radians(44.0), np.radians(75.0)
SETTLED = np.radians(5.0)  # the same phase, below which nothing else is asked
UNLIKE = 0.75  # by which the exponent of |P| may differ from the one that its phase tells


class ResponseError(ValueError):
    """A measured response that no chart can be made from; the text says why and what to do."""


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
    """Repetitions of one path, and their mean; a frequency is as coherent as in the worst of them."""
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
        f, P = np.shape(self.frequency), np.shape(self.value)
        if f != P:
            raise ValueError(f"value has the shape {P} and frequency {f}; they must be alike")


def handle_obstacle(response: Response) -> str:
    """Why nobody can hold the handle of a measured device, and what to do; "" where somebody can."""
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
    lowest = slice(0, max(3, int(np.searchsorted(f, 2.0 * f[0], side="right"))))
    d = np.exp(2j * np.pi * f[:3] * period) - 1.0
    whole = P[:3] * d ** np.arange(3)[:, None]
    phases = np.angle(np.sum(whole / np.abs(whole), axis=1))
    fall = -float(np.polyfit(np.log(f[lowest]), np.log(np.abs(P[lowest])), 1)[0])
    measured = np.degrees(np.angle(P[0]))
    where = f"the phase is {measured:.0f} degrees at {f[0]:.6g} Hz, the lowest frequency"
    nearest = int(np.argmin(np.abs(phases)))
    clear, settled = abs(phases[nearest]) < CLEAR, abs(phases[nearest]) < SETTLED
    unlike = abs(fall - nearest) > UNLIKE and 0.0 <= fall <= 2.5
    fit = low_frequencies(response) if unlike or not settled else None
    if fit is not None and fit.first_seen and fit.first_seen[1] < 0.0 and fit.terms[2] < 0.0:
        raise ResponseError(
            f"{where}: the position moves against the force; is the sign of one of them turned? If not, the data "
            "begin above a resonance: measure lower"
        )
    if clear and unlike and not (fit and fit.closely and fit.integrators is not None):
        raise ResponseError(
            f"{where}, but the magnitude falls like f^-{fall:.1f} there, which goes with "
            f"{-90 * min(round(fall), 2)} degrees; are columns swapped, or is this no force to position?"
        )
    if response.integrators is not None:
        m = response.integrators
        # the corner of a mass and a dashpot may lie below the data: there it lags as a free mass does
        free = m == 1 and nearest == 2 and clear
        if abs(phases[m]) > CONTRADICTED and not free:
            raise ResponseError(
                f"integrators = {m} does not fit: {where}, where {-90 * m} is expected; give 0 for a device on a "
                "spring, 1 for one with a dashpot to the ground, 2 for a free one, or measure lower"
            )
        return m
    if fit is not None and fit.integrators is not None:
        return fit.integrators
    if not clear:
        raise ResponseError(
            f"the number of integrators cannot be read off: {where}, and no stiffness, damping and mass to the "
            "ground explain what is measured there; are the sign, the columns and the units right? If so, state "
            "integrators = 0, 1 or 2 in [response], or measure lower"
        )
    return nearest
