"""Figures of identifications: what was measured and what the fitted device says of it, by the kind."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from zwidth.identify.identification import Identification
from zwidth.show.figures.style import draw_empty, figure

DRAWN_AS: Final = {"mass": "friction"}  # one fit finds both


def draw_identification(ax: Axes, result: Identification) -> None:
    """One identification into axes; where nothing was fitted the reason."""
    if result.reason is not None:
        draw_empty(ax, "nothing was fitted")
        return
    kind = DRAWN_AS.get(result.kind, result.kind)
    draw: Callable[[Axes, Identification], None] = getattr(
        import_module(f"zwidth.show.figures.identify_{kind}"), f"draw_{kind}"
    )
    draw(ax, result)


def identification_figure(result: Identification, width: float = 5.6, height: float = 3.9) -> Figure:
    """One identification as a figure of its own [inches]."""
    made, ax = figure(width, height)
    draw_identification(ax, result)
    return made
