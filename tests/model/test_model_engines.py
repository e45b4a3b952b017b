"""Mass matrix, Jacobians and nonlinear terms against two multibody engines: random postures and parameters."""

import numpy as np
import pytest

from tests.model.model_cases import KINDS, some_postures
from tests.model.model_engines import ask_mujoco, ask_pinocchio
from tests.model.random_mechanisms import random_mechanisms
from zwidth.model import OK, ORIENTATION, POSITION, inertia_terms, rotation_matrix, solve_posture

RELATIVE = 1e-9


def close(ours, theirs, scale=0.0):
    """Alike to nine digits of the largest number, or of a scale where all of them may be 0."""
    return np.max(np.abs(ours - theirs)) <= RELATIVE * max(np.max(np.abs(theirs)), scale)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_mujoco_agrees(kind, seed):
    rng = np.random.default_rng(seed)
    mechanism = KINDS[kind](rng)
    postures = some_postures(mechanism, rng)
    assert (postures.status == OK).all()
    for k in range(len(postures.status)):
        M, J, angular = ask_mujoco(mechanism, postures.angles[k])
        assert close(postures.mass_matrix[k], M)
        assert close(postures.jacobian[k], J)
        assert close(postures.angular_jacobian[k], angular)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_pinocchio_agrees(kind, seed):
    rng = np.random.default_rng(seed)
    mechanism = KINDS[kind](rng)
    postures = some_postures(mechanism, rng)
    rates = rng.uniform(-3, 3, postures.jacobian.shape[:1] + postures.jacobian.shape[2:])
    terms = inertia_terms(mechanism, postures, rates)
    for k in range(len(postures.status)):
        M, J, angular, c = ask_pinocchio(mechanism, postures.angles[k], rates[k])
        assert close(postures.mass_matrix[k], M)
        assert close(postures.jacobian[k], J)
        assert close(postures.angular_jacobian[k], angular)
        assert close(terms[k], c)


def moved_handle(mechanism, here, rng):
    """A place near a posture that the drives can take the handle to, in first order."""
    rates = rng.uniform(-0.02, 0.02, here.jacobian.shape[-1])
    rates[len(mechanism.drives.joint) :] = 0.0
    position, turn = here.position + here.jacobian @ rates, rotation_matrix(here.angular_jacobian @ rates)
    if mechanism.controls == POSITION:
        return position, None
    return (None if mechanism.controls == ORIENTATION else position), turn @ here.rotation


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 6))])
@pytest.mark.parametrize(("joints", "loops"), [(6, 0), (7, 1), (9, 2)])
def test_every_joint_and_every_closing(seed, joints, loops):
    """Random trees and loops of revolute, prismatic, universal, ball and fixed joints, closed by points, axes and
    frames, with free joints: both engines, at the posture they are built in and in one nearby."""
    rng = np.random.default_rng(100 + seed)
    for mechanism in random_mechanisms(seed, 4, joints, loops):
        here = solve_posture(mechanism)
        position, orientation = moved_handle(mechanism, here, rng)
        near = solve_posture(mechanism, position, orientation=orientation, tolerance=0.2)
        for posture in (here, near):
            rates = rng.uniform(-3, 3, posture.jacobian.shape[-1])
            M, J, angular = ask_mujoco(mechanism, posture.angles)
            again = ask_pinocchio(mechanism, posture.angles, rates)
            for mass, linear, turning in ((M, J, angular), again[:3]):
                assert close(posture.mass_matrix, mass)
                assert close(posture.jacobian, linear, 1e-3)
                assert close(posture.angular_jacobian, turning, 1e-2)
            assert close(inertia_terms(mechanism, posture, rates), again[3], np.max(np.abs(M)))
