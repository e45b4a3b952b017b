"""Reports without their drawings, for tests of what stands beside them: drawing takes half of a report's time."""

from __future__ import annotations

from html import escape

import pytest
from matplotlib.figure import Figure


def leave_undrawn(patch: pytest.MonkeyPatch) -> None:
    """Let reports make all their figures as ever, and put their texts and lines in place of the drawings."""
    patch.setattr("zwidth.show.report.figures.inline_svg", listed_svg)


def listed_svg(made: Figure, name: str, description: str) -> str:
    """What a figure holds, as an <svg> element: two figures of unlike labels, texts or lines are unlike."""
    held = [
        (ax.get_xlabel(), ax.get_ylabel(), [text.get_text() for text in ax.texts], line.get_xydata().tolist())
        for ax in made.axes
        for line in ax.lines
    ]
    title = f"<title>{escape(description)}</title>"
    return f'<svg role="img" id="{name}">{title}<desc>{escape(repr(held))}</desc></svg>'
