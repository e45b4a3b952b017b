"""From the checked file to what the rest of zwidth computes with: arrays in SI units.

A number of the file may be an array over designs (`device.design_batch`); what is built then has that axis first.

From the checked file to the nonlinear parts: dry friction, encoder steps, bent springs, brakes.

Positions and directions as users give them, checked: arrays in metres, joint angles, vectors of any length.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.device.faults import KeyPath
from zwidth.device.schema.loop import (
    ButterworthFilter,
    EncoderSection,
    FeedforwardSection,
    FirstOrderFilter,
    FoawSection,
    ForceSensorSection,
    KalmanSection,
    LocalSection,
    LoopSection,
    VelocitySection,
)
from zwidth.device.schema.mechanism import DampingSection, DriveFrictionSection, DriveSection, FrictionSection
from zwidth.device.schema.operator import OperatorSection
from zwidth.device.schema.plant import PlantSection, ResponseSection
from zwidth.loop.controller import (
    NOT_KNOWN,
    Butterworth,
    Controller,
    Feedforward,
    FirstOrder,
    ForceSensor,
    LocalLoop,
)
from zwidth.loop.estimators import METHODS, BackwardDifference, Foaw, Kalman, LinearMethod, VelocityMethod
from zwidth.model.design_axes import stack_columns, stack_numbers
from zwidth.model.mechanism import DriveNonlinearity
from zwidth.model.modes import add_dampers
from zwidth.model.operator import Operator
from zwidth.model.plant import Brake, Counter, Friction, LaggedDamper, Nonlinear, Plant, Spring
from zwidth.model.response import Response

if TYPE_CHECKING:
    from zwidth.model.mechanism import Damping

from math import inf, nan, pi
from numbers import Real

from zwidth.device.faults import fail, quote
from zwidth.model.mechanism import Mechanism


def controller(loop: LoopSection) -> Controller:
    """The controller of [loop]; a delay in seconds becomes samples, a filter of time constant 0 is left out."""
    period = value_or(loop.sampling_period_s, NOT_KNOWN)
    delay = loop.delay_s / period if loop.delay_s is not None else value_or(loop.delay_samples, 0.0)
    return Controller(
        sampling_period=period,
        delay=delay,
        velocity_filter=_low_pass(loop.velocity.filter),
        velocity=_velocity_method(loop, loop.velocity),
        force_filter=_low_pass(loop.force.filter),
        actuator_time_constant=loop.actuator.time_constant_s,
        force_limit=math.inf if loop.saturation is None else loop.saturation.force_N,
        force_sensor=None if loop.force_sensor is None else _force_sensor(loop.force_sensor),
        feedforward=None if loop.feedforward is None else _feedforward(loop, loop.feedforward),
        local_loop=None if loop.local is None else _local_loop(loop, loop.local),
    )


def _force_sensor(section: ForceSensorSection) -> ForceSensor:
    """The force sensor of [loop.force_sensor]."""
    low_pass = _low_pass(section.filter)
    return ForceSensor(section.gain, low_pass, section.delay_samples, section.mass_beyond_kg, section.law)


def _feedforward(loop: LoopSection, section: FeedforwardSection) -> Feedforward:
    """The feedforward of [loop.feedforward], of which numbers left out are 0."""
    return Feedforward(
        inertia=value_or(section.inertia_kg, 0.0),
        inertia_share=value_or(section.inertia_share, 0.0),
        damping=section.damping_Ns_per_m,
        coulomb=section.coulomb_N,
        dead_band=value_or(section.deadband_m_per_s, 0.0),
        velocity=_linear_velocity_method(loop, section.velocity),
        velocity_filter=None if section.velocity is None else _low_pass(section.velocity.filter),
        acceleration_filter=_low_pass(section.acceleration_filter),
    )


def _local_loop(loop: LoopSection, section: LocalSection) -> LocalLoop:
    """The faster loop of [loop.local] at the motor."""
    return LocalLoop(
        rate_multiple=section.rate_multiple,
        stiffness=section.stiffness_N_per_m,
        damping=section.damping_Ns_per_m,
        velocity=_linear_velocity_method(loop, section.velocity),
        velocity_filter=None if section.velocity is None else _low_pass(section.velocity.filter),
        delay=section.delay_samples,
    )


def _linear_velocity_method(loop: LoopSection, section: VelocitySection | None) -> LinearMethod:
    """The velocity estimate of a feedback beside the wall law, which the file's checks have found linear; the
    backward difference where its section is left out."""
    method = BackwardDifference() if section is None else _velocity_method(loop, section)
    assert isinstance(method, LinearMethod)
    return method


def _low_pass(given: FirstOrderFilter | ButterworthFilter | None) -> FirstOrder | Butterworth | None:
    """The low pass of a filter's table; None without table or with a time constant of 0 throughout."""
    if isinstance(given, FirstOrderFilter):
        return FirstOrder(given.time_constant_s) if np.any(given.time_constant_s) else None
    return None if given is None else Butterworth(given.order, given.cutoff_Hz, given.discretisation)


