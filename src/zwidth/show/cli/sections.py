"""Help in sections: a command's own options before those that all share, and the commands by what they do."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final

import click

from zwidth.device.faults import nearest
from zwidth.questions import DEVICE, LOADS, PLACE, RUN

OWN, POSTURE, RUNS, OUTPUT = "Options", "Posture and device", "Long runs", "Output"
# Titles below a command's own options, and the parameters that stand there.
SHARED: Final[dict[str, Collection[str]]] = {
    POSTURE: {*PLACE, *LOADS, *DEVICE},
    RUNS: set(RUN),
    OUTPUT: {"output", "write", "as_json", "help"},
}
FIRST_COLUMN: Final = 30  # characters; longer options stand on a line of their own
WHOLE: Final = 200  # characters of a summary: all of it
# What the commands do, in the order of their list and of docs/commands.md: name -> module, and what in it is the
# command, a `Command` to be made or click's own.
GROUPS: Final[dict[str, dict[str, tuple[str, str]]]] = {
    "Describe a device": {
        "devices": ("devices", "devices"),
        "new": ("new", "NewCommand"),
        "import": ("import_", "ImportCommand"),
        "schema": ("schema", "schema"),
        "show": ("show", "ShowCommand"),
    },
    "Judge walls": {
        "chart": ("chart", "ChartCommand"),
        "check": ("check", "CheckCommand"),
        "polar": ("polar", "PolarCommand"),
        "load": ("load", "LoadCommand"),
        "felt": ("felt", "FeltCommand"),
        "bounds": ("bounds", "BoundsCommand"),
        "guarantees": ("guarantees", "GuaranteesCommand"),
    },
    "Simulate contact": {
        "simulate": ("simulate", "SimulateCommand"),
        "move": ("move", "MoveCommand"),
        "limit-cycles": ("limit_cycles", "LimitCyclesCommand"),
        "experiment": ("experiment", "ExperimentCommand"),
    },
    "Compare postures and devices": {
        "map": ("map", "MapCommand"),
        "sweep": ("sweep", "SweepCommand"),
        "robust": ("robust", "RobustCommand"),
        "tolerance": ("tolerance", "ToleranceCommand"),
    },
    "Design": {
        "sensitivity": ("sensitivity", "SensitivityCommand"),
        "optimise": ("optimise", "OptimiseCommand"),
        "export": ("export", "ExportCommand"),
    },
    "Measure": {
        "identify": ("identify", "identify"),
    },
    "Show the answers": {
        "report": ("report", "ReportCommand"),
        "app": ("app", "app"),
    },
    "Set up": {
        "compile": ("compile", "compile_command"),
    },
}


class SectionedCommand(click.Command):
    """A command whose help has its own options first, and which suggests what an unknown option may have meant."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, each section with its title."""
        rows: dict[str, list[tuple[str, str]]] = {title: [] for title in (OWN, *SHARED)}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is not None and isinstance(param, click.Option):
                rows[section_of(param)].append(record)
        width = min(max(len(name) for records in rows.values() for name, _ in records), FIRST_COLUMN)
        for title, records in rows.items():
            if records:
                _write_section(formatter, title, records, width)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the command line. Raises click.NoSuchOption with the option that may have been meant."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            # click compares with the dashes before the names, which make all options alike
            names = [name.lstrip("-") for param in self.get_params(ctx) for name in param.opts if name[:2] == "--"]
            near = nearest(error.option_name.lstrip("-"), names)
            hint = f" Did you mean '--{near}'?" if near else ""
            text = f"No such option '{error.option_name}'.{hint}"
            raise click.NoSuchOption(error.option_name, text, ctx=ctx) from None


class GroupedCommands(click.Group):
    """A group whose list of commands is in sections."""

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands, each section with its title."""
        width = max(map(len, self.commands))
        for title, names in GROUPS.items():
            rows = [(name, self.commands[name].get_short_help_str(WHOLE)) for name in names]
            _write_section(formatter, title, rows, width)


def section_of(param: click.Option) -> str:
    """Title of the section in which an option stands."""
    name = "help" if "--help" in param.opts else param.name
    return next((title for title, names in SHARED.items() if name in names), OWN)


def _write_section(formatter: click.HelpFormatter, title: str, rows: list[tuple[str, str]], width: int) -> None:
    """Write rows of two columns below a title; width: of the first one in all sections, in characters."""
    with formatter.section(title):
        formatter.write_dl([(f"{name:{width}}", text) for name, text in rows], col_max=FIRST_COLUMN)
