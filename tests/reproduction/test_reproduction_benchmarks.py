"""The benchmarks' peers answer the same question: on a small grid they agree with the exact chart."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import _peers, _timing, commands
from benchmarks import chart as benchmark
from zwidth.chart import stability_chart

COUNT = 15


@pytest.fixture(scope="module")
def setting():
    loop = benchmark.fresh_loop()
    chart = stability_chart(loop, decay=False)
    return loop, chart, *benchmark.grid_axes(chart, COUNT)


@pytest.mark.filterwarnings("default")  # python-control warns of its own future
@pytest.mark.parametrize(
    ("peer", "options"),
    [
        (_peers.by_eigenvalues, {}),
        (_peers.by_python_control, {"tuned": False}),
        (_peers.by_python_control, {"tuned": True}),
    ],
)
def test_a_peer_agrees_with_the_chart(setting, peer, options):
    loop, chart, K, B = setting
    stable = peer(loop.plant, loop.period, K[None, :], B[:, None], **options)
    assert 0 < stable.sum() < stable.size
    assert benchmark.disagreements(chart, K, B, stable) == 0


def test_the_jury_raster_agrees_with_the_chart(setting):
    loop, chart, K, B = setting
    stable = _peers.by_jury(loop.plant, loop.period, K, B)
    assert benchmark.disagreements(chart, K, B, stable) == 0


def test_a_wrong_answer_is_noticed(setting):
    _, chart, K, B = setting
    right = np.zeros((COUNT, COUNT), dtype=bool)
    right[:] = chart.check(*np.meshgrid(K, B)).verdict == 1
    assert benchmark.disagreements(chart, K, B, right) == 0
    right[COUNT // 2, COUNT // 4] ^= True
    assert benchmark.disagreements(chart, K, B, right) == 1


def test_boundary_points_are_on_the_circle(setting):
    assert benchmark.boundary_error(setting[0], 50) < 1e-9


def test_times_read_well(capsys):
    assert [_timing.seconds(value) for value in (2.5, 0.0023, 1.5e-5)] == ["2.5 s", "2.3 ms", "15 µs"]
    calls: list[int] = []
    assert _timing.median_time(lambda: calls.append(1), repeats=3, warm=2) >= 0.0
    assert len(calls) == 5
    _timing.print_table(("a", "b"), [("long cell", "c")])
    assert capsys.readouterr().out.splitlines()[2] == "long cell  c"


def test_the_commands_timed_exist():
    from zwidth.show.cli.main import main

    assert {line[0] for line in commands.TARGETS} == {"--help", "chart"}
    assert callable(main)
