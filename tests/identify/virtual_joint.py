"""Virtual benches of one joint: the contact simulation of a mass with friction, counts, noise and delay."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from zwidth.contact import Parameter, Run, simulate_batch
from zwidth.contact.environments import environment
from zwidth.loop import Controller, Loop
from zwidth.model import Counter, Friction, Nonlinear, Plant

TONES = 4


@environment(
    [Parameter(f"{name}_{i}", default=0.0) for i in range(TONES) for name in ("size", "rate", "phase")]
    + [Parameter("bias", "N", 0.0), Parameter("steps", default=0.0)]
)
def drive(position, velocity, time, period, parameters, memory):
    """Sum of tones and a constant force; with `steps`, only the sign of the sum counts, times the first size."""
    total = 0.0
    for i in range(4):
        total += parameters[3 * i] * np.sin(parameters[3 * i + 1] * time + parameters[3 * i + 2])
    if parameters[13] > 0.0:
        total = parameters[0] if total > 0.0 else -parameters[0]
    return total + parameters[12]


@dataclass(frozen=True)
class Joint:
    """A joint and what is done to it, in SI units.

    bias   constant force that nobody records, such as gravity's
    tones  (4, 3) size [N], angular frequency [rad/s] and phase of the force;  steps: of a square wave's sign
    start  velocity at the first sample [m/s]; place [m]
    """

    mass: float
    damping: float
    coulomb: float
    bias: float
    stiffness: float
    step: float
    noise: float
    period: float
    delay: float
    samples: int
    tones: np.ndarray = field(default_factory=lambda: np.zeros((4, 3)))
    steps: bool = False
    start: float = 0.0
    place: float = 0.0
    seed: int = 0

    @property
    def run(self) -> Run:
        one = np.ones(1)
        friction = (Friction(one, self.coulomb),) if self.coulomb > 0.0 else ()
        counters = (Counter(one, self.step, noise=self.noise),)
        parts = Nonlinear(friction=friction, counters=counters)
        square = one[:, None]
        plant = Plant(
            self.mass * square,
            self.damping * square,
            self.stiffness * square,
            one,
            one,
            handle=one,
            nonlinear=parts,
        )
        values = np.append(self.tones.ravel(), [self.bias, float(self.steps)])
        return Run(
            Loop(plant, Controller(self.period, delay=self.delay)),
            values,
            start_position=self.place,
            start_velocity=self.start,
            seed=self.seed,
        )


def records_of(joints, substeps=20):
    """Columns time_s, position_m and force_N of each joint; the recorded force lacks the bias."""
    responses = simulate_batch(
        [joint.run for joint in joints],
        drive,
        duration=[(joint.samples - 1) * joint.period for joint in joints],
        substeps=substeps,
    )
    return [
        {"time_s": seen.time, "position_m": seen.reading, "force_N": seen.force - joint.bias}
        for joint, seen in zip(joints, responses, strict=True)
    ]


def random_joint(seed, samples=4000):
    """A joint of any size: masses over four decades, from free to overdamped, from smooth to stuck for long.

    Everything is drawn from ratios: of the force's periods and of the mass's time constant to the sampling, of
    friction to force, of motion to counts.
    """
    rng = np.random.default_rng(seed)

    def span(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    mass, period = span(1e-3, 10.0), span(5e-5, 5e-3)
    rate = 2.0 * np.pi / (span(40.0, 400.0) * period)  # of the slowest tone
    damping = span(0.01, 5.0) * mass * rate
    size = mass * rate**2 * span(1e-3, 0.1)
    tones = np.array(
        [
            [size * rng.uniform(0.3, 1.0), rate * factor, rng.uniform(0.0, 2.0 * np.pi)]
            for factor in (1.0, 1.7, 2.9, 4.3)
        ]
    )
    peak = float(np.sum(tones[:, 0]))
    coulomb = 0.0 if rng.random() < 0.1 else span(0.003, 0.6) * peak
    spring = mass * rate**2 * span(0.03, 3.0) if rng.random() < 0.3 else 0.0
    bias = rng.uniform(-0.3, 0.3) * min(coulomb, 0.3 * peak)
    travel = peak / (mass * rate**2 + damping * rate + spring)
    return Joint(
        mass,
        damping,
        coulomb,
        bias,
        spring,
        step=travel / span(20.0, 5000.0),
        noise=travel / span(300.0, 1e5),
        period=period,
        delay=rng.uniform(0.0, 3.0),
        samples=samples,
        tones=tones,
        steps=bool(rng.random() < 0.3),
        seed=seed,
    )
