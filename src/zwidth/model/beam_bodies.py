"""A beam as a flexible body in three ways: finite elements, assumed modes, and a lump at the tip.

All give the same body once they have converged. Finite elements and assumed modes bend, stretch and twist under
loads at the base and at the stations exactly as the beam does, however few modes there are; modes only add inertia
along the beam. The lump has four coordinates and is for short light links, and to compare with the literature.

Euler-Bernoulli's beam: no shear, and no inertia of cross sections that tilt. Both lower frequencies by some
(n h / L)^2 of the n-th mode for a beam of height h, which for slender links is below what is known of them.

From a rigid link and the properties of a beam to a link that bends.
"""

from __future__ import annotations

from itertools import pairwise
from math import ceil
from numbers import Integral
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats, Ints
from zwidth.errors import BeamError
from zwidth.model.argument_checks import check_choice, describe_value
from zwidth.model.beam_integrals import (
    BOUNDARIES,
    Shapes,
    assembled,
    bar_deflections,
    bar_modes,
    bending_deflections,
    bending_modes,
    body_of_shapes,
    elastic_matrices,
    gauss_panels,
    hermite_bending,
    quadratic_bar,
    rod_inertia,
)
from zwidth.model.beam_section import BeamProperties
from zwidth.model.flexible_body import FlexibleBody, FlexibleLink, Method
from zwidth.model.mechanism import FIXED, Mechanism

# Stations are one, and a station is at the base or the tip, within this share of the length
SAME_PLACE = 1e-9
# A static deflection of which modes and other deflections leave less than this share says nothing new
DEPENDENT = 1e-7
# Modes whose squared frequencies are closer are one but for rounding: those of a round section in its two planes
REPEATED = 1e-8
# Finite elements: the mass of cubics has degree 6 and their second-order terms 5; 4 points are exact up to 7
ELEMENT_ORDER = 4
# Assumed modes: two panels to each half wave of the highest mode, exact to rounding with 8 points
MODE_ORDER = 8
# Of the mass, and of the inertia of twist, that a massless beam with a lump at the tip has there: integrals of the
# squared static deflection under a load at the tip, s^2 (3 L - s) / (2 L^3) and s/L
BENDING_LUMP = 33.0 / 140.0
BAR_LUMP = 1.0 / 3.0


def finite_elements(
    beam: BeamProperties, stations: ArrayLike, elements: int, modes: int | None = None
) -> FlexibleBody:
    """The beam by elements, cubic for bending and quadratic for stretch and twist, reduced by Craig and Bampton.

        eps = (displacement and rotation of each station from the base on, 3 + 3, then amplitudes of `modes` modes)

    The modes are the lowest of the beam with its base and all stations held (Craig and Bampton 1968). Frequencies
    converge from above, with h^4 of the elements' length h.

    stations  (S,) [m]; a node is put at each. Stations at the base have no coordinates, and one that is given
              twice has them once. Without a station at the tip, the tip's motion is among the modes
    elements  at least that many, and at least one between stations
    modes     0: static condensation (Guyan 1965); None: no reduction, eps = (displacement and rotation of each
              station, then of each other node from the base on, then of each element how far its middle is along
              and how far it is twisted, beyond the mean of its ends)
    Raises    ValueError  for a station off the beam, fewer than one element, or more modes than there are
    """
    at = _stations(beam, stations)
    _check_count("elements", elements, 1)
    loaded = _loaded(at)
    nodes = _divided(np.union1d(loaded, [0.0, beam.length]), beam.length / elements)
    n, panels = len(nodes) - 1, gauss_panels(nodes, ELEMENT_ORDER)
    held = np.searchsorted(nodes, loaded) - 1  # of the stations, by the nodes' order without the base
    order = _node_order(n, held)

    def all_shapes(places: Floats) -> Shapes:
        """Shapes of all coordinates of the elements at places (q,) [m] along the beam, in the order of eps."""
        bending, bar = hermite_bending(places, nodes), quadratic_bar(places, nodes)
        downwards = bending * np.repeat([1.0, -1.0], n)  # the rotation about y is minus the slope of z
        return Shapes(*(field[..., order] for field in assembled(bending, downwards, bar, bar)))

    if modes is None:
        return body_of_shapes(beam, all_shapes, panels, at)
    _check_count("modes", modes, 0)
    M, K = elastic_matrices(beam, all_shapes(panels.places), panels.weights)
    family = np.repeat([0, 1, 2, 3], 2 * n)[order]  # bending in both planes, stretch, twist
    T = _craig_bampton(M, K, family, 6 * len(held), modes)
    return body_of_shapes(beam, lambda places: all_shapes(places).reduced(T), panels, at)


