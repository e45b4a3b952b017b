"""Many loops as arrays, the form in which kernels take them.

What a controller's signals pass, force path and velocity estimate, are factors in d = z - 1; so are low passes.
All numbers may have leading axes of designs (`model.design_axes`); the factors then have them, too.

A loop's factors on a circle |z| = rho, in the half-angle form in which its curve of walls is evaluated.

    z = rho (1 + s)/(1 - s),      d = z - 1 = [ (rho - 1) + (rho + 1) s ] / (1 - s)

maps the left half plane of s to the inside of the circle (the thesis's Moebius map, eq. 4.38), and its imaginary
axis to the circle: s = i t with t = tan(theta/2) is z = rho exp(i theta). A factor c2 d^2 + c1 d + c0 times
(1 - s)^2 is a polynomial a0 + a1 s + a2 s^2 with real coefficients, products without cancellation where poles
crowd z = 1. On the circle and times cos^2(theta/2), all that is left of it is

    (a0 cos^2 - a2 sin^2) + i a1 sin cos            of the half angle theta/2

Nothing but t enters: cos^2 = 1/(1 + t^2), sin^2 = t^2 cos^2, sin cos = t cos^2. No angle is computed, and t keeps
its digits at both ends of the circle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_apart, compiled_inline, compiled_lean
from zwidth.loop.controller import Butterworth, Controller, FirstOrder, whole_samples
from zwidth.loop.estimator import Estimator
from zwidth.loop.hold import lag_share
from zwidth.model.design_axes import design_shape, stack_numbers

if TYPE_CHECKING:
    from zwidth.loop.loop import Loop

Rows = list[list[Any]]  # numbers, or arrays over designs


@dataclass(frozen=True)
class Filter:
    """product of numerators / product of denominators, (..., k, 3) rows c2, c1, c0 of  c2 d^2 + c1 d + c0."""

    numerator: Floats
    denominator: Floats


NO_FILTER = Filter(np.zeros((0, 3)), np.zeros((0, 3)))


def first_order_factors(low_pass: FirstOrder, period: float) -> tuple[Rows, Rows]:
    """Backward Euler of 1/(tau s + 1):  (1 - a) z / (z - a),  a = tau / (tau + T); its numerator's row, then its
    denominator's, with the share 1 - a in place of a."""
    share = period / (low_pass.time_constant + period)
    return [[0.0, share, share]], [[0.0, 1.0, share]]


