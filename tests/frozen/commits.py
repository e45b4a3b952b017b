"""Sources of two commits, each in a folder of its own with the kernels compiled from it."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.metadata import distributions
from pathlib import Path

ROOT = Path(__file__).parents[2]
CACHE = ROOT / "out" / "record"
WORKING_TREE = "."
Environment = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Side:
    """One of the two that are compared.

    label        what was asked for: a commit, or "." for the working tree
    folder       with its sources below "src", kernels beside them
    entry        its console script, MODULE:FUNCTION
    answers      the file of its answers
    environment  variables set for its processes besides
    """

    label: str
    folder: Path
    entry: str
    answers: Path
    environment: Environment


def side(label: str, environment: Environment, repeat: bool = False) -> Side:
    """The sources of a commit, exported unless they are there.

    Folders are named by the tree of "src": commits with the same sources share what was compiled and answered.
    repeat: keep the answers apart from those of the same sources on the other side.
    Raises SystemExit where git knows no such commit.
    """
    tree = _tree(label)
    sources = _git("rev-parse", f"{tree}:src")
    folder = CACHE / sources[:16]
    if not (folder / "complete").exists():
        folder.mkdir(parents=True, exist_ok=True)
        archive = subprocess.run(
            ["git", "archive", tree, "src", "pyproject.toml"], cwd=ROOT, stdout=subprocess.PIPE, check=True
        )
        subprocess.run(["tar", "-x", "-C", str(folder)], input=archive.stdout, check=True)
        (folder / "complete").touch()
    project = tomllib.loads((folder / "pyproject.toml").read_text())
    answers = folder / f"answers-{installation(environment)}{'-repeat' * repeat}.jsonl"
    return Side(label, folder, project["project"]["scripts"]["zwidth"], answers, environment)


def installation(environment: Environment) -> str:
    """A name for all but the sources that numbers may depend on: interpreter, packages, processor, variables."""
    parts = [sys.version, platform.machine(), _processor(), *_packages(), *map(str, sorted(environment))]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:12]


@cache
def _packages() -> list[str]:
    return sorted(f"{found.name}=={found.version}" for found in distributions() if found.name != "zwidth")


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return "\n".join(sorted({line for line in lines if line.startswith(("model name", "flags"))}))


def _tree(label: str) -> str:
    """The tree of a commit, or of the working tree with all that git does not ignore."""
    if label != WORKING_TREE:
        return _git("rev-parse", "--verify", "--quiet", f"{label}^{{tree}}")
    with tempfile.TemporaryDirectory() as folder:
        own_index = {"GIT_INDEX_FILE": str(Path(folder) / "index")}
        _git("read-tree", "HEAD", **own_index)
        _git("add", "--all", **own_index)
        return _git("write-tree", **own_index)


def _git(*words: str, **environment: str) -> str:
    done = subprocess.run(
        ["git", *words], cwd=ROOT, env={**os.environ, **environment}, capture_output=True, text=True
    )
    if done.returncode:
        raise SystemExit(f"git {' '.join(words)}: {done.stderr.strip() or 'no such commit'}")
    return done.stdout.strip()
