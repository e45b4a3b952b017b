"""First use: what commands take when no kernel has been compiled yet, and how much is compiled for them.

    python benchmarks/_compiling.py          processor time of some commands, each from nothing, and of all kernels
    python benchmarks/_compiling.py --check  all kernels only; fails where more is compiled than MOST allows
    python benchmarks/_compiling.py --write  time every kernel and note which command uses which, for the estimates
                                            that `zwidth` gives: src/zwidth/show/cli/kernel_times.json

Processor time, so that other work on the machine matters little; beside a busy neighbour a core is still slower.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from time import perf_counter, process_time

from benchmarks._timing import machine, print_table
from zwidth.compile_events import listening
from zwidth.show.cli.compile_group import run_group, write_devices
from zwidth.show.cli.first_use import GROUPS

TIMES = Path(__file__).parent.parent / "src/zwidth/show/cli/kernel_times.json"
# Functions compiled for all kernels, numba's own among them, and the combinations of types they are compiled for.
MOST = (620, 780)
SECONDS = 30  # of a command
SECONDS_OF_ALL = 110
COMMANDS = {
    "chart": "chart five-bar",
    "simulate": "simulate published-two-mass --stiffness 4000 --damping 10",
    "map": "map five-bar --measure stiffness_max",
    "move": "move five-bar --plane 0,0.28,0,-1 --stiffness 2000 --damping 5 --push 0,2 --duration 0.3",
}
OTHERS = {
    "show": "show five-bar",
    "check": "check five-bar --stiffness 1000 --damping 5",
    "polar": "polar five-bar",
    "load": "load five-bar --count 3",
    "report": "report five-bar --output report.html",
    "sensitivity": "sensitivity five-bar",
    "felt": "felt five-bar --stiffness 1000 --damping 5",
    "bounds": "bounds five-bar",
    "guarantees": "guarantees hapkit-course",
    "export": "export five-bar --x -0.01,0.01 --y 0.2,0.22 --cells 1,1 --output walls.h",
    "robust": "robust published-two-mass --range loop.delay_samples=0,1",
    "experiment": "experiment hapkit-course --trials 2",
    "limit-cycles": "limit-cycles hapkit-course --stiffness 2600 --damping 0 --set loop.saturation.force_N=5",
}

# Other options of the commands: after `zwidth compile` none of them may compile either.
VARIANTS = (
    "chart five-bar --with-direction 1,0 --output chart.svg",
    "chart five-bar --model two-mass --operator thesis-arm",
    "chart masses.toml --set loop.delay_samples=40",
    "chart measured.toml",
    "check measured.toml --stiffness 1000 --damping 5",
    "show arm.toml --at upper=0.7,lower=1.4",
    "chart arm.toml --load 0,-2 --gravity 0,-9.81",
    "map five-bar --measure stable_area --cells 5,5",
    "felt five-bar --stiffness 1000 --damping 5 --output felt.svg",
    "guarantees published-two-mass --coupling --output guarantees.svg",
    "robust masses.toml --range loop.delay_samples=0,1 --unseen 3 --members 3 --output robust.svg",
    "limit-cycles masses.toml --stiffness 2600 --damping 0 --set loop.saturation.force_N=5",
    "simulate masses.toml --environment hunt_crossley --stiffness 1000 --duration 0.05",
    "simulate five-bar --environment one_sided_wall --stiffness 900 --damping 5 --duration 0.1 --output felt.wav",
    "move arm.toml --plane 0,0.2,0,-1 --environment texture --push 0,2 --duration 0.05",
)


def compile_for(*lines: str) -> None:
    """Run command lines, or the GROUP of a line `group GROUP`, and print what was compiled for them as JSON.

    Called in a process of its own, by `compiled_in`.
    """
    from numba.core import event

    from zwidth.show import run

    functions: dict[str, int] = {}
    kernels: dict[str, float] = {}
    began: list[float] = []

    class Count(event.Listener):
        def on_start(self, event):
            function = event.data["dispatcher"].py_func
            name = f"{function.__module__}.{function.__qualname__}"
            functions[name] = functions.get(name, 0) + 1

        def on_end(self, event):
            pass

    def listen(name: str, ended: bool) -> None:
        if ended:
            kernels[name] = kernels.get(name, 0.0) + process_time() - began.pop()
        else:
            began.append(process_time())

    event.register("numba:compile", Count())
    wall = perf_counter()
    codes = {}
    with tempfile.TemporaryDirectory() as folder, open(os.devnull, "w") as nowhere:
        os.chdir(folder)
        write_devices(Path(folder))
        with listening(listen), redirect_stdout(nowhere), redirect_stderr(nowhere):
            for line in lines:
                command, *words = shlex.split(line)
                if command == "group":
                    run_group(int(words[0]))
                else:
                    codes[line] = run([command, *words])
    result = {
        "failed": [line for line, code in codes.items() if code],
        "processor": process_time(),
        "elapsed": perf_counter() - wall,
        "functions": len(functions),
        "signatures": sum(functions.values()),
        "kernels": {name: round(seconds, 2) for name, seconds in sorted(kernels.items())},
    }
    print(json.dumps(result))


def compiled_in(folder: str, *lines: str) -> dict:
    """Result of `compile_for` in a new process that finds compiled kernels in this folder only."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": folder, "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, __file__, "--child", *lines]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    result = json.loads(done.stdout)
    assert not result["failed"], f"these command lines failed: {result['failed']}"
    return result


