"""How the chart moves with the hand's load: charts at pushes of either sign along the rendered direction.

Two questions are asked of each push F. With the posture kept, the wall is where it balances F in this posture,
whatever its stiffness: the chart of every stiffness is about the same place. With the surface and the hand kept,
the handle sinks in by F/K, so that the place depends on the stiffness:

    K = K_max(p),     p = p_0 + u F/K,       p_0 on the surface, u the rendered direction

The largest K that solves it is bracketed downwards from where the handle sinks in too little, and found by Brent's
method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import exp, inf, isnan, log, nan
from typing import Any, Final

import numpy as np
from scipy.optimize import brentq

from zwidth.argument import check_arguments
from zwidth.arrays import Floats
from zwidth.chart.chart import StabilityChart, largest_stiffness, stability_chart
from zwidth.device.device import Device
from zwidth.device.load import device_of_point, device_without_load
from zwidth.errors import (
    ArgumentError,
    ChartError,
    EquilibriumError,
    NoMechanismError,
    PostureError,
    UnresolvedError,
)
from zwidth.loop.loop import SidewaysMotion
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.load_effect import NONE_STABLE, fastest_sideways_motion
from zwidth.model.argument_checks import check_kind
from zwidth.model.effective_mass import screw
from zwidth.model.equilibrium import Equilibrium
from zwidth.model.load import HandForce, Load
from zwidth.progress import Progress
from zwidth.questions import LOAD
from zwidth.result import Result

OK: Final = "ok"
START: Final = (
    0.6  # logarithm of a stiffness over that with the posture kept, from where it is looked for downwards
)
STEP: Final = 0.4  # between two logarithms that are tried
STEPS: Final = 60  # of these, at most, up or down
SETTLED: Final = 1e-10  # share of a stiffness to which it is solved for
TOO_SOFT: Final = "a wall could always be stiffer"
NOT_ALONG_A_DIRECTION: Final = "a fixed surface is looked for along a direction, not about an axis"


@dataclass(frozen=True)
class PushedChart:
    """The chart under one push of the hand.

    push           of the hand along the direction [N]; 0: nothing pushes
    status         "ok", or why there is no largest stiffness
    chart          None where there is none
    equilibrium    None without load, and where there is none
    sideways       the fastest-growing motion along the surface; None where there is none
    hand_neglected       largest stiffness with the change of the hand's force left out [N/m]; nan if there is none
    fixed_surface        largest stiffness with surface and hand fixed [N/m]; nan if there is none
    fixed_surface_status "ok", or why there is none
    """

    push: float
    status: str
    chart: StabilityChart | None = None
    equilibrium: Equilibrium | None = None
    sideways: SidewaysMotion | None = None
    hand_neglected: float = nan
    fixed_surface: float = nan
    fixed_surface_status: str = ""

    @property
    def stiffness_max(self) -> float:
        """Largest stiffness [N/m]; nan if there is none."""
        return nan if self.chart is None else self.chart.stiffness_max

    @property
    def growth_rate(self) -> float:
        """Growth rate of the fastest-growing sideways motion [1/s]; nan if there is none."""
        return nan if self.sideways is None else self.sideways.growth_rate

    @property
    def wall_force(self) -> float:
        """Force of the wall at the equilibrium [N], nan where there is none; 0 where nothing pushes."""
        if self.equilibrium is None:
            return 0.0 if self.chart is not None and not self.push else nan
        return self.equilibrium.wall_force

    @property
    def sideways_force(self) -> Floats:
        """Force of the hand across the direction (3,) [N]; nan where there is no equilibrium."""
        if self.equilibrium is None:
            return np.full(3, 0.0 if self.chart is not None and not self.push else nan)
        return self.equilibrium.sideways_force

    @property
    def one_sided_amplitude(self) -> float:
        """F/K at the largest stiffness: amplitude up to which a one-sided wall is as charted [m]."""
        return nan if self.equilibrium is None else self.equilibrium.one_sided_amplitude(self.stiffness_max)


@dataclass(frozen=True, repr=False)
class LoadPath(Result):
    """The charts of one posture under pushes from one side to the other.

    steps  by ascending push, the middle one without
    load   what acts without a push; None: nothing
    hand   how the hand's force goes with the handle, as in `Load`
    """

    steps: tuple[PushedChart, ...]
    load: Load | None = None
    hand: HandForce = "dead"

    @property
    def pushes(self) -> Floats:
        """Push of each step (k,) [N]."""
        return np.array([step.push for step in self.steps])

    @property
    def stiffness_max(self) -> Floats:
        """Largest stiffness (k,) [N/m]; nan where there is none."""
        return np.array([step.stiffness_max for step in self.steps])

    @property
    def growth_rates(self) -> Floats:
        """Growth rate of the fastest-growing sideways motion (k,) [1/s]; nan where there is none."""
        return np.array([step.growth_rate for step in self.steps])

    @property
    def hand_neglected(self) -> Floats:
        """Largest stiffness with the change of the hand's force left out (k,) [N/m]."""
        return np.array([step.hand_neglected for step in self.steps])

    @property
    def fixed_surface(self) -> Floats:
        """Largest stiffness with surface and hand fixed (k,) [N/m]."""
        return np.array([step.fixed_surface for step in self.steps])

    @property
    def unpushed(self) -> PushedChart:
        """The chart without a push."""
        return self.steps[len(self.steps) // 2]

    @property
    def reason(self) -> str | None:
        """Why no push has a stable wall: every reason once; None where one has."""
        if np.isfinite(self.stiffness_max).any():
            return None
        return "; ".join(dict.fromkeys(step.status for step in self.steps))

    def document(self) -> dict[str, Any]:
        """Lists of one entry for each push, by key and unit."""
        return {key: list(values) for key, values in self._columns().items()} | {
            "sideways_force_N": [step.sideways_force.tolist() for step in self.steps]
        }

    def table(self) -> dict[str, Any]:
        """The charts as columns, one push a row."""
        forces = np.array([step.sideways_force for step in self.steps])
        return self._columns() | {f"sideways_force_{axis}_N": forces[:, k] for k, axis in enumerate("xyz")}

    def _columns(self) -> dict[str, Any]:
        """Lists of one entry for each push, by key and unit; without the sideways force, a vector. Of several
        frequencies the lowest."""
        charts = [step.chart for step in self.steps]
        moved = [step.sideways for step in self.steps]
        return {
            "push_N": self.pushes,
            "status": [step.status for step in self.steps],
            "stiffness_max_N_per_m": self.stiffness_max,
            "damping_at_stiffness_max_Ns_per_m": [
                nan if one is None else one.damping_at_stiffness_max for one in charts
            ],
            "frequency_at_stiffness_max_Hz": [
                nan if one is None else min(one.frequencies_at_stiffness_max, default=nan) for one in charts
            ],
            "damping_max_Ns_per_m": [nan if one is None else one.damping_max for one in charts],
            "stable_area_N2s_per_m2": [nan if one is None else one.stable_area for one in charts],
            "wall_force_N": [step.wall_force for step in self.steps],
            "one_sided_amplitude_m": [step.one_sided_amplitude for step in self.steps],
            "growth_rate_1_per_s": self.growth_rates,
            "time_to_double_s": [nan if one is None else one.time_to_double for one in moved],
            "sideways_frequency_Hz": [nan if one is None else one.frequency for one in moved],
            "stiffness_max_hand_neglected_N_per_m": self.hand_neglected,
            "stiffness_max_fixed_surface_N_per_m": self.fixed_surface,
            "fixed_surface_status": [step.fixed_surface_status for step in self.steps],
        }

    def __repr__(self) -> str:
        pushes = f"LoadPath: {len(self.steps)} pushes of {self.pushes[0]:g} to {self.pushes[-1]:g} N"
        if self.reason is not None:
            return f"{pushes}: {self.reason}"
        low, high = float(np.nanmin(self.stiffness_max)), float(np.nanmax(self.stiffness_max))
        fastest = np.nanmax(self.growth_rates) if np.isfinite(self.growth_rates).any() else 0.0
        grows = f"sideways growth up to {fastest:.4g} 1/s" if fastest > 0.0 else "nothing grows sideways"
        return f"{pushes}\n  largest stiffness {low:.6g} to {high:.6g} N/m, {grows}"


def load_path(
    device: Device,
    push: float = 5.0,
    count: int = 9,
    point: OperatingPoint | None = None,
    progress: Progress | None = None,
) -> LoadPath:
    """Charts at pushes spread evenly from -push to push along the rendered direction, all else of the load kept.

    A push under which there is no equilibrium, or no chart, is data: nan, and a status that says why.

    push      largest push to either side [N], about an axis [N m]
    count     number of pushes, odd, so that none is among them; from 3 to 201
    point     posture, direction and load; left out: the device's reference, and its own load. A load that settles
              has the push as the hand's whole force
    progress  called with "pushes", those that are done, and all of them
    Raises    ArgumentError  for another push or count
              NoMechanismError  for a device without a mechanism
              what `Device.at` raises, but for the lack of an equilibrium; what `OperatingPoint.loop` raises
    """
    check_kind("device", device, Device)
    check_arguments(LOAD, push=push, count=count)
    if count % 2 == 0:
        raise ArgumentError("count", f"must be odd, so that the chart without a push is among them, got {count}")
    if device.mechanism is None:
        raise NoMechanismError
    pushes = _Pushes.of(device, point)
    steps = []
    half = count // 2
    for k in range(-half, half + 1):
        steps.append(pushes.chart(push * k / half))
        if progress is not None:
            progress("pushes", len(steps), count)
    path = LoadPath(tuple(steps), pushes.kept, pushes.load.hand)
    middle = path.unpushed.chart
    about = None if middle is None else middle.operating_point
    return path.about(about or pushes.here)


def without_push(load: Load | None) -> Load | None:
    """A load without the hand's force: its weight alone; None where that is nothing."""
    if load is None or not np.any(load.weight):
        return None
    return replace(load, force=None, moment=None, push=None, settle=False)


@dataclass(frozen=True)
class _Pushes:
    """The charts of a device in one posture under pushes of the hand.

    bare  the device without load
    here  operating point of `bare` in the posture and direction of all charts
    load  whose push is replaced by each of the pushes
    kept  the load without a push; None: nothing acts then
    """

    bare: Device
    here: OperatingPoint
    load: Load
    kept: Load | None

    @classmethod
    def of(cls, device: Device, point: OperatingPoint | None) -> _Pushes:
        """The pushes of a device at an operating point; None: the device's reference, and its own load."""
        load = device.load if point is None or point.load is None else point.load
        bare = device_without_load(device if point is None else device_of_point(device, point))
        here = bare.at() if point is None else bare.at_point(point)
        return cls(bare, here, load or Load(), without_push(load))

    def under(self, push: float) -> Device:
        """The device under a push [N] along the direction and all else of the load."""
        if not push:
            return self.bare if self.kept is None else self.bare.under(self.kept)
        force = push * np.asarray(self.here.direction)[:3] if self.load.settle else None
        along = None if self.load.settle else push  # a load that settles gives the whole force as a vector
        return self.bare.under(replace(self.load, force=force, moment=None, push=along))

    def chart(self, push: float) -> PushedChart:
        """The chart under a push [N], with its sideways motion and the other two largest stiffnesses; without an
        equilibrium or a chart a status that says why."""
        device = self.under(push)
        try:
            point = device.at_point(self.here)
            found = None if point.load is None else point.equilibrium
        except EquilibriumError as error:
            return PushedChart(push, f"no equilibrium: {error}", fixed_surface_status="no equilibrium")
        try:
            sideways = fastest_sideways_motion(point)
            chart = stability_chart(point.loop, decay=False).about(point).drawn()
        except (ChartError, UnresolvedError) as error:
            return PushedChart(push, f"undecided: {error}", equilibrium=found, fixed_surface_status="undecided")
        status = NONE_STABLE if isnan(chart.stiffness_max) else OK
        surface, why = chart.stiffness_max, status  # without a push the handle does not sink in: no difference
        if push and status == OK:
            surface, why = self._fixed_surface(device, push, chart.stiffness_max)
        return PushedChart(push, status, chart, found, sideways, _hand_neglected(point, chart), surface, why)

    def _fixed_surface(self, device: Device, push: float, near: float) -> tuple[float, str]:
        """Largest stiffness with surface and hand fixed [N/m], and "ok"; nan, and why there is none. The handle,
        from the posture of all charts, then sinks in by push over stiffness, which changes its posture.

        device  under this push [N]
        near    the largest stiffness with the posture kept [N/m]
        """
        axis = screw(self.here.direction)
        if np.any(axis[3:]):
            return nan, NOT_ALONG_A_DIRECTION
        posture, why = self.here.posture, ""  # why: of the last stiffness tried
        assert posture is not None

        def excess(log_stiffness: float) -> float:
            """By what ratio a stiffness could be larger in the posture that it has, a logarithm, all but
            linear; -inf where there is no such posture or no stable wall."""
            nonlocal why
            stiffness = exp(log_stiffness)
            try:
                point = device.at(
                    posture.position + push / stiffness * axis[:3],
                    directions=self.here.directions,
                    orientation=posture.rotation,
                    assembly=posture.assembly,
                    model=self.here.model,
                )
                peak = largest_stiffness(point.loop)
            except (PostureError, EquilibriumError, ChartError, UnresolvedError) as error:
                why = str(error)
                return -inf
            why = NONE_STABLE if peak is None else ""
            return -inf if peak is None else log(peak.stiffness) - log_stiffness

        stiffness, low = _balanced_stiffness(excess, near)
        if stiffness is not None:
            return stiffness, OK
        return nan, f"none: where the handle sinks in by {abs(push) / exp(low):.4g} m, {why or TOO_SOFT}"


def _balanced_stiffness(excess: Callable[[float], float], near: float) -> tuple[float | None, float]:
    """Find the largest stiffness [N/m] at which `excess` is 0.

    excess  logarithm of a stiffness -> by what ratio it could be larger, a logarithm; -inf where that is not known
    near    the stiffness from which the search goes upwards, then downwards [N/m]

    Returns  the stiffness, or None where there is none, and the logarithm of the smallest one tried
    """
    # upwards to a stiffness that is too large
    high = low = log(near) + START
    for _ in range(STEPS):
        ratio = excess(high)
        if ratio <= 0.0:
            break
        high += STEP
    # downwards to one that is too small, then between the two
    # not where the search upwards has ended without a posture or a stable wall
    for _ in range(STEPS if ratio > -inf else 0):
        low = high - STEP
        ratio = excess(low)
        if ratio >= 0.0:
            return exp(float(brentq(excess, low, high, xtol=SETTLED))), low
        if ratio == -inf:
            break
        high = low
    return None, low


def _hand_neglected(point: OperatingPoint, chart: StabilityChart) -> float:
    """Largest stiffness with the change of the hand's force left out [N/m]; nan if there is none."""
    if point.load is None or point.load.hand == "neglected":
        return chart.stiffness_max
    try:
        peak = largest_stiffness(replace(point, load=replace(point.load, hand="neglected")).loop)
    except (ChartError, UnresolvedError):
        return nan
    return nan if peak is None else peak.stiffness
