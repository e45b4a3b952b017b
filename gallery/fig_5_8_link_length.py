"""Fig. 5.8: the largest stiffness over the length L1 of the first link, at (0, 0.25) m, from 0.1 to 0.35 m.

A minimum at L1 = 0.146 m, "the current value" (Table 3.2: 0.147 m), is claimed for "elbow down", and concluded
that longer links render stiffer walls. The scan does not hold the drawing of that assembly, nor whether the other
driven arm L3 changes along, nor what becomes of the arm's mass. So here is everything: L1 alone and L1 = L3, all
four assemblies, and three laws for mass and inertia: kept, grown as a bar of the same section (m ~ L, I ~ L^3),
and as Appendix B has it (both kept, the distal links slender rods).

Two kinds of low points are told apart:

- a minimum, where the curve is smooth and the drives hold the handle;
- a singularity, where both distal links lie in one line. The drives then do not hold the handle across it, J has
  no finite value, the motors' mass felt there is zero, and so is (5.7): no design, but a posture without control.

With L1 alone and both elbows on one side that happens at just L1 = L3 = 0.147 m, where the arms lie one on the
other: the flexible model's curve falls to zero there and rises on both sides, as the text describes. It tells
nothing of the device, which is not assembled so. Outward or inward there is no low point within the range but the
singularity of L1 = L3 = sqrt(y^2 + L2^2) and, next to it, a minimum of the rigid body: there, longer driven arms
render softer walls.

Run `python -m gallery.fig_5_8_link_length` to draw it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from gallery import five_bar_designs
from gallery.five_bar import SIDES, bundled
from gallery.shared_loops import write_page
from zwidth.measures import rigid_range, sprung_range

PERIOD = five_bar_designs.device.controller.sampling_period
LENGTH, Y = five_bar_designs.LENGTH, five_bar_designs.REFERENCE[1]
PRINTED = 0.146  # m
TIES = ("L1 alone", "L1 = L3")
MODELS = ("rigid", "flexible", "exact")
NEAR = 2  # steps of the grid
length = np.linspace(0.1, 0.35, 251)
both_in_line = float(np.hypot(Y, five_bar_designs.device.mechanism.links.tip[five_bar_designs.DISTAL_RIGHT, 0]))


@dataclass(frozen=True)
class LengthCurves:
    """Over the lengths, nan where the drives do not hold the handle [N/m].

    rigid, flexible, exact   (5.4) with links and rotors, (5.7), and the full model's
    singular   lengths at which the distal links lie in one line [m]
    throughout whether they do at every length
    """

    rigid: np.ndarray
    flexible: np.ndarray
    exact: np.ndarray
    singular: tuple[float, ...]
    always_singular: bool

    def low_points(self, model: str) -> list[float]:
        """Lengths of local minima between the ends, to the steps of the grid."""
        v = getattr(self, model)
        at, v = length[np.isfinite(v)], v[np.isfinite(v)]
        return at[1:-1][(v[1:-1] < v[:-2]) & (v[1:-1] < v[2:])].round(9).tolist()

    def by_singularity(self, at: float) -> bool:
        """Is a low point where the drives do not hold the handle, to the steps of the grid?"""
        return any(abs(at - where) <= (NEAR + 0.01) * (length[1] - length[0]) for where in self.singular)


def curve(tie: str, law: str, assembly: str) -> LengthCurves:
    """One curve of each model."""
    other = length if tie == "L1 = L3" else np.full_like(length, LENGTH)
    changed = five_bar_designs.with_lengths(length, other, law)
    full = five_bar_designs.operating_points(changed, assembly)
    judge = replace(bundled(), driven_length=(length, other)).at(five_bar_designs.REFERENCE, assembly)
    throughout = bool(np.all(np.abs(judge.distal_angle_sine) < 1e-9))
    return LengthCurves(
        rigid_range(full.effective.rigid_mass, PERIOD).stiffness_max,
        sprung_range(full.effective.motor_side_mass, full.effective.stiffness, PERIOD).stiffness_max,
        five_bar_designs.measure_values("stiffness_max", full).values,
        () if throughout else singularities(tie, assembly, judge.distal_angle_sine),
        throughout,
    )


def singularities(tie: str, assembly: str, between: np.ndarray) -> tuple[float, ...]:
    """Lengths at which the sine of the angle between the distal links passes zero."""

    def sine(L: float) -> float:
        return float(
            replace(bundled(), driven_length=(L, L if tie == "L1 = L3" else LENGTH))
            .at(five_bar_designs.REFERENCE, assembly)
            .distal_angle_sine
        )

    signs = np.flatnonzero(between[:-2] * between[2:] < 0.0)
    return tuple(sorted({round(brentq(sine, length[i], length[i + 2], xtol=1e-14), 9) for i in signs}))


curves = {
    (tie, law, assembly): curve(tie, law, assembly)
    for tie in TIES
    for law in five_bar_designs.LAWS
    for assembly in SIDES
}

low_points = {
    key: {model: found.low_points(model) for model in MODELS}
    for key, found in curves.items()
    if not found.always_singular
}
# The lengths of low points that are no singularities.
minima = {
    (*key, model): [at for at in each if model == "rigid" or not curves[key].by_singularity(at)]
    for key, lows in low_points.items()
    for model, each in lows.items()
}


def value(key: tuple[str, str, str], model: str, at: float) -> float:
    """A curve's value at a length of the grid [N/m]."""
    return float(getattr(curves[key], model)[np.argmin(np.abs(length - at))])


