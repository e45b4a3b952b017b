"""Whether the handle ever touches a surface."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.contact.mechanism.surfaces import Surface, depth_and_normal
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays
from zwidth.model.posture import OK, Posture, handle_motions, solve_posture
from zwidth.model.roadmap import roadmap

TRIED: Final = 64  # postures nearest to the surface from which it is tried to touch it
REACHES: Final = 4  # times that each goes on from where it got nearest


class SurfaceOutOfReach(ValueError):
    """The handle never touches the surface in this assembly."""


def check_reach(mechanism: Mechanism, mech: MechanismArrays, posture: Posture, surface: Surface) -> None:
    """Raise SurfaceOutOfReach unless the handle can touch the surface in the posture's assembly.

    All postures of the assembly are known coarsely (`model.roadmap`). Where none of them is inside the wall, the
    ones nearest to it are taken to the point of the surface that they are nearest to.
    """
    road = roadmap(mech, 0, np.ascontiguousarray(posture.angles))
    here = np.concatenate([posture.position[None], road.position])
    depth, normal = depth_and_normal(surface, here)
    if np.max(depth) >= 0.0:
        return
    best = np.argsort(-depth)[:TRIED]
    nearest, least = here[best[0]], -depth[best[0]]
    at, depth, normal = here[best], depth[best], normal[best]
    plane = handle_motions(posture)
    for _ in range(REACHES):
        ways = normal @ plane @ plane.T
        gain = np.sum(ways * normal, axis=1)
        reachable = gain > 1e-9  # elsewhere the handle cannot move towards the surface at all
        if not reachable.any():
            break
        goals = at[reachable] + (depth[reachable] / gain[reachable])[:, None] * ways[reachable]
        solved = solve_posture(mechanism, goals, posture.assembly)
        if np.any(solved.status == OK):
            at, depth = goals[solved.status == OK], depth_and_normal(surface, goals[solved.status == OK])[0]
            normal = depth_and_normal(surface, at)[1]
            if np.max(depth) > -1e-9:
                return
        else:
            break
    where = "(" + ", ".join(f"{x:.4g}" for x in nearest) + ") m"
    raise SurfaceOutOfReach(
        f"the handle never touches the surface in assembly {posture.assembly!r}: of the postures tried the "
        f"closest is about {least:.3g} m away, at {where}; move the surface into the workspace"
    )
