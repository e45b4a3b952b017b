"""The commands under one name."""

from __future__ import annotations

import os
from collections.abc import Iterator, MutableMapping, Sequence
from importlib import import_module
from typing import Any, Final

import click

from zwidth._version import __version__
from zwidth.show.cli.sections import GROUPS, GroupedCommands

COMMANDS: Final = {name: place for commands in GROUPS.values() for name, place in commands.items()}
EPILOG = """\b
Example:
  zwidth devices
  zwidth chart my-device.toml --set loop.delay_samples=1

Exit codes: 0 done; 1 the question has no answer; 2 bad input; 70 an error in zwidth; 130 interrupted."""


class LazyCommands(MutableMapping[str, click.Command]):
    """The commands by name, each imported when it is wanted: importing all of them takes 60 ms."""

    def __init__(self) -> None:
        self._made: dict[str, click.Command] = {}

    def __getitem__(self, name: str) -> click.Command:
        """The command of this name, imported and made when it is first wanted."""
        if name not in self._made:
            module, attribute = COMMANDS[name]
            command = getattr(import_module(f"zwidth.show.cli.{module}"), attribute)
            self._made[name] = command if isinstance(command, click.Command) else command().for_click()
        return self._made[name]

    def __setitem__(self, name: str, command: click.Command) -> None:
        self._made[name] = command

    def __delitem__(self, name: str) -> None:
        del self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


@click.group(
    cls=GroupedCommands,
    commands=LazyCommands(),
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
