"""What is said of a contact in time: walls, environments, starts and motions that cannot be meant."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest

import zwidth
import zwidth as package
from tests.cli.command_runner import ONE_MASS as BUNDLED_ONE_MASS
from tests.cli.command_runner import TWO_MASS
from tests.contact import test_user_environments
from tests.contact.engine_cases import run, two_mass_loop
from tests.contact.mechanism_cases import UNDAMPED, motion_of, sampled_controller, with_friction
from tests.contact.test_engine_computer import WALL
from tests.contact.test_limit_cycles import ONE_MASS
from tests.contact.test_loaded_contact import point
from tests.contact.test_mechanism_computer import FIVE_BAR, INTO, push_five_bar
from tests.contact.test_mechanism_environments import FIVE_BAR as SURFACE_FIVE_BAR
from tests.contact.test_mechanism_environments import PUSHED, SURFACES
from tests.contact.test_mechanism_environments import silent as surface_silent
from tests.contact.test_predict_limit_cycles import LIMITED, rough
from tests.contact.test_predict_limit_cycles import one_mass as predicted_one_mass
from tests.contact.test_simulate_contact import bundled, one_mass
from tests.contact.test_touch_obstacle import FOAW, two_masses
from tests.contact.test_user_environments import GOOD, HEAD
from tests.systems import mass, published
from zwidth.contact import (
    ENVIRONMENTS,
    Box,
    PassivityController,
    Plane,
    Reach,
    Reflex,
    Run,
    Sphere,
    StabilityTrial,
    SurfaceEnvironment,
    SurfaceWall,
    describing_functions,
    device_plane,
    environment,
    limit_cycles,
    load_environment,
    predict_limit_cycles,
    simulate_batch,
    simulate_contact,
    touch_obstacle,
    wall,
)
from zwidth.contact.harmonic_balance import harmonic_balance
from zwidth.errors import ArgumentError, FeedbackError, HysteresisError, NoAnswerError, TooLarge
from zwidth.loop import Controller, Loop
from zwidth.model import Load

# --- describing functions against numerical Fourier integrals, and derived again by computer ---------


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: describing_functions.quantiser(0.0, 1.0), "amplitude must be positive"),
        (lambda: describing_functions.quantiser(1.0, -1.0), "step must not be negative"),
        (lambda: describing_functions.saturation(1.0, 0.0), "limit must be positive"),
    ],
)
def test_what_cannot_be_is_refused(call, said):
    with pytest.raises(ValueError, match=said):
        call()


# --- a boundary measured on the virtual device falls on the exact one where the device is ------------


@pytest.mark.parametrize(
    ("circumstances", "message"),
    [
        ({"disturbance": -1.0}, "disturbance must be finite and not negative"),
        ({"visible": np.nan}, "visible must be finite"),
        ({"speed": np.inf}, "speed must be finite"),
        ({"one_sided": True}, "push must be positive"),
        ({"disturbance": 1e-6, "visible": 1e-5}, "larger than what counts as visible"),
        ({"disturbance": 0.0}, "larger than what counts as visible"),
    ],
)
def test_what_cannot_be_meant_is_refused(circumstances, message):
    with pytest.raises(ArgumentError, match=message):
        StabilityTrial(published(), **circumstances)


# --- limit cycles by harmonic balance: against the linear loop on whose edge they are, and -----------


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: limit_cycles(ONE_MASS, np.nan, 0.0), "wall must be finite"),
        (lambda: limit_cycles(ONE_MASS, 1.0, 0.0, coulomb_friction=-1.0), "must not be negative"),
        (lambda: limit_cycles(ONE_MASS, 1.0, 0.0, coulomb_friction=[1.0, 1.0]), "one number or 1"),
        (lambda: limit_cycles(ONE_MASS, 1.0, 0.0, resolution=-1.0), "resolution must not be negative"),
        (lambda: limit_cycles(ONE_MASS, 1.0, 0.0, force_limit=0.0), "force_limit must be positive"),
        (lambda: harmonic_balance(ONE_MASS, 1.0, 0.0, force_limit=1.0, amplitudes=(2.0, 1.0)), "lower first"),
        (lambda: device_plane(ONE_MASS, [0.0], 1.0, 1.0), "positive and finite"),
        (lambda: device_plane(ONE_MASS, [1.0], 1.0), "encoder with steps"),
        (
            lambda: device_plane(Loop(mass(0.1, 0.1, 5.0), Controller(0.001)), [1.0], 1.0, 1.0),
            "tied to the ground",
        ),
    ],
)
def test_bad_input_is_named(call, said):
    with pytest.raises(ValueError, match=said):
        call()


# --- what the computer sees and does: counts in the workspace, surfaces, delays, limits; and ---------


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"duration": 0.0}, "duration must be a finite number, above 0"),
        ({"duration": np.inf}, "duration must be a finite number, above 0"),
        ({"substeps": 0}, "substeps must be a whole number from 1"),
        ({"push": np.zeros((7, 3))}, r"one for each sample, \(200, 3\), got an array of \(7, 3\)"),
        ({"push": [1.0]}, "push must be two or three finite numbers"),
        ({"push": np.full((200, 3), np.nan)}, "row 0 is not"),
        ({"gravity": [0.0, np.nan]}, r"gravity must be two or three finite numbers \[m/s²\]"),
        ({"start_velocity": (0.0, 0.0, 1.0)}, "across what the drives can do"),
        ({"wall": SurfaceWall(500.0)}, "a wall needs a surface"),
        ({"surface": INTO}, "a wall needs a surface"),
        ({"surface": INTO, "wall": SurfaceWall(-1.0)}, "stiffness must be at least 0"),
        ({"surface": INTO, "wall": SurfaceWall(1.0, np.nan)}, "damping must be finite"),
        ({"surface": Plane((0, 0.26), (0, 0)), "wall": SurfaceWall(1.0)}, "normal has no length"),
        ({"surface": Sphere((0, 0.26), -1.0), "wall": SurfaceWall(1.0)}, "radius must be positive"),
        ({"surface": Box((0, 0.26), (0.1, 0.0)), "wall": SurfaceWall(1.0)}, "half_sizes must be"),
        ({"surface": Box((0, 0.26), (0.1, 0.1), np.ones((3, 3))), "wall": SurfaceWall(1.0)}, "rotation matrix"),
        ({"mechanism": with_friction(FIVE_BAR, -1.0)}, "coulomb friction must be at least 0"),
        ({"mechanism": with_friction(FIVE_BAR, brake_damping=1.0)}, "programmable brake"),
        ({"encoders": "nose"}, "encoders must be"),
        ({"torque_limits": "some"}, "torque_limits must be"),
        ({"at": (0.0, 0.5)}, "cannot reach"),
    ],
)
def test_inputs_that_cannot_be_meant_are_refused_in_words(settings, said):
    with pytest.raises(ValueError, match=said):
        push_five_bar(**settings)


def test_several_postures_and_a_negative_seed_are_refused():
    point = zwidth.load("five-bar").at([(0.0, 0.25), (0.02, 0.25)])
    with pytest.raises(
        ArgumentError, match=r"one posture is moved at a time, got \(2,\); take one of them by its"
    ):
        point.move()
    with pytest.raises(ArgumentError, match=r"seed must be a whole number from 0 to \d+, got -1"):
        point[0].move(seed=-1)
    with pytest.raises(
        ArgumentError, match=r"duration must be a finite number, above 0 and at most 1e\+09 \[s\], got '1'"
    ):
        point[0].move(duration="1")


# --- a contact simulated from Python: what the command says, its defaults, its errors, and how -------


@environment([])
def silent(position, velocity, time, period, parameters, memory):
    return np.nan if time > 0.01 else -1000.0 * position


def test_it_shows_itself_in_five_lines():
    for simulated in (
        simulate_contact(bundled(TWO_MASS), 20000.0, 1.0),
        simulate_contact(bundled(BUNDLED_ONE_MASS), 500.0, 1.0, wall="one-sided", duration=0.002),
        simulate_contact(one_mass(), environment="texture", duration=0.1),
    ):
        lines = repr(simulated).splitlines()
        assert len(lines) <= 5
        assert max(map(len, lines)) <= 115
        assert simulated.behaviour in lines[1]
    assert "not stable: growing" in repr(simulate_contact(bundled(TWO_MASS), 20000.0, 1.0))


WRONG = [
    ({}, "stiffness", "stiffness is missing; a wall needs one [N/m]"),
    ({"stiffness": nan}, "parameters", "stiffness of wall is missing: a number [N/m], any number"),
    ({"stiffness": 1.0, "no_pull": True}, "no_pull", "wall has no such parameter; it has stiffness, damping"),
    ({"stiffness": 1.0, "parameters": {"width": 1.0}}, "parameters", "wall has no parameter width"),
    ({"stiffness": 1.0, "parameters": {"stiffness": 2.0}}, "parameters", "stiffness is given twice"),
    ({"environment": "slott"}, "environment", "did you mean slot?"),
    ({"environment": "slot", "wall": "one-sided"}, "wall", "leave one out"),
    ({"environment": "texture", "stiffness": 3.0}, "stiffness", "texture has no such parameter"),
    ({"stiffness": 1.0, "ramp": 0.5}, "ramp", "no push is given; give push"),
    ({"stiffness": 1.0, "reach": Reach(0.1)}, "reach", "nobody holds the device; give operator"),
    ({"stiffness": 1.0, "reflex": Reflex(1.0)}, "reflex", "nobody holds the device; give operator"),
]


@pytest.mark.parametrize(("arguments", "argument", "says"), WRONG, ids=[says for *_, says in WRONG])
def test_an_argument_that_cannot_be_meant_is_named(arguments, argument, says):
    with pytest.raises(ArgumentError) as caught:
        simulate_contact(one_mass(), **arguments)
    assert caught.value.argument == argument
    assert says in str(caught.value)
    assert "--" not in str(caught.value)


def test_an_environment_that_gives_no_number_is_named_with_where_it_was():
    numbers = r"given a position of [-0-9.e]+ m and [-0-9.e]+ m/s;"
    with pytest.raises(NoAnswerError, match=rf"^silent gave no finite force at 0\.011 s, where it was {numbers}"):
        simulate_contact(one_mass(), environment=silent)


NUMBERS = [
    ({"duration": 0.0}, "duration must be a finite number, above 0"),
    ({"duration": inf}, "duration must be a finite number, above 0"),
    ({"start_position": nan}, "start_position must be a finite number"),
    ({"wall_position": inf}, "wall_position must be a finite number"),
    ({"start_velocity": nan}, "start_velocity must be a finite number"),
    ({"substeps": 0}, "substeps must be a whole number from 1"),
    ({"seed": -1}, "seed must be a whole number from 0"),
    ({"push": inf}, "push must be finite"),
    ({"passivity_damping": 0.0}, "largest_damping of the passivity controller must be positive"),
    ({"wall": "soft"}, "wall must be 'two-sided' or 'one-sided'"),
]


@pytest.mark.parametrize(("arguments", "says"), NUMBERS, ids=[says for _, says in NUMBERS])
def test_a_number_out_of_range_is_named(arguments, says):
    with pytest.raises(ValueError, match=says):
        simulate_contact(one_mass(), 1000.0, 1.0, **arguments)


# --- environments at a surface: an arm too long to turn is the device of the other simulator ---------


@pytest.mark.parametrize(
    ("wall", "surface", "said"),
    [
        (
            SurfaceEnvironment(ENVIRONMENTS["slot"], [1.0]),
            SURFACES[0],
            r"slot takes 4 values \(width, stiffness, ",
        ),
        (
            SurfaceEnvironment(surface_silent, [1.0]),
            SURFACES[0],
            r"silent takes 0 values \(none\), got an array of shape",
        ),
        (
            SurfaceEnvironment(ENVIRONMENTS["wall"], [1.0, 0.0]),
            replace(SURFACES[0], two_sided=True),
            "two_sided is of a SurfaceWall; wall says itself on which sides",
        ),
        (SurfaceWall(1.0, no_pull=True), replace(SURFACES[0], two_sided=True), "always pulls"),
        (ENVIRONMENTS["wall"], SURFACES[0], "must be a SurfaceWall or a SurfaceEnvironment, got Environment"),
        (SurfaceWall(1.0), "plane", "must be a Plane, a Sphere or a Box, got str"),
    ],
)
def test_walls_that_cannot_be_meant(wall, surface, said):
    with pytest.raises(ArgumentError, match=said):
        motion_of(SURFACE_FIVE_BAR, UNDAMPED, sampled_controller(), wall, surface, **PUSHED)


# --- the passivity observer counts work as defined; its controller gives back what is missing --------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"largest_damping": 0.0}, "largest_damping of the passivity controller must be positive"),
        ({"largest_damping": nan}, "largest_damping"),
        ({"largest_damping": 1.0, "largest_force": -1.0}, "largest_force"),
        ({"largest_damping": 1.0, "reference_energy": 0.1}, "zero or negative"),
        ({"largest_damping": 1.0, "device_damping": -0.1}, "device_damping"),
        ({"largest_damping": 1.0, "counting": "both"}, '"held" or "sampled"'),
    ],
)
def test_options_that_cannot_be_meant_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        PassivityController(**options)


# --- a user's own environment: parameters are checked, files are found, and faults are said in -------


write_environment = test_user_environments.write_environment


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"stifness": 1.0}, "slot has no parameter stifness; did you mean stiffness?"),
        ({"q": 1.0}, "slot has no parameter q; it has width, stiffness, damping, no_pull"),
        ({"width": -1.0}, "width of slot must be from 0 on, or inf [m], got -1"),
        ({"stiffness": np.inf}, "stiffness of slot must be from 0 on [N/m], got inf"),
        ({"stiffness": np.nan}, "stiffness of slot is missing: a number [N/m], from 0 on"),
        ({"damping": "much"}, "damping of slot must be a number [N s/m], got 'much'"),
        ({"no_pull": 0.5}, "no_pull of slot must be 0 or 1, got 0.5"),
    ],
)
def test_parameters_are_checked(given, message):
    with pytest.raises(ValueError) as fault:  # noqa: PT011  the whole message is compared
        ENVIRONMENTS["slot"].values(**given)
    assert str(fault.value) == message


def test_all_faults_of_the_parameters_are_said_at_once():
    with pytest.raises(ValueError, match=r"no parameter wide(.|\n)*stiffness of slot(.|\n)*no_pull"):
        ENVIRONMENTS["slot"].values(wide=1.0, stiffness=-1.0, no_pull=2.0)


def test_a_parameter_without_default_must_be_given(write_environment):
    with pytest.raises(ValueError, match=r"rate of push is missing: a number \[1/s\], any number"):
        load_environment(write_environment(GOOD)).values()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = (", r"own\.py:1 does not run: '\(' was never closed"),
        ("import nothing_of_that_name", r"own\.py:1 does not run: ModuleNotFoundError"),
        ("\nraise SystemExit(3)", r"own\.py:2 does not run: SystemExit: 3"),
        (GOOD.replace("push(", "pusch("), r"own\.py has no environment push; did you mean pusch\?"),
        ("", r"own\.py has no environment push; it has none"),
        ("def push(x): return 0.0", r"push in own\.py is not an environment; put @environment"),
        (
            GOOD.replace("T, p, m", "p, m"),
            r"push must take \(position, velocity, time, period, parameters, memory\)",
        ),
        (GOOD.replace("    m[0]", "    assert x > 0\n    m[0]"), r"own\.py:2: push has a raise or an assert"),
        (GOOD.replace("p[1]", "p[2]"), r"own\.py:2: push reads beyond its 2 parameters or the 8 numbers"),
        (GOOD.replace("m[0] += 1.0", "m[8] += 1.0"), r"push reads beyond"),
        (GOOD.replace("'rate'", "'level'"), r"push has two parameters named level"),
        (GOOD.replace("0.5", "5.0"), r"own\.py:2: default of level must be from 0 to 3, got 5"),
        (GOOD.replace("* t", "* undefined"), r"own\.py:2: push does not compile: NameError: name 'undefined'"),
        (
            GOOD.replace("p[1]", "p.foo"),
            r"push does not compile: Unknown attribute 'foo' of type array.* \(line 6\)$",
        ),
        (GOOD.replace("p[1]", "np.foo").replace(HEAD, HEAD + "import numpy as np\n"), r"has no attribute 'foo'$"),
        (GOOD.replace("return ", "y = "), r"push does not compile: .*none.*float64"),
        (GOOD.replace("p[1] * t", "open('x')"), r"push does not compile: .*line 6"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_in_one_sentence(write_environment, text, message):
    with pytest.raises(ValueError, match=message) as fault:
        load_environment(write_environment(text))
    assert "\n" not in str(fault.value)
    assert len(str(fault.value)) < 250


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("slott", "no environment is named 'slott'; did you mean slot?"),
        ("qqq", "no environment is named 'qqq'; there are wall, one_sided_wall"),
        ("gone.py:push", "no such file: gone.py"),
        ("own.py", "no environment is named 'own.py'"),
    ],
)
def test_sources_that_lead_nowhere(source, message):
    with pytest.raises(ValueError) as fault:  # noqa: PT011  the message is compared
        load_environment(source)
    assert str(fault.value).startswith(message)


def test_a_file_given_relative_to_the_folder_is_told_with_its_line(tmp_path, monkeypatch):
    (tmp_path / "raises.py").write_text("import zwidth\nx = 1 / 0\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=r"^raises\.py:2 does not run: ZeroDivisionError"):
        load_environment("raises.py:law")


# --- limit cycles predicted and simulated from Python: what the command says, how far, its -----------


def test_a_prediction_shows_itself_in_five_lines():
    predicted = predict_limit_cycles(rough(), 2600.0, 0.0, simulate=False)
    many = replace(predicted, answers=5 * predicted.answers)
    none = replace(predicted, answers=())
    for shown in (predicted, many, none):
        assert len(repr(shown).splitlines()) <= 5
        assert max(map(len, repr(shown).splitlines())) <= 115
    assert "and 7 more limit cycles" in repr(many)
    assert "no limit cycle is predicted" in repr(none)


def test_what_cannot_be_asked_is_an_error_of_its_own():
    with pytest.raises(NoAnswerError, match="dry friction, encoder steps or a largest force"):
        predict_limit_cycles(predicted_one_mass(), 1000.0, 1.0)
    with pytest.raises(ArgumentError, match="leave it at 0"):
        predict_limit_cycles(predicted_one_mass(force_limit=1.0), 1000.0, 1.0, offset=0.5)
    with pytest.raises(ValueError, match=r"offset must be a finite number, at least -0\.5"):
        predict_limit_cycles(rough(), 1000.0, 1.0, offset=0.6)
    with pytest.raises(ValueError, match="stiffness must be a finite number"):
        predict_limit_cycles(rough(), np.nan, 1.0)
    with pytest.raises(ValueError, match="damping must be a finite number"):
        predict_limit_cycles(rough(), 1000.0, np.inf)
    with pytest.raises(TypeError, match=r"point must be an OperatingPoint, got a Device; write device\.at\(\)"):
        predict_limit_cycles(package.load(BUNDLED_ONE_MASS), 1000.0, 1.0)
    hysteretic = package.load(TWO_MASS, ["plant.loss_factor=0.1", LIMITED]).at()
    with pytest.raises(HysteresisError):
        predict_limit_cycles(hysteretic, 1000.0, 1.0)


# --- contact under load: by the eigenvalues of the loop, by the energies, and by the law of ----------


def test_what_no_load_goes_with_is_refused():
    one = point(Load(push=3.0))
    with pytest.raises(ArgumentError, match="does not go with a load"):
        one.simulate(900.0, 4.0, environment="slot")
    with pytest.raises(ArgumentError, match="no hand leans on it"):
        point(Load(gravity=(0.0, -9.81))).simulate(900.0, 4.0, wall="one-sided")
    with pytest.raises(FeedbackError, match="under load"):
        one.limit_cycles(900.0, 4.0)
    with pytest.raises(FeedbackError, match="under load"):
        one.felt(900.0, 4.0)
    assert "pressed_wall" in ENVIRONMENTS


# --- what the computer does at a sample, and what must not change a run: threads, neighbours ---------


@pytest.mark.parametrize("duration", [0.0, -1.0, float("nan"), float("inf")])
def test_durations_that_cannot_be_meant_are_refused(duration):
    with pytest.raises(ValueError, match="duration must be positive and finite"):
        run(two_mass_loop(), 100.0, 1.0, duration)


@pytest.mark.parametrize("substeps", [0, -3, 100_001])
def test_substeps_that_cannot_be_meant_are_refused(substeps):
    with pytest.raises(ValueError, match="substeps must be a whole number from 1 to 100000"):
        run(two_mass_loop(), 100.0, 1.0, 0.1, substeps=substeps)


def test_a_start_of_the_wrong_shape_is_refused():
    with pytest.raises(ValueError, match="two arrays of 2 numbers"):
        run(two_mass_loop(), 100.0, 1.0, 0.1, start=(np.zeros(3), np.zeros(2)))


def test_days_are_refused_with_the_memory_they_would_take():
    with pytest.raises(
        TooLarge,
        match=r"1 run of .* samples would take .* GB of memory, and this .* has .* GB; simulate a shorter",
    ):
        run(two_mass_loop(), 100.0, 1.0, 30 * 86400.0)
    with pytest.raises(TooLarge, match="fewer runs at once"):
        simulate_batch([Run(two_mass_loop(), WALL)] * 3, wall, duration=[1.0, 1.0, 1e12])


# --- what keeps the page from touching a device, each by a device that has it and is touched ---------


def test_several_obstacles_are_named_in_one_sentence() -> None:
    point = two_masses(loop={"local": {"rate_multiple": 4, "damping_Ns_per_m": 0.1}, **FOAW})
    assert touch_obstacle(point.loop) == (
        "The page does not compute velocity estimates that are not linear and a local loop, "
        "so that the server simulates it instead."
    )
