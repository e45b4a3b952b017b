"""Errors: every kind that zwidth raises, below one root, `ZwidthError`.

A message says what is wrong, where, which value, what is allowed, and what to type instead. Where an argument is
part of it, the error holds the parts, so that a surface can spell the argument its own way (`Spelling`): as in
Python, as an option of the command line, as a key of a file. Those about what was asked are ValueErrors, too.

    what was given        DeviceError, ArgumentError, RangeError, FileError, WorkspaceError, LoadError,
                          OperatorError, ModelError, ResponseError, OperatingPointError, MeasureError,
                          ProcessorError, TooLarge
    what has no answer    NoAnswerError, NoValueError, PostureError, EquilibriumError, ChartError, UnmovedError,
                          HysteresisError, NonlinearError, HandleError
    long runs and files   StoreError, OutputError, ClusterError, WorkerLost, CannotStart, OutOfTime
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from zwidth.arrays import Floats
    from zwidth.device.faults import Fault
    from zwidth.study.robust.family import RangeFault

Spelling = Callable[[str, str | None], str]  # an argument's name in Python, and its value or None -> its spelling


def as_argument(name: str, value: str | None) -> str:
    """An argument as Python spells it.

    >>> as_argument("stiffness", None), as_argument("model", "rigid")
    ('stiffness', "model='rigid'")
    """
    return name if value is None else f"{name}={value!r}"


@dataclass(frozen=True)
class Advice:
    """What to type instead, about one argument.

    text   the advice, with {} in place of the argument
    name   the argument's name in Python
    value  the value that it should have; None: any
    """

    text: str
    name: str
    value: str | None = None

    def spelled(self, spelling: Spelling = as_argument) -> str:
        """The advice, with the argument spelled by `spelling`: as in Python, as an option, or as a key of a file.

        >>> Advice("ask for {}", "axes", "xy").spelled()
        "ask for axes='xy'"
        """
        return self.text.format(spelling(self.name, self.value))


class ZwidthError(Exception):
    """What zwidth raises where a question cannot be answered as it was asked."""


class DeviceError(ZwidthError, ValueError):
    """A device cannot be made from what was given; `faults` says everything that is wrong with it."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults: list[Fault] = list(dict.fromkeys(faults))
        super().__init__("\n".join(map(str, self.faults)))

    def __reduce__(self) -> tuple[type[DeviceError], tuple[list[Fault]]]:
        return type(self), (self.faults,)


class RangeError(ZwidthError, ValueError):
    """Ranges that cannot be used; `faults` holds everything that is wrong with them."""

    def __init__(self, faults: Iterable[RangeFault]) -> None:
        self.faults = tuple(dict.fromkeys(faults))
        super().__init__("\n".join(map(str, self.faults)))

    def __reduce__(self) -> tuple[type[RangeError], tuple[tuple[RangeFault, ...]]]:
        return type(self), (self.faults,)


class ArgumentError(ZwidthError, ValueError):
    """An argument that cannot be meant.

    argument  its name; "" where it is the device, or several arguments together
    reasons   what is wrong with it, each a fault of its own: the value, what is allowed, what to do
    missing   the argument that is to be given with it; None: none

    >>> str(ArgumentError("tremor", "needs an arm, and nobody holds the device", missing="operator"))
    'tremor needs an arm, and nobody holds the device; give operator'
    >>> str(ArgumentError("environment", "'slime' is none; write slot"))
    "environment: 'slime' is none; write slot"
    """

    def __init__(self, argument: str, *reasons: str, missing: str | None = None) -> None:
        super().__init__(argument, *reasons)
        self.argument, self.reasons, self.missing = argument, reasons, missing

    def __str__(self) -> str:
        advice = "" if self.missing is None else f"; give {self.missing}"
        return "\n".join(f"{_subject(self.argument, reason)}{reason}{advice}" for reason in self.reasons)


def _subject(argument: str, reason: str) -> str:
    """What stands before a reason: the argument, with a colon unless the reason begins with a verb; "" without."""
    verbs = ("must ", "is ", "needs ", "does ", "lies ", "differ ")
    return f"{argument}{' ' if reason.startswith(verbs) else ': '}" if argument else ""


class FileError(ZwidthError, ValueError):
    """A file that is not read.

    lines    why not, one fault each; without the file's name where it says nothing of a line
    missing  whether there is no such file
    """

    def __init__(self, *lines: str, missing: bool = False) -> None:
        super().__init__(*lines)
        self.lines, self.missing = lines, missing

    def __str__(self) -> str:
        return "\n".join(self.lines)


