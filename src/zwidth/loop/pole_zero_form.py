"""A sampled form of any order as poles, zeros and a gain: the products that kernels evaluate without cancellation.

A chain or a sum of terms, as plants without feedback have it, loses digits where many filters have poles beside
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

from dataclasses import dataclass
from itertools import product

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.loop.coupled_hold import SampledForm
from zwidth.loop.exact_polynomials import (
    MOST_STATES,
    Polynomial,
    characteristic_polynomial,
    numerator,
    roots_near,
    without_roots,
)

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
    """gain * product (d - zeros) / product (d - poles),  d = z - 1; conjugates both. Fewer zeros than poles."""

    poles: Complexes
    zeros: Complexes
    gain: float

    def response(self, d: Complexes) -> Complexes:
        """Its value (...) at d (...)."""
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
    path         another form, whose zeros the response has, too
    known_zeros  the other zeros of the response
    """
    system, behind = _Balanced.of(form), _Balanced.of(path)
    poles = np.linalg.eigvals(system.E).astype(np.complex128)
    poles = _with_exact_zeros(poles, zero_poles)
    zeros, own = behind.zeros(), np.linalg.eigvals(behind.E).astype(np.complex128)
    match = _Match(system, _probes(poles), zero_poles)
    finer = _improved(behind, zeros, SMALL_STEP, own)
    found = match.best([_improved(system, poles, SMALL_STEP, None)], [np.append(known_zeros, finer)])
    if found[1] > GOOD:
        some = [zeros, finer, _improved(behind, _off_axis(zeros), ANY_STEP, own, MANY_STEPS)]
        steps = [_improved(system, poles, longest, None) for longest in (SMALL_STEP, LONG_STEP)]
        steps.append(_improved(system, _off_axis(poles), ANY_STEP, None, MANY_STEPS))
        found = match.best([poles, *steps], [np.append(known_zeros, each) for each in some])
    if found[1] > KEPT_DIGITS:
        exact = _exact_form(system, zero_poles)
        if exact is not None and (error := match.error(exact)) < found[1]:
            found = exact, error
    return _without_common_roots(found[0]), found[1]


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
        self.d, self.wanted = d, system.response(d)
        size = np.abs(self.wanted * d**2)
        slow = np.minimum(np.abs(d) / SLOW, 1.0) ** zero_poles
        self.allowed = (size + IRRELEVANT * np.max(size)) / np.abs(d) ** 2 / slow
        self.relevant = size > IRRELEVANT * np.max(size)

    def best(self, poles: list[Complexes], zeros: list[Complexes]) -> tuple[PoleZeroForm, float]:
        """The form of one of the sets of poles and one of the sets of zeros with the least error, and that."""
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
        return error if error == error else np.inf


def _exact_form(system: _Balanced, zero_poles: int) -> PoleZeroForm | None:
    """Poles, zeros and gain in decimal arithmetic, as the system's doubles have them; None where roots do not
    settle."""
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
    return PoleZeroForm(pairs[0], pairs[1], float(above[-1]))


def _exact_roots(p: Polynomial) -> Complexes | None:
    """All roots; those at z = 0, of commands that wait, are divided out first, since equal ones do not settle."""
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
    """A form in units in which its rows and columns are of one size."""

    E: Floats
    g: Floats
    c: Floats

    @classmethod
    def of(cls, form: SampledForm) -> _Balanced:
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
        """Zeros of the response, all finite eigenvalues of the pencil."""
        from scipy.linalg import eigvals

        n = len(self.g)
        pencil, unit = np.zeros((n + 1, n + 1)), np.diag(np.append(np.ones(n), 0.0))
        pencil[:n, :n] = self.E
        pencil[:n, n], pencil[n, :n] = self.g / np.max(np.abs(self.g)), self.c / np.max(np.abs(self.c))
        value, scale = eigvals(pencil, unit, homogeneous_eigvals=True)
        count = n - self._relative_degree()
        finite = np.abs(value) < INFINITE * np.abs(scale)
        zeros = np.asarray(value[finite] / scale[finite], dtype=np.complex128)
        zeros = zeros[np.argsort(np.abs(zeros))[:count]]
        # the pencil takes far ones for infinite
        return np.append(zeros, FAR_ZERO * np.arange(1, count - len(zeros) + 1))

    def _relative_degree(self) -> int:
        """How many samples pass before the reading shows a force: what does not reach it at all is exactly 0."""
        moved = self.g
        for degree in range(1, len(self.g)):
            if self.c @ moved != 0.0:
                return degree
            moved = moved + self.E @ moved
        return len(self.g)


