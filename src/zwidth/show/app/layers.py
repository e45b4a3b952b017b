"""What is drawn while a number is dragged: the chart and all that can be switched on beside it.

Other faces of one wall: impedance over frequency, Nyquist plot with passivity disks, eigenvalues.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart_base import BoundaryArc, Chart
from zwidth.chart.nyquist import terms_along
from zwidth.chart.verdict import eigenvalues
from zwidth.device.device import Device
from zwidth.device.read import DEVICES, OPERATORS, bundled, bundled_names
from zwidth.errors import ChartError, MissingNumbersError, OutOfReach
from zwidth.guarantees.disks import response_disks
from zwidth.guarantees.port import port
from zwidth.guarantees.stable_alone import stable_alone
from zwidth.loop.loop_table import circle_factors, table_of_loops
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.catalogue import MEASURES
from zwidth.model.operator import ABOUT_AN_AXIS
from zwidth.model.reduction import MODELS
from zwidth.show.app.opened import OpenedDevices
from zwidth.show.app.request import State, Wall
from zwidth.show.mechanism_scene import MassChain, as_chain, mechanism_scene, mode_strokes, stays_in_plane
from zwidth.unit_text import unit_text

LOWEST: Final = 1e-3  # rad, of the angles at which the Nyquist plot is computed
ANGLES: Final = 1200
DISKS: Final = 25  # of the angles, at which a disk is drawn


def impedance(point: OperatingPoint, wall: Wall) -> Contents:
    """Moduli over `frequency` [Hz] of the impedances of a wall [N s/m]: felt by the hand, commanded, of free
    motion; in the head static stiffness [N/m] and mass [kg] that are felt.

    `felt` is left out where it is not known.
    """
    felt = point.felt(wall.stiffness, wall.damping)
    arrays = {
        "frequency": felt.frequency,
        "commanded": np.abs(felt.commanded_impedance),
        "free": np.abs(felt.free_motion_impedance),
    }
    if felt.felt_impedance is not None:
        arrays["felt"] = np.abs(felt.felt_impedance)
    return {"static_stiffness": felt.static_stiffness, "free_motion_mass": felt.free_motion_mass}, arrays


def nyquist(point: OperatingPoint, wall: Wall) -> Contents:
    """The open loop L = P (K + B w) over the upper half of the unit circle, rows (real, imaginary, f [Hz]).

    The wall is stable where L goes round -1 as often as it must. With a passive operator, whoever it is, P lies in
    a disk at each frequency, and so does L: `disks`, rows (real, imaginary, radius, f [Hz]), of the device held by
    nobody. The wall is stable in any passive hand if no disk holds -1; `no_disks` says why there are none.
    """
    loop = point.loop
    angles = np.geomspace(LOWEST, np.pi - LOWEST, ANGLES)
    # A P and A P w, unlike P and P w, are finite at a pole of the plant too
    A, AP, APw = terms_along(circle_factors(table_of_loops(loop)), angles).T
    L = (wall.stiffness * AP + wall.damping * APw) / A
    frequencies = angles / (2.0 * np.pi * loop.period)
    arrays: dict[str, Any] = {"open_loop": np.column_stack([L.real, L.imag, frequencies])}
    head: dict[str, Any] = {}
    free = point.without_operator.loop
    handle = free.plant.handle
    if handle is None:
        return {"no_disks": "the plant has no handle, at which an operator could hold it"}, arrays
    alone = stable_alone(free)
    if alone.fails or point.load_omissions:
        return {"no_disks": alone.reason or point.load_omissions[0]}, arrays
    disk_angles = angles[:: max(1, ANGLES // DISKS)]
    disks = response_disks(free, port(free.plant, handle), disk_angles)
    A, AP, APw = terms_along(circle_factors(table_of_loops(free)), disk_angles).T
    # K + B w, by which the disk of P is turned and scaled to that of L
    wall_law = (wall.stiffness * AP + wall.damping * APw) / AP
    centre, radius = disks.centre * wall_law, disks.radius * np.abs(wall_law)
    arrays["disks"] = np.column_stack(
        [centre.real, centre.imag, radius, disk_angles / (2.0 * np.pi * loop.period)]
    )
    return head, arrays


def eigenvalues_of(point: OperatingPoint, wall: Wall) -> Contents:
    """The eigenvalues of the loop with the wall, rows (real, imaginary)."""
    z = np.sort_complex(eigenvalues(point.loop, wall.stiffness, wall.damping).ravel())
    return {}, {"z": np.column_stack([z.real, z.imag])}


Contents = tuple[dict[str, Any], dict[str, Any]]  # head of an answer or of a layer in it, and its arrays by name

Layer = Callable[[OperatingPoint, Any, State, Device], Contents]  # of a point, its chart, the state and its device

DECAY_LEVELS: Final = (0.25, 0.5, 0.75)  # of the way from radius 1 to the fastest decay
DAMPINGS: Final = 161  # at which the line of a published condition is computed


def opened_device(opened: OpenedDevices, state: State) -> Contents:
    """What the page needs to know of a device before it asks for views: words, choices and numbers."""
    from zwidth.device.numbers import device_numbers

    device = opened.device(state)
    mechanism = device.mechanism
    reference = None
    if mechanism is not None:
        rendered = np.asarray(device.reference_direction, dtype=float)
        reference = {
            "position": device.reference_position,
            "direction": rendered[:3] if rendered[:3].any() else None,
            "axis": rendered[3:] if rendered.size == 6 else None,
            "assembly": device.reference_assembly,
        }
    return {
        "name": device.name,
        "label": device.label,
        "description": device.description,
        "source": device.source,
        "given_by": "mechanism" if mechanism else "response" if device.response else "plant",
        "reference": reference,
        "assemblies": list(device.document.get("mechanism", {}).get("assemblies", {})),
        "models": list(MODELS) if device.response is None else [],
        "operator": device.operator_name,
        "operators": bundled_names(OPERATORS),
        "devices": [{"name": name, "description": about} for name, about, _ in bundled(DEVICES)],
        "measures": [{"name": k, "unit": unit_text(one.unit)} for k, one in MEASURES.items()] if mechanism else [],
        "numbers": [one.document() | {"unit": unit_text(one.unit)} for one in device_numbers(device)],
    }, {}


def page_view(opened: OpenedDevices, state: State, layers: Sequence[str], nearest: bool = False) -> Contents:
    """The layers that the page shows of one state. A layer that has no answer says why; the others stand.

    Raises what the chart raises, but not where the device's file leaves out numbers that a chart needs: its
    geometry is shown then.

    nearest  take an answered position where the handle cannot be at that of the state: `position` of the head
    """
    device = opened.device(state)
    if (
        state.hand is not None
        and device.mechanism is not None
        and device.renders_moments(state.direction, state.axis)
    ):
        # the mouse cannot hold it about an axis, which its layer says; the chart is the one held by nobody
        state = state.model_copy(update={"hand": None, "operator": "none"})
        device = opened.device(state)
    point, position = _point_near(opened, state, device, nearest)
    head: dict[str, Any] = {"moments": point.turns}
    if position is not None:
        head["position"] = position
    arrays: dict[str, Any] = {}
    chart: Chart | None = None
    for name in sorted(set(layers), key=ORDER.index):
        try:
            if chart is None and name in OF_CHART:
                chart = point.chart(decay="decay" in layers)
            layer_head, layer_arrays = LAYERS[name](point, chart, state, device)
            if name == "scene" and "touch" in layers:  # the page draws it vibrating, with the modes of that layer
                still, rates = scene_rates(point)
                layer_head, layer_arrays = layer_head | still, layer_arrays | rates
        except (ArithmeticError, ValueError, NotImplementedError, ChartError) as error:
            missing = isinstance(error, MissingNumbersError)  # whose text has no subject
            if name == "chart" and not missing:
                raise
            head[name] = {"reason": f"{'It ' if missing else ''}{_failure_sentence(error)}"}
            continue
        head[name] = layer_head
        arrays |= {f"{name}.{key}": value for key, value in layer_arrays.items()}
    return head, arrays


def _point_near(
    opened: OpenedDevices, state: State, device: Device, nearest: bool
) -> tuple[OperatingPoint, tuple[float, ...] | None]:
    """The operating point of a state, and None.

    With `nearest`, where the handle cannot be at the state's position: the nearest answered point, and its
    position (x, y, z) [m]. Raises OutOfReach where there is none, or without `nearest`
    """
    try:
        return opened.point(state, device), None
    except OutOfReach as error:
        if not nearest or error.nearest is None:
            raise
        position = tuple(map(float, error.nearest))
    return opened.point(state.model_copy(update={"position": position}), device), position


def _chart(point: OperatingPoint, chart: Chart, state: State, device: Device) -> Contents:
    """Numbers of the chart and of the wall's verdict, the outlines of the stable walls and their edge."""
    numbers = {
        "stiffness_max": chart.stiffness_max,
        "damping_at_stiffness_max": chart.damping_at_stiffness_max,
        "frequencies": list(chart.frequencies_at_stiffness_max),
        "damping_max": chart.damping_max,
        "stable_area": chart.stable_area,
        "unobserved_modes": list(chart.unobserved_modes),
        "left_out": [*point.linear_omissions, *point.load_omissions],
        "caveats": list(point.load_omissions),
        "box": list(chart.box),
    }
    if state.wall is not None:
        verdict = chart.check(state.wall.stiffness, state.wall.damping)
        radius = getattr(verdict, "spectral_radius", None)
        numbers["wall"] = {
            "verdict": verdict.names[0],
            "frequency": float(verdict.frequency),
            "spectral_radius": None if radius is None else float(radius),
            "unheld_positions": int(getattr(verdict, "unheld", 0)),
        }
    period = point.controller.sampling_period
    numbers["sampling_period"] = float(period)
    return numbers, rings(chart.regions) | edge_arrays(chart.boundary)


