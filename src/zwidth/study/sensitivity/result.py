"""Results of a sensitivity analysis: of each number, of numbers scaled together, and the stiffest wall.

`number_obstacle`: which numbers of a device file have no derivative.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite, nan
from typing import Any, Final

from zwidth.chart.area import Peak
from zwidth.device.faults import KeyPath
from zwidth.device.schema import device_file as schema
from zwidth.result import Documented, Result, documented, entry
from zwidth.study.sensitivity.optimum import Kind

COLUMNS: Final = (
    "path",
    "value",
    "unit",
    "d_ln_stiffness_max_d_ln_value",
    "d_stiffness_max_d_value_N_per_m",
    "one_percent_gives_N_per_m",
    "error",
    "side",
    "reason",
)
NOTHING: Final = 1e-8  # a smaller sensitivity is rounding of 0
TIE: Final = 1e-5  # relative difference below which two extreme points of the edge are equally stiff


@dataclass(frozen=True)
class Sensitivity:
    """Sensitivity of the largest stiffness to one number.

    path         of the number in the device file; an element of a symmetric matrix moves with its mirror image
    value        the number
    unit         as the schema names it; "" if it has none
    logarithmic  d ln K_max / d ln value; nan for the value 0, and where it could not be computed
    derivative   dK_max/dvalue [N/m per unit of the value]; nan where it could not be computed
    error        estimated error of `logarithmic`, for the value 0 of `derivative`
    side         "both"; "above" or "below" where only the derivative towards larger or smaller numbers exists; ""
                 where none does
    reason       why a result is missing; "" where none is
    """

    path: str
    value: float
    unit: str
    logarithmic: float
    derivative: float
    error: float
    side: str = "both"
    reason: str = ""


@dataclass(frozen=True)
class Group(Documented):
    """Numbers scaled together: a whole list or matrix, or one key of all links (a * in its path).

    path         of the list, or with * for the names
    members      paths of its numbers
    logarithmic  d ln K_max / d ln of the common factor: the sum of the members'; nan where it is not known
    """

    path: str = field(metadata=entry())
    members: tuple[str, ...] = field(metadata=entry())
    logarithmic: float = field(metadata=entry(name="d_ln_stiffness_max_d_ln_value"))


def _peak_wall(peak: Peak | None) -> dict[str, float | None]:
    """What a document says of the stiffest wall; None where there is none."""
    stiffness, damping = (None, None) if peak is None else (peak.stiffness, peak.damping)
    return {"stiffness_max_N_per_m": stiffness, "damping_at_stiffness_max_Ns_per_m": damping}


def _reasons(left_out: dict[str, str]) -> list[dict[str, str]]:
    """What a document says of the numbers left out."""
    return [{"path": path, "reason": reason} for path, reason in left_out.items()]


@dataclass(frozen=True, repr=False)
class Sensitivities(Result):
    """Sensitivities of the largest stiffness to all numbers, and the wall that has it.

    peak         the stiffest wall; None where no wall is stable; then there are no numbers and groups
    kind         which part of the edge it lies on (see `study.sensitivity.optimum`); None where that is not known
    numbers      largest |logarithmic| first, then those without a logarithm
    groups       largest first
    left_out     path -> why the number is not a property of the device
    second_peak  largest stiffness of another, separate extreme point of the edge [N/m]; nan if there is none. It
                 takes over as soon as a change makes it the stiffer one.
    """

    peak: Peak | None = field(metadata=entry(value=_peak_wall, spread=True, before="second_peak"))
    kind: Kind | None = field(metadata=entry(name="held_by", before="second_peak"))
    numbers: tuple[Sensitivity, ...]
    groups: tuple[Group, ...] = field(metadata=entry())
    left_out: dict[str, str] = field(metadata=entry(value=_reasons))
    second_peak: float = field(metadata=entry("N/m", name="rival_stiffness"))

    def document(self) -> dict[str, Any]:
        """The sensitivities by key and unit, with the wall they are about; None where there is none."""
        return {"sensitivities": self._entries()} | super().document()

    def table(self) -> dict[str, list[Any]]:
        """The sensitivities as columns, one number a row."""
        rows = self._entries()
        return {column: [row[column] for row in rows] for column in COLUMNS}

    def __repr__(self) -> str:
        if self.peak is None:
            return "Sensitivities: no stable wall has K > 0 and B >= 0"
        first = ", ".join(f"{path} {value:+.4g}" for path, value in self.ranking[:3])
        stiffest = f"the largest stiffness, {self.peak.stiffness:.6g} N/m, to {len(self.numbers)} numbers"
        return f"Sensitivities of {stiffest}\n  per cent for one per cent: {first or 'none'}"

    def _entries(self) -> list[dict[str, Any]]:
        """The sensitivities by key and unit, one dictionary for each number."""
        stiffness = nan if self.peak is None else self.peak.stiffness
        return [
            {
                "path": one.path,
                "value": one.value,
                "unit": one.unit or None,
                "d_ln_stiffness_max_d_ln_value": one.logarithmic,
                "d_stiffness_max_d_value_N_per_m": one.derivative,
                "one_percent_gives_N_per_m": 0.01 * one.logarithmic * stiffness,
                "error": one.error,
                "side": one.side or None,
                "reason": one.reason or None,
            }
            for one in self.numbers
        ]

    @property
    def ranking(self) -> tuple[tuple[str, float], ...]:
        """Path and logarithmic sensitivity of each number, or of a list or matrix scaled as a whole; largest
        first, without those that are not known or have no influence."""
        lists = [group for group in self.groups if "*" not in group.path]
        members = {path for group in lists for path in group.members}
        single = [(number.path, number.logarithmic) for number in self.numbers if number.path not in members]
        pairs = [*single, *((group.path, group.logarithmic) for group in lists)]
        influential = [(path, value) for path, value in pairs if abs(value) > NOTHING]
        return tuple(sorted(influential, key=lambda pair: -abs(pair[1])))

    @property
    @documented(name="one_sided")
    def tie(self) -> bool:
        """Whether two walls are stiffest at once; each derivative then holds for `peak` alone."""
        return self.peak is not None and bool(self.second_peak >= (1.0 - TIE) * self.peak.stiffness)


def number_obstacle(steps: KeyPath, value: float) -> str:
    """Why a number has no derivative whatever the device; "" if it may have one."""
    if not isfinite(value):
        return "it is infinite, and one per cent of it is no change"
    whole = any(subschema.get("type") == "integer" for subschema in schema.subschemas(steps))
    return "it is a whole number, which has no derivative" if whole else ""
