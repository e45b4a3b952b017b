"""Modules whose import is a computation: they run when a test first asks them for something."""

from __future__ import annotations

from importlib import import_module


class LazyModule:
    """The module of that name, imported at the first use of one of its public names.

    Collecting the tests imports every test module in every worker process; a script of the gallery that a test
    module imports the usual way is computed there again each time, whichever tests then run.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> object:
        # whoever collects the tests asks for marks of his own, whose names begin so
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(import_module(self._name), name)
