"""Virtual environments: a small compiled function with named parameters.

Functions that a compiled kernel calls without knowing them: the kernel takes an address, the caller compiles.

One kernel, compiled once and cached on disk, then serves every virtual environment, a user's own too. Handing the
function itself over would compile the kernel anew for each (a kernel's type names the function).
"""

from __future__ import annotations

import dis
import inspect
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from math import inf, isfinite, isnan, nan
from pathlib import Path
from typing import Any, Final

import numba
import numpy as np
from numba.core import cgutils, config
from numba.extending import intrinsic

from zwidth import _verbs
from zwidth.arrays import Floats
from zwidth.compiled import compiled_for
from zwidth.unit_text import unit_text

PLAIN_FUNCTIONS: Final[dict[int, Any]] = {}
"""Functions by what stands for their addresses where nothing is compiled (NUMBA_DISABLE_JIT)."""


def address_of(dispatcher: Any) -> int:
    """Where the machine code of a function compiled by `compiled_for` begins, for `function_at`.

    Without compilation a number that stands for the function in PLAIN_FUNCTIONS.
    """
    if config.DISABLE_JIT:
        PLAIN_FUNCTIONS[id(dispatcher)] = dispatcher
        return id(dispatcher)
    (result,) = dispatcher.overloads.values()
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def function_at(signature: Any) -> Any:
    """For use inside kernels: a function that turns an address (int64) into a callable of the signature.

        environment_at = function_at(signature)             # at the module's level

        @compiled
        def kernel(address, ...):
            force = environment_at(address)
            ... force(position, velocity, ...)

    The address is a plain number, so that the kernel's type does not depend on the function and its machine code
    is found on disk whichever function is called; arrays of addresses and `prange` are fine. An address that is
    not of `address_of` with the same signature ends the process.
    """
    if config.DISABLE_JIT:
        return PLAIN_FUNCTIONS.__getitem__
    kind = numba.types.FunctionType(signature)
    proxy: Any = cgutils.create_struct_proxy

    # the call's type, and what writes its machine code: a function structure around the address
    @intrinsic  # type: ignore[untyped-decorator]
    def at(typing_context: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
            structure = proxy(kind)(context, builder)
            structure.jit_addr = builder.inttoptr(arguments[0], context.get_value_type(numba.types.voidptr))
            return structure._getvalue()

        return kind(numba.types.int64), generate

    return at


ForceLaw = Callable[[float, float, float, float, Floats, Floats], float]

MEMORY: Final = 8
ARGUMENTS: Final = ("position", "velocity", "time", "period", "parameters", "memory")
_NUMBERS = numba.float64[::1]
SIGNATURE: Final = numba.float64(*[numba.float64] * 4, _NUMBERS, _NUMBERS)

environment_at = function_at(SIGNATURE)
"""In kernels: the force law that begins at `Environment.address`."""


@dataclass(frozen=True)
class Parameter:
    """One number of an environment.

    name     as it is given;   unit  for people, "" without
    default  nan: it must be given
    low, high  smallest and largest allowed; inf itself is allowed where `endless`
    switch   1 for yes, 0 for no
    meaning  for people
    """

    name: str
    unit: str = ""
    default: float = nan
    low: float = -inf
    high: float = inf
    meaning: str = ""
    endless: bool = False
    switch: bool = False

    @property
    def allowed(self) -> str:
        """The allowed values in words: "from 0 on", "from 1 to 3", "any number", "0 or 1"."""
        if self.switch:
            return "0 or 1"
        last = ", or inf" if self.endless else ""
        if self.low == -inf and self.high == inf:
            return "any number" + last
        if self.high == inf:
            return f"from {self.low:g} on" + last
        if self.low == -inf:
            return f"up to {self.high:g}"
        return f"from {self.low:g} to {self.high:g}"

    def allows(self, value: float) -> bool:
        """Whether the value is allowed."""
        if self.switch:
            return value in (0.0, 1.0)
        return (isfinite(value) or (self.endless and value == inf)) and self.low <= value <= self.high


@dataclass(frozen=True)
class Environment:
    """A virtual environment.

    name         for people
    function     (position, velocity, time, period, parameters, memory) -> force ON the device along +y [N]. The
                 wall is at position 0, positive positions are inside [m]; velocity is the estimate [m/s]; time
                 and period [s]; parameters (as many as declared), memory (8,), zeros at the start. Called once
                 for each sample.
    parameters   in the order in which the function has them
    description  one sentence
    source       what `load_environment` finds it by; "": it cannot be sent to other processes
    linear       force proportional to position and velocity everywhere: no limit cycle comes from it
    surface      there is a surface to touch: a device that is not held against it can lose contact, and bounce
    """

    name: str
    function: ForceLaw = field(repr=False)
    parameters: tuple[Parameter, ...] = ()
    description: str = ""
    source: str = field(default="", repr=False, compare=False)
    linear: bool = False
    surface: bool = False

    def __post_init__(self) -> None:
        """Take over the docstring and the module of the function."""
        # help() and doctest see the function through these
        for name in ("__doc__", "__module__"):
            object.__setattr__(self, name, getattr(self.function, name))
        object.__setattr__(self, "__wrapped__", self.function)

    @cached_property
    def force(self) -> Any:
        """The function compiled; that happens on first use, and later processes find the machine code on disk.

        Raises  ValueError  where numba cannot compile it, with its reason in one sentence
        """
        try:
            return compiled_for(SIGNATURE, self.function)
        except Exception as error:  # numba lets those of Python through, such as AttributeError
            raise ValueError(f"{self.where}: {self.name} does not compile: {shortened(str(error))}") from None

    @cached_property
    def address(self) -> int:
        """Where its machine code begins, for `environment_at`; keep the environment as long as this is in use."""
        return address_of(self.force)

    @property
    def where(self) -> str:
        """File and line of the function."""
        code = self.function.__code__
        return f"{Path(code.co_filename).name}:{code.co_firstlineno}"

    def values(self, **given: float) -> Floats:
        """Parameters as the function takes them, the defaults for those not given.

        Raises  ValueError  for an unknown name (with the nearest), a missing or not allowed value; all at once
        """
        faults = [self._unknown_message(name) for name in given if name not in self.names]
        numbers = []
        for parameter in self.parameters:
            value = given.get(parameter.name, parameter.default)
            faults += self._faults(parameter, value)
            numbers.append(value)
        if faults:
            raise ValueError("\n".join(faults))
        return np.array(numbers, dtype=np.float64)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    def _unknown_message(self, name: str) -> str:
        """Message: the environment has no parameter of this name; with the nearest."""
        near = get_close_matches(name, self.names, n=1)
        hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(self.names) or 'none'}"
        return f"{self.name} has no parameter {name}; {hint}"

    def _faults(self, parameter: Parameter, value: object) -> list[str]:
        """Messages, one or none: a parameter's value is no number, missing or not allowed."""
        unit = f" [{unit_text(parameter.unit)}]" if parameter.unit else ""
        what = f"{parameter.name} of {self.name}"
        if not isinstance(value, (int, float, np.integer, np.floating, np.bool_)):
            return [f"{what} must be a number{unit}, got {value!r}"]
        if isnan(value):
            return [f"{what} is missing: a number{unit}, {parameter.allowed}"]
        if not parameter.allows(float(value)):
            return [f"{what} must be {parameter.allowed}{unit}, got {float(value):g}"]
        return []

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle as the source by which another process finds it. Raises TypeError where it has none."""
        if not self.source:
            raise TypeError(f"{self.name} cannot be sent to another process: it is in no file of its own")
        return _verbs.environment_named, (self.source,)


def environment(
    parameters: Sequence[Parameter] = (),
    *,
    name: str | None = None,
    linear: bool = False,
    surface: bool = False,
) -> Callable[[ForceLaw], Environment]:
    """Make a virtual environment of a small function (see `Environment`).

    parameters  what its `parameters` holds, in that order
    name        for people; None: the function's, with spaces
    linear, surface  see `Environment`
    Raises      ValueError  for a function that does not take the six arguments, or that raises errors itself
                (kernels run on several cores and could not pass them on); for two parameters of one name or a
                bad default

    >>> @environment([Parameter("stiffness", "N/m", 500.0, low=0.0)])
    ... def spring(position, velocity, time, period, parameters, memory):
    ...     "A spring to both sides."
    ...     return -parameters[0] * position
    >>> spring.values(stiffness=200)
    array([200.])
    >>> float(spring.function(0.01, 0.0, 0.0, 1e-3, spring.values(), None))
    -5.0
    """

    def decorate(function: ForceLaw) -> Environment:
        """Make the environment of a function, once both it and the parameters are checked."""
        _check_function(function)
        description = (inspect.getdoc(function) or "").split("\n")[0]
        title = name or function.__name__.replace("_", " ")
        made = Environment(title, function, tuple(parameters), description, _source(function), linear, surface)
        _check_parameters(made)
        return made

    return decorate


def _source(function: ForceLaw) -> str:
    """Name of a bundled function, "file:name" of a user's; "" for one that is in no file."""
    file = Path(function.__code__.co_filename)
    if (function.__module__ or "").startswith(f"{__package__}."):
        return function.__name__
    return f"{file.resolve()}:{function.__name__}" if file.is_file() else ""


