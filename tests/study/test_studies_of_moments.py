"""Studies of a device that renders moments about an axis: their columns have the units of moments."""

from __future__ import annotations

import pytest
from matplotlib.figure import Figure

import zwidth
from tests.cli.command_runner import document_of, run_command
from tests.undrawn_figures import leave_undrawn
from zwidth.device import new_device
from zwidth.measures import MEASURES
from zwidth.model import Load
from zwidth.study import sweep

WRIST, PADDLE = "openwrist", "five-bar"


def test_a_sweep_of_a_wrist_is_in_newton_metres_per_radian():
    device, periods = zwidth.load(WRIST), {"loop.sampling_period_s": [5e-4, 1e-3]}
    swept = sweep(device, periods, ["stiffness_max", "link_side_mass", "isotropy"])
    assert swept["stiffness_max"].attrs["unit"] == "Nm/rad"
    assert swept["link_side_mass"].attrs["unit"] == "kg m^2"
    assert "unit" not in swept["isotropy"].attrs
    alone = [
        float(device.with_({"loop.sampling_period_s": T}).at().measure("stiffness_max").values)
        for T in (5e-4, 1e-3)
    ]
    assert swept["stiffness_max"].values == pytest.approx(alone, rel=1e-9)


def test_a_direction_that_is_asked_for_is_in_newtons_per_metre():
    swept = sweep(zwidth.load(PADDLE), {"loop.sampling_period_s": [1e-3]}, ["stiffness_max"], direction=(1.0, 0.0))
    assert swept["stiffness_max"].attrs["unit"] == "N/m"


def test_keys_and_tables_say_so(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(
        f'device = "{WRIST}"\nmeasures = ["stiffness_max", "rigid_mass"]\n'
        '[[axis]]\nkey = "loop.sampling_period_s"\nvalues = [0.001, 0.002]\n'
    )
    assert document_of("sweep", str(study))["units"] == {"stiffness_max": "Nm/rad", "rigid_mass": "kg m^2"}
    assert "stiffness_max [N m/rad]" in run_command("sweep", str(study)).out
    run_command("sweep", str(study), "--output", str(tmp_path / "out.csv"))
    header = (tmp_path / "out.csv").read_text().splitlines()[0]
    assert "stiffness_max_Nm_per_rad" in header
    assert "rigid_mass_kg_m2" in header


def test_what_does_not_depend_on_the_rendered_axis_keeps_its_unit():
    for measure in MEASURES.values():
        if not measure.along:
            assert measure.about_moments() is measure


def test_show_has_the_rates_of_the_orientation_and_units_of_a_wrist():
    shown, told = document_of("show", WRIST), run_command("show", WRIST).out
    assert [len(row) for row in shown["angular_jacobian"]] == [3, 3, 3]
    assert "1/(kg m²)³" in told
    assert "angle [rad]" in told


def test_python_writes_the_report_that_the_command_writes(tmp_path, monkeypatch):
    leave_undrawn(monkeypatch)
    wrist = tmp_path / "wrist.toml"
    wrist.write_text(new_device("wrist", "wrist"))
    here, there = tmp_path / "here.html", tmp_path / "there.html"
    device = zwidth.load(wrist)
    numbers = device.report(here, device.at(axis=(0.0, 0.0, 1.0)))
    told = document_of("report", wrist, "--axis", "0,0,1", "--output", there)
    assert here.read_bytes() == there.read_bytes()
    assert set(numbers) <= set(told)
    assert numbers["stiffness_max_Nm_per_rad"] == told["stiffness_max_Nm_per_rad"] > 0.0
    assert numbers["position_m"] == told["position_m"]


def test_a_figure_drawn_from_python_has_the_units_of_moments():
    chart = zwidth.load(WRIST).at().chart()
    axes = chart.plot(Figure().add_subplot())
    assert "N m/rad]" in axes.get_xlabel()
    assert "N m s/rad]" in axes.get_ylabel()


def test_a_push_about_an_axis_is_a_moment_in_what_a_study_says_of_itself():
    turned = zwidth.load(WRIST).under(Load(push=0.05))
    pushed = zwidth.load(PADDLE).under(Load(push=1.0))
    periods = {"loop.sampling_period_s": [1e-3]}
    assert sweep(turned, periods, ["stiffness_max"]).attrs["load"].startswith("a moment of 0.05 N m ")
    assert sweep(pushed, periods, ["stiffness_max"]).attrs["load"].startswith("a push of 1 N ")
