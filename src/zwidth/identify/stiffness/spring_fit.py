"""A spring with dry friction fitted to strokes of torque over angle.

    T = g(d) + s T_c + a t,        d = angle - rest - c t

    g(d) = k d (1 for d > 0) + k_b d (for d < 0) + k_3 d^3        and, where the data show them,
    play        g stays 0 over a width b about rest
    preload     the stiffness becomes k_b only below d = -p/k; above, p < 0, where the torque's reading is shifted
    load        friction grows with the torque, as of a rope on a pulley: T_c + mu |g(d)|
    reversal    friction turns over a way w behind a turning point: T_c (1 - 2 exp(-way/w))  (Dahl's model)

with a rest angle for each record, s the sign of the motion and t the time, for a drift of one of the two.

Torque is regressed on angle: a rounded angle plus its error is the true one, with an error that hardly depends on
the rounded one (Berkson's case), which leaves slopes unbiased.

`strokes_of` cuts a slow back-and-forth motion into strokes between turning points, without what stands still.
After a turn dry friction holds the shaft until the torque has changed by twice its size; what is read there says
nothing of the spring. What is left of each stroke is averaged in a few bins, which takes most of the noise out of
the angle: a noisy angle would make the fitted spring too soft.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.model.raw_sweep import encoder_step

BASE: Final = ("forward", "backward", "rest", "friction")
EXTENSIONS: Final = ("hardening", "play", "preload", "load", "reversal", "angle drift", "torque drift")
# Kinks of two kinds, and drifts of two kinds, of which one record tells one.
EXCLUSIVE: Final = ({"play", "preload"}, {"angle drift", "torque drift"})
SEEN: Final = 4.0  # standard errors from zero, from which an extension counts
WORTH: Final = 0.9  # of the sum of squares, that an extension must at least bring it down to
CLUSTERS: Final = 24  # that are wanted for the intervals
MOST_CLUSTERS: Final = 120  # of several strokes each where there are many
FEWEST_STROKES: Final = 10  # from which each is a cluster of its own
END: Final = 0.1  # share of the bend's range, at least on either side of a kink
SHORTEST: Final = 1e-4  # share of the angle's range, of the way over which friction turns
OUTLIER: Final = 6.0  # robust standard deviations
MOST_OUTLIERS: Final = 0.05  # share of the bins


@dataclass(frozen=True)
class SpringFit:
    """A fitted spring.

    names       of its parameters: those of BASE, and of EXTENSIONS where the data show them
    values      (p,) of them
    covariance  (p, p) of their errors
    freedom     of Student's distribution for their intervals
    residuals   (n,) torque less the fitted one
    outliers    (n,) bins that were left out as too far from the others
    """

    names: tuple[str, ...]
    values: Floats
    covariance: Floats
    freedom: int
    residuals: Floats
    outliers: Flags

    def __getitem__(self, name: str) -> float:
        """Value of a parameter; 0 of one that was not fitted."""
        return float(self.values[self.names.index(name)]) if name in self.names else 0.0

    def standard_error(self, gradient: dict[str, float]) -> float:
        """Standard error of a function of the parameters with this gradient, derivatives by their names."""
        g = np.array([gradient.get(name, 0.0) for name in self.names])
        return float(np.sqrt(max(g @ self.covariance @ g, 0.0)))

    def half_width(self, gradient: dict[str, float]) -> float:
        """Half width of the 95 % interval of a function of the parameters with this gradient."""
        from scipy.stats import t

        return float(t.ppf(0.975, self.freedom)) * self.standard_error(gradient)

    def torque(self, strokes: Strokes) -> Floats:
        """The fitted torque (n,) of other strokes."""
        return _torque(self.names, self.values, strokes)

    @property
    def by_name(self) -> dict[str, float]:
        """The parameters by their names."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    def elastic(self, bend: Floats) -> Floats:
        """Torque (n,) of the fitted spring at bends [rad], without friction."""
        return _elastic_torque(self.by_name, bend)

    def bend(self, strokes: Strokes) -> Floats:
        """By how much the fitted spring is bent (n,) at the angles of strokes [rad]."""
        return _bend(self.by_name, strokes)

    def bend_under(self, strokes: Strokes) -> Floats:
        """By how much the fitted spring bends (n,) under the torques of strokes [rad]."""
        d = self.bend(strokes)
        reach = 2.0 * float(np.max(np.abs(d)))
        grid = np.linspace(-reach, reach, 4001)
        torque = strokes.torque - _dry_friction(self.by_name, strokes) - self["torque drift"] * strokes.time
        # T = g + s mu |g|: the spring's part of it
        torque = torque / (1.0 + self["load"] * strokes.sign * np.sign(torque))
        # across play every angle has the same torque: a small slope makes the inverse one
        elastic = self.elastic(grid) + 1e-9 * self["forward"] * grid
        return np.interp(torque, np.maximum.accumulate(elastic), grid)


