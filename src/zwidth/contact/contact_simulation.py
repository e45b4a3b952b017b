"""One contact simulated: the motion, what became of it, and its energies."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.environments.environment import Environment
from zwidth.contact.hand import Hand
from zwidth.contact.motion_verdict import Behaviour, Judgement, judge_response
from zwidth.contact.passivity_controller import rendered_stiffness
from zwidth.contact.run_length import RunLength
from zwidth.contact.time_response import SOURCES, TimeResponse, as_key
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.unheld_positions import unheld_positions
from zwidth.result import Result

WALLS: Final = ("wall", "one-sided wall")
AT_LIMIT = 1.0 - 1e-12  # share of the largest force from which a force was cut to it


@dataclass(frozen=True)
class RangeExit:
    """A motion leaves the range of a mechanism's handle: when [s], and how far that can be from its posture along
    the direction, backward (not positive) and forward [m]."""

    time: float
    backward: float
    forward: float


class PassivityComparison(NamedTuple):
    """Effect of a passivity controller: the stiffness felt, and the verdict, with and without it.

    rendered_stiffness      felt with the controller, by `passivity_controller.rendered_stiffness` [N/m]
    uncontrolled_stiffness  the same without it [N/m]
    uncontrolled            verdict on the run without it
    """

    rendered_stiffness: float
    uncontrolled_stiffness: float
    uncontrolled: Judgement


def is_pushed_on(loop: Loop, touched: Environment, values: Floats, hand: Hand) -> bool:
    """Whether the hand's push moves the device on and on, since no stiffness of the wall holds a position.

    loop  held by its operator
    """
    if touched.name not in WALLS or values[0] != 0.0 or hand.push == 0.0 or hand.tremor is not None:
        return False
    return unheld_positions(loop) > 0


@dataclass(frozen=True, repr=False)
class ContactSimulation(Result):
    """One contact simulated; S samples. Positions are along the rendered direction, 0 at the device's posture.

    point               device and operator
    environment         what is touched;   values (P,) of its parameters
    hand                who holds the handle, and what he does
    start_position      of the reading [m];   start_velocity  [m/s]
    distance_from_path  how far from the start the handle's path passes [m]; None for a device without a mechanism
    predicted_growth    ln rho per sample of the linear loop on the two-sided wall; None where there is none
    length              length of the run [s], and the reason for it
    substeps            taken between samples;   seed  of the encoders' noise
    response            the motion
    judgement           verdict on the motion
    range_exit          where it leaves the handle's range; None where it stays within, or without a mechanism
    uncontrolled        the same run without the passivity controller; None where there is no controller
    """

    point: OperatingPoint
    environment: Environment
    values: Floats
    hand: Hand
    start_position: float
    start_velocity: float
    distance_from_path: float | None
    predicted_growth: float | None
    length: RunLength
    substeps: int
    seed: int
    response: TimeResponse
    judgement: Judgement
    range_exit: RangeExit | None
    uncontrolled: TimeResponse | None

    # --- what became of it ----------------------------------------------------------------------------

    @property
    def behaviour(self) -> Behaviour | Literal["forced"]:
        """Behaviour (see `motion_verdict.Judgement`); "forced" where the device only goes with the hand's tremor,
        "growing" where it was gone before there was anything to judge."""
        judged, tremor = self.judgement, self.hand.tremor
        if self.response.given_up and judged.behaviour == "undecided":
            return "growing"
        if tremor is None or judged.behaviour not in ("limit cycle", "undecided"):
            return judged.behaviour
        tolerance = 1.0 / (0.5 * len(self.response.time) * self.loop.period)
        return "forced" if abs(judged.frequency - tremor.frequency) < tolerance else judged.behaviour

    @property
    def stable(self) -> bool | None:
        """Whether the motion decays; None where the run leaves that open."""
        return None if self.behaviour in ("forced", "undecided") else self.judgement.stable is True

    @property
    def growth(self) -> float:
        """Of the motion per sample, ln rho; nan where nothing moves, or the run was too short to tell."""
        return self.judgement.growth

    @property
    def dominant_frequency(self) -> float:
        """In the second half [Hz]; nan where nothing moves."""
        return self.judgement.frequency

    @property
    def amplitude(self) -> float:
        """Half of peak to peak of the handle in the last quarter [m]."""
        return self.judgement.amplitude

    @property
    def contact_share(self) -> float:
        """Share of the second half with a force."""
        return self.judgement.contact

    @property
    def limited_share(self) -> float:
        """Share of the samples at which the force was cut to its limit."""
        return float((abs(self.force) >= self.force_limit * AT_LIMIT).mean())

    @property
    def given_up(self) -> bool:
        """Whether the run stopped early, the device farther from the wall than any device moves."""
        return self.response.given_up

    @cached_property
    def passivity(self) -> PassivityComparison | None:
        """Effect of the passivity controller; None without one."""
        if self.uncontrolled is None:
            return None
        drifts = is_pushed_on(self.point.loop, self.environment, self.values, self.hand)
        judged = judge_response(self.uncontrolled, drifts=drifts)
        return PassivityComparison(_felt_stiffness(self.response), _felt_stiffness(self.uncontrolled), judged)

    @property
    def ledger(self) -> dict[str, float]:
        """Energy that each source has supplied by the end, by its name (`time_response.SOURCES`) [J]."""
        return dict(zip(SOURCES, self.response.energies[-1].tolist(), strict=True))

    # --- what was simulated ---------------------------------------------------------------------------

    @property
    def loop(self) -> Loop:
        """The device without its operator, who is in `hand`."""
        return self.point.contact_loop

    @property
    def force_limit(self) -> float:
        """Largest force there is [N]; inf: none."""
        return self.loop.nonlinear.force_limit

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the environment's parameters by name."""
        return dict(zip(self.environment.names, self.values.tolist(), strict=True))

    @property
    def wall_position(self) -> float:
        """Where the environment begins [m]."""
        return self.response.wall_position

    @property
    def starts_inside(self) -> bool:
        """Whether the reading starts inside the wall."""
        return self.start_position > self.wall_position

    # --- in time --------------------------------------------------------------------------------------

    @property
    def time(self) -> Floats:
        """(S,) [s]"""
        return self.response.time

    @property
    def position(self) -> Floats:
        """(S,) the reading: what the encoders count [m]"""
        return self.response.reading

    @property
    def penetration(self) -> Floats:
        """(S,) of the reading into the environment [m]; negative outside"""
        return self.response.penetration

    @property
    def velocity(self) -> Floats:
        """(S,) its estimate [m/s]"""
        return self.response.velocity

    @property
    def force(self) -> Floats:
        """(S,) commanded, on the device along the direction [N]"""
        return self.response.force

    @property
    def handle(self) -> Floats:
        """(S,) the handle's position [m]"""
        return self.response.handle

    @property
    def energy(self) -> Floats:
        """(S,) kinetic and elastic, beyond that at the start [J]"""
        return self.response.stored

    # --- as data --------------------------------------------------------------------------------------

    def document(self) -> dict[str, Any]:
        """Everything by key and unit; None where inapplicable."""
        parameters, judged, left = self.parameters, self.judgement, self.range_exit
        return {
            "environment": self.environment.name,
            "parameters": parameters,
            "wall_stiffness_N_per_m": parameters.get("stiffness"),
            "wall_damping_Ns_per_m": parameters.get("damping"),
            "wall_position_m": self.wall_position,
            "start": {
                "position_m": self.start_position,
                "velocity_m_per_s": self.start_velocity,
                "off_the_path_m": self.distance_from_path,
                "inside": self.starts_inside,
            },
            "hand": _hand_document(self.hand),
            "duration_s": float(self.time[-1]),
            "duration_asked_s": self.length.seconds,
            "substeps": self.substeps,
            "seed": self.seed,
            "stable": self.stable,
            "behaviour": self.behaviour,
            "dominant_frequency_Hz": judged.frequency,
            "amplitude_m": judged.amplitude,
            "growth_per_sample": judged.growth,
            "predicted_growth_per_sample": self.predicted_growth,
            "contact_share": judged.contact,
            "limited_share": self.limited_share,
            "given_up": self.given_up,
            "range_m": left and (left.backward, left.forward),
            "left_range_at_s": left and left.time,
            "ledger_J": {as_key(name): energy for name, energy in self.ledger.items()},
            "ledger_imbalance": self.response.imbalance,
            "passivity": self._passivity_document(),
            **self.response.series,
        }

    def table(self) -> dict[str, Floats]:
        """The motion in time as columns, each entry of the energy ledger with its own."""
        return self.response.table()

    def _passivity_document(self) -> dict[str, Any] | None:
        if self.passivity is None:
            return None
        felt, without, judged = self.passivity
        return {
            "rendered_stiffness_N_per_m": felt,
            "without": {
                "rendered_stiffness_N_per_m": without,
                "stable": judged.stable,
                "behaviour": judged.behaviour,
                "amplitude_m": judged.amplitude,
            },
        }

    def __repr__(self) -> str:
        units = {parameter.name: parameter.unit for parameter in self.environment.parameters}
        values = [f"{name} {value:.4g} {units[name]}".rstrip() for name, value in self.parameters.items()]
        verdict = {True: "stable", False: "not stable", None: "undecided"}[self.stable]
        by_eigenvalues = "" if self.predicted_growth is None else f" (predicted {self.predicted_growth:.4g})"
        return "\n".join(
            [
                f"ContactSimulation: {', '.join([self.environment.name, *values])}",
                f"  {verdict}: {self.behaviour}, growth {self.growth:.4g} per sample{by_eigenvalues}",
                f"  amplitude {self.amplitude:.4g} m, dominant frequency {self.dominant_frequency:.4g} Hz",
                f"  largest force {np.nanmax(np.abs(self.force)):.4g} N, deepest {self.penetration.max():.4g} m",
                f"  {len(self.time)} samples, {self.time[-1]:.4g} s",
            ]
        )


def _felt_stiffness(response: TimeResponse) -> float:
    return rendered_stiffness(response.reading, response.force, response.wall_position)


def _hand_document(hand: Hand) -> dict[str, Any]:
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
