"""Masses, springs, dampers and delays of a device, fitted to a response through the device's own sampled loop; and
the estimates of modes, and of numbers of the device file, from what was fitted.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from math import isfinite
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device import address
from zwidth.device.device import Device
from zwidth.identify.identification import Estimate
from zwidth.identify.modes.local_response import RecordResponse
from zwidth.identify.modes.modal_fit import FOLDED, ModalFit
from zwidth.identify.modes.model import DELAYS, LAG, SampledModel
from zwidth.identify.profile_likelihood import Fit, fit_least_squares
from zwidth.model.modes import undamped_modes
from zwidth.unit_text import unit_text

HOPELESS: Final = 100.0  # times the number of residuals: where no modes explain them, no start does
SPREAD: Final = np.log(6.0)  # about the file's numbers, within which a start is looked for
TRIED, REFINED = 96, 3  # starts that are compared, and refined
POINTS: Final = 30  # frequencies by which they are compared
GOOD, ENOUGH = 1.05, 25.0  # times the sum of squares of the modes alone, or so much more: a fit has arrived
CLOSE: Final = 10.0  # more than that sum, from which on other starts are tried all the same
FAR: Final = np.log(1e4)  # beyond which no number is looked for
ABOUT: Final = (0.8, 0.9, 0.97, 1.0, 1.03, 1.1, 1.25)  # of a mode's frequency, where starts are compared, too
UNSURE: Final = (0.8, 1.2)  # of half the sampling rate: where the response tells little of a mode
AROUND, AROUND_TRIED = (
    3.0,
    24,
)  # factor about the file's numbers, and starts within it, where one mode tells little
DAMPED: Final = (0.1, 1.0, 10.0)  # times the damping of a mode about half the sampling rate
RIVAL: Final = 8.0  # by which a sum of squares may exceed the least one, and still set an interval's end
RIVALS, ELSEWHERE = 3, 0.3  # such minima at most, and how far from each other in logarithms
HEAVY: Final = 10.0  # weight of a mode's frequency beside that of a point of the response
LOST_START: Final = 50.0  # the same of the logarithms by which starts are compared
LOST: Final = 1e6  # each residual where there is no such device
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


def fit_model(data: RecordResponse, model: SampledModel, modal: ModalFit, period: float) -> PhysicalFit:
    """The numbers that explain the response best, each with its interval by the profile likelihood.

    From the file's numbers first, and from others where these may not lead there (`_Search`). Where a response
    says little of a mode, several minima are hardly different, and all of them set the ends of intervals.

    modal  modes that explain the same response by themselves;   period  of the loop [s]
    """
    low, high = _search_bounds(model, period)
    # 1e-300: the logarithm of 0, which is clipped to the bounds
    start = np.clip(model.vector(np.maximum(model.start, 1e-300)), low, high)
    # the delay, the one number in s that may be 0, begins at that of the modes
    timed = [i for i, one in enumerate(model.quantities) if not one.positive and one.unit == "s"]
    if timed and modal.count:
        start[timed[0]] = np.clip(modal.delay, 0.0, high[timed[0]])
    search = _Search(data, model, modal, period, start, low, high)
    best, *rivals = _lowest_minima(search.minima())
    fit = fit_least_squares(search.residuals, best, lower=low, upper=high, rivals=rivals)
    return PhysicalFit(
        model.values(fit.values),
        model.values(fit.low),
        model.values(fit.high),
        fit,
        fit.sum_of_squares,
        len(data.target),
    )


def _search_bounds(model: SampledModel, period: float) -> tuple[Floats, Floats]:
    """Bounds (p,) of what the optimiser varies; period [s]."""
    low, high = np.empty((2, len(model.quantities)))
    for i, one in enumerate(model.quantities):
        if one.positive:
            low[i], high[i] = np.log(one.start) - FAR, np.log(one.start) + FAR
        else:
            # a delay of up to 20 samples, or four times the file's
            low[i], high[i] = 0.0, max(20.0 * period, 4.0 * one.start) if one.unit == "s" else np.inf
    return low, high


def _lowest_minima(minima: Sequence[tuple[Floats, float]]) -> list[Floats]:
    """Places (p,) of the lowest minimum, and of some others elsewhere that are hardly higher.

    minima  place and sum of squares of each
    """
    found = list[Floats]()
    least = min(height for _, height in minima)
    for place, height in sorted(minima, key=lambda one: one[1]):
        apart = all(np.max(np.abs(place - other)) > ELSEWHERE for other in found)
        if apart and height < least + RIVAL and len(found) <= RIVALS:
            found.append(place)
    return found


@dataclass(frozen=True)
class _Search:
    """A search for the parameters of `model` within low and high (p,), from a start (p,).

    modal   modes that explain the same response by themselves
    period  of the loop [s]
    """

    data: RecordResponse
    model: SampledModel
    modal: ModalFit
    period: float
    start: Floats
    low: Floats
    high: Floats

    def residuals(self, x: Floats) -> Floats:
        """What parameters leave of the response (r,)."""
        P = self.model.response(x, self.data.theta)
        return self.data.residuals(P) if np.isfinite(P).all() else np.full(len(self.data.target), LOST)

    def minima(self) -> list[tuple[Floats, float]]:
        """Where searches end, each with its sum of squares.

        Where the one from `start` does not come to what the modes alone explain: from many others within a factor
        of six, chosen by the logarithm of the response, in which a wrong frequency still pulls. Where a mode lies
        about half the sampling rate: from its mirror image. Where the response hides a mode, or the modes alone
        explain a little more: from many within a factor of three.
        """
        modal = self.modal
        good = max(GOOD * modal.chi_squared, modal.chi_squared + ENOUGH)
        found = [self._descended(self.start)]
        if found[0][1] > good and modal.chi_squared < HOPELESS * len(self.data.target):
            for x in self._starts_by_logarithm():
                found.append(self._descended(x))
                if found[-1][1] <= good:
                    break
        best, least = min(found, key=lambda one: one[1])
        others = self._mirrored_starts(best)
        shares = self._mode_rates(best) * self.period / np.pi
        unsure = bool(np.any((shares > UNSURE[0]) & (shares < UNSURE[1])))
        hidden = int(np.sum(shares < FOLDED[1])) > modal.count
        if unsure or hidden or modal.chi_squared + CLOSE < least <= good:
            others += self._starts_about(np.log(AROUND), AROUND_TRIED)
        return found + [self._descended(x) for x in others]

    def _descended(self, x: Floats) -> tuple[Floats, float]:
        """Parameters near x with a small sum of squares, and that sum."""
        from scipy.optimize import least_squares

        bounds = self.low, self.high
        solved = least_squares(self.residuals, x, bounds=bounds, x_scale="jac", ftol=1e-6, xtol=1e-7, max_nfev=40)
        return np.asarray(solved.x), 2.0 * float(solved.cost)

    def _mode_rates(self, x: Floats) -> Floats:
        """Natural frequencies of the flexible modes [rad/s], ascending; () where there is no such device."""
        try:
            plant = self.model.loop_of(self.model.values(x)).plant
        except ValueError:
            return np.zeros(0)
        squared = undamped_modes(plant.mass, plant.stiffness)[0]
        return np.sqrt(squared[squared > 0.0])

    def _mirrored_starts(self, best: Floats) -> list[Floats]:
        """Starts with a mode on the other side of half the sampling rate, and with other damping: sampling
        makes all of them look much alike. Springs and dampers are scaled."""
        springs = np.array([one.unit in SPRINGS for one in self.model.quantities])
        dampers = np.array([one.unit in DAMPERS for one in self.model.quantities])
        starts = list[Floats]()
        for rate in self._mode_rates(best):
            if FOLDED[0] < rate * self.period / np.pi < FOLDED[1]:
                mirrored = 2.0 * np.pi / self.period - rate
                # w goes with the root of a spring, and a ratio of damping stays where a damper goes with w
                for factor, damped in product(np.log([1.0, mirrored / rate]), np.log(DAMPED)):
                    x = best + 2.0 * factor * springs + (factor + damped) * dampers
                    starts.append(np.clip(x, self.low, self.high))
        return starts

    def _starts_about(self, spread: float, count: int) -> list[Floats]:
        """So many starts spread evenly (Sobol) within `spread` about the start, in logarithms, with its delay."""
        from scipy.stats import qmc

        positive = np.array([one.positive for one in self.model.quantities])
        cube = qmc.Sobol(len(self.start), scramble=False).random(1 << count.bit_length())[1 : count + 1]
        tried = np.where(positive, self.start + spread * (2.0 * cube - 1.0), np.minimum(self.start, self.high))
        return list(np.clip(tried, self.low + 1e-12, self.high))

    def _starts_by_logarithm(self) -> list[Floats]:
        """Starts about the file's numbers, refined on the logarithm of the response, best first."""
        from scipy.optimize import least_squares

        peaks = self.modal.rates[:, None] * self.period * np.array(ABOUT)
        lowest, highest = self.data.theta.min(), self.data.theta.max()
        theta = np.sort(np.append(np.geomspace(lowest, 0.99 * highest, POINTS), peaks.ravel()))
        theta = theta[theta < 0.999 * np.pi]  # peaks above half the sampling rate are left out
        wanted, rates = self.modal.response(theta), self.modal.clear_rates

        def remainder(x: Floats) -> Floats:
            """What parameters leave of the response's logarithm, and of those of the modes' frequencies."""
            P = self.model.response(x, theta)
            if not np.isfinite(P).all() or np.any(P == 0.0):
                return np.full(2 * len(theta) + len(rates), LOST_START)
            ratio = np.log(wanted / P)
            own_rates = self._mode_rates(x)[: len(rates)]
            apart = np.zeros(len(rates))
            apart[: len(own_rates)] = HEAVY * np.log(own_rates / rates[: len(own_rates)])
            return np.concatenate([ratio.real, ratio.imag, apart])

        tried = [np.clip(self.start, self.low + 1e-12, self.high), *self._starts_about(SPREAD, TRIED)]
        costs = np.array([np.sum(remainder(x) ** 2) for x in tried])
        refined = list[tuple[float, Floats]]()
        for i in np.argsort(costs)[:REFINED]:
            solved = least_squares(remainder, tried[i], bounds=(self.low, self.high), loss="soft_l1", max_nfev=40)
            refined.append((float(solved.cost), np.asarray(solved.x)))
        return [x for _, x in sorted(refined, key=lambda one: one[0])]


