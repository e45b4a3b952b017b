"""Random points of devices under load, drawn from everything that a load is linearised with."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from tests.model.model_cases import KINDS, random_five_bar, some_postures
from tests.model.random_mechanisms import JOINTS, random_mechanism
from zwidth.errors import EquilibriumError
from zwidth.loop import Butterworth, Controller, OperatingPoint
from zwidth.model import (
    AXIS,
    FRAME,
    OK,
    ORIENTATION,
    POINT,
    REVOLUTE,
    DriveNonlinearity,
    GivenDamping,
    Load,
    ModalDamping,
    RatioTable,
    loaded_postures,
    solve_posture,
)


def straight(drives):
    """Nonlinear parts of drives that have none."""
    d = len(drives.names)
    nothing = {
        "friction_model": "coulomb",
        "breakaway": np.full(d, np.nan),
        "bristle_stiffness": np.inf,
        "bristle_damping": 0.0,
        "stribeck_velocity": np.nan,
        "backward_stiffness": np.full(d, np.nan),
    }
    return DriveNonlinearity(**{f.name: nothing.get(f.name, np.zeros(d)) for f in fields(DriveNonlinearity)})


def with_springs(mechanism, rng, flexible=0.7):
    """Rigid and flexible drives by chance; of the springs some harden, some are other ones backwards."""
    drives, d = mechanism.drives, len(mechanism.drives.names)
    k = np.where(rng.random(d) < flexible, drives.stiffness, np.inf)
    bent = replace(
        straight(drives),
        preload=np.where(np.isfinite(k) & (rng.random(d) < 0.3), rng.uniform(0.0, 0.05, d), 0.0),
        hardening=np.where(np.isfinite(k) & (rng.random(d) < 0.5), rng.uniform(0.01, 0.2, d), 0.0),
        backward_stiffness=np.where(
            np.isfinite(k) & (rng.random(d) < 0.5), drives.stiffness * rng.uniform(0.4, 0.9, d), np.nan
        ),
    )
    own = replace(drives, stiffness=k, nonlinearity=bent, damping=rng.uniform(1e-4, 3e-3, d))
    return replace(mechanism, drives=own)


def with_coupled_drives(mechanism, rng):
    """Motors that turn with other drives' joints, too."""
    drives = mechanism.drives
    coupling = np.zeros((len(drives.names), len(mechanism.links.names)))
    for i, joint in enumerate(drives.joint):
        for other in drives.joint:
            if other != joint and rng.random() < 0.6:
                coupling[i, other] = rng.uniform(-0.6, 0.6)
    return replace(mechanism, drives=replace(drives, coupling=coupling))


def with_tables(mechanism, posture, rng):
    """Ratios that change about a posture."""
    drives, tables = mechanism.drives, []
    for i, joint in enumerate(drives.joint):
        q = posture.angles[joint] + np.linspace(-0.7, 0.7, 6) + rng.uniform(-0.05, 0.05, 6)
        ratio = drives.transmission[i] * np.sort(rng.uniform(0.7, 1.4, 6))
        turns = bool(mechanism.links.joint[joint] == REVOLUTE)
        tables.append(RatioTable(q, ratio, turns) if rng.random() < 0.7 else None)
    ratio = np.where([table is None for table in tables], drives.transmission, np.nan)
    return replace(mechanism, drives=replace(drives, ratio_tables=tuple(tables), transmission=ratio))


def with_surplus_drive(rng):
    """A five-bar with a third drive on one of its elbows."""
    mechanism = random_five_bar(rng)
    drives, more = mechanism.drives, {"joint": 3, "motor_inertia": 3e-6, "transmission": 4.0}
    more |= {"stiffness": rng.uniform(0.5, 1.0), "damping": 1e-3, "torque_constant": np.nan}
    more |= {"torque_limit": np.inf, "encoder_counts": np.nan}
    grown = {name: np.append(getattr(drives, name), value) for name, value in more.items()}
    return replace(mechanism, drives=replace(drives, names=(*drives.names, "more"), surplus=(2,), **grown))


def with_joint_springs(mechanism, rng):
    """Springs and dampers on joints, free ones among them."""
    n = len(mechanism.links.names)
    links = replace(
        mechanism.links, joint_stiffness=rng.uniform(0.5, 3.0, n), joint_damping=rng.uniform(0.0, 0.01, n)
    )
    return replace(mechanism, links=links)


