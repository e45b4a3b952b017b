"""What is wrong with a device file, as data: every fault is reported, each on one line."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Final

from zwidth.errors import DeviceError

KeyPath = tuple[str | int, ...]
KeyMessages = Iterator[tuple[KeyPath, str]]

LONGEST_QUOTE: Final = 60
MISSPELT: Final = 0.85  # likeness from which a word is another one misspelt
NOT_CONTAINED: Final = 3  # rank of a word that neither begins nor ends with the one typed
# What a key that ends in a unit has behind its name, in small letters.
UNIT_ENDING: Final = re.compile(r"(?:_(?:per|kg|[mnswavj]|m2|nm|ns|nms|hz|rad|ohm|rev|deg|samples|percent))+")


SETTINGS: Final = "settings"  # what stands for a file in messages about settings


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong.

    file     the file (or bundled name, or option) it stands in
    key      dotted path of the key, "" for the whole file
    message  what is wrong, the value, what is allowed, what to do
    """

    file: str
    key: str
    message: str

    def __str__(self) -> str:
        return ": ".join(one_line(part) for part in (self.file, self.key, self.message) if part)


def fail(file: str, key: str, message: str) -> DeviceError:
    """The error for a single fault, to be raised by the caller."""
    return DeviceError([Fault(file, key, message)])


def one_line(text: str) -> str:
    """The text with line breaks and control characters made visible, so that a fault stays on its line."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def quote(value: Any) -> str:
    """A value in the words of a message, shortened: the text 'a', 0.3, true, the list [1, 2], a table.

    Of a whole number from 10^15 on its size only.

    >>> quote(2**53), quote(-(10**20))
    ('a whole number above 10^15', 'a whole number below -10^20')
    """
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return f"the text {_shortened(value)!r}"
        case int() if abs(value) >= 10**15:
            power = int(abs(value).bit_length() * math.log10(2))  # of 10; or one more than the number has
            power -= 10**power > abs(value)
            return f"a whole number {'above ' if value > 0 else 'below -'}10^{power}"
        case float():
            return f"{value:.10g}"
        case dict():
            return "a table"
        case list() | tuple():
            return f"the list {_shortened('[' + ', '.join(_item_text(v) for v in value[:20]) + ']')}"
        case _:
            return _shortened(str(value))


def nearest(word: str, allowed: Collection[str]) -> str | None:
    """The allowed word that is most likely meant by this one, None if none is; case and -/_ do not count.

    First one that is hardly misspelt, then this one with a unit, one that ends with it, one that begins with it,
    and last the one that looks most like it.

    >>> nearest("damping", ["damping_Ns_per_m", "spring"]), nearest("ratio", ["ratio_table", "transmission_ratio"])
    ('damping_Ns_per_m', 'transmission_ratio')
    """
    plain, typed = {_plain(candidate): candidate for candidate in allowed}, _plain(word)

    def rank(candidate: str) -> tuple[int, int]:
        """Sort key of a key that may have been meant: least for the typed word with a unit after it."""
        if candidate.startswith(typed + "_"):
            return 0 if UNIT_ENDING.fullmatch(candidate, len(typed)) else 2, len(candidate)
        return 1 if candidate.endswith("_" + typed) else NOT_CONTAINED, len(candidate)

    close = get_close_matches(typed, plain, n=1, cutoff=MISSPELT)
    if not close and len(typed) > 2:
        close = [one for one in sorted(plain, key=rank)[:1] if rank(one)[0] < NOT_CONTAINED]
    close = close or get_close_matches(typed, plain, n=1, cutoff=0.6)
    return plain[close[0]] if close else None


def suggestion(word: str, allowed: Collection[str], noun: str = "allowed") -> str:
    """'did you mean "x"?' or else the list of what is allowed, which is called `noun`."""
    near = nearest(word, allowed)
    if near is not None:
        return f"did you mean '{near}'?"
    return f"{noun}: {comma_list(sorted(allowed))}" if allowed else "nothing is allowed here"


def plural(count: int, one: str, many: str = "") -> str:
    """A number and its noun: "1 row", "2 rows"."""
    return f"{count} {one if count == 1 else many or one + 's'}"


def comma_list(words: Sequence[str], most: int = 30) -> str:
    """The words separated by commas, shortened."""
    return ", ".join(words[:most]) + (", ..." if len(words) > most else "")


def dotted(path: KeyPath, document: Any = None) -> str:
    """The path as users write it; list elements go by their name where the document gives one."""
    parts = []
    for part in path:
        inside = _value_at(document, part)
        name = inside.get("name") if isinstance(part, int) and isinstance(inside, dict) else None
        parts.append(name if isinstance(name, str) and name else str(part))
        document = inside
    return ".".join(parts)


def _value_at(document: Any, part: str | int) -> Any:
    """The value at a key or index of a document; None where there is none."""
    if isinstance(document, dict):
        return document.get(part)
    if isinstance(document, list) and isinstance(part, int) and 0 <= part < len(document):
        return document[part]
    return None


def _plain(word: str) -> str:
    """A word as it is compared: in small letters, with _ for -."""
    return word.lower().replace("-", "_")


def _shortened(text: str) -> str:
    """A text cut to the longest that messages quote."""
    return text if len(text) <= LONGEST_QUOTE else text[: LONGEST_QUOTE - 3] + "..."


def _item_text(value: Any) -> str:
    """A value inside a list as it would stand in the file: lists are cut after 20 elements."""
    if isinstance(value, list):
        return "[" + ", ".join(_item_text(v) for v in value[:20]) + "]"
    return repr(value) if isinstance(value, str) else quote(value)
