"""A plant with several rendered directions, sampled with an exact hold: the part of it that walls move.

The mechanical states are undamped modes, each with its velocity in units of its own rate, so that slow and fast
modes have entries of one size. Motions that no wall moves or no encoder reads are left out: of modes with equal
poles as many remain as the rank of their m x m residue; of modes coupled by damping, those remain whose own
residue is more than rounding.

A delay of l + f samples splits the interval: the older force acts for f T, the newer for (1 - f) T. With
Gamma(t) the integral of exp(A s) over [0, t], one exponential of the augmented matrix [A, 1; 0, 0] each,

    x_{j+1} = x_j + A Gamma(T) x_j + Gamma((1 - f) T) B u_{j-l} + exp(A (1 - f) T) Gamma(f T) B u_{j-l-1}.

An actuator lag tau f' + f = u adds m states f to A before the exponential is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.loop.motion_names import motion_name, pole_name
from zwidth.model.modes import (
    REPEATED,
    UNOBSERVED,
    UNOBSERVED_UNDAMPED,
    clusters,
    repeat_tolerance,
    undamped_modes,
)
from zwidth.model.multi_plant import MultiPlant

# Condition number of the damped modes' eigenvectors above which their residues are only rounding.
DEFECTIVE = 1e7


@dataclass(frozen=True)
class ContinuousPlant:
    """x' = A x + B f,  y = C x: the part of a plant that walls move.

    A (N, N), B (N, m), C (m, N)
    unobserved  names of the motions that were left out
    """

    A: Floats
    B: Floats
    C: Floats
    unobserved: tuple[str, ...]


@dataclass(frozen=True)
class SampledPlant:
    """x_{j+1} = (1 + step) x_j + new u_{j-l} + old u_{j-l-1},  y = C x.

    step  (N, N);  new, old  (N, m);  reading  (m, N)
    """

    step: Floats
    new: Floats
    old: Floats
    reading: Floats


def continuous_plant(plant: MultiPlant, period: float, fraction: float) -> ContinuousPlant:
    """The motions that walls move and encoders read, in states of comparable size.

    period    T [s], for which each force is held
    fraction  f, fractional part of the delay [samples]
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    tolerance = repeat_tolerance(squared)
    for run in clusters(squared, tolerance):  # equal frequencies: onto the axes of their own damping
        local = shapes[:, run].T @ plant.damping @ shapes[:, run]
        shapes[:, run] = shapes[:, run] @ np.linalg.eigh((local + local.T) / 2.0)[1]
    damping = shapes.T @ plant.damping @ shapes
    level = max(float(np.max(np.abs(damping))), np.finfo(float).tiny)
    damping[np.abs(damping) <= 1e-14 * level] = 0.0
    inputs, outputs = shapes.T @ plant.actuators.T, plant.sensors @ shapes
    total = float(np.linalg.norm(inputs, axis=1).sum() * np.linalg.norm(outputs, axis=0).sum())
    coupled = np.abs(damping - np.diag(np.diag(damping))) > REPEATED * level
    from scipy.sparse.csgraph import connected_components  # imported here: it takes 0.2 s

    count, block_of = connected_components(coupled, directed=False)
    alone = np.array([int(np.sum(block_of == number)) == 1 for number in block_of], dtype=bool)
    parts = [
        _equal_poles(squared[k], damping[k, k], inputs[group], outputs[:, group], (period, fraction), total)
        for group in _groups(squared, np.diag(damping), np.flatnonzero(alone), tolerance, REPEATED * level)
        for k in group[:1]
    ]
    for c in range(count):
        members = np.flatnonzero(block_of == c)
        if len(members) > 1:
            block = damping[np.ix_(members, members)]
            parts.append(_coupled(squared[members], block, inputs[members], outputs[:, members], period))
    from scipy.linalg import block_diag

    A = block_diag(*(part.A for part in parts))
    return ContinuousPlant(
        A.reshape(-1, sum(len(part.A) for part in parts)),
        np.vstack([part.B for part in parts]),
        np.hstack([part.C for part in parts]),
        tuple(name for part in parts for name in part.unobserved),
    )


def _groups(
    squared: Floats, drag: Floats, members: Ints, tolerance: Floats, drag_tolerance: float
) -> list[list[int]]:
    """Modes in groups of equal frequency squared and damping, within tolerances (n,) [1/s^2] and [1/s]."""
    groups: list[list[int]] = []
    for k in members.tolist():
        for group in groups:
            g = group[0]
            if abs(squared[k] - squared[g]) <= tolerance[k] and abs(drag[k] - drag[g]) <= drag_tolerance:
                group.append(k)
                break
        else:
            groups.append([k])
    return groups


