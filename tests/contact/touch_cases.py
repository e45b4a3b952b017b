"""Random loops that the contact kernel covers, over all that devices are."""

import numpy as np

from zwidth.contact import OUTPUTS, touch_periods
from zwidth.contact.touch_step import touch_numbers
from zwidth.loop import Butterworth, Controller, FirstOrder, LeastSquaresSlope, Loop
from zwidth.model import Counter, Friction, Nonlinear, Operator, Plant


def random_loop(rng, frictions):
    """One to four modes from 1 Hz to three times Nyquist, damping to 150 %, 0.2 to 20 kHz."""
    n, T = int(rng.integers(1, 5)), 1.0 / np.exp(rng.uniform(np.log(200.0), np.log(20000.0)))
    L = np.diag(np.exp(rng.uniform(-3.0, 0.0, n))) + 0.1 * np.tril(rng.normal(size=(n, n)), -1)
    V = np.linalg.qr(rng.normal(size=(n, n)))[0]
    w = 2.0 * np.pi * np.exp(rng.uniform(0.0, np.log(1.5 / T), n))
    w[0] *= rng.integers(0, 2)
    mass, stiffness = L @ L.T, L @ V @ np.diag(w**2) @ V.T @ L.T
    damping = L @ V @ np.diag(2.0 * rng.uniform(0.0, 1.5, n) * w) @ V.T @ L.T
    along, sensor = np.linalg.qr(rng.normal(size=(n, n)))[0], np.zeros(n)
    counters = []
    for row in along[: rng.integers(1, 3)]:
        weight, step = rng.uniform(0.3, 1.0), 10.0 ** rng.uniform(-7.0, -4.0) * rng.integers(0, 2)
        counters.append(Counter(row, step, weight, noise=step * 0.3 * rng.integers(0, 2)))
        sensor += weight * row
    own = Nonlinear(
        tuple(Friction(rng.normal(size=n), rng.uniform(0.01, 0.5)) for _ in range(frictions)),
        tuple(counters),
        force_limit=rng.choice([np.inf, 5.0]),
    )
    plant = Plant(mass, damping, stiffness, sensor, sensor, sensor, nonlinear=own)
    filters = [None, FirstOrder(3.0 * T), Butterworth(2, 0.1 / T), Butterworth(3, 0.2 / T)]
    controller = Controller(
        T,
        delay=float(rng.choice([0.0, 1.0, rng.uniform(0.0, 4.0)])),
        velocity_filter=filters[rng.integers(4)],
        force_filter=filters[rng.integers(4)],
        actuator_time_constant=float(rng.choice([0.0, 2.0 * T])),
        **({"velocity": LeastSquaresSlope(5)} if rng.integers(2) else {}),
    )
    return Loop(plant, controller)


def random_operator(rng):
    """Nobody, a rigid grasp without an arm's mass, or an elastic grasp."""
    held = [None, Operator(0.0, 200.0, 2.0), Operator(0.5, 300.0, 5.0, 2000.0, 10.0)]
    return held[rng.integers(3)]


def random_touch(rng, frictions, noise=True):
    """A loop, an operator, its blocks with filled ports, and drawn noise (S C,) of 400 periods."""
    loop, operator = random_loop(rng, frictions), random_operator(rng)
    start = float(rng.uniform(-2e-3, 2e-3))
    device = touch_numbers(loop, operator, start_position=start, start_velocity=0.05, substeps=12)
    ports = device.empty_ports
    ports[:5] = rng.integers(0, 3), rng.uniform(10.0, 2000.0), rng.uniform(0.0, 3.0), 2e-4, rng.uniform(-2.0, 2.0)
    ports[5] = ports[4]
    drawn = rng.normal(size=(400, len(device.noise))) * device.noise * noise
    return loop, operator, start, device, ports, drawn.ravel()


def in_python(device, ports, drawn, periods):
    """Outputs (S, OUTPUTS) and memory after several periods."""
    outputs, memory = np.zeros(periods * OUTPUTS), device.memory.copy()
    touch_periods(device.counts, device.numbers, memory, ports, drawn, outputs, periods)
    return outputs.reshape(periods, OUTPUTS), memory


def same_bits(a, b):
    """Equal to the bit, nan being nan."""
    a, b = np.ascontiguousarray(a), np.ascontiguousarray(b)
    return np.all((a.view(np.int64) == b.view(np.int64)) | (np.isnan(a) & np.isnan(b)))
