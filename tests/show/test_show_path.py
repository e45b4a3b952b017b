"""The figure of a whole mechanism in motion: postures, surface, path, and courses in time."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from tests.show.show_cases import check_legends_lie_beside
from zwidth.contact import Box, Plane, Sphere, SurfaceWall
from zwidth.show import LONGEST_LINE, draw_mechanism_motion, mechanism_motion_figure, save

BALL = Sphere((0.0, 0.31), 0.05)


def move_and_draw(surface=BALL, **settings):
    wall = None if surface is None else SurfaceWall(1500.0, 3.0)
    settings = {"push": (0.02, 1.0, 0.0), "duration": 0.25} | settings
    motion = zwidth.load("five-bar").at().move(wall, surface, **settings)
    made, axes = mechanism_motion_figure()
    draw_mechanism_motion(axes, motion)
    made.canvas.draw()
    return motion, made, axes


def texts(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def line_of(ax, name):
    return next(line for line in ax.lines if line.get_label() == name)


def test_the_panels_name_their_units_and_hold_the_motion(tmp_path):
    motion, made, (overall, close, depth, force, energy) = move_and_draw()
    assert [ax.get_ylabel() for ax in (overall, close, depth, force, energy)] == [
        "y [m]", "y [m]", "Depth [mm]", "Force [N]", "Energy [mJ]",
    ]  # fmt: skip
    assert texts(overall) == ["start", "end", "path", "wall"]
    assert texts(close) == ["as read", "path", "start", "end", "wall"]
    for ax in (overall, close):
        assert np.array_equal(line_of(ax, "path").get_xydata(), motion.position[:, :2])
        assert ax.get_aspect() == 1.0
    assert depth.lines[0].get_ydata() == pytest.approx(motion.depth)
    assert force.lines[0].get_ydata() == pytest.approx(np.linalg.norm(motion.force, axis=1))
    assert texts(energy) == ["kinetic", "drives, elastic", "hand", "motors"]
    save(made, tmp_path / "path.png")


def walls(ax):
    """Outlines of the shaded wall, in metres."""
    paths = [path for shade in ax.collections for path in shade.get_paths()]
    return np.vstack([path.vertices for path in paths if len(path.vertices)])


def test_the_wall_is_drawn_where_it_is():
    _, _, (overall, *_) = move_and_draw()
    outline = walls(overall)
    assert np.hypot(*(outline - (0.0, 0.31)).T) == pytest.approx(0.05, abs=1e-4)
    _, _, (_, close, *_) = move_and_draw(Box((0.0, 0.25), (0.03, 0.02), hollow=True))
    assert any(np.all(np.abs(walls(close) - (0.0, 0.27)) < 1e-3, axis=1))
    box = np.abs(walls(close) - (0.0, 0.25)) / (0.03, 0.02)
    assert np.all(np.max(box, axis=1) > 0.99)


def test_the_wall_reaches_the_edges_of_what_is_shown():
    for surface in (
        Plane((0.0, 0.26), (0.0, -1.0)),
        Sphere((0.0, 0.25), 0.012, hollow=True),
    ):
        _, _, (overall, close, *_) = move_and_draw(surface)
        for ax in (overall, close):
            low, high = walls(ax).min(axis=0), walls(ax).max(axis=0)
            assert low[0] < ax.get_xlim()[0] < ax.get_xlim()[1] < high[0]
            assert high[1] > ax.get_ylim()[1]


def test_legends_do_not_lie_on_panels():
    _, made, axes = move_and_draw(gravity=(0.0, -1.0, 0.0))
    check_legends_lie_beside(made, axes)


def test_a_free_motion_to_a_singularity_and_a_long_one_are_drawn():
    motion, _, (overall, _, depth, *_) = move_and_draw(None, duration=1.0)
    assert motion.status == "singular"
    assert not depth.get_visible()
    assert "path" in texts(overall)
    motion, _, (*_, force, _) = move_and_draw(Sphere((0.0, 0.25), 0.02, hollow=True), duration=10.0)
    assert len(motion.time) > LONGEST_LINE
    assert force.collections
