"""What the hand feels of one rendered wall: impedance over frequency, and stiffness at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.chart.chart import largest_stiffness
from zwidth.chart.verdict import judge
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.handle_impedance import (
    Complex,
    Floats,
    commanded_impedance,
    felt_impedance,
    free_impedance,
    free_motion_mass,
    handle_of,
    refuse_local_loop,
    static_stiffness,
    static_stiffness_limit,
)
from zwidth.model.argument_checks import check_number, require
from zwidth.result import Result

COUNT: Final = 400  # frequencies, from LOWEST of half the sampling frequency up to HIGHEST of it
LOWEST, HIGHEST = 1e-3, 0.999


@dataclass(frozen=True, repr=False)
class FeltWall(Result):
    """What the hand feels of one wall, of the device without the operator; k frequencies.

    wall_stiffness, wall_damping         [N/m], [N s/m]
    verdict                              of the wall, the device held by its operator: "stable", "unstable" or
                                         "undecided"
    static_stiffness                     felt at rest [N/m]; None where the wall is not stable
    free_motion_mass                     felt in slow free motion [kg]; nan where a spring ties the handle to the
                                         ground
    stiffness_max                        of the stiffest stable wall [N/m]; None: none has K > 0 and B >= 0
    static_stiffness_at_stiffness_max    felt stiffness of that wall [N/m]; None as before
    static_stiffness_limit               felt stiffness that no wall exceeds [N/m]; inf for a rigid device
    frequency                            (k,)  [Hz]
    felt_impedance                       (k,)  at the handle [N s/m]; None where the wall is not stable
    commanded_impedance                  (k,)  that of an ideal wall, B + K/(jw) [N s/m]
    free_motion_impedance                (k,)  at the handle without any wall, with the computer's fixed feedback
                                         [N s/m]
    """

    wall_stiffness: float
    wall_damping: float
    verdict: str
    static_stiffness: float | None
    free_motion_mass: float
    stiffness_max: float | None
    static_stiffness_at_stiffness_max: float | None
    static_stiffness_limit: float
    frequency: Floats
    felt_impedance: Complex | None
    commanded_impedance: Complex
    free_motion_impedance: Complex

    @property
    def reason(self) -> str | None:
        """Why there is no felt impedance; None where the wall is stable."""
        if self.verdict == "stable":
            return None
        return f"this wall is {self.verdict}, so that there is no steady motion to feel"

    def document(self) -> dict[str, Any]:
        """All numbers by key and unit; the felt ones are None where the wall is not stable."""
        unknown = (
            dict.fromkeys(_impedance_columns("impedance", self.commanded_impedance))
            if self.felt_impedance is None
            else {}
        )
        return {
            "wall_stiffness_N_per_m": self.wall_stiffness,
            "wall_damping_Ns_per_m": self.wall_damping,
            "verdict": self.verdict,
            "static_stiffness_N_per_m": self.static_stiffness,
            "free_motion_mass_kg": self.free_motion_mass,
            "stiffness_max_N_per_m": self.stiffness_max,
            "static_stiffness_at_stiffness_max_N_per_m": self.static_stiffness_at_stiffness_max,
            "static_stiffness_limit_N_per_m": self.static_stiffness_limit,
            **self.table(),
            **unknown,
        }

    def table(self) -> dict[str, Floats]:
        """The impedances as columns, one frequency a row; nan for the felt one where the wall is not stable."""
        felt = (
            np.full(len(self.frequency), complex(np.nan, np.nan))
            if self.felt_impedance is None
            else self.felt_impedance
        )
        return {
            "frequency_Hz": self.frequency,
            **_impedance_columns("impedance", felt),
            **_impedance_columns("commanded", self.commanded_impedance),
            **_impedance_columns("free_motion", self.free_motion_impedance),
        }

    def __repr__(self) -> str:
        stiffest, limit = "no stable wall has K > 0 and B >= 0", self.static_stiffness_limit
        if self.stiffness_max is not None:
            felt = f"felt with {self.static_stiffness_at_stiffness_max:.4g} N/m"
            stiffest = f"stiffest stable wall {self.stiffness_max:.4g} N/m, {felt}"
        if limit < np.inf:
            stiffest += f"; no wall is felt above {limit:.4g} N/m"
        low, high = self.frequency[0], self.frequency[-1]
        return "\n".join(
            [
                f"FeltWall: {self.wall_stiffness:.6g} N/m, {self.wall_damping:.6g} N s/m, {self.verdict}",
                f"  {self.reason or f'felt at rest with {self.static_stiffness:.4g} N/m'}",
                f"  {stiffest}",
                f"  free motion {self.free_motion_mass:.4g} kg",
                f"  impedances at {len(self.frequency)} frequencies from {low:.4g} to {high:.4g} Hz",
            ]
        )


def _impedance_columns(name: str, impedance: Complex) -> dict[str, Floats]:
    return {f"{name}_real_Ns_per_m": impedance.real, f"{name}_imag_Ns_per_m": impedance.imag}


def felt_wall(point: OperatingPoint, stiffness: float, damping: float) -> FeltWall:
    """What the hand feels of a wall.

    point               the device; stability includes its operator, the felt impedance does not
    stiffness, damping  of the wall [N/m], [N s/m]
    Raises  HandleError  (measures.handle_impedance) where there is no handle
            ValueError   for a wall that is not finite
            what `OperatingPoint.plant` and `chart.chart.largest_stiffness` raise; of a measured device ResponseError

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> link, motor, hand = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([0.0, 1.0]), np.array([1.0, 0.0])
    >>> pair = Plant(np.diag([0.2616, 0.0254]), 1.8744 * link, 15620.0 * link, motor, motor, hand)
    >>> felt_wall(OperatingPoint(Controller(0.00125), given_plant=pair), 4000.0, 10.0)
    FeltWall: 4000 N/m, 10 N s/m, stable
      felt at rest with 3185 N/m
      stiffest stable wall 7134 N/m, felt with 4897 N/m; no wall is felt above 1.562e+04 N/m
      free motion 0.287 kg
      impedances at 400 frequencies from 0.4 to 399.6 Hz
    """
    require("point", point, OperatingPoint)
    check_number("stiffness", stiffness, "N/m")
    check_number("damping", damping, "N s/m")
    if point.response is not None:
        from zwidth.measures.felt_measured import felt_wall_of_response

        return felt_wall_of_response(point, stiffness, damping)
    plant, K, B = point.ungripped_plant, stiffness, damping
    handle_of(plant)
    verdict = judge(point.loop, [K], [B]).names[0]
    peak = largest_stiffness(point.loop)
    loop = point.without_operator.loop
    computer = loop.controller
    refuse_local_loop(computer)
    frequency = np.geomspace(LOWEST, HIGHEST, COUNT) * 0.5 / loop.period
    stable = verdict == "stable"
    return FeltWall(
        wall_stiffness=K,
        wall_damping=B,
        verdict=verdict,
        static_stiffness=float(static_stiffness(plant, K, computer)) if stable else None,
        free_motion_mass=free_motion_mass(plant, computer),
        stiffness_max=peak.stiffness if peak else None,
        static_stiffness_at_stiffness_max=float(static_stiffness(plant, peak.stiffness, computer))
        if peak
        else None,
        static_stiffness_limit=static_stiffness_limit(plant),
        frequency=frequency,
        felt_impedance=felt_impedance(loop, K, B, frequency) if stable else None,
        commanded_impedance=commanded_impedance(K, B, frequency),
        free_motion_impedance=free_impedance(loop, frequency),
    )
