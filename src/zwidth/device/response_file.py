"""Measured responses from CSV files, every fault with its line."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.faults import Fault, fail, plural, quote
from zwidth.device.read import LARGEST_TABLE, header_fault, non_blank_rows, read_text
from zwidth.device.schema.plant import ResponseSection
from zwidth.errors import DeviceError, FileError, ResponseError
from zwidth.model.raw_sweep import sweep_response
from zwidth.model.response import MeasuredHandle, MeasuredPath, Response, mean_path

Table = dict[str, Floats]  # columns, with the line of each row under LINE
# The column with which something is wrong ("": with the row), and of each line its number and a sentence.
Cause = tuple[str, list[tuple[int, str]]]

SPECTRUM: Final = ("frequency_Hz", "real_m_per_N", "imag_m_per_N")
RECORD: Final = ("time_s", "force_command_N", "position_m")
HANDLE_RECORD: Final = ("time_s", "handle_force_N", "position_m")
OPTIONAL: Final = ("coherence", "sweep")
# The paths of the handle by the fields of `MeasuredHandle`.
HANDLE_PATHS: Final = {
    "force_to_encoder": "handle_force_to_encoder",
    "command_to_handle": "command_to_handle",
    "force_to_handle": "handle_force_to_handle",
}
RESTING: Final = 1e-6  # of the largest force in an experiment, below which the other force counts as none
LINE: Final = ""
MOST_LINES: Final = 3  # reported for one cause
UNEVEN: Final = 0.05  # of the sampling period, by which time stamps may jitter
PERIOD_TOLERANCE: Final = 1e-3  # relative, by which their mean may differ from it


def read_response(section: ResponseSection, label: str, period: float) -> Response:
    """The response of a device file; several sweeps come with their mean.

    label   path of the device file
    period  sampling period T [s]
    Raises  DeviceError  with every fault of the first file that has some
    """
    names = section.files or (section.file or "",)
    folder = Path(label).parent
    # key of [response] and name of every file
    given = [("response.files" if section.files else "response.file", name) for name in names]
    given += [("response.handle_file", section.handle_file)] if section.handle_file else []
    outside = [(key, name) for key, name in given if not _lies_in(folder, folder / name)]
    if outside:
        wrong = "must lie in the folder of the device file, or below it, got {}; copy it there"
        raise DeviceError(Fault(label, key, wrong.format(quote(name))) for key, name in outside)
    responses = [one for name in names for one in _responses(folder / name, section, period)]
    first = responses[0]
    # of files with several sweeps, each compares its own
    for name, other in zip(
        [names[0], *names[1:]] if len(names) == len(responses) else [], responses, strict=False
    ):
        _check_frequencies(folder / name, other.frequency, first.frequency, names[0])
    response = first if len(responses) == 1 else _mean_response(responses)
    paths = {} if response.handle is None else _paths_of(response.handle)
    if section.handle_file is not None:
        frequency, more = _handle_experiment(folder / section.handle_file, section, period)
        _check_frequencies(folder / section.handle_file, frequency, response.frequency, names[0])
        if twice := sorted(set(paths) & set(more)):
            raise fail(
                str(folder / section.handle_file),
                f"{HANDLE_PATHS[twice[0]]}_real_m_per_N",
                f"is in {names[0]}, too; keep one of them",
            )
        paths |= more
    at_sensor, actuator = section.handle_at == "sensor", section.actuator_at == "sensor"
    if at_sensor or actuator or paths:
        handle = _measured_handle(paths, at_sensor=at_sensor, actuator_at_sensor=actuator)
        response = replace(response, handle=handle)
    return replace(response, delay=section.hardware_delay_samples)


def _check_frequencies(path: Path, frequency: Floats, first: Floats, first_name: str) -> None:
    """Raise DeviceError where the frequencies of a file, `path`, are not those of the first file, called
    `first_name`."""
    # 1e-6: files may be written with few digits
    if len(frequency) != len(first) or np.any(np.abs(frequency - first) > 1e-6 * first):
        raise fail(str(path), "", f"has other frequencies than {first_name}; sweeps must share them")


def _measured_handle(
    paths: Mapping[str, MeasuredPath], *, at_sensor: bool = False, actuator_at_sensor: bool = False
) -> MeasuredHandle:
    """A `MeasuredHandle` from measured paths by its field names, those not measured left out.

    at_sensor, actuator_at_sensor  whether the hand, or the command, acts on what the encoder reads
    """
    force_to_encoder, command_to_handle, force_to_handle = (paths.get(name) for name in HANDLE_PATHS)
    return MeasuredHandle(force_to_encoder, command_to_handle, force_to_handle, at_sensor, actuator_at_sensor)


def _paths_of(handle: MeasuredHandle) -> dict[str, MeasuredPath]:
    """The measured paths of a handle by field of `MeasuredHandle`; those not measured are left out."""
    paths = {name: getattr(handle, name) for name in HANDLE_PATHS}
    return {name: path for name, path in paths.items() if path is not None}


def _mean_response(responses: Sequence[Response]) -> Response:
    """The mean of repeated sweeps; its coherence at each frequency is that of the worst sweep."""
    first = responses[0]
    mean = mean_path([MeasuredPath(response.value, response.coherence) for response in responses])
    note = f"mean of {len(responses)} sweeps" + (f", each {first.note}" if first.note else "")
    handle = None
    if first.handle is not None:
        paths_by_sweep = [_paths_of(response.handle) for response in responses if response.handle is not None]
        shared = [name for name in HANDLE_PATHS if all(name in paths for paths in paths_by_sweep)]
        if len(paths_by_sweep) == len(responses):
            handle = _measured_handle(
                {name: mean_path([paths[name] for paths in paths_by_sweep]) for name in shared}
            )
    return replace(first, value=mean.value, coherence=mean.coherence, sweeps=mean.sweeps, note=note, handle=handle)


def _handle_experiment(
    path: Path, section: ResponseSection, period: float
) -> tuple[Floats, dict[str, MeasuredPath]]:
    """Frequencies (f,) [Hz] and paths, by field of `MeasuredHandle`, of the experiment in which the handle is
    pushed; of several sweeps in its file their mean.

    period  sampling period T [s]
    """
    table = _table(path, of_handle=True)
    if "time_s" in table:
        _check_time(path, table, period)
        _check_other_force_rests(path, table, "force_command_N", "handle_force_N")
        columns = {"force_to_encoder": "position_m", "force_to_handle": "handle_position_m"}
        found = {
            name: _record_response(path, table["handle_force_N"], table[column], section, period)
            for name, column in columns.items()
            if column in table
        }
        frequency = found["force_to_encoder"].frequency
        return frequency, {
            name: MeasuredPath(response.value, response.coherence) for name, response in found.items()
        }
    if "sweep" not in table:
        _check_spectrum(path, table, period)
        return table["frequency_Hz"], _handle_paths(table)
    parts = [
        {key: column[table["sweep"] == sweep] for key, column in table.items()} for sweep in _sweep_numbers(table)
    ]
    for sweep, part in zip(_sweep_numbers(table), parts, strict=True):
        _check_spectrum(path, part, period)
        _check_sweep(path, sweep, part["frequency_Hz"], parts[0]["frequency_Hz"])
    paths_by_sweep = [_handle_paths(part) for part in parts]
    return parts[0]["frequency_Hz"], {
        name: mean_path([paths[name] for paths in paths_by_sweep]) for name in paths_by_sweep[0]
    }


def _handle_paths(table: Table) -> dict[str, MeasuredPath]:
    """The paths of the handle that a table of spectra holds, by field of `MeasuredHandle`."""
    paths = {}
    for field, name in HANDLE_PATHS.items():
        real, imaginary = (table.get(f"{name}_{part}_m_per_N") for part in ("real", "imag"))
        if real is not None and imaginary is not None:
            paths[field] = MeasuredPath(real + 1j * imaginary, table.get("coherence"))
    return paths


def _sweep_numbers(table: Table) -> list[float]:
    """Numbers of the repetitions in a table, in its order."""
    return list(dict.fromkeys(table["sweep"].tolist()))


def _check_sweep(path: Path, sweep: float, frequency: Floats, first: Floats) -> None:
    """Raise DeviceError where the frequencies of the sweep of this number are not those of the first."""
    if len(frequency) != len(first) or np.any(frequency != first):
        raise fail(
            str(path), "sweep", f"sweep {sweep:g} has other frequencies than the first; sweeps must share them"
        )


def _responses(path: Path, section: ResponseSection, period: float) -> Iterator[Response]:
    """What one file holds: a response, several by their `sweep`, or a raw sweep turned into one; period T [s]."""
    table = _table(path)
    if "time_s" in table:
        yield _response_of_record(path, table, section, period)
        return
    if "sweep" not in table:
        yield _spectrum(path, table, section, period)
        return
    numbers = table["sweep"]
    parts = [
        _spectrum(path, {key: column[numbers == sweep] for key, column in table.items()}, section, period)
        for sweep in _sweep_numbers(table)
    ]
    for sweep, part in zip(_sweep_numbers(table), parts, strict=True):
        _check_sweep(path, sweep, part.frequency, parts[0].frequency)
    yield from parts


def _spectrum(path: Path, table: Table, section: ResponseSection, period: float) -> Response:
    """The response of a table with frequencies and complex values. Raises DeviceError for what cannot be a
    spectrum."""
    _check_spectrum(path, table, period)
    value = table["real_m_per_N"] + 1j * table["imag_m_per_N"]
    if not np.any(value):
        raise fail(str(path), "", "is 0 m/N at every frequency; is the position in metres?")
    paths = _handle_paths(table)
    return Response(
        table["frequency_Hz"],
        value,
        section.integrators,
        table.get("coherence"),
        section.averages or 1.0,
        handle=_measured_handle(paths) if paths else None,
    )


def _check_spectrum(path: Path, table: Table, period: float) -> None:
    """Raise DeviceError for frequencies that do not rise up to half the rate 1/period [Hz], a coherence out of
    range, or fewer than six frequencies."""
    frequency, lines = table["frequency_Hz"], table[LINE].astype(int)
    nyquist = 0.5 / period
    low, twice, falling = frequency <= 0.0, np.diff(frequency) == 0.0, np.diff(frequency) < 0.0
    above = np.flatnonzero(frequency > nyquist * (1.0 + 1e-9))
    causes: list[Cause] = [
        ("frequency_Hz", [(lines[i], text.format(frequency[i], frequency[i - 1])) for i in rows])
        for rows, text in (  # text: of a frequency and the one before it
            (np.flatnonzero(low), "must be greater than 0, got {:.10g}; leave the static value out"),
            (np.flatnonzero(twice) + 1, "{:.10g} is there twice; keep one of them"),
            (np.flatnonzero(falling) + 1, "{:.10g} follows {:.10g}; sort the lines by rising frequency"),
            (
                above[:1],  # all behind it are above, too
                f"{{:.10g}} is above half the sampling rate, {nyquist:.10g}; leave it out, or correct "
                "sampling_period_s",
            ),
        )
    ]
    coherence = table.get("coherence")
    if coherence is not None:
        outside = np.flatnonzero((coherence < 0.0) | (coherence > 1.0))
        causes.append(
            ("coherence", [(lines[i], f"must be from 0 to 1, got {coherence[i]:.10g}") for i in outside])
        )
    _raise_causes(path, causes)
    if len(frequency) < 6:
        raise fail(
            str(path),
            "",
            f"has {plural(len(frequency), 'frequency', 'frequencies')}; at least 6 are needed, "
            "a few hundred for an accurate chart",
        )


def _response_of_record(path: Path, table: Table, section: ResponseSection, period: float) -> Response:
    """A raw sweep as a response, with that of the handle where it was recorded."""
    _check_time(path, table, period)
    _check_other_force_rests(path, table, "handle_force_N", "force_command_N")
    force = table["force_command_N"]
    response = _record_response(path, force, table["position_m"], section, period)
    if "handle_position_m" not in table:
        return response
    held = _record_response(path, force, table["handle_position_m"], section, period)
    return replace(response, handle=MeasuredHandle(command_to_handle=MeasuredPath(held.value, held.coherence)))


def _record_response(
    path: Path, force: Floats, position: Floats, section: ResponseSection, period: float
) -> Response:
    """The response from a force to a position of a raw sweep, by its samples. Raises DeviceError."""
    try:
        return sweep_response(force, position, period, section.integrators, section.segment_samples)
    except ResponseError as error:
        raise fail(str(path), "", str(error)) from None


def _check_other_force_rests(path: Path, table: Table, resting: str, excited: str) -> None:
    """Raise DeviceError where a force that is to rest is not constant: its answer would count as that of the
    other.

    resting, excited  columns of the force that is to rest, and of the one that drives the experiment
    """
    if resting not in table:
        return
    resting_swing, excited_swing = float(np.ptp(table[resting])), float(np.ptp(table[excited]))
    if resting_swing > RESTING * excited_swing:
        raise fail(
            str(path),
            resting,
            f"varies by {resting_swing:.4g} N while {excited} is the excitation; keep it constant, and record the "
            "other experiment in a file of its own (response.file: the command, response.handle_file: the handle)",
        )


def _check_time(path: Path, table: Table, period: float) -> None:
    """Raise DeviceError for time stamps that are not those of the loop's samples, every period T [s]."""
    time, lines = table["time_s"], table[LINE].astype(int)
    steps = np.diff(time)
    if len(steps) == 0:
        raise fail(str(path), "", "has one line only; record a sweep")
    usual = float(np.median(steps))
    if usual <= 0.0:
        raise fail(
            str(path),
            f"line {lines[1]}: time_s",
            f"does not rise: the time falls or stands still, by {usual:.6g} s from most lines to the next; sort "
            "the lines by rising time",
        )
    uneven = np.flatnonzero(np.abs(steps - usual) > UNEVEN * usual)
    if len(uneven):
        i = int(uneven[0])
        raise fail(
            str(path),
            f"line {lines[i + 1]}: time_s",
            f"comes {steps[i]:.6g} s after the line before, most others {usual:.6g} s; a sweep needs every "
            "sample, evenly spaced",
        )
    # the jitter of single steps averages out of this one
    mean = float((time[-1] - time[0]) / len(steps))
    if abs(mean - period) > PERIOD_TOLERANCE * period:
        raise fail(
            str(path),
            "time_s",
            f"rises by {mean:.8g} s from line to line, but sampling_period_s is {period:.8g}; record every "
            "sample of the loop, or correct sampling_period_s",
        )


