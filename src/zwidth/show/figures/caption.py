"""The caption below a figure: a saved figure alone tells which device it shows, where, and how it is sampled.

Every figure of a command, a report, `result.plot()` and a notebook passes `write_caption`, which knows only the
facts that a result states under the keys of `--json`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font

from zwidth.device.load import load_of_table, table_of_load
from zwidth.loop.wall_matrices import WallMatrices
from zwidth.show.circumstances import AS_GIVEN, computer_text, load_text, omission_text, operator_text
from zwidth.show.figures.style import FAMILY, context, wrapped
from zwidth.show.output import printable
from zwidth.show.units import as_written, point, way

if TYPE_CHECKING:
    from zwidth.loop.controller import Controller
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.study.designs.study import Study

SIZE: Final = 6.5  # points
FONT: Final = FontProperties(family=FAMILY, size=SIZE)
COLOUR: Final = "#404040"
LEADING: Final = 1.25  # of a line, in heights of its letters
MARGIN: Final = 0.08  # inches to the left and right of the caption, and above it
PLANES: Final = ("xy", "xz", "yz")
WALL_UNITS: Final = {"stiffness": "N_per_m", "damping": "Ns_per_m"}
ROUND_A_PLANE: Final = ("ByDirection",)  # results that have no single direction
# Results whose answer includes the nonlinear parts.
NONLINEAR: Final = ("ContactSimulation", "TimeResponse", "MechanismMotion", "LimitCyclePrediction", "Experiment")


def write_caption(drawing: Figure, paragraphs: Sequence[str]) -> None:
    """Write paragraphs below a figure in small letters, wrapped to its width; the figure grows by their height.

    Sizes of letters are those of the font that comes with matplotlib, so that lines break alike everywhere.
    """
    width, height = drawing.get_size_inches()
    # 72 points to the inch
    room = 72.0 * (width - 2.0 * MARGIN)
    lines = [line for paragraph in paragraphs for line in wrapped(_with_known_letters(paragraph), room, SIZE)]
    if not lines:
        return
    added = len(lines) * LEADING * SIZE / 72.0 + MARGIN
    with context():
        drawing.set_size_inches(width, height + added)
        drawing.supxlabel(
            "\n".join(lines),
            x=MARGIN / width,
            ha="left",
            linespacing=LEADING,
            color=COLOUR,
            fontproperties=FONT,
            parse_math=False,
        )


def caption_of_facts(facts: Mapping[str, Any], controller: Controller | None) -> list[str]:
    """The paragraphs of a caption: the device and its posture; the computer, and what a linear answer leaves out.

    facts  under the keys with which a result states its circumstances; a key that is missing or None is left out
    """
    doubt = f"In doubt: {printable(str(facts['doubt']))}" if facts.get("doubt") else ""
    parts = [part for part in _stated_parts(facts) if part]
    name = printable(str(facts.get("name") or ""))
    about = f"{name}: {', '.join(parts)}" if name and parts else name or ", ".join(parts)
    varied = facts.get("varied") or ()
    remarks = [] if controller is None else [computer_text(controller, varied)]
    if varied:
        remarks.append(f"varied: {', '.join(map(printable, varied))}")
    if error_band := facts.get("error_band"):
        remarks.append(f"band: {error_band}")
    if left_out := facts.get("left_out"):
        remarks.append(omission_text(left_out))
    return [paragraph for paragraph in (doubt, about, "; ".join(filter(None, remarks))) if paragraph]


def caption_of_result(result: Any) -> list[str]:
    """The paragraphs of a result's caption: of its operating point, its loop or its study; [] of a bare number."""
    operating_point = result.operating_point or getattr(result, "point", None)
    linear = type(result).__name__ not in NONLINEAR
    if operating_point is not None:
        facts = facts_of_point(operating_point, linear=linear) | facts_of_wall(result) | facts_of_doubt(result)
        # those of a polar chart go round a plane, which it shows itself
        facts |= {"directions": None} if type(result).__name__ in ROUND_A_PLANE else {}
        facts |= facts_of_members(getattr(result, "members", ()))
        return caption_of_facts(facts, operating_point.controller)
    if (study := getattr(result, "study", None)) is not None:
        return caption_of_facts(facts_of_study(study), study.device.controller)
    if (circumstances := getattr(result, "circumstances", None)) is not None:
        return caption_of_facts(circumstances, None)
    doubt = facts_of_doubt(result)
    loop = getattr(result, "loop", None) or getattr(getattr(result, "chart", None), "loop", None)
    if loop is None:
        return caption_of_facts(doubt, None)
    nonlinear = getattr(loop, "nonlinear", None)
    left_out = nonlinear.kinds if linear and nonlinear is not None else ()
    return caption_of_facts({"left_out": left_out} | facts_of_wall(result) | doubt, loop.controller)


