"""A measure over the workspace with the mechanism, and requirements over each other (thesis Figs. 5.1-5.4).

Safe walls: the largest stiffness of each cell, or the bands of a device that is the same everywhere.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.measures.definition import (
    BEYOND_LIMIT,
    FAILED,
    NO_EQUILIBRIUM,
    NO_VALUE,
    OUT_OF_REACH,
    OUT_OF_TIME,
    SINGULAR,
    STATUS,
    UNDECIDED,
)
from zwidth.show.figures import style
from zwidth.show.mechanism_scene import drawn_links, joint_points, link_stroke
from zwidth.show.units import area_text, as_written, percent, quantity, spoken_unit
from zwidth.study.workspace.map import continued, reach_outline

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.device.device import Device
    from zwidth.study.wall_tables.table import SafeWalls
    from zwidth.study.workspace.common_area import CommonArea


ProjectedMechanism = tuple[list[Floats], Floats, Floats]  # strokes (k, 2) of the links, joints (j, 2), handle (2,)

MARKS: Final = {
    SINGULAR: ("singular", "xxxx"),
    BEYOND_LIMIT: ("beyond a joint limit", "----"),
    NO_EQUILIBRIUM: ("no equilibrium", "||||"),
    NO_VALUE: ("no value", "////"),
    UNDECIDED: ("undecided", "...."),
    FAILED: ("failed", "\\\\\\\\"),
    OUT_OF_TIME: ("out of time", "oo"),
}
HATCH_OF: Final = {OUT_OF_REACH: "", **{kind: hatch for kind, (_, hatch) in MARKS.items()}}
HATCHES: Final = ("\\\\", "//", "||", "--", "xx")
INFINITE_COLOUR: Final = "#C8C8C8"
CELL_EDGE: Final = 0.6  # points, width of the line between cells
ARROWS: Final = 14  # direction strokes along the longer side


def map_figure(
    dataset: xr.Dataset, name: str, device: Device | None = None, area: CommonArea | None = None
) -> Figure:
    """A figure of one measure of a map, as wide as its plane asks for.

    device  whose mechanism is drawn in its reference posture; None: none
    area    requirements to lay over it
    """
    x, y = dataset["x_m"].values, dataset["y_m"].values
    view = _view_limits(x, y, _projected_mechanism(dataset, device))
    ratio = (view[3] - view[2]) / (view[1] - view[0])
    width = 6.2 if ratio < 1.4 else 4.6
    lines = 1 + (len(area.requirements) + 1 if area is not None else 0)
    drawing, ax = style.figure(width, float(np.clip(0.72 * width * ratio, 2.2, 8.0)) + 0.75 + 0.17 * lines)
    drawing.set_layout_engine("compressed")  # axes of equal scales leave room that the labels need
    draw_map(ax, dataset, name, device, area)
    return drawing


def draw_map(
    ax: Axes, dataset: xr.Dataset, name: str, device: Device | None = None, area: CommonArea | None = None
) -> None:
    """Filled contours of one measure of a map; white where the handle does not reach, hatched without a value.

    device  as for `map_figure`
    area    requirements: each region hatched within its outline, what they have in common within a bold dotted one
    """
    x, y = dataset["x_m"].values, dataset["y_m"].values
    about = dataset[name].attrs
    unit = spoken_unit(str(about.get("unit", "")))
    handles: list[Any] = []
    values = dataset[name].values
    outline = reach_outline(dataset, name)
    if (np.abs(values) <= style.LARGEST).any():
        drawn = values if outline is None else continued(values, dataset[f"{name}_status"].values)
        _draw_contours(ax, x, y, values, drawn, str(about["title"]), unit, faint=area is not None, outline=outline)
    elif not np.isnan(values).all():  # infinite wherever it has a value
        handles += _fill_infinite(ax, x, y, values, str(about["title"]))
    handles += _status_hatches(ax, x, y, dataset[f"{name}_status"].values)
    handles += _direction_strokes(ax, dataset, f"{name}_direction")
    if area is not None:
        handles += draw_areas(ax, area)
    mechanism = _projected_mechanism(dataset, device)
    if mechanism is not None:
        _draw_mechanism(ax, mechanism)
        if about["along"] and not isinstance(dataset.attrs["direction"], str):
            _draw_rendered_direction(ax, mechanism, dataset)
    _frame(
        ax,
        _view_limits(x, y, mechanism),
        str(dataset["x_m"].attrs["long_name"]),
        str(dataset["y_m"].attrs["long_name"]),
    )
    if handles:
        _add_legend(ax, handles, one_column=area is not None)


def _add_legend(ax: Axes, handles: list[Any], *, one_column: bool) -> None:
    """Add the legend of these handles above the axes."""
    legend = ax.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.02),
        ncols=1 if one_column else 3,
        borderaxespad=0.0,
        handlelength=2.6,
        handleheight=1.1,
        columnspacing=1.6,
        fontsize=8.0,
        frameon=False,
        alignment="left",
    )
    legend.set_zorder(6.0)


def _draw_contours(
    ax: Axes,
    x: Floats,
    y: Floats,
    values: Floats,
    drawn: Floats,
    title: str,
    unit: str,
    *,
    faint: bool,
    outline: Any,
) -> None:
    """Bands between round levels of the values, cut at the true edge of reach where that is known.

    x, y     places of the values (columns,), (rows,) [m];   values  (rows, columns), for the levels
    drawn    the values, continued beyond that edge
    title    of the bar of colours, with `unit`;   faint  for outlines to stand out on it
    outline  what is reached; None: known to a cell
    """
    levels, norm, colours = style.bands_of(values, faint=faint)
    extend: Any = norm.extend
    # infinite values are drawn as twice the largest finite one, beyond every level
    beyond_all = 2.0 * max(
        float(np.abs(values[np.abs(values) <= style.LARGEST]).max()), *np.abs(levels[[0, -1]]).tolist()
    )
    heights = np.ma.masked_invalid(np.clip(drawn, -beyond_all, beyond_all))
    bands = ax.contourf(
        x, y, heights, levels=levels, cmap=colours, norm=norm, extend=extend, corner_mask=True, zorder=1.0
    )
    lines = ax.contour(x, y, heights, levels=levels, colors="white", linewidths=0.4, corner_mask=True, zorder=1.1)
    if paths := _outline_paths(outline) if outline is not None else []:
        edge = PathPatch(
            Path.make_compound_path(*paths), facecolor="none", edgecolor=style.GREY, linewidth=0.6, zorder=1.2
        )
        ax.add_patch(edge)
        for drawing in (bands, lines):
            drawing.set_clip_path(edge)
    style.colour_bar(ax, levels, norm, colours, title, unit)


def _fill_infinite(ax: Axes, x: Floats, y: Floats, values: Floats, title: str) -> list[Any]:
    """Fill where values are infinite with one colour: with none finite there is nothing to make levels of.

    Returns  the legend's entry
    """
    ones = np.ma.masked_array(np.ones(values.shape), np.isnan(values))
    ax.contourf(x, y, ones, levels=[0.0, 2.0], colors=[INFINITE_COLOUR], corner_mask=True, zorder=1.0)
    return [Patch(facecolor=INFINITE_COLOUR, label=f"{title}: infinite")]


def _status_hatches(ax: Axes, x: Floats, y: Floats, status: NDArray[np.uint8]) -> list[Any]:
    """Hatch the cells that are reached and have no value, by their status. Returns the legend's entries."""
    handles: list[Any] = []
    with_hatches: dict[str, Any] = {"colors": "none", "zorder": 1.5}
    for kind, (text, hatch) in MARKS.items():
        has_status = (status == kind).astype(float)
        if has_status.any():
            drawn = ax.contourf(x, y, has_status, levels=[0.5, 1.5], hatches=[hatch], **with_hatches)
            drawn.set_edgecolor(style.GREY)
            drawn.set_linewidth(0.0)
            handles.append(Patch(facecolor="white", edgecolor=style.GREY, hatch=hatch, linewidth=0.5, label=text))
    return handles


