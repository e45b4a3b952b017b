"""A sweep asked from Python: the same study as a file's, and one clear line for each mistake."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from tests.study.study_cases import FIVE_BAR, RIGHT_LENGTH, TWO_MASS, axis, study
from zwidth.device.load import load
from zwidth.errors import DeviceError
from zwidth.measures import FAILED, OK, Measure
from zwidth.study import plane_of, run_study, study_over, sweep, sweep_job

PERIOD, DELAY = "loop.sampling_period_s", "loop.delay_samples"
PERIOD_MEASURE = Measure(
    "period", "Sampling period", "s", None, "", lambda point: point.controller.sampling_period, each=True
)


@pytest.fixture(scope="module")
def device():
    return load(FIVE_BAR)


def test_the_line_of_the_contract(device):
    found = zwidth.sweep(device, {PERIOD: [0.0005, 0.001]}, ["stiffness_max", "isotropy"])
    for period in (0.0005, 0.001):
        expected = device.with_({PERIOD: period}).chart().stiffness_max
        assert float(found["stiffness_max"].sel({PERIOD: period})) == pytest.approx(expected, rel=1e-9)
    assert found["isotropy"].dims == (PERIOD,)
    assert found[PERIOD].attrs["units"] == "s"
    assert (found["stiffness_max_status"] == OK).all()


def test_it_is_the_study_that_a_file_asks(device):
    """The same question, so that what one has kept serves the other; the same numbers, to the last bit."""
    axes = {
        RIGHT_LENGTH: [0.13, 0.16],
        "assembly": ["elbows-out", "elbows-in"],
        "operator": ["none", "thesis-arm"],
    }
    names = ["stiffness_max", "average(rigid_mass)"]
    plane = plane_of(device, cells=(3, 3))
    asked = study_over(device, axes, names, direction=(1.0, 1.0), model="two-mass", plane=plane)
    filed = study(
        *(axis(key, *values) for key, values in axes.items()),
        measures=names,
        direction=[1.0, 1.0],
        model="two-mass",
        workspace={"count": 3},
    )
    assert sweep_job(asked).question == sweep_job(filed).question
    found = sweep(device, axes, names, direction=(1.0, 1.0), model="two-mass", plane=plane, workers=1)
    assert found.equals(run_study(filed, workers=1).dataset())


def test_arrays_ranges_and_tuples_are_values(device):
    axes = {PERIOD: np.array([1e-3, 2e-3]), DELAY: range(2), "at": np.array([[0.0, 0.25], [0.05, 0.2]])}
    found = sweep(device, axes, "rigid_mass", workers=1)
    listed = {PERIOD: [1e-3, 2e-3], DELAY: (0, 1), "at": [(0.0, 0.25), (0.05, 0.2)]}
    assert found.equals(sweep(device, listed, ["rigid_mass"], workers=1))
    assert dict(found.sizes) == {PERIOD: 2, DELAY: 2, "at": 2}


def test_fixed_circumstances_are_those_of_all_designs(device):
    fixed = {"direction": np.array([1.0, 1.0]), "assembly": "elbows-in", "model": "rigid"}
    found = sweep(device, {DELAY: [0.0, 1.0]}, "stiffness_max", position=(0.04, 0.22), **fixed, workers=1)
    for delay in (0.0, 1.0):
        point = device.with_({DELAY: delay}).at((0.04, 0.22), (1.0, 1.0), assembly="elbows-in", model="rigid")
        expected = point.chart().stiffness_max
        assert float(found["stiffness_max"].sel({DELAY: delay})) == pytest.approx(expected, rel=1e-9)


def test_a_position_may_be_told_by_joint_angles(device):
    angles = {"upper-right": 0.8, "upper-left": 2.2}
    found = sweep(device, {DELAY: [0.0, 1.0]}, "isotropy", position=angles, workers=1)
    expected = float(device.at(angles).measure("isotropy").values)
    assert found["isotropy"].values.tolist() == pytest.approx([expected, expected], rel=1e-12)


def test_the_wanted_wall_is_told_by_its_numbers(device):
    axes = {"damping_Ns_per_m": [5.0, 10.0]}
    found = sweep(device, axes, "spectral_radius", stiffness=1000.0, workers=1)
    for damping in (5.0, 10.0):
        expected = float(device.measure("spectral_radius", stiffness=1000.0, damping=damping).values)
        assert float(found["spectral_radius"].sel(damping_Ns_per_m=damping)) == pytest.approx(expected, rel=1e-12)


def test_measures_of_one_s_own_by_name_and_themselves(device):
    found = sweep(
        device,
        {PERIOD: [1e-3, 2e-3]},
        ["period", "average(period)"],
        user_measures={"period": PERIOD_MEASURE},
        workers=1,
    )
    assert found["period"].values.tolist() == found["average(period)"].values.tolist() == [1e-3, 2e-3]
    found = sweep(device, {PERIOD: [1e-3, 2e-3]}, PERIOD_MEASURE, workers=1)
    assert found["period"].values.tolist() == [1e-3, 2e-3]
    assert found["period"].attrs["unit"] == "s"


def test_a_device_that_was_changed_is_varied_from_there(device):
    changed = device.held_by("thesis-arm").with_({DELAY: 1.0})
    found = sweep(changed, {PERIOD: [1e-3, 2e-3]}, "stiffness_max", workers=1)
    expected = changed.with_({PERIOD: 2e-3}).chart().stiffness_max
    assert float(found["stiffness_max"][1]) == pytest.approx(expected, rel=1e-9)
    assert found.attrs["operator"] == "thesis-arm"


def test_what_is_no_device_is_data(device):
    found = sweep(device, {"links.distal-left.mass_kg": [-0.05, 0.05]}, "rigid_mass", workers=1)
    assert found["rigid_mass_status"].values.tolist() == [FAILED, OK]
    assert "mass_kg: must" in found["rigid_mass"].attrs["notes"]


def test_a_folder_keeps_what_is_done(device, tmp_path):
    axes, folder, seen = {PERIOD: [1e-3, 2e-3, 3e-3]}, str(tmp_path / "cells"), []
    first = sweep(device, axes, "rigid_mass", store=folder, workers=1)
    again = sweep(device, axes, "rigid_mass", store=folder, progress=lambda *now: seen.append(now), workers=1)
    assert again.equals(first)
    assert seen == [("computing designs", 3, 3)], "nothing is computed again"


def sweep_delays(device, **given):
    return sweep(device, **{"axes": {DELAY: [0.0, 1.0]}, "measures": "isotropy", **given})


def test_several_mistakes_are_told_at_once(device):
    with pytest.raises(DeviceError) as caught:
        sweep_delays(device, axes={DELAY: ["late"], "model": ["stiff"]}, measures="isotrop", stiffness=-1.0)
    said = [str(fault).partition(":")[0] for fault in caught.value.faults]
    assert sorted(said) == ["axes", "axes", "measures", "stiffness"]


def test_a_plane_is_for_measures_over_it(device):
    with pytest.raises(DeviceError, match=r"^plane: .*average\(isotropy\)"):
        sweep_delays(device, plane=plane_of(device, cells=(3, 3)))


def test_a_plant_has_no_workspace_and_a_response_no_numbers(tmp_path):
    with pytest.raises(DeviceError, match=r"^measures: average\(stiffness_max\) needs .*\[mechanism\]"):
        sweep_delays(load(TWO_MASS), measures="average(stiffness_max)")
    (tmp_path / "sweep.csv").write_text(
        "frequency_Hz,real_m_per_N,imag_m_per_N\n" + "".join(f"{f},{-1.0 / f**2},-1e-9\n" for f in range(1, 40))
    )
    (tmp_path / "measured.toml").write_text(
        'name = "m"\n[response]\nfile = "sweep.csv"\nintegrators = 2\n[loop]\nsampling_period_s = 0.001\n'
    )
    with pytest.raises(DeviceError, match=r"^device: .*\[response\]"):
        sweep_delays(load(tmp_path / "measured.toml"))


# --- what comes of it ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sweep_of_file():
    lengths = axis(RIGHT_LENGTH, 0.02, 0.14, 0.18, tie=["links.upper-left.length_m"])
    return run_study(study(lengths, measures=["rigid_mass", "isotropy"]), workers=1)


def test_a_sweep_knows_its_keys_and_its_columns(sweep_of_file):
    document = sweep_of_file.document()
    assert list(document) == ["sampling", "seed", "axes", "units", "designs", "values", "status", "notes"]
    assert document["axes"] == [
        {"key": RIGHT_LENGTH, "unit": "m", "values": (0.02, 0.14, 0.18), "tied": ["links.upper-left.length_m"]}
    ]
    assert document["designs"][1] == {RIGHT_LENGTH: 0.14, "links.upper-left.length_m": 0.14}
    assert document["status"][0] == {"rigid_mass": "out of reach", "isotropy": "out of reach"}
    table = sweep_of_file.table()
    assert list(table)[:3] == [RIGHT_LENGTH, "links.upper-left.length_m", "rigid_mass_kg"]
    assert table["rigid_mass_kg"][1:] == [values["rigid_mass"] for values in document["values"][1:]]
    assert {len(column) for column in table.values()} == {3}


def test_why_nothing_has_a_value(sweep_of_file):
    assert sweep_of_file.reason is None
    far = run_study(study(axis(RIGHT_LENGTH, 0.01, 0.02), measures=["isotropy"]), workers=1)
    assert far.reason.rpartition(": ")[2] == "out of reach"
    none = run_study(study(axis("links.distal-left.mass_kg", -0.1), measures=["isotropy"]), workers=1)
    assert none.reason is not None
    assert " 1 design failed: mechanism.links.distal-left.mass_kg" in none.reason
