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
    with pytest.raises(OperatingPointError, match="the device has a measured response and no model"):
        _ = point.plant
    with pytest.raises(DeviceError, match=r"direction: does not apply to a device given by its \[response\]"):
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
    assert files.note == "mean of 2 sweeps"


def test_a_raw_sweep_becomes_a_response(write):
    force = np.random.default_rng(0).normal(size=6000)
    loop = Loop(systems.published().plant, Controller(T))
    lines = [RECORD, *rows(np.arange(6000) * T, force, encoder_readings(loop, force))]
    response = load(write(lines, 'file = "sweep.csv"\nintegrators = 2\nsegment_samples = 512')).response
    assert response.coherence is not None
    assert response.note == "from 6000 samples by local polynomials"


def broken(lines, number, text):
    """The file with one line (counted from 1) replaced; None: removed."""
    return [*lines[: number - 1], *([] if text is None else [text]), *lines[number:]]


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda s: [], "sweep.csv: is empty; its first line must name columns"),
        (lambda s: s[:1], "sweep.csv: holds no numbers"),
        (lambda s: s[:5], "sweep.csv: has 4 frequencies; at least 6 are needed"),
        (lambda s: broken(s, 1, "frequency_Hz,re,imag_m_per_N"), "line 1: column real_m_per_N is missing"),
        (lambda s: broken(s, 1, HEAD + ",sweep,sweep"), "line 1: column sweep is there more than once"),
        (lambda s: broken(s, 4, "12,x,0.0"), "sweep.csv: line 4: real_m_per_N: must be a finite number, got 'x'"),
        (lambda s: broken(s, 4, "12,1e-5"), "line 4: imag_m_per_N: must be a finite number, but it is missing"),
        (lambda s: broken(s, 4, "12,nan,0"), "line 4: real_m_per_N: must be a finite number, got 'nan'"),
        (lambda s: broken(s, 4, "12,0,1,5"), "line 4: has 4 cells, but the header names 3 columns"),
        (lambda s: broken(s, 2, "0,1,0"), "line 2: frequency_Hz: must be greater than 0, got 0"),
        (lambda s: broken(s, 5, s[3]), "line 5: frequency_Hz: 12 is there twice; keep one of them"),
        (lambda s: [*s[:4], s[5], s[4], *s[6:]], "line 6: frequency_Hz: 16 follows 20; sort the lines"),
        (lambda s: [*s, "401,1e-9,0"], "frequency_Hz: 401 is above half the sampling rate, 400; leave it out"),
        (lambda s: [s[0], *(line.split(",")[0] + ",0,0" for line in s[1:])], "is 0 m/N at every frequency"),
        (lambda s: [s[0] + ",coherence", *(line + ",1.5" for line in s[1:2]), *(line + ",1" for line in s[2:])],
         "line 2: coherence: must be from 0 to 1, got 1.5"),
        (lambda s: [HEAD + ",sweep", *(line + ",1" for line in s[1:]), *(line + ",2" for line in s[2:])],
         "sweep: sweep 2 has other frequencies than the first"),
        (lambda s: broken(s, 3, '"8'), "is not CSV"),
        (lambda s: [RECORD, "0,1,0", "0.00125,1,0", "0.0035,1,0", "0.00475,1,0"],
         "line 4: time_s: comes 0.00225 s after the line before, most others 0.00125 s"),
        (lambda s: [RECORD, *(f"{0.001 * j:.3f},{j % 3},0" for j in range(50))],
         "time_s: rises by 0.001 s from line to line, but sampling_period_s is 0.00125"),
        (lambda s: [RECORD, *(f"{T * j!r},{j % 3},0" for j in range(50))], "has 50 samples, too few"),
        (lambda s: [RECORD, "0,1,0"], "has one line only; record a sweep"),
    ],
)  # fmt: skip
def test_a_fault_of_the_file_is_one_line(write, spectrum, change, fault):
    (line,) = faults(write(change(spectrum)))
    assert fault in line


def test_many_faults_are_told_together_and_not_without_end(write, spectrum):
    found = faults(write([spectrum[0], *("a,b,c" for _ in spectrum[1:])]))
    assert len(found) == 3 * 4
    assert found[3] == "sweep.csv: frequency_Hz: and 97 more lines, the last of them line 101"
    backward = faults(write([spectrum[0], *reversed(spectrum[1:5])]))
    assert [line.split(": ")[1] for line in backward] == ["line 3", "line 4", "line 5"]
    assert faults(write([spectrum[0], *reversed(spectrum[1:6])]))[3].endswith(
        "and 1 more line, the last of them line 6"
    )


