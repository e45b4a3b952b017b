"""What some measures must be told besides the device: the wall to be rendered, its margins, a force, a band.

Each number is an argument in Python, a key of a study file, an option of `zwidth map` and an axis of a study.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Final

from zwidth.arrays import Floats

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class WantedNumber:
    """A number that some measures need.

    name      argument in Python and field of `WantedWall`
    key       in a study file
    unit      "" for none
    meaning   what it is
    least, most  limits of its value
    open_end  whether the least value itself is not allowed
    """

    name: str
    key: str
    unit: str
    meaning: str
    least: float = 0.0
    most: float = float("inf")
    open_end: bool = False

    @property
    def checked(self) -> bool:
        """Whether measures refuse a value outside; walls of either sign have spectral radii, too."""
        return self.name not in ("stiffness", "damping")

    @property
    def allowed(self) -> str:
        """The allowed values in words.

        >>> WANTED_BY_NAME["frequency"].allowed, WANTED_BY_NAME["spectral_radius"].allowed
        ('above 0', 'above 0 and at most 1')
        """
        low = f"above {self.least:g}" if self.open_end else f"at least {self.least:g}"
        return f"{low} and at most {self.most:g}" if isfinite(self.most) else low

    def allows(self, value: float) -> bool:
        """Whether a value is finite and within the limits."""
        above = self.least < value if self.open_end else self.least <= value
        return isfinite(value) and above and value <= self.most


WANTED_NUMBERS: Final = (
    WantedNumber("stiffness", "stiffness_N_per_m", "N/m", "of the wanted wall"),
    WantedNumber("damping", "damping_Ns_per_m", "N s/m", "of the wanted wall"),
    WantedNumber("frequency", "frequency_Hz", "Hz", "at which the hand moves", open_end=True),
    WantedNumber(
        "spectral_radius",
        "spectral_radius",
        "",
        "that the wall must not exceed: vibration shrinks at least by it per sample",
        most=1.0,
        open_end=True,
    ),
    WantedNumber("stiffness_margin", "stiffness_margin", "", "share by which the wall's stiffness may be off"),
    WantedNumber("damping_margin", "damping_margin", "", "share by which the wall's damping may be off"),
    WantedNumber("delay_margin", "delay_margin_samples", "samples", "by which the delay may be longer", most=20.0),
    WantedNumber(
        "lowest_frequency", "lowest_frequency_Hz", "Hz", "lower end of the band of motion", open_end=True
    ),
    WantedNumber(
        "highest_frequency", "highest_frequency_Hz", "Hz", "upper end of the band of motion", open_end=True
    ),
    WantedNumber("force", "force_N", "N", "to be held along the rendered direction"),
    WantedNumber("link_radius", "link_radius_m", "m", "of the links, taken for rods with round ends"),
)
WANTED_BY_NAME: Final = {one.name: one for one in WANTED_NUMBERS}
WANTED_BY_KEY: Final = {one.key: one for one in WANTED_NUMBERS}


@dataclass(frozen=True)
class WantedWall:
    """The wall to be rendered and what is asked of it, which some measures need; None where a number is not given.

    stiffness, damping  [N/m], [N s/m]
    frequency           at which the hand moves on it [Hz]
    spectral_radius     that the wall must not exceed
    stiffness_margin, damping_margin  shares by which stiffness and damping may be off
    delay_margin        by which the delay may be longer [samples]
    lowest_frequency, highest_frequency  of a band of motion [Hz]
    force               to be held [N]
    link_radius         of the links, taken for rods with round ends [m]
    colliding_links     pairs of links that can collide, each "A:B"; None: all that are no neighbours
    """

    stiffness: float | None = None
    damping: float | None = None
    frequency: float | None = None
    spectral_radius: float | None = None
    stiffness_margin: float | None = None
    damping_margin: float | None = None
    delay_margin: float | None = None
    lowest_frequency: float | None = None
    highest_frequency: float | None = None
    force: float | None = None
    link_radius: float | None = None
    colliding_links: tuple[str, ...] | None = None


@dataclass(frozen=True)
class WantedWalls:
    """The wall to be rendered by each of many designs, for measures that take designs all at once.

    Each number as in `WantedWall`, of shape (...), which broadcasts with the points; None where it is not given.
    """

    stiffness: Floats | None = None
    damping: Floats | None = None
    frequency: Floats | None = None
    spectral_radius: Floats | None = None
    stiffness_margin: Floats | None = None
    damping_margin: Floats | None = None
    delay_margin: Floats | None = None
    lowest_frequency: Floats | None = None
    highest_frequency: Floats | None = None
    force: Floats | None = None
    link_radius: Floats | None = None
    colliding_links: tuple[str, ...] | None = None
