"""[plant]: the rendered direction's dynamics, for those who already know them."""

from __future__ import annotations

from zwidth.device.schema.numbers import (
    DampingMatrix,
    Inductance,
    LossFactor,
    MassMatrix,
    Name,
    Number,
    Resistance,
    Section,
    StiffnessMatrix,
    Vector,
    quantity,
)


class ElectricalDampingSection(Section):
    """A motor whose winding is closed through a resistor: it brakes by k^2/(R + L s) (Mehling et al. 2005)."""

    name: Name | None = quantity("the motor's name: letters, digits, - and _; omitted: none", default=None)
    force_constant_N_per_A: Number = quantity("force per current, k", "N/A", gt=0)
    resistance_ohm: Resistance = quantity("resistance of winding and resistor together, R", "ohm", gt=0)
    inductance_H: Inductance = quantity("inductance of the winding, L; 0: no lag", "H", ge=0, default=0.0)
    along: Vector | None = quantity(
        "the coordinates that move the motor, n numbers; omitted: those of the actuator", "1", default=None
    )


class PlantSection(Section):
    """The rendered direction in n coordinates, M x'' + B x' + K x = actuator f; single numbers for n = 1."""

    mass_kg: MassMatrix = quantity("mass matrix M, n x n, symmetric and positive definite", "kg")
    damping_Ns_per_m: DampingMatrix | None = quantity(
        "damping matrix B, n x n, symmetric; omitted: none", "N s/m", default=None
    )
    stiffness_N_per_m: StiffnessMatrix | None = quantity(
        "stiffness matrix K, n x n, symmetric; omitted: none", "N/m", default=None
    )
    actuator: Vector | None = quantity(
        "where the wall force acts, n numbers; omitted only for n = 1", "1", default=None
    )
    sensor: Vector | None = quantity(
        "what the encoder reads, n numbers; omitted only for n = 1", "1", default=None
    )
    handle: Vector | None = quantity(
        "where the operator holds the device, n numbers; omitted for n = 1, or where no operator is wanted",
        "1",
        default=None,
    )
    loss_factor: LossFactor | None = quantity(
        "hysteretic damping, stiffness K (1 + i eta) in steady vibration; for zwidth chart and check only; "
        "omitted: none",
        "1",
        default=None,
    )
    electrical_damping: tuple[ElectricalDampingSection, ...] = quantity(
        "motors whose windings are closed through a resistor", default=()
    )
