"""A loop on one circle |z| = rho: its curve of walls and the two straight lines of real roots.

Kernels along a piece of the curve: angles so dense that chords lie on it, and sign changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Complexes, Floats, Ints
from zwidth.chart.arcs import END_MARGIN, Arc, ArcPoints
from zwidth.chart.area import arc_integral, area_memory, end_value
from zwidth.chart.circle_sampling import MOST_SAMPLES, feature_memory, samples_of_loop
from zwidth.chart.curve import NO_LINE, OF_SLOPE, trace, wall_at, walls, zero_between
from zwidth.chart.edge_samples import LONGEST
from zwidth.chart.loop_polynomials import (
    LoopPolynomials,
    all_roots_inside,
    edges_on_line,
    polynomial_memory,
    polynomials_of_loop,
    work_array,
)
from zwidth.chart.nyquist import phase_flags, terms_along
from zwidth.chart.wall_samples import EDGE, HIDDEN, MOST_DEGREE, NO_EDGE
from zwidth.compiled import compiled
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import (
    DEGREE,
    WHOLE_DELAY,
    WINDOW,
    CircleFactors,
    LoopTable,
    circle_factors,
    wall_with_slopes,
)

# A root this near the circle is on neither side of it.
CIRCLE_TOLERANCE = 1e-9
RealRoot = Literal["plus", "minus"]
ROOTS: tuple[RealRoot, RealRoot] = ("plus", "minus")


def tracer_of(loop: Loop, radius: float = 1.0) -> Tracer:
    """The tracer of a loop on the circle |z| = radius; that on the unit circle is kept with the loop."""
    if radius != 1.0:
        return Tracer(loop, radius)
    if "tracer" not in loop.results:
        loop.results["tracer"] = Tracer(loop)
    tracer: Tracer = loop.results["tracer"]
    return tracer


@dataclass(frozen=True)
class Tracer:
    """A loop in the arrays that the kernels take, with the functions that evaluate them.

    loop    the loop
    radius  rho
    """

    loop: Loop
    radius: float = 1.0

    @property
    def table(self) -> LoopTable:
        """The loop as arrays. Raises what `loop.sections.sampled_sections` raises."""
        return self.loop.table

    @cached_property
    def circle(self) -> CircleFactors:
        """The loop's factors on the circle."""
        return circle_factors(self.table, self.radius)

    @cached_property
    def all_polynomials(self) -> LoopPolynomials:
        """The loop's polynomials on the circle, with the products that they are made of."""
        every = polynomial_memory(self.degree)
        polynomials_of_loop(self.circle, every)
        return every

    @property
    def polynomials(self) -> Floats:
        """(5, N + 1) A, S, V in the bilinear variable of the circle, and what cancelled in S and V."""
        return self.all_polynomials.coefficients

    @property
    def period(self) -> float:
        """Sampling period T [s]; K T and B have the same unit, in which distances between walls are taken."""
        return self.loop.period

    @property
    def degree(self) -> int:
        """Number N of roots."""
        return int(self.circle.sizes[DEGREE])

    def sample_angles(self, share: float, longest: float | None = None) -> Floats:
        """Ascending angles in (0, pi) whose steps are `share` of the distance to the curve's nearest
        singularity, and at most `longest` [rad]; None: `longest_step`."""
        longest = self.longest_step if longest is None else longest
        t, found = np.empty(MOST_SAMPLES), feature_memory(self.degree, int(self.circle.sizes[WINDOW]))
        count = samples_of_loop(self.circle, self.all_polynomials, found, share, longest, t)
        return np.asarray(2.0 * np.arctan(t[:count]))

    def wall(self, theta: float) -> tuple[float, float, float, float]:
        """K, B, dK/dtheta, dB/dtheta at one angle in (0, pi)."""
        return wall_at(self.circle, theta)

    def walls(self, thetas: Floats) -> tuple[Floats, Floats]:
        """K and B (k,) at angles (k,) in (0, pi)."""
        return walls(self.circle, thetas)

    def angles(self, parameters: Floats) -> Floats:
        """The parameters themselves (`arcs.Curve.angles`): this curve is given by its angles."""
        return parameters

    def zeros(self, arc: Arc, component: int) -> Floats:
        """Ascending angles on an arc at which K, B or dK/dtheta changes sign, to rounding.

        component  STIFFNESS, DAMPING or SLOPE of `arcs`
        """
        t, ends = np.tan(0.5 * arc.angles), np.array([arc.first, arc.last])
        order = slice(None) if arc.start < arc.end else slice(None, None, -1)
        zeros = sign_changes(self.circle, t[order].copy(), ends[order].copy(), component)
        return np.asarray(2.0 * np.arctan(zeros))

    def dense_points(self, arc: Arc) -> ArcPoints:
        """Angles strictly between an arc's ends, from first to last, with K and B: chords within CHORD of the arc;
        where it crosses K = 0 or B = 0 one on either side, close by."""
        t, ends = np.tan(0.5 * arc.angles), np.array([arc.first, arc.last])
        if arc.start < arc.end:
            return dense_points(self.circle, t, ends)
        thetas, K, B = dense_points(self.circle, t[::-1].copy(), ends[::-1].copy())
        return thetas[::-1], K[::-1], B[::-1]

    def integral(self, arc: Arc) -> float:
        """Integral of K dB over the part of an arc with K > 0 and B > 0 [N² s/m²]."""
        first, last = np.array([arc.first, arc.last])
        return arc_integral(self.circle, area_memory(), np.tan(0.5 * arc.angles), first, last)

    def trace(self, thetas: Floats, t: Floats | None = None) -> tuple[Floats, Floats, NDArray[np.int8]]:
        """K, B and flag at ascending angles in (0, pi): EDGE, NO_EDGE, or HIDDEN where eigenvalues must decide.

        t  tan(theta/2) of each, where that is known
        """
        if not self.is_high_degree:
            return trace(self.circle, self.polynomials, np.tan(0.5 * thetas) if t is None else t)
        K, B = walls(self.circle, thetas)
        return K, B, self.flags_by_phase(np.column_stack([K, B]), thetas, 0)

    @property
    def is_high_degree(self) -> bool:
        """Whether the loop's degree is too high for polynomials."""
        return self.degree > MOST_DEGREE

    @cached_property
    def _circle_samples(self) -> tuple[Floats, Complexes]:
        """Angles (n,) of samples of the circle, and A, A P, A P w (n, 3) there, for `flags_by_phase`."""
        thetas = self.sample_angles(0.2)
        # soft walls have roots as near to z = 1 as one likes
        closer = np.logspace(-8.0, -1.0, 8)
        thetas = np.concatenate([closer * thetas[0], thetas, np.pi - closer[::-1] * (np.pi - thetas[-1])])
        return thetas, terms_along(self.circle, thetas)

    def flags_by_phase(self, points: Floats, pairs: Floats, real: int) -> NDArray[np.int8]:
        """Flags of walls (n, 2) by the phase along the circle: EDGE where all roots but those divided out are
        inside, NO_EDGE where one is not, HIDDEN where rounding leaves it open.

        pairs, real  the roots divided out, as for `nyquist.phase_flags`
        """
        flags = phase_flags(self.circle, *self._circle_samples, self.degree, points, pairs, real)
        return np.asarray(flags, dtype=np.int8)

    @property
    def longest_step(self) -> float:
        """Largest step of theta between samples of the circle: a delay of n samples turns n times as fast as z."""
        late = self.circle.sizes[WHOLE_DELAY] + self.circle.sizes[WINDOW]
        return min(LONGEST, 0.5 / float(late))

    def edge_flag(self, theta: float) -> int:
        """Whether the wall at one angle edges the stable set: EDGE, NO_EDGE, or HIDDEN where eigenvalues cannot
        tell either."""
        one = np.array([theta])
        K, B, flags = self.trace(one)
        return int(flags[0] or self.edge_by_eigenvalues(one, K, B)[0])

    def edge_by_eigenvalues(self, thetas: Floats, K: Floats, B: Floats) -> Ints:
        """Flags (EDGE, NO_EDGE, HIDDEN) of walls on the curve, by all eigenvalues but the pair at their angle."""
        z = np.abs(self.roots_without_pair(thetas, K, B)).max(axis=-1) - self.radius
        return np.where(z < -CIRCLE_TOLERANCE, EDGE, np.where(z > CIRCLE_TOLERANCE, NO_EDGE, HIDDEN))

    def roots_without_pair(self, thetas: Floats, K: Floats, B: Floats) -> Complexes:
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
            flag = int(self.flags_by_phase(np.array([[K, B]]), np.zeros(1), 0)[0])
        else:
            flag = all_roots_inside(self.polynomials, self.degree, K, B, work_array(self.degree))
        if flag == 0:
            return bool(np.abs(np.linalg.eigvals(self.loop.transition_matrix(K, B))).max() < self.radius)
        return bool(flag > 0)

    def stable_on_left(self, theta: float) -> bool:
        """Whether the stable side is on the left for growing theta: Im w > 0.

        Moving a root by dz = -(S dK + V dB)/p'(z) along the left normal changes |z| by an amount of the sign of
        -Im(V conj S) = -|S|^2 Im w (Neimark's rule), with p = A + K S + B V of `loop_polynomials`, V = w S.
        """
        return bool(self.loop.velocity_response(self.radius * np.exp(1j * theta)).imag > 0.0)

    def line(self, root: RealRoot) -> Floats:
        """Coefficients a, s, v of  a + s K + v B = 0, the walls with a root at +rho or -rho; stable side > 0.

        These are the lowest and the highest coefficient of p, which a Hurwitz polynomial has positive.
        """
        return self.polynomials[:3, 0 if root == "plus" else -1].copy()

    def edge_on_line(self, root: RealRoot, K: float, B: float) -> bool:
        """Whether a wall on the line of a real root has all its other roots inside the circle."""
        if self.is_high_degree:
            flag = int(self.flags_by_phase(np.array([[K, B]]), np.zeros(1), 1)[0])
        else:
            flag = edges_on_line(self.polynomials, self.degree, int(root == "plus"), K, B, work_array(self.degree))
        if flag == 0:
            z = np.linalg.eigvals(self.loop.transition_matrix(K, B))
            own = np.argmin(np.abs(z - (self.radius if root == "plus" else -self.radius)))
            return bool(np.abs(np.delete(z, own)).max() < self.radius - CIRCLE_TOLERANCE)
        return bool(flag > 0)


