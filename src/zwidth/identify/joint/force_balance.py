"""Whether a recorded force depends on a joint's motion at all, and on its acceleration, beyond its own noise.

Output error (`fit`) takes the recorded force as exact. Under a constant force all numbers of a joint may be
multiplied by one factor without any change of its motion, and the noise of the force's reading then chooses the
factor: the larger the mass, the less that noise moves it. So a mass is believed only where the force, regressed
the other way round on the motion, goes with the acceleration:

    f = m a + b v + F_f [v > 0] - F_b [v < 0] + k x + d f' + drift

Noise of the force is in the left side here, and draws no number anywhere; noise of the position draws the mass
towards 0. Neither makes a mass out of nothing more often than the level of the test says.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.identify.joint.fit import COUNT, LEVEL, MASS, STIFFNESS, Windows
from zwidth.identify.joint.start import MOVING, PARTLY, SHORTEST, balance_rows, weighting

BY_CHANCE: Final = 5e-4  # probability that noise alone passes for a mass: a larger one tells masses that are none
OVERLAP: Final = 2.0  # rows that share each sample: so many fewer of them are independent
MEMORY: Final = 0.1  # share of the rows over which errors may go together: with less, slow noise seems to be none
FEWEST_FREE: Final = 3.0  # degrees of freedom below which a variance says little
NUMBERS: Final = (MASS, 1, 3, 4, STIFFNESS)  # of the columns of a balance
TINY: Final = 1e-9  # share of the largest column below which one is rounding


@dataclass(frozen=True)
class ForceBalance:
    """The force by the motion.

    values      (10,) numbers as `fit.Numbers` has them, 0 where the balance has none
    covariance  (10, 10) of their errors
    freedom     degrees of freedom of its variance
    critical    standard errors from which a mass is told from 0
    depends     whether the force depends on acceleration, velocity, direction or position at all; None where too
                few segments hold motion to say so
    """

    values: Floats
    covariance: Floats
    freedom: float
    critical: float
    depends: bool | None

    @property
    def mass_over_error(self) -> float:
        """Standard errors by which the mass differs from 0."""
        error = float(np.sqrt(self.covariance[MASS, MASS]))
        return float(self.values[MASS]) / error if error > 0.0 else 0.0

    @property
    def tells_mass(self) -> bool:
        """Whether the force grows with the acceleration beyond its own noise."""
        return self.mass_over_error > self.critical

    @property
    def against_mass(self) -> bool:
        """Whether it falls with the acceleration, as it does for no mass."""
        return self.mass_over_error < -self.critical

    def interval(self, weights: Floats) -> tuple[float, float]:
        """Ends of the 95 % interval of a sum over the numbers, weights (10,)."""
        from scipy.stats import t

        value = float(weights @ self.values)
        half = float(np.sqrt(weights @ self.covariance @ weights) * t.ppf(0.5 + 0.5 * LEVEL, self.freedom))
        return value - half, value + half


NOTHING: Final = ForceBalance(np.zeros(COUNT), np.zeros((COUNT, COUNT)), 1.0, np.inf, None)


def force_balance(windows: Windows, resolution: float, *, delay: float = 0.0, spring: bool = True) -> ForceBalance:
    """The balance over segments of the length at which it says most of the mass.

    resolution  of the readings [m or rad];   delay  of the force [s];   spring  whether one may act
    Returns     `NOTHING` where too few segments hold motion
    """
    if not len(windows.first):
        return NOTHING
    late = max(round(delay / float(np.mean(windows.period))), 0)
    sizes = [SHORTEST]
    while 2 * sizes[-1] <= np.max(windows.length):
        sizes.append(2 * sizes[-1])
    chances = [(size, moving) for size in sizes for moving in (MOVING, PARTLY)]
    level = BY_CHANCE / len(chances)
    tried = [_balanced(windows, size, resolution, late, spring, moving, level) for size, moving in chances]
    found = [one for one in tried if one is not None]
    if not found:
        return NOTHING
    best = max(found, key=lambda one: abs(one.mass_over_error) / one.critical)
    return replace(best, depends=any(one.depends or one.tells_mass or one.against_mass for one in found))


def _balanced(
    windows: Windows, size: int, resolution: float, late: int, spring: bool, moving: float, level: float
) -> ForceBalance | None:
    """The balance over segments of so many samples, of which a share moves; None of too few."""
    from scipy.stats import f as f_distribution
    from scipy.stats import t

    if size > np.max(windows.length):
        return None
    weight, slope, _ = weighting(size)
    A, at, T = balance_rows(windows, size, resolution, moving)
    forces = 0.5 * (windows.force + np.append(windows.force[:1], windows.force[:-1]))
    held = forces[np.clip(at - late, 0, len(forces) - 1)]
    force, rate = held @ weight, (held @ slope) / T
    # what tells nothing of the joint: a constant force, one that is late, one that drifts
    beside = np.stack(
        [np.full(len(force), np.sum(weight)), rate, *(d[at] @ weight for d in windows.drifts)], axis=1
    )
    motion = A[:, : len(NUMBERS) if spring else -1]
    inverse, left, rank = _least_squares(np.concatenate([motion, beside[:, 1:]], axis=1), force)
    freedom = len(force) / OVERLAP - rank
    if freedom < FEWEST_FREE:
        return None
    # while the joint stands partly, a constant force is none of the levels
    _, left_with, rank_with = _least_squares(np.concatenate([motion, beside], axis=1), force)
    _, left_without, rank_without = _least_squares(beside, force)
    more, squares = rank_with - rank_without, float(left_with @ left_with)
    gain = float(left_without @ left_without) - squares
    depends = more > 0 and gain * freedom > more * f_distribution.ppf(1.0 - level, more, freedom) * squares
    numbers = list(NUMBERS[: motion.shape[1]])
    values, covariance = np.zeros(COUNT), np.zeros((COUNT, COUNT))
    values[numbers] = (inverse @ force)[: len(numbers)]
    covariance[np.ix_(numbers, numbers)] = _spread(inverse[: len(numbers)], left, freedom)
    for one, other in _alike(motion):
        values[one] = values[other]
        covariance[one] = covariance[other]
        covariance[:, one] = covariance[:, other]
    return ForceBalance(values, covariance, freedom, float(t.ppf(1.0 - level, freedom)), bool(depends))


def _alike(motion: Floats) -> list[tuple[int, int]]:
    """Numbers that follow another: viscous friction backward, and a level in whose direction nothing slid."""
    pairs = [(2, 1)]
    forward, backward = np.any(motion[:, 2] != 0.0), np.any(motion[:, 3] != 0.0)
    return pairs + ([(4, 3)] if not backward else [] if forward else [(3, 4)])


def _least_squares(X: Floats, y: Floats) -> tuple[Floats, Floats, int]:
    """Inverse (p, n) of columns (n, p), what they leave of y (n,), and their rank; columns of 0 get a row of 0."""
    size = np.linalg.norm(X, axis=0)
    scale = np.where(size > 0.0, size, 1.0)
    if not len(y):
        return np.zeros(X.T.shape), y, 0
    U, s, Vt = np.linalg.svd(X / scale, full_matrices=False)
    seen = s > TINY * s[0]
    U = U[:, seen]
    return (Vt[seen].T / s[seen]) @ U.T / scale[:, None], y - U @ (U.T @ y), int(np.sum(seen))


def _spread(inverse: Floats, left: Floats, freedom: float) -> Floats:
    """Covariance (p, p) of numbers by an inverse (p, n) from what is left (n,): a noise that is alike over the
    record, and goes together over neighbouring rows; no less than if the rows were independent.

    The autocovariances are weighted with a triangle (Newey and West 1987, known at second hand).
    """
    n = len(left)
    variance = float(left @ left) / max(freedom * OVERLAP, 1.0)
    white = variance * inverse @ inverse.T
    whole = white.copy()
    reach = max(int(MEMORY * n), 4)
    share = variance / max(float(left @ left), 1e-300)
    for lag in range(1, min(reach, n - 1) + 1):
        together = share * float(left[lag:] @ left[:-lag]) * (1.0 - lag / (reach + 1.0))
        products = inverse[:, lag:] @ inverse[:, :-lag].T
        whole += together * (products + products.T)
    larger = np.sqrt(np.maximum(np.diag(whole) / np.maximum(np.diag(white), 1e-300), 1.0))
    return np.asarray(white * larger[:, None] * larger[None, :])