def rings(outlines: Iterable[Floats]) -> dict[str, Any]:
    """Arrays `rings`, rows (K, B) of closed outlines one after another, and `rings_ends`, the row behind each."""
    return _joined("rings", list(outlines), 2)


def edge_arrays(arcs: Iterable[BoundaryArc]) -> dict[str, Any]:
    """Arrays `arcs`, rows (K, B, f) of an edge's arcs one after another, and `arcs_ends`, the row behind each."""
    return _joined("arcs", [np.column_stack([a.stiffness, a.damping, a.frequency]) for a in arcs], 3)


def _joined(name: str, parts: Sequence[Floats], width: int) -> dict[str, Any]:
    """Lists of rows (k, width) one after another, and under `name`_ends the row behind each."""
    ends = np.cumsum([len(part) for part in parts], dtype=np.int64)
    whole = np.concatenate(parts) if parts else np.zeros((0, width))
    return {name: whole, f"{name}_ends": ends}


def _decay(point: OperatingPoint, chart: Chart, state: State, device: Device) -> Contents:
    """Outlines of the walls within each of three spectral radii, and the fastest-decaying wall with K, B >= 0."""
    from zwidth.chart.chart import StabilityChart, stability_chart

    best = chart.fastest_decay
    if not isinstance(chart, StabilityChart) or best is None:
        raise ValueError("there are no contours of decay for this kind of device")
    radii = [1.0 - share * (1.0 - best.spectral_radius) for share in DECAY_LEVELS]
    levels = [stability_chart(chart.loop, radius, decay=False) for radius in radii]
    arrays: dict[str, Any] = {}
    for n, level in enumerate(levels):
        arrays |= {f"{n}.{key}": value for key, value in rings(level.regions).items()}
    buildable = chart.fastest_decay_in_first_quadrant
    fastest = None if buildable is None else buildable.document()
    return {"radii": radii, "fastest": fastest}, arrays


