"""A lock on a folder that ends with the process that holds it, however that ends."""

from __future__ import annotations

import json
import os
import socket
from contextlib import suppress
from pathlib import Path
from typing import Final

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
        """Take the lock. Returns whether nobody else holds it. Raises OSError where the file cannot be written."""
        if self._file is not None:
            return True
        file = os.open(folder / FILE, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not _lock(file):
                return False
            owner = json.dumps({"process": os.getpid(), "host": socket.gethostname()}).encode()
            os.ftruncate(file, 0)
            os.pwrite(file, owner, 0) if hasattr(os, "pwrite") else os.write(file, owner)
            self._file, file = file, -1
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


def _lock(file: int) -> bool:
    """Lock an open file. Returns whether nobody else has."""
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
