"""Faults of TOML text as sentences: what the parser reports, and what was probably meant."""

from __future__ import annotations

import re
import tomllib
from typing import Final

PLACE: Final = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")
DECIMAL_COMMA: Final = re.compile(r"[=\[,]\s*([-+]?\d+),(\d+(?:[eE][-+]?\d+)?)\s*(?:#.*)?$")
TABLE_TWICE: Final = re.compile(r"Cannot declare \((.+?),?\) twice")


def toml_fault(text: str, error: tomllib.TOMLDecodeError) -> str:
    """A sentence on the error of a text: the line, and what to write instead where that can be seen.

    >>> text = "mass_kg = 0,045"
    >>> try:
    ...     tomllib.loads(text)
    ... except tomllib.TOMLDecodeError as error:
    ...     toml_fault(text, error)
    'line 1: 0,045 has a decimal comma; write 0.045'
    """
    message, lines = str(error), text.splitlines()
    place = PLACE.search(message)
    # an error "at end of document" is one of the last line that holds anything
    filled = [k for k, line in enumerate(lines, 1) if line.strip()]
    number = int(place[1]) if place and place[1] else (filled[-1] if filled else 1)
    line = lines[number - 1] if number <= len(lines) else ""
    comma = DECIMAL_COMMA.search(line)
    if comma and "Expected newline" in message:
        return f"line {number}: {comma[1]},{comma[2]} has a decimal comma; write {comma[1]}.{comma[2]}"
    if "Cannot overwrite a value" in message:
        key = line.partition("=")[0].strip()
        return f"line {number}: {key} is there twice; keep one of them"
    if twice := TABLE_TWICE.match(message):
        name = ".".join(part.strip(" '\"") for part in twice[1].split(","))
        return f"line {number}: [{name}] is there twice; put its keys under one heading"
    return f"is not TOML: {message[:1].lower()}{message[1:]}"
