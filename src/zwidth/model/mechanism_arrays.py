"""A mechanism packed for the compiled kernels: flat arrays, one leading axis of designs, nothing else.

The unknowns are the joint coordinates: first the passive ones, which the loops determine, then the driven ones,
last the free ones, so that the columns of every constraint matrix split into [passive | driven | free] without any
indexing. Driven and free ones together are the independent coordinates.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.model.mechanism import BALL_Z, FIXED, POINT, POSE, PRISMATIC, Links, Mechanism


class MechanismArrays(NamedTuple):
    """Topology shared by all designs, then the numbers of each of the P designs.

    n links, m unknowns, c of them independent, k closures;

    parent          (n,)    parent link, -1 for the base
    kind            (n,)    FIXED, REVOLUTE, PRISMATIC, BALL_X, BALL_Y or BALL_Z: the link's joint
    carrier         (n,)    the link against which the joint turns: the parent; of a ball joint what carries all
                    three
    column          (n,)    the unknown that moves this link, -1 for a fixed joint
    joint           (m,)    the link each unknown moves: passive ones, then driven, then free
    balls           (b,)    the links behind ball joints
    bodies          (w,)    the links with a mass or an inertia, in any design
    driven, free    number of driven and of free coordinates
    a, b            (k,)    links that closure k holds together
    closing         (k,)    POINT, AXIS or FRAME
    first_row       (k+1,)  row of each closure's first equation; last their number
    spans           (m, 2)  first and end of the rows of each unknown that are not 0, in the equations of closures
                    and handle; filled: also once unknowns before it are eliminated; whole: all rows that there can
                    be
    coupled         whether drives turn with several joints: their coordinates then are not those of the joints
    handle_link     link the handle is a point of
    controls        POSITION, POSE or ORIENTATION
    origin          (P, n, 3)        as in `Links`
    rotation_terms  (P, n, 3, 3, 3)  C0, C1, C2: the link against its parent is C0 + sin q C1 + cos q C2
    axis            (P, n, 3)        joint axis in the parent's frame
    point_a, point_b  (P, k, 3)  as in `Closures`;   axis_a, axis_b (P, k, 3), closing_rotation (P, k, 3, 3)  too
    handle          (P, 1, 3)        the handle's point in its link's frame
    handle_rotation (P, 3, 3)        the handle's axes in its link's frame
    mass            (P, n), center_of_mass (P, n, 3), inertia (P, n, 3, 3)   as in `Links`
    lower, upper    (P, n)           limits of the joints, infinite where there is none
    size            (P,)             a length of the mechanism [m], to judge gaps by
    to_joint, to_drive  (P, c, c)    the independent joints' coordinates from those of the drives and the free
                    joints, and back
    unit            (P, m)           of each unknown, in which steps are judged: 1 rad, or the size [m]
    """

    parent: Ints
    kind: Ints
    carrier: Ints
    column: Ints
    joint: Ints
    balls: Ints
    bodies: Ints
    driven: int
    free: int
    a: Ints
    b: Ints
    closing: Ints
    first_row: Ints
    spans: Ints
    filled: Ints
    whole: Ints
    coupled: bool
    handle_link: int
    controls: int
    origin: Floats
    rotation_terms: Floats
    axis: Floats
    point_a: Floats
    point_b: Floats
    axis_a: Floats
    axis_b: Floats
    closing_rotation: Floats
    handle: Floats
    handle_rotation: Floats
    mass: Floats
    center_of_mass: Floats
    inertia: Floats
    lower: Floats
    upper: Floats
    size: Floats
    to_joint: Floats
    to_drive: Floats
    unit: Floats


NUMBERS: Final = MechanismArrays._fields[MechanismArrays._fields.index("origin") :]
"""The fields that have an axis of designs; those before them are the topology."""


def per_design(mechanism: Mechanism, array: Floats, trailing: int) -> Floats:
    """A copy of an array of the mechanism with its leading axes, all but the last `trailing`, made one axis of the
    P designs: (P, ...)."""
    shape = mechanism.design_shape
    tail = array.shape[array.ndim - trailing :]
    full = np.broadcast_to(np.asarray(array, dtype=np.float64), shape + tail)
    # always a copy: kernels are compiled once for writable arrays and once more for read-only ones
    return np.array(full.reshape((int(np.prod(shape)), *tail)), order="C")


def one_design(mech: MechanismArrays, design: int) -> MechanismArrays:
    """The arrays of a single design, which then is design 0."""
    taken = {name: getattr(mech, name)[design : design + 1].copy() for name in NUMBERS}
    return mech._replace(**taken)


def design_of_each(mechanism: Mechanism, shape: tuple[int, ...]) -> Ints:
    """Index of the design of each of many postures, flat; their shape is one to which that of the designs
    broadcasts."""
    designs = mechanism.design_shape
    numbers = np.arange(int(np.prod(designs)), dtype=np.int64).reshape(designs)
    return np.broadcast_to(numbers, shape).ravel()


def pack(mechanism: Mechanism) -> MechanismArrays:
    """The mechanism as `MechanismArrays`; every call packs anew, nothing is kept."""
    links, closures = mechanism.links, mechanism.closures
    kind = np.array(links.joint, dtype=np.int64)
    independent = [*(int(i) for i in mechanism.driven), *mechanism.free]
    closing = np.full(len(closures.names), POINT) if closures.kind is None else np.array(closures.kind)
    first_row = np.concatenate([[0], np.cumsum(np.where(closing == POINT, 3, 6))]).astype(np.int64)
    rows_of_links = _rows_of_links(mechanism, first_row)
    passive = [i for i in range(len(kind)) if kind[i] != FIXED and i not in independent]
    # those with few equations first, so that they have still few when others are eliminated
    passive.sort(key=lambda i: rows_of_links[i, 1] - rows_of_links[i, 0])
    joint = np.array(passive + independent, dtype=np.int64)
    spans = rows_of_links[joint].reshape(-1, 2)
    column = np.full(len(kind), -1, dtype=np.int64)
    column[joint] = np.arange(len(joint))
    count = len(closures.names)

    origin = per_design(mechanism, links.origin, 2)
    rotation = per_design(mechanism, links.rotation, 3)
    axis = per_design(mechanism, links.axis, 2)
    point_a, point_b = (per_design(mechanism, p, 2) for p in (closures.point_a, closures.point_b))
    handle = per_design(mechanism, mechanism.handle_point, 1)
    mass, inertia = per_design(mechanism, links.mass, 1), per_design(mechanism, links.inertia, 3)
    heavy = (mass != 0.0).any(axis=0) | (inertia != 0.0).any(axis=(0, 2, 3))
    tip = per_design(mechanism, links.tip, 2)
    lengths = sum(
        np.linalg.norm(p, axis=-1).sum(axis=-1) for p in (origin, tip, point_a, point_b, handle[:, None])
    )
    size = np.ascontiguousarray(np.where(lengths > 0.0, lengths, 1.0), dtype=np.float64)
    along = np.broadcast_to(np.array([1.0, 0.0, 0.0]), (count, 3))
    to_drive = _to_drive(mechanism, independent)
    plain = np.eye(3)
    return MechanismArrays(
        parent=np.array(links.parent, dtype=np.int64),
        kind=kind,
        carrier=_carriers(links),
        column=column,
        joint=joint,
        balls=np.flatnonzero(kind == BALL_Z).astype(np.int64),
        bodies=np.flatnonzero(heavy).astype(np.int64),
        driven=len(mechanism.driven),
        free=len(mechanism.free),
        a=np.array(closures.a, dtype=np.int64),
        b=np.array(closures.b, dtype=np.int64),
        closing=closing.astype(np.int64),
        first_row=first_row,
        spans=spans,
        filled=_filled(spans),
        whole=np.tile(np.array([0, np.iinfo(np.int64).max]), (len(joint), 1)),
        coupled=mechanism.drives.coupling is not None,
        handle_link=int(mechanism.handle_link),
        controls=int(mechanism.controls),
        origin=origin,
        rotation_terms=_rotation_terms(rotation, axis),
        axis=np.ascontiguousarray(np.einsum("pnij,pnj->pni", rotation, axis)),
        point_a=point_a,
        point_b=point_b,
        axis_a=per_design(mechanism, along if closures.axis_a is None else closures.axis_a, 2),
        axis_b=per_design(mechanism, along if closures.axis_b is None else closures.axis_b, 2),
        closing_rotation=per_design(
            mechanism,
            np.broadcast_to(plain, (count, 3, 3)) if closures.rotation is None else closures.rotation,
            3,
        ),
        handle=np.ascontiguousarray(handle[:, None]),
        handle_rotation=per_design(
            mechanism, plain if mechanism.handle_rotation is None else mechanism.handle_rotation, 2
        ),
        mass=mass,
        center_of_mass=per_design(mechanism, links.center_of_mass, 2),
        inertia=inertia,
        lower=per_design(mechanism, np.full(len(kind), -np.inf) if links.lower is None else links.lower, 1),
        upper=per_design(mechanism, np.full(len(kind), np.inf) if links.upper is None else links.upper, 1),
        size=size,
        to_joint=np.ascontiguousarray(np.linalg.inv(to_drive), dtype=np.float64),
        to_drive=to_drive,
        unit=np.ascontiguousarray(np.where(kind[joint] == PRISMATIC, size[:, None], 1.0)),
    )


def _to_drive(mechanism: Mechanism, independent: list[int]) -> Floats:
    """The coordinates of drives and free joints per coordinate of the independent joints (indices of links), (P,
    c, c)."""
    c, drives = len(independent), mechanism.drives
    P = int(np.prod(mechanism.design_shape))
    T = np.tile(np.eye(c), (P, 1, 1))
    if drives.coupling is not None:
        rows = [i for i in range(len(drives.names)) if i not in drives.surplus]
        T[:, : len(rows)] += per_design(mechanism, drives.coupling, 2)[:, rows][:, :, independent]
    return T


def _rows_of_links(mechanism: Mechanism, first_row: Ints) -> Ints:
    """First and end (n, 2) of the rows that each link's joint moves, in the equations of closures and handle."""
    parent, closures, loops = mechanism.links.parent, mechanism.closures, int(first_row[-1])
    rows = np.tile(np.array([np.iinfo(np.int64).max, 0]), (len(parent), 1))
    ends = [
        (int(end), first_row[k], first_row[k + 1])
        for k in range(len(closures.names))
        for end in (closures.a[k], closures.b[k])
    ]
    for link, first, end in [
        *ends,
        (mechanism.handle_link, loops, loops + (6 if mechanism.controls == POSE else 3)),
    ]:
        while link >= 0:
            rows[link] = min(rows[link, 0], first), max(rows[link, 1], end)
            link = int(parent[link])
    rows[rows[:, 1] == 0] = 0  # a joint that moves no equation
    return rows