def _direction_strokes(ax: Axes, dataset: xr.Dataset, name: str) -> list[Any]:
    """Draw short lines along each cell's extreme direction, on the plane. Returns the legend's entries."""
    if name not in dataset:
        return []
    x, y = dataset["x_m"].values, dataset["y_m"].values
    apart = max(float(np.ptp(x)), float(np.ptp(y))) / ARROWS
    columns, rows = _spaced_indices(x, apart), _spaced_indices(y, apart)
    directions = dataset[name].values[np.ix_(rows, columns)]
    axes = np.asarray(dataset.attrs["plane_axes"], dtype=float).reshape(2, 3)  # unit vectors of the plane
    on_plane = directions @ axes.T
    length = 0.36 * apart
    middle = np.stack(np.meshgrid(x[columns], y[rows]), axis=-1)
    keep = np.isfinite(on_plane).all(axis=-1)
    ends = np.stack([middle - length * on_plane, middle + length * on_plane], axis=-2)[keep]
    if not len(ends):
        return []
    halo = [withStroke(linewidth=2.4, foreground="white")]
    drawn = LineCollection(list(ends), colors=style.BLACK, linewidths=1.1, zorder=2.4, path_effects=halo)
    drawn.set_label(f"{dataset.attrs['direction']} direction")
    ax.add_collection(drawn)
    return [drawn]


