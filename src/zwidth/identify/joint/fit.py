"""Friction and mass of one joint by output error: the motion predicted in windows, each from its own start.

Within a window the motion follows from the recorded force alone; position and velocity at the window's first
sample are parameters too (multiple shooting). What an encoder's steps add to slow motion is correlated over many
samples, so the intervals do not come from the residuals' size but from blocks of consecutive samples: what each of
them adds to the numbers, and how that differs from block to block.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.identify.joint.motion import MASS as MASS
from zwidth.identify.joint.motion import STIFFNESS as STIFFNESS
from zwidth.identify.joint.motion import follow_windows
from zwidth.identify.profile_likelihood import LEVEL

DELAY: Final = 6  # index of the force's delay behind the six numbers of the motion
DRIFTS: Final = (7, 8, 9)  # indices of the bias's drift: even, bent and S-shaped
COUNT: Final = 10  # numbers
ONE: Final = np.eye(COUNT)  # ONE[MASS]: weights of the mass alone in a sum over the numbers
VISCOUS, DRY = slice(1, 3), slice(3, 5)  # among the numbers: viscous and dry friction, forward and backward
STEP: Final = 1e-6  # of a derivative, of parameters in units of their effect
MOST_STEPS: Final = 400  # of the optimiser: in a narrow bent valley, as of a joint that hardly slides, it creeps
ARRIVED: Final = 1e-8  # relative fall of the sum of squares that ends it
RIDGES: Final = (0.0, 1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4)  # of Levenberg and Marquardt, tried in this order
GROWTH: Final = 5.0  # logarithm of the factor by which a motion may grow within a window
LONGEST_DELAY: Final = (-1.0, 6.0)  # least and largest delay of the force, samples
BLOCKS: Final = 24  # of consecutive samples, of all windows together, at least
SHARES: Final = (1.0, 0.3, 0.0)  # of a step that a window's start may take
LEVERAGE: Final = 1e-9  # a block of a leverage within this of 1 determines a direction alone
LEAST_SHARE: Final = 1e-3  # of a variance that must be seen in the blocks' changes
LEAST_MASS: Final = 1e-3  # times b T: a mass that stops within a thousandth of a sample


@dataclass(frozen=True)
class Windows:
    """Stretches of records, with some samples before and after each so that a delayed force is known.

    position, force  (n,) readings [m or rad], force or torque [N or N m]; the force is 0 where nothing drives
    first, length    (W,) row of each window's first sample, and their number
    period           (W,) sampling period [s]
    time             (W,) time of the first sample [s]
    run              (W,) number of the stretch without a gap, over all records, that a window belongs to
    driven           whether a force was recorded
    clock            (n,) time of each row, from -1/2 at the beginning of all records to 1/2 at their end
    """

    position: Floats
    force: Floats
    first: Ints
    length: Ints
    period: Floats
    time: Floats
    run: Ints
    driven: bool
    clock: Floats

    def chosen(self, which: Flags) -> Windows:
        """The windows for which `which` (W,) is true."""
        names = ("first", "length", "period", "time", "run")
        return replace(self, **{name: getattr(self, name)[which] for name in names})

    def cut(self, parts: int) -> Windows:
        """Each window cut into so many parts, one behind the other; fewer where a part had less than 8 samples."""
        edges = [np.linspace(0, n, min(parts, max(n // 8, 1)) + 1).astype(np.int64) for n in self.length]
        many = np.array([len(e) - 1 for e in edges])  # parts of each window
        offsets = np.concatenate([e[:-1] for e in edges])
        return replace(
            self,
            first=np.repeat(self.first, many) + offsets,
            length=np.concatenate([np.diff(e) for e in edges]),
            period=np.repeat(self.period, many),
            time=np.repeat(self.time, many) + np.repeat(self.period, many) * offsets,
            run=np.repeat(self.run, many),
        )

    @cached_property
    def drifts(self) -> Floats:
        """Shapes (3, n) of a bias that drifts: Legendre's polynomials of the clock, of mean 0 over even time.

        The first grows by 1 from beginning to end, the third by 2, the second is alike at both ends.
        """
        s = self.clock
        return np.array([s, 6.0 * s**2 - 0.5, 20.0 * s**3 - 3.0 * s])

    @cached_property
    def rows(self) -> Ints:
        """Rows, of position and force, of all samples in windows, window by window."""
        return np.concatenate([np.arange(a, a + n) for a, n in zip(self.first, self.length, strict=True)])


@dataclass(frozen=True)
class JointNumbers:
    """The ten numbers that a motion follows from, and which of them are fitted.

    values   (10,) m, b forward and backward, F forward and backward, k, the force's delay [s], and the drift of
             the bias in three shapes, `Windows.drifts`
    free     indices of those that are fitted
    tied     (index, other) of each number that is set to another one: backward ones where the joint never slid so
    """

    values: Floats
    free: tuple[int, ...]
    tied: tuple[tuple[int, int], ...] = ()

    def with_free(self, some: Floats) -> JointNumbers:
        """The numbers with other values (p,) of the free ones; tied ones follow."""
        values = self.values.copy()
        values[list(self.free)] = some
        for number, other in self.tied:
            values[number] = values[other]
        return replace(self, values=values)

    @property
    def free_values(self) -> Floats:
        """Values (p,) of the free numbers."""
        return self.values[list(self.free)]


def predict(windows: Windows, values: Floats, starts: Floats) -> Floats:
    """Positions at `windows.rows` [m or rad] by the numbers `values` (10,), from position and velocity at each
    window's first sample, starts (W, 2)."""
    out = np.zeros(len(windows.position))
    drift = values[list(DRIFTS)]
    follow_windows(
        windows.force + drift @ windows.drifts if drift.any() else windows.force,
        windows.first,
        windows.length,
        windows.period,
        np.ascontiguousarray(values[:DELAY]),
        float(values[DELAY]),
        starts,
        out,
    )
    return out[windows.rows]


