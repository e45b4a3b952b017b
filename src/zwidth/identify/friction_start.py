"""First guess of a joint's mass and friction: force balance weighted with smooth functions of time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.identify.friction_fit import Numbers, Windows, approach, predict, scales

Floats = NDArray[np.float64]

SHORTEST: Final = 12  # samples of a weighting function
MOVING: Final = 0.7  # share of it that must be motion
PARTS: Final = (8, 2, 1)
TRIES: Final = 3
OUTLYING: Final = 9.0
DELAYS: Final = (0, 1, 2, 3, 4, 5)  # samples


@dataclass(frozen=True)
class Guess:
    """A first guess.

    values     (7,) as `friction_fit.Numbers` has them
    explained  share of the weighted force that is explained
    error      standard error of the mass over the mass; inf where it is no positive number
    """

    values: Floats
    explained: float
    error: float


def weighted_balance(windows: Windows, size: int, step: float, delay: int) -> tuple[Floats, Floats]:
    """Rows of the force balance in segments of so many samples, half of each in the next.

    With w(t) = (1 - t^2)^3 on a segment, integrated by parts:
        m int w'' x - b int -w' x ... = int w f - F_f int w [x' > 0] + F_b int w [x' < 0]
    step     of the encoder [m or rad]: what moves by less within an eighth of a segment counts as standing
    Returns  (s, 4) of m, b, F forward and backward, and (s,) of the force; rows of much standing left out
    """
    u = (np.arange(size) - 0.5 * (size - 1)) / (0.5 * size)
    weight = (1.0 - u**2) ** 3
    slope = -6.0 * u * (1.0 - u**2) ** 2
    bend = -6.0 * (1.0 - u**2) ** 2 + 24.0 * u**2 * (1.0 - u**2)
    reach = max(size // 8, 1)
    rows, sides = list[Floats](), list[Floats]()
    for first, length, T in zip(windows.first, windows.length, windows.period, strict=True):
        starts = np.arange(first, first + length - size + 1, max(size // 2, 1))
        if not len(starts):
            continue
        at = starts[:, None] + np.arange(size)
        y = windows.position[at] - windows.position[starts][:, None]
        last = len(windows.position) - 1
        moved = windows.position[np.minimum(at + reach, last)] - windows.position[np.maximum(at - reach, 0)]
        side = np.where(np.abs(moved) > 1.5 * step, np.sign(moved), 0.0)
        here, before = np.clip(at - delay, 0, last), np.clip(at - delay - 1, 0, last)
        force = 0.5 * (windows.force[here] + windows.force[before])
        half = 0.5 * size * T
        one = np.stack(
            [
                y @ bend / half**2,
                -(y @ slope) / half,
                (side > 0.0) @ weight,
                -((side < 0.0) @ weight),
            ],
            axis=1,
        )
        moving = np.mean(side != 0.0, axis=1) >= MOVING
        rows.append(one[moving])
        sides.append((force @ weight)[moving])
    if not rows:
        return np.zeros((0, 4)), np.zeros(0)
    return np.concatenate(rows), np.concatenate(sides)


def first_guess(windows: Windows, size: int, step: float) -> Guess | None:
    """The numbers that balance the weighted forces best, over delays of the force; None of too few segments.

    Of free motion all numbers are those over the mass.
    """
    best: Guess | None = None
    for delay in DELAYS if windows.driven else (0,):
        A, f = weighted_balance(windows, size, step, delay)
        if len(f) < 8:
            return None
        if not windows.driven:
            A, f = A[:, 1:], -A[:, 0]
        norms = np.linalg.norm(A, axis=0)
        used = norms > 0.0
        if not used.any():
            return None
        x, *_ = np.linalg.lstsq(A[:, used] / norms[used], f, rcond=1e-10)
        left = f - A[:, used] / norms[used] @ x
        total = float(f @ f)
        explained = 1.0 - float(left @ left) / total if total > 0.0 else 0.0
        numbers = np.zeros(A.shape[1])
        numbers[used] = x / norms[used]
        error = 0.0
        if windows.driven:
            inverse = np.linalg.pinv((A[:, used] / norms[used]).T @ (A[:, used] / norms[used]))
            deviation = np.sqrt(2.0 * float(left @ left) / max(len(f) - 4, 1))  # segments overlap by half
            error = float(deviation * np.sqrt(inverse[0, 0]) / norms[0] / numbers[0]) if numbers[0] != 0.0 else np.inf
        else:
            numbers = np.append(1.0, numbers)
        m, b, forward, backward = numbers
        T = float(np.mean(windows.period))
        guess = Guess(np.array([m, b, b, forward, backward, 0.0, delay * T]), explained, error)
        if best is None or guess.explained > best.explained:
            best = guess
    return best


def first_starts(windows: Windows, values: Floats, starts: Floats | None = None) -> Floats:
    """Position and velocity (W, 2) at each window's first sample: of several guesses that which predicts it best.

    The guesses are at rest, lines and parabolas through the first samples, and the given starts.
    """
    here = windows.position[windows.first]
    guesses = [np.stack([here, np.zeros(len(here))], axis=1)]
    for reach in (1, 2, 4, 8, 16, *(windows.length // share for share in (3, 6, 12, 24))):
        n = np.minimum(np.maximum(reach, 1), (windows.length - 1) // 2)
        middle, end = windows.position[windows.first + n], windows.position[windows.first + 2 * n]
        span = 2.0 * np.maximum(n, 1) * windows.period
        for rise in (end - here, 4.0 * middle - 3.0 * here - end):
            guesses.append(np.stack([here, rise / span], axis=1))
    if starts is not None:
        guesses.append(np.where(np.isfinite(starts), starts, guesses[0]))
    edges = np.cumsum(windows.length) - windows.length
    reading = windows.position[windows.rows]
    with np.errstate(over="ignore", invalid="ignore"):
        costs = [np.add.reduceat((reading - predict(windows, values, guess)) ** 2, edges) for guess in guesses]
    best = np.argmin(np.where(np.isfinite(costs), costs, np.inf), axis=0)
    return np.array(guesses)[best, np.arange(len(here))]


def search_guess(windows: Windows, free: tuple[int, ...], tied: tuple[tuple[int, int], ...], step: float) -> tuple[Numbers, Floats]:
    """Numbers and starts close to those that predict the motion best.

    Short windows forgive a wrong guess, for the start of each is its own; the longer ones then begin where those
    have led.
    """
    size, best = int(np.median(windows.length)), None
    short = windows.cut(PARTS[0])
    for length in (size, size // 2, size // 4, size // 8):
        guess = first_guess(windows, length, step) if length >= SHORTEST else None
        if guess is None:
            continue
        values = guess.values.copy()
        values[0] = max(values[0], 1e-3 * scales(windows)[0])
        numbers = Numbers(values, tuple(i for i in free if i != 5), tied)
        found = approach(short, numbers, first_starts(short, values), 6)
        if best is None or np.sum(found[2]) < np.sum(best[2]):
            best = found
    if best is None:
        raise ValueError("too few segments")
    numbers, starts, _ = best
    numbers = replace(numbers, free=free)
    before = short
    for parts in PARTS[1:]:
        now = windows.cut(parts) if parts > 1 else windows
        at = np.searchsorted(before.first, now.first)
        numbers, starts, squares = approach(now, numbers, first_starts(now, numbers.values, starts[at]), 10)
        before = now
    for _ in range(TRIES):
        means = squares / windows.length
        bad = means > OUTLYING * np.median(means)
        if not bad.any():
            break
        fresh = first_starts(windows, numbers.values, starts)
        numbers, starts, squares = approach(windows, numbers, fresh, 10)
    return numbers, starts
