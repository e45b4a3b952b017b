"""Typed decorators for kernels: numba compiles a kernel once, and its machine code is kept on disk.

Kernels work on plain arrays and scalars, never on Python objects, so that the same source can also be
compiled for other targets.

A kernel is compiled in one of two ways, by who calls it. Called by another kernel it is only translated:
optimising and emitting machine code are left to the kernel that Python calls, which does both once for all that it
holds. Numba by itself does both at every level of calls, which takes twice the time (the kernels of `zwidth move`:
84 s against 31 s of processor time). Called by Python it becomes machine code, which `machine_code` keeps on disk;
the interpreter's lock is released while it runs, so that `resources.in_chunks` can spread a loop over the cores.

With NUMBA_DISABLE_JIT=1 nothing is compiled: a kernel is then its Python function, for a debugger to step through.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any, Final, TypeVar, cast

import numba
import numpy as np
from numba.core import compiler, config, registry
from numba.core.codegen import JITCodeLibrary

from zwidth.compile_events import compiling
from zwidth.machine_code import MachineCode
from zwidth.tuple_references import TakesAddresses, check_returned_address

Function = TypeVar("Function", bound=Callable[..., Any])
# Division follows IEEE (1/0 is inf), so that a singular point is data and not an exception.
OPTIONS: Final[dict[str, Any]] = {"nopython": True, "error_model": "numpy"}
NO_REFERENCE_COUNTS: Final[dict[str, Any]] = {"_nrt": False}  # a flag of numba's that its stubs do not name
INLINED: Final[dict[str, Any]] = {**NO_REFERENCE_COUNTS, "forceinline": True}
APART: Final = "zwidth_apart"  # an option of ours: the kernel is never inlined
# First and last release of numba whose internal classes are known to work as they are used below. With any other
# release, kernels are compiled by plain `numba.jit`: the same results, a longer wait at first use.
TAKEN_APART: Final = ((0, 61), (0, 68))
HASH_OF_FLAGS: Final = hash(compiler.Flags())
COMPILING_THRESHOLDS: Final = (100_000, 1000, 1000)  # of Python's garbage collector, see gc.set_threshold
# Threads may call a kernel for the first time at once. With an entry for each the second would load the same
# machine code over that which the first already runs, and now and then the process would crash.
MAKING_ENTRY: Final = Lock()


def compiled(function: Function) -> Function:
    """Compile a scalar kernel to machine code on first use; later processes read it from disk."""
    return _kernel(function, {})


def compiled_lean(function: Function) -> Function:
    """Like `compiled`, for a small kernel that allocates nothing: it counts no references.

    A kernel handed a tuple of arrays otherwise counts each of them in and out of every call, with atomic
    instructions; around the algebra of a few bodies that is three quarters of the time. Without the counting
    such a kernel cannot allocate: numba refuses to compile it, it never computes something else.
    """
    return _kernel(function, NO_REFERENCE_COUNTS)


def compiled_inline(function: Function) -> Function:
    """Like `compiled_lean`, for the innermost steps of a hot loop: inlined into every kernel that calls them.

    By itself the compiler stops inlining them once the loop around them has grown, and the calls then cost as
    much as the algebra.
    """
    return _kernel(function, INLINED)


def compiled_apart(function: Function) -> Function:
    """Like `compiled_lean`, for a larger kernel that is called from several places: never inlined.

    Where its work outweighs a call, copies of it only take time to compile.
    """
    return _kernel(function, {**NO_REFERENCE_COUNTS, APART: True})


def compiled_for(signature: Any, function: Callable[..., Any]) -> Any:
    """Compile `function` for one signature now, for callers that use only its address.

    signature  a numba signature, such as float64(float64, float64)
    Returns    numba's dispatcher; keep it as long as its address is in use. With NUMBA_DISABLE_JIT the function
    Raises     numba.core.errors.NumbaError where numba cannot compile it
    """
    if config.DISABLE_JIT:
        return function
    if not can_be_taken_apart():
        return numba.njit(signature, error_model="numpy")(function)
    entry = _Entry(function, OPTIONS)
    entry.compile(signature)
    return entry


def linked_module(kernel: Any, signature: Any) -> tuple[str, str]:
    """A kernel with all that it calls in LLVM's language, not optimised yet, for compiling it to another target.

    kernel     as the decorators here return it;   signature  a numba signature, or a tuple of types
    Returns    text of the module, and the name of the kernel's function in it
    Raises     RuntimeError  with a release of numba whose internal classes are not known
    """
    if not can_be_taken_apart():
        raise RuntimeError(f"modules are taken out of numba {TAKEN_APART[0]} to {TAKEN_APART[1]} only")
    kernel.compile(signature)
    (result,) = kernel.overloads.values()
    return str(result.library._final_module), str(result.fndesc.llvm_func_name)


def can_be_taken_apart() -> bool:
    """Whether the installed numba is a release whose internal classes are known (`TAKEN_APART`)."""
    oldest, newest = TAKEN_APART
    return oldest <= tuple(numba.version_info.short) <= newest


def _kernel(function: Function, options: dict[str, Any]) -> Function:
    """The function as a compiled kernel; itself where NUMBA_DISABLE_JIT is set.

    options  of numba's compilation, beyond `OPTIONS`; with APART: never inlined
    """
    if config.DISABLE_JIT:
        # 1/0 is inf in kernels, as of NumPy's numbers; Python's raise, and so would the parts of a Python complex:
        # the function, run as Python, finds NumPy's under this name
        function.__globals__.setdefault("complex", np.complex128)
        return function
    options = {**OPTIONS, **options}
    apart = bool(options.pop(APART, False))
    if not can_be_taken_apart():
        return cast(Function, numba.jit(cache=True, nogil=True, **options)(function))
    return cast(Function, _Kernel(function, options, apart))


class _PartLibrary(JITCodeLibrary):
    """Translated code of a kernel that other kernels call: simplified function by function, neither optimised as a
    whole nor loaded."""

    class _Unloaded:
        def set_env(self, name: str, environment: Any) -> None:
            """Do nothing: kernels have no constants that Python would fetch, and no code is loaded to hold
            them."""

    @property
    def codegen(self) -> Any:
        """Stands in for the code generator where numba registers loaded code; nothing is loaded."""
        return self._Unloaded()

    def _optimize_final_module(self) -> None:
        """Do nothing: optimising is left to the kernel that Python calls."""

    def _finalize_final_module(self) -> None:
        """Check the module and call it final; numba would also load it here."""
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """No address: the code is not loaded."""
        self._ensure_finalized()
        return 0


class _ApartLibrary(_PartLibrary):
    """The same of a kernel that is never inlined."""

    def add_ir_module(self, ir_module: Any) -> None:
        """Mark the module's own functions before numba adds it."""
        for function in ir_module.functions:
            if not function.is_declaration:
                function.attributes.add("noinline")
        super().add_ir_module(ir_module)


