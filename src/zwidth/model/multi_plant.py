"""Several rendered directions at once: what the thesis writes for any number m of them (2.3-2.17, 2.28-2.35).

Coordinates and signs are those of `reduction`: with H = U J (m, d), U the directions, the handle moves by H phi
along them, and forces f along them are the joint torques H^T f. The wall acts on and reads the motors,
actuators = sensors = [0, H], and the operator holds the links, handles = [H, 0], on [phi; theta].
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.errors import DirectionError, ModelError
from zwidth.model.effective_mass import is_plain, screw
from zwidth.model.mechanism import Damping, Mechanism, ModalDamping, ProportionalDamping, at_postures
from zwidth.model.modes import modal_matrix
from zwidth.model.plant import Plant
from zwidth.model.posture import Posture
from zwidth.model.reduction import MODELS, Model, full_matrices, links_and_drives, reduce_mechanism

# Directions whose least independent combination is below this share of the largest are dependent.
DEPENDENT = 1e-9


@dataclass(frozen=True)
class MultiPlant:
    """Linear dynamics about the haptic equilibrium with m rendered directions (thesis eq. 2.5, 2.12).

        M x'' + B x' + K x = actuators^T f,     y = sensors x

    mass, damping, stiffness  (n, n)  symmetric, mass positive definite [kg], [N s/m], [N/m]
    actuators  (m, n)  row i: where the wall force f_i acts
    sensors    (m, n)  row i: what is read along direction i
    handles    (m, n)  where the operator holds it; None: not known
    names      (n,)    coordinates, for people
    """

    mass: Floats
    damping: Floats
    stiffness: Floats
    actuators: Floats
    sensors: Floats
    handles: Floats | None = None
    names: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return int(self.mass.shape[-1])

    @property
    def count(self) -> int:
        """Number of rendered directions m."""
        return int(self.actuators.shape[0])

    def along(self, combination: ArrayLike) -> Plant:
        """The plant of one direction, a combination (m,) of the rendered ones.

        >>> free = MultiPlant(np.diag([1.0, 2.0]), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))
        >>> free.along([0.6, 0.8]).actuator
        array([0.6, 0.8])
        """
        weights = np.asarray(combination, dtype=float)
        handle = None if self.handles is None else weights @ self.handles
        actuator, sensor = weights @ self.actuators, weights @ self.sensors
        return Plant(self.mass, self.damping, self.stiffness, actuator, sensor, handle, self.names)


class Decomposition(NamedTuple):
    """Rendered and admissible motion, u_r = A q' and u_a = B q' (thesis eq. 2.3, 2.6).

    complement       (n - m, n)      B with A M^-1 B^T = 0                      (thesis eq. 2.15)
    rendered_mass    (m, m)          W_rr = (A M^-1 A^T)^-1                     (thesis eq. 2.16)
    admissible_mass  (n - m, n - m)  W_aa = (B M^-1 B^T)^-1                     (thesis eq. 2.17)
    """

    complement: Floats
    rendered_mass: Floats
    admissible_mass: Floats


def decompose(mass: ArrayLike, rendered: ArrayLike) -> Decomposition:
    """Split the motions of a mass matrix M so that no inertia couples the rendered with the admissible ones.

    With M = L L^T the rows of B are V L^T, V an orthonormal basis of what is orthogonal to A L^-T. So of the
    freedom that (2.15) leaves, the B with W_aa = 1 is taken; in u = [A; B] q' the mass matrix is
    R^-T M R^-1 = diag(W_rr, W_aa), R = [A; B]                                    (thesis eq. 2.10, 2.14).

    mass      (n, n)  symmetric positive definite
    rendered  (m, n)  A, of full row rank, m <= n
    Raises    DirectionError  where the rows of A are not independent

    >>> found = decompose([[2.0, 1.0], [1.0, 2.0]], [[1.0, 0.0]])
    >>> np.round(found.rendered_mass, 12)                                # 2 - 1 * 1 / 2
    array([[1.5]])
    """
    A, root = np.asarray(rendered, dtype=float), np.linalg.cholesky(np.asarray(mass, dtype=float))
    from scipy.linalg import solve_triangular

    weighted = solve_triangular(root, A.T, lower=True).T
    _check_independent(weighted)
    left, singular, basis = np.linalg.svd(weighted)
    complement = basis[len(A) :] @ root.T
    rendered_mass = (left / singular**2) @ left.T
    return Decomposition(complement, rendered_mass, np.eye(len(complement)))


def reduce_directions(
    mechanism: Mechanism, posture: Posture, directions: ArrayLike, model: Model, damping: Damping
) -> MultiPlant:
    """The plant that m directions render in one posture; for m = 1 that of `reduce_mechanism`.

    full        [phi; theta], the joint torques through n^2 k between them          (thesis eq. 2.21)
    two-mass    [x1; x2], 2m coordinates: W_r1 and W_r2 with K_e between them       (thesis eq. 2.28, 2.34, 2.35)
    motor-mass  W_r2 on K_e, the link side held fixed
    rigid       links and rotors as one mass matrix W_r                             (thesis eq. 2.16, 2.18)

    Modal damping puts its ratio on each flexible mode of the 2m coordinates; motor-mass keeps the motor side's
    block of that matrix. Dampers given beside the drives are moved as the drives deflect: C_e = X^T C X, with
    X = K^-1 J^T K_e. What is not linear, dry friction and encoder steps among it, is left out: several directions
    are charted only.

    posture     a single one, OK
    directions  (m, 3)  unit vectors in the base frame, independent of each other; not necessarily orthogonal
    Returns     MultiPlant; names carry the direction's number where a model has a coordinate for each
    Raises      ModelError      where the model does not apply: no flexible drive in one of the directions
                DirectionError  (a ModelError) where the handle cannot move along the directions independently
                ValueError      for a batch of postures, a posture that is not OK, a direction not of unit length
    """
    U = screw(np.atleast_2d(np.asarray(directions, dtype=float)))
    if model == "rigid" and mechanism.flexible:
        mechanism = replace(mechanism, flexible=())
    # checks the posture and the model, and holds what does not depend on the direction
    first = reduce_mechanism(mechanism, posture, U[0], "full", damping)
    if model not in MODELS:
        raise ValueError(f"there is no model {model!r}; choose one of {', '.join(MODELS)}")
    posed = at_postures(mechanism, posture)
    mass, H, side = links_and_drives(posed, posture, U)
    _check_independent(H[:, : side.driven])
    drives = posed.drives
    n2 = drives.transmission**2
    rotor, spring, damper = n2 * drives.motor_inertia, n2 * drives.stiffness, n2 * drives.damping
    if model == "full":
        _, _, _, flexible = full_matrices(drives, side, mass)
        c, f, shares = H.shape[1], len(flexible), np.stack([side.shares(h) for h in H])
        motors = np.concatenate([side.motion, np.zeros((len(drives.names), f))], axis=1)
        motors[flexible] = np.eye(c + f)[c:]
        actuators = shares @ motors
        handles = np.concatenate([H, np.zeros((len(H), f))], axis=1)
        return MultiPlant(
            first.mass, first.damping, first.stiffness, actuators, actuators.copy(), handles, first.names
        )
    if not is_plain(mechanism):
        raise ModelError(
            f"model {model!r} of several directions needs as many drives as degrees of freedom, without springs, "
            "dampers or friction of joints, free joints, flexible links or rotors that turn with their links; use "
            "'full'"
        )
    if model == "rigid":
        mass_damping = damping.mass_coefficient_1_per_s if isinstance(damping, ProportionalDamping) else 0.0
        W = decompose(posture.mass_matrix + np.diag(rotor), H).rendered_mass
        I = np.eye(len(H))
        return MultiPlant(W, mass_damping * W, np.zeros_like(W), I, I.copy(), I.copy(), _names("device", len(H)))
    two_sides = _two_sides(posture.mass_matrix, rotor, spring, damper, H, damping)
    return _motor_side(two_sides) if model == "motor-mass" else two_sides


def _two_sides(
    link_mass: Floats, rotor: Floats, spring: Floats, damper: Floats, H: Floats, damping: Damping
) -> MultiPlant:
    """The two-mass plant of m directions, link sides x1 and then motor sides x2:

        W_r1 x1'' + K_e (x1 - x2) = s_h,  W_r2 x2'' + K_e (x2 - x1) = lambda              (thesis eq. 2.35)

    link_mass              (d, d)  mass matrix of the links
    rotor, spring, damper  (d,)    of the drives, at the joints;   H (m, d)  lever arms
    Raises  ModelError  where rigid drives alone move one of the directions
    """
    m = len(H)
    compliance = (H / spring) @ H.T
    if not np.linalg.matrix_rank(compliance, hermitian=True) == m:
        raise ModelError(
            "the two masses need a flexible drive in each of the directions, and some move by rigid drives alone; "
            "use 'full' or 'rigid'"
        )
    K_e = np.linalg.inv(compliance)
    K_e = (K_e + K_e.T) / 2.0
    from scipy.linalg import block_diag

    M = block_diag(decompose(link_mass, H).rendered_mass, decompose(np.diag(rotor), H).rendered_mass)
    between = np.array([[1.0, -1.0], [-1.0, 1.0]])
    K = np.kron(between, K_e)
    if isinstance(damping, ModalDamping):
        B = modal_matrix(M, K, damping.ratio)
    elif isinstance(damping, ProportionalDamping):
        B = damping.mass_coefficient_1_per_s * M + damping.stiffness_coefficient_s * K
    else:
        X = (H / spring).T @ K_e
        B = np.kron(between, X.T @ (damper[:, None] * X))
    I, zeros = np.eye(m), np.zeros((m, m))
    at_motor, at_link = np.hstack([zeros, I]), np.hstack([I, zeros])
    names = _names("link side", m) + _names("motor side", m)
    return MultiPlant(M, B, K, at_motor, at_motor.copy(), at_link, names)


def _motor_side(two_sides: MultiPlant) -> MultiPlant:
    """The motor side's half of a plant of `_two_sides`, the link side held fixed."""
    m = two_sides.count
    M, B, K = (matrix[m:, m:] for matrix in (two_sides.mass, two_sides.damping, two_sides.stiffness))
    return MultiPlant(M, B, K, np.eye(m), np.eye(m), None, two_sides.names[m:])


def _names(what: str, count: int) -> tuple[str, ...]:
    """`what` as the name of each of `count` directions, numbered from 1 where there are several."""
    return (what,) if count == 1 else tuple(f"{what} {i}" for i in range(1, count + 1))


def _check_independent(rows: Floats) -> None:
    """Raise DirectionError unless the rows (m, n), the handle's motion along each direction, are independent."""
    m, n = rows.shape
    singular = np.linalg.svd(rows, compute_uv=False)
    if m > n or not singular[-1] > DEPENDENT * singular[0]:
        raise DirectionError(
            f"the {m} directions are not independent of each other for this mechanism, which moves its handle in "
            f"at most {int(np.sum(singular > DEPENDENT * singular[0]))} of them at once; leave some out"
        )
