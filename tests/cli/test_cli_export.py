"""`zwidth export`: what it writes and says, what it refuses, and where it has no answer."""

from __future__ import annotations

import csv
import json
from importlib import import_module

import numpy as np
import pytest
import xarray as xr

from tests.cli.command_runner import MECHANISM, TWO_MASS, document_of, refusal_lines, run_command
from tests.interruption import stopped_by_ctrl_c
from zwidth.device.load import load
from zwidth.show import header_text
from zwidth.study import safe_walls

SMALL = ("--x", "-0.05,0.05", "--y", "0.2,0.25", "--cells", "2,1", "--levels", 4, "--workers", 1)
SMOOTHED = "loop.velocity.filter={type='first-order', time_constant_s=0.1}"
FEW = ("--x", "-0.05,0.05", "--y", "0.2,0.5", "--cells", "1,3", "--levels", 2, "--workers", 1)


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


def test_people_read_what_the_table_holds_for(here):
    ran = run_command(
        "export", MECHANISM, *FEW, "--hands", "none,thesis-arm", "--margin", 0.1, "--arduino", "wall"
    )
    assert ran.code == 0
    words = " ".join(ran.out.split())
    assert "in every posture of a cell, in every direction, held by nobody, thesis-arm" in words
    assert "of 1 x 3 have safe walls" in words
    assert "stiffness and damping may be off by 10 %" in words
    assert "out of reach: a posture in the cell is out of reach" in words
    assert {path.name for path in (here / "wall").iterdir()} == {"wall.ino", "safe_walls.h"}
    assert (here / "wall" / "safe_walls.h").read_text() == (here / "safe_walls.h").read_text()


def test_where_no_cell_has_walls_nothing_is_written(here):
    ran = run_command("export", TWO_MASS, "--span", 1e6, "--json")
    assert ran.code == 1
    assert ran.document["file"] is None
    assert "no cell has safe walls" in ran.document["reason"]
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
    assert "fit a [plant] with zwidth identify" in ran.document["reason"]
    assert ran.document["file"] is None


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((MECHANISM, "--levels", 0), "'--levels': must be a whole number from 1 to 255, got 0"),
        ((MECHANISM, "--margin", 1), "'--margin': must be a finite number, at least 0 and below 1, got 1"),
        ((MECHANISM, "--span", -1), "'--span': must be a finite number, above 0 [N s/m], got -1"),
        ((MECHANISM, "--cells", "3"), "must be 2 or 3 whole numbers such as 20,10, got '3'"),
        ((MECHANISM, "--cells", "3,3,3"), "give --cells as NX,NY"),
        ((MECHANISM, "--z", "0,1"), "leave out --z"),
        ((MECHANISM, "--x", "1,0"), "range along x must be LOW,HIGH with LOW < HIGH"),
        ((MECHANISM, "--x", "5,6", "--y", "5,6", "--cells", "1,1", "--hands", "nobody-at-all"), "nobody-at-all"),
        ((MECHANISM, "--hands", "none,,"), "--hands: must be names with commas between them, got 'none,,'"),
        ((MECHANISM, "--hands", "none", "--operator", "none"), "--operator and --hands exclude each other"),
        ((MECHANISM, "--size-limit", 100), "bytes, more than the 100 of its limit; take fewer with --cells"),
        ((MECHANISM, "--output", "walls.txt"), "must end in one of .h, .png, .svg, .pdf, .csv, .json, .nc"),
        (
            (MECHANISM, "--arduino", "no/such/folder"),
            "--arduino: no/such/folder is no folder and cannot be made one",
        ),
        (
            (
                MECHANISM,
                "--arduino",
                "wall",
                "--set",
                SMOOTHED,
            ),
            "--arduino: five-bar: the sketch computes a wall by the backward difference",
        ),
        ((TWO_MASS, "--cells", "3,3"), "no workspace; its walls are the same everywhere"),
        ((TWO_MASS, "--directions", 2), "got 2 parts of directions; leave out --directions"),
        ((MECHANISM, "--set", "load.force_N=[0.0,-5.0]"), "leave the load out, with --set load=unset"),
        (("rice-haptic-paddle",), "renders moments about an axis"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(here, words, message):
    lines = refusal_lines("export", *words)
    assert any(message in line for line in lines), lines
    assert list(here.iterdir()) == []


def test_ctrl_c_keeps_the_cells_that_are_done(here):
    """The same command goes on from them, and ends with the same bytes as one that was never stopped."""
    words = ["export", MECHANISM, "--x", "-0.1,0.1", "--y", "0.15,0.25", "--cells", "3,2"]
    words += ["--levels", "2", "--workers", "1", "--output", "walls.h"]
    code, _, error = stopped_by_ctrl_c(words, "zwidth.study.jobs.store:Store.write_batch", 1, here)
    assert code == 130
    assert "walls.h.progress keeps the finished work; the same command continues from it" in error
    assert not (here / "walls.h").exists()
    assert run_command(*words).code == 0
    assert [path.name for path in here.iterdir()] == ["walls.h"]
    table = safe_walls(load(MECHANISM), x=(-0.1, 0.1), y=(0.15, 0.25), cells=(3, 2), levels=2, workers=1)
    assert (here / "walls.h").read_text() == header_text(table)
