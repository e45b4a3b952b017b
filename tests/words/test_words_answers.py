"""What charts, guarantees and measures say of themselves, and of what cannot be asked of them."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest

import zwidth
import zwidth as package
from tests import systems
from tests.chart.test_chart_results import KINDS, chart_of_kind
from tests.cli.command_runner import MECHANISM, TWO_MASS, refusal_lines
from tests.guarantees.test_guarantees_feedback import T
from tests.guarantees.test_guarantees_point import point
from tests.measured_cases import measured_response
from tests.measures import test_user_measures
from tests.measures.test_buzz import limited
from tests.measures.test_felt_together import BAND
from tests.measures.test_felt_wall import WALL, pair
from tests.measures.test_measures_geometry import WINDINGS, WITHOUT_LENGTHS
from tests.measures.test_user_measures import GOOD
from tests.multi_loops import random_multi
from tests.systems import mass
from zwidth.chart import BoundaryArc, measured_chart
from zwidth.device.load import load
from zwidth.errors import ArgumentError, HandleError, MeasureError, ProcessorError, ResponseError
from zwidth.guarantees import guarantees_of, passive_region
from zwidth.loop import Butterworth, Controller, Feedforward, Loop, MultiLoop, WallMatrices
from zwidth.measures import (
    OK,
    characteristic_length,
    felt_wall,
    find_measure,
    global_conditioning_index,
    global_isotropy_index,
    homogeneous_jacobian,
    load_measures,
    overall,
    scaled_jacobian,
)
from zwidth.model import Response, integrators_of
from zwidth.resources import check_processor

# --- charts of walls that differ along their directions: against eigenvalues, single charts ----------


WANTED = "must be 2 numbers, one for each direction, or a matrix of 2 rows and columns"


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ([1.0], f"{WANTED}, got 1 number"),
        ([1.0, 0.2, 0.3], f"{WANTED}, got 3 numbers"),
        ([], f"{WANTED}, got 0 numbers"),
        (np.eye(3), f"{WANTED}, got 3 rows of 3 numbers"),
        ([[1.0, 0.2]], f"{WANTED}, got 1 row of 2 numbers"),
        (np.eye(2)[None], f"{WANTED}, got an array of shape (1, 2, 2)"),
        ("stiff", f"{WANTED}, got the text 'stiff'"),
        ([1.0, "soft"], f"{WANTED}, got a list"),
        ([[1.0, 0.0], [1.0]], f"{WANTED}, got a list"),
        ([1.0, 0.2j], f"{WANTED}, got a list"),
        (np.array([1.0, 0.2j]), f"{WANTED}, got complex numbers"),
        ([1.0, np.nan], "must be finite numbers, got nan"),
        ([[1.0, np.inf], [np.inf, 1.0]], "must be finite numbers, got inf"),
        ([1.0, -0.2], "must not be negative, got -0.2"),
        ([0.0, 0.0], "must not be 0 along all directions"),
        (np.zeros((2, 2)), "must not be 0 along all directions"),
        (
            [[1.0, 0.3], [0.2, 1.0]],
            "must be symmetric, got 0.3 in row 1, column 2 and 0.2 in row 2, column 1",
        ),
        ([[1.0, 2.0], [2.0, 1.0]], "must have no negative eigenvalue, got one of -1"),
        ([[1e308, 0.0], [0.0, -1e308]], "must have no negative eigenvalue, got one of -1e+308"),
        (
            [[0.0, 1e308], [-1e308, 0.0]],
            "must be symmetric, got 1e+308 in row 1, column 2 and -1e+308 in row 2, column 1",
        ),
    ],
)
@pytest.mark.parametrize("name", ["relative_stiffness", "relative_damping"])
def test_what_is_no_matrix_of_a_law_is_refused_in_one_sentence(name, given, problem):
    arguments = {"relative_stiffness": [1.0, 1.0], name: given}
    with pytest.raises(ArgumentError) as refused:
        WallMatrices.of(**arguments, count=2)
    assert str(refused.value) == f"{name} {problem}"


def test_no_numbers_at_all_are_refused():
    with pytest.raises(ArgumentError, match=r"^relative_stiffness must be 1 number, or .* got 0 numbers$"):
        WallMatrices.of([])


def test_matrices_of_another_number_of_directions_are_refused():
    loop = random_multi(0)
    with pytest.raises(ValueError, match=r"^matrices must be those of 2 directions, .* has, got 3$"):
        MultiLoop(loop.plant, loop.controller, WallMatrices.of([1.0, 1.0, 1.0]))
    with pytest.raises(TypeError, match=r"matrices .*write WallMatrices\.of"):
        MultiLoop(loop.plant, loop.controller, np.eye(2))


# --- a plant's own exact response gives back its exact chart; what data cannot tell is said ----------


def test_integrators_that_do_not_fit_and_swapped_columns_are_refused():
    response, _ = measured_response(systems.published(), np.linspace(0.5, 400.0, 800))
    with pytest.raises(ResponseError, match="integrators = 0 does not fit: the phase is 180 degrees"):
        integrators_of(replace(response, integrators=0), 0.00125)
    swapped = replace(response, value=response.value.imag + 1j * response.value.real)
    with pytest.raises(ResponseError, match="are columns swapped"):
        integrators_of(swapped, 0.00125)
    upside_down = replace(response, value=-response.value)
    with pytest.raises(ResponseError, match="the position moves against the force; is the sign"):
        integrators_of(upside_down, 0.00125)


def test_the_lowest_frequencies_that_are_left_out_for_their_error_are_not_called_incoherent():
    loop = systems.published()
    f = np.linspace(0.5, 400.0, 800)
    response, computer = measured_response(loop, f, coherence=np.where(f < 3.0, 0.9, 0.9999))
    first = measured_chart(response, computer).unusable[0]
    assert first.low == 0.0
    assert "coherence down to 0.9 of 1 averages leaves an error of more than 50 %" in first.reason


def test_a_device_that_begins_above_its_resonance_is_told_to_be_measured_lower():
    response, computer = measured_response(Loop(systems.mass(0.1, 0.3, 0.0), Controller(0.001)))
    above = Response(response.frequency, -response.value)
    with pytest.raises(ResponseError, match=r"one of them turned\? If not, .* measure lower"):
        measured_chart(above, computer)


def test_nothing_near_the_boundary_is_one_clear_error():
    response, computer = measured_response(systems.published(), np.linspace(300.0, 400.0, 50))
    with pytest.raises(
        ResponseError, match=r"no frequencies near|cannot be read off|disagree|does not fit|swapped"
    ):
        measured_chart(replace(response, integrators=2), computer)
    few = Response(response.frequency[:4], response.value[:4])
    with pytest.raises(ResponseError, match="4 usable frequencies of 4"):
        measured_chart(few, computer)
    above = replace(response, frequency=response.frequency * 2.0)
    with pytest.raises(ResponseError, match="above half the sampling rate"):
        measured_chart(above, computer)


# --- what charts of every kind share: their document, their table, how they show themselves ----------


@pytest.mark.parametrize("kind", KINDS)
def test_a_chart_shows_itself_in_five_lines_with_units(kind):
    chart = chart_of_kind(kind)
    text = repr(chart)
    lines = text.splitlines()
    assert len(lines) <= 5
    assert lines[0].startswith(f"{type(chart).__name__}: ")
    assert "array" not in text
    assert max(map(len, lines)) < 115
    if kind == "nothing":
        assert "none: no stable wall has K > 0 and B >= 0" in text
    else:
        assert f"{chart.stiffness_max:.6g} N/m at {chart.damping_at_stiffness_max:.6g} N s/m" in text
        assert f"{chart.frequencies_at_stiffness_max[0]:.6g} Hz" in text.replace(" and", " Hz")
        assert f"{chart.damping_max:.6g} N s/m" in text
        assert f"{chart.stable_area:.6g} N² s/m²" in text


def test_an_arc_shows_how_long_it_is_and_where():
    arc = BoundaryArc(np.arange(3.0), np.zeros(3), np.array([1.0, 2.5, 20.0]))
    assert repr(arc) == "BoundaryArc(3 walls, 1 to 20 Hz)"


# --- charts on a GPU: the kernels of the processor, run as Python in numba's simulator of a GPU ------


def test_an_unknown_processor_is_refused():
    with pytest.raises(ValueError, match="processor must be 'cpu' or 'cuda', got 'gpu'"):
        check_processor("gpu")


@pytest.mark.parametrize("command", ["map", "sweep"])
def test_a_command_says_what_is_missing_for_a_gpu(command, tmp_path, monkeypatch):
    def missing():
        raise ProcessorError("needs the package numba-cuda, which is not installed", "install zwidth[cuda]")

    monkeypatch.setattr("zwidth.resources._check_gpu", missing)
    study = tmp_path / "study.toml"
    study.write_text(
        'device = "five-bar"\nmeasures = ["stiffness_max"]\n'
        '[[axis]]\nkey = "loop.sampling_period_s"\nvalues = [0.001]\n'
    )
    words = {"map": ("five-bar", "--measure", "stiffness_max"), "sweep": (study,)}[command]
    assert refusal_lines(command, *words, "--processor", "cuda") == [
        "--processor cuda needs the package numba-cuda, which is not installed; install zwidth[cuda], or leave "
        "--processor out to compute without one"
    ]


def test_a_package_that_is_missing_is_named(monkeypatch):
    monkeypatch.setattr("zwidth.resources.find_spec", lambda name: None)
    with pytest.raises(ProcessorError, match="numba-cuda, which is not installed"):
        check_processor("cuda")


# --- guarantees with feedback beside the wall law: what is known of all operators and springs --------


def test_feedforward_that_some_hand_makes_vibrate_guarantees_nothing():
    """Half of a frictionless mass's inertia is fed forward: without friction no feedback is passive."""
    controller = Controller(T, feedforward=Feedforward(0.1, acceleration_filter=Butterworth(2, 50.0)))
    region = passive_region(Loop(mass(0.2, 0.01), controller), np.ones(1))
    assert region.reason == "some passive operator vibrates with the feedforward even without a wall"


