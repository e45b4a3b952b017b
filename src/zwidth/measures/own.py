"""Old name of `zwidth.measures.user_measures`, used before 0.2; to be removed with the next release."""

from __future__ import annotations

import warnings
from typing import Any

from zwidth.measures import user_measures


def __getattr__(name: str) -> Any:
    """A name of `user_measures`. Warns DeprecationWarning; raises AttributeError for any other."""
    if name.startswith("_") or not hasattr(user_measures, name):
        raise AttributeError(f"module 'zwidth.measures.own' has no attribute {name!r}")
    message = f"zwidth.measures.own goes with the next release; write from zwidth import {name}"
    warnings.warn(message, DeprecationWarning, stacklevel=2)
    return getattr(user_measures, name)
