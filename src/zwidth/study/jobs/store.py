"""Store of a job: its cells on disk in a zarr group, from which an interrupted run continues.

    values    (count, measures)  float64; nan where there is none
    status    (count, measures)  uint8, named by its attributes; 255 = not computed
    notes                        a file beside them: why cells have no value, and a digest of each batch
    lock                         held by the run that writes here

Attributes hold the fingerprint of the question, the release of zwidth that computes and the version of the format.
A store of another question or release, or of another version, is refused and left as it is. Chunks are batches:
one file of values and one of status, each written whole or not at all, the status last.

Every file can be told from a damaged one: chunks and lines of notes have checksums, the arrays' descriptions
digests in the group's attributes, and these a digest of their own. A damaged batch is not done, and is computed
again; a store with damaged descriptions is refused.

A lock on a folder that ends with the process that holds it, however that ends.

Notes of a store's batches: a file of lines, of which only their places are kept in memory.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import shutil
import socket
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from zwidth._version import __version__
from zwidth.arrays import Flags, Floats
from zwidth.device.read import STORE_VERSION, newer_version_message, unchecked_version_message
from zwidth.errors import StoreError
from zwidth.measures.definition import MISSING, OUT_OF_TIME, STATUS, Note, NoteSummary
from zwidth.resources import check_memory
from zwidth.study.jobs.job import CellValues, Job, Notes
from zwidth.study.jobs.journal import checked_line, fingerprint, read_checked_line

KIND: Final = "cells"
NOTES: Final = "notes.jsonl"
DESCRIPTION: Final = "zarr.json"  # of an array: shape, type, chunks, codecs, attributes
ARRAYS: Final = ("values", "status")
DIGEST: Final = "digest"  # attribute: of all others
PER_CELL: Final = 9  # bytes of value and status; compressed they take less
UNLIMITED: Final = float("inf")


def error_of_kept_folder(folder: str, whose: str) -> StoreError:
    """The error about a folder with the finished work of another question or release, which is left as it is.

    whose  whose work it is, as `whose_work` says it; the error keeps it for callers that name another folder
    """
    return StoreError(f"{folder}: {whose}; name another folder, or remove it", whose)


class Store:
    """The batches of a job that are done, in a folder.

    path     of the folder
    batch    cells in each batch; None: not begun yet
    Raises   StoreError  for a folder or file that holds something else or the cells of another question or release
                         (it is left alone), and for cells that would not fit on the disk
             OSError     where it cannot be read
    """

    def __init__(self, path: Path, job: Job) -> None:
        self.path = path
        self.measures, self.count = tuple(job.measures), job.count
        study = job.question, self.count, self.measures
        self.question = fingerprint(*study, __version__)
        self._study = fingerprint(*study)  # the same in every release
        self.batch: int | None = None
        self._arrays: tuple[Any, Any] | None = None
        self._notes: NotesFile | None = None
        self._lock = FolderLock()
        if self._is_there():
            self._open()
        if self.batch is None:
            self._check_disk()

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other runs from writing here inside this block; where there is no folder yet, from `begin` on.

        Raises  StoreError  where another run does
        """
        try:
            if self._is_there():
                self._acquire(self.path)
                self._open()  # another run may have gone on since it was opened
            yield
        finally:
            self._lock.release()

    def begin(self, batch: int) -> None:
        """Begin with batches of this size, where nothing is stored yet: make the store as a draft beside its
        folder and move it there, so that no half-made one is found. Raises StoreError where it has begun already,
        and OSError where it cannot be written or another run has just put its own there."""
        import zarr

        if self.batch is not None:
            raise StoreError(f"{self.path.name}: has been begun already")
        draft = self.path.with_name(f".{self.path.name[:40]}-{secrets.token_hex(4)}")
        try:
            group = zarr.open_group(str(draft), mode="w-", zarr_format=3)
            self._acquire(draft)
            self._create_arrays(group, min(batch, self.count))
            header: dict[str, Any] = {
                "zwidth": KIND,
                "version": STORE_VERSION,
                "question": self.question,
                "study": self._study,
                "release": __version__,
                "batch": batch,
                "descriptions": _descriptions(draft),
            }
            group.attrs.update(header | {DIGEST: _digest_of(header)})
            if self.path.is_dir():
                self.path.rmdir()  # empty
            draft.replace(self.path)  # fails where another run has just put its own
        except OSError:
            self._lock.release()
            if self._is_there():
                self._acquire(self.path)
            raise
        finally:
            shutil.rmtree(draft, ignore_errors=True)
        self._open()

    def done(self, time_limit: float | None = None) -> Flags:
        """Which batches are done, (batches,).

        time_limit  of this run [s]; None: none. Batches of which cells were given up after a shorter time are not
                    done; 0: all are done that are there
        """
        assert self.batch is not None
        found = np.zeros(-(-self.count // self.batch), dtype=bool)
        limit = UNLIMITED if time_limit is None else time_limit
        given_up = self._given_up_after()
        for first, cells in self.stored_batches():
            has_more_time = limit > given_up and bool((cells.status == OUT_OF_TIME).any())
            found[first // self.batch] = not has_more_time
        return found

    def limit_time(self, time_limit: float | None) -> None:
        """Write the time limit [s] of the run that goes on here into the store, see `done`; None: nothing is
        written."""
        import zarr

        if time_limit is not None and time_limit != self._given_up_after():
            attributes = zarr.open_group(str(self.path), mode="r+").attrs
            header = {**attributes, "time_limit_s": time_limit}
            attributes.update({"time_limit_s": time_limit, DIGEST: _digest_of(header)})

    def stored_batches(self) -> Iterator[tuple[int, CellValues]]:
        """First cell and values of each batch that is done."""
        assert self.batch is not None
        for first in range(0, self.count, self.batch):
            with suppress(Exception):  # a file that a crash or a disk has damaged: its batch is not done
                yield first, self.read_batch(first)

    def read_batch(self, first: int) -> CellValues:
        """The batch whose first cell has the number `first`. Raises StoreError where it is not there, or is
        damaged, and OSError where it cannot be read."""
        arrays = self._open_arrays()
        assert self.batch is not None
        assert self._notes is not None
        last = min(first + self.batch, self.count)
        try:
            values, status = (np.asarray(one[first:last]) for one in arrays)
            notes = self._notes.read(first, _digest_of_cells(values, status))
        except OSError:
            raise
        except Exception as error:  # zarr's own and those of its codecs, of many kinds
            raise StoreError(
                f"{self.path.name}: cells {first} to {last - 1} are missing or damaged; the same command computes "
                "them again"
            ) from error
        return CellValues(values, status, notes)

    def write_batch(self, first: int, cells: CellValues) -> None:
        """Write the batch whose first cell has the number `first`. Raises OSError where it cannot be written."""
        values, status = self._open_arrays()
        part = slice(first, first + len(cells.values))
        values[part] = cells.values
        assert self._notes is not None
        self._notes.write(first, cells.notes, _digest_of_cells(cells.values, cells.status))
        status[part] = cells.status

    def remove(self) -> None:
        """Remove the store from the disk, if it has been begun."""
        self._lock.release()
        if self.batch is not None:
            shutil.rmtree(self.path, ignore_errors=True)

    def _is_there(self) -> bool:
        """Whether there is something at the path but an empty folder."""
        return self.path.exists() and not (self.path.is_dir() and not any(self.path.iterdir()))

    def _acquire(self, folder: Path) -> None:
        """Lock the folder. Raises StoreError where another run holds the lock."""
        if not self._lock.acquire(folder):
            raise StoreError(
                f"{self.path.name}: {owner_of(folder)} is computing into it; wait until that has ended, or name "
                "another folder"
            )

    def _create_arrays(self, group: Any, batch: int) -> None:
        """Create the empty arrays of values and status, in chunks of `batch` cells with checksums."""
        from zarr.codecs import Crc32cCodec, ZstdCodec

        # the checksum stands last, over the bytes that lie on the disk
        codecs: dict[str, Any] = {"compressors": (ZstdCodec(), Crc32cCodec())}
        shape, chunks = (self.count, len(self.measures)), (batch, len(self.measures))
        attributes: dict[str, Any] = {"measures": list(self.measures)}
        group.create_array(
            "values",
            shape=shape,
            chunks=chunks,
            dtype="float64",
            fill_value=np.nan,
            attributes=attributes,
            **codecs,
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
            **codecs,
        )

    def _open_arrays(self) -> tuple[Any, Any]:
        """The zarr arrays of values and of status (count, measures) of a store that has been begun."""
        assert self._arrays is not None, "not begun"
        return self._arrays

    def _given_up_after(self) -> float:
        """The time limit of the last run that had one [s]; 0 where none had."""
        import zarr

        limit = zarr.open_group(str(self.path), mode="r").attrs.get("time_limit_s")
        return float(limit) if isinstance(limit, int | float) else 0.0

    def _open(self) -> None:
        """Open the folder. Raises StoreError where it is not the undamaged store of this question and release."""
        import zarr

        other = StoreError(f"{self.path.name}: is not the store of a study; name another folder, or remove it")
        try:
            group = zarr.open_group(str(self.path), mode="r+")
            attributes = dict(group.attrs)
        except PermissionError:
            raise
        except Exception:  # zarr's own, of many kinds
            raise other from None
        kind, version, batch = (attributes.get(key) for key in ("zwidth", "version", "batch"))
        if kind == KIND and (message := newer_version_message(version, STORE_VERSION)):
            raise StoreError(f"{self.path.name}: its version {message}, or name another folder")
        if kind != KIND:
            raise other
        damaged = StoreError(f"{self.path.name}: is damaged; remove it, or name another folder")
        if message := unchecked_version_message(version):
            raise StoreError(f"{self.path.name}: its version {message}; remove it, or name another folder")
        if attributes.get(DIGEST) != _digest_of(attributes) or not isinstance(batch, int):
            raise damaged
        if attributes.get("question") != self.question:
            raise error_of_kept_folder(self.path.name, whose_work(attributes, self._study))
        try:
            if attributes.get("descriptions") != _descriptions(self.path):
                raise damaged
            self._arrays = group["values"], group["status"]
            header = json.dumps({"version": STORE_VERSION, "question": self.question})
            self._notes = NotesFile(self.path / NOTES, header)
        except (KeyError, ValueError, FileNotFoundError):
            raise damaged from None
        self.batch = batch

    def _check_disk(self) -> None:
        """Raise StoreError where the cells of the job would not fit on the disk of the folder."""
        folder = next((p for p in (self.path, *self.path.absolute().parents) if p.exists()), Path())
        free, wanted = shutil.disk_usage(folder).free, float(PER_CELL) * self.count * len(self.measures)
        if wanted > free:
            raise StoreError(
                f"{self.path.name}: {self.count} cells of {len(self.measures)} measures would take "
                f"{wanted / 1e9:.3g} GB of disk, of {free / 1e9:.3g} GB that are free; ask for fewer, or name a "
                "folder on another disk"
            )


def _digest_of(attributes: Mapping[str, Any]) -> str:
    """SHA-256 of a store's attributes, all but the digest that is kept among them."""
    others = {name: value for name, value in attributes.items() if name != DIGEST}
    return hashlib.sha256(json.dumps(others, sort_keys=True).encode()).hexdigest()


def _descriptions(folder: Path) -> dict[str, str]:
    """Array's name -> digest of the file that describes it."""
    return {name: hashlib.sha256((folder / name / DESCRIPTION).read_bytes()).hexdigest() for name in ARRAYS}


def _digest_of_cells(values: Floats, status: NDArray[np.uint8]) -> int:
    """CRC-32 of a batch's values and status (cells, measures); of all nan alike, since zarr may give back another
    nan than was written."""
    plain = np.where(np.isnan(values), np.nan, values).astype("<f8")
    return zlib.crc32(np.asarray(status, dtype=np.uint8).tobytes(), zlib.crc32(plain.tobytes()))


def whose_work(attributes: Mapping[str, Any], study: str) -> str:
    """Whose finished work a folder keeps that is not of this question and release.

    attributes  that it is recognised by: "study" and "release"
    study       fingerprint of this question, the same in every release
    """
    release = str(attributes.get("release", "another release"))
    if release != __version__:
        what = "this study" if attributes.get("study") == study else "a study"
        return f"keeps {what} as computed by zwidth {release}, and this is {__version__}"
    return "keeps finished work of another study or other options"


@dataclass(frozen=True)
class StoredCells:
    """The cells of a job, all computed, in its store; they are read in pieces. See `job.Cells`."""

    store: Store

    def pieces(self) -> Iterator[tuple[int, CellValues]]:
        """First cell and values of each batch, in the order of the cells."""
        assert self.store.batch is not None
        for first in range(0, self.store.count, self.store.batch):
            yield first, self.store.read_batch(first)

    @cached_property
    def values(self) -> Floats:
        """All values (count, measures) in memory. Raises TooLarge."""
        self._check()
        return np.concatenate([cells.values for _, cells in self.pieces()])

    @cached_property
    def status(self) -> NDArray[np.uint8]:
        """All status (count, measures) in memory. Raises TooLarge."""
        self._check()
        return np.concatenate([cells.status for _, cells in self.pieces()])

    @cached_property
    def notes(self) -> Notes:
        """Why cells have no value, by measure; read in one pass, of which nothing else is kept."""
        summaries = [NoteSummary() for _ in self.store.measures]
        for _, cells in self.pieces():
            for summary, notes in zip(summaries, cells.notes, strict=True):
                summary.add(notes)
        return tuple(summary.notes() for summary in summaries)

    def in_memory(self) -> CellValues:
        """All cells in memory. Raises TooLarge."""
        return CellValues(self.values, self.status, self.notes)

    def _check(self) -> None:
        """Raise TooLarge where all cells would not fit into memory."""
        count, measures = self.store.count, len(self.store.measures)
        check_memory(
            2.0 * count * measures * PER_CELL / 8,
            f"{count} cells of {measures} measures",
            "read them from the store in pieces (Cells.pieces)",
        )


def store_for(job: Job, store: Store | str | os.PathLike[str]) -> Store:
    """A job's store: the one given, or one in the folder of that name. Raises what `Store` does."""
    return store if isinstance(store, Store) else Store(Path(store), job)


FILE: Final = "lock"


class FolderLock:
    """The lock of one folder, a file in it that the operating system locks.

    The file may stay behind: it is the process's hold on it that counts.
    """

    def __init__(self) -> None:
        self._file: int | None = None

    @property
    def held(self) -> bool:
        """Whether this object holds it."""
        return self._file is not None

    def acquire(self, folder: Path) -> bool:
        """Take the lock. True: this object holds it now; False: another does. Raises OSError where the file cannot
        be written."""
        if self._file is not None:
            return True
        file = os.open(folder / FILE, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not _lock_file(file):
                return False
            owner = json.dumps({"process": os.getpid(), "host": socket.gethostname()}).encode()
            os.ftruncate(file, 0)
            os.pwrite(file, owner, 0) if hasattr(os, "pwrite") else os.write(file, owner)
            self._file, file = file, -1  # kept open, as closing it would give up the lock
            return True
        finally:
            if file >= 0:
                os.close(file)

    def release(self) -> None:
        """Let others have it."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def __del__(self) -> None:
        self.release()


def owner_of(folder: Path) -> str:
    """The process that has last locked a folder, in words.

    >>> owner_of(Path("nowhere"))
    'another process'
    """
    with suppress(OSError, ValueError, KeyError, TypeError):
        owner = json.loads((folder / FILE).read_text())
        return f"process {int(owner['process'])} on {str(owner['host'])[:60]}"
    return "another process"


def _lock_file(file: int) -> bool:
    """Lock an open file, given by its descriptor. True: it is locked; False: another has locked it."""
    try:
        import fcntl
    except ImportError:  # Windows
        import msvcrt

        try:
            os.lseek(file, 1 << 20, os.SEEK_SET)  # beyond the text, which others may read
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        except OSError:
            return False
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


class NotesFile:
    """Why cells have no value, and the digest of the batch's numbers: a line for each batch, with a checksum. The
    first line holds the version and the fingerprint.

    A damaged line is passed over, and one cut short by a crash or a full disk written over: their batches have no
    notes, and are computed again. So no line need be forced to the disk before the next.

    header  first line
    Raises  OSError     where the file cannot be read or written
            ValueError  where it begins with another line
    """

    def __init__(self, path: Path, header: str) -> None:
        self.path = path
        self._places: dict[int, int] = {}  # first cell of a batch -> where its last line begins
        first = header.encode() + b"\n"
        if not path.exists() or not path.stat().st_size:
            path.write_bytes(first)
        with open(path, "rb") as file:
            if file.readline() != first:
                raise ValueError(f"{path.name} begins with another line")
            self._end = file.tell()  # behind the last whole line: where the next is written
            while (line := file.readline()).endswith(b"\n"):
                if (entry := read_checked_line(line)).get("name") is not None:
                    self._places[int(entry["name"])] = self._end
                self._end = file.tell()

    def write(self, first: int, notes: Notes, digest: int) -> None:
        """Write the notes of the batch whose first cell has the number `first`, and the digest of its numbers.
        Raises OSError."""
        value = [[[one.status, one.reason, one.count, list(one.first)] for one in notes_of] for notes_of in notes]
        line = checked_line({"name": str(first), "digest": digest, "value": value})
        with open(self.path, "r+b") as file:
            file.truncate(self._end)
            file.seek(self._end)
            file.write(line)
        self._places[first] = self._end
        self._end += len(line)

    def read(self, first: int, digest: int) -> Notes:
        """The notes of the batch whose first cell has the number `first`. Raises ValueError where none are
        written, and where they are those of other numbers.

        digest  of the batch's numbers (`_digest_of_cells`)
        """
        place = self._places.get(first)
        if place is None:
            raise ValueError(f"{self.path.name} has no line of the batch at {first}")
        with open(self.path, "rb") as file:
            file.seek(place)
            entry = read_checked_line(file.readline())
        if entry.get("digest") != digest:
            raise ValueError(f"{self.path.name} tells of other numbers in the batch at {first}")
        return tuple(
            tuple(Note(status, reason, count, tuple(cells)) for status, reason, count, cells in notes)
            for notes in entry["value"]
        )
