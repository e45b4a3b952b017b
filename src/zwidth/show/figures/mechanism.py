"""A mechanism in its posture: links, joints, drives, handle and the rendered direction."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.device.device import Device
from zwidth.model.posture import Posture
from zwidth.show.figures.style import BLACK, BLUE, GREY, LINES, VERMILION, label, legend_beside
from zwidth.show.mechanism_scene import SAME_POINT, MechanismScene, mechanism_scene
from zwidth.show.units import quantity

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
    for stroke, name, n, first in zip(strokes, scene.names, scene.styles, scene.first, strict=True):
        _link(ax, stroke @ view.T, name if first else "", n)
    _joints(ax, scene, view, size, [stroke @ view.T for stroke in strokes])
    _handle(ax, view @ posture.position, np.asarray(direction, dtype=float), view, size)
    ax.set_aspect("equal")
    ax.margins(0.12, 0.06)
    ax.autoscale_view()
    ax.set_axisbelow(True)
    if planar:
        ax.grid(color="#E4E4E4", linewidth=0.5)
        for axis, k in zip((ax.xaxis, ax.yaxis), flat, strict=True):
            label(axis, AXES[k], "m", plain=True)
    else:
        _base_axes(ax, everything @ view.T, size)
    legend_beside(ax)


def _base_axes(ax: Axes, points: Floats, size: float) -> None:
    """The directions of x, y and z in a corner, and a length to measure by; an oblique view has no scales."""
    length = 10.0 ** np.floor(np.log10(0.4 * size))
    length *= next(step for step in (5.0, 2.0, 1.0) if step * length <= 0.4 * size)
    corner = points.min(axis=0) - np.array([0.2, 0.12]) * size
    for k, name in enumerate(AXES):
        tip = corner + length * OBLIQUE[:, k]
        ax.plot(*np.array([corner, tip]).T, color=GREY, linewidth=1.2, solid_capstyle="round")
        ax.annotate(name, (float(tip[0]), float(tip[1])), ha="center", va="bottom", fontsize=8.0, color=BLACK)
    ax.annotate(
        f"axes: {quantity(length, 'm')} each",
        (float(corner[0]), float(corner[1])),
        xytext=(0.0, -20.0),
        textcoords="offset points",
        va="top",
        fontsize=8.0,
        color=BLACK,
    )
    ax.plot(*(corner - np.array([0.0, 0.12 * size]))[:, None], linestyle="none", marker=None)
    ax.axis("off")


def _link(ax: Axes, stroke: Floats, name: str, n: int) -> None:
    colour = LINES[n % len(LINES)][0]
    style: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round", "zorder": 2.0}
    ax.plot(*stroke.T, color=colour, linewidth=5.0, alpha=0.35, **style)
    ax.plot(*stroke.T, color=colour, linestyle=LINES[n % len(LINES)][1], linewidth=1.2, label=name, zorder=2.1)


def _joints(ax: Axes, scene: MechanismScene, view: Floats, size: float, strokes: list[Floats]) -> None:
    """Base, joints and loop closures; driven joints filled, with the names of their drives."""
    base = scene.base @ view.T
    below = base - np.array([0.0, 0.035 * size])
    ax.plot(*below.T, marker="^", markersize=13.0, color="#B8B8B8", linestyle="none", zorder=1.5, label="base")
    circle: dict[str, Any] = {"marker": "o", "markersize": 7.0, "linestyle": "none", "markeredgecolor": BLACK}
    ax.plot(
        *(scene.joints @ view.T).T,
        markerfacecolor="white",
        zorder=3.0,
        label="joint",
        **circle,
    )
    driven = scene.driven @ view.T
    if len(driven):
        ax.plot(*driven.T, markerfacecolor=BLUE, zorder=3.1, label="driven joint", **circle)
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
            color=BLACK,
            path_effects=[withStroke(linewidth=3.0, foreground="white")],
            zorder=5.0,
        )


def _free_side(place: Floats, strokes: list[Floats], near: float) -> Floats:
    """Unit vector (2,) into the middle of the widest gap between the lines at a point; right if there is none."""
    angles = []
    for stroke in strokes:
        for a, b in pairwise(stroke):
            angles += [
                float(np.arctan2(*(to - start)[::-1]))
                for start, to in ((a, b), (b, a))
                if np.linalg.norm(start - place) <= near < np.linalg.norm(to - start)
            ]
    around = np.unique(np.array(angles or [np.pi]))
    gaps = np.diff(around, append=around[0] + 2.0 * np.pi)
    widest = int(np.argmax(gaps))
    middle = around[widest] + 0.5 * gaps[widest]
    return np.array([np.cos(middle), np.sin(middle)])


def _labels_by_position(points: Floats, names: tuple[str, ...], near: float) -> list[tuple[Floats, list[str]]]:
    """Names gathered by place, so that labels of joints in one place stand under each other."""
    groups: list[tuple[Floats, list[str]]] = []
    for point, name in zip(points, names, strict=True):
        for place, others in groups:
            if np.linalg.norm(place - point) <= near:
                others.append(name)
                break
        else:
            groups.append((point, [name]))
    return groups


def _handle(ax: Axes, handle: Floats, direction: Floats, view: Floats, size: float) -> None:
    """The handle, and an arrow along the rendered direction or the axis of moments (a ring where it points at the
    viewer)."""
    turns = len(direction) == 6 and not direction[:3].any()
    along = view @ (direction[3:] if turns else direction[:3])
    ax.plot(
        *handle[:, None],
        marker="D",
        markersize=8.0,
        color=VERMILION,
        markeredgecolor="white",
        linestyle="none",
        zorder=4.0,
        label=f"handle and\n{'axis of moments' if turns else 'rendered direction'}",
    )
    if not np.linalg.norm(along) > SAME_POINT * np.linalg.norm(direction):
        ax.plot(*handle[:, None], marker="o", markersize=15.0, fillstyle="none", color=VERMILION)
        return
    tip = handle + 0.28 * size * along / np.linalg.norm(along)
    arrow = FancyArrowPatch(
        tuple(handle),
        tuple(tip),
        arrowstyle="-|>",
        mutation_scale=14.0,
        color=VERMILION,
        linewidth=1.8,
        zorder=4.1,
    )
    ax.add_patch(arrow)
    # patches of display size do not widen the view
    ax.plot(*tip[:, None], linestyle="none", marker=None, color=GREY)
