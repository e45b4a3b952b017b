"""The catalogue's measures of the mechanism at operating points: see `measures.dexterity` for the formulas.

A mechanism has as many drives as directions its handle can move in, so that every singular value of its Jacobian
counts: in a singular posture, too, and in whatever frame.
"""

from __future__ import annotations

from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures import dexterity
from zwidth.model.mechanism import Floats


def manipulability(point: OperatingPoint) -> Floats:
    """Thesis eq. 5.1."""
    return dexterity.manipulability(point.jacobian, _freedoms(point))


def isotropy(point: OperatingPoint) -> Floats:
    """Thesis eq. 5.2, 2-norm."""
    return dexterity.isotropy(point.jacobian, _freedoms(point))


def isotropy_frobenius(point: OperatingPoint) -> Floats:
    """Thesis eq. 5.2, Frobenius norm, 1 where isotropic."""
    return dexterity.isotropy_frobenius(point.jacobian, _freedoms(point))


def dynamic_manipulability(point: OperatingPoint) -> Floats:
    """Thesis eq. 5.3, links and rotors."""
    return dexterity.dynamic_manipulability(point.jacobian, point.whole_mass_matrix, _freedoms(point))


def dynamic_isotropy(point: OperatingPoint) -> Floats:
    """Condition number of the mass matrix of links and rotors, in the driven joints' angles."""
    return dexterity.dynamic_isotropy(point.whole_mass_matrix)


def handle_mass_isotropy(point: OperatingPoint) -> Floats:
    """Largest over smallest mass of links and rotors felt at the handle."""
    return dexterity.handle_mass_isotropy(point.jacobian, point.whole_mass_matrix, _freedoms(point))


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


def _freedoms(point: OperatingPoint) -> int:
    return min(3, len(point.drives.names))
