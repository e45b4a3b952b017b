"""What is said of models, loops, operators and postures that cannot be meant."""

from __future__ import annotations

from dataclasses import replace
from math import inf, log

import numpy as np
import pytest

from tests.device.device_cases import faults
from tests.loop import test_operating_point
from tests.loop.test_estimators_nonlinear import T
from tests.loop.test_fixed_feedback import T as FEEDBACK_T
from tests.loop.test_held_response import HAND, PLANT
from tests.loop.test_held_response import T as HELD_RESPONSE_T
from tests.measured_handle_cases import EVERY, measured_device
from tests.model.model_cases import drives_on, five_bar, spatial_arm
from tests.model.test_arm import arm, device
from tests.model.test_flexible_body import L
from tests.model.test_model_moments import WRIST, paddle
from tests.model.test_model_posture import arm_on_a_four_bar
from tests.model.test_model_reduction import PUBLISHED, single
from tests.systems import mass, published, two_mass
from zwidth.device import from_document
from zwidth.errors import DeviceError, ModelError, OperatorError, ResponseError
from zwidth.loop import (
    AlphaBeta,
    Butterworth,
    Controller,
    Feedforward,
    Foaw,
    ForceSensor,
    Kalman,
    LeastSquaresSlope,
    Levant,
    LocalLoop,
    Loop,
    SavitzkyGolay,
    SidewaysMotion,
    WindowedDifference,
    velocity_of,
)
from zwidth.loop.measured.held_response import held_response
from zwidth.model import (
    BeamProperties,
    MeasuredHandle,
    Operator,
    assumed_modes,
    attach,
    finite_elements,
    lumped_tip,
    reduce_plant,
    solve_posture,
)
from zwidth.model.beam_section import (
    CrossSection,
    Material,
    rectangle,
    rectangular_tube,
    round_rod,
    tube,
    typical_material,
)

# --- the operator's arm as a chain: by closed forms, by a mechanism that holds it as a loop ----------


@pytest.mark.parametrize(
    ("changes", "key", "text"),
    [
        ({"grasp_stiffness_N_per_m": 100.0}, "arm.grasp", "only one way"),
        ({"grasp": None}, "arm", "does not say how"),
        ({"hand": {"link": "leg"}}, "arm.hand.link", "no link of the arm"),
        ({"posture": {"joints_rad": {"humerus": 2.0}}}, "arm.posture", "forearm"),
    ],
)
def test_faults_of_an_arm_are_named(changes, key, text):
    table = {k: v for k, v in (arm() | changes).items() if v is not None}
    with pytest.raises(DeviceError) as caught:
        device(arm=table)
    assert any(key in str(fault) and text in str(fault) for fault in caught.value.faults), caught.value.faults


def test_an_arm_that_cannot_hold_the_handle_says_so():
    with pytest.raises(OperatorError, match="does not reach"):
        device(arm=arm(shoulder_m=[2.0, 0.0, 0.0])).at().plant  # noqa: B018
    stretched = arm(posture={"joints_rad": {"humerus": 0.3, "forearm": 0.0}})
    del stretched["shoulder_m"]
    with pytest.raises(OperatorError, match="stretched"):
        device(arm=stretched).at().plant  # noqa: B018
    with pytest.raises(DeviceError, match="only one of them"):
        device(arm=arm(), operator={"arm_mass_kg": 1.0, "grasp": "rigid"})


# --- sections against closed forms and a stress function, and what is refused in which words ---------


NUMBERS = (0.2, 1.0, 2.0, 3.0, 4.0, 0.5, 0.1)


