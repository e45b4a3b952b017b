"""The commands under one name."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import click

from zwidth._version import __version__
from zwidth.show.cli.bounds import BoundsCommand
from zwidth.show.cli.chart import ChartCommand
from zwidth.show.cli.check import CheckCommand
from zwidth.show.cli.command import Command
from zwidth.show.cli.compile import compile_command
from zwidth.show.cli.devices import devices
from zwidth.show.cli.experiment import ExperimentCommand
from zwidth.show.cli.felt import FeltCommand
from zwidth.show.cli.guarantees import GuaranteesCommand
from zwidth.show.cli.limit_cycles import LimitCyclesCommand
from zwidth.show.cli.map import MapCommand
from zwidth.show.cli.move import MoveCommand
from zwidth.show.cli.new import NewCommand
from zwidth.show.cli.polar import PolarCommand
from zwidth.show.cli.report import ReportCommand
from zwidth.show.cli.robust import RobustCommand
from zwidth.show.cli.schema import schema
from zwidth.show.cli.sensitivity import SensitivityCommand
from zwidth.show.cli.show import ShowCommand
from zwidth.show.cli.simulate import SimulateCommand
from zwidth.show.cli.sweep import SweepCommand

EPILOG = """\b
Example:
  zwidth devices
  zwidth chart my-device.toml --set loop.delay_samples=1

Exit codes: 0 done; 1 the question has no answer; 2 bad input; 70 an error in zwidth; 130 interrupted."""


@click.group(
    epilog=EPILOG,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, prog_name="zwidth", message="%(prog)s %(version)s")
@click.pass_context
def zwidth(context: click.Context) -> None:
    """Which virtual walls a haptic device can render, what limits them, and what to change."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


COMMANDS = (
    devices,
    schema,
    compile_command,
    NewCommand(),
    ShowCommand(),
    ChartCommand(),
    CheckCommand(),
    PolarCommand(),
    MapCommand(),
    SweepCommand(),
    ReportCommand(),
    SensitivityCommand(),
    FeltCommand(),
    BoundsCommand(),
    GuaranteesCommand(),
    RobustCommand(),
    SimulateCommand(),
    ExperimentCommand(),
    LimitCyclesCommand(),
    MoveCommand(),
)
for command in COMMANDS:
    zwidth.add_command(command.for_click() if isinstance(command, Command) else command)


def invoke(arguments: Sequence[str]) -> int:
    """Run one command line; returns the exit code that the command chose.

    Raises whatever the command raises: click's own `main` would print, and take over the exit code.
    """
    if os.environ.get("_ZWIDTH_COMPLETE"):  # a shell asks what could follow
        zwidth.main(list(arguments), prog_name="zwidth")
    try:
        with zwidth.make_context("zwidth", list(arguments)) as context:
            code: Any = zwidth.invoke(context)
    except click.exceptions.Exit as leaving:
        return int(leaving.exit_code)
    return int(code or 0)
