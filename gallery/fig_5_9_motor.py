"""Fig. 5.9: the largest stiffness over the dimensionless natural frequency, and over the inertia of one motor.

(a) of the motors' mass on the drives' spring, dimensionless as p = K T^2/m_e2, from (5.7): a function of
W = sqrt(k_e/m_e2) T alone,

    p_max = 2 W^2 (sqrt(1 + cos W) - 1)^2/(1 - cos W)

It starts at the free mass's 0.686 and falls, without a turn, to zero at W = pi/2, where the drives vibrate at a
quarter of the sampling frequency. It speaks of a link side that is held still; that of the device moves along all
the more the stiffer the drives are, until links and rotors are one mass.

(b) of the five-bar, "elbow up": I_m1 is changed, of the motor on the right arm. The masses felt add as
1/m_e2 = h1^2/(n^2 I_m1) + h2^2/(n^2 I_m2): with an endlessly heavy first rotor the second alone is left, and the
curve levels off. (5.7), and exactly the full model as bundled; at x = 0 arms outward and inward have the same
motors' mass and spring, so that "elbow up" may be either.

Run `python -m gallery.fig_5_9_motor` to draw it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gallery import five_bar_designs
from gallery.brute_force import BruteForceLoop
from gallery.five_bar import bundled, closed_form
from gallery.shared_loops import write_page
from zwidth.measures import sprung_range

device = five_bar_designs.device
PERIOD = device.controller.sampling_period
POSITION = np.array([*five_bar_designs.REFERENCE, 0.0])

# (a) in units of m and T; the grid stays off both ends.
W = np.linspace(0.01, np.pi / 2.0 - 0.01, 157)
p_max = sprung_range(1.0, W**2, 1.0).stiffness_max
falls = bool(np.all(np.diff(p_max) < 0.0))
limit_rigid = float(sprung_range(1.0, 1e-8, 1.0).stiffness_max)
beyond = sprung_range(1.0, np.array([1.58, 2.0, 3.0, 4.0, 4.7]) ** 2, 1.0).stiffness_max


def p_max_by_brute_force(frequency: float) -> float:
    """p_max at a W by eigenvalues and bisection."""
    return BruteForceLoop([[1.0]], [[0.0]], [[frequency**2]], [1.0], 1.0).largest_stiffness(1.0, 2.0)[0]


effective = device.at().effective
W_of_the_device = float(np.sqrt(effective.stiffness / effective.motor_side_mass) * PERIOD)
p_of_the_device = float(
    sprung_range(effective.motor_side_mass, effective.stiffness, PERIOD).stiffness_max
    * PERIOD**2
    / effective.motor_side_mass
)

# (b)
BUNDLED = float(device.mechanism.drives.motor_inertia[0])
inertia = BUNDLED * np.geomspace(0.2, 5.0, 61)


def with_first_motor(value: float):
    """The device with another rotor on the right arm [kg m^2]."""
    drives = device.mechanism.drives
    rotors = np.array([value, drives.motor_inertia[1]])
    return replace(device, mechanism=replace(device.mechanism, drives=replace(drives, motor_inertia=rotors)))


def over_inertia(assembly: str) -> tuple[np.ndarray, np.ndarray]:
    """(5.7) and the full model's largest stiffness at each inertia [N/m]."""
    rows = []
    for value in inertia:
        place = with_first_motor(float(value)).at(POSITION, assembly=assembly)
        closed = sprung_range(place.effective.motor_side_mass, place.effective.stiffness, PERIOD).stiffness_max
        rows.append((float(closed), float(five_bar_designs.measure_values("stiffness_max", place).values)))
    closed, exact = np.array(rows).T
    return closed, exact


flexible, exact = over_inertia("elbows-in")
flexible_outward, exact_outward = over_inertia("elbows-out")
_bar = bundled()
_at_the_joint = float(device.mechanism.drives.transmission[0]) ** 2 * inertia
_felt = replace(_bar, rotor=(_at_the_joint, _bar.rotor[1])).at(
    np.broadcast_to(five_bar_designs.REFERENCE, (len(inertia), 2)), "elbows-in"
)
error_by_hand = float(np.abs(flexible / closed_form(_felt.motor_side_mass, _felt.stiffness, PERIOD) - 1.0).max())
at_present = len(inertia) // 2
# One rotor alone: the first one endlessly heavy.
levels_off = float(
    sprung_range(
        with_first_motor(1e6 * BUNDLED).at(POSITION).effective.motor_side_mass, effective.stiffness, PERIOD
    ).stiffness_max
)
doubled = tuple(
    float(np.interp(2.0 * BUNDLED, inertia, values) / values[at_present]) for values in (flexible, exact)
)


def draw(figure) -> None:
    """(a) and (b)."""
    from zwidth.show import BLACK, BLUE, GREY, VERMILION, legend_above

    left, right = figure.subplots(1, 2)
    left.plot(W, p_max, color=BLACK)
    left.plot([W_of_the_device], [p_of_the_device], "o", color=VERMILION, markersize=5.0)
    left.annotate(
        "the five-bar at (0, 0.25) m",
        (W_of_the_device, p_of_the_device),
        xytext=(8, 6),
        textcoords="offset points",
        fontsize=8.0,
    )
    left.set_xlim(0.0, np.pi / 2.0)
    left.set_ylim(0.0, 0.75)
    left.set_xlabel("Dimensionless natural frequency W = √(k/m) T")
    left.set_ylabel("Dimensionless virtual stiffness p = K T²/m")
    left.set_title("(a) motors' mass on the drives' spring", loc="left", fontsize=8.0)
    grams = 1e7 * inertia
    right.plot(grams, exact / 1e3, color=BLACK, label="full model, exact")
    right.plot(grams, flexible / 1e3, color=BLUE, linestyle=(0, (5, 1.5)), label="(5.7)")
    right.axvline(1e7 * BUNDLED, color=GREY, linewidth=0.8, zorder=0.5)
    right.annotate(
        "as built", (1e7 * BUNDLED, 0.6), xytext=(4, 0), textcoords="offset points", color=GREY, fontsize=8.0
    )
    right.set_xscale("log")
    right.set_xticks([3, 10, 30], labels=["3", "10", "30"])
    right.minorticks_off()
    right.set_ylim(0.0, None)
    right.set_xlabel("Inertia of the right motor [g cm²]")
    right.set_ylabel("Largest virtual stiffness [kN/m]")
    legend_above(right, columns=2, title="(b) the five-bar")


if __name__ == "__main__":
    print(f"p_max falls throughout: {falls}; from {p_max[0]:.4f} to {p_max[-1]:.2g}")
    print(f"the device: W = {W_of_the_device:.4f}, p_max = {p_of_the_device:.4f}")
    print(f"twice the inertia: {doubled[0]:.3f} times by (5.7), {doubled[1]:.3f} exactly")
    print(f"(5.7) from {flexible[0]:.0f} to {flexible[-1]:.0f} N/m, levels off at {levels_off:.0f} N/m")
    print(f"exact from {exact[0]:.0f} to {exact[-1]:.0f} N/m, never falls: {bool(np.all(np.diff(exact) > 0.0))}")
    write_page(draw, "fig-5-9-motor", 7.2, 3.4)