class WorkspaceError(ZwidthError, ValueError):
    """A plane, or a table of cells, over which nothing can be computed, and what can be reached.

    reason  what is wrong
    advice  what to ask for instead; None where the reason says it
    """

    def __init__(self, reason: str, advice: Advice | None = None) -> None:
        super().__init__(reason, advice)
        self.reason, self.advice = reason, advice

    def __str__(self) -> str:
        return self.spelled(as_argument)

    def spelled(self, spelling: Spelling) -> str:
        """The message, with arguments spelled as in Python, as options or as keys of a file."""
        return self.reason if self.advice is None else f"{self.reason}; {self.advice.spelled(spelling)}"


class ProcessorError(ZwidthError, ValueError):
    """This computer cannot compute on a GPU.

    reason  what is missing
    advice  what would help; "": another computer
    """

    def __init__(self, reason: str, advice: str = "") -> None:
        super().__init__(reason, advice)
        self.reason, self.advice = reason, advice

    def __str__(self) -> str:
        return self.spelled(as_argument)

    def spelled(self, spelling: Spelling) -> str:
        """The message, with the argument spelled as in Python or as an option.

        >>> str(ProcessorError("needs a GPU"))
        "processor='cuda' needs a GPU; leave processor out to compute without one"
        """
        instead = f"leave {spelling('processor', None)} out to compute without one"
        advice = f"{self.advice}, or {instead}" if self.advice else instead
        return f"{spelling('processor', 'cuda')} {self.reason}; {advice}"


class TooLarge(ZwidthError, ValueError):
    """A result that would not fit into memory."""


# --- devices and operating points --------------------------------------------------------------------


class PostureError(ZwidthError, ValueError):
    """The mechanism has no posture that answers the question."""


class OutOfReach(PostureError):
    """The handle cannot get there in this assembly without passing a singularity.

    nearest  (3,)  a position that is answered [m], found by descent from the requested one and not shown to be the
             nearest; None where none is known, or the drives control its orientation
    """

    def __init__(self, message: str, nearest: Floats | None = None) -> None:
        super().__init__(message)
        self.nearest = nearest


class Singular(PostureError):
    """At this position the drives lose, or do not have, control of the handle."""


class BeyondLimit(PostureError):
    """In the posture a joint is beyond its limit."""


class LoopOpen(PostureError):
    """A loop of the mechanism cannot be closed near the assembly's joint angles."""


class BeamError(ZwidthError, ValueError):
    """A beam that its link cannot be.

    link  its name;   key  of its table that is wrong: "mass_kg", "inertia_kg_m2" or "beam.modes"
    """

    def __init__(self, link: str, key: str, message: str) -> None:
        super().__init__(message)
        self.link, self.key = link, key


class OperatorError(ZwidthError, ValueError):
    """An operator, or an arm, that cannot hold this device."""


class ModelError(ZwidthError, ValueError):
    """The chosen model, or a force sensor, does not apply to this device or this direction."""


class DirectionError(ModelError):
    """The handle cannot move along the direction, so that no model renders it."""


class FeedbackError(ModelError):
    """An answer is not known with the feedback that a computer adds to the wall law."""


class ResponseError(ZwidthError, ValueError):
    """A measured response that no chart can be made from; the text says why and what to do."""


class LoadError(ZwidthError, ValueError):
    """A load that cannot be meant."""


class EquilibriumError(LoadError):
    """There is no equilibrium under a load, or none that the device holds."""


class SidewaysForceError(EquilibriumError):
    """The load has another part across the rendered direction than the posture needs, which no wall holds."""


class OperatingPointError(ZwidthError, ValueError):
    """An operating point does not have the requested quantity; the message names what to use instead."""


class NoMechanismError(OperatingPointError):
    """The question is about a mechanism, and the device is given by its plant or a measured response."""

    def __init__(self) -> None:
        super().__init__("the device has no mechanism, and so neither postures nor directions")


class MissingNumbersError(OperatingPointError):
    """The answer needs numbers that the device file leaves out as not known.

    keys  their dotted paths
    """

    def __init__(self, keys: Sequence[str]) -> None:
        self.keys = tuple(keys)
        shown = ", ".join(keys[:4]) + (f" and {len(keys) - 4} more" if len(keys) > 4 else "")
        super().__init__(f"needs {shown}, which the device file does not give")


