"""Numbers that are allowed and look wrong are warned of: which, why, and what to type; plausible devices are not."""

from __future__ import annotations

import pytest

from zwidth.device.load import load

PADDLE = """
name = "Paddle"

[[mechanism.links]]
name = "paddle"
joint = "revolute"
length_m = 0.075
mass_kg = 0.045
center_of_mass_m = [0.02]
inertia_kg_m2 = 6.0e-5

[mechanism.handle]
link = "paddle"

[mechanism.assemblies.only]
joints_rad = { paddle = 1.57 }

[mechanism.reference]
position_m = [0.0, 0.075]
direction = [1.0, 0.0]

[[mechanism.drives]]
name = "motor"
joint = "paddle"
motor_inertia_kg_m2 = 1.1e-6
transmission_ratio = 11.5
stiffness_Nm_per_rad = 2.0
torque_constant_Nm_per_A = 0.0234
torque_limit_Nm = 0.08
continuous_torque_Nm = 0.028
encoder_counts_per_rev = 2000
coulomb_Nm = 0.0012

[mechanism.damping]
mode_ratio = 0.03

[loop]
sampling_period_s = 0.001
"""


@pytest.fixture
def paddle(tmp_path):
    (tmp_path / "paddle.toml").write_text(PADDLE)
    return tmp_path / "paddle.toml"


@pytest.mark.xfail(strict=True, reason="whatever is within far bounds passes without a word")
def test_an_inertia_too_large_for_its_link_is_warned_of(paddle):
    with pytest.warns(UserWarning, match="a radius of gyration of 115 m on a device of 75 mm"):
        load(paddle, ["mechanism.links.paddle.inertia_kg_m2=600"])
