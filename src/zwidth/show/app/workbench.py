"""The workbench on a device in memory: a notebook shows the page, and takes the device back changed."""

from __future__ import annotations

import threading
import time
from html import escape
from types import TracebackType
from typing import Any, Final

from zwidth.device.device import Device
from zwidth.model.argument_checks import check_kind
from zwidth.show.app.opened import changes
from zwidth.show.app.request import State
from zwidth.show.app.run import listen, make_server, page_address, start_of_device
from zwidth.show.app.server import Settings

HEIGHT: Final = 760  # css px of the page in a notebook
LONGEST_START: Final = 20.0  # s that the server is waited for
LONGEST_END: Final = 10.0  # s


class Workbench:
    """A page on a device, and the device as the page has it now.

        bench = zwidth.Workbench(device)
        bench                 # a notebook shows the page
        bench.device          # the device with the numbers that were changed there

    It runs in this process until `close`, or until Python ends. `bench.address` can be opened in any browser of
    this computer; of several pages the one that was moved last counts.
    """

    def __init__(self, device: Device, *, port: int = 0) -> None:
        """Start the server.

        device  any device in memory; measurements that its file names are read from beside that file
        port    0: any that is free
        Raises  BadInput  (show.cli.errors) where no port can be had; TypeError for what is no device; RuntimeError
                where the server does not start
        """
        check_kind("device", device, Device)
        self._device = device
        self._socket = listen("127.0.0.1", port)
        settings = Settings("127.0.0.1", self._socket.getsockname()[1], "", start_of_device(device), framed=True)
        self.address = page_address(settings)
        self._server = make_server(settings)
        self._thread = threading.Thread(target=self._server.run, args=([self._socket],), daemon=True)
        self._thread.start()
        end = time.monotonic() + LONGEST_START
        while not self._server.started and self._thread.is_alive() and time.monotonic() < end:
            time.sleep(0.01)
        if not self._server.started:
            self.close()
            raise RuntimeError(f"the workbench at {self.address} did not start within {LONGEST_START:g} s")

    @property
    def settings(self) -> dict[str, Any]:
        """Path -> value of each number that was changed in the page; None where its key was removed."""
        state = self._state
        return {} if state is None else dict(state.settings)

    @property
    def device(self) -> Device:
        """The device as the page has it: its numbers changed, in the hand that was chosen. Raises DeviceError
        where what the page holds is no device."""
        state = self._state
        if state is None:
            return self._device
        device = self._device if state.operator is None else self._device.held_by(state.operator)
        return device.with_(changes(state.settings)) if state.settings else device

    @property
    def wall(self) -> tuple[float, float] | None:
        """K [N/m] and B [N s/m] of the wall that was chosen last; None where none was."""
        state = self._state
        return None if state is None or state.wall is None else (state.wall.stiffness, state.wall.damping)

    @property
    def _state(self) -> State | None:
        """The state of the page that was moved last; None before any, and if it shows another device."""
        state: State | None = self._server.config.app.state.received.get("state")  # type: ignore[union-attr]
        return state if state is not None and state.from_file else None

    def close(self) -> None:
        """End the server and its processes."""
        self._server.should_exit = True
        self._thread.join(LONGEST_END)
        self._socket.close()

    def __enter__(self) -> Workbench:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Workbench on {self._device.name!r} at {self.address}"

    def _repr_html_(self) -> str:
        """The page in a frame, as notebooks show it."""
        return (
            f'<iframe src="{escape(self.address)}" title="zwidth workbench" width="100%" height="{HEIGHT}" '
            'style="border:1px solid #c5ccd3;border-radius:8px" allow="autoplay; clipboard-write"></iframe>'
        )
