"""Designs computed together are the designs computed alone, and do not hang on which are together."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from tests.study_sizes import study_size
from zwidth.chart import judge
from zwidth.device import address
from zwidth.device.load import load
from zwidth.measures import FAILED, OK, OUT_OF_REACH, impedance_range, vibration_decay
from zwidth.study import Axis, Sampling, SweepJob, Tie
from zwidth.study.designs.column import column_named

MECHANISM = ("stiffness_max", "damping_max", "stable_area", "isotropy", "rigid_mass", "acceleration_max")
PLANT = ("stiffness_max", "damping_max", "stable_area", "rigid_mass")

# Device and changes of it -> the paths that take arrays, and measures.
DEVICES = {
    "loops": ("five-bar", {}, MECHANISM[:5]),
    "given dampers": (
        "five-bar",
        {
            "mechanism.damping.given": True,
            "drives.motor-right.damping_Nms_per_rad": 2e-4,
            "drives.motor-left.damping_Nms_per_rad": 4e-4,
        },
        MECHANISM[:5],
    ),
    "a rigid drive": ("five-bar", {"drives.motor-left.stiffness_Nm_per_rad": np.inf}, MECHANISM[:5]),
    "filters and lag": (
        "five-bar",
        {
            "loop.velocity.filter": {"type": "first-order", "time_constant_s": 2e-3},
            "loop.force.filter": {"type": "butterworth", "order": 2, "cutoff_Hz": 200.0},
            "loop.actuator.time_constant_s": 5e-4,
        },
        MECHANISM[:5],
    ),
    "Kalman": (
        "published-two-mass",
        {"loop.velocity": {"method": "kalman", "acceleration_noise_m_per_s2": 50.0, "position_noise_m": 1e-5}},
        PLANT,
    ),
    "masses": ("published-two-mass", {"loop.delay_samples": 0.7}, PLANT),
    "held": (
        "published-two-mass",
        {
            "operator": {
                "arm_mass_kg": 1.0,
                "arm_stiffness_N_per_m": 300.0,
                "arm_damping_Ns_per_m": 5.0,
                "grasp_stiffness_N_per_m": 4000.0,
                "grasp_damping_Ns_per_m": 4.0,
            }
        },
        PLANT,
    ),
    "an arm": ("hapkit-course", {}, ("stiffness_max", "stable_area", "rigid_mass")),
}
FEW = 12  # designs of a random job
LEFT_OUT = ("workspace", "direction", "sources", "friction", "assemblies")


def job_of(name, axes, size, measures):
    device = load(name)
    document = {key: value for key, value in device.document.items() if key != "sources"}
    columns = tuple(column_named(one) for one in measures)
    return SweepJob(document, device.label, {}, Sampling(axes, size), columns, None, None, {})


def random_axes(document, rng, spread):
    """Some numbers of a device around their values, and now and then one as it cannot be."""
    numbers = {
        path: value
        for path, value in address.numeric_addresses(document).items()
        if value and np.isfinite(value) and not any(part in LEFT_OUT for part in path.split("."))
    }
    chosen = rng.choice(sorted(numbers), size=min(len(numbers), int(rng.integers(2, 7))), replace=False)
    for path in chosen:
        value = numbers[path]
        if isinstance(value, int):
            yield Axis(str(path), (value, value + 1))
        else:
            yield Axis(str(path), (), tuple(sorted((value * (1.0 - spread), value * (1.0 + spread)))))


def random_job(kind, seed, size):
    name, changes, measures = DEVICES[kind]
    rng = np.random.default_rng(seed)
    device = load(name, changes)
    document = {key: value for key, value in device.document.items() if key != "sources"}
    axes = tuple(random_axes(document, rng, float(rng.choice([0.1, 0.5, 1.2]))))
    columns = tuple(column_named(one) for one in measures)
    return SweepJob(document, device.label, {}, Sampling(axes, size, seed), columns, None, None, {})


def alone(job):
    found = [[job._found_alone(n, one) for one in job.columns] for n in range(job.count)]
    return np.array([[one[0] for one in row] for row in found]), np.array(
        [[one[1] for one in row] for row in found]
    )


@cache
def job_and_answers(kind, seed, size):
    """A random job, and what its designs have together."""
    job = random_job(kind, seed, size)
    return job, job.compute(0, job.count)


def together_is_alone(kind, seed, size):
    job, together = job_and_answers(kind, seed, size)
    values, status = alone(replace(job, _cache={}))
    assert np.array_equal(together.status, status)
    np.testing.assert_allclose(together.values, values, rtol=1e-9)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", DEVICES)
def test_designs_together_are_the_designs_alone(kind, seed):
    together_is_alone(kind, seed, FEW)


@pytest.mark.slow
@pytest.mark.parametrize("kind", DEVICES)
def test_many_designs_together_are_the_designs_alone(kind):
    for seed in range(study_size(continuous=3, full=20)):
        together_is_alone(kind, seed, 24)


def wall_job(kind, seed, size):
    """A sweep for the decay at walls that differ from design to design, too."""
    job = random_job(kind, seed, size)
    walls = Axis("stiffness_N_per_m", (), (10.0, 20000.0)), Axis("damping_Ns_per_m", (), (0.0, 20.0))
    columns = tuple(column_named(one) for one in ("spectral_radius", "decay_time"))
    return replace(job, columns=columns, sampling=Sampling((*job.sampling.axes, *walls), size, seed))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("kind", DEVICES)
def test_walls_of_designs_decay_as_each_alone(kind, seed):
    job = wall_job(kind, seed, 40)
    together = job.compute(0, job.count)
    cells = [[job._found_alone(n, one) for one in job.columns] for n in range(job.count)]
    assert together.status.tolist() == [[status for _, status, _ in row] for row in cells]
    np.testing.assert_allclose(together.values, [[value for value, _, _ in row] for row in cells], rtol=1e-9)
    for column, notes in enumerate(together.notes):
        assert {note.reason for note in notes} == {row[column][2] for row in cells} - {""}


@pytest.mark.parametrize("kind", ["loops", "filters and lag", "a rigid drive", "held"])
def test_only_walls_near_the_circle_are_judged_alone(kind, monkeypatch):
    judged = []
    monkeypatch.setattr(vibration_decay, "judge", lambda *arguments: judged.append(arguments) or judge(*arguments))
    job = wall_job(kind, 3, 60)
    taken = sum(len(group.rows) for group in job._grouping.groups(list(job._design_columns(0, 60))))
    job.compute(0, 60)
    assert taken == 60
    assert len(judged) < 6


@pytest.mark.parametrize("kind", ["loops", "filters and lag", "masses"])
def test_results_do_not_hang_on_how_designs_are_split(kind):
    job, rng = random_job(kind, 7, 40), np.random.default_rng(1)
    whole = job.compute(0, job.count)
    for _ in range(4):
        ends = [0, *sorted(rng.choice(np.arange(1, job.count), 5, replace=False)), job.count]
        fresh = replace(job, _cache={})
        parts = [fresh.compute(int(first), int(last)) for first, last in pairwise(ends)]
        assert np.array_equal(np.concatenate([part.status for part in parts]), whole.status)
        assert np.array_equal(np.concatenate([part.values for part in parts]), whole.values, equal_nan=True)


def test_a_0_among_coordinates_is_a_number_as_any_other():
    """A computer without delay is another than one with; an origin at 0 is none but an origin."""
    job = job_of(
        "five-bar",
        (Axis("links.upper-left.origin_m.0", (-0.01, 0.0, 0.01)), Axis("loop.delay_samples", (0.0, 1.0))),
        None,
        ("stiffness_max", "stable_area"),
    )
    groups = list(job._grouping.groups(list(job._design_columns(0, job.count))))
    assert [group.rows.tolist() for group in groups] == [[1, 3, 5], [0, 2, 4]]
    together = job.compute(0, job.count)
    values, status = alone(replace(job, _cache={}))
    assert np.array_equal(together.status, status)
    np.testing.assert_allclose(together.values, values, rtol=1e-9)


def test_a_plant_under_many_computers_is_sampled_by_each():
    job = job_of("published-two-mass", (Axis("loop.sampling_period_s", (), (5e-4, 4e-3)),), 20, PLANT)
    together = job.compute(0, job.count)
    values, status = alone(replace(job, _cache={}))
    assert (together.status == OK).all()
    assert np.array_equal(together.status, status)
    np.testing.assert_allclose(together.values, values, rtol=1e-9)


def test_valid_designs_are_not_asked_for_alone(monkeypatch):
    job = job_of(
        "five-bar",
        (
            Axis("links.upper-right.length_m", (), (0.14, 0.155), ties=(Tie("links.upper-left.length_m"),)),
            Axis("loop.sampling_period_s", (), (2e-4, 4e-3), log=True),
            Axis("loop.delay_samples", (0.0, 0.5, 1.0, 2.5)),
            Axis("model", ("full", "two-mass")),
        ),
        40,
        ("stiffness_max", "stable_area"),
    )
    monkeypatch.setattr(SweepJob, "_found_alone", lambda *_: pytest.fail("asked for alone"))
    assert (job.compute(0, job.count).status == OK).all()


def test_arcs_that_lie_between_two_samples_are_found(monkeypatch):
    """Slow computers have such arcs; their charts were each left to the eigenvalues, one in thirty."""
    axes = (
        Axis("links.upper-right.length_m", (), (0.14, 0.155), ties=(Tie("links.upper-left.length_m"),)),
        Axis("drives.motor-left.stiffness_Nm_per_rad", (), (0.2, 2.0)),
        Axis("loop.sampling_period_s", (), (2e-3, 4e-3)),
    )
    job = job_of("five-bar", axes, 300, ("stable_area",))
    doubtful = []
    chart = impedance_range.stability_chart
    monkeypatch.setattr(impedance_range, "stability_chart", lambda *a, **k: doubtful.append(1) or chart(*a, **k))
    assert (job.compute(0, job.count).status == OK).all()
    assert len(doubtful) <= 3


@pytest.mark.parametrize("fastest", ["lengths", "computer"])
def test_designs_out_of_reach_are_told_together(fastest, monkeypatch):
    """But for those that only a way round, or a projection, may reach."""
    lengths = Axis(
        "links.upper-right.length_m",
        tuple(np.linspace(0.01, 0.147, 24).tolist()),
        ties=(Tie("links.upper-left.length_m"),),
    )
    computers = Axis("loop.sampling_period_s", (5e-4, 1e-3))
    axes = (computers, lengths) if fastest == "lengths" else (lengths, computers)
    job = job_of("five-bar", axes, None, ("stiffness_max", "isotropy"))
    values, status = alone(replace(job, _cache={}))
    asked = []
    one = SweepJob._found_alone
    monkeypatch.setattr(
        SweepJob, "_found_alone", lambda self, number, _: asked.append(number) or one(self, number, _)
    )
    together = job.compute(0, job.count)
    assert np.array_equal(together.status, status)
    np.testing.assert_allclose(together.values, values, rtol=1e-9)
    missed = int((status[:, 0] == OUT_OF_REACH).sum())
    assert missed > job.count / 4
    assert len(set(asked)) < missed / 4


def test_a_position_out_of_reach_of_the_only_mechanism_is_told_of_all_designs(monkeypatch):
    job = job_of("five-bar", (Axis("loop.sampling_period_s", (5e-4, 1e-3)),), None, ("stiffness_max", "isotropy"))
    job = replace(job, fixed_circumstances={"at": (0.5, 0.5)})
    monkeypatch.setattr(SweepJob, "_found_alone", lambda *_: pytest.fail("asked for alone"))
    assert (job.compute(0, job.count).status == OUT_OF_REACH).all()


def test_some_designs_fail_and_some_do_not():
    seen = {
        int(one)
        for kind in DEVICES
        for seed in range(3)
        for one in np.unique(job_and_answers(kind, seed, FEW)[1].status)
    }
    assert {OK, FAILED} < seen
