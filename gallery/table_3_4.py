"""Table 3.4 from Tables 3.1-3.3: what the wall feels of the five-bar at (0, 0.25) m along y.

The capstan drives turn the motor 18.6 times per turn of the joint (printed as (96 - 4.95)/4.95, which is 18.39; a
pulley of 9.8 mm instead of "approximately 9.9 mm" gives 18.59),
so that a rotor of J at the motor is n^2 J at the joint, and a shaft of k at the motor n^2 k. With h = J^T u the
columns of the handle's Jacobian along the rendered direction u,

    m_e1 = 1/(h^T M_phi^-1 h),   m_e2 = 1/(h^T M_theta^-1 h)                    (thesis eq. 2.28)
    k_e  = 1/(h^T K^-1 h)                                                       (thesis eq. 2.34)

where M_phi is the mass matrix of the links and M_theta, K are those of the drives. The link inertias are Table
3.2's as measured, and their centres of mass lie beside their axes. (B.15) puts m L^2/12, a slender rod's, for that
of the distal links and their centres onto the axes; only the measured numbers give the printed m_e1.

Run `python -m gallery.table_3_4` to see the numbers.
"""

from __future__ import annotations

import numpy as np

from zwidth.device.load import load
from zwidth.model import effective_parameters, natural_frequencies, plant_effective_parameters
from zwidth.model.effective_mass import EffectiveParameters

DEVICE = "five-bar"
DISTAL = ("distal-right", "distal-left")
UPPER = ("upper-right", "upper-left")


def at_the_handle(*settings: tuple[str, object]) -> EffectiveParameters:
    """Effective parameters of the five-bar at its reference, after settings."""
    changed = load(DEVICE, settings)
    return effective_parameters(changed.mechanism, changed.at().posture, changed.direction())


device = load(DEVICE)
drives = device.mechanism.drives
ratio = float(drives.transmission[0])
ratio_of_the_pulleys = (96.0 - 4.95) / 4.95
ratio_of_a_pulley_of_9_8_mm = (96.0 - 4.9) / 4.9
motor_inertia_at_the_joint = ratio**2 * float(drives.motor_inertia[0])

effective = at_the_handle()
link_side_mass = float(effective.link_side_mass)
motor_side_mass = float(effective.motor_side_mass)
rigid_mass = float(effective.rigid_mass)
stiffness = float(effective.stiffness)

frequencies = natural_frequencies(device.at().plant)[2:]
average_stiffness = [
    ("mechanism.drives.motor-right.stiffness_Nm_per_rad", 0.40),
    ("mechanism.drives.motor-left.stiffness_Nm_per_rad", 0.65),
]
frequencies_at_average_stiffness = natural_frequencies(load(DEVICE, average_stiffness).at().plant)[2:]

# The readings that do not give the printed numbers.
on_the_axes = [(f"mechanism.links.{name}.center_of_mass_m.1", 0.0) for name in (*UPPER, *DISTAL)]
link_side_mass_without_offsets = float(at_the_handle(*on_the_axes).link_side_mass)


def _rod(name: str) -> tuple[str, object]:
    """A slender rod's inertia about its middle, m L^2/12, in place of the measured one."""
    link = next(link for link in device.document["mechanism"]["links"] if link["name"] == name)
    return f"mechanism.links.{name}.inertia_kg_m2", link["mass_kg"] * link["length_m"] ** 2 / 12.0


rods = [_rod(name) for name in DISTAL]
link_side_mass_of_appendix_b = float(at_the_handle(*rods, *on_the_axes).link_side_mass)
link_side_mass_of_rods_with_offsets = float(at_the_handle(*rods).link_side_mass)
masses_with_the_pulleys_ratio = at_the_handle(
    *[(f"mechanism.drives.{name}.transmission_ratio", ratio_of_the_pulleys) for name in drives.names]
)
motor_side_mass_with_the_pulleys_ratio = float(masses_with_the_pulleys_ratio.motor_side_mass)
# It goes with the rotor's inertia at the joint.
motor_side_mass_with_the_printed_inertia = motor_side_mass * 1.186e-4 / motor_inertia_at_the_joint

# The printed 15 620 N/m puts the two-mass model at the device's second frequency.
published = load("published-two-mass").at().plant
published_stiffness = float(plant_effective_parameters(published).stiffness)
frequency_of_the_published_plant = float(natural_frequencies(published)[-1])
frequency_with_the_computed_stiffness = frequency_of_the_published_plant * float(
    np.sqrt(stiffness / published_stiffness)
)


if __name__ == "__main__":
    print(f"m_e1 = {link_side_mass:.6f} kg, m_e2 = {motor_side_mass:.6f} kg, together {rigid_mass:.6f} kg")
    print(f"k_e = {stiffness:.1f} N/m; frequencies {frequencies} Hz")
