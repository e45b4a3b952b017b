"""Safe walls over the workspace: stable in postures that nobody chose, however they are searched for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.study.safe_wall_cases import largest_radii, random_device, search_table, try_table
from zwidth.device.load import load
from zwidth.measures import NO_VALUE, OK, OUT_OF_REACH, UNDECIDED
from zwidth.study import Store, run_job, safe_walls
from zwidth.study.wall_tables.cell_walls import cell_walls
from zwidth.study.wall_tables.safe_walls import SafeWallsJob, compute_table, safe_walls_job
from zwidth.study.wall_tables.table import rounded

MECHANISM, TWO_MASS, MEASURED_HAND = "five-bar", "published-two-mass", "thesis-arm"
WALLS = 2500  # tried in each cell that has any
# A root at 1 is left to rounding where K is next to nothing.
ROUNDING = 1e-9
MIDDLE = {"x": (-0.1, 0.1), "y": (0.12, 0.28)}
RIGHT = {"x": (0.0, 0.1), "y": (0.12, 0.28)}  # the left half is its mirror image
# Of a random device without the cells that are the image of others: kind, seed, ranges, cells.
DRAWN = [("serial-2r", 3, {"x": (-0.42, 0.0)}, (3, 4)), ("five-bar", 2, {"y": (0.0, 0.28)}, (6, 2))]


@pytest.fixture(scope="module")
def table():
    """A table with two hands, at whose border some cells are out of reach."""
    box = {"x": (-0.2, 0.1), "y": (0.05, 0.25), "cells": (3, 2)}
    return safe_walls(load(MECHANISM), ["none", MEASURED_HAND], **box, levels=3, margin=0.05, workers=1)


@cache
def drawn_table(kind, seed, ranges, cells):
    """The table of a random device; `ranges` are pairs of an axis and its range."""
    return safe_walls(random_device(kind, seed), **dict(ranges), cells=cells, levels=4, workers=1)


def job_of(device, *, narrowing=True, **arguments):
    given = {"ranges": (None, None, None), "cells": None, "levels": 8, "directions": 1, "margin": 0.0}
    given |= {"size_limit": None, "assembly": None, "model": None, "seed": 1}
    job = safe_walls_job(device, None, **(given | arguments))
    return SafeWallsJob(replace(job.cell_question, narrowing=narrowing))


def test_a_single_band_without_a_range_that_all_postures_share_is_told():
    """Long delays bend the edge away from zero damping, so that no one range serves all stiffnesses."""
    late = load(MECHANISM, {"loop.delay_samples": 5})
    box = {"x": (0.0, 0.002), "y": (0.2, 0.202), "cells": (1, 1)}
    one, two = (safe_walls(late, **box, levels=levels, workers=1) for levels in (1, 2))
    assert one.status.item() == NO_VALUE
    assert two.status.item() == OK
    assert two.level.item() == 1


# --- nothing unstable --------------------------------------------------------------------------------


def test_no_wall_of_the_table_is_unstable_with_any_hand(table):
    no_wall_is_unstable(table, seed=2)


@pytest.mark.parametrize(("kind", "seed", "ranges", "cells"), [*DRAWN, ("five-bar", 1, {}, (5, 4))])
def test_no_wall_of_a_random_device_is_unstable(kind, seed, ranges, cells):
    no_wall_is_unstable(drawn_table(kind, seed, tuple(ranges.items()), cells), seed)


def no_wall_is_unstable(table, seed):
    count = WALLS * int((table.level > 0).sum())
    tried = try_table(table, count, seed)
    assert tried.inside > 0.9 * count > 0
    assert tried.unstable == 0


def test_a_search_finds_no_unstable_wall_where_limits_are_narrowed_and_finds_one_where_they_are_not():
    job = {"ranges": (*RIGHT.values(), None), "cells": (1, 2)}
    narrowed, bare = (
        compute_table(load(MECHANISM), job_of(load(MECHANISM), narrowing=narrowing, **job), None, workers=1)
        for narrowing in (True, False)
    )
    assert search_table(narrowed, seed=4, each=6, rounds=8).radius < 1.0
    assert search_table(bare, seed=4, each=6, rounds=8).radius > 1.0 + 1e-6


def test_the_tightest_direction_is_found_beyond_the_border_of_a_sector():
    """At a corner of this cell a limit has its peak a degree and a half beyond the diagonal, where sectors meet
    and the lattice has a direction: the search has to cross the border."""
    device = random_device("serial-2r", 12)
    found = safe_walls(device, x=(0.2114, 0.2643), y=(0.148, 0.222), cells=(1, 1), levels=4, workers=1)
    u = np.radians(np.linspace(40.0, 52.0, 49))
    way = np.column_stack([np.cos(u), np.sin(u)])
    corner = np.tile([0.2643, 0.222], (len(u), 1))
    for j in range(4):
        K = np.full(len(u), found.stiffness_of_level(0, 0, j + 1))
        for B in found.ranges[0, 0, j]:
            assert largest_radii(found, corner, way, K, np.full(len(u), B)).max() < 1.0
    # 3 % of the widest range lower an unstable wall is there
    below = found.ranges[0, 0, 3, 0] - 0.03 * np.diff(found.ranges[0, 0, 0])
    assert largest_radii(found, corner, way, K, np.full(len(u), below)).max() > 1.0


def test_limits_are_not_narrower_than_they_need_to_be():
    """Beside each limit of a small cell there is an unstable wall, 3 % of the range away."""
    device = load(MECHANISM)
    found = safe_walls(device, x=(0.0, 0.002), y=(0.2, 0.202), cells=(1, 1), workers=1)
    u = np.pi * np.arange(30) / 30
    points = device.at((0.001, 0.201), np.column_stack([np.cos(u), np.sin(u)]))
    for j in range(0, found.levels - 2, 3):
        low, high = found.ranges[0, 0, j]
        beyond = 0.03 * (high - low)
        K = np.linspace(found.stiffness_of_level(0, 0, j), found.stiffness_of_level(0, 0, j + 1), 9)[1:]
        for B in (low - beyond, high + beyond):
            assert max(points[n].check(K, np.full(8, B)).spectral_radius.max() for n in range(30)) > 1.0


@pytest.mark.parametrize(
    ("kind", "seed", "ranges", "cells"),
    [
        *DRAWN,
        pytest.param("serial-2r", 4, {}, (6, 4), marks=pytest.mark.slow),
        pytest.param("five-bar", 2, {}, (6, 4), marks=pytest.mark.slow),
    ],
)
def test_the_margin_is_what_walls_may_be_off_by(kind, seed, ranges, cells):
    """Stiffness and damping are multiplied by factors of 0.8 and 1.2 of their own."""
    found = safe_walls(random_device(kind, seed), **ranges, cells=cells, levels=4, margin=0.2, workers=1)
    tried = try_table(found, 2000, seed)
    rng = np.random.default_rng(seed)
    K, B = (one * rng.choice([0.8, 1.0, 1.2], len(one)) for one in (tried.stiffness, tried.damping))
    assert tried.inside > 1800
    assert largest_radii(found, tried.position, tried.direction, K, B).max() < 1.0 + ROUNDING
    plain = drawn_table(kind, seed, tuple(ranges.items()), cells)
    assert plain.outside.stiffness > found.outside.stiffness


def test_sectors_allow_more_than_every_direction_does():
    """A sector's stiffness is that of all directions at least, but for what each is narrowed by of its own."""
    found = safe_walls(load(MECHANISM), **RIGHT, cells=(1, 1), levels=4, directions=2, workers=1)
    every, sectors = found.top[:, :1], found.top[:, 1:]
    assert (sectors > 0.93 * every).all()
    assert (sectors.max(axis=1) > 1.2 * every[:, 0]).any()
    tried = try_table(found, 4000, seed=9)
    assert tried.inside > 3600
    assert tried.unstable == 0
    ranges = {found.damping_at((0.01, 0.2), 1000.0, (np.cos(u), np.sin(u))) for u in np.linspace(0.0, np.pi, 40)}
    assert len(ranges) == 4


