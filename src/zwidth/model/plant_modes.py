"""The modes of many given plants at once; `modes.real_modes` says the same of one, with its special cases.

The modes of many postures of a mechanism whose drives are not its coordinates, or whose joints act by
themselves.

The full model's matrices (`reduction.full_matrices`) are put together for all postures at once, as a plant of as
many designs, whose modes are found as those of any given plant.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.compiled import compiled
from zwidth.model.design_axes import design_shape
from zwidth.model.effective_mass import DriveSide, drive_side, lever_arms, screw
from zwidth.model.mechanism import Damping, Mechanism, ModalDamping, ProportionalDamping, at_postures
from zwidth.model.mechanism_arrays import design_of_each, per_design
from zwidth.model.modes import REPEATED, RIGID
from zwidth.model.plant import Plant
from zwidth.model.posture import OK, Posture
from zwidth.model.reduction import Encoders
from zwidth.model.rendered_modes import RenderedModes, jacobi
from zwidth.resources import in_chunks

STILL = 1e-14  # share of the largest damping below which a mode's own is rounding


def plant_modes(plant: Plant, designs: tuple[int, ...] = ()) -> RenderedModes:
    """The modes of each of N designs of a plant, in the form of those of a mechanism's postures.

    designs  shape with which that of the plant's own designs broadcasts; the result is flat, of N designs
    Returns  with `drag`, and as coupled also two modes of one frequency or two free motions with damping; nan as
             handle where the plant has none, and as input where a plant has to be computed by itself, in another
             way: dampers that lag, a loss factor, masses that are not positive
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
        """Fill in the modes of plants first to last - 1."""
        fill_modes(
            M, B, K, actuator, sensor, handle, decay, squared, enter, leave, held, drag, coupled, first, last,
        )  # fmt: skip

    in_chunks(several, N)
    return modes


def _flat(array: Floats, shape: tuple[int, ...], own: int) -> Floats:
    """An array (shape, own axes), of so many own ones, as (N, own axes), writable: kernels are compiled once for
    such."""
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
    """Fill the fields of `RenderedModes` of plants first to last - 1, given by their matrices (N, n, n) and
    vectors (N, n): decay, squared, enter, leave (its output), held (its handle), drag and coupled, as
    `plant_modes` says.
    """
    n = mass.shape[1]
    root, A, V, shapes = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    for i in range(first, last):
        positive, repeated = cholesky(mass[i], root), False
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
        largest, largest_coupling, free = 0.0, 0.0, 0
        # squared frequencies, and the dampers V^T B V between modes
        for k in range(n):
            value = A[k, k]
            # 2.3e-308, the least normal number: exact zeros alone have a scale of 0
            squared[i, k] = 0.0 if abs(value) <= RIGID * max(scale, 2.3e-308) else value
            for j in range(k):
                repeated = repeated or abs(A[k, k] - A[j, j]) <= REPEATED * scale
            for j in range(k + 1):
                value = 0.0
                for r in range(n):
                    for s in range(n):
                        value += shapes[r, k] * damping[i, r, s] * shapes[s, j]
                drag[i, k, j] = drag[i, j, k] = value
                largest_coupling = largest_coupling if j == k else max(largest_coupling, abs(value))
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
        # equal modes, as several free ones are, come out in any combination: dampers may couple these
        coupled[i] = repeated or free > 1 or largest_coupling > REPEATED * largest
        if not positive:
            for k in range(n):
                enter[i, k] = np.nan


@compiled
def cholesky(A: Floats, root: Floats) -> bool:
    """Fill root (n, n) with the lower triangle L of A = L L^T (n, n); False where A is not positive definite."""
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
    """root^-1 A root^-T of a symmetric A (n, n) into out (n, n); root is a lower triangle."""
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
            # the eigenvalues are taken of a matrix that is symmetric to the last digit
            out[r, c] = out[c, r] = 0.5 * (out[r, c] + out[c, r])


@dataclass(frozen=True)
class Postures:
    """N postures and their directions, flat; those that are not OK stand for the first that is.

    known    (N,)  which are OK;   design (N,) of each
    h        (N, c)  lever arms;   mass (N, c, c)  of the links
    side     of the drives, (N, ...) but for dry friction
    flexible (d,)  marks of the flexible drives
    rotor, spring, damper (N, d)  at the joints;   spun (N, d)  J_m n
    """

    known: Flags
    design: Ints
    h: Floats
    mass: Floats
    side: DriveSide
    flexible: Flags
    rotor: Floats
    spring: Floats
    damper: Floats
    spun: Floats


def has_general_modes(mechanism: Mechanism) -> bool:
    """Whether `modes_in_general` applies: the same drives are flexible in all designs, and no winding is
    closed."""
    drives = mechanism.drives
    flexible = np.isfinite(per_design(mechanism, drives.stiffness, 1))
    braked = drives.winding_damping is not None and bool(np.any(drives.winding_damping))
    return bool((flexible == flexible[0]).all()) and not braked


