"""The parameters that a mechanism's torques are linear in, and the combinations of them that torques can tell.

    torque_i = (Y phi)_i + n_i^2 J_i p_i'' + C_i sign(p_i') + b_i p_i' + o_i

phi being ten numbers of each link (`model.inertia_regressor`), J_i the rotor's inertia behind the ratio n_i, C_i,
b_i and o_i dry friction, viscous friction and a constant offset, which with C_i makes dry friction of two
directions.

Of these no more than the columns' rank can be told from any motion. The columns are gone through in a fixed order
and each is kept that those before it do not span over random states; the others, W_d = W_k K, add to them:

    beta = Phi_k + K Phi_d         base parameters                           (Gautier 1991, known at second hand)

The order keeps what people read easily: friction, moments of inertia about the joint axes, products of inertia,
first moments, masses, rotors.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.continuation import moved_posture
from zwidth.model.inertia_regressor import PARAMETERS, inertia_regressor
from zwidth.model.mechanism import PRISMATIC, Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays, pack

SYMBOLS: Final = ("m", "m c_x", "m c_y", "m c_z", "I_xx", "I_yy", "I_zz", "I_xy", "I_xz", "I_yz")
FRICTION: Final = ("coulomb", "viscous", "offset")
TURN: Final = 0.35  # rad, or share of the mechanism's size, by which random states differ from the reference
TRIES: Final = 4  # of random states for each that is wanted, where loops do not close
DEPENDENT: Final = 1e-8  # share of a column that those before it leave over, below which it is spanned
SMALL: Final = 1e-6  # coefficients that are rounding, as a share of what the parameter itself does


@dataclass(frozen=True)
class Parameters:
    """All parameters of a mechanism's torques: of w bodies, r rotors, d drives; P = 10 w + r + 3 d.

    mech        the mechanism packed
    names       (P,)  "I_zz(upper)", "J(shoulder)", "coulomb(shoulder)"
    units       (P,)
    bodies      (w,)  links
    rotors      (r,)  drives whose rotors are among the parameters
    ratio_squared  (d,)  n^2
    """

    mech: MechanismArrays
    names: tuple[str, ...]
    units: tuple[str, ...]
    bodies: tuple[int, ...]
    rotors: tuple[int, ...]
    ratio_squared: Floats

    @classmethod
    def of(cls, mechanism: Mechanism, rotors: bool) -> Parameters:
        """The parameters of a mechanism of one design.

        rotors  whether the rotors' inertias are among them; a rotor of 0 in the file is none
        """
        mech, drives, links = pack(mechanism), mechanism.drives, mechanism.links
        bodies = tuple(int(i) for i in mech.bodies)
        fitted = tuple(i for i in range(len(drives.names)) if rotors and drives.motor_inertia[i] != 0.0)
        sliding = [links.joint[joint] == PRISMATIC for joint in drives.joint]
        names = [f"{symbol}({links.names[i]})" for i in bodies for symbol in SYMBOLS]
        units = ["kg", *["kg m"] * 3, *["kg m^2"] * 6] * len(bodies)
        names += [f"J({drives.names[i]})" for i in fitted]
        units += ["kg m^2"] * len(fitted)
        for k, what in enumerate(FRICTION):
            names += [f"{what}({name})" for name in drives.names]
            turning, sliding_unit = (("N m", "N"), ("N m s/rad", "N s/m"), ("N m", "N"))[k]
            units += [sliding_unit if slides else turning for slides in sliding]
        n2 = np.asarray(drives.transmission, dtype=np.float64) ** 2
        return cls(mech, tuple(names), tuple(units), bodies, fitted, n2)

    @property
    def inertial(self) -> int:
        """Number of the links' parameters."""
        return PARAMETERS * len(self.bodies)

    @property
    def friction(self) -> slice:
        """Slice of the parameters that are the drives' friction: d dry, d viscous, d offsets."""
        return slice(self.inertial + len(self.rotors), len(self.names))

    def columns(self, links: Floats, rates: Floats, accelerations: Floats, signs: Floats) -> Floats:
        """Torques (N, d, P) per unit of each parameter, in N states.

        links  (N, d, 10 w) those of the links;   rates, accelerations, signs  (N, d) of the drives
        """
        N, d = rates.shape
        out = np.zeros((N, d, len(self.names)))
        out[:, :, : self.inertial] = links
        for k, i in enumerate(self.rotors):
            out[:, i, self.inertial + k] = self.ratio_squared[i] * accelerations[:, i]
        first = self.friction.start
        for i in range(d):
            out[:, i, first + i], out[:, i, first + d + i], out[:, i, first + 2 * d + i] = (
                signs[:, i],
                rates[:, i],
                1.0,
            )
        return out

    @cached_property
    def order(self) -> list[int]:
        """Indices of the parameters in the order in which base parameters are chosen (module docstring)."""
        keys = list[tuple[int, int, int]]()
        for k, i in enumerate(self.bodies):
            axis = np.abs(self.mech.axis[0, i])
            about = int(np.argmax(axis)) if axis.any() else 2
            for j in range(PARAMETERS):  # as in `SYMBOLS`
                # 1 moment about the axis, 2 products, 3 and 4 other moments, 5 first moments, 6 mass
                rank = 6 if j == 0 else 5 if j < 4 else 1 if j == 4 + about else 2 if j > 6 else 3
                # of the two other moments of inertia the latter adds to those kept: I_xx - I_yy
                rank += int(j in (4, 5, 6) and rank == 3 and j == max(x for x in (4, 5, 6) if x != 4 + about))
                # of one rank the later links first
                keys.append((rank, -k, j))
        keys += [(7, k, 0) for k in range(len(self.rotors))]
        keys += [(0, k, 0) for k in range(len(self.names) - len(keys))]  # friction
        return sorted(range(len(keys)), key=keys.__getitem__)


