"""What studies say of arguments that cannot be meant, and of themselves."""

from __future__ import annotations

import pickle
from math import nan

import numpy as np
import pytest

from tests.study import test_plane, test_sweep_arguments, test_workspace
from tests.study.study_cases import RIGHT_LENGTH, axis, study
from tests.study.test_measured_boundary import EDGES, TIP, experiment
from tests.study.test_optimise import LENGTH, lines_of
from tests.study.test_safe_walls import MECHANISM, TWO_MASS
from tests.study.test_study_robust import family, one_mass_device
from tests.study.test_sweep_arguments import DELAY, PERIOD, sweep_delays
from tests.study.test_user_points import comparison
from tests.systems import published
from zwidth.chart import stability_chart
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.errors import ArgumentError, DeviceError, MeasureError, RangeError, WorkspaceError
from zwidth.study import (
    Plan,
    Range,
    UserPoint,
    parse_requirement,
    plane_of,
    robust_study,
    run_study,
    safe_walls,
    workspace_map,
)

# --- a sweep asked from Python: the same study as a file's, and one clear line for each mistake ------


device = test_sweep_arguments.device
sweep_of_file = test_sweep_arguments.sweep_of_file
WRONG = [
    ({"axes": {"loop.samplingperiod": [0.1]}}, "axes: 'loop.samplingperiod' is not a key", f"mean '{PERIOD}'?"),
    ({"axes": {"asembly": ["elbows-in"]}}, "axes: 'asembly' is not a key of a device file", "or is it 'assembly'"),
    ({"axes": {"position": [(0.0, 0.25)]}}, "axes: 'position' as an axis is called 'at'", ""),
    ({"axes": {"stiffness": [1.0]}}, "axes: 'stiffness' as an axis is called 'stiffness_N_per_m'", ""),
    ({"axes": {"links": [1.0]}}, "axes: 'links' is not a single number; the numbers in it are", ""),
    ({"axes": {DELAY: [0.0, "late"]}}, f"axes: {DELAY}: must be a number", "got the text 'late'"),
    ({"axes": {DELAY: [0.0, nan]}}, f"axes: {DELAY}: must be a number", "got nan"),
    ({"axes": {DELAY: [0.0, 0.0]}}, f"axes: {DELAY}: 0 is listed already; remove it", ""),
    ({"axes": {DELAY: [0.0], "loop.delay_s": [0.0]}}, "axes: 'loop.delay_s' excludes 'loop.delay_samples'", ""),
    (
        {"axes": {"assembly": ["elbow-in"]}},
        "axes: assembly: 'elbow-in' is not an assembly of this device",
        "'elbows-in'?",
    ),
    (
        {"axes": {"operator": ["nobody"]}},
        "axes: operator: 'nobody' is neither a file nor a bundled operator",
        "",
    ),
    ({"axes": {"frequency_Hz": [0.0]}}, "axes: frequency_Hz: must be a finite number, above 0, got 0", ""),
    ({"measures": "stifness_max"}, "measures: no measure is named 'stifness_max'", "did you mean stiffness_max?"),
    ({"measures": ["isotropy", "isotropy"]}, "measures: isotropy is listed twice", ""),
    ({"measures": "mean(isotropy)"}, "measures: mean is not a statistic over the workspace", ""),
    ({"measures": []}, "measures: must have at least 1 element", ""),
    ({"direction": (0.0, 0.0)}, "direction: has zero length", ""),
    ({"position": (0.1,)}, "position: must have at least 2 elements, got 1", ""),
    ({"position": {"upper-right": 0.6}}, "position: must be the angle of every driven joint", ""),
    ({"assembly": "elbow-in"}, "assembly: 'elbow-in' is not an assembly of this device", ""),
    (
        {"axes": {"assembly": ["elbows-in"]}, "assembly": "elbows-in"},
        "assembly: is an axis as well; remove one",
        "",
    ),
    (
        {"axes": {"at": [(0, 0.2)]}, "position": (0, 0.2)},
        "position: is an axis as well; remove one of the two",
        "",
    ),
    ({"model": "stiff"}, "model: must be 'full', 'two-mass', 'motor-mass' or 'rigid'", ""),
    ({"stiffness": -1.0}, "stiffness: must be at least 0, got -1", ""),
    ({"frequency": 0.0}, "frequency: must be greater than 0, got 0", ""),
]


