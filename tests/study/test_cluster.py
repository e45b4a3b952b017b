"""A dask cluster computes the same bits as this computer alone, whichever of its programs are killed."""

from __future__ import annotations

import os
import signal
import warnings
from operator import attrgetter
from pathlib import Path

import pytest

from tests.study.cluster_cases import running_cluster
from tests.study.executor_cases import FaultyJob, ProcessNumbersJob, RootsJob, same_but_for, same_cells
from zwidth.errors import CannotStart, ClusterEnded
from zwidth.measures import FAILED, OUT_OF_TIME
from zwidth.study import RecoveredWarning, Store, open_executor, pack_job, run_job
from zwidth.study.jobs import cluster as clusters
from zwidth.study.jobs import workers

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")


def test_a_local_cluster_gives_the_same_bits_and_says_how_far_it_is():
    told = []
    found = run_job(RootsJob(60), None, lambda *now: told.append(now), 2, batch=7, cluster="local", stage="roots")
    assert same_cells(found, RootsJob(60).compute(0, 60))
    assert (told[0], told[-1]) == (("roots", 0, 60), ("roots", 60, 60))
    assert [done for _, done, _ in told] == sorted(done for _, done, _ in told)


def test_cells_that_raise_kill_or_never_end_are_data_as_on_one_computer(monkeypatch):
    monkeypatch.setattr("zwidth.study.jobs.workers.LOADING", 1.0)
    job = FaultyJob(24, raising=(3,), killing=(12,), endless=(20,), starter=os.getpid())
    with pytest.warns(RecoveredWarning, match="SIGKILL"):
        found = run_job(job, workers=2, batch=8, cluster="local", time_limit=0.5)
    assert same_but_for(found, RootsJob(24).compute(0, 24), [3, 12, 20])
    assert found.status[[3, 12, 20], 0].tolist() == [FAILED, FAILED, OUT_OF_TIME]


def test_one_cluster_serves_many_jobs_with_one_thread_for_each():
    with open_executor(1, "local") as executor:
        found = [run_job(ProcessNumbersJob(8 + n), executor=executor).values for n in range(3)]
    assert len({process for values in found for process in values[:, 0]}) == 1
    assert {threads for values in found for threads in values[:, 1]} == {1.0}
    with pytest.raises(ProcessLookupError):
        os.kill(int(found[0][0, 0]), 0)


def test_a_killed_worker_is_told_and_its_batch_done_again():
    with running_cluster() as cluster:

        def progress(stage, done, of):
            if done == 30:
                os.killpg(cluster.workers[0].pid, signal.SIGKILL)

        with pytest.warns(RecoveredWarning, match=r"^the worker .*tcp://\S+ left"):
            found = run_job(RootsJob(150, seconds=0.02), None, progress, batch=5, cluster=cluster.address)
        assert same_cells(found, RootsJob(150).compute(0, 150))


def test_a_killed_scheduler_ends_the_run_and_the_store_goes_on(tmp_path):
    path, job = tmp_path / "cells", RootsJob(100, seconds=0.01)
    with running_cluster(1, "--no-nanny") as cluster:

        def progress(stage, done, of):
            if done == 30:
                os.killpg(cluster.scheduler.pid, signal.SIGKILL)

        # whether the lost connection or the missing answer is noticed first, the processor's load decides
        with pytest.raises(ClusterEnded, match=r"scheduler .*tcp://127\.0\.0\.1:.* (ended|not answered)"):
            run_job(job, Store(path, job), progress, batch=5, cluster=cluster.address)
    again = RootsJob(100)
    assert same_cells(run_job(again, Store(path, again), workers=1), RootsJob(100).compute(0, 100))
    assert again.computed_ranges[0] >= (30, 35)


@pytest.mark.parametrize("fault", ["CancelledError", "comm.CommClosedError"])
def test_what_dask_raises_of_a_lost_connection_ends_the_run_as_a_scheduler_that_has_ended(monkeypatch, fault):
    import distributed

    submit, submitted = distributed.Client.submit, []

    def lost_later(*given, **options):
        submitted.append(given)
        if len(submitted) > 5:
            raise attrgetter(fault)(distributed)("gone")
        return submit(*given, **options)

    monkeypatch.setattr(distributed.Client, "submit", lost_later)
    with pytest.raises(ClusterEnded, match=r"has ended$"):
        run_job(RootsJob(100), batch=5, cluster="local")


def test_dask_is_silent_here_and_its_levels_are_given_back(tmp_path: Path):
    import logging

    import distributed  # noqa: F401  (it sets its own level as it is loaded)

    before = logging.getLogger("distributed.client").level
    with warnings.catch_warnings(), open_executor(1, "local"):
        warnings.simplefilter("ignore")
        assert logging.getLogger("distributed.client").level > logging.CRITICAL
    assert logging.getLogger("distributed.client").level == before


def test_processes_of_a_run_that_was_killed_end_when_another_comes(monkeypatch):
    monkeypatch.setattr(workers, "FORGOTTEN", 0.0)
    packed = pack_job(ProcessNumbersJob(2))
    assert packed is not None
    expected = workers.versions()
    (gone,) = {*workers.compute_on_worker(packed, 0, 1, "first", None, expected).cells.values[:, 0]}
    os.kill(int(gone), 0)
    workers.compute_on_worker(packed, 0, 1, "second", None, expected)
    with pytest.raises(ProcessLookupError):
        os.kill(int(gone), 0)
    workers.end_processes("second")
    with pytest.raises(CannotStart, match="was ended"):
        workers.compute_on_worker(packed, 0, 1, "second", None, expected)
    with pytest.raises(CannotStart, match=r"zwidth \S+ .* of 7"):
        workers.compute_on_worker(packed, 0, 1, "third", None, expected | {"zwidth": "7"})


def test_a_scheduler_that_falls_silent_ends_the_run(monkeypatch):
    """It is there, and does nothing: the system has stopped it."""
    monkeypatch.setattr(clusters, "SILENT", 1.0)
    monkeypatch.setattr(clusters, "LEAVE", 1.0)
    with running_cluster(1, "--no-nanny") as cluster:

        def progress(stage, done, of):
            if done == 30:
                os.killpg(cluster.scheduler.pid, signal.SIGSTOP)

        with pytest.raises(ClusterEnded, match=r"scheduler .*tcp://127\S+ .* answered .* 1 s$"):
            run_job(RootsJob(400, seconds=0.01), None, progress, batch=5, cluster=cluster.address)


def test_a_cluster_that_loses_all_its_workers_ends_the_run(monkeypatch):
    monkeypatch.setattr(clusters, "SILENT", 1.5)
    with running_cluster(1, "--no-nanny") as cluster:

        def progress(stage, done, of):
            if done == 30:
                os.killpg(cluster.workers[0].pid, signal.SIGKILL)

        with pytest.raises(ClusterEnded, match=r"scheduler .*tcp://127\S+ .* worker .* 1\.5 s$"):
            run_job(RootsJob(400, seconds=0.01), None, progress, batch=5, cluster=cluster.address)