# --- guarantees of a device at an operating point: who is left out, couplings, keys, columns ---------


@pytest.mark.parametrize(
    ("wall", "error", "says"),
    [
        ((0.0, 1.0), ValueError, "the wall's stiffness must be a finite number greater than 0"),
        ((float("nan"), 1.0), ValueError, "the wall's stiffness"),
        ((100.0, float("inf")), ValueError, "the wall's damping must be a finite number"),
        (100.0, TypeError, "wall must be a pair of stiffness"),
    ],
)
def test_a_wall_that_is_none_is_refused(wall, error, says):
    with pytest.raises(error, match=says):
        guarantees_of(point(), wall=wall)


# --- what the hand feels at many places and designs at once: each as alone, by the impedance ---------


@pytest.mark.parametrize(
    ("band", "said"),
    [
        ({"lowest_frequency": 60.0, "highest_frequency": 60.0}, "highest_frequency above the lowest_frequency"),
        ({"lowest_frequency": 500.0, "highest_frequency": 600.0}, "lowest_frequency below half the sampling"),
    ],
)
def test_a_band_that_is_none_is_refused(band, said):
    with pytest.raises(MeasureError, match=said):
        zwidth.load("five-bar").at().measure("impedance_ratio", **{**BAND, **band})


# --- what is felt of one wall, from Python: as the command says, of stable walls and others ----------