TOLD: Final = 100.0  # ratio of an interval's ends beyond which the data do not tell a number
LARGEST: Final = 700.0  # of which the exponential is a number
NORMAL: Final = 1.959963984540054  # half width of the normal distribution's 95 % interval [standard deviations]


def modal_estimates(fit: ModalFit, profiled: Fit, spread: Floats, lossy: bool, turns: bool) -> list[Estimate]:
    """Frequency, damping ratio or loss factor, and residue of each mode.

    profiled  intervals of `fit.vector`;   spread  standard deviations of `fit.residues`
    lossy     loss factors, not damping ratios;   turns  the motion is a turn, under a torque
    """
    found = list[Estimate]()
    before = len(profiled.values) - 2 * fit.count
    order = np.argsort(fit.rates)
    unit = "1/(kg m^2)" if turns else "1/kg"
    residues = fit.residues
    if fit.base != "grounded":
        half_width = NORMAL * spread[0]
        found.append(
            Estimate(
                "residue of the free motion", residues[0], residues[0] - half_width, residues[0] + half_width, unit
            )
        )
    first = 0 if fit.base == "grounded" else 1  # residue of the first mode
    for number, i in enumerate(order, 1):
        entry = before + 2 * int(i)  # ln w, and ln zeta behind it
        vectors = [np.minimum(v, LARGEST) for v in (profiled.values, profiled.low, profiled.high)]
        f, f_low, f_high = (np.exp(v[entry]) / (2.0 * np.pi) for v in vectors)
        ratio, low, high = (np.exp(v[entry + 1]) for v in vectors)
        found.append(Estimate(f"natural frequency of mode {number}", float(f), float(f_low), float(f_high), "Hz"))
        name, factor = (
            (f"loss factor of mode {number}", 2.0) if lossy else (f"damping ratio of mode {number}", 1.0)
        )
        found.append(Estimate(name, factor * float(ratio), factor * float(low), factor * float(high), ""))
        r, half_width = float(residues[first + i]), NORMAL * float(spread[first + i])
        found.append(Estimate(f"residue of mode {number}", r, r - half_width, r + half_width, unit))
    return found


