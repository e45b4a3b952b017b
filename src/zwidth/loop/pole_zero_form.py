"""A plant in first-order form, sampled with an exact hold: as states, as a chain of factors, as poles and zeros.

A sampled form of any order as poles, zeros and a gain is a product that kernels evaluate without cancellation. A
chain or a sum of terms, as plants without feedback have it, loses digits where many filters have poles beside
those of the plant and their terms cancel. A product loses none: its error is that of its poles and zeros, in
shares of their distances.

Poles are eigenvalues, zeros those of the pencil

    [ E  g ]     [ 1  0 ]
    [ c  0 ] - d [ 0  0 ]

Both are known to rounding of the whole matrix, which can be much for slow motions beside fast ones. So each is
improved by Newton's method on the determinant, whose logarithmic derivative is tr (d - E)^-1, with the other roots
divided out (Aberth); solving with d - E keeps the digits of slow motions. A root that does not settle at once, as
one of several equal ones, stays as it was: their product is right all the same.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal, localcontext
from itertools import combinations, product

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.loop.exact_polynomials import (
    ARITHMETIC,
    MOST_STATES,
    Polynomial,
    characteristic_polynomial,
    decimals,
    exact_dot,
    numerator,
    refined_root,
    roots_near,
    without_roots,
)
from zwidth.loop.hold import lag_share
from zwidth.model.first_order_form import FirstOrderForm, invariant_subspace

# Motions slower than this share of the fast ones' rate can lose digits to what rounding leaves of the fast ones.
MUCH_SLOWER = 0.3
NEARLY_EQUAL = 1e-6  # shares of the poles' size within which pairs of poles are not told apart
ROW_PROBES, SLOWEST_PROBE = 25, 1e-3  # angles of the unit circle, and the smallest [rad], where rows are tried
EQUALLY_SLOW = 0.03  # rates below this share of the sampling rate count as equally slow


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

    s, s_in  `lag_share` of the period, and of the time for which the command of Q acts

    The new command acts for the rest of the period, 1 - f; what that lacks of a whole one is the old command's.
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
    """The chain as rows (m, 8) of `loop.hold`, each but the first divided by the denominators of those before it
    too.

    With E the growth, c the output, G the states that a new or an old force adds, and the quadratics
    D_i = d^2 + d1_i d + d0_i whose roots are two of the sampled poles each

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
        if rate < MUCH_SLOWER * fastest:  # the first of a group of pairs of about one rate
            if i:
                fast = invariant_subspace(form, np.concatenate(pairs[:i]))
                parts = [(direct, _without_subspace(G, *fast)) for direct, G in parts]
            fastest = rate
        e = sampled_poles(pair, period)
        d1, d0 = float(-np.sum(e).real), float(np.prod(e).real)
        if len(pair) == 1:  # joined by a pole at z = 0, which no wall moves
            d1, d0 = d1 + 1.0, d1
        row = [d1, d0]
        for direct, G in parts:  # the direct part over the same denominator: direct (d^2 + d1 d + d0)
            row += [direct, float(c @ G) + direct * d1, float(c @ (E @ G + d1 * G)) + direct * d0]
        rows.append(row)
        parts = [(0.0, E @ (E @ G + d1 * G) + d0 * G) for _, G in parts]
    return np.array(rows).reshape(-1, 8)