def _models(point: OperatingPoint, chart: Chart, state: State, device: Device) -> Contents:
    """The charts of the simpler models."""
    simpler = [name for name in MODELS if name != (point.model or "full")]
    return _charts_by_name({name: _with_model(device, state, name) for name in simpler})


def _with_model(device: Device, state: State, model: str) -> Callable[[], Chart]:
    """Function that computes the chart of the state with this model."""

    def chart() -> Chart:
        if device.mechanism is None:
            return device.at(model=model).chart(decay=False)
        return device.at(
            state.position, state.direction, axis=state.axis, assembly=state.assembly, model=model
        ).chart(decay=False)

    return chart


def _hands(point: OperatingPoint, chart: Chart, state: State, device: Device) -> Contents:
    """The charts in the bundled hands and in nobody's, but for the one that holds the device now."""
    now = device.operator_name

    def held(name: str) -> Callable[[], Chart]:
        """Function that computes the chart with this operator."""
        other = state.model_copy(update={"operator": name, "hand": None})

        def chart() -> Chart:
            return _with_model(device.held_by(name), other, point.model or "full" if device.mechanism else "")()

        return chart

    def ungripped() -> Chart:
        return point.without_operator.chart(decay=False)

    wanted: dict[str, Callable[[], Chart]] = {} if now is None else {"no hand": ungripped}
    for name in bundled_names(OPERATORS):
        if name != now:
            wanted[name] = held(name)
    return _charts_by_name(wanted)


