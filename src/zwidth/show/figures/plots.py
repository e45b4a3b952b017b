"""The drawing function of each kind of result, for `result.plot()` and notebooks.

A function `_draw_...` draws one result of the kind in its name into axes, and imports what it needs when called.
"""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from itertools import count
from typing import Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes

from zwidth.show.figures.caption import caption_of_result, write_caption
from zwidth.show.figures.style import BLACK, GREY, VERMILION, context, figure, inline_svg, label
from zwidth.show.units import speaking_of_moments

Window = tuple[float, float, float, float]
Draw = Callable[[Axes, Any], None]

SIZE: Final = (5.6, 3.9)  # inches of a figure, but of those with more above the axes, or with equal axes
SIZES: Final = {
    "BoundsComparison": (6.2, 6.4),
    "CommonChart": (5.6, 4.6),
    "RobustStudy": (5.6, 4.6),
    "ByDirection": (4.6, 5.2),
    "Guarantees": (6.2, 4.2),
}
FIGURE_NUMBERS: Final = count(1)  # numbers the figures that notebooks hold: ids in one page must differ


def plot(result: Any, ax: Axes | None = None) -> Axes:
    """Draw a result into axes, or into those of a new figure of pyplot's, with its caption; returns the axes.

    Raises  TypeError  for what has no drawing
    """
    draw = drawing_of(result)
    with speaking_of_moments(_is_about_moments(result)):
        if ax is not None:
            draw(ax, result)
            return ax
        from matplotlib import pyplot

        with context():
            drawing, ax = pyplot.subplots(figsize=size_of(result), layout="constrained")
            draw(ax, result)
            write_caption(drawing, caption_of_result(result))
        return ax


def notebook(result: Any) -> str:
    """A result as HTML: its few lines, and beneath its figure, if results of its kind have one."""
    lines = f"<pre>{escape(repr(result))}</pre>"
    if not any(kind.__name__ in DRAWINGS for kind in type(result).__mro__):
        return lines
    drawing, ax = figure(*size_of(result))
    with context(), speaking_of_moments(_is_about_moments(result)):
        drawing_of(result)(ax, result)
        write_caption(drawing, caption_of_result(result))
    picture = inline_svg(drawing, f"zwidth-{next(FIGURE_NUMBERS)}", repr(result).splitlines()[0])
    return f"{lines}\n<div style='max-width: 40em'>{picture}</div>"


def _is_about_moments(result: Any) -> bool:
    """Whether a result is about moments about an axis."""
    return result.operating_point is not None and result.operating_point.turns


def size_of(result: Any) -> tuple[float, float]:
    """Width and height of the figure of a result of this kind [inches]."""
    return next((SIZES[kind.__name__] for kind in type(result).__mro__ if kind.__name__ in SIZES), SIZE)


def drawing_of(result: Any) -> Draw:
    """The drawing function for results of this kind. Raises TypeError where there is none."""
    for kind in type(result).__mro__:
        if kind.__name__ in DRAWINGS:
            return DRAWINGS[kind.__name__]
    raise TypeError(f"a {type(result).__name__} has no drawing")


def draw_any_chart(ax: Axes, chart: Any, window: Window | None = None) -> None:
    """The chart of one direction, of several, or by a frequency response."""
    if type(chart).__name__ == "MeasuredChart":
        from zwidth.show.figures.stability import draw_measured_chart

        draw_measured_chart(ax, chart, window=window)
        return
    from zwidth.show.figures.stability import draw_chart

    draw_chart(ax, chart, window=window)


def _draw_common_chart(ax: Axes, chart: Any) -> None:
    from zwidth.show.figures.stability import draw_robust

    draw_robust(ax, chart)


def _draw_robust_study(ax: Axes, study: Any) -> None:
    from zwidth.show.figures.stability import draw_robust

    draw_robust(ax, study.chart, study.members)


def _draw_by_direction(ax: Axes, by_direction: Any) -> None:
    from zwidth.show.figures.polar import draw_polar

    draw_polar(
        ax, by_direction, by_direction.angles, (by_direction.plane[:1] or "x", by_direction.plane[1:] or "y")
    )