def exact_rows(form: FirstOrderForm, sampled: SampledForm, period: float) -> Floats:
    """`form_rows` in decimal arithmetic, with the poles of the sampled matrix to many digits: rows of the states
    as their doubles are, where springs or masses of very unlike size leave rounding in place of them.

    Returns  no rows, (0, 8), where poles are equal to rounding, and for a form of more than MOST_STATES states
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
            # a pole at 0 is exact already, and Newton's method would not settle in shares of it
            roots = [
                refined_root(below, complex(e)) if e else (Decimal(0),) * 2 for e in sampled_poles(pair, period)
            ]
            found = [root for root in roots if root is not None]
            if len(found) < len(pair):
                return none
            if len(found) == 1:  # joined by a pole at z = 0, which no wall moves
                found.append((Decimal(-1), Decimal(0)))
            (x, y), (x2, y2) = found  # roots x + i y, x2 + i y2, conjugate or both real
            d1, d0 = -(x + x2), x * x2 - y * y2
            row = [d1, d0]
            products = [[exact_dot(line, G) for line in E] for _, G in parts]  # E G of each part
            for (direct, G), moved in zip(parts, products, strict=True):
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
                for (_, G), moved in zip(parts, products, strict=True)
            ]
    return np.array(rows).reshape(-1, 8)


def separate_rows(form: FirstOrderForm, period: float, fraction: float = 0.0, lag: float = 0.0) -> Floats:
    """Rows (m, 8) as of `form_rows`, one for each pair of poles on a subspace of its own, none divided by another;
    arguments as of `sample_form`.

    Where poles lie far apart these keep digits that a long chain loses. Where two pairs are nearly equal they have
    no subspaces of their own: no rows, (0, 8).
    """
    rows, pairs = [], _pairs(form.poles, period)
    for pair, other in combinations(pairs, 2):
        if np.min(np.abs(pair[:, None] - other)) <= NEARLY_EQUAL * np.max(np.abs(pair)):
            return np.zeros((0, 8))
    for pair in pairs:
        right, left = invariant_subspace(form, pair)
        form_of_pair = replace(
            form,
            dynamics=left.T @ form.dynamics @ right,
            input=left.T @ form.input,
            output=form.output @ right,
            poles=pair,
        )
        rows.append(form_rows(form_of_pair, sample_form(form_of_pair, period, fraction, lag), period))
    return np.vstack(rows)


def rows_error(rows: Floats, sampled: SampledForm) -> float:
    """How far the response of rows (m, 9) is from that of the states on the unit circle, in shares of it; 0
    without states.

    Both are compared at ROW_PROBES angles, the last short of pi, where a response may be 0, each in shares of the
    largest response at three neighbouring ones: about a zero of the response rounding is any share of it.

    rows     columns of `loop.sections.Sections.rows`
    sampled  the form that these rows stand for
    """
    k = len(sampled.output)
    if not k:
        return 0.0
    z = np.exp(1j * np.geomspace(SLOWEST_PROBE, 0.999 * np.pi, ROW_PROBES))
    d = z - 1.0
    pushed = np.stack([sampled.new, sampled.old], axis=1)
    states = np.linalg.solve(
        d[:, None, None] * np.eye(k) - sampled.growth, np.broadcast_to(pushed, (ROW_PROBES, k, 2))
    )
    new, old = (sampled.output @ states).T
    wanted = new + sampled.direct_new + (old + sampled.direct_old) / z
    # over: 1 / (the denominators by which a row is divided, its own and those of the chain before it)
    found, over = np.zeros(ROW_PROBES, dtype=np.complex128), np.ones(ROW_PROBES, dtype=np.complex128)
    for d1, d0, n2, n1, n0, o2, o1, o0, chained in rows:
        below = (d + d1) * d + d0
        over = over / below if chained else 1.0 / below
        found += ((n2 * d + n1) * d + n0 + ((o2 * d + o1) * d + o0) / z) * over
    size = np.pad(np.abs(wanted), 1)
    largest = np.maximum(np.maximum(size[:-2], size[1:-1]), size[2:])
    return float(np.max(np.abs(found - wanted) / largest))


def _without_subspace(G: Floats, right: Floats, left: Floats) -> Floats:
    """G (k,) without its part in a subspace, in entries where that part is more than the rounding of this product.

    right, left  (k, r)  bases of the subspace and of its dual, left^T right = 1
    """
    part = right @ (left.T @ G)
    rounding = 1e-15 * (np.abs(right) @ (np.abs(left.T) @ np.abs(G)))
    return G - np.where(np.abs(part) > rounding, part, 0.0)


def step_growth(form: FirstOrderForm, time: float, lag: float) -> tuple[Floats, Floats, Floats]:
    """exp(A t) - 1 (k, k), and states (k,) after a time t: from a unit lagged force without command, and from rest
    under a unit command through the lag [s]; without lag the first is 0."""
    growth, lagged, pushed = steps_growth(form.dynamics, form.input[:, None], time, lag)
    return growth, lagged[:, 0], pushed[:, 0]


def steps_growth(dynamics: Floats, inputs: Floats, time: float, lag: float) -> tuple[Floats, Floats, Floats]:
    """`step_growth` of r forces, each on a column of inputs (k, r): exp(A t) - 1 (k, k), and both states (k, r);
    dynamics (k, k) A [1/s], time t and lag [s].

    One exponential has all: of states, k auxiliary rows, forces and commands. The auxiliary columns hold the
    integral of exp(A t) over the step, in units of t, and A t times that is exp(A t) - 1 without cancellation.
    """
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
    """Poles [1/s] two by two, fast ones first: conjugates together, a real one a with the next faster real one b.
    An array of one pole is left where there is no b, or MUCH_SLOWER |b| is above both |a| and EQUALLY_SLOW / T."""
    pairs = [np.array([value, value.conjugate()]) for value in poles[poles.imag > 0.0]]
    real = list(poles[poles.imag == 0.0][np.argsort(np.abs(poles[poles.imag == 0.0]))])
    while real:
        count = 1
        if len(real) > 1 and MUCH_SLOWER * abs(real[1]) <= max(abs(real[0]), EQUALLY_SLOW / period):
            count = 2
        pairs.append(np.array(real[:count]))
        del real[:count]
    return sorted(pairs, key=lambda pair: -float(np.max(np.abs(pair))))


def sampled_poles(poles: Complexes, period: float) -> Complexes:
    """exp(s T) - 1 of poles s (k,) [1/s], without cancellation near 0: with s T = x + i y its real part is
    (e^x - 1) cos y - 2 sin^2(y/2)."""
    x = poles * period
    real = np.expm1(x.real) * np.cos(x.imag) - 2.0 * np.sin(x.imag / 2.0) ** 2
    return real + 1j * np.exp(x.real) * np.sin(x.imag)


STEPS, SETTLED = 3, 1e-15  # of Newton's method; the step in shares of a root at which it has settled
# The longest steps that are tried, in shares of the distance to the next root, and how many of any length.
SMALL_STEP, LONG_STEP, ANY_STEP, MANY_STEPS = 1e-3, 0.1, 1e300, 40
GOOD = 1e-11  # error below which nothing better is looked for
# Error above which poles and zeros are found again in decimal arithmetic: a root on the circle, which moves by
# about as much, would else be off it by what eigenvalues see (1e-9).
KEPT_DIGITS = 1e-10
FEW_DIGITS = 1e-3  # weight of the largest error beside the median
PROBES, LOWEST_PROBE = 40, 1e-3  # angles of the circle at which responses are compared, and their least [rad]
# Where P d^2 is below this share of its largest, walls on the circle are far too stiff to be edges.
IRRELEVANT = 1e-6
INFINITE, FAR_ZERO = 1e12, -10.0  # a zero farther away than this is none; where far ones are looked for
SLOW = 1e-2  # |d| below which the form's own zeros of rounding, in place of poles at 0, show in its response
REAL = 1e-10  # share of a root that its imaginary part is of, if that is only rounding
WELL_INSIDE = 0.5  # |z| below which a root that poles and zeros share decides on nothing


@dataclass(frozen=True)
class PoleZeroForm:
    """gain * product (d - zeros) / product (d - poles),  d = z - 1, with both of each conjugate pair. Fewer zeros
    than poles."""

    poles: Complexes
    zeros: Complexes
    gain: float

    def response(self, d: Complexes) -> Complexes:
        """Response (...) of the form at d = z - 1 (...)."""
        out = np.full(np.shape(d), complex(self.gain))
        for k, pole in enumerate(self.poles):
            out = out * (d - self.zeros[k]) / (d - pole) if k < len(self.zeros) else out / (d - pole)
        return out


def pole_zero_form(
    form: SampledForm, zero_poles: int, path: SampledForm, known_zeros: Complexes
) -> tuple[PoleZeroForm, float]:
    """The poles, zeros and gain of a form, and their typical error in shares of the response on the circle.

    form         without `old` and direct parts
    zero_poles   how many of the poles are 0 exactly: places and speeds that a free motion keeps
    path         a form with the zeros of the response that are not known
    known_zeros  the other zeros of the response

    What does not match the response to GOOD is tried again from other starts and with longer steps; what misses it
    by more than KEPT_DIGITS then, in decimal arithmetic.
    """
    system, behind = _Balanced.of(form), _Balanced.of(path)
    poles = np.linalg.eigvals(system.E).astype(np.complex128)
    poles = _with_exact_zeros(poles, zero_poles)
    zeros, path_poles = behind.zeros(), np.linalg.eigvals(behind.E).astype(np.complex128)
    match = _Match(system, _probes(poles), zero_poles)
    finer = _improved(behind, zeros, SMALL_STEP, path_poles)
    found, error = match.best([_improved(system, poles, SMALL_STEP, None)], [np.append(known_zeros, finer)])
    if error > GOOD:
        some = [zeros, finer, _improved(behind, _off_axis(zeros), ANY_STEP, path_poles, MANY_STEPS)]
        steps = [_improved(system, poles, longest, None) for longest in (SMALL_STEP, LONG_STEP)]
        steps.append(_improved(system, _off_axis(poles), ANY_STEP, None, MANY_STEPS))
        found, error = match.best([poles, *steps], [np.append(known_zeros, each) for each in some])
    if error > KEPT_DIGITS:
        exact = _exact_form(system, zero_poles)
        if exact is not None and (exact_error := match.error(exact)) < error:
            found, error = exact, exact_error
    return _without_common_roots(found), error


def _with_exact_zeros(poles: Complexes, count: int) -> Complexes:
    """Poles with so many of them, the least ones, at 0. Where that takes one of a conjugate pair, the other one is
    next to 0, too, and real."""
    order, exact = np.argsort(np.abs(poles)), poles.copy()
    exact[order[:count]] = 0.0
    if np.count_nonzero(exact.imag > 0.0) != np.count_nonzero(exact.imag < 0.0):
        exact[order[count]] = exact[order[count]].real
    return exact


class _Match:
    """How well poles and zeros give a system's response on the circle.

    zero_poles  as of `pole_zero_form`
    """

    def __init__(self, system: _Balanced, d: Complexes, zero_poles: int) -> None:
        """Keep the system's response at d = z - 1 (k,); `allowed` (k,), the size of an error that counts as 1, and
        `relevant` (k,), whether walls there can be edges. The response P counts as P d^2, which is constant for a
        free mass. An error of the response's own size counts as 1; more is allowed where the response is
        irrelevant, and below SLOW, where the system's own response is wrong by zeros of rounding."""
        self.d, self.wanted = d, system.response(d)
        size = np.abs(self.wanted * d**2)
        slow = np.minimum(np.abs(d) / SLOW, 1.0) ** zero_poles
        self.allowed = (size + IRRELEVANT * np.max(size)) / np.abs(d) ** 2 / slow
        self.relevant = size > IRRELEVANT * np.max(size)

    def best(self, poles: list[Complexes], zeros: list[Complexes]) -> tuple[PoleZeroForm, float]:
        """The form of one of the sets of poles and one of the sets of zeros with the least error, and that error;
        inf where none has conjugates to all its roots, or none a finite error. Its gain is the median that matches
        the response where walls can be edges."""
        none = np.zeros(0, dtype=np.complex128)
        found, least = PoleZeroForm(none, none, 0.0), np.inf
        for some, others in product(map(_conjugate_pairs, poles), map(_conjugate_pairs, zeros)):
            if some is None or others is None:
                continue
            with np.errstate(all="ignore"):  # a pole on the circle may be a probe
                ratio = self.wanted / PoleZeroForm(some, others, 1.0).response(self.d)
                one = PoleZeroForm(some, others, float(np.median(ratio[self.relevant].real)))
            error = self.error(one)
            if error < least:
                found, least = one, error
        return found, least

    def error(self, form: PoleZeroForm) -> float:
        """Typical error of a form in shares of the response where it counts; inf where it is no number."""
        with np.errstate(all="ignore"):  # a pole on the circle may be a probe
            off = np.abs(form.response(self.d) - self.wanted) / self.allowed
        # at high frequency the system's own response has few digits left, which the form is not to follow
        error = float(np.median(off) + FEW_DIGITS * np.max(off))
        return error if error == error else np.inf  # nan is not equal to itself