def assumed_modes(
    beam: BeamProperties, stations: ArrayLike, modes: int, boundary: str = "clamped"
) -> FlexibleBody:
    """The beam by vibration modes of itself, completed by what they lack of its static deflections.

    Static deflections are those of the clamped beam under a force and a torque, in every direction, at each
    station, and at the tip where the modes hold it: with them the body deflects exactly under such loads, and
    frequencies converge from above, with the 4th power of the number of modes or faster. Coordinates are
    orthogonal in K and scaled to a mass of 1 each.

    stations  (S,) [m]
    modes     number of modes in each of the two bending planes, of stretch and of twist
    boundary  which modes: "clamped" with a free tip, for a beam on a hub; "clamped-pinned"; "pinned", half waves
              between pins at both ends. The converged results are the same
    Raises    ValueError  for a station off the beam, another boundary or fewer than 0 modes
    """
    at = _stations(beam, stations)
    _check_count("modes", modes, 0)
    check_choice("boundary", boundary, BOUNDARIES)
    L = beam.length
    loaded = _loaded(at) if boundary == "clamped" else np.union1d(_loaded(at), [L])
    # half waves of the highest mode are L / (modes + 1) or longer: two panels for each
    edges = _divided(np.union1d(loaded, [0.0, L]), L / (2.0 * modes + 2.0))
    panels = gauss_panels(edges, MODE_ORDER)

    def bending(places: Floats) -> Floats:
        modal = bending_modes(places, L, modes, boundary)
        return np.concatenate([modal, bending_deflections(places, loaded)], axis=2)

    def bar(places: Floats) -> Floats:
        return np.concatenate([bar_modes(places, L, modes, boundary), bar_deflections(places, loaded)], axis=2)

    B = _orthonormal(bending(panels.places)[2], panels.weights)
    A = _orthonormal(bar(panels.places)[1], panels.weights)

    def shapes(places: Floats) -> Shapes:
        bent, stretched = bending(places) @ B, bar(places) @ A
        return assembled(bent, bent, stretched, stretched)

    return body_of_shapes(beam, shapes, panels, at).scaled()


def lumped_tip(beam: BeamProperties, stations: ArrayLike) -> FlexibleBody:
    """The beam as massless springs to a lump at its tip, as thesis eq. 2.22 and 2.23 have it, in both planes.

        K = diag(EA/L, 3 EI_z/L^3, 3 EI_y/L^3, GJ/L)       of eps = (displacement of the tip (3), its twist)

    The tip turns by 3/(2 L) of its deflection, as under a force there. The lump is what a massless spring needs
    for the energy of the moving beam: 33/140 of the mass across, 1/3 of it along, 1/3 of the inertia of twist. The
    cantilever's first frequency comes out 1.47 % high. The rest stays with the base, such that the straight beam's
    whole mass, centre of mass and inertia are exact. What couples base and deflection is the lump alone: mass and
    first moments of the elastic coordinates, first_moment_2 too, are those of the lump at the tip.

    stations  (S,) [m]; between base and tip they move as the statically loaded beam does
    Raises    ValueError  for a station off the beam
    """
    at, L = _stations(beam, stations), beam.length
    loads = np.array([L])

    def shapes(places: Floats) -> Shapes:
        """Shapes, at places (q,) [m] along the beam, of the tip's displacement in x, y and z and of its twist."""
        bent = bending_deflections(places, loads)[..., :1] * (3.0 / L**3)
        stretched = bar_deflections(places, loads) / L
        by_family = assembled(bent, bent, stretched, stretched)  # y, z, x and twist, in this order
        return Shapes(*(field[..., [2, 0, 1, 3]] for field in by_family))

    panels = gauss_panels(np.union1d(_loaded(at), [0.0, L]), ELEMENT_ORDER)
    # with the tip as one more station, the last, at which the lump is
    tip = body_of_shapes(beam, shapes, panels, np.append(at, L))
    m, I = beam.mass_per_length * L, beam.torsional_inertia_per_length * L
    lump = m * np.array([BAR_LUMP, BENDING_LUMP, BENDING_LUMP])
    coupling = np.zeros((6, 4))  # velocity and angular velocity of the base by the four coordinates of the tip
    coupling[:3, :3] = np.diag(lump)
    coupling[3, 3], coupling[4, 2], coupling[5, 1] = BAR_LUMP * I, -L * lump[2], L * lump[1]
    mass = np.block([[rod_inertia(beam), coupling], [coupling.T, np.diag([*lump, BAR_LUMP * I])]])
    return FlexibleBody(
        mass,
        np.diag(np.diag(tip.stiffness)),  # off it is rounding
        at,
        tip.displacement[:-1],
        tip.rotation[:-1],
        tip.displacement_2[:-1],
        tip.rotation_2[:-1],
        lump[:, None, None] * tip.displacement_2[-1],
    )


