"""A loop on one circle |z| = rho: its curve of walls and the two straight lines of real roots."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.angle_sampling import LONGEST_STEP, sample_angles, singular_points
from zwidth.chart.arc_kernels import CHORD, MOST_POINTS, quadrant_integral, refined_angles, sign_changes
from zwidth.chart.arcs import Arc, Wall
from zwidth.chart.curve import trace, wall_at, walls
from zwidth.chart.hurwitz import edges_on_line, is_stable, work_array
from zwidth.chart.nyquist import phase_flags, terms_along
from zwidth.loop.factor_kernels import Factors, characteristic, factor_arrays, velocity_response
from zwidth.loop.loop import Loop

Floats = NDArray[np.float64]
# A root this near the circle is on neither side of it.
CIRCLE_TOLERANCE = 1e-9
# Degree from which coefficients have too few digits left, and the phase along the circle is followed instead.
HIGH_DEGREE = 24
RealRoot = Literal["plus", "minus"]
ROOTS: tuple[RealRoot, RealRoot] = ("plus", "minus")


@dataclass(frozen=True)
class Tracer:
    """A loop in the arrays that the kernels take, with the functions that evaluate them.

    loop         the loop
    factors      `factor_arrays(loop)`
    polynomials  (5, N + 1) A, S, V in the bilinear variable of the circle, and what cancelled in S and V
    radius       rho
    """

    loop: Loop
    factors: Factors
    polynomials: Floats
    radius: float

    @classmethod
    def of(cls, loop: Loop, radius: float = 1.0) -> Tracer:
        """The loop's factors, and its polynomials for the circle."""
        factors = factor_arrays(loop)
        return cls(loop, factors, characteristic(factors, radius), radius)

    @property
    def period(self) -> float:
        """Sampling period T [s]; K T and B have the same unit, in which distances between walls are taken."""
        return self.loop.period

    @property
    def degree(self) -> int:
        """Number N of roots."""
        return int(self.polynomials.shape[1]) - 1

    def features(self) -> NDArray[np.complex128]:
        """Singular points of the curve in the z plane, see `angle_sampling.singular_points`."""
        return singular_points(self.factors, self.radius)

    def wall(self, theta: float) -> tuple[float, float, float, float]:
        """K, B, dK/dtheta, dB/dtheta at one angle in (0, pi)."""
        return wall_at(self.factors, self.radius, theta)

    def walls(self, thetas: Floats) -> tuple[Floats, Floats]:
        """K and B (k,) at angles (k,) in (0, pi)."""
        return walls(self.factors, self.radius, thetas)

    def zeros(self, arc: Arc, component: int) -> Floats:
        """Ascending angles on an arc at which K, B or dK/dtheta changes sign, to rounding."""
        return sign_changes(self.factors, self.radius, np.sort(arc.angles), component)

    def dense_angles(self, arc: Arc) -> Floats:
        """Angles strictly between an arc's ends, from first to last, with chords within CHORD of the arc."""
        thetas = refined_angles(self.factors, self.radius, np.sort(arc.angles), CHORD, MOST_POINTS)
        return thetas if arc.start < arc.end else thetas[::-1].copy()

    def integral(self, arc: Arc) -> float:
        """Integral of K dB over the part of an arc with K > 0 and B > 0 [N^2 s/m^2]."""
        return quadrant_integral(self.factors, self.radius, arc.angles)

    def trace(self, thetas: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """K, B and stable-edge flag at ascending angles in (0, pi).

        Where rounding leaves a flag of the polynomials open, eigenvalues decide. Where they, or in a long loop the
        phase along the circle, leave it open, too (several roots on the circle within rounding), it is that of the
        nearest decided sample before, or after if there is none.
        """
        K, B, flags = self._walls_and_flags(thetas)
        unsure = np.flatnonzero(flags == 0)
        if len(unsure):
            if not self.is_high_degree:
                flags[unsure] = self._edge_by_eigenvalues(thetas[unsure], K[unsure], B[unsure])
            sure = np.flatnonzero(flags)
            if len(sure):
                flags = flags[sure[np.maximum(np.searchsorted(sure, np.arange(len(flags)), "right") - 1, 0)]]
        return K, B, flags > 0

    def _walls_and_flags(self, thetas: Floats) -> tuple[Floats, Floats, NDArray[np.int64]]:
        """K, B and flag 1, -1, or 0 where eigenvalues must decide."""
        if not self.is_high_degree:
            return trace(self.factors, self.polynomials, self.radius, thetas)
        K, B = walls(self.factors, self.radius, thetas)
        return K, B, self._flags_by_phase(np.column_stack([K, B]), thetas, 0)

    @property
    def is_high_degree(self) -> bool:
        """Whether the loop's degree is too high for polynomials."""
        return self.degree > HIGH_DEGREE

    @cached_property
    def _circle(self) -> tuple[Floats, NDArray[np.complex128]]:
        """Samples of the circle, and the loop's terms along them."""
        thetas = sample_angles(self.features(), self.radius, 0.2, self.longest_step)
        # soft walls have roots as near to z = 1 as one likes
        closer = np.logspace(-8.0, -1.0, 8)
        thetas = np.concatenate([closer * thetas[0], thetas, np.pi - closer[::-1] * (np.pi - thetas[-1])])
        return thetas, terms_along(self.factors, self.radius, thetas)

    def _flags_by_phase(self, points: Floats, pairs: Floats, real: int) -> NDArray[np.int64]:
        """Flags of walls (n, 2) by the phase along the circle, see `nyquist.phase_flags`."""
        return phase_flags(self.factors, self.radius, *self._circle, self.degree, points, pairs, real)

    @property
    def longest_step(self) -> float:
        """Largest step of theta between samples of the circle: a delay of n samples turns n times as fast as z."""
        late = self.factors.whole_delay + len(self.factors.window)
        return min(LONGEST_STEP, 0.5 / late)

    def polynomials_decide(self, theta: float) -> bool:
        """Whether polynomials alone can tell if the wall at one angle edges the stable set."""
        return not self.is_high_degree and bool(self._walls_and_flags(np.array([theta]))[2][0])

    def edge_flag(self, theta: float) -> int:
        """Whether the wall at one angle edges the stable set: 1, -1, or 0 where nothing can tell."""
        one = np.array([theta])
        K, B, flags = self._walls_and_flags(one)
        return int(flags[0] or self._edge_by_eigenvalues(one, K, B)[0])

    def _edge_by_eigenvalues(self, thetas: Floats, K: Floats, B: Floats) -> NDArray[np.int64]:
        """The flag from all eigenvalues but the pair at each angle."""
        z = np.abs(self.roots_without_pair(thetas, K, B)).max(axis=-1) - self.radius
        return np.where(z < -CIRCLE_TOLERANCE, 1, np.where(z > CIRCLE_TOLERANCE, -1, 0))

    def roots_without_pair(self, thetas: Floats, K: Floats, B: Floats) -> NDArray[np.complex128]:
        """Eigenvalues (..., N - 2) of walls on the curve, without the pair at rho exp(+-i theta)."""
        z = np.linalg.eigvals(self.loop.transition_matrix(K, B))
        for point in (self.radius * np.exp(1j * thetas), self.radius * np.exp(-1j * thetas)):
            nearest = np.argmin(np.abs(z - point[..., None]), axis=-1)
            keep = np.arange(z.shape[-1]) != nearest[..., None]
            z = z[keep].reshape(*z.shape[:-1], z.shape[-1] - 1)
        return np.asarray(z, dtype=complex)

    def stable(self, K: float, B: float) -> bool:
        """Whether all roots of a wall lie inside the circle; False too where rounding hides it."""
        if self.is_high_degree:
            flag = int(self._flags_by_phase(np.array([[K, B]]), np.zeros(1), 0)[0])
        else:
            flag = is_stable(self.polynomials, K, B, work_array(self.degree))
        if flag == 0:
            return bool(np.abs(np.linalg.eigvals(self.loop.transition_matrix(K, B))).max() < self.radius)
        return bool(flag > 0)

    def stable_on_left(self, theta: float) -> bool:
        """Whether the stable side is on the left for growing theta: Im w > 0.

        Moving a root by dz = -(S dK + V dB)/p'(z) along the left normal changes |z| by an amount of the sign of
        -Im(V conj S) = -|S|^2 Im w (Neimark's rule).
        """
        z = complex(self.radius * np.exp(1j * theta))
        return velocity_response(self.factors, z, z - 1.0)[0].imag > 0.0

    def line(self, root: RealRoot) -> Floats:
        """Coefficients a, s, v of  a + s K + v B = 0, the walls with a root at +rho or -rho; stable side > 0.

        These are the lowest and the highest coefficient of p, which a Hurwitz polynomial has positive.
        """
        return self.polynomials[:3, 0 if root == "plus" else -1].copy()

    def edge_on_line(self, root: RealRoot, K: float, B: float) -> bool:
        """Whether a wall on that line has all its other roots inside."""
        if self.is_high_degree:
            flag = int(self._flags_by_phase(np.array([[K, B]]), np.zeros(1), 1)[0])
        else:
            flag = edges_on_line(self.polynomials, int(root == "plus"), K, B, work_array(self.degree))
        if flag == 0:
            z = np.linalg.eigvals(self.loop.transition_matrix(K, B))
            own = np.argmin(np.abs(z - (self.radius if root == "plus" else -self.radius)))
            return bool(np.abs(np.delete(z, own)).max() < self.radius - CIRCLE_TOLERANCE)
        return bool(flag > 0)

    def curve_end(self, root: RealRoot) -> Wall | None:
        """The wall with a double root at +rho (theta = 0) or -rho (theta = pi); None if it is at infinity.

        There the two outermost coefficients of p vanish together: two linear equations.
        """
        A, S, V = self.polynomials[:3]
        i, j = (0, 1) if root == "plus" else (self.degree, self.degree - 1)
        det = S[i] * V[j] - S[j] * V[i]
        if abs(det) <= 1e-13 * (abs(S[i] * V[j]) + abs(S[j] * V[i])) or det == 0.0:
            return None
        return float((A[j] * V[i] - A[i] * V[j]) / det), float((A[i] * S[j] - A[j] * S[i]) / det)

    def line_crossing(self) -> Wall | None:
        """The wall with roots at +rho and -rho at once; None if the lines are parallel."""
        (a, s, v), (b, t, w) = self.line("plus"), self.line("minus")
        det = s * w - t * v
        if abs(det) <= 1e-13 * (abs(s * w) + abs(t * v)) or det == 0.0:
            return None
        return float((b * v - a * w) / det), float((a * t - b * s) / det)
