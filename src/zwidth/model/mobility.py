"""Check that there is one drive for each degree of freedom, and that the handle shows them all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from zwidth.compiled import compiled
from zwidth.model.closure import equations
from zwidth.model.continuation import ASSEMBLY_TOLERANCE, assemble_batch
from zwidth.model.forward_kinematics import place_links, working_memory
from zwidth.model.mechanism import Floats, Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays

NEGLIGIBLE: Final = 1e-6  # singular values below this part of the mechanism's size count as zero
NEARBY: Final = 0.05  # how far the joints turn to configurations that are not special [rad]
ELSEWHERE: Final = 16  # configurations tried all over the joints' turns


class Misfit(NamedTuple):
    """Why the drives do not fit, and what to do about it where they fit nowhere."""

    reason: str
    advice: str


def check_mobility(mechanism: Mechanism, mech: MechanismArrays, design: int, reference: Floats) -> str | None:
    """Why the assembly of the reference (n,) is singular throughout; None where its drives control the handle.

    A rank is judged at closed configurations near the reference and the largest counts: the reference may be
    special, and rows that are independent off the loops' manifold may not be on it. Drives that do not fit
    there may still fit the mechanism: arms that lie one on the other move as one in one assembly and apart
    in another. That is a place without an answer, and no fault of the mechanism.

    Raises  ValueError  where the drives fit the mechanism in no configuration
    """
    rng = np.random.default_rng(0)
    near = reference + NEARBY * rng.uniform(-1.0, 1.0, (2, reference.size))
    misfit = _misfit(mechanism, mech, design, [reference, *closed_configurations(mech, design, near)])
    if misfit is None:
        return None
    far = rng.uniform(-np.pi, np.pi, (ELSEWHERE, reference.size))
    if all(_misfit(mechanism, mech, design, [angles]) for angles in closed_configurations(mech, design, far)):
        raise ValueError(f"{misfit.reason}; {misfit.advice}")
    return misfit.reason


def closed_configurations(mech: MechanismArrays, design: int, rough: Floats) -> Floats:
    """Configurations (k, n) with closed loops from rough angles (N, n), k <= N; the handle goes where it must."""
    angles = np.zeros_like(rough)
    angles[:, mech.joint] = rough[:, mech.joint]
    gaps = np.zeros((len(angles), mech.a.size))
    goals = np.zeros((len(angles), 3))
    assemble_batch(mech, np.full(len(angles), design), goals, False, angles, gaps)
    closed: Floats = angles[gaps.max(axis=1, initial=0.0) <= ASSEMBLY_TOLERANCE * mech.size[design]]
    return closed


def _misfit(
    mechanism: Mechanism, mech: MechanismArrays, design: int, configurations: Sequence[Floats]
) -> Misfit | None:
    rows = [constraints(mech, design, angles)[0] for angles in configurations]
    m, d, loops = mech.joint.size, mech.driven, 3 * mech.a.size
    size = float(mech.size[design])
    freedom = m - max(_rank(A[:, :loops], size) for A in rows)
    if freedom != d:
        return Misfit(
            f"the mechanism has {freedom} degrees of freedom but {d} drives",
            "give it as many drives, or check its joints and loops",
        )
    if max(_rank(A[: m - d, :loops], size) for A in rows) < m - d:
        driven = ", ".join(mechanism.drives.names)
        return Misfit(f"the driven joints {driven} do not determine the other joints", "drive other joints")
    if max(_rank(A, size) for A in rows) < m:
        return Misfit(
            f"the handle on link {mechanism.links.names[mech.handle_link]!r} can rest while the drives move: "
            "its position does not determine the posture",
            "place it on another link or take a drive away",
        )
    return None


@compiled
def constraints(mech: MechanismArrays, design: int, angles: Floats) -> tuple[Floats, Floats]:
    """d(closure gaps, handle)/d(unknowns), (m, 3k+3), passive joints first; and the gaps of the loops, then the
    handle's position, both negated, (3k+3,) [m]."""
    work = working_memory(mech)
    place_links(mech, design, angles, work)
    equations(mech, design, work.goal, work)
    return work.rows, work.gaps


def _rank(rows: Floats, size: float) -> int:
    if 0 in rows.shape:
        return 0
    return int(np.sum(np.linalg.svd(rows, compute_uv=False) > NEGLIGIBLE * size))
