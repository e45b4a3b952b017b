"""The modes that a rendered direction meets, for many postures of a mechanism at once.

Of the full model [phi; theta] with flexible drives F, relative to the joints n^2 k and n^2 I, let M be the links'
mass matrix with the rotors of rigid drives. The deflections d = phi_F - theta obey d'' = -(E^T M^-1 E + I^-1) k d,
a symmetric eigenproblem of the size of F alone:

    S = k^1/2 (E^T M^-1 E + I^-1) k^1/2,      S e = w^2 e

with the mass-normalised shapes v_phi = -M^-1 E k^1/2 e / w and v_theta = I^-1 k^1/2 e / w. All motions in which no
drive deflects are free and act as one, of the mass 1/(h^T (M_phi + M_theta)^-1 h). So nothing of the size of the
whole plant is ever decomposed; `reduction` and `modes` say the same of one posture, for any damping.

Many plants as sums of second-order parts, one for each pair of poles: held by an operator or not.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.compiled import compiled, compiled_lean
from zwidth.model.effective_mass import EffectiveParameters, effective_parameters, inverse_form, lever_arms, screw
from zwidth.model.mechanism import Damping, Mechanism, ModalDamping, ProportionalDamping, at_postures
from zwidth.model.mechanism_arrays import design_of_each, per_design
from zwidth.model.posture import Posture
from zwidth.model.reduction import Encoders, Model
from zwidth.resources import in_chunks


@dataclass(frozen=True)
class RenderedModes:
    """Modes xi'' + 2 a xi' + w^2 xi = input f,  y = sum output xi, as in `modes.RealModes`; N postures, m modes.

    decay              (N, m)  a [1/s]
    frequency_squared  (N, m)  w^2 [1/s²]; 0 for the free motion
    input, output, handle  (N, m)  participation of the wall force, of the reading and of the handle along the
                           direction [kg^-1/2]; input is nan where a posture is not OK or the handle cannot move
                           along the direction, handle where there is none
    drag     (N, m, m)  modal dampers V^T B V [1/s]; None: 2 a on the diagonal, nothing else
    coupled  (N,)       whether a plant's dampers couple its modes, or may; None: nowhere
    """

    decay: Floats
    frequency_squared: Floats
    input: Floats
    output: Floats
    handle: Floats
    drag: Floats | None = None
    coupled: Flags | None = None

    @property
    def pairs(self) -> PolePairs:
        """The modes as pairs of poles; not those of plants whose dampers couple them."""
        position = self.input * self.output
        reach = np.abs(self.input).sum(axis=1) * np.abs(self.output).sum(axis=1)
        return PolePairs(self.decay, self.frequency_squared, position, np.zeros_like(position), reach)

    def rows(self, rows: Ints) -> RenderedModes:
        """The modes of some of the plants, by their indices."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        return replace(self, **{name: value[rows] for name, value in values.items() if value is not None})


def rendered_modes(
    mechanism: Mechanism,
    posture: Posture,
    direction: Floats,
    model: Model,
    damping: Damping,
    encoders: Encoders = "motor",
) -> RenderedModes | None:
    """The modes of each posture's model along its direction, of one design or of many, of a plain mechanism
    (`effective_mass.is_plain`); None for readings behind the drives in a reduced model.

    posture    (...), flattened to N; the designs of the mechanism broadcast with it
    direction  (..., 3)  unit vectors, or (..., 6) screws (`effective_mass.screw`)
    damping, encoders  as of `reduction.reduce_mechanism`
    Returns    nan as input where there are no such modes: given dampers that couple them, windings closed through
               resistors, rigid drives in a model that needs flexible ones
    """
    if encoders != "motor" and model != "full":
        return None
    mechanism = at_postures(mechanism, posture)
    drives = mechanism.drives
    shape = np.broadcast_shapes(posture.status.shape, direction.shape[:-1], mechanism.design_shape)
    design = design_of_each(mechanism, shape)
    ratio = per_design(mechanism, drives.transmission, 1)
    spring = ratio**2 * per_design(mechanism, drives.stiffness, 1)
    # B = r_m M + r_k K and a ratio on every flexible mode: a = (r_m + r_k w^2)/2 + ratio w
    coefficients = _coefficients(mechanism, damping)
    # row of the coefficients of each posture: that of its design, or its own
    each = design if len(coefficients) == int(np.prod(mechanism.design_shape)) else np.arange(len(coefficients))
    if drives.winding_damping is not None:
        braked = per_design(mechanism, drives.winding_damping, 1).any(axis=1)
        coefficients[np.broadcast_to(braked, len(coefficients))] = np.nan
    if model == "full":
        rotor = ratio**2 * per_design(mechanism, drives.motor_inertia, 1)
        modes = _modes_of_full(rotor, spring, posture, direction, design, shape, encoders)
        r_m, r_k, share = coefficients[each].T[:, :, None]
        decay = 0.5 * (r_m + r_k * modes.frequency_squared) + share * np.sqrt(modes.frequency_squared)
        modes = replace(modes, decay=decay)
    else:
        if model != "rigid":
            rigid = ~np.isfinite(spring).any(axis=1)
            coefficients[np.broadcast_to(rigid, len(coefficients))] = np.nan
        numbers = effective_parameters(mechanism, posture, direction)
        modes = _modes_of_reduced(numbers, model, coefficients[each])
    modes.input[np.isnan(modes.decay).any(axis=-1)] = np.nan
    return modes


