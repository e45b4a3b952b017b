"""The figure of nested guarantees shows each set once, with its number."""

from __future__ import annotations

from itertools import pairwise

from tests.systems import mass
from zwidth.guarantees import find_guarantees
from zwidth.loop import Controller, Loop
from zwidth.show import figure
from zwidth.show.figures.guarantees import FILLS, draw_guarantees


def test_every_guarantee_is_in_the_legend_with_its_largest_stiffness():
    _, ax = figure()
    draw_guarantees(ax, find_guarantees(Loop(mass(0.03, 1.0), Controller(0.001))))
    words = " ".join(text.get_text().replace("\u00a0", " ") for text in ax.get_legend().get_texts())
    assert "every passive operator: 2.000 kN/m" in words
    assert "every spring: 2.2" in words


def test_shades_tell_the_sets_apart_in_grey_and_edges_where_they_coincide():
    def lightness(colour):
        return sum(int(colour[i : i + 2], 16) for i in (1, 3, 5))

    shades = [lightness(fill) for fill, *_ in FILLS.values()]
    assert all(a - b > 40 for a, b in pairwise(shades))
    lowest, *above = sorted(FILLS.values(), key=lambda look: look[3])
    assert lowest[2] == "-"
    assert len({(edge, dashes) for _, edge, dashes, _ in FILLS.values()}) == len(FILLS)
    for _, _, (_, (drawn, gap)), _ in above:  # what lies below is seen through the gaps
        assert gap > 0.4 * drawn


def test_small_sets_are_enlarged_beside_the_axes():
    made, ax = figure(6.2, 4.2)
    draw_guarantees(ax, find_guarantees(Loop(mass(0.03, 1.0), Controller(0.001))))
    made.draw_without_rendering()
    (inset,) = ax.child_axes
    assert not inset.get_window_extent().overlaps(ax.get_window_extent())
    assert inset.get_window_extent().x1 <= made.bbox.x1
    assert inset.get_xlim()[1] < 0.2 * ax.get_xlim()[1]
