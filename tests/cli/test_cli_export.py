"""`zwidth export`: what it writes and says, what it refuses, and where it has no answer."""

from __future__ import annotations

import csv
import json
from importlib import import_module

import numpy as np
import pytest
import xarray as xr

from tests.cli.command_runner import MECHANISM, TWO_MASS, document_of, run_command
from tests.interruption import stopped_by_ctrl_c
from zwidth.device.load import load
from zwidth.show import header_text
from zwidth.study import safe_walls

SMALL = ("--x", "-0.05,0.05", "--y", "0.2,0.25", "--cells", "2,1", "--levels", 4, "--workers", 1)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_header_is_written_where_none_is_named(here):
    document = document_of("export", TWO_MASS)
    assert document["file"] == str(here / "safe_walls.h")
    assert (here / "safe_walls.h").read_text() == header_text(safe_walls(load(TWO_MASS)))
    assert [path.name for path in here.iterdir()] == ["safe_walls.h"]
    assert document["status"] == "ok"
    assert 0.0 < document["stiffness_max_N_per_m"] < load(TWO_MASS).chart(decay=False).stiffness_max
    assert document["hands"] == ["none"]
    assert not {"position_m", "direction", "operator"} & document.keys()


def test_tables_are_written_as_data_too(here, monkeypatch):
    table = safe_walls(load(MECHANISM), x=(-0.05, 0.05), y=(0.2, 0.25), cells=(2, 1), levels=4, workers=1)
    document = document_of("export", MECHANISM, *SMALL, "--output", "walls.json")
    assert json.loads((here / "walls.json").read_text()) == document
    K = np.array(document["stiffness_max_N_per_m"], dtype=float)
    np.testing.assert_array_equal(K.ravel(), table.rectangles[:, 0])
    # the other files are of the same table
    computing = import_module("zwidth.study.wall_tables.safe_walls")
    monkeypatch.setattr(computing, "compute_table", lambda *_, **__: table)
    run_command("export", MECHANISM, *SMALL, "--output", "walls.csv")
    rows = list(csv.DictReader((here / "walls.csv").read_text().splitlines()))
    assert len(rows) == len(table.table()["sector"])
    first = next(row for row in rows if row["status"] == "ok")
    cell = int(np.flatnonzero(table.level)[0])
    assert float(first["damping_max_Ns_per_m"]) == table.ranges[cell, 0, 0, 1]
    run_command("export", MECHANISM, *SMALL, "--output", "walls.nc")
    with xr.open_dataset(here / "walls.nc", engine="scipy") as data:
        np.testing.assert_array_equal(data["stiffness_max"].values, K)
    assert run_command("export", MECHANISM, *SMALL, "--output", "walls.png").code == 0
    assert (here / "walls.png").read_bytes().startswith(b"\x89PNG")


def test_where_no_cell_has_walls_nothing_is_written(here):
    ran = run_command("export", TWO_MASS, "--span", 1e6, "--json")
    assert ran.code == 1
    assert ran.document["file"] is None
    assert "safe walls" in ran.document["reason"]
    assert list(here.iterdir()) == []


def test_a_measured_response_has_no_table(here):
    z = np.exp(2j * np.pi * np.geomspace(0.5, 400.0, 60) * 0.001)
    P = 1e-6 * (z + 1.0) / (2.0 * 0.1 * (z - 1.0) ** 2) * z**-1
    f = np.geomspace(0.5, 400.0, 60)
    lines = [f"{a},{b.real},{b.imag}" for a, b in zip(f.tolist(), P.tolist(), strict=True)]
    (here / "sweep.csv").write_text("\n".join(["frequency_Hz,real_m_per_N,imag_m_per_N", *lines]))
    (here / "d.toml").write_text('name = "d"\n[response]\nfile = "sweep.csv"\n[loop]\nsampling_period_s = 0.001\n')
    ran = run_command("export", "d.toml", "--json")
    assert ran.code == 1
    assert "zwidth identify" in ran.document["reason"]
    assert ran.document["file"] is None


def test_ctrl_c_keeps_the_cells_that_are_done(here):
    """The same command goes on from them, and ends with the same bytes as one that was never stopped."""
    words = ["export", MECHANISM, "--x", "-0.1,0.1", "--y", "0.15,0.25", "--cells", "3,2"]
    words += ["--levels", "2", "--workers", "1", "--output", "walls.h"]
    code, _, error = stopped_by_ctrl_c(words, "zwidth.study.jobs.store:Store.write_batch", 1, here)
    assert code == 130
    assert "walls.h.progress keeps" in error
    assert not (here / "walls.h").exists()
    assert run_command(*words).code == 0
    assert [path.name for path in here.iterdir()] == ["walls.h"]
    table = safe_walls(load(MECHANISM), x=(-0.1, 0.1), y=(0.15, 0.25), cells=(3, 2), levels=2, workers=1)
    assert (here / "walls.h").read_text() == header_text(table)
