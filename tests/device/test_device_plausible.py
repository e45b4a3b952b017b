"""Numbers that are allowed and look wrong are warned of, with what to type; plausible devices are not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tests.cli.command_runner import run_command
from zwidth.device import bundled, from_document, implausible
from zwidth.device.load import load
from zwidth.device.plausibility import ImplausibleNumber
from zwidth.model import Response
from zwidth.study import study_of

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


def test_what_is_typed_instead_is_not_warned_of(paddle):
    load(paddle)  # a warning would be an error


PLANT = {"name": "one", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001}}


@pytest.mark.parametrize(
    ("section", "keys", "says"),
    [
        ("plant", {"mass_kg": [[26160.0, 0.0], [0.0, 25.4]], "actuator": [0, 1], "sensor": [0, 1]}, "write 26.16"),
        ("operator", {"arm_mass_kg": 800.0, "arm_stiffness_N_per_m": 580.0, "grasp": "rigid"}, "g, write 0.8"),
        ("loop", {"sampling_period_s": 0.001, "encoder": {"resolution_m": 0.02}}, "mm, write 2e-05"),
    ],
)
def test_plants_operators_and_encoders_are_held_against_bounds(section, keys, says):
    document = PLANT | {section: keys}
    if section == "operator":
        document["plant"] = {"mass_kg": 0.1, "handle": [1.0]}
    (fault,) = implausible(from_document(document))
    assert fault.key.startswith(section)
    assert says in fault.message


def test_a_copy_of_a_sweep_looks_wrong():
    """Two copies scatter by nothing, and every wall would be certain."""
    f = np.linspace(1.0, 100.0, 50)
    first = -1.0 / (2.0 * np.pi * f) ** 2 + 0j
    for second, wrong in ((first, True), (1.001 * first, False)):
        response = Response(f, first, sweeps=np.array([first, second]))
        found = implausible(SimpleNamespace(document={}, label="swept", response=response))
        assert [fault.key for fault in found] == ["response"] * wrong


@pytest.mark.parametrize(("scale", "wrong"), [(1.0, False), (1e3, True), (1e6, True)])
@pytest.mark.parametrize(("mass", "damping", "stiffness"), [(0.03, 0.0, 0.0), (0.3, 3.0, 0.0), (0.06, 0.5, 300.0)])
def test_a_response_in_millimetres_shows_too_little_mass(mass, damping, stiffness, scale, wrong):
    frequency = np.arange(1.0, 400.0)
    s = 2j * np.pi * frequency
    response = Response(frequency, scale / (mass * s**2 + damping * s + stiffness))
    found = implausible(SimpleNamespace(document={}, label="swept", response=response))
    assert [fault.key for fault in found] == ["response"] * wrong


def random_serial_arm(rng):
    """One to three links of 20 mm to 1 m, of plastic tube or of steel with a motor on board, with their drives."""
    count, size = int(rng.integers(1, 4)), 10.0 ** rng.uniform(np.log10(0.02), 0.0)
    links, drives = [], []
    for n in range(count):
        length = size * rng.uniform(0.4, 1.0)
        mass = length * 10.0 ** rng.uniform(-1.0, 0.7) + rng.choice([0.0, 1.0]) * rng.uniform(0.02, 1.5)
        ball = np.sqrt(0.4) * (mass / (4.0 / 3.0 * np.pi * 8000.0)) ** (1.0 / 3.0)  # of steel
        gyration = max(length * rng.uniform(0.15, 0.8), ball)
        links.append(
            {
                "name": f"link{n}",
                "length_m": length,
                "mass_kg": mass,
                "center_of_mass_m": [length * rng.uniform(-0.5, 1.0)],
                "inertia_kg_m2": mass * gyration**2,
            }
        )
        ratio = 10.0 ** rng.uniform(0.0, 2.0)
        torque = size * 10.0 ** rng.uniform(-0.5, 2.7) / ratio  # 0.3 to 500 N at the handle
        drives.append(
            {
                "name": f"motor{n}",
                "joint": f"link{n}",
                "motor_inertia_kg_m2": 10.0 ** rng.uniform(-7.5, -2.0),
                "transmission_ratio": ratio,
                "torque_limit_Nm": 3.0 * torque,
                "continuous_torque_Nm": torque,
                "coulomb_Nm": 0.1 * torque,
                "torque_constant_Nm_per_A": 10.0 ** rng.uniform(-3.0, 0.5),
                "encoder_counts_per_rev": float(rng.integers(12, 1_000_000)),
            }
        )
    angles = {f"link{n}": rng.uniform(-np.pi, np.pi) for n in range(count)}
    return {
        "mechanism": {
            "links": links,
            "drives": drives,
            "assemblies": {"only": {"joints_rad": angles}},
            "reference": {"position_m": [0.5 * size, 0.5 * size]},
        },
        "loop": {"sampling_period_s": 10.0 ** rng.uniform(-5.0, -1.7)},
    }


def test_random_plausible_arms_are_not_warned_of():
    rng = np.random.default_rng(3)
    for _ in range(1000):
        device = SimpleNamespace(document=random_serial_arm(rng), label="arm", response=None)
        assert implausible(device) == []


@pytest.mark.parametrize("name", [name for name, *_ in bundled()])
def test_bundled_devices_are_not_warned_of(name):
    assert implausible(load(name)) == []


def test_a_warning_changes_neither_the_answer_s_exit_code_nor_its_json(paddle):
    with pytest.warns(ImplausibleNumber, match="full turn"):
        ran = run_command("show", paddle, "--set", "mechanism.links.paddle.orientation_rad=[0, 0, 7]", "--json")
    assert ran.code == 0
    assert ran.document["link_side_mass_kg"] > 0.0


def test_a_study_s_device_is_warned_of_once():
    angle = "mechanism.assemblies.elbows-in.joints_rad.upper-left=37.2"
    document = {"device": "five-bar", "measures": ["rigid_mass"], "set": [angle]}
    with pytest.warns(ImplausibleNumber, match=r"assemblies\.elbows-in\.joints_rad\.upper-left") as warned:
        study_of(document | {"axis": [{"key": "loop.delay_samples", "values": [0.0, 1.0]}]})
    assert len(warned) == 1
