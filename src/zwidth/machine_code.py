"""Where compiled kernels are kept: one file for each kernel and types of arguments.

Numba's own cache notices neither an edit in a function that a kernel calls nor a changed constant, and names the
host's processor in every key. Here a file is named by a digest of all that its machine code depends on: the
kernel's instructions and constants, those of all that it calls, the types of its arguments, numba's release,
Python's, and the processor. An edit anywhere else leaves it valid.

Kernels are read from where they were written on this machine, else from the folder that a wheel brings along,
whose kernels are compiled for any processor of the platform ("generic"). Numba's settings stay as they are: other
packages' kernels in the same process are compiled for the host.
"""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from types import CodeType, FunctionType, ModuleType
from typing import Any, Final

import numba
import numpy as np
from llvmlite.binding import get_host_cpu_features, get_host_cpu_name
from numba.core import config
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps
from numba.misc.appdirs import AppDirs

FORMAT: Final = 2  # version of the files; to be increased when their content or their naming changes
PACKAGE: Final = Path(__file__).parent
SHIPPED: Final = PACKAGE / "kernels"  # folder of a wheel's kernels; a clone has none
GENERIC: Final = ("generic", "")  # the processor that a wheel's kernels are compiled for, and its features
ENDING: Final = f".py{sys.version_info[0]}{sys.version_info[1]}.nbc"


class MachineCode(_Cache):
    """The machine code of one kernel on disk; takes the place of numba's `FunctionCache`."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self._function, self._options = function, options
        self._source: str | None = None

    @property
    def cache_path(self) -> str:
        """The folder that new machine code is written to."""
        return str(written_folder() or "")

    def load_overload(self, signature: Any, target: Any) -> CompileResult | None:
        """The kernel for one signature, ready to be called; None where it must be compiled.

        target  numba's context
        """
        target.refresh()
        triple, name, features = target.codegen().magic_tuple()
        # each folder, and the processor that its kernels are compiled for
        places = [(written_folder(), (name, features)), (SHIPPED, GENERIC)]
        for folder, processor in places:
            if folder is not None:
                # a file that was cut short, or written by somebody else, is compiled anew
                with suppress(OSError, EOFError, pickle.UnpicklingError, AttributeError, ImportError, ValueError):
                    data = (folder / self._file(signature, triple, processor)).read_bytes()
                    return _restored(target, pickle.loads(data))
        return None

    def save_overload(self, signature: Any, result: CompileResult) -> None:
        """Write a compiled kernel to disk; where no folder may be written to, it serves this process only."""
        folder = written_folder()
        # dynamic globals are addresses of this process, as of objects that the code holds
        if folder is None or result.library.has_dynamic_globals:
            return
        if not Path(self._function.__code__.co_filename).is_file():  # typed at a prompt: no other process has it
            return
        triple, *processor = result.codegen.magic_tuple()
        with suppress(OSError):
            _write(folder / self._file(signature, triple, tuple(processor)), dumps(_reduced(result)))

    def enable(self) -> None:
        """Numba's interface; always enabled."""

    def disable(self) -> None:
        """Numba's interface; always enabled."""

    def flush(self) -> None:
        """Numba's interface; a file is never out of date."""

    def _file(self, signature: Any, triple: str, processor: tuple[str, ...]) -> str:
        """Name of the file: the kernel's name, a digest of argument types and processor, and one of its source."""
        if self._source is None:
            options = sorted(self._options.items())
            self._source = _digest(FORMAT, numba.__version__, options, *_source_lines(self._function))
        kinds = signature if isinstance(signature, tuple) else signature.args
        use = _digest(triple, processor, *(_type_text(kind) for kind in kinds))
        module = (self._function.__module__ or "").removeprefix("zwidth.")
        name = f"{module}.{self._function.__name__}"
        return f"{name}-{use[:12]}-{_digest(self._source, use)[:16]}{ENDING}"


