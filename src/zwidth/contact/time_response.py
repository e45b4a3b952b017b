"""A run in time, and what it says: see `judge_response` for how it is judged.

Verdict on a simulated motion: it decays, grows, is a limit cycle, bounces, or leaves the wall.

The second half of the run is judged, by its third and its last quarter. Growth is measured on the differences from
sample to sample, which do not depend on where the device comes to rest: with d_j = y_{j+1} - y_j,

    growth = ln( rms(d, last quarter) / rms(d, third quarter) ) / (samples between them)     per sample

Each motion rho^j gives ln rho, in the end that of the slowest decay or the fastest growth: the logarithm of the
spectral radius. The quarters are weighted by a Hann window, so that a started period does not count. The
verdict holds for this start only: without a hand the wall may hold a small motion and lose a large one.

A steady push moves a device on a wall without stiffness on and on, with the velocity that the damping leaves: the
position that nobody holds is no vibration. There the changes of d are judged in its place, which that velocity
has none of.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, Literal, NamedTuple

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.contact.computer import FORCE, HANDLE, READING, TRUTH, VELOCITY, Records
from zwidth.model.argument_checks import check_kind
from zwidth.result import Result, documented, entry

# The ledger's entries, in the engine's order; the last is what the plant has stored.
SOURCES: Final = (
    "hand",
    "wall",
    "hold",
    "velocity estimate",
    "quantiser",
    "passivity controller",
    "actuator",
    "friction",
    "brakes",
    "nonlinear springs",
    "structure",
)


class RunSettings(NamedTuple):
    """Settings of a run.

    samples  their number;   offsets (p,)  ends of the substeps after a sample [s];   the others as in TimeResponse
    """

    samples: int
    offsets: Floats
    period: float
    wall_position: float
    quantum: float
    noise: float
    linear: bool
    surface: bool
    held: bool


@dataclass(frozen=True, repr=False)
class TimeResponse(Result):
    """Motion of a loop in time; S samples.

    period           T [s]
    wall_position    where the environment begins [m]
    time             (S,)  [s]
    reading          (S,)  what the encoders count [m]
    truth            (S,)  the same without steps and noise [m]
    velocity         (S,)  its estimate [m/s]
    force            (S,)  commanded [N]
    handle           (S,)  [m]
    trail_time, trail  (k,)  handle after each substep [s], [m]; empty where not kept
    energies         (S, 11) what each of SOURCES has put in since the start [J]; empty where not kept
    stored           (S,)    kinetic and elastic energy beyond that at the start [J]
    given_up         the reading left the bounds before the end
    quantum          largest step of the reading, of all encoders together [m]; 0 where it has none
    noise            standard deviation of the reading's noise [m]
    linear           the device is linear, and the environment is the two-sided wall
    surface          the environment has a surface, so that contact can be lost
    held             a hand pushes the device against the wall
    """

    period: float
    wall_position: float = field(metadata=entry("m"))
    time: Floats = field(metadata=entry("s"))
    reading: Floats = field(metadata=entry("m", name="position"))
    truth: Floats
    velocity: Floats = field(metadata=entry("m/s"))
    force: Floats = field(metadata=entry("N"))
    handle: Floats = field(metadata=entry("m"))
    trail_time: Floats
    trail: Floats
    energies: Floats
    stored: Floats = field(metadata=entry("J", name="energy", empty="left out"))
    given_up: bool = field(metadata=entry(before="time"))
    quantum: float
    noise: float
    linear: bool
    surface: bool
    held: bool

    @classmethod
    def of(cls, plan: RunSettings, records: Records, i: int) -> TimeResponse:
        """Run i of a batch, whose settings are `plan`, cut to the samples that were run."""
        S = int(records.samples[i])
        traces, ledger = records.traces[i, :S], records.ledger[i, :S]
        fine = S * len(plan.offsets) if records.handle.shape[1] else 0
        time = np.arange(S, dtype=float) * plan.period
        return cls(
            period=plan.period,
            wall_position=plan.wall_position,
            time=time,
            reading=traces[:, READING],
            truth=traces[:, TRUTH],
            velocity=traces[:, VELOCITY],
            force=traces[:, FORCE],
            handle=traces[:, HANDLE],
            trail_time=(time[:, None] + plan.offsets).ravel() if fine else np.zeros(0),
            trail=records.handle[i, :fine],
            energies=ledger[:, :-1],
            stored=ledger[:, -1],
            given_up=plan.samples > S,
            quantum=plan.quantum,
            noise=plan.noise,
            linear=plan.linear,
            surface=plan.surface,
            held=plan.held,
        )

    @property
    @documented("m", before="velocity")
    def penetration(self) -> Floats:
        """(S,) of the reading into the environment [m]; negative outside."""
        return self.reading - self.wall_position

    @cached_property
    def imbalance(self) -> float:
        """By how much the ledger misses adding up, relative to the largest energy in it; nan without one."""
        if not self.energies.size:
            return float("nan")
        gap = np.abs(self.energies.sum(axis=1) - self.stored)
        return float(gap.max() / max(np.abs(self.energies).max(), np.abs(self.stored).max(), 1e-300))

    def table(self) -> dict[str, Floats]:
        """The motion in time as columns; where it is kept, each entry of the energy ledger with its own."""
        entries = enumerate(SOURCES if self.energies.size else ())
        return self.series | {f"{as_key(name)}_J": self.energies[:, i] for i, name in entries}

    @property
    def series(self) -> dict[str, Floats]:
        """The records of each sample, by key and unit, with the stored energy where it was recorded."""
        return dict(super().table())

    def __repr__(self) -> str:
        """One line with the number of samples, the time [s] and the largest force [N]."""
        largest = float(np.max(np.abs(self.force), initial=0.0))
        given_up = ", stopped early" if self.given_up else ""
        last = float(self.time[-1]) if len(self.time) else 0.0
        return f"TimeResponse: {len(self.time)} samples, {last:.4g} s{given_up}, largest force {largest:.4g} N"


def as_key(source: str) -> str:
    """The name of one of SOURCES as part of a key."""
    return source.replace(" ", "_")


Behaviour = Literal[
    "converged", "decaying", "drifting", "growing", "limit cycle", "bouncing", "lost contact", "undecided"
]

QUIET: Final = 1e-9  # share of the largest motion of a run that counts as none
LINEAR_TREND: Final = (
    1e-3  # change of the logarithm between quarters that decides, where nothing but growth can be
)
TREND: Final = 0.2  # the same where a limit cycle may be: 20 % between quarters
STEADY: Final = 0.05  # below it, the motion goes round
DIGITS: Final = 1e-14  # share of a position that its rounding may be, in the changes of its differences
FEWEST: Final = 16  # samples


@dataclass(frozen=True)
class Judgement:
    """Verdict on a run.

    behaviour     converged: at rest inside; decaying; drifting: on and on under a push; growing; limit cycle:
                  keeps its size without losing contact;
                  bouncing: in and out without an end; lost contact: out, and not back; undecided
    stable        True for converged, decaying and drifting, None for undecided
    growth        of the motion per sample, ln rho; nan where nothing moves
    amplitude     half of peak to peak of the handle in the last quarter [m]
    frequency     dominant in the second half [Hz]; nan where nothing moves
    contact       share of the second half with a force

    A run that is too short to judge has growth and frequency nan, and the others of the whole run.
    """

    behaviour: Behaviour
    growth: float
    amplitude: float
    frequency: float
    contact: float

    @property
    def stable(self) -> bool | None:
        """Whether the motion decays inside the wall; None where that is undecided."""
        if self.behaviour == "undecided":
            return None
        return self.behaviour in ("converged", "decaying", "drifting")


def judge_response(response: TimeResponse, *, drifts: bool = False) -> Judgement:
    """Judge a run; one with fewer than 16 samples is undecided, unless it has left its bounds by growing.

    drifts  whether a steady push moves the device where no stiffness holds a position: leaving the bounds is no
            growth then

    A motion below half the encoder's step that the encoder does not see is at rest; so is one that noise alone
    keeps up, below half a step and three standard deviations. One that the encoder sees goes round, however small.

    >>> from zwidth.contact.environments import wall
    >>> from zwidth.contact.loop_simulation import simulate
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.loop.loop import Loop
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> loop = Loop(Plant(0.1 * one[:, None], *np.zeros((2, 1, 1)), one, one), Controller(0.001))
    >>> values = wall.values(stiffness=1000.0, damping=0.4)    # B < K T/2
    >>> judge_response(simulate(loop, wall, values, duration=2.0, start_position=1e-3)).behaviour
    'growing'
    """
    check_kind("response", response, TimeResponse)
    S = len(response.time)
    touching = response.force != 0.0
    if S < FEWEST:
        judged: Behaviour = "growing" if response.given_up and not drifts else "undecided"
        return Judgement(
            judged, float("nan"), _half_peak_to_peak(response.handle), float("nan"), float(touching.mean())
        )
    # third and last quarter, and second half; before, after: the changes in these quarters
    third, last, half = slice(S // 2, S // 4 * 3), slice(S // 4 * 3, S), slice(S // 2, S)
    # of the place or, with `drifts`, of the velocity
    changes = np.diff(response.truth, n=2 if drifts else 1)
    size = float(np.abs(changes[np.isfinite(changes)]).max(initial=0.0))
    before, after = _rms(changes[S // 2 : S // 4 * 3]), _rms(changes[S // 4 * 3 :])
    # size of changes that counts as rest
    floor = max(QUIET * size, 1e-300)
    if drifts:  # far away, second differences are rounding of the position
        floor = max(floor, DIGITS * float(np.abs(response.truth[np.isfinite(response.truth)]).max(initial=0.0)))
    moving = after > floor or (response.given_up and not drifts)
    growth = float(np.log(after / before)) if moving and before > 0.0 else float("nan")
    contact = float(touching[half].mean())
    judged = _behaviour(response, touching, third, last, growth, moving, drifts)
    per_sample = growth / (S // 4) if moving else float("nan")
    tone = dominant_frequency(response.truth[half], response.period) if moving else float("nan")
    return Judgement(judged, per_sample, _half_peak_to_peak(response.handle[last]), tone, contact)


def _behaviour(
    response: TimeResponse,
    touching: Flags,
    third: slice,
    last: slice,
    growth: float,
    moving: bool,
    drifts: bool,
) -> Behaviour:
    """Behaviour of a run.

    touching     (S,)  whether a force acts at a sample
    third, last  the quarters of the run that are compared
    growth       logarithm of the last quarter's changes over the third's; nan without such changes
    moving       whether the place, with `drifts` the velocity, changes in the last quarter, or the device has left
                 its bounds by growing;   drifts  as in `judge_response`
    """
    if (response.given_up and not drifts) or not np.all(np.isfinite(response.truth)):
        return "growing"
    inside = float(touching[last].mean())
    if response.surface and inside == 0.0 and not touching[third].any():
        # a hand may still push a device to the wall that has never touched it
        return "lost contact" if touching.any() or not response.held else "undecided"
    if inside < 1.0 and response.surface:
        return "bouncing" if growth > -TREND else "undecided"
    if drifts and not moving:
        return "drifting"
    if not moving or _at_rest(response, last):
        return "converged"
    trend = LINEAR_TREND if response.linear else TREND
    if growth < -trend:
        return "drifting" if drifts else "decaying"
    if growth > trend:
        return "growing"
    return "limit cycle" if abs(growth) < STEADY and not response.linear and not drifts else "undecided"


def _at_rest(response: TimeResponse, last: slice) -> bool:
    """Whether the motion in the quarter `last` is smaller than what encoders resolve, or their noise keeps up."""
    swing = _half_peak_to_peak(response.truth[last])
    if response.noise > 0.0:
        return swing < 0.5 * response.quantum + 3.0 * response.noise
    return swing < 0.5 * response.quantum and np.ptp(response.reading[last]) == 0.0


def _rms(signal: Floats) -> float:
    """Root mean square under a Hann window, in the signal's unit; inf or nan where the largest value is that."""
    # without the zeros at both ends of the window
    weight, size = np.hanning(len(signal) + 2)[1:-1], float(np.abs(signal).max(initial=0.0))
    if not 0.0 < size < np.inf:
        return size
    return size * float(np.sqrt(np.sum(weight * (signal / size) ** 2) / np.sum(weight)))


