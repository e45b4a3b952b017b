"""First guess of a joint's mass and friction: force balance weighted with smooth functions of time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.identify.joint.fit import (
    DRY,
    MASS,
    STIFFNESS,
    VISCOUS,
    JointNumbers,
    Windows,
    approach,
    bounded,
    predict,
    scales,
)

SHORTEST: Final = 12  # samples of a weighting function
MOVING: Final = 0.7  # share of it that must be motion
PARTLY: Final = 0.2  # the same where nothing moves for longer
PARTS: Final = (8, 2, 1)  # into which windows are cut, search after search
TRIES: Final = 3  # of other starts for windows that are badly predicted
OUTLYING: Final = 9.0  # times the median of the windows' mean squares, above which a window is badly predicted
FEWEST_ROWS: Final = 8  # segments of a balance
GOOD: Final = 1.5  # times the noise, that the right numbers leave
LEVELS: Final = (0.3, 0.6, 0.85)  # shares of the forces below which a joint may stand
MOST_GUESSES: Final = 8
ALIKE: Final = 0.01  # relative difference of two sums of squares that are one
DELAYS: Final = (0, 1, 2, 3, 4, 5)  # samples


@dataclass(frozen=True)
class Guess:
    """A first guess of a joint's numbers, by a weighted balance of forces.

    values     (10,) as `fit.JointNumbers` has them
    explained  share of the weighted force that is explained
    error      standard error of the mass over its size: inf for a mass of 0, 0 of free motion, whose mass is 1
    """

    values: Floats
    explained: float
    error: float


def weighted_balance(
    windows: Windows, size: int, step: float, delays: Sequence[int], moving: float = MOVING
) -> tuple[Floats, Floats]:
    """Rows of the force balance in segments of so many samples, half of each in the next.

    With w(t) = (1 - t^2)^3 on a segment, integrated by parts:
        m int w'' x - b int w' x + F_f int w [x' > 0] - F_b int w [x' < 0] + k int w x = int w f
    step     of the encoder [m or rad]: what moves by less within an eighth of a segment counts as standing
    delays   (D,) of the force, samples
    moving   share of a segment that must be motion for its row to count
    Returns  (s, 5) of m, b, F forward and backward, and k, and (s, D) of the force
    """
    weight = weighting(size)[0]
    rows, samples, _ = force_balance_rows(windows, size, step, moving)
    # a force is held from its sample to the next: its mean about a sample is that of two
    forces = 0.5 * (windows.force + np.append(windows.force[:1], windows.force[:-1]))
    last = len(windows.position) - 1
    right = [forces[np.clip(samples - delay, 0, last)] @ weight for delay in delays]
    return rows, np.stack(right, axis=1)


def force_balance_rows(windows: Windows, size: int, step: float, moving: float) -> tuple[Floats, Ints, Floats]:
    """The motion's side of `weighted_balance`: its rows (s, 5), the samples (s, size) of each, and its sampling
    period (s,) [s].

    size    of a segment [samples], with the next one half of it later;   step  of the readings [m or rad]
    moving  share of a segment that must be motion, else it is left out
    """
    weight, slope, bend = weighting(size)
    reach = max(size // 8, 1)
    starts = [
        np.arange(first, first + length - size + 1, max(size // 2, 1))
        for first, length in zip(windows.first, windows.length, strict=True)
    ]
    T = np.repeat(windows.period, [len(some) for some in starts])
    samples = np.concatenate(starts)[:, None] + np.arange(size)
    last = len(windows.position) - 1
    moved = windows.position[np.minimum(samples + reach, last)] - windows.position[np.maximum(samples - reach, 0)]
    # 1.5 steps: one may be rounding
    direction = np.where(np.abs(moved) > 1.5 * step, np.sign(moved), 0.0)
    kept = np.mean(direction != 0.0, axis=1) >= moving
    samples, direction, T = samples[kept], direction[kept], T[kept]
    positions = windows.position[samples]
    moved_from_start = positions - positions[:, :1]
    rows = [
        moved_from_start @ bend / T**2,
        -(moved_from_start @ slope) / T,
        (direction > 0.0) @ weight,
        -((direction < 0.0) @ weight),
        positions @ weight,
    ]
    return np.stack(rows, axis=1), samples, T


def weighting(size: int) -> tuple[Floats, Floats, Floats]:
    """w(t) = (1 - t^2)^3 at so many samples in [-1, 1], its slope and its bend per sample.

    Slope and bend are differences of the samples, not derivatives: summed by parts they give the second
    differences of a position, which are exactly what a force held from sample to sample causes in a free mass.
    """
    w = (1.0 - np.linspace(-1.0, 1.0, size) ** 2) ** 3
    around = np.concatenate([[0.0], w, [0.0]])
    return w, 0.5 * (around[2:] - around[:-2]), around[2:] - 2.0 * w + around[:-2]


def first_guess(
    windows: Windows, size: int, step: float, *, spring: bool = False, moving: float = MOVING
) -> Guess | None:
    """The numbers that balance the weighted forces best, over delays of the force; None of too few segments.

    Of free motion all numbers are those over the mass. size, step and moving as in `weighted_balance`.
    """
    delays = DELAYS if windows.driven else DELAYS[:1]
    A, forces = weighted_balance(windows, size, step, delays, moving)
    if len(A) < FEWEST_ROWS:
        return None
    A = A if spring else A[:, :4]
    T = float(np.mean(windows.period))
    if not windows.driven:  # the mass times the acceleration, for a mass of 1, balances what resists
        return _guess_of_balance(A[:, 1:], -A[:, 0], False, 0.0)
    guesses = [_guess_of_balance(A, f, True, delay * T) for delay, f in zip(delays, forces.T, strict=True)]
    return max(guesses, key=lambda guess: guess.explained)


def _guess_of_balance(columns: Floats, forces: Floats, driven: bool, delay: float) -> Guess:
    """The guess by least squares of forces (s,), with this delay of the force [s].

    columns (s, c)  of m (only where driven), b, F forward, F backward, perhaps k; not driven, all over the mass
    """
    norms = np.linalg.norm(columns, axis=0)
    used = norms > 0.0
    scaled = columns[:, used] / norms[used]
    x = np.linalg.lstsq(scaled, forces, rcond=1e-10)[0]
    remainder, total = forces - scaled @ x, float(forces @ forces)
    explained = 1.0 - float(remainder @ remainder) / total if total > 0.0 else 0.0
    numbers = np.zeros(columns.shape[1])
    numbers[used] = x / norms[used]
    error = 0.0
    if driven:
        # twice the variance, as segments overlap by half
        deviation = np.sqrt(2.0 * float(remainder @ remainder) / max(len(forces) - columns.shape[1], 1))
        spread = np.sqrt(np.diag(np.linalg.pinv(scaled.T @ scaled))[0]) / norms[used][0]
        error = float(deviation * spread / abs(numbers[0])) if numbers[0] != 0.0 else np.inf
    else:
        numbers = np.append(1.0, numbers)
    m, b, forward, backward = numbers[:4]
    stiffness = float(numbers[4]) if len(numbers) > 4 else 0.0
    return Guess(np.array([m, b, b, forward, backward, stiffness, delay, 0.0, 0.0, 0.0]), explained, error)


def first_starts(windows: Windows, values: Floats, starts: Floats | None = None) -> Floats:
    """Position and velocity (W, 2) at each window's first sample: of several guesses that which predicts it best
    by the numbers `values` (10,).

    The guesses are at rest, lines and parabolas through the first samples, and the given starts.
    """
    here = windows.position[windows.first]
    guesses = [np.stack([here, np.zeros(len(here))], axis=1)]
    reaches = [np.full(len(here), n) for n in (1, 2, 4, 8, 16)] + [windows.length // n for n in (3, 6, 12, 24)]
    for reach in reaches:
        n = np.minimum(np.maximum(reach, 1), (windows.length - 1) // 2)
        middle, end = windows.position[windows.first + n], windows.position[windows.first + 2 * n]
        span = 2.0 * np.maximum(n, 1) * windows.period
        # velocity times 2 n periods, of the line, and of the parabola at its beginning
        for rise in (end - here, 4.0 * middle - 3.0 * here - end):
            guesses.append(np.stack([here, rise / span], axis=1))
    if starts is not None:
        guesses.append(np.where(np.isfinite(starts), starts, guesses[0]))
    edges = np.cumsum(windows.length) - windows.length
    reading = windows.position[windows.rows]
    with np.errstate(over="ignore", invalid="ignore"):
        costs = [np.add.reduceat((reading - predict(windows, values, guess)) ** 2, edges) for guess in guesses]
    best = np.argmin(np.where(np.isfinite(costs), costs, np.inf), axis=0)
    return np.asarray(np.array(guesses)[best, np.arange(len(here))])


def search_guess(
    windows: Windows, numbers: JointNumbers, step: float, noise: float, most: int = MOST_GUESSES
) -> tuple[JointNumbers, Floats]:
    """Numbers and starts close to those that predict the motion best.

    Short windows forgive a wrong guess, for the start of each is its own; the longer ones then begin where those
    have led. Several first guesses are followed in the order of `_guesses`, each only where those before it leave
    more than the noise and no two of them have led to one place; the best is taken.
    numbers  which are free and which are tied; those that are fixed keep their values
    step     of the encoder;   noise  standard deviation of the readings' noise, steps included [m or rad]
    most     guesses that are followed
    """
    short = windows.cut(PARTS[0])
    enough = (GOOD * noise) ** 2 * float(np.sum(windows.length))
    best: tuple[JointNumbers, Floats, Floats] | None = None
    for guess in islice(_guesses(windows, numbers, step), most):
        found = _followed_to_whole_windows(
            windows, short, approach(short, guess, first_starts(short, guess.values), 6)
        )
        squares = float(np.sum(found[2]))  # numbers, starts, sums of squares of the windows
        same_place = best is not None and abs(squares / float(np.sum(best[2])) - 1.0) < ALIKE
        if best is None or squares < np.sum(best[2]):
            best = found
        if same_place or squares <= enough:  # two guesses that lead to one place need no third
            break
    assert best is not None
    return best[0], best[1]


def _followed_to_whole_windows(
    windows: Windows, short: Windows, begun: tuple[JointNumbers, Floats, Floats]
) -> tuple[JointNumbers, Floats, Floats]:
    """Follow numbers, starts and sums of squares from short windows to the whole ones.

    While any whole window is badly predicted, at most TRIES times, all begin anew from these numbers.

    short    the windows cut into parts;   begun  numbers, starts and sums of squares in these
    Returns  numbers, starts (W, 2) and sums of squares (W,) in the whole windows
    """
    numbers, starts, squares = begun
    shorter = short
    for parts in PARTS[1:]:
        longer = windows.cut(parts) if parts > 1 else windows
        nearest = np.minimum(np.searchsorted(shorter.first, longer.first), len(starts) - 1)
        numbers, starts, squares = approach(
            longer, numbers, first_starts(longer, numbers.values, starts[nearest]), 10
        )
        shorter = longer
    for _ in range(TRIES):
        mean_squares = squares / windows.length
        if not np.any(mean_squares > OUTLYING * np.median(mean_squares)):
            break
        fresh = first_starts(windows, numbers.values, starts)
        numbers, starts, squares = approach(windows, numbers, fresh, 10)
    return numbers, starts, squares


def _guesses(windows: Windows, numbers: JointNumbers, step: float) -> Iterator[JointNumbers]:
    """First guesses: by segments of several lengths, the best first; then, for motion in short bursts, by segments
    that are partly motion, and by levels below which the joint may stand."""
    sizes = scales(windows)
    size, spring = int(np.median(windows.length)), STIFFNESS in numbers.free
    lengths = [n for n in dict.fromkeys((size, size // 2, size // 4, size // 8, 2 * SHORTEST)) if n >= SHORTEST]
    found = [first_guess(windows, n, step, spring=spring) for n in lengths]
    sure = sorted((guess for guess in found if guess is not None), key=lambda guess: -guess.explained)
    partly = [first_guess(windows, n, step, moving=PARTLY) for n in (SHORTEST, 2 * SHORTEST)]
    values = [guess.values for guess in (*sure, *partly) if guess is not None]
    values += [_numbers_of_bursts(windows, share) for share in LEVELS] if windows.driven else []
    # without any guess: a mass of the usual size alone
    for given in values or [np.eye(len(sizes))[MASS] * sizes]:
        guess = given[: len(numbers.values)].copy()
        # a balance may find masses and friction below 0
        guess[MASS] = max(guess[MASS], 1e-3 * sizes[MASS])
        guess[VISCOUS] = np.maximum(guess[VISCOUS], 0.0)
        guess[DRY] += max(-0.5 * float(np.sum(guess[DRY])), 0.0)  # their mean is not below 0
        yield numbers.with_free(bounded(guess, windows)[list(numbers.free)])


def _numbers_of_bursts(windows: Windows, share: float) -> Floats:
    """Numbers (10,) of a joint that stands until the force is above this share of all forces, and then moves in
    bursts of half a period of the force."""
    sizes = np.abs(windows.force[windows.rows])
    level, most = float(np.quantile(sizes, share)), float(np.max(sizes))
    signs = np.sign(windows.force[windows.rows] - np.mean(windows.force[windows.rows]))
    turns = max(int(np.sum(signs[1:] != signs[:-1])), 1)
    T = float(np.mean(windows.period))
    burst = 0.5 * len(signs) / turns * T
    # parts of two bursts each
    short = windows.cut(max(int(np.median(windows.length) * T / (2.0 * burst)), 1))
    travels = np.array(
        [np.ptp(windows.position[a : a + n]) for a, n in zip(short.first, short.length, strict=True)]
    )
    moved = max(float(np.quantile(travels, 0.8)), 1e-300)
    # speeded up by the excess of force for half a burst, and slowed down by it: travel is excess burst^2 / (4 m),
    # the excess at least a tenth of the largest force; the delay begins at one sample
    return np.array(
        [max(most - level, 0.1 * most) * burst**2 / (4.0 * moved), 0.0, 0.0, level, level, 0.0, T, 0.0, 0.0, 0.0]
    )
