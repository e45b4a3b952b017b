"""Fig. 5.5: what the distance d of the base joints does to the largest stiffness, along the line y = 0.25 m.

Base joint 1, whose elbow points towards +x, sits at x = d/2, the other at -d/2; both elbows stay on their side, so
that the arms cross for d < 0. (The thesis shifts its curves by d/2, which is the same.) The handle can be at
(0, y) only while |d|/2 is within sqrt((L1 + L2)^2 - y^2), and on either side |d|/2 less far out.

- rigid (5.4): 0.686 m/T^2 with the mass felt at the handle. (5.4) prints m_e1, which is that of the links alone;
  with drives that do not give, the rotors move along. Both are here.
- flexible (5.7): the motors' mass on the drives' spring, undamped; and exactly, of the full model as bundled.

The rigid body is symmetric, for so are the masses of the arms. The drives are not equally stiff: that, and nothing
else, makes the flexible model asymmetric. How much a curve varies depends on how much of it is looked at: "three
times" is a statement about a range of x. With crossed arms the distal links come into one line towards the edge of
reach: there nothing holds the handle across them, and the flexible model's stiffness falls to zero.

Run `python -m gallery.fig_5_5_base_distance` to draw it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gallery import five_bar_designs
from gallery.five_bar import bundled
from gallery.shared_loops import write_page
from zwidth.device import Device
from zwidth.device.load import load
from zwidth.errors import DeviceError, PostureError
from zwidth.measures import rigid_range, sprung_range

Y = five_bar_designs.REFERENCE[1]
REACH = float(
    five_bar_designs.device.mechanism.links.tip[[five_bar_designs.RIGHT, five_bar_designs.DISTAL_RIGHT], 0].sum()
)
PERIOD = five_bar_designs.device.controller.sampling_period
farthest_by_geometry = 2.0 * float(np.sqrt(REACH**2 - Y**2))

DISTANCES = (-0.2, -0.1, 0.0, 0.1, 0.2)  # m
WITHIN = 0.13  # m; what all of them reach
x = np.linspace(-0.25, 0.25, 501)


def five_bar_at(distance: float) -> Device:
    """The five-bar with its base joints a distance d apart, as a user would ask for it."""
    places = {"upper-right": distance / 2.0, "upper-left": -distance / 2.0}
    return load("five-bar", [(f"mechanism.links.{name}.origin_m", [x, 0.0, 0.0]) for name, x in places.items()])


def reaches(distance: float) -> bool:
    """Whether the handle gets to (0, 0.25) m; farther apart the arms do not even meet (DeviceError)."""
    try:
        five_bar_at(distance).at((0.0, Y))
    except (PostureError, DeviceError):
        return False
    return True


def farthest(sign: float) -> float:
    """Largest |d| of this sign at which the position is still reached, to a tenth of a millimetre."""
    near, far = 0.4, 0.6
    while far - near > 1e-4:
        tried = np.linspace(near, far, 21)
        out = int(
            np.argmax(
                five_bar_designs.operating_points(
                    five_bar_designs.with_base_distance(sign * tried), "elbows-out"
                ).status
                != 0
            )
        )
        near, far = float(tried[out - 1]), float(tried[out])
    return sign * near


def curves(of: Device) -> dict[str, np.ndarray]:
    """Largest stiffness (designs, x) [N/m], nan out of reach."""
    line = np.stack([x, np.full_like(x, Y), 0.0 * x], axis=-1)
    mechanism = of.mechanism
    links = replace(mechanism.links, origin=mechanism.links.origin[..., None, :, :])
    assemblies = {name: angles[..., None, :] for name, angles in mechanism.assemblies.items()}
    spread = replace(of, mechanism=replace(mechanism, links=links, assemblies=assemblies))
    full = spread.at(line, assembly="elbows-out")
    felt = full.effective
    return {
        "rigid": rigid_range(felt.rigid_mass, PERIOD).stiffness_max,
        "links": rigid_range(felt.link_side_mass, PERIOD).stiffness_max,
        "flexible": sprung_range(felt.motor_side_mass, felt.stiffness, PERIOD).stiffness_max,
        "exact": five_bar_designs.measure_values("stiffness_max", full).values,
    }


def factor(values: np.ndarray, within: float = np.inf) -> float:
    """Largest over least value of those within |x| <= `within` that are reached."""
    seen = values[np.isfinite(values) & (np.abs(x) <= within + 1e-9)]
    return float(seen.max() / seen.min())


def reach_of_factor(values: np.ndarray, wanted: float) -> float:
    """The |x| within which values differ by that factor, interpolated; inf: by less everywhere."""
    widths = np.unique(np.abs(x[np.isfinite(values)]).round(9))
    factors = np.array([factor(values, width) for width in widths])
    return float(np.interp(wanted, factors, widths)) if factors[-1] >= wanted else np.inf


def asymmetry(values: np.ndarray) -> float:
    """Largest difference of the values at x and -x, over the lesser of the two, within `WITHIN`."""
    both = np.stack([values, values[::-1]])[:, np.abs(x) <= WITHIN + 1e-9]
    return float((np.abs(both[0] - both[1]) / both.min(axis=0)).max())


def with_equal_drives(of: Device) -> Device:
    """The same with both drives as stiff as they are on average."""
    drives = of.mechanism.drives
    mean = np.full_like(drives.stiffness, drives.stiffness.mean())
    return replace(of, mechanism=replace(of.mechanism, drives=replace(drives, stiffness=mean)))


farthest_apart, farthest_crossed = farthest(1.0), farthest(-1.0)

curves_by_distance = curves(five_bar_designs.with_base_distance(np.array(DISTANCES)))
found_with_equal_drives = curves(with_equal_drives(five_bar_designs.with_base_distance(np.array([-0.2, 0.0]))))

by_distance = {name: dict(zip(DISTANCES, values, strict=True)) for name, values in curves_by_distance.items()}
ratio_of_stiffness = factor(by_distance["rigid"][-0.2], WITHIN)
factors = {name: {d: factor(v, WITHIN) for d, v in each.items()} for name, each in by_distance.items()}
factors_of_all = {name: {d: factor(v) for d, v in each.items()} for name, each in by_distance.items()}
three_within = {name: reach_of_factor(each[-0.2], 3.0) for name, each in by_distance.items()}
# Of the crossed arms, the sine of the angle between the distal links at the last point that is reached.
_last = float(x[np.isfinite(by_distance["rigid"][-0.2])][-1])
between_at_the_edge = abs(
    float(replace(bundled(), base=(-0.1, 0.1)).at((_last, Y), "elbows-out").distal_angle_sine)
)
asymmetries = {name: max(asymmetry(v) for v in values) for name, values in curves_by_distance.items()}
asymmetries_with_equal_drives = {
    name: max(asymmetry(v) for v in values) for name, values in found_with_equal_drives.items()
}


def draw(figure) -> None:
    """Rigid and flexible, as in the thesis, and the full model exactly."""
    from zwidth.show import LINES, label, legend_above

    axes = figure.subplots(3, 1, sharex=True)
    titles = {
        "rigid": "Rigid body (5.4), links and rotors",
        "flexible": "Motors' mass on the drives' spring (5.7)",
        "exact": "Full model, exact",
    }
    for ax, (name, title) in zip(axes, titles.items(), strict=True):
        for (d, values), (colour, dashes) in zip(by_distance[name].items(), LINES, strict=False):
            text = f"d = {d:g} m".replace("-", "\u2212")
            ax.plot(x, values, color=colour, linestyle=dashes, label=text)
        ax.set_ylim(bottom=0.0)
        if ax is axes[0]:
            legend_above(ax, columns=3, title=title)
        else:
            ax.set_title(title, loc="left", fontsize=8.0)
        label(ax.yaxis, "Largest virtual stiffness", "N/m")
    label(axes[-1].xaxis, "x", "m", plain=True)


if __name__ == "__main__":
    print(f"reached for d from {farthest_crossed:.4f} to {farthest_apart:.4f} m")
    for name in curves_by_distance:
        text = ", ".join(f"{d:g} m: {factors[name][d]:.2f} ({factors_of_all[name][d]:.2f})" for d in DISTANCES)
        print(f"{name}: largest over least stiffness within {WITHIN} m (of all): {text}")
        print(f"    three times within {three_within[name]:.4f} m; asymmetry {asymmetries[name]:.2g}")
    write_page(draw, "fig-5-5-base-distance", 6.2, 7.6)
