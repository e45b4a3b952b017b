"""Fig. 4.4: which model stands for the device where.

Four models of the published plant: two masses with structural damping, the motor's mass on its spring with and
without damping, and one rigid mass. Along the low edge the vibration is slow and the rigid mass serves; along the
high edge it is fast, the link side hardly moves, and the motor's mass on its spring serves. Undamped it promises
less than the device renders: conservative.

Run `python -m gallery.fig_4_4_models` to draw it.
"""

from __future__ import annotations

from gallery.fig_3_7_bilateral_wall import crossings_at
from gallery.shared_loops import published, write_figure
from zwidth.chart import stability_chart
from zwidth.conditions import thesis_flexible

two_mass = stability_chart(published(), decay=False)
motor_mass = stability_chart(published("motor-mass"), decay=False)
motor_mass_undamped = stability_chart(published("motor-mass", stiffness_damping=0.0), decay=False)
rigid_undamped = stability_chart(published("rigid", stiffness_damping=0.0), decay=False)

_plant = motor_mass_undamped.loop.plant
closed_form = float(
    thesis_flexible.largest_stiffness(_plant.mass[0, 0], _plant.stiffness[0, 0], motor_mass_undamped.loop.period)
)

# At half of the largest stiffness: the low edge against the rigid mass's, the high one against the motor's.
HALFWAY = two_mass.stiffness_max / 2.0
low_edge, high_edge = crossings_at(two_mass, HALFWAY)
low_edge_rigid = crossings_at(rigid_undamped, HALFWAY)[0]
high_edge_motor_mass = crossings_at(motor_mass, HALFWAY)[-1]


def draw(ax) -> None:
    """The four models over each other."""
    from zwidth.show import draw_models

    charts = {
        "two masses, damped": two_mass,
        "motor's mass, damped": motor_mass,
        "motor's mass, undamped": motor_mass_undamped,
        "rigid, undamped": rigid_undamped,
    }
    draw_models(ax, charts)


if __name__ == "__main__":
    write_figure(draw, "fig-4-4-models")
