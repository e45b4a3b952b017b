"""Small loss factors on random loops, judged by an independent count of the roots outside the circle."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import shapely

from tests.systems import (
    low_pass_sections,
    random_controller,
    random_method,
    random_plant,
    velocity_filter,
    velocity_weights,
)
from zwidth.chart import hysteretic_chart, stability_chart
from zwidth.errors import HysteresisError
from zwidth.loop import Butterworth, Kalman, Loop

SMALLEST = 1e-5
MARGIN = 1e-9  # least |1 + L| over 1 + |L| that is counted


def undamped_loop(seed):
    """Two to four masses without damping, and a computer with delay, lag, filters or another estimate."""
    rng = np.random.default_rng([7, seed])
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0))
    kind = str(rng.choice(["chain", "dense", "apart"]))
    plant = random_plant(rng, rate, (0.0,), kind)
    while plant.size < 2:
        plant = random_plant(rng, rate, (0.0,), kind)
    computer = random_controller(rng, rate)
    if rng.random() < 0.4:
        computer = replace(computer, velocity=random_method(rng, rate))
    if rng.random() < 0.2:
        low_pass = Butterworth(int(rng.integers(1, 4)), rng.uniform(0.1, 0.9) * rate / 2.0)
        computer = replace(computer, force_filter=low_pass)
    if rng.random() < 0.2:
        computer = replace(computer, actuator_time_constant=10.0 ** rng.uniform(-2.0, 1.0) / rate)
    return Loop(plant, computer)


def lossy_chart(loop, factor):
    return hysteretic_chart(replace(loop, plant=replace(loop.plant, hysteresis=factor * loop.plant.stiffness)))


def section_response(sections, z):
    """Response of second-order sections at z (n,)."""
    out = np.ones_like(z)
    for b0, b1, b2, _, a1, a2 in sections:
        out *= (b0 + b1 / z + b2 / z**2) / (1.0 + a1 / z + a2 / z**2)
    return out


class AliasSum:
    """P by the sum over aliases of undamped modes K (1 + i eta), w by definition, and Nyquist's count of roots.

    Nothing is shared with the package but the plant and the controller.
    """

    def __init__(self, loop, factor, aliases=300):
        self.controller, self.factor, self.period = loop.controller, factor, loop.period
        squared, V = scipy.linalg.eigh(loop.plant.stiffness, loop.plant.mass)
        self.squared = np.where(np.abs(squared) < 1e-12 * squared[-1], 0.0, squared)
        self.shares = (loop.plant.actuator @ V) * (loop.plant.sensor @ V)
        self.k = np.arange(-aliases, aliases + 1)

    def plant(self, thetas):
        """P (n,)."""
        c, parts = self.controller, []
        for theta in np.array_split(thetas, 1 + len(thetas) // 500):
            w = (theta[:, None] + 2.0 * np.pi * self.k) / self.period
            lossy = self.squared[:, None, None] * (1.0 + 1j * self.factor * np.sign(w))
            G = np.einsum("i,ijk->jk", self.shares, 1.0 / (lossy - w * w))
            hold = -np.expm1(-1j * theta)[:, None] / (1j * w) * np.exp(-1j * w * c.delay * self.period)
            parts.append(np.sum(G * hold / (1j * w * c.actuator_time_constant + 1.0), axis=1) / self.period)
        return np.concatenate(parts) * section_response(
            low_pass_sections(c.force_filter, self.period), np.exp(1j * thetas)
        )

    def velocity(self, thetas):
        """w (n,)."""
        z, method, T = np.exp(1j * thetas), self.controller.velocity, self.period
        weights = velocity_weights(method, T)
        if weights is None:
            method = method.alpha_beta(T) if isinstance(method, Kalman) else method
            a, b = method.alpha, method.beta
            step = np.array([[1.0 - a, (1.0 - a) * T], [-b / T, 1.0 - b]])
            states = np.linalg.solve(z[:, None, None] * np.eye(2) - step, np.array([[a], [b / T]]))
            speed = states[:, 1, 0] * z
        else:
            speed = np.polyval(weights[::-1], 1.0 / z)
        return speed * section_response(velocity_filter(self.controller), z)

    def angles(self):
        """Angles that close in on both ends, and on each mode's alias as sharply as its loss asks for."""
        parts = [
            np.geomspace(3e-6, 3.0, 200),
            np.linspace(1e-3, 3.141, 1500),
            np.pi - np.geomspace(3e-6, 0.3, 100),
        ]
        for turn in np.sqrt(self.squared[self.squared > 0.0]) * self.period:
            at = abs((turn + np.pi) % (2.0 * np.pi) - np.pi)
            away = np.geomspace(5e-3 * turn * self.factor, 3.0 + turn, 140)
            parts += [at + away, at - away, [at]]
        thetas = np.unique(np.concatenate(parts))
        return thetas[(thetas > 0.0) & (thetas < np.pi)]

    def outside(self, walls):
        """Roots outside the circle at walls (n, 2); nan next to the boundary.

        1 + L turns by -pi for each along the upper half from z = 1 + 0.
        An angle is added where the middle of a chord of 1 + L is off by a fifth of its distance from 0: a tip is
        where 1 + L passes 0 and turns back between two angles at which it is all but the same.
        """
        thetas = self.angles()
        P, w = self.plant(thetas), self.velocity(thetas)
        unsure = np.ones(len(thetas) - 1, dtype=bool)
        while unsure.any():
            at = np.flatnonzero(unsure) + 1
            middle = 0.5 * (thetas[at - 1] + thetas[at])
            P_middle, w_middle = self.plant(middle), self.velocity(middle)
            a, m, b = (
                1.0 + p * (walls[:, :1] + walls[:, 1:] * v)
                for p, v in ((P[at - 1], w[at - 1]), (P_middle, w_middle), (P[at], w[at]))
            )
            nearest = np.minimum(np.minimum(np.abs(a), np.abs(m)), np.abs(b))
            bent = np.any((np.abs(m - 0.5 * (a + b)) > 0.2 * nearest) | (np.abs(b - a) > nearest), axis=0)
            bent &= thetas[at] - thetas[at - 1] > 1e-13
            new = at[bent]
            thetas = np.insert(thetas, new, middle[bent])
            P, w = np.insert(P, new, P_middle[bent]), np.insert(w, new, w_middle[bent])
            unsure = np.zeros(len(thetas) - 1, dtype=bool)
            right = new + np.arange(len(new))
            unsure[right - 1] = unsure[right] = True
        F = 1.0 + P * (walls[:, :1] + walls[:, 1:] * w)
        if np.any(self.squared == 0.0):  # two integrators, passed on a small half circle: half a turn
            first = np.angle(-F[:, 0] * np.sign(walls[:, 0])) - np.pi
        else:
            first = np.angle(F[:, 0] * np.sign(F[:, 0].real))
        turns = np.sum(np.angle(F[:, 1:] / F[:, :-1]), axis=1) + np.angle(np.sign(F[:, -1].real) / F[:, -1])
        clear = np.min(np.abs(F) / (1.0 + np.abs(F - 1.0)), axis=1)
        return np.where(clear < MARGIN, np.nan, -(first + turns) / np.pi)


