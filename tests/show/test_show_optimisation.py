"""Sentences on what a finer grid makes of the best designs follow the study."""

import pytest

from tests.study.study_cases import axis
from tests.study.test_optimise import RATIO, TASK, problem_study
from zwidth.device.new_device import new_device
from zwidth.show.report.optimisation_text import sentences
from zwidth.study.optimise.optimise import optimise

SAME = "a grid twice as fine gives the same values"


def said(*axes, **study):
    found = sentences(optimise(problem_study(*axes, budget=24, **study), workers=1))
    return [sentence for sentence in found if "twice as fine" in sentence]


def test_a_plant_has_no_grid():
    mass = axis("plant.mass_kg", range=[0.02, 0.1])
    assert said(mass, device="hapkit-course", objectives={"stiffness_max": "max"}) == []


def test_values_change_where_the_worst_lies_between_the_points():
    measure = {"rigid_mass": "min"}
    (line,) = said(RATIO, objectives=measure, task={**TASK, "count": 2, "directions": 1})
    assert line.startswith("on a grid twice as fine worst(rigid_mass) changes by at most ")
    assert said(RATIO, objectives={"isotropy": "min"}, task=TASK) == [SAME]


@pytest.mark.parametrize(("most", "expected"), [("0.3646", True), ("0.4", False)])
def test_designs_lose_a_demand_between_the_points(most, expected):
    demand = f"rigid_mass <= {most}"
    lines = said(
        RATIO,
        objectives={"stiffness_max": "max"},
        constraints={"rigid_mass": f"<= {most}"},
        task={**TASK, "count": 2, "directions": 1},
    )
    assert (f"on a grid twice as fine 1 design breaks {demand}" in lines) is expected, lines


@pytest.mark.parametrize(("left", "expected"), [(-0.1, True), (0.05, False)])
def test_designs_have_no_value_where_a_finer_grid_is_out_of_reach(tmp_path, left, expected):
    """An arm reaches the corners of a box round its base, and not the base."""
    path = tmp_path / "arm.toml"
    path.write_text(new_device("arm", "serial-2r"))
    lines = said(
        axis("drives.shoulder.transmission_ratio", range=[8.0, 20.0]),
        device=str(path),
        objectives={"rigid_mass": "min"},
        task={"box_m": [[left, left + 0.2], [-0.1, 0.1]], "count": 2},
    )
    assert ("on a grid twice as fine worst(rigid_mass) has no value in 1 design" in lines) is expected, lines
