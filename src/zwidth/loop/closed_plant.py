"""The sampled plant with the computer's fixed feedback closed, from the wall's force to the reading.

Fixed are force sensor, feedforward and local loop, and what a load adds: the wall's constant force, which turns
with the counted posture (`model.plant.SampledForce`).

All of it is linear, and it repeats itself every sampling period T, at two rates, too. So one period is gone
through once, in order: readings, estimates and commands at the samples, the plant's exact growth in between. Every
signal on the way is a row: what the states at the beginning of the period, and the wall's force, contribute to it.
What the period adds to the states is the closed plant,

    X_{j+1} = (1 + E) X_j + g u_j,        y_j = c X_j.

Rows are kept of what has been added to each state, so that E is known to all digits where X hardly changes.

At a sample everything is read first: the measured force is the one just before the new command acts.

The closed plant in the form in which kernels take a loop: one section, and factors of the force's path.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.errors import ModelError, UnmovedError, UnresolvedError
from zwidth.loop.controller import Controller, Feedforward, ForceSensor, LocalLoop, LowPass, acts, split_delay
from zwidth.loop.estimators import LinearMethod
from zwidth.loop.hold import lag_share
from zwidth.loop.loop_table import Filter, LoopTable, factor_roots, loop_table, low_pass_factors
from zwidth.loop.plant_states import PlantStates, SampledInput, plant_states
from zwidth.loop.pole_zero_form import PoleZeroForm, SampledForm, pole_zero_form
from zwidth.loop.realisation import FilterStates, filter_states
from zwidth.loop.sections import Sections
from zwidth.model.plant import Plant, check_no_loss_factor

SAMPLE, SLOW, FAST, END = range(4)  # what happens in a period, in this order at one instant
SAME_INSTANT = 1e-12  # shares of the period within which two instants are one


def measured_force(plant: Plant, sensor: ForceSensor) -> Floats:
    """What a sensor between device and hand reads per x'', x' and x (3, n): the hand's force, less what the mass
    between them takes,  f = f_hand - mass_beyond h . x''.

    Raises  ModelError  for a plant without a handle, or with less mass there than beyond the sensor
    """
    h = plant.handle
    if h is None:
        raise ModelError(
            "a force sensor sits at the handle, and the plant has none; give plant.handle, choose a model with a "
            "handle, or leave force_sensor out"
        )
    rows = np.zeros((3, plant.size)) if plant.hand_force is None else plant.hand_force.copy()
    device = plant.mass + np.outer(h, rows[0])  # without the arm of a rigid grasp
    at_handle = 1.0 / float(h @ np.linalg.solve(device, h))  # the effective mass there
    if not sensor.mass_beyond < at_handle:
        raise ModelError(
            f"mass_beyond is {sensor.mass_beyond:.6g} kg, and must be less than the device's mass at the handle, "
            f"{at_handle:.6g} kg, of which it is a part"
        )
    rows[0] -= sensor.mass_beyond * h
    return np.asarray(rows)


def close_plant(plant: Plant, controller: Controller) -> tuple[SampledForm, PlantStates]:
    """The sampled plant with all fixed feedback of a computer closed, and the plant's own states.

    Returns  a form without states where the force moves nothing that shows in a reading
    Raises   ModelError  for a force sensor where none can be
    """
    local, sensor = controller.local_loop, controller.force_sensor
    fast = local.rate_multiple if local is not None and acts(local) else 1
    rows = measured_force(plant, sensor) if sensor is not None and acts(sensor) else None
    states = plant_states(plant, controller.sampling_period / fast, rows, controller.force_filter)
    return closed_form(states, controller), states


def closed_form(states: PlantStates, controller: Controller) -> SampledForm:
    """The sampled plant with all fixed feedback of a computer closed, from the states of the plant."""
    if not len(states.output):
        none = np.zeros(0)
        return SampledForm(np.zeros((0, 0)), none, none, none, 0.0, 0.0)
    return _Period(states, controller).closed()


def path_responses(plant: Plant, controller: Controller, d: Complexes) -> tuple[Complexes, Complexes]:
    """Responses (...) of the reading, and of the measured force without a hand, 0 without a sensor, to a command
    in front of the force filter, at z = 1 + d (...): nothing closed but the local loop, and what a load adds.

    plant  without an operator
    """
    sensor = controller.force_sensor
    rows = None if sensor is None else measured_force(plant, sensor)
    states = plant_states(plant, controller.sampling_period, rows, controller.force_filter)
    period = _Period(states, replace(controller, feedforward=None, force_sensor=None), measures=rows is not None)
    form = period.closed()
    resolvent = d[..., None, None] * np.eye(len(form.new)) - form.growth
    moved = np.linalg.solve(resolvent, np.broadcast_to(form.new[:, None], (*d.shape, len(form.new), 1)))[..., 0]
    measured = period.measured if period.measured is not None else np.zeros(len(form.new))
    return np.asarray(moved @ form.output), np.asarray(moved @ measured)


class _StateRows:
    """The states of a loop as rows: what those at the beginning of a period, and the wall's force, contribute.

    change  (N, N + 1)  what has been added to each state so far; the last column is of the wall's force
    """

    def __init__(self) -> None:
        self.size = 0

    def add(self, count: int) -> slice:
        """Make room for more states. Returns their places."""
        self.size += count
        return slice(self.size - count, self.size)

    def begin(self) -> Floats:
        """Set all states to those at the beginning of a period. Returns the row (N + 1,) of the wall's force."""
        self.change, self.start = np.zeros((self.size, self.size + 1)), np.eye(self.size, self.size + 1)
        return np.asarray(np.eye(1, self.size + 1, self.size)[0])

    def current(self, at: slice) -> Floats:
        """Rows (k, N + 1) of some states at this instant: those at the beginning of the period, and what has been
        added to them since."""
        return np.asarray(self.start[at] + self.change[at])


