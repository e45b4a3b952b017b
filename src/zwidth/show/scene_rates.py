"""How the drawn points of a mechanism move with the coordinates of its plant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.mechanism import Mechanism
from zwidth.model.mechanism_arrays import pack
from zwidth.model.motions import Motions
from zwidth.model.posture import Posture, link_points
from zwidth.show.mechanism_scene import Place, joint_places, stroke_places


@dataclass(frozen=True)
class SceneRates:
    """Motion of each point of a `MechanismScene` per unit of each of n coordinates [m/rad], or [1] of a length.

    strokes  (k, 3, n)  of all links one after another;   joints (j, 3, n), driven (d, 3, n), handle (3, n)
    """

    strokes: Floats
    joints: Floats
    driven: Floats
    handle: Floats


def mode_strokes(mechanism: Mechanism, posture: Posture, count: int | None = None) -> SceneRates:
    """Motion of the drawn points with the coordinates of the full model's plant, the loops kept closed.

        x' = J B p'        as in `model.motions`; times the shape of a mode in p, how it moves the picture

    count    n of the plant: driven and free joints, bending, then motors and an arm, with which no link moves;
             None: without the latter
    Returns  SceneRates of a single posture that is OK
    """
    motions = Motions(pack(mechanism), posture.angles, mechanism.flexible)
    unmoving = 0 if count is None else count - motions.count
    placed = link_points(mechanism, posture)
    known: dict[tuple[int, bytes], Floats] = {}

    def rates(places: Sequence[Place]) -> Floats:
        found = np.zeros((len(places), 3, motions.count + unmoving))
        for k, (link, local) in enumerate(places):
            key = (link, local.tobytes())  # strokes go through a joint many times
            if key not in known:
                known[key] = motions.point(link, local).speed
            found[k, :, : motions.count] = known[key]
        return found

    return SceneRates(
        strokes=rates([place for stroke in stroke_places(mechanism, placed) for place in stroke]),
        joints=rates(joint_places(mechanism)),
        driven=rates([(int(joint), np.zeros(3)) for joint in mechanism.drives.joint]),
        handle=rates([(mechanism.handle_link, np.asarray(mechanism.handle_point))])[0],
    )
