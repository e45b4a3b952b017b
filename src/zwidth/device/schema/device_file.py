"""The whole device file, its JSON Schema, and a way to walk it.

[load]: what the device bears while it renders, about which it is linearised.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache, lru_cache
from typing import Annotated, Any, Final, Literal

from pydantic import BeforeValidator, ConfigDict

from zwidth.device.schema.loop import LoopSection
from zwidth.device.schema.mechanism import FrictionSection, MechanismSection
from zwidth.device.schema.operator import ArmSection, OperatorSection
from zwidth.device.schema.plant import PlantSection, ResponseSection
from zwidth.device.schema.value_types import (
    VERSION,
    Number,
    NumberOrInfinity,
    Position,
    Section,
    Text,
    WholeNumber,
    documented_key,
)
from zwidth.unit_text import unit_text

KINDS: Final = ("mechanism", "plant", "response")  # by one of which a device is given
# Tables that only device files have, and keys that only studies have: they tell which of the two a file is.
DEVICE_KEYS: Final = frozenset({*KINDS, "loop"})
STUDY_KEYS: Final = frozenset({"device", "measures", "axis", "tolerance", "optimise"})
TAGS: Final = ("type", "method", "shape")  # of a filter, of a velocity's estimate, of a cross section


def flat_sources(value: Any) -> Any:
    """[sources] as one level, dotted path -> text: dotted keys written bare, which are nested tables for TOML, are
    joined; quoted ones are so already. What is no table stays as it is."""
    if not isinstance(value, dict):
        return value
    flat: dict[str, Any] = {}
    for key, inner in value.items():
        if isinstance(inner, dict) and inner:
            flat |= {f"{key}.{below}": text for below, text in flat_sources(inner).items()}
        else:
            flat[key] = inner
    return flat


class DeviceFile(Section):
    """A haptic device: its [mechanism], its rendered direction's [plant] or a [response]; and its [loop]."""

    model_config = ConfigDict(
        title="zwidth device file",
        json_schema_extra={
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "oneOf": [{"required": ["mechanism"]}, {"required": ["plant"]}, {"required": ["response"]}],
        },
    )

    file_version: WholeNumber = VERSION
    name: Text = documented_key("the device's name, for people")
    description: str = documented_key("one line on what the device is", default="")
    source: str = documented_key("one line on where the numbers come from", default="")
    sources: Annotated[dict[str, Text], BeforeValidator(flat_sources)] = documented_key(
        "where each group of numbers comes from: dotted path (* for any step) -> text", default={}
    )
    mechanism: MechanismSection | None = documented_key("the mechanism; or [plant]", default=None)
    plant: PlantSection | None = documented_key("the rendered direction's dynamics; or [mechanism]", default=None)
    response: ResponseSection | None = documented_key("a measured response, in place of either", default=None)
    loop: LoopSection = documented_key("what the computer does")
    friction: FrictionSection | None = documented_key("dry friction of a [plant]; omitted: none", default=None)
    load: LoadSection | None = documented_key(
        "what the device bears while it renders; omitted: nothing", default=None
    )
    arm: ArmSection | None = documented_key(
        "the operator's arm as a chain of bodies, in place of [operator]", default=None
    )
    operator: OperatorSection | None = documented_key(
        "the arm and grasp at the handle; omitted: nobody", default=None
    )


