"""`zwidth optimise`, killed: the same command goes on from what is kept, and ends with the same numbers."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from tests.cli.command_runner import document_of
from tests.interruption import stopped_by_ctrl_c

STUDY = """
device = "five-bar"
[[axis]]
key = "drives.motor-right.transmission_ratio"
range = [8.0, 30.0]
tie = ["drives.motor-left.transmission_ratio"]
[task]
box_m = [[-0.03, 0.03], [0.21, 0.27]]
count = 2
[optimise]
objectives = { stiffness_max = "max", rigid_mass = "min" }
budget = 80
front = 4
"""


@pytest.mark.parametrize(
    ("place", "calls"),
    [
        pytest.param("zwidth.study.jobs.store:Store.begin", 2, marks=pytest.mark.slow),  # a store without a batch
        pytest.param("zwidth.study.jobs.store:Store.write_batch", 3, marks=pytest.mark.slow),
        ("zwidth.study.optimisation.polish:gradients", 1),
        ("zwidth.study.optimisation.optimisation:simulate_front_contact", 1),  # after all that is kept
    ],
)
def test_a_killed_run_goes_on_and_ends_with_the_same_numbers(tmp_path, monkeypatch, place, calls):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY)
    words = ["optimise", "study.toml", "--json"]
    code, out, _ = stopped_by_ctrl_c([*words, "--resume", "kept"], place, calls, tmp_path, signal.SIGKILL)
    assert (code, out) == (-signal.SIGKILL, "")
    computed = batches(tmp_path / "kept")
    assert computed
    found = document_of(*words[:2], "--resume", "kept")
    assert found == document_of(*words[:2])
    after = batches(tmp_path / "kept")
    assert len(after) > len(computed) or place.endswith("simulate_front_contact")
    assert {path: after[path] for path in computed} == computed, "which are not computed again"


def batches(folder: Path) -> dict[Path, int]:
    """The files of values that are kept, and when each was written."""
    return {path: path.stat().st_mtime_ns for path in folder.glob("*/values/c/*/*")}
