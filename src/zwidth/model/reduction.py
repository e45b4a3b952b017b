"""From a mechanism, or a plant, to the model of its rendered direction.

Coordinates and signs. The driven joints' coordinates are phi for the links and theta for the motors, both at
the joint; with h = J^T u the handle moves by h . phi along the direction u, and a force f along u at the
handle is the joint torques h f. The wall's force acts through the motors, which take h f, and the encoders
read the motors, whose reading of the handle is h . theta: actuator = sensor = [0; h], handle = [h; 0] on
[phi; theta]. Encoders behind the drives read the links instead: sensor = [h; 0].

A reduced model's coordinates are shares of motions of the full one. Sensor, electrical dampers and what is not
linear (dry friction, encoders, brakes) are carried over by what these motions move them by.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats, Ints
from zwidth.errors import DirectionError, ModelError
from zwidth.model.argument_checks import check_kind
from zwidth.model.effective_mass import (
    DriveSide,
    EffectiveParameters,
    drive_side,
    drive_side_of_motions,
    effective_parameters,
    is_plain,
    lever_arms,
    screw,
)
from zwidth.model.mechanism import (
    Damping,
    Drives,
    GivenDamping,
    Mechanism,
    ModalDamping,
    ProportionalDamping,
    at_postures,
    nonlinear_of_drives,
)
from zwidth.model.mechanism_arrays import pack
from zwidth.model.modes import add_dampers, modal_matrix, project_dampers, undamped_modes, winding_dampers
from zwidth.model.motions import Motions
from zwidth.model.plant import Friction, LaggedDamper, Nonlinear, Plant, project_onto_motions
from zwidth.model.posture import OK, Posture

Model = Literal["full", "two-mass", "motor-mass", "rigid"]
Encoders = Literal["motor", "link"]
MODELS: Final = get_args(Model)
READING_TOLERANCE: Final = 1e-6  # relative difference of two readings of a rigid motion that still counts as none


def reduce_mechanism(
    mechanism: Mechanism,
    posture: Posture,
    direction: ArrayLike,
    model: Model,
    damping: Damping,
    encoders: Encoders = "motor",
) -> Plant:
    """The plant that a direction renders in one posture.

    full        [phi; theta], the joint torques through n^2 k between them           (thesis eq. 2.21)
    two-mass    link side, spring, motor side                                        (thesis eq. 2.35, 2.43)
    motor-mass  motor side on the spring, the link side held fixed                   (thesis eq. 2.44)
    rigid       links and rotors as one mass                                         (thesis eq. 2.42)

    Links that bend have their whole mass on the link side, as if they did not bend, and their bending in the
    spring; in the rigid model they are rigid.

    posture    a single one, OK
    direction  (3,)  unit vector in the base frame; or (6,), a screw: see `effective_mass.screw`
    encoders   what they read: the motors, or the links behind the drives
    Returns    Plant; a drive of infinite stiffness has no theta of its own, its rotor moves with its link
    Raises     ModelError  where the model does not apply: no flexible drive in this direction
               DirectionError  (a ModelError) for a direction along which the handle cannot move
               ValueError  for a batch of postures, a posture that is not OK, a direction not of unit length
    """
    _check_posture(posture)
    _check_model(model)
    if model == "rigid" and mechanism.flexible:
        mechanism = replace(mechanism, flexible=())
    mechanism, u = at_postures(mechanism, posture), screw(direction)
    mass, h, side = links_and_drives(mechanism, posture, u)
    check_moves_along(posture, side, h, u)
    full, electrical = _full(mechanism, mass, h, side, damping, encoders)
    if model == "full":
        return add_dampers(full, electrical)
    # without links that bend the shares of drives and joints are read off the matrices
    if not (is_plain(mechanism) or mechanism.flexible):
        return reduce_plant(add_dampers(full, electrical), model)
    numbers = effective_parameters(mechanism, posture, u)
    if model == "rigid":
        mass_damping = damping.mass_coefficient_1_per_s if isinstance(damping, ProportionalDamping) else 0.0
        reduced = _rigid(float(numbers.rigid_mass), mass_damping * float(numbers.rigid_mass))
    elif not np.isfinite(numbers.stiffness):
        raise ModelError(
            f"model {model!r} needs a flexible drive in this direction and all are rigid; use 'rigid'"
        )
    elif mechanism.flexible:
        dampers = _given_dampers(mechanism.drives, side, damping)
        reduced = _two_mass_of_links(full, numbers, damping, dampers, link_fixed=model == "motor-mass")
    else:
        reduced = _two_mass(mechanism.drives, numbers, h, damping, link_fixed=model == "motor-mass")
    if encoders == "motor" and not electrical and not full.nonlinear:
        return reduced
    motions = _motions(full, model)
    with_sensor = replace(_with_sensor(reduced, full, motions), nonlinear=full.nonlinear.project(motions))
    return add_dampers(with_sensor, project_dampers(electrical, motions))


def _check_posture(posture: Posture) -> None:
    """Raise ValueError for a batch of postures, and for a posture that is not OK."""
    if posture.status.shape:
        raise ValueError(f"one posture is reduced at a time, got a batch of shape {posture.status.shape}")
    if posture.status != OK:
        raise ValueError("the posture is out of reach or singular and has no model; ask for another position")


def links_and_drives(mechanism: Mechanism, posture: Posture, screws: Floats) -> tuple[Floats, Floats, DriveSide]:
    """Mass matrix (c, c) of the links, motions (..., c) of the handle along screws (..., 6), and the drives'
    side, in the independent coordinates of one posture; with flexible links also the elastic ones.

    mechanism  with the ratios of the posture
    """
    if not mechanism.flexible:
        return posture.mass_matrix, lever_arms(posture, screws), drive_side(mechanism, posture)
    motions = Motions(pack(mechanism), posture.angles, mechanism.flexible)
    side = drive_side_of_motions(mechanism, motions, posture.angles)
    return motions.mass_matrix(), motions.handle_along(screws), side


def check_moves_along(posture: Posture, side: DriveSide, h: Floats, u: Floats) -> None:
    """Raise DirectionError where the drives cannot move the handle along a screw u (6,) of lever arms h (c,), of
    which those of the drives come first."""
    reach = float(np.linalg.norm(posture.jacobian)) if np.any(u[:3]) else 0.0
    if np.any(u[3:]):
        reach = max(reach, float(np.linalg.norm(posture.angular_jacobian) * np.linalg.norm(u[3:])))
    if np.linalg.norm(h[: side.driven]) > 1e-12 * reach:  # and not where nothing moves
        return
    along = ", ".join(f"{component:.6g}" for component in (u[:3] if np.any(u[:3]) else u[3:]))
    if np.any(u[:3]):
        raise DirectionError(f"the handle cannot move along the direction ({along}); choose one it can move along")
    raise DirectionError(f"the handle cannot turn about the axis ({along}); choose one it can turn about")


def reduce_plant(plant: Plant, model: Model) -> Plant:
    """A simpler model of a plant given by its matrices: the same numbers as `reduce_mechanism`'s, read off
    them.

    With a the actuator, h the handle and Z the rigid modes of K:

    two-mass    1/(h^T M^-1 h), 1/(a^T M^-1 a), spring 1/((a-h)^T K^+ (a-h)), dampers W^T B W: the columns of W
                are the motions of one side alone, made of the rigid motion and of the static deflection x by
                one metre between actuator and handle; without drag that is x^T B x between the masses
    motor-mass  the same, the link side held fixed
    rigid       1/(a^T Z (Z^T M Z)^-1 Z^T a), damper x^T B x of the rigid motion x of one metre at
                the actuator

    Sensor, lagged dampers and nonlinear parts are moved by these motions: W^T sensor, W^T along.

    Returns  Plant; `full` gives the plant itself, as do `two-mass` of two masses and `rigid` of one
    Raises   ModelError  where the model does not apply, with the reason; for hysteresis all but `full`
    """
    check_kind("plant", plant, Plant)
    _check_model(model)
    if model != "full" and plant.hysteresis is not None:
        raise ModelError("a loss factor is charted on the full model only; leave model out")
    if model == "full" or (model == "two-mass" and _is_two_mass(plant)):
        return plant
    if model == "rigid":
        mass, motion = _rigid_motion(plant)
        if plant.size == 1:
            return plant
        return _with_sensor_and_elements(
            _with_handle(_rigid(mass, _drag(plant, motion)), plant, motion), plant, model
        )
    stiffness, deflection = _spring(plant)
    assert plant.handle is not None  # _spring has checked
    link, motor = _mass_at(plant, plant.handle), _mass_at(plant, plant.actuator)
    pair = replace(_pair(link, motor, 0.0, stiffness), damping=_side_damping(plant, deflection))
    if model == "motor-mass":
        pair = _motor_mass(motor, float(pair.damping[1, 1]), stiffness)
    return _with_sensor_and_elements(pair, plant, model)


def plant_effective_parameters(plant: Plant) -> EffectiveParameters:
    """Effective masses and stiffness of a plant given by its matrices (see `reduce_plant`).

    nan where inapplicable: with one coordinate there are no sides and no spring, without a handle neither
    link side nor spring, tied to the ground no rigid mass.
    """
    link = motor = rigid = stiffness = float("nan")
    with suppress(ModelError):
        rigid = _rigid_motion(plant)[0]
    if plant.size > 1:
        motor = _mass_at(plant, plant.actuator)
        if plant.handle is not None:
            link = _mass_at(plant, plant.handle)
        with suppress(ModelError):
            stiffness = _spring(plant)[0]
    return EffectiveParameters(*(np.array(value) for value in (link, motor, rigid, stiffness)))


def _mass_at(plant: Plant, v: Floats) -> float:
    """Effective mass 1 / (v^T M^-1 v) [kg] where v (n,) acts: the plant's handle or actuator."""
    return 1.0 / float(v @ np.linalg.solve(plant.mass, v))