def _spaced_indices(x: Floats, apart: float) -> Ints:
    """Indices of evenly spaced coordinates x (n,) that lie about `apart` from one another."""
    step = max(1, round(apart / float(x[1] - x[0])))
    return np.arange(min(step // 2, len(x) - 1), len(x), step)


def draw_areas(ax: Axes, area: CommonArea) -> list[Any]:
    """Where each requirement is met, hatched, and where all are, within a bold dotted outline.

    Returns  what a legend names
    """
    handles: list[Any] = []
    required = zip(area.requirements, area.units, area.regions, strict=True)
    for n, (requirement, unit, region) in enumerate(required):
        colour, dashes = style.LINES[1 + n % (len(style.LINES) - 1)]
        hatch = HATCHES[n % len(HATCHES)]
        measure = requirement.measure
        sign = "\u2265" if requirement.at_least else "\u2264"
        bound = as_written(requirement.value, unit)
        text = f"{measure.title} {sign} {bound}: {area_text(region.area)}"
        outline: dict[str, Any] = {"edgecolor": colour, "linewidth": 1.3, "linestyle": dashes, "facecolor": "none"}
        for path in _outline_paths(region.shape):
            # hatches take the edge's colour: once for them, faint, and once for the outline
            ax.add_patch(
                PathPatch(path, facecolor="none", edgecolor=colour, hatch=hatch, linewidth=0.0, alpha=0.45)
            )
            ax.add_patch(PathPatch(path, zorder=2.2, **outline))
        handles.append(Patch(hatch=hatch, label=text, **outline))
    dotted: dict[str, Any] = {"linestyle": (0, (0.1, 1.6)), "linewidth": 3.2}
    for path in _outline_paths(area.common.shape):
        ax.add_patch(
            PathPatch(path, facecolor="none", edgecolor=style.BLACK, zorder=2.6, capstyle="round", **dotted)
        )
    share = f"{percent(area.common.share)} of the reachable area"
    text = f"Common area: {area_text(area.common.area)}, {share}"
    handles.append(Line2D([], [], color=style.BLACK, dash_capstyle="round", label=text, **dotted))
    return handles


def _outline_paths(shape: Any) -> list[Path]:
    """The outlines of a shapely geometry's polygons, holes and all."""
    paths = []
    for part in getattr(shape, "geoms", [shape]):
        if part.geom_type != "Polygon" or part.is_empty:
            continue
        rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
        paths.append(Path.make_compound_path(*(Path(ring, closed=True) for ring in rings)))
    return paths


def _projected_mechanism(dataset: xr.Dataset, device: Device | None) -> ProjectedMechanism | None:
    """The mechanism in its reference posture, projected on the plane; None where it has none, or is not drawn."""
    if device is None or device.mechanism is None:
        return None
    from zwidth.errors import LoadError, PostureError
    from zwidth.model.posture import link_points

    try:
        posture = device.at(assembly=str(dataset.attrs["assembly"]) or None).posture
    except (PostureError, LoadError):
        return None
    mechanism = device.mechanism
    assert posture is not None
    axes = np.asarray(dataset.attrs["plane_axes"], dtype=float).reshape(2, 3)
    placed = link_points(mechanism, posture)
    strokes = [link_stroke(mechanism, placed, i) @ axes.T for i in drawn_links(mechanism)]
    return strokes, joint_points(mechanism, placed) @ axes.T, posture.position @ axes.T


def _draw_mechanism(ax: Axes, mechanism: ProjectedMechanism) -> None:
    """Draw the mechanism: links, joints as circles, and the handle as a diamond."""
    strokes, joints, handle = mechanism
    halo = [withStroke(linewidth=3.4, foreground="white")]
    for stroke in strokes:
        ax.plot(*stroke.T, color=style.BLACK, linewidth=1.6, solid_capstyle="round", path_effects=halo, zorder=3.0)
    round_: dict[str, Any] = {"marker": "o", "markersize": 5.0, "color": "white", "markeredgecolor": style.BLACK}
    ax.plot(*joints.T, linestyle="none", zorder=3.1, **round_)
    diamond: dict[str, Any] = {
        "marker": "D",
        "markersize": 6.0,
        "color": style.VERMILION,
        "markeredgecolor": "white",
    }
    ax.plot(*handle[:, None], linestyle="none", zorder=3.2, **diamond)


def _draw_rendered_direction(ax: Axes, mechanism: ProjectedMechanism, dataset: xr.Dataset) -> None:
    """Draw an arrow along the rendered direction, from the handle; none where it points at the viewer."""
    strokes, _, handle = mechanism
    axes = np.asarray(dataset.attrs["plane_axes"], dtype=float).reshape(2, 3)
    on_plane = axes @ np.asarray(dataset.attrs["direction"], dtype=float)
    if not np.linalg.norm(on_plane) > 1e-6:
        return
    size = 0.13 * float(np.ptp(np.vstack([*strokes, handle[None]]), axis=0).max())
    look = {"arrowstyle": "-|>", "color": style.VERMILION, "linewidth": 1.6, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", xy=tuple(handle + size * on_plane), xytext=tuple(handle), arrowprops=look, zorder=3.3)


def _view_limits(x: Floats, y: Floats, mechanism: ProjectedMechanism | None) -> tuple[float, ...]:
    """XMIN, XMAX, YMIN, YMAX [m] of what a map's figure shows: the map and the mechanism."""
    low, high = np.array([x[0], y[0]]), np.array([x[-1], y[-1]])
    if mechanism is not None:
        points = np.vstack([*mechanism[0], mechanism[1], mechanism[2][None]])
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    margin = 0.02 * float((high - low).max())
    return low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin


def _frame(ax: Axes, view: tuple[float, ...], first: str, second: str) -> None:
    """Show this view, x and y from and to [m], at equal scales, with the names of both axes."""
    ax.set_xlim(view[0], view[1])
    ax.set_ylim(view[2], view[3])
    ax.set_aspect("equal")
    style.label(ax.xaxis, first, "m", plain=True)
    style.label(ax.yaxis, second, "m", plain=True)


def draw_safe_walls(ax: Axes, table: SafeWalls) -> None:
    """The largest stiffness of each cell's rectangle, white where there is none; of cells in space those of the
    middle layer. Without a workspace: the bands of stiffness with their ranges of damping, and the rectangle."""
    if not (table.level > 0).any():
        style.draw_empty(ax, "no cell has safe walls")
    elif table.grid.dimensions == 0:
        _draw_bands(ax, table)
    else:
        _draw_cells(ax, table)


def _draw_cells(ax: Axes, table: SafeWalls) -> None:
    """Draw the largest stiffness of each cell, of a table with a workspace; of cells in space the middle layer."""
    grid = table.grid
    K, status = table.rectangles[:, 0].reshape(grid.counts[::-1]), table.status.reshape(grid.counts[::-1])
    lines = grid.lines(0), grid.lines(1)
    name = ""
    if grid.dimensions == 3:
        layer = grid.counts[2] // 2
        middle = 0.5 * float(grid.lines(2)[layer] + grid.lines(2)[layer + 1])
        K, status, name = K[layer], status[layer], f", {grid.names[2]} = {middle:.4g} m"
    if np.isnan(K).all():
        style.draw_empty(ax, f"no cell has safe walls{name}")
        return
    levels, norm, colours = style.bands_of(K)
    cells = np.ma.masked_invalid(K)
    ax.pcolormesh(*lines, cells, cmap=colours, norm=norm, edgecolors="white", linewidth=CELL_EDGE)
    style.colour_bar(ax, levels, norm, colours, f"Safe stiffness, every direction{name}", spoken_unit("N/m"))
    marked = hatch_cells(ax, *lines, status)
    ax.set_aspect("equal")
    style.label(ax.xaxis, grid.names[0], "m", plain=True)
    style.label(ax.yaxis, grid.names[1], "m", plain=True)
    if marked:
        _add_legend(ax, [status_patch(kind) for kind in marked], one_column=False)


def hatch_cells(ax: Axes, x: Floats, y: Floats, status: NDArray[np.uint8]) -> list[int]:
    """Hatch the cells that have no value. Returns the statuses that are hatched.

    x, y  (n + 1,), (m + 1,) borders of the cells;   status  (m, n)
    """
    marked = [kind for kind in HATCH_OF if (status == kind).any()]
    for kind in marked:
        here = np.ma.masked_where(status != kind, np.ones(status.shape))
        blank = ListedColormap(["white"])
        ax.pcolor(x, y, here, cmap=blank, hatch=HATCH_OF[kind], edgecolor=style.GREY, linewidth=0.0, zorder=1.5)
    return marked


def status_patch(status: int) -> Patch:
    """A legend's entry for cells of this status."""
    look: dict[str, Any] = {"facecolor": "white", "edgecolor": style.GREY, "linewidth": 0.5}
    return Patch(hatch=HATCH_OF[status], label=STATUS[status], **look)


def _draw_bands(ax: Axes, table: SafeWalls) -> None:
    """The safe walls as steps, a band of stiffness each, and within them the rectangle that the program gives.

    Of a table without a workspace, with its only cell 0 and its only table of directions, 0
    """
    bands = [table.stiffness_of_level(0, 0, level) for level in range(table.levels + 1)]
    low, high = table.ranges[0, 0].T
    has_walls = low <= high  # else the band has no safe damping
    steps: dict[str, Any] = {
        "baseline": np.where(has_walls, low, np.nan),
        "facecolor": style.STABLE,
        "edgecolor": style.BLACK,
    }
    text = "safe walls, by band of stiffness"
    ax.stairs(np.where(has_walls, high, np.nan), bands, fill=True, linewidth=0.8, label=text, **steps)
    rectangle = table.rectangle(0)
    low_text, high_text = quantity(rectangle.low, "N s/m"), quantity(rectangle.high, "N s/m")
    text = f"K up to {quantity(rectangle.stiffness, 'N/m')}, B from {low_text} to {high_text}"
    size = rectangle.stiffness, rectangle.high - rectangle.low
    ax.add_patch(
        Rectangle((0.0, rectangle.low), *size, fill=False, edgecolor=style.VERMILION, linewidth=1.6, label=text)
    )
    ax.set_xlim(0.0, 1.05 * bands[-1])
    ax.set_ylim(bottom=0.0)
    style.label(ax.xaxis, "Virtual stiffness K", "N/m")
    style.label(ax.yaxis, "Virtual damping B", "N s/m")
    style.legend_above(ax)