def fit_spring(strokes: Strokes, resolution: Resolution, both_sides: bool) -> SpringFit:
    """The spring that fits strokes best, with those extensions that the data show.

    resolution  of the angle
    both_sides  whether the spring was bent both ways; else it has one stiffness
    """
    names = (*(BASE if both_sides else ("forward", "rest", "friction")), *_rest_names(strokes))
    good = np.ones(len(strokes.angle), dtype=bool)
    fit = _fit_parameters(names, strokes, resolution, good)
    for _ in range(len(EXTENSIONS) + 1):
        good &= ~_far_outliers(fit.residuals, good)
        kept = good & ~_across_kink(fit, strokes)
        # too few to fit: bins across a kink, too
        if np.count_nonzero(kept) <= len(fit.names):
            kept = good
        fit = _fit_parameters(fit.names, strokes, resolution, kept, fit)
        better = _best_extension(fit, strokes, resolution, kept, both_sides)
        if better is None:
            break
        fit = better
    return replace(fit, outliers=~good)


def _best_extension(
    fit: SpringFit, strokes: Strokes, resolution: Resolution, kept: Flags, both_sides: bool
) -> SpringFit | None:
    """The fit with one more parameter that brings most, of those that differ from zero; None if none
    does, or brings enough (`WORTH`).

    kept  (n,) bins that are used;   both_sides  whether the spring was bent both ways
    """
    best, least = None, float(np.sum(fit.residuals[kept] ** 2))
    limit = WORTH * least
    for name in EXTENSIONS:
        alternative = any({name, *fit.names} >= pair for pair in EXCLUSIVE)
        if name in fit.names or alternative or (name == "preload" and not both_sides):
            continue
        tried = _fit_parameters((*fit.names, name), strokes, resolution, kept, fit)
        squares = float(np.sum(tried.residuals[kept] ** 2))
        if squares < limit and _is_seen(tried, name, strokes):
            best, limit = tried, squares
    return best


def _is_seen(fit: SpringFit, name: str, strokes: Strokes) -> bool:
    """Whether an extension differs from zero; a preload only where the stiffness beyond it differs, too, and is
    seen over a part of the bend that is more than the end of a stroke."""
    change = {"forward": 1.0, "backward": -1.0}
    if name == "preload":
        low, high = np.min(fit.bend(strokes)), np.max(fit.bend(strokes))
        # where the kink lies between the least and the largest bend, as a share
        place = (-fit["preload"] / fit["forward"] - low) / (high - low)
        if not (
            END < place < 1.0 - END and abs(fit["forward"] - fit["backward"]) > SEEN * fit.standard_error(change)
        ):
            return False
    return abs(fit[name]) > SEEN * fit.standard_error({name: 1.0})


def _elastic_torque(x: dict[str, float], d: Floats, reach: Floats | float = 0.0) -> Floats:
    """Mean torque (n,), without friction, of a spring with parameters x bent by angles spread evenly over d +-
    reach (n,) [rad], on one side of its kinks."""
    forward = x["forward"]
    backward = x.get("backward", forward)
    half_play, kink = 0.5 * x.get("play", 0.0), -x.get("preload", 0.0) / forward
    # parts of the bend that have the forward stiffness, and the backward one
    above = kink + np.maximum(d - half_play - kink, 0.0)
    below = -np.maximum(kink - d - half_play, 0.0)
    # the mean of (d + e)^3 over e from -reach to reach is d^3 + d reach^2
    return np.asarray(forward * above + backward * below + x.get("hardening", 0.0) * (d**3 + d * reach**2))