def _check_model(model: str) -> None:
    """Raise ValueError for an unknown name of a model."""
    if model not in MODELS:
        raise ValueError(f"there is no model {model!r}; choose one of {', '.join(MODELS)}")


def _at_joint(drives: Drives) -> tuple[Floats, Floats, Floats]:
    """Rotor inertia, stiffness and damping (d,) of one design's drives, n^2 times those at the motor."""
    n2 = drives.transmission**2
    return n2 * drives.motor_inertia, n2 * drives.stiffness, n2 * drives.damping


def _full(
    mechanism: Mechanism,
    link_mass: Floats,
    h: Floats,
    side: DriveSide,
    damping: Damping,
    encoders: Encoders,
) -> tuple[Plant, list[LaggedDamper]]:
    """M = [M_phi, C; C^T, M_theta], K = D^T k D on the coordinates of the links and the motors of the flexible
    drives, D their deflections T phi - theta and C = J_m n S^T; and the electrical dampers beside the structural
    ones.

    link_mass (c, c), h (c,)  mass matrix of the links, lever arms, in the independent coordinates
    damping, encoders         as of `reduce_mechanism`;   side  the drives' side
    """
    drives = mechanism.drives
    M, K, D, flexible = full_matrices(drives, side, link_mass)
    n, c = len(M), len(h)
    torque_shares, (d, f) = side.shares(h), (len(drives.names), len(flexible))
    links = np.concatenate([side.motion, np.zeros((d, f))], axis=1)
    motors = links.copy()
    motors[flexible] = np.eye(n)[c:]
    actuator, handle = torque_shares @ motors, np.concatenate([h, np.zeros(f)])
    encoded = motors if encoders == "motor" else links
    B = _full_damping(M, K, D, _at_joint(drives)[2][flexible], damping)
    if side.damping is not None:
        B = B + _padded(side.damping, f)
    names = [f"{drives.names[i]} link" for i in range(d) if i not in drives.surplus]
    names += [f"{mechanism.links.names[i]} joint" for i in mechanism.free]
    names += [f"bending {i + 1}" for i in range(c - len(names))]
    names += [f"{drives.names[i]} motor" for i in flexible]
    parts = nonlinear_of_drives(drives, torque_shares, links, motors, encoded)
    rubbing = tuple(
        Friction(np.concatenate([along, np.zeros(f)]), float(level))
        for along, level in zip(side.rubbing, side.coulomb, strict=True)
    )
    parts = replace(parts, friction=parts.friction + rubbing)
    plant = Plant(M, B, K, actuator, torque_shares @ encoded, handle, tuple(names), nonlinear=parts)
    return plant, winding_dampers(drives, motors)


