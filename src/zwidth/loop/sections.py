"""The sampled plant as rows of second-order factors, without what no wall moves or no sensor reads.

Those of many plants at once follow from their pairs of poles, and those of one by the same kernels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled
from zwidth.errors import UnmovedError, UnresolvedError
from zwidth.loop.controller import Controller, whole_samples
from zwidth.loop.hold import held_row, lagged_row, modal_row
from zwidth.loop.motion_names import motion_name, pole_name
from zwidth.loop.pole_zero_form import SampledForm, exact_rows, form_rows, rows_error, sample_form, separate_rows
from zwidth.model.first_order_form import FirstOrderForm, first_order_form, without_hidden_poles
from zwidth.model.modes import REPEATED, UNOBSERVED, UNOBSERVED_UNDAMPED, RealModes, real_modes, repeat_tolerance
from zwidth.model.plant import Plant, check_no_loss_factor
from zwidth.model.plant_modes import fill_modes
from zwidth.model.rendered_modes import PolePairs
from zwidth.resources import in_chunks

# Two pairs of poles of a chain within this relative distance are equal poles that rounding has set apart; a row
# with such poles whose response is below the same share of the earlier row's is what that rounding left.
SAME_POLES = 1e-6
# A chain that misses the response by more than the first is written again in decimal arithmetic: a root on the
# unit circle, which moves by about as much, would else be off it by what eigenvalues see (1e-9). By more than the
# second it is tried pole by pole; by more than the third, two ways to write it tell nothing of the plant.
KEPT_DIGITS, FEW_DIGITS, LOST_DIGITS = 1e-12, 1e-8, 1e-4


@dataclass(frozen=True)
class Sections:
    """The sampled plant, one row per observed pair of poles, and the names of what was cancelled.

    rows          (m, 9)  d1, d0, n2, n1, n0, o2, o1, o0 as in `loop.hold`, and 1 where the row is divided by the
                          denominators of the row before it too (and of those that one is divided by), else 0
    unobserved    names of motions that the wall force does not move or the sensor does not read
    sampled_form  states from which the chained rows, the last ones, are made; None: each row has two states of
                  its own
    """

    rows: Floats
    unobserved: tuple[str, ...]
    sampled_form: SampledForm | None = None


def sampled_sections(plant: Plant, period: float, fraction: float = 0.0, lag: float = 0.0) -> Sections:
    """The plant's rows for a sampling period T [s], the fractional part f of the delay [samples] and the time
    constant of the actuator [s].

    Raises UnmovedError where no mode is both moved by the wall force and read by the sensor; UnresolvedError where
    dampers couple modes and rounding hides what is read; HysteresisError for a plant with a loss factor.
    """
    check_no_loss_factor(plant)
    modes = real_modes(plant)
    # each free motion with damping has a pole at z = 1, for the place where it comes to rest: two share this pole
    if modes is not None and np.count_nonzero((modes.frequency_squared == 0.0) & (modes.decay != 0.0)) < 2:
        sections = _modal_sections(modes, period, fraction, lag)
    else:
        sections = _chained_sections(first_order_form(plant, period), period, fraction, lag)
    if not len(sections.rows):
        raise UnmovedError("the wall force moves nothing that the sensor reads; check actuator and sensor")
    return sections


def _modal_sections(modes: RealModes, period: float, fraction: float, lag: float) -> Sections:
    """Rows of classically damped modes; equal modes are one pair of poles with the sum of their residues.
    Other arguments as of `sampled_sections`."""
    residue = modes.input * modes.output
    total = float(np.sum(np.abs(modes.input)) * np.sum(np.abs(modes.output)))
    rows, unobserved = [], []
    for group in equal_modes(modes):
        decay, squared = float(modes.decay[group[0]]), float(modes.frequency_squared[group[0]])
        row = modal_row(decay, squared, period, fraction, lag)
        row[2:] *= float(np.sum(residue[group]))
        # What counts is the sampled residue: a mode at a multiple of the sampling rate is not reached by a hold. A
        # decay below 1e-9 per sample is none
        level = total * period**2 * (UNOBSERVED_UNDAMPED if abs(decay) * period < 1e-9 else UNOBSERVED)
        observed = bool(np.max(np.abs(row[2:])) > level)
        unobserved += [motion_name(squared, decay)] * (len(group) - observed)
        if observed:
            rows.append([*row, 0.0])
    return Sections(np.array(rows).reshape(-1, 9), tuple(unobserved))


def equal_modes(modes: RealModes) -> list[list[int]]:
    """Groups of modes, by their indices, that have one frequency and one damping to rounding."""
    tolerance = repeat_tolerance(modes.frequency_squared)
    largest_decay = max(float(np.max(np.abs(modes.decay))), np.finfo(float).tiny)
    groups: list[list[int]] = []
    for k in range(len(modes.decay)):
        for group in groups:
            apart = abs(modes.frequency_squared[k] - modes.frequency_squared[group[0]])
            if apart <= tolerance[k] and abs(modes.decay[k] - modes.decay[group[0]]) <= REPEATED * largest_decay:
                group.append(k)
                break
        else:
            groups.append([k])
    return groups


def _chained_sections(form: FirstOrderForm, period: float, fraction: float, lag: float) -> Sections:
    """Rows of the free motion beside a first-order form, and of the form: a chain in doubles, else one in decimal
    arithmetic, else one row for each pair of poles, whichever is nearest to the form's response. Raises
    UnresolvedError where all are far from it. Other arguments as of `sampled_sections`."""
    free_rows = []
    if form.free_residue:
        row = modal_row(0.0, 0.0, period, fraction, lag)
        row[2:] *= form.free_residue
        free_rows.append([*row, 0.0])
    unobserved = [motion_name(0.0, 0.0)] * (form.free_count - len(free_rows))
    unobserved += [pole_name(pole) for pole in form.hidden_poles if pole.imag >= 0.0]
    # a chain shrinks slow motions, beside which what rounding leaves of a fast hidden one would not stay small
    form = without_hidden_poles(form)
    sampled = sample_form(form, period, fraction, lag)
    rows = form_rows(form, sampled, period)
    m = len(rows)  # rows that are kept
    while m and _repeats(rows[m - 1], rows[: m - 1]):
        m -= 1
    unobserved += ["motion that decays as another one does"] * (len(rows) - m)
    states = sampled if m == len(rows) else None  # fewer rows do not stand for all states
    chained = np.column_stack([rows[:m], np.arange(m) > 0])
    off = rows_error(chained, sampled)
    if off > KEPT_DIGITS and states is not None:
        exact = exact_rows(form, sampled, period)
        tried = np.column_stack([exact, np.arange(len(exact)) > 0])
        if len(tried) and rows_error(tried, sampled) < off:
            off, chained = rows_error(tried, sampled), tried
    if off > FEW_DIGITS:
        apart = separate_rows(form, period, fraction, lag)
        tried = np.column_stack([apart, np.zeros(len(apart))])
        if len(tried) and rows_error(tried, sampled) < off:
            off, chained, states = rows_error(tried, sampled), tried, None
    if off > LOST_DIGITS:
        raise UnresolvedError(
            "the wall force moves so little that the sensor reads that rounding hides it: two ways to compute the "
            f"response differ by {100.0 * off:.2g} %; check actuator, sensor and the springs and dampers between"
        )
    return Sections(np.vstack([np.array(free_rows).reshape(-1, 9), chained]), tuple(unobserved), states)


def _repeats(row: Floats, earlier: Floats) -> bool:
    """Whether a chain's row (8,) has the poles of one of the earlier, (k, 8), and adds nothing to it: two equal
    motions, of which force and sensor see but one.

    A row is divided by the earlier one's denominator and its own. That, d^2 + d1 d + d0, is of the size rate^2 at
    |d| = rate, the size of its poles; so its numerators are compared with rate^2 times the earlier one's.
    """

    def size(other: Floats) -> float:
        """Size of a row's numerators at |d| = rate."""
        n2, n1, n0 = np.max(np.abs(other[2:].reshape(2, 3)), axis=0)
        return float((n2 * rate + n1) * rate + n0)

    rate = max(float(np.sqrt(abs(row[1]))), abs(float(row[0])))
    for other in earlier:
        apart = abs(row[0] - other[0]) / max(rate, 1e-300), abs(row[1] - other[1]) / max(rate**2, 1e-300)
        if max(apart) <= SAME_POLES and size(row) <= SAME_POLES * rate**2 * size(other):
            return True
    return False


