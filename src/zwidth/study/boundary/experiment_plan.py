"""Plan of a virtual experiment: what is measured, by how many operators, and in which range of walls."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

from zwidth.contact.boundary_experiment import SearchWindow
from zwidth.contact.stability_trial import TrialError

FARTHEST, FASTEST = 1.0, 100.0  # m, m/s; largest disturbance and speed allowed
PUSH: Final = 2.0  # N; default push on a one-sided wall
SPEED: Final = 0.02  # m/s; default speed of the touch


@dataclass(frozen=True)
class Plan:
    """What a virtual experiment measures.

    one_sided    touch a one-sided wall with `push` [N] and `speed` [m/s]; else displace by `disturbance` [m]
    stiffnesses  number of stiffnesses at which the damping is bisected, for the lower and the upper edge
    tips         number of dampings at which the stiffness is bisected
    visible      amplitude that counts as a vibration, see `StabilityTrial` [m]; None: three encoder steps and ten
                 standard deviations of the noise
    reflex       the hand stiffens threefold, 50 ms after half of the push is felt
    subjects, trials  number of operators, and of trials of each
    spread, seed      of the numbers of operators and trials: see `study.boundary.experiment`
    box          range of walls to search; None: no limit
    Raises       TrialError  for a number outside its allowed range
    """

    one_sided: bool = False
    stiffnesses: int = 16
    tips: int = 8
    disturbance: float = 1e-3
    visible: float | None = None
    push: float = 0.0
    speed: float = 0.0
    reflex: bool = False
    subjects: int = 1
    trials: int = 1
    spread: float = 0.2
    seed: int = 1
    box: SearchWindow | None = None

    def __post_init__(self) -> None:
        for name, least in (("stiffnesses", 1), ("tips", 0), ("subjects", 1), ("trials", 1), ("seed", 0)):
            if getattr(self, name) < least:
                raise TrialError(name, f"must be {least} or more, got {getattr(self, name)}")
        for name, most, unit in (("disturbance", FARTHEST, "m"), ("speed", FASTEST, "m/s")):
            if isfinite(getattr(self, name)) and abs(getattr(self, name)) > most:
                raise TrialError(name, f"must be {most:g} {unit} or less, got {getattr(self, name):g}")
        if not (isfinite(self.spread) and 0.0 <= self.spread <= 2.0):
            raise TrialError("spread", f"must be from 0 to 2, got {self.spread!r}; 0.2 is 20 %")
        if not isfinite(self.push):
            raise TrialError("push", f"must be finite [N], got {self.push!r}")

    @classmethod
    def touching(cls, *, push: float = PUSH, speed: float = SPEED, **more: Any) -> Plan:
        """A plan that touches a one-sided wall, with the default push [N] and speed [m/s] where none is given.

        more  further arguments of `Plan`

        >>> Plan.touching(tips=3).push
        2.0
        """
        return cls(one_sided=True, push=push, speed=speed, **more)
