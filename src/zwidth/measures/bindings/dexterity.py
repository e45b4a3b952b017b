"""The catalogue's measures of what the mechanism is, asked of places: see `measures.dexterity` for the formulas.

A mechanism has as many drives as directions its handle can move in, so that every singular value of its Jacobian
counts: in a singular posture, too, and in whatever frame.
"""

from __future__ import annotations

from zwidth.measures import dexterity
from zwidth.measures.place import Floats, Place


def manipulability(place: Place) -> Floats:
    """Thesis eq. 5.1."""
    return dexterity.manipulability(place.jacobian, _freedoms(place))


def isotropy(place: Place) -> Floats:
    """Thesis eq. 5.2, 2-norm."""
    return dexterity.isotropy(place.jacobian, _freedoms(place))


def isotropy_frobenius(place: Place) -> Floats:
    """Thesis eq. 5.2, Frobenius norm, 1 where isotropic."""
    return dexterity.isotropy_frobenius(place.jacobian, _freedoms(place))


def dynamic_manipulability(place: Place) -> Floats:
    """Thesis eq. 5.3, links and rotors."""
    return dexterity.dynamic_manipulability(place.jacobian, place.whole_mass_matrix, _freedoms(place))


def dynamic_isotropy(place: Place) -> Floats:
    """Condition number of the mass matrix of links and rotors, in the driven joints' angles."""
    return dexterity.dynamic_isotropy(place.whole_mass_matrix)


def handle_mass_isotropy(place: Place) -> Floats:
    """Largest over smallest mass of links and rotors felt at the handle."""
    return dexterity.handle_mass_isotropy(place.jacobian, place.whole_mass_matrix, _freedoms(place))


def link_side_mass(place: Place) -> Floats:
    """Of the links, along the rendered direction with the drives cut."""
    return place.effective.link_side_mass


def motor_side_mass(place: Place) -> Floats:
    """Of the rotors, along the rendered direction with the drives cut."""
    return place.effective.motor_side_mass


def rigid_mass(place: Place) -> Floats:
    """Of links and rotors, along the rendered direction with rigid drives."""
    return place.effective.rigid_mass


def stiffness(place: Place) -> Floats:
    """Of the drives, along the rendered direction; inf with rigid ones."""
    return place.effective.stiffness


def _freedoms(place: Place) -> int:
    return min(3, len(place.drives.names))
