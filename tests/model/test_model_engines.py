"""Mass matrix, Jacobian and nonlinear terms against two multibody engines: random postures and parameters."""

import numpy as np
import pytest
from model_cases import KINDS, some_postures
from model_engines import ask_mujoco, ask_pinocchio

from zwidth.model.posture import OK, inertia_terms

RELATIVE = 1e-9


def close(ours, theirs):
    return np.max(np.abs(ours - theirs)) <= RELATIVE * np.max(np.abs(theirs))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_mujoco_agrees(kind, seed):
    rng = np.random.default_rng(seed)
    mechanism = KINDS[kind](rng)
    postures = some_postures(mechanism, rng)
    assert (postures.status == OK).all()
    for k in range(len(postures.status)):
        M, J = ask_mujoco(mechanism, postures.angles[k])
        assert close(postures.mass_matrix[k], M)
        assert close(postures.jacobian[k], J)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_pinocchio_agrees(kind, seed):
    rng = np.random.default_rng(seed)
    mechanism = KINDS[kind](rng)
    postures = some_postures(mechanism, rng)
    rates = rng.uniform(-3, 3, postures.jacobian.shape[:1] + postures.jacobian.shape[2:])
    terms = inertia_terms(mechanism, postures, rates)
    for k in range(len(postures.status)):
        M, J, c = ask_pinocchio(mechanism, postures.angles[k], rates[k])
        assert close(postures.mass_matrix[k], M)
        assert close(postures.jacobian[k], J)
        assert close(terms[k], c)
