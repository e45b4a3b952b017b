"""The sentence above a result: which device, where, which way, sampled how."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from zwidth.show.output import shown
from zwidth.show.units import amount, given, typed, vector

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.loop.controller import Butterworth, Controller, FirstOrder
    from zwidth.show.cli.options import Question


ROUNDING: Final = 1e-9  # m, that a position may be projected by without a word


def heading(question: Question, device: Device, *, linear: bool = True) -> str:
    """Two lines: the device and its posture; the computer. And where something is left out, one that says what.

    linear  does the answer leave out what is not linear?
    """
    facts = question.facts(device)
    kind = "[response]" if device.response is not None else "[plant]"
    place = f"model {facts['model']}" if device.mechanism else f"{kind} {facts['model']}"
    if device.mechanism:
        where = f"along {vector(facts['direction'])} at {vector(facts['position_m'], 'm')}"
        if (facts["projected_m"] or 0.0) > ROUNDING:
            where += f" ({amount(facts['projected_m'], 'm')} from the position asked for)"
        place = f"{where}, assembly {facts['assembly']}, {place}"
    held = f", held by {_operator(facts['operator'])}" if facts["operator"] else ""
    lines = [f"{shown(device.name)}: {place}{held}", computer(device.controller)]
    return "\n".join(lines + ([omission(device)] if linear and device.left_out else []))


def _operator(name: str) -> str:
    """Its name; one without is the file's own."""
    from zwidth.show.cli.options import AS_GIVEN

    return "the operator of the file" if name == AS_GIVEN else shown(name)


def omission(device: Device) -> str:
    """What of a device a linear answer leaves out."""
    simulated = "" if device.response is not None else "; `zwidth simulate` has them"
    return f"linear: leaves out {', '.join(device.left_out)}{simulated}"


def computer(controller: Controller) -> str:
    """What the computer and the amplifier do, in one line."""
    from zwidth.loop.estimators import METHODS, BackwardDifference

    period = _given(controller.sampling_period, "s")
    samples = "sample" if controller.delay == 1.0 else "samples"
    delay = f"{_given(controller.delay)} {samples} of delay" if controller.delay else "no delay"
    parts = [f"sampled every {period}", delay]
    estimate = "velocity"
    if not isinstance(controller.velocity, BackwardDifference):
        name = next(name for name, method in METHODS.items() if isinstance(controller.velocity, method))
        own = ", ".join(
            key
            if value is True
            else value
            if isinstance(value, str)
            else f"{key.replace('_', ' ')} {_given(value)}"
            for key, value in vars(controller.velocity).items()
            if value is not False
        )
        estimate = f"velocity by {name}" + (f" ({own})" if own else "")
    if controller.velocity_filter is None:
        parts.append(f"{estimate} not filtered" if estimate == "velocity" else estimate)
    else:
        parts.append(f"{estimate} through {_filter(controller.velocity_filter)}")
    if controller.force_filter is not None:
        parts.append(f"force through {_filter(controller.force_filter)}")
    if controller.actuator_time_constant:
        parts.append(f"force lagging by {_given(controller.actuator_time_constant, 's')}")
    return ", ".join(parts)


def _filter(low_pass: FirstOrder | Butterworth) -> str:
    from zwidth.loop.controller import FirstOrder

    if isinstance(low_pass, FirstOrder):
        return f"a first-order filter of {_given(low_pass.time_constant, 's')}"
    kind = f"a Butterworth filter of order {low_pass.order}"
    return f"{kind} at {_given(low_pass.cutoff_Hz, 'Hz')} ({low_pass.discretisation})"


def _given(value: float, unit: str = "") -> str:
    return typed(given(value, unit))
