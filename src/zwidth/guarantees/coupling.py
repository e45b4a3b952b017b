"""Virtual couplings k_c, b_c that keep a device stable, and the stiffest through which one wall is stable."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from zwidth.arrays import Floats
from zwidth.guarantees.port import hold_fixed, port
from zwidth.guarantees.region import Region, empty_region, outline_columns, stiffness_text
from zwidth.guarantees.stable_alone import stable_alone
from zwidth.guarantees.two_port import (
    CouplingDemand,
    coupling_impedance,
    llewellyn_demand,
    raisbeck_demand,
    sampled_demand,
)
from zwidth.loop.loop import Loop
from zwidth.result import Documented, Result, documented, entry

# Number of ratios of damping to stiffness tried, and steps of golden section between them.
DIRECTIONS, STEPS = 721, 60
# Relative difference below which two stiffnesses count as equal.
LEVEL = 1e-7
NOTHING = "no coupling meets the condition at all frequencies: the device dissipates too little at the handle"
NO_HANDLE = "a coupling is judged at the handle, and the plant has none; give plant.handle"
# Lowest angle wT that is looked at [rad].
LOWEST = 3e-4
# A demand proportional to a lower power of the angle than this, towards 0, excludes every spring: springs need the
# power 2, and the other powers that devices have are 0 and -2.
LEAST_ORDER = 1.0
# Steps across a resonance, in units of its width, on both sides.
ACROSS = np.sinh(np.linspace(-6.0, 6.0, 41)) / 4.0


@dataclass(frozen=True)
class Coupling(Documented):
    """The stiffest coupling that a wall may be rendered through.

    stiffness, damping  k_c [N/m], b_c [N s/m]; inf and 0 where the wall needs none, 0 and 0 where none suffices
    felt_stiffness      stiffness of wall and coupling in series, k_c K/(k_c + K) [N/m]
    """

    stiffness: float = field(metadata=entry("N/m"))
    damping: float = field(metadata=entry("N s/m"))
    felt_stiffness: float = field(metadata=entry("N/m"))

    @property
    @documented()
    def needed(self) -> bool:
        """Whether the wall needs a coupling."""
        return self.stiffness != float("inf")


@dataclass(frozen=True)
class Couplings(Result):
    """Regions of couplings (k_c, b_c): after Llewellyn, after Raisbeck, and of the sampled device itself.

    limit   stiffest coupling for one wall, on the sampled device; None if no wall was given
    reason  why there are no regions; None where there are
    """

    llewellyn: Region = field(metadata=entry())
    raisbeck: Region = field(metadata=entry())
    sampled: Region = field(metadata=entry())
    limit: Coupling | None = field(metadata=entry())
    reason: str | None = None

    @property
    def regions(self) -> dict[str, Region]:
        """The three regions by name."""
        return {"llewellyn": self.llewellyn, "raisbeck": self.raisbeck, "sampled": self.sampled}

    def document(self) -> dict[str, Any]:
        """The couplings by key and unit; only the reason where there are none."""
        if self.reason is not None:
            return {"reason": self.reason}
        return super().document()

    def table(self) -> dict[str, list[Any]]:
        """The outlines as columns, region after region."""
        return outline_columns(self.regions, "coupling")

    def __repr__(self) -> str:
        """The stiffest coupling of each region, and the one that the wall needs."""
        if self.reason is not None:
            return f"Couplings: none: {self.reason}"
        text = "Couplings: " + ", ".join(f"{name} {stiffness_text(one)}" for name, one in self.regions.items())
        if self.limit is None:
            return text
        needed = f"at most {self.limit.stiffness:.6g} N/m" if self.limit.needed else "no coupling"
        return f"{text}\n  the wall needs {needed}, felt {self.limit.felt_stiffness:.6g} N/m"


def couplings(loop: Loop, held: Floats, wall: tuple[float, float] | None = None) -> Couplings:
    """The regions of couplings of a loop whose operator holds it along `held` (n,).

    wall  K [N/m] and B [N s/m] of a wall: also the stiffest coupling that it needs
    """
    if (alone := stable_alone(loop)).fails:
        return no_couplings(alone.reason)
    angles = coupling_angles(loop, held)
    sampled = sampled_demand(loop, angles, held)
    return Couplings(
        coupling_region(llewellyn_demand(loop, angles, held), loop.period),
        coupling_region(raisbeck_demand(loop, angles, held), loop.period),
        coupling_region(sampled, loop.period),
        None if wall is None else softest_limit(sampled, *wall, loop.period),
    )


def no_couplings(reason: str = NO_HANDLE) -> Couplings:
    """The result with empty regions, and the reason why no coupling is known."""
    none = empty_region(reason)
    return Couplings(none, none, none, None, reason)


def coupling_angles(loop: Loop, held: Floats) -> Floats:
    """Ascending angles w T in (0, pi) of a demand; the last is just below pi, where Tustin's hold is 0."""
    angles = angle_grid(loop, held)
    even = np.linspace(0.0, np.pi, 2001)[1:]
    return np.minimum(np.union1d(angles, even), np.pi * (1.0 - 1e-9))


