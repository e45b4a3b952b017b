"""Impedance at the handle, which the hand feels, and that of the commanded wall.

The handle h is one end of the device and the wall acts at the other, a, read at s. A hand force f e^{jwt} makes
the samples of the sensor move by Y e^{jwkT}, and the loop answers with commands

    U = -C Y,      C = K + B w(z),      z = e^{jwT}

Filtered by F(z), held for T after the delay they are a staircase, which the actuator follows with its lag tau; its
part at w itself is U times

    H = F(z) e^{-jw delay} (1 - e^{-jwT})/(jwT) / (1 + jw tau)

Its other parts, at w + 2 pi n/T, move the sensor too, and samples do not distinguish them:

    Y = s^T x + S U,      S = P(z) - H s^T D^-1 a,      D = -w^2 M + jw B + K + lagged dampers

with P the sampled plant, in which all of the staircase is. So the motion x at w obeys

    [ D + H C/(1 + S C) a s^T ] x = h f,      Z = f / (jw h^T x)

which is exact. With feedforward and a force sensor of gain G, which measures f + m w^2 h^T x for a mass m between
sensor and hand, the commands are U = -A Y + G (f + m w^2 h^T x + S_f U), A = C (1 or, of a force error, 1 + G)
less the feedforward, and

    [ D + H/N a (A s - G m w^2 h)^T ] x = (h + H G/N a) f,      N = 1 + S A - S_f G

The motion at w + 2 pi n/T that goes with it is not part of an impedance and is not computed; a
plant with mass hardly follows at these frequencies.

Motion of the handle per newton of the hand, at rest, with a wall of any stiffness.

The hand's force f and the wall's, -K s^T x, hold the plant in balance: (K_plant + K a s^T) x = h f. In its modes,
K_plant = diag(w^2), that is

    h^T x/f = sum_i (h_i - g s_i)(h_i - q a_i)/w_i^2 + q g c/(1 + K c),        c = sum_i s_i a_i/w_i^2
                                                                               g = sum_i h_i a_i/w_i^2/c
                                                                               q = sum_i s_i h_i/w_i^2/c

(Sherman and Morrison 1950, its terms sorted so that nothing cancels). The sum is what the structure gives while
the wall holds the sensor still, and so the limit for K to infinity. A free motion, w = 0, is the limit of w to 0.
By the free motions alone c grows without bound, c/(1 + K c) is 1/K,

    g = h.a/(s.a),  q = h.s/(s.a)        in the free motions, if s.a is not 0 there

and the wall holds the handle if (h - g s).(h - q a) is 0 in them. In the sum every term is small by itself where
the handle moves as the sensor and the actuator do, and 0 in a rigid device.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.errors import HandleError
from zwidth.loop.closed_plant import path_responses
from zwidth.loop.controller import Controller, check_no_feedback, check_no_load
from zwidth.loop.factor_response import factor_response, feedforward_response, sensor_response
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import low_pass_factors
from zwidth.model.argument_checks import broadcast_walls, check_kind
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import Plant

LimitKind = Literal["bound", "limit", "infinite", "unknown"]

# Relative size, squared, below which a component along a free motion is rounding of 0.
FREE = 1e-12


UNKNOWN: Final = "the impedance at the handle is not known"
LEAVE_OUT: Final = "leave the load out"


def check_no_local_loop(controller: Controller) -> None:
    """Raise FeedbackError for a computer with a local loop, which has a sampling rate of its own."""
    two_rates = replace(controller, force_sensor=None, feedforward=None)
    check_no_feedback(two_rates, UNKNOWN, "leave local_loop out")


def felt_impedance(loop: Loop, wall_stiffness: float, wall_damping: float, frequency: ArrayLike) -> Complexes:
    """Force over velocity at the handle, Z = f/(jw x_h) (see the derivation above).

    wall_stiffness, wall_damping  of a stable wall [N/m], [N s/m]; an unstable one has no steady motion, and the
                                  result then has no meaning
    frequency  (...)  above 0 and below half the sampling frequency [Hz]
    Returns    (...)  complex [N s/m]
    Raises     HandleError  where the plant has no handle
               ValueError   for a frequency out of range
               FeedbackError  (loop.unsupported_feedback) with a local loop, or under load

    A mass of 0.1 kg at 1 Hz feels like its wall, of 1000 N/m and 1 N s/m, less its inertia (and the delay of hold
    and backward difference, one sample):

    >>> from zwidth.loop.controller import Controller
    >>> one, none = np.ones(1), np.zeros((1, 1))
    >>> loop = Loop(Plant(np.array([[0.1]]), none, none, one, one, one), Controller(0.001))
    >>> Z = felt_impedance(loop, 1000.0, 1.0, 1.0)
    >>> round(float(-Z.imag * 2 * np.pi), 2), round(1000.0 - 0.1 * (2 * np.pi) ** 2, 2)
    (996.09, 996.05)
    """
    check_kind("loop", loop, Loop)
    broadcast_walls(wall_stiffness, wall_damping)
    f = np.asarray(frequency, dtype=float)
    nyquist = 0.5 / loop.period
    if not np.all((f > 0.0) & (f < nyquist)):
        raise ValueError(f"frequencies must lie between 0 and half the sampling frequency, {nyquist:.6g} Hz")
    plant, T = loop.plant, loop.period
    s = 2j * np.pi * f
    if loop.has_fixed_feedback:
        check_no_local_loop(loop.controller)
        handle_of(plant)
        w = loop.velocity_response(np.exp(s * T), np.expm1(s * T))
        return _controlled_impedance(loop, wall_stiffness + wall_damping * w, s)
    dynamic, act, read, h = _dynamic_stiffness(plant, s)
    hold = _hold_response(loop, s)
    P, w = _sampled_responses(loop, s * T)
    C = wall_stiffness + wall_damping * w
    alias_response = P - hold * (_solve(dynamic, act) @ read)
    wall = hold * C / (1.0 + alias_response * C)
    closed = dynamic + wall[..., None, None] * np.outer(act, read)
    return np.asarray(1.0 / (s * (_solve(closed, h) @ h)))


def _controlled_impedance(loop: Loop, wall: Complexes, s: Complexes) -> Complexes:
    """`felt_impedance` [N s/m] with feedforward and a force sensor, at s = jw (...) for a wall C (...) [N/m]."""
    plant, T, computer = loop.plant, loop.period, loop.controller
    dynamic, act, read, h = _dynamic_stiffness(plant, s)
    z, d, hold = np.exp(s * T), np.expm1(s * T), _hold_response(loop, s)
    sensor, feedforward = computer.force_sensor, computer.feedforward
    P, P_f = path_responses(plant, computer, d)
    pushed = _solve(dynamic, act)
    G, lost = np.zeros_like(s), np.zeros_like(s)  # G, and m w^2
    law = wall
    if sensor is not None:
        G = sensor_response(sensor, T, d)
        law = wall * (1.0 + G) if sensor.law == "force-error" else wall
        G, lost = G / z**sensor.delay, -sensor.mass_beyond * s**2
    if feedforward is not None:
        law = law - feedforward_response(feedforward, T, z, d)
    # S, S_f, H/N, and the vectors A s - G m w^2 h and h + H G/N a of the derivation above
    alias = P - hold * (pushed @ read)
    alias_f = P_f - hold * lost * (pushed @ h)
    share = hold / (1.0 + alias * law - alias_f * G)
    reads = law[..., None] * read - (G * lost)[..., None] * h
    closed = dynamic + share[..., None, None] * act[:, None] * reads[..., None, :]
    pushes = h + (share * G)[..., None] * act
    x = np.linalg.solve(closed, pushes[..., None])[..., 0]
    return np.asarray(1.0 / (s * (x @ h)))


def free_motion_impedance(plant: Plant, frequency: ArrayLike) -> Complexes:
    """Force over velocity at the handle without a wall, 1/(jw G_hh) [N s/m].

    The ideal is 0: of a device in free motion nothing is felt (transparency, after Tavakoli and Howe 2009, known
    at second hand). The device's own mass, friction and resonances remain.
    """
    s = 2j * np.pi * np.asarray(frequency, dtype=float)
    dynamic, _, _, h = _dynamic_stiffness(plant, s)
    return np.asarray(1.0 / (s * (_solve(dynamic, h) @ h)))


def free_impedance(loop: Loop, frequency: ArrayLike) -> Complexes:
    """Force over velocity at a loop's handle without a wall [N s/m]. Raises FeedbackError with a local loop."""
    if loop.has_fixed_feedback:
        return felt_impedance(loop, 0.0, 0.0, frequency)
    return free_motion_impedance(loop.plant, frequency)


