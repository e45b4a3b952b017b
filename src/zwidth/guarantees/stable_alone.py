"""Whether a device is stable by itself, without wall and hand: the premise of every guarantee.

A guarantee follows rays of walls from K = B = 0 outwards and says that no root crosses the unit circle on the way.
That says something only where none lies outside at the beginning.

Masses on springs and dampers, M x'' + B x' + K x = 0 with M > 0 and B >= 0, grow if and only if K has a negative
eigenvalue, whatever B is (Kelvin, Tait and Chetaev): the signs of K decide, and no pole near the edge has to be
computed. A free motion, K = 0, has a root at z = 1: the position that nobody holds, which does not grow. Where B
takes in no power along some motion, or the computer adds feedback of its own, the roots themselves decide.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, Literal

import numpy as np
import scipy.linalg

from zwidth.arrays import Floats
from zwidth.chart.verdict import BAND
from zwidth.guarantees.port import port
from zwidth.loop.closed_plant import close_plant, zero_poles
from zwidth.loop.loop import Loop
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import Plant
from zwidth.result import Documented, entry

AS_BENT: Final = "links that bend are linearised as the load bends them"
STABLE_ALONE: Final = "the device by itself, without wall and hand, is stable"
# Share of the terms of v^T K v below which its sign is not told from rounding: a thousand times the rounding of a
# sum of some terms. Larger, and weak negative springs pass as unknown; smaller, and rounding passes as one.
SIGN: Final = 1e-10
# The same of the damping along a motion: dampers that are written down singular have eigenvalues of -1e-16.
DAMPS: Final = 1e-12
# Half-width of the band about the unit circle within which a root is not told from one on it, as for walls.
ROUNDING: Final = 1e-15  # of a computed root, in units of its own condition number and of the matrix


@dataclass(frozen=True)
class Premise(Documented):
    """What must hold for a claim.

    what    a sentence
    holds   None: it is not known
    how     it was decided: "computed", "by the file" or "not checked"
    reason  why it does not hold, or is not known, in words; "" where it holds
    """

    what: str = field(metadata=entry())
    holds: bool | None = field(metadata=entry())
    how: Literal["computed", "by the file", "not checked"] = field(metadata=entry())
    reason: str = field(default="", metadata=entry(empty="left out"))

    @property
    def fails(self) -> bool:
        """Whether the premise is known not to hold."""
        return self.holds is False


NOT_MEASURED: Final = Premise(
    STABLE_ALONE,
    None,
    "not checked",
    "that the device by itself is stable is assumed: a response alone cannot show it",
)


def bent_as_loaded(omission: str) -> Premise:
    """The premise that fails of links that bend under load, of which an answer leaves out something, in words."""
    return Premise(AS_BENT, False, "computed", f"no guarantee holds under this load: {omission}")


def stable_alone(loop: Loop) -> Premise:
    """The premise that a loop does not grow without a wall; an operator attached to its plant counts as a part of
    the device.

    Motions that no wall moves count too, but those that stand apart under a load (`Plant.apart`).
    """
    if loop.has_fixed_feedback:
        return _by_roots(loop)
    plant = loop.plant
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    drag = np.linalg.eigvalsh(shapes.T @ ((plant.damping + plant.damping.T) / 2.0) @ shapes)
    if drag[0] < -DAMPS * max(float(np.max(np.abs(drag))), np.finfo(float).tiny):
        return _by_poles(plant, squared)
    below = shapes[:, squared < 0.0]  # shapes v with v^T K v < 0
    if not below.shape[1]:
        return _premise(True)
    pull = np.einsum("ik,ik->k", below, plant.stiffness @ below)
    terms = np.einsum("ik,ik->k", np.abs(below), np.abs(plant.stiffness) @ np.abs(below))
    if not np.any(-pull > SIGN * terms):
        return _premise(None)
    poles = port(plant, plant.actuator).poles
    return _premise(False, float(np.max(poles.real, initial=0.0)))


def _by_poles(plant: Plant, squared: Floats) -> Premise:
    """The premise of a plant some of whose dampers push, by its poles s [1/s]; squared (n,): squared natural
    frequencies, 0 of free motions."""
    poles, error = _eigenvalues(port(plant, plant.actuator).generator)
    free = int(np.count_nonzero(squared == 0.0))  # of each at least one pole is exactly 0
    poles[np.argsort(np.abs(poles))[:free]] = 0.0
    growth = poles.real
    if np.any(growth > np.maximum(error, SIGN * np.abs(poles))):
        return _premise(False, float(np.max(growth)))
    return _premise(None if np.any((growth > -error) & (poles != 0.0)) else True)


def _by_roots(loop: Loop) -> Premise:
    """The premise of a loop with feedback beside the wall law, by the roots z = 1 + d of its sampled states."""
    form, states = close_plant(loop.plant, loop.controller)
    period = loop.period
    hidden = float(np.max(states.hidden, initial=0.0))
    if not len(form.growth):
        return _premise(hidden <= SIGN / period, hidden)
    d, error = _eigenvalues(form.growth)
    neutral = zero_poles(states, loop.controller)
    d[np.argsort(np.abs(d))[:neutral]] = 0.0  # those that are at z = 1 exactly, which rounding has moved
    excess = d.real + 0.5 * np.abs(d) ** 2  # (|z|^2 - 1)/2, next to the circle |z| - 1, without cancellation
    rate = max(float(np.max(np.log1p(2.0 * np.maximum(excess, 0.0)))) / (2.0 * period), hidden)
    if np.any(excess > np.maximum(BAND, error)) or hidden > SIGN / period:
        return _premise(False, rate)
    # a slow root that decays without vibration, excess = -|d|, is told from the circle however near to z = 1 it is
    near = (excess > -np.minimum(np.maximum(BAND, error), 0.5 * np.abs(d))) & (d != 0.0)
    return _premise(None if np.any(near) else True)


def _eigenvalues(matrix: Floats) -> tuple[Any, Floats]:
    """Eigenvalues (n,) of a matrix, and what of each may be rounding, by its own condition number."""
    values, left, right = scipy.linalg.eig(matrix, left=True)
    condition = 1.0 / np.maximum(np.abs(np.sum(left.conj() * right, axis=0)), 1e-300)
    return values, ROUNDING * len(values) * float(np.linalg.norm(matrix)) * condition


def _premise(holds: bool | None, rate: float = 0.0) -> Premise:
    """The premise that `holds` (None: undecided), with the rate of growth [1/s] where it does not."""
    reason = ""
    if holds is None:
        reason = (
            "whether the device by itself, without wall and hand, is stable is not known: rounding hides it; "
            "that it is so is assumed"
        )
    elif not holds:
        reason = (
            f"the device by itself, without wall and hand, is unstable: it grows by {rate:.4g} 1/s, and no "
            "guarantee holds for such a device"
        )
    return Premise(STABLE_ALONE, holds, "computed", reason)
