"""The advice that ends an error message, with arguments spelled as in Python, as options or as keys of a file."""

from __future__ import annotations

from dataclasses import dataclass

from zwidth.measures.definition import Spelling, as_argument


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


class AdvisedError(ValueError):
    """An error that may end in advice.

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
