"""Device files as text."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def toml_text(table: Mapping[str, Any]) -> str:
    """TOML of a table: a line for each key, whatever lies deeper in line."""
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in table.items())


def digits(value: Any, count: int = 6) -> Any:
    """Numbers with so many digits, in lists as well, so that files do not depend on a processor's last bit."""
    if isinstance(value, (list, tuple)):
        return [digits(element, count) for element in value]
    return float(f"{float(value):.{count}g}")


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() else json.dumps(key)


def _value(value: Any) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value)
        case int() | float():
            return repr(value)
        case Mapping():
            return "{ " + ", ".join(f"{_key(key)} = {_value(inner)}" for key, inner in value.items()) + " }"
        case _:
            return "[" + ", ".join(map(_value, value)) + "]"
