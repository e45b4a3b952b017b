"""Functions that a compiled kernel calls without knowing them: the kernel takes an address, the caller compiles.

One kernel, compiled once and cached on disk, then serves every virtual environment, a user's own too. Handing the
function itself over would compile the kernel anew for each (a kernel's type names the function).
"""

from __future__ import annotations

from typing import Any

import numba
from numba.core import cgutils
from numba.extending import intrinsic


def address_of(dispatcher: Any) -> int:
    """Where the machine code of a function compiled by `compiled_as` begins, for `function_at`."""
    (result,) = dispatcher.overloads.values()
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def function_at(signature: Any) -> Any:
    """For use inside kernels: a function that turns an address (int64) into a callable of the signature.

        environment_at = function_at(signature)             # at the module's level

        @compiled
        def kernel(address, ...):
            force = environment_at(address)
            ... force(position, velocity, ...)

    The address is a plain number, so that the kernel's type does not depend on the function and its machine code
    is found on disk whichever function is called; arrays of addresses and `prange` are fine. An address that is
    not of `address_of` with the same signature ends the process.
    """
    kind = numba.types.FunctionType(signature)
    proxy: Any = cgutils.create_struct_proxy

    @intrinsic  # type: ignore[untyped-decorator]
    def at(typing_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
            structure = proxy(kind)(context, builder)
            structure.jit_addr = builder.inttoptr(arguments[0], context.get_value_type(numba.types.voidptr))
            return structure._getvalue()

        return kind(numba.types.int64), generate

    return at