def commanded_impedance(wall_stiffness: float, wall_damping: float, frequency: ArrayLike) -> Complexes:
    """K/(jw) + B, what the hand would feel of an ideal wall [N s/m]."""
    return np.asarray(wall_stiffness / (2j * np.pi * np.asarray(frequency, dtype=float)) + wall_damping)


def static_stiffness(plant: Plant, wall_stiffness: ArrayLike, controller: Controller | None = None) -> Floats:
    """Stiffness of a wall as felt at the handle at rest.

        1 / (h^T (K_plant + K a s^T)^-1 h)          two masses and a spring k: K k/(K + k)

    At rest the velocity estimate is 0 and the hold keeps a constant force, so that neither sampling
    nor delay nor damping counts. A force sensor lets the motors help the hand, and a local loop adds its spring.

    wall_stiffness  (...)  K [N/m]
    controller      with the fixed feedback that acts at rest, too; None: there is none
    Returns         (...)  [N/m]; 0 where the handle is free to move away, inf where it cannot move
    Raises          HandleError  where the plant has no handle

    >>> link = np.array([[1.0, -1.0], [-1.0, 1.0]])
    >>> motor, hand = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    >>> pair = Plant(np.eye(2), 0 * link, 3000.0 * link, motor, motor, hand)
    >>> static_stiffness(pair, [0.0, 3000.0, 6000.0]).round(6).tolist()
    [0.0, 1500.0, 2000.0]
    """
    check_kind("plant", plant, Plant)
    K = np.asarray(wall_stiffness, dtype=float)
    gain, error, spring = _static_gains(controller)
    compliance = rest_compliance(plant, handle_of(plant), gain).at(K * (1.0 + gain * error) + spring)
    with np.errstate(divide="ignore"):
        # nothing moves: + inf, whichever sign its zero has; nothing is held: 0 without a sign
        return np.where(compliance == 0.0, np.inf, 1.0 / compliance + 0.0)