# --- the table --------------------------------------------------------------------------------------


def test_outside_the_table_are_the_walls_that_all_cells_have(table):
    far = [(9.0, 9.0), (np.nan, 0.2), (0.0, np.inf), (0.0, -1e300), (0.1, 0.05)]
    assert all(table.at(place) == (1, table.outside) for place in far)
    K, low, high = table.outside.stiffness, table.outside.low, table.outside.high
    assert K > 0.0
    assert low < high
    for cell in np.flatnonzero(table.level):
        band = 0
        while table.stiffness_of_level(cell, 0, band + 1) < K * (1.0 - 1e-6):
            band += 1
        ranges = table.ranges[cell, 0, : band + 1]
        assert (ranges[:, 0] <= low).all()
        assert (ranges[:, 1] >= high).all()
    assert min(table.rectangles[table.level > 0, 0]) >= K  # no stiffer than the walls of any cell
    assert table.damping_at((9.0, 9.0), K) == (1, low, high)
    assert table.damping_at((9.0, 9.0), 1.01 * K) == (1, 0.0, -1.0)


def test_the_rectangle_is_the_largest_or_the_stiffest_with_the_wanted_span(table):
    for cell in np.flatnonzero(table.level):
        box = table.rectangle(cell)
        areas = []
        for level in range(1, table.levels + 1):
            part = table.ranges[cell, 0, :level]
            width = part[:, 1].min() - max(part[:, 0].max(), 0.0)
            areas.append(
                table.stiffness_of_level(cell, 0, level) * width if (part[:, 0] <= part[:, 1]).all() else 0.0
            )
        assert box.stiffness * (box.high - max(box.low, 0.0)) == pytest.approx(max(areas), rel=1e-6)
    device = load(TWO_MASS)
    wide, narrow = (safe_walls(device, span=span) for span in (20.0, 5.0))
    assert wide.outside.high - wide.outside.low >= 20.0
    assert 5.0 <= narrow.outside.high - narrow.outside.low < 20.0
    assert narrow.outside.stiffness > wide.outside.stiffness
    assert (safe_walls(device, span=1e3).level == 0).all()


