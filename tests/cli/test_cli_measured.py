"""`zwidth chart` and `zwidth check` on a measured response; what other commands say of it."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import zwidth
from tests import systems
from tests.cli.command_runner import document_of, run_command
from tests.measured_cases import measured_response
from zwidth.chart import stability_chart
from zwidth.chart.measured import chart as measured_chart
from zwidth.errors import ResponseError
from zwidth.loop import Butterworth

HEAD = "frequency_Hz,real_m_per_N,imag_m_per_N"
DEVICE = """
name = "measured two masses"
[response]
{}
[loop]
sampling_period_s = 0.00125
[loop.velocity]
filter = {{ type = "butterworth", order = 2, cutoff_Hz = 100.0 }}
"""
LOSSY = """
name = "two masses with a loss factor"
[plant]
mass_kg = [[0.2616, 0.0], [0.0, 0.0254]]
stiffness_N_per_m = [[15620.0, -15620.0], [-15620.0, 15620.0]]
loss_factor = 0.15
actuator = [0.0, 1.0]
sensor = [0.0, 1.0]
handle = [1.0, 0.0]
[loop]
sampling_period_s = 0.00125
"""
DAMPER = "plant.damping_Ns_per_m=[[1.0, -1.0], [-1.0, 1.0]]"
LOOP = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))


def spectrum(path, f, value, **more):
    columns = [f, value.real, value.imag, *more.values()]
    lines = [",".join(repr(float(cell)) for cell in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([",".join([HEAD, *more]), *lines]) + "\n")


@pytest.fixture
def device(tmp_path):
    """A device with an exact response of 1 to 400 Hz beside it."""
    response, _ = measured_response(LOOP, np.linspace(1.0, 400.0, 400))
    spectrum(tmp_path / "sweep.csv", response.frequency, response.value)
    (tmp_path / "device.toml").write_text(DEVICE.format('file = "sweep.csv"'))
    return tmp_path / "device.toml"


@pytest.fixture
def noisy(tmp_path):
    """The same with a coherence of 0.99 in 16 averages, and the error that goes with it."""
    response, _ = measured_response(LOOP, np.linspace(1.0, 400.0, 400))
    rng = np.random.default_rng(1)
    error = np.sqrt(0.01 / (2 * 16 * 0.99)) * (rng.normal(size=400) + 1j * rng.normal(size=400))
    spectrum(
        tmp_path / "noisy.csv", response.frequency, response.value * (1.0 + error), coherence=np.full(400, 0.99)
    )
    (tmp_path / "noisy.toml").write_text(DEVICE.format('file = "noisy.csv"\naverages = 16'))
    return tmp_path / "noisy.toml"


def test_a_measured_chart_has_the_keys_of_every_chart_and_its_own(device):
    chart, exact = document_of("chart", device), stability_chart(LOOP, decay=False)
    assert chart["stiffness_max_N_per_m"] == pytest.approx(exact.stiffness_max, rel=1e-5)
    assert chart["damping_max_Ns_per_m"] == pytest.approx(exact.damping_max, rel=1e-4)
    assert chart["frequencies_at_stiffness_max_Hz"] == pytest.approx(exact.frequencies_at_stiffness_max, rel=1e-3)
    assert chart["fastest_decay"] is None
    assert chart["unobserved_modes"] == []
    assert (chart["integrators"], chart["closed"], chart["unusable"], chart["band"]) == (2, True, [], None)
    (ring,) = chart["regions"]
    assert ring[0] == ring[-1]
    inner = [arc for arc in chart["boundary"] if 0.0 < arc["frequency_Hz"][0] < 400.0]
    assert inner
    assert all(f == round(f) for arc in inner for f in arc["frequency_Hz"])


def test_people_read_the_band_and_what_is_not_to_be_relied_on_and_the_boundary_is_written_as_a_table(
    noisy, tmp_path
):
    document = document_of("chart", noisy, "--output", tmp_path / "edge.csv")
    band = document["band"]
    assert band["stiffness_low_N_per_m"] == document["stiffness_max_N_per_m"]
    nominal = document["stiffness_max_nominal_N_per_m"]
    assert document["stiffness_max_N_per_m"] < nominal < band["stiffness_high_N_per_m"]
    out = run_command("chart", noisy, "--output", tmp_path / "chart.png").out
    assert "[response]" in out
    assert "mean response" in out
    assert "95 % confidence" in out
    assert "400 of 400" in out
    assert (tmp_path / "chart.png").stat().st_size > 10_000
    rows = list(csv.DictReader((tmp_path / "edge.csv").read_text().splitlines()))
    inner = [row for row in rows if 0.0 < float(row["frequency_Hz"]) < 400.0]
    for row in inner:
        assert float(row["stiffness_low_N_per_m"]) < float(row["stiffness_N_per_m"])
        assert float(row["stiffness_N_per_m"]) < float(row["stiffness_high_N_per_m"])


def test_walls_are_judged_by_count_and_undecided_within_the_error(device, noisy, tmp_path):
    walls = tmp_path / "walls.csv"
    walls.write_text("stiffness_N_per_m,damping_Ns_per_m\n800,2.5\n800,9\n-50,2\n1560,2.02\n")
    exact = document_of("check", device, "--points", walls)["points"]
    assert [point["verdict"] for point in exact] == ["stable", "unstable", "unstable", "stable"]
    assert [point["roots_outside"] for point in exact] == [0, 2, 1, 0]
    assert all(point["spectral_radius"] is None for point in exact)
    assert exact[1]["frequency_Hz"] == pytest.approx(140.0, abs=15.0)
    assert exact[2]["frequency_Hz"] == 0.0
    doubted = document_of("check", noisy, "--points", walls)["points"]
    assert [point["verdict"] for point in doubted] == ["stable", "unstable", "unstable", "undecided"]
    assert "undecided" in run_command("check", noisy, "--stiffness", "1560", "--damping", "2.02").out


def test_an_edge_that_does_not_close_has_no_answer(device, tmp_path):
    response, _ = measured_response(LOOP, np.linspace(1.0, 100.0, 100))
    spectrum(tmp_path / "sweep.csv", response.frequency, response.value)
    ran = run_command("chart", device, "--json")
    assert ran.code == 1
    assert ran.document["stiffness_max_N_per_m"] is None
    assert ran.document["closed"] is False
    assert "are missing" in ran.document["reason"]
    (stretch,) = ran.document["unusable"]
    assert (stretch["low_Hz"], stretch["high_Hz"], stretch["on_edge"]) == (100.0, 400.0, True)


def test_a_response_whose_phase_rises_is_told_so(device, tmp_path):
    """It reaches half the sampling rate: more frequencies would not help."""
    response, _ = measured_response(LOOP)
    spectrum(tmp_path / "sweep.csv", response.frequency, response.value.conj())
    ran = run_command("chart", device, "--json")
    assert ran.code == 1
    assert "imaginary part" in ran.document["reason"]
    assert "are missing" not in ran.document["reason"]


@pytest.mark.parametrize("command", ["show", "report"])
def test_what_needs_a_model_has_no_answer(device, command):
    ran = run_command(command, device, "--json")
    assert ran.code == 1
    assert "no masses" in ran.document["reason"]
    assert ran.document["sampling_period_s"] == 0.00125


@pytest.fixture
def lossy(tmp_path):
    """Two masses joined by a spring with a loss factor of 0.15."""
    (tmp_path / "lossy.toml").write_text(LOSSY)
    return tmp_path / "lossy.toml"


def test_half_a_loss_factor_is_shown_as_damping(lossy):
    rigid, flexible = document_of("show", lossy)["damping_ratios"]
    assert rigid is None
    assert flexible == pytest.approx(0.075, rel=1e-12)
    viscous = document_of("show", lossy, "--set", "plant.loss_factor=unset", "--set", DAMPER)["damping_ratios"][1]
    both = document_of("show", lossy, "--set", DAMPER)["damping_ratios"][1]
    assert both == pytest.approx(viscous + 0.075, rel=1e-12)


def test_people_are_told_what_frequency_stands_beside_a_verdict(lossy, device):
    wall = ("--stiffness", "100", "--damping", "1")
    for file, column in ((lossy, "nearest edge at"), (device, "nearest edge at"), ("five-bar", "its frequency")):
        assert column in run_command("check", file, *wall).out


# --- what is not seen, and what cannot be asked ----------------------------------------------------------


def short_response(tmp_path, highest):
    response, _ = measured_response(LOOP, np.linspace(1.0, highest, 400))
    spectrum(tmp_path / "short.csv", response.frequency, response.value)
    (tmp_path / "short.toml").write_text(DEVICE.format('file = "short.csv"'))
    return tmp_path / "short.toml"


@pytest.mark.parametrize(("highest", "share"), [(380.0, 0.95), (400.0, 1.0)])
def test_a_response_that_nearly_reaches_half_the_sampling_rate_does_not_warn(tmp_path, highest, share):
    chart = document_of("chart", short_response(tmp_path, highest))
    assert (chart["measured_up_to_share"], chart["warning"]) == (pytest.approx(share), None)


def test_the_band_of_two_equal_sweeps_holds_the_largest_stiffness(tmp_path):
    response, _ = measured_response(LOOP, np.linspace(1.0, 400.0, 400))
    for name, by in (("one.csv", 1.0), ("two.csv", 1.0 + 1e-12)):  # copies to the last digit are warned of
        spectrum(tmp_path / name, response.frequency, by * response.value)
    (tmp_path / "device.toml").write_text(DEVICE.format('files = ["one.csv", "two.csv"]'))
    chart = document_of("chart", tmp_path / "device.toml")
    band = chart["band"]
    assert band["stiffness_low_N_per_m"] <= chart["stiffness_max_N_per_m"] <= band["stiffness_high_N_per_m"]


@pytest.mark.parametrize(
    ("command", "key"),
    [
        (("show",), "link_side_mass_kg"),
        (("report",), "file"),
    ],
)
def test_what_needs_a_model_has_no_answer_for_a_response(device, command, key):
    ran = run_command(command[0], device, *command[1:], "--json")
    assert ran.code == 1
    assert ran.document[key] is None
    assert "no masses" in ran.document["reason"]


def test_robust_takes_the_sweeps_of_a_response_as_members(tmp_path):
    response, _ = measured_response(LOOP, np.linspace(1.0, 400.0, 200))
    for name, factor in (("one.csv", 1.0), ("two.csv", 1.05)):
        spectrum(tmp_path / name, response.frequency, response.value * factor)
    (tmp_path / "repeated.toml").write_text(DEVICE.format('files = ["one.csv", "two.csv"]'))
    ran = run_command("robust", tmp_path / "repeated.toml", "--json")
    document = ran.document
    assert (ran.code, document["decided"]) == (0, True)
    assert [one["sweep"] for one in document["members"]] == ["mean", "1", "2"]
    softest = 0.5 * stability_chart(LOOP, decay=False).stiffness_max
    assert softest < document["stiffness_max_N_per_m"]
    out = run_command("robust", tmp_path / "repeated.toml").out
    assert "this limit" in out
    assert "whole list" in out


def test_a_contact_is_simulated_by_a_fitted_plant_that_says_its_error(device):
    wall = ("--stiffness", 800, "--damping", 2.5)
    simulated = document_of("simulate", device, *wall)
    assert simulated["stable"] is True
    fit = simulated["fit"]
    assert fit["misfit"] < 1e-6
    assert fit["stiffness_max_N_per_m"] == pytest.approx(fit["stiffness_max_of_response_N_per_m"], rel=1e-4)
    out = run_command("simulate", device, *wall).out
    assert "plant of" in out
    assert "modes fitted" in out


@pytest.mark.parametrize("verb", ["simulate", "bounds"])
def test_a_plant_with_other_walls_than_the_response_stands_for_nothing(device, monkeypatch, verb):
    point = zwidth.load(device).at()
    wall = (800.0, 2.5) if verb == "simulate" else ()
    monkeypatch.setattr(measured_chart, "FURTHEST", 1.0)
    with pytest.raises(ResponseError, match=r"its largest .* N/m, .* N/m"):
        getattr(point, verb)(*wall)


def test_bounds_are_those_of_the_fitted_plant(device):
    document = document_of("bounds", device)
    assert document["exact_largest_N_per_m"] == pytest.approx(document["fit"]["stiffness_max_N_per_m"], rel=1e-9)
    assert len(document["bounds"]) > 10


def test_an_operator_holds_a_response_whose_places_are_stated(tmp_path, device):
    text = device.read_text().replace("[response]", '[response]\nhandle_at = "sensor"\nactuator_at = "sensor"')
    (tmp_path / "held.toml").write_text(text)
    free = document_of("chart", tmp_path / "held.toml")
    held = document_of("chart", tmp_path / "held.toml", "--operator", "course-hand")
    assert held["stiffness_max_N_per_m"] != pytest.approx(free["stiffness_max_N_per_m"], rel=1e-3)
    assert "held by" in held["measurement"]
