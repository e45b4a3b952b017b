"""The one door to numba: a typed decorator for kernels that are compiled once and cached on disk.

Kernels work on plain arrays and scalars, never on Python objects, so that the same source can also be
compiled for other targets.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])
UNCOUNTED: Final[dict[str, Any]] = {"_nrt": False}  # numba takes this flag, its type stubs do not name it
INLINED: Final[dict[str, Any]] = {**UNCOUNTED, "forceinline": True}


def compiled(function: Function) -> Function:
    """Compile a scalar kernel to machine code on first use; later processes read it from the cache.

    Division follows IEEE (1/0 is inf), so that a singular point is data and not an exception.
    """
    return cast(Function, numba.njit(cache=True, error_model="numpy")(function))


def compiled_lean(function: Function) -> Function:
    """Like `compiled`, for a small kernel that allocates nothing: it counts no references.

    A kernel handed a tuple of arrays otherwise counts each of them in and out of every call, with atomic
    instructions; around the algebra of a few bodies that is three quarters of the time. Without the counting
    such a kernel cannot allocate: numba refuses to compile it, it never computes something else.
    """
    return cast(Function, numba.njit(cache=True, error_model="numpy", **UNCOUNTED)(function))


def compiled_inline(function: Function) -> Function:
    """Like `compiled_lean`, for the innermost steps of a hot loop: built into whatever calls them.

    Left to itself the compiler stops building them in once the loop around them has grown, and the calls then
    cost as much as the algebra.
    """
    return cast(Function, numba.njit(cache=True, error_model="numpy", **INLINED)(function))


def compiled_parallel(function: Function) -> Function:
    """Like `compiled`, with `numba.prange` loops spread over the cores."""
    return cast(Function, numba.njit(cache=True, parallel=True, error_model="numpy")(function))
