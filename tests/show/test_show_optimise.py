"""The figure of a front: no line claims a design that was not tried."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.cbook import STEP_LOOKUP_MAP

from zwidth.show.figures.optimise import front_figure
from zwidth.study.optimise.optimise import optimise
from zwidth.study.optimise.problem import study_to_optimise

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
