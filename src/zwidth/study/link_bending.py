"""The effect of bending links: a device beside the same with rigid links.

Of a file with beams, links are made rigid that keep their mass, centre of mass and inertia. Of one without, links
that can are taken as round tubes, to see whether bending is worth a thought: of aluminium 6061, as long as the
link (`length_m`), with a wall of a tenth of the diameter and SHARE of the link's mass; they carry the rest of it.
Where the link's inertia leaves no room for that, or the tube would be thicker than THICKEST of its length, the
share is halved until it fits, at most to LEAST_SHARE. Damping is that of the file; where that damps no bending,
because it is none or that of the drives, DAMPING of each tube's first vibration alone: without any damping hardly
any wall would be stable. Motors and counterweights on a link are part of its mass, so that a real link may be
softer, or stiffer; only the device's own sections tell.
"""

from __future__ import annotations

import copy
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import isnan, nan, pi, sqrt
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.device.address import is_number, members, table, written
from zwidth.device.build_mechanism import own_body
from zwidth.device.device import Device
from zwidth.device.load import from_document
from zwidth.device.schema.beam import BeamSection
from zwidth.errors import BeamError, ChartError, EquilibriumError, UnresolvedError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.load_effect import NONE_STABLE
from zwidth.model.argument_checks import check_kind
from zwidth.model.beam_bodies import carried_body
from zwidth.model.beam_section import beam_properties, typical_material
from zwidth.model.beam_section import tube as tube_section
from zwidth.model.mechanism import Damping, Mechanism, ModalDamping, ProportionalDamping
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import Plant
from zwidth.result import Documented, Result, documented, entry

MATERIAL: Final = "aluminium-6061"
WALL: Final = 0.1  # of the diameter
SHARE: Final = 0.5  # of the link's mass
LEAST_SHARE: Final = 1.0 / 32.0
THICKEST: Final = 0.25  # of the length
DAMPING: Final = 0.01  # of a tube's first vibration, clamped at its base
FIRST_ROOT: Final = 1.8751040687  # of a cantilever
MOVED: Final = 1e-3  # share of all motion that a wall makes, from which it moves a mode
BENDING_JOINTS: Final = ("revolute", "prismatic", "fixed")


@dataclass(frozen=True)
class Tube(Documented):
    """A link as a typical tube.

    length, outer_diameter, wall  [m];   share  of the link's mass
    damping_time  of the tube's own damping, this times its stiffness [s]; 0: damped as the file says
    """

    link: str = field(metadata=entry())
    length: float = field(metadata=entry("m"))
    outer_diameter: float = field(metadata=entry("m"))
    wall: float = field(metadata=entry("m"))
    share: float = field(metadata=entry(name="share_of_mass"))
    damping_time: float = field(default=0.0, metadata=entry("s"))


@dataclass(frozen=True)
class BendingNumbers(Documented):
    """Of a device with bending or with rigid links.

    chart             its stable walls; None where they could not be computed
    static_stiffness  at the handle, of an infinitely stiff wall, the motors held and no load [N/m]; inf where
                      nothing gives; nan where there is no equilibrium
    first_mode        lowest natural frequency of a mode that the wall moves, nobody at the handle [Hz]; nan where
                      there is none
    reason            why there is no largest stiffness; "" where there is one
    """

    chart: StabilityChart | None
    static_stiffness: float = field(metadata=entry("N/m"))
    first_mode: float = field(metadata=entry("Hz"))
    reason: str = field(default="", metadata=entry(empty="left out"))

    @property
    @documented("N/m", before="static_stiffness")
    def stiffness_max(self) -> float:
        """Largest stiffness [N/m]; nan where no wall is stable, or the chart cannot be computed."""
        return nan if self.chart is None else self.chart.stiffness_max


