"""A boundary measured on a device at an operating point: who holds it, what is kept, keys, causes and repr."""

from __future__ import annotations

from dataclasses import replace
from math import isnan, nan

import pytest

from tests.systems import published
from zwidth.chart import stability_chart
from zwidth.contact import StableExtent
from zwidth.contact.boundary_experiment import EdgePoint
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.errors import ArgumentError, StoreError
from zwidth.study import Experiment, MeasuredPoint, Plan, UserPoint, measure_boundary
from zwidth.study.boundary.experiment import run_experiment
from zwidth.study.boundary.measured_boundary import Cause

FEWEST = Plan(stiffnesses=1, tips=0)


@pytest.fixture(scope="module", autouse=True)
def rough_search():
    """The stiffest wall is sought in one round of four: most of a measurement's time goes into the others."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("zwidth.contact.boundary_experiment.ZOOMS", 1)
        yield


@pytest.fixture(scope="module")
def point():
    return load("published-two-mass").at()


@pytest.fixture(scope="module")
def boundary_and_file(point, tmp_path_factory):
    """A small experiment, and the file that kept it."""
    file = tmp_path_factory.mktemp("boundary") / "run.progress"
    return measure_boundary(point, FEWEST, [UserPoint(4000.0, 2.6, "lower")], file=file), file


def test_a_point_is_measured_as_its_loop_is(point, boundary_and_file):
    found, _ = boundary_and_file
    assert found.points == run_experiment(point.loop, plan=FEWEST).points
    assert [one.edge for one in found.points] == ["lower", "upper"]
    assert all(found.deviation(one) < 1e-3 for one in found.compared_points)
    assert found.causes == ()
    (own,) = found.user_points.points
    assert own.deviation == pytest.approx(0.18, abs=0.01)


def test_what_is_done_is_kept_and_not_computed_again(point, boundary_and_file, monkeypatch):
    first, file = boundary_and_file

    def measured_again(*_):
        raise AssertionError("measured again")

    for name in ("find_stable_walls", "measure_edges", "measure_tips"):
        monkeypatch.setattr(f"zwidth.study.boundary.experiment.{name}", measured_again)
    again = measure_boundary(point, FEWEST, file=str(file))
    assert again.points == first.points
    assert again.journal_entries == 3
    assert again.user_points is None


def test_a_file_that_holds_something_else_is_left_alone(point, tmp_path):
    notes = tmp_path / "notes.txt"
    notes.write_text("my notes\n")
    with pytest.raises(StoreError, match="not the"):
        measure_boundary(point, FEWEST, file=notes)
    assert notes.read_text() == "my notes\n"


def test_trials_of_the_largest_disturbance_that_a_plan_may_have_are_run(point):
    """Half of them are larger than it."""
    found = measure_boundary(point, replace(FEWEST, disturbance=1.0, trials=6, spread=0.5))
    assert [one.edge for one in found.points] == ["lower", "upper"]
    assert all(found.deviation(one) < 0.01 for one in found.compared_points)


def test_parts_that_are_not_linear_are_left_out_one_by_one_unless_not_wanted():
    dry = from_document(
        {
            "name": "dry",
            "plant": {"mass_kg": 0.1},
            "friction": {"coulomb_N": 2.0},
            "loop": {"sampling_period_s": 0.001},
        }
    ).at()
    (cause,) = measure_boundary(dry, FEWEST).causes
    assert cause.name == "dry friction"
    assert max(abs(one.damping - other) for one, other in cause.comparisons) > 1.0
    assert measure_boundary(dry, FEWEST, causes=False).causes == ()


def test_subjects_need_somebody_who_holds_the_device(point):
    with pytest.raises(ArgumentError, match="subjects differ") as caught:
        measure_boundary(point, replace(FEWEST, subjects=2))
    assert caught.value.argument == "subjects"
    with pytest.raises(ArgumentError, match="an operator") as caught:
        measure_boundary(point, replace(FEWEST, reflex=True))
    assert caught.value.argument == "reflex"


def test_the_operator_of_the_point_holds_the_device(monkeypatch):
    asked = []

    def held_by(loop, operator, *_):
        asked.append((loop, operator))
        raise ArgumentError("push", "is asked about no further")

    monkeypatch.setattr("zwidth.study.boundary.experiment.run_experiment", held_by)
    held = load("published-two-mass").at(operator="thesis-arm")
    for one in (held, held.without_operator, held.in_model("motor-mass")):
        with pytest.raises(ArgumentError):
            measure_boundary(one, FEWEST)
    (bare, arm), (_, nobody), (_, fixed) = asked
    assert bare.plant.mass.shape == held.ungripped_plant.mass.shape
    assert arm is held.operator
    assert nobody is fixed is None  # the motor mass has no handle


def test_a_one_sided_wall_is_touched_as_usual_unless_said_otherwise():
    assert Plan.touching() == Plan(one_sided=True, push=2.0, speed=0.02)
    assert Plan.touching(push=3.0, tips=2) == Plan(one_sided=True, push=3.0, speed=0.02, tips=2)


def measured_point(K, B, edge, exact, *, low=None, high=None):
    value = K if edge == "tip" else B
    spread = (value if low is None else low, value if high is None else high)
    return MeasuredPoint(K, B, edge, *spread, 1, (value,), exact, "growing", 1e-4, 90.0)


def experiment(*points, chart=None):
    return Experiment(Plan(visible=0.0), StableExtent(4e3, 5.0, 11.0, True), points, 1, (None,), chart, (), 0)


EDGES = (measured_point(2e3, 1.0, "lower", 1.1), measured_point(2e3, 11.0, "upper", nan))
TIP = measured_point(4e3, 5.0, "tip", 4.4e3, low=3.9e3, high=4.1e3)


def test_deviations_are_shares_of_the_range_and_of_a_tip_s_stiffness():
    found = experiment(*EDGES, TIP)
    assert found.damping_range == 10.0
    assert found.deviation(EDGES[0]) == pytest.approx(0.01)
    assert found.deviation(TIP) == pytest.approx(0.4 / 4.4)
    assert found.compared_points == [EDGES[0], TIP]
    assert isnan(experiment(EDGES[0]).damping_range)
    assert experiment(EDGES[0]).compared_points == []


def test_the_stiffest_is_a_tip_where_there_is_one():
    stiffer = measured_point(5e3, 3.0, "lower", 3.0)
    assert experiment(stiffer, TIP).stiffest is TIP
    assert experiment(*EDGES, stiffer).stiffest is stiffer
    assert experiment().stiffest is None
    assert experiment().document()["stiffness_max_N_per_m"] is None


def test_keys_and_columns():
    found = experiment(*EDGES, TIP, chart=stability_chart(published(), decay=False))
    document, table = found.document(), found.table()
    assert document.keys() == {
        "points",
        "lost",
        "stiffness_max_N_per_m",
        "damping_at_stiffness_max_Ns_per_m",
        "exact_stiffness_max_N_per_m",
        "visible_m",
        "subjects",
        "measured",
        "measured_counts",
    }
    lower, _, tip = document["points"]
    assert (lower["stiffness_low_N_per_m"], lower["exact_damping_Ns_per_m"]) == (2e3, 1.1)
    assert (tip["stiffness_low_N_per_m"], tip["stiffness_high_N_per_m"]) == (3.9e3, 4.1e3)
    assert (tip["exact_stiffness_N_per_m"], tip["damping_low_Ns_per_m"]) == (4.4e3, 5.0)
    assert document["exact_stiffness_max_N_per_m"] == pytest.approx(7133.869, abs=1e-3)
    assert document["measured"] is None
    assert list(table) == list(lower)
    assert table["edge"] == ["lower", "upper", "tip"]
    assert experiment().table() == {}


def test_subjects_are_told_by_their_numbers(point):
    arm = load("published-two-mass").at(operator="thesis-arm").operator
    (told,) = replace(experiment(TIP), subjects=(arm,)).document()["subjects"]
    assert told["arm_mass"] == arm.arm_mass


def test_edges_that_appear_or_vanish_without_a_part_are_counted_apart():
    def edge(damping):
        return EdgePoint(2e3, damping, "lower", "growing", 1e-4, 90.0)

    cause = Cause("dry friction", (edge(1.0), edge(2.0), edge(nan), edge(nan)), (1.5, nan, 3.0, nan))
    assert cause.comparisons == [(cause.points[0], 1.5)]
    assert cause.unpaired_count == 2
