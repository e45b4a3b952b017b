"""What is said of records and columns that cannot be used."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

import zwidth
from tests.cli import test_cli_identify
from tests.cli.command_runner import run_command
from tests.identify import test_device_numbers, test_stiffness
from tests.identify.boundary_cases import record
from tests.identify.test_boundary import DELAY, device, failed, points
from tests.identify.test_friction_joint import record as joint_record
from tests.identify.test_stiffness import RECORD, identified
from zwidth.errors import DeviceError
from zwidth.identify import identify_boundary, identify_friction, read_record
from zwidth.identify.boundary.identify import COLUMNS
from zwidth.identify.boundary.parameters import DeviceNumbers

# --- numbers of a device from a measured stability boundary: recovery, inequalities, damping ---------


@pytest.mark.parametrize(
    ("change", "what", "words"),
    [
        (lambda c: c | {"stiffness_N_per_m": np.array(c["stiffness_N_per_m"]) / 1000}, "units", "N/mm"),
        (lambda c: c | {"damping_Ns_per_m": np.array(c["damping_Ns_per_m"]) / 1000}, "units", "N s/mm"),
        (lambda c: c | {"damping_Ns_per_m": np.array(c["damping_Ns_per_m"]) * 1000}, "units", "thousand"),
        (
            lambda c: (
                c
                | {
                    "stiffness_N_per_m": np.array(c["damping_Ns_per_m"]),
                    "damping_Ns_per_m": np.array(c["stiffness_N_per_m"]),
                }
            ),
            "columns",
            "swapped",
        ),
        (lambda c: c | {"stiffness_N_per_m": np.full(len(c["edge"]), 1000.0)}, "spread", "1000 N/m in every"),
        (lambda c: {name: values[:2] for name, values in c.items()}, "points", "need 3 on the boundary"),
    ],
)
def test_points_that_cannot_be_fitted_are_refused_with_the_reason(change, what, words):
    result = identify_boundary(device(), [record(change(points()))], paths=[DELAY])
    assert words in failed(result, what)
    assert not result.estimates


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("1000,1.0,middle", "line 2: edge: must be one of"),
        ("1e20,1.0,lower", "is the unit right?"),
        ("1000,one,lower", "line 2: damping_Ns_per_m: must be a number"),
    ],
)
def test_faults_of_a_file_name_the_line(tmp_path, lines, words):
    path = tmp_path / "points.csv"
    path.write_text(f"stiffness_N_per_m,damping_Ns_per_m,edge\n{lines}\n", encoding="utf-8")
    with pytest.raises(DeviceError, match=words):
        identify_boundary(device(), [read_record(path, COLUMNS)], paths=[DELAY])


# --- numbers of a device file as a vector ------------------------------------------------------------


numbers_device = test_device_numbers.device


@pytest.mark.parametrize(
    ("paths", "words"),
    [
        (["loop.delay_sample"], "did you mean"),
        (["plant.mass_kg"], "must be a number"),
        (["name"], "must be a number"),
        (["plant.mass_kg.0.0", "plant.mass_kg.0.0"], "named twice"),
    ],
)
def test_what_is_no_number_is_refused(numbers_device, paths, words):
    with pytest.raises(DeviceError, match=words):
        DeviceNumbers.of(numbers_device, paths)


# --- friction and mass of virtual joints: what they are, where they belong in the file, and ----------


@pytest.mark.parametrize(
    ("name", "joint", "columns", "message"),
    [
        ("hapkit-course", None, ("time_s", "angle_rad"), "moves along a line: use position_m"),
        ("hapkit-course", 1, ("time_s", "position_m"), "must be a coordinate from 0 to 0"),
        ("hapkit-course", None, ("time_s", "position_m", "torque_Nm"), "cannot drive what is read"),
        ("hapkit-course", None, ("time_s", "position_m", "current_A"), "says no torque"),
        ("five-bar", None, ("time_s", "angle_rad"), "must be named"),
        ("five-bar", "motor-rihgt", ("time_s", "angle_rad"), "did you mean 'motor-right'"),
        ("five-bar", "motor-left", ("time_s", "position_m"), "turns: name its column angle_rad"),
    ],
)
def test_columns_that_are_not_the_joints_are_named(name, joint, columns, message):
    some = joint_record({column: np.arange(200) * 1e-3 for column in columns})
    with pytest.raises(DeviceError, match=message):
        identify_friction(zwidth.load(name), [some], joint=joint)


# --- stiffness of a drive from torque over angle: known springs come back, and bad records are -------


stiffness_device = test_stiffness.device


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"joint": None}, "several drives: motor-right, motor-left"),
        ({"joint": "motor-rihgt"}, "did you mean 'motor-right'"),
        ({"joint": "3"}, "no drive or joint"),
    ],
)
def test_a_joint_that_is_not_there_is_refused(stiffness_device, options, words):
    with pytest.raises(DeviceError, match=words):
        identified(stiffness_device, RECORD, **options)


# --- `zwidth identify`: what it prints, writes and refuses -------------------------------------------


strokes = test_cli_identify.strokes


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("strokes.csv", "--joint", "1"), "missing option '--device'"),
        (("--device", "five-bar"), "missing argument 'FILE...'"),
        (("none.csv", "--device", "five-bar", "--joint", "1"), "none.csv: no such file"),
        (("strokes.csv", "--device", "five-bar"), "several drives: motor-right, motor-left"),
        (("strokes.csv", "--device", "five-bra", "--joint", "1"), "five-bar"),
        (("strokes.csv", "--device", "five-bar", "--joint", "1", "--write"), "is bundled, or no file"),
        (("strokes.csv", "--device", "published-two-mass"), "a mechanism's drives"),
        (("strokes.csv", "--device", "five-bar", "--joint", ""), "is empty"),
        (("broken.csv", "--device", "five-bar", "--joint", "1"), "line 3: angle_rad: must be a number, got 'x'"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_printed(strokes, tmp_path, monkeypatch, words, message):
    shutil.copy(strokes, tmp_path / "strokes.csv")
    (tmp_path / "broken.csv").write_text("torque_Nm,angle_rad\n0,0\n0.1,x\n")
    monkeypatch.chdir(tmp_path)
    ran = run_command("identify", "stiffness", *words)
    assert (ran.code, ran.out) == (2, "")
    assert message in ran.err.splitlines()[-1]
