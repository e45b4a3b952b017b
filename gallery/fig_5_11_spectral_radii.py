"""Fig. 5.11: charts of the two masses and of the motors' mass alone, for several spectral radii; points B, C, D.

The two masses are the published ones, with their structural damping; the motor's mass on its spring is that of
(2.44), of which chapter 4 and (5.14) leave damping out. B lies inside both charts, C only inside that of the two
masses, D in neither. For the motor's mass, (5.15) is the least spectral radius that any mass has at a wall; with
the mass that has it at D, the chart grows, and D lies within it.

Run `python -m gallery.fig_5_11_spectral_radii` to draw it.
"""

from __future__ import annotations

from dataclasses import replace

from gallery import optimal_mass
from gallery.fig_3_7_bilateral_wall import chart as two_mass
from gallery.fig_4_4_models import motor_mass_undamped as motor_mass
from gallery.shared_loops import published, write_page
from zwidth.chart import spectral_radius, stability_chart
from zwidth.measures import with_motor_side_mass

WALLS = {name: optimal_mass.WALLS[name] for name in "BCD"}
RADII = (0.99, 0.98, 0.97, 0.96)
LOOPS = {
    "two masses": two_mass.loop,
    "motor's mass": motor_mass.loop,
    "motor's mass, damped": published("motor-mass"),
}

radius = {
    model: {name: float(spectral_radius(loop, *wall)) for name, wall in WALLS.items()}
    for model, loop in LOOPS.items()
}
charts = {"two masses": {1.0: two_mass}, "motor's mass": {1.0: motor_mass}}
for model, found in charts.items():
    for rho in RADII:
        found[rho] = stability_chart(LOOPS[model], rho, decay=False)
areas = {model: {rho: each.stable_area for rho, each in found.items()} for model, found in charts.items()}

# With the mass of fastest decay at D.
_changed = replace(two_mass.loop, plant=with_motor_side_mass(two_mass.loop.plant, optimal_mass.optimum["D"][0]))
optimised = stability_chart(_changed, decay=False)
area_ratio = optimised.stable_area / two_mass.stable_area
stiffness_ratio = optimised.stiffness_max / two_mass.stiffness_max


def draw(figure) -> None:
    """Both charts beside each other, with the points."""
    from zwidth.show import VERMILION
    from zwidth.show.figures.stability import draw_level, frame

    axes = figure.subplots(1, 2, sharey=True)
    for ax, (model, found) in zip(axes, charts.items(), strict=True):
        for rank, (rho, each) in enumerate(found.items()):
            draw_level(ax, each, "1 (edge of stability)" if rank == 0 else f"{rho:g}", rank, len(found))
        for name, wall in WALLS.items():
            ax.plot(*wall, "o", color=VERMILION, markersize=4.5, zorder=4.0)
            ax.annotate(name, wall, xytext=(5, 3), textcoords="offset points", fontsize=9.0)
        frame(ax, (-2000.0, 8000.0, -2.0, 35.0), empty=False)
        ax.set_title(model[0].upper() + model[1:], loc="left", fontsize=8.0)
    axes[1].set_ylabel("")
    handles, labels = axes[0].get_legend_handles_labels()
    legend = figure.legend(
        handles,
        labels,
        loc="outside upper left",
        ncols=5,
        frameon=False,
        fontsize=8.0,
        title="Spectral radius",
        title_fontsize=8.0,
        alignment="left",
    )
    legend.set_in_layout(True)


if __name__ == "__main__":
    for model, each in radius.items():
        print(model, {name: f"{rho:.4f}" for name, rho in each.items()})
    print(f"with D's mass: area {area_ratio:.2f} times, stiffness {stiffness_ratio:.2f} times as large")
    write_page(draw, "fig-5-11-radii", 7.4, 3.8)
