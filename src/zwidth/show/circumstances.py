"""The circumstances of a result in words: its computer, its operator, and what a linear answer leaves out.

The members of a family of devices in words.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.output import printable
from zwidth.show.units import as_written, speaks_of_moments, spoken_unit, typed

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
    """What an answer leaves out: parts that are not linear, and what a load does to links that bend."""
    from zwidth.loop.linear_omissions import STRAIGHT

    nonlinear = [text for text in left_out if text != STRAIGHT]
    parts = [f"linear: leaves out {', '.join(nonlinear)}"] if nonlinear else []
    return "; ".join(parts + [text for text in left_out if text == STRAIGHT])


def computer_text(controller: Controller, varied: Sequence[str] = ()) -> str:
    """Computer and amplifier in one line.

    varied  paths of the device file that have no one value, which is left out
    """
    loop_keys = [path.removeprefix("loop.") for path in varied if path.startswith("loop.")]
    parts = []
    if "sampling_period_s" not in loop_keys:
        known = math.isfinite(controller.sampling_period)
        period = _given_text(controller.sampling_period, "s")
        parts.append(f"sampled every {period}" if known else "sampling period not known")
    if not any(key.startswith("delay") for key in loop_keys):
        samples = "sample" if controller.delay == 1.0 else "samples"
        parts.append(f"{_given_text(controller.delay)} {samples} of delay" if controller.delay else "no delay")
    # whatever else of the loop is varied is a part of the wall law, which is then left out as a whole
    if all(key == "sampling_period_s" or key.startswith("delay") for key in loop_keys):
        parts += wall_law_parts(controller)
    return ", ".join(parts)


def wall_law_parts(controller: Controller, *, spell_out: bool = False) -> list[str]:
    """Estimator, filters, lag and further feedback of a computer in words.

    spell_out  whether the backward difference, which is the estimator where none is chosen, is named as well
    """
    from zwidth.loop.estimators import METHODS, BackwardDifference

    parts = []
    estimate = "velocity"
    if spell_out and isinstance(controller.velocity, BackwardDifference):
        estimate = "velocity by the backward difference"
    if not isinstance(controller.velocity, BackwardDifference):
        name = next(name for name, method in METHODS.items() if isinstance(controller.velocity, method))
        # one that is on by its name, one that is off not at all, a word by itself, a number with its name
        parameters = ", ".join(
            key
            if value is True
            else value
            if isinstance(value, str)
            else f"{key.replace('_', ' ')} {_given_text(value)}"
            for key, value in vars(controller.velocity).items()
            if value is not False
        )
        estimate = f"velocity by {name}" + (f" ({parameters})" if parameters else "")
    if controller.velocity_filter is None:
        parts.append(f"{estimate} not filtered" if spell_out or estimate == "velocity" else estimate)
    else:
        parts.append(f"{estimate} through {_filter_text(controller.velocity_filter)}")
    if controller.force_filter is not None:
        parts.append(f"force through {_filter_text(controller.force_filter)}")
    if controller.actuator_time_constant:
        parts.append(f"force lagging by {_given_text(controller.actuator_time_constant, 's')}")
    return parts + [f"with {name}" for name in controller.feedback_texts(speaks_of_moments())]


def _filter_text(low_pass: FirstOrder | Butterworth) -> str:
    """A low-pass filter in words: its order, and its time constant or cutoff frequency."""
    from zwidth.loop.controller import FirstOrder

    if isinstance(low_pass, FirstOrder):
        return f"a first-order filter of {_given_text(low_pass.time_constant, 's')}"
    kind = f"a Butterworth filter of order {low_pass.order}"
    return f"{kind} at {_given_text(low_pass.cutoff_Hz, 'Hz')} ({low_pass.discretisation})"


def _given_text(value: float, unit: str = "") -> str:
    """A number of the device file as it was written there, with its unit, in signs that can be typed."""
    return typed(as_written(value, unit))


def value_text(value: Any) -> str:
    """A value of a family's member, in four digits where it is a number.

    >>> value_text(30004.0), value_text(0.74483), value_text("thesis-arm")
    ('30000', '0.7448', 'thesis-arm')
    """
    if isinstance(value, str):
        return value
    return f"{float(f'{value:.3e}'):.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"


def member_text(index: int, values: Mapping[str, Any]) -> str:
    """A member by its number and its values.

    >>> member_text(3, {"plant.mass_kg": 0.1})
    '3 (plant.mass_kg = 0.1)'
    """
    pairs = ", ".join(f"{path} = {printable(value_text(value))}" for path, value in values.items())
    return f"{index} ({pairs})"