def _charts_by_name(wanted: Mapping[str, Callable[[], Chart]]) -> Contents:
    """Largest stiffness and outlines of several charts by their names; one that has no answer says why.

    wanted  name -> function without arguments that computes the chart
    """
    head: dict[str, Any] = {}
    arrays: dict[str, Any] = {}
    for name, compute in wanted.items():
        try:
            chart = compute()
            outline = rings(chart.regions)
        except (ArithmeticError, ValueError, ChartError) as error:
            head[name] = {"reason": _failure_sentence(error)}
            continue
        head[name] = {"stiffness_max": chart.stiffness_max}
        arrays |= {f"{name}.{key}": value for key, value in outline.items()}
    return {"charts": head}, arrays


def _failure_sentence(error: Exception) -> str:
    """Why there is nothing to show, in a sentence."""
    return f"this is undecided: {error}" if isinstance(error, ChartError) else str(error)


def _guarantees(point: OperatingPoint, chart: Chart, state: State, device: Device) -> Contents:
    """Of each guarantee its largest stiffness and the outlines of its walls, and the premises of all."""
    head: dict[str, Any] = {}
    arrays: dict[str, Any] = {}
    found = point.guarantees()
    for one in found.guarantees:
        head[one.name] = {"stiffness_max": one.region.stiffness_max}
        if one.region.reason is not None:
            head[one.name]["reason"] = one.region.reason
        arrays |= {f"{one.name}.{key}": value for key, value in rings(one.region.rings).items()}
    caveats = [premise.reason for premise in found.premises if premise.reason]
    return {"regions": head, "caveats": caveats, "premises": [one.document() for one in found.premises]}, arrays


def _bounds(point: OperatingPoint, chart: Chart, state: State, device: Device) -> Contents:
    """The published conditions: in the head what each says, in the arrays its largest stiffness over `damping`.

    One that lacks numbers is left out.
    """
    compared = point.bounds()
    top = 1.2 * max(chart.damping_max, chart.box[3], 1e-12)  # a fifth beyond the chart, and never 0
    dampings = np.linspace(0.0, top, DAMPINGS)
    head, arrays = [], {"damping": dampings}
    for n, bound in enumerate(compared.bounds):
        if bound.lacking:
            continue
        head.append(
            {
                "name": bound.name,
                "source": bound.source,
                "claim": bound.claim,
                "kind": bound.kind,
                "violated": list(bound.violated),
                "stiffness_max": bound.stiffness_max,
                "array": f"bounds.{n}",
            }
        )
        arrays[f"{n}"] = bound.stiffness_max_at(dampings)
    return {"conditions": head}, arrays


def _mass_chain(point: OperatingPoint) -> MassChain | None:
    """The plant as a row of masses; None where it is none, or a measured response."""
    return None if point.response is not None else as_chain(point.ungripped_plant)


def _scene(point: OperatingPoint, chart: Chart, state: State, device: Device) -> Contents:
    """Where the links are, the handle and the rendered direction; the masses of a plant that is a row of them."""
    if point.mechanism is None:
        chain = _mass_chain(point)
        if chain is None:
            return {"kind": "none"}, {}
        return {"kind": "chain"}, {
            "mass": chain.mass,
            "stiffness": chain.stiffness,
            "damping": chain.damping,
        }
    posture = point.posture
    assert posture is not None
    scene = mechanism_scene(point.mechanism, posture)
    rendered = np.asarray(point.direction, dtype=float)
    head: dict[str, Any] = {
        "kind": "mechanism",
        "names": list(scene.names),
        "styles": list(scene.styles),
        "drives": list(scene.drives),
        "flat": list(scene.flat),
        "planar": stays_in_plane(scene, posture),
        "projected": float(posture.projected),
        "turns": point.turns,
    }
    if point.load is not None:
        head["load"] = {"force": point.load.force, "gravity": point.load.gravity}
    joined = _joined("strokes", list(scene.strokes), 3)
    return head, {
        **joined,
        "base": scene.base,
        "joints": scene.joints,
        "driven": scene.driven,
        "handle": scene.handle,
        "direction": rendered[3:] if point.turns else rendered[:3],
    }