def device_estimates(
    device: Device, model: SampledModel, found: PhysicalFit, period: float
) -> tuple[list[Estimate], list[str]]:
    """The numbers of the device file, and remarks on those that the data do not tell.

    A number that its interval leaves open by a factor of a hundred has no path, so that nobody writes it. The
    numbers of a matrix that one spring makes are given each: they belong together.
    """
    remarks, estimates = list[str](), list[Estimate]()
    told = [
        _is_told(low, high, one.positive)
        for low, high, one in zip(found.low, found.high, model.quantities, strict=True)
    ]
    # path -> index of each quantity that its number sums, factor, offset
    paths = dict[str, list[tuple[int, float, float]]]()
    for k, one in enumerate(model.quantities):
        for path, factor, offset in one.entries:
            paths.setdefault(path, []).append((k, factor, offset))
    seen = set[str]()
    for k, one in enumerate(model.quantities):
        value, low, high = (float(v[k]) for v in (found.values, found.low, found.high))
        timing = bool(one.entries) and one.entries[0][0] in DELAYS
        if not told[k]:
            estimates.append(Estimate(one.name, value, low, high, one.unit))
            remarks.append(_untold_remark(one.name, low, high, unit_text(one.unit), model.hand))
            continue
        # no number of the file by itself: it makes several, or a part of one
        composed = timing or len(one.entries) != 1 or len(paths[one.entries[0][0]]) > 1
        within = "" if timing or not composed else _matrix_keys(path for path, _, _ in one.entries)
        if composed:
            estimates.append(Estimate(one.name, value, low, high, one.unit, within=within))
        if not one.entries:
            remarks.append(
                f"{one.name}: the file has no such number; write {value:.5g} {unit_text(one.unit)} there by hand"
            )
        for path, _, _ in one.entries:
            if path in seen or not all(told[j] for j, _, _ in paths[path]):
                continue
            seen.add(path)
            name = "delay" if timing else f"{one.name}, in {path.partition('.')[2]}" if composed else one.name
            unit = ("samples" if path == DELAYS[0] else "s") if timing else one.unit
            entry = _file_number(device, model, found, path, paths[path], timing)
            estimates.append(Estimate(name, *entry, unit, path, within))
    remarks += _delay_remarks(model, told)
    return estimates, remarks


