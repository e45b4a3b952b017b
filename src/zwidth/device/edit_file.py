"""Numbers written into a device file, its comments and the order of its lines kept."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from zwidth.device import address
from zwidth.device.faults import dotted, fail
from zwidth.device.read import device_text


def edited_text(
    path: str | os.PathLike[str],
    settings: Mapping[str, Any] | Sequence[str | tuple[str, Any]],
    sources: Mapping[str, str] | None = None,
) -> str:
    """The text of a device file with numbers set as `Device.with_` sets them; what it does not change stands as it
    is written.

    path      of the file, or a bundled name
    settings  path -> value, or pairs of them and texts "PATH=VALUE" as typed; `address.UNSET` removes a key
    sources   path -> where its number comes from, which is noted under [sources]
    Raises    DeviceError  for a file that cannot be read, or paths that lead nowhere
    """
    import tomlkit

    label = os.fspath(path)
    text = device_text(label)
    try:
        document = tomlkit.parse(text)
    except ValueError as error:
        raise fail(label, "", f"is no TOML: {error}") from None
    before = document.unwrap()
    after = address.apply(before, list(settings.items() if isinstance(settings, Mapping) else settings))
    _carry_over(document, before, after)
    if sources:
        noted = document.setdefault("sources", tomlkit.table())
        for path_of_number, source in sources.items():
            noted[dotted(address.resolve(after, path_of_number), after)] = source
    return tomlkit.dumps(document)


def _carry_over(place: Any, before: Any, after: Any) -> None:
    """Change in a parsed file, `place`, what differs between its plain values before and after."""
    if isinstance(after, dict):
        for key in [key for key in before if key not in after]:
            del place[key]
        for key, value in after.items():
            if key not in before:
                place[key] = value
            elif value != before[key]:
                if isinstance(value, dict | list) and _alike(value, before[key]):
                    _carry_over(place[key], before[key], value)
                else:
                    place[key] = value
        return
    for index, value in enumerate(after):
        if value != before[index]:
            if isinstance(value, dict | list) and _alike(value, before[index]):
                _carry_over(place[index], before[index], value)
            else:
                place[index] = value


def _alike(value: Any, other: Any) -> bool:
    """Whether two values are tables both, or lists of one length."""
    if isinstance(value, dict):
        return isinstance(other, dict)
    return isinstance(other, list) and len(value) == len(other)
