"""Numbers with intervals from a fit of a mechanism's torques, and the numbers that its device file takes.

Effective masses along the rendered directions as functions of all parameters, with their gradients.

    m = 1 / (h^T A^-1 h),   dm = m^2 x^T dA x,   x = A^-1 h

A being the mass matrix of the links (link side), n^2 J of the rotors (motor side), or both (rigid); it is linear
in the parameters: column s of it is what the torques of a unit acceleration of coordinate s are, at rest and
without gravity.

Masses, centres of mass and inertias that bodies can have, nearest to the file's, for given base parameters.

Ten numbers are those of a body of positive density if and only if its pseudo-inertia is positive definite
(Wensing, Kim and Slotine 2018, known at second hand):

    P = [[S, h], [h^T, m]],   S = tr(I)/2 1 - I,   h = m c,   I about the frame's origin

It is P = L V V^T L^T with L L^T the file's and V an upper triangle with positive diagonal exp(x), whose other
entries are coordinates, too: every vector x of ten numbers is a body, and x = 0 the file's (log-Cholesky
coordinates; Rucker and Wensing 2022, known at second hand). The numbers are those that minimise

    (G Phi(x) - beta)^T H (G Phi(x) - beta) + |x|^2 / s^2

with H the information of the base parameters beta: where the data say much, they decide, and where they say
nothing the file does.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import inf, nan
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.device import address
from zwidth.device.device import Device
from zwidth.identify.arm.parameters import BaseParameters, Parameters
from zwidth.identify.arm.regression import Regression
from zwidth.identify.identification import Estimate
from zwidth.identify.profile_likelihood import LEVEL
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.effective_mass import lever_arms, screw
from zwidth.model.inertia_regressor import PARAMETERS, inertia_regressor
from zwidth.model.mechanism import PRISMATIC, Mechanism

DIGITS: Final = 12  # of numbers written into a device file


def quantile(fit: Regression) -> float:
    """Half width of a 95 % interval [standard deviations], by Student's distribution."""
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * LEVEL, fit.freedom))


def link_mass_estimates(
    point: OperatingPoint, masses: Iterable[EffectiveMass], base: BaseParameters, fit: Regression
) -> Iterator[Estimate]:
    """Effective masses at a point; their intervals are those of their logarithm, 0 to inf where the data leave
    a part of them open or the mass is not finite, and of no width where nothing of them was fitted."""
    half_width = quantile(fit)
    assert point.directions is not None
    for mass in masses:
        what = mass.kind.replace("_", " ")
        way = point.directions[mass.direction]  # (3,) to move along, or (6,) with the axis to turn about behind
        words = f"about ({_number_list(way[-3:])})" if mass.turns else f"along ({_number_list(way[:3])})"
        unit = "kg m^2" if mass.turns else "kg"
        low, high = 0.0, inf
        if mass.gradient is None:
            low = high = mass.value
        elif np.isfinite(mass.value) and base.determines(mass.gradient):
            share = half_width * fit.deviation(mass.gradient[list(base.kept)]) / mass.value
            low, high = (mass.value * _bounded_exp(-share), mass.value * _bounded_exp(share))
        yield Estimate(f"{what} {words}", mass.value, low, high, unit)


def _bounded_exp(power: float) -> float:
    """exp(power); inf where that is too large for a number."""
    return float(np.exp(power)) if power < 700.0 else inf


def _number_list(numbers: Floats) -> str:
    """Numbers with four digits each and commas between them."""
    return ", ".join(f"{value:.4g}" for value in numbers)