class SeveralDirectionsError(OperatingPointError):
    """The device has something that several directions rendered together cannot include.

    obstacles  its names: "an operator", "an encoder on the link", "electrical damping"
    """

    def __init__(self, obstacles: Sequence[str]) -> None:
        self.obstacles = tuple(obstacles)
        super().__init__(
            f"not supported over several directions: {' and '.join(obstacles)}; render one direction instead"
        )


# --- loops, charts and measures ----------------------------------------------------------------------


class UnmovedError(ZwidthError, ValueError):
    """A plant of which the wall moves nothing that the sensor reads."""


class UnresolvedError(UnmovedError):
    """A plant of which the wall moves so little that the sensor reads that rounding hides it."""


class HysteresisError(ZwidthError, ValueError):
    """A plant with a loss factor, which describes steady vibration and not motion in time."""


class NonlinearError(ZwidthError, ValueError):
    """A velocity estimate that is not linear has no transfer function w(z).

    estimate  its name, such as "Levant's differentiator"
    """

    def __init__(self, estimate: str) -> None:
        self.estimate = estimate
        super().__init__(
            f"{estimate} is not linear: it has no chart; simulate it, measure its boundary, or for the chart of "
            "another estimate set loop.velocity.method to backward-difference"
        )

    def __reduce__(self) -> tuple[type[NonlinearError], tuple[str]]:
        """How pickle rebuilds the error in another process: from the estimate's name."""
        return type(self), (self.estimate,)


class HandleError(ZwidthError, ValueError):
    """The plant has no handle at which an impedance could be felt."""


class ChartError(ZwidthError, RuntimeError):
    """The edge of the stable set could not be closed."""


class MeasureError(ZwidthError, ValueError):
    """A measure that this device does not have in any posture; the text follows the measure's name.

    reason        why not
    arguments     what to give instead: name and value of each, None for any value
    alternatives  whether one of the arguments is enough
    """

    def __init__(
        self, reason: str, arguments: Sequence[tuple[str, str | None]] = (), alternatives: bool = False
    ) -> None:
        super().__init__(reason, arguments, alternatives)
        self.reason, self.arguments, self.alternatives = reason, tuple(arguments), alternatives

    def __str__(self) -> str:
        return self.spelled(as_argument)

    def spelled(self, spelling: Spelling) -> str:
        """The message, with arguments spelled as in Python, as options or as keys of a file.

        >>> MeasureError("needs a wanted wall", [("stiffness", None), ("damping", None)]).spelled(as_argument)
        'needs a wanted wall; give stiffness and damping'
        """
        if not self.arguments:
            return self.reason
        joined = " or " if self.alternatives else " and "
        return f"{self.reason}; give {joined.join(spelling(*argument) for argument in self.arguments)}"

    def with_name(self, measure: str) -> MeasureError:
        """The same error with the measure's name before its text."""
        return MeasureError(f"{measure} {self.reason}", self.arguments, self.alternatives)


class MissingMeasures(MeasureError):
    """Measures that exist for no design of a study.

    refused  column -> why
    """

    def __init__(self, refused: dict[str, str]) -> None:
        super().__init__("\n".join(f"{name} {why}" for name, why in refused.items()))
        self.refused = refused


class NoValueError(ZwidthError, ValueError):
    """A measure has no value at this operating point; the text says why."""


class NoAnswerError(ZwidthError, ValueError):
    """The question is understood and has no answer; the text says why.

    decided  False where there is an answer that double precision does not give
    """

    def __init__(self, reason: str, *, decided: bool = True) -> None:
        super().__init__(reason)
        self.decided = decided


# --- long runs, and files that are written -----------------------------------------------------------


class OutputError(ZwidthError):
    """A file, or standard output, cannot be written; the text says which, why, and what to do."""


class StoreError(ZwidthError, ValueError):
    """A store or a journal that cannot be used; the text says why, and what to do.

    whose  of a folder with finished work of another question or release, which is left as it is: whose it is
    """

    def __init__(self, reason: str, whose: str | None = None) -> None:
        super().__init__(reason)
        self.whose = whose


class ClusterError(ZwidthError, RuntimeError):
    """A cluster that cannot be used; the text says why, and what to do."""


class ClusterEnded(ClusterError):
    """A cluster that ended before all was done."""


class WorkerLost(ZwidthError, RuntimeError):
    """A worker process ended before its task was done: killed, or out of memory."""


class OutOfTime(ZwidthError, RuntimeError):
    """Cells took longer than their time limit; the process that computed them was ended."""


class CannotStart(ZwidthError, RuntimeError):
    """A worker process does not get as far as computing its first task."""
