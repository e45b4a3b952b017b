"""The plant between samples: exact zero-order hold, also for delays that are not whole samples.

A delay of l + f samples (l whole, 0 <= f < 1) splits the interval: the old force u_{j-l-1} acts during f T,
the new one u_{j-l} during the remaining (1 - f) T. Each pair of poles gives one section of

    P(z) = z^-l  sum_k  [ (n1 d + n0) + (o1 d + o0) / z ] / (d^2 + d1 d + d0),      d = z - 1,

written in d so that poles that crowd z = 1 (fast sampling) keep all their digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, expm1, sin, sinh, sqrt

import numpy as np
from numpy.typing import NDArray

from zwidth.model.modes import REPEATED, DampedModes, RealModes, damped_modes, real_modes
from zwidth.model.plant import Plant

Floats = NDArray[np.float64]

# A pole pair whose residue is below this share of all residues is rounding: no wall moves it.
UNOBSERVED = 1e-11
# The same for a mode without damping: the wall would move its poles by less than the band in which stability is
# left undecided, so that it could only hide the stability of the rest.
UNOBSERVED_UNDAMPED = 1e-9


class UnmovedError(ValueError):
    """A plant of which the wall moves nothing that the sensor reads."""


@dataclass(frozen=True)
class Sections:
    """The sampled plant, one row per observed pair of poles, and the names of what was cancelled.

    rows        (m, 6)  d1, d0, n1, n0, o1, o0
    unobserved  motions that the wall force does not move or the sensor does not read
    """

    rows: Floats
    unobserved: tuple[str, ...]


def step_response(decay: float, squared: float, time: float) -> tuple[float, float]:
    """Position and velocity after a unit force has acted for `time` on xi'' + 2 a xi' + w^2 xi = 1, from rest.

        g(t) = t^2 exp[0, s1 t, s2 t],    g'(t) = t exp[s1 t, s2 t]       (divided differences of exp)

    with s1, s2 the roots of s^2 + 2 a s + w^2. Near 0 the power series of the divided difference is summed, which
    covers rigid, undamped and critically damped modes without cases; elsewhere the closed forms hold.
    """
    total, product = -2.0 * decay * time, squared * time * time
    mean, gap = -decay * time, (squared - decay * decay) * time * time
    if gap > 0.0:
        velocity = exp(mean) * (sin(sqrt(gap)) / sqrt(gap))
    elif gap < 0.0:
        root = sqrt(-gap)
        # exp(mean) sinh(root) would overflow for strong damping
        velocity = (
            (exp(mean + root) - exp(mean - root)) / (2.0 * root) if root > 1.0 else (exp(mean) * sinh(root) / root)
        )
    else:
        velocity = exp(mean)
    if abs(total) + abs(product) <= 1.0:
        term, previous, weight, position = 1.0, 0.0, 2.0, 0.5
        for k in range(1, 40):
            term, previous = total * term - product * previous, term
            weight *= k + 2
            position += term / weight
            if abs(term) <= 1e-20 * weight and abs(previous) <= 1e-20 * weight:
                break
    elif gap >= 0.0:
        swing = sqrt(gap)
        shape = cos(swing) - mean * (sin(swing) / swing if swing > 0.0 else 1.0)
        position = (1.0 - exp(mean) * shape) / product
    else:
        root = sqrt(-gap)
        large = mean - root if mean <= 0.0 else mean + root
        small = product / large
        position = (velocity - (expm1(small) / small if small != 0.0 else 1.0)) / large
    return position * time * time, velocity * time


def real_section(decay: float, squared: float, period: float, fraction: float) -> Floats:
    """One second-order mode of unit participation as a section (6,)."""
    a, T = decay, period
    gap = squared - a * a
    if gap > 0.0:
        swing = sqrt(gap) * T
        real = expm1(-a * T) * cos(swing) - 2.0 * sin(swing / 2.0) ** 2
        imag = exp(-a * T) * sin(swing)
        d1, d0 = -2.0 * real, real * real + imag * imag
    else:
        root = sqrt(-gap)
        large = -a - root if a >= 0.0 else -a + root
        small = squared / large if large != 0.0 else 0.0
        first, second = expm1(large * T), expm1(small * T)
        d1, d0 = -(first + second), first * second
    position, velocity = step_response(a, squared, T)
    new_position, new_velocity = step_response(a, squared, (1.0 - fraction) * T)
    # Phi_12 = g'(T) and 1 - Phi_22 = 1 - g''(T), read off the mode's own equation
    lag = 2.0 * a * velocity + squared * position
    old_position, old_velocity = position - new_position, velocity - new_velocity
    return np.array(
        [
            d1,
            d0,
            new_position,
            lag * new_position + velocity * new_velocity,
            old_position,
            lag * old_position + velocity * old_velocity,
        ]
    )


def _label(squared: float, decay: float) -> str:
    """A motion's name for people."""
    if squared <= 0.0:
        return "rigid motion (0 Hz)" if squared == 0.0 else "unstable motion (negative stiffness)"
    rate = sqrt(squared)
    return f"mode at {rate / (2.0 * np.pi):.4g} Hz (damping ratio {decay / rate:.3g})"


