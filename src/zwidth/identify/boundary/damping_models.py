"""Models of a device's own damping, each with a number or two that a boundary is fitted with.

    modal         the same ratio on every flexible mode
    stiffness     B = r_k K
    mass          B = r_m M
    proportional  B = r_m M + r_k K                                   (thesis eq. 3.2)
    drive         a viscous damper from the drive to the ground, B = b a a^T, a where the wall force acts
    hysteretic    K (1 + i eta) in steady vibration

Each takes the place of the structural damping in the file; dampers of joints and of the operator stay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.edge_crossings import EdgeChords
from zwidth.device.device import Device
from zwidth.device.faults import comma_list, fail, suggestion
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.mechanism import Damping, ModalDamping, ProportionalDamping
from zwidth.model.modes import modal_matrix, natural_frequencies
from zwidth.model.operator import attach
from zwidth.model.plant import Plant

if TYPE_CHECKING:
    from zwidth.chart.chart_base import Chart


START_RATIO: Final = 0.03  # damping ratio that the first try of each model has at the lowest flexible mode
RIGID: Final = 1e-6  # share of the highest frequency below which a mode counts as rigid
MODAL, BY_STIFFNESS, BY_MASS, PROPORTIONAL, DRIVE, HYSTERETIC = (
    "modal",
    "stiffness",
    "mass",
    "proportional",
    "drive",
    "hysteretic",
)
# model -> its numbers: what each is, its unit, and its path in the file of a mechanism
NUMBERS: Final[dict[str, tuple[tuple[str, str, str], ...]]] = {
    MODAL: (("damping ratio of every flexible mode", "", "mechanism.damping.mode_ratio"),),
    BY_STIFFNESS: (("stiffness coefficient of the damping", "s", "mechanism.damping.stiffness_coefficient_s"),),
    BY_MASS: (("mass coefficient of the damping", "1/s", "mechanism.damping.mass_coefficient_1_per_s"),),
    PROPORTIONAL: (
        ("mass coefficient of the damping", "1/s", "mechanism.damping.mass_coefficient_1_per_s"),
        ("stiffness coefficient of the damping", "s", "mechanism.damping.stiffness_coefficient_s"),
    ),
    DRIVE: (("viscous damping at the drive", "N s/m", ""),),
    HYSTERETIC: (("loss factor", "", "plant.loss_factor"),),
}
TITLES: Final = {
    MODAL: "modal ratio",
    BY_STIFFNESS: "stiffness-proportional",
    BY_MASS: "mass-proportional",
    PROPORTIONAL: "mass- and stiffness-proportional",
    DRIVE: "viscous at the drive",
    HYSTERETIC: "hysteretic loss factor",
}


@dataclass(frozen=True)
class DampingModel:
    """A model of a device's damping.

    name     a key of `NUMBERS`
    start    (k,) numbers to begin a fit with
    device   whose damping it is;   point  where, and held by whom
    """

    name: str
    start: Floats
    device: Device
    point: OperatingPoint

    @classmethod
    def of(cls, name: str, device: Device, point: OperatingPoint) -> DampingModel:
        """A model of this name. Raises DeviceError for another name, and where the device has none such."""
        if name not in NUMBERS:
            text = f"{name!r} is no model of damping; {suggestion(name, NUMBERS)}"
            raise fail(device.label, "damping_models", text)
        if device.response is not None:
            text = "a measured response has its damping in it; models are for a [mechanism] or a [plant]"
            raise fail(device.label, "damping_models", text)
        # a model without numbers yet, which `_bare_loop` does not read
        plant = cls(name, np.empty(0), device, point)._bare_loop(device).plant
        frequencies = natural_frequencies(plant)
        flexible = frequencies[frequencies > RIGID * np.max(frequencies, initial=0.0)]
        if not len(flexible):
            if name not in (BY_MASS, DRIVE):
                text = f"{TITLES[name]}: nothing of the device vibrates; possible are {BY_MASS} and {DRIVE}"
                raise fail(device.label, "damping_models", text)
            flexible = np.array([0.01 / plant.mass.shape[0]])  # Hz: a start for a device that does not vibrate
        w = 2.0 * pi * float(flexible[0])
        # of a mode at w the damping ratio is r_m/(2 w) + r_k w/2, the loss factor twice that
        at_drive = float(plant.actuator @ plant.mass @ plant.actuator)
        start = {
            MODAL: [START_RATIO],
            BY_STIFFNESS: [2.0 * START_RATIO / w],
            BY_MASS: [2.0 * START_RATIO * w],
            PROPORTIONAL: [START_RATIO * w, START_RATIO / w],
            DRIVE: [2.0 * START_RATIO * w * at_drive],
            HYSTERETIC: [2.0 * START_RATIO],
        }
        return cls(name, np.array(start[name]), device, point)

    @property
    def title(self) -> str:
        """The model as users read it."""
        return TITLES[self.name]

    @property
    def numbers(self) -> list[tuple[str, str, str]]:
        """What each number is, its unit, and its path in the file; "" where the file has none."""
        has = "mechanism." if self.device.mechanism is not None else "plant."
        return [(what, unit, path if path.startswith(has) else "") for what, unit, path in NUMBERS[self.name]]

    def chart(self, device: Device, numbers: Floats) -> Chart:
        """Exact chart of a device like the model's own with numbers (k,) of the model. Raises ValueError."""
        from zwidth.chart.chart import stability_chart
        from zwidth.chart.hysteretic_response import hysteretic_chart

        loop = self._loop(device, numbers)
        return hysteretic_chart(loop) if self.name == HYSTERETIC else stability_chart(loop, decay=False)

    def edge(self, device: Device, numbers: Floats, thinned: int) -> EdgeChords:
        """The edge of `chart`, of every `thinned` chords one; with a loss factor all of `hysteretic_edge`."""
        from zwidth.chart.hysteretic_response import hysteretic_edge

        if self.name == HYSTERETIC:
            return hysteretic_edge(self._loop(device, numbers))
        return EdgeChords.of(self.chart(device, numbers)).thinned(thinned)

    def _loop(self, device: Device, numbers: Floats) -> Loop:
        """The loop with these numbers, held by the point's operator."""
        if device.mechanism is not None and (damping := _mechanism_damping(self.name, numbers)) is not None:
            return replace(device, damping=damping).at_point(self.point).loop
        bare = self._bare_loop(device)
        plant = _with_damping(bare.plant, self.name, numbers)
        operator = self.point.operator if plant.handle is not None else None
        return Loop(plant if operator is None else attach(plant, operator), bare.controller)

    def contact_loop(self, device: Device, numbers: Floats) -> Loop:
        """The loop of a simulated contact with these numbers, without an operator. Raises DeviceError."""
        if self.name == HYSTERETIC:
            text = (
                "a loss factor has no motion in time, and no trials can be simulated with it; leave hysteretic out"
            )
            raise fail(device.label, "damping_models", text)
        if device.mechanism is not None and (damping := _mechanism_damping(self.name, numbers)) is not None:
            return replace(device, damping=damping).at_point(self.point).contact_loop
        bare = self._bare_loop(device)
        return Loop(_with_damping(bare.plant, self.name, numbers), bare.controller)

    def _bare_loop(self, device: Device) -> Loop:
        """The loop without structural damping, and without an operator."""
        if device.given_plant is not None:
            plant = replace(device.given_plant, damping=0.0 * device.given_plant.damping, hysteresis=None)
            return replace(device, given_plant=plant).at_point(self.point).contact_loop
        return replace(device, damping=ModalDamping(0.0)).at_point(self.point).contact_loop