def full_matrices(drives: Drives, side: DriveSide, link_mass: Floats) -> tuple[Floats, Floats, Floats, Ints]:
    """M and K (n, n) of one posture's full model, the deflections D (f, n) of its flexible drives per coordinate,
    and the indices (f,) of these drives; link_mass (c, c) in the independent coordinates, those first among the
    n."""
    rotor, spring, _ = _at_joint(drives)
    flexible = np.flatnonzero(np.isfinite(spring))
    rigid = np.flatnonzero(~np.isfinite(spring))
    c, f, T = link_mass.shape[-1], len(flexible), side.motion
    M = np.zeros((c + f, c + f))
    # rotors behind rigid drives move with the links
    M[:c, :c] = link_mass + T[rigid].T @ (rotor[rigid, None] * T[rigid])
    M[c:, c:] = np.diag(rotor[flexible])
    if side.spin is not None:
        spun = (drives.transmission * drives.motor_inertia)[:, None] * side.spin
        M[:c, :c] += T[rigid].T @ spun[rigid] + spun[rigid].T @ T[rigid]
        M[:c, c:] = spun[flexible].T
        M[c:, :c] = spun[flexible]
    D = np.concatenate([T[flexible], -np.eye(f)], axis=1)
    K = D.T @ (spring[flexible, None] * D)
    if side.stiffness is not None:
        K = K + _padded(side.stiffness, f)
    return M, K, D, flexible


