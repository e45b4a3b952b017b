"""The rendered direction's dynamics: M x'' + B x' + K x = actuator * force, and what reads and holds it.

Beside it stand the nonlinear parts: dry friction, encoder steps, bent springs, programmable brakes, a force limit.
Charts and closed forms speak of the linear rest; `contact` simulates all of it. Every part works on one motion of
the plant, along . x, so that a reduced model carries it as it carries its dampers: it is projected onto its
motions.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf, isfinite, nan
from typing import Literal, TypeVar

import numpy as np

from zwidth.arrays import Floats
from zwidth.errors import HysteresisError
from zwidth.model.argument_checks import check_number
from zwidth.model.design_axes import Array1, Array2, Number, stack_numbers

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
        breakaway = self.breakaway if isfinite(self.breakaway) else C
        stribeck_velocity = self.stribeck_velocity if isfinite(self.stribeck_velocity) else 1.0
        return C, breakaway, stribeck_velocity, self.bristle_stiffness, self.bristle_damping


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
        """Whether there is any nonlinear part."""
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
        """The parts for a plant with `count` more coordinates at its end, on which they do not act."""
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
    """Elements as they act on motions (n, m), without those that act on none of them."""
    carried = [replace(part, along=project_onto_motions(part.along, motions)) for part in parts]
    return tuple(part for part in carried if np.any(part.along))


def _padded(parts: tuple[NonlinearElement, ...], count: int) -> tuple[NonlinearElement, ...]:
    """Elements for a plant with `count` more coordinates, on which they do not act."""
    return tuple(replace(part, along=np.append(part.along, np.zeros(count))) for part in parts)


ROUNDING = 1e-12  # share of a motion that is none


def project_onto_motions(vector: Floats, motions: Floats) -> Floats:
    """vector . motion for each motion (m,), a column each of (n, m); rounding set to 0."""
    products = vector @ motions
    inside = np.abs(vector) @ np.abs(motions)
    return np.asarray(np.where(np.abs(products) > ROUNDING * inside, products, 0.0))


@dataclass(frozen=True)
class LaggedDamper:
    """A damper whose force follows the velocity with a lag:  force = -along F,  tau F' + F = c along . x'.

    A motor whose winding is closed through a resistor brakes like this, c/(1 + tau s) = k_t^2/(R + L s)
    (Mehling, Colgate and Peshkin 2005); so does a spring of stiffness c/tau in series with a dashpot (Maxwell).

    along          (n,)  the velocity it works on is along . x'
    damping        c [N s/m], not negative
    time_constant  tau = L/R [s], positive; a damper without lag belongs into the damping matrix
    """

    along: Array1
    damping: Number
    time_constant: Number


@dataclass(frozen=True)
class SampledForce:
    """A force that the computer adds to the wall's under load, in proportion to where it sees the device:

        force = along (reading . x_j),   x_j the coordinates at the sample, held and delayed as the wall's force is

    It stems from the wall's constant force, which turns with the counted posture (`loaded_posture`).

    along     (n,)  where it acts
    reading   (n,)  [N/m], or [N m/rad] of angles
    filtered  whether it passes through the computer's force filter
    """

    along: Array1
    reading: Array1
    filtered: bool = False


@dataclass(frozen=True)
class Plant:
    """Linear dynamics about the haptic equilibrium (thesis eq. 2.5).

        M x'' + B x' + (K + C) x = actuator * f + lagged dampers + sampled forces,     y = sensor . x

    mass       (n, n)  symmetric positive definite [kg]
    damping    (n, n)  symmetric [N s/m]
    stiffness  (n, n)  K, symmetric [N/m]; under load not always positive
    actuator   (n,)    where the wall force f acts
    sensor     (n,)    what the encoder reads
    handle     (n,)    where the operator holds it; None: not known
    names      (n,)    coordinates, for people
    lagged_dampers     electrical damping and the like
    hysteresis (n, n)  imaginary part of the stiffness at positive frequencies, K (1 + i eta) for a loss factor eta
                       [N/m]; it describes steady vibration only, so that such a plant has no transition matrix
                       (see `chart.hysteretic_response`); None: none
    nonlinear          friction, encoder steps and the like: what only `contact` knows of
    hand_force (3, n)  force of the operator on the handle per x'', x' and x, as he is in the matrices already;
                       None: nobody holds it
    sampled_forces     what the computer adds under load
    circulatory (n, n) C, antisymmetric, of forces that turn with what they act on [N/m]; None: none
    without_load       the same without what the load changes; None: there is no load
    apart              the motions that no wall moves without load, as a plant of their own, if they do not count;
                       None: there are none, or they count

    Arrays may have leading axes of designs (`model.design_axes`); such plants are computed together, see
    `plant_modes`.
    """

    mass: Array2
    damping: Array2
    stiffness: Array2
    actuator: Array1
    sensor: Array1
    handle: Array1 | None = None
    names: tuple[str, ...] = ()
    lagged_dampers: tuple[LaggedDamper, ...] = ()
    hysteresis: Array2 | None = None
    nonlinear: Nonlinear = field(default_factory=Nonlinear)
    hand_force: Array2 | None = None
    sampled_forces: tuple[SampledForce, ...] = ()
    circulatory: Array2 | None = None
    without_load: Plant | None = None
    apart: Plant | None = None

    def __post_init__(self) -> None:
        """Make lists arrays. Raise ValueError for shapes that do not go together, of all but handle, hysteresis
        and hand force."""
        for name in ("mass", "damping", "stiffness", "actuator", "sensor", "handle", "hysteresis", "hand_force"):
            value = getattr(self, name)
            if value is not None and not isinstance(value, np.ndarray):
                object.__setattr__(self, name, np.asarray(value, dtype=np.float64))
        if self.mass.ndim < 2 or self.mass.shape[-1] != self.mass.shape[-2]:
            number = f"{float(self.mass):g}" if self.mass.ndim == 0 else f"one of the shape {self.mass.shape}"
            hint = f"; write [[{number}]] for one coordinate" if self.mass.ndim == 0 else ""
            raise ValueError(f"mass must be an array (n, n), got {number}{hint}")
        n = self.mass.shape[-1]
        for name, shape in (("damping", (n, n)), ("stiffness", (n, n)), ("actuator", (n,)), ("sensor", (n,))):
            given = getattr(self, name).shape
            if given[len(given) - len(shape) :] != shape:
                raise ValueError(
                    f"{name} must be an array {shape} where mass is {(n, n)}, got one of the shape {given}"
                )

    @property
    def is_loaded(self) -> bool:
        """Whether the plant has parts that only a load brings."""
        return bool(self.sampled_forces) or self.circulatory is not None

    def on_motions(self, motions: Floats) -> Plant:
        """The plant as it moves on some motions alone, the columns of (n, m); their amplitudes are its
        coordinates, without names. What stands apart is left out."""
        Z = np.asarray(motions)

        def both(matrix: Floats | None) -> Floats | None:
            return None if matrix is None else np.asarray(Z.T @ matrix @ Z)

        return replace(
            self,
            mass=Z.T @ self.mass @ Z,
            damping=Z.T @ self.damping @ Z,
            stiffness=Z.T @ self.stiffness @ Z,
            actuator=self.actuator @ Z,
            sensor=self.sensor @ Z,
            handle=None if self.handle is None else self.handle @ Z,
            names=(),
            lagged_dampers=tuple(replace(damper, along=damper.along @ Z) for damper in self.lagged_dampers),
            hysteresis=both(self.hysteresis),
            nonlinear=self.nonlinear.project(Z),
            hand_force=None if self.hand_force is None else self.hand_force @ Z,
            sampled_forces=tuple(
                replace(force, along=force.along @ Z, reading=force.reading @ Z) for force in self.sampled_forces
            ),
            circulatory=both(self.circulatory),
            without_load=None if self.without_load is None else self.without_load.on_motions(Z),
            apart=None,
        )

    def padded(self, names: tuple[str, ...]) -> Plant:
        """The plant with more coordinates at its end, of these names, that nothing acts on yet."""
        count = len(names)

        def longer(vector: Floats) -> Floats:
            return np.append(vector, np.zeros(count))

        def larger(matrix: Floats | None) -> Floats | None:
            return None if matrix is None else np.pad(matrix, (0, count))

        return replace(
            self,
            mass=np.pad(self.mass, (0, count)),
            damping=np.pad(self.damping, (0, count)),
            stiffness=np.pad(self.stiffness, (0, count)),
            actuator=longer(self.actuator),
            sensor=longer(self.sensor),
            handle=None if self.handle is None else longer(self.handle),
            names=(*self.names, *names) if self.names else (),
            lagged_dampers=tuple(replace(damper, along=longer(damper.along)) for damper in self.lagged_dampers),
            hysteresis=larger(self.hysteresis),
            nonlinear=self.nonlinear.padded(count),
            hand_force=None if self.hand_force is None else np.pad(self.hand_force, ((0, 0), (0, count))),
            sampled_forces=tuple(
                replace(force, along=longer(force.along), reading=longer(force.reading))
                for force in self.sampled_forces
            ),
            circulatory=larger(self.circulatory),
            without_load=None if self.without_load is None else self.without_load.padded(names),
        )

    def check_numbers(self) -> None:
        """Raise ValueError unless matrices and vectors are finite, and the mass matrix positive definite."""
        for name in ("mass", "damping", "stiffness", "actuator", "sensor"):
            values = getattr(self, name)
            if not np.isfinite(values).all():
                wrong = values[~np.isfinite(values)][0]
                raise ValueError(f"plant.{name} holds {wrong:g}; every number must be finite")
        try:
            np.linalg.cholesky(self.mass)
        except np.linalg.LinAlgError:
            least = float(np.min(np.linalg.eigvalsh(self.mass)))
            raise ValueError(
                f"plant.mass must be positive definite, and its least eigenvalue is {least:.4g} kg"
            ) from None

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return int(self.mass.shape[-1])

    @classmethod
    def one_mass(cls, mass: float, damping: float = 0.0, stiffness: float = 0.0) -> Plant:
        """A single mass that is driven, read and held where it is, with a damper and a spring to the ground.

        mass, damping, stiffness  [kg], [N s/m], [N/m]; or arrays over designs
        Raises  ValueError  for a mass that is not positive, a negative damping, a number that is not finite

        >>> Plant.one_mass(mass=0.03, damping=1.0).damping
        array([[1.]])
        """
        _check_numbers({"mass": mass}, damping, stiffness)
        one = np.ones(1)
        M, B, K = (stack_numbers([[value]]) for value in (mass, damping, stiffness))
        return cls(M, B, K, one, one.copy(), one.copy(), ("mass",))

    @classmethod
    def two_masses(
        cls, link_side_mass: float, motor_side_mass: float, stiffness: float, damping: float = 0.0
    ) -> Plant:
        """A link side, held by the operator, and a motor side, driven and read, joined by a spring and a damper.

        link_side_mass, motor_side_mass  [kg];   stiffness, damping  between them [N/m], [N s/m]; or arrays over
                                         designs
        Raises  ValueError  for masses that are not positive, a negative damping, a number that is not finite

        >>> Plant.two_masses(0.2616, 0.0254, stiffness=15620.0).names
        ('link side', 'motor side')
        """
        masses = {"link_side_mass": link_side_mass, "motor_side_mass": motor_side_mass}
        _check_numbers(masses, damping, stiffness)
        between = np.array([[1.0, -1.0], [-1.0, 1.0]])
        link, motor = np.eye(2)
        return cls(
            mass=stack_numbers([[link_side_mass, 0.0], [0.0, motor_side_mass]]),
            damping=np.multiply.outer(damping, between),
            stiffness=np.multiply.outer(stiffness, between),
            actuator=motor,
            sensor=motor.copy(),
            handle=link,
            names=("link side", "motor side"),
        )


def check_no_loss_factor(plant: Plant) -> None:
    """Raise HysteresisError for a plant with a loss factor."""
    if plant.hysteresis is not None:
        raise HysteresisError(
            "a loss factor describes steady vibration, not motion in time: only the chart and verdicts on walls "
            "can be computed with it; describe the damping by damping_Ns_per_m instead"
        )


def _check_numbers(masses: dict[str, float], damping: float, stiffness: float) -> None:
    """Raise ValueError unless all are finite, masses [kg] above 0 and the damping [N s/m] not below 0."""
    for name, value in masses.items():
        check_number(name, value, "kg", above=0.0)
    check_number("damping", damping, "N s/m", least=0.0)
    check_number("stiffness", stiffness, "N/m")
