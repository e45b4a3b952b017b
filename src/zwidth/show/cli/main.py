"""The command `zwidth`: what happens round every command, and the exit code.

0 done; 1 the question has no answer; 2 bad input; 70 an error in zwidth; 130 interrupted.

Nothing is imported here that could not be interrupted quietly: the commands come inside `run`.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from typing import TextIO

from zwidth.show.cli.progress import BAD_INPUT, DONE, interrupted, say, stopped_in_a_kernel


def main() -> None:
    """Run the command line of this process and leave with its exit code."""
    # Read once, when numpy is loaded. The matrices are tiny: threads only cost time, and fight over the cores
    # with whatever else runs there. Whoever sets it means it.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Plug-ins are of no use here, and to find that there are none pydantic looks through all installed packages.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    warnings.showwarning = _warn
    sys.exit(run(sys.argv[1:]))


def run(arguments: Sequence[str]) -> int:
    """Run one command line; results go to standard output, messages to standard error. Returns the exit code."""
    try:
        with suppress(AttributeError, ValueError):  # replaced or closed streams
            for stream in (sys.stdout, sys.stderr):
                stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
        from zwidth.show.cli.errors import explain
    except KeyboardInterrupt:
        return interrupted()
    if sys.stdout is None or sys.stdout.closed:  # said before anything is computed in vain
        say("zwidth: standard output is closed; send it to a file, or to /dev/null")
        return BAD_INPUT
    try:
        from zwidth.show.cli.group import invoke

        code = invoke(arguments)
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        return interrupted()
    except BrokenPipeError:  # the reader has seen enough
        _drop_output()
        return DONE
    except Exception as error:
        if stopped_in_a_kernel(error):
            return interrupted()
        lines, code = explain(error)
        say(*lines)
        _drop_output()
        return code


def _warn(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Say a UserWarning, as those of zwidth are, on one line; others, of arithmetic, with ZWIDTH_DEBUG alone."""
    if issubclass(category, UserWarning) or os.environ.get("ZWIDTH_DEBUG"):
        say(f"zwidth: warning: {message}")


def _drop_output() -> None:
    """Send what standard output still holds to nowhere if it cannot be written, or Python complains at its end."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
