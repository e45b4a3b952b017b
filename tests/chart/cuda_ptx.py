"""Compile the GPU's kernel to PTX on a computer without a GPU; needs numba-cuda and NVIDIA's compiler libraries.

    python tests/chart/cuda_ptx.py 9.0 kernel.ptx

compiles for the compute capability 9.0, writes the PTX and prints one JSON object: seconds, bytes of PTX, bytes of
the kernel's arguments. Where NVIDIA's assembler ptxas is installed, the PTX is assembled, too, and the object has
what that says of registers and stack.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from types import SimpleNamespace
from typing import Any

import numba.cuda.dispatcher
import numpy as np
from numba import cuda, typeof, types

from zwidth.chart import MOST_DEGREE, chart_cuda
from zwidth.chart.chart_batch import empty_numbers
from zwidth.chart.chart_cuda import rounding_each_step
from zwidth.chart.edge_memory import MOST_SAMPLES, edge_memory
from zwidth.loop import Controller
from zwidth.loop.loop_table import loop_table


def arguments() -> tuple[Any, ...]:
    """What the kernel is launched with, for one loop, as arrays of this computer: the types are the same."""
    loops = loop_table(np.zeros((1, 2, 9)), np.array([2]), Controller(0.001))
    here = SimpleNamespace(to_device=np.asarray, device_array=np.empty)
    memory = chart_cuda.memory_of_threads(edge_memory(loops, MOST_DEGREE, MOST_SAMPLES), 1, here)
    return loops, memory, 0, 1.0, empty_numbers(1)


def flat_bytes(kind: types.Type) -> int:
    """Bytes of a kernel's argument: of an array five words, and two for each axis."""
    if isinstance(kind, types.BaseTuple):
        return sum(map(flat_bytes, kind))
    return 8 * (5 + 2 * kind.ndim) if isinstance(kind, types.Array) else 8


def compile_ptx(capability: tuple[int, int]) -> tuple[str, int]:
    """The kernel's PTX, and the bytes of its arguments."""
    # the functions that it calls are translated for the GPU of this computer, whatever they are compiled for
    numba.cuda.dispatcher.get_current_device = lambda: SimpleNamespace(compute_capability=capability)
    kinds = tuple(map(typeof, arguments()))
    with rounding_each_step():
        ptx, _ = cuda.compile_ptx(chart_cuda.kernel_of_gpu().py_func, types.void(*kinds), cc=capability)
    return ptx, sum(map(flat_bytes, kinds))


def assemble(file: Path, capability: tuple[int, int]) -> dict[str, int] | None:
    """Registers and bytes of stack of the assembled kernel; None where there is no assembler."""
    place = find_spec("nvidia")
    folders = [Path(folder) for folder in (place.submodule_search_locations or [])] if place else []
    found = [path for folder in folders for path in folder.glob("*/bin/ptxas")]
    if not found:
        return None
    architecture = f"-arch=sm_{capability[0]}{capability[1]}"
    command = [found[0], architecture, "-v", file, "-o", file.with_suffix(".cubin")]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    registers, stack = re.search(r"Used (\d+) registers.*?(\d+) bytes cumulative stack size", said).groups()  # type: ignore[union-attr]
    return {"registers": int(registers), "stack_bytes": int(stack)}


def main() -> None:
    """Compile, write, assemble, print."""
    major, minor = map(int, sys.argv[1].split("."))
    file = Path(sys.argv[2])
    began = perf_counter()
    ptx, argument_bytes = compile_ptx((major, minor))
    seconds = perf_counter() - began
    file.write_text(ptx)
    found = {"seconds": round(seconds, 1), "ptx_bytes": len(ptx), "argument_bytes": argument_bytes}
    print(json.dumps(found | (assemble(file, (major, minor)) or {})))


if __name__ == "__main__":
    main()
