"""Optimisations of plants and mechanisms, against closed forms and against random designs."""

import numpy as np
import pytest

from tests.study.study_cases import axis, study_document
from zwidth.device import OPERATORS, bundled_names
from zwidth.device.load import load
from zwidth.errors import DeviceError, StoreError
from zwidth.measures import OK
from zwidth.study import (
    Judge,
    gradients,
    neighbouring_designs,
    optimise,
    problem_of,
    run_job,
    share_of,
    study_of,
    study_to_optimise,
    values_at,
)

TWO_MASS = "published-two-mass"
LINKS = [
    "links.upper-left.length_m",
    *({"key": f"links.upper-{side}.mass_kg", "power": 1} for side in ("right", "left")),
    *({"key": f"links.upper-{side}.inertia_kg_m2", "power": 3} for side in ("right", "left")),
]
LENGTH = axis("links.upper-right.length_m", range=[0.10, 0.20], tie=LINKS)
RATIO = axis(
    "drives.motor-right.transmission_ratio", range=[8.0, 30.0], tie=["drives.motor-left.transmission_ratio"]
)
TASK = {"box_m": [[-0.03, 0.03], [0.21, 0.27]], "count": 3, "directions": 2}


def problem_study(*axes, objectives, task=None, **more):
    limits = {key: more.pop(key) for key in ("budget", "seed", "constraints", "front") if key in more}
    document = study_document(*axes, optimise={"objectives": objectives, **limits}, **more)
    del document["measures"]
    if task is not None:
        document["task"] = task
    return study_of(document, bounds=True)


def judged(study, shares):
    judge = Judge(problem_of(study))
    return judge.judge(run_job(judge.job(values_at(study.sampling.axes, shares)), workers=1))


@pytest.mark.parametrize(
    ("wall", "mass", "radius"),
    [
        ((3000.0, 15.0), 0.0510576, 0.895606),
        ((4000.0, 20.0), 0.0602998, 0.872978),
        ((5000.0, 25.0), 0.0698500, 0.853952),
    ],
)
def test_the_optimal_mass_of_the_thesis_is_found(wall, mass, radius):
    # equations 5.14 and 5.15, points B, C and D of 5.3.2
    found = optimise(
        problem_study(
            axis("plant.mass_kg.1.1", range=[0.01, 0.2]),
            device=TWO_MASS,
            model="motor-mass",
            set=["plant.damping_Ns_per_m=unset"],
            objectives={"spectral_radius": "min"},
            stiffness_N_per_m=wall[0],
            damping_Ns_per_m=wall[1],
            budget=400,
        ),
        workers=1,
    )
    assert found.design(0)["plant.mass_kg.1.1"] == pytest.approx(mass, rel=2e-6)
    assert found.values[0, 0] == pytest.approx(radius, rel=1e-6)
    assert found.baseline.values[0, 0] > radius + 0.05


def test_the_stiffest_wall_of_a_mass_and_a_period_lies_at_both_bounds():
    # K_max = 4 (3 - 2 sqrt 2) m / T^2 of an undamped mass: as heavy and as fast as allowed
    found = optimise(
        problem_study(
            axis("plant.mass_kg", range=[0.05, 0.3]),
            axis("loop.sampling_period_s", range=[0.0005, 0.002], scale="log"),
            device="hapkit-course",
            set=["plant.damping_Ns_per_m=0.0", "operator=unset"],
            objectives={"stiffness_max": "max"},
            budget=200,
        ),
        workers=1,
    )
    assert found.design(0) == {"plant.mass_kg": 0.3, "loop.sampling_period_s": 0.0005}
    assert found.values[0, 0] == pytest.approx(4.0 * (3.0 - 2.0 * np.sqrt(2.0)) * 0.3 / 0.0005**2, rel=1e-9)
    assert [line.split(" at its ") for line in found.active(0)] == [
        ["plant.mass_kg", "upper bound"],
        ["loop.sampling_period_s", "lower bound"],
    ]


def test_an_end_of_a_list_of_numbers_holds_a_design_back():
    given = {"device": "hapkit-course", "objectives": {"stiffness_max": "max"}, "budget": 20}
    for values, held in (
        ((0.2, 0.3, 0.1), ["plant.mass_kg at the largest of its values"]),
        ((0.3, 0.2, 0.1), ["plant.mass_kg at the largest of its values"]),
        ((0.2,), []),
    ):
        study = problem_study(axis("plant.mass_kg", *values), **given)
        assert optimise(study, workers=1).active(0) == held, values
    light = problem_study(axis("plant.mass_kg", 0.2, 0.3), **(given | {"objectives": {"stiffness_max": "min"}}))
    assert [line.split(" of ")[0].split(" at the ") for line in optimise(light, workers=1).active(0)] == [
        ["plant.mass_kg", "smallest"]
    ]
    # names of parts, and texts, have no ends
    method = axis("loop.velocity.method", "backward-difference", "central-difference")
    assert optimise(problem_study(method, **given), workers=1).active(0) == []


