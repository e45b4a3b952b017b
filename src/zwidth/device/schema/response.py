"""[response]: a measured frequency response in place of a model."""

from __future__ import annotations

from typing import Literal

from zwidth.device.schema.value_types import Number, Section, Text, WholeNumber, documented_key


class ResponseSection(Section):
    """Force command sample -> encoder sample, hold and hardware delay included: as spectra, or as raw sweeps."""

    file: Text | None = documented_key(
        "CSV beside this file: frequency_Hz, real_m_per_N, imag_m_per_N and perhaps coherence and sweep; or a raw "
        "sweep, time_s, force_command_N, position_m and perhaps handle_position_m; the paths of the handle "
        "as handle_force_to_encoder_real_m_per_N and _imag_m_per_N, command_to_handle_..., "
        "handle_force_to_handle_...",
        default=None,
    )
    files: tuple[Text, ...] | None = documented_key(
        "several such files, repetitions of one measurement; instead of file", min_length=2, default=None
    )
    integrators: WholeNumber | None = documented_key(
        "poles at z = 1: 0, 1 or 2; omitted: read off the low-frequency phase", "1", ge=0, le=2, default=None
    )
    averages: Number | None = documented_key(
        "independent averages behind a coherence column; omitted: 1, the widest band", "1", ge=1, default=None
    )
    segment_samples: WholeNumber | None = documented_key(
        "samples whose spectrum resolves a raw sweep closely enough; omitted: as closely as the record allows",
        "1",
        ge=64,
        default=None,
    )
    handle_file: Text | None = documented_key(
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
    hardware_delay_samples: Number | None = documented_key(
        "delay of the hardware, which the response holds; omitted: fitted where it is needed",
        "1",
        ge=0,
        default=None,
    )