def _exact_form(system: _Balanced, zero_poles: int) -> PoleZeroForm | None:
    """Poles, zeros and gain in decimal arithmetic, as the system's doubles have them; None for more than
    MOST_STATES states, where the numerator is 0, and where roots do not settle or have no conjugates. zero_poles:
    `pole_zero_form`."""
    if len(system.g) > MOST_STATES:
        return None
    below = characteristic_polynomial(system.E)
    above = numerator(system.E, system.g, system.c, below)
    if not above:
        return None
    poles, zeros = _exact_roots(below), _exact_roots(above)
    if poles is None or zeros is None:
        return None
    pairs = _conjugate_pairs(_with_exact_zeros(poles, zero_poles)), _conjugate_pairs(zeros)
    if pairs[0] is None or pairs[1] is None:
        return None
    return PoleZeroForm(pairs[0], pairs[1], float(above[-1]))  # `below` is monic


def _exact_roots(p: Polynomial) -> Complexes | None:
    """Roots in d of a polynomial, None where they do not settle, or its coefficients are beyond doubles; those at
    z = 0, d = -1, of commands that wait, are divided out first, since equal ones do not settle."""
    rest, waiting = without_roots(p, -1)
    companion = np.diag(np.ones(len(rest) - 2), -1) if len(rest) > 1 else np.zeros((0, 0))
    if len(rest) > 1:
        companion[:, -1] = [-float(each / rest[-1]) for each in rest[:-1]]
    starts = np.linalg.eigvals(companion) if np.all(np.isfinite(companion)) else None
    others = None if starts is None else roots_near(rest, _off_axis(starts.astype(np.complex128)))
    if others is None:
        return None
    return np.append(others, np.full(waiting, -1.0 + 0.0j))