def _across_kink(fit: SpringFit, strokes: Strokes) -> Flags:
    """Bins (n,) of several readings over a kink of the fitted spring, whose mean torque is not that of their mean
    angle."""
    half_play = 0.5 * fit["play"]
    kinks = (-half_play, half_play) if half_play else (-fit["preload"] / fit["forward"],)
    d = fit.bend(strokes)
    # 1.2: a margin for the error of the kink
    over = np.any([np.abs(d - kink) <= 1.2 * strokes.reach for kink in kinks], axis=0)
    return np.asarray(over & (strokes.samples > 1) & ("backward" in fit.names))


def _rest_names(strokes: Strokes) -> list[str]:
    """Names of the rest angles of the records after the first."""
    return [f"rest of record {run}" for run in range(1, int(np.max(strokes.run, initial=0)) + 1)]


def _bend(x: dict[str, float], strokes: Strokes) -> Floats:
    """By how much a spring with parameters x is bent (n,) [rad]."""
    rests = np.array([x["rest"], *(x.get(name, x["rest"]) for name in _rest_names(strokes))])
    return np.asarray(strokes.angle - rests[strokes.run] - x.get("angle drift", 0.0) * strokes.time)


def _torque(names: tuple[str, ...], values: Floats, strokes: Strokes) -> Floats:
    """Torque (n,) of strokes by the spring, dry friction and drift with these parameters (p,)."""
    x = dict(zip(names, values.tolist(), strict=True))
    elastic = _elastic_torque(x, _bend(x, strokes), strokes.reach)
    loaded = x.get("load", 0.0) * np.abs(elastic) * strokes.sign
    return np.asarray(elastic + _dry_friction(x, strokes) + loaded + x.get("torque drift", 0.0) * strokes.time)


def _dry_friction(x: dict[str, float], strokes: Strokes) -> Floats:
    """Dry friction (n,) that the torque overcomes, by parameters x, without what grows with the torque."""
    turned = 1.0 - 2.0 * np.exp(-strokes.since / x["reversal"]) if "reversal" in x else 1.0
    return np.asarray(x["friction"] * strokes.sign * turned)


def _start_and_sizes(names: tuple[str, ...], strokes: Strokes, before: SpringFit | None) -> tuple[Floats, Floats]:
    """Parameters (p,) where the search begins, and by how much each is likely to differ (p,).

    names   of the parameters;   before  a fit with fewer of them; None: none yet
    """
    span_angle, span_torque = float(np.ptp(strokes.angle)), float(np.ptp(strokes.torque))
    if before is None:
        columns = np.stack([strokes.angle, strokes.sign, np.ones_like(strokes.sign)], axis=1)
        (k, friction, offset), *_ = np.linalg.lstsq(columns, strokes.torque, rcond=None)
        k = k if k != 0.0 else span_torque / span_angle
        guess = {"forward": k, "backward": k, "rest": -offset / k, "friction": friction}
        guess |= dict.fromkeys(_rest_names(strokes), guess["rest"])
    else:
        guess = dict(zip(before.names, before.values.tolist(), strict=True))
    stiffness = abs(guess["forward"])
    sizes = {
        "forward": stiffness,
        "backward": stiffness,
        "rest": span_angle,
        "friction": 0.1 * span_torque,
        "hardening": stiffness / span_angle**2,
        "play": 0.05 * span_angle,
        "preload": 0.1 * span_torque,
        "load": 0.1,
        "reversal": 0.05 * span_angle,
        "angle drift": 0.1 * span_angle,
        "torque drift": 0.1 * span_torque,
    }
    sizes |= dict.fromkeys(_rest_names(strokes), span_angle)
    # where those extensions begin that do not begin at 0
    from_zero = {"play": 0.05 * span_angle, "preload": 0.1 * span_torque, "reversal": 0.05 * span_angle}
    return (
        np.array([guess.get(name, from_zero.get(name, 0.0)) for name in names]),
        np.array([sizes[name] for name in names]),
    )