def _half_peak_to_peak(signal: Floats) -> float:
    """Half of a signal's peak to peak, in its unit; nan without samples."""
    return float(np.ptp(signal) / 2.0) if len(signal) else float("nan")


def dominant_frequency(signal: Floats, period: float) -> float:
    """Frequency with the most of a signal's motion [Hz], between 0 and 1/(2T); nan for one that does not move, has
    fewer than 16 samples, or is not finite.

    The peak of the spectrum of a Hann-windowed signal less its straight line, between bins by a parabola through
    the logarithms. For a steady tone it is right to about a hundredth of 1/(length).

    >>> round(dominant_frequency(np.sin(2 * np.pi * 50.0 * np.arange(800) * 0.001), 0.001), 3)
    50.0
    """
    k = len(signal)
    if k < FEWEST or not np.all(np.isfinite(signal)):
        return float("nan")
    samples = np.arange(k) - (k - 1) / 2.0  # from the middle
    straight = signal.mean() + samples * (samples @ signal) / (samples @ samples)
    windowed = (signal - straight) * np.hanning(k)
    size = float(np.abs(windowed).max())
    if not size > 0.0:
        return float("nan")
    spectrum = np.abs(np.fft.rfft(windowed / size, 4 * k))  # four times as fine as the length gives
    peak = int(np.argmax(spectrum[1:-1])) + 1  # one with a neighbour on either side
    before, at, after = np.log(np.maximum(spectrum[peak - 1 : peak + 2], 1e-300))
    bend = before - 2.0 * at + after
    shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float((peak + np.clip(shift, -0.5, 0.5)) / (4 * k * period))
