"""Files of any commit, or of the working tree with all that git does not ignore."""

from __future__ import annotations

import io
import os
import subprocess
import tarfile
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
WORKING_TREE = "."


def git(*words: str, **environment: str) -> str:
    """What a git command prints, without the end of its last line. Raises SystemExit where it fails."""
    done = subprocess.run(
        ["git", *words], cwd=ROOT, env={**os.environ, **environment}, capture_output=True, text=True
    )
    if done.returncode:
        raise SystemExit(f"git {' '.join(words)}: {done.stderr.strip() or 'no such commit'}")
    return done.stdout.strip()


def tree_of(label: str) -> str:
    """The tree of a commit, or of the working tree where the label is "."."""
    if label != WORKING_TREE:
        return git("rev-parse", "--verify", "--quiet", f"{label}^{{tree}}")
    with tempfile.TemporaryDirectory() as folder:
        own_index = {"GIT_INDEX_FILE": str(Path(folder) / "index")}
        git("read-tree", "HEAD", **own_index)
        git("add", "--all", **own_index)
        return git("write-tree", **own_index)


# What `git archive` wrote is safe; without a filter newer Pythons warn, and those before 3.11.4 know none.
SAFELY: dict[str, Any] = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}


def export(trees: Mapping[str, str], folder: Path) -> None:
    """Write files into a folder, once: a folder that is complete stays as it is.

    trees  a path from the project's root, of a file or of all files below it -> the tree that it is taken from
    """
    complete = folder / "complete"
    if complete.exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    for path, tree in trees.items():
        with tarfile.open(fileobj=io.BytesIO(_archive(tree, path))) as archive:
            archive.extractall(folder, **SAFELY)
    complete.touch()


def texts_below(tree: str, path: str, *suffixes: str) -> dict[str, str]:
    """Texts of a tree's files below a path, by their paths from there. Raises SystemExit where there are none."""
    texts = {}
    with tarfile.open(fileobj=io.BytesIO(_archive(tree, path))) as archive:
        for member in archive.getmembers():
            content = archive.extractfile(member)
            if content is not None and member.name.endswith(suffixes):
                texts[member.name.removeprefix(f"{path}/")] = content.read().decode()
    if not texts:
        raise SystemExit(f"{path} holds no *{' or *'.join(suffixes)}")
    return texts


def _archive(tree: str, path: str) -> bytes:
    """Files of a tree in the format of tar."""
    done = subprocess.run(["git", "archive", tree, path], cwd=ROOT, capture_output=True, check=False)
    if done.returncode:
        raise SystemExit(f"git archive {tree[:12]} {path}: {done.stderr.decode().strip()}")
    return done.stdout
