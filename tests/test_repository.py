"""The house: versions and pins agree, links lead somewhere, what the README says to type exists."""

from __future__ import annotations

import datetime
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

import zwidth
from tests.cli.command_runner import run_command as run_zwidth
from tests.pages import links, sections

ROOT = Path(__file__).parent.parent
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = SETTINGS["project"]
REQUIREMENTS = [
    *PROJECT["dependencies"],
    *PROJECT["optional-dependencies"]["test"],
    *SETTINGS["build-system"]["requires"],
]
FOLDERS = ("src", "tests", "docs", "gallery", "benchmarks")
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])
needs_make = pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")


def short(path: Path) -> str:
    return str(path.relative_to(ROOT))


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def pins() -> dict[str, Requirement]:
    lines = [line for line in text("constraints.txt").splitlines() if line and not line.startswith("#")]
    return {canonicalize_name(pin.name): pin for pin in map(Requirement, lines)}


def required_packages(names: list[str]) -> set[str]:
    """The named requirements and all that they need on this machine, the installed ones followed.

    One that is installed in another version than its pin may need others, which are not asked for.
    """
    found: set[tuple[str, frozenset[str]]] = set()
    queue = [Requirement(name) for name in names]
    while queue:
        requirement = queue.pop()
        extras = requirement.extras or {""}
        if requirement.marker and not requirement.marker.evaluate({"extra": ""}):
            continue
        key = (canonicalize_name(requirement.name), frozenset(extras))
        if key in found:
            continue
        found.add(key)
        try:
            inner = [Requirement(line) for line in requires(requirement.name) or []]
        except PackageNotFoundError:  # the build backend stays in pip's own environment
            continue
        pin = pins().get(canonicalize_name(requirement.name))
        if pin is not None and not pin.specifier.contains(version(requirement.name)):
            continue
        for one in inner:
            if one.marker is None or any(one.marker.evaluate({"extra": extra}) for extra in extras):
                one.marker = None
                queue.append(one)
    return {name for name, _ in found}


# --- pins -------------------------------------------------------------------------------------------


def test_every_pin_is_one_exact_version_and_no_address():
    for pin in pins().values():
        assert pin.url is None
        assert re.fullmatch(r"==[\w.+!-]+", str(pin.specifier)), pin
    assert "://" not in text("constraints.txt")


def test_everything_that_is_installed_for_zwidth_is_pinned():
    assert required_packages(REQUIREMENTS) - set(pins()) == set()


@pytest.mark.parametrize("requirement", REQUIREMENTS)
def test_a_pin_meets_its_requirement(requirement):
    wanted = Requirement(requirement)
    (pinned,) = pins()[canonicalize_name(wanted.name)].specifier
    assert wanted.specifier.contains(pinned.version)


@pytest.mark.parametrize("name", ["Makefile", "pyproject.toml", ".ci/run"])
def test_nothing_is_fetched_by_address(name):
    assert "://" not in text(name)


# --- one version ------------------------------------------------------------------------------------


def test_one_version_everywhere():
    cited = re.search(r"^version: (.+)$", text("CITATION.cff"), re.MULTILINE)
    changes = re.findall(r"^## \[?([0-9.]+)\]?", text("CHANGELOG.md"), re.MULTILINE)
    assert cited
    assert {zwidth.__version__, version("zwidth"), cited[1], changes[0]} == {PROJECT["version"]}


def test_the_citation_says_when_and_who():
    released = re.search(r'^date-released: "?(\d{4}-\d\d-\d\d)"?$', text("CITATION.cff"), re.MULTILINE)
    logged = re.search(rf"^## \[?{re.escape(PROJECT['version'])}\]? - (\S+)$", text("CHANGELOG.md"), re.MULTILINE)
    assert released
    assert logged
    assert datetime.date.fromisoformat(released[1]) == datetime.date.fromisoformat(logged[1])
    assert f'name: "{PROJECT["authors"][0]["name"]}"' in text("CITATION.cff")