def _coefficients(mechanism: Mechanism, damping: Damping) -> Floats:
    """Damping coefficients r_m [1/s] and r_k [s], and damping ratio, of each design (P, 3), or each point (N, 3)
    where the designs differ in their damping alone; nan where given dampers couple the modes."""
    P = int(np.prod(mechanism.design_shape))
    if isinstance(damping, ModalDamping):
        out = np.zeros((max(P, np.size(damping.ratio)), 3))
        out[:, 2] = np.ravel(damping.ratio)
        return out
    if isinstance(damping, ProportionalDamping):
        size = max(np.size(damping.mass_coefficient_1_per_s), np.size(damping.stiffness_coefficient_s))
        out = np.zeros((max(P, size), 3))
        out[:, 0], out[:, 1] = (
            np.ravel(damping.mass_coefficient_1_per_s),
            np.ravel(damping.stiffness_coefficient_s),
        )
        return out
    out = np.zeros((P, 3))
    stiffness, damper = (
        per_design(mechanism, each, 1) for each in (mechanism.drives.stiffness, mechanism.drives.damping)
    )
    # given dampers leave the modes apart where they are in proportion to the springs, by one share in all drives
    flexible = np.isfinite(stiffness)
    share = np.where(flexible, damper / np.where(flexible, stiffness, 1.0), np.nan)
    first = np.argmax(flexible, axis=1)
    common = np.where(flexible.any(axis=1), share[np.arange(P), first], 0.0)
    alike = np.where(flexible, share == common[:, None], True).all(axis=1)
    out[:, 1] = np.where(alike, common, np.nan)
    return out


def _modes_of_reduced(numbers: EffectiveParameters, model: Model, coefficients: Floats) -> RenderedModes:
    """Modes of the reduced models, masses and a spring: with the pair's reduced mass mu, w^2 = k/mu.

    The two masses' own ratio is that of their mode; the motor mass keeps the damper of the pair (`reduction`).

    numbers       effective masses and stiffness of N postures
    coefficients  (N, 3)  r_m [1/s], r_k [s] and damping ratio of each posture
    """
    r_m, r_k, ratio = coefficients.T
    m1, m2 = numbers.link_side_mass.ravel(), numbers.motor_side_mass.ravel()
    k, mass = numbers.stiffness.ravel(), numbers.rigid_mass.ravel()
    # of each mode: decay, squared frequency, participation of force and reading, that of the handle
    if model == "rigid":
        # 0.0 * mass: 0 of the same shape, but nan where the mass is
        modes = [(0.5 * r_m + 0.0 * mass, 0.0 * mass, 1.0 / np.sqrt(mass), 1.0 / np.sqrt(mass))]
    else:
        mu = 1.0 / (1.0 / m1 + 1.0 / m2)
        damper = 2.0 * ratio * np.sqrt(k * mu) + r_k * k  # the damper between them
        if model == "motor-mass":
            modes = [(0.5 * (r_m + damper / m2), k / m2, 1.0 / np.sqrt(m2), np.nan * m2)]  # holds the handle fixed
        else:
            free = 1.0 / np.sqrt(m1 + m2)
            modes = [
                (0.5 * r_m + 0.0 * m1, 0.0 * m1, free, free),
                (0.5 * (r_m + damper / mu), k / mu, np.sqrt(mu) / m2, -np.sqrt(mu) / m1),
            ]
    decay, squared, participation, handle = (np.stack(part, axis=-1) for part in zip(*modes, strict=True))
    participation = np.where(np.isfinite(participation) & np.isfinite(squared), participation, np.nan)
    return RenderedModes(decay, squared, participation, participation.copy(), handle)


