"""The public names: there, light to import, few at the top; what a contract with users promises of them."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
import warnings
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib import pyplot

import zwidth
from zwidth._old_names import old_names

PACKAGES = sorted(
    path.parent.name
    for path in Path(zwidth.__file__).parent.glob("*/__init__.pyi")
    if path.parent.name != "zwidth"
)
HEAVY = {"numpy", "numba", "pydantic", "matplotlib"}


@pytest.mark.parametrize("name", zwidth.__all__)
def test_a_public_name_is_there(name):
    assert getattr(zwidth, name) is not None
    assert name in dir(zwidth)


def test_the_top_is_small_enough_to_be_read():
    assert len({*zwidth.__all__} - {*PACKAGES}) <= 45
    assert {*PACKAGES} < {*zwidth.__all__}


@pytest.mark.parametrize("package", PACKAGES)
def test_all_names_of_a_package_are_there(package):
    module = import_module(f"zwidth.{package}")
    assert module.__all__
    for name in module.__all__:
        assert getattr(module, name) is not None
        assert name in dir(module)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'stabilty_chart'"):
        zwidth.stabilty_chart  # noqa: B018


def test_importing_costs_nothing_until_a_name_is_used():
    program = "import sys, zwidth; before = set(sys.modules); zwidth.load; print(*before); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    before, after = (set(line.split()) for line in done.stdout.splitlines())
    assert not before & HEAVY
    assert "pydantic" in after
    assert "numba" not in after


def test_a_script_that_draws_nothing_loads_no_plotting_library():
    program = (
        "import sys, zwidth\n"
        "device = zwidth.load('published-two-mass')\n"
        "print(device.chart(), device.chart().document()['stiffness_max_N_per_m'], file=sys.stderr)\n"
        "device.describe(), device.measure('rigid_mass'), device.at().check(1000.0, 1.0)\n"
        "print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert not set(done.stdout.split()) & {"matplotlib", "click", "rich", "jinja2"}


# --- old names ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", old_names())
def test_an_old_name_still_works_and_tells_the_new_one(name):
    with pytest.warns(DeprecationWarning, match=rf"zwidth\.{name} goes with the next release; write ") as told:
        found = getattr(zwidth, name)
    assert found is not None
    assert name not in zwidth.__all__
    assert Path(told[0].filename) == Path(__file__)  # the warning points at the line to be changed


def test_moved_names_are_what_the_warning_says():
    with pytest.warns(DeprecationWarning, match=r"write zwidth\.loop\.Kalman") as told:
        assert zwidth.Kalman is zwidth.loop.Kalman
    assert len(told) == 1


def test_old_functions_about_circumstances_answer_as_before():
    device = zwidth.load("five-bar")
    position, direction = (0.02, 0.2, 0.0), (1.0, 0.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        place = zwidth.place_of(device, position, direction, model="two-mass")
        found = zwidth.sensitivities(device, position, direction, model="two-mass")
        fits = zwidth.validity(device, position, direction)
        around = zwidth.largest_stiffness_by_direction(
            device.mechanism, device.at(position).posture, np.eye(3)[:2], device.controller, "full", device.damping
        )
    point = device.at(position, direction, model="two-mass")
    assert np.array_equal(place.plant.mass, point.plant.mass)
    assert found.table()["path"] == device.sensitivities(point).table()["path"]
    assert found.peak == device.sensitivities(point).peak
    assert fits.first_natural == zwidth.study.validity(device.at(position, direction)).first_natural
    assert around.stiffness[0] == pytest.approx(device.at(position, direction).chart().stiffness_max, rel=1e-12)


# --- the lines that keep working ---------------------------------------------------------------------


def test_the_old_way_to_simulate_a_mechanism_gives_the_same_motion():
    device = zwidth.load("five-bar")
    settings = {"push": (0.02, 1.0, 0.0), "duration": 0.1}
    with pytest.warns(DeprecationWarning, match=r"write device\.at\(position\)\.move\(wall, surface\)"):
        old = zwidth.simulate_mechanism(
            device.mechanism, device.damping, device.controller, at=(0.02, 0.24), encoders="link", **settings
        )
    point = dataclasses.replace(device.at((0.02, 0.24)), encoders="link")
    assert np.array_equal(old.position, point.move(**settings).position)
    assert not np.array_equal(old.position, device.at((0.0, 0.25)).move(**settings).position)


def test_old_methods_of_a_device_warn_and_answer():
    device = zwidth.load("published-two-mass", operator="thesis-arm")
    with pytest.warns(DeprecationWarning, match=r"write device\.at\(\.\.\.\)\.plant"):
        assert np.array_equal(device.plant(model="rigid").mass, device.at(model="rigid").plant.mass)
    with pytest.warns(DeprecationWarning, match=r"\.ungripped_plant"):
        assert device.plant(held=False) is device.given_plant
    arms = zwidth.load("five-bar")
    with pytest.warns(DeprecationWarning, match=r"write device\.at\(\.\.\.\)\.posture") as told:
        assert np.array_equal(arms.posture((0.02, 0.2)).angles, arms.at((0.02, 0.2)).posture.angles)
    assert Path(told[0].filename) == Path(__file__)


def test_files_of_measures_of_one_s_own_written_before_still_run(tmp_path):
    file = tmp_path / "my.py"
    file.write_text(
        "from zwidth.measures.own import measure\n@measure(unit='kg')\ndef mass(place):\n"
        "    return place.effective.rigid_mass\n"
    )
    with pytest.warns(DeprecationWarning, match="write from zwidth import measure"):
        own = zwidth.load_measures(str(file))
    device = zwidth.load("published-two-mass")
    assert float(device.measure(own["mass"])) == pytest.approx(0.287, rel=1e-12)


def test_a_study_given_to_sweep_is_computed_with_a_warning(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(
        'device = "published-two-mass"\nmeasures = ["rigid_mass"]\n[[axis]]\nkey = "loop.sampling_period_s"\n'
        "values = [0.001, 0.002]\n"
    )
    with pytest.warns(DeprecationWarning, match=r"write zwidth\.run_study\(study\)"):
        found = zwidth.sweep(file)
    assert found.dataset()["rigid_mass"].values == pytest.approx([0.287, 0.287], rel=1e-12)


def test_the_readme_s_lines_of_python_print_what_they_say(capsys):
    page = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    exec(block, {})
    pyplot.close("all")
    first, second, *rest = capsys.readouterr().out.splitlines()
    stiffness, frequency = first.split(" ", 1)
    assert f"{float(stiffness):.0f} N/m" in block
    assert f"{float(frequency.strip('(),')):.1f} Hz" in block
    assert float(second) < float(stiffness)
    assert "stable" in "".join(rest)


def test_the_lines_of_the_contract():
    device = zwidth.load("five-bar")
    late = zwidth.load("five-bar", {"loop.delay_samples": 1})
    point = device.at((0.0, 0.25), (0.0, 1.0))
    assert isinstance(point, zwidth.OperatingPoint)
    chart = point.chart()
    assert chart.stiffness_max == device.chart().stiffness_max > late.chart().stiffness_max
    assert chart.frequencies_at_stiffness_max
    slower = device.with_({"loop.sampling_period_s": 0.002})
    assert slower.controller.sampling_period == 0.002
    assert device.controller.sampling_period == 0.00125
    response = point.simulate(stiffness=4000.0, damping=10.0)
    assert response.stable
    axes = chart.plot()
    assert axes.get_xlabel().startswith("Virtual stiffness")
    pyplot.close(axes.figure)
    results = zwidth.sweep(device, {"loop.sampling_period_s": [0.0005, 0.001]}, ["stiffness_max", "isotropy"])
    assert isinstance(results, xr.Dataset)
    assert results["stiffness_max"].dims == ("loop.sampling_period_s",)
    assert results["isotropy"].values == pytest.approx(np.full(2, float(device.measure("isotropy"))), rel=1e-12)
    maps = zwidth.workspace_map(device, "rigid_mass", zwidth.study.plane_of(device, cells=(5, 4)))
    assert maps["rigid_mass"].shape == (4, 5)
    mass = zwidth.Plant.one_mass(mass=0.03, damping=1.0)
    assert zwidth.Loop(mass, sampling_period=0.001).chart().stiffness_max == pytest.approx(21942.75, abs=0.01)