def _filled(spans: Ints) -> Ints:
    """First and end (m, 2) of each unknown's rows once the unknowns before it that share rows are eliminated."""
    filled = spans.copy()
    for j in range(len(spans)):
        shares = (filled[:, 0] < filled[j, 1]) & (filled[j, 0] < filled[:, 1])
        shares[: j + 1] = False
        filled[shares, 0] = np.minimum(filled[shares, 0], filled[j, 0])
        filled[shares, 1] = np.maximum(filled[shares, 1], filled[j, 1])
    return filled


def _carriers(links: Links) -> Ints:
    """Index (n,) of the link against which each link's joint turns."""
    carrier = np.array(links.parent, dtype=np.int64)
    # a ball joint is three links, i - 2 to i: all turn against the parent of the first
    for i in np.flatnonzero(np.asarray(links.joint) == BALL_Z):
        carrier[i - 1 : i + 1] = carrier[i - 2]
    return carrier


def _rotation_terms(rotation: Floats, axis: Floats) -> Floats:
    """C0, C1, C2 (P, n, 3, 3, 3) of a joint's rotation C (a a^T + sin q [a]x + cos q (1 - a a^T)), by Rodrigues:
    `rotation` C (P, n, 3, 3) is that at q = 0, `axis` a (P, n, 3)."""
    along = axis[..., :, None] * axis[..., None, :]
    cross = np.zeros_like(along)
    x, y, z = np.moveaxis(axis, -1, 0)
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -z, y, -x
    cross = cross - np.swapaxes(cross, -1, -2)
    parts = np.stack([along, cross, np.eye(3) - along], axis=-3)
    return np.ascontiguousarray(rotation[..., None, :, :] @ parts)
