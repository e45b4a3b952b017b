"""Natural frequencies, damping and residues: a sum of modes fitted to a sampled response."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.identify.modes.local_response import RecordResponse
from zwidth.identify.profile_likelihood import Fit, fit_least_squares
from zwidth.loop.controller import split_delay
from zwidth.loop.hold import held_row
from zwidth.loop.loop import Loop

Damping = Literal["viscous", "hysteretic"]

RATIOS: Final = (0.005, 0.04, 0.3)  # damping ratios among which a further mode is looked for
POINTS: Final = 100  # frequencies among which it is
FIRST_DELAYS: Final = (0.0, 1.0, 2.0)  # samples
TRIED: Final = 64  # of them at once: all together would take a gigabyte for a long record
REFINED: Final = 2  # places of a further mode that are refined
FOLDED: Final = (0.5, 1.5)  # of half the sampling rate: where a mode and its mirror image look much alike
MOST_MODES: Final = 6
PROFILED: Final = 3  # modes at most whose intervals follow the likelihood; of more, its curvature
UNEXPLAINED, HELPFUL = 2.0, 0.7  # misfit beyond which a third mode must lower the sum of squares to such a share
SLOWEST: Final = 2.0  # lowest angles, below which no mode is looked for
STRONG: Final = 10.0  # by which the information criterion must fall for a further mode (Kass and Raftery 1995)
LEAST_DELAY, MOST_DELAY = -3.0, 20.0  # samples; below 0 where columns are shifted
LEAST_RATIO, MOST_RATIO = 1e-5, 3.0
ALIASES: Final = 12  # to either side, by which a loss factor differs from a damper
FASTEST: Final = 30.0  # Nyquist frequencies: a mode so fast follows the force at once
MOST_KEPT: Final = 256  # columns that a search keeps
BASES: Final = ("free", "free, braked", "grounded")


@dataclass(frozen=True)
class ModalFit:
    """A sum of modes that makes a response.

    P = z^-d [ r_0 H_0 + sum_i r_i H_i + r_s H_s ],   H of a mode the exact held response of 1/(s^2 + 2 zeta w s +
    w^2)

    coupled      dampers couple the modes, so that each has a second residue, q_i s beside r_i, all q_i together 0
    base         "free": H_0 of 1/s²; "free, braked": of 1/(s (s + a)); "grounded": none
    damping      "viscous"; "hysteretic": of 1/(w^2 (1 + i eta) - w^2), eta = 2 zeta
    period       T [s]
    vector       (1 + braked + 2 m,) delay [samples], ln a, then ln w and ln zeta of each mode
    residues     of the base, of each mode, and of all faster ones together [1/kg]; then q_i/w_i, but for the first
                 of them, where coupled
    chi_squared  of the residuals
    rows         number of residuals
    """

    base: str
    damping: Damping
    period: float
    vector: Floats
    residues: Floats
    chi_squared: float
    rows: int
    coupled: bool = False

    @property
    def count(self) -> int:
        """Number of modes."""
        return (len(self.vector) - self._before) // 2

    @property
    def _before(self) -> int:
        """Entries of `vector` before those of the modes: the delay, and the brake."""
        return 2 if self.base == "free, braked" else 1

    @property
    def rates(self) -> Floats:
        """Natural frequencies w (m,) [rad/s]."""
        return np.exp(self.vector[self._before :: 2])

    @property
    def ratios(self) -> Floats:
        """Damping ratios zeta (m,)."""
        return np.exp(self.vector[self._before + 1 :: 2])

    @property
    def clear_rates(self) -> Floats:
        """w of the modes that are peaks of the response, making more than half of it there, ascending [rad/s]."""
        rates, shift = self.rates, 0 if self.base == "grounded" else 1
        # size of the response at a resonance, by the mode alone and of all modes
        by_mode = np.abs(self.residues[shift : shift + self.count]) / (2.0 * self.ratios * rates**2)
        inside = rates * self.period < np.pi
        of_all = np.abs(self.response(np.minimum(rates * self.period, np.pi)))
        return np.sort(rates[(by_mode > 0.5 * of_all) & inside])

    @property
    def delay(self) -> float:
        """Delay of the response [s]."""
        return float(self.vector[0]) * self.period

    @property
    def poles(self) -> Complexes:
        """Poles in continuous time, of pairs the upper ones, and that of the brake [1/s]."""
        w, root = self.rates, np.emath.sqrt(self.ratios**2 - 1.0) * (1.0 + 0j)
        upper = -self.ratios * w + 1j * np.abs(root.imag) * w
        real = np.concatenate([-w * (self.ratios + sign * root.real) for sign in (1.0, -1.0)])
        over = self.ratios >= 1.0
        brake = [-np.exp(self.vector[1])] if self.base == "free, braked" else []
        return np.concatenate([upper[~over], real[np.tile(over, 2)], brake]).astype(complex)

    @property
    def misfit(self) -> float:
        """By how much the residuals are larger than the noise; 1 where the modes explain all."""
        return float(np.sqrt(self.chi_squared / max(self.rows - len(self.vector) - len(self.residues), 1)))

    @property
    def criterion(self) -> float:
        """Bayes's information criterion: n ln(chi^2/n) + k ln n."""
        k = len(self.vector) + len(self.residues)
        return self.rows * float(np.log(self.chi_squared / self.rows)) + k * float(np.log(self.rows))

    def response(self, theta: Floats) -> Complexes:
        """Response P (n,) at angles (n,) [m/N]."""
        return np.asarray(self.columns(self.vector, theta) @ self.residues)

    def columns(self, vector: Floats, theta: Floats) -> Complexes:
        """Responses (n, c) of unit residues, for other poles and another delay."""
        return _columns(self.base, self.damping, self.period, vector, theta, self.coupled)