def of_every_joint(rng):
    """Trees and loops of every joint and closing, with free joints on springs."""
    mechanism = None
    while mechanism is None:
        kinds = list(rng.choice([POINT, AXIS, FRAME], rng.integers(0, 3)))
        others = rng.choice(JOINTS, rng.integers(2, 5 + len(kinds)))
        mechanism = random_mechanism(rng, ["revolute", *others], kinds)
    return with_joint_springs(mechanism, rng)


MADE = {
    **KINDS,
    "surplus drive": with_surplus_drive,
    "coupled drives": lambda rng: with_coupled_drives(KINDS["spatial arm"](rng), rng),
    "coupled loop": lambda rng: with_coupled_drives(random_five_bar(rng), rng),
    "changing ratios": KINDS["spatial arm"],
    "changing ratios in a loop": random_five_bar,
    "every joint": of_every_joint,
}


def random_posture(mechanism, rng):
    """A posture near the reference, or there; None of a mechanism whose drives leave the handle free."""
    if "as built" in mechanism.assemblies:
        try:
            return solve_posture(mechanism)
        except ValueError:
            return None
    found = some_postures(mechanism, rng, count=1, spread=rng.uniform(0.0, 0.04))
    return found.with_axes(lambda array: array[0]) if found.status[0] == OK else None


def random_screw(mechanism, posture, rng):
    """A direction, or an axis, that the drives move the handle along."""
    k = len(mechanism.driven)
    J = posture.angular_jacobian if mechanism.controls == ORIENTATION else posture.jacobian
    u = J[:, :k] @ rng.normal(size=k)
    u = u / np.linalg.norm(u)
    return np.concatenate([np.zeros(3), u]) if mechanism.controls == ORIENTATION else u


def random_controller(rng, plain=False):
    """Delays whole and not, filters, an actuator that lags."""
    T = float(rng.choice([0.0005, 0.001, 0.002]))
    if plain:
        return Controller(T, float(rng.choice([0.0, 0.4, 1.0])))
    return Controller(
        T,
        float(rng.choice([0.0, 0.3, 1.0, 1.7])),
        velocity_filter=Butterworth(2, rng.uniform(20.0, 100.0)) if rng.random() < 0.4 else None,
        force_filter=Butterworth(2, rng.uniform(50.0, 150.0)) if rng.random() < 0.3 else None,
        actuator_time_constant=rng.uniform(0.3, 3.0) * T if rng.random() < 0.4 else 0.0,
    )


def random_load(rng, size, turns, plane=False):
    """A push of either sign with everything that goes with one."""
    g = 9.81 * (rng.random() < 0.6) * rng.normal(size=3)
    curved = not turns and not plane and rng.random() < 0.4
    return Load(
        push=float(rng.choice([-1.0, 1.0]) * size * rng.uniform(0.2, 1.0)),
        gravity=g / np.sqrt(3.0) if g.any() else None,
        hand=str(rng.choice(["dead", "dead", "follower", "neglected"])),
        surface_radius=float(rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.5)) if curved else np.inf,
        count_sideways=True,
        branch=str(rng.choice(["forward", "backward"])),
    )


def random_point(rng, kind):
    """A point of a random device of this kind under a random load; None where chance gave none with a balance."""
    mechanism = with_springs(MADE[kind](rng), rng, flexible=rng.choice([0.0, 0.7, 1.0]))
    compensation = str(rng.choice(["none", "computed", "counterweight"]))
    mechanism = replace(mechanism, gravity_compensation=compensation)
    posture = random_posture(mechanism, rng)
    if posture is None:
        return None
    if kind.startswith("changing"):
        mechanism = with_tables(mechanism, posture, rng)
    u = random_screw(mechanism, posture, rng)
    load = random_load(rng, 1.0 if kind == "every joint" else 8.0, u.shape == (6,), plane=kind == "every joint")
    encoders = str(rng.choice(["motor", "motor", "link"]))
    damping = GivenDamping() if rng.random() < 0.5 else ModalDamping(0.05)
    try:
        posture = loaded_postures(mechanism, posture, np.append(u, np.zeros(3))[:6], load, encoders == "motor")
    except EquilibriumError:
        return None
    return OperatingPoint(
        random_controller(rng),
        mechanism=mechanism,
        posture=posture,
        directions=u[None],
        damping=damping,
        encoders=encoders,
        load=load,
        model="rigid" if rng.random() < 0.1 else "full",
    )


def random_points(kind, seed, count):
    """So many of them."""
    rng, found, tries = np.random.default_rng(seed), [], 0
    while len(found) < count:
        tries += 1
        assert tries < 20 * count, f"of {kind} hardly any device is in balance"
        point = random_point(rng, kind)
        if point is not None:
            found.append(point)
    return found
