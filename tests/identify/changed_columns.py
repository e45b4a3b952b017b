"""Columns of a record of which some are changed, left out or named otherwise."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Columns = dict[str, Any]


def changed(columns: Columns, **more: Callable[[Any], Any]) -> Columns:
    """Columns of which some are changed, each by a function of itself."""
    return {name: more.get(name, _same)(values) for name, values in columns.items()}


def without(columns: Columns, first: int, behind: int) -> Columns:
    """Columns of which some rows are not there."""
    return {name: np.delete(np.asarray(values), slice(first, behind)) for name, values in columns.items()}


def renamed(columns: Columns, **names: str) -> Columns:
    """Columns under other names, two of them perhaps exchanged."""
    return {names.get(name, name): values for name, values in columns.items()}


def _same(values):
    return values