@dataclass(frozen=True)
class Blocks:
    """Sums over blocks of consecutive samples, of the linearised prediction.

    gram      (G, p + 2, p + 2) of the derivatives by the free numbers and by the window's start
    gradient  (G, p + 2) of the derivatives times what remains
    squares   (G,) of what remains
    window    (G,) the window that a block lies in
    """

    gram: Floats
    gradient: Floats
    squares: Floats
    window: Ints


@dataclass(frozen=True)
class JointFit:
    """Numbers of a joint that predict its motion best.

    numbers     fitted
    starts      (W, 2) of the windows
    covariance  (p, p) of the free numbers' errors by the blocks' spread; inf on the diagonal where the data tell
                nothing
    working     (p, p) the same if the residuals were independent, of size 1
    residuals   (n,) at `windows.rows`
    changes     (G, p) of the numbers by each block's residuals, enlarged for what the fit takes from them
    weights     (G, p, G, p) covariances of these changes if the residuals were independent, of size 1
    converged   whether the optimiser arrived
    """

    windows: Windows
    numbers: JointNumbers
    starts: Floats
    covariance: Floats
    working: Floats
    residuals: Floats
    changes: Floats
    weights: Floats
    converged: bool

    @property
    def sum_of_squares(self) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residuals**2))

    def combination(self, weights: Floats) -> tuple[float, float, float]:
        """Value of a sum over the numbers, weights (10,), its standard error, and the degrees of freedom of that;
        an error of inf with 1 where the data do not tell it.

        The degrees of freedom of Student's distribution follow by Satterthwaite's rule from the variances and
        covariances that the blocks' changes would have if the residuals were independent (Bell and McCaffrey 2002,
        known at second hand).
        """
        by_free = np.asarray(weights, dtype=float).copy()
        value = float(by_free @ self.numbers.values)
        for number, other in self.numbers.tied:
            by_free[other] += by_free[number]
        by_free = by_free[list(self.numbers.free)]
        involved = by_free != 0.0
        if np.any(~np.isfinite(np.diag(self.covariance)[involved])):
            return value, np.inf, 1.0
        covariances = np.einsum("i,gihj,j->gh", by_free, self.weights, by_free)
        expected = float(np.trace(covariances))
        if not expected > LEAST_SHARE * float(by_free @ self.working @ by_free):
            return value, np.inf, 1.0
        error = float(np.sqrt(np.sum((self.changes @ by_free) ** 2)))
        return value, error, max(expected**2 / float(np.sum(covariances**2)), 1.0)

    def interval(self, weights: Floats) -> tuple[float, float, float]:
        """Value and ends of the interval of a sum over the numbers, weights (10,)."""
        from scipy.stats import t

        value, error, freedom = self.combination(weights)
        half_width = error * float(t.ppf(0.5 + 0.5 * LEVEL, freedom)) if np.isfinite(error) else np.inf
        return value, value - half_width, value + half_width


