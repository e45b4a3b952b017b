"""The arrays that the engine works on: devices, and the members of a batch; `computer` has those of the computers.

Leading axis D: devices of the batch, padded to one size with zeros; a member names its device by index.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints

# Columns of a trace.
READING, TRUTH, VELOCITY, FORCE, HANDLE = range(5)
TRACES = 5
# Entries of the energy ledger, in this order: what each has put in since the start [J].
HAND, WALL, HOLD, ESTIMATE, QUANTISER, CONTROLLER, ACTUATOR, FRICTION, BRAKES, SPRINGS, STRUCTURE, STORED = range(
    12
)
ENTRIES = 12
# Entries of `PlantArrays.local`.
NOTHING_LOCAL, SAMPLE, LATER = range(3)


class PlantArrays(NamedTuple):
    """D plants between samples. An interval has P parts, at whose beginning a command may begin to act.

    transition  (D, P, R, N)    what N states become, and then, for each element, place and speed of its motion
    inputs      (D, P, F, R)    what a unit of a held force adds to all R: command, hand, elements
    substeps    (D, P)          how many in each part; 0 for a part that is none
    length      (D, P)          of a substep [s]
    new         (D, P)          1 once the new command acts, 0 as long as the one before it does
    local       (D, P)          what the local loop does at a part's beginning: NOTHING_LOCAL, take a SAMPLE, or,
                                as its delay ends between two of them, let the new command act (LATER)
    loss, work  (D, P, M, M)    quadratic forms of the ledger, M = N + F; size 0 without one
    energy      (D, N, N)
    size        (D,)            coordinates n: velocities stand n places after them
    kind        (D, E)          of each element;   numbers (D, E, 6)
    along       (D, E, n)       motion each works on
    reading     (D, E, n)       what the computer reads for a sampled force
    sensor      (D, n)          what is read, as it is
    handle      (D, n)          where the hand is;   push (D, n)  where its push acts
    channel     (D, C, n)       motions that are counted;   step, weight, noise (D, C)
    encoder     (D, C)          numbers of the encoders, by which they draw their noise
    """

    transition: Floats
    inputs: Floats
    substeps: Ints
    length: Floats
    new: Ints
    local: Ints
    loss: Floats
    work: Floats
    energy: Floats
    size: Ints
    kind: Ints
    numbers: Floats
    along: Floats
    reading: Floats
    sensor: Floats
    handle: Floats
    push: Floats
    channel: Floats
    step: Floats
    weight: Floats
    noise: Floats
    encoder: Ints


class RunArrays(NamedTuple):
    """m runs.

    device      (m,)     index
    start       (m, R)   states at time 0, place and speed of each element's motion
    wall        (m,)     where the wall is [m]
    values      (m, P)   of the environment
    push        (m, 9)   the hand's (see `hand`);   reflex (m, 7)
    observer    (m, Q)   the passivity controller's; nan in the first: none
    seed        (m,)
    bound       (m,)     reading from the wall at which a run stops [m]
    """

    device: Ints
    start: Floats
    wall: Floats
    values: Floats
    push: Floats
    reflex: Floats
    observer: Floats
    seed: NDArray[np.uint64]
    bound: Floats


class Records(NamedTuple):
    """Records of m runs of S samples; arrays of size 0 where they are not wanted.

    samples  (m,)           how many were run
    traces   (m, S, 5)      reading, truth, velocity, force, handle at each sample
    handle   (m, S, n)      handle after each substep
    ledger   (m, S, 12)     energies at each sample
    """

    samples: Ints
    traces: Floats
    handle: Floats
    ledger: Floats
