"""Versions of what zwidth reads and keeps: device files, study files, stores of long runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from zwidth._version import __version__
from zwidth.device.faults import fail

KEY: Final = "file_version"
FILE_VERSION: Final = 1  # of device, operator and study files
STORE_VERSION: Final = 2  # of stores and journals
CHECKED: Final = 2  # the first version of stores and journals in which what they hold has checksums


def newer_version_message(version: object, known: int) -> str:
    """What to say of something of a newer version than is known; "" for any other.

    >>> newer_version_message(1, 1), newer_version_message("two", 1), newer_version_message(True, 1)
    ('', '', '')
    """
    if isinstance(version, bool) or not isinstance(version, int | float) or not version > known:
        return ""
    return f"is {version:g}, and zwidth {__version__} reads up to version {known}; upgrade zwidth"


def without_checksums(version: object) -> bool:
    """Whether a store or journal of a version has no checksums; one that names no version is of the first.

    >>> [without_checksums(one) for one in (None, 1, 2, True, "two")]
    [True, True, False, False, False]
    """
    if version is None:
        return True
    return not isinstance(version, bool) and isinstance(version, int | float) and version < CHECKED


def unchecked_version_message(version: object) -> str:
    """What to say of a store of a version whose cells have no checksums; "" for any other.

    >>> unchecked_version_message(2)
    ''
    """
    if not without_checksums(version):
        return ""
    number = 1 if version is None else version
    return f"is {number:g}, whose cells have no checksums, and zwidth {__version__} reads version {STORE_VERSION}"


def refuse_newer(document: Mapping[str, Any], label: str) -> None:
    """Raise DeviceError for a file of a newer version, whose other keys nobody can judge."""
    if message := newer_version_message(document.get(KEY), FILE_VERSION):
        raise fail(label, KEY, message)


def without_version(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document but for its version, which is no number of what it describes."""
    return {key: value for key, value in document.items() if key != KEY}
