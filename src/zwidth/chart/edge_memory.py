"""Working memory in which a loop's curve becomes the edge of its stable set, stage by stage.

    samples of the curve -> flags -> corners -> arcs -> rings          (`edge_samples`, `corner`, `edge_arcs`,
    `arcs`)

The caller owns it, kernels fill it and allocate nothing; what does not fit is an overflow, which they report.
Where rounding leaves a question open (a flag, a corner, a piece of a line of real roots) the stage says so by
HIDDEN or OPEN in its place: who asked for one chart answers by eigenvalues and goes on from there; in a batch the
loop is in doubt.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Bytes, Floats, Ints
from zwidth.chart.area import AreaMemory, area_memory
from zwidth.chart.circle_sampling import Features, feature_memory
from zwidth.chart.loop_polynomials import LoopPolynomials, polynomial_memory, work_array
from zwidth.chart.wall_samples import LANES_SIZE
from zwidth.loop.loop_table import CircleFactors, LoopTable, factor_memory

MOST_ARCS: Final = 256
MOST_PIECES: Final = 256  # of the two lines of real roots
MOST_SAMPLES: Final = 4096
# From how many walls a simplex goes down to the fastest-decaying one, and its sizes after each restart, in shares
# of the cell: the spectral radius has edges and cusps in which a single search stalls.
STARTS: Final = 2
SIMPLEX_SIZES: Final = np.array([1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8])
# What becomes of a loop: a stiffest wall; no stable wall with K > 0, B >= 0; to be charted alone, by eigenvalues.
FOUND, NO_WALL, DOUBTFUL = range(3)
# States of a corner.
NONE, SETTLED, OPEN = range(3)
# Places in `EdgeMemory.counts`.
SAMPLES, ARCS, PIECES, RINGS, STOPS, CROSSINGS = range(6)
# Places in `EdgeMemory.size`, in `EdgeMemory.peak` and in `EdgeMemory.fastest`.
EDGE_SIZE, PERIOD = range(2)
PEAK_K, PEAK_B, PEAK_T, PEAK_PARTNER = range(4)
FASTEST_K, FASTEST_B, FASTEST_RADIUS = range(3)
# Rows of `EdgeMemory.picked` where it holds walls of the curve.
T_ROW, K_ROW, B_ROW = range(3)
# Places in `EdgeMemory.numbers`.
LARGEST_DAMPING, AREA = range(2)


class Samples(NamedTuple):
    """Samples of the curve in ascending order, and the corners between them; memory for n.

    t, K, B, flag   (n,)  t = tan(theta/2), the wall, and whether it edges the stable set (`wall_samples`)
    slope_K, slope_B  (n,)  dK/d ln t and dB/d ln t, to some digits: for `curve_refinement`
    corner          (n,)  state of the corner between this sample and the next: NONE where both flags are alike
    corner_t, corner_partner, corner_K, corner_B  (n,)  its t; that of the other root on the circle, 0 or inf for a
    real
                          root; its wall
    """

    t: Floats
    K: Floats
    B: Floats
    slope_K: Floats
    slope_B: Floats
    flag: Bytes
    corner: Bytes
    corner_t: Floats
    corner_partner: Floats
    corner_K: Floats
    corner_B: Floats


class EdgeArcs(NamedTuple):
    """Arcs of the edge; memory for MOST_ARCS.

    kind          (a,)    PAIR, PLUS or MINUS of `arcs`; CHORD where one bridges a gap
    first, last   (a, 2)  their walls [K, B], the stable side on the left from first to last
    start, end    (a,)    t there; 0 or inf for a real root
    samples       (a, 2)  the samples strictly between the ends: index of the first, and behind the last
    extent        (a,)    largest distance of its walls from its first, in K T and B; inf for a CHORD
    node          (a, 2)  numbers of the corners that it begins and ends in
    order         (a,)    arcs ring after ring
    next_arc      (a,)    the arc after each; -1 for one that is no more than a corner, less while they are joined
    """

    kind: Bytes
    first: Floats
    last: Floats
    start: Floats
    end: Floats
    samples: Ints
    extent: Floats
    node: Ints
    order: Ints
    next_arc: Ints


class LinePieces(NamedTuple):
    """Pieces of the lines of real roots between places where another root meets the circle.

    root   (p,)    PLUS or MINUS
    ends   (p, 4)  walls K, B at both ends, the stable side on the left
    flag   (p,)    whether it edges the stable set
    nodes  (p, 3)  working memory: K, B and place along the line
    crossing_t  (p,)  t at which the curve crosses one of the lines
    """

    root: Bytes
    ends: Floats
    flag: Bytes
    nodes: Floats
    crossing_t: Floats


class DecaySearch(NamedTuple):
    """Working memory of the search for the fastest-decaying wall (`decay_search`).

    starts   (s, 3)  walls K, B from which a simplex goes down, and their spectral radii
    simplex  (3, 3)  K, B and radius of its corners
    extent   (2,)    of the edge in K and B
    least    (2,)    least K and B: none
    sizes    (r,)    of the simplex after each restart, in shares of the extent
    """

    starts: Floats
    simplex: Floats
    extent: Floats
    least: Floats
    sizes: Floats


class EdgeMemory(NamedTuple):
    """Working memory for one loop after the other.

    circle, polynomials, features  of the loop on the circle
    lanes   working memory of `wall_samples`;   room  of `loop_polynomials`
    counts  (6,)  samples, arcs, pieces, rings, stops and crossings of lines in use
    size    (2,)  largest |K T|, |B| of the whole edge, and T
    picked  (4, n), (n,), (n,)  working memory: of samples that are flagged t, K and B, number, flag; of pieces of
                                the curve the least and largest K and B
    peak    (4,)  the stiffest wall so far: stiffness, damping and t of both roots on the circle
    stops   (s,)  dampings at which the edge meets K = 0
    numbers (2,)  largest damping and area
    fastest (3,)  the fastest-decaying wall so far: stiffness, damping, spectral radius
    double_root  (2,)  wall of the double root that was tried last
    """

    circle: CircleFactors
    polynomials: LoopPolynomials
    features: Features
    lanes: Floats
    room: Floats
    samples: Samples
    arcs: EdgeArcs
    pieces: LinePieces
    counts: Ints
    size: Floats
    picked: Floats
    picked_number: Ints
    picked_flag: Bytes
    peak: Floats
    stops: Floats
    numbers: Floats
    fastest: Floats
    double_root: Floats
    search: DecaySearch
    area: AreaMemory


def edge_memory(loops: LoopTable, most_degree: int, most_samples: int) -> EdgeMemory:
    """Working memory for any one of these loops, up to a degree and a number of samples."""
    n, a, p = most_samples + 2, MOST_ARCS, MOST_PIECES
    return EdgeMemory(
        circle=factor_memory(loops),
        polynomials=polynomial_memory(most_degree),
        features=feature_memory(most_degree, loops.window.shape[1]),
        lanes=np.empty(LANES_SIZE),
        room=work_array(most_degree),
        samples=Samples(
            t=np.empty(n),
            K=np.empty(n),
            B=np.empty(n),
            slope_K=np.empty(n),
            slope_B=np.empty(n),
            flag=np.empty(n, np.int8),
            corner=np.empty(n, np.int8),
            corner_t=np.empty(n),
            corner_partner=np.empty(n),
            corner_K=np.empty(n),
            corner_B=np.empty(n),
        ),
        arcs=EdgeArcs(
            kind=np.empty(a, np.int8),
            first=np.empty((a, 2)),
            last=np.empty((a, 2)),
            start=np.empty(a),
            end=np.empty(a),
            samples=np.empty((a, 2), np.int64),
            extent=np.empty(a),
            node=np.empty((a, 2), np.int64),
            order=np.empty(a, np.int64),
            next_arc=np.empty(a, np.int64),
        ),
        pieces=LinePieces(
            np.empty(p, np.int8), np.empty((p, 4)), np.empty(p, np.int8), np.empty((p, 3)), np.empty(2 * p)
        ),
        counts=np.zeros(6, np.int64),
        size=np.zeros(2),
        picked=np.empty((4, n)),
        picked_number=np.empty(n, np.int64),
        picked_flag=np.empty(n, np.int8),
        peak=np.empty(4),
        stops=np.empty(2 * MOST_ARCS),
        numbers=np.empty(2),
        fastest=np.empty(3),
        double_root=np.empty(2),
        search=DecaySearch(
            starts=np.empty((STARTS, 3)),
            simplex=np.empty((3, 3)),
            extent=np.empty(2),
            least=np.full(2, -np.inf),
            sizes=SIMPLEX_SIZES.copy(),
        ),
        area=area_memory(),
    )
