"""What is handed over by mistake: every public entry says in one sentence what it takes and what to type."""

from __future__ import annotations

import inspect
import re
from functools import cache
from math import inf, nan

import numpy as np
import pytest

import zwidth
from docs import make_commands
from tests import systems
from tests.cli.command_runner import refusal_lines
from tests.measured_cases import measured_response
from zwidth import questions
from zwidth.argument import Argument
from zwidth.chart import (
    eigenvalues,
    hysteretic_chart,
    largest_stiffness_around,
    measured_chart,
    multi_chart,
    spectral_radius,
)
from zwidth.conditions import compare, compare_bounds
from zwidth.contact import (
    judge_response,
    limit_cycles,
    predict_limit_cycles,
    simulate,
    simulate_contact,
    simulate_mechanism,
)
from zwidth.device import import_file
from zwidth.errors import ArgumentError
from zwidth.guarantees import find_guarantees, passive_region, spring_stable_region
from zwidth.identify import (
    identify_arm,
    identify_boundary,
    identify_friction,
    identify_impedance,
    identify_mass,
    identify_modes,
    identify_response,
    identify_stiffness,
)
from zwidth.loop import MultiLoop, velocity_of
from zwidth.measures import (
    WantedWall,
    decay_time,
    evaluate,
    felt_chart,
    felt_impedance,
    felt_wall,
    static_stiffness,
    wall_paths,
)
from zwidth.model import MultiPlant, attach, natural_frequencies, reduce_plant, solve_posture
from zwidth.show.app.request import REQUEST
from zwidth.study import (
    Plan,
    StudyFile,
    load_path,
    open_executor,
    optimise,
    plane_of,
    safe_walls,
    sensitivities,
    tolerance,
    validity,
)

ONE = np.ones(1)
NONE = np.zeros((1, 1))


@cache
def device():
    return zwidth.load("published-two-mass")


@cache
def loop():
    return device().at().loop


@cache
def chart():
    return zwidth.stability_chart(loop(), decay=False)


def plant(mass=1.0):
    return zwidth.Plant(np.array([[mass]]), NONE, NONE, ONE, ONE)


def multi():
    return MultiPlant(np.eye(2), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))