@dataclass(frozen=True)
class _Balanced:
    """The form c (d - E)^-1 g with its states in units in which rows and columns of E are of one size."""

    E: Floats
    g: Floats
    c: Floats

    @classmethod
    def of(cls, form: SampledForm) -> _Balanced:
        """The form with its states scaled, which leaves its response as it is."""
        from scipy.linalg import matrix_balance

        with np.errstate(invalid="ignore"):  # scales beyond 2^63 are no permutation, for which it takes them, too
            E, (scale, _) = matrix_balance(form.growth, permute=False, separate=True)
        g, c = form.new / scale, form.output * scale
        return cls(E, g, c)

    def response(self, d: Complexes) -> Complexes:
        """c (d - E)^-1 g at d (k,)."""
        resolvent = d[:, None, None] * np.eye(len(self.g)) - self.E
        right = np.broadcast_to(self.g.astype(complex)[:, None], (len(d), len(self.g), 1))
        return np.asarray(np.linalg.solve(resolvent, right)[..., 0] @ self.c)

    def zeros(self) -> Complexes:
        """Zeros of the response, as many as its relative degree leaves: the smallest finite eigenvalues of the
        pencil, and places far out for zeros that it has not."""
        from scipy.linalg import eigvals

        n = len(self.g)
        pencil, unit = np.zeros((n + 1, n + 1)), np.diag(np.append(np.ones(n), 0.0))
        pencil[:n, :n] = self.E
        # g and c divided by their size, which moves no zero
        pencil[:n, n], pencil[n, :n] = self.g / np.max(np.abs(self.g)), self.c / np.max(np.abs(self.c))
        value, scale = eigvals(pencil, unit, homogeneous_eigvals=True)
        count = n - self._relative_degree()
        finite = np.abs(value) < INFINITE * np.abs(scale)
        zeros = np.asarray(value[finite] / scale[finite], dtype=np.complex128)
        zeros = zeros[np.argsort(np.abs(zeros))[:count]]
        # the pencil takes far ones for infinite: unlike places far out, from which `_improved` looks for them
        return np.append(zeros, FAR_ZERO * np.arange(1, count - len(zeros) + 1))

    def _relative_degree(self) -> int:
        """How many samples pass before the reading shows a force: what does not reach it at all is exactly 0."""
        moved = self.g
        for degree in range(1, len(self.g)):
            if self.c @ moved != 0.0:
                return degree
            moved = moved + self.E @ moved  # the states a sample later
        return len(self.g)


