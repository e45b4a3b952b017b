"""The numbers of many loops' charts on a GPU, by the kernels of `chart_batch`: a thread takes one loop after the
other.

Each thread has its own `EdgeMemory`, a row of arrays that are allocated for all threads together. It takes 0.6 MB,
so that the GPU's memory limits the number of threads, and not the number of loops.

Kernels on a GPU: the Python functions behind the decorators of `compiled`, compiled for CUDA by numba-cuda.

A kernel becomes a function of the GPU together with all that it calls, each from its one source: what is computed
is written once. As on the processor, small steps are inlined, larger kernels are not, and tuples of arrays are
handed over as one address (`tuple_references`). With everything inlined the compiler takes ten times as long.

In numba's simulator (NUMBA_ENABLE_CUDASIM=1) the same functions run as Python.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from types import CodeType, FunctionType, ModuleType
from typing import Any, Final, get_type_hints

import numpy as np
from numba import cuda
from numba.core import config
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaPerformanceWarning

from zwidth.chart.chart_batch import ChartNumbers, empty_numbers, fill_numbers
from zwidth.chart.edge_memory import MOST_SAMPLES, EdgeMemory, edge_memory
from zwidth.chart.wall_samples import MOST_DEGREE
from zwidth.loop.loop_table import COMPUTER, LoopTable
from zwidth.tuple_references import TakesAddresses

BLOCK: Final = 64  # threads of a block
# The kernel takes 255 registers, of which a multiprocessor has enough for so many threads.
THREADS_OF_MULTIPROCESSOR: Final = 256
SHARE_OF_MEMORY: Final = 0.5  # of the GPU's free memory
# What all threads read, and none writes.
SHARED: Final = ("memory.area.rule", "memory.search.least", "memory.search.sizes")


def numbers_on_gpu(loops: LoopTable, what: int) -> ChartNumbers:
    """`chart_batch.chart_numbers` on |z| = 1, on a GPU, which `resources.check_processor` has found."""
    N = len(loops.rows)
    out = empty_numbers(N)
    if N == 0:
        return out
    like = edge_memory(loops, MOST_DEGREE, MOST_SAMPLES)
    threads = min(N, most_threads(_bytes(like)))
    block = min(threads, BLOCK)
    blocks = -(-threads // block)
    given = LoopTable(*(cuda.to_device(np.ascontiguousarray(array)) for array in loops))
    there: Any = ChartNumbers(*map(cuda.to_device, out))
    memory = memory_of_threads(like, blocks * block)
    with rounding_each_step(), warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaPerformanceWarning)  # of few blocks, where there are few loops
        kernel_of_gpu()[blocks, block](given, memory, what, 1.0, there)
    return ChartNumbers(*(array.copy_to_host() for array in there))


def most_threads(bytes_each: int) -> int:
    """Number of threads for which this GPU has registers, and working memory of so many bytes; at least one."""
    if SIMULATED:
        return BLOCK
    context = cuda.current_context()
    context.deallocations.clear()  # numba gives memory back late
    for_memory = int(SHARE_OF_MEMORY * context.get_memory_info().free) // bytes_each
    for_registers = int(context.device.MULTIPROCESSOR_COUNT) * THREADS_OF_MULTIPROCESSOR
    return max(1, min(for_memory, for_registers))


def memory_of_threads(like: EdgeMemory, threads: int, place_for: Any = cuda) -> EdgeMemory:
    """Arrays with an axis of threads before those of one memory; those of SHARED have none.

    place_for  has the functions `to_device` and `device_array`, as numba.cuda does for the GPU
    """

    def there(part: Any, place: str) -> Any:
        """The array, or tuple of arrays, `part` on the GPU; place: its name there, "memory.arcs.kind" for one."""
        if isinstance(part, tuple):
            kind: Any = type(part)
            return kind(*(there(one, f"{place}.{name}") for name, one in zip(kind._fields, part, strict=True)))
        if place in SHARED:
            return place_for.to_device(part)
        return place_for.device_array((threads, *part.shape), part.dtype)

    memory: EdgeMemory = there(like, "memory")
    return memory


@cache
def kernel_of_gpu() -> Any:
    """The GPU's kernel `fill_all`, compiled when first launched, which takes about a minute in each process."""
    numbers, own = function_of_gpu(fill_numbers), cuda.jit(_memory_of_thread(), device=True)

    def fill_all(loops: Any, memory: Any, what: int, radius: float, out: Any) -> None:
        """Numbers of all loops, each thread those that are as many apart as there are threads."""
        thread = cuda.grid(1)
        mine = own(memory, thread)
        mine.circle.sizes[COMPUTER] = -1
        for i in range(thread, len(out.status), cuda.gridsize(1)):
            numbers(loops, i, mine, what, radius, out)

    # what is run is then what can be compiled without a GPU, and it is compiled once, not for two kinds of output
    return cuda.jit(fill_all) if SIMULATED else cuda.jit(fill_all, lto=False)