def scene_rates(point: OperatingPoint) -> Contents:
    """How the scene's points move per unit of each coordinate of the plant.

    Returns  arrays of rates, (..., 3, coordinates); or none, with the reason in the head as `still`, but where no
             scene is drawn
    """
    if point.mechanism is None:
        chain = _mass_chain(point)
        if chain is None:
            return {}, {}
        # (masses, xyz, coordinates): each mass moves along x with its own; an arm's, which is the last, moves none
        rates = np.zeros((len(chain.mass), 3, point.plant.size))
        np.fill_diagonal(rates[:, 0, :], 1.0)
        return {}, {"masses_rates": rates}
    if point.load is not None:
        return {"still": "its vibration is not drawn under load"}, {}
    if point.model not in ("full", None):
        return {"still": f"its vibration is drawn for the full model alone, not for {point.model!r}"}, {}
    assert point.posture is not None
    moved = mode_strokes(point.mechanism, point.posture, point.plant.size)
    return {}, {
        "strokes_rates": moved.strokes,
        "joints_rates": moved.joints,
        "driven_rates": moved.driven,
        "handle_rates": moved.handle[None],
    }


def _wall_picture(draw: Callable[[OperatingPoint, Wall], Contents]) -> Layer:
    """Layer of another picture of the state's wall; without a wall, or of a response, it raises ValueError."""

    def face(point: OperatingPoint, chart: Chart, state: State, device: Device) -> Contents:
        if state.wall is None:
            raise ValueError("choose a wall on the chart first")
        if point.response is not None:
            raise ValueError("there is no such picture of a measured response")
        return draw(point, state.wall)

    return face


def _touch(point: OperatingPoint, chart: Chart, state: State, device: Device) -> Contents:
    """What the page needs to simulate the wall under the mouse. Raises ValueError about an axis."""
    if point.turns:
        raise ValueError(f"the mouse {ABOUT_AN_AXIS}")
    return touch_blocks(point)


def touch_blocks(point: OperatingPoint, start_position: float = 0.0, start_velocity: float = 0.0) -> Contents:
    """Blocks of `touch_step`, with which the page simulates the device held by the point's hand.

    start_position, start_velocity  [m], [m/s]
    Raises  ValueError  where the step does not cover the device
    """
    from zwidth.contact.touch_step import arm_spring, touch_numbers

    touch = touch_numbers(point.loop, start_position=start_position, start_velocity=start_velocity)
    arm = arm_spring(point.operator) if point.operator is not None else (0.0, 0.0)
    head = {
        "ports": touch.ports,
        "port_count": touch.port_count,
        "period": touch.period,
        "delay_samples": point.controller.delay,
        "states_at": touch.states_at,
        "names": list(touch.names),
        "arm": list(arm),
    }
    arrays = {
        "counts": touch.counts,
        "numbers": touch.numbers,
        "memory": touch.memory,
        "noise": touch.noise,
        "coordinates": touch.coordinates,
    }
    return head, arrays


LAYERS: dict[str, Layer] = {
    "chart": _chart,
    "scene": _scene,
    "decay": _decay,
    "models": _models,
    "hands": _hands,
    "guarantees": _guarantees,
    "bounds": _bounds,
    "impedance": _wall_picture(impedance),
    "nyquist": _wall_picture(nyquist),
    "eigenvalues": _wall_picture(eigenvalues_of),
    "touch": _touch,
}
# In this order they are computed; these need the chart.
ORDER: Final = ("chart", *(name for name in LAYERS if name != "chart"))
OF_CHART: Final = frozenset({"chart", "decay", "models", "hands", "guarantees", "bounds"})