def fit_modes(
    data: RecordResponse, period: float, near: ModalFit | None = None, most: int = MOST_MODES
) -> ModalFit:
    """The modes that a response shows: each further one where it explains the most, as long as the information
    criterion falls by more than ten. The device is taken for a free one at first; in the end for a braked one, or
    one on a spring, where that explains it better.

    period  of the loop [s]
    near    modes that are known to be about right, to begin with; None: none
    most    of modes
    """
    if near is None:
        starts = (_residues_solved(data, "free", period, np.array([d])) for d in FIRST_DELAYS)
        best = _poles_refined(data, min(starts, key=lambda fit: fit.chi_squared))
    else:
        best = _pruned(data, _poles_refined(data, near))
    while best.count < most:
        delays = (float(best.vector[0]), *(FIRST_DELAYS if best.count == 0 else ()))
        tried = [
            one
            for d in delays
            for one in _with_one_more_mode(data, replace(best, vector=np.r_[d, best.vector[1:]]))
        ]
        tried.sort(key=lambda fit: fit.chi_squared)
        longer = min((_poles_refined(data, one) for one in tried[:REFINED]), key=lambda fit: fit.chi_squared)
        if best.count and not best.coupled and best.damping == "viscous":
            # dampers that couple the modes are no further mode; with them the base shows
            bases = BASES if best.count > 1 else ("free, braked",)  # one mode alone is coupled to nothing else
            mixed = (_poles_refined(data, _on_base(data, replace(best, coupled=True), base)) for base in bases)
            coupled = min(mixed, key=lambda fit: fit.criterion)
            if coupled.criterion < min(best.criterion - STRONG, longer.criterion):
                best = coupled
                continue
        if longer.criterion > best.criterion - STRONG:
            break
        if best.count and best.damping == "viscous":
            # nor are loss factors: modes that stand for them lead the delay astray
            lossy = _poles_refined(data, _with_damping(data, best, "hysteretic"))
            if lossy.criterion < min(best.criterion - STRONG, longer.criterion):
                best = lossy
                continue
        if best.count > 1 and best.misfit > UNEXPLAINED and longer.chi_squared > HELPFUL * best.chi_squared:
            break  # what is left is no mode
        best = longer
    others = [
        _poles_refined(data, _on_base(data, best, base))
        for base in BASES
        if base != best.base and (best.count or base != "grounded")
    ]
    return min([best, *others], key=lambda fit: fit.criterion)


