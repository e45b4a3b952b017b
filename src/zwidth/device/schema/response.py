"""[response]: a measured frequency response in place of a model."""

from __future__ import annotations

from zwidth.device.schema.value_types import Number, Section, Text, WholeNumber, documented_key


class ResponseSection(Section):
    """Force command sample -> encoder sample, hold and hardware delay included: as spectra, or as raw sweeps."""

    file: Text | None = documented_key(
        "CSV beside this file: frequency_Hz, real_m_per_N, imag_m_per_N and perhaps coherence and sweep; or a raw "
        "sweep, time_s, force_command_N, position_m",
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
        "samples in a segment of a raw sweep; omitted: such that about 15 are averaged",
        "1",
        ge=64,
        default=None,
    )
