"""Frames of straight beams in space by finite elements: a judge of mechanisms whose links bend.

Textbook elements of 12 degrees of freedom in global coordinates (Euler and Bernoulli's beam with consistent mass;
Przemieniecki, Theory of Matrix Structural Analysis), joined by eliminating constraints. Nothing is shared with the
package. Small motions about the posture in which the frame is built.

    frame = Frame()
    a, b = frame.point((0.0, 0.0, 0.0)), frame.point((0.3, 0.0, 0.0))
    frame.member(a, b, beam, elements=8)                  returns the points along it, a and b included
    frame.hinge(a, GROUND, axis=(0.0, 0.0, 1.0), stiffness=2.0)
    frame.body(b, mass=0.1)
    natural_frequencies(frame, 5)                         [Hz], a free motion as 0

Members that share a point are welded. To let them turn, give each a point of its own at the same place, and the
two points a joint: `hinge` (about an axis), `ball` (about any), `slider` (along an axis), `weld`, or `rigid` for
points that are apart. A joint to GROUND holds a point; `clamp` is a weld to GROUND.

A beam is anything with the numbers EI_y, EI_z, GJ, EA, mass_per_length and torsional_inertia_per_length; how long
it is, its points say. Its x runs from the first point to the second. Its y is `y_axis`, less what of it is along
x; EI_z bends in the plane of x and y.

Coordinates of a point: displacement (3) and rotation vector (3), in global axes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag, eigh, null_space

GROUND = -1


class Element(NamedTuple):
    """Points at its ends, its beam and its axes: rows x, y, z; which member it is of."""

    start: int
    end: int
    beam: Any
    axes: np.ndarray
    member: int


@dataclass
class Frame:
    """Points, the elements between them, rigid bodies on them, and joints."""

    points: list[np.ndarray] = field(default_factory=list)
    elements: list[Element] = field(default_factory=list)
    members: list[list[int]] = field(default_factory=list)  # points of each, in order
    bodies: list[tuple[int, np.ndarray]] = field(default_factory=list)  # point, mass matrix (6, 6) about it
    # (rows (k, 6) on the first point, rows on the second, its number): A u_i = B u_j
    constraints: list[tuple[int, np.ndarray, int, np.ndarray]] = field(default_factory=list)
    # stiffness, what it stretches by: row (6,) of the first point minus row of the second
    springs: list[tuple[float, int, int, np.ndarray]] = field(default_factory=list)

    def point(self, place) -> int:
        """A new point, and its number."""
        self.points.append(np.array(place, dtype=float))
        return len(self.points) - 1

    def member(self, start: int, end: int, beam, *, y_axis=None, elements: int = 4) -> list[int]:
        """A straight beam of several elements between two points; the points along it, both ends included."""
        a, b = self.points[start], self.points[end]
        x = (b - a) / np.linalg.norm(b - a)
        if y_axis is None:  # whichever global axis is most across
            y_axis = np.eye(3)[np.argmin(np.abs(x))]
        y = np.array(y_axis, dtype=float) - np.dot(y_axis, x) * x
        y /= np.linalg.norm(y)
        axes = np.array([x, y, np.cross(x, y)])
        inner = [self.point(a + (b - a) * i / elements) for i in range(1, elements)]
        along = [start, *inner, end]
        for one, other in pairwise(along):
            self.elements.append(Element(one, other, beam, axes, len(self.members)))
        self.members.append(along)
        return along

    def body(self, at: int, mass: float, inertia=None, offset=(0.0, 0.0, 0.0)) -> None:
        """A rigid body on a point: inertia (3, 3) about its centre of mass, which is `offset` from the point."""
        to_centre = np.block([[np.eye(3), -_cross(offset)], [np.zeros((3, 3)), np.eye(3)]])
        own = block_diag(mass * np.eye(3), np.zeros((3, 3)) if inertia is None else inertia)
        self.bodies.append((at, to_centre.T @ own @ to_centre))

    def rigid(self, one: int, other: int = GROUND) -> None:
        """No motion between two points, which may be apart."""
        apart = np.zeros(3) if other == GROUND else self.points[one] - self.points[other]
        carried = np.block([[np.eye(3), -_cross(apart)], [np.zeros((3, 3)), np.eye(3)]])
        self.constraints.append((one, np.eye(6), other, carried))

    def weld(self, one: int, other: int) -> None:
        """No motion between two points at one place."""
        self._join(one, other, np.eye(6))

    def clamp(self, point: int) -> None:
        """A point that does not move."""
        self._join(point, GROUND, np.eye(6))

    def ball(self, one: int, other: int = GROUND) -> None:
        """The same displacement of two points at one place, each with a rotation of its own."""
        self._join(one, other, np.eye(6)[:3])

    def hinge(self, one: int, other: int, axis, stiffness: float = 0.0) -> None:
        """Rotation about an axis only, between two points at one place, with a spring [N m/rad]."""
        u, across = _unit_and_across(axis)
        self._join(one, other, block_diag(np.eye(3), across))
        self.springs.append((stiffness, one, other, np.concatenate([np.zeros(3), u])))

    def slider(self, one: int, other: int, axis, stiffness: float = 0.0) -> None:
        """Displacement along an axis only, between two points at one place, with a spring [N/m]."""
        u, across = _unit_and_across(axis)
        self._join(one, other, block_diag(across, np.eye(3)))
        self.springs.append((stiffness, one, other, np.concatenate([u, np.zeros(3)])))

    def _join(self, one: int, other: int, rows: np.ndarray) -> None:
        if other != GROUND:
            apart = np.linalg.norm(self.points[one] - self.points[other])
            assert apart < 1e-9, f"a joint is between points at one place, not {apart} m apart"
        self.constraints.append((one, rows, other, rows))

    # --- matrices, of all 6 N coordinates ---------------------------------------------------------------

    def mass(self) -> np.ndarray:
        """M (6 N, 6 N)."""
        M = self._assembled(_mass)
        for point, own in self.bodies:
            M[_six(point), _six(point)] += own
        return M

    def stiffness(self) -> np.ndarray:
        """K (6 N, 6 N) of elements and springs."""
        K = self._assembled(_stiffness)
        for stiffness, one, other, row in self.springs:
            whole = np.zeros(len(K))
            whole[_six(one)] += row
            if other != GROUND:
                whole[_six(other)] -= row
            K += stiffness * np.outer(whole, whole)
        return K

    def geometric_stiffness(self, axial_forces) -> np.ndarray:
        """What an axial force in each member (tension positive) [N] adds to K (6 N, 6 N)."""
        return self._assembled(lambda beam, length, member: axial_forces[member] * _geometric(length))

    def motions(self) -> np.ndarray:
        """Columns: an orthonormal basis of the motions (6 N, n) that all joints allow."""
        size = 6 * len(self.points)
        rows = []
        for one, A, other, B in self.constraints:
            whole = np.zeros((len(A), size))
            whole[:, _six(one)] += A
            if other != GROUND:
                whole[:, _six(other)] -= B
            rows.append(whole)
        return null_space(np.concatenate(rows)) if rows else np.eye(size)

    def _assembled(self, matrix) -> np.ndarray:
        total = np.zeros((6 * len(self.points),) * 2)
        for element in self.elements:
            length = float(np.linalg.norm(self.points[element.end] - self.points[element.start]))
            T = block_diag(*[element.axes] * 4)
            at = np.r_[_six(element.start), _six(element.end)]
            total[np.ix_(at, at)] += T.T @ matrix(element.beam, length, element.member) @ T
        return total


def natural_modes(frame: Frame, axial_forces=None) -> tuple[np.ndarray, np.ndarray]:
    """Squared angular frequencies (n,), ascending [1/s^2], and the modes of all coordinates (6 N, n).

    A motion that has stiffness and no mass has inf; one with neither is refused by the solver.

    axial_forces  of each member, tension positive [N]; None: none
    """
    T = frame.motions()
    K = frame.stiffness() + (0.0 if axial_forces is None else frame.geometric_stiffness(axial_forces))
    squared, shapes = modes_of(T.T @ K @ T, T.T @ frame.mass() @ T)
    return squared, T @ shapes


def modes_of(K: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same of matrices (n, n), with mass-normalised modes (n, n) but for those without mass."""
    rough, _ = _modes(M, K, np.trace(K) / np.trace(M))
    highest = rough[np.isfinite(rough)][-1]
    # Low frequencies are many powers of ten below the highest, and lost in its rounding. In 1/(w^2 + shift) they
    # are the largest; the shift is as large as the first elastic ones, and takes what is negative above 0.
    shift = rough[rough > 1e-12 * highest][0] + max(0.0, -2.0 * rough[0])
    squared, shapes = _modes(M, K, shift)
    rounding = max(1e-9 * shift, 1e-13 * highest)  # of a free motion's zero
    massive = np.isfinite(squared)
    shapes[:, massive] /= np.sqrt(np.einsum("ik,ij,jk->k", shapes[:, massive], M, shapes[:, massive]))
    return np.where(np.abs(squared) < rounding, 0.0, squared), shapes


