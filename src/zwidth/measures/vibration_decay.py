"""Decay of vibration at a wanted wall, and the motor-side mass of fastest decay (thesis section 5.2.2).

The motor side's mass m on the structure's spring k_e, the link side held still, no damping, no delay. With
g = 1 - cos W, W = sqrt(k_e/m) T, P = K/k_e, D = B/(k_e T) the transition matrix of a wall K, B has the roots of

    z^3 + (g (2 + P + D) - 2) z^2 + (1 + g P) z - g D = 0

Of three roots two are conjugate, or of equal sign: let R > 0 be their product. The third is then g D/R, and
comparing coefficients leaves, with x = 1 - g, the thesis's (5.13):

    g^2 (D/R) (2 + P + D + D/R) - g (2 D/R - P) + 1 - R = 0

A real g needs a discriminant that is not negative, which is R >= rho^2 with

    rho^2 = 8 D (1 + P)/((2 D + P)^2 + 8 D)                                                   (thesis eq. 5.15)
    g     = rho^2 (2 D - P rho^2)/(2 D (rho^2 (2 + P + D) + D))                               (thesis eq. 5.14)

So rho is a lower bound: with no mass does this wall's slowest root decay faster. It is reached, with the
mass of that g, if the two roots are conjugate, the third, g D/rho^2, is not slower, and 0 < g < 2. For K >= 0 that
is B > K T/2 and a third root of at most rho: the rest follows. Where it is not reached the least spectral radius
is larger and with another mass (`fastest_mass` finds it, for any model). The scan damages the last
term under the root of (5.15) to "KZAL"; it is (K T)^2.

Functions `..._at` are the catalogue's measures of an operating point. Stability is that of the device with its
operator.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.chart.table_radii import radii_at_points
from zwidth.chart.verdict import NAMES, NEAR, STABLE, UNSTABLE, Verdicts, judge, spectral_radius
from zwidth.errors import NoValueError
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import MeasureValues, WantedWall, WantedWalls
from zwidth.measures.evaluation import complete_pointwise
from zwidth.measures.preconditions import walls_of
from zwidth.model.plant import Plant

# Masses tried per factor of ten, and how near to the best spectral radius one must be to be refined.
TRIED: Final = 60
NEAR_BEST: Final = 1e-2


@dataclass(frozen=True)
class OptimalMass:
    """The motor-side mass at which a wall's slowest vibration decays fastest (thesis eq. 5.14, 5.15), all (...).

    mass             [kg]; nan where (5.15) is not reached
    spectral_radius  with that mass; nan likewise
    bound            (5.15) itself: no mass makes the spectral radius smaller; nan for walls without damping
    """

    mass: Floats
    spectral_radius: Floats
    bound: Floats


def optimal_mass(
    wall_stiffness: ArrayLike, wall_damping: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike
) -> OptimalMass:
    """The motor-side mass of fastest decay at a wall, in closed form (see above for the derivation).

    wall_stiffness   (...)  K [N/m], above -k_e
    wall_damping     (...)  B [N s/m], above 0
    stiffness        (...)  k_e between motors and links [N/m]
    sampling_period  (...)  T [s]
    Returns          (...)  all broadcast; mass and radius nan unless B > K T/2, W < pi and no root is larger than
                            rho, and where a number is out of its range, as the bound then is, too. Of the masses
                            that aliasing makes equal the largest, with W < pi

    The walls B and C of the thesis's Fig. 5.11 (whose results it prints for each other):

    >>> optimum = optimal_mass([3000.0, 4000.0], [15.0, 20.0], 15620.0, 0.00125)
    >>> optimum.spectral_radius.round(6).tolist(), optimum.mass.round(7).tolist()
    ([0.895606, 0.872978], [0.0510576, 0.0602998])
    """
    K, B, k, T = (
        np.asarray(v, dtype=np.float64) for v in (wall_stiffness, wall_damping, stiffness, sampling_period)
    )
    is_valid = (B > 0.0) & (k > 0.0) & (T > 0.0) & (-k < K) & np.isfinite(K + B + k + T)
    k, T = np.where(is_valid, k, 1.0), np.where(is_valid, T, 1.0)
    P, D = np.where(is_valid, K, 0.0) / k, np.where(is_valid, B, 1.0) / (k * T)
    R = 8.0 * D * (1.0 + P) / ((2.0 * D + P) ** 2 + 8.0 * D)
    g = R * (2.0 * D - P * R) / (2.0 * D * (R * (2.0 + P + D) + D))
    # the third root, and the sum of the other two, by the polynomial's coefficients
    third, pair = g * D / R, 2.0 - g * (2.0 + P + D) - g * D / R
    # at g = 2 the motor's vibration is at half the sampling frequency, where the wall moves nothing that is read
    reached = is_valid & (2.0 * D > P) & (g < 2.0) & (pair**2 <= 4.0 * R) & (third**2 <= R)
    # W by its half angle, which keeps the digits of slow vibrations
    W = 2.0 * np.arcsin(np.sqrt(np.clip(g / 2.0, 1e-300, 1.0)))
    mass, rho = k * (T / W) ** 2, np.sqrt(R)
    return OptimalMass(
        np.where(reached, mass, np.nan), np.where(reached, rho, np.nan), np.where(is_valid, rho, np.nan)
    )


def fastest_mass(
    loop: Loop, wall_stiffness: float, wall_damping: float, lowest: float, highest: float
) -> tuple[float, float]:
    """Motor-side mass [kg] and spectral radius of the fastest decay at a wall, for any model and computer.

    By eigenvalues: all masses of a fine logarithmic scale, then the best of them refined. A minimum may be a
    corner, where the slowest root changes, or a cusp, where two roots meet; it is bracketed, not differentiated.

    loop             whose plant has its motor-side mass changed (`with_motor_side_mass`)
    lowest, highest  masses between which it is looked for [kg], 0 < lowest < highest; an end may be the answer
    Returns          mass, to about 1e-7 of itself, and spectral radius there; above 1 if no mass is stable
    Raises           ValueError  for masses out of order or not positive, or a wall that is not finite
    """
    if not 0.0 < lowest < highest < np.inf:
        raise ValueError(f"masses must satisfy 0 < lowest < highest, got {lowest:g} and {highest:g}")
    if not np.isfinite(wall_stiffness + wall_damping):
        raise ValueError(f"the wall must be finite, got {wall_stiffness:g} N/m and {wall_damping:g} N s/m")
    from scipy.optimize import minimize_scalar

    def radius(log_mass: float) -> float:
        """Spectral radius at the wall with a motor-side mass, given by its logarithm."""
        changed = replace(loop, plant=with_motor_side_mass(loop.plant, float(np.exp(log_mass))))
        return float(spectral_radius(changed, wall_stiffness, wall_damping))

    scale = np.linspace(np.log(lowest), np.log(highest), max(int(TRIED * np.log10(highest / lowest)), 8))
    radii = np.array([radius(at) for at in scale])
    best = (float(radii.min()), float(scale[np.argmin(radii)]))  # spectral radius, and logarithm of the mass
    padded = np.concatenate([[np.inf], radii, [np.inf]])
    lowest_of_three = (radii <= padded[:-2]) & (radii <= padded[2:])
    for i in np.flatnonzero(lowest_of_three & (radii <= best[0] + NEAR_BEST)).tolist():
        bounds = scale[max(i - 1, 0)], scale[min(i + 1, len(scale) - 1)]
        refined = minimize_scalar(radius, bounds=bounds, method="bounded", options={"xatol": 1e-10})
        best = min(best, (float(refined.fun), float(refined.x)))
    return float(np.exp(best[1])), best[0]


def with_motor_side_mass(plant: Plant, mass: float) -> Plant:
    """The plant with another mass at its actuator, along the rendered direction: M + (m - m_a) a a^T.

    By Sherman and Morrison's formula m_a = 1/(a^T M^-1 a), the motor-side mass (thesis eq. 2.28), becomes m.

    mass    m [kg], positive
    Raises  ValueError  otherwise
    """
    if not 0.0 < mass < np.inf:
        raise ValueError(f"the motor-side mass must be positive and finite, got {mass:g} kg")
    a = plant.actuator
    present = 1.0 / float(a @ np.linalg.solve(plant.mass, a))
    return replace(plant, mass=plant.mass + (mass - present) * np.outer(a, a))


def decay_time(radius: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Time in which the slowest root shrinks to 1/e: T/(-ln radius) [s].

    radius           (...)  spectral radius
    sampling_period  (...)  T [s]
    Returns          (...)  0 for a radius of 0, inf for 1, nan above, where vibration grows

    >>> decay_time([0.9, 1.0, 1.1], 0.001).round(6).tolist()
    [0.009491, inf, nan]
    """
    rho, T = np.asarray(radius, dtype=np.float64), np.asarray(sampling_period, dtype=np.float64)
    if np.any(T <= 0.0):
        raise ValueError(f"sampling_period must be greater than 0 s, got {float(np.min(T)):g}")
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(rho <= 1.0, T / np.abs(np.log(rho)), np.nan))