def _table(path: Path, *, of_handle: bool = False) -> Table:
    """The columns wanted of a CSV file by name, as numbers, and under LINE the line of each row. Raises
    DeviceError.

    of_handle  whether of the experiment in which the handle is pushed
    """
    rows = csv.reader(_csv_text(path).splitlines(), strict=True)
    values: list[list[float]] = []
    lines: list[int] = []
    uneven: list[tuple[int, str]] = []
    try:
        header = [name.strip() for name in next(non_blank_rows(rows), [])]
        columns = _columns_to_read(path, header, of_handle)
        places = [header.index(name) for name in columns]
        wrong: dict[str, list[tuple[int, str]]] = {name: [] for name in columns}
        for row in non_blank_rows(rows):
            if len(row) > len(header):
                text = f"has {len(row)} cells, but the header names {len(header)} columns"
                uneven.append((rows.line_num, f"{text}; write a decimal point, not a comma"))
                continue
            cells = [row[place].strip() if place < len(row) else "" for place in places]
            numbers = [_number_or_nan(cell) for cell in cells]
            for name, cell, number in zip(columns, cells, numbers, strict=True):
                if not np.isfinite(number):
                    wrong[name].append((rows.line_num, f"must be a finite number, {_got_text(cell)}"))
            values.append(numbers)
            lines.append(rows.line_num)
    except csv.Error as error:
        raise fail(str(path), f"line {rows.line_num}", f"is not CSV: {error}") from None
    _raise_causes(path, [("", uneven), *wrong.items()])
    if not values:
        raise fail(str(path), "", f"holds no numbers; give lines with {', '.join(columns)}")
    table = np.array(values).T
    return {LINE: np.array(lines, dtype=float), **dict(zip(columns, table, strict=True))}