def _modes(M, K, shift) -> tuple[np.ndarray, np.ndarray]:
    """Squared frequencies, ascending, inf for a motion without mass, and modes, by 1/(w^2 + shift)."""
    inverse, shapes = eigh(M, K + shift * M)
    inverse, shapes = inverse[::-1], shapes[:, ::-1]
    massless = inverse < 1e-14 * inverse[0]
    return np.where(massless, np.inf, 1.0 / np.where(massless, 1.0, inverse) - shift), shapes


def natural_frequencies(frame: Frame, count: int, axial_forces=None) -> np.ndarray:
    """The lowest frequencies (count,), ascending [Hz]; free motions exactly 0, nan for one that has buckled."""
    squared = natural_modes(frame, axial_forces)[0][:count]
    return np.sqrt(np.where(squared < 0.0, np.nan, squared)) / (2.0 * np.pi)


def static_response(frame: Frame, loads: dict) -> np.ndarray:
    """Displacement and rotation of each point (N, 6) under loads {point: (force (3), torque (3))}."""
    T, f = frame.motions(), np.zeros(6 * len(frame.points))
    for point, load in loads.items():
        f[_six(point)] += load
    moved = T @ np.linalg.solve(T.T @ frame.stiffness() @ T, T.T @ f)
    return moved.reshape(-1, 6)


