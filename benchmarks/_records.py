"""Records of measurements as long as one likes, stretch by stretch, in memory or as CSV.

Where a stretch is made once and repeated it is periodic, so that it goes on smoothly where it begins anew. Its
noise repeats too: those records are for timing, not for judging the numbers. Records whose spectra are fitted line
by line go on without repeating.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import repeat
from pathlib import Path

import numpy as np

from benchmarks._identify import RATE
from tests.identify.arm_benches import Chains, chain_device, random_chains
from tests.identify.spring_bench import bench_record
from tests.identify.virtual_joint import Joint, records_of
from zwidth.device import Device
from zwidth.device.load import load

STRETCH_S = 20
SECONDS_DIGITS = 5

Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Bench:
    """A device and what is recorded of it.

    device     loads or makes it
    stretches  makes the columns of one stretch after the other, without their time
    options    of `identify`
    timed      whether the record has a column time_s
    """

    device: Callable[[], Device]
    stretches: Callable[[], Iterator[Columns]]
    options: Mapping[str, object] = field(default_factory=dict)
    timed: bool = True


def repeated(stretch: Callable[[], Columns]) -> Callable[[], Iterator[Columns]]:
    """The same stretch again and again."""
    return lambda: repeat(stretch())


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


def chain() -> Iterator[Columns]:
    """The arm on tones that do not repeat, its angles as counted, torques with noise."""
    rng, count, chains = np.random.default_rng(2), STRETCH_S * RATE, _chains()
    many = Chains(*(np.broadcast_to(getattr(chains, name), (count, 2)) for name in CHAIN), chains.gravity)
    w = 2.0 * np.pi * np.array([[0.23, 0.41], [0.83, 1.09], [1.7, 1.93], [2.9, 2.45], [4.1, 3.7]])
    size, phase = 0.4 / (1.0 + (w / (2.0 * np.pi * 1.5)) ** 2), rng.uniform(0.0, 2.0 * np.pi, w.shape)
    step = 2.0 * np.pi / 8000
    for number in itertools.count():
        t = (number * count + np.arange(count))[:, None, None] / RATE
        angle = w * t + phase
        q = np.array([0.4, 1.2]) + np.sum(size * np.sin(angle), axis=1)
        torques = many.torques(
            q, np.sum(size * w * np.cos(angle), axis=1), -np.sum(size * w**2 * np.sin(angle), axis=1)
        )
        torques += 0.01 * np.std(torques, axis=0) * rng.normal(size=torques.shape)
        columns = {f"angle_rad.link-{i + 1}": step * np.round(q[:, i] / step) for i in range(2)}
        yield columns | {f"torque_Nm.link-{i + 1}": torques[:, i] for i in range(2)}


def two_masses() -> Device:
    """Two masses that a soft, damped spring holds to the ground, sampled at `RATE`."""
    damping = [[1.8744, -1.8744], [-1.8744, 13.8744]]
    stiffness = [[15620.0, -15620.0], [-15620.0, 19620.0]]
    settings = {"plant.damping_Ns_per_m": damping, "plant.stiffness_N_per_m": stiffness}
    return load("published-two-mass", settings | {"loop.sampling_period_s": 1.0 / RATE})


def pushed() -> Iterator[Columns]:
    """The two masses under a random force that is held for each sample: their modes, one by one, and noise."""
    from scipy.signal import cont2discrete, lfilter

    plant, rng, count = two_masses().at().plant, np.random.default_rng(3), STRETCH_S * RATE
    inverse, n = np.linalg.inv(plant.mass), plant.size
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ plant.stiffness, -inverse @ plant.damping]])
    B = np.concatenate([np.zeros(n), inverse @ plant.actuator])[:, None]
    C = np.concatenate([plant.sensor, np.zeros(n)])[None]
    Ad, Bd, *_ = cont2discrete((A, B, C, np.zeros((1, 1))), 1.0 / RATE)
    poles, vectors = np.linalg.eig(Ad)
    gains = (C @ vectors)[0] * np.linalg.solve(vectors, Bd.astype(complex))[:, 0]
    state = np.zeros((len(poles), 1), dtype=complex)
    while True:
        force, position = rng.normal(size=count), 1e-8 * rng.normal(size=count)
        for k, (pole, gain) in enumerate(zip(poles, gains, strict=True)):
            moved, state[k] = lfilter([0.0, gain], [1.0, -pole], force, zi=state[k])
            position += moved.real
        yield {"force_N": force, "position_m": position}


CHAIN = ("length", "mass", "center", "inertia", "rotor", "coulomb", "viscous")
JOINT = Bench(partial(load, "hapkit-course"), repeated(joint))
PUSHED = Bench(two_masses, pushed)
BENCHES: Mapping[str, Bench] = {
    "stiffness": Bench(partial(load, "five-bar"), repeated(spring), {"joint": "motor-right"}, timed=False),
    "friction": JOINT,
    "mass": JOINT,
    "impedance": Bench(partial(load, "published-two-mass"), repeated(handle)),
    "arm": Bench(arm, chain),
    "response": PUSHED,
    "modes": PUSHED,
}


def columns_of(bench: Bench, seconds: int) -> Columns:
    """The record in memory, so many seconds of it."""
    stretches = list(itertools.islice(bench.stretches(), -(-seconds // STRETCH_S)))
    columns = {name: np.concatenate([one[name] for one in stretches])[: seconds * RATE] for name in stretches[0]}
    return ({"time_s": np.arange(seconds * RATE) / RATE} if bench.timed else {}) | columns


def write_csv(path: Path, bench: Bench, seconds: int) -> None:
    """Write the record, so many seconds of it, second by second, in cells of fixed width."""
    stretches = bench.stretches()
    with open(path, "wb") as file:
        columns: Columns = {}
        for second in range(seconds):
            if second % STRETCH_S == 0:
                before, columns = columns, next(stretches)
                if columns is not before:
                    lines = _lines(columns, bench.timed)
                if not second:
                    names = [*(["time_s"] if bench.timed else []), *columns]
                    file.write((",".join(names) + "\n").encode())
            part = lines[second % STRETCH_S]
            if bench.timed:
                part[:, :SECONDS_DIGITS] = np.frombuffer(f"{second:0{SECONDS_DIGITS}d}".encode(), np.uint8)
            file.write(part.tobytes())


def _lines(columns: Columns, timed: bool) -> np.ndarray:
    """The lines of a stretch (seconds, lines, bytes), the digits of its whole seconds to be filled in."""
    count, cells = STRETCH_S * RATE, list[np.ndarray]()
    if timed:
        cells.append(_letters([f"{'0' * SECONDS_DIGITS}.{k:04d}" for k in range(RATE)] * STRETCH_S))
    cells += [_letters([f"{value:+.8e}" for value in values.tolist()]) for values in columns.values()]
    comma, end = np.full((count, 1), ord(","), np.uint8), np.full((count, 1), ord("\n"), np.uint8)
    between = [part for one in cells for part in (one, comma)][:-1]
    return np.hstack([*between, end]).reshape(STRETCH_S, RATE, -1)


def _letters(words: list[str]) -> np.ndarray:
    """Words of one length as bytes (n, length)."""
    return np.frombuffer("".join(words).encode(), np.uint8).reshape(len(words), -1)
