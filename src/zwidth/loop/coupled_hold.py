"""A plant in first-order form, sampled with an exact hold: as states, and as one chain of second-order factors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from itertools import combinations

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.loop.exact_polynomials import (
    ARITHMETIC,
    MOST_STATES,
    characteristic_polynomial,
    decimals,
    exact_dot,
    refined_root,
)
from zwidth.loop.hold import lag_share
from zwidth.model.first_order_form import FirstOrderForm, invariant_subspace

# Motions slower than this share of the fast ones' rate can lose digits to what rounding leaves of the fast ones.
MUCH_SLOWER = 0.3
NEARLY_EQUAL = 1e-6  # shares of the poles' size within which pairs of poles are not told apart
PROBES, SLOWEST_PROBE = 25, 1e-3  # angles of the unit circle, and the smallest [rad], where rows are tried
SLOW = 0.03  # rates below this share of the sampling rate count as equally slow


@dataclass(frozen=True)
class SampledForm:
    """X_{j+1} = X_j + growth X_j + new u + old u_before,   y = output . X + direct_new u + direct_old u_before

    growth      (k, k)  E = exp(A T) - 1
    new, old    (k,)    change of the states per unit of this interval's force, and of the one before it; with an
                        actuator lag u is the force after the factor 1/(d + s) of `loop.hold`
    output      (k,)    reading per unit of each state
    direct_new, direct_old   0 without lag
    """

    growth: Floats
    new: Floats
    old: Floats
    output: Floats
    direct_new: float
    direct_old: float


def sample_form(form: FirstOrderForm, period: float, fraction: float = 0.0, lag: float = 0.0) -> SampledForm:
    """Sample a form: exact hold over a period T [s], split by a fraction f [samples], through an actuator lag [s].

    With lag, P are the states after T from a unit lagged force without command, Q those from a unit command:

        (d + s) y = output Q + output (d - E)^-1 [ s_in P + (s + E) Q ]
    """
    T, rest = period, (1.0 - fraction) * period
    E, P, Q = step_growth(form, T, lag)
    Q_new = step_growth(form, rest, lag)[2] if fraction > 0.0 else Q
    s, s_new = lag_share(T, lag), lag_share(rest, lag)
    if lag > 0.0:
        new = s_new * P + s * Q_new + E @ Q_new
        old = (s - s_new) * P + s * (Q - Q_new) + E @ (Q - Q_new)
        return SampledForm(E, new, old, form.output, float(form.output @ Q_new), float(form.output @ (Q - Q_new)))
    return SampledForm(E, Q_new, Q - Q_new, form.output, 0.0, 0.0)


def form_rows(form: FirstOrderForm, sampled: SampledForm, period: float) -> Floats:
    """The chain as rows (m, 8), each but the first divided by the denominators of those before it too.

    With the quadratics D_i in d whose roots are two of the sampled poles each

        c (d - E)^-1 G = sum_i [ c G_i d + c (E + d1_i) G_i ] / (D_1 ... D_i),     G_1 = G,  G_{i+1} = D_i(E) G_i

    (Newton's form: D(d) - D(E) = (d - E)(d + E + d1), and the product of all D_i(E) is zero). Nothing cancels
    where poles coincide; fast poles come first, so that each row adds slower motions. Hidden poles would come
    last, with rows that nothing reaches. D_i(E) shrinks slow motions, while rounding leaves something of the fast
    ones that it should have removed: where the rest is much slower, G is cleared of them.
    """
    E, c = sampled.growth, sampled.output
    parts = [(sampled.direct_new, sampled.new), (sampled.direct_old, sampled.old)]
    rows = []
    pairs, fastest = _pairs(form.poles, period), np.inf
    for i, pair in enumerate(pairs):
        rate = float(np.max(np.abs(pair)))
        if rate < MUCH_SLOWER * fastest:
            if i:
                fast = invariant_subspace(form, np.concatenate(pairs[:i]))
                parts = [(direct, _without_subspace(G, *fast)) for direct, G in parts]
            fastest = rate
        e = sampled_poles(pair, period)
        d1, d0 = float(-np.sum(e).real), float(np.prod(e).real)
        if len(pair) == 1:  # joined by a pole at z = 0, which no wall moves
            d1, d0 = d1 + 1.0, d1
        row = [d1, d0]
        for direct, G in parts:
            row += [direct, float(c @ G) + direct * d1, float(c @ (E @ G + d1 * G)) + direct * d0]
        rows.append(row)
        parts = [(0.0, E @ (E @ G + d1 * G) + d0 * G) for _, G in parts]
    return np.array(rows).reshape(-1, 8)


def exact_rows(form: FirstOrderForm, sampled: SampledForm, period: float) -> Floats:
    """`form_rows` in decimal arithmetic, with the poles of the sampled matrix to many digits: rows of the states
    as their doubles are, where springs or masses of very unlike size leave rounding in place of them.

    Returns  no rows, (0, 8), where poles are equal to rounding, and for a large form
    """
    none, k = np.zeros((0, 8)), len(sampled.output)
    if k > MOST_STATES:
        return none
    below = characteristic_polynomial(sampled.growth)
    with localcontext(ARITHMETIC):
        E, c = [decimals(row) for row in sampled.growth], decimals(sampled.output)
        parts = [
            (Decimal(sampled.direct_new), decimals(sampled.new)),
            (Decimal(sampled.direct_old), decimals(sampled.old)),
        ]
        rows = []
        for pair in _pairs(form.poles, period):
            roots = [
                refined_root(below, complex(e)) if e else (Decimal(0),) * 2 for e in sampled_poles(pair, period)
            ]
            found = [root for root in roots if root is not None]
            if len(found) < len(pair):
                return none
            if len(found) == 1:  # joined by a pole at z = 0, which no wall moves
                found.append((Decimal(-1), Decimal(0)))
            (x, y), (x2, y2) = found
            d1, d0 = -(x + x2), x * x2 - y * y2
            row = [d1, d0]
            through = [[exact_dot(line, G) for line in E] for _, G in parts]
            for (direct, G), moved in zip(parts, through, strict=True):
                row += [
                    direct,
                    exact_dot(c, G) + direct * d1,
                    exact_dot(c, moved) + d1 * exact_dot(c, G) + direct * d0,
                ]
            rows.append([float(value) for value in row])
            parts = [
                (
                    Decimal(0),
                    [exact_dot(line, moved) + d1 * m + d0 * g for line, m, g in zip(E, moved, G, strict=True)],
                )
                for (_, G), moved in zip(parts, through, strict=True)
            ]
    return np.array(rows).reshape(-1, 8)


def separate_rows(form: FirstOrderForm, period: float, fraction: float = 0.0, lag: float = 0.0) -> Floats:
    """Rows (m, 8) as of `form_rows`, one for each pair of poles on a subspace of its own, none divided by another.

    Where poles lie far apart these keep digits that a long chain loses. Where two pairs are nearly equal there are
    none such: no rows, (0, 8).
    """
    rows, pairs = [], _pairs(form.poles, period)
    for pair, other in combinations(pairs, 2):
        if np.min(np.abs(pair[:, None] - other)) <= NEARLY_EQUAL * np.max(np.abs(pair)):
            return np.zeros((0, 8))
    for pair in pairs:
        right, left = invariant_subspace(form, pair)
        own = replace(
            form,
            dynamics=left.T @ form.dynamics @ right,
            input=left.T @ form.input,
            output=form.output @ right,
            poles=pair,
        )
        rows.append(form_rows(own, sample_form(own, period, fraction, lag), period))
    return np.vstack(rows)


def rows_error(rows: Floats, sampled: SampledForm) -> float:
    """How far the response of rows (m, 9) is from that of the states on the unit circle, in shares of it; 0
    without states.

    Both are compared at PROBES angles, each in shares of the largest response at three neighbouring ones: about a
    zero of the response rounding is any share of it.
    """
    k = len(sampled.output)
    if not k:
        return 0.0
    z = np.exp(1j * np.geomspace(SLOWEST_PROBE, 0.999 * np.pi, PROBES))
    d = z - 1.0
    pushed = np.stack([sampled.new, sampled.old], axis=1)
    states = np.linalg.solve(
        d[:, None, None] * np.eye(k) - sampled.growth, np.broadcast_to(pushed, (PROBES, k, 2))
    )
    new, old = (sampled.output @ states).T
    wanted = new + sampled.direct_new + (old + sampled.direct_old) / z
    found, over = np.zeros(PROBES, dtype=np.complex128), np.ones(PROBES, dtype=np.complex128)
    for d1, d0, n2, n1, n0, o2, o1, o0, chained in rows:
        below = (d + d1) * d + d0
        over = over / below if chained else 1.0 / below
        found += ((n2 * d + n1) * d + n0 + ((o2 * d + o1) * d + o0) / z) * over
    size = np.pad(np.abs(wanted), 1)
    largest = np.maximum(np.maximum(size[:-2], size[1:-1]), size[2:])
    return float(np.max(np.abs(found - wanted) / largest))


def _without_subspace(G: Floats, right: Floats, left: Floats) -> Floats:
    """G without its part in a subspace, in entries where that part is more than the rounding of this product."""
    part = right @ (left.T @ G)
    rounding = 1e-15 * (np.abs(right) @ (np.abs(left.T) @ np.abs(G)))
    return G - np.where(np.abs(part) > rounding, part, 0.0)


def step_growth(form: FirstOrderForm, time: float, lag: float) -> tuple[Floats, Floats, Floats]:
    """exp(A t) - 1 without cancellation, and the states from a unit lagged force and from a unit command."""
    growth, lagged, pushed = steps_growth(form.dynamics, form.input[:, None], time, lag)
    return growth, lagged[:, 0], pushed[:, 0]


def steps_growth(dynamics: Floats, inputs: Floats, time: float, lag: float) -> tuple[Floats, Floats, Floats]:
    """The same of several forces, each on a column of inputs (k, r): exp(A t) - 1 (k, k), and states (k, r)."""
    from scipy.linalg import expm

    A, b, (k, r) = dynamics * time, inputs * time, inputs.shape
    M = np.zeros((2 * k + 2 * r, 2 * k + 2 * r))
    forces, commands = slice(2 * k, 2 * k + r), slice(2 * k + r, 2 * k + 2 * r)
    M[:k, :k] = A
    M[:k, k : 2 * k] = np.eye(k)
    if lag > 0.0:
        M[:k, forces], M[forces, forces], M[forces, commands] = b, -time / lag * np.eye(r), time / lag * np.eye(r)
    else:
        M[:k, commands] = b
    F = expm(M)
    return A @ F[:k, k : 2 * k], F[:k, forces], F[:k, commands]


def _pairs(poles: Complexes, period: float) -> list[Complexes]:
    """Poles two by two, fast ones first: conjugates together, a real one with its neighbour unless that is much
    faster."""
    pairs = [np.array([value, value.conjugate()]) for value in poles[poles.imag > 0.0]]
    real = list(poles[poles.imag == 0.0][np.argsort(np.abs(poles[poles.imag == 0.0]))])
    while real:
        count = 1
        if len(real) > 1 and MUCH_SLOWER * abs(real[1]) <= max(abs(real[0]), SLOW / period):
            count = 2
        pairs.append(np.array(real[:count]))
        del real[:count]
    return sorted(pairs, key=lambda pair: -float(np.max(np.abs(pair))))


def sampled_poles(poles: Complexes, period: float) -> Complexes:
    """exp(s T) - 1 without cancellation near 0."""
    x = poles * period
    real = np.expm1(x.real) * np.cos(x.imag) - 2.0 * np.sin(x.imag / 2.0) ** 2
    return real + 1j * np.exp(x.real) * np.sin(x.imag)
