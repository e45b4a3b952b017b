"""What is computed beside the view: maps, what to change, contacts, measured points, and files to be kept."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.contact_simulation import ContactSimulation
from zwidth.contact.engine_arrays import ACTUATOR, CONTROLLER, ESTIMATE, HOLD, QUANTISER, WALL
from zwidth.progress import Progress
from zwidth.show.app.layers import scene_rates, touch_blocks
from zwidth.show.app.opened import OpenedDevices
from zwidth.show.app.request import (
    ContactRequest,
    ExportRequest,
    MapRequest,
    PointsRequest,
    SensitivityRequest,
)
from zwidth.show.cli.errors import BadInput
from zwidth.show.mechanism_scene import mechanism_scene, stays_in_plane

WORDS: Final = {"figure": "chart", "data": "chart", "report": "report", "python": "lines"}
Contents = tuple[dict[str, Any], dict[str, Any]]


def workspace(opened: OpenedDevices, request: MapRequest, progress: Progress) -> Contents:
    """A measure over a plane of the device's workspace, in this process.

    That is the plane that the handle cannot leave; of a spatial device the one through the handle in which its
    links spread most.
    """
    from zwidth.study.workspace.map import workspace_map
    from zwidth.study.workspace.plane_grid import plane_of

    state, device = request.state, opened.device(request.state)
    cells = (request.count, request.count)
    point = opened.point(state, device)
    if point.mechanism is None or point.posture is None:
        raise BadInput("a map is drawn of a device with a mechanism")
    scene = mechanism_scene(point.mechanism, point.posture)
    if stays_in_plane(scene, point.posture):
        plane = plane_of(device, cells=cells)
    else:
        flat = "".join("xyz"[k] for k in sorted(scene.flat))
        plane = plane_of(device, flat, point.posture.position.tolist(), cells=cells)
    data = workspace_map(
        device,
        request.measure,
        plane,
        direction=state.direction,
        assembly=state.assembly,
        model=state.model,
        progress=progress,
        workers=1,
    )
    values = data[request.measure]
    axes = [str(name) for name in values.dims]
    arrays = {
        "y": np.asarray(data[axes[0]]),
        "x": np.asarray(data[axes[1]]),
        "values": np.asarray(values, dtype=float),
        "status": np.asarray(data[f"{request.measure}_status"]).astype(np.uint8),
    }
    arrays |= {"first": plane.first, "second": plane.second, "through": plane.through}
    return {"measure": request.measure, "unit": str(values.attrs.get("units", ""))}, arrays


def what_to_change(opened: OpenedDevices, request: SensitivityRequest, progress: Progress) -> Contents:
    """Sensitivity of the largest stiffness to each number; with a goal, what each would have to be."""
    from zwidth.study.sensitivity.sensitivities import sensitivities

    device = opened.device(request.state)
    point = opened.point(request.state, device)
    head: dict[str, Any] = dict(sensitivities(device, point, progress).document())
    if request.goal is not None:
        from zwidth.study.sensitivity.goal import numbers_for_goal

        head["goal"] = numbers_for_goal(device, point, request.goal, progress).document()
    return head, {}


def contact(opened: OpenedDevices, request: ContactRequest, progress: Progress) -> Contents:
    """One contact with the state's wall, as `zwidth simulate` has it, and what draws its vibration in the page.

    That is of the layers `scene` and `touch`, the device at the contact's start.
    """
    state = request.state
    point = opened.point(state)
    if state.wall is None:
        raise BadInput("choose a wall on the chart first")
    made = point.simulate(
        stiffness=state.wall.stiffness,
        damping=state.wall.damping,
        wall="one-sided" if request.one_sided else "two-sided",
        start_position=request.depth,
        start_velocity=request.velocity,
        push=request.push,
        duration=request.duration,
        progress=progress,
    )
    document = made.document()
    for name in made.response.series:
        del document[name]
    document["delay_samples"] = point.controller.delay
    arrays = {
        "time": made.time,
        "reading": made.position,
        "place": made.response.truth,
        "force": made.force,
        "made": _made_by_wall(made),
    }
    try:
        blocks, more = touch_blocks(point, request.depth, request.velocity)
        still, rates = scene_rates(point)
    except (ArithmeticError, ValueError) as error:
        return {**document, "touch": {"reason": str(error)}}, arrays
    arrays |= {f"touch.{name}": value for name, value in more.items()}
    arrays |= {f"scene.{name}": value for name, value in rates.items()}
    return {**document, "touch": blocks, "scene": still}, arrays


def _made_by_wall(contact: ContactSimulation) -> Floats:
    """Energy that the wall has made since the start, at each sample [J]; negative: taken out.

    What it gave to the device, less what its spring had stored at the start and has not now: an ideal spring makes
    none, an ideal damper takes some out. Sampling, estimate, encoder, delay and limit are the wall's.
    """
    given = contact.response.energies[:, [WALL, HOLD, ESTIMATE, QUANTISER, CONTROLLER, ACTUATOR]].sum(axis=1)
    depth = contact.response.truth - contact.wall_position
    if contact.environment.name == "one-sided":
        depth = np.maximum(depth, 0.0)
    stored = 0.5 * contact.parameters["stiffness"] * depth**2
    made: Floats = given + stored - stored[0]
    return made


def measured_points(opened: OpenedDevices, request: PointsRequest) -> Contents:
    """The measured points of a file, and the device's verdict on each."""
    from zwidth.study.boundary.points_file import read_points

    if request.file not in opened.texts:
        raise BadInput(f"{request.file} has not been sent by the page; open it once more")
    points = read_points(request.file)
    walls = np.array([(one.stiffness, one.damping) for one in points])
    checked = opened.point(request.state).check(walls[:, 0], walls[:, 1])
    spread = [(one.damping_low, one.damping_high, one.stiffness_low, one.stiffness_high) for one in points]
    words = [{"edge": one.edge, "verdict": one.verdict} for one in points]
    return {"file": request.file, "points": words, "verdicts": checked.names}, {"walls": walls, "spread": spread}


def export(opened: OpenedDevices, request: ExportRequest) -> Contents:
    """A file to be kept, as bytes, and the name that it is offered under."""
    from zwidth.show.app.kept_files import kept_file

    content = kept_file(opened, request)
    stem = request.state.device.removesuffix(".toml")
    ending = "" if request.what == "device" else f"-{WORDS[request.what]}"
    return {"name": f"{stem}{ending}.{request.format}"}, {"content": np.frombuffer(content, dtype=np.uint8)}