def test_it_shows_itself_in_five_lines():
    for felt in (felt_wall(pair(), *WALL), felt_wall(pair(), 9000.0, 10.0)):
        lines = repr(felt).splitlines()
        assert len(lines) <= 5
        assert max(map(len, lines)) <= 115
    assert "felt at rest with 3185 N/m" in repr(felt_wall(pair(), *WALL))
    assert "this wall is unstable" in repr(felt_wall(pair(), 9000.0, 10.0))


def test_what_cannot_be_asked():
    with pytest.raises(HandleError, match="give `handle`, or use another model"):
        felt_wall(package.load(MECHANISM).at(model="motor-mass"), *WALL)
    with pytest.raises(ValueError, match="stiffness must be a finite number"):
        felt_wall(pair(), nan, 1.0)
    with pytest.raises(ValueError, match="damping must be a finite number"):
        felt_wall(pair(), 1000.0, inf)
    with pytest.raises(TypeError, match=r"point must be an OperatingPoint, got a Device; write device\.at\(\)"):
        felt_wall(package.load(TWO_MASS), *WALL)


# --- clearance, limits, singularities, extent, first mode and heat: each by a second route -----------


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("upper-left", "each written as 'A:B', got 'upper-left'"),
        ("upper-left:upper-left", "each written as 'A:B'"),
        ("upper-left:elbow", "has no link 'elbow' to check in colliding_links; there are upper-right, "),
    ],
)
def test_links_that_there_are_not_are_refused(written, said):
    with pytest.raises(MeasureError) as caught:
        zwidth.load("five-bar").at().measure("link_clearance", link_radius=0.0, colliding_links=[written])
    assert said in str(caught.value)