def models_of(names: str | Sequence[str], device: Device, point: OperatingPoint) -> list[DampingModel]:
    """The models of these names; "all": those that the device can have.

    Raises  DeviceError  for another name, for one named twice, and where the device has no such model
    """
    if names in ("all", ("all",), ["all"]):
        vibrates = np.max(natural_frequencies(point.contact_loop.plant), initial=0.0) > 0.0
        names = list(NUMBERS) if vibrates else [BY_MASS, DRIVE]
    chosen = [names] if isinstance(names, str) else list(names)
    if len(set(chosen)) < len(chosen):
        raise fail(device.label, "damping_models", f"must differ, got {comma_list(chosen)}")
    return [DampingModel.of(name, device, point) for name in chosen]


def _mechanism_damping(name: str, numbers: Floats) -> Damping | None:
    """The damping of a mechanism by a model's name and numbers (k,); None where a file has no such damping."""
    match name:
        case "modal":
            return ModalDamping(float(numbers[0]))
        case "stiffness":
            return ProportionalDamping(0.0, float(numbers[0]))
        case "mass":
            return ProportionalDamping(float(numbers[0]), 0.0)
        case "proportional":
            return ProportionalDamping(float(numbers[0]), float(numbers[1]))
    return None


def _with_damping(plant: Plant, name: str, numbers: Floats) -> Plant:
    """A plant with damping by a model's name and numbers (k,) added to what it has."""
    M, K, a = plant.mass, plant.stiffness, plant.actuator
    match name:
        case "modal":
            B = modal_matrix(M, K, float(numbers[0]))
        case "stiffness":
            B = numbers[0] * K
        case "mass":
            B = numbers[0] * M
        case "proportional":
            B = numbers[0] * M + numbers[1] * K
        case "drive":
            B = numbers[0] * np.outer(a, a)
        case _:
            # hysteretic: in place of a loss factor that the plant has
            return replace(plant, hysteresis=numbers[0] * K)
    return replace(plant, damping=plant.damping + B)
