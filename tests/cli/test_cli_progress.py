"""What a long command says of how far it is."""

from __future__ import annotations

import pytest

from zwidth.show.cli import progress
from zwidth.show.cli.progress import show_progress


@pytest.fixture
def clock(monkeypatch):
    """The time that the lines go by; the timer of the first line never fires."""

    class Clock:
        now = 100.0

    class NoTimer:
        def __init__(self, *_):
            pass

        def start(self):
            pass

        cancel = start

    monkeypatch.setattr(progress, "PATIENCE", 2.0)
    monkeypatch.setattr(progress, "monotonic", lambda: Clock.now)
    monkeypatch.setattr(progress, "Timer", NoTimer)
    return Clock


def test_a_short_run_says_nothing(clock, capsys):
    with show_progress() as tell:
        for done in range(10):
            clock.now += 0.1
            tell("cells", done, 10)
    assert capsys.readouterr().err == ""


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
        waiting.print_line()
    assert capsys.readouterr().err == "zwidth: computing\n"