def _pairs(squared: Floats, damping: Floats, inputs: Floats, outputs: Floats, period: float) -> ContinuousPlant:
    """Second-order modes as states [x; v / rate]: a slow mode's pair stays well apart from z = 1."""
    k = len(squared)
    rate = np.maximum(np.sqrt(np.abs(squared)), np.abs(np.diag(damping)))
    rate[rate == 0.0] = 1.0 / period
    A = np.block(
        [[np.zeros((k, k)), np.diag(rate)], [-np.diag(squared / rate), -damping * (rate / rate[:, None])]]
    )
    B = np.vstack([np.zeros_like(inputs), inputs / rate[:, None]])
    return ContinuousPlant(A, B, np.hstack([outputs, np.zeros_like(outputs)]), ())


def _equal_poles(
    squared: float, drag: float, inputs: Floats, outputs: Floats, sampling: tuple[float, float], total: float
) -> ContinuousPlant:
    """States of modes with equal poles: as many modes as the rank of their residue, by its singular values."""
    period, decay = sampling[0], drag / 2.0
    left, strength, right = np.linalg.svd(outputs @ inputs)
    level = total * (UNOBSERVED_UNDAMPED if abs(decay) * period < 1e-9 else UNOBSERVED)
    rank = int(np.sum(strength[: len(inputs)] * _reach(squared, drag, *sampling) > level))
    root = np.sqrt(strength[:rank])
    enters, leaves = root[:, None] * right[:rank], left[:, :rank] * root
    states = _pairs(np.full(rank, squared), drag * np.eye(rank), enters, leaves, period)
    return ContinuousPlant(states.A, states.B, states.C, (motion_name(squared, decay),) * (len(inputs) - rank))


def _reach(squared: float, drag: float, period: float, fraction: float) -> float:
    """Motion of a mode by a held force, as a share of a free mass's; 0 at multiples of the sampling rate."""
    one = np.ones((1, 1))
    mode = _pairs(np.array([squared]), np.array([[drag]]), one, one, period)
    held = sample_plant(mode, period, fraction, 0.0)
    size = np.array([[1.0], [period * mode.A[0, 1]]]) / period**2
    return float(max(np.max(np.abs(held.new * size)), np.max(np.abs(held.old * size))))


def _coupled(squared: Floats, damping: Floats, inputs: Floats, outputs: Floats, period: float) -> ContinuousPlant:
    """Modes that their damping couples; damped modes that no wall moves are split off by their eigenvectors."""
    whole = _pairs(squared, damping, inputs, outputs, period)
    poles, right = np.linalg.eig(whole.A)
    if np.linalg.cond(right) > DEFECTIVE:
        return whole
    source = np.linalg.solve(right, whole.B.astype(complex))
    readings = whole.C @ right
    reach = np.abs(np.expm1(poles * period) / np.where(poles == 0.0, 1.0, poles)) + period * (poles == 0.0)
    strength = np.linalg.norm(source, axis=1) * np.linalg.norm(readings, axis=0) * reach
    keep = strength > UNOBSERVED * float(np.sum(strength))
    if keep.all():
        return whole
    names = [pole_name(poles[k]) for k in np.flatnonzero(~keep & (poles.imag >= 0.0))]
    chosen = np.flatnonzero(keep & (poles.imag >= 0.0))
    # real and imaginary parts of the chosen eigenvectors span the part that remains
    basis = np.hstack([np.column_stack([right[:, k].real, right[:, k].imag]) for k in chosen])
    basis = basis[:, np.linalg.norm(basis, axis=0) > 0.0]
    dual = np.linalg.inv(right)
    rows = np.vstack([np.vstack([2.0 * dual[k].real, -2.0 * dual[k].imag]) for k in chosen])
    real = np.concatenate([[poles[k].imag == 0.0] * 2 for k in chosen])
    rows = np.where(real[:, None], rows / 2.0, rows)[~(real & (np.arange(len(rows)) % 2 == 1))]
    return ContinuousPlant(rows @ whole.A @ basis, rows @ whole.B, whole.C @ basis, tuple(names))


def sample_plant(motion: ContinuousPlant, period: float, fraction: float, lag: float) -> SampledPlant:
    """Sample a motion: forces held for a period T [s], a fractional delay f [samples], an actuator lag tau [s]."""
    A, B, C = motion.A, motion.B, motion.C
    N, m = B.shape
    if lag > 0.0:
        A = np.block([[A, B], [np.zeros((m, N)), -np.eye(m) / lag]])
        B = np.vstack([np.zeros((N, m)), np.eye(m) / lag])
        C = np.hstack([C, np.zeros((m, m))])
    _, whole = _integrals(A, period)
    late, new = _integrals(A, (1.0 - fraction) * period)
    _, early = _integrals(A, fraction * period)
    return SampledPlant(A @ whole, new @ B, late @ early @ B, C)


def _integrals(A: Floats, time: float) -> tuple[Floats, Floats]:
    """exp(A t) and its integral over [0, t]."""
    N = len(A)
    whole = np.zeros((2 * N, 2 * N))
    whole[:N, :N], whole[:N, N:] = A * time, np.eye(N)
    from scipy.linalg import expm

    exponential = expm(whole)
    return exponential[:N, :N], exponential[:N, N:] * time
