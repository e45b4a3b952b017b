"""The sampled plant as rows of second-order factors, without what no wall moves or no sensor reads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.coupled_hold import SampledForm, exact_rows, form_rows, rows_error, sample_form, separate_rows
from zwidth.loop.hold import modal_row
from zwidth.loop.motion_names import motion_name, pole_name
from zwidth.model.first_order_form import FirstOrderForm, first_order_form, without_hidden_poles
from zwidth.model.modes import (
    REPEATED,
    UNOBSERVED,
    UNOBSERVED_UNDAMPED,
    RealModes,
    real_modes,
    repeat_tolerance,
)
from zwidth.model.plant import Plant

# Two pairs of poles of a chain within this relative distance are equal poles that rounding has set apart.
SAME_POLES = 1e-6
# A chain that misses the response by more than the first is written again in decimal arithmetic: a root on the
# unit circle, which moves by about as much, would else be off it by what eigenvalues see (1e-9). By more than the
# second it is tried pole by pole; by more than the third, two ways to write it tell nothing of the plant.
KEPT_DIGITS, FEW_DIGITS, LOST_DIGITS = 1e-12, 1e-8, 1e-4


class UnmovedError(ValueError):
    """A plant of which the wall moves nothing that the sensor reads."""


class UnresolvedError(UnmovedError):
    """A plant of which the wall moves so little that the sensor reads that rounding hides it."""


class HysteresisError(ValueError):
    """A plant with a loss factor, which describes steady vibration and not motion in time."""


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
    refuse_loss_factor(plant)
    modes = real_modes(plant)
    # each free motion with damping has a pole at z = 1, for the place where it comes to rest: two share this pole
    if modes is not None and np.count_nonzero((modes.frequency_squared == 0.0) & (modes.decay != 0.0)) < 2:
        sections = _modal_sections(modes, period, fraction, lag)
    else:
        sections = _chained_sections(first_order_form(plant, period), period, fraction, lag)
    if not len(sections.rows):
        raise UnmovedError("the wall force moves nothing that the sensor reads; check actuator and sensor")
    return sections


def refuse_loss_factor(plant: Plant) -> None:
    """Raise HysteresisError for a plant with a loss factor."""
    if plant.hysteresis is not None:
        raise HysteresisError(
            "a loss factor describes steady vibration, not motion in time: only the chart and verdicts on walls "
            "can be computed with it; describe the damping by damping_Ns_per_m instead"
        )


def _modal_sections(modes: RealModes, period: float, fraction: float, lag: float) -> Sections:
    """Rows of classically damped modes; equal modes are one pair of poles with the sum of their residues."""
    residue = modes.input * modes.output
    total = float(np.sum(np.abs(modes.input)) * np.sum(np.abs(modes.output)))
    rows, unobserved = [], []
    for group in equal_modes(modes):
        decay, squared = float(modes.decay[group[0]]), float(modes.frequency_squared[group[0]])
        row = modal_row(decay, squared, period, fraction, lag)
        row[2:] *= float(np.sum(residue[group]))
        # What counts is the sampled residue: a mode at a multiple of the sampling rate is not reached by a hold
        level = total * period**2 * (UNOBSERVED_UNDAMPED if abs(decay) * period < 1e-9 else UNOBSERVED)
        observed = bool(np.max(np.abs(row[2:])) > level)
        unobserved += [motion_name(squared, decay)] * (len(group) - observed)
        if observed:
            rows.append([*row, 0.0])
    return Sections(np.array(rows).reshape(-1, 9), tuple(unobserved))


def equal_modes(modes: RealModes) -> list[list[int]]:
    """Modes of one frequency and one damping, to rounding."""
    tolerance = repeat_tolerance(modes.frequency_squared)
    drag = max(float(np.max(np.abs(modes.decay))), np.finfo(float).tiny)
    groups: list[list[int]] = []
    for k in range(len(modes.decay)):
        for group in groups:
            apart = abs(modes.frequency_squared[k] - modes.frequency_squared[group[0]])
            if apart <= tolerance[k] and abs(modes.decay[k] - modes.decay[group[0]]) <= REPEATED * drag:
                group.append(k)
                break
        else:
            groups.append([k])
    return groups


def _chained_sections(form: FirstOrderForm, period: float, fraction: float, lag: float) -> Sections:
    """Rows of a first-order form, and of the free motion beside it."""
    alone = []
    if form.free_residue:
        row = modal_row(0.0, 0.0, period, fraction, lag)
        row[2:] *= form.free_residue
        alone.append([*row, 0.0])
    unobserved = [motion_name(0.0, 0.0)] * (form.free_count - len(alone))
    unobserved += [pole_name(pole) for pole in form.hidden_poles if pole.imag >= 0.0]
    # a chain shrinks slow motions, beside which what rounding leaves of a fast hidden one would not stay small
    form = without_hidden_poles(form)
    sampled = sample_form(form, period, fraction, lag)
    rows = form_rows(form, sampled, period)
    m = len(rows)
    while m and _repeats(rows[m - 1], rows[: m - 1]):
        m -= 1
    unobserved += ["motion that decays as another one does"] * (len(rows) - m)
    states = sampled if m == len(rows) else None
    chained = np.column_stack([rows[:m], np.arange(m) > 0])
    off = rows_error(chained, sampled)
    if off > KEPT_DIGITS and states is not None:
        exact = exact_rows(form, sampled, period)
        own = np.column_stack([exact, np.arange(len(exact)) > 0])
        if len(own) and rows_error(own, sampled) < off:
            off, chained = rows_error(own, sampled), own
    if off > FEW_DIGITS:
        apart = separate_rows(form, period, fraction, lag)
        own = np.column_stack([apart, np.zeros(len(apart))])
        if len(own) and rows_error(own, sampled) < off:
            off, chained, states = rows_error(own, sampled), own, None
    if off > LOST_DIGITS:
        raise UnresolvedError(
            "the wall force moves so little that the sensor reads that rounding hides it: two ways to compute the "
            f"response differ by {100.0 * off:.2g} %; check actuator, sensor and the springs and dampers between"
        )
    return Sections(np.vstack([np.array(alone).reshape(-1, 9), chained]), tuple(unobserved), states)


def _repeats(row: Floats, earlier: Floats) -> bool:
    """Whether a chain's row has the poles of an earlier one and adds nothing to it: two equal motions, of which
    force and sensor see but one."""

    def size(other: Floats) -> float:
        n2, n1, n0 = np.max(np.abs(other[2:].reshape(2, 3)), axis=0)
        return float((n2 * rate + n1) * rate + n0)

    rate = max(float(np.sqrt(abs(row[1]))), abs(float(row[0])))
    for other in earlier:
        apart = abs(row[0] - other[0]) / max(rate, 1e-300), abs(row[1] - other[1]) / max(rate**2, 1e-300)
        if max(apart) <= SAME_POLES and size(row) <= SAME_POLES * rate**2 * size(other):
            return True
    return False
