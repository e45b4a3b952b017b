"""`zwidth devices`: what is bundled."""

from __future__ import annotations

import click

from zwidth.show.cli.answer import Answer, deliver, table
from zwidth.show.cli.options import as_json, example


@click.command(short_help="List the bundled devices.", epilog=example("zwidth devices", "zwidth devices --json"))
@as_json
def devices(as_json: bool) -> int:
    """List the bundled devices: a name of theirs can stand wherever DEVICE is asked for."""
    from zwidth.device.read import bundled

    listing = [dict(zip(("name", "description", "source"), entry, strict=True)) for entry in bundled()]
    rows = [tuple(entry.values()) for entry in listing]
    return deliver(Answer({"devices": listing}, lambda: [table(["name", "description", "source"], rows)]), as_json)
