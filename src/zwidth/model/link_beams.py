"""From a rigid link and the properties of a beam to a link that bends."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.beam_bodies import assumed_modes, finite_elements, lumped_tip
from zwidth.model.beam_section import BeamProperties
from zwidth.model.flexible_body import FlexibleBody
from zwidth.model.flexible_link import BeamError, FlexibleLink, Method
from zwidth.model.mechanism import FIXED, Mechanism

NOTHING: Final = 1e-9  # share of a mass or an inertia that is rounding
POSSIBLE: Final = 1e-6  # share by which the beam may be heavier than its link, as rounded numbers make it


def flexible_link(
    mechanism: Mechanism,
    link: int,
    beam: BeamProperties,
    method: Method = "assumed-modes",
    modes: int = 2,
    elements: int = 8,
    damping_time: float = 0.0,
    planar: Floats | None = None,
) -> FlexibleLink:
    """The flexible link that takes the place of a rigid one.

    Assumed modes follow the joints: those of a beam clamped at its base where the link is driven or fixed, those
    of a beam between pins where its joint is passive. Converged results do not depend on that.

    link      index of the link, whose tip is the beam's
    modes     of assumed modes in each plane, of twist and of stretch; of finite elements those kept beside the
              static deflections
    elements  of finite elements
    planar    (3,)  axis about which alone the link's inertia is known; None: all of it is
    Raises    BeamError  for a beam that is heavier than its link, or has more modes than its elements
    """
    left, carried, rest = carried_body(mechanism, link, beam, planar)
    places = _fixed_places(mechanism, link, carried if left else None)
    stations = np.unique([min(max(x, 0.0), beam.length) for x in places])
    body = _body(mechanism, link, beam, method, modes, elements, stations)
    kept = 0 if method == "lumped" else modes
    return FlexibleLink(link, beam, body, method, kept, damping_time, left, carried, rest)


def carried_body(
    mechanism: Mechanism, link: int, beam: BeamProperties, planar: Floats | None = None
) -> tuple[float, Floats, Floats]:
    """Mass [kg], centre (3,) [m] and inertia (3, 3) [kg m^2] of what a link has beside a beam; arguments and
    errors are those of `flexible_link`."""
    links = mechanism.links
    mass, centre, inertia = (np.asarray(each)[link] for each in (links.mass, links.center_of_mass, links.inertia))
    L, m = beam.length, beam.mass_per_length * beam.length
    left = float(mass) - m
    if left < -POSSIBLE * m:
        raise BeamError(
            links.names[link],
            "mass_kg",
            f"is {float(mass):.6g} kg, and the beam alone weighs {m:.6g} kg; give the mass of the whole link, or "
            "another section or material",
        )
    carried = np.zeros(3)
    if left > NOTHING * m:
        carried = (mass * centre - m * np.array([L / 2.0, 0.0, 0.0])) / left
    left = left if left > NOTHING * m else 0.0
    own = np.diag([beam.torsional_inertia_per_length * L, m * L**2 / 12.0, m * L**2 / 12.0])
    rest = inertia - own - m * _spread(np.array([L / 2.0, 0.0, 0.0]) - centre) - left * _spread(carried - centre)
    if planar is not None:
        rest = float(planar @ rest @ planar) * np.outer(planar, planar)
    least = float(np.min(np.linalg.eigvalsh(rest)))
    if least < -POSSIBLE * float(np.max(own)):
        raise BeamError(
            links.names[link],
            "inertia_kg_m2",
            f"leaves {least:.4g} kg m^2 for what the beam carries, whose own moment is {float(np.max(own)):.4g} "
            "kg m^2 about its centre; give the inertia of the whole link, or another section or material",
        )
    return left, carried, rest


def _body(
    mechanism: Mechanism,
    link: int,
    beam: BeamProperties,
    method: Method,
    modes: int,
    elements: int,
    stations: Floats,
) -> FlexibleBody:
    if method == "lumped":
        return lumped_tip(beam, stations)
    if method == "finite-elements":
        try:
            return finite_elements(beam, stations, elements, modes)
        except ValueError as error:  # all but the number of modes is known to fit
            raise BeamError(mechanism.links.names[link], "beam.modes", str(error)) from None
    driven = [int(joint) for joint in mechanism.drives.joint]
    hub = mechanism.links.joint[link] == FIXED or link in driven or link in mechanism.free
    return assumed_modes(beam, stations, modes, "clamped" if hub else "pinned")


def _fixed_places(mechanism: Mechanism, link: int, carried: Floats | None) -> list[float]:
    """Places along a link [m] where other links, closures, the handle or its own body are fixed, and its tip."""
    links, closures = mechanism.links, mechanism.closures
    places = [float(links.tip[link][0])]
    places += [float(links.origin[i][0]) for i in np.flatnonzero(np.asarray(links.parent) == link)]
    for k in range(len(closures.names)):
        for end, points in ((closures.a, closures.point_a), (closures.b, closures.point_b)):
            places += [float(points[k][0])] if end[k] == link else []
    if mechanism.handle_link == link:
        places.append(float(mechanism.handle_point[0]))
    return places if carried is None else [*places, float(carried[0])]


def _spread(arm: Floats) -> Floats:
    """Inertia (3, 3) of a unit mass at an arm (3,)."""
    return np.asarray(float(arm @ arm) * np.eye(3) - np.outer(arm, arm))
