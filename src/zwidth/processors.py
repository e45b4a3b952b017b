"""Where numbers of charts are computed: by the computer's processor ("cpu"), or by an NVIDIA GPU ("cuda").

What the second needs is looked for when it is asked for; nothing of numba is imported before.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from importlib.util import find_spec
from typing import Final, Literal, get_args

from zwidth.errors import ProcessorError

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
    return (str(error).strip().splitlines() or [type(error).__name__])[0]
