"""Gaps of the edge are bridged by a chord where, and only where, roots stay on the circle along it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.systems import mass, published
from zwidth.chart import Tracer
from zwidth.chart.arcs import CHORD, PAIR, PLUS
from zwidth.chart.edge_arcs import SAME_CORNER
from zwidth.chart.edge_by_eigenvalues import MOST_SAMPLES, bridge_gaps, find_arcs, join
from zwidth.chart.edge_memory import ARCS, edge_memory
from zwidth.loop import Controller, Loop


def tracer_and_memory(loop):
    tracer = Tracer(loop)
    memory = edge_memory(tracer.table, tracer.degree, MOST_SAMPLES)
    find_arcs(tracer, memory, 0.1, np.empty(0))
    assert join(tracer, memory, SAME_CORNER)
    return tracer, memory


def take_out(tracer, memory, k):
    """Leave the edge without one arc; its walls."""
    arcs, n = memory.arcs, int(memory.counts[ARCS])
    walls = arcs.first[k].copy(), arcs.last[k].copy()
    for array in (arcs.kind, arcs.first, arcs.last, arcs.start, arcs.end, arcs.samples):
        array[k : n - 1] = array[k + 1 : n].copy()
    memory.counts[ARCS] = n - 1
    assert not join(tracer, memory, SAME_CORNER)
    return walls


@pytest.mark.parametrize(
    "loop", [published(), Loop(mass(0.1, damping=2.0, stiffness=2e4), Controller(0.001))], ids=["free", "grounded"]
)
def test_a_straight_piece_is_put_back(loop):
    tracer, memory = tracer_and_memory(loop)
    kinds = memory.arcs.kind[: memory.counts[ARCS]]
    (k,) = np.flatnonzero((kinds == PLUS) & (memory.arcs.next_arc[: len(kinds)] >= 0))
    first, last = take_out(tracer, memory, k)
    longest = bridge_gaps(tracer, memory)
    chord = int(memory.counts[ARCS]) - 1
    assert memory.arcs.kind[chord] == CHORD
    assert memory.arcs.first[chord] == pytest.approx(first, abs=1e-9)
    assert memory.arcs.last[chord] == pytest.approx(last, abs=1e-9)
    assert longest == pytest.approx(abs(last[1] - first[1]) / memory.size[0])
    assert join(tracer, memory, SAME_CORNER)


def test_a_bent_piece_is_not():
    tracer, memory = tracer_and_memory(published())
    lengths = np.ptp(memory.arcs.samples[: memory.counts[ARCS]], axis=1)
    k = int(np.argmax(np.where(memory.arcs.kind[: memory.counts[ARCS]] == PAIR, lengths, -1)))
    take_out(tracer, memory, k)
    assert bridge_gaps(tracer, memory) is None


def test_nothing_is_bridged_where_nothing_is_open():
    tracer, memory = tracer_and_memory(published())
    assert bridge_gaps(tracer, memory) is None