KINDS = [
    (
        lambda: zwidth.Loop(device(), device().controller),
        "plant must be a Plant, got a Device; write device.at().loop",
    ),
    (lambda: zwidth.Loop("my.toml", device().controller), "plant must be a Plant, got the text 'my.toml'"),
    (
        lambda: zwidth.Loop(multi(), device().controller),
        "plant must be a Plant, got a MultiPlant; write MultiLoop(plant, controller) for several directions",
    ),
    (
        lambda: zwidth.Loop(plant(), device()),
        "controller must be a Controller, got a Device; write device.controller",
    ),
    (
        lambda: zwidth.Loop(plant(), 0.001),
        "controller must be a Controller, got 0.001; write Controller(sampling_period=...)",
    ),
    (
        lambda: MultiLoop(plant(), device().controller),
        "plant must be a MultiPlant, got a Plant; write Loop(plant, controller) for one direction",
    ),
    (
        lambda: zwidth.stability_chart(device()),
        "loop must be a Loop, got a Device; write device.at().loop",
    ),
    (lambda: zwidth.stability_chart(plant()), "loop must be a Loop, got a Plant; write Loop(plant, controller)"),
    (lambda: zwidth.largest_stiffness("my.toml"), "loop must be a Loop, got the text 'my.toml'"),
    (
        lambda: zwidth.judge(device(), 1.0, 1.0),
        "loop must be a Loop, got a Device; write device.at().loop",
    ),
    (
        lambda: multi_chart(loop()),
        "loop must be a MultiLoop, got a Loop; stability_chart takes a Loop",
    ),
    (lambda: hysteretic_chart(device()), "loop must be a Loop, got a Device"),
    (lambda: zwidth.robust_chart(loop()), "members must be a list of Loops, got a Loop; write [loop]"),
    (lambda: zwidth.robust_chart([device()]), "members[0] must be a Loop, got a Device"),
    (
        lambda: measured_chart(device(), device().controller),
        "response must be a Response, got a Device; write device.response",
    ),
    (lambda: compare(device()), "loop must be a Loop, got a Device"),
    (lambda: passive_region(device()), "loop must be a Loop, got a Device"),
    (lambda: spring_stable_region(device()), "loop must be a Loop, got a Device"),
    (lambda: find_guarantees(device()), "loop must be a Loop, got a Device"),
    (lambda: limit_cycles(device(), 1.0, 1.0), "loop must be a Loop, got a Device"),
    (lambda: felt_impedance(device(), 1.0, 1.0, [1.0]), "loop must be a Loop, got a Device"),
    (lambda: felt_chart(device()), "chart must be a StabilityChart, got a Device"),
    (
        lambda: felt_chart(loop()),
        "chart must be a StabilityChart, got a Loop; write stability_chart(loop)",
    ),
    (
        lambda: static_stiffness(device(), 1.0),
        "plant must be a Plant, got a Device; write device.at().plant",
    ),
    (
        lambda: natural_frequencies(device()),
        "plant must be a Plant, got a Device; write device.at().plant",
    ),
    (
        lambda: reduce_plant(device(), "rigid"),
        "plant must be a Plant, got a Device; write device.at().plant",
    ),
    (lambda: attach(plant(), "firm"), "operator must be an Operator, got the text 'firm'"),
    (lambda: wall_paths(device(), 1.0, [0.0, 1.0]), "loop must be a Loop, got a Device"),
    (
        lambda: simulate(device(), None, [], duration=1.0),
        "loop must be a Loop, got a Device",
    ),
    (lambda: sensitivities(loop()), "device must be a Device, got a Loop"),
    (
        lambda: sensitivities("my.toml"),
        "device must be a Device, got the text 'my.toml'; write load('my.toml')",
    ),
    (lambda: validity(loop()), "point must be an OperatingPoint, got a Loop"),
    (
        lambda: plane_of("my.toml"),
        "device must be a Device, got the text 'my.toml'; write load('my.toml')",
    ),
    (
        lambda: zwidth.workspace_map("my.toml", ["isotropy"]),
        "device must be a Device, got the text 'my.toml'; write load('my.toml')",
    ),
    (
        lambda: zwidth.workspace_map(device(), 3),
        "measures must be a name, a Measure or a list of them, got 3",
    ),
    (
        lambda: zwidth.run_study(device()),
        "study must be a Study or the path of a study file, got a Device; write sweep(device, {path: values}, ",
    ),
    (
        lambda: zwidth.sweep("my.toml", {"loop.delay_samples": [1]}, "isotropy"),
        "device must be a Device, got the text 'my.toml'; write load('my.toml')",
    ),
    (lambda: zwidth.robust_study(device()), "family must be a Family, got a Device"),
    (
        lambda: evaluate("isotropy", None),
        "measure must be a Measure, got the text 'isotropy'; write find_measure('isotropy')",
    ),
    (
        lambda: evaluate(zwidth.find_measure("isotropy"), device()),
        "point must be an OperatingPoint, got a Device; write device.at()",
    ),
    (
        lambda: solve_posture(device(), (0.0, 0.25)),
        "mechanism must be a Mechanism, got a Device; write device.mechanism",
    ),
    (lambda: zwidth.load(3), "name_or_path must be a bundled name or a path, got 3"),
    (
        lambda: zwidth.load("published-two-mass", "loop.delay_samples=1"),
        "settings must be a list or a dictionary, got the text 'loop.delay_samples=1'; "
        "write ['loop.delay_samples=1']",
    ),
    (
        lambda: zwidth.from_document("my.toml"),
        "document must be a dictionary, got the text 'my.toml'; write load(",
    ),
    (lambda: velocity_of("foaw", [0.0, 1.0], 0.001), "method must be a velocity estimate such as"),
    (lambda: judge_response(chart()), "response must be a TimeResponse, got a StabilityChart"),
    (lambda: zwidth.find_measure(3), "name must be a measure's name, got 3"),
    (
        lambda: zwidth.Controller(0.001, velocity="foaw"),
        "velocity must be an estimate such as WindowedDifference(4), got the text 'foaw'",
    ),
    (
        lambda: zwidth.Controller(0.001, velocity_filter=20.0),
        "velocity_filter must be a FirstOrder, a Butterworth or None, got 20",
    ),
]

