"""Do the drives fit the mechanism: one for each degree of freedom, and the handle shows them all?"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.compiled import compiled
from zwidth.model.arrays import Arrays
from zwidth.model.closure import equations
from zwidth.model.continuation import assemble_batch
from zwidth.model.mechanism import Floats, Mechanism
from zwidth.model.tree import place, workspace

NEGLIGIBLE: Final = 1e-6  # singular values below this part of the mechanism's size count as zero
NEARBY: Final = 0.05  # how far the joints turn to configurations that are not special [rad]


def check_mobility(mechanism: Mechanism, mech: Arrays, design: int, reference: Floats) -> None:
    """Raise ValueError where the drives do not fit the mechanism.

    A rank is judged at closed configurations near the reference (n,) and the largest counts: the reference
    may be special, and rows that are independent off the loops' manifold may not be on it.
    """
    rng = np.random.default_rng(0)
    closed = [reference, *(nearby(mech, design, reference, rng) for _ in range(2))]
    rows = [constraint_rows(mech, design, angles) for angles in closed]
    m, d, loops = mech.joint.size, mech.driven, 3 * mech.a.size
    size = float(mech.size[design])
    freedom = m - max(_rank(A[:, :loops], size) for A in rows)
    if freedom != d:
        raise ValueError(
            f"the mechanism has {freedom} degrees of freedom but {d} drives; give it as many drives, "
            "or check its joints and loops"
        )
    if max(_rank(A[: m - d, :loops], size) for A in rows) < m - d:
        raise ValueError(
            f"the driven joints {', '.join(mechanism.drives.names)} do not determine the other joints; "
            "drive other joints"
        )
    if max(_rank(A, size) for A in rows) < m:
        raise ValueError(
            f"the handle on link {mechanism.links.names[mech.handle_link]!r} can rest while the drives move: "
            "its position does not determine the posture; place it on another link or take a drive away"
        )


def nearby(mech: Arrays, design: int, reference: Floats, rng: np.random.Generator) -> Floats:
    """A closed configuration a little way from the reference, in a random direction."""
    angles = reference.copy()
    angles[mech.joint] += NEARBY * rng.uniform(-1.0, 1.0, mech.joint.size)
    gaps = np.zeros((1, mech.a.size))
    assemble_batch(mech, np.array([design]), np.zeros((1, 3)), False, angles[None], gaps)
    return angles


@compiled
def constraint_rows(mech: Arrays, design: int, angles: Floats) -> Floats:
    """d(closure gaps, handle)/d(unknowns), (m, 3k+3), passive joints first."""
    work = workspace(mech)
    place(mech, design, angles, work)
    equations(mech, design, work.goal, work)
    return work.rows


def _rank(rows: Floats, size: float) -> int:
    if 0 in rows.shape:
        return 0
    return int(np.sum(np.linalg.svd(rows, compute_uv=False) > NEGLIGIBLE * size))
