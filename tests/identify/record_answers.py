"""What `zwidth identify` says of a record that is not like a simulation."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from tests.identify.faulty_records import FaultyRecord
from tests.identify.impedance_bench import DOCUMENT
from tests.identify.record_benches import DELAY, arm
from zwidth.show import csv_text, run


@dataclass(frozen=True)
class Answer:
    """What `zwidth identify` says: its exit code, the sentence that a record is about, and all numbers."""

    code: int
    said: str
    numbers: Mapping[str, Mapping[str, Any]]


def answer(record: FaultyRecord, folder: Path) -> Answer:
    """Run the command on a record, with its files and the device's in a folder."""
    files = []
    for name, columns in zip(("first.csv", "second.csv"), record.runs(), strict=False):
        files.append(folder / name)
        text = columns if isinstance(columns, str) else csv_text(_arrays(columns))
        files[-1].write_text(text, encoding="utf-8")
    words = ("identify", record.kind, *files, *_device(record.kind, folder), *record.options, "--json")
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = run([str(word) for word in words])
    if record.where == "fault":
        return Answer(code, _plain(err.getvalue(), folder), {})
    document = json.loads(out.getvalue())
    numbers = {one["path"] or one["name"]: one for one in document["parameters"]}
    return Answer(code, _plain(_sentence(document, record, numbers), folder), numbers)


def _sentence(document, record, numbers):
    """The sentence of a document that holds the record's words; "" where nothing is said."""
    if record.where in numbers:
        one = numbers[record.where]
        return f"{record.where}: {one['value']:.4g}, {one['low']:.4g} to {one['high']:.4g} {one['unit']}"
    if record.where == "remark":
        return next((text for text in document["remarks"] if record.words in text), "")
    named = [one["reason"] for one in document["check"] if one["what"] == record.where]
    return next((f"{record.where}: {text}" for text in named if record.words in text), "")


def _plain(text, folder):
    return text.replace(f"{folder}/", "").strip()


def _arrays(columns):
    return {name: np.asarray(values) for name, values in columns.items()}


def _device(kind, folder):
    """Options that name the device of a kind's bench; its file is written where it is not bundled."""
    if kind == "stiffness":
        return "--device", "five-bar", "--joint", "upper-right"
    if kind in ("friction", "mass"):
        return "--device", "hapkit-course"
    path = folder / f"{kind}.toml"
    path.write_text(_inline_toml(arm()[0].document) if kind == "arm" else DOCUMENT, encoding="utf-8")
    return "--device", path, *(("--parameter", DELAY) if kind == "boundary" else ())


def _inline_toml(document):
    """A document as TOML, tables inline."""
    return "".join(f"{key} = {_value(value)}\n" for key, value in document.items())


def _value(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_value(one)}" for key, one in value.items()) + "}"
    return "[" + ", ".join(map(_value, value)) + "]" if isinstance(value, list | tuple) else json.dumps(value)
