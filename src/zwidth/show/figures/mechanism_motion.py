"""A whole mechanism in motion: its postures, the handle's path at the surface, and what happens in time.

A mechanism in its posture: links, joints, drives, handle and the rendered direction.

A plant as masses, springs and dampers in a row, where it is such a row.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from textwrap import wrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.contact.mechanism.motion import MechanismMotion
from zwidth.contact.mechanism.surfaces import Box, Sphere, Surface, depth_and_normal
from zwidth.device.device import Device
from zwidth.errors import PostureError
from zwidth.model.mechanism import Mechanism
from zwidth.model.plant import Plant
from zwidth.model.posture import Posture, link_points, solve_posture
from zwidth.show.figures import style
from zwidth.show.figures.contact_response import LONGEST_LINE, WORTH, draw_envelope, draw_line
from zwidth.show.mechanism_scene import (
    SAME_POINT,
    MassChain,
    MechanismScene,
    drawn_links,
    joint_points,
    link_stroke,
    mechanism_scene,
    projection_axes,
)
from zwidth.show.units import as_written, quantity

WALL: Final = "#E3E3E3"
GRID: Final = 801  # points across a drawing at which a surface's depth is computed
FILLED: Final = 1.0  # widths of the view that a wall is drawn beyond it: equal scales show more of one axis
NEAR: Final = 1e-6  # rad, by which a posture found again may differ; share of a place that is no motion
LEAST: Final = 1e-3  # share of the mechanism's size that a close-up shows at least
ROOM: Final = 0.12  # of the half size of a view, on each side of it
TITLE: Final = 60  # letters of a line
VISIBLE: Final = 2e-3  # share of the path's size by which readings are off that are drawn
LINK_COLOURS: Final = tuple(
    colour for colour, _ in style.LINES if colour != style.VERMILION
)  # which is the path's


def mechanism_motion_figure() -> tuple[Figure, list[Axes]]:
    """A figure with the five panels of `draw_mechanism_motion`: two drawings, and three courses beside them."""
    drawing, first = style.figure(9.6, 7.6)
    with style.context():
        grid = drawing.add_gridspec(6, 2, width_ratios=(1.0, 1.1))
        first.set_subplotspec(grid[:3, 0])
        close = drawing.add_subplot(grid[3:, 0])
        depth = drawing.add_subplot(grid[:2, 1])
        below = [drawing.add_subplot(grid[row : row + 2, 1], sharex=depth) for row in (2, 4)]
    return drawing, [first, close, depth, *below]


def draw_mechanism_motion(axes: Sequence[Axes], motion: MechanismMotion) -> None:
    """The mechanism at the start and, lighter, at the end; the path close up; depth, force and energies in time.

    axes  as `mechanism_motion_figure` gives them
    """
    overall, close, depth, force, energy = axes
    _draw_overall(overall, motion)
    draw_motion_close_up(close, motion)
    draw = draw_envelope if len(motion.time) > LONGEST_LINE else draw_line
    _draw_contact(depth, force, motion, draw)
    _draw_energies(energy, motion, draw)
    for ax in (depth, force, energy) if motion.surface is not None else (energy,):
        style.legend_above(ax, columns=4)
        ax.margins(x=0.0, y=0.08)
        ax.tick_params(labelbottom=ax is energy)
    style.label(energy.xaxis, "Time", "s")
    depth.figure.align_ylabels([depth, force, energy])


def _draw_overall(ax: Axes, motion: MechanismMotion) -> None:
    """Draw the mechanism at the start and, lighter, at the end, the path, and the surface; all of it in view."""
    mechanism, posture = motion.mechanism, motion.start
    end = _last_posture(motion)
    poses = [posture] if end is None else [posture, end]
    strokes = [_strokes(mechanism, pose) for pose in poses]
    flat = projection_axes(np.vstack([np.zeros((1, 3)), *strokes[0], motion.position]))
    for faint, pose, lines in zip((False, True), poses, strokes, strict=False):
        _draw_posture(ax, mechanism, pose, lines, flat, faint)
    ax.plot(*motion.position[:, flat].T, color=style.VERMILION, linewidth=1.3, zorder=4.0, label="path")
    points = np.vstack([np.zeros((1, 3)), *(stroke for lines in strokes for stroke in lines), motion.position])
    projection = points[:, flat]
    size = max(float(np.max(np.ptp(projection, axis=0))), 1e-9)
    corners = _surface_corners(motion.surface, size)
    view = _view_around(projection if corners is None else np.vstack([projection, corners[:, flat]]), size * LEAST)
    _draw_surface(ax, view, flat, motion)
    _frame(ax, view, flat)
    style.legend_above(ax, columns=4)


def draw_motion_close_up(ax: Axes, motion: MechanismMotion) -> None:
    """The path alone, with where the computer sees the handle; or why there is none."""
    strokes = _strokes(motion.mechanism, motion.start)
    # the two coordinates that are shown
    flat = projection_axes(np.vstack([np.zeros((1, 3)), *strokes, motion.position]))
    size = float(np.max(np.ptp(np.vstack(strokes), axis=0)))
    mark: dict[str, Any] = {"linestyle": "none", "markersize": 7.0, "markeredgecolor": style.BLACK, "zorder": 5.0}
    if not len(motion.time):
        place = motion.start.position[None, flat]
        ax.plot(*place.T, marker="o", markerfacecolor="white", label="start", **mark)
        ax.set_title("\n".join(wrap(motion.reason, TITLE)), fontsize=8.0, loc="left")
        _frame(ax, _view_around(place, size), flat)
        return
    true, readings = motion.position[:, flat], motion.counted_position[:, flat]
    if np.max(np.abs(true - readings)) > VISIBLE * max(float(np.max(np.ptp(true, axis=0))), 1e-12):
        ax.plot(*readings.T, color=style.BLUE, linewidth=0.8, alpha=0.8, label="as read", zorder=3.0)
    ax.plot(*true.T, color=style.VERMILION, linewidth=1.3, label="path", zorder=4.0)
    ax.plot(*true[0][:, None], marker="o", markerfacecolor="white", label="start", **mark)
    ax.plot(*true[-1][:, None], marker="s", markerfacecolor=style.BLACK, label="end", **mark)
    view = _view_around(true, size * LEAST)
    _draw_surface(ax, view, flat, motion)
    _frame(ax, view, flat)
    style.legend_above(ax, columns=5)


def _last_posture(motion: MechanismMotion) -> Posture | None:
    """The posture at the end; None where it is not found again, as next to a singularity."""
    mechanism = motion.mechanism
    try:
        posture = solve_posture(mechanism, motion.position[-1], motion.start.assembly)
    except PostureError:
        return None
    turned = posture.angles[mechanism.drives.joint] - motion.joints[-1]
    # the same posture may be found with a drive turned by whole turns
    off = np.abs(turned - 2.0 * np.pi * np.round(turned / (2.0 * np.pi)))
    return posture if np.max(off) < NEAR else None


def _strokes(mechanism: Mechanism, posture: Posture) -> list[Floats]:
    """The lines (k, 3) [m] as which the links are drawn in a posture."""
    placed = link_points(mechanism, posture)
    return [link_stroke(mechanism, placed, i) for i in drawn_links(mechanism)]


def _draw_posture(
    ax: Axes, mechanism: Mechanism, posture: Posture, strokes: list[Floats], flat: list[int], faint: bool
) -> None:
    """Draw one posture: links as bars, joints as circles.

    strokes  (k, 3) of each link [m];   flat  the two axes that are shown;   faint  of the end of the motion
    """
    strength = 0.35 if faint else 1.0
    named = "end" if faint else "start"
    for n, stroke in enumerate(strokes):
        colour = LINK_COLOURS[n % len(LINK_COLOURS)]
        width = 3.0 if faint else 5.0
        ax.plot(*stroke[:, flat].T, color=colour, linewidth=width, alpha=0.35 * strength, zorder=2.0 - faint)
        line_style: dict[str, Any] = {"color": colour, "linewidth": 1.2, "alpha": strength, "zorder": 2.1 - faint}
        ax.plot(*stroke[:, flat].T, label=named if n == 0 else "", **line_style)
    joints = joint_points(mechanism, link_points(mechanism, posture))[:, flat]
    circle: dict[str, Any] = {
        "marker": "o",
        "markersize": 5.0,
        "linestyle": "none",
        "markeredgecolor": style.BLACK,
    }
    ax.plot(*joints.T, markerfacecolor="white", alpha=strength, zorder=3.0 - faint, **circle)


def _cut_plane(motion: MechanismMotion, flat: list[int]) -> tuple[int, float]:
    """The axis 0, 1 or 2 that is looked along, and the place on it [m] where the handle is deepest."""
    across = ({0, 1, 2} - set(flat)).pop()
    return across, float(motion.position[int(np.argmax(motion.depth)), across])


def _cut_text(motion: MechanismMotion, cut: tuple[int, float]) -> str:
    """Where the surface is cut, in words; "" for a path that stays there.

    cut  axis and place, as `_cut_plane` returns them
    """
    across, place = cut
    # NEAR: a smaller motion is rounding; 1e-12 m for a path at the origin
    moves = np.ptp(motion.position[:, across]) > NEAR * max(float(np.max(np.abs(motion.position))), 1e-12)
    return f" at {AXES[across]} = {quantity(place, 'm')}" if moves else ""


def _surface_corners(surface: Surface | None, size: float) -> Floats | None:
    """Two opposite corners (2, 3) [m] of a surface smaller than `size` [m]; None for others, and for a plane.

    Of a box as if it lay along the axes of the base frame
    """
    match surface:
        case Sphere():
            center, half = surface.center, np.full(3, surface.radius)
        case Box():  # one in a plane has two half sizes
            center, half = surface.center, np.array([*surface.half_sizes, 0.0][:3])
        case _:
            return None
    middle = np.array([*center, 0.0][:3])
    half = np.where(np.isfinite(half), half, 0.0)  # the view need not hold an infinite side
    return np.array([middle - half, middle + half]) if np.max(half) < size else None


def _view_around(points: Floats, least: float) -> Floats:
    """Corners (2, 2) of a rectangle round the points (k, 2), with some room, and not smaller than `least` [m]."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * np.maximum(high - low, least)
    half = half + ROOM * half.max()
    return np.array([middle - half, middle + half])