def _columns_to_read(path: Path, header: list[str], of_handle: bool) -> list[str]:
    """Columns to read by a header: of a response or, with time_s, of a raw sweep. Raises DeviceError where one is
    missing.

    of_handle  whether of the experiment in which the handle is pushed
    """
    if not header:
        raise fail(str(path), "", f"is empty; its first line must name columns, such as {', '.join(SPECTRUM)}")
    wanted: tuple[str, ...]
    if "time_s" in header:
        wanted, other = (HANDLE_RECORD, RECORD) if of_handle else (RECORD, HANDLE_RECORD)
        if_there: tuple[str, ...] = ("handle_position_m", other[1])  # the force that is to rest
    else:
        paths = [name for name in HANDLE_PATHS.values() if not of_handle or name.startswith("handle")]
        pairs = [[f"{name}_{part}_m_per_N" for part in ("real", "imag")] for name in paths]
        given = [pair for pair in pairs if set(pair) & set(header)]
        if of_handle and not given:
            needed = ", ".join(["frequency_Hz", *pairs[0]])
            raise fail(str(path), "line 1", f"has no path from the handle's force; needed are {needed}")
        columns = [column for pair in given for column in pair]
        wanted, if_there = (("frequency_Hz",) if of_handle else SPECTRUM) + tuple(columns), OPTIONAL
    optional = [name for name in if_there if name in header]
    if fault := header_fault(header, wanted, optional):
        raise fail(str(path), "line 1", fault)
    return [*wanted, *optional]


