"""The coordinates of a mechanism's drives: how they move with the joints, and where the computer sees the device.

The coordinate of a drive is its motor's angle over the transmission's ratio at the posture that is linearised
about. A motor behind a bent spring is ahead of its joint, so that the computer, which counts the motor, sees the
device in another posture than it is in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.continuation import moved_posture
from zwidth.model.mechanism import Mechanism
from zwidth.model.motions import Motions

STEPS: Final = 60  # of the search for the counted posture
SETTLED: Final = 1e-13  # change of a coordinate below which it has been found


@dataclass(frozen=True)
class DriveMotion:
    """T (d, c) and its derivative Z (d, c, c): the drives' coordinates move by T p' and T p'' + p'^T Z p'."""

    T: Floats
    Z: Floats

    @classmethod
    def of(cls, mechanism: Mechanism, motions: Motions, angles: Floats, ratio: Floats) -> DriveMotion:
        """Of one design.

        angles  (n,) joint coordinates;   ratio  (d,) of the posture that is linearised about, which drives with a
                table refer to
        """
        drives = mechanism.drives
        each = [motions.joint(int(link)) for link in drives.joint]
        T, Z = np.array([rate for rate, _ in each]), np.array([second for _, second in each])
        if drives.coupling is not None:
            for i, row in enumerate(np.asarray(drives.coupling).reshape(len(T), -1)):
                for link in np.flatnonzero(row):
                    rate, second = motions.joint(int(link))
                    T[i], Z[i] = T[i] + row[link] * rate, Z[i] + row[link] * second
        for i, table in enumerate(drives.ratio_tables or ()):
            if table is not None:
                q, rate = angles[drives.joint[i]], each[i][0]
                here, slope = float(table.at(q)) / ratio[i], float(table.slope(q)) / ratio[i]
                T[i], Z[i] = here * T[i], here * Z[i] + slope * np.outer(rate, rate)
        return cls(T, Z)


def drive_travel(mechanism: Mechanism, start: Floats, end: Floats, ratio: Floats) -> Floats:
    """By what the drives' coordinates (d,) differ between two postures, given by their joint coordinates (n,)."""
    drives, way = mechanism.drives, end - start
    travel = way[drives.joint].copy()
    if drives.coupling is not None:
        travel += np.asarray(drives.coupling).reshape(len(travel), -1) @ way
    for i, table in enumerate(drives.ratio_tables or ()):
        if table is not None:
            joint = drives.joint[i]
            travel[i] = float(table.motor_angle(end[joint]) - table.motor_angle(start[joint])) / ratio[i]
    return travel


@dataclass(frozen=True)
class CountedPosture:
    """The device as the computer sees it, its kinematics being those of rigid drives.

    angles   (n,)  joint coordinates;   motions, drives  there
    seen     (k, d)  change of the k driven coordinates per change of the drives' coordinates that are counted
    """

    angles: Floats
    motions: Motions
    drives: DriveMotion
    seen: Floats


def counted_posture(
    mechanism: Mechanism, start: Motions, angles: Floats, ahead: Floats, ratio: Floats
) -> CountedPosture | None:
    """The posture whose drive coordinates are nearest, by least squares, to those that are counted.

        T^T (z(p) - z) = 0         dp/dz = (T^T T + sum_i r_i Z_i)^-1 T^T,   r = z(p) - z

    With a drive for each coordinate r is 0. Free joints are taken to stand where they do.

    start    motions of the device;   angles (n,)  its joint coordinates
    ahead    (d,)  by what the counted coordinates are ahead of those of its joints
    Returns  None where the joints cannot be there, or the drives do not determine where they are
    """
    mech, at, motions, k = start.mech, angles, start, len(mechanism.driven)
    for _ in range(STEPS):
        drives = DriveMotion.of(mechanism, motions, at, ratio)
        T, Z = drives.T[:, :k], drives.Z[:, :k, :k]
        away = drive_travel(mechanism, angles, at, ratio) - ahead
        try:
            seen = np.linalg.solve(T.T @ T + np.tensordot(away, Z, 1), T.T)
        except np.linalg.LinAlgError:
            return None
        step = -(seen @ away)
        if not np.isfinite(step).all():  # outside the table of a ratio
            return None
        if np.max(np.abs(step), initial=0.0) <= SETTLED:
            return CountedPosture(at, motions, drives, np.asarray(seen, dtype=np.float64))
        moved = moved_posture(mech, at, np.append(step, np.zeros(motions.count - k)))
        if moved is None or not np.isfinite(moved).all():
            return None
        at, motions = moved, Motions(mech, moved)
    return None