VALUES = [
    (lambda: chart().check(nan, 1.0), "wall_stiffness must be a finite number [N/m], got nan"),
    (lambda: chart().check(1.0, inf), "wall_damping must be a finite number [N s/m], got inf"),
    (lambda: chart().check("stiff", 1.0), "wall_stiffness must be numbers [N/m], got the text 'stiff'"),
    (
        lambda: chart().check([1.0, 2.0], [1.0, 2.0, 3.0]),
        "wall_stiffness has the shape (2,) and wall_damping (3,); give equal shapes, or one number for all",
    ),
    (lambda: zwidth.judge(loop(), nan, nan), "wall_stiffness must be a finite number [N/m], got nan"),
    (
        lambda: spectral_radius(loop(), 1.0, nan),
        "wall_damping must be a finite number [N s/m], got nan",
    ),
    (
        lambda: eigenvalues(loop(), [nan, 1.0], 1.0),
        "wall_stiffness must be finite numbers [N/m], got nan",
    ),
    (
        lambda: felt_impedance(loop(), nan, 1.0, [1.0]),
        "wall_stiffness must be a finite number [N/m]",
    ),
    (
        lambda: zwidth.Controller(-0.001),
        "sampling_period must be a finite number greater than 0 [s], got -0.001; is it a frequency?",
    ),
    (lambda: zwidth.Controller(nan), "sampling_period must be a finite number greater than 0 [s], got nan"),
    (
        lambda: zwidth.Controller("1 ms"),
        "sampling_period must be a finite number greater than 0 [s], got the text",
    ),
    (lambda: zwidth.Controller(0.001, -1.0), "delay must be a finite number, at least 0 [samples], got -1"),
    (lambda: zwidth.Controller(0.001, nan), "delay must be a finite number, at least 0 [samples], got nan"),
    (
        lambda: zwidth.Controller(0.001, actuator_time_constant=-1.0),
        "actuator_time_constant must be a finite number, at least 0 [s], got -1",
    ),
    (
        lambda: zwidth.Controller(0.001, force_limit=nan),
        "force_limit must be a number greater than 0 [N], got nan",
    ),
    (
        lambda: zwidth.Controller(0.001, force_filter=zwidth.Butterworth(2, 500.0, "tustin-prewarped")),
        "force_filter: cutoff_Hz must be below half the sampling frequency, 500 Hz, got 500",
    ),
    (lambda: zwidth.Butterworth(0, 20.0), "order must be a whole number from 1 on, got 0"),
    (lambda: zwidth.Butterworth(2, -20.0), "cutoff_Hz must be a finite number greater than 0 [Hz], got -20"),
    (
        lambda: zwidth.Butterworth(2, 20.0, "euler"),
        "discretisation must be 'tustin' or 'tustin-prewarped', got the text 'euler'",
    ),
    (lambda: zwidth.FirstOrder(-1.0), "time_constant must be a finite number, at least 0 [s], got -1"),
    (
        lambda: zwidth.Plant(0.3, 0.0, 0.0, 1.0, 1.0),
        "mass must be an array (n, n), got 0.3; write [[0.3]] for one coordinate",
    ),
    (
        lambda: zwidth.Plant(np.eye(2), NONE, NONE, ONE, ONE),
        "damping must be an array (2, 2) where mass is (2, 2), got one of the shape (1, 1)",
    ),
    (
        lambda: zwidth.Plant(np.eye(1), NONE, NONE, np.ones(2), ONE),
        "actuator must be an array (1,) where mass is (1, 1), got one of",
    ),
    (lambda: zwidth.Loop(plant(nan), device().controller), "plant.mass holds nan; every number must be finite"),
    (lambda: zwidth.Loop(plant(-1.0), device().controller), "plant.mass must be positive definite, and its least"),
    (lambda: zwidth.stability_chart(loop(), nan), "radius must be a number with 0 < radius <= 1, got nan"),
    (lambda: zwidth.stability_chart(loop(), 0.0), "radius must be a number with 0 < radius <= 1, got 0"),
    (lambda: hysteretic_chart(loop()), "the plant has no loss factor; stability_chart charts it"),
    (
        lambda: compare(loop(), wall_damping=inf),
        "wall_damping must be finite, or nan for none, got inf",
    ),
    (lambda: decay_time(0.9, -0.001), "sampling_period must be greater than 0 s, got -0.001"),
    (lambda: zwidth.Operator(nan, 1.0, 1.0), "arm_mass must be a finite number, at least 0 [kg], got nan"),
    (
        lambda: zwidth.Response([1.0, 2.0], [1.0]),
        "value has the shape (1,) and frequency (2,); they must be alike",
    ),
]