def _memory_of_thread() -> Callable[[Any, int], Any]:
    """A function that takes one thread's rows of the arrays of all: `EdgeMemory(..., memory.lanes[thread], ...)`.

    It is written out from the fields of the memory, since numba has no loop over the parts of a tuple that are of
    several types.
    """
    known: dict[str, Any] = {}
    exec(f"def own(memory, thread):\n    return {_text_of_rows(EdgeMemory, 'memory', known)}", known)
    own: Callable[[Any, int], Any] = known["own"]
    return own


def _text_of_rows(kind: type, place: str, known: dict[str, Any]) -> str:
    """Python text that makes a tuple of this kind of one thread's rows of the arrays in the variable `place`.

    known  gets the kinds of tuples that the text names
    """
    known[kind.__name__] = kind
    parts = []
    for name, inner in get_type_hints(kind).items():
        field = f"{place}.{name}"
        if hasattr(inner, "_fields"):
            parts.append(_text_of_rows(inner, field, known))
        else:
            parts.append(field if field in SHARED else f"{field}[thread]")
    return f"{kind.__name__}({', '.join(parts)})"


def _bytes(part: Any) -> int:
    """Bytes of all arrays in a tuple."""
    return sum(map(_bytes, part)) if isinstance(part, tuple) else int(part.nbytes)


SIMULATED: Final = bool(config.ENABLE_CUDASIM)


@cache
def function_of_gpu(kernel: Any) -> Any:
    """A kernel as a function that kernels of the GPU can call.

    kernel  as the decorators of `compiled` return it; it must not call itself
    """
    function = kernel.py_func
    # its global names, each with the value that the GPU has for it
    known = {"__name__": function.__module__, "__builtins__": __builtins__}
    for name in {name for code in _codes(function.__code__) for name in code.co_names}:
        if name in function.__globals__:
            known[name] = _of_gpu(function.__globals__[name])
    copy = FunctionType(function.__code__, known, function.__name__, function.__defaults__, function.__closure__)
    if SIMULATED:
        known["complex"] = _complex
        return cuda.jit(copy, device=True)
    inlined = bool(kernel.targetoptions.get("forceinline"))
    made = _class_of_device_functions()(copy, {"device": True, "opt": True, "forceinline": inlined})
    made.apart = bool(getattr(kernel, "apart", False))
    return made


def _of_gpu(value: Any) -> Any:
    """The GPU's stand-in for the value of a kernel's global name: a function for a kernel, NumPy's for NumPy."""
    if isinstance(value, Dispatcher):
        return function_of_gpu(value)
    return _numpy_of_gpu() if value is np and not SIMULATED else value


@contextmanager
def rounding_each_step() -> Iterator[None]:
    """Have what is compiled in this block round every product and every sum by itself, as the processor does.

    Left alone, NVIDIA's compiler joins them to one step with one rounding, which numba-cuda has no option against;
    where rounding decides, a chart might then be another one. So only sines, tangents, arcs and roots may end in
    other digits.
    """
    if SIMULATED:
        yield
        return
    from numba.cuda.cudadrv import nvvm

    compile_ir = nvvm.compile_ir
    nvvm.compile_ir = partial(compile_ir, fma=False)
    try:
        yield
    finally:
        nvvm.compile_ir = compile_ir


def _complex(real: float, imag: float) -> np.complex128:
    """A complex number for the simulator: one of Python's own would raise an error where 1/0 is inf."""
    return np.complex128(complex(real, imag))


@cache
def _numpy_of_gpu() -> ModuleType:
    """NumPy, with the functions that numba-cuda has in place of those that it lacks."""
    from numba.cuda import libdevice

    module = ModuleType("numpy")
    vars(module).update(vars(np))
    vars(module).update(sqrt=math.sqrt, isfinite=math.isfinite, copysign=math.copysign, cbrt=libdevice.cbrt)
    return module


@cache
def _class_of_device_functions() -> Any:
    """The class of functions of the GPU; made late, since the simulator has nothing to derive it from."""
    from numba.cuda.dispatcher import CUDADispatcher

    class DeviceFunction(TakesAddresses, CUDADispatcher):
        """A function of the GPU as its kernels call it.

        apart  whether it is never inlined
        """

        apart: bool

        def compile_device(self, arguments: Any, return_type: Any = None) -> Any:
            """Compile this function for the GPU for types of arguments, once."""
            known = arguments in self.overloads
            result = super().compile_device(arguments, return_type)
            if self.apart and not known:
                own = result.library.get_function(result.fndesc.llvm_func_name)
                own.attributes.add("noinline")
            return result

    return DeviceFunction


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A code object, and those of the functions defined in it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)
