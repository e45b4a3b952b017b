"""True values of what `identify_arm` estimates, from the device that the bench is, and what share its intervals
hold."""

import numpy as np

from tests.identify.arm_benches import (
    Chains,
    chain_columns,
    chain_device,
    driven_records,
    five_bar_columns,
    five_bar_device,
    moved_records,
    random_chains,
    random_five_bar,
)
from zwidth.identify import Parameters, base_parameters, identify_arm, record_of
from zwidth.identify.arm import COLUMNS
from zwidth.model import effective_parameters


def link_parameters(mechanism, parameters):
    """The values (P,) of the file's links and rotors; friction is 0."""
    values, links = np.zeros(len(parameters.names)), mechanism.links
    for k, i in enumerate(parameters.bodies):
        m, c, inertia = links.mass[i], links.center_of_mass[i], links.inertia[i]
        about = inertia + m * (c @ c * np.eye(3) - np.outer(c, c))
        products = about[0, 1], about[0, 2], about[1, 2]
        values[10 * k : 10 * k + 10] = [m, *(m * c), *np.diag(about), *products]
    for k, i in enumerate(parameters.rotors):
        values[parameters.inertial + k] = mechanism.drives.motor_inertia[i]
    return values


def true_values(device, coulomb, viscous, gravity):
    """Name of an estimate -> its true value. The names of base parameters hang on geometry alone."""
    mechanism, point = device.mechanism, device.at()
    parameters = Parameters.of(mechanism, rotors=True)
    values, d = link_parameters(mechanism, parameters), len(coulomb)
    first = parameters.friction.start
    values[first : first + d], values[first + d : first + 2 * d] = coulomb, viscous
    base = base_parameters(parameters, point.posture.angles, np.asarray(gravity, dtype=float))
    truth = dict(zip(base.names, base.matrix @ values, strict=True))
    for name, ratio in zip(mechanism.drives.names, mechanism.drives.transmission, strict=True):
        truth[f"coulomb({name})"] /= ratio
    effective = effective_parameters(mechanism, point.posture, point.direction)
    words = ", ".join(f"{x:.4g}" for x in point.direction[:3])
    return truth | {
        f"rigid mass along ({words})": float(effective.rigid_mass),
        "further delay of the torques": 0.0,
    }


def held(result, truth):
    """Of each estimate with an interval whether that holds the true value."""
    known = [one for one in result.estimates if one.name in truth and np.isfinite(one.high)]
    return {one.name: bool(one.low <= truth[one.name] <= one.high) for one in known}


def chain_results(links, devices, seed, gravity=0.0, bench="moved", **options):
    """Results and true values of random planar chains, whose files begin 30 % off."""
    rng = np.random.default_rng(seed)
    chains = random_chains(rng, links, devices, gravity)
    made = moved_records if bench == "moved" else driven_records
    time, angles, torques = made(chains, rng, **options)
    kind = "measured" if bench == "moved" else "commanded"
    for s in range(devices):
        record = record_of(chain_columns(time, angles, torques, s), COLUMNS)
        down = (0.0, -gravity, 0.0)
        truth = true_values(chain_device(chains, s), chains.coulomb[s], chains.viscous[s], down)
        yield identify_arm(chain_device(chains, s, wrong=1.3), [record], gravity=down, torque=kind), truth


def five_bar_results(devices, seed, **options):
    """Results and true values of random five-bars."""
    for s in range(devices):
        rng = np.random.default_rng([seed, s])
        bar = random_five_bar(rng)
        record = record_of(five_bar_columns(bar, rng, **options), COLUMNS)
        truth = true_values(five_bar_device(bar), bar.coulomb, bar.viscous, np.zeros(3))
        yield identify_arm(five_bar_device(bar, wrong=1.3), [record]), truth


def one_chain(seed=1, links=2, gravity=0.0, **options):
    """One random chain: itself, its record as columns, and its device."""
    rng = np.random.default_rng(seed)
    chains: Chains = random_chains(rng, links, 1, gravity)
    time, angles, torques = moved_records(chains, rng, **options)
    return chains, chain_columns(time, angles, torques, 0), chain_device(chains, 0)
