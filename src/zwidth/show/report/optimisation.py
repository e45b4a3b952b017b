"""The report on an optimisation: before and after side by side, the front, and how it was found.

What an optimisation found, in sentences.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from zwidth._version import __version__
from zwidth.chart.chart import stability_chart
from zwidth.device.faults import comma_list, plural
from zwidth.errors import ChartError, DeviceError
from zwidth.measures.definition import FAILED, OUT_OF_TIME
from zwidth.show.figures.caption import caption_of_facts, facts_of_study
from zwidth.show.figures.optimise import front_figure
from zwidth.show.figures.stability import draw_models
from zwidth.show.figures.style import context, figure
from zwidth.show.report.figures import both_drawings
from zwidth.show.report.report import page_template
from zwidth.show.units import percent, quantity, speaking_of_moments
from zwidth.study.designs.sweep import axis_value_text
from zwidth.study.optimisation.evaluation import margins
from zwidth.study.optimisation.optimisation import Optimisation, worst_point
from zwidth.study.optimisation.optimise import own_values

NONE: Final = "–"


def optimisation_page(found: Optimisation) -> str:
    """The page as HTML; the same text for the same result."""
    with speaking_of_moments(found.study.turns):
        return page_template("optimisation.html.j2").render(
            found=found,
            problem=found.problem,
            word=found.word,
            said=optimisation_sentences(found),
            before_and_after=_before_and_after(found),
            demands=_demands(found),
            front=_front_table(found),
            percent=percent,
            setting="; ".join(caption_of_facts(facts_of_study(found.study), None)),
            picture={"front": Markup(_front_drawing(found)), "charts": Markup(_charts_drawing(found))},
            version=__version__,
        )


def _value_text(number: float, unit: str) -> str:
    """A value with its unit; a dash where it is not finite."""
    return quantity(number, unit) if np.isfinite(number) else NONE


def _before_and_after(found: Optimisation) -> list[tuple[str, str, str, str]]:
    """Name, before, after and ratio of each variable and of each column, as texts; [] without a front.

    before   of the device as it is; after  of the design at the knee of the front
    """
    problem, knee = found.problem, found.knee
    if knee is None:
        return []
    rows, design = [], found.design(knee)
    for axis, as_is in zip(problem.variables, own_values(problem), strict=True):
        after = design[axis.key]
        is_number = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (as_is, after))
        texts = [
            NONE if value is None else quantity(value, axis.unit) if is_number else axis_value_text(value)
            for value in (as_is, after)
        ]
        ratio = f"{after / as_is:.3g}" if is_number and as_is else NONE
        rows.append((axis.key, *texts, ratio))
    for n, column in enumerate(problem.columns):
        after = float(found.values[knee, n])
        before = float("nan") if found.baseline is None else float(found.baseline.values[0, n])
        ratio = f"{after / before:.3g}" if np.isfinite(before) and before and np.isfinite(after) else NONE
        rows.append(
            (
                f"{column.title} ({column.name})",
                _value_text(before, column.unit),
                _value_text(after, column.unit),
                ratio,
            )
        )
    return rows  # type: ignore[return-value]


def _demands(found: Optimisation) -> list[tuple[str, str, str]]:
    """Of each demand its text, the share of designs that keep it, and the best value of a design, as texts."""
    return [
        (
            result.demand.text,
            percent(result.kept),
            _value_text(result.best, found.problem.columns[result.demand.column].unit),
        )
        for result in found.demands
    ]


def _front_table(found: Optimisation) -> tuple[list[str], list[list[str]]]:
    """Headings of a table, and a row of texts for each design of the front: its variables, then its columns."""
    problem = found.problem
    headings = [
        *short_names([axis.key for axis in problem.variables]),
        *(column.name for column in problem.columns),
    ]
    rows = []
    for place in range(len(found.front)):
        design = found.design(place)
        settings = [axis_value_text(design[axis.key]) for axis in problem.variables]
        values = [
            _value_text(float(value), column.unit)
            for value, column in zip(found.values[place], problem.columns, strict=True)
        ]
        rows.append([*settings, *values])
    return headings, rows


def _front_drawing(found: Optimisation) -> str:
    """Drawings of the front; "" without any design in it."""
    if not len(found.front):
        return ""
    return both_drawings("front", "The front", lambda width: front_figure(found, width, 3.9))


def _charts_drawing(found: Optimisation) -> str:
    """The charts before and after where the first objective is worst; "" where neither can be drawn."""
    if found.knee is None:
        return ""
    charts = {}
    cases: list[tuple[str, dict[str, Any], Any]] = []  # name, settings, and values in all postures, by column
    if found.baseline is not None:
        cases.append(("as it is", {}, found.baseline.cells[0]))
    cases.append((found.word, found.settings(found.knee), found.judgement.cells[found.front[found.knee]]))
    for name, design, cells in cases:
        try:
            point = worst_point(found.problem, design, cells)
            charts[name] = stability_chart(point.loop, decay=False).drawn()
        except (DeviceError, ValueError, ChartError):
            continue  # the other one is drawn alone
    if not any(chart.regions for chart in charts.values()):
        return ""

    # each box is K from and to, B from and to
    corners = np.array([chart.box for chart in charts.values() if chart.regions])
    low, high = corners[:, ::2].min(axis=0), corners[:, 1::2].max(axis=0)
    window = (low[0], high[0], low[1], high[1])

    def draw(width: float) -> Figure:
        drawing, ax = figure(width, 3.7)
        with context():
            draw_models(ax, charts, window)
        return drawing

    return both_drawings("charts", "Stability charts before and after", draw)


WITHOUT: Final = {FAILED: "failed", OUT_OF_TIME: "ran out of time"}
SMALL: Final = 5e-4  # share of a value that is said to be no change


def optimisation_sentences(found: Optimisation) -> list[str]:
    """Sentences on the front: how it was found, what the chosen design gains, what it is conditional on, and
    what a finer grid and simulation say. Where no design keeps the demands, why not."""
    tried = plural(len(found.shares), "design")
    if not len(found.front):
        return [f"{tried} tried: {found.reason}", *_unjudged_sentences(found)]
    sentences = [
        _how_found_text(found, tried),
        _gain_sentence(found),
        *_unjudged_sentences(found),
        *(premise["reason"] for premise in found.premises),
        *_finer_grid_sentences(found),
        *_tolerance_sentences(found),
        *_contact_sentences(found),
    ]
    return [sentence for sentence in sentences if sentence]


def _how_found_text(found: Optimisation, tried: str) -> str:
    """What the shown designs are of all that were tried, as a part of a sentence."""
    if len(found.problem.objectives) == 1:
        return f"the best found of {tried} tried"
    return f"{plural(len(found.front), 'design')} of the front, of {tried} tried"


def _gain_sentence(found: Optimisation) -> str:
    """Sentence on the objectives of the chosen design, beside those of the device as it is."""
    problem, knee = found.problem, found.knee
    assert knee is not None
    chosen = "the best design found" if len(problem.objectives) == 1 else "the knee"
    parts = []
    for objective in problem.objectives:
        column, value = problem.columns[objective.column], float(found.values[knee, objective.column])
        part = f"{column.name} {quantity(value, column.unit)}"
        if found.baseline is not None and np.isfinite(before := float(found.baseline.values[0, objective.column])):
            part += f" instead of {quantity(before, column.unit)}"
        parts.append(part)
    return f"{chosen} has {comma_list(parts)}"


def _unjudged_sentences(found: Optimisation) -> list[str]:
    """How many designs failed or ran out of time, and why, unless that is why there is no front; and whether the
    device as it is did."""
    sentences = [
        f"{group.designs} of {plural(len(found.shares), 'design')} {WITHOUT[group.status]}"
        + (f": {group.reason}" if group.reason else "")
        for group in found.not_judged
        if not group.reason or group.reason not in (found.reason or "")
    ]
    of_baseline = [] if found.baseline is None else found.baseline.status[0].tolist()
    return sentences + [f"the device as it is {verb}" for status, verb in WITHOUT.items() if status in of_baseline]


def _finer_grid_sentences(found: Optimisation) -> list[str]:
    """What the worst values become on a finer grid of postures and directions; [] where none was computed."""
    if found.finer is None:
        return []
    problem, sentences = found.problem, []
    for n, column in enumerate(problem.columns):
        fine, coarse = found.finer.values[:, n], found.values[:, n]
        if np.isnan(fine).any():
            lost = plural(int(np.isnan(fine).sum()), "design")
            sentences.append(f"on a grid twice as fine {column.name} has no value in {lost}")
            continue
        change = float(np.max(np.abs(fine - coarse) / np.maximum(np.abs(coarse), 1e-300)))
        if change > SMALL:
            sentences.append(f"on a grid twice as fine {column.name} changes by at most {percent(change)}")
    for demand in problem.demands:
        with np.errstate(invalid="ignore"):
            kept = margins(found.finer.values[:, demand.column], demand.bound, demand.at_least) >= 0.0
        if broken := int((~kept).sum()):  # a design without a value breaks it, too
            verb = "breaks" if broken == 1 else "break"
            sentences.append(f"on a grid twice as fine {plural(broken, 'design')} {verb} {demand.text}")
    return sentences or ["a grid twice as fine gives the same values"]


def _tolerance_sentences(found: Optimisation) -> list[str]:
    """How many devices within tolerances of the chosen design keep the demands, and their objectives' ranges.

    [] where no tolerances were drawn
    """
    bars, knee, problem = found.bars, found.knee, found.problem
    if bars is None or knee is None:
        return []
    chosen = "the best design found" if len(problem.objectives) == 1 else "the knee"
    kept = percent(float(bars.kept[knee]))
    sentences = [f"{kept} of {bars.devices} devices within the tolerances of {chosen} keep all demands"]
    if not problem.demands:
        sentences = [f"{bars.devices} devices were drawn within the tolerances of {chosen}"]
    for objective in problem.objectives:
        column = problem.columns[objective.column]
        low, high = (float(array[knee, objective.column]) for array in (bars.low, bars.high))
        if np.isfinite(low):
            span = f"{quantity(low, column.unit)} to {quantity(high, column.unit)}"
            sentences.append(f"90 % of them have {column.name} {span}")
    return sentences


def _contact_sentences(found: Optimisation) -> list[str]:
    """In how many designs simulation finds the wall stable, and how many could not be simulated; [] without."""
    done = [contact for contact in found.contacts if not contact.reason]
    sentences = []
    if done:
        stable = sum(contact.stable is True for contact in done)
        wall = (
            "the wanted wall"
            if found.study.wall.stiffness is not None
            else "a wall of 90 % of the largest stiffness"
        )
        sentences.append(
            f"{wall}, simulated with friction, encoder steps and limits where the design is worst, is stable in "
            f"{stable} of {plural(len(done), 'design')}"
        )
    missed = [contact for contact in found.contacts if contact.reason]
    if missed:
        sentences.append(f"{plural(len(missed), 'design')} could not be simulated: {missed[0].reason}")
    return sentences


def short_names(paths: Sequence[str]) -> list[str]:
    """The shortest end of each path that begins with a name and tells it from the others.

    >>> short_names(["links.a.length_m", "links.b.length_m", "loop.delay_s", "plant.mass_kg.0.1"])
    ['a.length_m', 'b.length_m', 'delay_s', 'mass_kg.0.1']
    """
    names = []
    for path in paths:
        steps = path.split(".")
        ends = (".".join(steps[-n:]) for n in range(1, len(steps) + 1) if not steps[-n].isdigit())
        others = [other for other in paths if other != path]
        names.append(next((end for end in ends if not any(f".{one}".endswith(f".{end}") for one in others)), path))
    return names