def _static_gains(controller: Controller | None) -> tuple[float, bool, float]:
    """What acts at rest: force commanded per hand force, whether it is of the force error, and the local loop's
    stiffness [N/m]; 0, False and 0 for None.
    """
    sensor = None if controller is None else controller.force_sensor
    local = None if controller is None else controller.local_loop
    gain, error = (0.0, False) if sensor is None else (float(sensor.gain), sensor.law == "force-error")
    return gain, error, 0.0 if local is None else float(local.stiffness)


def static_stiffness_limit(plant: Plant) -> float:
    """Felt stiffness of an infinitely stiff wall: the limit of `static_stiffness` for K to infinity [N/m].

    The wall then holds the sensor still, and the structure between it and the hand deflects: k of the
    two-mass plant. The limit of a hard contact by flexibility (after Tavakoli and Howe 2009, known at second
    hand).
    With wall force, sensor and handle at different places walls of finite stiffness may be felt stiffer, and the
    limit may be negative; `static_stiffness_limit_kind` says which.

    Returns  inf where nothing gives way, as with rigid drives; 0 where a motion of the handle is not held
    Raises   HandleError  where the plant has no handle
    """
    check_kind("plant", plant, Plant)
    return rest_compliance(plant, handle_of(plant)).stiffness_limit