def from_nothing(*lines: str) -> dict:
    """Result of `compile_for` in a new process that finds no compiled kernel."""
    with tempfile.TemporaryDirectory() as folder:
        return compiled_in(folder, *lines)


def row(name: str, found: dict, limit: int) -> list[str]:
    """A row of the table."""
    numbers = (len(found["kernels"]), found["functions"], found["signatures"])
    return [name, f"{found['processor']:.1f} s", f"{limit} s", *map(str, numbers)]


def measure(commands: dict[str, str]) -> None:
    """Print what each command takes from nothing, and all groups together; after them no command may compile."""
    print(machine("numba"))
    rows = [row(name, from_nothing(line), SECONDS) for name, line in commands.items()]
    with tempfile.TemporaryDirectory() as folder:
        groups = [compiled_in(folder, f"group {group}") for group in range(GROUPS)]
        left = compiled_in(folder, *COMMANDS.values(), *OTHERS.values(), *VARIANTS)["kernels"]
    together = {
        "processor": sum(found["processor"] for found in groups),
        "functions": sum(found["functions"] for found in groups),
        "signatures": sum(found["signatures"] for found in groups),
        "kernels": {name: 0 for found in groups for name in found["kernels"]},
    }
    rows.append(row("all kernels", together, SECONDS_OF_ALL))
    print_table(["command", "processor time", "at most", "kernels", "functions", "signatures"], rows)
    if together["functions"] > MOST[0] or together["signatures"] > MOST[1]:
        sys.exit(f"more is compiled than MOST allows: {together['functions']}, {together['signatures']} > {MOST}")
    if left:
        sys.exit(f"`zwidth compile` leaves kernels to the commands: {', '.join(left)}; see compile_group")


def write() -> None:
    """Write the time of each kernel, and which command uses which, to TIMES."""
    seconds: dict[str, float] = {}
    of_command = {}
    for name, line in {**COMMANDS, **OTHERS}.items():
        kernels = from_nothing(line)["kernels"]
        of_command[name] = list(kernels)
        seconds |= {kernel: max(taken, seconds.get(kernel, 0.0)) for kernel, taken in kernels.items()}
        print(name, len(kernels), f"{sum(kernels.values()):.1f} s", flush=True)
    for group in range(GROUPS):  # kernels that no command uses
        seconds = from_nothing(f"group {group}")["kernels"] | seconds
    times = {"seconds": dict(sorted(seconds.items())), "of_command": of_command}
    TIMES.write_text(json.dumps(times, indent=1) + "\n")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        compile_for(*sys.argv[2:])
    elif "--write" in sys.argv:
        write()
    else:
        measure({} if "--check" in sys.argv else COMMANDS)
