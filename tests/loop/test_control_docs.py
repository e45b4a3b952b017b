"""The page on control beyond the wall law: its numbers are computed, its refusals said."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import zwidth

PAGE = (Path(__file__).parents[2] / "docs" / "control.md").read_text(encoding="utf-8")
LOW_PASS = '{ type = "butterworth", order = 2, cutoff_Hz = %s.0 }'


def rows():
    """Cells of each row of the first table; None in place of an empty one."""
    lines = [line for line in PAGE.splitlines() if line.startswith("| ") and "kN/m" in line]
    return [[cell.strip() or None for cell in line.strip("|").split("|")] for line in lines]


def settings(cell):
    """The settings that a cell stands for: a filter is told by its cutoff."""
    if cell == "nothing more":
        return {}
    text = re.sub(r"(\d+) Hz", lambda match: LOW_PASS % match[1], cell.strip("`"))
    return {f"loop.{key}": value for key, value in tomllib.loads(text).items()}


def test_the_table_has_every_kind_of_feedback():
    assert len(rows()) == 7
    assert {key for row in rows() for key in settings(row[0])} == {
        "loop.force_sensor",
        "loop.feedforward",
        "loop.local",
    }


@pytest.mark.parametrize("row", rows(), ids=lambda row: row[0])
def test_the_stiffness_and_the_mass_of_a_row_are_computed(row):
    what, alone, held, felt = row
    device = zwidth.load("published-two-mass", settings(what))
    assert f"{1e-3 * device.at().chart(decay=False).stiffness_max:#.4g} kN/m" == alone
    arm = device.at(operator="thesis-arm").chart(decay=False)
    assert f"{1e-3 * arm.stiffness_max:#.4g} kN/m" == held
    if felt is not None:
        assert f"{device.at().felt(100.0, 8.0).free_motion_mass:#.4g} kg" == felt


def test_the_command_of_the_page_is_a_row():
    (command,) = re.findall(r"^zwidth chart published-two-mass (.+)$", PAGE, re.MULTILINE)
    given = dict(part.strip().split("=") for part in command.split("--set ")[1:])
    device = zwidth.load("published-two-mass", {key: int(value) for key, value in given.items()})
    shown = f"{1e-3 * device.at().chart(decay=False).stiffness_max:#.4g} kN/m"
    assert shown == next(row[1] for row in rows() if "damping_Ns_per_m = 5.0" in row[0])