def joint_friction_estimates(
    device: Device, mechanism: Mechanism, base: BaseParameters, fit: Regression, beta: Floats
) -> Iterator[Estimate]:
    """Dry and viscous friction and offset of each drive. Dry friction stands in the file at the motor, viscous
    friction at the joint; neither is below 0. What is no base parameter is left out.

    beta  (b,) base parameters
    """
    half_width, deviations, drives = quantile(fit), fit.deviations, mechanism.drives
    d = len(drives.names)
    first = base.parameters.friction.start
    for j in range(first, first + 3 * d):
        if j not in base.kept:
            continue
        what, i = divmod(j - first, d)  # 0 dry friction, 1 viscous friction, 2 offset; of the i-th drive
        row = base.kept.index(j)
        slides = mechanism.links.joint[drives.joint[i]] == PRISMATIC
        link = mechanism.links.names[drives.joint[i]]
        name, path, unit, scale = base.names[row], "", base.parameters.units[j], 1.0
        if what == 0:
            path, unit, scale = (
                f"mechanism.drives.{drives.names[i]}.coulomb_Nm",
                "N m",
                float(drives.transmission[i]),
            )
        # coupled drives move several joints: their viscous friction is no single joint's
        elif what == 1 and drives.coupling is None:
            key = "joint_damping_Ns_per_m" if slides else "joint_damping_Nms_per_rad"
            path = f"mechanism.links.{link}.{key}"
        path = path if _addressable(device, path) else ""
        value, width = float(beta[row]) / scale, half_width * float(deviations[row]) / scale
        least = 0.0 if what < 2 else -inf
        yield Estimate(name, max(value, least), max(value - width, least), max(value + width, least), unit, path)


def base_estimates(base: BaseParameters, fit: Regression, beta: Floats) -> Iterator[Estimate]:
    """Masses, first moments and inertias in the combinations that torques tell apart, values beta (b,)."""
    half_width, deviations = quantile(fit), fit.deviations
    for k, j in enumerate(base.kept):
        if j < base.parameters.friction.start:
            width = half_width * float(deviations[k])
            yield Estimate(
                base.names[k], float(beta[k]), beta[k] - width, beta[k] + width, base.parameters.units[j]
            )


def delay_estimate(fit: Regression) -> Estimate:
    """Time by which the torques act after their time stamps; of commands, after the computer's delay."""
    width = quantile(fit) * fit.delay_deviation
    return Estimate("further delay of the torques", fit.delay, fit.delay - width, fit.delay + width, "s")


def link_settings(
    device: Device, mechanism: Mechanism, parameters: Parameters, values: Floats
) -> tuple[dict[str, Any], list[str]]:
    """Path -> number or list of the links and rotors as the device file takes them, and remarks on what it cannot
    take.

    values  (P,) of all parameters, of links that can exist
    """
    numbers, copies = dict[str, Any](), list[str]()
    for k, i in enumerate(parameters.bodies):
        name = mechanism.links.names[i]
        at = f"mechanism.links.{name}"
        if not _addressable(device, f"{at}.mass_kg"):
            copies.append(name)
            continue
        mass, center, inertia = body_numbers(values[PARAMETERS * k : PARAMETERS * (k + 1)])
        numbers[f"{at}.mass_kg"] = _rounded(mass)
        numbers[f"{at}.center_of_mass_m"] = [_rounded(x) for x in center]
        numbers[f"{at}.inertia_kg_m2"] = _inertia_as_in_file(device, at, inertia, mechanism.links.axis[i])
    for k, i in enumerate(parameters.rotors):
        path = f"mechanism.drives.{mechanism.drives.names[i]}.motor_inertia_kg_m2"
        if _addressable(device, path):
            numbers[path] = _rounded(float(values[parameters.inertial + k]))
        else:
            copies.append(mechanism.drives.names[i])
    remarks = [
        "of the links' own numbers the data tell only the base parameters; the rest is the file's, as near as "
        "bodies that can exist allow"
    ]
    if copies:
        remarks.append(f"not written, being copies in the file: {', '.join(copies)}")
    return numbers, remarks


