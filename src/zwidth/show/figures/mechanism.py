"""A mechanism in its posture: links, joints, drives, handle and the rendered direction."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike, NDArray

from zwidth.device.device import Device
from zwidth.model.mechanism import REVOLUTE, Mechanism
from zwidth.model.posture import LinkPoints, Posture, link_points
from zwidth.show.figures.style import BLACK, BLUE, GREY, LINES, VERMILION, label, legend_beside

Floats = NDArray[np.float64]
# Points closer than this share of the mechanism's size are one.
SAME_POINT = 1e-6
AXES = "xyz"


def draw_mechanism(ax: Axes, device: Device, posture: Posture, direction: ArrayLike) -> None:
    """The mechanism seen along the axis in which it is flattest, in metres, with equal scales.

    posture    a single one that is OK
    direction  (3,)  rendered direction, any length
    Raises     ValueError  for a device without a mechanism
    """
    if device.mechanism is None:
        raise ValueError(f"{device.label} is given by its [plant] and has no mechanism to draw")
    mechanism = device.mechanism
    placed = link_points(mechanism, posture)
    strokes = [link_stroke(mechanism, placed, i) for i in range(len(mechanism.links.names))]
    everything = np.vstack([np.zeros((1, 3)), *strokes, posture.position[None]])
    flat = projection_axes(everything)
    size = max(float(np.max(np.ptp(everything[:, flat], axis=0))), 1e-9)
    for n, stroke in enumerate(strokes):
        _link(ax, stroke[:, flat], mechanism.links.names[n], n)
    _joints(ax, mechanism, placed, flat, size, [stroke[:, flat] for stroke in strokes])
    _handle(ax, posture.position[flat], np.asarray(direction, dtype=float)[flat], size)
    ax.set_aspect("equal")
    ax.margins(0.12, 0.06)
    ax.autoscale_view()
    ax.grid(color="#E4E4E4", linewidth=0.5)
    ax.set_axisbelow(True)
    for axis, k in zip((ax.xaxis, ax.yaxis), flat, strict=True):
        label(axis, AXES[k], "m", plain=True)
    legend_beside(ax)


def projection_axes(points: Floats) -> list[int]:
    """The two coordinates in which the points spread most, in the order x, y, z; x and y where it is a tie."""
    spread = np.ptp(points, axis=0) + np.array([2.0, 2.0, 0.0]) * 1e-12
    return sorted(np.argsort(-spread, kind="stable")[:2].tolist())


def link_stroke(mechanism: Mechanism, points_of_links: LinkPoints, link: int) -> Floats:
    """The points that a link joins, (k, 3), from its joint to the joints and points that it carries."""
    links, closures = mechanism.links, mechanism.closures
    start = points_of_links.origin[link]
    points = [points_of_links.tip[link]]
    points += [points_of_links.origin[child] for child in np.flatnonzero(links.parent == link)]
    for owners, at in ((closures.a, closures.point_a), (closures.b, closures.point_b)):
        points += [points_of_links.of(link, at[k]) for k in np.flatnonzero(owners == link)]
    if mechanism.handle_link == link:
        points.append(points_of_links.of(link, mechanism.handle_point))
    stroke = [start]
    for point in points:
        if all(np.linalg.norm(point - other) > SAME_POINT for other in stroke):
            stroke += [point, start]  # out and back: a link may branch
    return np.array(stroke)


def _link(ax: Axes, stroke: Floats, name: str, n: int) -> None:
    colour = LINES[n % len(LINES)][0]
    style: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round", "zorder": 2.0}
    ax.plot(*stroke.T, color=colour, linewidth=5.0, alpha=0.35, **style)
    ax.plot(*stroke.T, color=colour, linestyle=LINES[n % len(LINES)][1], linewidth=1.2, label=name, zorder=2.1)


def _joints(
    ax: Axes,
    mechanism: Mechanism,
    points_of_links: LinkPoints,
    flat: list[int],
    size: float,
    strokes: list[Floats],
) -> None:
    """Base, joints and loop closures; driven joints filled, with the names of their drives."""
    links, closures, drives = mechanism.links, mechanism.closures, mechanism.drives
    base = points_of_links.origin[links.parent < 0][:, flat]
    grounded = [p for a, p in zip(closures.a, closures.point_a, strict=True) if a < 0]
    grounded += [p for b, p in zip(closures.b, closures.point_b, strict=True) if b < 0]
    base = np.vstack([base, np.array(grounded).reshape(-1, 3)[:, flat]])
    below = base - np.array([0.0, 0.035 * size])
    ax.plot(*below.T, marker="^", markersize=13.0, color="#B8B8B8", linestyle="none", zorder=1.5, label="base")
    circle: dict[str, Any] = {"marker": "o", "markersize": 7.0, "linestyle": "none", "markeredgecolor": BLACK}
    ax.plot(
        *joint_points(mechanism, points_of_links)[:, flat].T,
        markerfacecolor="white",
        zorder=3.0,
        label="joint",
        **circle,
    )
    driven = points_of_links.origin[drives.joint][:, flat]
    if len(driven):
        ax.plot(*driven.T, markerfacecolor=BLUE, zorder=3.1, label="driven joint", **circle)
    for place, names in _labels_by_position(driven, drives.names, SAME_POINT * max(size, 1.0)):
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


def joint_points(mechanism: Mechanism, points_of_links: LinkPoints) -> Floats:
    """Where joints turn and loops meet, (k, 3)."""
    closures = mechanism.closures
    turning = np.flatnonzero(mechanism.links.joint == REVOLUTE)
    meeting = [
        points_of_links.of(int(a), p) if a >= 0 else p for a, p in zip(closures.a, closures.point_a, strict=True)
    ]
    return np.array([*points_of_links.origin[turning], *meeting]).reshape(-1, 3)


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


def _handle(ax: Axes, handle: Floats, direction: Floats, size: float) -> None:
    """The handle, and an arrow along the rendered direction (a ring where it points at the viewer)."""
    ax.plot(
        *handle[:, None],
        marker="D",
        markersize=8.0,
        color=VERMILION,
        markeredgecolor="white",
        linestyle="none",
        zorder=4.0,
        label="handle and\nrendered direction",
    )
    if not np.linalg.norm(direction) > SAME_POINT:
        ax.plot(*handle[:, None], marker="o", markersize=15.0, fillstyle="none", color=VERMILION)
        return
    tip = handle + 0.28 * size * direction / np.linalg.norm(direction)
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
