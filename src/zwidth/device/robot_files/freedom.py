"""What can move in a mechanism: which joints are driven, which are free, and what of the handle the drives
control."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from zwidth.arrays import Floats
from zwidth.device.build_mechanism import mechanism as build_mechanism
from zwidth.device.faults import DeviceError, Fault, dotted
from zwidth.device.mechanism_check import CLOSED, INDEPENDENT, close_loops, closed_nearby, null_space
from zwidth.device.schema.mechanism import MechanismSection
from zwidth.device.validation_messages import validation_messages
from zwidth.model.handle_position import constraints, handle_goal
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays, pack

REGULAR: Final = 1e-6  # least singular value over the largest, of a handle that its drives control
NEGLIGIBLE: Final = 1e-9  # share of a handle's largest motion, below which a joint does not move it


@dataclass(frozen=True)
class Configuration:
    """The motions of a mechanism where it stands with its loops closed.

    basis    (m, f) what the loops leave, scaled to [rad] and sizes of the mechanism
    handle   (6, m) motions of the handle by each coordinate: its position, then its turning, scaled alike
    """

    basis: Floats
    handle: Floats


@dataclass(frozen=True)
class Motions:
    """What a mechanism can do.

    entries  name of what each of the m joint coordinates moves: its link's, of a joint of several coordinates with
             a number behind it for all but the last
    places   the reference posture, then postures nearby: the reference may be special
    angles   (n,) joint coordinates with closed loops;   gaps  (k,) that remain [m];   size  of the mechanism [m]
    goal     (6,) position of the handle [m], rotation vector of its axes [rad]
    """

    mechanism: Mechanism
    entries: list[str]
    places: list[Configuration]
    angles: Floats
    gaps: Floats
    size: float
    goal: Floats

    @property
    def basis(self) -> Floats:
        """The motions (m, f) where the loops leave the fewest."""
        return min((place.basis for place in self.places), key=lambda basis: basis.shape[1])

    def rows(self, link: str) -> list[int]:
        """The coordinates of a link's joint."""
        own = {link, *(f"{link}/{k}" for k in range(1, 6))}
        return sorted((u for u, name in enumerate(self.entries) if name in own), key=lambda u: self.order[u])

    @property
    def order(self) -> list[int]:
        """The number of each coordinate's entry among those of its joint; the last has the largest."""
        numbers = (name.partition("/")[2] for name in self.entries)
        return [int(number) if number else 6 for number in numbers]

    @property
    def open_loops(self) -> list[int]:
        """Indices of the loops that do not close."""
        return [k for k, gap in enumerate(self.gaps) if gap > CLOSED * self.size]


def motions(section: dict[str, Any], label: str) -> Motions:
    """The motions of a draft of [mechanism] whose handle is given by its pose, whichever joints the draft says are
    driven or free.

    Raises DeviceError  for numbers that a device file does not allow
    """
    try:
        checked = MechanismSection.model_validate(section)
    except ValidationError as error:
        document = {"mechanism": section}
        faults = [
            Fault(label, dotted(("mechanism", *path), document), message)
            for path, message in validation_messages(error, section)
        ]
        raise DeviceError(faults) from None
    mechanism = build_mechanism(checked)
    mech = pack(mechanism)
    angles, gaps = close_loops(mechanism, mech)
    names = [mechanism.links.names[i] for i in mech.joint]
    places = [_configuration(mech, place) for place in closed_nearby(mech, angles)]
    size = float(mech.size[0])
    return Motions(mechanism, names, places, angles, gaps, size, handle_goal(mech, 0, angles))


def _configuration(mech: MechanismArrays, angles: Floats) -> Configuration:
    loops = int(mech.first_row[-1])
    rows = constraints(mech, 0, angles, np.zeros(6))[0] * mech.unit[0][:, None]
    return Configuration(null_space(rows[:, :loops].T), np.asarray(rows[:, loops : loops + 6].T))


def independent(basis: Floats, groups: Iterable[Sequence[int]], kept: Sequence[int] = ()) -> list[int]:
    """Which groups of rows of a basis, each with those before it, are independent of the rows kept so far."""
    chosen, rows = [], list(kept)
    for k, group in enumerate(groups):
        if _rank(basis[[*rows, *group]]) == len(rows) + len(group):
            chosen.append(k)
            rows += group
    return chosen


def left_over(basis: Floats, rows: Sequence[int]) -> Floats:
    """The motions (m, f') in which these coordinates rest."""
    if not rows or not basis.size:
        return basis
    _, values, right = np.linalg.svd(basis[list(rows)])
    rank = int(np.sum(values > INDEPENDENT * values[0])) if values.size and values[0] > 0.0 else 0
    return np.asarray(basis @ right[rank:].T)


def _rank(rows: Floats) -> int:
    values = np.linalg.svd(rows, compute_uv=False)
    return int(np.sum(values > INDEPENDENT * max(values[0], np.finfo(float).tiny))) if values.size else 0


def handle_motions(place: Configuration, driven: Sequence[int], free: Sequence[int]) -> Floats:
    """Motions of the handle by each driven coordinate while the free ones rest, (6, d)."""
    rows = [*driven, *free]
    rates = np.linalg.lstsq(place.basis[rows], np.eye(len(rows)), rcond=None)[0]
    return np.asarray(place.handle @ place.basis @ rates)[:, : len(driven)]


def controls_of(H: Floats) -> str | None:
    """The least of the handle whose motions tell those of all drives: "position", "orientation" or "pose"; None:
    some drive moves while the handle rests."""
    for controls, part in (("position", H[:3]), ("orientation", H[3:]), ("pose", H)):
        if controlled(part):
            return controls
    return None


def controlled(part: Floats) -> bool:
    """Whether motions of the handle (r, d) tell those of all drives."""
    values = np.linalg.svd(part, compute_uv=False)
    return len(values) == part.shape[1] and bool(values[-1] > REGULAR * max(values[0], np.finfo(float).tiny))


def idle(H: Floats) -> list[int]:
    """The drives that do not move the handle at all."""
    sizes = np.abs(H).max(axis=0)
    return [
        int(k) for k in np.flatnonzero(sizes <= NEGLIGIBLE * max(sizes.max(initial=0.0), np.finfo(float).tiny))
    ]
