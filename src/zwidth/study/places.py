"""A device's places: from positions of its handle to what measures are asked about."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from zwidth.device.device import Device
from zwidth.measures.place import Place, Wanted
from zwidth.model.arguments import require
from zwidth.model.posture import Posture, solve_posture
from zwidth.model.reduction import Model


def place_of(
    device: Device,
    positions: ArrayLike | None = None,
    direction: Sequence[float] | None = None,
    assembly: str | None = None,
    model: str | None = None,
    wanted: Wanted | None = None,
    posture: Posture | None = None,
) -> Place:
    """A device with its handle at positions (..., 3), or at one of the file's where they are left out.

    positions  (..., 3) [m]; None: at the file's reference, or a device given by its plant
    direction  of any length but zero; left out: the file's
    model      left out: "full" for a mechanism, a given plant as it is
    posture    that of these positions, where it is known already
    Raises     DeviceError   as `Device.plant` does, for a measured response too
               PostureError  where one posture is asked for and does not exist
    """
    require("device", device, Device)
    asked = wanted or Wanted()
    if device.mechanism is None:
        device.plant(None if positions is None else (0.0, 0.0), direction, assembly, model)  # raises what is wrong
        return Place(
            device.controller,
            given=device.given_plant,
            model=cast("Model | None", model),
            operator=device.operator,
            wanted=asked,
        )
    along = device.direction(direction)
    if posture is None and positions is None:
        posture = device.posture(None, assembly)
    elif posture is None:
        name = assembly or device.reference_assembly
        posture = solve_posture(device.mechanism, np.asarray(positions, dtype=np.float64), name)
    return Place(
        device.controller,
        device.mechanism,
        posture,
        np.broadcast_to(along, (*posture.status.shape, 3)),
        model=cast("Model", model or "full"),
        damping=device.damping,
        encoders=device.encoders,
        operator=device.operator,
        wanted=asked,
    )
