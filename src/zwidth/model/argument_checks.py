"""Checks of what a public function is given: one sentence on what it takes, what came, and what to type."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import inf, isfinite
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, Final, TypeVar

if TYPE_CHECKING:  # the commands that need no numbers import this, too
    from numpy.typing import ArrayLike

    from zwidth.arrays import Floats


T = TypeVar("T")

LONGEST: Final = 40  # characters of a text that are repeated

# (wanted, given) -> what to type; `given` is what is called by that name in the sentence
HINTS: Final = {
    ("Plant", "Device"): "device.at().plant",
    ("Plant", "OperatingPoint"): "point.plant",
    ("Plant", "Loop"): "loop.plant",
    ("Loop", "Device"): "device.at().loop",
    ("Loop", "OperatingPoint"): "point.loop",
    ("Loop", "Plant"): "Loop(plant, controller)",
    ("MultiLoop", "MultiPlant"): "MultiLoop(plant, controller)",
    ("Controller", "Device"): "device.controller",
    ("Controller", "number"): "Controller(sampling_period=...)",
    ("Response", "Device"): "device.response",
    ("Mechanism", "Device"): "device.mechanism",
    ("StabilityChart", "Loop"): "stability_chart(loop)",
    ("OperatingPoint", "Device"): "device.at()",
    ("Device", "text"): "load({})",
    ("Measure", "text"): "find_measure({})",
}


def check_kind(name: str, value: object, kind: type[T] | tuple[type[Any], ...], hint: str = "") -> None:
    """Raise TypeError unless the value is of a kind, such as "loop must be a Loop, got a Device; write ...".

    hint  what to type instead; "": what HINTS has for these two

    >>> check_kind("mass", "heavy", float)
    Traceback (most recent call last):
    TypeError: mass must be a float, got the text 'heavy'
    """
    if isinstance(value, kind):
        return
    wanted = kind[0].__name__ if isinstance(kind, tuple) else kind.__name__
    got = "text" if isinstance(value, str) else "number" if _is_number(value) else type(value).__name__
    if not hint and (wanted, got) in HINTS:
        hint = "write " + HINTS[wanted, got].format(_quoted(value) if isinstance(value, str) else "")
    raise wrong_type(name, f"{_article(wanted)} {wanted}", value, hint)


def wrong_type(name: str, wanted: str, value: object, hint: str = "") -> TypeError:
    """The error for an argument of another kind than is wanted ("a Loop"); hint: what to type instead."""
    return TypeError(f"{name} must be {wanted}, got {describe_value(value)}" + (f"; {hint}" if hint else ""))


def describe_value(value: object) -> str:
    """Describe an argument's value for a message: 0.001, the text 'five', a Device.

    >>> describe_value(0.001), describe_value("x"), describe_value([1]), describe_value(None)
    ('0.001', "the text 'x'", 'a list', 'None')
    """
    if isinstance(value, str):
        return f"the text {_quoted(value)}"
    if value is None or _is_number(value) or isinstance(value, bool):
        return f"{value:.10g}" if isinstance(value, Real) and not isinstance(value, Integral) else str(value)
    return f"{_article(type(value).__name__)} {type(value).__name__}"


def check_number(
    name: str,
    value: object,
    unit: str,
    *,
    least: float = -inf,
    above: float = -inf,
    infinite: bool = False,
    hint: str = "",
) -> None:
    """Raise ValueError unless the value is a number in a range; `hint` is added to the sentence.

    value         or an array of such numbers, of several designs
    least, above  the number must be at least, or greater than this
    infinite      may it be inf?

    >>> check_number("mass", -1.0, "kg", above=0.0)
    Traceback (most recent call last):
    ValueError: mass must be a finite number greater than 0 [kg], got -1
    """
    if getattr(value, "ndim", 0) and getattr(value, "size", 0):
        for extreme in (value.min(), value.max()):  # type: ignore[attr-defined]
            check_number(name, extreme, unit, least=least, above=above, infinite=infinite, hint=hint)
        return
    if _is_number(value):
        number = float(value)  # type: ignore[arg-type]
        if number >= least and number > above and (isfinite(number) or (infinite and number == inf)):
            return
    kind = "a number" if infinite else "a finite number"
    bound = f" greater than {above:g}" if above > -inf else f", at least {least:g}" if least > -inf else ""
    raise ValueError(
        f"{name} must be {kind}{bound} [{unit}], got {describe_value(value)}" + (f"; {hint}" if hint else "")
    )


@dataclass(frozen=True)
class NumberRange:
    """Which numbers a field of a dataclass takes, in which unit; as the arguments of `check_number`."""

    unit: str
    least: float = -inf
    above: float = -inf
    infinite: bool = False
    hint: str = ""


def check_fields(owner: object, ranges: Mapping[str, NumberRange]) -> None:
    """Raise ValueError for the first of these fields that is no number in its range; see `check_number`."""
    for name, one in ranges.items():
        check_number(name, getattr(owner, name), **vars(one))


def broadcast_walls(
    wall_stiffness: ArrayLike, wall_damping: ArrayLike, *, finite: bool = False
) -> tuple[Floats, Floats]:
    """Stiffness [N/m] and damping [N s/m] of walls, broadcast to one shape.

    finite  must all of them be finite? A single wall must; among many, one that is not is the caller's to mark
    Raises  ValueError  for what are no numbers, for shapes that do not go together, for what is not finite of a
            single wall or with `finite`

    >>> broadcast_walls([1000.0, 2000.0], 5.0)
    (array([1000., 2000.]), array([5., 5.]))
    """
    import numpy as np

    given = {"wall_stiffness": (wall_stiffness, "N/m"), "wall_damping": (wall_damping, "N s/m")}
    arrays = []
    for name, (value, unit) in given.items():
        try:
            arrays.append(np.asarray(value, dtype=np.float64))
        except (TypeError, ValueError):
            raise ValueError(f"{name} must be numbers [{unit}], got {describe_value(value)}") from None
        wrong = arrays[-1][~np.isfinite(arrays[-1])]
        if len(wrong) and (finite or arrays[-1].ndim == 0):
            numbers = "a finite number" if arrays[-1].ndim == 0 else "finite numbers"
            raise ValueError(f"{name} must be {numbers} [{unit}], got {float(wrong[0]):g}")
    try:
        K, B = np.broadcast_arrays(*arrays)
    except ValueError:
        one, other = (array.shape for array in arrays)
        raise ValueError(
            f"wall_stiffness has the shape {one} and wall_damping {other}; give equal shapes, or one number for "
            "all"
        ) from None
    return K, B


def check_choice(name: str, value: object, choices: Iterable[str]) -> None:
    """Raise ValueError unless the value is one of these texts."""
    known = tuple(choices)
    if value not in known:
        raise ValueError(f"{name} must be {' or '.join(map(repr, known))}, got {describe_value(value)}")


def _is_number(value: object) -> bool:
    """Whether the value is a real number; True and False are none."""
    return isinstance(value, Real) and not isinstance(value, bool)  # numpy's numbers are registered as such


def _quoted(text: str) -> str:
    """The text in quotes, cut to LONGEST characters."""
    return repr(text if len(text) <= LONGEST else text[: LONGEST - 3] + "...")


def _article(noun: str) -> str:
    """The article "an" before a noun that begins with a capital vowel, as names of classes do, else "a"."""
    return "an" if noun[:1] in "AEIOU" else "a"
