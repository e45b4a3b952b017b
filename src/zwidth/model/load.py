"""What a device bears while it renders: the hand's force, gravity, and where it is meant to bear them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import inf, isfinite
from numbers import Real
from typing import Final, Literal, cast, get_args

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.errors import LoadError
from zwidth.model.argument_checks import check_choice

HandForce = Literal["dead", "follower", "neglected"]
PostureOf = Literal["handle", "motors"]
ALONG: Final = 1e-9  # share of a load across the rendered direction that is rounding


@dataclass(frozen=True, eq=False)
class Load:
    """The forces about whose balance, the haptic equilibrium, a device is linearised (thesis eq. 2.4).

    force         (3,)  of the hand on the handle [N]
    moment        (3,)  of the hand instead, where moments about an axis are rendered [N m]
    push          instead of either: its part along the rendered direction, whichever that is, of either sign [N].
                  With none of the three the wall is at rest, without force, and the hand only holds the device
    gravity       (3,)  [m/s²]
    hand          "dead": the hand's force keeps its direction in space as the device moves; "follower": it turns
                  with the handle's link; "neglected": that it turns against the links as these move is left out,
                  as in thesis 2.1, which is another device
    posture_of    whose posture is asked for, that of the "handle" or of the "motors" as the computer counts them
    settle        True: the force is the hand's whole force, and the device slides along the surface to where that
                  is in balance; False: the posture is kept, and the hand supplies what it needs across the
                  rendered direction
    surface_radius  of the surface about the handle [m]: positive for one that is convex towards the hand, negative
                  for a hollow one, inf for a plane, the only one with settle
    count_sideways  whether the motions that no wall moves without load count for stability, too
    branch        of springs whose torque is 0 where their stiffness changes: "forward", the motor ahead, or
                  "backward"

    Raises  LoadError  for a force of 0, numbers that are not finite, a radius of 0, several forces, and a radius
                       beside settle
            ValueError for an unknown word
    """

    force: Floats | None = None
    moment: Floats | None = None
    push: float | None = None
    gravity: Floats | None = None
    hand: HandForce = "dead"
    posture_of: PostureOf = "handle"
    settle: bool = False
    surface_radius: float = inf
    count_sideways: bool = False
    branch: Literal["forward", "backward"] = "forward"

    def __post_init__(self) -> None:
        """Make lists arrays (3,), two components given a third of 0, and raise what the class says."""
        for name, unit in (("force", "N"), ("moment", "N m"), ("gravity", "m/s²")):
            given = getattr(self, name)
            if given is None:
                continue
            try:
                vector = np.asarray(given, dtype=np.float64)
            except (TypeError, ValueError):
                vector = np.zeros(0)
            if vector.shape not in ((2,), (3,)) or not np.isfinite(vector).all():
                raise LoadError(f"{name} must be two or three finite numbers [{unit}], got {given!r}")
            object.__setattr__(self, name, np.append(vector, np.zeros(3 - len(vector))))
        given = [name for name in ("force", "moment", "push") if getattr(self, name) is not None]
        if len(given) > 1:
            raise LoadError(f"{given[1]} is given beside {given[0]}; give one of them")
        if self.push is not None and not _is_finite(self.push):
            raise LoadError(f"push must be a finite number [N], got {self.push!r}")
        if given and not np.any(getattr(self, given[0])):
            raise LoadError(
                "a load of 0 N leaves a one-sided wall at the edge of contact, where nothing is linear; leave it "
                "out for the chart of the two-sided wall, or give the force with which the hand leans on the wall"
            )
        check_choice("hand", self.hand, get_args(HandForce))
        check_choice("posture_of", self.posture_of, get_args(PostureOf))
        check_choice("branch", self.branch, ("forward", "backward"))
        if self.surface_radius == 0.0 or not (_is_finite(self.surface_radius) or self.surface_radius == inf):
            raise LoadError(f"surface_radius must be a number but 0, or inf [m], got {self.surface_radius!r}")
        if self.settle and self.force is None:
            raise LoadError("settle needs a force, under which the device slides to where it is in balance")
        if self.settle and self.surface_radius != inf:
            raise LoadError(
                f"surface_radius of {self.surface_radius:g} m is given beside settle, which slides the handle "
                "along a plane; leave one of the two out"
            )

    def __eq__(self, other: object) -> bool:
        """Whether all numbers and words are the same."""
        return self._values == other._values if isinstance(other, Load) else NotImplemented

    def __hash__(self) -> int:
        """Hash of all numbers and words, so that equal loads are one key."""
        return hash(self._values)

    @property
    def _values(self) -> tuple[object, ...]:
        """The fields, arrays as tuples, to compare and to hash."""
        values = (getattr(self, each.name) for each in fields(self))
        return tuple(tuple(value.tolist()) if isinstance(value, np.ndarray) else value for value in values)

    @property
    def weight(self) -> Floats:
        """Gravity (3,), 0 where there is none [m/s²]."""
        return np.zeros(3) if self.gravity is None else self.gravity

    @property
    def pushes(self) -> bool:
        """Whether the hand leans on the wall."""
        return self.force is not None or self.moment is not None or self.push is not None

    def text(self, unit: str = "N") -> str:
        """The load in words: "a push of (0, -5, 0) N, gravity (0, 0, -9.81) m/s²".

        unit  of what the rendered direction pushes with: N, or about an axis that of a moment
        """
        parts = []
        for what, vector, its_unit in (
            ("a push of", self.force, "N"),
            ("a moment of", self.moment, "N m"),
            ("gravity", self.gravity, "m/s²"),
        ):
            if vector is not None:
                parts.append(f"{what} {vector_text(vector)} {its_unit}")
        if self.push is not None:
            way = "a push of {} along the direction" if unit == "N" else "a moment of {} about the axis"
            parts.insert(0, way.format(f"{self.push:g} {unit}"))
        return ", ".join(parts) or "no force"

    def along(self, screw: Floats) -> float | None:
        """The hand's push along a rendered direction (6,) [N], about an axis [N m]; None: the wall is at rest.

        Raises  LoadError  for a load that does not push along it
        """
        if self.push is not None:
            return float(self.push)
        linear, unit = bool(np.any(screw[:3])), unit_of_push(screw)
        given, way = (self.force, screw[:3]) if linear else (self.moment, screw[3:])
        other = self.moment if linear else self.force
        if other is not None:
            wanted = "force" if linear else "moment"
            raise LoadError(
                f"the wall is rendered along {_kind_of_direction(linear)}; give the load as a {wanted} "
                f"[{unit}], or push"
            )
        if given is None:
            return None
        along = float(given @ way) / float(way @ way)
        if not abs(along) * float(np.linalg.norm(way)) > ALONG * float(np.linalg.norm(given)):
            raise LoadError(
                f"the load {vector_text(given)} {unit} does not push along the rendered direction "
                f"{vector_text(way)}, where the wall would hold it; choose one with a part along the direction"
            )
        return along

    @property
    def along_every_direction(self) -> Load:
        """The same load with a push as strong as the hand's force, along whatever direction is rendered."""
        if self.force is None:
            return self
        return replace(self, force=None, push=float(np.linalg.norm(self.force)), settle=False)

    def with_gravity(self, gravity: ArrayLike) -> Load:
        """The same load under another gravity, (2,) or (3,) [m/s²]. Raises LoadError for another one."""
        return replace(self, gravity=cast(Floats, gravity))


def unit_of_push(screw: Floats) -> str:
    """Of what a wall along a rendered direction (6,) pushes with: N, or about an axis N m."""
    return "N" if np.any(screw[:3]) else "N m"


def vector_text(values: Floats) -> str:
    """A vector in words, "(0, -5, 0)"."""
    # + 0.0 makes 0 of -0
    return "(" + ", ".join(f"{x + 0.0:.6g}" for x in np.round(values, 12)) + ")"


def _kind_of_direction(linear: bool) -> str:
    """What is rendered, in words: a direction, along which forces act, or an axis, about which moments do."""
    return "a direction" if linear else "an axis"


def _is_finite(value: object) -> bool:
    """Whether the value is a finite real number; True and False are none."""
    return isinstance(value, Real) and not isinstance(value, bool) and isfinite(value)
