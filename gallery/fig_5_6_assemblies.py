"""Figs. 5.6 and 5.7: largest stiffness and area of stable walls over the base distance d, elbow up and elbow down.

The handle stays at (0, 0.25) m. Of the two arms each may have its elbow on either side: four assemblies. The scan
does not hold the drawing that says which two are "up" and "down"; all four are here.

- flexible (Fig. 5.6): (5.7) and (5.8), the motors' mass on the drives' spring; and exactly, of the
  full model as it is bundled;
- rigid (Fig. 5.7): (5.4) and (5.5), with the mass of links and rotors and, as (5.4) prints it, of
  the links alone.

The position can be reached for |d| < 0.478 m only. There both arms are stretched and the handle cannot move along
y: its mass, and with it every stiffness, grows without end. That end is a singularity, no design. Arms outward at
d and arms inward at -d are the same mechanism with its arms renamed: at x = 0 the flexible model's curves are
mirror images, the rigid body's almost (the distal links' centres of mass lie beside them, on the other side). With
both elbows on one side the arms coincide at d = 0: the drives do not hold the handle, and the stiffness of the
flexible model falls to zero.

Run `python -m gallery.fig_5_6_assemblies` to draw them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gallery import five_bar_designs
from gallery.five_bar import SIDES, bundled, closed_form
from gallery.shared_loops import write_page
from zwidth.measures import rigid_range, sprung_range

PERIOD = five_bar_designs.device.controller.sampling_period
distance = np.linspace(-0.475, 0.475, 191)


@dataclass(frozen=True)
class AssemblyCurves:
    """Over the distances, nan where there is no posture; stiffness [N/m], area [N^2 s/m^2].

    rigid, links  (5.4) with the mass of links and rotors, and of the links alone; with their areas (5.5)
    flexible      (5.7), with its area (5.8);   exact  of the full model
    isotropy      condition number of the Jacobian
    """

    rigid: np.ndarray
    rigid_area: np.ndarray
    links: np.ndarray
    links_area: np.ndarray
    flexible: np.ndarray
    flexible_area: np.ndarray
    exact: np.ndarray
    isotropy: np.ndarray


def curves_of(designs_apart, name: str) -> AssemblyCurves:
    """All of it for one assembly."""
    full = five_bar_designs.operating_points(designs_apart, name)
    rigid = rigid_range(full.effective.rigid_mass, PERIOD)
    links = rigid_range(full.effective.link_side_mass, PERIOD)
    sprung = sprung_range(full.effective.motor_side_mass, full.effective.stiffness, PERIOD)
    return AssemblyCurves(
        rigid.stiffness_max,
        rigid.stable_area,
        links.stiffness_max,
        links.stable_area,
        sprung.stiffness_max,
        sprung.stable_area,
        five_bar_designs.measure_values("stiffness_max", full).values,
        five_bar_designs.measure_values("isotropy", full).values,
    )


_apart = five_bar_designs.with_base_distance(distance)
curves = {name: curves_of(_apart, name) for name in SIDES}

_out, _in = curves["elbows-out"], curves["elbows-in"]
mirrored = {
    name: float(np.nanmax(np.abs(getattr(_in, name)[::-1] / getattr(_out, name) - 1.0)))
    for name in ("flexible", "flexible_area", "exact", "rigid")
}
# Elbows outward over inward, and the reverse, within what is not yet next to stretched arms.
USUAL = 0.4
_usual = np.abs(distance) <= USUAL
between_assemblies = {
    name: float(np.max(np.maximum(a, 1.0 / a)))
    for name in ("rigid", "flexible", "rigid_area", "flexible_area")
    for a in [(getattr(_out, name) / getattr(_in, name))[_usual]]
}
least = {
    name: {
        model: (float(distance[np.nanargmin(values)]), float(np.nanmin(values)))
        for model in ("rigid", "flexible", "exact")
        for values in [getattr(each, model)]
    }
    for name, each in curves.items()
}


def by_hand(name: str, at: float) -> float:
    """(5.7) of the arms written out by hand, base joints a distance apart [N/m]."""
    felt = replace(bundled(), base=(at / 2.0, -at / 2.0)).at(five_bar_designs.REFERENCE, name)
    return float(closed_form(felt.motor_side_mass, felt.stiffness, PERIOD))


# Of the last point over the one 5 cm before it.
growth_at_the_end = float(_out.rigid[-1] / _out.rigid[-11])


def draw(figure) -> None:
    """Both models, stiffness and area; below, what the full model has."""
    from matplotlib.ticker import FixedLocator, NullLocator

    from zwidth.show import LINES

    panels = {
        "flexible": ("Flexible (5.7): largest stiffness", "kN/m", 1e3, (0.03, 100.0)),
        "flexible_area": ("Flexible (5.8): stable area", "kN²s/m²", 1e3, (1e-3, 1e4)),
        "rigid": ("Rigid (5.4): largest stiffness", "kN/m", 1e3, (30.0, 2000.0)),
        "rigid_area": ("Rigid (5.5): stable area", "MN²s/m²", 1e6, (3.0, 5000.0)),
        "exact": ("Full model, exact: largest stiffness", "kN/m", 1e3, (0.03, 100.0)),
        "isotropy": ("Condition number of the Jacobian", "", 1.0, (1.0, 100.0)),
    }
    axes = figure.subplots(3, 2, sharex=True).ravel()
    for ax, (name, (title, unit, scale, view)) in zip(axes, panels.items(), strict=True):
        for (assembly, each), (colour, dashes) in zip(curves.items(), LINES, strict=False):
            ax.plot(distance, getattr(each, name) / scale, color=colour, linestyle=dashes, label=assembly)
        ax.set_yscale("log")
        ax.set_ylim(*view)
        ax.set_xlim(-0.5, 0.5)
        ax.yaxis.set_minor_locator(NullLocator())
        ax.set_title(title + (f" [{unit}]" if unit else ""), loc="left", fontsize=8.0)
        if name == "isotropy":
            ax.yaxis.set_major_locator(FixedLocator([1, 3, 10, 30, 100]))
        ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper left", ncols=4, frameon=False, fontsize=8.0, handlelength=2.6
    )
    for ax in axes[-2:]:
        ax.set_xlabel("Distance of the base joints d [m]")


if __name__ == "__main__":
    print("elbows in at -d against elbows out at d:", {name: f"{value:.2g}" for name, value in mirrored.items()})
    print("largest ratio of the two:", {name: f"{value:.2f}" for name, value in between_assemblies.items()})
    for name, each in least.items():
        print(name, {model: f"{value:.5g} N/m at {at:.3f} m" for model, (at, value) in each.items()})
    write_page(draw, "fig-5-6-assemblies", 7.2, 7.4)