@pytest.mark.parametrize(("given", "begin", "hint"), WRONG, ids=[begin for _, begin, _ in WRONG])
def test_a_mistake_is_one_line_in_the_words_of_python(device, given, begin, hint):
    with pytest.raises(DeviceError) as caught:
        sweep_delays(device, **given)
    (fault,) = caught.value.faults
    assert str(fault).startswith(begin)
    assert hint in str(fault)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"axes": [DELAY]}, "axes must be a dictionary of paths and values, got a list"),
        ({"axes": {3: [0.0]}}, "axes must be a dictionary whose keys are paths, got 3"),
        ({"axes": {DELAY: 0.5}}, "axes['loop.delay_samples'] must be a list of values, got 0.5; write [0.5]"),
        (
            {"axes": {"assembly": "elbows-in"}},
            "axes['assembly'] must be a list of values, got the text 'elbows-in'; write ['elbows-in']",
        ),
        ({"axes": {"at": (0.0, 0.2)}}, "axes['at'] must be a list of values, got a tuple; write [[0.0, 0.2]]"),
        ({"measures": 3}, "measures must be a name, a Measure or a list of them, got 3"),
        ({"measures": ["isotropy", None]}, "measures must be a name, a Measure or a list of them, got None"),
        ({"plane": "xy"}, "plane must be a PlaneGrid, got the text 'xy'; write plane_of(device, 'xy')"),
    ],
)
def test_an_argument_of_another_kind_is_told_with_what_to_type(device, given, said):
    with pytest.raises(TypeError) as caught:
        sweep_delays(device, **given)
    assert str(caught.value) == said


@pytest.mark.parametrize(
    ("axes", "said"),
    [({}, "axes has no path to vary; write such as {"), ({DELAY: []}, "axes['loop.delay_samples'] has no values")],
)
def test_nothing_to_vary(device, axes, said):
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        sweep_delays(device, axes=axes)
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(
    ("name", "given", "said"),
    [
        ("spectral_radius", {}, "spectral_radius needs a wanted wall; give stiffness and damping"),
        ("felt_stiffness", {"stiffness": 100.0, "damping": 1.0}, "give frequency"),
    ],
)
def test_what_a_measure_wants_is_told_by_arguments(device, name, given, said):
    with pytest.raises(MeasureError) as caught:
        sweep_delays(device, measures=name, **given)
    assert str(caught.value).endswith(said)


def test_what_a_sweep_shows_of_itself_is_short(sweep_of_file):
    lines = repr(sweep_of_file).splitlines()
    assert lines[0] == f"Sweep: 3 designs of 'five-bar' over {RIGHT_LENGTH}"
    assert lines[1].endswith("kg, 2 of 3 have a value")
    low, high = np.nanmin(sweep_of_file.cells.values[:, 0]), np.nanmax(sweep_of_file.cells.values[:, 0])
    assert f"rigid_mass: {low:.4g} to {high:.4g} kg" in lines[1]
    assert len(lines) == 3
    many = run_study(
        study(axis(DELAY, 0.0), measures=["rigid_mass", "isotropy", "manipulability", "stiffness_max"]), workers=1
    )
    assert len(repr(many).splitlines()) == 5
    assert repr(many).endswith("and 1 more")
    for one in (sweep_of_file.study, sweep_of_file.job, pickle.loads(pickle.dumps(sweep_of_file.job))):
        assert len(repr(one)) < 300


# --- requirements, their regions and what they have in common ----------------------------------------


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("stiffness_max", "is not a requirement; write NAME>=VALUE"),
        ("stiffness_max=5000", "is not a requirement"),
        ("stiffness_max>5000", "is not a requirement"),
        ("stiffness_max>==5000", "is not a requirement"),
        (">=5000", "is not a requirement"),
        ("", "is not a requirement"),
        ("stiffness_max>=much", "must be a finite number, got 'much'"),
        ("stiffness_max>=", "must be a finite number, got ''"),
        ("stiffness_max>=inf", "must be a finite number"),
        ("stifness_max>=5000", "did you mean stiffness_max"),
    ],
)
def test_a_requirement_that_cannot_be_read(text, said):
    with pytest.raises(ValueError, match=said):
        parse_requirement(text)


