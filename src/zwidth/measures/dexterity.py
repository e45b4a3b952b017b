"""How freely a mechanism moves and accelerates its handle in one posture (thesis section 5.1).

All take the translational Jacobian of the handle in the driven coordinates. Only directions in which the handle
can move count: a planar mechanism is judged within its plane. `freedoms` is their number, for a mechanism of this
package the number of its drives; left out, it is the number of rows of the Jacobian that are not all zero.

Invariances (yes: the measure does not change): turning or shifting the base frame, the order of the drives (for
all of them), another unit of length or all lengths larger, another unit of mass, and other coordinates in place
of the joints' angles:

| measure                | frame, order | lengths, unit of mass   | coordinates |
| manipulability         | yes          | no                      | no          |
| isotropy, both norms   | yes          | yes                     | no          |
| dynamic_manipulability | yes          | no                      | no          |
| dynamic_isotropy       | yes          | yes, inertias alike     | no          |
| handle_mass_isotropy   | yes          | yes, inertias alike     | yes         |

"Frame" holds where `freedoms` is given. Without it the number of rows that are zero depends on the frame at a
singular posture, and for a planar mechanism with more than two drives. Other
coordinates are, for instance, the motors' angles, or absolute angles of links in place of those between them.

Functions `..._at` are the catalogue's measures of an operating point.

A mechanism has as many drives as directions its handle can move in, so that every singular value of its Jacobian
counts: in a singular posture, too, and in whatever frame.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.mechanism import ORIENTATION

ZERO_ROW: Final = 1e-12  # share of the largest entry below which a row of the Jacobian is rounding


def manipulability(jacobian: ArrayLike, freedoms: int | None = None) -> Floats:
    """Volume of the ellipsoid of handle velocities for joint rates of unit length.

        w = sqrt(det(J J^T))                        (Yoshikawa 1985; thesis eq. 5.1)

    with J^T J where there are fewer drives than directions to move in: the product of the singular values.

    jacobian  (..., 3, d)  J: handle velocity = J p' [m/rad]
    freedoms  directions the handle can move in, 1 to min(3, d); None: as many as rows that are not zero, and two
              where there are two drives
    Returns   (...)        [m^r/rad^r], r the freedoms; 0 where singular, nan where J is nan

    >>> float(manipulability([[0.0, -0.2], [0.3, 0.0], [0.0, 0.0]]))
    0.06
    """
    values, used = singular_values(jacobian, freedoms)
    return np.asarray(np.where(used, values, 1.0).prod(axis=-1) * used.any(axis=-1))


def dynamic_manipulability(jacobian: ArrayLike, mass_matrix: ArrayLike, freedoms: int | None = None) -> Floats:
    """Volume of the ellipsoid of handle accelerations for drive torques of unit length.

        w_d = sqrt(det(J (M^T M)^-1 J^T))           (Yoshikawa 1985; thesis eq. 5.3)

    jacobian     (..., 3, d)  J [m/rad]
    mass_matrix  (..., d, d)  M in the same coordinates, links and rotors [kg m²]
    freedoms     as for `manipulability`
    Returns      (...)        [1/(kg m)^r], r the freedoms
    Raises       LinAlgError  where M is singular

    >>> J = [[0.0, -0.2], [0.3, 0.0], [0.0, 0.0]]
    >>> round(float(dynamic_manipulability(J, [[0.02, 0.0], [0.0, 0.01]])), 9)
    300.0
    """
    J, M = np.asarray(jacobian, dtype=np.float64), np.asarray(mass_matrix, dtype=np.float64)
    accelerations = np.swapaxes(np.linalg.solve(np.swapaxes(M, -1, -2), np.swapaxes(J, -1, -2)), -1, -2)
    return manipulability(accelerations, freedoms)


def isotropy(jacobian: ArrayLike, freedoms: int | None = None) -> Floats:
    """Condition number of the Jacobian: largest over smallest singular value.

        kappa = |J| |J^-1|, 2-norm                  (Salisbury and Craig 1982; thesis eq. 5.2)

    jacobian  (..., 3, d)  J [m/rad]
    freedoms  as for `manipulability`
    Returns   (...)        1: isotropic; inf where singular or where nothing moves; nan where J is nan

    >>> float(isotropy([[0.0, -0.2], [0.3, 0.0], [0.0, 0.0]]))
    1.4999999999999998
    """
    values, used = singular_values(jacobian, freedoms)
    largest = values.max(axis=-1, initial=0.0)
    smallest = np.where(used, values, np.inf).min(axis=-1, initial=np.inf)
    return _ratio(largest, smallest)


def isotropy_frobenius(jacobian: ArrayLike, freedoms: int | None = None) -> Floats:
    """Condition number of the Jacobian in the Frobenius norm, divided by the freedoms r so that 1 is isotropic.

        kappa_F = |J|_F |J^+|_F / r = sqrt(sum s_i^2  sum 1/s_i^2) / r         (thesis eq. 5.2, Frobenius norm)

    with the singular values s_1 to s_r. The division is that of the norm sqrt(tr(J J^T)/r), in which a unit matrix
    has length 1 (Gosselin and Angeles 1991; Angeles and Lopez-Cajun 1992, of which the abstract was read). Unlike
    the 2-norm's it is smooth in the posture wherever J is regular, also where two singular values meet. By the
    inequality of the means 1 <= kappa_F <= kappa; for r = 2 it is (kappa + 1/kappa)/2.

    jacobian  (..., 3, d)  J [m/rad]
    freedoms  as for `manipulability`
    Returns   (...)        1: isotropic; inf where singular or where nothing moves; nan where J is nan

    >>> round(float(isotropy_frobenius([[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]])), 12)
    1.25
    """
    values, used = singular_values(jacobian, freedoms)
    with np.errstate(divide="ignore", invalid="ignore"):
        # over the largest, so that no square overflows; the product does not change
        scaled = values / values[..., :1]
        product = np.where(used, scaled**2, 0.0).sum(axis=-1) * np.where(used, 1.0 / scaled**2, 0.0).sum(axis=-1)
        ratio = np.sqrt(product) / used.sum(axis=-1)
    return np.asarray(np.where(values[..., 0] == 0.0, np.inf, ratio))


def dynamic_isotropy(mass_matrix: ArrayLike) -> Floats:
    """Condition number of the generalised inertia matrix: largest over smallest eigenvalue.

        kappa(M),   1 where M is a multiple of the unit matrix                 (Ma and Angeles 1993; thesis 5.1)

    A dynamically isotropic mechanism has inertia torques that do not couple its drives, and answers alike to each.
    The source could only be read second-hand (thesis section 5.1; abstracts).

    mass_matrix  (..., d, d)  M in the driven coordinates, links and rotors [kg m²]
    Returns      (...)        inf where a motion has no mass, nan where M is nan

    >>> float(dynamic_isotropy([[0.02, 0.0], [0.0, 0.01]]))
    2.0
    """
    M, unknown = _without_nan(mass_matrix)
    values: Floats = np.asarray(np.linalg.eigvalsh(M), dtype=np.float64)
    # an eigenvalue below 0 is rounding of a motion without mass
    ratio = _ratio(values[..., -1], np.maximum(values[..., 0], 0.0))
    return np.asarray(np.where(unknown, np.nan, ratio))


def handle_mass_isotropy(jacobian: ArrayLike, mass_matrix: ArrayLike, freedoms: int | None = None) -> Floats:
    """Largest over smallest mass felt at the handle, of all directions it can move in.

        kappa(W),   W = (J M^-1 J^T)^-1                                  (Khatib 1987; thesis eq. 2.16)

    the condition number of the inertia in the handle's space. The mass felt along u is 1/(u^T W^-1 u): it lies
    between the eigenvalues of W, and reaches both. With M = A A^T it is the square of the condition number of
    J A^-T, and is computed so: J M^-1 J^T would lose half of the digits near a singularity.

    jacobian     (..., 3, d)  J [m/rad]
    mass_matrix  (..., d, d)  M in the same coordinates, links and rotors [kg m²]
    freedoms     as for `manipulability`
    Returns      (...)        inf where singular, or where a motion has no mass; nan where J or M is nan

    >>> round(float(handle_mass_isotropy([[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]], [[0.04, 0.0], [0.0, 0.02]])), 12)
    2.0
    """
    M, unknown = _without_nan(mass_matrix)
    J = np.where(unknown[..., None, None], np.nan, np.asarray(jacobian, dtype=np.float64))
    inertias, axes = np.linalg.eigh(M)
    heavy = inertias > 0.0
    with np.errstate(invalid="ignore"):
        scaled_jacobian = J @ axes / np.sqrt(np.where(heavy, inertias, 1.0))[..., None, :]
        ratio = isotropy(scaled_jacobian, freedoms) ** 2
    return np.asarray(np.where(heavy.all(axis=-1) | np.isnan(ratio), ratio, np.inf))


def singular_values(jacobian: ArrayLike, freedoms: int | None = None) -> tuple[Floats, Flags]:
    """Singular values of the Jacobian, descending, and which of them belong to directions the handle can move in.

    jacobian  (..., 3, d)       J [m/rad]
    freedoms  as for `manipulability`
    Returns   (..., min(3, d))  values [m/rad], nan where J is nan; and as many flags, True where one counts, and
                                where J is nan
    Raises    ValueError        if there are not so many freedoms

    >>> singular_values([[0.0, -0.2], [0.3, 0.0], [0.0, 0.0]])[0]
    array([0.3, 0.2])
    """
    J, unknown = _without_nan(jacobian)
    values: Floats = np.asarray(np.linalg.svd(J, compute_uv=False), dtype=np.float64)
    count = values.shape[-1]
    if freedoms is not None and not 1 <= freedoms <= count:
        raise ValueError(f"freedoms must be a whole number from 1 to {count}, got {freedoms}")
    if freedoms is None:
        size = np.abs(J).max(axis=-1)
        rows = (size > ZERO_ROW * size.max(axis=-1, keepdims=True)).sum(axis=-1)
        # two drives move a handle in a plane: one row alone is an arm stretched along an axis
        rows = np.maximum(rows, min(2, count))
    else:
        rows = np.full(unknown.shape, freedoms)
    used: Flags = np.arange(count) < rows[..., None]
    return np.where(unknown[..., None], np.nan, values), used | unknown[..., None]


def _without_nan(matrix: ArrayLike) -> tuple[Floats, Flags]:
    """A matrix (..., m, n) set to 0 where it has a nan, on which LAPACK fails, and flags (...) of where."""
    A = np.asarray(matrix, dtype=np.float64)
    unknown: Flags = np.asarray(np.isnan(A).any(axis=(-2, -1)))
    return np.where(unknown[..., None, None], 0.0, A), unknown


def _ratio(largest: Floats, smallest: Floats) -> Floats:
    """Condition number (...), largest over smallest value; inf for 0/0, nan where unknown."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = largest / smallest
    return np.asarray(np.where((largest == 0.0) & ~np.isnan(smallest), np.inf, ratio))


