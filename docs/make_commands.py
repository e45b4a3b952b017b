"""Write the tables of docs/commands.md: the commands in their groups, and the options of each.

`make docs` runs this. What is written comes from the commands themselves; the prose between the tables stays.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import click

sys.path.insert(0, str(Path(__file__).parents[1]))

from docs._markdown import table
from zwidth.show import zwidth
from zwidth.show.cli.sections import GROUPS, POSTURE, section_of

PAGE = Path(__file__).parent / "commands.md"
SHARED = ("output", "as_json", "help")
TABLE = re.compile(r"(<!-- (?P<what>\w+)(?: of (?P<name>[\w-]+))? -->\n).*?(<!-- end -->)", re.DOTALL)


def page() -> str:
    """The page with its tables written anew."""
    return TABLE.sub(lambda one: f"{one[1]}{_written(one['what'], one['name'])}{one[4]}", PAGE.read_text("utf-8"))


def _written(what: str, name: str | None) -> str:
    if what == "commands":
        return table(("Command", "Does"), list(_commands()))
    return table(("Option", "Meaning"), list(_options(name or "")))


def _commands() -> Iterator[list[str]]:
    """The commands in their groups, each with a link to its section."""
    for title, names in GROUPS.items():
        yield [f"**{title}**", ""]
        for name in names:
            yield [f"[`zwidth {name}`](#{name})", zwidth.commands[name].get_short_help_str(200).rstrip(".")]


def _options(name: str) -> Iterator[list[str]]:
    """The options of a command but for those that all share, of several kinds of one command each option once."""
    command = zwidth.commands[name]
    kinds = command.commands if isinstance(command, click.Group) else {"": command}
    rows: dict[tuple[str, str], list[str]] = {}
    for kind, one in kinds.items():
        for option in one.params:
            if isinstance(option, click.Option) and section_of(option) != POSTURE and option.name not in SHARED:
                record = option.get_help_record(click.Context(one))
                assert record is not None
                rows.setdefault((record[0], record[1].removesuffix("  [required]")), []).append(kind)
    for (option, meaning), which in rows.items():
        of_kinds = "" if len(which) == len(kinds) else f"{', '.join(which)}: "
        yield [f"`{option}`", f"{of_kinds}{meaning}"]


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
