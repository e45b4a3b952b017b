"""A flexible beam as a body of a mechanism: inertia, stiffness and second-order kinematics of its stations.

The beam lies along +x of its own frame, which sits at its base, s = 0, and moves with the tangent there. Its shape
is that of Kirchhoff's rod with stretch, given by the strains: curvature k (twist, and bending about y and z) and
stretch c, both linear in the elastic coordinates eps, so that the elastic energy is 1/2 eps^T K eps and no more.
Rotation R(s) and place r(s) follow from

    R' = R [k]x,  r' = (1 + c) R e_x,  R(0) = 1,  r(0) = 0

and are kept to second order. With a(s) the integral of k:

    R = 1 + [a]x + R2,      R2' = [a]x [k]x
    r = s e_x + r1 + r2,    r1' = c e_x + [a]x e_x,    r2' = R2 e_x + c [a]x e_x

As 2 R2 = [a]x^2 + [w]x with w' = a x k, the rotation vector is a + w/2 to second order, and

    r2' = (-(a_y^2 + a_z^2), a_x a_y + w_z, a_x a_z - w_y)/2 + c (0, a_z, -a_y)

The first of these is the foreshortening, by which a pressed beam buckles and a spinning one stiffens. By the terms
with w a beam that is bent and twisted leaves the plane.

A link that bends: a beam along its x axis, and what the beam carries.

The link's mass, centre of mass and inertia are those of the whole, as of a rigid link. Of these the beam has what
its mass per length makes; the rest is a rigid body that the beam carries at its nearest station.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.beam_section import BeamProperties


@dataclass(frozen=True)
class FlexibleBody:
    """A beam with e elastic coordinates eps, at eps = 0, all in its own frame; S stations.

    mass             (6+e, 6+e)    kinetic energy is 1/2 u^T M u for u = (velocity of the base's origin, angular
                                   velocity of the base, eps') [kg, kg m, kg m², and per unit of eps]
    stiffness        (e, e)        K, of eps
    stations         (S,)          places s along the beam [m]
    displacement     (S, 3, e)     Phi: r = s e_x + Phi eps + 1/2 eps^T D2 eps [m]
    rotation         (S, 3, e)     Psi: rotation vector = Psi eps + 1/2 eps^T O2 eps [rad]
    displacement_2   (S, 3, e, e)  D2, symmetric in the last two [m]
    rotation_2       (S, 3, e, e)  O2, symmetric in the last two [rad]. At eps = 0 and a base at rest the angular
                                   acceleration is Psi eps'' + eps'^T O2 eps'
    first_moment_2   (3, e, e)     integral of mass per length times D2 [kg m]; the beam's mass times the place of
                                   its centre is that of the straight beam + M[:3, 6:] eps + 1/2 eps^T this eps
    """

    mass: Floats
    stiffness: Floats
    stations: Floats
    displacement: Floats
    rotation: Floats
    displacement_2: Floats
    rotation_2: Floats
    first_moment_2: Floats

    def reduced(self, basis: Floats) -> FlexibleBody:
        """The body with the coordinates eta of eps = T eta.

        basis   (e, n)  T, columns linearly independent
        Raises  ValueError  for another number of rows
        """
        T = np.asarray(basis, dtype=np.float64)
        e = len(self.stiffness)
        if T.ndim != 2 or T.shape[0] != e:
            raise ValueError(f"basis must have {e} rows, one for each elastic coordinate, got the shape {T.shape}")
        n = T.shape[1]
        whole = np.zeros((6 + e, 6 + n))
        whole[:6, :6], whole[6:, 6:] = np.eye(6), T
        return FlexibleBody(
            mass=symmetric(whole.T @ self.mass @ whole),
            stiffness=symmetric(T.T @ self.stiffness @ T),
            stations=self.stations,
            displacement=self.displacement @ T,
            rotation=self.rotation @ T,
            displacement_2=symmetric(T.T @ self.displacement_2 @ T),
            rotation_2=symmetric(T.T @ self.rotation_2 @ T),
            first_moment_2=symmetric(T.T @ self.first_moment_2 @ T),
        )

    def scaled(self, scale: Floats | None = None) -> FlexibleBody:
        """The body with each elastic coordinate in another unit, eps_i = scale_i eta_i.

        scale   (e,) greater than 0; None: such that each coordinate's own mass is 1
        Raises  ValueError  for another number of scales, or one that is not greater than 0
        """
        e = len(self.stiffness)
        if scale is None:
            return self.reduced(np.diag(np.diag(self.mass)[6:] ** -0.5))
        given = np.asarray(scale, dtype=np.float64)
        if given.shape != (e,) or not np.all(np.isfinite(given) & (given > 0.0)):
            raise ValueError(f"scale must be {e} finite numbers greater than 0, got {given.tolist()}")
        return self.reduced(np.diag(given))


def clamped_frequencies(body: FlexibleBody) -> Floats:
    """Natural frequencies (e,) with the base clamped, ascending [Hz]."""
    from scipy.linalg import eigh

    if not len(body.stiffness):
        return np.zeros(0)
    # of 1/w^2, in which the low ones are the largest: they are wanted, and would be lost in the highest's rounding
    inverse = eigh(body.mass[6:, 6:], body.stiffness, eigvals_only=True)
    return np.asarray(inverse[::-1] ** -0.5 / (2.0 * np.pi))


def highest_frequency(body: FlexibleBody) -> float:
    """The highest natural frequency with the base clamped [Hz]; 0 without elastic coordinates.

    A time step h resolves the body's modes where this is well below 1/(2 h); otherwise fewer modes will do, or the
    step has to be shorter. With the base free to move the highest frequency is somewhat higher.
    """
    from scipy.linalg import eigh

    e = len(body.stiffness)
    if not e:
        return 0.0
    squared = eigh(body.stiffness, body.mass[6:, 6:], eigvals_only=True, subset_by_index=(e - 1, e - 1))
    return float(np.sqrt(squared[0]) / (2.0 * np.pi))


def symmetric(matrices: Floats) -> Floats:
    """The symmetric part of matrices (..., n, n)."""
    return np.asarray(0.5 * (matrices + np.swapaxes(matrices, -1, -2)))


Method = Literal["assumed-modes", "finite-elements", "lumped"]


@dataclass(frozen=True)
class FlexibleLink:
    """A beam in place of a rigid link.

    link           index of the link
    beam           its properties;   body  the beam, with a station at each place where something is fixed to it
    method         by which it is modelled;   modes  that it keeps beside its static deflections, as asked for
    damping_time   damping of the beam's own, this times its stiffness [s]
    carried_mass, carried_center (3,), carried_inertia (3, 3)  of the rest of the link, in its frame, the inertia
                   about the centre [kg], [m], [kg m²]
    """

    link: int
    beam: BeamProperties
    body: FlexibleBody
    method: Method
    modes: int = 0
    damping_time: float = 0.0
    carried_mass: float = 0.0
    carried_center: Floats = field(default_factory=lambda: np.zeros(3))
    carried_inertia: Floats = field(default_factory=lambda: np.zeros((3, 3)))

    @property
    def size(self) -> int:
        """Number of elastic coordinates."""
        return len(self.body.stiffness)

    def station_of(self, local: Floats) -> int:
        """Index of the station to which a point (3,) of the link's frame is fixed: the nearest along the beam."""
        along = min(max(float(local[0]), 0.0), self.beam.length)
        return int(np.argmin(np.abs(self.body.stations - along)))

    @property
    def frequencies(self) -> Floats:
        """Natural frequencies of the beam alone, clamped at its base, ascending [Hz]."""
        return clamped_frequencies(self.body)
