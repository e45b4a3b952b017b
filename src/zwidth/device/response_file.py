"""Measured responses from CSV files, every fault with its line."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.device.faults import DeviceError, Fault, fail, plural, quote
from zwidth.device.schema.response import ResponseSection
from zwidth.device.text_file import LARGEST_TABLE, UnreadableFileError, header_fault, non_blank_rows, read_text
from zwidth.model.response import Response, ResponseError
from zwidth.model.sweep_response import sweep_response

Floats = NDArray[np.float64]
Table = dict[str, Floats]  # columns, with the line of each row under LINE
Cause = tuple[
    str, list[tuple[int, str]]
]  # what is wrong with a column ("": with the row): every line, and a sentence

SPECTRUM: Final = ("frequency_Hz", "real_m_per_N", "imag_m_per_N")
RECORD: Final = ("time_s", "force_command_N", "position_m")
OPTIONAL: Final = ("coherence", "sweep")
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
    outside = [name for name in names if not _lies_in(folder, folder / name)]
    if outside:
        key = "response.files" if section.files else "response.file"
        wrong = "must lie in the folder of the device file, or below it, got {}; copy it there"
        raise DeviceError(Fault(label, key, wrong.format(quote(name))) for name in outside)
    responses = [one for name in names for one in _responses(folder / name, section, period)]
    first = responses[0]
    for name, other in zip(
        [names[0], *names[1:]] if len(names) == len(responses) else [], responses, strict=False
    ):
        if len(other.frequency) != len(first.frequency) or np.any(
            np.abs(other.frequency - first.frequency) > 1e-6 * first.frequency
        ):
            raise fail(str(folder / name), "", f"has other frequencies than {names[0]}; sweeps must share them")
    return first if len(responses) == 1 else _mean(responses)


def _mean(responses: Sequence[Response]) -> Response:
    """Repeated sweeps as one response; a frequency is as coherent as in the worst of them."""
    sweeps = np.array([response.value for response in responses])
    known = [response.coherence for response in responses if response.coherence is not None]
    coherence = np.min(known, axis=0) if known else None
    note = f"mean of {len(responses)} sweeps" + (f", each {responses[0].note}" if responses[0].note else "")
    return replace(responses[0], value=sweeps.mean(axis=0), coherence=coherence, sweeps=sweeps, note=note)


def _responses(path: Path, section: ResponseSection, period: float) -> Iterator[Response]:
    """What one file holds: a response, several by their `sweep`, or a raw sweep turned into one."""
    table = _table(path)
    if "time_s" in table:
        yield _response_of_record(path, table, section, period)
        return
    if "sweep" not in table:
        yield _spectrum(path, table, section, period)
        return
    numbers = table["sweep"]
    parts = [
        _spectrum(path, {key: column[numbers == n] for key, column in table.items()}, section, period)
        for n in dict.fromkeys(numbers.tolist())
    ]
    for n, part in zip(dict.fromkeys(numbers.tolist()), parts, strict=True):
        if len(part.frequency) != len(parts[0].frequency) or np.any(part.frequency != parts[0].frequency):
            raise fail(
                str(path), "sweep", f"sweep {n:g} has other frequencies than the first; sweeps must share them"
            )
    yield from parts


def _spectrum(path: Path, table: Table, section: ResponseSection, period: float) -> Response:
    """A response read unchanged, its frequencies checked."""
    f, lines = table["frequency_Hz"], table[LINE].astype(int)
    half = 0.5 / period
    low, twice, falling = f <= 0.0, np.diff(f) == 0.0, np.diff(f) < 0.0
    above = np.flatnonzero(f > half * (1.0 + 1e-9))
    causes: list[Cause] = [
        ("frequency_Hz", [(lines[i], text.format(f[i], f[i - 1])) for i in rows])
        for rows, text in (
            (np.flatnonzero(low), "must be greater than 0, got {:.10g}; leave the static value out"),
            (np.flatnonzero(twice) + 1, "{:.10g} is there twice; keep one of them"),
            (np.flatnonzero(falling) + 1, "{:.10g} follows {:.10g}; sort the lines by rising frequency"),
            (
                above[:1],
                f"{{:.10g}} is above half the sampling rate, {half:.10g}; leave it out, or correct "
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
    _raise(path, causes)
    if len(f) < 6:
        raise fail(
            str(path),
            "",
            f"has {plural(len(f), 'frequency', 'frequencies')}; at least 6 are needed, "
            "a few hundred for an accurate chart",
        )
    value = table["real_m_per_N"] + 1j * table["imag_m_per_N"]
    if not np.any(value):
        raise fail(str(path), "", "is 0 m/N at every frequency; is the position in metres?")
    return Response(f, value, section.integrators, coherence, section.averages or 1.0)


def _response_of_record(path: Path, table: Table, section: ResponseSection, period: float) -> Response:
    """A raw sweep as a response, its time stamps checked against the loop's sampling period."""
    time, lines = table["time_s"], table[LINE].astype(int)
    steps = np.diff(time)
    if len(steps) == 0:
        raise fail(str(path), "", "has one line only; record a sweep")
    mean = float(np.median(steps))
    if mean <= 0.0:
        raise fail(
            str(path),
            f"line {lines[1]}: time_s",
            f"does not rise: the time falls or stands still, by {mean:.6g} s from most lines to the next; sort "
            "the lines by rising time",
        )
    uneven = np.flatnonzero(np.abs(steps - mean) > UNEVEN * mean)
    if len(uneven):
        i = int(uneven[0])
        raise fail(
            str(path),
            f"line {lines[i + 1]}: time_s",
            f"comes {steps[i]:.6g} s after the line before, most others {mean:.6g} s; a sweep needs every sample, "
            "evenly spaced",
        )
    mean = float((time[-1] - time[0]) / len(steps))
    if abs(mean - period) > PERIOD_TOLERANCE * period:
        raise fail(
            str(path),
            "time_s",
            f"rises by {mean:.8g} s from line to line, but sampling_period_s is {period:.8g}; record every "
            "sample of the loop, or correct sampling_period_s",
        )
    try:
        return sweep_response(
            table["force_command_N"], table["position_m"], period, section.integrators, section.segment_samples
        )
    except ResponseError as error:
        raise fail(str(path), "", str(error)) from None