class _EntryLibrary(JITCodeLibrary):
    """Machine code of a kernel that Python calls, with all that it calls in turn, optimised once."""

    def _optimize_final_module(self) -> None:
        """Optimise once, where numba optimises twice; with the pass that computes several turns of a loop at once,
        from which samples of a curve gain, but without the one that looks for vectors in straight code."""
        manager = self._codegen._module_pass_manager(loop_vectorize=True, slp_vectorize=False)
        passes, *builder = manager if isinstance(manager, tuple) else (manager,)  # numba 0.61 has no builder
        passes.run(self._final_module, *builder)


class _Flags(compiler.Flags):
    """Numba's flags of a compilation, which are quickly compared.

    Numba looks up every operator of a kernel in tables that have the flags in their keys, and at each of a hundred
    thousand looks compares all forty, one after the other. Here flags are equal where the same options are set to
    the same values. Numba's hash is that of the options' names, the same for all flags.
    """

    def __hash__(self) -> int:
        return HASH_OF_FLAGS

    def __eq__(self, other: object) -> bool:
        if isinstance(other, _Flags):
            return bool(self._values == other._values)
        return bool(super().__eq__(other))


class _PartCompiler(compiler.CompilerBase):
    """Numba's pipeline, with the library of a kernel that other kernels call."""

    library: type[JITCodeLibrary] = _PartLibrary

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.flags = _Flags(self.state.flags)

    def define_pipelines(self) -> list[Any]:
        """Numba's passes for code without Python objects, which fill the library of this class."""
        self.state.library = self.library(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return [compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)]


