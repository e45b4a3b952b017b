"""Versions of what zwidth reads and keeps: device files, study files, stores of long runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from zwidth._version import __version__
from zwidth.device.faults import fail

KEY: Final = "file_version"
FILE_VERSION: Final = 1  # of device, operator and study files
STORE_VERSION: Final = 1  # of stores and journals


def newer_version_message(version: object, known: int) -> str:
    """What to say of something of a newer version than is known; "" for any other.

    >>> newer_version_message(1, 1), newer_version_message("two", 1), newer_version_message(True, 1)
    ('', '', '')
    """
    if isinstance(version, bool) or not isinstance(version, int | float) or not version > known:
        return ""
    return f"is {version:g}, and zwidth {__version__} reads up to version {known}; upgrade zwidth"


def refuse_newer(document: Mapping[str, Any], label: str) -> None:
    """Raise DeviceError for a file of a newer version, whose other keys nobody can judge."""
    if message := newer_version_message(document.get(KEY), FILE_VERSION):
        raise fail(label, KEY, message)


def without_version(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document but for its version, which is no number of what it describes."""
    return {key: value for key, value in document.items() if key != KEY}
