"""What was simulated of one contact, and its numbers for programs and tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, isfinite, log
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.run_length import Length, heard_length, run_length

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from zwidth.contact.environments import Environment
    from zwidth.contact.hand import Hand
    from zwidth.contact.response import TimeResponse
    from zwidth.contact.simulate import Run
    from zwidth.contact.verdict import Judgement
    from zwidth.device.device import Device
    from zwidth.loop.loop import Loop
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.show.cli.contact_options import Contact
    from zwidth.show.cli.options import Question

    Floats = NDArray[np.float64]

JUDGED: Final = 32  # samples of growth that are run all the same, so that it can be told
FARTHEST: Final = 1e6  # m, to which they may grow
TRACED: Final = 17  # numbers kept of each sample
SHOWN: Final = 49  # numbers' worth of memory that each sample takes as text
COUNTED: Final = {"encoder steps", "noise"}  # of a device that moves linearly between samples
SHOWN_BETWEEN: Final = 20  # substeps of what is exact with any
SWINGS: Final = 10  # of a tremor that a run has at least


@dataclass(frozen=True)
class RangeExit:
    """A motion leaves the range of a mechanism's handle: when [s], and how far that can be from its posture along
    the direction, backward (not positive) and forward [m]."""

    time: float
    backward: float
    forward: float


@dataclass(frozen=True)
class Simulated:
    """One contact simulated.

    loop         the device without the operator;   values  of the environment
    predicted    ln rho of the linear loop on the two-sided wall; None where there is none
    start        of the reading [m], [m/s];   off_path  how far from it the handle's path passes [m]; None: unknown
    range_exit   where the motion leaves the handle's range; None where it stays within, or without a mechanism
    length       how long, and why
    without      the same without the passivity controller; None where there is none
    substeps     taken between samples
    """

    environment: Environment
    values: Floats
    hand: Hand
    loop: Loop
    predicted: float | None
    start: tuple[float, float]
    off_path: float | None
    range_exit: RangeExit | None
    length: Length
    response: TimeResponse
    judgement: Judgement
    without: TimeResponse | None
    substeps: int

    @property
    def limit(self) -> float:
        """Largest force there is [N]."""
        return self.loop.nonlinear.force_limit

    @property
    def behaviour(self) -> str:
        """As judged; "forced" where the device only goes with the hand's tremor, "growing" where it was gone
        before there was anything to judge."""
        judged, tremor = self.judgement, self.hand.tremor
        if self.response.given_up and judged.behaviour == "undecided":
            return "growing"
        if tremor is None or judged.behaviour not in ("limit cycle", "undecided"):
            return judged.behaviour
        tolerance = 1.0 / (0.5 * len(self.response.time) * self.loop.period)
        return "forced" if abs(judged.frequency - tremor.frequency) < tolerance else judged.behaviour

    @property
    def stable(self) -> bool | None:
        """Does the motion die away? None where the run does not tell."""
        return None if self.behaviour in ("forced", "undecided") else self.judgement.stable is True


def simulated(
    question: Question,
    device: Device,
    contact: Contact,
    *,
    duration: float | None,
    substeps: int,
    seed: int,
    largest_damping: float | None,
    trail: bool,
    sound: bool = False,
) -> Simulated:
    """Simulate a contact; long enough to be heard, for a sound. Raises NoAnswer, BadInput."""
    from zwidth.contact.passivity import PassivityController
    from zwidth.contact.simulate import Run
    from zwidth.contact.verdict import judge_response
    from zwidth.show.sound import seconds_to_hear

    environment, values = contact.touched()
    with computing(question):
        point = question.point(device)
        plant = point.unheld_plant
        hand = contact.hand(environment, device.operator if plant.handle is not None else None)
        start = contact.start(environment)
        _check_reach(point, contact.wall_position, "--wall-position: the wall")
        off_path = _check_reach(point, start, "--start-position: the start")
        loop = point.without_operator.loop
        predicted, frequency = _predicted(point.loop, environment, values)
        if duration is None:
            free = hand.tremor is None and hand.reach is None and largest_damping is None
            linear = predicted is not None and free and not loop.nonlinear
            length = run_length(
                predicted,
                loop.period,
                linear=linear,
                busy_until=_busy(hand),
                frequency=frequency,
                heard=seconds_to_hear(frequency) if sound else 0.0,
            )
        else:
            length = Length(duration, "as asked")
        run = Run(
            loop,
            values,
            hand=hand,
            start_position=start,
            start_velocity=contact.start_velocity,
            wall_position=contact.wall_position,
            seed=seed,
            bound=_bound(abs(start - contact.wall_position), predicted),
        )
        runs = [run]
        if largest_damping is not None:
            runs.insert(0, replace(run, passivity=PassivityController(largest_damping)))
        substeps = needed_substeps(loop, hand, substeps)
        done = _responses(runs, environment, length.seconds, substeps, trail=trail)
        if sound and duration is None and not done[0].given_up:
            longer = heard_length(length, judge_response(done[0]).frequency, loop.period)
            if longer != length:
                length = longer
                done = _responses(runs, environment, length.seconds, substeps, trail=trail)
        _check_numbers(done, environment)
        range_exit = _range_exit(point, done[0])
    return Simulated(
        environment=environment,
        values=values,
        hand=hand,
        loop=loop,
        predicted=predicted,
        start=(start, contact.start_velocity),
        off_path=off_path,
        range_exit=range_exit,
        length=length,
        response=done[0],
        judgement=judge_response(done[0]),
        without=done[1] if largest_damping is not None else None,
        substeps=substeps,
    )


def needed_substeps(loop: Loop, hand: Hand, asked: int) -> int:
    """As many as asked; of a linear device under a steady push no more than show what is between samples."""
    steady = hand.reflex is None and hand.tremor is None and hand.reach is None and not hand.ramp
    linear = not set(loop.plant.nonlinear.left_out) - COUNTED
    return min(asked, SHOWN_BETWEEN) if steady and linear else asked


def _check_numbers(responses: Sequence[TimeResponse], environment: Environment) -> None:
    """Raises NoAnswer where the environment, told a place and a velocity, answered with what is no number."""
    import numpy as np

    for response in responses:
        told = np.isfinite(response.reading) & np.isfinite(response.velocity)
        silent = np.flatnonzero(told & ~np.isfinite(response.force))
        if len(silent):
            first = silent[0]
            raise NoAnswer(
                f"{environment.name} gave no finite force at {response.time[first]:.6g} s, where it was told a "
                f"position of {response.penetration[first]:.6g} m and {response.velocity[first]:.6g} m/s; "
                "have it return a number there"
            )


def _responses(
    runs: Sequence[Run], environment: Environment, seconds: float, substeps: int, *, trail: bool
) -> list[TimeResponse]:
    """Raises BadInput for more than there is memory for, all that is shown as text included."""
    from zwidth.contact.room import TooLarge, check_room
    from zwidth.contact.simulate import simulate_batch

    samples = seconds / runs[0].loop.period
    try:
        check_room(samples * (SHOWN + TRACED * len(runs)), f"{samples:.4g} samples", "simulate a shorter time")
        return simulate_batch(runs, environment, duration=seconds, substeps=substeps, trail=trail, ledger=True)
    except TooLarge as error:
        raise BadInput(f"--duration: {error}") from None


def _predicted(held: Loop, environment: Environment, values: Floats) -> tuple[float | None, float]:
    """ln rho of the linear loop, and its frequency [Hz], 0 for none.

    None and 0 for other environments, and for estimators that are not linear.
    """
    from zwidth.chart.verdict import judge
    from zwidth.contact.environments import ENVIRONMENTS
    from zwidth.loop.estimator import NonlinearError

    if environment is not ENVIRONMENTS["wall"]:
        return None, 0.0
    try:
        judged = judge(held, [values[0]], [values[1]])
    except NonlinearError:
        return None, 0.0
    radius, frequency = float(judged.spectral_radius[0]), float(judged.frequency[0])
    known = isfinite(radius) and radius > 0.0
    return log(radius) if known else None, frequency if isfinite(frequency) else 0.0


def _busy(hand: Hand) -> float:
    """When the hand has done what it does [s]."""
    reached = 0.0 if hand.reach is None else hand.reach.start + hand.reach.duration
    slow = hand.tremor is not None and hand.tremor.frequency > 0.0
    trembled = SWINGS / hand.tremor.frequency if slow and hand.tremor is not None else 0.0
    return max(hand.ramp, reached, trembled)


def _bound(offset: float, predicted: float | None) -> float:
    """Distance from the wall at which a run is given up: lost, or grown beyond every device; more where it starts
    or grows that far."""
    from zwidth.contact.simulate import LARGEST_MOTION

    grown = offset * exp(min(max(predicted or 0.0, 0.0) * JUDGED, 600.0))
    return max(LARGEST_MOTION, 10.0 * offset, min(grown, FARTHEST))


def _check_reach(point: OperatingPoint, position: float, what: str) -> float | None:
    """How far from a typed position the handle's path passes [m]; None for a device without a mechanism. Raises
    BadInput where the handle cannot be moved so far."""
    from zwidth.model.posture import PostureError

    try:
        return point.distance_from_path(position)
    except PostureError as error:
        raise BadInput(f"{what} lies {position:g} m along the direction, out of the workspace: {error}") from None


def _range_exit(point: OperatingPoint, response: TimeResponse) -> RangeExit | None:
    """Where a motion leaves the handle's range; the whole range is asked only if an extreme cannot be reached."""
    from zwidth.model.posture import PostureError

    handle = response.handle
    try:
        for extreme in (handle.min(), handle.max()):
            point.distance_from_path(float(extreme))
    except PostureError:
        if reached := point.handle_range:
            outside = (handle < reached[0]) | (handle > reached[1])
            return RangeExit(float(response.time[outside.argmax()]), *reached) if outside.any() else None
    return None