def _craig_bampton(M: Floats, K: Floats, family: Ints, interface: int, modes: int) -> Floats:
    """Craig and Bampton's basis T (e, interface + modes): eps = T (interface coordinates, amplitudes of modes).

    Its first columns are the static deflections as one of the first `interface` coordinates is 1 and the others of
    them are 0, the next ones the lowest modes with all of them held at 0.

    M, K    (e, e)  mass and stiffness of the beam with its base held
    family  (e,)    number of the family of each coordinate: those of different families are not coupled. Of equal
                    frequencies, as of a round section in both planes, the one of the first family comes first on
                    every processor
    Raises  ValueError  for more modes than there are
    """
    from scipy.linalg import eigh, solve

    e, inner = len(K), slice(interface, None)
    if modes > e - interface:
        raise ValueError(
            f"must be at most {e - interface} modes, all that the elements have beside the static deflections, "
            f"got {modes}; give more elements"
        )
    T = np.zeros((e, interface + modes))
    T[:interface, :interface] = np.eye(interface)
    if e > interface:
        T[inner, :interface] = -solve(K[inner, inner], K[inner, :interface], assume_a="pos")
    # squared frequency, family, the family's coordinates, mode on these
    by_frequency: list[tuple[float, int, Ints, Floats]] = []
    for number in range(int(np.max(family, initial=-1)) + 1 if modes else 0):
        members = interface + np.flatnonzero(family[inner] == number)
        if len(members):
            squared, shapes = eigh(K[np.ix_(members, members)], M[np.ix_(members, members)])
            by_frequency += [
                (w, number, members, shape) for w, shape in zip(squared.tolist(), shapes.T, strict=True)
            ]
    by_frequency.sort(key=lambda mode: mode[0])
    for i in range(1, len(by_frequency)):
        if (
            by_frequency[i][1] < by_frequency[i - 1][1]
            and by_frequency[i][0] - by_frequency[i - 1][0] <= REPEATED * by_frequency[i][0]
        ):
            by_frequency[i - 1], by_frequency[i] = by_frequency[i], by_frequency[i - 1]
    for k, (_, _, members, shape) in enumerate(by_frequency[:modes]):
        T[members, interface + k] = shape
    return T


def _node_order(n: int, held: np.ndarray) -> list[int]:
    """The order that puts coordinates of families node by node: held nodes, other nodes, then middles of elements.
    Number i of the list is the index that coordinate i has among the families'.

    n     number of nodes without the base, and of elements;   held (k,)  indices of nodes that are stations
    Families: y and its slope, z and rotation, along and its bubble, twist and its bubble, n of each.
    """
    y, slope_y, z, turn_y, along, bubble, twist, bubble_twist = (n * i for i in range(8))
    others = [i for i in range(n) if i not in held]
    of_nodes = [first + i for i in [*held.tolist(), *others] for first in (along, y, z, twist, turn_y, slope_y)]
    return of_nodes + [first + i for i in range(n) for first in (bubble, bubble_twist)]


