"""Devices whose links bend as frames of finite elements: from the document of a device file, by other code.

The package has a part in the posture alone, the coordinates of the joints. Places, axes, beams, what they carry,
joints, closures and drives are read off the document here, and joined in global coordinates by `frame_elements`.
Motors are coordinates of their own: a rotor's energy is J_m (n theta')^2 / 2, theta the angle at its joint.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

from tests.model.frame_elements import GROUND, Frame, modes_of

ELASTIC = {"aluminium-6061": (68.9e9, 26.0e9, 2700.0), "steel": (200e9, 77e9, 7850.0)}


@dataclass(frozen=True)
class Beam:
    """What a frame asks of a beam."""

    EI_y: float
    EI_z: float
    GJ: float
    EA: float
    mass_per_length: float
    torsional_inertia_per_length: float


def beam_of(table):
    """A [mechanism.links.beam] of a rod, a tube or of numbers."""
    if "section" not in table:
        bending = np.broadcast_to(table["bending_stiffness_Nm2"], 2)
        others = "torsion_stiffness_Nm2", "axial_stiffness_N", "mass_per_length_kg_per_m"
        rest = [table[key] for key in (*others, "torsional_inertia_per_length_kg_m")]
        return Beam(float(bending[0]), float(bending[1]), *rest)
    section, material = table["section"], table["material"]
    E, G, rho = (
        ELASTIC[material]
        if isinstance(material, str)
        else (material[key] for key in ("youngs_modulus_Pa", "shear_modulus_Pa", "density_kg_per_m3"))
    )
    outer = section["diameter_m"] if section["shape"] == "rod" else section["outer_diameter_m"]
    inner = 0.0 if section["shape"] == "rod" else outer - 2.0 * section["wall_m"]
    A, I = pi * (outer**2 - inner**2) / 4.0, pi * (outer**4 - inner**4) / 64.0
    return Beam(E * I, E * I, G * 2.0 * I, E * A, rho * A, rho * 2.0 * I)


def three(values):
    return np.concatenate([np.array(values, dtype=float), np.zeros(3)])[:3]


def inertia_of(link):
    """(3, 3); one number is about the joint's axis alone."""
    given = np.array(link["inertia_kg_m2"], dtype=float)
    if given.ndim == 0:
        axis = unit(link.get("axis", (0.0, 0.0, 1.0)))
        return float(given) * np.outer(axis, axis)
    return np.diag(given) if given.ndim == 1 else given


def unit(vector):
    return np.array(vector, dtype=float) / np.linalg.norm(vector)


def spread(mass, arm):
    """Inertia (3, 3) of a mass at an arm (3,)."""
    return mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def placed(links, angles):
    """Place (3,) and axes (3, 3) of each link in the base's frame, and the axis (3,) of its joint.

    links   tables of a device file, parents first;   angles  of each by its name, a universal joint's two
    """
    found = {"base": (np.zeros(3), np.eye(3), None)}
    lengths = {"base": 0.0} | {link["name"]: link.get("length_m", 0.0) for link in links}
    for link in links:
        parent = link.get("parent", "base")
        o, R, _ = found[parent]
        R_link = R @ Rotation.from_euler("xyz", link.get("orientation_rad", (0, 0, 0))).as_matrix()
        o = o + R @ three(link.get("origin_m", (lengths[parent],)))
        own, q = unit(link.get("axis", (0.0, 0.0, 1.0))), angles.get(link["name"], 0.0)
        axis = R_link @ own
        if link["joint"] == "prismatic":
            o = o + q * axis
        elif link["joint"] == "revolute":
            R_link = R_link @ Rotation.from_rotvec(q * own).as_matrix()
        elif link["joint"] == "universal":
            second = unit(link.get("second_axis", (0.0, 1.0, 0.0)))
            for each, turn in zip((own, second), q, strict=True):
                R_link = R_link @ Rotation.from_rotvec(turn * each).as_matrix()
        found[link["name"]] = o, R_link, axis
    return found