class _Search:
    """Levenberg and Marquardt's search over the free numbers and the windows' starts (W, 2).

    blocks  into how many the samples are cut for `Blocks`, at least; 0: one for each window
    """

    def __init__(self, windows: Windows, numbers: JointNumbers, starts: Floats, blocks: int) -> None:
        self.windows, self.numbers, self.starts = windows, numbers, starts
        self.cut = windows.cut(max(-(-blocks // len(windows.first)), 1)) if blocks else windows
        self.of_window = np.searchsorted(windows.first, self.cut.first, side="right") - 1
        self.reading = windows.position[windows.rows]
        self.where = np.repeat(np.arange(len(windows.first)), windows.length)
        self.edges = np.concatenate([[0], np.cumsum(self.cut.length)])  # of the blocks among all samples
        self.scales = scales(windows)

    def linearised(self) -> tuple[Blocks, Floats]:
        """Sums over the blocks at the present numbers, and what these leave of the readings (n,)."""
        p = len(self.numbers.free)  # columns: the free numbers, position and velocity of the window's start
        base = predict(self.windows, self.numbers.values, self.starts)
        columns = np.empty((len(base), p + 2))
        values = self.numbers.free_values
        for i, number in enumerate(self.numbers.free):
            moved = values.copy()
            step = STEP * self.scales[number]
            moved[i] += step
            columns[:, i] = (
                predict(self.windows, self.numbers.with_free(moved).values, self.starts) - base
            ) / step
        for j in range(2):
            starts = self.starts.copy()
            step = STEP * self.scales[COUNT + j]
            starts[:, j] += step
            columns[:, p + j] = (predict(self.windows, self.numbers.values, starts) - base) / step
        remainder = self.reading - base
        pairs = [(columns[a:b], remainder[a:b]) for a, b in zip(self.edges[:-1], self.edges[1:], strict=True)]
        return (
            Blocks(
                np.array([A.T @ A for A, _ in pairs]),
                np.array([A.T @ r for A, r in pairs]),
                np.array([float(r @ r) for _, r in pairs]),
                self.of_window,
            ),
            remainder,
        )

    def run(self, most: int = MOST_STEPS) -> tuple[Blocks, Floats, bool]:
        """Search until the sum of squares falls no more, in at most so many steps.

        Returns  `linearised` at the end, and whether the search arrived
        """
        ridge = 1
        for _ in range(most):
            blocks, remainder = self.linearised()
            least = float(remainder @ remainder)
            arrow = Arrow.of(blocks, len(self.starts))
            for tried in range(max(ridge - 1, 0), len(RIDGES)):  # from one below that of the last step on
                ridge = tried
                numbers, starts, squares = self._best_step(*arrow.solved(RIDGES[ridge], self.floor))
                if squares < least:
                    break
            else:  # no ridge leads down
                return blocks, remainder, True
            self.numbers, self.starts = numbers, starts
            if least - squares <= ARRIVED * least:
                blocks, remainder = self.linearised()
                return blocks, remainder, True
        return *self.linearised(), False

    def _best_step(self, step: Floats, along: Floats) -> tuple[JointNumbers, Floats, float]:
        """The numbers a step (p,) further; each window's start (W, 2) by that of `SHARES` of its step, `along`
        (W, 2), that predicts it best; and the sum of squares there."""
        numbers = self._moved(step)
        guesses = [self.starts + share * along for share in SHARES]
        squares = np.array([squares_of(self.windows, numbers, guess) for guess in guesses])
        best = np.argmin(squares, axis=0)
        starts = np.array(guesses)[best, np.arange(len(best))]
        return numbers, starts, float(np.sum(squares[best, np.arange(len(best))]))

    @property
    def floor(self) -> Floats:
        """Least diagonal (2,) of the normal equations of a window's start, position and velocity: starts of
        windows in which nothing moves change nothing, and must not run away.
        """
        samples = float(np.mean(self.windows.length))
        span = samples * float(np.mean(self.windows.period))
        # a thousandth of what a start changes in a window that moves freely: all samples, by 1 and by the time
        return 1e-3 * samples * np.array([1.0, span**2])

    def _moved(self, step: Floats) -> JointNumbers:
        """The numbers a step further, within bounds that keep the motion from running away; the mass falls to a
        tenth at most."""
        values = self.numbers.with_free(self.numbers.free_values + step).values
        values[MASS] = max(values[MASS], 0.1 * self.numbers.values[MASS])
        return self.numbers.with_free(bounded(values, self.windows)[list(self.numbers.free)])


def bounded(values: Floats, windows: Windows) -> Floats:
    """The numbers (10,) within what can be meant: a mass above 0, a delay of a few samples, and no friction or
    spring that drives the joint so that its motion grows by more than `GROWTH` within a window."""
    T, span = float(np.mean(windows.period)), float(np.max(windows.length * windows.period))
    forward, backward = values[VISCOUS]
    least = max(LEAST_MASS * max(abs(forward), abs(backward)) * T, 1e-6 * scales(windows)[MASS])
    m = max(float(values[MASS]), least)
    after = values.copy()
    after[MASS] = m
    after[VISCOUS] = np.maximum(after[VISCOUS], -GROWTH * m / span)
    after[STIFFNESS] = max(float(after[STIFFNESS]), -m * (GROWTH / span) ** 2)
    after[DELAY] = np.clip(after[DELAY], LONGEST_DELAY[0] * T, LONGEST_DELAY[1] * T)
    return after


def scales(windows: Windows) -> Floats:
    """Usual sizes (12,) of the ten numbers, and of a start's position and velocity, by the record's force, motion
    and time: units in which a search takes its steps."""
    y, T = windows.position, float(np.mean(windows.period))
    x = max(
        float(np.max([np.ptp(y[a : a + n]) for a, n in zip(windows.first, windows.length, strict=True)])), 1e-300
    )
    length = float(np.mean(windows.length)) * T
    v = x / (0.25 * length)  # of a motion that goes over its range in a quarter of a window
    a = v / (0.25 * length)
    f = float(np.std(windows.force)) if windows.driven else a  # of free motion all numbers are over the mass
    f = f if f > 0.0 else a  # of a constant force
    # m, b and F forward and backward, k, delay, three drifts; position and velocity of a start
    return np.array([f / a, f / v, f / v, f, f, f / x, T, f, f, f, x, v])


def assembled_windows(blocks: Blocks, count: int) -> Floats:
    """Normal matrix (p + 2 W, p + 2 W) of the free numbers and of the starts of all windows, `count` W."""
    p = blocks.gram.shape[-1] - 2
    whole = np.zeros((p + 2 * count, p + 2 * count))
    for gram, window in zip(blocks.gram, blocks.window, strict=True):
        at = np.append(np.arange(p), [p + 2 * window, p + 2 * window + 1])
        whole[np.ix_(at, at)] += gram
    return whole


@dataclass(frozen=True)
class Arrow:
    """Normal equations of the free numbers and of the starts, which meet only within their windows.

    own      (p, p) of the numbers;     slope   (p,)
    mixed    (W, p, 2) of both
    starts   (W, 2, 2) of the starts;   slopes  (W, 2)
    """

    own: Floats
    slope: Floats
    mixed: Floats
    starts: Floats
    slopes: Floats

    @classmethod
    def of(cls, blocks: Blocks, count: int) -> Arrow:
        """The normal equations of sums over blocks, of `count` windows W."""
        p = blocks.gram.shape[-1] - 2
        mixed, starts, slopes = np.zeros((count, p, 2)), np.zeros((count, 2, 2)), np.zeros((count, 2))
        np.add.at(mixed, blocks.window, blocks.gram[:, :p, p:])
        np.add.at(starts, blocks.window, blocks.gram[:, p:, p:])
        np.add.at(slopes, blocks.window, blocks.gradient[:, p:])
        own, slope = np.sum(blocks.gram[:, :p, :p], axis=0), np.sum(blocks.gradient[:, :p], axis=0)
        return cls(own, slope, mixed, starts, slopes)

    def solved(self, ridge: float, floor: Floats) -> tuple[Floats, Floats]:
        """Steps (p,) of the numbers and (W, 2) of the starts: (N + ridge diag N)^-1 g.

        The starts are eliminated, window by window, and found behind the numbers.
        floor  (2,) least diagonal of the starts, of which the ridge is a share
        """
        number_size = np.sqrt(np.maximum(np.diag(self.own), 1e-300))
        start_size = np.sqrt(np.maximum(np.diagonal(self.starts, axis1=1, axis2=2), floor))
        diagonal = 1.0 + ridge + 1e-12  # solvable without a ridge, too
        N = self.own / np.outer(number_size, number_size) + (diagonal - 1.0) * np.eye(len(number_size))
        starts = self.starts / (start_size[:, :, None] * start_size[:, None, :]) + (diagonal - 1.0) * np.eye(2)
        mixed = self.mixed / (number_size[:, None] * start_size[:, None, :])
        per_number = np.linalg.solve(starts, np.swapaxes(mixed, 1, 2))  # (W, 2, p)
        starts_alone = np.linalg.solve(starts, (self.slopes / start_size)[:, :, None])[:, :, 0]
        eliminated = N - np.einsum("wpi,wiq->pq", mixed, per_number)
        slope = self.slope / number_size - np.einsum("wpi,wi->p", mixed, starts_alone)
        x = np.linalg.lstsq(eliminated, slope, rcond=1e-12)[0] if len(slope) else slope
        return x / number_size, (starts_alone - per_number @ x) / start_size


def squares_of(windows: Windows, numbers: JointNumbers, starts: Floats) -> Floats:
    """Sum of squares (W,) of what the numbers, and starts (W, 2), leave in each window; inf where the prediction
    runs away."""
    edges = np.cumsum(windows.length) - windows.length
    with np.errstate(over="ignore", invalid="ignore"):
        remainder = windows.position[windows.rows] - predict(windows, numbers.values, starts)
        sums = np.add.reduceat(remainder**2, edges)
    return np.where(np.isfinite(sums), sums, np.inf)


def explained(windows: Windows, squares: Floats) -> float:
    """1 less the squares (W,) that remain over those that the best straight line leaves in each window.

    The start of each window is its own, and a line is what a start alone explains.
    """
    total = 0.0
    for first, length in zip(windows.first, windows.length, strict=True):
        y, samples = windows.position[first : first + length], np.arange(length) - 0.5 * (length - 1)
        y = y - np.mean(y)
        total += float(y @ y - (y @ samples) ** 2 / (samples @ samples))
    return 1.0 - float(np.sum(squares)) / max(total, 1e-300)


def approach(
    windows: Windows, numbers: JointNumbers, starts: Floats, most: int
) -> tuple[JointNumbers, Floats, Floats]:
    """At most so many steps of the search, for a better guess: numbers, starts (W, 2), sums of squares (W,)."""
    search = _Search(windows, numbers, starts, 0)
    search.run(most)
    return search.numbers, search.starts, squares_of(windows, search.numbers, search.starts)


def fit_joint(windows: Windows, numbers: JointNumbers, starts: Floats, *, blocks: int = BLOCKS) -> JointFit:
    """The free numbers that predict the motion in the windows best, from a guess close to them.

    numbers, starts  the guess, with which of the numbers are free; and position and velocity (W, 2) at each
                     window's start
    blocks           least number of blocks of samples, whose spread makes the intervals
    """
    search = _Search(windows, numbers, starts, blocks)
    sums, left, converged = search.run()
    spread = block_spread(sums, len(search.starts), len(search.numbers.free))
    covariance, working, changes, weights = spread
    return JointFit(windows, search.numbers, search.starts, covariance, working, left, changes, weights, converged)


def block_spread(blocks: Blocks, count: int, free: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Spread of the free numbers by what each block of a linearised fit adds to them.

    With N = sum of S_g = A_g^T A_g over the blocks and P_g the part of N^-1 that a block sees, block g adds
    N^-1 (1 - S_g P_g)^-1/2 A_g^T r_g  to the numbers. The root makes up for what the fit has taken from the
    residuals: the sum of squares then has the right mean where they are independent (Bell and McCaffrey 2002,
    known at second hand), and it holds for any correlation within blocks. Leaving blocks out one by one, a
    jackknife, has the power -1 in its place, too wide with the degrees of freedom of `JointFit.combination`.
    count, free  number of windows, and of free numbers
    Returns      `covariance`, `working`, `changes` and `weights` of `JointFit`
    """
    whole = assembled_windows(blocks, count)
    size = np.sqrt(np.maximum(np.diag(whole), 1e-300))
    inverse, lost = _inverse(whole / np.outer(size, size))
    G = len(blocks.window)
    # of each block: where the free numbers and its window's start stand in the whole matrix
    columns = np.concatenate(
        [np.tile(np.arange(free), (G, 1)), free + 2 * blocks.window[:, None] + [0, 1]], axis=1
    )
    scale = size[columns]
    S = blocks.gram / (scale[:, :, None] * scale[:, None, :])
    grown = _enlarged(S, inverse[columns[:, :, None], columns[:, None, :]])
    to = inverse[:free][:, columns].transpose(1, 0, 2) @ grown  # (G, p, q), N^-1 (1 - S P)^-1/2
    changes = np.einsum("gpq,gq->gp", to, blocks.gradient / scale) / size[:free]
    covariance = changes.T @ changes
    for i in np.flatnonzero(lost[:free]):
        covariance[i, i] = np.inf
    # weights: of residuals that are independent but for what the fit has taken from all of them
    rows = np.zeros((G, free, len(whole)))
    taken = to @ S
    np.put_along_axis(rows, np.broadcast_to(columns[:, None, :], taken.shape), taken, axis=2)
    weights = -np.einsum("gia,ab,hjb->gihj", rows, inverse, rows, optimize=True)
    weights[np.arange(G), :, np.arange(G), :] += taken @ np.swapaxes(to, 1, 2)
    weights /= size[:free][None, :, None, None] * size[:free][None, None, None, :]
    working = inverse[:free, :free] / np.outer(size[:free], size[:free])
    return covariance, working, changes, weights


def _enlarged(S: Floats, P: Floats) -> Floats:
    """(1 - S P)^-1/2 (G, q, q) of `block_spread`, S and P (G, q, q), through R S R with R the root of P."""
    values, vectors = np.linalg.eigh(P)
    root = np.sqrt(np.maximum(values, 0.0))
    R = (vectors * root[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    inverse_values = np.divide(1.0, root, out=np.zeros_like(root), where=root > 1e-9 * np.max(root))
    inverse_root = (vectors * inverse_values[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    leverage, axes = np.linalg.eigh(R @ S @ R)
    # a direction that one block alone determines leaves no residual there to be enlarged
    factor = np.where(leverage < 1.0 - LEVERAGE, 1.0 / np.sqrt(np.maximum(1.0 - leverage, LEVERAGE)), 1.0)
    return np.asarray(inverse_root @ ((axes * factor[:, None, :]) @ np.swapaxes(axes, 1, 2)) @ R)


def _inverse(scaled: Floats) -> tuple[Floats, Flags]:
    """Inverse of a normal matrix (q, q) with diagonal 1, and which parameters (q,) it leaves undetermined."""
    values, vectors = np.linalg.eigh(scaled)
    felt = values > 1e-11  # directions that change the prediction by more than rounding
    inverse = (vectors[:, felt] / values[felt]) @ vectors[:, felt].T
    # that move along a direction which changes nothing, by more than rounding
    lost = np.any(np.abs(vectors[:, ~felt]) > 1e-3, axis=1)
    return inverse, lost