def modes_of(data: RecordResponse, loop: Loop) -> ModalFit:
    """The modes nearest to those of a loop's plant, fitted to a response."""
    plant, T = loop.plant, loop.period
    n = plant.size
    A = np.zeros((2 * n, 2 * n))  # of the state: positions, then velocities
    A[:n, n:] = np.eye(n)
    A[n:, :n] = -np.linalg.solve(plant.mass, plant.stiffness)
    A[n:, n:] = -np.linalg.solve(plant.mass, plant.damping)
    poles = np.linalg.eigvals(A)
    # logarithms of the slowest and the fastest rate [1/s] that is looked for
    low, fast = np.log(SLOWEST * data.theta.min() / T), np.log(FOLDED[1] * np.pi / T)
    # 1e-9: real to rounding; a pole of 0 is no mode
    real = np.sort(
        np.abs(poles[(np.abs(poles.imag) < 1e-9 * np.abs(poles)) & (np.log(np.abs(poles) + 1e-300) > low)].real)
    )
    rates_and_ratios = [(np.abs(p), -p.real / np.abs(p)) for p in poles if p.imag > 1e-9 * np.abs(p)]
    # two real poles a and b make w^2 = a b and 2 zeta w = a + b; of an odd number the fastest is left out
    rates_and_ratios += [
        (np.sqrt(a * b), 0.5 * (a + b) / np.sqrt(a * b)) for a, b in zip(real[::2], real[1::2], strict=False)
    ]
    vector = [loop.controller.delay]
    for w, ratio in rates_and_ratios:
        if low < np.log(w) < fast:
            vector += [np.log(w), np.log(max(ratio, 2.0 * LEAST_RATIO))]
    start = _residues_solved(data, "free", T, np.array(vector))
    fits = [_on_base(data, replace(start, coupled=coupled), base) for base in BASES for coupled in (False, True)]
    return min((_poles_refined(data, fit) for fit in fits), key=lambda fit: fit.criterion)


def _pruned(data: RecordResponse, fit: ModalFit) -> ModalFit:
    """The modes without those whose loss raises the information criterion by no more than `STRONG`; one
    is always kept."""
    while fit.count > 1:
        shorter = list[ModalFit]()
        for i in range(fit.count):
            at = fit._before + 2 * i
            vector = np.delete(fit.vector, [at, at + 1])
            shorter.append(_residues_solved(data, fit.base, fit.period, vector, fit.damping, fit.coupled))
        pruned = _poles_refined(data, min(shorter, key=lambda other: other.chi_squared))
        if pruned.criterion > fit.criterion + STRONG:
            return fit
        fit = pruned
    return fit


def _on_base(data: RecordResponse, fit: ModalFit, base: str) -> ModalFit:
    """The same modes on another base, one of `BASES`, with the residues solved anew."""
    modes = fit.vector[fit._before :]
    vector = np.r_[fit.vector[0], _first_brake(base, data, fit.period), modes]
    return _residues_solved(data, base, fit.period, vector, fit.damping, fit.coupled)


def _first_brake(base: str, data: RecordResponse, period: float) -> list[float]:
    """Entry ln a of `ModalFit.vector` to begin with, at the lowest angle; [] of a base without a brake."""
    return [float(np.log(data.theta.min() / period))] if base == "free, braked" else []


def _with_one_more_mode(data: RecordResponse, fit: ModalFit) -> list[ModalFit]:
    """Fits with one more mode, where it lowers the sum of squares most: one below half the sampling rate and one
    above, which sampling makes look much alike."""
    columns = data.apply(fit.columns(fit.vector, data.theta))
    q, _ = np.linalg.qr(columns)
    remainder = data.target - q @ (q.T @ data.target)
    angles = np.unique(data.theta)
    angles = angles[np.unique(np.linspace(0, len(angles) - 1, POINTS).astype(int))]
    # and those above half the sampling rate that fold onto them
    angles = np.append(angles, 2.0 * np.pi - angles[angles > FOLDED[0] * np.pi])
    logarithms = [(np.log(angle / fit.period), np.log(zeta)) for angle in angles for zeta in RATIOS]
    # zeta w, and w^2
    decays_and_squares = [(float(np.exp(zeta + w)), float(np.exp(2.0 * w))) for w, zeta in logarithms]
    gain = np.empty(len(decays_and_squares))
    for first in range(0, len(decays_and_squares), TRIED):
        part = slice(first, first + TRIED)
        rows = data.apply(_held_responses(decays_and_squares[part], fit.period, float(fit.vector[0]), data.theta))
        rows -= q @ (q.T @ rows)
        size = np.sum(rows**2, axis=0)
        gain[part] = (remainder @ rows) ** 2 / np.where(size > 0.0, size, np.inf)
    above = np.repeat(angles > np.pi, len(RATIOS))
    best = [int(np.argmax(np.where(which, gain, -1.0))) for which in (~above, above) if which.any()]
    vectors = [np.r_[fit.vector, logarithms[i]] for i in best]
    return [_residues_solved(data, fit.base, fit.period, vector, fit.damping, fit.coupled) for vector in vectors]