ALONE, TIED = ("L1 alone", "kept", "elbows-out"), ("L1 = L3", "kept", "elbows-out")
DOWN = ("L1 alone", "kept", "elbows-right")
# How far the flexible model falls next to the singularity, as a share of what it has at the lower end.
fall = value(DOWN, "flexible", LENGTH + 1e-3) / value(DOWN, "flexible", length[0])


def draw(figure) -> None:
    """L1 alone and L1 = L3, all assemblies, mass and inertia kept."""
    from zwidth.show import GREY, LINES

    titles = {"rigid": "Rigid (5.4)", "flexible": "Flexible (5.7)", "exact": "Full model, exact"}
    axes = figure.subplots(3, 2, sharex=True, sharey="row")
    for column, tie in enumerate(TIES):
        for row, (model, title) in enumerate(titles.items()):
            ax = axes[row, column]
            for assembly, (colour, dashes) in zip(SIDES, LINES, strict=False):
                values = getattr(curves[tie, "kept", assembly], model)
                if np.isfinite(values).any():
                    ax.plot(length, values / 1e3, color=colour, linestyle=dashes, label=assembly)
            ax.axvline(LENGTH, color=GREY, linewidth=0.8, zorder=0.5)
            ax.set_yscale("log")
            ax.set_ylim((10.0, 400.0) if model == "rigid" else (0.01, 40.0))
            ax.yaxis.set_major_formatter(lambda v, _: f"{v:g}")
            ax.set_title(f"{title}, {tie}", loc="left", fontsize=8.0)
            if column == 0:
                ax.set_ylabel("Largest stiffness [kN/m]")
    for ax in axes[-1]:
        ax.set_xlabel("Length of the driven link L1 [m]")
    axes[0, 0].annotate(
        "as built", (LENGTH, 14.0), xytext=(4, 0), textcoords="offset points", color=GREY, fontsize=8.0
    )
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper left", ncols=4, frameon=False, fontsize=8.0, handlelength=2.6
    )


if __name__ == "__main__":
    for key, lows in low_points.items():
        where = ", ".join(f"{at:.4f}" for at in curves[key].singular) or "none"
        print(*key, {model: each for model, each in lows.items() if each}, "singular at:", where)
    print("minima that are no singularity:", {key: each for key, each in minima.items() if each})
    write_page(draw, "fig-5-8-link-length", 7.2, 7.4)