def axial_forces(frame: Frame, moved: np.ndarray) -> np.ndarray:
    """Mean axial force in each member, tension positive [N], of a static response (N, 6)."""
    forces = [[] for _ in frame.members]
    for element in frame.elements:
        length = np.linalg.norm(frame.points[element.end] - frame.points[element.start])
        longer = (moved[element.end, :3] - moved[element.start, :3]) @ element.axes[0]
        forces[element.member].append(element.beam.EA * longer / length)
    return np.array([np.mean(each) for each in forces])


def buckling_factor(frame: Frame, loads: dict) -> float:
    """The factor on the loads under which the frame buckles, by the axial forces in its members."""
    T = frame.motions()
    pressed = -frame.geometric_stiffness(axial_forces(frame, static_response(frame, loads)))
    # of pressed x = 1/factor K x the largest is wanted: K is the one that is positive definite
    return 1.0 / eigh(T.T @ pressed @ T, T.T @ frame.stiffness() @ T, eigvals_only=True)[-1]


# --- one element: (u, v, w, turns about x, y, z) at its start, then at its end, in its own axes ---------

# Bending of an element of length 1, of (v, turn about z) at both ends; of two more coordinates stretch and twist
BENDING = np.array(
    [[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0], [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]]
)
BENDING_MASS = (
    np.array(
        [
            [156.0, 22.0, 54.0, -13.0],
            [22.0, 4.0, 13.0, -3.0],
            [54.0, 13.0, 156.0, -22.0],
            [-13.0, -3.0, -22.0, 4.0],
        ]
    )
    / 420.0
)
TENSION = (
    np.array([[36.0, 3.0, -36.0, 3.0], [3.0, 4.0, -3.0, -1.0], [-36.0, -3.0, 36.0, -3.0], [3.0, -1.0, -3.0, 4.0]])
    / 30.0
)
BAR, BAR_MASS = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0


def _stiffness(beam, L, member) -> np.ndarray:
    return _placed(L, beam.EI_z / L**3 * BENDING, beam.EI_y / L**3 * BENDING, beam.EA / L * BAR, beam.GJ / L * BAR)


def _mass(beam, L, member) -> np.ndarray:
    m, I = beam.mass_per_length * L, beam.torsional_inertia_per_length * L
    return _placed(L, m * BENDING_MASS, m * BENDING_MASS, m * BAR_MASS, I * BAR_MASS)


def _geometric(L) -> np.ndarray:
    """Of a tension of 1 N."""
    return _placed(L, TENSION / L, TENSION / L, 0.0 * BAR, 0.0 * BAR)


def _placed(L, in_y, in_z, along, twist) -> np.ndarray:
    """The element's matrix (12, 12); the turn about y is minus the slope of w."""
    y, z = np.array([1.0, L, 1.0, L]), np.array([1.0, -L, 1.0, -L])
    whole = np.zeros((12, 12))
    whole[np.ix_([1, 5, 7, 11], [1, 5, 7, 11])] = y[:, None] * in_y * y
    whole[np.ix_([2, 4, 8, 10], [2, 4, 8, 10])] = z[:, None] * in_z * z
    whole[np.ix_([0, 6], [0, 6])], whole[np.ix_([3, 9], [3, 9])] = along, twist
    return whole


def _six(point: int) -> slice:
    return slice(6 * point, 6 * point + 6)


def _cross(v) -> np.ndarray:
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _unit_and_across(axis) -> tuple[np.ndarray, np.ndarray]:
    """The unit vector (3,), and two rows across it (2, 3)."""
    u = np.array(axis, dtype=float) / np.linalg.norm(axis)
    return u, null_space(u[None]).T