# --- pages ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", PAGES, ids=short)
def test_every_link_leads_somewhere(page):
    """To a file of the repository, and to a heading where it names one."""
    for target in links(page):
        name, _, anchor = target.partition("#")
        file = page.parent / name if name else page
        assert file.exists(), target
        assert not anchor or anchor in sections(file), target
        assert ROOT in file.resolve().parents or file.resolve() == ROOT, f"{target} leads out of the repository"


def test_links_are_found_and_anchors_spelled(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "# Loss factors, K (1 + i eta)\n# `a`\n# a\n```\n# no heading\n[x](none)\n```\n[y](z.md#w)\n[r]: to\n"
    )
    assert set(sections(page)) == {"loss-factors-k-1--i-eta", "a", "a-1"}
    assert links(page) == ["z.md#w", "to"]


def test_the_lowest_versions_are_those_that_the_package_allows():
    """Each dependency with its lower bound, in the file that the tests are also run with."""
    lines = [line for line in text("constraints-lowest.txt").splitlines() if not line.startswith("#")]
    wanted = {
        canonicalize_name(Requirement(name).name): Requirement(name).specifier for name in PROJECT["dependencies"]
    }
    lowest = {canonicalize_name(pin.name): pin.specifier for pin in map(Requirement, lines)}
    assert lowest.keys() >= wanted.keys()
    for name, (bound,) in wanted.items():
        (pin,) = lowest[name]
        assert (bound.operator, pin.operator) == (">=", "=="), name
        assert Version(bound.version) == Version(pin.version), name


def test_the_index_leads_to_every_page():
    linked = set(re.findall(r"\]\(([\w-]+\.md)\)", text("docs/index.md")))
    assert linked == {page.name for page in (ROOT / "docs").glob("*.md")} - {"index.md"}


def readme_commands(first: str) -> list[str]:
    """The README's shell lines that begin with the word `first`, without their comments."""
    blocks = re.findall(r"^```sh\n(.*?)^```", text("README.md"), re.MULTILINE | re.DOTALL)
    lines = [line.partition(" #")[0].strip() for line in "".join(blocks).splitlines()]
    return [line for line in lines if line.split()[:1] == [first]]


def readme_numbers(line: str) -> list[str]:
    """Numbers with units that the README's comment beside a command gives, or the paragraph below for the last."""
    page = text("README.md")
    beside = re.search(rf"^{re.escape(line)} +# (.*)$", page, re.MULTILINE)
    about = beside[1] if beside else page.partition("The third line ")[2] if "motor-right" in line else ""
    return re.findall(r"[\d.]+ k?(?:N/m|Hz|cm²)", about.partition("\n\n")[0])


# `zwidth compile` runs in test_first_use; the workbench goes on until ctrl-C, and runs in tests/app
ELSEWHERE = ("zwidth compile", "zwidth app five-bar")


@pytest.mark.parametrize("line", [one for one in readme_commands("zwidth") if one not in ELSEWHERE])
def test_a_command_of_the_readme_runs(line, tmp_path, monkeypatch):
    (device,) = re.findall(r"^```toml\n(.*?)^```", text("README.md"), re.MULTILINE | re.DOTALL)
    (tmp_path / "my-paddle.toml").write_text(device)
    monkeypatch.chdir(tmp_path)
    ran = run_zwidth(*shlex.split(line)[1:])
    assert ran.code == 0, ran.err
    assert ran.out
    for number in readme_numbers(line):
        assert number in ran.out
    outputs = re.findall(r"--output (\S+)", line)
    assert all((tmp_path / name).stat().st_size > 1000 for name in outputs)


@pytest.mark.parametrize(("period", "helps"), [(None, False), ("0.0001", True)])
def test_a_stiffer_drive_helps_where_the_readme_says(period, helps):
    assert "every 0.1 ms it would help" in text("README.md")
    sampled = [f"loop.sampling_period_s={period}"] if period else []
    reached = []
    for more in ([], ["drives.motor-right.stiffness_Nm_per_rad=0.9"]):
        device = zwidth.load("five-bar", [*sampled, *more])
        reached.append(zwidth.largest_stiffness(device.at().loop).stiffness)
    assert (reached[1] > reached[0]) == helps


