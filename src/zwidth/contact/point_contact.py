"""Simulated contact with a wall or another environment: from an operating point to a verdict.

Arguments of a contact: which environment with which parameters, which hand, and what is wrong with them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final, Literal, NamedTuple

import numpy as np

from zwidth.argument import check_arguments
from zwidth.arrays import Floats
from zwidth.contact.contact_simulation import (
    ContactSimulation,
    PredictedGrowth,
    RangeExit,
    RunLength,
    bound_of_run,
    contact_run_length,
    is_pushed_on,
    lengthened,
    needed_substeps,
    predicted_growth,
)
from zwidth.contact.environments import ENVIRONMENTS
from zwidth.contact.environments.catalogue import load_environment
from zwidth.contact.environments.environment import Environment
from zwidth.contact.hand import Hand, Reach, Reflex, Tremor
from zwidth.contact.loop_simulation import SUBSTEPS, Run, simulate_batch
from zwidth.contact.passivity_controller import PassivityController
from zwidth.contact.time_response import Judgement, TimeResponse, judge_response
from zwidth.errors import ArgumentError, NoAnswerError, PostureError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind
from zwidth.model.operator import Operator
from zwidth.progress import Progress
from zwidth.questions import SIMULATE

WallSides = Literal["two-sided", "one-sided"]

DEPTH: Final = 1e-3  # m, at the start: inside what acts everywhere, outside what has a surface


def simulate_contact(
    point: OperatingPoint,
    stiffness: float | None = None,
    damping: float | None = None,
    *,
    wall: WallSides = "two-sided",
    no_pull: bool = False,
    environment: str | Environment | None = None,
    parameters: Mapping[str, float] | None = None,
    wall_position: float = 0.0,
    start_position: float | None = None,
    start_velocity: float = 0.0,
    push: float | None = None,
    ramp: float = 0.0,
    tremor: Tremor | None = None,
    reach: Reach | None = None,
    reflex: Reflex | None = None,
    passivity_damping: float | None = None,
    duration: float | None = None,
    substeps: int = SUBSTEPS,
    seed: int = 0,
    trail: bool = True,
    seconds_to_hear: Callable[[float], float] | None = None,
    progress: Progress | None = None,
) -> ContactSimulation:
    """Simulate what happens when a device touches a wall, or something else.

    point              the device, and the operator who holds it
    stiffness, damping  of the wall, or of an environment that has them [N/m], [N s/m]; a wall needs a stiffness
    wall               whether the wall acts on both sides of its position; under load, a one-sided one acts up to
                       F/K outside the posture that it holds
    no_pull            the one-sided wall, or an environment that can, never pulls the device inwards
    environment        something else to touch: an Environment, a bundled name or "file.py:name"; None: the wall
    parameters         of the environment by name; those left out have its defaults
    wall_position      position of the wall's surface, or of where the environment begins [m]
    start_position     position at the start, of the reading [m]; None: 1 mm outside an environment with a surface,
                       1 mm inside any other
    start_velocity     velocity at the start [m/s]
    push               constant force of the hand towards the wall [N]; None: 2 against a surface, unless the hand
                       reaches; else 0
    ramp               time in which the push rises to its full value [s]
    tremor, reach, reflex  of the hand; None: none
    passivity_damping  add a time-domain passivity controller, whose damper is at most B, this [N s/m]; None: none.
                       The same run is then made without it, too
    duration           simulated time [s]; None: a tenfold change at the predicted rate and at least eight periods,
                       at most 60 s; 2 s and more where something is not linear (see `run_length`)
    substeps           integration steps per sample, where the device or the environment is not linear; at most 20
                       of a linear device under a steady push, which is exact with any
    seed               of the encoders' noise
    trail              keep the handle's position after each substep
    seconds_to_hear    of a run that is to be heard: seconds that it lasts at least, by its frequency [Hz]
    progress           called with "simulating", the samples done, and all samples
    Raises  ArgumentError  for arguments that do not go together, that the environment does not take, or
                                  that need an operator
            ArgumentError   (one of these) for a start or a wall that the handle cannot be moved to
            NoAnswerError          where the environment returns no number
            TooLarge              (resources) for more samples than there is memory for
            ValueError            for numbers that are out of range
            what `OperatingPoint.plant` raises

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> plant = Plant(0.1 * one[:, None], *np.zeros((2, 1, 1)), one, one)
    >>> point = OperatingPoint(Controller(0.001), given_plant=plant)
    >>> simulate_contact(point, 1000.0, 2.0)
    ContactSimulation: wall, stiffness 1000 N/m, damping 2 N s/m
      stable: decaying, growth -0.007583 per sample (predicted -0.007582)
      amplitude 5.223e-05 m, dominant frequency 16.01 Hz
      largest force 1 N, deepest 0.001 m
      501 samples, 0.5 s
    """
    check_kind("point", point, OperatingPoint)
    point = _with_model(point)
    check_arguments(
        SIMULATE,
        wall=wall,
        wall_position=wall_position,
        start_position=start_position,
        start_velocity=start_velocity,
        duration=duration,
        substeps=substeps,
        seed=seed,
    )
    chosen, given = _chosen_environment(point, wall, environment, parameters or {}, stiffness)
    touched, values = environment_with_values(chosen, given, stiffness=stiffness, damping=damping, no_pull=no_pull)
    arm = point.operator if point.ungripped_plant.handle is not None else None
    hand = active_hand(arm, touched.surface, push, ramp, tremor, reach, reflex)
    start, off_path = _start_and_distance(point, touched.surface, wall_position, start_position)
    loop, growth = point.contact_loop, predicted_growth(point.loop, touched, values)
    bound = bound_of_run(abs(start - wall_position), growth.per_sample)
    run = Run(loop, values, hand, start, start_velocity, wall_position=wall_position, seed=seed, bound=bound)
    contact = _Contact(point, touched, run, off_path, growth, substeps)
    return _simulate(contact, passivity_damping, duration, trail, seconds_to_hear, progress)


class _Contact(NamedTuple):
    """A contact to be simulated: who touches what, and how the run begins.

    run                 of the device without a passivity controller
    distance_from_path  how far from the start the handle's path passes [m]; None for a device without a mechanism
    growth              predicted;   substeps  between samples, as requested
    """

    point: OperatingPoint
    environment: Environment
    run: Run
    distance_from_path: float | None
    growth: PredictedGrowth
    substeps: int


def _simulate(
    contact: _Contact,
    passivity_damping: float | None,
    duration: float | None,
    trail: bool,
    seconds_to_hear: Callable[[float], float] | None,
    progress: Progress | None,
) -> ContactSimulation:
    """Simulate a contact, with a passivity controller [N s/m] also without it, and judge the motion.

    The other arguments, and what is raised, are those of `simulate_contact`.
    """
    run, touched = contact.run, contact.environment
    runs = [run]
    if passivity_damping is not None:
        # in front, as the run that is judged
        runs.insert(0, replace(run, passivity=PassivityController(passivity_damping)))
    controlled = len(runs) > 1
    substeps = needed_substeps(run.loop, run.hand, contact.substeps)
    simulate = partial(
        simulate_batch, runs, touched, substeps=substeps, trail=trail, ledger=True, progress=progress
    )
    length, responses = _length_and_responses(contact, simulate, duration, controlled, seconds_to_hear)
    _check_forces(responses, touched)
    return ContactSimulation(
        point=contact.point,
        environment=touched,
        values=run.values,
        hand=run.hand,
        start_position=run.start_position,
        start_velocity=run.start_velocity,
        distance_from_path=contact.distance_from_path,
        predicted_growth=contact.growth.per_sample,
        length=length,
        substeps=substeps,
        seed=run.seed,
        response=responses[0],
        judgement=_judgement(contact, responses[0]),
        range_exit=range_exit(contact.point, responses[0]),
        uncontrolled=responses[1] if controlled else None,
    )


def _length_and_responses(
    contact: _Contact,
    simulate: Callable[..., list[TimeResponse]],
    duration: float | None,
    controlled: bool,
    seconds_to_hear: Callable[[float], float] | None,
) -> tuple[RunLength, list[TimeResponse]]:
    """Simulate for the requested duration [s], or for one that shows the motion; return length and responses.

    simulate    `simulate_batch` of all runs, called with duration [s]
    controlled  whether a passivity controller acts
    """
    if duration is not None:
        length = RunLength(duration, "as requested")
        return length, simulate(duration=duration)
    loop, hand = contact.run.loop, contact.run.hand
    length = contact_run_length(loop, hand, contact.growth, controlled=controlled, seconds_to_hear=seconds_to_hear)
    return _responses_to_hear(simulate, length, loop.period, seconds_to_hear)


def _judgement(contact: _Contact, response: TimeResponse) -> Judgement:
    """Judge a motion; undecided where nothing disturbs a device at rest on a wall that is predicted unstable."""
    drifts = is_pushed_on(contact.point.loop, contact.environment, contact.run.values, contact.run.hand)
    judgement = judge_response(response, drifts=drifts)
    if judgement.behaviour == "converged" and contact.growth.decays is False and not _is_disturbed(response):
        # a device that nothing disturbs stays at rest on an unstable wall, too
        judgement = replace(judgement, behaviour="undecided")
    return judgement


def _with_model(point: OperatingPoint) -> OperatingPoint:
    """Return a measured device's operating point with the model fitted to its response; any other as it is."""
    if point.response is None:
        return point
    from zwidth.chart.measured.chart import modelled_point

    return modelled_point(point)