def _fit_parameters(
    names: tuple[str, ...],
    strokes: Strokes,
    resolution: Resolution,
    kept: Flags,
    before: SpringFit | None = None,
) -> SpringFit:
    """Fit the parameters `names` to the kept bins (n,) by least squares, from a fit `before`. Play, friction by
    the load and the way of a reversal are not negative."""
    from scipy.optimize import least_squares

    used = strokes.select(kept)
    start, size = _start_and_sizes(names, used, before)
    least = {"play": 0.0, "load": 0.0, "reversal": SHORTEST * float(np.ptp(strokes.angle))}
    lower = np.array([least.get(name, -np.inf) for name in names]) / size
    scale = max(float(np.ptp(used.torque)), 1e-300)

    def residuals(scaled: Floats) -> Floats:
        return np.asarray((used.torque - _torque(names, scaled * size, used)) / scale)

    solved = least_squares(residuals, start / size, bounds=(lower, np.inf), x_scale="jac", ftol=1e-14, xtol=1e-12)
    values = np.asarray(solved.x) * size
    jacobian = -np.asarray(solved.jac) * scale / size
    covariance, freedom = _covariance(jacobian, used, used.torque - _torque(names, values, used), resolution)
    return SpringFit(names, values, covariance, freedom, strokes.torque - _torque(names, values, strokes), ~kept)


def _covariance(
    jacobian: Floats, strokes: Strokes, residuals: Floats, resolution: Resolution
) -> tuple[Floats, int]:
    """Covariance (p, p) of the parameters' errors by the torque's derivatives (n, p) and residuals (n,); and its
    degrees of freedom.

    From the scatter between clusters, as by deleting each in turn (jackknife, in its first order), so that errors
    within a cluster may depend on each other; and from the rounding of the angle, which is the same in every
    stroke and does not show in any scatter.
    """
    cluster = _clusters(strokes)
    pseudo = np.linalg.pinv(jacobian)  # (p, n)
    number = int(cluster.max()) + 1
    changes = np.empty((number, jacobian.shape[1]))
    for number_of_cluster in range(number):
        rows = np.flatnonzero(cluster == number_of_cluster)
        # the residuals of a cluster as they would be without it in the fit
        without_itself = np.eye(len(rows)) - jacobian[rows] @ pseudo[:, rows]
        changes[number_of_cluster] = (
            pseudo[:, rows] @ np.linalg.lstsq(without_itself, residuals[rows], rcond=None)[0]
        )
    scatter = (number - 1.0) / number * changes.T @ changes
    freedom = max(number - jacobian.shape[1], 1)
    return np.asarray(scatter + _rounding(np.asarray(pseudo, dtype=float), strokes, resolution)), freedom


def _rounding(pseudo: Floats, strokes: Strokes, resolution: Resolution) -> Floats:
    """Covariance (p, p) by the rounding of the angle: one error for each count and sign of motion; 0
    where no step shows.

    pseudo  (p, n) pseudo-inverse of the torque's derivatives

    A bin that covers several counts averages their errors, evenly where it has several readings of each count;
    noise of half a count and more does the same (dither).
    """
    if resolution.step == 0.0:
        return np.zeros((len(pseudo), len(pseudo)))
    rise = np.polyfit(strokes.angle, strokes.torque, 1)[0]
    counts_covered = 2.0 * strokes.reach / resolution.step
    dither = np.exp(-2.0 * (np.pi * resolution.noise / resolution.step) ** 2)
    averaged = np.maximum(
        1.0, np.where(counts_covered > strokes.samples, np.sqrt(strokes.samples), counts_covered)
    )
    error = abs(rise) * resolution.step / np.sqrt(12.0) * dither / averaged
    # a number for each count and sign of motion
    cell = np.rint(strokes.angle / resolution.step).astype(np.int64) * 2 + (strokes.sign > 0)
    _, which = np.unique(cell, return_inverse=True)
    parts = np.zeros((int(which.max()) + 1, len(pseudo)))
    np.add.at(parts, which, (pseudo * error).T)
    return np.asarray(parts.T @ parts)