def with_number(place, value):
    return tuple(value if i == place else number for i, number in enumerate(NUMBERS))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: CrossSection(0.0, 1.0, 1.0, 1.0),
            "area must be .* greater than 0 .*, got 0; a beam needs a section",
        ),
        (lambda: CrossSection(1.0, 1.0, -1.0, 1.0), "second_moment_z must be .* got -1"),
        (lambda: round_rod(0.0), r"diameter must be a finite number greater than 0 \[m\], got 0"),
        (lambda: round_rod(float("nan")), "diameter must be .* got nan"),
        (lambda: round_rod("10 mm"), "diameter must be .* got the text '10 mm'"),
        (lambda: tube(0.01, 0.0), "wall must be a finite number greater than 0"),
        (
            lambda: tube(0.01, 0.006),
            r"wall must be at most half of outer_diameter, 0.005 \[m\], got 0.006; write round_rod\(0.01\)",
        ),
        (
            lambda: rectangular_tube(0.02, 0.01, 0.0051),
            r"at most half of height, 0.005 \[m\], got 0.0051; write rectangle\(0.02, 0.01\)",
        ),
        (lambda: rectangular_tube(0.01, 0.02, 0.0051), "at most half of width"),
        (lambda: rectangle(-0.01, 0.02), "width must be .* got -0.01"),
        (lambda: Material(1e11, float("inf"), 1000.0), "shear_modulus must be a finite number"),
        (lambda: BeamProperties(*with_number(0, 0.0)), "length must be .* got 0; leave the link rigid"),
        (lambda: BeamProperties(*with_number(0, -0.2)), "length must be .* got -0.2"),
        (lambda: BeamProperties(*with_number(2, float("nan"))), "EI_z must be .* got nan"),
        (lambda: BeamProperties(*with_number(4, float("inf"))), "EA must be a finite .* give a large number"),
        (lambda: BeamProperties(*with_number(5, 0.0)), "mass_per_length must be .* got 0"),
        (lambda: BeamProperties(*with_number(6, 0.0)), "torsional_inertia_per_length must be"),
        (
            lambda: typical_material("unobtainium"),
            "material must be 'aluminium-6061' or .* got the text 'unobtainium'",
        ),
    ],
)
def test_what_no_beam_has_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# --- flexible bodies against a nonlinear rod, and what follows from their second order ---------------


BEAM = BeamProperties(L, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: finite_elements(BEAM, [0.1, 0.5], 4), r"stations must lie on the beam, .* 0.4 \[m\], got 0.5"),
        (lambda: assumed_modes(BEAM, [-0.1], 4), "stations must lie on the beam, .* got -0.1"),
        (lambda: lumped_tip(BEAM, [float("nan")]), "stations must lie on the beam, .* got nan"),
        (lambda: lumped_tip(BEAM, 0.4), r"stations must be a list of numbers \[m\], got the shape \(\)"),
        (lambda: lumped_tip(BEAM, "tip"), r"stations must be numbers \[m\], got the text 'tip'"),
        (lambda: finite_elements(BEAM, [L], 0), "elements must be a whole number, at least 1, got 0"),
        (lambda: finite_elements(BEAM, [L], 2.5), "elements must be a whole number, at least 1, got 2.5"),
        (lambda: finite_elements(BEAM, [L], 2, -1), "modes must be a whole number, at least 0, got -1"),
        (lambda: finite_elements(BEAM, [L], 1, 3), "must be at most 2 modes, .* got 3; give more elements"),
        (lambda: assumed_modes(BEAM, [L], True), "modes must be a whole number, at least 0, got True"),
        (lambda: assumed_modes(BEAM, [L], 2, "free"), "boundary must be 'clamped' or .* got the text 'free'"),
        (lambda: lumped_tip(BEAM, [L]).reduced(np.eye(3)), r"basis must have 4 rows, .* got the shape \(3, 3\)"),
        (
            lambda: lumped_tip(BEAM, [L]).scaled([1.0, 1.0, 0.0, 1.0]),
            "scale must be 4 finite numbers greater than 0",
        ),
    ],
)
def test_what_no_body_can_be_made_of_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


# --- from mechanisms and plants to the rendered direction: against formulas written out with ---------


@pytest.mark.parametrize(
    ("plant", "model", "words"),
    [
        (single(), "two-mass", "no handle"),
        (replace(single(), handle=np.ones(1)), "two-mass", "nothing flexible"),
        (single(100.0), "rigid", "ties it to the ground"),
        (replace(PUBLISHED, handle=None), "motor-mass", "no handle"),
        (replace(PUBLISHED, handle=np.array([2.0, 0.0])), "two-mass", "do not move together"),
        (replace(PUBLISHED, handle=PUBLISHED.actuator), "two-mass", "nothing flexible"),
    ],
)
def test_what_a_plant_cannot_be_reduced_to(plant, model, words):
    with pytest.raises(ModelError, match=words):
        reduce_plant(plant, model)


# --- moments about an axis, and screws: the same plants in other units, and wrists whose -------------


