"""Numbers with units for people: one rounding everywhere, SI prefixes, a real minus sign.

What is computed has four significant digits, rounded to nearest, limits too: a wall rendered at its limit
has no margin, and a pair of stiffness and damping promises nothing however it is rounded. What somebody chose
stays as it was written (`as_written`), an error has two digits (`uncertain`), a spectral radius four of its
distance from 1.

Figures and reports use `quantity`, `number`, `percent` and `point`; terminals `amount` and `vector`, the same
notation with blanks and signs that can be typed and searched (`typed`).

Text of an energy balance: the entries by name, and rows of a table, the stored energy last.

Units and keys of answers about moments: newtons become newton metres and metres radians.

Everything is computed alike for a force along a direction and a moment about an axis, in the same fields; only
what is printed says which of the two it is.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from math import floor, isfinite, isnan, log10
from typing import Any, Final

from zwidth.unit_text import unit_of_moments, unit_text

PREFIXES: Final = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
# Prefixes, as powers of ten, that a unit may take; one that is not named takes none: kg has a prefix already, one
# before a square would be squared with it, and mN s/m reads as a metre-newton.
_TAKES: Final = {
    "N/m": (0, 3, 6),
    "N m/rad": (0, 3, 6),
    **dict.fromkeys(("Hz", "s", "m", "N", "J"), tuple(PREFIXES)),
}
DIGITS: Final = 4  # of whatever is computed
OF_ERRORS: Final = 2
OF_RADII: Final = range(4, 11)  # decimals of a spectral radius
SPACE: Final = "\u00a0"
MINUS: Final = "\u2212"
THIN: Final = "\u2009"
UNKNOWN: Final = "\u2013"
NONE: Final = "none"
_RAISED: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_TYPED: Final = {ord(SPACE): " ", ord(THIN): " ", ord(MINUS): "-"}


def exponent_of(value: float) -> int:
    """Exponent of ten, a multiple of 3 that has a prefix, under which |value| reads as 1 to 999.

    0 for 0 and for what is not finite
    """
    if value == 0.0 or not isfinite(value):
        return 0
    # 1e-12, since the logarithm of 1000 may be rounded to less than 3
    return min(max(3 * floor(log10(abs(value)) / 3.0 + 1e-12), -9), 9)


def scaled(exponent: int, unit: str) -> str:
    """A unit under a power of ten: the prefix where the unit may take it, else the power itself.

    >>> scaled(3, "N/m"), scaled(3, "N s/m"), scaled(0, "N s/m")
    ('kN/m', '10³\xa0N s/m', 'N s/m')
    """
    unit = spoken_unit(unit)
    if exponent == 0 or exponent in _TAKES.get(unit, ()):
        return f"{PREFIXES[exponent]}{unit}"
    return f"10{str(exponent).translate(_RAISED)}{SPACE}{unit}"


def _prefix_exponent(value: float, unit: str) -> int:
    """Exponent of ten of the prefix that a value of this unit is written with; 0 for none."""
    exponent = exponent_of(value)
    return exponent if exponent in _TAKES.get(unit, ()) else 0


def number(value: float) -> str:
    """A number in four digits, as a power of ten where it is very large or small; a dash where it is nan.

    >>> number(0.0253667), number(-12.0), number(164944.5)
    ('0.02537', '−12.00', '1.649\u2009×\u200910⁵')
    """
    return _rounded(value, DIGITS)


def uncertain(value: float) -> str:
    """An error, or what else says how exact another number is, in two digits.

    >>> uncertain(0.01234), uncertain(67.08)
    ('0.012', '67')
    """
    return _rounded(value, OF_ERRORS)


def signed(value: float) -> str:
    """A number with its sign, for changes.

    >>> signed(1.21474), signed(-0.0002)
    ('+1.215', '−0.0002000')
    """
    return ("+" if value > 0.0 else "") + number(value)


def percent(share: float) -> str:
    """A share in percent.

    >>> percent(0.49237)
    '49.24\xa0%'
    """
    return f"{number(100.0 * share)}{SPACE}%"


def radius(value: float) -> str:
    """A spectral radius, in four digits of its distance from 1 as far as ten decimals reach.

    >>> radius(0.94553), radius(0.99998766), radius(1.0), radius(1.25)
    ('0.94553', '0.99998766', '1.0000000000', '1.2500')
    """
    if not isfinite(value):
        return number(value)
    away = abs(value - 1.0)
    decimals = DIGITS - 1 - floor(log10(away)) if away else OF_RADII[-1]
    return f"{value:.{min(max(decimals, OF_RADII[0]), OF_RADII[-1])}f}"


def _rounded(value: float, digits: int) -> str:
    """The value in so many digits, as a power of ten where it is very large or small; a dash for nan."""
    if isnan(value):
        return UNKNOWN
    if not isfinite(value):
        return "∞" if value > 0 else f"{MINUS}∞"
    if value == 0.0:
        return "0"
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    magnitude = int(power)
    if -4 <= magnitude < max(digits, 4):
        text = f"{float(f'{mantissa}e{power}'):.{max(digits - 1 - magnitude, 0)}f}"
    else:
        text = f"{mantissa}{THIN}×{THIN}10{str(magnitude).translate(_RAISED)}"
    return text.replace("-", MINUS)


def _unbroken(unit: str) -> str:
    """The unit after a no-break space, its own blanks no-break too; "" where there is no unit."""
    return (SPACE + unit.replace(" ", SPACE)) if unit else ""


def quantity(value: float, unit: str) -> str:
    """A value with its unit and the prefix that suits it; a dash where the value is not known (nan).

    >>> quantity(7849.44, "N/m"), quantity(0.02, "N s/m"), quantity(0.2616, "kg")
    ('7.849\xa0kN/m', '0.02000\xa0N\xa0s/m', '0.2616\xa0kg')
    """
    unit = spoken_unit(unit)
    if isnan(value):
        return UNKNOWN
    if not isfinite(value):
        return f"{number(value)}{_unbroken(unit)}"
    rounded = float(f"{value:.{DIGITS - 1}e}")  # so that 999.996 becomes 1.000 k, not 1000
    exponent = _prefix_exponent(rounded, unit)
    return f"{number(rounded / 10.0**exponent)}{_unbroken(PREFIXES[exponent] + unit)}"


def seconds(time: float) -> str:
    """A time without a prefix: 8200 s, and no 8.2 ks."""
    return quantity(time, "s") if time < 1e3 else f"{number(time)}{SPACE}s"


def as_written(value: float, unit: str = "") -> str:
    """A number that somebody chose, as short as it was written: 1.25 ms, 0.03 kg.

    >>> as_written(0.00125, "s"), as_written(0.03, "kg"), as_written(1000.0, "Hz")
    ('1.25\xa0ms', '0.03\xa0kg', '1\xa0kHz')
    """
    unit = spoken_unit(unit)
    exponent = _prefix_exponent(value, unit)
    shown = f"{value / 10.0**exponent:.6g}"
    if "e" in shown:
        mantissa, power = shown.split("e")
        shown = f"{mantissa}{THIN}×{THIN}10{str(int(power)).translate(_RAISED)}"
    return f"{shown.replace('-', MINUS)}{_unbroken(PREFIXES[exponent] + unit)}"


def area_text(square_metres: float) -> str:
    """An area in mm², cm² or m².

    >>> area_text(0.0379), area_text(4.4e-7), area_text(36.87)
    ('379.0 cm²', '0.4400 mm²', '36.87 m²')
    """
    unit, size = "m²", 1.0
    if square_metres < 1.0:
        unit, size = ("mm²", 1e-6) if 0.0 < square_metres < 1e-4 else ("cm²", 1e-4)
    return f"{number(square_metres / size)} {unit}"


def point(coordinates: Iterable[float], unit: str = "m") -> str:
    """A point or vector as (x, y) where it lies in the plane z = 0, else (x, y, z); no unit for "".

    >>> point([0.0, 0.25, 0.0])
    '(0, 0.25)\xa0m'
    """
    values = [float(c) for c in coordinates]
    if len(values) == 3 and values[2] == 0.0:
        values.pop()
    inside = ", ".join(f"{round(v, 12) + 0.0:.{DIGITS}g}".replace("-", MINUS) for v in values)
    return f"({inside}){SPACE}{unit}".rstrip(SPACE)


def way(direction: Iterable[float]) -> str:
    """A rendered direction, or the axis of moments, or both of a screw.

    >>> way([0.0, 1.0, 0.0]), way([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    ('along (0, 1)', 'about (0, 0, 1)')
    """
    numbers = [float(c) for c in direction]
    linear, angular = numbers[:3], numbers[3:]
    along = [f"along {point(linear, '')}"] if any(linear) else []
    about = ["about (" + ", ".join(f"{round(c, 12) + 0.0:.{DIGITS}g}".replace("-", MINUS) for c in angular) + ")"]
    return " and ".join(along + (about if any(angular) else []))


def amount(value: float | None, unit: str = "") -> str:
    """A quantity on a terminal; "none" where there is no finite one.

    >>> amount(7849.44, "N/m"), amount(-0.2616, "kg"), amount(None, "N/m"), amount(0.25)
    ('7.849 kN/m', '-0.2616 kg', 'none', '0.2500')
    """
    if value is None or not isfinite(value):
        return NONE
    return typed(quantity(value, unit))


def vector(components: Iterable[float], unit: str = "") -> str:
    """A point on a terminal, such as (0, -0.25) m.

    >>> vector([0.0, -0.25, 0.0], "m")
    '(0, -0.25) m'
    """
    return typed(point(components, unit))


def typed(text: str) -> str:
    """The text with plain blanks and minus signs."""
    return text.translate(_TYPED)


HEADINGS: Final = ("energy", "put in", "taken out")
# Entries of the ledger whose names say too little beside others.
LABELS: Final = {"hold": "sample and hold", "quantiser": "encoder steps"}
NEGLIGIBLE: Final = 1e-9  # share of the largest energy that is not worth a line


def energy_label(name: str) -> str:
    """An entry of the energy ledger as people read it."""
    return LABELS.get(name, name)


def energy_rows(entries: Mapping[str, float], stored: float) -> Iterator[tuple[str, str, str]]:
    """Rows of a table (name, energy put in, energy taken out), as texts with "" for the one that does not apply.

    entries  name -> energy that each part has put in, negative if it took it out [J]
    stored   how much more is stored than at the start [J]; it makes the last row
    """
    largest = max([abs(stored), *map(abs, entries.values())])
    for name, energy in entries.items():
        if abs(energy) > NEGLIGIBLE * largest:
            label, size = energy_label(name), amount(abs(energy), "J")
            yield (label, size, "") if energy > 0.0 else (label, "", size)
    if abs(stored) <= NEGLIGIBLE * largest:
        yield "stored since the start", "0 J", ""
    elif stored > 0.0:
        yield "stored since the start", amount(stored, "J"), ""
    else:
        yield "released since the start", "", amount(-stored, "J")


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

    table  the key under which it stands: one of OF_FILES stays as it is, of one of OF_SPACE some keys stay

    >>> keys_of_moments({"stiffness_max_N_per_m": 2.0, "x_m": [0.1], "inner": [{"rigid_mass_kg": 1.0}]})
    {'stiffness_max_Nm_per_rad': 2.0, 'x_m': [0.1], 'inner': [{'rigid_mass_kg_m2': 1.0}]}
    """
    if isinstance(value, Mapping):
        if table in OF_FILES:
            return value
        kept = OF_SPACE.get(table, frozenset())
        return {
            (key if key in kept else _key_of_moments(key)): keys_of_moments(inner, key)
            for key, inner in value.items()
        }
    return [keys_of_moments(inner, table) for inner in value] if isinstance(value, list | tuple) else value


def _key_of_moments(key: Any) -> Any:
    """The key with the unit of a moment about an axis in place of that of a force; keys of lengths stay."""
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
    """A unit of data as texts and figures write it now: of a moment where they speak of one, powers raised.

    >>> spoken_unit("N^2 s/m^2"), spoken_unit("m^2/rad^2")
    ('N² s/m²', 'm²/rad²')
    """
    return unit_text(unit_of_moments(unit) if _moments.get() else unit)
