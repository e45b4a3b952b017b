"""A mechanism with its loops cut open: joint axes and the mass matrix of all joint coordinates."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled
from zwidth.model.closure import equations, passive_rates
from zwidth.model.forward_kinematics import place_links, working_memory
from zwidth.model.inertia import mass_matrix, unit_motions
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays, pack
from zwidth.model.ratio_table import with_any_ratio


def joint_axes(mechanism: Mechanism, coordinates: Floats) -> Floats:
    """Joint axes in the base frame at joint coordinates (n,) of one design, (n, 3)."""
    mech = pack(mechanism)
    return np.asarray(_axes(mech, np.ascontiguousarray(coordinates)))


def joint_mass_matrix(mechanism: Mechanism, coordinates: Floats) -> Floats:
    """Mass matrix (m, m) of the links and of the rotors behind rigid drives at joint coordinates (n,) of one
    design, the loops cut open; joints in the order of the unknowns (`MechanismArrays.joint`). A ratio that changes
    is the first of its table: what is asked is whether every motion has a mass."""
    mech, drives = pack(mechanism), with_any_ratio(mechanism.drives)
    none = np.zeros(0, dtype=np.int64)
    cut = mech._replace(a=none, b=none, closing=none, first_row=np.zeros(1, dtype=np.int64))
    M = np.empty((1, mech.joint.size, mech.joint.size))
    _mass(cut._replace(driven=mech.joint.size, free=0), np.ascontiguousarray(coordinates), M)
    rigid = np.where(np.isinf(drives.stiffness), drives.transmission**2 * drives.motor_inertia, 0.0)
    rotors = np.zeros(mech.joint.size)
    rigid = rigid[[i for i in range(len(rigid)) if i not in drives.surplus]]  # the others have no coordinate
    rotors[mech.joint.size - mech.free - mech.driven : mech.joint.size - mech.free] = rigid
    return np.asarray(M[0] + np.diag(rotors))


@compiled
def _axes(mech: MechanismArrays, angles: Floats) -> Floats:
    work = working_memory(mech)
    place_links(mech, 0, angles, work)
    return work.axis


@compiled
def _mass(mech: MechanismArrays, angles: Floats, out: Floats) -> None:
    work = working_memory(mech)
    place_links(mech, 0, angles, work)
    equations(mech, 0, work)
    passive_rates(mech, 0, work)
    unit_motions(mech, work)
    mass_matrix(mech, 0, work, out, 0)
