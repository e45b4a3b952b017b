"""Virtual benches of arms, by equations of their own: planar chains by complex numbers, loops by their constraint.

A planar chain of n links stands at absolute angles a_i; with e_i = exp(j a_i) the velocity of link k's centre of
mass is j sum_i b_ki e_i a_i', b_ki the length of link i < k, and the centre's own place b_kk = c_x + j c_y. All
benches are computed for many devices at once, along the first axis S.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.device import from_document

PERIOD = 0.002


@dataclass(frozen=True)
class Chains:
    """S planar chains of n links: lengths, masses, centres (complex), inertias about them, rotors n^2 J, friction,
    all (S, n)."""

    length: np.ndarray
    mass: np.ndarray
    center: np.ndarray
    inertia: np.ndarray
    rotor: np.ndarray
    coulomb: np.ndarray
    viscous: np.ndarray
    gravity: float = 0.0  # m/s^2, along -y

    @property
    def count(self):
        return self.length.shape[1]

    def terms(self, q, rates):
        """Mass matrix (S, n, n) and velocity and gravity forces (S, n) in the joints' angles."""
        n = self.count
        a, w = np.cumsum(q, axis=1), np.cumsum(rates, axis=1)
        e = np.exp(1j * a)
        M, c = np.zeros((*q.shape, n)), np.zeros(q.shape)
        for k in range(n):
            b = np.where(np.arange(n) < k, self.length, 0.0) + np.where(np.arange(n) == k, self.center, 0.0)
            J = 1j * b * e  # per absolute rate
            J = np.cumsum(J[:, ::-1], axis=1)[:, ::-1]  # per joint rate: all links behind it turn
            drift = -np.sum(b * e * w**2, axis=1) + 1j * self.gravity
            m = self.mass[:, k, None]
            M += m[..., None] * np.real(np.conj(J)[:, :, None] * J[:, None, :])
            c += m * np.real(np.conj(J) * drift[:, None])
            turned = (np.arange(n) <= k).astype(float)
            M += self.inertia[:, k, None, None] * turned[:, None] * turned
        M[:, np.arange(n), np.arange(n)] += self.rotor
        return M, c

    def accelerations(self, q, rates, torque):
        M, c = self.terms(q, rates)
        drag = self.coulomb * np.tanh(rates / 0.01) + self.viscous * rates
        return np.linalg.solve(M, (torque - c - drag)[..., None])[..., 0]

    def torques(self, q, rates, accelerations):
        M, c = self.terms(q, rates)
        drag = self.coulomb * np.sign(rates) + self.viscous * rates
        return np.einsum("sij,sj->si", M, accelerations) + c + drag


def random_chains(rng, n, devices, gravity=0.0):
    """S random chains of n links, of a haptic device's size."""
    shape = devices, n
    length, mass = rng.uniform(0.08, 0.25, shape), rng.uniform(0.05, 0.4, shape)
    center = length * (rng.uniform(0.2, 0.7, shape) + 1j * rng.uniform(-0.1, 0.1, shape))
    inertia = mass * length**2 * rng.uniform(0.06, 0.12, shape)
    rotor = rng.uniform(0.2, 1.0, shape) * mass * length**2
    size = np.sum(mass, axis=1, keepdims=True) * np.sum(length, axis=1, keepdims=True)
    coulomb, viscous = rng.uniform(0.0, 0.1, shape) * size, rng.uniform(0.0, 0.03, shape) * size
    return Chains(length, mass, center, inertia, rotor, coulomb, viscous, gravity)


def random_motion(rng, n, devices, duration, period=PERIOD, highest=6.0, amplitude=0.6):
    """Sums of sines (N, S, n): angles, rates, accelerations about (0.4, 1.2, ...)."""
    time = np.arange(round(duration / period)) * period
    tones = 7
    f = rng.uniform(0.2, highest, (tones, devices, n))
    size = amplitude * rng.uniform(0.3, 1.0, f.shape) / (1.0 + (f / 1.5) ** 2)
    phase = rng.uniform(0.0, 2.0 * np.pi, f.shape)
    w = 2.0 * np.pi * f
    angle = w * time[:, None, None, None] + phase
    middle = np.where(np.arange(n) == 0, 0.4, 1.2)
    q = middle + np.sum(size * np.sin(angle), axis=1)
    return time, q, np.sum(size * w * np.cos(angle), axis=1), np.sum(-size * w**2 * np.sin(angle), axis=1)


