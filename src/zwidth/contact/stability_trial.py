"""A virtual trial: put up a wall, disturb the device, watch it, and say whether it stays stable.

That is all an experimenter has. Nothing here knows the exact edge of stability.

How long to watch is decided by what is seen. First 1024 samples (four periods of the device's slowest vibration,
half a second where somebody holds it), then four and sixteen times as long, until

    a linear device   has come to rest, or has left its bounds; in the end the sign of its rate decides
    any other         has come to rest, moves less than is visible, dies away with nothing left to break it off,
                      or has left its bounds; in the end whatever still moves visibly and does not die away is
                      unstable
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil, isfinite
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.contact.environments.walls import one_sided_wall, wall
from zwidth.contact.hand import Hand
from zwidth.contact.loop_simulation import SUBSTEPS, Run, simulate_batch
from zwidth.contact.time_response import STEADY, Behaviour, Judgement, TimeResponse, judge_response
from zwidth.errors import ArgumentError
from zwidth.loop.estimators.foaw import Foaw
from zwidth.loop.estimators.levant import Levant
from zwidth.loop.loop import Loop
from zwidth.model.modes import least_deforming_motion, natural_frequencies
from zwidth.model.operator import attach
from zwidth.model.plant import Nonlinear

FIRST_SAMPLES: Final = 1024  # samples at first
LEAST_SAMPLES: Final = 64  # at first, however short the time
PERIODS, MOST_PERIODS = 4.0, 4096  # of the slowest vibration; samples
LEAST_SECONDS_HELD: Final = 0.5  # s; arms are slow, whatever the sampling
LONGER: Final = 4
LEVELS: Final = 3  # how often it is watched, at most
BOUND_FACTOR: Final = 1e3  # times the disturbance
AT_ONCE: Final = 1_500_000  # samples kept at a time


@dataclass(frozen=True)
class StabilityTrial:
    """A virtual experiment: device, disturbance, hand, and what counts as stable.

    loop         the device and its computer, without an operator
    hand         who holds it and pushes
    one_sided    touch a one-sided wall under the hand's push, from its surface; else a two-sided wall
    disturbance  two-sided: the device is displaced by it, undeformed, and let go [m]
    speed        of the handle at the start, towards the inside [m/s]
    visible      amplitude of the handle up to which a vibration that does not die away counts as none [m]
    seed         of the noise
    substeps     between samples, where something is nonlinear
    watch_time   for so long it is watched, and then judged [s]; None: as long as it takes
    Raises       ArgumentError  for numbers that cannot be meant
    """

    loop: Loop
    hand: Hand = field(default_factory=Hand)
    one_sided: bool = False
    disturbance: float = 1e-3
    speed: float = 0.0
    visible: float = 0.0
    seed: int = 0
    substeps: int = SUBSTEPS
    watch_time: float | None = None

    def __post_init__(self) -> None:
        """Raise ArgumentError for numbers that are not allowed, or a push or disturbance that is too small."""
        for name, value in (("disturbance", self.disturbance), ("visible", self.visible), ("speed", self.speed)):
            if not isfinite(value) or (name != "speed" and value < 0.0):
                raise ArgumentError(
                    name, f"must be finite{' and not negative' * (name != 'speed')}, got {value!r}"
                )
        if self.watch_time is not None and not (isfinite(self.watch_time) and self.watch_time > 0.0):
            raise ArgumentError("watch_time", f"must be positive and finite [s], got {self.watch_time!r}")
        if self.one_sided:
            if not self.hand.push > 0.0:
                raise ArgumentError(
                    "push",
                    f"must be positive [N] for a one-sided wall, got {self.hand.push!r}; without it the device "
                    "leaves the wall",
                )
        elif not self.disturbance > max(self.visible, 0.0):
            raise ArgumentError(
                "disturbance",
                f"must be larger than what counts as visible, {self.visible!r} m, got {self.disturbance!r} m; "
                "give a larger one",
            )

    @property
    def smooth(self) -> bool:
        """Whether nothing of the device is nonlinear; the wall and the hand may be."""
        linear_estimate = not isinstance(self.loop.controller.velocity, Foaw | Levant)
        return not self.loop.nonlinear and linear_estimate

    @property
    def linear(self) -> bool:
        """Whether nothing of device, wall and hand is nonlinear."""
        return self.smooth and not self.one_sided and self.hand.reflex is None and self.hand.tremor is None

    @cached_property
    def first_samples(self) -> int:
        """Samples watched at first: FIRST_SAMPLES or, where that is more, four periods of the slowest vibration of
        the device without a wall, up to MOST_PERIODS samples, and LEAST_SECONDS_HELD where somebody holds it; of a
        given time so many that the last look takes all of it."""
        if self.watch_time is not None:
            return max(ceil(self.watch_time / self.loop.period / float(LONGER ** (LEVELS - 1))), LEAST_SAMPLES)
        frequencies = natural_frequencies(self.loop.plant)
        slow = PERIODS / float(frequencies[frequencies > 0.0].min(initial=np.inf)) / self.loop.period
        held = self.one_sided or self.hand.operator is not None
        return max(
            FIRST_SAMPLES,
            min(ceil(slow), MOST_PERIODS),
            ceil(LEAST_SECONDS_HELD / self.loop.period) if held else 0,
        )

    def linearised(self) -> StabilityTrial:
        """The same trial without nonlinear parts and force limit, on a two-sided wall, the hand only holding. The
        disturbance is a displacement alone, and every motion counts as visible."""
        plain = replace(self.loop.plant, nonlinear=Nonlinear())
        feedforward = self.loop.controller.feedforward
        smooth = None if feedforward is None else replace(feedforward, coulomb=0.0)
        computer = replace(self.loop.controller, force_limit=float("inf"), feedforward=smooth)
        hand = replace(self.hand, push=0.0, reflex=None, tremor=None, reach=None)
        return replace(self, loop=Loop(plain, computer), hand=hand, one_sided=False, speed=0.0, visible=0.0)


@dataclass(frozen=True)
class Observation:
    """Verdict on one wall, from the motion after a disturbance.

    stable     the motion died away inside the wall, or is too small to be seen
    behaviour  as `time_response` names it
    amplitude  of the handle in the end [m]
    frequency  dominant [Hz]; nan where nothing moves
    """

    stable: bool
    behaviour: Behaviour
    amplitude: float
    frequency: float


def observe(trial: StabilityTrial, walls: ArrayLike, levels: int | None = None) -> list[Observation]:
    """Disturb and watch at each of the walls (k, 2) of [stiffness, damping], all at once.

    levels   at most so many looks, each four times as long as the one before; None: as long as it takes

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> mass = Plant(np.array([[0.1]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> trial = StabilityTrial(Loop(mass, Controller(0.001)))
    >>> [seen.stable for seen in observe(trial, [[1000.0, 0.4], [1000.0, 0.6]])]    # B > K T/2, roughly
    [False, True]
    """
    walls = np.asarray(walls, dtype=float).reshape(-1, 2)
    most = levels or LEVELS
    observations: list[Observation | None] = [None] * len(walls)
    for level in range(most):
        samples = trial.first_samples * LONGER**level
        undecided = [i for i, observation in enumerate(observations) if observation is None]
        at_once = max(AT_ONCE // samples, 1)
        for start in range(0, len(undecided), at_once):
            some = undecided[start : start + at_once]
            for i, response in zip(some, _responses(trial, walls[some], samples), strict=True):
                judged = judge_response(response)
                stable = _verdict(trial, response, judged, level, last=level + 1 == most)
                if stable is not None:
                    observations[i] = Observation(stable, judged.behaviour, judged.amplitude, judged.frequency)
    return [observation for observation in observations if observation is not None]


def _responses(trial: StabilityTrial, walls: Floats, samples: int) -> list[TimeResponse]:
    """Motions on walls (k, 2) of [stiffness, damping] after the trial's disturbance, for so many samples."""
    environment = one_sided_wall if trial.one_sided else wall
    plant, operator = trial.loop.plant, trial.hand.operator
    shape = least_deforming_motion(plant if operator is None else attach(plant, operator))
    start = (0.0 if trial.one_sided else trial.disturbance) * shape, trial.speed * shape
    runs = [
        Run(
            trial.loop,
            environment.values(stiffness=float(K), damping=float(B)),
            hand=trial.hand,
            start=start,
            seed=trial.seed,
            bound=_bound(trial, float(K)),
        )
        for K, B in walls
    ]
    # the first sample is at time 0
    return simulate_batch(runs, environment, duration=(samples - 1) * trial.loop.period, substeps=trial.substeps)


def _bound(trial: StabilityTrial, stiffness: float) -> float:
    """Reading from the wall at which a run stops [m]: many times what the disturbance and the push move."""
    # the push's deflection of the wall, and the way at the start's speed in 1024 samples; 20 times, far beyond
    # what a wall that holds overshoots
    pushed = abs(trial.hand.push) / max(abs(stiffness), 1e-300)
    thrown = abs(trial.speed) * 1024 * trial.loop.period
    return float(BOUND_FACTOR * (trial.disturbance + thrown) + 20.0 * pushed)


def _verdict(
    trial: StabilityTrial, response: TimeResponse, judged: Judgement, level: int, *, last: bool
) -> bool | None:
    """Whether a wall is stable by look `level`, from 0 on; None: watch on. last: there is no other look."""
    if response.given_up or not np.all(np.isfinite(response.truth)):
        return False
    growth = judged.growth
    still = np.isnan(growth)  # nothing moves
    if trial.linear:
        if still:
            return True
        return bool(growth < 0.0) if last else None
    if level == 0 and not last:
        return None  # what bounces at first may well come to rest
    if trial.one_sided and judged.contact < 1.0:
        return False if last or judged.behaviour == "lost contact" else None
    if judged.behaviour == "converged" or still or judged.amplitude <= trial.visible:
        return True
    if judged.behaviour == "decaying" and trial.smooth:
        return True
    if not last:
        return None
    # of a nonlinear device, a quarter of the run must shrink the motion visibly
    return bool(growth < 0.0) if trial.smooth else bool(growth * (len(response.time) // 4) < -STEADY)
