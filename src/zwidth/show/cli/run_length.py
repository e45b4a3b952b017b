"""How long a contact is simulated where nothing is said."""

from __future__ import annotations

from math import ceil, inf, isfinite, log
from typing import Final, NamedTuple

MOST: Final = 60.0  # s
MOST_SAMPLES: Final = 1_000_000
DECADES: Final = 6  # after which a motion that grows or dies fast has said what it does
FEWEST: Final = 100  # samples, unless the decades are over before
NEEDED: Final = 24  # samples that a verdict takes
TENFOLDS: Final = 5  # of what is not linear, which takes its time to settle
LEAST: Final = 2.0  # s, of what is not linear
PERIODS: Final = 8  # from which a frequency can be told
GROWN: Final = 2  # tenfold changes of what grows, which nobody waits for


class Length(NamedTuple):
    """seconds, and why so many"""

    seconds: float
    why: str


def run_length(
    growth: float | None,
    period: float,
    *,
    linear: bool,
    busy_until: float = 0.0,
    frequency: float = 0.0,
    heard: float = 0.0,
) -> Length:
    """Seconds worth simulating.

    growth      predicted, ln rho per sample; None: not known
    period      T [s]
    linear      nothing but exponentials can come of it
    busy_until  when the hand has done what it does [s]
    frequency   predicted, of what dies away last or grows fastest [Hz]; 0: none
    heard       how long a sound takes [s]
    """
    tenfold = log(10.0) / abs(growth) if growth else inf
    if linear:
        fast = min(FEWEST, DECADES * tenfold)
        samples = max(tenfold, fast, NEEDED)
        why = "a tenfold change at the predicted rate" if tenfold >= max(fast, NEEDED) else "it changes fast"
        most = GROWN * tenfold if growth and growth > 0.0 else inf
        for own, said in ((_periods(frequency) / period, f"{PERIODS} periods"), (heard / period, "to be heard")):
            if min(own, most) > samples:
                samples, why = min(own, most), said
        seconds = ceil(min(samples, 1e18)) * period
        return _capped(seconds + busy_until, f"{why}, once the hand is done" if busy_until else why, period)
    least = max(LEAST + busy_until, 2 * FEWEST * period)
    if max(_periods(frequency), heard) > least:
        why = f"{PERIODS} periods" if _periods(frequency) >= heard else "to be heard"
        least = max(_periods(frequency), heard)
    else:
        why = "chosen for what is not linear"
    slow = TENFOLDS * tenfold * period
    if isfinite(slow) and slow > least:
        return _capped(slow, f"{TENFOLDS} tenfold changes at the predicted rate", period)
    return _capped(least, why, period)


def heard_length(length: Length, frequency: float, period: float) -> Length:
    """As long, or long enough for the sound of a vibration that a first run has shown."""
    from zwidth.show.sound import seconds_to_hear

    seconds = seconds_to_hear(frequency)
    return length if seconds <= length.seconds else _capped(seconds, "to be heard", period)


def _periods(frequency: float) -> float:
    """Seconds that so many periods take; 0 where there is no frequency."""
    return PERIODS / frequency if frequency > 0.0 else 0.0


def _capped(seconds: float, why: str, period: float) -> Length:
    most = min(MOST, MOST_SAMPLES * period)
    return Length(seconds, why) if seconds <= most else Length(most, f"{why}, at most this")