class FramedDevice:
    """A device as a frame, with its motors.

    M, K     of [the motions that all joints allow, the flexible drives' motors]
    handle   (3, n) displacement of the handle;   motors (d, n) of each drive's motor, at its joint
    """

    def __init__(self, document, angles, elements=8):
        """angles: joint coordinate of each link by its name."""
        self.mechanism, self.elements = document["mechanism"], elements
        self.links = {link["name"]: link for link in self.mechanism["links"]}
        self.frame, self.station, self.base, self.member_of = Frame(), {}, {}, {}
        found = placed(self.mechanism["links"], angles)
        self.place, self.turn, self.axis = ({name: each[i] for name, each in found.items()} for i in range(3))
        for name, link in self.links.items():
            self._build(name, link)
        self.joints = {name: self._joint(name, link) for name, link in self.links.items()}
        for loop in self.mechanism.get("loops", ()):
            self._close(loop)
        self.T = self.frame.motions()
        self._assemble()

    # --- links and what is fixed to them ----------------------------------------------------------------

    def _origin(self, link):
        """Where the joint is, in the parent's frame."""
        parent = link.get("parent", "base")
        length = 0.0 if parent == "base" else self.links[parent].get("length_m", 0.0)
        return three(link.get("origin_m", (length,)))

    def _fixed_places(self, name):
        """Places in a link's frame at which something is fixed to it."""
        link = self.links[name]
        yield three((link.get("length_m", 0.0),))
        for child in self.links.values():
            if child.get("parent") == name:
                yield self._origin(child)
        for loop in self.mechanism.get("loops", ()):
            for end, where in zip(loop["links"], self._loop_points(loop), strict=True):
                if end == name:
                    yield where
        if self.mechanism["handle"]["link"] == name and "point_m" in self.mechanism["handle"]:
            yield three(self.mechanism["handle"]["point_m"])

    def _loop_points(self, loop):
        tips = [three((self.links[n].get("length_m", 0.0) if n != "base" else 0.0,)) for n in loop["links"]]
        return [three(point) for point in loop["points_m"]] if "points_m" in loop else tips

    def _build(self, name, link):
        R, frame = self.turn[name], self.frame
        self.base[name] = frame.point(self.place[name])
        if "beam" not in link:
            offset = R @ three(link.get("center_of_mass_m", (0.0,)))
            if link.get("mass_kg", 0.0) > 0.0:
                frame.body(self.base[name], link["mass_kg"], R @ inertia_of(link) @ R.T, offset)
            self.station[name] = [(0.0, self.base[name])]
            return
        beam, L = beam_of(link["beam"]), link["length_m"]
        carried, centre, inertia = self._carried(link, beam)
        places = [min(max(where[0], 0.0), L) for where in self._fixed_places(name)]
        if carried > 0.0:
            places.append(min(max(centre[0], 0.0), L))
        at, stations = 0.0, [(0.0, self.base[name])]
        for x in sorted({round(x, 12) for x in places} - {0.0}):
            end = frame.point(self.place[name] + R[:, 0] * x)
            count = max(2, round(self.elements * (x - at) / L))
            self.member_of.setdefault(name, []).append(len(frame.members))
            frame.member(stations[-1][1], end, beam, y_axis=R[:, 1], elements=count)
            stations.append((x, end))
            at = x
        self.station[name] = stations
        if carried > 0.0 or np.any(inertia):
            x, point = min(stations, key=lambda station: abs(station[0] - min(max(centre[0], 0.0), L)))
            frame.body(point, carried, R @ inertia @ R.T, R @ (centre - [x, 0.0, 0.0]))

    def _carried(self, link, beam):
        """What a link has beside its beam."""
        L, m = link["length_m"], beam.mass_per_length * link["length_m"]
        middle = three((L / 2.0,))
        if "mass_kg" not in link:
            return 0.0, middle, np.zeros((3, 3))
        whole, centre = link["mass_kg"], three(link.get("center_of_mass_m", (0.0,)))
        rest = whole - m
        place = (whole * centre - m * middle) / rest if rest > 1e-9 * m else np.zeros(3)
        own = np.diag([beam.torsional_inertia_per_length * L, m * L**2 / 12.0, m * L**2 / 12.0])
        inertia = inertia_of(link) - own - spread(m, middle - centre) - spread(rest, place - centre)
        if np.ndim(link["inertia_kg_m2"]) == 0:
            axis = unit(link.get("axis", (0.0, 0.0, 1.0)))
            inertia = axis @ inertia @ axis * np.outer(axis, axis)
        return max(rest, 0.0), place, inertia

    def _fixed(self, name, local, place=None):
        """A point of the frame at a place of a link's frame, fixed to its station there; or at another place."""
        if name == "base":
            return GROUND
        x = min(max(local[0], 0.0), self.links[name].get("length_m", 0.0))
        _, station = min(self.station[name], key=lambda each: abs(each[0] - x))
        where = self.place[name] + self.turn[name] @ local if place is None else place
        if np.linalg.norm(where - self.frame.points[station]) < 1e-12:
            return station
        point = self.frame.point(where)
        self.frame.rigid(point, station)
        return point

    def _joint(self, name, link):
        """Join a link to its parent; what of it moves, as a point there, one here, and a row (6,)."""
        other = self._fixed(link.get("parent", "base"), self._origin(link), self.place[name])
        here, axis = self.base[name], self.axis[name]
        if link["joint"] == "fixed":
            self.frame.weld(here, other) if other != GROUND else self.frame.clamp(here)
            return None
        if link["joint"] == "prismatic":
            self.frame.slider(here, other, axis)
            return here, other, np.concatenate([axis, np.zeros(3)])
        if link["joint"] == "universal":
            cross = self.frame.point(self.place[name])
            self.frame.hinge(cross, other, axis)
            self.frame.hinge(here, cross, self.turn[name] @ unit(link.get("second_axis", (0.0, 1.0, 0.0))))
            return None
        self.frame.hinge(here, other, axis)
        return here, other, np.concatenate([np.zeros(3), axis])

    def _close(self, loop):
        ends = [self._fixed(n, at) for n, at in zip(loop["links"], self._loop_points(loop), strict=True)]
        if loop["links"][0] == "base":
            ends.reverse()
        closes = loop.get("closes", "point")
        if closes == "point":
            self.frame.ball(*ends)
        elif closes == "frame":
            self.frame.weld(*ends)
        else:
            name = loop["links"][0]
            self.frame.hinge(*ends, self.turn[name] @ unit(loop.get("axes", [(0, 0, 1), (0, 0, 1)])[0]))

    # --- matrices ---------------------------------------------------------------------------------------

    def _row(self, here, other, row):
        """Row (n,) of the motion of one point against another."""
        whole = np.zeros(6 * len(self.frame.points))
        whole[6 * here : 6 * here + 6] = row
        if other != GROUND:
            whole[6 * other : 6 * other + 6] -= row
        return whole @ self.T

    def _assemble(self):
        drives = self.mechanism["drives"]
        rows = np.array([self._row(*self.joints[drive["joint"]]) for drive in drives])
        ratio = np.array([drive["transmission_ratio"] for drive in drives])
        rotor = ratio**2 * [drive["motor_inertia_kg_m2"] for drive in drives]
        spring = ratio**2 * [drive.get("stiffness_Nm_per_rad", np.inf) for drive in drives]
        flexible = np.flatnonzero(np.isfinite(spring))
        m, f = self.T.shape[1], len(flexible)
        M, K = np.zeros((m + f, m + f)), np.zeros((m + f, m + f))
        M[:m, :m], K[:m, :m] = (
            self.T.T @ matrix @ self.T for matrix in (self.frame.mass(), self.frame.stiffness())
        )
        joints = np.hstack([rows, np.zeros((len(rows), f))])
        self.motors = joints.copy()
        self.motors[flexible] = np.eye(m + f)[m:]
        for i, (joint, motor) in enumerate(zip(joints, self.motors, strict=True)):
            M += rotor[i] * np.outer(motor, motor)
            if i in flexible:
                K += spring[i] * np.outer(joint - motor, joint - motor)
        self.M, self.K = M, K
        handle = self.mechanism["handle"]
        link = handle["link"]
        local = three(handle.get("point_m", (self.links[link].get("length_m", 0.0),)))
        x = min(max(local[0], 0.0), self.links[link].get("length_m", 0.0))
        at, station = min(self.station[link], key=lambda each: abs(each[0] - x))
        arm = self.turn[link] @ (local - [at, 0.0, 0.0])
        self.handle = np.zeros((3, m + f))
        for i, along in enumerate(np.eye(3)):
            self.handle[i, :m] = self._row(station, GROUND, np.concatenate([along, np.cross(arm, along)]))
        self.handle_place = self.place[link] + self.turn[link] @ local

    # --- answers ----------------------------------------------------------------------------------------

    def frequencies(self, count):
        """The lowest (count,) [Hz], free ones 0."""
        return np.sqrt(modes_of(self.K, self.M)[0][:count]) / (2.0 * pi)

    def rigid_mass(self, direction):
        """Mass at the handle in motions without deformation [kg]."""
        squared, shapes = modes_of(self.K, self.M)
        h = direction @ self.handle @ shapes[:, squared == 0.0]
        return 1.0 / float(h @ h)

    def deflection(self, force):
        """Displacement (3,) of the handle under a force (3,) there, the motors held [m]."""
        return self.handle @ self.held_motion(force)

    def held_motion(self, force):
        N = null_space(self.motors)
        return N @ np.linalg.solve(N.T @ self.K @ N, N.T @ (self.handle.T @ force))

    def static_response(self, force):
        """Displacement and rotation of each point of the frame (N, 6), the motors held."""
        moved = self.held_motion(force)
        return (self.T @ moved[: self.T.shape[1]]).reshape(-1, 6)

    def under_axial_forces(self, forces):
        """The same device with an axial force in each member (tension positive) [N]."""
        m, loaded = self.T.shape[1], self.__class__.__new__(self.__class__)
        loaded.__dict__ |= self.__dict__ | {"K": self.K.copy()}
        loaded.K[:m, :m] += self.T.T @ self.frame.geometric_stiffness(forces) @ self.T
        return loaded


def framed(device, document, point=None, elements=8):
    """The judge of a device at an operating point; left out: its reference."""
    point = device.at() if point is None else point
    joints = dict(zip(device.mechanism.links.names, point.posture.angles.tolist(), strict=True))
    for name in [name for name in joints if name.endswith("/1")]:
        joints[name[:-2]] = joints[name], joints[name[:-2]]
    return FramedDevice(document, joints, elements)