class _FilterRows:
    """A discrete filter whose states are some of the rows."""

    def __init__(self, rows: _StateRows, states: FilterStates) -> None:
        self.rows, self.states, self.at = rows, states, rows.add(len(states.A))

    def output(self, signal: Floats) -> Floats:
        """Row (N + 1,) of a signal (N + 1,) behind the filter, whose states go on by one sample."""
        space, now = self.states, self.rows.current(self.at)
        self.rows.change[self.at] += space.A @ now + np.outer(space.input, signal)
        return np.asarray(space.output @ now + space.direct * signal)


class _QueueRows:
    """The last `count` values of a signal, which are some of the rows, the newest first."""

    def __init__(self, rows: _StateRows, count: int) -> None:
        self.rows, self.at = rows, rows.add(count)

    def push(self, signal: Floats) -> Floats:
        """Put a signal's row at the head. Returns its rows and those of its past values, the newest first."""
        values = np.vstack([signal, self.rows.current(self.at)])
        self.rows.change[self.at] = values[:-1] - self.rows.start[self.at]
        return values

    def past(self) -> Floats:
        """Rows of the past values, the newest first."""
        return self.rows.current(self.at)


class _HeldRows:
    """Commands that wait for a delay of whole samples and a part of one, and are then held.

    last  whether the one that acts at the end of a sample is kept even if none waits
    """

    def __init__(self, rows: _StateRows, delay: float, last: bool) -> None:
        self.whole, self.part = split_delay(delay)
        self.queue = _QueueRows(rows, self.whole + (last or self.part > 0.0))

    def before(self) -> Floats:
        """Row (N + 1,) of the command that acts just before the next sample."""
        return np.asarray(self.queue.past()[self.whole])

    def push(self, command: Floats) -> tuple[Floats, Floats]:
        """Queue a command. Returns rows of the commands that act before and after the delay's part of a sample."""
        values = self.queue.push(command)
        return values[self.whole + (self.part > 0.0)], values[self.whole]


class _LoadRows:
    """A force that the computer adds under load: what it reads of the states, filtered, delayed and held."""

    def __init__(self, rows: _StateRows, sampled: SampledInput, controller: Controller, keeps: bool) -> None:
        """Add rows for filter and delay; `keeps`: the sensor reads the force that acts just before a sample."""
        self.sampled = sampled
        self.filter = None
        if sampled.filter is not None:
            self.filter = _FilterRows(rows, low_pass_states(sampled.filter, controller.sampling_period))
        self.held = _HeldRows(rows, controller.delay, keeps and sampled.direct != 0.0)

    def read(self, states: Floats) -> tuple[Floats, Floats]:
        """Read the plant's states at a sample and queue the load's force that follows. Returns rows of the forces
        that act before and after the delay's part of a sample."""
        signal = np.asarray(self.sampled.reading @ states)
        return self.held.push(signal if self.filter is None else self.filter.output(signal))


