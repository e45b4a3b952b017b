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
from scipy.special import gamma, roots_genlaguerre, zeta

from zwidth.arrays import Complexes, Floats
from zwidth.guarantees.port import Port, port_response
from zwidth.loop.factor_response import factor_response, feedforward_response
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import low_pass_factors

# Number of terms of the expansion in 1/w for the far aliases, and how far beyond the fastest pole it begins.
TERMS, REACH = 9, 16
# Nodes in theta at which the aliases beyond the nearest are summed; they vary little over one period.
NODES = 13
# A radius smaller than this share of the centre is rounding: the reading hardly sees the operator.
SEEN = 1e-13
# A sum smaller than its terms by this share is zero.
ROUNDING = 1e-13
# The expansion is moved out, four times as far each, until what it misses in all is less than the first share of a
# near alias; one that misses more than the second at last is of aliases that do not fall off.
MISSED, FALLS, MOVES = 1e-11, 1e-6, 4


@dataclass(frozen=True)
class Disks:
    """The disks |P - centre| <= radius of the sampled response at angles (k,).

    radius  inf where the device dissipates nothing at one of the aliases
    power   |centre|^2 - radius^2, the power of the point 0: negative where the disk holds it, exactly 0 where it
            goes through it
    """

    angles: Floats
    centre: Complexes
    radius: Floats
    power: Floats


def response_disks(loop: Loop, held_port: Port, angles: Floats) -> Disks:
    """The disks of a loop held at a port, at angles in (0, pi]; relative error about 1e-12."""
    return Aliases.of(loop, held_port).disks(angles)


@dataclass(frozen=True)
class Aliases:
    """The sums over all aliases of a frequency, prepared for one loop.

    The nearest aliases are summed one by one at each angle; the rest is a smooth function of the angle, summed at
    Chebyshev nodes and, far out, by its expansion in 1/w (Hurwitz's zeta function, Laguerre's rule where a delay
    that is not whole turns the terms round).

    near    aliases -near to near are summed one by one
    centre  (NODES,)  centres of the others' disks, summed
    radius  (NODES,)  their radii
    """

    loop: Loop
    held_port: Port
    near: int
    centre: Complexes
    radius: Floats

    @classmethod
    def of(cls, loop: Loop, held: Port) -> Aliases:
        """The sums of a loop, its plant held at a port; the expansion begins as far out as it has to."""
        near, far = _near_and_far(loop, held)
        expansion = _expansion(loop, held, far)
        for _ in range(MOVES):
            if expansion.misfit < MISSED or np.isinf(expansion.misfit):
                break
            far *= 4
            expansion = _expansion(loop, held, far)
        nodes = chebyshev.chebpts1(NODES) / 2.0
        direct, swing = _alias_terms(loop, held, nodes[:, None] + np.arange(near + 1, far + 1))
        beyond_c, beyond_r = _sums_beyond(expansion, nodes, loop.fractional_delay)
        centre, radius = (direct - swing).sum(axis=1) + beyond_c, np.abs(swing).sum(axis=1) + beyond_r
        # aliases -k at x are the conjugates of aliases k at -x
        return cls(loop, held, near, centre + centre[::-1].conj(), radius + radius[::-1])

    def disks(self, angles: Floats) -> Disks:
        """The disks at angles (k,) in (0, pi]."""
        theta = np.asarray(angles, dtype=float)
        k = np.arange(-self.near, self.near + 1)
        direct, swing = _alias_terms(self.loop, self.held_port, theta[:, None] / (2.0 * np.pi) + k)
        # p, q of the frequency itself, k = 0; c, r of all others together
        p, q, others = direct[:, self.near], swing[:, self.near], k != 0
        at = theta / np.pi
        delay = np.exp(-1j * theta * self.loop.whole_delay)
        common = one_less_z_inverse(theta) * delay * force_filter_response(self.loop, theta)
        with np.errstate(invalid="ignore"):
            c = (direct - swing)[:, others].sum(axis=1) + _interpolated(self.centre, at)
            r = np.abs(swing)[:, others].sum(axis=1) + _interpolated(self.radius, at).real
            centre, radius = common * (p - q + c), np.abs(common) * (np.abs(q) + r)
            power = np.abs(common) ** 2 * _power(p, q, c, r)
            if self.loop.has_fixed_feedback:
                centre, radius, power = _with_feedforward(self.loop, theta, centre, radius, power)
        unbounded = ~np.isfinite(radius)
        centre, radius = np.where(unbounded, 0.0, centre), np.where(unbounded, np.inf, radius)
        return Disks(theta, centre, radius, np.where(unbounded, -np.inf, power))


