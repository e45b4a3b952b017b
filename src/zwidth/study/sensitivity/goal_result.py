"""What each number of a device would have to be for a wanted largest stiffness: the result."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, log
from typing import Any, Final, Literal

from zwidth.result import Result

Status = Literal["reached", "out of range", "no influence"]
REACHED: Final = "reached"
OUT_OF_RANGE: Final = "out of range"
NO_INFLUENCE: Final = "no influence"
ORDER: Final = (REACHED, OUT_OF_RANGE, NO_INFLUENCE)
COLUMNS: Final = ("path", "value_now", "unit", "value", "factor", "stiffness_max_N_per_m", "status", "reason")


@dataclass(frozen=True)
class GoalNumber:
    """What one number would have to be.

    path           of the number in the device file; an element of a symmetric matrix moves with its mirror image
    now            its value in the device
    unit           as the schema names it; "" if it has none
    value          the value nearest to that with which the goal is reached; where it is out of range the one that
                   comes nearest to the goal; nan where the number has no influence, or cannot be varied
    factor         value over now; nan where that is 0, or where there is no value
    stiffness_max  largest stiffness with this value [N/m]
    status         "reached", "out of range" or "no influence"
    reason         what keeps the goal from being reached; "" where it is
    """

    path: str
    now: float
    unit: str
    value: float
    factor: float
    stiffness_max: float
    status: Status
    reason: str = ""

    @property
    def distance(self) -> float:
        """|ln factor|; inf where there is none."""
        return abs(log(self.factor)) if isfinite(self.factor) and self.factor > 0.0 else float("inf")


@dataclass(frozen=True, repr=False)
class Goal(Result):
    """What each number of a device would have to be, the others as they are, for a wanted largest stiffness.

    goal           the wanted largest stiffness [N/m]
    stiffness_max  that of the device as it is [N/m]; 0 where no wall with K > 0 and B >= 0 is stable
    numbers        those that reach it first, the smallest change before the others
    """

    goal: float
    stiffness_max: float
    numbers: tuple[GoalNumber, ...]

    @property
    def reached(self) -> tuple[GoalNumber, ...]:
        """The numbers with which alone the goal can be reached."""
        return tuple(one for one in self.numbers if one.status == REACHED)

    def entries(self) -> list[dict[str, Any]]:
        """Each number as a document."""
        return [
            {
                "path": one.path,
                "value_now": one.now,
                "unit": one.unit or None,
                "value": one.value,
                "factor": one.factor,
                "stiffness_max_N_per_m": one.stiffness_max,
                "status": one.status,
                "reason": one.reason or None,
            }
            for one in self.numbers
        ]

    def document(self) -> dict[str, Any]:
        """The numbers by key and unit, with the goal and the largest stiffness as it is."""
        return {
            "goal_N_per_m": self.goal,
            "stiffness_max_N_per_m": self.stiffness_max,
            "goal": self.entries(),
        }

    def table(self) -> dict[str, list[Any]]:
        """One number a row."""
        rows = self.entries()
        return {column: [row[column] for row in rows] for column in COLUMNS}

    def __repr__(self) -> str:
        first = ", ".join(f"{one.path} = {one.value:.4g}" for one in self.reached[:3])
        heading = f"Goal: a largest stiffness of {self.goal:.6g} N/m, now {self.stiffness_max:.6g} N/m"
        return f"{heading}\n  {first or 'no number reaches it alone'}"