def _orthonormal(strain: Floats, weights: Floats) -> Floats:
    """Combinations T (k, n) of k functions, n <= k, whose strains are orthonormal in energy: each function less
    what those before it span, scaled. A function of which they lack next to nothing is left out.

    strain  (q, k)  of each function at Gauss points of weights (q,)
    """
    weighted = np.sqrt(weights)[:, None] * strain
    length = np.linalg.norm(weighted, axis=0)
    unit_columns, basis = weighted / length, np.zeros((len(weighted), 0))
    T = np.zeros((weighted.shape[1], 0))
    for j in range(weighted.shape[1]):
        outside, combination = unit_columns[:, j], np.eye(weighted.shape[1])[j] / length
        for _ in range(2):  # Gram and Schmidt's projection leaves rounding, which a second one takes
            share = basis.T @ outside
            outside, combination = outside - basis @ share, combination - T @ share
        size = float(np.linalg.norm(outside))
        if size > DEPENDENT:
            basis, T = np.column_stack([basis, outside / size]), np.column_stack([T, combination / size])
    return T


def _divided(edges: Floats, longest: float) -> Floats:
    """The ascending edges [m] with more between them, evenly: none is farther than `longest` from the next."""
    parts = [
        np.linspace(start, end, ceil((end - start) / longest * (1.0 - SAME_PLACE)), endpoint=False)
        for start, end in pairwise(edges.tolist())
    ]
    return np.concatenate([*parts, edges[-1:]])


def _stations(beam: BeamProperties, stations: ArrayLike) -> Floats:
    """The stations as an array (S,) [m], each one that is within SAME_PLACE of the base, the tip or an earlier one
    moved there.

    Raises  ValueError  for what are no numbers, and for a station off the beam
    """
    try:
        at = np.array(stations, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"stations must be numbers [m], got {describe_value(stations)}") from None
    if at.ndim != 1:
        raise ValueError(f"stations must be a list of numbers [m], got the shape {at.shape}")
    L = beam.length
    for place in at:
        if not -SAME_PLACE * L <= place <= (1.0 + SAME_PLACE) * L:
            raise ValueError(
                f"stations must lie on the beam, from 0 at its base to its length {L:.10g} [m], got {place:.10g}"
            )
    known = [0.0, L]
    for i, place in enumerate(at):
        nearest = min(known, key=lambda other: abs(other - place))
        at[i] = nearest if abs(nearest - place) <= SAME_PLACE * L else place
        known.append(float(at[i]))
    return at


def _loaded(stations: Floats) -> Floats:
    """Places (k,) [m] of the stations (S,) beyond the base, which holds those at 0; each once, ascending."""
    return np.unique(stations[stations > 0.0])


def _check_count(name: str, value: object, least: int) -> None:
    """Raise ValueError unless the value is a whole number, and not too small."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < least:
        raise ValueError(f"{name} must be a whole number, at least {least}, got {describe_value(value)}")


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

    Assumed modes follow the joints: those of a beam clamped at its base where the link is driven, free or fixed,
    those of a beam between pins where its joint is passive. Converged results do not depend on that.

    link      index of the link, whose tip is the beam's
    modes     of assumed modes in each plane, of twist and of stretch; of finite elements those kept beside the
              static deflections
    elements  of finite elements
    planar    (3,)  axis about which alone the link's inertia is known; None: all of it is
    Raises    BeamError  for a beam that is heavier than its link, or has more modes than its elements
    """
    carried_mass, carried_center, carried_inertia = carried_body(mechanism, link, beam, planar)
    places = _fixed_places(mechanism, link, carried_center if carried_mass else None)
    stations = np.unique([min(max(x, 0.0), beam.length) for x in places])
    body = _body(mechanism, link, beam, method, modes, elements, stations)
    kept = 0 if method == "lumped" else modes
    return FlexibleLink(
        link, beam, body, method, kept, damping_time, carried_mass, carried_center, carried_inertia
    )


