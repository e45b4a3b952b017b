"""Mechanisms of joints and nonlinear rods, bent as far as may be: a judge of second derivatives.

Each beam is a chain of many small rotations (`rods`) whose strains are those of its finite elements; joints turn
and slide by any amount, and nothing is linear.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from tests.model.rods import Rod
from zwidth.model import PRISMATIC, REVOLUTE, finite_elements

NODES = 2  # elements of each beam
STEPS = 320


def with_bodies(mechanism, bodies):
    """The mechanism with other bodies for its beams."""
    pairs = zip(mechanism.flexible, bodies, strict=True)
    return replace(mechanism, flexible=tuple(replace(each, body=body) for each, body in pairs))


def with_elements(mechanism):
    """The mechanism with beams whose coordinates are the motions of stations and nodes."""
    return with_bodies(
        mechanism, [finite_elements(each.beam, each.body.stations, NODES) for each in mechanism.flexible]
    )


def nodes_of(beam):
    """Nodes of its elements, and the order in which these are coordinates: stations first."""
    L, stations = beam.beam.length, beam.body.stations
    held = [s for s in stations if s > 0.0]
    edges, parts = sorted({0.0, L, *held}), []
    for start, end in pairwise(edges):
        count = int(np.ceil((end - start) / (L / NODES) * (1.0 - 1e-9)))
        parts += [start + (end - start) * i / count for i in range(count)]
    nodes = np.array([*parts, L])
    own = [int(np.argmin(np.abs(nodes - s))) for s in held]
    return nodes, own + [i for i in range(1, len(nodes)) if i not in own]


def rod_of(beam, eps):
    """The rod of a beam's coordinates; its steps end at all stations to a third of a step at the worst."""
    nodes, order = nodes_of(beam)
    L, n = beam.beam.length, len(nodes)
    of_nodes = np.zeros((n, 6))
    of_nodes[order] = eps[: 6 * (n - 1)].reshape(-1, 6)
    along, y, z, twist, turn_y, turn_z = of_nodes.T
    places = (np.arange(STEPS) + 0.5) * L / STEPS
    element = np.clip(np.searchsorted(nodes, places) - 1, 0, n - 2)
    h = np.diff(nodes)[element]
    x = (places - nodes[element]) / h
    stretch, turning = (
        (np.diff(ends)[element] + middle[element] * (4.0 - 8.0 * x)) / h
        for ends, middle in zip((along, twist), eps[6 * (n - 1) :].reshape(-1, 2).T, strict=True)
    )
    curvature = [
        turning,
        -CubicHermiteSpline(nodes, z, -turn_y)(places, 2),
        CubicHermiteSpline(nodes, y, turn_z)(places, 2),
    ]
    return Rod(L, np.stack(curvature, axis=1), stretch)


class Chain:
    """A mechanism in any posture, its beams bent as far as may be."""

    def __init__(self, mechanism, motions):
        self.mechanism, self.motions = mechanism, motions
        self.beams = {each.link: each for each in mechanism.flexible}

    def placed(self, angles, elastic):
        """Place and axes of each link, and the rods of those that bend."""
        links, frames, rods = self.mechanism.links, {-1: (np.zeros(3), np.eye(3))}, {}
        for i, parent in enumerate(links.parent):
            rods |= {i: rod_of(self.beams[i], elastic[self.motions.elastic[i]])} if i in self.beams else {}
            o, R = self.fixed(frames, rods, int(parent), links.origin[i])
            R = R @ links.rotation[i]
            if links.joint[i] == REVOLUTE:
                R = R @ Rotation.from_rotvec(angles[i] * links.axis[i]).as_matrix()
            elif links.joint[i] == PRISMATIC:
                o = o + R @ links.axis[i] * angles[i]
            frames[i] = o, R
        return frames, rods

    def fixed(self, frames, rods, link_, local):
        """Place and axes of what is fixed to a link at a place of its frame."""
        o, R = frames[link_]
        if link_ not in rods:
            return o + R @ local, R
        beam, rod = self.beams[link_], rods[link_]
        at = float(beam.body.stations[beam.station_of(local)])
        step = round(at / beam.beam.length * STEPS)
        assert abs(step * beam.beam.length / STEPS - at) < 1e-12, "stations are at whole steps"
        turn = R @ rod.turns[step]
        return o + R @ rod.places[step] + turn @ (local - [at, 0.0, 0.0]), turn

    def after(self, angles, p, t, second=1.0):
        """Handle's place (3,) and axes (3, 3), and of each loop by how far its points (3,) and the z axes there
        (3,) are apart, a time t after u' = B p', u'' = p'^T B2 p' [s].

        second  share of B2
        """
        motions, closures = self.motions, self.mechanism.closures
        u = t * (motions.rates @ p) + 0.5 * second * t**2 * np.einsum("ust,s,t->u", motions.rates_2, p, p)
        count, moved = len(motions.unknowns), angles.copy()
        moved[motions.unknowns] += u[:count]
        frames, rods = self.placed(moved, u[count:])
        place, axes = self.fixed(frames, rods, self.mechanism.handle_link, self.mechanism.handle_point)
        gaps = [np.zeros(0)]
        for a, b, at_a, at_b in zip(closures.a, closures.b, closures.point_a, closures.point_b, strict=True):
            (one, turn), (other, turned) = (
                self.fixed(frames, rods, int(link), at) for link, at in ((a, at_a), (b, at_b))
            )
            gaps += [one - other] + ([] if closures.kind is None else [turn[:, 2] - turned[:, 2]])
        return place, axes, np.concatenate(gaps)