def test_what_cannot_be_meant_is_refused_in_a_sentence():
    device, wrist = paddle(0.08), from_document(WRIST)
    from zwidth.errors import DeviceError

    for case, sentence in (
        ({"axis": [0, 0, 0]}, "has zero length"),
        ({"axis": [0, 0, 1], "characteristic_length": 0.1}, "leave it out"),
        ({"direction": [0, 1], "axis": [0, 0, 1]}, "must be a positive length"),
        ({"characteristic_length": 0.1}, "leave it out"),
        ({"orientation": [0, 0, 1]}, "control the position of its handle alone"),
        ({"directions": [[0, 1]], "axis": [0, 0, 1]}, "beside an axis"),
    ):
        with pytest.raises(DeviceError, match=sentence):
            device.at(**case)
    for orientation, sentence in (
        ([0, 0, 90], "degrees"),
        ("up", "roll, pitch, yaw"),
        (np.ones((3, 3)), "right angles"),
    ):
        with pytest.raises(DeviceError, match=sentence):
            wrist.at(orientation=orientation)
    missing = {**WRIST, "mechanism": {**WRIST["mechanism"], "reference": {}}}
    assert "an axis for moments" in faults(missing)[0].message


# --- postures: reached or not, on which side of the singularities, alone and in batches --------------


def test_drives_must_fit_the_freedom():
    mechanism = five_bar()
    with pytest.raises(ValueError, match="2 degrees of freedom but 1 drives"):
        solve_posture(replace(mechanism, drives=drives_on([0])), (0, 0.25))
    with pytest.raises(ValueError, match="do not determine the other joints; drive other joints"):
        solve_posture(arm_on_a_four_bar(), (0.1, 0.1))
    arm = spatial_arm(np.random.default_rng(0))
    with pytest.raises(ValueError, match="can rest while the drives move"):
        solve_posture(replace(arm, handle_link=1, handle_point=np.zeros(3)), (0, 0, 0.1))


# --- adaptive windows and Levant's differentiator against formulas written out, and against ----------


@pytest.mark.parametrize(
    ("make", "values", "said"),
    [
        (Foaw, (0, 1e-6), "samples must be from 1 to 100, got 0"),
        (Foaw, (101, 1e-6), "samples must be from 1 to 100, got 101: the longest window, in periods"),
        (Foaw, (2.5, 1e-6), "samples must be a whole number, got 2.5"),
        (Foaw, (5, 0.0), "position_noise must be positive and finite, got 0.0 m"),
        (Foaw, (5, np.nan), "position_noise must be positive and finite, got nan m"),
        (Foaw, (5, 1e-6, "mid-fit"), "fit must be 'end-fit' or 'best-fit', got 'mid-fit'"),
        (Foaw.of_encoder, (5, -1.0), "the encoder's resolution must be positive and finite, got -1.0 m"),
        (Levant, (0.0,), "acceleration_max must be positive and finite, got 0.0 m/s²"),
        (Levant, (np.inf,), "acceleration_max must be positive and finite, got inf m/s²"),
        (velocity_of, (Levant(1.0), [0.0], 0.0), "the sampling period must be positive and finite, got 0.0 s"),
        (velocity_of, (Levant(1.0), 3.0, T), "positions must be a series"),
        (velocity_of, (Levant(1.0), [0.0, np.nan], T), "must be finite, got nan at \\[1\\]"),
    ],
)
def test_a_bad_parameter_is_named_with_what_is_allowed(make, values, said):
    with pytest.raises(ValueError, match=said):
        make(*values)


# --- what the parameters of velocity estimators may be, and what is said of others -------------------