def _residues_solved(
    data: RecordResponse,
    base: str,
    period: float,
    vector: Floats,
    damping: Damping = "viscous",
    coupled: bool = False,
) -> ModalFit:
    """The fit with the residues that explain the response best, for poles and delay of `ModalFit.vector`."""
    columns = data.apply(_columns(base, damping, period, vector, data.theta, coupled))
    size = np.linalg.norm(columns, axis=0)
    size[size == 0.0] = 1.0
    residues = np.linalg.lstsq(columns / size, data.target, rcond=None)[0] / size
    chi_squared = float(np.sum((data.target - columns @ residues) ** 2))
    return ModalFit(base, damping, period, vector, residues, chi_squared, len(data.target), coupled)


def _residuals(data: RecordResponse, fit: ModalFit) -> Callable[[Floats], Floats]:
    """The function from poles and delay, `ModalFit.vector`, to what is left (r,) when the residues are chosen best
    (variable projection; Golub and Pereyra 1973)."""
    rows_of = _RowsOfColumns(data, fit)

    def left(vector: Floats) -> Floats:
        """The target (r,) less its projection on the columns' rows."""
        rows = rows_of(vector)
        q, _ = np.linalg.qr(rows / np.maximum(np.linalg.norm(rows, axis=0), 1e-300))
        return np.asarray(data.target - q @ (q.T @ data.target))

    return left


def _search_bounds(fit: ModalFit, data: RecordResponse) -> tuple[Floats, Floats]:
    """Bounds of `ModalFit.vector` within which a search stays."""
    T = fit.period
    slowest, fastest = np.log(SLOWEST * data.theta.min() / T), np.log(FOLDED[1] * np.pi / T)
    braked = fit.base == "free, braked"
    low = [LEAST_DELAY, *([np.log(1e-3 * data.theta.min() / T)] * braked)]
    high = [MOST_DELAY, *([np.log(10.0 / T)] * braked)]
    low += [slowest, np.log(LEAST_RATIO)] * fit.count
    high += [fastest, np.log(MOST_RATIO)] * fit.count
    return np.array(low), np.array(high)


def _poles_refined(data: RecordResponse, fit: ModalFit) -> ModalFit:
    """The fit with the poles and the delay, near its own, that explain the response best; modes stay as many."""
    from scipy.optimize import least_squares

    low, high = _search_bounds(fit, data)
    start = np.clip(fit.vector, low + 1e-9, high - 1e-9)
    solved = least_squares(
        _residuals(data, fit),
        start,
        bounds=(low, high),
        x_scale="jac",
        ftol=1e-5,
        xtol=1e-7,
        max_nfev=40,
    )
    return _residues_solved(data, fit.base, fit.period, np.asarray(solved.x), fit.damping, fit.coupled)


def modal_intervals(data: RecordResponse, fit: ModalFit, *, profiled: bool = True) -> tuple[Fit, Floats]:
    """Intervals of delay, frequencies and ratios by the profile likelihood, and standard deviations of the
    residues by the curvature.

    profiled  False: all by the curvature
    """
    low, high = _search_bounds(fit, data)
    start = np.clip(fit.vector, low + 1e-9, high - 1e-9)
    rows = len(data.target)
    found = fit_least_squares(
        _residuals(data, fit),
        start,
        lower=low,
        upper=high,
        profiled=profiled and fit.count <= PROFILED,
        # the residues were fitted, too, and take as many residuals
        effective_count=rows * (rows - len(fit.residues)) / rows,
    )
    step = 1e-6  # of the differences that give the derivatives
    modelled = fit.columns(found.values, data.theta)
    by_vector = list[Floats]()
    for i in range(len(start)):
        moved = found.values.copy()
        moved[i] += step
        other = fit.columns(moved, data.theta)
        by_vector.append(data.apply((other - modelled) @ fit.residues) / step)
    jacobian = np.column_stack([*by_vector, data.apply(modelled)])
    # derivatives by the vector, then by the residues
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    inverse = np.linalg.pinv((jacobian / size).T @ (jacobian / size)) / np.outer(size, size)
    return found, found.scale * np.sqrt(np.maximum(np.diag(inverse)[len(start) :], 0.0))


