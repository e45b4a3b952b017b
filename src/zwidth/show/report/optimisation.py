"""The report on an optimisation: before and after side by side, the front, and how it was found."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from zwidth._version import __version__
from zwidth.chart.chart import stability_chart
from zwidth.chart.edge_by_eigenvalues import ChartError
from zwidth.device.faults import DeviceError
from zwidth.show.figures.caption import caption_of_facts, facts_of_point, facts_of_study
from zwidth.show.figures.optimise import front_figure
from zwidth.show.figures.stability import draw_models
from zwidth.show.figures.style import context, figure
from zwidth.show.moment_units import speaking_of_moments
from zwidth.show.report.figures import both_drawings
from zwidth.show.report.optimisation_text import sentences, short_names
from zwidth.show.report.report import page_template
from zwidth.show.units import percent, printed, quantity
from zwidth.study.designs.sweep_data import axis_value_text
from zwidth.study.optimise.optimisation import Optimisation
from zwidth.study.optimise.optimise import own_values
from zwidth.study.optimise.recheck import worst_point

NONE: Final = "–"


def optimisation_page(found: Optimisation) -> str:
    """The page as HTML; the same text for the same result."""
    with speaking_of_moments(found.study.turns):
        return page_template("optimisation.html.j2").render(
            found=found,
            problem=found.problem,
            word=found.word,
            said=sentences(found),
            before_and_after=_before_and_after(found),
            demands=_demands(found),
            front=_front(found),
            percent=percent,
            picture={"front": Markup(_front_drawing(found)), "charts": Markup(_charts(found))},
            version=__version__,
        )


def _value(number: float, unit: str) -> str:
    return quantity(number, printed(unit)) if np.isfinite(number) else NONE


def _before_and_after(found: Optimisation) -> list[tuple[str, str, str, str]]:
    """Name, before, after and ratio of each variable and of each column, for the chosen design."""
    problem, knee = found.problem, found.knee
    if knee is None:
        return []
    rows, design = [], found.design(knee)
    for axis, own in zip(problem.variables, own_values(problem), strict=True):
        after = design[axis.key]
        number = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (own, after))
        texts = [
            NONE if value is None else quantity(value, printed(axis.unit)) if number else axis_value_text(value)
            for value in (own, after)
        ]
        ratio = f"{after / own:.3g}" if number and own else NONE
        rows.append((axis.key, *texts, ratio))
    for n, one in enumerate(problem.columns):
        after = float(found.values[knee, n])
        before = float("nan") if found.baseline is None else float(found.baseline.values[0, n])
        ratio = f"{after / before:.3g}" if np.isfinite(before) and before and np.isfinite(after) else NONE
        rows.append((f"{one.title} ({one.name})", _value(before, one.unit), _value(after, one.unit), ratio))
    return rows  # type: ignore[return-value]


def _demands(found: Optimisation) -> list[tuple[str, str, str]]:
    """Text, share of designs that keep it, and the best value of each demand."""
    return [
        (one.demand.text, percent(one.kept), _value(one.best, found.problem.columns[one.demand.column].unit))
        for one in found.demands
    ]


def _front(found: Optimisation) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of the front's designs."""
    problem = found.problem
    headings = [*short_names([axis.key for axis in problem.variables]), *(one.name for one in problem.columns)]
    rows = []
    for place in range(len(found.front)):
        design = found.design(place)
        settings = [axis_value_text(design[axis.key]) for axis in problem.variables]
        values = [
            _value(float(value), one.unit) for value, one in zip(found.values[place], problem.columns, strict=True)
        ]
        rows.append([*settings, *values])
    return headings, rows


def _front_drawing(found: Optimisation) -> str:
    if not len(found.front):
        return ""
    caption = caption_of_facts(facts_of_study(found.study), None)
    return both_drawings("front", "The front", lambda width: front_figure(found, width, 3.9), caption)


def _charts(found: Optimisation) -> str:
    """The charts before and after where the first objective is worst; "" where neither can be drawn."""
    if found.knee is None:
        return ""
    charts, caption = {}, list[str]()
    cases: list[tuple[str, dict[str, Any], Any]] = []
    if found.baseline is not None:
        cases.append(("as it is", {}, found.baseline.cells[0]))
    cases.append((found.word, found.settings(found.knee), found.judgement.cells[found.front[found.knee]]))
    for name, design, cells in cases:
        try:
            point = worst_point(found.problem, design, cells)
            charts[name] = stability_chart(point.loop, decay=False).drawn()
        except (DeviceError, ValueError, ChartError):
            continue
        caption = caption_of_facts(facts_of_point(point) | {"position_m": None, "directions": None}, None)
    if not any(chart.regions for chart in charts.values()):
        return ""

    corners = np.array([chart.box for chart in charts.values() if chart.regions])
    low, high = corners[:, ::2].min(axis=0), corners[:, 1::2].max(axis=0)
    window = (low[0], high[0], low[1], high[1])

    def draw(width: float) -> Figure:
        made, ax = figure(width, 3.7)
        with context():
            draw_models(ax, charts, window)
        return made

    return both_drawings("charts", "Stability charts before and after", draw, caption)
