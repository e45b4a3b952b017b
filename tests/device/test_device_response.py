"""Reading measured responses: what is taken, and every way a file can be wrong, on one line each."""

from __future__ import annotations

import numpy as np
import pytest

from tests import systems
from tests.measured_cases import encoder_readings, measured_response
from zwidth.device.load import load
from zwidth.errors import DeviceError, OperatingPointError
from zwidth.loop import Controller, Loop

T = 0.00125
HEAD = "frequency_Hz,real_m_per_N,imag_m_per_N"
RECORD = "time_s,force_command_N,position_m"
FILE = 'name = "measured"\n[response]\n{}\n[loop]\nsampling_period_s = 0.00125\n'


def rows(*columns):
    return [",".join(repr(float(cell)) for cell in row) for row in zip(*columns, strict=True)]


@pytest.fixture
def spectrum():
    """Lines of a right file."""
    response, _ = measured_response(systems.published(), np.linspace(4.0, 400.0, 100))
    return [HEAD, *rows(response.frequency, response.value.real, response.value.imag)]


@pytest.fixture
def write(tmp_path):
    """Writes a response and its device file; the path of the latter."""

    def written(lines, keys='file = "sweep.csv"', name="sweep.csv"):
        (tmp_path / name).write_text("\n".join(lines) + "\n")
        (tmp_path / "device.toml").write_text(FILE.format(keys))
        return tmp_path / "device.toml"

    return written


def faults(path):
    with pytest.raises(DeviceError) as caught:
        load(path)
    return [str(fault).replace(str(path.parent) + "/", "") for fault in caught.value.faults]


def test_a_response_stands_beside_its_device_file(write, spectrum):
    device = load(write(spectrum, 'file = "sweep.csv"\nintegrators = 2'))
    assert device.mechanism is device.given_plant is None
    assert len(device.response.frequency) == 100
    assert device.response.integrators == 2
    assert device.response.value[0] == pytest.approx(complex(*map(float, spectrum[1].split(",")[1:])))
    point = device.at()
    with pytest.raises(OperatingPointError, match="measured response"):
        _ = point.plant
    with pytest.raises(DeviceError, match=r"direction: .*\[response\]"):
        device.at(direction=(1.0, 0.0))


def test_coherence_and_repeated_sweeps_are_read(write, spectrum):
    head, *lines = spectrum
    device = load(
        write([head + ",coherence", *(line + ",0.9" for line in lines)], 'file = "sweep.csv"\naverages = 8')
    )
    assert set(device.response.coherence) == {0.9}
    assert device.response.averages == 8.0
    others = [line.rsplit(",", 1)[0] + ",-0.0" for line in lines]  # a copy would be warned of
    both = [f"{line},{n}" for n, some in enumerate((lines, others)) for line in some]
    twice = load(write([head + ",sweep", *both])).response
    assert twice.sweeps.shape == (2, 100)
    write([head, *others], name="other.csv")
    files = load(write(spectrum, 'files = ["sweep.csv", "other.csv"]')).response
    assert files.sweeps.shape == (2, 100)
    assert files.note.endswith(" 2 sweeps")


def test_a_raw_sweep_becomes_a_response(write):
    force = np.random.default_rng(0).normal(size=6000)
    loop = Loop(systems.published().plant, Controller(T))
    lines = [RECORD, *rows(np.arange(6000) * T, force, encoder_readings(loop, force))]
    response = load(write(lines, 'file = "sweep.csv"\nintegrators = 2\nsegment_samples = 512')).response
    assert response.coherence is not None
    assert response.note.startswith("from 6000 samples ")


# --- the paths of the handle ----------------------------------------------------------------------------

PAIR = "handle_force_to_encoder_real_m_per_N,handle_force_to_encoder_imag_m_per_N"


def test_the_paths_of_the_handle_stand_in_the_same_file_or_beside_it(write, spectrum, tmp_path):
    head, *lines = spectrum
    same = load(
        write([f"{head},{PAIR}", *(f"{line},1e-3,-2e-3" for line in lines)], 'file = "sweep.csv"')
    ).response
    assert set(same.handle.force_to_encoder.value) == {1e-3 - 2e-3j}
    assert same.handle.command_to_handle is same.handle.force_to_handle is None
    assert len(same.handle.missing) == 2
    first = [line.split(",")[0] for line in lines]
    write([f"frequency_Hz,{PAIR}", *(f"{f},1e-3,-2e-3" for f in first)], name="hand.csv")
    keys = 'file = "sweep.csv"\nhandle_file = "hand.csv"\nhandle_at = "sensor"\nhardware_delay_samples = 0.4'
    beside = load(write(spectrum, keys)).response
    assert set(beside.handle.force_to_encoder.value) == {1e-3 - 2e-3j}
    assert (beside.handle.missing, beside.delay) == ((), 0.4)


def test_repeated_sweeps_of_the_handle_share_their_frequencies(write, spectrum):
    first = [line.split(",")[0] for line in spectrum[1:]]
    keys = 'file = "sweep.csv"\nhandle_file = "hand.csv"'
    for sweeps in ("7", "78"):
        values = [f"{f},{k}e-3,-2e-3,{n}" for k, n in enumerate(sweeps, 1) for f in first]
        write([f"frequency_Hz,{PAIR},sweep", *values], name="hand.csv")
        mean = np.mean(np.arange(1, len(sweeps) + 1))
        assert load(write(spectrum, keys)).response.handle.force_to_encoder.value == pytest.approx(
            1e-3 * mean - 2e-3j
        )
    write([f"frequency_Hz,{PAIR},sweep", *values[:-1]], name="hand.csv")
    (line,) = faults(write(spectrum, keys))
    assert "sweep 8 " in line


def test_two_raw_experiments_make_the_paths(write):
    loop = Loop(systems.published().plant, Controller(T))
    force = np.random.default_rng(5).normal(size=4000)
    reading = encoder_readings(loop, force)
    time = T * np.arange(4000)
    record = [
        RECORD + ",handle_position_m,handle_force_N",
        *rows(time, force, reading, 2.0 * reading, 0.0 * force),
    ]
    hand = ["time_s,handle_force_N,position_m,force_command_N", *rows(time, force, reading, 0.0 * force)]
    write(hand, name="hand.csv")
    keys = 'file = "sweep.csv"\nhandle_file = "hand.csv"\nintegrators = 2'
    response = load(write(record, keys)).response
    assert response.handle.command_to_handle.value == pytest.approx(2.0 * response.value)
    assert response.handle.force_to_encoder.value == pytest.approx(response.value)
    assert response.handle.force_to_handle is None
    write(
        ["time_s,handle_force_N,position_m,force_command_N", *rows(time, force, reading, force)], name="hand.csv"
    )
    (line,) = faults(write(record, keys))
    assert "force_command_N: varies by" in line
    assert "constant" in line


def test_a_handle_file_must_lie_beside_the_device_file(write, spectrum):
    (line,) = faults(write(spectrum, 'file = "sweep.csv"\nhandle_file = "../hand.csv"'))
    assert "response.handle_file: must lie" in line
