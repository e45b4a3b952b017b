"""What is said of folders, journals, processes and clusters that a long run cannot use."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import sys
from collections import namedtuple

import pytest
import zarr

from tests.show.test_show_sweep_files import of_pairs
from tests.study.cluster_cases import running_cluster
from tests.study.executor_cases import RootsJob
from tests.study.test_series import computed
from tests.study.test_store import partial_store
from zwidth.errors import CannotStart, ClusterError, OutputError, StoreError, TooLarge
from zwidth.show.dataset import write_sweep_zarr
from zwidth.study import Store, open_executor, pack_job, run_job
from zwidth.study.designs import sweep as sweep_of_designs
from zwidth.study.jobs import cluster as clusters
from zwidth.study.jobs.workers import WorkerProcess

# --- what is done is kept on disk, bit for bit, and nothing else is touched --------------------------


def test_another_question_is_refused_and_nothing_is_lost(tmp_path):
    path = tmp_path / "cells"
    partial_store(path, RootsJob(33), [0])
    for other in (RootsJob(34), RootsJob(33, question="else"), RootsJob(33, measures=("root", "other"))):
        with pytest.raises(
            StoreError, match=r"^cells: keeps finished work of another study or other options; name"
        ):
            Store(path, other)
        assert [first for first, _ in Store(path, RootsJob(33)).stored_batches()] == [0]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cells"]


def test_another_release_is_refused_by_its_number(tmp_path, monkeypatch):
    path = tmp_path / "cells"
    partial_store(path, RootsJob(33), [0])
    monkeypatch.setattr("zwidth.study.jobs.store.__version__", "9.8")
    with pytest.raises(
        StoreError, match=r"^cells: keeps this study as computed by zwidth \d\S+, and this is 9\.8;"
    ):
        Store(path, RootsJob(33))
    with pytest.raises(StoreError, match=r"^cells: keeps a study as computed by zwidth \d\S+, and this is 9\.8;"):
        Store(path, RootsJob(34))


@pytest.mark.parametrize("what", ["file", "folder", "group"])
def test_what_is_no_store_is_left_alone(tmp_path, what):
    path = tmp_path / "precious"
    if what == "file":
        path.write_text("text")
    elif what == "folder":
        (path / "inside").mkdir(parents=True)
    else:
        zarr.open_group(str(path), mode="w").attrs["mine"] = 1
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(StoreError, match="precious: is not the store of a study; name another folder"):
        Store(path, RootsJob(3))
    assert sorted(tmp_path.rglob("*")) == before


def test_what_does_not_fit_on_the_disk_is_refused_with_its_size(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage(10**9, 0, 10**6))
    with pytest.raises(
        StoreError, match=r"cells: 1000000 cells of 2 measures would take 0\.018 GB of disk, of 0\.001"
    ):
        Store(tmp_path / "cells", RootsJob(10**6))
    assert list(tmp_path.iterdir()) == []


# --- jobs of one question in one folder: whose folder it is, and what is left of a run that ----------


def test_a_folder_of_another_release_is_refused_by_its_number(tmp_path, monkeypatch):
    computed(tmp_path / "kept")
    for module in ("series", "store"):
        monkeypatch.setattr(f"zwidth.study.jobs.{module}.__version__", "9.8")
    with pytest.raises(StoreError, match=r"kept: keeps this study as computed by zwidth \d\S+, and this is 9\.8;"):
        computed(tmp_path / "kept")


# --- cells that cannot be computed are data; all others have their values, bit for bit ---------------


@pytest.mark.parametrize("limit", [0.0, -1.0, float("inf"), float("nan")])
def test_a_time_limit_that_is_none_is_refused(limit):
    with pytest.raises(ValueError, match="time_limit must be a finite number, above 0"):
        run_job(RootsJob(3), time_limit=limit)


def test_arguments_that_do_not_go_together_are_refused():
    class Local(RootsJob):
        pass

    with pytest.raises(ValueError, match="time_limit needs other processes, and a measure of this study exists"):
        run_job(Local(3), time_limit=1.0)
    with (
        open_executor(1, time_limit=1.0) as executor,
        pytest.raises(ValueError, match="time_limit needs other processes, and a measure of this study exists"),
    ):
        run_job(Local(3), executor=executor)
    with open_executor(1) as executor, pytest.raises(ValueError, match="give either it or them"):
        run_job(RootsJob(3), executor=executor, workers=2)


def test_a_process_that_cannot_start_is_said():
    worker = WorkerProcess()
    packed = pack_job(RootsJob(3))
    assert packed is not None
    unreadable = type(packed)("key", b"no pickle", 2, "key")
    with pytest.raises(CannotStart, match="cannot read the job: UnpicklingError"):
        worker.compute(unreadable, 0, 1)
    worker.end()
    with pytest.raises(CannotStart, match="the run was ended"):
        worker.compute(packed, 0, 1)


# --- a dask cluster computes the same bits as this computer alone, whichever of its programs ---------


def test_a_scheduler_that_does_not_answer_is_said(monkeypatch):
    """Nobody listens; somebody listens and says nothing; the address is none."""
    monkeypatch.setattr(clusters, "ANSWER", 1.0)
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        port = silent.getsockname()[1]
        with pytest.raises(ClusterError, match=rf"^tcp://127.0.0.1:{port}: no scheduler answers within 1 s;"):
            run_job(RootsJob(3), cluster=f"tcp://127.0.0.1:{port}")
        silent.listen()
        with pytest.raises(ClusterError, match=rf"^tcp://127.0.0.1:{port}: no scheduler answers within 1 s;"):
            run_job(RootsJob(3), cluster=f"tcp://127.0.0.1:{port}")
    for wrong in ("nowhere", "hugo://here:1"):
        with pytest.raises(ClusterError, match=rf"^{wrong}: is no address \(.*\); start one"):
            run_job(RootsJob(3), cluster=wrong)


def test_a_cluster_without_workers_and_workers_that_differ_are_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(clusters, "ANSWER", 1.0)
    missing, older = tmp_path / "missing", tmp_path / "older" / "zwidth"
    missing.mkdir()
    older.mkdir(parents=True)
    (missing / "zwidth.py").write_text("raise ModuleNotFoundError('no zwidth here')")
    (older / "__init__.py").write_text("")
    (older / "_version.py").write_text("__version__ = '0.0.1'")
    with running_cluster(0) as cluster:
        with pytest.raises(ClusterError, match=r"has no workers; start one on each computer: dask worker tcp://"):
            run_job(RootsJob(3), cluster=cluster.address)
        for folder, said in (
            (missing, r"has no zwidth; install zwidth \S+ there, in the Python that runs dask worker"),
            (older.parent, r"has zwidth 0\.0\.1 instead of \S+; results would not be the same: install the same"),
        ):
            worker = cluster.start_worker("--no-nanny", path=[str(folder), *sys.path])
            with pytest.raises(ClusterError, match=rf"^the worker at tcp://\S+ {said}"):
                run_job(RootsJob(3), cluster=cluster.address)
            os.killpg(worker.pid, signal.SIGKILL)
            worker.wait()


def test_without_dask_there_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClusterError, match=r"^a cluster needs dask.distributed; install it: pip"):
        run_job(RootsJob(3), cluster="local")


def test_a_cluster_at_an_address_has_its_own_workers():
    with pytest.raises(ValueError, match="workers is for processes of this computer; the cluster at tcp"):
        open_executor(2, "tcp://a:1")


# --- cells are what the job says, however they are cut, and whoever computes them --------------------


def test_what_does_not_fit_into_memory_is_refused_with_its_size():
    job = RootsJob(10**13)
    with pytest.raises(
        TooLarge, match=r"10000000000000 cells of 2 measures would take 3\.6e\+05 GB of memory, .* ask"
    ):
        run_job(job)
    assert job.computed_ranges == []


# --- a study's files written piece by piece hold what its dataset and its table hold -----------------


def test_what_lists_all_designs_is_refused_where_it_would_not_fit(monkeypatch):
    found = of_pairs()
    monkeypatch.setattr(sweep_of_designs, "PER_AXIS", 10**12)
    for listing in (found.dataset, found.table, found.document):
        with pytest.raises(
            TooLarge, match=r"^3 designs of 2 measures, listed all at once, would take .* \(\.zarr"
        ):
            listing()


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"designs\.zarr: cannot be written: not a directory; name another"):
        write_sweep_zarr(tmp_path / "file" / "designs.zarr", of_pairs())
