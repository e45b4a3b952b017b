"""Answers of one commit: asked of worker processes, kept as lines of JSON."""

from __future__ import annotations

import json
import os
import queue
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from threading import Lock, Thread
from typing import Any

from tests.frozen.cases import CommandLine
from tests.frozen.commits import CommitSources

Answer = dict[str, Any]
WORKER = Path(__file__).with_name("worker.py")
TRIES = 2  # what a run that took too long has compiled is there for the next
COMPILING = 1200.0  # processor seconds for a run that compiles most kernels
# what compiles most kernels
WARM = (
    "chart five-bar",
    "simulate published-two-mass --stiffness 4000 --damping 10 --duration 0.1",
    "simulate hapkit-course --stiffness 400 --damping 1 --duration 0.1 --set friction.coulomb_N=0.1",
    "map five-bar --measure stiffness_max --cells 5,4",
    "sensitivity hapkit-course",
    "guarantees hapkit-course",
    "move five-bar --plane 0,0.28,0,-1 --stiffness 2000 --damping 5 --push 0,2 --duration 0.1",
    "experiment hapkit-course --stiffnesses 1 --tips 0",
)


class Answers:
    """The answers of one side so far."""

    def __init__(self, path: Path, fresh: bool = False) -> None:
        self._path, self._lock = path, Lock()
        self._by_digest: dict[str, Answer] = {}
        if fresh:
            path.unlink(missing_ok=True)
        for line in path.read_text().splitlines() if path.exists() else []:
            try:
                answer = json.loads(line)
            except ValueError:  # the last line of an interrupted run
                continue
            self._by_digest[answer["digest"]] = answer
        # whatever is half a line ends here
        with path.open("a") as file:
            file.write("\n")

    def get(self, case: CommandLine) -> Answer | None:
        return self._by_digest.get(case.digest)

    def add(self, case: CommandLine, answer: Answer) -> None:
        kept = {"digest": case.digest, "name": case.name, **answer}
        with self._lock:
            self._by_digest[case.digest] = kept
            # in one piece: two comparisons with one base may write at once
            with self._path.open("ab", buffering=0) as file:
                file.write((json.dumps(kept) + "\n").encode())


class CommandWorker:
    """A process of one side, started anew when a run has taken it down."""

    def __init__(self, side: CommitSources, files: Mapping[str, str]) -> None:
        self._side = side
        self._room = tempfile.TemporaryDirectory(prefix="zwidth-record-")
        self._process: subprocess.Popen[str] | None = None
        for name, text in files.items():
            Path(self._room.name, name).write_text(text)

    def ask(self, words: Iterable[str], limit: float) -> Answer:
        """Run one command line; "time" in place of an exit code where it took longer than its limit."""
        if self._process is None or self._process.poll() is not None:
            self._process = self._started()
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps({"words": list(words), "limit_s": limit}) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if line:
            return dict(json.loads(line))
        code = self._end()
        how = "time" if code in (-27, -14) else f"the process ended with {code}"  # SIGPROF, SIGALRM
        return {"code": how, "out": "", "err": "", "seconds": limit}

    def close(self) -> None:
        """End the process and remove its files."""
        self._end()
        self._room.cleanup()

    def _end(self) -> int | None:
        process, self._process = self._process, None
        if process is None:
            return None
        process.communicate()
        return process.returncode

    def _started(self) -> subprocess.Popen[str]:
        environment = {
            **os.environ,
            "PYTHONPATH": str(self._side.folder / "src"),
            "PYTHONDONTWRITEBYTECODE": "",
            "OPENBLAS_NUM_THREADS": "1",
            "NUMBA_NUM_THREADS": "2",
            "MPLBACKEND": "Agg",
            **dict(self._side.environment),
        }
        # hash order is another in each process, so that what depends on it is seen
        environment.pop("PYTHONHASHSEED", None)
        command = [sys.executable, str(WORKER), self._side.entry]
        return subprocess.Popen(
            command, cwd=self._room.name, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )


def commands_of(worker: CommandWorker) -> list[str]:
    """Names of the commands that the help lists."""
    text = worker.ask(["--help"], COMPILING)["out"]
    return re.findall(r"^  ([a-z][\w-]*)(?=  )", text, re.MULTILINE)  # in whatever sections they stand


def warm_up(side: CommitSources, say: Callable[[str], None]) -> None:
    """Compile most kernels of a side, once."""
    done = side.folder / f"compiled-{side.answers.stem.removesuffix('-repeat')}"
    if done.exists():
        return
    say(f"{side.label}: compiling kernels, some minutes")
    worker = CommandWorker(side, {})
    for line in WARM:
        worker.ask([*line.split(), "--json"], COMPILING)
    worker.close()
    done.touch()


def answer_cases(
    answers: Answers,
    side: CommitSources,
    asked: list[CommandLine],
    files: Mapping[str, str],
    jobs: int,
    say: Callable[[str], None],
) -> None:
    """Ask what is not answered yet, in so many processes."""
    waiting: queue.SimpleQueue[CommandLine] = queue.SimpleQueue()
    missing = [case for case in asked if answers.get(case) is None]
    for case in missing:
        waiting.put(case)

    def work() -> None:
        worker = CommandWorker(side, files)
        try:
            while True:
                case = waiting.get_nowait()
                for _ in range(TRIES):
                    answer = worker.ask(case.words, case.limit)
                    if answer["code"] != "time":
                        break
                answers.add(case, answer)
                left = waiting.qsize()
                if left % 50 == 0:
                    say(f"{side.label}: {left} of {len(missing)} command lines left")
        except queue.Empty:
            return
        finally:
            worker.close()

    run_in_threads([work] * min(jobs, max(1, len(missing))))


def run_in_threads(works: list[Callable[[], None]]) -> None:
    """Run side by side; the first failure is raised when all are done."""
    failures: list[BaseException] = []

    def guarded(work: Callable[[], None]) -> None:
        try:
            work()
        except BaseException as failure:
            failures.append(failure)

    threads = [Thread(target=guarded, args=(work,), daemon=True) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if failures:
        raise failures[0]
