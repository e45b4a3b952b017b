"""`zwidth new`: a device file to start from."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from functools import wraps
from pathlib import Path
from typing import Any, Final

import click

from zwidth.device.read import KINDS
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Callback as Callback
from zwidth.show.cli.options import Question, Text
from zwidth.show.output import printable, write_text

ENDING: Final = ".toml"


class NewCommand(Command):
    """Write a device file NAME.toml to start from: replace its numbers with yours.

    It is complete and works at once. Every number has a comment that says what it is and where to find it;
    optional entries stand there as comments. An existing file is never overwritten.
    """

    name = "new"
    summary = "Write a device file to start from."
    examples = ("zwidth new my-paddle --kind paddle", 'zwidth new "My arm" --kind serial-2r --output arm.toml')
    options = (
        click.option(
            "--kind",
            type=click.Choice(tuple(KINDS)),
            required=True,
            help="One link on a drive; a planar arm of two links; a planar linkage of two arms; a platform on "
            "three legs; one on six sliding legs; three axes that meet; or masses along the rendered direction, "
            "where you know its dynamics.",
        ),
    )
    outputs = (ENDING,)
    output_help = "Where to write it (.toml). Default: NAME.toml in this folder."
    has_device = False

    def about(self, command: Callback) -> Callback:
        """Give the command NAME, in a `Question` in place of a device."""

        @wraps(command)
        def with_name(device: str, **more: Any) -> int:
            return command(Question(device), **more)

        return click.argument("device", metavar="NAME", type=Text())(with_name)

    def default_output(self, question: Question) -> str:
        return question.name if question.name.lower().endswith(ENDING) else question.name + ENDING

    def check(self, case: CommandLine) -> None:
        assert case.path is not None
        if case.path.exists():
            raise BadInput(f"{case.path}: exists already; remove it, or name another file with --output")

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        return {"name": _device_name(case.question), "kind": case["kind"]}

    def compute(self, case: CommandLine) -> str:
        """The text of the device file. Raises BadInput for a name that cannot be."""
        from zwidth.device.read import new_device

        try:
            return new_device(_device_name(case.question), case["kind"])
        except ValueError as error:
            raise BadInput(str(error)) from None

    def document(self, case: CommandLine, result: str) -> dict[str, Any]:
        return {}  # the circumstances say it all

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages begin with the kind of device

    def pages(self, case: CommandLine, result: str, document: Mapping[str, Any]) -> Iterator[Any]:
        file = printable(shlex.quote(document["file"]))
        yield f"{document['kind']}: replace its numbers with yours; it works already:\n  zwidth chart {file}"

    def write(self, case: CommandLine, result: str, document: dict[str, Any], reason: str | None) -> str | None:
        assert case.path is not None
        write_text(case.path, result)
        return reason


def _device_name(question: Question) -> str:
    """What the device is called: NAME without a folder and without the file's ending."""
    name = Path(question.name).name
    return name[: -len(ENDING)] if name.lower().endswith(ENDING) else name