def _clusters(strokes: Strokes) -> Ints:
    """Number (n,) of each bin's cluster: errors within one may depend on each other.

    A cluster is a stroke; several strokes where there are very many, a part of one where there are few.
    """
    _, stroke = np.unique(strokes.stroke, return_inverse=True)
    count = int(stroke.max()) + 1
    if count >= FEWEST_STROKES:
        return np.asarray(stroke * min(MOST_CLUSTERS, count) // count)
    pieces = int(np.ceil(CLUSTERS / count))
    label = np.empty(len(stroke), dtype=np.int64)
    for number in range(count):
        rows = np.flatnonzero(stroke == number)
        label[rows] = number * pieces + np.arange(len(rows)) * pieces // len(rows)
    return np.unique(label, return_inverse=True)[1]


def _far_outliers(residuals: Floats, kept: Flags) -> Flags:
    """Kept bins (n,) that lie far from all others; none where they are many, since then the model is wrong.

    residuals, kept  (n,) of all bins
    """
    middle = float(np.median(residuals[kept]))
    spread = 1.4826 * float(np.median(np.abs(residuals[kept] - middle)))  # robust standard deviation
    far = kept & (np.abs(residuals - middle) > OUTLIER * max(spread, 1e-300))
    return far if np.count_nonzero(far) <= MOST_OUTLIERS * len(residuals) else np.zeros_like(far)


BINS: Final = 24  # of a stroke
FEWEST_BINS: Final = 6  # of a stroke: bins across the kink at 0 are left out, and others must remain
MOST_BINS: Final = 6000  # of a record
LEAST_TURN: Final = 0.05  # share of the range by which the angle comes back where it turns
TURN_COUNTS, TURN_NOISE = 3.0, 8.0  # or so many counts, or standard deviations of the noise
SMOOTHED: Final = 40  # of a stroke, over which the torque is smoothed to find its largest value
STUCK_COUNTS, STUCK_NOISE = 2.5, 6.0  # within which of its turning point the shaft has not moved
SPIKE_NOISE, SPIKE_COUNTS = 12.0, 3.0  # beyond both of the middle of five neighbours a reading is a spike


@dataclass(frozen=True)
class Resolution:
    """Steps and noise of readings.

    step   of which all differences between readings are multiples; 0 where they show none
    noise  standard deviation of single readings about their smooth course
    """

    step: float
    noise: float


@dataclass(frozen=True)
class Strokes:
    """Averages over bins of strokes.

    torque, angle  (n,) means of each bin
    reach          (n,) half of the angle that a bin covers
    samples        (n,) readings in the bin
    sign           (n,) 1 where the angle grows, -1 where it falls
    stroke         (n,) number of the stroke, ascending over all runs
    time           (n,) middle of the bin as a share of its record, 0 to 1
    run            (n,) number of the record
    since          (n,) way from the turn before [rad]; infinite in a record's first stroke, which begins anywhere
    """

    torque: Floats
    angle: Floats
    reach: Floats
    samples: Floats
    sign: Floats
    stroke: Ints
    time: Floats
    run: Ints
    since: Floats

    @property
    def count(self) -> int:
        """Number of strokes."""
        return len(np.unique(self.stroke))

    def select(self, which: Flags) -> Strokes:
        """The bins for which `which` (n,) is true."""
        return Strokes(**{field.name: getattr(self, field.name)[which] for field in fields(self)})


def resolution_of(values: Floats, known_step: float = 0.0) -> Resolution:
    """Step and noise of readings (n,).

    known_step  the sensor's, from the device's file; 0: read off the values
    """
    step = known_step or encoder_step([values])
    second = np.diff(values, n=2)
    # of white noise the second difference has 6 times the variance; the median does not see turns and spikes
    noise = float(np.median(np.abs(second))) / 0.6745 / np.sqrt(6.0) if len(second) else 0.0
    return Resolution(step, noise)


def without_spikes(values: Floats, resolution: Resolution) -> Flags:
    """Which readings (n,) are no spikes: single ones far from the middle of five neighbours."""
    if len(values) < 5:
        return np.ones(len(values), dtype=bool)
    padded = np.pad(values, 2, mode="edge")
    middle = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    usual = float(np.median(np.abs(np.diff(values))))  # a turn of the motion is off by two steps: twice that
    limit = max(SPIKE_NOISE * resolution.noise, SPIKE_COUNTS * resolution.step, 1e-9 * float(np.ptp(values)))
    return np.abs(values - middle) <= limit + 4.0 * usual


def turning_points(angle: Floats, threshold: float) -> list[int]:
    """Row 0, the rows of extremes from which the angle comes back by more than a threshold, and the last extreme.

    >>> turning_points(np.array([0.0, 1.0, 2.0, 1.0, 0.0, -1.0, 0.0, 2.0, 1.8]), 0.5)
    [0, 2, 5, 7]
    """
    turns, extreme, rising = [0], 0, 0
    readings = angle.tolist()  # Python's own numbers are compared faster, one by one
    first = readings[0]
    for row, reading in enumerate(readings):
        if rising == 0:
            if abs(reading - first) > threshold:
                rising = 1 if reading > first else -1
                extreme = row
        elif rising * (reading - readings[extreme]) >= 0.0:
            extreme = row
        elif rising * (readings[extreme] - reading) > threshold:
            turns.append(extreme)
            extreme, rising = row, -rising
    if rising and extreme > turns[-1]:
        turns.append(extreme)
    return turns


def strokes_of(torque: Floats, angle: Floats, resolution: Resolution, run: int = 0, first: int = 0) -> Strokes:
    """The strokes of one record, in bins.

    torque, angle  (n,) in the order of time
    run            number of the record
    first          number of its first stroke
    """
    span = float(np.ptp(angle))
    threshold = max(LEAST_TURN * span, TURN_COUNTS * resolution.step, TURN_NOISE * resolution.noise)
    stuck = max(STUCK_COUNTS * resolution.step, STUCK_NOISE * resolution.noise)
    turns = turning_points(angle, threshold)
    columns = list[tuple[float, ...]]()  # a row for each bin, as `Strokes` has the columns
    number = first
    for start, end in pairwise(turns):
        sign = 1.0 if angle[end] > angle[start] else -1.0
        rows = start + _moving_rows(sign * torque[start : end + 1], sign * angle[start : end + 1], stuck)
        if len(rows) < 2:
            continue
        for part in np.array_split(rows, min(max(MOST_BINS // (len(turns) - 1), FEWEST_BINS), BINS, len(rows))):
            place = float(np.mean(part)) / max(len(angle) - 1, 1)
            reach = 0.5 * abs(float(angle[part[-1]] - angle[part[0]])) if len(part) > 1 else 0.0
            mean_torque, mean_angle = float(np.mean(torque[part])), float(np.mean(angle[part]))
            # no turn is known before the record
            way = abs(mean_angle - float(angle[start])) if start else np.inf
            columns.append((mean_torque, mean_angle, reach, len(part), sign, number, place, run, way))
        number += 1
    torques, angles, reaches, samples, signs, numbers, places, runs, since = np.array(columns).reshape(-1, 9).T
    stroke, record = numbers.astype(np.int64), runs.astype(np.int64)
    return Strokes(torques, angles, reaches, samples, signs, stroke, places, record, since)


def _moving_rows(torque: Floats, angle: Floats, stuck: float) -> Ints:
    """Rows of a rising stroke (n,) in which the shaft moves: from where it has left its turning point by more than
    `stuck` up to the largest torque, behind which friction holds it again.

    The largest of a smoothed torque may be late by half of what is smoothed over.
    """
    width = max(len(torque) // SMOOTHED, 1) | 1  # odd
    free = angle - angle[0] > stuck
    first = int(np.argmax(free)) if free.any() else len(angle)
    return np.arange(first, int(np.argmax(smoothed_torque(torque, width))) + 1 - width // 2)


def smoothed_torque(values: Floats, width: int) -> Floats:
    """Moving average of values (n,) over `width` of them, the next odd number of an even one, those at the ends
    repeated."""
    width = max(width, 1) | 1
    padded = np.pad(values, width // 2, mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")


def joined_strokes(strokes: list[Strokes]) -> Strokes:
    """Strokes of several records as one."""
    names = [field.name for field in fields(Strokes)]
    return Strokes(*(np.concatenate([getattr(one, name) for one in strokes]) for name in names))