def _frame(ax: Axes, view: Floats, flat: list[int]) -> None:
    """Show the view (2, 2) [m] at equal scales; the shape of the panel decides which axis shows more than it."""
    ax.set_xlim(*view[:, 0], auto=True)
    ax.set_ylim(*view[:, 1], auto=True)
    ax.set_aspect("equal", adjustable="datalim")
    ax.grid(color="#D4D4D4", linewidth=0.5)
    ax.set_axisbelow(True)
    ax.xaxis.set_major_locator(MaxNLocator(4, steps=(1, 2, 5, 10)))  # long labels of a close view keep apart
    for axis, k in zip((ax.xaxis, ax.yaxis), flat, strict=True):
        style.label(axis, AXES[k], "m", plain=True)


def _draw_surface(ax: Axes, view: Floats, flat: list[int], motion: MechanismMotion) -> None:
    """Draw the wall's edge and, unless it is two-sided, shade it; cut at one place of the axis of view."""
    if motion.surface is None:
        return
    cut = _cut_plane(motion, flat)
    margin = FILLED * np.max(view[1] - view[0])
    x, y = np.linspace(view[0] - margin, view[1] + margin, GRID).T
    points = np.empty((GRID, GRID, 3))
    points[..., flat[0]], points[..., flat[1]], points[..., cut[0]] = x[None, :], y[:, None], cut[1]
    depth = depth_and_normal(motion.surface, points)[0]
    if motion.two_sided:
        name = "two-sided wall"
    else:
        name = "wall"
        ax.contourf(x, y, depth, levels=[0.0, np.inf], colors=[WALL], zorder=0.5)
    if depth.min() < 0.0 < depth.max():
        ax.contour(x, y, depth, levels=[0.0], colors=[style.GREY], linewidths=1.2, zorder=0.7)
    ax.plot([], [], color=style.GREY, linewidth=1.2, label=name + _cut_text(motion, cut))