def _velocity_method(loop: LoopSection, section: VelocitySection) -> VelocityMethod:
    """The velocity estimate of a table; a method whose noise is left out takes that of the encoder's step."""
    parameters = section.parameters()
    step = loop.encoder.resolution_m
    if isinstance(section, KalmanSection) and section.position_noise_m is None and step:
        return Kalman.of_encoder(section.acceleration_noise_m_per_s2, step)
    if isinstance(section, FoawSection) and section.position_noise_m is None and step:
        return Foaw.of_encoder(section.samples, step, section.fit)
    return METHODS[section.method](**parameters)


def plant(
    section: PlantSection, friction: FrictionSection | None = None, encoder: EncoderSection | None = None
) -> Plant:
    """The plant of [plant]; matrices are made symmetric to the last bit. A plant of one coordinate is driven, read
    and held by it where the file does not say.

    friction, encoder  sections of the nonlinear parts; None: there are none
    """
    M = stack_numbers(section.mass_kg)
    size = M.shape[-1]
    for_one_coordinate = (1.0,) if size == 1 else None
    handle = section.handle or for_one_coordinate
    actuator = stack_numbers(section.actuator or for_one_coordinate)
    bare = Plant(
        mass=_symmetric(M),
        damping=_symmetric(
            stack_numbers(section.damping_Ns_per_m) if section.damping_Ns_per_m else np.zeros((size, size))
        ),
        stiffness=_symmetric(
            stack_numbers(section.stiffness_N_per_m) if section.stiffness_N_per_m else np.zeros((size, size))
        ),
        actuator=actuator,
        sensor=stack_numbers(section.sensor or for_one_coordinate),
        handle=None if handle is None else stack_numbers(handle),
        names=tuple(f"coordinate {i}" for i in range(size)),
    )
    bare = replace(bare, nonlinear=nonlinear_of_plant(bare, section, friction, encoder))
    if section.loss_factor:
        bare = replace(bare, hysteresis=section.loss_factor * bare.stiffness)
    motors = [
        LaggedDamper(
            along=actuator if motor.along is None else np.array(motor.along),
            damping=motor.force_constant_N_per_A**2 / motor.resistance_ohm,
            time_constant=motor.inductance_H / motor.resistance_ohm,
        )
        for motor in section.electrical_damping
    ]
    return add_dampers(bare, motors)


def operator(section: OperatorSection) -> Operator:
    """The operator of [operator]: the arm, and the grasp that holds the handle."""
    rigid = section.grasp == "rigid"
    return Operator(
        arm_mass=section.arm_mass_kg,
        arm_stiffness=section.arm_stiffness_N_per_m,
        arm_damping=section.arm_damping_Ns_per_m,
        grasp_stiffness=None if rigid else section.grasp_stiffness_N_per_m,
        grasp_damping=None if rigid else value_or(section.grasp_damping_Ns_per_m, 0.0),
        directions=section.directions,
    )


def response(section: ResponseSection, label: str, period: float) -> Response:
    """The measured response, from files beside the device file; `label` is its path."""
    from zwidth.device.response_file import read_response

    return read_response(section, label, period)


def damping(section: DampingSection | None) -> Damping:
    """The damping of [mechanism.damping]: of modes or proportional; else that of the drives' dampers."""
    from zwidth.model.mechanism import GivenDamping, ModalDamping, ProportionalDamping

    if section is None or section.given:
        return GivenDamping()
    if section.mode_ratio is not None:
        return ModalDamping(section.mode_ratio)
    coefficients = section.mass_coefficient_1_per_s, section.stiffness_coefficient_s
    return ProportionalDamping(*(value_or(one, 0.0) for one in coefficients))


def in_space(vector: Sequence[Any]) -> list[Any]:
    """The three components of a vector of up to three: those left out are 0."""
    return [*vector, 0.0, 0.0, 0.0][:3]


