"""An operating point in words: a line of its own, its errors, and what several directions together leave out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from zwidth.errors import SeveralDirectionsError
from zwidth.model.load import Load
from zwidth.model.mechanism import Mechanism
from zwidth.model.operator import Operator
from zwidth.model.reduction import Encoders

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint


def check_several_directions(
    mechanism: Mechanism | None, operator: Operator | None, encoders: Encoders, load: Load | None
) -> None:
    """Raise SeveralDirectionsError if the device has something that several directions together cannot include."""
    windings = None if mechanism is None else mechanism.drives.winding_damping
    present = {
        "an operator": operator is not None,
        "an encoder on the link": encoders != "motor",
        "a load": load is not None,
        "electrical damping": windings is not None and bool(windings.any()),
    }
    if any(present.values()):
        raise SeveralDirectionsError([name for name, is_present in present.items() if is_present])


def points_text(shape: tuple[int, ...]) -> str:
    """Operating points by their number: 12 operating points of shape (3, 4)."""
    return f"{int(np.prod(shape))} operating points of shape {shape}"


def point_text(point: OperatingPoint) -> str:
    """Device, posture, direction, model, operator and computer, as an operating point shows itself."""
    name = point.name or "a device"
    held = f", held by {point.operator_name or 'an operator'}" if point.operator is not None else ""
    if point.differing:
        return f"OperatingPoint of {name}: designs and postures of shape {point.shape}{held}"
    computer = point.controller.timing_text
    if point.posture is None or point.directions is None:
        kind = "measured response" if point.response is not None else f"plant, model {point.model or 'as given'}"
        return f"OperatingPoint of {name}: {kind}{held}\n  {computer}"
    if point.shape:
        where = f"{int(np.prod(point.shape))} postures of shape {point.shape}"
    else:
        position = ", ".join(f"{x:.6g}" for x in np.round(point.posture.position, 12) + 0.0)
        ways = [", ".join(f"{x:.4g}" for x in np.round(u, 12) + 0.0) for u in point.directions]
        law = f", {point.wall_matrices}" if point.wall_matrices is not None else ""
        where = f"handle at ({position}) m, along " + " and ".join(f"({way})" for way in ways) + law
    model = f"assembly {point.posture.assembly}, model {point.model or 'full'}{held}"
    omitted = "".join(f"\n  {text}" for text in point.load_omissions)
    return f"OperatingPoint of {name}: {where}\n  {model}\n  {computer}{omitted}"