@lru_cache(maxsize=1)
def schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of the device file, with a description and a unit for every key."""
    return DeviceFile.model_json_schema()


def subschemas(path: tuple[str | int, ...], document: dict[str, Any] | None = None) -> list[dict[str, Any]]:
    """Every subschema that may describe the value at a path of keys and indices; none: no such key.

    document  a device's: of a table that comes in kinds, only that of the kind that the document has there; None:
              those of all kinds
    """
    alternatives, place = list(_alternatives(schema())), document
    for part in path:
        tables = [outer for outer in alternatives if _is_of_kind(outer, place)]
        alternatives = [
            inner for outer in tables for step in _schemas_at(outer, part) for inner in _alternatives(step)
        ]
        place = _value_at(place, part)
    return alternatives


def keys(path: tuple[str | int, ...]) -> set[str]:
    """The keys that the table at a path may hold."""
    if not path:  # needed for every device; the whole JSON Schema takes 20 ms
        return set(DeviceFile.model_fields)
    return {key for subschema in subschemas(path) for key in subschema.get("properties", {})}


def kinds(path: tuple[str | int, ...]) -> tuple[str, dict[str, set[str]]]:
    """For a table that comes in kinds, such as filters: the key that tells them apart, and kind -> keys that it
    reads; "", {} for any other."""
    tables = [subschema.get("properties", {}) for subschema in subschemas(path)]
    for tag in TAGS:
        keys_by_kind = {table[tag]["const"]: set(table) for table in tables if "const" in table.get(tag, {})}
        if len(keys_by_kind) > 1:
            return tag, keys_by_kind
    return "", {}


def key_sentence(path: tuple[str | int, ...]) -> str:
    """What the key at a path means, or the list that it stands in; "" if the schema says nothing."""
    for end in range(len(path), 0, -1):
        outer = [
            step for subschema in subschemas(path[: end - 1]) for step in _schemas_at(subschema, path[end - 1])
        ]
        # an element has the sentence of its list, and an entry of free name that of its table
        for subschema in outer:
            if "description" in subschema:
                return str(subschema["description"])
        if outer and isinstance(path[end - 1], str) and not _takes_any_key(path[: end - 1]):
            break
    return ""


def key_description(path: tuple[str | int, ...]) -> str:
    """What the key at a path means, with its unit; "" if the schema says nothing."""
    sentence, unit = key_sentence(path), key_unit(path)
    return f"{sentence} [{unit_text(unit)}]" if sentence and unit else sentence


@cache
def key_unit(path: tuple[str | int, ...]) -> str:
    """The unit of the number at a path, or of the list that it stands in; "" if the schema states none, and for
    "1"."""
    for end in range(len(path), 0, -1):
        outer = [
            step for subschema in subschemas(path[: end - 1]) for step in _schemas_at(subschema, path[end - 1])
        ]
        units = [str(subschema["unit"]) for subschema in outer if "unit" in subschema]
        if units:
            return "" if units[0] == "1" else units[0]
        if isinstance(path[end - 1], str):  # a key, no index: no list around it
            break
    return ""


@cache
def usual_size(path: tuple[str | int, ...]) -> float:
    """The size that the schema calls usual for the number at a path; 0 where it calls none so.

    >>> usual_size(("loop", "delay_samples")), usual_size(("loop", "sampling_period_s"))
    (1.0, 0.0)
    """
    outer = [step for subschema in subschemas(path[:-1]) for step in _schemas_at(subschema, path[-1])]
    return next((float(subschema["usual"]) for subschema in outer if "usual" in subschema), 0.0)


def may_be_zero(path: tuple[str | int, ...]) -> bool:
    """Whether the key at a path is a number from 0 on, as delays, friction and damping are.

    >>> may_be_zero(("loop", "delay_samples")), may_be_zero(("loop", "sampling_period_s"))
    (True, False)
    """
    numbers = [subschema for subschema in subschemas(path) if subschema.get("type") == "number"]
    # the limit as pydantic writes it for numbers with checks of their own, or as JSON Schema does
    return any(subschema.get("ge", subschema.get("minimum")) == 0 for subschema in numbers)


def zero_is_none(path: tuple[str | int, ...]) -> bool:
    """Whether leaving out a key that may be 0 says the same as 0: unless its sentence tells what else it says.

    >>> drive = ("mechanism", "drives", 0)
    >>> zero_is_none((*drive, "coulomb_Nm")), zero_is_none((*drive, "damping_resistance_ohm"))
    (True, False)
    """
    # what follows "omitted: " is another thing than none, such as "not known" or the value of another key
    return not re.search(r"omitted[^:;]*: (?!none\b|no\b|0\b)", key_sentence(path))


def default(path: tuple[str | int, ...], document: dict[str, Any] | None = None) -> Any:
    """What the schema takes for a key that is left out; None where it takes nothing.

    document  as for `subschemas`
    """
    outer = [step for subschema in subschemas(path[:-1], document) for step in _schemas_at(subschema, path[-1])]
    return next((subschema["default"] for subschema in outer if subschema.get("default") is not None), None)


def mirror_image(path: tuple[str | int, ...]) -> tuple[str | int, ...] | None:
    """The path of an element's mirror image in a symmetric matrix: a list of lists for which one number may stand.
    None for the diagonal, and for what stands in none.

    >>> mirror_image(("plant", "mass_kg", 0, 1))
    ('plant', 'mass_kg', 1, 0)
    >>> mirror_image(("mechanism", "loops", 0, "points_m", 0, 1)) is None
    True
    """
    if len(path) < 3 or not isinstance(path[-1], int) or not isinstance(path[-2], int) or path[-1] == path[-2]:
        return None
    symmetric = any(kind.get("type") == "number" for kind in subschemas(path[:-2]))
    return (*path[:-2], path[-1], path[-2]) if symmetric else None


def below_diagonal(path: tuple[str | int, ...]) -> bool:
    """Whether the path is an element below the diagonal of a symmetric matrix, which moves with the one above."""
    return mirror_image(path) is not None and int(path[-2]) > int(path[-1])


def _takes_any_key(path: tuple[str | int, ...]) -> bool:
    """Whether the table at a path takes keys of any name, as [mechanism.assemblies] does."""
    return any(isinstance(subschema.get("additionalProperties"), dict) for subschema in subschemas(path))


def _is_of_kind(subschema: dict[str, Any], table: Any) -> bool:
    """Whether a table has the tag (type, method, ...) that a subschema demands; true where it demands none."""
    properties = subschema.get("properties", {}) if isinstance(table, dict) else {}
    tags = [(tag, properties[tag]) for tag in TAGS if "const" in properties.get(tag, {})]
    return all(tag_schema["const"] == table.get(tag, tag_schema.get("default")) for tag, tag_schema in tags)


def _value_at(place: Any, part: str | int) -> Any:
    """The value of a document's table or list at a key or index; None where there is none."""
    if isinstance(place, dict):
        return place.get(str(part))
    return place[part] if isinstance(place, list) and isinstance(part, int) and part < len(place) else None


