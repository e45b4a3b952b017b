"""`zwidth import`: a device file from MJCF or URDF."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.device.faults import plural
from zwidth.errors import DeviceError
from zwidth.questions import IMPORT
from zwidth.show.cli.answer import answer_table
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput, as_option
from zwidth.show.cli.options import Callback as Callback
from zwidth.show.cli.options import PostureType, Question, Text, options_of
from zwidth.show.output import printable, write_text

if TYPE_CHECKING:
    from zwidth.device.robot_files.import_file import ImportedDevice

ENDING: Final = ".toml"
ARGUMENT: Final = re.compile(rf"\b({'|'.join(IMPORT)})=([^\s;,][^\s;]*)")


class ImportCommand(Command):
    """Write a device file from FILE, MJCF or URDF, and list what it does not hold.

    Bodies become links, motors with gear and armature drives, equality constraints loops. What the file lacks
    is listed with the answers that need it, and so is what is left out. With a URDF NAME.urdf a file
    NAME.loops.toml beside it is read, with [[loops]] as in a device file.

    Needs MuJoCo: pip install "zwidth[mjcf]".
    """

    name = "import"
    summary = "Write a device file from MJCF or URDF."
    examples = (
        "zwidth import arm.xml --handle tool",
        "zwidth import robot.urdf --handle wrist --fix finger_joint --output robot.toml",
    )
    options = options_of(IMPORT, posture=PostureType(IMPORT["posture"]))
    outputs = (ENDING,)
    output_help = "Where to write it (.toml). Default: FILE's name in this folder."
    has_device = False

    def about(self, command: Callback) -> Callback:
        """Give the command FILE, in a `Question` in place of a device."""

        @wraps(command)
        def with_file(file: str, **more: Any) -> int:
            """Call the command with a `Question` that has the file in place of a device."""
            return command(Question(file), **more)

        return click.argument("file", metavar="FILE", type=Text())(with_file)

    def default_output(self, question: Question) -> str:
        return (Path(question.name).stem or "device") + ENDING

    def check(self, case: CommandLine) -> None:
        """Refuse to overwrite a file without --force."""
        assert case.path is not None
        if case.path.exists() and not case["force"]:
            raise BadInput(
                f"{case.path}: exists already; overwrite it with --force, or name another file with --output"
            )

    def parse(self, case: CommandLine) -> Mapping[str, Any]:
        """The names of --fix, which can be repeated and can have several, with commas between them."""
        return {"fix": tuple(name for names in case["fix"] for name in names.split(",") if name)}

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        return {}  # the answer is about a file, and no device yet

    def compute(self, case: CommandLine) -> ImportedDevice:
        """The device that the file describes; messages name options, not arguments."""
        from zwidth.device.robot_files.import_file import import_file

        try:
            return import_file(
                case.question.name,
                handle=case["handle"],
                controls=case["controls"],
                keyframe=case["keyframe"],
                posture=case["posture"],
                fix=case["fix"],
            )
        except DeviceError as error:
            raise DeviceError(replace(fault, message=_as_typed(fault.message)) for fault in error.faults) from None

    def document(self, case: CommandLine, result: ImportedDevice) -> dict[str, Any]:
        """Numbers that the file lacks, and findings, whose arguments are spelled as options."""
        findings = [
            {"where": one.where, "what": _as_typed(one.what), "severity": one.severity} for one in result.findings
        ]
        return {"missing": result.missing, "findings": findings}

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages begin with the device that was made

    def pages(self, case: CommandLine, result: ImportedDevice, document: Mapping[str, Any]) -> Iterator[Any]:
        """How many links, loops and drives there are, a row for each finding, and how to see the device."""
        mechanism = result.document["mechanism"]
        parts = [plural(len(mechanism.get(f"{one}s", [])), one) for one in ("link", "loop", "drive")]
        yield f"{printable(result.document['name'])}: {', '.join(parts)}"
        rows = [(one["severity"], one["where"], one["what"]) for one in document["findings"]]
        if rows:
            yield answer_table(["", "where", "finding"], rows)
        yield f"to see it:\n  zwidth show {printable(shlex.quote(document['file']))}"

    def write(
        self, case: CommandLine, result: ImportedDevice, document: dict[str, Any], reason: str | None
    ) -> str | None:
        assert case.path is not None
        write_text(case.path, result.text)
        return reason


def _as_typed(message: str) -> str:
    """A message with arguments spelled as options.

    >>> _as_typed("name it with handle=NAME; bodies: arm")
    'name it with --handle NAME; bodies: arm'
    """
    return ARGUMENT.sub(lambda found: as_option(found[1], found[2]), message)
