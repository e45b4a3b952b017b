"""One identification from a file, ours or a competent peer's, alone in a process.

    python -m benchmarks._identify KIND zwidth|peer FILE

Prints the first numbers. The peers load the whole file with pandas and then do what a user would who knows numpy
and scipy: no checks, no intervals, no validation.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

RATE = 10_000  # samples per second
SEGMENT = 2**16  # samples of the peers' spectra
SMOOTHED = 101  # samples of the peers' polynomials


def with_zwidth(kind: str, file: Path) -> dict[str, float]:
    """Our numbers. Raises SystemExit where the record was refused."""
    from benchmarks._records import BENCHES  # the peers' processes are to load nothing of zwidth
    from zwidth.identify import identify

    bench = BENCHES[kind]
    result = identify(bench.device(), kind, file, **bench.options)
    if not result.estimates:
        sys.exit("; ".join(check.reason for check in result.checks if not check.passed))
    return {one.name: one.value for one in result.estimates[:3]}


def _derivatives(position: Any) -> tuple[Any, Any, Any]:
    """Position, velocity and acceleration by local cubic polynomials."""
    from scipy.signal import savgol_filter

    return tuple(savgol_filter(position, SMOOTHED, 3, deriv=k, delta=1.0 / RATE) for k in range(3))  # type: ignore


def spring_by_line(table: Any) -> dict[str, float]:
    """One line through torque over angle."""
    slope, _ = np.polyfit(table["angle_rad"].to_numpy(), table["torque_Nm"].to_numpy(), 1)
    return {"stiffness": float(slope)}


def joint_by_lstsq(table: Any) -> dict[str, float]:
    """Mass and friction by least squares over all samples."""
    _, v, a = _derivatives(table["position_m"].to_numpy())
    rows = np.stack([a, v, np.sign(v), np.ones(len(v))], axis=1)
    mass, viscous, dry, _ = np.linalg.lstsq(rows, table["force_N"].to_numpy(), rcond=None)[0]
    return {"dry friction": float(dry), "viscous friction": float(viscous), "mass": float(mass)}


def impedance_by_welch(table: Any) -> dict[str, float]:
    """Z = F/V from Welch's spectra of the whole arrays."""
    from scipy.signal import csd, welch

    force, position = table["handle_force_N"].to_numpy(), table["handle_position_m"].to_numpy()
    length = 2 ** int(np.log2(len(force) / 8))
    f, power = welch(force, RATE, nperseg=length)
    _, cross = csd(force, position, RATE, nperseg=length)
    coherence = np.abs(cross) ** 2 / (power * welch(position, RATE, nperseg=length)[1])
    size = np.abs(power[1:] / (2j * np.pi * f[1:] * cross[1:]))[coherence[1:] > 0.9]
    return {"lowest impedance": float(np.min(size)), "highest impedance": float(np.max(size))}


def arm_by_lstsq(table: Any) -> dict[str, float]:
    """A planar arm of two links by the textbook's regressor, least squares over all samples."""
    (q1, v1, a1), (q2, v2, a2) = (_derivatives(table[f"angle_rad.link-{i}"].to_numpy()) for i in (1, 2))
    turn, none = v2 * (2.0 * v1 + v2), np.zeros_like(q1)
    c, s = np.cos(q2), np.sin(q2)
    upper = [
        a1,
        a1 + a2,
        (2.0 * a1 + a2) * c - turn * s,
        (2.0 * a1 + a2) * s + turn * c,
        none,
        np.sign(v1),
        v1,
        none,
        none,
    ]
    lower = [none, a1 + a2, a1 * c + v1**2 * s, a1 * s - v1**2 * c, a2, none, none, np.sign(v2), v2]
    rows = np.concatenate([np.stack(upper, axis=1), np.stack(lower, axis=1)])
    torques = np.concatenate([table[f"torque_Nm.link-{i}"].to_numpy() for i in (1, 2)])
    numbers = np.linalg.lstsq(rows, torques, rcond=None)[0]
    return {"inertia at joint 1": float(numbers[0]), "inertia at joint 2": float(numbers[1])}


def response_by_welch(table: Any) -> dict[str, float]:
    """H1 from Welch's spectra of the whole arrays, and its largest value: the resonance."""
    from scipy.signal import csd, welch

    force, position = table["force_N"].to_numpy(), table["position_m"].to_numpy()
    f, power = welch(force, RATE, nperseg=SEGMENT)
    _, cross = csd(force, position, RATE, nperseg=SEGMENT)
    size = np.abs(cross[1:] / power[1:])
    return {"resonance": float(f[1:][np.argmax(size)]), "largest response": float(np.max(size))}


def modes_by_curve_fit(table: Any) -> dict[str, float]:
    """Two masses to H1 of Welch's spectra."""
    return masses_by_curve_fit(*response_by_csd(table))


def response_by_csd(table: Any) -> tuple[Any, Any]:
    """Frequencies and H1 there, by Welch's spectra."""
    from scipy.signal import csd, welch

    force, position = table["force_N"].to_numpy(), table["position_m"].to_numpy()
    f, power = welch(force, RATE, nperseg=SEGMENT)
    _, cross = csd(force, position, RATE, nperseg=SEGMENT)
    used = (f > 0.5) & (f < 1000.0)
    return f[used], (cross / power)[used]


def masses_by_curve_fit(frequency: Any, response: Any) -> dict[str, float]:
    """Two masses on a spring to the ground by `curve_fit`, without hold and sampling, from numbers that are off by
    a third; weighted by the response's size."""
    from scipy.optimize import curve_fit

    s = 2j * np.pi * frequency

    def model(_: Any, *logarithms: float) -> Any:
        m1, m2, c, k, c0, k0, delay = np.exp(logarithms)
        link, near, far = c * s + k, m2 * s**2 + c0 * s + k0, m1 * s**2
        value = (far + link) / ((far + link) * (near + link) - link**2) * np.exp(-s * delay)
        value = value / response
        return np.concatenate([value.real, value.imag])

    start = np.log([0.35, 0.02, 2.5, 12000.0, 9.0, 5000.0, 7e-5])
    wanted = np.concatenate([np.ones(len(s)), np.zeros(len(s))])
    numbers, _ = curve_fit(model, None, wanted, start)
    m1, m2, c, k, *_ = np.exp(numbers).tolist()
    return {"mass 1": m1, "mass 2": m2, "damping": c, "stiffness": k}


PEERS: Mapping[str, tuple[str, Callable[[Any], dict[str, float]]]] = {
    "stiffness": ("pandas, numpy.polyfit", spring_by_line),
    "friction": ("pandas, savgol_filter, lstsq", joint_by_lstsq),
    "mass": ("pandas, savgol_filter, lstsq", joint_by_lstsq),
    "impedance": ("pandas, scipy.signal.welch", impedance_by_welch),
    "response": ("pandas, scipy.signal.csd and welch", response_by_welch),
    "modes": ("pandas, csd and welch, curve_fit", modes_by_curve_fit),
    "arm": ("pandas, savgol_filter, lstsq", arm_by_lstsq),
}


def with_peer(kind: str, file: Path) -> dict[str, float]:
    """The peer's numbers."""
    import pandas

    return PEERS[kind][1](pandas.read_csv(file))


def main(words: list[str]) -> None:
    """Identify and print."""
    kind, side, file = words
    numbers = (with_zwidth if side == "zwidth" else with_peer)(kind, Path(file))
    print(", ".join(f"{name} {value:.4g}" for name, value in numbers.items()))


if __name__ == "__main__":
    main(sys.argv[1:])