# Largest distance of a chord from its arc, in shares of the arc's own extent in K and in B.
CHORD = 1e-6
MOST_POINTS = 4000
# How close to an axis the points beside it are, as a share of the angle.
BESIDE_AXIS = 1e-9


@compiled
def dense_points(circle: CircleFactors, t: Floats, ends: Floats) -> tuple[Floats, Floats, Floats]:
    """Angles strictly between an arc's ends, ascending, with K and B: chords between them stay within CHORD of the
    arc, and where it crosses K = 0 or B = 0 there is one on either side, close by.

    t     (n,)    ascending tan(theta/2) from end to end
    ends  (2, 2)  the walls at both ends
    """
    n, K_zeros, B_zeros = len(t), sign_changes(circle, t, ends, 0), sign_changes(circle, t, ends, 1)
    nodes = np.empty(n + 2 * (len(K_zeros) + len(B_zeros)))
    for i in range(n):
        nodes[i] = 2.0 * np.arctan(t[i])
    low, high, count = nodes[0], nodes[n - 1], n
    # a node on either side of each crossing of an axis, inserted in its order
    for zeros in (K_zeros, B_zeros):
        for zero in zeros:
            for share in (1.0 - BESIDE_AXIS, 1.0 + BESIDE_AXIS):
                theta = share * 2.0 * np.arctan(zero)
                if low < theta < high:
                    i = count
                    while nodes[i - 1] > theta:
                        nodes[i] = nodes[i - 1]
                        i -= 1
                    nodes[i] = theta
                    count += 1
    thetas = _refined_angles(circle, nodes[:count], CHORD, MOST_POINTS)
    K, B = walls(circle, thetas)
    return thetas, K, B