def driven_records(chains, rng, duration=20.0, counts=8000, noise=0.01, delay=0.5, substeps=4, period=PERIOD):
    """Records of chains that a computer drives along random motions: angles as counted, torques as commanded.

    The command is held for a period and acts after a delay; at the joints acts as much noise beside it as is a
    share of the torques' size. Returns time (N,), angles (N, S, n), torques (N, S, n).
    """
    S, n = chains.length.shape
    time, wanted, rates, accelerations = random_motion(rng, n, S, duration, period)
    M, _ = chains.terms(wanted[0], 0.0 * wanted[0])
    inertia = np.einsum("sii->si", M)
    stiffness, damping = inertia * (2 * np.pi * 6.0) ** 2, inertia * 2.0 * 0.7 * (2 * np.pi * 6.0)
    size = np.std(accelerations, axis=0) * inertia
    step = 2.0 * np.pi / counts
    q, v = wanted[0].copy(), rates[0].copy()
    angles, torques = np.empty_like(wanted), np.empty_like(wanted)
    last = np.zeros_like(q)
    before = step * np.round(q / step)
    first = max(round(delay * substeps), 0)
    h = period / substeps
    for k in range(len(time)):
        counted = step * np.round(q / step)
        speed = (counted - before) / period if k else rates[0]
        before = counted
        command = inertia * accelerations[k] + stiffness * (wanted[k] - counted) + damping * (rates[k] - speed)
        angles[k], torques[k] = counted, command
        disturbance = noise * size * rng.normal(size=q.shape)
        for sub in range(substeps):
            torque = (last if sub < first else command) + disturbance
            k1 = chains.accelerations(q, v, torque)
            k2 = chains.accelerations(q + 0.5 * h * v, v + 0.5 * h * k1, torque)
            k3 = chains.accelerations(q + 0.5 * h * v + 0.25 * h * h * k1, v + 0.5 * h * k2, torque)
            k4 = chains.accelerations(q + h * v + 0.5 * h * h * k2, v + h * k3, torque)
            q = q + h * v + h * h / 6.0 * (k1 + k2 + k3)
            v = v + h / 6.0 * (k1 + 2 * k2 + 2 * k3 + k4)
        last = command
    return time, angles, torques


def chain_device(chains, s, gravity_axis=False, period=PERIOD, delay=0.5, counts=None, wrong=1.0):
    """Chain s as a device of zwidth, its links' masses wrong by a factor, where the fit begins."""
    n = chains.count
    names = [f"link-{i + 1}" for i in range(n)]
    links = [
        {
            "name": names[i],
            "parent": names[i - 1] if i else "base",
            "joint": "revolute",
            "length_m": float(chains.length[s, i]),
            "mass_kg": wrong * float(chains.mass[s, i]),
            "center_of_mass_m": [float(chains.center[s, i].real), float(chains.center[s, i].imag)],
            "inertia_kg_m2": wrong * float(chains.inertia[s, i]),
        }
        for i in range(n)
    ]
    drives = [
        {
            "name": f"motor-{i + 1}",
            "joint": names[i],
            "motor_inertia_kg_m2": wrong * float(chains.rotor[s, i]) / 100.0,
            "transmission_ratio": 10.0,
        }
        for i in range(n)
    ]
    start = np.where(np.arange(n) == 0, 0.4, 1.2)
    reach = np.sum(chains.length[s] * np.exp(1j * np.cumsum(start)))
    position = [float(reach.real), float(reach.imag)]
    document = {
        "name": "bench",
        "mechanism": {
            "links": links,
            "drives": drives,
            "handle": {"link": names[-1]} if n < 3 else {"link": names[-1], "controls": "pose"},
            "assemblies": {"only": {"joints_rad": dict(zip(names, map(float, start), strict=True))}},
            "reference": {"position_m": position, "direction": [0.6, 0.8], "assembly": "only"}
            | ({"orientation_rad": [0.0, 0.0, float(np.sum(start))]} if n > 2 else {}),
            "damping": {"mode_ratio": 0.05},
        },
        "loop": {"sampling_period_s": period, "delay_samples": delay},
    }
    return from_document(document, "bench")