def _chosen_environment(
    point: OperatingPoint,
    wall: WallSides,
    environment: str | Environment | None,
    parameters: Mapping[str, float],
    stiffness: float | None,
) -> tuple[str | Environment, Mapping[str, float]]:
    """Choose what is touched, under load the wall that holds the load; return it with its parameters by name.

    Raises  ArgumentError  as `_under_load` and `_environment_or_wall` do
    """
    if point.load is not None:
        wall, environment, parameters = _under_load(point, wall, environment, parameters)
    has_stiffness = stiffness is not None or "stiffness" in parameters
    return _environment_or_wall(environment, wall, has_stiffness=has_stiffness), parameters


def _start_and_distance(
    point: OperatingPoint, surface: bool, wall_position: float, start_position: float | None
) -> tuple[float, float | None]:
    """Return the start of the reading [m], and how far from it the handle's path passes [m], None for a device
    without a mechanism.

    surface  whether what is touched has one, outside of which the start is then by default
    Raises   ArgumentError  where the handle cannot be moved to the wall, or to the start
    """
    if start_position is None:
        start_position = wall_position + (-DEPTH if surface else DEPTH)
    _distance_from_path(point, wall_position, "wall_position")
    return start_position, _distance_from_path(point, start_position, "start_position")


def _is_disturbed(response: TimeResponse) -> bool:
    """Whether a run has a motion, or a force that friction holds against."""
    return bool(np.ptp(response.truth) > 0.0 or np.any(response.force))


