"""`zwidth optimise`: the page's study, files, what is said, resuming, and everything refused."""

from __future__ import annotations

import csv
import re
import tomllib
from pathlib import Path

import pytest

from tests.cli.command_runner import document_of, parse_strict_json, refusal_lines, run_command
from tests.interruption import stopped_by_ctrl_c
from zwidth.device.load import load

PAGE = (Path(__file__).parents[2] / "docs" / "optimise.md").read_text(encoding="utf-8")
PLANT = """
device = "hapkit-course"
set = ["operator=unset"]
[[axis]]
key = "plant.mass_kg"
range = [0.02, 0.1]
[[axis]]
key = "plant.damping_Ns_per_m"
range = [0.1, 2.0]
[optimise]
objectives = { stiffness_max = "max", spectral_radius = "min" }
budget = 60
front = 5
"""
WALL = "stiffness_N_per_m = 500.0\ndamping_Ns_per_m = 1.0\n"


def blocks(language: str) -> list[str]:
    found = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return [text for kind, text in found if kind == language]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "arms.toml").write_text(blocks("toml")[0])
    (tmp_path / "plant.toml").write_text(WALL + PLANT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def apart(text: str) -> tuple[list[str], list[float]]:
    """The words of a text, and its numbers."""
    parts = text.split()
    numbers = [part for part in parts if re.fullmatch(r"[\d.]+", part)]
    return [part for part in parts if part not in numbers], [float(part) for part in numbers]


def test_the_page_s_study_prints_what_the_page_says(folder):
    ran = run_command("optimise", "arms.toml", "--workers", "1")
    assert (ran.code, ran.err) == (0, "")
    # a search goes on from what it has found: rounding by another processor may lead it a little elsewhere
    (words, numbers), (expected_words, expected) = apart(ran.out), apart(blocks("")[0])
    assert words == expected_words
    assert numbers == pytest.approx(expected, rel=0.03)


@pytest.mark.slow
def test_the_page_s_python_runs(folder):
    names: dict[str, object] = {}
    (program,) = blocks("python")
    exec(compile(program, "optimise.md", "exec"), names)


def test_the_page_names_every_key():
    from zwidth.study.designs.study_schema import OptimiseSection
    from zwidth.study.designs.task import DEMANDS

    for key in (*OptimiseSection.model_fields, *DEMANDS, "operators"):
        assert f"`{key}`" in PAGE, key


def test_files_and_keys(folder):
    document = document_of("optimise", "plant.toml", "--output", "front.json", "--designs", "better")
    written = parse_strict_json(Path("front.json").read_text())
    assert written | {"designs_folder": "better"} == document
    count = len(document["designs"])
    assert 2 <= count <= 5
    assert len(document["values"]) == len(document["status"]) == len(document["active"]) == count
    assert document["searched"] + document["polished"] <= 60
    assert document["baseline"]["values"]["stiffness_max"] > 0
    assert [(one["holds"], one["how"]) for one in document["premises"]] == [(None, "not checked")]
    for n, (design, values) in enumerate(zip(document["designs"], document["values"], strict=True), 1):
        device = load(f"better/hapkit-course-{n}.toml")
        assert device.document["plant"]["mass_kg"] == design["plant.mass_kg"]
        assert "operator" not in device.document
        assert float(device.measure("stiffness_max")) == pytest.approx(values["stiffness_max"], rel=1e-13)
        text = Path(f"better/hapkit-course-{n}.toml").read_text()
        sources = tomllib.loads(text)["sources"]
        assert sources["plant.mass_kg"].endswith(f"plant.toml, seed 1, design {n}")


def names(of: str) -> list[str]:
    return sorted(path.name for path in Path(of).iterdir())


def test_designs_take_the_place_of_those_of_the_same_study_alone(folder):
    document_of("optimise", "plant.toml", "--designs", "better")
    assert len(names("better")) > 2
    Path("better/notes.txt").write_text("mine")
    (folder / "plant.toml").write_text(WALL + changed(PLANT, "front = 5", "front = 2"))
    document_of("optimise", "plant.toml", "--designs", "better")
    assert names("better") == ["hapkit-course-1.toml", "hapkit-course-2.toml", "notes.txt"]
    before = {path: path.read_bytes() for path in Path("better").iterdir()}
    (folder / "other.toml").write_text(WALL + PLANT)
    (line,) = refusal_lines("optimise", "other.toml", "--designs", "better")
    said = "which this study has not written; name another folder, or move them away"
    assert line == f"better: holds hapkit-course-1.toml, hapkit-course-2.toml, {said}"
    assert {path: path.read_bytes() for path in Path("better").iterdir()} == before


def test_designs_without_a_number_are_known_again(folder):
    (folder / "assemblies.toml").write_text(
        'device = "five-bar"\n[[axis]]\nkey = "assembly"\nvalues = ["elbows-in", "elbows-out"]\n'
        '[optimise]\nobjectives = { stiffness_max = "max" }\n'
    )
    for _ in range(2):
        document_of("optimise", "assemblies.toml", "--designs", "better")
        assert names("better") == ["five-bar-1.toml"]


def test_a_device_file_of_one_s_own_is_not_written_over(folder):
    own = Path("hapkit-course-4.toml")
    own.write_text("# by hand\n")
    (line,) = refusal_lines("optimise", "plant.toml", "--designs", ".")
    assert line.startswith(f".: holds {own}")
    assert own.read_text() == "# by hand\n"


@pytest.mark.parametrize("kind", ["csv", "svg", "html"])
def test_other_files(folder, kind):
    ran = run_command("optimise", "plant.toml", "--output", f"front.{kind}")
    assert ran.code == 0
    text = Path(f"front.{kind}").read_text()
    if kind == "csv":
        rows = list(csv.DictReader(text.splitlines()))
        assert sum(row["knee"] == "True" for row in rows) == 1
        assert {"plant.mass_kg", "stiffness_max_N_per_m", "active"} <= rows[0].keys()
    elif kind == "html":
        assert "http" not in text.replace("http-equiv", "").replace("http://www.w3.org", "")
        assert 'id="charts"' in text
        assert 'id="front"' in text
        assert "plant.mass_kg" in text
        assert "plant.mass_kg at its" not in text  # of the design that was found, and not of the best one
        assert "not known" in text


def changed(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new)


HEAVY = """
import time
from zwidth import measure

@measure(unit="kg", better="lower")
def felt(place):
    mass = float(place.measure("rigid_mass"))
    if mass > 0.08:
        {}
    return mass
"""


def heavy_study(folder, what: str, **changes: str) -> None:
    """A study of which a measure does something where the mass is large."""
    (folder / "own.py").write_text(HEAVY.format(what))
    text = 'measures_file = "own.py"\n' + changed(WALL + PLANT, 'spectral_radius = "min"', 'felt = "min"')
    text = changed(text, "budget = 60", "budget = 20")
    for old, new in changes.items():
        text = changed(text, old, new)
    (folder / "plant.toml").write_text(text)


def test_designs_that_fail_are_counted_with_the_reason(folder):
    heavy_study(folder, "raise OverflowError('too heavy')")
    document = document_of("optimise", "plant.toml")
    (lost,) = document["not_judged"]
    assert lost["status"] == "failed"
    assert lost["reason"].startswith("raised OverflowError: ")
    said = f"{lost['designs']} of 15 designs failed: raised OverflowError: too heavy"
    assert 1 <= lost["designs"] < 15
    assert said in run_command("optimise", "plant.toml", "--output", "page.html").out
    assert said in Path("page.html").read_text()
    heavy_study(folder, "raise OverflowError('too heavy')", **{"=unset": '=unset", "plant.mass_kg=0.09'})
    assert "is failed" in run_command("optimise", "plant.toml").out
    heavy_study(folder, "raise OverflowError('too heavy')", **{"[0.02, 0.1]": "[0.02, 0.07]"})
    assert "failed" not in run_command("optimise", "plant.toml").out
    heavy_study(folder, "raise OverflowError('too heavy')", **{"[0.02, 0.1]": "[0.081, 0.1]"})
    ran = run_command("optimise", "plant.toml")
    assert ran.code == 1
    assert ran.out.endswith(" too heavy)\n")
    assert "(20 failed" in ran.out


def test_a_time_limit_is_kept_and_designs_given_up_stay_so(folder):
    # a process is begun anew for each design that is given up: few of them
    heavy_study(folder, "time.sleep(1.7)", **{"[0.02, 0.1]": "[0.02, 0.085]"})
    words = ["optimise", "plant.toml", "--workers", "1", "--resume", "kept"]
    document = document_of(*words[:3], "2", *words[4:], "--time-limit", "0.2")
    (lost,) = document["not_judged"]
    assert lost["status"] == "out of time"
    assert lost["reason"].endswith(" 0.2 s")
    assert all(design["plant.mass_kg"] <= 0.08 for design in document["designs"])
    assert document_of(*words, "--time-limit", "100") == document
    assert document_of(*words) == document
    said = f"{lost['designs']} of 15 designs ran out of time: took longer than 0.2 s"
    assert said in run_command(*words).out


def test_units_are_written_one_way(folder):
    text = changed(WALL + PLANT, "stiffness_max", "damping_max")
    (folder / "plant.toml").write_text(text)
    out = run_command("optimise", "plant.toml", "--output", "page.html").out
    written = out + Path("page.html").read_text()
    (folder / "plant.toml").write_text(changed(text, "budget", "constraints = { damping_max = '>= 1e9' }\nbudget"))
    written += run_command("optimise", "plant.toml").out
    sweep = text.replace("]\n[[axis]]", "]\ncount = 3\n[[axis]]").replace("2.0]\n", "2.0]\ncount = 5\n")
    for least in ("count = 3", "count = 1"):
        (folder / "sweep.toml").write_text('measures = ["damping_max"]\n' + sweep.replace("count = 3", least))
        written += run_command("sweep", "sweep.toml").out
    assert written.replace("\u00a0", " ").count("N s/m") > 10
    assert "Ns/m" not in written


def test_an_unstable_wanted_wall_is_not_stable_in_simulation(folder):
    (folder / "plant.toml").write_text(WALL.replace("500.0", "90000.0") + PLANT)
    out = run_command("optimise", "plant.toml").out
    assert re.search(r"stable in 0 ", out)
    (folder / "plant.toml").write_text(WALL + PLANT)
    out = run_command("optimise", "plant.toml").out
    many = re.search(r"stable in (\d+) of (\d+)", out)
    assert many is not None
    assert many[1] == many[2]


def test_without_a_design_that_keeps_the_demands(folder):
    text = changed(WALL + PLANT, "budget", 'constraints = { stiffness_max = ">= 1e9" }\nbudget')
    (folder / "plant.toml").write_text(text)
    ran = run_command("optimise", "plant.toml", "--json", "--designs", "none")
    assert ran.code == 1
    document = parse_strict_json(ran.out)
    assert document["designs"] == []
    assert document["knee"] is None
    assert document["premises"] == []
    assert document["reason"].count("stiffness_max >= 1e+09") == 1
    assert document["demands"][0]["kept_share"] == 0.0
    assert not Path("none").exists()
    assert run_command("optimise", "plant.toml", "--output", "front.svg").code == 1


def test_an_interrupted_run_goes_on_where_it_was(folder):
    words = ["optimise", "plant.toml", "--resume", "kept", "--json"]
    expected = document_of(*words[:2])
    code, out, err = stopped_by_ctrl_c(words, "zwidth.study.jobs.store:Store.write_batch", 4, folder)
    assert (code, out) == (130, "")
    assert "kept keeps" in err
    assert "Traceback" not in err
    resumed = document_of(*words[:-1])
    assert resumed == expected


def test_finished_work_of_another_study_is_refused_at_the_start(folder):
    document_of("optimise", "plant.toml", "--resume", "kept")
    (folder / "plant.toml").write_text(WALL + changed(PLANT, "budget = 60", "budget = 61"))
    (line,) = refusal_lines("optimise", "plant.toml", "--resume", "kept")
    assert line.startswith("kept: ")
    assert run_command("optimise", "plant.toml", "--output", "front.csv").code == 0
    assert not Path("front.csv.progress").exists()


def test_the_files_have_the_circumstances_that_the_designs_were_judged_in(folder):
    study = """
device = "five-bar"
operator = "thesis-arm"
direction = [1, 0]
[[axis]]
key = "assembly"
values = ["elbows-in", "elbows-out"]
[[axis]]
key = "drives.motor-right.transmission_ratio"
range = [10.0, 20.0]
[optimise]
objectives = { stiffness_max = "max" }
budget = 30
"""
    (folder / "circumstances.toml").write_text(study)
    document = document_of("optimise", "circumstances.toml", "--designs", "better")
    (path,) = Path("better").iterdir()
    device = load(str(path))
    assert device.reference_assembly == document["designs"][0]["assembly"]
    assert float(device.measure("stiffness_max")) == pytest.approx(
        document["values"][0]["stiffness_max"], rel=1e-12
    )
    (folder / "circumstances.toml").write_text('model = "rigid"\n' + study)
    document_of("optimise", "circumstances.toml", "--designs", "rigid")
    (path,) = Path("rigid").iterdir()
    assert path.read_text().partition("\n")[0].count("model = rigid") == 1


def test_an_infinite_objective_is_no_answer(folder):
    (folder / "plant.toml").write_text(
        'device = "five-bar"\n[[axis]]\nkey = "drives.motor-right.transmission_ratio"\nrange = [10.0, 20.0]\n'
        '[optimise]\nobjectives = { joint_margin = "max" }\nbudget = 20\n'
    )
    ran = run_command("optimise", "plant.toml", "--json")
    assert ran.code == 1
    assert parse_strict_json(ran.out)["reason"].startswith("joint_margin is infinite")


def test_a_folder_that_cannot_be_made_is_one_line(folder):
    Path("file").write_text("")
    (line,) = refusal_lines("optimise", "plant.toml", "--designs", "file/inside")
    assert line.startswith("file/inside: cannot ")