def test_a_file_that_is_not_there_or_not_text(write, spectrum, tmp_path):
    (line,) = faults(write(spectrum, 'file = "swep.csv"'))
    assert line == "swep.csv: no such file; response.file is a path from the device file's folder"
    path = write(spectrum)
    (tmp_path / "sweep.csv").write_bytes(b"\xff\x00")
    assert "is not UTF-8 text" in faults(path)[0]


@pytest.mark.parametrize(
    ("keys", "fault"),
    [
        ("", "device.toml: response: names no file; give file"),
        ('file = "a.csv"\nfiles = ["a.csv", "b.csv"]', "device.toml: response: names both file and files"),
        ('file = "sweep.csv"\nintegrators = 3', "response.integrators: must be at most 2, got 3"),
        ('file = "sweep.csv"\nintegrators = 1.5', "response.integrators: must be a whole number"),
        ('file = "sweep.csv"\naverages = 0', "response.averages: must be at least 1"),
        ('file = "sweep.csv"\n[plant]\nmass_kg = 1.0', "has [plant] and [response]; only one of them is allowed"),
    ],
)
def test_a_fault_of_the_section(write, spectrum, keys, fault):
    assert any(fault in line for line in faults(write(spectrum, keys)))


def test_what_the_response_holds_already_is_refused(write, spectrum):
    path = write(spectrum)
    text = path.read_text()
    path.write_text(text + "delay_samples = 0.5\n")
    (line,) = faults(path)
    assert "loop.delay_samples: must be a whole number of samples with a [response], got 0.5" in line
    path.write_text(text + "delay_samples = 2\n")
    assert load(path).controller.delay == 2.0
    path.write_text(text + '[operator]\narm_mass_kg = 0.8\ngrasp = "rigid"\n')
    (line,) = faults(path)
    assert "operator: cannot be attached to this [response]: it has no path" in line
    path.write_text(text + "[loop.actuator]\ntime_constant_s = 0.001\n")
    assert any("loop.actuator: is part of a measured [response] already" in line for line in faults(path))


# --- the paths of the handle ----------------------------------------------------------------------------

PAIR = "handle_force_to_encoder_real_m_per_N,handle_force_to_encoder_imag_m_per_N"


def test_the_paths_of_the_handle_stand_in_the_same_file_or_beside_it(write, spectrum, tmp_path):
    head, *lines = spectrum
    same = load(
        write([f"{head},{PAIR}", *(f"{line},1e-3,-2e-3" for line in lines)], 'file = "sweep.csv"')
    ).response
    assert set(same.handle.force_to_encoder.value) == {1e-3 - 2e-3j}
    assert same.handle.missing == ("from the command to the handle", "from the handle's force to the handle")
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
    assert "sweep 8 has other frequencies than the first" in line


def test_half_a_path_and_a_path_given_twice_are_refused(write, spectrum):
    head, *lines = spectrum
    path = write([f"{head},{PAIR.split(',')[0]}", *(f"{line},1e-3" for line in lines)])
    (line,) = faults(path)
    assert "handle_force_to_encoder_imag_m_per_N is missing" in line
    first = [line.split(",")[0] for line in lines]
    write([f"frequency_Hz,{PAIR}", *(f"{f},1e-3,-2e-3" for f in first)], name="hand.csv")
    keys = 'file = "sweep.csv"\nhandle_file = "hand.csv"'
    (line,) = faults(write([f"{head},{PAIR}", *(f"{line},1e-3,-2e-3" for line in lines)], keys))
    assert "is in sweep.csv, too; keep one of them" in line
    write(["frequency_Hz,other", "1,2"], name="hand.csv")
    (line,) = faults(write(spectrum, keys))
    assert "has no path from the handle's force" in line
    write([f"frequency_Hz,{PAIR}", *(f"{float(f) + 0.5},1e-3,-2e-3" for f in first[:-1])], name="hand.csv")
    (line,) = faults(write(spectrum, keys))
    assert "has other frequencies than sweep.csv" in line


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
    assert "keep it constant" in line


def test_a_handle_file_must_lie_beside_the_device_file(write, spectrum):
    (line,) = faults(write(spectrum, 'file = "sweep.csv"\nhandle_file = "../hand.csv"'))
    assert "response.handle_file: must lie in the folder of the device file" in line
