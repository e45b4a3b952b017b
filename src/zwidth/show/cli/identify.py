"""`zwidth identify`: numbers of a device from measurements of it, one subcommand for each kind."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

import click

from zwidth.questions import IDENTIFY
from zwidth.show.cli.answer import answer_table, heading
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import (
    Callback,
    Question,
    Text,
    about_a_device,
    example,
    options_of,
    with_settings_option,
)
from zwidth.show.output import destination, printable, write_text
from zwidth.show.units import typed, uncertain
from zwidth.unit_text import unit_text

if TYPE_CHECKING:
    from zwidth.identify.identification import Estimate, Identification


device_option = click.option(
    "--device", metavar="DEVICE", required=True, type=Text(), help="The device that was measured."
)


MOST_EXPLAINED: Final = 0.999  # share of the variance beyond which more digits say nothing


class IdentifyCommand(Command):
    """What all kinds have in common: records are read, and the numbers can be written into the device file.

    What a kind names as its options goes to its function under the same names.

    takes_point  whether the numbers are of the device at an operating point, and the command has its options
    """

    output_help = "Write a figure (.png .svg .pdf) or the data (.csv: measured and fitted, .json)."
    keys = ("check", "parameters", "validation")
    takes_responses = True
    linear = False
    takes_point: ClassVar[bool] = False

    def about(self, command: Callback) -> Callback:
        """The records and the device; also posture and direction where `takes_point`."""
        if self.takes_point:
            return _with_files(about_a_device(command, device=device_option))

        @wraps(command)
        def with_device(device: str, settings: Any, **more: Any) -> int:
            """Call the command with a `Question` about the device."""
            return command(Question(device, settings), **more)

        return _with_files(device_option(with_settings_option(with_device)))

    def for_click(self) -> click.Command:
        """The command as click knows it, with --write after the options of all commands."""
        command = super().for_click()
        command.params.append(_write)
        return command

    def check(self, case: CommandLine) -> None:
        """Raise BadInput where --write is given and DEVICE is no file that can be written."""
        if not case["write"]:
            return
        if not Path(case.question.name).is_file():
            raise BadInput(
                f"--write: {printable(case.question.name)} is bundled, or no file; write a device file of your "
                "own, and name that"
            )
        destination(case.question.name, (".toml",))

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        """The device, or its operating point where `takes_point`, and the files of the records."""
        files = {"files": list(case["files"])}
        if self.takes_point:
            return case.question.circumstances(case.device) | files
        return {"name": case.device.name, "device": case.question.name} | files

    def heading(self, case: CommandLine) -> str:
        """The device, or its operating point where `takes_point`; then the kind, and the files of the records."""
        about = f"{self.name} from {', '.join(map(printable, case['files']))}"
        if self.takes_point:
            return f"{heading(case.question, case.device, linear=False)}\n{about}"
        return f"{printable(case.device.name)}: {about}"

    def is_about_moments(self, case: CommandLine) -> bool:
        return False

    def compute(self, case: CommandLine) -> Identification:
        """The identification of this kind; its options are those that IDENTIFY names."""
        options = {name: case[name] for name in IDENTIFY[self.name]}
        if self.takes_point:
            options["point"] = case.point
        found: Identification = case.device.identify(
            self.name, list(case["files"]), progress=case.progress, **options
        )
        return found

    def document(self, case: CommandLine, result: Identification) -> dict[str, Any]:
        """The identification's own document, with what a load leaves out beside what the fit leaves out."""
        of_load = self.circumstances(case).get("left_out", [])
        return result.document() | {"left_out": [*of_load, *result.left_out]}

    def reason(self, case: CommandLine, result: Identification) -> str | None:
        return result.reason

    def pages(self, case: CommandLine, result: Identification, document: Mapping[str, Any]) -> Iterator[Any]:
        """The checks; the numbers with their intervals, how well they predict, and how to write them."""
        yield answer_table(
            ["check", "", "seen"],
            [(check.what, "ok" if check.passed else "note" if check.warning else "no", check.reason)
             for check in result.checks],
        )  # fmt: skip
        if result.reason is not None:
            return
        yield answer_table(
            ["number", "value", "95 %", "unit", "in the file"], [_row(one) for one in result.listed]
        )
        share = result.validation
        # nothing is said of a share that is nan
        explained = f"{_explained_text(share)} of the variance explained, " if share == share else ""
        yield f"validation: {explained}{result.validated_on}"
        yield from result.remarks
        yield from result.left_out
        if result.not_written:
            yield result.not_written
        elif result.settings and not case["write"] and Path(case.question.name).is_file():
            yield f"to write them into {printable(case.question.name)}, comments kept: add --write"

    def write(
        self, case: CommandLine, result: Identification, document: dict[str, Any], reason: str | None
    ) -> str | None:
        """Write the file as every command does; without any number .json alone, for there is nothing to draw."""
        if reason is None or case.writes((".json",)):
            return super().write(case, result, document, reason)
        del document["file"]  # where nothing was fitted there is nothing to draw
        return reason

    def write_others(self, case: CommandLine, result: Identification) -> dict[str, Path]:
        """Write the numbers into the device file, with their sources, where that is wanted and there are some."""
        if not case["write"] or result.not_written or not result.settings:
            return {}
        from zwidth.device.address import edited_text
        from zwidth.identify.identification import interval, written_value

        case.device.with_(result.settings)  # what they make must be a device
        sources = {
            one.path: f"measured ({', '.join(case['files'])}): {interval(one)} {unit_text(one.unit)} with 95 %"
            for one in result.estimates
            if one.path in result.settings
        }
        path = destination(case.question.name, (".toml",))
        values = result.settings | {
            one.path: written_value(one) for one in result.estimates if one.path in sources
        }
        write_text(path, edited_text(path, values, sources))
        return {"written": path}

    def caption_facts(self, case: CommandLine, document: Mapping[str, Any]) -> dict[str, Any]:
        return self.circumstances(case) if self.takes_point else {"name": case.device.name}