@pytest.mark.parametrize(
    ("call", "sentence"), KINDS, ids=lambda value: value[:40] if isinstance(value, str) else ""
)
def test_another_kind_of_thing_is_refused_at_once(call, sentence):
    with pytest.raises(TypeError) as caught:
        call()
    assert str(caught.value).startswith(sentence)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("call", "sentence"), VALUES, ids=lambda value: value[:40] if isinstance(value, str) else ""
)
def test_a_number_that_cannot_be_meant_is_refused_at_once(call, sentence):
    with pytest.raises(ValueError) as caught:  # noqa: PT011  the sentence is compared below
        call()
    assert str(caught.value).startswith(sentence)
    assert "\n" not in str(caught.value)


def test_among_many_walls_one_that_is_no_number_is_undecided():
    """Failures among many are data; the same question asked alone raises."""
    found = chart().check([nan, 1000.0], [10.0, 10.0])
    assert found.names == ["undecided", "stable"]
    assert np.isnan(found.spectral_radius[0])
    assert chart().check([nan], [1.0]).names == ["undecided"]
    response, _ = measured_response(systems.published(), np.linspace(4.0, 400.0, 100))
    other = measured_chart(response, zwidth.Controller(0.00125))
    assert other.check([nan], [1.0]).names == ["undecided"]


def test_a_wall_of_a_measured_device_is_finite():
    response, _ = measured_response(systems.published(), np.linspace(4.0, 400.0, 100))
    other = measured_chart(response, zwidth.Controller(0.00125))
    with pytest.raises(ValueError, match=r"wall_stiffness must be a finite number \[N/m\], got nan"):
        other.check(nan, 1.0)


def test_settings_may_be_a_dictionary():
    changed = zwidth.load("published-two-mass", {"loop.delay_samples": 1, "loop.sampling_period_s": 0.002})
    assert (changed.controller.delay, changed.controller.sampling_period) == (1.0, 0.002)


def test_a_plant_of_lists_becomes_one_of_arrays():
    given = zwidth.Plant([[0.3]], [[0.0]], [[0.0]], [1.0], [1.0])
    assert zwidth.judge(zwidth.Loop(given, zwidth.Controller(0.001)), 1000.0, 10.0).names == ["stable"]


IDENTIFY = {
    "arm": identify_arm,
    "boundary": identify_boundary,
    "friction": identify_friction,
    "impedance": identify_impedance,
    "mass": identify_mass,
    "modes": identify_modes,
    "response": identify_response,
    "stiffness": identify_stiffness,
}
# A table of arguments, and what takes them in Python.
TAKEN = [
    (questions.PLACE | questions.DEVICE, zwidth.Device.at),
    (questions.SIMULATE, simulate_contact),
    (questions.SIMULATE, zwidth.OperatingPoint.simulate),
    (questions.MOVE, simulate_mechanism),
    (questions.MOVE, zwidth.OperatingPoint.move),
    (questions.EXPERIMENT, Plan),
    (questions.LIMIT_CYCLES, predict_limit_cycles),
    (questions.LIMIT_CYCLES, zwidth.OperatingPoint.limit_cycles),
    (questions.LOAD, load_path),
    (questions.LOAD, zwidth.Device.load_path),
    (questions.POLAR, largest_stiffness_around),
    (questions.POLAR, zwidth.OperatingPoint.by_direction),
    (questions.WALL, felt_wall),
    (questions.BOUNDS, compare_bounds),
    (questions.BOUNDS, zwidth.OperatingPoint.bounds),
    (questions.WANTED, WantedWall),
    (questions.WANTED, zwidth.OperatingPoint.measure),
    (questions.ROBUST, zwidth.robust_study),
    (questions.TOLERANCE | questions.RUN, tolerance),
    (questions.EXPORT | questions.RUN, safe_walls),
    (questions.RUN, zwidth.workspace_map),
    (questions.RUN, zwidth.sweep),
    (questions.RUN, optimise),
    (questions.RUN, open_executor),
    (questions.IMPORT, import_file),
    *((questions.IDENTIFY[kind], function) for kind, function in IDENTIFY.items()),
]
SHARED = [
    pytest.param(arguments[name], parameter, function, id=f"{function.__qualname__}-{name}")
    for arguments, function in TAKEN
    for name, parameter in inspect.signature(function).parameters.items()
    if name in arguments
]


