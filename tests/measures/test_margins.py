"""The stiffest wall with margins as a measure: many places, designs and devices of any kind."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from zwidth.errors import MeasureError
from zwidth.loop import Controller, OperatingPoint
from zwidth.measures import NO_VALUE, OK
from zwidth.study.designs.study import as_key

MARGINS = {"stiffness_margin": 0.2, "damping_margin": 0.3, "delay_margin": 0.5}


def test_places_together_are_the_places_alone_and_are_softer_than_the_stiffest():
    point = zwidth.load("five-bar").at([[0.0, 0.25], [0.05, 0.2], [0.9, 0.9]], (0.6, 0.8))
    found = point.measure("stiffness_max_with_margins", **MARGINS)
    assert found.status.tolist() == [OK, OK, 1]
    for n in range(2):
        alone = point[n].measure("stiffness_max_with_margins", **MARGINS)
        assert alone.values == pytest.approx(found.values[n], rel=1e-9)
    assert np.all(found.values[:2] < 0.5 * point.measure("stiffness_max").values[:2])


def test_each_wall_of_the_box_is_stable_at_each_delay():
    device = zwidth.load("five-bar")
    stiffness = float(device.at().measure("stiffness_max_with_margins", **MARGINS).values)
    late = device.with_({"loop.delay_samples": float(device.controller.delay) + 0.5})
    # the wall's damping is not given: somewhere along it the whole box is stable, softer by a hair
    walls = np.geomspace(stiffness / 1.2, stiffness * 1.2, 7) * (1.0 - 1e-3)
    dampings = np.geomspace(0.05, 60.0, 4000)
    stable = np.ones(len(dampings), dtype=bool)
    for each in (device, late):
        radius = each.at().check(walls[:, None, None], dampings[:, None] * [1.0 / 1.3, 1.0, 1.3]).spectral_radius
        stable &= (radius < 1.0).all(axis=(0, 2))
    assert stable.any()


def test_designs_with_margins_of_their_own_are_the_designs_alone():
    device = zwidth.load("published-two-mass")
    margins = [0.0, 0.3, 1.0]
    found = zwidth.sweep(
        device,
        {"delay_margin_samples": margins, "plant.mass_kg.1.1": [0.02, 0.03]},
        ["stiffness_max_with_margins"],
        stiffness_margin=0.2,
        damping_margin=0.3,
    )["stiffness_max_with_margins"].values
    for i, margin in enumerate(margins):
        for j, mass in enumerate((0.02, 0.03)):
            point = device.with_({"plant.mass_kg.1.1": mass}).at()
            alone = point.measure("stiffness_max_with_margins", **{**MARGINS, "delay_margin": margin})
            assert found[i, j] == pytest.approx(float(alone.values), rel=1e-9)


def test_a_device_without_stable_walls_has_no_value():
    # a vibration between a quarter and three quarters of the sampling frequency, undamped (thesis 4.43)
    still = np.ones(1)
    sprung = zwidth.Plant(np.array([[0.0254]]), np.zeros((1, 1)), np.array([[15620.0]]), still, still)
    point = OperatingPoint(Controller(0.004), given_plant=sprung)
    found = point.measure("stiffness_max_with_margins", **MARGINS)
    assert found.status == NO_VALUE
    assert found.notes[0].reason.endswith(" these margins")


def test_missing_margins_are_named_as_arguments_and_as_keys():
    said = r"give stiffness_margin and damping_margin and delay_margin$"
    with pytest.raises(MeasureError, match=said) as caught:
        zwidth.load("five-bar").at().measure("stiffness_max_with_margins", stiffness_margin=0.1)
    assert caught.value.spelled(as_key).endswith("and damping_margin and delay_margin_samples")
