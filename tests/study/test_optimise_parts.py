"""The parts of an optimisation, each by itself: variables, fronts, violations, derivatives."""

from itertools import product

import numpy as np
import pytest

from zwidth.study import Axis, gradients, hypervolume, neighbouring_designs, settle, share_of, values_at
from zwidth.study.optimisation.evaluation import margins
from zwidth.study.optimisation.optimisation import knee, spread_out, undominated
from zwidth.study.optimisation.search import continuous, value_at

AXES = (
    Axis("linear", (), (2.0, 6.0)),
    Axis("log", (), (1e-3, 10.0), log=True),
    Axis("whole", (), (1.5, 6.0), whole=True),
    Axis("text", ("a", "b", "c")),
    Axis("motor", ("x", "y"), parts=((("p", 1.0),), (("p", 2.0),))),
)


def test_shares_and_values_of_a_variable_are_inverse():
    random = np.random.default_rng(1)
    shares = settle(AXES, random.random((200, len(AXES))))
    for row, values in zip(shares, values_at(AXES, shares), strict=True):
        back = [share_of(axis, value) for axis, value in zip(AXES, values, strict=True)]
        np.testing.assert_allclose(back, row, atol=1e-12)
    assert continuous(AXES).tolist() == [True, True, False, False, False]


def test_bounds_are_reached_exactly_and_pieces_equally_often():
    for axis in AXES[:2]:
        assert (value_at(axis, 0.0), value_at(axis, 1.0)) == axis.span
    shares = settle(AXES, (np.arange(6000)[:, None] + 0.5) / 6000 * np.ones(len(AXES)))
    for n, values in ((2, [2, 3, 4, 5, 6]), (3, ["a", "b", "c"]), (4, ["x", "y"])):
        found = [row[n] for row in values_at(AXES, shares)]
        assert [found.count(value) for value in values] == [6000 // len(values)] * len(values)


@pytest.mark.parametrize("value", [1.0, 7.0])
def test_a_value_outside_the_bounds_has_no_share(value):
    assert share_of(AXES[0], value) is None
    assert share_of(AXES[2], value) is None
    assert share_of(AXES[2], 2.5) is None
    assert share_of(AXES[3], "d") is None


@pytest.mark.parametrize("objectives", [1, 2, 3])
def test_a_front_is_what_every_pair_says(objectives):
    random = np.random.default_rng(objectives)
    costs = np.round(random.random((300, objectives)), 1)  # many are equal
    costs[::17] = np.nan
    better = [
        any((other <= row).all() and (other < row).any() for other in costs if not np.isnan(other).any())
        for row in costs
    ]
    seen, expected = set(), []
    for n, row in enumerate(costs):
        if not np.isnan(row).any() and not better[n] and tuple(row) not in seen:
            seen.add(tuple(row))
            expected.append(n)
    assert undominated(costs).tolist() == expected


def test_a_front_thinned_out_keeps_its_ends_and_its_knee():
    angle = np.linspace(0.0, np.pi / 2, 200)
    costs = 1.0 - np.stack([np.sin(angle), np.cos(angle)], axis=1)
    kept = spread_out(costs, 7)
    assert len(kept) == 7
    assert {0, 199, knee(costs)} <= set(kept.tolist())
    assert knee(costs) in (99, 100)
    gaps = np.linalg.norm(np.diff(costs[kept], axis=0), axis=1)
    assert gaps.max() < 2.5 * gaps.min()


def test_the_hypervolume_is_that_of_the_boxes_counted_cell_by_cell():
    random = np.random.default_rng(3)
    costs = random.integers(0, 8, (12, 3)).astype(float)
    cells = np.array(list(product(range(8), repeat=3)))
    counted = (costs[:, None] <= cells).all(axis=-1).any(axis=0).sum()
    assert hypervolume(costs, np.full(3, 8.0)) == pytest.approx(counted)


def test_derivatives_are_of_the_second_order_inside_and_at_the_bounds():
    random = np.random.default_rng(5)
    free = np.array([0, 2, 3])

    def values(rows):
        return np.stack([np.exp(rows @ [0.5, 0.0, 1.0, -2.0]), np.sin(3.0 * rows[:, 2])], axis=1)

    for _ in range(20):
        x = random.choice([0.0, 1.0, 0.3, 5e-5, 1.0 - 5e-5], 4)
        slope = gradients(x, free, values(x[None])[0], values(neighbouring_designs(x, free)))
        e = np.exp(x @ [0.5, 0.0, 1.0, -2.0])
        exact = np.array([[0.5 * e, e, -2.0 * e], [0.0, 3.0 * np.cos(3.0 * x[2]), 0.0]])
        np.testing.assert_allclose(slope, exact, atol=3e-7)


def test_margins_are_shares_of_the_bound():
    values = np.array([3.0, 4.0, 5.0])
    assert margins(values, 4.0, at_least=True).tolist() == [-0.25, 0.0, 0.25]
    assert margins(values, -4.0, at_least=False).tolist() == [-1.75, -2.0, -2.25]
    assert margins(values, 0.0, at_least=True).tolist() == [3.0, 4.0, 5.0]