class _SlowCommand:
    """The command of the wall's loop: wall, force feedback and feedforward, through the force filter."""

    def __init__(self, rows: _StateRows, controller: Controller) -> None:
        """Add rows for the force filter, and for filters and delays of the feedback that acts."""
        T, self.sensor, self.ahead = controller.sampling_period, controller.force_sensor, controller.feedforward
        self.on_force = _FilterRows(rows, low_pass_states(controller.force_filter, T))
        self.period = T
        if self.sensor is not None and acts(self.sensor):
            self.late = _QueueRows(rows, self.sensor.delay)
            self.on_sensor = _FilterRows(rows, low_pass_states(self.sensor.filter, T))
        if self.ahead is not None and acts(self.ahead):
            self.velocity = _FilterRows(rows, estimate_states(self.ahead.velocity, self.ahead.velocity_filter, T))
            if self.ahead.inertia:
                self.before = _QueueRows(rows, 1)
                self.acceleration = _FilterRows(rows, low_pass_states(self.ahead.acceleration_filter, T))

    def of(self, wall: Floats, reading: Floats, measured: Floats | None) -> Floats:
        """Row (N + 1,) of the command of a sample, from those of the wall's force, the reading and the measured
        force; None for the last where it is not measured."""
        command = wall
        if self.sensor is not None and measured is not None:
            known = self.late.push(measured)[-1]  # by the sensor's delay old
            if self.sensor.law == "force-error":
                known = known + wall
            command = command + self.sensor.gain * self.on_sensor.output(known)
        if self.ahead is not None and acts(self.ahead):
            velocity = self.velocity.output(reading)
            command = command + self.ahead.damping * velocity
            if self.ahead.inertia:
                change = (velocity - self.before.push(velocity)[1]) / self.period
                command = command + self.ahead.inertia * self.acceleration.output(change)
        return self.on_force.output(command)