Index = tuple[int, ...]


def spectral_radius_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Spectral radius of the wanted wall by eigenvalues, for any model and loop."""

    def alone(at: Index) -> float:
        """Spectral radius at the point of an index."""
        return float(_verdict_at(point, wanted, at).spectral_radius[0])

    return complete_pointwise(_radii(point, wanted), alone, point)


def decay_time_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Time in which the slowest vibration at the wanted wall shrinks to 1/e [s]."""
    radii, period = _radii(point, wanted), np.broadcast_to(point.controller.sampling_period, point.shape)
    known = np.where(radii < 1.0 - NEAR, decay_time(radii, period), np.nan)

    def alone(at: Index) -> float:
        """Decay time at the point of an index [s]. Raises NoValueError where vibration does not decay."""
        radius, verdict = radii[at], UNSTABLE
        if not radius > 1.0 + NEAR:  # too near to 1 for its digits, or nan: not computed with the others
            verdicts = _verdict_at(point, wanted, at)
            radius, verdict = verdicts.spectral_radius[0], int(verdicts.verdict[0])
        if verdict != STABLE:
            raise NoValueError(f"the wanted wall is {NAMES[verdict]} here, so that vibration does not decay")
        return float(decay_time(radius, period[at]))

    return complete_pointwise(known, alone, point)


def _radii(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> Floats:
    """Spectral radius at the wanted wall at each of many points (...); nan where it must be computed by itself."""
    walls = walls_of(wanted, point.shape)
    # a single point has the digits that `Loop.check` has
    return radii_at_points(point, *walls) if point.shape else np.full((), np.nan)


def _verdict_at(point: OperatingPoint, wanted: WantedWall | WantedWalls, at: Index) -> Verdicts:
    """Verdict on the wanted wall at the point of an index, by eigenvalues."""
    K, B = walls_of(wanted, point.shape)
    return judge(point[at].loop, [K[at]], [B[at]])