def _probes(poles: Complexes) -> Complexes:
    """Probes d = z - 1 (k,) at angles of the circle, from below the slowest pole, LOWEST_PROBE at most and a
    thousandth of it at least, to just short of pi, where responses may be 0."""
    moving = np.abs(poles[poles != 0.0])
    least = min(LOWEST_PROBE, max(0.3 * float(np.min(moving, initial=1.0)), 1e-3 * LOWEST_PROBE))
    angles = np.geomspace(least, 0.999 * np.pi, PROBES)
    return np.asarray(-2.0 * np.sin(angles / 2.0) ** 2 + 1j * np.sin(angles))


def _off_axis(roots: Complexes) -> Complexes:
    """Roots (k,) moved a little, each another way, so that real pairs can become conjugate ones and vice versa."""
    return np.asarray(roots * (1.0 + 1e-3 * np.exp(1j * np.arange(len(roots)))))


def _improved(
    system: _Balanced, roots: Complexes, longest: float, poles: Complexes | None, steps: int = STEPS
) -> Complexes:
    """Poles (k,) after at most `steps` steps of Newton's method, or zeros where `poles` is given. What is 0 stays
    so.

    longest  longest step that is made, in shares of the distance to the next root
    poles    the system's own, to which no zero may jump; None: `roots` are poles
    """
    n, at, movable = len(system.g), roots.copy(), roots != 0.0
    for _ in range(steps if len(at) else 0):
        with np.errstate(all="ignore"):
            slope = _slope(system, at, n, poles is not None)
            apart = at[:, None] - at
            np.fill_diagonal(apart, np.inf)
            near = np.min(np.abs(apart), axis=1)
            if poles is not None:
                near = np.minimum(near, np.min(np.abs(at[:, None] - poles), axis=1))
            step = 1.0 / (slope - np.sum(1.0 / apart, axis=1))  # Newton's, the other roots divided out
            moved = movable & np.isfinite(step) & (np.abs(step) < longest * near)
        step = np.where(moved, step, 0.0)
        at = at - step
        if np.all(np.abs(step) <= SETTLED * np.abs(at)):
            break
    return at