def roll_pitch_yaw(angles: ArrayLike) -> Floats:
    """Rotation Rz(yaw) Ry(pitch) Rx(roll): about the parent's fixed x, y, z axes in turn, (..., 3, 3)."""
    turns = np.moveaxis(np.asarray(angles, dtype=np.float64), -1, 0)
    # cosine and sine of roll, pitch and yaw, each (...)
    (cr, cp, cy), (sr, sp, sy) = np.cos(turns), np.sin(turns)
    rows = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    return np.ascontiguousarray(np.moveaxis(rows, (0, 1), (-2, -1)))


def _symmetric(matrix: Floats) -> Floats:
    """Matrices (..., n, n) made symmetric to the last bit."""
    return 0.5 * matrix + 0.5 * np.swapaxes(matrix, -1, -2)


NONLINEAR_KEYS: Final[dict[tuple[str, ...], str]] = {
    ("friction",): "dry friction",
    ("loop", "encoder", "noise_m"): "noise",
    ("loop", "saturation"): "the force limit",
    ("plant", "spring"): "nonlinear springs",
    ("plant", "brake"): "programmable brakes",
    ("mechanism", "friction"): "dry friction",
    ("mechanism", "drives", "*", "coulomb_Nm"): "dry friction",
    ("mechanism", "drives", "*", "breakaway_Nm"): "dry friction",
    ("mechanism", "drives", "*", "hardening_Nm_per_rad3"): "nonlinear springs",
    ("mechanism", "drives", "*", "backward_stiffness_Nm_per_rad"): "nonlinear springs",
    ("mechanism", "drives", "*", "brake_damping_max_Nms_per_rad"): "programmable brakes",
    ("mechanism", "drives", "*", "brake_time_constant_s"): "programmable brakes",
    ("mechanism", "drives", "*", "encoder_counts_per_rev"): "encoder steps",
    ("mechanism", "drives", "*", "encoder_noise_rad"): "noise",
    ("mechanism", "drives", "*", "torque_limit_Nm"): "the force limit",
    ("mechanism", "drives", "*", "continuous_torque_Nm"): "the force limit",
}
"""Keys, with * for list elements, that no linear answer reads -> what they belong to, in `Nonlinear.left_out`'s
words. An encoder's resolution_m is not among them: a Kalman filter reads it."""


def nonlinear_kind(path: KeyPath) -> str:
    """The nonlinear part that the key at a path describes; "" for a key that linear answers read.

    >>> nonlinear_kind(("friction", "coulomb_N", 1)), nonlinear_kind(("plant", "mass_kg"))
    ('dry friction', '')
    """
    for pattern, what in NONLINEAR_KEYS.items():
        head = path[: len(pattern)]
        if len(head) == len(pattern) and all(p in ("*", h) for p, h in zip(pattern, head, strict=True)):
            return what
    return ""


def nonlinear_of_plant(
    plant: Plant, section: PlantSection, friction: FrictionSection | None, encoder: EncoderSection | None
) -> Nonlinear:
    """What a linear plant leaves out: dry friction, encoder step and noise, nonlinear springs, brakes; of springs
    and brakes those that are not 0."""
    as_actuator = np.ones(1) if plant.size == 1 else plant.actuator

    def along(given: Sequence[float] | None) -> Floats:
        """The vector (n,) that a table gives, or else the actuator's; 1 of a single coordinate."""
        return as_actuator if given is None else np.array(given, dtype=np.float64)

    springs = [
        Spring(along(spring.along), spring.hardening_N_per_m3, spring.backward_excess_N_per_m)
        for spring in section.spring
    ]
    brakes = [
        Brake(along(brake.along), brake.damping_max_Ns_per_m, brake.time_constant_s) for brake in section.brake
    ]
    return Nonlinear(
        friction=() if friction is None else _plant_friction(friction),
        counters=() if encoder is None else _counters(plant.sensor, encoder),
        springs=tuple(spring for spring in springs if spring.cubic or spring.backward_excess),
        brakes=tuple(brake for brake in brakes if brake.damping),
    )


