"""Directions that a plant does not couple: each set of them has an equation of its own.

Under one law for several directions these can be turned into each other. Of a plant that has the same response
along two of them, all walls would be there twice, which no curve can be followed through; turned so that they are
not coupled, they are told apart, and equal ones are left out.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats, Ints
from zwidth.chart.several_directions.loop_features import on_circle
from zwidth.chart.several_directions.wall_equation import WallEquation
from zwidth.loop.multi_loop import MultiLoop

# Directions whose coupling is a smaller share of their own responses are not coupled.
UNCOUPLED: Final = 1e-11
# Angles at which responses are compared.
PROBES: Final = (0.03, 0.4, 1.1, 1.9, 2.7)


def wall_equations(loop: MultiLoop) -> list[WallEquation]:
    """The equations of the sets of directions that a plant couples, each different one once."""
    z, d = on_circle(np.array(PROBES))
    P = loop.plant_slope(z, d)[0]
    law = loop.principal
    S = _turned(P, law.stiffness, law.damping)
    P = S @ P @ S.T
    equations: list[WallEquation] = []
    known: list[Complexes] = []
    for part in _coupled_sets(P):
        stiffness, damping, own = law.stiffness[part], law.damping[part], P[:, part][:, :, part]
        if not any(
            np.array_equal(stiffness, other.stiffness)
            and np.array_equal(damping, other.damping)
            and np.abs(own - response).max() <= UNCOUPLED * np.abs(P).max()
            for other, response in zip(equations, known, strict=True)
        ):
            equations.append(WallEquation(loop, S[part], stiffness, damping))
            known.append(own)
    return equations


def _turned(P: Complexes, stiffness: Floats, damping: Floats) -> Floats:
    """Directions (r, r), orthonormal, each in the place of one under the same law, that are coupled least.

    Where turning a set of directions of one law uncouples them at all angles, their axes are the eigenvectors of
    any mean of the responses there.
    """
    r = len(stiffness)
    S = np.eye(r)
    for k in range(r):
        same = np.flatnonzero((stiffness == stiffness[k]) & (damping == damping[k]))
        if same[0] != k or len(same) == 1:
            continue
        own = P[:, same][:, :, same]
        share = own / np.abs(own).max(axis=(1, 2))[:, None, None]
        mean = np.einsum("n,nij->ij", np.arange(1.0, len(P) + 1.0), share.real + 0.7 * share.imag)
        turn = np.linalg.eigh(mean + mean.T)[1].T
        if len(_coupled_sets(turn @ own @ turn.T)) > len(_coupled_sets(own)):
            S[np.ix_(same, same)] = turn
    return S


def _coupled_sets(P: Complexes) -> list[Ints]:
    """Sets of directions that responses (n, r, r) couple: within one each leads to each."""
    r = P.shape[-1]
    own = np.sqrt(np.abs(np.diagonal(P, axis1=1, axis2=2)))
    coupled = (np.abs(P) > UNCOUPLED * own[:, :, None] * own[:, None, :]).any(axis=0)
    reached = np.linalg.matrix_power(coupled.astype(float) + np.eye(r), r) > 0.0
    sets = [np.flatnonzero(reached[k] & reached[:, k]) for k in range(r)]
    return [part for k, part in enumerate(sets) if part[0] == k]
