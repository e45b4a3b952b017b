"""Effective masses along the rendered directions as functions of all parameters, with their gradients.

    m = 1 / (h^T A^-1 h),   dm = m^2 x^T dA x,   x = A^-1 h

A being the mass matrix of the links (link side), n^2 J of the rotors (motor side), or both (rigid); it is linear
in the parameters: column s of it is what the torques of a unit acceleration of coordinate s are, at rest and
without gravity.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.identify.arm.parameters import Parameters
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.effective_parameters import lever_arms, screw
from zwidth.model.inertia_regressor import inertia_regressor

KINDS: Final = ("rigid_mass", "link_side_mass", "motor_side_mass")
NO_MOTION: Final = 1e-12  # of a lever arm along a direction in which the handle cannot move


@dataclass(frozen=True)
class EffectiveMass:
    """One effective mass.

    kind       "rigid_mass", "link_side_mass" or "motor_side_mass"
    direction  number of the rendered direction
    turns      whether it is an inertia about an axis [kg m^2]
    value      [kg]; nan where the parameters' mass matrix is not positive definite
    gradient   (P,) by all parameters; None: it hangs on none of them
    """

    kind: str
    direction: int
    turns: bool
    value: float
    gradient: Floats | None


def effective_masses(
    parameters: Parameters, point: OperatingPoint, values: Floats, known_rotors: Floats
) -> Iterator[EffectiveMass]:
    """The effective masses at a point along each of its directions.

    values        (P,) of all parameters, or the base ones and 0 for the others: what the base parameters determine
                  is the same
    known_rotors  (d,) inertias at the joints, n^2 J, of the rotors that are no parameters, others 0 [kg m^2]
    """
    posture = point.posture
    assert posture is not None
    assert point.directions is not None
    whole = mass_columns(parameters, posture.angles)
    links = parameters.inertial
    by_kind = {
        "rigid_mass": (np.arange(whole.shape[2]), True),
        "link_side_mass": (np.arange(links), False),
        "motor_side_mass": (np.arange(links, whole.shape[2]), True),
    }
    for number, one in enumerate(point.directions):
        along = screw(one)
        h = lever_arms(posture, along)
        turns = not along[:3].any()
        for kind in KINDS:
            used, rotors = by_kind[kind]
            A = whole[:, :, used] @ values[used] + (np.diag(known_rotors) if rotors else 0.0)
            value, gradient = np.nan, np.zeros(len(values))
            if np.max(np.abs(h)) < NO_MOTION:
                value = np.inf
            elif _positive(A):
                x = np.linalg.solve(A, h)
                value = 1.0 / float(h @ x)
                gradient[used] = value**2 * np.einsum("s,stp,t->p", x, whole[:, :, used], x)
            fitted = kind != "motor_side_mass" or bool(parameters.rotors)
            yield EffectiveMass(kind, number, turns, value, gradient if fitted else None)


def mass_columns(parameters: Parameters, angles: Floats) -> Floats:
    """The mass matrix (d, d, P') of links and fitted rotors per unit of each inertial parameter, at a posture
    given by its joint coordinates (n,)."""
    mech = parameters.mech
    c = mech.driven
    at = np.tile(mech.to_drive[0] @ angles[mech.joint[-c:]], (c, 1))
    still, unit = np.zeros((c, c)), np.eye(c)
    links, _, _ = inertia_regressor(mech, angles, at, still, unit, np.zeros(3))
    columns = parameters.columns(links, still, unit, still)[:, :, : parameters.friction.start]
    return np.asarray(0.5 * (columns + np.swapaxes(columns, 0, 1)))


def _positive(A: Floats) -> bool:
    try:
        np.linalg.cholesky(A)
    except np.linalg.LinAlgError:
        return False
    return True
