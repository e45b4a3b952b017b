"""Rendering at a surface: the Kelvin-Voigt wall, or any environment along the surface's normal."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.contact.environments import ENVIRONMENTS, Environment
from zwidth.contact.mechanism.motion_inputs import MotionError
from zwidth.contact.mechanism.surfaces import Plane, Surface


@dataclass(frozen=True)
class SurfaceWall:
    """A Kelvin-Voigt wall at a surface: f = (K depth + B depth') normal, inside only or on both sides of a plane.

    stiffness K [N/m];   damping B [N s/m], of either sign
    no_pull   True: the wall never pulls the handle in
    """

    stiffness: float
    damping: float = 0.0
    no_pull: bool = False


@dataclass(frozen=True)
class SurfaceEnvironment:
    """Any environment at a surface, along its normal: f = -F(depth, depth', ...) normal.

    The environment's position is the depth behind the surface, its velocity the depth's estimated rate, and its
    force F acts along the way in, as in the simulation of one direction. What the law says of a motion along a
    texture, a grating or a rubbing patch it says of the motion along the normal.

    environment   what is rendered;   values (P,) of its parameters, as `Environment.values` gives them
    """

    environment: Environment
    values: ArrayLike


SurfaceRendering = SurfaceWall | SurfaceEnvironment


def rendered_environment(wall: SurfaceRendering, surface: Surface) -> tuple[Environment, Floats]:
    """The environment that renders a wall at this surface, and its parameters. Raises MotionError."""
    if not isinstance(surface, Surface):
        raise MotionError(f"the surface must be a Plane, a Sphere or a Box, got {type(surface).__name__}")
    two_sided = isinstance(surface, Plane) and surface.two_sided
    if isinstance(wall, SurfaceEnvironment):
        return wall.environment, _values(wall, two_sided)
    if not isinstance(wall, SurfaceWall):
        raise MotionError(f"the wall must be a SurfaceWall or a SurfaceEnvironment, got {type(wall).__name__}")
    if not (isfinite(wall.stiffness) and wall.stiffness >= 0.0):
        raise MotionError(f"the wall's stiffness must be at least 0 and finite [N/m], got {wall.stiffness}")
    if not isfinite(wall.damping):
        raise MotionError(f"the wall's damping must be finite [N s/m], of either sign, got {wall.damping}")
    if two_sided and wall.no_pull:
        raise MotionError("a two-sided plane always pulls; leave out no_pull or two_sided")
    gains = {"stiffness": float(wall.stiffness), "damping": float(wall.damping)}
    if two_sided:
        return ENVIRONMENTS["wall"], ENVIRONMENTS["wall"].values(**gains)
    one_sided = ENVIRONMENTS["one_sided_wall"]
    return one_sided, one_sided.values(**gains, no_pull=float(wall.no_pull))


def _values(wall: SurfaceEnvironment, two_sided: bool) -> Floats:
    names, values = wall.environment.names, np.array(wall.values, dtype=np.float64)
    if values.shape != (len(names),):
        raise MotionError(
            f"{wall.environment.name} takes {len(names)} values ({', '.join(names) or 'none'}), got an array of "
            f"shape {values.shape}; make it by Environment.values"
        )
    if two_sided:
        raise MotionError(
            f"two_sided is of a SurfaceWall; {wall.environment.name} says itself on which sides of the surface it "
            "acts: leave two_sided out"
        )
    return values
