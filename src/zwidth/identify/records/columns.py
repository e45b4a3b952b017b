"""Which columns a kind of measurement has, and what is wrong with those of a table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from zwidth.device.text_file import header_fault

BRACKETS: Final = re.compile(r"(?P<quantity>[^\[\](){}]+)[\[({](?P<unit>[^\[\](){}]+)[\])}]")
EACH: Final = ".*"  # behind a name: of each part of the device that it is followed by

# Unit that a column is named by -> units that people record it in, and by what they are multiplied.
OTHER_UNITS: Final = {
    "rad": {
        "deg": "pi/180",
        "degree": "pi/180",
        "degrees": "pi/180",
        "mrad": "0.001",
        "rev": "2 pi",
        "counts": "",
    },
    "m": {"mm": "0.001", "um": "1e-6", "cm": "0.01", "counts": ""},
    "N": {"mN": "0.001", "kN": "1000", "V": ""},
    "Nm": {"mNm": "0.001", "Nmm": "0.001", "mN_m": "0.001", "V": ""},
    "s": {"ms": "0.001", "us": "1e-6", "min": "60"},
    "A": {"mA": "0.001"},
    "Hz": {"kHz": "1000", "rad_per_s": "1/(2 pi)"},
    "N_per_m": {"N_per_mm": "1000"},
    "Ns_per_m": {"Ns_per_mm": "1000"},
}


@dataclass(frozen=True)
class Columns:
    """Columns that a kind of measurement has.

    needed    each of them, or one of several where they are alternatives: ("time_s", ("force_N", "torque_Nm")).
              A name that ends in ".*" stands for all columns that begin so, one or more, each of another part of
              the device: "angle_rad.*" for angle_rad.upper and angle_rad.lower; or for angle_rad alone, of a
              device with one such part. Alternatives with ".*" may stand beside each other. MATLAB's names have no
              dot: angle_rad_upper is read, too
    optional  numbers that are read where they are there
    text      the same, words or numbers: names of joints, of those who held the device
    """

    needed: tuple[str | tuple[str, ...], ...]
    optional: tuple[str, ...] = ()
    text: tuple[str, ...] = ()

    @property
    def listed(self) -> str:
        """The needed columns as messages name them."""
        return ", ".join(one if isinstance(one, str) else " or ".join(one) for one in self.needed)

    def choose(self, names: Sequence[str]) -> tuple[list[str], str]:
        """The columns to read of those that a table has, and what is wrong with them; "" if nothing."""
        chosen, faults = list[str](), list[str]()
        for one in self.needed:
            choices = (one,) if isinstance(one, str) else one
            several = any(choice.endswith(EACH) for choice in choices)
            present = [name for choice in choices for name in _matching(choice, names)]
            if len(present) > 1 and not several:
                faults.append(f"columns {' and '.join(present)} are alternatives; keep one of them")
            elif not present:
                faults.append(f"column {' or '.join(choices)} is missing{self._other_unit(choices, names)}")
            chosen += present if several else present[:1]
        optional = [name for one in (*self.optional, *self.text) for name in _matching(one, names)]
        if not optional:  # a force in another unit must not be taken for none
            hints = {one: self._other_unit((one,), names) for one in self.optional}
            faults += [f"column {one} is missing{hint}" for one, hint in hints.items() if hint]
        chosen += optional
        if twice := header_fault(names, [], chosen).partition(";")[0]:
            faults.append(twice)
        if faults and not any(" is there: " in fault for fault in faults):
            separated = header_fault(names, chosen or ["?"]).partition(": ")[2] if len(names) == 1 else ""
            faults.append(separated or _no_header(names) or f"needed are {self.listed}")
        return chosen, "; ".join(faults)

    @staticmethod
    def _other_unit(choices: Sequence[str], names: Sequence[str]) -> str:
        """A hint where a column of the same quantity is there, written otherwise or in another unit."""
        written = {plain_name(name).lower(): name for name in reversed(names)}
        plain = [plain_name(name) for name in names]
        for choice in choices:
            if not choice.endswith(EACH) and choice.lower() in written:
                return f"; '{written[choice.lower()]}' is there: name it {choice}"
            quantity, _, unit = choice.removesuffix(EACH).partition("_")
            each = EACH if choice.endswith(EACH) else ""
            for other, factor in OTHER_UNITS.get(unit, {}).items():
                for there in _matching(f"{quantity}_{other}{each}", plain):
                    by = f"multiply by {factor}" if factor else "multiply by the value of one"
                    named = there.replace(f"{quantity}_{other}", f"{quantity}_{unit}", 1)
                    return f"; {names[plain.index(there)]} is there: {by} and name it {named}"
        return ""


def plain_name(name: str) -> str:
    """A column's name as this project writes it, of one with its unit in brackets; others stay as they are.

    >>> [plain_name(name) for name in ("Time [s]", "torque (mN m)", "motor angle_rad")]
    ['time_s', 'torque_mNm', 'motor angle_rad']
    """
    found = BRACKETS.fullmatch(name.strip())
    if found is None:
        return name
    quantity, unit = found["quantity"].strip().lower(), re.sub(r"[\s*·.]", "", found["unit"])
    return f"{quantity.replace(' ', '_')}_{unit.replace('/', '_per_')}"


def _no_header(names: Sequence[str]) -> str:
    """What stands where the names of columns should; "" where names do."""
    if names and names[0].startswith(("#", "%", "//")):
        return "the line is a comment; begin with the line that names the columns"
    try:
        [float(name) for name in names]
    except ValueError:
        return ""
    return "the line holds numbers; write the names of the columns above them" if names else ""


def _matching(wanted: str, names: Sequence[str]) -> list[str]:
    """The columns that a wanted name stands for, in their order.

    >>> _matching("angle_rad.*", ["time_s", "angle_rad.upper", "angle_rad_lower"])
    ['angle_rad.upper', 'angle_rad_lower']
    """
    if not wanted.endswith(EACH):
        return [wanted] if wanted in names else []
    stem = wanted.removesuffix(EACH)
    return [name for name in dict.fromkeys(names) if name == stem or name.startswith((f"{stem}.", f"{stem}_"))]
