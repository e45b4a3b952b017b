"""One contact simulated: the motion, what became of it, and its energies.

Default length and substeps of a simulated contact, and the distance at which a run stops.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, exp, inf, isfinite, log
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.verdict import judge
from zwidth.contact.environments import ENVIRONMENTS
from zwidth.contact.environments.environment import Environment
from zwidth.contact.hand import Hand
from zwidth.contact.loop_simulation import LARGEST_MOTION
from zwidth.contact.passivity_controller import rendered_stiffness
from zwidth.contact.time_response import SOURCES, Behaviour, Judgement, TimeResponse, as_key, judge_response
from zwidth.errors import NonlinearError
from zwidth.loop.loop import Loop
from zwidth.loop.multi_loop import unheld_positions
from zwidth.loop.operating_point import OperatingPoint
from zwidth.result import Result
from zwidth.unit_text import unit_text

WALLS: Final = ("wall", "one-sided wall")
AT_LIMIT = 1.0 - 1e-12  # share of the largest force from which a force was cut to it


@dataclass(frozen=True)
class RangeExit:
    """A motion leaves the range of a mechanism's handle: when [s], and how far that can be from its posture along
    the direction, backward (not positive) and forward [m]."""

    time: float
    backward: float
    forward: float


class PassivityComparison(NamedTuple):
    """Effect of a passivity controller: the stiffness felt, and the verdict, with and without it.

    rendered_stiffness      felt with the controller, by `passivity_controller.rendered_stiffness` [N/m]
    uncontrolled_stiffness  the same without it [N/m]
    uncontrolled            verdict on the run without it
    """

    rendered_stiffness: float
    uncontrolled_stiffness: float
    uncontrolled: Judgement


def is_pushed_on(loop: Loop, touched: Environment, values: Floats, hand: Hand) -> bool:
    """Whether the hand's push moves the device on and on, since no stiffness of the wall holds a position.

    loop  held by its operator;   touched, values  the environment and its parameters (P,)
    """
    if touched.name not in WALLS or values[0] != 0.0 or hand.push == 0.0 or hand.tremor is not None:
        return False
    return unheld_positions(loop) > 0


@dataclass(frozen=True, repr=False)
class ContactSimulation(Result):
    """One contact simulated; S samples. Positions are along the rendered direction, 0 at the device's posture.

    point               device and operator
    environment         what is touched;   values (P,) of its parameters
    hand                who holds the handle, and what he does
    start_position      of the reading [m];   start_velocity  [m/s]
    distance_from_path  how far from the start the handle's path passes [m]; None for a device without a mechanism
    predicted_growth    ln rho per sample of the linear loop on the two-sided wall; None where there is none
    length              length of the run [s], and the reason for it
    substeps            taken between samples;   seed  of the encoders' noise
    response            the motion
    judgement           verdict on the motion
    range_exit          where it leaves the handle's range; None where it stays within, or without a mechanism
    uncontrolled        the same run without the passivity controller; None where there is no controller
    """

    point: OperatingPoint
    environment: Environment
    values: Floats
    hand: Hand
    start_position: float
    start_velocity: float
    distance_from_path: float | None
    predicted_growth: float | None
    length: RunLength
    substeps: int
    seed: int
    response: TimeResponse
    judgement: Judgement
    range_exit: RangeExit | None
    uncontrolled: TimeResponse | None

    # --- what became of it ----------------------------------------------------------------------------

    @property
    def behaviour(self) -> Behaviour | Literal["forced"]:
        """Behaviour (see `time_response.Judgement`); "forced" where the device only goes with the hand's tremor,
        "growing" where it was gone before there was anything to judge."""
        judged, tremor = self.judgement, self.hand.tremor
        if self.response.given_up and judged.behaviour == "undecided":
            return "growing"
        if tremor is None or judged.behaviour not in ("limit cycle", "undecided"):
            return judged.behaviour
        # resolution of a frequency, which is determined in the second half of the run
        tolerance = 1.0 / (0.5 * len(self.response.time) * self.loop.period)
        return "forced" if abs(judged.frequency - tremor.frequency) < tolerance else judged.behaviour

    @property
    def stable(self) -> bool | None:
        """Whether the motion decays; None where the run leaves that open."""
        return None if self.behaviour in ("forced", "undecided") else self.judgement.stable is True

    @property
    def growth(self) -> float:
        """ln rho, rho the factor by which the motion grows per sample; nan where nothing moves, or the run was too
        short to tell."""
        return self.judgement.growth

    @property
    def dominant_frequency(self) -> float:
        """Frequency of the strongest vibration in the second half [Hz]; nan where nothing moves."""
        return self.judgement.frequency

    @property
    def amplitude(self) -> float:
        """Half of peak to peak of the handle in the last quarter [m]."""
        return self.judgement.amplitude

    @property
    def contact_share(self) -> float:
        """Share of the second half with a force."""
        return self.judgement.contact

    @property
    def limited_share(self) -> float:
        """Share of the samples at which the force was cut to its limit."""
        return float((abs(self.force) >= self.force_limit * AT_LIMIT).mean())

    @property
    def given_up(self) -> bool:
        """Whether the run stopped early, the device farther from the wall than any device moves."""
        return self.response.given_up

    @cached_property
    def passivity(self) -> PassivityComparison | None:
        """Effect of the passivity controller; None without one."""
        if self.uncontrolled is None:
            return None
        drifts = is_pushed_on(self.point.loop, self.environment, self.values, self.hand)
        judged = judge_response(self.uncontrolled, drifts=drifts)
        return PassivityComparison(_felt_stiffness(self.response), _felt_stiffness(self.uncontrolled), judged)

    @property
    def ledger(self) -> dict[str, float]:
        """Energy that each source has supplied by the end, by its name (`time_response.SOURCES`) [J]."""
        return dict(zip(SOURCES, self.response.energies[-1].tolist(), strict=True))

    # --- what was simulated ---------------------------------------------------------------------------

    @property
    def loop(self) -> Loop:
        """The device without its operator, who is in `hand`."""
        return self.point.contact_loop

    @property
    def force_limit(self) -> float:
        """Largest force there is [N]; inf: none."""
        return self.loop.nonlinear.force_limit

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the environment's parameters by name."""
        return dict(zip(self.environment.names, self.values.tolist(), strict=True))

    @property
    def wall_position(self) -> float:
        """Where the environment begins [m]."""
        return self.response.wall_position

    @property
    def starts_inside(self) -> bool:
        """Whether the reading starts inside the wall."""
        return self.start_position > self.wall_position

    # --- in time --------------------------------------------------------------------------------------

    @property
    def time(self) -> Floats:
        """Times of the samples (S,) [s]."""
        return self.response.time

    @property
    def position(self) -> Floats:
        """(S,) the reading: what the encoders count [m]"""
        return self.response.reading

    @property
    def penetration(self) -> Floats:
        """(S,) of the reading into the environment [m]; negative outside"""
        return self.response.penetration

    @property
    def velocity(self) -> Floats:
        """(S,) the estimate of the reading's velocity [m/s]"""
        return self.response.velocity

    @property
    def force(self) -> Floats:
        """(S,) commanded, on the device along the direction [N]"""
        return self.response.force

    @property
    def handle(self) -> Floats:
        """(S,) the handle's position [m]"""
        return self.response.handle

    @property
    def energy(self) -> Floats:
        """(S,) kinetic and elastic, beyond that at the start [J]"""
        return self.response.stored

    # --- as data --------------------------------------------------------------------------------------

    def document(self) -> dict[str, Any]:
        """Everything by key and unit; None where inapplicable."""
        parameters, judged, left = self.parameters, self.judgement, self.range_exit
        return {
            "environment": self.environment.name,
            "parameters": parameters,
            "wall_stiffness_N_per_m": parameters.get("stiffness"),
            "wall_damping_Ns_per_m": parameters.get("damping"),
            "wall_position_m": self.wall_position,
            "start": {
                "position_m": self.start_position,
                "velocity_m_per_s": self.start_velocity,
                "off_the_path_m": self.distance_from_path,
                "inside": self.starts_inside,
            },
            "hand": self.hand.document(),
            "duration_s": float(self.time[-1]),
            "duration_asked_s": self.length.seconds,
            "substeps": self.substeps,
            "seed": self.seed,
            "stable": self.stable,
            "behaviour": self.behaviour,
            "frequency_Hz": judged.frequency,
            "dominant_frequency_Hz": judged.frequency,
            "handle_amplitude_m": judged.amplitude,
            "amplitude_m": judged.amplitude,
            "growth_per_sample": judged.growth,
            "predicted_growth_per_sample": self.predicted_growth,
            "contact_share": judged.contact,
            "limited_share": self.limited_share,
            "given_up": self.given_up,
            "range_m": left and (left.backward, left.forward),
            "left_range_at_s": left and left.time,
            "ledger_J": {as_key(name): energy for name, energy in self.ledger.items()},
            "ledger_imbalance": self.response.imbalance,
            "passivity": self._passivity_document(),
            **self.response.series,
        }

    def table(self) -> dict[str, Floats]:
        """The motion in time as columns, each entry of the energy ledger with its own."""
        return self.response.table()

    def _passivity_document(self) -> dict[str, Any] | None:
        """Effect of the passivity controller by key and unit; None without one."""
        if self.passivity is None:
            return None
        felt, without, judged = self.passivity
        return {
            "rendered_stiffness_N_per_m": felt,
            "without": {
                "rendered_stiffness_N_per_m": without,
                "stable": judged.stable,
                "behaviour": judged.behaviour,
                "amplitude_m": judged.amplitude,
            },
        }

    def __repr__(self) -> str:
        """Lines with the environment, the verdict, the size of motion and force, and the length of the run."""
        units = {parameter.name: unit_text(parameter.unit) for parameter in self.environment.parameters}
        values = [f"{name} {value:.4g} {units[name]}".rstrip() for name, value in self.parameters.items()]
        verdict = {True: "stable", False: "not stable", None: "undecided"}[self.stable]
        by_eigenvalues = "" if self.predicted_growth is None else f" (predicted {self.predicted_growth:.4g})"
        return "\n".join(
            [
                f"ContactSimulation: {', '.join([self.environment.name, *values])}",
                f"  {verdict}: {self.behaviour}, growth {self.growth:.4g} per sample{by_eigenvalues}",
                f"  amplitude {self.amplitude:.4g} m, dominant frequency {self.dominant_frequency:.4g} Hz",
                f"  largest force {np.nanmax(np.abs(self.force)):.4g} N, deepest {self.penetration.max():.4g} m",
                f"  {len(self.time)} samples, {self.time[-1]:.4g} s",
            ]
        )


