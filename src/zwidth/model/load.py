"""What a device bears while it renders: the hand's force, gravity, and where it is meant to bear them."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import Final, Literal, get_args

import numpy as np

from zwidth.model.argument_checks import check_choice
from zwidth.model.mechanism import Floats

HandForce = Literal["dead", "follower"]
PostureOf = Literal["handle", "motors"]
Compensation = Literal["none", "computed", "counterweight"]
ALONG: Final = 1e-9  # share of a load across the rendered direction that is rounding


class LoadError(ValueError):
    """A load that cannot be meant."""


@dataclass(frozen=True)
class Load:
    """The forces about whose balance, the haptic equilibrium, a device is linearised (thesis eq. 2.4).

    force         (3,)  of the hand on the handle [N], about an axis its moment [N m]; None: the wall is at rest,
                  without force, and the hand only holds the device
    gravity       (3,)  [m/s^2]
    hand          "dead": the hand's force keeps its direction in space as the device moves; "follower": it turns
                  with the handle's link
    posture_of    whose posture is asked for, that of the "handle" or of the "motors" as the computer counts them
    settle        True: the force is the hand's whole force, and the device slides along the surface to where that
                  is in balance; False: the posture is kept, and the hand supplies what it needs across the rendered
                  direction
    surface_radius  of the surface about the handle [m]: positive for one that is convex towards the hand, negative
                  for a hollow one, inf for a plane
    count_sideways  whether the motions that no wall moves without load count for stability, too
    branch        of springs whose torque is 0 where their stiffness changes: "forward", the motor ahead, or "backward"

    Raises  LoadError for a force of 0, numbers that are not finite, a radius of 0, or an unknown word
    """

    force: Floats | None = None
    gravity: Floats | None = None
    hand: HandForce = "dead"
    posture_of: PostureOf = "handle"
    settle: bool = False
    surface_radius: float = inf
    count_sideways: bool = False
    branch: Literal["forward", "backward"] = "forward"

    def __post_init__(self) -> None:
        """Make lists arrays (3,) and check them."""
        for name, unit in (("force", "N"), ("gravity", "m/s^2")):
            given = getattr(self, name)
            if given is None:
                continue
            vector = np.asarray(given, dtype=np.float64)
            if vector.shape not in ((2,), (3,)) or not np.isfinite(vector).all():
                raise LoadError(f"{name} must be two or three finite numbers [{unit}], got {given!r}")
            object.__setattr__(self, name, np.append(vector, np.zeros(3 - len(vector))))
        if self.force is not None and not np.any(self.force):
            raise LoadError(
                "a load of 0 N leaves a one-sided wall at the edge of contact, where nothing is linear; leave it out "
                "for the chart of the two-sided wall, or give the force with which the hand leans on the wall"
            )
        check_choice("hand", self.hand, get_args(HandForce))
        check_choice("posture_of", self.posture_of, get_args(PostureOf))
        check_choice("branch", self.branch, ("forward", "backward"))
        if self.surface_radius == 0.0 or not (isfinite(self.surface_radius) or self.surface_radius == inf):
            raise LoadError(f"surface_radius must be a number but 0, or inf [m], got {self.surface_radius!r}")
        if self.settle and self.force is None:
            raise LoadError("settle needs a load, under which the device slides to where it is in balance")

    @property
    def weight(self) -> Floats:
        """Gravity (3,), 0 where there is none [m/s^2]."""
        return np.zeros(3) if self.gravity is None else self.gravity
