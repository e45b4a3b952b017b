"""Motions along the surface under gravity alone, of which the computer does not know: by the plant's own poles."""

from __future__ import annotations

import tomllib
import warnings

import numpy as np
import pytest

import zwidth
from zwidth.device import new_device


def poles_of(plant):
    """Poles of the motions that stand apart [1/s], by their own first-order form."""
    n = plant.size
    inverse = np.linalg.inv(plant.mass)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ plant.stiffness, -inverse @ plant.damping]])
    return np.linalg.eigvals(A)


@pytest.mark.parametrize("gravity", [-9.81, 9.81])
def test_two_ways_along_a_surface_are_two_motions(gravity):
    """A delta that hangs sways alike along both, one that stands falls over alike along both."""
    loop = zwidth.load("stamper-delta").at(gravity=(0.0, 0.0, gravity)).loop
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = loop.sideways_motions
    assert len(found) == 2
    fastest = poles_of(loop.plant.apart).real.max()
    assert [motion.growth_rate for motion in found] == pytest.approx([fastest, fastest], rel=1e-6)
    assert (fastest > 0.0) == (gravity > 0.0)


def test_gravity_across_a_plane_leaves_its_motions_neutral():
    """And a vibration of the drives that no wall moves is none of them."""
    planar = zwidth.from_document(tomllib.loads(new_device("a template", "five-bar")))
    (motion,) = planar.at(gravity=(0.0, 0.0, -9.81)).loop.sideways_motions
    assert (motion.growth_rate, motion.frequency) == (0.0, 0.0)
