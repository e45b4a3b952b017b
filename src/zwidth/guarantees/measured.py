"""Guarantees of a measured device: the disks of all passive operators from its measured port.

At each measured frequency the sampled response with any passive operator fills the disk of `disks`,

    centre  P - sum_k q_k,    radius  sum_k |q_k|,    q = G_eh W G_ha jw/(2 Re(jw G_hh))

q_0 is made of the data, the q_k of the frequencies that look alike of the fitted modes. The wall is passive where
it keeps clear of every disk (see `gauge`): between measured frequencies they are interpolated, and made larger by
what that may miss (see `between_frequencies`). The power that the handle takes in, Re(jw G_hh), is small against
jw G_hh itself: where the measurement's error hides it, nothing is promised.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.polynomial import chebyshev

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.chart.measured.chart import MeasuredChart, measured_chart
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.guarantees.between_frequencies import disks_between
from zwidth.guarantees.conics import conics_of_disks
from zwidth.guarantees.disks import Disks
from zwidth.guarantees.gauge import Gauge
from zwidth.guarantees.guarantees import COLGATE, EXACT, NO_STABLE, Guarantee, Guarantees
from zwidth.guarantees.passive import passive_region_of
from zwidth.guarantees.region import Region, empty_region
from zwidth.guarantees.stable_alone import NOT_MEASURED
from zwidth.loop.factor_response import factor_response
from zwidth.loop.loop_table import force_filter
from zwidth.loop.measured.measured_port import MeasuredPort
from zwidth.loop.operating_point import OperatingPoint

FAR: Final = 1000  # aliases to either side
NEAR, NODES = 8, 16  # those summed at every angle; and angles at which the others are summed, which vary little
SURE: Final = 1.96  # standard deviations of the dissipation that are taken off
# Sizes of 1/H that are tried at most, until the last is within this factor that of the stiffest wall found: all
# are on the safe side.
SCALES, ALIKE = 4, 1.1
ONLY_MODEL: Final = (
    "this takes the chart of every spring, which needs a model; attach springs to the response as an [operator]"
)


def measured_disks(port: MeasuredPort, passed: Complexes) -> tuple[Disks, Flags]:
    """The disks of a measured port at its angles (n,), and where the error hides the power taken in at the handle.

    passed  what the computer adds to P there (n,): force filter and software's delay
    """
    theta = port.theta
    jw = 1j * theta / port.period
    base = port.baseband
    error = port.deviations[port.origin["hh"]] * np.abs(base["hh"] / _measured_samples(port, "hh"))
    # power taken in at the handle, and what is left of it when the error is taken off
    taken = np.real(jw * base["hh"])
    least = taken - SURE * np.abs(jw) * error
    hidden = ~(least > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        q = np.where(hidden, np.inf, base["sh"] * base["ha"] * jw / (2.0 * least))
        others, reach = _alias_sums(port)
        # c: what the aliases add to the centre p - q of the frequency's own disk
        p, c = base["sa"], port.sampled["sa"] - base["sa"] - others
        size = np.abs(passed)
        centre, radius = passed * (p - q + c), size * (np.abs(q) + reach)
        # |p - q + c|^2 - (|q| + r)^2 without the cancellation of |q|^2
        power = np.abs(p) ** 2 - 2.0 * np.real(p * q.conj()) + 2.0 * np.real((p - q) * c.conj())
        power = size**2 * (power - 2.0 * np.abs(q) * reach + np.abs(c) ** 2 - reach**2)
    return Disks(theta, centre, radius, power), hidden


def _measured_samples(port: MeasuredPort, name: str) -> Complexes:
    """Samples of a path's measured response: those of the path itself, or of the path that it was derived from."""
    source = port.origin[name]
    return port.sampled[source] if source in port.sampled else port.baseband[source]


def _alias_sums(port: MeasuredPort) -> tuple[Complexes, Floats]:
    """Sums (n,) of q and |q| over the frequencies that look alike, of the fitted modes; if they take in no power
    at one of those, the second is inf at all angles, and the first means nothing.

    All have the factor W theta of hold and delay. What lies beyond the modes is, without it, smooth in the angle.
    """
    theta = np.append(port.theta, 0.5 * np.pi * (1.0 + chebyshev.chebpts1(NODES)))
    total, size = np.zeros(len(theta), dtype=complex), np.zeros(len(theta))
    for k in range(1, FAR + 1):
        if k == NEAR + 1:  # from here on at the nodes alone
            near, theta = (total[:-NODES], size[:-NODES]), theta[-NODES:]
            total, size = np.zeros(NODES, dtype=complex), np.zeros(NODES)
        for turn in (2.0 * np.pi * k, -2.0 * np.pi * k):
            alias = theta + turn
            jw = 1j * alias / port.period
            taken = np.real(jw * port.continued("hh", alias))
            pushed = port.continued("sh", alias) * port.continued("ha", alias) * port.model.hold(alias) * jw
            q = np.where(taken > 0.0, pushed / (2.0 * np.where(taken > 0.0, taken, 1.0)), np.inf)
            total, size = total + q, size + np.abs(q)
            if k == FAR:
                size = size + np.abs(q) * FAR  # terms fall like 1/k^2: those beyond sum to FAR times the last
    if not np.all(np.isfinite(size)):
        return near[0], np.full(len(port.theta), np.inf)
    factor = port.model.hold(theta) * theta
    basis = chebyshev.chebvander(chebyshev.chebpts1(NODES), NODES - 1)
    fitted = np.linalg.solve(basis, np.column_stack([total / factor, size / np.abs(factor)]))
    far = chebyshev.chebvander(2.0 * port.theta / np.pi - 1.0, NODES - 1) @ fitted
    factor = port.model.hold(port.theta) * port.theta
    return near[0] + far[:, 0] * factor, near[1] + far[:, 1].real * np.abs(factor)


