"""What a long command says of how far it is."""

from __future__ import annotations

from contextlib import contextmanager
from importlib import import_module
from threading import Event

import pytest

from zwidth.compile_events import compiling
from zwidth.progress import watched
from zwidth.show import run
from zwidth.show.cli import progress
from zwidth.show.cli.first_use import KernelTimes, Progress, announce_compiling
from zwidth.show.cli.progress import show_progress

# --- what a long command says of how far it is -------------------------------------------------------


@pytest.fixture
def clock(monkeypatch):
    """The time that the lines go by; the thread that looks after it never runs."""

    class Clock:
        now = 100.0

    class NoThread:
        def __init__(self, **_):
            pass

        def start(self):
            pass

        join = start

    monkeypatch.delenv(progress.QUIET)
    monkeypatch.setattr(progress, "monotonic", lambda: Clock.now)
    monkeypatch.setattr("zwidth.progress.Thread", NoThread)
    return Clock


def test_who_wants_quiet_hears_nothing(clock, capsys, monkeypatch):
    monkeypatch.setenv("ZWIDTH_QUIET", "1")
    with show_progress() as tell:
        clock.now += 100.0
        tell("cells", 1, 2)
    assert capsys.readouterr().err == ""


def test_a_short_run_says_nothing(clock, capsys):
    with show_progress() as tell:
        for done in range(10):
            clock.now += 0.1
            tell("cells", done, 10)
    assert capsys.readouterr().err == ""


def test_what_remains_of_a_stage_that_goes_on_from_another_goes_by_its_own_speed(clock, capsys):
    with show_progress() as tell:
        tell("searching", 0, 300)
        for done in range(200, 301):
            tell("polishing", done, 300)
            clock.now += 0.5
    said = capsys.readouterr().err.splitlines()
    assert said[:2] == [
        "zwidth: polishing, 204 of 300, about 50 s left",
        "zwidth: polishing, 212 of 300, about 45 s left",
    ]


def test_a_long_run_says_what_remains_and_ever_more_rarely(clock, capsys):
    with show_progress() as tell:
        for done in range(601):
            tell("cells", done, 600)
            clock.now += 0.125
    assert capsys.readouterr().err.splitlines() == [
        "zwidth: cells, 16 of 600, about 75 s left",
        "zwidth: cells, 48 of 600, about 70 s left",
        "zwidth: cells, 112 of 600, about 60 s left",
        "zwidth: cells, 239 of 600, about 45 s left",
        "zwidth: cells, 493 of 600, about 15 s left",
    ]


def test_an_estimate_waits_for_something_to_go_by_and_is_that_of_the_stage(clock, capsys):
    with show_progress() as tell:
        tell("charts", 0, 5)
        clock.now += 10.0
        tell("charts", 1, 1000)
        tell("members", 0, 10)
        clock.now += 10.0
        tell("members", 5, 10)
    assert capsys.readouterr().err.splitlines() == [
        "zwidth: charts, 1 of 1000",
        "zwidth: members, 5 of 10, about 10 s left",
    ]


def test_a_run_that_has_told_nothing_says_that_it_computes(clock, capsys):
    with show_progress():
        clock.now += 2.0
        waiting = progress._Lines()
        clock.now += 2.0
        waiting.look()
    assert capsys.readouterr().err == "zwidth: computing\n"


def test_a_stage_of_unknown_length_is_not_mentioned_while_another_message_explains_the_wait(clock, capsys):
    busy = True
    with show_progress(lambda: busy):
        lines = progress._Lines(lambda: busy)
        clock.now += 3.0
        lines.look()
        lines.update("cells", 1, 100)
        busy = False
        clock.now += 5.0
        lines.update("writing a.csv", 0, 0)
        lines.look()
    assert capsys.readouterr().err == "zwidth: cells, 1 of 100\nzwidth: writing a.csv\n"