def coupling_region(demand: CouplingDemand, period: float) -> Region:
    """The couplings that meet a demand for every passive environment: a ring of [k_c, b_c]; empty where the demand
    is not finite, or none with k_c > 0 meets it.

    Along a ray from 0 couplings meet it up to  min over angles of Re(1/Z_c)/conductance;  each angle asks for an
    ellipse, so that the set is convex.
    """
    if not np.all(np.isfinite(demand.conductance)) or _excludes_springs(demand):
        return empty_region(NOTHING)

    def reach(direction: Floats) -> Floats:
        """Length (k,) of rays of couplings that meet the demand, in the plane of k_c T and b_c, at angles (k,)."""
        Z = coupling_impedance(np.cos(direction) / period, np.sin(direction), demand.angles, period)
        # Re(1/Z_c) = Re Z_c / |Z_c|^2
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(demand.conductance > 0.0, Z.real / np.abs(Z) ** 2 / demand.conductance, np.inf)
            return np.asarray(np.maximum(ratio.min(axis=-1), 0.0))

    # only k_c >= 0: a negative k_c drifts away by itself
    direction = np.linspace(-np.pi / 2.0, np.pi / 2.0, DIRECTIONS)
    far = reach(direction)
    k, b = far * np.cos(direction) / period, far * np.sin(direction)
    if not np.max(k) > 0.0 or not np.all(np.isfinite(far)):
        return empty_region(NOTHING)
    ring = np.vstack([np.column_stack([k, b]), [[k[0], b[0]]]])
    best = _stiffest(reach, direction[int(np.argmax(np.where(direction >= 0.0, k, -np.inf)))])
    top = float(reach(np.array([best]))[0])
    return Region((ring,), top * float(np.cos(best)) / period, top * float(np.sin(best)))


def _excludes_springs(demand: CouplingDemand) -> bool:
    """Whether no coupling with a spring meets the demand in the limit of the angle to 0.

    Re(1/Z_c) of every coupling with k_c != 0 falls there as theta^2. So does the demand of a device that
    dissipates against the ground. The demand of one that dissipates only within its structure grows as theta^-2:
    each spring fails below some angle. The couplings that pass on a grid of angles are then as small as the square
    of its lowest angle; they belong to the grid and not to the device.
    """
    angles, conductance = demand.angles, demand.conductance
    n = int(np.searchsorted(angles, 2.0 * angles[0]))  # an octave above the lowest, to tell the power of growth
    return bool(conductance[0] > 0.0 and conductance[n] < conductance[0] * (angles[n] / angles[0]) ** LEAST_ORDER)


def _stiffest(reach: Callable[[Floats], Floats], near: float) -> float:
    """The direction, an angle from k_c T to b_c, of the ray with the largest k_c among those with b_c >= 0: golden
    section round `near`; of equal ones the least damped. reach: lengths (k,) of rays at directions (k,)."""
    step = np.pi / (DIRECTIONS - 1)
    low, high = max(near - step, 0.0), min(near + step, np.pi / 2.0)
    ratio = (np.sqrt(5.0) - 1.0) / 2.0

    def stiffness(direction: float) -> float:
        return float(reach(np.array([direction]))[0] * np.cos(direction))

    ends = (low, high)
    for _ in range(STEPS):
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        if stiffness(b) > stiffness(a):
            low = a
        else:
            high = b
    top = max((*ends, (low + high) / 2.0), key=stiffness)
    # of equally stiff ones the least damped
    return ends[0] if stiffness(ends[0]) >= (1.0 - LEVEL) * stiffness(top) else top


