"""The three sizes of a random study, and the cases that lie outside the repository.

A random study asks one question of many random devices. It has an everyday size, three fixed seeds in the everyday
suite; a size for `.ci/run` of at most three minutes, in a test marked `slow`; and its full size, the same test
with ZWIDTH_FULL_STUDY=1, run once when the study is written and again when its subject changes. The commands and
the last figures of the full size stand in `docs/studies-run.md`.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

EVERYDAY_SEEDS: Final = (1, 2, 3)
FULL_STUDY: Final = "ZWIDTH_FULL_STUDY"
CASES: Final = "ZWIDTH_CASES"


def study_size(continuous: int, full: int) -> int:
    """How many random devices a longer study tries: `full` where ZWIDTH_FULL_STUDY is 1, else `continuous`,
    which `.ci/run` has time for (at most three minutes of processor time)."""
    return full if os.environ.get(FULL_STUDY) == "1" else continuous


def outside_case(name: str) -> Path:
    """The file `name`, such as "charts/lens.toml", in the folder that ZWIDTH_CASES names.

    For tests marked `outside_cases` alone; they are deselected where the variable is not set. A file that the
    folder lacks is an error, not a skip.
    """
    path = Path(os.environ[CASES]).resolve() / name
    if not path.exists():
        raise FileNotFoundError(f"{CASES} is {os.environ[CASES]!r}, and there is no {name} in it")
    return path