def _modes_of_full(
    rotor: Floats,
    spring: Floats,
    posture: Posture,
    direction: Floats,
    design: Ints,
    shape: tuple[int, ...],
    encoders: Encoders,
) -> RenderedModes:
    """Modes of the full model, undamped; rotor inertias and springs (P, d) at the joints, design (N,) of each of
    the postures, whose shape is (...)."""
    d = rotor.shape[1]
    N, m = len(design), int(np.isfinite(spring).sum(axis=1).max(initial=0)) + 1
    along = np.broadcast_to(lever_arms(posture, screw(direction)), (*shape, d))
    # own arrays, in the order of rows: kernels are compiled once for these
    h, design = np.array(along.reshape(N, d), order="C"), design.copy()
    mass = np.array(np.broadcast_to(posture.mass_matrix, (*shape, d, d)).reshape(N, d, d), order="C")
    squared, enter, leave, held = (np.empty((N, m)) for _ in range(4))

    def several(first: int, last: int) -> None:
        _full_modes(mass, h, design, rotor, spring, encoders == "motor", squared, enter, leave, held, first, last)

    in_chunks(several, N)
    return RenderedModes(np.zeros((N, m)), squared, enter, leave, held)


@compiled
def _full_modes(
    mass: Floats,
    along: Floats,
    design: Ints,
    rotors: Floats,
    springs: Floats,
    at_motor: bool,
    squared: Floats,
    enter: Floats,
    leave: Floats,
    handle: Floats,
    first: int,
    last: int,
) -> None:
    """Fill squared frequencies and participations of force, reading and handle (N, m) of some postures.

    For postures first to last - 1 these are their flexible modes and, last of each, the free motion; nan as
    `enter` where no number comes out. A design with rigid drives has fewer modes than others: the rest are 0.

    mass (N, d, d), along (N, d)  of the links, lever arms;   rotors, springs (P, d)  at the joints of each design
    at_motor   whether the encoders read the motors;   enter, leave  participations of force and of reading
    """
    d, most = along.shape[1], squared.shape[1] - 1
    M, inverse, h, shape = np.empty((d, d)), np.empty((d, d)), np.empty(d), np.empty(d)
    flexible = np.empty(d, dtype=np.int64)
    f, previous = 0, -1
    S, V = np.empty((f, f)), np.empty((f, f))
    for i in range(first, last):
        rotor, spring = rotors[design[i]], springs[design[i]]
        if design[i] != previous:
            before, f, previous = f, 0, design[i]
            for s in range(d):
                if np.isfinite(spring[s]):
                    flexible[f] = s
                    f += 1
            if f != before:
                S, V = np.empty((f, f)), np.empty((f, f))
        for s in range(d):
            h[s] = along[i, s]
            for t in range(d):
                M[s, t] = mass[i, s, t]
            M[s, s] += rotor[s]
        # all drives rigid: links and rotors together move as one free mass
        free = inverse_form(M, h, d)
        for s in range(d):
            for t in range(d):
                M[s, t] = mass[i, s, t]
            # rotors behind rigid drives move with the links; the others are coordinates of their own
            M[s, s] += 0.0 if np.isfinite(spring[s]) else rotor[s]
        invert(M, inverse)
        for a in range(f):
            p = flexible[a]
            for b in range(f):
                q = flexible[b]
                # the deflections' equation in units that make it symmetric: S = sqrt(K) (M^-1 + rotors^-1) sqrt(K)
                S[a, b] = np.sqrt(spring[p] * spring[q]) * inverse[p, q]
            S[a, a] += spring[p] / rotor[p]
        jacobi(S, V)
        for k in range(f):
            w = np.sqrt(S[k, k])
            moved, read = 0.0, 0.0
            for s in range(d):
                shape[s] = 0.0
                for a in range(f):
                    shape[s] -= inverse[s, flexible[a]] * np.sqrt(spring[flexible[a]]) * V[a, k] / w
            for s in range(d):
                read += along[i, s] * shape[s]
                if not np.isfinite(spring[s]):
                    moved += along[i, s] * shape[s]
            for a in range(f):
                p = flexible[a]
                moved += along[i, p] * np.sqrt(spring[p]) * V[a, k] / (w * rotor[p])
            squared[i, k], enter[i, k], leave[i, k] = S[k, k], moved, moved if at_motor else read
            handle[i, k] = read
        for k in range(f, most):
            squared[i, k], enter[i, k], leave[i, k], handle[i, k] = 0.0, 0.0, 0.0, 0.0
        squared[i, most], handle[i, most] = 0.0, np.sqrt(free)
        enter[i, most], leave[i, most] = np.sqrt(free), np.sqrt(free)
        # a posture with one nan has no modes at all
        known = free > 0.0
        for k in range(most + 1):
            known = known and np.isfinite(squared[i, k] + enter[i, k] + leave[i, k])
        if not known:
            for k in range(most + 1):
                enter[i, k] = np.nan