def _draw_contact(depth: Axes, force: Axes, motion: MechanismMotion, draw: Any) -> None:
    """Draw depth [m] and force [N] over time; without a surface both panels are hidden.

    draw  `draw_line` or `draw_envelope`
    """
    style.label(depth.yaxis, "Depth", "m")
    style.label(force.yaxis, "Force", "N")
    if motion.surface is None:
        for ax in (depth, force):
            ax.set_visible(False)
        return
    draw(depth, motion.time, motion.depth, style.BLUE, "depth")
    depth.axhline(0.0, color=style.GREY, linewidth=0.7, linestyle=":", zorder=1.5, label="surface")
    draw(force, motion.time, motion.force_size, style.BLUE, "force on the handle, as commanded", held=True)


def _draw_energies(ax: Axes, motion: MechanismMotion, draw: Any) -> None:
    """Draw the energy of motion and of bent drives, and what gravity, hand, motors and friction have put in [J].

    Each over time, where it is worth a line;   draw  `draw_line` or `draw_envelope`
    """
    courses = {
        "kinetic": motion.kinetic,
        "drives, elastic": motion.elastic,
        "gravity": motion.gravitational[0] - motion.gravitational,
        "hand": motion.hand_work,
        "motors": motion.motor_work,
        "dry friction": -motion.friction_loss,
    }
    sizes = {name: float(np.max(np.abs(values))) for name, values in courses.items()}
    largest = max(size for size in sizes.values() if size == size)  # not nan
    for (name, values), (colour, dashes) in zip(courses.items(), style.LINES, strict=True):
        if sizes[name] > WORTH * largest:
            draw(ax, motion.time, values, colour, name, dashes=dashes)
    ax.axhline(0.0, color=style.GREY, linewidth=0.7, linestyle=":", zorder=1.5)
    style.label(ax.yaxis, "Energy", "J")


