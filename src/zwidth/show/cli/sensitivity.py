"""`zwidth sensitivity`: what to change first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from zwidth.questions import SENSITIVITY
from zwidth.show.cli.answer import answer_table
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.options import options_of
from zwidth.show.units import amount, as_written, number, signed, typed
from zwidth.unit_text import unit_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.study.sensitivity.goal import Goal, GoalNumber
    from zwidth.study.sensitivity.result import Sensitivities, Sensitivity

# Kind of optimum (see `study.sensitivity.optimum`) -> where on the edge the stiffest wall lies.
PLACES: Final = {
    "smooth maximum": ", at a smooth maximum of the edge",
    "corner": ", at a corner of the edge",
    "edge at B = 0": ", where the edge crosses B = 0",
    "end of the curve": ", at an end of the edge's curve",
    None: "",
}
RIVAL: Final = 0.9  # share of the largest stiffness from which another peak is named
NO_WALL: Final = "no stable wall has K > 0 and B >= 0, so that there is no largest stiffness to change"


class Found(NamedTuple):
    """The sensitivities, and what each number would have to be where a goal is given."""

    sensitivities: Sensitivities
    goal: Goal | None


class SensitivityCommand(Command):
    """Find which numbers of DEVICE to change first: the change of the largest stiffness with each of them."""

    name = "sensitivity"
    takes_responses = True
    summary = "Find which numbers of DEVICE to change first."
    examples = (
        "zwidth sensitivity my-device.toml --top 5",
        "zwidth sensitivity my-device.toml --goal 10000",
        "zwidth sensitivity my-device.toml --set loop.delay_samples=1 --output bars.svg",
    )
    options = options_of(SENSITIVITY)
    keys = (
        "sensitivities",
        "groups",
        "left_out",
        "stiffness_max_N_per_m",
        "damping_at_stiffness_max_Ns_per_m",
        "held_by",
        "rival_stiffness_N_per_m",
        "one_sided",
        "goal",
    )
    may_be_undecided = True

    def compute(self, case: CommandLine) -> Found:
        """The sensitivities, and with --goal the numbers that would reach it."""
        found = case.device.sensitivities(case.point, case.progress)
        if case["goal"] is None:
            return Found(found, None)
        from zwidth.study.sensitivity.goal import numbers_for_goal

        return Found(found, numbers_for_goal(case.device, case.point, case["goal"], case.progress))

    def document(self, case: CommandLine, result: Found) -> dict[str, Any]:
        goal = None if result.goal is None else result.goal.document()["goal"]
        return result.sensitivities.document() | {"goal": goal}

    def table(self, case: CommandLine, result: Found, document: Mapping[str, Any]) -> Mapping[str, Sequence[Any]]:
        return (result.goal or result.sensitivities).table()

    def reason(self, case: CommandLine, result: Found) -> str | None:
        return None if result.sensitivities.peak is not None else NO_WALL

    def pages(self, case: CommandLine, result: Found, document: Mapping[str, Any]) -> Iterator[Any]:
        yield from self._sensitivity_pages(case, result.sensitivities)
        if result.goal is not None:
            yield from _goal_pages(result.goal, case["top"])

    def _sensitivity_pages(self, case: CommandLine, result: Sensitivities) -> Iterator[Any]:
        """Pages on the stiffest wall, and on the numbers that change it most; nothing without such a wall."""
        peak = result.peak
        if peak is None:
            return
        stiffest = f"{amount(peak.stiffness, 'N/m')} at {amount(peak.damping, 'N s/m')} of damping"
        yield f"largest stiffness {stiffest}{PLACES[result.kind]}"
        known = [number for number in result.numbers if number.logarithmic == number.logarithmic]  # not nan
        shown = [number for number in known if number.logarithmic != 0.0][: case["top"]]
        yield answer_table(
            ["number", "value", "sensitivity", "+1 % gives"], [_row(result, number) for number in shown]
        )
        yield from _remarks(result, len(known) - len(shown))

    def draw(self, case: CommandLine, result: Found) -> Figure:
        """Bars of the sensitivities, or with a goal of the changes that reach it; one for each number shown."""
        from zwidth.show.figures.sensitivity import draw_goal, draw_sensitivities
        from zwidth.show.figures.style import figure

        goal, found = result.goal, result.sensitivities
        count = len(found.numbers if goal is None else goal.reached)
        # inches: a row for each number, and room for three
        drawing, ax = figure(6.2, 0.9 + 0.27 * max(min(case["top"], count), 3))
        if goal is None:
            draw_sensitivities(ax, found, case["top"])
        else:
            draw_goal(ax, goal, case["top"])
        return drawing


def _goal_pages(goal: Goal, top: int) -> Iterator[Any]:
    """Pages on the numbers that reach the goal, of which `top` are shown, and on the nearest of the others."""
    wanted = amount(goal.goal, "N/m")
    shown = goal.reached[:top]
    if shown:
        yield f"for a largest stiffness of {wanted} one of these numbers would have to be"
        yield answer_table(
            ["number", "value", "would have to be", "factor"], [_goal_row(goal_number) for goal_number in shown]
        )
    else:
        yield f"no number alone gives a largest stiffness of {wanted}"
    unshown = len(goal.reached) - len(shown)
    if unshown > 0:
        yield f"{unshown} more; show them with --top N, or get all with --json or --output"
    near = next((goal_number for goal_number in goal.numbers if goal_number.status == "out of range"), None)
    if near is not None and near.value != near.now:
        value = f"{typed(number(near.value))} {unit_text(near.unit)}".rstrip()
        reached = amount(near.stiffness_max, "N/m")
        yield f"of the others {near.path} comes nearest, {reached} with {value}"


def _goal_row(goal_number: GoalNumber) -> tuple[str, str, str, str]:
    """Cells of a number that reaches the goal: path, value now, value that it would need, ratio of the two.

    The ratio is "" where it is nan, as of a number that is 0 now
    """
    unit = unit_text(goal_number.unit)
    now, wanted = (
        f"{typed(as_written(goal_number.now))} {unit}".rstrip(),
        f"{typed(number(goal_number.value))} {unit}".rstrip(),
    )
    return (
        goal_number.path,
        now,
        wanted,
        amount(goal_number.factor) if goal_number.factor == goal_number.factor else "",
    )


def _row(sensitivities: Sensitivities, sensitivity: Sensitivity) -> tuple[str, str, str, str]:
    """Cells of a number: path, value, logarithmic sensitivity, and the stiffness gained by 1 % more of it."""
    assert sensitivities.peak is not None
    gain = 0.01 * sensitivity.logarithmic * sensitivities.peak.stiffness
    return (
        sensitivity.path,
        f"{typed(as_written(sensitivity.value))} {unit_text(sensitivity.unit)}".rstrip(),
        typed(signed(sensitivity.logarithmic)),
        f"{'+' if gain > 0.0 else ''}{amount(gain, 'N/m')}",
    )


def _remarks(sensitivities: Sensitivities, unshown: int) -> Iterator[str]:
    """Sentences below the table: a delay that is 0 now, other walls as stiff or nearly, and what is not shown.

    unshown  how many numbers with a sensitivity, be it 0, the table leaves out
    """
    late = next((n for n in sensitivities.numbers if n.path == "loop.delay_samples" and n.value == 0.0), None)
    if late is not None and late.derivative == late.derivative:
        yield f"a delay of 0.01 samples gives {amount(0.01 * late.derivative, 'N/m')}"
    if sensitivities.tie:
        yield "two walls are stiffest at once: these numbers are of one of them, and a change may lower the other"
    elif sensitivities.peak is not None and sensitivities.second_peak > RIVAL * sensitivities.peak.stiffness:
        second = amount(sensitivities.second_peak, "N/m")
        yield f"another peak stands at {second}: it takes over once this one falls below it"
    if unshown > 0:
        yield f"{unshown} more; show them with --top N, or get all with --json or --output"
