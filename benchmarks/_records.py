"""Records of measurements as long as one likes: a stretch that is made once and repeated, in memory or as CSV.

Each stretch is periodic, so that it goes on smoothly where it begins anew. Its noise repeats too: the records are
for timing, not for judging the numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks._identify import RATE
from tests.identify.arm_benches import Chains, chain_device, random_chains
from tests.identify.spring_bench import bench_record
from tests.identify.virtual_joint import Joint, records_of
from zwidth.device.device import Device
from zwidth.device.load import load

STRETCH_S = 20
SECONDS_DIGITS = 5

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Bench:
    """A device and what is recorded of it.

    device   loads or makes it
    stretch  makes the columns of the stretch, without its time
    options  of `identify`
    timed    whether the record has a column time_s
    """

    device: Callable[[], Device]
    stretch: Callable[[], Columns]
    options: Mapping[str, object] = field(default_factory=dict)
    timed: bool = True


def spring() -> Columns:
    """A blocked drive, bent up and down."""
    return bench_record(
        0,
        amplitude=0.045,
        cycles=4,
        count=STRETCH_S * RATE,
        forward=0.45,
        backward=0.35,
        torque_noise=2e-4,
        angle_noise=3e-4,
    )


def joint() -> Columns:
    """A mass with friction under four tones; the second of two stretches, of which the first settles."""
    rate = 2.0 * np.pi / STRETCH_S
    tones = np.array([[0.3, 20 * rate, 0.1], [0.3, 34 * rate, 1.0], [0.4, 53 * rate, 2.0], [0.2, 97 * rate, 3.0]])
    count = STRETCH_S * RATE
    moving = Joint(
        mass=0.05,
        damping=0.8,
        coulomb=0.15,
        bias=0.0,
        stiffness=0.0,
        step=1e-5,
        noise=2e-6,
        period=1.0 / RATE,
        delay=1.0,
        samples=2 * count,
        tones=tones,
    )
    (columns,) = records_of([moving], substeps=1)
    last = {name: columns[name][count:] for name in ("position_m", "force_N")}
    # what it creeps by in a stretch would be a jump at each new beginning
    drift = np.linspace(0.0, columns["position_m"][-1] - columns["position_m"][count - 1], count)
    last["position_m"] = moving.step * np.round((last["position_m"] - drift) / moving.step)
    return last


def handle() -> Columns:
    """A handle that a random force pushes: the plant's response at each frequency, and noise."""
    plant, rng, count = load("published-two-mass").at().plant, np.random.default_rng(1), STRETCH_S * RATE
    f = np.fft.rfftfreq(count, 1.0 / RATE)
    force = np.fft.rfft(rng.normal(size=count)) * ((f > 0.2) & (f < 0.2 * RATE))
    s = 2j * np.pi * np.where(f > 0.0, f, 1.0)[:, None, None]
    stiffness = s**2 * plant.mass + s * plant.damping + plant.stiffness
    motion = np.linalg.solve(stiffness, np.broadcast_to(plant.handle, (len(f), plant.size))[..., None])[..., 0]
    position = np.fft.irfft(force * (motion @ plant.handle), count) + 1e-8 * rng.normal(size=count)
    push = np.fft.irfft(force, count) + 1e-3 * rng.normal(size=count)
    return {"handle_force_N": push, "handle_position_m": position}


def arm() -> Device:
    """An arm of two links."""
    return chain_device(_chains(), 0, period=1.0 / RATE)


def _chains() -> Chains:
    return random_chains(np.random.default_rng(1), 2, 1)


def chain() -> Columns:
    """The arm on tones, its angles as counted, torques with noise."""
    rng, count, chains = np.random.default_rng(2), STRETCH_S * RATE, _chains()
    t = np.arange(count)[:, None] / RATE
    q, v, a = (np.zeros((count, 2)) for _ in range(3))
    for turns in range(5, 105, 14):
        w, phase = 2.0 * np.pi * (turns + np.array([0, 3])) / STRETCH_S, rng.uniform(0.0, 2.0 * np.pi, 2)
        size = 0.4 / (1.0 + (turns / (1.5 * STRETCH_S)) ** 2)
        q += size * np.sin(w * t + phase)
        v += size * w * np.cos(w * t + phase)
        a -= size * w**2 * np.sin(w * t + phase)
    q += [0.4, 1.2]
    many = Chains(*(np.broadcast_to(getattr(chains, name), (count, 2)) for name in CHAIN), chains.gravity)
    torques = many.torques(q, v, a)
    torques += 0.01 * np.std(torques, axis=0) * rng.normal(size=torques.shape)
    step = 2.0 * np.pi / 8000
    columns = {f"angle_rad.link-{i + 1}": step * np.round(q[:, i] / step) for i in range(2)}
    columns |= {f"torque_Nm.link-{i + 1}": torques[:, i] for i in range(2)}
    return columns


CHAIN = ("length", "mass", "center", "inertia", "rotor", "coulomb", "viscous")
JOINT = Bench(partial(load, "hapkit-course"), joint)
BENCHES: Mapping[str, Bench] = {
    "stiffness": Bench(partial(load, "five-bar"), spring, {"joint": "motor-right"}, timed=False),
    "friction": JOINT,
    "mass": JOINT,
    "impedance": Bench(partial(load, "published-two-mass"), handle),
    "arm": Bench(arm, chain),
}


def columns_of(bench: Bench, seconds: int) -> Columns:
    """The record in memory, so many seconds of it."""
    columns = {name: np.resize(values, seconds * RATE) for name, values in bench.stretch().items()}
    return ({"time_s": np.arange(seconds * RATE) / RATE} if bench.timed else {}) | columns


def write_csv(path: Path, bench: Bench, seconds: int) -> None:
    """Write the record, so many seconds of it, second by second: cells of fixed width, of which only those of the
    time change from stretch to stretch."""
    count, columns = STRETCH_S * RATE, bench.stretch()
    cells = list[np.ndarray]()
    if bench.timed:
        fractions = [f"{'0' * SECONDS_DIGITS}.{k:04d}" for k in range(RATE)] * STRETCH_S
        cells.append(_letters(fractions))
    cells += [_letters([f"{value:+.8e}" for value in values.tolist()]) for values in columns.values()]
    comma, end = np.full((count, 1), ord(","), np.uint8), np.full((count, 1), ord("\n"), np.uint8)
    between = [part for one in cells for part in (one, comma)][:-1]
    lines = np.hstack([*between, end]).reshape(STRETCH_S, RATE, -1)
    with open(path, "wb") as file:
        file.write((",".join([*(["time_s"] if bench.timed else []), *columns]) + "\n").encode())
        for second in range(seconds):
            part = lines[second % STRETCH_S]
            if bench.timed:
                part[:, :SECONDS_DIGITS] = np.frombuffer(f"{second:0{SECONDS_DIGITS}d}".encode(), np.uint8)
            file.write(part.tobytes())


def _letters(words: list[str]) -> np.ndarray:
    """Words of one length as bytes (n, length)."""
    return np.frombuffer("".join(words).encode(), np.uint8).reshape(len(words), -1)