# --- a boundary measured on a device at an operating point: who holds it, what is kept, keys ---------


@pytest.mark.parametrize(
    ("numbers", "argument", "says"),
    [
        ({"stiffnesses": 0}, "stiffnesses", "must be a whole number from 1 to 1000, got 0"),
        ({"disturbance": 1.5}, "disturbance", "must be a finite number, above 0 and at most 1"),
        ({"speed": -200.0}, "speed", "must be a finite number, at least -100 and at most 100"),
        ({"spread": 3.0}, "spread", "must be a finite number, at least 0 and at most 2"),
        ({"push": float("inf")}, "push", "must be a finite number"),
    ],
)
def test_a_plan_that_cannot_be_meant_is_refused(numbers, argument, says):
    with pytest.raises(ArgumentError, match=f"{argument} {says}") as caught:
        Plan(**numbers)
    assert (caught.value.argument, caught.value.reasons[0][: len(says)]) == (argument, says)


def test_the_repr_has_the_main_numbers_in_few_lines():
    lines = repr(experiment(*EDGES, TIP, chart=stability_chart(published(), decay=False))).splitlines()
    assert len(lines) <= 5
    assert max(map(len, lines)) < 100
    assert "2 edges and 1 tips measured, 1 not found" in lines[0]
    assert "stiffest 4000 N/m at 5 N s/m; exact and linear 7133.87 N/m" in lines[1]


# --- optimisations of plants and mechanisms, against closed forms and against random designs ---------


GOOD = {"isotropy": "min"}


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"optimise": {}}, "optimise: has no objectives; add such as objectives = "),
        ({"optimise": {"objectives": {}}}, "optimise.objectives: must have at least 1 element"),
        ({"optimise": {"objectiv": GOOD}}, "optimise.objectiv: is not a key of [optimise]; did you mean"),
        ({"optimise": 3}, "optimise: must be a table, got 3"),
        ({"optimize": {"objectives": GOOD}}, "optimize: is not a key of a study file; did you mean"),
        ({"optimise": {"objectives": GOOD, "budget": 0}}, "optimise.budget: must be at least 1, got 0"),
        ({"optimise": {"objectives": {"isotropy": 3}}}, "optimise.objectives.isotropy: must be 'max' or "),
        (
            {"optimise": {"objectives": GOOD, "constraints": {"reach": 3}}},
            "optimise.constraints.reach: must be text, got 3",
        ),
    ],
)
def test_one_fault_of_optimise_is_one_line(change, line):
    (told,) = lines_of({"device": "five-bar", "axis": [LENGTH]} | change)
    assert told.startswith(line)


# --- planes of the workspace: their grids, their default ranges, and planes that cannot be -----------


planar = test_plane.planar


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"axes": "xz"}, r"cannot leave the plane z = 0 m, .* ask for axes='xy'"),
        ({"axes": (1, 0, 0, -3, 0, 0)}, "are parallel"),
        ({"axes": (1, 0, 0, 0, 0, 0)}, "has length 0"),
        ({"axes": (1, 0, 0)}, "six finite numbers"),
        ({"axes": "zx"}, "must be xy, xz, yz or six numbers"),
        ({"through": (0, 0.25, 0.1)}, r"lies 0\.1 m beside it; it reaches x from -0\.346 to 0\.346 m"),
        ({"x": (0.1, 0.1)}, "range along x must be LOW,HIGH"),
        ({"y": (0.2, float("inf"))}, "range along y"),
        ({"cells": (1, 9)}, "at least 2 points"),
        ({"cells": (10**5, 10**5)}, "at most"),
    ],
)
def test_a_plane_that_cannot_be_mapped(planar, asked, said):
    with pytest.raises(WorkspaceError, match=said) as caught:
        plane_of(planar, **asked)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(
        caught.value
    )  # as processes that compute hand it on