def _plant_friction(section: FrictionSection) -> tuple[Friction, ...]:
    """The dry friction of a given plant: one element for each coordinate that has any."""
    levels = section.coulomb_N
    breakaway = (math.nan,) * len(levels) if section.breakaway_N is None else section.breakaway_N
    return tuple(
        Friction(
            along=np.eye(len(levels))[i],
            coulomb=level,
            model=section.model,
            bristle_stiffness=value_or(section.bristle_stiffness_N_per_m, math.inf),
            bristle_damping=section.bristle_damping_Ns_per_m or 0.0,
            breakaway=breakaway[i],
            stribeck_velocity=value_or(section.stribeck_velocity_m_per_s, math.nan),
        )
        for i, level in enumerate(levels)
        if level > 0.0
    )


def _counters(sensor: Floats, encoder: EncoderSection) -> tuple[Counter, ...]:
    """The encoder of a given plant that reads `sensor` (n,), as the only element; () where it has neither step nor
    noise."""
    step, noise = encoder.resolution_m or 0.0, encoder.noise_m or 0.0
    return (Counter(sensor.copy(), step, noise=noise),) if step or noise else ()


NONLINEAR_NUMBERS: Final = {
    "coulomb": ("coulomb_Nm", 0.0),
    "breakaway": ("breakaway_Nm", math.nan),
    "hardening": ("hardening_Nm_per_rad3", 0.0),
    "backward_stiffness": ("backward_stiffness_Nm_per_rad", math.nan),
    "preload": ("preload_Nm", 0.0),
    "brake_damping": ("brake_damping_max_Nms_per_rad", 0.0),
    "brake_time_constant": ("brake_time_constant_s", 0.0),
    "encoder_noise": ("encoder_noise_rad", 0.0),
}
"""Field of `DriveNonlinearity` -> key of a drive, and the number of one that leaves it out."""


def drive_nonlinearity(drives: Sequence[DriveSection], friction: DriveFrictionSection) -> DriveNonlinearity | None:
    """What a linear answer leaves out of a mechanism's d drives, at the motor: friction, springs that are not
    straight, brakes, encoder noise; None where the file gives none of it."""
    nonlinearity = DriveNonlinearity(
        friction_model=friction.model,
        bristle_stiffness=value_or(friction.bristle_stiffness_Nm_per_rad, math.inf),
        bristle_damping=friction.bristle_damping_Nms_per_rad or 0.0,
        stribeck_velocity=value_or(friction.stribeck_velocity_rad_per_s, math.nan),
        **stack_columns(drive_columns(drives, NONLINEAR_NUMBERS)),
    )
    parts = (nonlinearity.coulomb, nonlinearity.hardening, nonlinearity.brake_damping, nonlinearity.encoder_noise)
    return nonlinearity if any(map(np.any, parts)) or np.isfinite(nonlinearity.backward_stiffness).any() else None


def drive_columns(
    drives: Sequence[DriveSection], numbers: Mapping[str, tuple[str, float]]
) -> dict[str, list[float]]:
    """Numbers of all drives by the fields that take them.

    numbers  field -> key of a drive, and the number of one that leaves it out
    """
    return {
        field: [value_or(getattr(drive, key), omitted) for drive in drives]
        for field, (key, omitted) in numbers.items()
    }


def value_or(value: float | None, omitted: float) -> float:
    """A number, or `omitted` where it is None."""
    return omitted if value is None else value


UNIT: Final = 4.0 * np.finfo(float).eps  # from 1, that the length of a unit vector may be by rounding


def vectors(label: str, name: str, value: Any) -> Floats:
    """Vectors (..., 2) or (..., 3) of finite numbers.

    label, name  of the device and the argument, for messages
    Raises  DeviceError  for anything else
    """
    try:
        given = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise fail(label, name, f"must be 2 or 3 numbers, got {quote(value)}") from None
    if given.ndim == 0:
        raise fail(label, name, f"must be 2 or 3 numbers, got {quote(value)}")
    if given.shape[-1] not in (2, 3):
        raise fail(label, name, f"must be 2 or 3 numbers x, y or x, y, z, got {given.shape[-1]}")
    if not np.isfinite(given).all():
        raise fail(label, name, f"must be finite, got {quote(given.tolist())}")
    return given


def positions(label: str, value: Any, height: float) -> Floats:
    """Positions (..., 3) [m]; those of two numbers get the third coordinate `height` [m]. Raises DeviceError as
    `vectors`."""
    given = vectors(label, "at", value)
    return given if given.shape[-1] == 3 else _with_third(given, height)


