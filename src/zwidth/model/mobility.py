"""Check that each degree of freedom has a drive or is said to be free, and that the handle shows the drives."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.compiled import compiled
from zwidth.model.closure import equations
from zwidth.model.continuation import ASSEMBLY_TOLERANCE, assemble_batch, set_goal
from zwidth.model.forward_kinematics import place_links, working_memory
from zwidth.model.mechanism import POSE, PRISMATIC, Mechanism
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
    misfit = _misfit(mechanism, mech, _ranks_near(mech, np.array([design]), reference[None])[0])
    if misfit is None:
        return None
    rng = np.random.default_rng(1)
    far = rng.uniform(-np.pi, np.pi, (ELSEWHERE, reference.size)) * _unit_of_links(mech, design)
    designs = np.full(ELSEWHERE, design)
    angles, closed = _closed_configurations(mech, designs, far)
    elsewhere = _ranks(mech, designs[closed], angles[closed])
    if all(_misfit(mechanism, mech, ranks) for ranks in elsewhere):
        raise ValueError(f"{misfit.reason}; {misfit.advice}")
    return misfit.reason


def drives_fit(mechanism: Mechanism, mech: MechanismArrays, designs: Ints, references: Floats) -> Flags:
    """Of which of N designs, each at a reference (N, n), the drives control the handle, (N,): `check_mobility`."""
    kinds, kind_of = np.unique(_ranks_near(mech, designs, references), axis=0, return_inverse=True)
    fit = np.array([_misfit(mechanism, mech, ranks) is None for ranks in kinds], dtype=np.bool_)
    return fit[kind_of.ravel()]


def _ranks_near(mech: MechanismArrays, designs: Ints, references: Floats) -> Ints:
    """The largest `_ranks` of N designs at references (N, n) and at closed configurations near them."""
    ranks = _ranks(mech, designs, references)
    rng = np.random.default_rng(0)
    for turn in NEARBY * rng.uniform(-1.0, 1.0, (2, mech.parent.size)):
        angles, closed = _closed_configurations(mech, designs, references + turn * _unit_of_links(mech, designs))
        ranks[closed] = np.maximum(ranks[closed], _ranks(mech, designs[closed], angles[closed]))
    return ranks


def _unit_of_links(mech: MechanismArrays, designs: int | Ints) -> Floats:
    """The unit of each link's joint coordinate, (..., n): 1 rad, or the size of the mechanism [m]."""
    return np.asarray(np.where(mech.kind == PRISMATIC, mech.size[designs, None], 1.0))


def _closed_configurations(mech: MechanismArrays, designs: Ints, rough: Floats) -> tuple[Floats, Flags]:
    """Configurations of N designs from rough angles (N, n), the handle going where it must; and whether their
    loops are closed."""
    angles = np.zeros_like(rough)
    angles[:, mech.joint] = rough[:, mech.joint]
    gaps = np.zeros((len(angles), mech.a.size))
    assemble_batch(mech, designs, angles, gaps)
    return angles, gaps.max(axis=1, initial=0.0) <= ASSEMBLY_TOLERANCE * mech.size[designs]


def _misfit(mechanism: Mechanism, mech: MechanismArrays, ranks: Ints) -> Misfit | None:
    m, independent = mech.joint.size, mech.driven + mech.free
    of_loops, of_passive, of_all = ranks
    freedom = m - of_loops
    if freedom != independent:
        free = f" and {mech.free} free coordinate{'s' * (mech.free != 1)}" if mech.free else ""
        return Misfit(
            f"the mechanism has {freedom} degrees of freedom but {mech.driven} drives{free}",
            "give it as many drives, declare the joints that nobody drives free, or check its joints and loops",
        )
    if of_passive < m - independent:
        driven = ", ".join(mechanism.drives.names)
        return Misfit(f"the driven joints {driven} do not determine the other joints", "drive other joints")
    if of_all < m - mech.free:
        return Misfit(
            f"the handle on link {mechanism.links.names[mech.handle_link]!r} can rest while the drives move: "
            "its position does not determine the posture",
            "place it on another link or take a drive away",
        )
    return None


def _ranks(mech: MechanismArrays, designs: Ints, angles: Floats) -> Ints:
    """Ranks (N, 3) of the `constraints` of N designs at joint coordinates (N, n): of all joints on the loops, of
    the passive joints on the loops, of all joints but the free ones on loops and handle."""
    m, loops, moved = mech.joint.size, int(mech.first_row[-1]), mech.joint.size - mech.free
    passive, goal = moved - mech.driven, np.zeros(6 if mech.controls == POSE else 3)
    rows = np.empty((len(designs), m, loops + len(goal)))
    for i, design in enumerate(designs):
        rows[i] = constraints(mech, design, angles[i], goal)[0] * mech.unit[design, :, None]
    parts = rows[:, :, :loops], rows[:, :passive, :loops], rows[:, :moved]
    return np.stack([_rank(part, mech.size[designs]) for part in parts], axis=1)


@compiled
def constraints(mech: MechanismArrays, design: int, angles: Floats, goal: Floats) -> tuple[Floats, Floats]:
    """d(closure gaps, handle)/d(unknowns), (m, r), passive joints first; and the gaps of the loops, then those of
    the handle to a goal (g,), all negated, (r,) [m]."""
    work = working_memory(mech)
    set_goal(mech, goal.reshape((1, -1)), 0, work)
    place_links(mech, design, angles, work)
    equations(mech, design, work)
    return work.rows, work.gaps


def _rank(rows: Floats, sizes: Floats) -> Ints:
    """Of matrices (N, i, j), of mechanisms of these sizes (N,)."""
    if 0 in rows.shape:
        return np.zeros(len(rows), dtype=np.int64)
    values = np.linalg.svd(rows, compute_uv=False)
    return np.asarray((values > NEGLIGIBLE * sizes[:, None]).sum(axis=1))
