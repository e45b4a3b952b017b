"""The page on device files: its examples load, and its tables say what the schema says."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

from zwidth.device import from_document
from zwidth.device.rules.table import UNSUPPORTED_VALUES
from zwidth.device.schema import device_file as schema
from zwidth.unit_text import unit_text

PAGE = (Path(__file__).parents[2] / "docs" / "device-files.md").read_text(encoding="utf-8")

TABLES = {
    "The file": (),
    "`[plant]`": ("plant",),
    "`[response]`": ("response",),
    "`[[plant.electrical_damping]]`": ("plant", "electrical_damping", 0),
    "`[[plant.spring]]`": ("plant", "spring", 0),
    "`[[plant.brake]]`": ("plant", "brake", 0),
    "`[loop]`": ("loop",),
    "`[loop.velocity]`": ("loop", "velocity"),
    "`[loop.velocity.filter]`": ("loop", "velocity", "filter"),
    "`[loop.force]`": ("loop", "force"),
    "`[loop.actuator]`": ("loop", "actuator"),
    "`[loop.encoder]`": ("loop", "encoder"),
    "`[loop.saturation]`": ("loop", "saturation"),
    "`[loop.force_sensor]`": ("loop", "force_sensor"),
    "`[loop.feedforward]`": ("loop", "feedforward"),
    "`[loop.local]`": ("loop", "local"),
    "`[friction]`": ("friction",),
    "`[operator]`": ("operator",),
    "`[arm]`": ("arm",),
    "`[arm.hand]`": ("arm", "hand"),
    "`[load]`": ("load",),
    "`[[mechanism.links]]`": ("mechanism", "links", 0),
    "`[mechanism.links.beam]`": ("mechanism", "links", 0, "beam"),
    "`[mechanism.links.beam.material]`": ("mechanism", "links", 0, "beam", "material"),
    "`[[mechanism.loops]]`": ("mechanism", "loops", 0),
    "`[[mechanism.legs]]`": ("mechanism", "legs", 0),
    "`[mechanism.handle]`": ("mechanism", "handle"),
    "`[mechanism.assemblies.NAME]`": ("mechanism", "assemblies", "any"),
    "`[mechanism.reference]`": ("mechanism", "reference"),
    "`[mechanism.workspace]`": ("mechanism", "workspace"),
    "`[[mechanism.drives]]`": ("mechanism", "drives", 0),
    "`[mechanism.drives.ratio_table]`": ("mechanism", "drives", 0, "ratio_table"),
    "`[mechanism.damping]`": ("mechanism", "damping"),
    "`[mechanism.friction]`": ("mechanism", "friction"),
}


def rows(path: tuple[str | int, ...]) -> list[str]:
    """The table of the keys at a path, as the page has it: key, unit, meaning, default."""
    lines: dict[str, str] = {}
    for found in schema.subschemas(path):
        for key, value in found.get("properties", {}).items():
            default = value.get("default")
            needed = "required" if key in found.get("required", ()) else ""
            shown = f"`{json.dumps(default)}`" if default not in (None, {}, [], "") else ""
            meaning = value["description"]
            lines.setdefault(
                key, f"| `{key}` | {unit_text(value.get('unit', ''))} | {meaning} | {needed or shown} |"
            )
    return list(lines.values())


def is_table(path: tuple[str | int, ...], key: str) -> bool:
    """Whether a key holds a table, or tables, with a heading of their own."""
    return bool(schema.keys((*path, key)) or schema.keys((*path, key, 0)))


def page_tables() -> dict[str, list[str]]:
    sections = re.split(r"^#+ (.+)$", PAGE, flags=re.MULTILINE)
    bodies = dict(zip(sections[1::2], sections[2::2], strict=True))
    return {title: [line for line in bodies[title].splitlines() if line.startswith("| `")] for title in TABLES}


@pytest.mark.parametrize("title", TABLES)
def test_the_tables_say_what_the_schema_says(title):
    path = TABLES[title]
    assert page_tables()[title] == [row for row in rows(path) if not is_table(path, row.split("`")[1])]


@pytest.mark.parametrize("example", re.findall(r"^```toml\n(name.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
def test_an_example_of_the_page_loads(example):
    from_document(tomllib.loads(example))


def test_the_page_has_an_example_of_either_kind():
    examples = [
        tomllib.loads(text) for text in re.findall(r"^```toml\n(name.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    ]
    assert {"plant", "mechanism"} <= {key for example in examples for key in example}


def test_the_page_has_every_shape_of_a_beam_with_its_keys():
    (text,) = re.findall(r"^### `\[mechanism.links.beam.section\]`\n(.*?)^#", PAGE, re.MULTILINE | re.DOTALL)
    shown = {
        row[0]: set(row[1:]) for row in ([*re.findall(r"`([^`]+)`", line)] for line in text.splitlines()) if row
    }
    del shown["shape"]
    known = {}
    for found in schema.subschemas(("mechanism", "links", 0, "beam", "section")):
        if "properties" in found:
            known[f'"{found["properties"]["shape"]["const"]}"'] = found["properties"].keys() - {"shape"}
    assert shown == known


def test_the_page_says_what_is_not_supported_yet():
    assert UNSUPPORTED_VALUES.keys() >= {("mechanism", "links", "*", "joint")}
    assert "A cylindrical, planar or screw joint is refused" in PAGE


def test_every_key_has_a_meaning_and_every_physical_one_a_unit():
    """A key that ends in a unit carries it in the schema, too."""
    for path in TABLES.values():
        for found in schema.subschemas(path):
            for key, value in found.get("properties", {}).items():
                assert value.get("description"), key
                if re.search(r"_(kg|m|s|rad|Hz|kg_m2|per_m3?|per_rad3?|per_s|per_A|N|Nm|samples)$", key):
                    assert value.get("unit"), key


def test_the_schema_is_strict_json():
    text = json.dumps(schema.schema(), allow_nan=False)
    assert json.loads(text)["title"].startswith("zwidth ")
    assert json.loads(text)["$schema"] == "https://json-schema.org/draft/2020-12/schema"
