"""A mechanism as arrays: rigid links in a tree, loops closed by points, axes or frames, drives on some joints.

Every number may carry leading batch axes (a set of designs that share one topology); the topology itself
(parents, joint types, which joints are driven, what closes on what) is the same for the whole batch.

Every entry of `Links` has at most one joint coordinate. A universal joint is two entries, of which the first is a
link without mass; a ball joint is three, BALL_X, BALL_Y and BALL_Z, one behind the other, of which the last is the
body. The three coordinates of a ball joint are its rotation vector v [rad], the link standing at Exp(v) against
its parent, and their rates are its angular velocity about its own axes: there is no posture in which they fail, as
three successive angles do when two of their axes meet.

Nonlinear parts of a mechanism's drives, at the joints: friction, counters, springs, brakes, a force limit.

A number at the motor is referred to the joint by the transmission's ratio n: a torque by n, a stiffness or damping
by n^2, a torque per angle cubed by n^4, an angle by 1/n.

Of a transmission whose ratio changes with the joint each posture has its own. A motor that has turned by f(q) when
its joint is at q has the ratio n(q) = f'(q). About a posture q0 at rest, with theta the motor's angle less f(q0),
over n(q0), a spring k at the motor gives the joint the torque

    n(q) k (n(q0) theta - f(q) + f(q0)) = n(q0)^2 k (theta - (q - q0)) + second order

so that every linear answer is that of the constant ratio n(q0). With a torque tau at the motor at rest, as of a
hand that leans on a wall, the joint has the torque n'(q0) tau (q - q0) besides; `equilibrium` has it, with all
else that a load changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.model.design_axes import Array1, Array2, Array3, Number, design_shape
from zwidth.model.flexible_body import FlexibleLink
from zwidth.model.plant import Brake, Counter, Friction, FrictionModel, Nonlinear, Spring

if TYPE_CHECKING:
    from zwidth.model.posture import Posture


ROUNDING: Final = 1e-9  # share of a table's length beyond its ends that counts as its end
TURN: Final = 2.0 * np.pi


@dataclass(frozen=True)
class RatioTable:
    """The ratio of a drive over its joint's coordinate, between its entries a cubic that keeps their shape.

    coordinate  (k,)  at least two, strictly increasing [rad], of a prismatic joint [m]
    ratio       (..., k)  motor turns per joint turn, of a prismatic joint radians of the motor per metre
    turns       whether the joint is revolute: then a turn more or less is the same
    """

    coordinate: Floats
    ratio: Array1
    turns: bool

    @cached_property
    def _coefficients(self) -> Floats:
        """Coefficients (4, P, k - 1) of P designs' cubics, highest power first; the cubic of span i is in
        q - coordinate[i], the way from the beginning of that span."""
        from scipy.interpolate import PchipInterpolator  # which devices without a table do without

        ratio = self.ratio.reshape(-1, len(self.coordinate))
        return np.asarray(np.swapaxes(PchipInterpolator(self.coordinate, ratio, axis=1).c, 1, 2))

    def at(self, coordinate: Floats) -> Floats:
        """The ratio at coordinates (...), by Fritsch and Butland's monotone cubic; nan outside of the table.
        Axes of designs broadcast with those of the coordinates.

        >>> RatioTable(np.array([0.0, 1.0]), np.array([3.0, 5.0]), True).at(np.array([0.5, 0.5 - TURN, 2.0]))
        array([ 4.,  4., nan])
        """
        q, inside = self._within(coordinate)
        c, x, _ = self._cubic(q)
        return np.asarray(np.where(inside, ((c[0] * x + c[1]) * x + c[2]) * x + c[3], np.nan))

    def slope(self, coordinate: Floats) -> Floats:
        """Derivative n'(q) of the ratio at coordinates (...); nan outside of the table."""
        q, inside = self._within(coordinate)
        c, x, _ = self._cubic(q)
        return np.asarray(np.where(inside, (3.0 * c[0] * x + 2.0 * c[1]) * x + c[2], np.nan))

    def motor_angle(self, coordinate: Floats) -> Floats:
        """Angle f(q) by which the motor has turned since the joint was at the table's first entry [rad], at
        coordinates (...) of one design; nan outside of the table."""
        q, inside = self._within(coordinate)
        c, x, span = self._cubic(q)
        cubics = self._coefficients[:, 0]
        steps = np.diff(self.coordinate)
        # the integral of each whole span's cubic, and of all before; then that of the span begun
        passed = (
            ((cubics[0] * steps / 4.0 + cubics[1] / 3.0) * steps + cubics[2] / 2.0) * steps + cubics[3]
        ) * steps
        before = np.concatenate([[0.0], np.cumsum(passed)])[span]
        in_span = (((c[0] * x / 4.0 + c[1] / 3.0) * x + c[2] / 2.0) * x + c[3]) * x
        return np.asarray(np.where(inside, before + in_span, np.nan))

    def _within(self, coordinate: Floats) -> tuple[Floats, Flags]:
        """Coordinates (...) moved into the table by whole turns, and whether they are in it then; those that are
        not come back as its first entry."""
        q, low, high = np.asarray(coordinate, dtype=np.float64), self.coordinate[0], self.coordinate[-1]
        slack = ROUNDING * (high - low)
        if self.turns:
            outside = (q < low - slack) | (q > high + slack)
            # by the first whole turn that brings it above the lower end
            q = np.where(outside, q + TURN * np.ceil((low - slack - q) / TURN), q)
        inside = (q >= low - slack) & (q <= high + slack)
        return np.where(inside, np.clip(q, low, high), low), inside

    def _cubic(self, q: Floats) -> tuple[Floats, Floats, Ints]:
        """Of each coordinate (...) within the table: coefficients (4, ...) of its span's cubic, highest power
        first, the way into the span (...), and the index of the span (...)."""
        span = np.clip(np.searchsorted(self.coordinate, q, side="right") - 1, 0, len(self.coordinate) - 2)
        return self._coefficients[:, self._design(q.shape), span], q - self.coordinate[span], span

    def _design(self, shape: tuple[int, ...]) -> Ints:
        """Index of the design for each coordinate of an array of a shape, broadcast with the axes of the
        designs."""
        designs = self.ratio.shape[:-1]
        numbers = np.arange(int(np.prod(designs))).reshape(designs)
        return np.broadcast_to(numbers, np.broadcast_shapes(designs, shape))


