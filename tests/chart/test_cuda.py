"""Charts on a GPU: the kernels of the processor, run as Python in numba's simulator of a GPU."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def simulated():
    """Name of each number -> its values on the simulated GPU, and by the processor."""
    path = os.pathsep.join([str(ROOT), str(ROOT / "src"), os.environ.get("PYTHONPATH", "")])
    ran = subprocess.run(
        [sys.executable, ROOT / "tests" / "chart" / "cuda_simulation.py"],
        env={**os.environ, "NUMBA_ENABLE_CUDASIM": "1", "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


def test_numbers_are_those_of_the_processor(simulated):
    for name, (there, here) in simulated.items():
        np.testing.assert_allclose(there, here, rtol=1e-9, atol=0.0, err_msg=name)


def test_the_numbers_compared_are_some(simulated):
    for name in ("stiffness 1", "area 7", "fastest 7", "map"):
        assert np.isfinite(simulated[name][1]).sum() >= 2