def _with_files(command: Callback) -> Callback:
    """The command with the argument FILE..., the records, of which there is one at least."""
    return click.argument("files", metavar="FILE...", nargs=-1, required=True)(command)


_write = click.Option(
    ["--write"],
    is_flag=True,
    help="Write the numbers into DEVICE, with their intervals under [sources]; all else in it stays as it is.",
)


def _explained_text(share: float) -> str:
    """The share of the variance that a fit explains, in per cent."""
    return "over 99.9 %" if share > MOST_EXPLAINED else f"{typed(uncertain(100.0 * share))} %"


def _row(estimate: Estimate) -> tuple[str, ...]:
    """Cells of one identified number: name, value, interval, unit, and its path in the device file."""
    from zwidth.identify.identification import estimate_text, interval

    path = (estimate.path or estimate.within).removeprefix("mechanism.")
    return estimate.name, estimate_text(estimate), interval(estimate), unit_text(estimate.unit) or "1", path


class StiffnessCommand(IdentifyCommand):
    """Find a drive's stiffness from torque over angle, loaded and unloaded both ways.

    FILE has columns torque_Nm, angle_rad and perhaps joint, in the order in which they were measured; each file is
    a run. The link is blocked and the motor pulls, slowly; or the other way round, with --side link.
    """

    name = "stiffness"
    summary = "Stiffness, backlash and friction of a drive, from torque over angle."
    examples = ("zwidth identify stiffness strokes.csv --device my-device.toml --joint upper --write",)
    options = options_of(IDENTIFY["stiffness"])


class FrictionCommand(IdentifyCommand):
    """Find the dry and viscous friction of a joint, both ways, from its motion and what drove it.

    FILE has columns time_s, position_m or angle_rad, and force_N, torque_Nm or current_A as measured, or
    force_command_N or torque_command_Nm; none of these where the joint moves freely. Record motion both ways,
    slow and fast.
    """

    name = "friction"
    summary = "Dry and viscous friction of a joint, both ways, from its motion."
    examples = ("zwidth identify friction back-and-forth.csv --device my-device.toml --joint upper",)
    options = options_of(IDENTIFY["friction"])


class MassCommand(IdentifyCommand):
    """Find the effective mass of a joint from its motion and what drove it.

    FILE has columns time_s, position_m or angle_rad, and force_N, torque_Nm or current_A as measured, or
    force_command_N or torque_command_Nm. Record motion with strong accelerations, both ways.
    """

    name = "mass"
    summary = "Effective mass of a joint, from its motion and what drove it."
    examples = ("zwidth identify mass shaken.csv --device my-device.toml --joint upper",)
    options = options_of(IDENTIFY["mass"])