def static_stiffness_limit_kind(plant: Plant, controller: Controller | None = None) -> LimitKind:
    """What `static_stiffness_limit` is; with a force sensor of the controller, whose help makes walls felt softer.

    "bound"     no wall with K > 0 is felt stiffer
    "limit"     the limit for K to infinity alone: walls of finite stiffness may be felt stiffer
    "infinite"  nothing gives way: there is no limit
    """
    compliance = rest_compliance(plant, handle_of(plant), _static_gains(controller)[0])
    if compliance.stiffness_limit == np.inf:
        return "infinite"
    return "bound" if compliance.limit_is_bound else "limit"


def free_motion_mass(plant: Plant, controller: Controller | None = None) -> float:
    """Mass felt at the handle in slow free motion: 1/(h^T Z Z^T h) of the mass-normalised rigid modes Z [kg].

    controller  whose feedforward and force sensor take part of it, all friction left out; None: there is none
    Returns     nan where a spring ties the handle to the ground, since a stiffness is felt then
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    rigid = squared == 0.0
    modal_handle = shapes.T @ handle_of(plant)
    h, act, read = modal_handle[rigid], (shapes.T @ plant.actuator)[rigid], (shapes.T @ plant.sensor)[rigid]
    if not float(h @ h) > FREE * float(modal_handle @ modal_handle):
        return float("nan")
    sensor = None if controller is None else controller.force_sensor
    feedforward = None if controller is None else controller.feedforward
    # x'' = (h + gain act) f + act (inertia read x'' - gain mass_beyond h x''), in the rigid modes
    gain, beyond = (0.0, 0.0) if sensor is None else (sensor.gain, sensor.mass_beyond)
    inertia = 0.0 if feedforward is None else feedforward.inertia
    if not (gain or inertia):
        return 1.0 / float(h @ h)
    modal_mass = np.eye(len(h)) - np.outer(act, inertia * read - gain * beyond * h)
    return 1.0 / float(h @ np.linalg.solve(modal_mass, h + gain * act))


def handle_of(plant: Plant) -> Floats:
    """The plant's handle (n,). Raises HandleError if it has none, FeedbackError under load."""
    check_no_load(plant, UNKNOWN, LEAVE_OUT)
    if plant.handle is None:
        raise HandleError(
            "the plant has no handle at which a hand could feel it; give `handle`, or use another model"
        )
    return plant.handle