REFUSED = [
    (WindowedDifference, (0,), "samples must be from 1 to 1000, got 0"),
    (WindowedDifference, (1001,), "got 1001: the estimate is late by half the window"),
    (WindowedDifference, (2.0,), "samples must be a whole number, got 2.0"),
    (WindowedDifference, (True,), "samples must be a whole number, got True"),
    (LeastSquaresSlope, (1,), "samples must be from 2 to 1000, got 1: a line takes two positions"),
    (SavitzkyGolay, (5, 0), "order must be from 1 to 10, got 0: degree 0 has no slope"),
    (SavitzkyGolay, (50, 11), "order must be from 1 to 10, got 11"),
    (SavitzkyGolay, (5, 5), "samples must be from 6 to 1000, got 5: a polynomial of order 5 takes 6 positions"),
    (SavitzkyGolay, (5, "2"), "order must be a whole number, got '2'"),
    (AlphaBeta, (0.0, 0.1), "alpha must be positive and finite, got 0.0"),
    (AlphaBeta, (0.5, -0.1), "beta must be positive and finite, got -0.1"),
    (AlphaBeta, (np.nan, 0.1), "alpha must be positive and finite"),
    (AlphaBeta, (1.5, 1.0), "2 alpha \\+ beta must be below 4, got 4 from alpha = 1.5 and beta = 1.0"),
    (AlphaBeta, (2.5, 0.1), "else the filter is unstable"),
    (AlphaBeta, (0.5, 1e-4), "the filter would remember for too long"),
    (AlphaBeta, (1e-4, 1e-3), "the filter would remember for too long"),
    (Kalman, (0.0, 1e-6), "acceleration_noise must be positive and finite, got 0.0 m/s²"),
    (Kalman, (1.0, np.inf), "position_noise must be positive and finite, got inf m"),
    (Kalman.of_encoder, (1.0, 0.0), "the encoder's resolution must be positive and finite, got 0.0 m"),
]


@pytest.mark.parametrize(("make", "values", "said"), REFUSED)
def test_a_bad_parameter_of_a_linear_estimator_is_named_with_what_is_allowed(make, values, said):
    with pytest.raises(ValueError, match=said):
        make(*values)


@pytest.mark.parametrize(
    ("method", "said"),
    [(Kalman(1e-3, 1e-3), "too little motion"), (Kalman(1e9, 1e-9), "too much motion")],
)
def test_a_kalman_filter_that_is_none_at_this_rate_is_refused(method, said):
    for ask in (method.estimator, method.delay, method.noise_gain, method.alpha_beta):
        with pytest.raises(ValueError, match=f"must be from 3e-06 to 1e\\+08, got .*{said}"):
            ask(0.001)


# --- force sensor, feedforward and local loop closed round the sampled plant, against a period -------


FIRM = Operator(0.8, 580.0, 5.5)


def test_a_force_sensor_needs_a_handle_and_what_it_carries_a_device():
    bare = replace(two_mass(0.26, 0.025, 15620.0), handle=None)
    with pytest.raises(ModelError, match="sits at the handle"):
        _ = Loop(bare, Controller(FEEDBACK_T, force_sensor=ForceSensor(0.5))).sections
    with pytest.raises(ModelError, match=r"mass_beyond is 0.3 kg, and must be less than .* 0.2616 kg"):
        _ = published(force_sensor=ForceSensor(0.5, mass_beyond=0.3)).sections
    # the arm of a rigid grasp is no part of the device
    held = attach(mass(0.3), FIRM)
    with pytest.raises(ModelError, match=r"0.3 kg, of which"):
        _ = Loop(held, Controller(FEEDBACK_T, force_sensor=ForceSensor(0.5, mass_beyond=0.5))).sections


WRONG = [
    (lambda: ForceSensor(-1.0), "gain must be a finite number greater than -1"),
    (lambda: ForceSensor(0.5, delay=0.5), "delay must be a whole number from 0 to 100, got 0.5"),
    (lambda: ForceSensor(0.5, law="pid"), "law"),
    (lambda: ForceSensor(0.5, filter=3.0), "filter must be a FirstOrder"),
    (lambda: Feedforward(-0.1), "inertia must be a finite number, at least 0"),
    (lambda: Feedforward(0.1, inertia_share=0.5), "exclude each other"),
    (lambda: Feedforward(0.1, velocity=Foaw(4, 1e-5)), "a linear estimate"),
    (lambda: LocalLoop(0), "rate_multiple must be a whole number from 1 to 200, got 0"),
    (lambda: LocalLoop(2.0), "rate_multiple must be a whole number"),
    (lambda: Controller(FEEDBACK_T, feedforward=LocalLoop(2)), "feedforward must be a Feedforward or None"),
    (
        lambda: Controller(
            FEEDBACK_T, local_loop=LocalLoop(4, velocity_filter=Butterworth(2, 2000.0, "tustin-prewarped"))
        ),
        "local_loop.velocity_filter: cutoff_Hz must be below half the sampling frequency, 2000 Hz",
    ),
    (
        lambda: Loop(mass(0.3), Controller(FEEDBACK_T, feedforward=Feedforward(inertia_share=0.5))),
        "which a loop does not",
    ),
]