class BoundaryCommand(IdentifyCommand):
    """Find numbers of DEVICE from a stability boundary that was measured on it.

    FILE has columns stiffness_N_per_m, damping_Ns_per_m, perhaps frequency_Hz, edge (lower, upper, tip, stable,
    unstable) and how it was measured: approach, perturbation_N, bias_force_N, held_by, watch_time_s, criterion,
    amplitude_m. What `zwidth experiment --output FILE.csv` writes is one.
    """

    name = "boundary"
    summary = "Damping, delay or an operator's numbers, from a measured stability boundary."
    examples = (
        "zwidth identify boundary edge.csv --device my-device.toml --parameter loop.delay_samples",
        "zwidth identify boundary edge.csv --device my-device.toml --damping-model all --output boundary.svg",
    )
    options = options_of(IDENTIFY["boundary"])
    takes_point = True


class ImpedanceCommand(IdentifyCommand):
    """Find the impedance at the handle of DEVICE from the hand's force and the handle's position.

    FILE has columns time_s, handle_force_N, handle_position_m, and perhaps wall (on, off). The answer stands
    beside what `zwidth felt` predicts.
    """

    name = "impedance"
    summary = "What the handle feels like over frequency, from force and position there."
    examples = ("zwidth identify impedance shaken.csv --device my-device.toml --stiffness 2000 --damping 5",)
    options = options_of(IDENTIFY["impedance"])
    takes_point = True


class ArmCommand(IdentifyCommand):
    """Find the dynamic parameters of DEVICE's mechanism from positions and torques of its joints.

    FILE has columns time_s and, for each drive or its link, angle_rad.NAME (position_m.NAME), torque_Nm.NAME
    (force_N.NAME) and perhaps velocity_rad_per_s.NAME. Move all joints together, for 20 s or more.
    """

    name = "arm"
    summary = "Inertia, friction and effective mass of a mechanism, from its joints."
    examples = (
        "zwidth identify arm moved.csv --device my-device.toml --gravity 0,-9.81",
        "zwidth identify arm moved.csv --device my-device.toml --torque commanded",
    )
    options = options_of(IDENTIFY["arm"])
    takes_point = True

    def check(self, case: CommandLine) -> None:
        """Raise BadInput for --write: these numbers are not written into a device file."""
        super().check(case)
        if case["write"]:
            from zwidth.identify.arm.identify import NOT_WRITTEN

            raise BadInput(f"--write: {NOT_WRITTEN}")


class ModesCommand(IdentifyCommand):
    """Find natural frequencies, damping and DEVICE's own numbers from force and position.

    FILE has columns time_s, force_N or torque_Nm, position_m or angle_rad, every sample of the loop: noise, a
    chirp, a multisine or steps. reference_N (reference_Nm) is what was added to the command of a spring that
    centres the device.
    """

    name = "modes"
    summary = "Natural frequencies, damping, masses and springs, from force and position."
    examples = (
        "zwidth identify modes soft.csv hard.csv --device my-device.toml",
        "zwidth identify modes held.csv --device my-device.toml --operator firm-grasp",
    )
    options = options_of(IDENTIFY["modes"])
    takes_point = True


class ResponseCommand(IdentifyCommand):
    """Find the response of DEVICE from raw sweeps, as a [response] reads it, and the chart that follows.

    FILE has columns time_s, force_command_N, position_m, every sample of the loop; each file is a sweep, and
    several are repetitions. `--output sweep.csv` is a file for a [response].
    """

    name = "response"
    summary = "A frequency response with coherence from raw sweeps, and its chart."
    examples = (
        "zwidth identify response noise.csv --device my-device.toml --output sweep.csv",
        "zwidth identify response up.csv down.csv --device my-device.toml --output response.svg",
    )
    options = options_of(IDENTIFY["response"])


KINDS: tuple[Callable[[], IdentifyCommand], ...] = (
    StiffnessCommand,
    FrictionCommand,
    MassCommand,
    ModesCommand,
    ResponseCommand,
    ImpedanceCommand,
    BoundaryCommand,
    ArmCommand,
)


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
