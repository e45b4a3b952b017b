"""What somebody who asked for the impossible can ask for instead, in the words in which he asks."""

from __future__ import annotations

from dataclasses import dataclass

from zwidth.measures.definition import Spelling, as_argument


@dataclass(frozen=True)
class Advice:
    """What to do instead, about one argument.

    text   with {} where the argument stands
    name   of the argument, as Python has it
    value  that it should have; None: any
    """

    text: str
    name: str
    value: str | None = None

    def spelled(self, spelling: Spelling = as_argument) -> str:
        """The advice, with the argument spelled as the asker gives it: in Python, as an option, as a file's key.

        >>> Advice("ask for {}", "axes", "xy").spelled()
        "ask for axes='xy'"
        """
        return self.text.format(spelling(self.name, self.value))
