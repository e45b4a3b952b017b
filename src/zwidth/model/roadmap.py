"""All postures of an assembly, coarsely: a flood from the reference posture through the driven coordinates.

A straight way from the reference to a goal may be blocked although the goal can be reached: a device with
coincident base axes has a hole in the middle of its workspace. The flood goes round, because every node is
reached from a neighbour one small turn of one drive away, closing the loops again and never passing a
singularity. Newton then starts from the node nearest to the goal, which is also what makes batches fast.

Shapes have the letters of `MechanismArrays`, and goals g numbers: the handle's position [m], the vector of its
orientation [rad], or one after the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_lean
from zwidth.model.closure import apply_step, closure_step, equations, newton_step, orientations, passive_rates
from zwidth.model.continuation import (
    CONTRACTION,
    LARGEST_TURN,
    SINGULAR_CONDITION,
    joint_beyond_limit,
    keep_rows,
    largest_magnitude,
)
from zwidth.model.forward_kinematics import (
    WorkingMemory,
    fill_handle_axes,
    link_point,
    move_joints,
    place_links,
    working_memory,
)
from zwidth.model.mechanism import ORIENTATION, POSE, POSITION, REVOLUTE
from zwidth.model.mechanism_arrays import MechanismArrays, one_design
from zwidth.model.rotations import rotation_vector

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

TURNS: Final = {1: 256, 2: 96, 3: 32}  # nodes per turn of a drive, by number of drives
FLOODED: Final = 3  # drives that are turned; of a device with more, those after the first three stay
MARGIN: Final = 1.0  # smallest reciprocal condition of a node, per radian of a step
CELLS: Final = 40_000  # of the grid that finds the nearest node


@dataclass(frozen=True)
class Roadmap:
    """Postures joined with the reference by paths free of singularities and within the joints' limits.

    angles    (K, n)  joint coordinates; the reference is node 0
    position  (K, 3)  handle [m]
    goals     (K, g)  of the handle, as `continuation.set_goal` takes them
    nearest   (cells,)  node nearest to the centre of each cell of a grid over goals of three numbers; () of six
    low, pitch, counts  (3,)  that grid: lower corner [m], cell size [m], cells per axis
    scale     (g,)  of goals, in which distances are measured: lengths as they are, angles times the size
    """

    angles: Floats
    position: Floats
    goals: Floats
    nearest: Ints
    low: Floats
    pitch: Floats
    counts: Ints
    scale: Floats
    search: cKDTree

    def node_of_cell(self, target: Floats) -> Ints:
        """Index (N,) of a node near each target (N, g): that of its cell, in constant time."""
        if not len(self.nearest):
            return self.nearest_nodes(target, 1)[:, 0]
        finite = np.nan_to_num((target - self.low) / self.pitch, nan=0.0, posinf=0.0, neginf=0.0)
        cell = np.clip(finite, 0, self.counts - 1).astype(np.int64)
        nodes: Ints = self.nearest[(cell[:, 0] * self.counts[1] + cell[:, 1]) * self.counts[2] + cell[:, 2]]
        return nodes

    def nearest_nodes(self, target: Floats, count: int) -> Ints:
        """Indices (N, count) of the nodes truly nearest to each target (N, g), for those that the first node
        missed."""
        near = np.nan_to_num(target * self.scale, nan=0.0, posinf=0.0, neginf=0.0)
        count = min(count, len(self.angles))
        return np.asarray(self.search.query(near, k=count)[1], dtype=np.int64).reshape(len(target), count)


@dataclass(frozen=True)
class _Contents:
    """A design and its reference posture (n,), known by their numbers alone."""

    numbers: tuple[tuple[tuple[int, ...], bytes], ...]
    mech: MechanismArrays = field(compare=False)
    reference: Floats = field(compare=False)


def roadmap(mech: MechanismArrays, design: int, reference: Floats) -> Roadmap:
    """The roadmap of one design from its reference posture (n,); kept, since many questions share it."""
    geometry = one_design(mech, design)
    # what a body weighs decides nothing here: the same geometry finds its roadmap again, a changed one makes its
    # own
    empty = {name: np.zeros_like(getattr(geometry, name)) for name in ("mass", "center_of_mass", "inertia")}
    geometry = geometry._replace(bodies=np.zeros(0, dtype=np.int64), **empty)
    arrays = [np.asarray(array) for array in (*geometry, reference)]
    return _build(_Contents(tuple((array.shape, array.tobytes()) for array in arrays), geometry, reference.copy()))


@lru_cache(maxsize=16)
def _build(contents: _Contents) -> Roadmap:
    """Flood from the reference, and lay a grid over goals of three numbers that finds the nearest node."""
    mech, size = contents.mech, float(contents.mech.size[0])
    turned = min(mech.driven, FLOODED)
    angles, position, rotation = flood(mech, contents.reference, turned, TURNS.get(turned, 1))
    goals = _goals(mech, position, rotation)
    scale = np.ones(goals.shape[1])
    # of the numbers of an orientation, where there are any
    scale[0 if mech.controls == ORIENTATION else 3 :] = 1.0 if mech.controls == POSITION else size
    from scipy.spatial import cKDTree  # a tenth of a second, which a chart without a map can do without

    search = cKDTree(goals * scale)
    low, high = goals.min(axis=0)[:3], goals.max(axis=0)[:3]
    # no width is 0, by which is divided
    extent = np.maximum(high - low, 1e-9 * size)
    if mech.controls == POSE:
        no_cells = np.zeros(0, dtype=np.int64)
        return Roadmap(angles, position, goals, no_cells, low, extent, np.ones(3, dtype=np.int64), scale, search)
    long = extent > 1e-6 * size
    # cubes, as many as CELLS in the axes along which goals differ
    pitch = (np.prod(extent[long]) / CELLS) ** (1 / max(1, long.sum())) if long.any() else 1.0
    counts = np.where(long, np.clip(np.ceil(extent / pitch), 1, CELLS), 1).astype(np.int64)
    centres = [low[x] + (np.arange(counts[x]) + 0.5) * extent[x] / counts[x] for x in range(3)]
    grid = np.stack(np.meshgrid(*centres, indexing="ij"), axis=-1).reshape(-1, 3)
    nearest = np.asarray(search.query(grid * scale)[1], dtype=np.int64)
    return Roadmap(angles, position, goals, nearest, low, extent / counts, counts, scale, search)


def _goals(mech: MechanismArrays, position: Floats, rotation: Floats) -> Floats:
    """Goals (K, g), as of `Roadmap`, of handle positions (K, 3) and axes (K, 3, 3)."""
    if mech.controls == POSITION:
        return position
    turned = rotation_vector(rotation)
    return turned if mech.controls == ORIENTATION else np.concatenate([position, turned], axis=1)


@compiled_lean
def close_loops(mech: MechanismArrays, angles: Floats, work: WorkingMemory) -> bool:
    """Close the loops from joint coordinates angles (n,) (in place) with the drives held; False where Newton
    leaves the branch, or near a singularity."""
    loops, last, moved = mech.first_row[mech.a.size], 0.0, 0.0
    for iteration in range(12):
        place_links(mech, 0, angles, work)
        equations(mech, 0, work)
        condition = passive_rates(mech, 0, work)
        if condition < SINGULAR_CONDITION:
            return False
        # the step -A_p^+ gap, with the drives at rest: the same solve with the gaps as right-hand side
        size = closure_step(mech, work)
        moved += size
        if not moved < LARGEST_TURN or (iteration > 0 and size > CONTRACTION * last):
            # rounding moves it to and fro where the loops are closed already
            return bool(largest_magnitude(work.gaps, loops) < 1e-13 * mech.size[0])
        apply_step(mech, 0, angles, work)
        # the square of it, which is what Newton leaves, is rounding
        if size < 1e-7:
            return True
        last = size
    return False


@compiled_lean
def begin_to_turn(mech: MechanismArrays, angles: Floats, work: WorkingMemory) -> None:
    """Fill `work.rows` and `work.rates` at joint coordinates angles (n,), from which `turn_drive` starts."""
    place_links(mech, 0, angles, work)
    equations(mech, 0, work)
    passive_rates(mech, 0, work)


@compiled_lean
def turn_drive(
    mech: MechanismArrays, angles: Floats, drive: int, turn: float, margin: float, work: WorkingMemory
) -> bool:
    """Turn one drive a little, in its unit, and close the loops, joint coordinates angles (n,) (in place); False
    where that leads to or past a singularity, or beyond a joint's limit.

    margin  reciprocal condition below which a posture counts as singular
    `rows` and `rates` belong to the posture before, as `begin_to_turn` or a turn that succeeded leaves them.
    """
    rates, step, m = work.rates, work.solution[0], work.rows.shape[0]
    moved = m - mech.free
    for u in range(m):
        step[u] = turn * mech.unit[0, moved - mech.driven + drive] * rates[drive, u]
    move_joints(mech, angles, step)
    keep_rows(work)
    if not close_loops(mech, angles, work) or joint_beyond_limit(mech, 0, angles) >= 0:
        return False
    place_links(mech, 0, angles, work)
    equations(mech, 0, work)
    of_drives, of_handle = orientations(mech, work)
    # a determinant that has changed its sign has passed a singularity
    if of_drives <= 0.0 or of_handle <= 0.0:
        return False
    return bool(min(passive_rates(mech, 0, work), newton_step(mech, 0, work)) >= margin)


@compiled_lean
def copy_row(source: Floats, target: Floats) -> None:
    """target[:] = source; spelled out, for which the compiler takes a twentieth of the time."""
    for i in range(target.size):
        target[i] = source[i]


@compiled_lean
def _pitch(mech: MechanismArrays, reference: Floats, drive: int, turns: int) -> float:
    """Step of one drive from a node to the next, in the drive's unit: 1/`turns` of a full turn; of one that slides
    so much that half of the `turns` nodes reach its farther limit."""
    moved = mech.joint.size - mech.free
    joint = mech.joint[moved - mech.driven + drive]
    if mech.kind[joint] == REVOLUTE:
        return 2.0 * np.pi / turns
    span = max(reference[joint] - mech.lower[0, joint], mech.upper[0, joint] - reference[joint])
    size = mech.unit[0, moved - mech.driven + drive]
    # a little less than to the limit itself; no more than what a drive that turns moves a link of that size
    return min(2.0 * np.pi, 2.0 * (1.0 - 1e-9) * span / size if span < np.inf else 1.0) / turns


@compiled
def flood(mech: MechanismArrays, reference: Floats, turned: int, turns: int) -> tuple[Floats, Floats, Floats]:
    """Breadth first over a grid of `turns` per revolution on each of the first `turned` drives: joint coordinates
    (K, n), handle positions (K, 3) and axes (K, 3, 3).

    A cell of the grid keeps the first posture that reaches it, the one with the shortest way to the reference.
    Nodes keep away from singularities by more than one step may change: two singularities passed at once, where
    they meet, leave the orientation as it was. Where the reference itself is nearer, steps are made shorter.
    A drive that slides goes as far as its limits, or half the mechanism's size, and does not come back.
    """
    d, n = turned, mech.parent.size
    work = working_memory(mech)
    cells, pitches, pitch = turns**d, np.zeros(d), 0.0
    for drive in range(d):
        pitches[drive] = _pitch(mech, reference, drive, turns)
        pitch = max(pitch, pitches[drive])
    place_links(mech, 0, reference, work)
    equations(mech, 0, work)
    # nodes may be nearer to a singularity than the reference, down to this share of its reciprocal condition
    margin = 0.3 * min(passive_rates(mech, 0, work), newton_step(mech, 0, work))
    substeps = int(min(16.0, np.ceil(MARGIN * pitch / margin))) if margin > 0.0 else 16
    margin = min(margin, MARGIN * pitch)
    # a queue in arrays: `count` postures are known, those from `head` on have neighbours to be tried
    visited = np.zeros(cells, dtype=np.bool_)
    cell_of = np.zeros(cells, dtype=np.int64)
    angles, position, rotation = np.zeros((cells, n)), np.zeros((cells, 3)), np.zeros((cells, 3, 3))
    trial = np.zeros(n)
    copy_row(reference, angles[0])
    visited[0] = True
    count, head = 1, 0
    while head < count:
        place_links(mech, 0, angles[head], work)
        h = link_point(work.rotation, work.origin, mech.handle_link, mech.handle, 0, 0)
        position[head, 0], position[head, 1], position[head, 2] = h[0], h[1], h[2]
        fill_handle_axes(mech, 0, work, rotation[head])
        place_value = 1
        for drive in range(d):
            digit = (cell_of[head] // place_value) % turns
            revolves = mech.kind[mech.joint[mech.joint.size - mech.free - mech.driven + drive]] == REVOLUTE
            for sign in (-1, 1):
                # of a drive that slides digits above half of `turns` lie backwards: from one half it does not go
                # on to the other
                if not revolves and digit == (turns // 2 if sign > 0 else (turns // 2 + 1) % turns):
                    continue
                # the cell's number has one digit to the base `turns` for each drive; a turn beyond the last comes
                # back to 0
                cell = cell_of[head] + ((digit + sign) % turns - digit) * place_value
                if visited[cell]:
                    continue
                copy_row(angles[head], trial)
                begin_to_turn(mech, trial, work)
                free = True
                for _ in range(substeps):
                    free = free and turn_drive(mech, trial, drive, sign * pitches[drive] / substeps, margin, work)
                if free:
                    visited[cell] = True
                    cell_of[count] = cell
                    copy_row(trial, angles[count])
                    count += 1
            place_value *= turns
        head += 1
    return angles[:count].copy(), position[:count].copy(), rotation[:count].copy()
