"""Description of a device at one operating point: masses, stiffness, natural frequencies and dexterity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.dexterity import dynamic_manipulability_at, isotropy_at, manipulability_at
from zwidth.model.argument_checks import check_kind
from zwidth.model.effective_mass import EffectiveParameters
from zwidth.model.flexible_body import FlexibleLink, Method
from zwidth.model.mechanism import FIXED, Mechanism
from zwidth.model.modes import natural_frequencies, real_modes
from zwidth.model.plant import Plant
from zwidth.result import Documented, Result, entry


@dataclass(frozen=True)
class BeamDescription(Documented):
    """A link that bends.

    method           by which it is modelled;   modes  kept beside its static deflections
    mass             of the beam;   carried_mass  of what it carries of the link's mass [kg]
    first_frequency  of the beam alone, clamped at its base [Hz]
    """

    link: str = field(metadata=entry())
    method: Method = field(metadata=entry())
    modes: int = field(metadata=entry())
    mass: float = field(metadata=entry("kg"))
    carried_mass: float = field(metadata=entry("kg"))
    first_frequency: float = field(metadata=entry("Hz", name="first_clamped_frequency"))


@dataclass(frozen=True, repr=False)
class Description(Result):
    """Masses and stiffness felt along the direction, frequencies, and the mechanism's dexterity.

    effective            masses [kg] and stiffness [N/m]; nan where inapplicable; None, as all that needs masses,
                         for a device of which only the geometry is known
    natural_frequencies  (n,)  of the device without its operator [Hz]; rigid modes exactly 0
    damping_ratios       of each frequency, None for rigid ones; None where damping couples the modes
    joints               angle of each joint by its link [rad], of a prismatic one the way [m], a list of those of
                         a joint with several; None for a device without a mechanism, as all below
    jacobian             (3, c)  [m/rad];   angular_jacobian  (3, c)  of the handle's orientation [rad/rad]
    mass_matrix          (c, c)  of the links [kg m²]
    manipulability, dynamic_manipulability, isotropy   see `measures.dexterity`
    beams                of the links that bend
    """

    effective: EffectiveParameters | None
    natural_frequencies: Floats | None = field(metadata=entry("Hz"))
    damping_ratios: list[float | None] | None = field(metadata=entry())
    joints: dict[str, Any] | None = field(default=None, metadata=entry("rad"))
    jacobian: Floats | None = field(default=None, metadata=entry())
    angular_jacobian: Floats | None = field(default=None, metadata=entry())
    mass_matrix: Floats | None = field(default=None, metadata=entry())
    manipulability: float | None = field(default=None, metadata=entry())
    dynamic_manipulability: float | None = field(default=None, metadata=entry())
    isotropy: float | None = field(default=None, metadata=entry())
    beams: tuple[BeamDescription, ...] = field(default=(), metadata=entry())

    def document(self) -> dict[str, Any]:
        """The numbers by key and unit; None where inapplicable."""
        felt = self.effective
        masses = {
            "link_side_mass_kg": felt and felt.link_side_mass,
            "motor_side_mass_kg": felt and felt.motor_side_mass,
            "rigid_mass_kg": felt and felt.rigid_mass,
            "stiffness_N_per_m": felt and felt.stiffness,
        } | super().document()
        return masses | ({} if self.joints is not None else {"beams": None})

    def table(self) -> dict[str, list[Any]]:
        """Every single number with its dotted key, in the columns `key` and `value`."""
        return entries(self.document())

    def __repr__(self) -> str:
        """Lines with masses, stiffness, natural frequencies and dexterity."""
        lines = [*self._mass_lines()]
        if self.manipulability is not None:
            lines.append(f"manipulability {self.manipulability:.4g}, isotropy {self.isotropy:.4g}")
        return "\n  ".join(lines)

    def _mass_lines(self) -> Iterator[str]:
        """Lines with masses [kg], stiffness [N/m] and at most eight natural frequencies [Hz]."""
        felt = self.effective
        if felt is None or self.natural_frequencies is None:
            yield "Description: masses not known"
            return
        masses = f"{felt.link_side_mass:.4g} kg link side, {felt.motor_side_mass:.4g} kg motor side"
        frequencies = ", ".join(f"{f:.4g}" for f in self.natural_frequencies[:8])
        more = ", ..." if len(self.natural_frequencies) > 8 else ""
        yield f"Description: {felt.rigid_mass:.4g} kg rigid ({masses}), {felt.stiffness:.5g} N/m between"
        yield f"natural frequencies {frequencies}{more} Hz"


def describe(point: OperatingPoint) -> Description:
    """Describe the device at one operating point, without its operator; of a device whose masses are not known its
    geometry alone.

    Raises  what `OperatingPoint.plant` raises
    """
    check_kind("point", point, OperatingPoint)
    known = "dynamics" not in point.missing
    plant = point.ungripped_plant if known else None
    felt = point.effective if known else None
    frequencies = None if plant is None else natural_frequencies(plant)
    ratios = None if plant is None else damping_ratios(plant)
    if point.mechanism is None or point.posture is None:
        return Description(felt, frequencies, ratios)
    return Description(
        felt,
        frequencies,
        ratios,
        joints=joint_coordinates(point.mechanism, point.posture.angles),
        jacobian=point.jacobian,
        angular_jacobian=point.posture.angular_jacobian,
        mass_matrix=point.mass_matrix if known else None,
        manipulability=float(manipulability_at(point)),
        dynamic_manipulability=float(dynamic_manipulability_at(point)) if known else None,
        isotropy=float(isotropy_at(point)),
        beams=tuple(_describe_beam(each, point.mechanism) for each in point.mechanism.flexible),
    )


def _describe_beam(link: FlexibleLink, mechanism: Mechanism) -> BeamDescription:
    """Describe a link that bends: how it is modelled, its masses [kg] and its first frequency [Hz]."""
    beam = link.beam
    return BeamDescription(
        mechanism.links.names[link.link],
        link.method,
        link.modes,
        beam.mass_per_length * beam.length,
        link.carried_mass,
        float(link.frequencies[0]),
    )


def joint_coordinates(mechanism: Mechanism, coordinates: Floats) -> dict[str, Any]:
    """Joint coordinates (n,) by their links: one number, 0 of a fixed joint, or a list of those of a joint with
    several."""
    joints: dict[str, Any] = {}
    for name, kind, value in zip(mechanism.links.names, mechanism.links.joint, coordinates.tolist(), strict=True):
        # a joint with several coordinates has a link for each: "arm/1", "arm/2" ..., the last one "arm"
        joint = name.partition("/")[0]
        if kind == FIXED:
            joints[joint] = 0.0
        elif joint in joints:
            earlier = joints[joint] if isinstance(joints[joint], list) else [joints[joint]]
            joints[joint] = [*earlier, value]
        else:
            joints[joint] = value
    return joints


def damping_ratios(plant: Plant) -> list[float | None] | None:
    """Damping ratio a/w of each natural frequency w, a its decay rate; None for rigid and negatively stiff ones.

    Returns None in place of the list where damping couples modes.

    A hysteretic loss L adds its loss per cycle at that frequency: x^T L x / (2 w^2), half the loss factor.
    """
    modes = real_modes(plant)
    if modes is None:
        return None
    L = np.zeros_like(plant.stiffness) if plant.hysteresis is None else plant.hysteresis
    loss = np.einsum("ij,ik,kj->j", modes.shapes, L, modes.shapes)
    each = zip(modes.decay.tolist(), loss.tolist(), modes.frequency_squared.tolist(), strict=True)
    return [
        a / squared**0.5 + modal_loss / (2.0 * squared) if squared > 0.0 else None
        for a, modal_loss, squared in each
    ]


def entries(document: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Every single value of a nested document with its dotted key, in the columns `key` and `value`.

    >>> entries({"a": {"b": [1, 2]}, "c": None})
    {'key': ['a.b.0', 'a.b.1', 'c'], 'value': [1, 2, None]}
    """
    pairs = list(_entries(document, ""))
    return {"key": [key for key, _ in pairs], "value": [value for _, value in pairs]}


def _entries(value: Any, key: str) -> Iterator[tuple[str, Any]]:
    """Every single value within a nested value, with its dotted key, which begins with `key`."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        inner: Any = value.items()
    elif isinstance(value, list | tuple):
        inner = enumerate(value)
    else:
        yield key, value
        return
    for step, part in inner:
        yield from _entries(part, f"{key}.{step}" if key else str(step))
