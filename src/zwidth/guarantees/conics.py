"""The condition of each angle on a wall, as polynomials in the angle's logarithm.

The disk |P - C| <= R of an angle keeps clear of -1/H, H = K + B w, if and only if  1 + 2 a + b > 0  with

    a = Re(H C)           = K Re C + B Re(w C)
    b = |H|^2 (|C|^2 - R^2) = (K^2 + 2 K B Re w + B^2 |w|^2) (|C|^2 - R^2)

a conic in the plane of walls. Its coefficients are smooth functions of the angle: they are computed at Chebyshev
points of panels, panels are halved until polynomials through the points are exact to TOLERANCE, and each panel is
cut into short pieces with a quartic each. Panels start narrow across resonances of the plant and of the radii.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.guarantees.disks import Aliases, Disks, force_filter_response, one_less_z_inverse
from zwidth.guarantees.port import Port, port
from zwidth.loop.factor_response import factor_response, window_response
from zwidth.loop.loop import Loop

# Functions of the angle, in this order.
A_K, A_B, C_K, C_B, B_KK, B_KB, B_BB, R_KK, R_KB, R_BB = range(10)
# Points of a panel, and pieces it is cut into, with the points of each.
POINTS, PIECES, QUARTIC = 11, 8, 5
# Last Chebyshev coefficients of a panel, in shares of the function's size there, and what rounding leaves of them.
TOLERANCE, NOISE = 1e-9, 2e-13
# Within a resonance rounding counts more by this share of its quality.
LIGHT = 0.1
# Relative error of the polynomials of disks that are interpolated between measured frequencies.
FOLLOWED = 1e-7
# Largest number of halvings of a panel; and largest growth of their number, beyond which rounding limits them.
HALVINGS, MOST = 24, 4
# Disks are wide from the first share of their centre's size on; a panel of wide disks has none below the second.
WIDE, THIN = 0.3, 0.03
# Least radius in shares of the centre's size, so that rays meet the disks in spite of rounding.
LEAST = 1e-10
# A limit at zero smaller than this share of what is near zero is none. Octaves below the lowest angle.
VANISHING, OCTAVES = 1e-9, 16
# Lowest angle, if no pole is slow: limits at zero are extrapolated from there. Slow poles are seen from below.
LOWEST, BELOW, SLOWEST = 1e-5, 0.02, 1e-11


@dataclass(frozen=True)
class Conics:
    """The conics of a loop held at a port.

    angles  (n + 1,)    ascending ends of the pieces; the last is pi
    pieces  (n, 10, 5)  coefficients of powers of s, the part of the way through a piece in log(angle), of
                        Re C, Re wC, Im C, Im wC;   X, 2 X Re w, X |w|^2 with X = |C|^2 - R^2;   the same of R^2
    wide    (n,)        whether the disks of a piece are wide
    limit   (6,)        the conic at angle 0 up to scale: coefficients of 1, of a (2,) and of b (3,)
    """

    angles: Floats
    pieces: Floats
    wide: Flags
    limit: Floats

    def tips(self, period: float) -> Complexes:
        """The wall K T + j B that each angle forbids nearest to 0 on the ray to its disk's middle (m,); angles
        that forbid none there are left out.

        There H C is real and negative, and mu = |H| (|C| + R).
        """
        at = self.pieces[:, :, 0]  # the functions at the beginning of each piece
        K, B = at[:, C_B], -at[:, C_K]  # Im(H C) = 0
        # of the two walls the one with Re(H C) < 0
        way = -np.sign(K * at[:, A_K] + B * at[:, A_B])
        K, B = way * K, way * B
        square = K * K * at[:, R_KK] + K * B * at[:, R_KB] + B * B * at[:, R_BB]
        mu = np.sqrt(np.maximum(square, 0.0)) - K * at[:, A_K] - B * at[:, A_B]
        return np.asarray((K * period + 1j * B)[mu > 0.0] / mu[mu > 0.0], dtype=complex)


def conics(loop: Loop, held: Floats) -> Conics | None:
    """The conics of a loop held along `held` (n,); None where the port dissipates nothing at some angle."""
    at = port(loop.plant, held)
    aliases = Aliases.of(loop, at)
    singular = _singularities(loop, at)

    def functions(angles: Floats) -> tuple[Floats, Floats]:
        values, sizes = _functions_and_sizes(loop, aliases, angles)
        return values, _rounding_errors(singular, angles) * sizes

    panels = _panels(functions, np.log(panel_ends(loop, at)), POINTS - 2)
    if panels is None:
        return None
    left, right, values, wide = panels
    nodes = _panel_nodes()
    limit, below = _towards_zero(left[0] + (right[0] - left[0]) * nodes, values[0], nodes)
    # extrapolated panels, of an octave each, count as wide: of their functions a and b alone are known
    left = np.append(left[0] - np.log(2.0) * np.arange(len(below), 0, -1), left)
    values, wide = np.concatenate([below, values]), np.append(np.ones(len(below), dtype=bool), wide)
    return _conics_of_panels(left, float(right[-1]), values, wide, limit, PIECES)


def conics_of_disks(
    disks: Callable[[Floats], Disks], speed: Callable[[Floats], Complexes], ends: Floats
) -> Conics:
    """The conics of disks that are known as a function of the angle, from the lowest of `ends` to the highest.

    disks  the disks at angles (k,), finite
    speed  the velocity estimate w (k,) there
    ends   (n,) ascending angles between which the disks are smooth
    Raises  ValueError  for a disk of infinite radius
    """

    def functions(angles: Floats) -> tuple[Floats, Floats]:
        values = disk_functions(disks(angles), speed(angles))
        return values, FOLLOWED * np.abs(values)

    panels = _panels(functions, np.log(ends), QUARTIC)
    if panels is None:
        raise ValueError("a disk has no finite radius; its walls must be left out before")
    left, right, values, wide = panels
    # the limit [1, 0 ...], a conic that is 1 for every wall: angle 0 forbids none
    return _conics_of_panels(left, float(right[-1]), values, wide, np.eye(6)[0], 1)


def _panel_nodes() -> Floats:
    """Points of a panel in log(angle) at which functions are sampled, as shares of its width."""
    return np.asarray((1.0 + chebyshev.chebpts2(POINTS)) / 2.0)


def _panels(
    functions: Callable[[Floats], tuple[Floats, Floats]], ends: Floats, degree: int
) -> tuple[Floats, Floats, Floats, Flags] | None:
    """Panels of log(angle) that polynomials resolve: their ends (n,), (n,), the functions at their points
    (n, 10, POINTS), and whether they are wide (n,); None where a function is not finite. Panels of HALVINGS, or of
    a round in which more than MOST times the first ones are left, are taken as they are.

    functions  of angles (k,): the ten functions (10, k) and the errors that they are allowed
    degree     of the Chebyshev polynomials from which on nothing may be left
    """
    nodes = _panel_nodes()
    left, right = ends[:-1], ends[1:]
    done: list[tuple[Floats, Floats, Floats, Flags]] = []
    for halving in range(HALVINGS + 1):
        x = left[:, None] + (right - left)[:, None] * nodes
        x[:, -1] = right
        values_and_errors = np.array(functions(np.minimum(np.exp(x), np.pi).ravel()))
        if not np.all(np.isfinite(values_and_errors)):
            return None
        values, rounding = values_and_errors.reshape(2, 10, len(left), POINTS).swapaxes(1, 2)
        wide, good = _resolved(values, np.max(rounding, axis=-1), degree)
        good |= halving == HALVINGS or len(left) > MOST * len(ends)
        done.append((left[good], right[good], values[good], wide[good]))
        left, right = left[~good], right[~good]
        if not len(left):
            break
        middle = (left + right) / 2.0
        left, right = np.concatenate([left, middle]), np.concatenate([middle, right])
    left, right, values, wide = (np.concatenate(part) for part in zip(*done, strict=True))
    order = np.argsort(left)
    return left[order], right[order], values[order], wide[order]


def _conics_of_panels(left: Floats, end: float, values: Floats, wide: Flags, limit: Floats, count: int) -> Conics:
    """The conics of `count` pieces of each of adjoining panels, which begin at log(angle) `left` (n,), the last
    ending at `end`; values (n, 10, POINTS) and wide (n,) of the panels, limit of `Conics`."""
    parts = left[:, None] + np.diff(np.append(left, end))[:, None] * np.arange(count) / count
    angles = np.exp(np.append(parts.ravel(), end))
    pieces = np.einsum("mqp,nfp->nmfq", _piece_matrices(_panel_nodes(), count), values).reshape(-1, 10, QUARTIC)
    return Conics(angles, np.ascontiguousarray(pieces), np.repeat(wide, count), limit)


def panel_ends(loop: Loop, held_port: Port) -> Floats:
    """Ascending ends of the first panels, from the lowest angle to pi.

    Panels grow geometrically away from zero and from each singularity: by powers of two of its distance from the
    circle, as far as half the way to zero and 0.3 rad at most.
    """
    poles = np.abs(held_port.poles) * loop.period
    lowest = min(LOWEST, BELOW * float(np.min(poles[poles > SLOWEST], initial=1.0)))
    centre, width, turns = _singularities(loop, held_port)
    resolved = turns > 1e-3 * lowest  # singularities far below the lowest angle bend nothing
    # no panel narrower than 1e-9 of a resonance's own angle, where rounding tells no more
    centre, width = centre[resolved], np.maximum(width, 1e-9 * turns)[resolved]
    steps = 2.0 ** np.arange(0, 31)
    across = width[:, None] * steps
    near = across < np.minimum(0.3, 0.5 * centre)[:, None]
    sides = [(centre[:, None] + way * across)[near] for way in (-1.0, 1.0)]
    # octaves below 0.4 rad, and even steps above
    low = 0.4 * 2.0 ** -np.arange(0, np.ceil(np.log2(0.4 / lowest)))
    ends = np.concatenate([*sides, low, np.linspace(0.4, np.pi, 8)])
    ends = np.unique(ends[(ends > 1.2 * lowest) & (ends < np.pi * 0.999)])
    apart = np.append(True, np.diff(ends) > 1e-9 * ends[1:])
    return np.concatenate([[lowest], ends[apart], [np.pi]])


def _singularities(loop: Loop, held_port: Port) -> tuple[Floats, Floats, Floats]:
    """Where centres and radii have poles: at those of the plant, and the radii where the port takes in no power.

    Angles folded into (0, pi), distances from the circle and angles not folded, each (n,).
    """
    singular = np.append(held_port.poles, held_port.spectral_zeros) * loop.period
    singular = singular[singular.imag > 0.0]
    turn = np.mod(singular.imag, 2.0 * np.pi)
    centre = np.where(turn > np.pi, 2.0 * np.pi - turn, turn)
    return centre, np.maximum(np.abs(singular.real), 1e-12 * singular.imag), singular.imag


def _rounding_errors(singular: tuple[Floats, Floats, Floats], angles: Floats) -> Floats:
    """Relative rounding error of the functions at angles (...): larger within lightly damped resonances.

    singular  of `_singularities`
    """
    centre, width, turns = singular
    near = turns / np.hypot(angles[..., None] - centre, width)
    return np.asarray(NOISE * np.maximum(1.0, LIGHT * np.max(near, axis=-1, initial=0.0)))


def _functions_and_sizes(loop: Loop, aliases: Aliases, angles: Floats) -> Floats:
    """The ten functions at angles (k,), and the size of the terms that are rounded: (2, 10, k).

    inf where a disk has an infinite radius.
    """
    disks, w, T = aliases.disks(angles), velocity_estimate(loop, angles), loop.period
    # zeros of filters are exact to roundings of what the filters are given: sizes are those in front of them, that
    # of w at least the plain difference's
    passed = np.maximum(np.abs(force_filter_response(loop, angles)), 1e-300)
    speed = np.maximum(np.abs(w), np.abs(one_less_z_inverse(angles)) / T)
    R2 = np.maximum(disks.radius, LEAST * np.abs(disks.centre)) ** 2
    size = np.sqrt(np.abs(disks.centre) ** 2 + R2) / passed
    linear = np.array([size, speed * size])
    square = np.array([size**2, speed * size**2, (speed * size) ** 2])
    return np.array([disk_functions(disks, w), np.concatenate([linear, linear, square, square])])


def disk_functions(disks: Disks, w: Complexes) -> Floats:
    """The ten functions (10, k), A_K to R_BB, of disks (k,) with a velocity estimate w (k,)."""
    C, X, V = disks.centre, disks.power, w * disks.centre
    R2 = np.maximum(disks.radius, LEAST * np.abs(C)) ** 2
    of_H = np.array([np.ones(len(w)), 2.0 * w.real, np.abs(w) ** 2])
    return np.concatenate([[C.real, V.real, C.imag, V.imag], of_H * X, of_H * R2])


def velocity_estimate(loop: Loop, angles: Floats) -> Complexes:
    """w at angles (k,), to full accuracy near zero."""
    z, estimator = np.exp(1j * angles), loop.estimator
    d = z * one_less_z_inverse(angles)
    return np.asarray(
        factor_response(estimator.numerator, estimator.denominator, d) * window_response(estimator.window, z),
        dtype=complex,
    )


def _resolved(values: Floats, rounding: Floats, degree: int) -> tuple[Flags, Flags]:
    """Which panels (n,) of values (n, 10, POINTS) have wide disks, and which their polynomials represent exactly;
    of wide ones only those in which no disk is below THIN.

    rounding  (n, 10) errors that are allowed
    degree    from which on nothing may be left
    """
    grid = chebyshev.chebpts2(POINTS)
    to_coefficients = np.linalg.inv(chebyshev.chebvander(grid, POINTS - 1))
    # (n, 10): the last Chebyshev coefficients, and what each of the functions may have of them
    tail = np.abs((values @ to_coefficients.T)[..., degree:]).max(axis=-1)
    size = np.abs(values).max(axis=-1)
    centre = np.hypot(values[:, [A_K, A_B]], values[:, [C_K, C_B]])
    radius = np.sqrt(values[:, R_KK])
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(radius > 0.0, radius / centre[:, 0], 0.0)
    wide = ratio.max(axis=-1) > WIDE
    # of wide disks a and b count, each in shares of its own size; of the others H C, in shares of |C| and |w C|,
    # and (H R)^2, in shares of |H|^2 R |C|, since mu has it as H R beside H C
    linear, across = centre.max(axis=-1), size[:, R_KK:] / np.maximum(ratio.max(axis=-1), 1e-9)[:, None]
    allowed = np.full_like(tail, np.inf)
    allowed[:, A_K:C_K] = np.where(wide[:, None], size[:, A_K:C_K], linear)
    allowed[:, C_K:B_KK] = np.where(wide[:, None], np.inf, linear)
    allowed[:, B_KK:R_KK] = np.where(wide[:, None], size[:, B_KK:R_KK], np.inf)
    allowed[:, R_KK:] = np.where(wide[:, None], np.inf, across)
    good = np.all(tail <= TOLERANCE * allowed + rounding, axis=-1)
    return wide, good & ~(wide & (ratio.min(axis=-1) < THIN))


def _piece_matrices(nodes: Floats, count: int) -> Floats:
    """Matrices (count, QUARTIC, POINTS) from values at a panel's points to coefficients of powers of s in each of
    its pieces; nodes: `_panel_nodes`."""
    basis = np.linalg.inv(chebyshev.chebvander(2.0 * nodes - 1.0, POINTS - 1))
    inner = np.linspace(0.0, 1.0, QUARTIC)
    at = (np.arange(count)[:, None] + inner) / count
    powers = np.linalg.inv(np.vander(inner, increasing=True))
    return np.asarray(powers @ chebyshev.chebvander(2.0 * at - 1.0, POINTS - 1) @ basis)


def _towards_zero(x: Floats, values: Floats, nodes: Floats) -> tuple[Floats, Floats]:
    """The conic at angle 0 (6,), and panels below the lowest (m, 10, POINTS), extrapolated from that one; m = 0
    where the coefficients do not grow towards 0.

    x, values  log(angle) (POINTS,) of the lowest panel and the functions there (10, POINTS)
    nodes      `_panel_nodes`

    The coefficients of a and b are even functions of the angle. Where a free motion is not damped they grow with a
    power of 1/angle; divided by that power they have a limit, and the constant 1 of the conic vanishes. How they
    come near it decides on walls beside the limit: panels of one octave each go down to where nothing is left.
    """
    rows = [A_K, A_B, B_KK, B_KB, B_BB]
    ends = np.maximum(np.abs(values[rows][:, [0, -1]]), 1e-300)
    # the largest order of growth, rounded to an even one
    growth = np.max(np.log(ends[:, 0] / ends[:, 1])) / (x[-1] - x[0])
    power = 2 * max(round(float(growth) / 2.0), 0)
    terms = values[rows] * np.exp(power * (x - x[-1]))
    # limit and two even powers of the angle, in shares of the panel's upper end
    even = np.vander(np.exp(2.0 * (x - x[-1])), 3, increasing=True)
    fit = np.linalg.lstsq(even, terms.T, rcond=None)[0]
    limit = np.where(np.abs(fit[0]) > VANISHING * np.abs(terms).max(axis=1), fit[0], 0.0)
    octaves = np.arange(OCTAVES if power else 0, 0, -1)
    down = x[0] - x[-1] + np.log(2.0) * (nodes - octaves[:, None])
    below = np.zeros((len(octaves), 10, POINTS))
    below[:, rows] = (
        (np.exp(2.0 * down[..., None] * np.arange(3)) @ fit) * np.exp(-power * down)[..., None]
    ).swapaxes(1, 2)
    return np.append(0.0 if power else 1.0, limit), below
