"""Nonlinear parts of a plant: dry friction, encoder steps, bent springs, programmable brakes, a force limit.

Charts and closed forms speak of the linear rest; `contact` simulates all of it. Every part works on one motion of
the plant, along . x, so that a reduced model carries it as it carries its dampers.

Projection of a part that acts on one motion of the full model onto the motions of a reduced one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, isfinite, nan
from typing import Literal, TypeVar

import numpy as np

from zwidth.arrays import Floats

FrictionModel = Literal["coulomb", "dahl", "lugre"]


@dataclass(frozen=True)
class Friction:
    """Dry friction of one motion, force = -along F, with v = along . x'.

        coulomb  F = C sign v; at rest what keeps it there, |F| <= C
        dahl     F = sigma_0 z,  z' = v (1 - sign(v) F/C)                    (Dahl 1968)
        lugre    F = sigma_0 z + sigma_1 z',  z' = v - sigma_0 |v| z / g(v),
                 g(v) = C + (F_s - C) exp(-(v/v_s)^2)                        (Canudas de Wit et al. 1995)

    along              (n,)
    coulomb            C [N], or [N m] where along . x is an angle
    bristle_stiffness  sigma_0 [N/m], of dahl and lugre
    bristle_damping    sigma_1 [N s/m], of lugre
    breakaway          F_s [N], at least C, of lugre; nan: C
    stribeck_velocity  v_s [m/s], of lugre with a breakaway above C
    """

    along: Floats
    coulomb: float
    model: FrictionModel = "coulomb"
    bristle_stiffness: float = inf
    bristle_damping: float = 0.0
    breakaway: float = nan
    stribeck_velocity: float = nan

    @property
    def bristles(self) -> tuple[float, float, float, float, float] | None:
        """C, F_s, v_s, sigma_0, sigma_1 as LuGre's law takes them; None where nothing bends, as in Coulomb's.

        Dahl's is the one with F_s = C and sigma_1 = 0; v_s is 1 where nothing depends on it.
        """
        if self.model == "coulomb" or not isfinite(self.bristle_stiffness):
            return None
        C = self.coulomb
        if self.model == "dahl":
            return C, C, 1.0, self.bristle_stiffness, 0.0
        most = self.breakaway if isfinite(self.breakaway) else C
        slow = self.stribeck_velocity if isfinite(self.stribeck_velocity) else 1.0
        return C, most, slow, self.bristle_stiffness, self.bristle_damping


@dataclass(frozen=True)
class Counter:
    """One encoder: its part of the reading is weight * step * round((along . x + noise) / step).

    step     of along . x [m or rad]; 0: as fine as you like
    noise    standard deviation of what is added before rounding [m or rad]
    channel  number of the encoder, which says what noise it draws: of a mechanism that of its drive; None: its
             place among the plant's counters
    """

    along: Floats
    step: float
    weight: float = 1.0
    noise: float = 0.0
    channel: int | None = None


@dataclass(frozen=True)
class Spring:
    """Nonlinear part of a spring's force: -along (cubic d^3 + excess min(d - kink, 0)),  d = along . x.

    Under load it is bent already, by an offset d0, and its tangent there is in the plant's stiffness: then the
    force is that at d0 + d, less that at d0 and less the tangent's.

    cubic            hardening, or softening where negative [N/m³]
    backward_excess  how much stiffer it is for d < kink [N/m];   kink  not positive [m]
    offset           d0 [m];   backward  whether the tangent at d0 is that of d < kink
    """

    along: Floats
    cubic: float = 0.0
    backward_excess: float = 0.0
    kink: float = 0.0
    offset: float = 0.0
    backward: bool = False


@dataclass(frozen=True)
class Brake:
    """A programmable damper, as an eddy-current brake is (Gosline and Hayward 2008): force = -along b along . x',
    tau b' + b = commanded damping.

    damping        the largest that can be commanded [N s/m]
    time_constant  tau [s]; 0: at once
    """

    along: Floats
    damping: float
    time_constant: float = 0.0


NonlinearElement = TypeVar("NonlinearElement", Friction, Counter, Spring, Brake)


@dataclass(frozen=True)
class Nonlinear:
    """All of a plant that is not linear; charts and closed forms leave it out, `simulate` has it.

    friction, counters, springs, brakes  the parts, of any number
    counters     whose weighted sum is the sensor; none: the sensor is read as finely as you like
    force_limit  largest force of the actuator [N]
    fed_friction  the computer feeds dry friction forward
    """

    friction: tuple[Friction, ...] = ()
    counters: tuple[Counter, ...] = ()
    springs: tuple[Spring, ...] = ()
    brakes: tuple[Brake, ...] = ()
    force_limit: float = inf
    fed_friction: bool = False

    def __bool__(self) -> bool:
        elements = self.friction or self.counters or self.springs or self.brakes
        return bool(elements or isfinite(self.force_limit) or self.fed_friction)

    def project(self, motions: Floats) -> Nonlinear:
        """The parts as they act on motions (n, m), one in each column, without those that act on none of them."""
        return replace(
            self,
            friction=_projected(self.friction, motions),
            counters=_projected(self.counters, motions),
            springs=_projected(self.springs, motions),
            brakes=_projected(self.brakes, motions),
        )

    def padded(self, count: int) -> Nonlinear:
        """The parts for a plant with more coordinates, added at the end."""
        return replace(
            self,
            friction=_padded(self.friction, count),
            counters=_padded(self.counters, count),
            springs=_padded(self.springs, count),
            brakes=_padded(self.brakes, count),
        )

    @property
    def kinds(self) -> tuple[str, ...]:
        """The nonlinear parts that a linear answer leaves out, in words."""
        present = {
            "dry friction": any(part.coulomb > 0.0 for part in self.friction),
            "encoder steps": any(part.step > 0.0 for part in self.counters),
            "noise": any(part.noise > 0.0 for part in self.counters),
            "nonlinear springs": bool(self.springs),
            "programmable brakes": bool(self.brakes),
            "the force limit": isfinite(self.force_limit),
            "Coulomb feedforward": self.fed_friction,
        }
        return tuple(name for name, there in present.items() if there)


def _projected(parts: tuple[NonlinearElement, ...], motions: Floats) -> tuple[NonlinearElement, ...]:
    carried = [replace(part, along=project_onto_motions(part.along, motions)) for part in parts]
    return tuple(part for part in carried if np.any(part.along))


def _padded(parts: tuple[NonlinearElement, ...], count: int) -> tuple[NonlinearElement, ...]:
    return tuple(replace(part, along=np.append(part.along, np.zeros(count))) for part in parts)


ROUNDING = 1e-12  # share of a motion that is none


def project_onto_motions(vector: Floats, motions: Floats) -> Floats:
    """vector . motion for each motion (m,), a column each of (n, m); rounding set to 0."""
    products = vector @ motions
    inside = np.abs(vector) @ np.abs(motions)
    return np.asarray(np.where(np.abs(products) > ROUNDING * inside, products, 0.0))