def _padded(matrix: Floats, more: int) -> Floats:
    """The matrix with `more` rows and columns of zeros added at its end."""
    return np.pad(matrix, ((0, more), (0, more)))


def _full_damping(M: Floats, K: Floats, D: Floats, damper: Floats, damping: Damping) -> Floats:
    """Damping (n, n): a ratio of the modes, in proportion to M and K, or dampers (f,) on deflections D (f, n)."""
    if isinstance(damping, ModalDamping):
        return modal_matrix(M, K, damping.ratio)
    if isinstance(damping, ProportionalDamping):
        return damping.mass_coefficient_1_per_s * M + damping.stiffness_coefficient_s * K
    return np.asarray(D.T @ (damper[:, None] * D))


def _two_mass(
    drives: Drives, numbers: EffectiveParameters, h: Floats, damping: Damping, *, link_fixed: bool
) -> Plant:
    """Two masses and their spring; with the link side held fixed only the motor side, with the same damper.

    modal         b = 2 zeta sqrt(k mu),  mu = m1 m2 / (m1 + m2), so that the mode of the pair has the ratio
    proportional  b = r_k k, and r_m on each mass
    given         b = x^T B x, the dampers moved as the drives deflect under one metre: x_i = k h_i / k_i
    """
    m1, m2, k = float(numbers.link_side_mass), float(numbers.motor_side_mass), float(numbers.stiffness)
    b, mass_damping = _damping_between(m1, m2, k, damping), 0.0
    if isinstance(damping, ProportionalDamping):
        mass_damping = damping.mass_coefficient_1_per_s
    elif not isinstance(damping, ModalDamping):
        _, spring, damper = _at_joint(drives)
        b = float(np.sum(damper * (k * h / spring) ** 2))
    plant = _motor_mass(m2, b, k) if link_fixed else _pair(m1, m2, b, k)
    return replace(plant, damping=plant.damping + mass_damping * plant.mass)


