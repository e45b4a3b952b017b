"""From raw sweeps of a device to its response, as a [response] reads it, with the chart that follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.measured.chart import MeasuredChart, measured_chart
from zwidth.device.device import Device
from zwidth.device.faults import plural
from zwidth.identify.columns import Columns
from zwidth.identify.identification import Check, Estimate, Identification, refused
from zwidth.identify.record import Record
from zwidth.identify.sampling import check_sampling
from zwidth.identify.strokes import resolution_of
from zwidth.loop.controller import Controller
from zwidth.model.response import LEAST_COHERENCE, MeasuredPath, Response, ResponseError, mean_path
from zwidth.model.sweep_response import sweep_response
from zwidth.progress import Progress

Floats = NDArray[np.float64]

FORCES: Final = ("force_command_N", "force_N")
COLUMNS: Final = Columns(("time_s", FORCES, "position_m"))

KIND: Final = "response"
FIT_SHARE: Final = 2.0 / 3.0  # of each record, its beginning; the rest is predicted
FEWEST_COUNTS: Final = 10.0  # of the motion
LIMITED: Final = 0.05  # share of the samples at the largest and the smallest force, from which on it was clipped
FEW_LEVELS: Final = 8  # of a force that steps between levels on purpose
FEWEST_USABLE: Final = 0.2  # share of the frequencies


def identify_response(
    device: Device,
    records: Sequence[Record],
    *,
    integrators: int | None = None,
    segment: int | None = None,
    progress: Progress | None = None,
) -> Identification:
    """The response of a device from raw sweeps: force command sample to encoder sample, with coherence.

    records      every sample of the loop; each is a sweep of its own, and several are repetitions
    integrators  poles at z = 1: 0, 1 or 2; None: read off the response
    segment      samples whose transform resolves what must be told apart, see `sweep_response`; None: by itself
    Returns      `curves` are the columns of a file that a [response] reads; the number is the largest stiffness,
                 its interval from what is stable beyond doubt to what may be
    Raises       DeviceError  for records that cannot be read
    """
    period = device.controller.sampling_period
    checks, sweeps = list[Check](), list[tuple[Floats, Floats]]()
    for record in records:
        sampling, check = check_sampling(record, period)
        checks.append(replace(check, what=_named("sampling", record, records)))
        if sampling is None:
            continue
        force, position, whole = _longest(record, sampling.runs)
        checks.append(whole)
        checks += [replace(one, what=_named(one.what, record, records)) for one in _check_sweep(force, position)]
        sweeps.append((force, position))
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    count = min(len(force) for force, _ in sweeps)
    fitted = int(FIT_SHARE * count)
    try:
        responses = [sweep_response(f[:fitted], x[:fitted], period, integrators, segment) for f, x in sweeps]
    except ResponseError as error:
        checks.append(Check("response", False, f"{records[0].label} {error}"))
        return Identification(KIND, device.label, tuple(checks))
    response = _together(responses)
    checks.append(_usable(response))
    if (nothing := refused(KIND, device.label, checks)) is not None:
        return nothing
    chart, why = _chart(response, device.controller)
    checks.append(Check("chart", chart is not None, why))
    if chart is None:
        return Identification(KIND, device.label, tuple(checks), curves=_columns(responses))
    shares = [_share_explained(response, f[fitted:], x[fitted:], period) for f, x in sweeps]
    return Identification(
        KIND,
        device.label,
        tuple(checks),
        (_largest_stiffness(chart),),
        float(np.min(shares)),
        f"the motion in the last third of {'each of the ' if len(sweeps) > 1 else 'the '}"
        f"{plural(len(sweeps), 'sweep') if len(sweeps) > 1 else 'sweep'}, at the frequencies that can be relied "
        "on",
        tuple(_remarks(chart, device, response)),
        _columns(responses),
        {"averages": response.averages, "integrators": chart.integrators, "measurement": response.note},
    )


def _named(what: str, record: Record, records: Sequence[Record]) -> str:
    return what if len(records) == 1 else f"{record.label}: {what}"


def _longest(record: Record, runs: NDArray[np.int64]) -> tuple[Floats, Floats, Check]:
    """Force and position (n,) of the longest stretch without a gap."""
    columns = record.columns()
    name = next(one for one in FORCES if one in record)
    first, behind = max(runs.tolist(), key=lambda run: run[1] - run[0], default=(0, 0))
    kept, rows = behind - first, len(columns["time_s"])
    said = (
        "no sample is missing"
        if kept == rows
        else f"the longest stretch without a gap is used, {kept} of {rows} rows"
    )
    enough = kept >= 0.5 * rows
    reason = said if enough else f"{said}; record without gaps"
    return columns[name][first:behind], columns["position_m"][first:behind], Check("gaps", enough, reason)


def _check_sweep(force: Floats, position: Floats) -> list[Check]:
    """Is something excited, does it move, and is the force free to take its values?"""
    if np.ptp(force) == 0.0:
        return [Check("excitation", False, f"the force is {force[0]:g} N all the time; excite the device")]
    if np.ptp(position) == 0.0:
        return [Check("motion", False, f"the position is {position[0]:g} m all the time; is the encoder read?")]
    checks = [Check("excitation", True, f"the force runs from {np.min(force):.4g} to {np.max(force):.4g} N")]
    step = resolution_of(position).step
    counts = float(np.ptp(position)) / step if step else np.inf
    said = f"the position runs over {np.ptp(position):.4g} m" + (f", {counts:.4g} counts" if step else "")
    moved = counts >= FEWEST_COUNTS
    checks.append(
        Check("motion", moved, said if moved else f"{said}; at least {FEWEST_COUNTS:g} are needed, push more")
    )
    levels = len(np.unique(force[: min(len(force), 100_000)]))
    limits = [float(np.mean(force == end)) for end in (np.max(force), np.min(force))]
    clipped = levels > FEW_LEVELS and max(limits) > LIMITED
    said = f"{100 * max(limits):.2g} % of the samples are at the largest or smallest force"
    reason = f"{said}: clipped? excite less, a command that was not followed is no input" if clipped else said
    return [*checks, Check("saturation", not clipped, reason)]


def _together(responses: Sequence[Response]) -> Response:
    """Repeated sweeps as one response: their mean, each beside it."""
    if len(responses) == 1:
        return responses[0]
    whole = mean_path([MeasuredPath(one.value, one.coherence) for one in responses])
    return replace(responses[0], value=whole.value, coherence=whole.coherence, sweeps=whole.sweeps)


def _usable(response: Response) -> Check:
    """From where to where the response can be relied on."""
    assert response.coherence is not None
    good = response.coherence >= LEAST_COHERENCE
    share = float(np.mean(good))
    if share < FEWEST_USABLE:
        return Check(
            "coherence",
            False,
            f"only {100 * share:.2g} % of the frequencies are coherent: the position hardly answers the force; "
            "are columns "
            "of two records mixed, or is the force too small?",
        )
    f = response.frequency[good]
    text = f"coherent from {f[0]:.4g} to {f[-1]:.4g} Hz, at {100 * share:.3g} % of the frequencies"
    return Check("coherence", True, text)


def _chart(response: Response, controller: Controller) -> tuple[MeasuredChart | None, str]:
    """The chart of the response, which holds the hardware's delay and lag already; None and why there is none."""
    computer = replace(controller, delay=0.0, actuator_time_constant=0.0)
    try:
        chart = measured_chart(response, computer)
    except ResponseError as error:
        return None, str(error)
    return chart, f"poles at z = 1: {chart.integrators}"


