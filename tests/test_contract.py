"""Every promise of docs/contract.md is tried: commands, keys, exit codes, options, files, Python."""

from __future__ import annotations

import re
import shlex
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import zwidth
from tests.cli.command_runner import CommandResult, parse_strict_json, run_command
from tests.cli.test_cli_import import ARM
from tests.identify.spring_bench import bench_record
from tests.undrawn_figures import leave_undrawn
from zwidth.measures import MEASURES
from zwidth.show import csv_text
from zwidth.show import zwidth as group

PAGE = (Path(__file__).parents[1] / "docs" / "contract.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"^`([\w.-]+)`:\n\n```toml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
TIMES = np.geomspace(0.5, 400.0, 200)


def section(heading: str) -> str:
    return PAGE.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]


def rows(heading: str) -> list[list[str]]:
    """Cells of a section's tables, their headings and lines left out."""
    lines = re.findall(r"^\| (.*) \|$", section(heading), re.MULTILINE)
    return [cells for line in lines if "`" in (cells := line.split(" | "))[0] or cells[0].isdigit()]


def quoted(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def code(heading: str, language: str) -> str:
    (text,) = re.findall(rf"^```{language}\n(.*?)^```", section(heading), re.MULTILINE | re.DOTALL)
    return str(text)


def at(document, path: str) -> list[object]:
    """The values at a path such as `a[].b`."""
    values = [document]
    for part in path.split("."):
        name = part.removesuffix("[]")
        values = [value[name] for value in values]
        if part.endswith("[]"):
            values = [inner for value in values for inner in value]
            assert values, f"nothing in {path}"
    return values


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of the page's examples, as the working folder."""
    folder = tmp_path_factory.mktemp("contract")
    for name, text in FILES.items():
        (folder / name).write_text(text)
    response = -1.0 / (0.05 * (2.0 * np.pi * TIMES) ** 2) * np.exp(-2j * np.pi * TIMES * 0.0005)
    columns = zip(TIMES, response.real, response.imag, strict=True)
    lines = [",".join(map(repr, map(float, line))) for line in columns]
    (folder / "response.csv").write_text("\n".join(["frequency_Hz,real_m_per_N,imag_m_per_N", *lines]))
    (folder / "walls.csv").write_text("stiffness_N_per_m,damping_Ns_per_m\n200,1\n9000,10\n")
    record = bench_record(1, forward=0.45, friction=0.003, amplitude=0.045)
    (folder / "strokes.csv").write_text(csv_text(record))
    (folder / "arm.xml").write_text(ARM)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        leave_undrawn(patch)
        patch.setattr("zwidth.show.cli.first_use.compile_kernels", lambda: 0)  # compiling is tried elsewhere
        patch.setattr("zwidth.contact.boundary_experiment.ZOOMS", 1)
        yield folder


@cache
def answer(line: str) -> CommandResult:
    """What a command of the page prints with --json; each is run once."""
    words = shlex.split(line)
    assert words[0] == "zwidth"
    return run_command(*words[1:], "--json")


def document(line: str):
    ran = answer(line)
    assert (ran.code, ran.err) == (0, "")
    return parse_strict_json(ran.out)


COMMANDS = {row[0].strip("`"): quoted(row[1]) for row in rows("Commands and keys") if row[0].startswith("`zwidth")}


@pytest.mark.parametrize("line", COMMANDS)
def test_a_command_prints_its_keys_as_one_strict_object(folder, line):
    found = document(line)
    for key in COMMANDS[line]:
        at(found, key)


def test_every_command_of_the_page_is_one_and_has_its_options():
    for line in re.findall(r"`zwidth (.+?)`", PAGE):
        command = group.commands[line.split()[0]]
        known = {
            name
            for one in (command, *getattr(command, "commands", {}).values())
            for option in one.params
            for name in option.opts
        } | {"--help"}
        assert set(re.findall(r"--[\w-]+", line)) <= known


def test_words_among_the_values(folder):
    """The words that come out are on the page, and an unstable wall is called so."""
    verdicts = at(document("zwidth check paddle.toml --points walls.csv"), "points[].verdict")
    assert verdicts == ["stable", "unstable"]
    allowed = {row[0]: quoted(row[1]) for row in rows("Commands and keys") if not row[0].startswith("`zwidth")}
    for cell, words in allowed.items():
        key = quoted(cell)[0]
        line = next(line for line in COMMANDS if key in COMMANDS[line])
        values = at(document(line), key)
        assert set(values) <= set(words)


@pytest.mark.parametrize(("code", "line"), [(int(row[0]), row[2].strip("` ")) for row in rows("Output")])
def test_exit_codes(folder, monkeypatch, code, line):
    raised = {70: RuntimeError("a fault"), 130: KeyboardInterrupt()}.get(code)
    if raised:

        def fail(shelf):
            raise raised

        monkeypatch.setattr("zwidth.device.read.bundled", fail)
    ran = run_command("devices", "--json") if raised else answer(line)
    assert ran.code == code
    if code in (0, 1):
        assert parse_strict_json(ran.out).get("reason", "") if code else not ran.err
    else:
        assert (ran.out, bool(ran.err)) == ("", True)


def test_a_chart_without_a_stable_wall_is_no_answer(folder):
    (line,) = re.findall(r"`(zwidth chart .*?)` has none", section("Output"))
    ran = answer(line)
    assert (ran.code, parse_strict_json(ran.out)["decided"]) == (1, True)
    assert parse_strict_json(ran.out)["stiffness_max_N_per_m"] is None


def test_the_wall_pushes_as_the_page_says(folder):
    (line,) = [line for line in COMMANDS if line.startswith("zwidth simulate")]
    run = document(line.replace("one-sided", "two-sided"))
    K, B = run["wall_stiffness_N_per_m"], run["wall_damping_Ns_per_m"]
    expected = -(K * np.array(run["position_m"]) + B * np.array(run["velocity_m_per_s"]))
    assert np.ptp(expected) > 0.0
    np.testing.assert_allclose(run["force_N"], expected, rtol=1e-9, atol=1e-12)


def test_what_does_not_apply_is_null_and_a_rigid_mode_is_0(folder):
    shown = document("zwidth show paddle.toml")
    assert set(COMMANDS["zwidth show five-bar"]) <= set(shown)
    assert (shown["jacobian"], shown["isotropy"], shown["natural_frequencies_Hz"]) == (None, None, [0.0])


def test_the_charts_keys(folder):
    """All are there; rings are closed and counter-clockwise, arcs have lists of one length."""
    chart = document("zwidth chart paddle.toml")
    for key in [key for row in rows("The chart") for key in quoted(row[0])]:
        at(chart, key)
    for ring in map(np.array, chart["regions"]):
        assert np.all(ring[0] == ring[-1])
        assert np.sum(ring[:-1, 0] * ring[1:, 1] - ring[1:, 0] * ring[:-1, 1]) > 0.0
    for arc in chart["boundary"]:
        assert len({len(values) for values in arc.values()}) == 1
    assert chart["frequency_at_stiffness_max_Hz"] == min(chart["frequencies_at_stiffness_max_Hz"])
    inside = [ring for ring in chart["regions"] if max(point[0] for point in ring) > 0.0]
    assert max(point[0] for ring in inside for point in ring if point[1] >= 0.0) == pytest.approx(
        chart["stiffness_max_N_per_m"], rel=1e-3
    )


@pytest.mark.parametrize("row", rows("Options"), ids=lambda row: row[0])
def test_an_option_is_taken(folder, row):
    option, line = quoted(row[0])[0].split()[0], quoted(row[2])[0]
    assert f" {option} " in line
    document(line)


def test_settings_go_to_where_the_page_says(folder):
    """A list's element by name, and the other of two exclusive keys is dropped."""
    (line,) = [quoted(row[2])[0] for row in rows("Options") if "--set" in row[0]]
    assert document(line)["delay_samples"] == pytest.approx(0.001 / document(line)["sampling_period_s"])
    assert document(line)["mass_matrix"] != document("zwidth show five-bar")["mass_matrix"]
    assert document("zwidth show paddle.toml --set loop.delay_s=unset")["delay_samples"] == 0.0


def misspelt(text: str) -> Iterator[tuple[str, str]]:
    """Each key of a file, spelt otherwise, and the file with it."""
    text = re.sub(r" *#.*", "", text)
    for found in re.finditer(r"\b[A-Za-z]\w*(?= =|\])", text):
        yield f"{found[0]}_x", f"{text[: found.end()]}_x{text[found.end() :]}"


@pytest.mark.parametrize(("file", "least"), [("paddle.toml", 10), ("two-mass.toml", 30), ("measured.toml", 5)])
def test_a_device_files_keys_are_taken_and_none_is_ignored(folder, file, least):
    assert zwidth.load(folder / file).name == tomllib.loads(FILES[file])["name"]
    assert refused_keys(folder, file, "chart") >= least


def test_no_key_of_a_study_file_is_ignored(folder):
    assert refused_keys(folder, "study.toml", "optimise") >= 12


def refused_keys(folder: Path, file: str, command: str) -> int:
    """How many keys a file has; a file is refused where one of them is spelt otherwise, and the key named."""
    count = 0
    for key, text in misspelt(FILES[file]):
        (folder / "misspelt.toml").write_text(text)
        ran = run_command(command, "misspelt.toml")
        assert (ran.code, ran.out) == (2, ""), key
        assert key.removesuffix("_x") in ran.err
        count += 1
    return count


def test_a_setting_of_an_unknown_key_is_bad_input(folder):
    ran = answer("zwidth chart paddle.toml --set loop.velocity.sample=2")
    assert (ran.code, ran.out) == (2, "")
    assert "sample" in ran.err


def test_bundled_names_stay():
    (names,) = re.findall(r"^(`.*`) are bundled", section("Device files"), re.MULTILINE)
    bundled = {device["name"] for device in document("zwidth devices")["devices"]}
    assert set(quoted(names)) <= bundled
    assert len(quoted(names)) == 3


def test_a_studys_designs_are_the_grid(folder):
    designs = document("zwidth sweep study.toml")["designs"]
    assert [design["plant.mass_kg"] for design in designs] == pytest.approx([0.04, 0.05, 0.06])


def test_measures_keep_their_names():
    names = quoted(section("Study files").partition("these\nnames stay:")[2])
    assert len(names) > 10
    assert set(names) <= set(MEASURES)


def test_the_exported_header_declares_the_functions(folder):
    document("zwidth export two-mass.toml --output walls.h")
    header = " ".join((folder / "walls.h").read_text().split())
    declarations = code("The exported header", "c").split("\n")[:-1]
    assert len(declarations) == 2
    for declaration in declarations:
        assert f" {declaration}" in header


def test_the_python_lines_work(folder):
    names: dict[str, object] = {}
    try:
        exec(compile(code("Python", "python"), "contract.md", "exec"), names)
    finally:
        plt.close("all")
    assert isinstance(names["point"], zwidth.OperatingPoint)
    assert isinstance(names["axes"], plt.Axes)
    assert isinstance(names["results"], xr.Dataset)
    assert set(names["results"]) >= {"stiffness_max", "isotropy"}
    assert names["slower"].at().loop.period == 0.002
