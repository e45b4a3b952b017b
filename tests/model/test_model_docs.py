"""The page on mechanisms runs, and its numbers are those that come out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import zwidth
from zwidth.model import OK, OUT_OF_REACH, Plant, modal_matrix

PAGE = (Path(__file__).parents[2] / "docs" / "mechanism.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """What stands in the names after the examples, one after the other."""
    found: dict[str, Any] = {}
    for block in BLOCKS:
        exec(compile(block, "docs/mechanism.md", "exec"), found)
    return found


def row(beginning: str) -> list[list[float]]:
    """The numbers in each cell of the page's table row, without the first cell."""
    (line,) = [line for line in PAGE.splitlines() if line.startswith(f"| {beginning}")]
    return [[float(x) for x in re.findall(r"[\d.]+", cell)] for cell in line.strip("|").split("|")[1:]]


def test_the_page_has_its_examples():
    assert len(BLOCKS) == 3


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


# --- the serial arm whose elbow motor rides on its first link ----------------------------------------


def with_change(value: float, plain: float, digits: int) -> str:
    """As the table writes a number and what it differs by."""
    change = f"{100 * (value / plain - 1):+.1f}".replace("-", "−")
    return f"{value:.{digits}f} ({change} %)"


def serial_arm_by_hand(document: dict[str, Any], n: float, way: float) -> Plant:
    """The full model of the arm from its energies: two links, and J (s + w)^2/2 - J s^2/2 for the elbow's rotor,
    with s the rate of the first link, whose inertia holds the rotor as if it were locked."""
    (m1, L1, c1, I1), (m2, L2, c2, I2) = (
        (link["mass_kg"], link["length_m"], link["center_of_mass_m"][0], link["inertia_kg_m2"])
        for link in document["mechanism"]["links"]
    )
    x, y = document["mechanism"]["reference"]["position_m"]
    q2 = np.arccos((x * x + y * y - L1 * L1 - L2 * L2) / (2 * L1 * L2))  # positive: the elbow on the right
    q1 = np.arctan2(y, x) - np.arctan2(L2 * np.sin(q2), L1 + L2 * np.cos(q2))
    lower = I2 + m2 * c2**2
    mixed = lower + m2 * L1 * c2 * np.cos(q2)
    links = [[I1 + m1 * c1**2 + m2 * L1**2 - lower + 2 * mixed, mixed], [mixed, lower]]
    rotor, spring = (
        np.diag([drive["transmission_ratio"] ** 2 * drive[key] for drive in document["mechanism"]["drives"]])
        for key in ("motor_inertia_kg_m2", "stiffness_Nm_per_rad")
    )
    coupling = np.zeros((2, 2))
    coupling[1, 0] = way * rotor[1, 1] / n  # J s w = J s n theta'
    M = np.block([[np.array(links), coupling.T], [coupling, rotor]])
    K = np.block([[spring, -spring], [-spring, spring]])
    along_y = np.array([L1 * np.cos(q1) + L2 * np.cos(q1 + q2), L2 * np.cos(q1 + q2)])
    links_side, motors_side = np.append(along_y, [0, 0]), np.append([0, 0], along_y)
    damping = modal_matrix(M, K, document["mechanism"]["damping"]["mode_ratio"])
    return Plant(M, damping, K, actuator=motors_side, sensor=motors_side, handle=links_side)


@pytest.mark.parametrize("n", [10.0, 3.0, 1.0])
def test_what_a_riding_motor_costs_a_serial_arm_is_what_the_page_says(names, n):
    (line,) = [line for line in PAGE.splitlines() if line.startswith(f"| {n:.0f} | ")]
    said = [cell.strip() for cell in line.strip("|").split("|")][1:]
    found = [
        [names["serial"][n, way][what] * scale for way in (0.0, 1.0, -1.0)] for what, scale in ((0, 1000), (1, 1))
    ]
    masses, stiffest = found
    expected = [f"{masses[0]:.2f}", *(with_change(mass, masses[0], 2) for mass in masses[1:])]
    expected += [f"{stiffest[0]:.1f}", *(with_change(reached, stiffest[0], 1) for reached in stiffest[1:])]
    assert said == expected


@pytest.mark.parametrize("way", [0.0, 1.0, -1.0])
@pytest.mark.parametrize("n", [10.0, 3.0, 1.0])
def test_the_serial_arms_numbers_are_those_of_its_energies(names, n, way):
    arm = names["arm"]
    plant = serial_arm_by_hand(arm.document, n, way)
    mass, reached = names["serial"][n, way]
    moves = plant.handle[:2]
    # all four coordinates as one: each rotor with its joint
    together = np.vstack([np.eye(2), np.eye(2)])
    whole = together.T @ plant.mass @ together
    assert mass == pytest.approx(1 / (moves @ np.linalg.solve(whole, moves)), rel=1e-9)
    by_hand = zwidth.largest_stiffness(zwidth.Loop(plant, arm.controller)).stiffness
    assert reached == pytest.approx(by_hand, rel=1e-6)


def test_how_the_serial_arms_mass_changes_over_the_directions(names):
    said = re.search(r"from −([\d.]+) to \+([\d.]+) % over the directions", PAGE)
    assert said
    posture = names["arm"].at().posture
    plants = [serial_arm_by_hand(names["arm"].document, 10.0, way) for way in (0.0, 1.0)]
    together = np.vstack([np.eye(2), np.eye(2)])
    plain, riding = (np.linalg.inv(together.T @ plant.mass @ together) for plant in plants)
    angle = np.linspace(0.0, np.pi, 721)
    h = np.column_stack([np.cos(angle), np.sin(angle)]) @ posture.jacobian[:2]
    change = np.einsum("ki,ij,kj->k", h, plain, h) / np.einsum("ki,ij,kj->k", h, riding, h) - 1.0
    assert [f"{-100 * change.min():.1f}", f"{100 * change.max():.1f}"] == list(said.groups())
    # along y it is the table's
    along_y = names["serial"][10.0, 1.0][0] / names["serial"][10.0, 0.0][0] - 1.0
    assert change[360] == pytest.approx(along_y, rel=1e-6)
