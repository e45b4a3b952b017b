"""What the machine computes with: processor, threads and memory.

Numbers of charts are computed by the computer's processor ("cpu"), or by an NVIDIA GPU ("cuda").

What the second needs is looked for when it is asked for; nothing of numba is imported before.

A kernel runs on all cores in threads that each compute chunks of a loop. Kernels release the interpreter's lock,
so that Python's own threads are enough. Numba's parallel loops would do the same, but each takes ten seconds to
compile, even a loop that only calls a kernel.

A computation whose result would not fit into the machine's memory is refused before it begins.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib.util import find_spec
from itertools import pairwise
from typing import Final, Literal, get_args

from zwidth.errors import ProcessorError, TooLarge

Processor = Literal["cpu", "cuda"]
PROCESSORS: Final[tuple[Processor, ...]] = get_args(Processor)
LEAST_CAPABILITY: Final = (7, 5)  # the oldest that CUDA 13 compiles for
_USED: Final[ContextVar[Processor]] = ContextVar("processor", default="cpu")


@contextmanager
def computing_on(processor: Processor) -> Iterator[None]:
    """Compute numbers of charts there inside this block; `check_processor` is to be called before."""
    before = _USED.set(processor)
    try:
        yield
    finally:
        _USED.reset(before)


def processor_in_use() -> Processor:
    """The processor that numbers of charts are computed on here.

    >>> processor_in_use()
    'cpu'
    """
    return _USED.get()


def check_processor(processor: str) -> None:
    """Raise unless numbers can be computed there.

    Raises  ValueError      for another text than "cpu" or "cuda"
            ProcessorError  for "cuda" where numba-cuda, NVIDIA's libraries or a GPU is missing
    """
    if processor not in PROCESSORS:
        raise ValueError(f"processor must be {' or '.join(map(repr, PROCESSORS))}, got {processor!r}")
    if processor == "cuda":
        _check_gpu()


def _check_gpu() -> None:
    """Raise ProcessorError unless there is a GPU, or numba simulates one."""
    from numba.core import config

    if config.DISABLE_JIT:
        raise ProcessorError("compiles its kernels, and NUMBA_DISABLE_JIT is set", "unset it")
    if config.ENABLE_CUDASIM:
        return
    if find_spec("numba_cuda") is None:
        raise ProcessorError("needs the package numba-cuda, which is not installed", "install zwidth[cuda]")
    try:
        from numba import cuda
        from numba.cuda.cudadrv import nvvm

        found = nvvm.is_available()
    except Exception as error:  # whatever loading a library raises
        raise ProcessorError(
            f"cannot load NVIDIA's libraries ({_first_line(error)})", "install zwidth[cuda]"
        ) from None
    if cuda.cuda_error() is not None or not len(cuda.gpus):
        raise ProcessorError("needs an NVIDIA GPU with its driver, and none was found on this computer")
    if not found:
        raise ProcessorError("needs NVIDIA's compiler library NVVM, which was not found", "install zwidth[cuda]")
    capability = cuda.get_current_device().compute_capability
    if tuple(capability) < LEAST_CAPABILITY:
        have, least = (".".join(map(str, version)) for version in (capability, LEAST_CAPABILITY))
        raise ProcessorError(f"needs a GPU of compute capability {least} or higher, and this one has {have}")


def _first_line(error: Exception) -> str:
    """First line of an error's message; the name of its class where the message is empty."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


CHUNKS_PER_THREAD = 8  # so that no thread waits long for one whose items are slow


def in_chunks(kernel: Callable[[int, int], None], count: int) -> None:
    """Call kernel(first, last) for ranges that together are range(count), over as many cores as numba may use.

    kernel  a compiled kernel with all but its last two arguments bound; what it computes for an item may depend on
            that item alone, so that the result does not depend on the ranges
    """
    import numba

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
    """The pool of so many threads, made once."""
    return ThreadPoolExecutor(threads, thread_name_prefix="zwidth")


SHARE: Final = 0.5  # of the machine's memory
UNKNOWN: Final = 4e9  # bytes of memory assumed where the system does not state them


def check_memory(numbers: float, what: str, advice: str) -> None:
    """Raise TooLarge if floating-point numbers of 8 bytes would take more than half of the machine's memory.

    numbers  how many numbers the result would have
    what     name of the result, with which the message begins
    advice   what to do instead, with which the message ends
    """
    try:
        memory = float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        memory = UNKNOWN
    wanted = 8.0 * numbers
    if not wanted <= SHARE * memory:  # nan is too large, too
        raise TooLarge(
            f"{what} would take {wanted / 1e9:.3g} GB of memory, "
            f"and this machine has {memory / 1e9:.3g} GB; {advice}"
        )
