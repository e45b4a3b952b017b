"""Bad input through the command line: exit code 2, one line per fault, nothing on standard output."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from tests.cli.command_runner import MECHANISM, TWO_MASS, refusal_lines, run_command
from tests.cli.test_cli_process import ZWIDTH
from zwidth.errors import OutputError
from zwidth.show.output import replacing

# --- bad input through the command line: exit code 2, one line per fault, nothing on standard --------


PLANT = """
name = "two masses"
[plant]
mass_kg = [[0.3, 0.0], [0.0, 0.02]]
stiffness_N_per_m = [[9000.0, -9000.0], [-9000.0, 9000.0]]
actuator = [0.0, 1.0]
sensor = [0.0, 1.0]
[loop]
sampling_period_s = 0.001
"""
FILTER = '[loop.velocity.filter]\ntype = "butterworth"\n'
PLANT_AND_MECHANISM = "[mechanism]\n[[mechanism.links]]\nname = 'a'\n"


# what is replaced in PLANT (None: the whole of it), by what, and for each line its key and words of it
FILES = {
    "missing key": ("sampling_period_s = 0.001", "", [("loop.sampling_period_s", "is missing")]),
    "unknown key": ("[loop]", "colour = 1\n[loop]", [("plant.colour", "is not a key")]),
    "misspelt key": (
        "sampling_period_s",
        "sampling_periods",
        [("loop.sampling_periods", "did you mean 'sampling_period_s'?")],
    ),
    "friction pushes": (
        "[loop]",
        "[friction]\ncoulomb_N = [0, -0.1]\n[loop]",
        [("friction.coulomb_N.1", "at least 0")],
    ),
    "text for a number": ("0.001", '"fast"', [("loop.sampling_period_s", "must be a number")]),
    "nan": ("0.001", "nan", [("loop.sampling_period_s", "must be finite, got nan")]),
    "infinite": ("0.02]]", "inf]]", [("plant.mass_kg.1.1", "must be finite, got inf")]),
    "negative": ("0.001", "-0.001", [("loop.sampling_period_s", "got -0.001")]),
    "zero": ("0.001", "0.0", [("loop.sampling_period_s", "got 0")]),
    "not symmetric": ("[[0.3, 0.0]", "[[0.3, 0.1]", [("plant.mass_kg", "symmetric")]),
    "not positive definite": ("0.02]]", "-0.02]]", [("plant.mass_kg", "positive definite")]),
    "wrong size": ("[0.0, 1.0]\nsensor", "[1.0]\nsensor", [("plant.actuator", "2")]),
    "a frequency": ("0.001", "1000", [("loop.sampling_period_s", "is 1000 a frequency in Hz?")]),
    "negative delay": ("0.001", "0.001\ndelay_samples = -1", [("loop.delay_samples", "at least 0, got -1")]),
    "both delays": ("0.001", "0.001\ndelay_samples = 1\ndelay_s = 0.001", [("loop", "delay_s")]),
    "above Nyquist": (
        "0.001",
        f"0.001\n{FILTER}order = 2\ncutoff_Hz = 600.0",
        [("loop.velocity.filter.cutoff_Hz", "500")],
    ),
    "order zero": (
        "0.001",
        f"0.001\n{FILTER}order = 0\ncutoff_Hz = 20.0",
        [("loop.velocity.filter.order", "got 0")],
    ),
    "plant and mechanism": ("[loop]", f"{PLANT_AND_MECHANISM}[loop]", [("", "mechanism")]),
    "empty": (None, "", [("", "is empty")]),
    "not TOML": (None, "name = ", [("", "is not TOML")]),
    "binary": (None, b"\x7fELF\x02\x01\x00\xff\xfe", [("", "UTF-8")]),
    "zero bytes": (None, b"name = 1\x00", [("", "binary")]),
    "nested": (None, "a = " + "[" * 10_000 + "]" * 10_000, [("", "nested too deeply")]),
}


@pytest.mark.parametrize("command", [("chart",), ("show", "--json"), ("check", "--stiffness=1", "--damping=1")])
@pytest.mark.parametrize("fault", FILES)
def test_a_wrong_file_is_refused_with_file_key_and_reason(tmp_path, fault, command):
    old, new, expected = FILES[fault]
    assert old is None or PLANT.count(old) == 1
    file = tmp_path / "wrong.toml"
    text = new if old is None else PLANT.replace(old, new)
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    lines = refusal_lines(command[0], file, *command[1:])
    for key, words in expected:
        assert any(line.startswith(f"{file}: {key}") and words in line for line in lines), lines
    if fault != "plant and mechanism":
        assert len(lines) == len(expected)
    assert all(line.startswith(str(file)) for line in lines)


def test_all_faults_of_a_file_are_reported_together(tmp_path):
    file = tmp_path / "wrong.toml"
    file.write_text(PLANT.replace("0.001", '"fast"').replace("0.02]]", "inf]]").replace("[loop]", "x = 1\n[loop]"))
    assert len(refusal_lines("chart", file)) == 3


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("nowhere.toml", "is neither a file nor a bundled device"),
        (".", "is a directory"),
        ("five-bra", "five-bar"),
    ],
)
def test_a_device_that_is_none(tmp_path, monkeypatch, name, words):
    monkeypatch.chdir(tmp_path)
    (line,) = refusal_lines("chart", name, "--json")
    assert line.startswith(f"{name}: ")
    assert words in line


def test_a_loop_that_cannot_close():
    (line,) = refusal_lines("chart", MECHANISM, "--set", "links.upper-left.origin_m=[9.0, 0.0, 0.0]")
    assert line.startswith(f"{MECHANISM}: mechanism.")
    assert "close" in line


# two masses with nothing between them, one driven, the other read
SENSOR_APART = [
    f"--set=plant.{key}" for key in ("stiffness_N_per_m=unset", "damping_Ns_per_m=unset", "sensor=[1.0, 0.0]")
]


# a command line, and words of each of its lines
LINES = [
    (("chart", MECHANISM, "--direction", "0,0"), ["direction: has zero length"]),
    (
        ("chart", MECHANISM, "--direction", "0,0,1"),
        ["direction: the handle cannot move along the direction (0, 0, 1); choose"],
    ),
    (("chart", MECHANISM, "--direction", "1"), ["'--direction': must be 2 or 3 finite numbers"]),
    (("chart", MECHANISM, "--at", "a,b"), ["'--at': must be 2 or 3 finite numbers"]),
    (("chart", MECHANISM, "--at", "nan,0.2"), ["'--at': must be 2 or 3 finite numbers"]),
    (("chart", MECHANISM, "--at", "1,2,3,4"), ["'--at': must be 2 or 3 finite numbers"]),
    (("chart", MECHANISM, "--at"), ["'--at' requires an argument"]),
    (("chart", MECHANISM, "--assembly", "elbow-out"), ["did you mean 'elbows-out'?"]),
    (("chart", MECHANISM, "--model", "soft"), ["'--model': 'soft' is not one of"]),
    (("chart", "hapkit-course", "--model", "two-mass"), ["model two-mass: nothing flexible lies between"]),
    (("chart", TWO_MASS, "--at", "0,0.2", "--assembly", "x"), ["at: does not apply", "assembly: does not apply"]),
    (("chart", TWO_MASS, "--operator", "student"), ["student: is neither a file nor a bundled operator"]),
    (("chart", TWO_MASS, "--axis", "0,0,1"), ["axis: does not apply to a device given by its [plant]"]),
    (("chart", TWO_MASS, "--set", "loop.delay"), ["must be PATH=VALUE"]),
    (("chart", TWO_MASS, "--set", "loop.delay=1"), ["loop.delay: is not a key"]),
    (("chart", TWO_MASS, "--set", "a=1", "--set", "b=2"), ["--set: a: is not a key", "--set: b: is not a key"]),
    (("chart", TWO_MASS, "--set", "plant.mass_kg.5.5=1"), ["plant.mass_kg.5.5"]),
    (("chart", TWO_MASS, "--set", "loop.sampling_period_s=-1"), ["loop.sampling_period_s: must be"]),
    (("chart", TWO_MASS, "--set", "friction.coulomb_N=[0, -1]"), ["friction.coulomb_N.1: must be at least 0"]),
    (("chart", TWO_MASS, "--window", "0,1,2"), ["'--window': must be 4 finite numbers"]),
    (("chart", TWO_MASS, "--window", "1,0,0,1"), ["'--window': needs KMIN < KMAX"]),
    (
        ("show", MECHANISM, "--direction", "0,0,2", "--model", "rigid"),
        [f"{MECHANISM}: direction: the handle cannot"],
    ),
    (("show", ""), ["zwidth show: invalid value for 'DEVICE': is empty; give a name"]),
    (("show", MECHANISM, "--output", ""), ["'--output': is empty; give a name"]),
    (("report", MECHANISM, "--output", ""), ["'--output': is empty; give a name"]),
    (("check", MECHANISM, "--points", ""), ["'--points': is empty; give a name"]),
    (("chart",), ["missing argument 'DEVICE'"]),
    (("chart", TWO_MASS, "extra"), ["unexpected extra argument"]),
    (("chart", TWO_MASS, "--jason"), ["--jason"]),
    (("chrat", TWO_MASS), ["no such command 'chrat'"]),
    (("devices", "five-bar"), ["unexpected extra argument"]),
    (("chart", TWO_MASS, *SENSOR_APART), [f"{TWO_MASS}: the wall force moves nothing that the sensor reads"]),
    (("check", TWO_MASS), ["--points FILE.csv, or both"]),
    (("--jason",), ["--jason"]),
]


@pytest.mark.parametrize(("words", "says"), LINES, ids=lambda value: " ".join(value))
def test_a_wrong_command_line_is_refused_on_one_line_each(words, says):
    lines = refusal_lines(*words)
    assert len(lines) == len(says)
    for line, text in zip(lines, says, strict=True):
        assert text.lower() in line.lower()


NO_OUTPUT = [
    ("missing/chart.svg", "there is no folder"),
    ("folder.svg", "is a directory"),
    ("pipe.svg", "is not an ordinary file"),
    ("chart.txt", "must end in one of .png, .svg"),
    ("chart", "must end in one of .png, .svg"),
    ("", "'--output': is empty; give a name"),
    ("chart.nc", ".nc is for maps and sweeps"),
    ("chart.mat", ".mat is for maps and sweeps"),
    ("file.csv/chart.csv", "cannot be written|there is no folder"),
    ("a\0b.svg", "cannot be written"),
    ("x" * 300 + ".svg", "cannot be written"),
]


@pytest.mark.parametrize(("name", "words"), NO_OUTPUT, ids=[words[:20] for _, words in NO_OUTPUT])
def test_an_output_that_cannot_be_written_is_refused_before_anything_is_computed(
    tmp_path, monkeypatch, name, words
):
    (tmp_path / "folder.svg").mkdir()
    (tmp_path / "file.csv").write_text("kept")
    os.mkfifo(tmp_path / "pipe.svg")
    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr("zwidth.device.load.load", lambda *_: pytest.fail("the device was loaded"))
    (line,) = refusal_lines("chart", TWO_MASS, "--output", f"{tmp_path}/{name}" if name else name)
    assert any(choice in line for choice in words.split("|"))
    assert sorted(tmp_path.iterdir()) == before
    assert (tmp_path / "file.csv").read_text() == "kept"


@pytest.mark.parametrize(
    ("command", "name"),
    [(("report",), "x.pdf"), (("show",), "x.svg"), (("check", "--stiffness=1", "--damping=1"), "x.svg")],
)
def test_a_result_is_not_written_as_what_it_is_not(tmp_path, command, name):
    (line,) = refusal_lines(command[0], TWO_MASS, *command[1:], "--output", tmp_path / name)
    assert "must end in" in line
    assert not list(tmp_path.iterdir())


def test_an_error_of_our_own_is_one_line_and_code_70(monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("first line\nsecond")

    monkeypatch.setattr("zwidth.chart.chart.stability_chart", broken)
    ran = run_command("chart", TWO_MASS)
    assert (ran.code, ran.out, len(ran.lines)) == (70, "", 1)
    assert "ZeroDivisionError: first line second" in ran.err
    assert "please report it" in ran.err
    monkeypatch.setenv("ZWIDTH_DEBUG", "1")
    assert "Traceback" in run_command("chart", TWO_MASS).err


@pytest.mark.parametrize("command", ["chart", "report"])
def test_a_chart_that_cannot_be_closed_is_undecided(tmp_path, monkeypatch, command):
    from zwidth.errors import ChartError

    def open_edge(*_):
        raise ChartError("the edge could not be closed")

    monkeypatch.chdir(tmp_path)
    import_module("zwidth.show.report.report")  # whatever imports the chart has done so before it is replaced
    monkeypatch.setattr(import_module("zwidth.study.sensitivity.what_if"), "stability_chart", open_edge)
    monkeypatch.setattr("zwidth.chart.chart.stability_chart", open_edge)
    ran = run_command(command, TWO_MASS, "--json")
    assert ran.code == 1
    assert ran.document["decided"] is False
    assert ran.document.get("regions") is None
    assert not list(tmp_path.iterdir())
    assert ran.document["reason"] == "this is undecided: the edge could not be closed"


def test_a_chart_that_is_in_doubt_once_it_is_drawn_is_undecided(monkeypatch):
    """Its numbers are read before its edge is drawn and judged."""
    from zwidth.errors import ChartError

    def doubted(*_):
        raise ChartError("walls on the edge are off the circle")

    monkeypatch.setattr("zwidth.chart.loop_edge._judged_or_retraced", doubted)
    ran = run_command("chart", TWO_MASS, "--json")
    assert ran.code == 1
    assert ran.document["decided"] is False
    assert ran.document["reason"] == "this is undecided: walls on the edge are off the circle"


@pytest.mark.parametrize("name", ["chart.svg", "chart.csv"])
def test_an_interruption_is_one_line_and_leaves_nothing_half_written(tmp_path, monkeypatch, name):
    file = tmp_path / name
    file.write_text("from before")

    def stopped(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("zwidth.show.output.os.replace", stopped)
    ran = run_command("chart", TWO_MASS, "--output", file)
    assert (ran.code, ran.out, len(ran.lines)) == (130, "", 1)
    assert file.read_text() == "from before"
    assert list(tmp_path.iterdir()) == [file]


# --- the command as a process: what it imports, signals, closed and full streams ---------------------


@pytest.mark.parametrize("words", ["schema", "--help", "--version", f"chart {TWO_MASS} --output chart.csv"])
def test_a_closed_standard_output_is_said_before_anything_is_computed(tmp_path, words):
    line = f'exec "{ZWIDTH}" {words} >&-'
    done = subprocess.run(["sh", "-c", line], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "zwidth: standard output is closed; send it to a file, or to /dev/null\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
@pytest.mark.parametrize(
    "words", [("devices",), ("schema",), ("chart", TWO_MASS, "--json"), ("--help",), ("--version",)]
)
def test_a_full_disk_is_said_on_one_line(words):
    with open("/dev/full", "w") as full:
        done = subprocess.run([ZWIDTH, *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "standard output cannot be written" in done.stderr


def test_a_warning_is_one_line():
    program = """
import warnings
from zwidth.show.cli import main

def warn(arguments):
    warnings.warn("odd", UserWarning)
    warnings.warn("arithmetic", RuntimeWarning)
    return 0

main.run = warn
main.main()
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "zwidth: warning: odd\n")


# --- strict JSON and CSV, and files that appear whole or not at all ----------------------------------


def test_a_full_disk_is_an_error_with_the_files_name(tmp_path):
    path = tmp_path / "a.csv"
    with pytest.raises(OutputError, match=r"a\.csv: cannot be written: no space left"), replacing(path):
        raise OSError(28, "No space left on device")


# --- who may use the workbench, and what it hands out ------------------------------------------------


@pytest.mark.skipif(sys.platform == "win32", reason="ctrl-C is no signal there that a test can send")
def test_ctrl_c_ends_it_as_it_said() -> None:
    command = [sys.executable, "-m", "zwidth", "app", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert "ctrl-C ends it" in process.stderr.readline()
        process.send_signal(signal.SIGINT)
        try:
            assert process.communicate(timeout=30)[1] == "zwidth: the workbench has ended\n"
        finally:
            process.kill()  # one that goes on would be waited for
        assert process.returncode == 0
