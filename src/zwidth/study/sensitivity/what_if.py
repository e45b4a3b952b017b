"""What limits the walls of a device: the largest stiffness after one change at a time.

No rule of thumb is used: for each change the plant or the loop is built again and its exact chart is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import isnan, nan
from typing import Any, Final

import numpy as np

from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.device.device import Device
from zwidth.errors import ChartError, LoadError, ModelError
from zwidth.loop.controller import Butterworth, Controller
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind
from zwidth.model.plant import Plant
from zwidth.model.reduction import Model

BASE: Final = "as-described"
# Changes that may gain stiffness; the one that gains most names what limits the device.
REMEDIES: Final = ("rigid-drives", "half-period", "no-delay", "no-filter", "twice-damping", "collocated")
VARIANT_MODELS: Final = ("full", "two-mass", "motor-mass", "motor-mass-undamped", "rigid-undamped")
LEAST_GAIN: Final = 1.01  # a change that gains less than 1 % does not count as one that helps
THESIS_CUTOFF_HZ: Final = 20.0


@dataclass(frozen=True)
class Variant:
    """A device with one thing changed.

    key     one of BASE, REMEDIES, "one-sample", "with-filter", or "model-" and one of VARIANT_MODELS
    label   for tables and figures
    loop    None where the change does not apply
    chart   its stability chart; None where the change does not apply or the chart cannot be drawn
    reason  why there is no chart, "" where there is one
    """

    key: str
    label: str
    loop: Loop | None
    chart: StabilityChart | None
    reason: str = ""

    @property
    def stiffness_max(self) -> float:
        """Largest stiffness of stable walls with K > 0, B >= 0 [N/m]; 0 if none is stable, nan if left out."""
        if self.chart is None:
            return nan
        return 0.0 if isnan(self.chart.stiffness_max) else self.chart.stiffness_max

    @property
    def damping(self) -> float:
        """Damping of that wall [N s/m]; nan if there is none."""
        return nan if self.chart is None else self.chart.damping_at_stiffness_max

    @property
    def frequencies(self) -> tuple[float, ...]:
        """Frequencies of that wall's vibration [Hz]: one, two at a corner, none if there is no such wall."""
        return () if self.chart is None else self.chart.frequencies_at_stiffness_max

    @property
    def area(self) -> float:
        """Stable area within K >= 0, B >= 0 [N² s/m²]; 0 if no wall is stable, nan if left out."""
        if self.chart is None:
            return nan
        # without a stable wall the area is rounding error
        return 0.0 if isnan(self.chart.stiffness_max) else self.chart.stable_area


def what_if(device: Device, point: OperatingPoint | None = None) -> list[Variant]:
    """The device as described, with each change, and in each of the models of thesis Fig. 4.4.

    point  one posture and one direction; left out: the device's reference
    A change that does not apply has no chart and says why; the device as described comes first and always has one.
    Raises  what `Device.at` and `OperatingPoint.plant` raise; ChartError if the device itself cannot be charted
    """
    check_kind("device", device, Device)
    point = point or device.at()
    variants = [Variant(BASE, "as described", point.loop, stability_chart(point.loop).drawn())]
    steps = [*_changes(device, point), *_models(point)]
    return variants + [_variant(*step) for step in steps]


def limiting_change(variants: Sequence[Variant]) -> Variant | None:
    """The remedy that gains most stiffness; None where none gains at least 1 %."""
    base = find_variant(variants, BASE)
    best = max(
        (v for v in variants if v.key in REMEDIES and v.chart is not None),
        key=lambda variant: variant.stiffness_max,
        default=None,
    )
    return best if best is not None and best.stiffness_max > LEAST_GAIN * base.stiffness_max else None


def find_variant(variants: Sequence[Variant], key: str) -> Variant:
    """The variant of that key. Raises KeyError if there is none."""
    for variant in variants:
        if variant.key == key:
            return variant
    raise KeyError(key)


# key, label, why it does not apply ("" if it may), how to make its loop
Change = tuple[str, str, str, Callable[[], Loop]]


def _variant(key: str, label: str, obstacle: str, make: Callable[[], Loop]) -> Variant:
    """The variant of a change, whose four entries `Change` names, with its chart or the reason why it has none."""
    if obstacle:
        return Variant(key, label, None, None, obstacle)
    try:
        loop = make()
        return Variant(key, label, loop, stability_chart(loop, decay=False).drawn())
    except (ModelError, LoadError, ChartError) as error:
        return Variant(key, label, None, None, str(error))


