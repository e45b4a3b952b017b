"""How far a wall can be scaled up before some passive operator makes it vibrate.

At each angle the sampled response fills a disk |P - C| <= R (see `disks`). A wall with H = K + B w(z) keeps clear
of vibration with every passive operator if and only if no P of the disk makes 1 + P H vanish,

    1 + 2 Re(H C) + |H|^2 (|C|^2 - R^2) > 0,        0 < theta <= pi

Along a ray lambda H the smallest lambda that fails is 1/mu,

    mu = -Re(H C) + sqrt( |H|^2 R^2 - Im(H C)^2 )

and the largest mu over all angles says how far the ray may go. The kernel below walks along the angles once for
each wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zwidth.compiled import compiled
from zwidth.guarantees.disks import Disks, followed_disks
from zwidth.guarantees.port import Floats, port, static_compliances
from zwidth.loop.loop import Loop

Complexes = NDArray[np.complex128]

# |C| and R closer than this are equal, and products of theirs below this share are zero.
ROUNDING = 1e-13


@dataclass(frozen=True)
class Gauge:
    """The sampled response under every passive operator, as walls meet it.

    disks    of the sampled response
    w        velocity estimate at the same angles
    static   compliances that springs can make of the reading at z = 1 [m/N]
    """

    disks: Disks
    w: Complexes
    static: tuple[float, float]

    def largest(self, K: Floats, B: Floats) -> tuple[Floats, NDArray[np.int64]]:
        """mu (k,) of walls (k,), and the interval of angles that it comes from: the index of its lower end.

        Never negative; inf where a wall fails at once. A wall is passive if and only if its mu is below 1.
        """
        disks = self.disks
        mu, worst = _largest(K, B, disks.angles, disks.centre, disks.radius, self.w)
        with np.errstate(invalid="ignore"):
            drift = np.max([np.where(K == 0.0, 0.0, -g * K) for g in self.static], axis=0)
        return np.maximum(np.maximum(mu, drift), 0.0), worst


def gauge(loop: Loop, held: Floats, angles: Floats) -> Gauge:
    """The gauge of a loop held along `held` (n,), at ascending angles and as many between as it takes."""
    disks = followed_disks(loop, port(loop.plant, held), angles)
    w = np.asarray(loop.velocity_response(np.exp(1j * disks.angles)), dtype=complex)
    return Gauge(disks, w, static_compliances(loop.plant, held))


@compiled
def _mu(H: complex, C: complex, R: float, excess: float) -> float:
    """mu at one angle, excess being R^2 - |C|^2; -inf where the ray passes the disk by."""
    if np.inf == R:
        return np.inf
    size = H.real * H.real + H.imag * H.imag
    beta = H.real * C.real - H.imag * C.imag
    if beta * beta < ROUNDING * ROUNDING * size * R * R:
        beta = 0.0
    under = beta * beta + size * excess
    return np.sqrt(under) - beta if under >= 0.0 else -np.inf


@compiled
def _crossing(first: complex, last: complex, reach0: float, reach1: float) -> float:
    """mu between two angles where Im(H C) changes sign.

    A disk that is small beside its distance from 0 is met by a ray at angles closer together than any grid. With
    H C straight and R level between the angles the largest mu is

        -Re(H C) + |H| R |slope of H C| / |slope of Im(H C)|
    """
    if not np.isfinite(reach0 + reach1):
        return -np.inf
    share = first.imag / (first.imag - last.imag)
    room = reach0 + share * (reach1 - reach0)
    step = last - first
    lean = abs(step) / abs(step.imag)
    if room * lean < abs(step.imag):  # wide disks are met at the angles themselves
        room *= lean
    return room - first.real - share * step.real


@compiled
def _vertex(x: Floats, y: tuple[float, float, float], i: int) -> float:
    """Top of the parabola through three points about x[i]; -inf where it has none between them."""
    left, right = x[i - 1] - x[i], x[i + 1] - x[i]
    fall, rise = (y[0] - y[1]) / left, (y[2] - y[1]) / right
    bend = (rise - fall) / (right - left)
    slope = fall - bend * left
    at = -slope / (2.0 * bend)
    top = y[1] - slope * slope / (4.0 * bend)
    return top if bend < 0.0 and left < at < right and np.isfinite(top) else -np.inf


@compiled
def _largest(
    K: Floats, B: Floats, angles: Floats, C: Complexes, R: Floats, w: Complexes
) -> tuple[Floats, NDArray[np.int64]]:
    """Largest mu over all angles (k,) of walls (k,), and the interval that it comes from."""
    count, m = len(K), len(angles)
    out, at = np.empty(count), np.zeros(count, dtype=np.int64)
    excess = np.empty(m)
    for i in range(m):
        excess[i] = (R[i] - abs(C[i])) * (R[i] + abs(C[i]))
        if abs(excess[i]) < ROUNDING * R[i] * R[i]:
            excess[i] = 0.0
    # the limit at zero, from the lowest angle and about its double
    twice = 1
    while twice < m - 1 and angles[twice] < 2.0 * angles[0]:
        twice += 1
    share = 1.0 / ((angles[twice] / angles[0]) ** 2 - 1.0)
    for k in range(count):
        top, met = -np.inf, -np.inf
        place, narrow = 0, 0
        before = 0.0 + 0.0j
        for i in range(m):
            H = K[k] + B[k] * w[i]
            mu = _mu(H, C[i], R[i], excess[i])
            if mu > top:
                top, place = mu, i
            after = H * C[i]
            if i > 0 and before.imag * after.imag < 0.0:
                reach0, reach1 = abs(K[k] + B[k] * w[i - 1]) * R[i - 1], abs(H) * R[i]
                crossed = _crossing(before, after, reach0, reach1)
                if crossed > met:
                    met, narrow = crossed, i - 1
            before = after
        i = min(max(place, 1), m - 2)
        low = _mu(K[k] + B[k] * w[i - 1], C[i - 1], R[i - 1], excess[i - 1])
        middle = _mu(K[k] + B[k] * w[i], C[i], R[i], excess[i])
        high = _mu(K[k] + B[k] * w[i + 1], C[i + 1], R[i + 1], excess[i + 1])
        top = max(top, _vertex(angles, (low, middle, high), i))
        low = _mu(K[k] + B[k] * w[0], C[0], R[0], excess[0])
        middle = _mu(K[k] + B[k] * w[twice], C[twice], R[twice], excess[twice])
        if np.isfinite(low + middle):
            top = max(top, low + share * (low - middle))
        out[k] = max(top, met)
        at[k] = narrow if met > top else place
    return out, at
