"""Two right device files, and a way to put something wrong into them."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from zwidth.device import from_document
from zwidth.device.faults import Fault
from zwidth.errors import DeviceError

PLANT_FILE = """
name = "two masses"
[plant]
mass_kg = [[0.3, 0.0], [0.0, 0.02]]
damping_Ns_per_m = [[2.0, -2.0], [-2.0, 2.0]]
stiffness_N_per_m = [[9000.0, -9000.0], [-9000.0, 9000.0]]
actuator = [0.0, 1.0]
sensor = [0.0, 1.0]
[loop]
sampling_period_s = 0.001
delay_samples = 0.5
[loop.velocity.filter]
type = "butterworth"
order = 2
cutoff_Hz = 20.0
"""

ARM_FILE = """
name = "two links"
[mechanism]
[[mechanism.links]]
name = "upper"
joint = "revolute"
length_m = 0.2
mass_kg = 0.1
center_of_mass_m = [0.1]
inertia_kg_m2 = 0.0004
[[mechanism.links]]
name = "lower"
parent = "upper"
joint = "revolute"
length_m = 0.2
mass_kg = 0.1
center_of_mass_m = [0.1]
inertia_kg_m2 = 0.0004
[mechanism.handle]
link = "lower"
[mechanism.assemblies.elbow-down]
joints_rad = { upper = 0.5, lower = 1.0 }
[mechanism.reference]
position_m = [0.2, 0.2]
direction = [1.0, 0.0]
[[mechanism.drives]]
name = "shoulder"
joint = "upper"
motor_inertia_kg_m2 = 1e-6
transmission_ratio = 10.0
stiffness_Nm_per_rad = 0.5
[[mechanism.drives]]
name = "elbow"
joint = "lower"
motor_inertia_kg_m2 = 1e-6
transmission_ratio = 10.0
[mechanism.damping]
mode_ratio = 0.05
[loop]
sampling_period_s = 0.001
"""

REMOVED = object()


def with_changes(text: str, **values: Any) -> dict[str, Any]:
    """The document with values put at paths (dots written __), whatever they are; REMOVED removes."""
    document = tomllib.loads(text)
    for path, value in values.items():
        *outer, last = [int(step) if step.isdigit() else step for step in path.split("__")]
        table: Any = document
        for step in outer:
            table = table.setdefault(step, {}) if isinstance(table, dict) else table[step]
        if value is REMOVED:
            del table[last]
        else:
            table[last] = value
    return document


def faults(document: dict[str, Any]) -> list[Fault]:
    with pytest.raises(DeviceError) as caught:
        from_document(document, "my.toml")
    assert str(caught.value).splitlines() == [str(fault) for fault in caught.value.faults]
    return caught.value.faults
