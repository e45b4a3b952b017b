"""Default length and substeps of a simulated contact, and the distance at which a run stops."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, exp, inf, isfinite, log
from typing import Final, NamedTuple

from zwidth.arrays import Floats
from zwidth.chart.verdict import judge
from zwidth.contact.environments import ENVIRONMENTS
from zwidth.contact.environments.environment import Environment
from zwidth.contact.hand import Hand
from zwidth.contact.simulate import LARGEST_MOTION
from zwidth.loop.estimator import NonlinearError
from zwidth.loop.loop import Loop

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
    """Seconds to simulate, and the reason for so many."""

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

    loop  held by its operator
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
    controlled       does a passivity controller act on the wall's force?
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

    growth      predicted, ln rho per sample; None: not known
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
        for own, why in ((_periods(frequency) / period, f"{PERIODS} periods"), (sound / period, "to be heard")):
            if min(own, most) > samples:
                samples, reason = min(own, most), why
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
    """The length, or a longer one where a first run shows that its sound needs more seconds."""
    return length if sound <= length.seconds else _capped(sound, "to be heard", period)


def _periods(frequency: float) -> float:
    """Seconds that so many periods take; 0 where there is no frequency."""
    return PERIODS / frequency if frequency > 0.0 else 0.0


def _capped(seconds: float, reason: str, period: float) -> RunLength:
    most = min(MOST, MOST_SAMPLES * period)
    return RunLength(seconds, reason) if seconds <= most else RunLength(most, f"{reason}, at most this")


def busy_until(hand: Hand) -> float:
    """End of the hand's last movement [s]."""
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
    grown = offset * exp(min(max(growth or 0.0, 0.0) * JUDGED, 600.0))
    return max(LARGEST_MOTION, 10.0 * offset, min(grown, FARTHEST))


def needed_substeps(loop: Loop, hand: Hand, substeps: int) -> int:
    """The number of substeps; of a linear device under a steady push only those that a figure needs, as all are
    exact."""
    steady = hand.reflex is None and hand.tremor is None and hand.reach is None and not hand.ramp
    linear = not set(loop.plant.nonlinear.kinds) - COUNTED
    return min(substeps, SHOWN_BETWEEN) if steady and linear else substeps
