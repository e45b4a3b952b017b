"""Which tests a change runs, on records and commits where the right choice is known."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.verdict import selection
from tests.verdict.chosen import CHOSEN
from tests.verdict.executed import ROOT, ExecutionRecord
from tests.verdict.full_studies import kept_with, page_of, summary_of, text_of
from tests.verdict.recorder import RECORD
from tests.verdict.recording import RecordedFile, RecordedTest, read_recorded, write_recorded
from tests.verdict.selection import Choice, affected_tests, best_choice, files_of, files_that_name
from tests.verdict.slowest import slowest_lines
from tests.verdict.studies import choose_studies, run_studies

AREA, ARCS, PEAK = (f"src/zwidth/chart/{name}.py" for name in ("area", "arcs", "peak"))
TESTS = ["tests/chart/test_a.py", "tests/chart/test_b.py", "tests/loop/test_c.py"]
KNOWN = {
    TESTS[0]: RecordedFile(1.0, {AREA, ARCS}),
    TESTS[1]: RecordedFile(1.0, {PEAK}),
    TESTS[2]: RecordedFile(1.0, {ARCS, "docs/chart.md"}),
}


@pytest.fixture
def no_importers(monkeypatch):
    monkeypatch.setattr(selection, "direct_importers", lambda path: set())


# --- what covers a change ---------------------------------------------------------------------------


@pytest.mark.usefixtures("no_importers")
@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ([PEAK], TESTS[1:2]),
        ([ARCS], [TESTS[0], TESTS[2]]),
        (["docs/chart.md"], TESTS[2:]),
        (["docs/other.md"], []),
        ([TESTS[1]], TESTS[1:2]),
        (["docs/chart.md", PEAK], TESTS[1:]),
    ],
)
def test_tests_that_cover_a_changed_file_are_run(changed, expected):
    assert affected_tests(changed, KNOWN, TESTS) == expected


@pytest.mark.usefixtures("no_importers")
def test_a_test_file_that_was_never_recorded_is_run_with_any_change_of_the_package():
    assert affected_tests([PEAK], {TESTS[1]: KNOWN[TESTS[1]]}, TESTS) == TESTS
    assert affected_tests(["docs/other.md"], {}, TESTS) == []


def test_what_a_module_defines_reaches_those_that_import_it(monkeypatch):
    monkeypatch.setattr(selection, "direct_importers", lambda path: {PEAK} if path == ARCS else set())
    assert affected_tests([ARCS], KNOWN, TESTS) == TESTS


def test_a_new_file_is_covered_by_name_and_by_its_package():
    existing = ["tests/verdict/test_verdict_of_changes.py", "tests/chart/test_arcs.py", "tests/loop/test_hold.py"]
    assert files_that_name("src/zwidth/chart/unheard_of.py", existing) == {"tests/chart/test_arcs.py"}
    assert "tests/loop/test_hold.py" in files_that_name("src/zwidth/loop/unheard_of.py", existing)


def test_importers_are_found_by_the_full_name_of_a_module_unless_they_import_functions_alone(
    tmp_path, monkeypatch
):
    package = tmp_path / "src/zwidth/chart"
    package.mkdir(parents=True)
    (package / "area.py").write_text("LIMIT = 1\ndef area(): pass\nclass Area: pass\n")
    importing = {
        "function": "from zwidth.chart.area import area\n",
        "constant": "def f():\n    from zwidth.chart.area import (\n        LIMIT,\n        area,\n    )\n",
        "thing": "from zwidth.chart.area import Area\n",
        "module": "from zwidth.chart import area\n",
        "whole": "import zwidth.chart.area\n",
        "other": "from zwidth.loop.area import LIMIT\n",
    }
    for name, text in importing.items():
        (package / f"{name}.py").write_text(text)
    monkeypatch.setattr(selection, "ROOT", tmp_path)
    found = {Path(path).stem for path in selection.direct_importers(AREA)}
    assert found == {"constant", "thing", "module", "whole"}
    (package / "area.py").unlink()
    assert "src/zwidth/chart/function.py" in selection.direct_importers(AREA)


# --- the quick choice -------------------------------------------------------------------------------


def functions(*names: str, package: str = "chart") -> set[str]:
    return {f"src/zwidth/{package}/area.py:{name}" for name in names}


def test_quick_covers_most_functions_for_its_time():
    f = "tests/chart/f.py"
    tests = {
        f"{f}::slow": RecordedTest(5.0, functions("a", "b", "c")),
        f"{f}::first": RecordedTest(1.0, functions("a", "b")),
        f"{f}::second": RecordedTest(1.0, functions("c")),
        f"{f}::again": RecordedTest(1.0, functions("a")),
    }
    record = {f: RecordedFile(8.0, set(), tests)}
    assert best_choice(record, Choice(2.5), per_file=0.1) == [f"{f}::first", f"{f}::second"]
    assert best_choice(record, Choice(0.5), per_file=0.1) == []
    assert best_choice(record, Choice(100.0), per_file=0.1) == sorted(tests)


def test_one_more_file_costs_its_import():
    f, g = "tests/chart/f.py", "tests/chart/g.py"
    record = {
        f: RecordedFile(
            1.0,
            set(),
            {f"{f}::one": RecordedTest(0.1, functions("a", "b")), f"{f}::two": RecordedTest(0.1, functions("c"))},
        ),
        g: RecordedFile(1.0, set(), {f"{g}::other": RecordedTest(0.1, functions("d"))}),
    }
    assert best_choice(record, Choice(0.75), per_file=0.5) == [f"{f}::one", f"{f}::two"]


def test_a_fixture_of_several_tests_costs_once():
    f, shared = "tests/chart/f.py", {"tests/chart/f.py::chart None": 2.0}
    tests = {
        f"{f}::one": RecordedTest(0.1, functions("a", "b"), shared),
        f"{f}::two": RecordedTest(0.1, functions("c", "d"), shared),
        f"{f}::alone": RecordedTest(0.5, functions("e")),
    }
    record = {f: RecordedFile(3.0, set(), tests)}
    assert best_choice(record, Choice(1.0), per_file=0.1) == [f"{f}::alone"]
    assert best_choice(record, Choice(2.9), per_file=0.1) == sorted(tests)


def test_a_test_of_another_package_counts_little():
    f, g = "tests/show/f.py", "tests/chart/g.py"
    record = {
        f: RecordedFile(1.0, set(), {f"{f}::drawn": RecordedTest(1.0, functions("a", "b"))}),
        g: RecordedFile(1.0, set(), {f"{g}::judged": RecordedTest(1.0, functions("a"))}),
    }
    assert best_choice(record, Choice(1.5), per_file=0.1) == [f"{g}::judged"]
    assert best_choice(record, Choice(3.0), per_file=0.1) == [f"{g}::judged", f"{f}::drawn"]


def test_a_choice_may_be_of_some_packages():
    record = {
        f"tests/{package}/f.py": RecordedFile(
            1.0, set(), {f"tests/{package}/f.py::a": RecordedTest(0.1, functions("a", package=package))}
        )
        for package in ("chart", "loop")
    }
    assert best_choice(record, Choice(9.0, ("loop",)), per_file=0.1) == ["tests/loop/f.py::a"]


def test_of_the_files_only_the_tests_of_the_choice_run_and_those_that_are_gone_end_no_run(tmp_path):
    test, chosen = tmp_path / "test_one.py", tmp_path / "chosen.txt"
    test.write_text("def test_a(): pass\ndef test_b(): assert False\n")
    chosen.write_text("test_one.py::test_a\ntest_one.py::test_that_never_was[1]\n")
    environment = os.environ | {CHOSEN: str(chosen), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tests.verdict.chosen", "-p", "no:cacheprovider", test]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    assert "1 passed, 1 deselected" in done.stdout


def test_files_that_are_gone_are_left_out():
    own = "tests/verdict/test_verdict_of_changes.py"
    assert files_of([f"{own}::test_a", f"{own}::test_b[1]", "tests/test_that_never_was.py::test_c"]) == [own]


# --- the longer studies -----------------------------------------------------------------------------

STUDIES = ["tests/chart/test_a.py", "tests/loop/test_b.py", "tests/model/test_c.py", "tests/study/test_d.py"]
SECONDS = dict.fromkeys(STUDIES, 100.0)


def test_studies_of_changed_packages_come_first():
    assert choose_studies(STUDIES, SECONDS, {"study"}, 0, 250.0) == [STUDIES[3], STUDIES[0]]


def test_the_others_have_their_turn():
    chosen = [choose_studies(STUDIES, SECONDS, set(), turn, 100.0) for turn in range(4)]
    assert [one for (one,) in chosen] == STUDIES


def test_a_study_that_takes_too_long_leaves_its_place_to_others():
    assert choose_studies(STUDIES, SECONDS | {STUDIES[0]: 500.0}, {"chart"}, 0, 200.0) == STUDIES[1:3]


@pytest.mark.parametrize(
    ("body", "seconds", "outcome"),
    [
        ("pass", 300.0, "passed"),
        ("assert False", 300.0, "failed"),
        ("import time; time.sleep(600)", 0.1, "not finished"),
        ("pass", 0.0, "not begun"),
    ],
)
def test_a_study_without_a_verdict_is_not_a_failed_one(tmp_path, body, seconds, outcome):
    file = tmp_path / "test_study.py"
    file.write_text(f"import pytest\n@pytest.mark.slow\ndef test_one():\n    {body}\n")
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = slow\n")
    assert run_studies([str(file)], seconds) == {str(file): outcome}


def test_a_long_run_names_its_slowest_files_and_tests():
    reports = {
        "passed": [
            SimpleNamespace(nodeid="a.py::one", duration=50.0),
            SimpleNamespace(nodeid="b.py::t", duration=8.0),
        ],
        "": [SimpleNamespace(nodeid="a.py::one", duration=4.0)],
        "warnings": [SimpleNamespace(nodeid=None)],
    }
    files, tests = slowest_lines(reports)
    assert files == "slowest files of 62 s: a.py 54, b.py 8"
    assert tests == "slowest tests of 62 s: a.py::one 54, b.py::t 8"
    assert slowest_lines({"passed": reports["passed"]}) == []


# --- recording --------------------------------------------------------------------------------------

SCRIPT = """
import json
from tests.verdict.executed import ExecutionRecord
record = ExecutionRecord()
record.start()
import zwidth.chart.arcs
own = set()
record.swap(own)
from zwidth.device.load import load
load("five-bar")
record.swap(set())
print(json.dumps([sorted(record.functions(own)), sorted(record.read_files)]))
"""


def test_functions_that_ran_and_files_that_were_read_are_recorded():
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "src")])}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )
    functions, files = json.loads(done.stdout)
    assert any(name.startswith("src/zwidth/device/load.py:load") for name in functions)
    assert not any("chart/arcs.py" in name for name in functions)
    assert not any(name.endswith(("<module>", ":Device")) for name in functions), "these are imported"
    assert "src/zwidth/device/zoo/five-bar.toml" in files


def test_kernels_that_a_function_names_count_as_executed():
    from zwidth.chart.arcs import sample_arcs

    names: dict[str, object] = {"kernel": SimpleNamespace(py_func=sample_arcs)}
    exec("def caller(): kernel()", names)
    code = names["caller"].__code__
    record = ExecutionRecord()
    record._places[id(code)] = (code, names)
    assert "src/zwidth/chart/arcs.py:sample_arcs" in record.functions({id(code)})


def test_kernels_of_a_table_and_of_a_module_that_a_function_imports_count_as_executed():
    from zwidth.chart.arcs import sample_arcs

    names: dict[str, object] = {"TABLE": {"one": SimpleNamespace(py_func=sample_arcs)}}
    exec("def by_table(): TABLE['one']()", names)
    exec("def by_import():\n    from zwidth.model.rotations import fill_rotation\n    fill_rotation()", names)
    import_module("zwidth.model.rotations")
    record = ExecutionRecord()
    for name, kernel in {
        "by_table": "chart/arcs.py:sample_arcs",
        "by_import": "rotations.py:fill_rotation",
    }.items():
        code = names[name].__code__
        record._places[id(code)] = (code, names)
        assert any(found.endswith(kernel) for found in record.functions({id(code)}))


def test_the_function_of_an_environment_counts_where_its_parameters_are_asked_for():
    from zwidth.contact import friction_patch, texture

    record, seen = ExecutionRecord(), set()
    record.swap(seen)
    before = sys.gettrace()
    sys.settrace(record._called)
    try:
        friction_patch.values()
    finally:
        sys.settrace(before)
    found = record.functions(seen)
    assert "src/zwidth/contact/environments/surface_patterns.py:friction_patch" in found
    assert not any(texture.function.__name__ in name for name in found)


def test_each_test_is_recorded_with_its_time(tmp_path):
    test = tmp_path / "test_one.py"
    test.write_text(
        "import pytest\nfrom time import process_time\nfrom zwidth.device.load import load\n"
        "@pytest.fixture(scope='module')\ndef busy():\n    end = process_time() + 0.2\n"
        "    while process_time() < end: pass\n"
        "def test_load(busy): assert load('five-bar').name\n"
    )
    environment = os.environ | {
        RECORD: str(tmp_path),
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "src")]),
    }
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "tests.verdict.recorder",
        "-p",
        "no:cacheprovider",
        test,
    ]
    subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True)
    lines = [json.loads(line) for file in tmp_path.glob("*.jsonl") for line in file.read_text().splitlines()]
    (line,) = [line for line in lines if line["test"] is not None]
    assert line["test"].endswith("test_one.py::test_load")
    assert line["seconds"] > 0.0
    (seconds,) = line["shared"].values()
    assert seconds >= 0.15
    assert any("device/load.py" in name for name in line["functions"])


def ended(test, outcome="passed", figures="", seconds=60.0):
    return {
        "test": f"tests/chart/test_a.py::{test}",
        "outcome": outcome,
        "seconds": seconds,
        "figures": figures,
        "commit": "abc",
        "day": "2026-01-01",
    }


def test_the_last_outcome_of_each_test_counts_and_numbers_by_name_are_added():
    earlier = kept_with({}, [ended("test_x[0]", "failed"), ended("test_x[1]", figures="{'walls': 900}")])
    later = [
        ended("test_y", "failed", figures="17 of 20"),
        ended("test_x[0]", figures="{'walls': 200, 'refused': 1}"),
    ]
    studies = kept_with(json.loads(text_of(earlier)), later)
    assert json.loads(text_of(studies)) == studies
    x, y = map(summary_of, studies.values())
    assert (x["passed"], x["failed"], x["seconds"]) == (2, 0, 120.0)
    assert (y["passed"], y["failed"]) == (0, 1)
    page = page_of(studies, dict.fromkeys(studies, 3) | {"tests/chart/test_a.py::test_z": 1})
    row_x, row_y = (line for line in page.splitlines() if "(../tests/chart/test_a.py)" in line)
    assert [cell.strip() for cell in row_x.split("|")][2:5] == ["2 of 3", "walls 1 100, refused 1", "2.0"]
    assert "1 failed" in row_y
    assert "17 of 20" in row_y


def test_a_record_is_read_as_it_was_written(tmp_path, monkeypatch):
    monkeypatch.setattr("tests.verdict.recording.RECORDED", tmp_path / "recorded.json")
    assert read_recorded() == {}
    write_recorded(KNOWN)
    assert read_recorded() == KNOWN
