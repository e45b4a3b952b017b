"""What a page opens first: the device of the command line, with the text of its file and those it names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from zwidth.device import address
from zwidth.device.device import Device
from zwidth.device.read import bundled_names, device_text, first_bundled, parse_document
from zwidth.device.text_file import read_text
from zwidth.show.app.connection import LARGEST_FILE


def start_of(device: str | None, settings: Sequence[str]) -> dict[str, Any]:
    """State and files that a page begins with, as plain values.

    device    a bundled name or a file; None: the first bundled one
    settings  "PATH=VALUE" texts
    Raises    DeviceError  where the device, changed so, cannot be loaded
    """
    from zwidth.device.load import load

    name = device or first_bundled()
    made = load(name, settings)
    changes = dict(address.parse(one) for one in settings)
    if name in bundled_names():
        return {"state": {"device": name, "settings": changes}, "files": []}
    text = device_text(name)
    files = [{"name": Path(name).name, "text": text}, *_named_files(parse_document(text, name), Path(name).parent)]
    state = {"device": Path(made.label).name, "from_file": True, "settings": changes}
    return {"state": state, "files": files}


def start_of_device(device: Device) -> dict[str, Any]:
    """The same for a device in memory: its file is written from its document."""
    import tomlkit

    file = f"{device.name[:80]}.toml".replace("/", "-").replace("\\", "-")
    files = [{"name": file, "text": tomlkit.dumps(device.document)}]
    files += _named_files(device.document, Path(device.label).parent)
    return {"state": {"device": file, "from_file": True, "settings": {}}, "files": files}


def _named_files(document: Mapping[str, Any], folder: Path) -> list[dict[str, str]]:
    """The files of measurements that a device file names. Raises UnreadableFileError."""
    response = document.get("response", {})
    names = [response.get("file"), *response.get("files", ()), response.get("handle_file")]
    return [{"name": name, "text": read_text(folder / name, LARGEST_FILE)} for name in names if name]
