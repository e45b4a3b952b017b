"""From the checked [beam] of links to the links that bend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.schema.beam import BeamSection, MaterialSection, RectangleShape, RodShape, TubeShape
from zwidth.device.schema.mechanism import LinkSection
from zwidth.model.beam_section import (
    BeamProperties,
    Material,
    Section,
    beam_properties,
    rectangle,
    rectangular_tube,
    round_rod,
    tube,
    typical_material,
)
from zwidth.model.flexible_link import FlexibleLink
from zwidth.model.link_beams import flexible_link
from zwidth.model.mechanism import Mechanism

MODES, ELEMENTS = 2, 8  # where none are given


def with_beams(mechanism: Mechanism, links: dict[int, LinkSection], axes: dict[int, Floats]) -> Mechanism:
    """A mechanism with the links that bend.

    links  by the index of their body, those with a [beam];   axes  about which alone the inertia of some is known
    Raises BeamError  for a beam that its link cannot be
    """
    flexible = [_flexible(mechanism, index, link, axes.get(index)) for index, link in links.items()]
    return replace(mechanism, flexible=tuple(flexible))


def _flexible(mechanism: Mechanism, index: int, link: LinkSection, axis: Floats | None) -> FlexibleLink:
    section = link.beam
    assert section is not None
    return flexible_link(
        mechanism,
        index,
        properties_of(section, link.length_m),
        section.method,
        MODES if section.modes is None else section.modes,
        ELEMENTS if section.elements is None else section.elements,
        section.damping_time_s,
        axis,
    )


def own_body(section: BeamSection, length: float) -> tuple[float, Floats, Floats]:
    """Mass, centre of mass (3,) and inertia (3, 3) of a link that is its beam alone."""
    beam = properties_of(section, length)
    m = beam.mass_per_length * length
    inertia = np.diag([beam.torsional_inertia_per_length * length, m * length**2 / 12.0, m * length**2 / 12.0])
    return m, np.array([length / 2.0, 0.0, 0.0]), inertia


def properties_of(section: BeamSection, length: float) -> BeamProperties:
    """The beam of a [beam], `length` long [m]."""
    if section.section is not None:
        return beam_properties(length, _section(section), _material(section))
    bending = np.broadcast_to(np.asarray(section.bending_stiffness_Nm2, dtype=np.float64), (2,))
    rest = (
        section.torsion_stiffness_Nm2,
        section.axial_stiffness_N,
        section.mass_per_length_kg_per_m,
        section.torsional_inertia_per_length_kg_m,
    )
    return BeamProperties(length, *(float(number) for number in (*bending, *rest) if number is not None))


def _section(beam: BeamSection) -> Section:
    match beam.section:
        case RodShape() as rod:
            return round_rod(rod.diameter_m)
        case TubeShape() as round_tube:
            return tube(round_tube.outer_diameter_m, round_tube.wall_m)
        case RectangleShape() as solid:
            return rectangle(solid.width_m, solid.height_m)
        case box:
            assert box is not None
            return rectangular_tube(box.width_m, box.height_m, box.wall_m)


def _material(beam: BeamSection) -> Material:
    if isinstance(beam.material, MaterialSection):
        own = beam.material
        return Material(own.youngs_modulus_Pa, own.shear_modulus_Pa, own.density_kg_per_m3)
    assert beam.material is not None
    return typical_material(beam.material)
