"""Guarantees of a measured device beside those of the plant that the data are made of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests import systems
from tests.measured_handle_cases import COLLOCATED, RECIPROCAL, frequencies, measured_device
from zwidth.errors import ResponseError
from zwidth.guarantees import passive_region
from zwidth.loop import Controller, Loop, OperatingPoint
from zwidth.model import Plant

T = 0.00125
PLANT = systems.published().plant
GROUNDED = replace(PLANT, damping=PLANT.damping + np.diag([1.0, 0.5]))


@pytest.mark.parametrize(
    ("plant", "kind"),
    [(Plant.one_mass(0.05, 1.0), COLLOCATED), (GROUNDED, RECIPROCAL)],
    ids=["mass", "two masses"],
)
def test_passive_walls_are_those_of_the_plant(plant, kind):
    response = measured_device(plant, T, 0.4, kind, frequencies(T, 500, 3e-4))
    found = OperatingPoint(Controller(T), response=response).guarantees()
    exact = passive_region(Loop(plant, Controller(T, 0.4)))
    passive = found["passive"].region
    assert passive.stiffness_max == pytest.approx(exact.stiffness_max, rel=5e-4)
    assert "twice the" in passive.warning
    assert passive.stiffness_max <= exact.stiffness_max * (1.0 + 1e-6)
    K = np.array([0.3, 0.9, 1.05]) * exact.stiffness_max
    B = exact.damping_at_stiffness_max * np.ones(3)
    assert passive.contains(K, B).tolist() == exact.contains(K, B).tolist()
    assert "needs a model" in found["spring-stable"].region.reason
    assert found["stable"].region.stiffness_max > passive.stiffness_max


def test_a_dissipation_below_the_error_promises_nothing():
    rng = np.random.default_rng(5)
    response = measured_device(GROUNDED, T, 0.4, RECIPROCAL, frequencies(T, 200), 0.02, rng)
    region = OperatingPoint(Controller(T), response=response).guarantees()["passive"].region
    assert region.rings == ()
    assert "its error" in region.reason


def test_guarantees_need_the_handle():
    response = replace(measured_device(GROUNDED, T, 0.4, RECIPROCAL, frequencies(T, 100)), handle=None)
    with pytest.raises(ResponseError, match="no path"):
        OperatingPoint(Controller(T), response=response).guarantees()
