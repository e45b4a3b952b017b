"""Random mechanisms: paddles, two-link arms, five-bars, arms in space."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tests.frozen.toml_text import digits

Table = dict[str, Any]


def mechanism_file(seed: int) -> Table:
    """The device file of one random mechanism; the seed also says of which kind."""
    rng = np.random.default_rng([seed, 2])
    kind = KINDS[seed % len(KINDS)]
    mechanism = kind(rng)
    if rng.random() < 0.5:
        for drive in mechanism["drives"]:
            drive |= {"encoder_counts_per_rev": int(rng.choice([2000, 4096])), "coulomb_Nm": 0.001}
    if rng.random() < 0.3:
        for drive in mechanism["drives"]:
            drive |= {"torque_limit_Nm": digits(rng.uniform(0.05, 0.2)), "torque_constant_Nm_per_A": 0.03}
    mechanism["damping"] = {"mode_ratio": digits(rng.uniform(0.01, 0.1))}
    loop: Table = {"sampling_period_s": digits(10.0 ** rng.uniform(-3.6, -2.8))}
    if rng.random() < 0.5:
        loop["delay_samples"] = digits(rng.uniform(0.0, 1.5))
    if rng.random() < 0.4:
        cutoff = digits(rng.uniform(0.1, 0.4) / loop["sampling_period_s"])
        loop["velocity"] = {"filter": {"type": "butterworth", "order": 2, "cutoff_Hz": cutoff}}
    return {"name": f"Random {kind.__name__.replace('_', ' ')} {seed}", "mechanism": mechanism, "loop": loop}


def paddle(rng: np.random.Generator) -> Table:
    length = digits(rng.uniform(0.06, 0.1))
    return {
        "links": [_link("paddle", length, rng)],
        "handle": {"link": "paddle"},
        "assemblies": {"only": {"joints_rad": {"paddle": 1.57}}},
        "reference": {"position_m": [0.0, length], "direction": [1.0, 0.0]},
        "drives": [_drive("motor", "paddle", rng)],
    }


def two_link_arm(rng: np.random.Generator) -> Table:
    a, b = digits(rng.uniform(0.15, 0.22, 2).tolist())
    first, second = digits(rng.uniform(0.2, 1.0)), digits(rng.uniform(0.8, 2.0))
    x = a * math.cos(first) + b * math.cos(first + second)
    y = a * math.sin(first) + b * math.sin(first + second)
    return {
        "links": [_link("upper", a, rng), _link("lower", b, rng) | {"parent": "upper"}],
        "handle": {"link": "lower"},
        "assemblies": {"elbow-right": {"joints_rad": {"upper": first, "lower": second}}},
        "reference": {"position_m": digits([x, y]), "direction": digits(rng.normal(size=2).tolist())},
        "drives": [_drive("shoulder", "upper", rng), _drive("elbow", "lower", rng)],
    }


def five_bar(rng: np.random.Generator) -> Table:
    apart = digits(rng.choice([0.0, rng.uniform(0.02, 0.06)]))
    upper, distal = digits(rng.uniform(0.13, 0.16)), digits(rng.uniform(0.18, 0.21))
    at = (digits(rng.uniform(-0.03, 0.03)), digits(rng.uniform(0.22, 0.27)))
    links, joints = [], {}
    for side, sign in (("right", 1.0), ("left", -1.0)):
        origin = [sign * apart / 2.0, 0.0]
        outer = f"distal-{side}"
        links += [_link(f"upper-{side}", upper, rng) | {"origin_m": [*origin, 0.0]}]
        links += [_link(outer, distal, rng) | {"parent": f"upper-{side}"}]
        joints |= _elbow(f"upper-{side}", outer, (at[0] - origin[0], at[1]), upper, distal, sign)
    return {
        "links": links,
        "loops": [{"name": "end-point", "links": ["distal-right", "distal-left"]}],
        "handle": {"link": "distal-right"},
        "assemblies": {"elbows-out": {"joints_rad": joints}},
        "reference": {"position_m": list(at), "direction": [digits(rng.uniform(-0.5, 0.5)), 1.0]},
        "workspace": {"x_m": [-0.1, 0.1], "y_m": [0.15, 0.3]},
        "drives": [_drive("motor-right", "upper-right", rng), _drive("motor-left", "upper-left", rng)],
    }


def spatial_arm(rng: np.random.Generator) -> Table:
    """A yaw about z, then two links that pitch about y: (cos yaw, sin yaw) r and -z downwards."""
    a, b = digits(rng.uniform(0.12, 0.2, 2).tolist())
    yaw, first, second = digits([rng.uniform(-0.6, 0.6), rng.uniform(-0.9, -0.3), rng.uniform(0.8, 1.6)])
    r = a * math.cos(first) + b * math.cos(first + second)
    z = -a * math.sin(first) - b * math.sin(first + second)
    yawed = {"name": "yaw", "joint": "revolute", "mass_kg": 0.1, "inertia_kg_m2": [2e-4, 2e-4, 3e-4]}
    return {
        "links": [
            yawed,
            _link("upper", a, rng, space=True) | {"parent": "yaw", "axis": [0.0, 1.0, 0.0]},
            _link("lower", b, rng, space=True) | {"parent": "upper", "axis": [0.0, 1.0, 0.0]},
        ],
        "handle": {"link": "lower"},
        "assemblies": {"elbow-up": {"joints_rad": {"yaw": yaw, "upper": first, "lower": second}}},
        "reference": {
            "position_m": digits([r * math.cos(yaw), r * math.sin(yaw), z]),
            "direction": digits(rng.normal(size=3).tolist()),
        },
        "drives": [_drive(f"motor-{joint}", joint, rng) for joint in ("yaw", "upper", "lower")],
    }


KINDS = (paddle, two_link_arm, five_bar, spatial_arm)


def _link(name: str, length: float, rng: np.random.Generator, space: bool = False) -> Table:
    mass = digits(rng.uniform(0.03, 0.2))
    about = digits(mass * length**2 * rng.uniform(0.06, 0.12))
    return {
        "name": name,
        "joint": "revolute",
        "length_m": length,
        "mass_kg": mass,
        "center_of_mass_m": [digits(length * rng.uniform(0.2, 0.6))],
        "inertia_kg_m2": [digits(about * 0.05), about, about] if space else about,
    }


def _drive(name: str, joint: str, rng: np.random.Generator) -> Table:
    drive: Table = {
        "name": name,
        "joint": joint,
        "motor_inertia_kg_m2": digits(10.0 ** rng.uniform(-6.2, -5.4)),
        "transmission_ratio": digits(rng.uniform(8.0, 20.0)),
    }
    if rng.random() < 0.85:
        drive["stiffness_Nm_per_rad"] = digits(rng.uniform(0.3, 2.0))
    return drive


def _elbow(upper: str, outer: str, to: tuple[float, float], a: float, b: float, sign: float) -> dict[str, float]:
    """Angles of two links that reach a point, the elbow on the side of the sign."""
    distance, angle = math.hypot(*to), math.atan2(to[1], to[0])
    inner = math.acos((a**2 + distance**2 - b**2) / (2.0 * a * distance))
    bend = math.pi - math.acos((a**2 + b**2 - distance**2) / (2.0 * a * b))
    return {upper: digits(angle - sign * inner), outer: digits(sign * bend)}
