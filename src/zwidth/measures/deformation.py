"""How faithfully the handle follows the actuator: the structure's own distortion over frequency.

Let the actuator's coordinate a . x move as x_a e^{jwt}, and leave the handle free. The motion of the handle over
that of the actuator is the structural deformation ratio

    S(w) = x_h/x_a = (h^T D^-1 a)/(a^T D^-1 a),      D = -w^2 M + jw B + K + lagged dampers

1 where the structure moves as one body, of growing size towards the first resonance of what the actuator carries,
and less and less above it. Two masses and a spring: S = (k + jw b)/(k - w^2 m_link + jw b). Its poles are the
resonances with the actuator held (its antiresonances), not those of the free device.

Moreyra and Hannaford (A practical measure of dynamic response of haptic devices, ICRA 1998) measure a device by a
ratio of this name. Their text could not be read: that it compares the motions at the two ends of the structure,
over frequency, is known at second hand, and the formula is ours.

Functions `..._at` are the catalogue's measures of an operating point at a wanted wall. Stability
is that of the device with its operator; the felt impedance and the deformation are those of the device without.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Floats
from zwidth.chart.point_chart import modes_of_points
from zwidth.conditions.assumptions import SPRUNG, UNDELAYED
from zwidth.errors import MeasureError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import OK, MeasureValues, WantedWall
from zwidth.measures.evaluation import evaluate_pointwise, with_status
from zwidth.measures.handle_impedance import handle_of
from zwidth.measures.preconditions import (
    check_assumptions,
    check_motor_encoders,
    frequency_of,
    loop_case,
    plant_with_handle,
    wall_of,
)
from zwidth.measures.vibration_decay import OptimalMass, optimal_mass
from zwidth.model.modes import natural_frequencies, undamped_modes
from zwidth.model.plant import Plant

# Frequencies tried up to the highest, in even steps and again in even ratios from this share of it on; and about
# each resonance, in units of its half width.
TRIED: Final = 200
SLOWEST: Final = 1e-6
ABOUT: Final = np.array([-8.0, -4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0, 8.0])
# Damping ratio below which a resonance has no top that double precision could find.
SHARP: Final = 1e-10


def deformation_ratio(plant: Plant, frequency: ArrayLike) -> Complexes:
    """Motion of the handle per motion of the actuator, S = x_h/x_a, the handle free (see above).

    frequency  (...)  above 0 [Hz]
    Returns    (...)  complex; inf or nan on a resonance without damping
    Raises     HandleError  where the plant has no handle
               ValueError   for a frequency out of range

    >>> link = np.array([[1.0, -1.0], [-1.0, 1.0]])
    >>> motor, hand = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    >>> pair = Plant(np.diag([0.25, 0.05]), 0 * link, 1e4 * link, motor, motor, hand)
    >>> ratio = deformation_ratio(pair, np.array([1.0, 100.0]) / (2 * np.pi))
    >>> ratio.real.round(6).tolist()                                         # 1/(1 - w^2 m/k)
    [1.000025, 1.333333]
    """
    f = np.asarray(frequency, dtype=np.float64)
    if not np.all((f > 0.0) & np.isfinite(f)):
        raise ValueError("frequencies must be positive and finite")
    return np.asarray(1.0 - _fix_actuator(plant).deformation(2.0 * np.pi * f))


def structural_distortion(plant: Plant, frequency: float) -> float:
    """Largest share of the actuator's motion that deforms the structure, max |1 - S|, up to a frequency.

    frequency  [Hz], above 0
    Returns    0 for a rigid device; inf where a resonance without damping lies below the frequency
    Raises     as `deformation_ratio`

    >>> link = np.array([[1.0, -1.0], [-1.0, 1.0]])
    >>> motor, hand = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    >>> pair = Plant(np.diag([0.25, 0.05]), 0 * link, 1e4 * link, motor, motor, hand)
    >>> round(structural_distortion(pair, 100.0 / (2 * np.pi)), 6), structural_distortion(pair, 40.0)
    (0.333333, inf)
    """
    if not 0.0 < frequency < np.inf:
        raise ValueError(f"the frequency must be positive and finite, got {frequency:g} Hz")
    from scipy.optimize import minimize_scalar

    fixed_plant, top = _fix_actuator(plant), 2.0 * np.pi * frequency
    poles = fixed_plant.poles
    sharp = poles.imag[(poles.imag > 0.0) & (np.abs(poles.real) <= SHARP * np.abs(poles)) & (poles.imag < top)]
    # at a resonance without damping that moves the structure, 1 - S grows as w comes nearer: by a hundred from
    # 1e-4 to 1e-6 of w; tenfold tells it from one that moves nothing
    beside = np.abs(fixed_plant.deformation(sharp[:, None] * (1.0 + np.array([1e-6, 1e-4]))))
    if np.any(beside[:, 0] > 10.0 * beside[:, 1]):
        return float("inf")
    # about each resonance, in units of its half width
    near = poles.imag[:, None] + np.abs(poles.real)[:, None] * ABOUT
    even, slow = np.linspace(0.0, top, TRIED)[1:], np.geomspace(SLOWEST * top, top, TRIED)
    frequencies = np.concatenate([even, slow, near[(near > 0.0) & (near < top)]])
    # not at the resonances without damping themselves, which here move nothing
    frequencies = np.unique(frequencies[np.isin(frequencies, sharp, invert=True)])
    sizes = np.abs(fixed_plant.deformation(frequencies))
    best = float(sizes.max())
    left, here, right = sizes[:-2], sizes[1:-1], sizes[2:]
    # the ripple of a plateau is rounding
    tops = (here >= left) & (here >= right) & (here > (1.0 + 1e-9) * np.minimum(left, right))
    # a lower top does not come to be the highest between its neighbours
    for i in np.flatnonzero(tops & (here >= 0.5 * best)) + 1:
        refined = minimize_scalar(
            lambda w: -float(np.abs(fixed_plant.deformation(np.array(w)))),
            bounds=(frequencies[i - 1], frequencies[i + 1]),
            method="bounded",
            options={"xatol": 1e-9 * top},
        )
        best = max(best, -float(refined.fun))
    return best


@dataclass(frozen=True)
class _FixedActuatorPlant:
    """A plant with its actuator's motion prescribed: the other motions, in undamped modes with the actuator fixed.

    squared_frequencies  (m,)    squared frequencies of these modes
    damping              (m, m)
    loss                 (m, m)  imaginary part of the stiffness
    dampers              along (m,), damping, time constant, and along . x_0 of each lagged damper
    push                 (3, m)  excitation of the modes by x_0: by its acceleration, speed and position
    loss_push            (m,)    excitation by its hysteretic loss
    static               (a - h) . x_0
    mode_deformations    (m,)    deformation per mode
    """

    squared_frequencies: Floats
    damping: Floats
    loss: Floats
    dampers: tuple[tuple[Floats, float, float, float], ...]
    push: Floats
    loss_push: Floats
    static: float
    mode_deformations: Floats

    def deformation(self, w: Floats) -> Complexes:
        """Share of the actuator's motion that deforms the structure, 1 - S (...), at w (...) [rad/s]."""
        s = 1j * np.asarray(w, dtype=np.complex128)[..., None]
        by_acceleration, by_speed, by_position = self.push
        push = s**2 * by_acceleration + s * by_speed + by_position + 1j * self.loss_push
        inner = s[..., None] ** 2 * np.eye(len(self.squared_frequencies)) + s[..., None] * self.damping
        inner = inner + np.diag(self.squared_frequencies) + 1j * self.loss
        for along, damping, lag, actuator_share in self.dampers:
            lagged = damping * s / (1.0 + s * lag)
            inner = inner + lagged[..., None] * np.outer(along, along)
            push = push + lagged * actuator_share * along
        return np.asarray(self.static - _solve(inner, push) @ self.mode_deformations)

    @property
    def poles(self) -> Complexes:
        """Poles of the motion with the actuator fixed, without the hysteretic loss [1/s]."""
        m, n = len(self.squared_frequencies), len(self.dampers)
        A = np.zeros((2 * m + n, 2 * m + n))
        A[:m, m : 2 * m] = np.eye(m)
        A[m : 2 * m, :m], A[m : 2 * m, m : 2 * m] = -np.diag(self.squared_frequencies), -self.damping
        for i, (along, damping, lag, _) in enumerate(self.dampers):
            A[m : 2 * m, 2 * m + i] = -along
            A[2 * m + i, m : 2 * m], A[2 * m + i, 2 * m + i] = damping / lag * along, -1.0 / lag
        return np.asarray(np.linalg.eigvals(A), dtype=np.complex128)


