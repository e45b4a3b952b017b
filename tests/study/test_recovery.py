"""Cells that cannot be computed are data; all others have their values, bit for bit."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest

from tests.interruption import HANG_TIMEOUT_S
from tests.study.executor_cases import FaultyJob, ProcessNumbersJob, RootsJob, same_but_for, same_cells
from zwidth.errors import MeasureError, OutOfTime, WorkerLost
from zwidth.measures import FAILED, OUT_OF_TIME
from zwidth.study import RecoveredWarning, Store, open_executor, pack_job, run_job
from zwidth.study.jobs import workers
from zwidth.study.jobs.workers import WorkerProcess, compute_range

NO_PATIENCE = -1.0
TRUE_CELLS = RootsJob(40).compute(0, 40)


@pytest.fixture(params=["here", "processes"])
def place(request):
    """Where cells are computed: by this process, or by two others."""
    return {"workers": 1} if request.param == "here" else {"workers": 2, "patience": NO_PATIENCE}


def test_a_cell_that_raises_fails_alone(place):
    found = run_job(FaultyJob(40, raising=(3, 12, 13)), batch=5, **place)
    assert same_but_for(found, TRUE_CELLS, [3, 12, 13])
    assert (found.status[[3, 12, 13]] == FAILED).all()
    assert np.isnan(found.values[[3, 12, 13]]).all()
    assert [note.reason.rpartition(": ")[2] for note in found.notes[1]] == [f"number {n}" for n in (3, 12, 13)]


def test_cells_that_fail_do_not_depend_on_the_batches(place):
    job = FaultyJob(40, raising=(0, 7, 39))
    assert same_cells(run_job(job, batch=7, **place), run_job(job, batch=40, workers=1))


@dataclass
class WrongJob(RootsJob):
    """A job with a fault of its own, which every cell meets, or all but the first few."""

    right: int = 0

    def compute(self, first, last):
        if last > self.right:
            raise TypeError("a fault of the program")
        return super().compute(first, last)


def test_a_fault_that_every_cell_meets_is_raised(place, tmp_path):
    with pytest.raises(TypeError, match="a fault"):
        run_job(WrongJob(200), batch=20, **place)
    job = WrongJob(200)
    with pytest.raises(TypeError):
        run_job(job, Store(tmp_path / "cells", job), batch=20, **place)
    assert list(Store(tmp_path / "cells", job).stored_batches()) == [], "it is no result"
    assert (run_job(WrongJob(200, right=1), batch=20, workers=1).status == FAILED).sum() == 2 * 199


def test_what_a_job_says_of_all_cells_ends_the_run_at_once():
    asked = []

    def attempt(first, last):
        asked.append(last)
        raise MeasureError("cannot be asked")

    with pytest.raises(MeasureError):
        compute_range(attempt, 1, 0, 100)
    assert asked == [100]


def test_a_cell_that_kills_every_process_fails_alone(tmp_path):
    job, path = FaultyJob(40, killing=(12,), starter=os.getpid()), tmp_path / "cells"
    with pytest.warns(RecoveredWarning) as told:
        found = run_job(job, Store(path, job), workers=2, batch=5, patience=NO_PATIENCE)
    assert str(told[-1].message).count("; number 12 ") == 1
    assert same_but_for(found, TRUE_CELLS, [12])
    assert (found.status[12] == FAILED).all()
    assert found.notes[1][0].reason.endswith(", 3 times")
    assert same_cells(run_job(job, Store(path, job), workers=1), found), "kept"


def test_where_every_cell_kills_its_process_the_run_ends(monkeypatch):
    monkeypatch.setattr("zwidth.study.jobs.executor.ENOUGH", 1)
    job = FaultyJob(2, killing=(0, 1))
    with pytest.warns(RecoveredWarning), pytest.raises(WorkerLost, match="SIGKILL"), open_executor(1) as executor:
        run_job(job, executor=executor)


def test_a_cell_that_never_ends_is_out_of_time_and_alone(tmp_path, monkeypatch):
    monkeypatch.setattr("zwidth.study.jobs.workers.LOADING", 1.0)
    job, path = FaultyJob(16, endless=(9,), starter=os.getpid()), tmp_path / "cells"
    found = run_job(job, Store(path, job), workers=2, batch=8, time_limit=0.5)
    truth = RootsJob(16).compute(0, 16)
    assert same_but_for(found, truth, [9])
    assert (found.status[9] == OUT_OF_TIME).all()
    assert found.notes[1][0].reason.endswith(" longer than 0.5 s")
    # it is not tried again under the same limit, but under a longer one, or none
    assert same_cells(run_job(job, Store(path, job), workers=2, time_limit=0.5), found)
    mended = RootsJob(16)
    assert same_cells(run_job(mended, Store(path, mended), workers=1), truth)
    assert mended.computed_ranges == [(8, 16)]


def test_compiling_does_not_count_as_time():
    worker = WorkerProcess(time_limit=0.2)
    try:
        packed = pack_job(CompilingJob(3))
        assert packed is not None
        worker.compute(packed, 0, 1)
        assert worker.compute(packed, 1, 2).values.shape == (1, 2)
    finally:
        worker.end()


@dataclass
class CompilingJob(RootsJob):
    """A job that says it compiles for a second."""

    def compute(self, first, last):
        from time import sleep

        from zwidth.compile_events import compiling

        with compiling("kernel"):
            sleep(0.6)
        return super().compute(first, last)


@dataclass
class FollowingJob(RootsJob):
    """One of several jobs that run the same code."""

    code: str = "roots"


def test_time_to_load_code_is_given_to_the_first_job_alone():
    quick, slow = FollowingJob(3), FollowingJob(3, seconds=1.5)
    worker = WorkerProcess(time_limit=0.3)
    try:
        worker.compute(pack_job(quick), 0, 1)
        for _ in range(2):  # in the same process, and in the one that takes its place
            with pytest.raises(OutOfTime, match=r"longer than 0\.3 s"):
                worker.compute(pack_job(slow), 0, 1)
        assert worker.compute(pack_job(quick), 1, 2).values.shape == (1, 2)
    finally:
        worker.end()


def test_the_first_cell_is_given_up_too_once_its_code_is_loaded():
    worker = WorkerProcess(time_limit=0.3)
    try:
        with pytest.raises(OutOfTime):
            worker.compute(pack_job(RootsJob(3, seconds=1.5)), 0, 1)
    finally:
        worker.end()


def test_an_executor_s_limit_counts_where_a_store_is_gone_on_with(tmp_path, monkeypatch):
    monkeypatch.setattr("zwidth.study.jobs.workers.LOADING", 1.0)
    job = FaultyJob(8, endless=(5,), starter=os.getpid())
    told = []
    for _ in range(2):
        told.clear()
        with open_executor(1, time_limit=0.2) as executor:
            found = run_job(
                job, Store(tmp_path / "cells", job), lambda *now: told.append(now[1]), executor=executor
            )
        assert (found.status[5] == OUT_OF_TIME).all()
    assert told == [8], "not tried again under the same limit"
    mended = RootsJob(8)
    run_job(mended, Store(tmp_path / "cells", mended), again=False)
    assert mended.computed_ranges == []


def test_one_executor_serves_many_jobs_in_the_same_processes():
    with open_executor(1) as executor:
        own = [run_job(ProcessNumbersJob(8 + n), executor=executor).values[:, 0] for n in range(12)]
        assert len({process for each in own for process in each}) == 1
        assert own[0][0] != os.getpid()
        batches = executor.compute(pack_job(RootsJob(40)), [(0, 5), (5, 10)])
        next(batches)
        batches.close()  # stopped early, which ends them
        assert run_job(ProcessNumbersJob(3), executor=executor).values[0, 0] != own[0][0]


ORPHANS = """
import os, sys
sys.path[:0] = {path!r}
from tests.study.executor_cases import FaultyJob
from zwidth.study.jobs.executor import run_job
run_job(FaultyJob(4, endless=(1,), starter=os.getpid()), workers=1, batch=2, time_limit=1000.0)
"""


def test_processes_end_with_the_one_that_started_them_even_in_an_endless_cell():
    """SIGKILL, after which nobody can tell them."""
    running = subprocess.Popen([sys.executable, "-c", ORPHANS.format(path=sys.path)], start_new_session=True)
    children: list[str] = []
    until = monotonic() + HANG_TIMEOUT_S
    while not (children and busy(children[0])) and monotonic() < until:
        sleep(0.1)
        children = subprocess.run(["pgrep", "-P", str(running.pid)], capture_output=True, text=True).stdout.split()
    running.kill()
    running.wait()
    while alive(children[0]) and monotonic() < until:
        sleep(0.1)
    assert not alive(children[0])


def busy(process: str) -> bool:
    """Whether it has computed for two seconds: it is in the endless cell, since it started in less."""
    ticks = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[11]
    return int(ticks) / os.sysconf("SC_CLK_TCK") > 2.0


def alive(process: str) -> bool:
    return os.path.exists(f"/proc/{process}")


def test_pieces_cover_a_range():
    for first, last in ((0, 1), (3, 5), (0, 8), (5, 100)):
        pieces = workers._cut_in_pieces(first, last)
        assert [n for piece in pieces for n in range(*piece)] == list(range(first, last))
        assert len(pieces) <= workers.PIECES
