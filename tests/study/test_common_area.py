"""Requirements, their regions and what they have in common."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.device.load import load
from zwidth.measures import Measure
from zwidth.study import common_area, parse_requirement, plane_of, workspace_map
from zwidth.study.workspace.common_area import nonnegative_region
from zwidth.study.workspace.map import KEY, reach_outline

MIDDLE = (0.02, 0.2)


def distance(place):
    return np.hypot(*(place.posture.position[..., :2] - MIDDLE).T).T


def height(place):
    return place.posture.position[..., 1]


OWN = {
    "distance": Measure("distance", "Distance", "m", "lower", "", distance, along=False),
    "height": Measure("height", "Height", "m", "higher", "", height, along=False),
}


@pytest.fixture(scope="module")
def device():
    return load("five-bar")


def areas(device, texts, cells, **ranges):
    plane = plane_of(device, cells=cells, **ranges)
    return common_area(
        workspace_map(device, list(OWN.values()), plane), [parse_requirement(text, OWN) for text in texts]
    )


INSIDE = {"x": (-0.1, 0.14), "y": (0.1, 0.3)}  # all of it is reached


def test_a_circle_and_what_a_line_cuts_off(device):
    R = 0.07
    found = areas(device, [f"distance<={R}", "height>=0.235"], (161, 161), **INSIDE)
    circle, above = found.regions
    h = 0.035  # the line is half a radius above the middle
    segment = R**2 * np.arccos(h / R) - h * np.sqrt(R**2 - h**2)
    assert circle.area == pytest.approx(np.pi * R**2, rel=3e-4)
    assert above.area == pytest.approx(0.24 * 0.065, rel=1e-7)
    assert found.common.area == pytest.approx(segment, rel=1e-3)
    assert found.reach.area == pytest.approx(0.24 * 0.2, rel=1e-12)
    assert found.common.share == pytest.approx(segment / (0.24 * 0.2), rel=1e-3)


def test_the_area_converges_with_the_square_of_the_step(device):
    R, n = 0.0731, np.array([20, 40, 80, 160, 320])
    errors = []
    for count in n:
        found = areas(device, [f"distance<={R}"], (count, count), **INSIDE)
        errors.append(abs(found.common.area - np.pi * R**2))
    order = np.polyfit(np.log(1.0 / (n - 1)), np.log(errors), 1)[0]
    assert order > 1.8
    assert errors[-1] < 1e-4 * np.pi * R**2


def test_at_the_edge_of_reach_it_is_exact_at_any_step():
    """The ring between both arms stretched and folded, of a device whose reach is nothing else."""
    device = load("five-bar", ["mechanism.workspace=unset"])
    ring = np.pi * ((0.147 + 0.199) ** 2 - (0.199 - 0.147) ** 2)
    for count in (41, 81):
        found = areas(device, ["height>=-1"], (count, count), x=(-0.36, 0.36), y=(-0.36, 0.36))
        assert found.common.area == pytest.approx(found.reach.area, rel=1e-12)
        assert found.reach.area == pytest.approx(ring, rel=1e-5)


def test_a_requirement_met_up_to_the_edge_of_reach_ends_at_that_edge():
    """A segment of the outer circle: what lies above a line."""
    device, R, h = load("five-bar", ["mechanism.workspace=unset"]), 0.147 + 0.199, 0.3
    segment = R**2 * np.arccos(h / R) - h * np.sqrt(R**2 - h**2)
    errors = []
    for count in (31, 61, 121):
        found = areas(device, [f"height>={h}"], (count, count), x=(-0.36, 0.36), y=(-0.36, 0.36))
        errors.append(abs(found.common.area / segment - 1.0))
    assert max(errors) < 5e-5


def test_where_lengths_alone_do_not_decide_the_edge_is_that_of_the_cells(device):
    plane = plane_of(device, cells=(41, 41))
    dataset = workspace_map(device, list(OWN.values()), plane)
    exact = common_area(dataset, [parse_requirement("height>=-1", OWN)])
    longer = np.array(dataset.attrs[KEY])
    longer[4::5] *= 1.2  # links that would reach farther than the postures say
    staircase = common_area(dataset.assign_attrs({KEY: longer.tolist()}), [parse_requirement("height>=-1", OWN)])
    assert reach_outline(dataset.assign_attrs({KEY: longer.tolist()}), "height") is None
    assert staircase.reach.area < exact.reach.area < 1.05 * staircase.reach.area


def test_a_hole_is_left_out(device):
    found = areas(device, ["distance>=0.03", "distance<=0.06"], (121, 121), **INSIDE)
    assert found.common.area == pytest.approx(np.pi * (0.06**2 - 0.03**2), rel=2e-3)
    assert len(found.common.shape.interiors) == 1


def test_requirements_that_nothing_or_everything_meets(device):
    found = areas(device, ["height>=2", "height<=2"], (11, 11), **INSIDE)
    assert [region.area for region in found.regions] == [0.0, pytest.approx(found.reach.area)]
    assert found.common.area == 0.0
    assert found.common.share == 0.0


def test_a_bound_that_is_just_met_is_met():
    grid = np.linspace(0.0, 1.0, 5)
    assert nonnegative_region(grid, grid, np.zeros((5, 5))).area == pytest.approx(1.0)
    assert nonnegative_region(grid, grid, np.full((5, 5), -1e-3)).area == 0.0
    assert nonnegative_region(grid, grid, np.full((5, 5), np.nan)).area == 0.0


def test_infinite_margins_lie_on_their_side():
    grid = np.linspace(0.0, 1.0, 5)
    right = np.broadcast_to(np.where(grid < 0.4, -np.inf, np.inf), (5, 5))
    assert nonnegative_region(grid, grid, right).area == pytest.approx(1.0 - 0.375)
    step = np.broadcast_to(np.where(grid < 0.4, -1.0, np.inf), (5, 5))
    assert 0.5 <= nonnegative_region(grid, grid, step).area <= 0.75


def test_a_cell_without_a_value_is_no_part_of_a_region():
    grid = np.linspace(0.0, 1.0, 5)
    margin = np.ones((5, 5))
    margin[2, 2] = np.nan
    # with the point go the halves next to it of its four squares
    assert nonnegative_region(grid, grid, margin).area == pytest.approx(1.0 - 4 * 0.5 * 0.25**2)


def test_the_map_must_hold_the_measures(device):
    found = workspace_map(device, list(OWN.values()), plane_of(device, cells=(4, 4)))
    with pytest.raises(ValueError, match=r"; .* distance, height"):
        common_area(found, [parse_requirement("isotropy<=2")])
    with pytest.raises(ValueError, match="least one"):
        common_area(found, [])


@pytest.mark.parametrize(
    ("text", "name", "at_least", "value"),
    [
        ("stiffness_max>=5000", "stiffness_max", True, 5000.0),
        ("  isotropy <= 1.5 ", "isotropy", False, 1.5),
        ("rigid_mass_kg>=-2e-1", "rigid_mass", True, -0.2),
        ("stiffness_max_N_per_m<=1e4", "stiffness_max", False, 1e4),
    ],
)
def test_a_requirement_is_read(text, name, at_least, value):
    found = parse_requirement(text)
    assert (found.measure.name, found.at_least, found.value) == (name, at_least, value)
    assert parse_requirement(found.text) == found


def test_what_is_not_known_does_not_meet_it():
    requirement = parse_requirement("isotropy<=2")
    assert requirement.met([1.0, 2.0, 3.0, np.nan, np.inf]).tolist() == [True, True, False, False, False]