@pytest.mark.parametrize("name", WITHOUT_LENGTHS)
def test_links_without_length_have_no_clearance(name):
    with pytest.raises(MeasureError, match="needs links with a length; give length_m"):
        zwidth.load(name).at().measure("link_clearance", link_radius=0.001)


def test_heat_needs_force_constant_and_resistance():
    device = zwidth.load("five-bar")
    with pytest.raises(MeasureError, match=r"winding_resistance_ohm of every drive; give mechanism"):
        device.at().measure("motor_heat", force=1.0)
    with pytest.raises(MeasureError, match="needs a force to be held; give force"):
        device.with_(WINDINGS).at().measure("motor_heat")


# --- jacobians of mixed units: scaling, characteristic lengths against brute force, other ------------


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda J: homogeneous_jacobian(J, 0.0, (2,)), "greater than 0 m, got 0"),
        (lambda J: homogeneous_jacobian(J, 0.1, (3,)), "rotations must be from 0 to 2, got 3"),
        (lambda J: homogeneous_jacobian(J, 0.1, (), (-1,)), "prismatic must be from 0 to 2, got -1"),
        (lambda J: homogeneous_jacobian([1.0], 0.1), "a Jacobian is a matrix"),
        (lambda J: characteristic_length(J), "no length makes a difference"),
        (lambda J: characteristic_length(J, (0, 1, 2)), "no length makes a difference"),
        (lambda J: characteristic_length(J[:, :2], (2,)), "of a Jacobian of 3 x 2 the rows have different units"),
        (lambda J: characteristic_length(J[:2], (), (2,)), "2 x 3 the columns"),
        (
            lambda J: scaled_jacobian(J, [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]),
            "largest_velocities must be greater than",
        ),
        (lambda J: scaled_jacobian(J, [1.0, 1.0, 1.0], [1.0, -1.0, 1.0]), "largest_rates must be greater than"),
    ],
)
def test_what_makes_no_sense_is_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call(np.random.default_rng(14).normal(size=(3, 3)))


