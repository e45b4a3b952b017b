"""Tolerances in an optimisation: bars of the front, and designs judged by the worst of those that are produced."""

import numpy as np
import pytest

from tests.study.study_cases import axis, study_document
from zwidth.device import OPERATORS, bundled_names
from zwidth.errors import DeviceError
from zwidth.show import percent
from zwidth.show.report.optimisation import optimisation_sentences
from zwidth.study import Judge, member_changes, optimise, problem_of, run_job, study_of, values_at

MASS = {"key": "plant.mass_kg", "distribution": "uniform", "plus_minus_percent": 5}
PERIOD = {"key": "loop.sampling_period_s", "distribution": "uniform", "plus_minus": 1e-5}
STIFFEST = 4.0 * (3.0 - 2.0 * np.sqrt(2.0))  # K_max T^2 / m of an undamped mass


def mass_study(*tolerances, **optimise_table):
    """The stiffest wall of an undamped mass, whose closed form is known."""
    document = study_document(
        axis("plant.mass_kg", range=[0.05, 0.3]),
        device="hapkit-course",
        set=["plant.damping_Ns_per_m=0.0", "operator=unset", "loop.sampling_period_s=0.001"],
        optimise={"objectives": {"stiffness_max": "max"}, "budget": 40, **optimise_table},
    )
    del document["measures"]
    document |= {"tolerance": list(tolerances)} if tolerances else {}
    return study_of(document, bounds=True)


def test_the_share_that_keeps_a_demand_is_that_of_the_closed_form():
    bound = STIFFEST * 0.295 / 1e-6
    found = optimise(mass_study(MASS, constraints={"stiffness_max": f">= {bound}"}), workers=1)
    changes = member_changes(found.problem.tolerances, found.bars.devices, found.problem.seed)
    m = changes.of({"plant.mass_kg": 0.3})[:, 0]
    assert found.bars.kept[0] == (m >= 0.295).mean()
    assert 0.2 < found.bars.kept[0] < 0.8
    share = percent(found.bars.kept[0])
    said = f"{share} of 64 devices within the tolerances of the best design found keep all demands"
    assert said in optimisation_sentences(found)


def test_a_design_is_judged_by_the_worst_of_those_that_are_drawn():
    study = mass_study(MASS, PERIOD, tolerance_members=8)
    problem = problem_of(study)
    judge, shares = Judge(problem), np.array([[0.0], [0.4], [1.0]])
    designs = values_at(problem.variables, shares)
    judged = judge.judge(run_job(judge.job(designs), workers=1))
    changes = member_changes(problem.tolerances, 8, problem.seed)
    for n, (mass,) in enumerate(designs):
        m, T = changes.of({"plant.mass_kg": mass, "loop.sampling_period_s": 0.001}).T
        worst = min(STIFFEST * mass / 1e-6, float((STIFFEST * m / T**2).min()))
        assert judged.values[n, 0] == pytest.approx(worst, rel=1e-9)
    alone = Judge(problem, 0)
    as_it_is = alone.judge(run_job(alone.job(designs), workers=1))
    assert (as_it_is.values > judged.values).all()


def test_operators_and_produced_devices_are_combined():
    study = mass_study(MASS, tolerance_members=3)
    document = study.document | {"task": {"operators": ["none", bundled_names(OPERATORS)[0]]}}
    document["set"] = ["plant.damping_Ns_per_m=0.0", "loop.sampling_period_s=0.001"]
    problem = problem_of(study_of(document, bounds=True))
    judge = Judge(problem)
    judged = judge.judge(run_job(judge.job([(0.1,)]), workers=1))
    assert judged.cells.shape == (1, 1, 2 * 4)
    each = []
    for name in document["task"]["operators"]:
        single = problem_of(study_of(document | {"task": {"operators": [name]}}, bounds=True))
        judge = Judge(single)
        each.append(judge.judge(run_job(judge.job([(0.1,)]), workers=1)).cells.ravel())
    assert np.array_equal(judged.cells.ravel(), np.concatenate(each))


def test_members_without_a_tolerance_are_refused():
    with pytest.raises(DeviceError, match=r"tolerance_members: needs a \[\[tolerance\]\]"):
        problem_of(mass_study(tolerance_members=3))
    with pytest.raises(DeviceError, match=r"tolerance\.0"):
        problem_of(mass_study({**MASS, "plus_minus_percent": -5}))
