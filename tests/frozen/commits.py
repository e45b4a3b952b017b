"""Sources of two commits, each in a folder of its own with the kernels compiled from it."""

from __future__ import annotations

import hashlib
import platform
import sys
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.metadata import distributions
from pathlib import Path

from tests.revisions import ROOT, export, git, tree_of

CACHE = ROOT / "out" / "record"
Environment = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class CommitSources:
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


def commit_sources(label: str, environment: Environment, repeat: bool = False) -> CommitSources:
    """The sources of a commit, exported unless they are there.

    Folders are named by the tree of "src": commits with the same sources share what was compiled and answered.
    repeat: keep the answers apart from those of the same sources on the other side.
    Raises SystemExit where git knows no such commit.
    """
    tree = tree_of(label)
    sources = git("rev-parse", f"{tree}:src")
    folder = CACHE / sources[:16]
    export({"src": tree, "pyproject.toml": tree}, folder)
    project = tomllib.loads((folder / "pyproject.toml").read_text())
    answers = folder / f"answers-{installation(environment)}{'-repeat' * repeat}.jsonl"
    return CommitSources(label, folder, project["project"]["scripts"]["zwidth"], answers, environment)


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