def _fix_actuator(plant: Plant) -> _FixedActuatorPlant:
    """Split the motion: x = x_0 + N y with a . x_0 = 1, N the motions with the actuator fixed, and N^T D x = 0.

    N are these motions' undamped modes, and x_0 the start that deforms least: the device's free motion if it has
    one. Thus 1 - S keeps its digits for a nearly rigid structure.
    """
    a, h = plant.actuator, handle_of(plant)
    fixed_motions = np.linalg.svd(a[None, :])[2][1:].T
    squared = np.zeros(0)
    if fixed_motions.shape[1]:
        squared, shapes = undamped_modes(
            fixed_motions.T @ plant.mass @ fixed_motions, fixed_motions.T @ plant.stiffness @ fixed_motions
        )
        fixed_motions = fixed_motions @ shapes
    # x_0: with a . x_0 = 1, and no force of the springs along the stiff modes, N^T K x_0 = 0
    start = a / (a @ a)
    stiff = squared != 0.0
    start = start - fixed_motions[:, stiff] @ (
        (fixed_motions[:, stiff].T @ plant.stiffness @ start) / squared[stiff]
    )
    loss = np.zeros_like(plant.mass) if plant.hysteresis is None else plant.hysteresis
    push = np.stack([fixed_motions.T @ matrix @ start for matrix in (plant.mass, plant.damping, plant.stiffness)])
    return _FixedActuatorPlant(
        squared_frequencies=squared,
        damping=fixed_motions.T @ plant.damping @ fixed_motions,
        loss=fixed_motions.T @ loss @ fixed_motions,
        dampers=tuple(
            (fixed_motions.T @ d.along, d.damping, d.time_constant, float(d.along @ start))
            for d in plant.lagged_dampers
        ),
        push=push,
        loss_push=fixed_motions.T @ loss @ start,
        static=float((a - h) @ start),
        mode_deformations=fixed_motions.T @ (a - h),
    )


