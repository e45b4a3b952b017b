"""All guarantees of one loop side by side, the strongest first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from zwidth.chart.arc_joining import ChartError
from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.guarantees.passive import passive_region
from zwidth.guarantees.port import Floats
from zwidth.guarantees.region import Region, empty, stiffest_corner
from zwidth.guarantees.springs import nyquist_region, spring_stable_region
from zwidth.loop.loop import Loop
from zwidth.model.arguments import require

COLGATE = (
    "Colgate and Schenkel 1997, read in Weir and Colgate's chapter of 2008; here for any device by alias disks"
)
SPRINGS = "spring stability after Colgate and Schenkel 1997, known at second hand (thesis 1.1.3)"
EXACT = "exact chart (D-decomposition)"
NO_HANDLE = "the plant has no handle, so that nobody can hold it there"
NO_STABLE = "no stable wall has K > 0 and B >= 0"


@dataclass(frozen=True)
class Guarantee:
    """One guarantee: its short name, what it promises, its walls, and where the condition comes from."""

    name: str
    meaning: str
    region: Region
    source: str


@dataclass(frozen=True)
class Guarantees:
    """The guarantees of a loop, from the strongest to plain stability, and the chart that holds them all."""

    loop: Loop
    guarantees: tuple[Guarantee, ...]
    chart: StabilityChart

    def __getitem__(self, name: str) -> Guarantee:
        """The guarantee of that name. Raises KeyError."""
        for guarantee in self.guarantees:
            if guarantee.name == name:
                return guarantee
        raise KeyError(name)


def nested(loop: Loop, robust: Sequence[Floats] | None = None) -> Guarantees:
    """Every guarantee of a loop.

    loop    the bare device; a plant with an operator attached is asked about with him as a part of it
    robust  rings (k, 2) of [K, B] that are stable for a range of operators, from elsewhere; drawn between springs
            and stability

    Names: `passive-at-actuator` (where the handle is elsewhere), `passive`, `spring-stable`, `nyquist-spring`,
    `robust` (if given), `stable`. Without a handle only the first and the last are known.

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> paddle = Plant(np.array([[0.03]]), np.array([[1.0]]), np.zeros((1, 1)), one, one, one)
    >>> found = nested(Loop(paddle, Controller(sampling_period=0.001)))
    >>> [guarantee.name for guarantee in found.guarantees]
    ['passive', 'spring-stable', 'nyquist-spring', 'stable']
    """
    require("loop", loop, Loop)
    plant = loop.plant
    found = []
    apart = plant.handle is None or not _same_place(plant.actuator, plant.handle)
    if apart:
        found.append(
            Guarantee(
                "passive-at-actuator",
                "stable whatever passive linear operator holds the actuator",
                passive_region(loop, plant.actuator),
                COLGATE,
            )
        )
    held = plant.handle is not None
    found.append(
        Guarantee(
            "passive",
            "stable whatever passive linear operator holds the handle",
            passive_region(loop) if held else empty(NO_HANDLE),
            COLGATE,
        )
    )
    found.append(
        Guarantee(
            "spring-stable",
            "stable whatever spring holds the handle, from none to one that holds it fixed",
            _decided(spring_stable_region, loop) if held else empty(NO_HANDLE),
            SPRINGS,
        )
    )
    found.append(
        Guarantee(
            "nyquist-spring",
            "stable with the one spring that puts a mode at the Nyquist frequency",
            _decided(nyquist_region, loop) if held else empty(NO_HANDLE),
            SPRINGS,
        )
    )
    if robust is not None:
        found.append(
            Guarantee("robust", "stable for a whole range of operators", region_of(robust), "robust chart")
        )
    chart = stability_chart(loop, decay=False)
    peak = chart.stiffness_max
    stable = Region(chart.regions, peak, chart.damping_at_stiffness_max, None if np.isfinite(peak) else NO_STABLE)
    found.append(Guarantee("stable", "stable with the device as described", stable, EXACT))
    return Guarantees(loop, tuple(found), chart)


def _decided(found: Callable[[Loop], Region], loop: Loop) -> Region:
    """A region made of charts; empty, and undecided, where one of them cannot be closed."""
    try:
        return found(loop)
    except ChartError as error:
        return empty(f"this is undecided: {error}")


def region_of(rings: Sequence[Floats]) -> Region:
    """Rings from elsewhere as a region."""
    K, B = stiffest_corner(rings)
    return Region(tuple(rings), K, B, None if K > 0.0 else NO_STABLE)


def _same_place(first: Floats, second: Floats) -> bool:
    """Whether two ends are one up to scale: the same motion, geared."""
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return abs(abs(float(first @ second)) - size) <= 1e-12 * size
