"""Fig. 3.11: what a 20 Hz Butterworth filter on the velocity costs.

    G_d(z) = (n0 z^2 + n1 z + n2)/(z^2 + d1 z + d2),   W_c = w_c T,   zeta = 1/sqrt 2        (thesis eq. 3.18-3.19)

by Tustin's rule, which bends the cutoff a little; prewarping puts it back with 2 tan(W_c/2) for W_c. The position
that the stiffness multiplies is not filtered. The thesis draws the rigid body (3.20)-(3.22), not damped. The
filter slows the vibration of the stiffest wall down to 16 Hz. Even there the drives are not rigid: with two masses
the largest stiffness is a fifth higher than with one, and without their structural damping no wall at all is
stable, because the filtered force pushes the drives' vibration.

Run `python -m gallery.fig_3_11_filter` to draw it.
"""

from __future__ import annotations

from gallery.shared_loops import published, write_figure
from zwidth.chart import stability_chart
from zwidth.loop import Butterworth

plain = Butterworth(order=2, cutoff_Hz=20.0)
prewarped = Butterworth(order=2, cutoff_Hz=20.0, discretisation="tustin-prewarped")

rigid = stability_chart(published("rigid", stiffness_damping=0.0, velocity_filter=plain), decay=False)
rigid_prewarped = stability_chart(
    published("rigid", stiffness_damping=0.0, velocity_filter=prewarped), decay=False
)
two_mass = stability_chart(published(velocity_filter=plain), decay=False)
two_mass_prewarped = stability_chart(published(velocity_filter=prewarped), decay=False)
two_mass_undamped = stability_chart(published(stiffness_damping=0.0, velocity_filter=plain), decay=False)
two_mass_unfiltered = stability_chart(published(), decay=False)


def draw(ax) -> None:
    """Rigid and two-mass with the filter, in the window of what is stable with K > 0, B > 0."""
    from zwidth.show import draw_models

    window = (0.0, 1.1 * two_mass.stiffness_max, 0.0, 1.1 * two_mass.damping_max)
    draw_models(ax, {"two masses, filtered": two_mass, "rigid, filtered": rigid}, window)


if __name__ == "__main__":
    write_figure(draw, "fig-3-11-filter")
