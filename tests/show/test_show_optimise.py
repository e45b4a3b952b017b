"""The figure of a front claims no design that was not tried; sentences on a finer grid follow the study."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.cbook import STEP_LOOKUP_MAP

from tests.study.study_cases import axis
from tests.study.test_optimise import RATIO, TASK, problem_study
from zwidth.device import new_device
from zwidth.show.figures.optimise import front_figure
from zwidth.show.report.optimisation import optimisation_sentences
from zwidth.study import optimise, study_to_optimise

WALL = {"stiffness_N_per_m": 500.0, "damping_Ns_per_m": 1.0}
AXES = [
    {"key": "plant.mass_kg", "range": [0.02, 0.1]},
    {"key": "plant.damping_Ns_per_m", "range": [0.1, 2.0]},
]


@pytest.mark.parametrize(
    "objectives",
    [
        {"stiffness_max": "max", "spectral_radius": "min"},
        {"spectral_radius": "min", "stiffness_max": "max"},
    ],
)
def test_every_corner_of_the_steps_is_reached_or_surpassed_by_a_design(objectives):
    wanted = {"optimise": {"objectives": objectives, "budget": 80}}
    document = {"device": "hapkit-course", "set": ["operator=unset"], "axis": AXES, **WALL, **wanted}
    found = optimise(study_to_optimise(document), workers=1)
    (ax,) = front_figure(found).axes
    (steps,) = [line for line in ax.lines if line.get_drawstyle().startswith("steps")]
    # nothing else joins points
    others = [line for line in ax.lines if line is not steps and len(line.get_xdata()) > 1]
    assert {line.get_linestyle() for line in others} == {"None"}
    signs, tried = found.problem.signs, found.judgement.values
    assert len(steps.get_xdata()) > 4
    corners = np.stack(STEP_LOOKUP_MAP[steps.get_drawstyle()](*steps.get_data()), axis=-1)
    assert len(corners) == 2 * len(steps.get_xdata()) - 1
    for point in corners * signs:
        assert (tried * signs <= point + 1e-12 * np.abs(point)).all(axis=1).any(), point
    ends = np.stack([steps.get_xdata(), steps.get_ydata()], axis=-1)
    assert {tuple(row) for row in ends.tolist()} <= {tuple(row) for row in tried.tolist()}
    plt.close("all")


SAME = "a grid twice as fine gives the same values"


def said(*axes, **study):
    found = optimisation_sentences(optimise(problem_study(*axes, budget=24, **study), workers=1))
    return [sentence for sentence in found if "twice as fine" in sentence]


def test_a_plant_has_no_grid():
    mass = axis("plant.mass_kg", range=[0.02, 0.1])
    assert said(mass, device="hapkit-course", objectives={"stiffness_max": "max"}) == []


def test_values_change_where_the_worst_lies_between_the_points():
    measure = {"rigid_mass": "min"}
    (line,) = said(RATIO, objectives=measure, task={**TASK, "count": 2, "directions": 1})
    assert "worst(rigid_mass) changes" in line
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
    assert (any(line.endswith(f" 1 design breaks {demand}") for line in lines)) is expected, lines


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
    assert (any("worst(rigid_mass) has no" in line for line in lines)) is expected, lines
