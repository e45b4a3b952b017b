"""Store of a job: its cells on disk in a zarr group, from which an interrupted run continues.

    values    (count, measures)  float64; nan where there is none
    status    (count, measures)  uint8, named by its attributes; 255 = not computed
    notes                        a journal beside them: why cells have no value

Attributes hold the fingerprint of the question and the version of the format. A store of another question is
emptied and begun again; one of a newer version is refused. Chunks are batches: one file of values and one of
status, each written whole or not at all, the status last.
"""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import numpy as np

from zwidth._version import __version__
from zwidth.device.format_version import STORE_VERSION, newer_version_message
from zwidth.measures.definition import MISSING, OK, STATUS, Note
from zwidth.study.jobs.job import CellValues, Job
from zwidth.study.jobs.journal import Journal, JournalError, fingerprint

KIND: Final = "cells"
NOTES: Final = "notes.jsonl"
PER_CELL: Final = 9  # bytes of value and status; compressed they take less


class StoreError(ValueError):
    """A store that cannot be used; the text says why, and what to do."""


class Store:
    """The batches of a job that are done, in a folder.

    path     of the folder
    batch    cells in each batch; None: not begun yet
    Raises   StoreError  for a folder or file that holds something else (it is left alone), and for cells that
                         would not fit on the disk
             OSError     where it cannot be read
    """

    def __init__(self, path: Path, job: Job) -> None:
        self.path = path
        self.measures, self.count = tuple(job.measures), job.count
        self.question = fingerprint(job.question, self.count, self.measures, __version__)
        self.batch: int | None = None
        self._ours = False
        self._arrays: tuple[Any, Any] | None = None
        self._notes = Journal(None, self.question)
        if path.exists() and not (path.is_dir() and not any(path.iterdir())):
            self._open()
        if self.batch is None:
            self._check_disk()

    def begin(self, batch: int) -> None:
        """Begin again with batches of this size; the store is emptied."""
        import zarr

        draft = self.path.with_name(f".{self.path.name[:40]}-{secrets.token_hex(4)}")
        try:
            group = zarr.open_group(str(draft), mode="w-", zarr_format=3)
            shape, chunks = (self.count, len(self.measures)), (min(batch, self.count), len(self.measures))
            attributes: dict[str, Any] = {"measures": list(self.measures)}
            group.create_array(
                "values", shape=shape, chunks=chunks, dtype="float64", fill_value=np.nan, attributes=attributes
            )
            meanings = [text.replace(" ", "_") for text in STATUS.values()]
            flags: dict[str, Any] = {"flag_values": list(STATUS), "flag_meanings": " ".join(meanings)}
            group.create_array(
                "status",
                shape=shape,
                chunks=chunks,
                dtype="uint8",
                fill_value=MISSING,
                attributes=attributes | flags,
            )
            header: dict[str, Any] = {
                "zwidth": KIND,
                "version": STORE_VERSION,
                "question": self.question,
                "batch": batch,
            }
            group.attrs.update(header)
            if self._ours or (self.path.is_dir() and not any(self.path.iterdir())):
                shutil.rmtree(self.path)
            draft.replace(self.path)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
        self._open()

    def stored_batches(self) -> Iterator[tuple[int, CellValues]]:
        """First cell and values of each batch that is done."""
        values, status = self._open_arrays()
        assert self.batch is not None
        for first in range(0, self.count, self.batch):
            part = slice(first, min(first + self.batch, self.count))
            with suppress(Exception):  # a file that a crash has damaged: its batch is not done
                cells = CellValues(values[part], status[part], self._batch_notes(first))
                # zarr does not tell a file that has gone from one that holds nan only
                lost = (cells.status == OK) & np.isnan(cells.values)
                if not (lost | (cells.status == MISSING)).any():
                    yield first, cells

    def write_batch(self, first: int, cells: CellValues) -> None:
        """Write a batch. Raises OSError where it cannot be written."""
        values, status = self._open_arrays()
        part = slice(first, first + len(cells.values))
        values[part] = cells.values
        if any(cells.notes):
            entry = [[[n.status, n.reason, n.count, list(n.first)] for n in notes] for notes in cells.notes]
            self._notes.get_or_compute(str(first), lambda: entry)
        status[part] = cells.status

    def remove(self) -> None:
        """Remove the store from the disk, if it is one of this job."""
        if self._ours:
            shutil.rmtree(self.path, ignore_errors=True)

    def _batch_notes(self, first: int) -> tuple[tuple[Note, ...], ...]:
        entry = self._notes.known.get(str(first), [[] for _ in self.measures])
        return tuple(tuple(Note(s, reason, n, tuple(at)) for s, reason, n, at in notes) for notes in entry)

    def _open_arrays(self) -> tuple[Any, Any]:
        assert self._arrays is not None, "not begun"
        return self._arrays

    def _open(self) -> None:
        """Open the folder: a store of this question, of another one, or something else."""
        import zarr

        other = StoreError(f"{self.path.name}: is not the store of a study; name another folder, or remove it")
        try:
            group = zarr.open_group(str(self.path), mode="r+")
            kind, version, question, batch = (
                group.attrs.get(key) for key in ("zwidth", "version", "question", "batch")
            )
        except PermissionError:
            raise
        except Exception:  # zarr's own, of many kinds
            raise other from None
        if kind == KIND and (message := newer_version_message(version, STORE_VERSION)):
            raise StoreError(f"{self.path.name}: its version {message}, or name another folder")
        if kind != KIND or not isinstance(batch, int):
            raise other
        self._ours = True
        if question != self.question:
            return
        try:
            self._arrays = group["values"], group["status"]
            self._notes = Journal(self.path / NOTES, self.question)
        except (KeyError, JournalError):
            raise StoreError(f"{self.path.name}: is damaged; remove it, or name another folder") from None
        self.batch = batch

    def _check_disk(self) -> None:
        folder = next((p for p in (self.path, *self.path.absolute().parents) if p.exists()), Path())
        free, wanted = shutil.disk_usage(folder).free, float(PER_CELL) * self.count * len(self.measures)
        if wanted > free:
            raise StoreError(
                f"{self.path.name}: {self.count} cells of {len(self.measures)} measures would take "
                f"{wanted / 1e9:.3g} GB of disk, of {free / 1e9:.3g} GB that are free; ask for fewer, or name a "
                "folder on another disk"
            )


def store_for(job: Job, store: Store | str | os.PathLike[str] | None) -> Store | None:
    """A job's store: the one given, or one in the folder of that name; None for None. Raises what `Store` does."""
    return Store(Path(store), job) if isinstance(store, str | os.PathLike) else store