def _schemas_at(subschema: dict[str, Any], part: str | int) -> Iterator[dict[str, Any]]:
    """The schema, if there is one, of what stands at a key or index of what a schema describes."""
    if isinstance(part, int):
        if isinstance(subschema.get("items"), dict):
            yield subschema["items"]
    elif part in subschema.get("properties", {}):
        yield subschema["properties"][part]
    elif isinstance(subschema.get("additionalProperties"), dict):
        yield subschema["additionalProperties"]


def _alternatives(subschema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The schemas that a value may follow: references resolved and each branch of anyOf and oneOf by itself."""
    if "$ref" in subschema:
        yield from _alternatives(schema()["$defs"][subschema["$ref"].removeprefix("#/$defs/")])
        return
    # a oneOf of "required" alone says which keys exclude each other, and is no form of its own
    branches = subschema.get("anyOf", []) + [
        branch for branch in subschema.get("oneOf", []) if "required" not in branch
    ]
    if not branches or "properties" in subschema:
        yield subschema
    for branch in branches:
        yield from _alternatives(branch)


class LoadSection(Section):
    """The forces about whose balance the device is linearised: the hand's, and gravity."""

    force_N: Position | None = documented_key(
        "force of the hand on the handle, x, y or x, y, z, with a part along the rendered direction; or push_N; "
        "omitted, with push_N and moment_Nm: the wall is at rest, without force",
        "N",
        default=None,
    )
    push_N: Number | None = documented_key(
        "force of the hand along the rendered direction, whichever that is, of either sign; about an axis its "
        "moment in N m",
        "N",
        default=None,
    )
    moment_Nm: Position | None = documented_key(
        "moment of the hand on the handle, where moments about an axis are rendered", "N m", default=None
    )
    gravity_m_per_s2: Position | None = documented_key(
        "gravity, x, y or x, y, z, such as [0, 0, -9.81]; omitted: none", "m/s^2", default=None
    )
    hand: Literal["dead", "follower", "neglected"] = documented_key(
        'how the force of the hand goes with the handle: "dead": it keeps its direction in space; "follower": it '
        'turns with the handle\'s link; "neglected": how its lever arms change is left out, as in the thesis',
        default="dead",
    )
    posture_of: Literal["handle", "motors"] = documented_key(
        'whose posture is asked for: that of the "handle", or of the "motors" as the computer counts them, behind '
        "which the handle is by the bending of the drives",
        default="handle",
    )
    settle: bool = documented_key(
        "true: the hand gives this force and no other, and the handle slides along the surface to where it is in "
        "balance; false: the posture is kept, and the hand supplies what it needs across the direction",
        default=False,
    )
    surface_radius_m: NumberOrInfinity | None = documented_key(
        "radius of the surface at the handle, positive if it is convex towards the hand, negative if it is "
        "hollow; omitted: a plane, the only surface that a handle that settles slides along",
        "m",
        default=None,
    )
    count_sideways: bool = documented_key(
        "true: motions that no wall moves without load count for stability, too, as of a hand that holds nothing "
        "sideways; false: they are named with the rate at which they grow",
        default=False,
    )
    spring_branch: Literal["forward", "backward"] = documented_key(
        "which branch is meant of a spring without torque whose stiffness changes there: the motor ahead of the "
        "joint, or behind it",
        default="forward",
    )
