"""`zwidth report`: everything a designer wants to know, in one file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.options import Question
from zwidth.show.units import typed


class ReportCommand(Command):
    """Write a report on DEVICE: its chart, what limits it, what to change; one HTML file that also prints."""

    name = "report"
    summary = "Write a report on DEVICE as an HTML file."
    examples = ("zwidth report my-device.toml", "zwidth report my-device.toml --at 0.1,0.2 --output here.html")
    outputs = (".html", ".htm")
    output_help = "Where to write it (.html). Default: NAME-report.html in this folder."
    keys = ("file",)
    may_be_undecided = True

    def default_output(self, question: Question) -> str:
        return default_name(question.name)

    def compute(self, case: CommandLine) -> dict[str, Any]:
        """Write the report; the numbers in it by the keys of the answer, and `reason` where no wall is stable."""
        _ = case.point.plant  # whether it can be meant, before the heavy parts are imported
        from zwidth.show.report.report import write_report

        assert case.path is not None
        return write_report(case.device, case.path, case.point, case.progress)

    def document(self, case: CommandLine, result: dict[str, Any]) -> dict[str, Any]:
        # the circumstances are stated as typed on the command line
        return result | self.circumstances(case)

    def reason(self, case: CommandLine, result: dict[str, Any]) -> str | None:
        reason: str | None = result.pop("reason", None)  # the answer has it beside the numbers, and not twice
        return reason

    def write(self, case: CommandLine, result: Any, document: dict[str, Any], reason: str | None) -> str | None:
        return reason  # written as it was computed

    def heading(self, case: CommandLine) -> str:
        return ""  # the summary says it

    def pages(self, case: CommandLine, result: dict[str, Any], document: Mapping[str, Any]) -> Iterator[Any]:
        yield from (typed(sentence) for sentence in result["summary"])


def default_name(device: str) -> str:
    """The report's name from the device's name or file."""
    return f"{Path(device).name.removesuffix('.toml')}-report.html"
