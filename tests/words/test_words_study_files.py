"""Every way in which a study file can be wrong, told in one line each."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.study.study_cases import (
    FIVE_BAR,
    LEFT_LENGTH,
    RIGHT_LENGTH,
    TWO_MASS,
    axis,
    faults,
    study,
    study_document,
)
from tests.study.test_task import PERIOD
from zwidth.device import new_device
from zwidth.errors import DeviceError, TooLarge
from zwidth.study import read_study, study_of

# --- every way in which a study file can be wrong, told in one line each -----------------------------


DELAY = axis("loop.delay_samples", 0.0, 1.0)
WRONG = [
    ({"device": "no-such"}, "device: 'no-such' is neither a file nor a bundled device"),
    ({"device": 3}, "device: must be text, got 3"),
    ({"measures": []}, "measures: must have at least 1 element"),
    (
        {"measures": ["stiffnes_max"]},
        "measures.0: no measure is named 'stiffnes_max'; did you mean stiffness_max?",
    ),
    ({"measures": ["isotropy", "isotropy"]}, "measures.1: isotropy is listed twice"),
    ({"measures": ["worst(rigid_mass)"]}, "measures.0: worst(rigid_mass): whether more or less is better depends"),
    ({"measures": ["mean(isotropy)"]}, "measures.0: mean is not a statistic over the workspace"),
    (
        {"measures": ["isotropy_index(rigid_mass)"]},
        "measures.0: isotropy_index(rigid_mass): isotropy_index applies to isotropy only",
    ),
    ({"measures_file": "none.py"}, "measures_file: no such file"),
    ({"samplin": "grid"}, "samplin: is not a key of a study file; did you mean 'sampling'?"),
    ({"sampling": "random"}, "sampling: must be 'grid', 'latin-hypercube' or 'paired', got the text 'random'"),
    ({"sampling": "latin-hypercube"}, "sampling: 'latin-hypercube' needs count"),
    ({"sampling": "latin-hypercube", "count": 0}, "count: must be at least 1, got 0"),
    ({"sampling": "latin-hypercube", "count": 3, "seed": -1}, "seed: must be at least 0, got -1"),
    (
        {"sampling": "paired", "axis": [axis(RIGHT_LENGTH, 0.1, 0.2), axis("loop.delay_samples", 0, 1, 2)]},
        "axis.1.values: gives 3 values, the first axis 2; paired axes have equally many",
    ),
    ({"count": 3}, "count: is read with sampling = 'latin-hypercube' only"),
    ({"seed": 3}, "seed: is read with sampling = 'latin-hypercube' only"),
    ({"axis": []}, "axis: must have at least 1 element"),
    ({"axis": 7}, "axis: must be a list, got 7"),
    ({"direction": [0.0, 0.0]}, "direction: has zero length"),
    ({"assembly": "elbows-up"}, "assembly: 'elbows-up' is not an assembly of this device; did you mean 'elbows-"),
    ({"model": "stiff"}, "model: must be 'full', 'two-mass', 'motor-mass' or 'rigid', got the text 'stiff'"),
    ({"operator": "no-one"}, "operator: 'no-one' is neither a file nor a bundled operator"),
    ({"set": 3}, 'set: must be a list, got 3 (changes of the device file, each "PATH=VALUE")'),
    ({"set": ["loop.delay=1"]}, "set.0: loop.delay: is not a key of a device file; did you mean 'loop.delay_s'?"),
    ({"set": ["loop.sampling_period_s=-1"]}, "loop.sampling_period_s: must be"),
    ({"frequency_Hz": 0.0}, "frequency_Hz: must be greater than 0, got 0"),
    ({"workspace": {}}, "workspace: is used only by measures over the workspace, such as average(rigid_mass)"),
    (
        {"measures": ["average(isotropy)"], "workspace": {"count": 1}},
        "workspace.count: must be at least 2, got 1",
    ),
    (
        {"measures": ["average(isotropy)"], "workspace": {"plane": "xz"}},
        "workspace: the handle cannot leave the plane z = 0 m, and meets the requested plane in a line; "
        'ask for plane = "xy"',
    ),
    (
        {"measures": ["average(stiffness_max)"], "device": TWO_MASS},
        "measures: average(stiffness_max) needs the workspace of a [mechanism]",
    ),
    ({"optimise": {"objectives": {"isotropy": "low"}}}, "optimise.objectives.isotropy: must be 'max' or 'min'"),
]


@pytest.mark.parametrize(("change", "line"), WRONG, ids=[line for _, line in WRONG])
def test_a_fault_is_told_with_its_key_and_what_is_allowed(change, line):
    told = faults({**study_document(DELAY), **change})
    assert any(one.startswith(line) or f": {line}" in one for one in told), told


@pytest.mark.parametrize("fault", [{"assembly": "elbows-up"}, {"seed": 3}, {"workspace": {"count": 1}}])
def test_one_fault_is_not_taken_for_a_second_of_the_workspace(fault):
    change = {"measures": ["average(isotropy)"], **fault}
    assert len(faults({**study_document(DELAY), **change})) == 1


R = {"range": [0.1, 0.2]}
WRONG_AXES = [
    ({}, "axis.0.key: is missing"),
    ({"key": RIGHT_LENGTH}, "axis.0: has no values; give range = [low, high] and count, or values"),
    ({"key": RIGHT_LENGTH, **R}, "axis.0: has a range and no count; add the number of its values"),
    ({"key": RIGHT_LENGTH, **R, "count": 0}, "axis.0.count: must be at least 1, got 0"),
    ({"key": RIGHT_LENGTH, **R, "count": 2.5}, "axis.0.count: must be a whole number, got 2.5"),
    ({"key": RIGHT_LENGTH, **R, "values": [1.0]}, "axis.0.values: and range exclude each other"),
    ({"key": RIGHT_LENGTH, "values": [0.1], "count": 3}, "axis.0.count: is read with a range only"),
    ({"key": RIGHT_LENGTH, "values": [0.1, 0.2, 0.1]}, "axis.0.values.2: 0.1 is listed already"),
    ({"key": RIGHT_LENGTH, "values": []}, "axis.0.values: must have at least 1 element"),
    (
        {"key": RIGHT_LENGTH, "range": [0.2, 0.1], "count": 3},
        "axis.0.range: must be [lower, upper] with lower < upper",
    ),
    (
        {"key": RIGHT_LENGTH, "range": [0.1, 0.1], "count": 3},
        "axis.0.range: must be [lower, upper] with lower < upper",
    ),
    ({"key": RIGHT_LENGTH, "range": [0.1], "count": 3}, "axis.0.range: must have at least 2 elements, got 1"),
    (
        {"key": RIGHT_LENGTH, "range": [0.0, 1.0], "count": 3, "scale": "log"},
        "axis.0.range: must begin above 0 where scale",
    ),
    ({"key": RIGHT_LENGTH, **R, "count": 3, "scale": "ln"}, "axis.0.scale: must be 'linear' or 'log'"),
    ({"key": "links.uper-right.length_m", "values": [1]}, "axis.0.key: 'links.uper-right.length_m' is not a key"),
    (
        {"key": "links.upper-right", "values": [1]},
        "axis.0.key: 'links.upper-right' is not a single number; the numbers in it are",
    ),
    ({"key": "loop", "values": [1]}, "axis.0.key: 'loop' is not a single number"),
    ({"key": "assemblies", "values": ["elbows-in"]}, "axis.0.key: 'assemblies' is not a single number"),
    ({"key": "asembly", "values": ["elbows-in"]}, "axis.0.key: 'asembly' is not a key of a device file"),
    (
        {"key": RIGHT_LENGTH, "values": [0.1, "long"]},
        f"axis.0.values.1: must be a number for '{RIGHT_LENGTH}', got the text",
    ),
    ({"key": RIGHT_LENGTH, "values": [True]}, "axis.0.values.0: must be no true or false"),
    ({"key": RIGHT_LENGTH, "values": [[0.1]]}, "axis.0.values.0: must be a number"),
    (
        {"key": "loop.velocity.samples", "range": [1, 5], "count": 5},
        "axis.0.range: cannot be used: 'loop.velocity.samples' takes whole numbers",
    ),
    ({"key": "loop.velocity.samples", "values": [1.5]}, "axis.0.values.0: must be a whole number"),
    ({"key": "loop.velocity.method", "range": [0, 1], "count": 2}, "axis.0.range: cannot be used: 'loop.vel"),
    (
        {"key": "assembly", "values": ["elbow-in"]},
        "axis.0.values.0: 'elbow-in' is not an assembly of this device; did you mean",
    ),
    ({"key": "assembly", **R, "count": 3}, "axis.0.range: cannot be used: assembly is not a number; write values"),
    ({"key": "model", "values": ["full", "stiff"]}, "axis.0.values.1: must be one of full, two-mass, motor-mass"),
    ({"key": "direction", "values": [[0, 0]]}, "axis.0.values.0: has zero length"),
    ({"key": "at", "values": [[0.1], 3]}, "axis.0.values.1: must be 2 or 3 numbers, got 3"),
    (
        {"key": "operator", "values": ["none", "no-one"]},
        "axis.0.values.1: 'no-one' is neither a file nor a bundled operator",
    ),
    ({"key": "frequency_Hz", "values": [0.0]}, "axis.0.values.0: must be a finite number, above 0, got 0"),
    (
        {"key": "assembly", "values": ["elbows-in"], "tie": [LEFT_LENGTH]},
        "axis.0.tie: goes with a number of the device",
    ),
    (
        {"key": RIGHT_LENGTH, "values": [0.1], "tie": ["links.upper-left.lenth_m"]},
        "axis.0.tie.0: 'links.upper-left.lenth",
    ),
    (
        {"key": RIGHT_LENGTH, "values": [0.1], "tie": ["links.upper-left"]},
        "axis.0.tie.0: 'links.upper-left' is not a single number",
    ),
    ({"key": RIGHT_LENGTH, "values": [0.1], "tie": [{"power": 1}]}, "axis.0.tie.0.key: is missing"),
    (
        {"key": RIGHT_LENGTH, "values": [0.1], "tie": [RIGHT_LENGTH]},
        f"axis.0.tie.0: '{RIGHT_LENGTH}' is set by the axis",
    ),
    (
        {"key": RIGHT_LENGTH, "values": [0.1], "tie": [{"key": LEFT_LENGTH, "power": 1, "factor": 2}]},
        "axis.0.tie.0.factor: and power exclude each other",
    ),
    (
        {"key": "loop.delay_samples", "values": [1.0], "tie": [{"key": LEFT_LENGTH, "power": 1}]},
        "axis.0.tie.0.power: needs a value of 'loop.delay_samples' other than 0",
    ),
    (
        {"key": RIGHT_LENGTH, "values": [0.1, -0.1], "tie": [{"key": LEFT_LENGTH, "power": 1}]},
        f"axis.0.tie.0.power: needs values of the sign that '{RIGHT_LENGTH}' has",
    ),
    (
        {"key": "loop.delay_samples", "values": [1.0], "tie": ["loop.delay_s"]},
        "axis.0.tie.0: 'loop.delay_s' excludes 'loop.delay_samples', which is set by the axis",
    ),
    (
        {"key": "operator.arm_mass_kg", "values": [1.0], "tie": [{"key": RIGHT_LENGTH, "power": 1}]},
        "axis.0.tie.0.power: needs a value of 'operator.arm_mass_kg' other than 0 in the device file, and it has",
    ),
    (
        {"key": RIGHT_LENGTH, "values": [0.1], "tie": [3]},
        "axis.0.tie.0: must be a path, or a table with a key, got 3",
    ),
    ({"key": RIGHT_LENGTH, "values": [0.1, float("nan")]}, "axis.0.values.1: must be a number for"),
    (
        {"key": "loop.velocity.method", "values": ["kalman", "windowed"]},
        "axis.0.values.1: must be one of backward-difference, windowed-difference, ",
    ),
    ({"key": RIGHT_LENGTH, "values": [0.1], "steps": 3}, "axis.0.steps: is not a key of an [[axis]]"),
]


@pytest.mark.parametrize(("table", "line"), WRONG_AXES, ids=[line for _, line in WRONG_AXES])
def test_a_fault_of_an_axis_is_told(table, line):
    told = faults(study_document(table))
    assert any(one.startswith(line) for one in told), told


def test_what_goes_with_two_axes_is_told():
    told = faults(study_document(axis(RIGHT_LENGTH, 0.1, tie=[LEFT_LENGTH]), axis(LEFT_LENGTH, 0.1)))
    assert told == [
        f"axis.1.key: '{LEFT_LENGTH}' goes with the axis '{RIGHT_LENGTH}' already; remove one of the two"
    ]


def test_what_is_set_twice_is_told():
    twice = axis(RIGHT_LENGTH, 0.1), axis(f"mechanism.{RIGHT_LENGTH}", 0.2), DELAY, axis("model", "full")
    told = faults(study_document(*twice, model="rigid"))
    assert told == [
        f"axis.1.key: 'mechanism.{RIGHT_LENGTH}' is set by the axis '{RIGHT_LENGTH}' already; "
        "remove one of the two",
        "model: is an axis as well; remove one of the two",
    ]


COM = "links.upper-right.center_of_mass_m"
LATER = [  # an axis beside RIGHT_LENGTH with the centre of mass tied to it, and DELAY
    (f"{COM}.0", f"axis.2.key: '{COM}.0' overlaps '{COM}', which goes with the axis '{RIGHT_LENGTH}' already"),
    (
        "loop.delay_s",
        "axis.2.key: 'loop.delay_s' excludes 'loop.delay_samples', which is set by the axis 'loop.del",
    ),
]


@pytest.mark.parametrize(("key", "line"), LATER)
def test_what_an_axis_would_take_from_another_is_told(key, line):
    told = faults(study_document(axis(RIGHT_LENGTH, 0.1, tie=[{"key": COM, "power": 1}]), DELAY, axis(key, 0.01)))
    assert len(told) == 1
    assert told[0].startswith(line)


def test_numbers_of_an_operator_may_be_varied_beside_whose_they_are():
    operators = axis("operator", "thesis-arm", "thesis-arm-rigid")
    found = study(operators, axis("operator.arm_mass_kg", 0.5, 1.0))
    assert found.sampling.shape == (2, 2)


def test_a_hypercube_has_one_count():
    told = faults(study_document(axis(RIGHT_LENGTH, **R, count=3), sampling="latin-hypercube", count=10))
    assert told == [
        "axis.0.count: is for a grid; a Latin hypercube has one count for all axes: move it to the top"
    ]


def test_all_faults_are_told_at_once_in_the_order_of_the_file():
    document = {
        "device": FIVE_BAR,
        "measures": ["stiffnes_max"],
        "assembly": "sideways",
        "set": ["loop.dely_s=1"],
        "axis": [{"key": "loop.delays", "values": [1]}, {"key": RIGHT_LENGTH, "range": [2, 1], "count": 1}],
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


def test_operators_of_a_task_are_told_with_their_key_and_beside_its_other_faults(tmp_path):
    task = {"operators": ["thesis-arm", "thesis-arms"], "count": 3}
    document = study_document(DELAY, task=task, optimise={"objectives": {"stiffness_max": "max"}})
    del document["measures"]
    with pytest.raises(DeviceError) as caught:
        study_of(document, str(tmp_path / "my.toml"), bounds=True)
    first, second = sorted(map(str, caught.value.faults))
    assert first == f"{tmp_path}/my.toml: task.count: is read with box_m or radius_m only; remove it"
    said = "'thesis-arms' is neither a file nor a bundled operator; did you mean 'thesis-arm"
    assert second.startswith(f"{tmp_path}/my.toml: task.operators.1: {said}")
    # what is wrong within a file that is there is told with the file's name
    (tmp_path / "thesis-arms").write_text("arm_mass_kg = -1.0\n")
    with pytest.raises(DeviceError) as caught:
        study_of(document, str(tmp_path / "my.toml"), bounds=True)
    assert f"{tmp_path}/thesis-arms: operator.arm_mass_kg: must be" in str(caught.value)


def test_a_task_names_at_least_one_operator():
    document = study_document(DELAY, task={"operators": []}, optimise={"objectives": {"stiffness_max": "max"}})
    with pytest.raises(DeviceError, match=r"my\.toml: task\.operators: must have at least 1 element"):
        study_of(document, "my.toml", bounds=True)


@pytest.mark.parametrize(
    ("low", "said"),
    [
        (float("nan"), "must be finite, got nan"),
        (float("inf"), "must be finite, got inf"),
        ("short", "must be a number, got the text 'short'"),
        (True, "must be a number, got true"),
        ([0.1], "must be a number, got the list [0.1]"),
    ],
)
@pytest.mark.parametrize("key", [RIGHT_LENGTH, "loop.sampling_period_s", "frequency_Hz"])
@pytest.mark.parametrize("more", [{}, {"scale": "log"}, {"tie": [{"key": COM, "power": 1}]}])
def test_one_fault_of_a_range_is_one_line(low, said, key, more):
    if "tie" in more and key != RIGHT_LENGTH:
        more = {}
    assert faults(study_document(axis(key, range=[low, 2.0], count=3, **more))) == [f"axis.0.range.0: {said}"]


def test_a_measured_device_has_no_numbers_to_vary(tmp_path):
    (tmp_path / "sweep.csv").write_text(
        "frequency_Hz,real_m_per_N,imag_m_per_N\n" + "".join(f"{f},{-1.0 / f**2},-0.001\n" for f in range(1, 400))
    )
    (tmp_path / "m.toml").write_text(
        'name = "m"\n[response]\nfile = "sweep.csv"\nintegrators = 2\n[loop]\nsampling_period_s = 0.001\n'
    )
    told = faults(study_document(axis("loop.sampling_period_s", 0.001), device=str(tmp_path / "m.toml")))
    assert any("is a measured [response], which has no numbers" in one for one in told), told


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (None, "no such file; give a study file"),
        (b"", "is empty; a study needs a device, measures and an [[axis]]"),
        (b"device = ", "is not TOML"),
        (b"\xff\xfea\x00", "is UTF-16 text"),
        (
            new_device("arm", "serial-2r").encode(),
            'is a device, not a study; write a study file with device = "study.toml", measures and an [[axis]]',
        ),
    ],
)
def test_a_file_that_is_no_study_is_told(tmp_path, data, said):
    path = tmp_path / "study.toml"
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(DeviceError) as caught:
        read_study(path)
    assert [fault.message.startswith(said) for fault in caught.value.faults] == [True]


def test_a_bundled_device_is_no_study():
    with pytest.raises(DeviceError, match=r"^five-bar: is a bundled device, not a study; .* device = .five-bar.,"):
        read_study("five-bar")


TOO_MANY = "1000000000000 designs of 1 measure are more than zwidth computes, 1000000000 at most; lower a count"
TOO_LONG = (
    f"20000000 designs of 1 measure: the axis {RIGHT_LENGTH} has 10000000 values, and 1000000 at most are listed; "
    "lower its count, or use a Latin hypercube"
)


@pytest.mark.parametrize(("counts", "said"), [((10**6, 10**6), TOO_MANY), ((10**7, 2), TOO_LONG)])
def test_a_study_that_no_computer_takes_is_refused_with_its_size(counts, said):
    """Whether it fits into memory or on the disk shows where it is computed."""
    keys = RIGHT_LENGTH, LEFT_LENGTH
    axes = [axis(key, range=[0.1, 0.2], count=n) for key, n in zip(keys, counts, strict=True)]
    with pytest.raises(TooLarge) as caught:
        study(*axes)
    assert str(caught.value) == said


def test_a_hypercube_of_any_size_is_read():
    made = study(axis(RIGHT_LENGTH, range=[0.1, 0.2]), sampling="latin-hypercube", count=10**9)
    assert made.sampling.count == 10**9
    assert 0.1 <= made.sampling.values(10**9 - 1)[0] <= 0.2


# --- the points and directions of a task, and statistics over them -----------------------------------


def test_faults_of_a_task_have_their_lines():
    measures = ["worst(isotropy)"]
    cases = [
        ({"box_m": [[0, 1], [0, 1]], "points_m": [[0, 0]]}, "task.points_m: and box_m exclude each other"),
        ({"center_m": [0, 0]}, "task.center_m: goes with radius_m; give both"),
        ({"count": 3}, "task.count: is read with box_m or radius_m only"),
        ({"box_m": [[1, 0], [0, 1]]}, "task.box_m.0: must be [lower, upper] with lower <= upper, got [1, 0]"),
        ({"box_m": [[0, 1], [0, 1]], "count": [1, 2, 3]}, "task.count: must be one number, or 2 for the axes"),
        ({"box_m": [[0, 1], [0, 1]], "count": 400, "directions": 4}, "task.count: makes 640000 points"),
        ({"directions": [[0, 0]]}, "task.directions"),
        ({"bux_m": 1}, "task.bux_m: is not a key of [task]; did you mean 'box_m'?"),
        ({"operators": ["none"]}, "task.operators: is for an optimiser"),
    ]
    for given, line in cases:
        lines = faults(study_document(PERIOD, measures=measures, task=given))
        assert any(one.startswith(line) for one in lines), (lines, line)
    both = study_document(PERIOD, measures=measures, task={}, workspace={})
    assert any(one.startswith("workspace: and [task] exclude each other") for one in faults(both))
    unused = study_document(PERIOD, measures=["isotropy"], task={})
    assert any("is used only by measures over it, such as worst(isotropy)" in one for one in faults(unused))
