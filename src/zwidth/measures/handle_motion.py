"""How the handle moves under the hand, of many devices at once and at many frequencies (see `handle_impedance`).

With a wall C = K + B w(z) and the modes' responses between actuator a, sensor s and handle h, at s = jw,

    G_xy = sum_k x_k y_k / (s^2 + 2 a_k s + w_k^2)      x_h/f = G_hh - H C G_ha G_sh/(1 + P C)

which is `handle_impedance.felt_impedance` with the inverse of D + H C/(1 + S C) a s^T written out (Sherman and
Morrison). P and w are those of the loops' kernels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats, Ints
from zwidth.compiled import compiled
from zwidth.loop.circle_factors import (
    COMPUTER,
    CircleFactors,
    factor_memory,
    fill_computer,
    fill_plant,
    half_angle,
    minus_inverse_plant,
    velocity_on_circle,
)
from zwidth.loop.controller import Controller
from zwidth.loop.filters import force_filter
from zwidth.loop.loop_table import LoopTable
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_loops import modes_of_points, table_of_points
from zwidth.model.rendered_modes import RenderedModes

AT_ONCE: Final = 2048  # devices whose responses are in memory at once


@dataclass(frozen=True)
class HandleMotion:
    """N devices whose handles are moved, without operator.

    table    their loops
    modes    their modes
    known    (N,)  which devices are known in this form; the others are to be asked alone
    period   (N,)  T [s]
    controller  of all of them, numbers of several designs (N,)
    """

    table: LoopTable
    modes: RenderedModes
    known: Flags
    period: Floats
    controller: Controller

    @classmethod
    def of(cls, point: OperatingPoint) -> HandleMotion | None:
        """The devices at all points, flat; None where each is to be asked alone."""
        free = point.without_operator
        if not point.shape or free.controller.fixed_feedback:
            return None
        flat = free.flat
        table, modes = table_of_points(flat), modes_of_points(flat)
        if table is None or modes is None:
            return None
        known = (table.section_count > 0) & np.isfinite(modes.handle).all(axis=1)
        known &= np.isfinite(modes.decay).all(axis=1) & np.isfinite(modes.input).all(axis=1)
        period = np.array(np.broadcast_to(np.ravel(flat.controller.sampling_period), known.shape), dtype=float)
        return cls(table, modes, known, period, flat.controller)

    def compliances(self, rows: Ints, frequency: Floats, K: Floats, B: Floats) -> tuple[Complexes, ...]:
        """Motion of the handle per force of the hand on it, without a wall and with one.

        rows       (n,)    which devices, of those known
        frequency  (n, f)  above 0 and below half the sampling frequency [Hz]
        K, B       (n,)    of the wall [N/m], [N s/m]
        Returns    (n, f) twice  [m/N]
        """
        parts = [
            self._some(rows[first : first + AT_ONCE], frequency[first : first + AT_ONCE])
            for first in range(0, max(len(rows), 1), AT_ONCE)
        ]
        G, through, P, w, H = (np.concatenate(each) for each in zip(*parts, strict=True))
        C = K[:, None] + B[:, None] * w
        return G, G - H * C * through / (1.0 + P * C)

    def _some(self, rows: Ints, frequency: Floats) -> tuple[Complexes, ...]:
        """G_hh, G_ha G_sh, P, w and H of devices (n,) at frequencies (n, f)."""
        T = self.period[rows][:, None]
        s: Complexes = np.asarray(2j * np.pi * frequency, dtype=np.complex128)
        G_hh, G_ha, G_sh = self._responses(rows, s)
        P, w = (np.empty(frequency.shape, dtype=complex) for _ in range(2))
        _sampled(self.table, rows, 2.0 * np.pi * frequency * T, factor_memory(self.table), P, w)
        return G_hh, G_ha * G_sh, P, w, self._hold(rows, s)

    def _responses(self, rows: Ints, s: Complexes) -> tuple[Complexes, ...]:
        """G_hh, G_ha and G_sh (n, f)."""
        modes = self.modes.rows(rows)
        h, a, y = modes.handle, modes.input, modes.output
        own = s[..., None] ** 2 + 2.0 * modes.decay[:, None] * s[..., None] + modes.frequency_squared[:, None]
        # a mode that does not move has no number either where its frequency is filled up with 0
        G = [np.sum((one * other)[:, None] / own, axis=-1) for one, other in ((h, h), (h, a), (y, h))]
        if modes.coupled is None or modes.drag is None or not modes.coupled.any():
            return tuple(G)
        some = np.flatnonzero(modes.coupled)
        m = h.shape[1]
        D = s[some][..., None, None] * modes.drag[some][:, None]
        D[..., range(m), range(m)] += s[some][..., None] ** 2 + modes.frequency_squared[some][:, None]
        right = np.stack([h[some], a[some]], axis=-1)[:, None].astype(complex)
        moved = np.linalg.solve(D, np.broadcast_to(right, (*D.shape[:-1], 2)))
        for response, left, column in zip(G, (h, h, y), (0, 1, 0), strict=True):
            response[some] = np.einsum("nk,nfk->nf", left[some], moved[..., column])
        return tuple(G)

    def _hold(self, rows: Ints, s: Complexes) -> Complexes:
        """H (n, f), from commands to the part of the force at s itself."""
        T = self.period[rows][:, None]
        delay, lag = self.delay[rows][:, None], self.lag[rows][:, None]
        low_pass, d = force_filter(self.controller), np.expm1(s * T)
        filtered = np.ones_like(d)
        for k in range(low_pass.numerator.shape[-2]):
            top, bottom = (
                self._quadratic(each[..., k, :], rows, d) for each in (low_pass.numerator, low_pass.denominator)
            )
            filtered *= top / bottom
        stairs = -np.expm1(-s * T) / (s * T) * np.exp(-s * T * delay)
        return np.asarray(filtered * stairs / (1.0 + s * lag))

    @property
    def delay(self) -> Floats:
        """(N,) of the force [samples]."""
        return self._of_each(self.controller.delay)

    @property
    def lag(self) -> Floats:
        """(N,) of the actuator [s]."""
        return self._of_each(self.controller.actuator_time_constant)

    def _of_each(self, number: float | Floats) -> Floats:
        return np.array(np.broadcast_to(np.ravel(np.asarray(number, dtype=np.float64)), self.period.shape))

    def _quadratic(self, c: Floats, rows: Ints, d: Complexes) -> Complexes:
        """c2 d^2 + c1 d + c0 for coefficients (3,) or those of each device (N, 3)."""
        c = c.reshape(-1, 3)
        c2, c1, c0 = (c[rows] if len(c) > 1 else c).T[..., None]
        return np.asarray((c2 * d + c1) * d + c0)


@compiled
def _sampled(
    loops: LoopTable, rows: Ints, theta: Floats, circle: CircleFactors, P: Complexes, w: Complexes
) -> None:
    """Sampled plants P, delay and force path included, and velocity estimates w at z = exp(i theta)."""
    circle.sizes[COMPUTER] = -1
    for n in range(len(rows)):
        i = rows[n]
        if circle.sizes[COMPUTER] != loops.computer[i]:
            fill_computer(loops, loops.computer[i], 1.0, circle)
        fill_plant(loops, i, circle)
        for k in range(theta.shape[1]):
            cc, ss, sc = half_angle(np.tan(0.5 * theta[n, k]))
            X, _, N, _ = minus_inverse_plant(circle, cc, ss, sc)
            Y, _, Q, _ = velocity_on_circle(circle, cc, ss, sc)
            P[n, k] = -N / X
            w[n, k] = Y / Q