@dataclass(frozen=True)
class BaseParameters:
    """The combinations beta = G Phi that torques can tell apart, b of P parameters.

    parameters  all of them
    kept        (b,)    the parameter that leads each combination
    matrix      (b, P)  G: 1 for the kept one
    """

    parameters: Parameters
    kept: tuple[int, ...]
    matrix: Floats

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names (b,) of the combinations: "I_zz(upper) + 0.0216 m(distal)"."""
        return tuple(self._name(row) for row in range(len(self.kept)))

    def _name(self, row: int) -> str:
        """Name of the combination in a row of `matrix`, its leading parameter first."""
        lead, others = self.kept[row], np.flatnonzero(self.matrix[row])
        text = self.parameters.names[lead]
        for j in others[others != lead]:
            share = float(self.matrix[row, j])
            size = "" if abs(abs(share) - 1.0) < SMALL else f"{abs(share):.4g} "
            text += f" {'-' if share < 0.0 else '+'} {size}{self.parameters.names[j]}"
        return text

    def determines(self, gradient: Floats) -> bool:
        """Whether a function of all parameters with this gradient (P,) depends on the base parameters alone."""
        by_base = gradient[list(self.kept)]
        left = gradient - by_base @ self.matrix
        return bool(np.max(np.abs(left), initial=0.0) <= 1e-6 * np.max(np.abs(gradient), initial=0.0))


def base_parameters(parameters: Parameters, start: Floats, gravity: Floats) -> BaseParameters:
    """The base parameters of a mechanism, over random states about a posture, as the module's docstring says.

    start    (n,) joint coordinates of the posture;   gravity  (3,) [m/s²]
    """
    W = _random_columns(parameters, start, gravity)
    size = np.sqrt(np.einsum("rp,rp->p", W, W))
    scaled = W / np.where(size > 0.0, size, 1.0)
    kept, basis = list[int](), np.zeros((W.shape[0], 0))  # basis: of the columns kept, orthonormal
    # parameters that change a torque by more than rounding, 1e-12 of the largest
    felt = size > DEPENDENT * np.max(size[: parameters.inertial], initial=0.0) * 1e-4
    for j in parameters.order:
        left = scaled[:, j]
        for _ in range(2):  # the second time takes away what rounding left
            left = left - basis @ (basis.T @ left)
        length = float(np.linalg.norm(left))
        if felt[j] and length > DEPENDENT:
            kept.append(j)
            basis = np.concatenate([basis, left[:, None] / length], axis=1)
    kept.sort()
    K = np.linalg.lstsq(scaled[:, kept], scaled, rcond=None)[0]
    K[np.abs(K) < SMALL] = 0.0
    G = K * np.where(felt, size, 0.0) / size[kept][:, None]  # of columns that are not scaled
    G[:, kept] = np.eye(len(kept))
    return BaseParameters(parameters, tuple(kept), G)


def _random_columns(parameters: Parameters, start: Floats, gravity: Floats) -> Floats:
    """Torques (rows, P) per unit of each parameter, of all drives in random states near a posture.

    start  (n,) joint coordinates of the posture;   gravity  (3,) [m/s²]
    """
    mech, rng = parameters.mech, np.random.default_rng(0)
    d = mech.driven
    driven = mech.joint[-d:]  # the driven joints are the last
    scale = np.where(mech.kind[driven] == PRISMATIC, mech.size[0], 1.0)
    # four torques for each parameter, and a few states more
    wanted, rows = 4 * len(parameters.names) // d + 8, list[Floats]()
    for _ in range(TRIES * wanted):
        step = mech.to_drive[0] @ (rng.uniform(-TURN, TURN, d) * scale)
        rates, accelerations = rng.normal(size=(2, 1, d)) * scale
        angles = moved_posture(mech, start, step)
        if angles is None:
            continue
        coordinates = (mech.to_drive[0] @ angles[driven])[None]
        # how fast the states are does not matter: only the rank of the columns counts
        links, _, done = inertia_regressor(mech, angles, coordinates, rates, 3.0 * accelerations, gravity)
        if done:
            rows.append(parameters.columns(links, rates, 3.0 * accelerations, np.sign(rates))[0])
        if len(rows) == wanted:
            break
    return np.concatenate(rows) if rows else np.zeros((0, len(parameters.names)))
