"""The catalogue's measures of the mechanism at operating points: see `measures.dexterity` for the formulas.

A mechanism has as many drives as directions its handle can move in, so that every singular value of its Jacobian
counts: in a singular posture, too, and in whatever frame.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures import dexterity
from zwidth.model.mechanism import ORIENTATION


def manipulability(point: OperatingPoint) -> Floats:
    """Thesis eq. 5.1."""
    return dexterity.manipulability(jacobian_by_drives(point), _freedoms(point))


def isotropy(point: OperatingPoint) -> Floats:
    """Thesis eq. 5.2, 2-norm."""
    return dexterity.isotropy(jacobian_by_drives(point), _freedoms(point))


def isotropy_frobenius(point: OperatingPoint) -> Floats:
    """Thesis eq. 5.2, Frobenius norm, 1 where isotropic."""
    return dexterity.isotropy_frobenius(jacobian_by_drives(point), _freedoms(point))


def dynamic_manipulability(point: OperatingPoint) -> Floats:
    """Thesis eq. 5.3, links and rotors."""
    return dexterity.dynamic_manipulability(jacobian_by_drives(point), _driven_mass(point), _freedoms(point))


def dynamic_isotropy(point: OperatingPoint) -> Floats:
    """Condition number of the mass matrix of links and rotors, in the driven joints' angles."""
    return dexterity.dynamic_isotropy(_driven_mass(point))


def handle_mass_isotropy(point: OperatingPoint) -> Floats:
    """Largest over smallest mass of links and rotors felt at the handle."""
    return dexterity.handle_mass_isotropy(jacobian_by_drives(point), _driven_mass(point), _freedoms(point))


def link_side_mass(point: OperatingPoint) -> Floats:
    """Of the links, along the rendered direction with the drives cut."""
    return point.effective.link_side_mass


def motor_side_mass(point: OperatingPoint) -> Floats:
    """Of the rotors, along the rendered direction with the drives cut."""
    return point.effective.motor_side_mass


def rigid_mass(point: OperatingPoint) -> Floats:
    """Of links and rotors, along the rendered direction with rigid drives."""
    return point.effective.rigid_mass


def stiffness(point: OperatingPoint) -> Floats:
    """Of the drives, along the rendered direction; inf with rigid ones."""
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
    return min(3, point.drive_side.driven)
