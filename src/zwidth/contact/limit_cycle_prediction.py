"""Limit cycles of a device on one wall: what is predicted, and what a simulation finds there."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any, Final

from zwidth.contact.harmonic_balance import HarmonicBalance, LimitCycle
from zwidth.result import Result

OTHERWISE: Final = 1.5  # ratio of frequencies from which a simulation does not have the vibration predicted
CYCLE_KEYS: Final = ("amplitude_m", "frequency_Hz", "stable", "within_range", "force_N", "velocity_m_per_s")
MOST_TOLD: Final = 4  # cycles that a prediction shows of itself


@dataclass(frozen=True)
class SimulatedVibration:
    """Vibration that a simulation ends in.

    start, duration  [m] from the middle of the vibration, [s]
    behaviour        as in `motion_verdict.Judgement`
    amplitude        of the sensor's motion in the last quarter [m];   frequency  [Hz]
    """

    start: float
    duration: float
    behaviour: str
    amplitude: float
    frequency: float

    def document(self) -> dict[str, Any]:
        """The numbers by key and unit."""
        return {
            "behaviour": self.behaviour,
            "amplitude_m": self.amplitude,
            "frequency_Hz": self.frequency,
            "start_m": self.start,
            "duration_s": self.duration,
        }


@dataclass(frozen=True, repr=False)
class LimitCyclePrediction(Result):
    """Limit cycles of a device on one two-sided wall.

    wall_stiffness, wall_damping   [N/m], [N s/m]
    offset                 middle of the vibrations, as a share of an encoder's step beyond a count
    verdict                of the linear loop: "stable", "unstable" or "undecided"
    nonlinear              what of the device depends on the amplitude, in words
    left_out               what of the device the prediction leaves out, in words
    predicted_by           the method, and what it is worth
    balance                growth of vibrations over their amplitude, and as far as the device can move
    cycles                 by amplitude
    simulated              what a simulation finds for each; None: not simulated, as is none that is unstable or
                           beyond the range
    small_start_vibration  what it finds where no stable cycle is predicted within the range; None: not simulated
    resting_limit          stiffest wall on which there is a place to rest under every push [N/m]; None: not known
    quiet_limit            stiffest wall, of this damping, without any hunting [N/m]; None: not known
    """

    wall_stiffness: float
    wall_damping: float
    offset: float
    verdict: str
    nonlinear: tuple[str, ...]
    left_out: tuple[str, ...]
    predicted_by: str
    balance: HarmonicBalance
    cycles: tuple[LimitCycle, ...]
    simulated: tuple[SimulatedVibration | None, ...]
    small_start_vibration: SimulatedVibration | None
    resting_limit: float | None
    quiet_limit: float | None

    @property
    def largest_motion(self) -> float:
        """How far the device can move to either side [m]."""
        return self.balance.largest_motion

    @property
    def leaves_range(self) -> bool:
        """Whether the largest vibrations within the range grow, so that nothing in the model limits them."""
        return self.balance.leaves_range

    @property
    def simulation_disagrees(self) -> bool:
        """Whether a simulation has a limit cycle at another frequency than predicted; it is right then."""
        return any(
            vibration is not None
            and vibration.behaviour != "converged"
            and not 1.0 / OTHERWISE < vibration.frequency / cycle.frequency_Hz < OTHERWISE
            for cycle, vibration in zip(self.cycles, self.simulated, strict=True)
        )

    def document(self) -> dict[str, Any]:
        """Everything by key and unit; None where it is not known, or was not simulated."""
        balance = self.balance
        return {
            "wall_stiffness_N_per_m": self.wall_stiffness,
            "wall_damping_Ns_per_m": self.wall_damping,
            "offset_steps": self.offset,
            "verdict": self.verdict,
            "nonlinear": list(self.nonlinear),
            "predicted_by": self.predicted_by,
            "limit_cycles": [
                _cycle_document(cycle) | {"simulated": vibration and vibration.document()}
                for cycle, vibration in zip(self.cycles, self.simulated, strict=True)
            ],
            "otherwise": self.small_start_vibration and self.small_start_vibration.document(),
            "largest_motion_m": self.largest_motion,
            "leaves_range": self.leaves_range,
            "resting_limit_N_per_m": self.resting_limit,
            "quiet_limit_N_per_m": self.quiet_limit,
            "growth": {
                "amplitude_m": balance.amplitude,
                "growth_per_s": balance.growth,
                "frequency_Hz": balance.frequency_Hz,
            },
        }

    def table(self) -> dict[str, list[Any]]:
        """The limit cycles as columns, one a row."""
        rows = [_cycle_document(cycle) for cycle in self.cycles]
        columns: dict[str, list[Any]] = {key: [_as_cell(row[key]) for row in rows] for key in CYCLE_KEYS}
        documents = [simulated.document() if simulated else {} for simulated in self.simulated]
        for key in ("behaviour", "amplitude_m", "frequency_Hz"):
            columns[f"simulated_{key}"] = [own.get(key) for own in documents]
        return columns

    def __repr__(self) -> str:
        lines = [
            f"  {cycle.amplitude:.4g} m at {cycle.frequency_Hz:.4g} Hz, "
            + ("stable" if cycle.stable else "unstable")
            + ("" if cycle.within_range else ", beyond the range")
            for cycle in self.cycles
        ]
        if len(lines) > MOST_TOLD:
            lines = [*lines[: MOST_TOLD - 1], f"  and {len(lines) - MOST_TOLD + 1} more limit cycles"]
        return "\n".join(
            [
                f"LimitCyclePrediction: wall of {self.wall_stiffness:.6g} N/m, {self.wall_damping:.6g} N s/m, "
                f"{self.verdict} if linear; {', '.join(self.nonlinear)}",
                *(lines or ["  no limit cycle is predicted"]),
            ]
        )


def _cycle_document(cycle: LimitCycle) -> dict[str, Any]:
    values = (
        cycle.amplitude,
        cycle.frequency_Hz,
        cycle.stable,
        cycle.within_range,
        cycle.force_amplitude,
        cycle_speed(cycle),
    )
    return dict(zip(CYCLE_KEYS, values, strict=True))


def _as_cell(value: float | bool) -> float | str:
    return str(value).lower() if isinstance(value, bool) else value


def cycle_speed(cycle: LimitCycle) -> float:
    """Velocity amplitude at the sensor, of the sine [m/s]."""
    return 2.0 * pi * cycle.frequency_Hz * cycle.amplitude
