"""A plant's first-order form, where damping couples the undamped modes or lags behind the velocity.

Which modes of a plant are moved by given forces or show in given readings, and which are idle.

Idle are vibrations out of a device's plane, or those of a symmetric device across the rendered direction. Rounding
leaves a little of the others in them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats, Ints
from zwidth.model.modes import UNOBSERVED, UNOBSERVED_UNDAMPED, clusters, repeat_tolerance, undamped_modes
from zwidth.model.plant import Plant

# A pole whose left and right vectors are this near to orthogonal shares its motion with a neighbour.
SHARED = 1e-3
ZERO = 1e-13  # a pole below this share of the largest is a rounded zero
UNREAD = 1e-12  # share of a sensor's reading that is rounding
SECOND_UNREAD = 1e-10  # what a second reading, of a force per force, may show of an undamped motion that is hidden
# Of so many poles, as links that bend have, fast ones that the wall hardly moves would only lengthen the chain
MANY = 24
FAST = 1.0  # poles times period from which a motion is gone, or has turned round, by the next sample
ROUNDING = 1e-13  # of a residue, in shares of the terms that it is summed from


@dataclass(frozen=True)
class FirstOrderForm:
    """y/f = free/s^2 + output (s - A)^-1 input

    dynamics      (k, k)  A [1/s]
    input         (k,)
    output        (k,)
    poles         (p,)    eigenvalues of A [1/s], conjugates both, but for
    hidden_poles  (h,)    those that the force does not move or the sensor does not read
    free_residue  residue of the rigid, undamped motion [1/kg]; 0 where the force does not move it or the sensor
                  does not read it
    free_count    how many such motions there are
    second_output, second_direct   a second reading per state (k,) and per unit of force; None: there is none
    """

    dynamics: Floats
    input: Floats
    output: Floats
    poles: Complexes
    hidden_poles: Complexes
    free_residue: float
    free_count: int
    second_output: Floats | None = None
    second_direct: float = 0.0


def first_order_form(plant: Plant, period: float, second_reading: Floats | None = None) -> FirstOrderForm:
    """The plant's first-order form on coordinates, velocities and those that lagged dampers follow with their lag,
    both [m per period].

    Motions with neither stiffness nor damping are split off: they are M-orthogonal to the rest, and their double
    pole at 0 is known exactly. Of the places of all motions that are braked but have no stiffness one state is
    kept, what the sensor reads of them. Idle vibrations, which nothing moves or reads, are left out, too, and
    their poles are hidden ones. Hidden is also a pole that moves the reading within a period T [s] by no more than
    rounding.

    second_reading  (3, n)  weights of x'', x' and x in a force; a pole is hidden only if it moves this neither. Of
                            motions without springs it must read no place, of those without dampers no velocity
    """
    free, braked, elastic, idle = _split_motions(plant, second_reading)
    damped_or_elastic = np.hstack([braked, elastic])
    A, source, reading = _state_matrices(plant, braked, damped_or_elastic, period)
    ends = np.abs(np.hstack([free, damped_or_elastic]).T @ np.stack([plant.actuator, plant.sensor], axis=1))
    # the motions' parts in the force, summed, times those in the reading: against this rounding is told
    together = float(np.prod(ends.sum(axis=0)))
    # T^2: a force held for T moves what has the mass 1 by about T^2
    poles, hidden = _poles(A, source, reading, period, together * period**2)
    free_residue = float((free.T @ plant.sensor) @ (free.T @ plant.actuator))
    if abs(free_residue) <= UNOBSERVED_UNDAMPED * together:
        free_residue = 0.0
    second, direct = None, 0.0
    if second_reading is not None:
        second = _second_output(A, elastic, damped_or_elastic, len(plant.lagged_dampers), period, second_reading)
        direct = float(second_reading[0] @ np.linalg.solve(plant.mass, plant.actuator))
        if np.any(second):
            # a feedback of it moves poles by what it reads of them: here that counts itself, not a share of all;
            # `_poles` multiplies by UNOBSERVED_UNDAMPED, which leaves SECOND_UNREAD
            hidden &= _poles(A, source, second, period, SECOND_UNREAD / UNOBSERVED_UNDAMPED)[1]
    # poles at 0 of the places of braked motions that A leaves out: it has one state at most for all of them
    unread = np.zeros(2 * damped_or_elastic.shape[1] + len(plant.lagged_dampers) - len(A), dtype=complex)
    hidden_poles = np.concatenate([poles[hidden], unread, _poles_of_idle(plant, idle)])
    free_count = int(free.shape[1])
    return FirstOrderForm(
        A, source, reading, poles[~hidden], hidden_poles, free_residue, free_count, second, direct
    )


def _second_output(
    A: Floats, elastic: Floats, basis: Floats, lag_count: int, period: float, rows: Floats
) -> Floats:
    """Weights (N,) of a form's states in a reading rows . [x'', x', x], without what the force adds to x''.

    A               (N, N)  dynamics of the form, whose last `lag_count` states are those of lagged dampers
    elastic, basis  (n, e), (n, k)  motions of the form's places, the last of them, and of its velocities
    rows            (3, n)
    """
    k, e = basis.shape[1], elastic.shape[1]
    x = len(A) - k - lag_count  # index of the first velocity; the elastic coordinates are just before it
    out = np.asarray(rows[0] @ basis @ A[x : x + k] / period)
    out[x : x + k] += rows[1] @ basis / period
    out[x - e : x] += rows[2] @ elastic
    return out


def _drag(plant: Plant) -> Floats:
    """Damping (n, n) of the plant as if its lagged dampers did not lag."""
    lagged = [damper.damping * np.outer(damper.along, damper.along) for damper in plant.lagged_dampers]
    return np.asarray(plant.damping + sum(lagged, np.zeros_like(plant.damping)))


def _split_motions(plant: Plant, second_reading: Floats | None) -> tuple[Floats, Floats, Floats, Floats]:
    """Mass-normalised motions: free of stiffness and damping (n, f), braked but free of stiffness (n, b), and
    elastic ones that are moved or read (n, e), and idle (n, i)."""
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    ends = [plant.actuator, plant.sensor, *(damper.along for damper in plant.lagged_dampers)]
    ends += [] if second_reading is None else list(second_reading)
    separated, moved = separated_modes(plant, squared, shapes, np.array(ends))
    idle = ~moved & (squared != 0.0)
    # motions without stiffness as they were: what brakes them splits them below
    shapes = np.where(squared == 0.0, shapes, separated)
    drag = _drag(plant)
    rigid, elastic = shapes[:, squared == 0.0], shapes[:, (squared != 0.0) & ~idle]
    # motions without stiffness may be combined: along the axes of their damping each has its own, or none
    brakes, axes = np.linalg.eigh(rigid.T @ drag @ rigid)
    # damping that is rounding: of motions that slide
    level = 1e-13 * max(float(np.max(np.abs(shapes.T @ drag @ shapes))), np.finfo(float).tiny)
    slides = np.abs(brakes) <= level
    return rigid @ axes[:, slides], rigid @ axes[:, ~slides], elastic, shapes[:, idle]


def _poles_of_idle(plant: Plant, motions: Floats) -> Complexes:
    """Poles (2 i,) [1/s] of idle motions (n, i), which are mass-normalised and couple to no others."""
    count = motions.shape[1]
    A = np.zeros((2 * count, 2 * count))
    A[:count, count:] = np.eye(count)
    A[count:, :count] = -(motions.T @ plant.stiffness @ motions)
    A[count:, count:] = -(motions.T @ plant.damping @ motions)
    return np.asarray(np.linalg.eigvals(A), dtype=np.complex128)


def _state_matrices(plant: Plant, braked: Floats, basis: Floats, period: float) -> tuple[Floats, Floats, Floats]:
    """A (N, N), input and output (N,) on the states [what is read of the braked motions, elastic coordinates,
    velocities of both, velocities z that lagged dampers follow:  tau z' + z = along . v,  their force being b z].

    braked, basis  (n, b), (n, k)  mass-normalised motions: those without stiffness, and all, elastic ones behind
                   them
    """
    k, b, lags = basis.shape[1], braked.shape[1], plant.lagged_dampers
    elastic = basis[:, b:]
    read = braked.T @ plant.sensor
    size = float(np.linalg.norm(read))
    if size <= UNREAD * float(np.linalg.norm(basis.T @ plant.sensor)):
        read, size = read[:0], 0.0
    first_velocity = int(size > 0.0) + k - b  # coordinates come first, then k velocities [m per period]
    n = first_velocity + k + len(lags)
    A, source, reading = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    if size > 0.0:
        # the state is what is read of all braked motions, over `size`, so that its weights have length 1
        A[0, first_velocity : first_velocity + b], reading[0] = read / size / period, size
    elastic_at = slice(first_velocity - (k - b), first_velocity)
    A[elastic_at, first_velocity + b : first_velocity + k] = np.eye(k - b) / period
    A[first_velocity : first_velocity + k, elastic_at] = -(basis.T @ plant.stiffness @ elastic) * period
    A[first_velocity : first_velocity + k, first_velocity : first_velocity + k] = -(
        basis.T @ plant.damping @ basis
    )
    for i, damper in enumerate(lags):
        along, lag_at = basis.T @ damper.along, first_velocity + k + i
        A[first_velocity : first_velocity + k, lag_at] = -damper.damping * along
        A[lag_at, first_velocity : first_velocity + k] = along / damper.time_constant
        A[lag_at, lag_at] = -1.0 / damper.time_constant
    source[first_velocity : first_velocity + k] = basis.T @ plant.actuator * period
    reading[elastic_at] = elastic.T @ plant.sensor
    return A, source, reading


def _poles(
    A: Floats, source: Floats, reading: Floats, period: float, alone_gain: float
) -> tuple[Complexes, Flags]:
    """All poles (k,) [1/s] of A (k, k), and (k,) which of them are hidden: `source` (k,) does not move them, or
    `reading` (k,) does not show them, beyond rounding; undamped ones, and of more than MANY poles fast ones, also
    where that is little.

    alone_gain  what a unit force held for T would leave in the reading if no motion held another back [m/N]

    Balancing first gives each motion units of its own, in which a slow pair of poles stays apart.
    """
    from scipy.linalg import eig, matrix_balance

    if not len(A):
        return np.zeros(0, dtype=complex), np.zeros(0, dtype=bool)
    balanced, (scale, _) = matrix_balance(A, permute=False, separate=True)
    poles, left, right = eig(balanced, left=True)
    poles[np.abs(poles) <= ZERO * np.max(np.abs(poles))] = 0.0
    overlap = np.sum(left.conj() * right, axis=0)
    single = np.abs(overlap) > SHARED  # only of such a pole can it be told
    source, reading = source / scale, reading * scale
    still = poles == 0.0
    # |(exp(s T) - 1)/s|: what a unit force held for T leaves
    reach = np.where(still, period, np.abs(np.expm1(poles * period)) / np.where(still, 1.0, np.abs(poles)))
    # a residue is (left . source) (reading . right) / overlap; of a pole that is not single it is not told
    reach = reach / np.where(single, np.abs(overlap), 1.0)
    gain = np.abs((left.conj().T @ source) * (reading @ right)) * reach
    rounding = ROUNDING * (np.abs(left.T) @ np.abs(source)) * (np.abs(reading) @ np.abs(right)) * reach
    least = np.zeros(len(poles))
    if len(poles) > MANY:
        largest = min(alone_gain, float(np.max(gain, where=single, initial=0.0)))
        least = np.where(np.abs(poles) * period > FAST, UNOBSERVED * largest, 0.0)
    # an undamped motion that the wall hardly moves could only hide the stability of the rest
    least = np.where(np.abs(poles.real) * period < 1e-9, UNOBSERVED_UNDAMPED * alone_gain, least)
    hidden = single & (gain <= np.maximum(least, rounding))
    # conjugates are hidden together or not at all
    return poles, hidden & hidden[_partners(poles)]


def fast_and_unseen(A: Floats, inputs: Floats, readings: Floats, period: float) -> tuple[Complexes, Complexes]:
    """Poles of A (k, k) [1/s]: those that are slow or that some input moves in some reading, and all others.

    inputs, readings  (r, k), (q, k)  on states that are amplitudes of modes, then their velocities [m per period]
    """
    poles, unseen = np.zeros(0, dtype=complex), np.ones(len(A), dtype=np.bool_)
    for source in inputs:
        for reading in readings:
            together = float(np.sum(np.abs(source)) * np.sum(np.abs(reading))) * period
            poles, hidden = _poles(A, source, reading, period, together)
            unseen &= hidden & (np.abs(poles) * period > FAST)
    return poles[~unseen], poles[unseen]


def _partners(poles: Complexes) -> Ints:
    """The index (p,) of each pole's conjugate among them; of a real pole its own."""
    return np.asarray(np.argmin(np.abs(poles[:, None] - poles.conj()), axis=1))


def without_hidden_poles(form: FirstOrderForm) -> FirstOrderForm:
    """The form without its hidden poles, on the invariant subspace of the others."""
    if not len(form.hidden_poles):
        return form
    right, left = invariant_subspace(form, form.poles)
    return replace(
        form,
        dynamics=left.T @ form.dynamics @ right,
        input=left.T @ form.input,
        output=form.output @ right,
        hidden_poles=form.hidden_poles[:0],
        second_output=None if form.second_output is None else form.second_output @ right,
    )


def invariant_subspace(form: FirstOrderForm, poles: Complexes) -> tuple[Floats, Floats]:
    """Bases (k, p) of the right and of the left invariant subspace of the form's A for p of its poles,
    left^T right = 1."""
    from scipy.linalg import matrix_balance, schur

    every = np.concatenate([form.poles, form.hidden_poles])
    # exactly 0, as they are the form's own numbers
    wanted = np.min(np.abs(every[:, None] - poles), axis=1, initial=np.inf) == 0.0

    def chosen(value: complex) -> bool:
        return bool(wanted[np.argmin(np.abs(value - every))])

    def basis(A: Floats) -> Floats:
        """Orthonormal basis (k, p) of the invariant subspace of a matrix (k, k) for the wanted poles."""
        _, vectors, count = schur(A, output="complex", sort=chosen)
        U, _, _ = np.linalg.svd(np.hstack([vectors[:, :count].real, vectors[:, :count].imag]))
        return np.asarray(U[:, :count])

    balanced, (scale, _) = matrix_balance(form.dynamics, permute=False, separate=True)
    right, left = basis(balanced), basis(balanced.T)
    return scale[:, None] * right, np.linalg.solve(left.T @ right, left.T).T / scale[:, None]


# Modal damping below this share of the largest is rounding of 0.
UNDAMPED = 1e-13
# A motion with less than this share in a force, a reading or the damping counts as uncoupled.
IDLE = 1e-11
# The same of a damped vibration, for the rounding of its shape beside fast ones: its share in a response is 1e-14.
IDLE_DAMPED = 1e-7
# Dampers that couple two modes by this share of what they do to either: what comes back is the square of it.
COUPLED = 1e-7


def modal_damping(plant: Plant, shapes: Floats) -> Floats:
    """The damping (n, n) [1/s] in coordinates of mass-normalised modes, the columns of shapes (n, n), symmetric
    and without rounding of 0."""
    damping = shapes.T @ plant.damping @ shapes
    damping = (damping + damping.T) / 2.0
    diagonal = np.abs(np.diag(damping))
    # B is positive semidefinite: a mode that dissipates nothing by itself is not damped through others either
    still = diagonal <= UNDAMPED * np.max(np.abs(damping), initial=0.0)
    damping[still, :] = damping[:, still] = 0.0
    return np.where(_coupling(damping), damping, np.diag(np.diag(damping)))


def separated_modes(plant: Plant, squared: Floats, shapes: Floats, ends: Floats) -> tuple[Floats, Flags]:
    """Modes, of which as few as can be are moved by forces along some ends or show in a reading there; and which
    are.

    Rounding chooses the shapes of equal modes. What is moved of them, by an end or by dampers of what is moved, is
    a subspace, and the shapes are turned into it and across it; those across are idle.

    squared  (n,)    squared frequencies, ascending, of free motions exactly 0
    shapes   (n, n)  mass-normalised modes, columns
    ends     (k, n)  along which forces act, and which are read; a row of zeros stands for nothing
    Returns  (n, n) the shapes, unchanged among equal modes of which all are moved; (n,) which are moved
    """
    runs = clusters(squared, repeat_tolerance(squared))
    damping = modal_damping(plant, shapes)
    others = [shapes.T @ M @ shapes for M in (plant.hysteresis, plant.circulatory) if M is not None]
    couplings = [_scaled(matrix, runs) for matrix in (damping, *others)]
    parts = ends @ shapes
    parts /= np.maximum(np.linalg.norm(parts, axis=1, keepdims=True), 1e-300)
    moved = []  # of each run: orthonormal basis of what is moved of its modes
    for run in runs:
        damped = float(np.max(np.diag(damping)[run])) > 0.0
        empty = np.zeros((run.stop - run.start, 0))
        moved.append(_widened(empty, parts[:, run].T, IDLE_DAMPED if damped else IDLE))
    waiting = list(range(len(runs)))  # runs whose moved motions may push others
    while waiting:
        source = waiting.pop(0)
        pushed = np.hstack([M[:, runs[source]] @ moved[source] for M in couplings])
        for target, run in enumerate(runs):
            wider = _widened(moved[target], pushed[run], COUPLED)
            if wider.shape[1] > moved[target].shape[1]:
                moved[target] = wider
                waiting.append(target)
    flags, turned = np.ones(len(squared), dtype=np.bool_), shapes
    for run, basis in zip(runs, moved, strict=True):
        if basis.shape[1] < run.stop - run.start:
            turned = turned.copy() if turned is shapes else turned
            across = np.linalg.svd(basis, full_matrices=True)[0][:, basis.shape[1] :]
            turned[:, run] = shapes[:, run] @ np.hstack([basis, across])
            flags[run.start + basis.shape[1] : run.stop] = False
    return turned, flags


def _scaled(matrix: Floats, runs: list[slice]) -> Floats:
    """A symmetric or skew matrix (n, n) on n modes, in units in which an element above COUPLED couples its modes.

    Element i, j is divided by sqrt(s_i s_j), s_i being the largest diagonal element, in size, of all modes that
    have the frequency of i. Of dampers, a positive semidefinite matrix, what results is 1 at most. Without any
    diagonal, as of a skew matrix, all elements are divided by one number: those above UNDAMPED of the largest then
    couple.

    runs  the modes of each frequency; together all n
    """
    sizes = np.ones(len(matrix))
    for run in runs:
        sizes[run] = np.sqrt(np.max(np.abs(np.diag(matrix)[run])))
    if not np.any(sizes):
        # UNDAMPED of the largest becomes COUPLED; over 1.0 where all elements are 0
        return np.asarray(matrix / (UNDAMPED / COUPLED * np.max(np.abs(matrix)) or 1.0))
    sizes[sizes == 0.0] = 1.0  # not divided by 0: there a positive semidefinite matrix has rows of zeros
    return np.asarray(matrix / np.outer(sizes, sizes))


def _widened(basis: Floats, columns: Floats, level: float) -> Floats:
    """An orthonormal basis (k, b), widened by what of columns (k, c) lies outside it, by more than a level."""
    if basis.shape[0] == basis.shape[1] or np.linalg.norm(columns) <= level:
        return basis
    outside = columns - basis @ (basis.T @ columns)
    # once more for what rounding has left, which would grow as a small remainder gets length 1
    outside -= basis @ (basis.T @ outside)
    ways, sizes, _ = np.linalg.svd(outside, full_matrices=False)
    return np.hstack([basis, ways[:, sizes > level]])


def _coupling(matrix: Floats) -> Flags:
    """Which pairs of modes (n, n) a symmetric matrix (n, n) in modal coordinates couples by more than IDLE, as a
    share of what it does to both of them."""
    root = np.sqrt(np.abs(np.diag(matrix)))
    return np.asarray((np.abs(matrix) > IDLE * np.outer(root, root)) & ~np.eye(len(root), dtype=bool))
