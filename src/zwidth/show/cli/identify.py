"""`zwidth identify`: numbers of a device from measurements of it, one subcommand for each kind."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import click

from zwidth.show.cli.answer import table
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Callback, Question, example, refuse_empty, with_settings_option
from zwidth.show.output import destination, printable, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.identify.identification import Estimate, Identification

joint_option = click.option(
    "--joint",
    metavar="NAME",
    callback=refuse_empty,
    help="Drive, or link whose joint it drives, that was measured. Default: the only one, or a column joint.",
)


class IdentifyCommand(Command):
    """What all kinds have in common: records are read, and the numbers can be written into the device file."""

    outputs = (".png", ".svg", ".pdf", ".csv", ".json")
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv: measured and fitted, .json)."
    keys = ("check", "parameters", "validation")
    takes_responses = True
    linear = False
    kind_options: ClassVar[tuple[str, ...]] = ()

    def about(self, command: Callback) -> Callback:
        @wraps(command)
        def with_device(device: str, settings: Any, **more: Any) -> int:
            return command(Question(device, settings), **more)

        return _files(_device(with_settings_option(with_device)))

    def for_click(self) -> click.Command:
        made = super().for_click()
        made.params.append(_write)
        return made

    def check(self, case: CommandLine) -> None:
        if not case["write"]:
            return
        if not Path(case.question.name).is_file():
            raise BadInput(
                f"--write: {printable(case.question.name)} is bundled, or no file; write a device file of your "
                "own, and "
                "name that"
            )
        destination(case.question.name, (".toml",))

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        return {"name": case.device.name, "device": case.question.name, "files": list(case["files"])}

    def heading(self, case: CommandLine) -> str:
        return f"{printable(case.device.name)}: {self.name} from {', '.join(map(printable, case['files']))}"

    def is_about_moments(self, case: CommandLine) -> bool:
        return False

    def compute(self, case: CommandLine) -> Identification:
        options = {name: case[name] for name in self.kind_options}
        found: Identification = case.device.identify(
            self.name, list(case["files"]), progress=case.progress, **options
        )
        return found

    def reason(self, case: CommandLine, result: Identification) -> str | None:
        return result.reason

    def pages(self, case: CommandLine, result: Identification, document: Mapping[str, Any]) -> Iterator[Any]:
        yield table(
            ["check", "", "seen"],
            [(check.what, "ok" if check.passed else "note" if check.warning else "no", check.reason)
             for check in result.checks],
        )  # fmt: skip
        if result.reason is not None:
            return
        yield table(["number", "value", "95 %", "unit", "in the file"], [_row(one) for one in result.estimates])
        yield f"validation: {100.0 * result.validation:.6g} % of the variance explained, {result.validated_on}"
        yield from result.remarks
        if result.settings and not case["write"]:
            yield f"to write them into {printable(case.question.name)}, comments kept: add --write"

    def write(
        self, case: CommandLine, result: Identification, document: dict[str, Any], reason: str | None
    ) -> str | None:
        if reason is None or case.writes((".json",)):
            return super().write(case, result, document, reason)
        del document["file"]  # where nothing was fitted there is nothing to draw
        return reason

    def write_others(self, case: CommandLine, result: Identification) -> dict[str, Path]:
        """The device file with the numbers, where that is wanted and there are some."""
        if not case["write"] or not result.settings:
            return {}
        from zwidth.device.edit_file import edited_text
        from zwidth.identify.identification import interval, written_value

        case.device.with_(result.settings)  # what they make must be a device
        sources = {
            one.path: f"measured ({', '.join(case['files'])}): {interval(one)} {one.unit} with 95 %"
            for one in result.estimates
            if one.path
        }
        path = destination(case.question.name, (".toml",))
        values = {one.path: written_value(one) for one in result.estimates if one.path}
        write_text(path, edited_text(path, values, sources))
        return {"written": path}

    def draw(self, case: CommandLine, result: Identification) -> Figure:
        from zwidth.show.figures.identify import identification_figure

        return identification_figure(result, *self.size)

    def caption_facts(self, case: CommandLine, document: Mapping[str, Any]) -> dict[str, Any]:
        return {"name": case.device.name}


def _files(command: Callback) -> Callback:
    """The records, of which there is one at least."""
    return click.argument("files", metavar="FILE...", nargs=-1, required=True)(command)


def _device(command: Callback) -> Callback:
    return click.option(
        "--device", metavar="DEVICE", required=True, callback=refuse_empty, help="The device that was measured."
    )(command)


_write = click.Option(
    ["--write"],
    is_flag=True,
    help="Write the numbers into DEVICE, with their intervals under [sources]; all else in it stays as it is.",
)


def _row(estimate: Estimate) -> tuple[str, ...]:
    from zwidth.identify.identification import interval, value_text

    path = estimate.path.removeprefix("mechanism.")
    return estimate.name, value_text(estimate), interval(estimate), estimate.unit or "1", path


class StiffnessCommand(IdentifyCommand):
    """Find a drive's stiffness from torque over angle, loaded and unloaded both ways.

    FILE has columns torque_Nm, angle_rad and perhaps joint, in the order in which they were measured; each file is
    a run. The link is blocked and the motor pulls, slowly; or the other way round, with --side link.
    """

    name = "stiffness"
    summary = "Stiffness, backlash and friction of a drive, from torque over angle."
    examples = ("zwidth identify stiffness strokes.csv --device my-device.toml --joint upper --write",)
    options = (
        joint_option,
        click.option(
            "--side",
            type=click.Choice(["motor", "link"]),
            default="motor",
            show_default=True,
            help="Where torque and angle were measured: at the motor's shaft, or at the link's joint.",
        ),
    )
    kind_options = ("joint", "side")


KINDS: tuple[Callable[[], IdentifyCommand], ...] = (StiffnessCommand,)


@click.group(
    name="identify",
    short_help="Find numbers of a device from measurements of it.",
    epilog=example(
        "zwidth identify stiffness strokes.csv --device my-device.toml --joint upper",
        "zwidth identify stiffness strokes.csv --device my-device.toml --joint upper --write",
    ),
    invoke_without_command=True,
    commands={command.name: command for command in (kind().for_click() for kind in KINDS) if command.name},
)
@click.pass_context
def identify(context: click.Context) -> None:
    """Find numbers of a device from measurements of it, each with the interval that holds it with 95 %.

    In three steps: the data are checked, a part of them is fitted, and the rest is predicted. Nothing is fitted
    that a check refuses.
    """
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