def _largest_stiffness(chart: MeasuredChart) -> Estimate:
    high = chart.band.stiffness_high if chart.band is not None else chart.stiffness_max_nominal
    return Estimate("largest stiffness", chart.stiffness_max_nominal, chart.stiffness_max, high, "N/m")


def _remarks(chart: MeasuredChart, device: Device, response: Response) -> list[str]:
    said = (
        [f"{response.note}; the interval holds what is stable beyond doubt, and what may be"]
        if response.note
        else []
    )
    if device.response is None:
        own = device.at().chart(decay=False).stiffness_max
        high = chart.band.stiffness_high if chart.band is not None else chart.stiffness_max
        within = "within" if chart.stiffness_max <= own <= high else "outside"
        said.append(f"the file's own model renders {own:.5g} N/m at its reference, {within} this interval")
    return said


def _share_explained(response: Response, force: Floats, position: Floats, period: float) -> float:
    """Share of the unseen motion's power that the response predicts from the force, where it can be relied on.

    The position is differenced twice, and both are weighted by a Hann window, since a device that drifts leaks.
    """
    m = 2
    moved = np.diff(position, n=m)
    window = np.hanning(len(moved))
    U, Y = np.fft.rfft(force[: len(moved)] * window), np.fft.rfft(moved * window)
    f = np.fft.rfftfreq(len(moved), period)
    assert response.coherence is not None
    good = response.coherence >= LEAST_COHERENCE
    known, value = response.frequency[good], response.value[good]
    shifted = value * (np.exp(2j * np.pi * known * period) - 1.0) ** m
    inside = (f >= known[0]) & (f <= known[-1]) & (np.interp(f, response.frequency, good) > 0.99)
    predicted = np.interp(f, known, shifted.real) + 1j * np.interp(f, known, shifted.imag)
    missed = np.sum(np.abs(Y - predicted * U)[inside] ** 2)
    return float(1.0 - missed / np.sum(np.abs(Y[inside]) ** 2))


def _columns(responses: Sequence[Response]) -> dict[str, Any]:
    """The columns of a file that a [response] reads."""
    parts = [(one.frequency, one.value, one.coherence) for one in responses]
    columns = {
        "frequency_Hz": np.concatenate([f for f, _, _ in parts]),
        "real_m_per_N": np.concatenate([v.real for _, v, _ in parts]),
        "imag_m_per_N": np.concatenate([v.imag for _, v, _ in parts]),
        "coherence": np.concatenate([np.ones_like(f) if c is None else c for f, _, c in parts]),
    }
    if len(parts) > 1:
        columns["sweep"] = np.repeat(np.arange(1.0, len(parts) + 1), [len(f) for f, _, _ in parts])
    return columns
