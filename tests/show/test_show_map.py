"""Maps drawn: levels, what has no value, requirements, the mechanism, and the same bytes from the same numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.patches import PathPatch

from zwidth.device.load import load
from zwidth.errors import NoValueError
from zwidth.measures import (
    BEYOND_LIMIT,
    FAILED,
    NO_EQUILIBRIUM,
    NO_VALUE,
    OK,
    OUT_OF_REACH,
    OUT_OF_TIME,
    SINGULAR,
    STATUS,
    UNDECIDED,
    Measure,
)
from zwidth.show import MARKS, area_text, draw_map, figure, map_figure, percent, save
from zwidth.show.figures.map import draw_safe_walls
from zwidth.study import common_area, parse_requirement, plane_of, safe_walls, workspace_map


@pytest.fixture(scope="module")
def device():
    return load("five-bar")


@pytest.fixture(scope="module")
def dataset(device):
    return workspace_map(
        device, ["rigid_mass", "isotropy", "manipulability", "stiffness"], plane_of(device, cells=(31, 16))
    )


def legend(ax):
    made = ax.get_legend()
    return [] if made is None else [text.get_text() for text in made.get_texts()]


def test_the_bar_names_the_measure_and_its_unit(dataset, device):
    for name, said in (
        ("rigid_mass", "Rigid mass of links and rotors [kg]"),
        ("isotropy", "Condition number of the Jacobian"),
        ("manipulability", "Manipulability [m²/rad²]"),
        ("stiffness", "Structural stiffness [kN/m]"),
    ):
        drawing = map_figure(dataset, name, device)
        (ax,) = drawing.axes
        (bar,) = ax.child_axes
        assert bar.get_ylabel() == said
        drawing.canvas.draw()
        assert bar.get_ylabel() == said  # whatever a locator may think
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [m]", "y [m]")
        assert ax.get_aspect() == 1.0


def test_the_mechanism_is_in_the_picture(dataset, device):
    with_it, without = map_figure(dataset, "rigid_mass", device), map_figure(dataset, "rigid_mass")
    low, high = with_it.axes[0].get_ylim()
    assert low < 0.0 < 0.35 < high  # the base at y = 0 lies below the map
    assert without.axes[0].get_ylim()[0] > 0.0
    (handle,) = [line for line in with_it.axes[0].lines if line.get_marker() == "D"]
    np.testing.assert_allclose(np.ravel(handle.get_data()), [0.0, 0.25])
    assert not without.axes[0].lines


def test_each_kind_without_a_value_has_its_own_hatch(device):
    def fails(place):
        x = place.posture.position[0]
        if x < -0.1:
            raise NoValueError("left")
        if x > 0.1:
            raise RuntimeError("right")
        return x

    plane = plane_of(device, x=(-0.2, 0.2), y=(0.15, 0.3), cells=(21, 8))
    found = workspace_map(device, [Measure("m", "m", "m", None, "", fails, each=True, along=False)], plane)
    status = found["m_status"].values
    assert {NO_VALUE, FAILED, OK} <= set(np.unique(status).tolist())
    ax = map_figure(found, "m", device).axes[0]
    assert legend(ax) == ["no value", "failed"]
    others = SINGULAR, UNDECIDED, BEYOND_LIMIT, NO_EQUILIBRIUM, OUT_OF_TIME
    status[:, 3:8] = others
    found["m"].values[:, 3:8] = np.nan
    ax = map_figure(found, "m", device).axes[0]
    assert legend(ax) == [
        "singular",
        "beyond a joint limit",
        "no equilibrium",
        "no value",
        "undecided",
        "failed",
        "out of time",
    ]
    hatches = {patch.get_hatch() for patch in ax.get_legend().get_patches()}
    assert len(hatches) == 7 == len(MARKS)
    status[:] = OUT_OF_REACH
    found["m"].values[:] = np.nan
    assert legend(map_figure(found, "m", device).axes[0]) == []


def test_requirements_are_outlined_and_what_they_share_is_dotted(dataset, device):
    texts = ["rigid_mass>=0.2", "isotropy<=1.3", "manipulability>=0.015"]
    area = common_area(dataset, [parse_requirement(text) for text in texts])
    ax = map_figure(dataset, "rigid_mass", device, area).axes[0]
    said = legend(ax)
    assert said[0].startswith("Rigid mass of links and rotors ≥ 0.2\u00a0kg: ")
    assert said[1].startswith("Condition number of the Jacobian ≤ 1.3: ")
    assert said[2].startswith("Manipulability ≥ 0.015\u00a0m²/rad²: ")
    assert (
        said[3]
        == f"Common area: {area_text(area.common.area)}, {percent(area.common.share)} of the reachable area"
    )
    patches = [patch for patch in ax.patches if isinstance(patch, PathPatch)]
    assert len({patch.get_hatch() for patch in patches} - {None}) == 3
    bold = [
        patch for patch in patches if patch.get_edgecolor() == to_rgba("black") and patch.get_linewidth() > 3.0
    ]
    outline = np.vstack([patch.get_path().vertices for patch in bold])
    bounds = area.common.shape.bounds
    np.testing.assert_allclose([*outline.min(axis=0), *outline.max(axis=0)], bounds)


def test_nothing_in_common_is_said(dataset, device):
    area = common_area(dataset, [parse_requirement("isotropy<=0.5")])
    assert legend(map_figure(dataset, "isotropy", device, area).axes[0])[-1].startswith("Common area: 0 cm²")


def test_extreme_directions_are_strokes(device):
    found = workspace_map(device, ["stiffness"], plane_of(device, cells=(31, 16)), "worst")
    ax = map_figure(found, "stiffness", device).axes[0]
    assert legend(ax) == ["worst direction"]
    (strokes,) = [c for c in ax.collections if c.get_label() == "worst direction"]
    segments = np.array(strokes.get_segments())
    assert 40 < len(segments) < 150
    middle, along = segments.mean(axis=1), np.diff(segments, axis=1)[:, 0]
    for k in (0, len(segments) // 2, -1):
        at = found["stiffness_direction"].sel(x_m=middle[k, 0], y_m=middle[k, 1], method="nearest").values[:2]
        assert abs(at @ along[k]) == pytest.approx(np.linalg.norm(along[k]), rel=1e-9)


def test_infinite_values_are_drawn(device):
    drives = [f"mechanism.drives.motor-{side}.stiffness_Nm_per_rad=inf" for side in ("left", "right")]
    rigid = load("five-bar", drives)
    found = workspace_map(rigid, ["stiffness"], plane_of(rigid, cells=(9, 6)))
    reached = found["stiffness_status"].values == OK
    assert np.isinf(found["stiffness"].values[reached]).all()
    map_figure(found, "stiffness", rigid).canvas.draw()
    mixed = found.copy(deep=True)
    mixed["stiffness"].values[:, :4] = np.where(np.isnan(mixed["stiffness"].values[:, :4]), np.nan, 4000.0)
    map_figure(mixed, "stiffness", rigid).canvas.draw()


def test_where_all_is_infinite_no_bar_pretends_to_numbers(dataset, device):
    infinite = dataset.copy(deep=True)
    infinite["rigid_mass"].values[np.isfinite(infinite["rigid_mass"].values)] = np.inf
    drawing = map_figure(infinite, "rigid_mass", device)
    (ax,) = drawing.axes
    assert legend(ax) == ["Rigid mass of links and rotors: infinite"]


def test_the_largest_of_numbers_are_drawn(dataset, device):
    huge = dataset.copy(deep=True)
    x = dataset["x_m"].values
    huge["rigid_mass"].values[:] = np.where(np.isnan(dataset["rigid_mass"].values), np.nan, 10.0 ** (1000.0 * x))
    drawing = map_figure(huge, "rigid_mass", device)
    drawing.canvas.draw()
    assert len(drawing.axes[0].child_axes[0].get_yticklabels()) > 4


@pytest.mark.parametrize("ending", [".png", ".svg", ".pdf"])
def test_the_same_numbers_give_the_same_bytes(tmp_path, dataset, device, ending):
    for name in ("a", "b"):
        save(map_figure(dataset, "isotropy", device), tmp_path / f"{name}{ending}")
    assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()


def test_it_draws_into_given_axes(dataset, device):
    drawing, ax = figure(5.0, 4.0)
    draw_map(ax, dataset, "isotropy", device)
    assert ax.collections
    assert drawing.axes == [ax]
    assert len(ax.child_axes) == 1


def test_the_rendered_direction_is_shown_where_it_matters(dataset, device):
    def arrows(name):
        return [text for text in map_figure(dataset, name, device).axes[0].texts if text.arrow_patch is not None]

    (arrow,) = arrows("rigid_mass")
    start, end = np.array(arrow.get_position()), np.array(arrow.xy)
    np.testing.assert_allclose((end - start) / np.linalg.norm(end - start), [0.0, 1.0], atol=1e-12)
    assert not arrows("isotropy")


def test_safe_walls_are_outlined_and_cells_without_any_are_named():
    bands = safe_walls(load("published-two-mass"), levels=4, workers=1)
    _, ax = figure()
    draw_safe_walls(ax, bands)
    steps, rectangle = ax.patches
    one = bands.rectangle(0)
    assert rectangle.get_bbox().bounds == pytest.approx((0.0, one.low, one.stiffness, one.high - one.low))
    assert steps.get_data().values.tolist() == bands.ranges[0, 0, :, 1].tolist()
    assert len(ax.get_legend().get_texts()) == 2
    cells = safe_walls(load("five-bar"), x=(-0.05, 0.05), y=(0.2, 0.25), cells=(2, 1), levels=2, workers=1)
    partly = replace(cells, status=np.array([OK, NO_VALUE], np.uint8), level=cells.level * [1, 0])
    _, ax = figure()
    draw_safe_walls(ax, partly)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [STATUS[NO_VALUE]]
    (bar,) = ax.child_axes
    assert bar.get_ylabel() == "Safe stiffness, every direction [kN/m]"
