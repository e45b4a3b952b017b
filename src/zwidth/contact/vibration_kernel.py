"""A vibration and the gains that it makes itself, brought into agreement: compiled for `contact.quasi_linear`.

A vibration is its root z and its sizes, one row of numbers:

    [amplitude at the sensor, amplitude of the force, velocities at the frictions, readings, deflections]

From sizes to gains (`contact.describing_functions`), from gains to the transition matrix of the sampled loop, from
its eigenvectors to sizes again. One wall needs ten thousand small matrices and more.

The exponential of a small matrix and its integral, compiled.

A linear algebra library shares even a matrix of five rows among threads that wait for each other.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.compiled import compiled, compiled_lean
from zwidth.contact.describing_functions import bent_spring_gain, damper_gain, quantiser_gain, saturation_gain

# A root whose angle is below this does not swing: it creeps, or is a rounded double root at z = 1.
CREEPS: Final = 1e-5
UNREAD: Final = 1e-7  # share of a motion below which the sensor does not read it
ITERATIONS: Final = 200
LEAST_POWER_SHARE: Final = 1e-3  # share of the wall's power below which a friction counts for less and less
BLOCK: Final = 25  # iterations, of which the largest change is compared with that of those before
NEARER: Final = 0.9  # ratio of the two from which nothing comes nearer to agreement
ROUNDS: Final = 4  # times that a faster vibration of the loop so found is followed
PARTS: Final = 4  # of a sampling interval, over which the mean square of a velocity is taken (Simpson's rule)
STOPPED: Final = 1e9  # part of a motion left after a sample is exp(-this): a stronger damper does the same
LEAST: Final = 1e-300  # a size that gains are taken at instead of 0
# Among the sizes: places of the amplitude and of the force, and where the velocities begin.
AMPLITUDE, FORCE, VELOCITIES = range(3)


class LoopArrays(NamedTuple):
    """A loop and a wall: N states of the plant, M of the whole loop, f frictions, s springs, c counters.

    generator         (N, N)  of the plant, times T, in scaled states;   drive  (N,)  of the held force, likewise
    coordinates n       the first n states are positions [m], the next n velocities [m per sample]
    period            T [s];   fractional_delay  share of a sample by which the force changes late;   whole_delay
                      samples of delay besides
    stiffness, damping  of the wall [N/m], [N s/m];   limit  largest force [N]
    sensor            (n,)
    force_inputs      (N, f + s)  what a force along each friction's and spring's motion adds, times T, scaled
    friction_motions  (f, n), coulomb (f,)         frictions
    spring_motions    (s, n), cubic, excess, kink (s,)   springs
    counter_motions   (c, n), weight, step (c,)    encoders, none: the sensor;   offset  of the middle, in steps
    filter_*, estimator_*  `FilterStates` of the force filter and of the velocity estimate
    """

    generator: Floats
    drive: Floats
    coordinates: int
    period: float
    fractional_delay: float
    whole_delay: int
    stiffness: float
    damping: float
    limit: float
    sensor: Floats
    force_inputs: Floats
    friction_motions: Floats
    coulomb: Floats
    spring_motions: Floats
    cubic: Floats
    excess: Floats
    kink: Floats
    counter_motions: Floats
    weight: Floats
    step: Floats
    offset: float
    filter_A: Floats
    filter_input: Floats
    filter_output: Floats
    filter_direct: float
    estimator_A: Floats
    estimator_input: Floats
    estimator_output: Floats
    estimator_direct: float


@compiled
def held_vibration_response(A: Floats, b: Floats, share: float) -> tuple[Floats, Floats]:
    """exp(A share) (N, N), and the states (N,) that a unit input through b (N,) leaves, held over that share.

    share  of a sample, in whose unit the generator A (N, N) is
    """
    N, size = len(A), 0.0  # size: the largest row sum of |A| share
    for i in range(N):
        row = 0.0
        for j in range(N):
            row += abs(A[i, j]) * share
        size = max(size, row)
    grown, integral, gain = np.zeros((N, N)), np.zeros((N, N)), np.zeros(N)
    exponential(A, share, size, grown, integral, np.zeros((3, N, N)))
    for i in range(N):
        for j in range(N):
            gain[i] += integral[i, j] * b[j]
    return grown, gain


@compiled
def plant_steps(loop: LoopArrays, sizes: Floats) -> tuple[Floats, Floats]:
    """The plant's states at t times within the sample, the last at its end, with the gains of `sizes`.

    Returns  what the states at the sample's beginning become, (t, N, N); and what a unit of the new
             force (row 0) and of the old one (row 1) adds, (t, 2, N)
    """
    A, n, f = loop.generator.copy(), loop.coordinates, len(loop.coulomb)
    N = len(A)
    for p in range(f):
        strongest = 0.0  # of a damper of 1 N s/m: decay rate of the motion in 1/samples, times T
        for i in range(n):
            strongest += abs(loop.force_inputs[n + i, p] * loop.friction_motions[p, i])
        b = damper_gain(loop.coulomb[p], max(sizes[VELOCITIES + p], LEAST))
        # at small amplitudes dry friction acts as an ever larger damper; one that stops the motion within the
        # sample is enough, a stronger one does the same
        b = min(b, STOPPED * loop.period / strongest) if strongest > 0.0 else 0.0
        for i in range(N):
            for j in range(n):
                # over T, since velocities are in metres per sample
                A[i, n + j] -= b * loop.force_inputs[i, p] * loop.friction_motions[p, j] / loop.period
    first = VELOCITIES + f + len(loop.step)
    for s in range(len(loop.cubic)):
        k = bent_spring_gain(sizes[first + s], loop.cubic[s], loop.excess[s], loop.kink[s])
        for i in range(N):
            for j in range(n):
                A[i, j] -= k * loop.force_inputs[i, f + s] * loop.spring_motions[s, j]
    # with a delay that is not whole, the old force acts first and the new one after it
    times = PARTS * (2 if loop.fractional_delay > 0.0 else 1)
    states, forces = np.zeros((times, N, N)), np.zeros((times, 2, N))
    # E, g: states and forces so far;   which: the force that acts, 0 the new one, 1 the old one
    E, g, product = np.eye(N), np.zeros((2, N)), np.zeros((N, N))
    at = 0
    for which in range(1 if loop.fractional_delay > 0.0 else 0, -1, -1):
        share = loop.fractional_delay if which else 1.0 - loop.fractional_delay
        step, gain = held_vibration_response(A, loop.drive, share / PARTS)
        for _ in range(PARTS):
            multiply(step, E, product)
            E[:] = product
            for force in range(2):
                for i in range(N):
                    total = gain[i] if force == which else 0.0
                    for j in range(N):
                        total += step[i, j] * g[force, j]
                    forces[at, force, i] = total
                g[force] = forces[at, force]
            states[at] = E
            at += 1
    return states, forces


@compiled
def transition(
    loop: LoopArrays, sizes: Floats, passes: float, states: Floats, forces: Floats
) -> tuple[Floats, Floats, Floats]:
    """Transition (M, M) of the loop whose gains are those of a vibration; the velocities (t + 1, n, M) at the
    sample's beginning and at the t times of `plant_steps` [m per sample]; and the commanded force (M,).

    sizes   of the vibration, as `sizes_of` gives them
    passes  share of the force that acts; negative: what its limit lets pass
    states, forces  as `plant_steps` returns them
    """
    # M states: N of the plant, queue of forces on their way, then those of force filter (f) and estimator (e)
    n, N = loop.coordinates, len(loop.generator)
    queue = loop.whole_delay + (1 if loop.fractional_delay > 0.0 else 0)
    f = N + queue
    e = f + len(loop.filter_A)
    M = e + len(loop.estimator_A)
    # the others are rows: reading, estimated velocity and wall force by the states
    L, command, read, speed, wall = np.zeros((M, M)), np.zeros(M), np.zeros(M), np.zeros(M), np.zeros(M)
    if len(loop.step):
        first = VELOCITIES + len(loop.coulomb)
        for c in range(len(loop.step)):
            size = max(sizes[first + c], LEAST)
            gain = loop.weight[c] * quantiser_gain(size / loop.step[c], loop.offset)
            for i in range(n):
                read[i] += gain * loop.counter_motions[c, i]
    else:
        read[:n] = loop.sensor
    for i in range(n):
        speed[i] = loop.estimator_direct * read[i]
    speed[e:] = loop.estimator_output
    wall[:] = loop.stiffness * read + loop.damping * speed
    for i in range(M - e):
        for j in range(n):
            L[e + i, j] = loop.estimator_input[i] * read[j]
        L[e + i, e:] = loop.estimator_A[i]
        L[e + i, e + i] += 1.0  # A is that of differences, z - 1
    command[:] = -loop.filter_direct * wall
    for i in range(e - f):
        command[f + i] -= loop.filter_output[i]
        L[f + i] = loop.filter_input[i] * wall
        for j in range(e - f):
            L[f + i, f + j] += loop.filter_A[i, j]
        L[f + i, f + i] += 1.0
    if passes < 0.0:
        passes = saturation_gain(max(sizes[FORCE], LEAST), loop.limit) if loop.limit < np.inf else 1.0
    # what waits: the newest force first, then the queue, oldest last
    for k in range(queue):
        if k == 0:
            L[N] = passes * command
        else:
            L[N + k, N + k - 1] = 1.0
    times = len(states)
    inside = np.zeros((times + 1, n, M))
    row = np.zeros(M)
    for i in range(n):
        inside[0, i, n + i] = 1.0
    for t in range(times):
        # within the sample only velocities are wanted, at its end all states
        last = t == times - 1
        for i in range(0 if last else n, N if last else 2 * n):
            row[:] = 0.0
            row[:N] = states[t, i]
            new, old = forces[t, 0, i], forces[t, 1, i]
            if loop.whole_delay == 0:
                row += (new * passes) * command
            else:
                # the queue holds forces that the limit has cut already
                row[N + loop.whole_delay - 1] += new
            if loop.fractional_delay > 0.0:
                row[N + loop.whole_delay] += old
            if n <= i < 2 * n:
                inside[t + 1, i - n] = row
            if last:
                L[i] = row
    return L, inside, command


@compiled
def mean_weights(late: float) -> Floats:
    """Simpson's weights of the mean over a sample, at its beginning and at the t times of `plant_steps`.

    late  share of the sample after which the force changes, where the sample falls into two; 0: at its beginning
    """
    share = np.array([1.0, 4.0, 2.0, 4.0, 1.0]) / 12.0
    weights = np.zeros(2 * PARTS + 1 if late > 0.0 else PARTS + 1)
    if late > 0.0:
        weights[: PARTS + 1] = late * share
        weights[PARTS:] += (1.0 - late) * share
    else:
        weights[:] = share
    return weights


@compiled
def sizes_of(loop: LoopArrays, state: Complexes, inside: Floats, command: Floats, mean: Floats) -> Floats:
    """The sizes of a vibration that moves the sensor by 1 m.

    state            (M,)  of the loop at a sample, complex
    inside, command  as `transition` returns them;   mean  (t + 1,)  `mean_weights`
    """
    n, f, c, s = loop.coordinates, len(loop.coulomb), len(loop.step), len(loop.cubic)
    sizes = np.zeros(VELOCITIES + f + c + s)
    sizes[AMPLITUDE] = 1.0
    force = 0.0j
    for i in range(len(state)):
        force += command[i] * state[i]
    sizes[FORCE] = abs(force)
    for p in range(f):
        square = 0.0
        for t in range(len(mean)):
            speed = 0.0j
            for i in range(n):
                if loop.friction_motions[p, i] != 0.0:
                    for j in range(len(state)):
                        speed += loop.friction_motions[p, i] * inside[t, i, j] * state[j]
            square += mean[t] * (speed.real**2 + speed.imag**2)
        sizes[VELOCITIES + p] = np.sqrt(square) / loop.period
    for k in range(c + s):
        moved = 0.0j
        for i in range(n):
            moved += (loop.counter_motions[k, i] if k < c else loop.spring_motions[k - c, i]) * state[i]
        sizes[VELOCITIES + f + k] = abs(moved)
    return sizes


@compiled
def vibration_size(loop: LoopArrays, sizes: Floats, by_velocity: bool) -> float:
    """Size of a vibration with these sizes.

    by_velocity  False: amplitude at the sensor [m]; True: length of the vector of the frictions' velocities [m/s]
    """
    if not by_velocity:
        return float(sizes[AMPLITUDE])
    square = 0.0
    for p in range(len(loop.coulomb)):
        square += sizes[VELOCITIES + p] ** 2
    return float(np.sqrt(square))


@compiled
def vibrations(loop: LoopArrays, sizes: Floats, size: float, by_velocity: bool) -> tuple[Complexes, Floats]:
    """All vibrations of this size (see `vibration_size`) of the linear loop that has the gains of `sizes`, but
    those that the sensor does not see.

    Returns  their roots (k,), and a row of sizes for each
    """
    states, forces = plant_steps(loop, sizes)
    L, inside, command = transition(loop, sizes, -1.0, states, forces)
    roots, vectors = np.linalg.eig(L.astype(np.complex128))
    n, M, mean = loop.coordinates, len(L), mean_weights(loop.fractional_delay)
    most = 0.0
    for i in range(n):
        most = max(most, abs(loop.sensor[i]))
    found_roots, found_sizes, count = np.zeros(M, np.complex128), np.zeros((M, len(sizes))), 0
    for k in range(M):
        # of a pair the one above the real axis; a root on its negative side may be rounded to below it
        root = roots[k] if np.angle(roots[k]) > CREEPS - np.pi else np.conj(roots[k])
        # the angle of a root so near to 0, as of forces in the queue, is rounding
        if not (np.angle(root) > CREEPS and abs(root) > 1e-6):
            continue
        reading, whole = 0.0j, 0.0
        for i in range(2 * n):
            whole = max(whole, abs(vectors[i, k]))
            if i < n:
                reading += loop.sensor[i] * vectors[i, k]
        if not abs(reading) > UNREAD * most * whole:
            continue
        unit_sizes = sizes_of(loop, vectors[:, k] / reading, inside, command, mean)
        found_roots[count] = root
        found_sizes[count] = unit_sizes * (size / vibration_size(loop, unit_sizes, by_velocity))
        count += 1
    return found_roots[:count], found_sizes[:count]


@compiled
def size_difference(loop: LoopArrays, one: Floats, other: Floats, root: complex) -> float:
    """Largest relative difference of two rows of sizes; root  z of the second.

    A friction that holds its motion fast is a damper that grows without end and a velocity that falls as fast,
    with no effect on the rest: a velocity counts relative to no less than that at which the friction takes a small
    share of the power which the wall can give.
    """
    f, most = len(loop.coulomb), 0.0
    power = other[FORCE] * other[AMPLITUDE] * abs(np.angle(root)) / loop.period
    for i in range(len(one)):
        larger = max(abs(one[i]), abs(other[i]))
        if VELOCITIES <= i < VELOCITIES + f:
            larger = max(larger, LEAST_POWER_SHARE * power / loop.coulomb[i - VELOCITIES])
        if larger > 0.0:
            most = max(most, abs(one[i] - other[i]) / larger)
    return most


@compiled
def iterate_vibration(
    loop: LoopArrays, root: complex, start: Floats, size: float, by_velocity: bool, same: float
) -> tuple[bool, complex, Floats]:
    """Bring shape and gains into agreement, following the root nearest to the start's.

    root, start  z and sizes to start from;   size, by_velocity  size that is kept, see `vibration_size`
    same     largest relative change of a size, and change of the root, that counts as none
    Returns  whether they agree (False: no root swings, or no agreement is reached), the last root, and its sizes
    """
    now, z = start * (size / vibration_size(loop, start, by_velocity)), root
    # last, peak: largest change in the block before and in this one;   vain: blocks in a row without progress
    # weight: share of the step that is taken;   before: the last change
    weight, before, last, peak, vain = 1.0, np.inf, np.inf, 0.0, 0
    for iteration in range(ITERATIONS):
        roots, all_sizes = vibrations(loop, now, size, by_velocity)
        if len(roots) == 0:
            return False, z, now
        # the root nearest to the last one: the branch is followed, not the fastest root
        k = np.argmin(np.abs(roots - z))
        after = all_sizes[k]
        change = max(abs(roots[k] - z), size_difference(loop, now, after, roots[k]))
        if change < same:
            return True, roots[k], after
        # two blocks without progress end the iteration, as the changes may rise and fall within a block
        peak = max(peak, change)
        if (iteration + 1) % BLOCK == 0:
            vain = vain + 1 if peak > NEARER * last else 0
            last, peak = peak, 0.0
            if vain == 2:
                break
        # slow or swinging progress: smaller steps
        if change > 0.7 * before:
            # 0.05: no smaller, so that it still gets on
            weight = max(0.6 * weight, 0.05)
        before, z = change, roots[k]
        for i in range(len(now)):
            # sizes differ by orders of magnitude and stay positive, so that the mean is taken of their logarithms
            both = now[i] > 0.0 and after[i] > 0.0
            now[i] = np.exp((1.0 - weight) * np.log(now[i]) + weight * np.log(after[i])) if both else after[i]
    # rounding can keep the changes above `same`; so near they count as agreement
    return before < 1e-6, z, now


@compiled
def fastest_vibration(
    loop: LoopArrays, root: complex, start: Floats, size: float, by_velocity: bool, same: float
) -> tuple[bool, complex, Floats]:
    """The fastest growing vibration of this size near a start; takes and returns what `iterate_vibration` does."""
    known, z, sizes = iterate_vibration(loop, root, start, size, by_velocity, same)
    for _ in range(ROUNDS):
        if not known:
            break
        roots, all_sizes = vibrations(loop, sizes, size, by_velocity)
        if len(roots) == 0:
            break
        k = np.argmax(np.abs(roots))
        # at these sizes another root may grow faster than the one that was followed; then follow that one
        if abs(roots[k]) <= abs(z) + 1e-6:
            break
        faster, other, changed = iterate_vibration(loop, roots[k], all_sizes[k].copy(), size, by_velocity, same)
        if not faster or abs(other) <= abs(z):
            break
        z, sizes = other, changed
    return known, z, sizes


TERMS: Final = 12  # of the series, for matrices up to SMALL: 0.25^13/13! are left
SMALL: Final = 0.25


@compiled_lean
def multiply(left: Floats, right: Floats, product: Floats) -> None:
    """Fill product (N, N) with left times right."""
    N = left.shape[0]
    for i in range(N):
        for j in range(N):
            product[i, j] = 0.0
        for k in range(N):
            value = left[i, k]
            if value != 0.0:
                for j in range(N):
                    product[i, j] += value * right[k, j]


@compiled_lean
def exponential(A: Floats, time: float, size: float, E: Floats, G: Floats, scratch: Floats) -> None:
    """Fill E (N, N) with exp(A time), and G (N, N) with the integral of exp(A t) from 0 to `time`.

    A series gives the mean of exp(A t) over a short time tau, from which both follow, and doubling the rest:

        G(tau) = tau (1 + X/2 (1 + X/3 (1 + ...))),   E(tau) = 1 + A G(tau),   X = A tau
        G(2 t) = G(t) + E(t) G(t),                    E(2 t) = E(t) E(t)

    size     a norm of A time that says how long tau may be. It may be one in units of the states that balance A:
             they change no term of the series
    scratch  (3, N, N)
    """
    step, series, product = scratch[0], scratch[1], scratch[2]
    N, doublings = A.shape[0], 0
    # over so short a time the series converges in TERMS terms without cancellation
    while size > SMALL and doublings < 60:
        size *= 0.5
        doublings += 1
    tau = time / 2.0**doublings
    for i in range(N):
        for j in range(N):
            step[i, j] = tau * A[i, j]
            series[i, j] = 0.0
        series[i, i] = 1.0
    # Horner's scheme: the smallest terms are added first
    for term in range(TERMS, 0, -1):
        multiply(step, series, product)
        for i in range(N):
            for j in range(N):
                series[i, j] = product[i, j] / (term + 1.0)
            series[i, i] += 1.0
    multiply(step, series, E)
    for i in range(N):
        E[i, i] += 1.0
        for j in range(N):
            G[i, j] = tau * series[i, j]
    for _ in range(doublings):
        # G before E, since it needs the E of the shorter time
        multiply(E, G, product)
        for i in range(N):
            for j in range(N):
                G[i, j] += product[i, j]
                series[i, j] = E[i, j]
        multiply(series, series, E)
