"""All rules of a device file in the order in which they are read, and what they find wrong with a document.

The rules of a device file over arrays of numbers: which of many designs are certain to be valid.

Only the numbers that differ are looked at, of a device that is valid with the numbers of one of its designs. A
design that is not certain to be valid is checked alone, which says what is wrong with it, if anything is. Each is
judged by its own numbers.

Rules about numbers, vectors and matrices are those of a file. What a file says of a single number is asked of the
file's own types, at the ends of the range that they allow. Rules about keys hold for all designs, which have the
same keys; a number that may stand for none, 0 or infinity, is so in all of them or in none (`design_batch`).

Values that device files may hold one day, refused until then: never ignored.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, Final

import numpy as np
from pydantic import AfterValidator, ValidationError

from zwidth.arrays import Flags, Floats
from zwidth.device.address import deep_copy, exists, in_schema, spread_tables, table, written_path
from zwidth.device.faults import KeyMessages, KeyPath
from zwidth.device.plausibility import partly_missing
from zwidth.device.rules.loop import COMPUTER, RESPONSE, SAMPLING
from zwidth.device.rules.mechanism import ARM, LEGS_AS_WRITTEN, MECHANISM
from zwidth.device.rules.plant import HAND, MOTION, PLANT, WINDINGS
from zwidth.device.rules.rule import Document, KeyRule, NumberRule, Numbers, Rule, places, rule_faults
from zwidth.device.schema.device_file import KINDS, DeviceFile, flat_sources
from zwidth.device.schema.value_types import (
    LARGEST,
    Axis,
    DampingMatrix,
    Inertia,
    MassMatrix,
    StiffnessMatrix,
    ValueRule,
    Vector,
)
from zwidth.model.design_axes import join_designs


def _one_kind(document: Document) -> KeyMessages:
    """Path and sentence of a device given by none or several of [mechanism], [plant] and [response]."""
    given = [f"[{kind}]" for kind in KINDS if kind in document]
    if not given:
        yield (), "has neither [mechanism] nor [plant] nor [response]; give one of them"
    elif len(given) > 1:
        yield (), f"has {' and '.join(given)}; only one of them is allowed: remove the other"


def _sources(document: Document) -> KeyMessages:
    """Path and sentence of each entry of [sources] whose path is no key of a device file."""
    for key in flat_sources(table(document, "sources")):
        if not exists(document, key) and not in_schema(key):
            yield ("sources", key), "names no key of this file; give a dotted path, with * for any step"


def _partly_missing(document: Document) -> KeyMessages:
    """Path and sentence of each mass, inertia or ratio that some links or drives lack and others give."""
    for path in partly_missing(table(document, "mechanism")):
        yield path, "is missing; give it here, or nowhere if it is not known"


RULES: Final[tuple[Rule, ...]] = (
    _one_kind, *PLANT, *COMPUTER, *MOTION, *RESPONSE, *WINDINGS, *HAND, *ARM, *SAMPLING, *MECHANISM
)  # fmt: skip
"""Rules of a document whose legs are spread into copies, faults in which stand where the leg is written."""
AS_WRITTEN: Final[tuple[Rule, ...]] = (_sources, *LEGS_AS_WRITTEN, _partly_missing)
"""Rules of a document as it is written."""


@cache
def _applicable(tables_there: frozenset[str]) -> tuple[Rule, ...]:
    """Those of `RULES`, in their order, that can be broken by a document with these tables and no others."""

    def about(rule: Rule) -> str:
        """The table without which a rule has nothing to say; "" for a rule of the whole file."""
        if isinstance(rule, KeyRule | NumberRule):
            return rule.place.partition(".")[0]
        return "mechanism" if rule in MECHANISM else ""

    return tuple(rule for rule in RULES if about(rule) in {"", *tables_there})


def device_faults(document: Document) -> KeyMessages:
    """Path and sentence of every disagreement between keys of a document."""
    spread, paths = spread_tables(table(document, "mechanism"))
    flat = {**document, "mechanism": spread} if spread else document
    for path, message in rule_faults(_applicable(frozenset(flat)), flat):
        yield written_path(path, paths), message
    yield from rule_faults(AS_WRITTEN, document)


Values = dict[KeyPath, Floats]

# Place and key of lists whose numbers are judged together -> their type.
TOGETHER: Final[dict[tuple[str, str], Any]] = {
    ("plant", "mass_kg"): MassMatrix,
    ("plant", "damping_Ns_per_m"): DampingMatrix,
    ("plant", "stiffness_N_per_m"): StiffnessMatrix,
    **{("plant", key): Vector for key in ("actuator", "sensor", "handle")},
    ("mechanism.links.*", "axis"): Axis,
    ("mechanism.links.*", "inertia_kg_m2"): Inertia,
}
VECTORS: Final = (Axis, Vector)


def certainly_valid(document: Document, values: Values, count: int) -> Flags:
    """Marks (count,) of the designs that are certain to be valid.

    document  of one of the designs, a valid one
    values    resolved path -> numbers (count,) of all designs, one path for each element of a list
    """
    valid, designs = np.ones(count, dtype=bool), Numbers(document, (), values)
    together = {
        (*path, key): kind for (place, key), kind in TOGETHER.items() for path, _ in places(document, place)
    }
    for steps, numbers in values.items():
        valid &= np.isfinite(numbers) | np.isposinf(numbers)
        if not any(steps[: len(whole)] == whole for whole in together):
            valid &= _allowed_alone(document, steps, numbers)
    for broken in (*_broken_rules(designs), *_broken_together(designs, together)):
        valid &= ~np.broadcast_to(np.asarray(broken, dtype=bool), valid.shape)
    return valid


def _broken_rules(designs: Numbers) -> Iterator[Any]:
    """For each rule about numbers and each place that it is about: whether each design breaks it, (count,), or ()
    where they are alike."""
    for rule in RULES:
        if isinstance(rule, NumberRule):
            where = places(designs.document, rule.place)
            yield from (broken for _, _, broken in rule.judged(designs, where))


def _broken_together(designs: Numbers, together: dict[KeyPath, Any]) -> Iterator[Any]:
    """For each rule about a vector or matrix whose numbers differ: whether each design breaks it, (count,).

    together  path -> type of the vectors and matrices of the file
    """
    for path, kind in together.items():
        if any(steps[: len(path)] == path for steps in designs.values):
            rules = [rule.func for rule in kind.__metadata__ if isinstance(rule, AfterValidator)]
            value = _vectors_or_matrices(designs, path, kind in VECTORS)
            yield np.abs(value).max(axis=-1 if kind in VECTORS else (-2, -1)) > LARGEST
            yield from (rule.judge(value)[0] for rule in rules if isinstance(rule, ValueRule))


def _vectors_or_matrices(designs: Numbers, path: KeyPath, vector: bool) -> Floats:
    """Numbers of designs at a path, where one number may stand for a vector or matrix and three moments for a
    matrix.

    vector  True: vectors (..., n); False: matrices (..., n, n)
    """
    own = Numbers(designs.document, path, designs.values)
    held = own.held("")  # the value at the path itself
    if not isinstance(held, list):
        return np.asarray(own.number(""), dtype=float)[(..., None) if vector else (..., None, None)]
    if isinstance(held[0], list):
        rows = [Numbers(designs.document, (*path, i), designs.values).numbers("") for i in range(len(held))]
        return join_designs(rows, 1)
    numbers = np.asarray(own.numbers(""), dtype=float)
    return numbers if vector else numbers[..., None] * np.eye(len(held))


def _allowed_alone(document: Document, steps: KeyPath, numbers: Floats) -> Flags:
    """Marks (count,) of the numbers that the file may have at a path. Those between two that it may have are
    allowed, too, if they are of one sign and not infinite."""
    inside = np.zeros(len(numbers), dtype=bool)
    # marks of the numbers of one sign, of 0 and of inf
    for part in (numbers < 0.0, numbers == 0.0, (numbers > 0.0) & np.isfinite(numbers), np.isposinf(numbers)):
        ordered = np.unique(numbers[part])
        if not len(ordered):
            continue
        known = dict[int, bool]()

        def allowed(place: int, ordered: Floats = ordered, known: dict[int, bool] = known) -> bool:
            """Whether the file may have the number at a place among the ordered ones; each is tried once."""
            if place not in known:
                known[place] = _takes_number(document, steps, float(ordered[place]))
            return known[place]

        low, high = _allowed_range(allowed, len(ordered))
        if low <= high:
            inside |= part & (numbers >= ordered[low]) & (numbers <= ordered[high])
    return inside


def _allowed_range(allowed: Callable[[int], bool], count: int) -> tuple[int, int]:
    """First and last place that is allowed, of places 0 to count - 1 that are so from one to another; (0, -1)
    where none is.

    allowed  whether a place is; asked as rarely as may be
    """
    # the ends, then places spread evenly, then all
    tried = [0, count - 1, *(count * share // 16 for share in range(1, 16)), *range(count)]
    good = next((place for place in tried if allowed(place)), None)
    if good is None:
        return 0, -1
    ends = []
    for end in (0, count - 1):
        inside, outside = good, end
        if allowed(end):
            inside = outside
        # halve the way from a place that is allowed to one that is not
        while abs(outside - inside) > 1:
            middle = (inside + outside) // 2
            inside, outside = (middle, outside) if allowed(middle) else (inside, middle)
        ends.append(inside)
    return ends[0], ends[1]


def _takes_number(document: Document, steps: KeyPath, number: float) -> bool:
    """Whether the types of a file take a number at a path of a document."""
    changed = deep_copy(document)
    place: Any = changed
    for step in steps[:-1]:
        place = place[step]
    place[steps[-1]] = number
    try:
        DeviceFile.model_validate(without_unsupported(changed)[0])
    except ValidationError:
        return False
    return True


COMPOSED: Final = frozenset({"cylindrical", "planar", "screw", "helical"})
UNSUPPORTED_VALUES: Final[dict[tuple[str, ...], tuple[frozenset[str], str, frozenset[str] | None]]] = {
    ("loop", "velocity", "method"): (
        frozenset({"measured"}),
        "backward-difference",
        frozenset({"filter"}),
    ),
    ("mechanism", "links", "*", "joint"): (COMPOSED, "revolute", None),
    ("mechanism", "legs", "*", "links", "*", "joint"): (COMPOSED, "revolute", None),
}
"""Key -> the values to refuse so, the supported one that stands for them while the rest is checked, and the keys
beside it that are checked with it (None: all); what is left out are parameters of the refused value."""


def without_unsupported(document: dict[str, Any]) -> tuple[dict[str, Any], list[tuple[KeyPath, str]]]:
    """The document without what is not supported yet, and a sentence for each thing taken out."""
    document = deep_copy(document)
    refused: list[tuple[KeyPath, str]] = []
    for pattern, (names, stand_in, beside) in UNSUPPORTED_VALUES.items():
        for path, holder in _keys_matching(document, pattern):
            value = holder[pattern[-1]]
            if isinstance(value, str) and value.lower() in names:
                for key in [] if beside is None else holder.keys() - beside:
                    del holder[key]
                holder[pattern[-1]] = stand_in
                refused.append((path, f"{pattern[-1]} '{value}' is not supported yet; use '{stand_in}'"))
    return document, refused


def _keys_matching(
    document: Any, pattern: tuple[str, ...], path: KeyPath = ()
) -> Iterator[tuple[KeyPath, dict[str, Any]]]:
    """Path of each key that a pattern (* for each list element) leads to, and the table that holds it."""
    first, rest = pattern[0], pattern[1:]
    if first == "*":
        for index, inner in enumerate(document if isinstance(document, list) else []):
            yield from _keys_matching(inner, rest, (*path, index))
    elif isinstance(document, dict) and first in document:
        if not rest:
            yield (*path, first), document
        else:
            yield from _keys_matching(document[first], rest, (*path, first))
