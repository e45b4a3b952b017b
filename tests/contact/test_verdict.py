"""What a run is called: at rest, dying away, growing, going round, bouncing, gone."""

import numpy as np
import pytest

from tests.contact.engine_cases import friction_of, one_mass, run, two_mass_loop
from zwidth.contact import Hand, dominant_frequency, judge_response
from zwidth.model import Counter, Nonlinear

MOTOR = np.array([0.0, 1.0])
FRICTION_AND_ENCODER = Nonlinear(friction=(friction_of(0.1),), counters=(Counter(MOTOR, 1e-5),))


def behaviour_of(response):
    judged = judge_response(response)
    return judged.behaviour, judged.stable


def test_linear_walls_die_away_or_grow():
    assert behaviour_of(run(two_mass_loop(), 4000.0, 10.0, 2.0, start_position=1e-3)) == ("decaying", True)
    assert behaviour_of(run(two_mass_loop(), 7500.0, 10.0, 2.0, start_position=1e-3)) == ("growing", False)
    assert behaviour_of(run(two_mass_loop(), 7500.0, 10.0, 2.0, start_position=1e-3, bound=0.1)) == (
        "growing",
        False,
    )


def test_growth_of_a_decay_is_known_in_closed_form():
    # a mass on a sampled spring without damping: rho^2 = det = 1 + K T^2/(2 m)
    m, K, T = 0.3, 50.0, 1e-3
    response = run(one_mass(m), K, 0.0, 20.0, start_position=1e-3)
    expected = 0.5 * np.log(1.0 + K * T * T / (2.0 * m))
    assert judge_response(response).growth == pytest.approx(expected, rel=0.02)


def test_friction_brings_it_to_rest_inside():
    response = run(
        two_mass_loop(FRICTION_AND_ENCODER), 3000.0, 8.0, 3.0, sided=1, start_position=-2e-3, hand=Hand(push=2.0)
    )
    judged = judge_response(response)
    assert (judged.behaviour, judged.stable) == ("converged", True)
    assert judged.contact == 1.0
    assert np.isnan(judged.frequency) or judged.amplitude < 1e-5


def test_a_limit_cycle_is_named_and_its_tone_is_right():
    # friction stops small motions, the force limit large ones, in between it goes round
    parts = Nonlinear(friction=(friction_of(0.05),), force_limit=3.0, counters=(Counter(MOTOR, 1e-4),))
    response = run(two_mass_loop(parts), 9000.0, 12.0, 6.0, start_position=1e-3)
    judged = judge_response(response)
    assert (judged.behaviour, judged.stable) == ("limit cycle", False)
    assert abs(judged.growth) < 1e-4
    assert judged.amplitude == pytest.approx(np.ptp(response.handle[3600:]) / 2.0, rel=0.01)
    late = response.truth[2400:] - response.truth[2400:].mean()
    ups = np.sum((late[:-1] < 0.0) & (late[1:] >= 0.0))
    assert judged.frequency == pytest.approx(ups / (len(late) * response.period), rel=0.03)


def test_undamped_bouncing_has_no_end():
    response = run(one_mass(0.3), 2000.0, -0.5, 4.0, sided=1, start_position=-1e-3, hand=Hand(push=1.0))
    assert behaviour_of(response) == ("bouncing", False)


def test_a_device_that_flies_off_has_lost_contact():
    response = run(one_mass(0.3), 1000.0, 1.0, 1.0, sided=1, start_position=1e-3)
    assert behaviour_of(response) == ("lost contact", False)


def test_too_few_samples_say_nothing():
    response = run(two_mass_loop(), 4000.0, 10.0, 0.01, start_position=1e-3)
    assert behaviour_of(response) == ("undecided", None)


@pytest.mark.parametrize("frequency", [3.7, 50.0, 123.456, 390.0])
def test_the_tone_of_a_steady_vibration(frequency):
    t = np.arange(800) * 0.00125
    signal = 1e-4 * np.sin(2.0 * np.pi * frequency * t + 1.0) + 0.02 + 0.01 * t
    assert dominant_frequency(signal, 0.00125) == pytest.approx(frequency, abs=0.02)


def test_the_tone_of_what_does_not_move_is_none():
    assert np.isnan(dominant_frequency(np.full(100, 3.0), 0.001))
    assert np.isnan(dominant_frequency(np.zeros(8), 0.001))


def test_verdicts_do_not_depend_on_the_unit_of_length():
    for scale in (1e-9, 1.0, 1e6):
        for (K, B), expected in (((4000.0, 10.0), "decaying"), ((7500.0, 10.0), "growing")):
            response = run(two_mass_loop(), K, B, 2.0, start_position=1e-3 * scale)
            assert judge_response(response).behaviour == expected
