"""Effective masses and stiffness of a mechanism along one direction at the handle."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats, Ints
from zwidth.compiled import compiled
from zwidth.model.design_axes import at_index
from zwidth.model.drive_side import DriveSide, drive_side, drive_side_of_motions, is_plain
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import design_of_each, pack, per_design
from zwidth.model.motions import Motions
from zwidth.model.posture import OK, Posture
from zwidth.model.ratio_table import at_postures


@dataclass(frozen=True)
class EffectiveParameters:
    """Along one direction u, with h = J^T u; all with the leading axes of posture and direction, nan where not OK.

    link_side_mass   (...)  1 / (h^T M_phi^-1 h): links with the drives cut          (thesis eq. 2.28) [kg]
    motor_side_mass  (...)  1 / (h^T M_theta^-1 h): rotors with the drives cut       (thesis eq. 2.28) [kg]
    rigid_mass       (...)  1 / (h^T (M_phi + M_theta)^-1 h): links and rotors, drives rigid [kg]
    stiffness        (...)  1 / (h^T K^-1 h), inf with rigid drives                  (thesis eq. 2.34) [N/m]

    A direction in which the handle cannot move has h = 0: all four are inf.

    Of links that bend, masses are those of the links as if they did not: what a slow motion feels. What the
    fastest one feels, 1 / (h^T M^-1 h) with all elastic coordinates, is less with each further mode of a beam,
    down to what is fixed at the handle. The stiffness is that of drives and links in series, the motors held.
    """

    link_side_mass: Floats
    motor_side_mass: Floats
    rigid_mass: Floats
    stiffness: Floats


def effective_parameters(mechanism: Mechanism, posture: Posture, direction: ArrayLike) -> EffectiveParameters:
    """Effective masses and stiffness of a mechanism along a direction, or about an axis (then inertias [kg m²]
    and N m/rad).

    With drives that are no coordinates of their own (`drive_side`): motor_side_mass 1 / (t^T M_theta^-1 t);
    rigid_mass with M_phi + T^T M_theta T + C T + T^T C^T; stiffness 1 / (h^T (T^T K T)^-1 h) on the drives'
    coordinates.

    direction  (..., 3)  unit vectors in the base frame, broadcasting with the posture; or (..., 6), see `screw`
    Raises     ValueError  if a direction is not of unit length
    """
    u = screw(direction)
    if mechanism.flexible:
        rigid = effective_parameters(replace(mechanism, flexible=()), posture, direction)
        return replace(rigid, stiffness=_stiffness_with_links(mechanism, posture, u))
    posed = at_postures(mechanism, posture)
    drives = posed.drives
    ratio = per_design(posed, drives.transmission, 1)
    rotor = ratio**2 * per_design(posed, drives.motor_inertia, 1)
    spring = ratio**2 * per_design(posed, drives.stiffness, 1)
    shape = np.broadcast_shapes(posture.status.shape, u.shape[:-1])
    design, c = design_of_each(posed, shape), posture.mass_matrix.shape[-1]
    M = np.array(np.broadcast_to(posture.mass_matrix, (*shape, c, c)).reshape(-1, c, c), order="C")
    h = np.array(np.broadcast_to(lever_arms(posture, u), (*shape, c)).reshape(-1, c), order="C")
    if not is_plain(mechanism):
        side = drive_side(mechanism, posture)
        spun = None if side.spin is None else (ratio * per_design(posed, drives.motor_inertia, 1))[design]
        return _effective_in_general(side, M, h, rotor[design], spring[design], spun, shape)
    out = np.empty((4, len(M)))
    _effective_batch(design, M, h, np.ascontiguousarray(rotor), np.ascontiguousarray(spring), out)
    return EffectiveParameters(*(row.reshape(shape) for row in out))


def lever_arms(posture: Posture, screws: Floats) -> Floats:
    """h (..., c): motion along screws (..., 6) per unit rate of each independent coordinate, J^T u + J_w^T w."""
    h = np.einsum("...i,...id->...d", screws[..., :3], posture.jacobian)
    if np.any(screws[..., 3:]):
        h = h + np.einsum("...i,...id->...d", screws[..., 3:], posture.angular_jacobian)
    return np.asarray(h)


def screw(direction: ArrayLike) -> Floats:
    """A direction as the screw (..., 6) along which forces act: [u, w] is the force u f and the moment w f.

    direction  (..., 3)  a unit vector u, w being 0; or (..., 6) such a screw: [0, w] with a unit vector w is the
                         axis of a moment, and a mixed screw has |u|^2 + |w|^2/L^2 = 1 with a characteristic length
                         L
    Raises     ValueError  for a direction of three components that is not of unit length, or one without length
    """
    given = np.asarray(direction, dtype=np.float64)
    if given.ndim and given.shape[-1] == 6:
        if not np.all(np.abs(given).max(axis=-1) > 0.0) or not np.isfinite(given).all():
            raise ValueError(f"a screw needs a finite component that is not 0, got {given.tolist()}")
        return given
    u = unit_directions(direction)
    return np.concatenate([u, np.zeros_like(u)], axis=-1)


def _effective_in_general(
    side: DriveSide,
    M: Floats,
    h: Floats,
    rotor: Floats,
    spring: Floats,
    spun: Floats | None,
    shape: tuple[int, ...],
) -> EffectiveParameters:
    """The four numbers where drives are not the coordinates: N postures, rotors and springs (N, d) at the joints,
    spun (N, d) J_m n of rotors whose turning with their links counts."""
    N, c = h.shape
    T = np.broadcast_to(side.motion, (*shape, *side.motion.shape[-2:])).reshape(N, -1, c)
    t = side.shares(np.reshape(h, (*shape, c))).reshape(N, -1)
    whole = M + np.swapaxes(T, 1, 2) @ (rotor[..., None] * T)
    if side.spin is not None and spun is not None:
        cross = np.swapaxes(T, 1, 2) @ (
            spun[..., None] * np.broadcast_to(side.spin, (*shape, *T.shape[1:])).reshape(T.shape)
        )
        whole = whole + cross + np.swapaxes(cross, 1, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        link, rigid = (1.0 / np.einsum("ki,ki->k", h, _solve(A, h)) for A in (M, whole))
        motor = 1.0 / (t**2 / rotor).sum(axis=1)
        stiffness = 1.0 / _compliance(T[..., : side.driven], spring, h[:, : side.driven])
    return EffectiveParameters(*(np.asarray(x).reshape(shape) for x in (link, motor, rigid, stiffness)))


def _stiffness_with_links(mechanism: Mechanism, posture: Posture, screws: Floats) -> Floats:
    """1 / (h^T K^-1 h) (...) of drives and links that bend, posture by posture; nan where it is not OK."""
    shape = np.broadcast_shapes(posture.status.shape, screws.shape[:-1])
    postures, screws = posture.broadcast_to(shape), np.broadcast_to(screws, (*shape, 6))
    out = np.full(shape, np.nan)
    for index in np.ndindex(shape):
        one = postures.with_axes(at_index(index))
        if one.status != OK:
            continue
        posed = at_postures(mechanism, one)
        motions = Motions(pack(posed), one.angles, posed.flexible)
        side, drives = drive_side_of_motions(posed, motions, one.angles), posed.drives
        held = np.r_[0 : side.driven, motions.joint_count : motions.count]
        T, h = side.motion[:, held], motions.handle_along(screws[index])[held]
        spring = drives.transmission**2 * drives.stiffness
        bending = motions.elastic_stiffness()[np.ix_(held, held)]
        with np.errstate(divide="ignore"):
            out[index] = 1.0 / _compliance(T[None], spring[None], h[None], bending)[0]
    return out


def _solve(A: Floats, h: Floats) -> Floats:
    """A^-1 h of each (N, c); nan where A holds nan."""
    unknown: Flags = np.asarray(np.isnan(A).any(axis=(1, 2)))
    known: Floats = np.where(unknown[:, None, None], np.eye(A.shape[1]), A)
    solved = np.linalg.solve(known, h[..., None])[..., 0]
    return np.asarray(np.where(unknown[:, None], np.nan, solved))


def _compliance(T: Floats, spring: Floats, h: Floats, bending: Floats | None = None) -> Floats:
    """h^T (T^T K T)^-1 h (N,) with rigid drives in the limit: they leave the motions N of T_r N = 0.

    bending  (c, c)  stiffness of the links, which is added
    """
    out = np.full(len(h), np.nan)
    for k in np.flatnonzero(~np.isnan(T).any(axis=(1, 2))):
        flexible = np.isfinite(spring[k])
        motions = np.eye(T.shape[2])
        if not flexible.all():
            _, values, rows = np.linalg.svd(T[k][~flexible])
            motions = rows[int(np.sum(values > 1e-12 * values[0])) :].T
        moved = T[k][flexible] @ motions
        A, b = moved.T @ (spring[k][flexible, None] * moved), motions.T @ h[k]
        A = A if bending is None else A + motions.T @ bending @ motions
        out[k] = b @ np.linalg.solve(A, b) if len(b) else 0.0
    return out


def unit_directions(directions: ArrayLike) -> Floats:
    """Directions as an array (..., 3), each checked to be of unit length."""
    u = np.asarray(directions, dtype=np.float64)
    if u.ndim == 0 or u.shape[-1] != 3:
        raise ValueError(f"a rendered direction has three components, got an array of shape {u.shape}")
    length = np.linalg.norm(u, axis=-1)
    wrong = np.argwhere(~(np.abs(length - 1.0) <= 1e-9))
    if len(wrong):
        first, size = u[tuple(wrong[0])].tolist(), float(length[tuple(wrong[0])])
        if not size > 0.0:
            raise ValueError(f"the rendered direction {first} has no length; give it at least one component")
        raise ValueError(f"the rendered direction {first} has length {size:.6g}; divide it by its length")
    return u


@compiled
def inverse_form(A: Floats, h: Floats, d: int) -> float:
    """h^T A^-1 h of a symmetric positive definite A (d, d), by Cholesky; both are overwritten."""
    total = 0.0
    for j in range(d):
        pivot = A[j, j]
        # with A = L D L^T the form is the sum of (L^-1 h)_j^2 / D_j: no way back is needed
        total += h[j] * h[j] / pivot
        for i in range(j + 1, d):
            factor = A[i, j] / pivot
            h[i] -= factor * h[j]
            for c in range(j + 1, i + 1):
                A[i, c] -= factor * A[c, j]
    return total


@compiled
def _effective_batch(design: Ints, M: Floats, along: Floats, rotor: Floats, spring: Floats, out: Floats) -> None:
    """The four numbers of `EffectiveParameters` for each posture, of lever arms (N, d), out (4, N)."""
    d = rotor.shape[1]
    left, A = np.zeros(d), np.zeros((d, d))
    for i in range(design.size):
        p = design[i]
        motor, compliance = 0.0, 0.0
        for s in range(d):
            motor += along[i, s] * along[i, s] / rotor[p, s]
            compliance += along[i, s] * along[i, s] / spring[p, s]
        for both in range(2):
            for s in range(d):
                left[s] = along[i, s]
                for t in range(d):
                    A[s, t] = M[i, s, t]
                if both == 1:
                    A[s, s] += rotor[p, s]
            out[2 * both, i] = 1.0 / inverse_form(A, left, d)
        out[1, i] = 1.0 / motor
        out[3, i] = 1.0 / compliance