class _Period:
    """One sampling period of a loop with its fixed feedback.

    measures  whether the force at the handle is measured, with or without a feedback of it
    measured  its weights of the states at the beginning, once the period is closed
    """

    def __init__(self, states: PlantStates, controller: Controller, measures: bool = False) -> None:
        """Add rows for the states of the plant, a lagged force, all filters and all commands that wait."""
        self.states, self.controller = states, controller
        lag, sensor, local = controller.actuator_time_constant, controller.force_sensor, controller.local_loop
        self.measures = measures or (sensor is not None and acts(sensor))
        self.measured: Floats | None = None
        # the force just before a sample is an older command, which then has to be kept
        keeps = self.measures and lag == 0.0 and states.force_direct != 0.0
        self.rows = _StateRows()
        self.at = self.rows.add(len(states.output))
        self.force_at = self.rows.add(1 + len(states.sampled) if lag > 0.0 else 0)
        self.command = _SlowCommand(self.rows, controller)
        self.slow = _HeldRows(self.rows, controller.delay, keeps)
        self.loads = [_LoadRows(self.rows, load, controller, self.measures) for load in states.sampled]
        self.local = local if local is not None and acts(local) else None
        if self.local is not None:
            T = controller.sampling_period / self.local.rate_multiple
            if self.local.damping:
                states_of_it = estimate_states(self.local.velocity, self.local.velocity_filter, T)
                self.fast_velocity = _FilterRows(self.rows, states_of_it)
            self.fast = _HeldRows(self.rows, self.local.delay, keeps)

    def closed(self) -> SampledForm:
        """What one period adds to the states, per state and per newton of the wall's force at its beginning, and
        the reading: the closed plant. Sets `measured`, and begins the rows anew."""
        wall = self.rows.begin()
        reading = self._reading()
        measured = self._measured_force() if self.measures else None
        if measured is not None:
            self.measured = measured[: self.rows.size].copy()
        # of each force of a load: (what acts now, what acts after the delay's part of a sample); read before any
        # command of this period acts
        of_loads = [load.read(self.rows.current(self.at)) for load in self.loads]
        slow, later = self.slow.push(self.command.of(wall, reading, measured))
        fast = fast_later = np.zeros_like(wall)
        at = 0.0
        for share, event in self._instants():
            if share - at > SAME_INSTANT:
                commands = np.array([slow + fast, *(before for before, _ in of_loads)])
                self._advance((share - at) * self.controller.sampling_period, commands)
                at = share
            if event == SAMPLE:
                fast, fast_later = self.fast.push(self._fast_command())
            elif event == SLOW:
                slow, of_loads = later, [(after, after) for _, after in of_loads]
            elif event == FAST:
                fast = fast_later
        N = self.rows.size
        nothing = np.zeros(N)  # no old force: commands that wait are states
        return SampledForm(
            self.rows.change[:, :N].copy(), self.rows.change[:, N].copy(), nothing, reading[:N], 0.0, 0.0
        )

    def _instants(self) -> list[tuple[float, int]]:
        """Times, in shares of the period, and kinds of its events, in order: SAMPLE of the local loop, SLOW and
        FAST, at which a new command of the wall's and of the local loop begins to act, and END."""
        instants = [(self.slow.part, SLOW), (1.0, END)]
        if self.local is not None:
            N = self.local.rate_multiple
            instants += [(k / N, SAMPLE) for k in range(N)]
            instants += [((k + self.fast.part) / N, FAST) for k in range(N)]
        return sorted(instants)

    def _reading(self) -> Floats:
        """Row (N + 1,) of the encoder's reading at this instant."""
        return np.asarray(self.states.output @ self.rows.current(self.at))

    def _measured_force(self) -> Floats:
        """Row (N + 1,) of the force that the sensor measures, the command that acts until then included."""
        force = self.states.force_output @ self.rows.current(self.at)
        lags = self.controller.actuator_time_constant > 0.0
        if self.states.force_direct != 0.0:
            if lags:
                acting = self.rows.current(self.force_at)[0]
            else:
                acting = self.slow.before() + (0.0 if self.local is None else self.fast.before())
            force = force + self.states.force_direct * acting
        for number, load in enumerate(self.loads):
            if load.sampled.direct != 0.0:
                acting = self.rows.current(self.force_at)[1 + number] if lags else load.held.before()
                force = force + load.sampled.direct * acting
        return np.asarray(force)

    def _fast_command(self) -> Floats:
        """Row (N + 1,) of the local loop's own command at one of its samples."""
        assert self.local is not None
        reading = self._reading()
        command = -self.local.stiffness * reading
        if self.local.damping:
            command = command - self.local.damping * self.fast_velocity.output(reading)
        return np.asarray(command)

    def _advance(self, time: float, commands: Floats) -> None:
        """Let the plant move for a time [s] under held commands (1 + r, N + 1), a row each: that of wall and local
        loop together, and r of a load."""
        lag, rows = self.controller.actuator_time_constant, self.rows
        growth, lagged, pushed = self._growth(time)
        states, forces = rows.current(self.at), rows.current(self.force_at)
        rows.change[self.at] += growth @ states + pushed @ commands
        if lag > 0.0:
            rows.change[self.at] += lagged @ forces
            rows.change[self.force_at] += lag_share(time, lag) * (commands - forces)

    @cached_property
    def _known_growths(self) -> dict[float, tuple[Floats, Floats, Floats]]:
        """What `_growth` has computed so far, by the time in shares of the period."""
        return {}

    def _growth(self, time: float) -> tuple[Floats, Floats, Floats]:
        """`PlantStates.growth` over a time [s]; equal parts of a period are computed once."""
        key = round(time / self.controller.sampling_period, 13)
        if key not in self._known_growths:
            self._known_growths[key] = self.states.growth(time, self.controller.actuator_time_constant)
        return self._known_growths[key]


def low_pass_states(low_pass: LowPass | None, period: float) -> FilterStates:
    """A low pass as a discrete filter with states; without one the filter that passes everything on."""
    top, bottom = (np.array(rows, dtype=float).reshape(-1, 3) for rows in low_pass_factors(low_pass, period))
    return filter_states(top, bottom, np.ones(1))


