"""Estimates of modes, and of numbers of a device file, from what was fitted."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from math import isfinite
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device import address
from zwidth.device.device import Device
from zwidth.identify.identification import Estimate
from zwidth.identify.modes.modal_fit import ModalFit
from zwidth.identify.modes.model import DELAYS, LAG, SampledModel
from zwidth.identify.modes.physical_fit import PhysicalFit
from zwidth.identify.profile_likelihood import Fit

TOLD: Final = 100.0  # ratio of an interval's ends beyond which the data do not tell a number
LARGEST: Final = 700.0  # of which the exponential is a number
NORMAL: Final = 1.959963984540054


def modal_estimates(fit: ModalFit, profiled: Fit, spread: Floats, lossy: bool, turns: bool) -> list[Estimate]:
    """Frequency, damping ratio or loss factor, and residue of each mode."""
    found = list[Estimate]()
    before = len(profiled.values) - 2 * fit.count
    order = np.argsort(fit.rates)
    unit = "1/(kg m^2)" if turns else "1/kg"
    residues = fit.residues
    if fit.base != "grounded":
        half = NORMAL * spread[0]
        found.append(
            Estimate("residue of the free motion", residues[0], residues[0] - half, residues[0] + half, unit)
        )
    shift = 0 if fit.base == "grounded" else 1
    for number, i in enumerate(order, 1):
        at = before + 2 * int(i)
        vectors = [np.minimum(v, LARGEST) for v in (profiled.values, profiled.low, profiled.high)]
        f, f_low, f_high = (np.exp(v[at]) / (2.0 * np.pi) for v in vectors)
        ratio, low, high = (np.exp(v[at + 1]) for v in vectors)
        found.append(Estimate(f"natural frequency of mode {number}", float(f), float(f_low), float(f_high), "Hz"))
        name, factor = (
            (f"loss factor of mode {number}", 2.0) if lossy else (f"damping ratio of mode {number}", 1.0)
        )
        found.append(Estimate(name, factor * float(ratio), factor * float(low), factor * float(high), ""))
        r, half = float(residues[shift + i]), NORMAL * float(spread[shift + i])
        found.append(Estimate(f"residue of mode {number}", r, r - half, r + half, unit))
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
            remarks.append(_not_told(one.name, low, high, one.unit, model.hand))
            continue
        # no number of the file by itself: it makes several, or a part of one
        composed = timing or len(one.entries) != 1 or len(paths[one.entries[0][0]]) > 1
        within = "" if timing or not composed else _matrices(path for path, _, _ in one.entries)
        if composed:
            estimates.append(Estimate(one.name, value, low, high, one.unit, within=within))
        if not one.entries:
            remarks.append(f"{one.name}: the file has no such number; write {value:.5g} {one.unit} there by hand")
        for path, _, _ in one.entries:
            if path in seen or not all(told[j] for j, _, _ in paths[path]):
                continue
            seen.add(path)
            name = "delay" if timing else f"{one.name}, in {path.partition('.')[2]}" if composed else one.name
            unit = ("samples" if path == DELAYS[0] else "s") if timing else one.unit
            entry = _entry(device, model, found, path, paths[path], timing)
            estimates.append(Estimate(name, *entry, unit, path, within))
    remarks += _sum_of_delays(device, model, told)
    return estimates, remarks


def _matrices(paths: Iterable[str]) -> str:
    """The keys of the matrices whose entries these are: plant.damping_Ns_per_m of plant.damping_Ns_per_m.0.1."""
    return ", ".join(dict.fromkeys(re.sub(r"(\.\d+)+$", "", path) for path in paths))


def _is_told(low: float, high: float, positive: bool) -> bool:
    if not positive:
        return isfinite(high)
    return low > 0.0 and isfinite(high) and high / low < TOLD


def _not_told(name: str, low: float, high: float, unit: str, hand: bool) -> str:
    bound = f"above {low:.3g} {unit}" if low > 0.0 else ""
    bound = " and ".join(filter(None, (bound, f"below {high:.3g} {unit}" if isfinite(high) else "")))
    why = "the device hides it" if hand else "the data do not tell it"
    return f"{name}: {why}" + (f", only that it is {bound}" if bound else "")


def _entry(
    device: Device,
    model: SampledModel,
    found: PhysicalFit,
    path: str,
    parts: Sequence[tuple[int, float, float]],
    timing: bool,
) -> tuple[float, float, float]:
    """Value and interval of a number of the file, of all that it sums."""
    if timing or len(parts) == 1:
        k, factor, offset = parts[0]
        base = offset
        if not timing:
            base = _rest(device, model, path, parts)
        low, value, high = (factor * float(v[k]) + base for v in (found.low, found.values, found.high))
        if timing:
            return max(value, 0.0), max(low, 0.0), high
        return value, min(low, high), max(low, high)
    value = _rest(device, model, path, parts)
    value += float(np.sum([factor * found.values[k] for k, factor, _ in parts]))
    slopes = np.zeros(len(model.quantities))
    for k, factor, _ in parts:
        slopes[k] = factor * (found.values[k] if model.quantities[k].positive else 1.0)
    half = NORMAL * float(np.sqrt(np.maximum(slopes @ found.fit.covariance @ slopes, 0.0)))
    return value, value - half, value + half


def _rest(device: Device, model: SampledModel, path: str, parts: Sequence[tuple[int, float, float]]) -> float:
    """What a number of the file holds beside what was identified of it."""
    given = address.get(device.document, path)
    own = float(given) if isinstance(given, int | float) else 0.0
    rest = own - sum(factor * model.quantities[k].given for k, factor, _ in parts)
    return rest if abs(rest) > 1e-9 * abs(own) else 0.0


def _sum_of_delays(device: Device, model: SampledModel, told: Sequence[bool]) -> list[str]:
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