@dataclass(frozen=True, repr=False)
class Bending(Result):
    """A device beside the same with rigid links.

    links        names of those that bend, of legs as they are written
    tubes        what they are taken to be; () where the file gives their beams
    kept         names of the links that have a length and room for no tube; () where the file gives beams
    bent, rigid  its numbers
    """

    links: tuple[str, ...] = field(metadata=entry())
    tubes: tuple[Tube, ...] = field(metadata=entry())
    kept: tuple[str, ...] = field(metadata=entry(name="kept_rigid"))
    bent: BendingNumbers = field(metadata=entry())
    rigid: BendingNumbers = field(metadata=entry())

    @property
    @documented(before="tubes")
    def given(self) -> bool:
        """Whether the file gives the beams."""
        return not self.tubes

    def table(self) -> dict[str, Any]:
        """The numbers with rigid and with bending links as columns."""
        rigid, bent = self.rigid.document(), self.bent.document()
        columns = {name: [rigid[name], bent[name]] for name in rigid if name != "reason"}
        return {"links": ["rigid", "bending"], **columns}

    def __repr__(self) -> str:
        what = "beams of the file" if self.given else "typical tubes"
        rows = (
            f"{name} links: largest stiffness {each.stiffness_max:.6g} N/m, static stiffness "
            f"{each.static_stiffness:.6g} N/m, first mode {each.first_mode:.6g} Hz"
            for name, each in (("rigid", self.rigid), ("bending", self.bent))
        )
        return "\n  ".join([f"Bending: {len(self.links)} links as {what}", *rows])


def bending(device: Device, point: OperatingPoint | None = None) -> Bending | None:
    """The effect of bending links at one operating point; left out: the device's reference.

    Returns  None of a device without links that could bend: given by a plant or a response, without lengths, with
             masses that are not known, or asked for in its rigid model
    Raises   what `Device.at`, and `OperatingPoint.loop` of this point raise
    """
    check_kind("device", device, Device)
    point = point or device.at()
    if device.mechanism is None or point.model == "rigid" or "dynamics" in device.missing:
        return None
    beams = tuple(link["name"] for link in _links(device) if "beam" in link)
    tubes = () if beams else typical_tubes(device)
    if not (beams or tubes):
        return None
    as_described = _bending_numbers(point)
    other = with_rigid_links(device) if beams else with_tubes(device, tubes)
    try:
        changed = _bending_numbers(_placed_like(other, device, point))
    except EquilibriumError as error:
        changed = BendingNumbers(None, nan, nan, f"no equilibrium: {error}")
    if beams:
        return Bending(beams, (), (), as_described, changed).about(point)
    links = tuple(tube.link for tube in tubes)
    kept = tuple(link["name"] for link in _links(device) if _length(link) > 0.0 and link["name"] not in links)
    return Bending(links, tubes, kept, changed, as_described).about(point)


def _placed_like(other: Device, device: Device, point: OperatingPoint) -> OperatingPoint:
    """Another device at the operating point of a device, with its operator and load. Raises EquilibriumError where
    it has no equilibrium there."""
    if point.load is not None and point.load is not device.load:
        other = other.under(point.load)
    found = other.at_point(point)
    return replace(found, operator=point.operator, operator_name=point.operator_name, arm=point.arm)


def _links(device: Device) -> list[dict[str, Any]]:
    """The tables of a device's links in its file, those of a leg once."""
    return [link for _, link in written(table(device.document, "mechanism"), "links")]


def _length(link: dict[str, Any]) -> float:
    """Length of a link by its table [m]; 0 where none is given."""
    length = link.get("length_m", 0.0)
    return float(length) if is_number(length) else 0.0


def with_rigid_links(device: Device) -> Device:
    """The device with rigid links in place of those that bend, with the same mass: the link's own, or that of its
    beam where the file gives it none."""
    document = copy.deepcopy(device.document)
    for _, link in written(document["mechanism"], "links"):
        section = link.pop("beam", None)
        if section is not None and "mass_kg" not in link:
            mass, centre, inertia = own_body(BeamSection.model_validate(section), link["length_m"])
            link |= {
                "mass_kg": mass,
                "center_of_mass_m": centre.tolist(),
                "inertia_kg_m2": np.diag(inertia).tolist(),
            }
    # assembled as the device, which has been checked
    return from_document(document, device.label, skip_assembly_check=True)


def with_tubes(device: Device, tubes: tuple[Tube, ...]) -> Device:
    """The device with these links as tubes of aluminium, which carry the rest of the links' mass."""
    document, sizes = copy.deepcopy(device.document), {each.link: each for each in tubes}
    for _, link in written(document["mechanism"], "links"):
        if (size := sizes.get(link["name"])) is not None:
            section = {"shape": "tube", "outer_diameter_m": size.outer_diameter, "wall_m": size.wall}
            link["beam"] = {
                "section": section,
                "material": MATERIAL,
                "damping_time_s": size.damping_time,
            }
    return from_document(document, device.label, skip_assembly_check=True)


