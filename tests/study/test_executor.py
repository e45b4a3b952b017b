"""Cells are what the job says, however they are cut, and whoever computes them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from tests.interruption import HANG_TIMEOUT_S, interruptible
from tests.study.executor_cases import (
    LEFT_OUT,
    FailingJob,
    NotedJob,
    PrintingJob,
    ProcessNumbersJob,
    RootsJob,
    same_cells,
)
from zwidth.errors import MeasureError
from zwidth.measures import FAILED, MISSING, NO_VALUE, Note
from zwidth.measures.definition import MORE, merge_notes
from zwidth.study import Store, pack_job, run_job
from zwidth.study.jobs import executor
from zwidth.study.jobs.executor import batch_size
from zwidth.study.jobs.workers import cores

NO_PATIENCE = -1.0  # patience that is over at once


def test_the_cells_are_those_of_the_job():
    found = run_job(RootsJob(100), workers=1)
    n = np.arange(100.0)
    assert np.array_equal(found.values[:, 0], np.where(n % 7 == 0, np.nan, np.sqrt(n)), equal_nan=True)
    assert not (found.status == MISSING).any()
    assert found.notes == ((Note(NO_VALUE, LEFT_OUT, 15, (0,)),), ())


@pytest.mark.parametrize("batch", [1, 3, 99, 100, 1000, None])
def test_batches_of_any_size_give_the_same(batch):
    assert same_cells(run_job(RootsJob(100), workers=1, batch=batch), RootsJob(100).compute(0, 100))


@pytest.mark.parametrize(("seconds", "expected"), [(1e-5, 62_500 // 4), (1e-3, 244), (0.2, 1), (30.0, 1)])
def test_a_batch_takes_a_quarter_of_a_second_whatever_the_first_cells_load(seconds, expected, monkeypatch):
    """A kernel takes time once to be loaded, here when so many cells are first computed; each call takes some."""
    now, loads = [0.0], {2: 0.9, 16: 0.4}

    class Job(RootsJob):
        def compute(self, first, last):
            now[0] += 0.005 + seconds * (last - first) + loads.pop(last - first, 0.0)
            return super().compute(first, last)

    monkeypatch.setattr(executor, "perf_counter", lambda: now[0])
    job = Job(250_000)
    found = batch_size(job.compute, job.count, 1)
    assert found == pytest.approx(expected, rel=0.2)
    assert sum(last - first for first, last in job.computed_ranges) <= max(4, 4 * found)


def test_processes_give_the_same_and_say_how_far_they_are(capfd):
    told = []
    found = run_job(
        RootsJob(60), None, lambda *now: told.append(now), 2, batch=7, patience=NO_PATIENCE, stage="roots"
    )
    assert same_cells(found, RootsJob(60).compute(0, 60))
    assert told[0] == ("roots", 0, 60)
    assert told[-1] == ("roots", 60, 60)
    assert [done for _, done, _ in told] == sorted(done for _, done, _ in told)
    assert capfd.readouterr() == ("", "")


def test_processes_take_over_once_the_rest_takes_long():
    job = ProcessNumbersJob(40, seconds=0.01)
    found = run_job(job, workers=2, batch=5, patience=0.1)
    mine = found.values[:, 0] == os.getpid()
    assert mine[:10].all()
    assert not mine[10:].any()
    assert 1 <= len(set(found.values[10:, 0])) <= 2
    assert (found.values[10:, 1] == 1.0).all(), "one thread in each process"
    quick = run_job(ProcessNumbersJob(40), workers=2, batch=5)
    assert (quick.values[:, 0] == os.getpid()).all()


def test_what_a_job_raises_in_a_process_is_raised(capfd):
    with pytest.raises(MeasureError, match="be asked"):
        run_job(FailingJob(40), workers=2, batch=5, patience=NO_PATIENCE)
    out, err = capfd.readouterr()
    assert out == 2 * "talkative\n", "what this one prints, before they start"
    assert "Traceback" not in err
    found = run_job(PrintingJob(40), workers=2, batch=5, patience=NO_PATIENCE)
    assert same_cells(found, RootsJob(40).compute(0, 40)), "what they print does not get between their replies"
    assert capfd.readouterr().err.count("talkative") == 6


def test_what_another_process_would_not_understand_stays_here():
    class Local(ProcessNumbersJob):
        pass

    assert pack_job(Local(40)) is None
    found = run_job(Local(40), workers=2, batch=5, patience=NO_PATIENCE)
    assert (found.values[:, 0] == os.getpid()).all()
    Local.__module__, Local.__qualname__ = "__main__", "Local"
    assert pack_job(Local(40)) is None


def test_a_script_needs_no_guard(tmp_path):
    """Nothing of the main script runs again in the processes."""
    script = tmp_path / "study.py"
    script.write_text(
        "import sys\n"
        f"sys.path[:0] = {sys.path!r}\n"
        "from tests.study.executor_cases import RootsJob\n"
        "from zwidth.study.jobs.executor import run_job\n"
        "print('once', run_job(RootsJob(20), workers=2, batch=5, patience=-1.0).values.shape)\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("once (20, 2)\n", "")


ENDLESS = """
import sys
from pathlib import Path
sys.path[:0] = {path!r}
from tests.study.executor_cases import RootsJob
from zwidth.study.jobs.executor import run_job
from zwidth.study.jobs.store import Store
job = RootsJob({count}, seconds=0.2)
def progress(stage, done, of):
    print(done, flush=True)
run_job(job, Store(Path("cells"), job), progress, 2, batch=2, patience=0.1)
"""


def test_ctrl_c_stops_and_leaves_no_process(tmp_path):
    """Amid more cells than anybody waits for; what was computed until then is kept."""
    count = 2000
    command = [sys.executable, "-c", ENDLESS.format(path=sys.path, count=count)]
    running = subprocess.Popen(
        command,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        preexec_fn=interruptible,
    )
    assert running.stdout is not None
    while int(running.stdout.readline()) < 12:  # the first four are computed before the processes start
        pass
    children = subprocess.run(["pgrep", "-P", str(running.pid)], capture_output=True, text=True).stdout.split()
    assert len(children) == 2
    assert running.pid not in {os.getpgid(int(child)) for child in children}, "ctrl-C is not for them"
    os.killpg(running.pid, signal.SIGINT)  # as the terminal does
    _, err = running.communicate(timeout=HANG_TIMEOUT_S)
    assert err.decode().count("KeyboardInterrupt") == 1, "the processes say nothing"
    for child in children:
        with pytest.raises(ProcessLookupError):
            os.kill(int(child), 0)
    job = RootsJob(count)
    kept = [first for first, _ in Store(tmp_path / "cells", job).stored_batches()]
    assert len(kept) >= 6
    assert all(first % 2 == 0 for first in kept)


def test_notes_are_the_same_in_any_order_and_not_endless():
    notes = [Note(FAILED, f"cell {n}", 1, (n,)) for n in range(150)]
    told = merge_notes(notes)
    assert told == merge_notes(notes[::-1])
    assert len(told) == 101
    assert told[-1] == Note(FAILED, MORE, 50, (100,))
    assert same_cells(run_job(NotedJob(150), workers=1, batch=4), run_job(NotedJob(150), workers=1, batch=150))


def test_an_empty_job_has_no_cells():
    assert run_job(RootsJob(0)).values.shape == (0, 2)


def test_there_is_a_core():
    assert 1 <= cores() <= (os.cpu_count() or 1)