def test_most_arguments_are_taken_in_python():
    assert len(SHARED) > 160
    assert set(IDENTIFY) == set(questions.IDENTIFY)


@pytest.mark.parametrize(("argument", "parameter", "function"), SHARED)
def test_a_signature_has_the_default_of_the_table(argument, parameter, function):
    if parameter.default is parameter.empty or parameter.default in (None, ()):
        assert argument.default is None
    elif argument.default is not None:
        assert parameter.default == argument.default
    else:
        assert argument.left_out, "a default that the command line does not have"


@pytest.mark.parametrize(("argument", "parameter", "function"), SHARED)
def test_a_docstring_has_the_sentence_of_the_table(argument, parameter, function):
    """Up to its first stop, and without the argument's name where that stands before it anyhow."""
    text = inspect.getdoc(function) or ""
    described = re.search(rf"^ *(?:[\w.]+(?: \.\.\.|,) )*{argument.name}(?:,| {{2,}})", text, re.MULTILINE)
    if argument.kind not in ("number", "whole", "choice") or described is None:
        return
    first = re.split(r"[:;]| \[", argument.sentence)[0].lower()
    without_choices = " ".join(re.sub(r'"[\w-]+",? ?', "", text).lower().split())
    assert first.removeprefix(f"{argument.name.replace('_', ' ')} ") in without_choices


NUMBERS = {
    f"{name}-{one.name}": one
    for name, table in (vars(questions) | questions.IDENTIFY).items()
    if isinstance(table, dict)
    for one in table.values()
    if isinstance(one, Argument) and one.kind in ("number", "whole")
}


@pytest.mark.parametrize("one", NUMBERS.values(), ids=NUMBERS)
def test_a_default_is_within_the_limits_and_what_is_beyond_them_is_refused_by_name(one):
    assert one.default is None or one.allows(one.default)
    beyond = np.nextafter(one.least, -inf), np.nextafter(one.most, inf)
    for value in (one.above, one.below, *beyond, nan, "1", True):
        with pytest.raises(ArgumentError) as caught:
            one.check(value)
        assert caught.value.argument == one.name
    for value in (one.least, one.most):
        assert one.allows(value) == (abs(value) < inf and one.above < value < one.below)


def test_a_command_line_a_study_file_and_the_page_have_the_limits_of_the_table():
    words = ("--stiffness", "1", "--damping", "1")
    assert (
        "at least -1000 and at most 1000 [m/s]"
        in refusal_lines("simulate", "five-bar", *words, "--start-velocity", "1001")[0]
    )
    contact = {"id": 1, "kind": "contact", "state": {"device": "five-bar"}}
    assert REQUEST.validate_python({**contact, "velocity": 1000.0}).velocity == 1000.0
    with pytest.raises(ValueError, match="velocity"):
        REQUEST.validate_python({**contact, "velocity": 1001.0})
    study = {"device": "five-bar", "measures": ["isotropy"]}
    assert StudyFile(**study, spectral_radius=1.0).spectral_radius == 1.0
    with pytest.raises(ValueError, match="spectral_radius"):
        StudyFile(**study, spectral_radius=1.1)


def test_the_tables_of_the_page_on_commands_are_those_of_the_commands():
    assert make_commands.PAGE.read_text(encoding="utf-8") == make_commands.page()