def _changes(device: Device, point: OperatingPoint) -> Iterator[Change]:
    """Yield each single change of the device or its computer, see `Change`; those that do not apply with the
    obstacle."""
    controller, plant = point.computer, point.plant
    ungripped = point.ungripped_plant  # the device's own damping, without the operator's

    def with_computer(**changes: Any) -> Callable[[], Loop]:
        """Function that makes the loop with changed fields of its computer."""
        return lambda: Loop(plant, replace(controller, **changes))

    def unless(applies: object, obstacle: str) -> str:
        """The obstacle of a change; "" where it applies."""
        return "" if applies else obstacle

    flexible, damped = ungripped.stiffness.any(), ungripped.damping.any()
    delay, low_pass = controller.delay, controller.velocity_filter
    usual = usual_filter(controller.sampling_period)
    damping_name = "structural damping" if flexible else "friction"

    obstacle = unless(
        flexible, f"its {'drives are' if point.mechanism is not None else 'structure is'} rigid already"
    )
    bends = point.mechanism is not None and bool(point.mechanism.flexible)
    drives = "rigid drives and links" if bends else "rigid drives"
    name = drives if point.mechanism is not None else "rigid structure"
    yield "rigid-drives", name, obstacle, lambda: point.in_model("rigid").loop
    faster = half_period(device, point)
    yield "half-period", "half the sampling period", _estimate_obstacle(faster), lambda: Loop(plant, faster)
    obstacle = unless(delay != 0.0, "the device has no delay")
    yield "no-delay", "no delay", obstacle, with_computer(delay=0.0)
    obstacle = unless(delay != 1.0, "the device has one sample of delay")
    yield "one-sample", "one sample of delay", obstacle, with_computer(delay=1.0)
    obstacle = unless(low_pass is not None, "the device has no velocity filter")
    yield "no-filter", "without the velocity filter", obstacle, with_computer(velocity_filter=None)
    obstacle = unless(low_pass is None, "the device has a velocity filter")
    label = f"velocity through a Butterworth filter of order 2 at {usual.cutoff_Hz:.4g} Hz"
    yield "with-filter", label, obstacle, with_computer(velocity_filter=usual)
    twice = replace(ungripped, damping=2.0 * ungripped.damping)
    obstacle = unless(damped, f"the device has no {damping_name}")
    yield (
        "twice-damping",
        f"twice the {damping_name}",
        obstacle,
        lambda: Loop(point.attach_operator(twice), controller),
    )
    obstacle = unless(not _collocated(plant), "the sensor reads where the wall acts already")
    collocated = replace(plant, sensor=plant.actuator)
    yield "collocated", "sensor at the actuator", obstacle, lambda: Loop(collocated, controller)


def _collocated(plant: Plant) -> bool:
    """Whether the sensor reads the coordinate on which the wall acts, with any gain."""
    sensor, actuator = plant.sensor, plant.actuator
    along = float(sensor @ actuator) / float(actuator @ actuator)
    return bool(np.max(np.abs(sensor - along * actuator)) <= 1e-9 * np.max(np.abs(sensor)))


def _models(point: OperatingPoint) -> Iterator[Change]:
    """The models of thesis Fig. 4.4: the full one, and its reductions."""
    full = point.in_model("full").ungripped_plant
    damped = " with damping" if full.damping.any() or full.lagged_dampers else ""
    undamped_only = "" if damped else "there is no damping to leave out"

    def obstacle_if_same(name: Model) -> str:
        """Why a model is left out: the device is this model; "" where it is not."""
        return "the device as described is this model" if reduces_to_itself(name) else ""

    def reduces_to_itself(name: Model) -> bool:
        """Whether the device as described is this model: then `in_model` returns its plant unchanged."""
        try:
            return point.in_model(name).ungripped_plant is full
        except (ModelError, LoadError):
            return False

    def loop_in(name: Model, *, lossless: bool = False) -> Callable[[], Loop]:
        """Function that makes the loop in a model, without damping if `lossless`."""

        def make() -> Loop:
            reduced = point.in_model(name)
            if not lossless:
                return reduced.loop
            plant = reduced.ungripped_plant
            undamped = replace(plant, damping=0.0 * plant.damping, lagged_dampers=())
            return Loop(point.attach_operator(undamped), point.computer)

        return make

    given = "full model, all flexible coordinates" if point.mechanism is not None else "plant as given"
    yield "model-full", given, "", loop_in("full")
    yield "model-two-mass", f"two masses{damped}", obstacle_if_same("two-mass"), loop_in("two-mass")
    yield "model-motor-mass", f"motor mass{damped}", "", loop_in("motor-mass")
    lossless_loop = loop_in("motor-mass", lossless=True)
    yield "model-motor-mass-undamped", "motor mass without damping", undamped_only, lossless_loop
    # with damping the device as described is not this model, even where it is rigid
    rigid = "" if damped else obstacle_if_same("rigid")
    yield "model-rigid-undamped", "rigid without damping", rigid, loop_in("rigid", lossless=True)


def _estimate_obstacle(controller: Controller) -> str:
    """Why the velocity cannot be estimated at this sampling period, as a Kalman filter's may not; "" if it can."""
    try:
        controller.velocity.estimator(controller.sampling_period)
    except ValueError as error:
        return str(error)
    return ""


def half_period(device: Device, point: OperatingPoint | None = None) -> Controller:
    """The device's computer at twice the rate: a delay given in seconds stays the same in seconds, one given
    in samples the same in samples."""
    controller = device.controller if point is None else point.computer
    in_seconds = "delay_s" in device.document.get("loop", {})
    delay = controller.delay * (2.0 if in_seconds else 1.0)
    return replace(controller, sampling_period=controller.sampling_period / 2.0, delay=delay)


def usual_filter(sampling_period: float) -> Butterworth:
    """The filter tried where there is none: 20 Hz as in thesis 3.2.4, at most a tenth of Nyquist."""
    return Butterworth(2, min(THESIS_CUTOFF_HZ, 0.05 / sampling_period))