TARGETS = ("help", "affected", "slow", "lint", "stubs", "bench", "docs", "record", "structure", "bench-pairs")


@needs_make
@pytest.mark.parametrize(
    "line",
    [
        *readme_commands("make"),
        *(f"make {name}" for name in TARGETS),
    ],
)
def test_make_knows_the_target(line):
    done = subprocess.run(
        ["make", "--dry-run", *line.split()[1:]], cwd=ROOT, env=clean_environment(), capture_output=True
    )
    assert done.returncode == 0, done.stderr


def test_the_readme_has_its_two_commands():
    assert {"make report", "make test"} <= set(readme_commands("make"))
    assert readme_commands("zwidth")


def test_the_text_knows_no_machine_and_leaves_no_note_behind():
    """No file names a folder of one person's machine or holds a note of work left to do."""
    forbidden = re.compile(r"(?<![\w.}])/(?:home|root|Users|wor[k])/|\b(?:TOD[O]|FIXM[E]|XX[X])\b|\bissue #?\d")
    kinds = {".py", ".toml", ".md", ".html", ".css", ".js", ".cff"}
    files = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in kinds]
    files += [path for path in ROOT.iterdir() if path.is_file()]
    files = [path for path in files if "node_modules" not in path.parts]
    found = {short(path): forbidden.findall(path.read_text(encoding="utf-8")) for path in files}
    assert {path: words for path, words in found.items() if words} == {}


# --- make, and the rule that nothing is skipped -----------------------------------------------------


def clean_environment(**more: str) -> dict[str, str]:
    """This process's environment without what make and pytest hand down to their children."""
    return {
        key: value for key, value in os.environ.items() if not key.startswith(("MAKE", "MFLAGS", "PYTEST"))
    } | more


def make(folder: Path, target: str, python: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a target in a folder that holds what a fresh clone holds, as far as the set-up reads it."""
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, folder)
    command = ["make", "--silent", target, f"PYTHON={python}"]
    return subprocess.run(
        command, cwd=folder, env=clean_environment(**environment), capture_output=True, text=True
    )


@needs_make
@pytest.mark.parametrize("python", ["/no/such/python", "false"])
def test_make_says_in_one_sentence_that_python_is_missing(tmp_path, python):
    done = make(tmp_path, "report", python)
    sentence, *rest = done.stderr.splitlines()
    assert done.returncode != 0
    assert "needs Python 3.11 or newer" in sentence
    assert python in sentence
    assert all(line.startswith("make") for line in rest)
    assert not (tmp_path / ".venv").exists()


@needs_make
def test_make_says_in_one_sentence_that_no_environment_can_be_made(tmp_path):
    python = tmp_path / "python"
    python.write_text('#!/bin/sh\n[ "$1" = -c ]\n')  # new enough, but with no module to run
    python.chmod(0o755)
    done = make(tmp_path, "test", str(python))
    sentence, *rest = done.stderr.splitlines()
    assert done.returncode != 0
    assert "can make no virtual environment" in sentence
    assert all(line.startswith("make") for line in rest)
    assert not (tmp_path / ".venv").exists()


@pytest.mark.parametrize("workers", ["0", "1"])
@pytest.mark.parametrize(("value", "code"), [("1", 1), ("", 0)])
def test_a_skip_is_a_failure_where_asked(tmp_path, value, code, workers):
    shutil.copy(ROOT / "tests" / "conftest.py", tmp_path)
    (tmp_path / "test_one.py").write_text(
        "import pytest\n\ndef test_runs(): pass\n\ndef test_skips(): pytest.skip('no tool')\n"
    )
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-n", workers, "--rootdir", "."]
    environment = clean_environment(ZWIDTH_NO_SKIPS=value, PYTHONPATH=str(ROOT / "tests"))
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == code, done.stdout
    assert "1 passed, 1 skipped" in done.stdout
    assert ("1 skipped, each counts as a failure" in done.stdout) == bool(code)
