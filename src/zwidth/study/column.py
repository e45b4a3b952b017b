"""Columns of a study: a measure of each design at its operating point, or over its workspace."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth.device.faults import listed, nearest
from zwidth.measures.catalogue import find_measure
from zwidth.measures.measure import FAILED, NO_VALUE, OK, Measure, Measured
from zwidth.measures.overall import global_conditioning_index, global_isotropy_index, overall
from zwidth.model.arguments import refusal
from zwidth.study.workspace_summary import CONDITIONS

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint

# What is said of it in a figure; does it keep the measure's unit?
OVER: Final[dict[str, tuple[str, bool]]] = {
    "average": ("average", True),
    "worst": ("worst", True),
    "best": ("best", True),
    "uniformity": ("least over largest", False),
    "variation": ("standard deviation over average", False),
    "share": ("share of the workspace with a value", False),
    "conditioning_index": ("mean of the reciprocal", False),
    "isotropy_index": ("global isotropy index", False),
}
JUDGING: Final = ("worst", "best")
OF: Final = {"conditioning_index": CONDITIONS, "isotropy_index": ("isotropy",)}  # others are of any measure


@dataclass(frozen=True)
class Column:
    """What a study asks of each design.

    name     as written: "stiffness_max", "worst(isotropy)"
    measure  the one asked cell by cell
    over     what is made of its values over the workspace; None: asked at the operating point
    """

    name: str
    measure: Measure
    over: str | None = None

    @property
    def unit(self) -> str:
        """Of its values; "" for none."""
        return self.measure.unit if self.over is None or OVER[self.over][1] else ""

    @property
    def title(self) -> str:
        """What it is called in a figure."""
        return self.measure.title if self.over is None else f"{self.measure.title}, {OVER[self.over][0]}"

    @property
    def better(self) -> str | None:
        """What a designer wants: "higher", "lower", or None where that depends."""
        if self.over is None or OVER[self.over][1]:
            return self.measure.better
        return "lower" if self.over == "variation" else "higher"

    @property
    def key(self) -> str:
        """The name with its unit, as a table's column carries it.

        >>> column_named("worst(stiffness_max)").key
        'worst_stiffness_max_N_per_m'
        """
        if self.over is None:
            return self.measure.key
        return f"{self.over}_{self.measure.key if self.unit or not self.measure.unit else self.measure.name}"

    def reduced(
        self, found: Measured, point: OperatingPoint, weights: NDArray[np.float64] | None = None
    ) -> tuple[float, int, str]:
        """Value, status and reason of this design, from the measure's values over its workspace.

        weights  what each cell stands for; None: all alike
        Cells without a value do not count; where none has one, their commonest status is the design's.
        """
        assert self.over is not None
        try:
            if self.over == "conditioning_index":
                value = global_conditioning_index(found.values, found.status, weights)
            elif self.over == "isotropy_index":
                value = global_isotropy_index(point.jacobian, found.status, len(point.drives.names))
            else:
                whole = overall(found.values, found.status, weights, self.measure.better)
                value = float(getattr(whole, self.over))
        except ValueError as error:
            return float("nan"), FAILED, str(error)
        if not np.isnan(value):
            return value, OK, ""
        if (found.status == OK).any():
            return value, NO_VALUE, f"has no {self.over} here"
        kinds, counts = np.unique(found.status, return_counts=True)
        status = int(kinds[np.argmax(counts)])
        return value, status, next((note.reason for note in found.notes if note.status == status), "")


def column_named(name: str, own: Mapping[str, Measure] | None = None) -> Column:
    """The column of a name, such as "isotropy" or "average(isotropy)".

    own     measures of a user's own, by name
    Raises  ValueError  naming the nearest, where there is none

    >>> column_named("average(isotropy)").measure.name
    'isotropy'
    """
    parts = re.fullmatch(r"\s*(\w+)\s*\(\s*([^()]*?)\s*\)\s*", name)
    if parts is None:
        measure = find_measure(name.strip(), own)
        return Column(measure.name, measure)
    over, inner = parts.groups()
    if over not in OVER:
        near = nearest(over, OVER)
        hint = f"did you mean {near}({inner})?" if near else f"there are {listed(list(OVER))}"
        raise ValueError(f"{over} is nothing that is made of a measure over a workspace; {hint}")
    measure = find_measure(inner, own)
    if over in JUDGING and measure.better is None:
        raise ValueError(
            f"{over}({measure.name}): whether more of it is better depends; ask for average({measure.name})"
        )
    if measure.name not in OF.get(over, (measure.name,)):
        raise ValueError(f"{over}({measure.name}): is of {listed(OF[over])} only; ask for average({measure.name})")
    return Column(f"{over}({measure.name})", measure, over)


def measures_listed(measures: Any) -> list[str | Measure]:
    """One measure or several, by name or themselves, as a list. Raises TypeError for anything else.

    >>> measures_listed("isotropy")
    ['isotropy']
    """
    listed = [measures] if isinstance(measures, str | Measure) else measures
    if not isinstance(listed, list | tuple):
        raise refusal("measures", "a name, a Measure or a list of them", measures)
    for one in listed:
        if not isinstance(one, str | Measure):
            raise refusal("measures", "a name, a Measure or a list of them", one)
    return list(listed)
