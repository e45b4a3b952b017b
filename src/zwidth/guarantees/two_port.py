"""Llewellyn and Raisbeck: a device and a coupling between any passive operator and any passive environment.

Adams and Hannaford (1999, 2002) make the device discrete by Tustin's rule and the hold (z + 1)/(2 z), and treat
it as a two-port between the operator (f_h, v_h) and the environment (f_e, v_e), in hybrid form (known at second
hand; the numbers of their equations are not known):

    [ f_h ]   [ h11  h12 ] [ v_h ]        h11 = 1/Y_hh,          h12 =  D Y_ha/Y_hh
    [-v_e ] = [ h21  h22 ] [ f_e ]        h21 = -Y_yh/Y_hh,      h22 =  D (Y_ya - Y_yh Y_ha/Y_hh) + 1/Z_c

with Y = s G the device's mobilities at s = (2/T)(z - 1)/(z + 1), D the hold, the delay and the force's filter, and
the coupling Z_c = b_c + k_c T z/(z - 1). A single mass has h11 = m s + b, h12 = D, h21 = -1, h22 = 1/Z_c.

Both conditions bound Re(1/Z_c) from below, frequency by frequency. An environment of admittance Y_e and the
coupling in series see of the device, held by any passive operator, an admittance in a disk: centre q, radius r,

    q = h22 - 1/Z_c - h12 h21/(2 Re h11),       r = |h12 h21|/(2 Re h11)

    Llewellyn:  Re(1/Z_c) >= r - Re q,          Raisbeck:  4 Re h11 Re h22 >= |h12 + conj(h21)|^2

`sampled_demand` asks the same of the sampled device itself, without Tustin's rule: aliases and the half sample of
the backward difference included, the disk that `disks` computes times (z - 1)/(T z).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.guarantees.disks import force_filter_response, response_disks
from zwidth.guarantees.port import port, port_response
from zwidth.loop.loop import Loop


@dataclass(frozen=True)
class CouplingDemand:
    """What a device demands of the coupling at each of the angles (k,).

    centre, radius  of the disk of admittances it shows, held by any passive operator [m/(N s)]
    power           |centre|^2 - radius^2 without the cancellation of the two [(m/(N s))^2]
    conductance     least Re(1/Z_c) for a passive environment behind the coupling [m/(N s)]
    """

    angles: Floats
    centre: Complexes
    radius: Floats
    power: Floats
    conductance: Floats


def coupling_impedance(stiffness: ArrayLike, damping: ArrayLike, angles: Floats, period: float) -> Complexes:
    """Z_c = b_c + k_c T z/(z - 1) = b_c + k_c T/2 - j (k_c T/2) cot(theta/2), of couplings (...): (..., k)."""
    half = np.asarray(stiffness, dtype=float)[..., None] * period / 2.0  # k_c T/2
    b = np.asarray(damping, dtype=float)[..., None]
    return np.asarray(b + half - 1j * half / np.tan(np.asarray(angles) / 2.0), dtype=complex)


def hybrid_matrix(loop: Loop, angles: Floats, held: Floats) -> tuple[Complexes, Complexes, Complexes, Complexes]:
    """h11, h12, h21 and h22 (k,) without the coupling, after Adams and Hannaford, at angles (k,) in (0, pi), of a
    device that the operator holds along `held` (n,)."""
    w = 2.0 / loop.period * np.tan(angles / 2.0)
    s = 1j * w
    G = port_response(port(loop.plant, held), w)
    hold = np.cos(angles / 2.0) * np.exp(-0.5j * angles)  # (z + 1)/(2 z)
    lag = 1.0 + s * loop.controller.actuator_time_constant
    D = hold * np.exp(-1j * angles * loop.controller.delay) * force_filter_response(loop, angles) / lag
    # Re h11 from the dissipation: no digits lost against the mass
    h11 = G.dissipation / np.abs(s * G.port) ** 2 + 1j * np.imag(1.0 / (s * G.port))
    return (
        h11,
        D * G.actuator_to_port / G.port,
        -G.port_to_reading / G.port,
        D * s * (G.direct - G.port_to_reading * G.actuator_to_port / G.port),
    )


def llewellyn_demand(loop: Loop, angles: Floats, held: Floats) -> CouplingDemand:
    """Absolute stability of the two-port: 2 Re h11 Re h22 >= |h12 h21| + Re(h12 h21), Re h11 >= 0, Re h22 >= 0."""
    h11, h12, h21, h22 = hybrid_matrix(loop, angles, held)
    with np.errstate(divide="ignore", invalid="ignore"):
        swing = h12 * h21 / (2.0 * h11.real)
        # r - Re q, and Re h22 >= 0
        need = np.maximum(np.abs(swing) - (h22 - swing).real, -h22.real)
    return _demand(angles, h22, swing, need, h11.real)


def raisbeck_demand(loop: Loop, angles: Floats, held: Floats) -> CouplingDemand:
    """Passivity of the two-port: 4 Re h11 Re h22 >= |h12 + conj(h21)|^2, Re h11 >= 0, Re h22 >= 0."""
    h11, h12, h21, h22 = hybrid_matrix(loop, angles, held)
    with np.errstate(divide="ignore", invalid="ignore"):
        swing = h12 * h21 / (2.0 * h11.real)
        need = np.abs(h12 + h21.conj()) ** 2 / (4.0 * h11.real) - h22.real
    return _demand(angles, h22, swing, need, h11.real)


def sampled_demand(loop: Loop, angles: Floats, held: Floats) -> CouplingDemand:
    """Stability with any passive operator and environment of the sampled device, velocity by (z - 1)/(T z)."""
    disks = response_disks(loop, port(loop.plant, held), angles)
    # 1 - 1/z over T, of admittances from responses
    difference = 2j * np.sin(angles / 2.0) * np.exp(-0.5j * angles) / loop.period
    centre, radius = disks.centre * difference, disks.radius * np.abs(difference)
    return CouplingDemand(angles, centre, radius, disks.power * np.abs(difference) ** 2, radius - centre.real)


def _demand(
    angles: Floats, fixed: Complexes, swing: Complexes, need: Floats, resistance: Floats
) -> CouplingDemand:
    """The demand of a device that shows the admittance `fixed` where it is held fixed, and otherwise the disk
    round `fixed` - `swing` that goes through `fixed`; inf where it dissipates nothing at the handle. All (k,).

    need        least Re(1/Z_c) by the condition [m/(N s)];   resistance  Re h11 [N s/m]
    """
    dead = ~(resistance > 0.0)
    centre, radius = np.where(dead, 0.0, fixed - swing), np.where(dead, np.inf, np.abs(swing))
    power = np.abs(fixed) ** 2 - 2.0 * np.real(fixed * swing.conj())
    return CouplingDemand(angles, centre, radius, np.where(dead, -np.inf, power), np.where(dead, np.inf, need))


def allows(demand: CouplingDemand, stiffness: ArrayLike, damping: ArrayLike, period: float) -> Flags:
    """Whether couplings k_c, b_c (...) meet a demand at all its angles."""
    Z = coupling_impedance(stiffness, damping, demand.angles, period)
    with np.errstate(divide="ignore", invalid="ignore"):
        conductance = np.where(Z == 0.0, np.inf, Z.real / np.abs(Z) ** 2)
    return np.asarray(np.all(conductance >= demand.conductance, axis=-1))