@compiled
def _refined_angles(circle: CircleFactors, nodes: Floats, tolerance: float, most: int) -> Floats:
    """Angles strictly between the first and last of ascending angles, each interval cut so that chords stay within
    tolerance, a share of the extent in K and in B; no more than `most` are added to the nodes.

    The sag of a chord over a step h is h^2/8 times the second derivative; the middle of each interval measures it,
    and n equal pieces, 200 at most, divide it by n^2.
    """
    n = len(nodes)
    K, B = np.empty(2 * n - 1), np.empty(2 * n - 1)
    for i in range(2 * n - 1):
        theta = nodes[i // 2] if i % 2 == 0 else 0.5 * (nodes[i // 2] + nodes[i // 2 + 1])
        # the ends may be 0 or pi, where the curve is even: just inside is as good
        inside = min(max(theta, 1e-7 * nodes[1]), np.pi - 1e-7 * (np.pi - nodes[n - 2]))
        K[i], B[i], _, _ = wall_at(circle, inside)
    width, height = K.max() - K.min(), B.max() - B.min()
    out, count = np.empty(most + 2 * n), 0
    for i in range(n - 1):
        j = 2 * i
        sag = max(
            abs(K[j + 1] - 0.5 * (K[j] + K[j + 2])) / max(width, 1e-300),
            abs(B[j + 1] - 0.5 * (B[j] + B[j + 2])) / max(height, 1e-300),
        )
        pieces = max(1, min(int(np.ceil(np.sqrt(sag / tolerance))), 200))
        for k in range(pieces):
            theta = nodes[i] + (nodes[i + 1] - nodes[i]) * k / pieces
            if (i > 0 or k > 0) and count < len(out):
                out[count] = theta
                count += 1
    return out[:count].copy()


@compiled
def sign_changes(circle: CircleFactors, t: Floats, ends: Floats, component: int) -> Floats:
    """The t on an arc at which K (0), B (1) or dK/dtheta (2) changes sign: numbers as OF_K, OF_B, OF_SLOPE of
    `curve`.

    t     (n,)    tan(theta/2) from end to end
    ends  (2, 2)  the walls at both ends
    """
    n, m = len(t), 0
    out, values = np.empty(n), np.empty(n)
    for i in range(1, n - 1):
        values[i] = wall_with_slopes(circle, t[i])[component]  # of K, B, dK/dtheta, dB/dtheta
    # from the ends drawn in: there K or B may touch an axis, and the slope has no value at t = 0 and inf
    if component == OF_SLOPE:
        low, high = t[0] + END_MARGIN * (t[1] - t[0]), t[n - 1] - END_MARGIN * (t[n - 1] - t[n - 2])
        low, high = max(low, END_MARGIN * t[1]), min(high, t[n - 2] / END_MARGIN)
        before, after = wall_with_slopes(circle, low)[2], wall_with_slopes(circle, high)[2]
    else:
        values[0], values[n - 1] = ends[0, component], ends[1, component]
        low, before = end_value(circle, component, values, t, n, False)
        high, after = end_value(circle, component, values, t, n, True)
    for i in range(1, n):
        at, value = (t[i], values[i]) if i < n - 1 else (high, after)
        if before * value < 0.0:
            out[m] = zero_between(circle, component, NO_LINE, low, at)
            m += 1
        low, before = at, value
    return out[:m].copy()