def at_postures(mechanism: Mechanism, posture: Posture) -> Mechanism:
    """The mechanism with each drive's ratio in each posture (...), as designs that differ in nothing else; itself
    where no ratio changes. The ratio is nan where a posture is not OK, or outside of the table."""
    drives = drives_at(mechanism.drives, posture)
    return mechanism if drives is mechanism.drives else replace(mechanism, drives=drives)


def drives_at(drives: Drives, posture: Posture) -> Drives:
    """The drives with their ratios (..., d) in postures (...); themselves where no ratio changes."""
    if drives.ratio_tables is None:
        return drives
    q = posture.angles[..., drives.joint]
    return _with_ratios(
        drives, [table if table is None else table.at(q[..., i]) for i, table in enumerate(drives.ratio_tables)]
    )


def with_any_ratio(drives: Drives) -> Drives:
    """The drives with the first ratio of each table, for what hangs on there being one and not on its size."""
    if drives.ratio_tables is None:
        return drives
    return _with_ratios(drives, [table if table is None else table.ratio[..., 0] for table in drives.ratio_tables])


def _with_ratios(drives: Drives, ratios: list[Floats | None]) -> Drives:
    """The drives with ratios (...) in place of their tables; where a ratio is None, that of the drive stays."""
    given = drives.transmission
    columns = [given[..., i] if ratio is None else ratio for i, ratio in enumerate(ratios)]
    return replace(drives, transmission=np.stack(np.broadcast_arrays(*columns), axis=-1), ratio_tables=None)


Compensation = Literal["none", "computed", "counterweight"]

FIXED: Final = 0
REVOLUTE: Final = 1
PRISMATIC: Final = 2
BALL_X: Final = 3
BALL_Y: Final = 4
BALL_Z: Final = 5

# What of two links a closure holds together.
POINT: Final = 0
AXIS: Final = 1
FRAME: Final = 2

