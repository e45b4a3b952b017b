"""Studies to ask, as the tables that a study file holds."""

from __future__ import annotations

from typing import Any

import numpy as np

from zwidth.errors import DeviceError
from zwidth.measures import OK
from zwidth.study import Study, study_of

FIVE_BAR, TWO_MASS = "five-bar", "published-two-mass"
RIGHT_LENGTH, LEFT_LENGTH = "links.upper-right.length_m", "links.upper-left.length_m"


def axis(key: str, *values: Any, **more: Any) -> dict[str, Any]:
    """An axis of these values, or of a range where `range` is given."""
    return {"key": key, **({"values": list(values)} if values else {}), **more}


def study_document(*axes: dict[str, Any], measures: Any = ("rigid_mass",), **more: Any) -> dict[str, Any]:
    return {"device": FIVE_BAR, "measures": list(measures), "axis": list(axes), **more}


def study(*axes: dict[str, Any], **more: Any) -> Study:
    return study_of(study_document(*axes, **more))


def faults(document: dict[str, Any]) -> list[str]:
    """All that is wrong, one line each, without the file's name."""
    try:
        study_of(document, "my.toml")
    except DeviceError as error:
        return [str(fault).removeprefix("my.toml: ") for fault in error.faults]
    return []


def numbers_match_status(values: Any, status: Any) -> bool:
    """Is there a number wherever the status is OK, and only there?"""
    return bool((np.isfinite(values) == (status == OK)).all())
