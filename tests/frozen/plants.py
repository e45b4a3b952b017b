"""Random plants: one to six masses, 0.2 to 20 kHz, modes from 1 Hz to beyond Nyquist, damping 0 to 150 %."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.frozen.toml_text import digits

Table = dict[str, Any]
RATIOS = (0.0, 0.001, 0.01, 0.05, 0.3, 1.0, 1.5)


def plant_file(seed: int) -> Table:
    """The device file of one random plant; the seed also says which features it has."""
    rng = np.random.default_rng([seed, 1])
    rate = float(10.0 ** rng.uniform(math.log10(200.0), math.log10(20000.0)))
    names = list(FEATURES)
    # each feature stands in several files, alone in one of them at least
    features = [names[seed % len(names)]]
    if seed >= len(names):
        features += [str(name) for name in rng.choice(names, 2) if name not in ALONE]
    table: Table = {
        "name": f"Random plant {seed}",
        "plant": chain(rng, rate, masses=1 + seed % 6),
        "loop": {"sampling_period_s": digits(1.0 / rate)},
    }
    if rng.random() < 0.5:
        table["loop"]["delay_samples"] = digits(rng.choice([1.0, 2.0, 0.5, rng.uniform(0.0, 3.0)]))
    for feature in dict.fromkeys(features):
        FEATURES[feature](rng, rate, table)
    return table


def chain(rng: np.random.Generator, rate: float, masses: int) -> Table:
    """Masses in a chain of springs and dashpots, free or grounded; a third has inertia that couples them."""
    m = 10.0 ** rng.uniform(-2.0, 0.5, masses)
    M = np.diag(m)
    if rng.random() < 0.33:
        X = np.diag(np.sqrt(m)) @ (np.eye(masses) + 0.3 * rng.normal(size=(masses, masses)))
        M = X.T @ X
    K, B = np.zeros((masses, masses)), np.zeros((masses, masses))
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for i in range(masses - 1):
        between = m[i] * m[i + 1] / (m[i] + m[i + 1])
        k, b = _spring(rng, between, _frequency(rng, rate))
        K[i : i + 2, i : i + 2] += k * pair
        B[i : i + 2, i : i + 2] += b * pair
    if rng.random() < 0.3:
        k, b = _spring(rng, m[0], _frequency(rng, rate))
        K[0, 0] += k
        B[0, 0] += b
    B[0, 0] += digits(m.sum() * 10.0 ** rng.uniform(-1.0, 1.0))
    ends = np.eye(masses)
    table: Table = {
        "mass_kg": digits(M.tolist(), 8),
        "damping_Ns_per_m": B.tolist(),
        "stiffness_N_per_m": K.tolist(),
        "actuator": ends[-1].tolist(),
        "sensor": (ends[0] if masses > 1 and rng.random() < 0.2 else ends[-1]).tolist(),
        "handle": ends[0].tolist(),
    }
    return table


def _frequency(rng: np.random.Generator, rate: float) -> float:
    return float(10.0 ** rng.uniform(0.0, math.log10(0.75 * rate)))


def _spring(rng: np.random.Generator, mass: float, frequency: float) -> tuple[float, float]:
    """Stiffness and damping of a mass on a spring at a frequency [Hz]."""
    k = (2.0 * math.pi * frequency) ** 2 * mass
    ratio = rng.choice(RATIOS) * rng.uniform(0.5, 1.0)
    return digits(k), digits(2.0 * ratio * math.sqrt(k * mass))


def _size(table: Table) -> int:
    return len(table["plant"]["mass_kg"])


def _butterworth(rng: np.random.Generator, rate: float) -> Table:
    rule = str(rng.choice(["tustin", "tustin-prewarped"]))
    cutoff = digits(rng.uniform(0.05, 0.45) * rate)
    return {"type": "butterworth", "order": int(rng.integers(1, 5)), "cutoff_Hz": cutoff, "discretisation": rule}


def _velocity(rng: np.random.Generator, rate: float, table: Table) -> None:
    first_order = {"type": "first-order", "time_constant_s": digits(10.0 ** rng.uniform(-1.0, 1.0) / rate)}
    low_pass = first_order if rng.random() < 0.4 else _butterworth(rng, rate)
    table["loop"].setdefault("velocity", {})["filter"] = low_pass


def _force_filter(rng: np.random.Generator, rate: float, table: Table) -> None:
    table["loop"]["force"] = {"filter": _butterworth(rng, rate)}


def _estimator(rng: np.random.Generator, rate: float, table: Table) -> None:
    n = int(rng.integers(2, 10))
    methods: list[Table] = [
        {"method": "windowed-difference", "samples": n},
        {"method": "least-squares-slope", "samples": n},
        {"method": "central-difference"},
        {"method": "savitzky-golay", "samples": n + 3, "order": int(rng.integers(1, 4))},
        {"method": "savitzky-golay", "samples": 2 * (n // 2) + 3, "order": 2, "centred": True},
        {"method": "alpha-beta", "alpha": digits(rng.uniform(0.1, 0.9)), "beta": digits(rng.uniform(0.01, 0.5))},
        {
            "method": "kalman",
            "acceleration_noise_m_per_s2": digits(10.0 ** rng.uniform(-3.0, 1.0) * rate**2 * 1e-5),
            "position_noise_m": 1e-5,
        },
    ]
    table["loop"].setdefault("velocity", {}).update(methods[int(rng.integers(len(methods)))])


def _nonlinear_estimator(rng: np.random.Generator, rate: float, table: Table) -> None:
    methods: list[Table] = [
        {"method": "foaw", "samples": 12, "fit": "best-fit", "position_noise_m": 1e-5},
        {"method": "foaw", "samples": 8, "position_noise_m": 5e-6},
        {"method": "levant", "acceleration_max_m_per_s2": 20.0},
    ]
    velocity = table["loop"].setdefault("velocity", {})
    velocity.clear()
    velocity.update(methods[int(rng.integers(len(methods)))])


def _lag(rng: np.random.Generator, rate: float, table: Table) -> None:
    table["loop"]["actuator"] = {"time_constant_s": digits(10.0 ** rng.uniform(-1.5, 1.0) / rate)}


def _encoder(rng: np.random.Generator, rate: float, table: Table) -> None:
    step = digits(10.0 ** rng.uniform(-6.0, -4.5))
    noise = digits(step * 0.3) if rng.random() < 0.4 else 0.0
    table["loop"]["encoder"] = {"resolution_m": step, "noise_m": noise}


def _friction(rng: np.random.Generator, rate: float, table: Table) -> None:
    level = [0.0] * (_size(table) - 1) + [digits(rng.uniform(0.02, 0.4))]
    friction: Table = {"coulomb_N": level}
    model = str(rng.choice(["coulomb", "coulomb", "dahl", "lugre"]))
    if model != "coulomb":
        friction |= {"model": model, "bristle_stiffness_N_per_m": digits(10.0 ** rng.uniform(4.0, 5.0))}
    table["friction"] = friction


def _saturation(rng: np.random.Generator, rate: float, table: Table) -> None:
    table["loop"]["saturation"] = {"force_N": digits(rng.uniform(2.0, 20.0))}


def _operator(rng: np.random.Generator, rate: float, table: Table) -> None:
    operator: Table = {
        "arm_mass_kg": digits(rng.uniform(0.1, 2.0)),
        "arm_stiffness_N_per_m": digits(10.0 ** rng.uniform(1.0, 3.0)),
        "arm_damping_Ns_per_m": digits(10.0 ** rng.uniform(0.0, 1.5)),
    }
    if rng.random() < 0.4:
        operator["grasp"] = "rigid"
    else:
        operator["grasp_stiffness_N_per_m"] = digits(10.0 ** rng.uniform(2.5, 4.5))
        operator["grasp_damping_Ns_per_m"] = digits(10.0 ** rng.uniform(-0.5, 2.0))
    table["operator"] = operator


def _electrical(rng: np.random.Generator, rate: float, table: Table) -> None:
    table["plant"]["electrical_damping"] = [
        {
            "force_constant_N_per_A": digits(rng.uniform(1.0, 8.0)),
            "resistance_ohm": digits(rng.uniform(0.5, 10.0)),
            "inductance_H": digits(10.0 ** rng.uniform(-4.0, -2.5)),
        }
    ]


def _bent_spring(rng: np.random.Generator, rate: float, table: Table) -> None:
    table["plant"]["spring"] = [{"along": np.eye(_size(table))[-1].tolist(), "hardening_N_per_m3": 1e8}]


def _brake(rng: np.random.Generator, rate: float, table: Table) -> None:
    table["plant"]["brake"] = [{"damping_max_Ns_per_m": digits(rng.uniform(0.5, 5.0)), "time_constant_s": 0.003}]


def _loss_factor(rng: np.random.Generator, rate: float, table: Table) -> None:
    """Steady vibration only: no damping matrix beside it but drag, and at least two masses."""
    table["plant"] = chain(rng, rate, masses=2)
    k, m = 10.0 ** rng.uniform(3.5, 5.0), 10.0 ** rng.uniform(-1.5, 0.0)
    table["plant"] |= {
        "mass_kg": [[digits(m), 0.0], [0.0, digits(m * rng.uniform(0.1, 1.0))]],
        "stiffness_N_per_m": [[digits(k), -digits(k)], [-digits(k), digits(k)]],
        "damping_Ns_per_m": [[digits(math.sqrt(k * m) * 0.02), 0.0], [0.0, 0.0]],
        "sensor": [0.0, 1.0],
        "loss_factor": digits(rng.uniform(0.02, 0.3)),
    }


def _bare(rng: np.random.Generator, rate: float, table: Table) -> None:
    """A plant and a computer, nothing else."""


Feature = Callable[[np.random.Generator, float, Table], None]
FEATURES: dict[str, Feature] = {
    "bare": _bare,
    "filter": _velocity,
    "force filter": _force_filter,
    "estimator": _estimator,
    "lag": _lag,
    "encoder": _encoder,
    "friction": _friction,
    "saturation": _saturation,
    "operator": _operator,
    "electrical": _electrical,
    "bent spring": _bent_spring,
    "brake": _brake,
    "nonlinear estimator": _nonlinear_estimator,
    "loss factor": _loss_factor,
}
# what excludes others
ALONE = {"loss factor", "nonlinear estimator"}