# What of its handle a mechanism controls, and a posture is asked by.
POSITION: Final = 0
POSE: Final = 1
ORIENTATION: Final = 2


@dataclass(frozen=True)
class Links:
    """The n links, parents before children.

    names      (n,)         unique; "link/..." for those that a joint with several coordinates has before its link
    parent     (n,)         index of the parent link, -1 for the base
    joint      (n,)         FIXED, REVOLUTE, PRISMATIC, or BALL_X, BALL_Y and BALL_Z in this order
    origin     (..., n, 3)  joint origin in the parent's frame [m]
    rotation   (..., n, 3, 3)  link axes in the parent's frame at joint coordinate 0
    axis       (..., n, 3)  unit joint axis in the link's frame; of a ball joint x, y and z
    mass       (..., n)     [kg]
    center_of_mass (..., n, 3)  in the link's frame [m]
    inertia    (..., n, 3, 3)  about the centre of mass, link axes [kg m²]
    tip        (..., n, 3)  the link's tip in its own frame, (length, 0, 0) [m]; drawn, and default for points
    lower, upper  (..., n)  limits of each revolute joint [rad] and prismatic one [m], infinite where there is
                            none; None: no limits
    joint_stiffness, joint_damping, joint_coulomb  (..., n)  spring at rest where the joint stands, damper and dry
                            friction of each joint by itself [N m/rad], [N m s/rad], [N m], of a prismatic one
                            [N/m], [N s/m], [N]; None: of none
    """

    names: tuple[str, ...]
    parent: Ints
    joint: Ints
    origin: Array2
    rotation: Array3
    axis: Array2
    mass: Array1
    center_of_mass: Array2
    inertia: Array3
    tip: Array2
    lower: Array1 | None = None
    upper: Array1 | None = None
    joint_stiffness: Array1 | None = None
    joint_damping: Array1 | None = None
    joint_coulomb: Array1 | None = None


@dataclass(frozen=True)
class Closures:
    """The k loop closures: a point of link a stays on a point of link b; of some, an axis or a frame too.

    a, b       (k,)         link indices, -1 for the base
    point_a, point_b  (..., k, 3)  in the frames of the links [m]
    kind       (k,)         POINT; AXIS: the axes also stay parallel, as in a hinge; FRAME: the links also keep
                            their orientation, as if welded. None: all are points
    axis_a, axis_b    (..., k, 3)  unit vectors in the frames of the links, of AXIS; None: of none
    rotation   (..., k, 3, 3)  axes of link b in the frame of link a, of FRAME; None: of none
    """

    names: tuple[str, ...]
    a: Ints
    b: Ints
    point_a: Array2
    point_b: Array2
    kind: Ints | None = None
    axis_a: Array2 | None = None
    axis_b: Array2 | None = None
    rotation: Array3 | None = None


@dataclass(frozen=True)
class DriveNonlinearity:
    """Nonlinear parts of the drives, all at the motor; 0, or nan where stated, means that there is none.

    coulomb             (..., d)  dry friction between rotor and housing [N m]
    friction_model      of all of it, as in `plant.Friction`
    breakaway           (..., d)  its static level [N m], of lugre; nan: that of `coulomb`
    bristle_stiffness   of dahl and lugre [N m/rad]
    bristle_damping     of lugre [N m s/rad]
    stribeck_velocity   of lugre [rad/s]
    hardening           (..., d)  k_3 of the transmission's torque k d + k_3 d^3 [N m/rad³]
    backward_stiffness  (..., d)  its stiffness where the motor lags behind the joint [N m/rad]; nan: the same
    preload             (..., d)  torque beyond which it has that stiffness [N m]
    brake_damping       (..., d)  largest damping of a programmable brake on the rotor [N m s/rad]
    brake_time_constant (..., d)  [s]
    encoder_noise       (..., d)  standard deviation of the motor's angle before it is counted [rad]
    """

    coulomb: Array1
    friction_model: FrictionModel
    breakaway: Array1
    bristle_stiffness: float
    bristle_damping: float
    stribeck_velocity: float
    hardening: Array1
    backward_stiffness: Array1
    preload: Array1
    brake_damping: Array1
    brake_time_constant: Array1
    encoder_noise: Array1