def _real_sections(modes: RealModes, period: float, fraction: float) -> Sections:
    """Sections of classically damped modes; equal modes are one pair of poles with the sum of their residues."""
    residue = modes.input * modes.output
    total = float(np.sum(np.abs(modes.input)) * np.sum(np.abs(modes.output)))
    scale = max(float(np.max(np.abs(modes.frequency_squared))), np.finfo(float).tiny)
    drag = max(float(np.max(np.abs(modes.decay))), np.finfo(float).tiny)
    groups: list[list[int]] = []
    for k in range(len(residue)):
        for group in groups:
            same_frequency = (
                abs(modes.frequency_squared[k] - modes.frequency_squared[group[0]]) <= REPEATED * scale
            )
            if same_frequency and abs(modes.decay[k] - modes.decay[group[0]]) <= REPEATED * drag:
                group.append(k)
                break
        else:
            groups.append([k])
    rows, unobserved = [], []
    for group in groups:
        decay, squared = float(modes.decay[group[0]]), float(modes.frequency_squared[group[0]])
        strength = float(np.sum(residue[group]))
        row = real_section(decay, squared, period, fraction)
        row[2:] *= strength
        # What counts is the sampled residue: a mode at a multiple of the sampling rate is not reached by a hold
        level = total * period**2 * (UNOBSERVED_UNDAMPED if abs(decay) * period < 1e-9 else UNOBSERVED)
        observed = bool(np.max(np.abs(row[2:])) > level)
        unobserved += [_label(squared, decay)] * (len(group) - observed)
        if observed:
            rows.append(row)
    return Sections(np.array(rows).reshape(-1, 6), tuple(unobserved))


def _damped_sections(modes: DampedModes, period: float, fraction: float) -> Sections:
    """Sections of first-order modes, conjugates together and real poles two by two."""
    rows, unobserved = [], []
    if modes.free_count:
        row = real_section(0.0, 0.0, period, fraction)
        row[2:] *= modes.free
        rows.append(row)
        unobserved += [_label(0.0, 0.0)] * (modes.free_count - 1)
    rest = (1.0 - fraction) * period
    e = _expm1(modes.poles * period)
    gain = modes.residues * _integral(modes.poles, period)
    new = modes.residues * _integral(modes.poles, rest)
    old = gain - new
    level = UNOBSERVED * max(float(np.sum(np.abs(gain))), abs(modes.free) * period**2)
    for k in np.flatnonzero(modes.poles.imag > 0.0):
        if abs(gain[k]) <= level:
            unobserved.append(f"mode at {abs(modes.poles[k]) / (2.0 * np.pi):.4g} Hz (coupled damping)")
            continue
        pair = [2.0 * new[k].real, -2.0 * (new[k] * e[k].conjugate()).real]
        rows.append(
            np.array(
                [
                    -2.0 * e[k].real,
                    abs(e[k]) ** 2,
                    *pair,
                    2.0 * old[k].real,
                    -2.0 * (old[k] * e[k].conjugate()).real,
                ]
            )
        )
    real = np.flatnonzero(modes.poles.imag == 0.0)
    seen = [k for k in real[np.argsort(modes.poles.real[real])] if abs(gain[k]) > level]
    unobserved += ["overdamped motion"] * (len(real) - len(seen))
    for i in range(0, len(seen), 2):
        pair_of = seen[i : i + 2]
        rows.append(_real_pair(e.real[pair_of], new.real[pair_of], old.real[pair_of]))
    return Sections(np.array(rows).reshape(-1, 6), tuple(unobserved))


def _real_pair(e: Floats, new: Floats, old: Floats) -> Floats:
    """Two real poles as one section; a lone one is joined by a pole at z = 0 under a zero at z = 0, which no
    wall moves and which decays at once."""
    if len(e) == 1:
        return np.array([1.0 - e[0], -e[0], new[0], new[0], old[0], old[0]])
    crossed = e[::-1]
    return np.array(
        [-np.sum(e), np.prod(e), np.sum(new), -np.sum(new * crossed), np.sum(old), -np.sum(old * crossed)]
    )


def _expm1(x: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """exp(x) - 1 for complex x without cancellation near 0."""
    real = np.expm1(x.real) * np.cos(x.imag) - 2.0 * np.sin(x.imag / 2.0) ** 2
    return real + 1j * np.exp(x.real) * np.sin(x.imag)


def _integral(s: NDArray[np.complex128], time: float) -> NDArray[np.complex128]:
    """Integral of exp(s t) over [0, time]: (exp(s time) - 1) / s, and time where s = 0."""
    safe = np.where(s == 0.0, 1.0, s)
    return np.where(s == 0.0, time, _expm1(s * time) / safe)


def sampled_sections(plant: Plant, period: float, fraction: float) -> Sections:
    """The plant's sections for a sampling period T [s] and the fractional part f of the delay [samples].

    Raises UnmovedError where no mode is both moved by the wall force and read by the sensor.
    """
    modes = real_modes(plant)
    if modes is not None:
        sections = _real_sections(modes, period, fraction)
    else:
        sections = _damped_sections(damped_modes(plant), period, fraction)
    if not len(sections.rows):
        raise UnmovedError("the wall force moves nothing that the sensor reads; check actuator and sensor")
    return sections
