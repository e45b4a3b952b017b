"""Results as JSON and CSV, and files that appear whole or not at all."""

from __future__ import annotations

import json
import math
import os
import secrets
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from zwidth.errors import OutputError

DATA: Final = (".csv", ".json")
FIGURES: Final = (".png", ".svg", ".pdf")
ARRAYS: Final = (".nc", ".mat")  # what `dataset.write_dataset` writes: maps and sweeps
FOLDERS: Final = (".zarr",)  # what `dataset.write_sweep_zarr` writes; one that is there is never replaced


def json_value(value: Any) -> Any:
    """The value as JSON's own types: arrays become lists, and what is not finite null.

    >>> json_value({"radius": float("nan"), "box": (0.0, 1.0)})
    {'radius': None, 'box': [0.0, 1.0]}
    """
    if _is_vector(value):
        return [x if x - x == 0.0 else None for x in value.tolist()]  # x - x is nan where x is not finite
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): json_value(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [json_value(inner) for inner in value]
    if hasattr(value, "tolist"):  # a NumPy array or number, known without importing NumPy
        return json_value(value.tolist())
    return value


def json_text(document: Mapping[str, Any]) -> str:
    """One strict JSON object, each of its keys on a line of its own."""
    items = json_value(document).items()
    lines = [f"  {json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in items]
    return "{\n" + ",\n".join(lines) + "\n}\n" if lines else "{}\n"


def csv_text(columns: Mapping[str, Sequence[Any]]) -> str:
    """A table with a header line; numbers with all their digits, what is not finite left empty.

    columns  name -> values (k,), all of one length
    """
    rows = zip(*map(_column_cells, columns.values()), strict=True)
    return "".join(",".join(row) + "\n" for row in [tuple(map(_csv_cell, columns)), *rows])


def _column_cells(values: Sequence[Any]) -> list[str]:
    """A column's values as cells of CSV, "" for what is not finite; numbers need no quotation marks."""
    if _is_vector(values):
        return [repr(x) if x - x == 0.0 else "" for x in values.tolist()]  # type: ignore[attr-defined]
    return [_csv_cell(value) for value in json_value(values)]


def _is_vector(value: Any) -> bool:
    """Whether this is a NumPy array of numbers in a row, known without importing NumPy; there may be millions."""
    return getattr(getattr(value, "dtype", None), "kind", "") == "f" and value.ndim == 1


def _csv_cell(value: Any) -> str:
    """A value as a cell of CSV, in quotation marks where it has a comma, a quotation mark or a line's end."""
    text = "" if value is None else value if isinstance(value, str) else repr(value)
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\r\n') else text


def destination(file: str | os.PathLike[str], kinds: Collection[str]) -> Path:
    """Where a result will be written, found writable before anything is computed.

    kinds    endings that this result can be written as, in lower case with their dot
    Returns  the path, links followed, so that the file a link points to is replaced and not the link
    Raises   OutputError  for another ending, a missing folder, a directory, a device, a lack of permission
    """
    name = os.fspath(file)
    ending = Path(name).suffix.lower()
    if ending not in kinds:
        other = f"{ending} is for maps and sweeps: the name " if ending in ARRAYS else ""
        allowed = f"{'one of ' if len(kinds) > 1 else ''}{', '.join(kinds)}"
        raise OutputError(f"{printable(name)}: {other}must end in {allowed}")
    try:
        path = Path(os.path.realpath(name))
        _check_place(path, name)
        probe = _draft_path(path)
        os.close(os.open(probe, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        probe.unlink()
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        raise _write_error(name, error) from None
    return path


def _check_place(path: Path, name: str) -> None:
    """Raise OutputError for a place that cannot be written: a folder, a device, a file without permission.

    name  as it was typed
    """
    if path.suffix.lower() in FOLDERS and path.exists():
        raise OutputError(f"{printable(name)}: exists already; remove it, or name another")
    if path.is_dir():
        raise OutputError(f"{printable(name)}: is a directory; name a file in it")
    if not path.parent.is_dir():
        raise OutputError(f"{printable(name)}: there is no folder {printable(str(path.parent))}; make it first")
    if path.exists() and not path.is_file():
        raise OutputError(f"{printable(name)}: is not an ordinary file; name another")
    if path.exists() and not os.access(path, os.W_OK):
        raise OutputError(f"{printable(name)}: cannot be written: permission denied; name another file")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A new file beside `path`, with the same ending, that takes its place if the block ends well.

    Whatever interrupts the block, what stood at `path` before stays as it was and nothing else is left.
    Raises OutputError  where the system refuses to write
    """
    draft = _draft_path(path)
    try:
        yield draft
        os.replace(draft, path)
    except OSError as error:
        raise _write_error(str(path), error) from None
    finally:
        with suppress(OSError):
            draft.unlink()


def write_text(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    with replacing(path) as draft:
        draft.write_text(text, encoding="utf-8", newline="\n")


def write_data(path: Path, document: Mapping[str, Any], table: Mapping[str, Sequence[Any]]) -> None:
    """The document as .json, or the table as .csv."""
    write_text(path, json_text(document) if path.suffix.lower() == ".json" else csv_text(table))


def printable(text: str) -> str:
    """Text from outside with everything unprintable made visible, so that it stays on its line."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape", "replace").decode() for c in text)


def _draft_path(path: Path) -> Path:
    """A hidden name that nothing has yet, in the folder of `path` and with its ending."""
    return path.with_name(f".{path.stem[:40]}-{secrets.token_hex(4)}{path.suffix}")


def _write_error(name: str, error: Exception) -> OutputError:
    """The error, in a sentence, for a file that the system refuses to write.

    name  of the file as it was typed;   error  what the system raised
    """
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return OutputError(
        f"{printable(name)}: cannot be written: {reason[:1].lower() + reason[1:]}; name another file"
    )