def unit_vectors(label: str, name: str, value: Any) -> Floats:
    """Unit vectors (..., 3) along vectors of any length; those of two numbers lie in the x-y plane.

    Raises  DeviceError  as `vectors`, and for a vector of no length
    """
    given = vectors(label, name, value)
    given = given if given.shape[-1] == 3 else _with_third(given, 0.0)
    largest = np.abs(given).max(axis=-1, keepdims=True, initial=0.0)
    if not largest.all():
        raise fail(label, name, "has zero length; give any vector along it, such as 0,1")
    scaled = given / largest  # so that the squares neither overflow nor vanish
    length = largest * np.linalg.norm(scaled, axis=-1, keepdims=True)
    # what is a unit vector already stays as it is, to the last digit
    units = scaled / np.linalg.norm(scaled, axis=-1, keepdims=True)
    return np.where(np.abs(length - 1.0) <= UNIT, given, units)


def screws(label: str, direction: Any, axis: Any, length: Any) -> Floats:
    """Screws (..., 6) of a motion about an axis, and along a direction at once: [u, L w]/sqrt(|u|^2 + |w|^2).

    direction  (..., 2) or (..., 3) u; None: a turn alone, [0, w/|w|]
    axis       (..., 3) w;   length  L by which angles count as ways [m]; None without a direction
    Raises     DeviceError  for vectors without length, and a length that is missing, beside nothing or not
               positive
    """
    w = vectors(label, "axis", axis)
    w = w if w.shape[-1] == 3 else _with_third(w, 0.0)
    if direction is None:
        if length is not None:
            raise fail(label, "characteristic_length", "is of a direction and an axis together; leave it out")
        return np.concatenate([np.zeros_like(w), unit_vectors(label, "axis", w)], axis=-1)
    u = vectors(label, "direction", direction)
    u = u if u.shape[-1] == 3 else _with_third(u, 0.0)
    unit_vectors(label, "axis", w), unit_vectors(label, "direction", u)  # which refuse vectors without length
    L = float(length) if isinstance(length, Real) else nan
    if not 0.0 < L < inf:
        raise fail(label, "characteristic_length", f"must be a positive length in metres, got {quote(length)}")
    both = np.concatenate(np.broadcast_arrays(u, w), axis=-1)
    return np.asarray(both / np.linalg.norm(both, axis=-1, keepdims=True) * np.repeat([1.0, L], 3))


def rotations(label: str, orientation: Any) -> Floats:
    """Rotation matrices (..., 3, 3) of roll, pitch, yaw (..., 3) [rad], or such matrices themselves.

    Raises  DeviceError  for anything else
    """
    try:
        given = np.asarray(orientation, dtype=np.float64)
    except (TypeError, ValueError):
        raise fail(label, "orientation", f"must be roll, pitch, yaw in rad, got {quote(orientation)}") from None
    if given.shape[-2:] == (3, 3):
        if np.allclose(given @ np.swapaxes(given, -1, -2), np.eye(3), atol=1e-9):
            return given
        raise fail(label, "orientation", "must be rotation matrices, and some rows are not at right angles")
    if given.ndim == 0 or given.shape[-1] != 3 or not np.isfinite(given).all():
        raise fail(label, "orientation", f"must be roll, pitch, yaw in rad, got {quote(orientation)}")
    if np.abs(given).max() > 2.0 * pi:
        message = f"must be angles from -2 pi to 2 pi rad, got {quote(given.tolist())}; are they in degrees?"
        raise fail(label, "orientation", message)
    return roll_pitch_yaw(given)


def joint_angles(label: str, mechanism: Mechanism, at: Mapping[str, float]) -> dict[str, float]:
    """Angles of all driven joints by the names of their links [rad], checked.

    at  name -> angle, as the user gives them
    Raises  DeviceError  for other joints than the driven ones, and for a value that is not an angle
    """
    driven = [mechanism.links.names[joint] for joint in mechanism.drives.joint]
    if set(at) != set(driven):
        message = f"must be the angle of every driven joint, {', '.join(driven)}, got {', '.join(map(str, at))}"
        raise fail(label, "at", message)
    angles = {}
    for joint, value in at.items():
        angle = float(value) if isinstance(value, Real) else nan
        if not abs(angle) <= 2.0 * pi:
            message = f"{joint}: must be an angle from -2 pi to 2 pi rad, got {quote(value)}; is it in degrees?"
            raise fail(label, "at", message)
        angles[joint] = angle
    return angles


def _with_third(given: Floats, third: float) -> Floats:
    """Vectors (..., 2) with a third number, alike for all of them."""
    return np.concatenate([given, np.full((*given.shape[:-1], 1), third)], axis=-1)