def _inertia_as_in_file(device: Device, at: str, inertia: Floats, axis: Floats) -> Any:
    """The inertia (3, 3) in the form that the file has: one number about the joint's axis, three moments where no
    products of inertia came out, else a matrix, as where the file has none.

    at  path of the link;   inertia  about its centre of mass [kg m²];   axis  (3,) of its joint
    """
    given = (
        address.get(device.document, f"{at}.inertia_kg_m2") if _in_file(device, f"{at}.inertia_kg_m2") else None
    )
    if isinstance(given, int | float):
        return _rounded(float(axis @ inertia @ axis))
    products = np.abs(inertia - np.diag(np.diag(inertia)))
    # three moments, as long as the products of inertia are rounding
    if isinstance(given, list) and not isinstance(given[0], list) and np.max(products) < 1e-9 * np.max(inertia):
        return [_rounded(x) for x in np.diag(inertia)]
    return [[_rounded(x) for x in row] for row in 0.5 * (inertia + inertia.T)]


def _in_file(device: Device, path: str) -> bool:
    """Whether the device's file has this key."""
    return address.exists(device.document, path)


def _addressable(device: Device, path: str) -> bool:
    """Whether a device file has a place for this path; a leg's copies have none of their own, and "" has none."""
    from zwidth.errors import DeviceError

    if not path:
        return False
    try:
        address.resolve(device.document, path)
    except DeviceError:
        return False
    return True


def _rounded(value: float) -> float:
    """The number with the digits that are written into a device file; nan where it is not finite."""
    return float(f"{float(value):.{DIGITS}g}") if np.isfinite(value) else nan


KINDS: Final = ("rigid_mass", "link_side_mass", "motor_side_mass")
NO_MOTION: Final = 1e-12  # largest lever arm along a direction, below which the handle cannot move along it


@dataclass(frozen=True)
class EffectiveMass:
    """One effective mass.

    kind       "rigid_mass", "link_side_mass" or "motor_side_mass"
    direction  number of the rendered direction
    turns      whether it is an inertia about an axis [kg m²]
    value      [kg]; nan where the parameters' mass matrix is not positive definite; inf along a direction in which
               the handle cannot move
    gradient   (P,) by all parameters; None: it hangs on none of them
    """

    kind: str
    direction: int
    turns: bool
    value: float
    gradient: Floats | None


def effective_masses(
    parameters: Parameters, point: OperatingPoint, values: Floats, known_rotors: Floats
) -> Iterator[EffectiveMass]:
    """The effective masses at a point: the three of `KINDS` along each of its directions; inf where no
    drive moves along it, nan where the masses are not positive definite.

    values        (P,) of all parameters, or the base ones and 0 for the others: what the base parameters determine
                  is the same
    known_rotors  (d,) inertias at the joints, n^2 J, of the rotors that are no parameters, others 0 [kg m²]
    Yields        each mass with its gradient (P,) by the values, None of a motor side of which no rotor is fitted
    """
    posture = point.posture
    assert posture is not None
    assert point.directions is not None
    columns = mass_columns(parameters, posture.angles)
    links = parameters.inertial
    used_by_kind = {  # kind -> indices of its parameters, whether the known rotors are in it
        "rigid_mass": (np.arange(columns.shape[2]), True),
        "link_side_mass": (np.arange(links), False),
        "motor_side_mass": (np.arange(links, columns.shape[2]), True),
    }
    for number, one in enumerate(point.directions):
        along = screw(one)
        h = lever_arms(posture, along)
        turns = not along[:3].any()  # a screw without a force
        for kind in KINDS:
            used, with_rotors = used_by_kind[kind]
            A = columns[:, :, used] @ values[used] + (np.diag(known_rotors) if with_rotors else 0.0)
            value, gradient = np.nan, np.zeros(len(values))
            if np.max(np.abs(h)) < NO_MOTION:
                value = np.inf
            elif _positive_definite(A):
                x = np.linalg.solve(A, h)
                value = 1.0 / float(h @ x)
                gradient[used] = value**2 * np.einsum("s,stp,t->p", x, columns[:, :, used], x)
            fitted = kind != "motor_side_mass" or bool(parameters.rotors)
            yield EffectiveMass(kind, number, turns, value, gradient if fitted else None)


