"""The circumstances of a result in words: its computer, its operator, and what a linear answer leaves out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from zwidth.show.moment_units import spoken_unit
from zwidth.show.output import printable
from zwidth.show.units import as_written, typed

if TYPE_CHECKING:
    from zwidth.loop.controller import Butterworth, Controller, FirstOrder
    from zwidth.model.load import Load

AS_GIVEN: Final = "as given"  # a plant that no model reduces; an operator that the device file describes


def operator_text(name: str) -> str:
    """An operator's name; one without a name is the file's own."""
    return "the operator of the file" if name == AS_GIVEN else printable(name)


def load_text(load: Load) -> str:
    """A load in words, in the units of what is rendered."""
    return load.text(spoken_unit("N"))


def omission_text(left_out: Sequence[str]) -> str:
    """Parts of a device that a linear answer leaves out."""
    return f"linear: leaves out {', '.join(left_out)}"


def computer_text(controller: Controller) -> str:
    """Computer and amplifier in one line."""
    from zwidth.loop.estimators import METHODS, BackwardDifference

    period = _given(controller.sampling_period, "s")
    samples = "sample" if controller.delay == 1.0 else "samples"
    delay = f"{_given(controller.delay)} {samples} of delay" if controller.delay else "no delay"
    known = math.isfinite(controller.sampling_period)
    parts = [f"sampled every {period}" if known else "sampling period not known", delay]
    estimate = "velocity"
    if not isinstance(controller.velocity, BackwardDifference):
        name = next(name for name, method in METHODS.items() if isinstance(controller.velocity, method))
        parameters = ", ".join(
            key
            if value is True
            else value
            if isinstance(value, str)
            else f"{key.replace('_', ' ')} {_given(value)}"
            for key, value in vars(controller.velocity).items()
            if value is not False
        )
        estimate = f"velocity by {name}" + (f" ({parameters})" if parameters else "")
    if controller.velocity_filter is None:
        parts.append(f"{estimate} not filtered" if estimate == "velocity" else estimate)
    else:
        parts.append(f"{estimate} through {_filter(controller.velocity_filter)}")
    if controller.force_filter is not None:
        parts.append(f"force through {_filter(controller.force_filter)}")
    if controller.actuator_time_constant:
        parts.append(f"force lagging by {_given(controller.actuator_time_constant, 's')}")
    parts += [f"with {name}" for name in controller.feedback_names]
    return ", ".join(parts)


def _filter(low_pass: FirstOrder | Butterworth) -> str:
    from zwidth.loop.controller import FirstOrder

    if isinstance(low_pass, FirstOrder):
        return f"a first-order filter of {_given(low_pass.time_constant, 's')}"
    kind = f"a Butterworth filter of order {low_pass.order}"
    return f"{kind} at {_given(low_pass.cutoff_Hz, 'Hz')} ({low_pass.discretisation})"


def _given(value: float, unit: str = "") -> str:
    return typed(as_written(value, unit))