AXES = "xyz"
# Where x, y and z go in the picture of a spatial mechanism, (2, 3): it is looked at from the right and above.
TURNED, TILTED = np.radians(35.0), np.radians(22.0)
OBLIQUE = np.array(
    [
        [np.cos(TURNED), np.sin(TURNED), 0.0],
        [-np.sin(TURNED) * np.sin(TILTED), np.cos(TURNED) * np.sin(TILTED), np.cos(TILTED)],
    ]
)


def draw_mechanism(ax: Axes, device: Device, posture: Posture, direction: ArrayLike) -> None:
    """The mechanism in metres with equal scales: a planar one seen along the axis in which it is flat, another one
    from the front right and above, with its axes beside it.

    posture    a single one that is OK
    direction  (3,)  rendered direction, any length; or (6,), a screw, of which the axis is drawn where it has one
    Raises     ValueError  for a device without a mechanism
    """
    if device.mechanism is None:
        raise ValueError(f"{device.label} is given by its [plant] and has no mechanism to draw")
    mechanism = device.mechanism
    scene = mechanism_scene(mechanism, posture)
    strokes, flat, planar = scene.strokes, list(scene.flat), scene.planar
    everything = np.vstack([np.zeros((1, 3)), *strokes, posture.position[None]])
    view = np.eye(3)[flat] if planar else OBLIQUE
    size = max(float(np.max(np.ptp(everything @ view.T, axis=0))), 1e-9)
    for stroke, name, number, first in zip(strokes, scene.names, scene.styles, scene.first, strict=True):
        _draw_link(ax, stroke @ view.T, name if first else "", number)
    _draw_joints(ax, scene, view, size, [stroke @ view.T for stroke in strokes])
    _draw_handle(ax, view @ posture.position, np.asarray(direction, dtype=float), view, size)
    ax.set_aspect("equal")
    ax.margins(0.12, 0.06)
    ax.autoscale_view()
    ax.set_axisbelow(True)
    if planar:
        ax.grid(color="#E4E4E4", linewidth=0.5)
        for axis, k in zip((ax.xaxis, ax.yaxis), flat, strict=True):
            style.label(axis, AXES[k], "m", plain=True)
    else:
        _draw_base_axes(ax, everything @ view.T, size)
    style.legend_beside(ax)


