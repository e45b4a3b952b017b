"""From what pydantic found to sentences for people."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from math import pi
from typing import Any, Final

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from zwidth.device.faults import KeyPath, nearest, quote, suggestion
from zwidth.device.schema import device_file as schema
from zwidth.device.schema.loop import DEFAULT_METHOD

# Units that numbers are often given in -> the unit of device files, and the factor.
OTHER_UNITS: Final = {
    "N_per_mm": ("N_per_m", 1e3),
    "Ns_per_mm": ("Ns_per_m", 1e3),
    "Nm_per_deg": ("Nm_per_rad", 180.0 / pi),
    "mNm": ("Nm", 1e-3),
    "Nmm": ("Nm", 1e-3),
    "g_cm2": ("kg_m2", 1e-7),
    "g_mm2": ("kg_m2", 1e-9),
    "kg_cm2": ("kg_m2", 1e-4),
    "kg_mm2": ("kg_m2", 1e-6),
    "g": ("kg", 1e-3),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "um": ("m", 1e-6),
    "deg": ("rad", pi / 180.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "kHz": ("Hz", 1e3),
    "mH": ("H", 1e-3),
}


def validation_messages(
    error: ValidationError,
    document: dict[str, Any],
    description: Callable[[KeyPath], str] = schema.key_description,
    unknown: Callable[[KeyPath], str] | None = None,
) -> Iterator[tuple[KeyPath, str]]:
    """Path and sentence of each fault; a key missing only because it is misspelt is reported once, and a list that
    is too short only without its faulty elements not at all.

    document  that was validated
    description, unknown  of files that are no device files: what the key at a path means, "" for nothing; and the
                          sentence on a key that there is not
    """
    details = error.errors(include_url=False)
    located = [(_path_of(detail, document), detail) for detail in details]
    missing = {path for path, detail in located if detail["type"] == "missing"}
    # missing keys whose table has a key with almost the same name
    misspelt = {
        (*path[:-1], near)
        for path, detail in located
        if detail["type"] == "extra_forbidden"
        and (near := nearest(str(path[-1]), [str(other[-1]) for other in missing if other[:-1] == path[:-1]]))
    }
    for path, detail in located:
        is_misspelt = detail["type"] == "missing" and path in misspelt
        if not is_misspelt and not _long_enough_as_given(detail):
            if detail["type"] == "extra_forbidden":
                yield path, unknown(path) if unknown else _unknown_key_sentence(path, document)
            else:
                meaning = description(path) if path else ""
                yield path, _sentence(detail, path, f" ({meaning})" if meaning else "")


def _long_enough_as_given(detail: ErrorDetails) -> bool:
    """Whether pydantic calls a list too short although the file gives enough elements: it does not count faulty
    ones, which have their own message."""
    limits = detail.get("ctx", {})
    return detail["type"] == "too_short" and len(detail["input"]) >= limits["min_length"]


def _path_of(detail: ErrorDetails, document: Any) -> KeyPath:
    """Path of pydantic's error in the document, without steps that pydantic adds (tags, lifted numbers). Of a
    table whose kind is unknown, the path of the key that names it."""
    path: list[str | int] = []
    *outer, last = detail["loc"] or ("",)
    # a missing key, which is last, cannot be followed into the document
    for part in (*outer, last) if detail["type"] != "missing" else outer:
        if part == "[key]":  # of an error in a key's name
            continue
        if isinstance(document, dict) and part in document:
            document = document[str(part)]
        elif isinstance(document, list) and isinstance(part, int) and part < len(document):
            document = document[part]
        else:
            continue
        path.append(part)
    if detail["type"] in ("union_tag_invalid", "union_tag_not_found"):
        return (*path, schema.kinds(tuple(path))[0])
    return (*path, last) if detail["type"] == "missing" else tuple(path)


def _sentence(detail: ErrorDetails, path: KeyPath, about: str) -> str:
    """What pydantic found as a sentence after the key: what it must be, what came.

    about  what the key means, in brackets after a space; "" where the schema does not say
    """
    kind, got = detail["type"], detail["input"]
    limits: Mapping[str, Any] = detail.get("ctx", {})
    if demand := _number_demand(kind, limits, got):
        return f"{demand}, got {quote(got)}{about}"
    match kind:
        case "missing":
            return f"is missing; add it{about}"
        case "too_short" | "too_long":
            return _length_sentence(limits, got, about)
        case "string_type":
            return f"must be text, got {quote(got)}{about}"
        case "string_too_short":
            return f"must not be empty{about}"
        case "string_too_long":
            return f"must have at most {limits['max_length']} characters, got {quote(got)}"
        case "string_pattern_mismatch":
            return f"must be a name of letters, digits, - and _ that begins with a letter, got {quote(got)}"
        case "literal_error":
            return _literal_sentence(limits["expected"], got, about)
        case "union_tag_invalid":
            kinds = [tag.strip("'") for tag in limits["expected_tags"].split(", ")]
            near = nearest(str(limits["tag"]), kinds)
            hint = f"; did you mean '{near}'?" if near else ""
            return f"must be {limits['expected_tags'].replace(', ', ' or ')}, got {limits['tag']!r}{hint}"
        case "union_tag_not_found":
            kinds = sorted(schema.kinds(path[:-1])[1])  # the path ends on the key that names the kind
            return f"is missing or no text; give {' or '.join(map(repr, kinds))}"
        case "tuple_type" | "list_type":
            return f"must be a list, got {quote(got)}{about}"
        case "model_type" | "model_attributes_type" | "dict_type":
            return f"must be a table, got {quote(got)}{about}"
        case "bool_type" | "bool_parsing":
            return f"must be true or false, got {quote(got)}{about}"
        case _:
            return detail["msg"].removeprefix("Value error, ")


def _number_demand(kind: str, limits: Mapping[str, Any], got: object) -> str:
    """Return what a number must be, by the kind of what pydantic found; "" for kinds that are not about numbers.

    limits  name -> limit that the number broke
    got     what came instead
    """
    match kind:
        case "float_type" if isinstance(got, int) and not isinstance(got, bool):  # larger than any float
            return "must be a finite number"
        case "float_type":
            return "must be a number"
        case "int_type" | "int_from_float":
            return "must be a whole number"
        case "finite_number":
            return "must be finite"
        case "greater_than":
            return f"must be greater than {limits['gt']:.10g}"
        case "greater_than_equal":
            return f"must be at least {limits['ge']:.10g}"
        case "less_than":
            return f"must be less than {limits['lt']:.10g}"
        case "less_than_equal":
            return f"must be at most {limits['le']:.10g}"
        case _:
            return ""


def _unknown_key_sentence(path: KeyPath, document: dict[str, Any]) -> str:
    """The sentence for a key that its table does not read: the kinds or the section that have it, the key in SI
    units, or the nearest one."""
    key, table = str(path[-1]), path[:-1]
    tag, kinds = schema.kinds(table)
    kind = _value(document, table).get(tag, DEFAULT_METHOD) if kinds else None
    allowed = kinds[kind] if kind in kinds else schema.keys(table)
    readers = [other for other, keys in kinds.items() if key in keys]
    if readers:
        others = " or ".join(f'"{reader}"' for reader in readers)
        return f'is not read with {tag} = "{kind}"; remove it, or set {tag} = {others}'
    if nearest(key, allowed) is None:
        elsewhere = [
            section
            for section in ("loop", "plant", "mechanism", "operator", "load", "friction")
            if key in schema.keys((section,))
        ]
        if elsewhere and table != (elsewhere[0],):
            return f"is not a key here; it belongs into [{elsewhere[0]}]"
    converted = _si_hint(key, _value(document, path), allowed)
    return f"is not a key of a device file; {converted or suggestion(key, allowed)}"


def _si_hint(key: str, value: Any, allowed: Collection[str]) -> str:
    """A hint for a key in another unit: the allowed key in SI units and its number; empty where there is none."""
    known = isinstance(value, int | float) and not isinstance(value, bool)
    if re.fullmatch(r"sampl\w*_(?:frequency|rate)(?:_k?Hz)?", key) and "sampling_period_s" in allowed:
        frequency = value * (1e3 if key.endswith("kHz") else 1.0) if known else 0.0
        return "give sampling_period_s" + (f" = {1.0 / frequency:.10g}" if frequency > 0.0 else ", in seconds")
    for unit, (base, factor) in OTHER_UNITS.items():
        si_key = key.removesuffix(unit) + base
        if key.endswith(f"_{unit}") and si_key in allowed:
            return f"give {si_key}" + (f" = {value * factor:.10g}" if known else "")
    return ""


def _value(document: Any, path: KeyPath) -> Any:
    """The value at a path that leads through tables and lists there are."""
    for step in path:
        document = document[step]
    return document


def _length_sentence(limits: Mapping[str, Any], got: Any, about: str) -> str:
    """The sentence for a list of too few or too many elements, by pydantic's limits; `about` as for
    `_sentence`."""
    if "max_length" in limits:
        return f"must have at most {limits['max_length']} elements, got {limits['actual_length']}{about}"
    least = limits["min_length"]
    return f"must have at least {least} element{'s' * (least != 1)}, got {limits['actual_length']}{about}"


def _literal_sentence(expected: str, got: Any, about: str) -> str:
    """The sentence for a value that is none of the words expected, with the nearest of them; `about` as for
    `_sentence`.

    expected  the words as pydantic lists them: 'a', 'b' or 'c'
    """
    words = [word.strip("'") for word in expected.replace(" or ", ", ").split(", ")]
    if isinstance(got, str) and (near := nearest(got, words)):
        return f"must be {expected}, got {quote(got)}; did you mean '{near}'?"
    return f"must be {expected.replace('True', 'true')}, got {quote(got)}{about}"
