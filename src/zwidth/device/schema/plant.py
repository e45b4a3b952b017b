"""[plant]: the rendered direction's dynamics, for those who already know them."""

from __future__ import annotations

from zwidth.device.schema.numbers import DampingMatrix, MassMatrix, Section, StiffnessMatrix, Vector, quantity


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