def _softest_spring(disks: Disks) -> float:
    """1/K [m/N] of the softest spring that fails at a measured angle, the largest mu (see `gauge`) of the wall
    K = 1, B = 0; where none fails, the size of the disks."""
    across = disks.radius**2 - disks.centre.imag**2
    mu = np.where(across >= 0.0, np.sqrt(np.maximum(across, 0.0)) - disks.centre.real, 0.0)
    largest = float(np.max(mu))
    return largest if largest > 0.0 else float(np.median(np.abs(disks.centre) + disks.radius))


def measured_passive_region(port: MeasuredPort, loop: MeasuredLoop) -> Region:
    """The walls that keep clear of every passive operator at a measured handle, which `loop` charts; empty, with
    the reason, where the measurement does not tell them."""
    # below half the sampling rate, and with a finite error in every path
    inner = port.theta < np.pi * (1.0 - 1e-9)
    for source in set(port.origin.values()):
        inner &= np.isfinite(port.deviations[source])
    force = force_filter(loop.controller)
    z, d = np.exp(1j * port.theta), np.expm1(1j * port.theta)
    # software's delay, whole samples but for rounding
    passed = factor_response(force.numerator, force.denominator, d) * z ** -round(loop.controller.delay)
    disks, hidden = measured_disks(port, np.asarray(passed))
    frequency = port.theta / (2.0 * np.pi * port.period)
    lost = inner & hidden
    if np.any(lost):
        return empty_region(_hidden_reason(lost, inner, frequency))
    if not np.all(np.isfinite(disks.radius[inner])):
        return empty_region(
            "this is not known: the fitted modes, which continue the device beyond half the sampling rate, do not "
            "all take in power there"
        )
    kept = Disks(*(getattr(disks, name)[inner] for name in ("angles", "centre", "radius", "power")))
    regions = _passive_regions(kept, port, loop)
    if regions is None:
        return empty_region("this is not known: the handle is known at too few frequencies")
    region = max(regions, key=lambda one: float(np.nan_to_num(one.stiffness_max)))
    warning = (
        f"from {np.count_nonzero(inner)} measured frequencies, interpolated, with twice the error of that taken "
        f"off; below {frequency[inner][0]:.4g} Hz continued"
    )
    return replace(region, warning=warning)


def _hidden_reason(lost: Flags, inner: Flags, frequency: Floats) -> str:
    """Say at which of the known frequencies the measurement's error hides the power that the handle takes in.

    lost, inner  (k,) of all frequencies (k,) [Hz]: those hidden, at least one, and those known
    """
    at = np.flatnonzero(lost)
    stretch = f"{frequency[at[0]]:.4g} to {frequency[at[-1]]:.4g} Hz"
    return (
        f"this is hidden by the measurement: at {len(at)} of {np.count_nonzero(inner)} frequencies, "
        f"{stretch}, "
        "its error is larger than the power that the handle takes in; measure longer or with more force "
        "there, or state hardware_delay_samples"
    )


def _passive_regions(kept: Disks, port: MeasuredPort, loop: MeasuredLoop) -> list[Region] | None:
    """Find the passive walls [N/m, N s/m] by interpolation at some scales of stiffness, at most SCALES of them.

    kept     disks at the known frequencies
    Returns  one region for each scale; None where the handle is known at too few frequencies
    """
    scale, regions = _softest_spring(kept), list[Region]()
    for _ in range(SCALES):
        between = disks_between(kept, scale)
        if between is None:
            return None
        # a negative spring shows at frequencies below all that were measured: none is promised
        found = Gauge(conics_of_disks(between.disks, loop.w, between.ends), (np.inf, np.inf))
        regions.append(passive_region_of(found, port.period))
        stiffness = regions[-1].stiffness_max
        if not stiffness > 0.0 or 1.0 / ALIKE < stiffness * scale < ALIKE:
            break
        scale = 1.0 / stiffness
    return regions


def measured_guarantees(point: OperatingPoint) -> Guarantees:
    """Every guarantee of a measured device without its operator, with the reason where one is not known."""
    bare = point.without_operator
    chart: MeasuredChart = measured_chart(bare.measured, bare.controller)
    region = measured_passive_region(bare.measured_port, chart.loop).with_warning(NOT_MEASURED.reason)
    peak = chart.stiffness_max
    stable = Region(chart.regions, peak, chart.damping_at_stiffness_max, None if np.isfinite(peak) else NO_STABLE)
    return Guarantees(
        chart.loop,
        (
            Guarantee("passive", "stable whatever passive linear operator holds the handle", region, COLGATE),
            Guarantee(
                "spring-stable",
                "stable whatever spring holds the handle, from none to one that holds it fixed",
                empty_region(ONLY_MODEL),
                "",
            ),
            Guarantee("stable", "stable with the device as measured", stable, EXACT),
        ),
        chart,
        premises=(NOT_MEASURED,),
    )
