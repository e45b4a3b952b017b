"""Fig. 3.9: rigid body against flexible drives, neither damped.

The rigid body has the mass of both sides, 0.287 kg; all of its friction is left out, and so is the drives'. The
flexible device fails well inside what the rigid one renders: 4 kN/m against 126 kN/m.

Run `python -m gallery.fig_3_9_no_damping` to draw it.
"""

from __future__ import annotations

from gallery.shared_loops import published, write_figure
from zwidth.chart import stability_chart

flexible = stability_chart(published(stiffness_damping=0.0), decay=False)
rigid = stability_chart(published("rigid", stiffness_damping=0.0), decay=False)
rigid_mass = float(rigid.loop.plant.mass[0, 0])

flexible_delayed = stability_chart(published(stiffness_damping=0.0, delay=1.0), decay=False)


def draw(ax) -> None:
    """Both edges, in the window of the flexible one."""
    from zwidth.show import draw_models

    draw_models(ax, {"two masses, undamped": flexible, "rigid, undamped": rigid})


if __name__ == "__main__":
    write_figure(draw, "fig-3-9-no-damping")
