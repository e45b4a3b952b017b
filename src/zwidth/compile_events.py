"""Listeners to the compilation of kernels; free of numba, so that importing costs nothing."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

Listener = Callable[[str, bool], None]
_listeners: list[Listener] = []


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Have the compilations of kernels that Python calls told to `listener`.

    listener  called with the kernel's full name and False when its compilation begins, and with True when it has
              ended; kernels found on disk are not told
    """
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


@contextmanager
def compiling(name: str) -> Iterator[None]:
    """Around the compilation of a kernel. Where nobody listens, a script or a notebook, the log says so once."""
    if not _listeners and name.startswith("zwidth."):
        _log_first_use()
    for listener in _listeners:
        listener(name, False)
    yield
    for listener in _listeners:
        listener(name, True)


@cache
def _log_first_use() -> None:
    logging.getLogger("zwidth").warning(
        "zwidth: first use: compiling kernels for this processor, which takes up to a minute in all; "
        "the command `zwidth compile` does it beforehand"
    )
