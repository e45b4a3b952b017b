"""What the errors of a computation mean to those who asked: no answer, or bad input."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from zwidth.show.cli.errors import BadInput

if TYPE_CHECKING:
    from zwidth.show.cli.options import Question


class NoAnswer(Exception):
    """The question was understood and has no answer; the text says why.

    decided  False where there is an answer that double precision does not give
    """

    def __init__(self, reason: str, *, decided: bool = True) -> None:
        super().__init__(reason)
        self.decided = decided


@contextmanager
def computing(question: Question) -> Iterator[None]:
    """Compute inside this block.

    Raises  NoAnswer  where the posture does not exist, or double precision cannot decide
            BadInput  where the model, or the loop, does not fit the device
    """
    from zwidth.chart.arc_joining import ChartError
    from zwidth.loop.estimator import NonlinearError
    from zwidth.loop.sections import HysteresisError, UnmovedError
    from zwidth.model.posture import PostureError
    from zwidth.model.reduction import DirectionError, ModelError
    from zwidth.model.response import ResponseError

    try:
        yield
    except PostureError as error:
        raise NoAnswer(str(error)) from None
    except ChartError as error:
        raise NoAnswer(f"this is undecided: {error}", decided=False) from None
    except DirectionError as error:
        raise BadInput(f"{question.name}: direction: {error}") from None
    except ModelError as error:
        model = f"model {question.model}: " if question.model else ""
        raise BadInput(f"{question.name}: {model}{error}") from None
    except ResponseError as error:
        raise BadInput(f"{question.name}: response: {error}") from None
    except NonlinearError as error:
        raise BadInput(
            f"{question.name}: {error.estimate} is not linear: it has no chart; ask zwidth simulate or zwidth "
            "experiment, or chart another estimate with --set loop.velocity.method=backward-difference"
        ) from None
    except (UnmovedError, HysteresisError) as error:
        raise BadInput(f"{question.name}: {error}") from None