@compiled_lean
def invert(A: Floats, out: Floats) -> None:
    """The inverse of a symmetric positive definite A (d, d) into out (d, d), by Gauss and Jordan; A is
    overwritten."""
    d = A.shape[0]
    for i in range(d):
        for j in range(d):
            out[i, j] = 1.0 if i == j else 0.0
    for p in range(d):
        # no exchange of rows: the pivots of a positive definite matrix do not vanish
        over = 1.0 / A[p, p]
        for j in range(d):
            A[p, j] *= over
            out[p, j] *= over
        for i in range(d):
            if i != p:
                factor = A[i, p]
                for j in range(d):
                    A[i, j] -= factor * A[p, j]
                    out[i, j] -= factor * out[p, j]


@compiled_lean
def jacobi(A: Floats, V: Floats) -> None:
    """Eigenvalues of a symmetric A (n, n), onto its diagonal, and eigenvectors into the columns of V.

    By Jacobi's rotations, which know small eigenvalues of a positive definite matrix to their own digits
    (Demmel and Veselic 1992).
    """
    n = A.shape[0]
    for i in range(n):
        for j in range(n):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(30):
        turned = False
        for p in range(n - 1):
            for q in range(p + 1, n):
                # small beside its own two diagonal entries, not the largest: that is what keeps small eigenvalues
                if not abs(A[p, q]) > 1e-17 * np.sqrt(abs(A[p, p] * A[q, q])):
                    continue
                turned = True
                slope = (A[q, q] - A[p, p]) / (2.0 * A[p, q])
                # the smaller of both angles that make A[p, q] zero, by its tangent
                t = np.copysign(1.0, slope) / (abs(slope) + np.sqrt(1.0 + slope * slope))
                c = 1.0 / np.sqrt(1.0 + t * t)
                s = t * c
                for k in range(n):
                    A[k, p], A[k, q] = c * A[k, p] - s * A[k, q], s * A[k, p] + c * A[k, q]
                for k in range(n):
                    A[p, k], A[q, k] = c * A[p, k] - s * A[q, k], s * A[p, k] + c * A[q, k]
                for k in range(n):
                    V[k, p], V[k, q] = c * V[k, p] - s * V[k, q], s * V[k, p] + c * V[k, q]
        if not turned:
            break


@dataclass(frozen=True)
class PolePairs:
    """Parts xi'' + 2 a xi' + w^2 xi = f,  y = sum of position xi + velocity xi'; N plants of at most m parts.

    decay              (N, m)  a [1/s]
    frequency_squared  (N, m)  w^2 [1/s²]; 0 for a free motion
    position, velocity (N, m)  share of each part in the reading [1/kg], [s/kg]; velocity 0 for undamped shapes
    reach              (N,)    the reading that all participations together could have [1/kg], by which rounding is
                               told; nan for a plant that has to be computed by itself, in another way
    """

    decay: Floats
    frequency_squared: Floats
    position: Floats
    velocity: Floats
    reach: Floats

    def with_free_motion(self, share: Floats) -> PolePairs:
        """The same plants with one more part each, a free mass with these shares in the reading (N,) [1/kg]."""
        zeros = np.zeros((len(share), 1))
        return PolePairs(
            np.hstack([self.decay, zeros]),
            np.hstack([self.frequency_squared, zeros]),
            np.hstack([self.position, share[:, None]]),
            np.hstack([self.velocity, zeros]),
            self.reach,
        )

    def with_rows(self, rows: Ints, others: PolePairs) -> PolePairs:
        """The same pairs, but plants number rows (k,) taken from those of `others`, of k plants in this order."""
        most = max(self.decay.shape[1], others.decay.shape[1])
        merged = {}
        for name in ("decay", "frequency_squared", "position", "velocity"):
            own, other = getattr(self, name), getattr(others, name)
            whole = np.zeros((len(own), most))
            whole[:, : own.shape[1]] = own
            whole[rows] = 0.0
            whole[rows, : other.shape[1]] = other
            merged[name] = whole
        reach = self.reach.copy()
        reach[rows] = others.reach
        return PolePairs(**merged, reach=reach)