@dataclass(frozen=True)
class Drives:
    """The d drives, each on one revolute or prismatic joint; their order is the order of the driven coordinates.

    The coordinate of a drive is its motor's angle over `transmission`, at its joint: the joint's own coordinate,
    or that and what other joints add to it (`coupling`).

    joint            (d,)      index of the driven link (its joint)
    motor_inertia    (..., d)  rotor [kg m²], at the motor
    transmission     (..., d)  motor turns per joint turn; nan of a drive with a table
    stiffness        (..., d)  at the motor shaft [N m/rad]; inf: rigid
    damping          (..., d)  parallel to that stiffness, at the motor shaft [N m s/rad]
    torque_constant  (..., d)  [N m/A], nan if not known
    torque_limit     (..., d)  at the motor [N m], inf if none
    encoder_counts   (..., d)  per motor revolution after quadrature, nan if not known
    continuous_torque (..., d)  what a motor bears without end, at the motor [N m], nan if not known; None: of none
    winding_resistance (..., d)  of the motor's winding [ohm], nan if not known; None: of none
    winding_damping  (..., d)  k_t^2/R of a winding closed through a resistor, at the motor [N m s/rad]; None: none
    winding_time_constant  (..., d)  its L/R [s]
    nonlinearity     friction, springs that are not straight, brakes; None: none
    coupling         (..., d, n)  motor turns per joint turn of other joints that turn the motor too, over
                     `transmission`; 0 for the drive's own joint. None: of none
    surplus          (s,)  drives beyond the mechanism's freedom, whose coordinates the others determine
    motor_link       (d,)  link that carries the motor, -1 for the base, for the full kinetic energy of its rotor;
                     None: the rotors' turning with their links is neglected, as in thesis eq. 2.21
    motor_axis       (..., d, 3)  the rotor's spin axis in that link's frame, in the sense in which the motor's
                     angle counts; of length 0 for a drive of which it is neglected
    ratio_tables     (d,)  of each drive whose ratio changes with its joint, the others None:
                     `at_postures` looks them up; None: no ratio changes
    """

    names: tuple[str, ...]
    joint: Ints
    motor_inertia: Array1
    transmission: Array1
    stiffness: Array1
    damping: Array1
    torque_constant: Array1
    torque_limit: Array1
    encoder_counts: Array1
    continuous_torque: Array1 | None = None
    winding_resistance: Array1 | None = None
    winding_damping: Array1 | None = None
    winding_time_constant: Array1 | None = None
    nonlinearity: DriveNonlinearity | None = None
    coupling: Array2 | None = None
    surplus: tuple[int, ...] = ()
    motor_link: Ints | None = None
    motor_axis: Array2 | None = None
    ratio_tables: tuple[RatioTable | None, ...] | None = None


# Where a device's own damping comes from: three sources, each applied to the full model's matrices and to the
# reduced models in `reduction`.


@dataclass(frozen=True)
class ModalDamping:
    """Damping ratio zeta of every flexible mode, 0.05 for 5 %; at least 0."""

    ratio: Number

    def __post_init__(self) -> None:
        """Raise ValueError for a ratio that is not finite or below 0."""
        _check_coefficient("damping ratio", self.ratio)


@dataclass(frozen=True)
class ProportionalDamping:
    """B = r_m M + r_k K, both coefficients at least 0 (thesis eq. 3.2)."""

    mass_coefficient_1_per_s: Number
    stiffness_coefficient_s: Number

    def __post_init__(self) -> None:
        """Raise ValueError for a coefficient that is not finite or below 0."""
        _check_coefficient("mass coefficient", self.mass_coefficient_1_per_s)
        _check_coefficient("stiffness coefficient", self.stiffness_coefficient_s)


@dataclass(frozen=True)
class GivenDamping:
    """The dampers of the drives, parallel to their stiffnesses (`Drives.damping`)."""


Damping = ModalDamping | ProportionalDamping | GivenDamping


