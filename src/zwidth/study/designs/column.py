"""Columns of a study: a measure at each design's operating point, or a statistic of it over the workspace."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.faults import comma_list, nearest
from zwidth.measures.catalogue import find_measure
from zwidth.measures.definition import FAILED, NO_VALUE, OK, Better, Measure, MeasureValues
from zwidth.measures.overall import global_conditioning_index, global_isotropy_index, overall
from zwidth.model.argument_checks import wrong_type
from zwidth.study.workspace.workspace_summary import CONDITIONS

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint

# Statistics over a workspace -> name in a figure, and whether the result has the measure's unit.
STATISTICS: Final[dict[str, tuple[str, bool]]] = {
    "average": ("average", True),
    "worst": ("worst", True),
    "best": ("best", True),
    "uniformity": ("least over largest", False),
    "variation": ("standard deviation over average", False),
    "share": ("share of the workspace with a value", False),
    "conditioning_index": ("mean of the reciprocal", False),
    "isotropy_index": ("global isotropy index", False),
}
JUDGING: Final = ("worst", "best")  # need to know whether more of the measure is better
OF: Final = {"conditioning_index": CONDITIONS, "isotropy_index": ("isotropy",)}  # the others take any measure


@dataclass(frozen=True)
class Column:
    """One number to compute for each design of a study.

    name       as written in the study: "stiffness_max", "worst(isotropy)"
    measure    the measure that is computed
    statistic  statistic of its values over the workspace; None: the measure at the operating point
    """

    name: str
    measure: Measure
    statistic: str | None = None

    @property
    def unit(self) -> str:
        """Unit of the values; "" for none."""
        return self.measure.unit if self.statistic is None or STATISTICS[self.statistic][1] else ""

    @property
    def title(self) -> str:
        """Label in a figure."""
        return (
            self.measure.title
            if self.statistic is None
            else f"{self.measure.title}, {STATISTICS[self.statistic][0]}"
        )

    @property
    def better(self) -> str | None:
        """Which values are better: "higher", "lower", or None where that depends on the purpose."""
        if self.statistic is None or STATISTICS[self.statistic][1]:
            return self.measure.better
        return "lower" if self.statistic == "variation" else "higher"

    @property
    def key(self) -> str:
        """Name of the table's column, with the unit.

        >>> column_named("worst(stiffness_max)").key
        'worst_stiffness_max_N_per_m'
        """
        if self.statistic is None:
            return self.measure.key
        return f"{self.statistic}_{self.measure.key if self.unit or not self.measure.unit else self.measure.name}"

    def without_value(self, values: MeasureValues) -> tuple[float, int, str]:
        """What a column is that needs a value at each cell and has none at some: nan, their commonest status
        and its reason."""
        kinds, counts = np.unique(values.status[values.status != OK], return_counts=True)
        status = int(kinds[np.argmax(counts)])
        return float("nan"), status, next((note.reason for note in values.notes if note.status == status), "")

    def reduce(
        self,
        values: MeasureValues,
        point: Callable[[], OperatingPoint],
        weights: Floats | None = None,
    ) -> tuple[float, int, str]:
        """Value, status and reason of a design, from the measure's values over its workspace.

        values   the measure at each cell
        point    gives the operating point of all cells; called where the statistic needs more than the values, as
                 to cut one design's point out of those of many takes longer than to measure it
        weights  area of each cell [m^2]; None: all equal
        Returns  the statistic of the cells that have a value; nan with the commonest status where none has one
        """
        assert self.statistic is not None
        try:
            if self.statistic == "conditioning_index":
                value = global_conditioning_index(values.values, values.status, weights)
            elif self.statistic == "isotropy_index":
                own = point()
                value = global_isotropy_index(own.jacobian, values.status, len(own.drives.names))
            else:
                whole = overall(values.values, values.status, weights, self.measure.better)
                value = float(getattr(whole, self.statistic))
        except ValueError as error:
            return float("nan"), FAILED, str(error)
        if not np.isnan(value):
            return value, OK, ""
        if (values.status == OK).any():
            return value, NO_VALUE, f"has no {self.statistic} here"
        kinds, counts = np.unique(values.status, return_counts=True)
        status = int(kinds[np.argmax(counts)])
        return value, status, next((note.reason for note in values.notes if note.status == status), "")


def column_named(
    name: str, user_measures: Mapping[str, Measure] | None = None, better: Better | None = None
) -> Column:
    """The column of a name, such as "isotropy" or "average(isotropy)".

    user_measures  measures of a user's own, by name
    better         which values are better of a measure that leaves it open
    Raises         ValueError  for an unknown name, with the nearest known one

    >>> column_named("average(isotropy)").measure.name
    'isotropy'
    """
    parts = re.fullmatch(r"\s*(\w+)\s*\(\s*([^()]*?)\s*\)\s*", name)
    if parts is None:
        measure = _judged(find_measure(name.strip(), user_measures), better)
        return Column(measure.name, measure)
    over, inner = parts.groups()
    if over not in STATISTICS:
        near = nearest(over, STATISTICS)
        hint = f"did you mean {near}({inner})?" if near else f"there are {comma_list(list(STATISTICS))}"
        raise ValueError(f"{over} is not a statistic over the workspace; {hint}")
    measure = _judged(find_measure(inner, user_measures), better)
    if over in JUDGING and measure.better is None:
        raise ValueError(
            f"{over}({measure.name}): whether more or less is better depends on the purpose; "
            f"write average({measure.name})"
        )
    if measure.name not in OF.get(over, (measure.name,)):
        raise ValueError(
            f"{over}({measure.name}): {over} applies to {comma_list(OF[over])} only; write average({measure.name})"
        )
    return Column(f"{over}({measure.name})", measure, over)


def _judged(measure: Measure, better: Better | None) -> Measure:
    return measure if measure.better is not None or better is None else replace(measure, better=better)


def measure_list(measures: Any) -> list[str | Measure]:
    """Measures given one by one or in a list, as names or `Measure`s, as a list. Raises TypeError for others.

    >>> measure_list("isotropy")
    ['isotropy']
    """
    listed = [measures] if isinstance(measures, str | Measure) else measures
    if not isinstance(listed, list | tuple):
        raise wrong_type("measures", "a name, a Measure or a list of them", measures)
    for one in listed:
        if not isinstance(one, str | Measure):
            raise wrong_type("measures", "a name, a Measure or a list of them", one)
    return list(listed)


def unit_attributes(unit: str) -> dict[str, str]:
    """Attributes that state the unit of a dataset's variable; none where it has no unit.

    xarray labels the axes of its plots by either attribute, and would write [] for an empty one.
    """
    return {"unit": unit, "units": unit} if unit else {}
