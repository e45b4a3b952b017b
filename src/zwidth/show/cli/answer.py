"""Answer of a command, printed for people or as JSON."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from zwidth.show.cli.process import DONE, NO_ANSWER, say
from zwidth.show.output import json_text

Row = tuple[str, str]


@dataclass(frozen=True)
class Answer:
    """The result of one command.

    document  keys and values of --json
    pages     builds what is printed for people, only where it is needed: rich renderables or text
    reason    why the question has no answer; None if it has one
    """

    document: dict[str, Any]
    pages: Callable[[], Sequence[Any]] = tuple
    reason: str | None = None


def deliver(answer: Answer, as_json: bool) -> int:
    """Print an answer; returns the exit code."""
    if as_json:
        unanswered = {} if answer.reason is None else {"reason": answer.reason}
        put(json_text(answer.document | unanswered))
    else:
        put(_rendered(answer.pages()))
    if answer.reason is None:
        return DONE
    if not as_json:
        say(f"zwidth: {answer.reason}")
    return NO_ANSWER


def put(text: str) -> None:
    """Text on standard output."""
    sys.stdout.write(text)
    sys.stdout.flush()


def two_columns(rows: Sequence[Row]) -> Any:
    """Labels and values in two columns."""
    from rich.table import Table
    from rich.text import Text

    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    for label, value in rows:
        grid.add_row(Text("  " + label), Text(value))
    return grid


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Any:
    """Rows of cells below headings."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in headings:
        made.add_column(heading, overflow="fold")
    for row in rows:
        made.add_row(*map(Text, row))
    return made


def _rendered(pages: Sequence[Any]) -> str:
    from rich.console import Console

    width = None if sys.stdout.isatty() else 110
    console = Console(markup=False, highlight=False, emoji=False, width=width)
    with console.capture() as captured:
        for page in pages:
            console.print(page, soft_wrap=isinstance(page, str))
    return "".join(line.rstrip() + "\n" for line in captured.get().splitlines())
