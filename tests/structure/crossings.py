"""How many rooms one question crosses: what is run by one commit, traced call by call.

`python -m tests.structure.crossings FOLDER QUESTION` runs a question of `QUESTIONS` twice with the package in a
folder, the second time traced, so that what is imported and compiled once does not count. It prints an object with
the files that functions of the package were run from and how often a call led from one folder into another.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

from tests.revisions import ROOT, export

# A push that bends the bundled arm's links without taking it out of reach [N].
LOAD = (0.0, -5.0)


def loaded_chart() -> None:
    """The chart of the bundled five-bar under a load."""
    import zwidth

    zwidth.load("five-bar").at((0.0, 0.25), (0.0, 1.0), load=LOAD).chart()


def small_sweep() -> None:
    """Two lengths of a link of the five-bar by two periods, the largest stiffness of each."""
    import zwidth

    axes = {"mechanism.links.upper-left.length_m": [0.14, 0.15], "loop.sampling_period_s": [0.001, 0.002]}
    zwidth.sweep(zwidth.load("five-bar"), axes, ["stiffness_max"])


QUESTIONS: dict[str, Callable[[], None]] = {"loaded chart": loaded_chart, "2 x 2 sweep": small_sweep}


def crossings(tree: str, folder: str) -> dict[str, dict[str, int]]:
    """For each question, "files" that were run and "package changes", of one commit's package.

    tree    of the commit, as of `tree_of`
    folder  of the package in it, "src/zwidth"
    """
    sources = ROOT / "out" / "structure" / tree
    export({folder: tree}, sources)
    found = {}
    for question in QUESTIONS:
        words = [sys.executable, "-m", __name__, str((sources / folder).parent), question]
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode:
            raise SystemExit(f"{question} of {tree[:12]}: {done.stderr.strip().splitlines()[-1]}")
        found[question] = json.loads(done.stdout.splitlines()[-1])
    return found


def traced(question: Callable[[], None], package: Path) -> dict[str, int]:
    """Files of a package that a question runs functions of, and calls from one of its folders into another.

    A call counts where the last function of the package that called, directly or through other code, stands in
    another folder directly below it; files beside those folders are one more.
    """
    inside = f"{package}/"
    files: set[str] = set()
    stack: list[str] = []
    changes = 0

    def follow(frame: FrameType, event: str, argument: Any) -> None:
        nonlocal changes
        path = frame.f_code.co_filename
        if not path.startswith(inside) or event not in ("call", "return"):
            return
        if event == "return":
            if stack:
                stack.pop()
            return
        files.add(path)
        first, slash, _ = path.removeprefix(inside).partition("/")
        part = first if slash else ""
        changes += bool(stack) and stack[-1] != part
        stack.append(part)

    sys.setprofile(follow)
    try:
        question()
    finally:
        sys.setprofile(None)
    return {"files": len(files), "package changes": changes}


def main() -> None:
    """Trace one question."""
    folder, question = sys.argv[1:]
    sys.path.insert(0, folder)
    import zwidth

    QUESTIONS[question]()
    print(json.dumps(traced(QUESTIONS[question], Path(zwidth.__file__).parent)))


if __name__ == "__main__":
    main()