def _raise_causes(path: Path, causes: Iterable[Cause]) -> None:
    """Raise DeviceError with the first lines of every cause, and how many more there are of it; nothing without
    causes."""
    faults = []
    for column, places in causes:
        faults += [
            Fault(str(path), f"line {line}: {column}" if column else f"line {line}", message)
            for line, message in places[:MOST_LINES]
        ]
        more = len(places) - MOST_LINES
        if more > 0:
            text = f"and {more} more line{'s' if more > 1 else ''}, the last of them line {places[-1][0]}"
            faults.append(Fault(str(path), column, text))
    if faults:
        raise DeviceError(faults)


def _number_or_nan(cell: str) -> float:
    """The number in a cell of a table; nan for other text."""
    try:
        return float(cell)
    except ValueError:
        return float("nan")


def _got_text(cell: str) -> str:
    return f"got {cell[:60]!r}" if cell else "but it is missing"


def _lies_in(folder: Path, path: Path) -> bool:
    """Whether a file lies in a folder or below it, all links followed.

    A device file from somebody else must not read other files of the user who opens it, nor through a link
    that came with it.
    """
    try:
        home = os.path.realpath(folder)
        return os.path.commonpath((home, os.path.realpath(path))) == home
    except ValueError:  # another drive, or a zero byte in the name
        return False


def _csv_text(path: Path) -> str:
    """The text of a CSV file. Raises DeviceError where it cannot be read."""
    try:
        return read_text(path, LARGEST_TABLE)
    except FileError as error:
        hint = "response.file is a path from the device file's folder" if error.missing else "give a CSV file"
        raise fail(str(path), "", f"{error}; {hint}") from None
