"""Environments by name: those of this package, or a user's in an own file."""

from __future__ import annotations

import importlib.util
import sys
from difflib import get_close_matches
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Final

import numpy as np

from zwidth.contact.environments.environment import MEMORY, Environment
from zwidth.contact.environments.surface_patterns import friction_patch, grating, texture, virtual_mass
from zwidth.contact.environments.walls import (
    coupled_wall,
    hunt_crossley,
    nonlinear_wall,
    one_sided_wall,
    pressed_wall,
    slot,
    wall,
)

ENVIRONMENTS: Final[dict[str, Environment]] = {
    each.function.__name__: each
    for each in (
        wall,
        one_sided_wall,
        pressed_wall,
        slot,
        nonlinear_wall,
        hunt_crossley,
        coupled_wall,
        friction_patch,
        texture,
        grating,
        virtual_mass,
    )
}

__all__ = [
    "ENVIRONMENTS",
    "coupled_wall",
    "friction_patch",
    "grating",
    "hunt_crossley",
    "nonlinear_wall",
    "one_sided_wall",
    "pressed_wall",
    "slot",
    "texture",
    "virtual_mass",
    "wall",
]


def load_environment(source: str) -> Environment:
    """The environment that `source` names.

    source  a name of ENVIRONMENTS, or "file.py:name" for one made by `@environment` in a file of one's own,
            which is run for it
    Returns it, compiled
    Raises  ValueError  with one sentence: unknown name, missing file, a file that does not run, a missing name,
            one that is not an environment, one that reads more parameters than it declares, one that does not
            compile

    >>> load_environment("slot").names
    ('width', 'stiffness', 'damping', 'no_pull')
    """
    if source in ENVIRONMENTS:
        return ENVIRONMENTS[source]
    path, colon, name = source.rpartition(":")  # a path may have a colon, too, as behind a drive's letter
    if not colon or not path.endswith(".py"):
        near = get_close_matches(source, ENVIRONMENTS, n=1)
        hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(ENVIRONMENTS)}"
        raise ValueError(f'no environment is named {source!r}; {hint} (your own: "file.py:name")')
    file = Path(path)
    if not file.is_file():
        raise ValueError(f"{path} is not an ordinary file" if file.exists() else f"no such file: {path}")
    module = _run_as_module(file)
    environment = getattr(module, name, None)
    if not isinstance(environment, Environment):
        raise ValueError(_no_environment_message(file, name, module, environment))
    _check_array_bounds(environment)
    environment.force  # noqa: B018  compiles, so that what numba says against it is said here
    return environment


def _run_as_module(file: Path) -> ModuleType:
    """Run a user's file as a module. Raises ValueError that names the line at which it fails."""
    label = f"zwidth_environment_{sha256(str(file.resolve()).encode()).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(label, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[label] = module  # numba and dataclasses look a function's module up
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[label]
        # `@environment` says itself which line is at fault
        if isinstance(error, ValueError) and str(error).startswith(f"{file.name}:"):
            raise ValueError(str(error)) from None
        line = error.lineno if isinstance(error, SyntaxError) else _failing_line(error, file)
        place = f"{file.name}:{line}" if line else file.name
        reason = error.msg if isinstance(error, SyntaxError) else f"{type(error).__name__}: {error}"
        raise ValueError(f"{place} does not run: {reason}") from None
    return module


def _failing_line(error: BaseException, file: Path) -> int:
    """Last line of the file in an error's traceback; 0 for none."""
    line, frame = 0, error.__traceback__
    while frame is not None:
        if Path(frame.tb_frame.f_code.co_filename).resolve() == file.resolve():
            line = frame.tb_lineno
        frame = frame.tb_next
    return line


def _no_environment_message(file: Path, name: str, module: ModuleType, attribute: object) -> str:
    """Message: the file has nothing of this name, or what it has (`attribute`) is no environment."""
    names = [key for key, value in vars(module).items() if isinstance(value, Environment)]
    if attribute is not None:
        return f"{name} in {file.name} is not an environment; put @environment(...) above it"
    near = get_close_matches(name, names, n=1)
    hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(names) or 'none'}"
    return f"{file.name} has no environment {name}; {hint}"


def _check_array_bounds(environment: Environment) -> None:
    """Raise ValueError for a function that reads beyond its arrays: Python notices it, machine code does not.

    It is called as Python at a few motions, in and out of a wall.
    """
    # 1.0 stands for a parameter without default: any number will do
    values = np.array([1.0 if np.isnan(p.default) else p.default for p in environment.parameters])
    memory = np.zeros(MEMORY)
    for position, velocity in ((1e-3, 0.1), (1e-3, -0.1), (-1e-3, 0.1), (0.0, 0.0)):
        try:
            environment.function(position, velocity, 0.0, 1e-3, values, memory)
        except IndexError:
            limits = f"its {len(values)} parameters or the {MEMORY} numbers of its memory"
            raise ValueError(f"{environment.where}: {environment.name} reads beyond {limits}") from None
        except Exception:  # any other error may be Python's alone; whether it compiles is seen later
            return