def numbers(found: Simulated, seed: int) -> dict[str, Any]:
    """What was simulated under the keys of --json."""
    response, judged = found.response, found.judgement
    parameters = dict(zip(found.environment.names, found.values.tolist(), strict=True))
    return {
        "environment": found.environment.name,
        "parameters": parameters,
        "wall_stiffness_N_per_m": parameters.get("stiffness"),
        "wall_damping_Ns_per_m": parameters.get("damping"),
        "wall_position_m": response.wall_position,
        "start": {
            "position_m": found.start[0],
            "velocity_m_per_s": found.start[1],
            "off_the_path_m": found.off_path,
            "inside": found.start[0] > response.wall_position,
        },
        "hand": _hand(found.hand),
        "duration_s": float(response.time[-1]),
        "duration_asked_s": found.length.seconds,
        "substeps": found.substeps,
        "seed": seed,
        "stable": found.stable,
        "behaviour": found.behaviour,
        "dominant_frequency_Hz": judged.frequency,
        "amplitude_m": judged.amplitude,
        "growth_per_sample": judged.growth,
        "predicted_growth_per_sample": found.predicted,
        "contact_share": judged.contact,
        "limited_share": limited_share(found),
        "given_up": response.given_up,
        "range_m": found.range_exit and (found.range_exit.backward, found.range_exit.forward),
        "left_range_at_s": found.range_exit and found.range_exit.time,
        "ledger_J": ledger(response),
        "ledger_imbalance": response.imbalance,
        "passivity": passivity(found),
        "time_s": response.time,
        "position_m": response.reading,
        "penetration_m": response.penetration,
        "velocity_m_per_s": response.velocity,
        "force_N": response.force,
        "handle_m": response.handle,
        "energy_J": response.stored,
    }


