"""A command as a process, stopped at a known place of its work and not after some time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

HANG_TIMEOUT_S = 900.0  # seconds after which a process that should have ended counts as one that never will

# The method `{name}` of `{owner}` of `{module}` (a function of the module where there is no owner) works as ever.
# After call number `{calls}` it tells the test and waits for the signal; one that comes earlier counts too.
INTERRUPTED_PROGRAM = """
import importlib, os, signal, sys

sys.path[:0] = {path!r}
module = importlib.import_module({module!r})
owner = getattr(module, {owner!r}) if {owner!r} else module
original, calls = getattr(owner, {name!r}), 0

def followed(*arguments, **named):
    global calls
    answer = original(*arguments, **named)
    calls += 1
    if calls == {calls}:
        os.write({ready}, b".")
        while True:
            signal.pause()
    return answer

setattr(owner, {name!r}, followed)
sys.argv = ["zwidth", *{words!r}]
from zwidth.show.cli.main import main
main()
"""


def interruptible() -> None:
    """Let a process be interrupted, before it begins: one of a job in the background is started deaf to that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def stopped_by_ctrl_c(
    words: list[str], where: str, calls: int = 1, folder: Path | None = None, by: signal.Signals = signal.SIGINT
) -> tuple[int, str, str]:
    """Exit code, output and messages of a command line that ctrl-C stops after a certain call.

    where  the function or method, as "module:function" or "module:Class.method"
    calls  after which of its calls; the command must get that far by itself, or the test fails
    folder in which the command runs
    by     another signal, such as SIGKILL
    The signal goes to the whole group of processes, as a terminal sends it.
    """
    module, _, attribute = where.partition(":")
    owner, _, name = attribute.rpartition(".")
    ready, tell = os.pipe()
    program = INTERRUPTED_PROGRAM.format(
        path=sys.path, module=module, owner=owner, name=name, calls=calls, ready=tell, words=words
    )
    running = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        pass_fds=[tell],
        start_new_session=True,
        preexec_fn=interruptible,
    )
    os.close(tell)
    with open(ready, "rb") as pipe:
        reached = pipe.read(1) == b"."  # empty where the process ended without getting there
    if reached:
        os.killpg(running.pid, by)
    out, err = running.communicate(timeout=HANG_TIMEOUT_S)
    assert reached, f"ended before it got to {where}: {err}"
    return running.returncode, out, err
