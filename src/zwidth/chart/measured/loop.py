"""A measured device under a sampled wall law, 1 + P(z)(K + B w(z)) = 0 with P known at points of the circle.

Which measured frequencies are used, and which stretches of frequency cannot be relied on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats, Ints
from zwidth.chart.measured.response_interpolation import (
    FEWEST,
    ResponseInterpolation,
    around_one,
    interpolate_response,
    smooth_part,
)
from zwidth.errors import ResponseError
from zwidth.loop.controller import Controller
from zwidth.loop.factor_response import factor_response, window_response
from zwidth.loop.loop_table import force_filter, velocity_estimator
from zwidth.model.response import (
    CONFIDENCE,
    LEAST_COHERENCE,
    UNSURE,
    LowFrequencies,
    Response,
    integrators_of,
    joint_radius,
    low_frequencies,
    usable_frequencies,
)
from zwidth.result import Documented, entry

BETWEEN = 2.0  # times the error that interpolation is expected to leave: what is allowed for between frequencies
SETTLED = np.radians(3.0)  # phase at the lowest frequency, below which nothing is fitted to what lies below
UNSURE_ACROSS = 0.1  # relative error from which the response is taken straight across what is not used
ENDING = 7  # last frequencies from which the response is continued to half the sampling rate, and steps of that
HALVINGS = 12  # of the lowest frequency, at which what is fitted continues the response, at most


@dataclass(frozen=True)
class MeasuredLoop:
    """A response and the computer's part of the loop. Its delay is that of software alone, in whole samples.

    usable  which of the response's frequencies are used
    """

    response: Response
    controller: Controller
    usable: Flags = field(init=False)

    def __post_init__(self) -> None:
        """Choose the usable frequencies.

        Raises  ResponseError  where they are too few or too high, or where the controller holds what the response
                               holds already, or what only a model can tell
        """
        if self.controller.fixed_feedback:
            raise ResponseError(
                f"a measured response has no model from which {self.controller.feedback_names[0]} could be "
                "computed; measure it with that switched on, and leave it out of the file"
            )
        delay, f = self.controller.delay, self.response.frequency
        if abs(delay - round(delay)) > 1e-9:
            raise ResponseError(
                f"a measured response holds the device's delay already, and the computer can add whole samples "
                f"only, got {delay:g}; leave delay_samples out"
            )
        if self.controller.actuator_time_constant > 0.0:
            raise ResponseError(
                "a measured response holds the actuator's lag already; leave actuator_time_constant out"
            )
        half = 0.5 / self.period
        if len(f) and f[-1] > half * (1.0 + 1e-9):
            raise ResponseError(
                f"has frequencies up to {f[-1]:.6g} Hz, above half the sampling rate, {half:.6g} Hz; leave them "
                "out, or correct sampling_period_s"
            )
        good = usable_frequencies(self.response)
        if np.count_nonzero(good) < FEWEST:
            raise ResponseError(
                f"has {np.count_nonzero(good)} usable frequencies of {len(f)}; at least {FEWEST} are needed, "
                "a few hundred for an accurate chart"
            )
        object.__setattr__(self, "usable", good)

    @property
    def period(self) -> float:
        """Sampling period T [s]."""
        return self.controller.sampling_period

    @cached_property
    def integrators(self) -> int:
        """Number of poles of P at z = 1."""
        return integrators_of(self.response, self.period)

    @cached_property
    def angles(self) -> Floats:
        """theta = 2 pi f T (n,) of the usable frequencies, in (0, pi]."""
        theta = 2.0 * np.pi * self.response.frequency[self.usable] * self.period
        return np.where(theta > np.pi * (1.0 - 1e-9), np.pi, theta)

    @property
    def angles_below_pi(self) -> Floats:
        """Those of `angles` below pi, where K and B are defined."""
        return self.angles[self.angles < np.pi]

    @cached_property
    def interpolation(self) -> ResponseInterpolation:
        """The response interpolated between `angles`, continued below them, and above where it is known small."""
        closed, to_end = reaches_half_rate(self.angles)
        low, P_low = self._continued_down()
        high, P_high = (np.empty(0), np.empty(0)) if to_end or not self.bounded else self._continued_up()
        return interpolate_response(
            np.concatenate([low, self.angles, high]),
            np.concatenate([P_low, self.response.value[self.usable], P_high]),
            self.integrators,
            closed=closed or self.bounded,
            measured_to_half_rate=to_end,
            straight=np.concatenate(
                [np.zeros(len(low), dtype=bool), self._across_noise, np.ones(len(high), dtype=bool)]
            ),
        )

    @property
    def _across_noise(self) -> Flags:
        """Which intervals (n - 1,) of `angles` hold frequencies left out as noise, and have an unsure end."""
        if self.errors is None:
            return np.zeros(len(self.angles) - 1, dtype=bool)
        left_out = np.diff(np.flatnonzero(self.usable)) > 1
        return np.asarray(left_out & (np.maximum(self.errors[1:], self.errors[:-1]) > UNSURE_ACROSS))

    @cached_property
    def low_frequencies(self) -> LowFrequencies:
        """Stiffness, damping and mass to the ground that the lowest frequencies show."""
        return low_frequencies(self.response)

    def _continued_down(self) -> tuple[Floats, Complexes]:
        """Angles below the data and P there, from the fit; none where the phase has settled, or nothing fits, or
        what would rule P there is not positive."""
        m, f = self.integrators, self.response.frequency[self.usable][0]
        P = self.response.value[self.usable][0]
        none = np.empty(0), np.empty(0, dtype=complex)
        if abs(np.angle(P * around_one(self.angles[0]) ** m)) < SETTLED or not self.low_frequencies.fits:
            return none
        # of stiffness, damping and mass the one that rules a response with m integrators
        if self.low_frequencies.terms[m] <= 0.0:
            return none
        shares = 0.5 ** np.arange(HALVINGS, 0, -1)
        fitted = 1.0 / self.low_frequencies.inverse(shares * f, m)
        # to what was measured: the whole difference in size, and the part in phase that is left at the frequency
        ratio = P * self.low_frequencies.inverse(np.array(f), m)
        return self.angles[0] * shares, fitted * np.abs(ratio) * np.exp(1j * shares * np.angle(ratio))

    def _continued_up(self) -> tuple[Floats, Complexes]:
        """Angles above the last usable one, and P there: P (z - 1)^m as large as it was, its phase turned evenly
        to that of a real number."""
        P, m, last = self.response.value[self.usable], self.integrators, self.angles[-1]
        G, delay = smooth_part(self.angles, P, m)
        near = slice(-ENDING, None)
        size, phase = np.exp(np.median(np.log(np.abs(G[near])))), np.angle(np.sum(G[near] / np.abs(G[near])))
        share = np.arange(1, ENDING + 1) / ENDING
        turned = phase + share * (np.pi * np.round(phase / np.pi) - phase)
        theta = last + share * (np.pi - last)
        continued = size * np.exp(1j * (turned - delay * theta)) / around_one(theta) ** m
        return theta, continued

    @cached_property
    def unusable(self) -> tuple[UnusableRange, ...]:
        """Stretches of frequency that cannot be relied on, ascending."""
        return tuple(unusable_ranges(self.response, self.usable, self.period, self.interpolation))

    @property
    def largest_angle(self) -> float:
        """The largest angle that the response reaches: pi, or that of the last frequency."""
        return float(np.pi if self.interpolation.closed else self.angles[-1])

    def h(self, theta: Floats) -> Complexes:
        """h = -1/P (...) [N/m] at angles in (0, pi], software delay and force filter in P; inf where P is 0."""
        delay, force = round(self.controller.delay), force_filter(self.controller)
        with np.errstate(divide="ignore", invalid="ignore"):
            passed = factor_response(force.numerator, force.denominator, around_one(theta))
            return np.asarray(-self.interpolation.inverse(theta) * np.exp(1j * theta * delay) / passed)

    def w(self, theta: Floats) -> Complexes:
        """Response w (...) [1/s] of the velocity estimate to the position, at angles theta in (0, pi]."""
        d, estimator = around_one(theta), velocity_estimator(self.controller)
        return np.asarray(
            factor_response(estimator.numerator, estimator.denominator, d)
            * window_response(estimator.window, 1.0 + d)
        )

    def walls(self, theta: Floats) -> tuple[Floats, Floats, Floats]:
        """K [N/m], B [N s/m] of the wall with a root at exp(i theta), and sign of Im w: each (...) as theta."""
        h, w = self.h(theta), self.w(theta)
        with np.errstate(divide="ignore", invalid="ignore"):
            B = h.imag / w.imag
            return h.real - B * w.real, B, np.sign(w.imag)

    @cached_property
    def errors(self) -> Floats | None:
        """Radius (n,) of the disk round each P of `angles` that holds the true one, over |P|; None: unknown.

        All of them together with 95 %: see `joint_radius`.
        """
        return None if self._radius is None else self._radius[self.usable]

    @cached_property
    def _radius(self) -> Floats | None:
        """Error of P at all frequencies (n,), usable or not, over |P|, as in `errors`; None: unknown."""
        return joint_radius(self.response)

    @cached_property
    def _doubted(self) -> Ints:
        """Indices of frequencies that are not used, although something was measured there."""
        known = self._radius is not None and np.isfinite(self._radius) & np.isfinite(self.response.value)
        return np.flatnonzero(known & ~self.usable)

    @cached_property
    def error_nodes(self) -> tuple[Floats, Floats] | None:
        """Angles (k,) within the data, and how far the true response may be from the interpolated one there,
        over the latter (k,); None where no error is known."""
        if self._radius is None or self.errors is None:
            return None
        at = self._doubted
        theta = 2.0 * np.pi * self.response.frequency[at] * self.period
        within = (theta > self.angles[0]) & (theta <= self.largest_angle * (1.0 + 1e-9))
        at, theta = at[within], np.minimum(theta[within], np.pi)
        with np.errstate(divide="ignore", invalid="ignore"):
            measured = self.response.value[at] * self.interpolation.inverse(theta)
        radius = np.abs(measured - 1.0) + self._radius[at] * np.abs(measured)
        order = np.argsort(np.concatenate([self.angles, theta]), kind="stable")
        return np.concatenate([self.angles, theta])[order], np.concatenate([self.errors, radius])[order]

    def _node_error(self, theta: Floats) -> Floats:
        """The error of `error_nodes` at angles (...), over |P|: between used frequencies interpolated as such,
        else as the error of P (z - 1)^m, since there the response itself is not known."""
        assert self.error_nodes is not None
        angles, radius = self.error_nodes
        used = np.isin(angles, self.angles)
        with np.errstate(divide="ignore"):
            # |P (z - 1)^m| at the nodes, and its inverse at theta
            size = 1.0 / np.abs(self.interpolation.inverse(angles) * around_one(angles) ** -self.integrators)
            inverse = np.abs(self.interpolation.inverse(theta) * around_one(theta) ** -self.integrators)
        relative = np.interp(theta, angles, radius)
        absolute = np.interp(theta, angles, radius * size) * inverse
        after = np.clip(np.searchsorted(angles, theta), 1, len(angles) - 1)
        return np.asarray(np.where(used[after] & used[after - 1], relative, absolute))

    @cached_property
    def bounded(self) -> bool:
        """Whether something was measured at least nearly up to half the sampling rate, if only noise: then the
        response is known not to exceed it."""
        theta = 2.0 * np.pi * self.response.frequency[self._doubted] * self.period
        return bool(np.any(theta >= CONTINUED * np.pi))

    def relative_error(self, theta: Floats) -> Floats:
        """How far the true response may be from the interpolated one at angles (...), over the latter.

        Between frequencies twice what interpolation is expected to leave; beyond the last as much more as the
        response changed over as long a way before. 0 where no error is known.
        """
        if self.error_nodes is None:
            return np.zeros(np.shape(theta))
        angles, theta = self.error_nodes[0], np.asarray(theta)
        error = self._node_error(theta) + BETWEEN * self.interpolation.relative_error(theta)
        past = np.maximum(theta - angles[-1], 0.0)  # how far beyond the last frequency
        if np.pi - angles[-1] > 1e-9 and np.any(past > 0.0):
            P = 1.0 / self.interpolation.inverse(np.array([max(2.0 * angles[-1] - np.pi, angles[0]), angles[-1]]))
            changed = np.abs(np.log(np.abs(P[1] / P[0]))) + np.abs(np.angle(P[1] / P[0]))
            error = error + changed * past / (np.pi - angles[-1])
        return np.asarray(error)

    def error_below(self, theta: Floats) -> Floats:
        """How far the true h may be from the interpolated one at angles (...) below the data [N/m].

        Of what is fitted to the lowest frequencies, with all its terms: whether there is a weak spring or a weak
        dashpot to the ground is a part of it. Where nothing fits, as much as h at the lowest frequencies. 0 where
        no error is known.
        """
        theta = np.asarray(theta)
        if self.error_nodes is None:
            return np.zeros(theta.shape)
        if not self.low_frequencies.fits:
            lowest = self.angles[self.angles <= 2.0 * self.angles[0]]
            largest = np.max(np.abs(self.h(lowest)) * (1.0 + self.error_nodes[1][0]))
            return np.broadcast_to(largest, theta.shape)
        f = theta / (2.0 * np.pi * self.period)
        # of one deviation, for all angles together with the probability CONFIDENCE
        often = np.sqrt(2.0 * np.log(len(self.angles) / (1.0 - CONFIDENCE)))
        fitted = np.abs(self.low_frequencies.inverse(f, 0) - self.low_frequencies.inverse(f, self.integrators))
        floor = (self.error_nodes[1][0] + self.interpolation.relative_error(theta)) * np.abs(
            self.low_frequencies.inverse(f, self.integrators)
        )
        return np.asarray(often * self.low_frequencies.deviation(f) + fitted + floor)


LARGEST_PHASE: Final = np.radians(30.0)  # at the lowest frequency, beyond that of the integrators
COARSEST: Final = 0.02  # relative error of P that interpolation may be expected to leave
WIDEST_GAP: Final = 4.0  # times the spacing around it, and
WIDEST_RATIO: Final = 1.25  # of the frequencies on both sides
SAME_STRETCH: Final = 10  # most frequencies from one uncertain frequency to the next in one stretch
SHORT_OF_END: Final = 2.0  # times the last spacing: near enough to half the sampling rate
CONTINUED: Final = 0.8  # of half the sampling rate: from here on the response is continued to it


@dataclass(frozen=True)
class UnusableRange(Documented):
    """Frequencies low to high [Hz] whose part of the boundary cannot be relied on, and why.

    on_edge  whether the edge of the stable set runs through it; None where it is not known
    """

    low: float = field(metadata=entry("Hz"))
    high: float = field(metadata=entry("Hz"))
    reason: str = field(metadata=entry())
    on_edge: bool | None = field(default=None, metadata=entry())


def reaches_half_rate(theta: Floats) -> tuple[bool, bool]:
    """Whether a response at angles theta (n,) is taken on to pi, and whether it was measured that far."""
    spacing = np.max(np.diff(theta[-4:]))
    measured = bool(np.pi - theta[-1] <= SHORT_OF_END * spacing)
    return measured or bool(theta[-1] >= CONTINUED * np.pi), measured


def unusable_ranges(
    response: Response, good: Flags, period: float, interpolation: ResponseInterpolation
) -> Iterator[UnusableRange]:
    """Stretches of frequency that cannot be relied on, ascending; good (n,): which frequencies are used."""
    f = response.frequency[good]
    theta = 2.0 * np.pi * f * period
    half = 0.5 / period
    m = interpolation.integrators
    phase = float(np.angle(response.value[good][0] * around_one(theta[0]) ** m))
    # halfway from 0 to the first angle, and between each two
    errors = interpolation.relative_error(0.5 * (np.append(0.0, theta[:-1]) + theta))
    if abs(phase) > LARGEST_PHASE or errors[0] > COARSEST:
        yield UnusableRange(
            0.0,
            float(f[0]),
            f"below the data, whose phase is {np.degrees(phase):.0f} degrees from that of {m} integrators at "
            f"{f[0]:.6g} Hz; the response is continued to 0: measure lower",
        )
    yield from sorted(
        [*_incoherent_stretches(response, good), *_unmeasured_stretches(f, errors[1:])], key=lambda s: s.low
    )
    goes_on, measured = reaches_half_rate(theta)
    if not measured:
        consequence = (
            "the response is continued to half the sampling rate"
            if goes_on
            else "walls that fail at a higher frequency are not seen"
        )
        yield UnusableRange(float(f[-1]), half, f"beyond the data, which end at {f[-1]:.6g} Hz; {consequence}")


def _incoherent_stretches(response: Response, good: Flags) -> Iterator[UnusableRange]:
    """Stretches of frequencies that are not `good` (n,), up to SAME_STRETCH from one to the next, each from the
    frequency before (0 if there is none) to that after (the last itself if there is none)."""
    for run in _groups_of_true(~good, SAME_STRETCH):
        low = response.frequency[run[0] - 1] if run[0] > 0 else 0.0
        high = response.frequency[min(run[-1] + 1, len(good) - 1)]
        if response.coherence is None:
            yield UnusableRange(float(low), float(high), "no response is given")
        else:
            least = float(np.min(response.coherence[run]))
            known = f"coherence down to {least:.2g}"
            reason = (
                f"{known}, less than {LEAST_COHERENCE:g}"
                if least < LEAST_COHERENCE
                else f"{known} of {response.averages:.3g} averages leaves an error of more than {100 * UNSURE:g} %"
            )
            yield UnusableRange(float(low), float(high), reason)


def _unmeasured_stretches(f: Floats, errors: Floats) -> Iterator[UnusableRange]:
    """Stretches of f (n,) [Hz] where nothing was measured, or where interpolation between neighbours leaves too
    large a relative error of P: errors (n - 1,)."""
    spacing = np.diff(f)
    # the usual spacing about each interval
    around = np.array([np.median(spacing[max(0, i - 5) : i + 6]) for i in range(len(spacing))])
    empty = (spacing > WIDEST_GAP * around) & (f[1:] > WIDEST_RATIO * f[:-1])
    coarse = (errors > COARSEST) & ~empty
    for run in _groups_of_true(coarse, SAME_STRETCH):
        yield UnusableRange(
            float(f[run[0]]),
            float(f[run[-1] + 1]),
            "the response changes so fast from one frequency to the next that what lies between is uncertain by "
            f"up to {100.0 * float(np.max(errors[run])):.2g} %; measure closer",
        )
    for run in _groups_of_true(empty):
        yield UnusableRange(
            float(f[run[0]]), float(f[run[-1] + 1]), "nothing measured; the response is interpolated"
        )


def _groups_of_true(flags: Flags, reach: int = 1) -> list[Ints]:
    """Indices of the true flags in groups, within which neighbours are no farther apart than `reach`."""
    at = np.flatnonzero(flags)
    return np.split(at, np.flatnonzero(np.diff(at) > reach) + 1) if len(at) else []