def _with_feedforward(
    loop: Loop, theta: Floats, centre: Complexes, radius: Floats, power: Floats
) -> tuple[Complexes, Floats, Floats]:
    """The disks (k,) of P/(1 - q P) for the P of disks |P - c| <= r, q the feedforward's response:

        c' = (c - X conj q)/a,   r' = r/a,   X' = X/a,        a = 1 - 2 Re(c q) + X |q|^2,   X = |c|^2 - r^2

    Where some passive operator makes a part of q vibrate no wall is stable with all of them: the radius is inf
    there, the centre 0 and X -inf.

    Raises  ValueError  with feedback other than feedforward
    """
    ahead = loop.controller.feedforward
    if ahead is None or len(loop.controller.fixed_feedback) > 1:
        raise ValueError("the sampled response fills a disk with feedforward alone; leave out the other feedback")
    d = np.exp(1j * theta) * one_less_z_inverse(theta)
    q = feedforward_response(ahead, loop.period, 1.0 + d, d)
    along, square = -np.real(centre * q), power * np.abs(q) ** 2
    # 1/mu is the part of q at which it fails first, as for walls (`gauge`) with H = -q: it fails if that is at
    # most the whole of q, and the discriminant |q|^2 r^2 - Im(c q)^2 is not negative
    root = np.sqrt(np.maximum(along**2 - square, 0.0))
    mu = np.where(along > 0.0, -square / np.maximum(along + root, 1e-300), root - along)
    fails = (np.abs(q) ** 2 * radius**2 >= np.imag(centre * q) ** 2) & ~(mu < 1.0)
    scale = 1.0 + 2.0 * along + square
    closed = (centre - power * q.conj()) / scale, radius / scale, power / scale
    return np.where(fails, 0.0, closed[0]), np.where(fails, np.inf, closed[1]), np.where(fails, -np.inf, closed[2])


def _power(p: Complexes, q: Complexes, c: Complexes, r: Floats) -> Floats:
    """|p - q + c|^2 - (|q| + r)^2 (k,) without the cancellation of |q|^2; what rounding alone can leave is 0.

    p - q and |q| are centre and radius of the lowest frequency's own disk: at low angles it is all but a half
    plane, |q| many orders larger than what is left. c and r are centre and radius that the other aliases add.
    """
    own_power = np.abs(p) ** 2 - 2.0 * np.real(p * q.conj())
    own_centre = np.abs(p - q)
    mixed = 2.0 * np.real((p - q) * c.conj()) - 2.0 * np.abs(q) * r
    power = own_power + mixed + (np.abs(c) - r) * (np.abs(c) + r)
    terms = np.abs(p) * (np.abs(p) + np.abs(q)) + own_centre * np.abs(c) + np.abs(q) * r + np.abs(c) ** 2 + r**2
    return np.where(np.abs(power) > ROUNDING * terms, power, 0.0)


def one_less_z_inverse(theta: Floats) -> Complexes:
    """1 - 1/z at z = e^(i theta), (k,), without cancellation near theta = 0."""
    return np.asarray(2j * np.sin(theta / 2.0) * np.exp(-0.5j * theta), dtype=complex)


def force_filter_response(loop: Loop, theta: Floats) -> Complexes:
    """Response of the discrete filter of the whole force at angles theta = w T, (k,)."""
    top, bottom = low_pass_factors(loop.controller.force_filter, loop.period)
    d = np.exp(1j * theta) * one_less_z_inverse(theta)
    return np.asarray(
        factor_response(np.array(top).reshape(-1, 3), np.array(bottom).reshape(-1, 3), d), dtype=complex
    )


