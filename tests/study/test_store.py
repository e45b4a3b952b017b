"""What is done is kept on disk, bit for bit, and nothing else is touched."""

from __future__ import annotations

import numpy as np
import pytest
import zarr

from tests.study.executor_cases import NotedJob, RootsJob, same_cells
from zwidth.measures import MISSING, STATUS
from zwidth.study import Store, run_job


def partial_store(path, job, batches, size=5):
    """A store in which only some batches are done."""
    store = Store(path, job)
    store.begin(size)
    for n in batches:
        store.write_batch(n * size, job.compute(n * size, min((n + 1) * size, job.count)))


@pytest.mark.parametrize("kind", [RootsJob, NotedJob])
def test_only_what_is_missing_is_computed(tmp_path, kind):
    path = tmp_path / "cells"
    partial_store(path, kind(33), [0, 2, 6])
    job = kind(33)
    told = []
    found = run_job(job, Store(path, job), lambda *now: told.append(now), workers=1, batch=11)
    assert same_cells(found, kind(33).compute(0, 33))
    assert job.computed_ranges == [(5, 10), (15, 20), (20, 25), (25, 30)]
    assert told[0] == ("computing", 13, 33)
    again = kind(33)
    assert same_cells(run_job(again, Store(path, again)), found)
    assert again.computed_ranges == []


def test_others_can_read_it(tmp_path):
    job = RootsJob(12)
    run_job(job, Store(tmp_path / "cells", job), batch=5)
    group = zarr.open_group(str(tmp_path / "cells"), mode="r")
    assert group["values"].shape == (12, 2)
    assert group["values"].chunks == group["status"].chunks == (5, 2)
    assert group["status"].dtype == np.uint8
    attributes = dict(group["status"].attrs)
    assert attributes["flag_values"] == list(STATUS)
    assert len(attributes["flag_meanings"].split()) == len(STATUS)
    assert attributes["measures"] == ["root", "reciprocal"]
    assert int(group["status"].fill_value) == MISSING


@pytest.mark.parametrize("damage", ["cut", "gone", "empty"])
@pytest.mark.parametrize("array", ["values", "status"])
def test_a_damaged_batch_is_computed_again(tmp_path, array, damage):
    path, job = tmp_path / "cells", RootsJob(20)
    run_job(job, Store(path, job), workers=1, batch=10)
    chunk = path / array / "c" / "1" / "0"
    data = chunk.read_bytes()
    if damage == "gone":
        chunk.unlink()
    else:
        chunk.write_bytes(data[: len(data) // 2 if damage == "cut" else 0])
    again = RootsJob(20)
    found = run_job(again, Store(path, again), workers=1)
    assert same_cells(found, RootsJob(20).compute(0, 20))
    assert again.computed_ranges == [(10, 20)]


def test_an_empty_folder_is_begun(tmp_path):
    (tmp_path / "cells").mkdir()
    job = RootsJob(12)
    run_job(job, Store(tmp_path / "cells", job), batch=5)
    assert len(list(Store(tmp_path / "cells", job).stored_batches())) == 3


def test_a_store_can_be_removed_again(tmp_path):
    job, path = RootsJob(3), tmp_path / "cells"
    store = Store(path, job)
    store.remove()
    store.begin(1)
    store.remove()
    assert not path.exists()