def test_bars_begin_after_two_seconds_and_leave_nothing(clock, capsys):
    bars = progress._Bars()
    bars.update("cells", 1, 100)
    clock.now += 1.9
    bars.look()
    bars.close()
    assert capsys.readouterr().err == ""
    clock.now += 0.2
    bars.look()
    bars.update("writing a.csv", 0, 0)
    tasks = {task.description: (task.completed, task.total) for task in bars._bar.tasks}
    bars.close()
    assert tasks == {"cells": (1, 100), "writing a.csv": (0, None)}


@pytest.mark.parametrize(("of", "shown"), [(0, False), (100, True)])
def test_bars_leave_a_wait_of_unknown_length_to_the_message_that_explains_it(clock, of, shown):
    bars = progress._Bars(lambda: True)
    bars.update("cells", 0, of)
    clock.now += 3.0
    bars.look()
    bars.close()
    assert (bars._bar is not None) is shown


@pytest.mark.parametrize(
    ("words", "stage", "steps"),
    [
        (["polar", "five-bar", "--count", "8"], "directions", 8),
        (["load", "five-bar", "--count", "3"], "pushes", 3),
        (["check", "five-bar", "--stiffness", "100", "--damping", "1"], "walls", 1),
        (["sensitivity", "published-two-mass"], "numbers", 17),
    ],
)
def test_a_command_reports_its_steps_and_what_it_writes(tmp_path, monkeypatch, words, stage, steps):
    told = []

    @contextmanager
    def record(_):
        yield lambda *step: told.append(step)

    monkeypatch.setattr("zwidth.show.cli.command.show_progress", record)
    assert run([*words, "--output", str(tmp_path / "a.csv")]) == 0
    assert (stage, steps, steps) in told
    assert told[-1] == ("writing a.csv", 0, 0)


@pytest.mark.parametrize(
    ("words", "module"),
    [
        (
            ["simulate", "five-bar", "--stiffness", "1000", "--damping", "2", "--duration", "0.05"],
            "loop_simulation",
        ),
        (["move", "five-bar", "--push", "0,1", "--duration", "0.05"], "mechanism.simulate_mechanism"),
    ],
)
def test_how_far_a_simulation_is_can_be_read_from_its_records(monkeypatch, words, module):
    seen = []

    @contextmanager
    def watch(progress, stage, done, of):
        before = done()
        yield
        seen.append((stage, before, done(), of))

    monkeypatch.setattr(import_module(f"zwidth.contact.{module}"), "watched", watch)
    assert run(words) == 0
    assert seen == [("simulating", 0, 41, 41)]


def test_compiled_code_is_watched_from_beside_it(monkeypatch):
    told, looked = [], Event()

    def take(*step):
        told.append(step)
        looked.set()

    monkeypatch.setattr("zwidth.progress.INTERVAL", 0.001)
    with watched(take, "steps", lambda: 7, 5):
        assert looked.wait(60.0)
    assert set(told) == {("steps", 5, 5)}
    with watched(None, "steps", lambda: 7, 5):
        pass


# --- compiling at first use: what is kept on disk, when it is compiled anew, and that whoever --------


def test_a_command_says_what_it_waits_for(monkeypatch, capsys):
    times = KernelTimes({"zwidth.a": 20.0, "zwidth.b": 40.0}, {"chart": ["zwidth.a", "zwidth.b"]})
    monkeypatch.setattr(KernelTimes, "read", lambda: times)
    with announce_compiling("chart"):
        for name in ("users.law", "zwidth.a", "zwidth.b"):
            with compiling(name):
                pass
    assert capsys.readouterr().err == "zwidth: first use: compiling 2 kernels for this processor, about 60 s\n"


def test_what_remains_is_told_as_it_goes(monkeypatch, capsys):
    clock = iter([0.0, 6.0, 6.0, 6.0, 7.0])
    monkeypatch.setattr("zwidth.show.cli.first_use.monotonic", lambda: next(clock))
    progress = Progress({"a": 3.0, "b": 30.0, "c": 3.0}, 1)
    progress.finish("a")
    assert capsys.readouterr().err == "zwidth: 1 compiled, 2 to go, about 35 s left\n"
    progress.finish("b")
    assert capsys.readouterr().err == ""
