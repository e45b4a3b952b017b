"""Whether walls are unstable for a loop, and how much softer a wall must be to be stable."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.hurwitz import is_stable, work_array
from zwidth.compiled import compiled

Floats = NDArray[np.float64]


@compiled
def unstable(polynomials: Floats, K: Floats, B: Floats) -> NDArray[np.bool_]:
    """Which walls (k,) are certainly unstable for a loop, given by `Tracer.polynomials`."""
    out = np.empty(len(K), dtype=np.bool_)
    N = polynomials.shape[1] - 1
    room = work_array(N)
    for i in range(len(K)):
        out[i] = is_stable(polynomials, N, K[i], B[i], room) < 0
    return out


@compiled
def softening(polynomials: Floats, K: float, B: float) -> float:
    """By how much [N/m] an unstable wall must be softened at its damping until it is stable; K itself if no
    softer wall is.

    The next stable stiffness below is looked for in steps that grow by a quarter from 1e-8 of K, then bisected.
    """
    N = polynomials.shape[1] - 1
    room = work_array(N)
    bad, step = 0.0, 1e-8
    while True:
        good = min(bad + step, 1.0)
        if good >= 1.0:
            return K
        if is_stable(polynomials, N, K * (1.0 - good), B, room) > 0:
            break
        bad = good
        step = 0.25 * bad
    for _ in range(40):
        middle = 0.5 * (bad + good)
        if is_stable(polynomials, N, K * (1.0 - middle), B, room) > 0:
            good = middle
        else:
            bad = middle
    return K * good
