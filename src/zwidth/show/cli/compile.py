"""`zwidth compile`: all kernels at once, before they are wanted."""

from __future__ import annotations

from time import monotonic

import click

from zwidth.show.cli.answer import Answer, deliver
from zwidth.show.cli.options import as_json, example


@click.command(
    "compile",
    short_help="Compile all kernels for this processor.",
    epilog=example("zwidth compile", "zwidth compile --json"),
)
@as_json
def compile_command(as_json: bool) -> int:
    """Compile all kernels for this processor, so that no command has to.

    Commands compile what they want at first use, which takes up to a minute each; here all of it happens at once,
    on several cores. What is compiled is kept, beside the sources or in your cache folder.
    """
    from zwidth.machine_code import written_folder
    from zwidth.show.cli.errors import BadInput
    from zwidth.show.cli.first_use import compile_kernels

    folder = written_folder()
    if folder is None:
        raise BadInput(
            "no folder may be written to that could keep compiled kernels; set NUMBA_CACHE_DIR to one of yours"
        )
    began = monotonic()
    count = compile_kernels()
    found = {"kernels": count, "seconds": monotonic() - began, "folder": str(folder)}

    def pages() -> list[str]:
        if not count:
            return ["all kernels are compiled already"]
        return [f"{count} kernel{'s' * (count != 1)} compiled in {found['seconds']:.0f} s; kept in {folder}"]

    return deliver(Answer(found, pages), as_json)