def test_a_stiffness_beyond_the_table_and_one_that_is_none_have_no_range(table):
    place = (0.01, 0.2)
    assert table.at(place)[0] == 0
    for K in (-1.0, np.nan, 1e9, np.inf):
        assert table.damping_at(place, K) == (2, 0.0, -1.0)
    code, low, high = table.damping_at(place, 0.0)
    assert code == 0
    assert low < high
    for direction in (None, (0.0, 0.0), (np.nan, 1.0), (np.inf, 0.0)):
        assert table.damping_at(place, 1000.0, direction) == table.damping_at(place, 1000.0)
    assert table.damping_at(place, 1000.0, (0.3, 0.7)) == table.damping_at(place, 1000.0, (-0.6, -1.4))


def test_numbers_of_32_bits_are_rounded_to_the_safe_side():
    values = np.random.default_rng(1).standard_normal(1000) * 10.0 ** np.arange(-20, 20).repeat(25)
    for towards, sign in ((np.inf, 1.0), (-np.inf, -1.0)):
        found = rounded(values, towards)
        assert (sign * (found - values) >= 0.0).all()
        assert (found == found.astype(np.float32)).all()
        np.testing.assert_allclose(found, values, rtol=2.4e-7)


def test_a_device_without_a_workspace_has_one_cell_that_is_everywhere():
    device = load(TWO_MASS)
    found = safe_walls(device)
    assert found.at(()) == found.at((5.0, np.nan)) == (0, found.rectangle(0))
    box, rng = found.rectangle(0), np.random.default_rng(3)
    K, B = box.stiffness * rng.random(300), box.low + (box.high - box.low) * rng.random(300)
    assert (device.check(K, B).verdict == 1).all()
    assert found.top[0, 0] > 0.95 * device.chart(decay=False).stiffness_max
    assert "everywhere" in repr(found)


def test_the_document_and_the_columns_hold_the_table(table):
    document, columns, data = table.document(), table.table(), table.dataset()
    K = np.array(document["stiffness_max_N_per_m"], dtype=float)
    assert K.shape == (2, 3)
    assert {axis["name"]: axis["cells"] for axis in document["axes"]} == {"x": 3, "y": 2}
    code, box = table.at((0.01, 0.2))
    row, column = int((0.2 - 0.05) / 0.1), int((0.01 + 0.2) / 0.1)
    assert (code, box.stiffness) == (0, K[row, column])
    assert document["status"][row][column] == "ok"
    assert set(table.status) == {OK, OUT_OF_REACH}
    assert len({len(values) for values in columns.values()}) == 1
    assert len(columns["x_m"]) == (table.level > 0).sum() * 3 + (table.level == 0).sum()
    assert data["band_damping_min"].dims == ("y_m", "x_m", "sector", "band")
    assert data["stiffness_max"].sel(x_m=0.0375, y_m=0.2375, method="nearest") == K[1, 2]
    assert "4 of 6 cells" in repr(table)


