"""The sampled response under every passive operator: at each frequency it fills a disk.

An operator is a passive impedance Z at the port: f = -Z(s) x_h', Re Z(jw) >= 0 and otherwise free at each
frequency, for positive real functions take any such values at any distinct frequencies. With it the response
from the wall's force to the reading is

    G = G_ya - G_yh G_ha s / (1/Z + Y),       Y = s G_hh

and as 1/Z fills the right half plane, 1/(1/Z + Y) fills the disk of centre and radius 1/(2 Re Y): a disk of G.
Sampling adds up the frequencies w_k = (theta + 2 pi k)/T that look alike, each with its own Z,

    P(e^(i theta)) = sum_k  W_k G(j w_k),     W_k = (1 - e^(-s T))/(s T) e^(-s d T) / (tau s + 1),  s = j w_k

(hold, delay of d samples, lag), so that P fills a disk again: centres and radii add up.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.special import gamma, roots_genlaguerre, zeta

from zwidth.guarantees.port import Floats, Port, port_response
from zwidth.loop.filters import low_pass_factors
from zwidth.loop.loop import Loop
from zwidth.loop.response import product

Complexes = NDArray[np.complex128]

# Terms of the expansion in 1/w that the far aliases are summed by, and where they begin beyond the fastest pole.
TERMS, REACH = 9, 16
# Between angles the curve of centres is followed to these shares of the radius and of its size.
BEND, STRAIGHT, HALVINGS = 0.05, 3e-6, 16
# Nodes in theta at which the aliases beyond the nearest are summed; they vary little over one period.
NODES = 13
# The expansion is moved out, four times as far each, until what it misses in all is less than the first share of a
# near alias; one that misses more than the second at last is of aliases that do not fall off.
MISSED, FALLS, MOVES = 1e-11, 1e-6, 4


@dataclass(frozen=True)
class Disks:
    """Where the sampled response can be at angles (k,): |P - centre| <= radius.

    radius  inf where the device dissipates nothing at one of the frequencies that look like this one
    """

    angles: Floats
    centre: Complexes
    radius: Floats


def response_disks(loop: Loop, held: Port, angles: Floats) -> Disks:
    """The disks of a loop held at a port, at angles in (0, pi].

    The nearest aliases are summed one by one; the rest is a smooth function of the angle, summed at Chebyshev
    nodes and, far out, by its expansion in 1/w (Hurwitz's zeta function, Laguerre's rule where a delay that is not
    whole turns the terms round). Relative error about 1e-12.
    """
    theta = np.asarray(angles, dtype=float)
    near, far = _ranges(loop, held)
    expansion = _expansion(loop, held, far)
    for _ in range(MOVES):
        if expansion.missed < MISSED:
            break
        far *= 4
        expansion = _expansion(loop, held, far)
    k = np.arange(-near, near + 1)
    centre, radius = _terms(loop, held, theta[:, None] / (2.0 * np.pi) + k)
    nodes = chebyshev.chebpts1(NODES) / 2.0
    more = np.arange(near + 1, far + 1)
    c, r = _terms(loop, held, nodes[:, None] + more)
    beyond_c, beyond_r = _sums_beyond(expansion, nodes, loop.fractional_delay)
    tail_c, tail_r = c.sum(axis=1) + beyond_c, r.sum(axis=1) + beyond_r
    # aliases -k at x are the conjugates of aliases k at -x
    tail_c, tail_r = tail_c + tail_c[::-1].conj(), tail_r + tail_r[::-1]
    at = theta / np.pi
    centre = centre.sum(axis=1) + _interpolated(tail_c, at)
    radius = radius.sum(axis=1) + _interpolated(tail_r, at).real
    late = np.exp(-1j * theta * loop.whole_delay)
    common = _one_less_z_inverse(theta) * late * force_filter_response(loop, theta)
    with np.errstate(invalid="ignore"):
        return Disks(theta, np.where(np.isfinite(radius), common * centre, 0.0), np.abs(common) * radius)


def followed_disks(loop: Loop, held: Port, angles: Floats) -> Disks:
    """The disks at ascending angles and at as many between as it takes to follow the centres' curve.

    Between neighbours the centre bends by less than BEND of the radius, or than STRAIGHT of its own size.
    """
    found = response_disks(loop, held, angles)
    split = np.ones(len(angles) - 1, dtype=bool)
    for _ in range(HALVINGS):
        left = np.flatnonzero(split)
        if not len(left):
            break
        middle = response_disks(loop, held, (found.angles[left] + found.angles[left + 1]) / 2.0)
        with np.errstate(invalid="ignore"):
            bend = np.abs(found.centre[left] + found.centre[left + 1] - 2.0 * middle.centre)
            keep = bend > np.maximum(BEND * middle.radius, STRAIGHT * np.abs(middle.centre))
        after = np.zeros(len(split) + len(left), dtype=bool)
        at = left + np.arange(len(left))
        after[at], after[at + 1] = keep, keep
        split = after
        found = Disks(
            np.insert(found.angles, left + 1, middle.angles),
            np.insert(found.centre, left + 1, middle.centre),
            np.insert(found.radius, left + 1, middle.radius),
        )
    return found


def _one_less_z_inverse(theta: Floats) -> Complexes:
    """1 - e^(-i theta) without cancellation."""
    return np.asarray(2j * np.sin(theta / 2.0) * np.exp(-0.5j * theta), dtype=complex)


def force_filter_response(loop: Loop, theta: Floats) -> Complexes:
    """The discrete filter of the whole force."""
    top, bottom = low_pass_factors(loop.controller.force_filter, loop.period)
    d = np.exp(1j * theta) * _one_less_z_inverse(theta)
    return np.asarray(product(np.array(top).reshape(-1, 3), np.array(bottom).reshape(-1, 3), d), dtype=complex)


def _terms(loop: Loop, held: Port, cycles: Floats) -> tuple[Complexes, Floats]:
    """Centre and radius of single aliases at w = 2 pi cycles / T, without the factor common to all."""
    T = loop.period
    w = 2.0 * np.pi * cycles / T
    response = port_response(held, w)
    with np.errstate(divide="ignore", invalid="ignore"):
        swing = response.back * response.felt / (2.0 * response.dissipation)
        weight = np.exp(-2j * np.pi * cycles * loop.fractional_delay) / T
        weight = weight / (1.0 + 1j * w * loop.controller.actuator_time_constant)
        dead = ~(response.dissipation > 0.0) & (np.abs(response.back * response.felt) > 0.0)
        swing = np.where(np.abs(response.back * response.felt) > 0.0, swing, 0.0)
        centre = weight * (response.direct / (1j * w) - swing)
        radius = np.abs(weight * swing)
    return np.where(dead, 0.0, centre), np.where(dead, np.inf, radius)


def _ranges(loop: Loop, held: Port) -> tuple[int, int]:
    """Aliases summed one by one, and where the expansion begins: beyond the poles in their units 2 pi/T."""
    lag = loop.controller.actuator_time_constant
    poles = np.append(held.poles, -1.0 / lag if lag > 0.0 else 0.0) * loop.period / (2.0 * np.pi)
    # a pole further than six turns from the frequency axis bends nothing that the nodes could miss
    close = np.abs(poles.imag[np.abs(poles.real) < 6.0])
    near = ceil(float(np.max(close, initial=0.0))) + 6
    return near, REACH * (near + ceil(float(np.max(np.abs(poles), initial=0.0))))


@dataclass(frozen=True)
class Expansion:
    """Far terms as  t^2 (c0 + c1 t + ...),  t = far / cycles; centres without their turning by the delay.

    missed  largest misfit of all far terms together, as a share of a near one; inf where nothing is dissipated
    """

    far: int
    centre: Complexes
    radius: Complexes
    missed: float


def _expansion(loop: Loop, held: Port, far: int) -> Expansion:
    t = (1.05 + chebyshev.chebpts1(2 * TERMS)) / 2.05
    cycles = far / t
    centre, radius = _terms(loop, held, cycles)
    upright = centre * np.exp(2j * np.pi * loop.fractional_delay * cycles)
    if not np.all(np.isfinite(radius)):
        return Expansion(far, np.zeros(TERMS, dtype=complex), np.zeros(TERMS, dtype=complex), np.inf)
    values = np.column_stack([upright, radius]) / (t * t)[:, None]
    powers = t[:, None] ** np.arange(TERMS)
    fit, *_ = np.linalg.lstsq(powers.astype(complex), values, rcond=None)
    near = _terms(loop, held, np.array([0.5]))[1][0] or 1.0
    misfit = far * np.abs(powers @ fit - values).max() / near
    return Expansion(far, fit[:, 0], fit[:, 1], float(misfit))


def _sums_beyond(expansion: Expansion, x: Floats, shift: float) -> tuple[Complexes, Floats]:
    """Sum over k > far of the terms at x + k, x (m,) in (-1/2, 1/2), term by term of the expansion."""
    if not expansion.missed < FALLS:
        return np.zeros(len(x), dtype=complex), np.full(len(x), np.inf)
    first = expansion.far + 1
    orders = np.arange(2, TERMS + 2)
    scale = float(expansion.far) ** orders
    turned = np.array([_powers_beyond(int(order), first + x, shift, first) for order in orders])
    plain = np.array([zeta(order, first + x) for order in orders])
    return (expansion.centre * scale) @ turned, ((expansion.radius * scale) @ plain).real


def _powers_beyond(order: int, start: Floats, shift: float, far: int) -> Complexes:
    """Sum over k >= 0 of e^(-2 pi i shift (start + k)) (start + k)^-order: Lerch's integral by Laguerre's rule."""
    if shift == 0.0:
        return np.asarray(zeta(order, start) + 0j, dtype=complex)
    turn = np.exp(-2j * np.pi * shift)
    # terms one by one until the integrand is smooth on the scale of its weight
    count = ceil(min(max(30.0 / abs(1.0 - turn) - far, 0.0), 2e5))
    k = np.arange(count)
    direct = np.array([np.sum(turn**k * (first + k) ** -float(order)) for first in start])
    nodes, weights = roots_genlaguerre(40, order - 1)
    last = start + count
    tail = (weights / (1.0 - turn * np.exp(-nodes / last[:, None]))).sum(axis=1)
    total = direct + turn**count * tail / (gamma(order) * last**order)
    return np.asarray(np.exp(-2j * np.pi * shift * start) * total, dtype=complex)


def _interpolated(values: Complexes | Floats, at: Floats) -> Complexes:
    """Values at the Chebyshev nodes of (-1, 1), interpolated at points (k,)."""
    if not np.all(np.isfinite(values)):
        return np.full(len(at), np.inf) + 0j
    degree = len(values) - 1
    basis = chebyshev.chebvander(chebyshev.chebpts1(len(values)), degree)
    return np.asarray(chebyshev.chebvander(at, degree) @ np.linalg.solve(basis, values), dtype=complex)