def _with_damping(data: RecordResponse, fit: ModalFit, damping: Damping) -> ModalFit:
    """The same modes with another damping, not coupled."""
    return _residues_solved(data, fit.base, fit.period, fit.vector, damping)


def with_either_damping(data: RecordResponse, fit: ModalFit) -> tuple[ModalFit, ModalFit]:
    """The same modes with dampers, and with loss factors: the criteria of both tell which explains the response
    better. Modes that stood for what the other damping does not explain fall away."""
    another: Damping = "hysteretic" if fit.damping == "viscous" else "viscous"
    other = _pruned(data, _poles_refined(data, _with_damping(data, fit, another)))
    return (fit, other) if fit.damping == "viscous" else (other, fit)


# --- columns ----------------------------------------------------------------------------------------------------


class _Column(NamedTuple):
    """A column: 1/(s^2 + 2 a s + w^2) of unit residue, held and sampled.

    decay, squared  a and w^2
    velocity        factor of its velocity in place of the motion; 0: the motion
    less            a and w^2 of another whose velocity is taken off it: all velocities together are none at once
                    after a force, since masses do not jump
    loss            w and zeta of a mode with a loss factor; None: it has a damper
    """

    decay: float
    squared: float
    velocity: float = 0.0
    less: tuple[float, float] = (0.0, 0.0)
    loss: tuple[float, float] | None = None


def _columns_of(base: str, damping: Damping, period: float, vector: Floats, coupled: bool) -> list[_Column]:
    """The columns of `ModalFit.columns`: the base, each mode, all faster ones, and, where dampers couple the
    modes, each mode's velocity over w, less that of the brake or of the first mode.

    vector  delay, brake and modes, as `ModalFit` has them;   period  of the loop [s]
    """
    before = 2 if base == "free, braked" else 1
    columns = list[_Column]()
    if base == "free":
        columns.append(_Column(0.0, 0.0))
    elif base == "free, braked":
        columns.append(_Column(0.5 * float(np.exp(vector[1])), 0.0))
    modes = list(zip(np.exp(vector[before::2]).tolist(), np.exp(vector[before + 1 :: 2]).tolist(), strict=True))
    columns += [_Column(zeta * w, w**2, loss=(w, zeta) if damping == "hysteretic" else None) for w, zeta in modes]
    # all faster modes as one, critically damped
    fast = FASTEST * np.pi / period
    columns.append(_Column(fast, fast**2))
    if coupled:
        joined = [(one.decay, one.squared) for one in columns[int(base == "free") : -1]]  # brake, and modes
        # nothing is coupled where there is neither a brake nor a mode
        columns += [_Column(a, w2, 1.0 / np.sqrt(max(w2, a**2)), joined[0]) for a, w2 in joined[1:]]
    return columns


def _columns(
    base: str, damping: Damping, period: float, vector: Floats, theta: Floats, coupled: bool = False
) -> Complexes:
    """Responses (n, c) of unit residues at angles (n,), for poles and delay, `vector`, as `ModalFit` has them."""
    columns, delay = _columns_of(base, damping, period, vector, coupled), float(vector[0])
    aliased = _aliased_hold(period, delay, theta) if any(one.loss for one in columns) else None
    return np.column_stack([_column(one, period, delay, theta, aliased) for one in columns])


