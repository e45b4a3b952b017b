"""A case that has become slow is named by `benchmarks._check`, and no other; all by a clock of the tests."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import _check
from benchmarks._cases import TimedCase
from benchmarks._check import LIMIT, Measurement, check, keep, read_kept, verdict_of, without_tools, write_ratios
from benchmarks._workload import fixed_work
from zwidth.compile_events import compiling
from zwidth.measures import OK
from zwidth.model import OK as SOLVED

WORK_S = 0.025  # of the fixed work
SECONDS = 0.06  # of a call of what is measured: a turn


class Clock:
    """A clock that only moves when something takes time."""

    now = 0.0

    def __call__(self) -> float:
        return self.now

    def take(self, seconds: float) -> float:
        self.now += seconds
        return seconds


@pytest.fixture
def clock(monkeypatch) -> Clock:
    """A clock on which the fixed work takes WORK_S."""
    made = Clock()
    monkeypatch.setattr(_check, "fixed_work", lambda: made.take(WORK_S))
    return made


def faults(results: dict) -> dict[str, str]:
    return {name: result.fault for name, result in results.items() if result.fault}


# --- a threefold slowdown of what a benchmark measures ------------------------------------------------

# script, case, the function that it measures and what stands in for its answer
STIFFEST = SimpleNamespace(values=np.ones(1), status=np.full(1, OK))
MEASURED = {
    "chart": ("exact chart, all its numbers", "stability_chart", SimpleNamespace(stiffness_max=1.0)),
    "design": ("5000 five-bars", "sweep", {"stiffness_max": STIFFEST}),
    "maps": ("map of 50 x 50", "map_of", [STIFFEST]),
    "simulation": ("a minute on one core", "simulate_batch", [SimpleNamespace(truth=np.ones(1))]),
    "posture": ("100000 postures", "solve_posture", SimpleNamespace(status=np.full(1, SOLVED))),
}


@pytest.fixture(scope="module")
def real_cases() -> dict[str, TimedCase]:
    """One case of each of these scripts, as the script states it."""
    return {
        f"{script}: {name}": import_module(f"benchmarks.{script}").cases()[name]
        for script, (name, *_) in MEASURED.items()
    }


@pytest.mark.parametrize("slowed", MEASURED)
def test_a_case_three_times_as_slow_is_named_and_no_other(slowed, real_cases, clock, monkeypatch):
    factor = dict.fromkeys(MEASURED, 1.0)

    def stand_in(script: str, answer: object) -> Callable[..., object]:
        def measured(*_: object, **__: object) -> object:
            clock.take(SECONDS * factor[script])
            return answer

        return measured

    for script, (_, function, answer) in MEASURED.items():
        monkeypatch.setattr(import_module(f"benchmarks.{script}"), function, stand_in(script, answer))
    parameters = SimpleNamespace(link_side_mass=np.ones(1), motor_side_mass=np.ones(1), stiffness=np.ones(1))
    monkeypatch.setattr(import_module("benchmarks.posture"), "effective_parameters", lambda *_: parameters)
    monkeypatch.setattr(import_module("benchmarks.design"), "load", lambda name: None)
    kept = dict.fromkeys(real_cases, SECONDS / WORK_S)
    assert faults(check(real_cases, kept, clock)) == {}
    factor[slowed] = 3.0
    results = check(real_cases, kept, clock)
    name = f"{slowed}: {MEASURED[slowed][0]}"
    assert list(faults(results)) == [name]
    assert results[name].ratio / results[name].kept == pytest.approx(3.0)


# --- what counts as slow ------------------------------------------------------------------------------


def test_a_ratio_up_to_the_limit_is_no_fault(clock):
    cases = {"a": TimedCase(lambda: clock.take(SECONDS))}
    assert faults(check(cases, {"a": SECONDS / WORK_S / (0.99 * LIMIT)}, clock)) == {}
    assert list(faults(check(cases, {"a": SECONDS / WORK_S / (1.01 * LIMIT)}, clock))) == ["a"]


def test_a_machine_that_slows_both_changes_no_ratio(clock, monkeypatch):
    monkeypatch.setattr(_check, "fixed_work", lambda: clock.take(30.0 * WORK_S))
    results = check({"a": TimedCase(lambda: clock.take(30.0 * SECONDS))}, {"a": SECONDS / WORK_S}, clock)
    assert results["a"].ratio == pytest.approx(SECONDS / WORK_S)
    assert faults(results) == {}


def test_a_case_that_was_disturbed_is_measured_again_before_it_is_called_slow(clock):
    calls = iter(range(10**6))
    told: list[str] = []

    def disturbed_at_first() -> float:
        return clock.take(SECONDS * (9.0 if next(calls) <= _check.TURNS else 1.0))

    results = check({"a": TimedCase(disturbed_at_first)}, {"a": SECONDS / WORK_S}, clock, told.append)
    assert "again: a" in told
    assert faults(results) == {}
    assert results["a"].ratio == pytest.approx(SECONDS / WORK_S)


def test_the_least_times_count_and_of_long_cases_the_means_where_they_are_less():
    assert Measurement(case=[0.09, 0.03, 0.2], work=[0.4, 0.1, 0.02]).ratio == pytest.approx(1.5)
    assert Measurement(case=[20.0, 30.0, 25.0], work=[0.5, 0.75, 0.25]).ratio == pytest.approx(50.0)
    assert Measurement(case=[3.0, 1.0, 9.0], work=[1.0, 1.0, 1.0]).ratio == 1.0


def test_of_a_long_case_few_turns_are_taken(clock):
    calls: list[float] = []
    case = TimedCase(lambda: calls.append(clock.take(2.0 * _check.ENOUGH)) or 0.0)
    check({"a": case}, {"a": 2.0 * _check.ENOUGH / WORK_S / 1.5}, clock)
    assert len(calls) == 2  # one to warm


# --- compiling ----------------------------------------------------------------------------------------


def test_the_first_call_is_not_measured(clock):
    calls: list[float] = []
    first = TimedCase(lambda: calls.append(clock.take(SECONDS if calls else 1e3)) or 0.0)
    assert check({"a": first}, {"a": SECONDS / WORK_S}, clock)["a"].ratio == pytest.approx(SECONDS / WORK_S)


def test_a_turn_in_which_a_kernel_is_compiled_is_thrown_away(clock):
    calls: list[int] = []

    def work() -> float:
        calls.append(1)
        if len(calls) == 2:  # the first measured one
            with compiling("kernels.search_peak"):
                clock.take(1e3)
        return clock.take(SECONDS)

    assert check({"a": TimedCase(work)}, {"a": SECONDS / WORK_S}, clock)["a"].ratio == pytest.approx(
        SECONDS / WORK_S
    )


def test_a_case_that_always_compiles_is_a_fault(clock):
    def work() -> float:
        with compiling("kernels.search_peak"):
            return clock.take(SECONDS)

    found = faults(check({"a": TimedCase(work)}, {"a": 1.0}, clock))
    assert "search_peak" in found["a"]


# --- what cannot be compared --------------------------------------------------------------------------


def test_cases_without_a_ratio_and_ratios_without_a_case_and_failures_are_faults(clock):
    cases = {
        "new": TimedCase(lambda: clock.take(SECONDS)),
        "good": TimedCase(lambda: clock.take(SECONDS)),
        "fails": TimedCase(lambda: 1 / 0),
    }
    results = check(cases, {"good": SECONDS / WORK_S, "gone": 1.0, "fails": 1.0}, clock)
    assert set(faults(results)) == {"new", "gone", "fails"}
    told: list[str] = []
    assert verdict_of(results, {}, told.append) == 1
    assert all(any(name in line for line in told) for name in ("new", "gone", "fails"))
    assert verdict_of({"good": results["good"]}, {}, told.append) == 0
    assert verdict_of({}, {}, told.append) == 1  # nothing compared is no success


def test_a_fault_names_case_both_ratios_and_how_many_times_slower(clock):
    results = check({"a": TimedCase(lambda: clock.take(4.0 * WORK_S))}, {"a": 1.0}, clock)
    told: list[str] = []
    assert verdict_of(results, {}, told.append) == 1
    (said,) = [line for line in told if line.startswith("a ")]
    assert all(number in said for number in ("4.00", "ratio 4,", "kept 1"))


def test_a_missing_program_is_a_fault_only_where_nothing_may_be_skipped(clock, monkeypatch):
    cases = {"a": TimedCase(lambda: 1.0, tool="no-such-program"), "b": TimedCase(lambda: clock.take(SECONDS))}
    missing = without_tools(cases)
    assert missing == {"a": "no-such-program"}
    results = check({"b": cases["b"]}, {"b": SECONDS / WORK_S}, clock)
    monkeypatch.delenv("ZWIDTH_NO_SKIPS", raising=False)
    assert verdict_of(results, missing, lambda line: None) == 0
    monkeypatch.setenv("ZWIDTH_NO_SKIPS", "1")
    assert verdict_of(results, missing, lambda line: None) == 1


# --- the kept ratios ----------------------------------------------------------------------------------


def test_ratios_are_kept_a_case_a_line_in_order(clock, tmp_path):
    file = tmp_path / "kept.json"
    cases = {name: TimedCase(lambda n=n: clock.take(SECONDS * n)) for n, name in ((3, "b: x"), (1, "a: x"))}
    write_ratios({"gone: x": [2.0]}, file)
    assert keep(cases, [], lambda line: None, clock, file) == 0
    assert read_kept(file) == {"a: x": 2.4, "b: x": 7.2}
    assert file.read_text().splitlines() == ["{", '"a: x": [2.4],', '"b: x": [7.2]', "}"]
    cases["a: x"] = TimedCase(lambda: clock.take(2.0 * SECONDS))
    cases["b: x"] = TimedCase(lambda: 1 / 0)
    assert keep(cases, ["a: *"], lambda line: None, clock, file) == 0
    assert read_kept(file) == {"a: x": 4.8, "b: x": 7.2}
    assert keep(cases, ["b: *"], lambda line: None, clock, file) == 1
    assert read_kept(file) == {"a: x": 4.8, "b: x": 7.2}


def test_ratios_of_several_processors_stand_beside_each_other_and_their_geometric_mean_is_kept(clock, tmp_path):
    file = tmp_path / "kept.json"
    cases = {"a: x": TimedCase(lambda: clock.take(SECONDS))}
    keep(cases, [], lambda line: None, clock, file, beside=True)
    cases["a: x"] = TimedCase(lambda: clock.take(2.25 * SECONDS))
    keep(cases, [], lambda line: None, clock, file, beside=True)
    assert json.loads(file.read_text()) == {"a: x": [2.4, 5.4]}
    assert read_kept(file) == pytest.approx({"a: x": 3.6})
    assert faults(check(cases, read_kept(file), clock)) == {}
    keep(cases, [], lambda line: None, clock, file)
    assert read_kept(file) == {"a: x": 5.4}


def test_the_repository_keeps_ratios_that_a_check_can_read():
    kept = json.loads(_check.KEPT.read_text(encoding="utf-8"))
    assert list(kept) == sorted(kept)
    assert all(ratio > 0.0 for ratios in kept.values() for ratio in ratios)
    scripts = {path.stem for path in Path(_check.FOLDER).glob("[!_]*.py")}
    assert {name.partition(": ")[0] for name in kept} <= scripts


def test_the_fixed_work_is_the_same_each_time():
    assert fixed_work() == fixed_work()