def _alias_terms(loop: Loop, held_port: Port, cycles: Floats) -> tuple[Complexes, Complexes]:
    """Of single aliases at w = 2 pi cycles / T, without the factor common to all: the response p to the actuator
    and the swing q that operators add. The alias's disk has centre p - q and radius |q|; inf where it has none."""
    T = loop.period
    w = 2.0 * np.pi * cycles / T
    response = port_response(held_port, w)
    coupling = response.port_to_reading * response.actuator_to_port
    weight = np.exp(-2j * np.pi * cycles * loop.fractional_delay) / T
    weight = weight / (1.0 + 1j * w * loop.controller.actuator_time_constant)
    # the s of the swing, G_yh G_ha s/(2 Re Y), cancels that of the hold
    dead = ~(response.dissipation > 0.0) & (np.abs(coupling) > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        swing = np.where(np.abs(coupling) > 0.0, weight * coupling / (2.0 * response.dissipation), 0.0)
    return weight * response.direct / (1j * w), np.where(dead, np.inf, swing)


def _near_and_far(loop: Loop, held_port: Port) -> tuple[int, int]:
    """Number of aliases summed one by one, and that at which the expansion begins, beyond all poles."""
    lag = loop.controller.actuator_time_constant
    poles = np.append(held_port.poles, -1.0 / lag if lag > 0.0 else 0.0) * loop.period / (2.0 * np.pi)
    # a pole further than six turns from the frequency axis bends nothing that the nodes could miss
    close = np.abs(poles.imag[np.abs(poles.real) < 6.0])
    near = ceil(float(np.max(close, initial=0.0))) + 6
    return near, REACH * (near + ceil(float(np.max(np.abs(poles), initial=0.0))))


@dataclass(frozen=True)
class Expansion:
    """Far terms as  t^2 (c0 + c1 t + ...),  t = far / cycles; centres without their turning by the delay.

    misfit  largest misfit of all far terms together, as a share of a near one; inf where nothing is dissipated
    """

    far: int
    centre: Complexes
    radius: Complexes
    misfit: float


def _expansion(loop: Loop, held_port: Port, far: int) -> Expansion:
    """The `Expansion` of aliases beyond number `far`, fitted at Chebyshev nodes in t = far / cycles."""
    t = (1.05 + chebyshev.chebpts1(2 * TERMS)) / 2.05  # from next to 0, where cycles are infinite, to 1
    cycles = far / t
    direct, swing = _alias_terms(loop, held_port, cycles)
    radius = np.abs(swing)
    if not np.all(np.isfinite(radius)):
        return Expansion(far, np.zeros(TERMS, dtype=complex), np.zeros(TERMS, dtype=complex), np.inf)
    # centres turned back by the delay's part, without which they are smooth in t
    upright = (direct - swing) * np.exp(2j * np.pi * loop.fractional_delay * cycles)
    values = np.column_stack([upright, radius]) / (t * t)[:, None]
    powers = t[:, None] ** np.arange(TERMS)
    fit, *_ = np.linalg.lstsq(powers.astype(complex), values, rcond=None)
    # the near alias by which the misfit is measured is at half the sampling rate; about `far` misfits add up
    direct, swing = _alias_terms(loop, held_port, np.array([0.5]))
    centre, radius = np.abs(direct - swing)[0], np.abs(swing)[0]
    near = np.maximum([centre, radius], SEEN * (centre + radius)) if centre + radius > 0.0 else np.ones(2)
    misfit = far * (np.abs(powers @ fit - values).max(axis=0) / near).max()
    return Expansion(far, fit[:, 0], fit[:, 1], float(misfit))


def _sums_beyond(expansion: Expansion, x: Floats, shift: float) -> tuple[Complexes, Floats]:
    """Sums of centres and of radii (m,) over aliases x + k, k > far, x (m,) in (-1/2, 1/2), by expansion; shift is
    the delay's fraction. Radii inf where the expansion does not fall off."""
    if not expansion.misfit < FALLS:
        return np.zeros(len(x), dtype=complex), np.full(len(x), np.inf)
    first = expansion.far + 1
    orders = np.arange(2, TERMS + 2)
    scale = float(expansion.far) ** orders
    turned = np.array([_powers_beyond(int(order), first + x, shift, first) for order in orders])
    plain = np.array([zeta(order, first + x) for order in orders])
    return (expansion.centre * scale) @ turned, ((expansion.radius * scale) @ plain).real


def _powers_beyond(order: int, start: Floats, shift: float, far: int) -> Complexes:
    """Sum over k >= 0 of e^(-2 pi i shift (start + k)) (start + k)^-order, at start (m,): Lerch's integral by
    Laguerre's rule.

    far  about the least start, which tells how many terms are to be summed before the rule holds
    """
    if shift == 0.0:
        return np.asarray(zeta(order, start) + 0j, dtype=complex)
    turn = np.exp(-2j * np.pi * shift)
    # terms one by one until the integrand is smooth on the scale of its weight
    count = ceil(min(max(30.0 / abs(1.0 - turn) - far, 0.0), 2e5))
    k = np.arange(count)
    direct = np.array([np.sum(turn**k * (first + k) ** -float(order)) for first in start])
    # Lerch: the others are the integral of s^(order - 1) e^(-s)/(1 - turn e^(-s/last)) / (gamma(order) last^order)
    nodes, weights = roots_genlaguerre(40, order - 1)
    last = start + count
    tail = (weights / (1.0 - turn * np.exp(-nodes / last[:, None]))).sum(axis=1)
    total = direct + turn**count * tail / (gamma(order) * last**order)
    return np.asarray(np.exp(-2j * np.pi * shift * start) * total, dtype=complex)


def _interpolated(values: Complexes | Floats, at: Floats) -> Complexes:
    """Values (n,) at the n Chebyshev nodes of (-1, 1), interpolated at points (k,); inf unless all are
    finite."""
    if not np.all(np.isfinite(values)):
        return np.full(len(at), np.inf) + 0j
    degree = len(values) - 1
    basis = chebyshev.chebvander(chebyshev.chebpts1(len(values)), degree)
    return np.asarray(chebyshev.chebvander(at, degree) @ np.linalg.solve(basis, values), dtype=complex)