def _table(path: Path) -> Table:
    """The columns wanted, as numbers, and each row's line."""
    rows = csv.reader(_text(path).splitlines(), strict=True)
    values: list[list[float]] = []
    lines: list[int] = []
    uneven: list[tuple[int, str]] = []
    try:
        header = [name.strip() for name in next(non_blank_rows(rows), [])]
        columns = _columns(path, header)
        places = [header.index(name) for name in columns]
        wrong: dict[str, list[tuple[int, str]]] = {name: [] for name in columns}
        for row in non_blank_rows(rows):
            if len(row) > len(header):
                text = f"has {len(row)} cells, but the header names {len(header)} columns"
                uneven.append((rows.line_num, f"{text}; write a decimal point, not a comma"))
                continue
            cells = [row[place].strip() if place < len(row) else "" for place in places]
            numbers = [_number(cell) for cell in cells]
            for name, cell, number in zip(columns, cells, numbers, strict=True):
                if not np.isfinite(number):
                    wrong[name].append((rows.line_num, f"must be a finite number, {_got(cell)}"))
            values.append(numbers)
            lines.append(rows.line_num)
    except csv.Error as error:
        raise fail(str(path), f"line {rows.line_num}", f"is not CSV: {error}") from None
    _raise(path, [("", uneven), *wrong.items()])
    if not values:
        raise fail(str(path), "", f"holds no numbers; give lines with {', '.join(columns)}")
    table = np.array(values).T
    return {LINE: np.array(lines, dtype=float), **dict(zip(columns, table, strict=True))}


def _columns(path: Path, header: list[str]) -> list[str]:
    """The columns to read: those of a response or those of a raw sweep."""
    if not header:
        raise fail(str(path), "", f"is empty; its first line must name columns, such as {', '.join(SPECTRUM)}")
    wanted = RECORD if "time_s" in header else SPECTRUM
    optional = [name for name in OPTIONAL if name in header and wanted is SPECTRUM]
    if fault := header_fault(header, wanted, optional):
        raise fail(str(path), "line 1", fault)
    return [*wanted, *optional]


def _raise(path: Path, causes: Iterable[Cause]) -> None:
    """Raise DeviceError with the first lines of every cause, and how many more there are of it."""
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


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return float("nan")


def _got(cell: str) -> str:
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


def _text(path: Path) -> str:
    try:
        return read_text(path, LARGEST_TABLE)
    except UnreadableFileError as error:
        hint = "response.file is a path from the device file's folder" if error.missing else "give a CSV file"
        raise fail(str(path), "", f"{error}; {hint}") from None
