"""The sentence above a result: which device, where, which way, sampled how."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from zwidth.show.circumstances import computer_text, load_text, omission_text, operator_text
from zwidth.show.moment_units import speaking_of_moments
from zwidth.show.output import printable
from zwidth.show.units import amount, typed, vector, way

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.show.cli.options import Question


ROUNDING: Final = 1e-9  # m, that a position may be projected by without a word


def heading(question: Question, device: Device, *, linear: bool = True) -> str:
    """Two lines: the device and its posture; the computer. And where something is left out, one that says what.

    linear  does the answer leave out the nonlinear parts?
    """
    facts = question.linear_circumstances(device)
    kind = "[response]" if device.response is not None else "[plant]"
    place = f"model {facts['model']}" if device.mechanism else f"{kind} {facts['model']}"
    if device.mechanism:
        where = f"{typed(way(question.screw(device)))} at {vector(facts['position_m'], 'm')}"
        if (facts["projected_m"] or 0.0) > ROUNDING:
            with speaking_of_moments(False):
                where += f" ({amount(facts['projected_m'], 'm')} from the requested position)"
        place = f"{where}, assembly {facts['assembly']}, {place}"
    held = f", held by {operator_text(facts['operator'])}" if facts["operator"] else ""
    held += "" if device.load is None else f", under {load_text(device.load)}"
    lines = [f"{printable(device.name)}: {place}{held}", computer_text(device.controller)]
    return "\n".join([*lines, *omissions(device, question.model, linear=linear)])


def omissions(device: Device, model: str | None = None, *, linear: bool = True) -> list[str]:
    """Lines on what an answer leaves out: parts that are not linear, and what a load does to links that bend."""
    from zwidth.loop.linear_omissions import load_omissions

    lines = []
    if linear and device.linear_omissions:
        simulated = "" if device.response is not None else "; `zwidth simulate` has them"
        lines.append(omission_text(device.linear_omissions) + simulated)
    return lines + list(load_omissions(device.mechanism, device.load, model))
