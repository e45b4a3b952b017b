"""An independent judge of the five-bar: its two arms written out by hand, for any lengths and base distance.

Nothing here comes from zwidth but the numbers of the bundled file. Each arm's elbow follows from the cosine law;
with e the unit vector along a distal link, pointing from elbow to handle, and n what the elbow moves per angle of
its driven arm, neither link stretches:

    e_i . p' = (e_i . n_i) q_i'      i = right, left        so      A p' = diag(b) q',  J = A^-1 diag(b)

A distal link turns at psi' = (p' - n q') . (e turned by 90 degrees)/length, which gives its kinetic energy and so
the mass matrix. The masses and stiffness along u follow from h = J^T u as in (2.28) and (2.34).

Singular is an arm that is stretched or folded (b = 0: the handle cannot follow), and handle between two distal
links in one line (det A = 0: the drives do not hold it).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import eigh

from gallery.brute_force import BruteForceLoop
from zwidth.device.load import load

# On which side of the line from its base to the handle each arm's elbow is, +1 to the right: right arm, left arm.
SIDES = {
    "elbows-out": (1, -1),
    "elbows-in": (-1, 1),
    "elbows-right": (1, 1),
    "elbows-left": (-1, -1),
}


@dataclass(frozen=True)
class HandleProperties:
    """What is felt along y, and how the handle is driven; nan out of reach.

    jacobian, mass_matrix  (..., 2, 2)  J [m/rad] and M of the links [kg m^2], in the driven angles
    link_side_mass, motor_side_mass, rigid_mass  (...)  [kg];   stiffness  (...) [N/m]
    distal_angle_sine  (...)  sine of the angle between the distal links: 0 where the drives do not hold the handle
    driven_angles      (..., 2)  angles of the driven arms [rad];  elbow  (..., 2) of the distal against the driven
                       ones
    """

    jacobian: np.ndarray
    mass_matrix: np.ndarray
    link_side_mass: np.ndarray
    motor_side_mass: np.ndarray
    rigid_mass: np.ndarray
    stiffness: np.ndarray
    distal_angle_sine: np.ndarray
    driven_angles: np.ndarray
    elbow: np.ndarray

    @property
    def singular_values(self) -> np.ndarray:
        """Of J (..., 2), the larger first: of a 2 x 2 matrix they follow from its norm and determinant."""
        square = (self.jacobian**2).sum(axis=(-2, -1))
        volume = np.abs(_determinant(self.jacobian))
        plus, minus = np.sqrt(square + 2.0 * volume), np.sqrt(np.maximum(square - 2.0 * volume, 0.0))
        return np.stack([plus + minus, plus - minus], axis=-1) / 2.0

    @property
    def manipulability(self) -> np.ndarray:
        """(5.1) [m^2]."""
        return np.abs(_determinant(self.jacobian))

    @property
    def condition_number(self) -> np.ndarray:
        """(5.2)."""
        values = self.singular_values
        with np.errstate(divide="ignore"):
            return values[..., 0] / values[..., 1]


@dataclass(frozen=True)
class FiveBar:
    """The device; each field for the right and the left arm, numbers or arrays that broadcast.

    base            x of the base joints, y is 0 [m]
    driven_length, distal_length  [m]
    driven_inertia  moment of inertia of the driven arm about its base joint [kg m^2]
    mass, center, inertia  of the distal link: [kg], (along, across) [m], about its centre of mass [kg m^2]
    rotor, spring   of the drive, at the joint [kg m^2], [N m/rad]
    """

    base: tuple
    driven_length: tuple
    distal_length: tuple
    driven_inertia: tuple
    mass: tuple
    center: tuple
    inertia: tuple
    rotor: tuple
    spring: tuple

    def at(self, position, assembly: str) -> HandleProperties:
        """Everything at handle positions (..., 2) [m]."""
        p = np.asarray(position, float)[..., :2]
        shape = np.broadcast_shapes(
            p.shape[:-1], *(np.shape(v) for v in (*self.base, *self.driven_length, *self.distal_length))
        )
        p = np.broadcast_to(p, (*shape, 2))
        arms = [self._arm(p, i, SIDES[assembly][i]) for i in range(2)]
        A = np.stack([arm["along"] for arm in arms], axis=-2)
        b = np.zeros((*shape, 2, 2))
        for i, arm in enumerate(arms):
            b[..., i, i] = (arm["along"] * arm["elbow moves"]).sum(axis=-1)
        between = _determinant(A)
        J = _solve(A, b)
        M = self._mass_matrix(arms, J)
        rotor, spring = (self._diagonal(values, shape) for values in (self.rotor, self.spring))
        h = J[..., 1, :]
        return HandleProperties(
            J,
            M,
            *(_effective_value(S, h) for S in (M, rotor, M + rotor, spring)),
            between,
            np.stack([arm["angle"] for arm in arms], axis=-1),
            np.stack([arm["bend"] for arm in arms], axis=-1),
        )

    def _arm(self, p, i, side):
        L, l = np.asarray(self.driven_length[i], float), np.asarray(self.distal_length[i], float)
        x, y = p[..., 0] - self.base[i], p[..., 1]
        D = np.hypot(x, y)
        with np.errstate(invalid="ignore"):
            angle = np.arctan2(y, x) - side * np.arccos((L**2 + D**2 - l**2) / (2.0 * L * D))
        psi = np.arctan2(y - L * np.sin(angle), x - L * np.cos(angle))
        moves = np.stack(np.broadcast_arrays(-L * np.sin(angle), L * np.cos(angle)), axis=-1)
        along = np.stack([np.cos(psi), np.sin(psi)], axis=-1)
        across = np.stack([-np.sin(psi), np.cos(psi)], axis=-1)
        bend = np.angle(np.exp(1j * (psi - angle)))
        return {"angle": angle, "bend": bend, "elbow moves": moves, "along": along, "across": across}

    @np.errstate(invalid="ignore", over="ignore")
    def _mass_matrix(self, arms, J):
        M = self._diagonal(self.driven_inertia, J.shape[:-2])
        for i, arm in enumerate(arms):
            elbow = arm["elbow moves"][..., :, None] * np.eye(2)[i]
            turning = np.einsum("...k,...kj->...j", arm["across"], J - elbow)
            turning = turning / np.asarray(self.distal_length[i], float)[..., None]
            x, y = self.center[i]
            lever = x * arm["across"] - y * arm["along"]
            center = elbow + lever[..., :, None] * turning[..., None, :]
            M = M + np.asarray(self.mass[i], float)[..., None, None] * np.einsum(
                "...ki,...kj->...ij", center, center
            )
            M = (
                M
                + np.asarray(self.inertia[i], float)[..., None, None]
                * turning[..., :, None]
                * turning[..., None, :]
            )
        return M

    def _diagonal(self, values, shape):
        D = np.zeros((*shape, 2, 2))
        for i in range(2):
            D[..., i, i] = values[i]
        return D


@cache
def bundled() -> FiveBar:
    """The numbers of the bundled file, base joints in one place."""
    mechanism = load("five-bar").document["mechanism"]
    links = {link["name"]: link for link in mechanism["links"]}
    upper = [links["upper-right"], links["upper-left"]]
    distal = [links["distal-right"], links["distal-left"]]
    drives = mechanism["drives"]
    return FiveBar(
        base=(0.0, 0.0),
        driven_length=tuple(link["length_m"] for link in upper),
        distal_length=tuple(link["length_m"] for link in distal),
        driven_inertia=tuple(
            link["inertia_kg_m2"] + link["mass_kg"] * float(np.sum(np.square(link["center_of_mass_m"])))
            for link in upper
        ),
        mass=tuple(link["mass_kg"] for link in distal),
        center=tuple(tuple(link["center_of_mass_m"]) for link in distal),
        inertia=tuple(link["inertia_kg_m2"] for link in distal),
        rotor=tuple(drive["transmission_ratio"] ** 2 * drive["motor_inertia_kg_m2"] for drive in drives),
        spring=tuple(drive["transmission_ratio"] ** 2 * drive["stiffness_Nm_per_rad"] for drive in drives),
    )


def brute_force_loop(felt: HandleProperties, model: str, damping_ratio: float, period: float) -> BruteForceLoop:
    """The loop of one posture with a wall along y, for brute force's eigenvalues.

    model  "rigid": links and rotors as one mass; "links": those alone; "motor-mass": the rotors on their spring,
           undamped; "full": links and rotors as they are, with this ratio of damping on both flexible modes
    """
    if model in ("rigid", "links"):
        mass = felt.rigid_mass if model == "rigid" else felt.link_side_mass
        return BruteForceLoop([[mass]], [[0.0]], [[0.0]], [1.0], period)
    if model == "motor-mass":
        return BruteForceLoop([[felt.motor_side_mass]], [[0.0]], [[felt.stiffness]], [1.0], period)
    rotor, spring = (np.diag(values) for values in (bundled().rotor, bundled().spring))
    none = np.zeros((2, 2))
    M = np.block([[felt.mass_matrix, none], [none, rotor]])
    squared, shapes = eigh(np.block([[spring, -spring], [-spring, spring]]), M)
    # of the two free motions the wall moves one, with the mass of links and rotors
    squared, side = squared[2:], np.concatenate([np.zeros(2), felt.jacobian[1]]) @ shapes[:, 2:]
    modes = np.concatenate([[0.0], squared])
    side = np.concatenate([[1.0 / np.sqrt(felt.rigid_mass)], side])
    return BruteForceLoop(np.eye(3), np.diag(2.0 * damping_ratio * np.sqrt(modes)), np.diag(modes), side, period)


def closed_form(mass, stiffness, period):
    """(5.7): largest stiffness of the motor's mass on its spring, 0 where cos W is negative."""
    c = np.cos(np.sqrt(stiffness / mass) * period)
    with np.errstate(invalid="ignore"):
        return np.where(c > 0.0, 2.0 * stiffness * (np.sqrt(1.0 + c) - 1.0) ** 2 / (1.0 - c), 0.0)


def _effective_value(S, h):
    """1/(h^T S^-1 h)."""
    with np.errstate(invalid="ignore", over="ignore"):
        return 1.0 / (h * _solve(S, h[..., None])[..., 0]).sum(axis=-1)


def _solve(A, B):
    """A^-1 B by Cramer's rule: infinite where singular instead of raising."""
    turned = np.stack(
        [np.stack([A[..., 1, 1], -A[..., 0, 1]], axis=-1), np.stack([-A[..., 1, 0], A[..., 0, 0]], axis=-1)],
        axis=-2,
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        return turned @ B / _determinant(A)[..., None, None]


def _determinant(A):
    """Of 2 x 2 matrices; NaN where one holds inf or NaN, without a warning."""
    with np.errstate(invalid="ignore"):
        return A[..., 0, 0] * A[..., 1, 1] - A[..., 0, 1] * A[..., 1, 0]
