"""What the hand feels at many places and designs at once: each as alone, by the impedance of one loop."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize

import zwidth
from tests.systems import random_plant
from zwidth.chart import largest_stiffness
from zwidth.errors import MeasureError
from zwidth.loop import Butterworth, Controller, FirstOrder, Loop, OperatingPoint
from zwidth.measures import NO_VALUE, OK, felt_impedance, free_motion_impedance
from zwidth.measures.handle_motion import HandleMotion
from zwidth.model import Plant

AT = [[0.0, 0.25], [0.08, 0.2], [-0.1, 0.15], [0.9, 0.9]]
WALL = {"stiffness": 1500.0, "damping": 6.0, "frequency": 8.0}
BAND = {"lowest_frequency": 1.0, "highest_frequency": 60.0, "spectral_radius": 0.995}
SETTINGS = (
    {},
    {"loop.delay_samples": 0.4},
    {"loop.actuator.time_constant_s": 0.0005},
    {"loop.velocity.method": "windowed-difference", "loop.velocity.samples": 3},
    {"loop.encoder.at": "link"},
)


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
@pytest.mark.parametrize("model", ["full", "two-mass", "rigid"])
def test_places_together_are_the_places_alone(settings, model):
    device = zwidth.load("five-bar", settings)
    if model != "full" and "loop.encoder.at" in settings:
        return
    points = device.at(AT, (0.6, 0.8), model=model)
    for name, wanted in (
        ("felt_stiffness", WALL), ("free_motion_force", {"frequency": 8.0}), ("impedance_ratio", BAND)
    ):  # fmt: skip
        together = points.measure(name, **wanted)
        assert together.status.tolist()[3] == 1
        for n in range(3):
            alone = device.at(AT[n], (0.6, 0.8), model=model).measure(name, **wanted)
            assert alone.status == together.status[n]
            if alone.status == OK:
                rel = 1e-5 if name == "impedance_ratio" else 1e-9
                assert float(alone.values) == pytest.approx(together.values[n], rel=rel)


def compliance_of(loop, K, B, frequency):
    """Motion per force by the impedances of one loop."""
    s = 2j * np.pi * frequency
    return 1.0 / (s * free_motion_impedance(loop.plant, frequency)), 1.0 / (
        s * felt_impedance(loop, K, B, frequency)
    )


def test_random_plants_with_a_handle_move_as_one_alone_does():
    rng = np.random.default_rng(14)
    compared = 0
    for _ in range(60):
        rate = 10.0 ** rng.uniform(2.3, 4.3)
        plant = random_plant(rng, rate, kind=str(rng.choice(("chain", "dense", "coupled"))))
        low_pass = (None, Butterworth(2, 0.2 * rate), FirstOrder(0.7 / rate))[int(rng.integers(3))]
        controller = Controller(
            1.0 / rate, float(rng.choice([0.0, 0.3, 1.0, 1.7])), force_filter=low_pass,
            actuator_time_constant=float(rng.choice([0.0, 0.5 / rate])),
        )  # fmt: skip
        handle = np.eye(plant.size)[0]
        masses = plant.mass * np.array([1.0, 1.1])[:, None, None]
        pair = Plant(masses, plant.damping, plant.stiffness, plant.actuator, plant.sensor, handle)
        motion = HandleMotion.of(OperatingPoint(controller, given_plant=pair))
        frequency = np.sort(rng.uniform(0.01, 0.49, (2, 3)) * rate, axis=1)
        if motion is None or not motion.known.all():
            continue
        K, B = np.full(2, 100.0), np.full(2, 0.1)
        free, held = motion.compliances(np.arange(2), frequency, K, B)
        for n in range(2):
            one = Plant(masses[n], plant.damping, plant.stiffness, plant.actuator, plant.sensor, handle)
            own = compliance_of(Loop(one, controller), 100.0, 0.1, frequency[n])
            np.testing.assert_allclose(free[n], own[0], rtol=1e-7)
            np.testing.assert_allclose(held[n], own[1], rtol=1e-6)
        compared += 1
    assert compared > 40


def test_the_ratio_is_the_least_over_a_fine_grid_of_the_band():
    for settings, radius in (({}, 0.995), ({"mechanism.damping.mode_ratio": 0.004}, 0.9995)):
        device = zwidth.load("five-bar", settings)
        points = device.at(AT[:3], (0.6, 0.8))
        found = points.measure(
            "impedance_ratio", lowest_frequency=1.0, highest_frequency=200.0, spectral_radius=radius
        )
        for n in range(3):
            loop = points[n].loop
            peak = largest_stiffness(loop, radius)

            def ratio(f, loop=loop, peak=peak):
                held = felt_impedance(loop, peak.stiffness, peak.damping, f)
                return np.abs(held / free_motion_impedance(loop.plant, f))

            f = np.geomspace(1.0, 200.0, 20001)
            at = int(ratio(f).argmin())
            ends = f[max(at - 1, 0)], f[min(at + 1, len(f) - 1)]
            closer = scipy.optimize.minimize_scalar(ratio, bounds=ends, method="bounded", options={"xatol": 1e-9})
            assert found.values[n] == pytest.approx(min(closer.fun, ratio(f).min()), rel=1e-4)


def test_a_rigid_mass_s_ratio_is_that_of_its_wall_to_its_mass_at_low_frequency():
    # far below the sampling frequency and the wall's own, Z is K/(jw) + B less the mass, over jw m
    one, none = np.ones(1), np.zeros((1, 1))
    point = OperatingPoint(Controller(0.001), given_plant=Plant(np.array([[0.2]]), none, none, one, one, one))
    found = point.measure("impedance_ratio", lowest_frequency=0.1, highest_frequency=1.0, spectral_radius=0.9)
    peak = largest_stiffness(point.loop, 0.9)
    w = 2.0 * np.pi
    expected = abs(peak.stiffness + 1j * w * peak.damping - 0.2 * w**2) / (0.2 * w**2)
    assert float(found.values) == pytest.approx(expected, rel=1e-3)


def test_an_operator_decides_stability_and_is_not_felt():
    device = zwidth.load("five-bar")
    held = device.at(AT[:2], (0.6, 0.8), operator="thesis-arm")
    bare = device.at(AT[:2], (0.6, 0.8))
    # a wall that is stable either way is felt alike
    np.testing.assert_allclose(
        held.measure("felt_stiffness", **WALL).values, bare.measure("felt_stiffness", **WALL).values, rtol=1e-9
    )


def test_unstable_walls_and_frequencies_too_high_are_said_for_each_place():
    points = zwidth.load("five-bar").at(AT[:3])
    unstable = points.measure("felt_stiffness", stiffness=1e5, damping=1.0, frequency=5.0)
    assert unstable.status.tolist() == [NO_VALUE] * 3
    assert unstable.notes[0].reason.count(" is unstable ") == 1
    with pytest.raises(MeasureError, match="frequency, 400 Hz, got 400 Hz"):
        points.measure("felt_stiffness", stiffness=100.0, damping=1.0, frequency=400.0)


def test_designs_with_walls_and_frequencies_of_their_own_are_the_designs_alone():
    device = zwidth.load("five-bar")
    frequencies, lengths = [2.0, 20.0, 900.0], [0.14, 0.15]
    found = zwidth.sweep(
        device, {"frequency_Hz": frequencies, "links.upper-right.length_m": lengths}, ["felt_stiffness"],
        stiffness=1500.0, damping=6.0,
    )  # fmt: skip
    for i, frequency in enumerate(frequencies):
        for j, length in enumerate(lengths):
            value, status = (found[name].values[i, j] for name in ("felt_stiffness", "felt_stiffness_status"))
            if frequency > 400.0:
                assert status == NO_VALUE
                continue
            point = device.with_({"links.upper-right.length_m": length}).at()
            alone = point.measure("felt_stiffness", stiffness=1500.0, damping=6.0, frequency=frequency)
            assert value == pytest.approx(float(alone.values), rel=1e-9)


def test_no_wall_of_the_wanted_radius_is_no_value():
    found = zwidth.load("five-bar").at(AT[:2]).measure("impedance_ratio", **{**BAND, "spectral_radius": 0.3})
    assert found.status.tolist() == [NO_VALUE, NO_VALUE]
    assert "spectral radius" in found.notes[0].reason
