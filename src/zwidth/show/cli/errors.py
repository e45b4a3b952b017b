"""Messages of a command that fails: one line per fault, and an exit code."""

from __future__ import annotations

import os
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from zwidth import errors
from zwidth.device.faults import SETTINGS, Fault
from zwidth.show.cli.progress import BAD_INPUT, INTERNAL, INTERRUPTED
from zwidth.show.output import printable

if TYPE_CHECKING:
    from zwidth.show.cli.options import Question

DEBUG = "ZWIDTH_DEBUG"


class BadInput(errors.ZwidthError):
    """The command line is not valid; each line is one fault."""

    def __init__(self, *lines: str) -> None:
        self.lines = lines
        super().__init__("\n".join(lines))


class UnfinishedRun(errors.ZwidthError):
    """A run that could not be finished although its input is valid; the text says why."""


@contextmanager
def translate_errors(question: Question) -> Iterator[None]:
    """Turn errors of a computation inside this block into messages about the question as it was typed.

    Raises  NoAnswerError  where posture or equilibrium does not exist, numbers are missing, or double precision
                           cannot decide
            BadInput       for arguments, or a load, direction, model, response or loop, that do not fit the device
    """

    try:
        yield
    except errors.ArgumentError as error:
        option = f"{as_option(error.argument)}: " if error.argument else f"{question.name}: "
        raise BadInput(*(f"{option}{reason}" for reason in error.reasons)) from None
    except errors.SidewaysForceError as error:  # an EquilibriumError that another load mends
        raise BadInput(f"{question.name}: load: {error}") from None
    except (errors.PostureError, errors.EquilibriumError) as error:
        raise errors.NoAnswerError(str(error)) from None
    except errors.LoadError as error:
        raise BadInput(f"{question.name}: load: {error}") from None
    except errors.MissingNumbersError as error:
        raise errors.NoAnswerError(f"this {error}") from None
    except errors.ChartError as error:
        raise errors.NoAnswerError(f"this is undecided: {error}", decided=False) from None
    except errors.DirectionError as error:
        raise BadInput(f"{question.name}: direction: {error}") from None
    except errors.ModelError as error:
        model = f"model {question.model}: " if question.model else ""
        raise BadInput(f"{question.name}: {model}{error}") from None
    except errors.ResponseError as error:
        raise BadInput(f"{question.name}: response: {error}") from None
    except errors.NonlinearError as error:
        raise BadInput(
            f"{question.name}: {error.estimate} is not linear, so it has no chart; use zwidth simulate or zwidth "
            "experiment, or another estimate with --set loop.velocity.method=backward-difference"
        ) from None
    except (errors.UnmovedError, errors.HysteresisError, errors.OperatorError) as error:
        raise BadInput(f"{question.name}: {error}") from None


def explain(error: Exception) -> tuple[list[str], int]:
    """The lines for standard error, and the exit code, of any error that a command raises."""
    match error:
        case errors.DeviceError():
            return [str(_as_set_option(fault)) for fault in error.faults], BAD_INPUT
        case BadInput() | errors.FileError():
            return [printable(line) for line in error.lines], BAD_INPUT
        case errors.ProcessorError():
            return [error.spelled(as_option)], BAD_INPUT
        case UnfinishedRun():
            return [f"zwidth: {error}"], INTERNAL
        case errors.OutputError():
            return [str(error)], BAD_INPUT
        case click.Abort():
            return ["zwidth: interrupted"], INTERRUPTED
        case click.ClickException():
            return [_usage_line(error)], BAD_INPUT
        # of writing to a stream: an error of a file has its name
        case OSError() if not os.environ.get(DEBUG) and error.filename is None:
            return [f"zwidth: standard output cannot be written: {error.strerror or error}"], BAD_INPUT
        case _:
            return _internal_error_lines(error), INTERNAL


def _as_set_option(fault: Fault) -> Fault:
    """The fault; one of the settings as a fault of the option --set, which gives them."""
    return replace(fault, file="--set") if fault.file == SETTINGS else fault


def _usage_line(error: click.ClickException) -> str:
    """A usage error on one line, with the command it happened in and the way to its help."""
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "zwidth"
    text = printable(" ".join(error.format_message().split())).rstrip(".")
    mark = "" if text.endswith("?") else ";"
    return f"{command}: {text[:1].lower() + text[1:]}{mark} `{command} --help` shows what is allowed"


def _internal_error_lines(error: Exception) -> list[str]:
    """Lines on an error of zwidth itself: what it is and to report it; with ZWIDTH_DEBUG the traceback."""
    if os.environ.get(DEBUG):
        return traceback.format_exception(error)
    text = printable(" ".join(str(error).split()))[:300]
    return [
        f"zwidth: an error in zwidth itself ({type(error).__name__}: {text}); please report it with the "
        f"command and the device file ({DEBUG}=1 shows the traceback)"
    ]


def as_option(name: str, value: str | None = None) -> str:
    """An argument as the command line spells it.

    >>> as_option("start_velocity"), as_option("model", "rigid")
    ('--start-velocity', '--model rigid')
    """
    option = f"--{name.replace('_', '-')}"
    return option if value is None else f"{option} {value}"
