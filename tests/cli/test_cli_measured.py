"""`zwidth chart` and `zwidth check` on a measured response; what other commands say of it."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from tests import systems
from tests.cli.cli_run import found, refused, zwidth
from tests.measured_cases import measured
from zwidth.chart.chart import stability_chart
from zwidth.loop.controller import Butterworth

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
LOOP = systems.published(delay=0.5, velocity_filter=Butterworth(2, 100.0))


def spectrum(path, f, value, **more):
    columns = [f, value.real, value.imag, *more.values()]
    lines = [",".join(repr(float(cell)) for cell in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([",".join([HEAD, *more]), *lines]) + "\n")


@pytest.fixture
def device(tmp_path):
    """A device with an exact response of 1 to 400 Hz beside it."""
    response, _ = measured(LOOP, np.linspace(1.0, 400.0, 400))
    spectrum(tmp_path / "sweep.csv", response.frequency, response.value)
    (tmp_path / "device.toml").write_text(DEVICE.format('file = "sweep.csv"'))
    return tmp_path / "device.toml"


@pytest.fixture
def noisy(tmp_path):
    """The same with a coherence of 0.99 in 16 averages, and the error that goes with it."""
    response, _ = measured(LOOP, np.linspace(1.0, 400.0, 400))
    rng = np.random.default_rng(1)
    error = np.sqrt(0.01 / (2 * 16 * 0.99)) * (rng.normal(size=400) + 1j * rng.normal(size=400))
    spectrum(
        tmp_path / "noisy.csv", response.frequency, response.value * (1.0 + error), coherence=np.full(400, 0.99)
    )
    (tmp_path / "noisy.toml").write_text(DEVICE.format('file = "noisy.csv"\naverages = 16'))
    return tmp_path / "noisy.toml"


def test_a_measured_chart_has_the_keys_of_every_chart_and_its_own(device):
    chart, exact = found("chart", device), stability_chart(LOOP, decay=False)
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


def test_people_read_the_band_and_what_is_not_to_be_relied_on(noisy, tmp_path):
    document = found("chart", noisy)
    band = document["band"]
    assert band["stiffness_low_N_per_m"] < document["stiffness_max_N_per_m"] < band["stiffness_high_N_per_m"]
    out = zwidth("chart", noisy, "--output", tmp_path / "chart.png").out
    assert "[response]" in out
    assert "within 95 % of the error that the coherence tells" in out
    assert "400 of 400 frequencies used, 2 integrators" in out
    assert (tmp_path / "chart.png").stat().st_size > 10_000


def test_the_boundary_is_written_as_a_table(noisy, tmp_path):
    found("chart", noisy, "--output", tmp_path / "edge.csv")
    rows = list(csv.DictReader((tmp_path / "edge.csv").read_text().splitlines()))
    inner = [row for row in rows if 0.0 < float(row["frequency_Hz"]) < 400.0]
    for row in inner:
        assert float(row["stiffness_low_N_per_m"]) < float(row["stiffness_N_per_m"])
        assert float(row["stiffness_N_per_m"]) < float(row["stiffness_high_N_per_m"])


def test_walls_are_judged_by_count_and_undecided_within_the_error(device, noisy, tmp_path):
    walls = tmp_path / "walls.csv"
    walls.write_text("stiffness_N_per_m,damping_Ns_per_m\n800,2.5\n800,9\n-50,2\n1560,2.02\n")
    exact = found("check", device, "--points", walls)["points"]
    assert [point["verdict"] for point in exact] == ["stable", "unstable", "unstable", "stable"]
    assert [point["roots_outside"] for point in exact] == [0, 2, 1, 0]
    assert all(point["spectral_radius"] is None for point in exact)
    assert exact[1]["frequency_Hz"] == pytest.approx(140.0, abs=15.0)
    assert exact[2]["frequency_Hz"] == 0.0
    doubted = found("check", noisy, "--points", walls)["points"]
    assert [point["verdict"] for point in doubted] == ["stable", "unstable", "unstable", "undecided"]
    assert "undecided" in zwidth("check", noisy, "--stiffness", "1560", "--damping", "2.02").out


def test_an_edge_that_does_not_close_has_no_answer(device, tmp_path):
    response, _ = measured(LOOP, np.linspace(1.0, 100.0, 100))
    spectrum(tmp_path / "sweep.csv", response.frequency, response.value)
    ran = zwidth("chart", device, "--json")
    assert ran.code == 1
    assert ran.document["stiffness_max_N_per_m"] is None
    assert ran.document["closed"] is False
    assert "frequencies are missing" in ran.document["reason"]
    (stretch,) = ran.document["unusable"]
    assert (stretch["low_Hz"], stretch["high_Hz"], stretch["on_edge"]) == (100.0, 400.0, True)


@pytest.mark.parametrize("command", ["show", "report"])
def test_what_needs_a_model_has_no_answer(device, command):
    ran = zwidth(command, device, "--json")
    assert ran.code == 1
    assert "a measured response has no masses" in ran.document["reason"]
    assert ran.document["sampling_period_s"] == 0.00125


def test_options_that_need_a_model_and_faults_of_the_file_are_refused(device, tmp_path):
    assert refused("chart", device, "--model", "rigid") == [
        f"{device}: model: does not apply to a device given by its [response]; leave it out"
    ]
    (line,) = refused("check", device, "--at", "0,1", "--stiffness", "1", "--damping", "1")
    assert "at: does not apply" in line
    text = (tmp_path / "sweep.csv").read_text().splitlines()
    (tmp_path / "sweep.csv").write_text("\n".join([text[0], text[2], text[1], *text[3:]]))
    (line,) = refused("chart", device)
    assert (
        line == f"{tmp_path / 'sweep.csv'}: line 3: frequency_Hz: 1 follows 2; sort the lines by rising frequency"
    )
    response, _ = measured(LOOP, np.linspace(1.0, 400.0, 400))
    spectrum(tmp_path / "sweep.csv", response.frequency, 1j * np.conj(response.value))
    (line,) = refused("chart", device)
    assert "are columns swapped" in line
