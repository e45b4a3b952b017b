"""A mechanism packed for the compiled kernels: flat arrays, one leading axis of designs, nothing else.

The unknowns are the revolute joints, the passive ones first and the driven ones last, so that the columns of
every constraint matrix split into [passive | driven] without any indexing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.model.mechanism import FIXED, Floats, Ints, Mechanism


class MechanismArrays(NamedTuple):
    """Topology shared by all designs, then the numbers of each of the P designs.

    parent          (n,)    parent link, -1 for the base
    column          (n,)    the unknown that turns this link, -1 for a fixed joint
    joint           (m,)    the link each unknown turns: passive ones first, then the d driven ones
    driven          d       number of driven joints
    a, b            (k,)    links that closure k holds together
    handle_link         link the handle is a point of
    origin          (P, n, 3)        as in `Links`
    rotation_terms  (P, n, 3, 3, 3)  C0, C1, C2: the link against its parent is C0 + sin q C1 + cos q C2
    axis            (P, n, 3)        joint axis in the parent's frame
    point_a, point_b  (P, k, 3)  as in `Closures`
    handle          (P, 1, 3)        the handle's point in its link's frame
    mass            (P, n), center_of_mass (P, n, 3), inertia (P, n, 3, 3)   as in `Links`
    size            (P,)             a length of the mechanism [m], to judge gaps by
    """

    parent: Ints
    column: Ints
    joint: Ints
    driven: int
    a: Ints
    b: Ints
    handle_link: int
    origin: Floats
    rotation_terms: Floats
    axis: Floats
    point_a: Floats
    point_b: Floats
    handle: Floats
    mass: Floats
    center_of_mass: Floats
    inertia: Floats
    size: Floats


def per_design(mechanism: Mechanism, array: Floats, trailing: int) -> Floats:
    """An array of the mechanism with its leading axes flattened to one axis of designs: (P, ...)."""
    shape = mechanism.design_shape
    tail = array.shape[array.ndim - trailing :]
    full = np.broadcast_to(np.asarray(array, dtype=np.float64), shape + tail)
    # always a copy: kernels are compiled once for writable arrays and once more for read-only ones
    return np.array(full.reshape((int(np.prod(shape)), *tail)), order="C")


def design_of_each(mechanism: Mechanism, shape: tuple[int, ...]) -> Ints:
    """Index of the design of each of many postures, flat; their shape is one to which that of the designs
    broadcasts."""
    designs = mechanism.design_shape
    numbers = np.arange(int(np.prod(designs)), dtype=np.int64).reshape(designs)
    return np.broadcast_to(numbers, shape).ravel()


def pack(mechanism: Mechanism) -> MechanismArrays:
    """The mechanism as `MechanismArrays`; every call packs anew, nothing is kept."""
    links, closures = mechanism.links, mechanism.closures
    revolute = [i for i in range(len(links.names)) if links.joint[i] != FIXED]
    driven = [int(i) for i in mechanism.drives.joint]
    joint = np.array([i for i in revolute if i not in driven] + driven, dtype=np.int64)
    column = np.full(len(links.names), -1, dtype=np.int64)
    column[joint] = np.arange(len(joint))

    origin = per_design(mechanism, links.origin, 2)
    rotation = per_design(mechanism, links.rotation, 3)
    axis = per_design(mechanism, links.axis, 2)
    point_a, point_b = (per_design(mechanism, p, 2) for p in (closures.point_a, closures.point_b))
    handle = per_design(mechanism, mechanism.handle_point, 1)
    tip = per_design(mechanism, links.tip, 2)
    size = sum(np.linalg.norm(p, axis=-1).sum(axis=-1) for p in (origin, tip, point_a, point_b, handle[:, None]))
    return MechanismArrays(
        parent=np.array(links.parent, dtype=np.int64),
        column=column,
        joint=joint,
        driven=len(driven),
        a=np.array(closures.a, dtype=np.int64),
        b=np.array(closures.b, dtype=np.int64),
        handle_link=int(mechanism.handle_link),
        origin=origin,
        rotation_terms=_turning(rotation, axis),
        axis=np.ascontiguousarray(np.einsum("pnij,pnj->pni", rotation, axis)),
        point_a=point_a,
        point_b=point_b,
        handle=np.ascontiguousarray(handle[:, None]),
        mass=per_design(mechanism, links.mass, 1),
        center_of_mass=per_design(mechanism, links.center_of_mass, 2),
        inertia=per_design(mechanism, links.inertia, 3),
        size=np.ascontiguousarray(size, dtype=np.float64),
    )


def _turning(rotation: Floats, axis: Floats) -> Floats:
    """C0, C1, C2 of Rodrigues' formula: C (a a^T + sin q [a]x + cos q (1 - a a^T)), shape (P, n, 3, 3, 3)."""
    along = axis[..., :, None] * axis[..., None, :]
    cross = np.zeros_like(along)
    x, y, z = np.moveaxis(axis, -1, 0)
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -z, y, -x
    cross = cross - np.swapaxes(cross, -1, -2)
    parts = np.stack([along, cross, np.eye(3) - along], axis=-3)
    return np.ascontiguousarray(rotation[..., None, :, :] @ parts)