def modes_in_general(
    mechanism: Mechanism, posture: Posture, direction: Floats, damping: Damping, encoders: Encoders
) -> RenderedModes:
    """The modes of each posture's full model, flat; nan as input where a posture is not OK or the drives cannot
    move the handle along its direction.

    mechanism  one for which `has_general_modes` says so
    direction  (..., 3) or (..., 6), and all else as for `rendered_modes.rendered_modes`
    """
    side, mechanism = drive_side(mechanism, posture), at_postures(mechanism, posture)
    flat = _flat_postures(mechanism, posture, side, screw(direction))
    M, K, D = _matrices(flat)
    B, ratio = _damping(mechanism, flat, damping, M, K, D)
    N, n = M.shape[:2]
    c, F = flat.h.shape[1], np.flatnonzero(flat.flexible)
    links = np.zeros((N, len(flat.flexible), n))
    links[:, :, :c] = flat.side.motion
    motors = links.copy()
    motors[:, F] = np.eye(n)[c:]
    torque_shares = flat.side.shares(flat.h)[:, None]
    actuator, reading = (
        (torque_shares @ motors)[:, 0],
        (torque_shares @ (motors if encoders == "motor" else links))[:, 0],
    )
    handle = np.concatenate([flat.h, np.zeros((N, len(F)))], axis=1)
    modes = plant_modes(Plant(M, B, K, actuator, reading, handle), (N,))
    moved = np.abs(flat.h[:, : flat.side.driven]).max(axis=1) > 0.0
    modes.input[np.logical_not(flat.known & moved)] = np.nan
    return _with_ratio(modes, ratio)


def _flat_postures(mechanism: Mechanism, posture: Posture, side: DriveSide, u: Floats) -> Postures:
    """Postures, drives' side and screws u (..., 6), broadcast with the designs and flattened to N. Which drives
    are flexible is read off the first: it is the same in all designs (`has_general_modes`)."""
    drives = mechanism.drives
    shape = np.broadcast_shapes(posture.status.shape, u.shape[:-1], mechanism.design_shape)
    design, known = design_of_each(mechanism, shape), np.broadcast_to(posture.status == OK, shape).ravel()
    first = int(np.argmax(known))

    def flat(array: Floats, own: int) -> Floats:
        """An array (..., own axes) as (N, own axes); at postures that are not OK the first OK one's numbers."""
        tail = array.shape[array.ndim - own :]
        full = np.broadcast_to(array, (*shape, *tail)).reshape(-1, *tail)
        return np.asarray(np.where(known.reshape(-1, *(1,) * own), full, full[first]))

    ratio = flat(drives.transmission, 1)
    inertia, spring, damper = (
        per_design(mechanism, x, 1)[design] for x in (drives.motor_inertia, drives.stiffness, drives.damping)
    )
    flat_side = replace(
        side,
        motion=flat(side.motion, 2),
        spin=None if side.spin is None else flat(side.spin, 2),
        stiffness=None if side.stiffness is None else flat(side.stiffness, 2),
        damping=None if side.damping is None else flat(side.damping, 2),
    )
    return Postures(
        known=known,
        design=design,
        h=flat(lever_arms(posture, u), 1),
        mass=flat(posture.mass_matrix, 2),
        side=flat_side,
        flexible=np.isfinite(spring[0]),
        rotor=ratio**2 * inertia,
        spring=ratio**2 * spring,
        damper=ratio**2 * damper,
        spun=ratio * inertia,
    )


def _matrices(at: Postures) -> tuple[Floats, Floats, Floats]:
    """Mass M and stiffness K (N, n, n) of the full model, and deflections D (N, f, n) of the flexible drives."""
    T, (N, c) = at.side.motion, at.h.shape
    F, R = np.flatnonzero(at.flexible), np.flatnonzero(~at.flexible)  # flexible drives, and rigid ones
    f, n = len(F), c + len(F)
    M = np.zeros((N, n, n))
    M[:, :c, :c] = at.mass + _transposed(T[:, R]) @ (at.rotor[:, R, None] * T[:, R])
    M[:, range(c, n), range(c, n)] = at.rotor[:, F]
    if at.side.spin is not None:
        spun = at.spun[..., None] * at.side.spin
        cross = _transposed(T[:, R]) @ spun[:, R]
        M[:, :c, :c] += cross + _transposed(cross)
        M[:, c:, :c], M[:, :c, c:] = spun[:, F], _transposed(spun[:, F])
    D = np.concatenate([T[:, F], np.broadcast_to(-np.eye(f), (N, f, f))], axis=2)
    K = _transposed(D) @ (at.spring[:, F, None] * D)
    if at.side.stiffness is not None:
        K[:, :c, :c] += at.side.stiffness
    return M, K, D


def _damping(
    mechanism: Mechanism, at: Postures, damping: Damping, M: Floats, K: Floats, D: Floats
) -> tuple[Floats, Floats | None]:
    """Damping B (N, n, n) of the full model; and the damping ratio (N,) that every flexible mode has besides, None
    for none. M, K and D are those of `_matrices`."""
    B, ratio, c = np.zeros_like(K), None, at.h.shape[1]

    def of_each(number: float | Floats) -> Floats:
        return np.asarray(np.broadcast_to(number, mechanism.design_shape).ravel()[at.design])

    if isinstance(damping, ModalDamping):
        ratio = of_each(damping.ratio)
    elif isinstance(damping, ProportionalDamping):
        r_m, r_k = of_each(damping.mass_coefficient_1_per_s), of_each(damping.stiffness_coefficient_s)
        B = r_m[:, None, None] * M + r_k[:, None, None] * K
    else:
        B = _transposed(D) @ (at.damper[:, at.flexible, None] * D)
    if at.side.damping is not None:
        B[:, :c, :c] += at.side.damping
    return B, ratio


def _with_ratio(modes: RenderedModes, ratio: Floats | None) -> RenderedModes:
    """The modes with a damping ratio (N,) added to each flexible one of a plant; None: with none added."""
    if ratio is None:
        return modes
    assert modes.drag is not None
    extra = ratio[:, None] * np.sqrt(np.maximum(modes.frequency_squared, 0.0))
    drag = modes.drag + 2.0 * extra[..., None] * np.eye(extra.shape[1])
    return replace(modes, decay=modes.decay + extra, drag=drag)


def _transposed(matrices: Floats) -> Floats:
    """Matrices (..., n, m) as (..., m, n)."""
    return np.swapaxes(matrices, -1, -2)
