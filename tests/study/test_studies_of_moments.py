"""Studies of a device that renders moments about an axis: their columns have the units of moments."""

from __future__ import annotations

import pytest

import zwidth
from tests.cli.command_runner import document_of, run_command
from zwidth.measures.catalogue import MEASURES
from zwidth.study.sweep import sweep

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
    assert "stiffness_max [Nm/rad]" in run_command("sweep", str(study)).out
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
