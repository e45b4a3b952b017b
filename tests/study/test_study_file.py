"""Study files: what they may say, and every way in which they can be wrong."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.study.study_cases import FIVE_BAR, LENGTH, OTHER, TWO_MASS, axis, faults, study, tables
from zwidth.contact.room import TooLarge
from zwidth.device.faults import DeviceError
from zwidth.device.load import load
from zwidth.study.axes import Axis, Sampling, settings, spread
from zwidth.study.study_file import read_study, study_of

DELAY = axis("loop.delay_samples", 0.0, 1.0)


def design(found, number):
    return dict(settings(found.sampling.axes, found.sampling.values(number)))


# --- what is meant ----------------------------------------------------------------------------------


def test_a_grid_has_every_combination_the_last_axis_fastest():
    found = study(axis(LENGTH, range=[0.1, 0.2], count=3), axis("assembly", "elbows-out", "elbows-in"))
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
        axis(LENGTH, range=[0.1, 0.2]),
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
        OTHER,
        {"key": f"{link}.mass_kg", "power": 1},
        {"key": f"{link}.inertia_kg_m2", "power": 3.0},
        {"key": f"{link}.center_of_mass_m", "power": 1},
        {"key": "links.distal-left.length_m", "factor": 1.5},
    ]
    found = study(axis(LENGTH, 2 * given["length_m"], tie=tie))
    changed = design(found, 0)
    assert changed[OTHER] == changed[LENGTH] == 0.294
    assert changed[f"{link}.mass_kg"] == pytest.approx(2 * given["mass_kg"], rel=1e-15)
    assert changed[f"{link}.inertia_kg_m2"] == pytest.approx(8 * given["inertia_kg_m2"], rel=1e-15)
    assert changed[f"{link}.center_of_mass_m"] == pytest.approx(
        [2 * x for x in given["center_of_mass_m"]], rel=1e-15
    )
    assert changed["links.distal-left.length_m"] == 1.5 * 0.294


def test_powers_speak_of_the_file_as_it_is_set():
    found = study(
        axis(LENGTH, 0.3, tie=[{"key": OTHER, "power": 2}]), set=["links.upper-right.length_m=0.1", f"{OTHER}=0.2"]
    )
    assert design(found, 0)[OTHER] == pytest.approx(9 * 0.2, rel=1e-15)


def test_an_element_of_a_symmetric_matrix_takes_its_mirror_image_along():
    found = study(axis("plant.stiffness_N_per_m.0.1", -15000.0), device=TWO_MASS)
    assert design(found, 0) == {"plant.stiffness_N_per_m.0.1": -15000.0, "plant.stiffness_N_per_m.1.0": -15000.0}


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
        "from zwidth.measures.own import measure\n@measure(unit='kg')\ndef mass(place):\n    return 0.1\n"
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
    assert found.asked[0].unit == "kg"
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


# --- what is wrong ----------------------------------------------------------------------------------

WRONG = [
    ({"device": "no-such"}, "no-such: is neither a file nor a bundled device"),
    ({"device": 3}, "device: must be text, got 3"),
    ({"measures": []}, "measures: must have at least 1 element"),
    (
        {"measures": ["stiffnes_max"]},
        "measures.0: no measure is named 'stiffnes_max'; did you mean stiffness_max?",
    ),
    ({"measures": ["isotropy", "isotropy"]}, "measures.1: isotropy is asked for twice"),
    ({"measures": ["worst(rigid_mass)"]}, "measures.0: worst(rigid_mass): whether more of it is better depends"),
    ({"measures": ["mean(isotropy)"]}, "measures.0: mean is nothing that is made of a measure over a workspace"),
    ({"measures": ["isotropy_index(rigid_mass)"]}, "measures.0: isotropy_index(rigid_mass): is of isotropy only"),
    ({"measures_file": "none.py"}, "measures_file: no such file"),
    ({"samplin": "grid"}, "samplin: is not a key of a study file; did you mean 'sampling'?"),
    ({"sampling": "random"}, "sampling: must be 'grid' or 'latin-hypercube', got the text 'random'"),
    ({"sampling": "latin-hypercube"}, "sampling: 'latin-hypercube' needs count"),
    ({"sampling": "latin-hypercube", "count": 0}, "count: must be at least 1, got 0"),
    ({"sampling": "latin-hypercube", "count": 3, "seed": -1}, "seed: must be at least 0, got -1"),
    ({"count": 3}, "count: is read with sampling = 'latin-hypercube' only"),
    ({"seed": 3}, "seed: is read with sampling = 'latin-hypercube' only"),
    ({"axis": []}, "axis: must have at least 1 element"),
    ({"axis": 7}, "axis: must be a list, got 7"),
    ({"direction": [0.0, 0.0]}, "direction: has zero length"),
    ({"assembly": "elbows-up"}, "assembly: names no assembly, got 'elbows-up'; did you mean 'elbows-"),
    ({"model": "stiff"}, "model: must be 'full', 'two-mass', 'motor-mass' or 'rigid', got the text 'stiff'"),
    ({"operator": "no-one"}, "no-one: is neither a file nor a bundled operator"),
    ({"set": ["loop.delay=1"]}, "set.0: loop.delay: is no key of a device file; did you mean 'loop.delay_s'?"),
    ({"set": ["loop.sampling_period_s=-1"]}, "loop.sampling_period_s: must be"),
    ({"frequency_Hz": 0.0}, "frequency_Hz: must be greater than 0, got 0"),
    ({"workspace": {}}, "workspace: is read by measures over it only, such as average(rigid_mass)"),
    (
        {"measures": ["average(isotropy)"], "workspace": {"count": 1}},
        "workspace.count: must be at least 2, got 1",
    ),
    (
        {"measures": ["average(isotropy)"], "workspace": {"plane": "xz"}},
        "workspace: the handle cannot leave the plane z = 0 m",
    ),
    ({"measures": ["average(stiffness_max)"], "device": TWO_MASS}, "measures: average(stiffness_max) is over a"),
    ({"optimise": {"objectives": {"isotropy": "low"}}}, "optimise.objectives.isotropy: must be 'max' or 'min'"),
]


@pytest.mark.parametrize(("change", "line"), WRONG, ids=[line for _, line in WRONG])
def test_a_fault_is_told_with_its_key_and_what_is_allowed(change, line):
    told = faults({**tables(DELAY), **change})
    assert any(one.startswith(line) or f": {line}" in one for one in told), told


R = {"range": [0.1, 0.2]}
WRONG_AXES = [
    ({}, "axis.0.key: is missing"),
    ({"key": LENGTH}, "axis.0: has no values; give range = [low, high] and count, or values"),
    ({"key": LENGTH, **R}, "axis.0: has no count"),
    ({"key": LENGTH, **R, "count": 0}, "axis.0.count: must be at least 1, got 0"),
    ({"key": LENGTH, **R, "count": 2.5}, "axis.0.count: must be a whole number, got 2.5"),
    ({"key": LENGTH, **R, "values": [1.0]}, "axis.0.values: stands beside a range"),
    ({"key": LENGTH, "values": [0.1], "count": 3}, "axis.0.count: is read with a range only"),
    ({"key": LENGTH, "values": [0.1, 0.2, 0.1]}, "axis.0.values.2: 0.1 is listed already"),
    ({"key": LENGTH, "values": []}, "axis.0.values: must have at least 1 element"),
    ({"key": LENGTH, "range": [0.2, 0.1], "count": 3}, "axis.0.range: must be [lower, upper] with lower < upper"),
    ({"key": LENGTH, "range": [0.1, 0.1], "count": 3}, "axis.0.range: must be [lower, upper] with lower < upper"),
    ({"key": LENGTH, "range": [0.1], "count": 3}, "axis.0.range: must have at least 2 elements, got 1"),
    (
        {"key": LENGTH, "range": [0.0, 1.0], "count": 3, "scale": "log"},
        "axis.0.range: must be above 0 to be divided",
    ),
    ({"key": LENGTH, **R, "count": 3, "scale": "ln"}, "axis.0.scale: must be 'linear' or 'log'"),
    ({"key": "links.uper-right.length_m", "values": [1]}, "axis.0.key: 'links.uper-right.length_m' is no key"),
    (
        {"key": "links.upper-right", "values": [1]},
        "axis.0.key: 'links.upper-right' names no number; numbers in it",
    ),
    ({"key": "loop", "values": [1]}, "axis.0.key: 'loop' names no number"),
    ({"key": "assemblies", "values": ["elbows-in"]}, "axis.0.key: 'assemblies' names no number"),
    ({"key": "asembly", "values": ["elbows-in"]}, "axis.0.key: 'asembly' is no key of a device file"),
    ({"key": LENGTH, "values": [0.1, "long"]}, f"axis.0.values.1: must be a number for '{LENGTH}', got the text"),
    ({"key": LENGTH, "values": [True]}, "axis.0.values.0: must be no true or false"),
    ({"key": LENGTH, "values": [[0.1]]}, "axis.0.values.0: must be a number"),
    ({"key": "loop.velocity.samples", "range": [1, 5], "count": 5}, "axis.0.range: cannot be divided"),
    ({"key": "loop.velocity.samples", "values": [1.5]}, "axis.0.values.0: must be a whole number"),
    ({"key": "loop.velocity.method", "range": [0, 1], "count": 2}, "axis.0.range: needs a number, but 'loop.vel"),
    (
        {"key": "assembly", "values": ["elbow-in"]},
        "axis.0.values.0: names no assembly, got 'elbow-in'; did you mean",
    ),
    ({"key": "assembly", **R, "count": 3}, "axis.0.range: is of numbers; assembly needs values"),
    ({"key": "model", "values": ["full", "stiff"]}, "axis.0.values.1: must be one of full, two-mass, motor-mass"),
    ({"key": "direction", "values": [[0, 0]]}, "axis.0.values.0: has zero length"),
    ({"key": "at", "values": [[0.1], 3]}, "axis.0.values.1: must be 2 or 3 numbers, got 3"),
    ({"key": "operator", "values": ["no-one"]}, "no-one: is neither a file nor a bundled operator"),
    ({"key": "frequency_Hz", "values": [0.0]}, "axis.0.values.0: must be a finite number, above 0, got 0"),
    ({"key": "assembly", "values": ["elbows-in"], "tie": [OTHER]}, "axis.0.tie: goes with a number of the device"),
    (
        {"key": LENGTH, "values": [0.1], "tie": ["links.upper-left.lenth_m"]},
        "axis.0.tie.0: 'links.upper-left.lenth",
    ),
    ({"key": LENGTH, "values": [0.1], "tie": ["links.upper-left"]}, "axis.0.tie.0: 'links.upper-left' names no"),
    ({"key": LENGTH, "values": [0.1], "tie": [{"power": 1}]}, "axis.0.tie.0.key: is missing"),
    ({"key": LENGTH, "values": [0.1], "tie": [LENGTH]}, f"axis.0.tie.0: '{LENGTH}' is set by the axis"),
    (
        {"key": LENGTH, "values": [0.1], "tie": [{"key": OTHER, "power": 1, "factor": 2}]},
        "axis.0.tie.0.factor: stands beside a power",
    ),
    (
        {"key": "loop.delay_samples", "values": [1.0], "tie": [{"key": OTHER, "power": 1}]},
        "axis.0.tie.0.power: needs a value of 'loop.delay_samples' other than 0",
    ),
    (
        {"key": LENGTH, "values": [0.1, -0.1], "tie": [{"key": OTHER, "power": 1}]},
        f"axis.0.tie.0.power: needs values of the sign that '{LENGTH}' has",
    ),
    (
        {"key": "loop.delay_samples", "values": [1.0], "tie": ["loop.delay_s"]},
        "axis.0.tie.0: 'loop.delay_s' excludes 'loop.delay_samples', which is set by the axis",
    ),
    (
        {"key": "operator.arm_mass_kg", "values": [1.0], "tie": [{"key": LENGTH, "power": 1}]},
        "axis.0.tie.0.power: needs a value of 'operator.arm_mass_kg' other than 0 in the device file, which gives",
    ),
    ({"key": LENGTH, "values": [0.1], "tie": [3]}, "axis.0.tie.0: must be a path, or a table with a key, got 3"),
    ({"key": LENGTH, "values": [0.1, float("nan")]}, "axis.0.values.1: must be a number for"),
    (
        {"key": "loop.velocity.method", "values": ["kalman", "windowed"]},
        "axis.0.values.1: must be one of backward-difference, windowed-difference, ",
    ),
    ({"key": LENGTH, "values": [0.1], "steps": 3}, "axis.0.steps: is not a key of an [[axis]]"),
]


@pytest.mark.parametrize(("table", "line"), WRONG_AXES, ids=[line for _, line in WRONG_AXES])
def test_a_fault_of_an_axis_is_told(table, line):
    told = faults(tables(table))
    assert any(one.startswith(line) for one in told), told


def test_what_goes_with_two_axes_is_told():
    told = faults(tables(axis(LENGTH, 0.1, tie=[OTHER]), axis(OTHER, 0.1)))
    assert told == [f"axis.1.key: '{OTHER}' goes with the axis '{LENGTH}' already; each number may be set once"]


def test_what_is_set_twice_is_told():
    twice = axis(LENGTH, 0.1), axis(f"mechanism.{LENGTH}", 0.2), DELAY, axis("model", "full")
    told = faults(tables(*twice, model="rigid"))
    assert told == [
        f"axis.1.key: 'mechanism.{LENGTH}' is set by the axis '{LENGTH}' already; each number may be set once",
        "model: is an axis, too; remove one of them",
    ]


COM = "links.upper-right.center_of_mass_m"
LATER = [  # an axis beside LENGTH with the centre of mass tied to it, and DELAY
    (f"{COM}.0", f"axis.2.key: '{COM}.0' overlaps '{COM}', which goes with the axis '{LENGTH}' already"),
    (
        "loop.delay_s",
        "axis.2.key: 'loop.delay_s' excludes 'loop.delay_samples', which is set by the axis 'loop.del",
    ),
]


@pytest.mark.parametrize(("key", "line"), LATER)
def test_what_an_axis_would_take_from_another_is_told(key, line):
    told = faults(tables(axis(LENGTH, 0.1, tie=[{"key": COM, "power": 1}]), DELAY, axis(key, 0.01)))
    assert len(told) == 1
    assert told[0].startswith(line)


def test_numbers_of_an_operator_may_be_varied_beside_whose_they_are():
    operators = axis("operator", "thesis-arm", "thesis-arm-rigid")
    found = study(operators, axis("operator.arm_mass_kg", 0.5, 1.0))
    assert found.sampling.shape == (2, 2)


def test_a_hypercube_has_one_count():
    told = faults(tables(axis(LENGTH, **R, count=3), sampling="latin-hypercube", count=10))
    assert told == [
        "axis.0.count: is that of a grid; a Latin hypercube has one count for all axes: move it to the top"
    ]


def test_all_faults_are_told_at_once_in_the_order_of_the_file():
    document = {
        "device": FIVE_BAR,
        "measures": ["stiffnes_max"],
        "assembly": "sideways",
        "set": ["loop.dely_s=1"],
        "axis": [{"key": "loop.delays", "values": [1]}, {"key": LENGTH, "range": [2, 1], "count": 1}],
        "optimise": {"budget": 0},
    }
    keys = [one.split(":")[0] for one in faults(document)]
    assert keys == ["measures.0", "assembly", "set.0", "axis.0.key", "axis.1.range", "optimise.budget"]


def test_faults_of_the_device_file_are_told_with_its_name(tmp_path):
    (tmp_path / "bad.toml").write_text('name = "bad"\n[plant]\nmass_kg = -1\n[loop]\nsampling_period_s = 5\n')
    (tmp_path / "study.toml").write_text('device = "bad.toml"\nmeasures = []\n[[axis]]\nkey = "a"\nvalues = [1]\n')
    with pytest.raises(DeviceError) as caught:
        read_study(tmp_path / "study.toml")
    files = {(Path(fault.file).name, fault.key) for fault in caught.value.faults}
    assert files == {
        ("study.toml", "measures"),
        ("bad.toml", "plant.mass_kg"),
        ("bad.toml", "loop.sampling_period_s"),
    }


def test_a_measured_device_has_no_numbers_to_vary(tmp_path):
    (tmp_path / "sweep.csv").write_text(
        "frequency_Hz,real_m_per_N,imag_m_per_N\n" + "".join(f"{f},{-1.0 / f**2},-0.001\n" for f in range(1, 400))
    )
    (tmp_path / "m.toml").write_text(
        'name = "m"\n[response]\nfile = "sweep.csv"\nintegrators = 2\n[loop]\nsampling_period_s = 0.001\n'
    )
    told = faults(tables(axis("loop.sampling_period_s", 0.001), device=str(tmp_path / "m.toml")))
    assert any("has a measured [response] and no model" in one for one in told), told


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (None, "no such file; give a study file"),
        (b"", "is empty; a study needs a device, measures and an [[axis]]"),
        (b"device = ", "is not TOML"),
        (b"\xff\xfea\x00", "is UTF-16 text"),
    ],
)
def test_a_file_that_is_no_study_is_told(tmp_path, data, said):
    path = tmp_path / "study.toml"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(DeviceError) as caught:
        read_study(path)
    assert [fault.message.startswith(said) for fault in caught.value.faults] == [True]


@pytest.mark.parametrize("hypercube", [False, True])
def test_a_study_that_would_not_fit_is_refused_with_its_size(hypercube):
    span = {"range": [0.1, 0.2]} | ({} if hypercube else {"count": 10**6})
    more = {"sampling": "latin-hypercube", "count": 10**9} if hypercube else {}
    designs = "1000000000" if hypercube else "1000000000000"
    with pytest.raises(TooLarge, match=rf"^{designs} designs of 1 measures would take .* GB, of .* lower a count"):
        study(axis(LENGTH, **span), axis(OTHER, **span), **more)
