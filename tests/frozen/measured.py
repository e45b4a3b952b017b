"""Random measured responses, with the files beside them, computed apart from the package."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy.linalg
import scipy.signal

from tests.frozen.toml_text import digits

Table = dict[str, Any]
RATE = 1000.0


def measured_file(seed: int) -> tuple[Table, dict[str, str]]:
    """A device file with a measured response, and the text of each file beside it, by name."""
    rng = np.random.default_rng([seed, 3])
    A, b, c = _sampled_two_mass(rng)
    name = f"measured-{seed:02d}"
    kind = ("exact", "coherence", "sweeps", "raw", "files", "short")[seed % 6]
    response: Table = {"file": f"{name}.csv"}
    beside = {f"{name}.csv": ""}
    if kind == "raw":
        beside[f"{name}.csv"] = _raw_sweep(rng, A, b, c)
    elif kind == "sweeps":
        beside[f"{name}.csv"] = _response(rng, A, b, c, noise=0.01, sweeps=3)
    elif kind == "coherence":
        response["averages"] = 8
        beside[f"{name}.csv"] = _response(rng, A, b, c, noise=0.003, coherence=0.995)
    elif kind == "files":
        beside = {f"{name}-{i}.csv": _response(rng, A, b, c, noise=0.005) for i in range(2)}
        response = {"files": list(beside)}
    else:
        beside[f"{name}.csv"] = _response(rng, A, b, c, upto=0.6 if kind == "short" else 1.0)
    loop: Table = {"sampling_period_s": 1.0 / RATE}
    if rng.random() < 0.5:
        loop["delay_samples"] = 1
    return {"name": f"Measured {kind} {seed}", "response": response, "loop": loop}, beside


def _sampled_two_mass(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x' = A x + b f, y = c x from sample to sample: two masses behind a hold."""
    m = digits((10.0 ** rng.uniform(-1.5, -0.3, 2)).tolist())
    w = 2.0 * math.pi * rng.uniform(40.0, 200.0)
    between = m[0] * m[1] / (m[0] + m[1])
    k, b = w**2 * between, 2.0 * 0.05 * w * between
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    inverse = np.diag(1.0 / np.array(m))
    flow = np.zeros((5, 5))
    flow[:2, 2:4] = np.eye(2)
    flow[2:4, :2], flow[2:4, 2:4] = -inverse @ pair * k, -inverse @ (pair * b)
    flow[3, 4] = 1.0 / m[1]
    step = scipy.linalg.expm(flow / RATE)
    return step[:4, :4], step[:4, 4], np.array([0.0, 1.0, 0.0, 0.0])


def _response(
    rng: np.random.Generator,
    A: np.ndarray,
    b: np.ndarray,
    c: np.ndarray,
    noise: float = 0.0,
    coherence: float | None = None,
    sweeps: int = 1,
    upto: float = 1.0,
) -> str:
    f = np.geomspace(1.0, upto * RATE / 2.0, 300)
    P = np.array([c @ np.linalg.solve(np.exp(2j * np.pi * at / RATE) * np.eye(4) - A, b) for at in f])
    columns = ["frequency_Hz", "real_m_per_N", "imag_m_per_N"]
    columns += ["coherence"] * (coherence is not None) + ["sweep"] * (sweeps > 1)
    lines = [",".join(columns)]
    for sweep in range(sweeps):
        seen = P * (1.0 + noise * (rng.normal(size=len(f)) + 1j * rng.normal(size=len(f))))
        for at, value in zip(f, seen, strict=True):
            cells = [f"{at:.8g}", f"{value.real:.8g}", f"{value.imag:.8g}"]
            cells += [str(coherence)] * (coherence is not None) + [str(sweep)] * (sweeps > 1)
            lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def _raw_sweep(rng: np.random.Generator, A: np.ndarray, b: np.ndarray, c: np.ndarray) -> str:
    t = np.arange(12000) / RATE
    force = scipy.signal.chirp(t, 1.0, t[-1], 480.0, method="logarithmic")
    x, seen = np.zeros(4), np.empty(len(t))
    for j, push in enumerate(force):
        seen[j] = c @ x
        x = A @ x + b * push
    seen += rng.normal(size=len(t)) * 1e-7
    rows = (f"{at:.6g},{push:.8g},{y:.9g}" for at, push, y in zip(t, force, seen, strict=True))
    return "time_s,force_command_N,position_m\n" + "\n".join(rows) + "\n"