# --- measures over a workspace against sums by hand and integrals in closed form ---------------------


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: overall([1.0, 2.0], [OK]), r"the status has the shape \(1,\), the values \(2,\)"),
        (
            lambda: overall([1.0, 2.0], weights=[1.0, 1.0, 1.0]),
            r"shape \(3,\), which does not fit that of the values",
        ),
        (lambda: overall([1.0, 2.0], weights=[1.0, -1.0]), "at least 0 and finite, got -1"),
        (lambda: overall([1.0, 2.0], weights=[1.0, np.inf]), "got inf"),
        (lambda: global_conditioning_index([0.5]), "at least 1, got 0.5; is it a reciprocal?"),
        (lambda: global_isotropy_index(np.ones((2, 3, 2)), [OK]), "the status has the shape"),
    ],
)
def test_statistics_of_what_makes_no_sense_are_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()


# --- measures of a user's own: found in a file, asked, and failing in their own cells only -----------


write = test_user_measures.write


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = 1\nthis is no Python\n", r"my\.py:2 does not run: invalid syntax"),
        ("def f():\n    return 1 / 0\nf()\n", r"my\.py:2 does not run: ZeroDivisionError: division by zero"),
        ("import sys\nsys.exit('bye')\n", r"my\.py:2 does not run: SystemExit: bye"),
        ("import no_such_module\n", r"my\.py:1 does not run: ModuleNotFoundError"),
        ("def height(place):\n    return 1.0\n", r"my\.py has no measure; put @measure"),
        (
            "from zwidth import measure\n@measure()\ndef isotropy(place):\n    return 1.0\n",
            r"the name isotropy is taken .* rename",
        ),
        (
            "from zwidth import measure\n@measure(better='more')\ndef mine(place):\n    return 1.0\n",
            r"my\.py:2 does not run: ValueError: a measure's better must be",
        ),
        (
            "from zwidth import measure\n@measure\ndef mine(place):\n    return 1.0\n",
            r"my\.py:2 does not run: ValueError: .* write @measure\(unit=\"kg\"\)",
        ),
        (
            "from zwidth import measure\n@measure(unit=3)\ndef mine(place):\n    return 1.0\n",
            r"my\.py:2 does not run: ValueError: a measure's unit must be a text of one line, got 3",
        ),
        (
            "from zwidth import measure\n@measure(title='a\\nb')\ndef mine(place):\n    return 1.0\n",
            r"a measure's title must be a text of one line, got 'a\\nb'",
        ),
    ],
)
def test_a_file_that_cannot_be_used(write, text, said):
    with pytest.raises(ValueError, match=said):
        load_measures(write(text))


def test_a_missing_file():
    with pytest.raises(ValueError, match=r"no such file: nowhere/my\.py"):
        load_measures("nowhere/my.py")


def test_the_nearest_name_may_be_a_user_s_own(write):
    own = load_measures(write(GOOD))
    assert find_measure("height", own).name == "height"
    assert find_measure("inertial_force_N", own).name == "inertial_force"
    with pytest.raises(ValueError, match="did you mean inertial_force"):
        find_measure("inertia_force", own)
    with pytest.raises(ValueError, match="no measure is named 'height'"):
        find_measure("height")


# --- the amplitude of a remaining vibration against what the hand feels ------------------------------


def test_a_linear_device_has_nothing_to_measure():
    with pytest.raises(MeasureError, match="give it dry friction, encoder steps or a largest force"):
        load("five-bar").at().measure("buzz", stiffness=100.0, damping=1.0)
    with pytest.raises(MeasureError, match="needs a wanted wall; give stiffness and damping"):
        limited(mass(0.1)).measure("buzz")


# --- the stiffest wall whose vibration decays as fast as wanted: against eigenvalues, over -----------


def test_a_missing_or_impossible_radius_is_refused():
    point = load("five-bar").at()
    with pytest.raises(MeasureError, match="give spectral_radius"):
        point.measure("stiffness_max_decaying")
    with pytest.raises(MeasureError, match=r"needs spectral_radius above 0 and at most 1, got 1\.5"):
        point.measure("stiffness_max_decaying", spectral_radius=1.5)