def facts_of_point(operating_point: OperatingPoint, *, linear: bool = True) -> dict[str, Any]:
    """Facts of an operating point for a caption; without position and direction where there are many.

    The operator is AS_GIVEN where it has no name; a "motor-mass" model states none, for its handle is held fixed.
    """
    omitted = (operating_point.linear_omissions if linear else ()) + operating_point.load_omissions
    facts: dict[str, Any] = {"name": operating_point.name, "model": operating_point.model, "left_out": omitted}
    if operating_point.model != "motor-mass" and (
        operating_point.operator is not None or operating_point.arm is not None
    ):
        facts["operator"] = operating_point.operator_name or AS_GIVEN
    if operating_point.load is not None:
        facts["load"] = table_of_load(operating_point.load)
    if operating_point.posture is not None and operating_point.directions is not None:
        facts["assembly"] = operating_point.posture.assembly
        if not operating_point.shape:
            facts |= {"position_m": operating_point.posture.position, "directions": operating_point.directions}
            if (law := operating_point.wall_matrices) is not None:
                facts |= {"relative_stiffness": law.stiffness, "relative_damping": law.damping}
    return facts


def facts_of_members(members: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Facts for a caption: `varied`, the paths in which the members of a family differ.

    members  path -> value of each. Where the operator is one of the paths, `operator` is None: no one holds all
    """
    varied = list(dict.fromkeys(path for member in members for path in member))
    return {"varied": varied} | ({"operator": None} if "operator" in varied else {})


def facts_of_study(study: Study) -> dict[str, Any]:
    """Facts of a study for a caption: what all its designs share, and as `varied` the keys in which they differ.

    Of a study with a task, whose designs are used at many positions, no position is a fact.
    """
    device, keys = study.device, [axis.key for axis in study.sampling.axes]
    facts: dict[str, Any] = {"name": device.name, "model": study.model, "operator": device.operator_name}
    if device.mechanism is not None:
        facts["assembly"] = study.assembly or device.reference_assembly
        facts["direction"] = device.direction(study.direction)
        facts["position_m"] = None if isinstance(study.at, Mapping) else device.position(study.at)
    if device.load is not None and not any(key.startswith("load.") for key in keys):
        facts["load"] = table_of_load(device.load)
    if (task := study.task) is not None:
        facts["position_m"] = None
        facts["direction"] = facts.get("direction") if task.directions is None else None
        facts["operator"] = ", ".join(task.operators) or facts["operator"]
    varied = {"position_m" if key == "at" else key for key in keys}
    fixed = {name: value for name, value in facts.items() if name not in varied}
    return fixed | {"varied": keys, "left_out": device.omissions(study.model)}


def wall_of_document(document: Mapping[str, Any]) -> dict[str, Any]:
    """Facts for a caption: `environment` and its `parameters` of a result, from its document; {} of none."""
    if document.get("environment") is not None:
        return {key: document.get(key) for key in ("environment", "parameters")}
    values = {name: document.get(f"wall_{name}_{unit}") for name, unit in WALL_UNITS.items()}
    return {} if values["stiffness"] is None else {"environment": "wall", "parameters": values}


def doubt_of_document(document: Mapping[str, Any]) -> dict[str, Any]:
    """What is in doubt about a result, and what its error band covers, from its document; {} of neither."""
    reason = document.get("reason")
    band = {"error_band": document["band"]["meaning"]} if document.get("band") else {}
    return band | ({"doubt": reason} if document.get("decided") is False and reason else {})


def facts_of_doubt(result: Any) -> dict[str, Any]:
    """What is in doubt about a chart, or a study of charts, and what its error band covers; {} of neither."""
    doubt, band = getattr(result, "doubt", ""), getattr(result, "band", None)
    covered = {} if band is None else {"error_band": band.meaning}
    return covered | ({"doubt": doubt} if isinstance(doubt, str) and doubt else {})


def facts_of_wall(result: Any) -> dict[str, Any]:
    """Facts for a caption: `environment` and its `parameters` that a result is about; {} where there is none."""
    environment = getattr(result, "environment", None)
    if environment is not None and hasattr(result, "parameters"):
        return {"environment": environment.name, "parameters": result.parameters}
    values = {name: getattr(result, f"wall_{name}", None) for name in WALL_UNITS}
    return {} if values["stiffness"] is None else {"environment": "wall", "parameters": values}


def _stated_parts(facts: Mapping[str, Any]) -> Iterator[str]:
    """Posture, direction, model, operator and wall, in that order, each as far as it is stated."""
    if facts.get("position_m") is not None:
        yield f"handle at {point(facts['position_m'])}"
    # a polar chart names the plane of its directions, which passes through the handle
    if "plane_through_m" in facts and (facts["plane"] not in PLANES or np.any(facts["plane_through_m"])):
        yield f"plane {facts['plane']} through {point(facts['plane_through_m'])}"
    if facts.get("assembly"):
        yield f"assembly {printable(facts['assembly'])}"
    yield _direction_text(facts)
    if facts.get("model") not in (None, "full", AS_GIVEN):
        yield f"{facts['model']} model"
    if facts.get("operator") not in (None, "none"):
        yield f"held by {operator_text(facts['operator'])}"
    if facts.get("load"):
        yield f"under {load_text(load_of_table(dict(facts['load'])))}"
    yield _environment_text(facts)


def _direction_text(facts: Mapping[str, Any]) -> str:
    """The rendered direction in words, or several with their law; "" where none is stated."""
    direction = facts.get("direction")
    if isinstance(direction, str):
        return f"along the {direction} direction of each cell"
    directions = facts.get("directions")
    if directions is None and direction is not None:
        directions = [direction]
    if directions is None:
        return ""
    law = ", under one wall law" if len(directions) > 1 else ""
    if facts.get("relative_stiffness") is not None:
        law = f", {WallMatrices(facts['relative_stiffness'], facts['relative_damping'])}"
    texts = [way(one) for one in directions]
    if all(one.startswith("along ") for one in texts[1:]):
        texts[1:] = [one.removeprefix("along ") for one in texts[1:]]
    return f"{' and '.join(texts)}{law}"


def _environment_text(facts: Mapping[str, Any]) -> str:
    """The wall or environment with its parameters in words; "" where none is stated."""
    environment, values = facts.get("environment"), facts.get("parameters") or {}
    if environment in (None, "none"):
        return ""
    words = printable(str(environment))
    if {"stiffness", "damping"} <= set(values):
        words += f" of {as_written(values['stiffness'], 'N/m')} and {as_written(values['damping'], 'N s/m')}"
        values = {name: values[name] for name in values if name not in ("stiffness", "damping", "no_pull")}
    given = ", ".join(f"{name} {as_written(float(value))}" for name, value in values.items())
    return f"{words} ({given})" if given else words


def _with_known_letters(text: str) -> str:
    """The text with a question mark in place of each letter that the font lacks."""
    font = get_font(findfont(FONT))
    return "".join(letter if font.get_char_index(ord(letter)) else "?" for letter in text)
