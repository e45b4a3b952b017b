"""A process that runs command lines of one commit, one after the other, without starting Python for each.

    python worker.py MODULE:FUNCTION        the console script of that commit; its sources come by PYTHONPATH

A request is a line of JSON on standard input, {"words": [...], "limit_s": ...}; so is the answer on standard
output, {"code": ..., "out": ..., "err": ..., "seconds": ...}. A run that takes more processor time than its limit
ends the whole process, also within compiled code, which no exception would stop.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from importlib import import_module
from io import StringIO
from signal import ITIMER_PROF, ITIMER_REAL, setitimer
from time import process_time

# waiting takes no processor time: a run that waits for ever ends after so many times its limit on the wall clock
PATIENCE = 30.0


def answer(main: Callable[[], object], words: list[str], limit: float) -> dict[str, object]:
    """What one command line comes to."""
    sys.argv = ["zwidth", *words]
    out, err, began, code = StringIO(), StringIO(), process_time(), 0
    setitimer(ITIMER_PROF, limit)
    setitimer(ITIMER_REAL, limit * PATIENCE)
    try:
        with redirect_stdout(out), redirect_stderr(err):
            main()
    except SystemExit as leaving:
        code = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
    finally:
        setitimer(ITIMER_PROF, 0.0)
        setitimer(ITIMER_REAL, 0.0)
    return {"code": code, "out": out.getvalue(), "err": err.getvalue(), "seconds": process_time() - began}


def serve(entry: str) -> None:
    """Answer until standard input ends."""
    # the sources' folder is not to be on the path twice, as this file's own would be
    sys.path = [place for place in sys.path if place != os.path.dirname(os.path.abspath(__file__))]
    # what anything prints past the redirection must not come between the answers
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    module, function = entry.split(":")
    main = getattr(import_module(module), function)
    for line in sys.stdin:
        request = json.loads(line)
        try:
            print(json.dumps(answer(main, request["words"], request["limit_s"])), file=answers, flush=True)
        except BrokenPipeError:  # whoever asked is gone
            os._exit(1)


if __name__ == "__main__":
    serve(sys.argv[1])
