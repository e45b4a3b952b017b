"""Many designs: each is what the device's file with those numbers gives, and failures are data."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from tests.study.executor_cases import same_cells
from tests.study.study_cases import (
    FIVE_BAR,
    LEFT_LENGTH,
    RIGHT_LENGTH,
    TWO_MASS,
    axis,
    numbers_match_status,
    study,
    study_document,
)
from zwidth.chart import largest_stiffness
from zwidth.device import Device
from zwidth.device.load import load
from zwidth.errors import MeasureError
from zwidth.loop import OperatingPoint
from zwidth.measures import FAILED, NO_VALUE, OK, OUT_OF_REACH, STATUS, Measure, WantedWall, evaluate
from zwidth.model import effective_parameters
from zwidth.study import (
    Store,
    Sweep,
    over_the_workspace,
    run_job,
    run_study,
    study_of,
    sweep,
    sweep_job,
    workspace_map,
)

LENGTHS = axis(
    RIGHT_LENGTH, range=[0.11, 0.18], count=4, tie=[LEFT_LENGTH, {"key": "links.upper-left.mass_kg", "power": 1}]
)
ASSEMBLIES = axis("assembly", "elbows-out", "elbows-in")


def run_axes(*axes, **more) -> Sweep:
    return run_study(study(*axes, **more), workers=1)


def stiffest(device: Device, *asked, **circumstances) -> float:
    peak = largest_stiffness(device.at(*asked, **circumstances).loop)
    assert peak is not None
    return peak.stiffness


def test_each_design_is_the_device_file_with_its_numbers():
    """By the ordinary way: load with --set, place, chart."""
    found = run_axes(LENGTHS, ASSEMBLIES, measures=["stiffness_max", "rigid_mass"]).dataset()
    mass = load(FIVE_BAR).document["mechanism"]["links"][2]["mass_kg"]
    for length in found[RIGHT_LENGTH].values:
        settings = [
            (RIGHT_LENGTH, length),
            (LEFT_LENGTH, length),
            ("links.upper-left.mass_kg", mass * length / 0.147),
        ]
        device = load(FIVE_BAR, settings)
        for name in found["assembly"].values:
            cell = found.sel({RIGHT_LENGTH: length, "assembly": name})
            assert float(cell["stiffness_max"]) == pytest.approx(stiffest(device, assembly=name), rel=1e-9)
            posture = device.at(assembly=name).posture
            assert device.mechanism is not None
            mass_here = effective_parameters(device.mechanism, posture, device.direction()).rigid_mass
            assert float(cell["rigid_mass"]) == pytest.approx(float(mass_here), rel=1e-12)
    assert (found["stiffness_max_status"] == OK).all()


def test_circumstances_are_those_asked_for():
    axes = (
        axis("at", [0.0, 0.25], [0.05, 0.2]),
        axis("direction", [0, 1], [1, 0], [3, 4]),
        axis("model", "full", "rigid"),
        axis("operator", "none", "thesis-arm"),
    )
    found = run_axes(*axes, measures=["stiffness_max"])
    values = found.cells.values[:, 0].reshape(2, 3, 2, 2)
    for i, at in enumerate([(0.0, 0.25), (0.05, 0.2)]):
        for j, direction in enumerate([(0, 1), (1, 0), (3, 4)]):
            for k, model in enumerate(["full", "rigid"]):
                for m, operator in enumerate(["none", "thesis-arm"]):
                    device = load(FIVE_BAR, (), operator)
                    expected = stiffest(device, at, direction, model=model)
                    assert values[i, j, k, m] == pytest.approx(expected, rel=1e-9)


def test_an_axis_of_the_computer_and_the_study_s_own_circumstances():
    axes = axis("loop.delay_samples", 0.0, 0.7), axis("loop.sampling_period_s", range=[2e-4, 2e-3], count=3)
    found = run_axes(
        *axes,
        measures=["stiffness_max"],
        at=[0.04, 0.22],
        direction=[1, 1],
        set=["drives.motor-left.stiffness_Nm_per_rad=0.9"],
    )
    for n in range(6):
        settings = [*found.design(n).items(), ("drives.motor-left.stiffness_Nm_per_rad", 0.9)]
        expected = stiffest(load(FIVE_BAR, settings), (0.04, 0.22), (1, 1))
        assert found.cells.values[n, 0] == pytest.approx(expected, rel=1e-9)


def test_a_posture_that_is_known_is_not_another_design_s():
    """Numbers of the computer leave a posture as it is; those of the mechanism, and the place, do not."""
    axes = (
        axis(RIGHT_LENGTH, 0.12, 0.16),
        axis("loop.delay_samples", 0.0, 1.0),
        axis("at", [0.0, 0.25], [0.05, 0.2]),
    )
    columns = ["rigid_mass", "average(rigid_mass)"]
    job = sweep_job(study(*axes, measures=columns, workspace={"count": 3}))
    together = job.compute(0, 8)
    alone = [job_of.compute(n, n + 1) for n in range(8) if (job_of := pickle.loads(pickle.dumps(job)))]
    assert np.array_equal(together.values, np.concatenate([one.values for one in alone]))
    assert len(set(together.values[:, 0])) == 4
    assert len(set(together.values[:, 1])) == 2


def test_the_wanted_wall_may_be_an_axis():
    wanted = Measure("wanted", "", "N/m", None, "", lambda point, wall: wall.stiffness, each=True, of_wall=True)
    job = sweep_job(study(axis("stiffness_N_per_m", range=[1e3, 2e3], count=3), damping_Ns_per_m=5.0))
    design = job.design(2)
    assert design.wall == WantedWall(2000.0, 5.0, None)
    assert evaluate(wanted.at_wall(design.wall), design.point()).values == 2000.0


def test_over_the_workspace_a_design_has_what_its_map_has():
    over = ["average", "worst", "best", "uniformity", "variation", "share", "conditioning_index", "isotropy_index"]
    space = {"x_m": [-0.15, 0.15], "y_m": [0.1, 0.4], "count": [5, 4]}
    made = study(LENGTHS, measures=[f"{name}(isotropy)" for name in over], workspace=space, assembly="elbows-in")
    found = run_study(made, workers=1)
    assert made.plane is not None
    for n in (0, 3):
        device = load(FIVE_BAR, list(found.design(n).items()))
        mapped = workspace_map(device, ["isotropy"], made.plane, assembly="elbows-in", workers=1)
        assert 0 < (mapped["isotropy_status"] == OK).sum() < 20
        expected = over_the_workspace(mapped, "isotropy", device)
        assert found.cells.values[n].tolist() == [pytest.approx(expected[name], rel=1e-12) for name in over]
    assert [one.unit for one in made.columns] == [""] * 8
    assert {one.name: one.better for one in made.columns}["variation(isotropy)"] == "lower"


def test_over_the_workspace_computers_differ_too():
    """One plant at every cell, and computers along an axis of their own."""
    space = {"x_m": [-0.15, 0.15], "y_m": [0.1, 0.4], "count": [5, 4]}
    periods = axis("loop.sampling_period_s", values=[1e-3, 2e-3])
    made = study(periods, measures=["average(stiffness_max)"], workspace=space)
    found = run_study(made, workers=1)
    assert made.plane is not None
    for n in (0, 1):
        device = load(FIVE_BAR, list(found.design(n).items()))
        mapped = workspace_map(device, ["stiffness_max"], made.plane, workers=1)
        expected = over_the_workspace(mapped, "stiffness_max", device)["average"]
        assert found.cells.values[n, 0] == pytest.approx(expected, rel=1e-9)


def test_a_workspace_out_of_reach_has_no_value_and_says_so():
    space = {"x_m": [0.6, 0.7], "y_m": [0.6, 0.7], "count": 2}
    found = run_axes(LENGTHS, measures=["average(isotropy)", "share(isotropy)"], workspace=space)
    assert (found.cells.status[:, 0] == OUT_OF_REACH).all()
    assert (found.cells.values[:, 1] == 0.0).all()


def test_what_is_no_device_and_what_is_out_of_reach_is_told_and_the_rest_is_kept():
    lengths = axis(RIGHT_LENGTH, 0.01, 0.147, tie=[LEFT_LENGTH])
    masses = axis("links.distal-left.mass_kg", range=[-0.05, 0.05], count=3)
    found = run_axes(lengths, masses, measures=["stiffness_max", "isotropy"])
    assert [[STATUS[s] for s in row] for row in found.cells.status] == [
        ["failed"] * 2,
        ["out of reach"] * 2,
        ["out of reach"] * 2,
        ["failed"] * 2,
        ["ok"] * 2,
        ["ok"] * 2,
    ]
    assert numbers_match_status(found.cells.values, found.cells.status)
    (note,) = found.cells.notes[0]
    said = "mechanism.links.distal-left.mass_kg: must be at least 0, got -0.05"
    assert note.reason.startswith(f"{said} (mass; ")
    assert (note.status, note.count, note.first) == (FAILED, 2, (0,))
    assert "2 designs failed: mechanism.links.distal-left.mass_kg" in found.dataset()["isotropy"].attrs["notes"]


def test_why_a_design_failed_is_stored_with_its_values(tmp_path):
    masses = axis("links.distal-left.mass_kg", range=[-0.05, 0.05], count=3)
    job = sweep_job(study(masses, measures=["isotropy"]))
    whole = job.compute(0, 3)
    assert whole.notes[0]
    for _ in range(2):
        assert same_cells(run_job(job, Store(tmp_path / "cells", job), workers=1), whole)


def test_a_mechanism_that_moves_no_mass_is_no_device():
    """What a device file may not say, a design may not either, though its loops are not closed anew."""
    names = ["upper-right", "distal-right", "upper-left", "distal-left"]
    massless = [
        f"links.{name}.{key}=0" for name in names for key in ("mass_kg", "inertia_kg_m2") if name != names[0]
    ]
    heavy = axis("links.upper-right.mass_kg", 0.0, 0.3, tie=["links.upper-left.mass_kg"])
    inertia = ["links.upper-right.inertia_kg_m2=0"]
    made = study(
        heavy, set=[*[m for m in massless if "upper-left.mass" not in m], *inertia, "links.upper-left.mass_kg=0.3"]
    )
    found = run_study(made, workers=1)
    assert found.cells.status.tolist() == [[FAILED], [OK]]
    assert "no mass" in found.cells.notes[0][0].reason


def test_a_user_s_measure_that_raises_or_returns_the_wrong_shape_fails_in_its_cells(tmp_path):
    (tmp_path / "own.py").write_text(
        "from zwidth import measure\n"
        "@measure(unit='m')\n"
        "def spoilt(place):\n"
        "    period = place.controller.sampling_period\n"
        "    if period > 2.5e-3:\n"
        "        raise ZeroDivisionError('too slow')\n"
        "    return [1.0, 2.0] if period > 1.5e-3 else period\n"
    )
    document = study_document(axis("loop.sampling_period_s", 1e-3, 2e-3, 3e-3), measures=["spoilt", "rigid_mass"])
    found = run_study(study_of({**document, "measures_file": "own.py"}, str(tmp_path / "study.toml")), workers=1)
    assert [STATUS[s] for s in found.cells.status[:, 0]] == ["ok", "failed", "failed"]
    assert (found.cells.status[:, 1] == OK).all()
    assert found.cells.values[0, 0] == 1e-3
    reasons = [note.reason for note in found.cells.notes[0]]
    assert "of shape (2,)" in reasons[0]
    assert "ZeroDivisionError: too" in reasons[1]


def test_a_measure_that_this_device_cannot_be_asked_is_refused_before_anything_is_computed():
    periods = axis("loop.sampling_period_s", range=[1e-3, 2e-3], count=3)
    with pytest.raises(MeasureError) as caught:
        run_study(study(periods, device=TWO_MASS, measures=["manipulability", "stiffness_max", "isotropy"]))
    lines = str(caught.value).splitlines()
    assert [line.split()[0] for line in lines] == ["manipulability", "isotropy"]
    assert "needs a [mechanism]" in lines[0]


@pytest.mark.parametrize(
    ("name", "more", "said"),
    [
        ("spectral_radius", {}, "stiffness_N_per_m and damping_Ns_per_m"),
        ("felt_stiffness", {"stiffness_N_per_m": 100.0, "damping_Ns_per_m": 1.0}, "frequency_Hz"),
        ("stiffness_max_closed_form", {"operator": "thesis-arm"}, 'operator = "none"'),
    ],
)
def test_what_a_measure_wants_is_told_by_the_keys_of_a_study(name, more, said):
    with pytest.raises(MeasureError) as caught:
        run_study(study(axis("plant.mass_kg.0.0", 0.2), device=TWO_MASS, measures=[name], **more))
    assert str(caught.value).endswith(f"give {said}")


def test_a_plant_s_numbers_can_be_varied():
    coupling = axis("plant.stiffness_N_per_m.0.1", -10000.0, -15000.0, tie=[])
    found = run_axes(coupling, device=TWO_MASS, measures=["stiffness_max"])
    for n in range(2):
        expected = stiffest(load(TWO_MASS, list(found.design(n).items())))
        assert found.cells.values[n, 0] == pytest.approx(expected, rel=1e-12)


def test_no_wall_is_no_value():
    found = run_axes(axis("plant.damping_Ns_per_m", 0.0, 1.0), device="hapkit-course", measures=["stiffness_max"])
    assert set(found.cells.status[:, 0]) <= {OK, NO_VALUE}
    assert numbers_match_status(found.cells.values, found.cells.status)


def test_the_same_bits_however_it_is_cut_and_whoever_computes_it(tmp_path):
    axes = (
        axis(RIGHT_LENGTH, range=[0.01, 0.2], tie=[LEFT_LENGTH]),
        axis("loop.delay_samples", range=[0.0, 2.0]),
        ASSEMBLIES,
    )
    measures = ["stiffness_max", "isotropy", "average(rigid_mass)"]
    job = sweep_job(
        study(*axes, measures=measures, workspace={"count": 4}, sampling="latin-hypercube", count=6, seed=3)
    )
    whole = job.compute(0, 6)
    assert set(np.unique(whole.status)) > {OK}
    assert same_cells(run_job(job, workers=1, batch=1), whole)
    assert same_cells(run_job(job, Store(tmp_path / "cells", job), workers=1, batch=4), whole)
    assert same_cells(run_job(job, workers=2, batch=3, patience=-1.0), whole)


def test_the_question_is_the_study_s():
    base = sweep_job(study(LENGTHS, ASSEMBLIES)).question
    assert sweep_job(study(LENGTHS, ASSEMBLIES)).question == base
    others = [
        study(LENGTHS),
        study(ASSEMBLIES, LENGTHS),
        study(LENGTHS, ASSEMBLIES, direction=[1, 0]),
        study(LENGTHS, ASSEMBLIES, measures=["isotropy"]),
        study(LENGTHS, ASSEMBLIES, set=["loop.delay_samples=0.1"]),
        study(LENGTHS, ASSEMBLIES, stiffness_N_per_m=1.0),
    ]
    assert len({base, *(sweep_job(one).question for one in others)}) == 7


def test_a_grid_as_a_dataset():
    found = run_axes(LENGTHS, ASSEMBLIES, measures=["rigid_mass", "stiffness_max"])
    dataset = found.dataset()
    assert dataset["rigid_mass"].dims == (RIGHT_LENGTH, "assembly")
    assert dict(dataset.sizes) == {RIGHT_LENGTH: 4, "assembly": 2}
    assert dataset["stiffness_max"].attrs["unit"] == "N/m"
    assert dataset[RIGHT_LENGTH].attrs["units"] == "m"
    assert dataset[LEFT_LENGTH].dims == (RIGHT_LENGTH,)
    assert np.array_equal(dataset[LEFT_LENGTH], dataset[RIGHT_LENGTH])
    assert dataset["links.upper-left.mass_kg"].attrs["units"] == "kg"
    assert dataset["rigid_mass_status"].attrs["flag_meanings"].split()[OUT_OF_REACH] == "out_of_reach"
    for n in range(8):
        design = found.design(n)
        cell = dataset.sel({RIGHT_LENGTH: design[RIGHT_LENGTH], "assembly": design["assembly"]})
        assert float(cell["rigid_mass"]) == found.cells.values[n, 0]


def test_a_hypercube_and_lists_as_a_dataset():
    centre = {"key": "links.upper-left.center_of_mass_m", "power": 1}
    spans = axis(RIGHT_LENGTH, range=[0.1, 0.2], tie=[centre]), axis("at", [0.0, 0.25], [0.05, 0.2])
    dataset = run_axes(*spans, sampling="latin-hypercube", count=6).dataset()
    assert dataset["rigid_mass"].dims == ("design",)
    assert dataset[RIGHT_LENGTH].dims == ("design",)
    assert set(dataset["at"].values) == {"0, 0.25", "0.05, 0.2"}
    assert set(dataset["at_x"].values) == {0.0, 0.05}
    ratio = dataset["links.upper-left.center_of_mass_m.0"] / dataset[RIGHT_LENGTH]
    assert np.allclose(ratio, -0.04565 / 0.147, rtol=1e-12)


def test_designs_that_are_measured_together_are_not_cut_apart(monkeypatch):
    """To cut one design's point out of those of many takes far longer than to measure it."""
    cuts, cut = [], OperatingPoint.__getitem__
    monkeypatch.setattr(OperatingPoint, "__getitem__", lambda self, at: (cuts.append(at), cut(self, at))[1])
    lengths = np.linspace(0.14, 0.155, 60).tolist()
    found = sweep(load("five-bar"), {"links.upper-right.length_m": lengths}, "rigid_mass", workers=1)
    assert np.isfinite(found["rigid_mass"].values).all()
    assert [at for at in cuts if np.ndim(at) == 0] == []