def _responses_to_hear(
    simulate: Callable[..., list[TimeResponse]],
    length: RunLength,
    period: float,
    seconds_to_hear: Callable[[float], float] | None,
) -> tuple[RunLength, list[TimeResponse]]:
    """Simulate for a length, and again for longer where the frequency that comes out takes that to be heard.

    simulate, seconds_to_hear  as in `_length_and_responses` and `simulate_contact`;   period  T [s]
    Returns  the length that was kept, and its responses
    """
    responses = simulate(duration=length.seconds)
    if seconds_to_hear is None or responses[0].given_up:
        return length, responses
    longer = lengthened(length, seconds_to_hear(judge_response(responses[0]).frequency), period)
    return (length, responses) if longer == length else (longer, simulate(duration=longer.seconds))


def range_exit(point: OperatingPoint, response: TimeResponse) -> RangeExit | None:
    """Find where a motion leaves the handle's range, which is computed only if an extreme of the motion cannot be
    reached; None where it stays within."""
    handle = response.handle
    try:
        for extreme in (handle.min(), handle.max()):
            point.distance_from_path(float(extreme))
    except PostureError:
        if reached := point.handle_range:
            outside = (handle < reached[0]) | (handle > reached[1])
            return RangeExit(float(response.time[outside.argmax()]), *reached) if outside.any() else None
    return None


def _under_load(
    point: OperatingPoint,
    wall: WallSides,
    environment: str | Environment | None,
    parameters: Mapping[str, float],
) -> tuple[WallSides, str | Environment | None, Mapping[str, float]]:
    """The wall under load: the two-sided one as it is, the one-sided one as that on which the hand leans.

    Returns  the wall's sides, the environment (None: the two-sided wall), and the parameters, with the load

    Raises  ArgumentError  for another environment, and for a one-sided wall on which no hand leans
    """
    if environment is not None:
        raise ArgumentError("environment", "does not go with a load, which the wall holds; leave one out")
    if wall == "two-sided":
        return wall, None, parameters
    load = -point.equilibrium.wall_force
    if not load:
        raise ArgumentError("wall", "is one-sided, and no hand leans on it; give a load with a force")
    return "two-sided", ENVIRONMENTS["pressed_wall"], {"load": load, **parameters}


