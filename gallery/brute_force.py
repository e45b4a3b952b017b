"""An independent judge: the transition matrix by matrix exponential, its eigenvalues, and bisection.

Nothing here comes from zwidth. The plant between samples is integrated by scipy's matrix exponential, the
computer's memory (old reading, filter, delayed forces) is appended, and the matrix Z_{j+1} = L Z_j (thesis eq.
2.38) of every wall asked about is handed to numpy's eigenvalues. Slow, plain, and hard to get wrong.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq, root

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


class BruteForceLoop:
    """Walls on one plant: M x'' + B x' + K x = actuator f, read by the same coordinate.

    mass, damping, stiffness  (n, n)
    side       (n,)  the coordinate that the wall acts on and reads
    period     T [s]
    delay      whole samples
    low_pass   (numerator, denominator) of a filter on the velocity, in falling powers of z; None: none
    """

    def __init__(self, mass, damping, stiffness, side, period, delay=0, low_pass=((1.0,), (1.0,))):
        M, B, K = (np.atleast_2d(np.asarray(matrix, float)) for matrix in (mass, damping, stiffness))
        n, side = len(M), np.atleast_1d(np.asarray(side, float))
        self.period, self.delay = period, delay
        A = np.zeros((2 * n + 1, 2 * n + 1))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, : 2 * n] = -np.linalg.solve(M, np.hstack([K, B]))
        A[n : 2 * n, -1] = np.linalg.solve(M, side)
        step = expm(A * period)
        self.free, self.push = step[:-1, :-1], step[:-1, -1]
        self.reading = np.concatenate([side, np.zeros(n)])
        b, a = np.asarray(low_pass[0], float), np.asarray(low_pass[1], float)
        self.b, self.a = np.convolve(b, [1.0, -1.0]) / period / a[0], np.convolve(a, [1.0, 0.0]) / a[0]

    def matrix(self, wall_stiffness, wall_damping):
        """L (..., N, N). State: motion, the filter's memory (direct form II transposed), forces under way.

        v_j = b0 y_j + s_1,  s_i' = s_{i+1} + b_i y_j - a_i v_j,  f_j = -(K y_j + B v_j)
        """
        K, B = np.broadcast_arrays(np.asarray(wall_stiffness, float), np.asarray(wall_damping, float))
        motion, memory = len(self.reading), len(self.a) - 1
        N = motion + memory + self.delay
        velocity, reading = np.zeros(N), np.zeros(N)
        reading[:motion] = self.reading
        velocity[:motion] = self.b[0] * self.reading
        velocity[motion] = 1.0
        L = np.zeros((*K.shape, N, N))
        L[..., :motion, :motion] = self.free
        for i in range(memory):
            row = self.b[i + 1] * reading - self.a[i + 1] * velocity
            if i + 1 < memory:
                row[motion + i + 1] += 1.0
            L[..., motion + i, :] = row
        force = -(K[..., None] * reading + B[..., None] * velocity)
        if self.delay:
            L[..., :motion, N - self.delay] += self.push
            for i in range(self.delay - 1):
                L[..., N - self.delay + i, N - self.delay + i + 1] = 1.0
            L[..., N - 1, :] = force
        else:
            L[..., :motion, :] += self.push[:, None] * force[..., None, :]
        return L

    def roots(self, wall_stiffness, wall_damping):
        """Eigenvalues (..., N)."""
        return np.linalg.eigvals(self.matrix(wall_stiffness, wall_damping))

    def radius(self, wall_stiffness, wall_damping):
        """Spectral radius (...)."""
        return np.abs(self.roots(wall_stiffness, wall_damping)).max(axis=-1)

    def calmest(self, K, low, high, steps=60):
        """The damping of least spectral radius at each stiffness, by golden section between low and high."""
        K = np.asarray(K, float)
        low, high = np.full(K.shape, float(low)), np.full(K.shape, float(high))
        for _ in range(steps):
            left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
            fall = self.radius(K, left) < self.radius(K, right)
            low, high = np.where(fall, low, left), np.where(fall, right, high)
        return 0.5 * (low + high)

    def largest_stiffness(self, K_above, B_above):
        """K, B and the frequency of the dominant root [Hz] of the stiffest stable wall below the two guesses."""

        def excess(K):
            return float(self.radius(K, self.calmest(K, 0.0, B_above))) - 1.0

        low = float(K_above)
        while excess(low) > 0.0:  # not from 0, where a rigid mode's root is 1
            low *= 0.5
        K = brentq(excess, low, 2.0 * low, xtol=1e-13 * low, rtol=1e-14) if low < K_above else low
        B = float(self.calmest(K, 0.0, B_above))
        roots = self.roots(K, B)
        top = roots[np.argmax(np.abs(roots))]
        return K, B, float(abs(np.angle(top)) / (2.0 * np.pi * self.period))

    def edges(self, K, B_above):
        """Lower and upper edge in damping at each stiffness, by bisection from the calmest wall between them."""
        inside = self.calmest(K, 0.0, B_above)
        found = []
        for outside in (0.0, B_above):
            stable, unstable = inside.copy(), np.full(inside.shape, float(outside))
            for _ in range(50):
                middle = 0.5 * (stable + unstable)
                good = self.radius(K, middle) < 1.0
                stable, unstable = np.where(good, middle, stable), np.where(good, unstable, middle)
            found.append(stable)
        return found[0], found[1]

    def area(self, K_max, B_above, corners=(), nodes=40):
        """Area of the stable set within K > 0, B > 0: Gauss points in s, K = K_max (1 - s^2), so that the square
        root with which the edges close at the tip is smooth; in pieces between the corners, given by their K."""
        x, weight = np.polynomial.legendre.leggauss(nodes)
        cuts = np.sqrt(1.0 - np.sort([0.0, *corners, K_max])[::-1] / K_max)
        total = 0.0
        for a, b in pairwise(cuts):
            s = 0.5 * (a + b) + 0.5 * (b - a) * x
            lower, upper = self.edges(K_max * (1.0 - s**2), B_above)
            total += float(np.sum(0.5 * (b - a) * weight * (upper - lower) * 2.0 * K_max * s))
        return total

    def largest_damping(self, B_above):
        """Largest stable damping for K -> 0: the rigid mode's root at z = 1 is left out."""
        stable, unstable = 1e-3 * B_above, float(B_above)
        for _ in range(60):
            middle = 0.5 * (stable + unstable)
            roots = self.roots(0.0, middle)
            rest = np.delete(roots, np.argmin(np.abs(roots - 1.0)))
            stable, unstable = (middle, unstable) if np.abs(rest).max() < 1.0 else (stable, middle)
        return stable

    def triple_point(self, K, B):
        """K, B and rho, near a guess, where a complex pair and a double real root have one radius rho.

        Four equations p(rho) = p'(rho) = 0, p(rho e^{i theta}) = 0 on the characteristic polynomial: the fastest
        decay of the two-mass plant is such a wall; eigenvalues know a double root to half their digits only.
        """

        def equations(unknown):
            stiffness, damping, rho, theta = unknown * scale
            p = np.poly(self.matrix(stiffness, damping))
            pair = np.polyval(p, rho * np.exp(1j * theta))
            return 1e3 * np.polyval(p, rho), 1e2 * np.polyval(np.polyder(p), rho), pair.real, pair.imag

        roots = self.roots(K, B)
        pair = roots[np.argmax(roots.imag * (np.abs(np.angle(roots)) > 0.1))]
        scale = np.array([K, B, abs(pair), np.angle(pair)])
        found = root(equations, np.ones(4), tol=1e-14)
        stiffness, damping, rho, _ = found.x * scale
        return float(stiffness), float(damping), float(rho)


def butterworth(cutoff_Hz, period, prewarped=False):
    """(3.17)-(3.19): second order by Tustin's rule, as numerator and denominator in falling powers of z."""
    W, zeta = 2.0 * np.pi * cutoff_Hz * period, 1.0 / np.sqrt(2.0)
    if prewarped:
        W = 2.0 * np.tan(W / 2.0)
    whole = W**2 + 4.0 * zeta * W + 4.0
    numerator = W**2 / whole * np.array([1.0, 2.0, 1.0])
    return numerator, np.array([1.0, 2.0 * (W**2 - 4.0) / whole, (W**2 - 4.0 * zeta * W + 4.0) / whole])
