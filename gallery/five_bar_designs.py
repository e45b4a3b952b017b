"""Changed five-bars, many at once: base joints set apart, driven arms of other lengths.

`zwidth.load(name, settings)` makes one design after the other; a mechanism whose numbers have a leading axis holds
them all, and their postures are solved together. The tests hold the two ways to each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gallery.five_bar import SIDES, bundled
from zwidth.device import Device
from zwidth.device.load import load
from zwidth.loop import OperatingPoint
from zwidth.measures import MeasureValues, evaluate, find_measure

device = load("five-bar")
LINKS = device.mechanism.links.names
RIGHT, DISTAL_RIGHT, LEFT, DISTAL_LEFT = (
    LINKS.index(name) for name in ("upper-right", "distal-right", "upper-left", "distal-left")
)
REFERENCE = (0.0, 0.25)
LENGTH = float(device.mechanism.links.tip[RIGHT, 0])

# What becomes of a driven arm's mass and inertia with its length: "kept"; "grown" as a bar of the same section,
# m ~ L, I ~ L^3, its centre of mass moving along; "as Appendix B", both kept, and slender rods for the distal
# links, whose inertia is m L^2/12.
LAWS = ("kept", "grown", "as Appendix B")


def with_base_distance(distance: np.ndarray) -> Device:
    """Base joints d apart, (P,) [m]: the right arm's at x = d/2, the left arm's at -d/2."""
    d = np.atleast_1d(np.asarray(distance, float))
    links = device.mechanism.links
    origin = np.repeat(links.origin[None], len(d), axis=0)
    origin[:, RIGHT, 0], origin[:, LEFT, 0] = d / 2.0, -d / 2.0
    judge = replace(bundled(), base=(d / 2.0, -d / 2.0))
    mechanism = replace(
        device.mechanism, links=replace(links, origin=origin), assemblies=_assembly_angles(judge, len(d))
    )
    return replace(device, mechanism=mechanism)


def with_lengths(right: np.ndarray, left: np.ndarray, law: str = "kept") -> Device:
    """Driven arms of other lengths, both (P,) [m]."""
    right, left = np.broadcast_arrays(np.atleast_1d(right), np.atleast_1d(left))
    links, count = device.mechanism.links, len(right)
    numbers = {
        name: np.repeat(getattr(links, name)[None], count, axis=0)
        for name in ("origin", "tip", "mass", "center_of_mass", "inertia")
    }
    for arm, child, length in ((RIGHT, DISTAL_RIGHT, right), (LEFT, DISTAL_LEFT, left)):
        share = length / LENGTH
        numbers["tip"][:, arm, 0] = numbers["origin"][:, child, 0] = length
        if law == "grown":
            numbers["mass"][:, arm] *= share
            numbers["center_of_mass"][:, arm] *= share[:, None]
            numbers["inertia"][:, arm] *= share[:, None, None] ** 3
    if law == "as Appendix B":
        for rod in (DISTAL_RIGHT, DISTAL_LEFT):
            inertia = numbers["mass"][:, rod] * numbers["tip"][:, rod, 0] ** 2 / 12.0
            numbers["inertia"][:, rod] = inertia[:, None, None] * np.eye(3)
    mechanism = replace(
        device.mechanism,
        links=replace(links, **numbers),
        assemblies=_assembly_angles(replace(bundled(), driven_length=(right, left)), count),
    )
    return replace(device, mechanism=mechanism)


def operating_points(
    designs: Device, assembly: str, model: str = "full", position: tuple[float, float] = REFERENCE
) -> OperatingPoint:
    """All designs with their handle at one position."""
    return designs.at(np.array([*position, 0.0]), assembly=assembly, model=model)


def measure_values(name: str, place: OperatingPoint) -> MeasureValues:
    """A measure of the catalogue."""
    return evaluate(find_measure(name), place)


def _assembly_angles(judge, count: int) -> dict[str, np.ndarray]:
    """Joint angles of each assembly at the reference position; out of reach as bundled, where nothing closes."""
    found = {}
    for name in SIDES:
        there = judge.at(REFERENCE, name)
        angles = np.repeat(np.asarray(device.mechanism.assemblies[name])[None], count, axis=0)
        for i, (arm, child) in enumerate(((RIGHT, DISTAL_RIGHT), (LEFT, DISTAL_LEFT))):
            for link, values in ((arm, there.driven_angles[..., i]), (child, there.elbow[..., i])):
                angles[:, link] = np.where(np.isfinite(values), values, angles[:, link])
        found[name] = angles
    return found