def _dynamic_stiffness(plant: Plant, s: Complexes | Floats) -> tuple[Any, Floats, Floats, Floats]:
    """Dynamic stiffness D(s) (..., n, n), then actuator, sensor and handle (n,), all in modal coordinates.

    There the rigid modes have no stiffness at all: at low frequency nothing else is left of them.
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    undamped = s[..., None, None] ** 2 * np.eye(plant.size) + np.diag(squared)
    dynamic = undamped + s[..., None, None] * (shapes.T @ plant.damping @ shapes)
    for damper in plant.lagged_dampers:
        along = shapes.T @ damper.along
        lagged = damper.damping * s / (1.0 + s * damper.time_constant)
        dynamic = dynamic + lagged[..., None, None] * np.outer(along, along)
    return dynamic, shapes.T @ plant.actuator, shapes.T @ plant.sensor, shapes.T @ handle_of(plant)


def _solve(matrices: Complexes, right: Floats) -> Complexes:
    """Solutions (..., n) for matrices (..., n, n) and one right-hand side (n,)."""
    column = np.broadcast_to(right.astype(complex)[:, None], (*matrices.shape[:-1], 1))
    return np.asarray(np.linalg.solve(matrices, column)[..., 0])


def _hold_response(loop: Loop, s: Complexes) -> Complexes:
    """Response H (...) from commands to the part of the held force at s = jw (...) itself."""
    controller, T = loop.controller, loop.period
    numerator, denominator = (
        np.array(rows, dtype=float).reshape(-1, 3) for rows in low_pass_factors(controller.force_filter, T)
    )
    filtered = factor_response(numerator, denominator, np.expm1(s * T))
    stairs = -np.expm1(-s * T) / (s * T) * np.exp(-s * T * controller.delay)
    return np.asarray(filtered * stairs / (1.0 + s * controller.actuator_time_constant))


def _sampled_responses(loop: Loop, log_z: Complexes) -> tuple[Complexes, Complexes]:
    """Responses of the sampled plant, P [m/N], and of the velocity estimate, w [1/s], at z = exp(log_z) (...)."""
    z, d = np.exp(log_z), np.expm1(log_z)
    return loop.plant_response(z, d), loop.velocity_response(z, d)


# Share of a vector, of its length or of a sum's terms, that rounding leaves of 0: with less, a rigid device would
# give way by its last digits; with more, the stiff part of a device with soft and stiff springs would be taken as
# rigid.
ROUNDING: Final = 1e-12
# Share of its components that rounding leaves of a mode: with less, a structure that the wall's force unloads
# would give way by what is left where soft modes cancel; with more, stiff springs beside soft ones count as rigid.
OF_MODES: Final = 1e-14
# Share by which the handle's free motion may differ from the one that the wall holds: with less, the rounding of a
# posture near a singularity lets the handle slip; with more, a handle that slips is called held.
UNHELD: Final = 1e-8


@dataclass(frozen=True)
class RestCompliance:
    """Motion of the handle per newton of the hand, over the wall's stiffness.

        held + exchange c/(1 + K c) + sliding K

    is_held   False where a push of the hand moves the handle away without end, whatever K is
    held      that of a wall that holds the sensor still; of any wall, where it moves the handle in no other way
              [m/N]
    exchange  q g above [1]
    sensor    c above, of the sensor under a force at the actuator [m/N]; inf for a free motion
    sliding   of a wall whose force does not move its own sensor but moves the handle [(m/N)^2]
    """

    is_held: bool
    held: float = 0.0
    exchange: float = 0.0
    sensor: float = 0.0
    sliding: float = 0.0

    def at(self, wall_stiffness: Floats) -> Floats:
        """Compliance (...) with walls (...) [m/N]; inf where the handle is free."""
        K = np.asarray(wall_stiffness, dtype=float)
        if not self.is_held:
            return np.full(K.shape, np.inf)
        if not self.exchange:
            return np.asarray(self.held + self.sliding * K)
        with np.errstate(divide="ignore"):
            moved = 1.0 / K if np.isinf(self.sensor) else self.sensor / (1.0 + K * self.sensor)
        return np.asarray(self.held + self.exchange * moved + self.sliding * K)

    @property
    def stiffness_limit(self) -> float:
        """Felt stiffness for K to infinity [N/m]: 0 where the handle is not held, inf where nothing gives."""
        if not self.is_held or self.sliding:
            return 0.0
        return 1.0 / self.held if self.held else np.inf

    @property
    def limit_is_bound(self) -> bool:
        """Whether no wall with K > 0 is felt stiffer than the limit."""
        if not self.is_held:
            return True
        # what comes to `held` with a finite K then is above 0 and falls to 0 as K grows
        return self.held >= 0.0 and not self.sliding and (not self.exchange or (self.exchange > 0.0 < self.sensor))


def rest_compliance(plant: Plant, handle: Floats, gain: float = 0.0) -> RestCompliance:
    """Compliance at rest of a plant that the hand holds at `handle` (n,).

    gain  force at the actuator per newton of the hand, by a force sensor
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    # letters as in the derivation above
    h, a, s = shapes.T @ handle, shapes.T @ plant.actuator, shapes.T @ plant.sensor
    free = squared == 0.0
    spring = np.where(free, np.inf, squared)
    free_h, free_a, free_s = (_free_part(vector, free) for vector in (h, a, s))
    moved = float(free_s @ free_a)
    if abs(moved) > ROUNDING * float(np.linalg.norm(free_s) * np.linalg.norm(free_a)):
        g, q = float(free_h @ free_a) / moved, float(free_h @ free_s) / moved
        if _slips(free_h, free_s, free_a, g, q):
            return RestCompliance(False)
        # + gain: the force at the actuator moves the handle by gain g c/(1 + K c) more
        return RestCompliance(True, _held(h, s, a, g, q, spring), (q + gain) * g, np.inf)
    if np.any(free_h):  # no wall force acts along the free motion that it is read from
        return RestCompliance(False)
    # motion of the handle by the wall's force, of the sensor by the hand's, and of the sensor by the wall's
    by_force, read_push, c = _modal_sum(h, a, spring), _modal_sum(s, h, spring), _modal_sum(s, a, spring)
    if c == 0.0:
        # s^T x is `read_push` whatever K is; the wall's force -K s^T x moves the handle by `by_force` per newton
        return RestCompliance(True, _modal_sum(h, h, spring) + gain * by_force, sliding=-by_force * read_push)
    g, q = by_force / c, read_push / c
    return RestCompliance(True, _held(h, s, a, g, q, spring), (q + gain) * g, c)