def _felt_stiffness(response: TimeResponse) -> float:
    """Stiffness that was felt in a run [N/m]."""
    return rendered_stiffness(response.reading, response.force, response.wall_position)


MOST: Final = 60.0  # s of a run
MOST_SAMPLES: Final = 1_000_000
DECADES: Final = 6  # tenfold changes after which the verdict on a fast motion is certain
FEWEST: Final = 100  # samples of a run, unless the decades end before
NEEDED: Final = 24  # samples that a verdict needs
TENFOLDS: Final = 5  # tenfold changes of a nonlinear run, which settles slowly
LEAST: Final = 2.0  # s of a nonlinear run
PERIODS: Final = 8  # of a vibration, so that its frequency can be determined
GROWN: Final = 2  # tenfold changes of a growing motion; more show nothing new
SWINGS: Final = 10  # least number of swings of a tremor in a run
JUDGED: Final = 32  # samples of growth that are simulated in any case, so that it can be measured
FARTHEST: Final = 1e6  # m, to which a motion may grow in these samples
COUNTED: Final = {"encoder steps", "noise"}  # nonlinear parts that leave the motion between samples linear
SHOWN_BETWEEN: Final = 20  # substeps of a run that is exact with any number


class RunLength(NamedTuple):
    """Length of a run: seconds to simulate, and the reason for so many."""

    seconds: float
    reason: str


