"""[plant]: the rendered direction's dynamics, for those who already know them.

[response]: a measured frequency response in place of a model.
"""

from __future__ import annotations

from typing import Literal

from zwidth.device.schema import value_types
from zwidth.device.schema.value_types import Section, documented_key


class ElectricalDampingSection(Section):
    """A motor whose winding is closed through a resistor: it brakes by k^2/(R + L s) (Mehling et al. 2005)."""

    name: value_types.Name | None = documented_key(
        "the motor's name: letters, digits, - and _; omitted: none", default=None
    )
    force_constant_N_per_A: value_types.Number = documented_key("force per current, k", "N/A", gt=0)
    resistance_ohm: value_types.Resistance = documented_key(
        "resistance of winding and resistor together, R", "ohm", gt=0
    )
    inductance_H: value_types.Inductance = documented_key(
        "inductance of the winding, L; 0: no lag", "H", ge=0, default=0.0
    )
    along: value_types.Vector | None = documented_key(
        "the coordinates that move the motor, n numbers; omitted: those of the actuator", "1", default=None
    )


class SpringSection(Section):
    """What a spring of the plant has beyond its share of the stiffness matrix."""

    name: value_types.Name | None = documented_key(
        "the spring's name: letters, digits, - and _; omitted: none", default=None
    )
    along: value_types.Vector | None = documented_key(
        "its deflection d as a sum over the coordinates, n numbers; omitted only for n = 1", "1", default=None
    )
    hardening_N_per_m3: value_types.Hardening = documented_key(
        "k_3 of the force k_3 d^3 beside the linear one; negative: it softens", "N/m^3", default=0.0
    )
    backward_excess_N_per_m: value_types.Excess = documented_key(
        "how much stiffer it is where d is negative", "N/m", default=0.0
    )


class BrakeSection(Section):
    """A programmable brake: a damper whose strength the computer sets."""

    name: value_types.Name | None = documented_key(
        "the brake's name: letters, digits, - and _; omitted: none", default=None
    )
    along: value_types.Vector | None = documented_key(
        "the coordinates that move the brake, n numbers; omitted: those of the actuator", "1", default=None
    )
    damping_max_Ns_per_m: value_types.BristleDamper = documented_key(
        "largest damping that can be commanded", "N s/m"
    )
    time_constant_s: value_types.Number = documented_key("lag of its damping; 0: none", "s", ge=0, default=0.0)


class PlantSection(Section):
    """The rendered direction in n coordinates, M x'' + B x' + K x = actuator f; single numbers for n = 1."""

    mass_kg: value_types.MassMatrix = documented_key("mass matrix M, n x n, symmetric and positive definite", "kg")
    damping_Ns_per_m: value_types.DampingMatrix | None = documented_key(
        "damping matrix B, n x n, symmetric; omitted: none", "N s/m", default=None
    )
    stiffness_N_per_m: value_types.StiffnessMatrix | None = documented_key(
        "stiffness matrix K, n x n, symmetric; omitted: none", "N/m", default=None
    )
    actuator: value_types.Vector | None = documented_key(
        "where the wall force acts, n numbers; omitted only for n = 1", "1", default=None
    )
    sensor: value_types.Vector | None = documented_key(
        "what the encoder reads, n numbers; omitted only for n = 1", "1", default=None
    )
    handle: value_types.Vector | None = documented_key(
        "where the operator holds the device, n numbers; omitted for n = 1, or where no operator is wanted",
        "1",
        default=None,
    )
    loss_factor: value_types.LossFactor | None = documented_key(
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


class ResponseSection(Section):
    """Force command sample -> encoder sample, hold and hardware delay included: as spectra, or as raw sweeps."""

    file: value_types.Text | None = documented_key(
        "CSV beside this file: frequency_Hz, real_m_per_N, imag_m_per_N and perhaps coherence and sweep; or a raw "
        "sweep, time_s, force_command_N, position_m and perhaps handle_position_m; the paths of the handle "
        "as handle_force_to_encoder_real_m_per_N and _imag_m_per_N, command_to_handle_..., "
        "handle_force_to_handle_...",
        default=None,
    )
    files: tuple[value_types.Text, ...] | None = documented_key(
        "several such files, repetitions of one measurement; instead of file", min_length=2, default=None
    )
    integrators: value_types.WholeNumber | None = documented_key(
        "poles at z = 1: 0, 1 or 2; omitted: read off the low-frequency phase", "1", ge=0, le=2, default=None
    )
    averages: value_types.Number | None = documented_key(
        "independent averages behind a coherence column; omitted: 1, the widest band", "1", ge=1, default=None
    )
    segment_samples: value_types.WholeNumber | None = documented_key(
        "samples whose spectrum resolves a raw sweep closely enough; omitted: as closely as the record allows",
        "1",
        ge=64,
        default=None,
    )
    handle_file: value_types.Text | None = documented_key(
        "CSV of a second experiment, in which the handle is pushed and the command rests: the columns of the "
        "paths from the handle's force at the same frequencies; or a raw sweep, time_s, handle_force_N, "
        "position_m and perhaps handle_position_m",
        default=None,
    )
    handle_at: Literal["sensor"] | None = documented_key(
        '"sensor": the hand holds what the encoder reads, so that handle_force_to_handle and command_to_handle '
        "follow",
        default=None,
    )
    actuator_at: Literal["sensor"] | None = documented_key(
        '"sensor": the command acts on what the encoder reads, so that command_to_handle follows from '
        "handle_force_to_encoder; with handle_at all follow from the response",
        default=None,
    )
    hardware_delay_samples: value_types.Number | None = documented_key(
        "delay of the hardware, which the response holds; omitted: fitted where it is needed",
        "1",
        ge=0,
        default=None,
    )