@cache
def written_folder() -> Path | None:
    """Where compiled kernels are written: NUMBA_CACHE_DIR if that is set, else beside the sources, else the user's
    cache folder; None where none of them may be written to."""
    user = Path(AppDirs("zwidth", appauthor=False).user_cache_dir)
    places = [Path(config.CACHE_DIR) / "zwidth"] if config.CACHE_DIR else [PACKAGE / "__pycache__", user]
    for place in places:
        folder = place / "kernels"
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
    return None


def kept_kernels() -> set[str]:
    """Full names of the kernels that have machine code on disk for this Python, even of older sources."""
    folders = [folder for folder in (written_folder(), SHIPPED) if folder is not None and folder.is_dir()]
    return {f"zwidth.{file.name.split('-')[0]}" for folder in folders for file in folder.glob(f"*{ENDING}")}


def all_kernels_kept() -> bool:
    """Whether `note_all_kernels` was called for these sources, this processor and this Python, and every file that
    lay there then lies there still.

    Running what wants all kernels finds out as well, and takes a quarter of a minute for it.
    """
    note = _note_file()
    with suppress(OSError, ValueError):
        if note is not None:
            kept = dict(_kept_files())
            return all(kept.get(name) == size for name, size in json.loads(note.read_text(encoding="utf-8")))
    return False


def note_all_kernels() -> None:
    """Note beside the kernels that there is none left to compile for these sources."""
    note = _note_file()
    if note is not None:
        with suppress(OSError):
            _write(note, json.dumps(_kept_files()).encode())


def _note_file() -> Path | None:
    """Where it is noted that all kernels are kept: named by a digest of everything that any of them depends on."""
    folder = written_folder()
    if folder is None:
        return None
    digest = hashlib.sha256(repr((FORMAT, sys.version, numba.__version__, *_processor())).encode())
    for file in sorted(PACKAGE.rglob("*.py")):
        digest.update(str(file.relative_to(PACKAGE)).encode())
        digest.update(file.read_bytes())
    return folder / f"all-{digest.hexdigest()[:16]}.json"


def _processor() -> tuple[str, str]:
    """Name and features of the processor that kernels are compiled for here."""
    name, features = config.CPU_NAME, config.CPU_FEATURES
    return name or get_host_cpu_name(), get_host_cpu_features().flatten() if features is None else features


def _kept_files() -> list[tuple[str, int]]:
    """Name and size of each file with machine code for this Python, by name; one that was cut short is smaller."""
    folders = [folder for folder in (written_folder(), SHIPPED) if folder is not None and folder.is_dir()]
    return sorted((file.name, file.stat().st_size) for folder in folders for file in folder.glob(f"*{ENDING}"))


def _write(file: Path, data: bytes) -> None:
    """Write a file whole or not at all: several processes may compile the same kernel at once.

    In the folder beside the sources, the kernel's files of older sources are removed; other folders serve several
    versions of zwidth.
    """
    with NamedTemporaryFile(dir=file.parent, delete=False) as temporary:
        temporary.write(data)
    Path(temporary.name).replace(file)
    if PACKAGE in file.parents and file.name.endswith(ENDING):
        use = file.name.removesuffix(ENDING).rpartition("-")[0]
        for older in file.parent.glob(f"{use}-*{ENDING}"):
            if older.name != file.name:
                older.unlink(missing_ok=True)


def _reduced(result: CompileResult) -> tuple[Any, ...]:
    """The parts of a compiled kernel from which `_restored` makes it again: name of the library, machine code,
    names that it defines, numba's description, environment and signature.

    Its intermediate code is left out: no kernel is inlined into another from disk.
    """
    result.fndesc.typemap = result.fndesc.calltypes = None  # large, and not used any more
    library = result.library
    module = library._final_module
    names = [
        item.name
        for group in (module.functions, module.global_variables)
        for item in group
        if not item.is_declaration
    ]
    return library.name, library._get_compiled_object(), names, result.fndesc, result.environment, result.signature


