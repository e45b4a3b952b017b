"""Each rule of a device file says the same of one document and of the arrays of many designs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.device.device_cases import ARM_FILE, PLANT_FILE, with_changes
from zwidth.device.address import assign_all
from zwidth.device.faults import KeyPath, dotted
from zwidth.device.load import check
from zwidth.device.rules.rule import PERIOD, NumberRule, Numbers, places
from zwidth.device.rules.table import RULES, certainly_valid
from zwidth.errors import DeviceError

KALMAN = {"method": "kalman", "acceleration_noise_m_per_s2": 50.0, "position_noise_m": 1e-5}
LOW_PASS = {"type": "butterworth", "order": 2, "cutoff_Hz": 100.0}
MOTOR = {
    "torque_constant_Nm_per_A": 0.02,
    "winding_resistance_ohm": 1.0,
    "winding_inductance_H": 1e-3,
    "damping_resistance_ohm": 1.0,
    "continuous_torque_Nm": 0.1,
    "torque_limit_Nm": 0.2,
    "brake_damping_max_Nms_per_rad": 0.1,
    "brake_time_constant_s": 1e-3,
}
FACTORS = (1.0, -1.0, 0.5, 2.0, 1e-3, 1e3, 1e-7, 1e7, 1e-13, 1e13, 1e31, 1.0 + 1e-10, 1.0 + 1e-8)
MAY_BE_ZERO = ("motor_inertia_kg_m2",)  # whose rule only 0 breaks
# Two devices to which many rules about numbers apply.
PLANT = with_changes(
    PLANT_FILE,
    loop__velocity=KALMAN | {"filter": LOW_PASS},
    loop__force={"filter": LOW_PASS},
    loop__actuator={"time_constant_s": 1e-3},
    loop__local={"rate_multiple": 4, "velocity": KALMAN | {"filter": LOW_PASS}},
    plant__handle=[1.0, 0.0],
    plant__brake=[{"damping_max_Ns_per_m": 1.0, "time_constant_s": 1e-3}],
    plant__electrical_damping=[{"force_constant_N_per_A": 2.0, "resistance_ohm": 3.0, "inductance_H": 1e-3}],
)
ARM = with_changes(
    ARM_FILE,
    loop__delay_s=0.0015,
    mechanism__drives__0=with_changes(ARM_FILE)["mechanism"]["drives"][0] | MOTOR,
    mechanism__links__1__inertia_kg_m2=[2e-4, 3e-4, 4e-4],
    mechanism__links__0__inertia_kg_m2=[[2e-4, 1e-5, 0.0], [1e-5, 3e-4, 0.0], [0.0, 0.0, 4e-4]],
    mechanism__links__1__axis=[0.0, 0.0, 2.0],
    mechanism__workspace={"x_m": [0.1, 0.3]},
)


def numbers_of(value: Any, path: KeyPath = ()) -> list[tuple[KeyPath, float]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    inside = [found for key, inner in items for found in numbers_of(inner, (*path, key))]
    return [(path, value)] if isinstance(value, float) else inside


def is_valid(document: dict[str, Any], changes: dict[KeyPath, float]) -> bool:
    try:
        check(assign_all(document, [(dotted(path, document), float(one)) for path, one in changes.items()]), "")
    except DeviceError:
        return False
    return True


@pytest.mark.parametrize("document", [PLANT, ARM], ids=["plant", "mechanism"])
def test_designs_are_certain_where_each_alone_is_valid(document):
    """All numbers, one at a time, each by itself as it may be and as it may not; those of a matrix together."""
    told = set()
    for path, value in numbers_of(document):
        values = {path: value * np.array(FACTORS) if value else np.zeros(len(FACTORS))}
        valid = certainly_valid(document, values, len(FACTORS)).tolist()
        assert valid == [is_valid(document, {path: one}) for one in values[path]], path
        told |= set(valid)
    assert told == {True, False}


def test_numbers_of_one_matrix_are_judged_together():
    scale = np.array([1.0, 1.0, 1e-3, 1.0])
    inertia = np.array([[2e-4, 3e-4, 4e-4], [2e-4, 3e-4, 6e-4], [2e-1, 3e-1, 4e-1], [-2e-4, 3e-4, 4e-4]])
    place = ("mechanism", "links", 1, "inertia_kg_m2")
    values = {(*place, i): scale * inertia[:, i] for i in range(3)}
    expected = [is_valid(ARM, {path: one[p] for path, one in values.items()}) for p in range(4)]
    assert certainly_valid(ARM, values, 4).tolist() == expected == [True, False, True, False]


def test_every_rule_about_numbers_judges_arrays_as_it_does_numbers():
    """Those that apply to the two devices; a rule that no number breaks would prove nothing."""
    rng, applied, broken = np.random.default_rng(8), set(), set()
    for document in (PLANT, ARM):
        values = {path: value * 10.0 ** rng.uniform(-12, 12, 40) for path, value in numbers_of(document) if value}
        values |= {path: np.append(0.0, many[1:]) for path, many in values.items() if path[-1] in MAY_BE_ZERO}
        values[PERIOD] = np.minimum(values[PERIOD], 1.0)  # beyond which a file has none
        changes = [[(dotted(path, document), float(one[i])) for path, one in values.items()] for i in range(40)]
        alone = [assign_all(document, own) for own in changes]
        for rule in [rule for rule in RULES if isinstance(rule, NumberRule)]:
            for path, _, together in rule.judged(Numbers(document, (), values), places(document, rule.place)):
                found = [[one for one, _ in rule.faults(own, places(own, rule.place))] for own in alone]
                flags = [any(one[: len(path)] == path for one in paths) for paths in found]
                assert np.broadcast_to(together, 40).tolist() == flags, (rule.place, rule.at)
                applied.add((rule.place, rule.at))
                broken |= {(rule.place, rule.at)} if any(flags) else set()
    assert len(applied) >= 16
    assert applied - broken == set()


def test_what_software_delays_a_measured_response_is_whole_in_each_design():
    document = {
        "name": "bench",
        "response": {"file": "sweep.csv"},
        "loop": {"sampling_period_s": 0.001, "delay_samples": 1.0},
    }
    delays = np.array([1.0, 1.5, 2.0])
    assert certainly_valid(document, {("loop", "delay_samples"): delays}, 3).tolist() == [True, False, True]


def test_a_mechanism_without_sampling_period_is_judged_without():
    document = with_changes(
        ARM_FILE, loop={"velocity": {"filter": LOW_PASS}, "actuator": {"time_constant_s": 1e-3}}
    )
    lengths = np.array([0.2, -0.2])
    valid = certainly_valid(document, {("mechanism", "links", 0, "length_m"): lengths}, 2)
    assert valid.tolist() == [True, False]
