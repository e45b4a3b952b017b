"""Everything a report says, computed once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from zwidth.chart.chart import StabilityChart
from zwidth.chart.region import ChartError
from zwidth.conditions import Bound, compare
from zwidth.device.device import At, Device
from zwidth.loop.loop import Loop
from zwidth.measures.felt_chart import FeltChart, felt_chart
from zwidth.model.effective import EffectiveParameters, effective_parameters
from zwidth.model.mechanism import Floats
from zwidth.model.modes import natural_frequencies
from zwidth.model.posture import Posture
from zwidth.model.reduction import plant_effective_parameters
from zwidth.show.friction import told_of
from zwidth.study.hidden import hidden_instability
from zwidth.study.sensitivity import Sensitivities, sensitivities
from zwidth.study.validity import Validity, validity
from zwidth.study.what_if import BASE, Variant, find, what_if


@dataclass(frozen=True)
class Facts:
    """A device in one posture and direction, and all that was found about its walls.

    posture, direction  None for a device given by its plant
    model               "full", "two-mass", "motor-mass" or "rigid"
    variants            the device as described first, then what_if's changes and models
    effective           masses and stiffness felt along the direction
    natural             undamped natural frequencies of the device by itself [Hz]; rigid modes 0
    bounds              the published conditions on the loop
    runs_away           a motion that no wall moves grows by itself
    asked               at, direction and assembly as they were asked for
    """

    device: Device
    posture: Posture | None
    direction: Floats | None
    model: str
    variants: tuple[Variant, ...]
    effective: EffectiveParameters
    natural: Floats
    bounds: tuple[Bound, ...]
    runs_away: bool
    asked: dict[str, Any]

    @property
    def base(self) -> Variant:
        """The device as described."""
        return find(self.variants, BASE)

    @property
    def loop(self) -> Loop:
        """Its loop."""
        loop = self.base.loop
        assert loop is not None
        return loop

    @property
    def chart(self) -> StabilityChart:
        """Its chart."""
        chart = self.base.chart
        assert chart is not None
        return chart

    @property
    def operator(self) -> str | None:
        """Who holds the handle; None where nobody does, or a model that holds the link side fixed."""
        return None if self.model == "motor-mass" else self.device.operator_name

    @property
    def renders(self) -> bool:
        """Is any wall with K > 0 and B >= 0 stable?"""
        return self.base.stiffness_max > 0.0

    @cached_property
    def answers(self) -> Sensitivities:
        """How the largest stiffness answers to each number."""
        return sensitivities(self.device, **self.asked, model=None if self.model == "full" else self.model)

    @cached_property
    def fits(self) -> Validity | None:
        """Which simpler model holds where along the edge of the full one; None if that has no chart."""
        try:
            return validity(self.device, **self.asked)
        except ChartError:
            return None

    @cached_property
    def felt(self) -> FeltChart | None:
        """The chart at the stiffness that the hand feels; None without a handle."""
        model = None if self.model == "full" else self.model
        alone = self.device.plant(**self.asked, model=model, held=False)
        return None if alone.handle is None else felt_chart(self.chart, alone)


def gather(
    device: Device,
    at: At | None = None,
    direction: Sequence[float] | None = None,
    assembly: str | None = None,
    model: str | None = None,
) -> Facts:
    """All facts of a report; arguments and errors are those of `study.what_if.what_if`."""
    variants = what_if(device, at, direction, assembly, model)
    loop = find(variants, BASE).loop
    assert loop is not None
    posture = along = None
    if device.mechanism is not None:
        posture, along = device.posture(at, assembly), device.direction(direction)
        effective = effective_parameters(device.mechanism, posture, along)
    else:
        assert device.given_plant is not None
        effective = plant_effective_parameters(device.given_plant)
    return Facts(
        device=device,
        posture=posture,
        direction=along,
        model=model or "full",
        variants=tuple(variants),
        effective=effective,
        natural=natural_frequencies(device.plant(at, direction, assembly, model, held=False)),
        bounds=tuple(compare(loop, **told_of(device, loop.plant))),
        runs_away=hidden_instability(loop),
        asked={"at": at, "direction": direction, "assembly": assembly},
    )
