"""The wheel that `make wheel` builds: its kernels serve without a compilation, whatever processor they meet."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SCRIPT = """
import json
import sys
sys.path.insert(0, sys.argv[1])
import numba
from numba.core import event

compiled = []

class Listener(event.Listener):
    def on_start(self, event):
        compiled.append(event.data["dispatcher"].py_func.__qualname__)

    def on_end(self, event):
        pass

event.register("numba:compile", Listener())
import zwidth
point = zwidth.load("five-bar").at()
found = {"folder": zwidth.__file__, "stiffness_max": point.chart().stiffness_max}
point.simulate(1000.0, 5.0, duration=0.05)

@numba.njit
def other(x):
    return x + 1.0

other(1.0)
(library,) = (result.library for result in other.overloads.values())
print(json.dumps({**found, "compiled": compiled, "processor": library.codegen.magic_tuple()[1]}))
"""


@pytest.mark.slow
def test_a_wheel_brings_all_kernels_and_leaves_those_of_others_to_the_host(tmp_path):
    subprocess.run([sys.executable, "tools/build_wheel.py", tmp_path / "dist"], cwd=ROOT, check=True)
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    tag = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    assert f"-{tag}-{tag}-" in wheel.name
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "installed")
    (metadata,) = (tmp_path / "installed").glob("*.dist-info/METADATA")
    assert f"Requires-Dist: numba=={version('numba')}\n" in metadata.read_text()
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-c", SCRIPT, str(tmp_path / "installed")]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert found["folder"].startswith(str(tmp_path / "installed"))
    assert found["compiled"] == ["other"]
    assert found["processor"] != "generic"
    assert abs(found["stiffness_max"] - 7849.4415) < 1e-3
    assert "first use" not in done.stderr
    kept = list((tmp_path / "cache").rglob("*.nbc"))
    assert kept == []
