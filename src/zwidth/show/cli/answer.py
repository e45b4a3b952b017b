"""Answer of a command, printed for people or as JSON.

The sentence above a result: which device, where, which way, sampled how.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.circumstances import computer_text, load_text, omission_text, operator_text
from zwidth.show.cli.progress import DONE, NO_ANSWER, say
from zwidth.show.output import json_text, printable
from zwidth.show.units import amount, speaking_of_moments, typed, vector, way

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.show.cli.options import Question


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
    """Write text to standard output at once."""
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


def answer_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Any:
    """Rows of cells below headings."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for heading in headings:
        table.add_column(heading, overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    return table


def _rendered(pages: Sequence[Any]) -> str:
    """The text of pages as rich lays them out: as wide as the terminal, or 110 columns in a file or pipe."""
    from rich.console import Console

    width = None if sys.stdout.isatty() else 110
    console = Console(markup=False, highlight=False, emoji=False, width=width)
    with console.capture() as captured:
        for page in pages:
            console.print(page, soft_wrap=isinstance(page, str))
    return "".join(line.rstrip() + "\n" for line in captured.get().splitlines())


ROUNDING: Final = 1e-9  # m, that a position may be projected by without a word


def heading(question: Question, device: Device, *, linear: bool = True) -> str:
    """Two lines: the device and its posture; the computer. And where something is left out, one that says what.

    linear  whether the answer leaves out the nonlinear parts
    """
    facts = question.linear_circumstances(device)
    kind = "[response]" if device.response is not None else "[plant]"
    place = f"model {facts['model']}" if device.mechanism else f"{kind} {facts['model']}"
    if device.mechanism:
        where = f"{typed(way(question.screw(device)))} at {vector(facts['position_m'], 'm')}"
        if (facts["projected_m"] or 0.0) > ROUNDING:
            with speaking_of_moments(False):  # a length, whatever is rendered
                where += f" ({amount(facts['projected_m'], 'm')} from the requested position)"
        place = f"{where}, assembly {facts['assembly']}, {place}"
    held = f", held by {operator_text(facts['operator'])}" if facts["operator"] else ""
    held += "" if device.load is None else f", under {load_text(device.load)}"
    lines = [f"{printable(device.name)}: {place}{held}", computer_text(device.controller)]
    return "\n".join([*lines, *omissions(device, question.model, linear=linear)])


def omissions(device: Device, model: str | None = None, *, linear: bool = True) -> list[str]:
    """Lines on what an answer leaves out: parts that are not linear, and what a load does to links that bend."""
    from zwidth.loop.linear_omissions import load_omissions

    lines = []
    if linear and device.linear_omissions:
        simulated = "" if device.response is not None else "; `zwidth simulate` has them"
        lines.append(omission_text(device.linear_omissions) + simulated)
    return lines + list(load_omissions(device.mechanism, device.load, model))