def front_study(budget=400, **more):
    return problem_study(
        LENGTH,
        RATIO,
        objectives={"stiffness_max": "max", "isotropy": "min"},
        constraints={"rigid_mass": "<= 0.36"},
        task=TASK,
        budget=budget,
        front=8,
        **more,
    )


@pytest.fixture(scope="module")
def front():
    return optimise(front_study(), workers=1)


@pytest.fixture(scope="module")
def rough_front():
    """A front of a quarter of the designs, for what does not ask how good they are."""
    return optimise(front_study(budget=100), workers=1)


def test_stiffness_and_dexterity_cannot_be_had_together(front):
    # the thesis's finding (5.3), as a front: what is stiffer is less isotropic
    stiffness, isotropy, mass = front.values.T
    assert len(front.front) == 8
    assert (np.diff(stiffness) < 0).all()
    assert (np.diff(isotropy) < 0).all()
    assert (mass <= 0.36).all()
    assert stiffness.max() / stiffness.min() > 1.005
    assert 0 <= front.knee < 8


def test_a_front_s_values_are_those_of_single_devices_at_single_points(front):
    for place in (0, front.knee):
        device = load("five-bar").with_(front.settings(place))
        points = [
            device.at((x, y), u) for x in (-0.03, 0.0, 0.03) for y in (0.21, 0.24, 0.27) for u in ((0, 1), (1, 0))
        ]
        stiffness = min(float(point.measure("stiffness_max")) for point in points)
        others = [max(float(point.measure(name)) for point in points) for name in ("isotropy", "rigid_mass")]
        np.testing.assert_allclose(front.values[place], [stiffness, *others], rtol=1e-10)


def test_derivatives_of_the_polish_are_those_of_the_sensitivities():
    device = load("five-bar")
    study = problem_study(
        axis("drives.motor-right.motor_inertia_kg_m2", range=[1e-6, 3e-6]),
        axis("loop.sampling_period_s", range=[0.001, 0.002]),
        objectives={"stiffness_max": "max"},
        budget=20,
    )
    axes, free = study.sampling.axes, np.arange(2)
    own = [device.document["mechanism"]["drives"][0]["motor_inertia_kg_m2"], 0.00125]
    shares = np.array([share_of(one, value) for one, value in zip(axes, own, strict=True)])
    here, around = judged(study, shares[None]).values[0], judged(study, neighbouring_designs(shares, free)).values
    slopes = gradients(shares, free, here, around)[0]
    known = {one.path: one.logarithmic for one in device.sensitivities().numbers}
    for one, slope, value in zip(axes, slopes, own, strict=True):
        low, high = one.span
        exact = next(known[path] for path in known if path.endswith(one.key))
        assert slope * value / ((high - low) * here[0]) == pytest.approx(exact, rel=1e-6)


def test_two_runs_into_one_folder_are_not_mixed(tmp_path):
    study = problem_study(RATIO, objectives={"stiffness_max": "max"}, budget=20)
    refused = []

    def beside(stage, done, of):
        if not refused:
            with pytest.raises(StoreError) as caught:
                optimise(study, tmp_path / "kept", workers=1)
            refused.append(str(caught.value))

    first = optimise(study, tmp_path / "kept", beside, workers=1)
    assert "another run" in refused[0] or "process" in refused[0]
    other = problem_study(RATIO, objectives={"stiffness_max": "max"}, budget=20, seed=2)
    with pytest.raises(StoreError, match="another study"):
        optimise(other, tmp_path / "kept", workers=1)
    assert optimise(study, tmp_path / "kept", workers=1).values.tobytes() == first.values.tobytes()


@pytest.mark.parametrize(
    "change",
    [
        {"budget": 21},
        {"seed": 2},
        {"front": 3},
        {"constraints": {"rigid_mass": "<= 9"}},
        {"set": ["loop.delay_samples=1"]},
    ],
)
def test_another_study_is_refused_before_anything_is_computed(tmp_path, change):
    given = {"objectives": {"stiffness_max": "max"}, "budget": 20}
    first = optimise(problem_study(RATIO, **given), tmp_path / "kept", workers=1)
    wider = axis(RATIO["key"], range=[8.0, 31.0], tie=RATIO["tie"])
    told = []
    for other in (problem_study(RATIO, **(given | change)), problem_study(wider, **given)):
        with pytest.raises(
            StoreError,
            match=rf"^{tmp_path}/kept: keeps finished",
        ):
            optimise(other, tmp_path / "kept", lambda *now: told.append(now), workers=1)
    assert told == []
    assert optimise(problem_study(RATIO, **given), tmp_path / "kept").values.tobytes() == first.values.tobytes()


