"""What is felt of one wall, from Python: as the command says, of stable walls and others, held by hand or not."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from math import inf

import numpy as np
import pytest

import zwidth as package
from tests.cli.command_runner import MECHANISM, TWO_MASS, document_of
from tests.systems import mass, random_loop, random_operator, two_mass
from zwidth.chart import judge, largest_stiffness
from zwidth.loop import Controller, OperatingPoint
from zwidth.measures import felt_impedance, felt_wall, static_stiffness
from zwidth.show import json_value

WALL = (4000.0, 10.0)


def pair():
    return OperatingPoint(Controller(0.00125), given_plant=two_mass(0.2616, 0.0254, 15620.0, 1.8744))


@pytest.mark.parametrize(
    ("name", "operator", "wall"),
    [(TWO_MASS, "none", WALL), (MECHANISM, "none", WALL), (MECHANISM, "thesis-arm", (2000.0, 5.0))],
)
def test_the_command_says_the_same(name, operator, wall):
    told = document_of("felt", name, "--operator", operator, "--stiffness", wall[0], "--damping", wall[1])
    document = json_value(felt_wall(package.load(name).at(operator=operator), *wall).document())
    assert {key: told[key] for key in document} == document


@pytest.mark.parametrize("seed", range(5))
def test_random_devices_feel_what_the_single_functions_say(seed):
    rng = np.random.default_rng([43, seed])
    loop = random_loop(rng)
    plant = replace(loop.plant, handle=np.eye(loop.plant.size)[0])
    loop = package.Loop(plant, loop.controller)
    peak = largest_stiffness(loop)
    K = 0.5 * peak.stiffness if peak else 100.0
    B = peak.damping if peak else 0.1
    felt = felt_wall(OperatingPoint(loop.controller, given_plant=plant), K, B)
    assert felt.verdict == judge(loop, [K], [B]).names[0]
    assert (felt.felt_impedance is None) == (felt.verdict != "stable") == (felt.reason is not None)
    if felt.felt_impedance is not None:
        assert np.array_equal(felt.felt_impedance, felt_impedance(loop, K, B, felt.frequency))
        assert felt.static_stiffness == float(static_stiffness(plant, K))
    if peak:
        assert felt.static_stiffness_at_stiffness_max == float(static_stiffness(plant, peak.stiffness))
    assert felt.stiffness_max == (peak.stiffness if peak else None)
    assert felt.frequency[-1] < 0.5 / loop.period


def test_two_springs_in_series_and_a_hard_limit():
    felt, k = felt_wall(pair(), *WALL), 15620.0
    assert felt.static_stiffness == pytest.approx(4000.0 * k / (4000.0 + k))
    assert felt.static_stiffness_limit == pytest.approx(k)
    assert felt.free_motion_mass == pytest.approx(0.287)
    rigid = felt_wall(OperatingPoint(Controller(0.001), given_plant=mass(0.1, 1.0)), 1000.0, 1.0)
    assert (rigid.static_stiffness, rigid.static_stiffness_limit) == (pytest.approx(1000.0), inf)
    with pytest.raises(FrozenInstanceError):
        rigid.verdict = "unstable"


def test_a_wall_that_is_not_stable_has_a_reason_and_no_impedance():
    felt = felt_wall(pair(), 9000.0, 10.0)
    assert "is unstable" in felt.reason
    assert felt.felt_impedance is felt.static_stiffness is None
    document, table = felt.document(), felt.table()
    assert document["impedance_real_Ns_per_m"] is document["impedance_imag_Ns_per_m"] is None
    assert document["free_motion_mass_kg"] == pytest.approx(0.287)
    assert {len(column) for column in table.values()} == {len(felt.frequency)}
    assert np.isnan(table["impedance_real_Ns_per_m"]).all()
    assert np.isfinite(table["free_motion_imag_Ns_per_m"]).all()
    assert felt_wall(pair(), *WALL).reason is None


def test_the_operator_decides_what_is_stable_and_feels_the_device_without_himself():
    rng = np.random.default_rng(44)
    plant = two_mass(0.2616, 0.0254, 15620.0, 1.8744)
    held = OperatingPoint(Controller(0.00125), given_plant=plant, operator=random_operator(rng))
    felt, alone = felt_wall(held, 1000.0, 5.0), felt_wall(held.without_operator, 1000.0, 5.0)
    assert felt.verdict == alone.verdict == "stable"
    assert np.array_equal(felt.felt_impedance, alone.felt_impedance)
    assert felt.stiffness_max == largest_stiffness(held.loop).stiffness != alone.stiffness_max
