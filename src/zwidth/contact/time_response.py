"""A run in time, and what it says: see `motion_verdict` for how it is judged."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.engine_arrays import FORCE, HANDLE, READING, TRUTH, VELOCITY, Records
from zwidth.result import Result

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
    wall_position: float
    time: Floats
    reading: Floats
    truth: Floats
    velocity: Floats
    force: Floats
    handle: Floats
    trail_time: Floats
    trail: Floats
    energies: Floats
    stored: Floats
    given_up: bool
    quantum: float
    noise: float
    linear: bool
    surface: bool
    held: bool

    @classmethod
    def of(cls, plan: RunSettings, records: Records, i: int) -> TimeResponse:
        """Run i of a batch, cut to the samples that were run."""
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

    def document(self) -> dict[str, Any]:
        """The motion by key and unit, and whether it was stopped early."""
        return {"wall_position_m": self.wall_position, "given_up": self.given_up, **self.series}

    def table(self) -> dict[str, Floats]:
        """The motion in time as columns; where it is kept, each entry of the energy ledger with its own."""
        entries = enumerate(SOURCES if self.energies.size else ())
        return self.series | {f"{as_key(name)}_J": self.energies[:, i] for i, name in entries}

    @property
    def series(self) -> dict[str, Floats]:
        """The records of each sample, by key and unit; energies where they were recorded."""
        energy = {"energy_J": self.stored} if self.stored.size else {}
        return {
            "time_s": self.time,
            "position_m": self.reading,
            "penetration_m": self.penetration,
            "velocity_m_per_s": self.velocity,
            "force_N": self.force,
            "handle_m": self.handle,
            **energy,
        }

    def __repr__(self) -> str:
        largest = float(np.max(np.abs(self.force), initial=0.0))
        given_up = ", stopped early" if self.given_up else ""
        last = float(self.time[-1]) if len(self.time) else 0.0
        return f"TimeResponse: {len(self.time)} samples, {last:.4g} s{given_up}, largest force {largest:.4g} N"


def as_key(source: str) -> str:
    """The name of one of SOURCES as part of a key."""
    return source.replace(" ", "_")
