"""What holds for every test: no display, no deadlines, and where asked no skips."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import nullcontext

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers
from study_sizes import CASES
from verdict.slowest import slowest_lines

os.environ.setdefault("MPLBACKEND", "Agg")
# Read when NumPy is loaded, which no import above does. Threads for matrices of a few rows take more than twice
# the processor time, and the workers of a test run fight over the cores as it is.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# The same examples in every run, on every machine, whatever an earlier run has found. The first one may compile a
# kernel, and a busy machine draws them slowly.
settings.register_profile(
    "zwidth", derandomize=True, database=None, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("zwidth")
# Hypothesis also draws the constants that it finds in the sources of whatever modules are loaded: its examples
# would hang on unrelated changes and on the order of tests, and every worker would parse a thousand files.
if hasattr(providers, "_get_local_constants"):
    providers._get_local_constants = lambda: providers._local_constants

NO_SKIPS = "ZWIDTH_NO_SKIPS"


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> None:
    """Kernels run on one core in each worker; tests of several threads ask for them."""
    import numba

    numba.set_num_threads(1)


@pytest.fixture(scope="session", autouse=True)
def no_progress_messages() -> Iterator[None]:
    """A command line on a slow machine, or one that has to compile, says no more than another, also where tests
    share what it said. That no command compiles after the set-up is for `make compile-check`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ZWIDTH_QUIET", "1")
        patch.setattr("zwidth.show.cli.command.announce_compiling", lambda command: nullcontext())
        yield


def pytest_report_header() -> list[str]:
    """Say once that the cases outside the repository are not tried."""
    return (
        []
        if os.environ.get(CASES)
        else [f"{CASES} is not set: tests of cases outside the repository are left out"]
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect the tests of cases outside the repository where no folder is named; they count as no skip."""
    if os.environ.get(CASES):
        return
    outside = [item for item in items if item.get_closest_marker("outside_cases")]
    if outside:
        config.hook.pytest_deselected(items=outside)
        items[:] = [item for item in items if not item.get_closest_marker("outside_cases")]


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail a run with skipped tests where ZWIDTH_NO_SKIPS is set: there every tool is installed."""
    skipped = skipped_tests(session.config)
    if skipped and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say why the run failed, and where a long one spent its time."""
    skipped = skipped_tests(config)
    if skipped:
        terminalreporter.section(f"{NO_SKIPS} is set: {len(skipped)} skipped, each counts as a failure", red=True)
    for line in slowest_lines(terminalreporter.stats):
        terminalreporter.write_line(line)


def skipped_tests(config: pytest.Config) -> list[object]:
    """The skips that count as failures; none in a worker process, whose controller counts them."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    return list(reporter.stats.get("skipped", [])) if reporter and os.environ.get(NO_SKIPS) else []
