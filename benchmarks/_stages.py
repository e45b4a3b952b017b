"""What each stage of the largest stiffness costs, by repeating it alone in a compiled loop."""

from __future__ import annotations

from time import perf_counter
from typing import Any

from zwidth.chart import MOST_DEGREE, peak_search
from zwidth.chart.circle_sampling import fill_computer_features, fill_features, fill_samples
from zwidth.chart.curve_refinement import refine_samples
from zwidth.chart.edge_memory import MOST_SAMPLES, SAMPLES, EdgeMemory, edge_memory
from zwidth.chart.edge_samples import fill_curve, fill_loop, flag_quadrant
from zwidth.chart.loop_polynomials import fill_computer_polynomials, fill_polynomials
from zwidth.chart.peak_search import NEAR_END, WIDE_SHARE, WIDE_STEP, search_peak
from zwidth.chart.wall_samples import walls_of_samples
from zwidth.compiled import compiled
from zwidth.loop.loop_table import COMPUTER, LoopTable, fill_computer, fill_plant

# In the order of the computation, and whether the stage only checks or decides what another has found.
STAGES = (
    ("factors of plant and computer", False),
    ("polynomials", False),
    ("singular points of the curve", False),
    ("places to sample", False),
    ("walls there", False),
    ("check: what the curve does between them", True),
    ("which are on the edge", False),
    ("check: does the edge go on from a corner", True),
    ("check: edges of real roots", True),
    ("check: stiffer crossings and maxima", True),
    ("all, from the plant to the stiffest wall", False),
)
REPEATS = 10
_edge_goes_on, _has_stiffer_line = peak_search._edge_goes_on, peak_search._has_stiffer_line
_has_stiffer_turn = peak_search._has_stiffer_turn


def _repeater(stage: int) -> Any:
    """A kernel that carries out one stage `times` times for each loop, after the stages before it."""

    @compiled
    def repeat(loops: LoopTable, memory: EdgeMemory, times: int) -> None:
        memory.circle.sizes[COMPUTER] = -1
        circle, features, samples = memory.circle, memory.features, memory.samples
        for i in range(len(loops.section_count)):
            computer = loops.computer[i]
            fill_loop(loops, i, 1.0, memory)
            fill_curve(memory, WIDE_SHARE, WIDE_STEP, NEAR_END)
            search_peak(memory)
            for _ in range(times):
                if stage == 0:
                    fill_computer(loops, computer, 1.0, circle)
                    fill_plant(loops, i, circle)
                elif stage == 1:
                    fill_computer_polynomials(circle, memory.polynomials)
                    fill_polynomials(circle, memory.polynomials)
                elif stage == 2:
                    fill_computer_features(circle, features)
                    fill_features(circle, memory.polynomials, features)
                elif stage == 3:
                    fill_samples(features, 1.0, WIDE_SHARE, WIDE_STEP, NEAR_END, samples.t)
                elif stage == 4:
                    walls_of_samples(circle, samples.t, memory.counts[SAMPLES], samples.K, samples.B, memory.lanes)
                elif stage == 5:
                    refine_samples(memory)
                elif stage == 6:
                    flag_quadrant(memory)
                elif stage == 7:
                    _edge_goes_on(memory)
                elif stage == 8:
                    _has_stiffer_line(memory)
                elif stage == 9:
                    _has_stiffer_turn(memory)
                else:
                    memory.circle.sizes[COMPUTER] = -1
                    fill_loop(loops, i, 1.0, memory)
                    search_peak(memory)

    return repeat


def stage_times(loops: LoopTable) -> list[tuple[str, bool, float]]:
    """Each stage, whether it is a check, and its seconds for a loop on one core."""
    memory = edge_memory(loops, MOST_DEGREE, MOST_SAMPLES)

    def least(repeat: Any, times: int) -> float:
        taken = []
        for _ in range(7):
            began = perf_counter()
            repeat(loops, memory, times)
            taken.append(perf_counter() - began)
        return min(taken)

    found, count = [], len(loops.section_count) * REPEATS
    for stage, (name, check) in enumerate(STAGES):
        repeat = _repeater(stage)
        repeat(loops, memory, 1)
        found.append((name, check, max(0.0, (least(repeat, REPEATS + 1) - least(repeat, 1)) / count)))
    return found
