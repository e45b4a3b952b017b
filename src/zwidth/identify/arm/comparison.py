"""Torques beside what each parameter makes of the positions, in the analysed band."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.identify.arm.parameters import BaseParameters
from zwidth.identify.arm.smoothing import Band, convolved
from zwidth.identify.arm.stretches import Stretch
from zwidth.model.closed_posture import moved_posture
from zwidth.model.inertia_regressor import inertia_regressor
from zwidth.model.mechanism import REVOLUTE

PART: Final = 20_000  # smoothed samples whose columns stand in memory at once


class UnreachedError(ValueError):
    """The mechanism cannot be where a record has it; the text says where."""


@dataclass(frozen=True)
class Compared:
    """Torques of one stretch, n samples.

    record   number of the record
    time     (n,) [s]
    columns  (n, d, b + 1)  of the base parameters, and the derivative of the torques;   torques (n, d)
    static   (n, d, g)  further columns, of gravity along directions in which there is none; g may be 0
    """

    record: int
    time: Floats
    columns: Floats
    torques: Floats
    static: Floats


@dataclass(frozen=True)
class Comparison:
    """How stretches are turned into torques and columns.

    base          the parameters
    band          what is analysed
    gravity       (3,) [m/s^2]
    known_rotors  (d,) inertias at the joints of the rotors that are no parameters
    start         (n,) joint coordinates of a posture in the assembly meant
    """

    base: BaseParameters
    band: Band
    gravity: Floats
    known_rotors: Floats
    start: Floats

    def of(self, stretch: Stretch, static: Sequence[Floats] = ()) -> Compared:
        """Torques and columns of a stretch.

        static   gravities (3,) of which further columns are made
        Raises UnreachedError  where the mechanism cannot be
        """
        columns, further = list[Floats](), list[Floats]()
        angles = self.first_posture(stretch)
        parameters, kept = self.base.parameters, list(self.base.kept)
        for begin in range(0, len(stretch.time), PART):
            one = stretch.part(slice(begin, begin + PART))
            links, places = self._links(one, angles, one.rates, one.accelerations, self.gravity)
            all_columns = parameters.columns(links, one.rates, one.accelerations, one.signs)
            columns.append(np.ascontiguousarray(all_columns[:, :, kept]))
            if static:
                still = np.zeros_like(one.rates)
                further.append(
                    np.concatenate([self._links(one, angles, still, still, g)[0] for g in static], axis=2)
                )
            angles = places[-1]
        torques = stretch.forces - self.known_rotors * stretch.accelerations
        none = np.zeros((*torques.shape, 0))
        parts = np.concatenate(columns), torques, np.concatenate(further) if static else none
        narrow, step = self.band.narrow, self.band.step
        taps, half, thin = narrow.taps(step), narrow.half(step), self.band.thinning
        made, torque, weights = (convolved(part, taps, thin) for part in parts)
        rate = convolved(torques, narrow.taps(step, 1), thin)
        time = stretch.time[half : len(stretch.time) - half : thin]
        return Compared(stretch.record, time, np.concatenate([made, rate[..., None]], axis=2), torque, weights)

    def _links(
        self, one: Stretch, angles: Floats, rates: Floats, accelerations: Floats, gravity: Floats
    ) -> tuple[Floats, Floats]:
        mech = self.base.parameters.mech
        links, places, reached = inertia_regressor(mech, angles, one.coordinates, rates, accelerations, gravity)
        if reached < len(one.time):
            raise UnreachedError(self._where(one, reached))
        return links, places

    def _where(self, one: Stretch, row: int) -> str:
        numbers = ", ".join(f"{value:.4g}" for value in one.coordinates[row])
        return f"at {one.time[row]:.6g} s the drives stand at {numbers} (rad or m), where no posture leads"

    def first_posture(self, stretch: Stretch) -> Floats:
        """Joint coordinates (n,) of a posture at the stretch's first sample."""
        mech = self.base.parameters.mech
        own = mech.joint[-mech.driven :]
        step = stretch.coordinates[0] - mech.to_drive[0] @ self.start[own]
        if not mech.coupled:  # a turn more or less is the same posture
            turns = mech.kind[own] == REVOLUTE
            step = np.where(turns, step - 2.0 * np.pi * np.rint(step / (2.0 * np.pi)), step)
        moved = moved_posture(mech, self.start, step)
        if moved is None:
            raise UnreachedError(self._where(stretch, 0))
        moved[own] = np.linalg.solve(mech.to_drive[0], stretch.coordinates[0])
        return moved
