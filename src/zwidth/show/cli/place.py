"""The sentence above a result: which device, where, which way, sampled how."""

from __future__ import annotations

from typing import TYPE_CHECKING

from zwidth.show.output import shown
from zwidth.show.units import vector

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.loop.controller import Controller
    from zwidth.show.cli.options import Question


def heading(question: Question, device: Device) -> str:
    """One line, or two: the device and its posture; the computer."""
    facts = question.facts(device)
    kind = "[response]" if device.response is not None else "[plant]"
    place = f"model {facts['model']}" if device.mechanism else f"{kind} {facts['model']}"
    if device.mechanism:
        where = f"along {vector(facts['direction'])} at {vector(facts['position_m'], 'm')}"
        place = f"{where}, assembly {facts['assembly']}, {place}"
    return f"{shown(device.name)}: {place}\n{_computer(device.controller)}"


def _computer(controller: Controller) -> str:
    from zwidth.loop.controller import FirstOrder

    period = f"{1e3 * controller.sampling_period:.6g} ms"
    samples = "sample" if controller.delay == 1.0 else "samples"
    delay = f"{controller.delay:.6g} {samples} of delay" if controller.delay else "no delay"
    low_pass = controller.velocity_filter
    if low_pass is None:
        velocity = "velocity not filtered"
    elif isinstance(low_pass, FirstOrder):
        velocity = f"velocity through a first-order filter of {low_pass.time_constant:.6g} s"
    else:
        velocity = (
            f"velocity through a Butterworth filter of order {low_pass.order} at "
            f"{low_pass.cutoff_Hz:.6g} Hz ({low_pass.discretisation})"
        )
    return f"sampled every {period}, {delay}, {velocity}"