# --- safe walls over the workspace: stable in postures that nobody chose, however they are -----------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"levels": 0}, "levels must be a whole number from 1 to 255, got 0"),
        ({"directions": 17}, "directions must be a whole number from 1 to 16, got 17"),
        ({"margin": 1.0}, "margin must be a finite number, at least 0 and below 1, got 1"),
        ({"margin": float("nan")}, "margin must be a finite number, at least 0 and below 1, got nan"),
        ({"margin": "0.1"}, "margin must be a finite number, at least 0 and below 1, got '0.1'"),
        ({"levels": 2.5}, "levels must be a whole number from 1 to 255, got 2.5"),
        ({"span": 0.0}, r"span must be a finite number, above 0 \[N s/m\], got 0"),
        (
            {"cells": (20, 20), "size_limit": 1000},
            "takes 40400 bytes, more than the 1000 of its limit; take fewer",
        ),
    ],
)
def test_arguments_that_are_not_allowed_are_named(arguments, message):
    with pytest.raises((ArgumentError, WorkspaceError), match=message):
        safe_walls(load(MECHANISM), **({"cells": (2, 2)} | arguments))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"cells": (2, 2, 2)}, "moves in 2 dimensions, and 2,2,2 are 3 counts; give cells as NX,NY"),
        ({"cells": (0, 2)}, "at least 1 cell along each axis, got 0,2"),
        ({"z": (0.0, 0.1)}, "moves in a plane, whose two axes have the ranges x and y; leave out z"),
        ({"x": (0.1, 0.1)}, "range along x must be LOW,HIGH with LOW < HIGH"),
        ({"cells": (2000, 2000)}, "at most 1e\\+06 cells"),
    ],
)
def test_cells_that_cannot_be_are_named(arguments, message):
    with pytest.raises((ArgumentError, WorkspaceError), match=message):
        safe_walls(load(MECHANISM), **arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"hands": "none"}, r"hands must be a list of operators, got the text 'none'; write \['none'\]"),
        ({"hands": 3}, "hands must be a list of operators, got 3"),
        ({"cells": 3}, r"cells must be whole numbers such as \(20, 10\), got 3"),
        ({"cells": (2.5, 1)}, r"cells must be whole numbers such as \(20, 10\), got a tuple"),
        ({"x": 0.1}, r"x must be two numbers such as \(-0.1, 0.1\), got 0.1"),
        ({"y": (0.1, 0.2, 0.3)}, r"y must be two numbers such as \(-0.1, 0.1\), got a tuple"),
    ],
)
def test_arguments_of_another_kind_are_named(arguments, message):
    with pytest.raises(TypeError, match=message):
        safe_walls(load(MECHANISM), **arguments)


def test_devices_that_have_no_table_are_refused_with_what_to_do():
    with pytest.raises(WorkspaceError, match="one direction, got 2 parts of directions; leave out directions"):
        safe_walls(load(TWO_MASS), directions=2)
    with pytest.raises(WorkspaceError, match="no workspace; its walls are the same everywhere"):
        safe_walls(load(TWO_MASS), x=(0.0, 1.0))
    with pytest.raises(WorkspaceError, match=r"a device without load.*leave the load out, with set='load=unset'"):
        safe_walls(load(MECHANISM).under((0.0, -5.0)))
    with pytest.raises(WorkspaceError, match=r"one drive and moves along a curve.*as a \[plant\]"):
        safe_walls(load("hapkit"))


# --- robust charts of devices known in ranges: what is sampled, found, claimed and refused -----------


