"""The modes of many given plants at once; `modes.real_modes` says the same of one, with its special cases."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.compiled import compiled
from zwidth.model.design_axes import design_shape
from zwidth.model.modes import REPEATED, RIGID
from zwidth.model.plant import Plant
from zwidth.model.rendered_modes import RenderedModes, jacobi
from zwidth.threads import in_chunks

STILL = 1e-14  # share of the largest damping below which a mode's own is rounding


def plant_modes(plant: Plant, designs: tuple[int, ...] = ()) -> RenderedModes:
    """The modes of each of N designs of a plant, in the form of those of a mechanism's postures.

    designs  shape of the designs, where their plants are all the same
    Returns  with `drag`, and as coupled also two modes of one frequency or two free motions with damping; nan as
             input where a plant is to be looked at alone: dampers that lag, a loss factor, masses that are not
             positive
    """
    shape = np.broadcast_shapes(design_shape(plant), designs)
    N, n = int(np.prod(shape)), plant.size
    M, B, K = (_flat(each, shape, 2) for each in (plant.mass, plant.damping, plant.stiffness))
    actuator, sensor = (_flat(each, shape, 1) for each in (plant.actuator, plant.sensor))
    handle = np.full((N, n), np.nan) if plant.handle is None else _flat(plant.handle, shape, 1)
    drag, coupled = np.full((N, n, n), np.nan), np.zeros(N, dtype=np.bool_)
    decay, squared, enter, leave, held = (np.full((N, n), np.nan) for _ in range(5))
    modes = RenderedModes(decay, squared, enter, leave, held, drag, coupled)
    if plant.lagged_dampers or plant.hysteresis is not None:
        return modes

    def several(first: int, last: int) -> None:
        fill_modes(
            M, B, K, actuator, sensor, handle, decay, squared, enter, leave, held, drag, coupled, first, last,
        )  # fmt: skip

    in_chunks(several, N)
    return modes


def _flat(array: Floats, shape: tuple[int, ...], own: int) -> Floats:
    """One axis of designs, as an array that can be written to: kernels are compiled once for these."""
    tail = array.shape[array.ndim - own :]
    return np.array(np.broadcast_to(array, (*shape, *tail)).reshape(-1, *tail), dtype=np.float64, order="C")


@compiled
def fill_modes(
    mass: Floats,
    damping: Floats,
    stiffness: Floats,
    actuator: Floats,
    sensor: Floats,
    handle: Floats,
    decay: Floats,
    squared: Floats,
    enter: Floats,
    leave: Floats,
    held: Floats,
    drag: Floats,
    coupled: Flags,
    first: int,
    last: int,
) -> None:
    """Modes of plants first to last - 1, as in `plant_modes`."""
    n = mass.shape[1]
    root, A, V, shapes = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    for i in range(first, last):
        positive, together = cholesky(mass[i], root), False
        relative(root, stiffness[i], A)
        jacobi(A, V)
        # mass-normalised shapes: the columns of root^-T V
        for k in range(n):
            for r in range(n - 1, -1, -1):
                value = V[r, k]
                for s in range(r + 1, n):
                    value -= root[s, r] * shapes[s, k]
                shapes[r, k] = value / root[r, r]
        scale = 0.0
        for k in range(n):
            scale = max(scale, abs(A[k, k]))
        largest, off, free = 0.0, 0.0, 0
        for k in range(n):
            value = A[k, k]
            squared[i, k] = 0.0 if abs(value) <= RIGID * max(scale, 2.3e-308) else value
            for j in range(k):
                together = together or abs(A[k, k] - A[j, j]) <= REPEATED * scale
            for j in range(k + 1):
                value = 0.0
                for r in range(n):
                    for s in range(n):
                        value += shapes[r, k] * damping[i, r, s] * shapes[s, j]
                drag[i, k, j] = drag[i, j, k] = value
                off = off if j == k else max(off, abs(value))
                largest = max(largest, abs(value))
        for k in range(n):
            for j in range(n):
                drag[i, k, j] = 0.0 if abs(drag[i, k, j]) <= STILL * largest else drag[i, k, j]
            decay[i, k] = 0.5 * drag[i, k, k]
            free += squared[i, k] == 0.0 and decay[i, k] != 0.0
            enter[i, k], leave[i, k], held[i, k] = 0.0, 0.0, 0.0
            for r in range(n):
                enter[i, k] += shapes[r, k] * actuator[i, r]
                leave[i, k] += shapes[r, k] * sensor[i, r]
                held[i, k] += shapes[r, k] * handle[i, r]
        coupled[i] = together or free > 1 or off > REPEATED * largest
        if not positive:
            for k in range(n):
                enter[i, k] = np.nan


@compiled
def cholesky(A: Floats, root: Floats) -> bool:
    """The lower triangle L of A = L L^T (n, n); whether A is positive definite."""
    n = A.shape[0]
    for j in range(n):
        for r in range(j, n):
            value = A[r, j]
            for k in range(j):
                value -= root[r, k] * root[j, k]
            if r > j:
                root[r, j] = value / root[j, j]
            elif value > 0.0:
                root[j, j] = np.sqrt(value)
            else:
                return False
    return True


@compiled
def relative(root: Floats, A: Floats, out: Floats) -> None:
    """root^-1 A root^-T of a symmetric A (n, n), root a lower triangle."""
    n = A.shape[0]
    for c in range(n):
        for r in range(n):
            value = A[r, c]
            for k in range(r):
                value -= root[r, k] * out[k, c]
            out[r, c] = value / root[r, r]
    for r in range(n):
        for c in range(n):
            value = out[r, c]
            for k in range(c):
                value -= root[c, k] * out[r, k]
            out[r, c] = value / root[c, c]
    for r in range(n):
        for c in range(r):
            out[r, c] = out[c, r] = 0.5 * (out[r, c] + out[c, r])
