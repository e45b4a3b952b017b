"""The energy ledger's book-keeping, run beside the engine.

Over an interval the reading's motion moves by dy. Between what an ideal wall would do and what the actuator does,
each step of the way is charged with the difference it makes:

    wall                 (F_j + F_{j+1})/2 dy, F the environment's answer to true place and velocity at samples; a
                         spring gives back what it takes, exactly
    hold                 F_j held for the interval instead
    velocity estimate    the estimate from true readings instead of the velocity
    quantiser            counted readings (and their noise) instead of true ones
    passivity controller what it adds
    actuator             delay, filter, limit and lag, and that the actuator is not where the sensor is

Hand, friction, brakes and bent springs hold their force over a substep, so that their work is force times motion;
what structural dampers take out is a quadratic form of the states. All of them sum up to what the plant stores.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.compiled import compiled, compiled_lean
from zwidth.contact.elements import BRISTLES, COULOMB, NOTHING, SPRING
from zwidth.contact.hand import BRAKE
from zwidth.contact.machine import (
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
    Devices,
)
from zwidth.model.mechanism import Floats

LAST_TRUTH, LAST_LAW, LAST_SAMPLED, LAST_ASKED, LAST_GIVEN, ACTUATED, BEGUN = range(7)


class Account(NamedTuple):
    """entries (12,) or none: the ledger;   last (7,)  what the previous sample left;   work (M,)  memory"""

    entries: Floats
    last: Floats
    work: Floats


@compiled
def account(devices: Devices, wanted: bool) -> Account:
    """An empty ledger; one without entries where none is wanted."""
    return Account(np.zeros(ENTRIES if wanted else 0), np.zeros(7), np.zeros(devices.loss.shape[2]))


@compiled_lean
def energy_of(devices: Devices, d: int, states: Floats) -> float:
    """Kinetic and elastic energy of the linear plant [J]."""
    total = 0.0
    for i in range(devices.energy.shape[1]):
        for k in range(devices.energy.shape[1]):
            total += 0.5 * states[i] * devices.energy[d, i, k] * states[k]
    return total


@compiled_lean
def form(matrices: Floats, d: int, part: int, x: Floats) -> float:
    """x . matrices[d, part] x"""
    total = 0.0
    for i in range(x.size):
        for k in range(x.size):
            total += x[i] * matrices[d, part, i, k] * x[k]
    return total


@compiled_lean
def enter_substep(
    devices: Devices,
    d: int,
    part: int,
    before: Floats,
    after: Floats,
    command: float,
    push: float,
    forces: Floats,
    book: Account,
) -> None:
    """Enter the work done over one substep."""
    N, n, X = devices.energy.shape[1], devices.size[d], book.work
    for i in range(N):
        X[i] = before[i]
    X[N], X[N + 1] = command, push
    for e in range(forces.size):
        X[N + 2 + e] = forces[e]
    entries = book.entries
    entries[STRUCTURE] -= form(devices.loss, d, part, X)
    book.last[ACTUATED] += form(devices.work, d, part, X)
    for k in range(n):
        entries[HAND] += push * devices.push[d, k] * (after[k] - before[k])
    for e in range(forces.size):
        kind = devices.kind[d, e]
        if kind == NOTHING:
            continue
        work = forces[e] * (after[N + 2 * e] - before[N + 2 * e])
        if kind in (COULOMB, BRISTLES):
            entries[FRICTION] += work
        elif kind == SPRING:
            entries[SPRINGS] += work
        elif devices.numbers[d, e, 0] == BRAKE:
            entries[BRAKES] += work
        else:
            entries[HAND] += work


@compiled_lean
def settle(
    book: Account, truth: float, law: float, sampled: float, asked: float, given: float, stored: float
) -> None:
    """At a sample: charge the interval that ends, and keep what the next one starts with."""
    entries, last = book.entries, book.last
    if last[BEGUN] > 0.0:
        dy = truth - last[LAST_TRUTH]
        wall = 0.5 * (last[LAST_LAW] + law) * dy
        entries[WALL] += wall
        entries[HOLD] += last[LAST_LAW] * dy - wall
        entries[ESTIMATE] += (last[LAST_SAMPLED] - last[LAST_LAW]) * dy
        entries[QUANTISER] += (last[LAST_ASKED] - last[LAST_SAMPLED]) * dy
        entries[CONTROLLER] += (last[LAST_GIVEN] - last[LAST_ASKED]) * dy
        entries[ACTUATOR] += last[ACTUATED] - last[LAST_GIVEN] * dy
    entries[STORED] = stored
    last[LAST_TRUTH], last[LAST_LAW], last[LAST_SAMPLED] = truth, law, sampled
    last[LAST_ASKED], last[LAST_GIVEN], last[ACTUATED], last[BEGUN] = asked, given, 0.0, 1.0
