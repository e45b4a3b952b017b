"""Robust charts of measured devices beside those of the plant that the data are made of."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measured_handle_cases import COLLOCATED, frequencies, measured_device
from zwidth.chart.verdict import STABLE, UNSTABLE
from zwidth.device.load import load
from zwidth.errors import DeviceError, RangeError
from zwidth.model import Plant
from zwidth.study import Family, Range, robust_study

T = 0.001
LOOP = "[loop]\nsampling_period_s = 0.001\n{}"
STATED = 'actuator_at = "sensor"\nhandle_at = "sensor"\nhardware_delay_samples = 0.3\n'
HAND = """[operator]
name = "hand"
arm_mass_kg = 0.3
arm_stiffness_N_per_m = 500.0
arm_damping_Ns_per_m = 3.0
grasp = "rigid"
"""


def write(folder, name, text, sweeps=None, stated=STATED):
    """A measured paddle, with the values of repeated sweeps where there are any."""
    response = measured_device(Plant.one_mass(0.05, 0.5), T, 0.3, COLLOCATED, frequencies(T, 120))
    head, rows = "frequency_Hz,real_m_per_N,imag_m_per_N,sweep", []
    for k, factor in enumerate(sweeps or (1.0,)):
        for f, P in zip(response.frequency.tolist(), (response.value * factor).tolist(), strict=True):
            rows.append(f"{f!r},{P.real!r},{P.imag!r},{k + 1}")
    (folder / f"{name}.csv").write_text("\n".join([head, *rows]) + "\n")
    device = f'name = "paddle"\n[response]\nfile = "{name}.csv"\n{stated}' + LOOP.format(text)
    (folder / f"{name}.toml").write_text(device)
    return folder / f"{name}.toml"


def plant(folder, text="delay_samples = 0.3\n"):
    device = 'name = "paddle"\n[plant]\nmass_kg = 0.05\ndamping_Ns_per_m = 0.5\n' + LOOP.format(text)
    (folder / "plant.toml").write_text(device)
    return folder / "plant.toml"


def study(path, ranges=(), operators=(), members=None, unseen=None):
    device = load(path)
    return robust_study(Family(device, ranges, operators, device.at()), members, unseen)


def test_several_operators_have_the_walls_of_the_plant_in_common(tmp_path):
    (tmp_path / "hand.toml").write_text(HAND)
    operators = ("none", str(tmp_path / "hand.toml"))
    own = study(write(tmp_path, "free", ""), operators=operators)
    exact = study(plant(tmp_path), operators=operators)
    assert own.chart.stiffness_max == pytest.approx(exact.chart.stiffness_max, rel=1e-4)
    assert own.chart.damping_max == pytest.approx(exact.chart.damping_max, rel=1e-3)
    assert own.chart.stable_area == pytest.approx(exact.chart.stable_area, rel=1e-3)
    assert own.chart.lost_stiffness_share == pytest.approx(exact.chart.lost_stiffness_share, abs=1e-3)
    assert own.chart.members_at_stiffness_max == exact.chart.members_at_stiffness_max
    assert own.members == exact.members
    assert own.settled
    K, B = own.chart.stiffness_max, own.chart.damping_at_stiffness_max
    assert own.chart.check([0.99 * K, 1.01 * K], [B, B]).verdict.tolist() == [STABLE, UNSTABLE]


def test_repeated_sweeps_are_members_of_their_own(tmp_path):
    own = study(write(tmp_path, "repeated", "", (1.0, 1.1)))
    assert [one["sweep"] for one in own.members] == ["mean", "1", "2"]
    each = [own.chart.members[k].stiffness_max for k in (1, 2)]
    assert own.chart.stiffness_max <= min(each)  # a device that moves more renders less
    assert each[1] == pytest.approx(each[0] / 1.1, rel=1e-6)
    band = own.chart.members[0].band
    assert own.chart.stiffness_max == pytest.approx(min(band.stiffness_low, *each), rel=2e-3)
    for k in range(3):
        for ring in own.chart.regions:
            inner = ring.mean(axis=0)
            assert own.chart.members[k].check(*inner).verdict == STABLE


def test_a_range_of_delays_is_that_of_the_plant(tmp_path):
    own = study(write(tmp_path, "late", ""), (Range("loop.delay_samples", 0.0, 1.0),), members=5, unseen=8)
    exact = study(plant(tmp_path), (Range("loop.delay_samples", 0.3, 1.3),), members=5, unseen=8)
    assert own.chart.stiffness_max == pytest.approx(exact.chart.stiffness_max, rel=1e-4)
    assert own.chart.stable_area == pytest.approx(exact.chart.stable_area, rel=2e-3)
    assert (own.violation.unseen, own.violation.violating, own.settled) == (8, 0, True)


def test_members_left_out_are_seen_by_those_tried_afterwards(tmp_path):
    ranges = (Range("loop.delay_samples", 0.0, 2.0),)
    own = study(write(tmp_path, "few", ""), ranges, members=1, unseen=8)  # the middle alone
    assert 0 < own.violation.violating < 8
    assert own.violation.worst_stiffness_share > 0.1
    assert own.violation.worst_member["loop.delay_samples"] > 1.0
    assert np.isnan(own.violation.worst_spectral_radius)
    assert not own.settled


def test_numbers_of_the_measurement_itself_are_refused(tmp_path):
    path = write(tmp_path, "free", "")
    with pytest.raises(RangeError, match="hardware_delay_samples: is no"):
        study(path, (Range("response.hardware_delay_samples", 0.0, 1.0),))
    with pytest.raises(RangeError, match="not valid"):
        study(path, (Range("loop.delay_samples", -1.0, 1.0),))


def test_an_operator_needs_the_handle(tmp_path):
    (tmp_path / "hand.toml").write_text(HAND)
    with pytest.raises(DeviceError, match=r"hand\.toml cannot .*\[response\]"):
        study(write(tmp_path, "bare", "", stated=""), operators=("none", str(tmp_path / "hand.toml")))
