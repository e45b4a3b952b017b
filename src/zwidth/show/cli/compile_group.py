"""One group of kernels, compiled in a process of its own by running commands that want them."""

from __future__ import annotations

import os
import shlex
import sys
import tempfile
from contextlib import redirect_stdout
from pathlib import Path
from typing import Final

from zwidth.compile_events import listening
from zwidth.device.new_device import new_device
from zwidth.show.cli.first_use import GROUPS
from zwidth.show.cli.group import invoke

DEVICES: Final = {"linkage": "five-bar", "masses": "plant"}  # file names, and kinds of `zwidth new`
# Together these want every kernel. Those of a group run one after the other, and what their kernels have in common
# is translated only once; the groups have little in common.
COMMANDS: Final = (
    (
        "move linkage.toml --plane 0,0.26,0,-1 --stiffness 2000 --damping 5 --push 0,2 --duration 0.05",
        "map linkage.toml --measure stiffness_max --cells 9,9 --output map.svg",
        "show linkage.toml",
        "simulate masses.toml --stiffness 4000 --damping 10 --duration 0.05",
    ),
    (
        "report masses.toml --output report.html",
        "guarantees masses.toml",
        "robust masses.toml --range loop.delay_samples=0,1",
        "limit-cycles masses.toml --stiffness 2600 --damping 0 --set loop.saturation.force_N=5 --no-simulation",
        "felt masses.toml --stiffness 1000 --damping 5",
    ),
)
assert len(COMMANDS) == GROUPS


def write_devices(folder: Path) -> None:
    """Write the device files that the commands name."""
    for name, kind in DEVICES.items():
        (folder / f"{name}.toml").write_text(new_device(name, kind), encoding="utf-8")


def run_group(group: int) -> None:
    """Run the command lines of one group, and print the name of each kernel that was compiled for them."""
    names = sys.stdout

    def listen(name: str, ended: bool) -> None:
        if ended:
            print(name, file=names, flush=True)

    with tempfile.TemporaryDirectory() as folder:
        write_devices(Path(folder))
        os.chdir(folder)
        with listening(listen), open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
            for line in COMMANDS[group]:
                invoke(shlex.split(line))
        os.chdir("/")


if __name__ == "__main__":
    run_group(int(sys.argv[1]))