def _hand(hand: Hand) -> dict[str, Any]:
    tremor, reach, reflex = hand.tremor, hand.reach, hand.reflex
    return {
        "push_N": hand.push,
        "ramp_s": hand.ramp,
        "tremor": tremor and {"amplitude_N": tremor.amplitude, "frequency_Hz": tremor.frequency},
        "reach": reach and {"distance_m": reach.distance, "start_s": reach.start, "duration_s": reach.duration},
        "reflex": reflex
        and {
            "threshold_N": reflex.threshold,
            "stiffness_N_per_m": reflex.arm_stiffness,
            "damping_Ns_per_m": reflex.arm_damping,
            "latency_s": reflex.latency,
            "rise_s": reflex.rise,
        },
    }


def limited_share(found: Simulated) -> float:
    """Share of the samples at which the force was cut to its limit."""
    return float((abs(found.response.force) >= found.limit * (1.0 - 1e-12)).mean())


def ledger(response: TimeResponse) -> dict[str, float]:
    """What each has put in by the end [J]."""
    from zwidth.contact.response import SOURCES

    return {name.replace(" ", "_"): float(x) for name, x in zip(SOURCES, response.energies[-1], strict=True)}


def passivity(found: Simulated) -> dict[str, Any] | None:
    """What the passivity controller costs and does; None without one."""
    if found.without is None:
        return None
    from zwidth.contact.passivity import rendered_stiffness
    from zwidth.contact.verdict import judge_response

    def felt(response: TimeResponse) -> float:
        return rendered_stiffness(response.reading, response.force, response.wall_position)

    judged = judge_response(found.without)
    return {
        "rendered_stiffness_N_per_m": felt(found.response),
        "without": {
            "rendered_stiffness_N_per_m": felt(found.without),
            "stable": judged.stable,
            "behaviour": judged.behaviour,
            "amplitude_m": judged.amplitude,
        },
    }


def columns(document: dict[str, Any], response: TimeResponse) -> dict[str, Any]:
    """The same in time as columns, each entry of the ledger with its own."""
    keys = ("time_s", "position_m", "penetration_m", "velocity_m_per_s", "force_N", "handle_m", "energy_J")
    entries = {f"{name}_J": response.energies[:, i] for i, name in enumerate(document["ledger_J"])}
    return {key: document[key] for key in keys} | entries
