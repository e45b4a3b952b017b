"""Simulate one loop, or many at once, against an environment, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from math import ceil, inf, isfinite, isinf

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats, Ints
from zwidth.conditions.traits import reading_noise, reading_step
from zwidth.contact.computer import ENTRIES, TRACES, PlantArrays, Records, RunArrays, computers
from zwidth.contact.engine import run_several
from zwidth.contact.engine_inputs import HeldDevice, pack_plants, reading_rows, start_states
from zwidth.contact.environments.environment import Environment
from zwidth.contact.fixed_feedback import feedback_arrays
from zwidth.contact.hand import PUSH_NUMBERS, REFLEX_NUMBERS, Hand
from zwidth.contact.passivity_controller import PassivityController
from zwidth.contact.time_response import RunSettings, TimeResponse
from zwidth.loop.estimators import Foaw, Levant
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import check_kind
from zwidth.progress import Progress, watched
from zwidth.questions import SIMULATE
from zwidth.resources import check_memory, in_chunks

SUBSTEPS = 20
LARGEST_MOTION = 1.0  # m, from the wall to either side: a device farther away, of which no more is known, is lost


@dataclass(frozen=True)
class Run:
    """One run of a batch; what differs from run to run.

    loop            plant and computer; one object may serve many runs, and is then prepared once
    values          of the environment, as `Environment.values` gives them
    hand            who holds the handle and pushes
    start_position  of the reading, the device undeformed [m];   start_velocity  the same [m/s]
    start           (n,), (n,) coordinates and velocities of the plant (with the operator), instead of the two
    wall_position   where the environment begins, on the axis of the reading [m]
    seed            of the noise
    passivity       a passivity controller; None: none
    bound           distance of the reading from the wall at which the run stops [m]
    """

    loop: Loop
    values: Floats
    hand: Hand = field(default_factory=Hand)
    start_position: float = 0.0
    start_velocity: float = 0.0
    start: tuple[Floats, Floats] | None = None
    wall_position: float = 0.0
    seed: int = 0
    passivity: PassivityController | None = None
    bound: float = inf


def simulate(
    loop: Loop,
    environment: Environment,
    values: ArrayLike,
    *,
    duration: float,
    substeps: int = SUBSTEPS,
    trail: bool = True,
    ledger: bool = True,
    **circumstances: object,
) -> TimeResponse:
    """One run in full: what a device does on contact, sample by sample.

    environment    what is touched;   values (P,) of its parameters, as `Environment.values` gives them
    duration       [s]
    substeps       between samples, where something is nonlinear or the push changes; all else is exact with any
    trail          keep the handle's position after each substep
    ledger         keep the energies
    circumstances  hand, start_position [m], wall_position [m] and so on: see `Run`
    Raises         as `simulate_batch`

    >>> from zwidth.contact.environments import wall
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> loop = Loop(Plant(0.1 * one[:, None], *np.zeros((2, 1, 1)), one, one), Controller(0.001))
    >>> values = wall.values(stiffness=1000.0, damping=2.0)
    >>> response = simulate(loop, wall, values, duration=1.0, start_position=1e-3)
    >>> [round(1e3 * x, 3) for x in response.reading[[0, 10, 20]].tolist()]
    [1.0, 0.556, -0.308]
    """
    check_kind("loop", loop, Loop)
    run = Run(loop, np.asarray(values, dtype=float), **circumstances)  # type: ignore[arg-type]
    return simulate_batch([run], environment, duration=duration, substeps=substeps, trail=trail, ledger=ledger)[0]


def simulate_batch(
    runs: Sequence[Run],
    environment: Environment,
    *,
    duration: float | Sequence[float],
    substeps: int = SUBSTEPS,
    trail: bool = False,
    ledger: bool = False,
    progress: Progress | None = None,
) -> list[TimeResponse]:
    """Many runs at once, spread over the cores; each comes out as if it were alone.

    runs      of any loops, hands and starts;   environment  the one thing that all of them touch
    duration  of all runs, or of each [s]
    substeps  between samples; 1 is taken where no plant has a nonlinear part, no hand's push changes, and neither
              trail nor ledger is kept
    progress  called with "simulating", the samples done, and those of all runs
    Returns   one response for each run, in their order
    Raises    ValueError  for a duration or a number of substeps that cannot be meant, starts of a wrong shape
              TooLarge    where the result would not fit into memory
              HysteresisError, UnmovedError  for plants that cannot move in time, or not by the wall
    """
    lengths = np.broadcast_to(np.asarray(duration, dtype=float), (len(runs),))
    _check_durations(lengths, substeps)
    held_devices, index = _held_devices(runs)
    period = np.array([held_device.loop.period for held_device in held_devices])[index]
    # 1e-12: a whole number of periods that rounding has made a little longer gets no sample more
    samples = np.array([1 + ceil(length / T * (1.0 - 1e-12)) for length, T in zip(lengths, period, strict=True)])
    m, S = len(runs), int(samples.max())
    # where nothing is kept between samples: a linear plant is exact with any number while the push is steady
    linear = not any(held_device.elements for held_device in held_devices)
    if linear and all(run.hand.is_steady for run in runs) and not trail and not ledger:
        substeps = 1
    plants = pack_plants(held_devices, substeps)
    # handle positions of a run: one after each substep
    fine = S * int(plants.substeps.sum(axis=1).max()) if trail else 0
    _check_memory(m, S, fine, ledger)
    controllers = [held_device.loop.controller for held_device in held_devices]
    computer_arrays = computers(controllers, [held_device.limit for held_device in held_devices])
    feedback = feedback_arrays(controllers, reading_rows(held_devices, plants))
    records = _empty_records(m, S, fine, ledger)
    members = _run_arrays(runs, held_devices, index, plants)
    with watched(progress, "simulating", lambda: int(records.samples.sum()), int(samples.sum())):
        in_chunks(
            partial(
                run_several, plants, computer_arrays, feedback, members, samples, environment.address, records
            ),
            m,
        )
    return [
        TimeResponse.of(
            _settings(run, held_devices[index[i]], plants, index[i], int(samples[i]), environment), records, i
        )
        for i, run in enumerate(runs)
    ]


def _check_memory(m: int, S: int, fine: int, ledger: bool) -> None:
    """Raise TooLarge where the records of `_empty_records`, for these arguments, do not fit into memory."""
    check_memory(
        m * float(S * (TRACES + (ENTRIES if ledger else 0)) + fine),
        f"{m} run{'s' * (m > 1)} of {S} samples",
        "simulate a shorter time, or fewer runs at once",
    )


def _empty_records(m: int, S: int, fine: int, ledger: bool) -> Records:
    """Return records of m runs, of S samples and `fine` handle positions each, with energies where `ledger` is
    set: samples done (m,), traces (m, S, TRACES), positions (m, fine), energies (m, S or 0, ENTRIES)."""
    return Records(
        np.zeros(m, dtype=np.int64),
        np.full((m, S, TRACES), np.nan),
        np.full((m, fine), np.nan),
        np.zeros((m, S if ledger else 0, ENTRIES)),
    )


def _settings(
    run: Run, held_device: HeldDevice, plants: PlantArrays, d: int, samples: int, environment: Environment
) -> RunSettings:
    """Settings of one run, for its `TimeResponse`; d  index of its device in `plants`."""
    counters = held_device.counters
    plain = not held_device.elements and run.passivity is None and isinf(held_device.limit)
    plain = plain and not isinstance(held_device.loop.controller.velocity, Foaw | Levant)
    plain = plain and not held_device.loop.controller.feeds_friction
    exact = all(counter.step == 0.0 and counter.noise == 0.0 for counter in counters)
    steady = run.hand.tremor is None and run.hand.reach is None
    return RunSettings(
        samples=samples,
        offsets=_offsets(plants, d),
        period=held_device.loop.period,
        wall_position=run.wall_position,
        quantum=reading_step(held_device.modal_plant),
        noise=reading_noise(held_device.modal_plant),
        linear=plain and exact and steady and environment.linear,
        surface=environment.surface,
        held=bool(np.any(run.hand.push_numbers)) or run.hand.operator is not None,
    )


def _offsets(plants: PlantArrays, d: int) -> Floats:
    """Ends of the substeps (p,) of an interval, in time after its sample [s]; d  index of the device."""
    begun, offsets = 0.0, [np.zeros(0)]  # begin of a part
    for count, h in zip(plants.substeps[d], plants.length[d], strict=True):
        offsets.append(begun + h * np.arange(1, count + 1))
        begun += count * h
    return np.concatenate(offsets)


def _check_durations(lengths: Floats, substeps: int) -> None:
    """Raise ValueError for durations [s] that are not positive and finite, or a wrong number of substeps."""
    for length in lengths:
        if not (isfinite(length) and length > 0.0):
            raise ValueError(f"duration must be positive and finite [s], got {float(length)!r}")
    SIMULATE["substeps"].check(substeps)


def _held_devices(runs: Sequence[Run]) -> tuple[list[HeldDevice], Ints]:
    """Prepare one held device for all runs with the same loop, operator, and reflex or none.

    Returns  the held devices, and the index (m,) of each run's
    """
    numbers: dict[tuple[object, ...], int] = {}
    held_devices: list[HeldDevice] = []
    index = []
    for run in runs:
        key = (id(run.loop), run.hand.operator, run.hand.reflex is not None)
        if key not in numbers:
            numbers[key] = len(held_devices)
            _ = run.loop.sections  # refuses plants that cannot be moved, or not in time
            held_devices.append(HeldDevice(run.loop, run.hand))
        index.append(numbers[key])
    return held_devices, np.array(index, dtype=np.int64)


def _run_arrays(
    runs: Sequence[Run], held_devices: list[HeldDevice], index: Ints, plants: PlantArrays
) -> RunArrays:
    """The runs as arrays for the engine; index (m,) names the device of each."""
    m = len(runs)
    start = np.zeros((m, plants.transition.shape[-2]))
    for i, run in enumerate(runs):
        held_device = held_devices[index[i]]
        start[i] = start_states(held_device, plants, int(index[i]), *_start(held_device, run))
    # nan first: no passivity controller
    observers = [np.array([np.nan]) if run.passivity is None else run.passivity.parameters for run in runs]
    width = max(len(numbers) for numbers in observers)
    return RunArrays(
        device=index,
        start=start,
        wall=np.array([run.wall_position for run in runs], dtype=float),
        values=np.stack([run.values for run in runs]),
        push=np.stack([run.hand.push_numbers for run in runs]).reshape(m, PUSH_NUMBERS),
        reflex=np.stack([run.hand.reflex_numbers for run in runs]).reshape(m, REFLEX_NUMBERS),
        observer=np.stack([np.pad(numbers, (0, width - len(numbers))) for numbers in observers]),
        seed=np.array([run.seed for run in runs], dtype=np.uint64),
        bound=np.array([run.bound for run in runs], dtype=float),
    )


def _start(held_device: HeldDevice, run: Run) -> tuple[Floats, Floats]:
    """Coordinates and velocities (n,) of the attached plant at the start of a run.

    Raises  ValueError  for a given start of another shape
    """
    n = held_device.attached_plant.size
    if run.start is None:
        return run.start_position * held_device.undeformed, run.start_velocity * held_device.undeformed
    x, v = (np.asarray(part, dtype=float) for part in run.start)
    if x.shape != (n,) or v.shape != (n,):
        raise ValueError(f"start must be two arrays of {n} numbers, got shapes {x.shape} and {v.shape}")
    return x, v
