"""Columns of a study: a measure at each design's operating point, or a statistic of it over the workspace.

`Requirement`: a lower or an upper bound on a measure.

`over_the_workspace`: averages and extremes of a map.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats
from zwidth.device.device import Device
from zwidth.device.faults import comma_list, nearest
from zwidth.measures.catalogue import find_measure
from zwidth.measures.definition import FAILED, NO_VALUE, OK, Better, Measure, MeasureValues
from zwidth.measures.workspace_statistics import global_conditioning_index, global_isotropy_index, overall
from zwidth.model.argument_checks import wrong_type

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.loop.operating_point import OperatingPoint


# Condition numbers, of which Gosselin and Angeles average the reciprocals.
CONDITIONS: Final = ("isotropy", "isotropy_frobenius", "dynamic_isotropy", "handle_mass_isotropy")


def over_the_workspace(dataset: xr.Dataset, name: str, device: Device | None = None) -> dict[str, float]:
    """Name -> value of the statistics of one measure of a map (`measures.overall.Overall`), such as the average.

    Averages are integrals by the trapezoidal rule: points on the rim of the grid stand for half as much. Condition
    numbers have Gosselin and Angeles's `conditioning_index`, and `isotropy` Stocco's `isotropy_index`, for which
    the device's postures are solved again; without a device it is left out.
    """
    values, status = dataset[name].values, dataset[f"{name}_status"].values
    weights = areas(dataset["x_m"].values, dataset["y_m"].values)
    better = dataset[name].attrs["better"] or None
    summary = dict(vars(overall(values, status, weights, better)))
    if name in CONDITIONS:
        summary["conditioning_index"] = global_conditioning_index(values, status, weights)
    if name == "isotropy" and device is not None and device.mechanism is not None:
        from zwidth.model.posture import solve_posture

        posture = solve_posture(device.mechanism, plane_positions(dataset), dataset.attrs["assembly"])
        freedoms = len(device.mechanism.drives.names)
        summary["isotropy_index"] = global_isotropy_index(posture.jacobian, status, freedoms)
    return summary


def plane_positions(dataset: xr.Dataset) -> Floats:
    """Handle positions (ny, nx, 3) of a map's cells in the base frame [m]."""
    axes = np.asarray(dataset.attrs["plane_axes"], dtype=np.float64).reshape(2, 3)
    through = np.asarray(dataset.attrs["plane_through_m"], dtype=np.float64)
    x, y = dataset["x_m"].values, dataset["y_m"].values
    return np.asarray(through + x[None, :, None] * axes[0] + y[:, None, None] * axes[1])


def areas(x: Floats, y: Floats) -> Floats:
    """Area [m²] that belongs to each point (ny, nx) of a grid of lines x (nx,), y (ny,) [m] by the trapezoidal
    rule.

    >>> areas(np.array([0.0, 1.0, 2.0]), np.array([0.0, 2.0])).tolist()
    [[0.5, 1.0, 0.5], [0.5, 1.0, 0.5]]
    """
    return np.outer(_trapezoids(y), _trapezoids(x))


def _trapezoids(x: Floats) -> Floats:
    """Length that belongs to each point x (n,) by the trapezoidal rule: half of the steps beside it."""
    step = np.diff(x)
    return np.asarray(0.5 * (np.append(step, 0.0) + np.append(0.0, step)))


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
        """Value, status and reason of a column that needs a value at each cell and has none at some: nan, and the
        commonest status of those."""
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
        weights  area of each cell [m²]; None: all equal
        Returns  the statistic of the cells that have a value; nan with the commonest status where none has one,
                 with NO_VALUE where some have and the statistic has none, and with FAILED where it cannot be
                 computed
        """
        assert self.statistic is not None
        try:
            if self.statistic == "conditioning_index":
                value = global_conditioning_index(values.values, values.status, weights)
            elif self.statistic == "isotropy_index":
                cells = point()
                value = global_isotropy_index(cells.jacobian, values.status, len(cells.drives.names))
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
    """The measure, with `better` taken over where the measure leaves open which values are better."""
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


_FORM: Final = re.compile(r"\s*(?P<name>[^<>=\s]*)\s*(?P<sign>[<>=]*)\s*(?P<value>.*?)\s*")


@dataclass(frozen=True)
class Requirement:
    """A bound on a measure.

    at_least  True: the measure must be `value` or more; False: or less
    """

    measure: Measure
    at_least: bool
    value: float

    @property
    def text(self) -> str:
        """The requirement as a user types it: "stiffness_max>=5000"."""
        return f"{self.measure.name}{'>=' if self.at_least else '<='}{self.value:g}"

    def margin(self, values: ArrayLike) -> Floats:
        """Margin by which values meet the bound, in the measure's unit; negative where they do not.

        >>> from zwidth.measures.catalogue import MEASURES
        >>> Requirement(MEASURES["isotropy"], False, 1.5).margin([1.25, 2.0]).tolist()
        [0.25, -0.5]
        """
        beyond = np.asarray(values, dtype=np.float64) - self.value
        return beyond if self.at_least else -beyond

    def met(self, values: ArrayLike) -> Flags:
        """Whether each of the values (...) meets the bound; nan does not."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.margin(values) >= 0.0)


def parse_requirement(text: str, user_measures: Mapping[str, Measure] | None = None) -> Requirement:
    """The requirement written as NAME>=VALUE or NAME<=VALUE, in the measure's unit.

    user_measures  measures of a user's own, by name; a name may carry its unit, stiffness_max_N_per_m
    Raises         ValueError  for another form, a measure that does not exist (the nearest is named), no finite
                   number

    >>> parse_requirement("isotropy <= 1.5").text
    'isotropy<=1.5'
    """
    form = _FORM.fullmatch(text)
    name, sign, number = form.groups() if form else ("", "", "")
    if sign not in ("<=", ">=") or not name:
        raise ValueError(f"{text!r} is not a requirement; write NAME>=VALUE or NAME<=VALUE, such as isotropy<=1.5")
    try:
        value = float(number)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"{text!r}: the bound must be a finite number, got {number!r}")
    return Requirement(find_measure(name, user_measures), sign == ">=", value)