def typical_tubes(device: Device) -> tuple[Tube, ...]:
    """The links of a device with rigid links as typical tubes: those that have a length and a mass, and whose
    joint is revolute, prismatic or fixed. In legs each is named as it is written."""
    mechanism, document = device.mechanism, table(device.document, "mechanism")
    assert mechanism is not None
    copies: dict[Any, str] = {}  # path of a link as it is written -> name of its first copy in the mechanism
    for member in members(document, "links"):
        copies.setdefault(member.path, member.entry["name"])
    ratio = 0.0 if _damps_bending(device.damping) else DAMPING
    found = [_tube(mechanism, copies[path], link, ratio) for path, link in written(document, "links")]
    return tuple(each for each in found if each is not None)


def _damps_bending(damping: Damping) -> bool:
    """Whether a file's damping damps all flexible modes, those of links among them, by its stiffness; False for
    one of the drives alone, and for one by the mass, which damps fast modes ever less."""
    if isinstance(damping, ModalDamping):
        return float(damping.ratio) > 0.0
    return isinstance(damping, ProportionalDamping) and float(damping.stiffness_coefficient_s) > 0.0


def _tube(mechanism: Mechanism, name: str, link: dict[str, Any], ratio: float) -> Tube | None:
    """The link of that name in the mechanism as a tube of half its mass, or of that halved until the tube is slim
    enough and the link's inertia holds it; None where it cannot be a tube.

    link   its table in the device file
    ratio  of damping that the tube has in its first vibration, clamped at its base
    """
    length, mass = _length(link), link.get("mass_kg", 0.0)
    if not (length > 0.0 and mass > 0.0 and link["joint"] in BENDING_JOINTS):
        return None
    index, material = mechanism.links.names.index(name), typical_material(MATERIAL)
    share = SHARE
    while share >= LEAST_SHARE:
        # outer diameter D of a tube of this mass, rho pi (D^2 - (D - 2 t)^2) / 4 L with a wall t = WALL D
        D = sqrt(share * mass / (material.density * length * pi * WALL * (1.0 - WALL)))
        beam = beam_properties(length, tube_section(D, WALL * D), material)
        slowest = FIRST_ROOT**2 / length**2 * sqrt(beam.EI_y / beam.mass_per_length)  # of a cantilever [rad/s]
        time = 2.0 * ratio / slowest  # a damping of `time` times the stiffness has this ratio at `slowest`
        with suppress(BeamError):  # the link's inertia leaves no room for the tube's
            carried_body(mechanism, index, beam, _known_axis(link))
            if D / length <= THICKEST:
                return Tube(link["name"], length, D, WALL * D, share, time)
        share /= 2.0
    return None


def _known_axis(link: dict[str, Any]) -> Floats | None:
    """The axis (3,) about which alone a link's inertia is known; None: all of it is."""
    if not is_number(link["inertia_kg_m2"]):
        return None
    axis = np.asarray(link.get("axis", (0.0, 0.0, 1.0)), dtype=np.float64)
    return np.asarray(axis / np.linalg.norm(axis))


def _bending_numbers(point: OperatingPoint) -> BendingNumbers:
    """The numbers of a device at an operating point. Raises what `OperatingPoint.loop` raises."""
    first = _first_moved_frequency(point.ungripped_plant)
    chart, reason = None, ""
    try:
        chart = stability_chart(point.loop, decay=False).about(point).drawn()
    except (ChartError, UnresolvedError) as error:
        reason = str(error)
    if chart is not None and isnan(chart.stiffness_max):
        reason = NONE_STABLE
    return BendingNumbers(chart, float(point.effective.stiffness), first, reason)


def _first_moved_frequency(plant: Plant) -> float:
    """Lowest natural frequency of a mode that has more than the share MOVED of the motion that a force of the wall
    makes at the sensor [Hz]; nan if there is none."""
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    share = np.abs((shapes.T @ plant.actuator) * (shapes.T @ plant.sensor))
    moved = squared[(squared > 0.0) & (share > MOVED * share.sum())]
    return sqrt(float(moved[0])) / (2.0 * pi) if len(moved) else nan