def _solve(inner: Complexes, push: Complexes) -> Complexes:
    """Motions inner^-1 push (..., m), of matrices (..., m, m); nan on a resonance without damping."""
    try:
        return np.asarray(np.linalg.solve(inner, push[..., None])[..., 0])
    except np.linalg.LinAlgError:
        if inner.ndim == 2:
            return np.full(push.shape, complex(np.nan, np.nan))
        return np.array([_solve(one, by) for one, by in zip(inner, push, strict=True)])


_NOT_REACHED = (
    "no motor-side mass reaches (5.15) at this wall: it needs B > K T/2 and a remaining real root that is not "
    "slower; or the drives are rigid here"
)


def optimal_spectral_radius_at(point: OperatingPoint, wanted: WantedWall) -> MeasureValues:
    """Least spectral radius of the wanted wall over all motor-side masses (thesis eq. 5.15).

    Of the motor side on the structure's spring; the device's own masses do not matter.
    """
    return with_status(point, _optimal_mass(point, wanted).spectral_radius, _NOT_REACHED)


def optimal_motor_side_mass_at(point: OperatingPoint, wanted: WantedWall) -> MeasureValues:
    """Motor-side mass with which vibration at the wanted wall decays fastest [kg] (thesis eq. 5.14 with 5.15)."""
    return with_status(point, _optimal_mass(point, wanted).mass, _NOT_REACHED)


def structural_distortion_at(point: OperatingPoint, wanted: WantedWall) -> float:
    """Largest share of the motors' motion that deforms the structure, up to the wanted frequency."""
    return structural_distortion(plant_with_handle(point), frequency_of(wanted))


def _optimal_mass(point: OperatingPoint, wanted: WantedWall) -> OptimalMass:
    """Motor-side mass of fastest decay at the wanted wall, in closed form, at all points.

    Raises  MeasureError  where the device breaks what the closed form assumes
    """
    K, B = wall_of(wanted)
    case = loop_case(point)
    check_assumptions(case, UNDELAYED)
    check_motor_encoders(point)
    stiffness = point.effective.stiffness
    if point.mechanism is None and np.isnan(stiffness):
        if SPRUNG in case.unmet:
            raise MeasureError("needs the stiffness between motors and handle, which the device does not have")
        stiffness = np.asarray(case.traits.side_stiffness)  # of one mass on a spring, which has no two sides
    return optimal_mass(K, B, stiffness, point.controller.sampling_period)


def first_mode_at(point: OperatingPoint) -> MeasureValues:
    """Least natural frequency above 0 of the plant without wall and hand [Hz]; inf where nothing bends."""
    modes = modes_of_points(point)
    if modes is None:
        return evaluate_pointwise(_first_mode_at, point)
    squared = modes.frequency_squared
    with np.errstate(invalid="ignore"):
        least = np.where(squared > 0.0, squared, np.inf).min(axis=1, initial=np.inf)
    values = np.sqrt(least).reshape(point.shape) / (2.0 * np.pi)
    known = np.isfinite(squared).all(axis=1).reshape(point.shape) & (point.status == OK)
    return with_status(point, np.where(known, values, np.nan))


def _first_mode_at(point: OperatingPoint) -> float:
    """Least natural frequency above 0 of the plant at a single point [Hz]; inf where nothing bends."""
    frequencies = natural_frequencies(point.ungripped_plant)
    flexible = frequencies[frequencies > 0.0]
    return float(flexible.min()) if len(flexible) else float("inf")
