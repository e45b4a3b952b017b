"""`zwidth app`: the workbench in the browser."""

from __future__ import annotations

import secrets
from typing import Any, Final

import click

from zwidth.show.cli.options import example
from zwidth.show.cli.progress import DONE, say

LOOPBACK: Final = ("127.0.0.1", "localhost", "::1")


@click.command(
    "app",
    short_help="Open the workbench in the browser.",
    epilog=example("zwidth app", "zwidth app my-device.toml --set loop.delay_samples=1"),
)
@click.argument("device", required=False)
@click.option(
    "--set", "settings", multiple=True, metavar="PATH=VALUE", help="Change a number of the file; repeatable."
)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=8440, show_default=True, help="0: any that is free."
)
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Address to listen on. Another than this computer's own needs a token, which is printed.",
)
@click.option("--token", help="The token to ask for, instead of a random one.")
@click.option("--browser/--no-browser", default=True, help="Open the page in the browser.  [default: browser]")
def app(
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
