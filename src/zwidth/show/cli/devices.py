"""`zwidth devices`: what is bundled."""

from __future__ import annotations

from typing import Any

import click

from zwidth.show.cli.answer import Answer, answer_table, deliver
from zwidth.show.cli.options import as_json, example


@click.command(short_help="List the bundled devices.", epilog=example("zwidth devices", "zwidth devices --json"))
@as_json
def devices(as_json: bool) -> int:
    """List the bundled devices, whose names can stand for DEVICE, and operators, whose names --operator takes."""
    from zwidth.device.read import DEVICES, OPERATORS, bundled

    keys = ("name", "description", "source")
    document = {
        what: [dict(zip(keys, entry, strict=True)) for entry in bundled(shelf)]
        for what, shelf in (("devices", DEVICES), ("operators", OPERATORS))
    }

    def pages() -> list[Any]:
        return [
            answer_table([what[:-1], *keys[1:]], [tuple(one.values()) for one in document[what]])
            for what in document
        ]

    return deliver(Answer(document, pages), as_json)