def butterworth_factors(low_pass: Butterworth, period: float) -> tuple[Rows, Rows]:
    """Butterworth by s = (2/T) (z - 1)/(z + 1), of unit gain at z = 1 (thesis 3.17-3.19 for order 2).

    With u = w_c T / 2 (prewarped: tan of it) a pair of analog poles of damping ratio q becomes

        u^2 (d + 2)^2 / [ (1 + 2 q u + u^2) d^2 + (4 q u + 4 u^2) d + 4 u^2 ]

    Returns rows of numerators and of denominators; an odd order has one factor of first order, u (d + 2) / [...].
    """
    u = np.pi * low_pass.cutoff_Hz * period
    if low_pass.discretisation == "tustin-prewarped":
        u = np.tan(u)
    numerators, denominators = [], []
    for k in range(low_pass.order // 2):
        q = np.sin(np.pi * (2 * k + 1) / (2 * low_pass.order))
        lead = 1.0 + 2.0 * q * u + u * u
        gain = u * u / lead
        numerators.append([gain, 4.0 * gain, 4.0 * gain])
        denominators.append([1.0, 4.0 * (q * u + u * u) / lead, 4.0 * u * u / lead])
    if low_pass.order % 2:
        gain = u / (1.0 + u)
        numerators.append([0.0, gain, 2.0 * gain])
        denominators.append([0.0, 1.0, 2.0 * gain])
    return numerators, denominators


def low_pass_factors(low_pass: FirstOrder | Butterworth | None, period: float) -> tuple[Rows, Rows]:
    """Rows c2, c1, c0 of a low pass, of its numerators and of its denominators; two empty lists for None."""
    match low_pass:
        case FirstOrder():
            return first_order_factors(low_pass, period)
        case Butterworth():
            return butterworth_factors(low_pass, period)
        case None:
            return [], []


def factor_roots(rows: Rows) -> list[complex]:
    """Roots in d of factors c2 d^2 + c1 d + c0 of one design, both real ones without cancellation."""
    roots = list[complex]()
    for c2, c1, c0 in rows:
        if c2 == 0.0:
            roots += [-c0 / c1] if c1 != 0.0 else []
            continue
        mean, gap = -0.5 * c1 / c2, (0.5 * c1 / c2) ** 2 - c0 / c2
        if gap < 0.0:
            roots += [complex(mean, side * (-gap) ** 0.5) for side in (1.0, -1.0)]
        else:
            large = mean - gap**0.5 if mean <= 0.0 else mean + gap**0.5
            roots += [large, c0 / (c2 * large) if large != 0.0 else 0.0]
    return roots


def _factor_array(rows: Rows) -> Floats:
    """Rows c2, c1, c0 as an array (..., k, 3), (0, 3) for no rows."""
    return stack_numbers(rows) if rows else np.zeros((0, 3))


def _in_series(first: Floats, second: Floats) -> Floats:
    """Factors (..., k + m, 3) of two filters in series, those of the first (..., k, 3) in front."""
    if first.ndim == second.ndim == 2:
        return np.concatenate([first, second])
    designs = np.broadcast_shapes(first.shape[:-2], second.shape[:-2])
    return np.concatenate([np.broadcast_to(one, (*designs, *one.shape[-2:])) for one in (first, second)], axis=-2)


def force_filter(controller: Controller) -> Filter:
    """Filter of the whole force, F(z)."""
    top, bottom = low_pass_factors(controller.force_filter, controller.sampling_period)
    return Filter(_factor_array(top), _factor_array(bottom))


def force_path(controller: Controller) -> Filter:
    """The force filter, then the actuator's lag 1/(d + s); the lag's numerators are in the rows of `loop.hold`."""
    low_pass, lag = force_filter(controller), controller.actuator_time_constant
    if not np.any(lag):
        return low_pass
    share = lag_share(controller.sampling_period, lag)
    return Filter(
        _in_series(low_pass.numerator, _factor_array([[0.0, 0.0, 1.0]])),
        _in_series(low_pass.denominator, _factor_array([[0.0, 1.0, share]])),
    )


def velocity_estimator(controller: Controller) -> Estimator:
    """The controller's velocity estimate and, behind it, its velocity filter, as one estimator."""
    estimate = controller.velocity.estimator(controller.sampling_period)
    top, bottom = low_pass_factors(controller.velocity_filter, controller.sampling_period)
    return Estimator(
        _in_series(estimate.numerator, _factor_array(top)),
        _in_series(estimate.denominator, _factor_array(bottom)),
        estimate.window,
    )


class LoopTable(NamedTuple):
    """N loops: the sections of their plants, and the C computers that sample them.

    rows, section_count      (N, m, 9), (N,)  sections of each plant, see `loop.sections`, and how many it has
    computer                 (N,)    which computer each loop has
    period                   (C,)    sampling period of each computer [s]
    whole_delay, split       (C,)    of each computer: whole samples of delay, and 1 if the rest splits the hold
    force, force_count       (C, k, 6), (C,)  factors of the force on its way to all sections (filter and actuator
                                     lag): numerator c2, c1, c0 and denominator d2, d1, d0 of each
    velocity, velocity_count (C, v, 6), (C,)  the same of the velocity estimate
    window, window_count     (C, n), (C,)     the estimate's weights of past samples
    """

    rows: Floats
    section_count: Ints
    computer: Ints
    period: Floats
    whole_delay: Ints
    split: Ints
    force: Floats
    force_count: Ints
    velocity: Floats
    velocity_count: Ints
    window: Floats
    window_count: Ints


def table_of_loops(*loops: Loop) -> LoopTable:
    """One table of loops of any kinds, loop i with computer i. Raises what `Loop.table` raises."""
    each = [loop.table for loop in loops]
    count = np.array([len(table.rows[0]) for table in each], dtype=np.int64)
    rows = np.zeros((len(each), count.max(), 9))
    for line, table in zip(rows, each, strict=True):
        line[: table.rows.shape[1]] = table.rows[0]
    columns = [
        ComputerColumns(**{name: getattr(table, name) for name in ComputerColumns._fields}) for table in each
    ]
    return _table(rows, count, np.arange(len(each)), columns)


def loop_table(rows: Floats, section_count: Ints, controller: Controller) -> LoopTable:
    """N plants by their sections, all with one controller, or each with its own of N designs of it.

    rows, section_count  as in `LoopTable`
    """
    columns = computer_columns(controller)
    computer = np.arange(len(rows)) if len(columns.period) > 1 else np.zeros(len(rows), dtype=np.int64)
    return _table(rows, section_count, computer, [columns])


def joined_tables(tables: Sequence[LoopTable]) -> LoopTable:
    """The loops of several tables, one table after the other."""
    rows, count = _joined([table.rows for table in tables]), _joined([table.section_count for table in tables])
    columns = [
        ComputerColumns(**{name: getattr(table, name) for name in ComputerColumns._fields}) for table in tables
    ]
    before = np.cumsum([0, *(len(table.period) for table in tables)])
    computer = [table.computer + first for table, first in zip(tables, before, strict=False)]
    return _table(rows, count, _joined(computer), columns)


class ComputerColumns(NamedTuple):
    """The computers of a controller, one or one for each of its designs: columns of a `LoopTable`."""

    period: Floats
    whole_delay: Ints
    split: Ints
    force: Floats
    force_count: Ints
    velocity: Floats
    velocity_count: Ints
    window: Floats
    window_count: Ints


def computer_columns(controller: Controller) -> ComputerColumns:
    """The columns of a controller; those of one without designs are kept for its next loop."""
    try:
        return _cached_columns(controller)
    except TypeError:  # numbers of several designs have no hash
        return _columns(controller)


@lru_cache(maxsize=64)
def _cached_columns(controller: Controller) -> ComputerColumns:
    """`_columns` of the last 64 controllers without designs."""
    return _columns(controller)


def _columns(controller: Controller) -> ComputerColumns:
    """The C computers of a controller, one for each of its designs, as columns."""
    designs = design_shape(controller)
    period, delay = (
        np.ravel(np.broadcast_to(np.asarray(number, dtype=np.float64), designs))
        for number in (controller.sampling_period, controller.delay)
    )
    whole_delay, C = whole_samples(delay), len(period)
    path, estimate = force_path(controller), velocity_estimator(controller)
    force, velocity = (_factors(each.numerator, each.denominator, designs) for each in (path, estimate))
    return ComputerColumns(
        period.copy(),
        whole_delay,
        (delay - whole_delay > 0.0).astype(np.int64),
        force,
        np.full(C, force.shape[1]),
        velocity,
        np.full(C, velocity.shape[1]),
        np.repeat(estimate.window[None], C, axis=0),
        np.full(C, len(estimate.window)),
    )


def _factors(top: Floats, bottom: Floats, designs: tuple[int, ...]) -> Floats:
    """Numerators and denominators (..., k, 3) of several computers side by side, (C, k, 6), C of all axes of
    designs."""
    out = np.zeros((*designs, bottom.shape[-2], 6))
    out[..., :3], out[..., 3:] = top, bottom
    return out.reshape(math.prod(designs), *out.shape[-2:])


def _table(rows: Floats, section_count: Ints, computer: Ints, columns: Sequence[ComputerColumns]) -> LoopTable:
    """The table of plants by their sections, the number of each one's computer, and columns of computers."""
    joined = columns[0] if len(columns) == 1 else map(_joined, zip(*columns, strict=True))
    return LoopTable(
        np.ascontiguousarray(rows),
        np.asarray(section_count, dtype=np.int64),
        np.asarray(computer, dtype=np.int64),
        *joined,
    )


def _joined(parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Arrays (C, ...) one after the other; shorter ones are filled up with zeros."""
    whole = tuple(np.max([part.shape[1:] for part in parts], axis=0)) if parts[0].ndim > 1 else ()
    out, at = np.zeros((sum(map(len, parts)), *whole), dtype=parts[0].dtype), 0
    for part in parts:
        out[(slice(at, at + len(part)), *(slice(n) for n in part.shape[1:]))] = part
        at += len(part)
    return out


# Places in `CircleFactors.sizes`.
SECTIONS, FORCE, VELOCITY, WINDOW, WHOLE_DELAY, SPLIT, COMPUTER, DEGREE = range(8)


class CircleFactors(NamedTuple):
    """The factors of one loop on |z| = rho in powers of s: memory of the caller for loops up to a size.

    sizes     (8,)       how many rows of `plant`, `force`, `velocity` and `window` are in use; whole delay, split;
                         number of the computer whose factors these are, -1 for none; degree N of the loop
    radius    (1,)       rho
    plant     (m, 10)    each section's denominator (3), its numerators for the new and the old force (3 each), and
                         1 where it is chained to the section before it
    force     (k, 7)     the order (1 or 2) of each factor of the force path, its numerator (3), its denominator
                         (3)
    velocity  (v, 7)     the same of the velocity estimate
    window    (n,)       its weights of past samples
    """

    sizes: Ints
    radius: Floats
    plant: Floats
    force: Floats
    velocity: Floats
    window: Floats


def factor_memory(loops: LoopTable) -> CircleFactors:
    """Memory for the factors of any one of these loops, none filled in yet."""
    m, k, v, n = loops.rows.shape[1], loops.force.shape[1], loops.velocity.shape[1], loops.window.shape[1]
    sizes = np.zeros(8, dtype=np.int64)
    sizes[COMPUTER] = -1
    return CircleFactors(sizes, np.ones(1), np.zeros((m, 10)), np.zeros((k, 7)), np.zeros((v, 7)), np.zeros(n))


def circle_factors(loops: LoopTable, radius: float = 1.0) -> CircleFactors:
    """The factors of the first of these loops on the circle |z| = radius."""
    out = factor_memory(loops)
    fill_first(loops, radius, out)
    return out


@compiled
def fill_first(loops: LoopTable, radius: float, out: CircleFactors) -> None:
    """Fill in the factors of loop 0."""
    fill_computer(loops, 0, radius, out)
    fill_plant(loops, 0, out)


@compiled_lean
def bilinear(c2: float, c1: float, c0: float, degree: int, radius: float, out: Floats) -> None:
    """Fill in `out` (3,), (1 - s)^degree (c2 d^2 + c1 d + c0) in ascending powers of s, degree 1 or 2; with degree
    1 c2 is 0. s is that of z = radius (1 + s)/(1 - s), d = z - 1."""
    # (1 - s) d = a0 + a1 s
    a0, a1 = radius - 1.0, radius + 1.0
    if degree == 1:
        out[0] = c1 * a0 + c0
        out[1] = c1 * a1 - c0
        out[2] = 0.0
    else:
        out[0] = (c2 * a0 + c1) * a0 + c0
        out[1] = 2.0 * c2 * a0 * a1 + c1 * (a1 - a0) - 2.0 * c0
        out[2] = (c2 * a1 - c1) * a1 + c0


@compiled_lean
def fill_plant(loops: LoopTable, i: int, out: CircleFactors) -> None:
    """Fill in the sections of loop i on the circle, and its degree, the number of its poles; the computer's
    factors stand already."""
    radius, m = out.radius[0], loops.section_count[i]
    # columns of a section's row: d1, d0 of the denominator; n2, n1, n0 of the new force; o2, o1, o0; chained
    for k in range(m):
        bilinear(1.0, loops.rows[i, k, 0], loops.rows[i, k, 1], 2, radius, out.plant[k, 0:3])
        bilinear(loops.rows[i, k, 2], loops.rows[i, k, 3], loops.rows[i, k, 4], 2, radius, out.plant[k, 3:6])
        bilinear(loops.rows[i, k, 5], loops.rows[i, k, 6], loops.rows[i, k, 7], 2, radius, out.plant[k, 6:9])
        out.plant[k, 9] = loops.rows[i, k, 8]
    # sections have two poles each; the delay, its split and the window's past samples add theirs at z = 0
    degree = 2 * m + out.sizes[WHOLE_DELAY] + out.sizes[SPLIT] + out.sizes[WINDOW] - 1
    for k in range(out.sizes[FORCE]):
        degree += int(out.force[k, 0])  # the factor's order
    for k in range(out.sizes[VELOCITY]):
        degree += int(out.velocity[k, 0])
    out.sizes[SECTIONS], out.sizes[DEGREE] = m, degree


@compiled_lean
def fill_computer(loops: LoopTable, c: int, radius: float, out: CircleFactors) -> None:
    """Fill in the factors of computer c on the circle |z| = radius, all but the plant's."""
    out.radius[0] = radius
    out.sizes[WHOLE_DELAY], out.sizes[SPLIT], out.sizes[COMPUTER] = loops.whole_delay[c], loops.split[c], c
    out.sizes[FORCE], out.sizes[VELOCITY] = loops.force_count[c], loops.velocity_count[c]
    out.sizes[WINDOW] = loops.window_count[c]
    for k in range(loops.force_count[c]):
        _fill_factor(loops.force[c, k], radius, out.force[k])
    for k in range(loops.velocity_count[c]):
        _fill_factor(loops.velocity[c, k], radius, out.velocity[k])
    for k in range(loops.window_count[c]):
        out.window[k] = loops.window[c, k]


@compiled_lean
def _fill_factor(factor: Floats, radius: float, out: Floats) -> None:
    """Fill in a row (7,) of `CircleFactors.force` or `velocity` from a row (6,) c2, c1, c0, d2, d1, d0 of the
    table.

    Both polynomials are multiplied by (1 - s) as often as the denominator's order is, which leaves their quotient.
    """
    degree = 2 if factor[3] != 0.0 else 1
    out[0] = degree
    bilinear(factor[0], factor[1], factor[2], degree, radius, out[1:4])
    bilinear(factor[3], factor[4], factor[5], degree, radius, out[4:7])


@compiled_inline
def half_angle(t: float) -> tuple[float, float, float]:
    """cos^2, sin^2 and sin cos of theta/2, from t = tan(theta/2)."""
    cc = 1.0 / (1.0 + t * t)
    sc = t * cc
    return cc, t * sc, sc


@compiled_inline
def scaled_factors(value: complex, factor: float) -> complex:
    """A complex number times a real one; the plain product would make that complex, too."""
    return complex(value.real * factor, value.imag * factor)


@compiled_inline
def turned(value: complex) -> complex:
    """i times a complex number."""
    return complex(-value.imag, value.real)


@compiled_inline
def quadratic(a0: float, a1: float, a2: float, cc: float, ss: float, sc: float) -> tuple[complex, complex]:
    """(a0 + a1 s + a2 s^2) cos^2 on the circle, and its slope by theta; cc, ss, sc of `half_angle`."""
    return complex(a0 * cc - a2 * ss, a1 * sc), complex(-(a0 + a2) * sc, 0.5 * a1 * (cc - ss))


@compiled_inline
def factor_product(
    rows: Floats, count: int, cc: float, ss: float, sc: float, value: complex, slope: complex
) -> tuple[complex, complex, float, float]:
    """A value and its slope by theta times factors n/d, as n conj(d) over |d|^2: numerator and slope, denominator
    and slope, which are real.

    rows        (k, 7)  of `CircleFactors.force` or `velocity`, the first `count` of them: order, n0, n1, n2, d0,
                d1, d2
    cc, ss, sc  of `half_angle`
    """
    bottom, dbottom = 1.0, 0.0
    half = 0.5 * (cc - ss)
    for k in range(count):
        if rows[k, 0] == 1.0:
            # (n0 cos + i n1 sin)/(d0 cos + i d1 sin)
            along, across = rows[k, 2] * rows[k, 5], rows[k, 2] * rows[k, 4] - rows[k, 1] * rows[k, 5]
            n0d0, d0d0, d1d1 = rows[k, 1] * rows[k, 4], rows[k, 4] * rows[k, 4], rows[k, 5] * rows[k, 5]
            top, dtop = complex(n0d0 * cc + along * ss, across * sc), complex((along - n0d0) * sc, across * half)
            size, dsize = d0d0 * cc + d1d1 * ss, (d1d1 - d0d0) * sc
        else:
            num, dnum = quadratic(rows[k, 1], rows[k, 2], rows[k, 3], cc, ss, sc)
            den, dden = quadratic(rows[k, 4], rows[k, 5], rows[k, 6], cc, ss, sc)
            top = num * den.conjugate()
            dtop = dnum * den.conjugate() + num * dden.conjugate()
            size = den.real * den.real + den.imag * den.imag
            dsize = 2.0 * (den.real * dden.real + den.imag * dden.imag)
        slope = slope * top + value * dtop
        value = value * top
        dbottom = dbottom * size + bottom * dsize
        bottom = bottom * size
    return value, slope, bottom, dbottom


@compiled_inline
def minus_inverse_plant(
    factors: CircleFactors, cc: float, ss: float, sc: float
) -> tuple[complex, complex, complex, complex]:
    """-1/P on the circle, delay and force path included: numerator and slope by theta, denominator and slope.

    Sections are added over a common denominator: `top` over `bottom` is their sum so far. Columns of `plant` are
    those of `CircleFactors`; cc, ss, sc of `half_angle`.
    """
    top, bottom, dtop, dbottom = 0.0 + 0.0j, 1.0 + 0.0j, 0.0 + 0.0j, 0.0 + 0.0j
    # denominators of the sections that a chain is not divided by, times (1 - s)^2 for each that it is: on the
    # circle and times cos^2(theta/2) that is conj(u)
    beside, dbeside = 1.0 + 0.0j, 0.0 + 0.0j
    u = complex(cc - ss, 2.0 * sc)  # exp(i theta), whose slope is i u
    plant, split, delay = factors.plant, factors.sizes[SPLIT], factors.sizes[WHOLE_DELAY]
    for k in range(factors.sizes[SECTIONS]):
        den, dden = quadratic(plant[k, 0], plant[k, 1], plant[k, 2], cc, ss, sc)
        num, dnum = quadratic(plant[k, 3], plant[k, 4], plant[k, 5], cc, ss, sc)
        if split:
            old, dold = quadratic(plant[k, 6], plant[k, 7], plant[k, 8], cc, ss, sc)
            back = scaled_factors(u.conjugate(), 1.0 / factors.radius[0])
            num, dnum = num + old * back, dnum + (dold - turned(old)) * back  # back = 1/z has the slope -i/z
        if plant[k, 9] != 0.0:
            dbeside = (dbeside - turned(beside)) * u.conjugate()
            beside = beside * u.conjugate()
        else:
            beside, dbeside = bottom, dbottom
        dtop = dtop * den + top * dden + dnum * beside + num * dbeside
        top = top * den + num * beside
        dbottom = dbottom * den + bottom * dden
        bottom = bottom * den
    bottom, dbottom = -bottom, -dbottom
    top, dtop, size, dsize = factor_product(factors.force, factors.sizes[FORCE], cc, ss, sc, top, dtop)
    for _ in range(delay):
        dbottom = scaled_factors((dbottom + turned(bottom)) * u, factors.radius[0])
        bottom = scaled_factors(bottom * u, factors.radius[0])
    return scaled_factors(bottom, size), scaled_factors(dbottom, size) + scaled_factors(bottom, dsize), top, dtop


@compiled_inline
def velocity_on_circle(
    factors: CircleFactors, cc: float, ss: float, sc: float
) -> tuple[complex, complex, float, float]:
    """w on the circle: numerator and slope by theta, denominator and slope, which are real; cc, ss, sc of
    `half_angle`."""
    window = factors.window
    n = factors.sizes[WINDOW]
    value, slope = complex(window[n - 1], 0.0), 0.0 + 0.0j
    if n > 1:
        # Horner's scheme in 1/z, oldest sample first; the slope by 1/z times -i/z is that by theta
        back = scaled_factors(complex(cc - ss, -2.0 * sc), 1.0 / factors.radius[0])
        for k in range(n - 2, -1, -1):
            slope = slope * back + value
            value = value * back + complex(window[k], 0.0)
        slope = -turned(slope * back)
    return factor_product(factors.velocity, factors.sizes[VELOCITY], cc, ss, sc, value, slope)


@compiled_apart
def wall_with_slopes(factors: CircleFactors, t: float) -> tuple[float, float, float, float]:
    """K and B of the wall with a root at rho exp(i theta), t = tan(theta/2), and dK/dtheta, dB/dtheta."""
    cc, ss, sc = half_angle(t)
    X, dX, N, dN = minus_inverse_plant(factors, cc, ss, sc)
    Y, dY, Q, dQ = velocity_on_circle(factors, cc, ss, sc)
    # -1/P = X/N, w = Y/Q, with a real Q
    inverse = scaled_factors(N.conjugate(), 1.0 / (N.real * N.real + N.imag * N.imag))
    h = X * inverse
    dh = (dX - h * dN) * inverse
    w = scaled_factors(Y, 1.0 / Q)
    dw = scaled_factors(dY - scaled_factors(w, dQ), 1.0 / Q)
    # h = K + B w, h = -1/P: the imaginary part alone gives B
    across = 1.0 / w.imag
    B = h.imag * across
    dB = (dh.imag - B * dw.imag) * across
    return h.real - B * w.real, B, dh.real - dB * w.real - B * dw.real, dB


@compiled_apart
def wall_on_circle(factors: CircleFactors, t: float) -> tuple[float, float]:
    """K and B of `wall_with_slopes` at t = tan(theta/2), with a single division."""
    cc, ss, sc = half_angle(t)
    X, _, N, _ = minus_inverse_plant(factors, cc, ss, sc)
    Y, _, Q, _ = velocity_on_circle(factors, cc, ss, sc)
    # h = X/N and w = Y/Q as there, but for |N|^2 and Q, which are divided by at the end
    h = X * N.conjugate()
    over = 1.0 / ((N.real * N.real + N.imag * N.imag) * Y.imag)
    return (h.real * Y.imag - h.imag * Y.real) * over, h.imag * Q * over