def _free_part(vector: Floats, free: Flags) -> Floats:
    """A vector's components along the free motions; 0 where they are rounding of the whole."""
    part = np.where(free, vector, 0.0)
    return part if np.linalg.norm(part) > ROUNDING * np.linalg.norm(vector) else np.zeros_like(vector)


def _slips(h: Floats, s: Floats, a: Floats, g: float, q: float) -> bool:
    """Whether the handle h moves along free motions while the wall, acting along a, holds the sensor s; all (n,).

    g, q  as in the derivation above: the handle is held where (h - g s).(h - q a) is 0
    """
    left, right = h - g * s, h - q * a
    # `difference`: relative difference of the handle's free motion from the one that the wall holds
    slip, size = float(left @ right), float(np.linalg.norm(left) * np.linalg.norm(right))
    length = float(np.linalg.norm(h))
    difference = min(
        float(np.linalg.norm(left)) / max(length, abs(g) * float(np.linalg.norm(s)), np.finfo(float).tiny),
        float(np.linalg.norm(right)) / max(length, abs(q) * float(np.linalg.norm(a)), np.finfo(float).tiny),
    )
    return difference > UNHELD and abs(slip) > ROUNDING * size


def _held(h: Floats, s: Floats, a: Floats, g: float, q: float, spring: Floats) -> float:
    """Compliance [m/N] that is left while the wall holds the sensor, sum of (h - g s)(h - q a)/spring over modes.

    0 where rounding of the modes could have made it.
    """
    left, right = _difference(h, g * s), _difference(h, q * a)
    of_left, of_right = np.maximum(np.abs(h), np.abs(g * s)), np.maximum(np.abs(h), np.abs(q * a))
    blur = OF_MODES * float(np.sum((of_left * np.abs(right) + np.abs(left) * of_right) / spring))
    total = _modal_sum(left, right, spring)
    return total if abs(total) > blur else 0.0


def _difference(vector: Floats, other: Floats) -> Floats:
    """vector - other, 0 where that is rounding of the terms themselves or of the longest."""
    size = np.maximum(np.abs(vector), np.abs(other))
    difference = vector - other
    longest = float(np.max(size, initial=0.0))
    return np.where(np.abs(difference) <= ROUNDING * np.maximum(longest, size), 0.0, difference)


def _modal_sum(left: Floats, right: Floats, spring: Floats) -> float:
    """Sum over the modes of left right/spring, 0 where that is rounding of its terms; spring  w^2, inf if free."""
    terms = left * right / spring
    total = float(np.sum(terms))
    return total if abs(total) > ROUNDING * float(np.sum(np.abs(terms))) else 0.0