def _check_coefficient(what: str, value: float) -> None:
    """Raise ValueError unless the value, of one design or of several, is finite and at least 0."""
    if not np.all(np.isfinite(value) & (np.asarray(value) >= 0.0)):
        raise ValueError(f"the {what} must be a finite number of at least 0, got {value}")


@dataclass(frozen=True)
class Mechanism:
    """Links, closures and drives, with the handle and the named ways of assembling it.

    handle_link, handle_point  the handle: a point (..., 3) of that link [m]
    assemblies    name -> approximate joint coordinates (n,) near the reference posture (0 for fixed joints) [rad],
                  of a prismatic joint [m]
    reference_position (3,)    handle position the assemblies are given at [m]
    workspace     (3, 2)       bounds of the handle's position, nan where not given [m]
    handle_rotation  (..., 3, 3)  axes of the handle in the frame of its link; None: those of the link
    controls      POSITION, POSE or ORIENTATION: what of its handle the drives control
    reference_rotation  (..., 3, 3)  axes of the handle in the base frame at the reference; None: where the
                  assembly has them, which only a mechanism that controls the position alone may leave open
    free          (f,)         links whose joint coordinate nobody drives and no loop determines
    flexible      links that bend, in place of rigid ones
    gravity_compensation       "none"; "computed", by the computer, from the posture that it counts;
                  "counterweight", by masses or springs that balance the links in every posture
    """

    links: Links
    closures: Closures
    drives: Drives
    handle_link: int
    handle_point: Array1
    assemblies: dict[str, Array1]
    reference_position: Array1
    workspace: Floats
    handle_rotation: Array2 | None = None
    controls: int = POSITION
    reference_rotation: Array2 | None = None
    free: tuple[int, ...] = ()
    flexible: tuple[FlexibleLink, ...] = ()
    gravity_compensation: Compensation = "none"

    @cached_property
    def driven(self) -> Ints:
        """The links whose joints are the driven coordinates: those of all drives but the surplus ones."""
        kept = [i for i in range(len(self.drives.joint)) if i not in self.drives.surplus]
        return np.asarray(self.drives.joint)[kept]

    @cached_property
    def design_shape(self) -> tuple[int, ...]:
        """Leading axes of all numbers: () for one design."""
        return design_shape(self)

    @property
    def made_rigid(self) -> Mechanism:
        """The same mechanism with drives and links that do not bend."""
        drives = replace(self.drives, stiffness=np.full_like(self.drives.stiffness, np.inf))
        return replace(self, drives=drives, flexible=())


def nonlinear_of_drives(
    drives: Drives,
    h: Floats,
    links: Floats,
    motors: Floats,
    encoders: Floats,
    bent: Floats | None = None,
    backward: bool = False,
) -> Nonlinear:
    """All nonlinear parts of the drives, and counters and the force limit, in a plant whose coordinates are joint
    angles.

    friction     n C on the motor's coordinate, its bristles n^2 as stiff
    counters     2 pi/(N n) of what is counted, each weighed by h_i: their sum is the handle's reading h . counted
    springs      with d = theta - phi, n^4 k_3 d^3, and for d < -T_p/(n k) what n^2 times the backward stiffness is
                 above n^2 times the other: forward is where the motor is ahead of the joint, T_p the preload
    brakes       n^2 b on the motor's coordinate
    force_limit  min_i n_i tau_i/|h_i|: the largest force along the direction that no motor's limit cuts. Beyond
                 it all torques are scaled alike, so that the force keeps its direction

    h         (d,)    J^T u, torques at the joints per force along the direction
    links     (d, n)  row i: the coordinate that turns with the link of drive i
    motors    (d, n)  row i: the one that turns with its motor; of a rigid drive the same
    encoders  (d, n)  row i: the one that its encoder counts, either of them
    bent      (d,)  deflections of the springs under load; None: no load
    backward  whether a spring whose deflection is just at the kink, as without preload one that is not bent, is
              tangent to the branch behind it
    """
    n, nonlinear = drives.transmission, drives.nonlinearity
    pulled = h != 0.0
    limits = n[pulled] * drives.torque_limit[pulled] / np.abs(h[pulled])
    return Nonlinear(
        friction=() if nonlinear is None else _friction(n, nonlinear, motors),
        counters=_counters(drives, h, encoders),
        springs=() if nonlinear is None else _springs(drives, nonlinear, motors - links, bent, backward),
        brakes=() if nonlinear is None else _brakes(n, nonlinear, motors),
        force_limit=float(np.min(limits, initial=inf)),
    )