def _draw_base_axes(ax: Axes, points: Floats, size: float) -> None:
    """Draw the directions of x, y and z in a corner, as a length to measure by; an oblique view has no scales.

    points  (k, 2) of all that is drawn, and `size`, their largest extent, in the picture [m]
    """
    length = 10.0 ** np.floor(np.log10(0.4 * size))
    length *= next(step for step in (5.0, 2.0, 1.0) if step * length <= 0.4 * size)
    corner = points.min(axis=0) - np.array([0.2, 0.12]) * size
    for k, name in enumerate(AXES):
        tip = corner + length * OBLIQUE[:, k]
        ax.plot(*np.array([corner, tip]).T, color=style.GREY, linewidth=1.2, solid_capstyle="round")
        ax.annotate(
            name, (float(tip[0]), float(tip[1])), ha="center", va="bottom", fontsize=8.0, color=style.BLACK
        )
    ax.annotate(
        f"axes: {quantity(length, 'm')} each",
        (float(corner[0]), float(corner[1])),
        xytext=(0.0, -20.0),
        textcoords="offset points",
        va="top",
        fontsize=8.0,
        color=style.BLACK,
    )
    # an empty line widens the view by the room of the text
    ax.plot(*(corner - np.array([0.0, 0.12 * size]))[:, None], linestyle="none", marker=None)
    ax.axis("off")


def _draw_link(ax: Axes, stroke: Floats, name: str, number: int) -> None:
    """Draw one link, a stroke (k, 2) in the picture, in the line style of this number; named in the legend."""
    colour = style.LINES[number % len(style.LINES)][0]
    look: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round", "zorder": 2.0}
    ax.plot(*stroke.T, color=colour, linewidth=5.0, alpha=0.35, **look)
    ax.plot(
        *stroke.T,
        color=colour,
        linestyle=style.LINES[number % len(style.LINES)][1],
        linewidth=1.2,
        label=name,
        zorder=2.1,
    )


def _draw_joints(ax: Axes, scene: MechanismScene, view: Floats, size: float, strokes: list[Floats]) -> None:
    """Draw base, joints and loop closures; driven joints filled, with the names of their drives.

    view     (2, 3) from the base frame to the picture;   size  of the picture [m]
    strokes  (k, 2) of each link in the picture, which names keep off
    """
    base = scene.base @ view.T
    below = base - np.array([0.0, 0.035 * size])
    ax.plot(*below.T, marker="^", markersize=13.0, color="#B8B8B8", linestyle="none", zorder=1.5, label="base")
    circle: dict[str, Any] = {
        "marker": "o",
        "markersize": 7.0,
        "linestyle": "none",
        "markeredgecolor": style.BLACK,
    }
    ax.plot(
        *(scene.joints @ view.T).T,
        markerfacecolor="white",
        zorder=3.0,
        label="joint",
        **circle,
    )
    driven = scene.driven @ view.T
    if len(driven):
        ax.plot(*driven.T, markerfacecolor=style.BLUE, zorder=3.1, label="driven joint", **circle)
    for place, names in _labels_by_position(driven, scene.drives, SAME_POINT * max(size, 1.0)):
        aside = _free_side(place, strokes, SAME_POINT * max(size, 1.0))
        room = place + 0.2 * size * aside  # texts do not widen the view
        ax.plot(*room[:, None], linestyle="none", marker=None)
        ax.annotate(
            "\n".join(names),
            (float(place[0]), float(place[1])),
            xytext=(float(16.0 * aside[0]), float(16.0 * aside[1])),
            textcoords="offset points",
            ha="left" if aside[0] > 0.3 else "right" if aside[0] < -0.3 else "center",
            va="bottom" if aside[1] > 0.3 else "top" if aside[1] < -0.3 else "center",
            fontsize=8.0,
            color=style.BLACK,
            path_effects=[withStroke(linewidth=3.0, foreground="white")],
            zorder=5.0,
        )


