"""What is said of a run that was disturbed, and of a search that finds no design."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.cli import test_cli_scale
from tests.cli.command_runner import refusal_lines, run_command
from tests.interruption import HANG_TIMEOUT_S
from tests.study.executor_cases import FaultyJob, RootsJob, same_cells
from tests.study.test_optimise import LENGTH, RATIO, TASK, problem_study
from tests.study.test_optimise_tolerances import MASS, PERIOD, STIFFEST, mass_study
from tests.study.test_recovery import NO_PATIENCE, TRUE_CELLS
from zwidth.errors import StoreError
from zwidth.measures import OUT_OF_REACH
from zwidth.show.report.optimisation import optimisation_sentences
from zwidth.study import RecoveredWarning, Store, member_changes, optimise, run_job

# --- cells that cannot be computed are data; all others have their values, bit for bit ---------------


def test_a_killed_process_is_replaced_and_told(tmp_path):
    """Killed once, from outside: nothing is lost."""
    job = FaultyJob(40, killing=(12,), starter=os.getpid(), once=str(tmp_path / "killed"))
    with pytest.warns(RecoveredWarning) as told:
        found = run_job(job, workers=2, batch=5, patience=NO_PATIENCE)
    assert same_cells(found, TRUE_CELLS)
    (said,) = told
    assert str(said.message) == (
        "a process that computed was killed (SIGKILL), perhaps for lack of memory; "
        "numbers 10 to 14 are computed again"
    )


# --- two runs on one store, a full disk, a run that is killed: one clear line, and the store ---------


HOLDING = """
import sys, time
from pathlib import Path
sys.path[:0] = {path!r}
from tests.study.executor_cases import RootsJob
from zwidth.study.jobs.executor import run_job
from zwidth.study.jobs.store import Store
job = RootsJob(100, seconds=0.2)
run_job(job, Store(Path({store!r}), job), lambda stage, done, of: print(done, flush=True), 1, batch=2)
"""


def start_run(store: Path, past: int) -> subprocess.Popen[str]:
    """Another process that computes into a store, when it has done more than so many cells."""
    program = HOLDING.format(path=sys.path, store=str(store))
    running = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert running.stdout is not None
    while int(running.stdout.readline()) <= past:
        pass
    return running


def test_a_second_run_is_refused_while_the_first_lives_and_a_killed_one_blocks_nobody(tmp_path):
    path, job = tmp_path / "cells", RootsJob(100)
    running = start_run(path, 4)
    try:
        store = Store(path, job)
        with pytest.raises(StoreError) as caught:
            run_job(job, store, workers=1)
        here = f"process {running.pid} on {socket.gethostname()}"
        assert str(caught.value) == (
            f"cells: {here} is computing into it; wait until that has ended, or name another folder"
        )
    finally:
        running.send_signal(signal.SIGKILL)
        running.communicate(timeout=HANG_TIMEOUT_S)
    assert json.loads((path / "lock").read_text())["process"] == running.pid, "which has left its name behind"
    found = run_job(job, Store(path, job), workers=1)
    assert same_cells(found, RootsJob(100).compute(0, 100))
    assert (0, 2) not in job.computed_ranges


# --- `zwidth sweep` and `map` that lose processes, time, disk and clusters: what is said, and --------


folder = test_cli_scale.folder


def test_a_full_disk_is_one_line_and_what_is_done_is_kept(folder, monkeypatch):
    from zwidth.study import Store

    write, full = Store.write_batch, OSError(28, "No space left on device")

    def until_full(store, first, cells):
        if first > 20:
            raise full
        write(store, first, cells)

    monkeypatch.setattr(Store, "write_batch", until_full)
    (line,) = refusal_lines("sweep", "study.toml", "--resume", "cells", "--workers", "1")
    assert line == (
        "cells: cannot be written: no space left on device; name another folder; "
        "cells keeps the finished work; the same command continues from it"
    )
    monkeypatch.undo()
    os.chdir(folder)
    assert run_command("sweep", "study.toml", "--resume", "cells").code == 0


# --- optimisations of plants and mechanisms, against closed forms and against random designs ---------


def test_a_task_that_no_design_meets_says_which_demand_fails_first():
    study = problem_study(
        LENGTH,
        objectives={"stiffness_max": "max"},
        constraints={"rigid_mass": "<= 0.001", "isotropy": "<= 5"},
        task=TASK,
        budget=40,
    )
    found = optimise(study, workers=1)
    assert not len(found.front)
    assert found.knee is None
    assert found.reason.startswith("no design tried keeps rigid_mass <= 0.001, the best of ")
    records = {one.demand.key: one for one in found.demands}
    assert records["rigid_mass"].kept == 0.0
    assert records["isotropy"].kept > 0.9


def test_a_demand_of_the_task_that_no_design_keeps_is_named_by_its_key():
    far = {**TASK, "apparent_mass_kg": 0.001, "footprint_radius_m": 1.0}
    found = optimise(problem_study(LENGTH, objectives={"stiffness_max": "max"}, task=far, budget=20), workers=1)
    assert found.reason.startswith("no design tried keeps task.apparent_mass_kg <= 0.001, the best of 20 has 0.")
    near = far | {"apparent_mass_kg": 1.0, "footprint_radius_m": 1e-3}
    found = optimise(problem_study(LENGTH, objectives={"stiffness_max": "max"}, task=near, budget=20), workers=1)
    assert found.reason.startswith("no design tried keeps task.footprint_radius_m <= 0.001, the best of 20 has 0.")


def test_demands_that_are_kept_apart_and_never_together():
    study = problem_study(
        LENGTH,
        objectives={"stiffness_max": "max"},
        constraints={"stiffness_max": ">= 3510", "isotropy": "<= 1.5"},
        task=TASK,
        budget=40,
    )
    found = optimise(study, workers=1)
    assert found.reason.startswith("no design tried keeps all demands together: ")
    assert "stiffness_max >= 3510 is kept by" in found.reason


def test_an_objective_without_a_value_anywhere_ends_the_search_early():
    far = {"box_m": [[1.0, 1.1], [1.0, 1.1]], "count": 2}
    found = optimise(problem_study(RATIO, objectives={"stiffness_max": "max"}, task=far, budget=400), workers=1)
    assert found.reason.startswith("worst(stiffness_max) has no value in any design tried (")
    assert "out of reach" in found.reason
    assert len(found.shares) < 100
    assert (found.judgement.status == OUT_OF_REACH).all()


# --- tolerances in an optimisation: bars of the front, and designs judged by the worst of ------------


def test_bars_are_those_of_the_closed_form():
    found = optimise(mass_study(MASS, PERIOD), workers=1)
    problem = found.problem
    own = {"plant.mass_kg": 0.3, "loop.sampling_period_s": 0.001}
    changes = member_changes(problem.tolerances, found.bars.devices, problem.seed)
    m, T = changes.of(own).T
    assert np.abs(m / 0.3 - 1.0).max() < 0.05
    expected = np.quantile(STIFFEST * m / T**2, [0.05, 0.95])
    np.testing.assert_allclose([found.bars.low[0, 0], found.bars.high[0, 0]], expected, rtol=1e-9)
    assert found.bars.kept.tolist() == [1.0]
    assert "64 devices were drawn within the tolerances of the best design found" in optimisation_sentences(found)
    assert found.values[0, 0] == pytest.approx(STIFFEST * 0.3 / 1e-6, rel=1e-9)