def carried_body(
    mechanism: Mechanism, link: int, beam: BeamProperties, planar: Floats | None = None
) -> tuple[float, Floats, Floats]:
    """Mass [kg], centre (3,) [m] and inertia (3, 3) [kg m²], about that centre, of what a link has beside a beam;
    arguments and errors are those of `flexible_link`. Mass and centre are 0 where the beam weighs all of it."""
    links = mechanism.links
    mass, centre, inertia = (np.asarray(each)[link] for each in (links.mass, links.center_of_mass, links.inertia))
    L, m = beam.length, beam.mass_per_length * beam.length
    carried_mass = float(mass) - m
    if carried_mass < -POSSIBLE * m:
        raise BeamError(
            links.names[link],
            "mass_kg",
            f"is {float(mass):.6g} kg, and the beam alone weighs {m:.6g} kg; give the mass of the whole link, or "
            "another section or material",
        )
    carried_center = np.zeros(3)
    if carried_mass > NOTHING * m:
        carried_center = (mass * centre - m * np.array([L / 2.0, 0.0, 0.0])) / carried_mass
    carried_mass = carried_mass if carried_mass > NOTHING * m else 0.0
    beam_inertia = np.diag([beam.torsional_inertia_per_length * L, m * L**2 / 12.0, m * L**2 / 12.0])
    carried_inertia = (
        inertia
        - beam_inertia
        - m * _point_inertia(np.array([L / 2.0, 0.0, 0.0]) - centre)
        - carried_mass * _point_inertia(carried_center - centre)
    )
    if planar is not None:
        carried_inertia = float(planar @ carried_inertia @ planar) * np.outer(planar, planar)
    # no axis may be left with a negative moment, but by rounded numbers
    least = float(np.min(np.linalg.eigvalsh(carried_inertia)))
    if least < -POSSIBLE * float(np.max(beam_inertia)):
        raise BeamError(
            links.names[link],
            "inertia_kg_m2",
            f"leaves {least:.4g} kg m² for what the beam carries, whose own moment is "
            f"{float(np.max(beam_inertia)):.4g} kg m² about its centre; give the inertia of the whole link, or "
            "another section or material",
        )
    return carried_mass, carried_center, carried_inertia


def _body(
    mechanism: Mechanism,
    link: int,
    beam: BeamProperties,
    method: Method,
    modes: int,
    elements: int,
    stations: Floats,
) -> FlexibleBody:
    """The beam of a link as a body, by one of the methods; stations (S,) [m], the rest as of `flexible_link`."""
    if method == "lumped":
        return lumped_tip(beam, stations)
    if method == "finite-elements":
        try:
            return finite_elements(beam, stations, elements, modes)
        except ValueError as error:  # all but the number of modes is known to fit
            raise BeamError(mechanism.links.names[link], "beam.modes", str(error)) from None
    driven = [int(joint) for joint in mechanism.drives.joint]
    # a driven or a free joint is an independent coordinate, or there is none: a passive one follows the loops
    hub = mechanism.links.joint[link] == FIXED or link in driven or link in mechanism.free
    return assumed_modes(beam, stations, modes, "clamped" if hub else "pinned")


def _fixed_places(mechanism: Mechanism, link: int, carried: Floats | None) -> list[float]:
    """Places along a link [m] where other links, closures, the handle or the body that it carries are fixed, and
    its tip. carried (3,): that body's centre; None: there is none."""
    links, closures = mechanism.links, mechanism.closures
    places = [float(links.tip[link][0])]
    places += [float(links.origin[i][0]) for i in np.flatnonzero(np.asarray(links.parent) == link)]
    for k in range(len(closures.names)):
        for end, points in ((closures.a, closures.point_a), (closures.b, closures.point_b)):
            places += [float(points[k][0])] if end[k] == link else []
    if mechanism.handle_link == link:
        places.append(float(mechanism.handle_point[0]))
    return places if carried is None else [*places, float(carried[0])]


def _point_inertia(arm: Floats) -> Floats:
    """Inertia (3, 3) about the origin of a point of unit mass at `arm` (3,): |r|^2 1 - r r^T."""
    return np.asarray(float(arm @ arm) * np.eye(3) - np.outer(arm, arm))
