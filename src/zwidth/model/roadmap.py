"""All postures of an assembly, coarsely: a flood from the reference posture through the driven coordinates.

A straight way from the reference to a goal may be blocked although the goal can be reached: a device with
coincident base axes has a hole in the middle of its workspace. The flood goes round, because every node is
reached from a neighbour one small turn of one drive away, closing the loops again and never passing a
singularity. Newton then starts from the node nearest to the goal, which is also what makes batches fast.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from zwidth.compiled import compiled, compiled_lean
from zwidth.model.closure import closure_step, equations, newton_step, orientation, passive_rates
from zwidth.model.continuation import CONTRACTION, LARGEST_TURN, SINGULAR_CONDITION, largest_magnitude
from zwidth.model.forward_kinematics import WorkingMemory, link_point, place_links, working_memory
from zwidth.model.mechanism import Floats, Ints
from zwidth.model.mechanism_arrays import MechanismArrays

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

TURNS: Final = {1: 256, 2: 96, 3: 32}  # nodes per turn of a drive, by number of drives
MARGIN: Final = 1.0  # smallest reciprocal condition of a node, per radian of a step
CELLS: Final = 40_000  # of the grid that finds the nearest node


@dataclass(frozen=True)
class Roadmap:
    """Postures joined with the reference by paths free of singularities.

    angles    (K, n)  joint angles; the reference is node 0
    position  (K, 3)  handle [m]
    nearest   (cells,)  node nearest to the centre of each cell of a grid over the handle's positions
    low, pitch, counts  (3,)  that grid: lower corner [m], cell size [m], cells per axis
    """

    angles: Floats
    position: Floats
    nearest: Ints
    low: Floats
    pitch: Floats
    counts: Ints
    search: cKDTree

    def node_of_cell(self, target: Floats) -> Ints:
        """Node near each target (N, 3): that of its cell, in constant time."""
        finite = np.nan_to_num((target - self.low) / self.pitch, nan=0.0, posinf=0.0, neginf=0.0)
        cell = np.clip(finite, 0, self.counts - 1).astype(np.int64)
        nodes: Ints = self.nearest[(cell[:, 0] * self.counts[1] + cell[:, 1]) * self.counts[2] + cell[:, 2]]
        return nodes

    def nearest_nodes(self, target: Floats, count: int) -> Ints:
        """The nodes truly nearest to each target, (N, count), for targets that the first node missed."""
        near = np.nan_to_num(target, nan=0.0, posinf=0.0, neginf=0.0)
        count = min(count, len(self.angles))
        return np.asarray(self.search.query(near, k=count)[1], dtype=np.int64).reshape(len(target), count)


def roadmap(mech: MechanismArrays, design: int, reference: Floats) -> Roadmap:
    """The roadmap of one design from its reference posture (n,); kept, since many questions share it."""
    geometry = (mech.origin, mech.rotation_terms, mech.axis, mech.point_a, mech.point_b, mech.handle, mech.size)
    topology = (mech.parent, mech.column, mech.joint, mech.a, mech.b)
    return _build(
        tuple((a.shape, a.tobytes()) for a in topology),
        tuple((a.shape[1:], a[design].tobytes()) for a in geometry),
        mech.driven,
        mech.handle_link,
        reference.tobytes(),
    )


_Stored = tuple[tuple[tuple[int, ...], bytes], ...]


@lru_cache(maxsize=16)
def _build(topology: _Stored, geometry: _Stored, driven: int, handle_link: int, reference: bytes) -> Roadmap:
    """Flood, from contents alone: the same geometry finds its roadmap again, a changed one makes its own."""
    parent, column, joint, a, b = (np.frombuffer(d, dtype=np.int64).reshape(s).copy() for s, d in topology)
    numbers = [np.frombuffer(d).reshape((1, *s)).copy() for s, d in geometry]
    origin, turning, axis, point_a, point_b, handle, size = numbers
    n = parent.size
    mech = MechanismArrays(
        parent, column, joint, driven, a, b, handle_link, origin, turning, axis, point_a, point_b, handle,
        np.zeros((1, n)), np.zeros((1, n, 3)), np.zeros((1, n, 3, 3)), size,
    )  # fmt: skip
    angles, position = flood(mech, np.frombuffer(reference).copy(), TURNS.get(driven, 8))
    low, high = position.min(axis=0), position.max(axis=0)
    extent = np.maximum(high - low, 1e-9 * float(size[0]))
    long = extent > 1e-6 * float(size[0])
    pitch = (np.prod(extent[long]) / CELLS) ** (1 / max(1, long.sum())) if long.any() else 1.0
    counts = np.where(long, np.clip(np.ceil(extent / pitch), 1, CELLS), 1).astype(np.int64)
    centres = [low[x] + (np.arange(counts[x]) + 0.5) * extent[x] / counts[x] for x in range(3)]
    grid = np.stack(np.meshgrid(*centres, indexing="ij"), axis=-1).reshape(-1, 3)
    from scipy.spatial import cKDTree  # a tenth of a second, which a chart without a map can do without

    search = cKDTree(position)
    nearest = np.asarray(search.query(grid)[1], dtype=np.int64)
    return Roadmap(angles, position, nearest, low, extent / counts, counts, search)


@compiled_lean
def close_loops(mech: MechanismArrays, angles: Floats, work: WorkingMemory) -> bool:
    """Close the loops with the drives held (in place); False where Newton leaves the branch."""
    passive, loops = mech.joint.size - mech.driven, 3 * mech.a.size
    last, moved = 0.0, 0.0
    for iteration in range(12):
        place_links(mech, 0, angles, work)
        equations(mech, 0, work.goal, work)
        condition = passive_rates(mech, work)
        if condition < SINGULAR_CONDITION:
            return False
        # the step -A_p^+ gap, with the drives at rest: the same solve with the gaps as right-hand side
        size = closure_step(mech, work)
        moved += size
        if not moved < LARGEST_TURN or (iteration > 0 and size > CONTRACTION * last):
            return bool(largest_magnitude(work.gaps, loops) < 1e-13 * mech.size[0])
        for u in range(passive):
            angles[mech.joint[u]] += work.solution[0, u]
        if size < 1e-7:
            return True
        last = size
    return False


@compiled_lean
def turn_drive(
    mech: MechanismArrays, angles: Floats, drive: int, turn: float, margin: float, work: WorkingMemory
) -> bool:
    """Turn one drive a little and close the loops (in place); False where that leads to or past a singularity."""
    rows, start, rates, joint = work.rows, work.start, work.rates, mech.joint
    m, loops = rows.shape[0], work.gaps.size - 3
    place_links(mech, 0, angles, work)
    equations(mech, 0, work.goal, work)
    passive_rates(mech, work)
    for u in range(m):
        angles[joint[u]] += turn * rates[drive, u]
        for r in range(loops + 3):
            start[u, r] = rows[u, r]
    if not close_loops(mech, angles, work):
        return False
    place_links(mech, 0, angles, work)
    equations(mech, 0, work.goal, work)
    if orientation(start, rows, work.triangle, m, loops + 3) <= 0.0:
        return False
    if orientation(start, rows, work.triangle, m - mech.driven, loops) <= 0.0:
        return False
    return bool(min(passive_rates(mech, work), newton_step(mech, work)) >= margin)


@compiled_lean
def copy_row(source: Floats, target: Floats) -> None:
    """target[:] = source; spelled out, for which the compiler takes a twentieth of the time."""
    for i in range(target.size):
        target[i] = source[i]


@compiled
def flood(mech: MechanismArrays, reference: Floats, turns: int) -> tuple[Floats, Floats]:
    """Breadth first over a grid of `turns` per revolution on each drive: joint angles (K, n), positions (K, 3).

    A cell of the grid keeps the first posture that reaches it, the one with the shortest way to the reference.
    Nodes keep away from singularities by more than one step may change: two singularities passed at once, where
    they meet, leave the orientation as it was. Where the reference itself is nearer, steps are made shorter.
    """
    d, n = mech.driven, mech.parent.size
    work = working_memory(mech)
    cells, pitch = turns**d, 2.0 * np.pi / turns
    place_links(mech, 0, reference, work)
    equations(mech, 0, work.goal, work)
    margin = 0.3 * min(passive_rates(mech, work), newton_step(mech, work))
    substeps = int(min(16.0, np.ceil(MARGIN * pitch / margin))) if margin > 0.0 else 16
    margin = min(margin, MARGIN * pitch)
    # a queue in arrays: `count` postures are known, those from `head` on have neighbours to be tried
    visited = np.zeros(cells, dtype=np.bool_)
    cell_of = np.zeros(cells, dtype=np.int64)
    angles, position = np.zeros((cells, n)), np.zeros((cells, 3))
    trial = np.zeros(n)
    copy_row(reference, angles[0])
    visited[0] = True
    count, head = 1, 0
    while head < count:
        place_links(mech, 0, angles[head], work)
        h = link_point(work.rotation, work.origin, mech.handle_link, mech.handle, 0, 0)
        position[head, 0], position[head, 1], position[head, 2] = h[0], h[1], h[2]
        place_value = 1
        for drive in range(d):
            digit = (cell_of[head] // place_value) % turns
            for sign in (-1, 1):
                # the cell's number has one digit to the base `turns` for each drive; a turn beyond the last comes
                # back to 0
                cell = cell_of[head] + ((digit + sign) % turns - digit) * place_value
                if visited[cell]:
                    continue
                copy_row(angles[head], trial)
                free = True
                for _ in range(substeps):
                    free = free and turn_drive(mech, trial, drive, sign * pitch / substeps, margin, work)
                if free:
                    visited[cell] = True
                    cell_of[count] = cell
                    copy_row(trial, angles[count])
                    count += 1
            place_value *= turns
        head += 1
    return angles[:count].copy(), position[:count].copy()
