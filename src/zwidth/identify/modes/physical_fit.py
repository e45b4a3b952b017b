"""Masses, springs, dampers and delays of a device, fitted to a response through the device's own sampled loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.identify.modes.local_response import LocalResponse
from zwidth.identify.modes.modal_fit import ModalFit
from zwidth.identify.modes.model import SampledModel
from zwidth.identify.profile_likelihood import Fit, Residuals, fit_least_squares
from zwidth.model.modes import undamped_modes

Floats = NDArray[np.float64]

HOPELESS: Final = 100.0  # times the number of residuals: where no modes explain them, no start does
SPREAD: Final = np.log(6.0)  # about the file's numbers, within which a start is looked for
TRIED, REFINED = 96, 3  # starts that are compared, and refined
POINTS: Final = 30  # frequencies by which they are compared
GOOD, ENOUGH = 1.05, 25.0  # times the sum of squares of the modes alone, or so much more: a fit has arrived
CLOSE: Final = 10.0  # more than that sum, from which on other starts are tried all the same
FAR: Final = np.log(1e4)  # beyond which no number is looked for
ABOUT: Final = (0.8, 0.9, 0.97, 1.0, 1.03, 1.1, 1.25)  # of a mode's frequency, where starts are compared, too
FOLDED: Final = (0.5, 1.5)  # of half the sampling rate: where a mode and its mirror image look much alike
UNSURE: Final = (0.8, 1.2)  # likewise: where the response tells little of a mode
AROUND, AROUND_TRIED = (
    3.0,
    24,
)  # factor about the file's numbers, and starts within it, where one mode tells little
DAMPED: Final = (0.1, 1.0, 10.0)  # times the damping of a mode about half the sampling rate
RIVAL: Final = 8.0  # by which a sum of squares may exceed the least one, and still set an interval's end
RIVALS, ELSEWHERE = 3, 0.3  # such minima at most, and how far from each other in logarithms
HEAVY: Final = 10.0  # weight of a mode's frequency beside that of a point of the response
LOST_START: Final = 50.0
LOST: Final = 1e6  # residual where there is no such device
SPRINGS: Final = ("N/m", "N m/rad")
DAMPERS: Final = ("N s/m", "N m s/rad")


@dataclass(frozen=True)
class PhysicalFit:
    """Numbers of a device that make a response.

    values, low, high  (p,) with their intervals; 0 and inf for ends without bound
    fit                of what the optimiser varied
    chi_squared        of the residuals, which have unit variance where the model is right
    rows               number of them
    """

    values: Floats
    low: Floats
    high: Floats
    fit: Fit
    chi_squared: float
    rows: int

    @property
    def misfit(self) -> float:
        """By how much the residuals are larger than the noise; 1 where the model explains all."""
        return float(np.sqrt(self.chi_squared / max(self.rows - len(self.values), 1)))


def fit_model(data: LocalResponse, model: SampledModel, modal: ModalFit, period: float) -> PhysicalFit:
    """The numbers that explain the response best, each with its interval by the profile likelihood.

    From the file's numbers first, and from others where these may not lead there (`_minima`). Where a response
    says little of a mode, several minima are hardly different, and all of them set the ends of intervals.
    """
    rows = len(data.target)

    def residuals(x: Floats) -> Floats:
        P = model.response(x, data.theta)
        return data.residuals(P) if np.isfinite(P).all() else np.full(rows, LOST)

    low, high = _limits(model, period)
    start = np.clip(model.vector(np.maximum(model.start, 1e-300)), low, high)
    timed = [i for i, one in enumerate(model.quantities) if not one.positive and one.unit == "s"]
    if timed and modal.count:
        start[timed[0]] = np.clip(modal.delay, 0.0, high[timed[0]])
    minima = _minima(residuals, data, model, modal, start, low, high, period)
    best, *rivals = _lowest(minima)
    fit = fit_least_squares(residuals, best, lower=low, upper=high, rivals=rivals)
    return PhysicalFit(
        model.values(fit.values),
        model.values(fit.low),
        model.values(fit.high),
        fit,
        fit.sum_of_squares,
        rows,
    )


def _minima(
    residuals: Residuals,
    data: LocalResponse,
    model: SampledModel,
    modal: ModalFit,
    start: Floats,
    low: Floats,
    high: Floats,
    period: float,
) -> list[tuple[Floats, float]]:
    """Where searches end, each with its sum of squares.

    Where the one from `start` does not come to what the modes alone explain: from many others within a factor of
    six, chosen by the logarithm of the response, in which a wrong frequency still pulls. Where a mode lies about
    half the sampling rate: from its mirror image. Where the response hides a mode, or the modes alone explain a
    little more: from many within a factor of three.
    """
    good = max(GOOD * modal.chi_squared, modal.chi_squared + ENOUGH)
    found = [_descended(residuals, start, low, high)]
    if found[0][1] > good and modal.chi_squared < HOPELESS * len(data.target):
        for x in _starts(data, model, modal, start, low, high, period):
            found.append(_descended(residuals, x, low, high))
            if found[-1][1] <= good:
                break
    best, least = min(found, key=lambda one: one[1])
    others = _unfolded(model, best, low, high, period)
    shares = _rates(model, best) * period / np.pi
    hidden = np.sum(shares < FOLDED[1]) > modal.count or np.any((shares > UNSURE[0]) & (shares < UNSURE[1]))
    if hidden or modal.chi_squared + CLOSE < least <= good:
        others += _spread_starts(model, start, np.log(AROUND), AROUND_TRIED, low, high)
    return found + [_descended(residuals, x, low, high) for x in others]


def _limits(model: SampledModel, period: float) -> tuple[Floats, Floats]:
    low, high = np.empty((2, len(model.quantities)))
    for i, one in enumerate(model.quantities):
        if one.positive:
            low[i], high[i] = np.log(one.start) - FAR, np.log(one.start) + FAR
        else:
            low[i], high[i] = 0.0, max(20.0 * period, 4.0 * one.start) if one.unit == "s" else np.inf
    return low, high


def _descended(residuals: Residuals, x: Floats, low: Floats, high: Floats) -> tuple[Floats, float]:
    """Parameters near x with a small sum of squares, and that sum."""
    from scipy.optimize import least_squares

    solved = least_squares(residuals, x, bounds=(low, high), x_scale="jac", ftol=1e-6, xtol=1e-7, max_nfev=40)
    return np.asarray(solved.x), 2.0 * float(solved.cost)


def _rates(model: SampledModel, x: Floats) -> Floats:
    """Natural frequencies of the flexible modes [rad/s], ascending; () where there is no such device."""
    try:
        plant = model.loop_of(model.values(x)).plant
    except ValueError:
        return np.zeros(0)
    squared = undamped_modes(plant.mass, plant.stiffness)[0]
    return np.sqrt(squared[squared > 0.0])


def _lowest(minima: Sequence[tuple[Floats, float]]) -> list[Floats]:
    """The lowest minimum, and some others elsewhere that are hardly higher."""
    found = list[Floats]()
    least = min(height for _, height in minima)
    for x, height in sorted(minima, key=lambda one: one[1]):
        apart = all(np.max(np.abs(x - other)) > ELSEWHERE for other in found)
        if apart and height < least + RIVAL and len(found) <= RIVALS:
            found.append(x)
    return found


def _unfolded(model: SampledModel, best: Floats, low: Floats, high: Floats, period: float) -> list[Floats]:
    """Starts with a mode on the other side of half the sampling rate, and with other damping: sampling
    makes all of them look much alike. Springs and dampers are scaled."""
    springs = np.array([one.unit in SPRINGS for one in model.quantities])
    dampers = np.array([one.unit in DAMPERS for one in model.quantities])
    starts = list[Floats]()
    for rate in _rates(model, best):
        if FOLDED[0] < rate * period / np.pi < FOLDED[1]:
            mirrored = 2.0 * np.pi / period - rate
            for factor, damped in product(np.log([1.0, mirrored / rate]), np.log(DAMPED)):
                x = best + 2.0 * factor * springs + (factor + damped) * dampers
                starts.append(np.clip(x, low, high))
    return starts


def _spread_starts(
    model: SampledModel, start: Floats, spread: float, count: int, low: Floats, high: Floats
) -> list[Floats]:
    """So many starts spread evenly (Sobol) within `spread` about a start, in logarithms, with its delay."""
    from scipy.stats import qmc

    positive = np.array([one.positive for one in model.quantities])
    cube = qmc.Sobol(len(start), scramble=False).random(1 << count.bit_length())[1 : count + 1]
    tried = np.where(positive, start + spread * (2.0 * cube - 1.0), np.minimum(start, high))
    return list(np.clip(tried, low + 1e-12, high))


def _starts(
    data: LocalResponse,
    model: SampledModel,
    modal: ModalFit,
    start: Floats,
    low: Floats,
    high: Floats,
    period: float,
) -> list[Floats]:
    """Starts about the file's numbers, refined on the logarithm of the response, best first."""
    from scipy.optimize import least_squares

    peaks = modal.rates[:, None] * period * np.array(ABOUT)
    theta = np.sort(np.append(np.geomspace(data.theta.min(), 0.99 * data.theta.max(), POINTS), peaks.ravel()))
    theta = theta[theta < 0.999 * np.pi]
    wanted, rates = modal.response(theta), modal.clear_rates

    def off(x: Floats) -> Floats:
        P = model.response(x, theta)
        if not np.isfinite(P).all() or np.any(P == 0.0):
            return np.full(2 * len(theta) + len(rates), LOST_START)
        ratio = np.log(wanted / P)
        own = _rates(model, x)[: len(rates)]
        apart = np.zeros(len(rates))
        apart[: len(own)] = HEAVY * np.log(own / rates[: len(own)])
        return np.concatenate([ratio.real, ratio.imag, apart])

    tried = [np.clip(start, low + 1e-12, high), *_spread_starts(model, start, SPREAD, TRIED, low, high)]
    costs = np.array([np.sum(off(x) ** 2) for x in tried])
    refined = list[tuple[float, Floats]]()
    for i in np.argsort(costs)[:REFINED]:
        solved = least_squares(off, tried[i], bounds=(low, high), loss="soft_l1", max_nfev=40)
        refined.append((float(solved.cost), np.asarray(solved.x)))
    return [x for _, x in sorted(refined, key=lambda one: one[0])]
