"""The contact kernel as WebAssembly: no imports, Python's numbers to the bit, and as fresh as its source."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import llvmlite
import numba
import numpy as np
import pytest

from benchmarks._touch_node import WASM, run_in_node
from tests.contact.touch_cases import in_python, random_touch, same_bits

ROOT = Path(__file__).parents[2]
BUILT_WITH = re.compile(rb"zwidth: (numba \S+, llvmlite \S+, Python \S+)")
PYTHON = ".".join(map(str, sys.version_info[:2]))
HERE = f"numba {numba.__version__}, llvmlite {llvmlite.__version__}, Python {PYTHON}"
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
needs_linker = pytest.mark.skipif(shutil.which("wasm-ld") is None, reason="wasm-ld is not installed")


@needs_node
@pytest.mark.parametrize("frictions", [0, 1, 2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_wasm_is_python_to_the_bit(seed, frictions):
    *_, device, ports, drawn = random_touch(np.random.default_rng([seed, frictions, 9]), frictions)
    ports[5] = -ports[4]
    periods = 4000
    drawn = np.tile(drawn, 10)
    outputs, memory = in_python(device, ports, drawn, periods)
    theirs, after, _ = run_in_node(device, ports, drawn, periods)
    assert same_bits(outputs, theirs)
    assert same_bits(memory, after)


@needs_node
def test_wasm_imports_nothing():
    *_, device, ports, drawn = random_touch(np.random.default_rng(1), 1)
    _, _, told = run_in_node(device, ports, drawn, 10)
    assert told["imports"] == []
    assert {"memory", "touch", "touch_periods", "__heap_base"} <= set(told["exports"])


@needs_linker
def test_committed_wasm_is_a_fresh_build(tmp_path):
    """The same bytes with the releases that it was built with; others may order instructions otherwise, but give
    the same bytes each time, or say that they cannot."""

    def built(name):
        file = tmp_path / name
        tool = [sys.executable, ROOT / "tools" / "build_touch_wasm.py", file]
        done = subprocess.run(tool, cwd=ROOT, capture_output=True, text=True)
        return file.read_bytes() if done.returncode == 0 else done.stderr.splitlines()[-1].encode()

    committed = WASM.read_bytes()
    (releases,) = BUILT_WITH.findall(committed)
    first = built("first.wasm")
    assert first == (committed if releases.decode() == HERE else built("second.wasm"))
    assert first.startswith(b"\0asm") or b"install the releases of constraints.txt" in first
