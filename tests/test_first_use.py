"""Compiling at first use: what is kept on disk, when it is compiled anew, and that whoever waits is told."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib import import_module
from pathlib import Path
from time import sleep

import numpy as np
import pytest

from tests.cli.command_runner import document_of
from zwidth import compile_events, machine_code
from zwidth import compiled as compiled_module
from zwidth.compile_events import compiling, listening
from zwidth.compiled import can_be_taken_apart
from zwidth.resources import in_chunks
from zwidth.show.cli.first_use import KernelTimes
from zwidth.show.cli.progress import time_text

KERNELS = '''
from typing import NamedTuple
import numpy as np
from zwidth.compiled import compiled, compiled_inline, compiled_lean

FACTOR = 3.0

class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray

@compiled_inline
def scaled(x: float) -> float:
    """Text."""
    return FACTOR * x

@compiled_lean
def twice(x: float) -> float:
    return 2.0 * scaled(x)

@compiled
def total(pair: Pair) -> float:
    sum = 0.0
    for x in pair.first:
        sum += twice(x)
    return sum

@compiled
def ratio_of_parts(x: float) -> float:
    number = complex(x, 0.0)
    return number.real / number.imag
'''
CALL = """
import numpy as np, kernels
from zwidth.compile_events import listening
names = []
with listening(lambda name, ended: ended and names.append(name)):
    print(kernels.total(kernels.Pair(np.ones(4), np.zeros(4))), names)
"""
STEPS = """
import sys, numpy as np, kernels
names, pair = [], kernels.Pair(np.ones(4), np.zeros(4))
sys.settrace(lambda frame, event, argument: names.append(frame.f_code.co_name))
total = kernels.total(pair)
sys.settrace(None)
print(total, *dict.fromkeys(names), kernels.ratio_of_parts(2.0))
"""
SHORT_RUN = ["simulate", "hapkit-course", "--stiffness", "300", "--damping", "1", "--duration", "0.05", "--json"]
needs_parts = pytest.mark.skipif(
    not can_be_taken_apart(), reason="another release of numba: its own cache is used"
)


def run_python(folder: Path, *words: str, **variables: str) -> str:
    """Standard output of a new interpreter in a folder that keeps its compiled kernels, too."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder), "PYTHONDONTWRITEBYTECODE": "1", **variables}
    done = subprocess.run([sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def call(tmp_path):
    """Runs CALL in a process of its own, on the kernels with texts exchanged; returns what it prints."""

    def run(*exchanged: tuple[str, str]) -> str:
        text = KERNELS
        for old, new in exchanged:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "kernels.py").write_text(text)
        return run_python(tmp_path, "-c", CALL)

    return run


def test_without_compiling_kernels_are_python_that_can_be_stepped_through(tmp_path):
    (tmp_path / "kernels.py").write_text(KERNELS)
    assert run_python(tmp_path, "-c", STEPS, NUMBA_DISABLE_JIT="1") == "24.0 total twice scaled inf"


def test_without_compiling_a_command_answers_the_same(tmp_path):
    """To rounding; of a simulation, which also calls functions by their addresses."""
    answer = json.loads(run_python(tmp_path, "-m", "zwidth", *SHORT_RUN, NUMBA_DISABLE_JIT="1"))
    compiled_answer = document_of(*SHORT_RUN[:-1])
    assert len(answer["position_m"]) > 50
    assert answer["position_m"] == pytest.approx(compiled_answer["position_m"], rel=1e-9, abs=1e-15)


@needs_parts
def test_threads_that_call_a_new_kernel_at_once_share_its_entry(monkeypatch):
    """A second entry would load the machine code again, over that which the first thread runs."""
    entries: list[object] = []
    make = compiled_module._Entry.__init__

    def make_slowly(self, *arguments):
        entries.append(self)
        sleep(0.1)  # so that the other thread arrives
        make(self, *arguments)

    monkeypatch.setattr(compiled_module._Entry, "__init__", make_slowly)
    half = compiled_module.compiled(lambda x: 0.5 * x)
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(half, [1.0, 3.0])) == [0.5, 1.5]
    assert len(entries) == 1


@needs_parts
def test_a_kernel_is_compiled_once_and_only_what_python_calls(call, tmp_path):
    assert call() == "24.0 ['kernels.total']"
    assert call() == "24.0 []"
    (kept,) = (tmp_path / "zwidth" / "kernels").iterdir()
    assert kept.name.startswith("kernels.total-")