@pytest.mark.parametrize(("make", "sentence"), WRONG)
def test_numbers_out_of_range_are_refused_in_a_sentence(make, sentence):
    with pytest.raises((ValueError, TypeError), match=sentence.replace("(", r"\(").replace(")", r"\)")):
        make()


def test_a_loop_says_what_is_in_it():
    controller = Controller(
        FEEDBACK_T,
        force_sensor=ForceSensor(0.5, law="force-error"),
        feedforward=Feedforward(0.1, 0.5, coulomb=0.2),
        local_loop=LocalLoop(10, damping=2.0, velocity=AlphaBeta(0.5, 0.1)),
    )
    text = repr(Loop(two_mass(0.26, 0.025, 15620.0), controller))
    assert "with force feedback on the force error (gain 0.5)" in text
    assert "with feedforward, with a local loop at 10 times the rate" in text  # without units
    texts = controller.feedback_texts()
    assert "feedforward of 0.1 kg, 0.5 N s/m, 0.2 N of dry friction" in texts
    assert "a local loop at 10 times the rate (2 N s/m)" in texts
    about_an_axis = controller.feedback_texts(moments=True)
    assert "feedforward of 0.1 kg m², 0.5 N m s/rad, 0.2 N m of dry friction" in about_an_axis
    assert controller.wall_alone == Controller(FEEDBACK_T)


# --- operating points: what a question adds to a device, and the way from there to the plant ---------


point_device = test_operating_point.device


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"direction": (0.0, 0.0)}, "direction: has zero length"),
        ({"directions": [(1.0, 0.0), (0.0, 0.0)]}, "directions: has zero length"),
        ({"directions": (1.0, 0.0)}, "directions: must be a list of directions"),
        ({"direction": (1.0, 0.0), "directions": [(1.0, 0.0)]}, "are given beside a direction"),
        ({"position": [[0.0, np.nan]]}, "at: must be finite"),
        ({"position": {"nobody": 1.0}}, "at: must be the angle of every driven joint"),
        ({"assembly": "sideways"}, "assembly: 'sideways' is not an assembly"),
        ({"model": "soft"}, "model: must be one of full"),
        ({"operator": "nobody-known"}, "no such file|is no bundled|nobody-known"),
    ],
)
def test_what_cannot_be_meant_is_one_clear_error(point_device, arguments, words):
    with pytest.raises(DeviceError, match=words):
        point_device.at(**arguments)


# --- loops under load: the map from sample to sample against the nonlinear device and computer -------


def test_a_sideways_motion_in_words():
    grows, decays, still = SidewaysMotion(0.5, 0.0), SidewaysMotion(-2.0, 0.25), SidewaysMotion(0.0, 0.0)
    assert grows.time_to_double == pytest.approx(log(2.0) / 0.5)
    assert decays.time_to_double == still.time_to_double == inf
    assert grows.name == "sideways motion that grows by 0.5 1/s (doubles in 1.386 s)"
    assert decays.name == "sideways vibration at 0.25 Hz that decays by 2 1/s"
    assert still.name == "sideways motion (neutral)"
    assert grows.document() == {
        "growth_rate_1_per_s": 0.5,
        "time_to_double_s": grows.time_to_double,
        "frequency_Hz": 0.0,
    }
    assert decays.document()["time_to_double_s"] is None


# --- a measured device in an operator's hand, and what he feels of it, beside the model that ---------


def test_without_paths_of_the_handle_it_is_said_which_are_missing():
    bare = replace(measured_device(PLANT, HELD_RESPONSE_T, 0.0, EVERY), handle=None)
    with pytest.raises(ResponseError, match="no path from the handle's force to the encoder, from the command to"):
        held_response(bare, HAND, HELD_RESPONSE_T)
    half = replace(bare, handle=MeasuredHandle(actuator_at_sensor=True))
    with pytest.raises(
        ResponseError, match="to the encoder and from the handle's force to the handle; measure them"
    ):
        held_response(half, HAND, HELD_RESPONSE_T)
