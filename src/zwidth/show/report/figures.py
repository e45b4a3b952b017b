"""The report's figures, each as two <svg> elements: one for a page, one drawn narrower for a phone."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from zwidth.chart.chart import StabilityChart
from zwidth.measures.felt import FeltChart
from zwidth.show.figures.felt import draw_felt_chart
from zwidth.show.figures.load_path import load_path_figure
from zwidth.show.figures.mechanism_motion import draw_chain, draw_mechanism
from zwidth.show.figures.sensitivity import draw_sensitivities, draw_validity
from zwidth.show.figures.stability import draw_chart, draw_decay_contours, draw_frequency, draw_models
from zwidth.show.figures.style import context, figure, inline_svg
from zwidth.show.mechanism_scene import as_chain
from zwidth.show.report.facts import Facts
from zwidth.study.model_validity import Validity

TOP = 10  # bars of sensitivities
WIDTHS: Final = {"wide": 6.2, "narrow": 3.75}  # class of the page's style sheet -> width [inches]


def svg_figures(facts: Facts) -> dict[str, str]:
    """Name -> HTML of both drawings, wide and narrow; "" for a figure that does not apply to this device."""
    device, chart, plant = facts.device, facts.chart, facts.loop.plant
    drawn = {
        "chart": _svg("chart", "Stability chart: stable walls", lambda ax: draw_chart(ax, chart))
        if chart.regions
        else "",
        "models": _svg(
            "models", "Stability charts of simpler models", lambda ax: draw_models(ax, _charts_of_models(facts))
        ),
        "frequency": _svg(
            "frequency", "Frequency along the edge of stability", lambda ax: draw_frequency(ax, chart), 3.2
        )
        if facts.renders
        else "",
        "decay": _svg(
            "decay", "Contours of equal decay", lambda ax: draw_decay_contours(ax, facts.loop, chart=chart)
        )
        if chart.regions
        else "",
        "device": "",
        "load": _load_path(facts),
        "felt": _felt(facts, facts.felt) if facts.renders else "",
        "sensitivities": _sensitivities(facts),
        "validity": _validity(facts, facts.validity),
    }
    if facts.posture is not None and facts.direction is not None:
        posture, direction = facts.posture, facts.direction
        drawn["device"] = _svg(
            "device",
            "The mechanism in its posture",
            lambda ax: draw_mechanism(ax, device, posture, direction),
            4.4,
        )
    elif (chain := as_chain(plant)) is not None:
        drawn["device"] = _svg("device", "The plant", lambda ax: draw_chain(ax, plant, chain), 2.0)
    return drawn


def _load_path(facts: Facts) -> str:
    """Drawings of the charts under pushes; "" for a device without load."""
    path = facts.load_path
    if path is None:
        return ""
    description = "Charts under pushes of the hand to both sides"
    return both_drawings("load", description, lambda width: load_path_figure(path, width, 4.6))


def _felt(facts: Facts, felt: FeltChart | None) -> str:
    """Drawings of the chart at felt stiffness; "" where what is felt is what is commanded."""
    if felt is None or not isfinite(felt.limit) or not felt.regions:
        return ""
    return _svg("felt", "Stable walls at the stiffness that is felt", lambda ax: draw_felt_chart(ax, felt))


def _sensitivities(facts: Facts) -> str:
    """Drawings of the sensitivities as bars; "" where there are none."""
    rows = len(facts.sensitivities.ranking[:TOP])
    if not rows:
        return ""
    # inches
    height, narrow_height = (0.8 + row * max(rows, 2) for row in (0.24, 0.33))  # paths on two lines
    return _svg(
        "sensitivities",
        "Sensitivity of the largest stiffness to each number",
        lambda ax: draw_sensitivities(ax, facts.sensitivities, TOP, grouped=True),
        height,
        narrow_height,
    )


def _validity(facts: Facts, fits: Validity | None) -> str:
    """Drawings of the error of simpler models; "" where none is known."""
    if fits is None or not len(fits.frequency) or not any(len(fit.error) for fit in fits.fits):
        return ""
    return _svg("validity", "Error of simpler models by frequency", lambda ax: draw_validity(ax, fits))


def _charts_of_models(facts: Facts) -> dict[str, StabilityChart]:
    """Charts by their labels: the device as described, then its models."""
    given = "as described" if facts.model == "full" else f"as described: {facts.model} model"
    own = f"model-{facts.model}"
    others = [variant for variant in facts.variants if variant.key.startswith("model-") and variant.key != own]
    return {
        given: facts.chart,
        **{variant.label: variant.chart for variant in others if variant.chart is not None},
    }


def _svg(
    name: str,
    description: str,
    draw: Callable[[Axes], None],
    height: float = 3.7,
    narrow_height: float | None = None,
) -> str:
    """Both drawings of a figure with one pair of axes, as `both_drawings`.

    draw                   draws into these axes
    height, narrow_height  of the wide and of the narrow one [inches]; None: the same
    """
    heights = {WIDTHS["wide"]: height, WIDTHS["narrow"]: narrow_height or height}

    def drawn(width: float) -> Figure:
        drawing, ax = figure(width, heights[width])
        draw(ax)
        return drawing

    return both_drawings(name, description, drawn)


def both_drawings(name: str, description: str, draw: Callable[[float], Figure]) -> str:
    """Both drawings of a figure as HTML; the style sheet shows the one that suits the screen.

    The caption is the page's, below them: device, posture and computer stand once, at its head.

    name, description  id of the <svg> elements, and what they show for those who cannot see them
    draw               makes the figure of a width [inches]
    """
    drawings = []
    for kind, width in WIDTHS.items():
        with context():
            drawing = inline_svg(draw(width), f"{name}-{kind}", description)
        drawings.append(f'<div class="{kind}">{drawing}</div>')
    return "\n".join(drawings)
