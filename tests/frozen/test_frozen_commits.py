"""Sources of commits, and of a working tree, in folders of their own."""

from __future__ import annotations

import subprocess

import pytest

from tests import revisions
from tests.frozen import commits
from tests.frozen.commits import commit_sources, installation

PROJECT = '[project]\nname = "x"\nscripts = { zwidth = "x.main:main" }\n'


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A repository of one commit, with a file that git does not know yet."""
    root = tmp_path / "repository"
    (root / "src" / "x").mkdir(parents=True)
    (root / "pyproject.toml").write_text(PROJECT)
    (root / "src" / "x" / "main.py").write_text("one = 1\n")
    (root / ".gitignore").write_text("*.nbi\n")
    who = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    for words in (["init", "--quiet"], ["add", "--all"], [*who, "commit", "--quiet", "-m", "one"]):
        subprocess.run(["git", *words], cwd=root, check=True)
    monkeypatch.setattr(revisions, "ROOT", root)
    monkeypatch.setattr(commits, "CACHE", tmp_path / "cache")
    return root


def test_the_working_tree_is_exported_with_new_files_and_without_ignored_ones(repository):
    committed = commit_sources("HEAD", ())
    assert commit_sources(".", ()).folder == committed.folder
    (repository / "src" / "x" / "new.py").write_text("two = 2\n")
    (repository / "src" / "x" / "kernel.nbi").write_text("stale")
    working = commit_sources(".", ())
    assert working.folder != committed.folder
    assert {path.name for path in (working.folder / "src" / "x").iterdir()} == {"main.py", "new.py"}
    assert working.entry == "x.main:main"
    status = subprocess.run(["git", "status", "--short"], cwd=repository, capture_output=True, text=True)
    assert status.stdout == "?? src/x/new.py\n"


def test_answers_are_kept_apart_by_sources_environment_and_side(repository):
    variable = (("OPENBLAS_CORETYPE", "Haswell"),)
    assert installation(()) != installation(variable)
    files = {
        commit_sources("HEAD", ()).answers,
        commit_sources("HEAD", variable).answers,
        commit_sources("HEAD", (), repeat=True).answers,
    }
    assert len(files) == 3


def test_an_unknown_commit_ends_it(repository):
    with pytest.raises(SystemExit, match="no such commit"):
        commit_sources("no-such-branch", ())
