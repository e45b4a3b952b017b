"""Rate-hardness of a sampled wall as felt at the handle: how steeply the force rises on contact.

Lawrence, Pao, Dougherty, Salada and Pavlou (Rate-hardness: a new performance metric for haptic interfaces, IEEE
Transactions on Robotics and Automation 16(4), 2000; the abstract was read, the definition is known at second hand)
judge hard surfaces by the initial rate of change of force over the initial velocity of penetration, in N/s per
m/s. A sampled wall answers only after a sample and the delay, so that its rate at the very beginning is 0. Here it
is the steepest mean rate since the contact:

    H = sup over t > 0 of dF(t)/(v t)

The hand moves the handle through the surface with a constant velocity v, and the device has moved with it before.
dF is the force that it feels beyond that of free motion. The contact happens just after a sample, which does not
see it: the least favourable moment. An ideal spring and damper behind a filter B s/(tau s + 1) has H = K + B/tau,
its initial rate. A rigid device with the force d late has

    H = max(K, (B + K T)/(T + d))

the chord to the first force. With the handle's motion given, the rest of the device moves, in modes of unit mass
with the participations h, a, s of handle, actuator and sensor, by

    x'' = Pi (a u - D x' - W x),     Pi = 1 - h h^T/(h^T h),     dF = h^T (D x' + W x - a u)/(h^T h)

from rest, since it deforms by nothing but the wall's force u; the sensor reads r v t + s^T x, r being the sensor's
motion per motion of the handle when the device moves as one. Commands K y + B w(y), from sample to sample, are
filtered, delayed and held as the computer does; between samples the motion is exact.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_apart, compiled_lean
from zwidth.loop.loop_table import LoopTable
from zwidth.model.rendered_modes import RenderedModes
from zwidth.resources import in_chunks

LEAST_SAMPLES, MOST_SAMPLES = 64, 4096  # after the contact
PERIODS: Final = 2.0  # of the slowest flexible mode, that are simulated
FINEST: Final = 24  # places between a sample and the next at which the force is looked at
TERMS: Final = 14  # of the exponential series, of a matrix of norm below a half


def rate_hardness(
    loops: LoopTable, modes: RenderedModes, rows: Ints, delay: Floats, lag: Floats, K: Floats, B: Floats
) -> Floats:
    """Rate-hardness of walls for some devices.

    loops, modes  of N devices
    rows          (n,)  which of them
    delay, lag    (N,)  of the force [samples], and of the actuator [s]
    K, B          (n,)  of the walls [N/m], [N s/m]
    Returns       (n,)  [N/m]; nan for a device that a spring ties to the ground, which cannot move freely before
    """
    some = modes.rows(rows)
    m = some.handle.shape[1]
    drag = np.zeros((len(rows), m, m))
    drag[:, range(m), range(m)] = 2.0 * some.decay
    if some.drag is not None and some.coupled is not None:
        drag[some.coupled] = some.drag[some.coupled]
    out = np.empty(len(rows))
    lagging = int(np.any(lag > 0.0))
    of_modes = some.frequency_squared, drag, some.handle, some.input, some.output

    def several(first: int, last: int) -> None:
        _fill_steepest_rates(loops, rows, *of_modes, delay[rows], lag[rows], lagging, K, B, out, first, last)

    in_chunks(several, len(rows))
    return np.maximum(out, _stiffness_at_rest(some, K))  # which the mean rate comes near after long


def _stiffness_at_rest(modes: RenderedModes, K: Floats) -> Floats:
    """Felt stiffness at rest (n,) [N/m], which the mean rate approaches: 1/(h^T (W + K a s^T)^-1 h)."""
    w2, h, a, s = modes.frequency_squared, modes.handle, modes.input, modes.output
    still = (w2 == 0.0) & (h == 0.0) & (a == 0.0) & (s == 0.0)  # filled up, of a plant with fewer modes
    whole = (
        np.where(still, 1.0, w2)[..., None] * np.eye(w2.shape[1]) + K[:, None, None] * a[..., None] * s[:, None]
    )
    # without a wall the matrix is singular: felt with 0
    free = K == 0.0
    whole[free] = np.eye(w2.shape[1])
    compliance = np.einsum("nk,nk->n", h, np.linalg.solve(whole, h[..., None])[..., 0])
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(free, 0.0, 1.0 / compliance))


@compiled
def _fill_steepest_rates(
    loops: LoopTable,
    rows: Ints,
    w2: Floats,
    drag: Floats,
    h: Floats,
    a: Floats,
    s: Floats,
    delay: Floats,
    lag: Floats,
    lagging: int,
    K: Floats,
    B: Floats,
    out: Floats,
    first: int,
    last: int,
) -> None:
    """Fill out[first:last] with the steepest mean rates of devices `rows`, one after the other [N/m].

    loops              of all devices, of which `rows` (n,) are numbers; all else has a row for each of these
    w2, drag, h, a, s  (n, ...)  W, D, handle, actuator and sensor of their modes, see the module
    delay, lag         (n,)  [samples], [s];   lagging  1 where the lag is the last factor of the loops' force path
    K, B               (n,)  of the walls
    """
    m = w2.shape[1]
    n = 2 * m + 2
    A, E, F = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    work, state, after = np.empty((3, n, n)), np.empty(n), np.empty(n)
    queue = np.empty(int(delay.max()) + 3)
    past = np.empty(loops.window.shape[1] + 1)
    memory = np.empty((loops.velocity.shape[1] + loops.force.shape[1] + 1, 2))
    for k in range(first, last):
        c = loops.computer[rows[k]]
        modes = w2[k], drag[k], h[k], a[k], s[k]
        out[k] = _steepest_rate(
            loops, c, modes, delay[k], lag[k], lagging, K[k], B[k],
            A, E, F, work, state, after, queue, past, memory,
        )  # fmt: skip


@compiled_apart
def _steepest_rate(
    loops: LoopTable,
    c: int,
    modes: tuple[Floats, Floats, Floats, Floats, Floats],
    delay: float,
    lag: float,
    lagging: int,
    K: float,
    B: float,
    A: Floats,
    E: Floats,
    F: Floats,
    work: Floats,
    state: Floats,
    after: Floats,
    queue: Floats,
    past: Floats,
    memory: Floats,
) -> float:
    """The steepest mean rate of one device with computer c [N/m], v = 1; nan where no free motion moves the
    handle.

    modes  w2, drag, h, a and s, as of `_fill_steepest_rates`, which also has delay, lag and lagging
    A, E, F, work, state, after, queue, past, memory  working memory: the generator, its exponentials over an early
           and a late piece, room, the state and the next one, commands, readings, and states of the filters
    """
    w2, drag, h, a, s = modes
    m, T = len(w2), loops.period[c]
    whole = loops.whole_delay[c]
    fraction = max(delay - whole, 0.0) if loops.split[c] else 0.0
    # hh: h.h;   moved, read: h.h and h.s of the free motions;   slowest, fastest: rates of the others [rad/s]
    hh, moved, read, slowest, fastest = 0.0, 0.0, 0.0, np.inf, 0.0
    for k in range(m):
        hh += h[k] * h[k]
        fastest = max(fastest, abs(drag[k, k]))
        if w2[k] == 0.0:
            moved, read = moved + h[k] * h[k], read + h[k] * s[k]
        else:
            slowest, fastest = min(slowest, np.sqrt(abs(w2[k]))), max(fastest, np.sqrt(abs(w2[k])))
    if not moved > 1e-12 * hh:
        return np.nan
    ratio = read / moved  # r: the sensor's motion per motion of the handle
    samples = LEAST_SAMPLES
    if slowest < np.inf:
        samples = max(samples, min(MOST_SAMPLES, int(PERIODS * 2.0 * np.pi / (slowest * T)) + 1))
    if lag > 0.0:
        fastest = max(fastest, 1.0 / lag)
    # so many that in a quarter of the fastest vibration there would be FINEST, but no more than FINEST in a
    # sample, or in each of the two parts that a delay makes of it
    pieces = min(FINEST, 1 + int(2.0 * FINEST * fastest * T / np.pi))
    _fill_generator(w2, drag, h, a, hh, lag, A)
    early, late = (1.0 - fraction) * T / pieces, fraction * T / pieces
    _exponential(A, early, m, E, work)
    if fraction > 0.0:
        _exponential(A, late, m, F, work)
    state[:], past[:], memory[:, :], queue[:] = 0.0, 0.0, 0.0, 0.0
    steepest = 0.0
    # up to the first sample after the contact nothing pushes; from a sample on the old command acts for the pieces
    # of length `late`, then the new one for those of length `early`
    for k in range(1, samples + 1):
        y = 0.0
        for j in range(m):
            y += s[j] * state[j]
        # of the steady motion r t, which was there before the contact, the estimate is r itself
        speed = ratio + _velocity_estimate(loops, c, y, past, memory)
        force = -_filtered_command(loops, c, lagging, K * (ratio * k * T + y) + B * speed, memory)
        for j in range(whole, 0, -1):
            queue[j] = queue[j - 1]
        queue[0] = force
        for piece in range(pieces if fraction > 0.0 else 0):
            _advance(F, state, after)
            steepest = max(steepest, _felt_force(w2, drag, h, a, hh, state) / (k * T + (piece + 1) * late))
        state[2 * m + 1] = queue[whole]
        if lag == 0.0:
            state[2 * m] = queue[whole]
        steepest = max(steepest, _felt_force(w2, drag, h, a, hh, state) / ((k + fraction) * T))
        for piece in range(pieces):
            _advance(E, state, after)
            steepest = max(
                steepest, _felt_force(w2, drag, h, a, hh, state) / ((k + fraction) * T + (piece + 1) * early)
            )
    return steepest


@compiled_lean
def _fill_generator(w2: Floats, drag: Floats, h: Floats, a: Floats, hh: float, lag: float, A: Floats) -> None:
    """Fill A with d/dt of the state: x (m), x' (m), the actuator's force and the commanded one, the handle held.

    w2, drag, h, a  as of `_fill_steepest_rates`, of one device;   hh  h.h
    lag             of the actuator [s]; 0: none, the force is set by the caller
    """
    m = len(w2)
    n = 2 * m + 2
    for i in range(n):
        for j in range(n):
            A[i, j] = 0.0
    for i in range(m):
        A[i, m + i] = 1.0
        for j in range(m):
            A[m + i, j] -= w2[i] if i == j else 0.0
            A[m + i, m + j] -= drag[i, j]
        A[m + i, 2 * m] += a[i]
    # less the part along the handle
    for j in range(n):
        along = 0.0
        for i in range(m):
            along += h[i] * A[m + i, j]
        for i in range(m):
            A[m + i, j] -= h[i] * along / hh
    if lag > 0.0:
        A[2 * m, 2 * m], A[2 * m, 2 * m + 1] = -1.0 / lag, 1.0 / lag


@compiled_lean
def _exponential(A: Floats, time: float, m: int, out: Floats, work: Floats) -> None:
    """Fill out (n, n) with exp(A time), by its series after halving and by squaring.

    m  modes; their velocities, states m to 2 m - 1, are taken in metres per `time`;   work  (3, n, n)
    """
    n = A.shape[0]
    M, term, other = work[0], work[1], work[2]
    norm = 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            scale = (time if m <= i < 2 * m else 1.0) / (time if m <= j < 2 * m else 1.0)
            M[i, j] = A[i, j] * time * scale
            row += abs(M[i, j])
        norm = max(norm, row)
    halvings = 0
    while norm > 0.5:
        norm, halvings = 0.5 * norm, halvings + 1
    factor = 0.5**halvings
    for i in range(n):
        for j in range(n):
            M[i, j] *= factor
            out[i, j] = 1.0 if i == j else 0.0
            term[i, j] = out[i, j]
    for k in range(1, TERMS + 1):
        _multiply(term, M, other)
        for i in range(n):
            for j in range(n):
                term[i, j] = other[i, j] / k
                out[i, j] += term[i, j]
    for _ in range(halvings):
        _multiply(out, out, other)
        for i in range(n):
            for j in range(n):
                out[i, j] = other[i, j]
    for i in range(n):
        for j in range(n):
            out[i, j] *= (time if m <= j < 2 * m else 1.0) / (time if m <= i < 2 * m else 1.0)


# fills out (n, n) with the product A B
@compiled_lean
def _multiply(A: Floats, B: Floats, out: Floats) -> None:
    n = A.shape[0]
    for i in range(n):
        for j in range(n):
            value = 0.0
            for k in range(n):
                value += A[i, k] * B[k, j]
            out[i, j] = value


@compiled_lean
def _advance(E: Floats, state: Floats, after: Floats) -> None:
    """Move the state one piece on, by its transition E; `after` is working memory."""
    n = len(state)
    for i in range(n):
        value = 0.0
        for j in range(n):
            value += E[i, j] * state[j]
        after[i] = value
    for i in range(n):
        state[i] = after[i]


@compiled_lean
def _felt_force(w2: Floats, drag: Floats, h: Floats, a: Floats, hh: float, state: Floats) -> float:
    """Force that the hand feels beyond that of free motion [N], from a state of `_fill_generator`."""
    m, force = len(w2), 0.0
    for i in range(m):
        of_mode = w2[i] * state[i] - a[i] * state[2 * m]
        for j in range(m):
            of_mode += drag[i, j] * state[m + j]
        force += h[i] * of_mode
    return float(force / hh)


@compiled_lean
def _velocity_estimate(loops: LoopTable, c: int, y: float, past: Floats, memory: Floats) -> float:
    """Velocity estimate of computer c after another reading y; `past` and `memory` are moved on."""
    count = loops.window_count[c]
    for j in range(count - 1, 0, -1):
        past[j] = past[j - 1]
    past[0] = y
    value = 0.0
    for j in range(count):
        value += loops.window[c, j] * past[j]
    for k in range(loops.velocity_count[c]):
        value = _filter_sample(loops.velocity[c, k], value, memory[k])
    return value


@compiled_lean
def _filtered_command(loops: LoopTable, c: int, lagging: int, force: float, memory: Floats) -> float:
    """A command [N] through the force filter; the actuator's lag, the last factor if `lagging`, is left out."""
    before, value = loops.velocity.shape[1], force
    for k in range(loops.force_count[c] - lagging):
        value = _filter_sample(loops.force[c, k], value, memory[before + k])
    return value


@compiled_lean
def _filter_sample(factor: Floats, value: float, memory: Floats) -> float:
    """A sample through (c2 d^2 + c1 d + c0)/(d2 d^2 + d1 d + d0), d = z - 1, in transposed direct form II.

    factor  c2, c1, c0, d2, d1, d0;   memory  (2,)  is moved on
    """
    # as (b0 + b1/z + b2/z^2)/(1 + a1/z + a2/z^2)
    c2, c1, c0, d2, d1, d0 = factor[0], factor[1], factor[2], factor[3], factor[4], factor[5]
    if d2 != 0.0:
        b0, b1, b2 = c2 / d2, (c1 - 2.0 * c2) / d2, (c2 - c1 + c0) / d2
        a1, a2 = (d1 - 2.0 * d2) / d2, (d2 - d1 + d0) / d2
    else:
        b0, b1, b2 = c1 / d1, (c0 - c1) / d1, 0.0
        a1, a2 = (d0 - d1) / d1, 0.0
    out = b0 * value + memory[0]
    memory[0] = b1 * value - a1 * out + memory[1]
    memory[1] = b2 * value - a2 * out
    return float(out)
