"""All guarantees of one device side by side, the strongest first: the result."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Self

from zwidth.chart.chart import StabilityChart
from zwidth.chart.measured.chart import MeasuredChart
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.guarantees.coupling import Couplings
from zwidth.guarantees.region import Region, outline_columns, stiffness_text
from zwidth.guarantees.stable_alone import Premise
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.result import Documented, Result, entry

COLGATE = (
    "Colgate and Schenkel 1997, read in Weir and Colgate's chapter of 2008; here for any device by alias disks"
)
EXACT = "exact chart (D-decomposition)"
NO_STABLE = "no stable wall has K > 0 and B >= 0"


@dataclass(frozen=True)
class Guarantee(Documented):
    """One guarantee: its short name, what it promises, its walls, and where the condition comes from."""

    name: str = field(metadata=entry())
    meaning: str = field(metadata=entry())
    region: Region = field(metadata=entry(spread=True))
    source: str = field(metadata=entry())


@dataclass(frozen=True)
class Guarantees(Result):
    """The guarantees of a loop, from the strongest to plain stability, and the chart that holds them all.

    couplings  virtual couplings through which walls are stable with every passive operator; None: not computed
    premises   what must hold for the guarantees; where one fails, they are withheld
    """

    loop: Loop | MeasuredLoop
    guarantees: tuple[Guarantee, ...] = field(metadata=entry())
    chart: StabilityChart | MeasuredChart
    couplings: Couplings | None = field(default=None, metadata=entry(name="coupling", empty="left out"))
    premises: tuple[Premise, ...] = field(default=(), metadata=entry())

    def __getitem__(self, name: str) -> Guarantee:
        """The guarantee of that name. Raises KeyError."""
        for guarantee in self.guarantees:
            if guarantee.name == name:
                return guarantee
        raise KeyError(name)

    def about(self, point: OperatingPoint) -> Self:
        """Remember the operating point, for the regions, too, which can be drawn alone; returns the result."""
        for one in self.guarantees:
            one.region.about(point)
        return super().about(point)

    @property
    def refusal(self) -> str | None:
        """The reason why guarantees are withheld: the premise that fails; None where none does."""
        return next((premise.reason for premise in self.premises if premise.fails), None)

    @property
    def is_empty(self) -> bool:
        """Whether no wall with K > 0 and B >= 0 has any of the guarantees."""
        return all(guarantee.region.reason is not None for guarantee in self.guarantees)

    def table(self) -> dict[str, list[Any]]:
        """The outlines as columns, region after region."""
        return outline_columns({guarantee.name: guarantee.region for guarantee in self.guarantees}, "guarantee")

    def __repr__(self) -> str:
        """The stiffest wall of each guarantee, the premises that are unsure, and the couplings."""
        stiffest = ", ".join(f"{one.name} {stiffness_text(one.region)}" for one in self.guarantees)
        coupled = [] if self.couplings is None else repr(self.couplings).splitlines()
        unsure = [premise.reason for premise in self.premises if premise.reason]
        return "\n  ".join([f"Guarantees: {stiffest}", *unsure, *coupled])
