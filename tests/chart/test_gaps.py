"""Gaps of the edge are bridged by a chord where, and only where, roots stay on the circle along it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.systems import mass, published
from zwidth.chart.angle_sampling import sample_angles
from zwidth.chart.arc_finding import find_arcs
from zwidth.chart.arc_joining import bridge_gaps
from zwidth.chart.arcs import CHORD, PLUS
from zwidth.chart.tracer import Tracer
from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop


def tracer_and_edges(loop):
    tracer = Tracer.of(loop)
    return tracer, find_arcs(tracer, sample_angles(tracer.features(), tracer.radius, 0.1, tracer.longest_step))


def without(edges, arc):
    """The edges without one arc, as `bridge_gaps` takes them: corners have numbers."""
    rest = tuple(other for other in edges.arcs if other is not arc)
    ends = np.array([[other.first, other.last] for other in rest]).reshape(-1, 2)
    near = np.max(np.abs(ends[:, None] - ends[None]), axis=2) < 1e-6 * np.max(np.abs(ends))
    left = replace(edges, arcs=rest, extents=(1.0,) * len(rest))
    return left, np.argmax(near, axis=1).reshape(-1, 2), list(range(len(rest)))


@pytest.mark.parametrize(
    "loop", [published(), Loop(mass(0.1, damping=2.0, stiffness=2e4), Controller(0.001))], ids=["free", "grounded"]
)
def test_a_straight_piece_is_put_back(loop):
    tracer, edges = tracer_and_edges(loop)
    (line,) = (arc for arc in edges.arcs if arc.kind == PLUS)
    closed, longest = bridge_gaps(tracer, *without(edges, line))
    chord = closed.arcs[-1]
    assert chord.kind == CHORD
    assert np.array([chord.first, chord.last]) == pytest.approx(np.array([line.first, line.last]), abs=1e-9)
    assert longest == pytest.approx(abs(line.last[1] - line.first[1]) / edges.size)


def test_a_bent_piece_is_not():
    tracer, edges = tracer_and_edges(published())
    bent = max((arc for arc in edges.arcs if arc.curved), key=lambda arc: len(arc.thetas))
    assert bridge_gaps(tracer, *without(edges, bent)) is None


def test_nothing_is_bridged_where_nothing_is_open():
    tracer, edges = tracer_and_edges(published())
    assert bridge_gaps(tracer, *without(edges, None)) is None
