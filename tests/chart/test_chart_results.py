"""What charts of every kind share: their document, their table, how they show themselves, and their verdicts."""

import json
from functools import cache

import numpy as np
import pytest

from tests.measured_cases import measured_response
from tests.multi_loops import random_multi, side_by_side
from tests.systems import mass, published, two_mass
from zwidth.chart import judge, measured_chart, multi_chart, robust_chart, stability_chart
from zwidth.chart.chart_base import Chart
from zwidth.chart.verdict import STABLE, UNSTABLE
from zwidth.loop import Controller, Loop, MultiLoop

SHARED = {
    "regions",
    "boundary",
    "stiffness_max_N_per_m",
    "damping_at_stiffness_max_Ns_per_m",
    "frequency_at_stiffness_max_Hz",
    "frequencies_at_stiffness_max_Hz",
    "damping_max_Ns_per_m",
    "stable_area_N2s_per_m2",
    "fastest_decay",
    "fastest_decay_in_first_quadrant",
    "unobserved_modes",
}
ROBUST = {"members_at_stiffness_max", "failed", "binding", "best_by_area", "best_by_stiffness", "lost_share"}
MEASURED = {"integrators", "measured_stiffness_max_N_per_m", "interpolation_error", "band", "unusable", "closed"}
COLUMNS = ["arc", "stiffness_N_per_m", "damping_Ns_per_m", "frequency_Hz"]
KINDS = ("single", "several", "robust", "measured", "nothing")


@cache
def chart_of_kind(kind):
    """A chart of each kind, and one without a stable wall."""
    controller = Controller(0.00125)
    match kind:
        case "single":
            return stability_chart(published())
        case "several":
            plants = two_mass(0.3, 0.03, 2e4, 1.0), two_mass(0.1, 0.08, 5e3, 0.2)
            return multi_chart(MultiLoop(side_by_side(*plants), controller))
        case "robust":
            return robust_chart([Loop(mass(m, 0.1), controller) for m in (0.2, 0.1, 0.3)])
        case "measured":
            response, computer = measured_response(published())
            known = np.full(len(response.frequency), 0.999)
            return measured_chart(type(response)(response.frequency, response.value, coherence=known), computer)
        case _:
            return stability_chart(Loop(two_mass(0.3, 0.03, 2e4), Controller(0.00125, 1.0)))


@pytest.mark.parametrize("kind", KINDS)
def test_the_document_holds_the_chart_under_the_promised_keys(kind):
    chart = chart_of_kind(kind)
    assert isinstance(chart, Chart)
    document = chart.document()
    more = {"robust": ROBUST, "measured": MEASURED}.get(kind, set())
    assert set(document) >= SHARED | more
    assert json.loads(json.dumps(document)).keys() == document.keys()
    assert [np.array(ring).tolist() for ring in document["regions"]] == [ring.tolist() for ring in chart.regions]
    np.testing.assert_equal(document["stiffness_max_N_per_m"], chart.stiffness_max)
    assert document["stable_area_N2s_per_m2"] == chart.stable_area
    assert len(document["boundary"]) == len(chart.boundary)
    for entry, arc in zip(document["boundary"], chart.boundary, strict=True):
        assert entry["frequency_Hz"] == arc.frequency.tolist()
        assert ("member" in entry) == (kind == "robust")
        assert ("stiffness_low_N_per_m" in entry) == (kind == "measured")
    frequencies = document["frequencies_at_stiffness_max_Hz"]
    assert document["frequency_at_stiffness_max_Hz"] == (min(frequencies) if frequencies else None)
    assert (frequencies is None) == np.isnan(chart.stiffness_max) == (kind == "nothing")


@pytest.mark.parametrize("kind", KINDS)
def test_the_table_holds_every_wall_of_the_edge(kind):
    chart = chart_of_kind(kind)
    table = chart.table()
    own = {"robust": {"member"}, "measured": {"stiffness_low_N_per_m", "stiffness_high_N_per_m"}}.get(kind, set())
    assert set(table) == {*COLUMNS, *own}
    count = sum(len(arc.stiffness) for arc in chart.boundary)
    assert {len(values) for values in table.values()} == {count}
    for number, arc in enumerate(chart.boundary):
        rows = np.flatnonzero(np.array(table["arc"]) == number)
        assert [table["damping_Ns_per_m"][k] for k in rows] == arc.damping.tolist()
        if kind == "robust":
            assert {table["member"][k] for k in rows} == {arc.member} <= set(chart.binding)
        if kind == "measured":
            low = [table["stiffness_low_N_per_m"][k] for k in rows]
            straight = arc.stiffness_low is None
            assert low == ([None] * len(rows) if straight else arc.stiffness_low.tolist())


def test_a_robust_verdict_is_the_worst_of_all_members():
    chart = chart_of_kind("robust")
    K = chart.stiffness_max * np.array([0.5, 0.999, 1.001, 2.5, 10.0])
    B = np.full(5, chart.damping_at_stiffness_max)
    found = chart.check(K, B)
    each = [judge(loop, K, B) for loop in chart.members.values()]
    assert found.verdict.tolist() == [STABLE, STABLE, UNSTABLE, UNSTABLE, UNSTABLE]
    np.testing.assert_array_equal(found.spectral_radius, np.max([one.spectral_radius for one in each], axis=0))
    worst = [int(np.argmax([one.spectral_radius[k] for one in each])) for k in range(5)]
    assert found.frequency.tolist() == [each[m].frequency[k] for k, m in enumerate(worst)]
    assert np.array_equal(chart.spectral_radius(K, B), found.spectral_radius)


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_a_wall_of_several_directions_is_judged_by_eigenvalues(seed):
    loop = random_multi(seed)
    chart = multi_chart(loop)
    low, high = np.array(chart.box).reshape(2, 2).T
    walls = np.random.default_rng(seed).uniform(low, high, (50, 2))
    found = chart.check(*walls.T)
    z = np.linalg.eigvals(loop.transition_matrix(*walls.T))
    largest = np.abs(z).max(axis=-1)
    assert found.spectral_radius == pytest.approx(largest, rel=1e-12)
    assert found.verdict.tolist() == np.where(largest < 1.0, STABLE, UNSTABLE).tolist()
    assert np.all(found.frequency <= 0.5 / loop.period * (1.0 + 1e-12))