def _column(
    column: _Column, period: float, delay: float, theta: Floats, aliased: tuple[Floats, Complexes] | None
) -> Complexes:
    """Response (n,) of one column behind a delay [samples]; aliased: `_aliased_hold`, for a loss factor."""
    if column.velocity:
        pairs = [(column.decay, column.squared), column.less]
        both = _held_responses(pairs, period, delay, theta, column.velocity)
        return np.asarray(both[:, 0] - both[:, 1])
    response = _held_responses([(column.decay, column.squared)], period, delay, theta)[:, 0]
    if column.loss is not None and aliased is not None:
        response = response + _added_by_loss(*column.loss, aliased)
    return response


class _RowsOfColumns:
    """Rows (r, c) that a local response makes of a fit's columns, for many choices of poles and delay.

    A search changes one pole at a time: the rows (r,) of the other columns are kept, by column and delay, and
    `_aliased_hold` of the last delay.
    """

    def __init__(self, data: RecordResponse, fit: ModalFit) -> None:
        self.data, self.fit = data, fit
        self.kept = dict[tuple[_Column, float], Floats]()
        self.aliased = dict[float, tuple[Floats, Complexes]]()

    def __call__(self, vector: Floats) -> Floats:
        """Rows (r, c) for poles and delay, `ModalFit.vector`."""
        fit, delay = self.fit, float(vector[0])
        columns = _columns_of(fit.base, fit.damping, fit.period, vector, fit.coupled)
        if len(self.kept) > MOST_KEPT:
            self.kept.clear()
        return np.column_stack([self._rows_of(column, delay) for column in columns])

    def _rows_of(self, column: _Column, delay: float) -> Floats:
        """Rows (r,) of one column behind a delay in samples, kept from before where they are."""
        key = column, delay
        if key not in self.kept:
            theta, period = self.data.theta, self.fit.period
            if column.loss is not None and delay not in self.aliased:
                self.aliased = {delay: _aliased_hold(period, delay, theta)}
            self.kept[key] = self.data.apply(_column(column, period, delay, theta, self.aliased.get(delay)))
        return self.kept[key]


def _held_responses(
    pairs: Sequence[tuple[float, float]], period: float, delay: float, theta: Floats, velocity: float = 0.0
) -> Complexes:
    """Held and sampled responses (n, c) of 1/(s^2 + 2 a s + w^2), of c pairs a, w^2, at angles theta (n,).

    period    of the loop [s];   delay  [samples]
    velocity  factor of the velocity, which is given in place of the motion; 0: the motion
    """
    whole, fraction = split_delay(delay)  # samples
    d = (2j * np.sin(0.5 * theta) * np.exp(0.5j * theta))[:, None]
    z = 1.0 + d
    position_and_velocity = (0.0, velocity) if velocity else (1.0, 0.0)
    rows = [held_row(a, w2, *position_and_velocity, period, fraction) for a, w2 in pairs]
    # in d = z - 1: denominator, numerators of the force now and of the one before, see `loop.hold`
    d1, d0, _, n1, n0, _, o1, o0 = np.array(rows).T
    numerator = n1 * d + n0
    if fraction > 0.0:
        numerator = numerator + (o1 * d + o0) / z
    return np.asarray(numerator / ((d + d1) * d + d0) / z**whole)


def _aliased_hold(period: float, delay: float, theta: Floats) -> tuple[Floats, Complexes]:
    """Angular frequencies (n, k) that sampling folds onto angles (n,) [rad/s], and the response of hold and delay
    [samples] at each of them, over the period."""
    w = (theta[:, None] + 2.0 * np.pi * np.arange(-ALIASES, ALIASES + 1)) / period
    hold = np.exp(-1j * w * delay * period) * -np.expm1(-1j * theta)[:, None] / (1j * w * period)
    return w, np.asarray(hold)


def _added_by_loss(rate: float, ratio: float, aliased: tuple[Floats, Complexes]) -> Complexes:
    """What a mode with a loss factor has more than one with a damper (n,): 1/(S + i a) - 1/(S + i b), where
    S = w_0^2 - w^2, a = sign(w) 2 zeta w_0^2, b = 2 zeta w_0 w."""
    w, hold = aliased
    stiff, loss = rate**2 - w**2, 2.0 * ratio * rate
    a, b = np.sign(w) * loss * rate, loss * w
    return np.asarray(np.sum(1j * (b - a) * hold / ((stiff + 1j * a) * (stiff + 1j * b)), axis=1))
