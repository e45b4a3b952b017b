"""Records of one mass: what `identify response` and `modes` say of errors, single sweeps, copies, no resonance."""

import numpy as np
import pytest

from tests.identify.modes_bench import columns, readings, two_mass_device
from zwidth.chart import measured_chart
from zwidth.device import from_document
from zwidth.identify import Columns, SweepBlocks, identify, record_of
from zwidth.identify.response.identify import shared_excitation
from zwidth.loop import Controller
from zwidth.model import Response

PERIOD = 1e-3


def one_mass(damping):
    """0.1 kg on a spring of 400 N/m: 10 Hz."""
    plant = {"mass_kg": 0.1, "stiffness_N_per_m": 400.0, "damping_Ns_per_m": damping}
    document = {"name": "mass on a spring", "plant": plant, "loop": {"sampling_period_s": PERIOD}}
    return from_document(document, "mass on a spring")


def shaken(device, count=12_000):
    rng = np.random.default_rng(3)
    force = rng.normal(size=count)
    position = readings(device.at().plant, PERIOD, force, 0.0)
    return columns(force, position + 1e-7 * rng.normal(size=count), PERIOD)


def test_a_resonance_too_sharp_for_the_record_is_named_as_the_reason():
    """By the response as measured walls are stable; the columns are right, and are not said to be wrong."""
    device = one_mass(0.2)  # 1.6 % of damping: 0.3 Hz wide, in a record of 8 s
    found = identify(device, "response", shaken(device))
    (chart,) = (check for check in found.checks if check.what == "chart")
    assert not chart.passed
    assert "wall certain" in chart.reason
    nominal, at = (float(chart.reason.split(word)[1].split()[0]) for word in ("walls up to", "most of all at"))
    exact = device.chart(decay=False).stiffness_max
    assert abs(nominal / exact - 1.0) < 0.05
    assert 8.0 < at < 12.0


def test_the_written_columns_give_the_same_interval_with_the_keys_that_are_named():
    device = one_mass(6.0)
    found = identify(device, "response", shaken(device))
    (said,) = (remark for remark in found.remarks if "averages = " in remark)
    averages = float(said.split("averages = ")[1].split(",")[0])
    f, real, imag, coherence = (
        np.array(found.curves[name]) for name in ("frequency_Hz", "real_m_per_N", "imag_m_per_N", "coherence")
    )
    again = Response(f, real + 1j * imag, int(said[-1]), coherence=coherence, averages=averages)
    chart = measured_chart(again, Controller(PERIOD))
    (stiffness,) = found.estimates
    assert abs(chart.stiffness_max / stiffness.low - 1.0) < 0.02


def chirp(count, up=True):
    """A force that goes through all frequencies once, evenly."""
    t = np.arange(count)
    phase = np.pi * 0.49 * t**2 / count
    return np.sin(phase if up else phase[::-1])


@pytest.mark.parametrize("up", [True, False])
def test_a_single_sweep_is_fitted_as_a_whole_and_is_said_not_to_predict_itself(up):
    """Two thirds of it would have no high, or no low frequencies."""
    device = one_mass(6.0)
    force = chirp(12_000, up)
    record = columns(force, readings(device.at().plant, PERIOD, force, 0.0), PERIOD)
    found = identify(device, "response", record)
    (stiffness,) = found.estimates
    assert stiffness.low < device.chart(decay=False).stiffness_max < stiffness.high
    assert max(found.curves["frequency_Hz"]) > 480.0
    assert np.isnan(found.validation)
    (said,) = (check for check in found.checks if check.what == "validation")
    assert said.warning
    assert "sweep twice" in said.reason


def test_sweeps_in_files_of_their_own_are_predicted_from_each_other():
    device = one_mass(6.0)
    force = chirp(12_000)
    position = readings(device.at().plant, PERIOD, force, 0.0)
    noise = 1e-7 * np.random.default_rng(1).normal(size=(2, len(force)))
    found = identify(device, "response", [columns(force, position + one, PERIOD) for one in noise])
    assert found.validation > 0.9
    assert "another one" in found.validated_on


def test_noise_excites_both_parts_of_a_record_alike_and_a_sweep_does_not():
    def shared(force):
        record = record_of({"f": force, "x": force}, Columns(("f", "x")))
        return shared_excitation(SweepBlocks(record, "f", "x", 0, len(force)), 2 * len(force) // 3)

    assert shared(np.random.default_rng(0).normal(size=9000)) > 0.7
    assert shared(np.random.default_rng(0).normal(size=300)) > 0.5
    assert shared(np.concatenate([chirp(3000)] * 2)) > 0.3
    assert shared(chirp(9000)) < 0.05


def test_a_copy_of_a_sweep_is_no_repetition():
    device = one_mass(6.0)
    record = shaken(device, 4000)
    found = identify(device, "response", [record, record])
    assert not found.estimates
    assert "sweep 1 again" in found.reason


def test_modes_of_a_mass_without_any_resonance_are_its_own_numbers():
    """There is nothing that dampers could couple."""
    plant = {"mass_kg": 0.1, "damping_Ns_per_m": 0.5}
    device = from_document(
        {"name": "a mass and a dashpot", "plant": plant, "loop": {"sampling_period_s": PERIOD}}, "mass"
    )
    found = identify(device, "modes", shaken(device, 8000))
    for path, value in (("plant.mass_kg", 0.1), ("plant.damping_Ns_per_m", 0.5)):
        assert found[path].value == pytest.approx(value, rel=1e-3)


def test_a_sweep_that_passes_low_frequencies_in_no_time_is_said_to_and_repeated_it_answers():
    """Columns that are right are not said to be shifted."""
    device = two_mass_device((0.9, 0.15), 2.5, 2e4, PERIOD)

    def swept(times):
        force = np.tile(chirp(8000), times)
        position = readings(device.at().plant, PERIOD, force, 0.0)
        noise = 5e-6 * np.random.default_rng(0).normal(size=len(force))
        return identify(device, "response", columns(force, position + noise, PERIOD))

    (chart,) = (check for check in swept(1).checks if check.what == "chart")
    assert not chart.passed
    assert "held one" in chart.reason
    assert "shifted" not in chart.reason
    (stiffness,) = swept(4).estimates
    assert stiffness.low < device.chart(decay=False).stiffness_max < stiffness.high
