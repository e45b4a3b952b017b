"""Which functions of the package a process executes, compiled kernels included, and which files of the project
it reads.

Python calls a trace function once per call of a Python function, which is enough here: lines are not followed.
What runs as machine code is not seen by it; a kernel counts as executed where a function that runs names it, by
itself, in a module or in a table, and so do the kernels that it names in turn. The function of a virtual
environment, which is compiled as it stands and reached by its address, counts where the environment's parameters
are asked for, which everyone does who uses it.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from inspect import CO_OPTIMIZED
from pathlib import Path
from types import CodeType, FrameType, ModuleType
from typing import Any, Final

ROOT: Final = Path(__file__).parents[2]
PACKAGE: Final = "src/zwidth/"
# Folders whose files a test may read: devices, pages and pictures of the package, documents, examples, its own
# helpers.
WATCHED: Final = ("src/", "docs/", "gallery/", "benchmarks/", "tests/", "tools/")

# Methods of objects that hold a function to be compiled, in `function`.
OF_HOLDERS: Final = frozenset({"Environment.values"})

Place = tuple[CodeType, dict[str, Any]]  # a function's code, and the names that it can see


def project_path(name: str) -> str | None:
    """A file's path from the project's root; None outside it, and where no test depends on it."""
    path = os.path.abspath(name)
    if not path.startswith(f"{ROOT}{os.sep}"):
        return None
    inside = os.path.relpath(path, ROOT).replace(os.sep, "/")
    return inside if inside.startswith(WATCHED) and "__pycache__" not in inside else None


class ExecutionRecord:
    """Records what runs, into one set of functions at a time: of a test, of a fixture, of a process."""

    def __init__(self) -> None:
        self._seen: set[int] = set()
        self._places: dict[int, Place] = {}  # by the address of the code, which is kept alive here
        self._codes: list[CodeType] = []  # of other packages, kept so that no address is used twice
        self.read_files: set[str] = set()

    def start(self) -> None:
        """Record this thread and all that are started from now on."""
        sys.addaudithook(self._audit)
        threading.settrace(self._called)
        sys.settrace(self._called)

    def swap(self, seen: set[int]) -> set[int]:
        """Record into `seen` from now on; returns the set that was recorded into before."""
        before, self._seen = self._seen, seen
        return before

    def functions(self, seen: set[int]) -> set[str]:
        """The functions of a set as "src/zwidth/chart/area.py:name", with the kernels that they name."""
        found: set[str] = set()
        seen = seen.copy()  # what runs here is recorded, too
        waiting = [self._places[code] for code in seen if code in self._places]
        done = {id(code) for code, _ in waiting}
        while waiting:
            code, names = waiting.pop()
            path = project_path(code.co_filename)
            # a module and a class body run when they are imported, which covers nothing of them
            if path is not None and code.co_flags & CO_OPTIMIZED:
                found.add(f"{path}:{code.co_qualname}")
            for kernel in _kernels_named_by(code, names):
                if id(kernel.__code__) not in done:
                    done.add(id(kernel.__code__))
                    waiting.append((kernel.__code__, kernel.__globals__))
        return found

    def helper_modules(self) -> set[str]:
        """Modules of tests, documents, examples and benchmarks that this process has imported."""
        files = [getattr(module, "__file__", None) for module in list(sys.modules.values())]
        paths = {project_path(file) for file in files if isinstance(file, str)}
        return {path for path in paths if path is not None and not path.startswith(PACKAGE)}

    def _called(self, frame: FrameType, event: str, argument: object) -> None:
        """Python's trace function."""
        code = frame.f_code
        key = id(code)
        if code.co_qualname in OF_HOLDERS:
            self._held(frame)
        if key in self._seen:
            return
        self._seen.add(key)
        if key in self._places:
            return
        if f"/{PACKAGE}" in code.co_filename:
            self._places[key] = (code, frame.f_globals)
        else:
            self._codes.append(code)

    def _held(self, frame: FrameType) -> None:
        """Note the function that the object of a method holds."""
        function = getattr(frame.f_locals.get("self"), "function", None)
        code = getattr(function, "__code__", None)
        if code is not None and f"/{PACKAGE}" in code.co_filename:
            self._seen.add(id(code))
            self._places[id(code)] = (code, function.__globals__)

    def _audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Python's audit hook: note the files of the project that are opened, other than Python's own."""
        if event == "open" and isinstance(arguments[0], str | os.PathLike):
            path = project_path(os.fspath(arguments[0]))  # type: ignore[arg-type]
            if path is not None and not path.endswith((".py", ".pyc", ".nbc")):
                self.read_files.add(path)


def _kernels_named_by(code: CodeType, names: dict[str, Any]) -> Iterator[Any]:
    """Python functions of the kernels that a function, or one inside it, names: by itself, or in a module."""
    codes = [code]
    while codes:
        one = codes.pop()
        codes += [constant for constant in one.co_consts if isinstance(constant, CodeType)]
        for name in one.co_names:
            # a module is named by itself where a function imports from it
            value = names.get(name, sys.modules.get(name))
            values = [vars(value).get(other) for other in one.co_names] if _is_own(value) else [value]
            yield from (kernel.py_func for kernel in _entries(values) if _is_kernel(kernel))


def _entries(values: list[Any]) -> Iterator[Any]:
    """Values, and those of tables among them."""
    for value in values:
        if type(value) is dict:
            yield from value.values()
        elif type(value) in (tuple, list):
            yield from value
        else:
            yield value


def _is_kernel(value: object) -> bool:
    return callable(getattr(value, "py_func", None)) and not isinstance(value, ModuleType)


def _is_own(value: object) -> bool:
    return isinstance(value, ModuleType) and value.__name__.startswith("zwidth")
