"""Kernels on a GPU: the Python functions behind the decorators of `compiled`, compiled for CUDA by numba-cuda.

A kernel becomes a function of the GPU together with all that it calls, each from its one source: what is computed
is written once. As on the processor, small steps are inlined, larger kernels are not, and tuples of arrays are
handed over as one address (`tuple_references`). With everything inlined the compiler takes ten times as long.

In numba's simulator (NUMBA_ENABLE_CUDASIM=1) the same functions run as Python.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, partial
from types import CodeType, FunctionType, ModuleType
from typing import Any, Final

import numpy as np
from numba import cuda
from numba.core import config
from numba.core.dispatcher import Dispatcher

from zwidth.tuple_references import TakesAddresses

SIMULATED: Final = bool(config.ENABLE_CUDASIM)


@cache
def function_of_gpu(kernel: Any) -> Any:
    """A kernel as a function that kernels of the GPU can call.

    kernel  as the decorators of `compiled` return it; it must not call itself
    """
    function = kernel.py_func
    known = {"__name__": function.__module__, "__builtins__": __builtins__}
    for name in {name for code in _codes(function.__code__) for name in code.co_names}:
        if name in function.__globals__:
            known[name] = _of_gpu(function.__globals__[name])
    copy = FunctionType(function.__code__, known, function.__name__, function.__defaults__, function.__closure__)
    if SIMULATED:
        known["complex"] = _complex
        return cuda.jit(copy, device=True)
    inlined = bool(kernel.targetoptions.get("forceinline"))
    made = _device_function()(copy, {"device": True, "opt": True, "forceinline": inlined})
    made.apart = bool(getattr(kernel, "apart", False))
    return made


def _of_gpu(value: Any) -> Any:
    """What stands on the GPU in place of what a kernel knows by a global name."""
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
def _device_function() -> Any:
    """The class of functions of the GPU; made late, since the simulator has nothing to derive it from."""
    from numba.cuda.dispatcher import CUDADispatcher

    class DeviceFunction(TakesAddresses, CUDADispatcher):
        """A function of the GPU as its kernels call it.

        apart  whether it is never inlined
        """

        apart: bool

        def compile_device(self, arguments: Any, return_type: Any = None) -> Any:
            """Translate it for types of arguments, once."""
            known = arguments in self.overloads
            result = super().compile_device(arguments, return_type)
            if self.apart and not known:
                own = result.library.get_function(result.fndesc.llvm_func_name)
                own.attributes.add("noinline")
            return result

    return DeviceFunction


def _codes(code: CodeType) -> Iterator[CodeType]:
    """The code, and that of the functions defined in it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)