def _probes(poles: Complexes) -> Complexes:
    """z - 1 at angles of the circle, from below the slowest pole up."""
    moving = np.abs(poles[poles != 0.0])
    least = min(LOWEST_PROBE, max(0.3 * float(np.min(moving, initial=1.0)), 1e-3 * LOWEST_PROBE))
    angles = np.geomspace(least, 0.999 * np.pi, PROBES)
    return np.asarray(-2.0 * np.sin(angles / 2.0) ** 2 + 1j * np.sin(angles))


def _off_axis(roots: Complexes) -> Complexes:
    """Roots moved a little, each another way, so that a real pair can become a conjugate one, and vice versa."""
    return np.asarray(roots * (1.0 + 1e-3 * np.exp(1j * np.arange(len(roots)))))


def _improved(
    system: _Balanced, roots: Complexes, longest: float, poles: Complexes | None, steps: int = STEPS
) -> Complexes:
    """Poles (k,) after some steps of Newton's method, zeros where `poles` is given. What is 0 stays so.

    longest  step, in shares of the distance to the next root
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
            step = 1.0 / (slope - np.sum(1.0 / apart, axis=1))
            moved = movable & np.isfinite(step) & (np.abs(step) < longest * near)
        step = np.where(moved, step, 0.0)
        at = at - step
        if np.all(np.abs(step) <= SETTLED * np.abs(at)):
            break
    return at


def _slope(system: _Balanced, at: Complexes, n: int, of_zeros: bool) -> Complexes:
    """Logarithmic derivative of det(d - E), or of c adj(d - E) g, at d (k,); not finite exactly at a pole."""
    resolvent = at[:, None, None] * np.eye(n) - system.E
    try:
        inverse = np.linalg.inv(resolvent)
    except np.linalg.LinAlgError:
        if len(at) == 1:
            return np.full(1, complex(np.nan, np.nan))
        return np.concatenate([_slope(system, at[k : k + 1], n, of_zeros) for k in range(len(at))])
    out = np.trace(inverse, axis1=-2, axis2=-1)
    if of_zeros:
        states = inverse @ system.g
        out = out - np.einsum("kij,kj->ki", inverse, states) @ system.c / (states @ system.c)
    return np.asarray(out)


def _conjugate_pairs(roots: Complexes) -> Complexes | None:
    """Roots in exact conjugate pairs one after the other, then the real ones, largest first; None where a root has
    no conjugate."""
    alone = np.abs(roots.imag) <= REAL * np.abs(roots)
    real, upper = roots[alone].real, roots[(roots.imag > 0.0) & ~alone]
    if len(real) + 2 * len(upper) != len(roots):
        return None
    upper = upper[np.argsort(-np.abs(upper))]
    real = real[np.argsort(-np.abs(real))]
    return np.concatenate([np.stack([upper, upper.conj()], axis=1).ravel(), real.astype(np.complex128)])


def _without_common_roots(form: PoleZeroForm) -> PoleZeroForm:
    """The form without real roots that poles and zeros share to the last digit, as those of delays at z = 0."""
    poles, zeros = form.poles.tolist(), form.zeros.tolist()
    for zero in form.zeros:
        if zero.imag == 0.0 and abs(1.0 + zero) < WELL_INSIDE and zero in poles:
            poles.remove(zero)
            zeros.remove(zero)
    return PoleZeroForm(np.array(poles, dtype=np.complex128), np.array(zeros, dtype=np.complex128), form.gain)
