"""The page on mechanisms runs, and its numbers are those that come out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import zwidth
from zwidth.model.posture import OK, OUT_OF_REACH

PAGE = (Path(__file__).parents[2] / "docs" / "mechanism.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """What stands in the names after both examples, one after the other."""
    found: dict[str, Any] = {}
    for block in BLOCKS:
        exec(compile(block, "docs/mechanism.md", "exec"), found)
    return found


def row(beginning: str) -> list[list[float]]:
    """The numbers in each cell of the page's table row, without the first cell."""
    (line,) = [line for line in PAGE.splitlines() if line.startswith(f"| {beginning}")]
    return [[float(x) for x in re.findall(r"[\d.]+", cell)] for cell in line.strip("|").split("|")[1:]]


def test_the_page_has_both_examples():
    assert len(BLOCKS) == 2


@pytest.mark.parametrize("name", ["link_side_mass", "motor_side_mass", "rigid_mass", "stiffness"])
def test_what_is_felt_is_what_the_comments_say(names, name):
    (said,) = re.findall(rf"^felt\.{name} +# ([\d.]+) ", PAGE, re.MULTILINE)
    digits = len(said.replace(".", "").lstrip("0"))
    assert float(f"{float(getattr(names['felt'], name)):.{digits}g}") == float(said)


def test_a_batch_is_solved_with_marks_where_there_is_no_posture(names):
    many = names["many"]
    assert many.status.shape == (2, 5)
    assert set(many.status.ravel()) == {OK, OUT_OF_REACH}
    assert (np.isnan(many.jacobian).all(axis=(-2, -1)) == (many.status != OK)).all()


def test_the_models_reach_what_the_page_says(names):
    said = re.search(
        r"give (\d+) N/m for `full`, (\d+) for `two-mass`, (\d+) for `motor-mass` and (\d+) for", PAGE
    )
    assert said
    assert [round(reached) for reached in names["stiffest"].values()] == [int(word) for word in said.groups()]


def test_the_cost_of_the_rotors_coupling_is_what_the_page_says(names):
    plain = zwidth.largest_stiffness(zwidth.Loop(names["plant"], names["device"].controller))
    found = [(zwidth.model.natural_frequencies(names["plant"]), plain), names["coupled"][1], names["coupled"][-1]]
    for cell, (frequencies, _) in zip(row("flexible frequencies"), found, strict=True):
        assert [round(f, 2) for f in frequencies[2:]] == cell
    for (said,), (_, peak) in zip(row("largest stiffness"), found, strict=True):
        assert round(peak.stiffness, 1) == said
        assert peak.stiffness == pytest.approx(plain.stiffness, rel=0.005)


def test_the_pages_formulas_give_the_effective_parameters(names):
    """(2.28), (2.34), (2.42) as they are written on the page."""
    mechanism, posture, felt = names["mechanism"], names["posture"], names["felt"]
    h = posture.jacobian.T @ names["y"]
    n2 = mechanism.drives.transmission**2
    links, rotors = posture.mass_matrix, np.diag(n2 * mechanism.drives.motor_inertia)
    springs = np.diag(n2 * mechanism.drives.stiffness)
    for matrix, value in [
        (links, felt.link_side_mass),
        (rotors, felt.motor_side_mass),
        (links + rotors, felt.rigid_mass),
        (springs, felt.stiffness),
    ]:
        assert 1.0 / (h @ np.linalg.inv(matrix) @ h) == pytest.approx(float(value), rel=1e-12)


@pytest.mark.parametrize("model", ["two-mass", "motor-mass"])
def test_the_pages_damping_of_the_pair(names, model):
    felt = names["felt"]
    m1, m2, k = (float(x) for x in (felt.link_side_mass, felt.motor_side_mass, felt.stiffness))
    b = 2 * names["device"].damping.ratio * np.sqrt(k * m1 * m2 / (m1 + m2))
    assert names["device"].at(model=model).plant.damping[-1, -1] == pytest.approx(b, rel=1e-12)
