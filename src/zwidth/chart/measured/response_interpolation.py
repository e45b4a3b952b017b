"""A measured response between its frequencies: smooth through every point, mirrored at 0 and at half the rate.

With m the poles of P at z = 1 and D whole samples of delay, G = P (z - 1)^m z^D has no singularity left at z = 1
and turns slowly. Cubic Hermite pieces with slopes of five points lead through G, 1/G or log G, whichever predicts
its neighbours best where the piece lies: near a zero of P that is G, near a pole 1/G, elsewhere the logarithm. The
error falls with the fourth power of the spacing. A real loop has P(conj z) = conj P(z), so that G continues beyond
both ends of the upper half circle as its own mirror image.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats, Ints
from zwidth.errors import ResponseError

MIRRORED = 3  # points repeated beyond an end
FEWEST = 6  # frequencies; fewer make no curve


@dataclass(frozen=True)
class ResponseInterpolation:
    """Cubic pieces of G, 1/G and log G over ascending nodes theta, and which of them each interval uses.

    values, slopes  (3, n) of G, 1/G and log G at the nodes, and by theta
    kind            (n - 1,) which of the three is interpolated there: 0, 1 or 2
    straight        (n - 1,) where G is taken straight from node to node instead; `error` is 0 there
    error           (n - 1,) relative error of P to be expected there: a 64th of what the cubic through four
                    neighbours misses a node by, which is the fourth derivative's part in both on even spacing
    closed          whether the response reaches half the sampling rate
    """

    nodes: Floats
    values: Complexes
    slopes: Complexes
    kind: Ints
    straight: Flags
    error: Floats
    integrators: int
    delay: int
    closed: bool

    def _interval_of(self, theta: Floats) -> Ints:
        """Index (...) of the interval between nodes that holds each angle."""
        return np.clip(np.searchsorted(self.nodes, theta, side="right") - 1, 0, len(self.nodes) - 2)

    def inverse(self, theta: Floats) -> Complexes:
        """Interpolated 1 / P (...) [N/m] at angles theta (...) in (0, pi]."""
        i = self._interval_of(theta)
        kind = self.kind[i]
        step = self.nodes[i + 1] - self.nodes[i]
        t = (theta - self.nodes[i]) / step
        u = 1.0 - t  # Hermite's cubic from the node before (t = 0) to that after (u = 0)
        value = u * u * ((1.0 + 2.0 * t) * self.values[kind, i] + t * step * self.slopes[kind, i])
        value += t * t * ((1.0 + 2.0 * u) * self.values[kind, i + 1] - u * step * self.slopes[kind, i + 1])
        value = np.where(self.straight[i], u * self.values[0, i] + t * self.values[0, i + 1], value)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            inverse = np.where(kind == 0, 1.0 / value, np.where(kind == 1, value, 0.0))
        inverse = np.where(kind == 2, np.exp(-np.where(kind == 2, value, 0.0)), inverse)
        return np.asarray(inverse * around_one(theta) ** self.integrators * np.exp(1j * self.delay * theta))

    def relative_error(self, theta: Floats) -> Floats:
        """Relative error of P (...) that interpolation is expected to leave."""
        return np.asarray(self.error[self._interval_of(theta)])


def around_one(theta: Floats) -> Complexes:
    """z - 1 = exp(i theta) - 1 without cancellation near 0."""
    s, c = np.sin(theta / 2.0), np.cos(theta / 2.0)
    return np.asarray(-2.0 * s * s + 2j * s * c)


def smooth_part(theta: Floats, P: Complexes, integrators: int) -> tuple[Complexes, int]:
    """G at measured angles (n,), and the whole delay D that it leaves out, from the mean fall of the phase."""
    G = P * around_one(theta) ** integrators
    phase = np.unwrap(np.angle(G))
    delay = max(int(np.round((phase[0] - phase[-1]) / (theta[-1] - theta[0]))), 0)
    return G * np.exp(1j * delay * theta), delay


def interpolate_response(
    theta: Floats,
    P: Complexes,
    integrators: int,
    *,
    closed: bool,
    measured_to_half_rate: bool = True,
    straight: Flags | None = None,
) -> ResponseInterpolation:
    """The interpolation through a response P (n,) at ascending angles (n,) in (0, pi].

    closed                 whether the last angle is near enough to pi for its mirror image to be the next point
    measured_to_half_rate  False: nothing was measured in the last stretch up to pi, so that no pole is read into
                           it: noise of the last points alone would say that there is one
    straight               (n - 1,) between which angles G is taken straight, its `error` then 0: curves through
                           noise run away
    Raises                 ResponseError  for fewer than FEWEST angles
    """
    if len(theta) < FEWEST:
        raise ResponseError(
            f"has {len(theta)} usable frequencies; at least {FEWEST} are needed, a few hundred for an "
            "accurate chart"
        )
    G, delay = smooth_part(theta, P, integrators)
    x, y = _with_mirror_images(theta, G, closed)
    with np.errstate(divide="ignore"):
        log = np.log(np.abs(y)) + 1j * np.unwrap(np.angle(y))
    kinds = np.where(np.isfinite(y) & (y != 0.0), np.array([y, 1.0 / np.where(y == 0.0, 1.0, y), log]), 0.0)
    missed = _missed_between(x, y, kinds)
    if closed and not measured_to_half_rate:  # from the last angle to its image: not 1/G, which could have a pole
        missed[1, MIRRORED + len(theta) - 1] = np.inf
    kind = np.argmin(missed, axis=0)
    slopes, error = np.array([_slopes(x, v) for v in kinds]), np.min(missed, axis=0) / 64.0
    lines = np.zeros(len(x) - 1, dtype=bool)
    if straight is not None:
        lines[MIRRORED : MIRRORED + len(straight)] = straight
    # what a straight piece of G misses is not told by a cubic: `MeasuredLoop.relative_error` has it from what was
    # measured between its ends, or beyond the data from how much the response changed before
    kind, error = np.where(lines, 0, kind), np.where(lines, 0.0, error)
    return ResponseInterpolation(x, kinds, slopes, kind, lines, error, integrators, delay, closed)


def _with_mirror_images(theta: Floats, G: Complexes, closed: bool) -> tuple[Floats, Complexes]:
    """Return angles (k,) [rad] and values (k,) of G (n,), with the mirror images of some beside 0 and, of a closed
    response, beside pi."""
    nodes, values = [-theta[MIRRORED - 1 :: -1], theta], [np.conj(G[MIRRORED - 1 :: -1]), G]
    if closed:
        at_end = np.pi - theta[-1] < 1e-9
        if at_end:  # G is real at pi, and not 0, which has no logarithm
            values[1] = np.append(G[:-1], G[-1].real or 1e-15 * abs(G[-2]))
        # pi is its own image
        near = slice(-2, -MIRRORED - 2, -1) if at_end else slice(None, -MIRRORED - 1, -1)
        nodes.append(2.0 * np.pi - theta[near])
        values.append(np.conj(G[near]))
    return np.concatenate(nodes), np.concatenate(values)


def _missed_between(x: Floats, y: Complexes, kinds: Complexes) -> Floats:
    """Return by how much (3, k - 1), relative, each kind (3, k) of G, 1 / G and log G misses the nodes on both
    sides of an interval: the larger of the two.

    x, y  (k,) angles [rad] and values of G
    """
    # what is next to nothing at half the sampling rate (a free mass) is measured by a fifth of its neighbours'
    # mean; what log G misses is relative already
    size = np.maximum(np.abs(y), 0.2 * np.mean(np.abs(y[_windows(len(y))[0]]), axis=1))
    missed = np.array(
        [
            _prediction_error(x, kinds[0], size),
            _prediction_error(x, kinds[1], kinds[1]),
            _prediction_error(x, kinds[2], 1.0),
        ]
    )
    return np.asarray(np.maximum(missed[:, :-1], missed[:, 1:]))


def _windows(n: int) -> tuple[Ints, Flags]:
    """Indices (n, 5) of five neighbouring nodes round each of n nodes, and which of the five is itself."""
    window = np.clip(np.arange(n) - 2, 0, n - 5)[:, None] + np.arange(5)
    return window, window == np.arange(n)[:, None]


def _slopes(x: Floats, y: Complexes) -> Complexes:
    """Derivative (n,) at each node x, y (n,) of the polynomial through it and four neighbours; any spacing."""
    window, here = _windows(len(x))
    scale, gaps = _products(x, window, here)
    # slopes of Lagrange's basis at the node; its own is the sum of 1 / gaps
    weights = scale[here][:, None] / (scale * gaps)
    weights[here] = np.sum(np.where(here, 0.0, 1.0 / gaps), axis=1)
    return np.asarray(np.sum(weights * y[window], axis=1))


def _prediction_error(x: Floats, y: Complexes, size: Floats | Complexes | float) -> Floats:
    """How far the cubic through its four neighbours misses each node x, y (n,), relative to `size` (n,) or a
    number."""
    window, here = _windows(len(x))
    scale, _ = _products(x, window, here)
    # Lagrange's basis on the four others, at the node: the fourth difference over the node's own weight
    weights = -scale[here][:, None] / scale
    weights[here] = 0.0
    predicted = np.sum(weights * y[window], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(np.abs(predicted - y) / np.abs(size), nan=np.inf))


def _products(x: Floats, window: Ints, here: Flags) -> tuple[Floats, Floats]:
    """For the windows of `_windows`, (n, 5) each: the product of each node's distances to the other four, and its
    distance from the node that the window is of, 1 for that itself."""
    at = x[window]
    apart = at[:, :, None] - at[:, None, :]
    apart[:, np.arange(5), np.arange(5)] = 1.0
    return np.prod(apart, axis=2), np.where(here, 1.0, x[:, None] - at)
