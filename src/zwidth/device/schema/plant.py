"""[plant]: the rendered direction's dynamics, for those who already know them."""

from __future__ import annotations

from zwidth.device.schema.value_types import (
    BristleDamper,
    DampingMatrix,
    Excess,
    Hardening,
    Inductance,
    LossFactor,
    MassMatrix,
    Name,
    Number,
    Resistance,
    Section,
    StiffnessMatrix,
    Vector,
    documented_key,
)


class ElectricalDampingSection(Section):
    """A motor whose winding is closed through a resistor: it brakes by k^2/(R + L s) (Mehling et al. 2005)."""

    name: Name | None = documented_key("the motor's name: letters, digits, - and _; omitted: none", default=None)
    force_constant_N_per_A: Number = documented_key("force per current, k", "N/A", gt=0)
    resistance_ohm: Resistance = documented_key("resistance of winding and resistor together, R", "ohm", gt=0)
    inductance_H: Inductance = documented_key("inductance of the winding, L; 0: no lag", "H", ge=0, default=0.0)
    along: Vector | None = documented_key(
        "the coordinates that move the motor, n numbers; omitted: those of the actuator", "1", default=None
    )


class SpringSection(Section):
    """What a spring of the plant has beyond its share of the stiffness matrix."""

    name: Name | None = documented_key("the spring's name: letters, digits, - and _; omitted: none", default=None)
    along: Vector | None = documented_key(
        "its deflection d as a sum over the coordinates, n numbers; omitted only for n = 1", "1", default=None
    )
    hardening_N_per_m3: Hardening = documented_key(
        "k_3 of the force k_3 d^3 beside the linear one; negative: it softens", "N/m^3", default=0.0
    )
    backward_excess_N_per_m: Excess = documented_key(
        "how much stiffer it is where d is negative", "N/m", default=0.0
    )


class BrakeSection(Section):
    """A programmable brake: a damper whose strength the computer sets."""

    name: Name | None = documented_key("the brake's name: letters, digits, - and _; omitted: none", default=None)
    along: Vector | None = documented_key(
        "the coordinates that move the brake, n numbers; omitted: those of the actuator", "1", default=None
    )
    damping_max_Ns_per_m: BristleDamper = documented_key("largest damping that can be commanded", "N s/m")
    time_constant_s: Number = documented_key("lag of its damping; 0: none", "s", ge=0, default=0.0)


class PlantSection(Section):
    """The rendered direction in n coordinates, M x'' + B x' + K x = actuator f; single numbers for n = 1."""

    mass_kg: MassMatrix = documented_key("mass matrix M, n x n, symmetric and positive definite", "kg")
    damping_Ns_per_m: DampingMatrix | None = documented_key(
        "damping matrix B, n x n, symmetric; omitted: none", "N s/m", default=None
    )
    stiffness_N_per_m: StiffnessMatrix | None = documented_key(
        "stiffness matrix K, n x n, symmetric; omitted: none", "N/m", default=None
    )
    actuator: Vector | None = documented_key(
        "where the wall force acts, n numbers; omitted only for n = 1", "1", default=None
    )
    sensor: Vector | None = documented_key(
        "what the encoder reads, n numbers; omitted only for n = 1", "1", default=None
    )
    handle: Vector | None = documented_key(
        "where the operator holds the device, n numbers; omitted for n = 1, or where no operator is wanted",
        "1",
        default=None,
    )
    loss_factor: LossFactor | None = documented_key(
        "hysteretic damping, stiffness K (1 + i eta) in steady vibration; for charts and single walls only; "
        "omitted: none",
        "1",
        default=None,
    )
    electrical_damping: tuple[ElectricalDampingSection, ...] = documented_key(
        "motors whose windings are closed through a resistor", default=()
    )
    spring: tuple[SpringSection, ...] = documented_key("springs that are not straight", default=())
    brake: tuple[BrakeSection, ...] = documented_key("programmable brakes", default=())