def manipulability_at(point: OperatingPoint) -> Floats:
    """Manipulability of the drives' Jacobian (thesis eq. 5.1)."""
    return manipulability(jacobian_by_drives(point), _freedoms(point))


def isotropy_at(point: OperatingPoint) -> Floats:
    """Condition number of the drives' Jacobian (thesis eq. 5.2, 2-norm)."""
    return isotropy(jacobian_by_drives(point), _freedoms(point))


def isotropy_frobenius_at(point: OperatingPoint) -> Floats:
    """Condition number of the drives' Jacobian (thesis eq. 5.2, Frobenius norm), 1 where isotropic."""
    return isotropy_frobenius(jacobian_by_drives(point), _freedoms(point))


def dynamic_manipulability_at(point: OperatingPoint) -> Floats:
    """Dynamic manipulability with links and rotors (thesis eq. 5.3)."""
    return dynamic_manipulability(jacobian_by_drives(point), _driven_mass(point), _freedoms(point))


def dynamic_isotropy_at(point: OperatingPoint) -> Floats:
    """Condition number of the mass matrix of links and rotors, in the driven joints' angles."""
    return dynamic_isotropy(_driven_mass(point))


def handle_mass_isotropy_at(point: OperatingPoint) -> Floats:
    """Largest over smallest mass of links and rotors felt at the handle."""
    return handle_mass_isotropy(jacobian_by_drives(point), _driven_mass(point), _freedoms(point))


