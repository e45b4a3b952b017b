"""Write the pictures of the documentation: the README's chart, a hand's pushes, two of the thesis's figures, links
that bend."""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from gallery import (
    beam_convergence,
    fig_5_4_common_area,
    fig_5_10_eigenvalues,
    identified_five_bar,
    slender_links,
)
from zwidth.chart import stability_chart
from zwidth.device.load import load
from zwidth.show import caption_of_result, context, draw_chart, figure, load_path_figure, save, write_caption
from zwidth.show.figures.tolerance import tolerance_figure
from zwidth.study import question_of, run_tolerances

IMAGES = Path(__file__).parent / "images"
PAGE = Path(__file__).parent / "tolerance.md"  # whose example is drawn


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    device = load("five-bar")
    chart = stability_chart(device.at().loop)
    with context():
        made, ax = figure(6.2, 3.7)
        draw_chart(ax, chart)
    print(save(made, IMAGES / "five-bar-chart.svg"))
    path = device.load_path(10.0)
    with context():
        made = load_path_figure(path)
        write_caption(made, caption_of_result(path))
    print(save(made, IMAGES / "load-five-bar.svg"))
    (example,) = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    series = run_tolerances(question_of(tomllib.loads(example)))
    with context():
        made = tolerance_figure(series)
        write_caption(made, caption_of_result(series))
    print(save(made, IMAGES / "tolerance.svg"))
    page(fig_5_4_common_area.draw, "fig-5-4-common-area", 6.4, 4.8)
    page(fig_5_10_eigenvalues.draw, "fig-5-10-eigenvalues", 7.4, 4.6)
    page(slender_links.draw, "slender-links", 4.6, 7.6)
    page(beam_convergence.draw, "beam-convergence", 4.6, 6.2)
    page(identified_five_bar.draw, "identified-five-bar", 4.6, 7.2)


def page(draw: Callable[..., None], name: str, width: float, height: float) -> None:
    """A figure of the gallery that places its own axes."""
    made: Any
    made, ax = figure(width, height)
    ax.remove()
    with context():
        draw(made)
    print(save(made, IMAGES / f"{name}.svg"))


if __name__ == "__main__":
    main()
