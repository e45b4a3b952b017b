"""The energy ledger's book-keeping, run beside the engine.

Over an interval the reading's motion moves by dy. Between what an ideal wall would do and what the actuator does,
each step of the way is charged with the difference it makes:

    wall                 (F_j + F_{j+1})/2 dy, F the environment's answer to true place and velocity at samples; a
                         spring gives back what it takes, exactly
    hold                 F_j held for the interval instead
    velocity estimate    the estimate from true readings instead of the velocity
    quantiser            counted readings (and their noise) instead of true ones
    passivity controller what it adds
    actuator             delay, filter, limit and lag, feedback beside the wall (force sensor, feedforward, local
                         loop), and that the actuator is not where the sensor is

Hand, friction, brakes and bent springs hold their force over a substep, so that their work is force times motion;
what structural dampers take out is a quadratic form of the states. All of them sum up to what the plant stores.

In all kernels d is the index of a device, part that of a part of an interval; see `computer.PlantArrays`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_lean
from zwidth.contact.computer import (
    ACTUATOR,
    BRAKES,
    CONTROLLER,
    ENTRIES,
    ESTIMATE,
    FRICTION,
    HAND,
    HOLD,
    QUANTISER,
    SPRINGS,
    STORED,
    STRUCTURE,
    WALL,
    PlantArrays,
)
from zwidth.contact.hand import BRAKE
from zwidth.contact.plant_step import BRISTLES, COULOMB, NOTHING, ROLE, SAMPLED, SPRING

(
    LAST_TRUTH,
    LAST_IDEAL_FORCE,
    LAST_UNQUANTISED_FORCE,
    LAST_ENVIRONMENT_FORCE,
    LAST_CONTROLLED_FORCE,
    ACTUATOR_WORK,
    BEGUN,
) = range(7)


class Ledger(NamedTuple):
    """The energy ledger of a run.

    entries  (12,) or (0,)  HAND to STORED of `computer` [J]; none where no ledger is wanted
    last     (7,)           what the previous sample left, LAST_TRUTH to BEGUN
    work     (M,)           working memory of `enter_substep`
    """

    entries: Floats
    last: Floats
    work: Floats


@compiled
def new_ledger(devices: PlantArrays, wanted: bool) -> Ledger:
    """An empty ledger; one without entries where none is wanted."""
    return Ledger(np.zeros(ENTRIES if wanted else 0), np.zeros(7), np.zeros(devices.loss.shape[2]))


@compiled_lean
def energy_of(devices: PlantArrays, d: int, states: Floats) -> float:
    """Kinetic and elastic energy of the linear plant of device d [J] in these states (N,) or (R,)."""
    total = 0.0
    for i in range(devices.energy.shape[1]):
        for k in range(devices.energy.shape[1]):
            total += 0.5 * states[i] * devices.energy[d, i, k] * states[k]
    return total


@compiled_lean
def quadratic_form(matrices: Floats, d: int, part: int, x: Floats) -> float:
    """Quadratic form x . matrices[d, part] x of a vector x (n,)."""
    total = 0.0
    for i in range(x.size):
        for k in range(x.size):
            total += x[i] * matrices[d, part, i, k] * x[k]
    return total


@compiled_lean
def enter_substep(
    devices: PlantArrays,
    d: int,
    part: int,
    before: Floats,
    after: Floats,
    command: float,
    push: float,
    forces: Floats,
    book: Ledger,
) -> None:
    """Enter the work [J] done over one substep, between states (R,) before and after.

    d, part  device, and part of the interval, whose loss and work are taken
    command, push  held forces of actuator and hand [N];   forces (E,)  of the elements
    """
    N, n, held = devices.energy.shape[1], devices.size[d], book.work
    for i in range(N):
        held[i] = before[i]
    # states, held forces and elements' forces: the losses of a linear substep are a quadratic form of them all
    held[N], held[N + 1] = command, push
    for e in range(forces.size):
        held[N + 2 + e] = forces[e]
    entries = book.entries
    entries[STRUCTURE] -= quadratic_form(devices.loss, d, part, held)
    book.last[ACTUATOR_WORK] += quadratic_form(devices.work, d, part, held)
    for k in range(n):
        entries[HAND] += push * devices.push[d, k] * (after[k] - before[k])
    for e in range(forces.size):
        kind = devices.kind[d, e]
        if kind == NOTHING:
            continue
        # the force is constant over the substep, so that its work is exact; state N + 2 e is the motion's place
        work = forces[e] * (after[N + 2 * e] - before[N + 2 * e])
        if kind in (COULOMB, BRISTLES):
            entries[FRICTION] += work
        elif kind == SPRING:
            entries[SPRINGS] += work
        elif kind == SAMPLED:
            entries[ACTUATOR] += work
        elif devices.numbers[d, e, ROLE] == BRAKE:
            entries[BRAKES] += work
        else:
            entries[HAND] += work


@compiled_lean
def enter_sample(
    book: Ledger,
    truth: float,
    ideal_force: float,
    unquantised_force: float,
    environment_force: float,
    controlled_force: float,
    stored: float,
) -> None:
    """At a sample: charge the interval that ends, and keep what the next one starts with.

    truth             place of the reading's motion, without steps and noise [m]
    ideal_force       environment's answer to true place and velocity [N];   unquantised_force  to true place and
                      estimated velocity;   environment_force  to the readings
    controlled_force  with the passivity controller's part [N]
    stored            energy that the plant has stored since the start [J]
    """
    entries, last = book.entries, book.last
    if last[BEGUN] > 0.0:
        dy = truth - last[LAST_TRUTH]
        # the trapezoid is what a continuous spring would do; the rest of the held force is charged to the hold
        wall = 0.5 * (last[LAST_IDEAL_FORCE] + ideal_force) * dy
        entries[WALL] += wall
        entries[HOLD] += last[LAST_IDEAL_FORCE] * dy - wall
        entries[ESTIMATE] += (last[LAST_UNQUANTISED_FORCE] - last[LAST_IDEAL_FORCE]) * dy
        entries[QUANTISER] += (last[LAST_ENVIRONMENT_FORCE] - last[LAST_UNQUANTISED_FORCE]) * dy
        entries[CONTROLLER] += (last[LAST_CONTROLLED_FORCE] - last[LAST_ENVIRONMENT_FORCE]) * dy
        entries[ACTUATOR] += last[ACTUATOR_WORK] - last[LAST_CONTROLLED_FORCE] * dy
    entries[STORED] = stored
    last[LAST_TRUTH], last[LAST_IDEAL_FORCE], last[LAST_UNQUANTISED_FORCE] = truth, ideal_force, unquantised_force
    last[LAST_ENVIRONMENT_FORCE], last[LAST_CONTROLLED_FORCE], last[ACTUATOR_WORK], last[BEGUN] = (
        environment_force,
        controlled_force,
        0.0,
        1.0,
    )