def estimate_states(method: LinearMethod, low_pass: LowPass | None, period: float) -> FilterStates:
    """A velocity estimate and the low pass behind it in states."""
    estimate = method.estimator(period)
    top, bottom = (np.array(rows, dtype=float).reshape(-1, 3) for rows in low_pass_factors(low_pass, period))
    return filter_states(
        np.vstack([estimate.numerator, top]), np.vstack([estimate.denominator, bottom]), estimate.window
    )


UNRESOLVED = 1e-2  # error of the response where it counts, by which two ways to compute it tell nothing of it
MOST_WAITING = 8  # samples of delay that the curve's steps need not know of


@dataclass(frozen=True)
class ClosedSections:
    """A closed plant: z^-delay times the section times the factors.

    sections  one row, and the states of the whole
    factors   the rest of its poles and zeros
    delay     whole samples that stand apart, for the steps of the curve; the zeros hold them, too
    hidden    growth rates of the plant's motions that were left out [1/s]
    """

    sections: Sections
    factors: Filter
    delay: int
    hidden: Floats


def closed_sections(plant: Plant, controller: Controller) -> ClosedSections:
    """The plant with all fixed feedback of its computer closed.

    Raises  UnmovedError      where the wall moves nothing that the sensor reads
            UnresolvedError   where it moves so little of it that rounding hides it
            ModelError        for a force sensor where none can be
            HysteresisError   for a plant with a loss factor
    """
    check_no_loss_factor(plant)
    form, states = close_plant(plant, controller)
    if not len(states.output) or not np.any(states.output):
        raise UnmovedError("the wall force moves nothing that the sensor reads; check actuator and sensor")
    # from a command behind the force filter to the reading, the local loop closed: the whole keeps its zeros
    path = closed_form(states, replace(controller, force_sensor=None, feedforward=None, force_filter=None))
    known = _known_zeros(controller, len(form.output) - len(path.output))
    roots, error = pole_zero_form(form, zero_poles(states, controller), path, known)
    if not error <= UNRESOLVED:
        raise UnresolvedError(
            "the wall force moves so little that the sensor reads that rounding hides it: two ways to compute the "
            f"response with the feedback closed differ by {100.0 * error:.2g} %; check actuator, sensor, and the "
            "gains of force_sensor, feedforward and local_loop"
        )
    delay = controller.whole_delay if controller.whole_delay > MOST_WAITING else 0
    row, factors = _section_and_factors(roots, delay)
    return ClosedSections(Sections(row[None], states.unobserved, form), factors, delay, states.hidden)


def closed_table(closed: ClosedSections, controller: Controller) -> LoopTable:
    """The table of one loop: the closed plant's section, its other factors as the force path, and the wall law."""
    bare = replace(controller.wall_alone, delay=float(closed.delay), force_filter=None, actuator_time_constant=0.0)
    table = loop_table(closed.sections.rows[None], np.ones(1, dtype=np.int64), bare)
    factors = np.concatenate([closed.factors.numerator, closed.factors.denominator], axis=-1)
    return table._replace(force=factors[None].copy(), force_count=np.array([len(factors)]))


def zero_poles(states: PlantStates, controller: Controller) -> int:
    """How many poles stay at z = 1 exactly: as many as the plant has, for the places and speeds of free motions,
    unless a feedback answers to these. That of the force sensor answers to neither."""
    # a free mode rests at any place, and without damping moves on at any speed
    of_plant = sum((mode.squared == 0.0) * (1 + (mode.decay == 0.0)) for mode in states.modes)
    if states.form is not None:
        of_plant += int(np.count_nonzero(states.form.poles == 0.0))
    if states.sampled:  # under load other motions are free: those that its forces leave so
        of_plant = states.neutral
    kept = [of_plant]
    for feedback in controller.fixed_feedback:
        match feedback:
            case LocalLoop():
                kept.append(0 if feedback.stiffness else 1)  # damping alone still leaves the place
            case Feedforward():
                kept.append(1 if feedback.damping else 2)  # inertia alone leaves place and speed
            case ForceSensor():
                pass
    return int(min(kept))


