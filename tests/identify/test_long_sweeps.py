"""Sweeps that are read block by block give what they give at once."""

from importlib import import_module

import numpy as np
import pytest

from tests.identify.modes_bench import columns, readings
from zwidth.device.load import load
from zwidth.identify import SweepBlocks, identify
from zwidth.identify.records.record import ArrayRecord
from zwidth.identify.response.identify import SweepRange
from zwidth.model import sweep_response_of_blocks

PERIOD = 2e-3


@pytest.fixture(scope="module")
def device():
    damping = [[15.0, -15.0], [-15.0, 35.0]]
    settings = {"plant.stiffness_N_per_m.1.1": 22_000.0, "plant.damping_Ns_per_m": damping}
    return load("published-two-mass", {"loop.sampling_period_s": PERIOD} | settings)


@pytest.fixture(scope="module")
def bench(device):
    rng = np.random.default_rng(5)
    force = rng.normal(size=60_000)
    position = readings(device.at().plant, PERIOD, force, 0.0) + 1e-7 * rng.normal(size=len(force))
    return columns(force, position, PERIOD)


class ShortPieces(ArrayRecord):
    """A record that comes in pieces of a few rows, whatever is wished for."""

    rows = 777

    def pieces(self, rows=0):
        return super().pieces(self.rows)


def test_the_response_is_the_same_however_the_record_is_cut(bench):
    found, used = [], bench["force_N"][1000:59_000]
    for kind in (ArrayRecord, ShortPieces):
        sweep = SweepBlocks(kind(bench, "bench"), "force_N", "position_m", 1000, 59_000)
        found.append(sweep_response_of_blocks(sweep.blocks(1 << 14), PERIOD))
        assert SweepRange.of(sweep, 100).force == (used.min(), used.max())
    assert np.array_equal(found[0].value, found[1].value)
    assert np.array_equal(found[0].coherence, found[1].coherence)


def test_a_sweep_that_is_read_in_blocks_has_the_stiffness_within_its_interval(monkeypatch, device, bench):
    monkeypatch.setattr(import_module("zwidth.model.raw_sweep"), "BLOCK", 1 << 14)
    steps = []
    found = identify(device, "response", bench, progress=lambda stage, done, of: steps.append((stage, done, of)))
    (one,) = found.estimates
    assert one.low < device.chart(decay=False).stiffness_max < one.high
    assert found.validation > 0.99
    assert steps == [("transforming sweep 1", 0, 2), ("transforming sweep 1", 1, 2)]


def test_a_stretch_is_read_in_blocks_and_its_range_told():
    force = np.array([0.0, 1, 2, 3, 3, 2, 1, -1, -1, -1])
    record = ShortPieces({"f": force, "x": np.arange(10.0)}, "bench")
    record.rows = 3
    sweep = SweepBlocks(record, "f", "x", 1, 9)
    blocks = [(f.tolist(), x.tolist()) for f, x in sweep.blocks(3)]
    assert blocks == [([1, 2, 3], [1, 2, 3]), ([3, 2, 1], [4, 5, 6])]
    assert len(sweep.part(2, 5)) == 3
    assert [values[0].tolist() for values in sweep.part(2, 5).pieces()] == [[3, 3, 2]]
    seen = SweepRange.of(sweep, 4)
    assert (seen.force, seen.position) == ((-1.0, 3.0), (1.0, 8.0))
    assert (seen.at_largest, seen.at_smallest, seen.levels) == (2, 2, 3)
