"""`zwidth load`: how the chart moves with the hand's load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from zwidth.questions import LOAD
from zwidth.show.cli.answer import answer_table, heading
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import options_of
from zwidth.show.units import amount, as_written, seconds, signed, spoken_unit, typed, vector

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.device.device import Device
    from zwidth.study.loaded_charts import LoadPath, PushedChart


class LoadCommand(Command):
    """Find how the walls that DEVICE renders stably change with the force by which the hand leans on them.

    Charts at pushes of the hand to both sides along the rendered direction, about one posture. All else of the
    [load] is kept: gravity, and how the hand's force goes with the handle.
    """

    name = "load"
    summary = "Find how the chart moves with the hand's load."
    examples = (
        "zwidth load my-device.toml --push 10",
        "zwidth load my-device.toml --gravity 0,0,-9.81 --count 5 --output load.svg",
    )
    options = options_of(LOAD)
    keys = (
        "push_N",
        "status",
        "stiffness_max_N_per_m",
        "damping_at_stiffness_max_Ns_per_m",
        "frequency_at_stiffness_max_Hz",
        "damping_max_Ns_per_m",
        "stable_area_N2s_per_m2",
        "wall_force_N",
        "sideways_force_N",
        "one_sided_amplitude_m",
        "growth_rate_1_per_s",
        "time_to_double_s",
        "sideways_frequency_Hz",
        "stiffness_max_hand_neglected_N_per_m",
        "stiffness_max_fixed_surface_N_per_m",
        "fixed_surface_status",
    )
    takes_responses = True  # which it refuses like every device without a mechanism

    def check(self, case: CommandLine) -> None:
        """Raise BadInput for --load, which the pushes stand in for."""
        if case.question.load is not None:
            raise BadInput(
                "--load: does not apply where the push is what changes; use --push for how large it gets"
            )

    def compute(self, case: CommandLine) -> LoadPath:
        """The charts under the pushes; a device without a mechanism becomes BadInput."""
        if case.device.mechanism is None:
            raise BadInput(
                f"{case.question.name}: has no [mechanism], whose forces turn as it moves; use zwidth chart"
            )
        # without the load, under which there may be no equilibrium
        point = case.question.point(_device_without_load(case))
        return case.device.load_path(case["push"], case["count"], point=point, progress=case.progress)

    def reason(self, case: CommandLine, result: LoadPath) -> str | None:
        return result.reason

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        """What every answer states, of the device without the push; and what charts under a push leave out."""
        facts = case.question.linear_circumstances(_device_without_push(case))
        return facts | {"left_out": [*case.device.linear_omissions, *_omissions_under_push(case)]}

    def heading(self, case: CommandLine) -> str:
        """The first lines, of the device without the push, and what charts under a push leave out besides."""
        shown, of_push = heading(case.question, _device_without_push(case)), _omissions_under_push(case)
        return "\n".join([shown, *(text for text in of_push if text not in shown)])

    def caption_facts(self, case: CommandLine, document: Mapping[str, Any]) -> dict[str, Any]:
        return super().caption_facts(case, document) | {"varied": ["the hand's push"]}

    def pages(self, case: CommandLine, result: LoadPath, document: Mapping[str, Any]) -> Iterator[Any]:
        """Two tables with a row for each push, of charts and of forces, and sentences on both."""
        from zwidth.show.load_text import path_sentences

        free = result.unpushed.stiffness_max
        charted = ["largest stiffness", "change", "at damping", "oscillates at"]
        yield answer_table(
            ["push", *charted, "hand neglected", "fixed surface"],
            [_chart_row(step, free) for step in result.steps],
        )
        yield answer_table(
            ["push", "wall", "hand across", "sideways growth", "doubles in", "keeps contact below"],
            [_balance_row(step) for step in result.steps],
        )
        yield from map(typed, path_sentences(result))

    def draw(self, case: CommandLine, result: LoadPath) -> Figure:
        from zwidth.show.figures.load_path import load_path_figure

        return load_path_figure(result)


def _device_without_load(case: CommandLine) -> Device:
    """The device without any load."""
    from zwidth.device.load import device_without_load

    return device_without_load(case.device)


def _omissions_under_push(case: CommandLine) -> tuple[str, ...]:
    """What charts under a push leave out: what a load does to links that bend; () where none does."""
    from zwidth.loop.linear_omissions import load_omissions
    from zwidth.model.load import Load

    return load_omissions(case.device.mechanism, Load(push=case["push"]), case.question.model)


def _device_without_push(case: CommandLine) -> Device:
    """The device under its load but for the hand's push; without a load where that was all of it."""
    from zwidth.study.loaded_charts import without_push

    kept = without_push(case.device.load)
    return _device_without_load(case) if kept is None else case.device.under(kept)


def _chart_row(step: PushedChart, free: float) -> list[str]:
    """Cells on the chart under one push: without a stable wall "none" alone; no change in the row without a push.

    free  largest stiffness without a push [N/m], from which the change counts
    """
    chart = step.chart
    if chart is None or not chart.frequencies_at_stiffness_max:
        return [typed(as_written(step.push, "N")), "none", *[""] * 5]
    change = 100.0 * (chart.stiffness_max - free) / free
    return [
        typed(as_written(step.push, "N")),
        amount(chart.stiffness_max, "N/m"),
        typed(f"{signed(change)} %") if step.push and change == change else "",
        amount(chart.damping_at_stiffness_max, "N s/m"),
        amount(min(chart.frequencies_at_stiffness_max), "Hz"),
        amount(step.hand_neglected, "N/m"),
        amount(step.fixed_surface, "N/m"),
    ]


def _balance_row(step: PushedChart) -> list[str]:
    """Cells on the forces in balance under one push, and on the motion along the surface.

    All but the push are "" without an equilibrium; the last one, without a push.
    """
    if step.wall_force != step.wall_force:  # nan: without an equilibrium
        return [typed(as_written(step.push, "N")), *[""] * 5]
    motion = step.sideways
    return [
        typed(as_written(step.push, "N")),
        amount(step.wall_force, "N"),
        vector(step.sideways_force, spoken_unit("N")),
        "none" if motion is None else amount(motion.growth_rate, "1/s"),
        "" if motion is None or motion.growth_rate <= 0.0 else typed(seconds(motion.time_to_double)),
        amount(step.one_sided_amplitude, "m") if step.push else "",
    ]