def _given_dampers(drives: Drives, side: DriveSide, damping: Damping) -> Floats:
    """Dampers (n, n) of the full model that are given one by one: of joints, of links that bend, and of the drives
    where these are the device's damping."""
    _, spring, damper = _at_joint(drives)
    flexible = np.isfinite(spring)
    f = int(np.count_nonzero(flexible))
    D = np.concatenate([side.motion[flexible], -np.eye(f)], axis=1)
    dampers = (
        D.T @ (damper[flexible, None] * D) if isinstance(damping, GivenDamping) else np.zeros((D.shape[1],) * 2)
    )
    return dampers if side.damping is None else dampers + _padded(side.damping, f)


def _two_mass_of_links(
    full: Plant, numbers: EffectiveParameters, damping: Damping, dampers: Floats, *, link_fixed: bool
) -> Plant:
    """Two masses and their spring for links that bend: the spring is that of drives and links together, dampers
    (n, n) that are given one by one are moved by the motions of the two sides."""
    m1, m2, k = float(numbers.link_side_mass), float(numbers.motor_side_mass), float(numbers.stiffness)
    pair = _pair(m1, m2, _damping_between(m1, m2, k, damping), k)
    if isinstance(damping, ProportionalDamping):
        pair = replace(pair, damping=pair.damping + damping.mass_coefficient_1_per_s * pair.mass)
    W = _motions(full, "two-mass")
    of_sides = W.T @ dampers @ W
    pair = replace(pair, damping=pair.damping + (of_sides + of_sides.T) / 2.0)
    return _motor_mass(m2, float(pair.damping[1, 1]), k) if link_fixed else pair


def _damping_between(link: float, motor: float, stiffness: float, damping: Damping) -> float:
    """Damper [N s/m] between two masses [kg] on a spring [N/m], by their mode's ratio or in proportion to the
    spring; 0 for given dampers."""
    if isinstance(damping, ModalDamping):
        return 2.0 * float(damping.ratio) * float(np.sqrt(stiffness * link * motor / (link + motor)))
    return damping.stiffness_coefficient_s * stiffness if isinstance(damping, ProportionalDamping) else 0.0


def _pair(link: float, motor: float, damping: float, stiffness: float) -> Plant:
    """Plant of a link side, held by the hand, and a motor side [kg], damper [N s/m] and spring [N/m] between."""
    between = np.array([[1.0, -1.0], [-1.0, 1.0]])
    at_link, at_motor = np.array([1.0, 0.0]), np.array([0.0, 1.0])
    return Plant(
        mass=np.diag([link, motor]),
        damping=damping * between,
        stiffness=stiffness * between,
        actuator=at_motor,
        sensor=at_motor.copy(),
        handle=at_link,
        names=("link side", "motor side"),
    )


def _single(mass: float, damping: float, stiffness: float, name: str) -> Plant:
    """Plant of one mass [kg], driven and read, without handle, with damper [N s/m] and spring [N/m] to ground."""
    one = np.ones(1)
    return Plant(
        np.array([[mass]]), np.array([[damping]]), np.array([[stiffness]]), one, one.copy(), None, (name,)
    )


def _motor_mass(mass: float, damping: float, stiffness: float) -> Plant:
    """Plant of the motor side [kg], on damper [N s/m] and spring [N/m] to the link side, which is held fixed."""
    return _single(mass, damping, stiffness, "motor side")


def _rigid(mass: float, damping: float) -> Plant:
    """Plant of the whole device as one mass [kg], held by the hand, with a damper [N s/m] to ground."""
    return replace(_single(mass, damping, 0.0, "device"), handle=np.ones(1))


