"""Virtual benches of all kinds of measurement, with records as they should be."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

import zwidth
from tests.identify.arm_benches import chain_columns, chain_device, moved_records, random_chains
from tests.identify.boundary_cases import measured
from tests.identify.changed_columns import Columns
from tests.identify.impedance_bench import DOCUMENT, pushed
from tests.identify.modes_bench import quantised, readings
from tests.identify.spring_bench import bench_record
from tests.identify.virtual_joint import Joint, records_of
from zwidth.chart import EdgeChords
from zwidth.device import from_document
from zwidth.model import Plant

PERIOD = 1e-3
STEP = 1e-7  # m, of the benches' encoder
COUNT = 4096
DELAY = "loop.delay_samples"
JOINT = Joint(
    mass=0.12, damping=0.8, coulomb=0.5, bias=0.12, stiffness=0.0, step=2e-5, noise=1e-6, period=PERIOD,
    delay=1.4, samples=1500,
    tones=np.array([[2.0, 12.0, 0.3], [1.2, 31.0, 1.1], [0.8, 57.0, 2.0], [0.0, 1.0, 0.0]]),
)  # fmt: skip


@cache
def strokes(seed: int = 1, **more: Any) -> Columns:
    """A drive of 0.45 and 0.35 N m/rad with 3 mN m of friction, drawn to both sides by its motor."""
    spring = {"forward": 0.45, "backward": 0.35, "friction": 0.003, "amplitude": 0.045}
    return bench_record(seed, **spring | more)


@cache
def driven(seed: int = 0) -> Columns:
    """A joint of 0.12 kg with 0.5 N of dry friction and 0.8 N s/m, driven by three tones."""
    return records_of([JOINT if not seed else replace(JOINT, tones=JOINT.tones[::-1], seed=seed)])[0]


@cache
def two_masses() -> zwidth.Device:
    """The device of the sweeps and of the boundary: 0.12 and 0.05 kg on a spring of 9000 N/m, 1 kHz."""
    return from_document(tomllib.loads(DOCUMENT), "bench")


@cache
def shaken(seed: int = 0, *, noise: float = 0.0, count: int = COUNT, cut: float = 0.0) -> Columns:
    """Two masses under a random force, every sample of the loop, which acts 0.4 samples late.

    noise  of the readings [m];   cut  share of the sampling rate above which the force has nothing
    """
    rng = np.random.default_rng(seed)
    force = rng.normal(size=count)
    if cut:
        force = 5.0 * _low_pass(force, cut)
    position = readings(two_masses().given_plant, PERIOD, force, 0.4) + (noise + STEP) * rng.normal(size=count)
    return {"time_s": PERIOD * np.arange(count), "force_N": force, "position_m": quantised(position, STEP)}


def _low_pass(values, cut):
    spectrum = np.fft.rfft(values)
    spectrum[int(cut * len(values)) :] *= 1e-3
    return np.fft.irfft(spectrum, len(values))


@cache
def three_masses(count: int = 2500) -> Columns:
    """Three masses in a row, with two resonances, where the file knows one."""
    m = np.diag([0.05, 0.06, 0.03])
    link, second = np.zeros((3, 3)), np.zeros((3, 3))
    link[:2, :2] = second[1:, 1:] = [[1.0, -1.0], [-1.0, 1.0]]
    ends = np.eye(3)
    plant = Plant(m, 1.0 * link + 2.0 * second, 4e4 * link + 4e4 * second, ends[0], ends[0], handle=ends[2])
    rng = np.random.default_rng(3)
    force = rng.normal(size=count)
    position = readings(plant, PERIOD, force, 0.4) + 20.0 * STEP * rng.normal(size=count)
    return {"time_s": PERIOD * np.arange(count), "force_N": force, "position_m": quantised(position, STEP)}


@cache
def felt() -> Columns:
    """The handle of the same device, pushed by a hand for 8 s, without a wall."""
    return pushed(np.random.default_rng(5), two_masses(), seconds=8.0, resolution=1e-7, force_noise=1e-3)


@cache
def arm() -> tuple[zwidth.Device, Columns]:
    """A planar arm of two links that a computer moves for 12 s, and its device file with other masses."""
    rng = np.random.default_rng(11)
    chains = random_chains(rng, 2, 1)
    return chain_device(chains, 0, wrong=1.3), chain_columns(*moved_records(chains, rng, duration=12.0), 0)


@cache
def swept() -> Columns:
    """Two masses under one sweep from 0 to 490 Hz."""
    t = np.arange(2 * COUNT)
    force = np.sin(0.98 * np.pi * t**2 / (4 * COUNT))
    noise = STEP * np.random.default_rng(0).normal(size=len(t))
    position = readings(two_masses().given_plant, PERIOD, force, 0.4) + noise
    return {"time_s": t * PERIOD, "force_N": force, "position_m": position}


@cache
def edge(period: float = PERIOD) -> Columns:
    """The boundary of the two masses with a scatter of half a per cent, at a sampling period [s]."""
    device = two_masses().with_({DELAY: 0.4, "loop.sampling_period_s": period})
    chords = EdgeChords.of(device.at().chart(decay=False))
    return measured(np.random.default_rng(2), chords, scatter=0.005)
