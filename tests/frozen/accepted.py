"""Differences that are accepted, each with its reason."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from tests.frozen.compare import Difference

KEYS = {"command", "device", "key", "reason"}


@dataclass(frozen=True)
class AcceptedDifference:
    """Patterns as of a shell for what is accepted, and why."""

    command: str
    device: str
    key: str
    reason: str

    def covers(self, difference: Difference) -> bool:
        """Is this one of those?"""
        return (
            fnmatchcase(difference.command, self.command)
            and fnmatchcase(difference.device, self.device)
            and fnmatchcase(difference.key, self.key)
        )


def read_accepted(path: Path | None) -> list[AcceptedDifference]:
    """From a TOML file of tables [[accepted]] with command, device, key and reason.

    Raises SystemExit where one has other keys, or no reason.
    """
    if path is None:
        return []
    entries = tomllib.loads(path.read_text()).get("accepted", [])
    for entry in entries:
        if set(entry) != KEYS or not entry["reason"].strip():
            raise SystemExit(f"{path}: each [[accepted]] has command, device, key and a reason, got {entry}")
    return [AcceptedDifference(**entry) for entry in entries]


def split_accepted(
    differences: list[Difference], accepted: list[AcceptedDifference]
) -> tuple[list[Difference], dict[AcceptedDifference, int]]:
    """Those that nothing accepts, and how many each entry does."""
    counts = dict.fromkeys(accepted, 0)
    left = []
    for difference in differences:
        entry = next((entry for entry in accepted if entry.covers(difference)), None)
        if entry is None:
            left.append(difference)
        else:
            counts[entry] += 1
    return left, counts
