"""Run the server: find a port, say where the page is, open it, and end with ctrl-C.

What a page opens first: the device of the command line, with the text of its file and those it names.
"""

from __future__ import annotations

import asyncio
import socket
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import uvicorn

from zwidth.device import address
from zwidth.device.device import Device
from zwidth.device.read import bundled_names, device_text, first_bundled, parse_document, read_text
from zwidth.show.app.connection import LARGEST_FILE
from zwidth.show.app.server import LARGEST_MESSAGE, LOOPBACK, Settings, make_app
from zwidth.show.cli.errors import BadInput

TRIED: int = 20  # ports, from the wanted one on


def serve(
    start: dict[str, Any], host: str, port: int, token: str, browser: bool, say: Callable[..., None]
) -> None:
    """Serve the page until ctrl-C. Raises BadInput where no port can be had.

    start    what a page opens first, as `start_of` returns it
    token    as of `Settings`;   browser  whether to open the page in one;   say  prints lines
    """
    listening = listen(host, port)
    settings = Settings(host, listening.getsockname()[1], token, start)
    server = make_server(settings)

    def announce() -> None:
        """Print where the page is, and open it."""
        say(*announcement(settings))
        if browser:
            webbrowser.open(page_address(settings))

    server.on_start = announce
    # The server ends its connections and then raises what ended it; here that is what the user was told to type.
    with suppress(KeyboardInterrupt):
        asyncio.run(server.serve(sockets=[listening]))
    say("zwidth: the workbench has ended")


class Server(uvicorn.Server):
    """A server that calls `on_start` when it listens and ends in order at ctrl-C."""

    on_start: Callable[[], None] | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, then call `on_start`."""
        await super().startup(sockets)
        if self.on_start:
            self.on_start()


def make_server(settings: Settings) -> Server:
    """The server, quiet, with limits on what it reads; what it needs is imported here and now."""
    assert LARGEST_MESSAGE > LARGEST_FILE
    config = uvicorn.Config(
        make_app(settings),
        log_level="error",
        access_log=False,
        ws="websockets-sansio",
        ws_max_size=LARGEST_MESSAGE,
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=2,
        server_header=False,
    )
    config.load()
    return Server(config)


def listen(host: str, port: int) -> socket.socket:
    """A socket that listens on the port, or on the first free one after it. Raises BadInput where there is none.

    port  0: any that is free
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    last_reason = ""
    for candidate in range(port, port + (TRIED if port else 1)):
        listening = socket.socket(family, socket.SOCK_STREAM)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((host, candidate))
            listening.listen(64)
        except (OSError, OverflowError) as error:
            listening.close()
            last_reason = getattr(error, "strerror", "") or str(error)
            continue
        return listening
    raise BadInput(
        f"--port {port}: the workbench cannot listen on {host}: {last_reason}; choose another --port or --host"
    )


def page_address(settings: Settings) -> str:
    """The page's address for this computer's browser."""
    host = "127.0.0.1" if settings.host in ("0.0.0.0", "::") else settings.host
    host = f"[{host}]" if ":" in host else host
    query = f"?token={settings.token}" if settings.token else ""
    return f"http://{host}:{settings.port}/{query}"


def announcement(settings: Settings) -> list[str]:
    """What the terminal says when the server has started."""
    lines = [f"zwidth: the workbench is at {page_address(settings)} (ctrl-C ends it)"]
    if settings.host not in LOOPBACK:
        lines += [
            "zwidth: other computers can connect with this token; what is sent is not encrypted",
            "zwidth: on other computers browsers allow sound and boards only at a secure address: forward the "
            f"port with ssh -L {settings.port}:127.0.0.1:{settings.port}, or put a server with https before it",
        ]
    return lines


def start_of(device: str | None, settings: Sequence[str]) -> dict[str, Any]:
    """State and files that a page begins with, as plain values.

    device    a bundled name or a file; None: the first bundled one
    settings  "PATH=VALUE" texts
    Raises    DeviceError  where the device, changed so, cannot be loaded
    """
    from zwidth.device.load import load

    name = device or first_bundled()
    loaded = load(name, settings)
    changes = dict(address.parse(text_of_setting) for text_of_setting in settings)
    if name in bundled_names():
        return {"state": {"device": name, "settings": changes}, "files": []}
    text = device_text(name)
    files = [{"name": Path(name).name, "text": text}, *_named_files(parse_document(text, name), Path(name).parent)]
    state = {"device": Path(loaded.label).name, "from_file": True, "settings": changes}
    return {"state": state, "files": files}


def start_of_device(device: Device) -> dict[str, Any]:
    """State and files that a page begins with, of a device in memory: its file is written from its document."""
    import tomlkit

    file = f"{device.name[:80]}.toml".replace("/", "-").replace("\\", "-")
    files = [{"name": file, "text": tomlkit.dumps(device.document)}]
    files += _named_files(device.document, Path(device.label).parent)
    return {"state": {"device": file, "from_file": True, "settings": {}}, "files": files}


def _named_files(document: Mapping[str, Any], folder: Path) -> list[dict[str, str]]:
    """The files of measurements that a device file names. Raises FileError."""
    response = document.get("response", {})
    names = [response.get("file"), *response.get("files", ()), response.get("handle_file")]
    return [{"name": name, "text": read_text(folder / name, LARGEST_FILE)} for name in names if name]
