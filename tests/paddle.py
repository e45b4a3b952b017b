"""A paddle with one drive, as a user writes it from the docs: friction, encoder counts, a torque limit."""

from pathlib import Path

PADDLE = """
name = "Teaching paddle"
description = "One link on a capstan drive"
source = "made up for the tests"

[[mechanism.links]]
name = "lever"
joint = "revolute"
length_m = 0.09
mass_kg = 0.06
center_of_mass_m = [0.035]
inertia_kg_m2 = 5e-5

[mechanism.handle]
link = "lever"

[mechanism.assemblies.upright]
joints_rad = { lever = 1.5 }

[mechanism.reference]
position_m = [0.0, 0.09]
direction = [1.0, 0.0]

[[mechanism.drives]]
name = "capstan"
joint = "lever"
motor_inertia_kg_m2 = 2.1e-6
transmission_ratio = 9.0
stiffness_Nm_per_rad = 1.5
torque_constant_Nm_per_A = 0.03
torque_limit_Nm = 0.12
continuous_torque_Nm = 0.03
encoder_counts_per_rev = 4000
coulomb_Nm = 0.002

[mechanism.damping]
mode_ratio = 0.04

[loop]
sampling_period_s = 0.001
delay_samples = 0.5

[loop.velocity]
filter = { type = "first-order", time_constant_s = 0.002 }
"""
LENGTH = 0.09  # m, from the joint to the handle


def paddle(folder: Path) -> str:
    """The name of a file with the paddle in it."""
    file = folder / "paddle.toml"
    file.write_text(PADDLE)
    return str(file)