@pytest.mark.parametrize(
    ("ranges", "expected"),
    [
        ([Range("plant.mass_kg", 0.3, 0.1)], "plant.mass_kg: must be LOW,HIGH with LOW below HIGH, got 0.3,0.1"),
        ([Range("plant.mass_kg", 0.1, float("nan"))], "finite"),
        ([Range("plant.mass_kg", 0.1, float("inf"))], "finite"),
        ([Range("plant.mass_kg", 0.0, 0.1, True)], "cannot be logarithmic from 0"),
        ([Range("plant.mas_kg", 0.1, 0.2)], "did you mean 'plant.mass_kg'?"),
        ([Range("name", 0.1, 0.2)], "is not a number but the text 'm'"),
        ([Range("plant", 0.1, 0.2)], "did you mean 'plant.mass_kg'?"),
        ([Range("plant.mass_kg", -0.1, 0.2)], "with -0.1 the device is not valid: m"),
        ([Range("plant.mass_kg", 0.1, 0.2), Range("plant.mass_kg", 0.1, 0.3)], "is given twice"),
        ([Range("operator.arm_mass_kg", 0.1, 0.2)], "0.1 the device is not valid"),
    ],
)
def test_ranges_that_cannot_be_meant_are_refused_in_one_line(ranges, expected):
    with pytest.raises(RangeError) as caught:
        robust_study(family(from_document(one_mass_device().document, "m"), *ranges), 4, 4)
    lines = [str(fault) for fault in caught.value.faults]
    assert any(expected in line for line in lines), lines
    assert all("\n" not in line and line.startswith(f"{ranges[0].path}: ") for line in lines)
    assert str(caught.value).splitlines() == lines
    assert pickle.loads(pickle.dumps(caught.value)).faults == caught.value.faults


def test_a_range_s_advice_is_in_the_words_of_who_asks():
    whole, logarithmic = (
        family(one_mass_device(), one).faults()[0]
        for one in (Range("loop.velocity.samples", 1, 2), Range("plant.mass_kg", -0.1, 0.2, True))
    )
    assert str(whole).endswith("is a whole number and has no range; compute it for each value with Device.with_")
    assert str(logarithmic).endswith("give a positive number, or leave out logarithmic")
    assert whole.spelled(lambda name, value: "--set").endswith("compute it for each value with --set")


# --- somebody's own points beside the exact chart: distances, verdicts, counts, keys, columns --------


def test_the_repr_has_the_counts_on_one_line():
    assert repr(comparison()) == (
        "PointsComparison: 3 edge points, 2 compared; 3 walls, 2 with their exact verdict; 1 unnamed"
    )


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ({"edge": "left"}, "edge must be 'lower' or 'upper' or 'tip' or ''"),
        ({"verdict": "steady"}, "verdict must be 'stable' or 'unstable' or ''"),
        ({"edge": "tip", "verdict": "stable"}, "give edge or verdict, not both"),
    ],
)
def test_a_point_that_cannot_be_meant_is_refused(words, says):
    with pytest.raises(ValueError, match=says):
        UserPoint(4000.0, 10.0, **words)


# --- maps of the workspace: what they hold, and that each cell is what is found when it is -----------


workspace_device = test_workspace.device


@pytest.mark.parametrize(
    ("asked", "error", "said"),
    [
        ({"measures": ["stifness_max"]}, ValueError, "did you mean stiffness_max"),
        ({"measures": ["isotropy", "isotropy"]}, ValueError, "different names"),
        ({"measures": []}, ValueError, "got none"),
        ({"direction": "worse"}, ValueError, "worst, best, lowest, highest"),
        ({"measures": ["rigid_mass"], "direction": "worst"}, MeasureError, "^rigid_mass has no better side"),
        ({"direction": (0.0, 0.0)}, DeviceError, "zero length"),
        ({"measures": ["peak_force"]}, MeasureError, "^peak_force needs"),
    ],
)
def test_questions_that_cannot_be_meant(workspace_device, asked, error, said):
    plane = plane_of(workspace_device, cells=(4, 4))
    with pytest.raises(error, match=said):
        workspace_map(workspace_device, **{"measures": ["isotropy"], "plane": plane, **asked})


def test_a_plane_beside_the_workspace(workspace_device):
    plane = plane_of(workspace_device, x=(1.0, 1.1), y=(0.0, 1.0), cells=(4, 4))
    with pytest.raises(
        WorkspaceError, match=r"reaches no point of this plane .*; it reaches x from -0\.346 to 0\.346 m"
    ):
        workspace_map(workspace_device, ["isotropy"], plane)