def section_rows(pairs: PolePairs, controller: Controller) -> tuple[Floats, Ints]:
    """Rows (N, m, 9) of N plants, columns of `Sections.rows`, and how many of each are used (N,): 0 where reach is
    nan or inf, or the wall moves nothing that the sensor reads.

    controller  the same for all plants, or one of N designs for each
    """
    rows = np.zeros((*pairs.decay.shape, 9))
    used = np.empty(len(rows), dtype=np.int64)
    delay = np.ravel(np.asarray(controller.delay, dtype=np.float64))
    fraction = np.maximum(delay - whole_samples(delay), 0.0)
    period = np.array(np.ravel(controller.sampling_period), dtype=np.float64)
    lag = np.array(np.ravel(controller.actuator_time_constant), dtype=np.float64)

    def several(first: int, last: int) -> None:
        """Fill in the rows of plants first to last - 1."""
        fill_rows(
            pairs.decay, pairs.frequency_squared, pairs.position, pairs.velocity, pairs.reach, period, fraction,
            lag, bool(lag.any()), rows, used, first, last,
        )  # fmt: skip

    in_chunks(several, len(rows))
    return rows, used


@compiled
def fill_rows(
    decay: Floats,
    squared: Floats,
    position: Floats,
    velocity: Floats,
    reach: Floats,
    periods: Floats,
    fractions: Floats,
    lags: Floats,
    lagging: bool,
    rows: Floats,
    used: Ints,
    first: int,
    last: int,
) -> None:
    """Fill in `rows` (N, m, 9) and `used` (N,) of `section_rows` for plants first to last - 1.

    decay, squared, position, velocity, reach  the attributes of `PolePairs`, (N, m), reach (N,)
    periods, fractions, lags                   (N,), or (1,): that one serves all; [s], [samples], [s]
    lagging                                    whether the force of any of the plants lags
    """
    m = squared.shape[1]
    taken = np.empty(m, dtype=np.bool_)
    for i in range(first, last):
        period = periods[i if len(periods) > 1 else 0]
        fraction = fractions[i if len(fractions) > 1 else 0]
        lag = lags[i if len(lags) > 1 else 0]
        used[i] = 0
        # a plant without numbers has no sections: `used` stays 0
        if not np.isfinite(reach[i]):
            continue
        stiffest, fastest = 0.0, 0.0
        for k in range(m):
            taken[k] = False
            stiffest, fastest = max(stiffest, abs(squared[i, k])), max(fastest, abs(decay[i, k]))
        for k in range(m):
            if taken[k]:
                continue
            x, v = position[i, k], velocity[i, k]  # the section's shares in the reading
            for j in range(k + 1, m):
                # pairs of one frequency and damping are one section with the sum of their shares: apart, rounding
                # would leave a pole and a zero that nearly cancel
                apart = abs(squared[i, j] - squared[i, k])
                if apart <= REPEATED * stiffest and abs(decay[i, j] - decay[i, k]) <= REPEATED * fastest:
                    taken[j] = True
                    x, v = x + position[i, j], v + velocity[i, j]
            if lagging:
                row = lagged_row(decay[i, k], squared[i, k], x, v, period, fraction, lag)
            else:
                row = held_row(decay[i, k], squared[i, k], x, v, period, fraction)
            still = abs(decay[i, k]) * period < 1e-9
            # a mode that the wall does not move, or the sensor does not read, is only rounding: it is left out.
            # The numerators of a free mode are of the size of its share times the period squared
            level = reach[i] * period**2 * (UNOBSERVED_UNDAMPED if still else UNOBSERVED)
            size = 0.0
            for c in range(2, 8):
                size = max(size, abs(row[c]))
            if not size > level:
                continue
            for c in range(8):
                rows[i, used[i], c] = row[c]
            rows[i, used[i], 8] = 0.0
            used[i] += 1