def _is_two_mass(plant: Plant) -> bool:
    """Whether the plant is a link side and a motor side joined by a spring, in this order; whatever its
    dampers."""
    if plant.size != 2 or plant.handle is None:
        return False
    k = plant.stiffness[0, 0]
    return (
        plant.mass[0, 1] == 0.0
        and k > 0.0
        and np.array_equal(plant.stiffness, k * np.array([[1.0, -1.0], [-1.0, 1.0]]))
        and np.array_equal(plant.handle, [1.0, 0.0])
        and np.array_equal(plant.actuator, [0.0, 1.0])
    )


def _rigid_motion(plant: Plant) -> tuple[float, Floats]:
    """Rigid mass 1/(a^T Z (Z^T M Z)^-1 Z^T a), with a the actuator and Z the rigid modes, and the rigid motion x
    (n,) that a force at the actuator makes, of one metre there: a . x = 1.

    Raises  ModelError  where the actuator moves no rigid mode
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    Z = shapes[:, squared == 0.0]
    participation = Z.T @ plant.actuator
    mobility = float(participation @ participation)
    whole = float(plant.actuator @ np.linalg.solve(plant.mass, plant.actuator))
    # squared, since a mobility goes with the square of a participation
    if not mobility > READING_TOLERANCE**2 * whole:
        raise ModelError(
            "the plant has no rigid mode that the actuator moves: a spring ties it to the ground; use 'full'"
        )
    return 1.0 / mobility, Z @ participation / mobility


def _drag(plant: Plant, motion: Floats) -> float:
    """Damper x^T B x [N s/m] to the ground of a rigid motion x (n,); 0 where dampers inside the plant leave only
    rounding."""
    drag = float(motion @ plant.damping @ motion)
    inside = float(np.abs(motion) @ np.abs(plant.damping) @ np.abs(motion))
    return drag if drag > 1e-12 * inside else 0.0


def _sides(plant: Plant, deflection: Floats) -> Floats | None:
    """Motions W (n, 2) of the link side alone and of the motor side alone, from the deflection x (n,); None where
    a spring ties both to the ground, so that only their difference is a motion.

    With r the rigid motion of one metre, W = [r - w, w] with w = x + (1 - a . x) r, which moves the actuator by
    one metre and the handle by none.
    """
    try:
        _, rigid = _rigid_motion(plant)
    except ModelError:
        return None
    motor_alone = deflection + (1.0 - plant.actuator @ deflection) * rigid
    return np.stack([rigid - motor_alone, motor_alone], axis=1)


def _side_damping(plant: Plant, deflection: Floats) -> Floats:
    """Damping (2, 2) on [link side, motor side]: W^T B W (see `_sides`); without drag x^T B x between them, of the
    deflection x (n,)."""
    sides = _sides(plant, deflection)
    if sides is None or not _drag(plant, sides.sum(axis=1)):
        return float(deflection @ plant.damping @ deflection) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    damping = sides.T @ plant.damping @ sides
    return np.asarray((damping + damping.T) / 2)


def _motions(plant: Plant, model: Model) -> Floats:
    """The motions (n, m) of a plant, in columns, that the m coordinates of its reduced model stand for."""
    if model == "rigid":
        return _rigid_motion(plant)[1][:, None]
    _, deflection = _spring(plant)
    sides = _sides(plant, deflection)
    both = np.stack([-deflection, deflection], axis=1) if sides is None else sides
    return both[:, 1:] if model == "motor-mass" else both


def _with_sensor_and_elements(reduced: Plant, plant: Plant, model: Model) -> Plant:
    """The reduced plant with the sensor, lagged dampers and nonlinear parts of the plant that it replaces."""
    if not plant.lagged_dampers and not plant.nonlinear and np.array_equal(plant.sensor, plant.actuator):
        return reduced
    motions = _motions(plant, model)
    read = _with_sensor(reduced, plant, motions)
    parts = _reduced_nonlinear(read, plant, motions)
    return add_dampers(replace(read, nonlinear=parts), project_dampers(plant.lagged_dampers, motions))


def _reduced_nonlinear(reduced: Plant, plant: Plant, motions: Floats) -> Nonlinear:
    """The nonlinear parts of a reduced plant, as its motions move them.

    A single counter of the whole reading counts the reduced sensor, which is known even where springs tie the
    plant to the ground; there the readings of several counters are not known.

    Raises  ModelError  where they are not
    """
    projected, counters = plant.nonlinear.project(motions), plant.nonlinear.counters
    if len(counters) == 1 and np.array_equal(counters[0].weight * counters[0].along, plant.sensor):
        return replace(projected, counters=(replace(counters[0], along=reduced.sensor / counters[0].weight),))
    summed_reading = sum((part.weight * part.along for part in projected.counters), np.zeros(reduced.size))
    if counters and not np.allclose(
        summed_reading, reduced.sensor, rtol=0.0, atol=READING_TOLERANCE * np.max(np.abs(summed_reading))
    ):
        raise ModelError("the plant is tied to the ground, and what encoders count of two masses is not known")
    return projected


def _with_handle(reduced: Plant, plant: Plant, motion: Floats) -> Plant:
    """The rigid model `reduced` of a plant with the plant's handle: as far as its rigid motion (n,) moves that."""
    if plant.handle is None:
        return reduced
    share = float(plant.handle @ motion)
    near = abs(share - 1.0) <= READING_TOLERANCE
    return reduced if near else replace(reduced, handle=np.array([share]) if share else None)