def chain_columns(time, angles, torques, s):
    """The record of chain s, as `record_of` takes it."""
    n = angles.shape[2]
    return {
        "time_s": time,
        **{f"angle_rad.link-{i + 1}": angles[:, s, i] for i in range(n)},
        **{f"torque_Nm.link-{i + 1}": torques[:, s, i] for i in range(n)},
    }


def moved_records(chains, rng, duration=20.0, counts=8000, noise=0.01, period=PERIOD, highest=6.0):
    """Records of chains on given motions: angles as counted, the torques that they take, with noise.

    Returns time (N,), angles (N, S, n), torques (N, S, n).
    """
    S, n = chains.length.shape
    time, q, rates, accelerations = random_motion(rng, n, S, duration, period, highest)
    N = len(time)
    many = Chains(
        *(np.repeat(getattr(chains, name)[None], N, axis=0).reshape(N * S, n) for name in CHAIN), chains.gravity
    )
    torques = many.torques(*(x.reshape(N * S, n) for x in (q, rates, accelerations))).reshape(N, S, n)
    size = np.std(torques, axis=0)
    step = 2.0 * np.pi / counts
    return time, step * np.round(q / step), torques + noise * size * rng.normal(size=q.shape)


CHAIN = ("length", "mass", "center", "inertia", "rotor", "coulomb", "viscous")


@dataclass(frozen=True)
class FiveBar:
    """A five-bar of two chains of two links that meet at their tips: lengths, masses, centres, inertias (4,) of
    upper and lower links, left ones first; rotors, friction (2,); base joints at -d/2 and d/2."""

    length: np.ndarray
    mass: np.ndarray
    center: np.ndarray
    inertia: np.ndarray
    rotor: np.ndarray
    coulomb: np.ndarray
    viscous: np.ndarray
    apart: float

    def angles(self, p):
        """Absolute angles (N, 4) of the links by those of the drives (N, 2): the tips meet above."""
        l, d = self.length, self.apart
        left = -d / 2 + l[0] * np.exp(1j * p[:, 0])
        right = d / 2 + l[2] * np.exp(1j * p[:, 1])
        way = right - left
        size = np.abs(way)
        bend = np.arccos((l[1] ** 2 + size**2 - l[3] ** 2) / (2 * l[1] * size))
        lower = np.angle(way) + bend
        tip = left + l[1] * np.exp(1j * lower)
        return np.stack([p[:, 0], lower, p[:, 1], np.angle(tip - right)], axis=1)

    def torques(self, p, rates, accelerations):
        """Torques (N, 2) of the drives, by virtual work: B^T (M a'' + ...) with a' = B p'."""
        l, a = self.length, self.angles(p)
        e = np.exp(1j * a)
        signs = np.array([1, 1, -1, -1])
        columns = 1j * l * e * signs  # of the gap between the tips

        def solved(right):
            A = np.stack([columns[:, [1, 3]].real, columns[:, [1, 3]].imag], axis=1)
            return np.linalg.solve(A, -np.stack([right.real, right.imag], axis=1)[..., None])[..., 0]

        B = np.zeros((len(p), 4, 2))
        B[:, 0, 0] = B[:, 2, 1] = 1.0
        for s, driven in enumerate((0, 2)):
            B[:, [1, 3], s] = solved(columns[:, driven])
        w = np.einsum("nij,nj->ni", B, rates)
        drift = -np.sum(l * e * signs * w**2, axis=1) + np.sum(columns[:, [0, 2]] * accelerations, axis=1)
        turning = np.zeros_like(a)
        turning[:, [0, 2]] = accelerations
        turning[:, [1, 3]] = solved(drift)
        force = self.inertia * turning
        for k, before in ((0, None), (1, 0), (2, None), (3, 2)):
            chain = [k] if before is None else [before, k]
            arms = np.array([self.center[k] if i == k else l[i] for i in chain])
            moved = np.sum(arms * e[:, chain] * (1j * turning[:, chain] - w[:, chain] ** 2), axis=1)
            for i, arm in zip(chain, arms, strict=True):
                force[:, i] += self.mass[k] * np.real(np.conj(1j * arm * e[:, i]) * moved)
        drag = self.coulomb * np.sign(rates) + self.viscous * rates
        return np.einsum("nij,ni->nj", B, force) + self.rotor * accelerations + drag