def _check_function(function: ForceLaw) -> None:
    """Raise ValueError for a function that does not take the six arguments, or that raises errors itself."""
    code = function.__code__
    where = f"{Path(code.co_filename).name}:{code.co_firstlineno}: {function.__name__}"
    kinds = {inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD}
    arguments = inspect.signature(function).parameters
    if len(arguments) != len(ARGUMENTS) or any(argument.kind not in kinds for argument in arguments.values()):
        raise ValueError(f"{where} must take ({', '.join(ARGUMENTS)}), it takes ({', '.join(arguments)})")
    if any(step.opname == "RAISE_VARARGS" for step in dis.get_instructions(code)):
        raise ValueError(f"{where} has a raise or an assert; return nan instead, the run then ends")


def _check_parameters(made: Environment) -> None:
    """Raise ValueError for two parameters of one name, or a default that is not allowed."""
    twice = {name for name in made.names if made.names.count(name) > 1}
    if twice:
        raise ValueError(f"{made.where}: {made.name} has two parameters named {twice.pop()}")
    for parameter in made.parameters:
        if not isnan(parameter.default) and not parameter.allows(parameter.default):
            raise ValueError(
                f"{made.where}: default of {parameter.name} must be {parameter.allowed}, got {parameter.default:g}"
            )


def shortened(message: str) -> str:
    """Numba's report as one sentence: its first reason, and the line of the source that it points at."""
    lines = [line.strip() for line in message.splitlines()]
    unhelpful = ("Failed in ", "No implementation of function", "There are ", "Overload ", "During", "This error")
    reasons = [line for line in lines if line and not line.startswith(unhelpful) and line[0] not in ">-^[<"]
    pointed = next((line for line in lines if line.startswith("File ")), "")
    reason = next((line for line in reasons if not line.startswith("File ")), "no reason was given")
    place = pointed.replace('"', "").rstrip(":").split(", ")[-1] if pointed else ""
    reason = re.sub(r", defined at .*$", "", reason)
    return reason.rstrip(".:") + (f" ({place})" if place else "")