def _restored(target: Any, parts: tuple[Any, ...]) -> CompileResult:
    """The compiled kernel of the parts by `_reduced`, as returned by numba's compiler; target  numba's context."""
    name, machine_code, names, description, environment, signature = parts
    codegen = target.codegen()
    library = codegen.create_library(name)
    library.enable_object_caching()
    library._set_compiled_object(machine_code)
    library._finalize_final_module()
    # as after compiling: numba then takes these names for defined
    codegen._engine._defined_symbols.update(names)
    return CompileResult(
        target_context=target,
        typing_context=target.typing_context,
        library=library,
        environment=environment,
        entry_point=target.get_executable(library, description, environment),
        fndesc=description,
        type_annotation=None,
        signature=signature,
        objectmode=False,
        lifted=(),
        typing_error=None,
        call_helper=None,
        metadata=None,
        reload_init=(),
        referenced_envs=(),
    )


def _digest(*parts: Any) -> str:
    """SHA-256 of the parts' texts, in hexadecimal."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _type_text(kind: Any) -> str:
    """A numba type in full; numba's own name of a named tuple does not hold the names of its fields."""
    if hasattr(kind, "instance_class") and hasattr(kind, "fields"):  # a named tuple
        inner = ", ".join(map(_type_text, kind.types))
        return f"{kind.instance_class.__qualname__}{kind.fields}({inner})"
    return str(kind)


def _source_lines(function: Callable[..., Any]) -> list[str]:
    """Lines that state all that the machine code of a function depends on: its instructions and constants, and
    those of the functions that it calls."""
    visited: dict[int, None] = {}
    lines: list[str] = []
    todo: list[Any] = [function]
    while todo:
        item = todo.pop()
        if id(item) in visited:
            continue
        visited[id(item)] = None
        if isinstance(item, Dispatcher):
            lines.append(f"options {sorted(item.targetoptions.items())}")
            item = item.py_func
        if isinstance(item, FunctionType):
            lines.append(f"{item.__module__}.{item.__qualname__} {item.__defaults__}")
            lines += _instructions(item.__code__, item.__doc__)
            for name, value in _references(item):
                if isinstance(value, Dispatcher | FunctionType):
                    todo.append(value)
                else:
                    lines.append(f"{name} = {_constant(value)}")
    return lines


def _instructions(code: CodeType, text: str | None = None) -> Iterator[str]:
    """Instructions, names and constants of a function's code, without its docstring (`text`) and line numbers."""
    constants = [c for c in code.co_consts if not isinstance(c, CodeType) and not (text is not None and c == text)]
    yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {code.co_freevars} {constants!r}"
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _instructions(constant)


def _references(function: FunctionType) -> Iterator[tuple[str, Any]]:
    """Name and value of everything outside itself that a function uses: global names, variables of its closure,
    and attributes of zwidth's modules."""
    names = {name for code in _codes(function.__code__) for name in code.co_names}
    for name in sorted(names):
        if name in function.__globals__:
            value = function.__globals__[name]
            yield name, value
            if isinstance(value, ModuleType) and value.__name__.startswith("zwidth"):
                yield from (
                    (f"{name}.{inner}", vars(value)[inner]) for inner in sorted(names) if inner in vars(value)
                )
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield name, cell.cell_contents


def _codes(code: CodeType) -> Iterator[CodeType]:
    """The code, and that of the functions defined in it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


def _constant(value: Any) -> str:
    """A text for a value that a kernel uses, the same in every process."""
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, type):
        return f"{value.__module__}.{value.__qualname__} {getattr(value, '_fields', '')}"
    if isinstance(value, ModuleType):
        return value.__name__
    if isinstance(value, bool | int | float | complex | str | tuple | np.generic | type(None)):
        return repr(value)
    return f"{type(value).__qualname__} {getattr(value, '__qualname__', getattr(value, '__name__', ''))}"
