"""Units and keys of answers about moments: newtons become newton metres and metres radians.

Everything is computed alike for a force along a direction and a moment about an axis, in the same fields; only
what is printed says which of the two it is.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Final

from zwidth.measures.moment_units import unit_of_moments

NAMES: Final = {"position_m": "angle_rad", "force_N": "moment_Nm"}
ENDINGS: Final = (
    ("_N2s_per_m2", "_N2m2s_per_rad2"),
    ("_Ns_per_m", "_Nms_per_rad"),
    ("_N_per_m", "_Nm_per_rad"),
    ("_m_per_s2", "_rad_per_s2"),
    ("_m_per_s", "_rad_per_s"),
    ("_kg", "_kg_m2"),
    ("_m", "_rad"),
    ("_N", "_Nm"),
)
KEPT: Final = re.compile(r"[xyz]_m|plane_through_m|characteristic_length_m")
"""Keys that are lengths whatever is rendered."""
OF_SPACE: Final = {
    "equilibrium": frozenset({"hand_force_N", "position_m", "counted_position_m"}),
    "beams": frozenset({"mass_kg", "carried_mass_kg"}),
    "tubes": frozenset({"length_m", "outer_diameter_m", "wall_m"}),
}
"""Table, or list of tables -> those of its keys that keep their units whatever is rendered: forces and places in
space, and the sizes and masses of links."""
OF_FILES: Final = frozenset({"load"})
"""Tables that are those of the device file, with its keys."""

_moments: ContextVar[bool] = ContextVar("moments", default=False)


def keys_of_moments(value: Any, table: str = "") -> Any:
    """A document, or columns, with the keys of moments about an axis.

    table  the key under which it stands

    >>> keys_of_moments({"stiffness_max_N_per_m": 2.0, "x_m": [0.1], "inner": [{"rigid_mass_kg": 1.0}]})
    {'stiffness_max_Nm_per_rad': 2.0, 'x_m': [0.1], 'inner': [{'rigid_mass_kg_m2': 1.0}]}
    """
    if isinstance(value, Mapping):
        if table in OF_FILES:
            return value
        kept = OF_SPACE.get(table, frozenset())
        return {(key if key in kept else _key(key)): keys_of_moments(inner, key) for key, inner in value.items()}
    return [keys_of_moments(inner, table) for inner in value] if isinstance(value, list | tuple) else value


def _key(key: Any) -> Any:
    if not isinstance(key, str) or "." in key or KEPT.fullmatch(key):  # a dotted path is of the device file
        return key
    if key in NAMES:
        return NAMES[key]
    return next((key[: -len(old)] + new for old, new in ENDINGS if key.endswith(old)), key)


@contextmanager
def speaking_of_moments(moments: bool) -> Iterator[None]:
    """Within this block texts and figures have the units of moments, or those of forces."""
    token = _moments.set(moments)
    try:
        yield
    finally:
        _moments.reset(token)


def speaks_of_moments() -> bool:
    """Whether texts and figures have the units of moments now."""
    return _moments.get()


def spoken_unit(unit: str) -> str:
    """A unit as texts and figures write it now."""
    return unit_of_moments(unit) if _moments.get() else unit