MOST: Final = 12  # coordinates of which the kernel finds the modes; of more they are found faster otherwise


def plant_rows(plant: Plant, controller: Controller) -> Floats | None:
    """A plant's rows (m, 9): d1, d0, n2, n1, n0, o2, o1, o0 as in `loop.hold`, and 0 since none is chained.

    Returns  None for a plant that `sampled_sections` says more about: dampers that couple its modes or lag, a loss
             factor, numbers that are not finite, a wall force that moves nothing that the sensor reads; and for a
             large one
    """
    if plant.lagged_dampers or plant.hysteresis is not None or plant.size > MOST:
        return None
    n = plant.size
    numbers, drag, coupled = np.empty((5, 1, n)), np.empty((1, n, n)), np.zeros(1, dtype=np.bool_)
    decay, squared, enter, leave, handle = numbers
    M, B, K, actuator, sensor = (
        np.array(each, dtype=np.float64)[None]
        for each in (plant.mass, plant.damping, plant.stiffness, plant.actuator, plant.sensor)
    )
    # the actuator stands in for a handle, which rows do not need
    fill_modes(M, B, K, actuator, sensor, actuator, decay, squared, enter, leave, handle, drag, coupled, 0, 1)
    if coupled[0] or not np.isfinite(numbers).all():
        return None
    position, none = enter * leave, np.zeros((1, n))
    reach = np.abs(enter).sum(axis=1) * np.abs(leave).sum(axis=1)
    timing = (controller.sampling_period, controller.fractional_delay, controller.actuator_time_constant)
    T, fraction, lag = np.array(timing, dtype=np.float64).reshape(3, 1)
    rows, used = np.zeros((1, n, 9)), np.empty(1, dtype=np.int64)
    fill_rows(decay, squared, position, none, reach, T, fraction, lag, bool(lag[0] > 0.0), rows, used, 0, 1)
    return rows[0, : used[0]] if used[0] > 0 else None
