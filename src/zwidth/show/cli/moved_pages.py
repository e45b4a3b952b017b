"""What people read of a whole mechanism's motion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite, isnan
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.cli.answer import Row, sheet, table
from zwidth.show.cli.energies import HEADINGS, energy_rows
from zwidth.show.cli.heading import computer
from zwidth.show.cli.simulation_page import environment_words
from zwidth.show.output import shown
from zwidth.show.units import amount, percent, typed, vector

if TYPE_CHECKING:
    from zwidth.show.cli.moved import Moved

FINE: Final = 4  # substeps that friction asks for, which switches within a step
DUST: Final = 1e-13  # share of the motion's size below which a length is rounding
NO_WAY: Final = 1e-9  # share of the largest motion below which there is none
COUNTED: Final = ("encoder steps", "noise")


def pages(found: Moved, document: dict[str, Any]) -> Iterator[Any]:
    """What was asked, how it ended, the numbers, the energies, and what is worth a remark."""
    start = vector(found.posture.position, "m")
    yield f"{shown(found.device.name)}: the whole mechanism from {start}, assembly {document['assembly']}"
    yield computer(found.device.controller)
    yield _status(document)
    yield sheet([*_circumstances(found, document), *_results(found, document)])
    yield table(HEADINGS, list(_energies(document["energy_book_J"])))
    yield from _remarks(found, document)
    if "file" in document:
        yield f"written: {document['file']}"


def _status(document: Mapping[str, Any]) -> str:
    if document["ended_because"] is None:
        return f"moved for {amount(document['duration_s'], 's')}"
    return f"ended before its time: {document['ended_because']}"


def _circumstances(found: Moved, document: Mapping[str, Any]) -> Iterator[Row]:
    yield "surface", _surface(found, document)
    moving = f"with {vector(found.start_velocity, 'm/s')}" if found.start_velocity.any() else "at rest"
    yield "start", moving
    yield "hand", f"pushes with {vector(found.push, 'N')}" if found.push.any() else "does not push"
    if found.gravity.any():
        yield "gravity", vector(found.gravity, "m/s²")
    steps = "step" if document["substeps"] == 1 else "steps"
    samples = "sample" if len(found.motion.time) == 1 else "samples"
    length = f"{amount(document['duration_s'], 's')}, {len(found.motion.time)} {samples}"
    yield "simulated", f"{length}, {document['substeps']} {steps} between them"


def _surface(found: Moved, document: Mapping[str, Any]) -> str:
    surface = document["surface"]
    if surface is None:
        return "none: the motors stay without current"
    hollow = "hollow " if surface.get("hollow") else ""
    match surface["kind"]:
        case "plane":
            sides = "two-sided plane" if surface["two_sided"] else "plane"
            place = f"{sides} through {vector(surface['point_m'], 'm')}, normal {vector(surface['normal'])}"
        case "sphere":
            radius = amount(surface["radius_m"], "m")
            place = f"{hollow}sphere round {vector(surface['center_m'], 'm')}, radius {radius}"
        case _:
            sizes = vector(surface["half_sizes_m"], "m")
            place = f"{hollow}box round {vector(surface['center_m'], 'm')}, half sizes {sizes}"
    if found.asked.environment is not None and found.environment is not None:
        return f"{place}; {environment_words(found.environment, document['parameters'])}"
    stiffness, damping = document["wall_stiffness_N_per_m"], document["wall_damping_Ns_per_m"]
    pulls = ", never pulls" if document["no_pull"] else ""
    return f"{place}; {amount(stiffness, 'N/m')}, {amount(damping, 'Ns/m')}{pulls}"


def _results(found: Moved, document: Mapping[str, Any]) -> Iterator[Row]:
    import numpy as np

    motion = found.motion
    if found.surface is not None:
        yield "largest penetration", _when(document["largest_penetration_m"], "m", _depths(found), motion.time)
        size = np.linalg.norm(motion.force, axis=1)
        yield "largest force", _when(document["largest_force_N"], "N", size, motion.time)
        yield "in contact", f"{typed(percent(document['contact_share']))} of the samples"
        yield "torque limits", _limits(found, document)
        if isfinite(found.device.controller.saturation):
            yield "force limit", _share(document["force_limit_share"])
    size = float(np.max(np.abs(motion.position)))
    yield "handle at the end", vector(_without_dust(motion.position[-1], size), "m")
    path = float(np.sum(np.linalg.norm(np.diff(motion.position, axis=0), axis=1)))
    yield "its path", amount(path if path > DUST * size else 0.0, "m")


def _without_dust(place: Any, size: float) -> Any:
    import numpy as np

    return np.where(np.abs(place) > DUST * size, place, 0.0)


def _depths(found: Moved) -> Any:
    import numpy as np

    return np.abs(found.motion.depth) if found.motion.two_sided else found.motion.depth


def _when(value: float, unit: str, course: Any, time: Any) -> str:
    if not value > 0.0:
        return amount(0.0, unit)
    return f"{amount(value, unit)}, after {amount(float(time[course.argmax()]), 's')}"


def _limits(found: Moved, document: Mapping[str, Any]) -> str:
    limits = found.mechanism.drives.torque_limit
    shares = document["torque_limit_share"]
    told = [
        f"{shown(name)} {_share(share)}"
        for (name, share), limit in zip(shares.items(), limits, strict=True)
        if isfinite(limit)
    ]
    return "; ".join(told) or "none in the file"


def _share(share: float) -> str:
    return f"reached in {typed(percent(share))} of the samples" if share > 0.0 else "not reached"


def _energies(book: Mapping[str, float]) -> Iterator[tuple[str, str, str]]:
    """The motion and bending of the drives last, as in simulated contacts; what is not known, by difference."""
    own = {"hand": book["hand"], "motors": book["motors"], "gravity": book["gravity"]}
    own["dry friction"] = book["friction"]
    if isnan(own["motors"]):
        known = own["hand"] + own["gravity"] + own["dry friction"]
        own = {"motors and dampers, by difference" if name == "motors" else name: x for name, x in own.items()}
        own["motors and dampers, by difference"] = book["stored"] - known
    else:
        own["dampers, by difference"] = book["dampers"]
    return energy_rows(own, book["stored"])


def _remarks(found: Moved, document: Mapping[str, Any]) -> Iterator[str]:
    import numpy as np

    motion, parts = found.motion, found.device.left_out
    moved = float(np.max(np.ptp(motion.position, axis=0)))
    still = not moved > DUST * float(np.max(np.abs(motion.position)))
    if document["started_inside"]:
        side = f"behind the {document['surface']['kind']}" if motion.two_sided else "inside the wall"
        yield f"starts {amount(float(motion.depth[0]), 'm')} {side}"
    part = [name for name in parts if not (found.asked.exact and name in COUNTED)]
    if part:
        yield f"with what a chart leaves out: {', '.join(part)}"
    if "dry friction" in part and found.asked.substeps < FINE:
        yield f"friction switches within a step: take --substeps {FINE} or more"
    if document["left_out"]:
        yield f"leaves out {', '.join(document['left_out'])}: the hand is the push alone"
    if lost := _lost(found):
        yield f"{amount(lost, 'N')} of the push are across all ways the handle can go, and move nothing"
    if not (found.push.any() or found.start_velocity.any() or found.gravity.any()) and still:
        yield "nothing moves it: give --push, --start-velocity or --gravity"
    elif found.surface is not None and not document["contact_share"]:
        yield "the handle never touches the surface"


def _lost(found: Moved) -> float:
    """How much of the push lies across all directions in which the handle can go [N]; 0 where none does."""
    import numpy as np

    along, sizes, _ = np.linalg.svd(found.posture.jacobian)
    ways = along[:, : len(sizes)][:, sizes > NO_WAY * sizes.max()]
    across = float(np.linalg.norm(found.push - ways @ (ways.T @ found.push)))
    return across if across > NO_WAY * float(np.linalg.norm(found.push)) else 0.0
