"""All rules of a device file in the order in which they are read, and what they find wrong with a document."""

from __future__ import annotations

from typing import Final

from zwidth.device.address import exists, in_schema, table
from zwidth.device.faults import KeyMessages
from zwidth.device.legs import spread_tables, written_path
from zwidth.device.missing import partly_missing
from zwidth.device.rules.loop import COMPUTER, RESPONSE, SAMPLING
from zwidth.device.rules.mechanism import ARM, LEGS_AS_WRITTEN, MECHANISM
from zwidth.device.rules.plant import HAND, MOTION, PLANT, WINDINGS
from zwidth.device.rules.rule import Document, Rule, rule_faults
from zwidth.device.schema.device_file import KINDS, flat_sources


def _one_kind(document: Document) -> KeyMessages:
    """A device is given by one of a mechanism, a plant and a response."""
    given = [f"[{kind}]" for kind in KINDS if kind in document]
    if not given:
        yield (), "has neither [mechanism] nor [plant] nor [response]; give one of them"
    elif len(given) > 1:
        yield (), f"has {' and '.join(given)}; only one of them is allowed: remove the other"


def _sources(document: Document) -> KeyMessages:
    """Sources are of keys there are."""
    for key in flat_sources(table(document, "sources")):
        if not exists(document, key) and not in_schema(key):
            yield ("sources", key), "names no key of this file; give a dotted path, with * for any step"


def _partly_missing(document: Document) -> KeyMessages:
    """What is known of some links or drives is known of all."""
    for path in partly_missing(table(document, "mechanism")):
        yield path, "is missing; give it here, or nowhere if it is not known"


RULES: Final[tuple[Rule, ...]] = (
    _one_kind, *PLANT, *COMPUTER, *MOTION, *RESPONSE, *WINDINGS, *HAND, *ARM, *SAMPLING, *MECHANISM
)  # fmt: skip
"""Rules of a document whose legs are spread into copies, faults in which stand where the leg is written."""
AS_WRITTEN: Final[tuple[Rule, ...]] = (_sources, *LEGS_AS_WRITTEN, _partly_missing)
"""Rules of a document as it is written."""


def device_faults(document: Document) -> KeyMessages:
    """Path and sentence of every disagreement between keys of a document."""
    spread, paths = spread_tables(table(document, "mechanism"))
    flat = {**document, "mechanism": spread} if spread else document
    for path, message in rule_faults(RULES, flat):
        yield written_path(path, paths), message
    yield from rule_faults(AS_WRITTEN, document)
