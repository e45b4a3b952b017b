"""A measured frequency response of a device: from the commanded force to the encoder's reading."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# Phase of P (z - 1)^m at the lowest frequency, beyond which m is not believed [rad]
CLEAR, CONTRADICTED = np.radians(30.0), np.radians(75.0)
UNLIKE = 0.75  # by which the exponent of |P| may differ from the one that its phase tells


class ResponseError(ValueError):
    """A measured response that no chart can be made from; the text says why and what to do."""


@dataclass(frozen=True)
class Response:
    """P(exp(2 pi i f T)) at measured frequencies: force command sample -> encoder sample, hold and hardware delay
    included.

    frequency    (n,) [Hz], ascending, 0 < f <= 1/(2T)
    value        (n,) complex [m/N]; the mean where there are several sweeps
    integrators  poles at z = 1 (0, 1 or 2); None: to be read off the phase, see `integrators_of`
    coherence    (n,) magnitude squared, 0 to 1; None: not known
    averages     independent averages behind the coherence
    sweeps       (k, n) complex, the repetitions of which `value` is the mean; None: one measurement
    note         how the response was made, a sentence for people; "" where it was read unchanged
    """

    frequency: Floats
    value: Complexes
    integrators: int | None = None
    coherence: Floats | None = None
    averages: float = 1.0
    sweeps: Complexes | None = None
    note: str = ""

    def __post_init__(self) -> None:
        f, P = np.shape(self.frequency), np.shape(self.value)
        if f != P:
            raise ValueError(f"value has the shape {P} and frequency {f}; they must be alike")


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


def integrators_of(response: Response, period: float) -> int:
    """Poles of P at z = 1: as stated, or read off the phase at the lowest frequencies.

    P (z - 1)^m is real and positive at z = 1, so that its phase falls to 0 with the frequency for the right m, and
    to a multiple of 90 degrees for any other.

    Raises ResponseError  where the phase contradicts what is stated, leaves the number open, or does not belong to
                          the magnitude, which falls like f^-m
    """
    f, P = response.frequency, response.value
    lowest = slice(0, max(3, int(np.searchsorted(f, 2.0 * f[0], side="right"))))
    d = np.exp(2j * np.pi * f[:3] * period) - 1.0
    whole = P[:3] * d ** np.arange(3)[:, None]
    phases = np.angle(np.sum(whole / np.abs(whole), axis=1))
    fall = -float(np.polyfit(np.log(f[lowest]), np.log(np.abs(P[lowest])), 1)[0])
    measured = np.degrees(np.angle(P[0]))
    where = f"the phase is {measured:.0f} degrees at {f[0]:.6g} Hz, the lowest frequency"
    nearest = int(np.argmin(np.abs(phases)))
    if abs(phases[nearest]) < CLEAR and abs(fall - nearest) > UNLIKE and 0.0 <= fall <= 2.5:
        raise ResponseError(
            f"{where}, but the magnitude falls like f^-{fall:.1f} there, which goes with "
            f"{-90 * min(round(fall), 2)} degrees; are columns swapped, or is this no force to position?"
        )
    if response.integrators is not None:
        m = response.integrators
        if abs(phases[m]) > CONTRADICTED:
            raise ResponseError(
                f"integrators = {m} does not fit: {where}, where {-90 * m} is expected; give 0 for a device on a "
                "spring, 1 for one with a dashpot to the ground, 2 for a free one, or measure lower"
            )
        return m
    if abs(phases[nearest]) > CLEAR:
        raise ResponseError(
            f"the number of integrators cannot be read off: {where}, which is not near 0, -90 or -180; "
            "state integrators = 0, 1 or 2 in [response], or measure lower"
        )
    return nearest
