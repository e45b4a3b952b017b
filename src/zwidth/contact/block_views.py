"""Arrays of any shape within one flat block of numbers, for kernels whose caller owns all memory.

A slice that is reshaped needs a function of numba's own library, which is no part of a kernel that is compiled for
another target; a view needs nothing.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array


@intrinsic  # type: ignore[untyped-decorator]
def view(typing_context: Any, block: Any, start: Any, shape: Any) -> Any:
    """In kernels: the numbers of a block from `start` on as an array of this shape, in the order of rows.

    block  one-dimensional array, or the pointer to its first number;   shape  tuple of integers
    The block has to be long enough; nothing looks.
    """
    kind = types.Array(block.dtype, len(shape), "C")
    signature = kind(block, types.int64, types.UniTuple(types.int64, len(shape)))

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        given, first, shape_value = arguments
        if isinstance(block, types.Array):
            given = make_array(block)(context, builder, given).data
        lengths = cgutils.unpack_tuple(builder, shape_value)
        size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(block.dtype)))
        strides, bytes_below = list[Any](), size
        for length in reversed(lengths):
            strides.append(bytes_below)
            bytes_below = builder.mul(bytes_below, length)
        array = make_array(kind)(context, builder)
        populate_array(
            array,
            data=builder.gep(given, [first]),
            shape=lengths,
            strides=strides[::-1],
            itemsize=size,
            meminfo=None,
        )
        return array._getvalue()

    return signature, generate