def counts_at_the_tip(loop, chart, factor):
    """Roots outside at a wall inside the tip, one beyond it and one in the middle of its cell."""
    K, B = chart.stiffness_max, chart.damping_at_stiffness_max
    tip = shapely.Point(1.0, np.sign(B))
    scale = np.array([K, abs(B) + 1e-300])
    cells = [shapely.Polygon(ring / scale) for ring in chart.regions]
    cell = min(cells, key=lambda cell: cell.distance(tip))
    size = np.ptp(shapely.get_coordinates(cell), axis=0)
    circle = shapely.maximum_inscribed_circle(shapely.transform(cell, lambda xy: xy / size))
    middle = shapely.get_coordinates(circle)[0] * size * scale
    judge = AliasSum(loop, factor)
    inside = np.array([K, B]) + 1e-3 * (middle - [K, B])
    return judge.outside(np.array([inside, [1.001 * K, B], middle]))


@pytest.mark.parametrize("seed", [1, 15, 140])
def test_the_tip_with_the_smallest_loss_is_where_roots_leave_the_circle(seed):
    loop = undamped_loop(seed)
    inside, beyond, middle = counts_at_the_tip(loop, lossy_chart(loop, SMALLEST), SMALLEST)
    assert (inside, middle) == pytest.approx((0.0, 0.0), abs=0.05)
    assert beyond > 0.95


@pytest.mark.parametrize("seed", [1, pytest.param(140, marks=pytest.mark.slow)])
def test_twice_the_loss_moves_the_tip_twice_as_far_from_the_undamped_one(seed):
    loop = undamped_loop(seed)
    undamped = stability_chart(loop, decay=False).stiffness_max
    one, two = (lossy_chart(loop, factor).stiffness_max for factor in (1e-4, 2e-4))
    assert two - undamped == pytest.approx(2.0 * (one - undamped), rel=0.02)


@pytest.mark.slow
def test_two_hundred_plants_with_the_smallest_loss_are_charted_rightly():
    refused, empty, wrong = [], [], []
    for seed in range(200):
        loop = undamped_loop(seed)
        try:
            chart = lossy_chart(loop, SMALLEST)
        except HysteresisError:
            refused.append(seed)
            continue
        if not chart.stiffness_max > 0.0:
            empty.append(seed)
            continue
        inside, beyond, middle = counts_at_the_tip(loop, chart, SMALLEST)
        if not (abs(inside) < 0.05 and abs(middle) < 0.05 and beyond > 0.95):  # nan too
            wrong.append(seed)
    assert len(refused) <= 2  # clear walls far away, to which counts lose their digits
    assert (empty, wrong) == ([], [])