def _matrix_keys(paths: Iterable[str]) -> str:
    """The keys of the matrices whose entries these are: plant.damping_Ns_per_m of plant.damping_Ns_per_m.0.1."""
    return ", ".join(dict.fromkeys(re.sub(r"(\.\d+)+$", "", path) for path in paths))


def _is_told(low: float, high: float, positive: bool) -> bool:
    """Whether an interval tells a number: it has an end, and of a positive one the ends are within `TOLD`."""
    if not positive:
        return isfinite(high)
    return low > 0.0 and isfinite(high) and high / low < TOLD


def _untold_remark(name: str, low: float, high: float, unit: str, hand: bool) -> str:
    """Remark that the data do not tell a number, of a hand that the device hides it; with the bounds they set."""
    bound = f"above {low:.3g} {unit}" if low > 0.0 else ""
    bound = " and ".join(filter(None, (bound, f"below {high:.3g} {unit}" if isfinite(high) else "")))
    why = "the device hides it" if hand else "the data do not tell it"
    return f"{name}: {why}" + (f", only that it is {bound}" if bound else "")


def _file_number(
    device: Device,
    model: SampledModel,
    found: PhysicalFit,
    path: str,
    parts: Sequence[tuple[int, float, float]],
    timing: bool,
) -> tuple[float, float, float]:
    """Value and ends of the interval of the file's number at a path.

    parts   index of each quantity that the number sums, factor and offset;   timing  it is the delay
    """
    if timing or len(parts) == 1:
        k, factor, offset = parts[0]
        base = offset  # of a delay what is taken off its sum; of another number what is no quantity
        if not timing:
            base = _fixed_part(device, model, path, parts)
        low, value, high = (factor * float(v[k]) + base for v in (found.low, found.values, found.high))
        if timing:
            return max(value, 0.0), max(low, 0.0), high
        return value, min(low, high), max(low, high)
    value = _fixed_part(device, model, path, parts)
    value += float(np.sum([factor * found.values[k] for k, factor, _ in parts]))
    # of a sum of several to first order, by the covariance of what the optimiser varies
    slopes = np.zeros(len(model.quantities))
    for k, factor, _ in parts:
        slopes[k] = factor * (found.values[k] if model.quantities[k].positive else 1.0)
    half_width = NORMAL * float(np.sqrt(np.maximum(slopes @ found.fit.covariance @ slopes, 0.0)))
    return value, value - half_width, value + half_width


def _fixed_part(
    device: Device, model: SampledModel, path: str, parts: Sequence[tuple[int, float, float]]
) -> float:
    """What the file's number at a path holds beside the identified quantities, `parts` as in `_file_number`."""
    given = address.get(device.document, path)
    in_file = float(given) if isinstance(given, int | float) else 0.0
    fixed = in_file - sum(factor * model.quantities[k].given for k, factor, _ in parts)
    return fixed if abs(fixed) > 1e-9 * abs(in_file) else 0.0


def _delay_remarks(model: SampledModel, told: Sequence[bool]) -> list[str]:
    """Remark on delays that appear as their sum alone; [] where none was identified. told (p,): by the data."""
    names = [one.entries[0][0] if one.entries else "" for one in model.quantities]
    if not any(name in DELAYS for name in names):
        return []
    if LAG in names:
        if told[names.index(LAG)]:
            return ["delay and time constant of the actuator are told apart by the shape of the response"]
        return ["delay and time constant of the actuator appear as their sum alone: only it is given"]
    return [
        "delay, current loop and filter appear as their sum alone; loop.delay is that sum less the time "
        "constant of the actuator and the filter's lag as the file has them"
    ]