def link_side_mass_at(point: OperatingPoint) -> Floats:
    """Mass of the links along the rendered direction with the drives cut [kg]."""
    return point.effective.link_side_mass


def motor_side_mass_at(point: OperatingPoint) -> Floats:
    """Mass of the rotors along the rendered direction with the drives cut [kg]."""
    return point.effective.motor_side_mass


def rigid_mass_at(point: OperatingPoint) -> Floats:
    """Mass of links and rotors along the rendered direction with rigid drives [kg]."""
    return point.effective.rigid_mass


def stiffness_at(point: OperatingPoint) -> Floats:
    """Stiffness of the drives along the rendered direction [N/m]; inf with rigid ones."""
    return point.effective.stiffness


def jacobian_by_drives(point: OperatingPoint) -> Floats:
    """Jacobian (..., 3, d) of what the drives move, free joints at rest; of the orientation where they control
    that alone."""
    turns = point.mechanism is not None and point.mechanism.controls == ORIENTATION
    J = point.posture.angular_jacobian if turns and point.posture is not None else point.jacobian
    return J[..., : point.drive_side.driven]


def _driven_mass(point: OperatingPoint) -> Floats:
    """Mass matrix (..., d, d) of links and rotors that the drives feel while nobody holds the free joints: the
    Schur complement M_dd - M_df M_ff^-1 M_fd, the inverse of the drives' block of M^-1."""
    M, d = point.whole_mass_matrix, point.drive_side.driven
    if M.shape[-1] == d:
        return M
    across = M[..., :d, d:]
    return np.asarray(M[..., :d, :d] - across @ np.linalg.solve(M[..., d:, d:], np.swapaxes(across, -1, -2)))


def _freedoms(point: OperatingPoint) -> int:
    """Number of directions in which the drives can move the handle, at most 3."""
    return min(3, point.drive_side.driven)
