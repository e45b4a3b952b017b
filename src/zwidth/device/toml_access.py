"""Looking into a plain document, whatever stands in it."""

from __future__ import annotations

from typing import Any, TypeGuard


def table(document: dict[str, Any], key: str) -> dict[str, Any]:
    """The table under a key; empty where there is none."""
    value = document.get(key)
    return value if isinstance(value, dict) else {}


def tables(document: dict[str, Any], key: str) -> list[tuple[int, dict[str, Any]]]:
    """The tables in the list under a key, each with its index."""
    value = document.get(key)
    return [(i, v) for i, v in enumerate(value if isinstance(value, list) else []) if isinstance(v, dict)]


def is_number(value: Any) -> TypeGuard[float]:
    """Whether the value is a number that a float can hold (TOML's whole numbers have no end)."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return isinstance(value, float) or abs(value) < 10**300


def row_count(value: Any) -> int | None:
    """How many rows a matrix has, 1 for a single number; None for anything else."""
    if is_number(value):
        return 1
    return len(value) if isinstance(value, list) and value else None


def deep_copy(value: Any) -> Any:
    """A copy of tables and lists to any depth, in a fifth of the time that `copy.deepcopy` takes; what else stands
    in them cannot be changed in place."""
    if isinstance(value, dict):
        return {key: deep_copy(inner) for key, inner in value.items()}
    return [deep_copy(inner) for inner in value] if isinstance(value, list) else value
