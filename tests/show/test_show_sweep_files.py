"""A study's files written piece by piece hold what its dataset and its table hold."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from tests.study.study_cases import TWO_MASS, axis, study
from zwidth.show import csv_text, dataset, json_text
from zwidth.show.dataset import write_sweep_csv, write_sweep_zarr
from zwidth.study import Sweep, run_study
from zwidth.study.jobs import executor

MASS = axis("plant.mass_kg.0.0", range=[-0.05, 0.3], tie=["plant.mass_kg.1.1"])
MEASURES = ["stiffness_max", "damping_max"]
PERIOD = axis("loop.sampling_period_s", range=[1e-3, 2e-3], scale="log")


def of_grid() -> Sweep:
    axes = [MASS | {"count": 5}, PERIOD | {"count": 3}, axis("model", "full", "rigid")]
    return run_study(study(*axes, device=TWO_MASS, measures=MEASURES), workers=1)


def of_hypercube(count: int = 23, **more) -> Sweep:
    axes = MASS, PERIOD, axis("model", "full", "rigid")
    made = study(*axes, device=TWO_MASS, measures=MEASURES, sampling="latin-hypercube", count=count)
    return run_study(made, **{"workers": 1, **more})


def of_pairs() -> Sweep:
    axes = axis("model", "full", "rigid", "full"), axis("loop.delay_samples", 0, 1, 2)
    return run_study(study(*axes, device=TWO_MASS, measures=MEASURES, sampling="paired"), workers=1)


@pytest.mark.parametrize("chunk", [4, 1 << 16])
@pytest.mark.parametrize("make", [of_grid, of_hypercube, of_pairs])
def test_a_folder_holds_the_dataset(tmp_path, make, chunk, monkeypatch):
    monkeypatch.setattr(dataset, "CHUNK", chunk)
    found = make()
    write_sweep_zarr(tmp_path / "pieces.zarr", found)
    whole = found.dataset()
    with xr.open_zarr(tmp_path / "pieces.zarr", chunks=None) as pieces:
        xr.testing.assert_identical(pieces.load(), whole)
        assert {name: one.dtype.kind for name, one in pieces.variables.items()} == {
            name: one.dtype.kind for name, one in whole.variables.items()
        }
        assert sorted(pieces.coords) == sorted(whole.coords)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["pieces.zarr"]


def test_a_table_in_pieces_is_the_table(tmp_path, monkeypatch):
    monkeypatch.setattr(executor, "MOST_IN_MEMORY", 0)
    stored = of_hypercube(40, store=tmp_path / "cells")
    assert len(list(stored.cells.pieces())) > 1
    write_sweep_csv(tmp_path / "designs.csv", stored)
    assert (tmp_path / "designs.csv").read_text() == csv_text(of_hypercube(40).table())


def test_a_stored_study_is_the_one_in_memory(tmp_path, monkeypatch):
    memory = of_hypercube(40)
    monkeypatch.setattr(executor, "MOST_IN_MEMORY", 0)
    stored = of_hypercube(40, store=tmp_path / "cells")
    assert (repr(stored), stored.reason) == (repr(memory), memory.reason)
    assert json_text(stored.document()) == json_text(memory.document())
    xr.testing.assert_identical(stored.dataset(), memory.dataset())
    for one, values, status in zip(memory.summaries, memory.cells.values.T, memory.cells.status.T, strict=True):
        assert one.lowest == (np.nanmin(values), int(np.nanargmin(values)))
        assert one.highest == (np.nanmax(values), int(np.nanargmax(values)))
        assert dict(one.by_status) == {int(k): int((status == k).sum()) for k in np.unique(status)}