def _friction(n: Floats, nonlinear: DriveNonlinearity, motors: Floats) -> tuple[Friction, ...]:
    """Dry friction of the drives that have it; n (d,) ratios, motors (d, n) as in `nonlinear_of_drives`."""
    return tuple(
        Friction(
            along=motors[i],
            coulomb=float(n[i] * nonlinear.coulomb[i]),
            model=nonlinear.friction_model,
            bristle_stiffness=float(n[i] ** 2 * nonlinear.bristle_stiffness),
            bristle_damping=float(n[i] ** 2 * nonlinear.bristle_damping),
            breakaway=float(n[i] * nonlinear.breakaway[i]),
            stribeck_velocity=float(nonlinear.stribeck_velocity / n[i]),
        )
        for i in np.flatnonzero(nonlinear.coulomb > 0.0)
    )


def _counters(drives: Drives, h: Floats, counted: Floats) -> tuple[Counter, ...]:
    """Encoder steps of the drives, read by rows counted (d, n) and weighed by h (d,), those with weight; () where
    neither a step nor noise is known. A step that is not known is 0: as fine as you like."""
    n, counts = drives.transmission, drives.encoder_counts
    known = np.isfinite(counts)
    noise = np.zeros(len(h)) if drives.nonlinearity is None else drives.nonlinearity.encoder_noise / n
    if not known.any() and not noise.any():
        return ()
    step = np.where(known, 2.0 * np.pi / np.where(known, counts * n, 1.0), 0.0)
    return tuple(
        Counter(counted[i], float(step[i]), weight=float(h[i]), noise=float(noise[i]), channel=int(i))
        for i in np.flatnonzero(h)
    )


def _springs(
    drives: Drives, nonlinear: DriveNonlinearity, deflections: Floats, bent: Floats | None, backward: bool
) -> tuple[Spring, ...]:
    """What the drives' springs add to a constant stiffness, of those that add anything; deflections (d, n): row i
    reads theta - phi of drive i, bent and backward as in `nonlinear_of_drives`."""
    n = drives.transmission
    cubic = n**4 * nonlinear.hardening
    excess = np.zeros(len(n))
    given = np.isfinite(nonlinear.backward_stiffness)
    excess[given] = n[given] ** 2 * (nonlinear.backward_stiffness[given] - drives.stiffness[given])
    offset = np.zeros(len(n)) if bent is None else bent
    kink = kinks(drives, nonlinear)
    behind = (offset < kink) | ((offset == kink) & backward)
    curved = np.flatnonzero(np.isfinite(drives.stiffness) & ((cubic != 0.0) | (excess != 0.0)))
    return tuple(
        Spring(
            deflections[i],
            float(cubic[i]),
            float(excess[i]),
            float(kink[i]),
            float(offset[i]),
            bool(behind[i] and excess[i]),
        )
        for i in curved
    )


def kinks(drives: Drives, nonlinear: DriveNonlinearity) -> Floats:
    """Deflections (d,) at the joint, not positive, at which the drives' stiffness changes [rad]."""
    n = drives.transmission
    preloaded = np.isfinite(drives.stiffness) & (nonlinear.preload > 0.0)
    return np.asarray(
        np.where(preloaded, -nonlinear.preload / (n * np.where(preloaded, drives.stiffness, 1.0)), 0.0)
    )


def _brakes(n: Floats, nonlinear: DriveNonlinearity, motors: Floats) -> tuple[Brake, ...]:
    """Electrical brakes of the drives that have one; n (d,) ratios, motors (d, n) as in `nonlinear_of_drives`."""
    return tuple(
        Brake(motors[i], float(n[i] ** 2 * nonlinear.brake_damping[i]), float(nonlinear.brake_time_constant[i]))
        for i in np.flatnonzero(nonlinear.brake_damping > 0.0)
    )
