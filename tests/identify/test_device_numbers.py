"""Numbers of a device file as a vector."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from zwidth.errors import DeviceError
from zwidth.identify.boundary.parameters import DeviceNumbers

PATHS = ["plant.mass_kg.0.0", "plant.damping_Ns_per_m.0.1", "loop.delay_samples"]


@pytest.fixture(scope="module")
def device():
    return zwidth.load("published-two-mass", {"loop.delay_samples": "unset"})


def test_positive_numbers_vary_by_their_logarithm_and_others_as_they_are(device):
    numbers = DeviceNumbers.of(device, PATHS)
    assert numbers.positive.tolist() == [True, False, False]
    vector = numbers.vector(numbers.start)
    np.testing.assert_allclose(numbers.values(vector), numbers.start, rtol=1e-15)
    assert vector[0] == pytest.approx(np.log(0.2616))


def test_a_delay_that_the_file_leaves_out_begins_at_none(device):
    numbers = DeviceNumbers.of(device, PATHS)
    assert numbers.start[2] == 0.0
    changed = numbers.device_with(numbers.vector(numbers.start) + np.array([np.log(2.0), 0.0, 0.5]))
    assert changed.controller.delay == 0.5
    assert changed.document["plant"]["mass_kg"][0][0] == pytest.approx(2.0 * 0.2616)


def test_a_number_that_cannot_be_zero_must_be_given():
    five_bar = zwidth.load("five-bar", {"drives.motor-right.stiffness_Nm_per_rad": "unset"})
    with pytest.raises(DeviceError, match="value first"):
        DeviceNumbers.of(five_bar, ["drives.motor-right.stiffness_Nm_per_rad"])
