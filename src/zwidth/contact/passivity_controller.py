"""Passivity observer and controller: damping is added when the environment has given out energy, and only then.

The observer counts the energy E that has gone into the environment, force against displacement d_n = x_n -
x_{n-1} from sample to sample. Below its reference E_0 the controller adds a damper to the environment's force
F_n (on the device), large enough for one period to take back what is missing:

    alpha_n = (E_0 - E_n)/(T v_n^2),   v_n = d_n/T,   force = F_n - alpha_n v_n

Two ways of counting (F' = force with the controller's part):

    "held"     E_n = E_{n-1} - F'_{n-1} d_n
               the force that was held while the device moved by d_n: the work as it was done, where the device
               gets the command at once and unchanged
    "sampled"  E_n = E_{n-1} - F_n d_n,   and E_n + alpha_n v_n^2 T is carried on
               the force against the motion before it

"Sampled" is the series controller for impedance causality of Hannaford and Ryu, Time-domain passivity control of
haptic interfaces, IEEE Trans. Robotics and Automation 18 (2002) 1-10 (second-hand: the paper could not be read;
its recursion is as others have coded it). Its energy, controller included, is never below the reference. But the
hold's own energy escapes it: a spring makes K d_n^2/2 in each period, and "sampled" counts that as taken. "Held"
sees it (so Stramigioli et al. 2002 count, second-hand); there the damper's work is known one sample later, and
energy can be below the reference for some samples.

Physical damping b of the device covers part of it. It takes at least b d_n^2/T in a period, whatever the motion
within, and "held" can count that in: E_n = E_{n-1} - F'_{n-1} d_n + b d_n^2/T. A spring up to K = 2 b/T, the limit
of Colgate and Schenkel 1997, is then never touched.

Energy that was taken earlier is credit: the controller acts only when it is spent. It may act outside the wall,
where what is missing is missing still.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, isnan
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.compiled import compiled

PASSIVITY_MEMORY: Final = 4
BEGUN, LAST_POSITION, ENERGY, LAST_FORCE = range(PASSIVITY_MEMORY)
REFERENCE, LARGEST_DAMPING, LARGEST_FORCE, DEVICE_DAMPING, HELD = range(5)


@dataclass(frozen=True)
class PassivityController:
    """A damper that takes back what the environment has given out (Hannaford and Ryu 2002, second-hand).

        alpha = (E_0 - E)/(T v^2) where E < E_0, else 0;   force = F - alpha v

    How the energy E is counted, with sources: see `zwidth.contact.passivity_controller`.

    largest_damping   of the damper that it adds [N s/m]; inf: none. alpha grows without bound as the device slows
                      down, and a sampled damper makes energy itself from about the device's mass over the period
                      on: stay below half of that, or the controller can drive what it should calm
    largest_force     that it adds [N]
    reference_energy  E_0 [J], not positive: the controller acts below it; -0.01 lets the environment give 10 mJ
    device_damping    b of the device that is counted in [N s/m]; only with "held"
    counting          "held": the force that was held counts for the motion under it; "sampled": each force for the
                      motion before it
    Raises            ValueError  for limits that are not positive, a reference above zero, a negative damping
                      of the device or another counting

    >>> PassivityController(5.0).parameters
    array([ 0.,  5., inf,  0.,  1.])
    """

    largest_damping: float
    largest_force: float = inf
    reference_energy: float = 0.0
    device_damping: float = 0.0
    counting: Literal["held", "sampled"] = "held"

    def __post_init__(self) -> None:
        """Raise ValueError for a number, or a way of counting, that is not allowed."""
        for name, unit in (("largest_damping", "N s/m"), ("largest_force", "N")):
            value = getattr(self, name)
            if isnan(value) or value <= 0.0:
                raise ValueError(f"{name} of the passivity controller must be positive [{unit}], got {value!r}")
        if not isfinite(self.reference_energy) or self.reference_energy > 0.0:
            raise ValueError(
                "reference_energy of the passivity controller must be zero or negative [J] (what the environment "
                f"may give out), got {self.reference_energy!r}"
            )
        if not (isfinite(self.device_damping) and self.device_damping >= 0.0):
            raise ValueError(
                "device_damping of the passivity controller must be zero or positive [N s/m], "
                f"got {self.device_damping!r}"
            )
        if self.counting not in ("held", "sampled"):
            raise ValueError(
                f'counting of the passivity controller must be "held" or "sampled", got {self.counting!r}'
            )

    @property
    def parameters(self) -> Floats:
        """Reference energy, largest damping and force, device damping, and 1 for counting "held" (5,)."""
        held = float(self.counting == "held")
        limits = [self.reference_energy, self.largest_damping, self.largest_force]
        return np.array([*limits, self.device_damping, held])


@compiled
def passivity_force(memory: Floats, parameters: Floats, force: float, position: float, period: float) -> float:
    """The environment's force with what the controller adds to it.

    memory      (4,)  BEGUN to LAST_FORCE, zeros at the start; ENERGY is what the environment has taken [J]:
                      counted "held" before this sample's force acts, counted "sampled" with the controller's part
    parameters  (5,)  REFERENCE to HELD, from `PassivityController.parameters`
    force       on the device along +y [N];   position  as counted [m];   period  T [s]
    Returns     the force to be sent [N]; the same force at the first sample and where the device does not move
    """
    if memory[BEGUN] == 0.0:
        memory[BEGUN], memory[LAST_POSITION], memory[LAST_FORCE] = 1.0, position, force
        return force
    moved = position - memory[LAST_POSITION]
    held = parameters[HELD] > 0.0
    energy = memory[ENERGY] - (memory[LAST_FORCE] if held else force) * moved
    if held:
        # b (moved)^2 / T is the least that the damper takes on this way: at constant speed
        energy += parameters[DEVICE_DAMPING] * moved * moved / period
    missing = parameters[REFERENCE] - energy
    extra = 0.0
    if missing > 0.0 and moved != 0.0:
        damping = min(missing * period / (moved * moved), parameters[LARGEST_DAMPING])
        extra = -np.sign(moved) * min(damping * abs(moved) / period, parameters[LARGEST_FORCE])
    if not held:
        energy -= extra * moved
    memory[LAST_POSITION], memory[ENERGY], memory[LAST_FORCE] = position, energy, force + extra
    return float(force + extra)


def rendered_stiffness(position: ArrayLike, force: ArrayLike, wall_position: float = 0.0) -> float:
    """Stiffness that was felt: the slope of force over penetration, by least squares through the wall's surface.

        K = -sum(f p)/sum(p^2)      over the samples with p = position - wall_position > 0

    position  (samples,) [m];   force  (samples,) on the device along +y [N]
    Returns   [N/m]; nan where there was no contact, or a single value is nan
    Raises    ValueError  for arrays of different lengths

    >>> round(rendered_stiffness([-1e-3, 1e-3, 2e-3], [0.0, -1.0, -2.0]), 6)
    1000.0
    """
    x, f = np.asarray(position, dtype=float), np.asarray(force, dtype=float)
    if x.shape != f.shape or x.ndim != 1:
        raise ValueError(f"position and force must be series of one length, got shapes {x.shape} and {f.shape}")
    # outside 0 x, so that a nan is kept
    penetration = np.where(x - wall_position > 0.0, x - wall_position, 0.0 * x)
    squares = float(penetration @ penetration)
    return -float(f @ penetration) / squares if squares > 0.0 else float("nan")