def mass_columns(parameters: Parameters, angles: Floats) -> Floats:
    """The mass matrix per unit of each inertial parameter (d, d, P'), in which it is linear: those of the links,
    then the inertias of the fitted rotors, P' of them.

    angles  (n,) joint coordinates of the posture
    """
    # row s of the states is a unit acceleration of drive s, at rest and without gravity: its torques are column s
    mech = parameters.mech
    d = mech.driven
    at = np.tile(mech.to_drive[0] @ angles[mech.joint[-d:]], (d, 1))  # the driven joints are the last
    still, unit = np.zeros((d, d)), np.eye(d)
    links, _, _ = inertia_regressor(mech, angles, at, still, unit, np.zeros(3))
    columns = parameters.columns(links, still, unit, still)[:, :, : parameters.friction.start]
    return np.asarray(0.5 * (columns + np.swapaxes(columns, 0, 1)))


def _positive_definite(A: Floats) -> bool:
    """Whether a symmetric matrix is positive definite."""
    try:
        np.linalg.cholesky(A)
    except np.linalg.LinAlgError:
        return False
    return True


WIDE: Final = 1.0  # s of the module's docstring: the file's numbers may be wrong by a factor of e, or more
THIN: Final = 1e-3  # least share of the pseudo-inertia's mean width, of a body that is flat or a rod in the file
UPPER: Final = np.triu_indices(4, 1)  # entries of V above its diagonal


@dataclass(frozen=True)
class ConsistentLinks:
    """Parameters of links that can exist.

    values     (P,) all parameters, friction included
    deviation  root mean square of the base parameters' change, in their standard deviations
    """

    values: Floats
    deviation: float


def consistent_links(
    base: BaseParameters, mechanism: Mechanism, beta: Floats, information: Floats
) -> ConsistentLinks:
    """All parameters, of links that can exist, nearest to base parameters beta (b,) of this information (b, b), as
    the module's docstring says.

    Links whose mass the file leaves out begin with 1 kg per metre of their length (`pseudo_inertias`).
    """
    from scipy.optimize import least_squares

    parameters = base.parameters
    file = pseudo_inertias(mechanism, parameters.bodies)
    roots = np.asarray(np.linalg.cholesky(file), dtype=np.float64)
    # 1e-6 kg m² where the file has 0 or none: coordinates are logarithms
    rotors = np.array([_positive_or(mechanism.drives.motor_inertia[i], 1e-6) for i in parameters.rotors])
    root = _information_root(information)
    friction = np.arange(*parameters.friction.indices(len(parameters.names)))
    # where each parameter of friction stands among the base parameters, -1 where it is none of them
    friction_rows = [base.kept.index(j) if j in base.kept else -1 for j in friction]
    count = parameters.inertial + len(rotors)
    dynamic = np.array([k for k in range(len(base.kept)) if k not in friction_rows], dtype=int)
    kept_friction = np.array([k for k in friction_rows if k >= 0], dtype=int)
    root_without_friction = _without_friction(root, dynamic, kept_friction)
    G = base.matrix[dynamic]

    def residuals(x: Floats) -> Floats:
        """What the base parameters of coordinates x (count,) miss beta by, whitened, then x over s, here WIDE."""
        return np.concatenate(
            [
                root_without_friction
                @ (G @ _parameters_and_slopes(parameters, roots, rotors, x)[0] - beta[dynamic]),
                x / WIDE,
            ]
        )

    def slopes(x: Floats) -> Floats:
        """Derivatives of `residuals` by x."""
        return np.concatenate(
            [
                root_without_friction @ (G @ _parameters_and_slopes(parameters, roots, rotors, x)[1]),
                np.eye(count) / WIDE,
            ]
        )

    solved = least_squares(
        residuals, np.zeros(count), jac=slopes, xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=200
    )
    values = _parameters_and_slopes(parameters, roots, rotors, np.asarray(solved.x))[0]
    moved = root_without_friction @ (G @ values - beta[dynamic])
    deviation = float(np.sqrt(np.sum(moved**2) / max(len(dynamic), 1)))
    # friction at its best beside these links; a parameter that is no base parameter is 0
    shift = _shift_with_friction(root, dynamic, kept_friction, G @ values - beta[dynamic])
    for j, k in zip(friction, friction_rows, strict=True):
        values[j] = beta[k] + shift[k] if k >= 0 else 0.0
    return ConsistentLinks(values, deviation)