# --- how it is computed -------------------------------------------------------------------------------


def test_cells_hang_on_neither_batches_nor_stops(tmp_path):
    job = job_of(load(MECHANISM), ranges=((-0.3, 0.1), (0.05, 0.15), None), cells=(4, 1), levels=2)
    whole = run_job(job, workers=1, batch=4)
    assert set(whole.status[:, 0]) == {OK, OUT_OF_REACH}
    kept = []

    class Stop(Exception):
        pass

    def stop(stage, done, of):
        kept.append(done)
        if done >= 3:
            raise Stop

    with pytest.raises(Stop):
        run_job(job, Store(tmp_path / "cells", job), stop, 1, batch=1)
    continued = run_job(job, Store(tmp_path / "cells", job), lambda stage, done, of: kept.append(done), 1)
    assert kept[4] == 3, "what was done is not done again"
    for one, other in ((whole, continued), (whole, run_job(job, workers=2, batch=2, patience=-1.0))):
        np.testing.assert_array_equal(one.values, other.values)
        np.testing.assert_array_equal(one.status, other.status)
        assert one.notes == other.notes


def test_questions_differ_where_cells_do():
    device = load(MECHANISM)
    changed = [{"levels": 5}, {"margin": 0.1}, {"directions": 2}, {"cells": (3, 3)}, {"seed": 2}]
    questions = {job_of(device, **({"cells": (4, 3)} | one)).question for one in ({}, *changed)}
    questions.add(job_of(device.with_({"loop.delay_samples": 1}), cells=(4, 3)).question)
    assert len(questions) == 7


# --- refusals -----------------------------------------------------------------------------------------


def test_a_device_that_is_never_stable_has_no_cell():
    slow = load(MECHANISM).with_({"loop.delay_samples": 10, "mechanism.damping": {"mode_ratio": 0.0}})
    found = safe_walls(slow, x=(-0.02, 0.02), y=(0.2, 0.22), cells=(1, 1), workers=1)
    assert found.status.tolist() == [NO_VALUE]
    assert found.at((0.0, 0.21)) == (1, found.outside)
    assert found.outside.stiffness == found.outside.high == 0.0
    (reason,) = found.reasons
    assert reason.startswith("1 cell ")
    assert "is stable" in reason


def test_cells_whose_edge_rounding_hides_say_what_helps():
    """Without damping a mode that hardly moves the handle has next to no effect on the loop."""
    device = random_device("five-bar", 22)
    job = job_of(device, cells=(12, 10), levels=2)
    cell = cell_walls(job.cell_question, 38)
    assert (cell.status, cell.top) == (UNDECIDED, None)
    assert "some damping" in cell.reason
    damped = job_of(device.with_({"mechanism.damping": {"mode_ratio": 0.02}}), cells=(12, 10), levels=2)
    assert cell_walls(damped.cell_question, 38).status == OK


# --- longer -------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("kind", "cells"), [("serial-2r", (14, 10)), ("five-bar", (12, 10))])
def test_no_search_finds_an_unstable_wall_of_a_random_device(kind, cells, seed):
    device = random_device(kind, 10 + seed)
    found = safe_walls(device, cells=cells, levels=8)
    if not (found.level > 0).any():
        pytest.skip("no wall of this device is stable anywhere")
    assert try_table(found, 4 * WALLS, seed).unstable == 0
    assert search_table(found, seed, each=12, rounds=10).radius < 1.0 + ROUNDING


@pytest.mark.slow
def test_no_wall_in_space_is_unstable():
    found = safe_walls(
        random_device("delta", 1), x=(-0.03, 0.03), y=(-0.03, 0.03), z=(-0.15, -0.1), cells=(3, 3, 2), levels=6
    )
    tried = try_table(found, 4 * WALLS, 1)
    assert tried.inside > 0.9 * 4 * WALLS
    assert tried.unstable == 0
    assert search_table(found, 1, each=8, rounds=8).radius < 1.0 + ROUNDING
