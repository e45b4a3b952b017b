"""Charts on a GPU: the kernels of the processor, run as Python in numba's simulator of a GPU."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.cli.command_runner import refusal_lines
from zwidth.errors import ProcessorError
from zwidth.resources import check_processor

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


def test_an_unknown_processor_is_refused():
    with pytest.raises(ValueError, match="processor must be 'cpu' or 'cuda', got 'gpu'"):
        check_processor("gpu")


@pytest.mark.parametrize("command", ["map", "sweep"])
def test_a_command_says_what_is_missing_for_a_gpu(command, tmp_path, monkeypatch):
    def missing():
        raise ProcessorError("needs the package numba-cuda, which is not installed", "install zwidth[cuda]")

    monkeypatch.setattr("zwidth.resources._check_gpu", missing)
    study = tmp_path / "study.toml"
    study.write_text(
        'device = "five-bar"\nmeasures = ["stiffness_max"]\n'
        '[[axis]]\nkey = "loop.sampling_period_s"\nvalues = [0.001]\n'
    )
    words = {"map": ("five-bar", "--measure", "stiffness_max"), "sweep": (study,)}[command]
    assert refusal_lines(command, *words, "--processor", "cuda") == [
        "--processor cuda needs the package numba-cuda, which is not installed; install zwidth[cuda], or leave "
        "--processor out to compute without one"
    ]


def test_a_package_that_is_missing_is_named(monkeypatch):
    monkeypatch.setattr("zwidth.resources.find_spec", lambda name: None)
    with pytest.raises(ProcessorError, match="numba-cuda, which is not installed"):
        check_processor("cuda")
