"""Everything a report says, computed once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

from zwidth.arrays import Floats
from zwidth.chart.chart import StabilityChart
from zwidth.conditions import Bound
from zwidth.conditions.comparison import bounds_of
from zwidth.device.device import Device
from zwidth.errors import ChartError
from zwidth.loop.loop import Loop, unobserved_instability
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.felt import FeltChart, felt_chart
from zwidth.model.effective_mass import EffectiveParameters
from zwidth.model.modes import natural_frequencies
from zwidth.model.posture import Posture
from zwidth.questions import LOAD
from zwidth.study.link_bending import Bending, bending
from zwidth.study.loaded_charts import LoadPath, load_path
from zwidth.study.model_validity import Validity, validity
from zwidth.study.sensitivity.result import Sensitivities
from zwidth.study.sensitivity.sensitivities import sensitivities
from zwidth.study.sensitivity.what_if import BASE, Variant, find_variant, what_if

PUSHES: Final = 5  # charts along the path of pushes


@dataclass(frozen=True)
class Facts:
    """A device in one posture and direction, and all results about its walls.

    point                the operating point: posture, direction, model, operator
    variants             the device as described first, then what_if's changes and models
    natural_frequencies  undamped, of the ungripped device [Hz]; rigid modes 0
    bounds               the published conditions on the loop
    runs_away            whether a motion that no wall affects is unstable
    """

    device: Device
    point: OperatingPoint
    variants: tuple[Variant, ...]
    natural_frequencies: Floats
    bounds: tuple[Bound, ...]
    runs_away: bool

    @property
    def posture(self) -> Posture | None:
        """The posture; None for a device given by its plant."""
        return self.point.posture

    @property
    def direction(self) -> Floats | None:
        """The rendered direction (3,), or screw (6,); None for a device given by its plant."""
        return None if self.posture is None else self.point.direction

    @property
    def model(self) -> str:
        """The model's name: "full", "two-mass", "motor-mass" or "rigid"."""
        return self.point.model or "full"

    @property
    def effective(self) -> EffectiveParameters:
        """Masses and stiffness felt along the direction."""
        return self.point.effective

    @property
    def base(self) -> Variant:
        """The variant in which nothing is changed: the device as described, with its chart."""
        return find_variant(self.variants, BASE)

    @property
    def loop(self) -> Loop:
        """The loop of the device as described."""
        loop = self.base.loop
        assert loop is not None
        return loop

    @property
    def chart(self) -> StabilityChart:
        """The chart of the device as described."""
        chart = self.base.chart
        assert chart is not None
        return chart

    @property
    def operator(self) -> str | None:
        """The operator; None where the handle is ungripped, and for the model with a fixed link side."""
        return None if self.model == "motor-mass" else self.point.operator_name

    @property
    def renders(self) -> bool:
        """Whether any wall with K > 0 and B >= 0 is stable."""
        return self.base.stiffness_max > 0.0

    @cached_property
    def sensitivities(self) -> Sensitivities:
        """Sensitivities of the largest stiffness to the numbers of the device file."""
        return sensitivities(self.device, self.point)

    @cached_property
    def validity(self) -> Validity | None:
        """Where along the edge of the full model each simpler one agrees; None if that has no chart."""
        try:
            return validity(self.point)
        except ChartError:
            return None

    @cached_property
    def bending(self) -> Bending | None:
        """The device beside the same with rigid links, or with its rigid links as typical tubes; None where no
        link could bend."""
        return bending(self.device, self.point)

    @cached_property
    def load_path(self) -> LoadPath | None:
        """Charts under pushes as large as the hand's, or of 5 N, to both sides; None of a device without load."""
        if self.point.load is None:
            return None
        push = self.point.load.along(self.point.equilibrium.screw)
        return load_path(self.device, LOAD["push"].default if push is None else abs(push), PUSHES, self.point)

    @cached_property
    def felt(self) -> FeltChart | None:
        """The chart at the static stiffness at the handle; None without a handle, and under load, where the
        impedance at the handle is not known."""
        if self.point.load is not None:
            return None
        alone = self.point.ungripped_plant
        return None if alone.handle is None else felt_chart(self.chart, alone)


def gather(device: Device, point: OperatingPoint | None = None) -> Facts:
    """All facts of a report; arguments and errors are those of `study.sensitivity.what_if.what_if`."""
    point = point or device.at()
    return Facts(
        device=device,
        point=point,
        variants=tuple(what_if(device, point)),
        natural_frequencies=natural_frequencies(point.ungripped_plant),
        bounds=tuple(bounds_of(point)),
        runs_away=unobserved_instability(point.loop),
    )