def _known_zeros(controller: Controller, others: int) -> Complexes:
    """Zeros (k,) in d = z - 1 that the closed plant has beside those of the path from a command to the reading: of
    the force filter and a force error, poles of the feedback's filters, and z = 0.

    others  number of states beside those of the path
    """
    T, sensor, ahead = controller.sampling_period, controller.force_sensor, controller.feedforward
    above, below = low_pass_factors(controller.force_filter, T)
    of_feedback = list[complex]()
    if sensor is not None and acts(sensor):
        of_feedback += _sensor_zeros(sensor, T)
    if ahead is not None and acts(ahead):
        of_feedback += factor_roots(ahead.velocity.estimator(T).denominator.tolist())
        for low_pass in (ahead.velocity_filter, ahead.acceleration_filter if ahead.inertia else None):
            of_feedback += factor_roots(low_pass_factors(low_pass, T)[1])
    # all other states hold past values: zeros z = 0, d = -1
    past = others - len(of_feedback) - len(factor_roots(below))
    return np.array([*factor_roots(above), *of_feedback, *[-1.0] * past], dtype=np.complex128)


def _sensor_zeros(sensor: ForceSensor, period: float) -> list[complex]:
    """The poles, in d = z - 1, of a force sensor's filter L; of a force error, which the wall's force passes, too,
    the zeros of 1 + gain L."""
    if sensor.law == "force-feedforward":
        return factor_roots(low_pass_factors(sensor.filter, period)[1])
    low_pass = low_pass_states(sensor.filter, period)
    # the states of 1 / (1 + gain L), whose poles are those zeros
    inverse = low_pass.A - sensor.gain / (1.0 + sensor.gain * low_pass.direct) * np.outer(
        low_pass.input, low_pass.output
    )
    return [complex(root) for root in np.linalg.eigvals(inverse)]


def _section_and_factors(form: PoleZeroForm, delay: int) -> tuple[Floats, Filter]:
    """Poles and zeros two by two: the section (9,), columns of `Sections.rows`, takes the slowest poles, the gain,
    and a single zero if their number is odd; the filter the others.

    form   with conjugates one after the other and then the real roots, as `pole_zero_form` gives them: so two in a
           row always have a real quadratic, and the last root is real where their number is odd
    delay  [samples] that stands apart as z^-delay (`ClosedSections`). The form has it, too, as poles at z = 0;
           zeros there are added, which cancel z^-delay
    """
    poles, zeros = form.poles, np.append(form.zeros, np.full(delay, -1.0))  # z = 0 is d = -1
    if len(poles) % 2:  # a pole and a zero at z = 0, which change nothing
        poles, zeros = np.append(poles, -1.0), np.append(zeros, -1.0)
    below = _quadratics(poles)
    single = zeros[-1:].real if len(zeros) % 2 else zeros[:0].real
    above = _quadratics(zeros[: len(zeros) - len(single)])
    slowest = below.pop(int(np.argmin([abs(c0) for _, _, c0 in below])))
    top = [1.0, -single[0]] if len(single) else [0.0, 1.0]  # coefficients of d and 1: d - zero, or 1
    # d1, d0, n2 = 0, n1, n0, no old force, not chained
    row = np.array([*slowest[1:], 0.0, form.gain * top[0], form.gain * top[1], 0.0, 0.0, 0.0, 0.0])
    # each pair of zeros with the pair of poles of the same rank in size, |c0|: no factor is very large or small;
    # pairs of poles that no zeros are left for have the numerator 1
    below.sort(key=lambda quadratic: -abs(quadratic[2]))
    above.sort(key=lambda quadratic: -abs(quadratic[2]))
    above += [[0.0, 0.0, 1.0]] * (len(below) - len(above))
    shape = (-1, 3)  # also of no factors
    return row, Filter(np.array(above).reshape(shape), np.array(below).reshape(shape))


def _quadratics(roots: Complexes) -> list[list[float]]:
    """Monic quadratics c2, c1, c0, one for each two roots in a row, which are conjugates or both real."""
    first, second = roots[0::2], roots[1::2]
    return [[1.0, float(-(a + b).real), float((a * b).real)] for a, b in zip(first, second, strict=True)]
