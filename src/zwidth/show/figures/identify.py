"""Figures of identifications: what was measured and what the fitted device says of it, by the kind.

Measured torques of a mechanism's joints beside those that its motion and the identified numbers predict.

A measured stability boundary with what was fitted to it: the chart before and after, points, what remains.

Friction of a joint over its velocity, as measured and as fitted, and how the unseen motion was predicted.

The measured impedance at the handle with its band, beside the predicted one.

The response that modes were identified from, and the fitted one.

A response from raw sweeps: magnitude over frequency, with the 95 % error by its coherence.

Torque over angle of a drive's transmission, measured and fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from zwidth.identify.identification import Identification
from zwidth.identify.joint.friction import JointIdentification
from zwidth.model.response import relative_error
from zwidth.show.figures import style
from zwidth.show.figures.stability import frame
from zwidth.show.units import quantity, spoken_unit


def draw_identification(ax: Axes, result: Identification) -> None:
    """One identification into axes; where nothing was fitted the reason."""
    if result.reason is not None:
        style.draw_empty(ax, "nothing was fitted")
        return
    DRAWINGS[result.kind](ax, result)


MEASURED: Final = "measured_"
PREDICTED: Final = "predicted_"
APART: Final = 1.15  # of the largest torque, between two joints' zero lines
SHOWN: Final = 1500  # samples: more would be a black band


def draw_arm(ax: Axes, identification: Identification) -> None:
    """The unseen part's torques, each joint above the one before, measured in black and predicted in colour.

    Each joint is drawn over its own largest torque; its scale is in the legend.
    """
    curves = identification.curves
    measured = [name for name in curves if name.startswith(MEASURED)]
    if not measured:
        style.draw_empty(ax, identification.reason or "nothing was fitted")
        return
    first_samples = slice(0, SHOWN)
    time = np.asarray(curves["time_s"])[first_samples]
    for k, name in enumerate(measured):
        quantity, _, drive = name.removeprefix(MEASURED).partition(".")
        unit = "N" if quantity == "force_N" else "N m"
        torque = np.asarray(curves[name])[first_samples]
        predicted = np.asarray(curves[name.replace(MEASURED, PREDICTED, 1)])[first_samples]
        scale = float(np.max(np.abs(torque), initial=0.0)) or 1.0
        zero = -2.0 * APART * k
        colour, dashes = style.LINES[1 + k % (len(style.LINES) - 1)]
        ax.axhline(zero, color=style.BLACK, linewidth=0.4)
        ax.plot(time, zero + torque / scale, color=style.BLACK, linewidth=0.9, label="measured" if k == 0 else "")
        ax.plot(
            time,
            zero + predicted / scale,
            color=colour,
            linestyle=dashes,
            label=f"predicted, {drive} (to {scale:.3g} {unit})",
        )
    ax.set_yticks([-2.0 * APART * k for k in range(len(measured))])
    ax.set_yticklabels(["0"] * len(measured))
    style.label(ax.xaxis, "Time", "s")
    ax.set_ylabel("Torque over its largest")
    # of the first sentence on what was left out, what stands before its reasons
    for text in identification.left_out[:1]:
        ax.text(0.01, 0.01, text.partition(":")[0], transform=ax.transAxes, fontsize=6.5)
    style.legend_above(ax, columns=2)


# kinds of points: marker, colour, whether it is filled, and title
POINT_STYLES = (
    (("lower", "upper", "edge"), "o", style.VERMILION, False, "measured edge, damping bisected"),
    (("tip",), "^", style.GREEN, False, "measured tip, stiffness bisected"),
    (("stable",), "P", style.BLUE, True, "tried, stable"),
    (("unstable",), "X", style.BLACK, False, "tried, unstable"),
)
MARGIN = 0.12  # of the points' extent that is shown beyond them


def draw_boundary(ax: Axes, identification: Identification) -> None:
    """The boundary as fitted, and as the file had it, with the measured points and bars to the fitted edge."""
    if not identification.curves:
        style.draw_empty(ax, identification.reason or "nothing was fitted")
        return
    _draw_outline(ax, identification.details["boundary_before"], style.GREY, (0, (4, 2)), "chart before")
    _draw_outline(ax, identification.details["boundary"], style.BLACK, "-", "chart fitted")
    columns = {name: np.array(values) for name, values in identification.curves.items()}
    K, B, kind = columns["stiffness_N_per_m"], columns["damping_Ns_per_m"], columns["kind"]
    fitted = columns["fitted_stiffness_N_per_m"], columns["fitted_damping_Ns_per_m"]
    on_edge = np.isfinite(fitted[0])
    for k in np.flatnonzero(on_edge):
        ax.plot([K[k], fitted[0][k]], [B[k], fitted[1][k]], color=style.VERMILION, linewidth=1.0, zorder=3.0)
    for kinds, marker, colour, filled, title in POINT_STYLES:
        chosen = np.isin(kind, kinds)
        if chosen.any():
            ax.plot(
                K[chosen],
                B[chosen],
                marker=marker,
                markersize=4.5,
                markerfacecolor=colour if filled else "white",
                markeredgecolor=colour,
                linestyle="none",
                zorder=4.0,
                label=title,
            )
    frame(ax, _default_window(K, B), empty=False)
    style.legend_above(ax, columns=2)


def _draw_outline(ax: Axes, arcs: Sequence[dict[str, Any]], colour: str, dashes: Any, title: str) -> None:
    """Draw the arcs of a boundary, as a document has them, in one line style; the legend names them once."""
    for n, arc in enumerate(arcs):
        walls = arc["stiffness_N_per_m"], arc["damping_Ns_per_m"]
        ax.plot(*walls, color=colour, linestyle=dashes, linewidth=1.0, label="" if n else title)


def _default_window(K: np.ndarray, B: np.ndarray) -> tuple[float, float, float, float]:
    """KMIN, KMAX [N/m], BMIN, BMAX [N s/m] of what is shown: the points, K = 0 and B = 0, and a margin."""
    ends = []
    for values in (K, B):
        low, high = min(float(np.min(values)), 0.0), max(float(np.max(values)), 0.0)
        ends += [low - MARGIN * (high - low) * (low < 0.0), high + MARGIN * (high - low)]
    return ends[0], ends[1], ends[2], ends[3]


INSET: Final = (0.6, 0.1, 0.38, 0.3)  # of the predicted motion, where friction has no points: backward is below
MOST_POINTS: Final = 1500  # drawn of the measured friction
WIDEST: Final = 1.08  # times the largest velocity, to which the fitted lines run
SHOWN_SAMPLES: Final = 600  # samples of the unseen motion


def draw_friction(ax: Axes, identification: JointIdentification) -> None:
    """Measured friction in segments of the motion, the fitted levels and slopes, and in an inset unseen motion."""
    angular = identification.angular
    velocity, friction = identification.velocity, identification.friction
    stride = max(len(velocity) // MOST_POINTS, 1)
    ax.plot(
        velocity[::stride],
        friction[::stride],
        ".",
        color=style.GREY,
        markersize=2.5,
        alpha=0.5,
        label="measured: force less inertia",
        zorder=1.5,
    )
    free = identification.details.get("force") is None  # not driven: friction is known over mass alone
    reach = WIDEST * float(np.max(np.abs(velocity), initial=0.0)) or 1.0
    # level of the dry friction and slope of the viscous one, by the sign of the velocity
    for (level, slope), side, colour, name in (
        (identification.lines[0], 1.0, style.VERMILION, "forward"),
        (identification.lines[1], -1.0, style.BLUE, "backward"),
    ):
        if np.isfinite(level):
            ends = np.array([0.0, side * reach])
            ax.plot(ends, side * level + slope * ends, color=colour, linewidth=1.6, label=f"fitted {name}")
    ax.axhline(0.0, color=style.BLACK, linewidth=0.6, zorder=1.0)
    ax.axvline(0.0, color=style.BLACK, linewidth=0.6, zorder=1.0)
    style.label(ax.xaxis, "Velocity", "rad/s" if angular else "m/s")
    if free:
        style.label(ax.yaxis, "Friction over mass", "rad/s^2" if angular else "m/s^2", plain=True)
    else:
        style.label(ax.yaxis, "Friction", "N m" if angular else "N")
    _draw_unseen_motion(ax, identification)
    style.legend_above(ax, columns=3)


def _draw_unseen_motion(ax: Axes, identification: JointIdentification) -> None:
    """The first window that was not fitted, measured and predicted, in an inset."""
    names = (
        ("angle_rad", "angle_predicted_rad") if identification.angular else ("position_m", "position_predicted_m")
    )
    time, measured, predicted = (np.asarray(identification.curves[name]) for name in ("time_s", *names))
    steps = np.diff(time)
    # a window ends where a sample is missing, or where time starts again
    breaks = np.flatnonzero((steps > 1.5 * np.median(steps)) | (steps <= 0.0))
    end = min(int(breaks[0]) + 1 if len(breaks) else len(time), SHOWN_SAMPLES)
    inset = ax.inset_axes(INSET, zorder=5.0)
    inset.plot(time[:end], measured[:end], color=style.GREY, linewidth=2.2, label="measured")
    inset.plot(time[:end], predicted[:end], color=style.BLACK, linewidth=0.8, label="predicted")
    inset.tick_params(labelsize=6.5, length=2.0, pad=1.5)
    inset.locator_params(nbins=3)
    style.label(inset.xaxis, "Time", "s")
    style.label(
        inset.yaxis, "Angle" if identification.angular else "Position", "rad" if identification.angular else "m"
    )
    for axis in (inset.xaxis, inset.yaxis):
        axis.label.set_fontsize(6.5)
        axis.labelpad = 1.0
    share = f"{100.0 * identification.validation:.4g}"
    inset.set_title(
        f"unseen {quantity(float(time[end - 1] - time[0]), 's')}: {share} % predicted", fontsize=6.5, pad=2.0
    )


STATE_STYLES = (("on", style.BLUE, "wall on"), ("off", style.VERMILION, "wall off"))
FLOOR = 1e-3  # share of the magnitude below which the band's lower end is not drawn


def draw_identified_impedance(ax: Axes, identification: Identification) -> None:
    """Magnitudes of impedance over frequency, wall on and off: measured with bands, predicted in black."""
    if not identification.curves:
        style.draw_empty(ax, identification.reason or "nothing was measured")
        return
    columns = {name: np.array(values) for name, values in identification.curves.items()}
    for state, colour, title in STATE_STYLES:
        of_state = columns["wall"] == state
        if not of_state.any():
            continue
        f = columns["frequency_Hz"][of_state]
        size = np.hypot(columns["impedance_real_Ns_per_m"][of_state], columns["impedance_imag_Ns_per_m"][of_state])
        low = np.maximum(columns["impedance_low_Ns_per_m"][of_state], FLOOR * size)
        ax.fill_between(
            f, low, columns["impedance_high_Ns_per_m"][of_state], color=colour, alpha=0.25, linewidth=0.0
        )
        ax.loglog(f, size, color=colour, label=f"measured, {title}, with its band (95 % each)")
        predicted = np.hypot(
            columns["predicted_real_Ns_per_m"][of_state], columns["predicted_imag_Ns_per_m"][of_state]
        )
        if np.isfinite(predicted).any():
            dashes = "-" if state == "off" else (0, (5, 1.5))
            ax.loglog(
                f, predicted, color=style.BLACK, linestyle=dashes, linewidth=0.9, label=f"predicted, {title}"
            )
    f = columns["frequency_Hz"]
    ax.set_xlim(float(np.min(f)), float(np.max(f)))
    style.number_logarithmic(ax.xaxis, *ax.get_xlim())
    style.number_logarithmic(ax.yaxis, *ax.get_ylim())
    ax.set_xlabel("Frequency [Hz]")
    ax.set_ylabel(f"Impedance, magnitude [{spoken_unit('N s/m')}]")
    style.legend_above(ax, columns=2)


GOOD = 0.6  # coherence above which a point is drawn full


def draw_modes(ax: Axes, identification: Any) -> None:
    """Magnitude of the measured response over frequency, paler where the coherence is low or the response is not
    used, the fitted one, and the natural frequencies; both axes logarithmic."""
    curves = identification.curves
    if not curves:
        style.draw_empty(ax, "nothing was fitted")
        return
    f, coherence = np.array(curves["frequency_Hz"]), np.array(curves["coherence"])
    measured = np.hypot(curves["measured_real"], curves["measured_imag"])
    fitted = np.hypot(curves["fitted_real"], curves["fitted_imag"])
    good = (coherence > GOOD) & np.array(curves["used"])
    for chosen, colour, text in (
        (good, style.BLUE, "measured"),
        (~good, style.GREY, f"measured, coherence below {GOOD:g} or not used"),
    ):
        if np.any(chosen & (measured > 0.0)):
            ax.loglog(f[chosen], measured[chosen], ".", markersize=2.5, color=colour, label=text)
    ax.loglog(f, fitted, color=style.VERMILION, label="fitted")
    for number, mode in enumerate(
        estimate for estimate in identification.estimates if estimate.name.startswith("natural frequency")
    ):
        if f[0] <= mode.value <= f[-1]:
            name = "" if number else "natural frequencies"
            ax.axvline(mode.value, color=style.GREY, linewidth=0.6, linestyle=(0, (4, 2)), zorder=1.5, label=name)
    ax.set_xlim(f[0], f[-1])
    style.number_logarithmic(ax.xaxis, *ax.get_xlim())
    ax.set_xlabel("Frequency [Hz]")
    unit = "rad/(N m)" if identification.details.get("turns") else "m/N"
    ax.set_ylabel(f"Response from command to reading [{unit}]")
    style.legend_above(ax, columns=2)


DISK = float(np.sqrt(-2.0 * np.log(0.05)))  # deviations that hold 95 % of a circular error
COHERENT: Final = 0.5  # coherence below which a frequency is marked, and does not set the view
BESIDE: Final = 2.0  # times the coherent response, above and below, that is shown


def draw_response(ax: Axes, identification: Identification) -> None:
    """|P| of each sweep, of the first one with its error at each frequency, and where it cannot be relied on.

    The view is that of the coherent frequencies: elsewhere the noise is drawn as far as it lies in it.
    """
    curves = {name: np.asarray(values) for name, values in identification.curves.items()}
    f, coherence = curves["frequency_Hz"], curves["coherence"]
    magnitude = np.hypot(curves["real_m_per_N"], curves["imag_m_per_N"])
    averages = float(identification.details["averages"])
    # 0.9: the lower end stays above 0, on a logarithmic axis
    error = np.minimum(DISK * relative_error(np.maximum(coherence, 1e-6), averages), 0.9)
    sweep = curves.get("sweep", np.ones(len(f)))
    sweeps = np.unique(sweep)
    for number, sweep_number in enumerate(sweeps):
        colour, dashes = style.LINES[number % len(style.LINES)]
        name = f"sweep {sweep_number:g}" if len(sweeps) > 1 else "|P|"
        ax.loglog(
            f[sweep == sweep_number],
            magnitude[sweep == sweep_number],
            color=colour,
            linestyle=dashes,
            linewidth=1.1,
            label=name,
        )
    first = sweep == sweeps[0]
    ends = (magnitude * (1.0 - error))[first], (magnitude * (1.0 + error))[first]
    text = "95 % at each frequency" + (f", sweep {sweeps[0]:g}" if len(sweeps) > 1 else "")
    ax.fill_between(f[first], *ends, color=style.BLUE, alpha=0.25, linewidth=0.0, label=text)
    poor = coherence < COHERENT
    if poor.any():
        ax.plot(
            f[poor],
            magnitude[poor],
            color=style.VERMILION,
            marker="x",
            markersize=3.0,
            linestyle="none",
            label="not coherent",
        )
    seen = (
        magnitude[(magnitude > 0.0) & ~poor] if np.any((magnitude > 0.0) & ~poor) else magnitude[magnitude > 0.0]
    )
    if len(seen):
        ax.set_ylim(float(seen.min()) / BESIDE, float(seen.max()) * BESIDE)
    ax.set_xlim(float(np.min(f)), float(np.max(f)))
    style.number_logarithmic(ax.xaxis, *ax.get_xlim())
    ax.set_xlabel("Frequency [Hz]")
    ax.set_ylabel("Position over force [m/N]")
    ax.grid(color=style.GREY, alpha=0.2, linewidth=0.5)
    style.legend_above(ax, columns=3)


COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.PURPLE, style.ORANGE)


def draw_identified_stiffness(ax: Axes, result: Identification) -> None:
    """Averages of the strokes as marks, hollow where they were not fitted, and the fitted spring as a line."""
    curves = {name: np.asarray(values) for name, values in result.curves.items()}
    drives = list(dict.fromkeys(curves["drive"].tolist()))
    for number, drive in enumerate(drives):
        of_drive = curves["drive"] == drive
        name = f"{drive}, " if len(drives) > 1 else ""
        colour = COLOURS[number % len(COLOURS)] if len(drives) > 1 else style.BLUE
        for fitted, word in ((1.0, "fitted"), (0.0, "predicted")):
            shown = of_drive & (curves["fitted"] == fitted)
            ax.scatter(
                curves["angle_rad"][shown],
                curves["torque_Nm"][shown],
                s=9.0,
                facecolors=colour if fitted else "none",
                edgecolors=colour,
                linewidths=0.6,
                label=f"{name}measured, {word}",
            )
        _draw_spring(ax, curves, of_drive, "fitted spring and friction" if number == 0 else "")
    ax.axhline(0.0, color=style.GREY, linewidth=0.6)
    ax.axvline(0.0, color=style.GREY, linewidth=0.6)
    style.label(ax.xaxis, "Angle at the motor's shaft", "rad")
    style.label(ax.yaxis, "Torque", "N m")
    style.legend_above(ax, columns=3)


def _draw_spring(ax: Axes, curves: dict[str, np.ndarray], of_drive: np.ndarray, text: str) -> None:
    """Draw the fitted torque [N m] along each stroke of one drive.

    of_drive  (k,) which rows of the curves are of this drive
    """
    # a stroke begins where its number, `motion`, changes
    starts = np.flatnonzero(np.diff(curves["motion"][of_drive])) + 1
    angle, torque = curves["angle_rad"][of_drive], curves["fitted_torque_Nm"][of_drive]
    for number, (first, behind) in enumerate(pairwise([0, *starts.tolist(), len(angle)])):
        ax.plot(
            angle[first:behind],
            torque[first:behind],
            color=style.BLACK,
            linewidth=0.9,
            label="" if number else text,
        )


# Kind of identification -> the function that draws it.
DRAWINGS: Final[dict[str, Callable[[Axes, Any], None]]] = {
    "arm": draw_arm,
    "boundary": draw_boundary,
    "friction": draw_friction,
    "impedance": draw_identified_impedance,
    "mass": draw_friction,  # one fit finds both
    "modes": draw_modes,
    "response": draw_response,
    "stiffness": draw_identified_stiffness,
}