def _free_side(place: Floats, strokes: list[Floats], near: float) -> Floats:
    """Unit vector (2,) from a place into the widest gap between the lines that end there; right without any.

    strokes  (k, 2) of each link in the picture;   near  distance below which two points are one
    """
    angles = []  # in which lines leave the place
    for stroke in strokes:
        for a, b in pairwise(stroke):
            angles += [
                float(np.arctan2(*(to - start)[::-1]))  # of y and x
                for start, to in ((a, b), (b, a))
                if np.linalg.norm(start - place) <= near < np.linalg.norm(to - start)
            ]
    around = np.unique(np.array(angles or [np.pi]))  # a line to the left leaves the right free
    gaps = np.diff(around, append=around[0] + 2.0 * np.pi)
    widest = int(np.argmax(gaps))
    middle = around[widest] + 0.5 * gaps[widest]
    return np.array([np.cos(middle), np.sin(middle)])


def _labels_by_position(points: Floats, names: tuple[str, ...], near: float) -> list[tuple[Floats, list[str]]]:
    """Each place of the points (k, 2), with the names of those closer to it than `near`.

    Labels of joints in one place then stand under each other.
    """
    groups: list[tuple[Floats, list[str]]] = []
    for point, name in zip(points, names, strict=True):
        for place, names_here in groups:
            if np.linalg.norm(place - point) <= near:
                names_here.append(name)
                break
        else:
            groups.append((point, [name]))
    return groups


def _draw_handle(ax: Axes, handle: Floats, direction: Floats, view: Floats, size: float) -> None:
    """Draw the handle, and an arrow along the rendered direction or the axis of moments.

    A ring where it points at the viewer.

    handle     (2,) in the picture;   direction  (3,), or a screw (6,), in the base frame
    view       (2, 3) from the base frame to the picture;   size  of the picture [m]
    """
    turns = len(direction) == 6 and not direction[:3].any()
    along = view @ (direction[3:] if turns else direction[:3])
    ax.plot(
        *handle[:, None],
        marker="D",
        markersize=8.0,
        color=style.VERMILION,
        markeredgecolor="white",
        linestyle="none",
        zorder=4.0,
        label=f"handle and\n{'axis of moments' if turns else 'rendered direction'}",
    )
    if not np.linalg.norm(along) > SAME_POINT * np.linalg.norm(direction):
        ax.plot(*handle[:, None], marker="o", markersize=15.0, fillstyle="none", color=style.VERMILION)
        return
    tip = handle + 0.28 * size * along / np.linalg.norm(along)
    arrow = FancyArrowPatch(
        tuple(handle),
        tuple(tip),
        arrowstyle="-|>",
        mutation_scale=14.0,
        color=style.VERMILION,
        linewidth=1.8,
        zorder=4.1,
    )
    ax.add_patch(arrow)
    # patches of display size do not widen the view
    ax.plot(*tip[:, None], linestyle="none", marker=None, color=style.GREY)


