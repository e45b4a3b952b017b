"""The five-bar by the thesis's Appendix B, written out in the gallery, against the general engine.

Here each centre of mass lies beside its link's axis and the central inertia is any, not a slender rod's.
"""

import numpy as np
import pytest

from tests.lazy_module import LazyModule
from tests.model.model_cases import random_five_bar, two_bar_angles
from zwidth.model import OK, inertia_terms, solve_posture

appendix_b = LazyModule("gallery.appendix_b")

RELATIVE = 1e-9
SIDES = {"outward": (1, -1), "inward": (-1, 1), "right": (1, 1), "left": (-1, -1)}


def close(ours, theirs):
    return np.max(np.abs(ours - theirs)) <= RELATIVE * np.max(np.abs(theirs))


@pytest.mark.parametrize("seed", range(25))
def test_appendix_b(seed):
    rng = np.random.default_rng(seed)
    mechanism = random_five_bar(rng)
    assembly = ("outward", "inward")[seed % 2]
    posture = solve_posture(
        mechanism, mechanism.reference_position[:2] + rng.uniform(-0.015, 0.015, (8, 2)), assembly
    )
    assert (posture.status == OK).all()
    assert np.max(posture.closure_residual) < 1e-14
    rates = rng.uniform(-5, 5, (8, 2))
    terms = inertia_terms(mechanism, posture, rates)
    L1, L2, L3, L4 = mechanism.links.tip[:, 0]
    half = mechanism.links.origin[0, 0]
    for k in range(8):
        one, two = SIDES[assembly]
        at = posture.position[k]
        q = np.concatenate([two_bar_angles(L1, L2, half, at, one), two_bar_angles(L3, L4, -half, at, two)])
        assert posture.angles[k] == pytest.approx(q, abs=1e-11)
        judge = appendix_b.AppendixB(mechanism, q)
        B = judge.transformation()
        assert close(posture.mass_matrix[k], B.T @ judge.mass() @ B)
        assert close(posture.jacobian[k][:2], judge.chain_jacobian(0) @ B[:2])
        assert close(posture.jacobian[k][:2], judge.chain_jacobian(2) @ B[2:])
        assert close(posture.jacobian[k][:2], judge.jacobian())
        assert np.all(posture.jacobian[k][2] == 0)
        assert close(terms[k], judge.nonlinear(rates[k]))
