"""Write the pictures of the documentation: the README's chart."""

from pathlib import Path

from zwidth.chart.chart import stability_chart
from zwidth.device.load import load
from zwidth.loop.loop import Loop
from zwidth.show.figures.stability import draw_chart
from zwidth.show.figures.style import context, figure, save

IMAGES = Path(__file__).parent / "images"


def main() -> None:
    IMAGES.mkdir(exist_ok=True)
    device = load("five-bar")
    chart = stability_chart(Loop(device.plant(), device.controller))
    with context():
        made, ax = figure(6.2, 3.7)
        draw_chart(ax, chart)
    print(save(made, IMAGES / "five-bar-chart.svg"))


if __name__ == "__main__":
    main()