WIDTH, GAP, HALF = 1.2, 1.6, 0.55  # of a mass, between masses, half the height of a mass


def draw_chain(ax: Axes, plant: Plant, chain: MassChain) -> None:
    """Masses as boxes with their numbers, springs over dampers, and where the wall acts, reads and is held."""
    count = len(chain.mass)
    left = GAP * (np.arange(count) + 1.0) + WIDTH * np.arange(count)
    for k, x in enumerate(left):
        ax.add_patch(Rectangle((x, -HALF), WIDTH, 2 * HALF, facecolor="#EEEEEE", edgecolor=style.BLACK))
        ax.text(x + WIDTH / 2, 0.0, as_written(float(chain.mass[k]), "kg"), ha="center", va="center", fontsize=8.0)
        ax.text(x + WIDTH / 2, -HALF - 0.12, "\n".join(_roles(plant, k)), ha="center", va="top", fontsize=8.0)
    for k in range(count + 1):
        start = left[k] - GAP if k < count else left[-1] + WIDTH
        if chain.stiffness[k] > 0.0 or chain.damping[k] > 0.0:
            _draw_spring_and_damper(ax, start, start + GAP, float(chain.stiffness[k]), float(chain.damping[k]))
            if k in (0, count):
                _draw_ground(ax, start if k == 0 else start + GAP)
    ends = chain.stiffness[[0, count]] + chain.damping[[0, count]] > 0.0
    ax.set_xlim(left[0] - GAP * ends[0] - 0.3, left[-1] + WIDTH + GAP * ends[1] + 0.3)
    ax.set_ylim(-HALF - 1.0, HALF + 0.7)
    ax.set_aspect("equal")
    ax.set_axis_off()


def _roles(plant: Plant, mass: int) -> list[str]:
    """What the mass of this number is: where the wall acts, where the encoder reads, where the hand holds."""
    handle = plant.handle if plant.handle is not None else np.zeros(plant.size)
    names = (("wall acts", plant.actuator), ("encoder", plant.sensor), ("handle", handle))
    return [name for name, vector in names if vector[mass] != 0.0]


def _draw_spring_and_damper(ax: Axes, start: float, end: float, stiffness: float, damping: float) -> None:
    """Draw a spring [N/m] over a damper [N s/m], or either alone, between two places of the picture."""
    both = stiffness > 0.0 and damping > 0.0
    if stiffness > 0.0:
        y = 0.3 if both else 0.0
        x = start + (end - start) * np.array([0.0, 0.2, *np.linspace(0.235, 0.765, 9), 0.8, 1.0])
        zigzag = [0.0, 0.0, *(0.13 * (-1.0) ** k for k in range(9)), 0.0, 0.0]
        ax.plot(x, y + np.array(zigzag), color=style.VERMILION, linewidth=1.2)
        ax.text((start + end) / 2, y + 0.18, as_written(stiffness, "N/m"), ha="center", va="bottom", fontsize=8.0)
    if damping > 0.0:
        y = -0.3 if both else 0.0
        middle = (start + end) / 2
        ax.plot([start, middle], [y, y], color=style.GREY, linewidth=1.2)
        ax.plot([middle] * 2, [y - 0.13, y + 0.13], color=style.GREY, linewidth=1.2)
        sides = [middle - 0.22, middle + 0.22, middle + 0.22, middle - 0.22]
        cup = [y + 0.18, y + 0.18, y - 0.18, y - 0.18]
        ax.plot(sides, cup, color=style.GREY, linewidth=1.2)
        ax.plot([middle + 0.22, end], [y, y], color=style.GREY, linewidth=1.2)
        ax.text(middle, y - 0.27, as_written(damping, "N s/m"), ha="center", va="top", fontsize=8.0)


def _draw_ground(ax: Axes, x: float) -> None:
    """Draw the ground, an upright line."""
    ax.plot([x, x], [-HALF, HALF], color=style.BLACK, linewidth=2.0)
