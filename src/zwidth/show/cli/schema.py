"""`zwidth schema`: what a device file may hold, for editors and other programs."""

from __future__ import annotations

import json

import click

from zwidth.show.cli.answer import put
from zwidth.show.cli.options import example


@click.command(epilog=example("zwidth schema > device.schema.json"))
@click.option("--json", "as_json", is_flag=True, help="Print it on one line; without, indented.")
def schema(as_json: bool) -> int:
    """Print the JSON Schema of a device file."""
    from zwidth.device.load import schema as device_schema

    put(json.dumps(device_schema(), indent=None if as_json else 2, allow_nan=False) + "\n")
    return 0