def _environment_or_wall(
    environment: str | Environment | None, wall: WallSides, *, has_stiffness: bool
) -> str | Environment:
    """The environment, or for None the wall that acts on these sides.

    Raises  ArgumentError  where both are given, or the wall has no stiffness
    """
    if environment is not None and wall == "one-sided":
        raise ArgumentError("wall", "is one-sided beside another environment; leave one out")
    if environment is None and not has_stiffness:
        raise ArgumentError("stiffness", "is missing; a wall needs one [N/m]")
    chosen_wall = ENVIRONMENTS["one_sided_wall" if wall == "one-sided" else "wall"]
    return chosen_wall if environment is None else environment


def _distance_from_path(point: OperatingPoint, position: float, argument: str) -> float | None:
    """How far from a position the handle's path passes [m]; None for a device without a mechanism. Raises
    ArgumentError where the handle cannot be moved so far."""
    try:
        return point.distance_from_path(position)
    except PostureError as error:
        place = f"{PLACES[argument]} lies {position:g} m along the direction"
        raise ArgumentError(argument, f"{place}, out of the workspace: {error}") from None


def _check_forces(responses: Sequence[TimeResponse], environment: Environment) -> None:
    """Raise NoAnswerError where the environment, called with numbers, returned none."""
    for response in responses:
        called = np.isfinite(response.reading) & np.isfinite(response.velocity)
        silent = np.flatnonzero(called & ~np.isfinite(response.force))
        if len(silent):
            first = silent[0]
            raise NoAnswerError(
                f"{environment.name} gave no finite force at {response.time[first]:.6g} s, where it was given a "
                f"position of {response.penetration[first]:.6g} m and {response.velocity[first]:.6g} m/s; have it "
                "return a number there"
            )


PUSH: Final = 2.0  # N, against what has a surface
PLACES: Final = {"wall_position": "the wall", "start_position": "the start"}


def environment_with_values(
    environment: str | Environment,
    parameters: Mapping[str, float],
    *,
    stiffness: float | None = None,
    damping: float | None = None,
    no_pull: bool = False,
) -> tuple[Environment, Floats]:
    """An environment, and its parameters as it takes them.

    environment  or what `load_environment` finds it by
    parameters   by name; those left out have the environment's defaults
    stiffness, damping, no_pull  three of them; None and False: not given here
    Raises       ArgumentError  for an unknown environment, a file that does not serve, parameters that it
                                       does not take or that are given twice

    >>> environment_with_values("slot", {"width": 0.01}, stiffness=500.0)[1].tolist()
    [0.01, 500.0, 0.0, 0.0]
    """
    chosen = _environment(environment)
    given = dict(parameters)
    for name, value in {"stiffness": stiffness, "damping": damping, "no_pull": float(no_pull) or None}.items():
        if value is None:
            continue
        if name not in chosen.names:
            has = ", ".join(chosen.names) or "none"
            raise ArgumentError(name, f"{chosen.name} has no such parameter; it has {has}")
        if name in given:
            raise ArgumentError("parameters", f"{name} is given twice")
        given[name] = value
    try:
        return chosen, chosen.values(**given)
    except ValueError as error:
        raise ArgumentError("parameters", *str(error).splitlines()) from None


def _environment(environment: str | Environment) -> Environment:
    """The environment itself, or the one of this name or file; see `environment_with_values`."""
    if isinstance(environment, Environment):
        return environment
    check_kind("environment", environment, str)
    try:
        return load_environment(environment)
    except ValueError as error:
        raise ArgumentError("environment", *str(error).splitlines()) from None


def active_hand(
    operator: Operator | None,
    surface: bool,
    push: float | None,
    ramp: float,
    tremor: Tremor | None,
    reach: Reach | None,
    reflex: Reflex | None,
) -> Hand:
    """The operator (None: nobody) with his movements.

    surface  True: there is one to push against, so that push None means PUSH unless he reaches; False: it means 0
    The others are those of `simulate_contact`

    Raises  ArgumentError  for what needs an arm, or a push
    """
    for name, movement in (("reach", reach), ("reflex", reflex)):
        if movement is not None and operator is None:
            raise ArgumentError(name, "needs an arm, and nobody holds the device", missing="operator")
    if push is None:
        push = PUSH if surface and reach is None else 0.0
    if ramp and not push:
        why = "is the time in which a push grows, and no push is given"
        raise ArgumentError("ramp", why, missing="push")
    return Hand(operator, push, ramp, reach, tremor, reflex)