class _ApartCompiler(_PartCompiler):
    """The same pipeline, with the library of a kernel that is never inlined."""

    library = _ApartLibrary


class _EntryCompiler(_PartCompiler):
    """The same pipeline, with the library of a kernel that Python calls."""

    library = _EntryLibrary


class _Entry(registry.CPUDispatcher):
    """A kernel as Python calls it.

    kernel  the same as other kernels call it, to which calls from Python go first; None: there is none
    """

    def __init__(
        self, function: Callable[..., Any], options: dict[str, Any], kernel: _Kernel | None = None
    ) -> None:
        entry_options = {name: value for name, value in options.items() if name != "forceinline"}
        entry_options |= {"no_cfunc_wrapper": True, "nogil": True}
        super().__init__(function, targetoptions=entry_options, pipeline_class=_EntryCompiler)
        self._cache = MachineCode(function, entry_options)
        self._compiler: Any = _AnnouncedCompiler(self._compiler, f"{function.__module__}.{function.__qualname__}")
        self._kernel = kernel

    def add_overload(self, result: Any) -> None:
        """Register new machine code here, and at `kernel`, which then calls it without asking again."""
        super().add_overload(result)
        if self._kernel is not None:
            self._kernel._insert([kind._code for kind in result.signature.args], result.entry_point, False)


class _AnnouncedCompiler:
    """Numba's compiler, which also reports what it compiles to `compile_events`."""

    def __init__(self, inner: Any, name: str) -> None:
        self._inner, self._name = inner, name

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def compile(self, *arguments: Any) -> Any:
        with compiling(self._name), rare_garbage_collection():
            return self._inner.compile(*arguments)


@contextmanager
def rare_garbage_collection() -> Iterator[None]:
    """Run Python's garbage collector rarely during a compilation, which makes millions of objects that live until
    its end: checking all of them again and again takes a tenth of the time."""
    thresholds = gc.get_threshold()
    gc.set_threshold(*COMPILING_THRESHOLDS)
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)


class _Kernel(TakesAddresses, registry.CPUDispatcher):
    """A kernel as other kernels call it; a call from Python goes to its `_Entry`.

    apart  whether it is never inlined
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any], apart: bool) -> None:
        part_options = {**options, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        compiler_class = _ApartCompiler if apart else _PartCompiler
        super().__init__(function, targetoptions=part_options, pipeline_class=compiler_class)
        self.kernel_options, self.apart = options, apart
        self._entry: _Entry | None = None

    @property
    def signatures(self) -> list[Any]:
        """Types of arguments that Python has called it with."""
        return [] if self._entry is None else list(self._entry.overloads)

    def add_overload(self, result: Any) -> None:
        """Keep a translation for other kernels, after a check that it returns no address of its own variables."""
        check_returned_address(self.py_func.__qualname__, result.signature.return_type)
        # not given to numba's own table of what Python may call: there is nothing to call
        self.overloads[tuple(result.signature.args)] = result

    def _compile_for_args(self, *arguments: Any, **keywords: Any) -> Any:
        """Called by numba for a call from Python with types of arguments that it has not seen."""
        with MAKING_ENTRY:
            if self._entry is None:
                self._entry = _Entry(self.py_func, self.kernel_options, self)
        return self._entry._compile_for_args(*arguments, **keywords)
