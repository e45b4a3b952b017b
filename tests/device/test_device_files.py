"""Which files are read at all: plain ones, and of a [response] those that lie with the device file."""

from __future__ import annotations

import os
import signal
from threading import Thread

import numpy as np
import pytest

from tests import systems
from tests.cli.command_runner import TWO_MASS, refusal_lines, run_command
from tests.interruption import HANG_TIMEOUT_S
from tests.measured_cases import measured_response
from zwidth.device.load import load
from zwidth.errors import DeviceError
from zwidth.study import read_study

DEVICE = 'name = "measured"\n[response]\n{}\n[loop]\nsampling_period_s = 0.00125\n'
STUDY = 'device = "{}"\nmeasures = ["stiffness_max"]\n[[axis]]\nkey = "loop.delay_samples"\nvalues = [0, 1]\n'
MASS = DEVICE.replace("[response]\n{}", "[plant]\nmass_kg = 0.1\ndamping_Ns_per_m = 1.0")
SECRET = "root:swordfish:0"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder in which a right sweep lies beside the device file, one below it, and one outside."""
    inside = tmp_path / "inside"
    (inside / "data").mkdir(parents=True)
    response, _ = measured_response(systems.published(), np.linspace(4.0, 400.0, 100))
    cells = zip(response.frequency, response.value.real, response.value.imag, strict=True)
    text = "frequency_Hz,real_m_per_N,imag_m_per_N\n" + "".join(f"{f!r},{a!r},{b!r}\n" for f, a, b in cells)
    text = text.replace("np.float64(", "").replace(")", "")
    for file in ("sweep.csv", "data/sweep.csv", "../outside.csv"):
        (inside / file).write_text(text)
    (tmp_path / "secret").write_text(f"{SECRET}\n{SECRET}\n")
    monkeypatch.chdir(tmp_path)
    return inside


@pytest.fixture
def no_waiting():
    """A reading that waits for ever is a failure."""

    def late(*_):
        raise TimeoutError("it waits for ever")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(int(HANG_TIMEOUT_S))
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def faults(folder, file):
    """The lines that refuse a device whose response is in this file."""
    (folder / "device.toml").write_text(DEVICE.format(f"file = '{file}'"))
    with pytest.raises(DeviceError) as caught:
        load(folder / "device.toml")
    return [str(fault) for fault in caught.value.faults]


@pytest.mark.parametrize("file", ["sweep.csv", "./sweep.csv", "data/sweep.csv", "data/../sweep.csv", "link.csv"])
def test_a_response_is_read_from_the_folder_of_its_device_file(folder, file):
    (folder / "link.csv").symlink_to("data/sweep.csv")
    (folder / "device.toml").write_text(DEVICE.format(f"file = '{file}'"))
    assert len(load(folder / "device.toml").response.frequency) == 100
    assert len(load("inside/device.toml").response.frequency) == 100


@pytest.mark.parametrize(
    "file", ["../outside.csv", "data/../../outside.csv", "{}/outside.csv", "out.csv", "up/outside.csv"]
)
def test_a_response_from_elsewhere_is_refused(folder, file):
    (folder / "out.csv").symlink_to("../outside.csv")
    (folder / "up").symlink_to("..")
    (line,) = faults(folder, file.format(folder.parent))
    assert "response.file: must lie " in line


@pytest.mark.parametrize("file", ["../secret", "secret", "secret.csv"])
def test_a_refusal_repeats_nothing_of_a_file_that_is_no_sweep(folder, file):
    (folder / "secret").symlink_to("../secret")
    (folder / "secret.csv").write_text((folder.parent / "secret").read_text())
    (line,) = faults(folder, file)
    assert "swordfish" not in line
    if file == "secret.csv":
        assert "line 1: columns frequency_Hz, real_m_per_N, imag_m_per_N" in line


@pytest.mark.usefixtures("no_waiting")
def test_a_pipe_for_a_response_is_refused(folder):
    os.mkfifo(folder / "pipe.csv")
    (line,) = faults(folder, "pipe.csv")
    assert "pipe.csv: is a pipe" in line


@pytest.mark.usefixtures("no_waiting")
@pytest.mark.parametrize(
    "words",
    [
        ("chart", TWO_MASS, "--operator", "{}"),
        ("robust", TWO_MASS, "--operator-list", "{}"),
        ("simulate", TWO_MASS, "--environment", "{}:wall"),
        ("map", "five-bar", "--measures-file", "{}", "--measure", "isotropy"),
        ("sweep", "{}"),
        ("experiment", TWO_MASS, "--resume", "{}", "--output", "never.csv"),
    ],
)
def test_a_pipe_for_a_file_that_is_read_again_is_one_line(tmp_path, words):
    pipe = tmp_path / "pipe.py"
    os.mkfifo(pipe)
    (line,) = refusal_lines(*(word.format(pipe) for word in words))
    assert "ordinary file" in line


@pytest.mark.usefixtures("no_waiting")
@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("check", "{}", "--stiffness", 100, "--damping", 1), MASS),
        (("check", TWO_MASS, "--points", "{}"), "stiffness_N_per_m,damping_Ns_per_m\n4000,10\n"),
    ],
    ids=["device", "points"],
)
def test_a_pipe_that_the_user_names_is_read(tmp_path, words, text):
    """As the shell makes one for <(program)."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = Thread(target=pipe.write_text, args=(text,))
    writer.start()
    ran = run_command(*(str(word).format(pipe) for word in words))
    writer.join()
    assert (ran.code, ran.err) == (0, "")
    assert "stable" in ran.out


@pytest.mark.usefixtures("no_waiting")
def test_what_a_study_names_is_a_plain_file(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    for name, fault in (("pipe.toml", "is a pipe"), ("/dev/zero", "is a device"), (".", "is a directory")):
        (tmp_path / "study.toml").write_text(STUDY.format(name))
        with pytest.raises(DeviceError) as caught:
            read_study(tmp_path / "study.toml")
        (line,) = map(str, caught.value.faults)
        assert fault in line