def _information_root(information: Floats) -> Floats:
    """Give a root W (b, b) of the base parameters' information (b, b), which is W^T W."""
    size = np.sqrt(np.diag(information))
    size = 1.0 / np.where(size > 0.0, size, 1.0)
    eigenvalues, vectors = np.linalg.eigh(information * size[:, None] * size)  # of a diagonal of ones
    return np.asarray((np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T) / size)


def _without_friction(root: Floats, dynamic: Ints, friction: Ints) -> Floats:
    """Give the columns (b, n) of the information's root for the base parameters that are not friction, less their
    part along the columns of friction, which is fitted freely beside them.

    root               (b, b) root of the information
    dynamic, friction  indices (n,) of the base parameters that are not friction, and (k,) of those that are
    """
    columns = root[:, dynamic]
    if len(friction):
        Q = np.linalg.qr(root[:, friction])[0]
        columns = columns - Q @ (Q.T @ columns)
    return columns


def _parameters_and_slopes(
    parameters: Parameters, roots: Floats, rotors: Floats, x: Floats
) -> tuple[Floats, Floats]:
    """Compute the parameters (P,) of links and rotors, friction being 0, and their derivatives (P, count) by
    x (count,).

    roots   (w, 4, 4) lower triangles of the file's pseudo-inertias
    rotors  (r,) inertias of the fitted rotors in the file [kg m²]
    x       ten coordinates of each link, and the logarithm of each rotor's inertia over the file's
    """
    count = parameters.inertial + len(rotors)
    values, slopes = np.zeros(len(parameters.names)), np.zeros((len(parameters.names), count))
    bodies, body_slopes = _body_parameters(roots, x[: parameters.inertial].reshape(-1, PARAMETERS))
    values[: parameters.inertial] = bodies.ravel()
    for k in range(len(roots)):
        rows = slice(PARAMETERS * k, PARAMETERS * (k + 1))
        slopes[rows, rows] = body_slopes[k]
    turning = np.arange(parameters.inertial, count)
    values[turning] = slopes[turning, turning] = rotors * np.exp(x[turning])
    return values, slopes


def _shift_with_friction(root: Floats, dynamic: Ints, friction: Ints, moved: Floats) -> Floats:
    """Give the change (b,) of all base parameters where those that are not friction change by `moved` (n,), and
    friction follows so that |W shift| is least, W the root of the information.

    root               (b, b) root of the information
    dynamic, friction  indices (n,) of the base parameters that are not friction, and (k,) of those that are
    """
    shift = np.zeros(len(root))
    shift[dynamic] = moved
    if len(friction):
        shift[friction] = -np.linalg.lstsq(root[:, friction], root[:, dynamic] @ shift[dynamic], rcond=None)[0]
    return shift


