"""The command as a process: what it imports, signals, closed and full streams."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.command_runner import TWO_MASS, parse_strict_json
from tests.interruption import HANG_TIMEOUT_S, interruptible, stopped_by_ctrl_c
from zwidth.chart.verdict import BATCH_SIZE

ZWIDTH = Path(sys.executable).with_name("zwidth")
HEAVY = {"numpy", "numba", "scipy", "matplotlib", "pydantic", "jinja2", "shapely"}


def run_process(*words: object, **options) -> subprocess.CompletedProcess[str]:
    command = [ZWIDTH, *map(str, words)]
    return subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, **options
    )


@pytest.mark.parametrize("words", [["--help"], ["chart", "--help"], ["devices", "--json"], ["chart"]])
def test_nothing_heavy_is_imported_before_it_is_needed(words):
    program = (
        f"import sys; from zwidth.show.cli.main import run; run({words}); print(*sys.modules, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "click" in done.stderr.split()
    assert not HEAVY & set(done.stderr.split())


def test_the_command_is_a_module_of_python_as_well():
    as_module = subprocess.run(
        [sys.executable, "-m", "zwidth", "chart"], capture_output=True, text=True, check=False
    )
    as_command = run_process("chart")
    assert as_command.returncode == 2
    assert (as_module.returncode, as_module.stdout, as_module.stderr) == (2, as_command.stdout, as_command.stderr)


@pytest.mark.parametrize(("given", "used"), [(None, "1"), ("3", "3")])
def test_linear_algebra_has_one_thread_before_numpy_is_loaded(given, used):
    """The variable counts only if it is set when numpy comes; what the user has set stays."""
    program = """
import os, sys
class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy":
            print("threads", os.environ.get("OPENBLAS_NUM_THREADS"), file=sys.stderr)
sys.meta_path.insert(0, Watch())
sys.argv = ["zwidth", "check", "published-two-mass", "--stiffness", "1000", "--damping", "10"]
from zwidth.show.cli.main import main
main()
"""
    environment = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    environment |= {"OPENBLAS_NUM_THREADS": given} if given else {}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, f"threads {used}\n")


def test_a_chart_as_a_process():
    done = run_process("chart", TWO_MASS, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert parse_strict_json(done.stdout)["stiffness_max_N_per_m"] > 7000.0


def test_ctrl_c_while_reading(tmp_path):
    """The walls come through a pipe that stays open: the command waits, and is interrupted there."""
    pipe = tmp_path / "walls.csv"
    os.mkfifo(pipe)
    command = [ZWIDTH, "check", TWO_MASS, "--points", pipe]
    running = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=interruptible
    )
    with open(pipe, "w"):  # opens once the command reads
        running.send_signal(signal.SIGINT)
        out, err = running.communicate(timeout=HANG_TIMEOUT_S)
    assert running.returncode == 130
    assert (out, len(err.splitlines())) == ("", 1)
    assert "interrupted" in err


def test_ctrl_c_while_computing(tmp_path):
    """Between two batches of walls."""
    walls, verdicts = tmp_path / "walls.csv", tmp_path / "verdicts.csv"
    verdicts.write_text("from before")
    walls.write_text("stiffness_N_per_m,damping_Ns_per_m\n" + "4000,10\n" * (BATCH_SIZE + 1))
    words = ["check", TWO_MASS, "--points", str(walls), "--output", str(verdicts)]
    code, out, err = stopped_by_ctrl_c(words, "zwidth.chart.verdict:verdicts")
    assert (code, out, len(err.splitlines())) == (130, "", 1)
    assert "interrupted" in err
    assert verdicts.read_text() == "from before"
    assert sorted(tmp_path.iterdir()) == [verdicts, walls]


def test_a_reader_that_has_seen_enough_is_no_error():
    read, write = os.pipe()
    os.close(read)
    try:
        command = [ZWIDTH, "chart", TWO_MASS, "--json"]
        done = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_closed_standard_error_leaves_standard_output_to_the_answer(tmp_path):
    lines = [
        f'exec "{ZWIDTH}" chart {TWO_MASS} --output chart.csv --json 2>&-',
        f'exec "{ZWIDTH}" chart none 2>&-',
    ]
    good, bad = (
        subprocess.run(["sh", "-c", line], cwd=tmp_path, capture_output=True, text=True, check=False)
        for line in lines
    )
    assert (good.returncode, good.stderr) == (0, "")
    assert parse_strict_json(good.stdout)["stiffness_max_N_per_m"] > 7000.0
    assert (tmp_path / "chart.csv").stat().st_size > 1000
    assert (bad.returncode, bad.stdout, bad.stderr) == (2, "", "")


def test_a_terminal_that_knows_only_ascii(tmp_path):
    done = run_process("chart", TWO_MASS, env=os.environ | {"PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0
    assert "largest stiffness" in done.stdout