def softest_limit(demand: CouplingDemand, wall_stiffness: float, wall_damping: float, period: float) -> Coupling:
    """The stiffest coupling through which one wall is stable with every passive operator: inf where it needs none,
    0 where none suffices.

    Wall Z_w = B + K T z/(z - 1) and coupling in series must stay clear of the disk that the device shows,

        |1/Z_c + 1/Z_w + q| >= r

    Along a ray of couplings, 1/Z_c = mu a, that is a quadratic in mu at each angle,

        |a|^2 mu^2 + 2 Re(a* (x + q)) mu + |x|^2 + 2 Re(x* q) + |q|^2 - r^2 >= 0,     x = 1/Z_w

    and the best ratio b_c/k_c is searched for. At low angles |q| and r are many orders larger than what is left of
    them, so that the power |q|^2 - r^2 is taken from `demand.power`, and the root of a rising quadratic in the
    form without a difference.

    wall_stiffness, wall_damping  K [N/m], B [N s/m];   period  T [s]
    """
    angles = demand.angles
    wall = 1.0 / coupling_impedance(wall_stiffness, wall_damping, angles, period)
    shown = demand.centre + wall  # x + q
    # the quadratic's constant term
    power = np.abs(wall) ** 2 + 2.0 * np.real(wall.conj() * demand.centre) + demand.power
    direction = np.linspace(0.0, np.pi / 2.0, DIRECTIONS)[:-1]

    def reach(direction: Floats) -> Floats:
        """Length (k,) of rays of allowed couplings in the plane of k_c T, b_c, at angles (k,); inf: no limit."""
        # on the ray of length 1; mu scales 1/Z_c, so that its largest failing one is 1 over the length
        a = 1.0 / coupling_impedance(np.cos(direction) / period, np.sin(direction), angles, period)
        lean, size = np.real(a.conj() * shown), np.abs(a) ** 2
        with np.errstate(invalid="ignore", divide="ignore"):
            discriminant = lean**2 - size * power
            root = np.sqrt(np.maximum(discriminant, 0.0))
            mu = np.where(lean > 0.0, -power / (lean + root), (root - lean) / size)
            mu = np.where(discriminant >= 0.0, mu, 0.0)
            return np.asarray(1.0 / np.maximum(np.max(mu, axis=-1), 0.0))

    if not np.all(np.isfinite(demand.radius)):
        return Coupling(0.0, 0.0, 0.0)
    far = reach(direction)
    if np.isinf(far).any():
        return Coupling(float("inf"), 0.0, wall_stiffness)
    best = _stiffest(reach, float(direction[int(np.argmax(far * np.cos(direction)))]))
    top = float(reach(np.array([best]))[0])
    k, b = top * float(np.cos(best)) / period, top * float(np.sin(best))
    return Coupling(k, b, k * wall_stiffness / (k + wall_stiffness))


def angle_grid(loop: Loop, held: Floats) -> Floats:
    """Ascending angles (k,) in (0, pi] that resolve a loop's response: even, geometric towards zero, and dense
    across every resonance.

    Resonances are the plant's, free, held fixed, and with its actuator held fixed (where it dissipates little seen
    from outside), folded into (0, pi).
    """
    plant = loop.plant
    plants = (plant, hold_fixed(plant, held), hold_fixed(plant, plant.actuator))
    poles = np.concatenate([port(one, one.actuator).poles for one in plants if one.size])
    poles = poles[poles.imag > 0.0] * loop.period
    turn = np.mod(poles.imag, 2.0 * np.pi)
    centre = np.where(turn > np.pi, 2.0 * np.pi - turn, turn)
    width = np.maximum(-poles.real, 1e-9 * np.abs(poles.imag))
    # well below the slowest resonance, but not where rounding hides the response
    lowest = min(LOWEST, 0.02 * float(np.min(np.abs(poles), initial=1.0)))
    lowest = max(lowest, 1e-6)
    across = (centre[:, None] + width[:, None] * ACROSS).ravel()
    even = np.linspace(0.0, np.pi, 401)[1:]
    slow = np.geomspace(lowest, 0.3, int(30 * np.log10(0.3 / lowest)))
    angles = np.unique(np.concatenate([across, even, slow, [lowest, np.pi]]))
    return angles[(angles >= lowest) & (angles <= np.pi)]
