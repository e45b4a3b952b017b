"""`zwidth sweep` and `map` that lose processes, time, disk and clusters: what is said, and what is kept."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from time import sleep

import pytest

from tests.cli.command_runner import refusal_lines, run_command
from tests.interruption import HANG_TIMEOUT_S
from tests.study.cluster_cases import running_cluster
from zwidth.study import FolderLock, RecoveredWarning
from zwidth.study.jobs import cluster as clusters

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")

MEASURES = """
import os, time
from zwidth import measure

@measure(unit="s")
def slow(place):
    time.sleep(0.01)
    with open("asked", "ab") as file:
        file.write(b".")
    here = os.environ["STARTER"] == str(os.getpid())
    while not here and os.path.exists("hold") and os.path.getsize("asked") > 60:
        time.sleep(0.05)
    return place.controller.sampling_period

@measure(unit="s")
def odd(place):
    period = place.controller.sampling_period
    if period == 0.0015 and os.environ["STARTER"] != str(os.getpid()):
        if os.environ["FAULT"] == "kill":
            os.kill(os.getpid(), 9)
        sum(iter(int, 1))
    return period
"""
STUDY = """
device = "published-two-mass"
measures = ["{measure}"]
measures_file = "own.py"
[[axis]]
key = "loop.sampling_period_s"
range = [1e-3, 2e-3]
count = {count}
"""
LARGE = """
device = "hapkit-course"
measures = ["stiffness_max"]
sampling = "latin-hypercube"
count = 900000000
[[axis]]
key = "plant.mass_kg"
range = [0.01, 0.1]
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "own.py").write_text(MEASURES)
    (tmp_path / "study.toml").write_text(STUDY.format(measure="slow", count=120))
    (tmp_path / "odd.toml").write_text(STUDY.format(measure="odd", count=9))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("STARTER", str(os.getpid()))
    return tmp_path


def started(*words: str) -> subprocess.Popen[str]:
    """A command line in a process of its own."""
    program = f"import sys; sys.path[:0] = {sys.path!r}; sys.argv = ['zwidth', *{list(words)!r}]\n"
    program += "from zwidth.show.cli.main import main; main()"
    return subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True)


def test_a_killed_command_goes_on_where_it_was_and_a_second_one_waits(folder):
    words = ["sweep", "study.toml", "--output", "designs.csv", "--workers", "1"]
    chunks = folder / "designs.csv.progress" / "status" / "c"
    (folder / "hold").write_text("in the middle of the study")
    running = started(*words)
    while not (chunks.is_dir() and len(list(chunks.iterdir())) > 1):
        assert running.poll() is None
        sleep(0.05)
    (line,) = refusal_lines(*words)
    assert line.startswith(f"designs.csv.progress: process {running.pid} on ")
    running.send_signal(signal.SIGKILL)
    running.communicate(timeout=HANG_TIMEOUT_S)
    (folder / "hold").unlink()
    assert run_command(*words).code == 0
    text = (folder / "designs.csv").read_text()
    assert not (folder / "designs.csv.progress").exists()
    assert run_command("sweep", "study.toml", "--output", "again.csv", "--workers", "1").code == 0
    assert (folder / "again.csv").read_text() == text


def test_a_design_that_never_ends_is_out_of_time(folder, monkeypatch):
    monkeypatch.setenv("FAULT", "hang")
    monkeypatch.setattr("zwidth.study.jobs.workers.LOADING", 2.0)
    ran = run_command("sweep", "odd.toml", "--time-limit", "1", "--workers", "1", "--output", "odd.csv")
    assert ran.code == 0, ran.err
    assert "first at loop.sampling_period_s = 0.0015" in ran.out
    rows = (folder / "odd.csv").read_text().splitlines()
    assert [row for row in rows if row.endswith(",out of time")] == ["0.0015,,out of time"]
    assert len([row for row in rows if row.endswith(",ok")]) == 8


def test_a_design_that_kills_its_process_is_told_and_the_rest_is_done(folder, monkeypatch):
    monkeypatch.setenv("FAULT", "kill")
    with pytest.warns(RecoveredWarning) as told:
        ran = run_command("sweep", "odd.toml", "--cluster", "local", "--workers", "1", "--json")
    assert ran.code == 0, ran.err
    assert ran.document["status"].count({"odd": "failed"}) == 1
    assert str(told[-1].message).endswith("left out")


def test_a_cluster_maps_and_sweeps_the_same(folder):
    with running_cluster(1) as cluster:
        for words in (
            ("sweep", "study.toml", "--json"),
            ("map", "five-bar", "--measure", "isotropy", "--cells", "9,7", "--json"),
        ):
            here, there = run_command(*words), run_command(*words, "--cluster", cluster.address)
            assert (there.code, there.err) == (0, ""), there.err
            assert there.out == here.out


def test_a_cluster_that_does_not_answer_is_one_line(folder, monkeypatch):
    monkeypatch.setattr(clusters, "ANSWER", 0.5)
    for words in (("sweep", "study.toml"), ("map", "five-bar", "--measure", "isotropy")):
        (line,) = refusal_lines(*words, "--cluster", "tcp://127.0.0.1:9")
        assert line.startswith("--cluster: tcp://127.0.0.1:9: no scheduler")


def test_a_scheduler_that_is_killed_leaves_the_finished_work(folder):
    words = ["sweep", "study.toml", "--resume", "cells"]
    (folder / "hold").write_text("in the middle of the study")
    with running_cluster(1) as cluster:
        running = started(*words, "--cluster", cluster.address)
        chunks = folder / "cells" / "status" / "c"
        while not (chunks.is_dir() and len(list(chunks.iterdir())) > 1):
            assert running.poll() is None
            sleep(0.05)
        os.killpg(cluster.scheduler.pid, signal.SIGKILL)
        _, err = running.communicate(timeout=HANG_TIMEOUT_S)
    assert running.returncode == 70
    (folder / "hold").unlink()
    said = [line for line in err.splitlines() if "Hosting" not in line]
    assert said[-1].startswith("zwidth: ")
    assert cluster.address in said[-1]
    assert said[-1].endswith("from it")
    assert run_command(*words).code == 0


def test_what_lists_more_designs_than_fit_is_refused_before_anything_is_computed(folder):
    (folder / "large.toml").write_text(LARGE)
    for words in (["--json"], ["--output", "a.json"], ["--output", "a.nc"], ["--output", "a.svg"]):
        (line,) = refusal_lines("sweep", "large.toml", "--resume", "cells", *words)
        assert line.startswith("large.toml: 900000000 designs ")
    assert "(.zarr, .csv)" in line
    assert not (folder / "cells").exists()


def test_a_lock_of_nobody_is_no_hindrance(folder):
    assert run_command("sweep", "odd.toml", "--resume", "cells").code == 0
    lock = FolderLock()
    assert lock.acquire(folder / "cells")
    assert refusal_lines("sweep", "odd.toml", "--resume", "cells")
    lock.release()
    assert run_command("sweep", "odd.toml", "--resume", "cells").code == 0
