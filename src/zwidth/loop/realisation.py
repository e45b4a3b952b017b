"""States for the loop's factors, chosen so that eigenvalues of the transition matrix lose no digits.

Loops of one structure are realised together: as many rows, delayed forces and factors of the same orders, with
numbers that have leading axes (...).

States of many loops of a table: those of one structure are realised together.

A discrete filter, given by factors, in states: x_{j+1} = (1 + A) x_j + input u_j,  y = output x + direct u.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Floats, Ints
from zwidth.loop.estimator import Estimator
from zwidth.loop.loop_table import Filter, LoopTable
from zwidth.loop.pole_zero_form import SampledForm
from zwidth.loop.sections import Sections


@dataclass(frozen=True)
class StateSpace:
    """Z_{j+1} = (open - input (K position + B velocity)) Z_j, the wall force being u = -(K y + B v).

    open      (..., N, N)  transition matrix without a wall
    input     (..., N)     how the force enters
    position  (..., N)     y from the states;   velocity  (..., N)   v from the states
    """

    open: Floats
    input: Floats
    position: Floats
    velocity: Floats

    def transition_matrix(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Floats:
        """L (..., N, N) for walls K [N/m], B [N s/m] (...), whose axes broadcast with those of the loops."""
        K, B = np.asarray(wall_stiffness)[..., None], np.asarray(wall_damping)[..., None]
        feedback = K * self.position + B * self.velocity
        return self.open - self.input[..., :, None] * feedback[..., None, :]

    def __getitem__(self, index: Ints) -> StateSpace:
        """Some of the loops, by the first of their axes."""
        return StateSpace(self.open[index], self.input[index], self.position[index], self.velocity[index])


def pole_pair(d1: Floats | float, d0: Floats | float) -> tuple[Floats, Floats]:
    """A block (..., 2, 2) with the roots of d^2 + d1 d + d0 in d = z - 1, and its coupling t (...).

        [[1 + x, t], [-q/t, 1 + x]],    x = -d1/2,   q = d0 - x^2

    A complex pair gives a normal matrix (t = sqrt q), whose eigenvalues are perfectly conditioned. Of real roots t
    is at least |x|, their size: q is 0 where they are equal.
    """
    x = -0.5 * np.asarray(d1, dtype=np.float64)
    q = np.asarray(d0) - x * x
    t = np.maximum(np.sqrt(np.abs(q)), np.where(q > 0.0, 0.0, np.abs(x)))
    # A rigid pair has no scale of its own: any t serves, the eigenvalue solver balances it
    t = np.where(t > 0.0, t, 1.0)
    block = np.empty((*t.shape, 2, 2))
    block[..., 0, 0] = block[..., 1, 1] = 1.0 + x
    block[..., 0, 1], block[..., 1, 0] = t, -q / t
    return block, t


def _numerator_input(n1: Floats, n0: Floats, d1: Floats, t: Floats) -> Floats:
    """Input vector (..., 2) that gives (n1 d + n0)/(d^2 + d1 d + d0) from the first state of `pole_pair`.

    t  the block's coupling: with inputs i, j the first state is [ (d + d1/2) i + t j ] / (d^2 + d1 d + d0)
    """
    out = np.empty((*np.shape(t), 2))
    out[..., 0], out[..., 1] = n1, (n0 - d1 / 2.0 * n1) / t
    return out


@dataclass
class _Signal:
    """An affine function of the states and of the wall force u:  states (..., N) . Z + force u."""

    states: Floats
    force: Floats | float

    def drive(self, at: slice, gain: Floats, space: StateSpace) -> None:
        """Let the signal drive the k states `at`, each with its gain (..., k): added to `space` in place."""
        space.open[..., at, :] += gain[..., :, None] * self.states[..., None, :]
        space.input[..., at] += gain * np.asarray(self.force)[..., None]

    def scaled(self, factor: Floats) -> _Signal:
        """The signal times a factor (...)."""
        return _Signal(factor[..., None] * self.states, factor * self.force)


def orders(denominator: Floats) -> tuple[int, ...]:
    """Degree, 1 or 2, of each factor, rows (..., k, 3) d2, d1, d0 of d2 d^2 + d1 d + d0; the same for all loops
    that are realised together."""
    return tuple(2 if np.any(denominator[..., k, 0]) else 1 for k in range(denominator.shape[-2]))


def realise(sections: Sections, whole_delay: int, split: bool, force: Filter, estimator: Estimator) -> StateSpace:
    """Assemble plant sections, force path, delayed forces and the estimate's factors into one state vector.

    sections     of loops of one structure, rows (..., m, 9); their axes are those of the result
    whole_delay  samples
    split        whether the fractional part of the delay splits the hold
    force        factors of the force path, of the same degrees in all loops
    estimator    factors and window of the velocity estimate, likewise
    """
    queue, past_samples = whole_delay + split, estimator.window.shape[-1] - 1
    sizes = (_plant_states(sections), sum(orders(force.denominator)), queue, past_samples)
    # states in this order: plant, force path, forces that wait, past readings, factors of the velocity estimate
    N, loops = sum(sizes) + sum(orders(estimator.denominator)), sections.rows.shape[:-2]
    space = StateSpace(np.zeros((*loops, N, N)), *(np.zeros((*loops, N)) for _ in range(3)))
    first = np.cumsum((0, *sizes))
    command = _cascade(space, _Signal(np.zeros(N), 1.0), force.numerator, force.denominator, int(first[1]))
    late = _delay_line(space, command, queue, int(first[2]))
    reading = _plant_reading(space, sections, late[whole_delay], late[whole_delay + 1] if split else None)
    space.position[:] = reading
    past = _delay_line(space, _Signal(reading, 0.0), past_samples, int(first[3]))
    window = _Signal(np.zeros(N), 0.0)
    for k, signal in enumerate(past):
        window.states = window.states + estimator.window[..., k, None] * signal.states
    velocity = _cascade(space, window, estimator.numerator, estimator.denominator, int(first[4]))
    space.velocity[:] = velocity.states
    return space


def _plant_states(sections: Sections) -> int:
    """Number of states of the plant."""
    if sections.sampled_form is None:
        return 2 * int(sections.rows.shape[-2])
    return 2 * _rows_before_chain(sections) + len(sections.sampled_form.output)


def _rows_before_chain(sections: Sections) -> int:
    """Number of rows before the chain, which begins with the last row that is not divided by the one before it;
    all rows without a chain."""
    if sections.sampled_form is None:
        return int(sections.rows.shape[-2])
    return int(np.flatnonzero(sections.rows[:, CHAINED] == 0.0)[-1])


def _delay_line(space: StateSpace, signal: _Signal, count: int, start: int) -> list[_Signal]:
    """The signal and its `count` past values, newest first, each past one a state from number `start` on."""
    signals = [signal]
    for at in range(start, start + count):
        signals[-1].drive(slice(at, at + 1), np.ones(1), space)
        signals.append(_Signal(np.eye(1, space.open.shape[-1], at)[0], 0.0))
    return signals


def _plant_reading(space: StateSpace, sections: Sections, new: _Signal, old: _Signal | None) -> Floats:
    """Let wall forces drive the plant's states; returns the states' weights (..., N) in the reading.

    new, old  the force of the later part of the interval, and of its earlier part; None where nothing splits it
    """
    reading = np.zeros_like(space.position)
    leading = _rows_before_chain(sections)
    _row_states(space, sections.rows[..., :leading, :], new, old, reading)
    if sections.sampled_form is not None:
        _chain_states(space, sections.sampled_form, slice(2 * leading, _plant_states(sections)), new, old, reading)
    return reading


def _row_states(space: StateSpace, rows: Floats, new: _Signal, old: _Signal | None, reading: Floats) -> None:
    """Add two states for each of the rows (..., m, 9), and their weights to the reading (..., N), in place.

    In a chain each row drives the one before it, through that one's 1/(d^2 + d1 d + d0). new, old:
    `_plant_reading`; the rows' states are the first of the space.
    """
    before = np.zeros(2)  # input vector through which the row before is driven
    for k in range(rows.shape[-2]):
        d1, d0, n2, n1, n0, o2, o1, o0, chained = (rows[..., k, column] for column in range(9))
        at = slice(2 * k, 2 * k + 2)
        space.open[..., at, at], t = pole_pair(d1, d0)
        for signal, (c2, c1, c0) in ((new, (n2, n1, n0)), (old, (o2, o1, o0))):
            if signal is not None:
                # c2 passes the force on at once, the rest of the division goes through the states
                signal.drive(at, _numerator_input(c1 - c2 * d1, c0 - c2 * d0, d1, t), space)
                reading += c2[..., None] * signal.states
        if np.any(chained):
            space.open[..., 2 * k - 2 : 2 * k, 2 * k] += before
        else:
            reading[..., 2 * k] += 1.0
        before = _numerator_input(np.zeros(()), np.ones(()), d1, t)


def _chain_states(
    space: StateSpace, sampled: SampledForm, at: slice, new: _Signal, old: _Signal | None, reading: Floats
) -> None:
    """Add the states `at` of a sampled form, which stand for the chained rows, and their weights to the reading
    (..., N), in place.

    new, old  as of `_plant_reading`
    """
    space.open[at, at] = np.eye(len(sampled.output)) + sampled.growth
    reading[at] += sampled.output
    for signal, source, direct in ((new, sampled.new, sampled.direct_new), (old, sampled.old, sampled.direct_old)):
        if signal is not None:
            signal.drive(at, source, space)
            reading += direct * signal.states


def _cascade(space: StateSpace, signal: _Signal, numerator: Floats, denominator: Floats, start: int) -> _Signal:
    """The signal after a cascade of factors, rows (..., k, 3) c2, c1, c0 of c2 d^2 + c1 d + c0, whose states begin
    at number `start`."""
    at = start
    for k, order in enumerate(orders(denominator)):
        c2, c1, c0 = (numerator[..., k, column] for column in range(3))
        d1, d0 = denominator[..., k, 1], denominator[..., k, 2]
        # polynomial division: the highest coefficient passes the signal on, what remains is read from the states
        if order == 1:
            signal.drive(slice(at, at + 1), np.ones(1), space)
            space.open[..., at, at] += 1.0 - d0
            signal = signal.scaled(c1)
            signal.states[..., at] += c0 - c1 * d0
        else:
            block, t = pole_pair(d1, d0)
            pair = slice(at, at + 2)
            space.open[..., pair, pair] += block
            signal.drive(pair, _numerator_input(c1 - c2 * d1, c0 - c2 * d0, d1, t), space)
            signal = signal.scaled(c2)
            signal.states[..., at] += 1.0
        at += order
    return signal


CHAINED = 8  # column of a row that is 1 where it is chained
LEADING = 3  # column d2 of `LoopTable.force` and `velocity`, 0 of a factor of first order


def state_spaces(loops: LoopTable, which: Ints) -> Iterator[tuple[Ints, StateSpace]]:
    """Some of the loops, by structure: the places (p,) in `which` of those of one structure, and their states,
    each array (p, ...).

    which   (n,)  numbers of loops; those that have no sections are left out
    Raises  ValueError  for chained sections: `Loop.state_space` has better states than their rows
    """
    if np.any(loops.rows[which, :, CHAINED]):
        raise ValueError("chained sections are realised one loop at a time, by Loop.state_space")
    kinds, kind_of = np.unique(_structure(loops, which), axis=0, return_inverse=True)
    for kind, (section_count, *_) in enumerate(kinds):
        places = np.flatnonzero(kind_of.ravel() == kind)
        if section_count:
            yield places, _states(loops, which[places])


def _structure(loops: LoopTable, which: Ints) -> Ints:
    """Numbers (n, s) of each loop that are equal in loops that are realised together: the number of sections
    first, then those of its computer, last whether each factor is of second order."""
    computers = loops.computer[which]
    counts = (loops.whole_delay, loops.split, loops.force_count, loops.velocity_count, loops.window_count)
    second_order = [factors[computers, :, LEADING] != 0.0 for factors in (loops.force, loops.velocity)]
    return np.column_stack(
        [loops.section_count[which], *(count[computers] for count in counts), *second_order]
    ).astype(np.int64)


def _states(loops: LoopTable, which: Ints) -> StateSpace:
    """States of the loops `which` (n,), all of one structure, whose counts are those of the first."""
    computers, one = loops.computer[which], loops.computer[which[0]]
    force = loops.force[computers, : loops.force_count[one]]
    velocity = loops.velocity[computers, : loops.velocity_count[one]]
    return realise(
        Sections(loops.rows[which, : loops.section_count[which[0]]], ()),
        int(loops.whole_delay[one]),
        bool(loops.split[one]),
        Filter(force[..., :3], force[..., 3:]),
        Estimator(velocity[..., :3], velocity[..., 3:], loops.window[computers, : loops.window_count[one]]),
    )


@dataclass(frozen=True)
class FilterStates:
    """H(z) = direct + output (d - A)^-1 input,  d = z - 1.

    A (k, k), input (k,), output (k,), direct
    """

    A: Floats
    input: Floats
    output: Floats
    direct: float

    def response(self, z: ArrayLike, d: ArrayLike | None = None) -> tuple[Complexes, Complexes]:
        """H(z) and dH/dz (...) at complex z (...); d is z - 1 where that is known to more digits than z has."""
        z = np.asarray(z, dtype=complex)
        away = z - 1.0 if d is None else np.asarray(d, dtype=complex)
        if not len(self.A):
            return np.full(z.shape, complex(self.direct)), np.zeros(z.shape, dtype=complex)
        resolvent = away[..., None, None] * np.eye(len(self.A)) - self.A
        inner = np.linalg.solve(resolvent, np.broadcast_to(self.input[:, None], (*z.shape, len(self.A), 1)))
        slope = -np.linalg.solve(resolvent, inner)
        value_and_slope = self.direct + (self.output @ inner)[..., 0], (self.output @ slope)[..., 0]
        return np.asarray(value_and_slope[0], dtype=complex), np.asarray(value_and_slope[1], dtype=complex)


def filter_states(numerator: Floats, denominator: Floats, window: Floats) -> FilterStates:
    """States of a window and a product of factors in series, the window first.

    numerator, denominator  (k, 3)  rows c2, c1, c0 of  c2 d^2 + c1 d + c0;  denominators monic, of at least the
                                    numerator's degree
    window                  (n,)    weights of the newest to the oldest sample

    >>> half = filter_states(np.empty((0, 3)), np.empty((0, 3)), np.array([0.5, 0.5]))           # (1 + 1/z) / 2
    >>> complex(half.response(2.0)[0])
    (0.75+0j)
    """
    orders = [2 if row[0] != 0.0 else 1 for row in denominator]
    past = len(window) - 1
    N = past + sum(orders)
    A, source = np.zeros((N, N)), np.zeros(N)
    signal, direct = np.zeros(N), float(window[0])  # what has passed so far: signal . states + direct u
    for k in range(past):
        A[k, k] = -1.0  # a past sample: x_{j+1} = x_j + A x_j + ... keeps nothing of its own
        if k:
            A[k, k - 1] = 1.0
        else:
            source[0] = 1.0
        signal[k] = window[k + 1]
    at = past
    for (c2, c1, c0), (_, d1, d0), order in zip(numerator, denominator, orders, strict=True):
        # numerator/denominator = pass_on + leave (d - block)^-1 enter
        if order == 1:
            block, enter, leave, pass_on = np.array([[-d0]]), np.ones(1), np.array([c0 - c1 * d0]), c1
        else:
            pair, t = pole_pair(d1, d0)
            block, pass_on = pair - np.eye(2), c2
            n1, n0 = c1 - c2 * d1, c0 - c2 * d0
            enter, leave = np.array([n1, (n0 - d1 / 2.0 * n1) / t]), np.array([1.0, 0.0])
        here = slice(at, at + order)
        A[here] += np.outer(enter, signal)
        A[here, here] += block
        source[here] += enter * direct
        signal, direct = pass_on * signal, pass_on * direct
        signal[here] += leave
        at += order
    return FilterStates(A, source, signal, float(direct))