def random_five_bar(rng):
    length = np.array([0.15, 0.2, 0.15, 0.2]) * rng.uniform(0.9, 1.1, 4)
    mass = rng.uniform(0.04, 0.3, 4)
    center = length * (rng.uniform(0.2, 0.6, 4) + 1j * rng.uniform(-0.1, 0.1, 4))
    inertia = mass * length**2 * rng.uniform(0.06, 0.12, 4)
    rotor = rng.uniform(2e-4, 2e-3, 2)
    return FiveBar(
        length, mass, center, inertia, rotor, rng.uniform(0.0, 0.02, 2), rng.uniform(0.0, 0.01, 2), 0.08
    )


def five_bar_device(bar, wrong=1.0, period=PERIOD):
    """The five-bar as a device of zwidth, its masses wrong by a factor."""
    names = ["upper-left", "lower-left", "upper-right", "lower-right"]
    start = np.array([[2.2, 0.9]])
    a = bar.angles(start)[0]
    links = [
        {
            "name": name,
            "parent": "base" if i in (0, 2) else names[i - 1],
            "joint": "revolute",
            "origin_m": [bar.apart * (i / 2 - 0.5), 0.0, 0.0]
            if i in (0, 2)
            else [float(bar.length[i - 1]), 0.0, 0.0],
            "length_m": float(bar.length[i]),
            "mass_kg": wrong * float(bar.mass[i]),
            "center_of_mass_m": [float(bar.center[i].real), float(bar.center[i].imag)],
            "inertia_kg_m2": wrong * float(bar.inertia[i]),
        }
        for i, name in enumerate(names)
    ]
    tip = -bar.apart / 2 + bar.length[0] * np.exp(1j * a[0]) + bar.length[1] * np.exp(1j * a[1])
    joints = dict(zip(names, [float(x) for x in (a[0], a[1] - a[0], a[2], a[3] - a[2])], strict=True))
    document = {
        "name": "bench",
        "mechanism": {
            "links": links,
            "loops": [{"name": "tip", "links": ["lower-left", "lower-right"]}],
            "drives": [
                {
                    "name": f"motor-{side}",
                    "joint": f"upper-{side}",
                    "motor_inertia_kg_m2": wrong * float(bar.rotor[k]) / 100.0,
                    "transmission_ratio": 10.0,
                }
                for k, side in enumerate(("left", "right"))
            ],
            "handle": {"link": "lower-left"},
            "assemblies": {"up": {"joints_rad": joints}},
            "reference": {
                "position_m": [float(tip.real), float(tip.imag)],
                "direction": [0.0, 1.0],
                "assembly": "up",
            },
            "damping": {"mode_ratio": 0.05},
        },
        "loop": {"sampling_period_s": period, "delay_samples": 0.5},
    }
    return from_document(document, "bench")


def five_bar_columns(bar, rng, duration=20.0, counts=8000, noise=0.01, period=PERIOD):
    """A record of the five-bar on a random motion about its reference."""
    time, q, rates, accelerations = (
        x if x.ndim == 1 else x[:, 0] for x in random_motion(rng, 2, 1, duration, period, amplitude=0.25)
    )
    q = q - np.array([0.4, 1.2]) + np.array([2.2, 0.9])
    torques = bar.torques(q, rates, accelerations)
    step = 2.0 * np.pi / counts
    torques = torques + noise * np.std(torques, axis=0) * rng.normal(size=torques.shape)
    q = step * np.round(q / step)
    return {
        "time_s": time,
        "angle_rad.upper-left": q[:, 0],
        "angle_rad.upper-right": q[:, 1],
        "torque_Nm.motor-left": torques[:, 0],
        "torque_Nm.motor-right": torques[:, 1],
    }