@needs_parts
def test_an_edit_that_matters_is_compiled_anew(call):
    """A constant, a callee, the order of a tuple's fields."""
    call()
    for exchange, value in (
        (("FACTOR = 3.0", "FACTOR = 4.0"), 32.0),
        (("return 2.0 * scaled", "return 1.0 * scaled"), 12.0),
        (("first: np.ndarray\n    second: np.ndarray", "second: np.ndarray\n    first: np.ndarray"), 0.0),
    ):
        assert call(exchange) == f"{value} ['kernels.total']", exchange
    assert call() == "24.0 []"


@needs_parts
def test_an_edit_that_does_not_matter_leaves_machine_code_as_it_is(call):
    call()
    assert call(("Text.", "Other text."), ("@compiled\n", "# a comment\n\n@compiled\n")) == "24.0 []"


@needs_parts
def test_a_damaged_file_is_compiled_anew(call, tmp_path):
    call()
    (kept,) = (tmp_path / "zwidth" / "kernels").iterdir()
    kept.write_bytes(kept.read_bytes()[:100])
    assert call() == "24.0 ['kernels.total']"
    assert call() == "24.0 []"


@pytest.mark.parametrize("count", [0, 1, 2, 3, 7, 100, 1001])
def test_chunks_cover_every_item_once(count):
    visits = np.zeros(count, dtype=int)

    def kernel(first: int, last: int) -> None:
        visits[first:last] += 1

    in_chunks(kernel, count)
    assert np.all(visits == 1)


def test_an_error_in_a_chunk_is_raised():
    def kernel(first: int, last: int) -> None:
        if first <= 5 < last:
            raise ValueError("the sixth")

    with pytest.raises(ValueError, match="the sixth"):
        in_chunks(kernel, 50)


def test_a_script_is_told_once_and_a_listener_instead_of_the_log(caplog):
    compile_events._log_first_use.cache_clear()  # another test may have compiled
    names: list[tuple[str, bool]] = []
    with listening(partial(_note, names)), compiling("zwidth.chart.curve.walls"):
        pass
    assert names == [("zwidth.chart.curve.walls", False), ("zwidth.chart.curve.walls", True)]
    assert not caplog.records
    for _ in range(2):
        with compiling("zwidth.chart.curve.walls"):
            pass
    assert [record.message for record in caplog.records if "first use" in record.message] != []
    assert len(caplog.records) == 1


def _note(names: list[tuple[str, bool]], name: str, ended: bool) -> None:
    names.append((name, ended))


@pytest.mark.parametrize(("seconds", "text"), [(0.2, "5 s"), (12.4, "10 s"), (58.0, "60 s"), (100.0, "2 min")])
def test_a_span_of_time_is_rounded(seconds, text):
    assert time_text(seconds) == text


def test_the_times_are_those_of_kernels_that_exist():
    times = KernelTimes.read()
    assert times.seconds
    assert times.of_command
    for name in times.seconds:
        module, _, function = name.rpartition(".")
        assert hasattr(import_module(module), function), name
    assert {name for names in times.of_command.values() for name in names} <= set(times.seconds)


def test_that_all_kernels_are_kept_is_noted_until_a_file_or_the_sources_change(monkeypatch, tmp_path):
    sources, kernels = tmp_path / "sources", tmp_path / "kernels"
    for folder in (sources, kernels):
        folder.mkdir()
    (sources / "one.py").write_text("x = 1\n")
    monkeypatch.setattr(machine_code, "written_folder", lambda: kernels)
    monkeypatch.setattr(machine_code, "PACKAGE", sources)
    file = kernels / f"one.total-0-0{machine_code.ENDING}"
    file.write_bytes(b"code")
    assert not machine_code.all_kernels_kept()
    machine_code.note_all_kernels()
    assert machine_code.all_kernels_kept()
    (kernels / f"another.total-1-1{machine_code.ENDING}").write_bytes(b"of another version")
    assert machine_code.all_kernels_kept()
    for path, other in ((file, b"cod"), (sources / "one.py", b"x = 2\n")):
        whole = path.read_bytes()
        path.write_bytes(other)
        assert not machine_code.all_kernels_kept()
        path.write_bytes(whole)
        assert machine_code.all_kernels_kept()
    file.unlink()
    assert not machine_code.all_kernels_kept()


def test_compile_finds_nothing_to_do_after_the_set_up():
    """The set-up has compiled all kernels: what `zwidth compile` wants is there. As the README and the page on
    commands have it."""
    command = [str(Path(sys.executable).with_name("zwidth")), "compile", "--json"]
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    if json.loads(ran.stdout)["kernels"]:  # tests that were set up in another way
        ran = subprocess.run(command, capture_output=True, text=True, check=True)
    said = json.loads(ran.stdout)
    assert said["kernels"] == 0
    assert ran.stderr == ""
    assert Path(said["folder"]).is_dir()
