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

import zwidth

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
BUILD = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
FOLDERS = ("src", "tests", "docs", "gallery", "benchmarks")
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])
MAKE = shutil.which("make")


def short(path: Path) -> str:
    return str(path.relative_to(ROOT))


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def pins() -> dict[str, Requirement]:
    lines = [line for line in text("constraints.txt").splitlines() if line and not line.startswith("#")]
    return {canonicalize_name(pin.name): pin for pin in map(Requirement, lines)}


def needed(names: list[str]) -> set[str]:
    """The named requirements and all that they need on this machine, the installed ones followed."""
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
    wanted = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["test"], *BUILD]
    assert needed(wanted) - set(pins()) == set()


@pytest.mark.parametrize("requirement", [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["test"]])
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
    logged = re.search(
        rf"^## \[?{re.escape(PROJECT['version'])}\]? - (\S+)$", text("CHANGELOG.md"), re.MULTILINE
    )
    assert released
    assert logged
    assert datetime.date.fromisoformat(released[1]) == datetime.date.fromisoformat(logged[1])
    assert f'name: "{PROJECT["authors"][0]["name"]}"' in text("CITATION.cff")


# --- pages ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("page", PAGES, ids=short)
def test_every_link_leads_to_a_file(page):
    targets = re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))
    missing = [to for to in targets if "://" not in to and not (page.parent / to).exists()]
    assert missing == []


def commands(page: str) -> list[list[str]]:
    """The lines of a page's console blocks, split as a shell would."""
    blocks = re.findall(r"^```(?:sh|console|bash)\n(.*?)^```", text(page), re.MULTILINE | re.DOTALL)
    lines = "".join(blocks).replace("\\\n", " ").splitlines()
    return [shlex.split(line.removeprefix("$ "), comments=True) for line in lines if line.strip()]


def test_what_the_readme_says_to_type_exists():
    typed = [words for words in commands("README.md") if words]
    zwidth_commands = {words[1] for words in typed if words[0] == "zwidth"}
    targets = {words[1] for words in typed if words[0] == "make" and len(words) > 1}
    assert zwidth_commands
    assert {"report", "test"} <= targets
    listing = subprocess.run(
        [sys.executable, "-c", "from zwidth.show.cli.main import main; main()", "--help"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert {
        name for name in zwidth_commands if not re.search(rf"^\W*{name}\b", listing, re.MULTILINE)
    } == set()
    assert {name for name in targets if not re.search(rf"^{name}:", text("Makefile"), re.MULTILINE)} == set()


def test_the_text_knows_no_machine_and_leaves_no_note_behind():
    """No file names a folder of one person's machine or holds a note of work left to do."""
    forbidden = re.compile(
        r"(?<![\w.}])/(?:home|root|Users|wor[k])/|\b(?:TOD[O]|FIXM[E]|XX[X])\b|\bissue #?\d"
    )
    kinds = {".py", ".toml", ".md", ".html", ".css", ".js", ".cff"}
    files = [path for folder in FOLDERS for path in (ROOT / folder).rglob("*") if path.suffix in kinds]
    files += [path for path in ROOT.iterdir() if path.is_file()]
    found = {short(path): forbidden.findall(path.read_text(encoding="utf-8")) for path in files}
    assert {path: words for path, words in found.items() if words} == {}


# --- make, and the rule that nothing is skipped -----------------------------------------------------


@pytest.mark.skipif(MAKE is None, reason="make is not installed")
@pytest.mark.parametrize("python", ["/no/such/python", "false"])
def test_make_says_in_one_sentence_that_python_is_missing(tmp_path, python):
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    done = subprocess.run(
        [MAKE, "--silent", "report", f"PYTHON={python}"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode != 0
    sentence = done.stderr.splitlines()[0]
    assert "needs Python 3.11 or newer" in sentence
    assert python in sentence
    assert not (tmp_path / ".venv").exists()


@pytest.mark.skipif(MAKE is None, reason="make is not installed")
def test_make_says_in_one_sentence_that_no_environment_can_be_made(tmp_path):
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    python = tmp_path / "python"
    python.write_text('#!/bin/sh\n[ "$1" = -c ]\n')  # new enough, but with no module to run
    python.chmod(0o755)
    path = os.pathsep.join(["/usr/bin", "/bin"])
    done = subprocess.run(
        [MAKE, "--silent", "test", f"PYTHON={python}"],
        cwd=tmp_path,
        env={"PATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode != 0
    assert "can make no virtual environment" in done.stderr.splitlines()[0]
    assert not (tmp_path / ".venv").exists()


@pytest.mark.parametrize(("value", "code"), [("1", 1), ("", 0)])
def test_a_skip_is_a_failure_where_asked(tmp_path, value, code):
    shutil.copy(ROOT / "tests" / "conftest.py", tmp_path)
    (tmp_path / "test_one.py").write_text(
        "import pytest\n\ndef test_runs(): pass\n\ndef test_skips(): pytest.skip('no tool')\n"
    )
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "--rootdir",
        str(tmp_path),
        str(tmp_path),
    ]
    environment = {**os.environ, "ZWIDTH_NO_SKIPS": value}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == code, done.stdout
    assert "1 passed, 1 skipped" in done.stdout
    assert ("1 skipped, each counts as a failure" in done.stdout) == bool(code)