def _draw_load_path(ax: Axes, path: Any) -> None:
    """The outlines; `zwidth load --output` draws stiffness and growth beside them."""
    from zwidth.show.figures.load_path import draw_outlines

    draw_outlines(ax, path)


def _draw_bending(ax: Axes, result: Any) -> None:
    """The charts with bending and with rigid links over each other."""
    from zwidth.show.figures.stability import draw_models
    from zwidth.show.figures.style import draw_empty

    charts = {"bending links": result.bent.chart, "rigid links": result.rigid.chart}
    known = {name: chart for name, chart in charts.items() if chart is not None}
    if known:
        draw_models(ax, known)
    else:
        draw_empty(ax, result.bent.reason)


def _draw_bounds_comparison(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.bounds import draw_bounds

    draw_bounds(ax, result.bounds, result.chart)


def _draw_guarantees(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.guarantees import draw_guarantees

    draw_guarantees(ax, result)


def _draw_goal(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.sensitivity import draw_goal

    draw_goal(ax, result)


def _draw_sensitivities(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.sensitivity import draw_sensitivities

    draw_sensitivities(ax, result)


def _draw_wall_verdicts(ax: Axes, verdicts: Any) -> None:
    """The walls (K, B) as marks: discs where stable, crosses where not, grey squares where undecided."""
    K, B, names = verdicts.stiffness.ravel(), verdicts.damping.ravel(), np.array(verdicts.names)
    for name, style in (
        ("stable", {"marker": "o", "color": BLACK}),
        ("unstable", {"marker": "x", "color": VERMILION}),
        ("undecided", {"marker": "s", "color": GREY, "facecolors": "none"}),
    ):
        here = names == name
        if here.any():
            ax.scatter(K[here], B[here], s=16.0, label=name, **style)  # type: ignore[arg-type]
    label(ax.xaxis, "Virtual stiffness", "N/m")
    label(ax.yaxis, "Virtual damping", "N s/m")
    ax.legend(frameon=False, fontsize=8.0)


def _draw_measure_values(ax: Axes, result: Any) -> None:
    """A measure's values: marks in order for one or a row, colours for a plane of points."""
    values = np.asarray(result.values, dtype=float)
    if values.ndim == 2:
        image = ax.imshow(values, origin="lower", aspect="auto", cmap=colormaps["viridis"])
        assert ax.figure is not None
        ax.figure.colorbar(image, ax=ax)
        return
    row = np.atleast_1d(values).ravel()
    ax.plot(np.arange(len(row)), row, linestyle="none", marker="o", color=BLACK, markersize=4.0)
    ax.set_xlabel("operating point")
    ax.set_ylabel("value")


def _draw_description(ax: Axes, description: Any) -> None:
    """Natural frequencies as lines along a frequency axis, with their damping ratios."""
    frequencies = np.asarray(description.natural_frequencies, dtype=float)
    ratios = description.damping_ratios or [None] * len(frequencies)
    for frequency, ratio in zip(frequencies, ratios, strict=True):
        ax.axvline(frequency, color=BLACK, linewidth=1.2)
        text = "rigid motion" if frequency == 0.0 else "" if ratio is None else f"damping ratio {ratio:.3g}"
        ax.annotate(text, (frequency, 0.5), rotation=90.0, va="center", ha="right", fontsize=8.0)
    ax.set_ylim(0.0, 1.0)
    ax.set_yticks([])
    label(ax.xaxis, "Natural frequency", "Hz")


def _draw_felt_wall(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.felt import draw_impedance

    felt = np.full(len(result.frequency), np.nan + 0j) if result.felt_impedance is None else result.felt_impedance
    draw_impedance(ax, result.frequency, felt, result.commanded_impedance, result.free_motion_impedance)


def _draw_experiment(ax: Axes, experiment: Any) -> None:
    from zwidth.show.figures.experiment import draw_experiment, measured_bars, own_bars

    users = experiment.user_points
    own = () if users is None else own_bars(compared.point for compared in users.points)
    draw_experiment(ax, measured_bars(experiment.points), experiment.chart, own)


def _draw_limit_cycles(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.limit_cycles import draw_limit_cycles

    draw_limit_cycles(ax, result)


def _draw_couplings(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.guarantees import draw_couplings

    draw_couplings(ax, result)


def _draw_contact_simulation(ax: Axes, result: Any) -> None:
    _draw_time_response(ax, result.response)


def _draw_time_response(ax: Axes, response: Any) -> None:
    """Position over time; `zwidth simulate --output` draws all panels."""
    from zwidth.show.figures.contact_response import draw_position

    draw_position(ax, response)


def _draw_felt_chart(ax: Axes, chart: Any) -> None:
    from zwidth.show.figures.felt import draw_felt_chart

    draw_felt_chart(ax, chart)


def _draw_region(ax: Axes, region: Any) -> None:
    from zwidth.show.figures.guarantees import draw_region

    draw_region(ax, region)


def _draw_eigenvalue_paths(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.stability import draw_eigenvalue_paths

    draw_eigenvalue_paths(ax, result)


def _draw_validity(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.sensitivity import draw_validity

    draw_validity(ax, result)


def _draw_sweep(ax: Axes, result: Any) -> None:
    """The first column; `zwidth sweep --output` draws all columns."""
    from zwidth.show.figures.study import draw_first_column

    draw_first_column(ax, result.dataset())


def _draw_common_area(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.map import draw_areas

    handles = draw_areas(ax, result)
    ax.autoscale_view()
    ax.set_aspect("equal")
    for axis, name in ((ax.xaxis, result.axes[0]), (ax.yaxis, result.axes[1])):
        label(axis, name, "m", plain=True)
    ax.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.02), fontsize=8.0, frameon=False)


def _draw_mechanism_motion(ax: Axes, motion: Any) -> None:
    """The handle's path at the surface; `zwidth move --output` draws all panels."""
    from zwidth.show.figures.mechanism_motion import draw_motion_close_up

    draw_motion_close_up(ax, motion)


def _draw_identification(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.identify import draw_identification

    draw_identification(ax, result)


def _draw_tolerance_study(ax: Axes, result: Any) -> None:
    """The bands; `zwidth tolerance --output` draws what each tolerance is worth below them."""
    from zwidth.show.figures.tolerance import draw_bands

    draw_bands(ax, result)


def _draw_optimisation(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.optimise import draw_optimisation

    draw_optimisation(ax, result)


def _draw_safe_walls(ax: Axes, result: Any) -> None:
    from zwidth.show.figures.map import draw_safe_walls

    draw_safe_walls(ax, result)


DRAWINGS: Final[dict[str, Draw]] = {
    "Chart": draw_any_chart,
    "CommonChart": _draw_common_chart,
    "RobustStudy": _draw_robust_study,
    "ByDirection": _draw_by_direction,
    "LoadPath": _draw_load_path,
    "Bending": _draw_bending,
    "BoundsComparison": _draw_bounds_comparison,
    "Guarantees": _draw_guarantees,
    "Sensitivities": _draw_sensitivities,
    "Goal": _draw_goal,
    "WallVerdicts": _draw_wall_verdicts,
    "MeasureValues": _draw_measure_values,
    "Description": _draw_description,
    "FeltWall": _draw_felt_wall,
    "Experiment": _draw_experiment,
    "LimitCyclePrediction": _draw_limit_cycles,
    "Couplings": _draw_couplings,
    "ContactSimulation": _draw_contact_simulation,
    "TimeResponse": _draw_time_response,
    "MechanismMotion": _draw_mechanism_motion,
    "FeltChart": _draw_felt_chart,
    "Region": _draw_region,
    "EigenvaluePaths": _draw_eigenvalue_paths,
    "Validity": _draw_validity,
    "Sweep": _draw_sweep,
    "CommonArea": _draw_common_area,
    "Identification": _draw_identification,
    "ToleranceStudy": _draw_tolerance_study,
    "Optimisation": _draw_optimisation,
    "SafeWalls": _draw_safe_walls,
}
