"""The catalogue's measures of motors and encoders, asked of places: see `measures.forces` for the formulas.

What a device file does not tell of a drive is not guessed: the measure cannot be asked of the device then.
"""

from __future__ import annotations

import numpy as np

from zwidth.conditions.dry import ground_friction, reading_step
from zwidth.measures import forces
from zwidth.measures.measure import MeasureError
from zwidth.measures.place import Floats, Place


def peak_force(place: Place) -> Floats:
    """Exactly along the rendered direction, within the torque limits."""
    return forces.force_along(place.jacobian, _direction(place), _torques(place, "torque_limit_Nm"))


def continuous_force(place: Place) -> Floats:
    """Exactly along the rendered direction, within the continuous torques."""
    return forces.force_along(place.jacobian, _direction(place), _torques(place, "continuous_torque_Nm"))


def acceleration_max(place: Place) -> Floats:
    """Exactly along the rendered direction, from rest, within the torque limits; drives rigid."""
    torques = _torques(place, "torque_limit_Nm")
    return forces.acceleration_along(place.jacobian, place.whole_mass_matrix, _direction(place), torques)


def position_resolution(place: Place) -> Floats:
    """Step of the reading along the rendered direction when all encoders step; of a [plant] its sensor's."""
    if place.given is not None:
        return _told(reading_step(place.given), "needs the step of the encoder; give loop.encoder.resolution_m")
    counts = _all_told(place, "encoder_counts_per_rev", place.drives.encoder_counts)
    return forces.resolution_along(
        place.jacobian, _direction(place), 2.0 * np.pi / (counts * place.drives.transmission)
    )


def friction_force(place: Place) -> Floats:
    """Dry friction of all drives felt along the rendered direction; of a [plant] where the wall acts."""
    if place.given is not None:
        return _told(ground_friction(place.given), "needs dry friction; give friction.coulomb_N")
    dry = place.drives.nonlinearity
    if dry is None or not np.any(dry.coulomb > 0.0):
        raise MeasureError(f"needs dry friction; give {_key(place, 0, 'coulomb_Nm')}, or that of another drive")
    return forces.friction_along(place.jacobian, _direction(place), place.drives.transmission * dry.coulomb)


def _torques(place: Place, key: str) -> Floats:
    """Torques at the joints (..., d) [N m]. Raises MeasureError where a drive's is not told."""
    drives = place.drives
    found = drives.torque_limit if key == "torque_limit_Nm" else drives.continuous_torque
    given = np.full(len(drives.names), np.nan) if found is None else found
    return np.asarray(drives.transmission * _all_told(place, key, given))


def _all_told(place: Place, key: str, values: Floats) -> Floats:
    untold = ~np.isfinite(values)
    if untold.any():
        first = int(np.argwhere(untold)[0][-1])
        raise MeasureError(f"needs a finite {key} of every drive; give {_key(place, first, key)}")
    return values


def _told(value: float, otherwise: str) -> Floats:
    """A number of a [plant]; what is 0 there was left out, or might as well have been."""
    if value == 0.0:
        raise MeasureError(otherwise)
    return np.asarray(value)


def _key(place: Place, drive: int, key: str) -> str:
    return f"mechanism.drives.{place.drives.names[drive]}.{key}"


def _direction(place: Place) -> Floats:
    assert place.direction is not None
    return place.direction
