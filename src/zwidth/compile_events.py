"""Report the compilation of kernels to listeners; without importing numba, which takes long."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

Listener = Callable[[str, bool], None]
_listeners: list[Listener] = []


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Report to `listener` each compilation of a kernel that Python calls, while the `with` block runs.

    listener  called with the kernel's full name and False when its compilation begins, and with True when it has
              ended; kernels read from disk are not reported
    """
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


@contextmanager
def compiling(name: str) -> Iterator[None]:
    """Report to the listeners when the compilation of the kernel `name` begins and ends; without any, warn
    once."""
    if not _listeners and name.startswith("zwidth."):
        _log_first_use()
    for listener in _listeners:
        listener(name, False)
    yield
    for listener in _listeners:
        listener(name, True)


@cache
def _log_first_use() -> None:
    """Warn that kernels are being compiled; only the first call does, as the cache answers the others."""
    logging.getLogger("zwidth").warning(
        "zwidth: first use: compiling kernels for this processor, which takes up to a minute in all; "
        "the command `zwidth compile` does it beforehand"
    )
