"""The public names: there, light to import, few at the top; what a contract with users promises of them."""

from __future__ import annotations

import re
import subprocess
import sys
from importlib import import_module
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib import pyplot

import zwidth

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


@pytest.mark.parametrize("package", PACKAGES)
def test_no_name_of_a_package_is_that_of_a_module_of_it(package):
    """Else the name means the module once that was imported, and the function before."""
    module = import_module(f"zwidth.{package}")
    modules = {path.stem for path in Path(str(module.__file__)).parent.glob("[a-z]*")}
    assert not modules & {*module.__all__}


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


@pytest.mark.parametrize(
    ("name", "home"), [("Kalman", "loop"), ("manipulability", "measures"), ("Store", "study")]
)
def test_a_name_of_a_package_asked_of_the_top_is_an_error_that_says_where_it_is(name, home):
    with pytest.raises(AttributeError, match=rf"write zwidth\.{home}\.{name}$"):
        getattr(zwidth, name)


# --- the lines that keep working ---------------------------------------------------------------------


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


# --- the page on what changed since 0.2 --------------------------------------------------------------

CHANGES = (Path(__file__).parents[1] / "docs" / "from-0-2.md").read_text(encoding="utf-8")


def test_names_that_the_page_says_are_gone_are_gone_and_what_stands_instead_is_there():
    rows = re.findall(r"^\| (`.*?) \| (`.*?) \|$", CHANGES, re.MULTILINE)
    assert len(rows) > 15
    for before, now in rows:
        for old in re.findall(r"`(?:zwidth\.)?(\w+)`", before):
            assert not hasattr(zwidth.errors, old)
            assert old not in zwidth.__all__
        for name in re.findall(r"`(zwidth(?:\.\w+)+)", now):
            assert attrgetter(name.removeprefix("zwidth."))(zwidth) is not None
        for kind in re.findall(r"^`(\w+(?:Error))`", now):
            assert issubclass(getattr(zwidth.errors, kind), zwidth.ZwidthError)


def test_every_error_of_zwidth_is_below_one_root_and_in_one_file():
    kind = re.compile(r"^class ([A-Z]\w*)\((?:\w+, )*(?:Exception|(?:errors\.)?\w*Error)\)", re.MULTILINE)
    sources = Path(zwidth.__file__).parent
    found = {
        str(path.relative_to(sources)): names
        for path in sources.rglob("*.py")
        if (names := kind.findall(path.read_text("utf-8")))
    }
    assert all(issubclass(getattr(zwidth.errors, name), zwidth.ZwidthError) for name in found.pop("errors.py"))
    # what the command line and the workbench say to themselves
    assert found == {"show/cli/errors.py": ["BadInput", "UnfinishedRun"], "show/app/worker.py": ["ComputeLost"]}