class PredictedGrowth(NamedTuple):
    """Growth of the linear loop's slowest decaying or fastest growing motion.

    per_sample  ln rho; None where it is not known
    frequency   of that motion [Hz]; 0 where it has none, or none is known
    decays      whether it dies away beyond doubt; None where it is not known
    """

    per_sample: float | None
    frequency: float
    decays: bool | None = None


def predicted_growth(loop: Loop, environment: Environment, values: Floats) -> PredictedGrowth:
    """Growth by the eigenvalues of a linear loop; known on the two-sided wall alone, and of linear estimators.
    Elsewhere it is None, and its frequency 0.

    loop  held by its operator;   values  stiffness and damping of the wall first
    """
    if environment is not ENVIRONMENTS["wall"]:
        return PredictedGrowth(None, 0.0)
    try:
        judged = judge(loop, [values[0]], [values[1]])
    except NonlinearError:
        return PredictedGrowth(None, 0.0)
    radius, frequency = float(judged.spectral_radius[0]), float(judged.frequency[0])
    known = isfinite(radius) and radius > 0.0
    return PredictedGrowth(
        log(radius) if known else None,
        frequency if isfinite(frequency) else 0.0,
        judged.names[0] == "stable" if known else None,
    )


def contact_run_length(
    loop: Loop,
    hand: Hand,
    growth: PredictedGrowth,
    *,
    controlled: bool,
    seconds_to_hear: Callable[[float], float] | None,
) -> RunLength:
    """Seconds worth simulating of one contact.

    loop             without its operator;   growth  predicted with him
    controlled       whether a passivity controller acts on the wall's force
    seconds_to_hear  of a run that is to be heard: seconds that it lasts at least, by its frequency [Hz]
    """
    free = hand.tremor is None and hand.reach is None and not controlled
    return run_length(
        growth.per_sample,
        loop.period,
        linear=growth.per_sample is not None and free and not loop.nonlinear,
        busy_until=busy_until(hand),
        frequency=growth.frequency,
        sound=seconds_to_hear(growth.frequency) if seconds_to_hear else 0.0,
    )


