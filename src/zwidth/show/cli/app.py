"""`zwidth app`: the workbench in the browser."""

from __future__ import annotations

import secrets
from typing import Any, Final

import click

from zwidth.questions import APP
from zwidth.show.cli.options import decorated, example, options_of, with_settings_option
from zwidth.show.cli.progress import DONE, say

LOOPBACK: Final = ("127.0.0.1", "localhost", "::1")


def _app(
    device: str | None, settings: tuple[str, ...], port: int, host: str, token: str | None, browser: bool
) -> int:
    """Open the workbench in the browser: drag a number of DEVICE and the chart follows; touch a wall and hear it.

    DEVICE is a bundled name or a file; left out: the page offers the bundled ones. Only this computer can connect,
    and no file is read but DEVICE and what it names. Ctrl-C ends it.
    """
    from zwidth.show.app.run import serve, start_of

    start: dict[str, Any] = start_of(device, settings)
    if host not in LOOPBACK and not token:
        token = secrets.token_urlsafe(16)
    serve(start, host, port, token or "", browser, say)
    return DONE


app: Final = click.command(
    "app",
    short_help="Open the workbench in the browser.",
    epilog=example("zwidth app", "zwidth app my-device.toml --set loop.delay_samples=1"),
)(decorated(_app, (click.argument("device", required=False), with_settings_option, *options_of(APP))))