def _slope(system: _Balanced, at: Complexes, n: int, of_zeros: bool) -> Complexes:
    """Logarithmic derivative of det(d - E), or `of_zeros` of c adj(d - E) g, at d (k,), n being the size of E; not
    finite exactly at a pole."""
    resolvent = at[:, None, None] * np.eye(n) - system.E
    try:
        inverse = np.linalg.inv(resolvent)
    except np.linalg.LinAlgError:
        # one of them is a pole: each by itself
        if len(at) == 1:
            return np.full(1, complex(np.nan, np.nan))
        return np.concatenate([_slope(system, at[k : k + 1], n, of_zeros) for k in range(len(at))])
    out = np.trace(inverse, axis1=-2, axis2=-1)
    if of_zeros:
        # of c (d - E)^-1 g, whose derivative is -c (d - E)^-2 g, times det(d - E)
        states = inverse @ system.g
        out = out - np.einsum("kij,kj->ki", inverse, states) @ system.c / (states @ system.c)
    return np.asarray(out)


def _conjugate_pairs(roots: Complexes) -> Complexes | None:
    """Roots in exact conjugate pairs one after the other, then the real ones, largest first; None where a root has
    no conjugate."""
    on_axis = np.abs(roots.imag) <= REAL * np.abs(roots)
    real, upper = roots[on_axis].real, roots[(roots.imag > 0.0) & ~on_axis]
    if len(real) + 2 * len(upper) != len(roots):
        return None
    upper = upper[np.argsort(-np.abs(upper))]
    real = real[np.argsort(-np.abs(real))]
    return np.concatenate([np.stack([upper, upper.conj()], axis=1).ravel(), real.astype(np.complex128)])


def _without_common_roots(form: PoleZeroForm) -> PoleZeroForm:
    """The form without real roots |z| < WELL_INSIDE that poles and zeros share to the last digit, as those of
    delays at z = 0."""
    poles, zeros = form.poles.tolist(), form.zeros.tolist()
    for zero in form.zeros:
        if zero.imag == 0.0 and abs(1.0 + zero) < WELL_INSIDE and zero in poles:
            poles.remove(zero)
            zeros.remove(zero)
    return PoleZeroForm(np.array(poles, dtype=np.complex128), np.array(zeros, dtype=np.complex128), form.gain)
