"""A user's own measures: functions in a Python file, marked with `measure`.

    from zwidth import measure

    @measure(unit="N", title="Force for an acceleration of 10 m/s²", better="lower")
    def inertial_force(point):
        return 10.0 * point.effective.rigid_mass

A function is called with one `OperatingPoint` at a time and returns a number; with each=False it is called with
many at once and returns an array of their shape. A second argument of the function receives the wanted wall
(`WantedWall`).
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from functools import lru_cache
from hashlib import sha256
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final
from zlib import compress, decompress

from zwidth.measures.catalogue import MEASURES
from zwidth.measures.definition import Better, Measure, WantedWall

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint

Function = Callable[..., Any]

BETTER: Final = ("higher", "lower", None)


@dataclass(frozen=True)
class FileFunction:
    """A function in a user's file, which any process can load again.

    file  path
    text  content of the file: with another content it is another measure
    name  name of the function
    """

    file: str
    text: str
    name: str

    def __call__(self, point: OperatingPoint, wall: WantedWall | None = None) -> Any:
        """Value at a point, for a wanted wall where there is one; what is printed goes to standard error."""
        loaded = _measures(self.file, self.text)[self.name]
        with redirect_stdout(sys.stderr):
            return (loaded if wall is None else loaded.at_wall(wall)).compute(point)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle as path, compressed content and name, by which another process loads it again."""
        # a content that mentions __main__ must not be taken for a function that exists in this process only
        return _unpickled, (self.file, compress(self.text.encode()), self.name)


def measure(
    unit: str = "",
    title: str = "",
    better: Better | None = None,
    *,
    along: bool = True,
    each: bool = True,
    source: str = "",
) -> Callable[[Function], Measure]:
    """Make a measure of a function of one operating point; its name is the function's.

    unit    "" for none
    title   label in figures; left out: the first line of the function's docstring, or its name
    better  "higher", "lower", or None where that depends on the purpose
    along   False: it does not depend on the rendered direction
    each    True: called with one point at a time; False: of many at once, returning an array of their shape
    source  publication or section of the formula
    Raises  ValueError  for another `better`, for arguments that are not a text of one line, and where it is
            written without brackets, so that `unit` is the function

    What the function or its file prints goes to standard error: standard output holds the answer only.

    >>> @measure(unit="kg")
    ... def moved_mass(point):
    ...     "Mass of links and rotors"
    ...     return point.effective.rigid_mass
    >>> moved_mass.name, moved_mass.title, moved_mass.unit
    ('moved_mass', 'Mass of links and rotors', 'kg')
    """
    if callable(unit):
        raise ValueError('@measure stands above a function with its unit: write @measure(unit="kg") or @measure()')
    for key, text in (("unit", unit), ("title", title), ("source", source)):
        if not isinstance(text, str) or not text.isprintable():
            raise ValueError(f"a measure's {key} must be a text of one line, got {text!r}")
    if better not in BETTER:
        raise ValueError(f"a measure's better must be 'higher', 'lower' or None, got {better!r}")

    def make_measure(function: Function) -> Measure:
        """The measure of a function, which needs a wanted wall where it takes a second argument."""
        lines = (function.__doc__ or function.__name__.replace("_", " ")).strip().splitlines()
        measure_title = title or lines[0].rstrip(".")
        of_wall = len(signature(function).parameters) > 1
        return Measure(
            function.__name__,
            measure_title,
            unit,
            better,
            source or "your own",
            function,
            each,
            along,
            of_wall=of_wall,
        )

    return make_measure


def load_measures(path: str) -> dict[str, Measure]:
    """Run a user's file and return its measures by name.

    Raises  ValueError  with one sentence: a missing file, one that does not run, one without a measure, a name
            that is taken
    """
    file = Path(path)
    if not file.is_file():
        raise ValueError(f"{path} is not an ordinary file" if file.exists() else f"no such file: {path}")
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{file.name}: cannot be read: {error}") from None
    measures = _measures(str(file.resolve()), text)
    if not measures:
        raise ValueError(
            f"{file.name} has no measure; put @measure(unit=...) above a function of one operating point"
        )
    taken = sorted(MEASURES.keys() & measures.keys())
    if taken:
        raise ValueError(f"{file.name}: the name {taken[0]} is taken by a measure of zwidth; rename the function")
    return {
        name: replace(one, function=FileFunction(str(file.resolve()), text, name), source=f"your own, {file.name}")
        for name, one in measures.items()
    }


def _unpickled(file: str, text: bytes, name: str) -> FileFunction:
    """The function of a file by its path, compressed content and name."""
    return FileFunction(file, decompress(text).decode(), name)


@lru_cache(maxsize=8)
def _measures(file: str, text: str) -> dict[str, Measure]:
    """The measures of a file with this content, which is run once in each process."""
    module = _run_as_module(Path(file), text)
    return {one.name: one for one in vars(module).values() if isinstance(one, Measure) and callable(one.function)}


def _run_as_module(file: Path, text: str) -> ModuleType:
    """Run a user's file with this content as a module. Raises ValueError that names the line at which it fails."""
    label = f"zwidth_measures_{sha256((str(file) + text).encode()).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(label, file)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[label] = module  # dataclasses look a function's module up
    try:
        with redirect_stdout(sys.stderr):
            exec(compile(text, str(file), "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[label]
        line = error.lineno if isinstance(error, SyntaxError) else _failing_line(error, file)
        place = f"{file.name}:{line}" if line else file.name
        reason = error.msg if isinstance(error, SyntaxError) else f"{type(error).__name__}: {error}"
        raise ValueError(f"{place} does not run: {reason}") from None
    return module


def _failing_line(error: BaseException, file: Path) -> int:
    """The last line of that file in an error's traceback; 0 for none."""
    line, frame = 0, error.__traceback__
    while frame is not None:
        if frame.tb_frame.f_code.co_filename == str(file):
            line = frame.tb_lineno
        frame = frame.tb_next
    return line
