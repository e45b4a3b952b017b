"""The device between samples as a port that an operator holds: responses and dissipation over frequency."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from zwidth.arrays import Complexes, Floats
from zwidth.model.first_order_form import IDLE, modal_damping, separated_modes
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import LaggedDamper, Plant

# Matrix entries that a response holds at once: 64 MB of complex numbers.
AT_ONCE = 2**22


@dataclass(frozen=True)
class Port:
    """Plant M x'' + B x' + K x = a u + h f in modal coordinates; u acts at the actuator, f at the port.

    squared  (n,)    squared natural frequencies, rigid ones exactly 0 [1/s²]
    damping  (n, n)  modal damping, symmetric [1/s]
    modal_actuator, modal_sensor, modal_port  (n,)  participation of actuator, sensor and port
    lagged   dampers with a lag, in modal coordinates
    """

    squared: Floats
    damping: Floats
    modal_actuator: Floats
    modal_sensor: Floats
    modal_port: Floats
    lagged: tuple[LaggedDamper, ...]

    @property
    def generator(self) -> Floats:
        """State matrix A (N, N) of x' = A x + b f; states are positions, velocities, forces of lagged dampers."""
        n, m = len(self.squared), len(self.lagged)
        A = np.zeros((2 * n + m, 2 * n + m))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = -np.diag(self.squared), -self.damping
        for i, damper in enumerate(self.lagged, start=2 * n):
            A[n : 2 * n, i] = -damper.along
            A[i, n : 2 * n] = damper.damping / damper.time_constant * damper.along
            A[i, i] = -1.0 / damper.time_constant
        return A

    @property
    def poles(self) -> Complexes:
        """All poles s [1/s] of the free plant, conjugates included."""
        return np.asarray(np.linalg.eigvals(self.generator), dtype=complex)

    @property
    def spectral_zeros(self) -> Complexes:
        """Finite s [1/s] at which the port takes in no power, Y(s) + Y(-s) = 0 for its mobility Y = s G_hh.

        With Y = c (s - A)^-1 b they are generalised eigenvalues s of

            [ A   0   b  ]       [ 1  0  0 ]
            [ 0  -A^T -c^T]  - s [ 0  1  0 ]
            [ c   b^T 0  ]       [ 0  0  0 ]
        """
        A, n = self.generator, len(self.squared)
        N = len(A)
        b = np.zeros(N)
        b[n : 2 * n] = self.modal_port
        pencil = np.zeros((2 * N + 1, 2 * N + 1))
        pencil[:N, :N], pencil[N:-1, N:-1] = A, -A.T
        pencil[:N, -1], pencil[N:-1, -1] = b, -b
        pencil[-1, :N], pencil[-1, N:-1] = b, b
        zeros, scale = scipy.linalg.eigvals(
            pencil, np.diag(np.append(np.ones(2 * N), 0.0)), homogeneous_eigvals=True
        )
        # c = b^T above, since the port's velocity is read where its force acts
        finite = np.abs(scale) > 0.0
        return np.asarray(zeros[finite] / scale[finite], dtype=complex)


def port(plant: Plant, held: Floats) -> Port:
    """The modes of a plant and its port, at which an operator holds the coordinate `held` . x, held (n,)."""
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    damping = modal_damping(plant, shapes)
    lagged = tuple(replace(damper, along=shapes.T @ damper.along) for damper in plant.lagged_dampers)
    return Port(squared, damping, shapes.T @ plant.actuator, shapes.T @ plant.sensor, shapes.T @ held, lagged)


@dataclass(frozen=True)
class PortResponse:
    """At angular frequencies w (...): compliances [m/N] and power taken in by the port.

    direct                             G_ya  from the actuator's force to the reading
    port_to_reading, actuator_to_port  G_yh, G_ha  from the port's force to the reading, from the actuator's force
                                       to the port
    port                               G_hh  at the port itself
    dissipation                        Re(jw G_hh), power taken in at the port by a force of one newton (times 2)
                                       [m/(N s)]
    """

    direct: Complexes
    port_to_reading: Complexes
    actuator_to_port: Complexes
    port: Complexes
    dissipation: Floats


