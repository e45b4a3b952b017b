"""`zwidth sweep`: designs, their values and what became of them; files, resuming, and everything refused."""

from __future__ import annotations

import csv
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from tests.cli.command_runner import document_of, parse_strict_json, refusal_lines, run_command
from tests.interruption import stopped_by_ctrl_c
from zwidth.study import Store, read_study, sweep_job

PAGE = (Path(__file__).parents[2] / "docs" / "studies.md").read_text(encoding="utf-8")
ZWIDTH = Path(sys.executable).with_name("zwidth")
LENGTH, OTHER = "links.upper-right.length_m", "links.upper-left.length_m"
STUDY = f"""
device = "five-bar"
measures = ["rigid_mass", "isotropy"]
[[axis]]
key = "{LENGTH}"
range = [0.02, 0.18]
count = 5
tie = ["{OTHER}"]
[[axis]]
key = "assembly"
values = ["elbows-out", "elbows-in"]
"""
SLOW = """
from time import sleep
from zwidth import measure

@measure(unit="s")
def slow(place):
    sleep(0.01)
    with open("asked", "ab") as file:
        file.write(b".")
    return place.controller.sampling_period
"""
MANY = """
device = "published-two-mass"
measures = ["slow"]
measures_file = "slow.py"
[[axis]]
key = "loop.sampling_period_s"
range = [1e-3, 2e-3]
count = {count}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "slow.py").write_text(SLOW)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_designs_values_and_status(folder):
    document = document_of("sweep", "study.toml")
    assert len(document["designs"]) == len(document["values"]) == len(document["status"]) == 10
    assert document["designs"][3] == {LENGTH: 0.06, OTHER: 0.06, "assembly": "elbows-in"}
    assert document["status"][0] == {"rigid_mass": "out of reach", "isotropy": "out of reach"}
    assert document["values"][0] == {"rigid_mass": None, "isotropy": None}
    assert document["status"][9] == {"rigid_mass": "ok", "isotropy": "ok"}
    shown = document_of(
        "show", "five-bar", "--set", f"{LENGTH}=0.18", "--set", f"{OTHER}=0.18", "--assembly", "elbows-in"
    )
    assert document["values"][9]["rigid_mass"] == pytest.approx(shown["rigid_mass_kg"], rel=1e-12)
    assert document["values"][9]["isotropy"] == pytest.approx(shown["isotropy"], rel=1e-12)
    assert document["units"] == {"rigid_mass": "kg", "isotropy": None}
    assert document["axes"][0]["tied"] == [OTHER]


@pytest.mark.parametrize("kind", ["csv", "json", "nc", "mat", "zarr", "svg"])
def test_files(folder, kind):
    document = document_of("sweep", "study.toml", "--output", f"designs.{kind}")
    path = folder / f"designs.{kind}"
    assert sorted(p.name for p in folder.iterdir()) == sorted(["slow.py", "study.toml", path.name])
    masses = np.array([value["rigid_mass"] for value in document["values"]], dtype=float).reshape(5, 2)
    if kind == "csv":
        rows = list(csv.DictReader(path.read_text().splitlines()))
        assert [float(row["rigid_mass_kg"] or "nan") for row in rows] == pytest.approx(masses.ravel(), nan_ok=True)
        assert {row["isotropy_status"] for row in rows} == {"ok", "out of reach"}
        assert rows[3][OTHER] == "0.06"
    elif kind == "json":
        assert parse_strict_json(path.read_text()) == document
    elif kind in ("nc", "zarr"):
        options = {"engine": "scipy"} if kind == "nc" else {"engine": "zarr", "consolidated": True}
        with xr.open_dataset(path, **options) as dataset:
            assert np.array_equal(dataset["rigid_mass"].values, masses, equal_nan=True)
            assert list(dataset["assembly"].values.astype(str)) == ["elbows-out", "elbows-in"]
            assert dataset["rigid_mass"].attrs["unit"] == "kg"
            assert json.loads(dataset.attrs["study"])["measures"] == ["rigid_mass", "isotropy"]
            assert dataset["isotropy_status"].values[0, 0] == 1
    elif kind == "mat":
        from scipy.io import loadmat

        inside = loadmat(path)
        assert np.array_equal(inside["rigid_mass"], masses, equal_nan=True)
    else:
        assert path.read_text().count("<svg") == 1


def test_a_study_in_which_nothing_has_a_value(folder):
    (folder / "study.toml").write_text(STUDY.replace("range = [0.02, 0.18]", "range = [0.01, 0.02]"))
    ran = run_command("sweep", "study.toml", "--json")
    assert ran.code == 1
    document = parse_strict_json(ran.out)
    assert document["reason"].rpartition(": ")[2] == "out of reach"
    assert len(document["designs"]) == 10


def stored_cells(path):
    return list(Store(path, sweep_job(read_study("study.toml"))).stored_batches())


def test_an_interrupted_run_goes_on_where_it_was(folder):
    """Ctrl-C once three batches are on disk."""
    (folder / "study.toml").write_text(MANY.format(count=200))
    words = ["sweep", "study.toml", "--output", "designs.csv", "--workers", "2", "--json"]
    code, out, err = stopped_by_ctrl_c(words, "zwidth.study.jobs.store:Store.write_batch", 3, folder)
    assert (code, out) == (130, "")
    assert "designs.csv.progress keeps" in err
    assert "Traceback" not in err
    batches = stored_cells(folder / "designs.csv.progress")
    assert len(batches) == 3
    kept = sum(len(cells.values) for _, cells in batches)
    before = (folder / "asked").stat().st_size
    assert run_command(*words).code == 0
    assert (folder / "asked").stat().st_size - before == 200 - kept + 1, "and one to see whether it can be asked"
    assert not (folder / "designs.csv.progress").exists(), "what it kept is written"
    rows = list(csv.DictReader((folder / "designs.csv").read_text().splitlines()))
    assert [float(row["slow_s"]) for row in rows] == np.linspace(1e-3, 2e-3, 200).tolist()


def test_a_stop_within_compiled_code_is_a_stop(folder, monkeypatch):
    def stopped(*_):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr("zwidth.study.jobs.executor._compute_here_first", stopped)
    ran = run_command("sweep", "study.toml", "--output", "out.csv")
    assert ran.code == 130
    assert "out.csv.progress keeps" in ran.err
    assert not (folder / "out.csv").exists()


def test_a_folder_of_the_user_s_is_kept_and_not_given_to_another_study(folder):
    (folder / "study.toml").write_text(MANY.format(count=4))
    first = document_of("sweep", "study.toml", "--resume", "cells")
    values = folder / "cells" / "values" / "c" / "3" / "0"
    written = values.stat().st_mtime_ns
    assert document_of("sweep", "study.toml", "--resume", "cells") == first
    assert values.stat().st_mtime_ns == written, "nothing is computed again"
    refused = "cells: keeps finished work of another study or other options; name another folder, or remove it"
    (folder / "study.toml").write_text(MANY.format(count=5))
    assert refusal_lines("sweep", "study.toml", "--resume", "cells") == [refused]
    (folder / "study.toml").write_text(MANY.format(count=4))
    (folder / "slow.py").write_text(SLOW.replace("sampling_period", "sampling_period + 1.0"))
    assert refusal_lines("sweep", "study.toml", "--resume", "cells") == [refused]
    assert values.stat().st_mtime_ns == written


# --- the page ---------------------------------------------------------------------------------------


def blocks(language: str) -> list[str]:
    found = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return [text for kind, text in found if kind == language]


@pytest.fixture
def arms(folder):
    text, _ = blocks("toml")  # and an axis of a catalogue
    (folder / "arms.toml").write_text(text)
    return folder


def test_the_page_s_study_prints_what_the_page_says(arms):
    ran = run_command("sweep", "arms.toml")
    assert (ran.code, ran.err) == (0, "")
    (said,) = blocks("")
    assert ran.out == said


def test_the_page_s_python_runs(arms):
    names: dict[str, object] = {}
    for program in blocks("python"):
        exec(compile(program, "studies.md", "exec"), names)
    results = names["results"]
    assert isinstance(results, xr.Dataset)
    assert dict(results.sizes) == {"loop.sampling_period_s": 2, "assembly": 2}


def test_the_page_names_every_key():
    from zwidth.study import StudyFile
    from zwidth.study.designs.column import STATISTICS
    from zwidth.study.designs.sampling import CIRCUMSTANCES
    from zwidth.study.designs.study_schema import AxisSection, StudyWorkspaceSection, TieSection

    for section in (StudyFile, AxisSection, TieSection, StudyWorkspaceSection):
        for key in section.model_fields:
            assert re.search(rf"\b{key}\b", PAGE), key
    assert all(f"`{key}`" in PAGE for key in CIRCUMSTANCES)
    assert all(f"`{key}(" in PAGE for key in STATISTICS)
