"""From a loop to flagged samples of its curve: the first stage of its edge (`edge_memory`)."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.chart.circle_sampling import (
    add_samples_around_crossings,
    fill_computer_features,
    fill_features,
    fill_samples,
)
from zwidth.chart.curve_refinement import refine_samples
from zwidth.chart.edge_memory import B_ROW, CROSSINGS, K_ROW, NONE, PERIOD, SAMPLES, SETTLED, T_ROW, EdgeMemory
from zwidth.chart.loop_polynomials import (
    edges_stable_set,
    fill_computer_polynomials,
    fill_loop_polynomials,
    fill_polynomials,
)
from zwidth.chart.wall_samples import UNKNOWN, flag_walls, walls_of_samples
from zwidth.compiled import compiled_apart, compiled_lean
from zwidth.loop.loop_table import (
    COMPUTER,
    DEGREE,
    FORCE,
    VELOCITY,
    WHOLE_DELAY,
    WINDOW,
    LoopTable,
    fill_computer,
    fill_plant,
    wall_on_circle,
)

# Steps along the curve for a whole edge, in shares of the distance to its nearest singularity, and the longest.
SHARE: Final = 0.2
LONGEST: Final = 0.05
BESIDE: Final = 1e-6  # share of t over which slopes are taken
CLOSEST: Final = 1e-9  # share of t within which two places on the curve are one


@compiled_lean
def fill_loop(loops: LoopTable, i: int, radius: float, memory: EdgeMemory) -> None:
    """Fill in the factors, polynomials and singular points of loop i on |z| = radius. What its computer alone
    decides is kept from the loop before, if that has the same one and was filled in for the same circle."""
    circle, computer = memory.circle, loops.computer[i]
    if circle.sizes[COMPUTER] != computer or circle.radius[0] != radius:
        fill_computer(loops, computer, radius, circle)
        fill_computer_polynomials(circle, memory.polynomials)
        fill_computer_features(circle, memory.features)
    fill_plant(loops, i, circle)
    fill_polynomials(circle, memory.polynomials)
    fill_features(circle, memory.polynomials, memory.features)
    memory.size[PERIOD] = loops.period[computer]


@compiled_lean
def fill_without_singularities(loops: LoopTable, i: int, radius: float, memory: EdgeMemory) -> None:
    """Fill in the factors and polynomials of loop i on |z| = radius, without its singular points."""
    fill_loop_polynomials(loops, i, radius, memory.circle, memory.polynomials)
    memory.circle.sizes[COMPUTER] = -1  # so that the next loop fills in its singular points


@compiled_apart
def fill_curve(memory: EdgeMemory, share: float, longest: float, near_end: float) -> bool:
    """Put samples of the curve with their walls, not yet flagged, into memory; False where it is full, or there
    are fewer than two.

    share, longest, near_end  as for `circle_sampling.fill_samples`
    """
    circle = memory.circle
    sizes, t = circle.sizes, memory.samples.t
    # past samples that the loop uses: a delay of n samples turns n times as fast as z, by half a radian a step
    late = sizes[WHOLE_DELAY] + sizes[WINDOW]
    n = fill_samples(memory.features, circle.radius[0], share, min(longest, 0.5 / late), near_end, t)
    # a plain backward difference is nowhere blind
    if 2 <= n < len(t) and (sizes[WINDOW] > 1 or sizes[VELOCITY] > 1 or sizes[FORCE] > 0):
        n = add_samples_around_crossings(circle, n, t)
    memory.counts[SAMPLES] = n
    if not 2 <= n < len(t):
        return False
    walls_again(memory)
    return refine_samples(memory)


@compiled_apart
def add_samples_between_corners(memory: EdgeMemory) -> bool:
    """Add a sample to each piece of the curve between two neighbouring corners, or crossings of the lines, that
    has none; False where there is no such piece, or memory is full.

    An arc may lie between two samples. Its ends are then known nevertheless, from the other arcs that end there.
    """
    # places: t of corners and crossings, new: t of the samples to be added, both in free memory
    samples, places, new, n = memory.samples, memory.picked[0], memory.picked[1], memory.counts[SAMPLES]
    m, most = 0, len(places)
    for i in range(n - 1):
        if samples.corner[i] == SETTLED and m + 2 < most:
            places[m], places[m + 1] = samples.corner_t[i], samples.corner_partner[i]
            m += 2
    for k in range(min(memory.counts[CROSSINGS], most - m)):
        places[m] = memory.pieces.crossing_t[k]
        m += 1
    # insertion sort: there are few places, and nothing is allocated
    for k in range(1, m):
        place, i = places[k], k
        while i > 0 and places[i - 1] > place:
            places[i] = places[i - 1]
            i -= 1
        places[i] = place
    added, i = 0, 0
    for k in range(m - 1):
        low, high = places[k], places[k + 1]
        while i < n and samples.t[i] <= low:
            i += 1
        between = i < n and samples.t[i] < high
        if not between and low > 0.0 and np.isfinite(high) and high > low * (1.0 + CLOSEST):
            new[added] = 0.5 * (low + high)
            added += 1
    if added == 0 or n + added >= len(samples.t):
        return False
    # both lists ascend: merged in place from the end
    i, k = n - 1, added - 1
    for place in range(n + added - 1, -1, -1):
        if k >= 0 and (i < 0 or new[k] > samples.t[i]):
            samples.t[place] = new[k]
            k -= 1
        else:
            samples.t[place] = samples.t[i]
            i -= 1
    memory.counts[SAMPLES] = n + added
    walls_again(memory)
    return refine_samples(memory)


@compiled_lean
def add_sample(memory: EdgeMemory, t: float) -> bool:
    """Add the sample at t = tan(theta/2) in its order; False where memory is full."""
    samples, n = memory.samples, memory.counts[SAMPLES]
    if n + 1 >= len(samples.t):
        return False
    i = n
    while i > 0 and samples.t[i - 1] > t:
        samples.t[i] = samples.t[i - 1]
        i -= 1
    samples.t[i] = t
    memory.counts[SAMPLES] = n + 1
    walls_again(memory)
    return refine_samples(memory)


@compiled_lean
def walls_again(memory: EdgeMemory) -> None:
    """Compute K, B and slopes of all samples from their t; flags and corners are then unknown."""
    samples, beside, n = memory.samples, memory.picked, memory.counts[SAMPLES]
    walls_of_samples(memory.circle, samples.t, n, samples.K, samples.B, memory.lanes)
    for i in range(n):
        beside[T_ROW, i] = samples.t[i] * (1.0 + BESIDE)
    walls_of_samples(memory.circle, beside[T_ROW], n, beside[K_ROW], beside[B_ROW], memory.lanes)
    # slopes per ln t, by differences with walls beside: refining needs no more digits
    for i in range(n):
        samples.slope_K[i] = (beside[K_ROW, i] - samples.K[i]) * (1.0 / BESIDE)
    for i in range(n):
        samples.slope_B[i] = (beside[B_ROW, i] - samples.B[i]) * (1.0 / BESIDE)
    for i in range(n):
        samples.flag[i], samples.corner[i] = UNKNOWN, NONE


@compiled_lean
def flag_all(memory: EdgeMemory) -> None:
    """Flag every sample: EDGE, NO_EDGE, or HIDDEN where rounding leaves it open."""
    samples, n = memory.samples, memory.counts[SAMPLES]
    flag_walls(
        memory.polynomials.coefficients,
        memory.circle.sizes[DEGREE],
        n,
        samples.t,
        samples.K,
        samples.B,
        samples.flag,
        memory.lanes,
        memory.room,
    )


@compiled_lean
def flag_quadrant(memory: EdgeMemory) -> None:
    """Flag the samples with K > 0 and B >= 0, and their neighbours; all others stay UNKNOWN."""
    samples, n = memory.samples, memory.counts[SAMPLES]
    K, B, picked, number = samples.K, samples.B, memory.picked, memory.picked_number
    # before, here, after: whether the sample before this one, it and the next one are in the quadrant
    m, before, here = 0, False, K[0] > 0.0 and B[0] >= 0.0
    for i in range(n):
        after = i < n - 1 and K[i + 1] > 0.0 and B[i + 1] >= 0.0
        if before or here or after:
            number[m], picked[T_ROW, m], picked[K_ROW, m], picked[B_ROW, m] = i, samples.t[i], K[i], B[i]
            m += 1
        before, here = here, after
    flag_walls(
        memory.polynomials.coefficients,
        memory.circle.sizes[DEGREE],
        m,
        picked[T_ROW],
        picked[K_ROW],
        picked[B_ROW],
        memory.picked_flag,
        memory.lanes,
        memory.room,
    )
    for k in range(m):
        samples.flag[number[k]] = memory.picked_flag[k]


@compiled_apart
def edge_flag(memory: EdgeMemory, t: float) -> int:
    """Flag (EDGE, NO_EDGE, HIDDEN) of the wall on the curve at one t = tan(theta/2)."""
    K, B = wall_on_circle(memory.circle, t)
    return edges_stable_set(memory.polynomials.coefficients, memory.circle.sizes[DEGREE], t, K, B, memory.room)


@compiled_lean
def degree_of(loops: LoopTable, i: int) -> int:
    """Degree of a loop's characteristic polynomial."""
    c = loops.computer[i]
    # an estimate from so many samples has one root less than these
    N = 2 * loops.section_count[i] + loops.whole_delay[c] + loops.split[c] + loops.window_count[c] - 1
    # a factor of the computer whose denominator has d2 = 0 is of first order
    for k in range(loops.force_count[c]):
        N += 2 if loops.force[c, k, 3] != 0.0 else 1
    for k in range(loops.velocity_count[c]):
        N += 2 if loops.velocity[c, k, 3] != 0.0 else 1
    return int(N)