def port_response(held: Port, frequency: Floats) -> PortResponse:
    """Responses of a held port at angular frequencies (...) [rad/s], not zero.

    The dissipation is the quadratic form w^2 X^H Re(B) X of the motion X, a sum without cancellation, where the
    real part of jw G_hh would lose its digits against the imaginary part. Modes whose damping does not couple them
    are summed one by one, others solved for together.
    """
    w = np.asarray(frequency, dtype=float)
    n = len(held.squared)
    coupled = bool(held.lagged) or np.count_nonzero(held.damping) > np.count_nonzero(np.diag(held.damping))
    respond = _coupled_response if coupled else _modal_response
    step = max(AT_ONCE // max(n * n if coupled else n, 1), 1)
    flat = w.ravel()
    parts = [respond(held, flat[i : i + step]) for i in range(0, max(len(flat), 1), step)]
    return PortResponse(*(np.concatenate(each).reshape(w.shape) for each in zip(*parts, strict=True)))


def _dynamic_stiffnesses(held: Port, w: Floats) -> Floats:
    """w_i^2 - w^2 (k, n) at frequencies (k,); exactly at an undamped mode, where the response is infinite, it is
    taken a rounding error beside it."""
    stiff = held.squared - w[:, None] ** 2
    return np.where(stiff == 0.0, 1e-16 * w[:, None] ** 2, stiff)


def _modal_response(held: Port, w: Floats) -> tuple[Complexes | Floats, ...]:
    """The fields of `PortResponse`, in its order, (k,) each at w (k,), of modes that no damping couples."""
    drag = np.diag(held.damping)
    compliance = 1.0 / (_dynamic_stiffnesses(held, w) + 1j * w[:, None] * drag)
    power = (np.abs(compliance) ** 2) @ (drag * held.modal_port**2)
    return (
        compliance @ (held.modal_actuator * held.modal_sensor),
        compliance @ (held.modal_port * held.modal_sensor),
        compliance @ (held.modal_actuator * held.modal_port),
        compliance @ held.modal_port**2,
        w**2 * power,
    )


def _coupled_response(held: Port, w: Floats) -> tuple[Complexes | Floats, ...]:
    """The fields of `PortResponse`, in its order, (k,) each at w (k,), of modes that dampers couple."""
    stiff = _dynamic_stiffnesses(held, w)
    damping: Complexes = np.broadcast_to(held.damping, (*w.shape, *held.damping.shape)).astype(complex)
    for damper in held.lagged:
        share = damper.damping / (1.0 + 1j * w * damper.time_constant)
        damping = damping + share[:, None, None] * np.outer(damper.along, damper.along)
    drag = np.abs(np.diagonal(damping, axis1=-2, axis2=-1))
    # each mode in units in which its own dynamic stiffness is 1
    scale = 1.0 / np.sqrt(np.hypot(stiff, w[:, None] * drag))
    D = 1j * w[:, None, None] * damping
    index = np.arange(len(held.squared))
    D[:, index, index] += stiff
    D = D * scale[:, :, None] * scale[:, None, :]
    sources = np.stack([held.modal_actuator, held.modal_port], axis=-1) * scale[:, :, None]
    X = np.linalg.solve(D, sources.astype(complex)) * scale[:, :, None]
    pushed, pulled = X[..., 0], X[..., 1]  # motions by a force at the actuator, and at the port
    power = np.einsum("ki,kij,kj->k", pulled.conj(), damping.real, pulled).real
    return (
        pushed @ held.modal_sensor,
        pulled @ held.modal_sensor,
        pushed @ held.modal_port,
        pulled @ held.modal_port,
        w**2 * power,
    )


def static_compliances(plant: Plant, held: Floats) -> tuple[float, float]:
    """Static compliance from the wall's force to the reading [m/N], the port free and the port fixed.

    inf (with its sign) where a rigid motion moves without limit. A spring at the port gives a compliance between
    the two.
    """
    return _static_compliance(plant), _static_compliance(hold_fixed(plant, held))


def _static_compliance(plant: Plant) -> float:
    """Static compliance of a plant from the wall's force to the reading [m/N]: sum of each mode's share over its
    squared frequency; inf, with its sign, where rigid motions respond."""
    if plant.size == 0:
        return 0.0
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    push, read = shapes.T @ plant.actuator, shapes.T @ plant.sensor
    share = push * read
    rigid = squared == 0.0
    free = float(np.sum(share[rigid]))
    if abs(free) > 1e-12 * float(np.sum(np.abs(share))):  # by more than rounding
        return float(np.copysign(np.inf, free))
    return float(np.sum(share[~rigid] / squared[~rigid]))


def hold_fixed(plant: Plant, held: Floats) -> Plant:
    """The plant with the coordinate `held` . x fixed, in coordinates of the motions that remain."""
    return _confined(plant, np.linalg.svd(held[None, :])[2][1:].T, None)


def without_idle_motions(plant: Plant) -> Plant:
    """The plant without motions that no wall, reading, operator or damper couples to.

    Example: sliding along the wall, and of links that bend the vibrations out of their plane. Coordinates become
    modal where there is such a motion.
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    ends = [plant.actuator, plant.sensor, *([] if plant.handle is None else [plant.handle])]
    ends += [damper.along for damper in plant.lagged_dampers]
    for force in plant.sampled_forces:
        ends += [force.along, force.reading]
    free = shapes[:, squared == 0.0]
    # of the free motions only the combinations that one of the ends or dampers sees
    if free.shape[1]:
        drag = free.T @ plant.damping
        rows = [free.T @ end / np.linalg.norm(end) for end in ends]
        rows += list(drag.T / max(float(np.max(np.abs(plant.damping))), 1e-300))
        _, sizes, turns = np.linalg.svd(np.array(rows))
        level = IDLE * np.max(np.abs(rows))
        free = free @ turns[: np.count_nonzero(sizes > level)].T
    shapes, moved = separated_modes(plant, squared, shapes, np.array(ends))
    moved &= squared != 0.0
    V = np.hstack([free, shapes[:, moved]])
    if V.shape[1] == plant.size:
        return plant
    # what free motions are left has no stiffness, not even the rounding of what is left out
    stiffness = np.diag(np.append(np.zeros(free.shape[1]), squared[moved]))
    return replace(_confined(plant, V, plant.handle), mass=np.eye(len(stiffness)), stiffness=stiffness)


def _confined(plant: Plant, V: Floats, handle: Floats | None) -> Plant:
    """The plant confined to x = V q, in coordinates q."""
    return replace(plant.on_motions(V), handle=None if handle is None else V.T @ handle)
