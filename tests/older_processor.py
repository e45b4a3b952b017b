"""Run the tests as an older processor would, on this one.

    python tests/older_processor.py AVX512F [pytest's arguments ...]      as one without AVX-512
    python tests/older_processor.py AVX2 [pytest's arguments ...]         as one without AVX2 and FMA, too
    python tests/older_processor.py AVX2 --choice NAME                    a choice of `python -m tests.verdict`

NumPy, OpenBLAS, the C library and numba each choose their instructions when they start, by what the processor can
do. The last digits of sums, matrix products and sines differ between them, and so does which floating point
warnings NumPy gives. Each has an environment variable that takes instructions away.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy

# What NumPy calls the instructions that are taken away; older releases name them one by one, newer ones in levels.
LEVELS = {"AVX512F": ("AVX512", "X86_V4"), "AVX2": ("AVX", "X86_V3", "X86_V4", "FMA", "F16C")}
OTHERS = {
    "AVX512F": {
        "OPENBLAS_CORETYPE": "Haswell",
        "NUMBA_CPU_NAME": "haswell",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F",
    },
    "AVX2": {
        "OPENBLAS_CORETYPE": "Nehalem",
        "NUMBA_CPU_NAME": "generic",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA,-FMA4",
    },
}


def environment(without: str) -> dict[str, str]:
    """This process's environment, and what takes the instructions away from those it starts.

    Raises  SystemExit  for instructions that are not in LEVELS
    """
    if without not in LEVELS:
        raise SystemExit(f"which instructions are to be missing? one of {', '.join(LEVELS)}, got {without!r}")
    found = numpy.show_config(mode="dicts")["SIMD Extensions"]
    dispatched = [*found.get("found", ()), *found.get("not found", ())]
    taken = [name for name in dispatched if name.startswith(LEVELS[without])]
    return os.environ | OTHERS[without] | {"NUMBA_CPU_FEATURES": "", "NPY_DISABLE_CPU_FEATURES": " ".join(taken)}


def main() -> int:
    without, *arguments = sys.argv[1:] or [""]
    env = environment(without)
    subprocess.run([sys.executable, "-m", "zwidth", "compile"], env=env, check=True)
    command = ["tests.verdict", *arguments[1:]] if arguments[:1] == ["--choice"] else ["pytest", *arguments]
    root = Path(__file__).parent.parent
    return subprocess.run([sys.executable, "-m", *command], env=env, cwd=root).returncode


if __name__ == "__main__":
    sys.exit(main())
