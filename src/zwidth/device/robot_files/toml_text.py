"""A device file as text: sections in the order of their documentation, numbers to their last digit, and
comments."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Sequence
from typing import Any

from zwidth.device.robot_files.robot import Finding

HEADINGS = {
    "links": "Links, each behind the joint that carries it.",
    "loops": "What closes the loops.",
    "drives": "Drives. Not in the file that was imported, and worth giving:\n"
    "stiffness_Nm_per_rad (omitted: rigid), encoder_counts_per_rev, torque_constant_Nm_per_A.",
}


def device_text(document: dict[str, Any], findings: Sequence[Finding]) -> str:
    """The text of a device file.

    document  its tables: name, source, mechanism with lists of tables, loop
    findings  written into its head
    """
    return (
        "\n".join([*_head(document, findings), *_mechanism(document["mechanism"]), *_loop(document["loop"])])
        + "\n"
    )


def _head(document: dict[str, Any], findings: Sequence[Finding]) -> Iterator[str]:
    if findings:
        yield "# What was found while importing:"
    for finding in findings:
        mark = "warning, " if finding.severity == "warning" else ""
        yield from _comment(f"{mark}{finding}", "  ")
    yield ""
    for key in ("name", "source"):
        yield f"{key} = {json.dumps(document[key], ensure_ascii=False)}"


def _comment(text: str, indent: str = "") -> Iterator[str]:
    printable = "".join(c if c.isprintable() else " " for c in text)
    for k, line in enumerate(textwrap.wrap(printable, 110, break_long_words=False, break_on_hyphens=False)):
        yield f"# {'- ' if indent and k == 0 else indent}{line}"


def _mechanism(mechanism: dict[str, Any]) -> Iterator[str]:
    for group in ("links", "loops"):
        yield from _tables(group, mechanism.get(group, []))
    yield from ("", "# Where the operator holds the device.", "[mechanism.handle]", *_pairs(mechanism["handle"]))
    for name, assembly in mechanism["assemblies"].items():
        yield from ("", "# Joint coordinates of the reference posture.")
        for key, values in assembly.items():
            yield from (f"[mechanism.assemblies.{name}.{key}]", *_pairs(values))
    yield from ("", "[mechanism.reference]", *_pairs(mechanism["reference"]))
    yield from _tables("drives", mechanism["drives"])


def _tables(group: str, entries: Sequence[dict[str, Any]]) -> Iterator[str]:
    if entries:
        yield ""
        yield from (f"# {line}" for line in HEADINGS[group].splitlines())
    for k, entry in enumerate(entries):
        yield from ([""] if k else [])
        yield f"[[mechanism.{group}]]"
        yield from _pairs(entry)


def _loop(loop: dict[str, Any]) -> Iterator[str]:
    yield from ("", "[loop]", *_pairs(loop))
    if "sampling_period_s" not in loop:
        yield "# sampling_period_s = 0.001   # not in the file that was imported; charts and simulations need it"


def _pairs(table: dict[str, Any]) -> Iterator[str]:
    for key, value in table.items():
        yield f"{key} = {toml_value(value)}"


def toml_value(value: Any) -> str:
    """A value as TOML, numbers to their last digit.

    >>> toml_value([1, 0.1, True, "a"]), toml_value({"b": 1e-7})
    ('[1, 0.1, true, "a"]', '{ b = 1e-07 }')
    """
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value, ensure_ascii=False)
        case dict():
            return "{ " + ", ".join(f"{key} = {toml_value(inner)}" for key, inner in value.items()) + " }"
        case list() | tuple():
            return "[" + ", ".join(map(toml_value, value)) + "]"
        case _:
            return repr(value)
