"""Run a kernel on all cores: threads that each compute chunks of a loop.

Kernels release the interpreter's lock, so that Python's own threads are enough. Numba's parallel loops would do
the same, but each takes ten seconds to compile, even a loop that only calls a kernel.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise

import numba

CHUNKS_PER_THREAD = 8  # so that no thread waits long for one whose items are slow


def in_chunks(kernel: Callable[[int, int], None], count: int) -> None:
    """Call kernel(first, last) for ranges that together are range(count), over as many cores as numba may use.

    kernel  a compiled kernel with all but its last two arguments bound; what it computes for an item may depend on
            that item alone, so that the result does not depend on the ranges
    """
    threads = min(numba.get_num_threads(), count)
    if threads <= 1:
        kernel(0, count)
        return
    pieces = min(count, threads * CHUNKS_PER_THREAD)
    ends = [count * piece // pieces for piece in range(pieces + 1)]
    futures = [_pool(threads).submit(kernel, first, last) for first, last in pairwise(ends)]
    try:
        for future in futures:
            future.result()
    finally:
        for future in futures:
            future.cancel()


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="zwidth")
