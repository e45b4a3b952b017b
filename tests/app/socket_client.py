"""A client of the workbench's socket, as the page is one."""

from __future__ import annotations

import json
from typing import Any

from websockets.sync.client import ClientConnection, connect

from zwidth.show import unpack_frame

FIVE_BAR = {"device": "five-bar", "wall": {"stiffness": 4000.0, "damping": 10.0}}


class SocketClient:
    """One open socket; `ask` sends a request and returns its answer."""

    def __init__(self, port: int, **options: Any) -> None:
        address = f"127.0.0.1:{port}"
        self._connecting = connect(f"ws://{address}/socket", origin=f"http://{address}", max_size=None, **options)
        self.number = 0

    def __enter__(self) -> SocketClient:
        self.socket: ClientConnection = self._connecting.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._connecting.__exit__(*error)

    def send(self, kind: str, **content: Any) -> int:
        """Send a request without waiting for its answer; returns its number."""
        self.number += 1
        self.socket.send(json.dumps({"id": self.number, "kind": kind, **content}))
        return self.number

    def receive(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """The next frame; a view is confirmed, as a page does that has drawn it."""
        message = self.socket.recv(timeout=60)
        assert isinstance(message, bytes)
        head, arrays = unpack_frame(message)
        if head["kind"] == "view":
            self.socket.send('{"kind": "shown"}')
        return head, arrays

    def ask(self, kind: str, **content: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """Send a request and return its answer, without what tells of progress."""
        number = self.send(kind, **content)
        while True:
            head, arrays = self.receive()
            if head["id"] == number and head["kind"] != "progress":
                return head, arrays

    def refused(self, message: str) -> list[str]:
        """Send any text; returns the sentences by which it is refused."""
        self.socket.send(message)
        head, _ = self.receive()
        assert not head["ok"], head
        sentences: list[str] = head["sentences"]
        return sentences