def test_random_designs_nearby_and_anywhere_do_not_dominate_the_front(front):
    random = np.random.default_rng(11)
    costs = front.judgement.costs(front.problem)[front.front]
    for reach, many in ((0.01, 60), (0.1, 60), (1.0, 60)):
        around = np.repeat(front.shares[front.front], -(-many // len(front.front)), axis=0)
        tried = np.clip(around + reach * random.uniform(-1.0, 1.0, around.shape), 0.0, 1.0)
        other = judged(front.study, tried)
        kept = ~other.violations(front.problem).any(axis=1)
        rivals = other.costs(front.problem)[kept]
        better = (rivals[:, None] < costs - 1e-7 * np.abs(costs)).all(axis=-1)
        assert not better.any(), reach


def test_equal_studies_give_equal_bits_and_another_seed_nearly_the_same(front, rough_front):
    again = optimise(rough_front.study, workers=1)
    assert again.shares.tobytes() == rough_front.shares.tobytes()
    assert again.values.tobytes() == rough_front.values.tobytes()
    other = optimise(front_study(seed=2), workers=1)
    assert other.shares.tobytes() != front.shares.tobytes()
    reference = np.array([0.0, 3.0])
    assert other.hypervolume(reference) == pytest.approx(front.hypervolume(reference), rel=2e-3)


def test_a_run_that_was_stopped_goes_on_and_ends_with_the_same_bits(rough_front, tmp_path):
    class Stop(Exception):
        pass

    def stop(stage, done, of):
        if stage == "polishing" and done > 80:
            raise Stop

    with pytest.raises(Stop):
        optimise(rough_front.study, tmp_path / "store", stop, workers=1)
    stages = []
    resumed = optimise(
        rough_front.study, tmp_path / "store", lambda stage, done, of: stages.append((stage, done)), workers=1
    )
    assert resumed.shares.tobytes() == rough_front.shares.tobytes()
    assert resumed.judgement.cells.tobytes() == rough_front.judgement.cells.tobytes()


def test_progress_counts_the_designs_of_the_budget_on_through_search_and_polish():
    told = []
    optimise(
        problem_study(RATIO, objectives={"stiffness_max": "max"}, budget=40),
        None,
        lambda *now: told.append(now),
        1,
    )
    designs = [(done, of) for stage, done, of in told if stage in ("searching", "polishing")]
    assert {stage for stage, _, _ in told} >= {"searching", "polishing"}
    assert designs == sorted(designs)
    assert {of for _, of in designs} == {40}
    assert told[-1][0].startswith("simulating walls")
    assert told[-1][1:] == (1, 1)


def test_a_design_is_judged_by_the_worst_of_all_operators():
    task = {**TASK, "operators": ["none", bundled_names(OPERATORS)[0]]}
    study = problem_study(RATIO, objectives={"stiffness_max": "max"}, task=task, budget=20)
    shares = np.array([[0.2], [0.8]])
    both = judged(study, shares)
    alone = [
        judged(
            problem_study(
                RATIO, objectives={"stiffness_max": "max"}, task={**task, "operators": [one]}, budget=20
            ),
            shares,
        )
        for one in task["operators"]
    ]
    assert (both.values == np.minimum(alone[0].values, alone[1].values)).all()
    assert both.cells.shape[-1] == 2 * alone[0].cells.shape[-1]
    assert (alone[0].values != alone[1].values).any()


def test_a_catalogue_and_whole_numbers_are_chosen_from(tmp_path):
    (tmp_path / "motors.csv").write_text("name,inertia\nlight,6e-7\nheavy,3e-6\nmiddle,1e-6\n")
    document = {
        "device": "five-bar",
        "axis": [
            {
                "key": "motor",
                "catalogue": "motors.csv",
                "set": {f"drives.motor-{side}.motor_inertia_kg_m2": "inertia" for side in ("right", "left")},
            },
            axis("loop.delay_samples", range=[0, 3], integer=True),
            axis("assembly", "elbows-in", "elbows-out"),
        ],
        "optimise": {"objectives": {"stiffness_max": "max"}, "budget": 60},
    }
    found = optimise(study_of(document, str(tmp_path / "my.toml"), bounds=True), workers=1)
    best = found.design(0)
    assert best["motor"] == "heavy"
    assert best["drives.motor-left.motor_inertia_kg_m2"] == 3e-6
    assert best["loop.delay_samples"] == 0
    every = {tuple(row) for row in found.shares.tolist()}
    assert len(every) == len(found.shares) <= 24
    assert found.baseline is None


def test_faults_of_an_optimisation_have_their_lines():
    def faults(**optimise_table):
        document = study_document(LENGTH, optimise=optimise_table)
        try:
            problem_of(study_of(document, "my.toml", bounds=True))
        except DeviceError as error:
            return [str(fault) for fault in error.faults]
        return []

    good = {"objectives": {"stiffness_max": "max"}}
    cases = [
        ({}, ": has no objectives; add such as objectives = "),
        (
            {"objectives": {"stifness_max": "max"}},
            ".objectives.stifness_max: no measure is named",
        ),
        ({"objectives": {"isotropy": "low"}}, ".objectives.isotropy: must be"),
        (
            {**good, "constraints": {"isotropy": "2"}},
            '.constraints.isotropy: must be such as "<= 0.3"',
        ),
        (
            {**good, "constraints": {"isotropy": "<= nan"}},
            ".constraints.isotropy: must be such as",
        ),
        (
            {"objectives": {"worst(isotropy)": "min"}},
            ".objectives.worst(isotropy): worst(isotropy) needs",
        ),
        ({**good, "budget": 3}, ".budget: must be at least 20 designs, got 3"),
        ({**good, "budgit": 3}, ".budgit: is not a key of [optimise]; did you mean 'budget'?"),
    ]
    for given, line in cases:
        lines = faults(**given)
        assert any(one.startswith(f"my.toml: optimise{line}") for one in lines), (lines, line)
    assert not faults(**good)
    upside_down = study_document(axis(LENGTH["key"], range=[0.2, 0.1]), optimise=good)
    no_number = study_document(axis("links.upper-right.lenght_m", range=[0.1, 0.2]), optimise=good)
    for document, line in ((upside_down, "range: must be [lower, upper]"), (no_number, "did you mean")):
        with pytest.raises(DeviceError) as caught:
            study_of(document, "my.toml", bounds=True)
        assert line in str(caught.value)


def lines_of(document):
    """All that is wrong with a study for an optimiser, one line each."""
    try:
        study_to_optimise(document, "my.toml")
    except DeviceError as error:
        return [str(fault).removeprefix("my.toml: ") for fault in error.faults]
    return []


def test_faults_of_optimise_come_together_with_all_others():
    document = {
        "device": "five-bar",
        "model": "stiff",
        "axis": [axis("links.upper-right.lenght_m", range=[0.1, 0.2])],
        "tolerance": [{"key": "loop.sampling_period_s", "distribution": "normal"}],
        "task": {"count": 3, "operators": ["no-one"]},
        "optimise": {
            "objectives": {"isotropi": "min", "stiffness_max": "most"},
            "constraints": {"reach": "1"},
            "budget": 2,
            "fronts": 3,
        },
    }
    keys = [line.split(": ")[0] for line in lines_of(document)]
    assert keys == [
        "model",
        "axis.0.key",
        "tolerance.0",
        "task.count",
        "task.operators.0",
        "optimise.objectives.isotropi",
        "optimise.objectives.stiffness_max",
        "optimise.constraints.reach",
        "optimise.budget",
        "optimise.fronts",
    ]


def test_statistics_are_taken_over_the_workspace_of_the_study():
    document = {
        "device": "five-bar",
        "axis": [RATIO],
        "workspace": {"x_m": [-0.03, 0.03], "y_m": [0.21, 0.27], "count": 3},
        "optimise": {"objectives": {"average(rigid_mass)": "min"}, "budget": 20},
    }
    found = optimise(study_to_optimise(document), workers=1)
    task = {"points_m": [[x, y] for x in (-0.03, 0.0, 0.03) for y in (0.21, 0.24, 0.27)]}
    swept = optimise(
        problem_study(RATIO, objectives={"average(rigid_mass)": "min"}, task=task, budget=20), workers=1
    )
    assert found.judgement.cells[0].shape == (1, 9)
    assert sorted(found.judgement.cells[0, 0]) == pytest.approx(sorted(swept.judgement.cells[0, 0]), rel=1e-12)
    (line,) = lines_of(document | {"optimise": {"objectives": {"rigid_mass": "min"}}})
    assert line.startswith("workspace: ")


def test_the_finer_grid_and_the_simulation_are_of_the_front(front):
    assert front.finer.values.shape == front.values.shape
    # a finer grid holds the coarser one, so that what is worst can only become worse
    assert (front.finer.values[:, 0] <= front.values[:, 0]).all()
    assert (front.finer.values[:, 1:] >= front.values[:, 1:]).all()
    assert len(front.contacts) == len(front.front)
    for place, contact in enumerate(front.contacts):
        assert contact.stiffness == pytest.approx(0.9 * front.values[place, 0], rel=1e-9)
        assert contact.stable is True
    assert (front.judgement.status[front.front] == OK).all()