def pseudo_inertias(mechanism: Mechanism, bodies: tuple[int, ...]) -> Floats:
    """Pseudo-inertias P (w, 4, 4) of the file's links, made positive definite where these are flat, rods, or left
    out.

    bodies  (w,) indices of the links
    """
    links, out = mechanism.links, np.empty((len(bodies), 4, 4))
    lengths = np.linalg.norm(links.tip, axis=-1)
    usual = max(float(np.max(lengths, initial=0.0)), 1e-3)
    for k, i in enumerate(bodies):
        length = float(lengths[i]) or usual
        mass, center, inertia = float(links.mass[i]), links.center_of_mass[i], links.inertia[i]
        if not mass > 0.0:
            mass = length  # 1 kg per metre
            center = 0.5 * links.tip[i] if np.isnan(links.mass[i]) else center
        if not np.isfinite(inertia).all():
            inertia = mass * length**2 / 12.0 * np.eye(3)
        moments = np.linalg.eigvalsh(inertia)
        if moments[1] <= 1e-9 * moments[2]:  # one number, about the joint's axis: the others are not known
            inertia = moments[2] * np.eye(3)
        spread = 0.5 * np.trace(inertia) * np.eye(3) - inertia  # S about the centre of mass
        widths, axes = np.linalg.eigh(0.5 * (spread + spread.T))
        # a mass without inertia counts as a hundredth of its link's length wide
        least = THIN * max(float(widths[-1]), mass * (1e-2 * length) ** 2)
        spread = axes @ np.diag(np.maximum(widths, least)) @ axes.T
        out[k, :3, :3] = spread + mass * np.outer(center, center)
        out[k, :3, 3] = out[k, 3, :3] = mass * center
        out[k, 3, 3] = mass
    return out


def body_numbers(values: Floats) -> tuple[float, Floats, Floats]:
    """Mass [kg], centre of mass (3,) [m] and inertia (3, 3) about it [kg m²], of a body's ten parameters, whose
    inertia is about the frame's origin."""
    m, h = float(values[0]), values[1:4]
    xx, yy, zz, xy, xz, yz = values[4:]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    center = h / m
    return m, center, inertia - m * (center @ center * np.eye(3) - np.outer(center, center))


def _body_parameters(roots: Floats, x: Floats) -> tuple[Floats, Floats]:
    """The ten parameters (w, 10) of bodies by their coordinates x (w, 10), and their derivatives (w, 10, 10).

    roots  L (w, 4, 4) of the file's pseudo-inertias

    dP = L (dV V^T + V dV^T) L^T,   dV = exp(x_k) e_k e_k^T of a diagonal entry, e_i e_j^T of another
    """
    w = len(x)
    V = np.zeros((w, 4, 4))
    V[:, range(4), range(4)] = np.exp(x[:, :4])
    V[:, UPPER[0], UPPER[1]] = x[:, 4:]
    V_slopes = np.zeros((w, PARAMETERS, 4, 4))
    V_slopes[:, range(4), range(4), range(4)] = np.exp(x[:, :4])
    V_slopes[:, range(4, PARAMETERS), UPPER[0], UPPER[1]] = 1.0
    factor = roots @ V
    one_side = (roots[:, None] @ V_slopes) @ np.swapaxes(factor, 1, 2)[:, None]
    slopes = _ten_parameters(one_side + np.swapaxes(one_side, 2, 3))
    return _ten_parameters(factor @ np.swapaxes(factor, 1, 2)), np.swapaxes(slopes, 1, 2)


def _ten_parameters(P: Floats) -> Floats:
    """The ten parameters (..., 10) of pseudo-inertias P (..., 4, 4): m, h and I of the module's docstring."""
    S, xx, yy, zz = P[..., :3, :3], P[..., 0, 0], P[..., 1, 1], P[..., 2, 2]  # I_xx = S_yy + S_zz, I_xy = -S_xy
    first_moments = P[..., 0, 3], P[..., 1, 3], P[..., 2, 3]
    return np.stack(
        [P[..., 3, 3], *first_moments, yy + zz, xx + zz, xx + yy, -S[..., 0, 1], -S[..., 0, 2], -S[..., 1, 2]],
        axis=-1,
    )


def _positive_or(value: float, otherwise: float) -> float:
    """The value where it is finite and above 0, else the other."""
    return float(value) if np.isfinite(value) and value > 0.0 else otherwise