def run_length(
    growth: float | None,
    period: float,
    *,
    linear: bool,
    busy_until: float = 0.0,
    frequency: float = 0.0,
    sound: float = 0.0,
) -> RunLength:
    """Choose the length of a run [s].

    growth      predicted, ln rho per sample, rho its factor per sample; None: not known
    period      T [s]
    linear      True: the motion is a sum of exponentials
    busy_until  end of the hand's last movement [s]
    frequency   predicted, of the motion that decays last or grows fastest [Hz]; 0: none
    sound       length that a sound file needs [s]
    """
    tenfold = log(10.0) / abs(growth) if growth else inf
    if linear:
        fast = min(FEWEST, DECADES * tenfold)
        samples = max(tenfold, fast, NEEDED)
        reason = "a tenfold change at the predicted rate" if tenfold >= max(fast, NEEDED) else "it changes fast"
        most = GROWN * tenfold if growth and growth > 0.0 else inf
        for wanted, why in ((_periods(frequency) / period, f"{PERIODS} periods"), (sound / period, "to be heard")):
            if min(wanted, most) > samples:
                samples, reason = min(wanted, most), why
        # 1e18: a loop that neither grows nor decays asks for infinitely many, which `_capped` cuts
        seconds = ceil(min(samples, 1e18)) * period
        return _capped(seconds + busy_until, f"{reason}, once the hand is done" if busy_until else reason, period)
    least = max(LEAST + busy_until, 2 * FEWEST * period)
    if max(_periods(frequency), sound) > least:
        reason = f"{PERIODS} periods" if _periods(frequency) >= sound else "to be heard"
        least = max(_periods(frequency), sound)
    else:
        reason = "chosen for a nonlinear run"
    slow = TENFOLDS * tenfold * period
    if isfinite(slow) and slow > least:
        return _capped(slow, f"{TENFOLDS} tenfold changes at the predicted rate", period)
    return _capped(least, reason, period)


def lengthened(length: RunLength, sound: float, period: float) -> RunLength:
    """The length, or `sound` seconds where a run's sound, known after a first run, needs more."""
    return length if sound <= length.seconds else _capped(sound, "to be heard", period)


def _periods(frequency: float) -> float:
    """Seconds that PERIODS periods of a frequency [Hz] take; 0 for a frequency of 0."""
    return PERIODS / frequency if frequency > 0.0 else 0.0


def _capped(seconds: float, reason: str, period: float) -> RunLength:
    """Length of a run with its reason, at most MOST seconds and MOST_SAMPLES samples of this period [s]."""
    most = min(MOST, MOST_SAMPLES * period)
    return RunLength(seconds, reason) if seconds <= most else RunLength(most, f"{reason}, at most this")


def busy_until(hand: Hand) -> float:
    """End of the hand's last movement [s], of a tremor that of its first SWINGS swings."""
    reached = 0.0 if hand.reach is None else hand.reach.start + hand.reach.duration
    slow = hand.tremor is not None and hand.tremor.frequency > 0.0
    trembled = SWINGS / hand.tremor.frequency if slow and hand.tremor is not None else 0.0
    return max(hand.ramp, reached, trembled)


def bound_of_run(offset: float, growth: float | None) -> float:
    """Distance from the wall at which a run stops, because no device moves so far [m].

    offset  of the start from the wall [m];   growth  predicted per sample; None: not known
    Returns more than that where the run starts so far away, or grows so far in the samples in which its growth is
            measured
    """
    # no exponent above 600, which would overflow
    grown = offset * exp(min(max(growth or 0.0, 0.0) * JUDGED, 600.0))
    # 10.0: a motion may overshoot its start and still come back
    return max(LARGEST_MOTION, 10.0 * offset, min(grown, FARTHEST))


def needed_substeps(loop: Loop, hand: Hand, substeps: int) -> int:
    """The number of substeps; of a linear device under a steady push only those that a figure needs, as all are
    exact."""
    linear = not set(loop.plant.nonlinear.kinds) - COUNTED
    return min(substeps, SHOWN_BETWEEN) if hand.is_steady and linear else substeps
