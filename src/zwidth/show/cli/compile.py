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

    Without it, each command compiles the kernels it needs when it is first used, which takes up to half a minute.
    The compiled kernels are kept beside the sources, or in your cache folder.
    """
    from numba.core import config

    from zwidth.machine_code import written_folder
    from zwidth.show.cli.errors import BadInput
    from zwidth.show.cli.first_use import compile_kernels

    if config.DISABLE_JIT:
        raise BadInput("kernels run as Python while NUMBA_DISABLE_JIT is set, and none is compiled; unset it")
    folder = written_folder()
    if folder is None:
        raise BadInput("no folder for compiled kernels can be written; set NUMBA_CACHE_DIR to a folder of yours")
    began = monotonic()
    count = compile_kernels()
    document = {"kernels": count, "seconds": monotonic() - began, "folder": str(folder)}

    def pages() -> list[str]:
        if not count:
            return ["all kernels are compiled already"]
        return [f"{count} kernel{'s' * (count != 1)} compiled in {document['seconds']:.0f} s; kept in {folder}"]

    return deliver(Answer(document, pages), as_json)
