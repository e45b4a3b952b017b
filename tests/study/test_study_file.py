"""Study files: what they may say."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from tests.study.study_cases import FIVE_BAR, LEFT_LENGTH, RIGHT_LENGTH, TWO_MASS, axis, study
from zwidth.device.load import load
from zwidth.study import Axis, Sampling, read_study, study_of
from zwidth.study.designs.sampling import settings, spread

DELAY = axis("loop.delay_samples", 0.0, 1.0)


def design(found, number):
    return dict(settings(found.sampling.axes, found.sampling.values(number)))


# --- what is meant ----------------------------------------------------------------------------------


def test_a_grid_has_every_combination_the_last_axis_fastest():
    found = study(axis(RIGHT_LENGTH, range=[0.1, 0.2], count=3), axis("assembly", "elbows-out", "elbows-in"))
    assert found.sampling.shape == (3, 2)
    designs = [found.sampling.values(n) for n in range(6)]
    assert designs == [(v, name) for v in (0.1, 0.15000000000000002, 0.2) for name in ("elbows-out", "elbows-in")]
    assert [one.unit for one in found.sampling.axes] == ["m", ""]


def test_ranges_keep_their_ends():
    low, high = 0.1, 0.3
    for logarithmic in (False, True):
        values = spread((low, high), 7, logarithmic=logarithmic)
        assert (values[0], values[-1]) == (low, high)
        steps = np.diff(np.log(values) if logarithmic else values)
        assert np.allclose(steps, steps[0])
    assert spread((low, high), 1) == (low,)


@pytest.mark.parametrize("seed", [None, 0, 7])
def test_a_latin_hypercube_has_one_design_in_each_part_of_each_axis(seed):
    more = {} if seed is None else {"seed": seed}
    axes = (
        axis(RIGHT_LENGTH, range=[0.1, 0.2]),
        axis("loop.sampling_period_s", range=[1e-4, 1e-2], scale="log"),
        axis("assembly", "elbows-out", "elbows-in"),
    )
    found = study(*axes, sampling="latin-hypercube", count=40, **more)
    rows = [found.sampling.values(n) for n in range(40)]
    lengths, periods, names = zip(*rows, strict=True)
    parts = np.floor(40 * (np.array(lengths) - 0.1) / 0.1)
    assert sorted(parts) == list(range(40))
    assert sorted(np.floor(40 * np.log(np.array(periods) / 1e-4) / np.log(100.0))) == list(range(40))
    assert names.count("elbows-in") == 20
    assert not np.array_equal(np.argsort(lengths), np.argsort(periods)), "axes are paired at random"
    again = study(*axes, sampling="latin-hypercube", count=40, **more)
    assert [again.sampling.values(n) for n in range(40)] == rows


def test_another_seed_gives_other_designs():
    one, other = (Sampling((Axis("a", (), (0.0, 1.0)),), 9, seed) for seed in (1, 2))
    assert one.values(0) != other.values(0)
    assert one.values(0) == Sampling((Axis("a", (), (0.0, 1.0)),), 9).values(0), "1 is what is left out"


def test_the_ends_of_a_hypercube_are_kept():
    for logarithmic in (False, True):
        one = Axis("a", (), (0.1, 0.3), logarithmic)
        ends = one.at(0.0), one.at(np.nextafter(1.0, 0.0))
        assert ends == (pytest.approx(0.1, rel=1e-15), pytest.approx(0.3, rel=1e-15))
        assert 0.1 <= min(ends) <= max(ends) <= 0.3
    assert Axis("a", ("x", "y", "z")).at(np.nextafter(1.0, 0.0)) == "z"


def test_mass_and_inertia_go_with_a_length():
    """A link of the same section: its mass goes with the length, its inertia with the cube, its centre with it."""
    link, given = "links.upper-right", load(FIVE_BAR).document["mechanism"]["links"][0]
    tie = [
        LEFT_LENGTH,
        {"key": f"{link}.mass_kg", "power": 1},
        {"key": f"{link}.inertia_kg_m2", "power": 3.0},
        {"key": f"{link}.center_of_mass_m", "power": 1},
        {"key": "links.distal-left.length_m", "factor": 1.5},
    ]
    found = study(axis(RIGHT_LENGTH, 2 * given["length_m"], tie=tie))
    changed = design(found, 0)
    assert changed[LEFT_LENGTH] == changed[RIGHT_LENGTH] == 0.294
    assert changed[f"{link}.mass_kg"] == pytest.approx(2 * given["mass_kg"], rel=1e-15)
    assert changed[f"{link}.inertia_kg_m2"] == pytest.approx(8 * given["inertia_kg_m2"], rel=1e-15)
    assert changed[f"{link}.center_of_mass_m"] == pytest.approx(
        [2 * x for x in given["center_of_mass_m"]], rel=1e-15
    )
    assert changed["links.distal-left.length_m"] == 1.5 * 0.294


def test_powers_speak_of_the_file_as_it_is_set():
    found = study(
        axis(RIGHT_LENGTH, 0.3, tie=[{"key": LEFT_LENGTH, "power": 2}]),
        set=["links.upper-right.length_m=0.1", f"{LEFT_LENGTH}=0.2"],
    )
    assert design(found, 0)[LEFT_LENGTH] == pytest.approx(9 * 0.2, rel=1e-15)


def test_an_element_of_a_symmetric_matrix_takes_its_mirror_image_along():
    found = study(axis("plant.stiffness_N_per_m.0.1", -15000.0), device=TWO_MASS)
    assert design(found, 0) == {"plant.stiffness_N_per_m.0.1": -15000.0, "plant.stiffness_N_per_m.1.0": -15000.0}


def test_a_coordinate_of_a_point_takes_no_other_along():
    for key in ("points_m.0.1", "points_m.1.2", "points_m.1.0"):
        path = f"legs.leg.loops.parallelogram.{key}"
        found = study(axis(path, 0.01), device="novint-falcon")
        assert design(found, 0) == {path: 0.01}


def test_keys_that_the_file_leaves_out_can_be_varied():
    assert "delay_samples" not in load(FIVE_BAR).document["loop"]
    assert study(DELAY).sampling.count == 2
    methods = axis("loop.velocity.method", "backward-difference", "foaw")
    assert study(methods).sampling.axes[0].values == ("backward-difference", "foaw")


def test_files_lie_beside_the_study(tmp_path, monkeypatch):
    place = tmp_path / "studies"
    place.mkdir()
    (place / "mine.toml").write_text(
        'name = "mine"\n[plant]\nmass_kg = 0.1\nhandle = 1.0\n[loop]\nsampling_period_s = 0.001\n'
    )
    (place / "arm.toml").write_text("arm_mass_kg = 0.8\narm_stiffness_N_per_m = 580.0\ngrasp = 'rigid'\n")
    (place / "own.py").write_text(
        "from zwidth import measure\n@measure(unit='kg')\ndef mass(place):\n    return 0.1\n"
    )
    lines = [
        'device = "mine.toml"',
        'measures = ["mass"]',
        'measures_file = "own.py"',
        'operator = "arm.toml"',
        '[[axis]]\nkey = "plant.mass_kg"\nvalues = [0.1, 0.2]',
    ]
    (place / "study.toml").write_text("\n".join(lines))
    monkeypatch.chdir(tmp_path)
    found = read_study("studies/study.toml")
    assert found.device.name == "mine"
    assert found.device.operator is not None
    assert found.columns[0].unit == "kg"
    operators = axis("operator", "arm.toml", "none", "thesis-arm")
    inner = {**tomllib.loads("\n".join(lines)), "axis": [operators]}
    del inner["operator"]
    assert set(study_of(inner, "studies/study.toml").operators) == {"arm.toml", "none", "thesis-arm"}


def test_the_workspace_is_that_of_the_study_or_the_file():
    over = {"measures": ["average(rigid_mass)"]}
    given = {"x_m": [-0.1, 0.1], "y_m": [0.2, 0.25], "count": [5, 3]}
    plane = study(DELAY, **over, workspace=given).plane
    assert plane is not None
    assert (plane.x[0], plane.x[-1], plane.y[0], plane.y[-1]) == (-0.1, 0.1, 0.2, 0.25)
    assert plane.shape == (3, 5)
    default = study(DELAY, **over).plane
    box = load(FIVE_BAR).document["mechanism"]["workspace"]
    assert default is not None
    assert [default.x[0], default.x[-1]] == box["x_m"]
    assert default.shape == (15, 15)
    assert study(DELAY).plane is None


def test_a_study_for_the_optimiser_may_say_what_it_wants():
    wants = {"objectives": {"stiffness_max": "max"}, "constraints": {"rigid_mass_kg": "<= 0.3"}, "budget": 4000}
    assert study(DELAY, optimise=wants | {"seed": 1}).sampling.count == 2


def test_the_contract_s_example_is_read_for_a_device_of_these_names(tmp_path):
    """Key by key as promised to those who script."""
    text = """
device = "five-bar"
measures = ["stiffness_max", "isotropy"]
sampling = "grid"
[[axis]]
key = "links.upper-right.length_m"
range = [0.10, 0.20]
count = 21
tie = ["links.upper-left.length_m"]
[optimise]
objectives = { stiffness_max = "max", isotropy = "min" }
constraints = { rigid_mass_kg = "<= 0.3" }
budget = 4000
seed = 1
"""
    path = tmp_path / "study.toml"
    path.write_text(text)
    assert read_study(path).sampling.count == 21