def _with_sensor(reduced: Plant, plant: Plant, motions: Floats) -> Plant:
    """The reduced plant with its sensor: where the wall acts, where the hand is, or what the motions move it by.

    Raises  ModelError  where that is not known, or the sensor reads nothing
    """
    if np.array_equal(plant.sensor, plant.actuator):
        return reduced
    sensor = project_onto_motions(plant.sensor, motions)
    if reduced.size > 1 and plant.handle is not None and np.array_equal(plant.sensor, plant.handle):
        sensor = reduced.handle if reduced.handle is not None else sensor
    # the last motion is that of the motor side, or of the whole: one metre at the actuator unless springs hold it
    elif not abs(plant.actuator @ motions[:, -1] - 1.0) <= READING_TOLERANCE:
        raise ModelError(
            "the plant is tied to the ground, and what the sensor reads of two masses is not known; use 'full'"
        )
    if not np.any(sensor):
        raise ModelError("the sensor reads nothing of what moves in this model; use 'full'")
    return replace(reduced, sensor=sensor)


def _spring(plant: Plant) -> tuple[float, Floats]:
    """Stiffness k [N/m] between actuator a and handle h, and the static deflection x (n,) of one metre between
    them.

    x = k K^+ (a - h), by the flexible modes; it exists only where a - h does no work on a rigid motion.

    Raises  ModelError  where it does not exist, or k is not positive
    """
    if plant.handle is None:
        raise ModelError("the plant has no handle, so that it has no link side; give `handle`, or use 'rigid'")
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    between = shapes.T @ (plant.actuator - plant.handle)
    scale = np.linalg.norm(shapes.T @ plant.actuator)
    rigid = squared == 0.0
    if np.linalg.norm(between[rigid]) > READING_TOLERANCE * scale:
        raise ModelError(
            "actuator and handle do not move together when the plant moves without deflection, "
            "so that no spring joins them; check `actuator` and `handle`, or use 'full'"
        )
    if not np.linalg.norm(between[~rigid]) > READING_TOLERANCE * scale:
        raise ModelError("nothing flexible lies between actuator and handle of the plant; use 'rigid'")
    flexible = between[~rigid] / squared[~rigid]
    compliance = float(between[~rigid] @ flexible)
    if not compliance > 0.0:
        raise ModelError(
            "the stiffness between actuator and handle is negative: no two masses have it; use 'full'"
        )
    return 1.0 / compliance, shapes[:, ~rigid] @ flexible / compliance
