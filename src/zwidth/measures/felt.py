"""What the hand feels of one rendered wall: the result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.measures.handle_impedance import LimitKind
from zwidth.result import Result

LIMIT_HEADINGS: Final[dict[LimitKind, str]] = {
    "bound": "no wall is felt above",
    "limit": "a wall without end is felt with",
    "infinite": "a wall without end is felt with",
    "unknown": "a wall without end is felt with",
}
LIMIT_WORDS: Final[dict[LimitKind, str]] = {
    "infinite": "no limit: nothing gives way between sensor and handle",
    "unknown": "a stiffness that the measurement does not show",
}


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
    static_stiffness_limit               felt stiffness of a wall without end [N/m]; inf where nothing gives way
    static_stiffness_limit_kind          "bound": no wall is felt stiffer; "limit": walls of finite stiffness
                                         may be; "infinite"; "unknown": errors of a measurement hide it
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
    static_stiffness_limit_kind: LimitKind
    frequency: Floats
    felt_impedance: Complexes | None
    commanded_impedance: Complexes
    free_motion_impedance: Complexes

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
            "static_stiffness_limit_kind": self.static_stiffness_limit_kind,
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
        stiffest = "no stable wall has K > 0 and B >= 0"
        if self.stiffness_max is not None:
            felt = f"felt with {self.static_stiffness_at_stiffness_max:.4g} N/m"
            stiffest = f"stiffest stable wall {self.stiffness_max:.4g} N/m, {felt}"
        limit, kind = self.static_stiffness_limit, self.static_stiffness_limit_kind
        stiffest += f"; {LIMIT_HEADINGS[kind]} {LIMIT_WORDS.get(kind, f'{limit:.4g} N/m')}"
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


def _impedance_columns(name: str, impedance: Complexes) -> dict[str, Floats]:
    return {f"{name}_real_Ns_per_m": impedance.real, f"{name}_imag_Ns_per_m": impedance.imag}
