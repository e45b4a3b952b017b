"""Two runs on one store, a full disk, a run that is killed: one clear line, and the store goes on."""

from __future__ import annotations

import errno
import json
import os
import resource
import signal
import socket
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.study.executor_cases import NotedJob, RootsJob, same_cells
from tests.study_sizes import EVERYDAY_SEEDS, study_size
from zwidth.errors import StoreError
from zwidth.study import FolderLock, Store, run_job
from zwidth.study.jobs import executor
from zwidth.study.jobs.store import StoredCells, owner_of


def test_two_runs_that_begin_at_once_do_not_mix(tmp_path, monkeypatch):
    """The second finds the folder of the first in the place where it would put its own."""
    path = tmp_path / "cells"
    first, second = Store(path, RootsJob(33)), Store(path, RootsJob(33))
    with first.locked(), second.locked():
        first.begin(5)
        with pytest.raises(StoreError, match="computing into"):
            second.begin(7)
    assert Store(path, RootsJob(33)).batch == 5
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cells"], "nothing is left of the other's"
    with Store(path, RootsJob(33)).locked():
        pass


def test_a_lock_is_one_of_the_system(tmp_path):
    one, other = FolderLock(), FolderLock()
    assert one.acquire(tmp_path)
    assert not other.acquire(tmp_path)
    assert owner_of(tmp_path) == f"process {os.getpid()} on {socket.gethostname()}"
    one.release()
    assert other.acquire(tmp_path)
    other.release()
    (tmp_path / "lock").write_text("torn")
    assert owner_of(tmp_path) == "another process"
    assert one.acquire(tmp_path)


def test_a_full_disk_is_an_error_and_the_store_goes_on(tmp_path):
    """A file that may not grow is refused as on a full disk; here notes grow beyond what is allowed."""
    path, job = tmp_path / "cells", NotedJob(4000)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, limits[1]))
        with pytest.raises(OSError) as caught:  # noqa: PT011  its number is looked at
            run_job(job, Store(path, job), workers=1, batch=100)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, ignored)
    assert caught.value.errno == errno.EFBIG
    kept = len(list(Store(path, job).stored_batches()))
    assert 2 < kept < 30
    again = NotedJob(4000)
    found = run_job(again, Store(path, again), workers=1)
    assert same_cells(found, run_job(NotedJob(4000), workers=1, batch=4000))
    assert len(again.computed_ranges) == 40 - kept


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="a file system of its own needs the rights of root")
def test_a_disk_that_is_really_full(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", disk]).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        job = RootsJob(3000)
        (disk / "other").write_bytes(bytes(700_000))
        with pytest.raises(OSError, match="No space"):
            run_job(job, Store(disk / "cells", job), workers=1, batch=50)
        kept = len(list(Store(disk / "cells", job).stored_batches()))
        assert kept > 2
        (disk / "other").unlink()
        again = RootsJob(3000)

        assert same_cells(run_job(again, Store(disk / "cells", again), workers=1), RootsJob(3000).compute(0, 3000))
        assert len(again.computed_ranges) == 60 - kept
    finally:
        subprocess.run(["umount", "-l", disk], check=True)


def test_many_cells_stay_in_the_store(tmp_path, monkeypatch):
    job = NotedJob(1000)
    few = run_job(job, Store(tmp_path / "few", job), workers=1, batch=30)
    monkeypatch.setattr(executor, "MOST_IN_MEMORY", 500)
    many = run_job(job, Store(tmp_path / "many", job), workers=1, batch=30)
    assert isinstance(many, StoredCells)
    assert same_cells(few, run_job(NotedJob(1000), workers=1))
    assert same_cells(many, few)
    pieces = list(many.pieces())
    assert [first for first, _ in pieces] == list(range(0, 1000, 30))
    assert np.concatenate([cells.values for _, cells in pieces]).tobytes() == few.values.tobytes()


def judge_flipped_bits(folder: Path, seed: int, most: int) -> dict[str, int]:
    """Flip one bit after another in every file of a store, and ask the store for its cells.

    most     places that are tried in each file; all of a shorter one
    Returns  how often the store was refused, batches were computed again, and everything was read as it was.
             Cells other than those that were computed are an error, and so is any exception but StoreError.
    """
    rng = np.random.default_rng(seed)
    kind = (RootsJob, NotedJob)[seed % 2]
    count = int(rng.integers(5, 40))
    batch = count // 2 + 1  # two batches: each attempt opens and reads the whole store
    path, right = folder / f"cells-{seed}", run_job(kind(count), workers=1)
    run_job(kind(count), Store(path, kind(count)), workers=1, batch=batch)
    intact = {file: file.read_bytes() for file in sorted(path.rglob("*")) if file.is_file()}
    assert {file.name for file in intact} >= {"zarr.json", "notes.jsonl", "lock", "0"}
    tally = {"refused": 0, "again": 0, "as it was": 0}
    for file, data in intact.items():
        for place in rng.permutation(len(data))[:most]:
            damaged = bytearray(data)
            damaged[place] ^= 1 << int(rng.integers(8))
            file.write_bytes(damaged)
            job = kind(count)
            try:
                found = run_job(job, Store(path, job), workers=1)
            except StoreError:
                outcome = "refused"
            else:
                assert same_cells(found, right), f"byte {place} of {file.relative_to(path)}"
                outcome = "again" if job.computed_ranges else "as it was"
                assert outcome == "again" or file.name in ("lock", "zarr.json"), f"byte {place} of {file}"
            tally[outcome] += 1
            for one, kept in intact.items():
                one.write_bytes(kept)
    return tally


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_no_flipped_bit_changes_a_cell(tmp_path, seed):
    tally = judge_flipped_bits(tmp_path, seed, 2)
    assert min(tally["refused"], tally["again"]) > 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(study_size(continuous=10, full=100)))
def test_no_flipped_bit_changes_a_cell_of_many_stores(tmp_path, seed):
    judge_flipped_bits(tmp_path, seed, 40)


def test_cells_that_are_damaged_after_the_run_are_refused(tmp_path, monkeypatch):
    """Cells that stay on the disk are read once more when they are asked for."""
    monkeypatch.setattr(executor, "MOST_IN_MEMORY", 5)
    job = RootsJob(40)
    found = run_job(job, Store(tmp_path / "cells", job), workers=1, batch=10)
    chunk = tmp_path / "cells" / "values" / "c" / "2" / "0"
    chunk.write_bytes(chunk.read_bytes()[:-9] + b"x" * 9)
    with pytest.raises(StoreError, match="cells 20 to 29"):
        found.values  # noqa: B018


def test_a_store_without_checksums_is_refused_by_its_version(tmp_path):
    job = RootsJob(40)
    run_job(job, Store(tmp_path / "cells", job), workers=1, batch=10)
    header = tmp_path / "cells" / "zarr.json"
    parts = json.loads(header.read_text())
    parts["attributes"] |= {"version": 1}
    header.write_text(json.dumps(parts))
    with pytest.raises(StoreError, match="version is 1"):
        Store(tmp_path / "cells", job)


def test_lines_of_notes_that_are_damaged_cost_their_own_batch_alone(tmp_path):
    path, job = tmp_path / "cells", NotedJob(40)
    run_job(job, Store(path, job), workers=1, batch=10)
    notes = path / "notes.jsonl"
    notes.write_text(notes.read_text().replace("cell 13", "cell 14"))
    again = NotedJob(40)
    found = run_job(again, Store(path, again), workers=1)
    assert same_cells(found, NotedJob(40).compute(0, 40))
    assert again.computed_ranges == [(10, 20)]
