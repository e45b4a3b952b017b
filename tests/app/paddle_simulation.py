"""The paddle's sketch, compiled for this computer around the simulated mass of `arduino_stub/Arduino.h`."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
SKETCH = ROOT / "src" / "zwidth" / "show" / "app" / "page" / "paddle.ino"
STUB = Path(__file__).parent / "arduino_stub"
# a fused multiply-add rounds otherwise, and a record has to be the same on every processor
OPTIONS = ("-std=c++11", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror")
MASS = 0.03  # kg
FRICTION = 0.1  # N s/m


def cpp_compiler() -> str | None:
    """The C++ compiler of this computer; None where there is none."""
    return next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)


def compile_sketch(compiler: str, folder: Path) -> Path:
    """Compile the sketch into `folder`; returns the program. Every warning is an error."""
    program = folder / "paddle"
    command = [compiler, *OPTIONS, "-I", STUB, "-include", "Arduino.h", "-x", "c++", SKETCH, "-o", program]
    subprocess.run(command, check=True)
    return program


def run_sketch(
    program: Path, seconds: float, *commands: tuple[float, str], mass: float = MASS, friction: float = FRICTION
) -> str:
    """What the sketch prints within `seconds` [s] on a paddle of `mass` [kg] and viscous `friction` [N s/m].

    commands  time [s] at which each is sent, and the command
    """
    sent = "".join(f"{at} {command}\n" for at, command in commands)
    arguments = [str(program), str(seconds), str(mass), str(friction)]
    done = subprocess.run(arguments, input=sent, capture_output=True, text=True, check=True)
    return done.stdout
